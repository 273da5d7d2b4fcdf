"""Internal forces of links and flexures from displacements of the full-order model (theory eq. S1)."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.duals import plain, zeros
from flexura.errors import OptionError
from flexura.structure import FullOrderModel, block_diagonal


def end_forces(model: FullOrderModel, name: str, states: Array, g: Array | None) -> tuple[Array, Array]:
    """Internal forces (i, e, 6, k) at the first and the second end of the elements of all copies (theory eq. S1); at a
    pose those that are there and what displacements from it add (theory eqs. G15, G26)."""
    if (posed := model.design.posed) is not None:
        added, there = posed.end_force_changes(states)[name], posed.end_forces[name]
        return there[0] + added[0], there[1] + added[1]
    placed, matrices = model.plan.topology.copies[name], model.matrices[name]
    v = element_motions(model, name, states)
    arm = zeros((v.shape[1], 3), matrices.elements.length)
    arm[:, 0] = matrices.elements.length
    D = rigid_arm(arm)
    d = v[:, :, 6:] - D @ v[:, :, :6]
    d[:, :, 3] = d[:, :, 3] + matrices.twist_shared(local_motions(model, name, states))
    at_end = np.linalg.inv(matrices.elements.C) @ d
    at_start = np.swapaxes(D, -1, -2) @ at_end
    if g is not None:
        local = zeros((len(placed.paths), v.shape[1], 12, 1), v)
        Q = np.swapaxes(model.geometry.Q[placed.number], -1, -2)[:, None]
        R = np.stack([matrices.T[:, :3, :3], matrices.T[:, 6:9, 6:9]], axis=1)
        local.reshape(*local.shape[:2], 2, 6)[..., :3] = (R @ (Q[:, :, None] @ g[:, None]))[..., 0]
        weight = matrices.elements.M @ local
        at_start, at_end = at_start + weight[:, :, :6], at_end - weight[:, :, 6:]
    return at_start, at_end


def force_changes(model: FullOrderModel, states: Array) -> dict[str, tuple[Array, Array]]:
    """What small displacements (n, k) from where the model is change of `end_forces`, by prototype with members."""
    if (posed := model.design.posed) is not None:
        return posed.end_force_changes(states)
    names = [name for name in model.matrices if model.plan.parts[name].members]
    return {name: end_forces(model, name, states, None) for name in names}


def element_motions(model: FullOrderModel, name: str, states: Array, at: Index | slice = slice(None)) -> Array:
    """Motions (i, e, 12, k) of both ends of elements `at` of all copies of a prototype, element axes."""
    part = model.plan.parts[name]
    v = local_motions(model, name, states)[:, part.connectivity[at]]
    return model.matrices[name].T[at] @ v.reshape(*v.shape[:2], 12, states.shape[1])


def local_motions(model: FullOrderModel, name: str, states: Array) -> Array:
    """Motions (i, nodes, 6, k) of the nodes with a place of all copies of a prototype, in its frame."""
    part, placed = model.plan.parts[name], model.plan.topology.copies[name]
    number = np.array(placed.offset)[:, None] + np.arange(part.n_named + len(part.mesh_member))
    Q = np.swapaxes(model.geometry.Q[placed.number], -1, -2)[:, None]
    axial = np.linalg.det(plain(Q)).round()[..., None, None] * Q
    whole = model.node_displacements(states)[number]
    return np.concatenate([Q @ whole[:, :, :3], axial @ whole[:, :, 3:]], axis=2)


@verb
def internal_force_rows(model: FullOrderModel, member: str, *, position: float = 0.5) -> sp.csr_matrix:
    """The map (6, n) from the model's DOFs to N, Vy, Vz, N, and T, My, Mz, N m, of a section (theory eq. S1); at a pose
    from small displacements to what they add (theory eq. G26).

    member: as placed, e.g. `branch1.hinge`; position: fraction of its length. Raises OptionError for unknown
    members and positions outside.
    """
    name, copy, k = find_member(model, member, position)
    part, matrices = model.plan.parts[name], model.matrices[name]
    n = int(part.counts[k])
    element = min(int(position * n), n - 1)
    e = int(part.first[k]) + element
    if (posed := model.design.posed) is not None:
        start, end = posed.end_force_changes(np.eye(model.order))[name]
        share = position * n - element
        return sp.csr_matrix((1 - share) * start[copy, e] + share * end[copy, e])
    length = float(matrices.elements.length[e])
    rest = length * (element + 1 - position * n)
    to_end, to_section = rigid_arm((length, 0.0, 0.0)), rigid_arm((rest, 0.0, 0.0))
    C = matrices.elements.C[e]
    P = np.linalg.solve(C, np.hstack([-to_end, np.eye(6)])) @ matrices.T[e]
    nodes = np.append(part.connectivity[part.first[k] : part.first[k + 1], 0], part.ends[k, 1])
    rows = np.zeros((6, 6 * len(nodes)))
    rows[:, 6 * element : 6 * element + 12] = P
    for strips in matrices.strips:
        if len(at := np.argwhere(strips.elements == e)):
            m, own = at[0]
            rows += np.linalg.inv(C)[:, 3:4] @ (strips.N[m, own : own + 1] @ strips.torque[m])
    G = model.design.node_transforms(name, nodes)[copy]
    topology = model.plan.topology
    dof = topology.dof[topology.root[topology.copies[name].offset[copy] + nodes]].ravel()
    rows = (to_section.T @ rows @ block_diagonal(G))[:, dof >= 0]
    dof = np.broadcast_to(dof[dof >= 0], rows.shape)
    at = np.broadcast_to(np.arange(6)[:, None], rows.shape)
    return sp.csr_matrix((rows.ravel(), (at.ravel(), dof.ravel())), shape=(6, model.order))


def find_member(model: FullOrderModel, member: str, position: float) -> tuple[str, int, int]:
    """Prototype, copy and number of a placed member."""
    if not 0 <= position <= 1:
        raise OptionError(f"a position is a fraction of the member's length, from 0 to 1, not {position!r}")
    *path, key = member.split(".")
    for name, placed in model.plan.topology.copies.items():
        if tuple(path) in placed.paths and key in placed.part.members:
            return name, placed.paths.index(tuple(path)), list(placed.part.members).index(key)
    copies = model.plan.topology.copies.values()
    known = [".".join((*path, name)) for placed in copies for path in placed.paths for name in placed.part.members]
    raise OptionError(unknown_member(member, known))


def unknown_member(name: str, known: list[str]) -> str:
    """What is said of a link or flexure that is not there."""
    shown = ", ".join(known[:4]) + (", ..." if len(known) > 4 else "")
    return f"there is no link or flexure {name!r}; there are {shown or 'none'}"


def finite_numbers(what: str, value: ArrayLike, n: int) -> Array:
    """A vector (n,) from what a caller gave. Raises OptionError when it is none."""
    try:
        vector = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        vector = np.empty(0)
    if vector.shape != (n,) or not np.isfinite(vector).all():
        raise OptionError(f"{what} is a list of {n} finite numbers, not {value!r}") from None
    return vector
