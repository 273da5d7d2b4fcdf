"""Proven intervals for the natural frequencies of many designs, from the moments of their chains.

Above: Ritz values of motions to which the response of the chains to their own inertia is added. Nothing of it is taken
from how small pencils are solved: their vectors are trial vectors like any others, and what the projections on them may
be off by, in rows of the matrices that belong to the lowest ones, widens the bounds (theory eqs. N6, N15, N16).
Below: with ell smaller than every squared frequency of the motions left out, the dynamic stiffness of the full order at
ell has no more negative eigenvalues than the smaller matrix K - ell M - ell^2/(1 - ell/mu) R has, and that it has fewer
than j is proven by a Cholesky factorisation (theory eqs. N6-N11).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from flexura.arrays import Array
from flexura.linalg import EPS, GUARD, Eigenpairs, lowest_pairs, small_pencils
from flexura.reduction.branches import EndMatrices

RESPONSE_CORRECTED = 0.45
"""Part of the lowest squared frequency left out up to which the response to their own inertia is added to Ritz
vectors."""

RIGID_FREQUENCY = 1e-3
"""A frequency that round-off alone makes, and that is below this part of the first elastic one, is zero."""

HIDDEN_MASS = 8.0
"""A vector whose mass is not so many times what round-off may amount to adds nothing."""

LAST_RATIO = 1e3
"""Ratio of the value that such a vector is given, so that it comes last, to the highest of the others."""

RITZ_SEARCHED = 1e-9
"""Relative error at which the search for Ritz vectors ends: it goes into the upper bounds alone."""

LOWER_REACH = 0.95
"""Part of the lowest frequency left out, squared, up to which lower bounds are looked for."""

CHAIN_LOSSES = 4.0
"""How often the relative error of the chains' energy enters an eigenvalue: in K, in M by the constraint modes, in R."""


def projection_errors(A: Array, slack: Array, size: Array, terms: int) -> Array:
    """c^2 (..., 2, p) such that projections of K and M on p vectors, and their rotations, are right to c_i c_j, from
    A (3, ..., n, n), its `slack` (3, ..., n), and the sizes (..., n, p) of the vectors before digits cancel, in sums of
    `terms` terms."""
    n, p = size.shape[-2:]
    errors = slack[:2] + n * (terms + 2 * p + 16) * EPS * abs(np.einsum("...ii->...i", A[:2]))
    return np.asarray(np.moveaxis(errors, 0, -2) @ size**2)


@dataclass(frozen=True)
class Projection:
    """K, M and R (designs, p, p) on p Ritz vectors; K and M are right to c_i c_j, with the squares `off`
    (designs, 2, p) of c."""

    K: Array
    M: Array
    R: Array
    off: Array


def upper_bounds(small: Projection, values: Array, slowness: Array) -> tuple[Array, Array, Array, Array]:
    """Upper bounds (designs, p) on the p lowest eigenvalues of the full order, infinite where round-off hides them,
    the Ritz values (designs, p) that they are for all round-off, the vectors (designs, p, p) that they belong to, and
    by how much the energy of these in K may be off (designs, p).

    `values` (designs, p) are the squared frequencies of the Ritz vectors.
    """
    K, M, off = small.K, small.M, small.off
    # x'R x <= x'M x / mu, so that a factor below 1/2 keeps the mass positive, and twice what M has lost is enough
    scale = np.where(np.isfinite(values), values, 0.0)
    scale = np.where(scale * slowness[:, None] < RESPONSE_CORRECTED, scale, 0.0)
    response = small.R * scale[:, None, :]
    # R, from above in lower bounds, must come from below in the mass
    stiff, massive = K + scale[:, :, None] * response, M + (1 - 1e-7) * (response + response.mT)
    Z = _combined(stiff, massive, HIDDEN_MASS * off[:, 1] < np.einsum("dii->di", M))
    Zt = Z.mT
    of_stiffness, of_mass = off[:, 0] + scale * off[:, 1], 2 * off[:, 1]
    k, m = ((abs(Zt) @ np.sqrt(squares)[..., None])[..., 0] for squares in (of_stiffness, of_mass))
    stiff, massive = Zt @ stiff @ Z, Zt @ massive @ Z
    highest = np.maximum.accumulate(np.einsum("dii->di", stiff), axis=1)
    eye = np.eye(K.shape[-1])
    of_K = _leading_sums(abs(stiff) * (1 - eye) + k[:, :, None] * k[:, None, :])
    of_M = _leading_sums(abs(massive - eye) + m[:, :, None] * m[:, None, :])
    known = np.isfinite(of_K) & (of_M < 1)
    upper = np.where(known, np.maximum(highest + of_K, of_K), np.inf) / np.where(known, 1 - of_M, 1.0)
    return upper, highest, Z, k**2


