"""What a channel measures, from the text of its unit, and the factor to SI."""

from __future__ import annotations

import re
from contextlib import suppress
from math import pi

from flexura.errors import ExpressionError, OptionError
from flexura.systems import UNITS
from flexura.units import Exponents, parse_unit

STANDARD_GRAVITY = 9.80665
"""m/s^2 in g, as accelerometers have it."""

_FIRST = (
    *("force", "moment", "displacement", "velocity", "acceleration"),
    *("rotation", "angular_velocity", "angular_acceleration", "voltage", "stress"),
)
_GRAVITIES = {"g": 1.0, "gn": 1.0, "g_n": 1.0, "g0": 1.0, "gs": 1.0, "mg": 1e-3, "ug": 1e-6}
_WRITTEN = str.maketrans({"²": "^2", "³": "^3", "·": "*", "⋅": "*", "−": "-"})
_WORDS = {
    **dict.fromkeys(("newton", "newtons"), "N"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("inch", "inches", "in"), "in"),
    "lbf": "lbf",
    "kn": "kN",
    **{own: own for own in ("mm", "cm", "rad", "ft", "deg")},
}
"""Units as other programs write them, in small letters."""

_POUNDS = ("lb", "lbs", "pound", "pounds", "lb-f", "lb_f")

FREQUENCIES = {
    **dict.fromkeys(("hz", "hertz", "cps", "c/s", "cycles/s", "cycles/sec"), 1.0),
    **dict.fromkeys(("khz", "kilohertz"), 1e3),
    **dict.fromkeys(("rad/s", "rad/sec", "radians/s", "radian/s", "radians/sec", "rads/s"), 1 / (2 * pi)),
    **dict.fromkeys(("rpm", "rev/min", "r/min", "1/min", "cpm"), 1 / 60),
}
"""Hz in units of frequency, in small letters. 1/s is none: it is Hz to one and rad/s to the next."""


def frequency_factor(label: str, what: str) -> float:
    """Hz in a unit of frequency such as Hz, kHz, rad/s or rpm. Raises OptionError, which names it, for any other."""
    found = FREQUENCIES.get("".join(label.split()).lower())
    if found is None:
        raise OptionError(f"{what}: frequencies are in Hz, kHz, rad/s or rpm, not in {label.strip()!r}")
    return found


def dimension(unit: str) -> Exponents:
    """Dimension of a unit of `UNITS`."""
    return parse_unit(unit)[1]


def refuse_unknown(quantity: object, what: str) -> None:
    """Raise OptionError, which names the channel, for anything but a key of `UNITS`."""
    if not isinstance(quantity, str) or quantity not in UNITS:
        raise OptionError(f"{what}: there is no quantity {quantity!r}; quantities: {', '.join(UNITS)}")


def quantity_of(text: str, quantity: str | None = None, what: str = "channel") -> tuple[str, float]:
    """Quantity, a key of `UNITS`, and factor to SI of a channel with a unit such as `m/s^2`, `m/s²`, `g`, `N` or `um`.

    `quantity` is what the channel is said to be; without it the unit decides, and a pure angle is a rotation. An
    acceleration in g or mg is in standard gravities, a force in lb in lbf. Raises OptionError, which names the channel,
    for a text that is no unit and a unit of something else.
    """
    if quantity is not None:
        refuse_unknown(quantity, what)
    label = text.strip()
    gravity = _GRAVITIES.get(label.lower())
    if gravity is not None and (quantity == "acceleration" or (quantity is None and gravity == 1.0)):
        return "acceleration", gravity * STANDARD_GRAVITY
    written = "lbf" if quantity == "force" and label.lower() in _POUNDS else _canonical(label)
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


def _canonical(label: str) -> str:
    """A unit with the field's many spellings (m/s2, M/SEC^2, ms-2, meter/sec**2) as the reader of units has it."""
    text = label.translate(_WRITTEN).replace("**", "^")
    text = re.sub(r"^(m|mm|in|rad)[ .*]?s\^?-([12])$", r"\1/s^\2", text)
    text = re.sub(r"(?<=[A-Za-z])([234])\b", r"^\1", text)
    is_shouted = text.upper() == text and len(text) > 1

    def word(match: re.Match[str]) -> str:
        own = match[0]
        if is_shouted and own in ("M", "S"):
            return own.lower()
        return _WORDS.get(own.lower(), own)

    return re.sub(r"[A-Za-z]+", word, text)


def split_response(label: str, quantity: str | None = None) -> tuple[str, str] | None:
    """Units of response and force of a label such as `(m/s²)/N`, `g/N`, `(1/N)*(m/s^2)` or `1/kg`; None for others."""
    text = label.translate(_WRITTEN).strip()
    inverse = re.fullmatch(r"\(?\s*1\s*/\s*([^()]+?)\)?\s*\*\s*\(?([^()]+)\)?", text)
    ends = (inverse[2], inverse[1]) if inverse is not None else None
    if ends is None and "/" in text:
        motion, _, cause = text.rpartition("/")
        ends = motion.strip(), cause.strip()
    if ends is not None and (_is_cause(ends[1].strip("() "))):
        return ends[0].removeprefix("(").removesuffix(")") if ends[0][:1] == "(" else ends[0], ends[1].strip("() ")
    try:
        factor, exponents = parse_unit(_canonical(text))
    except ExpressionError:
        return None
    if quantity is not None and factor == 1:
        motion, force = dimension(UNITS[quantity]), dimension("N")
        if exponents == tuple(a - b for a, b in zip(motion, force, strict=True)):
            return UNITS[quantity], "N"
    return None


def _is_cause(text: str) -> bool:
    """Whether a text is a unit of a force or a moment."""
    for quantity in ("force", "moment"):
        with suppress(OptionError):
            quantity_of(text, quantity)
            return True
    return False


def split_heading(text: str, what: str) -> tuple[str, str]:
    """Name and unit of a heading `name [unit]`. Raises OptionError when it has no unit."""
    match = re.fullmatch(r"\s*(.*?\S)\s*\[([^\[\]]+)\]\s*", text)
    if match is None:
        raise OptionError(f"{what}: {text.strip()!r} has no unit; write it as `name [unit]`, e.g. p1.z [m/s^2]")
    return match[1], match[2]
