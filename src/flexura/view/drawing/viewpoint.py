"""From where to look at a mechanism."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexura.errors import OptionError
from flexura.view.drawing.camera import Camera, View
from flexura.view.drawing.raster import Triangles, nearest_triangles, of_faces
from flexura.view.scene import Array, Kind, Solids, normals

_GOOD = 0.8
_SKETCH = (160, 120)


def good_camera(parts: Solids) -> Camera:
    """The customary view of a mechanism, or another one when that hides much of its flexures.

    Raises OptionError when there is nothing to look at.
    """
    if not len(parts.points):
        raise OptionError("there is nothing to draw: the mechanism has no nodes")
    first = customary_camera(*parts.bounds())
    best, most = first, -1.0
    for camera in (first, *_alternatives(first)):
        share = visible_flexures(parts, camera)
        if share >= _GOOD:
            return camera
        if share > most + 0.05:
            best, most = camera, share
    return best


def customary_camera(low: Array, high: Array) -> Camera:
    """A view from the front right on a bounding box (3,), m; steeper on what lies flat."""
    extent = high - low
    flat = extent < 0.2 * float(extent.max())
    if flat[2] and not flat[:2].any():
        return Camera(48.0, -60.0)
    if flat[1] and not flat[[0, 2]].any():
        return Camera(22.0, -65.0)
    if flat[0] and not flat[1:].any():
        return Camera(22.0, -25.0)
    return Camera(26.0, -56.0)


def _alternatives(first: Camera) -> Iterator[Camera]:
    for elev in (first.elev, 13.0, 38.0, 55.0):
        for azim in (first.azim, -38.0, -74.0):
            if (elev, azim) != (first.elev, first.azim):
                yield Camera(elev, azim)


def visible_flexures(parts: Solids, camera: Camera) -> float:
    """Share of the image of the flexures that nothing else hides, from a small sketch; 1 when there are none."""
    is_flexure, is_glass = parts.face_kinds == Kind.FLEXURE, parts.face_kinds == Kind.EQUIVALENT_BODY
    points, flexures, others = parts.points, parts.faces[is_flexure], parts.faces[~is_flexure & ~is_glass]
    width, height = _SKETCH
    view = View.fitting(camera, points, np.zeros(2), np.array([width, height], dtype=float))
    image = view.pixels(points)
    front = [faces[normals(points, faces) @ camera.axes[2] > 0] for faces in (flexures, others)]
    every = of_faces(image[np.concatenate(front)], np.zeros((sum(map(len, front)), 4, 3)))
    own = 2 * len(front[0])
    alone = len(nearest_triangles(Triangles(every.corners[:own], every.colours[:own]), width, height))
    among = int((nearest_triangles(every, width, height) < own).sum())
    return among / alone if alone else 1.0
