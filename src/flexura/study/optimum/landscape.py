"""A goal and its limits over the unit cube of the variables, and the conditions of an optimum there: each design worked
out once, failures kept in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.linalg import null_space

from flexura.arrays import Array, Bools, Index
from flexura.deadline import checkpoint
from flexura.errors import FlexuraError
from flexura.study.optimum.rows import Designs, Point, Row

DECADE = 10.0
"""A range whose ends are of one sign and so many times apart is scaled by its logarithm."""

MOST_KEPT = 256
"""Designs with slopes that are kept."""


@dataclass(frozen=True)
class Box:
    """P variables by name, between `low` and `high` (P,), SI; positions z (..., P) in it go from 0 to 1."""

    names: tuple[str, ...]
    low: Array
    high: Array

    @property
    def by_logarithm(self) -> Bools:
        """Which variables are scaled by their logarithm (P,)."""
        return (self.low > 0) & (self.high >= DECADE * self.low)

    @property
    def _ratio(self) -> Array:
        """High over low, of those that are scaled by their logarithm; e of the others (P,)."""
        return np.where(self.by_logarithm, self.high, np.e) / np.where(self.by_logarithm, self.low, 1.0)

    def values(self, z: Array) -> Array:
        """SI values (..., P) at positions; those at a bound are the bound itself."""
        z = np.clip(z, 0.0, 1.0)
        x = np.where(self.by_logarithm, self.low * self._ratio**z, self.low + z * (self.high - self.low))
        return np.where(z == 0, self.low, np.where(z == 1, self.high, np.clip(x, self.low, self.high)))

    def positions(self, x: Array) -> Array:
        """Positions (..., P) of SI values, those outside at the bound that they are beyond."""
        x = np.clip(x, self.low, self.high)
        over = np.where(self.by_logarithm, x, 1.0) / np.where(self.by_logarithm, self.low, 1.0)
        linear = (x - self.low) / (self.high - self.low)
        return np.where(self.by_logarithm, np.log(over) / np.log(self._ratio), linear)

    def rates(self, z: Array) -> Array:
        """dx/dz (P,) at a position."""
        return np.where(self.by_logarithm, self.values(z) * np.log(self._ratio), self.high - self.low)


Judged = tuple[Array, Array]
"""Goals (N,) and violations (N,) of designs, over their scales, NaN where one failed."""


class FailedDesign(Exception):  # noqa: N818  it is passed from a function to whoever searches, and never to a user
    """A design that has no answer, at a position `z`."""

    def __init__(self, z: Array) -> None:
        self.z = z
        super().__init__("a design failed")


@dataclass(frozen=True)
class Sample:
    """A design: position `z` (P,), quantities, versions of the goal (c,) and of the limits (l,) with their gradients
    (c, P) and (l, P) by position; `limit` (l,) is the number of the limit of each version."""

    z: Array
    point: Point
    goals: Array
    goal_slopes: Array
    margins: Array
    margin_slopes: Array
    limit: Index

    @cached_property
    def goal(self) -> float:
        """What is to be as large as can be, over its scale."""
        return float(self.goals.min())

    @cached_property
    def violation(self) -> float:
        """How far the worst limit is missed, over its scale; 0 where all are met."""
        return float(max(-self.margins.min(initial=0.0), 0.0))


DECIMALS = 10
"""Of a position in the box: designs nearer than that are one, for which methods at a bound ask again and again."""


def settled(z: Array) -> Array:
    """The position (P,) in the box of the design that is asked for at another one."""
    return np.asarray(np.round(np.clip(np.asarray(z, dtype=float), 0.0, 1.0), DECIMALS), dtype=float)


@dataclass
class Landscape:
    """A goal and limits of designs in a box; counts the `evaluations` of a design with its slopes and the designs
    whose `values` alone were asked for, and collects why designs failed."""

    designs: Designs
    box: Box
    goal: Row
    limits: Sequence[Row] = ()
    evaluations: int = 0
    tried: int = 0
    failures: Counter[str] = field(default_factory=Counter)
    _latest: dict[bytes, Sample] = field(default_factory=dict)

    def at(self, z: Array) -> Sample:
        """The design at a position. Raises FailedDesign."""
        z = settled(z)
        key = z.tobytes()
        if key not in self._latest:
            checkpoint()
            if len(self._latest) > MOST_KEPT:
                self._latest.clear()
            self._latest[key] = self._sample(z)
        return self._latest[key]

    def _sample(self, z: Array) -> Sample:
        self.evaluations += 1
        try:
            point = self.designs.point(self.box.values(z))
        except FlexuraError as error:
            self.failures[str(error)] += 1
            raise FailedDesign(z) from None
        if not (np.isfinite(point.value).all() and np.isfinite(point.slope).all()):
            self.failures["a quantity, or its derivative, is not finite"] += 1
            raise FailedDesign(z)
        rate = self.box.rates(z)
        with np.errstate(all="ignore"):
            goals, goal_slopes, _ = self._versions([self.goal], point, rate)
            margins, margin_slopes, limit = self._versions(self.limits, point, rate)
        if not all(np.isfinite(numbers).all() for numbers in (goals, goal_slopes, margins, margin_slopes)):
            self.failures["the goal or a limit, or its derivative, is not finite"] += 1
            raise FailedDesign(z)
        return Sample(z, point, goals, goal_slopes, margins, margin_slopes, limit)

    def _versions(self, rows: Sequence[Row], point: Point, rate: Array) -> tuple[Array, Array, Index]:
        """Values (v,) and gradients (v, P) of all versions of rows, and the number (v,) of the row of each."""
        versions = [(k, version) for k, row in enumerate(rows) for version in row.versions(point.value)]
        values = [float(row.values(point.value[places])) for _, (row, places) in versions]
        slopes = [row.gradient(point, places) * rate for _, (row, places) in versions]
        numbers = np.array([k for k, _ in versions], dtype=np.intp)
        return np.array(values), np.array(slopes).reshape(len(versions), len(rate)), numbers

    def many(self, x: Array) -> Judged:
        """Goals (N,) and violations (N,) of designs (N, P), SI, NaN where one failed."""
        checkpoint()
        return self.judged(*self.designs.values(x))

    def judged(self, quantities: Array, reasons: Sequence[str]) -> Judged:
        """Goals (N,) and violations (N,) of quantities (N, q), NaN where there is a reason."""
        self.tried += len(quantities)
        self.failures.update(reason for reason in reasons if reason)
        with np.errstate(invalid="ignore"):
            goals = self.goal.values(quantities)
            margins = [row.values(quantities) for row in self.limits] or [np.ones(len(quantities))]
        return goals, np.maximum(-np.min(margins, axis=0), 0.0)


ACTIVE = 1e-4
"""Margin of a limit, over its scale, and distance from a bound, of its range, up to which they may hold a design."""

FLAT_GRADIENT = 1e-2
"""Gradient of a goal, over its scale, from which on its residual is taken relative to it."""

SETTLED_RESIDUAL = 1e-7
"""Residual up to which a search from a design finds nothing better."""

SETTLED_GAP = 1e-10
"""What a goal may gain, over its scale, where a search ends."""

NO_WEIGHT = 1e-6
"""Weight of a gradient, over the goal's, up to which it has no part in the conditions of an optimum."""

