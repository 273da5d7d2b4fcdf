"""Arguments and small readers that the commands share."""

from __future__ import annotations

import json
import math
import re
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from flexura.deadline import announced, stage
from flexura.errors import ExpressionError, OptionError

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


class RepeatedResponses(StrEnum):
    """What to make of responses between the same channels that a file gives more than once."""

    average = "average"
    first = "first"
    last = "last"


Channels = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Where the channels are (YAML), if the data do not say it.")
]
Plot = Annotated[Path | None, typer.Option("--plot", metavar="DIR", help="Write pictures here.")]
Repeated = Annotated[
    RepeatedResponses | None,
    typer.Option(help="Merge responses that a universal file gives more than once, which are refused else."),
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

    stage("reading the file")
    mechanism = load(file)
    parameters = settings_of(mechanism, settings)
    if has_solid_members(mechanism):
        from flexura.solid.fem.parts import with_solid_parts

        # parts in the cache say nothing, and neither does a pipe
        mechanism = with_solid_parts(mechanism, parameters, progress=say if sys.stderr.isatty() else None)
    return mechanism, parameters


def say(words: object) -> None:
    """One line of progress."""
    sys.stderr.write(f"{words} ...\n")


QUIET = 2.0
"""Seconds that a command may take before it says what it is at."""


@contextmanager
def stages_shown() -> Iterator[None]:
    """Say on a terminal what a command is at, once it has taken more than a moment."""
    begun = time.monotonic()

    def later(words: str) -> None:
        if time.monotonic() - begun > QUIET:
            say(words)

    with announced(later) if sys.stderr.isatty() else nullcontext():
        yield


def settings_of(mechanism: Any, settings: list[str] | None) -> dict[str, float]:
    """The parameters that are replaced, SI. Raises ModelError and OptionError."""
    from flexura.modelfile import parse_override

    found: dict[str, float] = {}
    for text in settings or []:
        with named("--set", text):
            name, value = parse_override(mechanism, text)
            if name in found:
                raise OptionError(f"{name} has a value already; give one")
        found[name] = value
    return found


def print_json(data: Any) -> None:
    """Print one JSON document."""
    sys.stdout.write(json.dumps(data, indent=2, allow_nan=False) + "\n")


def print_result(data: dict[str, Any], written: Iterable[Path] = ()) -> None:
    """Print what the `to_dict` of a result gives, with the `files` that were written where there are any."""
    files = [str(path) for path in written]
    print_json(data | ({"files": files} if files else {}))


@contextmanager
def named(option: str, text: str) -> Iterator[None]:
    """Let errors about the text of an option say which option it is, and what it was given."""
    try:
        yield
    except (ExpressionError, OptionError) as error:
        raise OptionError(f"{option} {text!r}: {error}") from None


def vector(option: str, text: str, form: str, count: int | None = None) -> list[float]:
    """Numbers separated by commas, `count` of them where that is given. Raises OptionError for anything else."""
    parts = text.split(",")
    with named(option, text):
        if count is not None and len(parts) != count:
            raise OptionError(f"{form} is expected, {count} numbers; {len(parts)} found")
        return [_bare(part, form) for part in parts]


def _bare(text: str, form: str) -> float:
    """A finite number without a unit. Raises OptionError for anything else."""
    try:
        value = float(text)
    except ValueError:
        raise OptionError(
            f"{text.strip() or 'nothing'!r} is no number; {form} is expected, numbers without units"
        ) from None
    if not math.isfinite(value):
        raise OptionError(f"a number must be finite; {form} is expected")
    return value


def gravity_of(text: str | None) -> list[float] | None:
    """An acceleration, m/s^2; None where it is not given. Raises OptionError when it is none."""
    return None if text is None else vector("--gravity", text, "X,Y,Z in m/s^2, e.g. 0,0,-9.81,", 3)


def loads_of(texts: list[str] | None) -> dict[str, list[float]]:
    """Loads by node, N and N m. Raises OptionError for text that is none, and for nodes that are named twice."""
    form, found = "NODE=FX,FY,FZ or NODE=FX,FY,FZ,MX,MY,MZ in N and N m", dict[str, list[float]]()
    for text in texts or []:
        node, equals, numbers = text.partition("=")
        with named("--load", text):
            if not equals or not node.strip() or numbers.count(",") not in (2, 5):
                raise OptionError(f"{form} is expected, e.g. table=0,0,-5")
            if node in found:
                raise OptionError(f"{node} has a load already; give one")
            force = [_bare(part, form) for part in numbers.split(",")]
        found[node] = force + [0.0] * (6 - len(force))
    return found


def hertz_of(text: str) -> float:
    """A frequency such as `20 Hz`, Hz; a bare number is in Hz. Raises OptionError for anything else, rad/s among it."""
    from flexura.units import parse_quantity, split_quantity

    try:
        value, unit = parse_quantity(text)[0], split_quantity(text)[1]
    except ExpressionError as error:
        raise OptionError(f"{error.rule}; {_FREQUENCY}") from None
    if unit and not re.fullmatch(r"[mkMG]?Hz", unit):
        raise OptionError(f"{text.strip()!r} is no frequency; it is written in Hz or kHz, or bare in Hz")
    return value


_FREQUENCY = "a positive frequency is expected, in Hz or kHz, or bare in Hz"


def limit_of(option: str, text: str | None) -> float | None:
    """A frequency up to which something holds, Hz; None where it is not given. Raises OptionError when it is none."""
    if text is None:
        return None
    with named(option, text):
        value = hertz_of(text)
        if value < 0:
            raise OptionError(_FREQUENCY)
    return value


def band_of(text: str) -> tuple[float, float]:
    """A band of frequencies, Hz. Raises OptionError when it is none."""
    parts = text.split(",")
    with named("--band", text):
        if len(parts) != 2:
            raise OptionError("FROM,TO in Hz is expected, e.g. 5,200")
        low, high = map(hertz_of, parts)
        if not 0 <= low < high:
            raise OptionError("a band goes from a lower frequency, at least 0, to a higher one")
    return low, high


def picked(text: str | None) -> list[float] | None:
    """Frequencies, Hz; None where they are not given. Raises OptionError for anything else."""
    if text is None:
        return None
    with named("--pick", text):
        return [hertz_of(part) for part in text.split(",")]


def quantity_of(option: str, text: str, unit: str, example: str) -> float:
    """A number with a unit that has the dimension of `unit`, SI. Raises OptionError for anything else."""
    from flexura.units import parse_quantity, parse_unit, split_quantity

    what = {"s": "a time", "m": "a length"}.get(unit, "a quantity")
    with named(option, text):
        try:
            (value, exponents), written = parse_quantity(text), split_quantity(text)[1]
        except ExpressionError as error:
            raise OptionError(f"{error.rule}; {what} with its unit is expected, e.g. {example}") from None
        if not written:
            raise OptionError(f"{what} with its unit is expected, e.g. {example}")
        if exponents != parse_unit(unit)[1]:
            raise OptionError(f"{what} is expected, in {unit} or another unit of its kind, e.g. {example}")
    return value


def seconds_of(text: str) -> float:
    """A time such as `10 s` or `5 min`, s; a bare number is in seconds. Raises OptionError when it is none."""
    from flexura.units import parse_quantity, parse_unit, split_quantity

    value, exponents = parse_quantity(text)
    if split_quantity(text)[1] and exponents != parse_unit("s")[1]:
        raise OptionError(f"{text!r} is no time; it is written like 10 s or 5 min")
    return value
