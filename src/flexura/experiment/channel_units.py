"""What a channel measures, from the text of its unit, and the factor to SI."""

from __future__ import annotations

import re

from flexura.errors import ExpressionError, OptionError
from flexura.systems.channel import UNITS
from flexura.units import Exponents, parse_unit

STANDARD_GRAVITY = 9.80665
"""m/s^2 in g, as accelerometers have it."""

_FIRST = (
    *("force", "moment", "displacement", "velocity", "acceleration"),
    *("rotation", "angular_velocity", "angular_acceleration", "voltage", "stress"),
)
_GRAVITIES = ("g", "gn", "g_n", "G", "g0")
_WRITTEN = str.maketrans({"²": "^2", "³": "^3", "·": "*", "⋅": "*", "−": "-"})


def dimension(unit: str) -> Exponents:
    """Dimension of a unit of `UNITS`."""
    return parse_unit(unit)[1]


def quantity_of(text: str, quantity: str | None = None, what: str = "channel") -> tuple[str, float]:
    """Quantity, a key of `UNITS`, and factor to SI of a channel with a unit such as `m/s^2`, `m/s²`, `g`, `N` or `um`.

    `quantity` is what the channel is said to be; without it the unit decides, and a pure angle is a rotation. Raises
    OptionError, which names the channel, for a text that is no unit and a unit of something else.
    """
    if quantity is not None and quantity not in UNITS:
        raise OptionError(f"{what}: there is no quantity {quantity!r}; quantities: {', '.join(UNITS)}")
    label = text.strip()
    if label in _GRAVITIES and quantity in (None, "acceleration"):
        return "acceleration", STANDARD_GRAVITY
    written = re.sub(r"(?<=[A-Za-z])([234])\b", r"^\1", label.translate(_WRITTEN))
    try:
        factor, exponents = parse_unit(written)
    except ExpressionError as error:
        raise OptionError(f"{what}: {error}") from None
    if quantity is None:
        quantity = next((q for q in _FIRST if dimension(UNITS[q]) == exponents), None)
        if quantity is None:
            raise OptionError(f"{what}: {label} is no unit of a force or a motion; units are, e.g., N, m/s^2, g, um")
    elif dimension(UNITS[quantity]) != exponents:
        raise OptionError(
            f"{what}: {label} is no unit of {quantity.replace('_', ' ')}, which is read in {UNITS[quantity]}"
        )
    return quantity, float(factor)


def split_heading(text: str, what: str) -> tuple[str, str]:
    """Name and unit of a heading `name [unit]`. Raises OptionError when it has no unit."""
    match = re.fullmatch(r"\s*(.*?\S)\s*\[([^\[\]]+)\]\s*", text)
    if match is None:
        raise OptionError(f"{what}: {text.strip()!r} has no unit; write it as `name [unit]`, e.g. p1.z [m/s^2]")
    return match[1], match[2]
