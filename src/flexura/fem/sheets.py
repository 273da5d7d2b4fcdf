"""Sheets: plane figures of one thickness as solids, reduced to the rigid pads along which they are held.

A figure has outlines in its plane, m. It is meshed by quadrilaterals, of which the thickness makes one layer of 27-node
hexahedra: complete quadratic ones bend as plates do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import SolverError
from flexura.fem import drawn_by_gmsh as occ
from flexura.fem.cache import Arrays, content_key, remembered
from flexura.fem.figures import Figure, Loop, centre_of
from flexura.fem.geometry import MILLIMETRE, SolidMaterial
from flexura.fem.matrices import elastic_matrices
from flexura.fem.meshing import LEAST_JACOBIAN, VOLUME_ERROR, jacobians
from flexura.fem.reduced import IN_MEMORY, MOST_MODES, Announce, CondensedSolid, balanced, constraint_modes
from flexura.fem.solid_mesh import SolidMesh, Surface, dofs_of, outer_sides, quadrature, rigid_motions, shape_of
from flexura.fem.sweep import Swept, sweep_quadrilaterals
from flexura.linalg import factorise_large

CELLS_ACROSS = 5.0
"""Cells over the mean width of a figure, twice its area over its edges."""

ROUND = 6
"""Sides around a full circle, at least, before each is divided into two."""

TRIES = ((6, 1.0), (8, 1.0), (6, 0.87), (8, 0.87), (6, 0.75))
"""Algorithms of gmsh, with relative sizes of cells, that are tried until one folds none."""

STRAIGHTENED = 4
"""How often sides of cells that are folded are made straight."""

NEAR = 1e-6
"""Distance over the size of the outline within which a point is on a curve."""

REVISION = 2
"""Goes up whenever meshes or matrices of sheets change, so that those in the cache are worked out anew."""

QUADRATIC = "hexahedron27"

QUAD9 = 10
"""Kind of gmsh's elements."""


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


def _loop(gmsh: ModuleType, loop: Loop) -> int:
    """A closed wire, mm."""
    add = gmsh.model.occ
    if loop[0].is_circle:
        centre, through = (np.array(p) / MILLIMETRE for p in loop[0].points)
        return add.addCurveLoop([add.addCircle(*centre, 0.0, float(np.linalg.norm(through - centre)))])
    corners = [add.addPoint(*(np.array(curve.points[0]) / MILLIMETRE), 0.0) for curve in loop]
    tags = []
    for curve, a, b in zip(loop, corners, [*corners[1:], corners[0]], strict=True):
        inner = [add.addPoint(*(np.array(p) / MILLIMETRE), 0.0) for p in curve.points[1:-1]]
        if not inner:
            tags.append(add.addLine(a, b))
        elif len(inner) == 1:
            centre = add.addPoint(*(centre_of(np.array(curve.points)) / MILLIMETRE), 0.0)
            half = [add.addCircleArc(a, centre, inner[0]), add.addCircleArc(inner[0], centre, b)]
            tags += half
        else:
            tags.append(add.addSpline([a, *inner, b]))
    return add.addCurveLoop(tags)


def surfaces(gmsh: ModuleType, figure: Figure) -> list[int]:
    """The pieces of a figure as surfaces. Raises CutApartError where nothing is left of it."""
    add = gmsh.model.occ

    def face(loop: Loop) -> tuple[int, int]:
        return 2, add.addPlaneSurface([_loop(gmsh, loop)])

    pieces = [face(figure.outline)]
    if figure.strips:
        strips = [face(strip) for strip in figure.strips]
        if len(strips) > 1:
            strips, _ = add.fuse(strips[:1], strips[1:])
        pieces, _ = add.intersect(pieces, strips)
    away = [face(loop) for loop in (*figure.holes, *figure.cuts)]
    if away:
        pieces, _ = add.cut(pieces, away)
    add.synchronize()
    tags = [tag for dim, tag in pieces if dim == 2]
    if not tags:
        raise CutApartError("nothing is left of the sheet: its openings are larger than it is")
    return tags


def _check_pieces(gmsh: ModuleType, tags: list[int], figure: Figure, near: float) -> None:
    """Raise CutApartError unless all pieces hang on pads, and all pads on one another by pieces."""
    joined = [{k for k, own in enumerate(touched(gmsh, tag, figure, near)) if own} for tag in tags]
    if loose := sum(not pads for pads in joined):
        raise CutApartError(f"{loose} of {len(tags)} pieces of the sheet hang on nothing")
    group, rest = joined[0], joined[1:]
    while meeting := [pads for pads in rest if pads & group]:
        group, rest = group.union(*meeting), [pads for pads in rest if not pads & group]
    if len(group) < len(figure.pads):
        raise CutApartError("the sheet is cut apart: nothing is left between what it is held by")


