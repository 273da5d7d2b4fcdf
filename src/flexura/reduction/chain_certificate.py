"""Proven intervals for the natural frequencies of many designs, from the moments of their chains.

Above: Ritz values of motions to which the response of the chains to their own inertia is added. Below: with ell smaller
than every squared frequency of the motions left out, the dynamic stiffness of the full order at ell has no more
negative eigenvalues than the smaller matrix K - ell M - ell^2/(1 - ell/mu) R has, and that it has fewer than j is
proven by a Cholesky factorisation (theory eqs. N6-N11).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from flexura.linalg import GUARD, Eigenpairs, lowest_pairs, small_pencils
from flexura.reduction.arrow import Order
from flexura.reduction.chain_moments import EPS

Array = NDArray[np.float64]

RITZ = 1e-9
"""Relative error at which the search for Ritz vectors ends: it goes into the upper bounds alone."""

REACH = 0.95
"""Part of the lowest frequency left out, squared, up to which lower bounds are looked for."""

CORRECTED = 0.45
"""Part of the same up to which the response to their own inertia is added to Ritz vectors."""

ZERO = 1e-3
"""A frequency that round-off alone makes, and that is below this part of the first elastic one, is zero."""

LOSSES = 4.0
"""How often the relative error of the chains' energy enters an eigenvalue: in K, in M by the constraint modes, in R."""


@dataclass(frozen=True)
class ChainBounds:
    """Bounds (designs, count), (rad/s)^2, on the lowest eigenvalues of the full order, number by number: `lower` is
    zero where nothing is proven; eigenvalues that are `zero` to working accuracy lie between zero and `upper`."""

    lower: Array
    upper: Array
    zero: NDArray[np.bool_]


@dataclass(frozen=True)
class _Small:
    """Projections (designs, p, p) on the Ritz vectors X, and M X (designs, n, p), of designs of squared frequencies
    `values` (designs, p); slack of K, of M, and of K in a Cholesky factorisation."""

    K: Array
    M: Array
    R: Array
    slack: Array
    X: Array
    values: Array


def chain_bounds(own: Order, count: int, start: Eigenpairs, tolerance: float) -> ChainBounds:
    """Bounds on the `count` lowest eigenvalues of every design, as narrow as they come, or to `tolerance` relative in
    frequency; `start` holds eigenpairs of a design like these.

    Raises SolverError when a stiffness is singular.
    """
    shift = 0.0 if (start.values > 0).all() else float(start.values[start.values > 0].min(initial=1e300))
    wanted = max(count, start.vectors.shape[-1] - GUARD)
    if shift:
        start = Eigenpairs(start.values + shift, start.vectors)
    K, within = (own.K + shift * own.M, RITZ * ZERO) if shift else (own.K, RITZ)
    pairs = lowest_pairs(K, own.M, wanted, start, within)
    small = _projected(own, pairs.vectors)
    upper, _ = small_pencils(
        *from_above(small.K + small.slack[0], small.M - small.slack[1], small.R, small.values, own.slowness)
    )
    margin = np.einsum("dii->di", small.slack[0]) + EPS * own.K.shape[-1] * shift
    zero, upper = settled(small.values, upper, margin)
    guess, Z = small_pencils(*_from_below(small, own.slowness))
    vectors = own.M @ (small.X @ Z)
    lower = np.zeros((len(own.K), count))
    tried = list(attempts(small.values, guess, upper, tolerance))
    for j in range(count):
        for attempt in tried:
            ell = attempt[:, j]
            open_ = np.flatnonzero((lower[:, j] == 0) & ~zero[:, j] & (ell > 0) & (ell * own.slowness < REACH))
            if len(open_):
                proven = _fewer_than(own, open_, ell[open_], vectors[open_, :, :j])
                lower[open_[proven], j] = ell[open_[proven]]
    return enclosed(lower, upper[:, :count], zero[:, :count], own.loss)


def quotients(energy: Array, mass: Array) -> Array:
    """Rayleigh quotients, infinite where round-off has left no mass."""
    return np.where(mass > 0, energy / np.where(mass > 0, mass, 1.0), np.inf)


def settled(values: Array, upper: Array, margin: Array) -> tuple[NDArray[np.bool_], Array]:
    """Which eigenvalues (designs, p) round-off alone makes, of that `margin`, and upper bounds that rise."""
    zero = (values < 4 * margin) & np.isfinite(upper)
    elastic = np.where(zero, np.inf, values).min(axis=1, keepdims=True)
    zero &= (4 * margin <= ZERO**2 * elastic) & np.isfinite(elastic)
    return zero, np.maximum(np.maximum.accumulate(upper, axis=1), np.where(zero, 4 * margin, 0.0))


