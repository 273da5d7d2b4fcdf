"""The lowest modes of an extruded outline as one solid: curved tetrahedra by netgen and NGSolve, of two orders."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError, need
from flexura.fem import CurvedElements, SolidMaterial, extruded
from flexura.outlines import Outline, Segment
from flexura.solid.whole import lowest_of_solid
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
    part = _extruded(outline, thickness, held)
    parameters = meshing.MeshingParameters(maxh=thickness / MM, grading=0.4, curvaturesafety=0.8)
    for (x, y, z), h in zip(sizes[0] / MM, sizes[1] / MM, strict=True):
        parameters.RestrictH(x=x, y=y, z=z, h=h)
    try:
        mesh = ng.Mesh(occ.OCCGeometry(part).GenerateMesh(parameters))
    except Exception as error:
        raise SolverError(f"netgen could not mesh the part: {error}") from None
    mesh.RefineHP(1)
    coarse, fine = (_modes(mesh, order, material, n, points) for order in ORDERS)
    limit, uncertain = fine[0].copy(), np.abs(coarse[0] - fine[0]) / CONVERGENCE
    limit -= uncertain
    return SolidModes(limit, uncertain / limit, fine[1], mesh.ne, fine[2])


def _extruded(outline: Outline, thickness: float, held: Plane) -> Any:
    """The solid, mm; its held faces are named `held`, and edges at its inner corners marked."""

    part = extruded(outline, thickness)
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
    mesh: Any, order: int, material: tuple[float, float, float], n: int, points: Array
) -> tuple[Array, Array, int]:
    metal = SolidMaterial("", *material)
    elements = CurvedElements(mesh, order, dict.fromkeys(mesh.GetMaterials(), metal), held="held")
    values, vectors = lowest_of_solid(elements.K, elements.M, n)
    return np.sqrt(values) / (2 * np.pi), elements.motions_at(points, vectors), elements.dofs