def _combined(stiff: Array, massive: Array, known: NDArray[np.bool_]) -> Array:
    """Vectors (designs, p, p) of small pencils among those of p vectors that have a `known` mass (designs, p); no
    vector in the place of others, which come last."""
    a, b = (np.einsum("dii->di", matrix) for matrix in (stiff, massive))
    quotients = np.where(known, a / np.where(known, b, 1.0), np.inf)
    if (quotients[:, 1:] >= quotients[:, :-1]).all() and known.all():
        return small_pencils(stiff, massive)[1]
    # in ascending order small values keep their digits beside large ones
    order = quotients.argsort(axis=1, kind="stable")
    rows, columns = order[:, :, None], order[:, None, :]
    at = np.arange(len(order))[:, None, None]
    known = np.take_along_axis(known, order, axis=1)
    both = known[:, :, None] & known[:, None, :]
    A, B = (np.ascontiguousarray(np.where(both, matrix[at, rows, columns], 0.0)) for matrix in (stiff, massive))
    a, b = (np.einsum("dii->di", matrix) for matrix in (A, B))
    b[~known] = 1.0
    a[...] = np.where(known, a, LAST_RATIO * (a / b).max(axis=1, keepdims=True))
    Z = np.empty(A.shape)
    Z[at, rows, np.arange(A.shape[-1])] = np.where(known[:, :, None], small_pencils(A, B)[1], 0.0)
    return Z


def _leading_sums(A: Array) -> Array:
    """Largest row sum (designs, p) of the first j rows and columns of A (designs, p, p), not negative, for every j."""
    return np.asarray(np.triu(A.cumsum(axis=-1)).max(axis=-2))


def rigid_values(values: Array, upper: Array, margin: Array, rigid: int) -> tuple[NDArray[np.bool_], Array]:
    """Which eigenvalues (designs, p), of the `rigid` lowest, round-off of that `margin` alone makes, and upper bounds
    with that."""
    zero = (values < 4 * margin) & np.isfinite(upper) & (np.arange(values.shape[1]) < rigid)
    elastic = np.where(zero, np.inf, values).min(axis=1, keepdims=True)
    zero &= (4 * margin <= RIGID_FREQUENCY**2 * elastic) & np.isfinite(elastic)
    return zero, np.maximum.accumulate(np.maximum(upper, np.where(zero, 4 * margin, 0.0)), axis=1)


@dataclass(frozen=True)
class ChainBounds:
    """Bounds (designs, count), (rad/s)^2, on the lowest eigenvalues of the full order, number by number, and the best
    estimates between them: `lower` is zero where nothing is proven; eigenvalues that are `zero` to working accuracy lie
    between zero and `upper`."""

    lower: Array
    upper: Array
    best: Array
    zero: NDArray[np.bool_]


def chain_bounds(ends: EndMatrices, count: int, start: Eigenpairs, tolerance: float) -> ChainBounds:
    """Bounds on the `count` lowest eigenvalues of every design, as narrow as they come, or to `tolerance` relative in
    frequency; `start` holds eigenpairs of a design like these."""
    rigid = int((start.values <= 0).sum())
    shift = 0.0 if not rigid else float(start.values[start.values > 0].min())
    wanted = max(count, start.vectors.shape[-1] - GUARD)
    if shift:
        start = Eigenpairs(start.values + shift, start.vectors)
    K, within = (ends.K + shift * ends.M, RITZ_SEARCHED * RIGID_FREQUENCY) if shift else (ends.K, RITZ_SEARCHED)
    pairs = lowest_pairs(K, ends.M, wanted, start, within)
    solved = np.asarray(np.isfinite(pairs.vectors).all(axis=(1, 2), keepdims=True))
    X = np.where(solved, pairs.vectors, 0.0)
    small = _projected(ends, X)
    energy, mass = (np.einsum("dii->di", A) for A in (small.K, small.M))
    # infinite where round-off has left no mass
    values = np.maximum(np.where(mass > 0, energy / np.where(mass > 0, mass, 1.0), np.inf), 0.0)
    upper, ritz, _, _ = upper_bounds(small, values, ends.slowness)
    margin = small.off[:, 0] + EPS * ends.K.shape[-1] * shift
    zero, upper = rigid_values(values, upper, margin, rigid)
    guess, Z = small_pencils(*_from_below(small, values, ends.slowness))
    vectors = ends.M @ (X @ Z)
    lower = np.zeros((len(ends.K), count))
    tried = list(attempts(values, guess, upper, tolerance))
    for j in range(count):
        for attempt in tried:
            ell = attempt[:, j]
            open_ = np.flatnonzero((lower[:, j] == 0) & ~zero[:, j] & (ell > 0) & (ell * ends.slowness < LOWER_REACH))
            if len(open_):
                proven = _fewer_than(ends, open_, ell[open_], vectors[open_, :, :j])
                lower[open_[proven], j] = ell[open_[proven]]
    return enclosed(lower, upper[:, :count], ritz[:, :count], zero[:, :count], ends.loss)


