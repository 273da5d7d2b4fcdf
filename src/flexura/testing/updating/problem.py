"""The residuals of a calibration over its unknowns, and their derivatives.

Mechanisms that share parameters, each with the sensors that were on it; modes are tracked by their shapes while
parameters move.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import FlexuraError, OptionError, SolverError
from flexura.linalg import Eigenpairs, count_below
from flexura.mechanism import Mechanism, Parameter, bounds
from flexura.modal import track_modes
from flexura.records import Latest
from flexura.sensitivity import (
    ModelOrder,
    displacement_rows,
    family_of,
    first_columns,
    free_names,
    moved_clusters,
    static_vectors,
    whole_clusters,
)
from flexura.structure import Design, Plan, full_order_model, plan_of
from flexura.testing.rig import AnyFamily, MassLoadedFamily, placements_of, readings_of
from flexura.testing.updating.targets import ModalTarget, ResponseTarget, State, Target


@dataclass(frozen=True)
class Configuration:
    """A mechanism with what was measured on it, under a `label` that no other has.

    `bounded` has the parameters' bounds, `plan` has none. Of the parameters `free` are moved, `fixed` ones replaced.
    """

    label: str
    bounded: Plan
    plan: Plan
    free: tuple[str, ...]
    fixed: Mapping[str, float]
    targets: tuple[Target, ...]

    @property
    def known(self) -> Mapping[str, Parameter]:
        """All parameters by name."""
        return self.bounded.mechanism.parameters

    def point(self, values: Mapping[str, float]) -> dict[str, float]:
        """Parameters of a design with some values of free ones, of which there may be more."""
        return {**self.fixed, **{name: values[name] for name in self.free}}

    def settled(self, mechanism: Mechanism) -> Configuration:
        """The same with its ends settled anew at the sizes of a mechanism."""
        return replace(self, plan=_unbounded(plan_of(mechanism)))


def configurations(
    pairs: Sequence[tuple[Mechanism | Plan, Sequence[Target]]], free: Sequence[str], at: Mapping[str, float]
) -> tuple[Configuration, ...]:
    """Mechanisms with their targets, of which each has those of the parameters `free` and `at` that it knows.

    Raises ModelError for a description that cannot be used, and OptionError for parameters that none knows and a
    mechanism with nothing to move.
    """
    plans = [_plan(mechanism, at) for mechanism, _ in pairs]
    known = [plan.mechanism.parameters for plan in plans]
    chosen = list(free_names(plans[0], free) if len(plans) == 1 or isinstance(free, str) else free)
    for name in chosen:
        if not any(name in own for own in known):
            free_names(plans[0], [name])
    for name, value in at.items():
        if not any(name in own for own in known):
            plans[0].verify({name: value})
    found: list[Configuration] = []
    for plan, (_, targets), own in zip(plans, pairs, known, strict=True):
        names = [n for n in chosen if n in own]
        label = plan.mechanism.name
        if chosen and not names:
            raise OptionError(f"{label} has none of the free parameters {', '.join(chosen)}: it would add nothing")
        moved = free_names(plan, names)
        values = {n: v for n, v in at.items() if n in own}
        plan.verify(values)
        fixed = {n: v for n, v in values.items() if n not in moved}
        taken = {c.label for c in found}
        label = next(s for s in (label, *(f"{label} ({k})" for k in range(2, 99))) if s not in taken)
        found.append(Configuration(label, plan, _unbounded(plan), moved, fixed, tuple(targets)))
    return tuple(found)


def _unbounded(plan: Plan) -> Plan:
    """A plan whose parameters have no bounds: a search may look beyond them on its way."""
    plan.refuse_pose("calibration")
    own = plan.mechanism
    if all(p.minimum is None and p.maximum is None for p in own.parameters.values()):
        return plan
    free = {name: p.model_copy(update={"minimum": None, "maximum": None}) for name, p in own.parameters.items()}
    return Plan(own.model_copy(update={"parameters": free}))


def _plan(mechanism: Mechanism | Plan, at: Mapping[str, float]) -> Plan:
    """The plan of a mechanism, its solid members at those of the parameters `at` that it has."""
    if isinstance(mechanism, Mechanism):
        at = {name: value for name, value in at.items() if name in mechanism.parameters}
    plan = plan_of(mechanism, at)
    plan.refuse_pose("calibration")
    return plan


Prior = float | tuple[float, float]
"""A relative standard deviation, or mean and standard deviation in SI."""

PRINTED = 0.02
"""Relative standard deviation of a size whose source says paper, measured, drawing or datasheet."""

UNKNOWN = 0.3
"""Relative standard deviation of a parameter without bounds."""

BOUND_SPREAD = 2.0
"""Standard deviations from the middle of a prior to its bounds, of a parameter that has both."""

KNOWN_SOURCES = ("paper", "printed", "measured", "drawing", "datasheet", "data sheet")


@dataclass(frozen=True)
class Unknowns:
    """P parameters in standard coordinates z = (theta - mean)/deviation, theta = ln p where `is_log` (theory eq. K16).

    `mean`, `deviation`, `low` and `high` are of theta, `limits` (2, P) in SI; `reason` is the origin of each prior.
    """

    names: tuple[str, ...]
    is_log: NDArray[np.bool_]
    mean: Array
    deviation: Array
    low: Array
    high: Array
    start: Array
    limits: Array
    reason: tuple[str, ...]

    def theta(self, values: Array) -> Array:
        """theta (P,) of values in SI."""
        return np.where(self.is_log, np.log(np.where(self.is_log, values, 1.0)), values)

    def values(self, z: Array) -> Array:
        """Values (..., P) in SI of standard coordinates, within the limits."""
        theta = self.mean + self.deviation * z
        found = np.where(self.is_log, np.exp(np.where(self.is_log, theta, 0.0)), theta)
        return np.clip(found, *self.limits)

    def z(self, values: Array) -> Array:
        """Standard coordinates (P,) of values in SI."""
        return (self.theta(values) - self.mean) / self.deviation

    def slope(self, z: Array) -> Array:
        """dp/dz (P,)."""
        return self.deviation * np.where(self.is_log, self.values(z), 1.0)

    @property
    def z_bounds(self) -> tuple[Array, Array]:
        """Bounds in standard coordinates."""
        return (self.low - self.mean) / self.deviation, (self.high - self.mean) / self.deviation


def unknowns(
    configurations: Sequence[Configuration], at: Mapping[str, float], priors: Mapping[str, Prior] | None = None
) -> Unknowns:
    """The unknowns at a start, with priors: as given, else tight for what is known, else from the bounds.

    The middle of a prior is the start, or the nearest bound. Raises OptionError for priors and bounds without room, and
    for parameters that start elsewhere or have other bounds or units in another configuration.
    """
    names = list(dict.fromkeys(name for own in configurations for name in own.free))
    given = dict(priors or {})
    strange = sorted(set(given) - set(names))
    if strange:
        raise OptionError(f"a prior is given for {strange[0]}, which is not free; free are {', '.join(names)}")
    values = [own.bounded.parameter_values({n: at[n] for n in at if n in own.known}) for own in configurations]
    rows = []
    for name in names:
        shared = [(own, v) for own, v in zip(configurations, values, strict=True) if name in own.free]
        for own, v in shared[1:]:
            _refuse_unequal(name, *shared[0], own, v)
        rows.append(_row(shared[0][0].bounded, name, shared[0][1], given.get(name)))
    is_log, mean, deviation, low, high, start, limits, reason = zip(*rows, strict=True)
    m, d, a, b, x = (np.array(x, dtype=float) for x in (mean, deviation, low, high, start))
    return Unknowns(tuple(names), np.array(is_log), m, d, a, b, x, np.array(limits, dtype=float).T, tuple(reason))


def _refuse_unequal(
    name: str, first: Configuration, values: Mapping[str, Any], other: Configuration, others: Mapping[str, Any]
) -> None:
    """Raise OptionError for a shared parameter that is not the same in two configurations."""
    p, q = (own.known[name] for own in (first, other))
    if p.unit and q.unit and p.dimension != q.dimension:
        raise OptionError(f"{name} is in {p.unit} in {first.label}, and in {q.unit} in {other.label}")
    one = (float(values[name]), *(float(np.asarray(b)) for b in bounds(name, p, values)))
    two = (float(others[name]), *(float(np.asarray(b)) for b in bounds(name, q, others)))
    if not np.allclose(one, two, rtol=1e-9, atol=0.0):
        said = [f"{x[0]:g} within {x[1]:g} to {x[2]:g} in {own.label}" for x, own in ((one, first), (two, other))]
        raise OptionError(f"{name} is {' and '.join(said)} (SI): give what is moved together one start and one range")


def _row(
    plan: Plan, name: str, values: Mapping[str, object], prior: Prior | None
) -> tuple[bool, float, float, float, float, float, tuple[float, float], str]:
    parameter = plan.mechanism.parameters[name]
    start = float(values[name])  # type: ignore[arg-type]
    low, high = (float(np.asarray(b)) for b in bounds(name, parameter, values))  # type: ignore[arg-type]
    if not low < high:
        raise OptionError(f"{name} has no room between its bounds {low:g} and {high:g}")
    is_log = start > 0 and not low < 0 < high and (low >= 0 or not np.isfinite(low))
    with np.errstate(divide="ignore"):
        own = np.log([max(start, low), max(low, 0.0), high]) if is_log else np.array([start, low, high])
    theta, bottom, top = (float(x) for x in own)
    mean, deviation, reason = _prior(name, parameter.source, prior, theta, bottom, top, is_log, start)
    return is_log, mean, deviation, bottom, top, start, (low, high), reason


def _prior(
    name: str, source: str, prior: Prior | None, theta: float, low: float, high: float, is_log: bool, start: float
) -> tuple[float, float, str]:
    scale = 1.0 if is_log else abs(start) or 1.0
    if isinstance(prior, tuple | list):
        mean, deviation = (float(x) for x in prior)
        if not (np.isfinite(mean) and 0 < deviation < np.inf) or (is_log and mean <= 0):
            raise OptionError(f"the prior of {name} is a mean and a positive standard deviation, not {prior}")
        return (np.log(mean), deviation / mean, "given") if is_log else (mean, deviation, "given")
    if prior is not None:
        if not 0 < float(prior) < np.inf:
            raise OptionError(f"the prior of {name} is a positive relative standard deviation, not {prior}")
        return theta, float(prior) * scale, "given"
    if source.strip().lower().startswith(KNOWN_SOURCES):
        return theta, PRINTED * scale, f"known ({source.strip().split(',')[0].split(';')[0]})"
    if np.isfinite(low) and np.isfinite(high):
        return theta, (high - low) / (2 * BOUND_SPREAD), "bounds"
    return theta, UNKNOWN * scale, "no bounds"


EXTRA = 4
"""Modes computed beyond those compared, so that a mode that moves up in the order is still found."""

BEYOND = 2.0
"""Modes up to so many times the highest frequency of a response are in its modal sum."""


class TrackedModel:
    """The model under one load of sensors, compared with the targets that were measured with it.

    `rows` are those of each target's channels among all readings.
    """

    def __init__(
        self,
        plan: Plan,
        start: Mapping[str, float],
        targets: Sequence[Target],
        placements: Sequence[str],
        order: ModelOrder,
        keep: int | Mapping[str, int],
        reference: Array | None,
        tracked: bool,
    ) -> None:
        self._is_tracked, self._reference = tracked, reference
        channels = [c for t in targets for c in t.channels]
        readings = readings_of(full_order_model(Design.of(plan, start)), channels) if channels else []
        ends = np.cumsum([0, *(len(t.channels) for t in targets)])
        self.rows: list[slice] = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        bare = family_of(plan, order, start, keep, displacement_rows(readings))
        self.family: AnyFamily = MassLoadedFamily(bare, placements) if placements else bare
        self._has_responses = any(isinstance(t, ResponseTarget) for t in targets)
        self._has_shapes = bool(channels)
        model = self.family.model(start)
        self.compared: int = max([max(t.numbers) for t in targets if isinstance(t, ModalTarget)], default=0)
        self.count: int = self.compared + EXTRA
        for t in targets:
            if isinstance(t, ResponseTarget):
                limit = (2 * np.pi * BEYOND * float(t.hz.max())) ** 2
                self.count = max(self.count, count_below(model.K, model.M, limit) + EXTRA)
        self.count = min(self.count, model.order)
        self.weakest: float = 1.0
        """Least modal assurance criterion of a mode between one accepted design and the next."""
        self._mac = 1.0
        if reference is None:
            self.accept(self.state(start))

    @property
    def reference(self) -> Array | None:
        """Shapes (n, k) that modes are compared with."""
        return self._reference

    def state(self, at: Mapping[str, float], names: Sequence[str] = ()) -> State:
        """The model at a design, its modes tracked, with derivatives by named parameters.

        Raises FlexuraError when it cannot be solved.
        """
        model = self.family.model(at)
        pairs = whole_clusters(model.K, model.M, self.count)
        pairs, tracked = self._tracked(pairs, model.M)
        G = static_vectors(self.family, at) if self._has_responses else np.zeros((model.order, 0))
        vectors = np.hstack([pairs.vectors, G])
        Y = self.family.readings(at, pairs.vectors) if self._has_shapes else np.zeros((0, len(pairs.values)))
        changes = self.family.changes(at, names, vectors) if names else []
        for name, change in zip(names, changes, strict=True):
            if not change.is_smooth:
                raise SolverError(f"{name}: the design is at a kink, where nothing has a derivative by it")
        own = [first_columns(c, len(pairs.values)) for c in changes]
        moved = moved_clusters(model.K, model.M, pairs, own, shapes=self._has_shapes and bool(names))
        return State(self.family, dict(at), pairs, Y, tracked, G, moved, changes)

    def accept(self, state: State) -> None:
        """Take the modes of a design as those to track from now on."""
        self._reference = state.pairs.vectors[:, state.tracked].copy()
        self.weakest = min(self.weakest, self._mac)

    def _tracked(self, pairs: Eigenpairs, M: Any) -> tuple[Eigenpairs, NDArray[np.intp]]:
        """Which modes are those compared, and vectors of repeated frequencies turned to meet them."""
        if self._reference is None:
            return pairs, np.arange(min(self.compared, len(pairs.values)))
        found = track_modes(self._reference, pairs.values, pairs.vectors, M)
        self._mac = float(found.mac.min(initial=1.0))
        number = found.number if self._is_tracked else np.arange(len(found.number))
        return Eigenpairs(pairs.values, found.shapes), number


REFUSED = 1e4
"""Residual of a design that cannot be evaluated."""


class CalibrationProblem:
    """Weighted residuals of targets over standard coordinates z of the unknowns.

    Targets of one configuration that were measured with the sensors of the same placements share a model with their
    mass. Modes are those of the start, tracked by the modal assurance criterion from one accepted design to the next:
    the shapes at the last `jacobian` are those to compare with. Without `tracked` they are those of the same number.
    """

    def __init__(
        self,
        configurations: Sequence[Configuration],
        unknown: Unknowns,
        order: ModelOrder,
        keep: int | Mapping[str, int],
        references: Sequence[Array | None] | None = None,
        tracked: bool = True,
    ) -> None:
        self.configurations: tuple[Configuration, ...] = tuple(configurations)
        self.unknown = unknown
        self.targets: list[Target] = [t for own in configurations for t in own.targets]
        start = self._named(unknown.z(unknown.start))
        loads = [(own, placements_of(own.plan, t.setups)) for own in configurations for t in own.targets]
        keys = [(own.label, load) for own, load in loads]
        self._members = list(dict(zip(keys, loads, strict=True)).values())
        numbers = {key: g for g, key in enumerate(dict.fromkeys(keys))}
        self._group = [numbers[key] for key in keys]
        known = references or [None] * len(self._members)
        self.models: list[TrackedModel] = [
            TrackedModel(
                own.plan,
                own.point(start),
                [t for t, group in zip(self.targets, self._group, strict=True) if group == g],
                load,
                order,
                keep,
                reference,
                tracked,
            )
            for g, ((own, load), reference) in enumerate(zip(self._members, known, strict=True))
        ]
        """Each with the sensors of some placements, with their mean mass."""
        each = [iter(m.rows) for m in self.models]
        self.rows: list[slice] = [next(each[g]) for g in self._group]
        self.refused: str | None = None
        self.evaluations: int = 0
        self._latest: Latest[list[State]] = Latest()

    def _named(self, z: Array) -> dict[str, float]:
        """Values of the unknowns by name."""
        return dict(zip(self.unknown.names, map(float, self.unknown.values(z)), strict=True))

    def compared(self, z: Array) -> Iterator[tuple[Target, State, slice]]:
        """Every target with the model that it is compared with, and the rows of its channels.

        Raises FlexuraError when a model cannot be solved.
        """
        return self._with(self._states(z))

    def _with(self, states: Sequence[State]) -> Iterator[tuple[Target, State, slice]]:
        return zip(self.targets, (states[g] for g in self._group), self.rows, strict=True)

    def _states(self, z: Array) -> list[State]:
        def found() -> list[State]:
            values = self._named(z)
            self.evaluations += 1
            return [m.state(c.point(values)) for m, (c, _) in zip(self.models, self._members, strict=True)]

        return self._latest.get(np.asarray(z).tobytes(), found)

    @property
    def references(self) -> list[Array | None]:
        """Shapes (n, k) that modes of every model are compared with."""
        return [m.reference for m in self.models]

    @property
    def weakest(self) -> float:
        """Least modal assurance criterion of a mode between one accepted design and the next."""
        return min(m.weakest for m in self.models)

    def residual(self, z: Array) -> Array:
        """Weighted residuals (r,) of all targets; large ones for a design that cannot be evaluated."""
        try:
            found = np.concatenate([t.residual(state, r) for t, state, r in self.compared(z)])
            if np.isfinite(found).all():
                return found
            self.refused = "a residual that is not finite"
        except (FlexuraError, np.linalg.LinAlgError) as error:
            self.refused = str(error)
        return np.full(self.size, REFUSED)

    def jacobian(self, z: Array) -> Array:
        """d residual / dz (r, P); the modes found here are those tracked from now on."""
        values = self._named(z)
        self.evaluations += 1
        states = [m.state(c.point(values), c.free) for m, (c, _) in zip(self.models, self._members, strict=True)]
        found = []
        for (t, state, rows), g in zip(self._with(states), self._group, strict=True):
            own = t.jacobian(state, rows)
            wide = np.zeros((len(own), len(self.unknown.names)))
            wide[:, [self.unknown.names.index(n) for n in self._members[g][0].free]] = own
            found.append(wide)
        for model, state in zip(self.models, states, strict=True):
            model.accept(state)
        self._latest.clear()
        return np.concatenate(found) * self.unknown.slope(z)

    @property
    def size(self) -> int:
        """Number of residuals."""
        count = 0
        for t in self.targets:
            if isinstance(t, ModalTarget):
                count += len(t.frequency_hz) * (1 + (len(t.channels) if t.shapes is not None else 0))
            else:
                count += 2 * t.sigma.size
        return count
