"""One page that tells what is known of a mechanism, with the evidence of every number."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from os import PathLike
from pathlib import Path

from flexura._version import __version__
from flexura.arguments import verb
from flexura.deadline import Listener, announcer
from flexura.errors import Diagnostic, FlexuraError, OptionError
from flexura.files import read_bytes, write_file
from flexura.full_order import plan_of
from flexura.lazy import plugins
from flexura.mechanism import Mechanism
from flexura.mechanism import at as posed
from flexura.pages.report.curves import error_budget, frequency_responses, over_the_stroke
from flexura.pages.report.document import (
    Block,
    Bullets,
    Content,
    Fact,
    Facts,
    Paragraph,
    Section,
    body_of,
    data_of,
    grouped,
)
from flexura.pages.report.loaded import buckling, static_response, stresses
from flexura.pages.report.modes import certified_modes, freedoms
from flexura.pages.report.studies import against_the_solid, required, studies, tested
from flexura.pages.report.subject import Commands, Subject
from flexura.pages.report.understood import scene_content, understood
from flexura.pages.viewer import page
from flexura.results import Result
from flexura.structure import one_design
from flexura.tables import Facts as ShownFacts
from flexura.tables import Item, Line, counted

MOST_WARNINGS = 4
"""Warnings of a section that are repeated."""


def facts_of(sections: Sequence[Section]) -> list[tuple[Fact, str, str]]:
    """The numbers that matter, each with the identifier and the heading of its section."""
    return [(fact, own.id, own.heading) for own in sections for fact in own.content.facts]


def warnings_of(sections: Sequence[Section]) -> Iterator[Block]:
    """A verdict, what failed, and the first warnings of every section, equal ones once with the sections that give
    them."""
    failed = [f"{own.heading} could not be made: see there." for own in sections if own.content.state == "failed"]
    given: dict[str, list[str]] = {}
    for own in sections:
        for text in grouped(own.content.warnings):
            given.setdefault(text, []).append(own.heading)
    made = sum(own.content.state == "shown" for own in sections)
    verdict = f"{counted(made, 'section')} could be made, {len(failed) or 'none'} could not; "
    verdict += f"{counted(len(given), 'warning')}." if given else "no warnings."
    yield Paragraph(verdict, "bad" if failed else "" if given else "good")
    if failed:
        yield Bullets(failed, "bad")
    texts: list[str] = []
    for heading in dict.fromkeys(headings[0] for headings in given.values()):
        fresh = [(text, headings) for text, headings in given.items() if headings[0] == heading]
        texts += [f"{', '.join(headings)}: {text}" for text, headings in fresh[:MOST_WARNINGS]]
        if len(fresh) > MOST_WARNINGS:
            texts.append(f"{heading}: and {counted(len(fresh) - MOST_WARNINGS, 'more warning')} there")
    if texts:
        yield Bullets(texts, "warning")


MAKERS: dict[str, tuple[str, Callable[[Subject], Content]]] = {
    "requirements": ("Requirements", required),
    "understood": ("Model summary", understood),
    "modes": ("Natural modes", certified_modes),
    "freedoms": ("Freedoms and stiffness", freedoms),
    "statics": ("Static response to what is described", static_response),
    "stroke": ("Stroke", over_the_stroke),
    "responses": ("Frequency responses", frequency_responses),
    "budget": ("Error budget", error_budget),
    "stress": ("Stress and margins", stresses),
    "buckling": ("Preload and buckling", buckling),
    "studies": ("Studies", studies),
    "solid": ("Against the solid", against_the_solid),
    "test": ("Test", tested),
}
"""Heading and maker of every section but the summary, by identifier, in their order."""


@dataclass(frozen=True, repr=False)
class Report(Result):
    """A page about a mechanism: `html` is the whole file. `states` says of every section whether it is shown, absent or
    failed, `seconds` how long it took; `warnings` are those of all sections."""

    _shown = ("name", "states")
    _told = ("name", "states")

    name: str
    html: str
    states: dict[str, str]
    seconds: dict[str, float] = field(compare=False)
    warnings: tuple[Diagnostic, ...] = ()

    def presentation(self) -> Iterator[Item]:
        """Sections that are in the page and that are not, and how many warnings."""
        states = {"shown": "in it", "absent": "not in it", "failed": "failed"}
        sections = {words: [name for name, its in self.states.items() if its == s] for s, words in states.items()}
        yield ShownFacts({words: ", ".join(names) for words, names in sections.items()})
        if self.warnings:
            yield Line(f"{counted(len(self.warnings), 'warning')}; see the page")

    def write(self, path: str | PathLike[str]) -> Path:
        """Write the page as one file, whole or not at all; returns its path. Raises OptionError where it cannot be
        written."""
        return write_file(Path(path), lambda scratch: scratch.write_text(self.html, encoding="utf-8"))


@verb
def report(
    model: Mechanism,
    parameters: Mapping[str, float] | None = None,
    *,
    out: str | PathLike[str] | None = None,
    file: str | PathLike[str] | None = None,
    at: Mapping[str, float] | None = None,
    n: int = 6,
    solid: bool = False,
    title: str | None = None,
    progress: Listener | None = None,
) -> Report:
    """Everything that is known of a mechanism as one HTML page that needs no network.

    The model summary, `n` certified modes, freedoms, statics, the described stroke, frequency responses, the error
    budget, stress, buckling, the described studies that are small and the described test, each where it applies; finite
    elements with `solid`, which take longer. Every number unfolds to its evidence and to the command that makes it
    again. A section that fails says why, and the others go on.

    `parameters` replace default values, `at` is a pose as `flexura.at` takes it; SI. `out` is written, whole or not at
    all, where it is given. `file` is the one that the mechanism was read from: commands name it, and the page tells its
    hash. `progress` is told of every section. The page is the same, byte by byte, whenever the same is asked for.

    Raises ModelError for a description that cannot be used at all, OptionError for impossible arguments, and where the
    file cannot be written.
    """
    if isinstance(n, bool) or n < 1:
        raise OptionError(f"the number of modes is a whole number, at least 1, not {n!r}")
    subject, digest = _subject(model, one_design(parameters), file, at or {}, n, solid)
    say = announcer(progress)
    sections, seconds = list[Section](), dict[str, float]()
    for name, (heading, make) in {**MAKERS, **plugins("report_sections")}.items():
        say(heading)
        begun = time.perf_counter()
        sections.append(Section(name, heading, _made(make, subject)))
        seconds[name] = time.perf_counter() - begun
    say("In three dimensions")
    begun = time.perf_counter()
    scene = scene_content(subject, [own for section in sections for own in section.content.shown])
    seconds["scene"] = time.perf_counter() - begun
    source = "" if file is None else f"{Path(file).name}, SHA-256 {digest}; "
    under = f"{source}made by flexura {__version__}"
    name = subject.mechanism.name
    first = [
        Section("summary", "Summary", Content([Facts(facts_of(sections))])),
        Section("scene", "In three dimensions", scene),
    ]
    rest = [Section("warnings", "Warnings", Content(list(warnings_of(sections)))), *sections]
    body, data = body_of(title or name, under, first, rest), data_of([*first, *rest])
    text = page(title or name, body, "report", data, style=style())
    warnings = tuple(w for section in sections for w in section.content.warnings)
    states = {section.id: section.content.state for section in (first[1], *sections)}
    found = Report(name, text, states, seconds, warnings)
    if out is not None:
        found.write(out)
    return found


def _subject(
    model: Mechanism,
    parameters: Mapping[str, float],
    file: str | PathLike[str] | None,
    pose: Mapping[str, float],
    n: int,
    solid: bool,
) -> tuple[Subject, str]:
    """What the report is about, and the hash of its file."""
    if not isinstance(model, Mechanism):
        raise OptionError(f"a Mechanism is expected, not a {type(model).__name__}; flexura.load reads a file")
    commands = Commands.of(model, None if file is None else Path(file), parameters, pose)
    digest = "" if file is None else hashlib.sha256(read_bytes(Path(file))).hexdigest()
    mechanism = posed(model, pose) if pose else model
    plan = plan_of(mechanism, parameters)
    plan.verify(parameters)
    return Subject(plan.mechanism, plan, parameters, commands, n, solid), digest


def _made(make: Callable[[Subject], Content], subject: Subject) -> Content:
    """What a section holds, or why it could not be made."""
    try:
        return make(subject)
    except FlexuraError as error:
        return Content([Paragraph(f"{type(error).__name__}: {error}", "bad")], "failed")


@cache
def style() -> str:
    """What pages of a report have beside the style of all pages."""
    return (Path(__file__).parent / "report.css").read_text(encoding="utf-8")
