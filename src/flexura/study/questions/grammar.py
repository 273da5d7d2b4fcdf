"""What may be asked of a design, and how that is written: names with arguments, and poses."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from flexura.errors import ExpressionError, OptionError
from flexura.expressions import CONSTANTS, FUNCTIONS, Dimension
from flexura.expressions import dimension as dimensions
from flexura.mechanism import DISPLACEMENTS, FORCES, suggestion
from flexura.units import format_quantity, is_unit, parse_quantity, parse_unit, split_quantity

Argument = Literal["dof", "body", "member", "actuator", "output", "input", "hertz", "parameter", "disturbance"]
"""What an argument names or is."""

Poses = Literal["any", "needed", "same", "none"]
"""Whether something is asked at rest or at a pose, at a pose alone, is the same everywhere, or is asked at rest alone.
"""

Worse = Literal["larger", "smaller", "farther"]
"""Which of two values is the worse one where nothing limits them: the larger, the smaller, or that farther from zero.
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
    worse: Worse = "larger"

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
        Kind(FREQUENCY, "natural frequency of the mode in which this moves most", ("dof",), worse="smaller"),
        Kind("mass", "mass of everything, or of a rigid body", ("body",), 1, "same"),
        Kind("stiffness", "force for a unit displacement, everything else free", ("dof",), worse="smaller"),
        Kind(
            "compliance",
            "displacement by a unit force there, or at the second place",
            ("dof", "dof"),
            1,
            worse="farther",
        ),
        Kind("coupling", "displacement by a unit command", ("actuator", "dof"), worse="farther"),
        Kind(
            "amplification",
            "displacement over the elongation of the actuator that makes it",
            ("actuator", "dof"),
            worse="farther",
        ),
        Kind("shift", "displacement from the undeformed configuration", ("dof",), worse="farther"),
        Kind(
            "parasitic", "size of what moves beside the driven motion: along this, or across it", ("dof",), 0, "needed"
        ),
        Kind("centre_shift", "how far a point on the axis of a rotation at rest goes across it", ("dof",), 0, "needed"),
        Kind("stress", "largest von Mises stress, of all members or of some", ("member",), 1),
        Kind("margin", "least yield stress over stress, of all members or of some", ("member",), 1, worse="smaller"),
        Kind("force", "force that holds a pose, along a displacement of it", ("dof",), 0, "needed", "farther"),
        Kind("reach", "stroke to either side until something yields", ("dof",), 0, "none", "smaller"),
        Kind("buckling", "factor on all loads at which it buckles", worse="smaller"),
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


HeldKind = Literal["move", "force", "command"]


class Held(NamedTuple):
    """What is prescribed at a pose: a displacement `NODE.AXIS`, m or rad, a dead force `NODE.Fx`, N or N m, or the
    command of an actuator, in the `unit` of its input."""

    name: str
    value: float
    unit: str
    kind: HeldKind = "move"

    def __str__(self) -> str:
        value = format_quantity(self.value, parse_unit(self.unit)[1], angle=self.unit == "rad")
        if self.kind != "force":
            return f"{self.name} = {value}"
        node, _, axis = self.name.rpartition(".")
        return f"{value} along {node}.{DISPLACEMENTS[FORCES.index(axis)]}"


Pose = tuple[Held, ...]


def pose_text(pose: Pose) -> str:
    """A pose as it is written: `at carriage.x = 2 mm`, `under 20 N along carriage.y`, or both."""
    at, under = (", ".join(str(own) for own in pose if (own.kind == "force") is pushes) for pushes in (False, True))
    return " ".join(text for text in (at and f"at {at}", under and f"under {under}") if text)


@dataclass(frozen=True)
class Quantity:
    """What is asked: its canonical text, SI unit and dimension, the name of its kind, what its arguments stand for, and
    the pose that it is asked at."""

    text: str
    unit: str
    kind: str
    arguments: tuple[object, ...] = ()
    pose: Pose = ()

    @property
    def bare(self) -> str:
        """Its text without the pose."""
        return self.text.removesuffix(self.where)

    @property
    def where(self) -> str:
        """The pose as it stands behind the text."""
        return f" {pose_text(self.pose)}" if self.pose else ""

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

STROKE, COMMANDS = "stroke", "commands"
"""Stand for the `motion` that is described, or its only displacement, and for all ranges of actuators."""

WORST = "worst"
"""Kind of what is asked of all poses of a stroke, and the word that may stand before it."""

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


@dataclass(frozen=True)
class Worst:
    """The worst of what `evaluate` makes of `quantities`, given by their texts, over all poses of a stroke, or all
    corners of commands."""

    quantities: tuple[Quantity, ...]
    worse: Worse
    over: str
    evaluate: Callable[[Mapping[str, Any]], Any] = field(compare=False)

    def badness(self, value: float) -> float:
        """What is larger the worse a value is."""
        return {"larger": value, "smaller": -value, "farther": abs(value)}[self.worse]


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
    names = [(place.name, place.pushes) for place in places]
    twice = next((name for k, (name, _) in enumerate(names) if names[k] in names[:k]), None)
    if twice is not None:
        raise OptionError(f"at {twice}: it is given twice in one pose")
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
