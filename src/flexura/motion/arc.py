"""Ways on which the load itself is found: by arc length, through limit points and snap-back.

Of the loads between two points a share is on, which is an unknown; a further equation says how far to go, along the
tangent of the way. Sources: Riks (1979), Int. J. Solids Structures 15; Crisfield (1981), Comput. & Structures 13, whose
sphere is here the plane across the tangent (theory eq. G31).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg import count_below, leading
from flexura.motion.elements import Frames
from flexura.motion.equilibrium import CONVERGED, ITERATIONS, Equations, Equilibrium
from flexura.motion.path import QUICK, SMALLEST, Point, displacement
from flexura.motion.pose import Pose
from flexura.motion.se3 import LARGEST

FURTHEST = 0.1
"""Longest step: displacement over the size of the mechanism, or rad."""

LEAST = 1e-3
"""Least response to all loads, over the size of the mechanism, by which displacements are scaled."""

ALIKE = 0.8
"""Cosine of the angles between tangents one after another and the step between them, up to which it is not too long."""

BISECTIONS = 40
"""Steps by which a point of a way is found between two others."""

CLOSE = 1e-7
"""How near, over the length of a step, a limit point or a fork is found."""

NEAR = 1e-2
"""How near a state is found from which Newton's method leads to that with the same share."""

SEPARATE = 64
"""By how much steps are shortened to tell a limit point from a fork next to it."""

SHORTENED = 6
"""How often the first step along a branch is shortened."""

INVERSE_STEPS = 3
"""Steps of inverse iteration to the critical mode of a fork, of which the stiffness is nearly singular."""


