"""What the checks share: the description in numbers, its layout, and where it could not be followed."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

from flexura.errors import Path, Problem
from flexura.mechanism.layout import TOP, Layout
from flexura.mechanism.positions import Point
from flexura.mechanism.specialised import origin_of

MAX_SUGGESTIONS_FROM = 2000
"""Names among which a close match is sought: a mechanism may have tens of thousands."""


@dataclass(frozen=True)
class Use:
    """Nodes that a part of a prototype refers to; `joins` tells whether it ties them together."""

    path: Path
    nodes: list[str]
    joins: bool


@dataclass
class Survey:
    """A mechanism under check.

    `layout` holds the mechanism with numbers for expressions (NaN where one has no value) and without the
    instances that cannot be followed, whose names are in `lost` by prototype. `ignored` are names that are
    known to be missing.
    """

    layout: Layout
    lost: dict[str, set[str]]
    ignored: Collection[str]
    partial: bool
    positions: dict[str, dict[str, Point]] = field(default_factory=dict)
    uses: dict[str, list[Use]] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    size: float = 0.0

    def report(self, path: Path, value: Any, rule: str, hint: str = "") -> None:
        """Note one problem."""
        self.problems.append(Problem(path, shown(value), rule, hint))


def prefix(prototype: str) -> Path:
    """Path of a prototype in the description."""
    return () if prototype == TOP else ("substructures", origin_of(prototype))


def shown(value: Any) -> str:
    """A value as it stands in a message."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def suggestion(name: str, known: Iterable[str], what: str) -> str:
    """A hint towards the name that was meant."""
    names = list(dict.fromkeys(known))
    if len(names) > MAX_SUGGESTIONS_FROM:
        names = [n for n in names if n[:1] == name[:1]][:MAX_SUGGESTIONS_FROM]
    close = get_close_matches(name, names, n=3)
    if close:
        return f"did you mean {' or '.join(close)}?"
    if not names:
        return f"there are no {what}"
    return f"{what}: {', '.join(names[:12])}{', ...' if len(names) > 12 else ''}"
