"""A goal and its limits over the unit cube of the variables, and the conditions of an optimum there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.errors import FlexuraError
from flexura.study.optimum.rows import Designs, Point, Row

DECADE = 10.0
"""A range whose ends are of one sign and so many times apart is scaled by its logarithm."""


@dataclass(frozen=True)
class Box:
    """P variables by name, between `low` and `high` (P,), SI; positions z (..., P) in it go from 0 to 1."""

    names: tuple[str, ...]
    low: Array
    high: Array

    @property
    def by_logarithm(self) -> NDArray[np.bool_]:
        """Which variables are scaled by their logarithm (P,)."""
        return (self.low > 0) & (self.high >= DECADE * self.low)

    def values(self, z: Array) -> Array:
        """SI values (..., P) at positions; those at a bound are the bound itself."""
        z = np.clip(z, 0.0, 1.0)
        low, high = np.where(self.by_logarithm, self.low, 1.0), np.where(self.by_logarithm, self.high, 1.0)
        x = np.where(self.by_logarithm, low * (high / low) ** z, self.low + z * (self.high - self.low))
        return np.where(z == 0, self.low, np.where(z == 1, self.high, np.clip(x, self.low, self.high)))

    def positions(self, x: Array) -> Array:
        """Positions (..., P) of SI values, those outside at the bound that they are beyond."""
        x = np.clip(x, self.low, self.high)
        own = self.by_logarithm
        low, high, at = np.where(own, self.low, 1.0), np.where(own, self.high, np.e), np.where(own, x, 1.0)
        return np.where(own, np.log(at / low) / np.log(high / low), (x - self.low) / (self.high - self.low))

    def rates(self, z: Array) -> Array:
        """dx/dz (P,) at a position."""
        own = self.by_logarithm
        ratio = np.where(own, self.high, 1.0) / np.where(own, self.low, 1.0)
        return np.where(own, self.values(z) * np.log(ratio), self.high - self.low)


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
    limit: NDArray[np.intp]

    @cached_property
    def goal(self) -> float:
        """What is to be as large as can be, over its scale."""
        return float(self.goals.min())

    @cached_property
    def violation(self) -> float:
        """How far the worst limit is missed, over its scale; 0 where all are met."""
        return float(max(-self.margins.min(initial=0.0), 0.0))


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
        z = np.clip(np.asarray(z, dtype=float), 0.0, 1.0)
        key = z.tobytes()
        if key not in self._latest:
            checkpoint()
            if len(self._latest) > KEPT:
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
        with np.errstate(all="ignore"):
            found = self._formulas(z, point)
        numbers = (found.goals, found.goal_slopes, found.margins, found.margin_slopes)
        if not all(np.isfinite(own).all() for own in numbers):
            self.failures["the goal or a limit, or its derivative, is not finite"] += 1
            raise FailedDesign(z)
        return found

    def _formulas(self, z: Array, point: Point) -> Sample:
        """What follows from the quantities of a design."""
        rate = self.box.rates(z)
        of_goal = self.goal.versions(point.value)
        of_limits = [(k, own.row, own.places) for k, row in enumerate(self.limits) for own in row.versions(point.value)]
        goals = np.array([float(row.values(point.value[places])) for row, places in of_goal])
        margins = np.array([float(row.values(point.value[places])) for _, row, places in of_limits])
        goal_slopes = np.array([row.gradient(point, places) * rate for row, places in of_goal])
        margin_slopes = np.array([row.gradient(point, places) * rate for _, row, places in of_limits])
        return Sample(
            z,
            point,
            goals,
            goal_slopes,
            margins,
            margin_slopes.reshape(len(of_limits), len(z)),
            np.array([k for k, _, _ in of_limits], dtype=np.intp),
        )

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


KEPT = 256
"""Designs with slopes that are kept."""


ACTIVE = 1e-4
"""Margin of a limit, over its scale, and distance from a bound, of its range, up to which they may hold a design."""

FLAT = 1e-2
"""Gradient of a goal, over its scale, from which on its residual is taken relative to it."""

SETTLED = 1e-7
"""Residual up to which a search from a design finds nothing better."""

GAP = 1e-10
"""What a goal may gain, over its scale, where a search ends."""

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
    scaled position, over that gradient or over `FLAT`, whichever is larger (Karush 1939; Kuhn and Tucker 1951).
    `coalesced` says that more than one version of the goal has weight; `held` (h, P) are gradients of what must not
    change to first order. The Lagrangian is version `goal` of the goal and those of the limits (v,) times `weights`;
    `is_smooth` says that it is, with no direction of a space of repeated frequencies in it. `gap` is what the goal
    would gain, over its scale, if what holds the design held it exactly.
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
        return self.is_smooth and self.residual <= SETTLED and self.gap <= GAP


def stationarity(land: Landscape, sample: Sample) -> Stationarity:
    """Multipliers from non-negative least squares (Lawson and Hanson 1974) on the exact gradients.

    The gradients of a frequency that is repeated are those of every direction of its space (Seyranian, Lund and Olhoff
    1994, "Multiple eigenvalues in structural optimization problems").
    """
    from scipy.optimize import nnls

    P = len(sample.z)
    leading, goals = _slopes(land, sample, land.goal, sample.goals - sample.goal, sample.goal_slopes)
    owners: list[int] = []
    versions: list[int] = []
    rows: list[Array] = []
    for k, limit in enumerate(land.limits):
        own = np.flatnonzero(sample.limit == k)
        near, found = _slopes(land, sample, limit, sample.margins[own], sample.margin_slopes[own])
        versions += [*own[near], *[BETWEEN] * (len(found) - len(near))]
        rows += found
        owners += [k] * len(found)
    at_low, at_high = np.flatnonzero(sample.z <= ACTIVE), np.flatnonzero(sample.z >= 1 - ACTIVE)
    eye = np.eye(P)
    columns = np.array([*goals, *rows, *eye[at_low], *-eye[at_high]]).T
    size = max(max((float(np.abs(g).max(initial=0.0)) for g in goals), default=0.0), 1e-300)
    lengths = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    lengths[: len(goals)] = size
    heavy = 1e3
    A = np.vstack([columns / lengths, heavy * (np.arange(columns.shape[1]) < len(goals))])
    weights, _ = nnls(A, np.append(np.zeros(P), heavy), maxiter=100 * A.shape[1])
    weights = weights / max(weights[: len(goals)].sum(), 1e-300) * size / lengths
    residual = float(np.linalg.norm(columns @ weights)) / max(FLAT, *(float(np.linalg.norm(g)) for g in goals))
    ends = np.cumsum([len(goals), len(rows), len(at_low)])
    limits, low, high = np.zeros(len(land.limits)), np.zeros(P), np.zeros(P)
    of_rows = weights[ends[0] : ends[1]]
    np.add.at(limits, owners, of_rows)
    of_versions, known = np.zeros(len(sample.margins)), np.array(versions, dtype=np.intp) != BETWEEN
    of_versions[np.array(versions, dtype=np.intp)[known]] = of_rows[known]
    low[at_low], high[at_high] = weights[ends[1] : ends[2]], weights[ends[2] :]
    strong = weights * lengths > 1e-6 * size
    held = columns[:, strong & (np.arange(len(weights)) >= ends[0])].T
    pulling = [g for g, w in zip(goals, strong[: len(goals)], strict=True) if w]
    if len(pulling) > 1:
        held = np.vstack([held, [g - pulling[0] for g in pulling[1:]]])
    active = tuple(dict.fromkeys(owners))
    top = int(np.argmax(weights[: len(goals)]))
    coalesced = len(pulling) > 1
    is_smooth = not (coalesced or top >= len(leading) or strong[ends[0] : ends[1]][~known].any())
    gap = float(np.abs(of_versions @ sample.margins) + low @ sample.z + high @ (1 - sample.z))
    return Stationarity(
        limits,
        low,
        high,
        active,
        residual,
        coalesced,
        held,
        int(leading[min(top, len(leading) - 1)]),
        of_versions,
        is_smooth,
        gap,
    )


def _slopes(
    land: Landscape, sample: Sample, row: Row, gaps: Array, slopes: Array
) -> tuple[NDArray[np.intp], list[Array]]:
    """The versions of a row that are within reach of their bound, their gradients, and those of what lies between those
    whose frequencies coincide."""
    near = np.flatnonzero(gaps <= ACTIVE)
    found = [slopes[i] for i in near]
    if not (len(near) and sample.point.repeated):
        return near, found
    versions = row.versions(sample.point.value)
    for part in row.parts or (row,):
        if any(versions[i].row is part for i in near):
            found += [own * land.box.rates(sample.z) for own in _between(part, sample.point)]
    return near, found


def _between(row: Row, point: Point) -> Iterator[Array]:
    """Gradients (P,) of a row for directions of the spaces of frequencies that coincide."""
    partial = row.function.slope(point.value) / row.scale
    for group, matrices in zip(point.repeated, point.directional, strict=True):
        for own in row.frequencies:
            if own.beside(0) in group:
                rest = partial.copy()
                rest[own.beside(0)] = 0.0
                base = rest @ point.slope
                for v in _directions(len(group)):
                    yield base + partial[own.beside(0)] * np.einsum("i,ijp,j->p", v, matrices, v)


def _directions(m: int) -> list[Array]:
    """Unit vectors of a space of m dimensions: axes, and in every plane of two of them directions between."""
    found = list(np.eye(m))
    for i in range(m):
        for j in range(i):
            for angle in np.pi * np.arange(1, ANGLES) / ANGLES:
                v = np.zeros(m)
                v[i], v[j] = np.cos(angle), np.sin(angle)
                found.append(v)
    return found


def upward(land: Landscape, sample: Sample, found: Stationarity) -> tuple[float, Array | None]:
    """The greatest curvature of the Lagrangian along what the active limits leave free, and its direction (P,).

    At a maximum it is not positive (Fletcher 1987, "Practical methods of optimization", section 9.3); gradients are
    differenced. None where nothing is left free, where the goal is not smooth, or where a design nearby failed.
    """
    P = len(sample.z)
    free = null_space(found.held, rcond=1e-8) if len(found.held) else np.eye(P)
    if not free.shape[1] or not found.is_smooth:
        return 0.0, None
    try:
        gradients = [_lagrangian(land, sample, found, direction) for direction in free.T]
    except FailedDesign:
        return 0.0, None
    H = free.T @ np.array(gradients).T
    values, vectors = np.linalg.eigh((H + H.T) / 2)
    return float(values[-1]), free @ vectors[:, -1]


def _lagrangian(land: Landscape, sample: Sample, found: Stationarity, direction: Array) -> Array:
    """Change of the gradient of the Lagrangian along a direction, per unit of it."""
    gradients, steps = [], []
    for side in (1.0, -1.0):
        own = land.at(sample.z + side * CURVATURE_STEP * direction)
        steps.append(own.z @ direction)
        gradients.append(own.goal_slopes[found.goal] + found.weights @ own.margin_slopes)
    gap = steps[0] - steps[1]
    return (gradients[0] - gradients[1]) / gap if gap > 0 else np.zeros(len(sample.z))
