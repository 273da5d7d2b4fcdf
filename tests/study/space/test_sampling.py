"""Designs by number: grids, lists, Latin hypercubes and Sobol' points, whole or in pieces."""

import tracemalloc

import numpy as np
import pytest
from scipy.stats import qmc

from flexura.errors import OptionError
from flexura.study.space import Sobol, Space, Variable
from helpers.over import over

UNIT = tuple(Variable(name, 0.0, 1.0) for name in "abc")


def joined(space, *cuts):
    found = [space.designs(a, b) for a, b in zip((0, *cuts), (*cuts, space.size), strict=True)]
    return {name: np.concatenate([own[name] for own in found]) for name in space.names}


def test_a_grid_is_every_value_with_every_other_the_last_fastest():
    space = Space((Variable("a", 0, 1, count=3), Variable.of("b", [5.0, 4.0]), Variable("n", 1, 2, "integer")))
    a, b, n = (own.ravel() for own in np.meshgrid([0, 0.5, 1], [5, 4], [1, 2], indexing="ij"))
    found = space.designs(0, space.size)
    assert np.array_equal(np.array(list(found.values())), np.array([a, b, n]))
    assert list(found) == ["a", "b", "n"]


def test_a_list_is_side_by_side():
    space = Space((Variable.of("a", [1, 1, 2]), Variable("b", 0, 4, count=3)), "list")
    assert [own.tolist() for own in space.designs(1, 3).values()] == [[1, 2], [2, 4]]


@pytest.mark.parametrize("size", [1, 2, 3, 7, 16, 97, 1000, 4099])
def test_a_latin_hypercube_has_one_point_in_every_interval(size):
    space = Space(UNIT, "latin hypercube", size, seed=4)
    for own in space.designs(0, size).values():
        assert np.array_equal(np.sort(np.floor(own * size)), np.arange(size))


def test_a_latin_hypercube_pairs_its_axes_at_random():
    """Correlations of N points are normal with a standard deviation of 1/sqrt(N - 1); so are those of a point with the
    next of its axis."""
    size, found = 4096, []
    for seed in range(25):
        points = Space(UNIT, "latin hypercube", size, seed).points(0, size)
        own = np.corrcoef(np.hstack([points[:-1], points[1:, :1]]), rowvar=False)
        found += list(own[np.triu_indices(4, 1)] * np.sqrt(size - 1))
    assert np.std(found) == pytest.approx(1.0, abs=0.2)
    assert np.abs(found).max() < 4.5


def test_permutations_of_a_small_hypercube_are_equally_likely():
    orders = [tuple(Space(UNIT[:1], "latin hypercube", 3, s).points(0, 3).ravel().argsort()) for s in range(3000)]
    counts = [orders.count(own) for own in set(orders)]
    assert len(counts) == 6
    assert sum((own - 500) ** 2 / 500 for own in counts) < 25.7  # chi squared of 5 degrees at 1e-4


@pytest.mark.parametrize("size", [1, 2, 5, 4096, 70_000])
def test_sobol_points_are_those_of_scipy(size):
    own = qmc.Sobol(3, scramble=True, bits=32, seed=np.random.default_rng(9))
    expected = np.vstack([own.random(1), own.random(size - 1)]) + 2.0**-33
    assert np.array_equal(Space(UNIT, "sobol", size, seed=9).points(0, size), expected)


@pytest.mark.parametrize("axes", [1, 2, 10, 11, 30])
def test_sobol_points_of_any_number_of_axes(axes):
    expected = qmc.Sobol(axes, scramble=True, bits=32, seed=np.random.default_rng(4)).random(128) + 2.0**-33
    assert np.array_equal(Sobol.of(128, axes, 4)(0, 128), expected)


@pytest.mark.parametrize("sampling", ["sobol", "latin hypercube"])
def test_pieces_are_those_of_the_whole(sampling):
    space = Space(UNIT, sampling, 1000, seed=2)
    whole, pieces = space.designs(0, 1000), joined(space, 1, 31, 32, 500, 999)
    assert all(np.array_equal(whole[name], pieces[name]) for name in "abc")
    other = Space(UNIT, sampling, 1000, seed=3).designs(0, 1000)
    assert not np.isclose(whole["a"], other["a"]).any()


def test_more_sobol_points_begin_with_those_of_fewer():
    few, many = (Space(UNIT, "sobol", size, seed=2).points(0, 100) for size in (100, 10_000))
    assert np.array_equal(few, many)


