"""Stops between turning frames: contact that pushes beyond a gap, and what is seen of it over time.

Source: Hunt, Crossley (1975), J. Appl. Mech. 42, 440.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.duals import plain, zeros
from flexura.motion.elements import Frames, Kinetics, Rates, Response, turned

SHALLOW = 1e-3
"""Depth over the largest one so far to which errors are related at least."""


class _Met(NamedTuple):
    """How stops stand: depths (e,), m, beyond their gaps, below zero while open, their derivatives (e, 12) by
    displacements of the frames, directions n, and the second point from the first frame and from its own (e, 3), m,
    global."""

    depth: Array
    rows: Array
    n: Array
    across: Array
    arm: Array


@dataclass(frozen=True)
class Stops:
    """Stops (e,) between frames `node` (e, 2): the point at the arm of the second meets the first.

    `arm` (e, 2, 3), m, leads to the points as seen from the frames, `direction` (e, 3) turns with the first, along
    which the second point may be `reach` (e,), m, from the first one. `stiffness` (e,) is in N/m, `damping` (e,), s/m.
    """

    node: Index
    arm: Array
    direction: Array
    reach: Array
    stiffness: Array
    damping: Array

    @property
    def coupled(self) -> tuple[Index, ...]:
        """No members."""
        return ()

    def _met(self, frames: Frames) -> _Met:
        """How they stand in a state of the frames (theory eq. G49)."""
        x, R = frames.x[self.node], frames.R[self.node]
        arm = (R @ self.arm[..., None])[..., 0]
        n = (R[:, 0] @ self.direction[..., None])[..., 0]
        across = x[:, 1] + arm[:, 1] - x[:, 0]
        depth = (n * (across - arm[:, 0])).sum(axis=1) - self.reach
        rows = np.concatenate([-n, -np.cross(across, n), n, np.cross(arm[:, 1], n)], axis=1)
        return _Met(depth, rows, n, across, arm[:, 1])

    def depths(self, frames: Frames) -> tuple[Array, Array]:
        """Depths (e,), m, beyond the gaps, below zero while open, and their derivatives (e, 12) by displacements of the
        frames."""
        met = self._met(frames)
        return met.depth, met.rows

    def response(self, frames: Frames) -> Response:
        """Energies, forces and tangents in a state of the frames (theory eq. G50)."""
        met = self._met(frames)
        closed = plain(met.depth) > 0
        k, p = self.stiffness * closed, met.depth * closed
        push, rows = k * p, met.rows
        force = push[:, None] * rows
        tangent = zeros((len(p), 12, 12), rows, push)
        tangent += k[:, None, None] * rows[:, :, None] * rows[:, None]
        N, across, arm = (push[:, None, None] * skew(met.n), skew(met.across), skew(met.arm))
        tangent[:, :3, 3:6] += N
        tangent[:, 3:6, :3] -= N
        tangent[:, 3:6, 3:6] += across @ N
        tangent[:, 3:6, 6:9] += N
        tangent[:, 3:6, 9:] -= N @ arm
        tangent[:, 6:9, 3:6] -= N
        tangent[:, 9:, 3:6] -= arm @ N
        tangent[:, 9:, 9:] += N @ arm
        for six in (slice(0, 6), slice(6, 12)):
            tangent[:, six, six] -= turned(force[:, six])
        return Response(0.5 * push * p, force, tangent)

    def material(self, frames: Frames) -> tuple[Array]:
        """They are no material (e, 12, 12) that structural or Rayleigh damping would be in."""
        del frames
        return (np.zeros((len(self.node), 12, 12)),)

    def masses(self, frames: Frames) -> Array:
        """Nor mass (e, 12, 12)."""
        return self.material(frames)[0]

    def pushes(self, frames: Frames, velocity: Array) -> Array:
        """Forces (e,), N, with the frames at velocities (n + 1, 6) (theory eq. G50)."""
        return self._pushes(self._met(frames), velocity)[0]

    def _pushes(self, met: _Met, velocity: Array) -> tuple[Array, Array]:
        """Forces (e,), N, and by how much they are larger than those of stiffness, over these."""
        more = self.damping * (met.rows * velocity[self.node].reshape(-1, 12)).sum(axis=1)
        more = np.maximum(more, -1.0)
        return self.stiffness * np.maximum(met.depth, 0.0) * (1 + more), more

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What they exert in a state of motion."""
        met = self._met(frames)
        depth = np.maximum(met.depth, 0.0)
        push, _ = self._pushes(met, rates.velocity)
        return Kinetics(push[:, None] * met.rows, float(0.5 * self.stiffness @ depth**2), 0.0)

    def rate_tangents(self, frames: Frames, velocity: Array) -> tuple[Array, Array]:
        """What damping adds to the derivatives (e, 12, 12) of the forces by displacements, but for what turns, and
        those by velocities, with the frames at velocities (n + 1, 6)."""
        met = self._met(frames)
        _, more = self._pushes(met, velocity)
        both = self.stiffness[:, None, None] * met.rows[:, :, None] * met.rows[:, None]
        by_rate = np.where(more > -1, self.damping * np.maximum(met.depth, 0.0), 0.0)
        return (more * (met.depth > 0))[:, None, None] * both, by_rate[:, None, None] * both


