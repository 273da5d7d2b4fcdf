"""Leaves that taper: closed forms of beam theory, what they tend to, and their ends."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flexura as fx

LENGTH, WIDTH, THICKNESS = 30.0, 14.0, 0.6


def compliance(width, thickness, corrections="auto", turned=False, **more):
    """Compliance (6, 6) at the end of a leaf along x, clamped at its first node, or at its second one; E = 1."""
    profile = fx.describe.Leaf(width=width, thickness=thickness)
    leaf = fx.describe.Flexure(nodes=("a", "b"), material="unit", reference="z", profile=profile, **more)
    mechanism = fx.Mechanism(
        materials={"unit": fx.describe.Material(E=1.0, nu=0.3, rho=1.0)},
        nodes={"a": (0, 0, 0), "b": (LENGTH, 0, 0)},
        flexures={"leaf": leaf},
        ground={"b" if turned else "a": "clamped"},
        corrections=corrections,
    )
    return fx.compliance(mechanism, nodes=["a" if turned else "b"])


@pytest.mark.parametrize("elements", [1, 10])
@pytest.mark.parametrize("k", [0.3, 0.6])
def test_trapezoids_and_wedges_bend_and_stretch_as_beam_theory_has_them(k, elements):
    """With EI0 of the clamped end, L^3/EI0 times int (1 - s)^2/(1 - k s) ds where the width tapers to 1 - k of it, and
    int (1 - s)^2/(1 - k s)^3 ds where the thickness does; stretch of both int ds/(1 - k s)."""
    plain = {"corrections": "none", "elements": elements}
    wide = compliance((WIDTH, WIDTH * (1 - k)), THICKNESS, **plain)
    thick = compliance(WIDTH, (THICKNESS, THICKNESS * (1 - k)), **plain)
    log = -np.log(1 - k)
    bend, stretch = 12 * LENGTH**3 / (WIDTH * THICKNESS**3), LENGTH / (WIDTH * THICKNESS)
    few = 2e-4 if elements == 1 else 1e-9  # six stations
    assert_allclose(wide[2, 2], bend * (3 * k * k - 2 * k + 2 * (1 - k) ** 2 * log) / (2 * k**3), rtol=few)
    assert_allclose(thick[2, 2], bend * (log - k - k * k / 2) / k**3, rtol=few)
    assert_allclose([wide[0, 0], thick[0, 0]], stretch * log / k, rtol=few)


@pytest.mark.parametrize("ends", [("clamped", "clamped"), ("clamped", "free"), ("free", "clamped")])
def test_without_a_taper_they_are_leaves(ends):
    even = compliance((WIDTH, WIDTH), THICKNESS, ends=ends)
    assert_allclose(even, compliance(WIDTH, THICKNESS, ends=ends), rtol=1e-9, atol=1e-9)


def test_turned_round_they_are_the_same():
    """The same leaf described from its other end, the loads mirrored."""
    mirrored = np.diag([-1.0, 1, 1, 1, -1, -1])
    there = compliance((14.0, 8.0), (0.4, 0.6), ends=("clamped", "free"))
    back = compliance((8.0, 14.0), (0.6, 0.4), ends=("free", "clamped"), turned=True)
    assert_allclose(back, mirrored @ there @ mirrored, rtol=1e-9, atol=1e-9)


def test_roots_are_those_of_the_sizes_at_each_end():
    """What a root adds of stretch and turns is that of a uniform leaf of the size there."""
    for end in (0, 1):
        root = tuple("elastic" if k == end else "rigid" for k in (0, 1))
        added = [
            np.diagonal(
                compliance(*sizes, root=root, turned=end == 1) - compliance(*sizes, root="rigid", turned=end == 1)
            )
            for sizes in (((14.0, 8.0), (0.4, 0.6)), ((14.0, 8.0)[end], (0.4, 0.6)[end]))
        ]
        assert added[0][0] > 0
        assert_allclose(added[0][[0, 4, 5]], added[1][[0, 4, 5]], rtol=1e-7)


def test_a_free_end_that_is_wider_is_free():
    leaf = fx.describe.Flexure(
        nodes=("a", "b"), material="unit", reference="z", profile=fx.describe.Leaf(width=(8.0, 14.0), thickness=0.5)
    )
    mechanism = fx.Mechanism(
        materials={"unit": fx.describe.Material(E=1.0, nu=0.3, rho=1.0)},
        nodes={"a": (0, 0, 0), "b": (LENGTH, 0, 0)},
        flexures={"leaf": leaf},
        ground={"a": "clamped"},
    )
    assert fx.check(mechanism).ends["leaf"] == ("clamped", "free")


@pytest.mark.parametrize(
    ("width", "place", "rule"),
    [
        ((14.0, 0.0), ("Leaf", "width", 1), "must be positive"),
        ((14.0, 8.0, 2.0), ("Leaf", "width"), "at most 2 entries"),
    ],
)
def test_a_taper_to_nothing_is_refused_with_its_place(width, place, rule):
    with pytest.raises(fx.ModelError) as raised:
        fx.describe.Leaf(width=width, thickness=1.0)
    (problem,) = raised.value.problems
    assert problem.path[-len(place[1:]) :] == place[1:] and rule in problem.rule
