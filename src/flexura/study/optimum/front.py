"""Designs of which none is better than another in all of several goals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.deadline import Listener, Progress, no_listener
from flexura.errors import need
from flexura.study.optimum.climb import FEASIBLE_VIOLATION, Method, climb
from flexura.study.optimum.discrete import Mixed
from flexura.study.optimum.landscape import stationarity
from flexura.study.optimum.rows import Row

GENERATIONS = 60
"""Generations of the search for a front; each has twice as many designs as are asked for."""

SAME_ON_FRONT = 1e-6
"""Difference of all goals, over their ranges on the front, up to which two designs are one."""

FAILED_GOAL = -1e30
"""Stands for goals and limits of designs that failed."""


class Front(NamedTuple):
    """Designs (N, P), SI, their goals (N, g) over the scales, and how far each is from stationary (N,)."""

    designs: Array
    goals: Array
    residual: Array


class _Design(NamedTuple):
    """A design (P,), its goals (g,) and how far it is from stationary."""

    x: Array
    goals: Array
    residual: float = np.nan


def front(
    mixed: Mixed, goals: Sequence[Row], points: int, seed: int, method: Method, *, report: Listener = no_listener
) -> Front:
    """About so many designs of the front, spread along it.

    NSGA-II (Deb, Pratap, Agarwal and Meyarivan 2002) finds it; each design kept is then made the best in one goal
    without loss in the others, on exact gradients (epsilon-constraint method: Haimes, Lasdon and Wismer 1971). Raises
    OptionError without pymoo.
    """
    evolved = _evolved(mixed, goals, 2 * points, seed, report)
    if not evolved:
        return Front(np.empty((0, len(mixed.land.box.names))), np.empty((0, len(goals))), np.empty(0))
    ends = [max(evolved, key=lambda design, k=k: design.goals[k]).x for k in range(len(goals))]
    kept = [best for k, x in enumerate(ends) if (best := _climbed(mixed, goals, k, x, method)) is not None]
    spread = _spread(evolved, points)
    for number, design in enumerate(spread):
        report(Progress("designs of the front", number, len(spread)))
        better = _climbed(mixed, goals, number % len(goals), design.x, method, kept=design.goals)
        kept.append(better or design)
    designs, values, residual = (np.array(column) for column in zip(*kept, strict=True))
    best = not_dominated(values)
    best = best[np.argsort(values[best, 0], kind="stable")]
    apart = np.abs(np.diff(values[best], axis=0)) > SAME_ON_FRONT * np.ptp(values[best], axis=0)
    single = best[np.append(True, apart.any(axis=1))]
    return Front(designs[single], values[single], residual[single])


def not_dominated(values: Array) -> Index:
    """Numbers of those of N designs (N, g) of which none is at least as good in all goals, and better in one."""
    at_least = (values[:, None] >= values[None]).all(axis=-1)
    better = (values[:, None] > values[None]).any(axis=-1)
    return np.flatnonzero(~(at_least & better).any(axis=0))


def _spread(designs: Sequence[_Design], points: int) -> list[_Design]:
    """So many designs at equal distances along the front by the first goal."""
    ordered = sorted(designs, key=lambda design: design.goals[0])
    if len(ordered) <= points:
        return ordered
    goals = np.array([design.goals for design in ordered])
    size = np.maximum(np.ptp(goals, axis=0), 1e-300)
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(goals / size, axis=0), axis=1)))
    places = {int(np.abs(along - at).argmin()) for at in np.linspace(0, along[-1], points)}
    return [ordered[k] for k in sorted(places)]


def _climbed(
    mixed: Mixed, goals: Sequence[Row], goal: int, x: Array, method: Method, *, kept: Array | None = None
) -> _Design | None:
    """The design that is best in one goal near `x` without loss in the others, which are `kept` (g,) where given; None
    where it is not better."""
    land, fixed = mixed.land, None
    if len(mixed.at):
        if not len(mixed.others):
            return None
        land, fixed = mixed.held(mixed.nearest(x))
        x = x[mixed.others]
    limits = list(land.limits)
    if kept is not None:
        limits += [row.above(level) for k, (row, level) in enumerate(zip(goals, kept, strict=True)) if k != goal]
    land = replace(land, goal=goals[goal], limits=limits, evaluations=0, tried=0, _latest={})
    end = climb(land, land.box.positions(x), method)
    mixed.land.evaluations += land.evaluations
    if end.best is None or not end.is_feasible:
        return None
    values = np.array([float(row.values(end.best.point.value)) for row in goals])
    x = land.box.values(end.best.z)
    return _Design(x if fixed is None else fixed.whole(x), values, stationarity(land, end.best).residual)


def _evolved(mixed: Mixed, goals: Sequence[Row], population: int, seed: int, report: Listener) -> list[_Design]:
    """Feasible designs that NSGA-II ends with."""
    Problem = need("pymoo.core.problem", "study").Problem
    NSGA2 = need("pymoo.algorithms.moo.nsga2", "study").NSGA2
    minimize = need("pymoo.optimize", "study").minimize
    land = mixed.land

    def si_values(z: Array) -> Array:
        """SI values (N, P) of positions; variables that take some values alone have the level that one is in."""
        x = land.box.values(z)
        for k, levels in zip(mixed.at, mixed.levels, strict=True):
            x[:, k] = levels[np.minimum((z[:, k] * len(levels)).astype(int), len(levels) - 1)]
        return x

    class Designs(Problem):
        """Goals to be made small, and limits that are met where they are not positive, of blocks of positions."""

        def __init__(self) -> None:
            limits = max(len(land.limits), 1)
            super().__init__(n_var=len(land.box.names), n_obj=len(goals), n_ieq_constr=limits, xl=0.0, xu=1.0)

        def _evaluate(self, x: Array, out: dict[str, Any], *_: Any, **__: Any) -> None:
            quantities, reasons = land.designs.values(si_values(x))
            land.tried += len(x)
            land.failures.update(reason for reason in reasons if reason)
            with np.errstate(invalid="ignore"):
                none = np.where(np.isnan(quantities).any(axis=1), np.nan, 1.0)
                margins = np.stack([row.values(quantities) for row in land.limits] or [none], axis=1)
                values = np.stack([row.values(quantities) for row in goals], axis=1)
            known = np.isfinite(np.hstack([values, margins])).all(axis=1, keepdims=True)
            out["F"] = -np.where(known, values, FAILED_GOAL)
            out["G"] = -np.where(known, margins, FAILED_GOAL)

    def generation(algorithm: Any) -> None:
        report(Progress("generations", algorithm.n_gen, GENERATIONS))

    method = NSGA2(pop_size=population)
    last = minimize(Designs(), method, ("n_gen", GENERATIONS), seed=seed, verbose=False, callback=generation).pop
    x, missed = si_values(last.get("X")), last.get("G").max(axis=1)
    rows = zip(x, last.get("F"), missed, strict=True)
    return [_Design(design, -values) for design, values, by in rows if by <= FEASIBLE_VIOLATION]
