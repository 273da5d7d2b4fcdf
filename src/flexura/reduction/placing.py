"""Matrices of chains and discrete elements at their places, summed over many designs, and what that may be off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.kernels import Kernel, Struct, address, is_compiled, packed, scratch
from flexura.reduction.branches import PLACING_ROUNDING
from flexura.structure import DiscreteElement

_compiled = Kernel("placed_sums", "aaaaaaxaaaa")

MAP_AXES = 3
"""Axes of maps that are the same for all designs."""


@dataclass(frozen=True)
class Places:
    """Where some of c matrices (n, n) go: `which` (p,) stands at each place, and the maps L (..., p, n, n) there, with
    the size |L| of these before digits cancel."""

    which: Index
    L: Array
    size: Array

    @cached_property
    def at(self) -> Struct:
        """The same for kernels."""
        which, L, size = np.ascontiguousarray(self.which), *map(np.ascontiguousarray, (self.L, self.size))
        p, n, _ = L.shape[-3:]
        return Struct(which, L, size, p, n, L[0].size if L.ndim > MAP_AXES and len(L) > 1 else 0)


class Part(NamedTuple):
    """Matrices A (r, designs, c, n, n), and their places."""

    A: Array
    places: Places


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


class Targets:
    """Where entries and rows of all parts, one behind the other, go in sums and spreads of so many `held`, the last of
    which take what is held; given piece by piece, for entries (p, n, n) and rows (p, n) of p places each."""

    def __init__(self, entries: Sequence[Index], rows: Sequence[Index], held: tuple[int, int]) -> None:
        none = np.empty(0, dtype=np.intp)
        self.entries: Index = np.concatenate([none, *map(np.ravel, entries)])
        self.rows: Index = np.concatenate([none, *map(np.ravel, rows)])
        self.held: tuple[int, int] = held
        shapes = [own.shape for own in rows]
        self.largest: int = max((n for _, n in shapes), default=0)
        """Largest n."""
        self.maps: int = sum(2 * p * n * n for p, n in shapes)
        """Entries of all L and |L|."""
        self.columns: int = sum(2 * p * (n + 1) ** 2 for p, n in shapes)
        """Numbers that say where entries of these are not zero."""


def placed_sums(
    parts: Sequence[Part], to: Targets, lead: tuple[int, int], *, with_spreads: bool
) -> tuple[Array, Array]:
    """Sums (r, designs, entries) of L' A L of all parts at their targets, and what these may be off (r, designs, rows);
    nothing (0, designs, rows) without `with_spreads`. `lead` are r and designs."""
    sums = np.zeros((*lead, to.held[0]))
    spreads = np.zeros((lead[0] if with_spreads else 0, lead[1], to.held[1]))
    if is_compiled():
        _by_kernel(parts, to, sums, spreads)
        return sums, spreads
    entry = row = 0
    for part in parts:
        which, L, size = part.places.which, part.places.L, part.places.size
        p, n, _ = L.shape[-3:]
        A = part.A[:, :, which]
        _add_at(sums, to.entries[entry : entry + p * n * n], L.mT @ A @ L)
        if with_spreads:
            _add_at(spreads, to.rows[row : row + p * n], placing_error(A, size))
        entry, row = entry + p * n * n, row + p * n
    return sums, spreads


def _add_at(sums: Array, target: Index, data: Array) -> None:
    """Add data (r, designs, ...) at their targets in sums (r, designs, n)."""
    r, designs, n = sums.shape
    at = (np.arange(r * designs)[:, None] * n + target).ravel()
    sums += np.bincount(at, weights=data.ravel(), minlength=sums.size).reshape(sums.shape)


def _by_kernel(parts: Sequence[Part], to: Targets, sums: Array, spreads: Array) -> None:
    """The same by the kernel."""
    A = [np.ascontiguousarray(part.A) for part in parts]
    _compiled(
        packed(*map(address, A)),
        packed(*(len(own[0, 0]) for own in A)),
        packed(*(part.places.at.address for part in parts)),
        to.entries,
        to.rows,
        packed(len(parts), *sums.shape, spreads.shape[-1], to.largest),
        PLACING_ROUNDING if len(spreads) else 0.0,
        scratch(to.largest * (2 * to.largest + 1) + sum(to.held) + to.maps),
        np.empty(to.columns, dtype=np.int64),
        sums,
        spreads,
    )
