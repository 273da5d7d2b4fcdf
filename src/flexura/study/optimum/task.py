"""What is to be optimised: variables, goals and limits, held against the mechanism before work starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import FlexuraError, OptionError
from flexura.mechanism import bounds
from flexura.structure import Plan
from flexura.study.optimum.discrete import Mixed
from flexura.study.optimum.landscape import Box, Judged, Landscape, settled
from flexura.study.optimum.rows import AskedDesigns, FormulaSum, Row, Wording, wording
from flexura.study.questions import Formula, Relation, formula, relation
from flexura.study.requirements import described_relations, others_of
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
    """Variables, aims and limits of a plan, of which parameters have `fixed` values, SI; `required` of its description,
    by name, are among the limits."""

    plan: Plan
    fixed: Mapping[str, float]
    variables: tuple[Variable, ...]
    aims: tuple[Aim, ...]
    limits: tuple[Relation, ...]
    required: Mapping[str, Relation]

    @property
    def formulas(self) -> list[Formula]:
        """Those of the aims, and both sides of the limits."""
        sides = [side for limit in self.limits for side in (limit.left, limit.right)]
        return [*(aim.formula for aim in self.aims), *sides]

    @cached_property
    def wording(self) -> Wording:
        """What is asked of every design."""
        return wording(self.plan, self.formulas)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that vary."""
        return tuple(variable.name for variable in self.variables)

    @cached_property
    def box(self) -> Box:
        """The variables between their ends."""
        low, high = np.array([(variable.low, variable.high) for variable in self.variables]).T
        return Box(self.names, low, high)

    @cached_property
    def designs(self) -> AskedDesigns:
        """Answers of designs."""
        return AskedDesigns(self.wording, self.names, self.fixed)

    @cached_property
    def before(self) -> Array:
        """Values of the variables (P,) before, SI."""
        known = self.plan.parameter_values(dict(self.fixed))
        return np.array([float(known[name]) for name in self.names])

    def value(self, formula: Formula, quantities: Array) -> Array:
        """Values (...), SI, of a formula at quantities (..., q)."""
        return self.wording.function((1.0, formula)).value(quantities)

    def margin(self, limit: Relation) -> FormulaSum:
        """By how much a limit is met, in its unit."""
        larger, smaller = (limit.right, limit.left) if limit.sense > 0 else (limit.left, limit.right)
        return self.wording.function((1.0, larger), (-1.0, smaller))

    def starts(self, count: int, seed: int) -> Array:
        """Where searches start (count, P): the design as it is, as far as it lies in the ranges, then Sobol points."""
        first = np.clip(self.before, self.box.low, self.box.high)[None]
        if count == 1:
            return first
        scattered = Space(self.variables, "sobol", samples=count - 1, seed=seed).points(0, count - 1)
        x = self.box.values(scattered)
        for k, variable in enumerate(self.variables):
            if variable.kind != "continuous":
                x[:, k] = variable.at(scattered[:, k])
        return np.concatenate([first, x])

    def _first(self, starts: Array) -> tuple[Array, Sequence[str]]:
        """As `AskedDesigns.values` of one design (1, P), as the search that starts there works it out."""
        try:
            point = self.designs.point(self.box.values(settled(self.box.positions(starts[0]))))
        except FlexuraError as error:
            return np.full((1, len(self.wording.questions.quantities)), np.nan), [str(error)]
        return point.value[None, : len(self.wording.questions.quantities)], [""]

    def limit_rows(self, quantities: Array, behind: int = 0) -> list[Row]:
        """Rows of the limits, over scales that follow from quantities (..., q), of which so many others come first."""
        rows, wording = list[Row](), self.wording.behind(behind)
        for limit in self.limits:
            sides = [wording.function((1.0, side)).value(quantities) for side in (limit.left, limit.right)]
            constant = [sides[1]] if limit.right.is_constant else [sides[0]] if limit.left.is_constant else sides
            margin = replace(self.margin(limit), places=wording.places)
            rows.append(wording.row(margin, _scale(constant, sides)))
        return rows

    def mixed(self, starts: Array) -> tuple[Mixed, tuple[Row, ...], Judged | None]:
        """The landscape of the first goal, and rows of all goals, over scales that follow from designs, and how good
        these are; not of one by itself, which the search works out anyway."""
        is_alone = len(starts) == 1 and len(self.aims) == 1 and all(own.kind == "continuous" for own in self.variables)
        quantities, reasons = (self._first if is_alone else self.designs.values)(starts)
        goals = list[Row]()
        for aim in self.aims:
            goal = self.wording.function((aim.sign, aim.formula))
            goals.append(self.wording.row(goal, _scale([goal.value(quantities)])))
        limits = self.limit_rows(quantities)
        land = Landscape(self.designs, self.box, goals[0], limits)
        judged = None if is_alone else land.judged(quantities, reasons)
        discrete = [k for k, variable in enumerate(self.variables) if variable.kind != "continuous"]
        levels = tuple(
            np.unique(variable.values) if variable.kind == "choice" else np.arange(variable.low, variable.high + 1)
            for variable in (self.variables[k] for k in discrete)
        )
        return Mixed(land, np.array(discrete, dtype=np.intp), levels, quantities), tuple(goals), judged


