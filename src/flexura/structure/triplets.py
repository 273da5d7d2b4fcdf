"""Sparse matrices from stacks of small dense blocks, square or not."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.structure.value_table import Index


class Triplets:
    """Entries of a sparse matrix of given shape; equal places are summed, rows and columns below zero dropped."""

    def __init__(self, rows: int, columns: int) -> None:
        self.shape: tuple[int, int] = (rows, columns)
        self._rows: list[Index] = []
        self._columns: list[Index] = []
        self._values: list[Array] = []

    def add(self, rows: Index, columns: Index, blocks: Array) -> None:
        """Add blocks (..., r, c) at rows (..., r) and columns (..., c)."""
        row = np.broadcast_to(rows[..., :, None], blocks.shape)
        column = np.broadcast_to(columns[..., None, :], blocks.shape)
        taken = (row >= 0) & (column >= 0) & (blocks != 0)
        self._rows.append(row[taken])
        self._columns.append(column[taken])
        self._values.append(blocks[taken])

    def matrix(self) -> sp.csc_matrix:
        """The sum."""
        rows = np.concatenate([np.empty(0, dtype=np.intp), *self._rows])
        columns = np.concatenate([np.empty(0, dtype=np.intp), *self._columns])
        return sp.csc_matrix((np.concatenate([np.empty(0), *self._values]), (rows, columns)), shape=self.shape)
