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
from flexura.linalg.pencil import EPS, Pencil

Array = NDArray[np.float64]

FACTORS = 8
"""Units of round-off of a factor's entry per unit of the product of their absolute values."""

DENSE_BRACKET = 60
"""Up to this order eigenvalues are as quick as factorisations."""

UNSTABLE = 1e-7
"""A factorisation that may be off by more than this, beside a diagonal of ones, is not trusted for its signs."""

DENSE_FALLBACK = 4000
_NUDGES = (0.0, 1e-9, -1e-9, 3e-8, -3e-8, 1e-6)


@dataclass(frozen=True)
class Bracket:
    """What factorisations prove about the number of eigenvalues below `value`: at least `least`, at most `most`.

    `solve` gives nearly (K - value M)^-1 b for b (n, k).
    """

    value: float
    least: int
    most: int
    solve: Callable[[Array], Array]

    @property
    def is_proven(self) -> bool:
        """True when the number is known."""
        return self.least == self.most


def bracket(pencil: Pencil, value: float) -> Bracket:
    """Count the eigenvalues below `value` of the true matrices, of which those stored differ by round-off.

    K - value M is factorised with the bounds of its own round-off, and of that of the factorisation, subtracted from
    and added to its diagonal (theory eq. C8): the true number lies between the two counts. Where they differ values
    next to it are tried. Raises SolverError when there is no factorisation.
    """
    best = None
    for nudge in (0.0, 1e-6, -1e-6, 1e-4, -1e-4, 2e-3, -2e-3):
        found = _bracket(pencil, value * (1 + nudge))
        if found is not None and found.is_proven:
            return found
        if found is not None and (best is None or found.most - found.least < best.most - best.least):
            best = found
    if best is None:
        raise SolverError("no stable factorisation was found for an inertia count")
    return best


def _bracket(pencil: Pencil, value: float) -> Bracket | None:
    d = 1 / np.sqrt(np.maximum(pencil.K.diagonal() + abs(value) * pencil.M.diagonal(), np.finfo(float).tiny))
    lost = pencil.uncertainty(d, value)
    A: Any = pencil.K - value * pencil.M
    if isinstance(A, np.ndarray) or len(d) <= DENSE_BRACKET:
        return _dense_bracket(_dense(A) * d[:, None] * d, d, lost, value)
    A = scaled(A.tocsc(), d)
    lost = lost + FACTORS * EPS * np.asarray(abs(A).sum(axis=1)).ravel()
    for _ in range(3):
        lower, upper = (_signed(A + sp.diags(side * lost, format="csc")) for side in (-1, 1))
        if lower is None or upper is None:
            break
        own = np.maximum(lower[2], upper[2])
        if (own <= lost).all():
            return Bracket(value, upper[1], lower[1], _solver(lower[0], d))
        lost = np.maximum(lost, 4 * own)
    return _dense_bracket(A.toarray(), d, lost, value) if len(d) <= DENSE_FALLBACK else None


def _solver(lu: spla.SuperLU, d: Array) -> Callable[[Array], Array]:
    return lambda b: d[:, None] * lu.solve(np.ascontiguousarray(d[:, None] * b))


def _signed(A: sp.csc_matrix) -> tuple[spla.SuperLU, int, Array] | None:
    """Factors with diagonal pivots, how many of these are negative, and row sums (n,) of the bound of their round-off
    (Higham 2002, theorem 9.3); None where a pivot is zero."""
    try:
        lu = superlu(A.tocsc())
    except RuntimeError:
        return None
    if not np.array_equal(lu.perm_r, lu.perm_c):
        return None
    L, U = lu.L, lu.U
    size = abs(L) @ (abs(U) @ np.ones(A.shape[0]))
    if not np.isfinite(size).all():
        return None
    return lu, int((U.diagonal() < 0).sum()), FACTORS * EPS * size[lu.perm_r]


def _dense_bracket(A: Array, d: Array, lost: Array, value: float) -> Bracket:
    """By the eigenvalues of the scaled matrix, which are right to some units of round-off of its norm."""
    values, V = la.eigh((A + A.T) / 2)
    margin = float(lost.max()) + len(d) * EPS * float(np.abs(values).max())

    def solve(b: Array) -> Array:
        y = V.T @ (d[:, None] * b) / np.where(values != 0, values, EPS)[:, None]
        return d[:, None] * (V @ y)

    return Bracket(value, int((values < -margin).sum()), int((values < margin).sum()), solve)


def _dense(A: Any) -> Array:
    return np.asarray(A.toarray() if hasattr(A, "toarray") else A)


def count_below(K: Any, M: Any, value: float) -> int:
    """Number of eigenvalues of K x = lambda M x below `value`: the negative pivots of K - value M (theory eq. 55).

    K, M: (n, n) symmetric, M positive semidefinite, as they are stored. Sparse symmetric elimination with diagonal
    pivots; where those would be unstable the value is moved by parts in a thousand million, and at last a dense
    Bunch-Kaufman factorisation is used. Raises SolverError when even that is out of reach.
    """
    if isinstance(K, np.ndarray):
        return _dense_count(np.asarray(K) - value * np.asarray(M))
    for nudge in _NUDGES:
        found = stable_count((K - value * (1 + nudge) * M).tocsc())
        if found is not None:
            return found
    if K.shape[0] <= DENSE_FALLBACK:
        return _dense_count((K - value * M).toarray())
    raise SolverError("no stable factorisation was found for an inertia count")


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


def stable_count(A: sp.csc_matrix) -> int | None:
    """Number of negative eigenvalues of a symmetric A (n, n) by diagonal pivots; None where those would be unstable."""
    checkpoint()
    d = np.sqrt(np.abs(A.diagonal()))
    found = _signed(scaled(A, 1 / np.where(d > 0, d, 1.0)))
    return None if found is None or found[2].max(initial=0.0) > UNSTABLE else found[1]


def _dense_count(A: Array) -> int:
    d = np.sqrt(np.abs(np.diagonal(A)))
    d = 1 / np.where(d > 0, d, 1.0)
    _, D, _ = la.ldl(A * d[:, None] * d)
    return int((la.eigvalsh_tridiagonal(np.diagonal(D), np.diagonal(D, 1)) < 0).sum())
