"""Lowest eigenpairs of K x = lambda M x, accurate and complete, of things that are held and of things that float.

Lanczos next to a shift (Ericsson and Ruhe 1980) may lose copies of a repeated eigenvalue: what an inertia count finds
missing is looked for again in the complement of what is known, until the count is met. What floats has a singular K:
it is shifted by a negative value next to its lowest elastic eigenvalue, which a first search finds. Eigenvalues of a
`Pencil` are Rayleigh quotients of energies. Orders and signs do not hang on round-off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import ArrayLike

from flexura.arrays import Array, Index
from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.linalg.bounds import bracket, count_below, solution, stable_count
from flexura.linalg.factor import (
    DENSE_LIMIT,
    LDL,
    SINGULAR_PIVOT,
    Elimination,
    Factor,
    Matrix,
    Progress,
    eliminated,
    pivoted,
)
from flexura.linalg.krylov import lowest_by_blocks
from flexura.linalg.pencil import Eigenpairs, Pencil, scaled, toarray, unit_scale
from flexura.thresholds import EQUAL_BY_SYMMETRY

LANCZOS_RESTARTS = 500
"""Restarts of a Lanczos search after which it is given up."""

IDLE_ROUNDS = 4
"""Rounds of looking for missing copies of repeated eigenvalues that may pass without finding any."""

SPARE = 3
"""Vectors in a block beyond the pairs that are looked for."""

COUNT_OFFSETS = (1e-6, 1e-5, 1e-4)
"""Relative distances below the last eigenvalue at which those up to it are counted, the first that can be."""

COARSE_SHIFT = 1e-9
"""First shift of something that floats, over the largest ratio of stiffness to mass."""

SHIFT_ROUNDING = 2e-5
"""Part of that shift below which values of matrices whose history is not known are round-off."""

OUTSIDE_SPAN = 1e-8
"""Squared part of a vector beside rigid motions below which it is one of them."""

ABOVE_ROUNDING = 10.0
"""An eigenvalue so many times above its own round-off shows where the elastic ones begin."""

SHIFT_ROUNDS = 8
"""Attempts to find a shift next to the lowest elastic eigenvalue."""


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
                self.K,
                count,
                M=self.M,
                sigma=self.shift,
                OPinv=operator,
                v0=start,
                ncv=basis,
                maxiter=LANCZOS_RESTARTS,
                tol=0,
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
        pairs: Eigenpairs,
        count: int,
        counted: Callable[[float], int | None] | None = None,
        offsets: Sequence[float] = COUNT_OFFSETS,
    ) -> Eigenpairs:
        """The pairs with the copies of repeated eigenvalues that were missed below the `count`-th.

        `counted` gives the number of eigenvalues below a value, None where it cannot tell; by default factors
        are asked. Copies of the `count`-th itself do not matter. Where what is counted is not found, digits of
        the stiffness are lost and the next of the offsets serves. Raises SolverError when none does.
        """
        fewest, idle = self.K.shape[0] + 1, 0
        while True:
            missing = self._missing(pairs.values, float(pairs.values[:count].max()), counted, offsets)
            if missing <= 0:
                return pairs
            fewest, idle = (missing, 0) if missing < fewest else (fewest, idle + 1)
            if idle == IDLE_ROUNDS and len(offsets) == 1:
                raise SolverError("eigenvalues that are counted are not found: the stiffness has lost its digits")
            if idle == IDLE_ROUNDS:
                fewest, idle, offsets = self.K.shape[0] + 1, 0, offsets[1:]
                continue
            more = self.nearest(missing, pairs.vectors)
            values = np.concatenate([pairs.values, more.values])
            order = np.argsort(values, kind="stable")
            pairs = Eigenpairs(values[order], np.hstack([pairs.vectors, more.vectors])[:, order])

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
    K: Matrix, M: Matrix, count: int, shift: float, factor: Factor | None = None, *, shapes: bool = True
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
    factor = factor or eliminated(K - shift * M if shift else K)
    d = factor.scale
    # what is counted is the matrix that was factorised, rounded as it was by its scaling
    search = ShiftInvert(scaled(K, d), scaled(M, d), shift, factor.solve_scaled)
    search.M.eliminate_zeros()
    found = lowest_by_blocks(search.solve, search.M, count, SPARE, 0.0) if isinstance(factor, LDL) else None
    pairs = search.nearest(count) if found is None else Eigenpairs(found[1][: found[0]] + shift, found[2])
    pairs = search.completed(pairs, count)
    return Eigenpairs(pairs.values[:count], d[:, None] * pairs.vectors[:, :count])


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


def orthonormal(vectors: Array, M: Any) -> Array:
    """Vectors (n, k) made M-orthonormal in order (Cholesky of the Gram matrix)."""
    gram = vectors.T @ (M @ vectors)
    return la.solve_triangular(la.cholesky(gram, lower=True), vectors.T, lower=True).T


def lowest(K: Matrix, M: Matrix, count: int) -> Eigenpairs:
    """The `count` lowest eigenpairs of symmetric positive semidefinite K and M, both (n, n); K + M positive definite.

    As `lowest_modes` for matrices as they are stored. Raises SolverError when the search does not converge or K + M is
    singular.
    """
    n = K.shape[0]
    count = min(count, n)
    if count <= 0:
        return Eigenpairs(np.empty(0), np.empty((n, 0)))
    pivot, factors = pivoted(K)
    if pivot > SINGULAR_PIVOT:
        return next_to(K, M, count, 0.0, factors)
    # matrices of unknown history: what is small beside their largest ratio may be round-off
    coarse = coarse_shift(K, M)
    values = next_to(K, M, min(n, max(count, 6) + 1), -coarse).values
    elastic = values[(values > SHIFT_ROUNDING * coarse) & np.isfinite(values)]
    first = min(float(elastic[0]), coarse / COARSE_SHIFT) if len(elastic) else 1e5 * coarse
    pairs = next_to(K, M, count, -first)
    zero = abs(pairs.values) < max(1e-7 * first, SHIFT_ROUNDING * coarse)
    return Eigenpairs(np.where(zero, 0.0, pairs.values), pairs.vectors)


def lowest_modes(pencil: Pencil, count: int, rigid: Array | None = None) -> Eigenpairs:
    """The `count` lowest eigenpairs of a pencil, K and M positive semidefinite and K + M positive definite, finite ones
    only.

    Eigenvalues are Rayleigh quotients of energies (`Pencil.ritz`) and come out as exactly zero where these are not
    above their own round-off. When K is singular a negative shift next to the lowest elastic eigenvalue is used;
    `rigid` (n, r) are motions that may strain nothing. Raises SolverError when the search does not converge or K + M is
    singular.
    """
    count = min(count, pencil.order)
    if count <= 0:
        return Eigenpairs(np.empty(0), np.empty((pencil.order, 0)))
    pivot, factors = pivoted(pencil.K)
    if pivot <= SINGULAR_PIVOT:
        return _floating(pencil, count, rigid)
    shapes = next_to(pencil.K, pencil.M, count, 0.0, factors).finite.vectors
    pairs = ritz_pairs(pencil, _polished(pencil, shapes, 0.0, factors), rigid)
    # fewer: there are no more with mass, or the first is so soft that the others are lost beside it
    return pairs if len(pairs.values) == count else _floating(pencil, count, rigid)


def coarse_shift(K: Matrix, M: Matrix) -> float:
    """A first shift, without its sign, of K and M (n, n) that float."""
    stiff, mass = K.diagonal(), M.diagonal()
    return COARSE_SHIFT * float(np.max(stiff[mass > 0] / mass[mass > 0], initial=1.0))


def _polished(pencil: Pencil, X: Array, shift: float, factors: Elimination | None = None) -> Array:
    """X (n, k) after one inverse iteration with the true stiffness: that which is factorised only preconditions it."""
    if pencil.strain is None or not X.shape[1]:
        return X
    Y = solution(pencil, pencil.M @ X, shift, factors)
    return Y / np.linalg.norm(Y, axis=0)


def _floating(pencil: Pencil, count: int, rigid: Array | None) -> Eigenpairs:
    """The lowest pairs of a singular or very soft problem: the shift is moved until it stands next to the lowest
    eigenvalue that is not zero."""
    shift = coarse_shift(pencil.K, pencil.M)
    wanted = min(pencil.order, max(count, 6) + 1)
    seen: set[float] = set()
    pairs = None
    for _ in range(SHIFT_ROUNDS):
        try:
            nearest = next_to(pencil.K, pencil.M, wanted, -shift)
        except SolverError:
            if pairs is None:
                raise
            break  # so far down round-off in K is in the way
        fresh = ritz_pairs(pencil, _polished(pencil, nearest.finite.vectors, -shift), rigid)
        pairs = fresh if pairs is None else _together(pencil, fresh, pairs, wanted)
        elastic = pairs.values[pairs.values > ABOVE_ROUNDING * pencil.margin(pairs.vectors)]
        near = float(elastic[0]) if len(elastic) else 1e5 * shift  # else all that is elastic lies far above
        if shift / 3 <= near <= 3 * shift or round(np.log10(near)) in seen:
            break
        seen.add(round(np.log10(near)))
        shift = near
    assert pairs is not None
    return pairs.first(count)


def _together(pencil: Pencil, pairs: Eigenpairs, others: Eigenpairs, count: int) -> Eigenpairs:
    """The `count` lowest Ritz pairs in the span of some pairs and of what `others` add to it: a shift next to a very
    soft motion loses those far above it, which another has found."""
    Y = others.vectors
    for _ in range(2):
        Y = Y - pairs.vectors @ (pairs.vectors.T @ (pencil.M @ Y))
    Y = Y[:, np.einsum("ik,ik->k", Y, pencil.M @ Y) > OUTSIDE_SPAN]
    if len(pairs.values) >= count or not Y.shape[1]:
        return pairs
    return _zeroed(pencil, Eigenpairs(*pencil.ritz(np.hstack([pairs.vectors, Y])))).first(count)


def ritz_pairs(pencil: Pencil, X: Array, rigid: Array | None = None) -> Eigenpairs:
    """The lowest Ritz pairs in the span of X (n, k), and of those `rigid` motions (n, r) that strain nothing, as many
    as X has columns; values not above their own round-off are zero.

    Rigid motions that strain nothing stand as they are and are taken out of X, so that nothing is mixed with them.
    """
    k = X.shape[1]
    if rigid is None or not rigid.shape[1]:
        return _zeroed(pencil, Eigenpairs(*pencil.ritz(X)))
    size = np.sqrt(np.einsum("ik,ik->k", rigid, pencil.M @ rigid))
    R = _zeroed(pencil, Eigenpairs(*pencil.ritz(rigid[:, size > 0] / size[size > 0])))
    free = R.vectors[:, R.values == 0]
    X = X / np.sqrt(np.einsum("ik,ik->k", X, pencil.M @ X))
    for _ in range(2):
        X = X - free @ (free.T @ (pencil.M @ X))
    X = X[:, np.einsum("ik,ik->k", X, pencil.M @ X) > OUTSIDE_SPAN]
    pairs = _zeroed(pencil, Eigenpairs(*pencil.ritz(X))) if X.shape[1] else Eigenpairs(np.empty(0), X)
    values, vectors = np.concatenate([np.zeros(free.shape[1]), pairs.values]), np.hstack([free, pairs.vectors])
    order = np.argsort(values, kind="stable")[:k]
    return Eigenpairs(values[order], vectors[:, order])


def _zeroed(pencil: Pencil, pairs: Eigenpairs) -> Eigenpairs:
    """M-orthonormal pairs with the values that are not above their own round-off set to zero."""
    return Eigenpairs(np.where(pairs.values <= pencil.margin(pairs.vectors), 0.0, pairs.values), pairs.vectors)


def ranked(sizes: ArrayLike) -> Index:
    """Positions (n,) of sizes (n,) from the largest to the smallest; equal ones stay in their order."""
    size = np.asarray(sizes, dtype=float)
    order = np.argsort(-size, kind="stable").astype(np.intp)
    falling = size[order]
    first = 0
    for k in range(1, len(order) + 1):
        if k == len(order) or falling[k] < _least(falling[first]):
            order[first:k].sort()
            first = k
    return order


def leading(sizes: ArrayLike, axis: int = -1) -> Any:
    """Position of the largest of sizes along an axis, the first of equal ones."""
    size = np.asarray(sizes, dtype=float)
    return (size >= _least(size.max(axis=axis, keepdims=True))).argmax(axis=axis)


def turned(vectors: Any) -> Any:
    """Vectors (n,) or (n, k), real or complex, with the real part of their largest entry positive."""
    at = np.expand_dims(leading(np.abs(vectors), axis=0), 0)
    return np.where(np.real(np.take_along_axis(vectors, at, axis=0)) < 0, -vectors, vectors)


def _least(largest: Any) -> Any:
    """The least size that equals the largest."""
    return largest * (1 - np.copysign(EQUAL_BY_SYMMETRY, largest))
