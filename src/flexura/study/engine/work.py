"""What a study works out: blocks of its designs, each a function of its number alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.records import Record
from flexura.reduction import STACK
from flexura.study.engine.jumps import are_followed, jumps
from flexura.study.questions import Questions
from flexura.study.space import Designs

Columns = dict[str, NDArray[Any]]
"""Columns of some designs by their headings, in order."""

PIECE = 16 * STACK
"""Designs of a block that are asked at once, which bounds the memory of a worker."""

FEWEST_BLOCKS, MOST_BLOCKS = 64, 8192
LARGE, LARGEST = 32 * STACK, 1024 * STACK
"""Designs of a block where there are enough for many of them, and at most."""

FEW, MANY = 4, 64
"""Designs of a block, of which it has a multiple and at most without need, where one takes as long as a stack."""

DESIGN, PROVEN, REASON = "design", "is proven", "reason"

JUMPS = " jumps"
"""How headings end of where a frequency that is followed goes over to another mode."""

_TYPES = {DESIGN: np.dtype(np.int64), PROVEN: np.dtype(bool), REASON: np.dtype(object)}


def type_of(heading: str) -> np.dtype[Any]:
    """The type of a column."""
    return np.dtype(bool) if heading.endswith(JUMPS) else _TYPES.get(heading, np.dtype(np.float64))


def bounds_of(heading: str) -> tuple[str, str]:
    """Headings of the proven bounds of what is asked, e.g. `f1 lower [Hz]` and `f1 upper [Hz]`."""
    text, bracket, unit = heading.rpartition(" [")
    lower, upper = (
        f"{text if bracket else heading} {side}{bracket}{unit if bracket else ''}" for side in ("lower", "upper")
    )
    return lower, upper


def jumps_of(heading: str) -> str:
    """Heading of where a frequency that is followed goes over to another mode, e.g. `f(platform.rx) jumps`."""
    return heading.rpartition(" [")[0] + JUMPS


def block_size(designs: int, is_stacked: bool) -> int:
    """Designs of a block of a study of so many: small ones have some 64 blocks to be shared out, larger ones blocks of
    2048, and the largest some 8192 blocks or such of 65536. They are whole stacks where these are worked out at once,
    and small where one design is after another. The size is the same on any machine."""
    multiple, large = (STACK, LARGE) if is_stacked else (FEW, MANY)
    wanted = max(min(designs // FEWEST_BLOCKS, large), designs // MOST_BLOCKS, 1)
    return min(-(-wanted // multiple) * multiple, LARGEST)


@dataclass(frozen=True, repr=False)
class Work(Record):
    """What is asked of the designs of a space, with some parameters `fixed`, SI; called with the number of a block."""

    questions: Questions
    space: Designs
    fixed: Mapping[str, float]

    @property
    def size(self) -> int:
        """Designs of a block."""
        return block_size(self.space.size, self.questions.is_stacked)

    @property
    def blocks(self) -> int:
        """How many there are."""
        return -(-self.space.size // self.size)

    def span(self, number: int) -> tuple[int, int]:
        """The first design of a block, and the first behind it."""
        return number * self.size, min((number + 1) * self.size, self.space.size)

    def __call__(self, number: int) -> Columns:
        """The columns of a block."""
        start, stop = self.span(number)
        pieces = [self._piece(k, min(k + PIECE, stop)) for k in range(start, stop, PIECE)]
        return {name: np.concatenate([own[name] for own in pieces]) for name in pieces[0]}

    def _piece(self, start: int, stop: int) -> Columns:
        designs = self.space.designs(start, stop)
        answers = self.questions.values({**self.fixed, **designs})
        leaps = jumps(self.questions, self.space, self.fixed, start, answers)
        found: Columns = {DESIGN: np.arange(start, stop, dtype=np.int64)}
        found |= {self.varied[name]: values for name, values in designs.items()}
        for q, (quantity, heading) in enumerate(zip(self.questions.quantities, self.asked, strict=True)):
            found[heading] = answers.value[:, q]
            if quantity.is_bounded:
                found |= zip(self.bounds[heading], (answers.lower[:, q], answers.upper[:, q]), strict=True)
            if q in leaps:
                found[jumps_of(heading)] = leaps[q]
        return {**found, PROVEN: answers.is_proven, REASON: answers.reason}

    @property
    def asked(self) -> tuple[str, ...]:
        """Headings of what is asked, with units in brackets."""
        return self.questions.columns

    @property
    def bounds(self) -> dict[str, tuple[str, str]]:
        """Headings of the proven bounds of what is asked, where there are some."""
        return {own.column: bounds_of(own.column) for own in self.questions.quantities if own.is_bounded}

    @property
    def followed(self) -> list[str]:
        """Headings of the frequencies that are followed from design to design."""
        return [self.asked[k] for k in are_followed(self.questions, self.space)]

    @property
    def varied(self) -> dict[str, str]:
        """Headings of the parameters that vary, by name; such as are asked too are told from that."""
        taken = {DESIGN, PROVEN, REASON, *self.asked, *(name for own in self.bounds.values() for name in own)}
        taken |= set(map(jumps_of, self.followed))
        found = {}
        for own in self.space.variables:
            unit = "" if own.unit == "1" else f" [{own.unit or 'SI'}]"
            found[own.name] = f"{own.name}{unit}" if f"{own.name}{unit}" not in taken else f"parameter {own.name}{unit}"
        return found

    def headings(self) -> Iterator[tuple[str, str]]:
        """All columns in order, each with what it holds: design, parameter, asked, bound, jump, proven or
        reason."""
        yield DESIGN, "design"
        for heading in self.varied.values():
            yield heading, "parameter"
        for heading in self.asked:
            yield heading, "asked"
            for bound in self.bounds.get(heading, ()):
                yield bound, "bound"
            if heading in self.followed:
                yield jumps_of(heading), "jump"
        yield PROVEN, "proven"
        yield REASON, "reason"
