"""Where a frequency that is followed by what moves goes over to another mode between two designs.

The frequencies of a design by number are continuous over a parameter, so that one that is followed can only leap where
the number of its mode changes. There the designs are halved again and again: where modes cross, both sides meet, and
where another mode takes over what moves, they stay apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.study.questions import Answers, Questions
from flexura.study.space import Designs, Space

MOST = 2000
"""Designs over one parameter of which each is set beside the next."""

HALVINGS = 8
"""Times that two designs are brought nearer."""

APART = 1 / 16
"""Part of the first difference from which on both sides stay apart: where they meet, some 1/256 is left of it."""

CHANGES = 4
"""Changes of number between two designs that are told apart."""


class _Side(NamedTuple):
    """A value of the parameter, the frequency there and the number of its mode, from 0; -1 where that is not known."""

    x: float
    hertz: float
    mode: int


def are_followed(questions: Questions, space: Designs) -> list[int]:
    """Places of the frequencies that are followed over designs that stand in one row."""
    if not isinstance(space, Space) or len(space.variables) != 1 or space.size > MOST:
        return []
    return [k for k, own in enumerate(questions.quantities) if own.is_followed]


def jumps(
    questions: Questions, space: Designs, fixed: Mapping[str, float], start: int, answers: Answers
) -> dict[int, NDArray[np.bool_]]:
    """For each frequency that is followed, by its place, whether it leaps between each design, number `start` the first
    of the `answers`, and the one with the next larger value of the parameter."""
    places = are_followed(questions, space)
    if not places:
        return {}
    row = _Row(Questions(questions.plan, tuple(questions.quantities[k] for k in places)), space, fixed)
    stop = start + len(answers.value)
    known = {k: (answers.value[k - start, places], answers.mode[k - start, places]) for k in range(start, stop)}
    return {place: row.torn(q, known, start, stop) for q, place in enumerate(places)}


class _Row:
    """Designs in a row, over one parameter."""

    def __init__(self, questions: Questions, space: Designs, fixed: Mapping[str, float]) -> None:
        self.questions, self.fixed = questions, fixed
        [(self.name, self.x)] = space.designs(0, space.size).items()
        order = np.argsort(self.x, kind="stable")
        self.behind = dict(zip(order[:-1].tolist(), order[1:].tolist(), strict=True))

    def torn(
        self, q: int, known: dict[int, tuple[Array, NDArray[np.intp]]], start: int, stop: int
    ) -> NDArray[np.bool_]:
        """Whether frequency q leaps behind each of the designs start ... stop - 1; answers of others are added to
        those that are `known`."""
        beyond = sorted({self.behind[k] for k in range(start, stop) if k in self.behind} - set(known))
        if beyond:
            found = self.questions.values({**self.fixed, self.name: self.x[beyond]})
            known |= {k: (found.value[i], found.mode[i]) for i, k in enumerate(beyond)}
        sides = {k: _Side(float(self.x[k]), float(value[q]), int(mode[q])) for k, (value, mode) in known.items()}
        pairs = [(k, self.behind[k]) for k in range(start, stop) if k in self.behind]
        leaps = {k for k, after in pairs if self._leaps(q, sides[k], sides[after])}
        return np.array([k in leaps for k in range(start, stop)])

    def _leaps(self, q: int, low: _Side, high: _Side) -> bool:
        """Whether there is a leap between two designs that have an answer."""
        least = APART * abs(high.hertz - low.hertz)
        for _ in range(CHANGES):
            if min(low.mode, high.mode) < 0 or low.mode == high.mode:
                return False
            near, far = low, high
            for _ in range(HALVINGS):
                middle = self._at(q, (near.x + far.x) / 2)
                if middle.mode < 0:
                    return True
                near, far = (middle, far) if middle.mode == near.mode else (near, middle)
            if abs(far.hertz - near.hertz) > least:
                return True
            low = far
        return False

    def _at(self, q: int, x: float) -> _Side:
        found = self.questions.values({**self.fixed, self.name: np.array([x])})
        return _Side(x, float(found.value[0, q]), int(found.mode[0, q]))
