"""Stiffness of a mechanism about a displaced state: small strains, rotations that are not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from flexura.analysis.strain.numbers import finite_numbers
from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.beam import arm_stiffness, geometric_stiffness, rigid_arm, skew
from flexura.errors import OptionError
from flexura.structure import FullOrderModel, Scatter, Segments, segments

_MEAN = np.vstack([-np.eye(6) / 2, np.eye(6) / 2])
"""End motions (12, 6) of an element from its deformation, about a frame that turns with the mean of both ends."""


class _Elements(NamedTuple):
    """All placed elements: DOFs (e, 2, 6) of the nodes that their ends follow, -1 where held; arms (e, 2, 3) from there
    to the ends, m, global frame; axes E (e, 3, 3) that carry global vectors into right-handed element axes; the sign
    (e,) of true local axes; length (e,), m; deformation per load C (e, 6, 6); and G (e, 6, 6), geometric stiffness
    per axial force, of the deformation."""

    dof: Index
    arm: Array
    E: Array
    sign: Array
    length: Array
    C: Array
    G: Array


@verb
def tangent_stiffness(
    model: FullOrderModel, u: ArrayLike, *, loads: Mapping[str, ArrayLike] | None = None
) -> sp.csc_matrix:
    """K_t (n, n): the stiffness of a mechanism about its displaced state u (n,), m and rad (theory eqs. S13-S21).

    Elements, rigid arms and bodies turn with the displacement, members shorten as they bend and twist, and internal
    forces of the linear response add their geometric stiffness. Rows and columns are small translations and rotations
    about the displaced state, global frame. K_t(0) = K, and K_t is symmetric. `loads`, (6,) N and N m by node, are
    needed only where dead forces act on rigid arms.

    Correct to first order in u: internal forces are those of small displacements. Springs, superelements and piezo
    stacks do not turn. Raises OptionError for displacements that do not fit, unknown nodes, and springs on rigid arms.
    """
    state = finite_numbers("displacements", u, model.order)
    model.plan.refuse_pose("the stiffness about linear displacements")
    _refuse_springs_on_arms(model)
    cut = segments(model, tapered_pieces=1, roots=False)
    elements = _elements(model, cut)
    K, force, arm = _element_tangents(elements, np.append(state, 0.0)[elements.dof])
    dof = elements.dof.reshape(-1, 6)
    force, arm = force.reshape(-1, 3), arm.reshape(-1, 3)
    for at, own_force, own_arm in dead_load_arms(model, state, loads or {}):
        dof, force, arm = np.vstack([dof, at]), np.vstack([force, -own_force]), np.vstack([arm, own_arm])
    turning = Scatter([dof[:, 3:]], model.order).sparse([arm_stiffness(force, arm)])
    K_t = cut.scatter().sparse([K]) + turning + cut.K
    return ((K_t + K_t.T) / 2).tocsc()


def _refuse_springs_on_arms(model: FullOrderModel) -> None:
    """Raise OptionError where a spring, superelement or piezo stack pulls on a rigid arm: how its force turns is not
    known."""
    topology = model.plan.topology
    for name, placed in topology.copies.items():
        part = model.plan.parts[name]
        ends = [n for spring in part.springs.values() for n in spring.nodes]
        ends += [n for nodes, *_ in part.superelements.values() for n in nodes]
        ends += [n for piezo in part.channels.piezos.values() for n in piezo.nodes]
        number = np.array(placed.offset, dtype=np.intp)[:, None] + np.array(sorted(set(ends)), dtype=np.intp)
        if (topology.is_rigid[number] & (topology.root[number] != number)).any():
            where = name or "the mechanism"
            what = "spring, superelement or piezo stack"
            raise OptionError(f"a {what} of {where} is attached off a body's centre: use a short link")


def dead_load_arms(model: FullOrderModel, u: Array, loads: Mapping[str, ArrayLike]) -> list[tuple[Index, Array, Array]]:
    """DOFs (6,) of the node that every loaded node follows, the force (3,) and the arm (3,) as turned by u (n,)."""
    topology, found = model.plan.topology, []
    for node, value in loads.items():
        number = int(topology.numbers([node])[0])
        force = finite_numbers(f"load on {node}", value, 6)[:3]
        if topology.is_rigid[number]:
            root = topology.root[number]
            arm = model.geometry.positions[number] - model.geometry.positions[root]
            turn = np.append(u, 0.0)[topology.dof[root, 3:]]
            found.append((topology.dof[root], force, Rotation.from_rotvec(turn).apply(arm)))
    return found


def _elements(model: FullOrderModel, cut: Segments) -> _Elements:
    """The elements of a model, cut into one segment each."""
    axes = cut.X[..., 3:, 3:]
    true = cut.X[..., :3, :3]
    lever = -np.swapaxes(true, -1, -2) @ cut.X[..., :3, 3:]
    arm = np.stack([lever[..., 2, 1], lever[..., 0, 2], lever[..., 1, 0]], axis=-1)
    flexibility = [
        np.tile(own.elements.C, (len(model.plan.topology.copies[name].paths), 1, 1))
        for name, own in model.matrices.items()
        if len(model.plan.parts[name].connectivity)
    ]
    beam = cut.beam.take(cut.kind)
    length = np.asarray(beam.length)
    half = np.zeros((len(length), 3))
    half[:, 0] = length / 2
    to_mean = rigid_arm(-half)
    C = to_mean @ np.concatenate([np.empty((0, 6, 6)), *flexibility]) @ np.swapaxes(to_mean, -1, -2)
    G = _MEAN.T @ geometric_stiffness(np.ones(len(length)), beam) @ _MEAN
    return _Elements(cut.dof, arm, axes[:, 0], np.linalg.det(true[:, 0]).round(), length, C, G)


def _element_tangents(elements: _Elements, u: Array) -> tuple[Array, Array, Array]:
    """Tangents (e, 12, 12) over the DOFs of the elements for displacements u (e, 2, 6), forces (e, 2, 3) of the nodes
    on the ends, N, and arms (e, 2, 3) as turned, m, global frame."""
    sign = elements.sign[:, None]
    d, k = _deformation(elements, u), np.linalg.inv(elements.C)
    load = (k @ d[..., None])[..., 0]
    bow = (elements.G @ d[..., None])[..., 0]
    stretch = k[:, 0, 0, None, None]
    k = k + load[:, 0, None, None] * elements.G + stretch * bow[:, :, None] * bow[:, None, :]
    k[:, 0] += stretch[:, 0] * bow
    k[:, :, 0] += stretch[:, 0] * bow
    flip = np.concatenate([np.repeat(sign, 3, axis=1), np.ones((len(sign), 3))], axis=1)
    k *= flip[:, :, None] * flip[:, None, :]
    f, m = sign * load[:, :3], load[:, 3:]

    turn = Rotation.from_rotvec(u[..., 3:].reshape(-1, 3))
    arm = turn.apply(elements.arm.reshape(-1, 3)).reshape(-1, 2, 3)
    first, second = (Rotation.from_rotvec(u[:, end, 3:]) for end in (0, 1))
    half = Rotation.from_rotvec((first.inv() * second).as_rotvec() / 2)
    E = elements.E @ np.swapaxes((first * half).as_matrix(), -1, -2)
    axis = elements.length[:, None] * sign * elements.E[:, 0]
    ends = u[..., :3] + arm - elements.arm
    chord = (E @ (axis + ends[:, 1] - ends[:, 0])[..., None])[..., 0]
    B, H = _kinematics(chord, d[:, 3:], f, m)
    T = _end_motions(E, arm)
    K = np.swapaxes(T, -1, -2) @ (np.swapaxes(B, -1, -2) @ k @ B + H) @ T
    force = (np.swapaxes(E, -1, -2) @ f[..., None])[..., 0]
    return K, np.stack([-force, force], axis=1), arm


def _deformation(elements: _Elements, u: Array) -> Array:
    """Linear deformation (e, 6), local axes: of the ends against a frame that turns with their mean rotation."""
    ends = u[..., :3] + np.cross(u[..., 3:], elements.arm)
    axis = (elements.sign * elements.length)[:, None] * elements.E[:, 0]
    mean = u[:, :, 3:].mean(axis=1)
    shift = ends[:, 1] - ends[:, 0] - np.cross(mean, axis)
    moved = (elements.E @ np.stack([shift, u[:, 1, 3:] - u[:, 0, 3:]], axis=-1)).swapaxes(-1, -2)
    moved[:, 0] *= elements.sign[:, None]
    return moved.reshape(-1, 6)


def _kinematics(chord: Array, bend: Array, f: Array, m: Array) -> tuple[Array, Array]:
    """First variation B (e, 6, 12) of the deformation with the motion of the ends, and the stiffness H (e, 12, 12) of
    forces f and moments m (e, 3) against its second variation, element axes (theory eqs. S17-S19)."""
    one, C = np.broadcast_to(np.eye(3), (len(f), 3, 3)), skew(chord)
    W = skew(bend) / 8
    mean = (one / 2 + W, one / 2 - W)
    B = np.zeros((len(f), 6, 12))
    B[:, :3, :3], B[:, :3, 6:9] = -one, one
    B[:, 3:, 3:6], B[:, 3:, 9:] = -one, one
    for at, share in zip((slice(3, 6), slice(9, 12)), mean, strict=True):
        B[:, :3, at] = C @ share
    H = np.zeros((len(f), 12, 12))
    F, M, swing = skew(f) / 2, skew(m) / 2, arm_stiffness(f, chord) / 4
    for a in (slice(3, 6), slice(9, 12)):
        H[:, :3, a], H[:, 6:9, a] = F, -F
        H[:, a, :3], H[:, a, 6:9] = -F, F
        for b in (slice(3, 6), slice(9, 12)):
            H[:, a, b] = swing
    H[:, 3:6, 9:] += M
    H[:, 9:, 3:6] -= M
    return B, H


def _end_motions(E: Array, arm: Array) -> Array:
    """T (e, 12, 12): motions of the ends in element axes from those of the nodes that they follow."""
    T = np.zeros((len(E), 12, 12))
    D = rigid_arm(arm)
    for end in (0, 1):
        six = slice(6 * end, 6 * end + 6)
        T[:, six, six] = D[:, end]
    for k in range(4):
        three = slice(3 * k, 3 * k + 3)
        T[:, three] = E @ T[:, three]
    return T
