"""How quantities are written: names with arguments, and where they are asked."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from flexura.errors import ExpressionError, OptionError
from flexura.expressions import CONSTANTS, FUNCTIONS, Dimension
from flexura.study.questions.kinds import WORST
from flexura.units import parse_quantity, split_quantity

MOST_CHARACTERS = 20_000
"""Characters of what is asked at once."""

STROKE, COMMANDS = "stroke", "commands"
"""Stand for the `motion` that is described, or its only displacement, and for all ranges of actuators."""

_PATH = r"(?:[^\W\d]|\*)[\w.*?\[\]]*"
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_UNIT = r"(?:\[[^\[\]]*\]|(?!(?:at|under|over|along)\b)[A-Za-zµμ°%]+(?![\w(]))"
_TOKEN = re.compile(
    rf"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*{_UNIT}?)|(?P<name>[^\W\d]\w*)|(?P<other>\S))", re.DOTALL
)
_FURTHER = re.compile(r"(?:\s*(?:\^|\*\*)\s*-?\d+)?\s*[*/]\s*(?P<unit>[A-Za-zµμ°%]+)(?!\w|\s*\()")
"""What a unit goes on with after its first name: a power of that, and the next."""
_ARGUMENTS = re.compile(r"\s*\(([^()]*)\)")
_OPERATOR = re.compile(r"\s*[-+*/^<>=≤≥(\d.]")
_CLAUSE = re.compile(r"\s*\b(?P<word>at|under|over)\b(?=\s|\[|$)")
_PLACE = re.compile(rf"\s*(?:(?P<name>{_PATH})\s*=|(?P<stroke>{STROKE})\b)\s*(?P<value>{_NUMBER}\s*{_UNIT}?)")
_NEXT = re.compile(rf"\s*,(?=\s*{_PATH}\s*=(?!=))")
_FORCE = re.compile(rf"\s*(?P<value>[+-]?[\d.][^,]*?)\s+along\s+(?P<name>{_PATH})")
_NEXT_FORCE = re.compile(r"\s*,(?=\s*[+-]?[\d.][^,]*\s+along\s)")
_SOURCE = re.compile(rf"\s*(?P<name>{_PATH})(?!\s*[\w(=.])")
_RANGE = re.compile(rf"\s*(?P<name>{STROKE}|{COMMANDS})\b")
_PER = re.compile(r"(?<=[\w\])])\s+per\s+(?=[\d.])")


class Place(NamedTuple):
    """What is prescribed at a pose: its name, `NODE.DOF`, an actuator or `stroke`, and value in SI with its dimension,
    None where it was written without a unit; a force along the displacement of that name where it `pushes`."""

    name: str
    value: float
    dimension: Dimension | None
    pushes: bool = False


class Where(NamedTuple):
    """Where something is asked: at a pose, `over` the stroke or all commands, or under one `source` of disturbance."""

    places: tuple[Place, ...] = ()
    over: str = ""
    source: str = ""

    @property
    def is_given(self) -> bool:
        """Whether anything is said."""
        return bool(self.places or self.over or self.source)


NOWHERE = Where()


@dataclass(frozen=True)
class Asked:
    """A name that is asked for, with the texts of its arguments and where it is asked."""

    name: str
    arguments: tuple[str, ...] = ()
    where: Where = NOWHERE


class Span(NamedTuple):
    """Where an asked name stands in a text."""

    asked: Asked
    start: int
    stop: int


def separate(text: str) -> list[Asked]:
    """The names that a text asks for, separated by commas. Raises OptionError for anything else."""
    _refuse_long(text)
    names, position = list[Asked](), 0
    while True:
        name, position = _asked_at(text, position)
        names.append(name)
        rest = text[position:].strip()
        if not rest:
            return names
        if rest[0] != ",":
            raise OptionError(_unexpected(text, position))
        position = text.index(",", position) + 1


def names_in(text: str, is_unit: Callable[[str], bool] = lambda _: False) -> list[Span]:
    """The asked names in a formula, in order; functions, constants, numbers with units and operators are passed over.
    `is_unit` says of a name whether it is a unit and nothing that may be asked.

    Raises OptionError for poses that cannot be read.
    """
    _refuse_long(text)
    spans, position, is_number = list[Span](), 0, False
    while (match := _TOKEN.match(text, position)) is not None:
        position, name, start = match.end(), match["name"], match.start("name")
        if name is None:
            is_number = match["number"] is not None
            if is_number and not text[position - 1].isdigit() and text[position - 1] not in "].":
                while (more := _FURTHER.match(text, position)) is not None and is_unit(more["unit"]):
                    position = more.end()
            continue
        if is_number:
            raise OptionError(f"{text[:position].strip()!r}: a number is joined with what follows by an operator: *")
        if name in CONSTANTS or name in FUNCTIONS:
            continue
        asked, position = _asked_at(text, start)
        spans.append(Span(asked, start, position))
    return spans


def with_fractions(text: str) -> str:
    """A text in which `per` stands for what it means, `20 nm per 1 K` for `20 nm / 1 K`."""
    return _PER.sub(" / ", text)


def trailing(text: str) -> tuple[str, Where]:
    """A text without where it is asked, at its end, and this; nothing where it does not say."""
    _refuse_long(text)
    for match in _CLAUSE.finditer(text):
        head = text[: match.start()]
        if head.count("(") == head.count(")"):
            where, stop = _where_at(text, match.start())
            if not text[stop:].strip():
                return head, where
    return text, NOWHERE


def _refuse_long(text: str) -> None:
    if len(text) > MOST_CHARACTERS:
        raise OptionError(f"quantities have at most {MOST_CHARACTERS} characters, not {len(text)}")


def _asked_at(text: str, position: int) -> tuple[Asked, int]:
    """The asked name that begins at a position, and where it ends."""
    match = _TOKEN.match(text, position)
    if match is None:
        raise OptionError(f"a quantity is missing {_where(text, position)}; write names separated by commas")
    if match["name"] is None:
        raise OptionError(_unexpected(text, position))
    if match["name"] == WORST and (behind := _TOKEN.match(text, match.end())) is not None and behind["name"]:
        match = behind
    name, position = match["name"], match.end()
    arguments: tuple[str, ...] = ()
    if (inside := _ARGUMENTS.match(text, position)) is not None:
        arguments, position = tuple(_unquoted(part.strip()) for part in inside[1].split(",")), inside.end()
    elif re.match(r"\s*\(", text[position:]):
        raise OptionError(f"{name}: a ( is not closed {_where(text, position)}")
    where, position = _where_at(text, position)
    return Asked(name, arguments, where), position


def _where_at(text: str, position: int) -> tuple[Where, int]:
    """What a text says from a position on of where something is asked, and where that ends."""
    places, over, source = list[Place](), "", ""
    while (begun := _CLAUSE.match(text, position)) is not None:
        word, start = begun["word"], begun.end()
        if word == "at":
            more, position = _pose_at(text, start)
            places += more
        elif word == "over":
            if (found := _RANGE.match(text, start)) is None:
                rest = text[start:].strip()[:40] or "nothing"
                raise OptionError(f"`over` is followed by {STROKE} or {COMMANDS}, not by {rest!r}")
            over, position = found["name"], found.end()
        elif (force := _FORCE.match(text, start)) is not None:
            while force is not None:
                places.append(_place(force["name"], force["value"], pushes=True))
                position = force.end()
                further = _NEXT_FORCE.match(text, position)
                force = _FORCE.match(text, further.end()) if further is not None else None
        elif (found := _SOURCE.match(text, start)) is not None:
            source, position = found["name"], found.end()
        else:
            rest = text[start:].strip()[:40] or "nothing"
            raise OptionError(
                f"`under` is followed by VALUE UNIT along NODE.DOF, or by a disturbance, not by {rest!r};"
                " e.g. under 20 N along platform.x"
            )
    if bool(places) + bool(over) + bool(source) > 1:
        raise OptionError(f"{text.strip()!r}: one of a pose, `over` and a disturbance says where it is asked")
    return Where(tuple(places), over, source), position


def _place(name: str, written: str, pushes: bool = False) -> Place:
    try:
        value, dimension = parse_quantity(written)
        return Place(name, value, dimension if split_quantity(written)[1] else None, pushes)
    except ExpressionError as error:
        raise OptionError(f"{'along' if pushes else 'at'} {name} = {written.strip()}: {error}") from None


def _pose_at(text: str, position: int) -> tuple[tuple[Place, ...], int]:
    """The places of the pose that begins at a position, and where it ends."""
    places = list[Place]()
    while True:
        match = _PLACE.match(text, position)
        if match is None:
            rest = text[position:].strip()[:40] or "nothing"
            raise OptionError(
                "a pose is expected after `at`, NODE.DOF = VALUE UNIT, ACTUATOR = VALUE UNIT or stroke VALUE UNIT, not"
                f" {rest!r}; e.g. at platform.x = 2 mm"
            )
        places.append(_place(match["name"] or match["stroke"], match["value"]))
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
