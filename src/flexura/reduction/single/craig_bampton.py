"""Craig-Bampton reduction of one substructure (Craig and Bampton 1968; the RPR paper, eqs. 1-7 and 28-29)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import SolverError
from flexura.linalg import DENSE_LIMIT, Eigenpairs, count_below, factorise, lowest, scaled, unit_scale
from flexura.records import Record

REPEATED = 1e-6
"""Squared frequencies closer than this, relative, are repeated ones."""


@dataclass(frozen=True, repr=False)
class ReducedPart(Record):
    """A substructure in Craig-Bampton coordinates: interface displacements, then amplitudes of kept normal modes.

    K, M: (b + k, b + k); T: (n, b + k) recovers all n displacements; `frequencies` (k,) of the kept fixed-interface
    normal modes, rad/s.
    """

    K: Array
    M: Array
    T: Array
    frequencies: Array


class CraigBampton:
    """Constraint modes and fixed-interface normal modes of K, M (n, n), SI, each worked out when first asked for.

    `stiffness_at_boundary` gives K (b, b) condensed to the boundary where that is known without the round-off of the
    assembled K, which rigid motions strain. Raises SolverError when part of the interior can move freely with the
    boundary held.
    """

    def __init__(
        self,
        K: Any,
        M: Any,
        interior: Index,
        boundary: Index,
        stiffness_at_boundary: Callable[[], Array] | None = None,
    ) -> None:
        self.K, self.M = (_workable(A) for A in (K, M))
        self.interior = interior
        self.boundary = boundary
        self._stiffness_at_boundary = stiffness_at_boundary
        if len(interior) and not (self.K.diagonal()[interior] > 0).all():
            raise SolverError("a node inside a substructure has no stiffness in some direction")
        rows = self.K[interior]
        self._K_ii, self._K_ib = rows[:, interior], rows[:, boundary]
        self._M_ii = self.M[interior][:, interior]
        self._found = Eigenpairs(np.empty(0), np.empty((len(interior), 0)))

    @property
    def stiffness(self) -> Any:
        """Stiffness (i, i) of the interior with the boundary held."""
        return self._K_ii

    @cached_property
    def _solve(self) -> Callable[[Array], Array]:
        if not isinstance(self._K_ii, np.ndarray):
            return factorise(self._K_ii).solve
        d = unit_scale(self._K_ii)
        try:
            factor = la.cho_factor(scaled(self._K_ii, d), check_finite=False)
        except la.LinAlgError:
            raise SolverError("the interior of a substructure can move freely with its interface held") from None
        return lambda x: d[:, None] * la.cho_solve(factor, d[:, None] * x, check_finite=False)

    def solve(self, forces: Array) -> Array:
        """Static displacements (i, k) of the interior under forces (i, k), boundary held."""
        return self._solve(forces)

    @cached_property
    def constraint_modes(self) -> Array:
        """Interior displacements (i, b) for unit displacements of each boundary DOF, eq. 6: -K_ii^-1 K_ib (theory
        eq. 39)."""
        if not len(self.interior):
            return np.zeros((0, len(self.boundary)))
        K_ib = self._K_ib
        return -self.solve(K_ib if isinstance(K_ib, np.ndarray) else K_ib.toarray())

    def count_below(self, hz: float) -> int:
        """Number of fixed-interface normal modes below a frequency, Hz."""
        return count_below(self._K_ii, self._M_ii, (2 * np.pi * hz) ** 2) if hz > 0 and len(self.interior) else 0

    def whole(self, count: int) -> int:
        """The least number of normal modes from `count` on that cuts no repeated frequency."""
        while 0 < count < len(self.interior):
            values = self.normal_modes(count + 1).values
            if len(values) <= count or values[count] - values[count - 1] > REPEATED * values[count]:
                break
            count += 1
        return count

    def normal_modes(self, count: int) -> Eigenpairs:
        """The lowest `count` normal modes of the interior with the boundary held, eq. 2 (theory eq. 40): angular
        frequencies squared (k,) and modes (i, k); those without mass are left out."""
        count = min(count, len(self.interior))
        if count > len(self._found.values):
            pairs = lowest(self._K_ii, self._M_ii, count)
            finite = np.isfinite(pairs.values)
            self._found = Eigenpairs(pairs.values[finite], pairs.vectors[:, finite])
        return Eigenpairs(self._found.values[:count], self._found.vectors[:, :count])

    @cached_property
    def _condensed(self) -> tuple[Array, Array, Array]:
        """K (b, b) condensed, M times the constraint modes (n, b) and their mass (b, b)."""
        n, b = self.K.shape[0], len(self.boundary)
        T = np.zeros((n, b))
        T[self.boundary, np.arange(b)] = 1.0
        T[self.interior] = self.constraint_modes
        own, MT = self._stiffness_at_boundary, self.M @ T
        K, M = T.T @ (self.K @ T) if own is None else own(), T.T @ MT
        return (K + K.T) / 2, MT, (M + M.T) / 2

    def reduced(self, count: int = 0) -> ReducedPart:
        """The reduction with the lowest `count` normal modes (theory eqs. 41-42)."""
        return self._assembled(self.normal_modes(count))

    def reduced_by(self, vectors: Array) -> ReducedPart:
        """The reduction with the Ritz vectors of interior displacements (i, k) in place of normal modes."""
        K, M = (vectors.T @ (A @ vectors) for A in (self._K_ii, self._M_ii))
        small = lowest((K + K.T) / 2, (M + M.T) / 2, len(K))
        finite = np.isfinite(small.values)
        return self._assembled(Eigenpairs(small.values[finite], vectors @ small.vectors[:, finite]))

    def _assembled(self, pairs: Eigenpairs) -> ReducedPart:
        b, k = len(self.boundary), len(pairs.values)
        T = np.zeros((self.K.shape[0], b + k))
        T[self.boundary, np.arange(b)] = 1.0
        T[self.interior, :b], T[self.interior, b:] = self.constraint_modes, pairs.vectors
        condensed, MT, mass = self._condensed
        K, M = np.zeros((b + k, b + k)), np.eye(b + k)
        K[:b, :b], M[:b, :b] = condensed, mass
        K[np.arange(b, b + k), np.arange(b, b + k)] = pairs.values
        M[b:, :b] = pairs.vectors.T @ MT[self.interior]
        M[:b, b:] = M[b:, :b].T
        return ReducedPart(K, M, T, np.sqrt(pairs.values))


def _workable(A: Any) -> Any:
    """A as a dense array when it is small, where sparse matrices cost more to index than to solve, else by columns."""
    if A.shape[0] > DENSE_LIMIT:
        return sp.csc_matrix(A)
    return A.toarray() if hasattr(A, "toarray") else np.asarray(A)
