"""Natural frequencies of blocks of designs at rest, by number and by what moves, each with a proven interval."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexura.arrays import Index
from flexura.reduction import independent_frequencies, independent_motions
from flexura.study.questions.answers import TOLERANCE, Answers
from flexura.study.questions.catalogue import Quantity
from flexura.study.questions.designs import FAILURES, Block, reason_of
from flexura.study.questions.followed import MODES, clear_mode
from flexura.study.questions.reading import Freedom
from flexura.study.questions.single import OneDesign


class Frequencies:
    """Frequencies that are `asked` of a block of designs at rest without loads, by their places among all that is,
    told to `out`.

    Which mode has most of a displacement is read of modes of low order where that is clear, else of those of the full
    order of the design by itself. A design is asked for no more frequencies than the highest of its numbers needs.
    """

    def __init__(self, block: Block, asked: Mapping[int, Quantity], out: Answers) -> None:
        self.block = block
        self.out = out
        self.places: list[int] = list(asked)
        self.freedoms: dict[int, Freedom] = {}
        self.numbers: Index = np.full((block.count, len(asked)), -1)
        """Numbers of modes, from 0; -1 where they are not known."""
        for q, own in enumerate(asked.values()):
            of = own.arguments[0]
            if isinstance(of, Freedom):
                self.freedoms[q] = of
            elif isinstance(of, int):
                self.numbers[block.possible, q] = of - 1
        if self.freedoms:
            block.divided(self._follow)
            self._follow_alone(tuple(asked.values()))
        counts = self.numbers.max(axis=1, initial=-1) + 1
        for count in np.unique(counts[counts > 0]).tolist():
            failed = block.divided(lambda designs, n=count: self._tell(designs, n), np.flatnonzero(counts == count))
            for design, why in failed.items():
                out.say(design, why)

    def _follow(self, designs: Index) -> None:
        """Number the modes that move what is asked, of designs where that is clear."""
        plan, most = self.block.plan, min(MODES, self.block.plan.topology.n_dof)
        nodes = plan.topology.numbers([own.node for own in self.freedoms.values()])
        found = independent_motions(plan, self.block.some(designs), nodes, most)
        if found is None:
            return
        for k, (q, own) in enumerate(self.freedoms.items()):
            for row, design in enumerate(designs):
                moved, largest = found.nodes[row, k, own.component], float(found.largest[row, int(own.turns)])
                number = clear_mode(found.hertz[row], moved, largest, own.name)
                self.numbers[design, q] = -1 if number is None else number

    def _follow_alone(self, asked: tuple[Quantity, ...]) -> None:
        """The same of the others, and what is in doubt about it."""
        followed, possible = list(self.freedoms), self.block.possible
        unknown = (self.numbers[possible][:, followed] < 0).any(axis=1)
        for design in possible[unknown].tolist():
            single = OneDesign(self.block.plan, self.block.one(design), asked)
            for q in (q for q in followed if self.numbers[design, q] < 0):
                try:
                    self.numbers[design, q], doubt = single.mode(asked[q])
                    if doubt:
                        self.out.say(design, doubt)
                except FAILURES as error:
                    self.out.say(design, f"{asked[q].text}: {reason_of(error)}")

    def _tell(self, designs: Index, count: int) -> None:
        """Take so many frequencies of some designs as answers."""
        out, some = self.out, self.block.some(designs)
        found = independent_frequencies(self.block.plan, some, n=count, tolerance=TOLERANCE)
        for q, place in enumerate(self.places):
            number = self.numbers[designs, q]
            known = np.flatnonzero(number >= 0)
            for answer, bound in zip((out.value, out.lower, out.upper), found, strict=True):
                answer[designs[known], place] = bound[known, number[known]]
            out.mode[designs[known], place] = number[known]
