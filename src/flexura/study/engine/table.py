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
from flexura.errors import Diagnostic, OptionError, need
from flexura.records import Record
from flexura.results import Tabular
from flexura.study.engine.shards import Folder, arrow_table
from flexura.study.engine.work import DESIGN, PROVEN, REASON, Columns, bounds_of, jumps_of, type_of
from flexura.study.questions import Margins, are_proven
from flexura.study.requirements import OfThePart
from flexura.tables import Facts, Item, Table, counted, ends, quantity
from flexura.tables import number as digits

if TYPE_CHECKING:
    from pandas import DataFrame

MOST_REASONS = 20
"""Different reasons that are told one by one."""

_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?")

SHOWN, FIRST_PARAMETERS = 10, 6
"""Designs that are shown, and their parameters that stand before what is asked."""


@dataclass(frozen=True)
class Reason:
    """Why designs failed, in the words of the first of them, how many they are, and its number."""

    text: str
    count: int
    design: int


ALL_REQUIREMENTS = "all of them"
"""What all requirements together are called."""


@dataclass(frozen=True)
class RequirementCount:
    """How many of so many `designs` have `met` a requirement."""

    name: str
    text: str
    met: int
    designs: int


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
        before = self._reasons.get(kind, Reason(text, 0, design))
        first = Reason(text, 0, design) if design < before.design else before
        self._reasons[kind] = Reason(first.text, before.count + 1, first.design)

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """Why designs failed, those that are the same but for their numbers together, the most frequent first."""
        return tuple(sorted(self._reasons.values(), key=lambda reason: (-reason.count, reason.design)))


