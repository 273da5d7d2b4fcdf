"""How a size scatters: distributions about its nominal value, and the tolerances that name them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite, sqrt
from typing import Any, Protocol

import numpy as np
from scipy.special import ndtr, ndtri

from flexura.arrays import Array
from flexura.errors import ExpressionError, OptionError
from flexura.expressions import Expression
from flexura.mechanism import Mechanism, Scalar, Spread
from flexura.modelfile import parse_override
from flexura.units import split_quantity

SPREAD = 3.0
"""Standard deviations of a normal distribution that is not truncated which a worst case reaches, either way."""


class Distribution(Protocol):
    """A size as a random number: `low` to `high` is what a worst case reaches."""

    @property
    def low(self) -> float: ...
    @property
    def high(self) -> float: ...
    @property
    def mean(self) -> float: ...
    @property
    def deviation(self) -> float: ...
    def quantile(self, u: Array) -> Array:
        """The sizes (n,) below which it is with probabilities u (n,)."""
        ...

    def describe(self) -> dict[str, Any]:
        """Kind and numbers, as plain data."""
        ...


class _Described:
    """What says its kind and its numbers."""

    def describe(self) -> dict[str, Any]:
        """Kind and numbers, as plain data."""
        own = {name: getattr(self, name) for name in self.__dataclass_fields__}  # type: ignore[attr-defined]
        numbers = {name: list(v) if isinstance(v, tuple) else v for name, v in own.items()}
        return {"kind": type(self).__name__.lower(), **{n: v for n, v in numbers.items() if abs_finite(v)}}


def abs_finite(value: Any) -> bool:
    """Whether a number, or all of a list, is finite."""
    return bool(np.all(np.isfinite(value)))


@dataclass(frozen=True)
class Uniform(_Described):
    """Every size between two is as likely as any other."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _ordered(self.low, self.high)

    @property
    def mean(self) -> float:
        """Half way."""
        return 0.5 * (self.low + self.high)

    @property
    def deviation(self) -> float:
        """Standard deviation."""
        return (self.high - self.low) / sqrt(12.0)

    def quantile(self, u: Array) -> Array:
        """The size below which the part `u` (n,) of all lies."""
        return self.low + (self.high - self.low) * u


@dataclass(frozen=True)
class Triangular(_Described):
    """Linear up to the likeliest size and down from it."""

    low: float
    mode: float
    high: float

    def __post_init__(self) -> None:
        _ordered(self.low, self.high)
        if not self.low <= self.mode <= self.high:
            raise OptionError(
                f"the likeliest size {self.mode:g} is refused: it lies between the smallest and the largest"
            )

    @property
    def mean(self) -> float:
        """A third of the sum."""
        return (self.low + self.mode + self.high) / 3

    @property
    def deviation(self) -> float:
        """Standard deviation."""
        a, c, b = (own - self.mode for own in (self.low, self.mode, self.high))
        return sqrt((a * a + b * b + c * c - a * b - a * c - b * c) / 18)

    def quantile(self, u: Array) -> Array:
        """The size below which the part `u` (n,) of all lies."""
        whole, up, down = self.high - self.low, self.mode - self.low, self.high - self.mode
        rising = self.low + np.sqrt(u * whole * up)
        falling = self.high - np.sqrt((1 - u) * whole * down)
        return np.where(u * whole < up, rising, falling)


