"""Pictures of mechanisms and their modes with matplotlib, which is imported when the first one is drawn."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.structure import FullOrderModel
from flexura.view.annotations import (
    Box,
    colour_bar,
    dot_style,
    heading,
    legend,
    line_height,
    pixel_axes,
    remark_lines,
    triad,
)
from flexura.view.axes import frame
from flexura.view.camera import Camera, View, painted
from flexura.view.meshes import Array
from flexura.view.palette import COLOURS, GHOST, INK, WARNING, WIDTHS, displacement_colours
from flexura.view.raster import Triangles, of_lines, render
from flexura.view.scene import Kind, Solids
from flexura.view.solids import solids
from flexura.view.viewpoint import good_camera, visible_flexures

SIZE = (8.0, 6.0)
"""Width and height of a picture, inches."""
DPI = 150
MODE_SIZE = 0.12
"""Largest drawn displacement of a mode, relative to the longest side of the mechanism."""
MOST_TURN = 0.45
"""Largest drawn rotation of a node, rad."""
HIDDEN = 0.6
"""Rigid bodies are see-through when less than this share of the flexures can be seen."""


@verb
def draw_mechanism(
    model: FullOrderModel, *, title: str | None = None, elev: float | None = None, azim: float | None = None
) -> Figure:
    """Draw the mechanism, undeformed or at the pose that is described: flexures, links, bodies and supports by colour,
    axes with their unit, a legend.

    title: the mechanism's name when left out; elev, azim: direction of view, degrees, chosen to suit the mechanism
    when left out. Rigid bodies are see-through when they would hide the flexures. Returns a matplotlib Figure of
    1200 x 900 pixels on an Agg canvas; pyplot is not involved. Faces turned away are left out, so the view is fixed.
    Raises OptionError for a model that holds a stack of designs or nothing that could be drawn.
    """
    parts = solids(model)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE)
    view = frame(figure, camera, parts.bounds(), (0.07, 0.175, 0.81, 0.725))
    axes, depth = paint(figure, *rest_triangles(parts, view, visible_flexures(parts, camera) < HIDDEN))
    add_dots(axes, parts, view, depth)
    heading(figure, title if title is not None else model.plan.mechanism.name, "")
    legend(figure, parts)
    return figure


@verb
def draw_mode(
    model: FullOrderModel,
    displacements: ArrayLike,
    *,
    title: str,
    subtitle: str = "",
    warnings: Sequence[object] = (),
    scale: float | None = None,
    elev: float | None = None,
    azim: float | None = None,
) -> Figure:
    """Draw a mode shape, coloured by displacement, over a ghost of the mechanism at rest.

    displacements: (n_nodes, 6), m and rad in any common scale, global frame (`FullOrderModel.node_displacements`).
    scale: factor on the displacements; when left out the largest becomes 12 % of the mechanism's longest side, or
    the largest rotation 0.45 rad.
    title, subtitle and warnings stand above the picture; elev, azim as in `draw_mechanism`. Rotations are drawn to
    first order. Returns a matplotlib Figure of 1200 x 900 pixels. Raises OptionError for displacements that are not
    finite or of another shape.
    """
    parts = solids(model, displacements)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE)
    factor = _scale(parts, scale)
    top = min(heading(figure, title, subtitle, warnings) - 0.01, 0.84)
    view = mode_view(figure, parts, camera, factor, (0.035, 0.05, 0.82, top - 0.05))
    paint(figure, *mode_triangles(parts, view, factor))
    triad(figure, camera, (0.875, 0.03, 0.10, 0.133))
    colour_bar(figure, (0.912, 0.27, 0.017, 0.45))
    return figure


def draw_sheet(
    model: FullOrderModel,
    shapes: Array,
    titles: Sequence[str],
    subtitles: Sequence[str],
    *,
    flags: Sequence[str] = (),
    warnings: Sequence[object] = (),
    elev: float | None = None,
    azim: float | None = None,
) -> Figure:
    """Draw up to six modes on one sheet, three in a row.

    shapes: (n_nodes, 6, k), titles and subtitles: k each, and flags, which say in few words what is wrong with a mode;
    warnings, of the whole, stand along the lower edge. Returns a matplotlib Figure of 1800 x 1200 pixels, or
    1800 x 660 for one row. Raises OptionError as `draw_mode` does.
    """
    count = min(shapes.shape[2], 6)
    rows = 2 if count > 3 else 1
    figure = new_figure((12.0, 8.0 if rows == 2 else 4.4))
    camera = None
    said = remark_lines(warnings, "warning", 0.9 * figure.get_figwidth(), 8.5)
    foot = len(said) * line_height(figure, 8.5) + (0.02 if said else 0.0)
    cell = (1 - foot) / rows
    painting: list[tuple[Triangles, Triangles]] = []
    for k in range(count):
        parts = solids(model, shapes[:, :, k])
        camera = camera or camera_for(parts, elev, azim)
        left, bottom = 0.015 + 0.308 * (k % 3), 1 - (k // 3 + 1) * cell
        scale = _scale(parts, None)
        top = bottom + 0.96 * cell
        style = {"ha": "center", "va": "top", "parse_math": False}
        figure.text(left + 0.15, top, titles[k], size=12, weight="bold", color=INK, **style)
        top -= 0.065 / rows
        for lines, colour in (
            (textwrap.wrap(subtitles[k], 58)[:2], "0.35"),
            (textwrap.wrap(flags[k], 58)[:1] if flags else [], WARNING),
        ):
            figure.text(left + 0.15, top, "\n".join(lines), size=8.5, color=colour, **style)
            top -= len(lines) * line_height(figure, 8.5)
        height = min(0.77 * cell, top - 0.01 - bottom - 0.05 * cell)
        view = mode_view(figure, parts, camera, scale, (left + 0.01, bottom + 0.05 * cell, 0.28, height))
        painting.append(mode_triangles(parts, view, scale))
    if said:
        style = {"va": "bottom", "size": 8.5, "color": WARNING, "linespacing": 1.35, "parse_math": False}
        figure.text(0.025, 0.012, "\n".join(said), **style)
    if camera is not None:
        paint(figure, *(Triangles.joined(list(part)) for part in zip(*painting, strict=True)))
        triad(figure, camera, (0.942, 0.02, 0.052, 0.052 * figure.bbox.width / figure.bbox.height))
    colour_bar(figure, (0.952, 0.28, 0.009, 0.46))
    return figure


def _triangles(
    parts: Solids,
    points: Array,
    view: View,
    face_colours: Array,
    line_colours: Array,
    *,
    ghost: bool = False,
    clear_bodies: bool = False,
) -> tuple[Triangles, Triangles]:
    """Opaque and see-through triangles of a scene with its points at `points` (v, 3).

    face_colours: (f, 4, 3); line_colours: (l, 3), RGB.
    """
    ambient, ink = (0.9, 0.75) if ghost else (0.62, 0.45)
    look = (1.0, ambient, ink)
    clear = (parts.face_kinds == Kind.EQUIVALENT_BODY) | (parts.face_kinds == Kind.DOUBTED_BODY)
    clear |= (parts.face_kinds == Kind.BODY) & clear_bodies
    opaque = painted(view, points, parts.faces[~clear], face_colours[~clear], *look)
    glass = painted(view, points, parts.faces[clear], face_colours[clear], 0.0, ambient)
    edges = painted(view, points, parts.faces[clear], face_colours[clear], *look, fill=False)
    width = np.array([WIDTHS.get(kind, 1.0) for kind in Kind])[parts.line_kinds] * DPI / 72
    lines = of_lines(view.pixels(points)[parts.lines], line_colours, width)
    return Triangles.joined([opaque, edges, lines]), glass


def rest_triangles(parts: Solids, view: View, clear_bodies: bool) -> tuple[Triangles, Triangles]:
    """A mechanism at rest, coloured by kind, rigid bodies see-through or not."""
    return _triangles(parts, parts.points, view, *rest_colours(parts), clear_bodies=clear_bodies)


def rest_colours(parts: Solids) -> tuple[Array, Array]:
    """Colours by kind of faces (f, 4, 3) and lines (l, 3)."""
    colours = np.array([COLOURS[kind] for kind in Kind])
    return np.repeat(colours[parts.face_kinds][:, None], 4, axis=1), colours[parts.line_kinds]


def mode_triangles(parts: Solids, view: View, scale: float) -> tuple[Triangles, Triangles]:
    """A deformed mechanism, coloured by displacement, in front of its ghost at rest."""
    largest = parts.largest_motion() or 1.0
    colours = displacement_colours(np.linalg.norm(parts.motions, axis=1) / largest)
    own = np.array([COLOURS[kind] for kind in Kind])
    faces = colours[parts.faces]
    still = parts.face_kinds == Kind.CLAMP
    faces[still] = own[Kind.CLAMP]
    lines = 0.85 * colours[parts.lines].mean(axis=1)
    lines[parts.line_kinds == Kind.ARM] = own[Kind.ARM]
    return over_ghost(parts, view, scale, faces, lines)


def over_ghost(
    parts: Solids, view: View, scale: float, faces: Array, lines: Array, clear_bodies: bool = False
) -> tuple[Triangles, Triangles]:
    """A mechanism that has moved by `scale` times its motions, in colours, in front of its ghost at rest.

    faces: (f, 4, 3), lines: (l, 3), RGB; rigid bodies see-through or not.
    """
    moved = parts.points + scale * parts.motions
    solid, glass = _triangles(parts, moved, view, faces, lines, clear_bodies=clear_bodies)
    grey = np.array(GHOST)
    rest = np.broadcast_to(grey, (*parts.faces.shape, 3)), np.broadcast_to(grey, (len(parts.lines), 3))
    behind = Triangles.joined(list(_triangles(parts, parts.points, view, *rest, ghost=True)))
    behind.corners[..., 2] -= 1e6
    return Triangles.joined([behind, solid]), glass


def camera_for(parts: Solids, elev: float | None, azim: float | None) -> Camera:
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


def _scale(parts: Solids, scale: float | None) -> float:
    if scale is None:
        return mode_scale(parts)
    if not np.isfinite(scale):
        raise OptionError(f"scale is a finite number (found {scale})")
    return scale


def new_figure(size: tuple[float, float]) -> Figure:
    figure = Figure(figsize=size, dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def mode_view(figure: Figure, parts: Solids, camera: Camera, scale: float, area: Box) -> View:
    size = np.array([figure.bbox.width, figure.bbox.height])
    low = np.array(area[:2]) * size
    points = np.concatenate([parts.points, parts.points + scale * parts.motions])
    return View.fitting(camera, points, low, low + np.array(area[2:]) * size)


def paint(figure: Figure, solid: Triangles, glass: Triangles) -> tuple[Axes, Array]:
    """Lay the image of the triangles over the whole figure; axes in pixels and the depth (height, width)."""
    width, height = int(figure.bbox.width), int(figure.bbox.height)
    image, depth = render(solid, glass, width, height)
    axes = pixel_axes(figure, zorder=5)
    axes.imshow(image, origin="lower", extent=(0, width, 0, height), aspect="auto", interpolation="antialiased")
    return axes, depth


def add_dots(axes: Axes, parts: Solids, view: View, depth: Array) -> None:
    """Dots for nodes; faint ones far behind what hides them."""
    deepest = 0.15 * parts.size() * view.scale
    for kind in (Kind.NODE, Kind.CENTRE):
        x = view.pixels(parts.points[parts.dots[parts.dot_kinds == kind]])
        column, row = (x[:, k].astype(int).clip(0, n - 1) for k, n in ((0, depth.shape[1]), (1, depth.shape[0])))
        shown = depth[row, column] - x[:, 2] < deepest
        for at, alpha in ((x[shown], 1.0), (x[~shown], 0.4)):
            axes.plot(at[:, 0], at[:, 1], linestyle="", marker="o", alpha=alpha, **dot_style(kind))
