"""The command of large motion: displacements that are prescribed in, forces, frequencies and stiffness out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flexura.cli.options import (
    File,
    Gravity,
    Json,
    Loads,
    Plot,
    Settings,
    Strict,
    gravity_of,
    loads_of,
    named,
    print_result,
    quantity_of,
    read,
)
from flexura.errors import OptionError

EXAMPLES = {"m": "carriage.y=-20mm:20mm", "rad": "platform.rz=0:15deg"}


def stroke_command(
    file: File,
    move: Annotated[
        list[str],
        typer.Option(
            "--move",
            metavar="NODE.AXIS=FROM:TO",
            help="What moves from rest, e.g. carriage.y=-20mm:20mm. May be repeated.",
        ),
    ],
    steps: Annotated[int, typer.Option(min=2, help="Number of poses from FROM to TO.")] = 21,
    n: Annotated[int, typer.Option("-n", min=1, help="Number of modes at each pose.")] = 6,
    load: Loads = None,
    gravity: Gravity = None,
    node: Annotated[
        list[str] | None,
        typer.Option("--node", metavar="NAME", help="Tell this node's displacement. May be repeated."),
    ] = None,
    compliance: Annotated[
        bool,
        typer.Option("--compliance", help="6x6 compliance and stiffness of these nodes."),
    ] = False,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="The table of poses: .csv or .parquet.")] = None,
    plot: Plot = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """A mechanism over its stroke, however far: equilibria, frequencies, drive forces and support stiffness."""
    from flexura.analysis import stroke
    from flexura.cli.stroke_tables import print_stroke
    from flexura.cli.tables import write_table

    moves = moves_of(move)
    mechanism, parameters = read(file, set)
    loads, g = loads_of(load), gravity_of(gravity)
    result = stroke(
        mechanism,
        parameters,
        move=moves,
        steps=steps,
        n=n,
        loads=loads,
        gravity=g,
        nodes=node,
        compliance=compliance,
    )
    if strict:
        result.raise_warnings()
    written = [] if out is None else [write_table(result.to_columns(), out)]
    if plot is not None:
        from flexura.view import save_stroke

        written += save_stroke(result, plot)
    if as_json:
        print_result(result.to_dict(), written)
    else:
        print_stroke(result, written)


def moves_of(texts: list[str]) -> dict[str, float | tuple[float, float]]:
    """What moves, by name, in SI. Raises OptionError for text that is no range, and for what is named twice."""
    found: dict[str, float | tuple[float, float]] = {}
    for text in texts:
        name, equals, numbers = text.partition("=")
        name, ends = name.strip(), numbers.split(":")
        unit = "rad" if name.rpartition(".")[2].startswith("r") else "m"
        if not equals or not name or len(ends) > 2 or not all(end.strip() for end in ends):
            with named("--move", text):
                raise OptionError(f"NODE.AXIS=FROM:TO or NODE.AXIS=TO is expected, with units, e.g. {EXAMPLES[unit]}")
        if name in found:
            with named("--move", text):
                raise OptionError(f"{name} moves already; give one range")
        values = [quantity_of("--move", end, unit, EXAMPLES[unit]) for end in ends]
        found[name] = values[0] if len(values) == 1 else (values[0], values[1])
    return found
