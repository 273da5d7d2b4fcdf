"""Sheets: plane figures of one thickness as solids, reduced to the rigid pads along which they are held.

A figure has outlines in its plane, m, and is meshed by curved triangles by netgen. Displacements are polynomials of
degree two through the thickness with shape functions of a high order in the plane, by NGSolve (hierarchic plates, Szabo
and Sahrmann 1988).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import product
from operator import add, sub
from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.errors import SolverError, need
from flexura.fem.cache import Arrays, content_key, remembered
from flexura.fem.figures import Figure, Loop
from flexura.fem.geometry import MILLIMETRE, SolidMaterial
from flexura.fem.occ import GRADING, kernel, plane_face
from flexura.fem.reduced import IN_MEMORY, MOST_MODES, Announce, CondensedSolid, balanced, constraint_modes
from flexura.fem.surfaces import Surface
from flexura.linalg import factorise_large

ORDER = 4
"""Of the shape functions in the plane, and of the curves that edges follow."""

BONUS = 6
"""Order of integration beyond that of elements with straight sides."""

ACROSS = 3.0
"""Triangles over the mean width of a figure, twice its area over its edges."""

ROUND = 4
"""Sides around a full circle, at least."""

LEVELS = 3
"""Displacements through the thickness are a + b s + c s^2, s from -1 to 1."""

SHOWN = 4
"""Parts of a side of a triangle in pictures."""

NEAR = 1e-6
"""Distance over the size of the outline within which the middle of an edge is on a curve, and points are one."""

AREA_ERROR = 1e-3
"""Most relative difference between the area of a mesh and that of its figure."""

REVISION = 4
"""Goes up whenever meshes or matrices of sheets change, so that those in the cache are worked out anew."""


@dataclass(frozen=True)
class ReducedSheet:
    """K and M (6 p + m,) over the displacements of the pads about the origin of the plane, its axes, and
    fixed-interface modes of `fixed_hz` (m,), Hz; DOFs of the mesh, mass, kg, and what stretching adds to the force
    along the normal, per square of the deflection over the thickness; and the surface, axes of the plane."""

    K: Array
    M: Array
    fixed_hz: Array
    dofs: int
    mass: float
    stiffening: float
    surface: Surface


class CutApartError(SolverError):
    """A piece of a sheet that nothing holds, or pads between which nothing is left."""


def _face(occ: ModuleType, loop: Loop) -> Any:
    """A closed loop as a plane face, mm."""
    runs = [np.array(curve.points) / MILLIMETRE for curve in loop]
    if loop[0].is_circle:
        centre, out = runs[0][0], runs[0][1] - runs[0][0]
        turns = [centre + out @ np.array([[c, s], [-s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 0))]
        runs = [np.array(turns[:3]), np.array(turns[2:])]
    return plane_face(occ, [np.column_stack([run, np.zeros(len(run))]) for run in runs])


def _shape(occ: ModuleType, figure: Figure) -> Any:
    """The pieces of a figure as faces, mm. Raises CutApartError where nothing is left of it."""
    shape = _face(occ, figure.outline)
    if figure.strips:
        shape = shape * reduce(add, (_face(occ, strip) for strip in figure.strips))
    shape = reduce(sub, (_face(occ, loop) for loop in (*figure.holes, *figure.cuts)), shape)
    if not list(shape.faces):
        raise CutApartError("nothing is left of the sheet: its openings are larger than it is")
    return shape


def _name_pads(faces: Sequence[Any], figure: Figure, near: float) -> None:
    """Give edges whose middles are on a pad, within a distance, m, its name. Raise CutApartError unless all pieces hang
    on pads and all pads on one another by pieces."""
    joined: list[set[int]] = []
    for face in faces:
        joined.append(set())
        for edge in face.edges:
            middle = edge.Value(sum(edge.parameter_interval) / 2)
            at = np.array([[middle.x, middle.y]]) * MILLIMETRE
            for k in (k for k, pad in enumerate(figure.pads) if any(float(own.distance(at)[0]) < near for own in pad)):
                edge.name = f"pad{k}"
                joined[-1].add(k)
    if loose := sum(not pads for pads in joined):
        raise CutApartError(f"{loose} of {len(faces)} pieces of the sheet hang on nothing")
    group, rest = joined[0], joined[1:]
    while meeting := [pads for pads in rest if pads & group]:
        group, rest = group.union(*meeting), [pads for pads in rest if not pads & group]
    if len(group) < len(figure.pads):
        raise CutApartError("the sheet is cut apart: nothing is left between what it is held by")


class _Sheet:
    """A meshed sheet. DOFs (9 n,) are, for x, y and z in turn, n plane ones for each power of the height.

    Raises CutApartError, and SolverError where netgen makes no mesh.
    """

    def __init__(self, figure: Figure, thickness: float, material: SolidMaterial, size: float) -> None:
        self._ng = need("ngsolve", "solid")
        self.thickness: float = thickness
        self.mu: float = material.E / (2 + 2 * material.nu)
        self.lame: float = 2 * self.mu * material.nu / (1 - 2 * material.nu)
        self._rho, self._pads = material.rho, len(figure.pads)
        self.extent: float = max(abs(x) for curve in figure.outline for point in curve.points for x in point)
        self.mesh: Any = self._meshed(figure, size)
        self.space: Any = self._ng.H1(self.mesh, order=ORDER)
        self.order: int = 3 * LEVELS * self.space.ndof
        s, w = np.polynomial.legendre.leggauss(2 * LEVELS - 1)
        powers = np.arange(LEVELS)
        self.weights: Array = w * thickness / 2
        self.P: Array = s[:, None] ** powers
        """Powers of the height (q, 3), and their slopes."""
        self.dP: Array = powers * s[:, None] ** np.maximum(powers - 1, 0) * 2 / thickness

    def _meshed(self, figure: Figure, size: float) -> Any:
        ng, meshing = self._ng, need("netgen.meshing", "solid")
        with kernel() as occ:
            shape = _shape(occ, figure)
            faces = list(shape.faces)
            _name_pads(faces, figure, NEAR * self.extent)
            area = sum(float(face.mass) for face in faces)
            length = sum(float(edge.mass) for face in faces for edge in face.edges)
            parameters = meshing.MeshingParameters(
                maxh=size * 2 * area / length / ACROSS, curvaturesafety=ROUND / (2 * np.pi), grading=GRADING
            )
            try:
                mesh = ng.Mesh(occ.OCCGeometry(shape, dim=2).GenerateMesh(parameters))
            except meshing.NgException as error:
                raise SolverError(f"netgen: {error}; try another mesh_size, or corners that are less sharp") from None
        mesh.Curve(ORDER)
        meshed = float(ng.Integrate(1.0, mesh))
        if abs(meshed / area - 1) > AREA_ERROR:
            rule = f"netgen meshes {meshed:.6g} mm^2 of a sheet of {area:.6g} mm^2"
            raise SolverError(f"{rule}; try another mesh_size, or corners that are less sharp")
        return mesh

    def _plane(self, form: Any) -> sp.csr_matrix:
        """A matrix (n, n) of the plane DOFs."""
        with self._ng.TaskManager():
            matrix = self._ng.BilinearForm(form).Assemble().mat
        row, column, value = matrix.COO()
        return sp.csr_matrix((np.array(value), (np.array(row), np.array(column))), shape=(self.space.ndof,) * 2)

    def matrices(self) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K, N/m, and M, kg: sums of products of one through the thickness and one in the plane."""
        ng = self._ng
        u, v = self.space.TnT()
        left, right, region = (*ng.grad(v), v), (*ng.grad(u), u), ng.dx(bonus_intorder=BONUS)
        scale = (1.0, 1.0, MILLIMETRE)
        through = (self.P, self.P, self.dP)
        parts = []
        for a, b in product(range(3), repeat=2):
            plane = self._plane(left[a] * right[b] * region) * (scale[a] * scale[b])
            both = sp.kron((through[a] * self.weights[:, None]).T @ through[b], plane)
            C = np.zeros((3, 3))
            C[a, b] += self.lame
            C[b, a] += self.mu
            if a == b:
                C += self.mu * np.eye(3)
            parts.append(sp.kron(C, both, format="csr"))
        mass = self._plane(u * v * region) * MILLIMETRE**2
        M = self._rho * sp.kron(np.eye(3), sp.kron((self.P * self.weights[:, None]).T @ self.P, mass))
        return sp.csc_matrix(reduce(add, parts)), sp.csc_matrix(M)

    @cached_property
    def rigid_motions(self) -> Array:
        """DOFs (9 n, 6) of translations and rotations about the origin of the plane."""
        ng, n, half = self._ng, self.space.ndof, self.thickness / 2
        field = ng.GridFunction(self.space)
        one, x, y = np.empty((3, n))
        for values, of in ((one, ng.CF(1.0)), (x, ng.x * MILLIMETRE), (y, ng.y * MILLIMETRE)):
            field.Set(of)
            values[:] = field.vec.FV().NumPy()
        out = np.zeros((3, LEVELS, n, 6))
        for axis in range(3):
            out[axis, 0, :, axis] = one
        out[1, 1, :, 3], out[2, 0, :, 3] = -half * one, y
        out[0, 1, :, 4], out[2, 0, :, 4] = half * one, -x
        out[0, 0, :, 5], out[1, 0, :, 5] = -y, x
        return out.reshape(-1, 6)

    def tied(self) -> sp.csc_matrix:
        """What leads to all DOFs from those that are free, then six of every pad about the origin.

        A pad moves the sheet as it does the edge of a plate: in the plane, and along the normal in the middle of the
        thickness. Held in its thickness as well, it would be too stiff over all its width.
        """
        n = self.space.ndof
        owner = np.full((3, LEVELS, n), -1)
        for k in reversed(range(self._pads)):
            on = np.array(self.space.GetDofs(self.mesh.Boundaries(f"pad{k}")))
            owner[:2, :, on] = owner[2, 0, on] = k
        owner = owner.ravel()
        free, tied = np.flatnonzero(owner < 0), np.flatnonzero(owner >= 0)
        columns = len(free) + 6 * owner[tied][:, None] + np.arange(6)
        entries = np.concatenate([np.ones(len(free)), self.rigid_motions[tied].ravel()])
        at = np.concatenate([free, np.repeat(tied, 6)]), np.concatenate([np.arange(len(free)), columns.ravel()])
        return sp.csc_matrix((entries, at), shape=(self.order, len(free) + 6 * self._pads))

    def _fields(self, vector: Array) -> list[list[Any]]:
        """For each axis and power of the height the field of a vector of DOFs."""
        made = []
        for part in vector.reshape(3 * LEVELS, -1):
            field = self._ng.GridFunction(self.space)
            field.vec.FV().NumPy()[:] = part
            made.append(field)
        return [made[LEVELS * axis : LEVELS * (axis + 1)] for axis in range(3)]

    def surface(self, basis: Array) -> Arrays:
        """The outer surface as `Surface` has it, from displacements of all DOFs by coordinates of the sheet."""
        ng, steps = self._ng, SHOWN
        grid = [(i, j) for i in range(steps + 1) for j in range(steps + 1 - i)]
        number = {at: k for k, at in enumerate(grid)}
        up = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in grid if i + j < steps]
        down = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in grid if i + j < steps - 1]
        small = np.array([[number[at] for at in corners] for corners in up + down])
        rule = ng.IntegrationRule([(i / steps, j / steps) for i, j in grid], [0.0] * len(grid))
        at = self.mesh.MapToAllElements(rule, ng.VOL)
        plane = np.asarray(ng.CF((ng.x, ng.y))(at)) * MILLIMETRE
        rounded = (plane / (NEAR * self.extent)).round()
        _, first, same = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        triangles = same.ravel()[(small + len(grid) * np.arange(self.mesh.ne)[:, None, None]).reshape(-1, 3)]
        (a, b), (c, d) = ((plane[first][triangles[:, k]] - plane[first][triangles[:, 0]]).T for k in (1, 2))
        triangles[a * d < b * c] = triangles[a * d < b * c][:, ::-1]
        count = len(first)
        sides = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
        _, place, times = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
        p, q = sides[place[times == 1]].T
        top = triangles + count
        facets = [top[:, [0, 1, 2, 2]], triangles[:, [2, 1, 0, 0]], np.stack([p, q, q + count, p + count], axis=-1)]
        moved = np.empty((3, LEVELS, count, basis.shape[1]))
        for k, vector in enumerate(basis.T):
            for axis, fields in enumerate(self._fields(vector)):
                for level, field in enumerate(fields):
                    moved[axis, level, :, k] = np.asarray(field(at)).ravel()[first]
        below, above = (np.einsum("l,alpk->pak", (-1.0) ** np.arange(LEVELS) if low else np.ones(LEVELS), moved)
                        for low in (True, False))  # fmt: skip
        half = np.full((count, 1), self.thickness / 2)
        return {
            "points": np.vstack([np.hstack([plane[first], -half]), np.hstack([plane[first], half])]),
            "facets": np.concatenate(facets),
            "rows": np.concatenate([below, above]).reshape(-1, basis.shape[1]).astype(np.float32),
        }

    def quadratic(self, vector: Array) -> tuple[float, Array]:
        """Energy, J, of Green's quadratic strains in a displacement, and the forces (9 n,) of their stresses."""
        ng = self._ng
        points = need("ngsolve.comp", "solid").IntegrationRuleSpace(self.mesh, order=4 * (ORDER - 1))
        region = ng.dx(intrules=points.GetIntegrationRules())
        x, y, z = (ng.GridFunction(points) for _ in range(3))
        v, field = self.space.TestFunction(), ng.GridFunction(self.space)
        slopes = []
        for part in vector.reshape(3 * LEVELS, -1):
            field.vec.FV().NumPy()[:] = part
            for own, of in ((x, ng.grad(field)[0]), (y, ng.grad(field)[1]), (z, MILLIMETRE * field)):
                own.Interpolate(of)
            slopes.append([own.vec.FV().NumPy() / MILLIMETRE for own in (x, y, z)])
        D = np.reshape(slopes, (3, LEVELS, 3, -1))
        through = np.stack([self.P, self.P, self.dP], axis=-1)
        H = np.einsum("qla,ilan->qian", through, D)
        e = np.einsum("qkin,qkjn->qijn", H, H) / 2
        stress = 2 * self.mu * e + self.lame * np.einsum("qiin->qn", e)[:, None, None] * np.eye(3)[:, :, None]
        x.vec.FV().NumPy()[:] = np.einsum("q,qijn,qijn->n", self.weights, e, stress) / 2
        energy = float(ng.Integrate(x * region, self.mesh)) * MILLIMETRE**2
        force = []
        for loads in np.einsum("q,qla,qian->ilan", self.weights, through, stress).reshape(3 * LEVELS, 3, -1):
            for own, load in zip((x, y, z), loads, strict=True):
                own.vec.FV().NumPy()[:] = load
            form = (x * ng.grad(v)[0] + y * ng.grad(v)[1]) / MILLIMETRE + z * v
            force.append(ng.LinearForm(form * region).Assemble().vec.FV().NumPy() * MILLIMETRE**2)
        return energy, np.concatenate(force)


