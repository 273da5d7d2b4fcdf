"""Factors L D L' by the kernel, and eigenpairs by blocks, beside LAPACK's and SuperLU's."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp

from flexura.errors import SolverError
from flexura.linalg import lowest
from flexura.linalg.factor import LDL, SuperLU, eliminated
from flexura.linalg.krylov import lowest_by_blocks
from flexura.linalg.ldl import MOST_ROWS
from helpers.kernels import both, compiled

rng = np.random.default_rng(11)


def chain(n, width=6, definite=True):
    """A symmetric matrix (n, n) of a chain whose links have `width` coordinates, and one branch that closes a ring."""
    A = np.zeros((n, n))
    for at in [*range(0, n - 2 * width + 1, width)]:
        block = rng.standard_normal((2 * width, 2 * width))
        A[at : at + 2 * width, at : at + 2 * width] += block @ block.T if definite else block + block.T
    A[0, -1] = A[-1, 0] = 0.1
    return sp.csc_matrix(A + (np.eye(n) if definite else 0.0))


@compiled
@pytest.mark.parametrize("n", [12, 66, 300])
@pytest.mark.parametrize("definite", [True, False])
def test_solutions_pivots_and_their_bound(n, definite):
    A = chain(n, definite=definite)
    kernel, other = both(lambda: eliminated(A))
    assert isinstance(kernel, LDL) and isinstance(other, SuperLU)
    exact = np.linalg.eigvalsh(A.toarray())
    assert kernel.negative == int((exact < 0).sum())
    b = rng.standard_normal((n, 3))
    size = np.abs(np.linalg.solve(A.toarray(), b)).max() / np.abs(exact).min()
    for right in (b, b[:, 0], b[::-1][::-1], np.asfortranarray(b)):
        assert np.abs(kernel.solve(right) - np.linalg.solve(A.toarray(), right)).max() < 1e-12 * size
    D = sp.diags(kernel.scale)
    by = kernel._factors.by
    L = sp.csc_matrix((kernel._factors.L, kernel._factors.below, by.first), (n, n)) + sp.identity(n)
    whole = (L @ sp.diags(kernel.pivots) @ L.T).toarray()
    lost = np.abs(whole - (D @ A @ D).toarray()[np.ix_(by.order, by.order)]).sum(axis=1)
    assert (lost <= kernel.lost[by.order]).all()


@compiled
def test_hubs_come_last():
    """Many branches on one body are taken however many rows they have together, and are so many small chains."""
    branch, hub, count = chain(60), 6, MOST_ROWS // 60 + 40
    side = sp.csc_matrix(0.01 * rng.standard_normal((60 * count, hub)) * (np.arange(60 * count) % 60 < hub)[:, None])
    A = sp.block_array([[sp.block_diag([branch] * count), side], [side.T, 50.0 * sp.identity(hub)]]).tocsc()
    factors, b = eliminated(A), rng.standard_normal(A.shape[0])
    assert isinstance(factors, LDL) and sorted(factors.arrays[0][-hub:]) == [*range(60 * count, A.shape[0])]
    assert np.abs(A @ factors.solve(b) - b).max() < 1e-10
    alone = eliminated(branch)
    assert len(factors.arrays[3]) <= count * (len(alone.arrays[3]) + 60 * hub) + hub**2


@compiled
def test_pattern_is_worked_out_once_and_told_from_others(monkeypatch):
    from flexura.linalg import ldl

    made = []
    work = ldl._symbolic
    monkeypatch.setattr(ldl, "_symbolic", lambda A: made.append(A) or work(A))
    A, B = chain(72), chain(78)
    for matrix in (A, 2 * A, B, A, B):
        x = eliminated(matrix).solve(np.ones(matrix.shape[0]))
        assert np.allclose(matrix @ x, 1.0)
    assert len(made) == 2


@compiled
def test_what_is_not_symmetric_full_or_has_a_pivot_of_zero_goes_to_superlu():
    A = chain(60)
    skew = A.tolil()
    skew[0, 1] += 1e-3
    assert isinstance(eliminated(skew.tocsc()), SuperLU)
    assert isinstance(eliminated(sp.csc_matrix(np.eye(60) + 0.01)), SuperLU)
    saddle = sp.csc_matrix(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.5], [0.0, 0.5, 2.0]]))
    assert np.allclose(saddle @ eliminated(saddle).solve(np.ones(3)), 1.0)
    with pytest.raises(SolverError):
        eliminated(sp.csc_matrix(np.array([[1.0, 1.0], [1.0, 1.0]])))


@compiled
def test_large_ones_go_to_superlu():
    n = MOST_ROWS + 1
    A = sp.diags([[-1.0] * (n - 1), [2.5] * n, [-1.0] * (n - 1)], [-1, 0, 1], format="csc")
    assert isinstance(eliminated(A), SuperLU)


@compiled
@pytest.mark.parametrize("copies", [1, 3, 9])
def test_lowest_pairs_of_equal_chains(copies):
    A, M = chain(300 // copies // 6 * 6), np.diag(rng.uniform(0.5, 2.0, 300 // copies // 6 * 6))
    K = sp.block_diag([A] * copies, format="csc")
    mass = sp.block_diag([sp.csc_matrix(M)] * copies, format="csc")
    kernel, other = both(lambda: lowest(K, mass, 10))
    exact = la.eigh(K.toarray(), mass.toarray(), eigvals_only=True)[:10]
    assert np.allclose(kernel.values, exact, rtol=1e-10) and np.allclose(other.values, exact, rtol=1e-10)
    gram = kernel.vectors.T @ (mass @ kernel.vectors)
    assert np.abs(gram - np.eye(10)).max() < 1e-10
    rest = K @ kernel.vectors - mass @ kernel.vectors * kernel.values
    assert np.abs(rest).max() < 1e-8 * np.abs(K @ kernel.vectors).max()


@compiled
def test_blocks_give_up_where_nothing_has_mass():
    A = chain(60)
    M = sp.csc_matrix(([1.0], ([0], [0])), (60, 60))
    assert lowest_by_blocks(eliminated(A).solve, M, 2, 2, 0.0) is None
