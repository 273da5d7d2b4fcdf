"""The best design of a landscape from several starts, with what is known of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, lgamma, log, pi, sqrt

import numpy as np

from flexura.arrays import Array
from flexura.deadline import Listener, Progress, unheard
from flexura.study.optimum.climb import FEASIBLE, Climb, Method, climb, is_better
from flexura.study.optimum.landscape import Judged, Landscape, Sample
from flexura.study.optimum.stationarity import Stationarity, stationarity, upward

SAME = 1e-4
"""Goals, over their scale, and positions that are no further apart are of one optimum; positions by their root."""

STATIONARY = 1e-3
"""Residual of the conditions of Karush, Kuhn and Tucker up to which a design is called an optimum."""

ROUGH = 1e-6
"""Residual of these conditions from which on a last search of more digits is made."""

RISE = 1e-3
"""Curvature, over the scale of the goal, from which on a stationary design is left along it."""

STEP = 0.05
"""Positions that a stationary design is left by where it is no maximum."""


LINKED = 2.0
"""Starts that are expected as near to one as those that are called beside it, over the logarithm of their number."""


@dataclass(frozen=True)
class Solved:
    """The best design, its multipliers, `curvature` (see `upward`), the climbs, and how many starts were `passed` over
    as a better design lies beside them."""

    best: Sample
    stationarity: Stationarity
    curvature: float
    climbs: tuple[Climb, ...]
    passed: int = 0

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
    land: Landscape,
    starts: Sequence[Array],
    method: Method,
    told: Listener = unheard,
    judged: Judged | None = None,
) -> Solved | None:
    """The best design that a search from any start leads to, or the least violated one; None where all have failed.

    `told` hears of each search, `judged` is how good the starts are, where it is known. A stationary
    design whose curvature is that of no maximum is left along it, to either side.
    """
    climbs = _climbs(land, starts, method, told, judged)
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
    return Solved(best, known, curvature, tuple(climbs), len(starts) - len(climbs))


def _climbs(
    land: Landscape, starts: Sequence[Array], method: Method, told: Listener, judged: Judged | None
) -> list[Climb]:
    """Searches from the first start, and from the others, the best first, that have no better design beside them.

    Beside a start lie other starts within a distance that goes to zero as they become many, and what searches have
    found (Rinnooy Kan and Timmer 1987, "Stochastic global optimization methods, part II: multi level methods"). All are
    searched from until one has led to a design that meets the limits.
    """
    if judged is None and len(starts) > 1:
        judged = land.many(land.box.values(np.array(starts)))
    ranks = [_rank(*own) for own in zip(*judged, strict=True)] if judged else [UNANSWERED]
    known = [(start, rank) for start, rank in zip(starts, ranks, strict=True) if rank != UNANSWERED]
    near, found = _distance(len(starts), len(starts[0])), list[Climb]()
    for k in [0, *sorted(range(1, len(starts)), key=lambda own: ranks[own], reverse=True)]:
        beside = any(rank > ranks[k] and np.linalg.norm(at - starts[k]) <= near for at, rank in known)
        if beside and ranks[k] != UNANSWERED and any(own.is_feasible for own in found):
            continue
        told(Progress("searches", len(found), len(starts)))
        own = climb(land, starts[k], method)
        found.append(own)
        if own.best is not None:
            known.append((own.best.z, _rank(own.best.goal, own.best.violation)))
    return found


UNANSWERED = (False, -np.inf)
"""The rank of a design that has no answer."""


def _rank(goal: float, violation: float) -> tuple[bool, float]:
    """What orders designs: those that meet the limits by their goal, others by how far they miss them."""
    if not np.isfinite(goal + violation):
        return UNANSWERED
    return (True, goal) if violation <= FEASIBLE else (False, -violation)


def _distance(count: int, P: int) -> float:
    """The radius of a ball in P dimensions that has `LINKED` log(N) of N designs in it."""
    volume = LINKED * log(count) / count
    return exp((lgamma(1 + P / 2) + log(volume)) / P) / sqrt(pi) if volume > 0 else 0.0


def _settled(land: Landscape, best: Sample) -> tuple[Sample, Stationarity]:
    """A design, or one that a last search makes of it where the conditions of an optimum hold better."""
    known = stationarity(land, best)
    if known.residual <= ROUGH or best.violation > FEASIBLE:
        return best, known
    last = climb(land, best.z, "slsqp", 1e-16).best
    if last is None or last.violation > FEASIBLE or last.goal < best.goal - 1e-9:
        return best, known
    other = stationarity(land, last)
    return (last, other) if other.residual < known.residual else (best, known)
