"""Proven intervals of many designs whose stiffness and mass are an arrow, by elimination of its branches.

Above: Ritz values of motions in which the core moves and the branches follow, with their response to their own inertia.
Below: as in `chain_certificate`; the inside of every branch is eliminated by a Cholesky factorisation, once for all
branches that are equal, and what is left is as small as the core (theory eqs. N12-N14).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.linalg import factors, small_pencils
from flexura.reduction.batch.arrow import FIXED, ROUNDING, Arrow, Block, placed
from flexura.reduction.batch.chain_certificate import REACH, ChainBounds, attempts, enclosed
from flexura.reduction.batch.chain_moments import EPS
from flexura.reduction.batch.ritz_bounds import CORRECTED, lost, settled, upper_bounds

RESPONSES = 4
"""How often the response of the branches to their own inertia is added to a Ritz vector."""


SETTLED = 0.08
"""Largest ratio of the highest squared frequency asked for to the lowest of a branch by itself, bounded from below, at
which the series of responses ends below 1e-10."""


@dataclass(frozen=True)
class _Ritz:
    """Ritz vectors: `core` (designs, c, p) and for each block X (designs, q, r, n, p), inside and interface; squared
    frequencies `values` (designs, p)."""

    core: Array
    branches: list[Array]
    values: Array


def _t(A: Array) -> Array:
    return np.swapaxes(A, -1, -2)


def _ritz(arrow: Arrow) -> _Ritz:
    """Approximations of the lowest modes, as many as the core has coordinates: static shapes of the branches, and their
    response to inertia added as a series that ends after a few terms."""
    values, Z = small_pencils(*arrow.followed)
    values = np.maximum(values, 0.0)
    branches = []
    for block in arrow.blocks:
        m = block.inside
        # so that the series ends; nothing depends on whether these are the frequencies
        lam = np.minimum(values, CORRECTED / np.maximum(block.slowest, EPS**4)[:, None])[:, None, None, None, :]
        ends = block.T @ Z[:, None, None]
        X = block.motion[:, :, None] @ ends
        inertia = block.A[1, ..., :m, :]
        response = (block.inverse @ (inertia @ block.motion))[:, :, None] @ ends * lam
        dynamic = block.inverse @ inertia[..., :m]
        X[..., :m, :] += response
        for _ in range(RESPONSES - 1):
            response = dynamic[:, :, None] @ response * lam
            X[..., :m, :] += response
        branches.append(X)
    return _Ritz(Z, branches, values)


def arrow_values(arrow: Arrow, count: int) -> tuple[Array, NDArray[np.bool_]]:
    """The `count` lowest eigenvalues (designs, count) of K and M, and for which designs (designs,) the response of the
    branches has settled."""
    ritz = _ritz(arrow)
    found = []
    for A, X in (
        (arrow.core.A[:, :, None, None], ritz.core[:, None, None]),
        *((block.A[:, :, :, None], X) for block, X in zip(arrow.blocks, ritz.branches, strict=True)),
    ):
        found.append([(_t(X) @ (own @ X)).sum(axis=(1, 2)) for own in A[:2]])
    K, M = (np.sum(own, axis=0) for own in zip(*found, strict=True))
    values = np.maximum(small_pencils(K, M)[0][:, :count], 0.0)
    slowest = np.max([block.slowest for block in arrow.blocks], axis=0)
    return values, np.isfinite(values[:, -1]) & (
        np.where(np.isfinite(values[:, -1]), values[:, -1], 0.0) * slowest < SETTLED
    )


def arrow_bounds(arrow: Arrow, count: int, rigid: int, tolerance: float) -> ChainBounds:
    """Bounds on the `count` lowest eigenvalues of every design, no more than the core has coordinates, as narrow as
    they come, or to `tolerance` relative in frequency; no more than `rigid` are zero.

    Nothing is proven for designs where a branch by itself is not much stiffer than what is asked for. Raises
    SolverError when a stiffness is singular inside a branch.
    """
    ritz, slowness = _ritz(arrow), arrow.core.slowness
    K, M, R, off = _projected(arrow, ritz)
    upper, Z, margin = upper_bounds(K, M, R, off, ritz.values, slowness)
    values, mass, more = (np.einsum("dii->di", _t(Z) @ A @ Z) for A in (K, M, R))
    least, mass = values - margin, np.where(mass > 0, mass, 1.0)
    values = np.where(np.isfinite(upper), values, np.inf)
    zero, upper = settled(values / mass, upper, margin, rigid)
    values = np.where(np.isfinite(upper), np.maximum(values / mass, 0.0), 0.0)
    guess = (least - values**2 / np.maximum(1 - values * slowness[:, None], CORRECTED) * more) / mass
    lower = np.zeros((len(K), count))
    core = ritz.core @ Z
    for attempt in attempts(values, guess, upper, tolerance):
        ell = attempt[:, :count]
        wanted = (lower == 0) & ~zero[:, :count] & (ell > 0) & (ell * slowness[:, None] < REACH)
        at = np.flatnonzero(wanted.any(axis=1))
        if len(at):
            proven = _fewer_than(arrow.take(at), np.where(wanted, ell, 0.0)[at], core[at])
            lower[at] = np.where(proven & wanted[at], ell[at], lower[at])
    return enclosed(lower, upper[:, :count], zero[:, :count], arrow.core.loss)


def _projected(arrow: Arrow, ritz: _Ritz) -> tuple[Array, Array, Array, Array]:
    """K, M and R on the Ritz vectors (designs, p, p), and what K and M have lost (designs, 2, p) as `lost` gives it."""
    found = []
    core = abs(ritz.core[:, None, None])
    for A, slack, X, size in (
        (arrow.core.A[:, :, None, None], arrow.core.slack[:, :, None, None], ritz.core[:, None, None], core),
        *(
            (block.A[:, :, :, None], block.slack[:, :, :, None], X, _sizes(block, X, core))
            for block, X in zip(arrow.blocks, ritz.branches, strict=True)
        ),
    ):
        Xt, branches = _t(X), X.shape[1] * X.shape[2]
        K, M, R = ((Xt @ (own @ X)).sum(axis=(1, 2)) for own in A)
        found.append((K, M, R, lost(A, slack, size, X.shape[-2] + branches).sum(axis=(1, 2))))
    K, M, R, off = (np.sum(own, axis=0) for own in zip(*found, strict=True))
    return K, M, R, off


def _sizes(block: Block, X: Array, core: Array) -> Array:
    """|X| (designs, q, r, n, p) of a block, but for its interface with all that cancels in what the core, of sizes
    `core` (designs, 1, 1, c, p), moves it by."""
    return np.concatenate([abs(X[..., : block.inside, :]), abs(block.T) @ core], axis=-2)


def _fewer_than(arrow: Arrow, ell: Array, V: Array) -> NDArray[np.bool_]:
    """Where (designs, j) fewer than j + 1 eigenvalues of the full order are proven to lie below ell (designs, j); V
    (designs, c, p) are the core's displacements in the lowest modes (theory eqs. N12-N14)."""
    core, c = arrow.core, arrow.core.A.shape[-1]
    h = ell**2 / (1 - ell * core.slowness[:, None]) * (1 + 1e-9)
    S, size, error = _dynamic(core.A, core.slack, ell, h)
    for block in arrow.blocks:
        T = block.T[:, None] if block.T.ndim > FIXED else block.T
        inner, a = _eliminated(block, ell, h)
        S = S + placed(inner, T)
        sizes = (_t(abs(T)) @ np.sqrt(a)[..., None, :, None])[..., 0] ** 2
        size = size + sizes.sum(axis=(-3, -2))
        error = error + (ROUNDING + T.shape[-4] * T.shape[-3] * EPS) * T.shape[-2] * sizes.sum(axis=(-3, -2))
    lifts = ell.shape[1] - 1
    for i in range(lifts):
        rest, v = S[:, i + 1 :], V[:, None, :, i]
        moved = np.einsum("djab,djb->dja", rest, np.broadcast_to(v, rest.shape[:-1]))
        energy = -(moved * v).sum(axis=-1)
        with np.errstate(divide="ignore"):
            moved = moved * np.sqrt(np.where(energy > 0, 2 / energy, 0.0))[..., None]
        rest += moved[..., :, None] * moved[..., None, :]
        size[:, i + 1 :] += moved**2
    np.einsum("djii->dji", S)[...] -= error + c * (c + 11 + lifts) * EPS / 2 * size
    return factors(S.reshape(-1, c, c))[1].reshape(ell.shape)


