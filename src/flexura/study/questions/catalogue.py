"""What may be asked of a design: names, the arguments that they take and what they mean."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from flexura.expressions import Dimension
from flexura.expressions import dimension as dimensions
from flexura.mechanism import suggestion
from flexura.units import is_unit, parse_unit

Argument = Literal["dof", "body", "member", "actuator", "output", "input", "hertz", "parameter"]
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
        inside = ", ".join(SIGNS[own] for own in self.arguments[:least])
        for own in self.arguments[least:]:
            inside += f"[, {SIGNS[own]}]" if inside else SIGNS[own]
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
        return Dimension(*parse_unit(self.unit)[1])

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
