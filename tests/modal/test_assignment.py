"""One-to-one assignments are the least of all, ties included, and pairs without a gain are left apart."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flexura.modal.mode_pairing import assignment, best_pairs

MANY = settings(deadline=None, max_examples=100)
SIZES = st.tuples(st.integers(1, 4), st.integers(1, 4))
TIED = SIZES.flatmap(lambda size: arrays(float, size, elements=st.integers(0, 2).map(float)))
"""Few different costs: most of them are equal."""


def least_sum(cost):
    if cost.shape[0] > cost.shape[1]:
        cost = cost.T
    columns = permutations(range(cost.shape[1]), cost.shape[0])
    return min(sum(cost[row, column] for row, column in enumerate(order)) for order in columns)


@MANY
@given(cost=TIED)
def test_the_sum_is_least_though_costs_are_equal(cost):
    rows, columns = assignment(cost)
    assert len(rows) == len(columns) == min(cost.shape)
    assert len(set(rows.tolist())) == len(rows)
    assert len(set(columns.tolist())) == len(columns)
    assert rows.tolist() == sorted(rows.tolist())
    assert cost[rows, columns].sum() == least_sum(cost)


@pytest.mark.parametrize("shape", [(3, 3), (2, 4), (4, 2)])
def test_equal_costs_are_assigned_in_order(shape):
    rows, columns = assignment(np.ones(shape))
    assert rows.tolist() == columns.tolist() == list(range(min(shape)))


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (0, 0)])
def test_nothing_to_assign(shape):
    rows, columns = assignment(np.zeros(shape))
    assert len(rows) == len(columns) == 0
    assert best_pairs(np.zeros(shape)).tolist() == [-1] * shape[0]


@MANY
@given(gain=TIED)
def test_pairs_have_a_gain_and_the_largest_sum(gain):
    partner = best_pairs(gain)
    paired = np.flatnonzero(partner >= 0)
    assert len(set(partner[paired].tolist())) == len(paired)
    assert (gain[paired, partner[paired]] > 0).all()
    assert gain[paired, partner[paired]].sum() == -least_sum(-gain)


def test_two_poor_pairs_go_before_one_good_one():
    """The sum decides: a row gives up its best column where another row has no other."""
    assert best_pairs(np.array([[0.9, 0.6], [0.8, 0.0]])).tolist() == [1, 0]