def touched(gmsh: ModuleType, tag: int, figure: Figure, near: float) -> list[bool]:
    """Which pads a piece of the figure reaches, by the middles of its edges, within a distance, m."""
    middles = []
    for _, curve in gmsh.model.getBoundary([(2, tag)], oriented=False):
        low, high = gmsh.model.getParametrizationBounds(1, curve)
        middles.append(gmsh.model.getValue(1, curve, [(low[0] + high[0]) / 2])[:2])
    at = np.array(middles) * MILLIMETRE
    return [any((curve.distance(at) < near).any() for curve in pad) for pad in figure.pads]


def _straightened(plane: Array, bad: Index) -> Array:
    """Points, with the sides of quadrilaterals (q, 9) straight."""
    plane, corners = plane.copy(), bad[:, :4]
    plane[bad[:, 4:8]] = (plane[corners] + plane[np.roll(corners, -1, axis=1)]) / 2
    plane[bad[:, 8]] = plane[corners].mean(axis=1)
    return plane


class _Plane(NamedTuple):
    """Points (n, 2), m, quadrilaterals (q, 9), the points of each pad, and the area, m^2."""

    points: Array
    faces: Index
    pads: list[Index]
    area: float


def _plane_mesh(figure: Figure, size: float, algorithm: int) -> _Plane:
    """The figure meshed by one of gmsh's algorithms. Raises CutApartError, and SolverError where there is no mesh."""
    with occ.session() as gmsh:
        tags = surfaces(gmsh, figure)
        extent = max(abs(x) for curve in figure.outline for point in curve.points for x in point)
        _check_pieces(gmsh, tags, figure, NEAR * extent)
        area = sum(gmsh.model.occ.getMass(2, tag) for tag in tags)
        edges = {curve for tag in tags for _, curve in gmsh.model.getBoundary([(2, tag)], oriented=False)}
        length = sum(gmsh.model.occ.getMass(1, curve) for curve in edges)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 2 * size * 2 * area / length / CELLS_ACROSS)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", ROUND)
        gmsh.option.setNumber("Mesh.Algorithm", algorithm)
        gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 1)  # every triangle and quadrilateral into such halves
        for tag in tags:
            gmsh.model.mesh.setRecombine(2, tag)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.optimize("Laplace2D")
        gmsh.model.mesh.setOrder(2)
        points, faces, _ = occ.elements(gmsh, QUAD9, 9, dict.fromkeys(tags, 0))
    plane = points[:, :2]
    pads = [np.flatnonzero(np.min([curve.distance(plane) for curve in pad], axis=0) < NEAR * extent)
            for pad in figure.pads]  # fmt: skip
    return _Plane(plane, faces, pads, area * MILLIMETRE**2)


def sheet_mesh(figure: Figure, thickness: float, material: SolidMaterial, size: float) -> SolidMesh:
    """One layer of 27-node hexahedra about the plane. Raises SolverError when gmsh makes no mesh of the figure."""
    heights = np.array([-thickness / 2, thickness / 2])
    group = Swept((), np.zeros(3), np.eye(3), thickness)
    for algorithm, finer in TRIES:
        plane = _plane_mesh(figure, size * finer, algorithm)
        flat = plane.points
        if not len(plane.faces):
            continue
        for _ in range(STRAIGHTENED):
            owner = np.zeros(len(plane.faces), dtype=np.intp)
            points, cells, _ = sweep_quadrilaterals(flat, plane.faces, owner, group, heights)
            least, volume = jacobians(points, cells)
            if least.min() > LEAST_JACOBIAN:
                break
            flat = _straightened(flat, plane.faces[least <= LEAST_JACOBIAN])
        if least.min() > 0 and abs(volume.sum() / (plane.area * thickness) - 1) < VOLUME_ERROR:
            break
    else:
        raise SolverError("gmsh folds cells of the sheet; try another mesh_size, or corners that are less sharp")
    levels = np.arange(3)
    sets = {str(k): (3 * pad[:, None] + levels).ravel() for k, pad in enumerate(plane.pads)}
    return SolidMesh(points, {QUADRATIC: cells}, {QUADRATIC: np.zeros(len(cells), dtype=np.intp)}, (material,), sets)


def _tied(mesh: SolidMesh) -> sp.csc_matrix:
    """What leads to all DOFs from those that are free, then six of every pad about the origin.

    Points of a pad follow it as the edge of a plate does: in the plane, and along the normal those in the middle of the
    thickness. Held in its thickness as well, the row of cells at the edge would be too stiff over all its width.
    """
    owner = np.full(mesh.order, -1)
    for k, points in mesh.point_sets.items():
        middle = points[mesh.points[points, 2] == 0.0]
        followers = np.concatenate([3 * points, 3 * points + 1, 3 * middle + 2])
        owner[followers[owner[followers] < 0]] = int(k)
    free, tied = np.flatnonzero(owner < 0), np.flatnonzero(owner >= 0)
    rows = rigid_motions(mesh.points)[tied]
    columns = len(free) + 6 * owner[tied][:, None] + np.arange(6)
    entries = np.concatenate([np.ones(len(free)), rows.ravel()])
    at = np.concatenate([free, np.repeat(tied, 6)]), np.concatenate([np.arange(len(free)), columns.ravel()])
    return sp.csc_matrix((entries, at), shape=(mesh.order, len(free) + 6 * len(mesh.point_sets)))


