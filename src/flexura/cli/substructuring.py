"""Commands of substructuring: parts coupled and taken out by their responses, and virtual points at interfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from flexura.cli.amounts import add_once, named, points_of, quantity_of, shares_of
from flexura.cli.options import Answer, Channels, Data, Inputs, Outputs, Ratio, command, read
from flexura.errors import OptionError

if TYPE_CHECKING:
    from flexura.testing.substructuring import Join, ScatteredResponse

DESCRIBED = (".yaml", ".yml")
"""Suffixes of files that describe a part, not measure it."""

SCATTERED = (".npz", ".h5", ".hdf5", ".hdf", ".csv", ".txt")
"""Suffixes of files that hold the scatter of responses."""

Joined = Annotated[
    list[str],
    typer.Option(
        "--join",
        metavar="A=B[,STIFFNESS]",
        help="Channels or points that are one, or one with a spring between, e.g. 'frame.tip.tz=stage.foot.tz,2 N/um'."
        " May be repeated.",
    ),
]
Points = Annotated[
    list[str] | None,
    typer.Option(
        "--point",
        metavar="NAME=X,Y,Z",
        help="Virtual point in the place of the channels at its node, e.g. 'frame.tip=40,0,62 mm'. May be repeated.",
    ),
]
Noise = Annotated[
    list[str] | None,
    typer.Option(
        "--noise", metavar="NAME=REL", help="Noise of a part over its responses, e.g. frame=0.01. May be repeated."
    ),
]
ReadAs = Annotated[
    Literal["receptance", "mobility", "accelerance"] | None, typer.Option("--quantity", help="Read all motions alike.")
]
Interpolate = Annotated[bool, typer.Option("--interpolate", help="Take responses between lines where these differ.")]
Tolerance = Annotated[
    float | None,
    typer.Option(metavar="REL", help="Leave out singular values of the interface below this, relative to the largest."),
]
Out = Annotated[Path | None, typer.Option(metavar="FILE", help="Write the responses here, by suffix.")]


@command("plot", "dpi", "strict", reads=False)
def couple_command(
    parts: Annotated[
        list[str],
        typer.Argument(metavar="NAME=FILE...", help="Parts: measured data, or mechanism files, at the same lines."),
    ],
    *,
    join: Joined,
    point: Points = None,
    noise: Noise = None,
    input: Inputs = None,
    output: Outputs = None,
    quantity: ReadAs = None,
    interpolate: Interpolate = False,
    tolerance: Tolerance = None,
    damping: Ratio = None,
    out: Out = None,
) -> Answer:
    """Parts coupled to one assembly by their frequency responses, measured or computed."""
    from flexura.testing.substructuring import couple

    files: dict[str, Path] = {}
    for text in parts:
        name, equals, path = text.partition("=")
        if not (name and equals and path):
            raise OptionError(f"a part is NAME=FILE, e.g. frame=frame.uff, not {text!r}")
        add_once(files, name, Path(path), "is the name of two parts; give each its own")
    joins = [_join(text) for text in join]
    asked = [*(end for own in joins for end in (own.first, own.second)), *(input or []), *(output or [])]
    wanted = {name: [rest for end in asked for own, _, rest in [end.partition(".")] if own == name] for name in files}
    result = couple(
        _responses(files, wanted, point, noise, damping),
        joins=joins,
        quantity=quantity,
        inputs=input,
        outputs=output,
        noise=_left(noise, point),
        interpolate=interpolate,
        tolerance=tolerance,
    )
    return _answer(result, out)


@command("plot", "dpi", "strict", reads=False)
def decouple_command(
    whole: Annotated[Path, typer.Argument(metavar="WHOLE", help="Measured data of the whole, or its mechanism file.")],
    part: Annotated[Path, typer.Argument(metavar="PART", help="Measured data of the part, or its mechanism file.")],
    *,
    join: Joined,
    point: Points = None,
    noise: Noise = None,
    input: Inputs = None,
    output: Outputs = None,
    quantity: ReadAs = None,
    interpolate: Interpolate = False,
    tolerance: Tolerance = None,
    damping: Ratio = None,
    out: Out = None,
) -> Answer:
    """What is left of a whole when a part of it is taken out, by their frequency responses."""
    from flexura.testing.substructuring import decouple

    joins = [_join(text) for text in join]
    of_whole = [*(own.first for own in joins), *(input or []), *(output or [])]
    wanted = {"whole": of_whole, "part": [own.second for own in joins]}
    data = _responses({"whole": whole, "part": part}, wanted, point, noise, damping)
    result = decouple(
        data["whole"],
        data["part"],
        joins=joins,
        quantity=quantity,
        inputs=input,
        outputs=output,
        noise=_left(noise, point),
        interpolate=interpolate,
        tolerance=tolerance,
    )
    return _answer(result, out)


@command("plot", "dpi", "strict", reads=False)
def virtual_points_command(
    data: Data,
    *,
    point: Points = None,
    noise: Annotated[
        float | None, typer.Option(metavar="REL", help="Noise over the responses, relative to their root mean square.")
    ] = None,
    channels: Channels = None,
    out: Out = None,
) -> Answer:
    """Responses at virtual points in the place of the channels around them, by least squares."""
    from flexura.io import read_measurement
    from flexura.testing.substructuring import virtual_points

    result = virtual_points(read_measurement(data, channels), points_of(point), noise=noise)
    return _answer(result, out)


def _join(text: str) -> Join:
    """A join A=B or A=B,STIFFNESS. Raises OptionError for anything else."""
    from flexura.mechanism import DOF_NAMES
    from flexura.testing.substructuring import Join

    first, equals, rest = text.partition("=")
    second, comma, stiffness = rest.partition(",")
    with named("--join", text):
        if not (first.strip() and equals and second.strip()):
            raise OptionError("A=B is expected, e.g. frame.tip=stage.foot, or with a stiffness after a comma")
    turns = first.strip().rpartition(".")[2] in DOF_NAMES[3:]
    unit, example = ("N*m/rad", "40 N*m/rad") if turns else ("N/m", "2 N/um")
    return Join(first.strip(), second.strip(), quantity_of("--join", stiffness, unit, example) if comma else None)


def _responses(
    files: Mapping[str, Path],
    wanted: Mapping[str, Sequence[str]],
    point: list[str] | None,
    noise: list[str] | None,
    damping: float | None,
) -> dict[str, Any]:
    """The responses of parts: measured ones, at virtual points where these are asked for, and described ones at the
    lines of the first that is measured, at the points and channels that are wanted."""
    from flexura.io import read_measurement
    from flexura.testing.substructuring import part_of, read_alike, virtual_points

    levels, places = shares_of("--noise", noise), points_of(point)
    found: dict[str, Any] = {n: read_measurement(path) for n, path in files.items() if path.suffix not in DESCRIBED}
    if not found:
        raise OptionError("no part is measured: parts that are described are joined in one file, by `instances`")
    for owner, own in _by_part(places, files).items():
        if owner not in found:
            raise OptionError(f"--point: {owner} is described; its nodes are points as they are")
        found[owner] = virtual_points(found[owner], own, name=owner, noise=levels.get(owner))
    name = next(iter(found))
    first = part_of(name, found[name])
    like = {"frequency_hz": first.frequency_hz, "damping": damping, "quantity": read_alike(first)}
    return {**found, **{n: _computed(files[n], wanted[n], like) for n in files if n not in found}}


def _by_part(places: Mapping[str, list[float]], files: Mapping[str, Path]) -> dict[str, dict[str, list[float]]]:
    """Virtual points by the part whose name they begin with. Raises OptionError for those that begin with none."""
    found: dict[str, dict[str, list[float]]] = {}
    for name, position in places.items():
        owner, _, rest = name.partition(".")
        if owner not in files or not rest:
            raise OptionError(f"--point: {name!r} is PART.NAME, of the parts {', '.join(files)}")
        found.setdefault(owner, {})[rest] = position
    return found


def _left(noise: list[str] | None, point: list[str] | None) -> dict[str, float]:
    """The noise of parts without virtual points; that of the others is in these already."""
    taken = {name.partition(".")[0] for name in points_of(point)}
    return {name: level for name, level in shares_of("--noise", noise).items() if name not in taken}


def _computed(path: Path, wanted: Sequence[str], like: Mapping[str, Any]) -> Any:
    """The responses of a described part: at all six DOFs of what is a node, at all else as it is named."""
    from flexura.analysis import frequency_response
    from flexura.mechanism import DOF_NAMES

    mechanism, parameters = read(path, None)
    names = dict.fromkeys(
        f"{name}.{dof}" if dof else name
        for name in wanted
        for dof in (("",) if name.rpartition(".")[2] in DOF_NAMES else DOF_NAMES)
    )
    return frequency_response(mechanism, parameters, inputs=list(names), outputs=list(names), **like)


def _answer(result: ScatteredResponse, out: Path | None) -> Answer:
    """The responses, which are written as measured data; universal files have no place for their scatter."""
    from flexura.io import write_measurement
    from flexura.testing.measurement import Measurement
    from flexura.testing.substructuring import as_measured

    measured = Measurement(result.name, (), (as_measured(result),))
    if out is not None and result.sigma is not None and out.suffix.lower() not in SCATTERED:
        listed = ", ".join(SCATTERED)
        result = replace(
            result, notes=(*result.notes, f"{out.suffix} holds no scatter, as {listed} do: it is not kept")
        )
    write = list if out is None else lambda: [write_measurement(measured, out)]
    return Answer(result, pictures="save_frequency_response", write=write)
