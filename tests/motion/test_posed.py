"""What is linear about a pose: at no displacement it is what it is at rest, elsewhere the derivative of the stroke."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

import flexura as fx
from flexura.analysis.strain.energy import energies
from flexura.motion.model import MovingModel
from flexura.structure import Design, dissipation
from helpers.large_motion import condensed, inside_strips

EXAMPLES = Path(__file__).parents[2] / "examples"
MOVED = {
    "guide/guide": "carriage.x",
    "pivot/pivot": "arm.ry",
    "tip_tilt/tip_tilt": "mirror.rx",
    "xy_stage/xy_stage": "table.x",
    "amplifier/amplifier": "output.x",
    "rpr/rpr_piezo": "platform.z",
    "imported/guide": "carriage.x",
}

DAMPED = """
flexura: 1
name: damped
corrections: none
materials: {steel: {E: 210 GPa, nu: 0.3, rho: 7800 kg/m^3, yield_stress: 1 GPa, loss_factor: 0.02}}
sections: {leaf: {shape: rectangle, width: 30 mm, thickness: 0.5 mm}}
substructures:
  leg:
    nodes: {foot: [0, 0, 0], head: [100 mm, 0, 0]}
    interface: [foot, head]
    links: {leaf: {nodes: [foot, head], material: steel, section: leaf, reference: y}}
instances:
  leg: {of: leg, pattern: {type: mirror, normal: y, point: [0, 30 mm, 0]}}
nodes: {post: [100 mm, 30 mm, 80 mm], end: [100 mm, 30 mm, 40 mm]}
bodies:
  carriage:
    centre: [100 mm, 30 mm, 0]
    mass: 0.3 kg
    inertia: [4e-4 kg*m^2, 2e-4 kg*m^2, 4e-4 kg*m^2]
    carries: [leg1.head, leg2.head, end]
springs: {coil: {nodes: [post, end], stiffness: {tz: 2 kN/m, tx: 100 N/m}, loss_factor: 0.3}}
dashpots: {damper: {nodes: [end], damping: {ty: 3 N*s/m, rx: 1e-3 N*m*s}}}
actuators:
  coil: {type: force, nodes: [carriage], direction: y}
  between: {type: force, nodes: [post, end], direction: x}
sensors:
  probe: {type: displacement, nodes: [end], direction: y}
  across: {type: displacement, nodes: [post, end]}
