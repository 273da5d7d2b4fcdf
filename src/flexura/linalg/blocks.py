"""The search for the lowest eigenpairs by block Lanczos: few vectors at once, for problems of a few thousand unknowns.

Blocks lose no copies of a repeated eigenvalue as long as they are wider than there are copies (Golub and Underwood
1977), and cost a call of each routine a block, where single vectors cost one a vector.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.linalg.factor import DENSE_LIMIT, SINGULAR_PIVOT, pivoted
from flexura.linalg.inertia import stable_count
from flexura.linalg.scaling import scaled
from flexura.linalg.search import Eigenpairs

STEPS = 8
"""Blocks after which the search is given up."""

CONVERGED = 1e-9
"""Residual of a pair of the inverse problem, over its value; what is left of it goes into the vectors (one more
inverse iteration), and Ritz vectors are mixed with one another by its square alone."""

BEYOND = 0.01
"""Farthest above the last eigenvalue, relative, that those up to it are counted."""


def lowest_groups(
    K: Any, M: Any, count: int, guard: int, gap: float, forces: Callable[[Array], Array]
) -> Eigenpairs | None:
    """The `count` lowest eigenpairs of sparse symmetric K and M (n, n), and up to `guard - 1` more that follow without
    a relative gap wider than `gap`; an inertia count proves that there are no others below.

    `forces` gives K X (n, k) to more digits than the sums that K holds have: the pairs are those of it.

    None where that does not come out: for full or small matrices, K that is not definite, a search that does not
    converge, more that follow.
    """
    if isinstance(K, np.ndarray) or K.shape[0] <= max(DENSE_LIMIT, STEPS * (count + guard)):
        return None
    pivot, factors = pivoted(K)
    if factors is None or pivot <= SINGULAR_PIVOT:
        return None
    d = factors.scale
    found = _searched(factors.solve_scaled, scaled(M, d), count, guard, gap)
    if found is None:
        return None
    stop, values, vectors = found
    last = values[stop - 1]
    level = min((last + values[stop]) / 2, (1 + BEYOND) * last)
    if stable_count((K - level * M).tocsc()) != stop:
        return None
    found = Eigenpairs(values[:stop], d[:, None] * vectors)
    return _refined(found, forces(found.vectors), M, factors.solve)


def _refined(pairs: Eigenpairs, KX: Array, M: Any, solve: Callable[[Array], Array]) -> Eigenpairs:
    """Eigenpairs after a step of inverse iteration from vectors X of which K X (n, k) is known; the factors solve for
    what is missing alone, so that their round-off is a part of it (Dongarra, Moler, Wilkinson 1983)."""
    forces = (M @ pairs.vectors) * pairs.values
    X = pairs.vectors + solve(forces - KX)
    A = X.T @ forces
    values, turn = la.eigh((A + A.T) / 2, X.T @ (M @ X))
    return Eigenpairs(values, X @ turn)


def _searched(solve: Any, M: Any, count: int, guard: int, gap: float) -> tuple[int, Array, Array] | None:
    """How many pairs were wanted, values of these and of others above them, and vectors of the wanted ones."""
    n, width = M.shape[0], count + guard
    V, MV = np.empty((2, n, width * STEPS), order="F")
    T, size = np.zeros((width * STEPS, width * STEPS)), 0
    block = solve(M @ np.random.default_rng(0).standard_normal((n, width)))
    while size < len(T):
        own = slice(size, size + width)
        orthogonal = _beside(block, M, V[:, :size], MV[:, :size])
        if orthogonal is None:
            return None
        V[:, own], MV[:, own], B = orthogonal
        if size:
            mu, y = la.eigh(T[:size, :size], subset_by_index=[size - width, size - 1])
            mu, y = mu[::-1], y[:, ::-1]
            near = mu[count:] >= (1 - gap) * mu[count - 1 : -1]
            stop = count + (guard if near.all() else int(np.argmin(near)))
            left = B @ y[-width:, :stop]
            if stop < width and (np.linalg.norm(left, axis=0) <= CONVERGED * mu[:stop]).all():
                return stop, 1 / mu, V[:, :size] @ y[:, :stop] + V[:, own] @ (left / mu[:stop])
        size += width
        block = solve(MV[:, own])
        T[:size, own] = MV[:, :size].T @ block
        T[own, :size] = T[:size, own].T
        block -= V[:, :size] @ T[:size, own]
    return None


def _beside(block: Array, M: Any, V: Array, MV: Array) -> tuple[Array, Array, Array] | None:
    """M-orthonormal Q (n, b), M-orthogonal to V (n, k), M Q, and B (b, b) with block = Q B for a block that is
    M-orthogonal to V but for round-off; None where it has fewer than b directions of its own."""
    B = np.eye(block.shape[1])
    for k in range(2):
        block = block - V @ (MV.T @ block) if k else block
        moved = M @ block
        gram = block.T @ moved
        size = np.sqrt(np.diagonal(gram))
        if not size.all():
            return None
        try:
            L = size[:, None] * la.cholesky(gram / np.outer(size, size), lower=True)
        except la.LinAlgError:
            return None
        turn = la.solve_triangular(L, np.eye(len(L)), lower=True).T
        block, moved, B = block @ turn, moved @ turn, L.T @ B
    return block, moved, B
