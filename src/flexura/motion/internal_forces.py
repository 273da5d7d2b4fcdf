"""Internal forces of members in states of large motion, in their own axes, which turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexura.arrays import Array
from flexura.beam import skew
from flexura.motion.elements import PoseElements
from flexura.motion.equilibrium import Equilibrium
from flexura.motion.layout import MIRRORED
from flexura.motion.model import MovingModel

Ends = tuple[Array, Array]


def end_forces(model: MovingModel, states: Sequence[Equilibrium]) -> dict[str, Ends]:
    """Internal forces (i, e, 6, k) at the first and the second end of the elements of the i copies of each prototype
    with members in k states (theory eq. G15).

    They are N, Vy, Vz, N, and T, My, Mz, N m, in the axes of the members, which turn with the ends of elements, on the
    face towards the second end of the member.
    """
    if not states or not with_members(model):
        return {}
    elements = model.elements[0]
    assert isinstance(elements, PoseElements)
    return _by_prototype(model, *_in_own_axes(elements, states))


def end_force_changes(model: MovingModel, state: Equilibrium, moved: Array) -> dict[str, Ends]:
    """What small displacements (n + 1, 6, k) of the frames from a state change of `end_forces` (theory eq. G26)."""
    if not with_members(model):
        return {}
    elements, frames = model.elements[0], state.frames
    assert isinstance(elements, PoseElements)
    R = frames.R[elements.node]
    u = moved[elements.node].reshape(len(R), 12, moved.shape[-1])
    # derivatives leave out that forces turn with their frames: what is left is seen from axes that turn along
    held = (state.tangent.forces.responses[0].tangent @ u).reshape(len(R), 2, 6, u.shape[-1])
    back, arm = np.swapaxes(R @ elements.axes, -1, -2), (R @ elements.arm[..., None])[..., 0]
    moment = held[:, :, 3:] - np.cross(arm[..., None], held[:, :, :3], axis=2)
    own = np.concatenate([back @ held[:, :, :3], back @ moment], axis=2)
    gravity = state.loads.gravity
    if gravity.any():
        turning = moved[elements.node][:, :, 3:]
        per_fall = elements.mass.reshape(-1, 2, 6, 2, 6)[..., :3].sum(axis=3)
        own = own - per_fall @ (back @ skew(gravity) @ turning)
    return _by_prototype(model, -own[:, 0], own[:, 1])


def with_members(model: MovingModel) -> list[str]:
    """Names of the prototypes that have members."""
    parts = model.design.plan.parts
    return [name for name in model.design.matrices if len(parts[name].connectivity)]


def _by_prototype(model: MovingModel, start: Array, end: Array) -> dict[str, Ends]:
    """Forces (e, 6, k) at both ends of all elements, in right-handed axes, as those of the copies of prototypes."""
    topology, parts = model.design.plan.topology, model.design.plan.parts
    found, first = {}, 0
    for name in with_members(model):
        placed, count = topology.copies[name], len(parts[name].connectivity)
        own = slice(first, first + len(placed.paths) * count)
        mirrored = np.linalg.det(model.design.geometry.Q[placed.number]) < 0
        sign = np.where(mirrored[:, None], MIRRORED, 1.0)[:, None, :, None]
        shape = (len(placed.paths), count, 6, start.shape[-1])
        found[name] = (sign * start[own].reshape(shape), sign * end[own].reshape(shape))
        first = own.stop
    return found


def _in_own_axes(elements: PoseElements, states: Sequence[Equilibrium]) -> tuple[Array, Array]:
    """Internal forces (e, 6, k) at both ends of elements, in the right-handed axes of these ends."""
    R = np.stack([state.frames.R[elements.node] for state in states])
    held = np.stack([state.tangent.forces.responses[0].force for state in states]).reshape(len(states), -1, 2, 6)
    arm = (R @ elements.arm[..., None])[..., 0]
    back = np.swapaxes(R @ elements.axes, -1, -2)
    moment = held[..., 3:] - np.cross(arm, held[..., :3])
    own = np.concatenate([(back @ part[..., None])[..., 0] for part in (held[..., :3], moment)], axis=-1)
    gravity = np.stack([state.loads.gravity for state in states])[:, None, None, :, None]
    if gravity.any():
        per_fall = elements.mass.reshape(-1, 2, 6, 2, 6)[..., :3].sum(axis=3)
        own = own - (per_fall @ (back @ gravity))[..., 0]
    start, end = np.swapaxes(np.moveaxis(own, 0, -1), 0, 1)
    return -start, end
