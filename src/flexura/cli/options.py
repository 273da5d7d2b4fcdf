"""Arguments and small readers that the commands share."""

from __future__ import annotations

import json
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
    typer.Option("--damping", metavar="RATIO", help="Damping ratio of all modes, in place of that of the file."),
]


class RepeatedResponses(StrEnum):
    """What to make of responses between the same channels that a file gives more than once."""

    average = "average"
    first = "first"
    last = "last"


Channels = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Where the channels are (YAML), if the data do not have it.")
]


class AnimationFormat(StrEnum):
    """How animations are written."""

    gif = "gif"
    webp = "webp"
    mp4 = "mp4"


Animate = Annotated[AnimationFormat | None, typer.Option(help="Animations in the folder of --plot; mp4 needs ffmpeg.")]
Dpi = Annotated[int | None, typer.Option("--dpi", min=50, max=1200, help="Dots per inch of pictures: 150.")]
Names = Annotated[bool, typer.Option("--names", help="Names of parts beside the mechanism.")]
Plot = Annotated[Path | None, typer.Option("--plot", metavar="DIR", help="Write pictures here.")]
Repeated = Annotated[
    RepeatedResponses | None,
    typer.Option(help="Merge responses that a universal file gives more than once, which are refused else."),
]
Gravity = Annotated[
    str | None, typer.Option(metavar="X,Y,Z", help="Acceleration with its unit, e.g. '0,0,-9.81 m/s^2'.")
]
Loads = Annotated[
    list[str] | None,
    typer.Option(
        "--load",
        metavar="NODE=FX,FY,FZ[,MX,MY,MZ]",
        help="Dead load at a node, with units, e.g. 'table=0,0,-5 N'. May be repeated.",
    ),
]
At = Annotated[
    list[str] | None,
    typer.Option(
        "--at",
        metavar="NODE.AXIS=VALUE",
        help="About this pose, not undeformed, e.g. carriage.y=5mm, or an actuator's command. May be repeated.",
    ),
]
POSED = {
    "displacement": ("m", "carriage.y=5mm"),
    "rotation": ("rad", "platform.rz=10deg"),
    "expansion": ("m", "piezo=10um"),
    "voltage": ("V", "piezo=75V"),
    "force": ("N", "coil=2N"),
    "moment": ("N*m", "motor=10mN*m"),
}
"""Units and examples of what a pose is described by."""
Commands = Annotated[
    list[str] | None,
    typer.Option(
        "--actuator",
        metavar="NAME=VALUE",
        help="Command with its unit, e.g. '*.piezo=75 V'. * allowed. May be repeated.",
    ),
]


def read(file: Path, settings: list[str] | None, pose: list[str] | None = None) -> tuple[Any, dict[str, float]]:
    """The mechanism of a file, solid members reduced to superelements, at the `pose` that is given beside it, and the
    parameters that are replaced."""
    from flexura.mechanism import at, has_solid_members
    from flexura.modelfile import load

    stage("reading the file")
    mechanism = load(file)
    parameters = settings_of(mechanism, settings)
    if pose:
        mechanism = at(mechanism, prescribed_of(mechanism, pose))
    if has_solid_members(mechanism):
        from flexura.solid.fem import with_solid_parts

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


Kind = tuple[str, str]
"""What a quantity is, in words, and an SI unit of its kind."""

_FREQUENCY = ("a positive frequency", "Hz")
_KINDS = {"s": "a time", "m": "a length"}


def prescribed_of(mechanism: Any, texts: list[str]) -> dict[str, float]:
    """Displacements and commands of actuators by name, SI. Raises OptionError for text that is none, and for what is
    named twice."""
    from flexura.mechanism import Layout, command_of, is_rotation, matching

    actuators = Layout(mechanism).actuators()
    found: dict[str, float] = {}
    for text in texts:
        name, equals, number = text.partition("=")
        name = name.strip()
        command = next((command_of(actuators[own]) for own in matching(name, actuators)), None)
        unit, example = POSED[command or ("rotation" if is_rotation(name) else "displacement")]
        if not equals or not name:
            with named("--at", text):
                raise OptionError(f"NODE.AXIS=VALUE or ACTUATOR=VALUE is expected, with its unit, e.g. {example}")
        if name in found:
            with named("--at", text):
                raise OptionError(f"{name} has a value already; give one")
        found[name] = quantity_of("--at", number, unit, example)
    return found


def gravity_of(text: str | None) -> list[float] | None:
    """An acceleration (3,), m/s^2; None where it is not given. Raises OptionError when it is none."""
    if text is None:
        return None
    with named("--gravity", text):
        parts = text.split(",")
        if len(parts) != 3:
            raise OptionError(f"X,Y,Z with a unit is expected, e.g. '0,0,-9.81 m/s^2', 3 numbers; {len(parts)} found")
        return _amounts(parts, [("an acceleration", "m/s^2")] * 3, "'0,0,-9.81 m/s^2'")


