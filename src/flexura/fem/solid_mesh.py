"""A solid mesh: points, quadratic cells, materials and named sets of points; shape functions, quadrature and surface.

Quadratic tetrahedra and hexahedra as in Zienkiewicz, Taylor and Zhu (2013), ch. 6.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.fem.geometry import SolidMaterial

CELLS = {"tetra10": 10, "hexahedron20": 20, "hexahedron27": 27}
"""Kinds of cells with their number of points, ordered as in VTK and meshio."""


TETRA_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))

HEXA_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))

EDGES: dict[str, tuple[tuple[int, int], ...]] = {
    "tetra": TETRA_EDGES,
    "pyramid": ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    "hexahedron": HEXA_EDGES,
}
"""Corners of the edges of cells, in the order of their middles in VTK."""

HEXA_FACES = ((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))

TETRA_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
"""Corners of the edges and faces whose middles are points of a cell, in the order of VTK."""

SIDES: dict[str, tuple[tuple[int, int, int, int], ...]] = {
    "tetra": ((0, 2, 1, 1), (0, 1, 3, 3), (1, 2, 3, 3), (2, 0, 3, 3)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4, 4), (1, 2, 4, 4), (2, 3, 4, 4), (3, 0, 4, 4)),
    "wedge": ((0, 2, 1, 1), (3, 4, 5, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
"""Corners of the sides of cells, seen from outside anticlockwise; triangles have their last one twice."""


@dataclass(frozen=True)
class SolidMesh:
    """Points (n, 3), m, and cells by kind (a key of `CELLS`): connectivity (c, points of the kind) and material (c,).

    `point_sets` are points by name, such as the end faces `branch1.hinge start`; `parts` the member of every cell by
    kind, where that is known.
    """

    points: Array
    cells: dict[str, Index]
    cell_materials: dict[str, Index]
    materials: tuple[SolidMaterial, ...]
    point_sets: dict[str, Index] = field(default_factory=dict)
    parts: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def order(self) -> int:
        """Number of DOFs: three displacements x, y, z of every point, point by point."""
        return 3 * len(self.points)


def dofs_of(points: Index) -> Index:
    """Numbers (3 p,) of the DOFs of points (p,), point by point."""
    return (3 * points[:, None] + np.arange(3)).ravel()


def rigid_motions(points: Array, about: Array | None = None) -> Array:
    """DOF vectors (3 n, 6) of unit translations and rotations about the origin, or `about` (3,), of points (n, 3)."""
    x = points if about is None else points - about
    out = np.zeros((len(x), 3, 6))
    for j, axis in enumerate(np.eye(3)):
        out[:, j, j] = 1.0
        out[:, :, 3 + j] = np.cross(axis, x)
    return out.reshape(-1, 6)


@dataclass(frozen=True)
class Shape:
    """Shape functions N = monomials(xi) C: `points` (n, 3) of the cell in its own coordinates, the first of which are
    `corners`; `exponents` (n, 3) of the monomials and C (n, n)."""

    points: Array
    corners: int
    exponents: NDArray[np.intp]
    coefficients: Array

    def values(self, xi: Array) -> Array:
        """N (q, n) at xi (q, 3)."""
        return np.prod(xi[:, None, :] ** self.exponents, axis=2) @ self.coefficients

    def gradients(self, xi: Array) -> Array:
        """dN/dxi (q, 3, n) at xi (q, 3)."""
        out = []
        for axis in range(3):
            power = self.exponents.copy()
            power[:, axis] = np.maximum(power[:, axis] - 1, 0)
            slope = self.exponents[:, axis] * np.prod(xi[:, None, :] ** power, axis=2)
            out.append(slope @ self.coefficients)
        return np.stack(out, axis=1)


@cache
def shape_of(kind: str) -> Shape:
    """Shape functions of a kind of cell: complete quadratic, serendipity or triquadratic; OptionError for others."""
    if kind not in CELLS:
        raise OptionError(f"cells are of the kinds {', '.join(CELLS)}, not {kind!r}")
    powers = np.array(list(product(range(3), repeat=3)), dtype=np.intp)
    if kind == "tetra10":
        corners = np.vstack([np.zeros(3), np.eye(3)])
        groups: tuple[Any, ...] = TETRA_EDGES
        exponents = powers[powers.sum(axis=1) <= 2]
    else:
        corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
        corners = np.vstack([np.column_stack([corners, np.full(4, z)]) for z in (-1.0, 1.0)])
        groups = HEXA_EDGES
        exponents = powers[(powers == 2).sum(axis=1) <= 1]
        if kind == "hexahedron27":
            groups, exponents = (*HEXA_EDGES, *HEXA_FACES, tuple(range(8))), powers
    points = np.vstack([corners, *(corners[list(group)].mean(axis=0) for group in groups)])
    monomials = np.prod(points[:, None, :] ** exponents, axis=2)
    return Shape(points, len(corners), exponents, np.linalg.inv(monomials))


@cache
def quadrature(kind: str, points: int) -> tuple[Array, Array]:
    """Points (q, 3) and weights (q,) of the Gauss rule with `points` per direction, exact to the degree 2 points - 1.

    Tetrahedra use the rule that Gauss-Jacobi gives in collapsed coordinates (Stroud 1971), and with two points per
    direction the symmetric four-point rule of degree two.
    """
    if kind == "tetra10":
        if points == 2:
            b = (5 - np.sqrt(5)) / 20
            return b + (1 - 4 * b) * np.vstack([np.zeros(3), np.eye(3)]), np.full(4, 1 / 24)
        from scipy.special import roots_jacobi  # slow to import

        rules = [roots_jacobi(points, power, 0.0) for power in (2.0, 1.0, 0.0)]
        (x, wx), (y, wy), (z, wz) = (
            ((1 + x) / 2, w / 2 ** (power + 1)) for (x, w), power in zip(rules, (2, 1, 0), strict=True)
        )
        X, Y, Z = np.meshgrid(x, y, z, indexing="ij")
        W = wx[:, None, None] * wy[:, None] * wz
        return np.stack([X, Y * (1 - X), Z * (1 - X) * (1 - Y)], axis=-1).reshape(-1, 3), W.ravel()
    x, w = np.polynomial.legendre.leggauss(points)
    X = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    return X, (w[:, None, None] * w[:, None] * w).ravel()


@cache
def faces_of(kind: str) -> tuple[NDArray[np.intp], ...]:
    """Points of the cell on each of its faces: those of the plane through its corners."""
    shape = shape_of(kind)
    faces = []
    for corners in TETRA_FACES if kind == "tetra10" else HEXA_FACES:
        origin, one, two = shape.points[list(corners)][:3]
        normal = np.cross(one - origin, two - origin)
        faces.append(np.flatnonzero(np.abs((shape.points - origin) @ normal) < 1e-12))
    return tuple(faces)


@cache
def face_rule(kind: str, number: int) -> tuple[Array, Array, Array]:
    """Points (q, 3) of a Gauss rule on a face, its two tangents (2, 3) in the cell's coordinates, weights (q,)."""
    x, w = np.polynomial.legendre.leggauss(5)
    S, T = (a.ravel() for a in np.meshgrid((1 + x) / 2, (1 + x) / 2, indexing="ij"))
    W = np.outer(w, w).ravel() / 4
    corners = (TETRA_FACES if kind == "tetra10" else HEXA_FACES)[number]
    at = shape_of(kind).points[list(corners)]
    if kind == "tetra10":
        T, W = T * (1 - S), W * (1 - S)
        tangents = np.stack([at[1] - at[0], at[2] - at[0]])
    else:
        tangents = np.stack([at[1] - at[0], at[3] - at[0]])
    return at[0] + np.column_stack([S, T]) @ tangents, tangents, W


@dataclass(frozen=True)
class SurfaceShape:
    """A placed surface that moves in modes: points (s, 3), m, facets (f, 4), displacement (s, 3, modes), global frame.

    `name` is that of the first member of the piece.
    """

    name: str
    points: Array
    facets: Index
    displacement: Array


def outer_sides(mesh: SolidMesh) -> tuple[Index, Index]:
    """Numbers (s,) of the corner points of sides that belong to one cell only, and facets (f, 4) of positions in it."""
    sides = {kind: np.array(SIDES["tetra" if kind.startswith("tetra") else "hexahedron"]) for kind in mesh.cells}
    facets = np.concatenate([cells[:, sides[kind]].reshape(-1, 4) for kind, cells in mesh.cells.items()])
    key = np.sort(np.where((facets[:, 2:3] == facets[:, 3:]) & (np.arange(4) == 3), -1, facets), axis=1)
    _, first, count = np.unique(key, axis=0, return_index=True, return_counts=True)
    outer = facets[np.sort(first[count == 1])]
    used, at = np.unique(outer, return_inverse=True)
    return used, at.reshape(-1, 4)
