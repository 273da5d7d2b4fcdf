"""Stiffness and mass of curved tetrahedra of some order, by NGSolve: meshes in millimetres, matrices in SI.

Isotropic linear elasticity with hierarchical shape functions (Schoeberl 1997, 2014, the programs); the mesh follows the
geometry by elements of the same order.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Bools, Index
from flexura.errors import OptionError, need
from flexura.fem.geometry import MILLIMETRE, SolidMaterial
from flexura.fem.two_orders import TwoOrders
from flexura.linalg import available_memory

MEMORY = 300.0
"""Bytes of matrices and factors over DOFs^(4/3), measured with Pardiso from 50 000 to 370 000 DOFs."""

ITERATIVE, SINGLE = 5200.0, 90.0
"""Bytes over DOFs of matrices and vectors where conjugate gradients solve, and over DOFs^(4/3) of the lower order of
its factor in single precision: their sum is that measured with Pardiso at 1 450 000 DOFs."""

DISTORTED = 6.0
"""Largest over least stretch of a cell, whose equations are factorised with those of the lower order."""


class CurvedElements:
    """The matrices of a mesh with elements of some order, of `materials` by the names that its solids have.

    `K`, N/m, and `M`, kg, are those of the `free` DOFs, numbers among all of `space`: those not on faces named
    `held`; `dofs` their number. Where factors of order `reduced` on the mesh would not fit into memory, K is one of
    `TwoOrders`. Raises OptionError, before they are made, where they and their factors would not fit
    into memory.
    """

    def __init__(
        self,
        mesh: Any,
        order: int,
        materials: Mapping[str, SolidMaterial],
        announce: Callable[[str], None] = lambda _: None,
        *,
        held: str = "",
        reduced: int = 0,
    ) -> None:
        self._ng = need("ngsolve", "solid")
        self.mesh: Any = mesh
        self.order: int = order
        self.materials: Mapping[str, SolidMaterial] = materials
        mesh.Curve(order)
        self.space: Any = self._ng.VectorH1(mesh, order=order, dirichlet=held)
        self.free: Index = np.flatnonzero(np.array(self.space.FreeDofs()))
        self.dofs: int = len(self.free)
        is_iterated = is_large(mesh, reduced)
        needed, free = memory_of(self.dofs), available_memory()
        if is_iterated:
            needed = iterative_memory(mesh, self.dofs)
        _refuse(self.dofs, needed, free, order)
        memory = f"about {needed / 1e9:.2g} GB of {free / 1e9:.3g} GB that are free"
        way = ", by conjugate gradients" if is_iterated else ""
        announce(f"{mesh.ne} cells of order {order}, {self.dofs} DOFs, {memory}{way}")
        self.M: sp.csr_matrix = self._mass()
        self.K: Any = self._stiffness()
        if is_iterated:
            self.K = TwoOrders(self.K, self._low, np.tile(np.arange(self.space.ndof // 3), 3))

    def _stiffness(self) -> sp.csr_matrix:
        ng = self._ng
        mu, lame, _ = self._constants
        u, v = self.space.TnT()
        strain, other = ng.Sym(ng.Grad(u)), ng.Sym(ng.Grad(v))
        K = ng.BilinearForm((2 * mu * ng.InnerProduct(strain, other) + lame * ng.div(u) * ng.div(v)) * ng.dx)
        return self._of_free(self._sparse(K, MILLIMETRE))

    def _mass(self) -> sp.csr_matrix:
        ng = self._ng
        u, v = ng.H1(self.mesh, order=self.order).TnT()
        M = self._sparse(ng.BilinearForm(self._constants[2] * u * v * ng.dx), MILLIMETRE**3)
        return self._of_free(sp.csr_matrix(sp.block_diag([M] * 3, format="csr")))

    def raised(self, vectors: Array) -> Array:
        """Vectors (n, k) of the same fields as those of one order less on the same mesh of tetrahedra, of order 2."""
        nv, edges = self.mesh.nv, self.mesh.nedge
        first = np.append(np.arange(nv), nv + (self.order - 1) * np.arange(edges))
        out = np.zeros((3, self.space.ndof // 3, vectors.shape[1]))
        out[:, first] = vectors.reshape(3, -1, vectors.shape[1])[:, : nv + edges]
        return out.reshape(-1, vectors.shape[1])

    @property
    def _low(self) -> Bools:
        """Which DOFs (n,) the lower order has, or belong to distorted cells, whose equations no smoothing solves."""
        ng, mesh = self._ng, self.mesh
        scalar = ng.H1(mesh, order=self.order)
        low = np.full(scalar.ndof, self.order < 3)
        low[: mesh.nv] = True
        low[mesh.nv + (self.order - 1) * np.arange(mesh.nedge)] = True  # the first one of every edge
        if low.all() or any(cell.type != ng.ET.TET for cell in mesh.Elements(ng.VOL)):
            return np.tile(low, 3)
        points = mesh.MapToAllElements(ng.IntegrationRule(ng.TET, 4), ng.VOL)
        J = np.asarray(ng.specialcf.JacobianMatrix(3)(points)).reshape(mesh.ne, -1, 3, 3)
        for cell in np.flatnonzero(np.linalg.cond(J).max(axis=1) > DISTORTED):
            low[list(scalar.GetDofNrs(ng.ElementId(ng.VOL, int(cell))))] = True
        return np.tile(low, 3)

    @cached_property
    def _constants(self) -> tuple[Any, Any, Any]:
        """Shear modulus and Lame's constant, Pa, and density, kg/m^3, by solid."""
        # not by `MaterialCF`, to which names are patterns
        solids = [self.materials[name] for name in self.mesh.GetMaterials()]
        mu = self._ng.CF([m.E / (2 * (1 + m.nu)) for m in solids])
        lame = self._ng.CF([m.E * m.nu / ((1 + m.nu) * (1 - 2 * m.nu)) for m in solids])
        return mu, lame, self._ng.CF([m.rho for m in solids])

    def _sparse(self, form: Any, unit: float) -> sp.csr_matrix:
        with self._ng.TaskManager():
            form.Assemble()
        value, column, start = (np.array(own) for own in form.mat.CSR())
        value *= unit
        n = len(start) - 1
        return sp.csr_matrix((value, column, start.astype(np.int32)), shape=(n, n))

    def _of_free(self, full: sp.csr_matrix) -> sp.csr_matrix:
        return full if self.dofs == full.shape[0] else full[self.free][:, self.free]

    @cached_property
    def rigid_motions(self) -> Array:
        """Coefficients (all, 6) of three translations and of three rotations about the global origin."""
        ng, coordinates = self._ng, []
        field = ng.GridFunction(ng.H1(self.mesh, order=self.order))
        for function in (ng.CF(1.0), ng.x, ng.y, ng.z):
            with ng.TaskManager():
                field.Set(function)
            coordinates.append(np.array(field.vec.FV().NumPy()))
        one, x, y, z = coordinates * np.array([1.0, MILLIMETRE, MILLIMETRE, MILLIMETRE])[:, None]
        no = np.zeros(len(one))
        motions = [(one, no, no), (no, one, no), (no, no, one), (no, -z, y), (z, no, -x), (-y, x, no)]
        return np.array(motions).reshape(6, -1).T.copy()

    @property
    def mass(self) -> float:
        """Mass of the solids, kg."""
        return float(self._ng.Integrate(self._constants[2], self.mesh)) * MILLIMETRE**3

    def loads(self, forms: list[Any]) -> Array:
        """Rows (f, all) of linear forms."""
        rows = np.empty((len(forms), self.space.ndof))
        for row, form in zip(rows, forms, strict=True):
            load = self._ng.LinearForm(form)
            load.Assemble()
            row[:] = load.vec.FV().NumPy()
        return rows

    def field(self, vector: Array) -> Any:
        """The field of displacements of a vector (dofs,)."""
        field = self._ng.GridFunction(self.space)
        field.vec[:] = 0.0
        field.vec.FV().NumPy()[self.free] = vector
        return field

    def motions_at(self, points: Array, vectors: Array) -> Array:
        """Displacements and rotations (half the curl), (p, 6, k), at points (p, 3), m, NaN outside, for vectors (n, k)
        of DOFs."""
        motions = np.full((len(points), 6, vectors.shape[1]), np.nan)
        if not len(points):
            return motions
        at = self.mesh(*(np.ascontiguousarray(c) for c in points.T / MILLIMETRE))
        inside = at["nr"] >= 0
        for k, vector in enumerate(vectors.T):
            field = self.field(vector)
            motions[inside, :3, k] = field(at[inside])
            G = np.asarray(self._ng.Grad(field)(at[inside])).reshape(-1, 3, 3) / MILLIMETRE
            curl = np.stack([G[:, 2, 1] - G[:, 1, 2], G[:, 0, 2] - G[:, 2, 0], G[:, 1, 0] - G[:, 0, 1]], axis=-1)
            motions[inside, 3:, k] = curl / 2
        return motions

    def stress(self, strain: Any) -> Any:
        """The field of stresses of a field of strains."""
        mu, lame, _ = self._constants
        return 2 * mu * strain + lame * self._ng.Trace(strain) * self._ng.Id(3)

    def unsmooth_energies(self, vectors: Array) -> Array:
        """Energies (cells, k), J, of what stresses of vectors (n, k) differ by from continuous ones of a lower order.

        Twice the strain energy that the mesh misses, about (Zienkiewicz and Zhu 1987).
        """
        ng = self._ng
        mu, lame, _ = self._constants
        smooth = ng.GridFunction(ng.MatrixValued(ng.H1(self.mesh, order=max(self.order - 1, 1)), symmetric=True))
        found = np.empty((self.mesh.ne, vectors.shape[1]))
        with ng.TaskManager():
            for k, vector in enumerate(vectors.T):
                stress = self.stress(ng.Sym(ng.Grad(self.field(vector))))
                smooth.Set(stress)
                off = smooth - stress
                mean = lame / (2 * mu * (2 * mu + 3 * lame))
                density = ng.InnerProduct(off, off) / (2 * mu) - mean * ng.Trace(off) ** 2
                found[:, k] = ng.Integrate(density, self.mesh, ng.VOL, element_wise=True).NumPy() * MILLIMETRE
        return found


