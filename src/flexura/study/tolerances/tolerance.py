"""The verb that says what tolerances do to a mechanism: which sizes scatter, how quantities do, and what parts pass."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism, Parameter, Spread, parameter_values, with_own_copies
from flexura.structure import Plan, one_design
from flexura.study.engine import ALL_REQUIREMENTS, StudyTable, run
from flexura.study.questions import Margins, Questions, Relation, questions, relation
from flexura.study.requirements import described_relations, others_of, with_required
from flexura.study.space import Variable, variables
from flexura.study.tolerances.distributions import FORMS, Distribution, distribution_of
from flexura.study.tolerances.nets import (
    FEWEST_BEYOND,
    ScrambledNets,
    indices_of,
    mean_interval,
    percentile_interval,
    share_interval,
)
from flexura.study.tolerances.result import QuantitySpread, Tolerance, ToleratedSize, Yield
from flexura.study.tolerances.worst_case import (
    Box,
    Evaluate,
    SlopesOf,
    extreme,
    linear_deviation,
    significant,
    variance_shares,
)
from flexura.tables import counted
from flexura.thresholds import ROUND_OFF

Vary = Mapping[str, str | Spread] | Sequence[str] | str
"""Tolerances by parameter, or texts NAME=TOLERANCE."""

PERCENTILES = (1, 5, 50, 95, 99)

DEFAULT_SAMPLES = 4096

FAR_FROM_LINEAR = 0.1
"""Relative difference between the standard deviations of slopes and of samples from which on it is reported."""

MOST_SIZES_LISTED = 6
"""Sizes of a tolerance that a note names."""


@verb
def tolerance(
    model: Mechanism | Plan,
    parameters: Mapping[str, float] | None = None,
    *,
    vary: Vary | None = None,
    ask: str | Sequence[str] | None = None,
    require: str | Sequence[str] | None = None,
    study: str | None = None,
    samples: int | None = None,
    seed: int | None = None,
    each: bool | Sequence[str] = True,
    requirements: bool = True,
    indices: bool = True,
    percentiles: Sequence[float] = PERCENTILES,
    confidence: float = 0.95,
    folder: str | Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Listener | None = None,
) -> Tolerance:
    """What tolerances of sizes do to everything that is asked, and which share of parts meets what is required.

    `vary` has a tolerance for each parameter, such as `± 0.02 mm`, about its value; every copy of a part has its own,
    unless `each` is false or names others. What is not given comes from the tolerance study of the file, of those the
    one that `study` names; the `requirements` of the description are required, too, unless they are not wanted. 4096
    samples are independently scrambled Sobol' replicates, run as the designs of `sweep`;
    `indices` take more designs beside them (theory eqs. U1-U12). Raises ModelError, OptionError and SolverError.
    """
    if not 0 < confidence < 1:
        raise OptionError(f"a confidence lies between 0 and 1, e.g. 0.95, not {confidence!r}")
    for percentile in percentiles:
        if not 0 < percentile < 100:
            raise OptionError(f"a percentile lies between 0 and 100, not {percentile!r}")
    shares = tuple(float(percentile) / 100 for percentile in percentiles)
    plan = plan_of(model, parameters)
    fixed = one_design(parameters)
    plan.verify(fixed)
    given = {"vary": vary, "ask": ask, "require": require, "samples": samples, "seed": seed}
    options = _with_study(plan.mechanism, study, given)
    sizes = sizes_of(plan.mechanism, fixed, options["vary"] or (), each)
    asked, required = _asked(
        plan_of(sizes.mechanism), options["ask"] or (), options["require"] or (), described=requirements
    )
    nets = ScrambledNets.of(sizes.variables, sizes.groups, options["samples"], seed=options["seed"], indices=indices)
    others = {name: value for name, value in fixed.items() if name not in nets.names}
    table = run(asked, nets, others, folder=folder, workers=workers, scheduler=scheduler, progress=progress)
    values = np.column_stack(list(table.to_columns(table.asked).values()))
    A, B, AB = nets.sorted_out(values)
    sample, drawn = values[: nets.samples], np.column_stack(list(nets.designs(0, nets.samples).values()))
    slopes, box = SlopesOf(asked, others, nets.names), sizes.box(drawn)
    spreads = [_spread(slopes, box, k, A[..., k], shares=shares, confidence=confidence) for k in range(values.shape[1])]
    reasons = _failures(table, sample)
    return Tolerance(
        name=plan.mechanism.name,
        sizes=sizes.sizes,
        tolerances=sizes.tolerances,
        quantities=tuple(spreads),
        shares=shares,
        confidence=confidence,
        yields=_yields(required, A, slopes, box, confidence),
        correlation=_correlation(sample),
        indices=indices_of(A[:, : nets.index_points], B, AB, confidence) if indices else None,
        samples=nets.samples,
        scramblings=nets.scramblings,
        seed=nets.seed,
        failed=sum(reasons.values()),
        reasons=reasons,
        values=sample,
        drawn=drawn,
        warnings=tuple(_warnings(table, nets.samples, reasons)),
        notes=(*_notes(sizes, nets, spreads), *asked.notes),
        margins=Margins(plan, fixed, asked.quantities, required=described_relations(plan) if requirements else {}),
    )


def _with_study(mechanism: Mechanism, study: str | None, given: Mapping[str, Any]) -> dict[str, Any]:
    """What is given, with the rest from the tolerance study of the file. Raises OptionError for one that is not there,
    and where several could be meant."""
    known = {name: entry.tolerance for name, entry in mechanism.studies.items() if entry.tolerance is not None}
    if study is not None and study not in known:
        listed = ", ".join(known) or "none"
        raise OptionError(f"{study!r} is no tolerance study of {mechanism.name}; known: {listed}")
    options: dict[str, Any] = {"ask": None, "require": None, "samples": DEFAULT_SAMPLES, "seed": 0}
    if study is not None or given["vary"] is None:
        if study is None and len(known) != 1:
            several = f"name one of its tolerance studies: {', '.join(known)}" if known else FORMS
            raise OptionError(f"no size has a tolerance; {several}")
        described = known[study or next(iter(known))]
        options = {name: getattr(described, name) for name in given}
        if given["ask"] is not None or given["require"] is not None:
            options |= {"ask": None, "require": None}
    return options | {name: value for name, value in given.items() if value is not None}


@dataclass(frozen=True)
class Sizes:
    """A mechanism whose copies have parameters of their own, the sizes that scatter and the positions of each
    tolerance's."""

    mechanism: Mechanism
    sizes: tuple[ToleratedSize, ...]
    variables: tuple[Variable, ...]
    tolerances: tuple[str, ...]
    groups: tuple[tuple[int, ...], ...]

    def box(self, drawn: Array) -> Box:
        """The range of all sizes, with samples (N, d) of them."""
        ranges = np.array([(size.nominal, size.low, size.high, size.deviation) for size in self.sizes])
        nominal, low, high, deviation = ranges.T
        return Box(nominal, low, high, deviation, drawn)


