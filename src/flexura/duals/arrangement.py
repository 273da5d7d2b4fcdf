"""Derivatives of what moves, joins, chooses and adds up entries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from flexura.duals.pairs import Pair, agree, padded, spread, tied


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
    own = behind(axis, 0)
    return Pair(np.concatenate([x.value for x in pairs], axis=axis), np.concatenate(_filled(pairs), axis=own))


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
        own = behind(axis, np.ndim(x.value))
        return Pair(function(x.value, axis=axis, **options), function(x.slope, axis=own, **options))

    return rule


def accumulated(function: Callable[..., Any]) -> Callable[..., Pair]:
    """A linear function along one axis, of everything in a row without one."""

    def rule(x: Pair, axis: int | None = None, **options: Any) -> Pair:
        if axis is None:
            x, axis = reshape(x, (-1,)), 0
        own = behind(axis, 0)
        return Pair(function(x.value, axis=axis, **options), function(x.slope, axis=own, **options))

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
        own = np.take(x.slope, [k] if keepdims else k, axis=axis + 1)
        rest.append(own * others)
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
    own = padded(x.slope, n)
    return Pair(value, np.tile(own, (1, *(1,) * (n - len(times)), *times)))


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
    own = behind(axis1, 0), behind(axis2, 0)
    return Pair(np.diagonal(x.value, offset, axis1, axis2), np.diagonal(x.slope, offset, *own))


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
    slope = [np.bincount(at, own, minlength) for own in weights.slope]
    return Pair(np.bincount(at, weights.value, minlength), np.array(slope))


def contiguous(x: Pair) -> Pair:
    """In memory that is in a row."""
    return Pair(np.ascontiguousarray(x.value), np.ascontiguousarray(x.slope))
