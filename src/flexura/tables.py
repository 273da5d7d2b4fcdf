"""Short tables of SI numbers for readers: a few digits, prefixes that suit, and HTML that any page may have."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import islice
from math import floor, isfinite, isnan, log10
from typing import Any

import numpy as np

ROWS, COLUMNS = 12, 9
"""Most rows and columns of a table."""

LONGEST, LONGEST_FACT = 96, 240
"""Characters of text in a cell, and of a fact."""

ROUND_OFF = 1e-10
"""Shown as zero: quantities below so much of the largest one of their unit in a table."""

HELD = 1e-9
"""Compliances below so much of what they stand beside are none."""

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_LARGEST = {"m": 0, "s": 0, "rad": 0, "N": 9, "Pa": 9, "W": 9, "V": 3, "J": 9, "A": 0, "g": 3}
"""Symbols that take prefixes, with the largest power of ten that is customary."""
_LEADING = re.compile(r"(kg|rad|Pa|[msNWVJA])(?![\w^])(.*)")
_POWER = re.compile(r"\^(?:\((-?\d+)\)|(-?\d+))")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_HEADING = re.compile(r"(.*) \[(.+)\]")


@dataclass(frozen=True)
class Facts:
    """Values by what they are; a value without text is left out."""

    values: Mapping[str, Any]


@dataclass(frozen=True)
class Table:
    """Columns by heading, each with its SI unit in brackets unless it is plain; `what` the rows are, in the plural,
    and how many there are where `columns` has only the first; `longest`: characters of a cell."""

    columns: Mapping[str, Sequence[Any] | np.ndarray]
    what: str = "rows"
    title: str = ""
    count: int | None = None
    longest: int = LONGEST


def number(value: float, digits: int = 5) -> str:
    """A number in few digits; empty where it is not known."""
    if isnan(value):
        return ""
    if not isfinite(value):
        return "∞" if value > 0 else "-∞"
    return f"{value + 0.0:.{digits}g}"


def quantity(value: float | None, unit: str, digits: int = 5) -> str:
    """An SI value with the prefix that suits it, e.g. `0.00012` m as `120 µm`; empty where it is not known."""
    if value is None or isnan(value):
        return ""
    factor, shown = suited([[value]], unit)
    return f"{number(value / factor, digits)} {shown}".strip()


def stiffness(compliance: float, beside: float = 0.0) -> str:
    """One over a compliance; `held` where that is nothing, or nothing beside another."""
    return "held" if compliance <= HELD * beside else f"{1 / compliance:.4g}"


def percent(value: float | None, digits: int = 3) -> str:
    """A share or a relative error in per cent; empty where it is not known."""
    return "" if value is None or isnan(value) else f"{number(100 * value, digits)} %"


def counted(count: int, what: str) -> str:
    """A number of things, e.g. `1 mode`, `2 modes` and `2 frequencies`."""
    return f"{count} {what}" if count == 1 else f"{count} {re.sub('(?<![aeiou])y$', 'ie', what)}s"


def ends(interval: tuple[float, float], unit: str) -> str:
    """An interval of SI values with its unit."""
    return " to ".join(quantity(end, unit) for end in interval)


def in_mm(point: Iterable[float]) -> str:
    """A place in mm, without what is round-off."""
    return ", ".join(number(round(1e3 * float(x), 6), 4) for x in point)


def html_of(part: Facts | Table) -> str:
    """A part of a page, escaped; empty without anything to show."""
    return _facts(part) if isinstance(part, Facts) else _rows(part)


def _facts(part: Facts) -> str:
    cells = [(name, _cell(value, longest=LONGEST_FACT)) for name, value in part.values.items()]
    rows = [f"<tr>{_th(name)}{_td(text)}</tr>" for name, text in cells if text]
    return f"<table><tbody>{''.join(rows)}</tbody></table>" if rows else ""


def _rows(part: Table) -> str:
    shown = {name: list(islice(column, ROWS)) for name, column in islice(part.columns.items(), COLUMNS)}
    count = len(next(iter(part.columns.values()), ())) if part.count is None else part.count
    if not count:
        return ""
    columns = text_columns(shown, part.longest)
    right = [all(_is_number(x) for x in own) for own in shown.values()]
    head = "".join(map(_th, columns, right))
    body = "".join(f"<tr>{''.join(map(_td, cells, right))}</tr>" for cells in zip(*columns.values(), strict=True))
    title = f"<p>{escape(part.title)}</p>" if part.title else ""
    left = [(count - len(next(iter(shown.values()))), part.what), (len(part.columns) - len(shown), "columns")]
    more = "".join(f"<p>and {n} more {what}</p>" for n, what in left if n > 0)
    return f"{title}<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def text_columns(shown: Mapping[str, list[Any]], longest: int = LONGEST) -> dict[str, list[str]]:
    """The text of all cells by the headings as they are shown; columns of one unit have one prefix."""
    units = {name: own.groups() for name in shown if (own := _HEADING.fullmatch(name)) is not None}
    alike: dict[str, list[list[float]]] = {}
    for name, (_, unit) in units.items():
        alike.setdefault(unit, []).append([float(x) for x in shown[name] if _is_known(x)])
    prefixes = {unit: suited(groups, unit) for unit, groups in alike.items()}
    found: dict[str, list[str]] = {}
    for name, column in shown.items():
        what, unit = units.get(name, (name, ""))
        factor, written = prefixes.get(unit, (1.0, ""))
        noise = ROUND_OFF * _largest(x for own in alike.get(unit, []) for x in own) if written else 0.0
        heading = f"{what} [{written}]" if written else name
        found[heading] = [_cell(x, factor, noise, longest) for x in column]
    return found


def suited(groups: Sequence[Sequence[float]], unit: str) -> tuple[float, str]:
    """A factor and the unit that it makes, which shows most groups of numbers with one to four digits before the
    point, and the largest of them best."""
    leading = _LEADING.fullmatch(unit)
    sizes = [size for group in groups if (size := _largest(group)) > 0]
    if leading is None or not sizes or leading[0] == "rad/s" or (leading[1] == "kg" and leading[2]):
        return 1.0, _written(unit)
    symbol, rest = leading.groups()
    base = 1.0
    if symbol == "kg":
        symbol, base = "g", 1e-3
    sizes = [size for size in sizes if size > ROUND_OFF * max(sizes)]
    powers = [power for power in _PREFIXES if power <= _LARGEST[symbol]]

    def legible(power: int) -> tuple[int, bool, float]:
        scaled = [size / base / 10.0**power for size in sizes]
        off = abs(floor(log10(max(scaled))) - 1)
        return sum(0.1 <= size < 1e4 for size in scaled), 1 <= max(scaled) < 1e3, -off

    power = max(powers, key=legible)
    return base * 10.0**power, _written(_PREFIXES[power] + symbol + rest)


def _written(unit: str) -> str:
    """A unit with raised exponents and without signs of multiplication."""
    raised = _POWER.sub(lambda found: (found[1] or found[2]).translate(_RAISED), unit.replace("**", "^"))
    return "" if unit == "1" else raised.replace("*", " ")


def _largest(values: Iterable[float]) -> float:
    return max((abs(x) for x in values if isfinite(x)), default=0.0)


def _is_known(value: Any) -> bool:
    return _is_number(value) and value is not None


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, int | float | np.number) and not isinstance(value, bool | np.bool_))


def _cell(value: Any, factor: float = 1.0, noise: float = 0.0, longest: int = LONGEST) -> str:
    """A value in few characters; empty where there is none."""
    if value is None:
        return ""
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, float | np.floating):
        return number(0.0 if abs(value) < noise else float(value) / factor)
    text = " ".join(str(value).split())
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def _th(text: str, right: bool = False) -> str:
    return f'<th style="text-align:{"right" if right else "left"}">{escape(text)}</th>'


def _td(text: str, right: bool = False) -> str:
    return f'<td style="text-align:{"right" if right else "left"}">{escape(text)}</td>'
