"""Elastic solids of any shape by shapes of a mesh, which stand in place of polynomials (`flexura.beam.ritz`).

The shapes are modes of the solid among its deflections under loads on patches and its own lowest modes: one block of
coordinates of unit modal mass.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam.ritz import Patches, fitted_rows
from flexura.duals import plain, with_slopes_of

NEIGHBOURS = 24
"""Cells by their middles among which a point is looked for."""

EDGES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
"""Corners of the edges of a tetrahedron, in the order of VTK."""


class Tetrahedra:
    """Straight quadratic tetrahedra, by their points (n, 3) and cells (c, 10)."""

    def __init__(self, points: Array, cells: Index) -> None:
        from scipy.spatial import cKDTree  # a fifth of the time to start, for composites alone

        corners = points[cells[:, :4]]
        self._cells, self._first = cells, corners[:, 0]
        self._tree: Any = cKDTree(corners.mean(axis=1))
        edges: Array = np.swapaxes(corners[:, 1:] - corners[:, :1], -1, -2)
        self._inverse: Array = np.asarray(np.linalg.inv(edges), dtype=float)

    def at(self, points: Array) -> tuple[Index, Array]:
        """The points of the cells (..., 10) in which points (..., 3) lie and the values of their functions there; for
        points outside those of the nearest place."""
        near = self._tree.query(plain(points), min(NEIGHBOURS, len(self._cells)))[1]
        away = plain(points)[..., None, :] - self._first[near]
        shares = (self._inverse[near] @ away[..., None])[..., 0]
        least = np.minimum(shares.min(axis=-1), 1 - shares.sum(axis=-1))
        cell = np.take_along_axis(near, least.argmax(axis=-1)[..., None], axis=-1)[..., 0]
        three = (self._inverse[cell] @ (points - self._first[cell])[..., None])[..., 0]
        four = np.concatenate([1 - three.sum(axis=-1)[..., None], three], axis=-1)
        four = np.where(plain(four) > 0, four, 0.0 * four)
        four = four / four.sum(axis=-1)[..., None]
        values = [four * (2 * four - 1), 4 * four[..., EDGES[:, 0]] * four[..., EDGES[:, 1]]]
        return self._cells[cell], np.concatenate(values, axis=-1)


class FiniteSolid:
    """A solid of straight quadratic tetrahedra in coordinates of its shapes.

    shapes (n, 3, s), displacements of the points of `mesh` of unit modal mass; squared (s,) angular frequencies, 1/s^2;
    momentum (6, s), kg and kg m, about the origin; rigid (6, 6), its mass matrix there; `held` the axis and the side of
    the face that does not move.
    """

    def __init__(
        self, mesh: Tetrahedra, modes: tuple[Array, Array, Array], rigid: Array, held: tuple[int, int] | None
    ) -> None:
        self.shapes: Array = modes[0]
        self.squared: Array = modes[1]
        self.momentum: Array = modes[2]
        self.mesh: Tetrahedra = mesh
        self.rigid: Array = rigid
        self.held: tuple[int, int] | None = held

    def displacements(self, points: Array) -> Array:
        """Displacements (..., 3, s) at points (..., 3), those of the nearest place of the solid for points outside."""
        if points.ndim > 3 and with_slopes_of(points) is None:  # one design after another: many take much memory
            return np.stack([self.displacements(design) for design in points])
        nodes, N = self.mesh.at(points)
        U = self.shapes[nodes]
        return (N[..., None, :] @ U.reshape(*U.shape[:-2], -1))[..., 0, :].reshape(*points.shape[:-1], 3, -1)

    def rows(self, patches: Patches) -> Array:
        """Motion (..., 1, 6p, s) of patches by coordinates, of one that is held with its mean motion as the last."""
        U = self.displacements(patches.points)
        flat = U.reshape(*U.shape[:-2], -1)
        rows = fitted_rows(patches, flat, lambda moments: moments.reshape(*moments.shape[:-1], 3, -1))
        if self.held is None:
            return rows[..., None, :, :]
        mean = np.linalg.solve(self.rigid, self.momentum)
        return np.concatenate([rows, mean + 0.0 * rows[..., :1, :1]], axis=-2)[..., None, :, :]

    def solved(self, loads: Array) -> Array:
        """Coordinates (..., 1, s, k) under loads (..., 1, s, k), a free solid accelerated by what is out of balance."""
        return loads / self.squared[:, None]

    def products(self, coordinates: Array, inner: Array) -> tuple[Array, Array]:
        """Mass (..., k, k) between coordinates (..., 1, s, k), and stiffness (..., m, m) between inner ones."""
        flat, own = coordinates[..., 0, :, :], inner[..., 0, :, :]
        stiffness = np.swapaxes(own, -1, -2) @ (self.squared[:, None] * own)
        return np.swapaxes(flat, -1, -2) @ flat, stiffness

    def momenta(self, coordinates: Array) -> Array:
        """Momentum and angular momentum about the origin (..., 6, k) of coordinates (..., 1, s, k)."""
        return self.momentum @ coordinates[..., 0, :, :]

    def kept(self, shapes: Array) -> Array:
        """Coordinates (1, s, k) as they are: shapes of a free solid have no mean motion."""
        return shapes

    def displaced(self, coordinates: Array, points: Array) -> Array:
        """Displacements (q, 3, k), m, of points (q, 3), m from the origin, by coordinates (1, s, k); one design."""
        return self.displacements(points) @ coordinates[0]

    def lowest(self, count: int) -> Array:
        """Coordinates (1, s, count) of its lowest modes."""
        return np.eye(len(self.squared), count)[None]
