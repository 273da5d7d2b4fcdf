"""What a report tells first: the numbers and the warnings that matter, each of its section."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from flexura.errors import Diagnostic
from flexura.pages.report.document import Block, Bullets, Fact, Paragraph, Section
from flexura.tables import counted

MOST_WARNINGS = 4
"""Warnings of a section that are repeated."""
MOST_PLACES = 4
"""Places of a warning that are named."""


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
