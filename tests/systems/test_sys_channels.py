"""Actuators and sensors: piezo stacks in closed form, what they weigh, and where copies of them stand and point."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from helpers.oscillators import DOFS, INERTIA, MASS, K, beam, body, oscillator, stiffness

KP, REACH = 2e4, 0.05
HZ = np.array([1.0, 20.0, 40.0, 90.0])
W = 2 * np.pi * HZ


def driven(sensors=None, **stack):
    """A body on its spring, pushed along x by a stack from a foot on the ground."""
    piezo = fx.describe.PiezoStack(nodes=("foot", "mass"), stiffness=KP, **stack)
    read = {"force": fx.describe.ForceSensor(actuator="stack")} if sensors is None else sensors
    return fx.Mechanism(
        nodes={"foot": (-REACH, 0, 0)},
        bodies={"mass": body()},
        springs={"spring": fx.describe.Spring(nodes=("mass",), stiffness=stiffness())},
        actuators={"stack": piezo},
        sensors={"x": fx.describe.MotionSensor(type="displacement", nodes=("mass",), direction="x"), **read},
        ground={"foot": "clamped"},
    )


@pytest.mark.parametrize("order", ["low", "full", "exact"])
def test_stack_pushes_a_mass_on_a_spring(order):
    """x/s = kp/(k + kp - m w^2); the force is kp (s - x); a stack of mass adds half of it."""
    found = fx.frequency_response(driven(mass=0.06), frequency_hz=HZ, order=order)
    x = KP / (K[0] + KP - (MASS + 0.03) * W**2)
    assert found.of("x", "stack") == pytest.approx(x, rel=1e-11)
    assert found.of("force", "stack") == pytest.approx(KP * (1 - x), rel=1e-10)
    assert found.unit("x", "stack") == "1" and found.unit("force", "stack") == "N/m"
    turned = fx.frequency_response(driven(mass=0.06), frequency_hz=HZ, quantity="accelerance", order=order)
    assert turned.of("x", "stack") == pytest.approx(-(W**2) * x, rel=1e-11)
    assert np.array_equal(turned.of("force", "stack"), found.of("force", "stack"))
    across = fx.frequency_response(driven(mass=0.06), frequency_hz=HZ, inputs="mass.ty", outputs="mass.ty", order=order)
    assert across.response[:, 0, 0] == pytest.approx(1 / (K[1] - (MASS + 0.03) * W**2), rel=1e-11)


def test_stack_driven_by_a_voltage():
    """The same per volt, and limits of the voltage from the free stroke."""
    gain = 0.25e-6
    built = fx.system(driven(gain=gain, free_stroke=40e-6))
    assert [str(c) for c in built.inputs] == ["stack [V]"]
    assert built.limits == (pytest.approx((0.0, 160.0)),)
    x = KP / (K[0] + KP - MASS * W**2)
    found = fx.frequency_response(built, frequency_hz=HZ)
    assert found.of("x", "stack") == pytest.approx(gain * x, rel=1e-11)
    assert found.of("force", "stack") == pytest.approx(gain * KP * (1 - x), rel=1e-10)


def test_limits_of_actuators():
    """Forces and moments act in both senses; a stack expands up to its stroke, or to blocked force over stiffness."""
    more = {
        "push": fx.describe.ForceActuator(nodes=("mass",), direction="x", limit=7.0),
        "pull": fx.describe.ForceActuator(nodes=("mass",), direction="y"),
        "twist": fx.describe.MomentActuator(nodes=("mass",), direction="z", limit=0.2),
    }
    described = driven(blocked_force=5.0)
    described = fx.Mechanism(**{**dict(described), "actuators": {**described.actuators, **more}})
    built = fx.system(described)
    limits = dict(zip([c.name for c in built.inputs], built.limits, strict=True))
    assert limits["push"] == (-7.0, 7.0) and limits["twist"] == (-0.2, 0.2) and limits["pull"] == (-np.inf, np.inf)
    assert limits["stack"] == pytest.approx((0.0, 5.0 / KP))
    assert [c.unit for c in built.inputs] == ["m", "N", "N", "N*m"]


@pytest.mark.parametrize("slope", [(1, 0, 0), (0.3, -0.5, 0.8), (0, 0, -1)])
def test_stack_acts_along_its_line(slope):
    """Force and elongation between two bodies, along the line between them, opposite on the two."""
    far = 0.08 * np.array(slope) / np.linalg.norm(slope)
    bodies = {"one": body(), "two": body(tuple(far))}
    springs = {key: fx.describe.Spring(nodes=(key,), stiffness=stiffness((6e3,) * 3 + (5.0,) * 3)) for key in bodies}
    stack = {"stack": fx.describe.PiezoStack(nodes=("one", "two"), stiffness=KP)}
    gap = fx.describe.MotionSensor(type="displacement", nodes=("one", "two"))
    built = fx.system(fx.Mechanism(bodies=bodies, springs=springs, actuators=stack, sensors={"gap": gap}), order="full")
    unit = far / np.linalg.norm(far)
    columns = [built.model.dof_names.index(f"{n}.{d}") for n in ("one", "two") for d in DOFS[:3]]
    assert built.B[columns, 0] == pytest.approx(np.concatenate([-KP * unit, KP * unit]), abs=1e-9)
    assert built.rows[0, columns] == pytest.approx(np.concatenate([-unit, unit]), abs=1e-15)
    found = fx.frequency_response(built, frequency_hz=HZ).response[:, 0, 0]
    assert found == pytest.approx(KP / (6e3 / 2 + KP - MASS / 2 * W**2), rel=1e-10)


@pytest.mark.parametrize("slope", [(1, 0, 0), (0.3, -0.5, 0.8), (0.1, 0.9, 0.2)])
@pytest.mark.parametrize("shape", ["rectangle", "circle"])
def test_bonded_stack_is_a_link_of_one_element(slope, shape):
    """A Rayleigh beam with E A/L the stack's stiffness and its mass: the same K, M and mass properties."""
    length, mass, nu = 0.04, 0.012, 0.27
    section = (
        fx.describe.Rectangle(width=8e-3, thickness=5e-3) if shape == "rectangle" else fx.describe.Circle(diameter=6e-3)
    )
    area = 40e-6 if shape == "rectangle" else np.pi / 4 * 36e-6
    end = length * np.array(slope) / np.linalg.norm(slope)
    material = fx.describe.Material(E=KP * length / area, nu=nu, rho=mass / (area * length))
    reference = np.eye(3)[np.abs(slope).argmin()]
    common = {"nodes": {"a": (0, 0, 0), "b": tuple(end)}, "ground": {"a": "clamped"}, "corrections": "none"}
    link = fx.describe.Link(nodes=("a", "b"), material="stuff", section=section, reference=tuple(reference), elements=1)
    stack = fx.describe.PiezoStack(nodes=("a", "b"), stiffness=KP, mass=mass, section=section, nu=nu)
    tip = {"tip": fx.describe.PointMass(node="b", mass=0.1, inertia=INERTIA)}
    beam_ = fx.Mechanism(links={"l": link}, materials={"stuff": material}, masses=tip, theory="rayleigh", **common)
    bonded = fx.Mechanism(actuators={"s": stack}, masses=tip, **common)
    one, two = fx.assemble(beam_), fx.assemble(bonded)
    for A, B in ((one.K, two.K), (one.M, two.M)):
        assert abs(A - B).max() < 1e-12 * abs(A).max()
    proofs = [fx.modes(m, n=2).evidence for m in (beam_, bonded)]
    assert proofs[1].mass_error < 1e-12 and proofs[1].inertia_error < 1e-9
    assert proofs[1].model_mass.mass == pytest.approx(mass + 0.1) == pytest.approx(proofs[0].model_mass.mass)


