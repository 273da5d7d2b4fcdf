"""Misaligned mountings beside closed forms: moments, lateral buckling, and exact mechanisms that do not mind."""

import numpy as np
import pytest

import flexura as fx
from flexura.errors import OptionError
from helpers.counted_stages import B, E, G, L, T, guide, hexapod
from helpers.over import over

ABOUT_X = 3
STIFF = E * T * B**3 / 12 / L
"""N m/rad: a leaf in bending in its plane."""


def alone(direction, size, make=guide, node="g0", **how):
    """Off in one direction of one mount alone: quantities by name."""
    tolerance = np.zeros(6)
    tolerance[direction] = size
    found = fx.misalignment(make(), mounts={node: tolerance}, samples=0, **how)
    return dict(zip((own.name for own in found.quantities), found.values[1].tolist(), strict=True)), found


def test_a_small_misalignment_bends_both_leaves_in_their_planes():
    """The mount turns about the middle of its leaf: nothing but bending resists, E t w^3 / 12 L of two in series."""
    small = 1e-6
    found = fx.misalignment(guide(), mounts={"g0": (0, small * L / 2, 0, small, 0, 0)}, samples=0)
    [row] = [k for k, own in enumerate(found.offsets) if own[1] > 0 and own[ABOUT_X] > 0]
    force, moment = found.values[row, :2]
    assert moment == pytest.approx(STIFF / 2 * small, rel=1e-3)
    assert force * L < 1e-2 * moment
    [first, _] = fx.constraints(guide()).competitors
    assert moment == pytest.approx(first.force * small, rel=1e-3)


def test_a_misaligned_guide_buckles_laterally():
    """A clamped strip buckles under 2 pi sqrt(E I G J) / L in its plane (Timoshenko, Gere 1961, section 6.2), and a
    guide of two loses its stiffness along the stroke on the way there (Meijaard, Brouwer, Jonker 2010)."""
    bending, torsion = E * B * T**3 / 12, G * B * T**3 / 3
    critical = 2 * np.pi * np.sqrt(bending * torsion) / L / (STIFF / 2)
    assert alone(ABOUT_X, 1e-3)[0]["factor to buckle"] * 1e-3 == pytest.approx(critical, rel=0.02)
    shares = (0.0, 0.2, 0.4, 0.6, 0.8)
    along, up = np.array(
        [
            [own["stiffness stage.tx"], own["stiffness stage.tz"]]
            for own, _ in (alone(ABOUT_X, share * critical or 1e-12) for share in shares)
        ]
    ).T
    assert (np.diff(along) < 0).all() and along[-1] < 0.6 * along[0]
    assert up[-1] > 0.99 * up[0]
    _, found = alone(ABOUT_X, 1.1 * critical)
    assert {own.kind for own in found.warnings} & {"buckling", "no equilibrium"}


@over("direction", range(6))
def test_an_exact_mechanism_does_not_mind(direction):
    """Six wires hold a stage each just once: whatever one mount does, it meets the softness of wires alone."""
    size = 1e-6 if direction < 3 else 1e-4
    own, found = alone(direction, size, hexapod, "g3", n=1)
    axial = E * np.pi / 4 * 0.5e-3**2 / 0.06
    assert own["force at g3"] < 1e-2 * axial * size * (1.0 if direction < 3 else 0.06)
    assert abs(found.quantities[0].nominal) < 1e-13  # N, round-off of poses at rest


def test_misalignments_of_two_mounts_with_samples():
    found = fx.misalignment(guide(), mounts={"g*": (1e-5, 1e-4)}, samples=16, n=2)
    assert [own.node for own in found.mounts] == ["g0", "g1"]
    assert found.offsets.shape[1] == 12 and found.first_sample == 1 + 2 * 12
    drawn = found.offsets[found.first_sample : found.first_sample + 16]
    assert (np.abs(drawn) <= np.tile(np.repeat([1e-5, 1e-4], 3), 2)).all() and len(np.unique(drawn, axis=0)) == 16
    for own in found.quantities:
        low, middle, high = own.percentiles
        assert np.isnan(middle) or low <= middle <= high
    moment = found.quantity("moment at g0")
    assert moment.worst >= np.nanmax(found.values[:, 1]) > moment.percentiles[2] and moment.most_by[-3:] == ".rx"
    assert moment.worst == pytest.approx(STIFF / 2 * 2e-4, rel=0.05)  # both mounts turn, against each other
    again = fx.misalignment(guide(), mounts={"g*": (1e-5, 1e-4)}, samples=16, n=2)
    assert np.array_equal(found.values, again.values, equal_nan=True)


def test_at_a_pose():
    moved, _ = alone(ABOUT_X, 1e-4, node="g0", move={"stage.x": 2e-3})
    at_rest, _ = alone(ABOUT_X, 1e-4, node="g0")
    assert moved["stiffness stage.tz"] < 0.9 * at_rest["stiffness stage.tz"]
    assert np.isnan(moved["stiffness stage.tx"])


@over(
    ("how", "why"),
    [
        ({"mounts": {}}, "at least one node"),
        ({"mounts": {"e0": (1e-4, 1e-3)}}, "is no mount: the ground clamps g0, g1"),
        ({"mounts": {"g0": (1e-4,)}}, "a tolerance of g0 is m and rad"),
        ({"mounts": {"g0": (-1e-4, 0)}}, "none negative"),
        ({"mounts": {"g0": (0, 0)}}, "nothing is misaligned"),
        ({"mounts": {"g0": (1, 1), "g*": (1, 1)}}, "misaligned twice"),
        ({"mounts": {"g0": (1e-4, 0)}, "samples": -1}, "samples is a whole number"),
        ({"mounts": {"g0": (1e-4, 0)}, "node": "x"}, "no node 'x'"),
        ({"mounts": {"g0": (1e-4, 0)}, "move": {"stage.x": (0, 1)}}, "moved by a finite number"),
        ({"mounts": {"g0": (1e-4, 0)}, "move": {"g0.x": 1e-4}}, "held by the ground"),
    ],
)
def test_what_is_refused(how, why):
    with pytest.raises(OptionError, match=why):
        fx.misalignment(guide(), **how)


def test_where_it_buckles_or_has_no_equilibrium_it_says_so():
    found = fx.misalignment(guide(), mounts={"g0": (0, 0, 0, 0.05, 0, 0)}, samples=0)
    assert (found.values[1:3, 2] < 0).all() and np.isnan(found.values[1:3, [0, 1, -1]]).all()
    assert "the mechanism has buckled" in found.warnings[0].text
    found = fx.misalignment(guide(), mounts={"g0": (0, 0, 0, 0.5, 0, 0)}, samples=0)
    assert np.isnan(found.values[1:3]).all()
    [warning] = [own for own in found.warnings if own.kind == "no equilibrium"]
    assert "no equilibrium that leads on from that in place" in warning.text
