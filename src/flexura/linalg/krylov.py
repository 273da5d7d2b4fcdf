"""The lowest eigenpairs by blocks of vectors, for factors that solve for some right sides as quickly as for one.

Source: Golub and Underwood (1977), The block Lanczos method, in Mathematical Software III; here with every vector kept
and all orthogonal to each other twice.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.linalg.pencil import Eigenpairs

BLOCK = 6
"""Vectors at a time: as many equal eigenvalues are found at once."""

MOST_BLOCKS = 20

SETTLED = 1e-12
"""Residual of a vector in the M-norm, relative: eigenvalues are off by its square."""


def lowest_by_blocks(M: Any, solve: Callable[[Array], Array], count: int, shift: float) -> Eigenpairs | None:
    """The `count` pairs of K and M (n, n) above a shift below all of them, M-orthonormal, some of equal ones perhaps
    missing; `solve` gives (K - shift M)^-1 b for b (n, k). None where they do not settle.
    """
    n = M.shape[0]
    most = min(BLOCK * MOST_BLOCKS, n // 2)
    V, MV, T = np.empty((most, n)), np.empty((most, n)), np.zeros((most, most))
    X = solve(M @ np.cos(np.outer(np.arange(n), 1.0 + np.arange(BLOCK))))
    for k in range(0, most - BLOCK + 1, BLOCK):
        checkpoint()
        own, so_far = slice(k, k + BLOCK), slice(k + BLOCK)
        made = _orthonormal(X, M, V[:k], MV[:k])
        if made is None:
            return None
        V[own], MV[own] = made[0].T, made[1].T
        X = solve(made[1])
        T[so_far, own] = MV[so_far] @ X
        T[own, so_far] = T[so_far, own].T
        X = X - V[so_far].T @ T[so_far, own]
        if k + BLOCK < count:
            continue
        mu, Y = np.linalg.eigh(T[so_far, so_far])
        mu, Y = mu[: -count - 1 : -1], Y[:, : -count - 1 : -1]
        rest = X @ Y[own]
        size = np.sqrt((rest * (M @ rest)).sum(axis=0).clip(0.0))
        if mu[-1] > 0 and (size <= SETTLED * mu).all():
            return Eigenpairs(1 / mu + shift, V[so_far].T @ Y)
    return None


def _orthonormal(X: Array, M: Any, V: Array, MV: Array) -> tuple[Array, Array] | None:
    """X (n, b) made M-orthonormal, and M-orthogonal to the rows of V (k, n), of which V M is known, with M X; None
    where it is in their span."""
    MX = X
    for _ in range(2):
        X = X - V.T @ (MV @ X)
        MX = M @ X
        try:
            turn = np.linalg.inv(np.linalg.cholesky(X.T @ MX)).T
        except np.linalg.LinAlgError:
            return None
        X, MX = X @ turn, MX @ turn
    return X, MX