def test_stack_of_the_example_is_weighed():
    """Four stacks of 7 g, bonded, in mirrored and turned amplifiers."""
    example = Path(__file__).parents[2] / "examples" / "rpr"
    with_, without = (fx.modes(fx.load(example / name), n=6).evidence for name in ("rpr_piezo.yaml", "rpr.yaml"))
    assert with_.model_mass.mass - without.model_mass.mass == pytest.approx(4 * 7e-3, rel=1e-6)
    assert with_.mass_error < 1e-10 and with_.inertia_error < 1e-8


def test_sensors_have_mass():
    """A sensor of mass is a point mass; one between two nodes weighs half on each."""
    one = {"s": fx.describe.MotionSensor(type="acceleration", nodes=("b",), direction="z", mass=0.02)}
    both = {"s": fx.describe.MotionSensor(type="displacement", nodes=("a", "b"), mass=0.02)}
    for sensors, masses in ((one, {"b": 0.02}), (both, {"a": 0.01, "b": 0.01})):
        points = {n: fx.describe.PointMass(node=n, mass=m) for n, m in masses.items()}
        read, heavy = (fx.assemble(beam(2, ground={}, **more)) for more in ({"sensors": sensors}, {"masses": points}))
        assert abs(read.M - heavy.M).max() < 1e-16 and abs(read.K - heavy.K).max() == 0
        proof = fx.modes(beam(2, sensors=sensors), n=1).evidence
        assert proof.mass_error < 1e-12


