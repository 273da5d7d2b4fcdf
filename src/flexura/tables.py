"""Numbers of SI units for readers, each in the unit that engineers of precision mechanisms write it in; short tables of
them, and HTML that any page may have."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from itertools import islice
from math import floor, isfinite, isnan, log10, pi
from typing import Any, Literal, NamedTuple, SupportsFloat

import numpy as np
from numpy.typing import ArrayLike

ROWS, COLUMNS = 12, 9
"""Most rows and columns of a table."""

LONGEST, LONGEST_FACT = 96, 240
"""Characters of text in a cell, and of a fact."""

JOINED = 6
"""Values with names of their own that are joined in one line."""

SHOWN_AS_ZERO = 1e-10
"""Quantities below so much of the largest one of their unit in a table."""

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_PREFIXED = {
    "m": (-12, 0), "s": (-12, 0), "N": (-9, 9), "Pa": (0, 9), "W": (-9, 9), "V": (-9, 3), "J": (-12, 9), "A": (-12, 0),
    "g": (-9, 3), "rad": (-9, 0), "Hz": (0, 3),
}  # fmt: skip
"""Symbols that take prefixes, with the smallest and the largest power of ten that is customary."""
_LEAST = {"m": 1.0, "MPa": 1e5, "GPa": 2e9, "kHz": 1e4}
"""From which SI value on a unit is taken, where that is not it with k, M or G, and a tenth of it else."""
_UNLIKE = {
    "rad": (("deg", pi / 180, 0.01), ("mrad", 1e-3, 1e-4), ("µrad", 1e-6, 1e-7), ("nrad", 1e-9, 0.0)),
    "N/m": (("N/µm", 1e6, 1e6), ("N/mm", 1e3, 1e3), ("N/m", 1.0, 0.0)),
    "V/m": (("V/µm", 1e6, 1e5), ("V/mm", 1e3, 1e2), ("V/m", 1.0, 0.0)),
    "m^2": (("m²", 1.0, 0.1), ("mm²", 1e-6, 0.0)),
    "m^3": (("m³", 1.0, 0.1), ("mm³", 1e-9, 0.0)),
    "m^4": (("m⁴", 1.0, 0.1), ("mm⁴", 1e-12, 0.0)),
    "kg*m^2": (("kg m²", 1.0, 0.1), ("kg mm²", 1e-6, 1e-5), ("g mm²", 1e-9, 0.0)),
}
"""Units that are written unlike the prefixed SI unit: their sizes, and from which size on each is taken."""
_LEADING = re.compile(r"(kg|rad|Pa|Hz|[msNWVJA])(?![\w^])(.*)")
_POWER = re.compile(r"\^(?:\((-?\d+)\)|(-?\d+))")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_NUMERIC = re.compile(r"$|(none|missed|driven|held|unknown|no evidence)$|(within |below |± )?[-+(]?[\d∞]")
_HEADING = re.compile(r"(.*) \[(.+)\]")


@dataclass(frozen=True)
class Facts:
    """Values by what they are; one without text is left out, and a mapping has a value for each of several names."""

    values: Mapping[str, Any]


@dataclass(frozen=True)
class Table:
    """Columns by heading, each with its SI unit in brackets unless it is plain; `what` the rows are, in the plural,
    and how many there are where `columns` has only the first; `longest`: characters of a cell in HTML; `most`: rows
    that are shown, by default all that there is room for, the first or, if `is_spread`, some from the first to the
    last."""

    columns: Mapping[str, Sequence[Any] | np.ndarray]
    what: str = "rows"
    title: str = ""
    count: int | None = None
    longest: int = LONGEST
    most: int | None = None
    is_spread: bool = False

    def shown(self, rows: int | None = None, columns: int | None = None) -> dict[str, list[Any]]:
        """Rows and columns, as many as are asked for and fit."""
        count = max(map(len, islice(self.columns.values(), 1)), default=0)
        rows = min(count, self.most or count, count if rows is None else rows)
        at = range(rows) if not self.is_spread or rows < 2 else [k * (count - 1) // (rows - 1) for k in range(rows)]
        return {name: [column[k] for k in at] for name, column in islice(self.columns.items(), columns)}

    def left_out(self, shown: Mapping[str, list[Any]]) -> Iterator[str]:
        """What is not among those rows and columns, in words."""
        lengths = [len(column) for column in islice(self.columns.values(), 1)]
        rows = (sum(lengths) if self.count is None else self.count) - len(next(iter(shown.values()), ()))
        for count, what in ((rows, self.what), (len(self.columns) - len(shown), "columns")):
            if count > 0:
                yield f"and {count} more {what}"


@dataclass(frozen=True)
class Line:
    """A sentence, which may be good or bad news."""

    text: str
    news: Literal["", "good", "bad"] = ""


Item = Facts | Table | Line
"""What a result is presented in; each medium has one writer of them."""


class Scale(NamedTuple):
    """The size in SI of a unit that readers know."""

    size: float
    unit: str

    def text(self, value: float, digits: int = 5) -> str:
        """An SI value in this unit; empty where it is not known."""
        return "" if isnan(value) else f"{number(value / self.size, digits)} {self.unit}".strip()

    def label(self, name: str) -> str:
        """What an axis of this unit is called."""
        return f"{name}, {self.unit}" if self.unit else name

    def heading(self, name: str) -> str:
        """What a column of this unit is called."""
        return f"{name} [{self.unit}]" if self.unit else name


def number(value: float, digits: int = 5) -> str:
    """A number in few digits, with a power of ten only far from one; empty where it is not known."""
    if isnan(value):
        return ""
    if not isfinite(value):
        return "∞" if value > 0 else "-∞"
    text = f"{value + 0.0:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < 1e7 else text


def significant(value: float, uncertainty: float, digits: int = 6) -> str:
    """A number in the digits that an uncertainty leaves, the last of them of its size, and at most so many."""
    if not (isfinite(value) and value):
        return f"{value:.{digits}g}"
    first = floor(log10(abs(value)))
    last = floor(log10(uncertainty)) if uncertainty > 0 and isfinite(uncertainty) else first - digits
    places = min(max(-last, -first), digits - 1 - first)
    return f"{round(value, places):.{max(places, 0)}f}"


def quantity(value: float | None, unit: str, digits: int = 5) -> str:
    """An SI value in the unit that suits it, e.g. `0.00002` m as `20 µm`; empty where it is not known."""
    return "" if value is None else suited([[value]], unit).text(value, digits)


def in_hz(value: SupportsFloat, digits: int = 5) -> str:
    """A frequency in Hz, in kHz from 10 kHz on."""
    return quantity(float(value), "Hz", digits)


def percent(value: float | None, digits: int = 3) -> str:
    """A share or a relative error in per cent; empty where it is not known."""
    return "" if value is None or isnan(value) else f"{number(100 * value, digits)} %"


def signed_percent(error: float | None) -> str:
    """A relative error with its sign, in two digits, in per cent; empty where it is not known."""
    return "" if error is None else f"{100 * error:+.2g} %"


def counted(count: int, what: str) -> str:
    """A number of things, e.g. `1 mode`, `2 modes` and `2 frequencies`."""
    return f"{count} {what}" if count == 1 else f"{count} {re.sub('(?<![aeiou])y$', 'ie', what)}s"


def ends(interval: tuple[float, float], unit: str, digits: int = 5) -> str:
    """An interval of SI values in one unit."""
    low, high = interval
    scale = scale_for(interval, unit)
    return f"{number(low / scale.size, digits)} to {scale.text(high, digits)}"


def vector(components: Iterable[float], unit: str) -> str:
    """Components of a vector in one unit, e.g. `(0, 0, -9.81) m/s²`."""
    values = [float(x) for x in components]
    scale = suited([values], unit)
    return f"({', '.join(number(x / scale.size) for x in values)}) {scale.unit}"


def in_mm(point: Iterable[float]) -> str:
    """A place in mm, without what is round-off."""
    return ", ".join(number(round(1e3 * float(x), 6), 4) for x in point)


def html_of(part: Item) -> str:
    """A part of a page, escaped; empty without anything to show."""
    if isinstance(part, Line):
        return f"<p>{escape(part.text)}</p>"
    return _facts(part) if isinstance(part, Facts) else _rows(part)


def _facts(part: Facts) -> str:
    cells = [(name, _cell(_joined(value), longest=LONGEST_FACT)) for name, value in part.values.items()]
    rows = [f"<tr>{_th(name)}{_td(text)}</tr>" for name, text in cells if text]
    return f"<table><tbody>{''.join(rows)}</tbody></table>" if rows else ""


def _joined(value: Any) -> Any:
    """The first of several values with their names, in one line."""
    if not isinstance(value, Mapping):
        return value
    texts = [f"{name} ({text})" for name, text in islice(value.items(), JOINED)]
    return ", ".join([*texts, f"and {len(value) - JOINED} more"] if len(value) > JOINED else texts)


def _rows(part: Table) -> str:
    shown = part.shown(ROWS, COLUMNS)
    if not any(shown.values()):
        return ""
    columns = text_columns(shown, part.longest)
    right = list(map(is_right, shown.values()))
    head = "".join(map(_th, columns, right))
    body = "".join(f"<tr>{''.join(map(_td, cells, right))}</tr>" for cells in zip(*columns.values(), strict=True))
    title = f"<p>{escape(part.title)}</p>" if part.title else ""
    more = "".join(f"<p>{text}</p>" for text in part.left_out(shown))
    return f"{title}<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def is_right(column: Iterable[Any]) -> bool:
    """Whether a column is set right: one of numbers, or of texts that begin with them."""
    return all(_is_number(x) or _NUMERIC.match(str(x)) is not None for x in column)


def text_columns(shown: Mapping[str, list[Any]], longest: int = LONGEST) -> dict[str, list[str]]:
    """The text of all cells by the headings as they are shown; columns of one unit have one prefix."""
    units = {name: own.groups() for name in shown if (own := _HEADING.fullmatch(name)) is not None}
    alike: dict[str, list[list[float]]] = {}
    for name, (_, unit) in units.items():
        own = [float(x) for x in shown[name] if _is_known(x)]
        alike.setdefault(unit, []).extend([[x] for x in own] if unit == "Hz" else [own])
    prefixes = {unit: suited(groups, unit) for unit, groups in alike.items()}
    found: dict[str, list[str]] = {}
    for name, column in shown.items():
        what, unit = units.get(name, (name, ""))
        factor, written = prefixes.get(unit, Scale(1.0, ""))
        noise = SHOWN_AS_ZERO * _largest(x for own in alike.get(unit, []) for x in own) if written else 0.0
        heading = prefixes[unit].heading(what) if written else name
        found[heading] = [_cell(x, factor, noise, longest) for x in column]
    return found


def suited(groups: Iterable[Iterable[float]], unit: str) -> Scale:
    """The scale that shows most groups of SI numbers, each by its largest, with up to four digits before the point;
    of several the one in which the largest of all is customary."""
    unit = unit.replace("**", "^").replace("·", "*").replace(" ", "*")
    sizes = [size for group in groups if (size := _largest(group)) > 0]
    scales = scales_of(unit)
    if len(scales) == 1 or not sizes:
        return next((scale for scale, _ in scales if scale.size == 1.0), scales[0][0])
    most, longest = max(sizes), 1e5 if unit == "Hz" else 1e4
    taken = next(scale for scale, least in scales if most >= least)

    def legible(scale: Scale) -> tuple[int, bool]:
        return sum(0.1 <= size / scale.size < longest for size in sizes if size > SHOWN_AS_ZERO * most), scale == taken

    return max((scale for scale, _ in scales), key=legible)


def scale_for(values: ArrayLike, unit: str) -> Scale:
    """The scale that suits SI values together. Frequencies count one by one: their smallest are not round-off."""
    own = np.asarray(values, dtype=float).ravel().tolist()
    return suited([[x] for x in own] if unit == "Hz" else [own], unit)


@cache
def scales_of(unit: str) -> tuple[tuple[Scale, float], ...]:
    """The scales in which a unit is written, the largest first, with the least SI value in each."""
    if unit in _UNLIKE:
        return tuple((Scale(size, name), least) for name, size, least in _UNLIKE[unit])
    leading = _LEADING.fullmatch(unit)
    if leading is None or unit == "rad/s" or (leading[1] == "kg" and leading[2]):
        return ((Scale(1.0, _written(unit)), 0.0),)
    symbol, rest = leading.groups()
    symbol, base = ("g", 1e-3) if symbol == "kg" else (symbol, 1.0)
    low, high = _PREFIXED[symbol]
    found = []
    for power in sorted((own for own in _PREFIXES if low <= own <= high), reverse=True):
        name, size = _PREFIXES[power] + symbol, base * 10.0**power
        least = _LEAST.get(name, size if power > 0 else 0.1 * size)
        found.append((Scale(size, _written(name + rest)), 0.0 if power == low else least))
    return tuple(found)


def _written(unit: str) -> str:
    """A unit with raised exponents and without signs of multiplication."""
    raised = _POWER.sub(lambda found: (found[1] or found[2]).translate(_RAISED), unit)
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
