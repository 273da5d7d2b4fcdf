"""Natural frequencies of many designs at once, each with a proven interval."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener, Progress
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.full_order import assemble, plan_of
from flexura.mechanism import Mechanism
from flexura.reduction.arrow_bounds import arrow_bounds
from flexura.reduction.assembly import (
    ImpossibleDesignError,
    independent_stacks,
    named,
    one_of,
    refuse_turned,
    some_of,
    stacks,
)
from flexura.reduction.batch_bounds import RIGID_FREQUENCY, ChainBounds, chain_bounds
from flexura.reduction.branches import Arrow
from flexura.reduction.certificates import HERTZ, certificate, lowest_pairs
from flexura.reduction.chain_assembler import ChainAssembler, ChainKind, chain_assembler
from flexura.reduction.chained_model import chained
from flexura.results import Tabular
from flexura.structure import Design, Plan
from flexura.tables import Item, Table, counted, percent

LARGEST_STACKED = 160
"""Coordinates beyond which a design by itself, of full order and sparse, is quicker than dense matrices of a stack."""

SAMPLED_DESIGNS = 3
"""Designs of a stack, beside the default one, for which the kept modes must be enough."""

HEADROOM = 0.25
"""Part of the tolerance that default design and samples must meet."""

SLOW_CHAINS = 0.4
"""Modes of chains are kept until none that is left out lies below the highest squared frequency asked for over this."""

CHOOSING_ROUNDS = 40

MOST_SHOWN = 3
"""Parameters, and frequencies, of each design that a notebook shows."""


@dataclass(frozen=True, repr=False)
class NaturalFrequencies(Tabular):
    """Natural frequencies of one design (count,) or of many (designs, count), Hz, with proven intervals.

    `lower_hz` and `upper_hz` enclose the frequency of the same number, counted from the lowest, of the full-order model
    of each design, and `frequency_hz` lies between them. `is_proven` (designs,), or a single truth value, says where
    every interval is as narrow as `tolerance`, relative, so that no mode is missing; elsewhere it is as wide as it is.
    `kept_modes` says how many fixed-interface modes of the chains of each substructure were used.
    """

    frequency_hz: Array
    lower_hz: Array
    upper_hz: Array
    is_proven: NDArray[np.bool_]
    tolerance: float
    kept_modes: Mapping[str, int]
    plan: Plan = field(repr=False, compare=False)
    parameters: Mapping[str, ArrayLike] = field(repr=False, compare=False)

    @property
    def missed(self) -> NDArray[np.intp]:
        """Numbers of the designs that missed the tolerance, or may lack a mode."""
        return np.flatnonzero(~np.atleast_1d(self.is_proven))

    @property
    def error_bound(self) -> Array:
        """Proven bound, shaped like the frequencies, on the relative distance of each from that of the full order."""
        return _error_bound(self.frequency_hz, self.lower_hz, self.upper_hz)

    @cached_property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """One, when designs miss the tolerance or may lack a mode."""
        missed = self.missed
        if not len(missed):
            return ()
        bounds = np.atleast_2d(self.error_bound)
        worst = int(bounds.max(axis=1).argmax())
        text = (
            f"{len(missed)} of {len(bounds)} designs are not proven within {self.tolerance:g}: resolved() solves them"
        )
        return (Diagnostic("tolerance", f"design {worst}", float(bounds[worst].max()), self.tolerance, "1", text),)

    def _data(self) -> dict[str, Any]:
        return {"name": self.plan.name, **super()._data(), "parameters": self.parameters, "missed": self.missed}

    def _title(self) -> str:
        return f"{counted(len(np.atleast_2d(self.frequency_hz)), 'design')} of {self.plan.name}"

    def presentation(self) -> Iterator[Item]:
        hz, bound = np.atleast_2d(self.frequency_hz), np.atleast_2d(self.error_bound)
        units = {name: parameter.unit or "SI" for name, parameter in self.plan.mechanism.parameters.items()}
        given = {f"{name} [{units[name]}]": np.ravel(values) for name, values in self.parameters.items()}
        varied = {name: values for name, values in given.items() if len(values) == len(hz) > 1}
        columns = {"design": range(len(hz)), **dict(islice(varied.items(), MOST_SHOWN))}
        columns |= {f"f{k + 1} [Hz]": hz[:, k] for k in range(min(hz.shape[1], MOST_SHOWN))}
        yield Table({**columns, "proven within": [percent(worst) for worst in bound.max(axis=1)]}, "designs")

    def _columns(self) -> dict[str, Any]:
        """A row for each frequency of each design."""
        designs, count = np.atleast_2d(self.frequency_hz).shape
        return {
            "design": np.repeat(np.arange(designs), count),
            "mode": np.tile(np.arange(1, count + 1), designs),
            "frequency [Hz]": self.frequency_hz.ravel(),
            "lower [Hz]": self.lower_hz.ravel(),
            "upper [Hz]": self.upper_hz.ravel(),
            "is proven": np.repeat(np.atleast_1d(self.is_proven), count),
        }

    def resolved(self, progress: Listener | None = None) -> NaturalFrequencies:
        """The same with every missed design solved by itself, of full order, and certified.

        Designs that miss the tolerance even so stay in `missed`. Raises ModelError and SolverError for a design that
        cannot be solved.
        """
        missed = self.missed
        count = self.frequency_hz.shape[-1]
        shape = self.frequency_hz.shape
        f, low, up = (A.reshape(-1, count).copy() for A in (self.frequency_hz, self.lower_hz, self.upper_hz))
        for done, d in enumerate(missed):
            f[d], low[d], up[d] = _alone(self.plan, one_of(self.parameters, int(d)), count)
            if progress is not None:
                progress(Progress("designs by themselves", done + 1, len(missed)))
        proven = _is_proven(f, low, up, self.tolerance)
        return replace(
            self,
            frequency_hz=f.reshape(shape),
            lower_hz=low.reshape(shape),
            upper_hz=up.reshape(shape),
            is_proven=proven.reshape(np.shape(self.is_proven)),
        )

    def __repr__(self) -> str:
        designs, count = np.atleast_2d(self.frequency_hz).shape
        missed = len(self.missed)
        said = f"all proven within {self.tolerance:g}"
        if missed:
            said = f"{missed} of {designs} NOT proven within {self.tolerance:g}: resolved() solves them one by one"
        return f"<NaturalFrequencies: {count} of {designs} design{'s' if designs != 1 else ''}, {said}>"


@verb
def natural_frequencies(
    model: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    n: int = 6,
    tolerance: float = 1e-3,
    progress: Listener | None = None,
) -> NaturalFrequencies:
    """The `n` lowest natural frequencies, Hz, of one design or of many, each with a proven interval.

    Parameters may be arrays over designs. Every chain of elements is reduced to its ends, and fixed-interface modes of
    chains are kept until the intervals of the default design and of a few others are within `tolerance`, relative. The
    intervals are those of the full-order model of each design, number by number, round-off included (theory eqs.
    N1-N16). Designs for which they are wider are not hidden: the result says which, and `resolved()` solves them one by
    one. `progress` is told of every stack of designs. Mechanisms with many coordinates between chains are solved one by
    one from the start. Raises OptionError, with the design where one has a size that has gone through zero, and
    ModelError and SolverError.
    """
    plan = plan_of(model, parameters)
    values = plan.values(parameters)
    plan.refuse_loads("frequencies of many designs", values)
    refuse_turned(plan, values, parameters or {})
    if n < 1:
        raise OptionError(f"the number of frequencies is at least 1, not {n}")
    if not (np.isfinite(tolerance) and 0 < tolerance < 1):
        raise OptionError(f"tolerance is a relative error between 0 and 1, such as 1e-3, not {tolerance}")
    given = dict(parameters or {})
    many = values if values.ndim > 1 else values[None]
    count = min(n, plan.topology.n_dof)
    batch = _Batch(plan, many, count, tolerance, given)
    bounds = np.empty((3, len(many), count))
    for designs in stacks(len(many), batch.chains.order if batch.is_stacked else None):
        bounds[:, designs] = batch(many, designs)
        if progress is not None:
            progress(Progress("designs", designs.stop, len(many)))
    f, lower, upper = bounds if values.ndim > 1 else bounds[:, 0]
    proven = _is_proven(f, lower, upper, tolerance)
    return NaturalFrequencies(f, lower, upper, proven, tolerance, batch.kept_modes, plan, given)


def independent_frequencies(
    plan: Plan, parameters: Mapping[str, ArrayLike], *, n: int, tolerance: float = 1e-3
) -> tuple[Array, Array, Array]:
    """Frequencies of designs and their lower and upper bounds (designs, n), Hz, as `natural_frequencies` finds them, to
    the last bit the same whatever other designs stand beside one.

    The default design alone says how many modes are kept, and stacks are filled up to one size. Designs that miss the
    tolerance are solved by themselves, first with as many kept modes as they need, then of full order. Raises as
    `natural_frequencies`.
    """
    given, all_values = dict(parameters), np.atleast_2d(plan.values(parameters))
    plan.refuse_loads("frequencies of many designs", all_values)
    refuse_turned(plan, all_values, given)
    batch = _Batch(plan, all_values, n, tolerance, given, samples=0)
    bounds = np.empty((3, len(all_values), n))
    if batch.is_stacked:
        for used, values, batch.parameters in independent_stacks(plan, given):
            answer = batch(values, slice(0, len(values)))
            bounds[:, used] = [bound[: used.stop - used.start] for bound in answer]
    else:
        for used in stacks(len(all_values)):
            bounds[:, used] = batch(all_values, used)
    for d in np.flatnonzero(~_is_proven(bounds[0], bounds[1], bounds[2], tolerance)):
        alone = natural_frequencies(plan, one_of(given, int(d)), n=n, tolerance=tolerance).resolved()
        bounds[:, d] = alone.frequency_hz, alone.lower_hz, alone.upper_hz
    return bounds[0], bounds[1], bounds[2]


def kept_chains(plan: Plan, n: int, tolerance: float = 1e-3) -> ChainAssembler | None:
    """The chains of a plan with as many kept modes as `n` frequencies of the default design need; None where designs
    by themselves are quicker, or something can move freely."""
    batch = _Batch(plan, np.empty((0, len(plan.values()))), n, tolerance, {}, samples=0)
    is_held = batch.is_stacked and bool((batch.chains.start(n).values > 0).all())
    return batch.chains if is_held else None


class _Recent(NamedTuple):
    """What was last looked at to choose how many modes are kept: the chains, the number of the design, its matrices,
    and its bounds where they are well within the tolerance."""

    chains: ChainAssembler
    number: int
    arrow: Arrow
    bounds: ChainBounds | None = None


class _Batch:
    """Designs evaluated with as many kept modes as a default design and samples of the others need."""

    def __init__(
        self,
        plan: Plan,
        values: Array,
        count: int,
        tolerance: float,
        parameters: Mapping[str, ArrayLike],
        *,
        samples: int = SAMPLED_DESIGNS,
    ) -> None:
        self.plan, self.count, self.tolerance, self.parameters = plan, count, tolerance, parameters
        chains = chain_assembler(plan)
        self.is_stacked = False
        self.counts = dict.fromkeys(chains.forces, 0)
        self._recent: _Recent | None = None
        self._use(self.counts)
        if chains.order <= LARGEST_STACKED:
            self._use(plan.prepared.once(("kept modes", count, tolerance), self._chosen))
            sampled = np.unique(np.linspace(0, len(values) - 1, samples if len(values) else 0).astype(np.intp))
            if len(sampled) > 1 and self._are_enough(values, sampled):
                sampled = sampled[:0]
            for d in sampled:
                self._choose(self._designs(values, slice(d, d + 1)), int(d))
            self.is_stacked = self._is_searchable

    def _chosen(self) -> dict[ChainKind, int]:
        """Kept modes that the default design needs."""
        self._choose(Design.of(self.plan).stacked())
        return self.counts

    def _use(self, counts: dict[ChainKind, int]) -> None:
        self.counts, self.chains = dict(counts), chain_assembler(self.plan, counts)

    def _designs(self, values: Array, designs: slice) -> Design:
        """Some designs of all."""
        return Design.at(self.plan, values[designs], some_of(self.parameters, designs))

    def _are_enough(self, values: Array, sampled: NDArray[np.intp]) -> bool:
        """Whether the intervals of some designs are well within the tolerance with the modes that are kept."""
        if not self._is_searchable:
            return False
        given = {name: np.ravel(v)[sampled] if np.ndim(v) else v for name, v in self.parameters.items()}
        try:
            arrow = self.chains(Design.at(self.plan, values[sampled], given))
        except ImpossibleDesignError:
            return False  # told with its number, one by one
        tolerance = HEADROOM * self.tolerance
        return bool(_is_proven(*_hertz(self._bounds(arrow, tolerance)), tolerance).all())

    def _choose(self, design: Design, number: int | None = None) -> None:
        """Keep more modes of the slowest chains until the intervals of a design, the default one or that of a number,
        are well within the tolerance."""
        for _ in range(CHOOSING_ROUNDS):
            arrow, top = self._assembled(design, number or 0), np.inf
            if number is not None:
                self._recent = _Recent(self.chains, number, arrow)
            if self._is_searchable:
                bounds = self._bounds(arrow, HEADROOM * self.tolerance)
                if _is_proven(*_hertz(bounds), HEADROOM * self.tolerance).all():
                    self._recent = self._recent and self._recent._replace(bounds=bounds)
                    return
                top = float(bounds.upper[0, -1])
            slow = {kind: s for kind, s in arrow.slow.items() if self.counts[kind] < self.chains.most(kind)}
            least = min(SLOW_CHAINS / top, max(slow.values(), default=0.0) / 2)
            more = {kind: n + (slow.get(kind, 0.0) > least) for kind, n in self.counts.items()}
            if more == self.counts or self.chains.order_with(more) > LARGEST_STACKED:
                return
            self._use(more)

    @property
    def _is_searchable(self) -> bool:
        """Whether the default design has as many frequencies as are asked for, and not zeros alone."""
        if self.chains.order < self.count:
            return False
        values = self.chains.start(self.count).values
        return bool(np.isfinite(values).all() and (values > 0).any())

    @property
    def kept_modes(self) -> dict[str, int]:
        """Kept modes of the chains of every substructure."""
        kept = dict.fromkeys((name or "mechanism" for name, _ in self.counts), 0)
        for (name, _), forces in self.chains.forces.items():
            kept[name or "mechanism"] += forces.shape[0] * forces.shape[-1]
        return kept

    def _assembled(self, design: Design, first: int) -> Arrow:
        try:
            return self.chains(design)
        except ImpossibleDesignError as error:
            raise named(error, first, self.parameters) from None

    def _bounds(self, arrow: Arrow, tolerance: float) -> ChainBounds:
        """Bounds on the squared frequencies of a stack: branch by branch where these alone are much stiffer, and
        in one matrix for designs for which that does not prove enough."""
        if not self.chains.is_arrow(self.count):
            return chain_bounds(arrow.dense, self.count, self.chains.start(self.count), tolerance)
        rigid = int((self.chains.start(self.count).values <= 0).sum())
        bounds = arrow_bounds(arrow, self.count, rigid, tolerance)
        missed = np.flatnonzero(~_is_proven(*_hertz(bounds), tolerance))
        if len(missed):
            dense = chain_bounds(arrow.take(missed).dense, self.count, self.chains.start(self.count), tolerance)
            bounds.lower[missed], bounds.upper[missed] = dense.lower, dense.upper
            bounds.best[missed], bounds.zero[missed] = dense.best, dense.zero
        return bounds

    def __call__(self, values: Array, designs: slice) -> tuple[Array, Array, Array]:
        """Frequencies, lower and upper bounds (designs, count), Hz, of the designs of a stack."""
        if self.is_stacked:
            recent = self._recent
            if recent is None or recent[:2] != (self.chains, designs.start) or designs.stop - designs.start > 1:
                arrow = self._assembled(self._designs(values, designs), designs.start)
                recent = _Recent(self.chains, designs.start, arrow)
            bounds = _hertz(recent.bounds or self._bounds(recent.arrow, self.tolerance))
            for d in np.flatnonzero(~np.isfinite(bounds[1:]).all(axis=(0, 2))):
                with suppress(SolverError):  # stays without an upper bound, and unproven
                    alone = _alone(self.plan, one_of(self.parameters, designs.start + int(d)), self.count)
                    for bound, value in zip(bounds, alone, strict=True):
                        bound[d] = value
            return bounds
        solved = [_alone(self.plan, one_of(self.parameters, d), self.count) for d in range(designs.start, designs.stop)]
        f, low, up = (np.array(column) for column in zip(*solved, strict=True))
        return f, low, up


def _hertz(bounds: ChainBounds) -> tuple[Array, Array, Array]:
    """Frequencies, lower and upper bounds, Hz."""
    lower, upper, best = (np.sqrt(b) / HERTZ for b in (bounds.lower, bounds.upper, bounds.best))
    return np.where(bounds.zero, 0.0, best), lower, upper


def _alone(plan: Plan, parameters: dict[str, float], count: int) -> tuple[Array, Array, Array]:
    """Frequencies, lower and upper bounds (count,), Hz, of one design, of full order."""
    full = chained(assemble(plan, parameters))
    pairs = lowest_pairs(full, count)
    proof = certificate(full, pairs, count)
    lower = np.where(proof.is_indexed, proof.lower_hz, 0.0)[:count]
    upper = np.where(proof.is_indexed, proof.upper_hz, proof.frequency_hz)[:count]
    f = np.clip(proof.frequency_hz[:count], lower, upper)
    elastic = np.sqrt(pairs.values[pairs.values > 0].min(initial=np.inf)) / HERTZ
    return np.where((f == 0) & (upper > RIGID_FREQUENCY * elastic), upper, f), lower, upper


def _error_bound(f: Array, lower: Array, upper: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.maximum(upper - f, f - lower) / lower
    return np.where(f == 0, 0.0, np.where(lower > 0, off, np.inf))


def _is_proven(f: Array, lower: Array, upper: Array, tolerance: float) -> NDArray[np.bool_]:
    """Whether every frequency of each design is within the tolerance; zeros have been proven to be zero."""
    return np.asarray((_error_bound(f, lower, upper) <= tolerance).all(axis=-1))
