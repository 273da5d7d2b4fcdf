"""A value with its slopes, and how slopes are brought to one shape."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

TIE = 1e-12
"""Relative difference up to which numbers are equal but for round-off."""

ALIKE = 1e-7
"""Difference up to which slopes agree, over the largest by the same parameter."""


class Pair(NamedTuple):
    """A value (...) and its slopes (P, ...); a constant has None for slopes."""

    value: Any
    slope: Any


def padded(slope: Any, ndim: int) -> Any:
    """Slopes (P, ...) with axes of length 1 put in behind the first, for values of `ndim` axes."""
    shape = slope.shape
    missing = ndim + 1 - len(shape)
    return slope if missing <= 0 else slope.reshape((shape[0], *(1,) * missing, *shape[1:]))


def spread(slope: Any, shape: tuple[int, ...]) -> Any:
    """Slopes (P, *shape) of their own, from slopes whose values broadcast to `shape`."""
    wanted = (len(slope), *shape)
    return slope.copy() if slope.shape == wanted else np.broadcast_to(padded(slope, len(shape)), wanted).copy()


def times(slope: Any, factor: Any, shape: tuple[int, ...]) -> Any:
    """Slopes (P, *shape) times a factor; slopes and factor belong to values that broadcast to `shape`."""
    product = padded(slope, len(shape)) * factor
    return product if product.shape[1:] == shape else spread(product, shape)


def plus(a: Any, b: Any) -> Any:
    """The sum of slopes of one shape, of which either may be None."""
    if a is None or b is None:
        return b if a is None else a
    return a + b


def unless_still(slope: Any, factor: Any, bad: Any, shape: tuple[int, ...]) -> Any:
    """Slopes times a factor; where the function has no derivative (`bad`), NaN unless the slope is zero."""
    if not np.any(bad):
        return times(slope, factor, shape)
    slope = spread(slope, shape)
    found = slope * np.where(bad, 1.0, factor)
    return np.where(bad & (slope != 0), np.nan, np.where(bad, 0.0, found))


def tied(a: Any, b: Any) -> Any:
    """Where values are equal but for round-off."""
    a, b = _bare(a), _bare(b)
    with np.errstate(all="ignore"):
        return (a == b) | (np.abs(a - b) <= TIE * np.maximum(np.abs(a), np.abs(b)))


def agree(a: Any, b: Any) -> Any:
    """Where slopes (P, ...) are equal but for round-off; NaN agrees with nothing."""
    a, b = _bare(a), _bare(b)
    with np.errstate(all="ignore"):
        size = np.fmax(np.abs(a), np.abs(b))
        largest = np.fmax.reduce(size, axis=tuple(range(1, size.ndim)), keepdims=True, initial=0.0)
        return (a == b) | (np.abs(a - b) <= ALIKE * largest)


def _bare(x: Any) -> Any:
    """Values without slopes."""
    while hasattr(x, "slope"):
        x = x.value
    return x
