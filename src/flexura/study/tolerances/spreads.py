"""Tolerances as they are written, `± 0.02 mm` or `normal 5 um within 3`, as distributions about a nominal size."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import inf, isfinite

from flexura.errors import ExpressionError, OptionError
from flexura.expressions import Expression
from flexura.mechanism import Mechanism, Scalar, Spread
from flexura.modelfile import parse_override
from flexura.study.tolerances.distributions import SPREAD, Distribution, Measured, Normal, Triangular, Uniform
from flexura.units import split_quantity

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
