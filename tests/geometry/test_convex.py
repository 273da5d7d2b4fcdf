"""Convex solids with eight corners against closed forms: volumes that they share, and how far they are apart."""

from __future__ import annotations

import numpy as np
import pytest

from flexura.convex import boxes, crossed, overlapping_bounds, planes, separations, shared
from flexura.mechanism.placement import rotation_matrix
from flexura.structure.solids import ROUND, Bodies, Loft


def box(centre, half, axis=(0.0, 0.0, 1.0), angle=0.0):
    turned = rotation_matrix(np.array(axis), np.array(angle)).T
    return boxes(np.array([centre], dtype=float), turned[None], np.array([half], dtype=float))


def bodies(half, axes=None, origin=(0.0, 0.0, 0.0), is_round=True):
    one = np.zeros(1, dtype=np.intp)
    axes = np.eye(3) if axes is None else axes
    return Bodies(
        ["b"], ["b"], one, np.array([origin]), axes[None], np.array([half]), np.array([is_round]), one, frozenset()
    )


def volume(first, second):
    a, b = np.repeat(first, len(second), axis=0), np.tile(second, (len(first), 1, 1))
    return float(shared(a, b)[0].sum())


def test_boxes_share_the_product_of_their_overlaps() -> None:
    one, other = box((0, 0, 0), (3, 1, 2)), box((2.5, 0.5, 1), (1, 2, 0.5))
    found, middle = shared(one, other)
    assert found[0] == pytest.approx(1.5 * 2 * 1)
    np.testing.assert_allclose(middle[0], [2.25, 0, 1], atol=1e-12)
    assert separations(one, other)[0] == pytest.approx(-1.5)


@pytest.mark.parametrize("angle", [20.0, 45.0, 90.0, 160.0])
def test_strips_that_cross_share_a_rhombus(angle) -> None:
    """Width a b / sin(angle), times the depth."""
    turn = np.deg2rad(angle)
    one, other = box((0, 0, 0), (20, 0.5, 3)), box((0, 0, 1), (20, 0.25, 3), angle=turn)
    assert volume(one, other) == pytest.approx(1.0 * 0.5 / np.sin(turn) * 5)


def test_a_turned_cube_within_a_cube_shares_an_octagonal_prism() -> None:
    assert volume(box((0, 0, 0), (1, 1, 1)), box((0, 0, 0), (1, 1, 1), angle=np.pi / 4)) == pytest.approx(
        2 * 8 * (np.sqrt(2) - 1)
    )


def test_a_corner_that_pokes_through_a_face_shares_a_tetrahedron() -> None:
    """A cube on its corner, its diagonal upright: h^3 sqrt(3)/2 above height h below the tip."""
    tip, h = np.sqrt(3), 0.5
    axis, angle = (-1.0, 1.0, 0.0), -np.arccos(1 / np.sqrt(3))
    cube = box((0, 0, 0), (1, 1, 1), axis, angle)
    top = cube[0, :, 2].max()
    assert top == pytest.approx(tip)
    plate = box((0, 0, tip - h + 5), (9, 9, 5))
    assert volume(cube, plate) == pytest.approx(h**3 * np.sqrt(3) / 2)


@pytest.mark.parametrize("gap", [1e-3, 0.2, -0.3])
def test_the_gap_of_boxes_edge_to_edge(gap) -> None:
    """Two cubes, one turned about x and one about y, meet with edges at right angles."""
    one = box((0, 0, 0), (1, 1, 1), (1, 0, 0), np.pi / 4)
    other = box((0, 0, 2 * np.sqrt(2) + gap), (1, 1, 1), (0, 1, 0), np.pi / 4)
    assert separations(one, other)[0] == pytest.approx(gap)


def test_any_motion_leaves_volume_and_depth() -> None:
    rng = np.random.default_rng(3)
    one, other = box((0, 0, 0), (3, 1, 2)), box((2.5, 0.5, 1), (1, 2, 0.5), (1, 2, 3), 0.4)
    before, depth = volume(one, other), separations(one, other)[0]
    for scale in (1e-6, 1.0, 1e4):
        Q = rotation_matrix(rng.normal(size=3), np.array(rng.uniform(0, 6)))
        moved = [scale * (solid @ Q.T + [10.0, -20.0, 5.0]) for solid in (one, other)]
        mirrored = [solid * [1.0, 1.0, -1.0] for solid in moved]
        for pair in (moved, mirrored):
            assert volume(*pair) == pytest.approx(scale**3 * before, rel=1e-6)
            assert separations(*pair)[0] == pytest.approx(scale * depth, rel=1e-6)


