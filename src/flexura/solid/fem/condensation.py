"""Craig-Bampton reduction of large sparse systems such as solids."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.linalg import Eigenpairs, Progress, ShiftInvert, factorise_large, turned

COLUMNS = 64
"""Right sides that are solved at a time."""


@dataclass(frozen=True)
class CondensedSolid:
    """K and M (b + m, b + m) over boundary DOFs and amplitudes of fixed-interface modes, `basis` (n, b + m) that takes
    these to all DOFs, and the frequencies (m,), Hz, of the fixed-interface modes."""

    K: Array
    M: Array
    basis: Array
    fixed_frequency_hz: Array


def constraint_modes(
    K: Any,
    M: Any,
    boundary: Index,
    n_fixed: int = 0,
    *,
    up_to_hz: float = 0.0,
    most: int | None = None,
    memory: float | None = None,
    progress: Progress | None = None,
) -> CondensedSolid:
    """Craig-Bampton reduction to boundary DOFs (b,) and `n_fixed` fixed-interface modes (theory eq. E7).

    Psi = -Kii^-1 Kib, and Kii x = lambda Mii x for the modes, M-orthonormal; without modes it is Guyan's (1965). With
    `up_to_hz` all modes up to that frequency are taken, and at least `n_fixed`, but no more than `most`: their number
    grows as the cube of the frequency. K, M: (n, n) sparse. Raises SolverError when the inside can move with the
    boundary held, or for want of memory.
    """
    K, M = sp.csc_matrix(K), sp.csc_matrix(M)
    n, b = K.shape[0], len(boundary)
    inner = np.setdiff1d(np.arange(n), boundary)
    if len(np.unique(boundary)) != b or len(inner) + b != n or not len(inner):
        raise OptionError(f"boundary DOFs are distinct numbers below {n}, and not all of them")
    Kii, Mii = K[inner][:, inner], M[inner][:, inner]
    factor = factorise_large(Kii, memory=memory, progress=progress)
    psi = np.zeros((n, b))
    psi[boundary, np.arange(b)] = 1.0
    coupling = K[inner][:, boundary]
    for first in range(0, b, COLUMNS):
        part = np.arange(first, min(first + COLUMNS, b))
        psi[np.ix_(inner, part)] = -factor.solve(coupling[:, part].toarray())
        _each(progress, part[-1] + 1, b)
    fixed = _fixed_modes(ShiftInvert(Kii, Mii, 0.0, factor.solve, progress), n_fixed, (2 * np.pi * up_to_hz) ** 2, most)
    values, basis = fixed.values, np.hstack([psi, np.zeros((n, len(fixed.values)))])
    basis[inner, b:] = fixed.vectors
    reduced = [basis.T @ (A @ basis) for A in (K, M)]
    Kr, Mr = ((A + A.T) / 2 for A in reduced)
    Kr[:b, b:] = Kr[b:, :b] = 0.0
    return CondensedSolid(Kr, Mr, basis, np.sqrt(values) / (2 * np.pi))


def _fixed_modes(search: ShiftInvert, least: int, limit: float, most: int | None) -> Eigenpairs:
    """All pairs with values up to a limit, at least `least` and at most `most`; largest entries of vectors positive."""
    n = search.K.shape[0]
    bound = n - 1 if most is None else min(max(most, least), n - 1)
    count = max(least, 6) if limit else least
    if not count:
        return Eigenpairs(np.empty(0), np.empty((n, 0)))
    while True:
        count = min(count, bound)
        search.expected = search.solves + 3 * count + 30
        found = search.nearest(count)
        if found.values[-1] > limit or count == bound:
            break
        grown = (limit / found.values[-1]) ** 1.5  # their number grows as the cube of the frequency
        count = int(min(max(2.0, grown) * count, float(bound)))
    keep = max(int((found.values <= limit).sum()), min(least, count))
    return Eigenpairs(found.values[:keep], turned(found.vectors[:, :keep]))


def _each(progress: Callable[[str, float], None] | None, done: int, total: int) -> None:
    if progress is not None:
        progress("condense", done / total)
