"""Physical dimensions as exponents of the SI base units; no unit names, no conversion."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import NamedTuple

MAX_EXPONENT = 12


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
        """The coherent SI unit as text, with derived units where it has a customary one, e.g. `N/m`, `kg*m**2`; empty
        for a pure number."""
        if self in _NAMED:
            return _NAMED[self]
        parts = []
        for symbol, exponent in zip(("kg", "m", "s", "A", "K"), _reorder(self), strict=True):
            if exponent == 1:
                parts.append(symbol)
            elif exponent:
                parts.append(f"{symbol}**{_exponent(exponent)}")
        return "*".join(parts)

    @staticmethod
    def of_unit(text: str) -> Dimension | None:
        """Dimension of a coherent SI unit such as `kg*m**2*s**(-2)`, `N/m` or `1`; None when it is not one."""
        dimension, sign = NUMBER, 1
        for token in re.split(r"((?<![*])[*](?![*])|/(?!\d+\)))", text.replace(" ", "").replace("^", "**")):
            if token in ("*", "/"):
                sign = 1 if token == "*" else -1
                continue
            match = _FACTOR.fullmatch(token)
            if match is None or match[1] not in _COHERENT:
                return None
            try:
                exponent = Fraction(match[2] or match[3] or 1)
            except ZeroDivisionError:
                return None
            dimension = dimension.times(_COHERENT[match[1]].power(exponent), sign)
        return dimension if max(map(abs, dimension)) <= MAX_EXPONENT else None


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
FREQUENCY = _dim(time=-1)
TIME = _dim(time=1)
ACCELERATION = _dim(length=1, time=-2)
TRANSLATIONAL_DAMPING = _dim(mass=1, time=-1)
ROTATIONAL_DAMPING = _dim(length=2, mass=1, time=-1)
PER_SPEED = _dim(length=-1, time=1)
VOLTAGE = Dimension(Fraction(2), Fraction(1), Fraction(-3), Fraction(-1))
STROKE_PER_VOLT = LENGTH.times(VOLTAGE, -1)
STRAIN_PER_VOLT = NUMBER.times(VOLTAGE, -1)
TEMPERATURE = Dimension(temperature=Fraction(1))
STRAIN_PER_KELVIN = NUMBER.times(TEMPERATURE, -1)
TEMPERATURE_GRADIENT = TEMPERATURE.times(LENGTH, -1)
POWER = _dim(length=2, mass=1, time=-3)
CONDUCTANCE = POWER.times(TEMPERATURE, -1)
CONDUCTIVITY = CONDUCTANCE.times(LENGTH, -1)
HEAT_TRANSFER = CONDUCTANCE.times(AREA, -1)
HEAT_CAPACITY = _dim(length=2, time=-2).times(TEMPERATURE, -1)
_FACTOR = re.compile(r"([A-Za-z]+|1)(?:\*\*(?:(-?\d{1,3})|\((-?\d{1,3}(?:/\d{1,3})?)\)))?")
_COHERENT = {
    "1": NUMBER,
    "rad": NUMBER,
    "m": LENGTH,
    "kg": MASS,
    "s": _dim(time=1),
    "A": Dimension(current=Fraction(1)),
    "K": Dimension(temperature=Fraction(1)),
    "N": FORCE,
    "Pa": PRESSURE,
    "J": ROTATIONAL_STIFFNESS,
    "W": _dim(length=2, mass=1, time=-3),
    "Hz": FREQUENCY,
    "V": VOLTAGE,
}
_DERIVED = ("N", "Pa", "N/m", "N*m", "N/m**3", "m/N", "N*s/m", "N*m*s", "s/m", "W", "V", "m/V", "V/m")
_NAMED = {Dimension.of_unit(unit): unit for unit in _DERIVED}
"""Units of mechanics and actuators by dimension; those of 1/s are left, which are Hz as well as rad/s."""
