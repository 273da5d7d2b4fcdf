"""A value with its slopes, and the derivatives of NumPy's elementwise functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from flexura.thresholds import ROUND_OFF

ALIKE = 1e-7
"""Difference up to which slopes agree, over the largest by the same parameter."""

OF_VALUES = frozenset(
    {
        *(np.greater, np.greater_equal, np.less, np.less_equal, np.equal, np.not_equal),
        *(np.isfinite, np.isnan, np.isinf, np.signbit, np.sign, np.floor, np.ceil, np.rint, np.trunc),
    }
)
"""Functions of values alone: their results do not change with small changes of what they are given."""


class Pair(NamedTuple):
    """A value (...) and its slopes (P, ...); a constant has None for slopes."""

    value: Any
    slope: Any


Rule = Callable[..., tuple[Any, Any]]
"""A value and its slopes, as a plain tuple, of pairs."""


def padded(slope: Any, ndim: int) -> Any:
    """Slopes (P, ...) with axes of length 1 put in behind the first, for values of `ndim` axes."""
    missing = ndim + 1 - slope.ndim
    return slope if missing <= 0 else slope.reshape((len(slope), *(1,) * missing, *slope.shape[1:]))


def spread(slope: Any, shape: tuple[int, ...]) -> Any:
    """Slopes (P, *shape) of their own, from slopes whose values broadcast to `shape`."""
    wanted = (len(slope), *shape)
    return slope.copy() if slope.shape == wanted else np.broadcast_to(padded(slope, len(shape)), wanted).copy()


def plus(a: Any, b: Any) -> Any:
    """The sum of slopes of one shape, of which either may be None."""
    if a is None or b is None:
        return b if a is None else a
    return a + b


def unless_still(slope: Any, factor: Any, bad: Any, shape: tuple[int, ...]) -> Any:
    """Slopes times a factor; where the function has no derivative (`bad`), NaN unless the slope is zero."""
    if not bad.any():
        return padded(slope, len(shape)) * factor
    slope = spread(slope, shape)
    moved = slope * np.where(bad, 1.0, factor)
    return np.where(bad & (slope != 0), np.nan, np.where(bad, 0.0, moved))


def tied(a: Any, b: Any) -> Any:
    """Where values are equal but for round-off."""
    a, b = _bare(a), _bare(b)
    with np.errstate(all="ignore"):
        return (a == b) | (np.abs(a - b) <= ROUND_OFF * np.maximum(np.abs(a), np.abs(b)))


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


def _by_argument(function: Any, factor: Callable[[Any], Any]) -> Rule:
    """A function of one argument whose derivative is `factor` of the argument."""
    return lambda x: (function(x.value), x.slope * factor(x.value))


def _by_result(function: Any, factor: Callable[[Any], Any]) -> Rule:
    """A function of one argument whose derivative is `factor` of the result."""

    def rule(x: Pair) -> tuple[Any, Any]:
        value = function(x.value)
        return value, x.slope * factor(value)

    return rule


def _quietly(rule: Rule) -> Rule:
    """A rule of a function that is finite where its derivative is not."""

    def quiet(x: Pair) -> tuple[Any, Any]:
        with np.errstate(all="ignore"):
            return rule(x)

    return quiet


def _linear(function: Any) -> Rule:
    """A linear function of one argument."""
    return lambda x: (function(x.value), function(x.slope))


def _sqrt(x: Pair) -> tuple[Any, Any]:
    value = np.sqrt(x.value)
    bad = x.value == 0
    if not bad.any():
        return value, x.slope * (0.5 / value)
    with np.errstate(all="ignore"):
        return value, unless_still(x.slope, 0.5 / value, bad, value.shape)


def _absolute(x: Pair) -> tuple[Any, Any]:
    return np.absolute(x.value), unless_still(x.slope, np.sign(x.value), x.value == 0, x.value.shape)


def _add(a: Pair, b: Pair) -> tuple[Any, Any]:
    value = a.value + b.value
    if b.slope is None:
        return value, spread(a.slope, value.shape)
    if a.slope is None:
        return value, spread(b.slope, value.shape)
    return value, padded(a.slope, value.ndim) + padded(b.slope, value.ndim)


def _subtract(a: Pair, b: Pair) -> tuple[Any, Any]:
    value = a.value - b.value
    if b.slope is None:
        return value, spread(a.slope, value.shape)
    if a.slope is None:
        return value, -spread(b.slope, value.shape)
    return value, padded(a.slope, value.ndim) - padded(b.slope, value.ndim)


def _multiply(a: Pair, b: Pair) -> tuple[Any, Any]:
    value = a.value * b.value
    if b.slope is None:
        return value, padded(a.slope, value.ndim) * b.value
    if a.slope is None:
        return value, padded(b.slope, value.ndim) * a.value
    return value, padded(a.slope, value.ndim) * b.value + padded(b.slope, value.ndim) * a.value


def _divide(a: Pair, b: Pair) -> tuple[Any, Any]:
    value = a.value / b.value
    if b.slope is None:
        return value, padded(a.slope, value.ndim) / b.value
    with np.errstate(all="ignore"):
        change = padded(b.slope, value.ndim) * -value
        return value, (change if a.slope is None else padded(a.slope, value.ndim) + change) / b.value


def _power(a: Pair, b: Pair) -> tuple[Any, Any]:
    value = np.power(a.value, b.value)
    if isinstance(b.value, int | float) and b.value >= 1:
        return value, a.slope * (b.value * np.power(a.value, b.value - 1))
    first = second = None
    with np.errstate(all="ignore"):
        if a.slope is not None:
            factor = b.value * np.power(a.value, np.where(b.value == 0, 1.0, np.subtract(b.value, 1.0)))
            first = unless_still(a.slope, factor, ~np.isfinite(factor) & np.isfinite(value), value.shape)
        if b.slope is not None:
            factor = np.where(value == 0, 0.0, value * np.log(a.value))
            second = unless_still(b.slope, factor, ~np.isfinite(factor), value.shape)
        return value, plus(first, second)


def _of_two(function: Any, factors: Callable[[Any, Any, Any], tuple[Any, Any]]) -> Rule:
    """A function of two arguments that has no derivative where both are zero."""

    def rule(a: Pair, b: Pair) -> tuple[Any, Any]:
        value = function(a.value, b.value)
        shape = value.shape
        bad = (a.value == 0) & (b.value == 0)
        with np.errstate(all="ignore"):
            partials = factors(a.value, b.value, value)
            slopes = [
                None if x.slope is None else unless_still(x.slope, f, bad, shape)
                for x, f in zip((a, b), partials, strict=True)
            ]
        return Pair(value, plus(*slopes))

    return rule


def _arctan2(y: Any, x: Any, _: Any) -> tuple[Any, Any]:
    square = y * y + x * x
    return x / square, -y / square


def _extreme(function: Any, ahead: Any) -> Rule:
    """The greater or the smaller of two; where they are equal but for round-off, NaN unless their slopes agree."""

    def rule(a: Pair, b: Pair) -> tuple[Any, Any]:
        value = function(a.value, b.value)
        shape = np.shape(value)
        count = len(b.slope if a.slope is None else a.slope)
        slopes = [
            np.zeros((count, *(1,) * len(shape))) if x.slope is None else padded(x.slope, len(shape)) for x in (a, b)
        ]
        slope = np.where(ahead(a.value, b.value), *slopes)
        tie = tied(a.value, b.value)
        if np.any(tie):
            slope = np.where(tie & ~agree(*slopes), np.nan, slope)
        return value, slope if slope.shape[1:] == shape else spread(slope, shape)

    return rule


RULES: dict[Any, Rule] = {
    np.add: _add,
    np.subtract: _subtract,
    np.multiply: _multiply,
    np.divide: _divide,
    np.power: _power,
    np.float_power: _power,
    np.maximum: _extreme(np.maximum, np.greater),
    np.minimum: _extreme(np.minimum, np.less),
    np.arctan2: _of_two(np.arctan2, _arctan2),
    np.hypot: _of_two(np.hypot, lambda a, b, r: (a / r, b / r)),
    np.negative: _linear(np.negative),
    np.positive: _linear(np.positive),
    np.square: _by_argument(np.square, lambda x: 2 * x),
    np.reciprocal: _by_result(np.reciprocal, lambda y: -y * y),
    np.sqrt: _sqrt,
    np.absolute: _absolute,
    np.exp: _by_result(np.exp, np.positive),
    np.expm1: _by_result(np.expm1, lambda y: y + 1),
    np.log: _by_argument(np.log, lambda x: 1 / x),
    np.log1p: _by_argument(np.log1p, lambda x: 1 / (1 + x)),
    np.sin: _by_argument(np.sin, np.cos),
    np.cos: _by_argument(np.cos, lambda x: -np.sin(x)),
    np.tan: _by_result(np.tan, lambda y: 1 + y * y),
    np.arcsin: _quietly(_by_argument(np.arcsin, lambda x: 1 / np.sqrt((1 - x) * (1 + x)))),
    np.arccos: _quietly(_by_argument(np.arccos, lambda x: -1 / np.sqrt((1 - x) * (1 + x)))),
    np.arctan: _by_argument(np.arctan, lambda x: 1 / (1 + x * x)),
    np.sinh: _by_argument(np.sinh, np.cosh),
    np.cosh: _by_argument(np.cosh, np.sinh),
    np.tanh: _by_result(np.tanh, lambda y: (1 - y) * (1 + y)),
    np.arctanh: _by_argument(np.arctanh, lambda x: 1 / ((1 - x) * (1 + x))),
    np.degrees: _linear(np.degrees),
    np.radians: _linear(np.radians),
}
"""Rules of special functions of SciPy, by name: loading them takes longer than most that has slopes."""