def attempts(values: Array, guess: Array, upper: Array, tolerance: float) -> Iterator[Array]:
    """Lower bounds (designs, p) to be tried: a little below a guess from Ritz values, then at the tolerance; zero where
    the upper bound is infinite."""
    known = np.isfinite(values) & np.isfinite(guess) & np.isfinite(upper)
    guess, upper, values = (np.where(known, own, 0.0) for own in (guess, upper, values))
    moved = np.maximum(values - guess, 0.0)
    yield guess - 0.05 * np.maximum(upper - guess, 0.0) - 4 * moved**2 / np.maximum(guess, EPS) - 1e-10 * guess
    yield upper * (1 - 0.99 * tolerance) ** 2


def enclosed(lower: Array, upper: Array, zero: NDArray[np.bool_], loss: Array) -> ChainBounds:
    """Bounds with what the chains have lost (designs,)."""
    lower = np.maximum.accumulate(lower, axis=1) * np.maximum(1 - LOSSES * loss, 0.0)[:, None]
    return ChainBounds(lower, upper * (1 + LOSSES * loss[:, None]), zero)


def _projected(own: Order, X: Array) -> _Small:
    Xt = np.swapaxes(X, -1, -2)
    K, M, R = (Xt @ (A @ X) for A in (own.K, own.M, own.R))
    rump = _rump(X.shape[-2], X.shape[-1]) * np.einsum("dii->di", own.K)
    slack = np.stack([Xt @ (diagonal[..., None] * X) for diagonal in (*own.slack[:2], own.slack[0] + 2 * rump)])
    return _Small(K, M, R, slack, X, np.maximum(quotients(*(np.einsum("dii->di", A) for A in (K, M))), 0.0))


def from_above(K: Array, M: Array, R: Array, values: Array, slowness: Array) -> tuple[Array, Array]:
    """The pencil whose eigenvalues bound those of the full order from above (theory eq. N6): Ritz values of motions
    x + lambda G M x, but for a part of their mass that is left out, from projections (designs, p, p) of K, from above,
    M, from below, and R."""
    # x'R x <= x'M x / mu, so that a factor below 1/2 keeps the mass positive
    scale = np.where(np.isfinite(values), values, 0.0)
    scale = np.where(scale * slowness[:, None] < CORRECTED, scale, 0.0)
    response = R * scale[:, None, :]
    # R, from above in `_from_below`, must come from below in the mass
    return K + scale[:, :, None] * response, M + (1 - 1e-7) * (response + np.swapaxes(response, -1, -2))


def _from_below(small: _Small, slowness: Array) -> tuple[Array, Array]:
    """A pencil whose eigenvalues are near the best lower bounds; nothing depends on how near."""
    values = np.where(np.isfinite(small.values), small.values, 0.0)
    h = values / np.sqrt(np.maximum(1 - values * slowness[:, None], CORRECTED))
    return small.K - small.slack[2] - h[:, :, None] * small.R * h[:, None, :], small.M + small.slack[1]


def _fewer_than(own: Order, at: NDArray[np.intp], ell: Array, vectors: Array) -> NDArray[np.bool_]:
    """True for the designs `at` for which fewer than j eigenvalues of the full order are proven to lie below ell
    (designs,); `vectors` (designs, n, j - 1), M times the lower modes, are lifted out of the way (theory eqs. N7, N8).
    """
    n = own.K.shape[-1]
    whole = len(at) == len(own.K)
    K, M, R, slack = (own.K, own.M, own.R, own.slack) if whole else (own.K[at], own.M[at], own.R[at], own.slack[:, at])
    h = ell**2 / (1 - ell * own.slowness[at])
    A = K - ell[:, None, None] * M
    A -= (h * (1 + 1e-9))[:, None, None] * R
    margin = slack[0] + ell[:, None] * slack[1] + h[:, None] * slack[2]
    size = sum(f * np.einsum("dii->di", B) for f, B in ((1.0, K), (ell[:, None], M), (h[:, None], R)))
    if vectors.shape[-1]:
        lifted = vectors * np.sqrt(2 * ell)[:, None, None]
        A += lifted @ np.swapaxes(lifted, -1, -2)
        size = size + np.einsum("dij,dij->di", lifted, lifted)
    np.einsum("dii->di", A)[...] -= margin + _rump(n, vectors.shape[-1]) * size
    return np.array([lapack.dpotrf(B.T, clean=0)[1] == 0 for B in A], dtype=bool)


def _rump(n: int, lifted: int) -> float:
    """Part of the diagonal by which a sum of a few matrices (n, n) may be off that a Cholesky factorisation proves
    positive definite: n + 1 roundings of the factorisation (Rump 2006; theory eq. N11), ten and the lifted vectors' of
    the sum."""
    return n * (n + 11 + lifted) * EPS / 2
