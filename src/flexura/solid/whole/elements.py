"""Curved tetrahedra of the glued part by NGSolve: mesh, stiffness and mass, and mean motions of patches."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.errors import OptionError, SolverError
from flexura.extras import need
from flexura.linalg import available_memory
from flexura.solid.geometry import MILLIMETRE, MemberSolid
from flexura.solid.whole.pieces import Block, Piece, beyond, thickness
from flexura.solid.whole.shapes import Part

SAME = 1e-4
"""Distance over the thickness up to which an edge lies in an end face."""
GRADING = 0.4
"""How fast tetrahedra grow away from fine places (netgen's own measure)."""
CURVATURE = 2.0
"""How many tetrahedra a radius of curvature is long, at least (netgen's own measure)."""
LEAF, ROD, NOTCH, BLOCK = 5.0, 1.5, 1.5, 1.0
"""Length of tetrahedra of size 1 over the thickness of what they are in."""
BUMP_ORDER = 14
"""Order of integration of bumps beyond that of the elements: a patch may be smaller than a cell."""
STATIONS = 81
"""Places along a contour at which its thickness bounds the length of tetrahedra."""
DOFS_OF_CELL = {2: 5.5, 3: 18.0, 4: 40.0, 5: 74.0}
"""DOFs over tetrahedra, of thin parts, by order."""
MEMORY = 300.0
"""Bytes of matrices and factors over DOFs^(4/3), measured with Pardiso from 50 000 to 370 000 DOFs."""


@dataclass(frozen=True)
class Patch:
    """A bump about `centre` (3,), m, that reaches `radii` (3,), m, along `axes` (3, 3) as rows."""

    centre: Array
    axes: Array
    radii: Array


class Elements:
    """The matrices of a meshed part with elements of some order, some pieces so many times as stiff.

    `K`, N/m, and `M`, kg, are those of the free DOFs; `dofs` their number. Raises OptionError, before they are made,
    where they and their factors would not fit into memory.
    """

    def __init__(
        self, part: Part, mesh: Any, order: int, announce: Callable[[str], None], stiffer: Mapping[int, float]
    ) -> None:
        self._ng = need("ngsolve", "solid")
        self.part: Part = part
        self.mesh: Any = mesh
        mesh.Curve(order)
        self._space: Any = self._ng.VectorH1(mesh, order=order, dirichlet="held")
        self._free: Index = np.flatnonzero(np.array(self._space.FreeDofs()))
        self.dofs: int = len(self._free)
        _refuse(self.dofs, order)
        memory = f"about {memory_of(self.dofs) / 1e9:.2g} GB of {available_memory() / 1e9:.3g} GB that are free"
        announce(f"{mesh.ne} cells of order {order}, {self.dofs} DOFs, {memory}")
        self.K, self.M = self._matrices(stiffer)

    def _matrices(self, stiffer: Mapping[int, float]) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        ng = self._ng
        own = {
            str(k): replace(piece.material, E=piece.material.E * stiffer.get(k, 1.0))
            for k, piece in enumerate(self.part.pieces.all)
        }
        mu = self.mesh.MaterialCF({k: m.E / (2 * (1 + m.nu)) for k, m in own.items()})
        lame = self.mesh.MaterialCF({k: m.E * m.nu / ((1 + m.nu) * (1 - 2 * m.nu)) for k, m in own.items()})
        rho = self.mesh.MaterialCF({k: m.rho for k, m in own.items()})
        u, v = self._space.TnT()
        strain, other = ng.Sym(ng.Grad(u)), ng.Sym(ng.Grad(v))
        K = ng.BilinearForm((2 * mu * ng.InnerProduct(strain, other) + lame * ng.div(u) * ng.div(v)) * ng.dx)
        M = ng.BilinearForm(rho * u * v * ng.dx)
        return self._sparse(K) * MILLIMETRE, self._sparse(M) * MILLIMETRE**3

    def _sparse(self, form: Any) -> sp.csr_matrix:
        form.Assemble()
        row, column, value = form.mat.COO()
        n = self._space.ndof
        full = sp.csr_matrix((np.array(value), (np.array(row), np.array(column))), shape=(n, n))
        return full[self._free][:, self._free]

    def motion(self, patch: Patch) -> sp.csr_matrix:
        """B (6, n): displacement of the centre and rotation of the rigid motion that fits a patch best, weighted by its
        bump, by the DOFs."""
        ng = self._ng
        at = [own * MILLIMETRE - c for own, c in zip((ng.x, ng.y, ng.z), patch.centre, strict=True)]
        weight: Any = 1.0
        for axis, radius in zip(patch.axes, patch.radii, strict=True):
            s = (axis[0] * at[0] + axis[1] * at[1] + axis[2] * at[2]) / radius
            weight = weight * ng.IfPos(1 - s * s, 1 - s * s, 0.0)
        region = ng.dx(definedonelements=self._cells_near(patch), bonus_intorder=BUMP_ORDER)
        v = self._space.TestFunction()
        width = float(patch.radii.max())
        forms = [weight * v[i] * region for i in range(3)]
        forms += [weight * (at[j] * v[k] - at[k] * v[j]) / width * region for j, k in ((1, 2), (2, 0), (0, 1))]
        rows = np.empty((6, self._space.ndof))
        for row, form in zip(rows, forms, strict=True):
            load = ng.LinearForm(form)
            load.Assemble()
            row[:] = load.vec.FV().NumPy()
        moved = rows @ (self._rigid_motions @ rigid_arm(-patch.centre))
        if not np.linalg.cond(moved * np.append(np.ones(3), np.full(3, 1 / width))) < 1e12:
            raise SolverError(f"too little of the mesh lies within {width:.3g} m of {patch.centre}")
        return sp.csr_matrix(np.linalg.solve(moved, rows[:, self._free]))

    @cached_property
    def _rigid_motions(self) -> Array:
        """Coefficients (all, 6) of three translations and of three rotations about the global origin."""
        ng = self._ng
        x, y, z = (own * MILLIMETRE for own in (ng.x, ng.y, ng.z))
        fields = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, -z, y), (z, 0, -x), (-y, x, 0)]
        field = ng.GridFunction(self._space)
        found = np.empty((self._space.ndof, 6))
        for k, own in enumerate(fields):
            field.Set(ng.CoefficientFunction(own))
            found[:, k] = field.vec.FV().NumPy()
        return found

    def _cells_near(self, patch: Patch) -> Any:
        """Which tetrahedra may reach into a patch."""
        centre, own = self._places
        local = np.abs((centre - patch.centre) @ patch.axes.T)
        near: NDArray[np.bool_] = np.asarray((local <= patch.radii + 1.5 * own[:, None]).all(axis=1))
        marked = self._ng.BitArray(len(near))
        marked.Clear()
        for k in np.flatnonzero(near).tolist():
            marked.Set(k)
        return marked

    @cached_property
    def _places(self) -> tuple[Array, Array]:
        """Centres (cells, 3) and radii (cells,) of the cells, m."""
        points = np.array([v.point for v in self.mesh.vertices]) * MILLIMETRE
        corners = [points[[v.nr for v in cell.vertices]] for cell in self.mesh.Elements(self._ng.VOL)]
        centre = np.array([own.mean(axis=0) for own in corners])
        return centre, np.array(
            [np.linalg.norm(own - at, axis=1).max() for own, at in zip(corners, centre, strict=True)]
        )

    @property
    def mass(self) -> float:
        """Mass of the solids, kg."""
        rho = self.mesh.MaterialCF({str(k): own.material.rho for k, own in enumerate(self.part.pieces.all)})
        return float(self._ng.Integrate(rho, self.mesh)) * MILLIMETRE**3

    def motions_at(self, points: Array, vectors: Array) -> Array:
        """Displacements and rotations (half the curl), (p, 6, k), at points (p, 3), m, NaN outside, for vectors (n, k)
        of DOFs."""
        ng = self._ng
        found = np.full((len(points), 6, vectors.shape[1]), np.nan)
        if not len(points):
            return found
        at = self.mesh(*(np.ascontiguousarray(c) for c in points.T / MILLIMETRE))
        inside = at["nr"] >= 0
        field = ng.GridFunction(self._space)
        gradient = ng.Grad(field)
        for k in range(vectors.shape[1]):
            field.vec[:] = 0.0
            field.vec.FV().NumPy()[self._free] = vectors[:, k]
            found[inside, :3, k] = field(at[inside])
            G = np.asarray(gradient(at[inside])).reshape(-1, 3, 3) / MILLIMETRE
            found[inside, 3:, k] = (
                np.stack([G[:, 2, 1] - G[:, 1, 2], G[:, 0, 2] - G[:, 2, 0], G[:, 1, 0] - G[:, 0, 1]], axis=-1) / 2
            )
        return found