def sizes_of(mechanism: Mechanism, fixed: Mapping[str, float], vary: Vary, each: bool | Sequence[str] = True) -> Sizes:
    """The sizes of tolerances about their values, with `fixed` parameters set; every copy of a part has its own where
    `each` names the parameter, or is true and a file does not say otherwise.

    Raises OptionError for text that is no tolerance, for parameters that are unknown, follow from others or are named
    twice, and for tolerances that go beyond their bounds.
    """
    given = _by_name(vary)
    apart = [each] if isinstance(each, str) else list(each or ()) if each is not True else None
    if apart is None:
        apart = [name for name, spread in given.items() if not isinstance(spread, Spread) or spread.each]
    for name in apart:
        if name not in given:
            raise OptionError(f"{name!r} has no tolerance for each copy to have its own; with one: {', '.join(given)}")
    values = parameter_values(mechanism, fixed)
    variables(mechanism, {name: [float(values.get(name, 0.0))] for name in given})
    copied, names = with_own_copies(mechanism, apart) if apart else (mechanism, {})
    nominal = {name: float(value) for name, value in parameter_values(copied, fixed).items()}
    sizes, groups, varied = list[ToleratedSize](), list[tuple[int, ...]](), list[Variable]()
    for name, spread in given.items():
        copies = tuple(dict.fromkeys(names[name].values())) if name in names else (name,)
        groups.append(tuple(range(len(sizes), len(sizes) + len(copies))))
        unit = mechanism.parameters[name].unit
        for copy in copies:
            law = distribution_of(mechanism, name, spread, {**nominal, name: nominal[copy]})
            _check_bounds(copy, copied.parameters[copy], law)
            numbers = (nominal[copy], law.low, law.high, law.mean, law.deviation)
            sizes.append(ToleratedSize(copy, name, unit, *numbers, law.describe()))
            varied.append(Variable(copy, law.low, law.high, unit=unit, distribution=law))
    # as they scatter by themselves, sizes follow from nothing
    free = {size.name: copied.parameters[size.name].replaced({"value": size.nominal}) for size in sizes}
    scattering = copied.replaced({"parameters": {**copied.parameters, **free}})
    return Sizes(scattering, tuple(sizes), tuple(varied), tuple(given), tuple(groups))


