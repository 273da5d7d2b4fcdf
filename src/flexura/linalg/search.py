"""The search for eigenpairs of K x = lambda M x next to a shift, by shift-invert Lanczos or dense algebra.

Lanczos (Ericsson and Ruhe 1980) may lose copies of a repeated eigenvalue: what an inertia count finds missing is looked
for again in the complement of what is known, until the count is met.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.linalg.factor import DENSE_LIMIT, Factor, Matrix, SuperLU
from flexura.linalg.inertia import bracket, count_below, stable_count
from flexura.linalg.pencil import Pencil
from flexura.linalg.scaling import scaled, unit_scale

Progress = Callable[[str, float], None]
"""Called with what is being done and the fraction of it that is done; what it raises ends the work."""

RESTARTS = 500
"""Restarts of a Lanczos search after which it is given up."""

IDLE = 4
"""Rounds of looking for missing copies of repeated eigenvalues that may pass without finding any."""

OFFSETS = (1e-6, 1e-5, 1e-4)
"""Relative distances below the last eigenvalue at which those up to it are counted, the first that can be."""


@dataclass(frozen=True)
class Eigenpairs:
    """Eigenvalues (k,), ascending, and M-orthonormal eigenvectors (n, k)."""

    values: Array
    vectors: Array


class ShiftInvert:
    """Lanczos on (K - shift M)^-1 M, K and M (n, n) sparse and symmetric; `solve` gives (K - shift M)^-1 b, b (n,).

    `solves` is how often that was used, out of about `expected`, of which `progress` is told.
    """

    def __init__(
        self, K: Any, M: Any, shift: float, solve: Callable[[Array], Array], progress: Progress | None = None
    ) -> None:
        self.K = K
        self.M = M
        self.shift = shift
        self.solve = solve
        self.progress = progress
        self.solves: int = 0
        self.expected: int = 100

    def nearest(self, count: int, known: Array | None = None) -> Eigenpairs:
        """The `count` pairs next to the shift in the M-orthogonal complement of `known` (n, j), fewer than n.

        Raises SolverError when the search does not converge.
        """
        n = self.K.shape[0]
        known = np.empty((n, 0)) if known is None else known
        j = known.shape[1]
        Mk = self.M @ known
        count = min(count, n - 1)

        def invert(b: Array) -> Array:
            checkpoint()
            self.solves += 1
            if self.progress is not None:
                self.progress("iterate", min(0.99, self.solves / self.expected))
            y = self.solve(b)
            return y - known @ (Mk.T @ y) if j else y

        start = np.cos(np.arange(n) * (1.0 + j))
        start -= known @ (Mk.T @ start)
        operator = spla.LinearOperator((n, n), matvec=invert, dtype=float)
        basis = min(n - 1, max(2 * count + 12, 20))
        try:
            values, vectors = spla.eigsh(
                self.K, count, M=self.M, sigma=self.shift, OPinv=operator, v0=start, ncv=basis, maxiter=RESTARTS, tol=0
            )
        except spla.ArpackNoConvergence as error:  # the last of many copies: sought beside those that are found
            values, vectors = np.real(error.eigenvalues), np.real(error.eigenvectors)
            if not len(values):
                raise SolverError(f"the eigenvalue search did not converge: {error}") from None
            rest = self.nearest(count - len(values), np.hstack([known, orthonormal(vectors, self.M)]))
            values, vectors = np.append(values, rest.values), np.hstack([vectors, rest.vectors])
        except spla.ArpackError as error:
            raise SolverError(f"the eigenvalue search did not converge: {error}") from None
        order = np.argsort(values)
        return Eigenpairs(values[order], orthonormal(vectors[:, order], self.M))

    def completed(
        self,
        found: Eigenpairs,
        count: int,
        counted: Callable[[float], int | None] | None = None,
        offsets: Sequence[float] = OFFSETS,
    ) -> Eigenpairs:
        """The pairs with the copies of repeated eigenvalues that were missed below the `count`-th.

        `counted` gives the number of eigenvalues below a value, None where it cannot tell; by default factors of
        SuperLU are asked. Copies of the `count`-th itself do not matter. Where what is counted is not found, digits of
        the stiffness are lost and the next of the offsets serves. Raises SolverError when none does.
        """
        fewest, idle = self.K.shape[0] + 1, 0
        while True:
            missing = self._missing(found.values, float(found.values[:count].max()), counted, offsets)
            if missing <= 0:
                return found
            fewest, idle = (missing, 0) if missing < fewest else (fewest, idle + 1)
            if idle == IDLE and len(offsets) == 1:
                raise SolverError("eigenvalues that are counted are not found: the stiffness has lost its digits")
            if idle == IDLE:
                fewest, idle, offsets = self.K.shape[0] + 1, 0, offsets[1:]
                continue
            more = self.nearest(missing, found.vectors)
            values = np.concatenate([found.values, more.values])
            order = np.argsort(values, kind="stable")
            found = Eigenpairs(values[order], np.hstack([found.vectors, more.vectors])[:, order])

    def _missing(
        self, values: Array, last: float, counted: Callable[[float], int | None] | None, offsets: Sequence[float]
    ) -> int:
        """How many eigenvalues below `last` are not among `values`, counted a little below it, further off where a
        factorisation so close to eigenvalues is unstable."""
        K, M = self.K, self.M
        if self.progress is not None:
            self.progress("count", 0.0)
        below = [last - offset * abs(last) - 1e-3 * abs(self.shift) for offset in offsets]
        for value in below:
            count = stable_count((K - value * M).tocsc()) if counted is None else counted(value)
            if count is not None:
                return count - int((values < value).sum())
        proven = bracket(Pencil.of(K, M), below[-1])
        if proven.is_proven:
            return proven.least - int((values < proven.value).sum())
        return count_below(K, M, below[0]) - int((values < below[0]).sum())


def next_to(
    K: Matrix, M: Matrix, count: int, shift: float, factor: Factor | None = None, shapes: bool = True
) -> Eigenpairs:
    """The `count` pairs of K and M (n, n) next to a shift below all of them, none of them missing.

    `factor` of K - shift M where there is one already. Without `shapes` small problems are solved for values alone,
    and have no vectors. Raises SolverError when K - shift M is singular or the search
    does not converge.
    """
    n = K.shape[0]
    if n <= DENSE_LIMIT or count > n // 3:
        return _dense(toarray(K), toarray(M), count, shift, shapes)
    K, M = sp.csc_matrix(K), sp.csc_matrix(M)
    factor = factor or SuperLU(K - shift * M if shift else K)
    d = factor.scale
    # what is counted is the matrix that was factorised, rounded as it was by its scaling
    search = ShiftInvert(scaled(K, d), scaled(M, d), shift, factor.solve_scaled)
    found = search.completed(search.nearest(count), count)
    return Eigenpairs(found.values[:count], d[:, None] * found.vectors[:, :count])


def _dense(K: Array, M: Array, count: int, shift: float, shapes: bool = True) -> Eigenpairs:
    """eigh(M, K') after diagonal scaling, K' = K - shift M positive definite: for widely spread spectra the low end
    comes out far more accurately than from eigh(K, M) (Parlett 1980, sec. 15.2; theory eq. 54)."""
    S = K - shift * M if shift else K
    n = len(S)
    d = unit_scale(S)
    Md, Sd = scaled(M, d), scaled(S, d)
    try:
        if not shapes:
            mu = np.asarray(la.eigh(Md, Sd, eigvals_only=True), dtype=float)[n - count :]
            return Eigenpairs(_inverted(mu[::-1]) + shift, np.empty((n, 0)))
        try:
            mu, y = la.eigh(Md, Sd, subset_by_index=[n - count, n - 1])
        except la.LinAlgError:  # LAPACK's inverse iteration may fail on clusters, divide and conquer does not
            mu, y = (part[..., n - count :] for part in la.eigh(Md, Sd, driver="gvd"))
    except la.LinAlgError:
        raise SolverError("the stiffness matrix is not positive definite: something can move freely") from None
    mu, y = mu[::-1], y[:, ::-1]
    vectors = d[:, None] * y / np.sqrt(np.where(mu > 0, mu, 1.0))
    return Eigenpairs(_inverted(mu) + shift, vectors)


def _inverted(mu: Array) -> Array:
    """One over values, infinite where they are not positive."""
    return np.where(mu > 0, 1 / np.where(mu > 0, mu, 1.0), np.inf)


def toarray(A: Matrix) -> Array:
    """A as a dense array."""
    return np.asarray(A.toarray()) if hasattr(A, "toarray") else np.asarray(A)


def orthonormal(vectors: Array, M: Any) -> Array:
    """Vectors (n, k) made M-orthonormal in order (Cholesky of the Gram matrix)."""
    gram = vectors.T @ (M @ vectors)
    return la.solve_triangular(la.cholesky(gram, lower=True), vectors.T, lower=True).T
