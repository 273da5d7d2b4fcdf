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
from flexura.study.questions.formulas import Formula, Relation
from flexura.study.questions.kinds import FREQUENCY, WORST, Pose, Quantity, Worst
from flexura.study.questions.reading import Freedom, Port
from flexura.study.questions.single import OneDesign
from flexura.study.questions.states import PosedState, ReferenceState

Interval = tuple[float, float]
Worker = Callable[[OneDesign, Sequence[Quantity]], "dict[str, Moved]"]

EXACT = "exact for the description"

LEAST_FACTOR = 1e-3
"""What is left of a number at least."""

FEWEST_MODES = 6
"""Modes that are looked at at least, as `modes` has them."""

NO_EVIDENCE = {
    "drift": "drift by temperatures",
    "reach": "a stroke until something yields",
    "parasitic": "a parasitic motion",
    "centre_shift": "a centre shift",
    "force": "a force that holds a pose",
    "buckling": "a buckling factor",
    "frf": "a frequency response",
    "frf_peak": "a frequency response",
    "rms": "a root mean square",
}
"""Kinds that there is no evidence for."""


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
        return max(1 + self.middle + sign * self.spread.get(group, 0.0), LEAST_FACTOR) ** self.power


@dataclass(frozen=True, repr=False)
class Margins(Record):
    """Model errors of what is asked of one design, `where` that is, and of formulas of it with the `values` (SI, by
    text) of what is in them; `required` of it are relations by name. Worked out when first asked for: as long as modes
    take."""

    _shown = ("where",)

    plan: Plan
    parameters: Mapping[str, float]
    quantities: Sequence[Quantity]
    where: str = "nominal design"
    formulas: Sequence[Formula] = ()
    values: Mapping[str, float] | None = None
    required: Mapping[str, Relation] = field(default_factory=dict)

    @cached_property
    def intervals(self) -> dict[str, Interval | None]:
        """By question, where the part's value lies: between 1 + low and 1 + high times the one given; None where there
        is no evidence."""
        return {text: interval if isinstance(interval, tuple) else None for text, interval in self._errors.items()}

    @property
    def reasons(self) -> dict[str, str]:
        """Why questions have no model error."""
        return {text: why for text, why in self._errors.items() if isinstance(why, str)}

    @property
    def texts(self) -> dict[str, str]:
        """In words, by question."""
        return {text: error if isinstance(error, str) else interval_text(error) for text, error in self._errors.items()}

    @property
    def lines(self) -> list[str]:
        """A line for each question."""
        texts = self.texts.items()
        known = [f"{name}: model error {text} ({self.where})" for name, text in texts if name not in self.reasons]
        return [*known, *(f"{name}: no model error, {why}" for name, why in self.reasons.items())]

    @cached_property
    def _errors(self) -> dict[str, Interval | str]:
        errors = {own.text: self._relative(lambda v, text=own.text: v[text], [own], {}) for own in self.quantities}
        for formula in self.formulas:
            errors[formula.text] = self._relative(formula.evaluate, formula.quantities, self.values or {})
        return errors

    def _relative(
        self, evaluate: Callable[..., float], asked: Sequence[Quantity], values: Mapping[str, float]
    ) -> Interval | str:
        given = {quantity.text: values.get(quantity.text, 1.0) for quantity in asked}
        if (why := self._why(asked)) is not None:
            return why
        whole, ends = float(evaluate(given)), self.span(evaluate, asked, given)
        if not whole or ends is None or not np.isfinite([*ends, whole]).all():
            return "it is zero, or not known"
        low, high = sorted(end / whole - 1 for end in ends)
        return low, high

    def _why(self, asked: Sequence[Quantity]) -> str | None:
        """Why there is no model error of what follows from quantities; None where there is."""
        moved = [self.moved(quantity) for quantity in asked]
        for own in moved:
            if not own.is_known:
                return own.reason
        return EXACT if all(own.reason == EXACT for own in moved) else None

    def span(
        self, evaluate: Callable[..., float], asked: Sequence[Quantity], values: Mapping[str, float]
    ) -> Interval | None:
        """Where a number that follows from quantities, of given values, lies of the part: each group of assumptions
        moves all of them at once, and groups add in squares. None where one has no evidence."""
        if self._why(asked) not in (None, EXACT) or any(quantity.text not in values for quantity in asked):
            return None
        shifts = {quantity.text: self.moved(quantity) for quantity in asked}
        if len(shifts) == 1:
            [(text, shift)] = shifts.items()
            half = float(np.sqrt(sum(part**2 for part in shift.spread.values())))
            shifts = {text: Moved(shift.power, "", shift.middle, {"": half})}

        def at(sign: float, group: str = "") -> float:
            return float(evaluate({text: values[text] * shift.by(sign, group) for text, shift in shifts.items()}))

        groups = dict.fromkeys(group for shift in shifts.values() for group in shift.spread)
        middle, ends = at(0.0), [(at(-1.0, group), at(1.0, group)) for group in groups]
        if len(ends) == 1:
            return min(middle, *ends[0]), max(middle, *ends[0])
        half = float(np.sqrt(sum((high - low) ** 2 for low, high in ends))) / 2
        return middle - half, middle + half

    def moved(self, asked: Quantity) -> Moved:
        """What assumptions do to one of the quantities."""
        if asked.kind in ("mass", "parameter"):
            return Moved(0.0, EXACT)
        if asked.kind == WORST:
            return self._worst(asked)
        if asked.kind in WORKED_OUT:
            return self._groups[asked.pose, WORKED_OUT[asked.kind]][asked.text]
        return Moved(0.0, f"no evidence for {NO_EVIDENCE[asked.kind]}")

    def _worst(self, asked: Quantity) -> Moved:
        """The same of the worst of a stroke: that of what is asked at its worst pose."""
        [of] = asked.arguments
        assert isinstance(of, Worst)
        try:
            worst = OneDesign(self.plan, self.parameters, (asked,)).worst(asked)
        except FAILURES as error:
            return Moved(0.0, reason_of(error))
        there = Margins(self.plan, self.parameters, worst.quantities)
        if len(worst.quantities) == 1 and worst.value == worst.numbers[0]:
            return there.moved(worst.quantities[0])
        names = {own.text: template.text for own, template in zip(worst.quantities, of.quantities, strict=True)}
        values = dict(zip(names, worst.numbers, strict=True))
        ends = there.span(
            lambda given: of.evaluate({names[text]: value for text, value in given.items()}), worst.quantities, values
        )
        if ends is None or not worst.value:
            return Moved(0.0, there._why(worst.quantities) or "it is zero, or not known")
        low, high = (end / worst.value - 1 for end in ends)
        return Moved(1.0, "", (low + high) / 2, {"": abs(high - low) / 2})

    @cached_property
    def _groups(self) -> dict[tuple[Pose, Worker], dict[str, Moved]]:
        """What assumptions do to quantities, by the pose that they are asked at and how that is worked out."""
        of_formulas = (quantity for formula in self.formulas for quantity in formula.quantities)
        every = tuple(dict.fromkeys((*self.quantities, *of_formulas)))
        single, groups = OneDesign(self.plan, self.parameters, every), dict[tuple[Pose, Worker], list[Quantity]]()
        for quantity in every:
            if quantity.kind in WORKED_OUT:
                groups.setdefault((quantity.pose, WORKED_OUT[quantity.kind]), []).append(quantity)
        moved: dict[tuple[Pose, Worker], dict[str, Moved]] = {}
        for (pose, work), quantities in groups.items():
            try:
                moved[pose, work] = work(single, quantities)
            except FAILURES as error:
                moved[pose, work] = {quantity.text: Moved(0.0, reason_of(error)) for quantity in quantities}
        return moved


