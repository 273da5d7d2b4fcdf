"""What the meshes of solid parts leave uncertain: in the parts themselves, and in frequencies and deflections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from flexura.analysis.strain.energy import placed_motions, quadratic
from flexura.arrays import Array
from flexura.errors import Diagnostic
from flexura.mechanism import TOP, Superelement
from flexura.structure import FullOrderModel

LIMIT = 0.02
"""Relative error of a frequency or deflection by its meshes above which a result says so."""

NULL = 1e-10
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
    found = {}
    for name, prototype in model.plan.layout.prototypes.items():
        for key, own in prototype.superelements.items():
            if own.stiffness_error is not None:
                worst = _worst(own, own.stiffness_error.array)
                size, dofs = (None, None) if own.mesh is None else (own.mesh.size, own.mesh.dofs)
                found[key if name == TOP else f"{name}.{key}"] = PartMesh(size, dofs, worst)
    return found


def mesh_errors(model: FullOrderModel, displacements: Array, energy: Array) -> MeshErrors | None:
    """Errors of motions with displacements (n_nodes, 6, k) of all nodes, and strain energies (k,), J, of the whole.

    None where no part says how far off its stiffness may be. Motions without strain energy have no error.
    """
    uncertain: dict[str, Array] = {}
    for name, prototype in model.plan.layout.prototypes.items():
        known = {key: own.stiffness_error for key, own in prototype.superelements.items()}
        own = {key: matrix.array for key, matrix in known.items() if matrix is not None}
        for path, u in placed_motions(model, displacements, name) if own else ():
            for key, matrix in own.items():
                nodes = model.plan.parts[name].superelements[key][0]
                spare = 6 * len(nodes) - len(matrix)
                uncertain[".".join((*path, key))] = np.asarray(quadratic(np.pad(matrix, (0, spare)), nodes, u))
    if not uncertain:
        return None
    each = np.array(list(uncertain.values()))
    share = np.divide(each.sum(axis=0), energy, out=np.zeros(len(energy)), where=energy > 0)
    names = list(uncertain)
    return MeshErrors(share, tuple(names[k] for k in each.argmax(axis=0)))


def frequency_errors(model: FullOrderModel, shapes: Array, frequency_hz: Array) -> MeshErrors | None:
    """Errors of modes with M-orthonormal `shapes` (n_nodes, 6, k); that of a frequency is half of the share."""
    return mesh_errors(model, shapes, (2 * np.pi * frequency_hz) ** 2 / 2)


def motion_meshes(model: FullOrderModel, columns: Array, names: Sequence[str]) -> tuple[Diagnostic, ...]:
    """A warning for that of some motions, DOF vectors (n, k) with names, which meshes leave most uncertain."""
    if not columns.size:
        return ()
    energy = np.einsum("nk,nk->k", columns, model.K @ columns) / 2
    errors = mesh_errors(model, model.node_displacements(columns), energy)
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
        " a smaller mesh_size makes it less"
    )
    return Diagnostic("mesh", place, error, LIMIT, "1", text)


def _worst(own: Superelement, E: Array) -> float:
    """The largest eigenvalue of E against K where K is not zero, over the nodes, which amplitudes follow statically."""
    c, K = 6 * len(own.nodes), own.stiffness.array
    follow = np.vstack([np.eye(c), -np.linalg.pinv(K[c:, c:], hermitian=True) @ K[c:, :c]])
    K, E = (follow.T @ A @ follow for A in (K, E))
    scale = np.sqrt(np.maximum(K.diagonal(), 0.0))
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = la.eigh(K / np.outer(scale, scale))
    some = values > NULL
    half = vectors[:, some] / np.sqrt(values[some])
    return float(np.linalg.eigvalsh(half.T @ (E / np.outer(scale, scale)) @ half).max(initial=0.0))
