"""Lowest modes and static condensation of large sparse systems such as solids, with evidence.

Shift-invert Lanczos (Ericsson and Ruhe 1980) on factors from `flexura.solid.factors`; what repeated eigenvalues it may
have lost is found by an inertia count and looked for again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, turned
from flexura.solid.factors import Factors, Progress, factorise, negative_count

Array = NDArray[np.float64]
Index = NDArray[np.intp]

__all__ = ["CondensedSolid", "SolidModes", "constraint_modes", "factorise", "lowest_modes"]

RECOVERED = 1e-2
"""Relative error with which K^-1 K v gives back v above which K counts as singular."""

COARSE = 1e-10
"""First negative shift for singular K over the largest ratio of stiffness to mass of a DOF."""

NEAR = (1e-2, 1e3)
"""Bounds of the first elastic eigenvalue over the shift outside which the shift is moved there."""

SEARCHES = 10
"""Rounds in which missing copies of repeated eigenvalues are looked for."""

COLUMNS = 64
"""Right sides that are solved at a time."""


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


@dataclass(frozen=True)
class CondensedSolid:
    """K and M (b + m, b + m) over boundary DOFs and amplitudes of fixed-interface modes, `basis` (n, b + m) that takes
    these to all DOFs, and the frequencies (m,), Hz, of the fixed-interface modes."""

    K: Array
    M: Array
    basis: Array
    fixed_frequency_hz: Array


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
    shift, factors = _start(K, M, memory, progress)
    search = _Search(K, M, shift, factors, progress, n)
    found = search.run(n, np.empty((K.shape[0], 0)))
    if shift:
        noise = 1e-5 * abs(shift)
        elastic = found.values[found.values > noise]
        if not len(elastic):
            found = search.run(min(n + 6, K.shape[0] - 1), np.empty((K.shape[0], 0)))
            elastic = found.values[found.values > noise]
        if len(elastic) and not NEAR[0] < elastic[0] / abs(shift) < NEAR[1]:
            shift = -float(elastic[0])
            search = _Search(K, M, shift, factorise(K - shift * M, memory=memory), progress, n)
            found = search.run(n, np.empty((K.shape[0], 0)))
    missing = None
    if count:
        found, missing = _completed(search, found, n, memory)
    residuals = search.residuals(found)[:n]
    zero = found.values < 1e-5 * abs(shift)
    values = np.where(zero, 0.0, found.values)[:n]
    pairs = Eigenpairs(values, found.vectors[:, :n])
    return SolidModes(pairs, residuals, missing, search.factors.solver, search.factors.memory, search.solves)


def _start(K: Any, M: Any, memory: float | None, progress: Progress | None) -> tuple[float, Factors]:
    """Factors of K itself, or of K - shift M where K is singular."""
    stiffness, mass = K.diagonal(), M.diagonal()
    if (stiffness > 0).all():
        try:
            factors = factorise(K, memory=memory, progress=progress)
            v = np.cos(np.arange(K.shape[0]) * 1.7)
            x = v / np.sqrt(stiffness)
            error = np.abs((factors(K @ x) - x) * np.sqrt(stiffness)).max()
            if error < RECOVERED:
                return 0.0, factors
            del factors
        except SolverError as error:
            if "definite" not in str(error) and "singular" not in str(error):
                raise
    shift = -COARSE * float(np.max(stiffness[mass > 0] / mass[mass > 0], initial=1.0))
    return shift, factorise(K - shift * M, memory=memory, progress=progress)


class _Search:
    """Lanczos on (K - shift M)^-1 M."""

    def __init__(self, K: Any, M: Any, shift: float, factors: Factors, progress: Progress | None, n: int) -> None:
        self.K, self.M, self.shift, self.factors = K, M, shift, factors
        self.progress, self.solves, self.expected = progress, 0, 3 * n + 30

    def run(self, n: int, known: Array) -> Eigenpairs:
        """The n lowest pairs in the M-orthogonal complement of `known` (N, j)."""
        N = self.K.shape[0]
        Mk = self.M @ known

        def invert(b: Array) -> Array:
            self.solves += 1
            if self.progress is not None:
                self.progress("iterate", min(0.99, self.solves / self.expected))
            y = self.factors(b)
            return y - known @ (Mk.T @ y) if known.shape[1] else y

        start = np.random.default_rng(1 + known.shape[1]).standard_normal(N) / np.sqrt(self.M.diagonal().max())
        start = invert(self.M @ (start - known @ (Mk.T @ start)))
        operator = spla.LinearOperator((N, N), matvec=invert, dtype=float)
        ncv = min(N, max(2 * n + 12, 20))
        try:
            values, vectors = spla.eigsh(
                self.K, n, M=self.M, sigma=self.shift, OPinv=operator, which="LM", v0=start, ncv=ncv, tol=0
            )
        except spla.ArpackError as error:
            raise SolverError(f"the eigenvalue search did not converge: {error}") from None
        order = np.argsort(values)
        return Eigenpairs(values[order], _orthonormal(vectors[:, order], self.M))

    def residuals(self, pairs: Eigenpairs) -> Array:
        """Relative residuals (k,) as in `flexura.linalg.residuals`, with the factors at hand (theory eq. 56)."""
        Mx = self.M @ pairs.vectors
        r = (pairs.values - self.shift) * self.factors(Mx) - pairs.vectors
        return np.sqrt(np.abs(np.einsum("ik,ik->k", r, self.M @ r) / np.einsum("ik,ik->k", pairs.vectors, Mx)))


def _completed(search: _Search, found: Eigenpairs, n: int, memory: float | None) -> tuple[Eigenpairs, int]:
    """The pairs with the copies of repeated eigenvalues that were missed, and how many are still missing."""
    K, M = search.K, search.M
    for _ in range(SEARCHES):
        last = float(found.values[:n].max())
        below = last - 1e-5 * abs(last) - 1e-3 * abs(search.shift)
        if search.progress is not None:
            search.progress("count", 0.0)
        missing = negative_count(K, M, below, memory) - int((found.values < below).sum())
        if missing <= 0:
            return found, 0
        more = search.run(missing, found.vectors)
        values = np.concatenate([found.values, more.values])
        order = np.argsort(values, kind="stable")
        found = Eigenpairs(values[order], np.hstack([found.vectors, more.vectors])[:, order])
    raise SolverError("the search for missing eigenvalues does not end: the stiffness has lost its digits")


def _orthonormal(X: Array, M: Any) -> Array:
    """X (n, k) made M-orthonormal in order (Cholesky of the Gram matrix)."""
    gram = X.T @ (M @ X)
    return la.solve_triangular(la.cholesky(gram, lower=True), X.T, lower=True).T


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
    factors = factorise(Kii, memory=memory, progress=progress)
    psi = np.zeros((n, b))
    psi[boundary, np.arange(b)] = 1.0
    coupling = K[inner][:, boundary]
    for first in range(0, b, COLUMNS):
        part = np.arange(first, min(first + COLUMNS, b))
        psi[np.ix_(inner, part)] = -factors(coupling[:, part].toarray())
        _each(progress, part[-1] + 1, b)
    fixed = _fixed_modes(_Search(Kii, Mii, 0.0, factors, progress, n_fixed), n_fixed, (2 * np.pi * up_to_hz) ** 2, most)
    values, basis = fixed.values, np.hstack([psi, np.zeros((n, len(fixed.values)))])
    basis[inner, b:] = fixed.vectors
    reduced = [basis.T @ (A @ basis) for A in (K, M)]
    Kr, Mr = ((A + A.T) / 2 for A in reduced)
    Kr[:b, b:] = Kr[b:, :b] = 0.0
    return CondensedSolid(Kr, Mr, basis, np.sqrt(values) / (2 * np.pi))


def _fixed_modes(search: _Search, least: int, limit: float, most: int | None) -> Eigenpairs:
    """All pairs with values up to a limit, at least `least` and at most `most`; largest entries of vectors positive."""
    n = search.K.shape[0]
    bound = n - 1 if most is None else min(max(most, least), n - 1)
    count = max(least, 6) if limit else least
    if not count:
        return Eigenpairs(np.empty(0), np.empty((n, 0)))
    while True:
        count = min(count, bound)
        search.expected = search.solves + 3 * count + 30
        found = search.run(count, np.empty((n, 0)))
        if found.values[-1] > limit or count == bound:
            break
        grown = (limit / found.values[-1]) ** 1.5  # their number grows as the cube of the frequency
        count = int(min(max(2.0, grown) * count, float(bound)))
    keep = max(int((found.values <= limit).sum()), min(least, count))
    return Eigenpairs(found.values[:keep], turned(found.vectors[:, :keep]))


def _each(progress: Callable[[str, float], None] | None, done: int, total: int) -> None:
    if progress is not None:
        progress("condense", done / total)
