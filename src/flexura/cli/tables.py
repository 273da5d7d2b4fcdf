"""What all tables on a terminal share."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from flexura.errors import Exceeded, OptionError
from flexura.files import write_file


def console_of_width() -> Console:
    """A console; a pipe is given a width."""
    console = Console(highlight=False, soft_wrap=False)
    # a pipe has no width; wide tables are easier to read there than wrapped ones
    return console if console.is_terminal else Console(highlight=False, width=140)


def print_warnings(console: Console, warnings: Iterable[Exceeded | str]) -> None:
    """Print one line for each warning."""
    for warning in warnings:
        console.print("warning:", style="yellow", end=" ")
        console.print(str(warning), markup=False)


def write_csv(heading: Sequence[str], columns: Sequence[Any], path: Path) -> Path:
    """Write columns under their headings, in one step. Raises OptionError for a name that does not end in .csv."""
    if path.suffix.lower() != ".csv":
        raise OptionError(f"{path} must be named .csv")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heading)
    writer.writerows(np.stack(columns, axis=1).tolist())
    return write_file(path, lambda file: file.write_bytes(text.getvalue().encode()))