@dataclass(frozen=True)
class Normal(_Described):
    """Gauss's distribution, as it is or cut off at `lowest` and `highest`; `sigma` is that before it is cut off."""

    centre: float
    sigma: float
    lowest: float = -inf
    highest: float = inf

    def __post_init__(self) -> None:
        if not (0 < self.sigma < inf):
            raise OptionError(f"a standard deviation is positive, not {self.sigma:g}")
        _ordered(self.lowest, self.highest)
        if self._kept < LEAST_KEPT:
            raise OptionError(
                f"between {self.lowest:g} and {self.highest:g} there is nothing of a normal distribution "
                f"about {self.centre:g} with a standard deviation of {self.sigma:g}"
            )

    @cached_property
    def _ends(self) -> tuple[float, float]:
        return (self.lowest - self.centre) / self.sigma, (self.highest - self.centre) / self.sigma

    @cached_property
    def _kept(self) -> float:
        """Share of the whole distribution that lies between the ends."""
        a, b = self._ends if self._ends[0] <= 0 else (-self._ends[1], -self._ends[0])
        return float(ndtr(b) - ndtr(a))

    @property
    def is_cut(self) -> bool:
        """Whether it is cut off at both ends."""
        return bool(np.isfinite(self.lowest) and np.isfinite(self.highest))

    @property
    def low(self) -> float:
        """Where it is cut off, or three standard deviations down."""
        return self.lowest if np.isfinite(self.lowest) else self.centre - SPREAD * self.sigma

    @property
    def high(self) -> float:
        """Where it is cut off, or three standard deviations up."""
        return self.highest if np.isfinite(self.highest) else self.centre + SPREAD * self.sigma

    @cached_property
    def _moments(self) -> tuple[float, float]:
        """Mean and standard deviation of what is left between the ends, in sigmas."""
        a, b = self._ends
        first = (_bell(a) - _bell(b)) / self._kept
        second = ((a * _bell(a) if a > -inf else 0.0) - (b * _bell(b) if b < inf else 0.0)) / self._kept
        return first, sqrt(max(1 + second - first * first, 0.0))

    @property
    def mean(self) -> float:
        """Mean of what is left between the ends."""
        return self.centre + self.sigma * self._moments[0]

    @property
    def deviation(self) -> float:
        """Standard deviation of what is left between the ends."""
        return self.sigma * self._moments[1]

    def quantile(self, u: Array) -> Array:
        """The size below which the part `u` (n,) of what is left lies."""
        a, b = self._ends  # the lower tail has the digits that the upper one lacks
        z = -_between(-b, -a, 1 - u) if a > 0 else _between(a, b, u)
        return np.clip(self.centre + self.sigma * z, self.lowest, self.highest)


LEAST_KEPT = 1e-6
"""Share of a normal distribution that must be left between its ends: double precision resolves no tails far out."""


@dataclass(frozen=True)
class Measured(_Described):
    """Sizes that were measured: any between two neighbouring ones is as likely, none beyond the outermost.

    The quantile function joins the sorted values linearly at the shares (k - 1/2)/n (Hazen 1914), which keeps the
    mean of the list.
    """

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.values) < 2 or not abs_finite(self.values):
            raise OptionError("these sizes are refused: a measured list has at least two sizes, all finite")
        _ordered(min(self.values), max(self.values))

    @cached_property
    def _sorted(self) -> Array:
        return np.sort(np.asarray(self.values, dtype=float))

    @property
    def low(self) -> float:
        """The smallest."""
        return float(self._sorted[0])

    @property
    def high(self) -> float:
        """The largest."""
        return float(self._sorted[-1])

    @property
    def mean(self) -> float:
        """That of the list."""
        return float(np.mean(self._sorted))

    @property
    def deviation(self) -> float:
        """Standard deviation of the joined quantile function."""
        x = self._sorted - self.mean
        a, b = x[:-1], x[1:]
        squares = np.sum(a * a + a * b + b * b) / 3 + (x[0] ** 2 + x[-1] ** 2) / 2
        return sqrt(float(squares) / len(x))

    def quantile(self, u: Array) -> Array:
        """The size below which the part `u` (n,) of all lies."""
        at = (np.arange(len(self._sorted)) + 0.5) / len(self._sorted)
        return np.interp(u, at, self._sorted)


def _between(a: float, b: float, u: Array) -> Array:
    """Standard normal numbers below which the part `u` of those between two lies."""
    return np.asarray(ndtri(ndtr(a) + (ndtr(b) - ndtr(a)) * u))


def _bell(z: float) -> float:
    return float(np.exp(-0.5 * z * z) / sqrt(2 * np.pi))


def _ordered(low: float, high: float) -> None:
    if not low < high:
        raise OptionError(f"a range goes from the smaller to the larger size, not from {low:g} to {high:g}")


FORMS = (
    "write ± 0.02 mm, +0.01/-0.03 mm, ± 2 %, normal 5 um, normal 5 um within 3, triangular ± 0.02 mm "
    "or measured A, B, C"
)

_BOTH = re.compile(r"(?:±|\+/?-)\s*(.+)", re.DOTALL)
_APART = re.compile(r"([+-][^/+-]+(?:[eE][+-]?\d+)?[^/+-]*?)\s*/?\s*([+-].+)", re.DOTALL)
_SHAPES = ("uniform", "triangular", "normal", "measured")


