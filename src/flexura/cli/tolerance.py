"""The command that says what tolerances do to a mechanism."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from flexura.cli.options import Dpi, File, Json, Plot, Settings, Strict, of_pictures, print_result, read
from flexura.cli.studies import Folder, Scheduler, Workers, kept_when_interrupted, print_model_errors

if TYPE_CHECKING:
    from flexura.study.tolerances import Estimate, Extreme, Tolerance, Yield


def tolerance_command(
    file: File,
    study: Annotated[str | None, typer.Option(metavar="NAME", help="Which tolerance study of the file.")] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=TOLERANCE", help="Tolerance, e.g. 'thickness=± 0.02 mm'. May be repeated."),
    ] = None,
    ask: Annotated[
        list[str] | None, typer.Option(metavar="NAMES", help="Quantities, e.g. 'f1, mass'. May be repeated.")
    ] = None,
    require: Annotated[
        list[str] | None, typer.Option(metavar="RELATION", help="What a good part meets: 'f1 >= 20 Hz'. Repeat.")
    ] = None,
    samples: Annotated[int | None, typer.Option(metavar="N", help="Samples: 4096.")] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Names the samples: 0.")] = None,
    each: Annotated[
        str | None,
        typer.Option(metavar="A,B,C", help="Parameters of which each copy of a part has its own: all; or none."),
    ] = None,
    indices: Annotated[bool, typer.Option(help="Sobol indices, which take more designs.")] = True,
    confidence: Annotated[float, typer.Option(metavar="RATIO", help="Confidence of all intervals.")] = 0.95,
    folder: Folder = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="The table of spreads: .csv or .parquet.")] = None,
    plot: Plot = None,
    dpi: Dpi = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """What tolerances do: spread, share of good parts, worst case, and which tolerance to tighten first."""
    from flexura.cli.progress import designs_shown
    from flexura.cli.tables import write_table
    from flexura.study.tolerances import tolerance

    pictured = of_pictures(plot, dpi=dpi)
    mechanism, parameters = read(file, set)
    apart = True if each is None else [name for own in each.split(",") if (name := own.strip()) not in ("", "none")]
    with designs_shown() as progress, kept_when_interrupted(folder):
        result = tolerance(
            mechanism,
            parameters,
            vary=vary,
            ask=ask,
            require=require,
            study=study,
            samples=samples,
            seed=seed,
            each=apart,
            indices=indices,
            confidence=confidence,
            folder=folder,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
        )
    if strict:
        result.raise_warnings()
    written = [] if out is None else [write_table(result.to_columns(), out)]
    if plot is not None:
        from flexura.view import save_tolerance

        written += save_tolerance(result, plot, **pictured)
    if as_json:
        print_result(result.to_dict(), written)
        return
    print_tolerance(result)
    for path in written:
        typer.echo(f"wrote {path}")


def print_tolerance(result: Tolerance) -> None:
    """Print yields, spreads, worst cases, and what each tolerance answers for."""
    from flexura.cli.tables import console_of_width, print_warnings

    console = console_of_width()
    count = f"{len(result.sizes)} independent sizes, {result.samples} samples"
    console.print(f"{result.name}: {count}, intervals of {100 * result.confidence:g} %", style="bold", markup=False)
    for own in result.yields:
        console.print(_yield(own, result.samples), markup=False)
    console.print(_spreads(result))
    console.print(_influences(result))
    print_model_errors(console, result)
    print_warnings(console, result.warnings)
    for note in result.notes:
        console.print(f"note: {note}", markup=False)


def _yield(own: Yield, samples: int) -> str:
    share = own.share
    text = f"{own.text}: {_percent(share.value)} of parts ({_percent(share.low)} to {_percent(share.high)}"
    text += f", by {share.method}); {own.failing} of {samples} samples fail"
    if own.is_met_nominally is False:
        text += "; the nominal design does, too"
    if own.is_met_at_worst:
        text += "; met in the worst case"
    return text


def _percent(share: float) -> str:
    """A share in per cent, with the digits that tell it from all and none."""
    off = min(share, 1 - share)
    digits = 2 if off >= 1e-3 or off == 0 else 4
    return f"{100 * share:.{digits}f} %"


def _table(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="left" if k == 0 else "right")
    return table


def _spreads(result: Tolerance) -> Table:
    """A column for each quantity."""
    from flexura.tables import quantity

    table = _table("", *(own.text for own in result.quantities))
    table.add_row("nominal", *(quantity(own.nominal, own.unit) for own in result.quantities))
    table.add_row("mean", *(_with_interval(own.mean, own.unit) for own in result.quantities))
    table.add_row("standard deviation", *(quantity(own.deviation, own.unit, 3) for own in result.quantities))
    for k, share in enumerate(result.shares):
        cells = [_with_interval(own.percentiles[k], own.unit) for own in result.quantities]
        table.add_row(f"{_ordinal(100 * share)} percentile", *cells)
    table.add_row("worst case, low", *(_end(own.worst_low, own.unit, "less") for own in result.quantities))
    table.add_row("worst case, high", *(_end(own.worst_high, own.unit, "more") for own in result.quantities))
    return table


def _ordinal(number: float) -> str:
    """A number with its ending: 1st, 2.5th, 11th."""
    text = f"{number:g}"
    plain = "." in text or text.endswith(("11", "12", "13"))
    return text + ("th" if plain else {"1": "st", "2": "nd", "3": "rd"}.get(text[-1], "th"))


def _end(own: Extreme, unit: str, further: str) -> str:
    """A worst case, and whether there may be one beyond."""
    from flexura.tables import quantity

    return quantity(own.value, unit) + ("" if own.is_vertex else f" or {further}")


def _with_interval(own: Estimate, unit: str) -> str:
    """A value, and how far its interval reaches."""
    from flexura.tables import quantity

    if own.low == -math.inf or own.high == math.inf:
        return f"{quantity(own.value, unit)}, no bound"
    return f"{quantity(own.value, unit)} ± {quantity(max(own.high - own.value, own.value - own.low), unit, 3)}"


def _influences(result: Tolerance) -> Table:
    """A row for each tolerance: what share of each variance it answers for, with its interval."""
    names = [own.text for own in result.quantities]
    table = _table("tolerance", "sizes", *(f"of the variance of {name}" for name in names))
    for g, name in enumerate(result.tolerances):
        count = sum(size.tolerance == name for size in result.sizes)
        cells = []
        for k, text in enumerate(names):
            share = result.influence(text)[name]
            off = "" if result.indices is None else f" ± {100 * result.indices.total_half[g, k]:.2g}"
            first = ", first" if result.tighten_first[text] == name and len(result.tolerances) > 1 else ""
            cells.append(f"{100 * share:.3g}{off} %{first}" if math.isfinite(share) else "")
        table.add_row(name, str(count), *cells)
    return table
