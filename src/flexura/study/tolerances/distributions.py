"""How a size scatters: distributions about its nominal value, and the tolerances that name them.

Tolerances are written as `± 0.02 mm` or `normal 5 um within 3`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite, sqrt
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import ExpressionError, OptionError
from flexura.expressions import Expression
from flexura.mechanism import Mechanism, Scalar, Spread
from flexura.modelfile import parse_override
from flexura.study.space import with_units
from flexura.units import is_number

WORST_CASE_SIGMAS = 3.0
"""Standard deviations of a normal distribution that is not cut off which a worst case reaches, either way."""

LEAST_KEPT = 1e-6
"""Share of a normal distribution that must be left between its ends: double precision resolves no tails far out."""


@dataclass(frozen=True)
class Distribution:
    """A size as a random number, SI: its `kind` and `numbers`, what a worst case reaches, `low` to `high`, and a `law`
    with the methods of SciPy's distributions."""

    kind: str
    numbers: Mapping[str, Any]
    low: float
    high: float
    law: Any

    @property
    def mean(self) -> float:
        """Mean."""
        return float(self.law.mean())

    @property
    def deviation(self) -> float:
        """Standard deviation."""
        return float(self.law.std())

    @property
    def is_bounded(self) -> bool:
        """Whether it has no tails."""
        return bool(np.isfinite(self.law.support()).all())

    def quantile(self, u: Array) -> Array:
        """The sizes (n,) below which it is with probabilities u (n,)."""
        return np.clip(self.law.ppf(u), *self.law.support())

    def describe(self) -> dict[str, Any]:
        """Kind and numbers, as plain data."""
        return {"kind": self.kind, **self.numbers}


def uniform(low: float, high: float) -> Distribution:
    """Every size between two is as likely as any other."""
    from scipy import stats  # slow to import

    _check_order(low, high)
    return Distribution("uniform", {"low": low, "high": high}, low, high, stats.uniform(low, high - low))


def triangular(low: float, mode: float, high: float) -> Distribution:
    """Linear up to the likeliest size and down from it."""
    from scipy import stats  # slow to import

    _check_order(low, high)
    if not low <= mode <= high:
        raise OptionError(f"the likeliest size {mode:g} is refused: it lies between the smallest and the largest")
    law = stats.triang((mode - low) / (high - low), low, high - low)
    return Distribution("triangular", {"low": low, "mode": mode, "high": high}, low, high, law)


def normal(centre: float, sigma: float, lowest: float = -inf, highest: float = inf) -> Distribution:
    """Gauss's distribution, as it is or cut off at `lowest` and `highest`; `sigma` is that before it is cut off."""
    from scipy import stats  # slow to import
    from scipy.special import ndtr  # slow to import

    if not (0 < sigma < inf):
        raise OptionError(f"a standard deviation is positive, not {sigma:g}")
    _check_order(lowest, highest)
    a, b = (lowest - centre) / sigma, (highest - centre) / sigma
    if ndtr(min(b, -a)) - ndtr(min(a, -b)) < LEAST_KEPT:
        raise OptionError(
            f"between {lowest:g} and {highest:g} there is nothing of a normal distribution "
            f"about {centre:g} with a standard deviation of {sigma:g}"
        )
    numbers = {"centre": centre, "sigma": sigma, "lowest": lowest, "highest": highest}
    low = lowest if isfinite(lowest) else centre - WORST_CASE_SIGMAS * sigma
    high = highest if isfinite(highest) else centre + WORST_CASE_SIGMAS * sigma
    law = stats.norm(centre, sigma) if a == -inf and b == inf else stats.truncnorm(a, b, centre, sigma)
    return Distribution("normal", {name: x for name, x in numbers.items() if isfinite(x)}, low, high, law)


def measured(values: tuple[float, ...]) -> Distribution:
    """Sizes that were measured: any between two neighbouring ones is as likely, none beyond the outermost."""
    if len(values) < 2 or not np.isfinite(values).all():
        raise OptionError("these sizes are refused: a measured list has at least two sizes, all finite")
    low, high = min(values), max(values)
    _check_order(low, high)
    return Distribution("measured", {"values": list(values)}, low, high, _Measured(values))


