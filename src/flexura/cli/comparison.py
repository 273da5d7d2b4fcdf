"""Methods side by side on a terminal."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from flexura.cli.options import File, Json, Settings, named, print_result, read, seconds_of
from flexura.cli.progress import steps_shown
from flexura.cli.tables import console_of_width
from flexura.tables import Scale, number, quantity, scale_for

if TYPE_CHECKING:
    from flexura.methods import Comparison, ComparisonRow

BLOCK = 8
"""So many modes side by side."""


def compare_command(
    file: File,
    n: Annotated[int, typer.Option("-n", min=1, max=1000, help="Number of modes.")] = 6,
    methods: Annotated[
        str | None, typer.Option(metavar="A,B", help="Only these methods, beside the exact dynamic stiffness.")
    ] = None,
    budget: Annotated[
        str, typer.Option(metavar="TIME", help="Time that every method is given, e.g. 10 s or 5 min; none: no end.")
    ] = "60 s",
    set: Settings = None,
    as_json: Json = False,
) -> None:
    """Natural frequencies by every method, with their errors against the exact ones and their times."""
    from flexura.methods import progressively

    mechanism, parameters = read(file, set)
    names = None if methods is None else methods.split(",")
    with named("--budget", budget):
        limit = None if budget == "none" else seconds_of(budget)
    done, interrupted = None, False
    try:
        with steps_shown() as show:
            for rows_so_far in progressively(mechanism, parameters, n=n, methods=names, budget=limit, progress=show):
                done = rows_so_far
    except KeyboardInterrupt:
        interrupted = True
        done = None if done is None else done.ended(names, "interrupted before it was done")
    if done is not None and as_json:
        print_result(done.to_dict())
    elif done is not None:
        print_comparison(done)
    if interrupted:
        sys.stderr.write("flexura: interrupted; the rows that were done are shown\n")
        raise SystemExit(130)


def print_comparison(result: Comparison) -> None:
    """Print one row a method: order, the frequency of every mode compared, worst error, time; then the notes."""
    console = console_of_width()
    against = f"errors against {result.reference}" if result.reference else "nothing to hold them against"
    scale = scale_for([hz for row in result.rows for hz in row.frequency_hz], "Hz")
    console.print(f"{result.name}: frequencies in {scale.unit}, {against}", style="bold", markup=False)
    columns = max((_highest(row, result.n) for row in result.rows), default=0)
    for first in range(0, columns, BLOCK):
        modes = range(first, min(first + BLOCK, columns))
        console.print(_table(result, modes, scale, is_last=first + BLOCK >= columns))
    for row in result.rows:
        for text in _remarks(row, columns):
            console.print(f"{row.method}: {text}", markup=False)


def _table(result: Comparison, modes: range, scale: Scale, is_last: bool) -> Table:
    """A block of modes; order comes with the first, worst error and time with the last."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("method")
    before = ["order"] if modes.start == 0 else []
    after = ["worst error", "time"] if is_last else []
    for heading in (*before, *(f"mode {k + 1}" for k in modes), *after):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in result.rows:
        if row.failure:
            continue
        of_mode = dict(zip(row.counterpart, row.frequency_hz, strict=True))
        frequencies = [number(of_mode[k + 1] / scale.size) if k + 1 in of_mode else "-" for k in modes]
        order = ["" if row.order is None else str(row.order)] if before else []
        table.add_row(row.method, *order, *frequencies, *(_last_cells(row, result.reference) if after else []))
    return table


def _highest(row: ComparisonRow, n: int) -> int:
    """The highest mode compared that a row has, or has missed."""
    return max([k for k in (*row.counterpart, *row.missed) if k is not None and k <= n], default=0)


def _last_cells(row: ComparisonRow, reference: str) -> list[str]:
    worst = row.worst_error
    error = "" if row.method == reference else "-" if worst is None else f"{100 * worst:+.2g} %"
    return [error, quantity(row.seconds, "s", 3)]


def _remarks(row: ComparisonRow, columns: int) -> list[str]:
    """What a row cannot show in its columns."""
    if row.failure:
        return [row.failure]
    said = [row.note] if row.note else []
    if row.missed:
        said.append(f"has no mode {', '.join(map(str, row.missed))}")
    strange = [
        quantity(f, "Hz") for f, k in zip(row.frequency_hz, row.counterpart, strict=True) if k is None or k > columns
    ]
    if strange:
        said.append(f"has {', '.join(strange)} beside the modes compared")
    return said
