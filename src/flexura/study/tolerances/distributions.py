"""How a size scatters: distributions as their inverse functions, in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf, sqrt
from typing import Any, Protocol

import numpy as np
from scipy.special import ndtr, ndtri

from flexura.arrays import Array
from flexura.errors import OptionError

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