def _check_bounds(name: str, parameter: Parameter, law: Distribution) -> None:
    """Refuse a tolerance that goes beyond the bounds of its parameter; tails of a normal distribution fail alone."""
    if not law.is_bounded:
        return
    unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
    for side, bound, end, sign in (
        ("below the minimum", parameter.minimum, law.low, -1),
        ("above the maximum", parameter.maximum, law.high, 1),
    ):
        if isinstance(bound, float) and sign * end > sign * bound:
            raise OptionError(f"{name}: the tolerance reaches {end:g}{unit}, {side} {bound:g}{unit} of the parameter")


def _by_name(vary: Vary) -> dict[str, str | Spread]:
    given = dict(vary) if isinstance(vary, Mapping) else dict[str, str | Spread]()
    for text in () if isinstance(vary, Mapping) else [vary] if isinstance(vary, str) else vary:
        name, equals, spread = (part.strip() for part in str(text).partition("="))
        if not (name and equals and spread):
            raise OptionError(f"{text!r}: NAME=TOLERANCE is expected; {FORMS}")
        if name in given:
            raise OptionError(f"{name} has a tolerance already; give one")
        given[name] = spread
    if not given:
        raise OptionError(f"no size has a tolerance; {FORMS}")
    return given


def _asked(
    plan: Plan, ask: str | Sequence[str], require: str | Sequence[str], described: bool
) -> tuple[Questions, list[Relation]]:
    """Everything that is asked, or needed for what is required, each once."""
    required = [relation(plan, text) for text in ([require] if isinstance(require, str) else require)]
    required += others_of(described_relations(plan), required) if described else []
    if not (ask or required):
        raise OptionError("no quantity is named; name some (ask), e.g. f1, or require something, e.g. f1 >= 20 Hz")
    asked = questions(plan, ask) if ask else Questions(plan, ())
    return with_required(asked, required), required


def _spread(
    slopes: SlopesOf, box: Box, k: int, values: Array, *, shares: Sequence[float], confidence: float
) -> QuantitySpread:
    """How quantity k scatters, with values (R, n)."""
    quantity, flat = slopes.asked.quantities[k], values.ravel()
    values_at, slopes_at, reasons = slopes.at(box.nominal)
    nominal, slope, reason = float(values_at[k]), slopes_at[k], reasons[k]
    low, high = (extreme(slopes.quantity(k), box.starts(flat, sign), box.low, box.high, sign) for sign in (-1, 1))
    slope = slope if reason else significant(slope, box.high - box.low, nominal)
    known = flat[np.isfinite(flat)]
    return QuantitySpread(
        text=quantity.text,
        unit=quantity.unit,
        nominal=nominal,
        mean=mean_interval(values, confidence),
        deviation=float(np.std(known, ddof=1)) if len(known) > 1 else np.nan,
        percentiles=tuple(percentile_interval(values, share, confidence) for share in shares),
        smallest=float(known.min(initial=np.inf)),
        largest=float(known.max(initial=-np.inf)),
        worst_low=low,
        worst_high=high,
        slope=slope,
        variance_share=variance_shares(slope, box.deviation),
        linear_deviation=linear_deviation(slope, box.deviation),
        no_slope=reason,
    )


def _yields(
    required: Sequence[Relation], values: Array, slopes: SlopesOf, box: Box, confidence: float
) -> tuple[Yield, ...]:
    """The yields of requirements, and of all together where there are several, from values (R, n, q) of what is asked.

    A design without a value meets nothing.
    """
    by_text = {quantity.text: values[..., k] for k, quantity in enumerate(slopes.asked.quantities)}
    yields, passes_all = list[Yield](), np.ones(values.shape[:2], dtype=bool)
    for requirement in required:
        margins = np.broadcast_to(requirement.evaluate(by_text), passes_all.shape)
        passes = np.nan_to_num(margins, nan=-1.0) >= 0
        passes_all &= passes
        margin = slopes.margin(requirement)
        nominal, _ = margin(box.nominal)
        is_met = bool(nominal >= 0) if np.isfinite(nominal) else None
        worst, share = _is_met_at_worst(margin, margins.ravel(), box), share_interval(passes, confidence)
        yields.append(Yield(requirement.text, share, int(np.sum(~passes)), is_met, worst, *_plain_limit(requirement)))
    if len(yields) > 1:
        nominal = _all_met(each.is_met_nominally for each in yields)
        worst = _all_met(each.is_met_at_worst for each in yields)
        share = share_interval(passes_all, confidence)
        yields.append(Yield(ALL_REQUIREMENTS, share, int(np.sum(~passes_all)), nominal, worst))
    return tuple(yields)


