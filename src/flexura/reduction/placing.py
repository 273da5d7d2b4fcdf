"""Matrices of chains and discrete elements at their places, summed over many designs, and what that may be off."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.kernels import Kernel, is_compiled, packed, scratch
from flexura.reduction.branches import PLACING_ROUNDING
from flexura.structure import DiscreteElement

_compiled = Kernel("placed_sums", "aaaaaaaxaaaa")


class Part(NamedTuple):
    """Matrices A (r, designs, c, n, n), which (p,) of the c stands at each place, and the maps L (..., p, n, n) there,
    with the size |L| of these before digits cancel."""

    A: Array
    which: Index
    L: Array
    size: Array


def copies_in_a_row(A: Array) -> Array:
    """(..., copies, c, n, n) as (..., copies c, n, n)."""
    return A.reshape(*A.shape[:-4], A.shape[-4] * A.shape[-3], *A.shape[-2:])


def bordered(L: Array, kept: int) -> Array:
    """Maps (..., 12, 12) with an identity for so many kept motions."""
    if not kept:
        return L
    wide = np.zeros((*L.shape[:-2], 12 + kept, 12 + kept))
    wide[..., :12, :12] = L
    wide[..., np.arange(12, 12 + kept), np.arange(12, 12 + kept)] = 1.0
    return wide


def stacked(element: DiscreteElement, designs: int) -> Array:
    """K, M and R (3, designs, 1, m, m) of a discrete element."""
    m = 6 * len(element.nodes)
    A = np.zeros((3, designs, 1, m, m))
    for out, matrix in zip(A, (element.K, element.M), strict=False):
        if matrix is not None:
            out[:, 0] = matrix
    return A


def placing_error(A: Array, size: Array) -> Array:
    """Diagonals (3, designs, p, n) that bound the error of placing A by the map |L| (..., p, n, n) (theory eq. N10)."""
    roots = np.sqrt(abs(np.einsum("...ii->...i", A)))
    s = size.mT @ roots[..., None]
    return np.asarray(PLACING_ROUNDING * A.shape[-1] * s[..., 0] ** 2)


def add_placed(part: Part, entries: Index, rows: Index, sums: Array, spreads: Array) -> None:
    """Add L' A L of a part to the `sums` (r, designs, entries) at its targets, and what it may be off to `spreads`
    (r, designs, rows)."""
    if is_compiled():
        _by_kernel(part, entries, rows, sums, spreads)
        return
    A = part.A[:, :, part.which]
    _add_at(sums, entries, part.L.mT @ A @ part.L)
    if len(spreads):
        _add_at(spreads, rows, placing_error(A, part.size))


def _add_at(sums: Array, target: Index, data: Array) -> None:
    """Add data (r, designs, ...) at their targets in sums (r, designs, n)."""
    r, designs, n = sums.shape
    at = (np.arange(r * designs)[:, None] * n + target).ravel()
    sums += np.bincount(at, weights=data.ravel(), minlength=sums.size).reshape(sums.shape)


def _by_kernel(part: Part, entries: Index, rows: Index, sums: Array, spreads: Array) -> None:
    """The same by the kernel."""
    r, designs, c, n, _ = part.A.shape
    p, step = len(part.which), part.L[0].size if part.L.ndim > 3 and len(part.L) > 1 else 0
    entries_held = sums.shape[-1], spreads.shape[-1]
    sizes = packed(r, designs, c, p, n, step, *entries_held)
    _compiled(
        np.ascontiguousarray(part.A),
        np.ascontiguousarray(part.which),
        np.ascontiguousarray(part.L),
        np.ascontiguousarray(part.size),
        entries,
        rows,
        sizes,
        PLACING_ROUNDING if len(spreads) else 0.0,
        scratch((2 * p + 2) * n * n + n + sum(entries_held)),
        np.empty(2 * p * (n + 1) ** 2, dtype=np.int64),
        sums,
        spreads,
    )
