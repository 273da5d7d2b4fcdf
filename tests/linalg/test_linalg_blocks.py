"""Lowest eigenpairs by blocks: chains of equal springs and masses, whose eigenvalues are known."""

import numpy as np
import pytest
import scipy.sparse as sp

from flexura.linalg import lowest_groups


def chains(copies: int, n: int = 150, held: bool = True):
    """K and M of equal chains of n unit masses between unit springs, held at both ends or at none, and the eigenvalues
    of one."""
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    if not held:
        K[0, 0] = K[-1, -1] = 1.0
    one = 4 * np.sin(np.pi * np.arange(1, n + 1) / (2 * (n + 1))) ** 2
    return sp.block_diag([K] * copies, format="csc"), sp.identity(copies * n, format="csc"), one


@pytest.mark.parametrize(("copies", "count", "found"), [(2, 1, 2), (2, 4, 4), (3, 4, 6), (3, 6, 6)])
def test_copies_of_the_last_come_with_it(copies, count, found):
    K, M, one = chains(copies)
    pairs = lowest_groups(K, M, count, guard=3, gap=1e-6, forces=lambda X: K @ X)
    assert pairs is not None
    assert pairs.values == pytest.approx(np.repeat(one, copies)[:found], rel=1e-9)
    X = pairs.vectors
    assert abs(X.T @ (M @ X) - np.eye(found)).max() < 1e-10
    assert abs(K @ X - M @ X * pairs.values).max() < 1e-8


def test_pairs_are_those_of_the_forces_that_are_known_better():
    K, M, one = chains(2)
    rough = K @ sp.diags(1 + 1e-8 * np.random.default_rng(1).random(300))
    pairs = lowest_groups(((rough + rough.T) / 2).tocsc(), M, 4, guard=3, gap=1e-6, forces=lambda X: K @ X)
    assert pairs is not None
    assert pairs.values == pytest.approx(np.repeat(one, 2)[:4], rel=1e-13)
    assert abs(K @ pairs.vectors - M @ pairs.vectors * pairs.values).max() < 1e-11


def test_masses_may_be_missing():
    K, _, _ = chains(1, 300)
    M = sp.diags((np.arange(300) % 2).astype(float), format="csc")
    pairs = lowest_groups(K, M, 3, guard=3, gap=1e-6, forces=lambda X: K @ X)
    assert pairs is not None
    # two springs in a row are one of half the stiffness; the last mass is held by a single one at the end
    rest = np.eye(150) - 0.5 * np.eye(150, k=1) - 0.5 * np.eye(150, k=-1)
    rest[-1, -1] = 1.5
    assert pairs.values == pytest.approx(np.linalg.eigvalsh(rest)[:3], rel=1e-9)


@pytest.mark.parametrize(
    "K, M",
    [chains(2, 150, held=False)[:2], chains(4)[:2], chains(1)[:2], [A.toarray() for A in chains(2)[:2]]],
    ids=["floating", "more copies than the guard", "small", "full"],
)
def test_what_it_is_not_for(K, M):
    assert lowest_groups(K, M, 1, guard=3, gap=1e-6, forces=lambda X: K @ X) is None
