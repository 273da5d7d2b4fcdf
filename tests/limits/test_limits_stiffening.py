"""Large displacements that are others than linear ones: beams whose ends are held, against closed forms."""

import re
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.limits import stiffening
from flexura.analysis.limits.limits import States
from flexura.analysis.limits.stiffening import bent_most, stiffening_limits
from helpers.warned_statics import LEAF, E, warned

LENGTH, WIDTH, THICKNESS = 0.1, 0.01, 0.001
STIFFNESS = 192 * E * (WIDTH * THICKNESS**3 / 12) / LENGTH**3


def held_beam(**more):
    """A strip that is clamped at both ends, with a node in the middle."""
    section = fx.describe.Rectangle(width=WIDTH, thickness=THICKNESS)
    ends = {"left": ("a", "m"), "right": ("m", "b")}
    return fx.Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"steel": fx.describe.Material(E=E, nu=0.3, rho=7800.0)},
        nodes={"a": (0, 0, 0), "m": (LENGTH / 2, 0, 0), "b": (LENGTH, 0, 0)},
        links={k: fx.describe.Link(nodes=nodes, section=section, elements=6, **LEAF) for k, nodes in ends.items()},
        ground=more.pop("ground", {"a": "clamped", "b": "clamped"}),
        **more,
    )


def real(linear):
    """Deflection over thickness of a clamped strip under a force in its middle that would linearly be `linear`.

    The linear shape w (12 s^2 - 16 s^3), s = x / L up to the middle, stretches the strip by 2.4 (w / L)^2; with the
    energy of that, w + 0.06 A / I w^3 = linear, exact to third order. A / I is 12 over the thickness squared.
    """
    (found,) = (z.real for z in np.roots([0.72, 0, 1, -linear]) if abs(z.imag) < 1e-12)
    return found


@pytest.mark.parametrize("linear", [0.2, 0.5, 1.0, 2.0])
def test_a_beam_between_clamps_stiffens_as_in_closed_form(linear):
    result = fx.statics(held_beam(), loads={"m": (0, STIFFNESS * linear * THICKNESS, 0, 0, 0, 0)})
    assert result.displacement("m")[1] == pytest.approx(linear * THICKNESS, rel=1e-9)
    found = warned(result)["stiffness"]
    assert found.place == "m"
    assert found.value == pytest.approx(real(linear) / linear, rel=1e-2)
    assert "in place of" in str(found)


def test_all_nodes_and_the_one_that_differs_most_are_told_apart():
    """A strip held at both ends moves less far than linearly, and so does the node that differs most; one that hardly
    moves may move further, and is told with its own share."""
    result = fx.statics(held_beam(), loads={"m": (0, STIFFNESS * 2 * THICKNESS, 0, 0, 0, 0)})
    text, linear = str(warned(result)["stiffness"]), result.displacement("m")[1]
    all_nodes, alone, there, here = (
        float(own)
        for own in re.search(
            r"all nodes together move ([\d.]+) times as far; m, which differs most, moves ([\d.]+) times as far, "
            r"([\d.]+) mm in place of ([\d.]+) mm",
            text,
        ).groups()
    )
    assert here == pytest.approx(1e3 * linear, rel=1e-3) and alone == pytest.approx(there / here, rel=2e-2)
    assert all_nodes == pytest.approx(real(2.0) / 2, rel=1e-2)


def test_small_motions_and_free_ends_say_nothing():
    """A twentieth of the thickness; and twice the thickness where the other end may come nearer."""
    few = fx.statics(held_beam(), loads={"m": (0, 0.05 * STIFFNESS * THICKNESS, 0, 0, 0, 0)})
    free = held_beam(ground={"a": "clamped", "b": {"free": ["tx"]}})
    assert "stiffness" not in warned(few)
    assert "stiffness" not in warned(fx.statics(free, loads={"m": (0, 2 * STIFFNESS * THICKNESS, 0, 0, 0, 0)}))


@pytest.mark.parametrize(("share", "stable"), [(0.95, True), (1.05, False)])
def test_a_blade_that_buckles_sideways_is_unstable(share, stable):
    """Prandtl 1899: a cantilever under a force across its width at its tip, 4.013 sqrt(EI GJ) / L^2."""
    G, t, b = E / 2.6, THICKNESS, WIDTH
    torsion = b * t**3 / 3 * (1 - 0.63 * t / b)
    critical = 4.013 * np.sqrt(E * b * t**3 / 12 * G * torsion) / LENGTH**2
    result = fx.statics(held_beam(ground={"a": "clamped"}), loads={"b": (0, 0, share * critical, 0, 0, 0)})
    told = [str(w) for w in result.warnings if "unstable" in str(w)]
    assert bool(told) is not stable


def test_a_bar_that_twists_moves_none_of_its_nodes():
    twisted = fx.statics(held_beam(ground={"a": "clamped"}), loads={"b": (0, 0, 0, 0.05, 0, 0)})
    assert twisted.displacement("b")[3] > 0.01
    assert "stiffness" not in warned(twisted)


def test_models_that_are_too_large_say_so(monkeypatch):
    monkeypatch.setattr(stiffening, "MOST_COORDINATES", 10)
    result = fx.statics(held_beam(), loads={"m": (0, STIFFNESS * THICKNESS, 0, 0, 0, 0)})
    assert "stiffness" not in warned(result)
    assert any("was not looked at" in note for note in result.notes)


def test_the_forces_that_hold_a_state_give_that_state():
    """Of the least motions the equilibrium is the linear state, whatever the mechanism."""
    for path in ("examples/rpr/rpr.yaml", "examples/guide/guide.yaml", "src/flexura/gallery/delta.yaml"):
        model = fx.assemble(fx.load(Path(__file__).parents[2] / path))
        u = np.linalg.solve(model.K.toarray(), np.random.default_rng(3).standard_normal(model.order))
        bent = bent_most(States(model, 1e3 * u[:, None] / np.abs(u).max()))
        assert bent is not None
        assert stiffening_limits(model, bent._replace(u=1e-9 * bent.u)) == ()


def test_commands_are_told_as_far_as_strokes_go():
    """The free stroke of the stack in an amplifier, and the corner of the range of commands, against the stroke."""
    amplifier = fx.load(Path(__file__).parents[2] / "examples" / "amplifier" / "amplifier.yaml")
    linear = fx.statics(amplifier, actuators={"piezo": 30e-6})
    stroke = fx.stroke(amplifier, actuators={"piezo": (0.0, 30e-6)}, steps=2, nodes=["output"])
    large = abs(stroke.poses[-1].displacement["output"][2])
    for found in (linear, fx.kinetostatics(amplifier, platform="output")):
        (own,) = (w for w in found.warnings if w.kind == "stiffness")
        assert own.value == pytest.approx(large / abs(linear.displacement("output")[2]), rel=2e-3)
        assert f"output, which differs most, moves 1.03 times as far, {1e3 * large:.4g} mm in" in str(own)
