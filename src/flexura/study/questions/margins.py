"""The second margin of what is asked of one design: how far the part that is drawn may be from the number."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flexura.analysis import ModelError, interval_text, model_errors_of_modes
from flexura.arrays import Array
from flexura.records import Record
from flexura.structure import Plan
from flexura.study.questions.blocks import FAILURES, STATIC, ends_of, reason_of
from flexura.study.questions.formulas import Formula
from flexura.study.questions.grammar import FREQUENCY, Quantity
from flexura.study.questions.single import OneDesign
from flexura.study.questions.states import PosedState

Interval = tuple[float, float]
Pose = tuple[tuple[str, float], ...]
Worker = Callable[[OneDesign, Sequence[Quantity]], "dict[str, Moved]"]

EXACT = "exact for the description"

LEAST = 1e-3
"""What is left of a number at least."""

FEWEST = 6
"""Modes that are looked at at least, as `modes` has them."""

NO_EVIDENCE: dict[str, tuple[str, ...]] = {
    "a stroke until something yields": ("reach",),
    "a force that holds a pose": ("force",),
    "a buckling factor": ("buckling",),
    "a frequency response": ("frf", "frf_peak"),
}
"""What there is no evidence for, and who follows from it."""


@dataclass(frozen=True)
class Moved:
    """What assumptions do to a quantity: `middle` and, by group of them, plus and minus `spread` is added, relative, to
    a number of which it is a `power`, 0 where it is not moved, or is nothing known of it, for a `reason`."""

    power: float
    reason: str = ""
    middle: float = 0.0
    spread: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_known(self) -> bool:
        """Whether there is evidence."""
        return self.reason in ("", EXACT)

    def by(self, sign: float, group: str) -> float:
        """What the quantity is multiplied by at an end of what one group of assumptions leaves open."""
        return max(1 + self.middle + sign * self.spread.get(group, 0.0), LEAST) ** self.power


@dataclass(frozen=True, repr=False)
class Margins(Record):
    """Model errors of what is asked of one design, `where` that is, and of formulas of it with the `values` (SI, by
    text) of what is in them. Worked out when first asked for: as long as modes take."""

    _shown = ("where",)

    plan: Plan
    parameters: Mapping[str, float]
    quantities: Sequence[Quantity]
    where: str = "nominal design"
    formulas: Sequence[Formula] = ()
    values: Mapping[str, float] | None = None

    @cached_property
    def intervals(self) -> dict[str, Interval | None]:
        """By question, where the part's value lies: between 1 + low and 1 + high times the one given; None where there
        is no evidence."""
        return {text: own if isinstance(own, tuple) else None for text, own in self._found.items()}

    @property
    def reasons(self) -> dict[str, str]:
        """Why questions have no model error."""
        return {text: own for text, own in self._found.items() if isinstance(own, str)}

    @property
    def texts(self) -> dict[str, str]:
        """In words, by question."""
        return {text: own if isinstance(own, str) else interval_text(own) for text, own in self._found.items()}

    @property
    def lines(self) -> list[str]:
        """A line for each question."""
        told = self.texts.items()
        return [f"{name}: model error {text} ({self.where})" for name, text in told if name not in self.reasons] + [
            f"{name}: no model error, {why}" for name, why in self.reasons.items()
        ]

    @cached_property
    def _found(self) -> dict[str, Interval | str]:
        found = {own.text: self._relative(lambda v, text=own.text: v[text], [own], {}) for own in self.quantities}
        for own in self.formulas:
            found[own.text] = self._relative(own.evaluate, own.quantities, self.values or {})
        return found

    def _relative(
        self, evaluate: Callable[..., float], asked: Sequence[Quantity], values: Mapping[str, float]
    ) -> Interval | str:
        own = {quantity.text: values.get(quantity.text, 1.0) for quantity in asked}
        if (why := self._why(asked)) is not None:
            return why
        whole, ends = float(evaluate(own)), self.span(evaluate, asked, own)
        if not whole or ends is None or not np.isfinite([*ends, whole]).all():
            return "it is zero, or not known"
        low, high = sorted(end / whole - 1 for end in ends)
        return low, high

    def _why(self, asked: Sequence[Quantity]) -> str | None:
        """Why there is no model error of what follows from quantities; None where there is."""
        without = [own.reason for quantity in asked if not (own := self.moved(quantity)).is_known]
        exact = all(self.moved(quantity).reason == EXACT for quantity in asked)
        return without[0] if without else EXACT if exact else None

    def span(
        self, evaluate: Callable[..., float], asked: Sequence[Quantity], values: Mapping[str, float]
    ) -> Interval | None:
        """Where a number that follows from quantities, of given values, lies of the part: each group of assumptions
        moves all of them at once, and groups add in squares. None where one has no evidence."""
        if self._why(asked) not in (None, EXACT) or any(own.text not in values for own in asked):
            return None
        moved = {own.text: self.moved(own) for own in asked}
        if len(moved) == 1:
            [(text, own)] = moved.items()
            half = float(np.sqrt(sum(part**2 for part in own.spread.values())))
            moved = {text: Moved(own.power, "", own.middle, {"": half})}

        def at(sign: float, group: str = "") -> float:
            return float(evaluate({text: values[text] * own.by(sign, group) for text, own in moved.items()}))

        groups = dict.fromkeys(group for own in moved.values() for group in own.spread)
        middle, ends = at(0.0), [(at(-1.0, group), at(1.0, group)) for group in groups]
        if len(ends) == 1:
            return min(middle, *ends[0]), max(middle, *ends[0])
        half = float(np.sqrt(sum((high - low) ** 2 for low, high in ends))) / 2
        return middle - half, middle + half

    def moved(self, asked: Quantity) -> Moved:
        """What assumptions do to one of the quantities."""
        if asked.kind in ("mass", "parameter"):
            return Moved(0.0, EXACT)
        if asked.kind in WORKED_OUT:
            return self._groups[asked.pose, WORKED_OUT[asked.kind]][asked.text]
        [what] = (what for what, kinds in NO_EVIDENCE.items() if asked.kind in kinds)
        return Moved(0.0, f"no evidence for {what}")

    @cached_property
    def _groups(self) -> dict[tuple[Pose, Worker], dict[str, Moved]]:
        """What assumptions do to quantities, by the pose that they are asked at and how that is worked out."""
        every = dict.fromkeys((*self.quantities, *(own for one in self.formulas for own in one.quantities)))
        single, kept = OneDesign(self.plan, self.parameters, tuple(every)), dict[tuple[Pose, Worker], list[Quantity]]()
        for own in every:
            if own.kind in WORKED_OUT:
                kept.setdefault((own.pose, WORKED_OUT[own.kind]), []).append(own)
        found: dict[tuple[Pose, Worker], dict[str, Moved]] = {}
        for (pose, work), asked in kept.items():
            try:
                found[pose, work] = work(single, asked)
            except FAILURES as error:
                found[pose, work] = {own.text: Moved(0.0, reason_of(error)) for own in asked}
        return found


class OfThePart:
    """A result with model errors of what is asked, at one design."""

    margins: Margins | None

    @property
    def model_error(self) -> dict[str, Interval | None]:
        """By question, where the part's value lies: between 1 + low and 1 + high times that of the nominal design, or
        of the optimum; None where there is no evidence."""
        return self.margins.intervals if self.margins is not None else {}

    @property
    def model_error_reason(self) -> dict[str, str]:
        """Why questions have no model error."""
        return self.margins.reasons if self.margins is not None else {}


def _frequencies(single: OneDesign, asked: Sequence[Quantity]) -> dict[str, Moved]:
    model = single.state(asked[0]).free.model
    numbers = {own.text: single.mode(own)[0] for own in asked}
    errors, _ = model_errors_of_modes(model, min(max(FEWEST, 1 + max(numbers.values())), model.order))
    return {text: _moved(errors, k, -0.5) for text, k in numbers.items()}


def _statics(single: OneDesign, asked: Sequence[Quantity]) -> dict[str, Moved]:
    state, found = single.state(asked[0]), dict[str, Moved]()
    if isinstance(state, PosedState):
        held = [own for own in asked if own.kind in ("compliance", "stiffness")]
        found = {own.text: Moved(0.0, "not worked out where a pose holds displacements") for own in held}
        asked, state = [own for own in asked if own not in held], state.free
    kinds = np.array([own.kind for own in asked])

    def read(moved: Array, at_force: Array) -> Array:
        return np.select([kinds == "stiffness", kinds == "amplification"], [1 / moved, moved / at_force], moved)

    errors = state.model_errors([ends_of(own) for own in asked], read) if asked else None
    return found | {own.text: _moved(errors, k, 1.0) for k, own in enumerate(asked) if errors is not None}


def _stresses(single: OneDesign, asked: Sequence[Quantity]) -> dict[str, Moved]:
    state = single.state(asked[0])
    ends = None if isinstance(state, PosedState) else state.stress_error
    if ends is None:
        return {own.text: Moved(0.0, "no evidence for this stress") for own in asked}
    half = (ends[1] - ends[0]) / 2
    powers = {own.text: -1.0 if own.kind == "margin" else 1.0 for own in asked}
    return {text: Moved(power, "", sum(ends) / 2, {"stress": half}) for text, power in powers.items()}


def _moved(errors: ModelError, k: int, power: float) -> Moved:
    """What a number that model errors are of is moved by."""
    if errors.intervals[k] is None:
        return Moved(0.0, errors.reason[k] or "it is zero, or not known")
    spread = {group or f"{power} {k}": float(own[k]) for group, own in errors.spread.items()}
    return Moved(power, "", float(errors.middle[k]), spread)


WORKED_OUT: dict[str, Worker] = {
    FREQUENCY: _frequencies,
    **dict.fromkeys(STATIC, _statics),
    **dict.fromkeys(("stress", "margin"), _stresses),
}
"""How model errors of a kind are worked out."""