@pytest.mark.parametrize("sampling", ["sobol", "latin hypercube", "grid"])
def test_the_last_of_a_hundred_million_take_no_memory(sampling):
    ranges = tuple(Variable(name, 0, 1, count=10**4) for name in "ab")
    space = Space(ranges) if sampling == "grid" else Space(UNIT, sampling, 10**8)
    tracemalloc.start()
    try:
        found = space.designs(99_999_968, 100_000_000)
        assert tracemalloc.get_traced_memory()[1] < 3e6
    finally:
        tracemalloc.stop()
    assert all(len(own) == 32 and (own > 0).all() and (own <= 1).all() for own in found.values())


def test_the_largest_spaces_can_be_numbered():
    for space in (Space(UNIT, "latin hypercube", 2**53), Space((Variable("n", 0, 2**53 - 1, "integer"),))):
        last = space.designs(space.size - 2, space.size)
        assert all((own > 0).all() for own in last.values())
    assert last["n"].tolist() == [2**53 - 2, 2**53 - 1]


@over(
    ("arguments", "said"),
    [
        ((UNIT,), "how many values does it take"),
        ((UNIT, "random"), "sampling is one of grid, list"),
        (((),), "at least one parameter"),
        ((tuple(Variable(n, 0, 1, count=10**5) for n in "abcd"),), r"1e\+20 designs \(100000 x 100000"),
        ((UNIT, "sobol", 2**32 + 1), "more than the 4.29e"),
        ((UNIT, "latin hypercube", 2**53 + 1), "more than"),
        ((UNIT, "sobol"), "takes a number of samples"),
        ((UNIT, "sobol", 0), "whole number from 1"),
        ((UNIT, "sobol", 2.5), "whole number from 1"),
        ((UNIT, "sobol", 4, -1), "a seed is a whole number from 0"),
        ((UNIT, "sobol", 4, 0.5), "a seed is a whole number from 0"),
        (((Variable("a", 0, 1, count=3),), "sobol", 4), "belongs to a sweep over a grid"),
        (((Variable("a", 0, 1, count=3),), "grid", 4), "samples belong to"),
        (((Variable.of("a", [1, 2, 1]),),), "a: 1 stands in the list 2 times"),
        (((Variable.of("a", [1, 2]), Variable.of("b", [1, 2, 3])), "list"), "a has 2, b has 3"),
        (((Variable.of("a", [1, 2]), UNIT[0]), "list"), "a has a range"),
    ],
)
def test_what_cannot_be_sampled(arguments, said):
    with pytest.raises(OptionError, match=said):
        Space(*arguments)


@pytest.mark.parametrize(("start", "stop"), [(-1, 2), (0, 5), (3, 2)])
def test_there_are_no_other_designs(start, stop):
    with pytest.raises(OptionError, match="there are 4"):
        Space(UNIT, "sobol", 4).designs(start, stop)


class Uniform:
    """Between 2 and 4, as a distribution."""

    def quantile(self, u):
        return 2 + 2 * u

    def describe(self):
        return {"uniform": [2, 4]}


def test_a_distribution_is_followed_by_its_inverse():
    own = Variable("a", 2, 4, distribution=Uniform())
    space = Space((own, *UNIT[1:]), "sobol", 64, seed=1)
    assert np.array_equal(space.designs(0, 64)["a"], 2 + 2 * space.points(0, 64)[:, 0])
    assert space.describe()["variables"][0]["distribution"] == {"uniform": [2, 4]}
    with pytest.raises(OptionError, match="has a distribution"):
        Space((own,), "list")


def test_other_spaces_have_other_descriptions():
    spaces = [
        Space(UNIT, "sobol", 8),
        Space(UNIT, "sobol", 8, 1),
        Space(UNIT, "sobol", 9),
        Space(UNIT, "latin hypercube", 8),
        Space((Variable("a", 0, 1, count=3),)),
        Space((Variable("a", 0, 1, "integer"),)),
        Space((Variable.of("a", [0, 1]),)),
        Space((Variable.of("a", [1, 0]),)),
        Space((Variable.of("a", np.arange(2000.0)),)),
        Space((Variable.of("a", np.arange(2000.0)[::-1]),)),
    ]
    found = [space.describe() for space in spaces]
    assert all(a != b for k, a in enumerate(found) for b in found[:k])
    assert [space.describe() for space in spaces] == found