@pytest.mark.parametrize("kind", ["displacement", "velocity", "acceleration"])
@pytest.mark.parametrize("dof", ["displacement", "rotation"])
def test_relative_sensors(kind, dof):
    """The second node less the first, along a direction of its own; over a moving base both move alike."""
    turns = {"displacement": "rotation", "velocity": "angular_velocity", "acceleration": "angular_acceleration"}
    quantity = kind if dof == "displacement" else turns[kind]
    sensor = {"s": fx.describe.MotionSensor(type=quantity, nodes=("m", "b"), direction=(1, 2, 2))}
    more = {"nodes": {"a": (0, 0, 0), "m": (0.05, 0, 0), "b": (0.12, 0, 0)}}
    two = beam(2, sensors=sensor)
    link = two.links["beam"]
    links = {
        k: fx.describe.Link(**{**dict(link), "nodes": ends}) for k, ends in (("one", ("a", "m")), ("two", ("m", "b")))
    }
    described = fx.Mechanism(**{**dict(two), **more, "links": links})
    t = "t" if dof == "displacement" else "r"
    word = {"displacement": "", "velocity": ":velocity", "acceleration": ":acceleration"}[kind]
    names = [f"{n}.{t}{x}{word}" for n in ("m", "b") for x in "xyz"]
    inputs = ["b.tz", "b.ry", "ground.ty", "ground.rx"]
    found = fx.frequency_response(described, frequency_hz=HZ, inputs=inputs, outputs=["s", *names]).response
    expected = (found[:, 4:7] - found[:, 1:4]).transpose(0, 2, 1) @ np.array([1, 2, 2]) / 3
    assert np.abs(found[:, 0] - expected).max() < 1e-10 * np.abs(found).max()


ANGLE = np.deg2rad(35.0)
TURN = np.array([[np.cos(ANGLE), -np.sin(ANGLE), 0], [np.sin(ANGLE), np.cos(ANGLE), 0], [0, 0, 1]])
NORMAL = np.array([2.0, -1.0, 0.5])
MIRROR = np.eye(3) - 2 * np.outer(NORMAL, NORMAL) / (NORMAL @ NORMAL)
THIRD = np.array([[-0.5, -np.sqrt(0.75), 0], [np.sqrt(0.75), -0.5, 0], [0, 0, 1]])
AT, D = np.array([0.3, 0.1, -0.2]), np.array([1.0, -2.0, 2.0])


def placed(pattern=None):
    """A body on a spring with its own actuators and sensors, turned, moved and repeated."""
    unit = fx.describe.Substructure(
        bodies={"block": body((0.02, 0.01, 0.03))},
        springs={"spring": fx.describe.Spring(nodes=("block",), stiffness=stiffness())},
        actuators={
            "push": fx.describe.ForceActuator(nodes=("block",), direction=tuple(D), limit=3.0),
            "twist": fx.describe.MomentActuator(nodes=("block",), direction=tuple(D)),
            "shake": fx.describe.BaseMotion(direction=tuple(D)),
            "roll": fx.describe.BaseRotation(direction=tuple(D), point=(0.01, 0.02, 0.03)),
        },
        sensors={
            "way": fx.describe.MotionSensor(type="displacement", nodes=("block",), direction=tuple(D)),
            "turn": fx.describe.MotionSensor(type="rotation", nodes=("block",), direction=tuple(D)),
            "load": fx.describe.ForceSensor(actuator="push"),
        },
        interface=("block",),
    )
    rotate = fx.describe.Rotation(axis=(0, 0, 1), angle=ANGLE)
    tie = (
        {"tie": fx.describe.Spring(nodes=("u1.block", "u2.block"), stiffness=fx.describe.DiagonalStiffness())}
        if pattern
        else {}
    )
    more = {"pattern": (pattern,)} if pattern else {}
    instance = fx.describe.Instance(of="unit", at=tuple(AT), rotate=(rotate,), **more)
    return fx.Mechanism(substructures={"unit": unit}, instances={"u": instance}, springs=tie)


