"""Ways on which the load itself is found: by arc length, through limit points and snap-back.

Of the loads between two points a share is on, which is an unknown; a further equation says how far to go, along the
tangent of the way. Sources: Riks (1979), Int. J. Solids Structures 15; Crisfield (1981), Comput. & Structures 13, whose
sphere is here the plane across the tangent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.errors import SolverError
from flexura.motion.elements import Frames
from flexura.motion.equilibrium import CONVERGED, ITERATIONS, Equations, Equilibrium
from flexura.motion.path import QUICK, SMALLEST, Point, displacement_between
from flexura.motion.se3 import LARGEST

Array = NDArray[np.float64]

FURTHEST = 0.1
"""Longest step: displacement over the size of the mechanism, or rad."""

ALIKE = 0.8
"""Cosine of the angle between tangents one after another, up to which steps are not too long."""

BISECTIONS = 40
"""Steps by which a point of a way is found between two others."""

CLOSE = 1e-7
"""How near, over the length of a step, a point of a way is found."""


class Along(NamedTuple):
    """A state on a way, the `share` of the way's loads on, and the unit tangent: displacements (n,), m and rad, and
    share, forwards. `limit` says that the share has an extremum here."""

    state: Equilibrium
    share: float
    forward: Array
    rising: float
    limit: bool = False


class Lost(NamedTuple):
    """The last state of a way of which nothing further is found."""

    last: Along


class Arc:
    """Follows the equilibria of `equations` under the shares of loads, and of targets of drives, between two points."""

    def __init__(self, equations: Equations, first: Point, last: Point) -> None:
        self.equations = equations
        self.first, self.last = first, last
        self.weight = 6 * equations.scale**2 / equations.model.n_dof
        """Weights (n,) of squared displacements in the length of a way."""

    def start(self, state: Equilibrium, share: float, sense: float) -> Along:
        """A state on the way, from which the share rises, or falls where `sense` is negative."""
        return self._along(state, share, np.zeros(len(self.weight)), sense)

    def through(self, start: Along, spacing: float) -> Iterator[Along | Lost]:
        """States one after another, those at limit points among them, and in the end a last one where none follows.

        Steps change the share by no more than `spacing`.
        """
        at, length = start, np.inf
        while True:
            length = min(length, self._longest(at, spacing))
            found = self._next(at, length)
            if found is None:
                yield Lost(at)
                return
            there, length, iterations = found
            if there.rising * at.rising < 0:
                limit = self.where(at, there, length, lambda own, sign=at.rising: own.rising * sign)
                yield limit._replace(limit=True)
            yield there
            at = there
            length *= 2.0 if iterations <= QUICK else 1.0 if iterations <= 2 * QUICK else 0.5

    def _longest(self, at: Along, spacing: float) -> float:
        """The longest step that is tried from a state."""
        farthest = float(np.abs(at.forward * self.equations.scale).max(initial=0.0))
        return min(FURTHEST / max(farthest, 1e-300), spacing / max(abs(at.rising), 1e-300))

    def _next(self, at: Along, length: float) -> tuple[Along, float, int] | None:
        """The state after a step, as long as possible up to a length, its length, and Newton's steps to it."""
        least = SMALLEST * length
        while length > least:
            try:
                there = self.step(at, length)
            except SolverError:
                length /= 4
                continue
            if self.product(at, there) > ALIKE:
                return there, length, there.state.iterations
            length /= 2
        return None

    def product(self, one: Along, other: Along) -> float:
        """Cosine of the angle between the tangents of two states."""
        return float(self.weight @ (one.forward * other.forward)) + one.rising * other.rising

    def where(self, at: Along, there: Along, length: float, value: Callable[[Along], float]) -> Along:
        """The state between two, a step of a length apart, where a value that is positive at the first is zero.

        Raises SolverError where steps between them do not lead anywhere.
        """
        low, high, f_low, f_high = 0.0, length, value(at), value(there)
        found = there
        for k in range(BISECTIONS):
            # false position, halved every other time
            part = 0.5 if k % 3 == 2 or f_low == f_high else min(max(f_low / (f_low - f_high), 0.01), 0.99)
            here = low + part * (high - low)
            found = self.step(at, here)
            f = value(found)
            if f > 0:
                low, f_low = here, f
            else:
                high, f_high = here, f
            if high - low < CLOSE * length or abs(f) < CLOSE * CLOSE:
                break
        return found

    def step(self, at: Along, length: float) -> Along:
        """The state after a step of a length along the tangent. Raises SolverError where Newton's method ends."""
        equations, multipliers = self.equations, at.state.drive
        share = at.share + length * at.rising
        frames = at.state.frames.moved(equations.displacements(length * at.forward))
        last, along = np.inf, self.weight * at.forward
        for iteration in range(1, ITERATIONS + 1):
            point = self.first.between(self.last, share)
            tangent, missing = equations.tangent(frames, point.loads, multipliers)
            solve = equations.solver(tangent)
            own, own_drive = solve(missing, point.targets - equations.travelled(frames))
            by_share, drive_by_share = solve(self._missing(frames), self.last.targets - self.first.targets)
            way = equations.free(displacement_between(at.state.frames, frames))
            left = length - along @ (way + own) - at.rising * (share - at.share)
            change = left / (along @ by_share + at.rising)
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
                return self._along(state, share, at.forward, at.rising)
        raise SolverError("no equilibrium is found near the last one")

    def at(self, near: Along, share: float) -> Along:
        """The state with a share, next to one with nearly this share."""
        point = self.first.between(self.last, share)
        state = self.equations.solve(near.state.frames, point.loads, point.targets)
        return self._along(state, share, near.forward, near.rising)

    def _along(self, state: Equilibrium, share: float, forward: Array, rising: float) -> Along:
        """A state with its unit tangent, in the sense of another one."""
        solve = self.equations.solver(state.tangent)
        q, _ = solve(self._missing(state.frames), self.last.targets - self.first.targets)
        length = float(np.sqrt(self.weight @ q**2 + 1.0))
        sense = np.sign(self.weight @ (q * forward) + rising) or 1.0
        return Along(state, share, sense * q / length, sense / length)

    def _missing(self, frames: Frames) -> Array:
        """Forces (n,) that the loads of the whole way add in a state."""
        ends, model = (self.first.loads, self.last.loads), self.equations.model
        low, high = (loads.external(model, frames)[0] for loads in ends)
        if any(loads.actuators for loads in ends) or (ends[0].gravity != ends[1].gravity).any():
            low, high = (own - model.forces(frames, loads.gravity, loads.actuators).force
                         for own, loads in zip((low, high), ends, strict=True))  # fmt: skip
        return self.equations.free(high - low)