def _dynamic(A: Array, slack: Array, ell: Array, h: Array) -> tuple[Array, Array, Array]:
    """K - ell M - h R (designs, j, ..., n, n) of A (3, designs, ..., n, n); the sum of the sizes of its diagonals, and
    the error (designs, j, ..., n) that is left in it."""
    K, M, R = (own[:, None] for own in A)
    more = (1,) * (A.ndim - 4)
    ell, h = ell.reshape(*ell.shape, *more, 1), h.reshape(*h.shape, *more, 1)
    found = K - ell[..., None] * M
    found -= h[..., None] * R
    size = sum(f * np.einsum("...ii->...i", B) for f, B in ((1.0, K), (ell, M), (h, R)))
    error = slack[0][:, None] + ell * slack[1][:, None] + h * slack[2][:, None]
    return found, np.asarray(size), error


def _eliminated(block: Block, ell: Array, h: Array) -> tuple[Array, Array]:
    """S (designs, j, q, i, i), no more than what the branches add to their interfaces, NaN where their inside is not
    proven positive definite, and a (designs, j, q, i) with |S_ik| <= sqrt(a_i a_k)."""
    m, n = block.inside, block.A.shape[-1]
    B, size, error = _dynamic(block.A, block.slack, ell, h)
    # with the diagonal made larger at the interface one factorisation serves inside and interface
    inertia = np.einsum("...ii->...i", block.followed)[:, :, None]
    shift = np.zeros_like(size)
    shift[..., m:] = 4 * (n - m) * (ell[..., None, None] * inertia[1] + h[..., None, None] * inertia[2])
    np.einsum("...ii->...i", B)[...] += shift - error - n * (n + 11) * EPS / 2 * (size + shift)
    L = factors(B.reshape(-1, n, n))[0].reshape(B.shape)[..., m:, m:]
    S = L @ _t(L)
    a = np.einsum("...ii->...i", S) + shift[..., m:]
    np.einsum("...ii->...i", S)[...] -= shift[..., m:]
    return S, a
