"""The verb that reads questions, and what it returns: questions of one mechanism, answered for blocks of designs.

Natural frequencies of blocks of designs at rest, by number and by what moves, each with a proven interval.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.arrays import Index
from flexura.errors import OptionError
from flexura.mechanism import Mechanism
from flexura.records import Record
from flexura.reduction import independent_frequencies, independent_motions
from flexura.sensitivity import free_names
from flexura.structure import Design, Plan, one_design, plan_of
from flexura.study.questions.blocks import (
    FAILURES,
    STATIC,
    TOLERANCE,
    Answers,
    Block,
    Statics,
    are_proven,
    body_mass,
    reason_of,
    total_mass,
)
from flexura.study.questions.grammar import FREQUENCY, Quantity, askable, separate
from flexura.study.questions.reading import Freedom, Reader
from flexura.study.questions.single import OneDesign
from flexura.study.questions.slopes import Exact, Slopes, differences, steps
from flexura.study.questions.states import MODES, clear_mode


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


Flags = NDArray[np.bool_]

STRESSES = ("stress", "margin")
"""Quantities of some members, or of all where none are named."""


@dataclass(frozen=True, repr=False)
class Questions(Record):
    """What is asked of the designs of a plan."""

    _shown = ("columns",)

    plan: Plan
    quantities: tuple[Quantity, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """Headings: what is asked, with its unit, e.g. `f1 [Hz]`."""
        return tuple(own.column for own in self.quantities)

    @property
    def notes(self) -> tuple[str, ...]:
        """What answers leave out, and which names are asked for that parameters have as well."""
        return (*self._taken, *self._unknown_stress)

    @property
    def _taken(self) -> tuple[str, ...]:
        names = dict.fromkeys(own.text.partition(" at ")[0] for own in self.quantities if own.kind != "parameter")
        return tuple(
            f"{name} is the quantity of this name, not the parameter that is called so: that is parameter({name})"
            for name in names
            if name in self.plan.mechanism.parameters
        )

    @property
    def _unknown_stress(self) -> tuple[str, ...]:
        inside = [
            ".".join((*path, key))
            for name, prototype in self.plan.layout.prototypes.items()
            for path in self.plan.topology.copies[name].paths
            for key in prototype.superelements
        ]
        wide = [own for own in self.quantities if own.kind == "reach" or (own.kind in STRESSES and not own.arguments)]
        if not (inside and wide):
            return ()
        texts, parts = ", ".join(own.text for own in wide), ", ".join(inside)
        return (f"{texts}: of members alone; of stress in {parts}, superelements, nothing is known",)

    def values(self, parameters: Mapping[str, ArrayLike]) -> Answers:
        """Answers for designs, of parameters that are numbers or arrays (designs,), SI.

        What is answered for a design is to the last bit the same whatever other designs are asked with it. A design
        that cannot be worked out has NaN and a reason. Raises OptionError for unknown parameters alone.
        """
        block = Block(self.plan, parameters)
        out = Answers.of(block.count, len(self.quantities))
        for design, why in block.refused.items():
            out.say(design, why)
        if len(block.possible):
            with np.errstate(all="ignore"):
                self._masses(block, out)
                self._parameters(block, out)
                self._frequencies(block, out)
                self._others(block, out, self._statics(block, out))
        asked = self._of(FREQUENCY)
        out.is_proven[:] = are_proven(out.value, out.lower, out.upper)[:, asked].all(axis=1) & bool(asked)
        return out

    def slopes(self, parameters: Mapping[str, float], names: Sequence[str]) -> Slopes:
        """What is asked of one design with its derivatives by the parameters `names`, in their order.

        Exact where that is known, else by differences of fourth order of values at nearby designs, which
        `Slopes.is_exact` tells. Raises OptionError for names that are unknown, or follow from others.
        """
        chosen, at = free_names(self.plan, names), one_design(parameters)
        own = Exact(self.plan, at, chosen, self.quantities)
        rest = [k for k, exact in enumerate(own.is_exact) if not exact]
        if rest:
            others = Questions(self.plan, tuple(self.quantities[k] for k in rest))
            known = self.plan.parameter_values(at)
            here = others.values(at)
            beside, h = steps({**at, **{name: float(known[name]) for name in chosen}}, chosen)
            around = others.values(beside)
            own.value[rest], own.slope[rest] = here.value[0], differences(around.value, h)
            for k in rest:
                own.reason[k] = next(filter(None, (here.reason[0], *around.reason)), "")
        groups = tuple(own.repeated), tuple(own.directional)
        return Slopes(self.quantities, chosen, own.value, own.slope, own.is_exact, own.reason, *groups, own.least)

    @property
    def is_stacked(self) -> bool:
        """Whether everything is worked out for many designs at once, nothing for one after another."""
        return all(map(self._is_at_once, self.quantities))

    def _is_at_once(self, own: Quantity) -> bool:
        is_frequency = own.kind == FREQUENCY and not own.pose and self._is_bare
        return own.kind in ("mass", "parameter") or is_frequency or self._is_static(own)

    @property
    def _is_bare(self) -> bool:
        """Whether designs are at rest and without loads."""
        return not (self.plan.is_loaded or self.plan.is_posed)

    def _is_static(self, own: Quantity) -> bool:
        """Whether it follows from the flexibility at rest, without loads."""
        return own.kind in STATIC and not own.pose and self._is_bare

    def _of(self, kind: str) -> list[int]:
        """Places of what is asked of a kind."""
        return [k for k, own in enumerate(self.quantities) if own.kind == kind]

    def _masses(self, block: Block, out: Answers) -> None:
        asked, designs = self._of("mass"), block.possible
        if not asked:
            return
        stack = Design.of(self.plan, block.some(designs))
        for k in asked:
            body = next(iter(self.quantities[k].arguments), None)
            out.value[designs, k] = body_mass(stack, body) if isinstance(body, str) else total_mass(stack)

    def _parameters(self, block: Block, out: Answers) -> None:
        asked, designs = self._of("parameter"), block.possible
        values = self.plan.parameter_values(block.some(designs)) if asked else {}
        for k in asked:
            out.value[designs, k] = values[str(self.quantities[k].arguments[0])]

    def _frequencies(self, block: Block, out: Answers) -> None:
        """Answer frequencies of all designs at once, of what is at rest without loads."""
        asked = {k: self.quantities[k] for k in self._of(FREQUENCY) if self._is_at_once(self.quantities[k])}
        if asked:
            Frequencies(block, asked, out)

    def _statics(self, block: Block, out: Answers) -> Flags:
        """Answer what follows from the flexibility of all designs at once; which answers (designs, q) that gave."""
        asked = [k for k, own in enumerate(self.quantities) if self._is_static(own)]
        if asked:
            out.value[:, asked] = Statics(block, [self.quantities[k] for k in asked]).value
        return np.isfinite(out.value)

    def _others(self, block: Block, out: Answers, known: Flags) -> None:
        """Answer what is asked of one design after another, where it is not known."""
        for k, own in enumerate(self.quantities):
            known[:, k] |= self._is_at_once(own) and not self._is_static(own)
        for design in block.possible[~known[block.possible].all(axis=1)]:
            single = OneDesign(self.plan, block.one(design), self.quantities)
            for k in np.flatnonzero(~known[design]).tolist():
                own = self.quantities[k]
                try:
                    if own.kind != FREQUENCY:
                        out.value[design, k] = single.read(own)
                        continue
                    number, doubt = single.mode(own)
                    out.tell(design, k, single.frequencies(own), number)
                    if doubt:
                        out.say(design, doubt)
                except FAILURES as error:
                    out.say(design, f"{own.text}: {reason_of(error)}")


@verb
def questions(model: Mechanism | Plan, ask: str | Sequence[str]) -> Questions:
    """What is asked of a mechanism, by names separated by commas, or in a sequence.

    Raises OptionError, with what may be asked, for text that cannot be read and names that the mechanism lacks, and
    ModelError for a description that cannot be used.
    """
    own = plan_of(model)
    texts = [ask] if isinstance(ask, str) else list(ask)
    reader = Reader(own)
    found = [reader.quantity(one) for text in texts for one in separate(text)]
    if not found:
        raise OptionError(f"no quantity is named; known: {', '.join(askable())}")
    texts = [one.text for one in found]
    twice = next((text for k, text in enumerate(texts) if text in texts[:k]), None)
    if twice is not None:
        raise OptionError(f"{twice} is named twice")
    return Questions(own, tuple(found))
