"""Lowest eigenvalues of stacks of small dense pencils, one per design, without a Python loop over designs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from flexura.errors import SolverError
from flexura.linalg.eigen import Eigenpairs, lowest

Array = NDArray[np.float64]

GUARD = 4
"""Iteration vectors beyond the wanted ones (Bathe 1996, sec. 11.6)."""
MAX_STEPS = 8
TOLERANCE = 1e-11
"""Estimated relative error at which an eigenvalue is accepted."""


def lowest_values(K: Array, M: Array, count: int, start: Eigenpairs | None = None) -> Array:
    """The `count` lowest eigenvalues (..., count), ascending, of K x = lambda M x with K (..., n, n) positive definite.

    Subspace iteration (Bathe 1996, sec. 11.6) from `start`, the count + GUARD lowest eigenpairs of a design like these
    (default: of the one in the middle of the stack). The remaining error of each eigenvalue is estimated from the ratio
    of its last two changes; designs in which it has not fallen below 1e-11 are solved one by one. Raises SolverError
    when a K is singular.
    """
    n, lead = K.shape[-1], K.shape[:-2]
    K, M = K.reshape(-1, n, n), M.reshape(-1, n, n)
    if n <= 2 * (count + GUARD) or (start is None and len(K) < 4):
        return _one_by_one(K, M, count).reshape(*lead, count)
    if start is None:
        start = lowest(K[len(K) // 2], M[len(K) // 2], count + GUARD)
    d = 1 / np.sqrt(np.einsum("...ii->...i", K))
    scale = d[:, :, None] * d[:, None, :]
    K, M = K * scale, M * scale
    values, error = _iterate(K, M, start.values, start.vectors / d[:, :, None], count)
    slow = ~(error < TOLERANCE)
    if slow.any():
        values[slow] = _one_by_one(K[slow], M[slow], count)
    return values.reshape(*lead, count)


def _iterate(K: Array, M: Array, start: Array, X: Array, count: int) -> tuple[Array, Array]:
    """Subspace iteration from the pairs (start, X) of one design: values (designs, count), errors (designs,)."""
    MX = M @ X
    values = np.broadcast_to(start[:count], (len(M), count))
    change, error = np.ones(len(M)), np.full(len(M), np.inf)
    solve = _solver(K)
    for _ in range(MAX_STEPS):
        Y = solve(MX)
        Yt = np.swapaxes(Y, -1, -2)
        MY = M @ Y
        # Ritz pairs of the inverse, both matrices small: (Y' M X) z = lambda (Y' M Y) z
        new, Z = _small(Yt @ MX, Yt @ MY)
        before, change = change, np.max(np.abs(new[:, :count] / values - 1), axis=-1)
        values = new[:, :count]
        ratio = np.minimum(change / np.maximum(before, 1e-300), 0.99)
        error = change * ratio / (1 - ratio)
        if (error < TOLERANCE).all():
            break
        MX = MY @ Z
    return values.copy(), error


def _solver(K: Array) -> Callable[[Array], Array]:
    """The function that solves K Y = X for stacks of X; a single K is factorised once (NumPy cannot in stacks)."""
    singular = "a stiffness matrix is singular: something can move freely"
    if len(K) == 1:
        factor, failed = lapack.dpotrf(K[0].T)
        if failed:
            raise SolverError(singular)
        return lambda X: lapack.dpotrs(factor, X[0])[0][None]

    def solve(X: Array) -> Array:
        try:
            return np.asarray(np.linalg.solve(K, X), dtype=np.float64)
        except np.linalg.LinAlgError:
            raise SolverError(singular) from None

    return solve


def _small(A: Array, B: Array) -> tuple[Array, Array]:
    """Eigenpairs of the small pencils A z = lambda B z, ascending, B positive definite; vectors B-orthonormal."""
    if len(A) == 1:
        # LAPACK knows the pencil as a whole, but not stacks of it
        values, Z, failed = lapack.dsygv(A[0], B[0])
        if not failed:
            return values[None], Z[None]
    d = 1 / np.sqrt(np.einsum("...ii->...i", B))
    scale = d[:, :, None] * d[:, None, :]
    Li = np.linalg.inv(np.linalg.cholesky(B * scale))
    Lt = np.swapaxes(Li, -1, -2)
    C = Li @ (A * scale) @ Lt
    values, Z = np.linalg.eigh(C)
    return values, d[:, :, None] * (Lt @ Z)


def _one_by_one(K: Array, M: Array, count: int) -> Array:
    return np.stack([lowest(k, m, count).values for k, m in zip(K, M, strict=True)])
