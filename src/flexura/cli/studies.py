"""What commands of studies have in common: where they are worked out and kept."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from flexura.cli.options import say

if TYPE_CHECKING:
    from flexura.study.questions import OfThePart

Folder = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Keep results here, as Parquet files; the same command goes on where it was."),
]
Workers = Annotated[int | None, typer.Option(min=1, help="Processes: as many as there are processors.")]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Work on a dask cluster, e.g. tcp://192.168.0.7:8786.")
]


def print_model_errors(console: Console, result: OfThePart) -> None:
    """A line for each question: how far the part may be from what is told of it."""
    for line in result.margins.lines if result.margins is not None else ():
        console.print(line, markup=False)


@contextmanager
def kept_when_interrupted(folder: Path | None) -> Iterator[None]:
    """Say what is kept of a study when it is interrupted."""
    try:
        yield
    except KeyboardInterrupt:
        if folder is not None:
            say(f"designs that are done are kept in {folder}; the same command goes on with the others")
        raise
