"""The command of large motion: displacements that are prescribed in, forces, frequencies and stiffness out."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from flexura.cli.commands import CommandReader
from flexura.cli.modes import ModelOrder
from flexura.cli.options import (
    Animate,
    Dpi,
    File,
    Gravity,
    Json,
    Plot,
    Settings,
    Strict,
    gravity_of,
    loads_of,
    named,
    of_pictures,
    print_result,
    quantity_of,
    read,
)
from flexura.errors import OptionError

ValuesOf = Callable[[list[str]], Mapping[str, Any]]
"""Reads values by name."""

EXAMPLES = {"m": "carriage.y=-20mm:20mm", "rad": "platform.rz=0:15deg"}


def stroke_command(
    file: File,
    move: Annotated[
        list[str] | None,
        typer.Option(
            "--move",
            metavar="NODE.AXIS=FROM:TO",
            help="Prescribed displacement, e.g. carriage.y=-20mm:20mm. May be repeated.",
        ),
    ] = None,
    steps: Annotated[int | None, typer.Option(min=2, help="Number of poses from FROM to TO: 21.")] = None,
    n: Annotated[int | None, typer.Option("-n", min=1, help="Number of modes at each pose: 6.")] = None,
    load: Annotated[
        list[str] | None,
        typer.Option(
            "--load",
            metavar="NODE=FX,FY,FZ[,MX,MY,MZ]",
            help="Dead load at a node, with units, e.g. 'table=0,0,-5 N', or FROM:TO. May be repeated.",
        ),
    ] = None,
    follower: Annotated[
        list[str] | None,
        typer.Option(
            "--follower", metavar="NODE=FX,FY,FZ[,MX,MY,MZ]", help="Load that turns with its node. May be repeated."
        ),
    ] = None,
    gravity: Gravity = None,
    actuator: Annotated[
        list[str] | None,
        typer.Option(
            "--actuator",
            metavar="NAME=FROM:TO",
            help="Command with its unit, e.g. '*.piezo=0:75 V' or '*.piezo=75 V'. * allowed. May be repeated.",
        ),
    ] = None,
    node: Annotated[
        list[str] | None,
        typer.Option("--node", metavar="NAME", help="Displacement of this node. May be repeated."),
    ] = None,
    compliance: Annotated[
        bool,
        typer.Option("--compliance", help="6x6 compliance and stiffness of these nodes."),
    ] = False,
    branch: Annotated[
        int, typer.Option(min=-1, max=1, help="Follow the buckled path at the first bifurcation: 1 or -1, its side.")
    ] = 0,
    refine: Annotated[int, typer.Option(min=1, help="Cut every member into so many times its elements.")] = 1,
    order: Annotated[ModelOrder, typer.Option(help="All elements, or corotational superelements.")] = ModelOrder.full,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="The table of poses: .csv or .parquet.")] = None,
    plot: Plot = None,
    animate: Animate = None,
    dpi: Dpi = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """A mechanism over its stroke, however far: equilibria, frequencies, drive forces and support stiffness."""
    from flexura.analysis import stroke
    from flexura.cli.stroke_tables import print_stroke
    from flexura.cli.tables import write_table

    pictured = of_pictures(plot, animate=None if animate is None else animate.value, dpi=dpi)
    moves = moves_of(move or [])
    mechanism, parameters = read(file, set)
    reader = CommandReader(mechanism, parameters)
    result = stroke(
        mechanism,
        parameters,
        move=moves,
        steps=steps,
        n=n,
        loads=_from_to("--load", load, loads_of),
        follower=_from_to("--follower", follower, partial(loads_of, option="--follower")),
        gravity=_gravities(gravity),
        actuators=_from_to("--actuator", actuator, partial(reader.values, "--actuator")),
        nodes=node,
        compliance=compliance,
        branch=branch,
        refine=refine,
        order=order.value,
    )
    if strict:
        result.raise_warnings()
    written = [] if out is None else [write_table(result.to_columns(), out)]
    if plot is not None:
        from flexura.view import save_stroke

        written += save_stroke(result, plot, **pictured)
    if as_json:
        print_result(result.to_dict(), written)
    else:
        known = result.poses[0].displacement if result.poses else {}
        described = () if mechanism.motion is None else mechanism.motion.nodes
        print_stroke(result, node or [name for name in described if name in known], written)
    if result.interrupted:
        sys.stderr.write("flexura: interrupted; what was done is shown\n")
        raise SystemExit(130)


def moves_of(texts: list[str]) -> dict[str, float | tuple[float, float]]:
    """What moves, by name, in SI. Raises OptionError for text that is no range, and for what is named twice."""
    from flexura.mechanism import UNITS, is_rotation

    found: dict[str, float | tuple[float, float]] = {}
    for text in texts:
        name, equals, numbers = text.partition("=")
        name, ends = name.strip(), numbers.split(":")
        unit = UNITS[is_rotation(name)]
        if not equals or not name or len(ends) > 2 or not all(end.strip() for end in ends):
            with named("--move", text):
                raise OptionError(f"NODE.AXIS=FROM:TO or NODE.AXIS=TO is expected, with units, e.g. {EXAMPLES[unit]}")
        if name in found:
            with named("--move", text):
                raise OptionError(f"{name} moves already; give one range")
        values = [quantity_of("--move", end, unit, EXAMPLES[unit]) for end in ends]
        found[name] = values[0] if len(values) == 1 else (values[0], values[1])
    return found


def _from_to(option: str, texts: list[str] | None, values_of: ValuesOf) -> dict[str, Any]:
    """Values by name of NAME=VALUE, or both ends of NAME=FROM:TO. Raises OptionError for what is named twice."""
    found: dict[str, Any] = {}
    for text in texts or []:
        name, _, values = text.partition("=")
        first, *last = (values_of([f"{name}={end}"]) for end in _ends(values))
        for key, value in first.items():
            if key in found:
                with named(option, text):
                    raise OptionError(f"{key} has a value already; give one")
            found[key] = (value, last[0][key]) if last else value
    return found


def _ends(values: str) -> list[str]:
    """VALUE, or FROM and TO of which the first has the unit of the last where it has none."""
    from flexura.units import split_quantity

    ends = values.split(":")
    if len(ends) == 2 and "," not in ends[0] and not split_quantity(ends[0])[1]:
        ends[0] += f" {split_quantity(ends[1])[1]}"
    return ends if len(ends) == 2 else [values]


def _gravities(text: str | None) -> Any:
    """Gravity (3,), or from one to another (2, 3), m/s^2; None where it is not given."""
    if text is None:
        return None
    ends = [gravity_of(end) for end in text.split(":")]
    return ends[0] if len(ends) == 1 else ends