def loads_of(texts: list[str] | None, option: str = "--load") -> dict[str, list[float]]:
    """Loads (6,) by node, N and N m. Raises OptionError for text that is none, and for nodes that are named twice."""
    found: dict[str, list[float]] = {}
    kinds = [("a force", "N")] * 3 + [("a moment", "N*m")] * 3
    for text in texts or []:
        node, equals, numbers = text.partition("=")
        with named(option, text):
            parts = numbers.split(",")
            if not equals or not node.strip() or len(parts) not in (3, 6):
                form = "NODE=FX,FY,FZ or NODE=FX,FY,FZ,MX,MY,MZ"
                raise OptionError(
                    f"{form} is expected, with units, e.g. 'table=0,0,-5 N' or 'table=0,0,-5 N,0,0,1 N*m'"
                )
            if node in found:
                raise OptionError(f"{node} has a load already; give one")
            force = _amounts(parts, kinds[: len(parts)], "'table=0,0,-5 N'")
        found[node] = force + [0.0] * (6 - len(force))
    return found


def _amounts(parts: list[str], kinds: list[Kind], example: str) -> list[float]:
    """Numbers in SI, each with a unit of its kind, or without one with that of the next that has one; 0 needs none.

    Raises OptionError for anything else.
    """
    from flexura.units import split_quantity

    found, unit = list[float](), ""
    for part, kind in zip(reversed(parts), reversed(kinds), strict=True):
        with _explained(kind, example, part):
            unit = split_quantity(part)[1] or unit
        found.append(_amount(part if split_quantity(part)[1] else f"{part} {unit}".strip(), kind, example))
    return found[::-1]


def _amount(text: str, kind: Kind, example: str) -> float:
    """A finite number with a unit of its kind, in SI; 0 needs none. Raises OptionError for anything else."""
    from flexura.units import parse_quantity, parse_unit, split_quantity

    what, unit = kind
    with _explained(kind, example, text):
        (value, exponents), written = parse_quantity(text), split_quantity(text)[1]
    if not written and value:
        raise OptionError(f"{text.strip()!r} has no unit; {what} with its unit is expected, e.g. {example}")
    if written and exponents != parse_unit(unit)[1]:
        raise OptionError(f"{text.strip()!r} is no {what.split()[-1]}; {what} in {unit} is expected, e.g. {example}")
    return value


@contextmanager
def _explained(kind: Kind, example: str, text: str) -> Iterator[None]:
    """Let what cannot be read say what is expected."""
    if re.match(r"\s*[+-]?(nan|inf)", text, re.IGNORECASE):
        raise OptionError(f"a number must be finite; {kind[0]} with its unit is expected, e.g. {example}")
    try:
        yield
    except ExpressionError as error:
        raise OptionError(f"{error.rule}; {kind[0]} with its unit is expected, e.g. {example}") from None


def hertz_of(text: str, example: str = "20 Hz") -> float:
    """A frequency such as `20 Hz` or `1.5 kHz`, Hz. Raises OptionError for anything else, rad/s among it."""
    from flexura.units import split_quantity

    value = _amount(text, _FREQUENCY, example)
    unit = split_quantity(text)[1]
    if unit and not re.fullmatch(r"[mkMG]?Hz", unit):
        raise OptionError(f"{text.strip()!r} is no frequency; it is written in Hz or kHz")
    return value


def _hertz(text: str, example: str) -> list[float]:
    """Frequencies separated by commas, Hz; those without a unit have that of the next. Raises OptionError."""
    from flexura.units import split_quantity

    found, unit = list[float](), ""
    for part in reversed(text.split(",")):
        with _explained(_FREQUENCY, example, part):
            own = split_quantity(part)[1]
        unit = own or unit
        found.append(hertz_of(part if own else f"{part} {unit}".strip(), example))
    return found[::-1]


def limit_of(option: str, text: str | None) -> float | None:
    """A frequency up to which something holds, Hz; None where it is not given. Raises OptionError when it is none."""
    if text is None:
        return None
    with named(option, text):
        value = hertz_of(text)
        if value < 0:
            raise OptionError("a positive frequency is expected, in Hz or kHz")
    return value


def band_of(text: str) -> tuple[float, float]:
    """A band of frequencies, Hz. Raises OptionError when it is none."""
    with named("--band", text):
        found = _hertz(text, "'5,200 Hz'")
        if len(found) != 2:
            raise OptionError("FROM,TO with a unit is expected, e.g. '5,200 Hz' or '5 Hz,0.2 kHz'")
        low, high = found
        if not 0 <= low < high:
            raise OptionError("this band is empty: a band goes from a lower frequency, at least 0, to a higher one")
    return low, high


def selected(text: str | None) -> list[float] | None:
    """Frequencies, Hz; None where they are not given. Raises OptionError for anything else."""
    if text is None:
        return None
    with named("--select", text):
        return _hertz(text, "'12.1,40 Hz'")


def quantity_of(option: str, text: str, unit: str, example: str) -> float:
    """A number with a unit that has the dimension of `unit`, SI. Raises OptionError for anything else."""
    with named(option, text):
        return _amount(text, (_KINDS.get(unit, "a quantity"), unit), example)


def seconds_of(text: str) -> float:
    """A time such as `10 s` or `5 min`, s. Raises OptionError when it is none."""
    return _amount(text, (_KINDS["s"], "s"), "10 s or 5 min")


def of_pictures(plot: Path | None, **options: object) -> dict[str, Any]:
    """Those options of pictures that are given; None and False are not. Raises OptionError when there is no --plot."""
    given = {name: value for name, value in options.items() if value is not None and value is not False}
    if plot is None and given:
        raise OptionError(f"--{next(iter(given))} belongs to --plot DIR, which is not given")
    return given