class Along(NamedTuple):
    """A state on a way, the `share` of the way's loads on, and the unit tangent: displacements `forward` (n,), m and
    rad, and share `rising`; `curve` and `bend` are those by the square of the length, of a way through another state.
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
    """The last state of a way of which nothing further is found."""

    last: Along


class Arc:
    """Follows the equilibria of `equations` under the shares of loads, and of targets of drives, between two points."""

    def __init__(self, equations: Equations, first: Point, last: Point, state: Equilibrium) -> None:
        self.equations = equations
        self.first = first
        self.last = last
        scale = equations.scale**2
        response = equations.solver(state.tangent)(self._missing(state.frames), last.targets - first.targets)[0]
        square = float(np.mean(scale * response**2))
        self.weight: Array = scale / len(scale) / max(square, LEAST**2)
        """Weights (n,) of squared displacements in the length of a way: the linear response of a state to all of the
        loads counts as much as these."""

    def start(self, state: Equilibrium, share: float, sense: float) -> Along:
        """A state on the way, from which the share rises, or falls where `sense` is negative."""
        return self._along(state, share, np.zeros(len(self.weight)), sense)

    def through(self, start: Along, spacing: float) -> Iterator[Along | Lost]:
        """States one after another, limit points and forks among them, and in the end a last one where none follows.

        Steps change the share by about `spacing` at most.
        """
        at, length, count = start, np.inf, unstable(self.equations, start.state)
        while True:
            length = min(length, self._longest(at, spacing))
            found = self._next(at, length, spacing)
            if found is None:
                yield Lost(at)
                return
            there, length, iterations = found
            now = unstable(self.equations, there.state)
            turns = there.rising * at.rising < 0
            if turns and abs(now - count) != 1 and length > self._longest(at, spacing) / SEPARATE:
                length /= 4
                continue
            if turns:
                sense = np.sign(at.rising)
                yield self.where(at, there, lambda own, sense=sense: own.rising * sense)._replace(kind="limit")
            elif now != count:
                yield self.fork(at, there)
            yield there
            at, count = there, now
            length *= 2.0 if iterations <= QUICK else 1.0 if iterations <= 2 * QUICK else 0.5

    def _longest(self, at: Along, spacing: float) -> float:
        """The longest step that is tried from a state."""
        farthest = float(np.abs(at.forward * self.equations.scale).max(initial=0.0))
        return min(FURTHEST / max(farthest, 1e-300), spacing / max(abs(at.rising), 1e-300))

    def _next(self, at: Along, length: float, spacing: float) -> tuple[Along, float, int] | None:
        """The state after a step, as long as possible up to a length, its length, and Newton's steps to it."""
        least = SMALLEST * self._longest(at, spacing)
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
        """Whether a step of a length, along the tangent, led further on the same way."""
        way = self.equations.free(displacement(at.state.frames, there.state.frames))
        chord = float(np.sqrt(self.weight @ way**2 + (there.share - at.share) ** 2))
        turned = float(self.weight @ (at.forward * there.forward)) + at.rising * there.rising
        return turned > ALIKE and length > ALIKE * chord

    def fork(self, at: Along, there: Along) -> Along:
        """The state between two at which the number of negative pivots changes. Raises SolverError as `where`."""
        count = unstable(self.equations, at.state)
        found = self.where(at, there, lambda own: 1.0 if unstable(self.equations, own.state) == count else -1.0)
        return found._replace(kind="fork")

    def branched(self, fork: Along, side: int) -> Along:
        """The first state on the path that branches off at a bifurcation, to the side of the largest displacement of
        the         critical mode, or the other one for -1. Raises SolverError where none is found."""
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

    def where(self, at: Along, there: Along, value: Callable[[Along], float], close: float = CLOSE) -> Along:
        """The state between two where a value that is positive at the first is zero, as `close` as that over the length
        between them. Raises SolverError where steps between them do not lead anywhere."""
        at, length = self._curved(at, there)
        low, high, f_low, f_high, found = 0.0, length, value(at), value(there), there
        for k in range(BISECTIONS):
            # false position, every third time halved
            part = 0.5 if k % 3 == 2 or f_low <= f_high else min(max(f_low / (f_low - f_high), 0.01), 0.99)
            here = low + part * (high - low)
            found = self.step(at, here)
            f = value(found)
            if f > 0:
                low, f_low = here, f
            else:
                high, f_high = here, f
            if high - low < close * length or abs(f) < close**2:
                break
        return found

    def step(self, at: Along, length: float) -> Along:
        """The state after a step of a length along the tangent. Raises SolverError where Newton's method ends."""
        equations, multipliers = self.equations, at.state.drive
        share = float(at.share + length * at.rising + length**2 * at.bend)
        ahead = length * at.forward + length**2 * at.curve
        frames = at.state.frames.moved(equations.displacements(ahead))
        last, along = np.inf, self.weight * at.forward
        for iteration in range(1, ITERATIONS + 1):
            point = self.first.between(self.last, share)
            tangent, missing = equations.tangent(frames, point.loads, multipliers)
            solve = equations.solver(tangent)
            own, own_drive = solve(missing, point.targets - equations.travelled(frames))
            by_share, drive_by_share = solve(self._missing(frames), self.last.targets - self.first.targets)
            way = equations.free(displacement(at.state.frames, frames))
            left = length - along @ (way + own) - at.rising * (share - at.share)
            change = float(left / (along @ by_share + at.rising))
            q = own + change * by_share
            if not np.isfinite(q).all():
                break
            size = max(float(np.abs(q * equations.scale).max(initial=0.0)), abs(change))
            if size > LARGEST or (iteration > 6 and size > last):
                break
            frames, share, last = frames.moved(equations.displacements(q)), share + change, size
            multipliers = own_drive + change * drive_by_share
            if size < CONVERGED:
                point = self.first.between(self.last, share)
                tangent, _ = equations.tangent(frames, point.loads, multipliers)
                state = Equilibrium(frames, multipliers, point.loads, tangent, iteration)
                return self._curved(self._along(state, share, at.forward, at.rising), at)[0]
        raise SolverError("no equilibrium is found near the last one")

    def at(self, one: Along, other: Along, share: float) -> Along:
        """The state with a share that lies between those of two states. Raises SolverError as `where`."""
        sense = float(np.sign(other.share - one.share))
        near = self.where(one, other, lambda own: (share - own.share) * sense, NEAR)
        point = self.first.between(self.last, share)
        state = self.equations.solve(near.state.frames, point.loads, point.targets)
        return self._along(state, share, near.forward, near.rising)

    def _along(self, state: Equilibrium, share: float, forward: Array, rising: float) -> Along:
        """A state with its unit tangent, in the sense of another one."""
        solve = self.equations.solver(state.tangent)
        q, _ = solve(self._missing(state.frames), self.last.targets - self.first.targets)
        length = float(np.sqrt(self.weight @ q**2 + 1.0))
        sense = -1.0 if self.weight @ (q * forward) + rising < 0 else 1.0
        return Along(state, share, sense * q / length, sense / length, np.zeros(len(q)), 0.0)

    def _curved(self, at: Along, other: Along) -> tuple[Along, float]:
        """A state with the way bent so that it leads through another one, and how far that is along its tangent."""
        way = self.equations.free(displacement(at.state.frames, other.state.frames))
        share = other.share - at.share
        length = float((self.weight * at.forward) @ way + at.rising * share)
        curve, bend = (way - length * at.forward) / length**2, (share - length * at.rising) / length**2
        return at._replace(curve=curve, bend=bend), length

    def _missing(self, frames: Frames) -> Array:
        """Forces (n,) that the loads of the whole way add in a state."""
        ends, model = (self.first.loads, self.last.loads), self.equations.model
        low, high = (loads.forces(model, frames) for loads in ends)
        if any(loads.actuators for loads in ends) or (ends[0].gravity != ends[1].gravity).any():
            low, high = (own - model.forces(frames, loads.gravity, loads.actuators).force
                         for own, loads in zip((low, high), ends, strict=True))  # fmt: skip
        return self.equations.free(high - low)