def _scale(*choices: Sequence[Array]) -> float:
    """The size of the first numbers of which any is known and not zero, or 1."""
    for values in choices:
        known = np.abs(np.concatenate([np.ravel(numbers) for numbers in values]))
        known = known[np.isfinite(known) & (known > 0)]
        if len(known):
            return float(np.median(known))
    return 1.0


def task_of(plan: Plan, fixed: Mapping[str, float], asked: Mapping[str, Any]) -> Task:
    """What a verb is asked, `vary`, `maximise`, `minimise`, `subject_to` and `requirements`, read. Raises OptionError
    for what makes no sense, before any design is worked out."""
    texts = {
        name: [text] if isinstance(text := asked[name], str) else list(text or ())
        for name in ("maximise", "minimise", "subject_to")
    }
    aims = [Aim(formula(plan, text), 1.0) for text in texts["maximise"]]
    aims += [Aim(formula(plan, text), -1.0) for text in texts["minimise"]]
    if not aims:
        raise OptionError("name a goal: maximise or minimise, e.g. maximise f1")
    for aim in aims:
        if aim.formula.is_constant:
            raise OptionError(f"{aim.text}: this is a number for every design; a goal asks for one, e.g. maximise f1")
    if asked["vary"] is None:
        raise OptionError("say what may vary, e.g. vary thickness=0.2mm:0.6mm")
    varied = variables(plan.mechanism, _with_bounds(plan, asked["vary"], fixed), fixed)
    for variable in varied:
        if variable.kind != "choice" and not variable.low < variable.high:
            raise OptionError(f"{variable.name}: the range from {variable.low:g} to {variable.high:g} is empty")
    limits = [relation(plan, text) for text in texts["subject_to"]]
    required = described_relations(plan) if asked["requirements"] else {}
    limits += others_of(required, limits)
    return Task(plan, fixed, varied, tuple(aims), tuple(limits), required)


def _with_bounds(plan: Plan, vary: Any, fixed: Mapping[str, float]) -> Varied:
    """What varies, where a parameter that is only named goes from its minimum to its maximum."""
    entries = [vary] if isinstance(vary, str) else vary
    if isinstance(vary, Mapping) or not isinstance(entries, Sequence):
        return vary
    parameters = plan.mechanism.parameters

    def ranged(name: str) -> str | Variable:
        if name not in parameters or parameters[name].is_held:
            return f"{name}=0:1"  # whoever reads it says what is wrong with the name
        low, high = (float(end) for end in bounds(name, parameters[name], plan.parameter_values(dict(fixed))))
        if not np.isfinite(low + high):
            raise OptionError(f"{name} has no minimum and maximum in the file; write {name}=LOW:HIGH")
        return Variable(name, low, high, unit=parameters[name].unit)

    return [ranged(entry.strip()) if isinstance(entry, str) and "=" not in entry else entry for entry in entries]
