"""A report as plain data: sections of paragraphs, tables with their evidence, and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from flexura.pages.report.chart import Chart
from flexura.pages.viewer import Shown
from flexura.tables import text_columns

Tone = Literal["", "soft", "warning", "bad", "good"]
State = Literal["shown", "absent", "failed"]


@dataclass(frozen=True)
class Paragraph:
    """A few sentences."""

    text: str
    tone: Tone = ""


@dataclass(frozen=True)
class Bullets:
    """Texts, one below another."""

    texts: Sequence[str]
    tone: Tone = ""


@dataclass(frozen=True)
class Evidence:
    """Why numbers can be believed: `lines` of a word and what it says, and the `command` that makes the numbers again.

    `essential` evidence is printed unfolded.
    """

    command: str
    lines: Sequence[tuple[str, str]] = ()
    summary: str = "evidence and command"
    essential: bool = False


@dataclass(frozen=True)
class Table:
    """Rows of text under headings, those of the columns `numbers` set right.

    `details` are what every row unfolds to, lines of a word and what it says; `evidence` is that of all its numbers.
    `motions` are what a scene of the same section can show of every row.
    """

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Sequence[int] = ()
    caption: str = ""
    evidence: Evidence | None = None
    details: Sequence[Sequence[tuple[str, str]]] = ()
    motions: Sequence[str] = ()

    @staticmethod
    def of(
        columns: Mapping[str, Sequence[Any] | np.ndarray],
        caption: str = "",
        evidence: Evidence | None = None,
        *,
        left: int = 1,
        motions: Sequence[str] = (),
    ) -> Table:
        """A table of columns by their headings, an SI unit in brackets where they have one, in units that suit; all but
        the first `left` are set right."""
        shown = text_columns({name: [*own] for name, own in columns.items()})
        rows = [list(cells) for cells in zip(*shown.values(), strict=True)]
        return Table([*shown], rows, range(left, len(shown)), caption, evidence, motions=motions)


@dataclass(frozen=True)
class ChartFigure:
    """A chart, the `table` of some of its values, and their evidence."""

    chart: Chart
    table: Table


@dataclass(frozen=True)
class ViewerFigure:
    """A scene in three dimensions as data, under an identifier of its own, and a picture, a data URI, that stands
    where nothing moves."""

    id: str
    scene: Mapping[str, Any]
    picture: str
    caption: str


@dataclass(frozen=True)
class Picture:
    """A picture that stands still, a data URI, and what it shows in words."""

    source: str
    caption: str


@dataclass(frozen=True)
class Folded:
    """What is there for those who unfold it."""

    summary: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Fact:
    """A number that matters, as it stands in its section."""

    label: str
    value: str


@dataclass(frozen=True)
class Facts:
    """Facts, each with the identifier and the heading of the section that it is of."""

    rows: Sequence[tuple[Fact, str, str]]


Block: TypeAlias = Paragraph | Bullets | Evidence | Table | ChartFigure | ViewerFigure | Picture | Folded | Facts


@dataclass(frozen=True)
class Content:
    """What a section holds. `facts` and `warnings` are what the summary takes of it; `state` says whether it could be
    made; `shown` are results that scenes are made of."""

    blocks: Sequence[Block]
    state: State = "shown"
    facts: Sequence[Fact] = ()
    warnings: Sequence[Any] = ()
    shown: Sequence[Shown] = ()


@dataclass(frozen=True)
class Section:
    """A part of a report, by its identifier in the page."""

    id: str
    heading: str
    content: Content