def memory_of(dofs: float) -> float:
    """Bytes that matrices and factors of so many DOFs take, by experience."""
    return MEMORY * dofs ** (4 / 3)


def _refuse(dofs: float, order: int) -> None:
    memory, free = memory_of(dofs), available_memory()
    if memory > free:
        raise OptionError(
            f"the whole part would have about {dofs:.2g} DOFs, which take some {memory / 1e9:.2g} GB, and "
            f"{free / 1e9:.2g} GB are free: a larger size makes fewer" + (", order 2 too" if order > 2 else "")
        )


def length_of_cells(piece: Piece, size: float) -> float:
    """Largest length of tetrahedra in a piece, m."""
    if isinstance(piece, Block):
        return size * BLOCK * piece.thin
    outline = piece.outline
    if not outline.is_straight:
        return size * BLOCK * 2 * float(min(outline.y.max(), outline.z.max()))
    if outline.is_round:
        return size * ROD * (2 * float(outline.y[0]) if outline.inner == 0 else 3 * thickness(piece))
    return size * min(LEAF * thickness(piece), piece.length / 2)


def _fine_points(piece: MemberSolid, size: float) -> tuple[Array, Array]:
    """Points (p, 3), m, along the thin places of a contour and the lengths of tetrahedra (p,), m, there."""
    outline = piece.outline
    points, lengths = [], []
    coarse, last = length_of_cells(piece, size), -np.inf
    for x in np.linspace(0.0, piece.length, STATIONS):
        half_y, half_z = (float(h[0]) for h in outline.half(np.array([x])))
        h = size * NOTCH * 2 * min(half_y, half_z)
        if h >= coarse or x - last < h / 2:
            continue
        last = x
        wide = max(half_y, half_z) if not outline.is_round else 0.0
        across = np.linspace(-wide, wide, max(2, math.ceil(2 * wide / h)) + 1) if wide else np.zeros(1)
        none = 0 * across
        local = [none + x, across, none] if half_y >= half_z else [none + x, none, across]
        points.append(piece.placed(np.stack(local, axis=-1)))
        lengths.append(none + h)
    if not points:
        return np.empty((0, 3)), np.empty(0)
    return np.concatenate(points), np.concatenate(lengths)


