"""Modes that are followed by what moves, through crossings, against closed forms."""

import numpy as np
import pytest

import flexura as fx
from flexura.structure import plan_of
from flexura.study.questions import questions

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
    assert np.array_equal(alone.value[:, 0], found.value[[7, 30], 0])


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
