"""Matrices written as coefficients (..., n) times a constant basis (n, rows*cols)."""

from collections.abc import Iterable, Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flexura.duals import with_slopes_of

FloatArray: TypeAlias = NDArray[np.float64]
Real: TypeAlias = float | FloatArray
Pattern: TypeAlias = Mapping[tuple[int, int], float]
SignedDofs: TypeAlias = tuple[tuple[int, int], ...]


def columns(*values: Real) -> FloatArray:
    """Broadcast n arrays (...) against each other and stack them on a new last axis: (..., n)."""
    like = with_slopes_of(*values)
    if like is None:
        out = np.empty((*np.broadcast(*values).shape, len(values)))
    else:
        out = np.empty((*np.broadcast_shapes(*map(np.shape, values)), len(values)), like=like)
    for i, value in enumerate(values):
        out[..., i] = value
    return out


def ordered(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The smaller and the larger of two; of equal ones either, for functions in which they may change places."""
    swapped = a > b
    return np.where(swapped, b, a), np.where(swapped, a, b)


def combine(coefficients: FloatArray, basis: FloatArray, rows: int) -> FloatArray:
    """Sum coefficients (..., n) times basis (n, rows*cols) in one matrix product: (..., rows, cols)."""
    flat = coefficients.reshape(-1, len(basis)) @ basis
    return flat.reshape(*coefficients.shape[:-1], rows, basis.shape[1] // rows)


def basis_of(size: int, terms: Iterable[tuple[SignedDofs, Pattern]]) -> FloatArray:
    """Lay out one row per term: its pattern {(i, j): value}, at the freedoms of i and j, with their signs.

    `terms` holds (freedoms, pattern) pairs; freedoms lists (dof, sign) of the pattern's local indices.
    Returns (number of terms, size*size), read-only.
    """
    rows = []
    for dofs, pattern in terms:
        matrix = np.zeros((size, size))
        for (i, j), value in pattern.items():
            (row, row_sign), (col, col_sign) = dofs[i], dofs[j]
            matrix[row, col] = row_sign * col_sign * value
        rows.append(matrix.ravel())
    basis = np.array(rows)
    basis.flags.writeable = False
    return basis


def symmetric(pattern: Pattern) -> Pattern:
    """Complete a pattern given by its upper triangle."""
    return {**pattern, **{(j, i): value for (i, j), value in pattern.items()}}
