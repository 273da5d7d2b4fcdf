"""The verb that says what tolerances do to a mechanism."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener
from flexura.duals import Dual
from flexura.errors import Diagnostic, OptionError
from flexura.mechanism import Mechanism, Parameter, Spread, parameter_values, with_own_copies
from flexura.structure import Plan, one_design, plan_of
from flexura.study.engine import StudyTable, run
from flexura.study.questions import Margins, Questions, Relation, Slopes, questions, relation
from flexura.study.space import Variable, variables
from flexura.study.tolerances.distributions import FORMS, Distribution, Normal, distribution_of
from flexura.study.tolerances.nets import (
    FEWEST,
    ScrambledNets,
    indices_of,
    mean_interval,
    percentile_interval,
    share_interval,
)
from flexura.study.tolerances.result import QuantitySpread, Tolerance, ToleratedSize, Yield
from flexura.study.tolerances.worst_case import Box, extreme, linear_deviation, significant, variance_shares
from flexura.tables import counted

Given = str | Spread
Vary = Mapping[str, Given] | Sequence[str] | str
"""Tolerances by parameter, or texts NAME=TOLERANCE."""


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
        nominal, low, high = np.array([(size.nominal, size.low, size.high) for size in self.sizes]).T
        return Box(nominal, low, high, drawn)


def sizes_of(mechanism: Mechanism, fixed: Mapping[str, float], vary: Vary, each: bool | Sequence[str] = True) -> Sizes:
    """The sizes of tolerances about their values, with `fixed` parameters set; every copy of a part has its own where
    `each` names the parameter, or is true and a file does not say otherwise.

    Raises OptionError for text that is no tolerance, for parameters that are unknown, follow from others or are named
    twice, and for tolerances that go beyond their bounds.
    """
    given = _by_name(vary)
    own_each = [name for name, own in given.items() if not isinstance(own, Spread) or own.each]
    chosen = [each] if isinstance(each, str) else (own_each if each is True else list(each or ()))
    for name in chosen:
        if name not in given:
            raise OptionError(f"{name!r} has no tolerance for each copy to have its own; with one: {', '.join(given)}")
    values = parameter_values(mechanism, fixed)
    variables(mechanism, {name: [float(values.get(name, 0.0))] for name in given})
    copied, names = with_own_copies(mechanism, chosen) if chosen else (mechanism, {})
    nominal = {name: float(value) for name, value in parameter_values(copied, fixed).items()}
    sizes, groups, vary_each = list[ToleratedSize](), list[tuple[int, ...]](), list[Variable]()
    for name, text in given.items():
        copies = tuple(dict.fromkeys(names[name].values())) if name in names else (name,)
        groups.append(tuple(range(len(sizes), len(sizes) + len(copies))))
        unit = mechanism.parameters[name].unit
        for copy in copies:
            at = nominal[copy]
            own = distribution_of(mechanism, name, text, {**nominal, name: at})
            _check_bounds(copy, copied.parameters[copy], own)
            ends = (own.low, own.high, own.mean, own.deviation)
            sizes.append(ToleratedSize(copy, name, unit, at, *ends, own.describe()))
            vary_each.append(Variable(copy, own.low, own.high, unit=unit, distribution=own))
    return Sizes(_free(copied, sizes), tuple(sizes), tuple(vary_each), tuple(given), tuple(groups))


def _free(mechanism: Mechanism, sizes: Sequence[ToleratedSize]) -> Mechanism:
    """The mechanism with sizes that are numbers and follow from nothing, as they scatter by themselves."""
    known = mechanism.parameters
    own = {size.name: known[size.name].replaced({"value": size.nominal}) for size in sizes}
    return mechanism.replaced({"parameters": {**known, **own}})


def _check_bounds(name: str, parameter: Parameter, own: Distribution) -> None:
    """Refuse a tolerance that goes beyond the bounds of its parameter; tails of a normal distribution fail alone."""
    if isinstance(own, Normal) and not own.is_cut:
        return
    unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
    for side, bound, end in (
        ("below the minimum", parameter.minimum, own.low),
        ("above the maximum", parameter.maximum, own.high),
    ):
        if isinstance(bound, float) and (end < bound if side.startswith("below") else end > bound):
            raise OptionError(f"{name}: the tolerance reaches {end:g}{unit}, {side} {bound:g}{unit} of the parameter")


def _by_name(vary: Vary) -> dict[str, Given]:
    if isinstance(vary, Mapping):
        found = dict(vary)
    else:
        found = dict[str, Given]()
        for text in [vary] if isinstance(vary, str) else vary:
            name, equals, own = (part.strip() for part in str(text).partition("="))
            if not (name and equals and own):
                raise OptionError(f"{text!r}: NAME=TOLERANCE is expected; {FORMS}")
            if name in found:
                raise OptionError(f"{name} has a tolerance already; give one")
            found[name] = own
    if not found:
        raise OptionError(f"no size has a tolerance; {FORMS}")
    return found


ALIKE = 1e-6
"""Relative difference of the slopes of frequencies that coincide up to which they stay together."""


class SlopesOf:
    """Values (q,) and slopes (q, d) of questions in the parameters `names`, with others at their values."""

    def __init__(self, asked: Questions, parameters: Mapping[str, float], names: Sequence[str]) -> None:
        self.asked = asked
        self._parameters, self._names = parameters, tuple(names)
        self._found: dict[bytes, tuple[Array, Array, list[str]]] = {}

    def at(self, sizes: Array) -> tuple[Array, Array, list[str]]:
        """Values, slopes at sizes (d,), and why slopes are NaN where they are."""
        key = sizes.tobytes()
        if key not in self._found:
            design = {**self._parameters, **dict(zip(self._names, map(float, sizes), strict=True))}
            self._found[key] = _usable(self.asked.slopes(design, self._names))
        return self._found[key]

    def quantity(self, k: int) -> Callable[[Array], tuple[float, Array]]:
        """Value and slopes (d,) of quantity k by sizes (d,)."""

        def evaluate(sizes: Array) -> tuple[float, Array]:
            value, slope, _ = self.at(sizes)
            return float(value[k]), slope[k]

        return evaluate

    def margin(self, of: Relation) -> Callable[[Array], tuple[float, Array]]:
        """Margin of a requirement and its slopes (d,) by sizes (d,)."""

        def evaluate(sizes: Array) -> tuple[float, Array]:
            value, slope, _ = self.at(sizes)
            asked = enumerate(self.asked.quantities)
            found = of.evaluate({own.text: Dual(np.array(value[k]), slope[k].copy()) for k, own in asked})
            return float(found.value), np.asarray(found.slope, dtype=float)

        return evaluate


def _usable(found: Slopes) -> tuple[Array, Array, list[str]]:
    """Values, slopes without those of frequencies that coincide and part, and why there are none."""
    slope = np.array(found.slope, dtype=float)
    reason = [why or "no slope" for why in found.reason]
    for group, matrix in zip(found.repeated, found.directional, strict=True):
        mean = np.trace(matrix) / len(matrix)
        parted = np.abs(matrix - np.eye(len(matrix))[:, :, None] * mean).max(initial=0.0)
        if parted <= ALIKE * np.abs(matrix).max(initial=0.0):
            continue
        for k in group:
            slope[k] = np.nan
            reason[k] = "it coincides with another frequency, from which it parts: no slope"
    there = [bool(np.isfinite(own).all()) for own in slope]
    return found.value, slope, ["" if own else why for own, why in zip(there, reason, strict=True)]


ALL = "all of them"
"""What the yield of all requirements together is called."""


def yields(
    relations: Sequence[Relation], values: Array, slopes: SlopesOf, box: Box, confidence: float
) -> tuple[Yield, ...]:
    """The yields of requirements, and of all together where there are several, from values (R, n, q) of what is asked.

    A design without a value meets nothing.
    """
    names = [own.text for own in slopes.asked.quantities]
    by_name = {name: values[..., k] for k, name in enumerate(names)}
    found, passing = list[Yield](), np.ones(values.shape[:2], dtype=bool)
    for own in relations:
        margins = np.broadcast_to(own.evaluate(by_name), passing.shape)
        passes = np.nan_to_num(margins, nan=-1.0) >= 0
        passing &= passes
        margin = slopes.margin(own)
        nominal = margin(box.nominal)[0]
        is_met = bool(nominal >= 0) if np.isfinite(nominal) else None
        worst = _is_met_at_worst(margin, margins.ravel(), box)
        found.append(
            Yield(own.text, share_interval(passes, confidence), int(np.sum(~passes)), is_met, worst, *_limit(own))
        )
    if len(found) > 1:
        nominal, worst = _every(own.is_met_nominally for own in found), _every(own.is_met_at_worst for own in found)
        found.append(Yield(ALL, share_interval(passing, confidence), int(np.sum(~passing)), nominal, worst))
    return tuple(found)


def _is_met_at_worst(margin: Callable[[Array], tuple[float, Array]], margins: Array, box: Box) -> bool | None:
    """Whether a margin is positive at the worst corner; None where that is not found, or a sample has no margin."""
    worst = extreme(margin, box.starts(margins, -1), box.low, box.high, -1)
    if worst.value < 0:
        return False
    return True if worst.is_vertex and np.isfinite(margins[box.inside]).all() else None


def _every(known: Iterable[bool | None]) -> bool | None:
    known = list(known)
    if any(own is False for own in known):
        return False
    return None if any(own is None for own in known) else True


def _limit(own: Relation) -> tuple[str, float | None]:
    """The quantity that a relation holds against a number, and that; none where it is no plain limit."""
    for side, other in ((own.left, own.right), (own.right, own.left)):
        names = [asked.text for asked in side.quantities]
        if other.is_constant and len(names) == 1 and all(side.evaluate({names[0]: x}) == x for x in (1.0, 3.0)):
            return names[0], float(other.values({})[0])
    return "", None


PERCENTILES = (1, 5, 50, 95, 99)

SAMPLES = 4096

FAR = 0.1
"""Relative difference between the standard deviations of slopes and of samples from which on it is said."""

LISTED = 6
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
    one that `study` names. 4096 samples are independently scrambled Sobol' replicates, run as the designs of `sweep`;
    `indices` take more designs beside them (theory eqs. U1-U12). Raises ModelError, OptionError and SolverError.
    """
    shares = _shares(percentiles, confidence)
    plan = plan_of(model, parameters)
    fixed = one_design(parameters)
    plan.verify(fixed)
    given = _given(plan.mechanism, study, _Given(vary, ask, require, samples, seed))
    own = sizes_of(plan.mechanism, fixed, given.vary or (), each)
    asked, required = _asked(plan_of(own.mechanism), given.ask or (), given.require or ())
    nets = ScrambledNets.of(own.variables, own.groups, given.samples, given.seed, indices)
    others = {name: value for name, value in fixed.items() if name not in nets.names}
    table = run(asked, nets, others, folder=folder, workers=workers, scheduler=scheduler, progress=progress)
    values = np.column_stack(list(table.to_columns(table.asked).values()))
    A, B, AB = nets.sorted_out(values)
    sample, drawn = values[: nets.samples], np.column_stack(list(nets.designs(0, nets.samples).values()))
    slopes, box = SlopesOf(asked, others, nets.names), own.box(drawn)
    spreads = [_spread(k, A[..., k], own, slopes, box, shares, confidence) for k in range(values.shape[1])]
    reasons = _failures(table, sample)
    return Tolerance(
        name=plan.mechanism.name,
        sizes=own.sizes,
        tolerances=own.tolerances,
        quantities=tuple(spreads),
        shares=shares,
        confidence=confidence,
        yields=yields(required, A, slopes, box, confidence),
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
        notes=(*_notes(own, nets, spreads), *asked.notes),
        margins=Margins(plan, fixed, asked.quantities),
    )


