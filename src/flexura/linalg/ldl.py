"""Factors L D L' of sparse symmetric matrices that fill little, by a kernel: chains of beams do.

What a pattern needs is worked out once and kept for the next matrix with the same one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Bools, Index
from flexura.kernels import Kernel, address

MOST_ROWS, MOST_WORK = 20_000, 2e7
"""Rows that hang together beside hubs, and products of entries of L, up to which its columns one by one are quicker
than blocks of them."""

HUB = 10
"""Entries in a row over the root of their number from which it is a hub, whose order costs more than it saves."""

MOST_FILLED = 40
"""Entries in a row, on average, from which a pattern is that of a solid, whose factors are not sparse."""

KEPT_PATTERNS = 16
"""Patterns that are kept."""

NEARLY_SYMMETRIC = 1e-12
"""Largest difference of an entry and the one across, beside a diagonal of ones, that counts as round-off."""

_tree = Kernel("ldl_tree", "naaaaa")
_upper = Kernel("ldl_upper", "naaaaaaaxa")
_factor = Kernel("ldl_factor", "naaaaaaaaaaaa")
_solve = Kernel("ldl_solve", "nnaaaaaaaa")
_sizes = Kernel("ldl_sizes", "naaaaaaa")


@dataclass(frozen=True)
class Symbolic:
    """Factors of a pattern before there are numbers; their row k is row `order[k]`.

    The upper triangle in that order has the entries `take` of the matrix, by columns from `start[k]`, in rows `rows`,
    and those `across` on the other side. L has the entries from `first[k]` in column k, and the elimination tree
    `parent`.
    """

    across: Index
    order: Index
    take: Index
    start: Index
    rows: Index
    parent: Index
    first: Index


@dataclass(frozen=True)
class Pattern:
    """Where a matrix has entries, `indptr` and `indices` by columns, and its symbolic factors; None where it is not
    symmetric or fills too much."""

    indptr: Any
    indices: Any
    symbolic: Symbolic | None

    def fits(self, A: sp.csc_matrix) -> bool:
        """Whether a matrix has its entries in the same places."""
        own = self.indices, self.indptr
        return all(np.array_equal(mine, other) for mine, other in zip(own, (A.indices, A.indptr), strict=True))


def _symbolic(A: sp.csc_matrix) -> Symbolic | None:
    """Those of a matrix (n, n) whose entries are in order."""
    n = A.shape[0]
    is_hub = np.diff(A.indptr) > HUB * np.sqrt(n)
    if A.nnz > MOST_FILLED * n or _largest_piece(A, is_hub) > MOST_ROWS:
        return None
    column, row = np.repeat(np.arange(n), np.diff(A.indptr)), A.indices.astype(np.intp)
    across = np.lexsort((column, row))
    if not (np.array_equal(row[across], column) and np.array_equal(column[across], row)):
        return None
    place = _places(A, is_hub)
    i, k = place[row], place[column]
    take = np.flatnonzero(i <= k)
    take = take[np.lexsort((i[take], k[take]))]
    start, rows = np.searchsorted(k[take], np.arange(n + 1)), np.ascontiguousarray(i[take])
    parent, count, seen = np.empty((3, n), dtype=np.intp)
    _tree(n, start, rows, parent, count, seen)
    if float(np.square(count, dtype=float).sum()) > MOST_WORK:
        return None
    first = np.append(0, np.cumsum(count))
    return Symbolic(across[take], np.argsort(place), take, start, rows, parent, first)


def _largest_piece(A: sp.csc_matrix, is_hub: Bools) -> int:
    """How many rows hang together where hubs (n,) are taken out, or no more than there are."""
    if len(is_hub) <= MOST_ROWS or not is_hub.any():
        return len(is_hub)
    rest = np.flatnonzero(~is_hub)
    return int(np.bincount(connected_components(A[:, rest].tocsr()[rest], directed=False)[1], minlength=1).max())


def _places(A: sp.csc_matrix, is_hub: Bools) -> Index:
    """Where rows (n,) come in SuperLU's order of least degree, by a matrix with the same entries and sure pivots; hubs
    come last, as in Amestoy, Davis and Duff (1996)."""
    n = A.shape[0]
    like = sp.csc_matrix((np.full(A.nnz, 1 / (2 * A.nnz)), A.indices, A.indptr), A.shape) + sp.identity(n)
    rest, places = np.flatnonzero(~is_hub), np.empty(n, dtype=np.intp)
    own = like.tocsc() if len(rest) == n else like.tocsr()[rest].tocsc()[:, rest]
    lu = spla.splu(own, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    places[rest], places[is_hub] = lu.perm_c, np.arange(len(rest), n)
    return places


@dataclass(frozen=True)
class Factors:
    """L, with its entries `below` a diagonal of ones, and D (n,) of a matrix."""

    by: Symbolic
    below: Index
    L: Array
    D: Array

    @staticmethod
    def of(A: sp.csc_matrix, scale: Array) -> Factors | None:
        """Of D A D for a matrix (n, n) and D = diag(scale), with a diagonal about one; None where it is not symmetric,
        its factors are not sparse, or a pivot is zero."""
        if not (A.has_sorted_indices and A.data.all()):
            A = A.copy()
            A.eliminate_zeros()
            A.sort_indices()
        by = _kept.of(A).symbolic
        if by is None:
            return None
        n, upper, data = A.shape[0], np.empty(len(by.take)), np.ascontiguousarray(A.data, dtype=float)
        if not _upper(n, by.order, by.start, by.rows, by.take, by.across, data, scale, NEARLY_SYMMETRIC, upper):
            return None
        L, D, y = np.empty(by.first[-1]), np.empty(n), np.empty(n)
        below, scratch = np.empty(len(L), dtype=np.intp), np.empty((3, n), dtype=np.intp)
        done = _factor(n, by.start, by.rows, upper, by.parent, by.first, below, L, D, *scratch, y)
        return Factors(by, below, L, D) if done == n else None

    def solve(self, b: Array) -> Array:
        """A^-1 b for b (n,) or (n, m)."""
        b = np.ascontiguousarray(b, dtype=float)
        x = np.empty(b.shape)
        columns = 1 if b.ndim == 1 else b.shape[1]
        _solve(len(b), columns, *self._arrays, b, x, np.empty(b.shape))
        return x

    def sizes(self) -> Array:
        """Row sums (n,) of |L| |D| |L'|."""
        out = np.empty(len(self.D))
        _sizes(len(out), *self._arrays, out, np.empty(len(out)))
        return out

    @cached_property
    def _arrays(self) -> list[int]:
        own = self.by.order, self.by.first, self.below, self.L, self.D
        return [address(array) for array in own]


class _Kept:
    """The patterns of the last matrices."""

    def __init__(self) -> None:
        self._patterns: tuple[Pattern, ...] = ()

    def of(self, A: sp.csc_matrix) -> Pattern:
        """That of a matrix whose entries are in order."""
        found = next((pattern for pattern in self._patterns if pattern.fits(A)), None)
        if found is None:
            found = Pattern(A.indptr, A.indices, _symbolic(A))
        if not self._patterns or found is not self._patterns[0]:
            others = [pattern for pattern in self._patterns if pattern is not found]
            self._patterns = (found, *others[: KEPT_PATTERNS - 1])
        return found


_kept = _Kept()
