"""Paths through states of equilibrium: from point to point, and by arc length through limit points and snap-back.

Steps adapt, and are predicted from the states before. By arc length the load itself is found: of the loads between two
points a share is on, which is an unknown; a further equation says how far to go, along the tangent of the path.
Sources: Riks (1979), Int. J. Solids Structures 15; Crisfield (1981), Comput. & Structures 13, whose sphere is here the
plane across the tangent (theory eq. G31).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.kernels import Kernel, is_compiled
from flexura.linalg import count_below, leading
from flexura.motion.elements import Frames
from flexura.motion.equilibrium import NEWTON_CONVERGED, NEWTON_STEPS, Equations, Equilibrium
from flexura.motion.lanes import are_plain
from flexura.motion.model import NO_LOADS, SMALL_SHARE, Loads
from flexura.motion.pose import Pose
from flexura.motion.se3 import LARGEST_ROTATION, rotation_vector

SMALLEST_STEP = 1.0 / 4096
"""Least part of a step to the next point that is tried."""

JUMP, NO_JUMP = 0.2, 1e-5
"""Largest share of a step that its prediction may lack, and what is too little to be a jump, over the size of the
mechanism or in rad."""

REMEMBERED = 4
"""States before the last one by which the next one is predicted."""

QUICK = 4
"""Newton's steps up to which the next step may be longer."""

Progress = Callable[[str, float], None]

_between = Kernel("frames_between", "naaaaaaa")


@dataclass(frozen=True)
class Stopped:
    """Where a path ends before its last point: `share` of the way to point number `point`, and the last state."""

    point: int
    share: float
    last: Equilibrium


@dataclass(frozen=True)
class Point:
    """What is prescribed at a point of a path: driven displacements (d,), m and rad, loads, and displacements (n, 6)
    from rest of the frames that the ground holds, with zeros for all others."""

    targets: Array
    loads: Loads
    held: Array = field(default_factory=partial(np.zeros, (1, 6)))

    def between(self, other: Point, share: float) -> Point:
        """A point between this and another one. Loads move in proportion."""
        targets, held = (a + share * (b - a) for a, b in ((self.targets, other.targets), (self.held, other.held)))
        return Point(targets, self.loads.mixed(other.loads, share), held)


class Path:
    """Follows the equilibria of `equations` from a state through points, one after another."""

    def __init__(self, equations: Equations, start: Equilibrium, at: Point) -> None:
        self.equations = equations
        self.state: Equilibrium = start
        self.at: Point = at
        self._before: list[tuple[float, Frames]] = []
        self._travel, self._load = 0.0, 1.0

    @staticmethod
    def from_rest(equations: Equations, point: Point) -> Equilibrium | Stopped:
        """The state at a point, from the undeformed configuration without loads. Raises SolverError where that is free
        to move."""
        undeformed = Point(np.zeros(len(equations.drives)), NO_LOADS)
        return Path(equations, equations.at_rest(), undeformed).to(point)

    @staticmethod
    def resting(equations: Equations, point: Point) -> Equilibrium:
        """The state at a point, which only loads take away from the undeformed configuration. Raises SolverError where
        that is free to move, and where the loads are too large."""
        state = Path.from_rest(equations, point) if point.loads.any else equations.at_rest()
        if isinstance(state, Stopped):
            part = 100 * state.share
            raise SolverError(f"the loads are too large: no equilibrium is found beyond {part:.3g} % of them")
        return state

    def to(self, point: Point) -> Equilibrium | Stopped:
        """The state at one point."""
        return next(self.through([point]))

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
            travel = self._travel + (share - done) * length
            try:
                predicted = self._predicted(travel, aim)
                state = self.equations.solve(predicted, aim.loads, aim.targets)
                refuse_jump(self.equations, self.state.frames, predicted, state.frames)
            except SolverError:
                if part <= SMALLEST_STEP:
                    return Stopped(number, done, self.state)
                part /= 2 if self._before else 4
                self._before = []
                continue
            if travel > self._travel:
                self._before = [*self._before, (self._travel, self.state.frames)][-REMEMBERED:]
            self._travel, self.state, self.at = travel, state, aim
            done = share
            part *= 2.0 if state.iterations <= QUICK else 1.0
        return None

    def _predicted(self, travel: float, aim: Point) -> Frames:
        """The state at a length of the path, by the polynomial (Lagrange) of the displacements from the last state to
        those before it; along the tangent where there are none. Held frames are where they are to be."""
        now, ahead = self.state.frames, travel - self._travel
        if not self._before:
            now = self._held(now, aim)
            if now is self.state.frames and not aim.loads.apart(self.state.loads):
                tangent, missing = self.state.tangent, self.equations.missing(self.state)
            else:
                tangent, missing = self.equations.tangent(now, aim.loads, self.state.drive)
            gap = aim.targets - tangent.travelled
            return now.moved(self.equations.displacements(self.equations.solver(tangent)(missing, gap)[0]))
        lengths = [0.0, *(s - self._travel for s, _ in self._before)]
        step = np.zeros((len(now.x), 6))
        for length, (_, frames) in zip(lengths[1:], self._before, strict=True):
            weight = math.prod((ahead - other) / (length - other) for other in lengths if other != length)
            step += weight * displacement(now, frames)
        return self._held(now.moved(step), aim)

    def _held(self, frames: Frames, aim: Point) -> Frames:
        """Frames, those of them that the ground holds elsewhere than at rest where a point puts them."""
        held = (aim.held != 0).any(axis=1) | (self.at.held != 0).any(axis=1)
        if not held.any():
            return frames
        there = self.equations.model.rest.moved(aim.held)
        x, R = frames.x.copy(), frames.R.copy()
        x[held], R[held] = there.x[held], there.R[held]
        return frames._replace(x=x, R=R)


