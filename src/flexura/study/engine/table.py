"""The designs of a study as a table that is read when it is asked for, block by block, and its summary."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flexura.arguments import verb
from flexura.errors import Diagnostic, OptionError
from flexura.extras import need
from flexura.records import Record
from flexura.results import Tabular
from flexura.study.engine.shards import Folder, arrow_table
from flexura.study.engine.work import DESIGN, PROVEN, REASON, Columns, bounds_of, jumps_of, type_of
from flexura.study.questions import Margins, OfThePart, are_proven
from flexura.tables import ROWS, Facts, Table, counted, ends, quantity
from flexura.tables import number as digits

if TYPE_CHECKING:
    from pandas import DataFrame

MOST_REASONS = 20
"""Different reasons that are told one by one."""

_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?")


@dataclass(frozen=True)
class Reason:
    """Why designs failed, in the words of the first of them, how many they are, and its number."""

    text: str
    count: int
    design: int


@dataclass(frozen=True)
class Extremes:
    """The lowest and the highest value of a column, with the first design that has it; NaN and -1 where none has."""

    lowest: float = float("nan")
    lowest_design: int = -1
    highest: float = float("nan")
    highest_design: int = -1


@dataclass(repr=False)
class Summary(Record):
    """Counts and extremes of the blocks that were added, whatever their order, by the headings of what is `asked`.

    Designs count as unproven where something is asked that `can_be_proven`.
    """

    _shown = ("done", "failed", "unproven")

    asked: Sequence[str]
    can_be_proven: bool = True
    done: int = 0
    failed: int = 0
    unproven: int = 0
    extremes: dict[str, Extremes] = field(default_factory=dict)
    _reasons: dict[str, Reason] = field(default_factory=dict)

    def add(self, block: Columns) -> None:
        """Count in a block."""
        designs = block[DESIGN]
        bad = np.zeros(len(designs), dtype=bool)
        for name in self.asked:
            bad |= np.isnan(block[name])
            self.extremes[name] = _extremes(self.extremes.get(name, Extremes()), designs, block[name])
        self.done += len(designs)
        self.failed += int(bad.sum())
        self.unproven += int((~block[PROVEN] & ~bad).sum()) if self.can_be_proven else 0
        for place in np.flatnonzero(bad):
            self._count(str(block[REASON][place]), int(designs[place]))

    def _count(self, text: str, design: int) -> None:
        kind = _NUMBER.sub("#", text)
        if kind not in self._reasons and len(self._reasons) >= MOST_REASONS:
            kind, text = "", "other reasons"
        found = self._reasons.get(kind)
        if found is None:
            self._reasons[kind] = Reason(text, 1, design)
        else:
            first = Reason(text, 0, design) if design < found.design else found
            self._reasons[kind] = Reason(first.text, found.count + 1, first.design)

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """Why designs failed, those that are the same but for their numbers together, the most frequent first."""
        return tuple(sorted(self._reasons.values(), key=lambda own: (-own.count, own.design)))


def _extremes(before: Extremes, designs: np.ndarray, values: np.ndarray) -> Extremes:
    finite = np.flatnonzero(~np.isnan(values))
    if not len(finite):
        return before
    low, high = finite[values[finite].argmin()], finite[values[finite].argmax()]
    own = Extremes(float(values[low]), int(designs[low]), float(values[high]), int(designs[high]))
    if before.lowest_design < 0:
        return own
    lowest = min((before.lowest, before.lowest_design), (own.lowest, own.lowest_design))
    highest = min((-before.highest, before.highest_design), (-own.highest, own.highest_design))
    return Extremes(*lowest, -highest[0], highest[1])


Read = Callable[[int, "list[str] | None"], Columns]
"""Gives the columns of a block, all or those that are named."""


@dataclass(frozen=True, repr=False, eq=False)
class StudyTable(OfThePart, Tabular):
    """The designs of a study that are done, a row for each in the order of their numbers; nothing is read before it is
    asked for, and one block at a time.

    `columns` are headings with SI units in brackets: `design`, its number of `designs`, counted from 0; the parameters
    that vary (`parameters`), what is `asked`, with proven bounds behind it where there are some, `is proven`, and
    `reason`: why a quantity is missing (NaN). `folder` is where the shards are, None of a study in memory.
    `margins` are model errors at the nominal design, None of a study that is opened.
    """

    _shown = ("name", "done", "designs", "asked", "folder")
    _told = ("name", "folder", "designs", "done", "columns", "asked", "parameters", "fixed", "space", "failed")
    _told += ("unproven", "reasons", "model_error", "model_error_reason")

    name: str
    designs: int
    block: int = field(repr=False)
    columns: tuple[str, ...]
    parameters: tuple[str, ...]
    asked: tuple[str, ...]
    is_bounded: bool = field(repr=False)
    fixed: Mapping[str, float]
    space: Mapping[str, Any]
    folder: Path | None
    numbers: Sequence[int] = field(repr=False)
    read: Read = field(repr=False)
    remarks: tuple[str, ...] = field(default=(), repr=False)
    known: Summary | None = field(default=None, repr=False)
    margins: Margins | None = field(default=None, repr=False)

    def __len__(self) -> int:
        return self.done

    @cached_property
    def done(self) -> int:
        """Designs that are there."""
        return sum(min((number + 1) * self.block, self.designs) - number * self.block for number in self.numbers)

    @property
    def is_complete(self) -> bool:
        """Whether every design of the study is there."""
        return self.done == self.designs

    @cached_property
    def summary(self) -> Summary:
        """Counts of designs that fail, and extremes of what is asked; read once, block by block."""
        if self.known is not None:
            return self.known
        found = Summary(self.asked, self.is_bounded)
        for block in self.blocks(["design", *self.asked, "is proven", "reason"]):
            found.add(block)
        return found

    @property
    def failed(self) -> int:
        """Designs of which something asked could not be worked out."""
        return self.summary.failed

    @property
    def unproven(self) -> int:
        """Designs of which something asked is not proven, though it could be worked out."""
        return self.summary.unproven

    @property
    def reasons(self) -> tuple[Any, ...]:
        """Why designs failed, the most frequent first."""
        return self.summary.reasons

    @cached_property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Designs that are missing, failed or not proven."""
        found, of = [], counted(self.designs, "design")
        if not self.is_complete:
            text = f"{self.designs - self.done} of {of} are still to be worked out: run the study again to go on"
            found.append(Diagnostic("study", "", self.done, self.designs, "1", text))
        for own in self.reasons:
            text = f"{own.count} of {of} could not be worked out, design {own.design} first: {own.text or 'no reason'}"
            found.append(Diagnostic("study", f"design {own.design}", own.count, 0.0, "1", text))
        found += [own for heading in self.asked if jumps_of(heading) in self.columns for own in self._leaps(heading)]
        if self.unproven:
            text = f"{self.unproven} of {of} are not proven within 0.1 %: tables show their frequencies as intervals"
            found.append(Diagnostic("proof", "", self.unproven, 0.0, "1", text))
        return tuple(found)

    def _leaps(self, heading: str) -> Iterator[Diagnostic]:
        """Where a frequency that is followed goes over to another mode, the first of these places in words."""
        [over], text = self.parameters, heading.rpartition(" [")[0]
        table = self.to_columns([over, heading, jumps_of(heading)])
        order = np.argsort(table[over], kind="stable")
        x, hertz, leaps = (table[name][order] for name in (over, heading, jumps_of(heading)))
        places = np.flatnonzero(leaps[:-1])
        if len(places):
            k, (name, _, unit) = places[0], over.rpartition(" [") if over.endswith("]") else (over, "", "")
            between = " and ".join(quantity(float(own), unit.removesuffix("]")) for own in x[k : k + 2])
            more = f", the first of {len(places)} such places" if len(places) > 1 else ""
            said = f"{text} goes over to another mode, from {ends((hertz[k], hertz[k + 1]), 'Hz', 5)}, between"
            yield Diagnostic("mode", text, len(places), 0.0, "1", f"{said} {name} = {between}{more}")

    @property
    def notes(self) -> tuple[str, ...]:
        """What happened on the way."""
        return self.remarks

    def blocks(self, columns: Sequence[str] | None = None) -> Iterator[Columns]:
        """Arrays by heading of one block of designs after the other, of all columns or of those that are named, with or
        without their units.

        Raises OptionError for other names, and for a shard that is damaged.
        """
        names = self._named(columns)
        for number in self.numbers:
            yield self.read(number, names)

    def rows(self, start: int, stop: int, columns: Sequence[str] | None = None) -> Columns:
        """Arrays by heading of the designs start ... stop - 1, those of them that are done. Raises OptionError as
        `blocks`."""
        size, names = self.block, self._named(columns)
        found = [
            {name: own[start - first if start > first else 0 : max(stop - first, 0)] for name, own in block.items()}
            for number in self.numbers
            if (first := number * size) < stop and start < first + size
            for block in [self.read(number, names)]
        ]
        return _joined(found, names or self.columns)

    def design(self, number: int) -> dict[str, Any]:
        """One design by its headings. Raises OptionError when it is not there."""
        found = self.rows(number, number + 1)
        if not len(found["design"]):
            raise OptionError(f"design {number} is not there: there are {self.done} of {self.designs}, counted from 0")
        return {name: own[0].item() if isinstance(own[0], np.generic) else own[0] for name, own in found.items()}

    def lowest(self, asked: str) -> dict[str, Any]:
        """The design with the lowest value of what is asked, by its headings. Raises OptionError for anything that is
        not asked, and where no design has a value."""
        return self.design(self._extreme(asked).lowest_design)

    def highest(self, asked: str) -> dict[str, Any]:
        """The design with the highest value of what is asked. Raises OptionError as `lowest`."""
        return self.design(self._extreme(asked).highest_design)

    def _extreme(self, asked: str) -> Extremes:
        heading = (self._named([asked]) or [""])[0]
        if heading not in self.asked:
            raise OptionError(f"{asked!r} is no quantity of this study: {', '.join(self.asked)}")
        found = self.summary.extremes.get(heading, Extremes())
        if found.lowest_design < 0:
            raise OptionError(f"{asked} has a value in no design")
        return found

    def to_columns(self, columns: Sequence[str] | None = None) -> dict[str, Any]:
        """Arrays by heading of all designs, of all columns or of those that are named: all at once, in memory."""
        return _joined(list(self.blocks(columns)), self._named(columns) or self.columns)

    def to_frame(self, columns: Sequence[str] | None = None) -> DataFrame:
        """A pandas DataFrame of all columns or of those that are named, all designs at once.

        Raises OptionError without pandas, and as `blocks`.
        """
        return need("pandas", "pandas").DataFrame(self.to_columns(columns))

    def to_arrow(self) -> Any:
        """A pyarrow Dataset over the shards, lazy; of a study in memory a pyarrow Table. Raises OptionError without
        pyarrow."""
        if self.folder is None:
            return arrow_table(self.to_columns())
        key, own = Folder(self.folder).manifest()["key"], Folder(self.folder)
        return need("pyarrow.dataset", "study").dataset([str(own.file(key, number)) for number in self.numbers])

    def _named(self, columns: Sequence[str] | None) -> list[str] | None:
        if columns is None:
            return None
        headings = {heading.rpartition(" [")[0] or heading: heading for heading in self.columns}
        headings |= {heading: heading for heading in self.columns}
        found = []
        for name in [columns] if isinstance(columns, str) else columns:
            if name not in headings:
                raise OptionError(f"{name!r} is no column; columns: {', '.join(self.columns)}")
            found.append(headings[name])
        return found

    def legible(self, start: int, stop: int) -> dict[str, list[Any]]:
        """Rows as `rows` has them of parameters and of what is asked, for a table that is read: where a frequency is
        not proven within 0.1 % its interval stands in place of it."""
        shown = ["design", *self.parameters, *self.asked]
        bounds = {heading: own for heading in self.asked if (own := bounds_of(heading))[0] in self.columns}
        found = self.rows(start, stop, [*shown, PROVEN, *(name for own in bounds.values() for name in own)])
        table = {name: found[name].tolist() for name in shown}
        for heading, (lower, upper) in bounds.items():
            value, low, high = found[heading], found[lower], found[upper]
            for k in np.flatnonzero(~(found[PROVEN] | are_proven(value, low, high) | np.isnan(value))):
                ends = (digits(float(end)) or "?" for end in (low[k], high[k]))
                table[heading][k] = " to ".join(ends)
        return table

    def extremes(self) -> Iterator[tuple[str, str, int, str, int]]:
        """Of everything asked that has a value its name, the lowest value in words, the number of the design that has
        it, and both of the highest; an interval where a frequency is not proven within 0.1 %."""
        for heading in self.asked:
            own = self.summary.extremes.get(heading, Extremes())
            if own.lowest_design >= 0:
                name, bracket, unit = heading.rpartition(" [")
                unit = unit.removesuffix("]") if bracket else ""
                low, high = (
                    self._in_words(heading, unit, design) for design in (own.lowest_design, own.highest_design)
                )
                yield name or heading, low, own.lowest_design, high, own.highest_design

    def _in_words(self, heading: str, unit: str, design: int) -> str:
        own = self.legible(design, design + 1)[heading][0]
        return f"{own} {unit}" if isinstance(own, str) else quantity(own, "" if unit == "1" else unit)

    def _columns(self) -> dict[str, Any]:
        return self.to_columns()

    def _title(self) -> str:
        return f"{self.done} of {counted(self.designs, 'design')}"

    def _view(self) -> Iterator[Facts | Table]:
        where = {"folder": self.folder or "", "failed": self.failed or "", "not proven": self.unproven or ""}
        told = {} if self.margins is None else self.margins.texts
        yield Facts({**where, **{f"model error of {name}": text for name, text in told.items()}})
        table = self.legible(0, ROWS)
        if self.failed:
            table["reason"] = self.rows(0, ROWS, ["reason"])["reason"].tolist()
        yield Table(table, "designs", count=self.done)