ground: {leg1.foot: clamped, leg2.foot: clamped, post: clamped}
"""


@pytest.fixture(scope="module")
def damped() -> fx.Mechanism:
    return fx.loads(DAMPED)


def _close(found: object, wanted: object, size: float = 1e-11) -> None:
    found, wanted = np.asarray(found), np.asarray(wanted)
    assert_allclose(found, wanted, atol=size * np.abs(wanted).max(initial=1e-300), rtol=0)


def _dense(A: object) -> np.ndarray:
    return A.toarray()  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", [*MOVED, "damped"])
def test_a_pose_without_displacement_is_rest(name: str, damped: fx.Mechanism) -> None:
    mechanism = damped if name == "damped" else fx.load(EXAMPLES / f"{name}.yaml")
    mechanism = mechanism.replaced({"gravity": (0.0, 0.0, 0.0), "loads": {}})
    rest, here = fx.assemble(mechanism), fx.assemble(fx.at(mechanism, {MOVED.get(name, "carriage.y"): 0.0}))
    inner = inside_strips(MovingModel.of(rest.design))  # where strips resist a torque that is uneven
    outer = np.setdiff1d(np.arange(rest.order), inner)
    scale = 1 / np.sqrt(rest.K.diagonal()[outer])
    found, wanted = (scale[:, None] * condensed(_dense(model.K), inner) * scale for model in (here, rest))
    _close(found, wanted, 1e-9 if inner else 1e-10)
    scale = 1 / np.sqrt(np.maximum(rest.M.diagonal(), 1e-12 * rest.M.diagonal().max()))
    _close(scale[:, None] * _dense(here.M) * scale, scale[:, None] * _dense(rest.M) * scale, 1e-10)
    _close(here.base_inertia_forces, rest.base_inertia_forces)
    for found, wanted in zip(dissipation(here.design, 0.01), dissipation(rest.design, 0.01), strict=True):
        if inner and _dense(wanted)[inner].any():
            _close(*(condensed(_dense(H), inner) for H in (found, wanted)), 1e-9)
        else:
            _close(_dense(found), _dense(wanted))
    u = np.random.default_rng(3).standard_normal((rest.order, 2)) * rest.K.diagonal()[:, None] ** -0.5
    K = _dense(rest.K)
    u[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, outer)] @ u[outer]) if inner else 0.0
    for found, wanted in zip(
        energies(here, here.node_displacements(u)), energies(rest, rest.node_displacements(u)), strict=True
    ):
        assert found.path == wanted.path
        _close(found.kinetic, wanted.kinetic, 1e-9)
        assert found.strain.keys() == wanted.strain.keys()
        for key, energy in wanted.strain.items():
            _close(found.strain[key], energy, 1e-9)
    own, other = (fx.models.member_stresses(model, u) for model in (here, rest))
    assert [m.name for m in own.members] == [m.name for m in other.members]
    _close([m.von_mises or 0 for m in own.members], [m.von_mises or 0 for m in other.members], 1e-8)


@pytest.fixture(scope="module")
def bent(damped: fx.Mechanism) -> tuple[fx.Mechanism, float]:
    return damped, 0.012


def test_statics_and_stresses_are_the_derivatives_of_the_stroke(bent: tuple[fx.Mechanism, float]) -> None:
    mechanism, d = bent
    here = fx.at(mechanism, {"carriage.y": d})
    h = 1e-6
    path = fx.stroke(mechanism, move={"carriage.y": (d - h, d + h)}, steps=3, n=1, nodes=["carriage", "end"])
    first, _, last = path.poses
    push = last.reaction["carriage.y"] - first.reaction["carriage.y"]
    result = fx.statics(here, loads={"carriage": (0, push, 0, 0, 0, 0)})
    for node in ("carriage", "end"):
        moved = np.subtract(last.displacement[node], first.displacement[node])
        _close(result.displacement(node), moved, 1e-6)
    before, after = path.stresses(0), path.stresses(2)
    rows = fx.models.stress_rows(fx.assemble(here), "leg1.leaf", position=0.0) @ result.displacement_vector
    assert np.abs(rows).max() > 0
    middle = path.stresses(1)
    for member in middle.members:
        total = fx.statics(here, loads={"carriage": (0, 0, 1e-9, 0, 0, 0)}).stresses()[member.name]
        assert total.von_mises == pytest.approx(member.von_mises, rel=1e-6)
        grown = (after[member.name].von_mises or 0) - (before[member.name].von_mises or 0)
        added = (result.stresses()[member.name].von_mises or 0) - (total.von_mises or 0)
        assert added == pytest.approx(grown, rel=1e-3)


def test_sections_see_what_is_added(bent: tuple[fx.Mechanism, float]) -> None:
    mechanism, d = bent
    full, h = fx.assemble(fx.at(mechanism, {"carriage.y": d})), 1e-6
    path = fx.stroke(mechanism, move={"carriage.y": (d - h, d + h)}, steps=3, n=1)
    push = path.poses[2].reaction["carriage.y"] - path.poses[0].reaction["carriage.y"]
    u = fx.statics(full, loads={"carriage": (0, push, 0, 0, 0, 0)}).displacement_vector
    start, _ = path.end_forces["leg"]
    for copy, name in enumerate(("leg1.leaf", "leg2.leaf")):
        change = start[copy, 0, :, 2] - start[copy, 0, :, 0]
        _close(fx.models.internal_force_rows(full, name, position=0.0) @ u, change, 1e-5)


def test_modes_are_those_of_the_stroke_and_proven(bent: tuple[fx.Mechanism, float]) -> None:
    mechanism, d = bent
    own = fx.stroke(mechanism, move={"carriage.y": d}, n=5).poses[0].frequency_hz
    here = fx.at(mechanism, {"carriage.y": d})
    assert_allclose(fx.modes(here, n=5, order="full").frequency_hz, own, rtol=1e-9)
    low = fx.reduce(here, tolerance=1e-4, n=5)
    proof = fx.models.certify(low, n=5)
    assert proof.is_complete
    assert (proof.lower_hz <= own).all() and (own <= proof.upper_hz).all()
    assert_allclose(proof.frequency_hz, own, rtol=1e-4)
    kept = fx.modes(here, n=5)
    assert "about the pose carriage.y = 0.012 m" in " ".join(kept.notes)


def test_a_reduced_pose_keeps_static_response_and_substructures(bent: tuple[fx.Mechanism, float]) -> None:
    mechanism, d = bent
    here = fx.at(mechanism, {"carriage.y": d})
    full = fx.assemble(here)
    low = fx.reduce(here, keep={"leg": 2})
    assert low.order == 6 + 2 * 2
    assert {name.rpartition(".")[0] for name in low.coordinate_names if "." in name} == {"carriage"}
    _close(low.compliance(["carriage"]), fx.compliance(full, nodes=["carriage"]), 1e-9)


@pytest.mark.parametrize("order", ["low", "full"])
def test_responses_about_a_pose_have_its_static_gain(bent: tuple[fx.Mechanism, float], order: str) -> None:
    mechanism, d = fx.loads(DAMPED.replace(", loss_factor: 0.02", "").replace(", loss_factor: 0.3", "")), bent[1]
    here = fx.at(mechanism, {"carriage.y": d})
    C = fx.compliance(here, nodes=["carriage"])
    own = fx.frequency_response(
        here, inputs=["carriage.tz"], outputs=["carriage.ty", "carriage.tz"], frequency_hz=[1e-3, 5.0], order=order,
        damping=0.01,
    )  # fmt: skip
    assert_allclose(own.response[0, :, 0].real, C[[1, 2], 2], rtol=1e-3)
    step = fx.time_response(
        here, inputs={"carriage.tz": np.ones(4001)}, outputs=["carriage.tz"], dt=1e-3, damping=0.5, order=order
    )
    assert step.response[0, -1] == pytest.approx(C[2, 2], rel=1e-3)
    assert any("about the pose" in note for note in step.notes)


def test_what_is_mounted_on_a_body_turns_with_it() -> None:
    text = """
