"""What a report tells first: the numbers and the warnings that matter, each of its section."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from flexura.errors import Exceeded
from flexura.pages.report.document import Block, Bullets, Fact, Paragraph, Section
from flexura.tables import counted

MOST_WARNINGS = 4
"""Warnings of a section that are repeated."""
MOST_PLACES = 4
"""Places of a doubt that are named."""


def facts_of(sections: Sequence[Section]) -> list[tuple[Fact, str, str]]:
    """The numbers that matter, each with the identifier and the heading of its section."""
    return [(fact, own.id, own.heading) for own in sections for fact in own.content.facts]


def warnings_of(sections: Sequence[Section]) -> Iterator[Block]:
    """What failed, and the first warnings of every section, none twice."""
    failed = [f"{own.heading} could not be made: see there." for own in sections if own.content.state == "failed"]
    if failed:
        yield Bullets(failed, "bad")
    texts: list[str] = []
    seen: set[str] = set()
    for own in sections:
        fresh = [text for text in grouped(own.content.warnings) if text not in seen]
        seen |= set(fresh)
        texts += [f"{own.heading}: {text}" for text in fresh[:MOST_WARNINGS]]
        if len(fresh) > MOST_WARNINGS:
            texts.append(f"{own.heading}: and {counted(len(fresh) - MOST_WARNINGS, 'more warning')} there")
    yield Bullets(texts, "warning") if texts else Paragraph("No warnings.", "good")


def grouped(warnings: Sequence[Any]) -> list[str]:
    """Texts of warnings, those of doubts that say the same of several places as one."""
    places: dict[str, list[str]] = {}
    for own in warnings:
        places.setdefault(own.text, []).extend([] if isinstance(own, Exceeded) else [own.place])
    return [f"{_listed(own)}: {text}" if own else text for text, own in places.items()]


def _listed(places: Sequence[str]) -> str:
    more = len(places) - MOST_PLACES
    named = ", ".join(places[:MOST_PLACES])
    return f"{named} and {more} more" if more > 0 else named
