"""Intervals of the lowest eigenvalues, number by number: each pair by its residual, and none missed by a count."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg.inertia import count_below
from flexura.linalg.pencil import Pencil
from flexura.linalg.residual_bounds import residual_intervals

APART = 1e-5
"""Relative gap between intervals in which eigenvalues are counted."""


def counted_intervals(K: Any, M: Any, values: Array, vectors: Array) -> tuple[Array, Array, bool]:
    """Bounds (k,), (k,) of the k lowest eigenvalues of K x = lambda M x as K and M are stored, and whether they hold.

    values (k,), ascending, and M-orthonormal vectors (n, k) are pairs that were found; K may have any inertia. The
    residual of each gives an interval that holds some eigenvalue (`residual_intervals`); p of them that overlap hold p,
    made wider by sqrt(2 p) (Kahan; Parlett 1980, sec. 11.5). A count of the eigenvalues below the last ones, or below
    a gap behind them, then says that none is missed and numbers them (theory eq. G20). Bounds are infinite where K
    cannot be factorised.
    """
    try:
        lower, upper = residual_intervals(Pencil.of(sp.csc_matrix(K), sp.csc_matrix(M)), values, vectors)
    except SolverError:
        lower, upper = np.full(len(values), -np.inf), np.full(len(values), np.inf)
    if not np.isfinite(upper).all():
        return lower, upper, False
    lower, upper = _grouped(lower, upper)
    k, last = len(values), float(upper[-1])
    if count_below(K, M, last + APART * abs(last)) == k:
        return lower, upper, True
    apart = lower[1:] - upper[:-1] > APART * np.abs(lower[1:])
    first = int(np.flatnonzero(np.append(True, apart))[-1])
    below = float(lower[first] - APART / 2 * abs(lower[first]))
    lower[first:] = below
    return lower, upper, count_below(K, M, below) == first


def _grouped(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Bounds of which those that overlap are one, wide enough for as many eigenvalues as they are."""
    number = np.cumsum(np.append(True, lower[1:] > np.maximum.accumulate(upper)[:-1])) - 1
    for group in np.flatnonzero(np.bincount(number) > 1):
        own = np.flatnonzero(number == group)
        wider = (np.sqrt(2 * len(own)) - 1) / 2 * float((upper[own] - lower[own]).max())
        lower[own], upper[own] = lower[own].min() - wider, upper[own].max() + wider
    return lower, upper
