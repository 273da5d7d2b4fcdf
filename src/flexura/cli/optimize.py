"""The command that finds the best design under limits."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from flexura.cli.options import Dpi, File, Json, Plot, Settings, Strict, of_pictures, print_result, read
from flexura.cli.studies import print_model_errors
from flexura.cli.tables import console_of_width, print_warnings, write_table
from flexura.errors import OptionError

if TYPE_CHECKING:
    from flexura.study.optimum import Optimum, Pareto

MODELS = (".yaml", ".yml")
"""Suffixes of model files."""


class Method(StrEnum):
    """How the best design is searched for."""

    SLSQP = "slsqp"
    TRUST_CONSTR = "trust-constr"


def optimize_command(
    file: File,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="NAME=LOW:HIGH",
            help="What varies, with units; NAME alone has the bounds of the file, NAME=A,B,C is a list. Repeat.",
        ),
    ] = None,
    maximise: Annotated[
        list[str] | None, typer.Option(metavar="FORMULA", help="To be as large as can be, e.g. f1. May be repeated.")
    ] = None,
    minimise: Annotated[
        list[str] | None, typer.Option(metavar="FORMULA", help="To be as small as can be, e.g. mass. May be repeated.")
    ] = None,
    subject_to: Annotated[
        list[str] | None,
        typer.Option(metavar="RELATION", help="A limit, e.g. 'stress(leaf) <= 400 MPa at stroke 2 mm'. Repeat."),
    ] = None,
    study: Annotated[
        str | None, typer.Option(metavar="NAME", help="The study of the file, for what is not given here.")
    ] = None,
    starts: Annotated[int | None, typer.Option(min=1, help="Searches, the first from the design as it is: 8.")] = None,
    points: Annotated[int, typer.Option(min=2, help="Designs of the front of several goals.")] = 24,
    method: Annotated[Method, typer.Option(help="SciPy's method, on exact gradients.")] = Method.SLSQP,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the starts: 0.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the optimum as a model file, or a front as .csv.")
    ] = None,
    plot: Plot = None,
    dpi: Dpi = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """The best design under limits, its active limits and what relaxing them would gain, proven at full order."""
    from flexura.cli.progress import rounds_shown
    from flexura.modelfile import refuse_base
    from flexura.study.optimum import Optimum, optimize

    if out is not None and out.suffix.lower() not in (*MODELS, ".csv", ".parquet"):
        raise OptionError(f"--out {str(out)!r}: a model file .yaml, or a table .csv or .parquet")
    is_model = out is not None and out.suffix.lower() in MODELS
    if is_model and len([*(maximise or ()), *(minimise or ())]) > 1:
        raise _front_as_model(out)
    if out is not None and is_model:
        refuse_base(out, file)
    pictured = of_pictures(plot, dpi=dpi)
    mechanism, parameters = read(file, set)
    with rounds_shown() as progress:
        result = optimize(
            mechanism,
            parameters,
            vary=vary or None,
            maximise=maximise or None,
            minimise=minimise or None,
            subject_to=subject_to or None,
            study=study,
            starts=starts,
            points=points,
            method="trust-constr" if method is Method.TRUST_CONSTR else "slsqp",
            seed=seed,
            progress=progress,
        )
    if strict:
        result.raise_warnings()
    written = [] if out is None else _saved(result, out, file)
    is_written = bool(written)
    if plot is not None:
        from flexura.view import save_optimum

        written += save_optimum(result, plot, **pictured)
    if as_json:
        print_result(result.to_dict(), written)
    else:
        if isinstance(result, Optimum):
            print_optimum(result)
        else:
            print_front(result)
        for path in written:
            typer.echo(f"wrote {path}")
    if out is not None and not is_written:
        _refuse(result, out, file)


def _saved(result: Optimum | Pareto, out: Path, base: Path) -> list[Path]:
    """What is written: a table, or a model file where there is one design for it."""
    from flexura.study.optimum import Optimum

    if out.suffix.lower() not in MODELS:
        return [write_table(result.to_columns(), out)]
    return [result.save(out, base=base)] if isinstance(result, Optimum) and result.is_feasible else []


def _refuse(result: Optimum | Pareto, out: Path, base: Path) -> None:
    """Say why there is no model file."""
    from flexura.study.optimum import Optimum

    if not isinstance(result, Optimum):
        raise _front_as_model(out)
    result.save(out, base=base)


def _front_as_model(out: Path | None) -> OptionError:
    return OptionError(f"--out {str(out)!r}: several goals have a front; write it as .csv and pick a design")


def print_optimum(result: Optimum) -> None:
    """Print the design, what holds it, and the proof."""
    from flexura.tables import quantity

    console = console_of_width()
    told = quantity(result.value, result.unit, 6)
    said = f"{result.goal}: {told}" if result.is_feasible else f"{result.goal}: no design meets the limits"
    console.print(f"{result.name}: {said}", style="bold", markup=False)
    table = _table("parameter", "before", "optimum" if result.is_feasible else "nearest", "from", "to")
    for own in result.variables:
        low, high = (quantity(end, own.unit, 4) for end in (own.low, own.high))
        mark = f" (at its {'lower' if own.at_bound == 'low' else 'upper'} bound)" if own.at_bound else ""
        table.add_row(own.name, quantity(own.start, own.unit, 6), quantity(own.value, own.unit, 6) + mark, low, high)
    console.print(table)
    if result.active:
        console.print("what holds it")
    for own in result.active:
        console.print(f"  {own}", markup=False)
    console.print("proof")
    for own in result.proof:
        within = ""
        if own.interval is not None:
            half = (own.interval[1] - own.interval[0]) / 2 / abs(own.checked) if own.checked else float("nan")
            within = f", proven within {100 * half:.2g} %"
        console.print(f"  {own.text} = {quantity(own.checked, own.unit, 6)} by {own.by}{within}", markup=False)
    if result.is_feasible and result.kkt_residual == result.kkt_residual:
        console.print(f"  conditions of an optimum hold to {result.kkt_residual:.1g} of the gradient")
    print_model_errors(console, result)
    _print_rest(result)


def print_front(result: Pareto) -> None:
    """Print the designs of a front."""
    from flexura.tables import counted, quantity

    console = console_of_width()
    console.print(
        f"{result.name}: {counted(len(result), 'design')} of {', '.join(result.goals)}", style="bold", markup=False
    )
    table = _table("design", *result.goals, *result.names)
    for k in range(len(result)):
        goals = [quantity(float(v), unit) for v, unit in zip(result.values[k], result.units, strict=True)]
        own = [quantity(float(v), unit) for v, unit in zip(result.designs[k], result.parameter_units, strict=True)]
        table.add_row(str(k), *goals, *own)
    console.print(table)
    print_model_errors(console, result)
    _print_rest(result)


def _print_rest(result: Optimum | Pareto) -> None:
    console = console_of_width()
    console.print(f"{result.evaluations} designs with gradients, {result.tried} without")
    print_warnings(console, result.warnings)
    for note in result.notes:
        console.print(f"note: {note}", markup=False)


def _table(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="left" if k == 0 else "right")
    return table