class _Given(NamedTuple):
    """What a study takes from a call, or from a file."""

    vary: Vary | None
    ask: str | Sequence[str] | None
    require: str | Sequence[str] | None
    samples: Any
    seed: Any


def _given(mechanism: Mechanism, study: str | None, given: _Given) -> _Given:
    """What is given, with the rest from the tolerance study of the file. Raises OptionError for one that is not there,
    and where several could be meant."""
    known = {name: own.tolerance for name, own in mechanism.studies.items() if own.tolerance is not None}
    if study is not None and study not in known:
        listed = ", ".join(known) or "none"
        raise OptionError(f"{study!r} is no tolerance study of {mechanism.name}; known: {listed}")
    if study is None and given.vary is not None:
        own = {"samples": SAMPLES, "seed": 0}
        return given._replace(**{name: own[name] for name in own if getattr(given, name) is None})
    if study is None and len(known) != 1:
        several = f"name one of its tolerance studies: {', '.join(known)}" if known else f"{FORMS}"
        raise OptionError(f"no size has a tolerance; {several}")
    own = known[study or next(iter(known))]
    found = [getattr(own, name) if value is None else value for name, value in given._asdict().items()]
    if given.ask is not None or given.require is not None:
        found[1], found[2] = given.ask, given.require
    return _Given(*found)