SUM_OF_WEIGHTS = 1e3
"""Weight of the condition that the weights of the goal's versions add up to 1."""

BETWEEN = -1
"""In place of the number of a version: of a direction between frequencies that coincide."""

ANGLES = 16
"""Directions of the space of two frequencies that coincide for which their derivatives are taken."""

CURVATURE_STEP = 1e-4
"""Step of positions over which gradients are differenced."""


@dataclass(frozen=True)
class Stationarity:
    """Multipliers of a design, over scales and by position: of `limits` (l,), of the bounds `low` and `high` (P,).

    `active` are the numbers of limits that hold with equality; `residual` is what remains of the goal's gradient by
    scaled position, over that gradient or over `FLAT_GRADIENT`, whichever is larger (Karush 1939; Kuhn and Tucker
    1951). `coalesced` says that more than one version of the goal has weight; `held` (h, P) are gradients of what must
    not change to first order. The Lagrangian is version `goal` of the goal and those of the limits (v,) times
    `weights`; `is_smooth` says that it is, with no direction of a space of repeated frequencies in it. `gap` is what
    the goal would gain, over its scale, if what holds the design held it exactly.
    """

    limits: Array
    low: Array
    high: Array
    active: tuple[int, ...]
    residual: float
    coalesced: bool
    held: Array
    goal: int
    weights: Array
    is_smooth: bool
    gap: float

    @property
    def is_settled(self) -> bool:
        """Whether the conditions hold to so many digits that a search has no more to find."""
        return self.is_smooth and self.residual <= SETTLED_RESIDUAL and self.gap <= SETTLED_GAP


