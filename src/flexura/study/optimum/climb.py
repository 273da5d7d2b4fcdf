"""Searches from several starts to the best feasible design, by SciPy on exact gradients, with what is known of it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import exp, lgamma, log, pi, sqrt
from typing import Any, Literal, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.deadline import Listener, OutOfTime, Progress, no_listener
from flexura.study.optimum.landscape import (
    FailedDesign,
    Judged,
    Landscape,
    Sample,
    Stationarity,
    stationarity,
    upward,
)

Method = Literal["slsqp", "trust-constr"]

FEASIBLE_VIOLATION = 1e-7
"""Violation, over the scale of a limit, up to which it counts as met."""

PENALTY = 1e3
"""Goal, over its scale, that a violation costs, over that of its limit: more than multipliers are."""

MOST_ITERATIONS = {"slsqp": 200, "trust-constr": 1000}

MOST_RESTARTS = 20
"""Times that a search goes on in a smaller box after a design failed."""

CLOSEST_TO_FAILED = 1e-5
"""Distance, of the range of a variable, at which a search keeps off designs that failed."""

NO_ANSWER_BEYOND = "designs beyond have no answer"
CONDITIONS_HOLD = "the conditions of an optimum hold"

SAME_OPTIMUM = 1e-4
"""Goals, over their scale, and positions that are no further apart are of one optimum; positions by their root."""

SAME_GOAL = 1e-9
"""Goals, over their scale, that are as good as each other."""

STATIONARY = 1e-3
"""Residual of the conditions of Karush, Kuhn and Tucker up to which a design is called an optimum."""

ROUGH_RESIDUAL = 1e-6
"""Residual of these conditions from which on a last search of more digits is made."""

RISING_CURVATURE = 1e-3
"""Curvature, over the scale of the goal, from which on a stationary design is left along it."""

SADDLE_STEP = 0.05
"""Positions that a stationary design is left by where it is no maximum."""

LINKED_STARTS = 2.0
"""Starts that are expected as near to one as those that are called beside it, over the logarithm of their number."""


@dataclass(frozen=True)
class Climb:
    """Where a search from `start` (P,) ended: the best feasible design, or the least violated one; None where not even
    the start has an answer. `message` is why it ended, in the words of the method; not `in_time` are searches that were
    cut short."""

    start: Array
    best: Sample | None
    evaluations: int
    converged: bool
    message: str
    in_time: bool = True

    @property
    def is_feasible(self) -> bool:
        """Whether it meets all limits."""
        return self.best is not None and self.best.violation <= FEASIBLE_VIOLATION


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
        return self.best.violation <= FEASIBLE_VIOLATION

    def agrees(self, climb: Climb) -> bool:
        """Whether a start led to this design, or to another one as good."""
        if climb.best is None or not (climb.is_feasible and self.is_feasible):
            return False
        return self.best.goal - climb.best.goal <= SAME_OPTIMUM

    def is_here(self, climb: Climb) -> bool:
        """Whether a start led to this design itself."""
        return climb.best is not None and bool(np.abs(climb.best.z - self.best.z).max() <= np.sqrt(SAME_OPTIMUM))


def best_of(
    land: Landscape,
    starts: Sequence[Array],
    method: Method,
    report: Listener = no_listener,
    judged: Judged | None = None,
) -> Solved | None:
    """The best design that a search from any start leads to, or the least violated one; None where all have failed.

    `report` hears of each search, `judged` is how good the starts are, where it is known. A stationary
    design whose curvature is that of no maximum is left along it, to either side.
    """
    climbs = _climbs(land, starts, method, report, judged)
    ends = [climb.best for climb in climbs if climb.best is not None]
    if not ends:
        return None
    best = ends[0]
    for end in ends[1:]:
        best = end if is_better(end, best) else best
    best, conditions = _polished(land, best)
    curvature, direction = upward(land, best, conditions) if best.violation <= FEASIBLE_VIOLATION else (0.0, None)
    if direction is not None and curvature > RISING_CURVATURE:
        for side in (SADDLE_STEP, -SADDLE_STEP):
            away = climb(land, np.clip(best.z + side * direction, 0.0, 1.0), method).best
            if away is not None and is_better(away, best) and away.goal > best.goal + SAME_GOAL:
                best = away
        best, conditions = _polished(land, best)
        curvature = upward(land, best, conditions)[0]
    return Solved(best, conditions, curvature, tuple(climbs), len(starts) - len(climbs))


def _climbs(
    land: Landscape, starts: Sequence[Array], method: Method, report: Listener, judged: Judged | None
) -> list[Climb]:
    """Searches from the first start, and from the others, the best first, that have no better design beside them.

    Beside a start lie other starts within a distance that goes to zero as they become many, and what searches have
    found (Rinnooy Kan and Timmer 1987, "Stochastic global optimization methods, part II: multi level methods"): the
    radius of a ball that has `LINKED_STARTS` log(N) of N designs in it. All are searched from until one has led to a
    design that meets the limits.
    """
    count, P = len(starts), len(starts[0])
    if judged is None and count > 1:
        judged = land.many(land.box.values(np.array(starts)))
    ranks = [_rank(goal, missed) for goal, missed in zip(*judged, strict=True)] if judged else [UNANSWERED]
    known = [(start, rank) for start, rank in zip(starts, ranks, strict=True) if rank != UNANSWERED]
    volume = LINKED_STARTS * log(count) / count
    near = exp((lgamma(1 + P / 2) + log(volume)) / P) / sqrt(pi) if volume > 0 else 0.0
    climbs = list[Climb]()
    for k in [0, *sorted(range(1, count), key=lambda start: ranks[start], reverse=True)]:
        is_beside = any(rank > ranks[k] and np.linalg.norm(at - starts[k]) <= near for at, rank in known)
        if is_beside and ranks[k] != UNANSWERED and any(climb.is_feasible for climb in climbs):
            continue
        report(Progress("searches", len(climbs), count))
        climbs.append(climb(land, starts[k], method))
        if (best := climbs[-1].best) is not None:
            known.append((best.z, _rank(best.goal, best.violation)))
    return climbs


UNANSWERED = (False, -np.inf)
"""The rank of a design that has no answer."""


def _rank(goal: float, violation: float) -> tuple[bool, float]:
    """What orders designs: those that meet the limits by their goal, others by how far they miss them."""
    if not np.isfinite(goal + violation):
        return UNANSWERED
    return (True, goal) if violation <= FEASIBLE_VIOLATION else (False, -violation)


def _polished(land: Landscape, best: Sample) -> tuple[Sample, Stationarity]:
    """A design, or one that a last search makes of it where the conditions of an optimum hold better."""
    conditions = stationarity(land, best)
    if conditions.residual <= ROUGH_RESIDUAL or best.violation > FEASIBLE_VIOLATION:
        return best, conditions
    last = climb(land, best.z, "slsqp", accuracy=1e-16).best
    if last is None or last.violation > FEASIBLE_VIOLATION or last.goal < best.goal - SAME_GOAL:
        return best, conditions
    of_last = stationarity(land, last)
    return (last, of_last) if of_last.residual < conditions.residual else (best, conditions)


def is_better(a: Sample, b: Sample) -> bool:
    """Whether one design is better than another: feasible, then by its goal, or nearer to being feasible.

    What a goal gains by missing limits, little as it is, is no merit: it is weighed against (exact penalty; Nocedal and
    Wright 2006, section 15.4).
    """
    feasible = a.violation <= FEASIBLE_VIOLATION, b.violation <= FEASIBLE_VIOLATION
    if all(feasible):
        return a.goal - PENALTY * a.violation > b.goal - PENALTY * b.violation
    return feasible[0] or (not feasible[1] and a.violation < b.violation)


def climb(land: Landscape, start: Array, method: Method = "slsqp", accuracy: float = 1e-10) -> Climb:
    """The best design that a local search reaches from a position, until the goal changes by less than `accuracy`.

    Where it ends without meeting the limits their largest violation is made as small as it goes, and the search goes on
    from there. A design that fails ends the search, which goes on from the best one in a smaller box around it. What
    trust-constr leaves of its barrier is taken away by SLSQP. Where its time is over it ends with the best so far.
    """
    before, search, in_time = land.evaluations, _Search(land, accuracy), True
    try:
        converged, message = search.run(start, method)
    except _Settled:
        converged, message = True, CONDITIONS_HOLD
    except OutOfTime as error:
        if search.best is None:
            raise
        converged, message, in_time = False, str(error), False
    return Climb(start, search.best, land.evaluations - before, converged, message, in_time)


class _Settled(Exception):  # noqa: N818  it ends a search, and never reaches a user
    """The best design meets the conditions of an optimum."""


Evaluate = Callable[[Array], tuple[Any, Array]]


class _Program(NamedTuple):
    """A goal to be made small under constraints that are not negative, each with its gradients, from a start between
    bounds."""

    goal: Evaluate
    constraints: Evaluate
    start: Array
    low: Array
    high: Array


class _Search:
    """A search that remembers its best design, and ends where it meets the conditions of an optimum."""

    def __init__(self, land: Landscape, accuracy: float) -> None:
        self.land, self.accuracy = land, accuracy
        self.best: Sample | None = None

    def at(self, z: Array) -> Sample:
        """The design at a position. Raises FailedDesign, and _Settled."""
        sample, last = self.land.at(z), self.best
        better = last is None or is_better(sample, last)
        if better:
            self.best = sample
        # another that misses a limit by no more than counts as met may have a goal better by about as much
        near = better or (last is not None and sample.goal >= last.goal - FEASIBLE_VIOLATION)
        if near and sample.violation <= FEASIBLE_VIOLATION and stationarity(self.land, sample).is_settled:
            self.best = sample
            raise _Settled
        return sample

    def run(self, start: Array, method: Method) -> tuple[bool, str]:
        """Search from a position; whether that converged, and why it ended."""
        try:
            self.at(start)
        except FailedDesign:
            return False, "the start has no answer"
        converged, message = self._within(self._ascent, start, method)
        assert self.best is not None
        if self.best.violation > FEASIBLE_VIOLATION:
            self._within(self._feasibility, self.best.z, method)
            if self.best.violation <= FEASIBLE_VIOLATION:
                converged, message = self._within(self._ascent, self.best.z, method)
        if method != "slsqp":
            converged, _ = self._within(self._ascent, self.best.z, "slsqp")
        return converged, message

    def _within(self, program: Callable[[Array, Array, Array], _Program], z: Array, method: Method) -> tuple[bool, str]:
        """A search that, after a design failed, goes on around the best one, half the way to those that failed at
        most."""
        failed: list[Array] = []
        low, high = np.zeros_like(z), np.ones_like(z)
        for _ in range(MOST_RESTARTS):
            try:
                converged, message = self._solved(program(z, low, high), method)
            except FailedDesign as design:
                failed.append(design.z)
                converged, message = False, ""
            assert self.best is not None
            z = self.best.z
            if not failed:
                return converged, message
            margin = CLOSEST_TO_FAILED / 10
            is_cut = bool((((z <= low + margin) & (low > 0)) | ((z >= high - margin) & (high < 1))).any())
            half = min(float(np.abs(other - z).max()) for other in failed) / 2
            if message and (not is_cut or half < CLOSEST_TO_FAILED):
                return converged and not is_cut, NO_ANSWER_BEYOND if is_cut else message
            low, high = np.maximum(0.0, z - half), np.minimum(1.0, z + half)
        return False, NO_ANSWER_BEYOND

    def _ascent(self, z: Array, low: Array, high: Array) -> _Program:
        """Make the goal, or a bound y below all its versions, as large as can be."""
        first = self.at(z)
        P, versions = len(z), len(first.goals)
        if versions == 1:

            def constraints(z: Array) -> tuple[Array, Array]:
                return self.at(z).margins, self.at(z).margin_slopes

            return _Program(lambda z: (-self.at(z).goals[0], -self.at(z).goal_slopes[0]), constraints, z, low, high)

        def bounded(zy: Array) -> tuple[Array, Array]:
            sample = self.at(zy[:P])
            over = np.hstack([sample.goal_slopes, np.full((versions, 1), -1.0)])
            under = np.hstack([sample.margin_slopes, np.zeros((len(sample.margins), 1))])
            return np.concatenate([sample.goals - zy[P], sample.margins]), np.vstack([over, under])

        upward, start = np.append(np.zeros(P), -1.0), np.append(z, first.goal)
        return _Program(lambda zy: (-zy[P], upward), bounded, start, np.append(low, -np.inf), np.append(high, np.inf))

    def _feasibility(self, z: Array, low: Array, high: Array) -> _Program:
        """Make the largest violation y as small as can be."""
        P = len(z)

        def bounded(zy: Array) -> tuple[Array, Array]:
            sample = self.at(zy[:P])
            return sample.margins + zy[P], np.hstack([sample.margin_slopes, np.ones((len(sample.margins), 1))])

        downward, start = np.append(np.zeros(P), 1.0), np.append(z, self.at(z).violation)
        return _Program(lambda zy: (zy[P], downward), bounded, start, np.append(low, -1e-3), np.append(high, np.inf))

    def _solved(self, program: _Program, method: Method) -> tuple[bool, str]:
        """Let SciPy minimise; what it finds is remembered where designs are worked out."""
        from scipy.optimize import BFGS, Bounds, NonlinearConstraint, minimize

        goal, constraints, start, low, high = program
        options: Any = {"maxiter": MOST_ITERATIONS[method]}
        given: dict[str, Any] = {"bounds": Bounds(low, high, keep_feasible=True), "jac": lambda x: goal(x)[1]}
        has_constraints = len(constraints(start)[0]) > 0
        if method == "slsqp":
            options |= {"ftol": self.accuracy}
            if has_constraints:
                limits = {"type": "ineq", "fun": lambda x: constraints(x)[0], "jac": lambda x: constraints(x)[1]}
                given["constraints"] = [limits]
        else:
            options |= {"gtol": 1e-9, "xtol": 1e-10, "barrier_tol": 1e-10}
            given["hess"] = BFGS()
            if has_constraints:
                value, slope = (lambda x: constraints(x)[0]), (lambda x: constraints(x)[1])
                given["constraints"] = [NonlinearConstraint(value, 0, np.inf, jac=slope, hess=BFGS())]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about steps that the method corrects itself
            end = minimize(lambda x: float(goal(x)[0]), start, method=method, options=options, **given)
        return bool(end.status in ((0,) if method == "slsqp" else (1, 2))), str(end.message)
