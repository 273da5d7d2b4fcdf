"""Proven intervals for many designs that are arrows of branches, and their Ritz values without a proof.

Of an arrow, the core moves and the branches follow, with their response to their own inertia; the inside of every
branch is eliminated by a Cholesky factorisation, once for all branches that are equal, and what is left is as small as
the core (theory eqs. N12-N14).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.kernels import Kernel, is_compiled, packed, scratch
from flexura.linalg import EPS, factors, small_pencils
from flexura.reduction.batch_bounds import (
    LOWER_REACH,
    RESPONSE_CORRECTED,
    ChainBounds,
    Projection,
    attempts,
    cholesky_rounding,
    enclosed,
    projection_errors,
    rigid_values,
    upper_bounds,
)
from flexura.reduction.branches import FIXED_MAP_AXES, PLACING_ROUNDING, Arrow, Block, placed

RESPONSE_TERMS = 4
"""How often the response of the branches to their own inertia is added to a Ritz vector."""

RESPONSE_SETTLED = 0.08
"""Largest ratio of the highest squared frequency asked for to the lowest of a branch by itself, bounded from below, at
which the series of responses ends below 1e-10."""

_eliminate = Kernel("branches_eliminated", "aaaaaaxxaaaaa")

_project = Kernel("branches_projected", "aaaaaaaaaaxaaaa")

_count = Kernel("core_has_fewer", "aaaaaaaaxaaa")


@dataclass(frozen=True)
class _Ritz:
    """Ritz vectors: `core` (designs, c, p) and for each block X (designs, q, r, n, p), inside and interface; squared
    frequencies `values` (designs, p)."""

    core: Array
    branches: list[Array]
    values: Array


def _ritz(arrow: Arrow) -> _Ritz:
    """Approximations of the lowest modes, as many as the core has coordinates: static shapes of the branches, and their
    response to inertia added as a series that ends after a few terms."""
    values, Z = _core_pairs(arrow)
    branches = []
    for block in arrow.blocks:
        m = block.inside
        lam = _reached(block, values)[:, None, None, None, :]
        ends = block.T @ Z[:, None, None]
        X = block.motion[:, :, None] @ ends
        inertia = block.A[1, ..., :m, :]
        response = (block.inverse @ (inertia @ block.motion))[:, :, None] @ ends * lam
        dynamic = block.inverse @ inertia[..., :m]
        X[..., :m, :] += response
        for _ in range(RESPONSE_TERMS - 1):
            response = dynamic[:, :, None] @ response * lam
            X[..., :m, :] += response
        branches.append(X)
    return _Ritz(Z, branches, values)


def _pieces(arrow: Arrow, ritz: _Ritz) -> Iterator[tuple[Array, Array, Array]]:
    """Of the core and of every block A (3, designs, q, r, n, n), its slack, and the Ritz vectors (designs, q, r, n, p)
    there, q kinds of r branches; both are one for the core."""
    yield arrow.core.A[:, :, None, None], arrow.core.slack[:, :, None, None], ritz.core[:, None, None]
    for block, X in zip(arrow.blocks, ritz.branches, strict=True):
        yield block.A[:, :, :, None], block.slack[:, :, :, None], X


def _projected_by_kernel(arrow: Arrow, ritz: tuple[Array, Array]) -> Projection:
    """K, M and R, or K and M alone, on the Ritz vectors that follow the core's of given values (designs, p) and
    displacements (designs, c, p)."""
    values, Z = ritz
    core, (designs, c, p) = arrow.core, Z.shape
    matrices = len(core.A)
    small, off = np.zeros((designs, matrices, p, p)), np.zeros((designs, 2, p))
    alone: tuple[Array, Array] | tuple[None, None] = core.A, core.slack
    for block in arrow.blocks:
        (q, n), r = block.A.shape[2:4], block.T.shape[-3]
        sizes = packed(designs, matrices, q, r, n, block.inside, c, p, block.step, RESPONSE_TERMS)
        wide = max(n, p)
        room = scratch((8 * n + r * c + 3) * n + (4 * n + c + 3 * p + 3) * p + 2 * n * wide + (3 * c + p + 3) * c)
        own = (block.A, block.slack, block.T, block.inverse, block.motion, block.slowness)
        arrays = [one if one is None else np.ascontiguousarray(one) for one in (*own, *alone, Z, values)]
        _project(*arrays, RESPONSE_CORRECTED, sizes, room, small, off)
        alone = None, None
    return Projection(small[:, 0], small[:, 1], small[:, -1], off)


def _reached(block: Block, values: Array) -> Array:
    """Values (designs, p) up to which the response of the branches of a block is a series that ends; nothing depends on
    whether these are the frequencies."""
    return np.minimum(values, (RESPONSE_CORRECTED / np.maximum(block.slowest, EPS**4))[:, None])


def _core_pairs(arrow: Arrow) -> tuple[Array, Array]:
    """Squared frequencies (designs, p) and displacements (designs, c, p) of the core with static branches."""
    values, Z = small_pencils(*arrow.followed)
    return np.maximum(values, 0.0), Z


def arrow_values(arrow: Arrow, count: int) -> tuple[Array, NDArray[np.bool_]]:
    """The `count` lowest eigenvalues (designs, count) of K and M, and for which designs (designs,) the response of the
    branches has settled."""
    if is_compiled():
        small = _projected_by_kernel(arrow, _core_pairs(arrow))
        K, M = small.K, small.M
    else:
        ritz = _ritz(arrow)
        pieces = [[(X.mT @ (matrix @ X)).sum(axis=(1, 2)) for matrix in A[:2]] for A, _, X in _pieces(arrow, ritz)]
        K, M = (np.sum(matrices, axis=0) for matrices in zip(*pieces, strict=True))
    values = np.maximum(small_pencils(K, M)[0][:, :count], 0.0)
    slowest = reduce(np.maximum, [block.slowest for block in arrow.blocks])
    known = np.isfinite(values[:, -1])
    return values, known & (np.where(known, values[:, -1], 0.0) * slowest < RESPONSE_SETTLED)


def arrow_bounds(arrow: Arrow, count: int, rigid: int, tolerance: float) -> ChainBounds:
    """Bounds on the `count` lowest eigenvalues of every design, no more than the core has coordinates, as narrow as
    they come, or to `tolerance` relative in frequency; no more than `rigid` are zero.

    Nothing is proven for designs where a branch by itself is not much stiffer than what is asked for. Raises
    SolverError when a stiffness is singular inside a branch.
    """
    slowness = arrow.core.slowness
    if is_compiled():
        values, core = _core_pairs(arrow)
        small = _projected_by_kernel(arrow, (values, core))
    else:
        ritz = _ritz(arrow)
        values, core, small = ritz.values, ritz.core, _projected_arrow(arrow, ritz)
    upper, best, Z, margin = upper_bounds(small, values, slowness)
    values, mass, more = (np.einsum("dii->di", Z.mT @ A @ Z) for A in (small.K, small.M, small.R))
    least, mass = values - margin, np.where(mass > 0, mass, 1.0)
    values = np.where(np.isfinite(upper), values, np.inf)
    zero, upper = rigid_values(values / mass, upper, margin, rigid)
    values = np.where(np.isfinite(upper), np.maximum(values / mass, 0.0), 0.0)
    guess = (least - values**2 / np.maximum(1 - values * slowness[:, None], RESPONSE_CORRECTED) * more) / mass
    lower = np.zeros((len(values), count))
    core = core @ Z
    for attempt in attempts(values, guess, upper, tolerance):
        ell = attempt[:, :count]
        wanted = (lower == 0) & ~zero[:, :count] & (ell > 0) & (ell * slowness[:, None] < LOWER_REACH)
        at = np.flatnonzero(wanted.any(axis=1))
        if len(at):
            proven = _arrow_has_fewer(arrow.take(at), np.where(wanted, ell, 0.0)[at], core[at])
            lower[at] = np.where(proven & wanted[at], ell[at], lower[at])
    return enclosed(lower, upper[:, :count], best[:, :count], zero[:, :count], arrow.core.loss)


def _projected_arrow(arrow: Arrow, ritz: _Ritz) -> Projection:
    core = abs(ritz.core[:, None, None])
    sizes = [core, *(_sizes(block, X, core) for block, X in zip(arrow.blocks, ritz.branches, strict=True))]
    sums = []
    for (A, slack, X), size in zip(_pieces(arrow, ritz), sizes, strict=True):
        off = projection_errors(A, slack, size, X.shape[-2] + X.shape[1] * X.shape[2])
        sums.append([*((X.mT @ (matrix @ X)).sum(axis=(1, 2)) for matrix in A), off.sum(axis=(1, 2))])
    return Projection(*(np.sum(pieces, axis=0) for pieces in zip(*sums, strict=True)))


def _sizes(block: Block, X: Array, core: Array) -> Array:
    """|X| (designs, q, r, n, p) of a block, but for its interface with all that cancels in what the core, of sizes
    `core` (designs, 1, 1, c, p), moves it by."""
    return np.concatenate([abs(X[..., : block.inside, :]), abs(block.T) @ core], axis=-2)


def _arrow_has_fewer(arrow: Arrow, ell: Array, V: Array) -> NDArray[np.bool_]:
    """Where (designs, j) fewer than j + 1 eigenvalues of the full order are proven to lie below ell (designs, j); V
    (designs, c, p) are the core's displacements in the lowest modes (theory eqs. N12-N14)."""
    if is_compiled():
        return _has_fewer_by_kernel(arrow, ell, V)
    core, c = arrow.core, arrow.core.A.shape[-1]
    h = ell**2 / (1 - ell * core.slowness[:, None]) * (1 + 1e-9)
    S, size, error = _dynamic(core.A, core.slack, ell, h)
    for block in arrow.blocks:
        T = block.T[:, None] if block.T.ndim > FIXED_MAP_AXES else block.T
        inner, a = _eliminated(block, ell, h)
        S = S + placed(inner, T)
        sizes = (abs(T).mT @ np.sqrt(a)[..., None, :, None])[..., 0] ** 2
        size = size + sizes.sum(axis=(-3, -2))
        error = error + (PLACING_ROUNDING + T.shape[-4] * T.shape[-3] * EPS) * T.shape[-2] * sizes.sum(axis=(-3, -2))
    lifts = ell.shape[1] - 1
    for i in range(lifts):
        rest, v = S[:, i + 1 :], V[:, None, :, i]
        moved = np.einsum("djab,djb->dja", rest, np.broadcast_to(v, rest.shape[:-1]))
        energy = -(moved * v).sum(axis=-1)
        with np.errstate(divide="ignore"):
            moved = moved * np.sqrt(np.where(energy > 0, 2 / energy, 0.0))[..., None]
        rest += moved[..., :, None] * moved[..., None, :]
        size[:, i + 1 :] += moved**2
    np.einsum("djii->dji", S)[...] -= error + cholesky_rounding(c, lifts) * size
    return factors(S.reshape(-1, c, c))[1].reshape(ell.shape)


