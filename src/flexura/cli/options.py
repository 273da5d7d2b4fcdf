"""Arguments and small readers that the commands share."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from flexura.errors import OptionError

File = Annotated[Path, typer.Argument(metavar="FILE", help="Mechanism file (YAML).")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Replace a parameter, e.g. --set 'web=0.4 mm'. May be repeated."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]
Strict = Annotated[bool, typer.Option("--strict", help="Make warnings errors: write and print nothing, exit with 1.")]
Inputs = Annotated[
    list[str] | None,
    typer.Option("--input", "-i", metavar="NAME", help="Actuator (* allowed), DOF such as platform.tz, or ground.tx."),
]
Outputs = Annotated[
    list[str] | None,
    typer.Option("--output", "-o", metavar="NAME", help="Sensor (* allowed), or DOF such as platform.tz:velocity."),
]
Ratio = Annotated[
    float | None,
    typer.Option("--damping", metavar="RATIO", help="Damping ratio of all modes, in place of what the file says."),
]
Gravity = Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Acceleration in m/s^2, e.g. 0,0,-9.81.")]
Loads = Annotated[
    list[str] | None,
    typer.Option("--load", metavar="NODE=FX,FY,FZ[,MX,MY,MZ]", help="Dead load at a node, N and N m. May be repeated."),
]
Commands = Annotated[
    list[str] | None,
    typer.Option(
        "--actuator", metavar="NAME=VALUE", help="Command, e.g. '*.piezo=75 V'; bare: SI. * allowed. May be repeated."
    ),
]


def read(file: Path, settings: list[str] | None) -> tuple[Any, dict[str, float]]:
    """The mechanism of a file, solid members reduced to superelements, and the parameters that are replaced."""
    from flexura.mechanism.substructure import has_solid_members
    from flexura.modelfile import load

    mechanism = load(file)
    parameters = settings_of(mechanism, settings)
    if has_solid_members(mechanism):
        from flexura.solid.parts import with_solid_parts

        # parts in the cache say nothing, and neither does a pipe
        mechanism = with_solid_parts(mechanism, parameters, announce=_say if sys.stderr.isatty() else None)
    return mechanism, parameters


def _say(stage: str) -> None:
    """One line of progress."""
    sys.stderr.write(f"{stage} ...\n")


def settings_of(mechanism: Any, settings: list[str] | None) -> dict[str, float]:
    """The parameters that are replaced, SI. Raises ModelError and OptionError."""
    from flexura.modelfile import parse_override

    return dict(parse_override(mechanism, text) for text in settings or [])


def print_json(data: Any) -> None:
    """Print one JSON document."""
    sys.stdout.write(json.dumps(data, indent=2, allow_nan=False) + "\n")


def vector(text: str) -> list[float]:
    """Numbers separated by commas. Raises OptionError for anything else."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise OptionError(f"numbers separated by commas are expected, not {text!r}") from None


def load_of(text: str) -> tuple[str, list[float]]:
    """A load at a node. Raises OptionError when it is none."""
    node, equals, numbers = text.partition("=")
    if not equals:
        raise OptionError(f"a load is NODE=FX,FY,FZ or NODE=FX,FY,FZ,MX,MY,MZ, not {text!r}")
    force = vector(numbers)
    return node, force + [0.0] * 3 if len(force) == 3 else force


def band_of(text: str) -> tuple[float, float]:
    """A band of frequencies, Hz. Raises OptionError when it is none."""
    values = vector(text)
    if len(values) != 2:
        raise OptionError(f"a band is FROM,TO in Hz, not {text!r}")
    return values[0], values[1]


def seconds_of(text: str) -> float:
    """A time such as `10 s` or `5 min`, s; a bare number is in seconds. Raises OptionError when it is none."""
    from flexura.errors import ExpressionError
    from flexura.units import parse_quantity

    try:
        value, exponents = parse_quantity(text)
    except ExpressionError as error:
        raise OptionError(f"{text!r} is no time: {error}") from None
    if [k for k, power in enumerate(exponents) if power] not in ([], [2]) or exponents[2] not in (0, 1):
        raise OptionError(f"{text!r} is no time; it is written like 10 s or 5 min")
    return float(value)
