"""One mesh of everything, tied to the nodes of a beam model: no components, no reduction."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from flexura.fem import occ
from flexura.fem.geometry import ENDS, joints, solids
from flexura.fem.matrices import Face, elastic_matrices, face_ties
from flexura.fem.meshing import group_mesh
from flexura.fem.solid_mesh import SolidMesh
from flexura.structure.assembly import full_order
from helpers.direct_solids import lowest_modes


def solid_mesh(model, size=1.0, only=None, *, hexahedra=True, **limit):
    """One mesh of the members, or of those of the instance or member with the path `only`, piece by piece."""
    members = solids(model, only)
    groups = [[members[k] for k in group] for group in joints(model, members).groups]
    occ.check_intersections(members)
    return joined([group_mesh(group, size, hexahedra=hexahedra, **limit) for group in groups])


def joined(meshes):
    """Several meshes as one."""
    materials = tuple(dict.fromkeys(material for mesh in meshes for material in mesh.materials))
    first = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    kinds = dict.fromkeys(kind for mesh in meshes for kind in mesh.cells)
    cells, owners, parts, sets = {}, {}, {}, {}
    for kind in kinds:
        own = [(mesh, start) for mesh, start in zip(meshes, first, strict=False) if kind in mesh.cells]
        cells[kind] = np.concatenate([mesh.cells[kind] + start for mesh, start in own])
        owners[kind] = np.concatenate(
            [np.array([materials.index(m) for m in mesh.materials])[mesh.cell_materials[kind]] for mesh, _ in own]
        )
        parts[kind] = tuple(name for mesh, _ in own for name in mesh.parts[kind])
    for mesh, start in zip(meshes, first, strict=False):
        sets |= {name: points + start for name, points in mesh.point_sets.items()}
    return SolidMesh(np.concatenate([mesh.points for mesh in meshes]), cells, owners, materials, sets, parts)


def tied_names(model, members):
    """Names of the end faces that follow their nodes rigidly, such as `branch1.hinge start`."""
    return {f"{members[k].name} {ENDS[end]}" for k, end in np.argwhere(joints(model, members).tied)}


class Whole(NamedTuple):
    """K, M over the free DOFs of the mesh and then the DOFs `kept` of the beam model; T to all DOFs of the mesh."""

    K: sp.csc_matrix
    M: sp.csc_matrix
    T: sp.csc_matrix
    n_free: int
    kept: np.ndarray

    def node_displacements(self, model, vectors):
        """Displacements (nodes, 6, k); nan where no kept DOF tells them."""
        full = np.full((model.order, vectors.shape[1]), np.nan)
        full[self.kept] = vectors[self.n_free :]
        return model.node_displacements(full)


def set_ties(mesh, places, kind="rigid"):
    """Tie every point set to a node of its own."""
    faces = [
        Face(mesh.point_sets[name], np.asarray(place, dtype=float), k, kind)
        for k, (name, place) in enumerate(places.items())
    ]
    return face_ties(mesh, faces)


def with_discrete_elements(mesh, model, at_nodes, kind="rigid"):
    """A mesh with its sets tied to nodes of a beam model, with the discrete elements of that model and without its
    members."""
    numbers = model.plan.topology.numbers(list(at_nodes.values()))
    different = list(dict.fromkeys(numbers.tolist()))
    faces = [
        Face(mesh.point_sets[name], model.geometry.positions[number], different.index(number), kind)
        for name, number in zip(at_nodes, numbers, strict=True)
    ]
    ties = face_ties(mesh, faces)
    rows = model.design.node_rows(np.array(different))
    discrete_elements = full_order(model.plan).discrete_matrices(model.design)
    used = np.zeros(model.order, bool)
    for A in (*discrete_elements, rows):
        used[np.unique(sp.coo_matrix(A).col)] = True
    kept = np.flatnonzero(used)
    n = len(ties.free)
    T = sp.csc_matrix(ties.T @ sp.block_diag([sp.eye_array(n), rows[:, kept]]))
    padding = sp.csr_matrix((n, n))
    K, M = (
        sp.csc_matrix(T.T @ A @ T + sp.block_diag([padding, B[kept][:, kept]]))
        for A, B in zip(elastic_matrices(mesh), discrete_elements, strict=True)
    )
    return Whole(K, M, T, n, kept)


def whole_frequencies(model, n, size):
    """Frequencies, Hz, of tetrahedra of everything."""
    mesh = solid_mesh(model, size, hexahedra=False)
    members = solids(model)
    names = tied_names(model, members)
    node_names = model.plan.topology.node_names
    at = {
        f"{m.name} {end}": node_names[node]
        for m in members
        for end, node in zip(("start", "end"), m.nodes, strict=True)
    }
    whole = with_discrete_elements(mesh, model, {name: at[name] for name in at if name in names})
    return lowest_modes(whole.K, whole.M, n).frequency_hz
