"""Scenes as triangles and lines in the colours that a picture asks for, and these as an image in a figure."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.errors import OptionError
from flexura.view.drawing.annotations import Box, dot_style, pixel_axes
from flexura.view.drawing.camera import Camera, View, painted
from flexura.view.drawing.figures import DPI, lay_image
from flexura.view.drawing.palette import COLOURS, GHOST, WIDTHS, displacement_colours
from flexura.view.drawing.raster import Lines, Painting, render
from flexura.view.drawing.viewpoint import good_camera
from flexura.view.scene import Array, Kind, Solids

MODE_SIZE = 0.12
"""Largest drawn displacement of a mode, relative to the longest side of the mechanism."""
MOST_TURN = 0.45
"""Largest drawn rotation of a node, rad."""
HIDDEN = 0.6
"""Rigid bodies are see-through when less than this share of the flexures can be seen."""
FAR = 1e6
"""How far behind everything a ghost stands, pixels."""


def rest_painting(parts: Solids, view: View, clear_bodies: bool) -> Painting:
    """A mechanism at rest, coloured by kind, rigid bodies see-through or not."""
    return _painting(parts, parts.points, view, *rest_colours(parts), clear_bodies=clear_bodies)


def rest_colours(parts: Solids) -> tuple[Array, Array]:
    """Colours by kind of faces (f, 4, 3) and lines (l, 3)."""
    colours = np.array([COLOURS[kind] for kind in Kind])
    return np.repeat(colours[parts.face_kinds][:, None], 4, axis=1), colours[parts.line_kinds]


def mode_colours(parts: Solids) -> tuple[Array, Array]:
    """Colours of faces (f, 4, 3) and lines (l, 3) by displacement; clamps and rigid arms have their own."""
    largest = parts.largest_motion() or 1.0
    colours = displacement_colours(np.linalg.norm(parts.motions, axis=1) / largest)
    own = np.array([COLOURS[kind] for kind in Kind])
    faces = colours[parts.faces]
    faces[parts.face_kinds == Kind.CLAMP] = own[Kind.CLAMP]
    lines = 0.85 * colours[parts.lines].mean(axis=1)
    lines[parts.line_kinds == Kind.ARM] = own[Kind.ARM]
    return faces, lines


def mode_painting(parts: Solids, view: View, scale: float) -> Painting:
    """A deformed mechanism, coloured by displacement, in front of its ghost at rest."""
    return over_ghost(parts, view, scale, *mode_colours(parts))


def over_ghost(
    parts: Solids, view: View, scale: float, faces: Array, lines: Array, clear_bodies: bool = False
) -> Painting:
    """A mechanism that has moved by `scale` times its motions, in colours, in front of its ghost at rest.

    faces: (f, 4, 3), lines: (l, 3), RGB; rigid bodies see-through or not.
    """
    return Painting.joined([ghost(parts, view), moved_painting(parts, view, scale, faces, lines, clear_bodies)])


def ghost(parts: Solids, view: View) -> Painting:
    """A mechanism at rest in light grey, behind everything."""
    grey = np.array(GHOST)
    rest = np.broadcast_to(grey, (*parts.faces.shape, 3)), np.broadcast_to(grey, (len(parts.lines), 3))
    solid, lines, glass = _painting(parts, parts.points, view, *rest, ambient=0.9, ink=0.75)
    own = Painting.of([solid, glass], [lines])
    own.solid.corners[..., 2] -= FAR
    own.lines.ends[..., 2] -= FAR
    return own


def moved_painting(
    parts: Solids, view: View, scale: float, faces: Array, lines: Array, clear_bodies: bool = False
) -> Painting:
    """The same as `over_ghost` without the ghost."""
    moved = parts.points + scale * parts.motions
    return _painting(parts, moved, view, faces, lines, clear_bodies=clear_bodies)


def _painting(
    parts: Solids,
    points: Array,
    view: View,
    face_colours: Array,
    line_colours: Array,
    *,
    ambient: float = 0.62,
    ink: float = 0.45,
    clear_bodies: bool = False,
) -> Painting:
    """A scene with its points at `points` (v, 3); boxes of equal inertia, and what is in doubt, are see-through.

    face_colours: (f, 4, 3); line_colours: (l, 3), RGB.
    """
    look = (1.0, ambient, ink)
    clear = (parts.face_kinds == Kind.EQUIVALENT_BODY) | (parts.face_kinds == Kind.DOUBTED_BODY)
    clear |= (parts.face_kinds == Kind.BODY) & clear_bodies
    opaque, edges = painted(view, points, parts.faces[~clear], face_colours[~clear], *look)
    glass, rims = painted(view, points, parts.faces[clear], face_colours[clear], *look)
    width = np.array([WIDTHS.get(kind, 1.0) for kind in Kind])[parts.line_kinds] * DPI / 72
    lines = Lines(view.pixels(points)[parts.lines], line_colours, width)
    return Painting.of([opaque], [edges, rims, lines], [glass])


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