def _joined(blocks: list[Columns], names: Sequence[str]) -> Columns:
    """Blocks one below the other, of no blocks empty columns of the same types."""
    if not blocks:
        return {name: np.empty(0, dtype=type_of(name)) for name in names}
    return {name: np.concatenate([own[name] for own in blocks]) for name in names}


@verb
def open_study(folder: str | Path) -> StudyTable:
    """The study of a folder, complete or not, while it is worked on or after, as a table that is read when it is asked
    for.

    `pyarrow` is needed (`pip install 'flexura[study]'`). DuckDB and Polars read `FOLDER/*.parquet` as it is. Raises
    OptionError where there is no study, or one whose manifest is damaged.
    """
    need("pyarrow.parquet", "study")
    own = Folder(folder)
    found = own.manifest()
    key = found["key"]
    try:
        told = described(found)
    except (LookupError, TypeError) as error:
        raise OptionError(f"{own.path}: not the manifest of a study, or damaged: {error}") from None
    return StudyTable(
        folder=own.path, numbers=own.numbers(key), read=lambda number, columns: own.read(key, number, columns), **told
    )


def described(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """What a manifest says of the columns and designs of a study."""

    def of(what: str) -> tuple[str, ...]:
        return tuple(own["name"] for own in manifest["columns"] if own["holds"] == what)

    return {
        "name": manifest["name"],
        "designs": manifest["designs"],
        "block": manifest["designs of a shard"],
        "columns": tuple(own["name"] for own in manifest["columns"]),
        "parameters": of("parameter"),
        "asked": of("asked"),
        "is_bounded": bool(of("bound")),
        "fixed": manifest["parameters"],
        "space": manifest["space"],
    }
