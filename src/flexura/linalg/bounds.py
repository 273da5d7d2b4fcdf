"""What is proven about eigenvalues of K x = lambda M x: how many lie below a value, and intervals that hold them.

The signs of a factorisation count the eigenvalues below a value (Sylvester's law of inertia). What a pair leaves over
gives an interval that holds some eigenvalue. Ritz values of K bound the lowest eigenvalues from above (Poincare;
Parlett 1980, sec. 10.2). The inverse C = (K - rho M)^-1 M, self-adjoint in the M-inner product, has the eigenvalues
1/(lambda - rho): its own Ritz values bound those below rho from below (Lehmann 1949; Maehly 1952; Parlett 1980, sec.
10.5), once a count has said how many there are. Both bounds are second order in the error of the vectors. Energies are
sums of squares of strains (`Pencil`), and what round-off in them, in positions and in sums can amount to widens the
bounds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.linalg.factor import (
    FACTOR_ROUNDING,
    UNSTABLE_PIVOTS,
    Elimination,
    Factor,
    SingularError,
    eliminated,
    factorise,
)
from flexura.linalg.pencil import EPS, MASS_LOST, Eigenpairs, Pencil, inverse_roots, scaled, toarray, unit_scale

DENSE_BRACKET = 60
"""Up to this order eigenvalues are as quick as factorisations."""

DENSE_FALLBACK = 4000

COUNT_NUDGES = (0.0, 1e-9, -1e-9, 3e-8, -3e-8, 1e-6)

CORRECTIONS = 2
"""Corrections of a solution by its residual in energies."""

WORK_SETTLED = 1e-6
"""Change of the root of the work of loads, relative, in the last correction of their response."""

SHIFT_TRIALS, SHIFT_RATIO = 4, 64.0
"""How often a shift below all eigenvalues is tried again, and so many times as far below."""

DOT_ROUNDING = 1e-13
"""Relative error of inner products of long vectors and of small eigenproblems."""

UNSOLVED = 1e-6
"""Relative residual of a solution beyond which the factors are no guide to the true matrix."""

COUNTED_GAP = 1e-5
"""Relative gap between intervals in which eigenvalues are counted."""


@dataclass(frozen=True)
class Bracket:
    """What factorisations prove about the number of eigenvalues below `value`: at least `least`, at most `most`.

    `solve` gives nearly (K - value M)^-1 b for b (n, k).
    """

    value: float
    least: int
    most: int
    solve: Callable[[Array], Array]

    @property
    def is_proven(self) -> bool:
        """True when the number is known."""
        return self.least == self.most


def bracket(pencil: Pencil, value: float) -> Bracket:
    """Count the eigenvalues below `value` of the true matrices, of which those stored differ by round-off.

    K - value M is factorised with the bounds of its own round-off, and of that of the factorisation, subtracted from
    and added to its diagonal (theory eq. C8): the true number lies between the two counts. Where they differ values
    next to it are tried. Raises SolverError when there is no factorisation.
    """
    best = None
    for nudge in (0.0, 1e-6, -1e-6, 1e-4, -1e-4, 2e-3, -2e-3):
        counted = _bracket(pencil, value * (1 + nudge))
        if counted is not None and counted.is_proven:
            return counted
        if counted is not None and (best is None or counted.most - counted.least < best.most - best.least):
            best = counted
    if best is None:
        raise SolverError("no stable factorisation was found for an inertia count")
    return best


def _bracket(pencil: Pencil, value: float) -> Bracket | None:
    d = inverse_roots(pencil.K.diagonal() + abs(value) * pencil.M.diagonal())
    lost = pencil.uncertainty(d, value)
    A: Any = pencil.K - value * pencil.M
    if isinstance(A, np.ndarray) or len(d) <= DENSE_BRACKET:
        return _dense_bracket(scaled(toarray(A), d), d, lost, value)
    A = scaled(A.tocsc(), d)
    lost = lost + FACTOR_ROUNDING * EPS * np.asarray(abs(A).sum(axis=1)).ravel()
    for _ in range(3):
        lower, upper = (_signed(A + sp.diags(side * lost, format="csc"), np.ones(len(d))) for side in (-1, 1))
        if lower is None or upper is None:
            break
        rounding = np.maximum(lower.lost, upper.lost)
        if (rounding <= lost).all():
            return Bracket(value, upper.negative, lower.negative, _solver(lower.factor, d))
        lost = np.maximum(lost, 4 * rounding)
    return _dense_bracket(A.toarray(), d, lost, value) if len(d) <= DENSE_FALLBACK else None


def _solver(factor: Elimination, d: Array) -> Callable[[Array], Array]:
    return lambda b: d[:, None] * factor.solve(d[:, None] * b)


@dataclass(frozen=True)
class _Signed:
    """A factor with diagonal pivots, how many are negative, and row sums (n,) of the bound of its round-off."""

    factor: Elimination
    negative: int
    lost: Array


def _signed(A: sp.csc_matrix, scale: Array) -> _Signed | None:
    """Of an A (n, n), scaled by `scale` (n,); None where a pivot is zero or not on the diagonal."""
    try:
        factor = eliminated(A, scale)
    except SingularError:
        return None
    negative, lost = factor.negative, factor.lost
    return None if negative is None or lost is None else _Signed(factor, negative, lost)


def _dense_bracket(A: Array, d: Array, lost: Array, value: float) -> Bracket:
    """By the eigenvalues of the scaled matrix, which are right to some units of round-off of its norm."""
    values, V = la.eigh((A + A.T) / 2)
    margin = float(lost.max()) + len(d) * EPS * float(np.abs(values).max())

    def solve(b: Array) -> Array:
        y = V.T @ (d[:, None] * b) / np.where(values != 0, values, EPS)[:, None]
        return d[:, None] * (V @ y)

    return Bracket(value, int((values < -margin).sum()), int((values < margin).sum()), solve)


def count_below(K: Any, M: Any, value: float) -> int:
    """Number of eigenvalues of K x = lambda M x below `value`: the negative pivots of K - value M (theory eq. 55).

    K, M: (n, n) symmetric, M positive semidefinite, as they are stored. Sparse symmetric elimination with diagonal
    pivots; where those would be unstable the value is moved by parts in a thousand million, and at last a dense
    Bunch-Kaufman factorisation is used. Raises SolverError when even that is out of reach.
    """
    if isinstance(K, np.ndarray):
        return _dense_count(np.asarray(K) - value * np.asarray(M))
    for nudge in COUNT_NUDGES:
        count = stable_count((K - value * (1 + nudge) * M).tocsc())
        if count is not None:
            return count
    if K.shape[0] <= DENSE_FALLBACK:
        return _dense_count((K - value * M).toarray())
    raise SolverError("no stable factorisation was found for an inertia count")


def stable_count(A: sp.csc_matrix) -> int | None:
    """Number of negative eigenvalues of a symmetric A (n, n) by diagonal pivots; None where those would be unstable."""
    checkpoint()
    factored = _signed(A, unit_scale(A))
    return None if factored is None or factored.lost.max(initial=0.0) > UNSTABLE_PIVOTS else factored.negative


def _dense_count(A: Array) -> int:
    D, pivots, _ = la.lapack.dsytrf(scaled(A, unit_scale(A)), lower=1)
    pairs = pivots < 0  # pivots of two rows have an eigenvalue of either sign (Bunch, Kaufman 1977)
    return int((np.diagonal(D)[~pairs] < 0).sum() + pairs.sum() // 2)


def residuals(pencil: Pencil, pairs: Eigenpairs) -> Array:
    """Relative residuals (k,) of eigenpairs of K x = lambda M x in the norm that bounds the eigenvalue (theory eq. 56).

    r = (lambda - s) (K - s M)^-1 M x - x, in the M-norm relative to x: some exact eigenvalue mu has
    |(lambda - s) / (mu - s) - 1| <= |r| (Krylov and Weinstein, Parlett 1980, sec. 4.5). s is zero for definite K, else
    below the lowest eigenvalue of the pairs by at least the lowest positive one (by one when there is none).
    """
    return _weinstein(pencil, pairs.values, pairs.vectors)[0]


def residual_intervals(pencil: Pencil, values: Array, vectors: Array) -> tuple[Array, Array]:
    """Bounds (k,), (k,) between which some eigenvalue lies, for each Ritz pair (Krylov and Weinstein; theory eq. C5).

    The residuals, as in `residuals`, are widened for round-off. The upper bound is infinite where the residual is one
    or more.
    """
    radius, shift = _weinstein(pencil, values, vectors)
    distance = values - shift
    margin = pencil.margin(vectors) + np.abs(values) * pencil.mass_margin(vectors)
    radius = radius + margin / distance
    upper = np.where(radius < 1, shift + distance / np.where(radius < 1, 1 - radius, 1.0), np.inf)
    return shift + distance / (1 + radius) - margin, upper + margin


def _weinstein(pencil: Pencil, values: Array, vectors: Array) -> tuple[Array, float]:
    """The residuals and the shift that they refer to."""
    elastic = values[values > 0]
    least = float(elastic.min()) if len(elastic) else 1.0
    shift = 0.0 if len(elastic) == len(values) else 2 * float(values.min(initial=0.0)) - least
    Mx = pencil.M @ vectors
    for further in (True,) * SHIFT_TRIALS + (False,):
        try:
            y = solution(pencil, Mx, shift)
            break
        except SolverError:
            if not further:
                raise
            shift = SHIFT_RATIO * shift if shift else -least  # soft enough to look singular
    r = (values - shift) * y - vectors
    size = np.einsum("ik,ik->k", vectors, Mx)
    return np.sqrt(np.abs(np.einsum("ik,ik->k", r, pencil.M @ r)) / size), shift


def static_response(pencil: Pencil, loads: Array, shift: float = 0.0, settled: float = WORK_SETTLED) -> Array:
    """(K + shift M)^-1 loads (n, k), definite, corrected by residuals in energies until it stands: the last correction
    changes the root of the work of each load by less than `settled` of it.

    Raises SolverError when K is singular, or so close to it that round-off stands in the way.
    """
    Y = solution(pencil, loads, -shift)
    last = solution(pencil, loads - pencil.stiffness(Y) - shift * (pencil.M @ Y), -shift)
    off, size = (np.sqrt(np.abs(np.einsum("ik,ik->k", X, loads))) for X in (last, Y))
    if (off > settled * size).any():
        raise SolverError("something can move freely, or is held by less than round-off in the stiffness hides")
    return Y + last


def solution(pencil: Pencil, right: Array, shift: float, factors: Factor | None = None) -> Array:
    """(K - shift M)^-1 of right sides (n, k), definite, by factors of what is stored and corrections by energies."""
    if factors is None:
        factors = factorise(pencil.K - shift * pencil.M if shift else pencil.K)
    Y, rest = np.zeros_like(right), right
    for step in range(1 + CORRECTIONS):
        Y = Y + factors.solve(rest)
        if step < CORRECTIONS:
            rest = right - (pencil.stiffness(Y) - shift * (pencil.M @ Y))
    return Y


@dataclass(frozen=True)
class Enclosures:
    """What factorisations of K - rho M and k trial vectors prove about the eigenvalues below rho.

    Between `least` and `most` eigenvalues lie below `rho`. The lowest k are at most `upper` (k,), where their Rayleigh
    quotients are `values`; the i-th largest of those below rho is at least `lower[-1 - i]`. So when their number is
    proven to be k, [lower, upper] encloses each of the k lowest, number by number. `remainder` (n, k) are the residuals
    C x - theta x of the directions x, of unit M-norm, that `lower` belongs to.
    """

    rho: float
    least: int
    most: int
    values: Array
    lower: Array
    upper: Array
    remainder: Array

    @property
    def is_counted(self) -> bool:
        """True when the number of eigenvalues below rho is proven."""
        return self.least == self.most

    @property
    def is_complete(self) -> bool:
        """True when as many eigenvalues lie below rho as there are trial vectors."""
        return self.most == len(self.upper)


def upper_bounds(pencil: Pencil, values: Array, X: Array) -> tuple[Array, Array]:
    """Upper bounds (k,) of the k lowest eigenvalues from Ritz pairs of `Pencil.ritz`, and what round-off adds to each
    (k,) (theory eq. C9).

    The j-th bound is the largest eigenvalue of the first j rows and columns of X' K X z = mu X' M X z. With all that
    these may be off from `values` and one, the former is at most its largest row sum, the latter at least one less its.
    """
    stiff, massive = pencil.errors(X)
    eye = np.eye(len(values))
    stiff = stiff + np.abs(pencil.energies(X)) * (1 - eye)
    massive = massive + np.abs(X.T @ (pencil.M @ X) - eye) + DOT_ROUNDING * eye
    highest, of_K, of_M = (np.maximum.accumulate(values), _leading_sums(stiff), _leading_sums(massive))
    with np.errstate(divide="ignore", invalid="ignore"):
        upper = np.where(of_M < 1, (highest * (1 + DOT_ROUNDING) + of_K) / (1 - of_M), np.inf)
    return upper, upper - highest


def _leading_sums(A: Array) -> Array:
    """Largest row sum (k,) of the first j rows and columns of A (k, k), not negative, for every j."""
    return np.array([A[:j, :j].sum(axis=1).max() for j in range(1, len(A) + 1)])


def enclose(pencil: Pencil, vectors: Array, rho: float) -> Enclosures:
    """Bounds on the eigenvalues below about `rho` from k trial vectors (n, k) (theory eqs. C1-C4).

    Vectors independent in the M-norm. rho may be moved slightly where its count cannot be told. Raises SolverError when
    K - rho M cannot be factorised, and where M has lost the digits of what the vectors move.
    """
    values, X = pencil.ritz(vectors)
    if len(values) < vectors.shape[1]:
        raise SolverError(MASS_LOST)
    upper, margin = upper_bounds(pencil, values, X)
    factors = bracket(pencil, rho)
    rho = factors.value
    MX = pencil.M @ X
    Y, rest = np.zeros_like(X), MX
    for _ in range(1 + CORRECTIONS):
        Y = Y + factors.solve(rest)
        rest = MX - (pencil.stiffness(Y) - rho * (pencil.M @ Y))
    # x' M C x exactly: the error of Y comes in as rest' (K - rho M)^-1 rest
    left = rest.T @ factors.solve(rest)
    theta, Z = _ritz(Y.T @ MX + Y.T @ rest + left, X.T @ MX)
    error = DOT_ROUNDING * np.abs(theta).max(initial=0.0) + 2 * np.abs(left).sum(axis=0).max(initial=0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        # an error of theta moves 1/theta by that over theta^2
        lower = np.where(theta < 0, rho + 1 / theta - error / theta**2, -np.inf)
    order = np.argsort(lower, kind="stable")
    remainder = (Y @ Z - theta * (X @ Z))[:, order]
    lower = lower[order] - 2 * margin
    least = max(factors.least, int((upper < rho).sum()))
    solved = np.linalg.norm(rest, axis=0) <= UNSOLVED * np.linalg.norm(MX, axis=0)
    crossed = lower > upper * (1 + UNSOLVED)
    if not factors.is_proven or not solved.all() or crossed.any():  # rho is too close to what round-off hides
        lower = np.full(len(lower), -np.inf)
    return Enclosures(rho, least, factors.most, values, np.minimum(lower, upper), upper, remainder)


def _ritz(A: Array, gram: Array) -> tuple[Array, Array]:
    """Eigenpairs (k,), (k, k), ascending, of A z = theta gram z."""
    d = unit_scale(gram)
    try:
        theta, Z = la.eigh(scaled((A + A.T) / 2, d), scaled((gram + gram.T) / 2, d))
    except la.LinAlgError as error:
        raise SolverError(MASS_LOST) from error
    return theta, d[:, None] * Z


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
    if count_below(K, M, last + COUNTED_GAP * abs(last)) == k:
        return lower, upper, True
    apart = lower[1:] - upper[:-1] > COUNTED_GAP * np.abs(lower[1:])
    first = int(np.flatnonzero(np.append(True, apart))[-1])
    below = float(lower[first] - COUNTED_GAP / 2 * abs(lower[first]))
    lower[first:] = below
    return lower, upper, count_below(K, M, below) == first


def _grouped(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Bounds of which those that overlap are one, wide enough for as many eigenvalues as they are."""
    number = np.cumsum(np.append(True, lower[1:] > np.maximum.accumulate(upper)[:-1])) - 1
    for group in np.flatnonzero(np.bincount(number) > 1):
        members = np.flatnonzero(number == group)
        wider = (np.sqrt(2 * len(members)) - 1) / 2 * float((upper[members] - lower[members]).max())
        lower[members], upper[members] = lower[members].min() - wider, upper[members].max() + wider
    return lower, upper
