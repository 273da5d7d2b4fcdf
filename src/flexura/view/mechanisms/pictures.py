"""Pictures of mechanisms and their modes."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.structure import FullOrderModel
from flexura.view.drawing import (
    DPI,
    HIDDEN,
    INK,
    LABEL_AREA,
    WARNING,
    Painting,
    add_dots,
    camera_for,
    colour_bar,
    frame,
    heading,
    legend,
    line_height,
    mode_painting,
    mode_scale,
    mode_view,
    new_figure,
    paint,
    part_labels,
    remark_lines,
    rest_painting,
    scale_of,
    triad,
    visible_flexures,
    wrapped,
    write_labels,
)
from flexura.view.scene import Array, Look, solids

SIZE = (8.0, 6.0)
"""Width and height of a picture, inches."""
CHANNELS = Look(channels=True)
"""Actuators and sensors are drawn, too."""


@verb
def draw_mechanism(
    model: FullOrderModel,
    *,
    title: str | None = None,
    names: bool | Sequence[str] = False,
    elev: float | None = None,
    azim: float | None = None,
    dpi: float = DPI,
) -> Figure:
    """Draw the mechanism, undeformed or at the pose that is described: flexures, links, bodies and supports by colour,
    axes with their unit, a legend.

    names: True for the names of parts, how nodes are held among them, or a list of names; they stand on leaders.
    Actuators and sensors are arrows and marks. title: the mechanism's name when left out; elev, azim: direction of
    view, degrees, chosen to suit the mechanism when left out; dpi: dots per inch, 300 for print. Rigid bodies are see-
    through when they would hide the flexures. Returns a matplotlib Figure of 1200 x 900 pixels at 150 dpi on an Agg
    canvas; pyplot is not involved. Faces turned away are left out, so the view is fixed. Raises OptionError for a model
    that holds a stack of designs or nothing that could be drawn.
    """
    parts = solids(model, look=CHANNELS)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE, dpi)
    labels, left_out = part_labels(parts, parts.points, names)
    view = frame(figure, camera, parts.bounds(), LABEL_AREA if labels else (0.07, 0.175, 0.81, 0.725))
    axes, depth = paint(figure, rest_painting(parts, view, visible_flexures(parts, camera) < HIDDEN))
    add_dots(axes, parts, view, depth)
    write_labels(axes, view, labels)
    told = "; ".join(filter(None, [left_out, *parts.notes]))
    heading(figure, title if title is not None else model.plan.mechanism.name, told)
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
    names: bool | Sequence[str] = False,
    elev: float | None = None,
    azim: float | None = None,
    dpi: float = DPI,
) -> Figure:
    """Draw a mode shape, coloured by displacement, over a ghost of the mechanism at rest.

    displacements: (n_nodes, 6), m and rad in any common scale, global frame (`FullOrderModel.node_displacements`).
    scale: factor on the displacements; when left out the largest becomes 12 % of the mechanism's longest side, or
    the largest rotation 0.45 rad.
    title, subtitle and warnings stand above the picture; names, elev, azim, dpi as in `draw_mechanism`. Rotations are
    drawn to first order. Returns a matplotlib Figure of 1200 x 900 pixels. Raises OptionError for displacements that
    are not finite or of another shape.
    """
    parts = solids(model, displacements)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE, dpi)
    factor = scale_of(parts, scale)
    moved = parts.points + factor * parts.motions
    labels, left_out = part_labels(parts, moved, names)
    told = "; ".join(filter(None, [subtitle, left_out, *parts.notes]))
    top = min(heading(figure, title, told, warnings) - 0.01, 0.84)
    area = (LABEL_AREA[0], 0.05, LABEL_AREA[2], top - 0.05) if labels else (0.035, 0.05, 0.82, top - 0.05)
    view = mode_view(figure, parts, camera, factor, area)
    axes, _ = paint(figure, mode_painting(parts, view, factor))
    write_labels(axes, view, labels)
    triad(figure, camera, (0.875, 0.03, 0.10, 0.133))
    colour_bar(figure, (0.912, 0.27, 0.017, min(0.45, top - 0.34)))
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
    magnify: float = 1.0,
    dpi: float = DPI,
) -> Figure:
    """Draw up to six modes on one sheet, three in a row.

    shapes: (n_nodes, 6, k), titles and subtitles: k each, and flags, which say in few words what is wrong with a mode;
    warnings, of the whole, stand along the lower edge. Displacements are drawn `magnify` times as large as is usual.
    Returns a matplotlib Figure of 1800 x 1200 pixels, or 1800 x 660 for one row. Raises OptionError as `draw_mode`
    does.
    """
    count = min(shapes.shape[2], 6)
    rows = 2 if count > 3 else 1
    figure = new_figure((12.0, 8.0 if rows == 2 else 4.4), dpi)
    camera = None
    said = remark_lines(warnings, "warning", 0.9 * figure.get_figwidth(), 8.5)
    foot = len(said) * line_height(figure, 8.5) + (0.02 if said else 0.0)
    cell, wide = (1 - foot) / rows, 0.3 * figure.get_figwidth()
    painting: list[Painting] = []
    for k in range(count):
        parts = solids(model, shapes[:, :, k])
        camera = camera or camera_for(parts, elev, azim)
        left, bottom = 0.015 + 0.308 * (k % 3), 1 - (k // 3 + 1) * cell
        scale = magnify * mode_scale(parts)
        top = bottom + 0.96 * cell
        style = {"ha": "center", "va": "top", "parse_math": False}
        title = "\n".join(wrapped(titles[k], wide, 12, 1, "bold"))
        figure.text(left + 0.15, top, title, size=12, weight="bold", color=INK, **style)
        top -= 0.065 / rows
        for lines, colour in (
            (wrapped(subtitles[k], wide, 8.5, 3), "0.35"),
            (wrapped(flags[k], wide, 8.5, 1) if flags else [], WARNING),
        ):
            figure.text(left + 0.15, top, "\n".join(lines), size=8.5, color=colour, **style)
            top -= len(lines) * line_height(figure, 8.5)
        height = min(0.77 * cell, top - 0.01 - bottom - 0.05 * cell)
        view = mode_view(figure, parts, camera, scale, (left + 0.01, bottom + 0.05 * cell, 0.28, height))
        painting.append(mode_painting(parts, view, scale))
    if said:
        style = {"va": "bottom", "size": 8.5, "color": WARNING, "linespacing": 1.35, "parse_math": False}
        figure.text(0.025, 0.012, "\n".join(said), **style)
    if camera is not None:
        paint(figure, Painting.joined(painting))
        triad(figure, camera, (0.942, 0.02, 0.052, 0.052 * figure.bbox.width / figure.bbox.height))
    colour_bar(figure, (0.952, 0.28, 0.009, 0.46))
    return figure
