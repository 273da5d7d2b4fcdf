"""Running a study: which blocks are left, who works them out, and where they go: memory, or the shards of a folder."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator, Mapping
from contextlib import ExitStack, closing, nullcontext
from itertools import chain
from pathlib import Path

from flexura.deadline import Listener, Progress, checkpoint
from flexura.errors import FlexuraError, OptionError, need
from flexura.sizes import within
from flexura.study.engine.shards import Folder, Identity
from flexura.study.engine.table import StudyTable, Summary, described
from flexura.study.engine.work import PROVEN, REASON, Columns, Work
from flexura.study.engine.workers import connected, cpu_count, on_cluster, on_processes
from flexura.study.questions import Questions
from flexura.study.space import Designs

ALONE_SECONDS = 2.0
"""Seconds of work before processes are started, and that have to be left: they take one themselves."""

DAMAGED_SHARDS_NAMED = 3
"""Damaged shards that are named one by one."""


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
        if folder is not None:
            need("pyarrow.parquet", "study")
            stack.enter_context(Folder(folder).locked())
        store = Store(work, None if folder is None else Folder(folder))
        left = (number for number in range(work.blocks) if not store.has(number))
        if client is not None:
            blocks = on_cluster(client, work, left, store.remarks.append)
        else:
            blocks = _here(store, left, workers or cpu_count())
        _keep(stack.enter_context(closing(blocks)), store, progress)
        return store.table()


class Store:
    """Blocks by their numbers, held in memory or written as shards of a folder, which may have some of them already.

    Raises OptionError for a folder that cannot be written to.
    """

    def __init__(self, work: Work, folder: Folder | None) -> None:
        self.work: Work = work
        self.folder: Folder | None = folder
        self.summary: Summary = Summary(work.asked, bool(work.bounds))
        self.remarks: list[str] = []
        self._identity, self._blocks = Identity.of(work), dict[int, Columns]()
        if folder is not None:
            self._take_up(folder)

    def _take_up(self, folder: Folder) -> None:
        """Make the folder that of this study, and see which blocks are there and whole."""
        folder.prepare(self._identity, self.remarks.append)
        key, damaged = self._identity.key, list[str]()
        for number in folder.numbers(key):
            start, stop = self.work.span(number)
            fault = folder.fault(key, number, stop - start) if number < self.work.blocks else "of no block"
            if fault:
                damaged.append(f"{folder.file(key, number).name} ({fault})")
                continue
            self._blocks[number] = {}
            self.summary.add(folder.read(key, number, ["design", *self.work.asked, PROVEN, REASON]))
        if damaged:
            named, others = damaged[:DAMAGED_SHARDS_NAMED], len(damaged) - DAMAGED_SHARDS_NAMED
            more = f" and {others} more" if others > 0 else ""
            self.remarks.append(f"damaged shards are worked out anew: {', '.join(named)}{more}")

    def has(self, number: int) -> bool:
        """Whether a block is there already."""
        return number in self._blocks

    def add(self, number: int, columns: Columns) -> None:
        """Keep a block. Raises OptionError when it cannot be written."""
        if self.folder is not None:
            self.folder.write(self._identity.key, number, columns)
        self._blocks[number] = columns if self.folder is None else {}
        self.summary.add(columns)

    def kept(self) -> str:
        """What is left of the study when it ends early, in words; empty where nothing is."""
        if self.folder is None:
            return ""
        done, designs = self.summary.done, self.work.space.size
        return f"{done} of {designs} designs are kept in {self.folder.path}: run the same study again to go on"

    def table(self) -> StudyTable:
        """All blocks that are there, those of a folder read when they are asked for."""

        def read(number: int, columns: list[str] | None) -> Columns:
            if self.folder is not None:
                return self.folder.read(self._identity.key, number, columns)
            block = self._blocks[number]
            return block if columns is None else {name: block[name] for name in columns}

        return StudyTable(
            **described(self._identity.manifest),
            folder=None if self.folder is None else self.folder.path,
            numbers=sorted(self._blocks),
            read=read,
            remarks=tuple(self.remarks),
            known=self.summary,
        )


def _keep(blocks: Iterator[tuple[int, Columns]], store: Store, progress: Listener | None) -> None:
    """Keep blocks as they come."""
    report = progress or (lambda _: None)
    report(Progress("designs", store.summary.done, store.work.space.size))
    try:
        for number, columns in blocks:
            store.add(number, columns)
            report(Progress("designs", store.summary.done, store.work.space.size))
            checkpoint()
    except FlexuraError as error:
        if store.kept():
            error.args = (f"{error}\n    {store.kept()}",)
        raise


def _here(store: Store, left: Iterator[int], workers: int) -> Generator[tuple[int, Columns]]:
    """Blocks worked out on this machine, in this process as long as that takes less than a moment."""
    work, is_kept = store.work, store.folder is not None
    begun, done = time.monotonic(), 0
    while (number := next(left, None)) is not None:
        with need("threadpoolctl", "study").threadpool_limits(1) if is_kept else nullcontext():  # as workers have it
            columns = work(number)
        yield number, columns
        done, spent = done + 1, time.monotonic() - begun
        if workers > 1 and spent > ALONE_SECONDS and spent / done * (work.blocks - number - 1) > ALONE_SECONDS:
            break
    first = next(left, None)
    if first is not None:
        count = min(workers, work.blocks - first)
        yield from on_processes(work, chain([first], left), count, store.remarks.append)
