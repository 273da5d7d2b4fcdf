"""How nodes move: small motions, linear in displacements, and finite ones, which turn."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from flexura.beam import skew
from flexura.motion import Frames
from flexura.structure import FullOrderModel
from flexura.view.scene.meshes import Array


class Motions(NamedTuple):
    """Motions of nodes: `shift` (..., n, 3), m, of where they are, and `turn` (..., n, 3, 3), global frame.

    What is fixed to a node at a distance d moves by `shift + turn @ d`. `is_finite` says that the identity and `turn`
    are a rotation; else `turn` is the vector product with small rotations.
    """

    shift: Array
    turn: Array
    is_finite: bool = False

    @staticmethod
    def small(u: Array) -> Motions:
        """Of displacements (..., n, 6), m and rad in any common scale."""
        return Motions(u[..., :3], skew(u[..., 3:]))

    @staticmethod
    def finite(model: FullOrderModel, frames: Frames) -> Motions:
        """Of frames of all nodes and the ground in a pose (theory of large motion, G1)."""
        topology, x = model.plan.topology, model.geometry.positions
        root = topology.root
        turn = frames.R[root] - np.eye(3)
        moved = frames.x[root] - x[root] + (turn @ (x - x[root])[..., None])[..., 0]
        placed = topology.has_position
        return Motions(np.where(placed[:, None], moved, 0.0), np.where(placed[:, None, None], turn, 0.0), True)

    def of(self, nodes: Any) -> Motions:
        """Those of some nodes, by numbers or a slice."""
        return Motions(self.shift[nodes], self.turn[nodes], self.is_finite)

    def carried(self, distance: Array) -> Array:
        """Motions (..., n, 3) of what is fixed to the nodes at distances (..., n, 3), m."""
        return self.shift + (self.turn @ distance[..., None])[..., 0]

    @property
    def rotations(self) -> Array:
        """Small rotations (..., n, 3)."""
        return self.turn[..., [2, 0, 1], [1, 2, 0]]
