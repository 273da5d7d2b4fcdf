"""A report as plain data, sections of paragraphs, tables and figures, and as HTML: texts are escaped here alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any, Literal, TypeAlias
from urllib.parse import quote

import numpy as np

from flexura.charts import Chart
from flexura.errors import Diagnostic
from flexura.pages.report.chart import Scatter, chart_data, chart_svg, scatter_svg
from flexura.pages.viewer import Shown
from flexura.tables import text_columns

Tone = Literal["", "soft", "warning", "bad", "good"]
State = Literal["shown", "absent", "failed"]

MOST_PLACES = 4
"""Places of a warning that are named."""


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
    tones: Mapping[str, Tone] = field(default_factory=dict)
    """Of cells that have one of these texts."""

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
    where nothing moves, if it is not empty."""

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
class Scatters:
    """Scatters side by side."""

    own: Sequence[Scatter]


@dataclass(frozen=True)
class Verbatim:
    """Text of a file as it stands."""

    text: str


@dataclass(frozen=True)
class Files:
    """Files beside the page, by name."""

    names: Sequence[str]


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


Block: TypeAlias = (
    Paragraph
    | Bullets
    | Evidence
    | Table
    | ChartFigure
    | Scatters
    | ViewerFigure
    | Picture
    | Verbatim
    | Files
    | Folded
    | Facts
)


@dataclass(frozen=True)
class Content:
    """What a section holds. `facts` and `warnings` are what the summary takes of it; `state` says whether it could be
    made; `shown` are results that scenes are made of."""

    blocks: Sequence[Block]
    state: State = "shown"
    facts: Sequence[Fact] = ()
    warnings: Sequence[Any] = ()
    shown: Sequence[Shown] = ()

    @staticmethod
    def absent(text: str, command: str = "") -> Content:
        """Why there is no such section, and the command that asks for it."""
        asked = [Evidence(command, summary="command")] if command else []
        return Content([Paragraph(text, "soft"), *asked], "absent")


@dataclass(frozen=True)
class Section:
    """A part of a report, by its identifier in the page."""

    id: str
    heading: str
    content: Content


def warned(warnings: Sequence[Diagnostic]) -> list[Block]:
    """Warnings one below another; nothing where there are none."""
    return [Bullets([str(own) for own in warnings], "warning")] if warnings else []


def grouped(warnings: Sequence[Diagnostic]) -> list[str]:
    """Texts of warnings, those that say the same of several places as one."""
    places: dict[str, list[str]] = {}
    for own in warnings:
        places.setdefault(own.text, []).extend([own.place] if own.places else [])
    return [f"{_listed(own)}: {text}" if own else text for text, own in places.items()]


def _listed(places: Sequence[str]) -> str:
    more = len(places) - MOST_PLACES
    named = ", ".join(places[:MOST_PLACES])
    return f"{named} and {more} more" if more > 0 else named


DECIMALS = re.compile(r"[-+]?\d+(\.\d+)?")
LONG = 30
"""Characters from which the text of a cell may be broken into lines."""


def body_of(title: str, under: str, first: Sequence[Section], sections: Sequence[Section]) -> str:
    """The body of the page: what the first screen shows, contents, sections, and at the end what is not there."""
    there = [own for own in sections if own.content.state != "absent"]
    absent = [own for own in sections if own.content.state == "absent"]
    links = [(own.id, own.heading, own.content.state) for own in (*first, *there)]
    links += [("absent", "Not in this report", "absent")] * bool(absent)
    contents = "".join(
        f'<li class="{state}"><a href="#{escape(own)}">{escape(heading)}</a></li>' for own, heading, state in links
    )
    return (
        f'<main class="report"><div class="first"><header><h1>{escape(title)}</h1></header>'
        + "".join(_section(own) for own in first)
        + f'</div><nav aria-label="sections"><ul>{contents}</ul></nav><div class="rest">'
        + "".join(_section(own) for own in there)
        + _absent(absent)
        + f'<footer class="soft">{escape(under)}</footer></div></main>'
    )


def _absent(sections: Sequence[Section]) -> str:
    """Sections that do not apply, in one, each with its reason."""
    if not sections:
        return ""
    return (
        '<section id="absent" class="absent" aria-labelledby="absent-heading">'
        '<h2 id="absent-heading">Not in this report</h2>' + "".join(_section(own, 3) for own in sections) + "</section>"
    )


def data_of(sections: Iterable[Section]) -> dict[str, dict[str, Any]]:
    """What the figures of the page show, by kind and identifier."""
    viewers: dict[str, Mapping[str, Any]] = {}
    charts: dict[str, Mapping[str, Any]] = {}
    for block in _every(block for section in sections for block in section.content.blocks):
        if isinstance(block, ViewerFigure):
            viewers[block.id] = block.scene
        elif isinstance(block, ChartFigure):
            charts[block.chart.id] = chart_data(block.chart)
    return {"viewer": dict(viewers), "chart": dict(charts)}


def _every(blocks: Iterable[Block]) -> Iterable[Block]:
    for block in blocks:
        yield block
        if isinstance(block, Folded):
            yield from _every(block.blocks)


def _section(section: Section, level: int = 2) -> str:
    own, inner = escape(section.id), "".join(_block(block) for block in section.content.blocks)
    return (
        f'<section id="{own}" class="{section.content.state}" aria-labelledby="{own}-heading">'
        f'<h{level} id="{own}-heading">{escape(section.heading)}</h{level}>{inner}</section>'
    )


