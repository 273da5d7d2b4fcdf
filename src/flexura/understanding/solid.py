"""The lowest modes of an extruded outline as one solid: curved tetrahedra by netgen and NGSolve, of two orders."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.arrays import Array, Index
from flexura.errors import SolverError, need
from flexura.linalg import factorise_large
from flexura.outlines import Outline, Segment
from flexura.understanding.describe import Plane

MM = 1e-3
ORDERS = 2, 3
"""Orders of the tetrahedra."""
CONVERGENCE = 10.0
"""How far the lower order is from the higher one, over how far this is from the limit: measured 9 to 17 by `verify`."""


class SolidModes(NamedTuple):
    """Frequencies (n,), Hz, their relative uncertainty (n,), motions (p, 6, n) at points, NaN outside, and the mesh."""

    frequency_hz: Array
    uncertainty: Array
    shapes: Array
    cells: int
    dofs: int


def solid_modes(
    outline: Outline,
    thickness: float,
    material: tuple[float, float, float],
    held: Plane,
    n: int,
    sizes: tuple[Array, Array],
    points: Array,
) -> SolidModes:
    """The `n` lowest modes for E, Pa, nu and rho, kg/m^3, held at a plane; `sizes` are places (k, 3), m, and the length
    of tetrahedra there (k,), m. Raises SolverError where that fails."""
    ng, occ, meshing = (need(name, "solid") for name in ("ngsolve", "netgen.occ", "netgen.meshing"))
    part = _extruded(occ, outline, thickness, held)
    parameters = meshing.MeshingParameters(maxh=thickness / MM, grading=0.4, curvaturesafety=0.8)
    for (x, y, z), h in zip(sizes[0] / MM, sizes[1] / MM, strict=True):
        parameters.RestrictH(x=x, y=y, z=z, h=h)
    try:
        mesh = ng.Mesh(occ.OCCGeometry(part).GenerateMesh(parameters))
    except Exception as error:
        raise SolverError(f"netgen could not mesh the part: {error}") from None
    mesh.RefineHP(1)
    coarse, fine = (_modes(ng, mesh, order, material, n, points) for order in ORDERS)
    limit, uncertain = fine[0].copy(), np.abs(coarse[0] - fine[0]) / CONVERGENCE
    limit -= uncertain
    return SolidModes(limit, uncertain / limit, fine[1], mesh.ne, fine[2])


def _extruded(occ: Any, outline: Outline, thickness: float, held: Plane) -> Any:
    """The solid, mm; its held faces are named `held`, and edges at its inner corners marked."""

    def point(at: tuple[float, float]) -> Any:
        return occ.gp_Pnt(at[0] / MM, at[1] / MM, 0.0)

    def edge(own: Segment) -> Any:
        if own.is_line:
            return occ.Segment(point(own.start), point(own.end))
        x, y = own.at(0.5).tolist()
        return occ.ArcOfCircle(point(own.start), point((x, y)), point(own.end))

    faces = [occ.Face(occ.Wire([edge(own) for own in loop.segments])) for loop in outline.loops]
    face = faces[0]
    for hole in faces[1:]:
        face = face - hole
    part = face.Extrude(occ.gp_Vec(0.0, 0.0, thickness / MM))
    near = 1e-6 * outline.size
    for own in part.faces:
        places = np.array([[p.x, p.y] for p in (*(v.p for v in own.vertices), own.center)]) * MM
        if (np.abs(held.beyond(places)) < near).all():
            own.name = "held"
    corners = np.array([at for loop in outline.loops for at in _inner_corners(loop.segments)]).reshape(-1, 2)
    for own in part.edges:
        middle = own.center
        at = np.array([middle.x, middle.y]) * MM
        is_upright = abs(middle.z - thickness / MM / 2) < 1e-6 * thickness / MM
        if is_upright and len(corners) and np.linalg.norm(corners - at, axis=1).min() < near:
            own.hpref = 1
    return part


def _inner_corners(segments: tuple[Segment, ...]) -> list[tuple[float, float]]:
    """Where a loop with the part to its left turns to the right by more than 30 deg."""
    corners = []
    for before, after in zip((segments[-1], *segments[:-1]), segments, strict=True):
        u, v = before.direction(1.0), after.direction(0.0)
        if u[0] * v[1] - u[1] * v[0] < -0.5:
            corners.append(after.start)
    return corners


def _modes(
    ng: Any, mesh: Any, order: int, material: tuple[float, float, float], n: int, points: Array
) -> tuple[Array, Array, int]:
    E, nu, rho = material
    mesh.Curve(order)
    space = ng.VectorH1(mesh, order=order, dirichlet="held")
    free = np.flatnonzero(np.array(space.FreeDofs()))
    u, v = space.TnT()
    mu, lame = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    strain, other = ng.Sym(ng.Grad(u)), ng.Sym(ng.Grad(v))
    forms = (2 * mu * ng.InnerProduct(strain, other) + lame * ng.div(u) * ng.div(v), MM**2 * rho * u * v)
    K, M = (_sparse(ng.BilinearForm(form * ng.dx), free, space.ndof) for form in forms)
    factor = factorise_large(K)
    d = factor.scale
    solve = spla.LinearOperator(
        K.shape, matvec=lambda b: d * factor.solve_scaled(np.ascontiguousarray(d * np.ravel(b))).ravel(), dtype=float
    )
    values, vectors = spla.eigsh(K, n, M=M, sigma=0.0, OPinv=solve, v0=np.cos(np.arange(len(free))), tol=1e-7)
    order_of = np.argsort(values)
    shapes = np.full((len(points), 6, n), np.nan)
    at = mesh(*(np.ascontiguousarray(c) for c in points.T / MM))
    inside = at["nr"] >= 0
    field = ng.GridFunction(space)
    for k, j in enumerate(order_of):
        field.vec[:] = 0.0
        field.vec.FV().NumPy()[free] = vectors[:, j]
        shapes[inside, :3, k] = field(at[inside])
        G = np.asarray(ng.Grad(field)(at[inside])).reshape(-1, 3, 3) / MM
        shapes[inside, 3:, k] = (
            np.stack([G[:, 2, 1] - G[:, 1, 2], G[:, 0, 2] - G[:, 2, 0], G[:, 1, 0] - G[:, 0, 1]], axis=-1) / 2
        )
    return np.sqrt(values[order_of]) / (2 * np.pi), shapes, len(free)


def _sparse(form: Any, free: Index, n: int) -> sp.csr_matrix:
    form.Assemble()
    row, column, value = form.mat.COO()
    full = sp.csr_matrix((np.array(value), (np.array(row), np.array(column))), shape=(n, n))
    return full[free][:, free]