@dataclass(frozen=True)
class _Measured:
    """The quantile function that joins sorted values linearly at the shares (k - 1/2)/n (Hazen 1914), which keeps the
    mean of the list."""

    values: tuple[float, ...]

    @cached_property
    def _sorted(self) -> Array:
        return np.sort(np.asarray(self.values, dtype=float))

    def ppf(self, u: Array) -> Array:
        return np.interp(u, (np.arange(len(self.values)) + 0.5) / len(self.values), self._sorted)

    def support(self) -> tuple[float, float]:
        return float(self._sorted[0]), float(self._sorted[-1])

    def mean(self) -> float:
        return float(np.mean(self._sorted))

    def std(self) -> float:
        x = self._sorted - self.mean()
        a, b = x[:-1], x[1:]
        squares = np.sum(a * a + a * b + b * b) / 3 + (x[0] ** 2 + x[-1] ** 2) / 2
        return sqrt(float(squares) / len(x))


def _check_order(low: float, high: float) -> None:
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


def _described(spread: Spread, nominal: float, values: Mapping[str, float]) -> Distribution:
    """The distribution that a file describes."""

    def number(value: Scalar) -> float:
        return float(value.evaluate(values) if isinstance(value, Expression) else value)

    if spread.measured is not None:
        return measured(tuple(number(value) for value in spread.measured))
    if spread.normal is not None:
        sigma = number(spread.normal)
        limit = inf if spread.within is None else number(spread.within) * sigma
        return normal(nominal, sigma, nominal - limit, nominal + limit)
    low, high = (nominal + number(deviation) for deviation in spread.uniform or spread.triangular or ())
    return uniform(low, high) if spread.uniform else triangular(low, nominal, high)


@dataclass(frozen=True)
class _Reader:
    """Reads the tolerance of one parameter."""

    mechanism: Mechanism
    name: str
    nominal: float

    def read(self, text: str) -> Distribution:
        """The distribution that a text describes."""
        word, _, rest = text.partition(" ")
        shape, rest = (word, rest.strip()) if word in _SHAPES else ("uniform", text)
        if shape == "measured":
            return measured(tuple(self._value(part) for part in with_units(rest.split(","))))
        if shape == "normal":
            return self._normal(rest)
        low, high = (self.nominal + deviation for deviation in self._deviations(rest))
        return uniform(low, high) if shape == "uniform" else triangular(low, self.nominal, high)

    def _normal(self, text: str) -> Distribution:
        spread, within, limit = (part.strip() for part in text.partition("within"))
        if _BOTH.fullmatch(spread) or _APART.fullmatch(spread):
            low, high = self._deviations(spread)
            sigma, centre = (high - low) / (2 * WORST_CASE_SIGMAS), self.nominal + 0.5 * (low + high)
        else:
            sigma, centre = self._deviation(spread), self.nominal
        if not within:
            return normal(centre, sigma)
        if is_number(limit):
            largest = float(limit) * sigma
        elif _BOTH.fullmatch(limit) or _APART.fullmatch(limit):
            largest = self._deviations(limit)[1]
        else:
            largest = self._deviation(limit)
        return normal(centre, sigma, centre - largest, centre + largest)

    def _deviations(self, text: str) -> tuple[float, float]:
        """Lower and upper deviation, SI."""
        if both := _BOTH.fullmatch(text):
            largest = self._deviation(both[1])
            return -largest, largest
        if apart := _APART.fullmatch(text):
            ends = [self._deviation(part) for part in with_units(apart.groups())]
            return min(ends), max(ends)
        raise OptionError("is no tolerance")

    def _deviation(self, text: str) -> float:
        if not text.rstrip().endswith("%"):
            return self._value(text)
        share = text.rstrip().removesuffix("%").strip()
        if not is_number(share):
            raise OptionError(f"{text.strip()!r} is no percentage")
        if not self.nominal:
            raise OptionError("per cent of a value that is zero are nothing; write a deviation")
        return float(share) / 100 * abs(self.nominal)

    def _value(self, text: str) -> float:
        return parse_override(self.mechanism, f"{self.name}={text.strip()}")[1]
