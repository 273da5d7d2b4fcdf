"""Where the blocks of a study go: into memory, or into the shards of a folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from flexura.extras import need
from flexura.study.engine.identity import Identity
from flexura.study.engine.shards import Folder
from flexura.study.engine.summary import Summary
from flexura.study.engine.table import StudyTable, described
from flexura.study.engine.work import PROVEN, REASON, Columns, Work

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
