"""Modes keep their names through crossings, repeated frequencies and veering."""

import numpy as np
import pytest
import scipy.linalg as la
from hypothesis import given, settings
from hypothesis import strategies as st

from flexura.modal.mode_pairing import track_modes

FEW = settings(deadline=None, max_examples=20)
MASS = np.diag([1.0, 2.0, 3.0, 4.0, 5.0])


def diagonal(values):
    """A stiffness with these eigenvalues and the unit vectors as shapes."""
    return np.diag(np.asarray(values) * np.diag(MASS))


def test_modes_that_cross_keep_their_names():
    """Eigenvalues 2 and 3 cross as the second one rises."""
    before, number = np.eye(5), np.arange(5)
    for p in np.linspace(0, 1, 7):
        found = track_modes(before, *la.eigh(diagonal([1, 2 + 2 * p, 3, 7, 9]), MASS), MASS)
        assert found.mac == pytest.approx(1.0)
        before, number = found.shapes[:, found.number], found.number
    assert number.tolist() == [0, 2, 1, 3, 4]


def test_through_a_repeated_eigenvalue():
    """At the crossing itself the solver's vectors are any of their space: they are turned back to those before."""
    _, before = la.eigh(diagonal([1, 2, 3, 7, 9]), MASS)
    values, vectors = la.eigh(diagonal([1, 3, 3, 7, 9]), MASS)
    c, s = np.cos(0.7), np.sin(0.7)
    vectors[:, 1:3] = vectors[:, 1:3] @ np.array([[c, -s], [s, c]])
    found = track_modes(before, values, vectors, MASS)
    assert found.number.tolist() == [0, 1, 2, 3, 4]
    assert np.abs(found.shapes.T @ MASS @ before) == pytest.approx(np.eye(5), abs=1e-12)
    after = track_modes(found.shapes[:, found.number], *la.eigh(diagonal([1, 4, 3, 7, 9]), MASS), MASS)
    assert after.number.tolist() == [0, 2, 1, 3, 4]


@FEW
@given(angle=st.floats(0, 2 * np.pi))
def test_one_of_a_repeated_pair_is_tracked_alone(angle):
    """The tracked mode is found in the space of two though only one of them was asked for."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shapes = np.eye(5)
    shapes[:, :2] = shapes[:, :2] @ turn
    found = track_modes(np.eye(5)[:, [1]], [3.0, 3.0, 5.0, 6.0, 7.0], shapes)
    assert found.mac == pytest.approx(1.0)
    assert np.abs(found.shapes[:, found.number[0]]) == pytest.approx(np.eye(5)[1], abs=1e-12)


def test_modes_that_veer_are_a_space():
    """Two close modes that have mixed half and half: one by one they are half alike, as a space the same."""
    c = np.sqrt(0.5)
    shapes = np.eye(3)
    shapes[:2, :2] = [[c, -c], [c, c]]
    values = [100.0, 101.0, 200.0]
    alone = track_modes(np.eye(3), values, shapes)
    assert alone.mac == pytest.approx([0.5, 0.5, 1.0])
    space = track_modes(np.eye(3), values, shapes, close=0.02)
    assert space.mac == pytest.approx(1.0)
    assert sorted(space.number.tolist()) == [0, 1, 2]
    assert space.shapes == pytest.approx(shapes)


def test_close_modes_that_have_not_mixed_cross_by_their_shapes():
    found = track_modes(np.eye(3), [100.0, 101.0, 200.0], np.eye(3)[:, [1, 0, 2]], close=0.02)
    assert found.number.tolist() == [1, 0, 2]


def test_equal_likeness_keeps_the_order():
    c = np.sqrt(0.5)
    found = track_modes(np.eye(2), [1.0, 2.0], np.array([[c, -c], [c, c]]))
    assert found.number.tolist() == [0, 1]


def test_scale_of_the_modes_before_does_not_matter_and_modes_may_be_lost():
    found = track_modes(np.eye(3) * [-5.0, -1.0, 0.1], [1.0, 2.0], np.eye(3)[:, [2, 0]])
    assert found.number.tolist() == [1, -1, 0] and found.sense.tolist() == [-1.0, 1.0, 1.0]
    assert found.mac == pytest.approx([1.0, 0.0, 1.0])


def test_nothing_tracked():
    found = track_modes(np.empty((3, 0)), [1.0, 1.0], np.eye(3)[:, :2])
    assert len(found.number) == len(found.mac) == 0
    assert found.shapes == pytest.approx(np.eye(3)[:, :2])
