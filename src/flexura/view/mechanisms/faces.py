"""A picture of a part from CAD whose faces have their numbers."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from flexura.errors import OptionError
from flexura.fem import Drawing, PartFace
from flexura.view.drawing import Camera, Painting, heading, new_figure, paint, painted, view_of
from flexura.view.scene import Array

SIZE = (11.0, 6.2)
"""Width and height of the picture, inches."""

VIEWS = ((Camera(28.0, -55.0), (0.03, 0.06, 0.45, 0.78)), (Camera(-28.0, 125.0), (0.52, 0.06, 0.45, 0.78)))
"""Two cameras that look at each other, and where their images are."""

FACING = 0.2
"""Cosine of the angle between the normal of a triangle and the direction of view from which it bears a number."""

HIDDEN_BY = 2.0
"""Pixels that something is nearer than a place from which it hides it."""


def draw_faces(drawing: Drawing) -> Figure:
    """The faces of a part from both sides, each with its number; those with a colour in the file have it."""
    if not isinstance(drawing, Drawing):
        raise OptionError(f"a Drawing is expected, not a {type(drawing).__name__}; flexura.faces reads one")
    figure = new_figure(SIZE)
    heading(figure, drawing.name, f"{len(drawing.faces)} faces, from both sides; `face: NUMBER` chooses one")
    corners = np.concatenate([face.triangles for face in drawing.faces])
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    triangles = index.reshape(-1, 3)
    quads = triangles[:, [0, 1, 2, 2]]
    tint = np.concatenate([np.tile(_colour(face), (len(face.triangles), 4, 1)) for face in drawing.faces])
    views = [view_of(figure, camera, points, area) for camera, area in VIEWS]
    painting = Painting.joined(
        Painting.of([solid], [lines])
        for solid, lines in (painted(view, points, quads, tint, outline=1.2, ambient=0.6) for view in views)
    )
    axes, depth = paint(figure, painting)
    for view in views:
        for face in drawing.faces:
            place = _seen(view.pixels(face.triangles), depth)
            if place is not None:
                box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}
                axes.text(*place, str(face.number), size=7, ha="center", va="center", bbox=box, zorder=9)
    return figure


def _colour(face: PartFace) -> Array:
    """That of the file, else one of a few pale ones in turn."""
    if face.colour:
        return np.array([int(face.colour[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    return np.array(colormaps["Pastel1"](face.number % 9)[:3])


def _seen(triangles: Array, depth: Array) -> tuple[float, float] | None:
    """Where triangles (t, 3, 3), pixels, are best seen in the picture: near their middle, from in front."""
    edges = np.diff(triangles, axis=1)
    normals = np.cross(edges[:, 0], edges[:, 1])
    towards = normals[:, 2] / np.linalg.norm(normals, axis=1) > FACING
    if not towards.any():
        return None
    places, area = triangles[towards].mean(axis=1), normals[towards, 2]
    middle = (area @ places) / area.sum()
    order = np.argsort(np.linalg.norm(places[:, :2] - middle[:2], axis=1))
    for x, y, z in places[order].tolist():
        row, column = round(y), round(x)
        if 0 <= row < depth.shape[0] and 0 <= column < depth.shape[1] and depth[row, column] <= z + HIDDEN_BY:
            return x, y
    return None
