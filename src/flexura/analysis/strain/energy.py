"""Where the energy of a motion sits: strain and kinetic energy by placed part, member and kind of deformation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.beam import block_rotation, rigid_arm
from flexura.structure import FullOrderModel, Part, PartMatrices, Posed

KINDS = ("stretch", "twist", "bending", "thickness bending", "width bending", "spring")
"""Kinds of deformation: thickness bending is about local y, width bending about local z, and bending that of round
members, where the two are alike; spring stands for springs and superelements."""


@dataclass(frozen=True)
class PartEnergy:
    """Energies of one placed part for k motions: kinetic (k,) per unit angular frequency squared, and strain
    (kinds, k) of every member, spring and superelement, J."""

    path: str
    prototype: str
    kinetic: Array
    strain: dict[str, Array]


def energies(model: FullOrderModel, displacements: Array) -> list[PartEnergy]:
    """Energies of every placed part for displacements (n_nodes, 6, k) of all nodes, global frame, m and rad
    (theory eq. 60)."""
    return list(_energies(model, displacements))


def placed_motions(model: FullOrderModel, displacements: Array, name: str) -> Iterator[tuple[tuple[str, ...], Array]]:
    """Path of every placed copy of a prototype, and displacements (n, 6, k) of its nodes in its own frame,
    for those (n_nodes, 6, k) of all nodes, global frame, m and rad. At a pose that frame has turned with each node."""
    placed, part = model.plan.topology.copies[name], model.plan.parts[name]
    posed = model.design.posed
    for path, instance, offset in zip(placed.paths, placed.number, placed.offset, strict=True):
        Q = model.geometry.Q[instance].T
        own = slice(offset, offset + part.n_positioned)
        turn = Q if posed is None else Q @ np.swapaxes(posed.rotations[own], -1, -2)
        turned = block_rotation(turn)
        turned[..., 3:, 3:] *= round(float(np.linalg.det(Q)))
        u = displacements[offset : offset + part.n_nodes].copy()
        u[: part.n_positioned] = turned @ u[: part.n_positioned]
        yield path, u


def _energies(model: FullOrderModel, displacements: Array) -> Iterator[PartEnergy]:
    posed = model.design.posed
    strains = {} if posed is None else _strains_at(model, posed, displacements)
    for name, matrices in model.matrices.items():
        part = model.plan.parts[name]
        for path, u in placed_motions(model, displacements, name):
            strain, kinetic = _elements(part, matrices, u)
            by_name = {
                member: strain[:, first : first + n].sum(axis=1)
                for member, first, n in zip(part.members, part.first, part.counts, strict=False)
            }
            kinetic = kinetic.sum(axis=0)
            for discrete in matrices.discrete_elements:
                kinetic += quadratic(discrete.M, discrete.nodes, u)
                if discrete.K is not None:
                    by_name[discrete.name] = np.zeros((len(KINDS), u.shape[-1]))
                    by_name[discrete.name][-1] = quadratic(discrete.K, discrete.nodes, u)
            if posed is not None:
                by_name = {key: strains[".".join((*path, key))] for key in by_name}
            yield PartEnergy(".".join(path) or "mechanism", name, kinetic, by_name)


def element_strains(model: FullOrderModel, displacements: Array, name: str, copies: Sequence[int]) -> Array:
    """Strain energies (copies, e, k), J, of the elements of some copies, by number, of a prototype at rest, for
    displacements (n_nodes, 6, k) of all nodes, global frame, m and rad (theory eq. 60)."""
    part, matrices, wanted = model.plan.parts[name], model.matrices[name], set(copies)
    found = [
        _elements(part, matrices, u)[0].sum(axis=0)
        for c, (_, u) in enumerate(placed_motions(model, displacements, name))
        if c in wanted
    ]
    return np.stack(found)


def _elements(part: Part, matrices: PartMatrices, u: Array) -> tuple[Array, Array]:
    """Strain (kinds, e, k) and kinetic energy (e, k) of the elements for node displacements u (n, 6, k)."""
    ends = u[part.connectivity].reshape(len(part.connectivity), 12, u.shape[-1])
    elements = matrices.elements
    v = matrices.T @ ends
    arm = np.zeros((len(v), 3))
    arm[:, 0] = elements.length
    d = v[:, 6:] - rigid_arm(arm) @ v[:, :6]
    strain = _by_kind(d * np.linalg.solve(elements.C, d) / 2, part.table.is_round[part.table.element_member])
    return strain, np.einsum("eik,eij,ejk->ek", v, elements.M, v) / 2


def _by_kind(work: Array, is_round: NDArray[np.bool_]) -> Array:
    """Strain energy (kinds, e, k) of elements from that (e, 6, k) by components of their deformation: along and across
    them, and about these axes."""
    across_thickness, across_width = work[:, 2] + work[:, 4], work[:, 1] + work[:, 5]
    round_ = is_round[:, None]
    either = np.where(round_, across_thickness + across_width, 0.0)
    thickness, width = (np.where(round_, 0.0, w) for w in (across_thickness, across_width))
    return np.stack([work[:, 0], work[:, 3], either, thickness, width, np.zeros_like(work[:, 0])])


def _strains_at(model: FullOrderModel, posed: Posed, displacements: Array) -> dict[str, Array]:
    """Strain energies (kinds, k) of members, springs and superelements as placed, of small motions from a pose."""
    is_round: dict[str, bool] = {}
    for name, part in model.plan.parts.items():
        if part.members:
            own = part.table.is_round[part.table.element_member][part.first[:-1]]
            for path in model.plan.topology.copies[name].paths:
                is_round |= {".".join((*path, key)): bool(r) for key, r in zip(part.members, own, strict=True)}
    found: dict[str, Array] = {}
    for names, by_component, work in posed.works(displacements):
        if by_component is None or names[0] not in is_round:
            kinds = np.zeros((len(KINDS), *work.shape))
            kinds[-1] = work
        else:
            kinds = _by_kind(by_component, np.array([is_round[name] for name in names]))
        for e, name in enumerate(names):
            found[name] = found.get(name, 0.0) + kinds[:, e]
    return found


def quadratic(matrix: Array | None, nodes: Sequence[int], u: Array) -> Array | float:
    """Half of v' A v (k,) of the displacements v of some nodes of a part, of u (n, 6, k) of all; zero for None."""
    if matrix is None:
        return 0.0
    v = u[nodes].reshape(6 * len(nodes), u.shape[-1])
    return np.einsum("ik,ij,jk->k", v, matrix, v) / 2