def _frequencies(single: OneDesign, asked: Sequence[Quantity]) -> dict[str, Moved]:
    model = single.state(asked[0]).free.model
    numbers = {quantity.text: single.mode(quantity)[0] for quantity in asked}
    errors, _ = model_errors_of_modes(model, min(max(FEWEST_MODES, 1 + max(numbers.values())), model.order))
    return {text: _moved(errors, k, -0.5) for text, k in numbers.items()}


def _statics(single: OneDesign, asked: Sequence[Quantity]) -> dict[str, Moved]:
    state, held = single.state(asked[0]), list[Quantity]()
    if isinstance(state, PosedState):
        held = [quantity for quantity in asked if quantity.kind in ("compliance", "stiffness")]
        asked = [quantity for quantity in asked if quantity not in held]
    moved = {quantity.text: Moved(0.0, "not worked out where a pose holds displacements") for quantity in held}
    if not asked:
        return moved
    kinds = np.array([quantity.kind for quantity in asked])

    def read(moved: Array, at_force: Array) -> Array:
        return np.select([kinds == "stiffness", kinds == "amplification"], [1 / moved, moved / at_force], moved)

    errors = state.free.model_errors([ends_of(quantity) for quantity in asked], read)
    return moved | {quantity.text: _moved(errors, k, 1.0) for k, quantity in enumerate(asked)}