def _stiffening(sheet: _Sheet, K: sp.csc_matrix, T: sp.csc_matrix, solid: CondensedSolid) -> float:
    """c of the force k s (1 + c s^2/t^2) of a pad along the normal, all others held, the largest of all pads but the
    first: the energy of Green's quadratic strains in the linear shapes, less what displacements take off (theory eq.
    Z6)."""
    pads = len(solid.K) - len(solid.fixed_frequency_hz)
    free, most = np.arange(K.shape[0] - pads), 0.0
    factor = factorise_large(K[free][:, free])
    for pad in range(6, pads, 6):
        energy, force = sheet.quadratic(T @ solid.basis[:, pad + 2])
        f = (T.T @ force)[free]
        quartic = energy - float(f @ factor.solve(f)) / 2
        most = max(most, 4 * quartic * sheet.thickness**2 / float(solid.K[pad + 2, pad + 2]))
    return most


def reduced_sheet(
    figure: Figure, thickness: float, material: SolidMaterial, size: float, modes: int, announce: Announce
) -> ReducedSheet:
    """A sheet over its pads and its lowest fixed-interface modes (theory eq. B5), from the cache where it is there."""
    unit = replace(material, name="")

    def compute() -> Arrays:
        announce("mesh")
        sheet = _Sheet(figure, thickness, unit, size)
        announce(f"{sheet.order} DOFs")
        T = sheet.tied()
        K, M = (sp.csc_matrix(T.T @ A @ T) for A in sheet.matrices())
        pads = len(figure.pads)
        boundary = np.arange(K.shape[0] - 6 * pads, K.shape[0])
        solid = constraint_modes(K, M, boundary, min(modes, K.shape[0] - 6 * pads - 1), most=MOST_MODES)
        rigid = np.tile(np.eye(6), (pads, 1))
        mass = rigid.T @ solid.M[: 6 * pads, : 6 * pads] @ rigid
        return {
            "K": balanced(solid.K, np.zeros((pads, 3))),
            "M": solid.M,
            "hz": solid.fixed_frequency_hz,
            "dofs": np.array(sheet.order),
            "mass": np.array(mass[0, 0]),
            **sheet.surface(T @ solid.basis),
            "stiffening": np.array(_stiffening(sheet, K, T, solid)),
        }

    parts = (REVISION, figure, thickness, unit, size, modes)
    arrays = IN_MEMORY.once(content_key(parts), lambda: remembered("sheet", parts, compute), lambda _: True)
    surface = Surface(arrays["points"], arrays["facets"], arrays["rows"])
    numbers = int(arrays["dofs"]), float(arrays["mass"]), float(arrays["stiffening"])
    return ReducedSheet(arrays["K"], arrays["M"], arrays["hz"], *numbers, surface)
