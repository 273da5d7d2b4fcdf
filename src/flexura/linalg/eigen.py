"""Lowest eigenpairs of K x = lambda M x, accurate and complete.

Dense: eigh(M, K') after diagonal scaling, where K' = K - s M is positive definite: for widely spread spectra the low
end comes out far more accurately than from eigh(K, M) (Parlett 1980, sec. 15.2; theory eq. 54). Sparse: shift-invert
Lanczos (Ericsson and Ruhe 1980), checked by an inertia count, and repeated with deflation until no repeated eigenvalue
is missing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.linalg.inertia import bracket, count_below, scaled, stable_count, superlu
from flexura.linalg.pencil import Pencil

Array = NDArray[np.float64]
Matrix = Any
"""A dense array or a SciPy sparse matrix."""

SINGULAR_PIVOT = 1e-13
"""A pivot of the diagonally scaled stiffness below this counts as zero."""

COARSE = 1e-9
"""First shift of something that floats, over the largest ratio of stiffness to mass."""

IDLE = 4
"""Rounds of looking for missing copies of repeated eigenvalues that may pass without finding any."""

DENSE_LIMIT = 240
"""Up to this order dense routines are as fast as sparse ones."""


@dataclass(frozen=True)
class Eigenpairs:
    """Eigenvalues (k,), ascending, and M-orthonormal eigenvectors (n, k)."""

    values: Array
    vectors: Array


def lowest(K: Matrix, M: Matrix, count: int) -> Eigenpairs:
    """The `count` lowest eigenpairs of symmetric positive semidefinite K and M, both (n, n); K + M positive definite.

    As `lowest_modes` for matrices as they are stored. Raises SolverError when the search does not converge or K + M is
    singular.
    """
    n = K.shape[0]
    count = min(count, n)
    if count <= 0:
        return Eigenpairs(np.empty(0), np.empty((n, 0)))
    definite, factors = _definite(K)
    if definite:
        return _lowest(K, M, count, 0.0, factors)
    # matrices of unknown history: what is small beside their largest ratio may be round-off
    stiffness, mass = K.diagonal(), M.diagonal()
    coarse = COARSE * float(np.max(stiffness[mass > 0] / mass[mass > 0], initial=1.0))
    values = _lowest(K, M, min(n, max(count, 6) + 1), -coarse).values
    elastic = values[(values > UNKNOWN * coarse) & np.isfinite(values)]
    first = min(float(elastic[0]), coarse / COARSE) if len(elastic) else 1e5 * coarse
    pairs = _lowest(K, M, count, -first)
    zero = abs(pairs.values) < max(1e-7 * first, UNKNOWN * coarse)
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
    definite, factors = _definite(pencil.K)
    if not definite:
        return _floating(pencil, count, rigid)
    found = _finite(_lowest(pencil.K, pencil.M, count, 0.0, factors)).vectors
    pairs = ritz_pairs(pencil, _polished(pencil, found, 0.0, factors), rigid)
    # fewer: there are no more with mass, or the first is so soft that the others are lost beside it
    return pairs if len(pairs.values) == count else _floating(pencil, count, rigid)


POLISH = 2
"""Corrections of a solution by its residual in energies."""

UNSETTLED = 1e-6
"""Change of the root of the work of loads, relative, in the last correction of their response."""

UNKNOWN = 2e-5
"""Part of that shift below which values of matrices whose history is not known are round-off."""

DEPENDENT = 1e-8
"""Squared part of a vector beside rigid motions below which it is one of them."""

CLEAR = 10.0
"""An eigenvalue so many times above its own round-off shows where the elastic ones begin."""

RESTARTS = 500
"""Restarts of a Lanczos search after which it is given up."""

ROUNDS = 8
"""Attempts to find a shift next to the lowest elastic eigenvalue."""


def _polished(pencil: Pencil, X: Array, shift: float, factors: _Factors | None = None) -> Array:
    """X (n, k) after one inverse iteration with the true stiffness: that which is factorised only preconditions it."""
    if pencil.strain is None or not X.shape[1]:
        return X
    Y = _solution(pencil, pencil.M @ X, shift, factors)
    return Y / np.linalg.norm(Y, axis=0)


def _finite(pairs: Eigenpairs) -> Eigenpairs:
    finite = np.isfinite(pairs.values)
    return Eigenpairs(pairs.values[finite], pairs.vectors[:, finite])


def _floating(pencil: Pencil, count: int, rigid: Array | None) -> Eigenpairs:
    """The lowest pairs of a singular or very soft problem: the shift is moved until it stands next to the lowest
    eigenvalue that is not zero."""
    stiff, mass = pencil.K.diagonal(), pencil.M.diagonal()
    shift = COARSE * float(np.max(stiff[mass > 0] / mass[mass > 0], initial=1.0))
    wanted = min(pencil.order, max(count, 6) + 1)
    seen: set[float] = set()
    pairs = None
    for _ in range(ROUNDS):
        try:
            found = _lowest(pencil.K, pencil.M, wanted, -shift)
        except SolverError:
            if pairs is None:
                raise
            break  # so far down round-off in K is in the way
        fresh = ritz_pairs(pencil, _polished(pencil, _finite(found).vectors, -shift), rigid)
        pairs = fresh if pairs is None else _together(pencil, fresh, pairs, wanted)
        elastic = pairs.values[pairs.values > CLEAR * pencil.margin(pairs.vectors)]
        near = float(elastic[0]) if len(elastic) else 1e5 * shift  # else all that is elastic lies far above
        if shift / 3 <= near <= 3 * shift or round(np.log10(near)) in seen:
            break
        seen.add(round(np.log10(near)))
        shift = near
    assert pairs is not None
    return Eigenpairs(pairs.values[:count], pairs.vectors[:, :count])


def _together(pencil: Pencil, pairs: Eigenpairs, others: Eigenpairs, count: int) -> Eigenpairs:
    """The `count` lowest Ritz pairs in the span of some pairs and of what `others` add to it: a shift next to a very
    soft motion loses those far above it, which another has found."""
    Y = others.vectors
    for _ in range(2):
        Y = Y - pairs.vectors @ (pairs.vectors.T @ (pencil.M @ Y))
    Y = Y[:, np.einsum("ik,ik->k", Y, pencil.M @ Y) > DEPENDENT]
    if len(pairs.values) >= count or not Y.shape[1]:
        return pairs
    own = _zeroed(pencil, Eigenpairs(*pencil.ritz(np.hstack([pairs.vectors, Y]))))
    return Eigenpairs(own.values[:count], own.vectors[:, :count])


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
    X = X[:, np.einsum("ik,ik->k", X, pencil.M @ X) > DEPENDENT]
    pairs = _zeroed(pencil, Eigenpairs(*pencil.ritz(X))) if X.shape[1] else Eigenpairs(np.empty(0), X)
    values, vectors = np.concatenate([np.zeros(free.shape[1]), pairs.values]), np.hstack([free, pairs.vectors])
    order = np.argsort(values, kind="stable")[:k]
    return Eigenpairs(values[order], vectors[:, order])


def _zeroed(pencil: Pencil, pairs: Eigenpairs) -> Eigenpairs:
    """M-orthonormal pairs with the values that are not above their own round-off set to zero."""
    return Eigenpairs(np.where(pairs.values <= pencil.margin(pairs.vectors), 0.0, pairs.values), pairs.vectors)


def is_definite(K: Matrix) -> bool:
    """True when symmetric positive semidefinite K (n, n) is definite to working accuracy, judged by its pivots."""
    return least_pivot(K) > SINGULAR_PIVOT


def least_pivot(K: Matrix) -> float:
    """The least pivot of a symmetric positive semidefinite K (n, n), its diagonal scaled to one; zero where it is
    singular. Solutions with K lose about as many digits as it has leading zeros."""
    return _pivot(K)[0]


class _Factors:
    """Sparse factors of a symmetric A (n, n) with a positive diagonal, scaled to one by d. Raises SolverError when A is
    singular."""

    def __init__(self, A: sp.csc_matrix) -> None:
        self.d = 1 / np.sqrt(A.diagonal())
        self.lu = factorise(scaled(A, self.d))

    def solve(self, b: Array) -> Array:
        """A^-1 b for b (n, k)."""
        return self.d[:, None] * self.lu.solve(np.ascontiguousarray(self.d[:, None] * b))


def _pivot(K: Matrix) -> tuple[float, _Factors | None]:
    """The least pivot, as `least_pivot`, and the factors where they are sparse."""
    d = K.diagonal()
    if not (d > 0).all():
        return 0.0, None
    if K.shape[0] <= DENSE_LIMIT:
        d = 1 / np.sqrt(d)
        try:
            pivots = np.diagonal(np.linalg.cholesky(_toarray(K) * d[:, None] * d)) ** 2
        except np.linalg.LinAlgError:
            return 0.0, None
        return float(pivots.min(initial=np.inf)), None
    try:
        factors = _Factors(sp.csc_matrix(K))
    except SolverError:
        return 0.0, None
    return float(factors.lu.U.diagonal().min()), factors


def _definite(K: Matrix) -> tuple[bool, _Factors | None]:
    """Whether K is definite, as `is_definite`, and its factors where they are sparse."""
    pivot, factors = _pivot(K)
    return pivot > SINGULAR_PIVOT, factors


def _lowest(K: Matrix, M: Matrix, count: int, shift: float, factors: _Factors | None = None) -> Eigenpairs:
    """The lowest pairs by their distance from a shift; `factors` of K - shift M where they are there already."""
    n = K.shape[0]
    if n <= DENSE_LIMIT or count > n // 3:
        return _dense(_toarray(K), _toarray(M), count, shift)
    return _sparse(sp.csc_matrix(K), sp.csc_matrix(M), count, shift, factors)


def residuals(pencil: Pencil, pairs: Eigenpairs) -> Array:
    """Relative residuals (k,) of eigenpairs of K x = lambda M x in the norm that bounds the eigenvalue (theory eq. 56).

    r = (lambda - s) (K - s M)^-1 M x - x, in the M-norm relative to x: some exact eigenvalue mu has
    |(lambda - s) / (mu - s) - 1| <= |r| (Krylov and Weinstein, Parlett 1980, sec. 4.5). s is zero for definite K, else
    minus the lowest nonzero eigenvalue of the pairs (minus one when all are zero).
    """
    return _weinstein(pencil, pairs.values, pairs.vectors)[0]


def residual_intervals(pencil: Pencil, values: Array, vectors: Array) -> tuple[Array, Array]:
    """Bounds (k,), (k,) between which some eigenvalue lies, for each Ritz pair (Krylov and Weinstein; theory eq. C5).

    The residuals, as in `residuals`, are widened for round-off. The upper bound is infinite where the residual is one
    or more.
    """
    radius, shift = _weinstein(pencil, values, vectors)
    distance = values - shift
    margin = pencil.margin(vectors)
    radius = radius + margin / distance
    upper = np.where(radius < 1, shift + distance / np.where(radius < 1, 1 - radius, 1.0), np.inf)
    return shift + distance / (1 + radius) - margin, upper + margin


def _weinstein(pencil: Pencil, values: Array, vectors: Array) -> tuple[Array, float]:
    """The residuals and the shift that they refer to."""
    elastic = values[values > 0]
    least = float(elastic.min()) if len(elastic) else 1.0
    shift = 0.0 if len(elastic) == len(values) else -least
    Mx = pencil.M @ vectors
    try:
        y = _solution(pencil, Mx, shift)
    except SolverError:
        if shift:
            raise
        shift = -least  # soft enough to look singular
        y = _solution(pencil, Mx, shift)
    r = (values - shift) * y - vectors
    size = np.einsum("ik,ik->k", vectors, Mx)
    return np.sqrt(np.abs(np.einsum("ik,ik->k", r, pencil.M @ r)) / size), shift


def static_response(pencil: Pencil, loads: Array, shift: float = 0.0) -> Array:
    """(K + shift M)^-1 loads (n, k), definite, corrected by residuals in energies until it stands.

    Raises SolverError when K is singular, or so close to it that round-off stands in the way.
    """
    Y = _solution(pencil, loads, -shift)
    last = _solution(pencil, loads - pencil.stiffness(Y) - shift * (pencil.M @ Y), -shift)
    off, size = (np.sqrt(np.abs(np.einsum("ik,ik->k", X, loads))) for X in (last, Y))
    if (off > UNSETTLED * size).any():
        raise SolverError("something can move freely, or is held by less than round-off in the stiffness hides")
    return Y + last


def _solution(pencil: Pencil, right: Array, shift: float, factors: _Factors | None = None) -> Array:
    """(K - shift M)^-1 of right sides (n, k), definite, by factors of what is stored and corrections by energies."""
    if factors is None:
        factors = _Factors(sp.csc_matrix(pencil.K - shift * pencil.M) if shift else sp.csc_matrix(pencil.K))
    Y, rest = np.zeros_like(right), right
    for step in range(1 + POLISH):
        Y = Y + factors.solve(rest)
        if step < POLISH:
            rest = right - (pencil.stiffness(Y) - shift * (pencil.M @ Y))
    return Y


def _toarray(A: Matrix) -> Array:
    return np.asarray(A.toarray()) if hasattr(A, "toarray") else np.asarray(A)


def _dense(K: Array, M: Array, count: int, shift: float) -> Eigenpairs:
    S = K - shift * M if shift else K
    d = 1 / np.sqrt(np.maximum(np.diagonal(S), np.finfo(float).tiny))
    n = len(d)
    Md, Sd = M * d[:, None] * d, S * d[:, None] * d
    try:
        try:
            mu, y = la.eigh(Md, Sd, subset_by_index=[n - count, n - 1])
        except la.LinAlgError:  # LAPACK's inverse iteration may fail on clusters, divide and conquer does not
            mu, y = (part[..., n - count :] for part in la.eigh(Md, Sd, driver="gvd"))
    except la.LinAlgError:
        raise SolverError("the stiffness matrix is not positive definite: something can move freely") from None
    mu, y = mu[::-1], y[:, ::-1]
    with np.errstate(divide="ignore"):
        values = np.where(mu > 0, 1 / np.where(mu > 0, mu, 1.0), np.inf) + shift
    vectors = d[:, None] * y / np.sqrt(np.where(mu > 0, mu, 1.0))
    return Eigenpairs(values, vectors)


def factorise(A: sp.csc_matrix) -> spla.SuperLU:
    """LU factors of a sparse symmetric matrix with a fill-reducing ordering, diagonal pivots preferred.

    Raises SolverError when the matrix is singular.
    """
    try:
        return superlu(A)
    except RuntimeError:
        raise SolverError("the stiffness matrix is singular: something can move freely") from None


def _sparse(K: sp.csc_matrix, M: sp.csc_matrix, count: int, shift: float, factors: _Factors | None) -> Eigenpairs:
    n = K.shape[0]
    factors = factors or _Factors((K - shift * M).tocsc() if shift else K)
    d, solve = factors.d, factors.lu.solve
    Ks, Ms = scaled(K, d), scaled(M, d)
    found = _lanczos(Ks, Ms, solve, count, shift, np.empty((n, 0)))
    fewest, idle = n + 1, 0
    while True:
        missing = _missing(Ks, Ms, found.values, float(found.values[:count].max()), shift)
        if missing <= 0:
            break
        fewest, idle = (missing, 0) if missing < fewest else (fewest, idle + 1)
        if idle == IDLE:
            raise SolverError("eigenvalues that are counted are not found: the stiffness has lost its digits")
        more = _lanczos(Ks, Ms, solve, missing, shift, found.vectors)
        order = np.argsort(np.concatenate([found.values, more.values]), kind="stable")
        found = Eigenpairs(
            np.concatenate([found.values, more.values])[order],
            np.hstack([found.vectors, more.vectors])[:, order],
        )
    return Eigenpairs(found.values[:count], d[:, None] * found.vectors[:, :count])


def _missing(Ks: Any, Ms: Any, values: Array, last: float, shift: float) -> int:
    """How many eigenvalues below `last` are not among `values`; copies of `last` itself do not matter.

    The count is made a little below it, further off where a factorisation so close to eigenvalues is unstable.
    """
    for offset in (1e-6, 1e-5, 1e-4):
        below = last - offset * abs(last) - 1e-3 * abs(shift)
        count = stable_count((Ks - below * Ms).tocsc())
        if count is not None:
            return count - int((values < below).sum())
    counted = bracket(Pencil.of(Ks, Ms), last - 1e-4 * abs(last) - 1e-3 * abs(shift))
    if counted.is_proven:
        return counted.least - int((values < counted.value).sum())
    below = last - 1e-6 * abs(last) - 1e-3 * abs(shift)
    return count_below(Ks, Ms, below) - int((values < below).sum())


def _lanczos(Ks: Any, Ms: Any, solve: Any, count: int, shift: float, known: Array) -> Eigenpairs:
    """Shift-invert Lanczos in the M-orthogonal complement of `known` (n, j)."""
    n = Ks.shape[0]
    Mk = Ms @ known

    def invert(x: Array) -> Array:
        checkpoint()
        y = solve(x)
        return y - known @ (Mk.T @ y) if known.shape[1] else y

    start = np.cos(np.arange(n) * (1.0 + known.shape[1]))
    start -= known @ (Mk.T @ start)
    operator = spla.LinearOperator((n, n), matvec=invert, dtype=float)
    basis = min(n - 1, max(2 * count + 12, 20))
    try:
        values, vectors = spla.eigsh(
            Ks, k=min(count, n - 1), M=Ms, sigma=shift, OPinv=operator, v0=start, ncv=basis, maxiter=RESTARTS, tol=0
        )
    except spla.ArpackError as error:
        raise SolverError(f"the eigenvalue search did not converge: {error}") from None
    order = np.argsort(values)
    return Eigenpairs(values[order], _orthonormalise(vectors[:, order], Ms))


def _orthonormalise(vectors: Array, M: Any) -> Array:
    """Make vectors (n, k) M-orthonormal, keeping their order (Cholesky of the Gram matrix)."""
    gram = vectors.T @ (M @ vectors)
    return la.solve_triangular(la.cholesky(gram, lower=True), vectors.T, lower=True).T
