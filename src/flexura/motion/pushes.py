"""Forces and moments that actuators exert between two frames, wherever these move."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.motion.bars import pulled
from flexura.motion.elements import Ends, Frames, Kinetics, Rates, Response, turned


@dataclass(frozen=True)
class Push:
    """An actuator between frames `node` (1, 2): it acts on the second, and the opposite on the first.

    `arm` (1, 2, 3), m, leads to where it acts, as seen from the frames. Of size one it exerts `wrench` (6,), N and N m,
    in axes that turn with the first frame; without, a force along the line from the first end to the second.
    """

    node: Index
    arm: Array
    wrench: Array | None
    size: float = 0.0

    def driven(self, command: float) -> Push:
        """With a force or a moment, N or N m."""
        return replace(self, size=command)

    def response(self, frames: Frames) -> Response:
        """No energy, and the forces and tangents of what it exerts (theory eq. G21)."""
        ends = Ends.of(frames, self.node, np.tile(np.eye(3), (1, 2, 1, 1)), self.arm)
        if self.wrench is None:
            return Response(np.zeros(1), *pulled(ends, np.array([-self.size]), np.zeros(1)))
        R = frames.R[self.node[0, 0]]
        f, m = self.size * R @ self.wrench[:3], self.size * R @ self.wrench[3:]
        force, tangent = (np.zeros(size, like=f) for size in ((2, 6), (2, 6, 2, 6)))
        for end, sign in ((0, 1.0), (1, -1.0)):
            a = ends.arm[0, end]
            force[end, :3], force[end, 3:] = sign * f, sign * (m + np.cross(a, f))
            tangent[end, :3, 0, 3:] -= sign * skew(f)
            tangent[end, 3:, 0, 3:] -= sign * (skew(m) + skew(a) @ skew(f))
            tangent[end, 3:, end, 3:] += sign * skew(f) @ skew(a)
            tangent[end, :, end] -= turned(force[end][None])[0]
        return Response(np.zeros(1), force.reshape(1, 12), tangent.reshape(1, 12, 12))

    def material(self, frames: Frames) -> Array:
        """It has no stiffness (1, 12, 12) of its own."""
        del frames
        return np.zeros((1, 12, 12))

    def masses(self, frames: Frames) -> Array:
        """Nor mass (1, 12, 12)."""
        return self.material(frames)

    def kinetics(self, frames: Frames, rates: Rates) -> Kinetics:
        """What it exerts in a state of motion."""
        del rates
        return Kinetics(self.response(frames).force, 0.0, 0.0)