def distribution_of(mechanism: Mechanism, name: str, given: str | Spread, values: Mapping[str, float]) -> Distribution:
    """The distribution of a parameter about its value, SI, from text or from what a file describes.

    A bare `±` or `+A/-B` makes all deviations between equally likely; `triangular` and `normal` before them change
    that, `normal ± A` has A at three standard deviations, `normal S` gives the standard deviation and `within` where it
    is cut off, a deviation with its unit or a number of standard deviations. Per cent are of the value. Raises
    OptionError for what cannot be read.
    """
    try:
        if isinstance(given, Spread):
            return _described(given, values[name], values)
        return _Reader(mechanism, name, values[name]).read(given.strip())
    except (OptionError, ExpressionError) as error:
        shown, hint = (f" {given!r}:", f"; {FORMS}") if isinstance(given, str) else ("", "")
        raise OptionError(f"{name}:{shown} {error}{hint}") from None


def _described(own: Spread, at: float, values: Mapping[str, float]) -> Distribution:
    """The distribution that a file describes, of a parameter with the value `at`."""

    def number(value: Scalar) -> float:
        return float(value.evaluate(values) if isinstance(value, Expression) else value)

    if own.measured is not None:
        return Measured(tuple(number(value) for value in own.measured))
    if own.normal is not None:
        sigma = number(own.normal)
        reach = inf if own.within is None else number(own.within) * sigma
        return Normal(at, sigma, at - reach, at + reach)
    low, high = (number(deviation) for deviation in own.uniform or own.triangular or ())
    return Uniform(at + low, at + high) if own.uniform else Triangular(at + low, at, at + high)


class _Reader:
    """Reads the tolerance of one parameter."""

    def __init__(self, mechanism: Mechanism, name: str, nominal: float) -> None:
        self._mechanism, self._name, self._nominal = mechanism, name, nominal

    def read(self, text: str) -> Distribution:
        """The distribution that a text describes."""
        word, _, rest = text.partition(" ")
        shape, rest = (word, rest.strip()) if word in _SHAPES else ("uniform", text)
        if shape == "measured":
            return Measured(tuple(self._value(own) for own in _with_units(rest.split(","))))
        if shape == "normal":
            return self._normal(rest)
        low, high = self._deviations(rest)
        at = self._nominal
        return Uniform(at + low, at + high) if shape == "uniform" else Triangular(at + low, at, at + high)

    def _normal(self, text: str) -> Normal:
        own, within, limit = (part.strip() for part in text.partition("within"))
        at = self._nominal
        if _BOTH.fullmatch(own) or _APART.fullmatch(own):
            low, high = self._deviations(own)
            sigma, centre = (high - low) / (2 * SPREAD), at + 0.5 * (low + high)
        else:
            sigma, centre = self._deviation(own), at
        if not within:
            return Normal(centre, sigma)
        reach = float(limit) * sigma if _is_number(limit) else self._deviations(limit, single=True)[1]
        return Normal(centre, sigma, centre - reach, centre + reach)

    def _deviations(self, text: str, single: bool = False) -> tuple[float, float]:
        """Lower and upper deviation, SI."""
        if both := _BOTH.fullmatch(text):
            reach = self._deviation(both[1])
            return -reach, reach
        if apart := _APART.fullmatch(text):
            ends = [self._deviation(own) for own in _with_units(apart.groups())]
            return min(ends), max(ends)
        if single:
            reach = self._deviation(text)
            return -reach, reach
        raise OptionError("is no tolerance")

    def _deviation(self, text: str) -> float:
        if text.rstrip().endswith("%"):
            share = text.rstrip().removesuffix("%").strip()
            if not _is_number(share):
                raise OptionError(f"{text.strip()!r} is no percentage")
            if not self._nominal:
                raise OptionError("per cent of a value that is zero are nothing; write a deviation")
            return float(share) / 100 * abs(self._nominal)
        return self._value(text)

    def _value(self, text: str) -> float:
        return parse_override(self._mechanism, f"{self._name}={text.strip()}")[1]


def _is_number(text: str) -> bool:
    try:
        return isfinite(float(text))
    except ValueError:
        return False


def _with_units(parts: Sequence[str]) -> list[str]:
    """Texts of quantities, those without a unit with that of the next."""
    found, unit = list[str](), ""
    for part in reversed([own.strip() for own in parts]):
        if _is_number(part):
            found.append(f"{part} {unit}".strip())
        else:
            unit = split_quantity(part)[1]
            found.append(part)
    return found[::-1]