def _shares(percentiles: Sequence[float], confidence: float) -> tuple[float, ...]:
    if not 0 < confidence < 1:
        raise OptionError(f"a confidence lies between 0 and 1, e.g. 0.95, not {confidence!r}")
    for own in percentiles:
        if not 0 < own < 100:
            raise OptionError(f"a percentile lies between 0 and 100, not {own!r}")
    return tuple(float(own) / 100 for own in percentiles)


def _asked(plan: Plan, ask: str | Sequence[str], require: str | Sequence[str]) -> tuple[Questions, list[Relation]]:
    """Everything that is asked, or needed for what is required, each once."""
    required = [relation(plan, own) for own in ([require] if isinstance(require, str) else require)]
    if not (ask or required):
        raise OptionError("no quantity is named; name some (ask), e.g. f1, or require something, e.g. f1 >= 20 Hz")
    own = questions(plan, ask).quantities if ask else ()
    needed = (quantity for one in required for quantity in one.quantities)
    return Questions(plan, tuple(dict.fromkeys((*own, *needed)))), required


def _spread(
    k: int, values: Array, own: Sizes, slopes: SlopesOf, box: Box, shares: Sequence[float], confidence: float
) -> QuantitySpread:
    """What is told of quantity k, with values (R, n)."""
    asked, flat = slopes.asked.quantities[k], values.ravel()
    values_at, slopes_at, reasons = slopes.at(box.nominal)
    nominal, slope, reason = float(values_at[k]), slopes_at[k], reasons[k]
    low, high = (extreme(slopes.quantity(k), box.starts(flat, sign), box.low, box.high, sign) for sign in (-1, 1))
    deviation = np.array([size.deviation for size in own.sizes])
    slope = slope if reason else significant(slope, box.high - box.low, nominal)
    there = flat[np.isfinite(flat)]
    return QuantitySpread(
        text=asked.text,
        unit=asked.unit,
        nominal=nominal,
        mean=mean_interval(values, confidence),
        deviation=float(np.std(there, ddof=1)) if len(there) > 1 else np.nan,
        percentiles=tuple(percentile_interval(values, share, confidence) for share in shares),
        smallest=float(there.min(initial=np.inf)),
        largest=float(there.max(initial=-np.inf)),
        worst_low=low,
        worst_high=high,
        slope=slope,
        variance_share=variance_shares(slope, deviation),
        linear_deviation=linear_deviation(slope, deviation),
        no_slope=reason,
    )


