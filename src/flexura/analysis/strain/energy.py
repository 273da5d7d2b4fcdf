"""Where the energy of a motion sits: strain and kinetic energy by placed part, member and kind of deformation; and what
of it, and so of frequencies and deflections, the meshes of solid parts leave uncertain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.beam import block_rotation, rigid_arm
from flexura.errors import Diagnostic
from flexura.mechanism import TOP, Superelement
from flexura.structure import FullOrderModel, Part, PartMatrices, Posed
from flexura.tables import in_hz

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
    posed = model.design.posed
    strains = {} if posed is None else _strains_at(model, posed, displacements)
    parts: list[PartEnergy] = []
    for name, matrices in model.matrices.items():
        part = model.plan.parts[name]
        for path, u in placed_motions(model, displacements, name):
            strain, kinetic = _elements(part, matrices, u)
            kinetic = kinetic.sum(axis=0)
            for discrete in matrices.discrete_elements:
                if discrete.M is not None:
                    kinetic += _quadratic(discrete.M, discrete.nodes, u)
            stiff = [(own.name, own.K, own.nodes) for own in matrices.discrete_elements if own.K is not None]
            if posed is not None:
                keys = (*part.members, *(key for key, *_ in stiff))
                by_name = {key: strains[".".join((*path, key))] for key in keys}
            else:
                ends = zip(part.members, part.first, part.counts, strict=False)
                by_name = {key: strain[:, first : first + n].sum(axis=1) for key, first, n in ends}
                for key, K, nodes in stiff:
                    by_name[key] = np.zeros((len(KINDS), u.shape[-1]))
                    by_name[key][-1] = _quadratic(K, nodes, u)
            parts.append(PartEnergy(".".join(path) or "mechanism", name, kinetic, by_name))
    return parts


def placed_motions(model: FullOrderModel, displacements: Array, name: str) -> Iterator[tuple[tuple[str, ...], Array]]:
    """Path of every placed copy of a prototype, and displacements (n, 6, k) of its nodes in its own frame,
    for those (n_nodes, 6, k) of all nodes, global frame, m and rad. At a pose that frame has turned with each node."""
    placed, part = model.plan.topology.copies[name], model.plan.parts[name]
    posed = model.design.posed
    for path, instance, offset in zip(placed.paths, placed.number, placed.offset, strict=True):
        Q = model.geometry.Q[instance].T
        turn = Q
        if posed is not None:
            turn = Q @ np.swapaxes(posed.rotations[offset : offset + part.n_positioned], -1, -2)
        turned = block_rotation(turn)
        turned[..., 3:, 3:] *= round(float(np.linalg.det(Q)))
        u = displacements[offset : offset + part.n_nodes].copy()
        u[: part.n_positioned] = turned @ u[: part.n_positioned]
        yield path, u


def element_strains(model: FullOrderModel, displacements: Array, name: str, copies: Sequence[int]) -> Array:
    """Strain energies (copies, e, k), J, of the elements of some copies, by number, of a prototype at rest, for
    displacements (n_nodes, 6, k) of all nodes, global frame, m and rad (theory eq. 60)."""
    part, matrices, wanted = model.plan.parts[name], model.matrices[name], set(copies)
    placed = enumerate(placed_motions(model, displacements, name))
    return np.stack([_elements(part, matrices, u)[0].sum(axis=0) for copy, (_, u) in placed if copy in wanted])


def _elements(part: Part, matrices: PartMatrices, u: Array) -> tuple[Array, Array]:
    """Strain (kinds, e, k) and kinetic energy (e, k) of the elements for node displacements u (n, 6, k)."""
    ends = u[part.connectivity].reshape(len(part.connectivity), 12, u.shape[-1])
    elements = matrices.elements
    v = matrices.T @ ends
    arm = np.zeros((len(v), 3))
    arm[:, 0] = elements.length
    d = v[:, 6:] - rigid_arm(arm) @ v[:, :6]
    strain = _by_kind(d * np.linalg.solve(elements.C, d) / 2, part.table.is_round[part.table.element_member])
    strain[1] += matrices.twist_shared(u[None])[0] * (elements.K[:, 9, None] @ v)[:, 0] / 2
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
            of_part = part.table.is_round[part.table.element_member][part.first[:-1]]
            for path in model.plan.topology.copies[name].paths:
                is_round |= {".".join((*path, key)): bool(r) for key, r in zip(part.members, of_part, strict=True)}
    strains: dict[str, Array] = {}
    for names, by_component, work in posed.works(displacements):
        if by_component is None or names[0] not in is_round:
            kinds = np.zeros((len(KINDS), *work.shape))
            kinds[-1] = work
        else:
            kinds = _by_kind(by_component, np.array([is_round[name] for name in names]))
        for e, name in enumerate(names):
            strains[name] = strains.get(name, 0.0) + kinds[:, e]
    return strains


def _quadratic(matrix: Array, nodes: Sequence[int], u: Array) -> Array:
    """Half of v' A v (k,) of the displacements v of some nodes of a part, of u (n, 6, k) of all."""
    v = u[nodes].reshape(6 * len(nodes), u.shape[-1])
    return np.einsum("ik,ij,jk->k", v, matrix, v) / 2