def refuse_jump(equations: Equations, before: Frames, predicted: Frames, after: Frames) -> None:
    """Raise SolverError for a state that lies elsewhere, as on another path that Newton's method jumped to.

    On one path what is left of a step after its prediction vanishes with its length; across a gap it does not. Nor does
    it where a stop is met or left, at a kink of the path.
    """
    if not equations.model.meets_alike(before, after):
        return
    scale = np.append(np.full(3, 1 / equations.size), np.ones(3))
    off, step = (float(np.abs(displacement(frames, after) * scale).max(initial=0.0)) for frames in (predicted, before))
    if off > max(JUMP * step, NO_JUMP):
        raise SolverError("the next state is not on the path of the last one")


def displacement(start: Frames, end: Frames) -> Array:
    """Displacements (n, 6) from one state to another."""
    if is_compiled() and are_plain(start.x, start.R, start.z, end.x, end.R, end.z):
        moved = np.empty_like(start.z)
        _between(len(moved), start.x, start.R, start.z, end.x, end.R, end.z, moved)
        return moved
    turn = rotation_vector(end.R @ np.swapaxes(start.R, -1, -2))
    return np.concatenate([end.x - start.x, turn], axis=1) + end.z - start.z


def _distance(start: Point, end: Point, size: float, load: float) -> float:
    """How far apart two points are, for the extrapolation: over the size of the mechanism and the largest load."""
    travel = float(np.abs(end.targets - start.targets).sum()) / size
    moved = np.abs(end.held - start.held).max(axis=0)
    travel += float(moved[:3].max()) / size + float(moved[3:].max())
    return travel + end.loads.apart(start.loads) / load


LONGEST_STEP = 0.1
"""Longest step: displacement over the size of the mechanism, or rad."""

LEAST_RESPONSE = 1e-3
"""Least response to all loads, over the size of the mechanism, by which displacements are scaled."""

SMOOTH_COSINE = 0.8
"""Cosine of the angles between tangents one after another and the step between them, up to which it is not too long."""

BISECTIONS = 40
"""Steps by which a point of a path is found between two others."""

CRITICAL_POINT = 1e-7
"""How near, over the length of a step, a limit point or a fork is found."""

NEAR_STATE = 1e-2
"""How near a state is found from which Newton's method leads to that with the same share."""

SEPARATE = 64
"""By how much steps are shortened to tell a limit point from a fork next to it."""

SHORTENED = 6
"""How often the first step along a branch is shortened."""

INVERSE_STEPS = 3
"""Steps of inverse iteration to the critical mode of a fork, of which the stiffness is nearly singular."""


class Along(NamedTuple):
    """A state on a path, the `share` of its loads on, and the unit tangent: displacements `forward` (n,), m and
    rad, and share `rising`; `curve` and `bend` are those by the square of the length, of a path through another state.
    Its `kind` is `limit` where the share has an extremum, and `fork` at a bifurcation.
    """

    state: Equilibrium
    share: float
    forward: Array
    rising: float
    curve: Array
    bend: float
    kind: str = ""


def unstable(equations: Equations, state: Equilibrium) -> int:
    """In how many directions a state is unstable with actuators locked: negative pivots of its symmetric tangent."""
    K = Pose(equations, state).matrices(held=True)[0]
    return count_below(K, K, 0.0) if K.shape[0] else 0


class Lost(NamedTuple):
    """The last state of a path of which nothing further is found."""

    last: Along


