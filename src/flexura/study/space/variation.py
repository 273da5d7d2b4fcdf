"""Variables from text with units and from Python, held against the parameters of a mechanism."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.errors import OptionError
from flexura.expressions import Expression
from flexura.mechanism import HELD, Mechanism, Parameter
from flexura.modelfile import parse_override
from flexura.study.space.variables import Variable
from flexura.units import split_quantity

Range = tuple[float, float] | tuple[float, float, int]
Varied = str | Sequence["str | Variable"] | Mapping[str, "str | Range | ArrayLike"]
"""What varies, by name: text with units, a tuple (low, high) or (low, high, count), or a list or array of values."""

FORM = "NAME=LOW:HIGH[:COUNT][:log|:integer] or NAME=VALUE,VALUE is expected, with units, e.g. thickness=0.2mm:0.6mm:50"
_WORDS = ("log", "linear", "integer")
_COMMA = re.compile(r",(?![^(]*\))")


def variables(mechanism: Mechanism, vary: Varied, fixed: Iterable[str] = ()) -> tuple[Variable, ...]:
    """The variables that text or Python describes, in order.

    Text is `NAME=LOW:HIGH`, with a count, the word `log` or `integer` behind further colons, or a list `NAME=A,B,C`;
    a number without a unit has that of the next. In Python a tuple is a range, (low, high) or (low, high, count), and
    a list or an array is values, in SI. Raises OptionError for what cannot be read, unknown parameters, those named
    twice, those that follow from others, those that are `fixed` to a value, empty ranges, and values outside the bounds
    of a parameter.
    """
    found: list[Variable] = []
    for entry in _entries(vary):
        own = entry if isinstance(entry, Variable) else _read(mechanism, *entry)
        own = replace(own, unit=_checked(mechanism, own, fixed))
        if own.name in {other.name for other in found}:
            raise OptionError(f"{own.name} varies already; give it once")
        found.append(own)
    if not found:
        raise OptionError(f"nothing varies; {FORM}")
    return tuple(found)


def _entries(vary: Any) -> list[Variable | tuple[str, Any]]:
    """Variables, or names with what is given of them."""
    if isinstance(vary, Mapping):
        return list(vary.items())
    texts = [vary] if isinstance(vary, str | Variable) else vary
    if not isinstance(texts, Iterable) or any(not isinstance(own, str | Variable) for own in texts):
        raise OptionError(f"what varies is given by name, as {{'thickness': (2e-4, 6e-4)}}, or as text: {FORM}")
    return [own if isinstance(own, Variable) else _named(own) for own in texts]


def _named(text: str) -> tuple[str, str]:
    name, equals, rest = (part.strip() for part in text.partition("="))
    if not (name and equals and rest):
        raise OptionError(FORM)
    return name, rest


def _read(mechanism: Mechanism, name: str, given: Any) -> Variable:
    unit = _parameter(mechanism, name).unit
    if isinstance(given, str):
        return _of_text(mechanism, name, given, unit)
    if not isinstance(given, tuple):
        return Variable.of(name, [float(given)] if isinstance(given, int | float | np.number) else given, unit)
    if len(given) not in (2, 3) or any(not isinstance(own, int | float | np.number) for own in given):
        raise OptionError(f"{name}: a tuple is a range, (low, high) or (low, high, count); a list gives values")
    if len(given) == 3 and given[2] != round(given[2]):
        raise OptionError(f"{name}: the third number of a range is a count, not {given[2]:g}; a list gives values")
    count = int(given[2]) if len(given) == 3 else None
    return Variable(name, float(given[0]), float(given[1]), count=count, unit=unit)


def _of_text(mechanism: Mechanism, name: str, text: str, unit: str) -> Variable:
    parts = [part.strip() for part in text.split(":")]
    if len(parts) == 1:
        values = _with_units([part.strip() for part in _COMMA.split(text)])
        return Variable.of(name, [_value(mechanism, name, own) for own in values], unit)
    low, high = (_value(mechanism, name, own) for own in _with_units(parts[:2]))
    count, words = None, parts[2:]
    if words and re.fullmatch(r"[+-]?\d+", words[0]):
        count = int(words.pop(0))
    if any(word not in _WORDS for word in words) or len(set(words)) < len(words) or {"log", "linear"} <= set(words):
        raise OptionError(f"{name}: {':'.join(words)!r} is no count, nor one of {', '.join(_WORDS)}; {FORM}")
    kind = "integer" if "integer" in words else "continuous"
    return Variable(name, low, high, kind, count, "log" if "log" in words else "linear", unit=unit)


def _with_units(parts: list[str]) -> list[str]:
    """Texts of quantities, those without a unit with that of the next that has one."""
    found, unit = list[str](), ""
    for part in reversed(parts):
        if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", part):
            found.append(f"{part} {unit}".strip())
        else:
            unit = split_quantity(part)[1] if re.match(r"[+-]?[.\d]", part) else ""
            found.append(part)
    return found[::-1]


def _value(mechanism: Mechanism, name: str, text: str) -> float:
    if not text:
        raise OptionError(f"{name}: a value is missing; {FORM}")
    try:
        return parse_override(mechanism, f"{name}={text}")[1]
    except OptionError as error:
        raise OptionError(f"{name}: {text!r}: {error}") from None


def _parameter(mechanism: Mechanism, name: str) -> Parameter:
    if name not in mechanism.parameters:
        close = get_close_matches(str(name), mechanism.parameters, n=1)
        known = ", ".join(mechanism.parameters) or "none"
        hint = f"did you mean {close[0]!r}?" if close else f"parameters: {known}"
        raise OptionError(f"{name!r} is not a parameter; {hint}")
    if mechanism.parameters[name].is_held:
        raise OptionError(f"{name} is {HELD}")
    return mechanism.parameters[name]


def _checked(mechanism: Mechanism, own: Variable, fixed: Iterable[str]) -> str:
    """The SI unit of the parameter of a variable. Raises OptionError where it cannot vary like that."""
    parameter = _parameter(mechanism, own.name)
    if isinstance(parameter.value, Expression):
        needs = ", ".join(sorted(parameter.value.names))
        raise OptionError(f"{own.name} = {parameter.value} follows from {needs}: vary {needs}, or give it a number")
    if own.name in fixed:
        raise OptionError(f"{own.name} has a value already, so it cannot vary; give one or the other")
    unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
    low, high = parameter.minimum, parameter.maximum
    if own.distribution is None and isinstance(low, float) and own.low < low:
        raise OptionError(f"{own.name}: {own.low:g}{unit} is below the minimum of the parameter, {low:g}{unit}")
    if own.distribution is None and isinstance(high, float) and own.high > high:
        raise OptionError(f"{own.name}: {own.high:g}{unit} is above the maximum of the parameter, {high:g}{unit}")
    return parameter.unit