LIMIT = 0.02
"""Relative error of a frequency or deflection by its meshes above which a result says so."""

REACH = 0.7
"""Frequency up to which a part from CAD is right to 3e-4, measured, over that below which none of its modes with the
interfaces held is left out."""

RIGID_EIGENVALUE = 1e-10
"""Eigenvalues of a stiffness scaled to a unit diagonal below which a motion counts as rigid."""


@dataclass(frozen=True)
class PartMesh:
    """A superelement of which the error of the stiffness is known, by `SUBSTRUCTURE.NAME`.

    `size` of the cells is relative to the mesher's own choice, `dofs` those of the mesh, both None where they are not
    known. `stiffness_error` is the estimated relative error of the static stiffness between its nodes, in the direction
    where it is largest.
    """

    size: float | None
    dofs: int | None
    stiffness_error: float

    def __str__(self) -> str:
        mesh = "" if self.dofs is None else f"{self.dofs} DOFs, size {self.size:g}, "
        return f"{mesh}stiffness within {100 * self.stiffness_error:.2g} %"


@dataclass(frozen=True)
class MeshErrors:
    """Estimated errors by the meshes of solid parts in k motions (theory eq. B9).

    `share` (k,) is the uncertain part of all strain energy: about the relative error of a deflection, and twice that of
    a frequency. `part` (k,) names the placed part that adds most.
    """

    share: Array
    part: tuple[str, ...]


def part_meshes(model: FullOrderModel) -> dict[str, PartMesh]:
    """All superelements of which the error of the stiffness is known."""
    meshes = {}
    for name, prototype in model.plan.layout.prototypes.items():
        for key, part in prototype.superelements.items():
            if part.stiffness_error is not None:
                size, dofs = (None, None) if part.mesh is None else (part.mesh.size, part.mesh.dofs)
                worst = _worst_direction(part, part.stiffness_error.array)
                meshes[key if name == TOP else f"{name}.{key}"] = PartMesh(size, dofs, worst)
    return meshes


def _mesh_errors(model: FullOrderModel, displacements: Array, energy: Array) -> MeshErrors | None:
    """Errors of motions with displacements (n_nodes, 6, k) of all nodes, and strain energies (k,), J, of the whole.

    None where no part says how far off its stiffness may be. Motions without strain energy have no error.
    """
    uncertain: dict[str, Array] = {}
    for name, prototype in model.plan.layout.prototypes.items():
        errors = {key: part.stiffness_error for key, part in prototype.superelements.items()}
        known = {key: error.array for key, error in errors.items() if error is not None}
        for path, u in placed_motions(model, displacements, name) if known else ():
            for key, matrix in known.items():
                own, x = model.plan.parts[name].superelements[key], model.geometry.parts[name].positions
                E = np.pad(matrix, (0, 6 * len(own.nodes) - len(matrix)))
                uncertain[".".join((*path, key))] = _quadratic(own.over_nodes(E, x[own.nodes]), own.nodes, u)
    if not uncertain:
        return None
    each = np.array(list(uncertain.values()))
    share = np.divide(each.sum(axis=0), energy, out=np.zeros(len(energy)), where=energy > 0)
    names = list(uncertain)
    return MeshErrors(share, tuple(names[k] for k in each.argmax(axis=0)))


