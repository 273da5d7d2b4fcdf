"""Scenes as a viewer far away sees them: where to look from, shaded faces and outlines, their image in a figure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flexura.errors import OptionError
from flexura.view.drawing.figures import (
    COLOURS,
    DPI,
    GHOST,
    STYLES,
    Box,
    displacement_colours,
    dot_style,
    lay_image,
    pixel_axes,
    stress_colours,
)
from flexura.view.drawing.raster import Lines, Painting, Triangles, nearest_triangles, of_faces, render
from flexura.view.scene import Array, Index, Kind, Solids, normals

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
    count = 2 * len(front[0])
    alone = len(nearest_triangles(Triangles(every.corners[:count], every.colours[:count]), width, height))
    among = int((nearest_triangles(every, width, height) < count).sum())
    return among / alone if alone else 1.0


MODE_SIZE = 0.12
"""Largest drawn displacement of a mode, relative to the longest side of the mechanism."""
MOST_TURN = 0.45
"""Largest drawn rotation of a node, rad."""
HIDDEN = 0.6
"""Rigid bodies are see-through when less than this share of the flexures can be seen."""
FAR = 1e6
"""How far behind everything a ghost stands, pixels."""


class Colours(NamedTuple):
    """Colours, RGB, at the corners of faces (f, 4, 3), and of lines (l, 3)."""

    faces: Array
    lines: Array


def rest_colours(parts: Solids) -> Colours:
    """Colours by kind."""
    colours = np.array([COLOURS[kind] for kind in Kind])
    return Colours(np.repeat(colours[parts.face_kinds][:, None], 4, axis=1), colours[parts.line_kinds])


def mode_colours(parts: Solids) -> Colours:
    """Colours by displacement; clamps and rigid arms have their own."""
    largest = parts.largest_motion() or 1.0
    colours = displacement_colours(np.linalg.norm(parts.motions, axis=1) / largest)
    faces, lines = colours[parts.faces], 0.85 * colours[parts.lines].mean(axis=1)
    faces[parts.face_kinds == Kind.CLAMP] = COLOURS[Kind.CLAMP]
    lines[parts.line_kinds == Kind.ARM] = COLOURS[Kind.ARM]
    return Colours(faces, lines)


def colours_by_stress(parts: Solids, largest: float) -> Colours:
    """Colours by stress where it is known, of which the largest is given, and by kind elsewhere."""
    faces, lines = rest_colours(parts)
    colours = stress_colours(np.nan_to_num(parts.values) / (largest or 1.0))
    faces = np.where(np.isnan(parts.values[parts.faces][..., None]), faces, colours[parts.faces])
    unknown = np.isnan(parts.values[parts.lines].sum(axis=1, keepdims=True))
    return Colours(faces, np.where(unknown, lines, colours[parts.lines].mean(axis=1)))


def painting_of(
    parts: Solids,
    view: View,
    colours: Colours,
    scale: float = 0.0,
    *,
    over_ghost: bool = False,
    clear_bodies: bool = False,
    ambient: float = 0.62,
    ink: float = 0.45,
) -> Painting:
    """A mechanism that has moved by `scale` times its motions, in colours, in front of its ghost at rest or without it.

    Boxes of equal inertia, bodies with warnings, and other rigid bodies where these are clear, are see-through.
    """
    points = parts.points + scale * parts.motions
    clear = (parts.face_kinds == Kind.EQUIVALENT_BODY) | (parts.face_kinds == Kind.FLAGGED_BODY)
    clear |= (parts.face_kinds == Kind.BODY) & clear_bodies
    opaque, edges = painted(view, points, parts.faces[~clear], colours.faces[~clear], 1.0, ambient, ink)
    glass, rims = painted(view, points, parts.faces[clear], colours.faces[clear], 1.0, ambient, ink)
    width = np.array([STYLES[kind].width for kind in Kind])[parts.line_kinds] * DPI / 72
    lines = Lines(view.pixels(points)[parts.lines], colours.lines, width)
    painting = Painting.of([opaque], [edges, rims, lines], [glass])
    return Painting.joined([ghost(parts, view), painting]) if over_ghost else painting


def ghost(parts: Solids, view: View) -> Painting:
    """A mechanism at rest in light grey, behind everything."""
    grey = np.array(GHOST)
    colours = Colours(np.broadcast_to(grey, (*parts.faces.shape, 3)), np.broadcast_to(grey, (len(parts.lines), 3)))
    solid, lines, glass = painting_of(parts, view, colours, ambient=0.9, ink=0.75)
    behind = Painting.of([solid, glass], [lines])
    behind.solid.corners[..., 2] -= FAR
    behind.lines.ends[..., 2] -= FAR
    return behind


def camera_for(parts: Solids, elev: float | None, azim: float | None) -> Camera:
    """The direction of view that is asked for, chosen to suit the mechanism where it is not."""
    if elev is not None and azim is not None:
        return Camera(elev, azim)
    chosen = good_camera(parts)
    return Camera(chosen.elev if elev is None else elev, chosen.azim if azim is None else azim)


def mode_scale(parts: Solids) -> float:
    """Factor that makes the largest displacement MODE_SIZE of the mechanism, unless nodes turn by more than MOST_TURN.

    Rotations are drawn to first order, so larger ones would blow parts up.
    """
    move, turn = parts.largest_motion(), parts.rotation
    limits = [MODE_SIZE * parts.size() / move] if move > 0 else []
    limits += [MOST_TURN / turn] if turn > 0 else []
    return min(limits, default=0.0)


def scale_of(parts: Solids, scale: float | None) -> float:
    """The factor on displacements that is asked for, that of `mode_scale` by default. Raises OptionError."""
    if scale is None:
        return mode_scale(parts)
    if not np.isfinite(scale):
        raise OptionError(f"scale is a finite number (found {scale})")
    return scale


def mode_view(figure: Figure, parts: Solids, camera: Camera, scale: float, area: Box) -> View:
    """The view in which a mechanism fills an area of a figure, at rest and moved."""
    return view_of(figure, camera, np.concatenate([parts.points, parts.points + scale * parts.motions]), area)


def view_of(figure: Figure, camera: Camera, points: Array, area: Box) -> View:
    """The view in which points (n, 3), m, fill an area of a figure."""
    size = DPI * figure.get_size_inches()
    low = np.array(area[:2]) * size
    return View.fitting(camera, points, low, low + np.array(area[2:]) * size)


def paint(figure: Figure, painting: Painting) -> tuple[Axes, Array]:
    """Lay the image of a painting over the whole figure, as fine as that is; axes over it, and the depth (height,
    width), both in pixels of 150 dpi."""
    fineness = figure.dpi / DPI
    width, height = (round(fineness * DPI * side) for side in figure.get_size_inches())
    image, depth = render(painting.enlarged(fineness), width, height)
    axes = pixel_axes(figure, zorder=5)
    across, up = axes.get_xlim()[1], axes.get_ylim()[1]
    lay_image(axes, image, across / width)
    column, row = ((fineness * np.arange(int(n))).astype(int) for n in (across, up))
    return axes, (depth[row[:, None], column] / fineness).astype(float)


def add_dots(axes: Axes, parts: Solids, view: View, depth: Array) -> None:
    """Dots for nodes; faint ones far behind what hides them."""
    deepest = 0.15 * parts.size() * view.scale
    for kind in (Kind.NODE, Kind.CENTRE):
        x = view.pixels(parts.points[parts.dots[parts.dot_kinds == kind]])
        column, row = (x[:, k].astype(int).clip(0, n - 1) for k, n in ((0, depth.shape[1]), (1, depth.shape[0])))
        shown = depth[row, column] - x[:, 2] < deepest
        for at, alpha in ((x[shown], 1.0), (x[~shown], 0.4)):
            axes.plot(at[:, 0], at[:, 1], linestyle="", marker="o", alpha=alpha, **dot_style(kind))
