"""Counting eigenvalues below a value by the signs of a factorisation (Sylvester's law of inertia)."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.errors import SolverError

PIVOT_GROWTH = 1e8
"""A factorisation whose factors grow more than this is not trusted for its signs."""

DENSE_FALLBACK = 4000
_NUDGES = (0.0, 1e-9, -1e-9, 3e-8, -3e-8, 1e-6)


def count_below(K: Any, M: Any, value: float) -> int:
    """Number of eigenvalues of K x = lambda M x below `value`: the negative pivots of K - value M (theory eq. 55).

    K, M: (n, n) symmetric, M positive semidefinite. Sparse symmetric elimination with diagonal pivots; where those
    would be unstable the value is moved by parts in a thousand million, and at last a dense Bunch-Kaufman
    factorisation is used. Raises SolverError when even that is out of reach.
    """
    if isinstance(K, np.ndarray):
        return _dense_count(np.asarray(K) - value * np.asarray(M))
    for nudge in _NUDGES:
        count = _sparse_count((K - value * (1 + nudge) * M).tocsc())
        if count is not None:
            return count
    if K.shape[0] <= DENSE_FALLBACK:
        return _dense_count((K - value * M).toarray())
    raise SolverError("no stable factorisation was found for an inertia count")


def _sparse_count(A: sp.csc_matrix) -> int | None:
    d = np.sqrt(np.abs(A.diagonal()))
    scale = sp.diags(1 / np.where(d > 0, d, 1.0))
    A = (scale @ A @ scale).tocsc()
    try:
        lu = spla.splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:
        return None
    if not np.array_equal(lu.perm_r, lu.perm_c):
        return None
    L = lu.L
    growth = np.abs(L.data).max() ** 2 * np.abs(lu.U.diagonal()).max()
    if not np.isfinite(growth) or growth > PIVOT_GROWTH:
        return None
    return int((lu.U.diagonal() < 0).sum())


def _dense_count(A: np.ndarray) -> int:
    d = np.sqrt(np.abs(np.diagonal(A)))
    d = 1 / np.where(d > 0, d, 1.0)
    _, D, _ = la.ldl(A * d[:, None] * d)
    return int((la.eigvalsh_tridiagonal(np.diagonal(D), np.diagonal(D, 1)) < 0).sum())
