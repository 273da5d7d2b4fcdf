"""Writing SI floats as text with units that reads back to exactly the same float."""

from __future__ import annotations

from contextlib import suppress
from fractions import Fraction
from functools import cache

from flexura.errors import ExpressionError
from flexura.expressions import Dimension
from flexura.units.parse import parse_unit, to_si

_PRETTY = (
    ("m", "mm", "um", "km", "nm"),
    ("m^2", "mm^2"),
    ("m^3", "mm^3"),
    ("m^4", "mm^4"),
    ("kg", "g", "mg"),
    ("kg*m^2", "g*mm^2", "kg*mm^2"),
    ("kg/m^3",),
    ("MPa", "GPa", "kPa", "Pa"),
    ("N", "mN", "kN", "uN"),
    ("N/m", "N/um", "N/mm"),
    ("N*m/rad", "N*mm/rad"),
    ("s", "ms", "us"),
    ("Hz", "kHz"),
    ("m/s",),
    ("m/s^2",),
    ("W",),
    ("K",),
    ("A",),
    ("V",),
    ("um/V", "m/V"),
    ("N*s/m",),
    ("N*m*s/rad",),
    ("s/m",),
)
"""Units to choose from, by dimension; the first is preferred."""
_ANGLES = ("deg", "rad")


def format_number(value: float) -> str:
    """The shortest decimal text of a float that reads back to it, without a trailing `.0`."""
    return repr(float(value)).removesuffix(".0")


def format_quantity(value: float, dimension: Dimension, *, angle: bool = False) -> str:
    """Write an SI value with a unit, e.g. `0.3 mm`, `71.7 GPa`, `90 deg`; pure numbers carry none.

    Of the customary units of the dimension, takes the one that is easiest to read among those that read
    back to exactly the same float, and the coherent SI unit when there is none.
    """
    if angle:
        units: tuple[str, ...] = _ANGLES
    elif not any(dimension):
        return format_number(value)
    else:
        units = _customary().get(dimension, ())
    written = [text for unit in units if (text := _exact(value, unit)) is not None]
    if not written:
        return f"{format_number(value)} {_base_unit(dimension)}"
    return min(written, key=_clumsiness)


def customary_unit(dimension: Dimension) -> str | None:
    """The customary unit of a dimension, e.g. `N*s/m`; None where there is none."""
    return _customary().get(dimension, (None,))[0]


@cache
def _customary() -> dict[Dimension, tuple[str, ...]]:
    return {parse_unit(units[0])[1]: units for units in _PRETTY}


def _exact(value: float, unit: str) -> str | None:
    """`value` in the unit when that text reads back to exactly `value`."""
    factor, _ = parse_unit(unit)
    with suppress(OverflowError, ExpressionError):
        scaled = float(Fraction(value) / factor)
        for text in (*(f"{scaled:.{digits}g}" for digits in (6, 9, 12, 15)), repr(scaled)):
            if to_si(text, factor) == value:
                return f"{format_number(float(text))} {unit}"
    return None


def _clumsiness(text: str) -> tuple[bool, int, bool]:
    """Texts with an exponent, with many digits, or far from one are the harder to read."""
    number = text.partition(" ")[0].lstrip("-")
    digits = number.replace(".", "").strip("0")
    return "e" in number, len(digits), not 0.1 <= float(number) < 1000


def _base_unit(dimension: Dimension) -> str:
    length, mass, time, current, temperature = dimension
    powers = {"kg": mass, "m": length, "s": time, "A": current, "K": temperature}
    parts = []
    for symbol, power in powers.items():
        if power == 1:
            parts.append(symbol)
        elif power:
            parts.append(f"{symbol}^{power}" if power.denominator == 1 else f"{symbol}^({power})")
    return "*".join(parts) or "rad"
