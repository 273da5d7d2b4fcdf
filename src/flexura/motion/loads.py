"""What a mechanism in large motion is loaded with: dead and follower loads, gravity and actuators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.beam import skew
from flexura.motion.elements import Frames, turned
from flexura.motion.model import MovingModel
from flexura.structure import Design


@dataclass(frozen=True)
class Loads:
    """Dead loads (6,) by node, N and N m, follower loads likewise in the turning axes of the nodes, gravity (3,),
    m/s^2, and by the names of actuators as placed how far stacks would expand freely, m, and with what forces and
    moments, N and N m, others act between two nodes."""

    dead: Mapping[int, Array]
    follower: Mapping[int, Array]
    gravity: Array
    actuators: Mapping[str, float] = field(default_factory=dict)

    def mixed(self, other: Loads, share: float) -> Loads:
        """Loads on the way to others, all in proportion."""
        return Loads(
            _mixed(self.dead, other.dead, share),
            _mixed(self.follower, other.follower, share),
            self.gravity + share * (other.gravity - self.gravity),
            _mixed(self.actuators, other.actuators, share),
        )

    def apart(self, other: Loads) -> float:
        """The largest difference from other loads, whatever its unit."""
        kinds = ((self.dead, other.dead), (self.follower, other.follower), (self.actuators, other.actuators))
        return max(*(_apart(*pair) for pair in kinds), float(np.abs(self.gravity - other.gravity).max()))

    @property
    def any(self) -> bool:
        """Whether anything is loaded."""
        return bool(self.dead or self.follower or self.actuators or self.gravity.any())

    def forces(self, model: MovingModel, frames: Frames) -> Array:
        """Dead and follower loads (n + 1, 6) on the frames."""
        found = np.zeros(model.dof.shape, like=frames.R)
        for node, wrench in self.dead.items():
            found[model.root[node]] += _at_root(model, frames, node, wrench[:3], wrench[3:])
        for node, wrench in self.follower.items():
            force, moment = frames.R[model.root[node]] @ wrench.reshape(2, 3, 1)
            found[model.root[node]] += _at_root(model, frames, node, force[:, 0], moment[:, 0])
        return found

    def external(self, model: MovingModel, frames: Frames) -> tuple[Array, Array]:
        """Dead and follower loads (n + 1, 6) on the frames, and their derivatives (n + 1, 6, 6) by displacements."""
        slope = np.zeros((*model.dof.shape, 6), like=frames.R)
        for node, wrench in self.dead.items():
            root = model.root[node]
            slope[root, 3:, 3:] += skew(wrench[:3]) @ skew(frames.R[root] @ model.arm[node])
        for node, wrench in self.follower.items():
            force, moment = frames.R[model.root[node]] @ wrench.reshape(2, 3, 1)
            own = _at_root(model, frames, node, force[:, 0], moment[:, 0])
            slope[model.root[node]] += turned(own[None])[0]
        return self.forces(model, frames), slope


def _at_root(model: MovingModel, frames: Frames, node: int, force: Array, moment: Array) -> Array:
    """A force and a moment (3,) at a node as they act (6,) on the frame that it follows."""
    arm = frames.R[model.root[node]] @ model.arm[node]
    return np.concatenate([force, moment + skew(arm) @ force])


def described_loads(design: Design) -> Loads:
    """The dead loads and the gravity that are described."""
    plan, values = design.plan, design.values
    wrenches = plan.loads.wrenches(values)
    numbers = plan.topology.numbers(list(wrenches)).tolist()
    return Loads(dict(zip(numbers, wrenches.values(), strict=True)), {}, plan.loads.gravity(values))


NO_LOADS = Loads({}, {}, np.zeros(3))


def _mixed(own: Mapping[Any, Any], there: Mapping[Any, Any], share: float) -> dict[Any, Any]:
    """Values by name or node on the way to others; what is not there is zero."""
    keys = dict.fromkeys((*own, *there))
    return {key: (1 - share) * own.get(key, 0.0) + share * there.get(key, 0.0) for key in keys}


def _apart(own: Mapping[Any, Any], there: Mapping[Any, Any]) -> float:
    """The largest difference of values by name or node."""
    found = [np.abs(np.subtract(own.get(key, 0.0), there.get(key, 0.0))).max() for key in (*own, *there)]
    return float(max(found, default=0.0))
