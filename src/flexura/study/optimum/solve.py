"""The best design of a landscape from several starts, with what is known of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.study.optimum.climb import FEASIBLE, Climb, Method, climb, is_better
from flexura.study.optimum.landscape import Landscape, Sample
from flexura.study.optimum.stationarity import Stationarity, stationarity, upward

Array = NDArray[np.float64]

SAME = 1e-4
"""Goals, over their scale, and positions that are no further apart are of one optimum; positions by their root."""

STATIONARY = 1e-3
"""Residual of the conditions of Karush, Kuhn and Tucker up to which a design is called an optimum."""

SETTLED = 1e-7
"""Residual from which on a design is searched from once more."""

RISE = 1e-3
"""Curvature, over the scale of the goal, from which on a stationary design is left along it."""

STEP = 0.05
"""Positions that a stationary design is left by where it is no maximum."""


@dataclass(frozen=True)
class Solved:
    """The best design, its multipliers, `curvature` (see `upward`) and the climb of every start."""

    best: Sample
    stationarity: Stationarity
    curvature: float
    climbs: tuple[Climb, ...]

    @property
    def is_feasible(self) -> bool:
        """Whether it meets all limits."""
        return self.best.violation <= FEASIBLE

    def agrees(self, one: Climb) -> bool:
        """Whether a start led to this design, or to another one as good."""
        best = one.best
        return best is not None and one.is_feasible and self.is_feasible and self.best.goal - best.goal <= SAME

    def is_here(self, one: Climb) -> bool:
        """Whether a start led to this design itself."""
        return one.best is not None and bool(np.abs(one.best.z - self.best.z).max() <= np.sqrt(SAME))


def best_of(
    land: Landscape, starts: Sequence[Array], method: Method, told: Callable[[int], None] = lambda _: None
) -> Solved | None:
    """The best design that a search from any start leads to, or the least violated one; None where all have failed.

    `told` is given the number of each start. A stationary design whose curvature is that of no maximum is left along
    it, to either side.
    """
    climbs = []
    for k, start in enumerate(starts):
        told(k)
        climbs.append(climb(land, start, method))
    found = [own.best for own in climbs if own.best is not None]
    if not found:
        return None
    best = found[0]
    for own in found[1:]:
        best = own if is_better(own, best) else best
    best, known = _settled(land, best)
    curvature, direction = upward(land, best, known) if best.violation <= FEASIBLE else (0.0, None)
    if direction is not None and curvature > RISE:
        for side in (STEP, -STEP):
            away = climb(land, np.clip(best.z + side * direction, 0.0, 1.0), method).best
            if away is not None and is_better(away, best) and away.goal > best.goal + 1e-9:
                best = away
        best, known = _settled(land, best)
        curvature = upward(land, best, known)[0]
    return Solved(best, known, curvature, tuple(climbs))


def _settled(land: Landscape, best: Sample) -> tuple[Sample, Stationarity]:
    """A design, or one that a last search makes of it where the conditions of an optimum hold better."""
    known = stationarity(land, best)
    if known.residual <= SETTLED or best.violation > FEASIBLE:
        return best, known
    last = climb(land, best.z, "slsqp", 1e-16).best
    if last is None or last.violation > FEASIBLE or last.goal < best.goal - 1e-9:
        return best, known
    other = stationarity(land, last)
    return (last, other) if other.residual < known.residual else (best, known)
