"""Running a study: which blocks are left, and who works them out.

Where the blocks of a study go: into memory, or into the shards of a folder.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, nullcontext
from itertools import chain
from pathlib import Path
from typing import Protocol

from flexura.deadline import Listener, Progress, checkpoint
from flexura.errors import FlexuraError, OptionError
from flexura.extras import need
from flexura.sizes import within
from flexura.study.engine.shards import Folder, Identity
from flexura.study.engine.table import StudyTable, Summary, described
from flexura.study.engine.work import PROVEN, REASON, Columns, Work
from flexura.study.engine.workers import connected, cpu_count, on_cluster, on_processes
from flexura.study.questions import Questions
from flexura.study.space import Designs

NAMED = 3
"""Damaged shards that are named one by one."""


class Store(Protocol):
    """Takes blocks by their numbers, each once."""

    work: Work
    summary: Summary
    remarks: list[str]

    def has(self, number: int) -> bool:
        """Whether a block is there already."""
        ...

    def add(self, number: int, columns: Columns) -> None:
        """Keep a block. Raises OptionError when it cannot be kept."""
        ...

    def kept(self) -> str:
        """What is left of the study when it ends early, in words; empty where nothing is."""
        ...

    def table(self) -> StudyTable:
        """All blocks that are there."""
        ...


class Memory:
    """Blocks held until nobody needs them."""

    def __init__(self, work: Work) -> None:
        self.work = work
        self.summary: Summary = Summary(work.asked, bool(work.bounds))
        self.remarks: list[str] = list[str]()
        self._blocks: dict[int, Columns] = {}

    def has(self, number: int) -> bool:
        """Whether a block is there already."""
        return number in self._blocks

    def add(self, number: int, columns: Columns) -> None:
        """Hold a block."""
        self._blocks[number] = columns
        self.summary.add(columns)

    def kept(self) -> str:
        """Nothing is."""
        return ""

    def table(self) -> StudyTable:
        """All blocks."""

        def read(number: int, columns: list[str] | None) -> Columns:
            block = self._blocks[number]
            return block if columns is None else {name: block[name] for name in columns}

        manifest, remarks = Identity.of(self.work).manifest, tuple(self.remarks)
        return StudyTable(
            **described(manifest),
            folder=None,
            numbers=sorted(self._blocks),
            read=read,
            remarks=remarks,
            known=self.summary,
        )


class Shards:
    """Blocks in the files of a folder, which may hold some of them already."""

    def __init__(self, work: Work, folder: Folder) -> None:
        self.work = work
        self.summary: Summary = Summary(work.asked, bool(work.bounds))
        self.remarks: list[str] = list[str]()
        self._folder, self._identity, self._there = folder, Identity.of(work), set[int]()

    def take_up(self) -> None:
        """Make the folder that of this study, and see which blocks are there and whole."""
        self._folder.prepare(self._identity, self.remarks.append)
        key, damaged = self._identity.key, list[str]()
        for number in self._folder.numbers(key):
            start, stop = self.work.span(number)
            fault = self._folder.fault(key, number, stop - start) if number < self.work.blocks else "of no block"
            if fault:
                damaged.append(f"{self._folder.file(key, number).name} ({fault})")
                continue
            self._there.add(number)
            self.summary.add(self._folder.read(key, number, ["design", *self.work.asked, PROVEN, REASON]))
        if damaged:
            more = f" and {len(damaged) - NAMED} more" if len(damaged) > NAMED else ""
            self.remarks.append(f"damaged shards are worked out anew: {', '.join(damaged[:NAMED])}{more}")

    def has(self, number: int) -> bool:
        """Whether a block is there already."""
        return number in self._there

    def add(self, number: int, columns: Columns) -> None:
        """Write a block. Raises OptionError when it cannot be written."""
        self._folder.write(self._identity.key, number, columns)
        self._there.add(number)
        self.summary.add(columns)

    def kept(self) -> str:
        """How much is."""
        done, all_of_it = self.summary.done, self.work.space.size
        return f"{done} of {all_of_it} designs are kept in {self._folder.path}: run the same study again to go on"

    def table(self) -> StudyTable:
        """All blocks, read when they are asked for."""
        folder, key = self._folder, self._identity.key
        return StudyTable(
            **described(self._identity.manifest),
            folder=folder.path,
            numbers=sorted(self._there),
            read=lambda number, columns: folder.read(key, number, columns),
            remarks=tuple(self.remarks),
            known=self.summary,
        )


@contextmanager
def store_of(work: Work, folder: str | Path | None) -> Iterator[Store]:
    """Memory, or the shards of a folder, which no other process works in meanwhile."""
    if folder is None:
        yield Memory(work)
        return
    need("pyarrow.parquet", "study")
    own = Folder(folder)
    with own.locked():
        shards = Shards(work, own)
        shards.take_up()
        yield shards


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
