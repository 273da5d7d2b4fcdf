"""Spaces of screws: all types of freedoms that wires may make, counted by Grassmann's varieties of lines.

The varieties of lines of one to six dimensions (Dandurand 1984; Merlet 1989) are told apart where some of their lines
are at infinity: pencils of parallel lines, all parallel lines, a hyperbolic paraboloid. That makes 26 spaces of lines,
as many as Hopkins and Culpepper (2010) have types of freedoms of parallel flexure systems. What is reciprocal to each
is known from where lines meet: a rotation does no work on a force whose line meets its axis, a translation none on a
force at right angles to it.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flexura.screws import ScrewSpace
from helpers.over import over

X, Y, Z, O = (*np.eye(3), np.zeros(3))  # noqa: E741
TURNED, SHIFT = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix(), (0.3, -2.0, 1.1)


def turn(point, direction):
    """A rotation about a line."""
    return np.append(np.cross(point, direction), direction)


def slide(direction):
    """A translation."""
    return np.append(direction, O)


def screw(point, direction, pitch):
    """A screw."""
    return turn(point, direction) + pitch * slide(direction)


def push(point, direction):
    """A force along a line."""
    return np.append(direction, np.cross(point, direction))


def couple(direction):
    """A couple."""
    return np.append(O, direction)


def wrench(point, direction, pitch):
    """A wrench."""
    return push(point, direction) + pitch * couple(direction)


P = np.array([1.0, 2.0, 3.0])
PARALLEL = {  # name: twists, wrenches that span what is reciprocal, freedoms, lines of the constraints
    "nothing held": ([*map(slide, (X, Y, Z)), *(turn(P, d) for d in (X, Y, Z))], [], "all motions", "no line"),
    "a line": (
        [turn(P, d) for d in (X, Y, Z)] + [slide(X), slide(Y)],
        [push(P, Z)],
        "all motions but along a line",
        "a line",
    ),
    "lines that intersect": (
        [turn(P, d) for d in (X, Y, Z)] + [slide(Z)],
        [push(P, X), push(P, X + Y)],
        "three rotations and one translation",
        "all lines of a plane through a point",
    ),
    "parallel lines": (
        [slide(X), slide(Y), turn(O, Z), turn(O, X)],
        [push(O, Z), push(X, Z)],
        "two rotations and two translations",
        "parallel lines in a plane",
    ),
    "skew lines": (
        [turn(a * X, Z + b * Y - a * X) for a, b in ((0, 0), (1, 0), (0, 1), (2, 3))],
        [push(O, X), push(Z, Y)],
        "three rotations and one translation",
        "two skew lines",
    ),
    "sphere": (
        [turn(P, d) for d in (X, Y, Z)],
        [push(P, d) for d in (X, Y, Z)],
        "all rotations through a point (spherical)",
        "all lines through a point",
    ),
    "leaf": (
        [turn(O, X), turn(O, Y), slide(Z)],
        [push(O, X), push(O, Y), push(X, Y)],
        "all rotations in a plane, with the translation along its normal",
        "all lines of a plane",
    ),
    "planar motion": (
        [turn(P, Z), slide(X), slide(Y)],
        [push(O, Z), push(X, Z), push(Y, Z)],
        "all parallel rotations (planar motion)",
        "all lines parallel to a direction",
    ),
    "two pencils": (
        [turn(O, X), turn(O, Z), turn(X, Y)],
        [push(O, X), push(O, Y), push(X, Z)],
        "three rotations",
        "all lines of two planes through a point of each on both",
    ),
    "a pencil and parallel lines": (
        [turn(O, X), turn(O, Z), slide(Z)],
        [push(O, X), push(O, Y), push(Z, X)],
        "two rotations and one translation",
        "all lines of a plane through a point on another, and all of that other parallel to where both meet",
    ),
    "parallel lines of two directions": (
        [slide(Z), turn(Z, X), turn(O, Y)],
        [push(O, X), push(Y, X), push(Z, Y), push(X + Z, Y)],
        "two rotations and one translation",
        "lines of two directions in parallel planes",
    ),
    "hyperboloid": (  # x^2 + y^2 - z^2 = 1, by both of its families of lines
        [turn((np.cos(a), np.sin(a), 0), (-np.sin(a), np.cos(a), 1)) for a in (0, 1, 2)],
        [push((np.cos(a), np.sin(a), 0), (np.sin(a), -np.cos(a), 1)) for a in (0, 1, 2, 4)],
        "three rotations",
        "one family of lines of a hyperboloid",
    ),
    "hyperbolic paraboloid": (  # z = x y
        [turn((a, 0, 0), (0, 1, a)) for a in (0, 1, -2)],
        [push((0, a, 0), (1, 0, a)) for a in (0, 1, -2, 3)],
        "one rotation, one translation and one screw",
        "one family of lines of a hyperbolic paraboloid",
    ),
    "two rotations that intersect": (
        [turn(O, X), turn(O, Y)],
        [push(O, X), push(O, Y), push(O, Z), push(X, Y)],
        "two rotations that intersect",
        "all lines in a plane or through a point of it",
    ),
    "parallel rotations": (
        [turn(O, Z), turn(X, Z)],
        [push(O, X), push(O, Z), push(X, Z), push(Z, X), push(Y, Z)],
        "two parallel rotations",
        "all lines in a plane or parallel to a line of it",
    ),
    "skew rotations": (
        [turn(O, X), turn(Z, X + 2 * Y)],
        [push(a * X, Z + b * (X + 2 * Y) - a * X) for a, b in ((0, 0), (1, 0), (0, 1), (2, 3))],
        "two skew rotations",
        "all lines that meet two skew lines",
    ),
    "cylinder": (
        [turn(O, Z), slide(Z)],
        [push(O, X), push(O, Y), push(Z, X), push(Z, Y)],
        "rotation and translation along it",
        "all lines that meet a line and are at right angles to a direction",
    ),
    "oblique cylinder": (
        [turn(O, Z), slide(X + Z)],
        [push(O, Y), push(Z, Y), push(O, X - Z), push(Z, X - Z)],
        "rotation and oblique translation",
        "all lines that meet a line and are at right angles to a direction",
    ),
    "elliptic": (
        [screw(O, X, 1.0), screw(O, Y, 2.0)],
        [wrench(O, X, -1.0), wrench(O, Y, -2.0), push(O, Z), couple(Z)],
        "two screws",
        "all lines of an elliptic congruence",
    ),
    "screws of one pitch that intersect": (
        [screw(O, X, 1.5), screw(O, Y, 1.5)],
        [wrench(O, X, -1.5), wrench(O, Y, -1.5), push(O, Z), couple(Z)],
        "two screws",
        "all lines of an elliptic congruence that is alike all around",
    ),
    "parabolic": (
        [turn(O, X), screw(O, Y, 2.0)],
        [push(O, X), wrench(O, Y, -2.0), push(O, Z), couple(Z)],
        "one rotation and one screw",
        "all lines of a parabolic congruence, which meet a line",
    ),
    "parallel screws of one pitch": (
        [screw(O, Z, 1.5), screw(X, Z, 1.5)],
        [push(O, X), wrench(O, Z, -1.5), couple(X), couple(Y)],
        "one translation and one screw",
        "all lines of a parabolic congruence, at right angles to a direction",
    ),
    "rotation": (
        [turn(P, Z)],
        [push(P, d) for d in (X, Y, Z)] + [push(P + Z, X), push(P + Z, Y)],
        "rotation",
        "all lines that meet a line",
    ),
    "translation": (
        [slide(Z)],
        [push(O, X), push(O, Y), *map(couple, (X, Y, Z))],
        "translation",
        "all lines at right angles to a direction",
    ),
    "screw": (
        [screw(P, Z, 0.7)],
        [push(P, X), push(P, Y), couple(X), couple(Y), wrench(P, Z, -0.7)],
        "screw",
        "all lines of a linear complex",
    ),
    "all held": ([], [*map(couple, (X, Y, Z)), *(push(P, d) for d in (X, Y, Z))], "no motion", "all lines"),
}
NOT_PARALLEL = {  # and of what dimension the lines of the constraints are
    "two translations": ([slide(X), slide(Y)], [push(O, Z), *map(couple, (X, Y, Z))], "two translations", 3),
    "three translations": ([slide(X), slide(Y), slide(Z)], [*map(couple, (X, Y, Z))], "three translations", 0),
    "three translations and a rotation": (
        [slide(X), slide(Y), slide(Z), turn(P, Z)],
        [couple(X), couple(Y)],
        "one rotation and three translations",
        0,
    ),
    "helical planar motion": (
        [slide(X), slide(Y), screw(P, Z, 1.5)],
        [couple(X), couple(Y), wrench(P, Z, -1.5)],
        "two translations and one screw",
        0,
    ),
    "universal with translations": (
        [slide(X), slide(Y), turn(O, X), turn(O, Y)],
        [push(O, Z), couple(Z)],
        "two rotations and two translations",
        1,
    ),
    "all but about a direction": (
        [slide(X), slide(Y), slide(Z), turn(P, Z), turn(P, X)],
        [couple(Y)],
        "all motions but about a direction",
        0,
    ),
}


def spaces(twists, wrenches, length=1.0):
    """Both spaces."""
    one = ScrewSpace.of("twists", np.array(twists).reshape(-1, 6).T, length)
    return one, ScrewSpace.of("wrenches", np.array(wrenches).reshape(-1, 6).T, length)


def same(one, other):
    """Whether two spaces are one."""
    return one.dimension == other.dimension and one.holds(other) and other.holds(one)


def spanned(space, screws):
    """What screws of its kind span."""
    columns = [own.components(space.kind) for own in screws]
    return ScrewSpace.of(space.kind, np.array(columns).reshape(-1, 6).T, space.length)


def test_there_are_26_types():
    assert len(PARALLEL) == 26


@over("case", [*PARALLEL.items(), *NOT_PARALLEL.items()])
def test_what_is_reciprocal_is_known(case):
    _, (twists, wrenches, *_) = case
    freedom, constraint = spaces(twists, wrenches)
    assert freedom.dimension + constraint.dimension == 6
    assert same(freedom.reciprocal(), constraint) and same(constraint.reciprocal(), freedom)


@over("case", PARALLEL.items())
@over("place", ((np.eye(3), O, 1.0), (TURNED, SHIFT, 1.0), (np.eye(3), SHIFT, 0.05), (TURNED, O, 30.0)))
def test_names_of_freedoms_that_lines_make(case, place):
    """Lines alone make the constraints, and both are called what they are in every frame and at every length."""
    _, (twists, wrenches, name, lines) = case
    rotation, shift, length = place
    freedom, constraint = (own.moved(rotation, shift) for own in spaces(twists, wrenches, length))
    assert freedom.name == name
    assert constraint.variety == lines and constraint.lines().dimension == constraint.dimension
    assert freedom.reciprocal().variety == lines


@over("case", NOT_PARALLEL.items())
def test_names_of_freedoms_that_lines_do_not_make(case):
    _, (twists, wrenches, name, by_lines) = case
    freedom, constraint = (own.moved(TURNED, SHIFT) for own in spaces(twists, wrenches))
    assert freedom.name == name and constraint.lines().dimension == by_lines


@over("case", [*PARALLEL.items(), *NOT_PARALLEL.items()])
def test_screws_of_a_space_span_it(case):
    _, (twists, wrenches, *_) = case
    for own in spaces(twists, wrenches):
        moved = own.moved(TURNED, SHIFT)
        for space, make in itertools.product((own, moved), (ScrewSpace.principal, ScrewSpace.simplest)):
            assert same(spanned(space, make(space)), space)
        pitches, turned = ([own.pitch for own in space.principal()] for space in (own, moved))
        assert sorted(turned) == pytest.approx(sorted(pitches), abs=1e-9)


def test_two_skew_rotations_are_given_by_their_own_axes():
    """And their principal screws as Hunt (1978) has them of two lines at a distance and an angle of 90 degrees."""
    space = ScrewSpace.of("twists", np.array([turn(O, X), turn(2 * Z, Y)]).T)
    axes = sorted((tuple(own.direction), tuple(own.point), own.pitch) for own in space.simplest())
    assert np.allclose([d for d, *_ in axes], [Y, X]) and np.allclose([p for _, p, _ in axes], [2 * Z, O])
    assert [h for *_, h in axes] == [0, 0]
    for own in space.principal():
        assert abs(own.pitch) == pytest.approx(1.0) and own.point == pytest.approx(Z)
        assert abs(own.direction) == pytest.approx(np.array([1, 1, 0]) / np.sqrt(2))


@over("angle, distance", [(0.3, 1.0), (1.0, 0.2), (np.pi / 2, 3.0), (2.5, 1.0)])
def test_principal_pitches_of_two_lines(angle, distance):
    """Of lines at angle a and distance d: d / 2 tan(a / 2) and d / 2 cot(a / 2), of opposite signs (the cylindroid)."""
    other = np.array([np.cos(angle), np.sin(angle), 0])
    space = ScrewSpace.of("twists", np.array([turn(O, X), turn(distance * Z, other)]).T)
    found = sorted(abs(own.pitch) for own in space.principal())
    assert found == pytest.approx(sorted(distance / 2 * t for t in (np.tan(angle / 2), 1 / np.tan(angle / 2))))


@over("name", ["sphere", "leaf", "two rotations that intersect", "planar motion", "three translations"])
def test_screws_of_one_pitch_go_along_axes(name):
    twists = (PARALLEL | NOT_PARALLEL)[name][0]
    mixed = np.array(twists).T @ Rotation.from_rotvec([1, 2, 3]).as_matrix()[: len(twists), : len(twists)]
    for own in ScrewSpace.of("twists", mixed).principal():
        assert np.sort(own.direction) == pytest.approx([0, 0, 1])


def test_lines_through_a_point():
    leaf = spaces(*PARALLEL["leaf"][:2])[1]
    assert leaf.directions_at((3.0, -1.0, 0.0)).shape[1] == 2 and leaf.directions_at((0, 0, 1)).shape[1] == 0
    assert spaces(*PARALLEL["sphere"][:2])[0].directions_at(P).shape[1] == 3
    assert spaces(*PARALLEL["hyperboloid"][:2])[0].directions_at(X).shape[1] == 1


numbers = st.integers(-3, 3).map(float)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
directions = vectors.filter(lambda d: d.any())
lines = st.lists(st.tuples(vectors, directions), min_size=1, max_size=6)
screws = st.lists(st.tuples(vectors, directions, numbers), max_size=6)


@settings(deadline=None, max_examples=300)
@given(screws, st.floats(0.1, 10.0), st.sampled_from(["twists", "wrenches"]))
def test_any_space(given_screws, length, kind):
    """Reciprocal twice is the space itself; its lines are in it and span what they span; its screws span it; names do
    not depend on the frame or the length."""
    make = screw if kind == "twists" else wrench
    columns = np.array([make(*own) for own in given_screws]).reshape(-1, 6).T
    space = ScrewSpace.of(kind, columns, length)
    assert same(space.reciprocal().reciprocal(), space)
    d, m = space.reciprocal().basis, space.basis
    assert np.abs(d.T @ m).max(initial=0.0) < 1e-9
    own = space.lines()
    assert space.holds(own) and own.lines().dimension == own.dimension
    assert space.variety == own.variety and "dimensions" not in space.variety
    for make_screws in (ScrewSpace.principal, ScrewSpace.simplest):
        assert same(spanned(space, make_screws(space)), space)
    moved = space.moved(TURNED, SHIFT)
    assert moved.name == space.name and moved.variety == space.variety
    assert ScrewSpace.of(kind, columns, 2 * length).name == space.name


@settings(deadline=None, max_examples=300)
@given(lines)
def test_what_lines_span_is_made_by_lines(given_lines):
    """And each of the lines that made it goes through its points."""
    space = ScrewSpace.of("wrenches", np.stack([push(*own) for own in given_lines], axis=1))
    assert space.lines().dimension == space.dimension
    point, direction = given_lines[0]
    inside = space.directions_at(point)
    assert np.linalg.norm(inside.T @ direction) == pytest.approx(np.linalg.norm(direction))