def fit_forms(v: Any, at: list[Any], weight: Any, width: float, region: Any) -> list[Any]:
    """Linear forms of test functions v: weighted force and moment, over `width`, m, of these about a place from which
    `at` leads, m."""
    forms = [weight * v[i] * region for i in range(3)]
    return forms + [weight * (at[j] * v[k] - at[k] * v[j]) / width * region for j, k in ((1, 2), (2, 0), (0, 1))]


def dofs_of_order(mesh: Any, order: int) -> int:
    """DOFs that a mesh has with elements of some order."""
    return int(need("ngsolve", "solid").VectorH1(mesh, order=order).ndof)


def memory_of(dofs: float) -> float:
    """Bytes that matrices and factors of so many DOFs take, by experience."""
    return MEMORY * dofs ** (4 / 3)


def is_large(mesh: Any, order: int) -> bool:
    """Whether factors of elements of some order do not fit into memory; of none they do."""
    return order > 0 and memory_of(dofs_of_order(mesh, order)) > available_memory()


def iterative_memory(mesh: Any, dofs: float) -> float:
    """Bytes that conjugate gradients take for so many DOFs, with factors of the lower order, by experience."""
    return ITERATIVE * dofs + SINGLE * dofs_of_order(mesh, 2) ** (4 / 3)


def refuse_memory(dofs: float, order: int) -> None:
    """Raise OptionError where so many DOFs do not fit into memory."""
    _refuse(dofs, memory_of(dofs), available_memory(), order)


def _refuse(dofs: float, memory: float, free: float, order: int) -> None:
    if memory > free:
        raise OptionError(
            f"the whole part would have about {dofs:.2g} DOFs, which take some {memory / 1e9:.2g} GB, and "
            f"{free / 1e9:.2g} GB are free: a larger size, of a part mesh_tolerance, or a coarser mesh makes fewer"
            + (", of whole solids order 2 too" if order > 2 else "")
        )
