"""A solid mesh: points, quadratic cells, materials and named sets of points."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flexura.arrays import Array, Index
from flexura.solid.geometry import SolidMaterial

CELLS = {"tetra10": 10, "hexahedron20": 20, "hexahedron27": 27}
"""Kinds of cells with their number of points, ordered as in VTK and meshio."""


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


def rigid_motions(points: Array, about: Array | None = None) -> Array:
    """DOF vectors (3 n, 6) of unit translations and rotations about the origin, or `about` (3,), of points (n, 3)."""
    x = points if about is None else points - about
    out = np.zeros((len(x), 3, 6))
    for j, axis in enumerate(np.eye(3)):
        out[:, j, j] = 1.0
        out[:, :, 3 + j] = np.cross(axis, x)
    return out.reshape(-1, 6)
