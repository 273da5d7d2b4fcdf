"""What all tables on a terminal share."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import floor, isfinite, log10
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from flexura.errors import Diagnostic, OptionError
from flexura.extras import need
from flexura.files import write_file
from flexura.tables import text_columns


def console_of_width() -> Console:
    """A console; a pipe is given a width."""
    console = Console(highlight=False, soft_wrap=False)
    # a pipe has no width; wide tables are easier to read there than wrapped ones
    return console if console.is_terminal else Console(highlight=False, width=140)


def columns_table(columns: Mapping[str, Sequence[Any] | np.ndarray], left: int = 1) -> Table:
    """Columns by their headings, an SI unit in brackets where they have one, in units that suit; the first `left` ones
    set left."""
    shown = text_columns({name: [*own] for name, own in columns.items()})
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, heading in enumerate(shown):
        table.add_column(escape(heading), justify="left" if k < left else "right")
    for cells in zip(*shown.values(), strict=True):
        table.add_row(*map(escape, cells))
    return table


def print_warnings(console: Console, warnings: Iterable[Diagnostic | str]) -> None:
    """Print one line for each warning."""
    for warning in warnings:
        console.print("warning:", style="yellow", end=" ")
        console.print(str(warning), markup=False)


def write_table(columns: Mapping[str, Any], path: Path) -> Path:
    """Write columns by their headings as .csv or .parquet, in one step.

    What is not known is an empty cell. Raises OptionError for other names, and without pyarrow for .parquet.
    """
    kind = path.suffix.lower()
    if kind not in TABLES:
        raise OptionError(f"{path} is no name of a table: it must be named {' or '.join(TABLES)}")
    lists = {
        name: column.tolist() if isinstance(column, np.ndarray) else list(column) for name, column in columns.items()
    }
    return write_file(path, lambda file: TABLES[kind](lists, file))


def _write_csv(columns: dict[str, list[Any]], file: Path) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    file.write_bytes(text.getvalue().encode())


def _write_parquet(columns: dict[str, list[Any]], file: Path) -> None:
    table = need("pyarrow", "parquet").table(columns)
    need("pyarrow.parquet", "parquet").write_table(table, file)


TABLES: dict[str, Callable[[dict[str, list[Any]], Path], None]] = {".csv": _write_csv, ".parquet": _write_parquet}


def left(value: float, off: float, digits: int = 6) -> str:
    """A number in the digits that an uncertainty leaves, the last of them of its size, and at most so many."""
    if not (isfinite(value) and value):
        return f"{value:.{digits}g}"
    first = floor(log10(abs(value)))
    last = floor(log10(off)) if off > 0 and isfinite(off) else first - digits
    places = min(max(-last, -first), digits - 1 - first)
    return f"{round(value, places):.{max(places, 0)}f}"
