"""Modes that are followed by what moves, through crossings, against closed forms."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.full_order import plan_of
from flexura.study.questions import questions
from flexura.study.questions.single import OneDesign

EXAMPLES = Path(__file__).parents[2] / "examples"

BLOCK = """
flexura: 1
parameters:
  kx: {value: 200 N/mm}
  rotary: {value: 900 N*m/rad}
bodies:
  stage: {centre: [0, 0, 0], mass: 2 kg, inertia: [4 g*m^2, 4 g*m^2, 4 g*m^2]}
springs:
  all:
    nodes: [stage]
    stiffness: {tx: kx, ty: 300 N/mm, tz: 500 N/mm, rx: 901 N*m/rad, ry: 1200 N*m/rad, rz: rotary}
"""

COUPLED = """
flexura: 1
parameters:
  k: {value: 100 N/mm}
bodies:
  one: {centre: [0, 0, 0], mass: 1 kg, inertia: [1 g*m^2, 1 g*m^2, 1 g*m^2]}
  two: {centre: [10 mm, 0, 0], mass: 1 kg, inertia: [1 g*m^2, 1 g*m^2, 1 g*m^2]}
springs:
  first: {nodes: [one], stiffness: {tx: k, ty: 1e7 N/m, tz: 1e7 N/m, rx: 1e5 N*m/rad, ry: 1e5 N*m/rad, rz: 1e5 N*m/rad}}
  second:
    nodes: [two]
    stiffness: {tx: 100 N/mm, ty: 1e7 N/m, tz: 1e7 N/m, rx: 1e5 N*m/rad, ry: 1e5 N*m/rad, rz: 1e5 N*m/rad}
  between: {nodes: [one, two], stiffness: {tx: 1 N/mm}}
"""


def hertz(stiffness, inertia):
    return np.sqrt(np.asarray(stiffness) / inertia) / (2 * np.pi)


def test_modes_are_followed_through_crossings():
    """One rigid body on springs along its axes: every DOF has a frequency of its own, sqrt(k / m) / 2 pi."""
    plan = plan_of(fx.loads(BLOCK))
    kx = np.linspace(1e5, 6e5, 41)
    found = questions(plan, "f(stage.x), f(stage.y), f(rz), f1, f2").values({"kx": kx, "rotary": 3e-3 * kx})
    np.testing.assert_allclose(found.value[:, 0], hertz(kx, 2.0), rtol=1e-9)
    np.testing.assert_allclose(found.value[:, 1], hertz(3e5, 2.0), rtol=1e-9)
    np.testing.assert_allclose(found.value[:, 2], hertz(3e-3 * kx, 4e-3), rtol=1e-9)
    number = (np.isclose(found.value[:, 3], found.value[:, 0], rtol=1e-12)).sum()
    assert 0 < number < 41
    assert found.is_proven.all()
    alone = questions(plan, "f(stage.x)").values({"kx": kx[[7, 30]], "rotary": 3e-3 * kx[[7, 30]]})
    np.testing.assert_allclose(alone.value[:, 0], found.value[[7, 30], 0], rtol=1e-13)


def test_where_modes_coincide_each_displacement_still_has_its_frequency():
    found = questions(fx.loads(BLOCK), "f(stage.x), f(stage.y)").values({"kx": [3e5, 3e5 * (1 + 1e-9)]})
    np.testing.assert_allclose(found.value, hertz(3e5, 2.0), rtol=1e-8)
    assert list(found.reason) == ["", ""]


def test_modes_that_share_a_displacement_are_in_doubt():
    """Two equal bodies with a weak spring between: equal, they share modes, apart each has its own."""
    plan = plan_of(fx.loads(COUPLED))
    found = questions(plan, "f(one.x), f(two.x)").values({"k": [1.0e5, 2e5, 0.5e5]})
    for name in ("one.x", "two.x"):
        assert f"{name} moves in several modes: of its part in f" in found.reason[0]
    assert list(found.reason[1:]) == ["", ""]
    K = np.array([[2e5 + 1e3, -1e3], [-1e3, 1e5 + 1e3]])
    np.testing.assert_allclose(np.sort(found.value[1]), np.sqrt(np.linalg.eigvalsh(K)) / (2 * np.pi), rtol=1e-9)
    assert found.value[1, 0] > found.value[1, 1]
    assert found.value[2, 0] < found.value[2, 1]
    assert np.isfinite(found.value[0]).all()


def test_what_does_not_move_in_the_lowest_modes_has_no_frequency():
    """A slender wire: nothing along its length moves in the twelve modes that bend it, and its tip moves in all."""
    leaf = """
flexura: 1
nodes: {a: [0, 0, 0], b: [100 mm, 0, 0]}
links:
  ab: {nodes: [a, b], material: spring-steel, section: {shape: circle, diameter: 1 mm}, elements: 30}
ground: {a: clamped}
"""
    found = questions(fx.loads(leaf), "f(b.x), f(b.y), f1").values({})
    assert np.isnan(found.value[0, 0])
    assert "does not move in the lowest 12 modes" in found.reason[0]
    assert found.value[0, 1] == pytest.approx(found.value[0, 2], rel=1e-3)
    assert "b.y" not in found.reason[0]


@pytest.mark.parametrize(
    ("name", "ask", "varied"),
    [
        ("xy_stage/xy_stage", "f(table.rx), f(table.y)", ("table_thickness", "leaf_thickness")),
        ("rpr/rpr", "f(platform.x), f(platform.rz)", ("leaf_thickness", "plate")),
    ],
)
def test_modes_of_blocks_are_those_that_the_full_order_follows(name, ask, varied):
    plan = plan_of(fx.load(EXAMPLES / f"{name}.yaml"))
    at, rng = plan.parameter_values(), np.random.default_rng(5)
    designs = {own: at[own] * rng.uniform(0.97, 1.03, 4) for own in varied if own in at}
    assert designs
    asked = questions(plan, ask)
    assert asked.is_stacked
    found = asked.values(designs)
    assert found.is_proven.all()
    for chosen in ([1], [3, 0]):
        some = asked.values({own: value[chosen] for own, value in designs.items()})
        for one, every in ((some.value, found.value), (some.lower, found.lower), (some.reason, found.reason)):
            assert np.array_equal(one, every[chosen])
    single = OneDesign(plan, {own: float(value[3]) for own, value in designs.items()}, asked.quantities)
    for k, own in enumerate(asked.quantities):
        number, doubt = single.mode(own)
        low, high = found.lower[3, k], found.upper[3, k]
        assert low * (1 - 1e-9) <= single.frequencies(own).hertz[number] <= high * (1 + 1e-9)
        assert doubt in found.reason[3]


def test_frequencies_by_what_moves_and_at_poses_have_columns_of_bounds():
    guide = fx.load(EXAMPLES / "guide" / "guide.yaml")
    asked = questions(guide, "f(x), f1 at x = 1 mm, mass")
    assert [own.is_bounded for own in asked.quantities] == [True, True, False]
    found = fx.sweep(guide, vary={"thickness": [0.4e-3, 0.5e-3]}, ask="f(x), f1 at x = 1 mm", workers=1).to_frame()
    for text in ("f(carriage.x)", "f1 at carriage.x = 1 mm"):
        value, low, high = (np.asarray(found[f"{text}{side} [Hz]"]) for side in ("", " lower", " upper"))
        assert (low <= value).all()
        assert (value <= high).all()
        assert (high <= low * 1.001).all()
