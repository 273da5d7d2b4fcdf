"""The text of what is asked, taken apart: names with arguments, and poses.

    asked    = name ["(" argument {"," argument} ")"] ["at" pose]
    pose     = place {"," place}
    place    = (NODE.DOF | "stroke") ["="] number [unit]

Units are single names, or any unit in square brackets; in formulas they may be products of names, as `N/mm`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from flexura.errors import ExpressionError, OptionError
from flexura.expressions import CONSTANTS, FUNCTIONS, Dimension
from flexura.units import parse_quantity, split_quantity

MAX_LENGTH = 20_000
"""Characters of what is asked at once."""

STROKE = "stroke"
"""Stands for the only displacement of the `motion` that is described."""

_PATH = r"[^\W\d][\w.*?\[\]]*"
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_UNIT = r"(?:\[[^\[\]]*\]|(?!at\b)[A-Za-zµμ°%]+(?![\w(]))"
_TOKEN = re.compile(
    rf"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*{_UNIT}?)|(?P<name>[^\W\d]\w*)|(?P<other>\S))", re.DOTALL
)
_FURTHER = re.compile(r"(?:\s*(?:\^|\*\*)\s*-?\d+)?\s*[*/]\s*(?P<unit>[A-Za-zµμ°%]+)(?!\w|\s*\()")
"""What a unit goes on with after its first name: a power of that, and the next."""
_ARGUMENTS = re.compile(r"\s*\(([^()]*)\)")
_OPERATOR = re.compile(r"\s*[-+*/^<>=≤≥(\d.]")
_AT = re.compile(r"\s*\bat\b(?=\s|\[|$)")
_PLACE = re.compile(rf"\s*(?:(?P<name>{_PATH})\s*=|(?P<stroke>{STROKE})\b)\s*(?P<value>{_NUMBER}\s*{_UNIT}?)")
_NEXT = re.compile(rf"\s*,(?=\s*{_PATH}\s*=(?!=))")


class Place(NamedTuple):
    """A displacement of a pose: its name, `NODE.DOF` or `stroke`, and value in SI with its dimension, None where it was
    written without a unit."""

    name: str
    value: float
    dimension: Dimension | None


@dataclass(frozen=True)
class Asked:
    """A name that is asked for, with the texts of its arguments and the places of its pose."""

    name: str
    arguments: tuple[str, ...] = ()
    at: tuple[Place, ...] = ()


class Span(NamedTuple):
    """Where an asked name stands in a text."""

    asked: Asked
    start: int
    stop: int


def separate(text: str) -> list[Asked]:
    """The names that a text asks for, separated by commas. Raises OptionError for anything else."""
    _refuse_long(text)
    found, position = list[Asked](), 0
    while True:
        asked, position = _asked_at(text, position)
        found.append(asked)
        rest = text[position:].strip()
        if not rest:
            return found
        if rest[0] != ",":
            raise OptionError(_unexpected(text, position))
        position = text.index(",", position) + 1


def names_in(text: str, is_unit: Callable[[str], bool] = lambda _: False) -> list[Span]:
    """The asked names in a formula, in order; functions, constants, numbers with units and operators are passed over.
    `is_unit` says of a name whether it is a unit and nothing that may be asked.

    Raises OptionError for poses that cannot be read.
    """
    _refuse_long(text)
    found, position, is_number = list[Span](), 0, False
    while (match := _TOKEN.match(text, position)) is not None:
        position, name, start = match.end(), match["name"], match.start("name")
        if name is None:
            is_number = match["number"] is not None
            if is_number and not text[position - 1].isdigit() and text[position - 1] not in "].":
                position = _end_of_unit(text, position, is_unit)
            continue
        if is_number:
            raise OptionError(f"{text[:position].strip()!r}: a number is joined with what follows by an operator: *")
        if name in CONSTANTS or name in FUNCTIONS:
            continue
        asked, position = _asked_at(text, start)
        found.append(Span(asked, start, position))
    return found


def _end_of_unit(text: str, position: int, is_unit: Callable[[str], bool]) -> int:
    """Where a unit ends whose first name ends at a position."""
    while (more := _FURTHER.match(text, position)) is not None and is_unit(more["unit"]):
        position = more.end()
    return position


def trailing_pose(text: str) -> tuple[str, tuple[Place, ...]]:
    """A text without the pose that it ends with, and the places of this one; none where it has none."""
    _refuse_long(text)
    for match in reversed(list(_AT.finditer(text))):
        head = text[: match.start()]
        if head.count("(") == head.count(")"):
            places, stop = _pose_at(text, match.end())
            if not text[stop:].strip():
                return head, places
            return text, ()
    return text, ()


def _refuse_long(text: str) -> None:
    if len(text) > MAX_LENGTH:
        raise OptionError(f"quantities have at most {MAX_LENGTH} characters, not {len(text)}")


def _asked_at(text: str, position: int) -> tuple[Asked, int]:
    """The asked name that begins at a position, and where it ends."""
    match = _TOKEN.match(text, position)
    if match is None:
        raise OptionError(f"a quantity is missing {_where(text, position)}; write names separated by commas")
    if match["name"] is None:
        raise OptionError(_unexpected(text, position))
    name, position = match["name"], match.end()
    arguments: tuple[str, ...] = ()
    if (own := _ARGUMENTS.match(text, position)) is not None:
        arguments, position = tuple(_unquoted(part.strip()) for part in own[1].split(",")), own.end()
    elif re.match(r"\s*\(", text[position:]):
        raise OptionError(f"{name}: a ( is not closed {_where(text, position)}")
    places: tuple[Place, ...] = ()
    if (begun := _AT.match(text, position)) is not None:
        places, position = _pose_at(text, begun.end())
    return Asked(name, arguments, places), position


def _pose_at(text: str, position: int) -> tuple[tuple[Place, ...], int]:
    """The places of the pose that begins at a position, and where it ends."""
    places = list[Place]()
    while True:
        match = _PLACE.match(text, position)
        if match is None:
            rest = text[position:].strip()[:40] or "nothing"
            raise OptionError(
                f"a pose is expected after `at`, NODE.DOF = VALUE UNIT or stroke VALUE UNIT, not {rest!r};"
                " e.g. at platform.x = 2 mm"
            )
        name, written = match["name"] or match["stroke"], match["value"]
        try:
            value, exponents = parse_quantity(written)
            dimension = Dimension(*exponents) if split_quantity(written)[1] else None
        except ExpressionError as error:
            raise OptionError(f"at {name} = {written.strip()}: {error}") from None
        if name in {place.name for place in places}:
            raise OptionError(f"at {name}: a displacement is given twice in one pose")
        places.append(Place(name, value, dimension))
        position = match.end()
        if (more := _NEXT.match(text, position)) is None:
            return tuple(places), position
        position = more.end()


def _unquoted(text: str) -> str:
    """A text without the quotation marks around it, as patterns have them in files."""
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] and text[0] in "\"'" else text


def _where(text: str, position: int) -> str:
    before = text[:position].strip()
    return f"after {before[-40:]!r}" if before else f"in {text[:40]!r}"


def _unexpected(text: str, position: int) -> str:
    if _OPERATOR.match(text, position):
        return (
            f"{text.strip()[:40]!r} is a formula; quantities are names alone here, separated by commas: f1, mass."
            " Formulas are goals and limits of an optimum, requirements of tolerances, published numbers"
        )
    return f"{text[position:].strip()[:40]!r} was not expected {_where(text, position)}; names are separated by commas"
