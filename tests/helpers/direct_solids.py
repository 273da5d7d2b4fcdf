"""Lowest modes of whole solids, meshed and solved as they are: what reduced ones are held against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.errors import OptionError
from flexura.linalg import Eigenpairs, Factor, SingularError, count_below, inverse_roots
from flexura.linalg.eigen import ShiftInvert
from flexura.linalg.factor import Progress, factorise_large

Array = NDArray[np.float64]

RECOVERED = 1e-2
"""Relative error with which K^-1 K v gives back v above which K counts as singular."""

COARSE = 1e-10
"""First negative shift for singular K over the largest ratio of stiffness to mass of a DOF."""

NEAR = (1e-2, 1e3)
"""Bounds of the first elastic eigenvalue over the shift outside which the shift is moved there."""

OFFSETS = (1e-5, 1e-4)
"""Relative distances below the last mode at which those up to it are counted."""

NUDGES = (0.0, 1e-8, -1e-8, 1e-6)
"""Relative changes of a value so close to an eigenvalue that pivots vanish."""


@dataclass(frozen=True)
class SolidModes:
    """The lowest modes of K x = lambda M x: `pairs`, ascending, and their relative `residuals` (k,), which bound the
    error of the eigenvalues (theory eq. 56).

    `missing` is the number of eigenvalues below the last one that an inertia count finds beyond these, None when none
    was made; `memory` the bytes of the factors, `solves` how often they were used.
    """

    pairs: Eigenpairs
    residuals: Array
    missing: int | None
    solver: str
    memory: float
    solves: int

    @property
    def frequency_hz(self) -> Array:
        """Natural frequencies (k,), Hz."""
        return np.sqrt(self.pairs.values) / (2 * np.pi)


def lowest_modes(
    K: Any,
    M: Any,
    n: int,
    *,
    count: bool = True,
    memory: float | None = None,
    progress: Progress | None = None,
) -> SolidModes:
    """The `n` lowest modes of sparse symmetric positive semidefinite K and M (N, N), K + M positive definite.

    Rigid motions have eigenvalues of exactly zero. `count` says that an inertia count proves completeness, at the cost
    of one more factorisation; `progress` is called as the work goes on. Raises SolverError when the memory (bytes;
    default: what is available) would not suffice or the search does not converge, OptionError for n < 1 or n >= N.
    """
    if not 1 <= n < K.shape[0]:
        raise OptionError(f"{n} modes of a system of order {K.shape[0]}: between one and order - 1 can be asked for")
    K, M = sp.csc_matrix(K), sp.csc_matrix(M)
    shift, factor = _start(K, M, memory, progress)
    search = _search(K, M, shift, factor, progress, n)
    found = search.nearest(n)
    if shift:
        noise = 1e-5 * abs(shift)
        elastic = found.values[found.values > noise]
        if not len(elastic):
            found = search.nearest(n + 6)
            elastic = found.values[found.values > noise]
        if len(elastic) and not NEAR[0] < elastic[0] / abs(shift) < NEAR[1]:
            shift = -float(elastic[0])
            factor = factorise_large(K - shift * M, memory=memory)
            search = _search(K, M, shift, factor, progress, n)
            found = search.nearest(n)
    missing = None
    if count:
        found = search.completed(found, n, lambda value: negative_count(K, M, value, memory), OFFSETS)
        missing = 0
    residuals = _residuals(search, found)[:n]
    zero = found.values < 1e-5 * abs(shift)
    values = np.where(zero, 0.0, found.values)[:n]
    pairs = Eigenpairs(values, found.vectors[:, :n])
    return SolidModes(pairs, residuals, missing, factor.name, factor.memory, search.solves)


def _start(K: Any, M: Any, memory: float | None, progress: Progress | None) -> tuple[float, Factor]:
    """Factors of K itself, or of K - shift M where K is singular."""
    stiffness, mass = K.diagonal(), M.diagonal()
    if (stiffness > 0).all():
        try:
            factor = factorise_large(K, memory=memory, progress=progress)
            v = np.cos(np.arange(K.shape[0]) * 1.7)
            x = v * inverse_roots(stiffness)
            error = np.abs((factor.solve(K @ x) - x) * np.sqrt(stiffness)).max()
            if error < RECOVERED:
                return 0.0, factor
            del factor
        except SingularError:
            pass
    shift = -COARSE * float(np.max(stiffness[mass > 0] / mass[mass > 0], initial=1.0))
    return shift, factorise_large(K - shift * M, memory=memory, progress=progress)


def _search(K: Any, M: Any, shift: float, factor: Factor, progress: Progress | None, n: int) -> ShiftInvert:
    search = ShiftInvert(K, M, shift, factor.solve, progress)
    search.expected = 3 * n + 30
    return search


def _residuals(search: ShiftInvert, pairs: Eigenpairs) -> Array:
    """Relative residuals (k,) as in `flexura.linalg.residuals`, with the factors at hand (theory eq. 56)."""
    Mx = search.M @ pairs.vectors
    r = (pairs.values - search.shift) * search.solve(Mx) - pairs.vectors
    return np.sqrt(np.abs(np.einsum("ik,ik->k", r, search.M @ r) / np.einsum("ik,ik->k", pairs.vectors, Mx)))


def negative_count(K: Any, M: Any, value: float, memory: float | None = None) -> int:
    """Number of eigenvalues of K x = lambda M x below `value`, by Sylvester's law of inertia (theory eq. E3)."""
    for nudge in NUDGES:
        found = factorise_large(K - value * (1 + nudge) * M, definite=False, memory=memory).negative
        if found is not None:
            return found
    return count_below(sp.csc_matrix(K), sp.csc_matrix(M), value)
