"""The command of sweeps: what varies and what is asked in, a table of designs out."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from enum import StrEnum
from itertools import zip_longest
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexura.cli.options import Dpi, File, Json, Plot, Settings, Strict, of_pictures, print_result, read
from flexura.cli.studies import Folder, Scheduler, Workers, kept_when_interrupted, print_model_errors
from flexura.errors import OptionError

if TYPE_CHECKING:
    from flexura.study.engine import StudyTable

SHOWN = 5
"""Designs at either end of a study that are printed."""


class SamplingName(StrEnum):
    """How designs are chosen."""

    grid = "grid"
    list = "list"
    latin_hypercube = "latin-hypercube"
    sobol = "sobol"


def sweep_command(
    file: File,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="NAME=LOW:HIGH[:COUNT]",
            help="What varies, e.g. web=0.2mm:0.6mm:50, :log or :integer behind, or a list web=0.3mm,0.4mm. May be"
            " repeated.",
        ),
    ] = None,
    ask: Annotated[
        list[str] | None, typer.Option(metavar="NAMES", help="Quantities, e.g. 'f1, f2, mass'. May be repeated.")
    ] = None,
    sampling: Annotated[
        SamplingName | None, typer.Option(help="All with all (grid), side by side (list), or samples.")
    ] = None,
    samples: Annotated[int | None, typer.Option(min=1, help="Number of samples.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Names the samples: 0.")] = None,
    study: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="A sweep of the file's `studies`, with what is given here replaced."),
    ] = None,
    folder: Folder = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the table: .csv or .parquet.")] = None,
    plot: Plot = None,
    dpi: Dpi = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Many designs of a mechanism: a grid or a sample of parameters, and quantities of each, as a table."""
    from flexura.cli.progress import designs_shown
    from flexura.cli.tables import TABLES
    from flexura.results import plain
    from flexura.study.sweeps import sweep

    if out is not None and out.suffix.lower() not in TABLES:
        raise OptionError(f"{out} must be named {' or '.join(TABLES)}")
    pictured = of_pictures(plot, dpi=dpi)
    mechanism, parameters = read(file, set)
    with designs_shown() as progress, kept_when_interrupted(folder):
        result = sweep(
            mechanism,
            parameters,
            vary=vary,
            ask=ask,
            sampling=None if sampling is None else _SAMPLINGS[sampling],
            samples=samples,
            seed=seed,
            study=study,
            folder=folder,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
        )
    if strict:
        result.raise_warnings()
    written = [] if out is None else [write_designs(result, out)]
    if plot is not None:
        from flexura.view import save_sweep

        written += save_sweep(result, plot, **pictured)
    if as_json:
        table = {name: plain(own.tolist()) for name, own in result.to_columns().items()} if folder is None else None
        print_result({**result.to_dict(), "table": table}, written)
    else:
        print_study(result)
        for path in written:
            typer.echo(f"wrote {path}")


_SAMPLINGS: Mapping[SamplingName, Any] = {own: own.value.replace("-", " ") for own in SamplingName}


def write_designs(table: StudyTable, path: Path) -> Path:
    """Write the designs of a study as .csv or .parquet in one step, block by block. Raises OptionError."""
    from flexura.extras import need
    from flexura.files import write_file
    from flexura.study.engine import arrow_table

    def as_csv(file: Path) -> None:
        with file.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(table.columns)
            for block in table.blocks():
                columns = [
                    ["" if isinstance(own, float) and isnan(own) else own for own in values.tolist()]
                    for values in block.values()
                ]
                writer.writerows(zip(*columns, strict=True))

    def as_parquet(file: Path) -> None:
        form, writer = need("pyarrow.parquet", "parquet"), None
        try:
            for block in table.blocks():
                data = arrow_table(block)
                writer = writer or form.ParquetWriter(file, data.schema)
                writer.write_table(data)
        finally:
            if writer is not None:
                writer.close()

    return write_file(path, as_csv if path.suffix.lower() == ".csv" else as_parquet)


def print_study(table: StudyTable) -> None:
    """The first and the last designs, the extremes of what is asked, and what failed."""
    from rich.markup import escape
    from rich.table import Table

    from flexura.cli.tables import console_of_width, print_warnings
    from flexura.tables import counted, text_columns

    console = console_of_width()
    console.print(f"{table.name}: {counted(table.done, 'design')}", markup=False, style="bold")
    rows = table.legible(0, SHOWN)
    left = table.designs - 2 * SHOWN
    last = table.legible(max(table.designs - SHOWN, SHOWN), table.designs)
    columns = text_columns({name: [*rows[name], *last[name]] for name in rows})
    columns, dropped = _fitting(columns, len(table.parameters), console.width)
    grid = Table(*map(escape, columns), box=None, header_style="bold")
    for number, cells in enumerate(zip(*columns.values(), strict=True)):
        if number == SHOWN and left > 0:
            grid.add_row(*["..."] * len(cells))
        grid.add_row(*cells)
    for column in grid.columns:
        column.justify = "right"
    console.print(grid)
    if dropped:
        console.print(f"{counted(dropped, 'more column')}: --out writes all of them", markup=False)
    _print_extremes(console, table)
    print_model_errors(console, table)
    for note in table.notes:
        console.print(f"note: {note}", markup=False)
    if table.folder is not None:
        console.print(f"kept in {table.folder}", markup=False)
    print_warnings(console, table.warnings)


def _fitting(columns: dict[str, list[str]], parameters: int, width: int) -> tuple[dict[str, list[str]], int]:
    """The columns that fit into a width, of parameters and of what is asked alike the first, and how many are left
    out; `columns` are the number of the design, that many parameters, and what is asked."""
    names = list(columns)
    sizes = {name: 2 + max(map(len, (name, *cells))) for name, cells in columns.items()}
    varied, asked = names[1 : 1 + parameters], names[1 + parameters :]
    turns = [name for pair in zip_longest(asked, varied) for name in pair if name is not None]
    taken = {names[0], *turns[:2]}
    for name in turns[2:]:
        if sum(sizes[own] for own in taken) + sizes[name] > width:
            break
        taken.add(name)
    return {name: own for name, own in columns.items() if name in taken}, len(names) - len(taken)


def _print_extremes(console: Any, table: StudyTable) -> None:
    """The lowest and the highest value of each quantity, and the design that has it."""
    from rich.markup import escape
    from rich.table import Table

    grid = Table("quantity", "lowest", "in design", "highest", "in design", box=None, header_style="bold")
    for name, lowest, low, highest, high in table.extremes():
        grid.add_row(escape(name), lowest, str(low), highest, str(high))
    if grid.row_count:
        console.print()
        console.print(grid)