def _extremes(before: Extremes, designs: np.ndarray, values: np.ndarray) -> Extremes:
    """Those of a block, together with those `before`."""
    if np.isnan(values).all():
        return before
    low, high = np.nanargmin(values), np.nanargmax(values)
    block = Extremes(float(values[low]), int(designs[low]), float(values[high]), int(designs[high]))
    if before.lowest_design < 0:
        return block
    lowest = min((before.lowest, before.lowest_design), (block.lowest, block.lowest_design))
    highest = min((-before.highest, before.highest_design), (-block.highest, block.highest_design))
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
    `margins` are model errors and requirements of the nominal design, None of a study that is opened.
    """

    _shown = ("name", "done", "designs", "asked", "folder")
    _told = ("name", "folder", "designs", "done", "columns", "asked", "parameters", "fixed", "space", "failed")
    _told += ("unproven", "reasons", "model_error", "model_error_reason", "requirements", "requirement_counts")

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
        summary = Summary(self.asked, self.is_bounded)
        for block in self.blocks(["design", *self.asked, PROVEN, "reason"]):
            summary.add(block)
        return summary

    @cached_property
    def requirement_counts(self) -> tuple[RequirementCount, ...]:
        """How many of the designs that are done meet each requirement of the description, the last of them all; a
        design of which a number is not known meets none that needs it."""
        required = {} if self.margins is None else self.margins.required
        if not required:
            return ()
        headings = {own.text: own.column for each in required.values() for own in each.quantities}
        met, all_met = dict.fromkeys(required, 0), 0
        for block in self.blocks([PROVEN, *dict.fromkeys(headings.values())]):
            values = {text: block[heading] for text, heading in headings.items()}
            every = np.ones(len(block[PROVEN]), dtype=bool)
            for name, own in required.items():
                passes = np.broadcast_to(np.nan_to_num(own.evaluate(values), nan=-1.0) >= 0, every.shape)
                met[name] += int(passes.sum())
                every &= passes
            all_met += int(every.sum())
        counts = [RequirementCount(name, required[name].text, count, self.done) for name, count in met.items()]
        return (*counts, RequirementCount(ALL_REQUIREMENTS, "", all_met, self.done)) if len(counts) > 1 else (*counts,)

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
        warnings, of = list[Diagnostic](), counted(self.designs, "design")
        if not self.is_complete:
            text = f"{self.designs - self.done} of {of} are still to be worked out: run the study again to go on"
            warnings.append(Diagnostic("study", "", self.done, self.designs, "1", text))
        for reason in self.reasons:
            first, why = f"design {reason.design}", reason.text or "no reason"
            text = f"{reason.count} of {of} could not be worked out, {first} first: {why}"
            warnings.append(Diagnostic("study", first, reason.count, 0.0, "1", text))
        for heading in self.asked:
            if jumps_of(heading) in self.columns:
                warnings += self._leaps(heading)
        if self.unproven:
            text = f"{self.unproven} of {of} are not proven within 0.1 %: tables show their frequencies as intervals"
            warnings.append(Diagnostic("proof", "", self.unproven, 0.0, "1", text))
        return tuple(warnings)

    def _leaps(self, heading: str) -> Iterator[Diagnostic]:
        """Where a frequency that is followed goes over to another mode, the first of these places in words."""
        [over], text = self.parameters, heading.rpartition(" [")[0]
        table = self.to_columns([over, heading, jumps_of(heading)])
        order = np.argsort(table[over], kind="stable")
        x, hertz, leaps = (table[name][order] for name in (over, heading, jumps_of(heading)))
        places = np.flatnonzero(leaps[:-1])
        if len(places):
            k, (name, _, unit) = places[0], over.rpartition(" [") if over.endswith("]") else (over, "", "")
            between = " and ".join(quantity(float(end), unit.removesuffix("]")) for end in x[k : k + 2])
            more = f", the first of {len(places)} such places" if len(places) > 1 else ""
            leap = f"{text} goes over to another mode, from {ends((hertz[k], hertz[k + 1]), 'Hz', 5)}, between"
            yield Diagnostic("mode", text, len(places), 0.0, "1", f"{leap} {name} = {between}{more}")

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
        blocks = [
            {name: column[max(start - first, 0) : max(stop - first, 0)] for name, column in block.items()}
            for number in self.numbers
            if (first := number * size) < stop and start < first + size
            for block in [self.read(number, names)]
        ]
        return _joined(blocks, names or self.columns)

    def design(self, number: int) -> dict[str, Any]:
        """One design by its headings. Raises OptionError when it is not there."""
        row = self.rows(number, number + 1)
        if not len(row["design"]):
            raise OptionError(f"design {number} is not there: there are {self.done} of {self.designs}, counted from 0")
        return {name: value.item() if isinstance(value, np.generic) else value for name, [value] in row.items()}

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
        extremes = self.summary.extremes.get(heading, Extremes())
        if extremes.lowest_design < 0:
            raise OptionError(f"{asked} has a value in no design")
        return extremes

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
        folder = Folder(self.folder)
        key = folder.manifest()["key"]
        return need("pyarrow.dataset", "study").dataset([str(folder.file(key, number)) for number in self.numbers])

    def _named(self, columns: Sequence[str] | None) -> list[str] | None:
        if columns is None:
            return None
        headings = {heading.rpartition(" [")[0] or heading: heading for heading in self.columns}
        headings |= {heading: heading for heading in self.columns}
        names = [columns] if isinstance(columns, str) else columns
        for name in names:
            if name not in headings:
                raise OptionError(f"{name!r} is no column; columns: {', '.join(self.columns)}")
        return [headings[name] for name in names]

    def legible(self, start: int, stop: int) -> dict[str, list[Any]]:
        """Rows as `rows` has them of parameters and of what is asked, for a table that is read: where a frequency is
        not proven within 0.1 % its interval stands in place of it."""
        shown = ["design", *self.parameters, *self.asked]
        bounds = {heading: both for heading in self.asked if (both := bounds_of(heading))[0] in self.columns}
        rows = self.rows(start, stop, [*shown, PROVEN, *(name for both in bounds.values() for name in both)])
        table = {name: rows[name].tolist() for name in shown}
        for heading, (lower, upper) in bounds.items():
            value, low, high = rows[heading], rows[lower], rows[upper]
            for k in np.flatnonzero(~(rows[PROVEN] | are_proven(value, low, high) | np.isnan(value))):
                table[heading][k] = " to ".join(digits(float(end)) or "?" for end in (low[k], high[k]))
        return table

    def extremes(self) -> Iterator[tuple[str, str, int, str, int]]:
        """Of everything asked that has a value its name, the lowest value in words, the number of the design that has
        it, and both of the highest; an interval where a frequency is not proven within 0.1 %."""
        for heading in self.asked:
            extremes = self.summary.extremes.get(heading, Extremes())
            if extremes.lowest_design >= 0:
                name, _, unit = heading.rpartition(" [") if " [" in heading else (heading, "", "")
                designs, unit = (extremes.lowest_design, extremes.highest_design), unit.removesuffix("]")
                values = (self.legible(design, design + 1)[heading][0] for design in designs)
                low, high = (
                    f"{value} {unit}" if isinstance(value, str) else quantity(value, "" if unit == "1" else unit)
                    for value in values
                )
                yield name, low, designs[0], high, designs[1]

    def _columns(self) -> dict[str, Any]:
        return self.to_columns()

    def _title(self) -> str:
        return f"{self.done} of {counted(self.designs, 'design')}"

    def presentation(self) -> Iterator[Item]:
        """The first designs, the extremes of what is asked, and what failed."""
        table = self.legible(0, SHOWN)
        if self.failed:
            table["reason"] = self.rows(0, SHOWN, ["reason"])["reason"].tolist()
        # what is asked stands before the parameters where these are many
        first = ["design", *self.parameters[:FIRST_PARAMETERS], *self.asked]
        columns = {name: table[name] for name in dict.fromkeys((*first, *table))}
        yield Table(columns, "designs", count=self.done)
        rows = zip(*self.extremes(), strict=True)
        headings = ("quantity", "lowest", "in design", "highest", "at design")
        yield Table(dict(zip(headings, rows, strict=False)), "quantities")
        if counts := self.requirement_counts:
            met = [f"{own.met} of {own.designs}" for own in counts]
            names, texts = ([getattr(own, key) for own in counts] for key in ("name", "text"))
            nominal = [own.verdict for own in self.requirements] + [""] * (len(counts) - len(self.requirements))
            table = {"requirement": names, "": texts, "met by designs": met, "nominal design": nominal}
            yield Table(table, "requirements")
        yield from self.margin_facts()
        counts = {"failed": self.failed or "", "not proven": self.unproven or ""}
        yield Facts({**counts, "kept in": "" if self.folder is None else str(self.folder)})


def _joined(blocks: list[Columns], names: Sequence[str]) -> Columns:
    """Blocks one below the other, of no blocks empty columns of the same types."""
    if not blocks:
        return {name: np.empty(0, dtype=type_of(name)) for name in names}
    return {name: np.concatenate([block[name] for block in blocks]) for name in names}


@verb
def open_study(folder: str | Path) -> StudyTable:
    """The study of a folder, complete or not, while it is worked on or after, as a table that is read when it is asked
    for.

    `pyarrow` is needed (`pip install 'flexura[study]'`). DuckDB and Polars read `FOLDER/*.parquet` as it is. Raises
    OptionError where there is no study, or one whose manifest is damaged.
    """
    need("pyarrow.parquet", "study")
    shards = Folder(folder)
    manifest = shards.manifest()
    key = manifest["key"]
    try:
        fields = described(manifest)
    except (LookupError, TypeError) as error:
        raise OptionError(f"{shards.path}: not the manifest of a study, or damaged: {error}") from None
    return StudyTable(
        **fields,
        folder=shards.path,
        numbers=shards.numbers(key),
        read=lambda number, columns: shards.read(key, number, columns),
    )


def described(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """What a manifest says of the columns and designs of a study."""

    def of(what: str) -> tuple[str, ...]:
        return tuple(column["name"] for column in manifest["columns"] if column["holds"] == what)

    return {
        "name": manifest["name"],
        "designs": manifest["designs"],
        "block": manifest["designs of a shard"],
        "columns": tuple(column["name"] for column in manifest["columns"]),
        "parameters": of("parameter"),
        "asked": of("asked"),
        "is_bounded": bool(of("bound")),
        "fixed": manifest["parameters"],
        "space": manifest["space"],
    }
