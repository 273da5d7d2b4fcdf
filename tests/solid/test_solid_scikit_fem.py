"""Our matrices against those of scikit-fem (Gustafsson and McBain 2020), an independent finite element library."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import Basis, BilinearForm, ElementHex2, ElementTetP2, ElementVector, MeshHex, MeshTet
from skfem.helpers import ddot, dot, sym_grad, trace

from flexura.fem.geometry import SolidMaterial
from flexura.fem.matrices import elastic_matrices
from flexura.fem.solid_mesh import SolidMesh, shape_of

METAL = SolidMaterial("metal", 71.7e9, 0.33, 2810.0)
LAME = METAL.E * METAL.nu / ((1 + METAL.nu) * (1 - 2 * METAL.nu))
SHEAR = METAL.E / (2 * (1 + METAL.nu))


@BilinearForm
def stiffness(u, v, _):
    strain, other = sym_grad(u), sym_grad(v)
    return 2 * SHEAR * ddot(strain, other) + LAME * trace(strain) * trace(other)


@BilinearForm
def mass(u, v, _):
    return METAL.rho * dot(u, v)


def skewed(mesh):
    """A mesh whose inner points are moved, so that cells have no right angles."""
    x = mesh.p.copy()
    x[0] += 0.1 * x[1] * x[2] + 0.05 * x[1]
    x[2] += 0.2 * x[0] * x[1]
    return type(mesh)(x, mesh.t)


CASES = {
    "tetra10": (MeshTet.init_tensor(*(np.linspace(0, 1, n) for n in (3, 3, 2))), ElementTetP2()),
    "hexahedron27": (MeshHex.init_tensor(*(np.linspace(0, 1, n) for n in (3, 2, 3))), ElementHex2()),
}


@pytest.mark.parametrize("kind", CASES)
def test_matrices_are_those_of_scikit_fem(kind):
    rectilinear, element = CASES[kind]
    mesh = skewed(rectilinear)
    basis = Basis(mesh, ElementVector(element), intorder=5)
    exact = Basis(mesh, ElementVector(element), intorder=9 if kind == "hexahedron27" else 4)
    places = basis.doflocs.T
    points, point = np.unique(places.round(12), axis=0, return_inverse=True)
    point = point.ravel()
    # components of a vector element follow each other at every place
    component = np.zeros(len(point), dtype=int)
    for dofs in np.split(np.argsort(point, kind="stable"), len(points)):
        component[np.sort(dofs)] = np.arange(3)
    ours = SolidMesh(points, {kind: _cells(kind, mesh, points)}, {kind: np.zeros(mesh.nelements, int)}, (METAL,))
    number = 3 * point + component
    turn = sp.csr_matrix((np.ones(len(number)), (number, np.arange(len(number)))))
    for own, assembled in zip(elastic_matrices(ours), (stiffness.assemble(basis), mass.assemble(exact)), strict=True):
        theirs = turn @ assembled @ turn.T
        np.testing.assert_allclose(own.toarray(), theirs.toarray(), rtol=0, atol=1e-12 * abs(own).max())


def _cells(kind, mesh, points):
    """Points of every cell in our order, right-handed, found by where the mapping puts those of the reference cell."""
    local = shape_of(kind).points
    turned = local[:, [1, 0, 2]]
    both = []
    for own in (local, turned):
        xi = (own + 1) / 2 if kind == "hexahedron27" else own
        distance, number = cKDTree(points).query(np.moveaxis(mesh.mapping().F(np.ascontiguousarray(xi.T)), 0, -1))
        assert distance.max() < 1e-9
        both.append(number)
    axes = [[0, 1, 2, 3], [0, 1, 3, 4]][kind == "hexahedron27"]
    corners = points[both[0][:, axes]]
    is_right = np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0
    return np.where(is_right[:, None], both[0], both[1])