def _surface(mesh: SolidMesh, basis: Array) -> Arrays:
    """The outer surface as `Surface` has it, from displacements of all points by coordinates of the sheet."""
    used, facets = outer_sides(mesh)
    return {"points": mesh.points[used], "facets": facets, "rows": basis[dofs_of(used)].astype(np.float32)}


def _stiffening(mesh: SolidMesh, K: sp.csc_matrix, T: sp.csc_matrix, solid: CondensedSolid, thickness: float) -> float:
    """c of the force k s (1 + c s^2/t^2) of a pad along the normal, all others held, the largest of all pads but the
    first: the energy of Green's quadratic strains in the linear shapes, less what displacements take off (theory eq.
    Z6)."""
    free, most = np.arange(K.shape[0] - len(solid.K) + len(solid.fixed_frequency_hz)), 0.0
    factor = factorise_large(K[free][:, free])
    (cells,) = mesh.cells.values()
    (material,) = mesh.materials
    shear, lame = (
        material.E / (2 + 2 * material.nu),
        material.E * material.nu / (1 + material.nu) / (1 - 2 * material.nu),
    )
    places, weights = quadrature(QUADRATIC, 3)
    for pad in range(6, len(solid.K) - len(solid.fixed_frequency_hz), 6):
        moved = T @ solid.basis[:, pad + 2]
        u, x = moved.reshape(-1, 3)[cells], mesh.points[cells]
        energy, force = 0.0, np.zeros((len(mesh.points), 3))
        for dN, weight in zip(shape_of(QUADRATIC).gradients(places), weights, strict=True):
            J = dN @ x
            slope = np.linalg.solve(J, np.broadcast_to(dN, (len(cells), *dN.shape)))
            H = slope @ u
            e = H @ np.swapaxes(H, 1, 2) / 2
            volume = weight * np.linalg.det(J)
            stress = 2 * shear * e + lame * np.trace(e, axis1=1, axis2=2)[:, None, None] * np.eye(3)
            energy += float((volume * (e * stress).sum(axis=(1, 2))).sum()) / 2
            np.add.at(force, cells, np.swapaxes(slope, 1, 2) @ stress * volume[:, None, None])
        f = (T.T @ force.ravel())[free]
        quartic = energy - float(f @ factor.solve(f)) / 2
        most = max(most, 4 * quartic * thickness**2 / float(solid.K[pad + 2, pad + 2]))
    return most


def reduced_sheet(
    figure: Figure, thickness: float, material: SolidMaterial, size: float, modes: int, announce: Announce
) -> ReducedSheet:
    """A sheet over its pads and its lowest fixed-interface modes (theory eq. B5), from the cache where it is there."""
    unit = replace(material, name="")

    def compute() -> Arrays:
        announce("mesh")
        mesh = sheet_mesh(figure, thickness, unit, size)
        announce(f"{mesh.order} DOFs")
        T = _tied(mesh)
        K, M = (sp.csc_matrix(T.T @ A @ T) for A in elastic_matrices(mesh))
        pads = len(figure.pads)
        boundary = np.arange(K.shape[0] - 6 * pads, K.shape[0])
        solid = constraint_modes(K, M, boundary, min(modes, K.shape[0] - 6 * pads - 1), most=MOST_MODES)
        rigid = np.tile(np.eye(6), (pads, 1))
        mass = rigid.T @ solid.M[: 6 * pads, : 6 * pads] @ rigid
        return {
            "K": balanced(solid.K, np.zeros((pads, 3))),
            "M": solid.M,
            "hz": solid.fixed_frequency_hz,
            "dofs": np.array(mesh.order),
            "mass": np.array(mass[0, 0]),
            **_surface(mesh, T @ solid.basis),
            "stiffening": np.array(_stiffening(mesh, K, T, solid, thickness)),
        }

    parts = (REVISION, figure, thickness, unit, size, modes)
    arrays = IN_MEMORY.once(content_key(parts), lambda: remembered("sheet", parts, compute), lambda _: True)
    surface = Surface(arrays["points"], arrays["facets"], arrays["rows"])
    numbers = int(arrays["dofs"]), float(arrays["mass"]), float(arrays["stiffening"])
    return ReducedSheet(arrays["K"], arrays["M"], arrays["hz"], *numbers, surface)
