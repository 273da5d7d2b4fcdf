"""Surfaces as quadrilaterals: lofts through rings, boxes, cylinders, spheres.

Seen from outside, the corners of a face run anticlockwise; a triangle repeats a corner.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index


class Mesh(NamedTuple):
    """Points (v, 3), m, and faces (f, 4) that index them."""

    points: Array
    faces: Index


def loft_faces(rings: int, sides: int, cyclic: bool = False) -> Index:
    """Faces (f, 4) between consecutive rings of `sides` points; `cyclic` joins the last ring to the first.

    Points are numbered ring by ring. They run about the loft's direction, right-handed.
    """
    k = np.arange(rings if cyclic else rings - 1)[:, None]
    i = np.arange(sides)
    here, there = k * sides, (k + 1) % rings * sides
    j = (i + 1) % sides
    return np.stack([here + i, here + j, there + j, there + i], axis=-1).reshape(-1, 4).astype(np.intp)


def polygon(sides: int) -> Array:
    """Unit circle as points (sides, 2), right-handed, with a flat at the first axis."""
    angle = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def square(ny: int = 1, nz: int = 1) -> Array:
    """Outline of the square from (-1, -1) to (1, 1), right-handed, sides cut into ny and nz parts: (2 ny + 2 nz, 2)."""
    y, z = np.linspace(-1, 1, ny + 1)[:-1], np.linspace(-1, 1, nz + 1)[:-1]
    sides = [(np.ones(nz), z), (-y, np.ones(ny)), (-np.ones(nz), -z), (y, -np.ones(ny))]
    return np.concatenate([np.stack(side, axis=-1) for side in sides])


def box(size: Array, cell: float) -> Mesh:
    """Box about the origin with edges `size` (3,), m, along the axes, cut into faces of about `cell`, m."""
    counts = np.clip(np.ceil(size / cell), 1, 14).astype(int)
    lattice, faces = _lattice(tuple(counts.tolist()))
    return Mesh((lattice / counts - 0.5) * size, faces)


@lru_cache(maxsize=256)
def _lattice(counts: tuple[int, ...]) -> tuple[Array, Index]:
    """Points of the surface of a box by their numbers along the axes, and its faces."""
    corners: list[Array] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        a, b = np.meshgrid(np.arange(counts[u]), np.arange(counts[v]), indexing="ij")
        a, b = a.ravel(), b.ravel()
        for end, turns in ((0, [(0, 0), (0, 1), (1, 1), (1, 0)]), (counts[axis], [(0, 0), (1, 0), (1, 1), (0, 1)])):
            quad = np.empty((len(a), 4, 3))
            quad[..., axis] = end
            for k, (da, db) in enumerate(turns):
                quad[:, k, u], quad[:, k, v] = a + da, b + db
            corners.append(quad)
    lattice, number = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    return lattice, number.reshape(-1, 4).astype(np.intp)


def cylinder(diameter: float, length: float, axis: Array, cell: float, sides: int = 64) -> Mesh:
    """Cylinder about the origin with its axis along `axis` (3,), cut into faces of about `cell`, m."""
    n = int(np.clip(np.ceil(diameter / 2 / cell), 1, 8))
    m = int(np.clip(np.ceil(length / cell), 1, 12))
    radii = np.concatenate([np.arange(n) / n, np.ones(m + 1), np.arange(n)[::-1] / n]) * diameter / 2
    along = np.concatenate([np.zeros(n), np.arange(m + 1) / m, np.ones(n)]) * length - length / 2
    return revolved(along, radii, axis, sides)


def sphere(radius: float, sides: int = 24) -> Mesh:
    """Sphere about the origin, radius in m."""
    angle = np.linspace(0, np.pi, sides // 2 + 1)
    return revolved(-radius * np.cos(angle), radius * np.sin(angle), np.array([0.0, 0.0, 1.0]), sides)


def cone(radius: float, height: float, axis: Array, sides: int = 4) -> Mesh:
    """Pyramid with its tip at the origin, opening along `axis` (3,); radius and height in m."""
    along = np.array([0.0, height, height])
    return revolved(along, np.array([0.0, radius, 0.0]), axis, sides)


def revolved(along: Array, radii: Array, axis: Array, sides: int) -> Mesh:
    """Body of revolution with `radii` (r,), m, at distances `along` (r,), m, on `axis` (3,)."""
    frame = frame_along(axis)
    ring = polygon(sides)
    local = np.empty((len(along), sides, 3))
    local[..., 0] = along[:, None]
    local[..., 1:] = radii[:, None, None] * ring
    return Mesh(local.reshape(-1, 3) @ frame, loft_faces(len(along), sides))


def frame_along(axis: Array) -> Array:
    """Right-handed frame (3, 3) with its axes as rows, the first along `axis` (3,)."""
    x = axis / np.linalg.norm(axis)
    z = np.eye(3)[np.argmin(np.abs(x).round(6))]
    y = np.cross(z, x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


def normals(points: Array, faces: Index) -> Array:
    """Area vectors (f, 3), m^2, of faces (f, 4): outward, as long as twice the area."""
    p = points[faces]
    return np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])


class Hulls:
    """Convex meshes, global frame, one added after another; only those whose boxes hold a point are looked into."""

    def __init__(self) -> None:
        self._meshes: list[Mesh] = []
        self._boxes = np.empty((16, 2, 3))

    def add(self, mesh: Mesh) -> None:
        """Add one."""
        count = len(self._meshes)
        if count == len(self._boxes):
            self._boxes = np.concatenate([self._boxes, np.empty_like(self._boxes)])
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        margin = 1e-6 * (high - low).max()
        self._boxes[count] = low - margin, high + margin
        self._meshes.append(mesh)

    def way_out(self, point: Array, direction: Array) -> float:
        """Largest distance, m, from a point (3,) in any of them to its surface along a unit vector; zero outside."""
        low, high = np.moveaxis(self._boxes[: len(self._meshes)], 1, 0)
        near = np.flatnonzero(((low <= point) & (point <= high)).all(axis=1))
        return max((_way_out(self._meshes[k], point, direction) for k in near), default=0.0)


def _heights(mesh: Mesh, point: Array) -> tuple[Array, Array]:
    """Heights (f,), m, of a point above the faces of a mesh, and the unit normals (f, 3) of the faces."""
    area = normals(mesh.points, mesh.faces)
    unit = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-300)
    return np.einsum("ij,ij->i", unit, point - mesh.points[mesh.faces[:, 0]]), unit


def is_inside(mesh: Mesh, point: Array) -> bool:
    """True when a point (3,) is in a convex mesh or on it."""
    return bool((_heights(mesh, point)[0] <= 1e-6 * np.ptp(mesh.points, axis=0).max()).all())


def _way_out(mesh: Mesh, point: Array, direction: Array) -> float:
    """Distance, m, from a point (3,) in a convex mesh to its surface along a unit vector; zero from outside."""
    height, unit = _heights(mesh, point)
    slope = unit @ direction
    if not is_inside(mesh, point) or not (slope > 1e-6).any():
        return 0.0
    return max(0.0, float((-height[slope > 1e-6] / slope[slope > 1e-6]).min()))