def attempts(values: Array, guess: Array, upper: Array, tolerance: float) -> Iterator[Array]:
    """Lower bounds (designs, p) to be tried: a little below a guess from Ritz values, then at the tolerance; zero where
    the upper bound is infinite."""
    known = np.isfinite(values) & np.isfinite(guess) & np.isfinite(upper)
    guess, upper, values = (np.where(known, bound, 0.0) for bound in (guess, upper, values))
    moved = np.maximum(values - guess, 0.0)
    yield guess - 0.05 * np.maximum(upper - guess, 0.0) - 4 * moved**2 / np.maximum(guess, EPS) - 1e-10 * guess
    yield upper * (1 - 0.99 * tolerance) ** 2


def enclosed(lower: Array, upper: Array, best: Array, zero: NDArray[np.bool_], loss: Array) -> ChainBounds:
    """Bounds with what the chains have lost (designs,), and the Ritz values as far as they lie between these; no bounds
    where they contradict each other."""
    lower = np.maximum.accumulate(lower, axis=1) * np.maximum(1 - CHAIN_LOSSES * loss, 0.0)[:, None]
    upper = upper * (1 + CHAIN_LOSSES * loss[:, None])
    crossed = (lower > upper).any(axis=1, keepdims=True)
    lower, upper = np.where(crossed, 0.0, lower), np.where(crossed, np.inf, upper)
    best = np.where(np.isfinite(upper), np.clip(best, lower, upper), np.inf)
    return ChainBounds(lower, upper, best, zero & ~crossed)


def _projected(ends: EndMatrices, X: Array) -> Projection:
    K, M, R = (X.mT @ (A @ X) for A in ends.A)
    return Projection(K, M, R, projection_errors(ends.A, ends.slack, abs(X), X.shape[-2]))


def _from_below(small: Projection, values: Array, slowness: Array) -> tuple[Array, Array]:
    """A pencil whose eigenvalues are near the best lower bounds; nothing depends on how near."""
    values = np.where(np.isfinite(values), values, 0.0)
    h = values / np.sqrt(np.maximum(1 - values * slowness[:, None], RESPONSE_CORRECTED))
    A, B = small.K - h[:, :, None] * small.R * h[:, None, :], small.M.copy()
    np.einsum("dii->di", A)[...] -= small.off[:, 0]
    np.einsum("dii->di", B)[...] += small.off[:, 1]
    return A, B


def _fewer_than(ends: EndMatrices, at: NDArray[np.intp], ell: Array, vectors: Array) -> NDArray[np.bool_]:
    """True for the designs `at` for which fewer than j eigenvalues of the full order are proven to lie below ell
    (designs,); `vectors` (designs, n, j - 1), M times the lower modes, are lifted out of the way (theory eqs. N7, N8).
    """
    n = ends.K.shape[-1]
    whole = len(at) == len(ends.K)
    (K, M, R), slack = (ends.A, ends.slack) if whole else (ends.A[:, at], ends.slack[:, at])
    h = ell**2 / (1 - ell * ends.slowness[at])
    A = K - ell[:, None, None] * M
    A -= (h * (1 + 1e-9))[:, None, None] * R
    margin = slack[0] + ell[:, None] * slack[1] + h[:, None] * slack[2]
    size = sum(f * np.einsum("dii->di", B) for f, B in ((1.0, K), (ell[:, None], M), (h[:, None], R)))
    if vectors.shape[-1]:
        lifted = vectors * np.sqrt(2 * ell)[:, None, None]
        A += lifted @ lifted.mT
        size = size + np.einsum("dij,dij->di", lifted, lifted)
    np.einsum("dii->di", A)[...] -= margin + cholesky_rounding(n, vectors.shape[-1]) * size
    return np.array([lapack.dpotrf(B.T, clean=0)[1] == 0 for B in A], dtype=bool)


def cholesky_rounding(n: int, lifted: int = 0) -> float:
    """Part of the diagonal by which a sum of a few matrices (n, n) may be off that a Cholesky factorisation proves
    positive definite: n + 1 roundings of the factorisation (Rump 2006; theory eq. N11), ten and the lifted vectors' of
    the sum."""
    return n * (n + 11 + lifted) * EPS / 2
