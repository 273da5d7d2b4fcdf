"""Counting eigenvalues below a value by the signs of a factorisation (Sylvester's law of inertia)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from flexura.deadline import checkpoint
from flexura.errors import SolverError

Array = NDArray[np.float64]

PIVOT_GROWTH = 1e8
"""A factorisation whose factors grow more than this is not trusted for its signs."""

DENSE_FALLBACK = 4000
_NUDGES = (0.0, 1e-9, -1e-9, 3e-8, -3e-8, 1e-6)


@dataclass(frozen=True)
class ShiftedFactors:
    """Factors of K - value M: how many eigenvalues of K x = lambda M x lie below `value`, and the solution of
    (K - value M) y = b for b (n, k)."""

    value: float
    count: int
    solve: Callable[[Array], Array]


def shifted_factors(K: Any, M: Any, value: float) -> ShiftedFactors:
    """Factorise K - value M, with the inertia count that its pivots give (theory eq. 55).

    K, M: (n, n) symmetric, M positive semidefinite. Sparse symmetric elimination with diagonal pivots; where those
    would be unstable the value is moved by parts in a thousand million, and at last a dense Bunch-Kaufman
    factorisation is used. Raises SolverError when even that is out of reach.
    """
    if isinstance(K, np.ndarray):
        return _dense_factors(np.asarray(K) - value * np.asarray(M), value)
    for nudge in _NUDGES:
        found = stable_factors((K - value * (1 + nudge) * M).tocsc(), value * (1 + nudge))
        if found is not None:
            return found
    if K.shape[0] <= DENSE_FALLBACK:
        return _dense_factors((K - value * M).toarray(), value)
    raise SolverError("no stable factorisation was found for an inertia count")


def count_below(K: Any, M: Any, value: float) -> int:
    """Number of eigenvalues of K x = lambda M x below `value`: the negative pivots of K - value M (theory eq. 55).

    Arguments and errors as in `shifted_factors`.
    """
    return shifted_factors(K, M, value).count


def scaled(A: sp.csc_matrix, d: Array) -> sp.csc_matrix:
    """D A D for a sparse A (n, n) by columns and D = diag(d); shares no array with A, since SuperLU sorts its own."""
    data = A.data * d[A.indices] * np.repeat(d, np.diff(A.indptr))
    return sp.csc_matrix((data, A.indices.copy(), A.indptr.copy()), shape=A.shape)


def superlu(A: sp.csc_matrix) -> spla.SuperLU:
    """LU factors of a sparse symmetric A (n, n) with a fill-reducing ordering, diagonal pivots preferred; A stays as it
    is. Raises RuntimeError when A is singular, as SciPy does."""
    options = {"SymmetricMode": True}
    own = A if A.has_sorted_indices else A.sorted_indices()
    return spla.splu(own, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def stable_factors(A: sp.csc_matrix, value: float) -> ShiftedFactors | None:
    """Factors of A = K - value M with diagonal pivots; None where those would be unstable."""
    checkpoint()
    d = np.sqrt(np.abs(A.diagonal()))
    d = 1 / np.where(d > 0, d, 1.0)
    A = scaled(A, d)
    try:
        lu = superlu(A)
    except RuntimeError:
        return None
    if not np.array_equal(lu.perm_r, lu.perm_c):
        return None
    pivots = lu.U.diagonal()
    growth = np.abs(lu.L.data).max() ** 2 * np.abs(pivots).max()
    if not np.isfinite(growth) or growth > PIVOT_GROWTH:
        return None

    def solve(b: Array) -> Array:
        return d[:, None] * lu.solve(np.ascontiguousarray(d[:, None] * b))

    return ShiftedFactors(value, int((pivots < 0).sum()), solve)


def _dense_factors(A: Array, value: float) -> ShiftedFactors:
    d = np.sqrt(np.abs(np.diagonal(A)))
    d = 1 / np.where(d > 0, d, 1.0)
    scaled = A * d[:, None] * d
    _, D, _ = la.ldl(scaled)
    count = int((la.eigvalsh_tridiagonal(np.diagonal(D), np.diagonal(D, 1)) < 0).sum())

    def solve(b: Array) -> Array:
        return d[:, None] * la.solve(scaled, d[:, None] * b, assume_a="sym")

    return ShiftedFactors(value, count, solve)