def frequency_errors(model: FullOrderModel, shapes: Array, frequency_hz: Array) -> MeshErrors | None:
    """Errors of modes with M-orthonormal `shapes` (n_nodes, 6, k); that of a frequency is half of the share."""
    return _mesh_errors(model, shapes, (2 * np.pi * frequency_hz) ** 2 / 2)


def motion_meshes(model: FullOrderModel, columns: Array, names: Sequence[str]) -> tuple[Diagnostic, ...]:
    """A warning for that of some motions, DOF vectors (n, k) with names, which meshes leave most uncertain."""
    if not columns.size:
        return ()
    energy = np.einsum("nk,nk->k", columns, model.K @ columns) / 2
    errors = _mesh_errors(model, model.node_displacements(columns), energy)
    if errors is None:
        return ()
    worst = int(errors.share.argmax())
    warning = mesh_warning("", f"the deflection {names[worst]}", float(errors.share[worst]), errors.part[worst])
    return () if warning is None else (warning,)


def mesh_warning(place: str, what: str, error: float, part: str) -> Diagnostic | None:
    """A warning that the meshes leave `what` uncertain, where they do by more than 2 %."""
    if not error > LIMIT:
        return None
    text = (
        f"{what} may be off by {100 * error:.2g} %, more than {100 * LIMIT:g} %, for the mesh of {part};"
        " a smaller mesh_size, mesh_tolerance of a part from CAD, or a finer mesh makes it less"
    )
    return Diagnostic("mesh", place, error, LIMIT, "1", text)


def part_warnings(model: FullOrderModel, frequency_hz: Array) -> Iterator[Diagnostic]:
    """Warnings of parts from CAD or meshes: frequencies (n,), Hz, that lie beyond those that they were reduced for, and
    meshes that are coarser than asked."""
    for name, prototype in model.plan.layout.prototypes.items():
        for key, part in prototype.superelements.items():
            mesh, place = part.mesh, key if name == TOP else f"{name}.{key}"
            if mesh is None:
                continue
            if mesh.error is not None and mesh.tolerance is not None and mesh.error > mesh.tolerance:
                found, wanted = (f"{100 * share:.2g} %" for share in (mesh.error, mesh.tolerance))
                text = f"frequencies of {place} may be off by {found} for its mesh, and {wanted} was asked"
                yield Diagnostic("mesh", place, mesh.error, mesh.tolerance, "1", f"{text}: a finer mesh makes it less")
            complete = mesh.complete_hz
            beyond = [] if complete is None else np.flatnonzero(frequency_hz > REACH * complete).tolist()
            if complete is not None and beyond:
                limit = in_hz(REACH * complete, 3)
                text = f"modes from {beyond[0] + 1} on lie beyond {limit}, up to which {place} has all of its own modes"
                value = float(frequency_hz[beyond[0]])
                yield Diagnostic("mesh", place, value, REACH * complete, "Hz", f"{text}: its up_to makes that more")


def _worst_direction(part: Superelement, E: Array) -> float:
    """The largest eigenvalue of E against K where K is not zero, over the nodes, which amplitudes follow statically."""
    c, K = 6 * len(part.nodes), part.stiffness.array
    follow = np.vstack([np.eye(c), -np.linalg.pinv(K[c:, c:], hermitian=True) @ K[c:, :c]])
    K, E = (follow.T @ A @ follow for A in (K, E))
    scale = np.sqrt(np.maximum(K.diagonal(), 0.0))
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = la.eigh(K / np.outer(scale, scale))
    strained = values > RIGID_EIGENVALUE
    half = vectors[:, strained] / np.sqrt(values[strained])
    return float(np.linalg.eigvalsh(half.T @ (E / np.outer(scale, scale)) @ half).max(initial=0.0))
