"""Reading the text of units.

Names that are not of the SI go to the unit library, each distinct one once; it never sees a number.
"""

from __future__ import annotations

import math
import re
from difflib import get_close_matches
from fractions import Fraction
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

from flexura.errors import ExpressionError
from flexura.expressions import NUMBER, Dimension

if TYPE_CHECKING:
    from pint import UnitRegistry

MAX_LENGTH = 60
MAX_QUANTITY_LENGTH = 1000
MAX_EXPONENT = 12
_TOO_HIGH = f"an exponent of a unit is at most {MAX_EXPONENT}"
_RATIONAL = 10**40
"""Factors with larger denominators hold digits of pi, and are rounded: 60 deg is math.radians(60)."""

_BASE = ("[length]", "[mass]", "[time]", "[current]", "[temperature]")
_ALLOWED = re.compile(r"[A-Za-z0-9µμ°%*/^(). \-]+")
_TOKEN = re.compile(r"\s*(?:([A-Za-zµμ°%]+)|(-?\d{1,2}(?:/\d{1,2})?)|(\*\*|[*/^()]))", re.ASCII)
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
FAMILIAR = (
    *("m", "mm", "um", "nm", "cm", "km", "in", "g", "kg", "mg", "t", "s", "ms", "us", "Hz", "kHz"),
    *("N", "mN", "kN", "uN", "Pa", "kPa", "MPa", "GPa", "rad", "mrad", "urad", "deg", "K", "A"),
    *("N/m", "N/mm", "N/um", "kg/m^3", "g/cm^3", "kg*m^2", "g*mm^2", "mm^2", "mm^4"),
    *("N*m", "N*mm", "N*m/rad", "N*mm/rad", "N/rad"),
    *("V", "um/V", "N*s/m", "N*m*s/rad", "s/m"),
)
"""Units that are suggested for those that do not exist."""


@lru_cache(maxsize=1024)
def parse_unit(text: str) -> tuple[Fraction, Dimension]:
    """Read a unit such as `mm`, `N*m/rad`, `kg/m^3`, `kg/(m*s^2)` or `deg`.

    Returns the factor to the coherent SI unit, and its dimension; angles are pure numbers.
    Raises ExpressionError when the text is no unit, or one with an offset (degC) or a logarithm (dB).
    """
    if len(text) > MAX_LENGTH or not _ALLOWED.fullmatch(text):
        raise _not_a_unit(text)
    factor, dimension = _Reader(text).read()
    if max(map(abs, dimension)) > MAX_EXPONENT:
        raise ExpressionError(_TOO_HIGH)
    return factor, dimension


def is_unit(text: str) -> bool:
    """Whether a text is a unit that `parse_unit` reads."""
    try:
        parse_unit(text)
    except ExpressionError:
        return False
    return True


def parse_quantity(text: str) -> tuple[float, Dimension]:
    """Read a number followed by a unit, such as `0.3 mm`: value in SI, rounded once, and dimension.

    Raises ExpressionError when the text is not that.
    """
    number, unit = split_quantity(text)
    factor, dimension = parse_unit(unit) if unit else (Fraction(1), NUMBER)
    return to_si(number, factor), dimension


def is_number(text: str | bytes) -> bool:
    """Whether a text is a finite number and nothing else."""
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def split_quantity(text: str) -> tuple[str, str]:
    """The texts of the number and of the unit, empty where there is none.

    Raises ExpressionError when the text does not begin with a number.
    """
    stripped = text.strip()
    match = _NUMBER.match(stripped) if len(stripped) <= MAX_QUANTITY_LENGTH else None
    if match is None:
        raise ExpressionError(f"{text[:40]!r} is not a number with a unit", "write it like 0.3 mm")
    unit = stripped[match.end() :].strip()
    if unit[:1] == "[" and unit[-1:] == "]":
        unit = unit[1:-1]
    return match[0], unit


def to_si(number: str, factor: Fraction) -> float:
    """The decimal text of a number times the factor of its unit, rounded once: 0.3 mm is the float 0.3e-3.

    Raises ExpressionError when it is not finite.
    """
    value = float(number)
    if value and math.isfinite(value):
        try:
            value = float(Fraction(number) * factor)
        except OverflowError:
            value = math.inf
    if not math.isfinite(value):
        raise ExpressionError("a number must be finite")
    return value


