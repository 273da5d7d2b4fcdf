"""What a study works out: blocks of its designs, each a function of its number alone.

The frequencies of a design by number are continuous over a parameter, so that one that is followed by what moves can
only leap to another mode where the number of its mode changes. There the designs are halved again and again: where
modes cross, both sides meet, and where another mode takes over what moves, they stay apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Bools, Index
from flexura.records import Record
from flexura.reduction import STACK
from flexura.study.questions import Answers, Questions
from flexura.study.space import Designs, Space

MOST_IN_ROW = 2000
"""Designs over one parameter of which each is set beside the next."""

HALVINGS = 8
"""Times that two designs are brought nearer."""

LEAP = 1 / 16
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
    if not isinstance(space, Space) or len(space.variables) != 1 or space.size > MOST_IN_ROW:
        return []
    return [k for k, quantity in enumerate(questions.quantities) if quantity.is_followed]


def jumps(
    questions: Questions, space: Designs, fixed: Mapping[str, float], start: int, answers: Answers
) -> dict[int, Bools]:
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

    def torn(self, q: int, known: dict[int, tuple[Array, Index]], start: int, stop: int) -> Bools:
        """Whether frequency q leaps behind each of the designs start ... stop - 1; answers of others are added to
        those that are `known`."""
        beyond = sorted({self.behind[k] for k in range(start, stop) if k in self.behind} - set(known))
        if beyond:
            answers = self.questions.values({**self.fixed, self.name: self.x[beyond]})
            known |= {k: (answers.value[i], answers.mode[i]) for i, k in enumerate(beyond)}
        sides = {k: _Side(float(self.x[k]), float(value[q]), int(mode[q])) for k, (value, mode) in known.items()}
        pairs = [(k, self.behind[k]) for k in range(start, stop) if k in self.behind]
        leaps = {k for k, after in pairs if self._leaps(q, sides[k], sides[after])}
        return np.array([k in leaps for k in range(start, stop)])

    def _leaps(self, q: int, low: _Side, high: _Side) -> bool:
        """Whether there is a leap between two designs that have an answer."""
        least = LEAP * abs(high.hertz - low.hertz)
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
        answers = self.questions.values({**self.fixed, self.name: np.array([x])})
        return _Side(x, float(answers.value[0, q]), int(answers.mode[0, q]))


Columns = dict[str, NDArray[Any]]
"""Columns of some designs by their headings, in order."""


class Blocks(Protocol):
    """Work in blocks by number, that is sent to workers."""

    @property
    def blocks(self) -> int:
        """How many there are."""
        ...

    def __call__(self, number: int) -> Columns:
        """What a block comes to."""
        ...

    def designs(self, *numbers: int) -> str:
        """What blocks are, in words."""
        ...


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
    text, bracket, unit = heading.rpartition(" [") if " [" in heading else (heading, "", "")
    return f"{text} lower{bracket}{unit}", f"{text} upper{bracket}{unit}"


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

    def designs(self, *numbers: int) -> str:
        """Those of blocks that follow each other, in words."""
        return f"designs {self.span(numbers[0])[0]} to {self.span(numbers[-1])[1] - 1}"

    def __call__(self, number: int) -> Columns:
        """The columns of a block."""
        start, stop = self.span(number)
        pieces = [self._piece(k, min(k + PIECE, stop)) for k in range(start, stop, PIECE)]
        return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}

    def _piece(self, start: int, stop: int) -> Columns:
        designs = self.space.designs(start, stop)
        answers = self.questions.values({**self.fixed, **designs})
        leaps = jumps(self.questions, self.space, self.fixed, start, answers)
        columns: Columns = {DESIGN: np.arange(start, stop, dtype=np.int64)}
        columns |= {self.varied[name]: values for name, values in designs.items()}
        for q, (quantity, heading) in enumerate(zip(self.questions.quantities, self.asked, strict=True)):
            columns[heading] = answers.value[:, q]
            if quantity.is_bounded:
                columns |= zip(self.bounds[heading], (answers.lower[:, q], answers.upper[:, q]), strict=True)
            if q in leaps:
                columns[jumps_of(heading)] = leaps[q]
        return {**columns, PROVEN: answers.is_proven, REASON: answers.reason}

    @property
    def asked(self) -> tuple[str, ...]:
        """Headings of what is asked, with units in brackets."""
        return self.questions.columns

    @property
    def bounds(self) -> dict[str, tuple[str, str]]:
        """Headings of the proven bounds of what is asked, where there are some."""
        return {
            quantity.column: bounds_of(quantity.column) for quantity in self.questions.quantities if quantity.is_bounded
        }

    @property
    def followed(self) -> list[str]:
        """Headings of the frequencies that are followed from design to design."""
        return [self.asked[k] for k in are_followed(self.questions, self.space)]

    @property
    def varied(self) -> dict[str, str]:
        """Headings of the parameters that vary, by name; such as are asked too are told from that."""
        taken = {DESIGN, PROVEN, REASON, *self.asked, *(name for bounds in self.bounds.values() for name in bounds)}
        taken |= set(map(jumps_of, self.followed))
        headings = {}
        for variable in self.space.variables:
            heading = variable.name if variable.unit == "1" else f"{variable.name} [{variable.unit or 'SI'}]"
            headings[variable.name] = f"parameter {heading}" if heading in taken else heading
        return headings

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
