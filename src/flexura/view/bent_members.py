"""Axes of members between nodes that have moved and turned as far as they like."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.view.meshes import Array, Index
from flexura.view.motions import Motions


class Stations(NamedTuple):
    """Stations s along members: in which element, and where in it, from 0 to 1 (s,), its length l (m, 1), m, the nodes
    (m, s, 2) at its ends, and where at rest the ends of the element are from these nodes (c, m, s, 2, 3), m."""

    share: Array
    length: Array
    nodes: Index
    arms: Array


def bent_axes(stations: Stations, positions: Array, axes: Array, motions: Motions) -> tuple[Array, Array]:
    """Where stations are (c, m, s, 3), m, and the axes of their sections (c, m, s, 3, 3) as rows, global frame.

    positions: (c, n, 3) of nodes at rest, m; axes: (c, m, 3, 3) of members at rest as rows. Between the ends of an
    element, which move and turn with their nodes, its axis is the cubic that leaves both along their normals, and its
    section turns with the axis, and about it from one end to the other.
    """
    ends = motions.of((slice(None), stations.nodes))
    x = positions[:, stations.nodes] + stations.arms + ends.carried(stations.arms)
    own = axes[:, :, None, None] @ np.swapaxes(np.eye(3) + ends.turn, -1, -2)
    s, length = stations.share[:, None], stations.length[..., None]
    a, b = x[..., 0, :], x[..., 1, :]
    u, v = length * own[..., 0, 0, :], length * own[..., 1, 0, :]
    at = (1 + 2 * s) * (1 - s) ** 2 * a + s * (1 - s) ** 2 * u + s**2 * (3 - 2 * s) * b - s**2 * (1 - s) * v
    along = 6 * s * (1 - s) * (b - a) + (1 - s) * (1 - 3 * s) * u + s * (3 * s - 2) * v
    first = _unit(along)
    across = (1 - s) * own[..., 0, 1, :] + s * own[..., 1, 1, :]
    second = _unit(across - np.einsum("...i,...i->...", across, first)[..., None] * first)
    handed = np.linalg.det(axes).round()[:, :, None, None]
    return at, np.stack([first, second, handed * np.cross(first, second)], axis=-2)


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
