"""Designs of tolerance studies by number: independent nets, and their mixtures for Sobol indices; worst cases."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from flexura.errors import OptionError
from flexura.study.space import Variable
from flexura.study.tolerances.distributions import normal, uniform
from flexura.study.tolerances.nets import ScrambledNets
from flexura.study.tolerances.worst_case import extreme, linear_deviation, variance_shares


def sizes(*names: str) -> list[Variable]:
    return [Variable(name, 0.0, 1.0, distribution=uniform(0.0, 1.0)) for name in names]


def nets(samples: int = 200, indices: bool = True, seed: int = 0) -> ScrambledNets:
    return ScrambledNets.of(sizes("a", "b", "c"), [[0, 2], [1]], samples, seed=seed, indices=indices)


def whole(space: ScrambledNets) -> np.ndarray:
    return np.column_stack(list(space.designs(0, space.size).values()))


@pytest.mark.parametrize("samples", [24, 25, 1000, 4096, 5000, 100_000])
def test_there_are_as_many_samples_as_asked_for_and_hardly_more(samples: int) -> None:
    space = nets(samples, indices=False)
    assert samples <= space.size == space.samples <= samples * 13 / 12
    assert space.scramblings >= 12
    assert space.points & (space.points - 1) == 0


def test_a_design_is_a_function_of_its_number() -> None:
    space = nets()
    every = whole(space)
    for start in range(0, space.size, 37):
        part = space.designs(start, min(start + 37, space.size))
        np.testing.assert_array_equal(np.column_stack(list(part.values())), every[start : start + 37])
    np.testing.assert_array_equal(whole(pickle.loads(pickle.dumps(space))), every)
    assert space.designs(5, 5)["a"].shape == (0,)


def test_every_net_has_a_point_in_every_interval_of_every_axis() -> None:
    space = nets(768)
    A, _, _ = space.sorted_out(whole(space))
    for net in A:
        for axis in net.T:
            assert sorted((axis * space.points).astype(int)) == list(range(space.points))


def test_nets_and_seeds_differ() -> None:
    A, _, _ = nets().sorted_out(whole(nets()))
    assert len(np.unique(A[:, 0, 0])) == len(A)
    assert not np.isin(whole(nets(seed=1)), whole(nets())).any()


def test_mixtures_differ_by_one_group_alone() -> None:
    space = nets()
    A, B, AB = space.sorted_out(whole(space))
    A = A[:, : space.index_points]
    assert AB.shape == (2, *B.shape)
    np.testing.assert_array_equal(AB[0][..., [0, 2]], B[..., [0, 2]])
    np.testing.assert_array_equal(AB[0][..., 1], A[..., 1])
    np.testing.assert_array_equal(AB[1][..., [0, 2]], A[..., [0, 2]])
    np.testing.assert_array_equal(AB[1][..., 1], B[..., 1])
    assert abs(np.corrcoef(A[..., 0].ravel(), B[..., 0].ravel())[0, 1]) < 0.2


def test_what_is_no_sample_is_refused() -> None:
    with pytest.raises(OptionError, match="from 24"):
        nets(samples=10)
    with pytest.raises(OptionError, match="seed"):
        nets(seed=-1)
    with pytest.raises(OptionError, match="counted from 0"):
        nets().designs(0, nets().size + 1)


def test_descriptions_tell_designs_apart() -> None:
    one = ScrambledNets.of([Variable("a", 0, 1, distribution=normal(0.0, 1.0))], [[0]], 100, seed=0, indices=True)
    other = ScrambledNets.of([Variable("a", 0, 1, distribution=normal(0.0, 1.5))], [[0]], 100, seed=0, indices=True)
    assert one.describe() != other.describe()
    assert nets(seed=1).describe() != nets().describe()
    assert nets(indices=False).describe() != nets().describe()


def test_the_deviation_of_a_weighted_sum() -> None:
    slope, deviation = np.array([3.0, -2.0]), np.array([1.0, 2.0])
    assert linear_deviation(slope, deviation) == pytest.approx(5.0)
    np.testing.assert_allclose(variance_shares(slope, deviation), [9 / 25, 16 / 25])
    assert np.isnan(variance_shares(0 * slope, deviation)).all()


LOW, HIGH = np.array([-1.0, -2.0]), np.array([1.0, 3.0])


def test_the_worst_case_of_a_monotone_function_is_a_corner() -> None:
    def product(x: np.ndarray) -> tuple[float, np.ndarray]:
        value = np.exp(2 * x[0] - x[1])
        return float(value), np.array([2 * value, -value])

    most = extreme(product, [np.zeros(2)], LOW, HIGH, 1)
    assert (most.value, most.is_vertex) == (pytest.approx(np.exp(4)), True)
    np.testing.assert_array_equal(most.sizes, [1.0, -2.0])
    assert extreme(product, [np.zeros(2)], LOW, HIGH, -1).value == pytest.approx(np.exp(-5))


def test_slopes_that_turn_are_followed_to_the_next_corner() -> None:
    def saddle(x: np.ndarray) -> tuple[float, np.ndarray]:
        return float(x[0] * x[1] + 0.1 * x[1]), np.array([x[1], x[0] + 0.1])

    near = extreme(saddle, [np.array([-0.05, -1.0])], LOW, HIGH, 1)
    assert (near.value, near.is_vertex) == (pytest.approx(1.8), True)
    most = extreme(saddle, [np.array([-0.05, -1.0]), np.array([0.9, 2.0])], LOW, HIGH, 1)
    assert (most.value, most.is_vertex) == (pytest.approx(3.3), True)


def test_an_extreme_inside_the_box_is_no_corner() -> None:
    def hill(x: np.ndarray) -> tuple[float, np.ndarray]:
        return float(5 - (x[0] - 0.2) ** 2 + x[1]), np.array([-2 * (x[0] - 0.2), 1.0])

    most = extreme(hill, [np.zeros(2), np.array([0.19, 2.9])], LOW, HIGH, 1)
    assert not most.is_vertex
    assert most.value == pytest.approx(7.9999)


def test_the_middle_of_a_valley_is_not_its_highest_place() -> None:
    def valley(x: np.ndarray) -> tuple[float, np.ndarray]:
        return float(x @ x), 2 * x

    most = extreme(valley, [np.zeros(2), np.array([0.5, 0.5])], LOW, HIGH, 1)
    assert (most.value, most.is_vertex) == (pytest.approx(10.0), True)


def test_without_slopes_or_values_nothing_is_claimed() -> None:
    found = extreme(lambda x: (float(x[0]), np.full(2, np.nan)), [np.zeros(2), np.ones(2)], LOW, HIGH, 1)
    assert (found.value, found.is_vertex) == (1.0, False)
    nothing = extreme(lambda _: (np.nan, np.zeros(2)), [np.zeros(2)], LOW, HIGH, 1)
    assert np.isnan(nothing.value)
    assert not nothing.is_vertex


def test_round_off_of_slopes_names_no_corner() -> None:
    def one_sided(x: np.ndarray) -> tuple[float, np.ndarray]:
        return float(x[0]), np.array([1.0, 1e-15 * np.sign(-x[1])])

    most = extreme(one_sided, [np.array([0.0, 0.5])], LOW, HIGH, 1)
    assert (most.value, most.is_vertex) == (1.0, True)
    assert most.sizes[1] == 0.5
    still = extreme(lambda x: (7.0, np.array([1e-15, -1e-15]) * x), [np.array([0.5, 0.5])], LOW, HIGH, -1)
    assert (still.value, still.is_vertex) == (7.0, True)
