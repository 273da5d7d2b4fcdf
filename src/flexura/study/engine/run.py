"""Running a study: which blocks are left, and who works them out."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator, Mapping
from contextlib import ExitStack, closing, nullcontext
from itertools import chain
from pathlib import Path

from flexura.deadline import Listener, Progress, checkpoint
from flexura.errors import FlexuraError, OptionError
from flexura.extras import need
from flexura.sizes import within
from flexura.study.engine.cluster import connected, on_cluster
from flexura.study.engine.pool import cpu_count, on_processes
from flexura.study.engine.stores import Store, store_of
from flexura.study.engine.table import StudyTable
from flexura.study.engine.work import Columns, Work
from flexura.study.questions import Questions
from flexura.study.space import Designs

ALONE = 2.0
"""Seconds of work before processes are started, and that have to be left: they take one themselves."""


def run(
    questions: Questions,
    space: Designs,
    parameters: Mapping[str, float] | None = None,
    *,
    folder: str | Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Listener | None = None,
) -> StudyTable:
    """Work out what is asked of every design of a space, block by block, with some `parameters` fixed, SI.

    Blocks are shared among `workers` processes, by default as many as there are processors, or the workers of the dask
    cluster whose `scheduler` has this address: the same blocks, the same bytes. With a `folder` every block that is
    done is kept there, and a study that was interrupted goes on; without one all are held in memory. A short study, or
    what is left of one, is worked out by this process itself. `progress` is told of every block. Raises OptionError for
    a folder that cannot be written to or that another process works in, for a scheduler that is away, and for more
    designs than memory is meant to hold; SolverError for what a block raises, and when workers die.
    """
    if workers is not None and workers < 1:
        raise OptionError(f"the number of workers is at least 1, not {workers}")
    if workers is not None and scheduler is not None:
        raise OptionError("a scheduler has workers of its own: give workers or a scheduler")
    if folder is None:
        within("designs", space.size, "a study without a folder")
    work = Work(questions, space, dict(parameters or {}))
    with ExitStack() as stack:
        client = stack.enter_context(connected(scheduler)) if scheduler is not None else None
        store = stack.enter_context(store_of(work, folder))
        left = (number for number in range(work.blocks) if not store.has(number))
        if client is not None:
            source = on_cluster(client, work, left, store.remarks.append)
        else:
            source = _here(work, left, workers or cpu_count(), folder is not None, store.remarks)
        _take(stack.enter_context(closing(source)), store, progress)
        return store.table()


def _take(source: Iterator[tuple[int, Columns]], store: Store, progress: Listener | None) -> None:
    """Keep blocks as they come."""
    tell = progress or (lambda _: None)
    tell(Progress("designs", store.summary.done, store.work.space.size))
    try:
        for number, columns in source:
            store.add(number, columns)
            tell(Progress("designs", store.summary.done, store.work.space.size))
            checkpoint()
    except FlexuraError as error:
        if store.kept():
            error.args = (f"{error}\n    {store.kept()}",)
        raise


def _here(
    work: Work, left: Iterator[int], workers: int, is_kept: bool, remarks: list[str]
) -> Generator[tuple[int, Columns]]:
    """Blocks worked out on this machine, in this process as long as that takes less than a moment."""
    begun, done = time.monotonic(), 0
    while (number := next(left, None)) is not None:
        with need("threadpoolctl", "study").threadpool_limits(1) if is_kept else nullcontext():  # as workers have it
            columns = work(number)
        yield number, columns
        done, spent = done + 1, time.monotonic() - begun
        if workers > 1 and spent > ALONE and spent / done * (work.blocks - number - 1) > ALONE:
            break
    first = next(left, None)
    if first is not None:
        yield from on_processes(work, chain([first], left), min(workers, work.blocks - first), remarks.append)