@pytest.mark.parametrize(
    ("pattern", "name", "Q", "t"),
    [
        (None, "u", TURN, AT),
        (fx.describe.MirrorPattern(normal=tuple(NORMAL), point=(0.0, 0.0, 0.0)), "u2", MIRROR @ TURN, MIRROR @ AT),
        (fx.describe.CircularPattern(count=3), "u2", THIRD @ TURN, THIRD @ AT),
        (fx.describe.LinearPattern(count=2, step=(0.1, 0.2, 0.3)), "u2", TURN, AT + np.array([0.1, 0.2, 0.3])),
    ],
    ids=["turned", "mirrored", "circular", "linear"],
)
def test_directions_of_copies(pattern, name, Q, t):
    """Polar vectors turn with Q; moments and rotations, being axial, also change sign in a mirror."""
    described = placed(pattern)
    if pattern is not None and pattern.type == "circular":
        more = {"tie2": fx.describe.Spring(nodes=("u2.block", "u3.block"), stiffness=fx.describe.DiagonalStiffness())}
        described = fx.Mechanism(**{**dict(described), "springs": {**described.springs, **more}})
    dofs = [f"{name}.block.{d}" for d in DOFS]
    own = [f"{name}.{key}" for key in ("push", "twist")]
    built = fx.system(
        described, inputs=[*own, *dofs], outputs=[f"{name}.way", f"{name}.turn", f"{name}.load", *dofs], order="full"
    )
    d = Q @ D / 3
    axial = d * np.linalg.det(Q)
    for found, basis in ((built.B.T, built.B[:, 2:].T), (built.rows[[0, 1]], built.rows[3:])):
        assert found[0] == pytest.approx(d @ basis[:3], abs=1e-13)
        assert found[1] == pytest.approx(axial @ basis[3:], abs=1e-13)
    assert built.D[2] == pytest.approx([1.0] + [0.0] * 7) and not built.rows[2].any()
    assert built.limits[0] == (-3.0, 3.0)
    bases = [i.base for i in fx.system(described, inputs=[f"{name}.shake", f"{name}.roll"], outputs=dofs).input_ports]
    assert bases[0] == pytest.approx([*d, 0, 0, 0], abs=1e-14)
    about = Q @ [0.01, 0.02, 0.03] + t
    assert bases[1] == pytest.approx([*np.cross(about, axial), *axial], abs=1e-14)


def test_mirrored_halves_move_as_mirror_images():
    """Driven alike, by pushes and by twists, both halves of a mirrored pair answer alike in their own sensors."""
    described = placed(fx.describe.MirrorPattern(normal=tuple(NORMAL)))
    built = fx.system(described, inputs=["u*.push", "u*.twist"], outputs=["u*.way", "u*.turn"])
    H = fx.frequency_response(built, frequency_hz=HZ).response
    drive = H @ np.array([[1, 0], [1, 0], [0, 1], [0, 1]])
    assert np.abs(drive[:, 0] - drive[:, 1]).max() < 1e-12 * np.abs(drive).max()
    assert np.abs(drive[:, 2] - drive[:, 3]).max() < 1e-12 * np.abs(drive).max()


