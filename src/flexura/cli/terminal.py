"""What commands print on a terminal, and the tables that they write."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import floor, isfinite, isnan, log10
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from flexura.errors import Diagnostic, OptionError, foremost, need
from flexura.files import write_file
from flexura.tables import text_columns

MOST_OF_A_KIND = 3
"""Warnings of a kind that are printed; `--json` has all."""

TABLES = (".csv", ".parquet")
"""Suffixes of tables."""


def console_of_width() -> Console:
    """A console; a pipe is given a width."""
    console = Console(highlight=False, soft_wrap=False)
    # a pipe has no width; wide tables are easier to read there than wrapped ones
    return console if console.is_terminal else Console(highlight=False, width=140)


def print_all(parts: Iterable[RenderableType]) -> None:
    """Print lines and tables, as they are."""
    console = console_of_width()
    for part in parts:
        console.print(part, markup=False)


def print_end(notes: Iterable[str], warnings: Iterable[Diagnostic], written: Iterable[Path]) -> None:
    """Print notes, warnings, and which files were written."""
    print_all(f"note: {note}" for note in notes)
    print_all(Text.assemble(("warning:", "yellow"), f" {text}") for text in foremost(warnings, MOST_OF_A_KIND))
    print_all(f"wrote {path}" for path in written)


def heading(text: str) -> Text:
    """A line in bold."""
    return Text(text, style="bold")


def grid(*headings: str, left: int = 1) -> Table:
    """A table without lines, of which the first `left` columns are set left."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, name in enumerate(headings):
        table.add_column(name, justify="left" if k < left else "right")
    return table


def columns_table(columns: Mapping[str, Sequence[Any] | np.ndarray], left: int = 1, most: int | None = None) -> Table:
    """Columns by their headings, an SI unit in brackets where they have one, in units that suit; the first `left` ones
    set left, `most` rows of them."""
    shown = text_columns({name: [*column][:most] for name, column in columns.items()})
    table = grid(*shown, left=left)
    for cells in zip(*shown.values(), strict=True):
        table.add_row(*cells)
    return table


def write_table(blocks: Iterable[Mapping[str, Any]], path: Path, as_arrow: Callable[..., Any] | None = None) -> Path:
    """Write columns by their headings, block by block, as .csv or .parquet, in one step.

    What is not known is an empty cell; `as_arrow` makes an Arrow table of a block where its columns have types of their
    own. Raises OptionError for other names, and without pyarrow for .parquet.
    """

    def as_csv(file: Path) -> None:
        with file.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            for k, block in enumerate(blocks):
                if k == 0:
                    writer.writerow(block)
                lists = [["" if isinstance(x, float) and isnan(x) else x for x in _list(own)] for own in block.values()]
                writer.writerows(zip(*lists, strict=True))

    def as_parquet(file: Path) -> None:
        make, writer = as_arrow or need("pyarrow", "parquet").table, None
        try:
            for block in blocks:
                table = make({name: x if isinstance(x, np.ndarray) else [*x] for name, x in block.items()})
                writer = writer or need("pyarrow.parquet", "parquet").ParquetWriter(file, table.schema)
                writer.write_table(table)
        finally:
            if writer is not None:
                writer.close()

    if path.suffix.lower() not in TABLES:
        raise OptionError(f"{path} is no name of a table: it must be named {' or '.join(TABLES)}")
    return write_file(path, as_csv if path.suffix.lower() == ".csv" else as_parquet)


def _list(column: Any) -> list[Any]:
    return column.tolist() if isinstance(column, np.ndarray) else list(column)


def significant(value: float, uncertainty: float, digits: int = 6) -> str:
    """A number in the digits that an uncertainty leaves, the last of them of its size, and at most so many."""
    if not (isfinite(value) and value):
        return f"{value:.{digits}g}"
    first = floor(log10(abs(value)))
    last = floor(log10(uncertainty)) if uncertainty > 0 and isfinite(uncertainty) else first - digits
    places = min(max(-last, -first), digits - 1 - first)
    return f"{round(value, places):.{max(places, 0)}f}"
