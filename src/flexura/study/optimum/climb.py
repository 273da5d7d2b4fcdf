"""Searches from several starts to the best feasible design, by SciPy on exact gradients."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import exp, lgamma, log, pi, sqrt
from typing import Any, Literal

import numpy as np

from flexura.arrays import Array
from flexura.deadline import Listener, Progress, unheard
from flexura.study.optimum.landscape import FailedDesign, Judged, Landscape, Sample, Stationarity, stationarity, upward

Method = Literal["slsqp", "trust-constr"]

FEASIBLE = 1e-7
"""Violation, over the scale of a limit, up to which it counts as met."""

PENALTY = 1e3
"""Goal, over its scale, that a violation costs, over that of its limit: more than multipliers are."""

STEPS = 200
"""Steps of SLSQP, and a fifth of those of trust-constr."""

AGAIN = 20
"""Times that a search goes on in a smaller box after a design failed."""

CLOSE = 1e-5
"""Distance, of the range of a variable, at which a search keeps off designs that failed."""

BESIDE = "designs beyond have no answer"
HOLDS = "the conditions of an optimum hold"


@dataclass(frozen=True)
class Climb:
    """Where a search from `start` (P,) ended: the best feasible design, or the least violated one; None where not even
    the start has an answer. `said` is why it ended, in the words of the method."""

    start: Array
    best: Sample | None
    evaluations: int
    converged: bool
    said: str

    @property
    def is_feasible(self) -> bool:
        """Whether it meets all limits."""
        return self.best is not None and self.best.violation <= FEASIBLE


class _Settled(Exception):  # noqa: N818  it ends a search, and never reaches a user
    """The best design meets the conditions of an optimum."""


class _Seen:
    """Remembers the best design of a search, and ends the search where it meets the conditions of an optimum."""

    def __init__(self, land: Landscape) -> None:
        self.land = land
        self.best: Sample | None = None

    def at(self, z: Array) -> Sample:
        sample, last = self.land.at(z), self.best
        better = last is None or is_better(sample, last)
        if better:
            self.best = sample
        # another that misses a limit by no more than counts as met may have a goal better by about as much
        near = better or (last is not None and sample.goal >= last.goal - FEASIBLE)
        if near and sample.violation <= FEASIBLE and stationarity(self.land, sample).is_settled:
            self.best = sample
            raise _Settled
        return sample


def is_better(a: Sample, b: Sample) -> bool:
    """Whether one design is better than another: feasible, then by its goal, or nearer to being feasible.

    What a goal gains by missing limits, little as it is, is no merit: it is weighed against (exact penalty; Nocedal and
    Wright 2006, section 15.4).
    """
    feasible = a.violation <= FEASIBLE, b.violation <= FEASIBLE
    if all(feasible):
        return a.goal - PENALTY * a.violation > b.goal - PENALTY * b.violation
    return feasible[0] or (not feasible[1] and a.violation < b.violation)


def climb(
    land: Landscape,
    start: Array,
    method: Method = "slsqp",
    accuracy: float = 1e-10,
) -> Climb:
    """The best design that a local search reaches from a position, until the goal changes by less than `accuracy`.

    Where it ends without meeting the limits their largest violation is made as small as it goes, and the search goes on
    from there. A design that fails ends the search, which goes on from the best one in a smaller box around it. What
    trust-constr leaves of its barrier is taken away by SLSQP.
    """
    before = land.evaluations
    seen = _Seen(land)
    try:
        converged, said = _climbed(seen, start, method, accuracy)
    except _Settled:
        converged, said = True, HOLDS
    return Climb(start, seen.best, land.evaluations - before, converged, said)


def _climbed(seen: _Seen, start: Array, method: Method, accuracy: float) -> tuple[bool, str]:
    """Search from a position; whether that converged, and why it ended."""
    try:
        seen.at(start)
    except FailedDesign:
        return False, "the start has no answer"
    converged, said = _within(seen, _ascent, start, method, accuracy)
    assert seen.best is not None
    if seen.best.violation > FEASIBLE:
        _within(seen, _relief, seen.best.z, method, accuracy)
        if seen.best.violation <= FEASIBLE:
            converged, said = _within(seen, _ascent, seen.best.z, method, accuracy)
    if method != "slsqp":
        converged, _ = _within(seen, _ascent, seen.best.z, "slsqp", accuracy)
    return converged, said


Search = Callable[["_Seen", Array, Method, float, Array, Array], tuple[bool, str]]


def _within(seen: _Seen, search: Search, z: Array, method: Method, accuracy: float) -> tuple[bool, str]:
    """A search that, after a design failed, goes on around the best one, half the way to those that failed at most."""
    failed: list[Array] = []
    low, high = np.zeros_like(z), np.ones_like(z)
    near = low, high
    for _ in range(AGAIN):
        try:
            converged, said = search(seen, z, method, accuracy, *near)
        except FailedDesign as design:
            failed.append(design.z)
            converged, said = False, ""
        assert seen.best is not None
        z = seen.best.z
        if not failed:
            return converged, said
        cut = ((z <= near[0] + CLOSE / 10) & (near[0] > low)) | ((z >= near[1] - CLOSE / 10) & (near[1] < high))
        reach = min(float(np.abs(own - z).max()) for own in failed) / 2
        if said and (not cut.any() or reach < CLOSE):
            return converged and not cut.any(), said if not cut.any() else BESIDE
        near = np.maximum(low, z - reach), np.minimum(high, z + reach)
    return False, BESIDE


def _ascent(seen: _Seen, z: Array, method: Method, accuracy: float, low: Array, high: Array) -> tuple[bool, str]:
    """Make the goal, or a bound below all its versions, as large as can be."""
    first = seen.at(z)
    P, versions = len(z), len(first.goals)
    if versions == 1:
        return _solved(
            method,
            lambda y: (-seen.at(y).goals[0], -seen.at(y).goal_slopes[0]),
            lambda y: (seen.at(y).margins, seen.at(y).margin_slopes),
            z,
            low,
            high,
            accuracy,
        )
    direction = np.append(np.zeros(P), -1.0)

    def constraints(y: Array) -> tuple[Array, Array]:
        sample = seen.at(y[:P])
        over = np.hstack([sample.goal_slopes, np.full((versions, 1), -1.0)])
        under = np.hstack([sample.margin_slopes, np.zeros((len(sample.margins), 1))])
        return np.concatenate([sample.goals - y[P], sample.margins]), np.vstack([over, under])

    start = np.append(z, first.goal)
    return _solved(
        method,
        lambda y: (-y[P], direction),
        constraints,
        start,
        np.append(low, -np.inf),
        np.append(high, np.inf),
        accuracy,
    )


def _relief(seen: _Seen, z: Array, method: Method, accuracy: float, low: Array, high: Array) -> tuple[bool, str]:
    """Make the largest violation as small as can be."""
    P = len(z)
    direction = np.append(np.zeros(P), 1.0)

    def constraints(y: Array) -> tuple[Array, Array]:
        sample = seen.at(y[:P])
        return sample.margins + y[P], np.hstack([sample.margin_slopes, np.ones((len(sample.margins), 1))])

    start = np.append(z, seen.at(z).violation)
    return _solved(
        method,
        lambda y: (y[P], direction),
        constraints,
        start,
        np.append(low, -1e-3),
        np.append(high, np.inf),
        accuracy,
    )


Both = Callable[[Array], tuple[Any, Array]]


def _solved(
    method: Method, goal: Both, constraints: Both, start: Array, low: Array, high: Array, accuracy: float
) -> tuple[bool, str]:
    """Let SciPy minimise; what it finds is remembered where designs are worked out."""
    from scipy.optimize import BFGS, Bounds, NonlinearConstraint, minimize

    has_constraints = len(constraints(start)[0]) > 0
    bounds = Bounds(low, high, keep_feasible=True)
    given: dict[str, Any] = {"bounds": bounds, "jac": lambda y: goal(y)[1]}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about steps that the method corrects itself
        if method == "slsqp":
            if has_constraints:
                own = {"type": "ineq", "fun": lambda y: constraints(y)[0], "jac": lambda y: constraints(y)[1]}
                given["constraints"] = [own]
            found = minimize(
                lambda y: float(goal(y)[0]),
                start,
                method="SLSQP",
                options={"ftol": accuracy, "maxiter": STEPS},
                **given,
            )
            return bool(found.status == 0), str(found.message)
        if has_constraints:
            given["constraints"] = [
                NonlinearConstraint(
                    lambda y: constraints(y)[0], 0, np.inf, jac=lambda y: constraints(y)[1], hess=BFGS()
                )
            ]
        limits: Any = {"gtol": 1e-9, "xtol": 1e-10, "barrier_tol": 1e-10, "maxiter": 5 * STEPS}
        found = minimize(
            lambda y: float(goal(y)[0]), start, method="trust-constr", hess=BFGS(), options=limits, **given
        )
        return bool(found.status in (1, 2)), str(found.message)


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