class _Reader:
    """Recursive descent over a product of factors: a name with a power, 1, or a product in parentheses."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens: list[tuple[str, str, str]] = []
        position = 0
        while position < len(text.rstrip()):
            match = _TOKEN.match(text, position)
            if match is None:
                raise _not_a_unit(text)
            self.tokens.append((match[1] or "", match[2] or "", match[3] or ""))
            position = match.end()
        self.tokens.append(("", "", ""))
        self.at = 0

    def read(self) -> tuple[Fraction, Dimension]:
        result = self.product()
        if self.at != len(self.tokens) - 1:
            raise _not_a_unit(self.text)
        return result

    def take(self, *operators: str) -> str:
        operator = self.tokens[self.at][2]
        if operator and operator in operators:
            self.at += 1
            return operator
        return ""

    def product(self) -> tuple[Fraction, Dimension]:
        factor, dimension = self.factor()
        while operator := self.take("*", "/"):
            other, more = self.factor()
            sign = 1 if operator == "*" else -1
            factor *= other**sign
            dimension = dimension.times(more, sign)
        return factor, dimension

    def factor(self) -> tuple[Fraction, Dimension]:
        name, number, _ = self.tokens[self.at]
        if self.take("("):
            factor, dimension = self.product()
            if not self.take(")"):
                raise _not_a_unit(self.text)
        elif name or number == "1":
            self.at += 1
            factor, dimension = _unit(name) if name else (Fraction(1), NUMBER)
        else:
            raise _not_a_unit(self.text)
        return self.power(factor, dimension) if name and self.take("^", "**") else (factor, dimension)

    def power(self, factor: Fraction, dimension: Dimension) -> tuple[Fraction, Dimension]:
        parenthesis = self.take("(")
        number = self.tokens[self.at][1]
        self.at += 1
        if not number or number.endswith("/0") or (parenthesis and not self.take(")")):
            raise _not_a_unit(self.text)
        if "/" in number and not parenthesis:
            raise _not_a_unit(self.text)
        power = Fraction(number)
        if abs(power) > MAX_EXPONENT:
            raise ExpressionError(_TOO_HIGH)
        raised = factor**power if power.denominator == 1 else Fraction(float(factor) ** float(power))
        return Fraction(raised), dimension.power(power)


def _si_units() -> dict[str, tuple[Fraction, Dimension]]:
    """Exact factors and dimensions of the SI units of mechanics with their prefixes, and of a few others."""
    powers = {"p": -12, "n": -9, "u": -6, "µ": -6, "μ": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9}
    bases = {
        "m": (1, 0, 0, 0, 0),
        "s": (0, 0, 1, 0, 0),
        "A": (0, 0, 0, 1, 0),
        "K": (0, 0, 0, 0, 1),
        "N": (1, 1, -2, 0, 0),
        "Pa": (-1, 1, -2, 0, 0),
        "J": (2, 1, -2, 0, 0),
        "W": (2, 1, -3, 0, 0),
        "V": (2, 1, -3, -1, 0),
        "Hz": (0, 0, -1, 0, 0),
        "rad": (0, 0, 0, 0, 0),
    }
    ten = Fraction(10)
    found = {f"{p}{name}": (ten**power, exponents) for p, power in powers.items() for name, exponents in bases.items()}
    mass, length, angle = (0, 1, 0, 0, 0), (1, 0, 0, 0, 0), (0, 0, 0, 0, 0)
    found |= {f"{p}g": (ten ** (power - 3), mass) for p, power in powers.items()}
    found |= {"t": (ten**3, mass), "cm": (ten**-2, length), "in": (Fraction("0.0254"), length)}
    found |= {"deg": (Fraction(math.pi / 180), angle), "°": (Fraction(math.pi / 180), angle)}
    found |= {"min": (Fraction(60), (0, 0, 1, 0, 0)), "%": (Fraction(1, 100), angle)}
    return {name: (factor, Dimension(*map(Fraction, exponents))) for name, (factor, exponents) in found.items()}


_SI = _si_units()
"""Units that are known without the unit library, which takes longer to start than most models to solve."""


@cache
def _registry() -> UnitRegistry:
    from pint import UnitRegistry

    exact: Any = Fraction
    return UnitRegistry(non_int_type=exact, cache_folder=None)


def _unit(name: str) -> tuple[Fraction, Dimension]:
    """Exact factor and dimension of one unit, prefix included."""
    return _SI[name] if name in _SI else _of_library(name)


@lru_cache(maxsize=1024)
def _of_library(name: str) -> tuple[Fraction, Dimension]:
    """The same from the unit library."""
    registry: Any = _registry()
    try:
        unit = registry.parse_units(name)
        factor = Fraction(registry.get_base_units(unit)[0])
        dimensionality = dict(registry.get_dimensionality(unit))
        at_zero = registry.Quantity(Fraction(0), unit).to_base_units().magnitude
    except Exception as error:  # the unit library raises many kinds for text that is no unit
        raise _not_a_unit(name) from error
    if at_zero != 0:
        raise ExpressionError(f"{name} has an offset or a logarithm in it", "use K for temperatures")
    if not dimensionality.keys() <= set(_BASE):
        raise _not_a_unit(name, f"{name} is not a unit of mechanics")
    if factor.denominator > _RATIONAL:
        factor = Fraction(float(factor))
    return factor, Dimension(*(Fraction(dimensionality.get(base, 0)) for base in _BASE))


def _not_a_unit(text: str, rule: str = "") -> ExpressionError:
    shown = text if len(text) <= 40 else text[:37] + "..."
    lowered = {unit.lower(): unit for unit in reversed(FAMILIAR)}
    close = get_close_matches(text.strip().lower()[:40], lowered, n=3)
    hint = f"did you mean {' or '.join(lowered[c] for c in close)}?" if close else _FORMS
    return ExpressionError(rule or f"{shown!r} is not a unit", hint)


_FORMS = "units are written like mm, N*m/rad, kg/m^3, deg"