class Contact(NamedTuple):
    """What a stop has met: how often, how deep at most, m, with what force at most, N, and the fewest steps of a
    contact that ended, none where none did."""

    name: str
    count: int
    depth: float
    force: float
    fewest: int | None


class Contacts:
    """What stops meet in a motion, step by step."""

    def __init__(self, stops: Stops, names: Sequence[str]) -> None:
        e = len(names)
        self.stops: Stops = stops
        self.names: tuple[str, ...] = tuple(names)
        self._depth, self._force = np.zeros(e), np.zeros(e)
        self._count, self._steps = np.zeros(e, dtype=np.intp), np.zeros(e, dtype=np.intp)
        self._fewest = np.full(e, np.iinfo(np.intp).max)
        self._is_whole = np.zeros(e, dtype=bool)

    def error(self, last: Frames, now: Frames, off: Array) -> float:
        """The largest error of displacements (n + 1, 6) after a step, over the depth of each stop that is met in it, of
        which a part of the largest depth so far counts at least."""
        depth, rows = self.stops.depths(now)
        before = self.stops.depths(last)[0]
        met = (depth > 0) | (before > 0)
        if not met.any():
            return 0.0
        error = np.abs((rows * off[self.stops.node].reshape(-1, 12)).sum(axis=1))
        deep = np.maximum(np.maximum(depth, before), SHALLOW * self._depth)
        return float((error[met] / deep[met]).max())

    def saw(self, frames: Frames, velocity: Array, is_start: bool = False) -> None:
        """Take in a state that a step has led to, with the frames at velocities (n + 1, 6)."""
        depth = self.stops.depths(frames)[0]
        met = depth > 0
        self._force = np.maximum(self._force, self.stops.pushes(frames, velocity))
        self._depth = np.maximum(self._depth, depth)
        begins, ends = met & (self._steps == 0), ~met & (self._steps > 0)
        self._count += begins
        self._is_whole[begins] = not is_start
        self._fewest = np.where(ends & self._is_whole, np.minimum(self._fewest, self._steps), self._fewest)
        self._steps = np.where(met, self._steps + 1, 0)

    def found(self) -> list[Contact]:
        """Of each stop that was met."""
        none = np.iinfo(np.intp).max
        numbers = zip(self.names, self._count, self._depth, self._force, self._fewest, strict=True)
        return [
            Contact(name, int(count), float(depth), float(force), None if fewest == none else int(fewest))
            for name, count, depth, force, fewest in numbers
            if count
        ]