def test_a_cylinder_sunk_into_a_plate_shares_a_segment() -> None:
    """r^2 acos(d/r) - d sqrt(r^2 - d^2) along its length (a polygon of 16 sides stands for the circle)."""
    r, d, length = 5.0, 2.0, 12.0
    plate = box((0, 0, -10 - d), (50, 50, 10))
    lying = bodies((length / 2, r, r)).pieces(0)
    segment = r**2 * np.arccos(d / r) - d * np.sqrt(r**2 - d**2)
    assert ROUND * volume(lying, plate) == pytest.approx(segment * length, rel=0.03)
    standing = bodies((length / 2, r, r), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])).pieces(0)
    assert ROUND * volume(standing, plate) == pytest.approx(np.pi * r**2 * 4)


def test_distances_from_a_box_and_a_cylinder() -> None:
    points = np.array([[0.0, 0, 0], [10, 0, 0], [10, 9, 0], [8, 6, 8]])
    far = np.linalg.norm(bodies((4, 3, 3), is_round=False).nearest(0, points), axis=1)
    np.testing.assert_allclose(far, [0, 6, np.hypot(6, 6), np.sqrt(16 + 9 + 25)])
    far = np.linalg.norm(bodies((4, 3, 3)).nearest(0, points), axis=1)
    np.testing.assert_allclose(far, [0, 6, np.hypot(6, 6), np.hypot(4, 7)])


def test_lofts_fill_what_they_stand_for() -> None:
    def filled(loft, first=0.0, last=1.0):
        own = loft.pieces(0, first, last)
        return float(shared(own, own)[0].sum()) * (ROUND if loft.is_round else 1.0)

    x = np.array([0.0, 1.0])
    cone = Loft(True, x, np.array([[2.0, 1.0]]), np.array([[2.0, 1.0]]), np.zeros(1))
    assert filled(cone) == pytest.approx(np.pi * 7 / 3)
    tube = Loft(True, x, np.full((1, 2), 2.0), np.full((1, 2), 2.0), np.array([0.5]))
    assert filled(tube, 0.25, 0.75) == pytest.approx(np.pi * 3 / 2, rel=0.03)
    wedge = Loft(False, x, np.array([[1.0, 2.0]]), np.array([[3.0, 3.0]]), np.zeros(1))
    assert filled(wedge) == pytest.approx(2 * 1.5 * 6)


def test_a_line_enters_and_leaves_a_box() -> None:
    own = box((0, 0, 0), (1, 2, 3), (0, 0, 1), np.pi / 2)
    first, last = crossed(own, np.array([-4.0, 0, 0]), np.array([4.0, 0, 0]))[0]
    assert (first, last) == pytest.approx((0.25, 0.75))
    first, last = crossed(own, np.array([-4.0, 0, 4]), np.array([4.0, 0, 4]))[0]
    assert first > last


def test_the_sweep_finds_every_pair_of_bounds() -> None:
    rng = np.random.default_rng(0)
    low = rng.uniform(0, 10, (300, 3))
    high = low + rng.uniform(0, 2, (300, 3))
    found = overlapping_bounds(low, high, 10**6)
    meets = ((low[:, None] <= high) & (low <= high[:, None])).all(axis=-1)
    expected = np.argwhere(np.triu(meets, 1))
    assert sorted(map(tuple, found)) == sorted(map(tuple, expected))
    assert overlapping_bounds(low, high, 10) is None


def test_faces_look_outwards_whatever_the_handedness() -> None:
    for solid in (box((5, 0, 0), (1, 2, 3)), box((5, 0, 0), (1, 2, 3)) * [-1.0, 1.0, 1.0]):
        normals, offsets = planes(solid)
        assert (np.einsum("nfi,ni->nf", normals, solid.mean(axis=1)) < offsets).all()
