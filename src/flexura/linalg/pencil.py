"""The eigenvalue problem K x = lambda M x with a stiffness that keeps the digits which its sum loses.

Symmetric matrices are scaled to a diagonal of ones, which takes out what units and unequal members put in.

An assembled stiffness is a sum of terms that cancel in soft motions. Where it comes as strains, K = F' F + rest, the
energy of a motion is a sum of squares: |F x|^2 is right to (eps |F| |x|)^2 where x strains nothing at all, and to its
own last digits elsewhere, however stiff some members are beside others (Demmel and Kahan 1990 for the principle). The
assembled K serves for factorisations only, and what these prove is widened by the bound of what K has lost.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.linalg import lapack

from flexura.arrays import Array
from flexura.errors import SolverError

EPS = float(np.finfo(float).eps)

ENTRY_ROUNDING = 16
"""Units of round-off in an entry of F, K or M as assembled, and in a product with as many terms as a row has."""

NEW_DIRECTION = 1e-6
"""A column of which less than this is not in the span of those before it adds nothing."""

MASS_LOST = (
    "the mass of a motion is lost in the round-off of the mass matrix: something is carried over a distance that is"
    " millions of times its own size"
)
"""What is said of a mass matrix that is not positive in the motions asked for."""

Extended = np.longdouble

EXTENDED_ROUNDING = 64 * float(np.finfo(Extended).eps)
"""Relative error of products in extended precision."""


def inverse_roots(sizes: ArrayLike) -> Array:
    """1/sqrt|size| for sizes (...), real or complex; one where a size is zero."""
    root = np.sqrt(np.abs(sizes))
    return 1 / np.where(root > 0, root, 1.0)


def unit_scale(A: Any) -> Array:
    """d (..., n) with which D A D has a diagonal of absolute ones, D = diag(d) (van der Sluis 1969).

    A: (..., n, n) dense, or (n, n) sparse. Where its diagonal is zero d is one.
    """
    return inverse_roots(np.einsum("...ii->...i", A) if isinstance(A, np.ndarray) else A.diagonal())


def scaled(A: Any, d: Array) -> Any:
    """D A D for A (..., n, n) dense, or (n, n) sparse by columns, and D = diag(d), d (..., n).

    It shares no array with A.
    """
    if isinstance(A, np.ndarray):
        return A * d[..., :, None] * d[..., None, :]
    data = A.data * d[A.indices] * np.repeat(d, np.diff(A.indptr))
    return sp.csc_matrix((data, A.indices.copy(), A.indptr.copy()), shape=A.shape)


def toarray(A: Any) -> Array:
    """A as a dense array."""
    return np.asarray(A.toarray()) if hasattr(A, "toarray") else np.asarray(A)


@dataclass(frozen=True)
class Eigenpairs:
    """Eigenvalues (k,), ascending, and M-orthonormal eigenvectors (n, k)."""

    values: Array
    vectors: Array

    @property
    def finite(self) -> Eigenpairs:
        """Those with finite eigenvalues: what moves has mass."""
        is_finite = np.isfinite(self.values)
        return Eigenpairs(self.values[is_finite], self.vectors[:, is_finite])

    def first(self, count: int) -> Eigenpairs:
        """The first of them, `count` at most."""
        return Eigenpairs(self.values[:count], self.vectors[:, :count])


@dataclass(frozen=True)
class Pencil:
    """K x = lambda M x, K and M (n, n) symmetric, M positive semidefinite.

    `strain` F (r, n) and `rest` (n, n) make up K = F' F + rest; without `strain`, K is `rest` as it is stored. `spread`
    (r, n), not negative, bounds in units of round-off how far an entry of F may be off: its own digits, and those of
    the positions that it follows from. Entries of `rest` are right to `rounding`, relative; those of matrices that are
    taken as they are stored are exact.
    """

    K: Any
    M: Any
    strain: sp.csr_matrix | None = None
    spread: sp.csr_matrix | None = None
    rest: Any = None
    rounding: float = 0.0
    unit: float = ENTRY_ROUNDING * EPS
    """Relative error of entries of F and M: round-off, and that of lengths which are differences of positions."""

    @staticmethod
    def of(K: Any, M: Any) -> Pencil:
        """The problem of two matrices as they are stored."""
        return Pencil(K, M, rest=K)

    @staticmethod
    def assembled(K: Any, M: Any, loose: float = 1.0) -> Pencil:
        """The problem of two matrices as they are summed, right to `loose` times round-off."""
        return Pencil(K, M, rest=K, rounding=loose * ENTRY_ROUNDING * EPS, unit=loose * ENTRY_ROUNDING * EPS)

    @staticmethod
    def from_strain(strain: sp.csr_matrix, spread: sp.csr_matrix, rest: Any, M: Any, loose: float = 1.0) -> Pencil:
        """The problem of K = F' F + rest; `rest` may be None. Lengths are right to `loose` units of round-off."""
        K = (strain.T.tocsr() @ strain).tocsc()
        if rest is not None:
            K = (K + rest).tocsc()
        K.sort_indices()
        return Pencil(K, M, strain, spread, rest, loose * ENTRY_ROUNDING * EPS, loose * ENTRY_ROUNDING * EPS)

    @property
    def order(self) -> int:
        """Number of coordinates."""
        return self.K.shape[0]

    def stiffness(self, X: Array) -> Array:
        """K X for X (n, k)."""
        forces = np.zeros(X.shape)
        if self.strain is not None:
            forces += self.strain.T @ (self.strain @ X)
        if self.rest is not None:
            forces += _product(self.rest, X)
        return forces

    def energies(self, X: Array) -> Array:
        """X' K X (k, k) for X (n, k)."""
        energies = np.zeros((X.shape[1], X.shape[1]))
        if self.strain is not None:
            e = self.strain @ X
            energies += e.T @ e
        if self.rest is not None:
            energies += X.T @ _product(self.rest, X)
        return (energies + energies.T) / 2

    def margin(self, X: Array) -> Array:
        """How far the diagonal of `energies` may be off (k,), twice the energy: from round-off in F, in positions and
        in sums (theory eq. C7)."""
        unit, margin = self.unit, np.zeros(X.shape[1])
        if self.strain is not None and self.spread is not None:
            e, a = np.abs(self.strain @ X), unit * (self.spread @ np.abs(X))
            margin += np.einsum("rk,rk->k", 2 * e + a, a) + 3 * unit * np.einsum("rk,rk->k", e, e)
        if self.rest is not None:
            size = np.einsum("ik,ik->k", np.abs(X), abs(self.rest) @ np.abs(X))
            margin += size * max(self.rounding, EXTENDED_ROUNDING)
        return margin

    def mass_margin(self, X: Array) -> Array:
        """How far x' M x may be off (k,) from round-off, for the columns of X (n, k): cancellation costs digits."""
        return self.unit * np.einsum("ik,ik->k", np.abs(X), abs(self.M) @ np.abs(X))

    def errors(self, X: Array) -> tuple[Array, Array]:
        """How far the entries of X' K X and X' M X (k, k) may be off: from round-off in F and M, in positions and in
        sums (theory eqs. C7, C9)."""
        unit, size = self.unit, np.abs(X)
        stiff = np.zeros((X.shape[1], X.shape[1]))
        if self.strain is not None and self.spread is not None:
            e, a = np.abs(self.strain @ X), unit * (self.spread @ size)
            across = e.T @ a
            stiff += across + across.T + a.T @ a + 3 * unit * (e.T @ e)
        if self.rest is not None:
            stiff += max(self.rounding, EXTENDED_ROUNDING) * (size.T @ (abs(self.rest) @ size))
            if not self.rounding:  # K x is right, x' (K x) a sum in double precision
                of_sum = unit * (size.T @ np.abs(_product(self.rest, X)))
                stiff += np.maximum(of_sum, of_sum.T)
        return stiff, unit * (size.T @ (abs(self.M) @ size))

    def ritz(self, X: Array) -> tuple[Array, Array]:
        """Rayleigh quotients (k,), ascending, and the M-orthonormal vectors (n, k) in the span of X that have them.

        Soft columns come first, so that they are not mixed with stiff ones; small quotients then keep their digits
        beside large ones, as squares of singular values of F X by one-sided Jacobi rotations (Drmac and Veselic 2008).
        Columns of X that add nothing are dropped. Raises SolverError where M has lost the digits of what they move.
        """
        X = _orthonormal(X, self.M)
        if self.rest is None and self.strain is not None:
            Z = _right_vectors(self.strain @ X)
        else:
            Z = la.eigh(self.energies(X))[1]
        X = X @ Z
        mass = np.einsum("ik,ik->k", X, self.M @ X)
        if not (mass > 0).all():
            raise SolverError(MASS_LOST)
        X = X / np.sqrt(mass)
        values = self.quotients(X)
        order = np.argsort(values, kind="stable")
        return values[order], X[:, order]

    def quotients(self, X: Array) -> Array:
        """Rayleigh quotients (k,) of the columns of X (n, k)."""
        energies = np.zeros(X.shape[1])
        if self.strain is not None:
            e = self.strain @ X
            energies += np.einsum("rk,rk->k", e, e)
        if self.rest is not None:
            energies += np.einsum("ik,ik->k", X, _product(self.rest, X))
        return energies / np.einsum("ik,ik->k", X, self.M @ X)

    @cached_property
    def scale(self) -> Array:
        """d (n,) that makes the diagonal of D K D one; where K has none, that of D M D."""
        stiff, mass = self.K.diagonal(), self.M.diagonal()
        return inverse_roots(np.where(stiff > 0, stiff, mass))

    def uncertainty(self, d: Array, value: float) -> Array:
        """Row sums (n,) of a bound on how far D (K - value M) D may be off as stored, D = diag(d).

        The matrix plus and minus the diagonal of these bounds the true one from above and below.
        """
        unit = self.unit if self.rounding else EPS
        rows = unit * abs(value) * (abs(self.M) @ d)
        if self.strain is not None and self.spread is not None:
            size = abs(self.strain)
            of_strain, of_spread = size @ d, self.spread @ d
            rows = rows + unit * (size.T @ (of_spread + of_strain) + self.spread.T @ (of_strain + unit * of_spread))
        if self.rest is not None:
            rows = rows + max(self.rounding, EPS) * (abs(self.rest) @ d)
        return d * rows


