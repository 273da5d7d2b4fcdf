"""Derivatives of what moves, joins, chooses and adds up entries, of products, and of what solves linear equations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from flexura.duals.elementwise import Pair, agree, padded, plus, spread, tied

LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"


def behind(axis: Any, ndim: int) -> Any:
    """Axes of values (...) as axes of their slopes (P, ...)."""
    if axis is None:
        return tuple(range(1, ndim + 1))
    if isinstance(axis, tuple):
        return tuple(behind(a, ndim) for a in axis)
    return axis + 1 if axis >= 0 else axis


def _count(pairs: Sequence[Pair]) -> int:
    return next(len(x.slope) for x in pairs if x.slope is not None)


def _filled(pairs: Sequence[Pair]) -> list[Any]:
    """The slopes of several, zero for constants."""
    count = _count(pairs)
    return [np.zeros((count, *np.shape(x.value))) if x.slope is None else x.slope for x in pairs]


def concatenate(pairs: Sequence[Pair], axis: int | None = 0) -> Pair:
    """Joined along an axis that they have."""
    if axis is None:
        pairs, axis = [reshape(x, (-1,)) for x in pairs], 0
    of_slope = behind(axis, 0)
    return Pair(np.concatenate([x.value for x in pairs], axis=axis), np.concatenate(_filled(pairs), axis=of_slope))


def stack(pairs: Sequence[Pair], axis: int = 0) -> Pair:
    """Joined along a new axis."""
    return Pair(np.stack([x.value for x in pairs], axis=axis), np.stack(_filled(pairs), axis=behind(axis, 0)))


def vstack(pairs: Sequence[Pair]) -> Pair:
    """Joined as rows."""
    return concatenate([reshape(x, (1, -1)) if np.ndim(x.value) < 2 else x for x in pairs], 0)


def hstack(pairs: Sequence[Pair]) -> Pair:
    """Joined along the second axis, vectors along their only one."""
    pairs = [reshape(x, (1,)) if np.ndim(x.value) == 0 else x for x in pairs]
    return concatenate(pairs, 0 if np.ndim(pairs[0].value) == 1 else 1)


def column_stack(pairs: Sequence[Pair]) -> Pair:
    """Joined as columns."""
    return concatenate([reshape(x, (-1, 1)) if np.ndim(x.value) < 2 else x for x in pairs], 1)


def where(condition: Any, a: Pair, b: Pair) -> Pair:
    """Entries of one or of the other."""
    value = np.where(condition, a.value, b.value)
    shape = np.shape(value)
    count = _count([a, b])
    slopes = [np.zeros((count, *(1,) * len(shape))) if x.slope is None else padded(x.slope, len(shape)) for x in (a, b)]
    slope = np.where(condition, *slopes)
    return Pair(value, slope if slope.shape[1:] == shape else spread(slope, shape))


def reshape(x: Pair, shape: Any) -> Pair:
    """In another shape."""
    value = np.reshape(x.value, shape)
    return Pair(value, None if x.slope is None else np.reshape(x.slope, (len(x.slope), *value.shape)))


def broadcast_to(x: Pair, shape: Any) -> Pair:
    """Repeated to a shape."""
    value = np.broadcast_to(x.value, shape)
    return Pair(value, np.broadcast_to(padded(x.slope, value.ndim), (len(x.slope), *value.shape)))


def transpose(x: Pair, axes: Sequence[int] | None = None) -> Pair:
    """With axes in another order."""
    n = np.ndim(x.value)
    axes = tuple(range(n))[::-1] if axes is None else tuple(a % n for a in axes)
    return Pair(np.transpose(x.value, axes), np.transpose(x.slope, (0, *(a + 1 for a in axes))))


def swapaxes(x: Pair, first: int, second: int) -> Pair:
    """With two axes exchanged."""
    return Pair(np.swapaxes(x.value, first, second), np.swapaxes(x.slope, behind(first, 0), behind(second, 0)))


def moveaxis(x: Pair, source: Any, destination: Any) -> Pair:
    """With axes moved."""
    source, destination = ((a,) if isinstance(a, int) else tuple(a) for a in (source, destination))
    value = np.moveaxis(x.value, source, destination)
    return Pair(value, np.moveaxis(x.slope, behind(source, 0), behind(destination, 0)))


def along(function: Callable[..., Any]) -> Callable[..., Pair]:
    """A linear function along axes that keeps the number of axes or reduces it."""

    def rule(x: Pair, axis: Any = None, **options: Any) -> Pair:
        of_slope = behind(axis, np.ndim(x.value))
        return Pair(function(x.value, axis=axis, **options), function(x.slope, axis=of_slope, **options))

    return rule


def accumulated(function: Callable[..., Any]) -> Callable[..., Pair]:
    """A linear function along one axis, of everything in a row without one."""

    def rule(x: Pair, axis: int | None = None, **options: Any) -> Pair:
        if axis is None:
            x, axis = reshape(x, (-1,)), 0
        of_slope = behind(axis, 0)
        return Pair(function(x.value, axis=axis, **options), function(x.slope, axis=of_slope, **options))

    return rule


def prod(x: Pair, axis: int | None = None, keepdims: bool = False) -> Pair:
    """Products along an axis, right for entries of zero too."""
    if axis is None:
        x, axis = reshape(x, (-1,)), 0
    axis %= np.ndim(x.value)
    value = np.prod(x.value, axis=axis, keepdims=keepdims)
    rest = []
    places = range(x.value.shape[axis])
    for k in places:
        others = np.prod(np.take(x.value, [i for i in places if i != k], axis=axis), axis=axis, keepdims=keepdims)
        slope = np.take(x.slope, [k] if keepdims else k, axis=axis + 1)
        rest.append(slope * others)
    return Pair(value, sum(rest) if rest else np.zeros((len(x.slope), *value.shape)))


def cumprod(x: Pair, axis: int | None = None) -> Pair:
    """Products of all entries up to each along an axis."""
    if axis is None:
        x, axis = reshape(x, (-1,)), 0
    axis %= np.ndim(x.value)
    parts = [prod(take(x, range(k + 1), axis), axis) for k in range(x.value.shape[axis])]
    return stack(parts, axis)


def take(x: Pair, indices: Any, axis: int) -> Pair:
    """Entries at indices along an axis."""
    indices = np.asarray(indices, dtype=np.intp)
    return Pair(np.take(x.value, indices, axis=axis), np.take(x.slope, indices, axis=behind(axis, 0)))


def extreme(best: Callable[..., Any]) -> Callable[..., Pair]:
    """The greatest or the smallest along an axis; NaN for slopes that differ among those that equal it but for
    round-off."""

    def rule(x: Pair, axis: int | None = None, keepdims: bool = False) -> Pair:
        if axis is None:
            x, axis = reshape(x, (-1,)), 0
        axis = axis % np.ndim(x.value) - np.ndim(x.value)
        at = np.expand_dims(best(x.value, axis=axis), axis)
        value = np.take_along_axis(x.value, at, axis)
        slope = np.take_along_axis(x.slope, np.broadcast_to(at, (len(x.slope), *at.shape)), axis)
        tie = tied(x.value, value)
        if tie.sum() > value.size:
            unlike = (tie & ~agree(x.slope, slope)).any(axis=axis, keepdims=True)
            slope = np.where(unlike, np.nan, slope)
        return Pair(value, slope) if keepdims else Pair(np.squeeze(value, axis), np.squeeze(slope, axis))

    return rule


def tile(x: Pair, times: Any) -> Pair:
    """Repeated as a block."""
    value = np.tile(x.value, times)
    times = (times,) if isinstance(times, int) else tuple(times)
    n = max(len(times), np.ndim(x.value))
    slope = padded(x.slope, n)
    return Pair(value, np.tile(slope, (1, *(1,) * (n - len(times)), *times)))


def repeat(x: Pair, repeats: Any, axis: int | None = None) -> Pair:
    """Entries repeated one by one."""
    if axis is None:
        x, axis = reshape(x, (-1,)), 0
    return Pair(np.repeat(x.value, repeats, axis=axis), np.repeat(x.slope, repeats, axis=behind(axis, 0)))


def expand_dims(x: Pair, axis: int) -> Pair:
    """With a new axis of length 1."""
    return Pair(np.expand_dims(x.value, axis), np.expand_dims(x.slope, behind(axis, 0)))


def squeeze(x: Pair, axis: int) -> Pair:
    """Without an axis of length 1."""
    return Pair(np.squeeze(x.value, axis), np.squeeze(x.slope, behind(axis, 0)))


def diagonal(x: Pair, offset: int = 0, axis1: int = 0, axis2: int = 1) -> Pair:
    """Diagonals of matrices."""
    of_slope = behind(axis1, 0), behind(axis2, 0)
    return Pair(np.diagonal(x.value, offset, axis1, axis2), np.diagonal(x.slope, offset, *of_slope))


def diag(x: Pair) -> Pair:
    """The diagonal of a matrix, or the matrix of a diagonal."""
    if np.ndim(x.value) == 2:
        return diagonal(x)
    slope = np.zeros((len(x.slope), *(2 * np.shape(x.value))))
    at = np.arange(len(x.value))
    slope[:, at, at] = x.slope
    return Pair(np.diag(x.value), slope)


def bincount(at: Any, weights: Pair, minlength: int) -> Pair:
    """Sums (n,) of weights (k,) by their numbers (k,)."""
    slope = [np.bincount(at, by_one, minlength) for by_one in weights.slope]
    return Pair(np.bincount(at, weights.value, minlength), np.array(slope))


def contiguous(x: Pair) -> Pair:
    """In memory that is in a row."""
    return Pair(np.ascontiguousarray(x.value), np.ascontiguousarray(x.slope))


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
            indices = ",".join(p + t if i == k else t for i, t in enumerate(terms))
            slope = plus(slope, np.einsum(f"{indices}->{p}{output}", *values[:k], x.slope, *values[k + 1 :]))
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
