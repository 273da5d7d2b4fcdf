"""Time limits that long computations keep by themselves, and what these say of how far they are.

A limit holds for everything that is called under it. Loops that may take long call `checkpoint` in every turn, which
raises OutOfTime once the time is over; nothing is stopped from outside (the cancel scopes of Smith 2018, "Timeouts and
cancellation for humans"). A single step between two checkpoints is never cut short.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from flexura.errors import FlexuraError

Report = Callable[[float], None]
"""Is told what part of the work is done, from 0 to 1."""


class OutOfTime(FlexuraError):  # noqa: N818  it reads as what it says
    """Work that was given up because its time was over; `seconds` is what it was given.

    It is no `SolverError`: nothing that tries another way where one fails goes on when the time is over.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        super().__init__(f"stopped after {seconds:g} s")


@dataclass(frozen=True)
class _Limit:
    end: float
    seconds: float
    report: Report | None


_current: ContextVar[_Limit | None] = ContextVar("flexura_time_limit", default=None)


@contextmanager
def time_limit(seconds: float | None, report: Report | None = None) -> Iterator[None]:
    """Give what is called within so many seconds, without end for None, or what an outer limit leaves of them.

    `report` is told what part of it is done, by those steps that know.
    """
    outer = _current.get()
    limit = _Limit(float("inf"), float("inf"), report)
    if seconds is not None:
        limit = _Limit(time.monotonic() + seconds, seconds, report)
    if outer is not None and outer.end < limit.end:
        limit = _Limit(outer.end, outer.seconds, report)
    token = _current.set(limit)
    try:
        yield
    finally:
        _current.reset(token)


def checkpoint(share: float | None = None) -> None:
    """Say that work goes on, and what part of it is done where that is known.

    Raises OutOfTime when the limit under which this is called has passed.
    """
    limit = _current.get()
    if limit is None:
        return
    if time.monotonic() > limit.end:
        raise OutOfTime(limit.seconds)
    if share is not None and limit.report is not None:
        limit.report(share)


Say = Callable[[str], None]
"""Is told what is worked on next, in a few words."""

_say: ContextVar[Say | None] = ContextVar("flexura_stages", default=None)


@contextmanager
def announced(say: Say) -> Iterator[None]:
    """Have `say` told every stage of what is called within."""
    token = _say.set(say)
    try:
        yield
    finally:
        _say.reset(token)


def stage(words: str) -> None:
    """Say what is worked on next, where somebody listens; a time limit is looked at as by `checkpoint`."""
    checkpoint()
    say = _say.get()
    if say is not None:
        say(words)


@dataclass(frozen=True)
class Progress:
    """What a verb is at, in `words`; how much is `done`, of how much (`of`), and what share of the present step."""

    words: str
    done: int = 0
    of: int | None = None
    share: float | None = None

    def __str__(self) -> str:
        return self.words


Listener = Callable[[Progress], None]
"""What the argument `progress` of a verb is: it is told how far the work is."""


def no_listener(_: Progress) -> None:
    """A listener where nobody listens."""


def announcer(progress: Listener | None) -> Say:
    """What tells a listener, if there is one, what is worked on next in words."""
    return (lambda words: progress(Progress(words))) if progress is not None else (lambda _: None)
