"""How far something moves before anything yields, with large displacements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.optimize import brentq

from flexura.analysis import DisplacedState, DisplacementPath, ratios_to_yield, settled
from flexura.arrays import Array
from flexura.duals import Dual, plain
from flexura.errors import SolverError
from flexura.motion import (
    NO_LOADS,
    Drive,
    Equations,
    Equilibrium,
    MovingModel,
    Path,
    Point,
    Stopped,
    described_loads,
    end_forces,
)
from flexura.structure import Design, Plan, at_rest
from flexura.study.questions.reading import Freedom

SMALL = 1e-4
"""First step, over the size of the mechanism or in rad, from which the stroke at yield is estimated."""

PARTS = 4
"""Steps to the stroke at which it would yield if stress rose on as it does."""

GROWTH = 30.0
"""Of a step over the one before: under loads stress may fall, or stay, before it rises."""

MOST = 200
"""Steps after which nothing is said to yield."""

EXACT = 1e-10
"""Relative error of a reach."""

ALIKE = 1e-7
"""Relative difference of strokes to both sides, and of their slopes, that is none."""

HALF_TURN = 3.1
"""Largest rotation that is looked at, rad."""


class _Stroke:
    """One displacement of a design, prescribed from rest on."""

    def __init__(self, plan: Plan, parameters: Mapping[str, float], of: Freedom) -> None:
        self.full = at_rest(plan, parameters)
        self.of = of
        model = MovingModel.of(self.full.design)
        number = int(self.full.plan.topology.numbers([of.node])[0])
        self.equations = Equations(model, [Drive(of.name, number, int(model.root[number]), of.component)])
        self.equations.independent()
        self.loads = described_loads(self.full.design)
        self.size = 1.0 if of.turns else self.equations.size
        start = self.equations.at_rest()
        self.rest = self.there(start, Point(np.zeros(1), NO_LOADS), 0.0)

    def there(self, start: Equilibrium, at: Point, value: float) -> Equilibrium:
        """The state at a value of the displacement, from another one. Raises SolverError where there is none."""
        found = next(iter(Path(self.equations, start, at).through([self.point(value)])))
        if isinstance(found, Stopped):
            raise SolverError(f"nothing yields before its way ends near {self.of.name} = {self.said(start)}")
        return found

    def point(self, value: float) -> Point:
        """What is prescribed there."""
        return Point(np.array([value]), self.loads)

    def said(self, state: Equilibrium) -> str:
        """The displacement of a state in words."""
        return f"{self.equations.travelled(state.frames)[0]:.4g} {'rad' if self.of.turns else 'm'}"

    def ratio(self, state: Equilibrium) -> float:
        """Largest stress over yield stress."""
        forces = end_forces(self.equations.model, [state])
        return float(ratios_to_yield(self.full, forces.__getitem__, 1).ratio.max())

    def until(self, side: float, most: float) -> float:
        """The displacement, to one side, at which something yields first, or more than `most`, m or rad."""
        last, before, step = self.rest, 0.0, SMALL * self.size
        reached = self.ratio(last)
        if reached >= 1:
            return 0.0
        for _ in range(MOST):
            value = min(before + step, HALF_TURN) if self.of.turns else before + step
            if before >= most or value <= before:
                return np.inf
            state = self.there(last, self.point(side * before), side * value)
            now = self.ratio(state)
            if now >= 1:
                return self._first(last, before, value, side)
            left = (1 - now) / (now - reached) * (value - before) if now > reached else np.inf
            step = min(max(left / PARTS, step), GROWTH * step, self.size)
            last, before, reached = state, value, now
        raise SolverError(f"nothing yields up to {self.of.name} = {self.said(last)}")

    def _first(self, last: Equilibrium, low: float, high: float, side: float) -> float:
        """Where between two displacements the stress reaches yield; `last` is the state at the first one."""

        def beyond(value: float) -> float:
            state = last if value == low else self.there(last, self.point(side * low), side * value)
            return self.ratio(state) - 1

        return float(brentq(beyond, low, high, xtol=EXACT * high, rtol=4 * EXACT))


def reach(plan: Plan, parameters: Mapping[str, float], of: Freedom) -> float:
    """Stroke, m or rad, to either side at which something yields first, the lesser of both, described loads on.

    Raises SolverError where a way of equilibria ends before, and where nothing yields.
    """
    return min(_sides(plan, parameters, of).values())


def sloped_reach(plan: Plan, parameters: Mapping[str, float], names: Sequence[str], of: Freedom) -> Dual:
    """As `reach`, with its exact slopes by some parameters: where stress(stroke, p) is that of yield, the stroke moves
    by minus the slope of the stress by p over that by the stroke (theory eq. V9).

    A slope is NaN where both sides yield alike and part as a parameter moves. Raises as `reach`.
    """
    sides = _sides(plan, parameters, of)
    least = min(sides.values())
    if least == 0:
        return Dual(np.zeros(()), np.zeros(len(names)))
    path = DisplacementPath(Design.with_slopes(plan.at_rest(), parameters, names), [of.name])
    moved = [
        _stroke_slope(path, side * stroke) * side for side, stroke in sides.items() if stroke <= least * (1 + ALIKE)
    ]
    size = np.max(np.abs(moved), axis=0)
    return Dual(np.array(least), np.where(np.ptp(moved, axis=0) <= ALIKE * size, moved[0], np.nan))


def _stroke_slope(path: DisplacementPath, stroke: float) -> Array:
    """Slopes (P,) of a signed stroke at which the largest stress over yield stress is held."""
    path.to(np.zeros(1))
    held, driven = (_ratio(path.at([own])).slope for own in (stroke, Dual(np.array(stroke), np.ones(path.count))))
    least = np.argmin(np.abs(held))
    return -held / (driven - held)[least]


def _ratio(at: DisplacedState) -> Any:
    """Largest stress over yield stress at a pose."""

    def largest(share: float) -> Any:
        found = at.stresses_within(share) if share else at.stresses
        known = ~np.isnan(plain(found.yield_stress))
        return np.max(found.von_mises[known, 0] / found.yield_stress[known])

    return settled(largest)


def _sides(plan: Plan, parameters: Mapping[str, float], of: Freedom) -> dict[float, float]:
    """Strokes to the sides 1 and -1, infinite where nothing yields on a side before the other does."""
    stroke = _Stroke(plan, parameters, of)
    first = stroke.until(1.0, np.inf)
    found = {1.0: first, -1.0: stroke.until(-1.0, first)}
    if not np.isfinite(min(found.values())):
        raise SolverError(f"nothing yields up to {of.name} = {HALF_TURN} rad")
    return found
