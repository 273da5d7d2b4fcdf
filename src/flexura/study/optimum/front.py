"""Designs of which none is better than another in all of several goals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.deadline import Listener, Progress, unheard
from flexura.extras import need
from flexura.study.optimum.climb import FEASIBLE, Method, climb
from flexura.study.optimum.discrete import Mixed
from flexura.study.optimum.landscape import Landscape, stationarity
from flexura.study.optimum.rows import Row

GENERATIONS = 60
"""Generations of the search for a front; each has twice as many designs as are asked for."""

AGAIN = 1e-6
"""Difference of all goals, over their ranges on the front, up to which two designs are one."""


class Front(NamedTuple):
    """Designs (N, P), SI, their goals (N, g) over the scales, and how far each is from stationary (N,)."""

    designs: Array
    goals: Array
    residual: Array


def front(
    mixed: Mixed,
    goals: Sequence[Row],
    points: int,
    seed: int,
    method: Method,
    told: Listener = unheard,
) -> Front:
    """About so many designs of the front, spread along it.

    NSGA-II (Deb, Pratap, Agarwal and Meyarivan 2002) finds it; each design kept is then made the best in one goal
    without loss in the others, on exact gradients (epsilon-constraint method: Haimes, Lasdon and Wismer 1971). Raises
    OptionError without pymoo.
    """
    x = _evolved(mixed, goals, 2 * points, seed, told)
    ends = [_climbed(mixed, goals, k, own, None, method) for k in range(len(goals)) for own in _extremes(x, k)]
    held = [own for own in ends if own is not None]
    spread = _spread(x, points)
    for number, own in enumerate(spread):
        told(Progress("designs of the front", number, len(spread)))
        better = _climbed(mixed, goals, number % len(goals), own[0], own[1], method)
        held.append(better if better is not None else (*own, np.nan))
    if not held:
        nothing = np.empty(0)
        return Front(np.empty((0, len(mixed.land.box.names))), np.empty((0, len(goals))), nothing)
    designs, values, residual = (np.array(own) for own in zip(*held, strict=True))
    kept = not_dominated(values)
    kept = kept[np.argsort(values[kept, 0], kind="stable")]
    span = np.ptp(values[kept], axis=0)
    single = [k for n, k in enumerate(kept) if n == 0 or np.any(np.abs(values[k] - values[kept[n - 1]]) > AGAIN * span)]
    return Front(designs[single], values[single], residual[single])


def not_dominated(values: Array) -> NDArray[np.intp]:
    """Numbers of those of N designs (N, g) of which none is at least as good in all goals, and better in one."""
    at_least = (values[:, None] >= values[None]).all(axis=-1)
    better = (values[:, None] > values[None]).any(axis=-1)
    return np.flatnonzero(~(at_least & better).any(axis=0))


Found = tuple[Array, Array]
"""A design (P,) and its goals (g,)."""


def _extremes(x: Sequence[Found], goal: int) -> list[Array]:
    """The design that is best in a goal."""
    return [max(x, key=lambda own: own[1][goal])[0]] if x else []


def _spread(x: Sequence[Found], points: int) -> list[Found]:
    """So many designs at equal distances along the front by the first goal."""
    ordered = sorted(x, key=lambda own: own[1][0])
    if len(ordered) <= points:
        return ordered
    values = np.array([own[1] for own in ordered])
    size = np.maximum(np.ptp(values, axis=0), 1e-300)
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(values / size, axis=0), axis=1)))
    places = {int(np.abs(way - at).argmin()) for at in np.linspace(0, way[-1], points)}
    return [ordered[k] for k in sorted(places)]


def _climbed(
    mixed: Mixed, goals: Sequence[Row], goal: int, x: Array, kept: Array | None, method: Method
) -> tuple[Array, Array, float] | None:
    """The design that is best in one goal near `x` without loss in the others, which are `kept` (g,) where given; None
    where it is not better."""
    land, whole = mixed.land, lambda own: own
    if len(mixed.at):
        if not len(mixed.others):
            return None
        land, fixed = mixed.held(mixed.nearest(x))
        whole, x = fixed.whole, x[mixed.others]
    limits = list(land.limits)
    if kept is not None:
        limits += [row.above(level) for k, (row, level) in enumerate(zip(goals, kept, strict=True)) if k != goal]
    own = replace(land, goal=goals[goal], limits=limits, evaluations=0, tried=0, _latest={})
    found = climb(own, own.box.positions(x), method)
    mixed.land.evaluations += own.evaluations
    if found.best is None or not found.is_feasible:
        return None
    values = np.array([float(row.values(found.best.point.value)) for row in goals])
    residual = stationarity(own, found.best).residual
    return whole(own.box.values(found.best.z)), values, residual


def _evolved(mixed: Mixed, goals: Sequence[Row], population: int, seed: int, told: Listener) -> list[Found]:
    """Feasible designs that NSGA-II ends with, and their goals."""
    Problem = need("pymoo.core.problem", "study").Problem
    NSGA2 = need("pymoo.algorithms.moo.nsga2", "study").NSGA2
    minimize = need("pymoo.optimize", "study").minimize
    land, count = mixed.land, len(mixed.land.limits)

    class Designs(Problem):
        """Goals to be made small, and limits that are met where they are not positive, of blocks of positions."""

        def __init__(self) -> None:
            super().__init__(n_var=len(land.box.names), n_obj=len(goals), n_ieq_constr=max(count, 1), xl=0.0, xu=1.0)

        def _evaluate(self, x: Array, out: dict[str, Any], *_: Any, **__: Any) -> None:
            values, margins = _valued(land, goals, spaced(mixed, x))
            known = np.isfinite(np.hstack([values, margins])).all(axis=1, keepdims=True)
            out["F"] = -np.where(known, values, -WORST)
            out["G"] = -np.where(known, margins, -WORST)

    def generation(algorithm: Any) -> None:
        told(Progress("generations", algorithm.n_gen, GENERATIONS))

    method = NSGA2(pop_size=population)
    found = minimize(Designs(), method, ("n_gen", GENERATIONS), seed=seed, verbose=False, callback=generation)
    last = found.pop
    x, missed = spaced(mixed, last.get("X")), last.get("G").max(axis=1)
    return [(own, -values) for own, values, by in zip(x, last.get("F"), missed, strict=True) if by <= FEASIBLE]


WORST = 1e30
"""Stands for goals and limits of designs that failed."""


def spaced(mixed: Mixed, z: Array) -> Array:
    """SI values (N, P) of positions; variables that take some values alone have the level that a position is in."""
    x = mixed.land.box.values(z)
    for k, own in zip(mixed.at, mixed.levels, strict=True):
        x[:, k] = own[np.minimum((z[:, k] * len(own)).astype(int), len(own) - 1)]
    return x


def _valued(land: Landscape, goals: Sequence[Row], x: Array) -> tuple[Array, Array]:
    """Goals (N, g) and margins (N, l) of designs, over their scales; NaN where one failed."""
    land.tried += len(x)
    quantities, reasons = land.designs.values(x)
    land.failures.update(reason for reason in reasons if reason)
    with np.errstate(invalid="ignore"):
        margins = [row.values(quantities) for row in land.limits] or [
            np.where(np.isnan(quantities).any(1), np.nan, 1.0)
        ]
        return np.stack([row.values(quantities) for row in goals], axis=1), np.stack(margins, axis=1)