def _block(block: Block) -> str:
    return _WRITERS[type(block)](block)


def _paragraph(block: Paragraph) -> str:
    return f"<p{_class(block.tone)}>{escape(block.text)}</p>"


def _bullets(block: Bullets) -> str:
    return f"<ul{_class(block.tone)}>" + "".join(f"<li>{escape(text)}</li>" for text in block.texts) + "</ul>"


def _class(name: str) -> str:
    return f' class="{name}"' if name else ""


def _evidence(block: Evidence) -> str:
    essential = " essential" if block.essential else ""
    return (
        f'<details class="evidence{essential}"><summary>{escape(block.summary)}</summary>{_lines(block.lines)}'
        f'<pre class="command" tabindex="0">{escape(block.command)}</pre></details>'
    )


def _lines(lines: Iterable[tuple[str, str]]) -> str:
    text = "".join(f"<div><dt>{escape(word)}</dt><dd>{escape(said)}</dd></div>" for word, said in lines)
    return f'<dl class="lines">{text}</dl>' if text else ""


def _after_point(texts: Iterable[str]) -> float:
    """Widths of a digit that decimals take in a column, the point half of one; zero where not all are plain numbers."""
    found = [DECIMALS.fullmatch(text) for text in texts if text]
    if not all(found):
        return 0.0
    return max((len(own[1]) - 0.5 for own in found if own and own[1]), default=0.0)


def _table(block: Table) -> str:
    numbers = set(block.numbers)
    after = {k: _after_point([row[k] for row in block.rows]) for k in numbers}

    def cell(tag: str, k: int, text: str, more: str = "") -> str:
        kind = "number" if k in numbers else "long" if tag == "td" and len(text) > LONG else block.tones.get(text, "")
        if tag == "td" and k in numbers and (short := after[k] - _after_point([text])):
            more += f' style="--after: {short:g}ch"'
        return f"<{tag}{more}{_class(kind)}>{escape(text)}</{tag}>"

    head = "".join(cell("th", k, text, ' scope="col"') for k, text in enumerate(block.headings))
    head += '<th scope="col">evidence</th>' if block.details else ""
    rows = []
    for k, row in enumerate(block.rows):
        cells = "".join(cell("td", i, text) for i, text in enumerate(row))
        if block.details:
            cells += f"<td><details><summary>of {escape(row[0])}</summary>{_lines(block.details[k])}</details></td>"
        shown = f' data-motion="{escape(block.motions[k])}"' if block.motions else ""
        rows.append(f"<tr{shown}>{cells}</tr>")
    caption = f"<caption>{escape(block.caption)}</caption>" if block.caption else ""
    thead = f"<thead><tr>{head}</tr></thead>" if any(block.headings) else ""
    table = f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(block.caption or "table")}">'
    table += f'<table class="plain">{caption}{thead}<tbody>{"".join(rows)}</tbody></table></div>'
    told = "" if block.evidence is None else _evidence(block.evidence)
    return f'<div class="numbers">{table}{told}</div>' if told else table


def _chart(block: ChartFigure) -> str:
    own = block.chart
    return (
        f'<figure data-chart="{escape(own.id)}">{chart_svg(own)}<figcaption>{escape(own.title)}</figcaption></figure>'
        f'<details class="values"><summary>values of this chart as a table</summary>{_table(block.table)}</details>'
    )


def _viewer(block: ViewerFigure) -> str:
    shown, said = escape(block.picture), escape(block.caption)
    image = f'<img src="{shown}" alt="{said}">' if shown else ""
    return f'<figure data-viewer="{escape(block.id)}">{image}</figure><p class="soft">{said}</p>'


def _picture(block: Picture) -> str:
    source, said = escape(block.source), escape(block.caption)
    return f'<figure class="picture"><img src="{source}" alt="{said}"><figcaption>{said}</figcaption></figure>'


def _scatters(block: Scatters) -> str:
    figures = (f"<figure>{scatter_svg(own)}<figcaption>{escape(own.title)}</figcaption></figure>" for own in block.own)
    return f'<div class="scatters">{"".join(figures)}</div>'


def _files(block: Files) -> str:
    links = (f'<a href="{escape(quote(own))}">{escape(own)}</a>' for own in block.names)
    return f'<p class="files">{" · ".join(links)}</p>'


def _verbatim(block: Verbatim) -> str:
    return f'<pre tabindex="0">{escape(block.text)}</pre>'


def _folded(block: Folded) -> str:
    inner = "".join(_block(own) for own in block.blocks)
    return f"<details><summary>{escape(block.summary)}</summary>{inner}</details>"


def _facts(block: Facts) -> str:
    rows = "".join(
        f'<div><dt>{escape(fact.label)}</dt><dd><a href="#{escape(own)}" title="{escape(heading)}">'
        f"{escape(fact.value)}</a></dd></div>"
        for fact, own, heading in block.rows
    )
    return f'<dl class="facts">{rows}</dl>'


_WRITERS: dict[type, Callable[[Any], str]] = {
    Paragraph: _paragraph,
    Bullets: _bullets,
    Evidence: _evidence,
    Table: _table,
    ChartFigure: _chart,
    ViewerFigure: _viewer,
    Scatters: _scatters,
    Picture: _picture,
    Verbatim: _verbatim,
    Files: _files,
    Folded: _folded,
    Facts: _facts,
}
