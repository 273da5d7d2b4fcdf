"""Summing many small dense matrices into one large one, with the index work done once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.sizes import within
from flexura.structure.value_table import Index


class Scatter:
    """A fixed pattern of small square matrices, `symmetric` unless said otherwise, at given DOFs; DOF -1 is dropped.

    `dofs` lists index arrays, each (k, m): k matrices of m rows.
    """

    def __init__(self, dofs: Sequence[Index], n: int, *, symmetric: bool = True) -> None:
        self.n = n
        self.symmetric = symmetric
        key = np.concatenate([np.empty(0, dtype=np.intp), *(_keys(d, n) for d in dofs)])
        self._length = len(key)
        taken = key >= 0
        self._take = None if taken.all() else np.flatnonzero(taken)
        key = key if self._take is None else key[self._take]
        unique, self._inverse = np.unique(key, return_inverse=True)
        self._unique = unique
        self._indices = (unique % n).astype(np.int32)
        self._indptr = np.searchsorted(unique, np.arange(n + 1) * n).astype(np.int32)
        self._mirror = np.searchsorted(unique, unique % n * n + unique // n)
        whole = len(key) == n * n and self._take is None
        self._is_identity = whole and np.array_equal(key.reshape(n, n).T.ravel(), np.arange(n * n))
        self._dense_targets: dict[int, Index] = {}

    def sparse(self, matrices: Sequence[Array], start: Array | None = None) -> sp.csc_matrix:
        """Sum matrices, one array (..., m, m) per entry of `dofs`, into a sparse (n, n), symmetric ones exactly so.

        With `start`, the values that `linear` yields for the first entries of `dofs`, only the others are given.
        """
        data = np.concatenate([np.zeros(0), *(m.ravel() for m in matrices)])
        place = self._target[self._length - len(data) :]
        if start is None:
            summed = np.bincount(place, weights=data, minlength=len(self._unique) + 1)[:-1]
        else:
            summed = start.copy()
            kept = place < len(summed)
            np.add.at(summed, place[kept], data[kept])
        if self.symmetric:
            summed = (summed + summed[self._mirror]) / 2
        # arrays of its own: whoever holds the matrix may change its pattern
        return sp.csc_matrix((summed, self._indices.copy(), self._indptr.copy()), shape=(self.n, self.n))

    def linear(self, bases: Sequence[Array]) -> sp.csr_matrix:
        """The map from element coefficients to the stored values of `sparse`, for the first entries of `dofs`.

        `bases` holds (copies, elements, coefficients, m, m) per entry: what a unit of each coefficient adds.
        The coefficients (elements of all entries * coefficients) are shared by the copies.
        """
        rows, columns, values = [], [], []
        at, first, place = 0, 0, self._target
        for basis in bases:
            copies, elements, k, m, _ = basis.shape
            entries = copies * elements * m * m
            row = place[at : at + entries].reshape(copies, elements, 1, m, m)
            column = first + np.arange(elements * k).reshape(1, elements, k, 1, 1)
            size = np.abs(basis).max(axis=(0, 1, 3, 4), keepdims=True, initial=0.0)
            keep = (np.abs(basis) > 1e-15 * size) & (row < len(self._unique))
            rows.append(np.broadcast_to(row, basis.shape)[keep])
            columns.append(np.broadcast_to(column, basis.shape)[keep])
            values.append(basis[keep])
            at, first = at + entries, first + elements * k
        where = (np.concatenate(rows), np.concatenate(columns))
        return sp.csr_matrix((np.concatenate(values), where), shape=(len(self._unique), first))

    @cached_property
    def _target(self) -> Index:
        """For every entry its position among the stored values; one past the last for those dropped."""
        if self._take is None:
            return self._inverse
        place = np.full(self._length, len(self._unique))
        place[self._take] = self._inverse
        return place

    def dense(self, matrices: Sequence[Any], lead: tuple[int, ...] = ()) -> Any:
        """Sum matrices, one array (*lead, k, m, m) per entry of `dofs`, into dense (*lead, n, n)."""
        n = self.n
        within("dense_entries", n * n, f"a full matrix of order {n}")
        if any(np.iscomplexobj(m) for m in matrices):
            real, imaginary = (self.dense([part(m) for m in matrices], lead) for part in (np.real, np.imag))
            return real + 1j * imaginary
        if self._is_identity:
            only = matrices[0][..., 0, :, :]
            return only if only.shape[:-2] == lead else np.broadcast_to(only, (*lead, n, n))
        designs, size = math.prod(lead), n * n + 1
        data = np.empty((designs, self._length))
        at = 0
        for m in matrices:
            entries = math.prod(m.shape[-3:])
            data[:, at : at + entries] = np.broadcast_to(m, (*lead, *m.shape[-3:])).reshape(designs, entries)
            at += entries
        summed = np.bincount(self._dense_target(designs), weights=data.ravel(), minlength=designs * size)
        whole = summed.astype(float, copy=False).reshape(designs, size)[:, :-1].reshape(*lead, n, n)
        return whole if self.symmetric else np.swapaxes(whole, -1, -2)  # columns were summed as rows

    def _dense_target(self, designs: int) -> Index:
        """Where the entries of so many designs go in stacked matrices, each one longer to take what is dropped."""
        if designs not in self._dense_targets:
            place = np.append(self._unique, self.n**2)[self._target]
            self._dense_targets[designs] = (np.arange(designs)[:, None] * (self.n**2 + 1) + place).ravel()
        return self._dense_targets[designs]


def _keys(dofs: Index, n: int) -> Index:
    """Column times n plus row of every entry (k m m,) of matrices at DOFs (k, m), -1 where one of both is dropped."""
    row, column = dofs[:, :, None], dofs[:, None, :]
    return np.where((row >= 0) & (column >= 0), column * n + row, -1).ravel()


def node_dofs(nodes: Any) -> Index:
    """Numbers (..., 6k) of the displacements of nodes (..., k), six each in their order."""
    at = np.asarray(nodes, dtype=np.intp)
    return (6 * at[..., None] + np.arange(6)).reshape(*at.shape[:-1], 6 * at.shape[-1])


def block_diagonal(blocks: Array) -> Array:
    """Blocks (..., k, 6, 6) on the diagonal of (..., 6k, 6k)."""
    k = blocks.shape[-3]
    out = np.zeros((*blocks.shape[:-3], 6 * k, 6 * k), like=blocks)
    for i in range(k):
        out[..., 6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = blocks[..., i, :, :]
    return out