def _shifts(single: OneDesign, asked: Sequence[Quantity]) -> dict[str, Moved]:
    """Displacements by forces and commands: linear about where these have moved it."""
    state, pose = single.state(asked[0]), asked[0].pose
    if not pose or any(own.kind == "move" for own in pose) or single.plan.is_loaded:
        why = "no evidence for a displacement that is prescribed, or by loads that are described"
        return {quantity.text: Moved(0.0, why) for quantity in asked}
    by: list[Freedom | Port] = [
        Freedom(*own.pushed) if own.kind == "force" else Port(own.name, own.name) for own in pose
    ]
    gains = [state.free.input(end.known).gain if isinstance(end, Port) else 1.0 for end in by]
    size = np.array([own.value for own in pose]) * gains
    to = [end for quantity in asked for end in quantity.arguments if isinstance(end, Freedom)]

    def read(moved: Array, _: Array) -> Array:
        return np.nan_to_num(moved).reshape(len(to), -1) @ size

    errors = state.free.model_errors([(end, push) for end in to for push in by], read)
    return {quantity.text: _moved(errors, k, 1.0) for k, quantity in enumerate(asked)}


def _stresses(single: OneDesign, asked: Sequence[Quantity]) -> dict[str, Moved]:
    state = None if asked[0].pose else single.state(asked[0])
    ends = state.stress_error if isinstance(state, ReferenceState) else None
    if ends is None:
        return {quantity.text: Moved(0.0, "no evidence for this stress") for quantity in asked}
    middle, half = sum(ends) / 2, (ends[1] - ends[0]) / 2
    powers = {quantity.text: -1.0 if quantity.kind == "margin" else 1.0 for quantity in asked}
    return {text: Moved(power, "", middle, {"stress": half}) for text, power in powers.items()}


def _moved(errors: ModelError, k: int, power: float) -> Moved:
    """What a number that model errors are of is moved by."""
    if errors.intervals[k] is None:
        return Moved(0.0, errors.reason[k] or "it is zero, or not known")
    spread = {group or f"{power} {k}": float(parts[k]) for group, parts in errors.spread.items()}
    return Moved(power, "", float(errors.middle[k]), spread)


WORKED_OUT: dict[str, Worker] = {
    FREQUENCY: _frequencies,
    **dict.fromkeys(STATIC, _statics),
    **dict.fromkeys(("stress", "margin"), _stresses),
    "shift": _shifts,
}
"""How model errors of a kind are worked out."""
