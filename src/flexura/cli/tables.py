"""What all tables on a terminal share."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console

from flexura.errors import Exceeded


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
