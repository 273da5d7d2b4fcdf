"""Surfaces of solids, for pictures of their modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.solid.mesh.solid_mesh import SolidMesh

SIDES: dict[str, tuple[tuple[int, int, int, int], ...]] = {
    "tetra": ((0, 2, 1, 1), (0, 1, 3, 3), (1, 2, 3, 3), (2, 0, 3, 3)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
"""Corners of the sides of cells, seen from outside anticlockwise; triangles have their last one twice."""


@dataclass(frozen=True)
class Surface:
    """Corner points (s, 3), m, of the cells' outer sides, and facets (f, 4) of these; a triangle has one point twice.

    `rows` (3 s, c) are the displacements of the points, x y z in turn, from the coordinates of a component.
    """

    points: Array
    facets: Index
    rows: NDArray[np.floating[Any]]


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
    found = []
    for kind, cells in mesh.cells.items():
        sides = np.array(SIDES["tetra" if kind.startswith("tetra") else "hexahedron"])
        found.append(cells[:, sides].reshape(-1, 4))
    facets = np.concatenate(found)
    key = np.sort(facets, axis=1)
    _, first, count = np.unique(key, axis=0, return_index=True, return_counts=True)
    outer = facets[np.sort(first[count == 1])]
    used, at = np.unique(outer, return_inverse=True)
    return used, at.reshape(-1, 4)
