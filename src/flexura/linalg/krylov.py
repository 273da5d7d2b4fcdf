"""The lowest eigenpairs of a sparse pencil of some thousand unknowns by block Lanczos.

Blocks lose no copies of a repeated eigenvalue as long as they are wider than there are copies (Golub and Underwood
1977), and cost a call of each routine a block, where single vectors cost one a vector.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.deadline import checkpoint

LANCZOS_BLOCKS = 8
"""Blocks after which the search is given up."""

LANCZOS_RESIDUAL = 1e-9
"""Residual of a pair of the inverse problem, over its value; what is left of it goes into the vectors (one more
inverse iteration), and Ritz vectors are mixed with one another by its square alone."""


def lowest_by_blocks(
    solve: Callable[[Array], Array], M: Any, count: int, guard: int, gap: float
) -> tuple[int, Array, Array] | None:
    """The `count` lowest pairs of K x = lambda M x, M-orthonormal, and up to `guard - 1` that follow without a relative
    gap wider than `gap`: how many these are, their values and those of others above, and their vectors (n, k).

    `solve` gives K^-1 b for b (n, k), K positive definite. None where they do not settle, or more follow.
    """
    n, width = M.shape[0], count + guard
    V, MV = (np.empty((n, width * LANCZOS_BLOCKS), order="F") for _ in range(2))
    T = np.zeros((width * LANCZOS_BLOCKS, width * LANCZOS_BLOCKS))
    block = solve(M @ _start(n, width))
    moved = M @ block
    for size in range(width, len(T) + 1, width):
        checkpoint()
        last, before = slice(size - width, size), size - width
        orthonormal = _orthonormalised(block, moved, M, V[:, :before], MV[:, :before])
        if orthonormal is None:
            return None
        V[:, last], MV[:, last] = orthonormal
        block = solve(orthonormal[1])
        T[:size, last] = MV[:, :size].T @ block
        T[last, :size] = T[:size, last].T
        block -= V[:, :size] @ T[:size, last]
        moved = M @ block
        mu, y = np.linalg.eigh(T[:size, :size])
        mu, y = mu[: -width - 1 : -1], y[:, : -width - 1 : -1]
        near = mu[count:] >= (1 - gap) * mu[count - 1 : -1]
        stop = count + (guard if near.all() else int(np.argmin(near)))
        left = block @ y[-width:, :stop]
        residual = np.sqrt((left * (moved @ y[-width:, :stop])).sum(axis=0).clip(0.0))
        if stop < width and (residual <= LANCZOS_RESIDUAL * mu[:stop]).all():
            return stop, 1 / mu, V[:, :size] @ y[:, :stop] + left / mu[:stop]
    return None


@lru_cache(maxsize=4)
def _start(n: int, width: int) -> Array:
    """Vectors (n, width) with something of everything in them, the same each time."""
    return np.random.default_rng(0).standard_normal((n, width))


def _orthonormalised(block: Array, moved: Array, M: Any, V: Array, MV: Array) -> tuple[Array, Array] | None:
    """M-orthonormal Q (n, b), M-orthogonal to V (n, k), and M Q, that span what a block does which is M-orthogonal to V
    but for round-off, `moved` M times the block; None where it has fewer than b directions of its own."""
    for k in range(2):
        if k:
            block = block - V @ (MV.T @ block)
            moved = M @ block
        gram = block.T @ moved
        size = np.sqrt(np.diagonal(gram))
        if not (size > 0).all():
            return None
        try:
            turn = np.linalg.inv(np.linalg.cholesky(gram / np.outer(size, size))).T / size[:, None]
        except np.linalg.LinAlgError:
            return None
        block, moved = block @ turn, moved @ turn
    return block, moved
