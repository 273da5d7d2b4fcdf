"""What may be asked of a design, and how that is written: names with arguments, and poses."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

from flexura.errors import ExpressionError, OptionError
from flexura.expressions import CONSTANTS, FUNCTIONS, Dimension
from flexura.expressions import dimension as dimensions
from flexura.mechanism import suggestion
from flexura.units import is_unit, parse_quantity, parse_unit, split_quantity

Argument = Literal["dof", "body", "member", "actuator", "output", "input", "hertz", "parameter", "disturbance"]
"""What an argument names or is."""

Poses = Literal["any", "needed", "same", "none"]
"""Whether something is asked at rest or at a pose, at a pose alone, is the same everywhere, or is asked at rest alone.
"""

SIGNS: dict[Argument, str] = {
    "dof": "NODE.DOF",
    "body": "BODY",
    "member": "MEMBER",
    "actuator": "ACTUATOR",
    "output": "OUTPUT",
    "input": "INPUT",
    "hertz": "HZ",
    "parameter": "PARAMETER",
    "disturbance": "DISTURBANCE",
}
"""How arguments are written where a name is explained."""


@dataclass(frozen=True)
class Kind:
    """A name that may be asked: its arguments, of which the last `optional` may be left out, and where it is asked."""

    name: str
    meaning: str
    arguments: tuple[Argument, ...] = ()
    optional: int = 0
    poses: Poses = "any"

    @property
    def written(self) -> str:
        """How it is asked, e.g. `mass[(BODY)]`."""
        least = len(self.arguments) - self.optional
        inside = ", ".join(SIGNS[argument] for argument in self.arguments[:least])
        for argument in self.arguments[least:]:
            inside += f"[, {SIGNS[argument]}]" if inside else SIGNS[argument]
        if not inside:
            return self.name
        return f"{self.name}({inside})" if least else f"{self.name}[({inside})]"


FREQUENCY = "f"

KINDS = {
    kind.name: kind
    for kind in (
        Kind(FREQUENCY, "natural frequency of the mode in which this moves most", ("dof",)),
        Kind("mass", "mass of everything, or of a rigid body", ("body",), 1, "same"),
        Kind("stiffness", "force for a unit displacement, everything else free", ("dof",)),
        Kind("compliance", "displacement by a unit force there, or at the second place", ("dof", "dof"), 1),
        Kind("coupling", "displacement by a unit command", ("actuator", "dof")),
        Kind("amplification", "displacement over the elongation of the actuator that makes it", ("actuator", "dof")),
        Kind("stress", "largest von Mises stress, of all members or of some", ("member",), 1),
        Kind("margin", "least yield stress over stress, of all members or of some", ("member",), 1),
        Kind("force", "force that holds a pose, along a displacement of it", ("dof",), 0, "needed"),
        Kind("reach", "stroke to either side until something yields", ("dof",), 0, "none"),
        Kind("buckling", "factor on all loads at which it buckles"),
        Kind("frf", "magnitude of the frequency response", ("output", "input", "hertz")),
        Kind("frf_peak", "its largest magnitude in a band", ("output", "input", "hertz", "hertz")),
        Kind("rms", "root mean square under all disturbances described, or under one", ("output", "disturbance"), 1),
        Kind("parameter", "value of a parameter, as by its name alone", ("parameter",), 0, "same"),
    )
}

NUMBERED = "f1, f2, ..."
"""How natural frequencies by number are asked."""


def unit_of(dimension: Dimension) -> str:
    """The SI unit of a dimension as it is shown, e.g. `Hz` or `kg*m^2`; 1 of a plain number."""
    return "Hz" if dimension == dimensions.FREQUENCY else dimension.unit().replace("**", "^") or "1"


@dataclass(frozen=True)
class Quantity:
    """What is asked: its canonical text, SI unit and dimension, the name of its kind, what its arguments stand for, and
    the pose that it is asked at, displacements in m and rad by `NODE.AXIS`."""

    text: str
    unit: str
    kind: str
    arguments: tuple[object, ...] = ()
    pose: tuple[tuple[str, float], ...] = ()

    @property
    def dimension(self) -> Dimension:
        """Physical dimension."""
        return parse_unit(self.unit)[1]

    @property
    def is_bounded(self) -> bool:
        """Whether answers have bounds, which are NaN or wide where they are not proven."""
        return self.kind == FREQUENCY

    @property
    def is_followed(self) -> bool:
        """Whether it is the frequency of whichever mode moves something most."""
        return self.kind == FREQUENCY and not isinstance(self.arguments[0], int)

    @property
    def column(self) -> str:
        """Heading of a column: the text, with the unit in brackets unless it is a plain number."""
        return self.text if self.unit == "1" else f"{self.text} [{self.unit}]"

    def __str__(self) -> str:
        return self.text


def askable() -> list[str]:
    """All names as they are asked."""
    return [NUMBERED, *(kind.written for kind in KINDS.values())]


def unknown_name(name: str, parameters: list[str]) -> str:
    """What to say of a name that may not be asked of a mechanism with these parameters."""
    close = suggestion(name, [*KINDS, "f1", *parameters], "")
    near = close if close.startswith("did you mean") else ""
    if is_unit(name):
        near = f"a unit stands behind its number, as in 3 kg/m;{' ' if near else ''}{near}"
    return f"{name!r} is no quantity; {near}{' ' if near else ''}known: {', '.join(askable())}"


MOST_CHARACTERS = 20_000
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
    if len(text) > MOST_CHARACTERS:
        raise OptionError(f"quantities have at most {MOST_CHARACTERS} characters, not {len(text)}")


def _asked_at(text: str, position: int) -> tuple[Asked, int]:
    """The asked name that begins at a position, and where it ends."""
    match = _TOKEN.match(text, position)
    if match is None:
        raise OptionError(f"a quantity is missing {_where(text, position)}; write names separated by commas")
    if match["name"] is None:
        raise OptionError(_unexpected(text, position))
    name, position = match["name"], match.end()
    arguments: tuple[str, ...] = ()
    if (inside := _ARGUMENTS.match(text, position)) is not None:
        arguments, position = tuple(_unquoted(part.strip()) for part in inside[1].split(",")), inside.end()
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
            value, dimension = parse_quantity(written)
            dimension = dimension if split_quantity(written)[1] else None
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
