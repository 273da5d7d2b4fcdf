"""Optima and Pareto fronts as results, and their designs as model files on top of the one that was varied."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError
from flexura.expressions import NUMBER, Expression
from flexura.files import write_file
from flexura.mechanism import Mechanism, parameter_dimensions
from flexura.modelfile import Changed, variant_text
from flexura.records import Record
from flexura.results import Tabular
from flexura.study.questions import Margins
from flexura.study.requirements import OfThePart
from flexura.tables import Item, Line, Table, counted, percent, quantity, scale_for
from flexura.units import format_quantity


@dataclass(frozen=True, repr=False)
class OptimumVariable(Record):
    """A parameter that was varied: SI values before and at the optimum, its `kind`, bounds and unit."""

    _shown = ("name", "start", "value")

    name: str
    unit: str
    kind: str
    start: float
    value: float
    low: float
    high: float
    at_bound: str = ""
    """`low` or `high` where a bound holds it."""
    levels: tuple[float, ...] = ()
    """The values of a list."""


@dataclass(frozen=True, repr=False)
class ActiveLimit(Record):
    """A limit or a bound that holds the optimum.

    `multiplier` is what the goal gains per `unit` (SI) by which the limit gives way (Lagrange multiplier), in
    `goal_unit`; `per_percent` what it gains where it gives way by 1 %.
    """

    _shown = ("text", "multiplier")

    text: str
    value: float
    unit: str
    multiplier: float
    per_percent: float
    goal: str
    goal_unit: str
    is_bound: bool = False
    gives_way_upwards: bool = True
    falls: bool = False
    """Whether the goal gains by falling."""

    def __str__(self) -> str:
        name = self.text if len(self.text) < 60 else f"{self.text[:57]}..."
        if not self.multiplier:
            return f"{name}: holds with equality and costs nothing"
        less = "less of " if self.falls else "of "
        size, unit = scale_for([self.value], self.unit)
        per = f"{quantity(size * self.multiplier, self.goal_unit, 4)} per {unit or 'unit'}"
        change = "more" if self.gives_way_upwards else "less"
        if not self.per_percent:
            return f"{name}: room in it buys {per} {less}{self.goal}"
        return f"{name}: 1 % {change} buys {quantity(self.per_percent, self.goal_unit, 3)} {less}{self.goal} ({per})"


@dataclass(frozen=True, repr=False)
class Proof(Record):
    """A quantity at the optimum, worked out anew: the `value` that the search had, `checked` and by which verb, and the
    interval that is proven to hold it at full order, None where none is claimed."""

    _shown = ("text", "value", "checked")

    text: str
    unit: str
    value: float
    checked: float
    by: str
    interval: tuple[float, float] | None = None

    @property
    def half_width(self) -> float | None:
        """Half the width of the interval over the value; None where none is claimed."""
        if self.interval is None or not self.checked:
            return None
        return (self.interval[1] - self.interval[0]) / 2 / abs(self.checked)

    @property
    def difference(self) -> float:
        """How far the two are apart, over the larger one."""
        return abs(self.value - self.checked) / max(abs(self.value), abs(self.checked), 1e-300)


@dataclass(frozen=True, repr=False)
class OptimumStart(Record):
    """Where a search began and ended: SI values by name, the goal there (NaN without an answer), by how much of its
    scale the worst limit is missed, evaluations, whether it is the optimum that is reported, and why it ended."""

    _shown = ("number", "value", "agrees")

    number: int
    start: Mapping[str, float]
    end: Mapping[str, float]
    value: float
    violation: float
    evaluations: int
    agrees: bool
    said: str


@dataclass(frozen=True, repr=False)
class Violation(Record):
    """A limit that the design misses, `by` so much of its unit (SI)."""

    text: str
    by: float
    unit: str

    def __str__(self) -> str:
        return f"{self.text} is missed by {quantity(self.by, self.unit, 4)}"


@dataclass(frozen=True, repr=False, kw_only=True)
class _Outcome(OfThePart, Tabular):
    """What a search has found for the `mechanism`, with some `parameters` fixed, SI: designs `tried`, `evaluations` of
    designs with slopes, and `failures`, why designs had no answer."""

    name: str
    seed: int
    evaluations: int
    tried: int
    failures: Mapping[str, int]
    mechanism: Mechanism
    parameters: Mapping[str, float]
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    margins: Margins | None = field(default=None, repr=False, compare=False)

    def _effort(self) -> Line:
        return Line(f"{self.evaluations} designs with gradients, {self.tried} without")

    def _saved(self, design: Mapping[str, float], source: str, path: str | Path, base: str | Path) -> Path:
        """Write a model file that extends `base` with SI values of parameters, those of a design and fixed ones; the
        source of each says where it comes from, the value in `base`, and its source."""
        dimensions, changed = parameter_dimensions(self.mechanism.parameters), dict[str, Changed]()
        for name, value in {**self.parameters, **design}.items():
            parameter = self.mechanism.parameters[name]
            was, dimension = parameter.value, dimensions[name] or NUMBER
            was = str(was) if isinstance(was, Expression) else format_quantity(was, dimension)
            known = f" ({parameter.source})" if parameter.source else ""
            changed[name] = Changed(value, f"{source if name in design else 'given'}; was {was}{known}")
        text = variant_text(self.mechanism, f"{self.mechanism.name}, optimised", Path(base), Path(path), changed)
        return write_file(Path(path), lambda file: file.write_text(text, encoding="utf-8", newline="\n"))


@dataclass(frozen=True, repr=False, kw_only=True)
class Optimum(_Outcome):
    """The best design that was found.

    `value` is the `goal` there in `unit`, `subject_to` are the limits as asked; `active` are those of them, and the
    bounds, that hold it, and `kkt_residual` is what the conditions of an optimum are missed by, relative. `proof` has
    every quantity at full order, `margins` model errors of the goal and of them. Where no design meets
    the limits, `violations` say by how much the least violated one misses them, and there is no optimum.
    """

    _shown = ("name", "goal", "value", "optimum")
    _told = (
        *("name", "goal", "unit", "subject_to", "optimum", "value", "active", "multipliers", "proof", "kkt_residual"),
        "variables",
        *("violations", "nearest", "starts", "method", "seed", "evaluations", "tried", "failures"),
        *("model_error", "model_error_reason", "requirements"),
    )

    goal: str
    unit: str
    subject_to: tuple[str, ...]
    value: float
    variables: tuple[OptimumVariable, ...]
    active: tuple[ActiveLimit, ...]
    multipliers: Mapping[str, float]
    proof: tuple[Proof, ...]
    kkt_residual: float
    starts: tuple[OptimumStart, ...]
    violations: tuple[Violation, ...]
    method: str

    @property
    def is_feasible(self) -> bool:
        """Whether there is a design that meets the limits."""
        return not self.violations

    @cached_property
    def design(self) -> dict[str, float]:
        """The values of the variables, SI: of the optimum, or of the least violated design."""
        return {variable.name: variable.value for variable in self.variables}

    @property
    def optimum(self) -> dict[str, float]:
        """The values of the variables, SI; empty where no design meets the limits."""
        return self.design if self.is_feasible else {}

    @property
    def nearest(self) -> dict[str, float]:
        """The values of the least violated design, SI, where none meets the limits; empty otherwise."""
        return {} if self.is_feasible else self.design

    @verb
    def save(self, path: str | Path, *, base: str | Path) -> Path:
        """Write a model file that extends `base`, the file that was optimised, with the values of the optimum and where
        they come from. Raises OptionError where there is no optimum, for `base` itself, and when it cannot be
        written."""
        if not self.is_feasible:
            raise OptionError(f"no design meets the limits: {self.violations[0]}; there is no optimum to write")
        return self._saved(self.design, f"optimised: {self.goal}", path, base)

    def _title(self) -> str:
        return (
            f"{self.goal}: {quantity(self.value, self.unit, 6) if self.is_feasible else 'no design meets the limits'}"
        )

    def presentation(self) -> Iterator[Item]:
        """The design, what holds it, and the proof."""
        variables = self.variables
        at_bound = {"low": " (at its lower bound)", "high": " (at its upper bound)"}
        best = [quantity(v.value, v.unit, 6) + at_bound.get(v.at_bound, "") for v in variables]
        columns = {
            "parameter": [v.name for v in variables],
            "before": [quantity(v.start, v.unit, 6) for v in variables],
            "optimum" if self.is_feasible else "nearest": best,
            "from": [quantity(v.low, v.unit, 4) for v in variables],
            "to": [quantity(v.high, v.unit, 4) for v in variables],
        }
        yield Table(columns, "parameters")
        if self.active:
            yield Table({"what holds it": [str(limit) for limit in self.active]}, "limits")
        columns = {
            "proof": [proof.text for proof in self.proof],
            "search": [quantity(proof.value, proof.unit) for proof in self.proof],
            "anew": [quantity(proof.checked, proof.unit, 6) for proof in self.proof],
            "by": [proof.by for proof in self.proof],
            "proven within": [percent(proof.half_width, 2) for proof in self.proof],
        }
        errors = {} if self.margins is None else {"model error": [self.margins.texts[p.text] for p in self.proof]}
        yield Table({**columns, **errors}, "quantities")
        if self.is_feasible and not np.isnan(self.kkt_residual):
            yield Line(f"conditions of an optimum hold to {self.kkt_residual:.1g} of the gradient")
        yield self._effort()

    def _columns(self) -> dict[str, Any]:
        """A row for each variable."""
        names, variables = [variable.name for variable in self.variables], self.variables
        return {
            "parameter": names,
            "unit": [variable.unit for variable in variables],
            "start [SI]": [variable.start for variable in variables],
            "optimum [SI]": [self.optimum.get(name, np.nan) for name in names],
            "nearest [SI]": [self.nearest.get(name, np.nan) for name in names],
            "low [SI]": [variable.low for variable in variables],
            "high [SI]": [variable.high for variable in variables],
            "at bound": [variable.at_bound for variable in variables],
        }


@dataclass(frozen=True, repr=False, kw_only=True)
class Pareto(_Outcome):
    """Designs of which none is better than another in all goals.

    `designs` (N, P) are SI values of the variables `names`, `values` (N, g) the `goals`, in their `units`, ordered by
    the first goal; `residual` (N,) what the conditions of an optimum are missed by (NaN where one variable takes some
    values alone), and `failures` why designs had no answer. `margins` has model errors of the goals at the design in
    the middle of the front.
    """

    _shown = ("name", "goals", "values")
    _told = (
        *("name", "goals", "units", "names", "designs", "values", "residual", "seed", "evaluations", "tried"),
        *("failures", "model_error", "model_error_reason", "requirements"),
    )

    goals: tuple[str, ...]
    units: tuple[str, ...]
    names: tuple[str, ...]
    parameter_units: tuple[str, ...]
    designs: Array
    values: Array
    residual: Array

    def __len__(self) -> int:
        return len(self.designs)

    def pick(self, row: int) -> dict[str, float]:
        """The values of the variables of one design, SI, by its row from 0. Raises OptionError where there is none."""
        if isinstance(row, bool) or not isinstance(row, int | np.integer) or not 0 <= row < len(self):
            raise OptionError(f"the front has designs from 0 to {len(self) - 1}; there is no {row!r}")
        return dict(zip(self.names, map(float, self.designs[row]), strict=True))

    @verb
    def save(self, path: str | Path, *, base: str | Path, row: int) -> Path:
        """Write a model file that extends `base`, the file that was optimised, with the values of one design of the
        front. Raises OptionError where there is no such row, and when it cannot be written."""
        source = f"optimised: design {row} of a front of {', '.join(self.goals)}"
        return self._saved(self.pick(row), source, path, base)

    def _title(self) -> str:
        return f"{counted(len(self), 'design')} of {', '.join(self.goals)}"

    def presentation(self) -> Iterator[Item]:
        yield Table({"design": range(len(self)), **self._columns()}, "designs")
        yield from self.margin_facts()
        yield self._effort()

    def _columns(self) -> dict[str, Any]:
        """A row for each design."""
        texts = zip((*self.goals, *self.names), (*self.units, *self.parameter_units), strict=True)
        headings = [text if unit in ("", "1") else f"{text} [{unit}]" for text, unit in texts]
        return dict(zip(headings, (*self.values.T, *self.designs.T), strict=True))
