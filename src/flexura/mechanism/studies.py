"""Studies: what is asked of many designs, and how these vary; numbers that others give. Questions are kept as text."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Discriminator, Field, StringConstraints, Tag, model_validator

from flexura.expressions import Expression
from flexura.mechanism.base import Name, Part, refuse
from flexura.mechanism.member import RootKind
from flexura.mechanism.quantity import AnyQuantity, PositiveNumber

MOST_SAMPLES = 2**53
"""Designs of one study: more cannot be counted in double precision."""

Count = Annotated[int, Field(ge=1, le=MOST_SAMPLES, strict=True)]
Seed = Annotated[int, Field(ge=0, lt=2**63, strict=True)]


def _one_or_more(raw: Any) -> Any:
    return (raw,) if isinstance(raw, str) else raw


Question = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=2000)]
Label = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=100)]
"""A name of words."""
Questions = Annotated[tuple[Question, ...], BeforeValidator(_one_or_more)]
SomeQuestions = Annotated[tuple[Question, ...], Field(min_length=1), BeforeValidator(_one_or_more)]


class Range(Part):
    """From one value of a parameter to another, both included; an end that is left out is the parameter's bound."""

    from_: Annotated[AnyQuantity | None, Field(alias="from")] = None
    to: AnyQuantity | None = None
    steps: Annotated[int, Field(ge=1, le=MOST_SAMPLES, strict=True)] | None = None
    """Values on a grid, the ends included."""
    scale: Literal["linear", "log"] = "linear"
    """Whether equal steps are equal differences or equal ratios."""
    integer: bool = False
    """Whether only whole numbers are meant."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        low, high = self.from_, self.to
        if isinstance(low, float) and isinstance(high, float) and low >= high:
            raise refuse("it is empty: a range goes from the smaller value to the larger one")
        for end in (low, high):
            if self.scale == "log" and isinstance(end, float) and end <= 0:
                raise refuse(
                    "an end is not positive: a range with equal ratios has positive ends", "write scale: linear"
                )
            if self.integer and isinstance(end, float) and not end.is_integer():
                raise refuse("an end is not whole: a range of whole numbers has whole ends")
        return self


Choice = Annotated[tuple[AnyQuantity, ...], Field(min_length=1)]
"""The values that a parameter may have."""


def _kind(raw: Any) -> str:
    return "range" if isinstance(raw, dict | Range) else "choice"


Variation = Annotated[Annotated[Range, Tag("range")] | Annotated[Choice, Tag("choice")], Discriminator(_kind)]
"""A range, or a list of values."""


class SweepStudy(Part):
    """Answers over a grid or a list of designs, or over so many samples of them."""

    vary: Annotated[dict[Name, Variation], Field(min_length=1)]
    """By parameter: `{from: ..., to: ..., steps: ...}`, or a list of values."""
    ask: SomeQuestions
    sampling: Literal["grid", "list", "latin hypercube", "sobol"] = "grid"
    """All values with all, side by side, or samples of the ranges."""
    samples: Count | None = None
    """Designs of a Latin hypercube or a Sobol sequence."""
    seed: Seed = 0

    @model_validator(mode="after")
    def _sampled(self) -> Self:
        takes_values = self.sampling in ("grid", "list")
        if takes_values and self.samples is not None:
            raise refuse(
                "a grid or a list takes every value: samples are those of a Latin hypercube or a Sobol sequence",
                "write sampling: sobol",
            )
        if not takes_values and self.samples is None:
            raise refuse("it is missing: samples says how many designs there are", "e.g. samples: 4096")
        for name, varied in self.vary.items():
            if isinstance(varied, Range) and (varied.steps is None) == takes_values and not varied.integer:
                rule = (
                    f"{name} has no steps on the {self.sampling}" if takes_values else f"{name} has steps, but no grid"
                )
                raise refuse(rule, "e.g. steps: 11" if takes_values else "leave steps out")
        counts = {
            name: varied.steps if isinstance(varied, Range) else len(varied) for name, varied in self.vary.items()
        }
        if self.sampling == "list" and len({*counts.values()} - {None}) > 1:
            listed = ", ".join(f"{name} has {count}" for name, count in counts.items() if count is not None)
            raise refuse(f"a list pairs values: every parameter has as many ({listed})")
        return self


class Goal(Part):
    """One of several quantities to be as large or as small as can be."""

    maximise: Question | None = None
    minimise: Question | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.maximise is None) == (self.minimise is None):
            raise refuse("both, or neither, is given: a goal is either maximise or minimise", "e.g. {maximise: f1}")
        return self


class OptimumStudy(Part):
    """The best design: one quantity as large or as small as can be, or the front of several goals."""

    vary: Annotated[dict[Name, Variation], Field(min_length=1)]
    """By parameter: `{from: ..., to: ...}`, with `integer: true` for whole numbers alone, or a list of choices."""
    maximise: Question | None = None
    minimise: Question | None = None
    goals: Annotated[tuple[Goal, ...], Field(min_length=2)] | None = None
    """Several goals, between which there is a Pareto front."""
    subject_to: Questions = ()
    """What must hold, as `stress(left) <= 400 MPa at stroke 2 mm`."""
    starts: Annotated[int, Field(ge=1, le=100_000, strict=True)] = 8
    seed: Seed = 0

    @model_validator(mode="after")
    def _aims(self) -> Self:
        if (self.maximise is not None) + (self.minimise is not None) + (self.goals is not None) != 1:
            raise refuse(
                "several, or none, are given: an optimum is one of maximise, minimise, goals", "e.g. maximise: f1"
            )
        for name, varied in self.vary.items():
            if isinstance(varied, Range) and varied.steps is not None:
                raise refuse(f"{name} has steps, but an optimum is sought between the ends", "leave steps out")
        return self


def _both_sides(raw: Any) -> Any:
    """One number stands for deviations as far down as up."""
    if isinstance(raw, list | tuple):
        return raw
    if isinstance(raw, Expression):
        return (-raw, raw)
    if isinstance(raw, int | float) and not isinstance(raw, bool):
        return (-raw, raw)
    return raw


class Spread(Part):
    """How a parameter deviates from its value: evenly between two deviations, in a triangle over them, normally, or as
    was measured."""

    uniform: Annotated[tuple[AnyQuantity, AnyQuantity], BeforeValidator(_both_sides)] | None = None
    """Deviations between which all are as likely; one number stands for as far down as up."""
    triangular: Annotated[tuple[AnyQuantity, AnyQuantity], BeforeValidator(_both_sides)] | None = None
    """Deviations between which those near none are likeliest; one number as in `uniform`."""
    normal: AnyQuantity | None = None
    """Standard deviation."""
    within: PositiveNumber | None = None
    """Standard deviations beyond which a normal deviation is sorted out; none is where it is left out."""
    measured: Annotated[tuple[AnyQuantity, ...], Field(min_length=2)] | None = None
    """Values, not deviations; any between two neighbouring ones is as likely, none beyond them."""
    each: bool = True
    """Whether every copy of a part deviates by its own; all deviate alike otherwise."""

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        kinds = (self.uniform, self.triangular, self.normal, self.measured)
        if sum(kind is not None for kind in kinds) != 1:
            rule = "a spread is one of uniform, triangular, normal, measured"
            raise refuse(rule, "e.g. ± 0.02 mm, or {normal: 0.01 mm}")
        if self.within is not None and self.normal is None:
            raise refuse(
                "another spread has ends of its own: within belongs to a normal spread",
                "e.g. {normal: 0.01 mm, within: 3}",
            )
        low, high = self.uniform or self.triangular or (0.0, 1.0)
        if self.normal == 0 or low == high == 0:
            raise refuse("deviations of zero are none, as are per cent of a value that is zero", "e.g. ± 0.02 mm")
        if isinstance(self.normal, float) and self.normal <= 0:
            raise refuse("a standard deviation must be positive", "e.g. {normal: 0.01 mm}")
        if isinstance(low, float) and isinstance(high, float) and not low < high:
            raise refuse(
                "they are in the wrong order: the lower deviation is below the upper one", "e.g. +0.01/-0.03 mm"
            )
        return self


class ToleranceStudy(Part):
    """What spreads of parameters do to the answers."""

    vary: Annotated[dict[Name, Spread], Field(min_length=1)]
    """By parameter: `± 0.02 mm`, `+0.01/-0.03 mm`, `{normal: 0.01 mm, within: 3}` or `{measured: [...]}`."""
    ask: Questions = ()
    require: Questions = ()
    """What a part must fulfil to be good, as `f1 >= 20 Hz`."""
    samples: Count = 4096
    seed: Seed = 0

    @model_validator(mode="after")
    def _asks(self) -> Self:
        if not (self.ask or self.require):
            raise refuse("no quantity is named: a tolerance study has ask or require", "e.g. ask: [f1, f2]")
        return self


class DescribedStudy(Part):
    """A study of many designs: one of a sweep, an optimum, tolerances."""

    sweep: SweepStudy | None = None
    optimize: OptimumStudy | None = None
    tolerance: ToleranceStudy | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.sweep is not None) + (self.optimize is not None) + (self.tolerance is not None) != 1:
            raise refuse(
                "several, or none, are given: a study is one of sweep, optimize, tolerance",
                "e.g. sweep: {vary: ..., ask: f1}",
            )
        return self

    @property
    def kind(self) -> str:
        """`sweep`, `optimize` or `tolerance`."""
        return next(kind for kind in ("sweep", "optimize", "tolerance") if getattr(self, kind) is not None)

    @property
    def words(self) -> str:
        """What it does, in one line."""
        study = self.own
        over = f"{self.kind} over {', '.join(study.vary)}"
        if isinstance(study, OptimumStudy):
            aims = study.goals or (Goal(maximise=study.maximise, minimise=study.minimise),)
            goals = ", ".join(
                f"maximise {aim.maximise}" if aim.maximise else f"minimise {aim.minimise}" for aim in aims
            )
            return f"{over}: {goals}" + (f", subject to {', '.join(study.subject_to)}" if study.subject_to else "")
        return f"{over}: {', '.join((*study.ask, *getattr(study, 'require', ())))}"

    @property
    def own(self) -> SweepStudy | OptimumStudy | ToleranceStudy:
        """What is described, whichever kind it is."""
        found: SweepStudy | OptimumStudy | ToleranceStudy = getattr(self, self.kind)
        return found


class PublishedValue(Part):
    """A number that a source gives, and how near to it the mechanism is to be."""

    ask: Question
    """What the number is of, as studies ask it, e.g. `stiffness(stage.x)`, or a formula over such names."""
    value: Question
    """The number with its unit, or the closed form over parameters, e.g. `24 * E * I / length^3`."""
    within: PositiveNumber = 0.01
    """Largest difference, relative to the number."""
    root: RootKind = "elastic"
    """`rigid` for a number that takes all joints as rigid, as closed forms of beams do."""
    source: Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=2000)]
    """Author, year, equation or table; what it holds for."""
