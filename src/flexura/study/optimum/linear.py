"""Sequential linear programming: a few steps to a design that meets its limits, and up from there, near enough."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from flexura.arrays import Array, Bools
from flexura.deadline import OutOfTime
from flexura.study.optimum.climb import NO_ANSWER_BEYOND, Climb
from flexura.study.optimum.landscape import FailedDesign, Landscape, Sample

PENALTY = 10.0
"""Goal that a violation costs, both over their scales or as logarithms: more than multipliers are, yet so little that
steps along curved limits are not cut short."""

FIRST_RADIUS, LEAST_RADIUS = 0.2, 1e-4
"""Positions that a step may be long, at first and before the search ends."""

WELL, POOR = 0.75, 0.25
"""Shares of what was promised from which on steps become longer, and up to which shorter."""

MOST_STEPS = 200


@dataclass(frozen=True)
class Steps:
    """A search by linear programmes, each of them the goal and the limits linear within a box around the best design,
    with what is missed at a price (Fletcher and Sainz de la Maza 1989; Nocedal and Wright 2006, section 18.5).

    What is to be at least a constant, by limit in `by_logarithm` (l,), is linear as its logarithm, since from where it
    is missed by far that is nearer to the truth; so is a `positive` goal. Limits that are `kept` (l,), which a start
    meets, have no price: no step leaves them.
    """

    land: Landscape
    by_logarithm: Bools
    kept: Bools
    positive: bool = False

    def climb(self, start: Array, accuracy: float) -> Climb:
        """The best design from a position, where a step promises less than `accuracy`, or the time is over.

        At an optimum that fewer limits hold than there are variables the last digits take long. Raises OutOfTime where
        not even the start is worked out.
        """
        land, before, radius = self.land, self.land.evaluations, FIRST_RADIUS
        try:
            best = land.at(start)
        except FailedDesign:
            return Climb(start, None, land.evaluations - before, False, "the start has no answer")
        converged, message, in_time, failed = True, "steps promise no more", True, False
        try:
            for _ in range(MOST_STEPS):
                z, promised = self.step(best, radius)
                if promised < accuracy or radius < LEAST_RADIUS:
                    break
                try:
                    tried = land.at(z)
                    gained = self._merit(tried) - self._merit(best)
                except FailedDesign:
                    gained, failed = -np.inf, True
                if gained >= WELL * promised:
                    radius = min(2 * radius, 1.0)
                elif gained < POOR * promised:
                    radius /= 2
                if gained > 0:
                    best = tried
            else:
                converged, message = False, f"{MOST_STEPS} steps"
        except OutOfTime as error:
            converged, message, in_time = False, str(error), False
        if failed and radius < LEAST_RADIUS:
            converged, message = False, NO_ANSWER_BEYOND
        return Climb(start, best, land.evaluations - before, converged, message, in_time)

    def _merit(self, sample: Sample) -> float:
        """The goal less what its violation costs."""
        (goals, _), (margins, _) = self._goals(sample), self._margins(sample)
        return float(goals.min()) - PENALTY * max(-margins[~self.kept[sample.limit]].min(initial=0.0), 0.0)

    def _goals(self, sample: Sample) -> tuple[Array, Array]:
        """Goals (c,) and slopes (c, P)."""
        if not self.positive:
            return sample.goals, sample.goal_slopes
        return np.log(sample.goals), sample.goal_slopes / sample.goals[:, None]

    def _margins(self, sample: Sample) -> tuple[Array, Array]:
        """Margins (l,) and slopes (l, P), of some as logarithms of one more."""
        logs = self.by_logarithm[sample.limit] & (sample.margins > -1.0)
        over = np.where(logs, 1.0 + sample.margins, 1.0)
        return np.where(logs, np.log(over), sample.margins), sample.margin_slopes / over[:, None]

    def step(self, sample: Sample, radius: float) -> tuple[Array, float]:
        """The position (P,) that is best by a linear programme, and by how much more merit it promises."""
        P, c, m = len(sample.z), len(sample.goals), len(sample.margins)
        (goals, goal_slopes), (margins, slopes) = self._goals(sample), self._margins(sample)
        kept = self.kept[sample.limit]
        rows = np.zeros((c + m, P + 2))  # of a step, the least version of the goal, and the worst violation
        rows[:c, :P], rows[:c, P] = -goal_slopes, 1.0
        rows[c:, :P], rows[c:, P + 1] = -slopes, -1.0 * ~kept
        low, high = np.maximum(-radius, -sample.z), np.minimum(radius, 1.0 - sample.z)
        found = linprog(
            np.concatenate([np.zeros(P), [-1.0, PENALTY]]),
            A_ub=rows,
            b_ub=np.concatenate([goals, np.where(kept, np.maximum(margins, 0.0), margins)]),
            bounds=[*zip(low, high, strict=True), (None, None), (0.0, None)],
        )
        if found.x is None or found.fun is None:  # numbers too far apart for it
            return sample.z, -np.inf
        return np.clip(sample.z + found.x[:P], 0.0, 1.0), -float(found.fun) - self._merit(sample)
