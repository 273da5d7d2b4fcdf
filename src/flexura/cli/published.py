"""The command that sets a mechanism beside the numbers that others give of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from flexura.cli.options import File, Json, Settings, Strict, print_result, read

if TYPE_CHECKING:
    from flexura.study.published import Published


def published_command(
    file: File,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="The table: .csv or .parquet.")] = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """What a mechanism has beside the numbers that papers, handbooks and closed forms give for it."""
    from flexura.cli.tables import write_table
    from flexura.study.published import published

    mechanism, parameters = read(file, set)
    result = published(mechanism, parameters)
    if strict:
        result.raise_warnings()
    written = [] if out is None else [write_table(result.to_columns(), out)]
    if as_json:
        print_result(result.to_dict(), written)
        return
    _print(result)
    for path in written:
        typer.echo(f"wrote {path}")


def _print(result: Published) -> None:
    """Print a row for each number."""
    from flexura.cli.tables import console_of_width, print_warnings

    console = console_of_width()
    console.print(result.name, style="bold", markup=False)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in result.cells:
        table.add_column(heading, justify="left" if heading in ("quantity", "source") else "right")
    for row in zip(*result.cells.values(), strict=True):
        table.add_row(*row)
    console.print(table)
    for note in result.notes:
        console.print(f"note: {note}", markup=False)
    print_warnings(console, result.warnings)
