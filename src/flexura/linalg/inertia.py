"""Counting eigenvalues below a value by the signs of a factorisation (Sylvester's law of inertia)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.linalg.factor import ROUND_OFF, SingularError, SuperLU
from flexura.linalg.pencil import EPS, Pencil
from flexura.linalg.scaling import inverse_roots, scaled, unit_scale

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
    d = inverse_roots(pencil.K.diagonal() + abs(value) * pencil.M.diagonal())
    lost = pencil.uncertainty(d, value)
    A: Any = pencil.K - value * pencil.M
    if isinstance(A, np.ndarray) or len(d) <= DENSE_BRACKET:
        return _dense_bracket(scaled(_dense(A), d), d, lost, value)
    A = scaled(A.tocsc(), d)
    lost = lost + ROUND_OFF * EPS * np.asarray(abs(A).sum(axis=1)).ravel()
    for _ in range(3):
        lower, upper = (_signed(A + sp.diags(side * lost, format="csc"), np.ones(len(d))) for side in (-1, 1))
        if lower is None or upper is None:
            break
        own = np.maximum(lower.lost, upper.lost)
        if (own <= lost).all():
            return Bracket(value, upper.negative, lower.negative, _solver(lower.factor, d))
        lost = np.maximum(lost, 4 * own)
    return _dense_bracket(A.toarray(), d, lost, value) if len(d) <= DENSE_FALLBACK else None


def _solver(factor: SuperLU, d: Array) -> Callable[[Array], Array]:
    return lambda b: d[:, None] * factor.solve(d[:, None] * b)


@dataclass(frozen=True)
class _Signed:
    """A factor with diagonal pivots, how many are negative, and row sums (n,) of the bound of its round-off."""

    factor: SuperLU
    negative: int
    lost: Array


def _signed(A: sp.csc_matrix, scale: Array) -> _Signed | None:
    """Of an A (n, n), scaled by `scale` (n,); None where a pivot is zero or not on the diagonal."""
    try:
        factor = SuperLU(A, scale)
    except SingularError:
        return None
    negative, lost = factor.negative, factor.lost
    return None if negative is None or lost is None else _Signed(factor, negative, lost)


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


def stable_count(A: sp.csc_matrix) -> int | None:
    """Number of negative eigenvalues of a symmetric A (n, n) by diagonal pivots; None where those would be unstable."""
    checkpoint()
    found = _signed(A, unit_scale(A))
    return None if found is None or found.lost.max(initial=0.0) > UNSTABLE else found.negative


def _dense_count(A: Array) -> int:
    D, pivots, _ = la.lapack.dsytrf(scaled(A, unit_scale(A)), lower=1)
    pairs = pivots < 0  # pivots of two rows have an eigenvalue of either sign (Bunch, Kaufman 1977)
    return int((np.diagonal(D)[~pairs] < 0).sum() + pairs.sum() // 2)
