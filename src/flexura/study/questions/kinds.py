"""What may be asked of a design: names with their arguments, and quantities at a pose or over a stroke."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from flexura.expressions import Dimension
from flexura.expressions import dimension as dimensions
from flexura.mechanism import DISPLACEMENTS, FORCES, suggestion
from flexura.units import format_quantity, is_unit, parse_unit

Argument = Literal[
    "dof", "body", "member", "actuator", "output", "input", "hertz", "parameter", "disturbance", "temperature"
]
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
    "temperature": "STATE",
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
        Kind(
            "drift",
            "displacement per kelvin that everything is warmer, or in a state of temperature, linear",
            ("dof", "temperature"),
            1,
            worse="farther",
        ),
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

    @property
    def pushed(self) -> tuple[str, int]:
        """The node that a force acts on, and along which of its displacements, 0 to 5."""
        node, _, axis = self.name.rpartition(".")
        return node, FORCES.index(axis)

    def __str__(self) -> str:
        value = format_quantity(self.value, parse_unit(self.unit)[1], angle=self.unit == "rad")
        if self.kind != "force":
            return f"{self.name} = {value}"
        node, component = self.pushed
        return f"{value} along {node}.{DISPLACEMENTS[component]}"


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


WORST = "worst"
"""Kind of what is asked of all poses of a stroke, and the word that may stand before it."""


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
