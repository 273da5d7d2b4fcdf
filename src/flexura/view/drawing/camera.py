"""What a viewer far away sees of solids: faces turned away left out, the others shaded, outlines found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.view.drawing.raster import Lines, Triangles, of_faces
from flexura.view.scene import Array, Index, normals

_SHARP = np.cos(np.deg2rad(40))
_LIFT = 3.0
"""Outlines are so many times their width nearer than the edges that they follow, so that surfaces do not bury them."""
_STEEP = 8.0
"""Inside the silhouette a surface comes nearer by so much for each pixel at most."""


@dataclass(frozen=True)
class Camera:
    """A direction of view: elevation above the xy plane and azimuth from the x axis, both in degrees."""

    elev: float
    azim: float

    @property
    def axes(self) -> Array:
        """Unit vectors (3, 3) as rows: to the right of the picture, up in it, and towards the viewer."""
        e, a = np.deg2rad([self.elev, self.azim])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        return np.stack([right, np.cross(towards, right), towards])


@dataclass(frozen=True)
class View:
    """Where a camera's image lies in a picture: `scale`, pixels per metre, and `origin` (2,), pixels, the image of
    the global origin, from the lower left corner."""

    camera: Camera
    scale: float
    origin: Array

    def pixels(self, points: Array) -> Array:
        """Image of points (..., 3), m: x to the right, y up, z towards the viewer, pixels."""
        image = points @ self.camera.axes.T * self.scale
        image[..., :2] += self.origin
        return image

    @staticmethod
    def fitting(camera: Camera, points: Array, low: Array, high: Array) -> View:
        """The view in which points (n, 3), m, fill the area between two corners (2,), pixels."""
        image = points @ camera.axes[:2].T
        first, last = image.min(axis=0), image.max(axis=0)
        extent = last - first
        scale = float(((high - low) / (np.maximum(extent, 1e-9 * extent.max()) if extent.any() else 0.01)).min())
        return View(camera, scale, (low + high) / 2 - scale * (first + last) / 2)


def painted(
    view: View,
    points: Array,
    faces: Index,
    colours: Array,
    outline: float,
    ambient: float,
    ink: float = 0.45,
) -> tuple[Triangles, Lines]:
    """Visible faces of closed surfaces, shaded, and their outlines.

    points: (v, 3), m; faces: (f, 4); colours: (f, 4, 3), RGB at the corners; outline: width of outlines, pixels;
    ambient: brightness of faces that get no light; ink: that of outlines.
    """
    area = normals(points, faces)
    length = np.linalg.norm(area, axis=1)
    unit = area / np.where(length > 0, length, 1.0)[:, None]
    front = unit @ view.camera.axes[2] > 1e-9
    shade = (ambient + (1 - ambient) * _lit(unit, view.camera))[:, None, None]
    image = view.pixels(points)
    triangles = of_faces(image[faces[front]], (colours * shade)[front])
    ends, pair, sharp = outlines(faces, unit, front)
    seen = np.where(front[pair[:, 0]], pair[:, 0], pair[:, 1])
    edges = image[ends]
    steep = np.where(front[pair].all(axis=1), 0.0, _steepness(unit[seen], view.camera))
    edges[..., 2] += outline * (_LIFT + steep[:, None])
    return triangles, Lines(edges, ink * colours[seen].mean(axis=1), outline * np.where(sharp, 1.0, 1.2))


def outlines(faces: Index, unit: Array, front: NDArray[np.bool_]) -> tuple[Index, Index, NDArray[np.bool_]]:
    """Edges to draw: sharp ones next to a visible face, and the silhouette.

    unit: normals (f, 3); front: (f,), whether a face is turned to the viewer. Returns end points (k, 2), the two
    faces of each (k, 2), and whether it is sharp (k,).
    """
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    owner = np.repeat(np.arange(len(faces)), 4)
    low, high = np.minimum(a, b), np.maximum(a, b)
    proper = low < high
    low, high, owner = low[proper], high[proper], owner[proper]
    order = np.lexsort((high, low))
    low, high, owner = low[order], high[order], owner[order]
    twice = np.flatnonzero((low[:-1] == low[1:]) & (high[:-1] == high[1:]))
    pair = np.stack([owner[twice], owner[twice + 1]], axis=-1)
    one, other = front[pair].T
    sharp = np.einsum("ij,ij->i", unit[pair[:, 0]], unit[pair[:, 1]]) < _SHARP
    drawn = (sharp & (one | other)) | (one != other)
    return np.stack([low[twice], high[twice]], axis=-1)[drawn], pair[drawn], sharp[drawn]


def _steepness(unit: Array, camera: Camera) -> Array:
    """How much the depth of faces with normals (f, 3) changes from one pixel to the next, (f,), at most _STEEP."""
    across, up, towards = np.abs(camera.axes @ unit.T)
    return np.minimum(np.hypot(across, up) / np.maximum(towards, 1e-9), _STEEP)


def _lit(unit: Array, camera: Camera) -> Array:
    """Light (f,), at most 1, on faces with normals (f, 3): most from the upper left behind the viewer, some from the
    right."""
    main, fill = np.array([[-0.45, 0.75, 0.8], [0.85, 0.1, 0.5]]) @ camera.axes
    strong = np.maximum(unit @ (main / np.linalg.norm(main)), 0.0)
    weak = np.maximum(unit @ (fill / np.linalg.norm(fill)), 0.0)
    return np.minimum(strong + 0.3 * weak, 1.0)