flexura: 1
materials: {steel: {E: 210 GPa, nu: 0.3, rho: 7800 kg/m^3}}
sections: {leaf: {shape: rectangle, width: 10 mm, thickness: 0.5 mm}}
nodes: {foot: [0, 0, 0], tip: [100 mm, 0, 0], post: [100 mm, 40 mm, 0]}
links: {leaf: {nodes: [foot, tip], material: steel, section: leaf, reference: y}}
masses: {weight: {node: tip, mass: 0.1 kg, inertia: [1e-5 kg*m^2, 1e-5 kg*m^2, 1e-5 kg*m^2]}}
springs: {thread: {nodes: [tip, post], stiffness: {tx: 1 N/m}}}
actuators:
  outside: {type: force, nodes: [tip], direction: y}
  aboard: {type: force, nodes: [tip, post], direction: y}
  line: {type: force, nodes: [tip, post]}
sensors:
  probe: {type: displacement, nodes: [tip], direction: y}
  accelerometer: {type: acceleration, nodes: [tip], direction: y}
ground: {foot: clamped, post: clamped}
"""
    here = fx.assemble(fx.at(fx.loads(text), {"tip.rz": 0.4}))
    built = fx.system(here, inputs=["outside", "aboard", "line"], outputs=["probe", "accelerometer"])
    turned = (-np.sin(0.4), np.cos(0.4), 0)
    names = here.plan.topology.node_names
    line = here.positions[names.index("post")] - here.positions[names.index("tip")]
    for channel, direction in zip(
        (*built.inputs, *built.outputs),
        ((0, 1, 0), turned, line / np.linalg.norm(line), (0, 1, 0), turned),
        strict=True,
    ):
        assert_allclose(channel.direction, direction, atol=1e-9, err_msg=channel.name)


def test_a_described_pose_is_written_and_read_back(damped: fx.Mechanism, tmp_path: Path) -> None:
    here = fx.at(damped, {"carriage.y": 0.012, "carriage.rx": 0.01, "end.z": -1e-3})
    assert fx.loads(fx.dumps(here)) == here
    assert fx.at(here, {}) == damped
    text = DAMPED + "at: {carriage: {y: 12 mm, rx: 10 mrad}, end: {z: -1 mm}}\n"
    assert fx.loads(text) == here


@pytest.mark.parametrize(
    ("at", "said"),
    [
        ("at: {carriage: {y: 12}}", "a length carries a unit"),
        ("at: {carriage: {y: 12 deg}}", "length"),
        ("at: {carriage: {}}", "either displacements of a node or one command of an actuator"),
        ("at: {carriage: {y: 1 mm, force: 1 N}}", "either displacements of a node or one command"),
        ("at: {coil: {expansion: 1 um}}", "coil has no command of this kind"),
        ("at: {coyl: {force: 1 N}}", "there is no such actuator"),
        ("at: {coil: {force: 1 mm}}", "force"),
        ("at: {carriage: {ty: 12 mm}}", "ty"),
        ("at: {cariage: {y: 12 mm}}", "did you mean carriage"),
        ("at: {leg1.foot: {y: 12 mm}}", "it cannot move here: it is held"),
    ],
)
def test_a_pose_that_is_none_is_refused_at_its_place(at: str, said: str) -> None:
    with pytest.raises(fx.ModelError, match=said) as caught:
        fx.assemble(fx.loads(DAMPED + at + "\n"))
    assert "at" in str(caught.value)


def test_poses_that_are_not_reached_or_not_stable_are_named(damped: fx.Mechanism) -> None:
    with pytest.raises(fx.SolverError, match=r"at carriage.y = 0.3 m: no equilibrium"):
        fx.assemble(fx.at(damped, {"carriage.y": 0.3}))
    with pytest.raises(fx.OptionError, match=r"carriage\.y: .* is refused; a pose takes finite numbers"):
        fx.at(damped, {"carriage.y": float("nan")})
    with pytest.raises(fx.OptionError, match=r"write NODE\.AXIS"):
        fx.at(damped, {"carriage": 0.01})


def test_what_knows_rest_alone_says_so(bent: tuple[fx.Mechanism, float]) -> None:
    here = fx.at(bent[0], {"carriage.y": bent[1]})
    full = fx.assemble(here)
    asked = {
        "compare": lambda: fx.compare(here),
        "verify": lambda: fx.verify(here),
        "preload": lambda: fx.preload(here),
        "kinetostatics": lambda: fx.kinetostatics(here),
        "natural_frequencies": lambda: fx.natural_frequencies(here, {}, n=3),
        "sensitivities": lambda: fx.models.mode_sensitivities(here),
        "place_sensors": lambda: fx.place_sensors(here, sensors=6),
        "tangent_stiffness": lambda: fx.models.tangent_stiffness(full, np.zeros(full.order)),
        "large": lambda: fx.time_response(
            here, inputs={"coil": np.zeros(5)}, outputs=["carriage.ty"], dt=1e-3, motion="large"
        ),
        "exact": lambda: fx.frequency_response(here, band=(1.0, 9.0), order="exact"),
    }
    for name, ask in asked.items():
        with pytest.raises(fx.OptionError, match=r"of (the|an) undeformed mechanism"):
            ask()
            pytest.fail(name)
    # what is described is checked as it is described, and a stroke leads from rest
    assert fx.check(here).to_dict() == fx.check(bent[0]).to_dict()
    assert fx.stroke(here, move={"carriage.y": 1e-3}).poses[0].move == {"carriage.y": 1e-3}


def test_commands_lead_to_a_pose_as_displacements_do(damped: fx.Mechanism) -> None:
    # one node: a dead load; the drive, free under it, is at the same pose
    moved = fx.stroke(damped, move={"carriage.y": 0.012}, n=4).poses[0]
    coil = fx.at(damped, {"coil": moved.reaction["carriage.y"]})
    assert fx.loads(fx.dumps(coil)) == coil
    assert_allclose(fx.modes(coil, n=4, order="full").frequency_hz, moved.frequency_hz, rtol=1e-7)
    assert "about the pose coil = " in " ".join(fx.modes(coil, n=4).notes)
    stage = fx.load(EXAMPLES / "rpr/rpr_piezo.yaml")
    names = list(fx.check(stage).actuators)
    half = {name: 25.0 * (k + 1) for k, name in enumerate(names)}
    pose = fx.stroke(stage, actuators=half, n=4, nodes=["platform"]).poses[-1]
    here = fx.at(stage, half)
    assert_allclose(fx.modes(here, n=4, order="full").frequency_hz, pose.frequency_hz, rtol=1e-7)
    more = fx.stroke(stage, actuators={**half, names[0]: half[names[0]] + 0.1}, n=1, nodes=["platform"]).poses[-1]
    less = fx.stroke(stage, actuators={**half, names[0]: half[names[0]] - 0.1}, n=1, nodes=["platform"]).poses[-1]
    slope = np.subtract(more.displacement["platform"], less.displacement["platform"]) / 0.2
    own = fx.statics(here, actuators={names[0]: 1.0}).displacement("platform")
    # small rotations from the pose, and what they make of the rotation vector from rest
    own[3:] -= np.cross(pose.displacement["platform"][3:], own[3:]) / 2
    scale = np.array([1, 1, 1, 0.05, 0.05, 0.05])
    _close(own * scale, slope * scale, 1e-5)


def test_pictures_show_the_pose_and_what_moves_from_there(damped: fx.Mechanism) -> None:
    shape = {"carriage.tx": 1.0}
    found = {}
    for d in (None, 0.0, 0.012):
        full = fx.assemble(damped if d is None else fx.at(damped, {"carriage.y": d}))
        u = full.node_displacements(np.array([[shape.get(name, 0.0)] for name in full.dof_names]))[:, :, 0]
        found[d] = fx.view.solids(full, u)
    rest, still, moved = found.values()
    size = rest.size()
    assert still.points.shape == rest.points.shape
    assert_allclose(still.points, rest.points, atol=1e-9 * size)
    assert_allclose(still.motions, rest.motions, atol=0.08)  # straight between nodes at rest, curves at a pose
    away = moved.points[:, 1] - rest.points[:, 1]
    assert away.max() == pytest.approx(0.012, rel=1e-3) and abs(away.min()) < 1e-4
    assert moved.largest_motion() == pytest.approx(1.0, rel=0.05)
    u[:] = 0
    assert fx.view.draw_mode(full, u + 1e-3, title="a mode").axes


def test_numbers_that_are_none_are_refused_by_poses_and_strokes(damped: fx.Mechanism) -> None:
    with pytest.raises(fx.OptionError, match="finite number"):
        fx.at(damped, {"carriage.y": True})
    with pytest.raises(fx.OptionError, match="a number"):
        fx.stroke(damped, move={"carriage.y": True})
    for ask in (
        lambda: fx.assemble(fx.at(damped, {"carriage.ry": 4.0})),
        lambda: fx.stroke(damped, move={"carriage.ry": 4.0}),
    ):
        with pytest.raises(fx.OptionError, match=r"a component of a rotation vector, up to 3\.1 rad"):
            ask()
    assert list(fx.stroke(damped, move={"carriage.y": 1e-3}, nodes="end", n=1).poses[0].displacement) == ["end"]


@pytest.mark.parametrize("name", MOVED)
def test_models_of_a_stack_are_those_of_its_designs(name):
    plan, rng = fx.Plan(fx.load(EXAMPLES / f"{name}.yaml")), np.random.default_rng(3)
    known = {
        key: own.value
        for key, own in plan.mechanism.parameters.items()
        if isinstance(own.value, float) and own.minimum != own.value
    }
    varied = {key: value * rng.uniform(0.99, 1.01, 3) for key, value in list(known.items())[:6]}
    models = list(MovingModel.several(Design.of(plan, varied)))
    for k, model in enumerate(models):
        own = MovingModel.of(Design.of(plan, {key: float(values[k]) for key, values in varied.items()}))
        assert model.names == own.names
        frames, gravity = own.rest.moved(1e-3 * rng.standard_normal(own.dof.shape) * (own.dof >= 0)), np.ones(3)
        (force, *matrices), (wanted, *expected) = (
            (
                moving.forces(frames, gravity).force,
                moving.matrix(moving.forces(frames, gravity).blocks),
                moving.mass(frames),
            )
            for moving in (model, own)
        )
        assert_allclose(force, wanted, rtol=1e-9, atol=1e-12 * np.abs(wanted).max())
        for found, matrix in zip(matrices, expected, strict=True):
            assert_allclose(
                sp.csr_matrix(found).toarray(),
                sp.csr_matrix(matrix).toarray(),
                rtol=1e-9,
                atol=1e-12 * abs(matrix).max(),
            )
