"""From what a search found to results in the user's words, each quantity worked out anew."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flexura.analysis import Modes, Stroke, modes, stroke
from flexura.arrays import Array
from flexura.errors import Diagnostic, FlexuraError
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism
from flexura.structure import Plan
from flexura.study.optimum.climb import (
    FEASIBLE_VIOLATION,
    NO_ANSWER_BEYOND,
    RISING_CURVATURE,
    STATIONARY,
    Method,
    Solved,
)
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
from flexura.study.optimum.task import Aim, Task
from flexura.study.questions import Margins, Pose, Quantity, Questions, Relation
from flexura.tables import counted, quantity
from flexura.thresholds import PROVEN, ROUND_OFF

FEWEST_DESIGNS = 4
"""Designs at which a goal is looked at, at least."""

MISSED = 10 * FEASIBLE_VIOLATION
"""Violation, over the scale of a limit, from which on it is reported as missed."""

OPTIMUM_DIGITS = 9
"""Significant digits of the values of an optimum, which are those that it is proven with."""

NOWHERE = "none of this proves that no design meets the limits"
LOCAL = "each search leads to an optimum nearby; none of this proves that no better one is elsewhere"
FRONT = (
    "NSGA-II found the front, and each design was made the best in one goal without loss in the others;"
    " none of this proves that no better one is elsewhere"
)


def optimum_of(task: Task, mixed: Mixed, chosen: Chosen, method: Method, seed: int) -> Optimum:
    """The best design that was found as a result, worked out anew at full order."""
    aim, wording, solved = task.aims[0], task.wording, chosen.solved
    x = _rounded(task, chosen.x)
    quantities = _quantities(task, chosen, x)
    numbers = {text: float(quantities[place]) for text, place in wording.places.items()}
    violations = tuple(_violations(task, mixed.land, quantities))
    named = {quantity for formula in task.formulas for quantity in formula.quantities}
    asked = [quantity for quantity in wording.questions.quantities if quantity in named]  # without those beside them
    design = {**task.fixed, **dict(zip(task.names, map(float, x), strict=True))}
    proofs, warnings = proof(task.plan.mechanism, design, asked, numbers)
    active = tuple(_active(task, chosen, solved, quantities)) if solved is not None and not violations else ()
    where = "nearest design" if violations else "optimum"
    margins = Margins(task.plan, design, asked, where, [aim.formula], numbers, task.required)
    seen = np.vstack([mixed.known, quantities[: mixed.known.shape[1]]])
    return Optimum(
        name=task.plan.mechanism.name,
        goal=aim.text,
        unit=aim.formula.unit,
        subject_to=tuple(limit.text for limit in task.limits),
        value=float(task.value(aim.formula, quantities)),
        variables=tuple(_variables(task, x)),
        active=active,
        multipliers={limit.text: limit.multiplier for limit in active},
        proof=proofs,
        kkt_residual=float("nan") if solved is None or violations else solved.stationarity.residual,
        starts=() if solved is None else tuple(_starts(task, chosen.land, solved)),
        violations=violations,
        method=method,
        seed=seed,
        evaluations=mixed.land.evaluations,
        tried=mixed.land.tried,
        failures=dict(mixed.land.failures),
        mechanism=task.plan.mechanism,
        parameters=task.fixed,
        notes=(*_notes(task, mixed, chosen, bool(violations)), *_straddled(task, margins, numbers)),
        warnings=(*_goal_warnings(task, seen), *_search_warnings(solved, violations), *warnings),
        margins=margins,
    )


def pareto_of(task: Task, mixed: Mixed, front: Front, seed: int) -> Pareto:
    """A front as a result."""
    land, formulas = mixed.land, [aim.formula for aim in task.aims]
    designs = np.array([_rounded(task, x) for x in front.designs]).reshape(-1, len(task.names))
    quantities = [_worked_out(task, x) for x in designs]
    values = np.array([[task.value(formula, row) for formula in formulas] for row in quantities], dtype=float)
    warnings, margins = list(_goal_warnings(task, mixed.known)), None
    if len(designs):
        middle = len(designs) // 2
        at = {**task.fixed, **dict(zip(task.names, designs[middle].tolist(), strict=True))}
        numbers = dict(zip(task.wording.places, quantities[middle].tolist(), strict=True))
        margins = Margins(task.plan, at, (), f"design {middle}", formulas, numbers, task.required)
    else:
        text = "no design was found that meets the limits: there is no front"
        warnings.append(Diagnostic("limit", "", float("nan"), 0.0, "1", text))
    return Pareto(
        name=task.plan.mechanism.name,
        goals=tuple(aim.text for aim in task.aims),
        units=tuple(formula.unit for formula in formulas),
        names=task.names,
        parameter_units=tuple(variable.unit for variable in task.variables),
        designs=designs,
        values=values.reshape(len(designs), len(formulas)),
        residual=front.residual,
        seed=seed,
        evaluations=land.evaluations,
        tried=land.tried,
        failures=dict(land.failures),
        mechanism=task.plan.mechanism,
        parameters=task.fixed,
        notes=(FRONT, *_failure_notes(land)),
        warnings=tuple(warnings),
        margins=margins,
    )


def _rounded(task: Task, x: Array) -> Array:
    """Values with as many digits as are reported, within the bounds."""
    rounded = np.array([float(f"{value:.{OPTIMUM_DIGITS}g}") for value in x])
    return np.clip(rounded, task.box.low, task.box.high)


def _quantities(task: Task, chosen: Chosen, x: Array) -> Array:
    """Quantities of what was chosen, at values x (P,): by slopes, of which the last digits need no more, or worked out
    where nothing has slopes."""
    if chosen.solved is None:
        return _worked_out(task, x)
    best, box = chosen.solved.best, chosen.land.box
    moved = x[[task.names.index(name) for name in box.names]] - box.values(best.z)
    return (best.point.value + best.point.slope @ moved)[: len(task.wording.places)]


def _worked_out(task: Task, x: Array) -> Array:
    """Quantities of a design, as the search has them with slopes, or without where some have none."""
    try:
        return task.designs.point(x).value[: len(task.wording.places)]
    except FlexuraError:
        return task.designs.values(x[None])[0][0]


def _violations(task: Task, land: Landscape, quantities: Array) -> Iterator[Violation]:
    for limit, row in zip(task.limits, land.limits, strict=True):
        if (by := -float(row.values(quantities))) > MISSED:
            yield Violation(limit.text, by * row.scale, limit.left.unit)


def _variables(task: Task, x: Array) -> Iterator[OptimumVariable]:
    z = task.box.positions(x)
    for k, variable in enumerate(task.variables):
        at = "" if variable.kind != "continuous" else "low" if z[k] <= ACTIVE else "high" if z[k] >= 1 - ACTIVE else ""
        levels = tuple(np.unique(variable.values).tolist()) if variable.kind == "choice" else ()
        numbers = float(task.before[k]), float(x[k]), float(variable.low), float(variable.high)
        yield OptimumVariable(variable.name, variable.unit, variable.kind, *numbers, at, levels)


def _active(task: Task, chosen: Chosen, solved: Solved, quantities: Array) -> Iterator[ActiveLimit]:
    """Limits and bounds that hold the design, with multipliers in the units of the user."""
    aim, land, conditions = task.aims[0], chosen.land, solved.stationarity

    def active(
        text: str, value: float, unit: str, multiplier: float, constant: float, *, is_bound: bool, upwards: bool
    ) -> ActiveLimit:
        return ActiveLimit(
            text=text,
            value=value,
            unit=unit,
            multiplier=multiplier,
            per_percent=0.01 * multiplier * abs(constant),
            goal=aim.formula.text,
            goal_unit=aim.formula.unit,
            is_bound=is_bound,
            gives_way_upwards=upwards,
            falls=aim.sign < 0,
        )

    for k in conditions.active:
        limit, row = task.limits[k], land.limits[k]
        multiplier = float(conditions.limits[k]) * land.goal.scale / row.scale
        constant, upwards = _constant(task, limit, quantities)
        left = float(task.value(limit.left, quantities))
        yield active(limit.text, left, limit.left.unit, multiplier, constant, is_bound=False, upwards=upwards)
    rates, box = land.box.rates(solved.best.z), land.box
    units = {variable.name: variable.unit for variable in task.variables}
    for k, name in enumerate(box.names):
        for upwards, weight, end in ((False, conditions.low[k], box.low[k]), (True, conditions.high[k], box.high[k])):
            if weight > 0:
                bound, unit = float(end), units[name]
                multiplier = float(weight * land.goal.scale / rates[k])
                text = f"{name} {'<=' if upwards else '>='} {quantity(bound, unit)}"
                yield active(text, bound, unit, multiplier, bound, is_bound=True, upwards=upwards)


def _constant(task: Task, limit: Relation, quantities: Array) -> tuple[float, bool]:
    """The side of a limit that is a number, 0 where neither is, and whether the limit gives way as it grows."""
    for side, grows in ((limit.right, limit.sense > 0), (limit.left, limit.sense < 0)):
        if side.is_constant:
            return float(task.value(side, quantities)), grows
    return 0.0, limit.sense > 0


def _starts(task: Task, land: Landscape, solved: Solved) -> Iterator[OptimumStart]:
    box = land.box
    for number, climb in enumerate(solved.climbs):
        end = climb.best
        yield OptimumStart(
            number=number,
            start=dict(zip(box.names, box.values(climb.start).tolist(), strict=True)),
            end={} if end is None else dict(zip(box.names, box.values(end.z).tolist(), strict=True)),
            value=float("nan") if end is None else task.aims[0].sign * end.goal * land.goal.scale,
            violation=float("nan") if end is None else end.violation,
            evaluations=climb.evaluations,
            agrees=solved.agrees(climb) and solved.is_here(climb),
            said=climb.message,
        )


def _goal_warnings(task: Task, known: Array) -> Iterator[Diagnostic]:
    """Goals that contradict each other, and such as are the same whatever varies; quantities (N, q) of some designs are
    `known`, to which others come where these are few and alike."""
    for k, aim in enumerate(task.aims):
        text = aim.formula.text
        if any(other.formula.text == text and other.sign != aim.sign for other in task.aims[:k]):
            words = f"{text} is to be both large and small: of these goals every design is as good as another"
            yield Diagnostic("goal", text, float("nan"), 0.0, "1", words)
    quantities = known

    def of(aim: Aim) -> Array:
        values = task.value(aim.formula, quantities)
        return values[np.isfinite(values)]

    if len(known) < FEWEST_DESIGNS and any(_is_alike(of(aim)) for aim in task.aims):
        quantities, _ = task.designs.values(task.starts(FEWEST_DESIGNS, seed=0))
    for aim in task.aims:
        values = of(aim)
        if len(values) > 1 and _is_alike(values):
            varied = ", ".join(task.names)
            text = f"{aim.text}: the same in all {len(values)} designs looked at, whatever {varied} may be"
            yield Diagnostic("goal", aim.text, float(np.ptp(values)), ROUND_OFF, "1", text)


def _is_alike(values: Array) -> bool:
    """Whether numbers, if any, are all the same."""
    return not len(values) or bool(np.ptp(values) <= ROUND_OFF * np.abs(values).max())


def _search_warnings(solved: Solved | None, violations: Sequence[Violation]) -> Iterator[Diagnostic]:
    if violations:
        first = violations[0]
        text = f"no design was found that meets the limits; in the nearest one {'; '.join(map(str, violations))}"
        yield Diagnostic("limit", first.text, first.by, 0.0, first.unit, text)
        return
    if solved is None:
        return
    residual = solved.stationarity.residual
    if residual > STATIONARY:
        text = f"the conditions of an optimum are missed by {residual:.2g} of the gradient: the search stopped short"
        ended = [climb.message for climb in solved.climbs if climb.best is solved.best]
        ended = [message for message in ended if message == NO_ANSWER_BEYOND]
        yield Diagnostic("convergence", "", residual, STATIONARY, "1", "; ".join([text, *ended[:1]]))
    if solved.curvature > RISING_CURVATURE:
        text = "the design is stationary, but the goal curves upwards along what limits leave free: it is no optimum"
        yield Diagnostic("convergence", "", solved.curvature, RISING_CURVATURE, "1", text)


def _straddled(task: Task, margins: Margins, numbers: Mapping[str, float]) -> Iterator[str]:
    """Limits that the design meets, and that the part may not for all that is known."""
    for limit in task.limits:
        ends = margins.span(limit.evaluate, limit.quantities, numbers)
        if ends is not None and ends[0] < -MISSED < float(limit.evaluate(numbers)):
            texts = (quantity.text for quantity in limit.quantities)
            of = ", ".join(f"{text} {margins.texts[text]}" for text in texts)
            yield f"{limit.text} is met by the description, and the part may miss it: model error of {of}"


def _notes(task: Task, mixed: Mixed, chosen: Chosen, is_missed: bool) -> Iterator[str]:
    solved, land = chosen.solved, mixed.land
    if chosen.text:
        yield chosen.text if chosen.is_every else f"{chosen.text}; one that is further away may be better"
    if solved is not None:
        yield _agreement(task, chosen.land, solved, is_missed)
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
    yield from dict.fromkeys(note for formula in task.formulas for note in formula.questions.notes)
    outside = (task.before < task.box.low) | (task.before > task.box.high)
    if outside.any():
        names = ", ".join(name for name, is_outside in zip(task.names, outside, strict=True) if is_outside)
        yield f"before, {names} lay outside the range: the first start is at its end"
    yield from _failure_notes(land)


def _failure_notes(land: Landscape) -> Iterator[str]:
    for reason, count in land.failures.most_common(1):
        yield f"{counted(land.failures.total(), 'design')} had no answer, {count} of them because: {reason}"


def _agreement(task: Task, land: Landscape, solved: Solved, is_missed: bool) -> str:
    """Which starts led to the optimum, and what the others found."""
    climbs, aim = solved.climbs, task.aims[0]
    searches = "1 search" if len(climbs) == 1 else f"{len(climbs)} searches"
    if is_missed:
        return f"none of {searches} led to a design that meets the limits"
    agreeing = [climb for climb in climbs if solved.agrees(climb)]
    here = sum(map(solved.is_here, agreeing))
    text = f"{here} of {searches} led to this design"
    if equal := len(agreeing) - here:
        text += f", {equal} to other designs that are as good"
    ends = [climb.best for climb in climbs if climb.is_feasible and not solved.agrees(climb)]
    if ends:
        best = aim.sign * land.goal.scale * max(end.goal for end in ends if end is not None)
        shown = quantity(best, aim.formula.unit) or f"{best:.5g}"
        text += f", {len(ends)} to worse ones, the best of them {shown}"
    if lost := len(climbs) - len(agreeing) - len(ends):
        text += f"; {lost} met no limits or had no answer"
    return text


@dataclass
class _Anew:
    """A mechanism whose parameters are those of a design, and what the verbs say of it; `warnings` are theirs."""

    mechanism: Mechanism
    quantities: Sequence[Quantity]
    warnings: list[Diagnostic] = field(default_factory=list)
    _strokes: dict[Pose, Stroke] = field(default_factory=dict)

    @cached_property
    def plan(self) -> Plan:
        """Its plan, in which the ends that corrections hold clamped are those of this design."""
        return plan_of(self.mechanism)

    @cached_property
    def modes(self) -> Modes:
        """Its modes, as many as are asked for, with proven intervals."""
        result = modes(self.plan, n=max(numbered(asked) or 1 for asked in self.quantities))
        self.warnings += result.warnings
        return result

    def stroke(self, pose: Pose) -> Stroke:
        """A pose that quantities are asked at, reached from rest."""
        if pose not in self._strokes:
            most = max(numbered(asked) or 1 for asked in self.quantities if asked.pose == pose)
            move, command = ({own.name: own.value for own in pose if own.kind == kind} for kind in ("move", "command"))
            loads = dict[str, Array]()
            for own in pose:
                if own.kind == "force":
                    node, component = own.pushed
                    loads.setdefault(node, np.zeros(6))[component] += own.value
            self._strokes[pose] = stroke(self.plan, move=move, loads=loads, actuators=command, steps=2, n=most)
            self.warnings += self._strokes[pose].warnings
        return self._strokes[pose]

    def checked(self, asked: Quantity, value: float) -> Proof:
        """A quantity worked out anew by the verb that has it, or else by the mechanism with these values."""
        number = numbered(asked)
        if number is not None and not asked.pose:
            mode = self.modes.modes[number - 1]
            low, high = mode.interval_hz
            hz = mode.frequency_hz if mode.full_frequency_hz is None else mode.full_frequency_hz
            interval = (low, high) if mode.is_indexed and low is not None and high is not None else None
            return Proof(asked.text, asked.unit, value, float(hz), "modes", interval)
        if number is not None:
            pose = self.stroke(asked.pose).poses[-1]
            interval = pose.frequency_interval_hz[number - 1] if pose.proven else None
            return Proof(asked.text, asked.unit, value, pose.frequency_hz[number - 1], "stroke", interval)
        if asked.pose and asked.kind == "stress":
            path = self.stroke(asked.pose)
            members = path.stresses(len(path.poses) - 1).members
            chosen = getattr(asked.arguments[0], "members", ()) if asked.arguments else [m.name for m in members]
            stresses = [m.von_mises for m in members if m.von_mises is not None and m.name in chosen]
            if stresses:
                return Proof(asked.text, asked.unit, value, max(stresses), "stroke")
        answer = Questions(self.plan, (asked,)).values({})
        return Proof(asked.text, asked.unit, value, float(answer.value[0, 0]), "a plan of its own")


def proof(
    mechanism: Mechanism, design: Mapping[str, float], quantities: Sequence[Quantity], numbers: Mapping[str, float]
) -> tuple[tuple[Proof, ...], list[Diagnostic]]:
    """Every quantity of a design anew beside its number in the search, and warnings: those of the verbs, what differs
    by more than `PROVEN` and is not within its interval, and what could not be worked out."""
    parameters = dict(mechanism.parameters)
    for name, value in design.items():
        parameters[name] = parameters[name].model_copy(update={"value": value})
    anew = _Anew(mechanism.model_copy(update={"parameters": parameters}), quantities)
    proofs, warnings = list[Proof](), list[Diagnostic]()

    def warn(text: str, difference: float, words: str) -> None:
        warnings.append(Diagnostic("proof", text, difference, PROVEN, "1", words))

    for asked in quantities:
        text = asked.text
        try:
            proofs.append(anew.checked(asked, numbers[text]))
        except FlexuraError as error:
            warn(text, float("nan"), f"{text} could not be worked out anew at the optimum: {error}")
    for one in proofs:
        text, checked = one.text, one.checked
        low, high = one.interval or (checked, checked)
        if one.difference > PROVEN and not low <= one.value <= high:
            words = f"{text} is {checked:.6g} {one.unit} by {one.by} and was {one.value:.6g} in the search:"
            warn(text, one.difference, f"{words} the optimum is that of the search, which differs")
    return tuple(proofs), [*warnings, *anew.warnings]
