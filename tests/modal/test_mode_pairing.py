"""Modes are paired through swapped order, close and repeated frequencies, missing and strange modes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexura.errors import OptionError
from flexura.modal.mode_pairing import close_groups, mac_with_spaces, pair_by_mac, pair_modes

FEW = settings(deadline=None, max_examples=20)
P = 9


def shapes(n, seed=0, p=P):
    """Orthonormal shapes."""
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(p, n)))[0]


def turned(x, pair, angle):
    """Two shapes turned into each other."""
    y, (i, j) = x.copy(), pair
    y[:, i] = np.cos(angle) * x[:, i] + np.sin(angle) * x[:, j]
    y[:, j] = np.cos(angle) * x[:, j] - np.sin(angle) * x[:, i]
    return y


def test_swapped_order_signs_scale_and_noise():
    hz, x = np.array([10.0, 20.0, 30.0, 40.0]), shapes(4)
    order = [2, 0, 3, 1]
    rng = np.random.default_rng(5)
    test = (x[:, order] + 0.05 * rng.normal(size=(P, 4))) * np.array([-1.0, 2j, 0.1, 5.0])
    found = pair_modes(np.array([11.0, 21.0, 31.0, 41.0]), test, model_hz=hz, model_shapes=x)
    assert found.partner.tolist() == order


@FEW
@given(angle=st.floats(0, 2 * np.pi))
def test_repeated_modes_are_any_mixture(angle):
    """The two of a repeated frequency pair with the two of the model, one each, at any angle between the bases."""
    x = shapes(4)
    test = turned(x, (1, 2), angle)
    found = pair_modes([10, 20, 20.001, 30], test, model_hz=[10.1, 20.5, 20.5, 31], model_shapes=x)
    assert found.partner[[0, 3]].tolist() == [0, 3]
    assert sorted(found.partner[[1, 2]]) == [1, 2]
    assert (found.likeness[[0, 1, 2, 3], found.partner] > 1 - 1e-9).all()


@pytest.mark.parametrize(("test_hz", "model_hz"), [((20.0, 20.1), (19.0, 22.0)), ((20.0, 23.0), (20.0, 20.2))])
def test_modes_that_are_close_on_one_side_alone(test_hz, model_hz):
    """Either side may have the mixture: the test of what the model keeps apart, or the model of what the test does."""
    x = shapes(4)
    test = turned(x, (1, 2), np.pi / 4)
    found = pair_modes([10, *test_hz, 40], test, model_hz=[10, *model_hz, 40], model_shapes=x)
    assert found.partner.tolist() == [0, 1, 2, 3]
    assert found.mac[1, 1] == pytest.approx(0.5)


def test_mixed_modes_that_are_far_apart_are_no_pair():
    """Half of one shape is not enough where frequencies give no reason for a mixture."""
    x = shapes(4)
    test = turned(x, (1, 2), np.pi / 4)
    found = pair_modes([10, 20, 30, 40], test, model_hz=[10, 20, 30, 40], model_shapes=x)
    assert found.partner.tolist() == [0, -1, -1, 3]


def test_close_modes_in_swapped_order_keep_their_shapes():
    x = shapes(3)
    found = pair_modes([20.0, 20.2, 30.0], x[:, [1, 0, 2]], model_hz=[20.0, 20.2, 30.0], model_shapes=x)
    assert found.partner.tolist() == [1, 0, 2]


def test_missing_and_strange_modes():
    x = shapes(5)
    test = np.column_stack([x[:, 0], shapes(6, 0)[:, 5], x[:, 3]])
    found = pair_modes([10, 17, 41], test, model_hz=[10, 20, 30, 40, 50], model_shapes=x)
    assert found.partner.tolist() == [0, -1, 3]


def test_frequency_decides_between_modes_that_the_sensors_confuse():
    x = shapes(3)
    model = np.column_stack([x[:, 0], x[:, 1], x[:, 0], x[:, 2]])
    found = pair_modes([11.0, 205.0], x[:, [0, 0]], model_hz=[10.0, 50.0, 200.0, 300.0], model_shapes=model)
    assert found.partner.tolist() == [0, 2]


def test_a_space_as_large_as_the_sensors_proves_nothing():
    """Two sensors see anything within a pair of close modes: nothing is paired by that."""
    x = np.eye(2)
    test = np.array([[1.0], [1.0]])
    assert pair_modes([20.0], test, model_hz=[20.0, 20.1], model_shapes=x).partner.tolist() == [-1]


def test_random_shapes_are_rarely_paired():
    """Likeness is counted beyond chance: few of many random shapes among few sensors are half way to a mode."""
    rng = np.random.default_rng(8)
    x, test = shapes(2, p=4), rng.normal(size=(4, 400))
    found = pair_modes(np.linspace(10, 4000, 400), test, model_hz=[20.0, 20.1], model_shapes=x)
    assert (found.likeness >= 0.5).mean() < 0.45
    assert found.likeness.mean() < 0.45


def test_one_sensor_pairs_by_frequency():
    found = pair_modes([31.0, 10.0], np.ones((1, 2)), model_hz=[10.0, 20.0, 30.0], model_shapes=np.ones((1, 3)))
    assert found.partner.tolist() == [2, 0]


def test_groups_of_close_frequencies():
    groups = close_groups(np.array([30.0, 10.0, 10.1, 10.2, 20.0]), 0.02)
    assert [g.tolist() for g in groups] == [[1, 2, 3], [4], [0]]


def test_space_of_a_pair():
    x = shapes(3)
    found = pair_modes([10, 20], x[:, [0, 1]], model_hz=[10, 10.1, 20], model_shapes=x[:, [0, 2, 1]])
    assert [s.tolist() for s in found.space_of(0)] == [[0], [0, 1]]


def test_what_is_refused():
    with pytest.raises(OptionError, match="frequency for every mode"):
        pair_modes([1.0], np.ones((3, 2)), model_hz=[1.0], model_shapes=np.ones((3, 1)))
    with pytest.raises(OptionError, match="0 <= close < 1"):
        pair_modes([1.0], np.ones((3, 1)), model_hz=[1.0], model_shapes=np.ones((3, 1)), close=1.0)


def test_models_of_equal_shapes_are_paired_in_order_of_frequency():
    """All shapes alike, and two frequencies repeated: nearer frequencies decide, then the order."""
    overlap = np.ones((3, 3))
    assert pair_by_mac(overlap, np.array([10.0, 20.0, 20.0]), np.array([20.0, 10.0, 20.0])).tolist() == [1, 0, 2]


@FEW
@given(angle=st.floats(0, 2 * np.pi))
def test_repeated_modes_are_a_space_in_the_norm_of_the_mass(angle):
    mass = np.diag(np.arange(1.0, P + 1))
    x = shapes(4) / np.sqrt(np.diag(mass))[:, None]
    overlap = mac_with_spaces(3.0 * x, turned(x, (1, 2), angle), [np.array([0]), np.array([1, 2]), np.array([3])], mass)
    assert overlap[1:3, 1:3] == pytest.approx(1.0)
    assert overlap[[0, 3], [0, 3]] == pytest.approx(1.0)
    assert overlap[0, 1:] == pytest.approx(0.0, abs=1e-12)
    hz = np.array([10.0, 20.0, 20.0, 30.0])
    assert pair_by_mac(overlap, hz, hz).tolist() == [0, 1, 2, 3]


def test_dependent_shapes_span_no_more_than_they_have():
    x = shapes(2)
    space = np.column_stack([x[:, 0], 2.0 * x[:, 0]])
    group = [np.array([0, 1])]
    assert mac_with_spaces(space, x, group, np.eye(P)) == pytest.approx(np.array([[1.0, 0.0], [1.0, 0.0]]), abs=1e-12)
