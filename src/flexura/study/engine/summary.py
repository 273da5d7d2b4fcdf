"""What can be told of a study without holding it: how many designs fail and why, and the extremes of each quantity."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from flexura.records import Record
from flexura.study.engine.work import DESIGN, PROVEN, REASON, Columns

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