def _has_fewer_by_kernel(arrow: Arrow, ell: Array, V: Array) -> NDArray[np.bool_]:
    """The same by kernels."""
    core, (designs, count), (c, p) = arrow.core, ell.shape, V.shape[-2:]
    S, sums = np.zeros((designs, count, c, c)), np.zeros((2, designs, count, c))
    ell, slowness = np.ascontiguousarray(ell), np.ascontiguousarray(core.slowness)
    for block in arrow.blocks:
        (q, n), r, i = block.A.shape[2:4], block.T.shape[-3], block.T.shape[-2]
        sizes = packed(designs, count, q, r, n, block.inside, c, block.step)
        room = scratch(4 * n * (n + 2) + r * i * c + 3 * i * (i + c + 2) + c * (c + 1))
        arrays = (np.ascontiguousarray(A) for A in (block.A, block.slack, block.T, block.followed))
        rounding = PLACING_ROUNDING, cholesky_rounding(n)
        _eliminate(*arrays, ell, slowness, *rounding, sizes, room, S, sums[0], sums[1])
    proven = np.empty((designs, count), dtype=np.int64)
    arrays = (np.ascontiguousarray(A) for A in (core.A, core.slack, V))
    sizes, room = packed(designs, count, c, p), scratch(5 * c * (c + 2) + c * p)
    _count(*arrays, ell, slowness, S, sums[0], sums[1], cholesky_rounding(c, count - 1), sizes, room, proven)
    return proven.astype(bool)


