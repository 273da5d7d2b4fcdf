"""From what a search found to results in the user's words, each quantity worked out anew."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flexura.analysis import Modes, Stroke, modes, stroke
from flexura.arrays import Array
from flexura.errors import Diagnostic, FlexuraError
from flexura.mechanism import Mechanism
from flexura.structure import Plan, plan_of
from flexura.study.optimum.climb import FEASIBLE, RISE, STATIONARY, Climb, Method, Solved
from flexura.study.optimum.discrete import Chosen, Mixed
from flexura.study.optimum.front import Front
from flexura.study.optimum.landscape import ACTIVE, Landscape
from flexura.study.optimum.results import (
    ActiveLimit,
    Optimum,
    OptimumStart,
    OptimumVariable,
    Pareto,
    Proof,
    Violation,
)
from flexura.study.optimum.rows import numbered
from flexura.study.optimum.task import Task
from flexura.study.questions import Margins, Quantity, Relation, questions
from flexura.tables import counted, quantity

DIFFERS = 1e-3
"""Relative difference between the search and what is worked out anew from which on it is a warning."""


@dataclass
class Anew:
    """A mechanism whose parameters are those of a design, and what the verbs say of it; `warnings` are theirs."""

    mechanism: Mechanism
    quantities: Sequence[Quantity]
    warnings: list[Diagnostic] = field(default_factory=list)
    _strokes: dict[tuple[tuple[str, float], ...], Stroke] = field(default_factory=dict)

    @cached_property
    def plan(self) -> Plan:
        """Its plan, in which the ends that corrections hold clamped are those of this design."""
        return plan_of(self.mechanism)

    @cached_property
    def modes(self) -> Modes:
        """Its modes, as many as are asked for, with proven intervals."""
        found = modes(self.plan, n=max(numbered(own) or 1 for own in self.quantities))
        self.warnings += found.warnings
        return found

    def stroke(self, own: Quantity) -> Stroke:
        """Its pose that a quantity is asked at, reached from rest."""
        if own.pose not in self._strokes:
            move = dict(own.pose)
            asked = [numbered(q) or 1 for q in self.quantities if q.pose == own.pose]
            found = stroke(self.plan, move=move, steps=2, n=max(asked))
            self._strokes[own.pose] = found
            self.warnings += found.warnings
        return self._strokes[own.pose]

    def checked(self, own: Quantity, value: float) -> Proof:
        """A quantity worked out anew by the verb that has it, or else by the mechanism with these values."""
        number = numbered(own)
        if number is not None and not own.pose:
            mode = self.modes.modes[number - 1]
            low, high = mode.interval_hz
            hz = mode.frequency_hz if mode.full_frequency_hz is None else mode.full_frequency_hz
            interval = (low, high) if mode.is_indexed and low is not None and high is not None else None
            return Proof(own.text, own.unit, value, float(hz), "modes", interval)
        if own.pose and (number is not None or own.kind == "stress"):
            found = self.stroke(own)
            if number is not None:
                pose = found.poses[-1]
                interval = pose.frequency_interval_hz[number - 1] if pose.proven else None
                return Proof(own.text, own.unit, value, pose.frequency_hz[number - 1], "stroke", interval)
            members = found.stresses(len(found.poses) - 1).members
            asked = getattr(own.arguments[0], "members", ()) if own.arguments else [m.name for m in members]
            stresses = [m.von_mises for m in members if m.von_mises is not None and m.name in asked]
            if stresses:
                return Proof(own.text, own.unit, value, max(stresses), "stroke")
        answer = questions(self.plan, own.text).values({})
        return Proof(own.text, own.unit, value, float(answer.value[0, 0]), "a plan of its own")


def proof(
    mechanism: Mechanism, values: Mapping[str, float], quantities: Sequence[Quantity], found: Mapping[str, float]
) -> tuple[tuple[Proof, ...], list[Diagnostic]]:
    """Every quantity of a design anew beside the value that was `found`, and warnings: those of the verbs, what differs
    by more than `DIFFERS` and is not within its interval, and what could not be worked out."""
    parameters = dict(mechanism.parameters)
    for name, value in values.items():
        parameters[name] = parameters[name].model_copy(update={"value": value})
    anew = Anew(mechanism.model_copy(update={"parameters": parameters}), quantities)
    proofs, missing = [], []
    for own in quantities:
        try:
            proofs.append(anew.checked(own, found[own.text]))
        except FlexuraError as error:
            text = f"{own.text} could not be worked out anew at the optimum: {error}"
            missing.append(Diagnostic("proof", own.text, float("nan"), DIFFERS, "1", text))
    for own in proofs:
        low, high = own.interval or (own.checked, own.checked)
        if own.difference > DIFFERS and not low <= own.value <= high:
            text = (
                f"{own.text} is {own.checked:.6g} {own.unit} by {own.by} and was {own.value:.6g} in the search:"
                " the optimum is that of the search, which differs"
            )
            missing.append(Diagnostic("proof", own.text, own.difference, DIFFERS, "1", text))
    return tuple(proofs), [*missing, *anew.warnings]


DESIGNS = 4
"""Designs at which a goal is looked at, at least."""

SAME = 1e-12
"""Relative difference of goals that are the same."""


def goal_doubts(task: Task, known: Array) -> Iterator[Diagnostic]:
    """Goals that contradict each other, and such as are the same whatever varies; quantities (N, q) of some designs are
    `known`."""
    for k, aim in enumerate(task.aims):
        if any(own.formula.text == aim.formula.text and own.sign != aim.sign for own in task.aims[:k]):
            text = (
                f"{aim.formula.text} is to be both large and small: of these goals every design is as good as another"
            )
            yield Diagnostic("goal", aim.formula.text, float("nan"), 0.0, "1", text)
    quantities = known if len(known) >= DESIGNS else task.designs.values(task.starts(DESIGNS, seed=0))[0]
    for aim in task.aims:
        values = np.asarray(task.wording.combined(aim.formula).value(quantities))
        known = values[np.isfinite(values)]
        if len(known) > 1 and np.ptp(known) <= SAME * np.abs(known).max():
            varied = ", ".join(task.names)
            text = f"{aim.text}: the same in all {len(known)} designs looked at, whatever {varied} may be"
            yield Diagnostic("goal", aim.text, float(np.ptp(known)), SAME, "1", text)


DIGITS = 9
"""Significant digits of the values of an optimum, which are those that it is proven with."""

NOWHERE = "none of this proves that no design meets the limits"
LOCAL = "each search leads to an optimum nearby; none of this proves that no better one is elsewhere"


def optimum_of(task: Task, mixed: Mixed, chosen: Chosen, method: Method, seed: int) -> Optimum:
    """The best design that was found as a result, worked out anew at full order."""
    aim, words = task.aims[0], task.wording
    x = _rounded(task, chosen.x)
    quantities = _quantities(task, chosen, x)
    value = float(words.combined(aim.formula).value(quantities))
    found = {own.text: float(quantities[words.place[own.text]]) for own in words.questions.quantities}
    missed = tuple(_violations(task, mixed.land, quantities))
    asked = [own for own in words.questions.quantities if own.text in _named(task)]
    values = {**task.fixed, **dict(zip(task.names, map(float, x), strict=True))}
    proofs, warnings = proof(task.plan.mechanism, values, asked, found)
    active = tuple(_active(task, chosen, quantities)) if chosen.solved is not None and not missed else ()
    solved = chosen.solved
    warnings = [*goal_doubts(task, mixed.known), *_doubts(solved, missed), *warnings]
    where = "nearest design" if missed else "optimum"
    margins = Margins(task.plan, values, asked, where, [aim.formula], found)
    return Optimum(
        task.plan.mechanism.name,
        aim.text,
        aim.formula.unit,
        tuple(limit.text for limit in task.limits),
        value,
        tuple(_variables(task, x)),
        active,
        {own.text: own.multiplier for own in active},
        proofs,
        float("nan") if solved is None or missed else solved.stationarity.residual,
        tuple(_starts(task, chosen)),
        missed,
        method,
        seed,
        mixed.land.evaluations,
        mixed.land.tried,
        dict(mixed.land.failures),
        task.plan.mechanism,
        task.fixed,
        (*_notes(task, mixed, chosen, bool(missed)), *_straddled(task, margins, found)),
        tuple(warnings),
        margins,
    )


def _straddled(task: Task, margins: Margins, found: Mapping[str, float]) -> Iterator[str]:
    """Limits that the design meets, and that the part may not for all that is known."""
    for limit in task.limits:
        ends = margins.span(limit.evaluate, limit.quantities, found)
        if ends is not None and ends[0] < -10 * FEASIBLE < float(limit.evaluate(found)):
            of = ", ".join(f"{own.text} {margins.texts[own.text]}" for own in limit.quantities)
            yield f"{limit.text} is met by the description, and the part may miss it: model error of {of}"


def _quantities(task: Task, chosen: Chosen, x: Array) -> Array:
    """Quantities of what was chosen, whose values are told as x (P,): by slopes, of which the last digits need no more,
    or worked out where nothing has slopes."""
    if chosen.solved is None:
        return _worked_out(task, x)
    best, box = chosen.solved.best, chosen.land.box
    moved = x[[task.names.index(name) for name in box.names]] - box.values(best.z)
    return (best.point.value + best.point.slope @ moved)[: len(task.wording.place)]


def _worked_out(task: Task, x: Array) -> Array:
    """Quantities of a design, as the search has them with slopes, or without where some have none."""
    try:
        return task.designs.point(x).value[: len(task.wording.place)]
    except FlexuraError:
        return task.designs.values(x[None])[0][0]


def _named(task: Task) -> set[str]:
    """Quantities that the goal and the limits name, without those beside them."""
    formulas = [task.aims[0].formula, *(side for own in task.limits for side in (own.left, own.right))]
    return {own.text for formula in formulas for own in formula.quantities}


def _rounded(task: Task, x: Array) -> Array:
    """Values with as many digits as are told, within the bounds."""
    rounded = np.array([float(f"{own:.{DIGITS}g}") for own in x])
    return np.clip(rounded, task.box.low, task.box.high)


def _violations(task: Task, land: Landscape, quantities: Array) -> Iterator[Violation]:
    for limit, row in zip(task.limits, land.limits, strict=True):
        if (by := -float(row.values(quantities))) > 10 * FEASIBLE:
            yield Violation(limit.text, by * row.scale, limit.left.unit)


def _variables(task: Task, x: Array) -> Iterator[OptimumVariable]:
    z = task.box.positions(x)
    for k, own in enumerate(task.variables):
        at = "" if own.kind != "continuous" else "low" if z[k] <= ACTIVE else "high" if z[k] >= 1 - ACTIVE else ""
        levels = tuple(np.unique(own.values).tolist()) if own.kind == "choice" else ()
        ends = float(task.before[k]), float(x[k]), float(own.low), float(own.high)
        yield OptimumVariable(own.name, own.unit, own.kind, *ends, at, levels)


def _active(task: Task, chosen: Chosen, quantities: Array) -> Iterator[ActiveLimit]:
    """Limits and bounds that hold the design, with multipliers in the units of the user."""
    assert chosen.solved is not None
    aim, land, found = task.aims[0], chosen.land, chosen.solved.stationarity
    goal = aim.formula.text, aim.formula.unit
    for k in found.active:
        limit, row = task.limits[k], land.limits[k]
        multiplier = float(found.limits[k]) * land.goal.scale / row.scale
        constant, upwards = _constant(task, limit, quantities)
        left = float(task.wording.combined(limit.left).value(quantities))
        gain = 0.01 * multiplier * abs(constant)
        yield ActiveLimit(
            limit.text, left, limit.left.unit, multiplier, gain, *goal, False, upwards, falls=aim.sign < 0
        )
    rates = land.box.rates(chosen.solved.best.z)
    units = {own.name: own.unit for own in task.variables}
    for k, name in enumerate(land.box.names):
        for upwards, weight, end in ((False, found.low[k], land.box.low[k]), (True, found.high[k], land.box.high[k])):
            if weight > 0:
                multiplier = float(weight * land.goal.scale / rates[k])
                text = f"{name} {'<=' if upwards else '>='} {quantity(float(end), units[name])}"
                gain = 0.01 * multiplier * abs(float(end))
                yield ActiveLimit(
                    text, float(end), units[name], multiplier, gain, *goal, True, upwards, falls=aim.sign < 0
                )


def _constant(task: Task, limit: Relation, quantities: Array) -> tuple[float, bool]:
    """The side of a limit that is a number, 0 where neither is, and whether the limit gives way as it grows."""
    for side, grows in ((limit.right, limit.sense > 0), (limit.left, limit.sense < 0)):
        if side.is_constant:
            return float(task.wording.combined(side).value(quantities)), grows
    return 0.0, limit.sense > 0


def _starts(task: Task, chosen: Chosen) -> Iterator[OptimumStart]:
    solved, land = chosen.solved, chosen.land
    for number, own in enumerate(() if solved is None else solved.climbs):
        assert solved is not None
        box = land.box
        end = own.best
        value = task.aims[0].sign * end.goal * land.goal.scale if end is not None else float("nan")
        yield OptimumStart(
            number,
            dict(zip(box.names, box.values(own.start).tolist(), strict=True)),
            {} if end is None else dict(zip(box.names, box.values(end.z).tolist(), strict=True)),
            value,
            float("nan") if end is None else end.violation,
            own.evaluations,
            solved.agrees(own) and solved.is_here(own),
            own.said,
        )


def _doubts(solved: Solved | None, missed: tuple[Violation, ...]) -> Iterator[Diagnostic]:
    if missed:
        text = f"no design was found that meets the limits; in the nearest one {'; '.join(map(str, missed))}"
        yield Diagnostic("limit", missed[0].text, missed[0].by, 0.0, missed[0].unit, text)
        return
    if solved is None:
        return
    residual = solved.stationarity.residual
    if residual > STATIONARY:
        text = f"the conditions of an optimum are missed by {residual:.2g} of the gradient: the search stopped short"
        beside = [own for own in solved.climbs if own.best is solved.best and own.said.startswith("designs")]
        text += f"; {beside[0].said}" if beside else ""
        yield Diagnostic("convergence", "", residual, STATIONARY, "1", text)
    if solved.curvature > RISE:
        text = "the design is stationary, but the goal curves upwards along what limits leave free: it is no optimum"
        yield Diagnostic("convergence", "", solved.curvature, RISE, "1", text)


def _notes(task: Task, mixed: Mixed, chosen: Chosen, is_missed: bool) -> Iterator[str]:
    solved, land = chosen.solved, mixed.land
    if chosen.said:
        yield chosen.said if chosen.is_every else f"{chosen.said}; one that is further away may be better"
    if solved is not None:
        yield _agreement(task, chosen, solved, is_missed)
        if solved.passed:
            others = f"{counted(solved.passed, 'start')} of {solved.passed + len(solved.climbs)}"
            yield f"{others} had a better design beside them, and were not searched from"
        yield NOWHERE if is_missed else LOCAL
        if differenced := solved.best.point.differenced:
            texts = [task.wording.questions.quantities[k].text for k in differenced]
            yield f"slopes of {', '.join(texts)} are differences of high order, not exact"
        if solved.stationarity.coalesced:
            alike = "parts of the goal" if land.goal.parts or land.goal.worsts else "frequencies"
            yield f"{alike} coincide at the optimum: they are bounded together, and multipliers are of that bound"
    formulas = [*(aim.formula for aim in task.aims), *(side for own in task.limits for side in (own.left, own.right))]
    yield from dict.fromkeys(note for own in formulas for note in own.questions.notes)
    outside = (task.before < task.box.low) | (task.before > task.box.high)
    if outside.any():
        names = ", ".join(name for name, own in zip(task.names, outside, strict=True) if own)
        yield f"before, {names} lay outside the range: the first start is at its end"
    if land.failures:
        reason, count = land.failures.most_common(1)[0]
        yield f"{counted(land.failures.total(), 'design')} had no answer, {count} of them because: {reason}"


def _agreement(task: Task, chosen: Chosen, solved: Solved, is_missed: bool) -> str:
    """Which starts led to the optimum, and what the others found."""
    climbs = solved.climbs
    searches = "1 search" if len(climbs) == 1 else f"{len(climbs)} searches"
    if is_missed:
        return f"none of {searches} led to a design that meets the limits"
    here = [own for own in climbs if solved.agrees(own) and solved.is_here(own)]
    text = f"{len(here)} of {searches} led to this design"
    equal = [own for own in climbs if solved.agrees(own) and not solved.is_here(own)]
    if equal:
        text += f", {len(equal)} to other designs that are as good"
    worse = [own for own in climbs if own.is_feasible and not solved.agrees(own)]
    if worse:
        scale = task.aims[0].sign * chosen.land.goal.scale
        text += f", {len(worse)} to worse ones, the best of them {_best(worse, scale, task.aims[0].formula.unit)}"
    if lost := len(climbs) - len(here) - len(equal) - len(worse):
        text += f"; {lost} met no limits or had no answer"
    return text


def _best(climbs: list[Climb], scale: float, unit: str) -> str:
    goals = [own.best.goal for own in climbs if own.best is not None]
    return quantity(scale * max(goals), unit) or f"{scale * max(goals):.5g}"


def pareto_of(task: Task, mixed: Mixed, found: Front, seed: int) -> Pareto:
    """A front as a result."""
    land = mixed.land
    formulas = [aim.formula for aim in task.aims]
    designs = np.array([_rounded(task, own) for own in found.designs]).reshape(-1, len(task.names))
    quantities = np.array([_worked_out(task, own) for own in designs]).reshape(len(designs), -1)
    values = np.empty((len(designs), len(formulas)))
    for k, own in enumerate(formulas if len(designs) else ()):
        values[:, k] = task.wording.combined(own).value(quantities)
    warnings = list(goal_doubts(task, mixed.known))
    if not len(designs):
        text = "no design was found that meets the limits: there is no front"
        warnings.append(Diagnostic("limit", "", float("nan"), 0.0, "1", text))
    margins = None
    if len(designs):
        k = len(designs) // 2
        at = {**task.fixed, **dict(zip(task.names, designs[k].tolist(), strict=True))}
        found_there = dict(
            zip((own.text for own in task.wording.questions.quantities), quantities[k].tolist(), strict=True)
        )
        margins = Margins(task.plan, at, (), f"design {k}", formulas, found_there)
    notes = [
        "NSGA-II found the front, and each design was made the best in one goal without loss in the others;"
        " none of this proves that no better one is elsewhere"
    ]
    if land.failures:
        reason, count = land.failures.most_common(1)[0]
        notes.append(f"{counted(land.failures.total(), 'design')} had no answer, {count} of them because: {reason}")
    return Pareto(
        task.plan.mechanism.name,
        tuple(aim.text for aim in task.aims),
        tuple(own.unit for own in formulas),
        task.names,
        tuple(own.unit for own in task.variables),
        designs,
        values,
        found.residual,
        seed,
        land.evaluations,
        land.tried,
        dict(land.failures),
        task.plan.mechanism,
        task.fixed,
        tuple(notes),
        tuple(warnings),
        margins,
    )
