"""What a mechanism is asked to do, as its description lists it: met, missed, or not known."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from flexura.analysis import interval_text
from flexura.arguments import verb
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism
from flexura.records import Record
from flexura.results import Tabular
from flexura.structure import Plan, one_design
from flexura.study.questions import (
    Answers,
    Margins,
    Pose,
    Quantity,
    Questions,
    Relation,
    limits_at,
    pose_text,
    poses_of,
    relation,
    worst_pose,
)
from flexura.tables import Item, Line, Table, counted, quantity

Verdict = Literal["met", "missed", "not known"]


@dataclass(frozen=True, repr=False)
class Requirement(Record):
    """One requirement: its `value` beside the `limit`, SI, in `unit`.

    The `verdict` is `met` or `missed` where the number of the description and those of the part, as far as its model
    error is known, all say so, and `not known` where these lie on both sides of the limit, or there is no number, for
    the `reason`. `least_margin` is how far it is met over the size of its limit, wherever in its model error the part
    is, negative where it may be missed. `interval` is proven to hold the value, None where nothing is proven; the
    part's value lies between 1 + low and 1 + high of `model_error` times it, None for the `model_error_reason`. Of what
    is asked over a stroke `where` is the worst of so many `poses`, and `unsettled` by how much, SI, one between might
    be worse.
    """

    _shown = ("name", "text", "verdict")

    name: str
    text: str
    verdict: Verdict
    value: float
    limit: float
    unit: str
    least_margin: float
    interval: tuple[float, float] | None
    model_error: tuple[float, float] | None
    model_error_reason: str
    where: str
    poses: int
    unsettled: float
    reason: str

    @property
    def state(self) -> str:
        """Its value in words, with where it is worst."""
        return f"{quantity(self.value, self.unit)} {self.worst}".strip() if np.isfinite(self.value) else "not known"

    @property
    def why(self) -> str:
        """What there is beside the value: its model error, or why there is none, and why there is no number."""
        error = interval_text(self.model_error) if self.model_error else f"none: {self.model_error_reason}"
        return "; ".join(text for text in (f"model error {error}", self.reason) if text)

    @property
    def worst(self) -> str:
        """Where it is worst, in words; empty where it is asked in one state."""
        unsettled = f", to within {quantity(self.unsettled, self.unit, 2)}" if self.unsettled else ""
        return f"{self.where}, of {counted(self.poses, 'pose')}{unsettled}" if self.where else ""


@dataclass(frozen=True, repr=False)
class Requirements(Tabular):
    """What a mechanism is asked to do, each with its verdict; a warning for each that is missed or not known. `limits`
    say what else is beyond its limit where it is asked: at poses, and of a stroke at its worst pose and both ends."""

    _shown = ("name", "requirements")
    _told = ("name", "requirements")

    name: str
    requirements: tuple[Requirement, ...]
    limits: tuple[Diagnostic, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """A warning for each requirement that is missed, or of which it is not known, and the limits."""
        missed = (
            Diagnostic("limit", own.name, own.value, own.limit, own.unit, _sentence(own))
            for own in self.requirements
            if own.verdict != "met"
        )
        return (*missed, *self.limits)

    @property
    def headline(self) -> str:
        """How many are met."""
        met = sum(own.verdict == "met" for own in self.requirements)
        return f"{self.name}: {met} of {counted(len(self.requirements), 'requirement')} met"

    def presentation(self) -> Iterator[Item]:
        own = self.requirements
        errors = [interval_text(r.model_error) if r.model_error else r.model_error_reason for r in own]
        yield Table(
            {
                "requirement": [f"{r.name}: {r.text}" for r in own],
                "is": [r.state for r in own],
                "model error": errors,
                "verdict": [r.verdict for r in own],
            },
            "requirements",
        )

    def _columns(self) -> dict[str, Any]:
        """A row for each requirement."""
        own = self.requirements
        return {
            "requirement": [r.name for r in own],
            "text": [r.text for r in own],
            "verdict": [r.verdict for r in own],
            "value [SI]": [r.value for r in own],
            "limit [SI]": [r.limit for r in own],
            "unit": [r.unit for r in own],
        }


def _sentence(own: Requirement) -> str:
    is_now = f"it is {quantity(own.value, own.unit)}" if np.isfinite(own.value) else own.reason
    part = f", and the part may be {interval_text(own.model_error)} off" if own.model_error else ""
    where = f" {own.worst}" if own.where else ""
    return f"{own.name} is {own.verdict}: {own.text}, and {is_now}{where}{part if own.verdict == 'not known' else ''}"


class OfThePart:
    """A result with model errors of what is asked, and verdicts on requirements, at one design."""

    margins: Margins | None

    @property
    def model_error(self) -> dict[str, tuple[float, float] | None]:
        """By question, where the part's value lies: between 1 + low and 1 + high times that of the nominal design, or
        of the optimum; None where there is no evidence."""
        return self.margins.intervals if self.margins is not None else {}

    @property
    def model_error_reason(self) -> dict[str, str]:
        """Why questions have no model error."""
        return self.margins.reasons if self.margins is not None else {}

    @cached_property
    def requirements(self) -> tuple[Requirement, ...]:
        """The requirements of the description at the same design; none where they are not wanted."""
        return _judged_at(self.margins) if self.margins is not None and self.margins.required else ()

    def margin_facts(self) -> Iterator[Item]:
        """A line for each quantity: how far the part may be from what is said of it."""
        yield from map(Line, self.margins.lines if self.margins is not None else ())


def described_relations(plan: Plan) -> dict[str, Relation]:
    """The requirements of a description as relations, by name. Raises OptionError for what cannot be asked and for
    requirements that contradict each other, with their names."""
    relations = dict[str, Relation]()
    for name, text in plan.mechanism.requirements.items():
        try:
            relations[name] = relation(plan, text)
        except OptionError as error:
            raise OptionError(f"requirements, {name!r}: {error}") from None
    bounds: dict[tuple[str, bool], tuple[float, str]] = {}
    for name, own in relations.items():
        limited, other, is_below = own.sides
        if not other.is_constant:
            continue
        limit = float(other.values({})[0])
        least, most = (bounds.get((limited.canonical, below)) for below in (False, True))
        against = least if is_below else most
        if against is not None and (limit < against[0] if is_below else limit > against[0]):
            raise OptionError(f"requirements, {against[1]!r} and {name!r} contradict each other: no design meets both")
        bounds[limited.canonical, is_below] = limit, name
    return relations


def others_of(described: Mapping[str, Relation], given: Sequence[Relation]) -> list[Relation]:
    """Requirements of a description that are not among those that are given beside it."""
    known = {own.canonical for own in given}
    return [own for own in described.values() if own.canonical not in known]


def with_required(asked: Questions, required: Iterable[Relation]) -> Questions:
    """What is asked, with what requirements need beside it, each once."""
    needed = (quantity for own in required for quantity in own.quantities)
    return Questions(asked.plan, tuple(dict.fromkeys((*asked.quantities, *needed))))


@verb
def requirements(model: Mechanism | Plan, parameters: Mapping[str, float] | None = None) -> Requirements:
    """What the description requires of the mechanism, met, missed or not known.

    What is asked in several states takes as long as the states, over a stroke as long as one stroke. Raises OptionError
    for what cannot be asked and requirements that contradict each other, and ModelError.
    """
    plan = plan_of(model, parameters)
    at, relations = one_design(parameters), described_relations(plan)
    found = _judged_at(Margins(plan, at, (), "this design", required=relations))
    notes = Questions(plan, _quantities_in(relations)).notes if relations else ()
    return Requirements(plan.mechanism.name, found, tuple(_limits(plan, at, relations)), notes)


def _quantities_in(relations: Mapping[str, Relation]) -> tuple[Quantity, ...]:
    return tuple(dict.fromkeys(own for each in relations.values() for own in each.quantities))


def _judged_at(of: Margins) -> tuple[Requirement, ...]:
    """What is required of a design, with verdicts."""
    asked = _quantities_in(of.required)
    answers = Questions(of.plan, asked).values(of.parameters) if asked else Answers.of(1, 0)
    known = {own.text: float(answers.value[0, k]) for k, own in enumerate(asked)}
    margins = replace(of, quantities=(), formulas=[own.sides[0] for own in of.required.values()], values=known)
    return tuple(_judged(name, own, asked, answers, known, margins) for name, own in of.required.items())


def _limits(plan: Plan, at: Mapping[str, float], relations: Mapping[str, Relation]) -> Iterator[Diagnostic]:
    """What is beyond its limit at the poses at which something is required, with the names of what is."""
    names: dict[Pose, list[str]] = {}
    for name, own in relations.items():
        for pose in dict.fromkeys(pose for asked in own.quantities for pose in poses_of(plan, at, asked)):
            names.setdefault(pose, []).append(name)
    for pose, asking in names.items():
        for limit in limits_at(plan, at, pose):
            yield replace(limit, text=f"{', '.join(asking)} {pose_text(pose)}: {limit.text}")


def _judged(
    name: str,
    own: Relation,
    asked_of: Sequence[Quantity],
    answers: Answers,
    known: Mapping[str, float],
    margins: Margins,
) -> Requirement:
    """A requirement with its verdict."""
    formula, other, _ = own.sides
    numbers = {asked.text: known[asked.text] for asked in own.quantities}
    value, limit, margin = (float(each.evaluate(numbers)) for each in (formula, other, own))
    low, high = margins.span(own.evaluate, own.quantities, numbers) or (margin, margin)
    low, high, unsettled, where, poses = min(low, margin), max(high, margin), 0.0, "", 0
    if formula.is_worst and np.isfinite(value):
        worst = worst_pose(margins.plan, margins.parameters, formula.quantities[0])
        unsettled, where, poses = worst.unsettled, worst.where, worst.count
        low -= unsettled / own.scale
    verdict: Verdict = "not known"
    if np.isfinite(margin):
        verdict = "met" if low >= 0 else "missed" if high < 0 else "not known"
    k = asked_of.index(formula.quantities[0]) if len(formula.quantities) == 1 else -1
    interval = None
    if k >= 0 and formula.canonical == formula.quantities[0].text and np.isfinite(answers.upper[0, k]):
        interval = float(answers.lower[0, k]), float(answers.upper[0, k])
    reasons = [text for text in str(answers.reason[0]).split("; ") if any(q.text in text for q in own.quantities)]
    return Requirement(
        name=name,
        text=own.text,
        verdict=verdict,
        value=value,
        limit=limit,
        unit=formula.unit,
        least_margin=low,
        interval=interval,
        model_error=margins.intervals[formula.text],
        model_error_reason=margins.reasons.get(formula.text, ""),
        where=where,
        poses=poses,
        unsettled=unsettled,
        reason="; ".join(reasons),
    )
