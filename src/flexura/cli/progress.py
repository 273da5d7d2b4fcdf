"""Progress of long commands on a terminal, and how they are interrupted."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

if TYPE_CHECKING:
    from flexura.deadline import Progress as Step


@contextmanager
def steps_shown() -> Iterator[Callable[[Step], None]]:
    """A function that shows every step: as a bar with the time that it takes on a terminal, else as a line for each."""
    console = Console(stderr=True)
    last = ""

    def line(step: Step) -> None:
        nonlocal last
        if step.words != last:
            sys.stderr.write(f"{step.words} ...\n")
            last = step.words

    if not console.is_terminal:
        yield line
        return
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True) as shown:
        whole = shown.add_task("methods", total=None)
        own = shown.add_task("")

        def bar(step: Step) -> None:
            nonlocal last
            shown.update(whole, completed=step.done, total=step.of)
            if step.words != last:
                shown.reset(own, description=step.words, total=None)
                last = step.words
            if step.share is not None:
                shown.update(own, completed=round(100 * step.share), total=100)

        yield bar


class _Rate(ProgressColumn):
    """How many designs a second are done."""

    def render(self, task: Task) -> Text:
        """The rate of the last half minute; nothing before it is known."""
        return Text(f"{task.speed:,.0f}/s" if task.speed else "", style="progress.data.speed")


@contextmanager
def designs_shown() -> Iterator[Callable[[Step], None] | None]:
    """A function that shows how many designs are done on a terminal, with their rate and the time left; None in a
    pipe."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), _Rate(), TimeRemainingColumn()
    with Progress(*columns, console=console, transient=True, speed_estimate_period=30.0) as shown:
        whole = None

        def bar(step: Step) -> None:
            nonlocal whole
            if whole is None:  # designs that were there before do not count for the rate
                whole = shown.add_task(step.words, total=step.of, completed=step.done)
            shown.update(whole, completed=step.done)

        yield bar