def _dynamic(A: Array, slack: Array, ell: Array, h: Array) -> tuple[Array, Array, Array]:
    """K - ell M - h R (designs, j, ..., n, n) of A (3, designs, ..., n, n); the sum of the sizes of its diagonals, and
    the error (designs, j, ..., n) that is left in it."""
    K, M, R = (matrix[:, None] for matrix in A)
    more = (1,) * (A.ndim - 4)
    ell, h = ell.reshape(*ell.shape, *more, 1), h.reshape(*h.shape, *more, 1)
    dynamic = K - ell[..., None] * M
    dynamic -= h[..., None] * R
    size = sum(f * np.einsum("...ii->...i", B) for f, B in ((1.0, K), (ell, M), (h, R)))
    error = slack[0][:, None] + ell * slack[1][:, None] + h * slack[2][:, None]
    return dynamic, np.asarray(size), error


def _eliminated(block: Block, ell: Array, h: Array) -> tuple[Array, Array]:
    """S (designs, j, q, i, i), no more than what the branches add to their interfaces, NaN where their inside is not
    proven positive definite, and a (designs, j, q, i) with |S_ik| <= sqrt(a_i a_k)."""
    m, n = block.inside, block.A.shape[-1]
    B, size, error = _dynamic(block.A, block.slack, ell, h)
    # with the diagonal made larger at the interface one factorisation serves inside and interface
    inertia = np.einsum("...ii->...i", block.followed)[:, :, None]
    shift = np.zeros_like(size)
    shift[..., m:] = 4 * (n - m) * (ell[..., None, None] * inertia[1] + h[..., None, None] * inertia[2])
    np.einsum("...ii->...i", B)[...] += shift - error - cholesky_rounding(n) * (size + shift)
    L = factors(B.reshape(-1, n, n))[0].reshape(B.shape)[..., m:, m:]
    S = L @ L.mT
    a = np.einsum("...ii->...i", S) + shift[..., m:]
    np.einsum("...ii->...i", S)[...] -= shift[..., m:]
    return S, a
