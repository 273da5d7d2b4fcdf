"""Derivatives of products and of what solves linear equations."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexura.duals.pairs import Pair, padded, plus

LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"


def matmul(a: Pair, b: Pair) -> Pair:
    """a @ b, of matrices, stacks of them, and vectors."""
    if np.ndim(a.value) == 1 or np.ndim(b.value) == 1:
        return _with_vector(a, b)
    value = a.value @ b.value
    n = value.ndim
    first = None if a.slope is None else padded(a.slope, n) @ b.value
    second = None if b.slope is None else a.value @ padded(b.slope, n)
    return Pair(value, plus(first, second))


def _with_vector(a: Pair, b: Pair) -> Pair:
    row, column = np.ndim(a.value) == 1, np.ndim(b.value) == 1
    if row:
        a = Pair(a.value[None, :], None if a.slope is None else a.slope[:, None, :])
    if column:
        b = Pair(b.value[:, None], None if b.slope is None else b.slope[:, :, None])
    value, slope = matmul(a, b)
    if column:
        value, slope = value[..., 0], slope[..., 0]
    return Pair(value[..., 0], slope[..., 0]) if row and column else _without_row(value, slope, row)


def _without_row(value: Any, slope: Any, row: bool) -> Pair:
    return Pair(value[..., 0, :], slope[..., 0, :]) if row else Pair(value, slope)


def einsum(subscripts: str, *operands: Pair) -> Pair:
    """Sums of products in index notation, the result's indices written out. Raises TypeError where they are not."""
    inputs, arrow, output = subscripts.replace(" ", "").partition("->")
    if not arrow:
        raise TypeError("einsum of numbers with slopes names the indices of its result, as in 'ij,j->i'")
    terms = inputs.split(",")
    p = next(letter for letter in LETTERS if letter not in inputs)
    values = [x.value for x in operands]
    slope = None
    for k, x in enumerate(operands):
        if x.slope is not None:
            own = ",".join(p + t if i == k else t for i, t in enumerate(terms))
            slope = plus(slope, np.einsum(f"{own}->{p}{output}", *values[:k], x.slope, *values[k + 1 :]))
    return Pair(np.einsum(subscripts, *values), slope)


def inv(a: Pair) -> Pair:
    """Inverses."""
    value = np.linalg.inv(a.value)
    return Pair(value, -(value @ a.slope @ value))


def solve(a: Pair, b: Pair) -> Pair:
    """Solutions of a x = b for vectors b (n,) or matrices."""
    if np.ndim(b.value) == 1:
        value, slope = solve(a, Pair(b.value[:, None], None if b.slope is None else b.slope[:, :, None]))
        return Pair(value[..., 0], slope[..., 0])
    value = np.linalg.solve(a.value, b.value)
    n = value.ndim
    right = plus(
        None if b.slope is None else padded(b.slope, n), None if a.slope is None else -(padded(a.slope, n) @ value)
    )
    return Pair(value, np.linalg.solve(a.value, right))


def det(a: Pair) -> Pair:
    """Determinants of regular matrices; raises numpy.linalg.LinAlgError for singular ones."""
    value = np.linalg.det(a.value)
    return Pair(value, value * np.einsum("...ij,p...ji->p...", np.linalg.inv(a.value), a.slope))


def norm(a: Pair, *, axis: int | None = None, keepdims: bool = False) -> Pair:
    """Euclidean norms along an axis, or of everything."""
    if axis is None and np.ndim(a.value) != 1:
        raise TypeError("the norm of numbers with slopes is taken along an axis")
    axis = -1 if axis is None else axis % np.ndim(a.value) - np.ndim(a.value)
    value = np.linalg.norm(a.value, axis=axis, keepdims=True)
    with np.errstate(all="ignore"):
        slope = (a.slope * (a.value / value)).sum(axis=axis, keepdims=True)
        still = (a.slope == 0).all(axis=axis, keepdims=True)
    slope = np.where(value == 0, np.where(still, 0.0, np.nan), slope)
    return Pair(value, slope) if keepdims else Pair(np.squeeze(value, axis), np.squeeze(slope, axis))


def cross(a: Pair, b: Pair, axis: int = -1) -> Pair:
    """Cross products of vectors along an axis."""
    value = np.cross(a.value, b.value, axis=axis)
    n = value.ndim
    of_slope = axis if axis < 0 else axis + 1
    first = second = None
    if a.slope is not None:
        first = np.cross(padded(a.slope, n), b.value, axisa=of_slope, axisb=axis, axisc=of_slope)
    if b.slope is not None:
        second = np.cross(a.value, padded(b.slope, n), axisa=axis, axisb=of_slope, axisc=of_slope)
    return Pair(value, plus(first, second))


def outer(a: Pair, b: Pair) -> Pair:
    """Products of every entry with every other (n, m)."""
    return einsum("i,j->ij", a, b)
