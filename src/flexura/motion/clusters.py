"""Superelements in large motion: linear inside, in a frame that turns with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.beam import skew
from flexura.motion.elements import Ends, Frames, Response
from flexura.motion.se3 import Logarithm

Array = NDArray[np.float64]
Index = NDArray[np.intp]

RIGID = 1e-6
"""Force of rigid motions over that of single displacements, from which a superelement is held by the ground."""


@dataclass(frozen=True)
class Cluster:
    """A superelement between frames `node` (1, k), whose deformation is the pose of all frames seen from the first.

    `own` frames come first, in axes (3, 3) at arms (own, 3), m, from their frames; the other frames hold amplitudes.
    `stiffness` acts on the changes of the logarithms of the relative poses, and on the amplitudes; `mass` (6k, 6k) on
    the velocities of the frames in the axes of the first.
    """

    node: Index
    own: int
    axes: Array
    arm: Array
    rest: Array
    stiffness: Array
    mass: Array

    @staticmethod
    def of(
        rest: Frames, ground: int, frames: Index, placed: NDArray[np.bool_], axes: Array, arm: Array, K: Array, M: Array
    ) -> Cluster:
        """A superelement with K and M (6k, 6k) over frames (k,), those with amplitudes instead of a place last.

        Where rigid motions meet resistance, the ground becomes the first frame.
        """
        own = int(placed.sum())
        x = rest.x[frames[:own]] + arm[:own]
        rigid = np.zeros((len(K), 6))
        for i in range(own):
            rigid[6 * i : 6 * i + 6] = np.eye(6)
            rigid[6 * i : 6 * i + 3, 3:] = np.cross(np.eye(3), axes.T @ (x[i] - x[0])).T
        size = np.abs(K).max(initial=0.0)
        if own < 2 or np.abs(K @ rigid).max() > RIGID * size * max(np.abs(rigid).max(), 1.0):
            frames, arm = np.append(ground, frames), np.concatenate([x[:1], arm])
            K, M = (np.pad(matrix, ((6, 0), (6, 0))) for matrix in (K, M))
            own += 1
        cluster = Cluster(frames[None], own, axes, arm[:own], np.zeros((own - 1, 6)), K, M)
        logs = cluster._poses(rest)
        J = np.eye(len(K) - 6)
        for i, after in enumerate(logs.after):
            J[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = np.linalg.inv(after)
        k = J.T @ K[6:, 6:] @ J
        return Cluster(frames[None], own, axes, arm[:own], logs.e, (k + k.T) / 2, M)

    def _ends(self, frames: Frames) -> Ends:
        """Pairs of the first frame with each of the others."""
        own = self.node[0, : self.own]
        pairs = np.stack([np.full(self.own - 1, own[0]), own[1:]], axis=1)
        arms = np.stack([np.tile(self.arm[0], (self.own - 1, 1)), self.arm[1:]], axis=1)
        return Ends.of(frames, pairs, np.tile(self.axes, (self.own - 1, 2, 1, 1)), arms)

    def _poses(self, frames: Frames) -> Logarithm:
        return self._ends(frames).relative()

    def deformation(self, frames: Frames) -> Array:
        """Changes (d,) of the logarithms of the relative poses, and amplitudes."""
        amplitudes = frames.z[self.node[0, self.own :]].ravel()
        return np.append((self._poses(frames).e - self.rest).ravel(), amplitudes)

    def response(self, frames: Frames) -> Response:
        """Energy, force and tangent in a state of the frames (theory eq. G3)."""
        ends, log = self._ends(frames), self._poses(frames)
        d = self.deformation(frames)
        n = self.stiffness @ d
        twists, B = ends.twists(), self._rows(ends, log)
        slope = np.zeros(B.T.shape)
        before, after = log.second(n[: 6 * (self.own - 1)].reshape(-1, 6))
        for i in range(self.own - 1):
            row, column = slice(6 * i, 6 * i + 6), slice(6 * i + 6, 6 * i + 12)
            slope[:6, row] = -twists[i, 0].T @ before[i]
            slope[column, row] = twists[i, 1].T @ after[i]
        K = (B.T @ self.stiffness + slope) @ B
        return Response(np.array([0.5 * n @ d]), (B.T @ n)[None], K[None])

    def _rows(self, ends: Ends, log: Logarithm) -> Array:
        """Derivatives (d, 6k) of the deformation by displacements of the frames."""
        twists, size = ends.twists(), 6 * self.node.shape[1]
        B = np.zeros((size - 6, size))
        B[6 * (self.own - 1) :, 6 * self.own :] = np.eye(size - 6 * self.own)
        for i in range(self.own - 1):
            row, column = slice(6 * i, 6 * i + 6), slice(6 * i + 6, 6 * i + 12)
            B[row, :6] = -log.before[i] @ twists[i, 0]
            B[row, column] = log.after[i] @ twists[i, 1]
        return B

    def material(self, frames: Frames) -> Array:
        """Derivatives (1, 6k, 6k) of the forces in a state, as if there were none in it (theory eq. G16)."""
        B = self._rows(self._ends(frames), self._poses(frames))
        return (B.T @ self.stiffness @ B)[None]

    def masses(self, frames: Frames) -> Array:
        """Mass matrix (1, 6k, 6k) by velocities of the frames."""
        ends = self._ends(frames)
        seen = Ends(ends.axes[:, :1].repeat(2, axis=1), ends.arm, ends.position).twists()
        T = np.eye(6 * self.node.shape[1])
        for i in range(self.own):
            T[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = seen[0, 0] if i == 0 else seen[i - 1, 1]
        return (T.T @ self.mass @ T)[None]


@dataclass(frozen=True)
class Sagging:
    """Weight of amplitudes of superelements, which act where these have turned.

    `node` (k, 2) holds the first frame of each superelement and one with amplitudes, `weight` (k, 6, 3) the forces on
    these per acceleration of free fall in the axes of the first, which have not turned at rest.
    """

    node: Index
    weight: Array

    @staticmethod
    def of(clusters: list[Cluster], rest: Frames) -> Sagging:
        """The weight of what moves inside superelements."""
        nodes, weights = [np.empty((0, 2), dtype=np.intp)], [np.empty((0, 6, 3))]
        for cluster in clusters:
            own, amplitudes = cluster.node[0, : cluster.own], cluster.node[0, cluster.own :]
            M = cluster.masses(rest)[0].reshape(-1, 6, len(own) + len(amplitudes), 6)
            nodes.append(np.stack([np.full(len(amplitudes), own[0]), amplitudes], axis=1))
            weights.append(M[cluster.own :, :, : cluster.own, :3].sum(axis=2))
        return Sagging(np.concatenate(nodes), np.concatenate(weights))

    def response(self, frames: Frames, gravity: Array) -> tuple[Array, Array]:
        """Forces (k, 12) of the weight, and their derivatives (k, 12, 12): those of the energy -z'WR'g."""
        first, amplitudes = self.node.T
        force, slope = np.zeros((len(first), 12)), np.zeros((len(first), 12, 12))
        by_direction = self.weight @ np.swapaxes(frames.R[first], -1, -2)
        centre = (frames.z[amplitudes][:, None] @ by_direction)[:, 0]
        force[:, 3:6], force[:, 6:] = np.cross(centre, gravity), by_direction @ gravity
        slope[:, 3:6, 3:6] = skew(gravity) @ skew(centre)
        slope[:, 6:, 3:6] = by_direction @ skew(gravity)
        slope[:, 3:6, 6:] = np.swapaxes(slope[:, 6:, 3:6], -1, -2)
        return force, slope
