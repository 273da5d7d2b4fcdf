"""Bars that are pinned at both ends, and actuators that push between two frames."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.motion.elements import Ends, Frames, Kinetics, Rates, Response, accelerating, carried, turned


@dataclass(frozen=True)
class Bars:
    """Bars (e,) between frames `node` (e, 2).

    `arm` (e, 2, 3), m, leads to their ends as seen from the frames, `length` (e,), m, is that without strain,
    `stiffness` (e,) in N/m; `mass` (e, 12, 12) acts on the velocities of the ends and is the same in all axes.
    """

    node: Index
    arm: Array
    length: Array
    stiffness: Array
    mass: Array

    @property
    def coupled(self) -> tuple[Index, ...]:
        """No members."""
        return ()

    def _ends(self, frames: Frames) -> Ends:
        return Ends.of(frames, self.node, np.tile(np.eye(3), (len(self.node), 2, 1, 1)), self.arm)

    def response(self, frames: Frames) -> Response:
        """Energies, forces and tangents in a state of the frames (theory eq. G13)."""
        ends = self._ends(frames)
        stretch = np.linalg.norm(ends.position[:, 1] - ends.position[:, 0], axis=1) - self.length
        pull = self.stiffness * stretch
        return Response(0.5 * pull * stretch, *pulled(ends, pull, self.stiffness))

    def driven(self, command: float | Array) -> Bars:
        """As long without strain as after free expansions, m."""
        return replace(self, length=self.length + command)

    def material(self, frames: Frames) -> tuple[Array]:
        """Derivatives (e, 12, 12) of the forces in a state, as if there were none in it (theory eq. G16)."""
        ends = self._ends(frames)
        line = ends.position[:, 1] - ends.position[:, 0]
        along = ((line / np.linalg.norm(line, axis=1)[:, None])[:, None] @ _stretch_rows(ends))[:, 0]
        return (self.stiffness[:, None, None] * along[:, :, None] * along[:, None],)

    def masses(self, frames: Frames) -> Array:
        """Mass matrices (e, 12, 12) by velocities of the frames."""
        return carried(self.mass, self._ends(frames).twists())

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What holds, damps and accelerates them in a state of motion (theory eqs. G33-G34)."""
        held, ends = self.response(frames), self._ends(frames)
        velocity, acceleration = rates.velocity[self.node], rates.acceleration[self.node]
        axes = np.tile(np.eye(3), (len(self.node), 1, 1))
        force, kinetic = accelerating(self.mass, axes, ends.arm, np.zeros(2), velocity, acceleration)
        if rates.damping:
            damped = self.material(frames)[0] @ velocity.reshape(len(velocity), 12, 1)
            force = force + rates.damping * damped[..., 0]
        return Kinetics(held.force + force, float(held.energy.sum()), kinetic)


def pulled(ends: Ends, pull: Array, stiffness: Array) -> tuple[Array, Array]:
    """Forces (e, 12) on the frames that hold `ends` against a pull (e,), N, along the line between them, which grows
    with its length by `stiffness` (e,), N/m, and their tangents (e, 12, 12)."""
    line = ends.position[:, 1] - ends.position[:, 0]
    now = np.linalg.norm(line, axis=1)
    n = line / now[:, None]
    B = _stretch_rows(ends)
    across = (np.eye(3) - n[:, :, None] * n[:, None]) * (pull / now)[:, None, None]
    along = stiffness[:, None, None] * n[:, :, None] * n[:, None]
    force = pull[:, None] * (n[:, None] @ B)[:, 0]
    tangent = np.swapaxes(B, 1, 2) @ (along + across) @ B
    for end, sign in ((0, -1.0), (1, 1.0)):
        six = slice(6 * end, 6 * end + 6)
        rotations = slice(6 * end + 3, 6 * end + 6)
        tangent[:, rotations, rotations] += skew(sign * pull[:, None] * n) @ skew(ends.arm[:, end])
        tangent[:, six, six] -= turned(force[:, six])
    return force, tangent


def _stretch_rows(ends: Ends) -> Array:
    """Displacements (e, 3, 12) of end 2 from end 1 by those of the frames."""
    B = np.zeros((len(ends.arm), 3, 12), like=ends.arm)
    for end, sign in ((0, -1.0), (1, 1.0)):
        B[:, :, 6 * end : 6 * end + 3] = sign * np.eye(3)
        B[:, :, 6 * end + 3 : 6 * end + 6] = -sign * skew(ends.arm[:, end])
    return B


@dataclass(frozen=True)
class Push:
    """Actuators (e,) between frames `node` (e, 2): each acts on the second, and the opposite on the first.

    `arm` (e, 2, 3), m, leads to where it acts, as seen from the frames. Of size one it exerts `wrench` (e, 6), N and
    N m, in axes that turn with the first frame; without, a force along the line from the first end to the second.
    """

    node: Index
    arm: Array
    wrench: Array | None
    size: float | Array = 0.0

    @property
    def coupled(self) -> tuple[Index, ...]:
        """No members."""
        return ()

    def driven(self, command: float | Array) -> Push:
        """With forces or moments, N or N m."""
        return replace(self, size=command)

    def response(self, frames: Frames) -> Response:
        """No energy, and the forces and tangents of what it exerts (theory eq. G21)."""
        e = len(self.node)
        ends = Ends.of(frames, self.node, np.tile(np.eye(3), (e, 2, 1, 1)), self.arm)
        size = np.reshape(self.size, -1) * np.ones(e)
        if self.wrench is None:
            return Response(np.zeros(e), *pulled(ends, -size, np.zeros(e)))
        R, wrench = frames.R[self.node[:, 0]], size[:, None] * self.wrench
        f, m = ((R @ own[:, :, None])[..., 0] for own in (wrench[:, :3], wrench[:, 3:]))
        force, tangent = (np.zeros((e, *shape), like=f) for shape in ((2, 6), (2, 6, 2, 6)))
        for end, sign in ((0, 1.0), (1, -1.0)):
            a = ends.arm[:, end]
            force[:, end, :3], force[:, end, 3:] = sign * f, sign * (m + np.cross(a, f))
            tangent[:, end, :3, 0, 3:] -= sign * skew(f)
            tangent[:, end, 3:, 0, 3:] -= sign * (skew(m) + skew(a) @ skew(f))
            tangent[:, end, 3:, end, 3:] += sign * skew(f) @ skew(a)
            tangent[:, end, :, end] -= turned(force[:, end])
        return Response(np.zeros(e), force.reshape(e, 12), tangent.reshape(e, 12, 12))

    def material(self, frames: Frames) -> tuple[Array]:
        """They have no stiffness (e, 12, 12) of their own."""
        del frames
        return (np.zeros((len(self.node), 12, 12)),)

    def masses(self, frames: Frames) -> Array:
        """Nor mass (e, 12, 12)."""
        return self.material(frames)[0]

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What they exert in a state of motion."""
        del rates
        return Kinetics(self.response(frames).force, 0.0, 0.0)
