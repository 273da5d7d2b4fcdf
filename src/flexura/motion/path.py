"""Ways from rest through states of equilibrium: steps that adapt, predicted from the states before."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.motion.elements import Frames
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.loads import Loads
from flexura.motion.se3 import rotation_vector

SMALLEST = 1.0 / 4096
"""Least part of a step to the next point that is tried."""

JUMP, NO_JUMP = 0.2, 1e-5
"""Largest share of a step that its prediction may lack, and what is too little to be a jump, over the size of the
mechanism or in rad."""

REMEMBERED = 4
"""States before the last one by which the next one is predicted."""

QUICK = 4
"""Newton's steps up to which the next step may be longer."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Stopped:
    """Where a path ends before its last point: `share` of the way to point number `point`, and the last state."""

    point: int
    share: float
    last: Equilibrium


@dataclass(frozen=True)
class Point:
    """What is prescribed at a point of a path: driven displacements (d,), m and rad, and loads."""

    targets: Array
    loads: Loads

    def between(self, other: Point, share: float) -> Point:
        """A point on the way to another one. Loads move in proportion."""
        return Point(self.targets + share * (other.targets - self.targets), self.loads.mixed(other.loads, share))


class Path:
    """Follows the equilibria of `equations` from a state through points, one after another."""

    def __init__(self, equations: Equations, start: Equilibrium, at: Point) -> None:
        self.equations = equations
        self.state: Equilibrium = start
        self.at: Point = at
        self._before: list[tuple[float, Frames]] = []
        self._way, self._load = 0.0, 1.0

    def through(self, points: Sequence[Point]) -> Iterator[Equilibrium | Stopped]:
        """The states at the points, in order; a last `Stopped` where no equilibrium is found further on."""
        self._load = max((point.loads.apart(self.at.loads) for point in points), default=0.0) or 1.0
        for number, point in enumerate(points):
            stopped = self._to(point, number)
            if stopped is not None:
                yield stopped
                return
            yield self.state

    def _to(self, point: Point, number: int) -> Stopped | None:
        """Go to a point, in as many steps as it takes."""
        start, done, part = self.at, 0.0, 1.0
        length = _distance(start, point, self.equations.size, self._load)
        while done < 1.0:
            part = min(part, 1.0 - done)
            share = 1.0 if part >= 1.0 - done else done + part
            aim = point if share == 1.0 else start.between(point, share)
            way = self._way + (share - done) * length
            try:
                predicted = self._predicted(way, aim)
                state = self.equations.solve(predicted, aim.loads, aim.targets)
                self._as_predicted(predicted, state)
            except SolverError:
                if part <= SMALLEST:
                    return Stopped(number, done, self.state)
                part /= 2 if self._before else 4
                self._before = []
                continue
            if way > self._way:
                self._before = [*self._before, (self._way, self.state.frames)][-REMEMBERED:]
            self._way, self.state, self.at = way, state, aim
            done = share
            part *= 2.0 if state.iterations <= QUICK else 1.0
        return None

    def _as_predicted(self, predicted: Frames, state: Equilibrium) -> None:
        """Raise SolverError for a state that lies elsewhere, as one of another way does that Newton's method jumped to.

        On one way what is left of a step after its prediction vanishes with its length; across a gap it does not.
        """
        scale = np.append(np.full(3, 1 / self.equations.size), np.ones(3))
        off, step = (
            float(np.abs(displacement(own, state.frames) * scale).max(initial=0.0))
            for own in (predicted, self.state.frames)
        )
        if off > max(JUMP * step, NO_JUMP):
            raise SolverError("the next state is not on the path of the last one")

    def _predicted(self, way: float, aim: Point) -> Frames:
        """The state at a length of way, by the polynomial (Lagrange) of the displacements from the last state to those
        before it; along the tangent where there are none."""
        now, ahead = self.state.frames, way - self._way
        if not self._before:
            tangent, missing = self.equations.tangent(now, aim.loads, self.state.drive)
            gap = aim.targets - self.equations.travelled(now)
            return now.moved(self.equations.displacements(self.equations.solver(tangent)(missing, gap)[0]))
        ways = [0.0, *(s - self._way for s, _ in self._before)]
        step = np.zeros((len(now.x), 6))
        for own, (_, frames) in zip(ways[1:], self._before, strict=True):
            weight = math.prod((ahead - other) / (own - other) for other in ways if other != own)
            step += weight * displacement(now, frames)
        return now.moved(step)


def displacement(start: Frames, end: Frames) -> Array:
    """Displacements (n, 6) from one state to another."""
    turn = rotation_vector(end.R @ np.swapaxes(start.R, -1, -2))
    return np.concatenate([end.x - start.x, turn], axis=1) + end.z - start.z


def _distance(start: Point, end: Point, size: float, load: float) -> float:
    """How far apart two points are, for the extrapolation: over the size of the mechanism and the largest load."""
    own = float(np.abs(end.targets - start.targets).sum()) / size
    return own + end.loads.apart(start.loads) / load