def _orthonormal(X: Array, M: Any) -> Array:
    """X (n, k) M-orthonormal, each column mixed with those before it only; what adds nothing is dropped."""
    if not X.shape[1]:
        return X
    gram = X.T @ (M @ X)
    d = unit_scale(gram)
    gram = scaled((gram + gram.T) / 2, d)
    try:
        R = la.cholesky(gram)
        if np.diagonal(R).min() > NEW_DIRECTION:
            return la.solve_triangular(R, (X * d).T, trans="T").T
    except la.LinAlgError:
        pass
    size, V = la.eigh(gram)
    kept = size > NEW_DIRECTION**2 * size[-1]
    return X @ (d[:, None] * V[:, kept] / np.sqrt(size[kept]))


def _right_vectors(E: Array) -> Array:
    """Right singular vectors (k, k) of E (r, k), those of the smallest singular values first, each right to its own
    digits (Drmac and Veselic 2008)."""
    k = E.shape[1]
    R = np.triu(la.qr(np.vstack([E, np.zeros((max(k - len(E), 0), k))]), mode="r")[0][:k])
    _, _, V, _, _, failed = lapack.dgejsv(R, joba=0, jobu=3, jobv=0, jobr=0, jobt=0, jobp=0)
    return la.svd(R)[2][::-1].T if failed else V[:, ::-1]


def _product(A: Any, X: Array) -> Array:
    """A X, which cancels, in extended precision and rounded to double; A symmetric."""
    wide: Any = A.astype(Extended)
    if sp.issparse(A):
        wide = wide.tocsc().T  # by rows, which are the columns
    return np.asarray(wide @ X.astype(Extended), dtype=np.float64)
