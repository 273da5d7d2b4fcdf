"""Everything of a design has the slopes of its numbers, and the numbers stay as they are without slopes."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.derivatives import frequency_slopes
from flexura.duals import Dual, plain
from flexura.mechanism import with_rigid_bodies, with_rigid_roots
from flexura.structure import Design, Plan

EXAMPLES = Path(__file__).parents[2] / "examples"


def numbers(design):
    found = {"positions": design.geometry.positions}
    for name, own in design.matrices.items():
        part = design.plan.parts[name]
        found[name, "T"] = own.T
        found[name, "G"] = design.node_transforms(name, np.arange(part.n_nodes))
        if len(part.connectivity):
            elements = own.elements
            found.update({(name, key): getattr(elements, key) for key in ("K", "M", "C", "geometric")})
            torsion = elements.torsion._asdict()
            found.update({(name, key): torsion[key] for key in ("stiffness", "mean", "A", "B", "Z", "bow")})
        for k, (_, _, K, M) in enumerate(own.discrete_elements):
            found.update({(name, k, key): A for key, A in (("K", K), ("M", M)) if A is not None})
    return found


@pytest.mark.parametrize("example", ["amplifier/amplifier", "guide/guide", "pivot/pivot", "rpr/rpr_piezo"])
def test_all_numbers_of_a_design_have_slopes(example):
    """With rigid roots: elastic ones have a kink where a member is flush with its block, as members of these are
    (slopes of roots: tests/beam/test_root.py, of bodies that bend: tests/analysis/test_bodies_that_bend.py)."""
    plan = Plan(with_rigid_bodies(with_rigid_roots(fx.load(EXAMPLES / f"{example}.yaml"))))
    at = {name: float(value) for name, value in plan.parameter_values().items() if value}
    names = [name for name in at if plan.mechanism.parameters[name].unit not in ("", "1")]
    names = [name for name in names if isinstance(plan.mechanism.parameters[name].value, float)]
    found, bare = numbers(Design.with_slopes(plan, {}, names)), numbers(Design.of(plan))
    assert names and any(isinstance(own, Dual) for own in found.values())
    for p, name in enumerate(names):
        step = 1e-6 * at[name]
        up, down = (numbers(Design.of(plan, {name: at[name] + sign * step})) for sign in (1, -1))
        for key, own in found.items():
            size = np.abs(bare[key]).max(initial=0.0)
            np.testing.assert_allclose(plain(own), bare[key], rtol=1e-12, atol=1e-13 * size)
            slope = own.slope[p] if isinstance(own, Dual) else np.zeros(np.shape(own))
            assert np.abs(slope - (up[key] - down[key]) / (2 * step)).max(initial=0.0) <= 2e-8 * size / at[name]


def test_geometry_that_stands_still_has_no_slopes():
    plan = Plan(fx.load(EXAMPLES / "pivot" / "pivot.yaml"))
    design = Design.with_slopes(plan, {}, ["thickness"])
    assert isinstance(design.geometry.positions, np.ndarray)
    assert Design.of(plan).geometry.positions is design.geometry.positions


def test_a_design_with_slopes_leaves_those_without_alone():
    plan = Plan(fx.load(EXAMPLES / "guide" / "guide.yaml"))
    before = Design.of(plan)
    assert isinstance(Design.with_slopes(plan, {}, ["length"]).geometry.positions, Dual)
    assert Design.of(plan).geometry is before.geometry


NOTCH = """
flexura: 1
parameters: {L: %s, r: 3 mm, w: 0.5 mm}
nodes: {a: [0, 0, 0], b: [L, 0, 0]}
flexures:
  n: {nodes: [a, b], material: spring-steel, reference: y, profile: {type: notch, width: 10 mm, contour: %s}}
bodies: {m: {centre: [L + 10 mm, 0, 0], mass: 1 kg, inertia: [1 kg*mm^2, 1 kg*mm^2, 1 kg*mm^2], carries: [b]}}
ground: {a: clamped}
"""
CIRCLE, ELLIPSE = "{shape: circular, radius: r, web: w}", "{shape: elliptical, depth: r, web: w}"


@pytest.mark.parametrize("length", ["6 mm", "5.999999999999999 mm", "6.000000000000001 mm", "2*2.9999999999999996 mm"])
def test_a_circle_that_ends_where_the_notch_does_but_for_round_off_has_no_slope(length):
    found = frequency_slopes(Design.with_slopes(fx.Plan(fx.loads(NOTCH % (length, CIRCLE))), {}, ("L", "r", "w")), 1)
    assert np.isnan(found.slope[0, :2]).all()
    assert found.slope[0, 2] > 0
    assert found.kinks == (0, 1)


@pytest.mark.parametrize("radius", [1.7, 2.9999, 3.0, 3.1, 4.123456789])
def test_a_circle_that_always_ends_where_the_notch_does_has_the_slopes_of_an_ellipse(radius):
    at = {"r": 1e-3 * radius}
    circle = frequency_slopes(Design.with_slopes(fx.Plan(fx.loads(NOTCH % ("2*r", CIRCLE))), at, ("r", "w")), 1)
    plan = fx.Plan(fx.loads(NOTCH % ("6 mm", ELLIPSE)))
    ellipse = frequency_slopes(Design.with_slopes(plan, {**at, "L": 2 * at["r"]}, ("L", "r", "w")), 1)
    expected = [2 * ellipse.slope[0, 0] + ellipse.slope[0, 1], ellipse.slope[0, 2]]
    np.testing.assert_allclose(circle.slope[0], expected, rtol=1e-7)
