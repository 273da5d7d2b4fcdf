"""What is to be optimised: variables, goals and limits, held against the mechanism before work starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.mechanism import bounds
from flexura.structure import Plan
from flexura.study.optimum.discrete import Mixed
from flexura.study.optimum.landscape import Box, Judged, Landscape
from flexura.study.optimum.rows import AskedDesigns, Combined, Difference, Row, Wording, wording
from flexura.study.questions import Formula, Relation, formula, relation
from flexura.study.space import Space, Variable, Varied, variables


@dataclass(frozen=True)
class Aim:
    """A formula to be made large (`sign` 1) or small (-1)."""

    formula: Formula
    sign: float

    @property
    def text(self) -> str:
        """`maximise f1`, in the words that it is asked in."""
        return f"{'maximise' if self.sign > 0 else 'minimise'} {self.formula.text}"


@dataclass(frozen=True)
class Task:
    """Variables, aims and limits of a plan, of which parameters have `fixed` values, SI."""

    plan: Plan
    fixed: Mapping[str, float]
    variables: tuple[Variable, ...]
    aims: tuple[Aim, ...]
    limits: tuple[Relation, ...]

    @cached_property
    def wording(self) -> Wording:
        """What is asked of every design."""
        own = [aim.formula for aim in self.aims]
        return wording(self.plan, [*own, *(side for limit in self.limits for side in (limit.left, limit.right))])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that vary."""
        return tuple(own.name for own in self.variables)

    @cached_property
    def box(self) -> Box:
        """The variables between their ends."""
        low, high = (np.array([getattr(own, end) for own in self.variables]) for end in ("low", "high"))
        return Box(self.names, low, high)

    @cached_property
    def designs(self) -> AskedDesigns:
        """Answers of designs."""
        own = self.wording
        return AskedDesigns(own.questions, own.parts, own.worsts, self.names, self.fixed)

    @cached_property
    def before(self) -> Array:
        """Values of the variables (P,) before, SI."""
        known = self.plan.parameter_values(dict(self.fixed))
        return np.array([float(known[name]) for name in self.names])

    def margin(self, limit: Relation) -> Combined | Difference:
        """By how much a limit is met, in its unit."""
        left, right = self.wording.combined(limit.left), self.wording.combined(limit.right)
        return Difference(right, left) if limit.sense > 0 else Difference(left, right)

    def starts(self, count: int, seed: int) -> Array:
        """Where searches start (count, P): the design as it is, as far as it lies in the ranges, then Sobol points."""
        first = np.clip(self.before, self.box.low, self.box.high)[None]
        if count == 1:
            return first
        scattered = Space(self.variables, "sobol", samples=count - 1, seed=seed).points(0, count - 1)
        x = self.box.values(scattered)
        for k, own in enumerate(self.variables):
            if own.kind != "continuous":
                x[:, k] = own.at(scattered[:, k])
        return np.concatenate([first, x])

    def mixed(self, starts: Array) -> tuple[Mixed, tuple[Row, ...], Judged]:
        """The landscape of the first goal, and rows of all goals, over scales that follow from designs, and how good
        these are."""
        quantities, reasons = self.designs.values(starts)
        rows = [
            self.wording.row(own, _scale([own.value(quantities)]))
            for own in (self.wording.combined(aim.formula, aim.sign) for aim in self.aims)
        ]
        limits = []
        for limit in self.limits:
            sides = [self.wording.combined(side).value(quantities) for side in (limit.left, limit.right)]
            margin = self.margin(limit)
            constant = sides[1] if limit.right.is_constant else sides[0] if limit.left.is_constant else None
            limits.append(self.wording.row(margin, _scale(sides if constant is None else [constant], sides)))
        land = Landscape(self.designs, self.box, rows[0], limits)
        judged = land.judged(quantities, reasons)
        discrete = [k for k, own in enumerate(self.variables) if own.kind != "continuous"]
        levels = tuple(_levels(self.variables[k]) for k in discrete)
        return Mixed(land, np.array(discrete, dtype=np.intp), levels, quantities), tuple(rows), judged


def _scale(*choices: Sequence[Array]) -> float:
    """The size of the first numbers of which any is known and not zero, or 1."""
    for values in choices:
        known = np.concatenate([np.abs(np.ravel(own)) for own in values])
        known = known[np.isfinite(known) & (known > 0)]
        if len(known):
            return float(np.median(known))
    return 1.0


def _levels(variable: Variable) -> Array:
    """The values of a variable that takes some alone, ascending."""
    if variable.kind == "choice":
        return np.unique(variable.values)
    return np.arange(variable.low, variable.high + 1)


def task_of(
    plan: Plan,
    fixed: Mapping[str, float],
    vary: Varied | Sequence[str] | None,
    maximise: str | Sequence[str] | None,
    minimise: str | Sequence[str] | None,
    subject_to: str | Sequence[str] | None,
) -> Task:
    """What a verb is asked, read. Raises OptionError for what makes no sense, before any design is worked out."""
    aims = [Aim(formula(plan, text), 1.0) for text in _texts(maximise)]
    aims += [Aim(formula(plan, text), -1.0) for text in _texts(minimise)]
    if not aims:
        raise OptionError("name a goal: maximise or minimise, e.g. maximise f1")
    for aim in aims:
        if aim.formula.is_constant:
            raise OptionError(f"{aim.text}: this is a number for every design; a goal asks for one, e.g. maximise f1")
    if vary is None:
        raise OptionError("say what may vary, e.g. vary thickness=0.2mm:0.6mm")
    own = variables(plan.mechanism, _with_bounds(plan, vary, fixed), fixed)
    for variable in own:
        if variable.kind != "choice" and not variable.low < variable.high:
            raise OptionError(f"{variable.name}: the range from {variable.low:g} to {variable.high:g} is empty")
    return Task(plan, fixed, own, tuple(aims), tuple(relation(plan, text) for text in _texts(subject_to)))


def _texts(given: str | Sequence[str] | None) -> list[str]:
    return [given] if isinstance(given, str) else list(given or ())


def _with_bounds(plan: Plan, vary: Any, fixed: Mapping[str, float]) -> Any:
    """What varies, where a parameter that is only named goes from its minimum to its maximum."""
    entries = [vary] if isinstance(vary, str) else vary
    if isinstance(vary, Mapping) or not isinstance(entries, Sequence):
        return vary
    return [_bounded(plan, own, fixed) if isinstance(own, str) and "=" not in own else own for own in entries]


def _bounded(plan: Plan, name: str, fixed: Mapping[str, float]) -> Any:
    name, mechanism = name.strip(), plan.mechanism
    if name not in mechanism.parameters or mechanism.parameters[name].is_held:
        return f"{name}=0:1"  # whoever reads it says what is wrong with the name
    parameter = mechanism.parameters[name]
    low, high = (float(end) for end in bounds(name, parameter, plan.parameter_values(dict(fixed))))
    if not np.isfinite(low + high):
        raise OptionError(f"{name} has no minimum and maximum in the file; write {name}=LOW:HIGH")
    return Variable(name, low, high, unit=parameter.unit)
