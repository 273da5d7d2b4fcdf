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

from flexura.arrays import Array
from flexura.linalg import GUARD, Eigenpairs, lowest_pairs, small_pencils
from flexura.reduction.batch.arrow import Order
from flexura.reduction.batch.chain_moments import EPS
from flexura.reduction.batch.ritz_bounds import CORRECTED, ZERO, lost, settled, upper_bounds

RITZ = 1e-9
"""Relative error at which the search for Ritz vectors ends: it goes into the upper bounds alone."""

REACH = 0.95
"""Part of the lowest frequency left out, squared, up to which lower bounds are looked for."""

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
    `values` (designs, p); what K and M have lost (designs, 2, p), as `lost` gives it."""

    K: Array
    M: Array
    R: Array
    off: Array
    X: Array
    values: Array


def chain_bounds(own: Order, count: int, start: Eigenpairs, tolerance: float) -> ChainBounds:
    """Bounds on the `count` lowest eigenvalues of every design, as narrow as they come, or to `tolerance` relative in
    frequency; `start` holds eigenpairs of a design like these."""
    rigid = int((start.values <= 0).sum())
    shift = 0.0 if not rigid else float(start.values[start.values > 0].min())
    wanted = max(count, start.vectors.shape[-1] - GUARD)
    if shift:
        start = Eigenpairs(start.values + shift, start.vectors)
    K, within = (own.K + shift * own.M, RITZ * ZERO) if shift else (own.K, RITZ)
    pairs = lowest_pairs(K, own.M, wanted, start, within)
    solved = np.asarray(np.isfinite(pairs.vectors).all(axis=(1, 2), keepdims=True))
    small = _projected(own, np.where(solved, pairs.vectors, 0.0))
    upper, _, _ = upper_bounds(small.K, small.M, small.R, small.off, small.values, own.slowness)
    margin = small.off[:, 0] + EPS * own.K.shape[-1] * shift
    zero, upper = settled(small.values, upper, margin, rigid)
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


def attempts(values: Array, guess: Array, upper: Array, tolerance: float) -> Iterator[Array]:
    """Lower bounds (designs, p) to be tried: a little below a guess from Ritz values, then at the tolerance; zero where
    the upper bound is infinite."""
    known = np.isfinite(values) & np.isfinite(guess) & np.isfinite(upper)
    guess, upper, values = (np.where(known, own, 0.0) for own in (guess, upper, values))
    moved = np.maximum(values - guess, 0.0)
    yield guess - 0.05 * np.maximum(upper - guess, 0.0) - 4 * moved**2 / np.maximum(guess, EPS) - 1e-10 * guess
    yield upper * (1 - 0.99 * tolerance) ** 2


def enclosed(lower: Array, upper: Array, zero: NDArray[np.bool_], loss: Array) -> ChainBounds:
    """Bounds with what the chains have lost (designs,); none where they contradict each other."""
    lower = np.maximum.accumulate(lower, axis=1) * np.maximum(1 - LOSSES * loss, 0.0)[:, None]
    upper = upper * (1 + LOSSES * loss[:, None])
    crossed = (lower > upper).any(axis=1, keepdims=True)
    return ChainBounds(np.where(crossed, 0.0, lower), np.where(crossed, np.inf, upper), zero & ~crossed)


def _projected(own: Order, X: Array) -> _Small:
    Xt = np.swapaxes(X, -1, -2)
    K, M, R = (Xt @ (A @ X) for A in (own.K, own.M, own.R))
    off = lost(own.A, own.slack, abs(X), X.shape[-2])
    return _Small(K, M, R, off, X, np.maximum(quotients(*(np.einsum("dii->di", A) for A in (K, M))), 0.0))


def _from_below(small: _Small, slowness: Array) -> tuple[Array, Array]:
    """A pencil whose eigenvalues are near the best lower bounds; nothing depends on how near."""
    values = np.where(np.isfinite(small.values), small.values, 0.0)
    h = values / np.sqrt(np.maximum(1 - values * slowness[:, None], CORRECTED))
    A, B = small.K - h[:, :, None] * small.R * h[:, None, :], small.M.copy()
    np.einsum("dii->di", A)[...] -= small.off[:, 0]
    np.einsum("dii->di", B)[...] += small.off[:, 1]
    return A, B


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
