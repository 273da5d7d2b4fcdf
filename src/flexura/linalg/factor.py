"""Factors of symmetric matrices behind one interface, whichever library makes them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg.pencil import EPS
from flexura.linalg.scaling import scaled, unit_scale

Matrix = Any
"""A dense array or a SciPy sparse matrix."""

ROUND_OFF = 8
"""Units of round-off of a factor's entry per unit of the product of their absolute values."""

SINGULAR_PIVOT = 1e-13
"""A pivot of the diagonally scaled stiffness below this counts as zero."""

DENSE_LIMIT = 240
"""Up to this order dense routines are as fast as sparse ones."""

MOVES = "the stiffness matrix is singular: something can move freely"


class SingularError(SolverError):
    """A matrix that is singular, or not definite where its factors need that."""


class Factor(ABC):
    """Factors of D A D for a symmetric A (n, n), D = diag(scale), scale (n,).

    `name` is that of the library, `memory` the bytes that the factors take. `negative` is the number of negative
    eigenvalues by Sylvester's law of inertia, None where the library has not counted them on pivots that are sure.
    """

    name: ClassVar[str]
    scale: Array

    def solve(self, b: Array) -> Array:
        """A^-1 b for b (n,) or (n, k)."""
        b = np.asarray(b, dtype=float)
        d = self.scale if b.ndim == 1 else self.scale[:, None]
        return d * self.solve_scaled(d * b)

    @property
    @abstractmethod
    def memory(self) -> float: ...

    @property
    @abstractmethod
    def negative(self) -> int | None: ...

    @abstractmethod
    def solve_scaled(self, b: Array) -> Array:
        """(D A D)^-1 b."""


class SuperLU(Factor):
    """Factors by SuperLU with a fill-reducing ordering, diagonal pivots preferred (Demmel et al. 1999).

    `scale` is by default that of `unit_scale`. A stays as it is. Raises SingularError.
    """

    name = "superlu"

    def __init__(self, A: Matrix, scale: Array | None = None) -> None:
        A = sp.csc_matrix(A)
        self.scale: Array = unit_scale(A) if scale is None else scale
        own = scaled(A, self.scale)
        own.sort_indices()  # SuperLU would do so in what it is given
        try:
            self._lu = spla.splu(
                own, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError:
            raise SingularError(MOVES) from None

    def solve_scaled(self, b: Array) -> Array:
        """(D A D)^-1 b."""
        return self._lu.solve(np.ascontiguousarray(b))

    @property
    def memory(self) -> float:
        """Bytes that the factors take."""
        return 12.0 * self._lu.nnz

    @property
    def least_pivot(self) -> float:
        """The least pivot, of either sign."""
        return float(self._lu.U.diagonal().min())

    @property
    def negative(self) -> int | None:
        """Number of negative pivots where all are diagonal ones, else None."""
        return None if self.lost is None else int((self._lu.U.diagonal() < 0).sum())

    @cached_property
    def lost(self) -> Array | None:
        """Row sums (n,) of a bound on the round-off in the product of the factors (Higham 2002, theorem 9.3), None
        where pivots are not diagonal ones or not finite."""
        if not np.array_equal(self._lu.perm_r, self._lu.perm_c):
            return None
        size = abs(self._lu.L) @ (abs(self._lu.U) @ np.ones(len(self.scale)))
        return ROUND_OFF * EPS * size[self._lu.perm_r] if np.isfinite(size).all() else None


class Dense(Factor):
    """Factors of a full matrix by LAPACK's LU with partial pivoting. `scale` is that of `unit_scale`. Raises
    SingularError."""

    name = "lapack"

    def __init__(self, A: Array) -> None:
        self.scale: Array = unit_scale(A)
        self._lu, self._pivots, singular = la.lapack.dgetrf(scaled(A, self.scale))
        if singular:
            raise SingularError(MOVES)

    def solve_scaled(self, b: Array) -> Array:
        """(D A D)^-1 b."""
        return np.asarray(la.lapack.dgetrs(self._lu, self._pivots, b)[0])

    @property
    def memory(self) -> float:
        """Bytes that the factors take."""
        return float(self._lu.nbytes)

    @property
    def negative(self) -> None:
        """Not counted."""


def factorise(A: Matrix) -> Factor:
    """Factors of a symmetric A (n, n), full or sparse. Raises SingularError, a SolverError, where it is singular."""
    return Dense(A) if isinstance(A, np.ndarray) else SuperLU(A)


def pivoted(K: Matrix) -> tuple[float, SuperLU | None]:
    """The least pivot, as `least_pivot`, and the factors where they are sparse."""
    if not (K.diagonal() > 0).all():
        return 0.0, None
    if K.shape[0] <= DENSE_LIMIT:
        dense = K if isinstance(K, np.ndarray) else np.asarray(K.toarray())
        try:
            pivots = np.diagonal(np.linalg.cholesky(scaled(dense, unit_scale(dense)))) ** 2
        except np.linalg.LinAlgError:
            return 0.0, None
        return float(pivots.min(initial=np.inf)), None
    try:
        factor = SuperLU(K)
    except SingularError:
        return 0.0, None
    return factor.least_pivot, factor


def is_definite(K: Matrix) -> bool:
    """True when symmetric positive semidefinite K (n, n) is definite to working accuracy, judged by its pivots."""
    return least_pivot(K) > SINGULAR_PIVOT


def least_pivot(K: Matrix) -> float:
    """The least pivot of a symmetric positive semidefinite K (n, n), its diagonal scaled to one; zero where it is
    singular. Solutions with K lose about as many digits as it has leading zeros."""
    return pivoted(K)[0]
