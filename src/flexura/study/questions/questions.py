"""The verb that reads questions, and what it returns: questions of one mechanism, answered for blocks of designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.mechanism import Mechanism
from flexura.records import Record
from flexura.structure import Design, Plan, plan_of
from flexura.study.questions.answers import Answers
from flexura.study.questions.catalogue import FREQUENCY, Quantity, askable
from flexura.study.questions.designs import Block
from flexura.study.questions.frequencies import Frequencies
from flexura.study.questions.grammar import separate
from flexura.study.questions.masses import body_mass, total_mass
from flexura.study.questions.reading import Reader


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

    def values(self, parameters: Mapping[str, ArrayLike]) -> Answers:
        """Answers for designs, of parameters that are numbers or arrays (designs,), SI.

        What is answered for a design is to the last bit the same whatever other designs are asked with it. A design
        that cannot be worked out has NaN and a reason. Raises OptionError for unknown parameters alone.
        """
        block = Block(self.plan, parameters)
        out = Answers.of(block.count, len(self.quantities))
        for design, why in block.refused.items():
            out.say(design, why)
        self._frequencies(block, out)
        self._masses(block, out)
        self._parameters(block, out)
        return out

    def _frequencies(self, block: Block, out: Answers) -> None:
        asked = {k: own.arguments[0] for k, own in enumerate(self.quantities) if own.kind == FREQUENCY}
        numbers = {k: own - 1 for k, own in asked.items() if isinstance(own, int)}
        if not numbers:
            out.is_proven[:] = False
            return
        found = Frequencies(block, max(numbers.values()) + 1)
        own, at = list(numbers), list(numbers.values())
        out.value[:, own], out.lower[:, own], out.upper[:, own] = (
            bound[:, at] for bound in (found.hertz, found.lower, found.upper)
        )
        out.is_proven[:] = found.is_proven[:, at].all(axis=1)
        for design, why in found.failed.items():
            out.say(design, why)

    def _masses(self, block: Block, out: Answers) -> None:
        designs = block.possible
        asked = [(k, own) for k, own in enumerate(self.quantities) if own.kind == "mass"]
        if not asked or not len(designs):
            return
        stack = Design.of(self.plan, block.some(designs))
        for k, own in asked:
            body = own.arguments[0] if own.arguments else None
            out.value[designs, k] = body_mass(stack, body) if isinstance(body, str) else total_mass(stack)

    def _parameters(self, block: Block, out: Answers) -> None:
        designs = block.possible
        asked = [(k, str(own.arguments[0])) for k, own in enumerate(self.quantities) if own.kind == "parameter"]
        if asked and len(designs):
            values = self.plan.parameter_values(block.some(designs))
            for k, name in asked:
                out.value[designs, k] = values[name]


@verb
def questions(plan: Mechanism | Plan, ask: str | Sequence[str]) -> Questions:
    """What is asked of a mechanism, by names separated by commas, or in a sequence.

    Raises OptionError, with what may be asked, for text that cannot be read and names that the mechanism lacks, and
    ModelError for a description that cannot be used.
    """
    own = plan_of(plan)
    texts = [ask] if isinstance(ask, str) else list(ask)
    reader = Reader(own)
    found = [reader.quantity(one) for text in texts for one in separate(text)]
    if not found:
        raise OptionError(f"nothing is asked; known: {', '.join(askable())}")
    texts = [one.text for one in found]
    twice = next((text for k, text in enumerate(texts) if text in texts[:k]), None)
    if twice is not None:
        raise OptionError(f"{twice} is asked twice")
    return Questions(own, tuple(found))
