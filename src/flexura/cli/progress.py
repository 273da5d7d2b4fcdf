"""Progress of long commands on a terminal, and how they are interrupted."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
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


@contextmanager
def rounds_shown() -> Iterator[Callable[[Step], None] | None]:
    """A function that shows the rounds of a search and their time on a terminal; None in a pipe."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True) as shown:
        own, last = shown.add_task("starts", total=None), ""

        def bar(step: Step) -> None:
            nonlocal last
            if step.words != last:
                shown.reset(own, description=step.words, total=step.of)
                last = step.words
            shown.update(own, completed=step.done, total=step.of)

        yield bar


PERIOD = 30.0
"""Seconds over which a rate is told; longer where so few blocks are done in them."""

FEWEST = 4
"""Blocks that a rate is told of, where there are as many."""


class Pace:
    """How many designs a second are done, by when so many were."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int]] = deque()

    def add(self, seconds: float, done: int) -> None:
        """At a time, so many designs are done."""
        self._seen.append((seconds, done))
        while len(self._seen) > FEWEST + 1 and self._seen[1][0] <= seconds - PERIOD:
            self._seen.popleft()

    @property
    def rate(self) -> float:
        """Designs a second; 0 while nothing is known."""
        (since, before), (seconds, done) = self._seen[0], self._seen[-1]
        return (done - before) / (seconds - since) if seconds > since else 0.0

    @property
    def words(self) -> str:
        """The rate as it is shown."""
        if self.rate >= 10:
            return f"{self.rate:,.0f}/s"
        return f"{60 * self.rate:,.{0 if self.rate >= 0.1 else 1}f}/min" if self.rate else ""

    def left(self, seconds: float, of: int) -> str:
        """Time that is left at another time, until so many designs are done."""
        if not self.rate:
            return ""
        last, done = self._seen[-1]
        return f"{timedelta(seconds=round(max((of - done) / self.rate - (seconds - last), 0.0)))} left"


class _Words(ProgressColumn):
    """How many designs are done, their rate and the time left."""

    def __init__(self, pace: Pace) -> None:
        super().__init__()
        self._pace = pace

    def render(self, task: Task) -> Text:
        """Anew several times a second."""
        of = int(task.total or 0)
        told = f"{int(task.completed):,} of {of:,}", self._pace.words, self._pace.left(time.monotonic(), of)
        return Text("  ".join(filter(None, told)))


LONG = 20.0
"""Seconds from which on it is said how long designs will take."""


def _said_once(pace: Pace) -> Callable[[Step], None]:
    """A function that writes one line to stderr, as soon as the first designs tell that the others take long."""
    is_said = False

    def line(step: Step) -> None:
        nonlocal is_said
        pace.add(time.monotonic(), step.done)
        left = (step.of - step.done) / pace.rate if step.of and pace.rate else 0.0
        if left > LONG and not is_said:
            about = f"{left / 60:.0f} minutes" if left > 90 else f"{left:.0f} seconds"
            sys.stderr.write(f"{step.of:,} designs at {pace.words} take about {about}\n")
            is_said = True

    return line


@contextmanager
def designs_shown() -> Iterator[Callable[[Step], None]]:
    """A function that shows how many designs are done on a terminal, with their rate and the time left; elsewhere it
    says once, after the first designs, how long all will take where that is long."""
    console = Console(stderr=True)
    pace = Pace()
    if not console.is_terminal:
        yield _said_once(pace)
        return
    with Progress(
        TextColumn("{task.description}"), BarColumn(), _Words(pace), console=console, transient=True
    ) as shown:
        whole = None

        def bar(step: Step) -> None:
            nonlocal whole
            pace.add(time.monotonic(), step.done)
            if whole is None:  # designs that were there before do not count for the rate
                whole = shown.add_task(step.words, total=step.of, completed=step.done)
            shown.update(whole, completed=step.done)

        yield bar
