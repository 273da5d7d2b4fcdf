"""The verb that reads questions, and what it returns: questions of one mechanism, answered for blocks of designs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import repeat

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Bools, Index
from flexura.derivatives import free_names
from flexura.errors import OptionError
from flexura.fem import surface_of
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism
from flexura.motion import MovingModel, stack_size
from flexura.records import Record
from flexura.reduction import independent_frequencies, independent_motions
from flexura.structure import Design, Plan, one_design
from flexura.study.questions.blocks import FAILURES, STATIC, Answers, Block, Statics, are_proven, mass_of, reason_of
from flexura.study.questions.grammar import separate
from flexura.study.questions.kinds import FREQUENCY, WORST, Quantity, askable
from flexura.study.questions.reading import Freedom, Reader
from flexura.study.questions.single import OneDesign
from flexura.study.questions.slopes import Exact, Slopes, differences, steps
from flexura.study.questions.states import MODES_FOLLOWED, ModalMotion, clear_mode
from flexura.thresholds import PROVEN


@verb
def questions(model: Mechanism | Plan, ask: str | Sequence[str]) -> Questions:
    """What is asked of a mechanism, by names separated by commas, or in a sequence.

    Raises OptionError, with what may be asked, for text that cannot be read and names that the mechanism lacks, and
    ModelError for a description that cannot be used.
    """
    plan = plan_of(model)
    reader = Reader(plan)
    texts = [ask] if isinstance(ask, str) else list(ask)
    quantities = [reader.quantity(name) for text in texts for name in separate(text)]
    if not quantities:
        raise OptionError(f"no quantity is named; known: {', '.join(askable())}")
    names = [quantity.text for quantity in quantities]
    for k, name in enumerate(names):
        if name in names[:k]:
            raise OptionError(f"{name} is named twice")
    return Questions(plan, tuple(quantities))


@dataclass(frozen=True, repr=False)
class Questions(Record):
    """What is asked of the designs of a plan."""

    _shown = ("columns",)

    plan: Plan
    quantities: tuple[Quantity, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """Headings: what is asked, with its unit, e.g. `f1 [Hz]`."""
        return tuple(quantity.column for quantity in self.quantities)

    @property
    def notes(self) -> tuple[str, ...]:
        """What answers leave out, and which names are asked for that parameters have as well."""
        names = dict.fromkeys(own.bare for own in self.quantities if own.kind != "parameter")
        notes = [
            f"{name} is the quantity of this name, not the parameter that is called so: that is parameter({name})"
            for name in names
            if name in self.plan.mechanism.parameters
        ]
        superelements = [
            ".".join((*path, key))
            for name, prototype in self.plan.layout.prototypes.items()
            for path in self.plan.topology.copies[name].paths
            for key, described in prototype.superelements.items()
            if (surface := surface_of(described)) is None or surface.stress is None
        ]
        of_all = [
            own.text
            for own in self.quantities
            if own.kind == "reach" or (own.kind in ("stress", "margin") and not own.arguments)
        ]
        if superelements and of_all:
            parts = ", ".join(superelements)
            notes.append(f"{', '.join(of_all)}: not of {parts}, superelements, of whose stress nothing is known")
        return tuple(notes)

    def values(self, parameters: Mapping[str, ArrayLike]) -> Answers:
        """Answers for designs, of parameters that are numbers or arrays (designs,), SI.

        What is answered for a design is to the last bit the same whatever other designs are asked with it. A design
        that cannot be worked out has NaN and a reason. Raises OptionError for unknown parameters alone.
        """
        block = Block(self.plan, parameters)
        answers = Answers.of(block.count, len(self.quantities))
        for design, why in block.refused.items():
            answers.say(design, why)
        if len(block.possible):
            with np.errstate(all="ignore"):
                self._answer_together(block, answers)
                self._answer_alone(block, answers)
        asked = [k for k, quantity in enumerate(self.quantities) if quantity.kind == FREQUENCY]
        proven = are_proven(answers.value, answers.lower, answers.upper)
        answers.is_proven[:] = proven[:, asked].all(axis=1) & bool(asked)
        return answers

    def slopes(self, parameters: Mapping[str, float], names: Sequence[str]) -> Slopes:
        """What is asked of one design with its derivatives by the parameters `names`, in their order.

        Exact where that is known, else by differences of fourth order of values at nearby designs, which
        `Slopes.is_exact` tells. Raises OptionError for names that are unknown, or follow from others.
        """
        chosen, at = free_names(self.plan, names), one_design(parameters)
        exact = Exact(self.plan, at, chosen, self.quantities)
        rest = [k for k, is_exact in enumerate(exact.is_exact) if not is_exact]
        if rest:
            others = Questions(self.plan, tuple(self.quantities[k] for k in rest))
            known = self.plan.parameter_values(at)
            here = others.values(at)
            designs, away = steps(self.plan, {**at, **{name: float(known[name]) for name in chosen}}, chosen)
            around = others.values(designs)
            exact.value[rest], exact.slope[rest] = here.value[0], differences(around.value, away)
            for k in rest:
                exact.reason[k] = next(filter(None, (here.reason[0], *around.reason)), "")
        return Slopes(
            quantities=self.quantities,
            names=chosen,
            value=exact.value,
            slope=exact.slope,
            is_exact=exact.is_exact,
            reason=exact.reason,
            repeated=tuple(exact.repeated),
            directional=tuple(exact.directional),
            least=exact.least,
        )

    @property
    def is_stacked(self) -> bool:
        """Whether everything is worked out for many designs at once, nothing for one after another."""
        return all(map(self._is_together, self.quantities))

    def _is_together(self, quantity: Quantity) -> bool:
        """Whether a quantity is worked out for many designs at once: what does not depend on a state, and what is asked
        at rest without loads of frequencies and of the flexibility."""
        is_bare = not (quantity.pose or self.plan.is_loaded or self.plan.is_posed)
        return quantity.kind in ("mass", "parameter") or (is_bare and quantity.kind in (FREQUENCY, *STATIC))

    def _answer_together(self, block: Block, answers: Answers) -> None:
        """Answer what is worked out for all designs at once."""
        together = {k: quantity for k, quantity in enumerate(self.quantities) if self._is_together(quantity)}
        stack = Design.of(self.plan, block.some(block.possible))
        values = self.plan.parameter_values(block.some(block.possible))
        for k, quantity in together.items():
            if quantity.kind == "mass":
                answers.value[block.possible, k] = mass_of(stack, quantity)
            elif quantity.kind == "parameter":
                answers.value[block.possible, k] = values[str(quantity.arguments[0])]
        if frequencies := {k: quantity for k, quantity in together.items() if quantity.kind == FREQUENCY}:
            _Frequencies(block, frequencies, answers)
        if static := [k for k, quantity in together.items() if quantity.kind in STATIC]:
            answers.value[:, static] = Statics(block, [self.quantities[k] for k in static]).value

    def _answer_alone(self, block: Block, answers: Answers) -> None:
        """Answer what is asked of one design after another, and static quantities that could not be solved together."""
        known: Bools = np.isfinite(answers.value)
        for k, quantity in enumerate(self.quantities):
            known[:, k] |= self._is_together(quantity) and quantity.kind not in STATIC
        alone = block.possible[~known[block.possible].all(axis=1)]
        for design, model in zip(alone.tolist(), self._models(block, alone), strict=True):
            single = OneDesign(self.plan, block.one(design), self.quantities, model)
            for k in np.flatnonzero(~known[design]).tolist():
                quantity = self.quantities[k]
                try:
                    if quantity.kind != FREQUENCY:
                        answers.value[design, k] = single.read(quantity)
                        continue
                    number, warning = single.mode(quantity)
                    bounded = single.frequencies(quantity)
                    numbers = (answers.value, answers.lower, answers.upper)
                    for array, frequencies in zip(numbers, bounded, strict=True):
                        array[design, k] = frequencies[number]
                    answers.mode[design, k] = number
                    if warning:
                        answers.say(design, warning)
                except FAILURES as error:
                    answers.say(design, f"{quantity.text}: {reason_of(error)}")

    def _models(self, block: Block, designs: Index) -> Iterator[MovingModel | None]:
        """Models that move, a stack of designs at once, where something is asked at poses; None where one has to be
        worked out by itself."""
        if not any(quantity.pose or quantity.kind == WORST for quantity in self.quantities):
            yield from repeat(None, len(designs))
            return
        count = stack_size(self.plan)
        for some in np.split(designs, range(count, len(designs), count)):
            try:
                stack = Design.of(self.plan, block.some(some)) if len(some) > 1 else None
                yield from list(MovingModel.several(stack)) if stack else [None]
            except FAILURES:
                yield from repeat(None, len(some))


class _Frequencies:
    """Frequencies that are asked of a block of designs at rest without loads, by their places among all that is.

    Which mode has most of a displacement is read of modes of low order where that is clear, else of those of the full
    order of the design by itself. A design is asked for no more frequencies than the highest of its numbers needs.
    """

    def __init__(self, block: Block, asked: Mapping[int, Quantity], answers: Answers) -> None:
        self.block, self.answers = block, answers
        self.places, self.quantities = list(asked), tuple(asked.values())
        self.numbers: Index = np.full((block.count, len(asked)), -1)
        """Numbers of modes, from 0; -1 where they are not known."""
        self.followed: dict[int, Freedom] = {}
        for q, quantity in enumerate(self.quantities):
            of = quantity.arguments[0]
            if isinstance(of, Freedom):
                self.followed[q] = of
            elif isinstance(of, int):
                self.numbers[block.possible, q] = of - 1
        if self.followed:
            block.divided(self._follow)
            self._follow_alone()
        counts = self.numbers.max(axis=1, initial=-1) + 1
        for count in np.unique(counts[counts > 0]).tolist():
            failed = block.divided(lambda designs, n=count: self._answer(designs, n), np.flatnonzero(counts == count))
            for design, why in failed.items():
                answers.say(design, why)

    def _follow(self, designs: Index) -> None:
        """Number the modes that move what is asked, of designs where that is clear."""
        plan = self.block.plan
        nodes = plan.topology.numbers([freedom.node for freedom in self.followed.values()])
        count = min(MODES_FOLLOWED, plan.topology.n_dof)
        motions = independent_motions(plan, self.block.some(designs), nodes, count)
        if motions is None:
            return
        for k, (q, freedom) in enumerate(self.followed.items()):
            for row, design in enumerate(designs):
                moved, largest = motions.nodes[row, k, freedom.component], motions.largest[row, int(freedom.turns)]
                number = clear_mode(ModalMotion(motions.hertz[row], moved, float(largest)), freedom.name)
                self.numbers[design, q] = -1 if number is None else number

    def _follow_alone(self) -> None:
        """The same of the others, and where other modes move as much."""
        followed, possible = list(self.followed), self.block.possible
        unknown = (self.numbers[possible][:, followed] < 0).any(axis=1)
        for design in possible[unknown].tolist():
            single = OneDesign(self.block.plan, self.block.one(design), self.quantities)
            for q in (q for q in followed if self.numbers[design, q] < 0):
                try:
                    self.numbers[design, q], warning = single.mode(self.quantities[q])
                    if warning:
                        self.answers.say(design, warning)
                except FAILURES as error:
                    self.answers.say(design, f"{self.quantities[q].text}: {reason_of(error)}")

    def _answer(self, designs: Index, count: int) -> None:
        """Take so many frequencies of some designs as answers."""
        answers, parameters = self.answers, self.block.some(designs)
        found = independent_frequencies(self.block.plan, parameters, n=count, tolerance=PROVEN)
        for q, place in enumerate(self.places):
            number = self.numbers[designs, q]
            known = np.flatnonzero(number >= 0)
            for array, frequencies in zip((answers.value, answers.lower, answers.upper), found, strict=True):
                array[designs[known], place] = frequencies[known, number[known]]
            answers.mode[designs[known], place] = number[known]
