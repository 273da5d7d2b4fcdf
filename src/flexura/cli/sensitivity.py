"""The command that sets what is asked against every parameter."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from flexura.cli.options import Dpi, File, Json, Plot, Settings, Strict, of_pictures, print_result, read
from flexura.cli.studies import print_model_errors

if TYPE_CHECKING:
    from flexura.study.influence import Sensitivity


def sensitivity_command(
    file: File,
    ask: Annotated[
        str, typer.Option(metavar="NAMES", help="Quantities, e.g. 'f1, stiffness(carriage.tx), mass'.")
    ] = "f1, f2, f3, mass",
    free: Annotated[
        str | None, typer.Option(metavar="A,B,C", help="Parameters, all that are numbers if none are named.")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="The table of slopes: .csv or .parquet.")] = None,
    plot: Plot = None,
    dpi: Dpi = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """What a per cent of every parameter does to every quantity."""
    from flexura.cli.tables import write_table
    from flexura.study.influence import sensitivity

    pictured = of_pictures(plot, dpi=dpi)
    mechanism, parameters = read(file, set)
    names = None if free is None else [name.strip() for name in free.split(",") if name.strip()]
    result = sensitivity(mechanism, parameters, ask=ask, free=names)
    if strict:
        result.raise_warnings()
    written = [] if out is None else [write_table(result.to_columns(), out)]
    if plot is not None:
        from flexura.view import save_sensitivity

        written += save_sensitivity(result, plot, **pictured)
    if as_json:
        print_result(result.to_dict(), written)
        return
    _print(result)
    for path in written:
        typer.echo(f"wrote {path}")


def _print(result: Sensitivity) -> None:
    """Print a row for each parameter, and a column for each quantity."""
    from flexura.cli.tables import console_of_width, print_warnings
    from flexura.tables import quantity

    console = console_of_width()
    console.print(f"{result.name}: change per +1 % of each parameter", style="bold", markup=False)
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("parameter")
    table.add_column("is", justify="right")
    for text, unit, value in zip(result.quantities, result.units, result.value, strict=True):
        table.add_column(f"{text}\n{quantity(float(value), unit)}", justify="right")
    for p, name in enumerate(result.parameters):
        cells = [_cell(result, k, p) for k in range(len(result.quantities))]
        table.add_row(name, quantity(float(result.nominal[p]), result.parameter_units[p]), *cells)
    console.print(table)
    print_model_errors(console, result)
    print_warnings(console, result.warnings)
    for note in result.notes:
        console.print(f"note: {note}", markup=False)


def _cell(result: Sensitivity, k: int, p: int) -> str:
    """Per cent per per cent; the slope with its unit where one of the two is zero; `none` where a warning says why."""
    value, at = float(result.value[k]), float(result.nominal[p])
    low, high = float(result.lowest[k, p]), float(result.highest[k, p])
    if not math.isfinite(low):
        return "none"
    if not (value and at):
        return f"{_range(low, high, 0.0)} {result.units[k]} per {result.parameter_units[p]}"
    low, high = sorted((low * at / value, high * at / value))
    return f"{_range(low, high, 5e-7)} %"


def _range(low: float, high: float, least: float) -> str:
    first, last = (f"{own + 0.0:+.3g}" if abs(own) > least else "0" for own in (low, high))
    return first if first == last else f"{first} to {last}"