def _correlation(values: Array) -> Array:
    """Correlation (q, q) of the columns of values (N, q) over the samples that have them all; NaN of constants."""
    whole = values[np.isfinite(values).all(axis=1)]
    if len(whole) < 2:
        return np.full((values.shape[1],) * 2, np.nan)
    off = whole - whole.mean(axis=0)
    size = np.sqrt(np.sum(off**2, axis=0))
    size[size <= 1e-12 * np.abs(whole).max(axis=0) * np.sqrt(len(whole))] = np.nan
    return (off / size).T @ (off / size)


def _failures(table: StudyTable, values: Array) -> dict[str, int]:
    """How many samples have no value of something, by why, the most frequent first."""
    failed = ~np.isfinite(values).all(axis=1)
    reason = table.rows(0, len(values), ["reason"])["reason"]
    return dict(Counter(str(own) or "no reason" for own in reason[failed]).most_common())


def _warnings(table: StudyTable, samples: int, reasons: Mapping[str, int]) -> Iterator[Diagnostic]:
    failed = sum(reasons.values())
    if failed:
        first, count = next(iter(reasons.items()))
        text = f"{failed} of {samples} samples could not be worked out, {count} of them: {first}"
        text += "; percentiles are those of the others, and yields count them as failing"
        yield Diagnostic("study", "", failed, 0.0, "1", text)
    yield from (own for own in table.warnings if own.kind == "proof")


def _notes(own: Sizes, nets: ScrambledNets, spreads: Sequence[QuantitySpread]) -> Iterator[str]:
    for name, group in zip(own.tolerances, own.groups, strict=True):
        if len(group) > 1:
            listed = ", ".join(own.sizes[k].name for k in group[:LISTED])
            yield f"{name}: {counted(len(group), 'size')}, {listed}" + (" and so on" if len(group) > LISTED else "")
    yield (
        f"{nets.samples} samples in {nets.scramblings} scrambled Sobol' replicates; intervals by Student's t over the "
        f"replicates where each has {FEWEST} samples beyond"
    )
    for spread in spreads:
        if spread.no_slope:
            yield f"{spread.text}: {spread.no_slope.removeprefix(f'{spread.text}: ')}; no share of each size is known"
        elif abs(spread.linear_deviation - spread.deviation) > FAR * max(spread.deviation, spread.linear_deviation):
            yield (
                f"{spread.text}: its standard deviation is {spread.deviation:.3g} {spread.unit}, by slopes alone "
                f"{spread.linear_deviation:.3g} {spread.unit}: it is far from linear in these tolerances"
            )
        ends = ((spread.worst_low, "lowest"), (spread.worst_high, "highest"))
        if open_ := " and ".join(word for end, word in ends if not end.is_vertex):
            yield f"{spread.text}: its {open_} value within the tolerances is only the furthest that was found"
