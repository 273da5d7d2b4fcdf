"""Nodes and directions of channels as universal files number them, with the nodes (15) and axes (18) that they need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.mechanism import DOF_NAMES
from flexura.structure import Channel, FullOrderModel

Triple = tuple[float, float, float]

_STRAIGHT = 1e-9
"""A direction is along an axis when its other components are no larger: far below the 6 digits of the format."""
_TURNS = ("rotation", "angular_velocity", "angular_acceleration", "moment")

_Key = tuple[str, Triple | None, Triple | None]
"""Node, or the name of a channel without one; its position and direction where a number of its own is due."""


class ChannelNumbers:
    """Numbers of nodes: those of a model from 1 in order, then those of channels that are at none or are oblique."""

    def __init__(self, model: FullOrderModel | None, channels: Sequence[Channel]) -> None:
        self._table: dict[_Key, int] = {}
        self._positions: dict[int, Array] = {}
        self._axes: dict[int, Array] = {}
        self._at: dict[str, Array] = {}
        if model is not None:
            topology, positions = model.plan.topology, model.positions
            for k, name in enumerate(topology.node_names):
                self._table[name, None, None], self._at[name] = k + 1, positions[k]
            self._positions = {int(k) + 1: positions[k] for k in np.flatnonzero(topology.has_position)}
        for channel in channels:
            if channel.position is not None:
                self._at.setdefault(_named(channel)[0], np.array(channel.position))
        for channel in channels:
            self._add(channel)

    def _add(self, channel: Channel) -> None:
        key = self._key(channel)
        if key in self._table:
            return
        number = self._table[key] = max(self._table.values(), default=0) + 1
        position = self._at.get(key[0]) if key[1] is None else np.array(key[1])
        if key[2] is not None:
            self._axes[number] = axes_along(np.array(key[2]))
            # axes belong to nodes, also those of a motion of the base, which is at no place
            position = np.zeros(3) if position is None else position
        if position is not None:
            self._positions[number] = position

    def _key(self, channel: Channel) -> _Key:
        node, _ = _named(channel)
        position, d = channel.position, channel.direction
        if position is not None and np.allclose(position, self._at[node], 0, 1e-9):
            position = None
        is_oblique = d is not None and channel.against is None and np.sum(np.abs(d) > _STRAIGHT) > 1
        return node, position, d if is_oblique else None

    def of(self, channel: Channel) -> tuple[int, int]:
        """Number of the node and code of the direction; 0 for a scalar."""
        key, d = self._key(channel), channel.direction
        number = self._table[key]
        if channel.against is not None:
            return number, 0
        if d is None:
            return number, _named(channel)[1]
        turns = 3 if channel.quantity in _TURNS else 0
        if key[2] is not None:
            return number, 1 + turns
        axis = int(np.argmax(np.abs(d)))
        return number, int(np.sign(d[axis])) * (axis + 1 + turns)

    def sets(self) -> list[dict[str, Any]]:
        """Datasets of axes and of all nodes."""
        found: list[dict[str, Any]] = []
        own = sorted(self._axes)
        if own:
            frames = np.array([self._axes[n] for n in own])
            zero = np.zeros((len(own), 3))
            axes = {"type": 18, "cs_num": own, "ref_cs_num": [0] * len(own), "cs_name": [f"node {n}" for n in own]}
            found.append({**axes, "ref_o": zero, "x_point": frames[:, 0], "xz_point": frames[:, 2]})
        if self._positions:
            labels = list(self._positions)
            places = np.round(np.array(list(self._positions.values())), 12) + 0.0
            zero = [0] * len(labels)
            systems = [n if n in self._axes else 0 for n in labels]
            nodes = {"type": 15, "node_nums": labels, "def_cs": zero, "disp_cs": systems, "color": zero}
            found.append({**nodes, **dict(zip("xyz", places.T.tolist(), strict=True))})
        return found


def entity(channel: Channel) -> str:
    """The node of a channel by name, or what stands for it."""
    return _named(channel)[0]


def axes_along(x: Array) -> Any:
    """Right-handed axes (3, 3), rows, whose first is along the unit vector x (3,)."""
    z = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z])


def _named(channel: Channel) -> tuple[str, int]:
    """Node and direction code of a channel: its own node, and else what a name such as `platform.tz` says."""
    node, _, dof = channel.name.partition(":")[0].rpartition(".")
    if not node or dof not in DOF_NAMES:
        return channel.node or channel.name, 0
    return channel.node or node, DOF_NAMES.index(dof) + 1