def stationarity(land: Landscape, sample: Sample) -> Stationarity:
    """Multipliers from non-negative least squares (Lawson and Hanson 1974) on the exact gradients.

    The gradients of a frequency that is repeated are those of every direction of its space (Seyranian, Lund and Olhoff
    1994, "Multiple eigenvalues in structural optimization problems").
    """
    from scipy.optimize import nnls

    z, P = sample.z, len(sample.z)
    leading, goals = _gradients(land, sample, land.goal, sample.goals - sample.goal, sample.goal_slopes)
    owners, versions, rows = list[int](), list[int](), list[Array]()
    for k, limit in enumerate(land.limits):
        of_limit = np.flatnonzero(sample.limit == k)
        near, gradients = _gradients(land, sample, limit, sample.margins[of_limit], sample.margin_slopes[of_limit])
        versions += [*of_limit[near], *[BETWEEN] * (len(gradients) - len(near))]
        owners += [k] * len(gradients)
        rows += gradients
    at_low, at_high = np.flatnonzero(z <= ACTIVE), np.flatnonzero(z >= 1 - ACTIVE)
    eye, count = np.eye(P), len(goals)
    columns = np.array([*goals, *rows, *eye[at_low], *-eye[at_high]]).T
    size = max(max((float(np.abs(g).max(initial=0.0)) for g in goals), default=0.0), 1e-300)
    lengths = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    lengths[:count] = size
    A = np.vstack([columns / lengths, SUM_OF_WEIGHTS * (np.arange(columns.shape[1]) < count)])
    weights, _ = nnls(A, np.append(np.zeros(P), SUM_OF_WEIGHTS), maxiter=100 * A.shape[1])
    weights = weights / max(weights[:count].sum(), 1e-300) * size / lengths
    residual = float(np.linalg.norm(columns @ weights)) / max(FLAT_GRADIENT, *(float(np.linalg.norm(g)) for g in goals))
    of_goals, of_rows, of_low, of_high = np.split(weights, np.cumsum([count, len(rows), len(at_low)]))
    limits, low, high = np.zeros(len(land.limits)), np.zeros(P), np.zeros(P)
    np.add.at(limits, owners, of_rows)
    low[at_low], high[at_high] = of_low, of_high
    version = np.array(versions, dtype=np.intp)
    is_between = version == BETWEEN
    of_versions = np.zeros(len(sample.margins))
    of_versions[version[~is_between]] = of_rows[~is_between]
    has_weight = weights * lengths > NO_WEIGHT * size
    held = columns[:, has_weight & (np.arange(len(weights)) >= count)].T
    pulling = [g for g, pulls in zip(goals, has_weight[:count], strict=True) if pulls]
    coalesced, top = len(pulling) > 1, int(np.argmax(of_goals))
    if coalesced:
        held = np.vstack([held, [g - pulling[0] for g in pulling[1:]]])
    is_mixed = has_weight[count : count + len(rows)][is_between].any()
    return Stationarity(
        limits=limits,
        low=low,
        high=high,
        active=tuple(dict.fromkeys(owners)),
        residual=residual,
        coalesced=coalesced,
        held=held,
        goal=int(leading[min(top, len(leading) - 1)]),
        weights=of_versions,
        is_smooth=not (coalesced or top >= len(leading) or is_mixed),
        gap=float(np.abs(of_versions @ sample.margins) + low @ z + high @ (1 - z)),
    )


def _gradients(land: Landscape, sample: Sample, row: Row, gaps: Array, slopes: Array) -> tuple[Index, list[Array]]:
    """The versions of a row that are near their bound, their gradients, and those of what lies between those whose
    frequencies coincide."""
    near = np.flatnonzero(gaps <= ACTIVE)
    gradients = [slopes[k] for k in near]
    if len(near) and sample.point.repeated:
        versions = row.versions(sample.point.value)
        for part in row.parts or (row,):
            if any(versions[k].row is part for k in near):
                gradients += [slope * land.box.rates(sample.z) for slope in _between(part, sample.point)]
    return near, gradients


def _between(row: Row, point: Point) -> Iterator[Array]:
    """Gradients (P,) of a row for directions of the spaces of frequencies that coincide."""
    partial = row.function.slope(point.value) / row.scale
    for group, matrices in zip(point.repeated, point.directional, strict=True):
        for frequency in row.frequencies:
            if (place := frequency.beside(0)) in group:
                others = partial.copy()
                others[place] = 0.0
                rest = others @ point.slope
                for v in _directions(len(group)):
                    yield rest + partial[place] * np.einsum("i,ijp,j->p", v, matrices, v)


def _directions(m: int) -> list[Array]:
    """Unit vectors of a space of m dimensions: axes, and in every plane of two of them directions between."""
    axes = np.eye(m)
    angles = np.pi * np.arange(1, ANGLES) / ANGLES
    return [*axes, *(np.cos(a) * axes[i] + np.sin(a) * axes[j] for i in range(m) for j in range(i) for a in angles)]


def upward(land: Landscape, sample: Sample, conditions: Stationarity) -> tuple[float, Array | None]:
    """The greatest curvature of the Lagrangian along what the active limits leave free, and its direction (P,).

    At a maximum it is not positive (Fletcher 1987, "Practical methods of optimization", section 9.3); gradients are
    differenced. None where nothing is left free, where the goal is not smooth, or where a design nearby failed.
    """
    held = conditions.held
    free = null_space(held, rcond=1e-8) if len(held) else np.eye(len(sample.z))
    if not free.shape[1] or not conditions.is_smooth:
        return 0.0, None

    def change(direction: Array) -> Array:
        """Of the gradient of the Lagrangian, per unit of a direction."""
        ahead, behind = (land.at(sample.z + side * CURVATURE_STEP * direction) for side in (1.0, -1.0))
        of_ahead, of_behind = (
            design.goal_slopes[conditions.goal] + conditions.weights @ design.margin_slopes
            for design in (ahead, behind)
        )
        step = ahead.z @ direction - behind.z @ direction
        return (of_ahead - of_behind) / step if step > 0 else np.zeros(len(sample.z))

    try:
        H = free.T @ np.array([change(direction) for direction in free.T]).T
    except FailedDesign:
        return 0.0, None
    values, vectors = np.linalg.eigh((H + H.T) / 2)
    return float(values[-1]), free @ vectors[:, -1]
