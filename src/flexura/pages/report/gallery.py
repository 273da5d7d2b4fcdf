"""Designs of a wish on one page, best first: what each does, what it is best in, and what it gives up for that."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from flexura._version import __version__
from flexura.arguments import verb
from flexura.charts import Axis
from flexura.deadline import Listener, Progress, no_listener
from flexura.errors import FlexuraError
from flexura.files import read_bytes, write_file
from flexura.full_order import plan_of
from flexura.modelfile import load, text_of
from flexura.pages.report.chart import Point, Scatter
from flexura.pages.report.document import (
    Block,
    Bullets,
    Content,
    Evidence,
    Fact,
    Facts,
    Files,
    Folded,
    Paragraph,
    Picture,
    Scatters,
    Section,
    Table,
    Tone,
    Verbatim,
    ViewerFigure,
    body_of,
    data_of,
    warned,
)
from flexura.pages.report.report import report, style
from flexura.pages.report.studies import TONES
from flexura.pages.report.subject import Commands, Subject
from flexura.pages.report.understood import parameters_of, png_of
from flexura.pages.viewer import page, scene_of, to_json
from flexura.synthesis import Candidate, Candidates, WholeCandidate
from flexura.tables import counted, number, percent, quantity, scale_for, signed_percent
from flexura.view import draw_mechanism

REPORTS = 10
"""Candidates that the command makes reports of."""

MOST = 40
"""Candidates that are shown, each with its picture and its scene."""

LONGEST = 20_000
"""Characters of the wish that are shown."""

STYLE = """
.report pre { white-space: pre-wrap; overflow-wrap: anywhere; }
.report .scatters { display: grid; gap: 0 1.5rem; max-width: 60rem; }
.report .scatters { grid-template-columns: repeat(auto-fit, minmax(min(19rem, 100%), 1fr)); }
.report svg.scatter { width: 100%; height: auto; font-size: 11px; fill: var(--soft); stroke-width: 1; }
.scatter path { stroke: var(--line); fill: none; }
.scatter path.best { stroke: var(--accent); stroke-width: 1.5; stroke-dasharray: 5 3; }
.scatter .dot circle { fill: var(--paper); stroke: var(--soft); stroke-dasharray: 2 2; }
.scatter .dot.meets circle { fill: var(--panel); stroke: var(--good); stroke-dasharray: none; }
.scatter .dot.best circle { stroke-width: 3; }
.scatter .dot text { font-size: 9.5px; fill: var(--ink); }
.report section.shown figure.picture { float: right; width: min(24rem, 45%); margin: 0 0 0.5rem 1.2rem; }
.report .rest > section { display: flow-root; }
.report .rest .scroll { max-width: 100%; }
@media (max-width: 44rem) { .report section.shown figure.picture { float: none; width: 100%; margin: 0.4rem 0; } }
"""


@dataclass(frozen=True)
class Aim:
    """Something to be best in: its name, what it is of a candidate, with `sign` -1 where less is better, text."""

    name: str
    what: str
    of: Callable[[Candidate], float]
    sign: float
    text: Callable[[float], str]

    def score(self, own: Candidate) -> float:
        """More is better, in the digits that are shown; least of all what is not known."""
        value = self.sign * float(f"{self.of(own):.4g}")
        return -np.inf if np.isnan(value) else value

    def said(self, own: Candidate) -> str:
        """What it is, in words."""
        return self.text(self.of(own)) or "not known"

    def short_of(self, own: Candidate, best: Candidate) -> str:
        """By how much a candidate is short of the best, in words; empty where it is not."""
        value, most = self.of(own), self.of(best)
        if not self.score(own) < self.score(best):
            return ""
        share = abs(value - most) / abs(most) if most and np.isfinite(value - most) else np.nan
        by = f", {percent(share, 2)} {'below' if self.sign > 0 else 'above'}" if share < 10 else " against"
        return f"{self.what} {self.said(own)}{by} the {self.said(best)} of {name_of(best)}"


AIMS = (
    Aim("highest first mode", "first mode", lambda c: c.first_hz, 1, lambda x: quantity(x, "Hz", 4)),
    Aim("lightest", "mass", lambda c: c.mass, -1, lambda x: quantity(x, "kg", 3)),
    Aim("largest margin", "least margin", lambda c: c.least_margin, 1, percent),
    Aim("widest gap", "gap", lambda c: c.gap, 1, lambda x: number(x, 3)),
    Aim("fewest over-constraints", "over-constraints", lambda c: c.over, -1, number),
    Aim("fewest limbs", "limbs", lambda c: c.limbs, -1, number),
)
TRADED = AIMS[:3]
"""What decides whether a candidate is dominated."""


def _aims(found: Candidates) -> list[Aim]:
    """All there is to be best in; each stiffness that is required as well."""
    first = found.candidates[0].requirements if found.candidates else ()
    stiff = [
        Aim(
            f"stiffest ({own.name})",
            own.name,
            lambda c, k=k: c.requirements[k].value,
            1,
            lambda x, unit=own.unit: quantity(x, unit, 4),
        )
        for k, own in enumerate(first)
        if own.text.startswith("stiffness") and ">=" in own.text
    ]
    return [*AIMS, *stiff]


def name_of(own: Candidate) -> str:
    """What a candidate is called: its file without its ending."""
    return Path(own.file).stem


def undominated(own: Sequence[Candidate], aims: Sequence[Aim]) -> list[Candidate]:
    """Those of which no other is at least as good in all aims and better in one."""
    scores = np.array([[aim.score(each) for aim in aims] for each in own]).reshape(len(own), len(aims))
    return [c for c, s in zip(own, scores, strict=True) if not ((scores >= s).all(1) & (scores > s).any(1)).any()]


@verb
def save_designs(
    found: Candidates,
    folder: str | PathLike[str],
    *,
    wish: str | PathLike[str] | None = None,
    reports: int = 0,
    progress: Listener | None = None,
) -> Path:
    """The page `index.html` of designs beside their files in a folder, from which pictures and sizes are; returns its
    path.

    `wish` is the file of the wish, which stands at the top of the page as it is. The page needs no network and nothing
    beside it; it leads to the files for making candidates, and to the reports of the first so many, `reports`, which
    are made unless they are there of the same files; `progress` is told of each. A file that cannot be read or drawn is
    told in its place. Raises ModelError for a wish that cannot be read and OptionError where the page cannot be
    written.
    """
    shown = found.candidates[:MOST]
    told, without = progress or no_listener, dict[str, str]()
    try:
        for k, own in enumerate(shown[:reports]):
            told(Progress("reports of the best", k, min(reports, len(shown))))
            without[own.file] = _reported(Path(folder) / own.file)
    finally:
        path = _saved(found, shown, Path(folder), wish, without)
    return path


def _reported(path: Path) -> str:
    """Why a file has no report beside it; empty where it has one."""
    to = path.with_suffix(".html")
    try:
        digest = hashlib.sha256(read_bytes(path)).hexdigest()
        if not to.is_file() or digest not in to.read_text(encoding="utf-8", errors="replace"):
            report(load(path), file=path, out=to)
    except FlexuraError as error:
        return f"no report: {error}"
    return ""


def _saved(
    found: Candidates,
    shown: Sequence[Candidate],
    folder: Path,
    wish: str | PathLike[str] | None,
    without: Mapping[str, str],
) -> Path:
    """The page; `without` says of files that have a report or ought to have one why they have none."""
    good = [own for own in shown if own.meets_all] or shown
    cards = [_card(found, k, own, good, folder, without) for k, own in enumerate(shown)]
    asked = () if wish is None else (Section("wish", "The wish", Content(_wished(text_of(Path(wish))))),)
    first = [*asked, Section("counts", "What was found", Content([*_counts(found, good), *_remarks(found)]))]
    sections = [Section("trade", "What trades for what", Content([*_trade(found, shown, good)])), *cards]
    title, under = f"{found.name}: designs", f"{found.freedoms}; made by flexura {__version__}"
    body = body_of(title, under, first, sections)
    text = page(title, body, "report", data_of([*first, *sections]), style=style() + STYLE)
    return write_file(folder / "index.html", lambda scratch: scratch.write_text(text, encoding="utf-8"))


def _wished(text: str) -> list[Block]:
    cut = [Paragraph(f"and {len(text) - LONGEST} more characters", "soft")] if len(text) > LONGEST else []
    return [Verbatim(text[:LONGEST].rstrip()), *cut]


def _counts(found: Candidates, good: Sequence[Candidate]) -> Iterator[Block]:
    """How many topologies there are, what became of them, and the best of the designs."""
    met = sum(own.meets_all for own in found.candidates)
    yield Paragraph(
        f"{counted(met, 'design')} of {len(found.candidates)} {'meets' if met == 1 else 'meet'} everything that is"
        f" required; freedoms wished: {found.freedoms}.",
        "good" if met else "bad",
    )
    best = [(aim, max(good, key=aim.score)) for aim in _aims(found)] if good else []
    yield Facts([(Fact(aim.name, aim.said(own)), name_of(own), name_of(own)) for aim, own in best])
    rows = [
        ["topologies listed", str(found.n_topologies)],
        ["worked out at rest", f"{found.n_at_rest}, in {counted(found.n_designs, 'design')}"],
        *([f"ruled out at rest by {name}", str(count)] for name, count in found.ruled_out.items() if count),
        ["led through their strokes", str(len(found.candidates))],
    ]
    yield Table(["topologies", "how many"], rows)
    yield Paragraph("A topology may be ruled out by several; it is, where its best design at rest misses them.", "soft")


def _remarks(found: Candidates) -> Iterator[Block]:
    yield from warned(found.warnings)
    if found.notes:
        yield Bullets(found.notes, "soft")
    if len(found.candidates) > MOST:
        yield Paragraph(f"The first {MOST} of {len(found.candidates)} candidates are shown.", "warning")


def _trade(found: Candidates, shown: Sequence[Candidate], good: Sequence[Candidate]) -> Iterator[Block]:
    """First modes over masses and over margins, and the table of all."""
    which = _which(good)
    yield Scatters([_scatter(shown, good, AIMS[1], "kg", which), _scatter(shown, good, AIMS[2], "", which)])
    yield Paragraph(
        "Numbers lead to the designs. Solid circles meet all requirements, dotted ones do not; thick ones on the line"
        f" are not dominated {which}: whatever is better in one is worse in the other.",
        "soft",
    )
    columns = found.to_columns()
    rows = [[str(cell) for cell in row] for row in zip(*columns.values(), strict=True)]
    tones: dict[str, Tone] = {cell: TONES.get(cell.partition(":")[0], "") for row in rows for cell in row}
    yield Folded("all of them as a table", [Table([*columns], rows, tones=tones)])


def _scatter(shown: Sequence[Candidate], good: Sequence[Candidate], along: Aim, unit: str, which: str) -> Scatter:
    up = AIMS[0]
    x, y = (scale_for([aim.of(own) for own in shown], u) for aim, u in ((along, unit), (up, "Hz")))
    x_size, x_unit = (x.size, x.unit) if unit else (0.01, "%")
    points = {
        own.file: Point(
            along.of(own) / x_size,
            up.of(own) / y.size,
            k + 1,
            name_of(own),
            f"{name_of(own)}: {up.said(own)}, {along.what} {along.said(own)}",
            own.meets_all,
        )
        for k, own in enumerate(shown)
    }
    best = sorted((points[own.file] for own in undominated(good, [up, along])), key=lambda own: own.x)
    said = f"{counted(len(points), 'design')}; not dominated {which}: {', '.join(str(own.number) for own in best)}"
    title = f"first mode and {along.what}"
    return Scatter(title, said, Axis(along.what, x_unit), Axis(up.what, y.unit), [*points.values()], best)


def _card(
    found: Candidates,
    place: int,
    own: Candidate,
    good: Sequence[Candidate],
    folder: Path,
    without: Mapping[str, str],
) -> Section:
    """A candidate: why it is here, what it is, its requirements, its files, its sizes, and itself."""
    name, asked = name_of(own), own.requirements
    rows = [(each.verdict, f"{each.name}: {each.text}", each.state) for each in asked]
    facts = {"freedoms": own.freedoms, **{aim.what: aim.said(own) for aim in AIMS}}
    blocks: list[Block] = [
        *_why(found, own, good),
        Facts([(Fact(label, value), name, "") for label, value in facts.items()]),
        *([Table(["verdict", "requirement", "is"], rows, tones=TONES)] if rows else []),
        Files([own.file, *([f"{name}.html"] if without.get(own.file) == "" else []), *own.made]),
        *(Paragraph(text, "soft") for text in (*own.not_made, without.get(own.file, "")) if text),
        *(_proven(found.whole) if found.whole is not None and found.whole.file == own.file else []),
    ]
    try:
        picture, *rest = _drawn(own, folder / own.file, name)
        blocks = [picture, *blocks, *rest]
    except FlexuraError as error:
        blocks.append(Paragraph(f"{own.file} could not be drawn: {error}", "bad"))
    return Section(name, f"{place + 1}. {own.topology}", Content(blocks))


def _proven(own: WholeCandidate) -> Iterator[Block]:
    """The winner as one solid."""
    is_within = all(mode.is_within is not False for mode in own.modes)
    yield Paragraph(f"{own.said}.", ("good" if is_within else "warning") if own.modes else "warning")
    rows = [
        [
            str(k),
            quantity(mode.frequency_hz, "Hz", 5),
            "none" if mode.described_hz is None else quantity(mode.described_hz, "Hz", 5),
            signed_percent(mode.difference),
            "" if mode.low is None or mode.high is None else f"{100 * mode.low:+.1f} to {100 * mode.high:+.1f} %",
            {True: "within", False: "outside", None: "not known"}[mode.is_within],
        ]
        for k, mode in enumerate(own.modes, 1)
    ]
    headings = ["mode", "as one solid", "described", "off by", "part expected", "solid is"]
    tones: dict[str, Tone] = {"within": "good", "outside": "bad"}
    table = [Table(headings, rows, range(1, 5), tones=tones)] if rows else []
    yield Folded("mode by mode, and how", [*table, Bullets(own.notes, "soft")])


def _why(found: Candidates, own: Candidate, good: Sequence[Candidate]) -> Iterator[Block]:
    """Why a candidate is there: what it meets, what it is best in, and what it is short of."""
    count = len(own.requirements)
    missed = [f"{each.name} {each.verdict}" for each in own.requirements if each.verdict != "met"]
    if own.meets_all:
        text = f"Meets all {counted(count, 'requirement')}." if count else "Nothing is required of it."
        yield Paragraph(text, "good")
    else:
        if not own.gap >= own.least_gap:
            small = "" if np.isnan(own.gap) else ", too small"
            missed.append(f"{own.gap_text} between freedoms and constraints{small}")
        yield Paragraph(f"Does not meet all: {', '.join([*missed, *own.clashes])}.", "bad")
    aims, which = _aims(found), _which(good)
    bests = {aim.name: max(good, key=aim.score) for aim in aims}
    if own not in good:
        beaten = [f"{aim.what} {aim.said(own)}" for aim in aims if aim.score(own) > aim.score(bests[aim.name])]
        if beaten:
            yield Paragraph(f"Better than any {which}: {', '.join(beaten)}.")
        return
    apart = [aim for aim in aims if len({aim.score(each) for each in good}) > 1]
    if firsts := [aim.name for aim in apart if aim.score(own) >= aim.score(bests[aim.name])]:
        yield Paragraph(f"{which.capitalize()}: {', '.join(firsts)}.")
    short = [text for aim in apart if (text := aim.short_of(own, bests[aim.name]))]
    better = next((each for each in good if own not in undominated([own, each], TRADED)), None)
    text = "Not dominated: none other is as good in first mode, mass and margin together."
    if better is not None:
        text = f"Dominated: {name_of(better)} is as good or better in first mode, mass and margin."
    yield Paragraph(f"{text} It is short of the best in:" if short else text)
    if short:
        yield Bullets(short, "soft")


def _which(good: Sequence[Candidate]) -> str:
    """Of which designs the best are told."""
    return "of those that meet all" if any(own.meets_all for own in good) else "of all, none of which meets all"


def _drawn(own: Candidate, path: Path, key: str) -> list[Block]:
    """A mechanism as its file has it: its picture, its sizes, and its scene. Raises FlexuraError."""
    mechanism = load(path)
    plan = plan_of(mechanism)
    subject = Subject(mechanism, plan, {}, Commands.of(mechanism, Path(path.name), {}, {}), 1, False)
    scene = ViewerFigure(key, to_json(scene_of(subject.model)), "", own.topology)
    picture = Picture(png_of(draw_mechanism(subject.model, title="")), own.file)
    sliders = Evidence(subject.commands("live"), summary="with sliders")
    return [picture, parameters_of(subject), Folded("in three dimensions", [scene]), sliders]
