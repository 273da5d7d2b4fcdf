"""Kinetostatics: a lever, guides and pivots by hand, and the example with its stacks against statics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from helpers.shell import flexura
from helpers.stages import EI, B, E, L, T, guide, pivot

KP, K_TURN, NEAR, FAR = 2e6, 6.0, 0.01, 0.06
INERTIA = (1e-4, 2e-4, 3e-4)
STIFF = {"tx": 1e12, "ty": 1e12, "tz": 1e12, "rx": 1e9, "ry": 1e9, "rz": K_TURN}


def lever(**stack):
    """A rigid lever that turns about z in the origin: a stack pushes near the pivot, the platform is far from it."""
    actuator = fx.describe.PiezoStack(nodes=("foot", "input"), stiffness=KP, **stack)
    return fx.Mechanism(
        nodes={"foot": (NEAR, -0.04, 0), "input": (NEAR, 0, 0), "pin": (0, 0, 0)},
        bodies={"arm": fx.describe.RigidBody(centre=(FAR, 0, 0), carries=("input", "pin"), mass=0.1, inertia=INERTIA)},
        springs={"pivot": fx.describe.Spring(nodes=("pin",), stiffness=fx.describe.DiagonalStiffness(**STIFF))},
        actuators={"stack": actuator},
        ground={"foot": "clamped"},
    )


K_IN = K_TURN / NEAR**2
"""What the stack pushes against, N/m."""
RIGHT = 1e-5
"""The pivot is a million times stiffer than the stack."""


@pytest.mark.parametrize("gain", [None, 0.3e-6])
def test_lever(gain):
    """Ratio of the arms, and a stroke shared between the stack and what it pushes against: s kp/(kp + K/a^2)."""
    found = fx.kinetostatics(lever(gain=gain, free_stroke=30e-6))
    unit = 1.0 if gain is None else gain
    stroke = unit * KP / (KP + K_IN)
    assert found.platform == "arm" and [str(c) for c in found.inputs] == ["stack [m]" if gain is None else "stack [V]"]
    assert found.amplification()[[1, 5]] == pytest.approx([FAR / NEAR, 1 / NEAR], rel=RIGHT)
    assert np.abs(found.amplification()[[0, 2, 3, 4]]).max() < 1e-4
    assert found.input_stiffness == pytest.approx([K_IN], rel=1e-4)
    assert found.elongation == pytest.approx(np.array([[stroke]]), rel=RIGHT)
    assert found.coupling[[1, 5], 0] == pytest.approx([stroke * FAR / NEAR, stroke / NEAR], rel=RIGHT)
    assert found.jacobian[[1, 5], 0] == pytest.approx([FAR / NEAR, 1 / NEAR], rel=RIGHT)
    top = 30e-6 / unit
    assert found.limits[0] == pytest.approx((0, top))
    assert found.workspace[1] == pytest.approx([0.0, top * stroke * FAR / NEAR], rel=RIGHT)
    assert found.vertices()[:, 1] == pytest.approx([0.0, top * stroke * FAR / NEAR], rel=RIGHT)
    assert found.stiffness[5] == pytest.approx(K_TURN + KP * NEAR**2, rel=RIGHT)
    assert found.stiffness[1] == pytest.approx((K_TURN + KP * NEAR**2) / FAR**2, rel=RIGHT)
    assert found.compliance_free[5, 5] == pytest.approx(1 / K_TURN, rel=RIGHT)
    assert found.compliance_locked[5, 5] * K_TURN < 1e-5


def test_freedom_of_the_lever():
    """One rotation about z through the pivot, owned by the stack."""
    found = fx.kinetostatics(lever(free_stroke=30e-6))
    assert found.kind == "1R"
    (turn,) = found.freedoms
    assert turn.axis.direction == pytest.approx((0, 0, 1), abs=1e-6)
    assert turn.axis.point == pytest.approx((0, 0, 0), abs=1e-6)
    assert turn.twist[5] == pytest.approx(1.0) and turn.share == pytest.approx(1.0, abs=1e-4)
    assert turn.command[0] == pytest.approx(NEAR * (KP + K_IN) / KP, rel=RIGHT)
    assert turn.stroke == pytest.approx(15e-6 / turn.command[0], rel=1e-9)


def test_lever_driven_by_a_force_or_a_moment():
    """Without stiffness of their own: displacement per newton, and per newton metre."""
    push = fx.describe.ForceActuator(nodes=("input",), direction="y", limit=5.0)
    twist = fx.describe.MomentActuator(nodes=("arm",), direction="z")
    parts = {**dict(lever()), "actuators": {"push": push, "twist": twist}, "ground": {}}
    parts["nodes"] = {n: x for n, x in parts["nodes"].items() if n != "foot"}
    described = fx.Mechanism(**parts)
    found = fx.kinetostatics(described)
    assert found.coupling[5] == pytest.approx([NEAR / K_TURN, 1 / K_TURN], rel=RIGHT)
    assert found.input_stiffness == pytest.approx([K_IN, K_TURN], rel=1e-4)
    assert found.amplification([1, 0])[1] == pytest.approx(FAR / NEAR, rel=RIGHT)
    assert found.workspace[5] == pytest.approx([-np.inf, np.inf])
    only = fx.kinetostatics(described, actuators="push")
    assert only.workspace[5] == pytest.approx([-5 * NEAR / K_TURN, 5 * NEAR / K_TURN], rel=RIGHT)
    with pytest.raises(fx.OptionError, match="limits"):
        found.vertices()
    assert found.to_dict()["workspace"][5] == [None, None]


def test_parallel_guide_is_one_translation():
    """Along x, of stiffness 24 EI/L^3 at half the height of the leaves; about y 2 EI/L + EA d^2/(2 L)."""
    found = fx.kinetostatics(guide())
    assert found.kind == "1T"
    (slide,) = found.freedoms
    assert np.abs(slide.axis.direction) == pytest.approx((1, 0, 0), abs=1e-6)
    assert slide.axis.is_translation and slide.command == () and np.isnan(slide.share)
    assert found.stiffness[0] == pytest.approx(24 * EI / L**3, rel=1e-8)
    assert found.stiffness[4] == pytest.approx(2 * EI / L + E * B * T / L * 0.05**2 / 2, rel=1e-8)
    assert found.coupling.shape == (6, 0) and np.array_equal(found.compliance, found.compliance_free)


def test_cross_pivot_is_one_rotation():
    """About y through the crossing, of stiffness 2 EI/L: leaves that cross in their middle bend in circles."""
    found = fx.kinetostatics(pivot())
    assert found.kind == "1R"
    (turn,) = found.freedoms
    assert np.abs(turn.axis.direction) == pytest.approx((0, 1, 0), abs=1e-6)
    assert turn.axis.point == pytest.approx((0, 0, 0), abs=1e-9)
    assert found.stiffness[4] == pytest.approx(2 * EI / L, rel=1e-8)


def test_no_clear_freedom():
    """A body equally soft in all directions has none to name."""
    spring = fx.describe.Spring(
        nodes=("mass",), stiffness=fx.describe.DiagonalStiffness(tx=1e3, ty=2e3, tz=3e3, rx=0.1, ry=0.2, rz=0.3)
    )
    bodies = {"mass": fx.describe.RigidBody(mass=0.1, inertia=INERTIA, carries=("tip",))}
    described = fx.Mechanism(nodes={"tip": (0.02, 0, 0)}, bodies=bodies, springs={"s": spring})
    found = fx.kinetostatics(described)
    assert found.kind == "unclear" and not found.is_clear and found.freedoms == ()
    assert "no clear freedoms" in found.notes[0]


@pytest.fixture(scope="module")
def rpr():
    """The example with its four stacks."""
    model = fx.assemble(fx.load(Path(__file__).parents[2] / "examples" / "rpr" / "rpr_piezo.yaml"))
    return model, fx.kinetostatics(model)


def test_example_has_two_rotations_and_a_lift(rpr):
    """The kind that gives the mechanism its name, with axes along x and y and a slide along z."""
    found = rpr[1]
    assert found.kind == "2R1T"
    for freedom, axis in zip(found.freedoms, np.eye(3), strict=True):
        assert np.abs(freedom.axis.direction) == pytest.approx(axis, abs=1e-6)
        assert freedom.share > 0.5 and freedom.stroke is not None and freedom.stroke > 0
    assert [f.kind for f in found.freedoms] == ["R", "R", "T"]
    lift = np.array(found.freedoms[2].command)
    assert lift == pytest.approx(np.full(4, lift[0]), rel=1e-6)


def test_commands_of_the_example_do_what_they_say(rpr):
    """Statics under the commands of a freedom gives its twist; columns of the coupling are single commands."""
    model, found = rpr
    names = [c.name for c in found.inputs]
    for freedom in found.freedoms:
        state = fx.statics(model, actuators=dict(zip(names, freedom.command, strict=True)))
        moved, twist = state.displacement("platform"), np.array(freedom.twist)
        size = np.array([1, 1, 1, 0.05, 0.05, 0.05])
        assert np.abs((moved - twist) * size).max() < 2e-2 * np.abs(twist * size).max()
    for k, name in enumerate(names):
        state = fx.statics(model, actuators={name: 100.0})
        moved = state.displacement("platform")
        for at in (slice(0, 3), slice(3, 6)):
            assert np.abs(found.coupling[at, k] * 100 - moved[at]).max() < 1e-6 * np.abs(moved[at]).max()
        own = {a.name: a for a in state.actuators}
        elongations = [own[n].elongation for n in names]
        assert found.elongation[:, k] * 100 == pytest.approx(elongations, rel=1e-6, abs=1e-14)
        pushed = own[name].force / own[name].elongation
        assert found.input_stiffness[k] == pytest.approx(pushed, rel=1e-6)


def test_workspace_of_the_example(rpr):
    """The box holds the corners and touches them; a corner is what statics says."""
    model, found = rpr
    corners = found.vertices()
    assert corners.shape == (16, 6)
    assert corners.min(axis=0) == pytest.approx(found.workspace[:, 0], rel=1e-9, abs=1e-18)
    assert corners.max(axis=0) == pytest.approx(found.workspace[:, 1], rel=1e-9, abs=1e-18)
    names = [c.name for c in found.inputs]
    full = fx.statics(model, actuators={n: top for n, (_, top) in zip(names, found.limits, strict=True)})
    assert np.abs(corners - full.displacement("platform")).max(axis=1).min() < 1e-6 * np.abs(corners).max()
    lift = full.displacement("platform") / np.mean([a.elongation for a in full.actuators])
    assert found.amplification()[2] == pytest.approx(lift[2], rel=1e-6)
    # 9 mm from leaf to leaf, 1.5 mm apart in height: rigid arms on free hinges would pull the platform down sixfold
    assert -6.0 < lift[2] < -5.7


def test_impossible_questions():
    """A platform that is held or not clear, commands that do not fit, and what floats."""
    with pytest.raises(fx.OptionError, match="foot is held"):
        fx.kinetostatics(lever(), platform="foot")
    with pytest.raises(fx.OptionError, match="nowhere"):
        fx.kinetostatics(lever(), platform="nowhere")
    two = fx.Mechanism(
        bodies={k: fx.describe.RigidBody(mass=0.1, inertia=INERTIA) for k in ("one", "two")},
        springs={
            k: fx.describe.Spring(
                nodes=n, stiffness=fx.describe.DiagonalStiffness(tx=1e3, ty=1e3, tz=1e3, rx=1, ry=1, rz=1)
            )
            for k, n in (("a", ("one",)), ("b", ("one", "two")))
        },
    )
    with pytest.raises(fx.OptionError, match="2 moving bodies"):
        fx.kinetostatics(two)
    assert fx.kinetostatics(two, platform="two").platform == "two"
    free = fx.Mechanism(bodies={"one": fx.describe.RigidBody(mass=0.1, inertia=INERTIA)})
    with pytest.raises(fx.SolverError, match="move freely"):
        fx.kinetostatics(free)
    found = fx.kinetostatics(lever())
    for command in ([1, 2], "all", [np.nan], [[1]]):
        with pytest.raises(fx.OptionError, match="1 finite numbers"):
            found.amplification(command)
    with pytest.raises(fx.OptionError, match="stretch no actuator"):
        found.amplification([0.0])
    with pytest.raises(fx.OptionError, match="no input 'stick'"):
        fx.kinetostatics(lever(), actuators="stick")


def test_what_supports_hold_has_no_compliance(tmp_path, monkeypatch):
    """A body on rails: infinitely stiff but along them, `held` for readers, and a report of it is made."""
    monkeypatch.chdir(tmp_path)
    carriage = fx.describe.RigidBody(centre=(0, 0, 0), mass=0.1, inertia=INERTIA)
    along = fx.describe.DiagonalStiffness(tx=1.0, ty=500.0, tz=1.0, rx=1.0, ry=1.0, rz=1.0)
    model = fx.Mechanism(
        bodies={"carriage": carriage},
        springs={"spring": fx.describe.Spring(nodes=("carriage",), stiffness=along)},
        ground={"carriage": fx.describe.Support(fixed=("tx", "tz", "rx", "ry", "rz"))},
    )
    found = fx.kinetostatics(model, platform="carriage")
    assert found.stiffness[1] == pytest.approx(500.0) and np.isinf(np.delete(found.stiffness, 1)).all()
    fx.save(model, "carriage.yaml")
    printed = flexura("kinetostatics", "carriage.yaml", "--platform", "carriage").stdout
    rows = {words[0]: words[1:] for line in printed.splitlines() if (words := line.split())}
    assert rows["ty"][0] == "500" and rows["tx"] == ["held"]
    made = fx.report(model, out="carriage.html")
    assert made.states["freedoms"] == "shown" and ">held<" in Path("carriage.html").read_text(encoding="utf-8")