class Arc:
    """Follows the equilibria of `equations` under the shares of loads, and of targets of drives, between two points."""

    def __init__(self, equations: Equations, first: Point, last: Point, state: Equilibrium) -> None:
        self.equations = equations
        self.first = first
        self.last = last
        scale = equations.scale**2
        response = equations.solver(state.tangent)(self._missing(state.frames, 0.0), last.targets - first.targets)[0]
        square = float(np.mean(scale * response**2))
        self.weight: Array = scale / len(scale) / max(square, LEAST_RESPONSE**2)
        """Weights (n,) of squared displacements in the length of a path: the linear response of a state to all of the
        loads counts as much as these."""

    def start(self, state: Equilibrium, share: float, sense: float) -> Along:
        """A state on the path, from which the share rises, or falls where `sense` is negative."""
        return self._along(state, share, np.zeros(len(self.weight)), sense)

    def through(self, start: Along, spacing: float) -> Iterator[Along | Lost]:
        """States one after another, limit points and forks among them, and in the end a last one where none follows.

        Steps change the share by about `spacing` at most.
        """
        at, length, count = start, np.inf, unstable(self.equations, start.state)
        while True:
            length = min(length, self._longest(at, spacing))
            step = self._next(at, length, spacing)
            if step is None:
                yield Lost(at)
                return
            there, length, iterations = step
            now = unstable(self.equations, there.state)
            turns = there.rising * at.rising < 0
            if turns and abs(now - count) != 1 and length > self._longest(at, spacing) / SEPARATE:
                length /= 4
                continue
            if turns:
                sense = np.sign(at.rising)
                yield self.where(at, there, lambda state, sense=sense: state.rising * sense)._replace(kind="limit")
            elif now != count:
                yield self.fork(at, there)
            yield there
            at, count = there, now
            length *= 2.0 if iterations <= QUICK else 1.0 if iterations <= 2 * QUICK else 0.5

    def _longest(self, at: Along, spacing: float) -> float:
        """The longest step that is tried from a state."""
        farthest = float(np.abs(at.forward * self.equations.scale).max(initial=0.0))
        return min(LONGEST_STEP / max(farthest, 1e-300), spacing / max(abs(at.rising), 1e-300))

    def _next(self, at: Along, length: float, spacing: float) -> tuple[Along, float, int] | None:
        """The state after a step, as long as possible up to a length, its length, and Newton's steps to it."""
        least = SMALLEST_STEP * self._longest(at, spacing)
        while length > least:
            try:
                there = self.step(at, length)
            except SolverError:
                length /= 4
                continue
            if abs(there.share - at.share) <= 2 * spacing and self._alike(at, there, length):
                return there, length, there.state.iterations
            length /= 2
        return None

    def _alike(self, at: Along, there: Along, length: float) -> bool:
        """Whether a step of a length, along the tangent, led further on the same path; where it meets a stop or leaves
        one, the path has a kink."""
        if not self.equations.model.meets_alike(at.state.frames, there.state.frames):
            return True
        moved = self.equations.free(displacement(at.state.frames, there.state.frames))
        chord = float(np.sqrt(self.weight @ moved**2 + (there.share - at.share) ** 2))
        turned = float(self.weight @ (at.forward * there.forward)) + at.rising * there.rising
        return turned > SMOOTH_COSINE and length > SMOOTH_COSINE * chord

    def fork(self, at: Along, there: Along) -> Along:
        """The state between two at which the number of negative pivots changes. Raises SolverError as `where`."""
        count = unstable(self.equations, at.state)
        fork = self.where(at, there, lambda state: 1.0 if unstable(self.equations, state.state) == count else -1.0)
        return fork._replace(kind="fork")

    def branched(self, fork: Along, side: int) -> Along:
        """The first state on the path that branches off at a bifurcation, to the side of the largest displacement of
        the critical mode, or the other one for -1. Raises SolverError where none is found."""
        solve = self.equations.solver(fork.state.tangent)
        mode = np.random.default_rng(0).standard_normal(len(self.weight))
        for _ in range(INVERSE_STEPS):
            mode, _ = solve(mode * self.equations.scale**2, np.zeros(len(self.equations.drives)))
            mode = mode / np.sqrt(self.weight @ mode**2)
        largest = int(leading(np.abs(mode * self.equations.scale)))
        away = fork._replace(forward=side * np.sign(mode[largest]) * mode, rising=0.0, curve=0.0 * mode, bend=0.0)
        length = self._longest(away, 1.0)
        for _ in range(SHORTENED):
            length /= 4
            try:
                return self.step(away, length)
            except SolverError:
                continue
        raise SolverError("no bifurcated path of equilibria is found")

    def where(self, at: Along, there: Along, value: Callable[[Along], float], close: float = CRITICAL_POINT) -> Along:
        """The state between two where a value that is positive at the first is zero, as `close` as that over the length
        between them. Raises SolverError where steps between them do not lead anywhere."""
        at, length = self._curved(at, there)
        low, high, f_low, f_high, between = 0.0, length, value(at), value(there), there
        for k in range(BISECTIONS):
            # false position, every third time halved
            part = 0.5 if k % 3 == 2 or f_low <= f_high else min(max(f_low / (f_low - f_high), 0.01), 0.99)
            here = low + part * (high - low)
            between = self.step(at, here)
            f = value(between)
            if f > 0:
                low, f_low = here, f
            else:
                high, f_high = here, f
            if high - low < close * length or abs(f) < close**2:
                break
        return between

    def step(self, at: Along, length: float) -> Along:
        """The state after a step of a length along the tangent. Raises SolverError where Newton's method ends."""
        equations, multipliers = self.equations, at.state.drive
        share = float(at.share + length * at.rising + length**2 * at.bend)
        ahead = length * at.forward + length**2 * at.curve
        frames = at.state.frames.moved(equations.displacements(ahead))
        last, along = np.inf, self.weight * at.forward
        for iteration in range(1, NEWTON_STEPS + 1):
            point = self.first.between(self.last, share)
            tangent, missing = equations.tangent(frames, point.loads, multipliers)
            solve = equations.solver(tangent)
            q_load, drive_load = solve(missing, point.targets - tangent.travelled)
            by_share, drive_by_share = solve(self._missing(frames, share), self.last.targets - self.first.targets)
            moved = equations.free(displacement(at.state.frames, frames))
            left = length - along @ (moved + q_load) - at.rising * (share - at.share)
            change = float(left / (along @ by_share + at.rising))
            q = q_load + change * by_share
            if not np.isfinite(q).all():
                break
            size = max(float(np.abs(q * equations.scale).max(initial=0.0)), abs(change))
            if size > LARGEST_ROTATION or (iteration > 6 and size > last):
                break
            frames, share, last = frames.moved(equations.displacements(q)), share + change, size
            multipliers = drive_load + change * drive_by_share
            if size < NEWTON_CONVERGED:
                point = self.first.between(self.last, share)
                tangent, _ = equations.tangent(frames, point.loads, multipliers)
                state = Equilibrium(frames, multipliers, point.loads, tangent, iteration)
                return self._curved(self._along(state, share, at.forward, at.rising), at)[0]
        raise SolverError("no equilibrium is found near the last one")

    def at(self, one: Along, other: Along, share: float) -> Along:
        """The state with a share that lies between those of two states. Raises SolverError as `where`."""
        sense = float(np.sign(other.share - one.share))
        near = self.where(one, other, lambda own: (share - own.share) * sense, NEAR_STATE)
        point = self.first.between(self.last, share)
        state = self.equations.solve(near.state.frames, point.loads, point.targets)
        return self._along(state, share, near.forward, near.rising)

    def _along(self, state: Equilibrium, share: float, forward: Array, rising: float) -> Along:
        """A state with its unit tangent, in the sense of another one."""
        solve = self.equations.solver(state.tangent)
        q, _ = solve(self._missing(state.frames, share), self.last.targets - self.first.targets)
        length = float(np.sqrt(self.weight @ q**2 + 1.0))
        sense = -1.0 if self.weight @ (q * forward) + rising < 0 else 1.0
        return Along(state, share, sense * q / length, sense / length, np.zeros(len(q)), 0.0)

    def _curved(self, at: Along, other: Along) -> tuple[Along, float]:
        """A state with the path bent so that it leads through another one, and how far that is along its tangent."""
        moved = self.equations.free(displacement(at.state.frames, other.state.frames))
        share = other.share - at.share
        length = float((self.weight * at.forward) @ moved + at.rising * share)
        curve, bend = (moved - length * at.forward) / length**2, (share - length * at.rising) / length**2
        return at._replace(curve=curve, bend=bend), length

    def _missing(self, frames: Frames, share: float) -> Array:
        """Forces (n,) that the loads of the whole path add in a state, as they do where a share of them is on: what
        expands is stretched while it does not move, and pushes the more the larger the share."""
        ends, model, over = (self.first.loads, self.last.loads), self.equations.model, 1.0
        if any(model.shares(loads.actuators) for loads in ends):
            ends = ends[0].mixed(ends[1], share - SMALL_SHARE), ends[0].mixed(ends[1], share + SMALL_SHARE)
            over = 2 * SMALL_SHARE
        low, high = (loads.forces(model, frames) for loads in ends)
        if any(loads.actuators for loads in ends) or (ends[0].gravity != ends[1].gravity).any():
            low, high = (force - model.forces(frames, loads.gravity, loads.actuators).force
                         for force, loads in zip((low, high), ends, strict=True))  # fmt: skip
        return self.equations.free(high - low) / over
