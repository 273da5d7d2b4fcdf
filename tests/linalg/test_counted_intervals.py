"""Intervals of eigenvalues, numbered: they hold the exact ones, and what is missed is told."""

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp

from flexura.linalg import counted_intervals
from helpers.over import over

EXACT = np.array([1.0, 4.0, 4.0, 9.0, 9.0 + 1e-13, 16.0, 25.0, 36.0, 50.0, 70.0])


def pencil(values, seed=0):
    """K and M (n, n), dense, whose eigenvalues are known, and the M-orthonormal vectors of these."""
    rng = np.random.default_rng(seed)
    L = np.tril(rng.normal(size=(len(values),) * 2)) + 4 * np.eye(len(values))
    Q = np.linalg.qr(rng.normal(size=(len(values),) * 2))[0]
    K, M = L @ Q @ np.diag(values) @ Q.T @ L.T, L @ L.T
    return sp.csc_matrix((K + K.T) / 2), sp.csc_matrix((M + M.T) / 2), la.solve_triangular(L.T, Q)


@over("shift", [0.0, 30.0, 4.0])
@over("count", [1, 2, 3, 4, 6, 10])
def test_exact_values_lie_in_the_interval_of_their_number(shift, count):
    values = EXACT - shift
    K, M, X = pencil(values)
    lower, upper, proven = counted_intervals(K, M, values[:count], X[:, :count])
    assert proven
    assert (lower <= values[:count] + 1e-12).all()
    assert (values[:count] - 1e-12 <= upper).all()
    assert (upper - lower).max() < 1e-4 * np.abs(values).max()


@pytest.mark.parametrize("missed", [0, 1, 3, 5])
def test_a_pair_that_is_missed_is_told(missed):
    K, M, X = pencil(EXACT)
    kept = np.delete(np.arange(8), missed)
    assert not counted_intervals(K, M, EXACT[kept], X[:, kept])[2]


def test_poor_vectors_have_wide_intervals():
    values = np.array([1.0, 4.0, 9.0, 16.0])
    K, M, X = pencil(values)
    off = X[:, 0] + 0.01 * X[:, 1]
    quotient = off @ K @ off / (off @ M @ off)
    lower, upper, _ = counted_intervals(K, M, np.array([quotient]), off[:, None] / np.sqrt(off @ M @ off))
    assert lower[0] <= 1.0 <= upper[0]
    assert 1e-4 < upper[0] - lower[0] < 0.1