def test_names_and_wildcards():
    """INSTANCE.NAME, patterns in the order of description, everything by default."""
    described = placed(fx.describe.LinearPattern(count=2, step=(0.1, 0, 0)))
    built = fx.system(described, inputs=["u*.push", "u1.shake"], outputs="*.way")
    assert [c.name for c in built.inputs] == ["u1.push", "u2.push", "u1.shake"]
    assert [c.name for c in built.outputs] == ["u1.way", "u2.way"]
    every = fx.system(described)
    assert len(every.inputs) == 8 and len(every.outputs) == 6
    assert {c.quantity for c in every.inputs} == {"force", "moment", "acceleration", "angular_acceleration"}
    with pytest.raises(fx.OptionError, match=r"u1\.push is named twice"):
        fx.system(described, inputs=["u1.push", "u*.push"])
    with pytest.raises(fx.OptionError, match=r"did you mean u1\.push"):
        fx.system(described, inputs="u1.pish")
    with pytest.raises(fx.OptionError, match="no input matches"):
        fx.system(described, inputs="w*.push")


def test_default_channels_are_the_motions_of_bodies():
    """Without actuators and sensors forces and moments on the rigid bodies, and their displacements."""
    built = fx.system(oscillator())
    assert [c.name for c in built.inputs] == [c.name for c in built.outputs] == [f"mass.{d}" for d in DOFS]
    assert [c.unit for c in built.inputs] == ["N"] * 3 + ["N*m"] * 3
    assert [c.unit for c in built.outputs] == ["m"] * 3 + ["rad"] * 3


def test_what_can_not_move():
    """Described channels at held DOFs are errors of the description, named ones of the call."""
    held = {"s": fx.describe.MotionSensor(type="displacement", nodes=("a",), direction="z")}
    with pytest.raises(fx.ModelError, match=r"sensors\.s: nothing can move here"):
        fx.system(beam(sensors=held), inputs="b.tz")
    pushed = {"f": fx.describe.ForceActuator(nodes=("a",), direction="z")}
    with pytest.raises(fx.ModelError, match=r"actuators\.f: nothing can move here"):
        fx.system(beam(actuators=pushed), inputs=None, outputs="b.tz")
    partly = beam(
        ground={"a": fx.describe.Support(free=("ry",))},
        sensors={"s": fx.describe.MotionSensor(type="rotation", nodes=("a",), direction="y")},
    )
    assert fx.system(partly, inputs="b.tz").rows.any()
    with pytest.raises(fx.OptionError, match=r"a\.tz is held"):
        fx.system(beam(), inputs="a.tz", outputs="b.tz")
    with pytest.raises(fx.OptionError, match=r"a\.tz is held"):
        fx.system(beam(), inputs="b.tz", outputs="a.tz")


def test_no_line_between_two_nodes_at_one_place():
    """A direction must then be given."""
    bodies = {"one": body(), "two": body()}
    springs = {key: fx.describe.Spring(nodes=(key,), stiffness=stiffness()) for key in bodies}
    tie = {"tie": fx.describe.Spring(nodes=("one", "two"), stiffness=stiffness())}

    def sensed(**more):
        sensor = fx.describe.MotionSensor(type="displacement", nodes=("one", "two"), **more)
        return fx.Mechanism(bodies=bodies, springs=springs | tie, sensors={"gap": sensor})

    with pytest.raises(fx.ModelError, match="at one place"):
        fx.system(sensed(), inputs="one.tx")
    assert fx.system(sensed(direction="x"), inputs="one.tx").outputs[0].name == "gap"


def test_parameters_of_actuators():
    """Numbers may be expressions; they are evaluated with the parameters of the call."""
    stroke = fx.describe.parameter("stroke")
    described = driven(free_stroke=2 * stroke)
    described = fx.Mechanism(**{**dict(described), "parameters": {"stroke": fx.describe.Parameter(value=1e-5)}})
    assert fx.system(described).limits[0][1] == pytest.approx(2e-5)
    assert fx.system(described, parameters={"stroke": 3e-5}).limits[0][1] == pytest.approx(6e-5)


def test_impossible_systems():
    """Orders, arguments of reduction and of finished models."""
    with pytest.raises(fx.OptionError, match="order is low or full"):
        fx.system(oscillator(), order="exact")
    with pytest.raises(fx.OptionError, match="keep belongs to order low"):
        fx.system(oscillator(), order="full", keep=2)
    with pytest.raises(fx.OptionError, match="finished model"):
        fx.system(fx.reduce(oscillator()), keep=2)
