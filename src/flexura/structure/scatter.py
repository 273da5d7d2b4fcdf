"""Summing many small dense matrices into one large one, with the index work done once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.structure.slots import Index

Array = NDArray[np.float64]


class Scatter:
    """A fixed pattern of small square matrices at given DOFs; DOF -1 is dropped.

    `dofs` lists index arrays, each (k, m): k matrices of m rows.
    """

    def __init__(self, dofs: Sequence[Index], n: int) -> None:
        self.n = n
        rows = [np.repeat(d, d.shape[1], axis=1).ravel() for d in dofs]
        columns = [np.tile(d, (1, d.shape[1])).ravel() for d in dofs]
        row = np.concatenate([np.empty(0, dtype=np.intp), *rows])
        column = np.concatenate([np.empty(0, dtype=np.intp), *columns])
        self._take = np.flatnonzero((row >= 0) & (column >= 0))
        self._all_taken = len(self._take) == len(row)
        key = column[self._take] * n + row[self._take]
        unique, self._inverse = np.unique(key, return_inverse=True)
        self._unique = unique
        self._indices = (unique % n).astype(np.int32)
        self._indptr = np.searchsorted(unique, np.arange(n + 1) * n).astype(np.int32)
        self._sum: sp.csr_matrix | None = None

    def sparse(self, matrices: Sequence[Array]) -> sp.csc_matrix:
        """Sum matrices, one array (k, m, m) per entry of `dofs`, into a sparse (n, n)."""
        data = self._gather(matrices, ())
        summed = np.bincount(self._inverse, weights=data, minlength=len(self._unique))
        return sp.csc_matrix((summed, self._indices, self._indptr), shape=(self.n, self.n))

    def dense(self, matrices: Sequence[Array], lead: tuple[int, ...] = ()) -> Array:
        """Sum matrices, one array (*lead, k, m, m) per entry of `dofs`, into dense (*lead, n, n)."""
        data = self._gather(matrices, lead)
        out = np.zeros((*lead, self.n * self.n))
        if not lead:
            out[self._unique] = np.bincount(self._inverse, weights=data, minlength=len(self._unique))
        else:
            if self._sum is None:
                ones = np.ones(len(self._inverse))
                where = (self._inverse, np.arange(len(self._inverse)))
                self._sum = sp.csr_matrix((ones, where), shape=(len(self._unique), len(ones)))
            flat = np.ascontiguousarray(data.reshape(-1, data.shape[-1]).T)
            out.reshape(-1, self.n * self.n)[:, self._unique] = (self._sum @ flat).T
        return np.swapaxes(out.reshape(*lead, self.n, self.n), -1, -2)

    def _gather(self, matrices: Sequence[Array], lead: tuple[int, ...]) -> Array:
        flat = [np.broadcast_to(m, (*lead, *m.shape[-3:])).reshape(*lead, -1) for m in matrices]
        data = np.concatenate(flat, axis=-1) if flat else np.zeros((*lead, 0))
        return data if self._all_taken else data[..., self._take]