def meshed(part: Part, order: int, size: float, announce: Callable[[str], None]) -> Any:
    """The mesh of a part for elements up to some order. Raises OptionError where these would not fit into memory, and
    SolverError where netgen fails."""
    ng = need("ngsolve", "solid")
    meshing, occ = need("netgen.meshing", "solid"), need("netgen.occ", "solid")
    _refuse(sum(_least_cells(piece, size) for piece in part.pieces.all) * DOFS_OF_CELL[order], order)
    pieces = part.pieces.all
    coarsest = max(length_of_cells(piece, size) for piece in pieces) / MILLIMETRE
    for solid in part.shape.solids:
        solid.maxh = length_of_cells(pieces[int(solid.name)], size) / MILLIMETRE
    graded = _mark_corners(part)
    parameters = meshing.MeshingParameters(maxh=coarsest, grading=GRADING, curvaturesafety=CURVATURE)
    for piece in part.pieces.members:
        if not piece.outline.is_straight:
            for p, h in zip(*_fine_points(piece, size), strict=True):
                x, y, z = p / MILLIMETRE
                parameters.RestrictH(x=x, y=y, z=z, h=h / MILLIMETRE)
    announce("mesh of the whole part")
    try:
        mesh = ng.Mesh(occ.OCCGeometry(part.shape).GenerateMesh(parameters))
    except Exception as error:
        raise SolverError(f"netgen could not mesh the part: {error}; another size may do") from None
    if graded:
        mesh.RefineHP(1)
    return mesh


def _least_cells(piece: Piece, size: float) -> float:
    """Tetrahedra that a piece has at least, about."""
    if isinstance(piece, Block):
        sizes = 2 * piece.half
    else:
        sizes = np.array([piece.length, 2 * float(piece.outline.y.max()), 2 * float(piece.outline.z.max())])
    return 5 * float(np.prod(np.maximum(sizes / length_of_cells(piece, size), 1.0)))


def _mark_corners(part: Part) -> bool:
    """Mark the edges at which members of one section come out of something wider: stresses there are infinite, and
    cells next to them are cut (hp refinement), so that the root gives what it does."""
    pieces, found = part.pieces, False
    touching: dict[int, set[int]] = {}
    for a, b in part.touching:
        touching.setdefault(a, set()).add(b)
        touching.setdefault(b, set()).add(a)
    for solid in part.shape.solids:
        k = int(solid.name)
        own = pieces.all[k]
        if isinstance(own, Block) or not own.outline.is_straight:
            continue
        thin = thickness(own)
        hosts = [pieces.all[j] for j in touching.get(k, ())]
        for edge in solid.edges:
            middle = edge.center
            at = own.local(np.array([middle.x, middle.y, middle.z]) * MILLIMETRE)
            end = at[0] > own.length / 2
            if abs(at[0] - own.length * end) > SAME * thin:
                continue
            out = at.copy()
            half = np.array([float(own.outline.y[0]), float(own.outline.z[0])])
            if own.outline.is_round:
                out[1:] = at[1:] * (1.2 if np.hypot(*at[1:]) > 0 else 1.0)
                if np.hypot(*at[1:]) == 0:
                    out[1] = half[0] * 1.2
            else:
                on = np.abs(np.abs(at[1:]) - half) < SAME * thin
                out[1:] += np.where(on, np.sign(at[1:]) * 0.1 * thin, 0.0)
            out[0] += (1 if end else -1) * 0.1 * thin
            if any(float(beyond(host, own.placed(out)[None])[0]) < 0 for host in hosts):
                edge.hpref = 1
                found = True
    return found
