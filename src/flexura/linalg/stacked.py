"""Lowest eigenvalues of stacks of small dense pencils, one per design, without a Python loop over designs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.errors import SolverError
from flexura.linalg.eigen import lowest

Array = NDArray[np.float64]

GUARD = 4
"""Iteration vectors beyond the wanted ones (Bathe 1996, sec. 11.6)."""
MAX_STEPS = 12


def lowest_values(K: Array, M: Array, count: int, tolerance: float = 1e-10) -> Array:
    """The `count` lowest eigenvalues (..., count), ascending, of K x = lambda M x with K (..., n, n) positive definite.

    Subspace iteration (Bathe 1996, sec. 11.6) on the inverse of the diagonally scaled K; designs in which the
    relative change of a wanted eigenvalue has not fallen below `tolerance` are solved densely instead. Raises
    SolverError when a K is singular.
    """
    n = K.shape[-1]
    if n <= 2 * (count + GUARD):
        return _one_by_one(K, M, count)
    lead = K.shape[:-2]
    K, M = K.reshape(-1, n, n), M.reshape(-1, n, n)
    d = 1 / np.sqrt(np.einsum("...ii->...i", K))
    scale = d[:, :, None] * d[:, None, :]
    Ms = M * scale
    try:
        inverse = np.linalg.inv(K * scale)
    except np.linalg.LinAlgError:
        raise SolverError("a stiffness matrix is singular: something can move freely") from None
    values, change = _iterate(inverse, Ms, _start(Ms[0], count + GUARD), count, tolerance)
    slow = ~(change < tolerance)
    if slow.any():
        values[slow] = _one_by_one(K[slow], M[slow], count)
    return values.reshape(*lead, count)


def _iterate(inverse: Array, M: Array, X: Array, count: int, tolerance: float) -> tuple[Array, Array]:
    """Subspace iteration: values (designs, count) and their last relative change (designs,)."""
    MX = M @ X
    values = np.full((len(M), count), np.inf)
    change = np.full(len(M), np.inf)
    for _ in range(MAX_STEPS):
        Y = inverse @ MX
        MY = M @ Y
        Yt = np.swapaxes(Y, -1, -2)
        # Ritz pairs of the inverse: (Y' M X) z = lambda (Y' M Y) z, both small
        new, Z = _small(Yt @ MX, Yt @ MY)
        wanted = new[:, :count]
        change = np.max(np.abs(wanted - values) / wanted, axis=-1)
        values = wanted
        if (change < tolerance).all():
            break
        MX = MY @ Z
    return values.copy(), change


def _small(A: Array, B: Array) -> tuple[Array, Array]:
    """Eigenpairs of the small pencils A z = lambda B z, ascending, B positive definite; vectors B-orthonormal."""
    d = 1 / np.sqrt(np.einsum("...ii->...i", B))
    L = np.linalg.cholesky(B * d[:, :, None] * d[:, None, :])
    Li = np.linalg.inv(L)
    C = Li @ (A * d[:, :, None] * d[:, None, :]) @ np.swapaxes(Li, -1, -2)
    values, Z = np.linalg.eigh((C + np.swapaxes(C, -1, -2)) / 2)
    return values, d[:, :, None] * (np.swapaxes(Li, -1, -2) @ Z)


def _start(M: Array, q: int) -> Array:
    """Start vectors (n, q): the DOFs with most mass per stiffness, blended with a fixed pseudo-random part."""
    n = len(M)
    X = 0.01 * np.cos(np.outer(np.arange(1, n + 1), np.arange(1, q + 1)) ** 1.37)
    order = np.argsort(-np.diagonal(M), kind="stable")[: q - 1]
    X[order, np.arange(q - 1)] += 1.0
    X[:, q - 1] += np.diagonal(M)
    return X


def _one_by_one(K: Array, M: Array, count: int) -> Array:
    pairs = zip(K.reshape(-1, *K.shape[-2:]), M.reshape(-1, *M.shape[-2:]), strict=True)
    values = np.stack([lowest(k, m, count).values for k, m in pairs])
    return values.reshape(*K.shape[:-2], -1)
