"""Bodies as convex hulls: what is inside of them, and how far it is out."""

from __future__ import annotations

import numpy as np

from flexura.view.scene.meshes import Array, Mesh, normals


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
