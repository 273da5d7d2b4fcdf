"""Physical dimensions as exponents of the SI base units; no unit names, no conversion."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple


class Dimension(NamedTuple):
    """Exponents of metre, kilogram, second, ampere and kelvin."""

    length: Fraction = Fraction(0)
    mass: Fraction = Fraction(0)
    time: Fraction = Fraction(0)
    current: Fraction = Fraction(0)
    temperature: Fraction = Fraction(0)

    def times(self, other: Dimension, sign: int = 1) -> Dimension:
        """Dimension of a product (`sign=1`) or of a quotient (`sign=-1`)."""
        return Dimension(*(a + sign * b for a, b in zip(self, other, strict=True)))

    def power(self, exponent: Fraction) -> Dimension:
        """Dimension of a power."""
        return Dimension(*(a * exponent for a in self))

    def unit(self) -> str:
        """The coherent SI unit as text, e.g. `kg*m**2`; empty for a pure number."""
        parts = []
        for symbol, exponent in zip(("kg", "m", "s", "A", "K"), _reorder(self), strict=True):
            if exponent == 1:
                parts.append(symbol)
            elif exponent:
                parts.append(f"{symbol}**{_exponent(exponent)}")
        return "*".join(parts)


def _reorder(d: Dimension) -> tuple[Fraction, ...]:
    return (d.mass, d.length, d.time, d.current, d.temperature)


def _exponent(value: Fraction) -> str:
    return str(value) if value.denominator == 1 and value > 0 else f"({value})"


def _dim(length: int = 0, mass: int = 0, time: int = 0) -> Dimension:
    return Dimension(Fraction(length), Fraction(mass), Fraction(time))


NUMBER = _dim()
LENGTH = _dim(length=1)
AREA = _dim(length=2)
SECOND_MOMENT = _dim(length=4)
MASS = _dim(mass=1)
INERTIA = _dim(length=2, mass=1)
DENSITY = _dim(length=-3, mass=1)
PRESSURE = _dim(length=-1, mass=1, time=-2)
FORCE = _dim(length=1, mass=1, time=-2)
TRANSLATIONAL_STIFFNESS = _dim(mass=1, time=-2)
ROTATIONAL_STIFFNESS = _dim(length=2, mass=1, time=-2)
