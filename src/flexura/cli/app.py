"""The commands: read arguments, call a verb, print its result; exit status 2 for bad input."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from flexura._version import __version__
from flexura.cli.calibration import COMMANDS as CALIBRATION
from flexura.cli.commands import CommandReader
from flexura.cli.comparison import compare_command
from flexura.cli.correlation import COMMANDS as CORRELATION
from flexura.cli.guard import run
from flexura.cli.handover import export_command
from flexura.cli.identification import identify_command
from flexura.cli.measured import COMMANDS as MEASURED
from flexura.cli.options import (
    Commands,
    File,
    Gravity,
    Json,
    Loads,
    Settings,
    Strict,
    gravity_of,
    loads_of,
    print_json,
    read,
    stages_shown,
)
from flexura.cli.response import COMMANDS
from flexura.cli.verification import verify_command
from flexura.cli.virtual_test import COMMANDS as VIRTUAL_TEST
from flexura.errors import OptionError
from flexura.sizes import parsed_limits, size_limits


class _Commands(TyperGroup):
    """Commands whose common options may stand anywhere."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Move the common options to the front."""
        end = args.index("--") if "--" in args else len(args)
        front: list[str] = []
        rest: list[str] = []
        before_end = iter(args[:end])
        for text in before_end:
            if text == "--limit":
                front += [text, next(before_end, "")]
            elif text == "--traceback" or text.startswith("--limit="):
                front.append(text)
            else:
                rest.append(text)
        return super().parse_args(ctx, [*front, *rest, *args[end:]])


app = typer.Typer(
    name="flexura",
    cls=_Commands,
    help="Low-order dynamic models of flexure-based compliant mechanisms, with evidence for every number.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


class Order(StrEnum):
    """Which model to solve."""

    low = "low"
    full = "full"


class Reduction(StrEnum):
    """How substructures are reduced."""

    craig_bampton = "craig_bampton"
    rubin = "rubin"


def _version(value: bool) -> None:
    if value:
        typer.echo(f"flexura {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    limit: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Let input be larger, e.g. --limit nodes=1e6. May be repeated."),
    ] = None,
    traceback: Annotated[bool, typer.Option("--traceback", help="Show where an unforeseen error comes from.")] = False,
) -> None:
    del version, traceback  # the guard around the commands looks for it
    context.with_resource(size_limits(**parsed_limits(limit or [])))
    context.with_resource(stages_shown())


@app.command("modes")
def modes_command(
    file: File,
    n: Annotated[int, typer.Option("-n", min=1, max=1000, help="Number of modes.")] = 6,
    order: Annotated[Order, typer.Option(help="Low-order beside full, or the full model alone.")] = Order.low,
    keep: Annotated[
        int | None,
        typer.Option(min=0, help="Normal modes kept in each substructure; 0: constraint modes alone, as in the paper."),
    ] = None,
    keep_below: Annotated[
        float | None, typer.Option(metavar="HZ", min=0.0, help="Keep all normal modes below this frequency.")
    ] = None,
    reduction: Annotated[
        Reduction | None, typer.Option(help="Kept modes: fixed-interface, or free-interface with residual flexibility.")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(metavar="REL", help="Find the smallest model proven to this relative error. By default 1e-3."),
    ] = None,
    up_to: Annotated[
        float | None, typer.Option(metavar="HZ", help="All modes up to this frequency, whatever -n is.")
    ] = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
    plot: Annotated[Path | None, typer.Option(metavar="DIR", help="Write pictures of the modes here.")] = None,
) -> None:
    """Natural frequencies and mode shapes, low-order and full-order side by side, with evidence."""
    from flexura.analysis import modes
    from flexura.cli import tables

    mechanism, parameters = read(file, set)
    how = {"keep": keep, "keep_below": keep_below, "tolerance": tolerance, "up_to": up_to}
    if order is Order.full and (reduction is not None or any(value is not None for value in how.values())):
        raise OptionError("--keep, --keep-below, --reduction, --tolerance and --up-to belong to --order low")
    method = None if reduction is None else reduction.value
    result = modes(mechanism, parameters, n=n, order=order.value, reduction=method, **how)
    if strict:
        result.raise_warnings()
    pictures: list[Path] = []
    if plot is not None:
        from flexura.view import save_modes

        pictures = save_modes(result, plot)
    if as_json:
        print_json(result.to_dict() | ({"pictures": [str(p) for p in pictures]} if plot else {}))
    else:
        tables.print_modes(result, pictures)


@app.command("check")
def check_command(
    file: File,
    set: Settings = None,
    as_json: Json = False,
    plot: Annotated[Path | None, typer.Option(metavar="DIR", help="Write a picture of the doubts here.")] = None,
) -> None:
    """What was understood of a mechanism file, and every doubt about it."""
    from flexura.analysis import check
    from flexura.cli import tables

    mechanism, parameters = read(file, set)
    report = check(mechanism, parameters)
    pictures: list[Path] = []
    if plot is not None:
        from flexura.structure import assemble
        from flexura.view import save_doubts

        pictures = save_doubts(assemble(mechanism, parameters), report, plot)
    if as_json:
        print_json(report.to_dict() | ({"pictures": [str(p) for p in pictures]} if plot else {}))
    else:
        tables.print_check(report, pictures)


@app.command("buckling")
def buckling_command(
    file: File,
    gravity: Gravity = None,
    load: Loads = None,
    actuator: Commands = None,
    n: Annotated[int, typer.Option("-n", min=1, max=100, help="Number of frequencies and buckling factors.")] = 6,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Axial forces, frequencies about the state under gravity and dead loads, and the load at which it buckles."""
    from flexura.analysis import preload
    from flexura.cli import tables

    mechanism, parameters = read(file, set)
    loads = loads_of(load)
    commands = CommandReader(mechanism, parameters).values("--actuator", actuator)
    g = gravity_of(gravity)
    state = preload(mechanism, parameters, gravity=g, loads=loads, actuators=commands)
    if strict:
        state.raise_warnings()
    data = {
        "axial_force": state.axial_force,
        "buckling_factors": state.buckling_factors(n).tolist(),
        "loaded": None if state.buckled else state.natural_frequencies(n).to_dict(),
        "unloaded": state.natural_frequencies(n, 0.0).to_dict(),
        "warnings": [w.to_dict() for w in state.warnings],
    }
    if as_json:
        print_json(data)
    else:
        tables.print_preload(data)


for _name, _command in {
    "compare": compare_command,
    "verify": verify_command,
    **COMMANDS,
    **CORRELATION,
    **CALIBRATION,
    **MEASURED,
    **VIRTUAL_TEST,
    "export": export_command,
}.items():
    app.command(_name)(_command)


app.command("identify")(identify_command)


@app.command("schema")
def schema_command() -> None:
    """Print the JSON Schema of mechanism files, for completion in editors."""
    from flexura.modelfile import schema

    print_json(schema())


@app.command("view")
def view_command(
    file: File,
    plot: Annotated[Path, typer.Option("--plot", metavar="DIR", help="Write the picture here.")] = Path(),
    set: Settings = None,
) -> None:
    """Draw the undeformed mechanism."""
    from flexura.structure import assemble
    from flexura.view import save_pictures

    mechanism, parameters = read(file, set)
    for path in save_pictures(assemble(mechanism, parameters), None, [], [], plot):
        typer.echo(str(path))


def main() -> NoReturn:
    """Run the command line; errors go to stderr, with the exit statuses of `flexura.cli.guard`."""
    raise SystemExit(run(lambda: app(standalone_mode=False)))