def _is_met_at_worst(margin: Evaluate, margins: Array, box: Box) -> bool | None:
    """Whether a margin is positive at the worst corner; None where that is not found, or a sample has no margin."""
    worst = extreme(margin, box.starts(margins, -1), box.low, box.high, -1)
    if worst.value < 0:
        return False
    return True if worst.is_vertex and np.isfinite(margins[box.inside]).all() else None


def _all_met(known: Iterable[bool | None]) -> bool | None:
    known = set(known)
    return False if False in known else None if None in known else True


def _plain_limit(requirement: Relation) -> tuple[str, float | None]:
    """The quantity that a relation holds against a number, and that; none where it is no plain limit."""
    left, right = requirement.left, requirement.right
    for side, other in ((left, right), (right, left)):
        names = [quantity.text for quantity in side.quantities]
        if other.is_constant and len(names) == 1 and all(side.evaluate({names[0]: x}) == x for x in (1.0, 3.0)):
            return names[0], float(other.values({})[0])
    return "", None


def _correlation(values: Array) -> Array:
    """Correlation (q, q) of the columns of values (N, q) over the samples that have them all; NaN of constants."""
    known = values[np.isfinite(values).all(axis=1)]
    if len(known) < 2:
        return np.full((values.shape[1],) * 2, np.nan)
    deviations = known - known.mean(axis=0)
    size = np.sqrt(np.sum(deviations**2, axis=0))
    size[size <= ROUND_OFF * np.abs(known).max(axis=0) * np.sqrt(len(known))] = np.nan
    return (deviations / size).T @ (deviations / size)


def _failures(table: StudyTable, values: Array) -> dict[str, int]:
    """How many samples have no value of something, by why, the most frequent first."""
    failed = ~np.isfinite(values).all(axis=1)
    reason = table.rows(0, len(values), ["reason"])["reason"]
    return dict(Counter(str(text) or "no reason" for text in reason[failed]).most_common())


def _warnings(table: StudyTable, samples: int, reasons: Mapping[str, int]) -> Iterator[Diagnostic]:
    failed = sum(reasons.values())
    if failed:
        first, count = next(iter(reasons.items()))
        text = f"{failed} of {samples} samples could not be worked out, {count} of them: {first}"
        text += "; percentiles are those of the others, and yields count them as failing"
        yield Diagnostic("study", "", failed, 0.0, "1", text)
    yield from (warning for warning in table.warnings if warning.kind == "proof")


def _notes(sizes: Sizes, nets: ScrambledNets, spreads: Sequence[QuantitySpread]) -> Iterator[str]:
    for name, group in zip(sizes.tolerances, sizes.groups, strict=True):
        if len(group) > 1:
            listed = ", ".join(sizes.sizes[k].name for k in group[:MOST_SIZES_LISTED])
            more = " and so on" if len(group) > MOST_SIZES_LISTED else ""
            yield f"{name}: {counted(len(group), 'size')}, {listed}{more}"
    yield (
        f"{nets.samples} samples in {nets.scramblings} scrambled Sobol' replicates; intervals by Student's t over the "
        f"replicates where each has {FEWEST_BEYOND} samples beyond"
    )
    for spread in spreads:
        text, deviation, linear = spread.text, spread.deviation, spread.linear_deviation
        if spread.no_slope:
            yield f"{text}: {spread.no_slope.removeprefix(f'{text}: ')}; no share of each size is known"
        elif abs(linear - deviation) > FAR_FROM_LINEAR * max(deviation, linear):
            yield (
                f"{text}: its standard deviation is {deviation:.3g} {spread.unit}, by slopes alone "
                f"{linear:.3g} {spread.unit}: it is far from linear in these tolerances"
            )
        ends = ((spread.worst_low, "lowest"), (spread.worst_high, "highest"))
        if unsettled := " and ".join(word for end, word in ends if not end.is_vertex):
            yield f"{text}: its {unsettled} value within the tolerances is only the furthest that was found"
