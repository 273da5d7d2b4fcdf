"""Pictures of mechanisms and their modes, at rest, deformed and in motion, and of what a check warns about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from flexura.analysis import CheckReport
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.structure import Bars, Bodies, FullOrderModel, solids_of
from flexura.tables import counted, quantity
from flexura.view.drawing import (
    COLOURS,
    DPI,
    GREY,
    HIDDEN,
    INK,
    LABEL_AREA,
    WARNING,
    Label,
    Painting,
    View,
    add_dots,
    camera_for,
    colour_bar,
    frame,
    ghost,
    heading,
    legend,
    line_height,
    mode_colours,
    mode_scale,
    mode_view,
    new_figure,
    paint,
    painting_of,
    part_labels,
    remark_lines,
    render,
    rest_colours,
    scale_of,
    triad,
    view_of,
    visible_flexures,
    wrapped,
    write,
    write_labels,
)
from flexura.view.scene import Array, Kind, Look, solids

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
    clear_bodies = visible_flexures(parts, camera) < HIDDEN
    axes, depth = paint(figure, painting_of(parts, view, rest_colours(parts), clear_bodies=clear_bodies))
    add_dots(axes, parts, view, depth)
    write_labels(axes, view, labels)
    subtitle = "; ".join(filter(None, [left_out, *parts.notes]))
    heading(figure, title if title is not None else model.plan.mechanism.name, subtitle)
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
    subtitle = "; ".join(filter(None, [subtitle, left_out, *parts.notes]))
    top = min(heading(figure, title, subtitle, warnings) - 0.01, 0.84)
    area = (LABEL_AREA[0], 0.05, LABEL_AREA[2], top - 0.05) if labels else (0.035, 0.05, 0.82, top - 0.05)
    view = mode_view(figure, parts, camera, factor, area)
    axes, _ = paint(figure, painting_of(parts, view, mode_colours(parts), factor, over_ghost=True))
    write_labels(axes, view, labels)
    triad(figure, camera)
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
    warning_lines = remark_lines(warnings, "warning", 0.9 * figure.get_figwidth(), 8.5)
    foot = len(warning_lines) * line_height(figure, 8.5) + (0.02 if warning_lines else 0.0)
    cell, width = (1 - foot) / rows, 0.3 * figure.get_figwidth()
    camera, paintings = None, []
    for k in range(count):
        parts = solids(model, shapes[:, :, k])
        camera = camera or camera_for(parts, elev, azim)
        left, bottom = 0.015 + 0.308 * (k % 3), 1 - (k // 3 + 1) * cell
        scale = magnify * mode_scale(parts)
        top, style = bottom + 0.96 * cell, {"ha": "center", "va": "top"}
        title = "\n".join(wrapped(titles[k], width, 12, 1, "bold"))
        write(figure, left + 0.15, top, title, size=12, weight="bold", **style)
        top -= 0.065 / rows
        for lines, colour in (
            (wrapped(subtitles[k], width, 8.5, 3), GREY),
            (wrapped(flags[k], width, 8.5, 1) if flags else [], WARNING),
        ):
            write(figure, left + 0.15, top, "\n".join(lines), size=8.5, color=colour, **style)
            top -= len(lines) * line_height(figure, 8.5)
        height = min(0.77 * cell, top - 0.01 - bottom - 0.05 * cell)
        view = mode_view(figure, parts, camera, scale, (left + 0.01, bottom + 0.05 * cell, 0.28, height))
        paintings.append(painting_of(parts, view, mode_colours(parts), scale, over_ghost=True))
    write(figure, 0.025, 0.012, warning_lines, size=8.5, color=WARNING, va="bottom")
    if camera is not None:
        paint(figure, Painting.joined(paintings))
        triad(figure, camera, (0.942, 0.02, 0.052, 0.052 * figure.bbox.width / figure.bbox.height))
    colour_bar(figure, (0.952, 0.28, 0.009, 0.46))
    return figure


MOST_LABELS = 6
"""Warnings that are written into a picture."""

QUESTIONS = {"reference": "reference?", "thick": "thicker than long", "unit": "unit?"}
"""What is written beside a part, by the kind of warning about it."""


@verb
def draw_warnings(
    model: FullOrderModel, report: CheckReport, *, elev: float | None = None, azim: float | None = None
) -> Figure:
    """Draw a mechanism with the parts that a check of it warns about in red, and a few words where they clash.

    Bodies with warnings are see-through. The first six warnings that have a place are labelled; their texts stand
    under the title. elev, azim and errors as in `draw_mechanism`.
    """
    names, labels = _flagged_parts(report, *solids_of(model))
    texts = [
        str(warning) for warning in report.warnings if warning.kind in {*QUESTIONS, "clash", "deep", "touch", "gap"}
    ]
    parts = solids(model, flagged=names)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE)
    count = len(report.warnings)
    subtitle = counted(count, "warning") if count else "no warnings"
    top = heading(figure, report.name, subtitle, texts)
    view = frame(figure, camera, parts.bounds(), (0.07, 0.175, 0.81, min(0.725, top - 0.195)))
    axes, depth = paint(figure, painting_of(parts, view, rest_colours(parts), clear_bodies=bool(labels)))
    add_dots(axes, parts, view, depth)
    _write_beside(axes, view, parts.points, labels)
    legend(figure, parts)
    return figure


def _flagged_parts(report: CheckReport, bars: Bars, bodies: Bodies) -> tuple[set[str], list[Label]]:
    """Names of the parts that warnings are about, and a few words about these at their places."""
    names: set[str] = set()
    labels: list[Label] = []
    for clash in report.clashes:
        names |= clash.parts
        words = {
            "clash": f"overlap {quantity(clash.volume, 'm^3', 3)}",
            "deep": f"inside {quantity(clash.volume, 'm^3', 3)}",
            "touch": "touch",
            "gap": f"gap {quantity(clash.gap, 'm', 3)}",
        }
        labels.append(Label(words[clash.kind], np.array(clash.at)))
    middles = bars.origin + bars.axes[:, 0] * bars.length[:, None] / 2
    places = [*zip(bars.names, bars.labels, middles, strict=True)]
    places += zip(bodies.names, bodies.labels, bodies.origin, strict=True)
    for warning in report.warnings:
        about = [(name, at) for name, label, at in places if warning.is_about(name, label)]
        if about and warning.kind in QUESTIONS:
            names |= {name for name, _ in about}
            labels.append(Label(QUESTIONS[warning.kind], about[0][1]))
    return names, labels[:MOST_LABELS]


def _write_beside(axes: Axes, view: View, points: Array, labels: list[Label]) -> None:
    """Rings where the labels belong, and these beside the mechanism, none over another."""
    if not labels:
        return
    image = view.pixels(points)[:, :2]
    low, high = image.min(axis=0), image.max(axis=0)
    at = view.pixels(np.array([label.at for label in labels]))[:, :2]
    colour = COLOURS[Kind.FLAGGED]
    axes.plot(at[:, 0], at[:, 1], "o", color="none", markeredgecolor=colour, markeredgewidth=1.6, markersize=13)
    style = {"ha": "center", "va": "center", "size": 8.5, "color": INK, "parse_math": False, "zorder": 9}
    style["bbox"] = {"boxstyle": "round,pad=0.3", "facecolor": "white", "edgecolor": colour, "linewidth": 1.0}
    style["arrowprops"] = {"arrowstyle": "-", "color": colour, "linewidth": 1.0, "shrinkB": 7}
    is_left = at[:, 0] < (low[0] + high[0]) / 2
    for side, edge, sign in ((is_left, low[0] - 20, -1), (~is_left, high[0] + 20, 1)):
        y = np.inf
        for k in sorted(np.flatnonzero(side), key=lambda k: -at[k, 1]):
            y = min(at[k, 1] + 40.0, y - 34.0)
            x = float(np.clip(0.35 * edge + 0.65 * at[k, 0] + 60 * sign, 130, axes.get_xlim()[1] - 130))
            axes.annotate(labels[k].text, tuple(at[k]), (x, y), **style)


FRAME_DPI = 100
"""Pixels per inch of the frames, 800 x 600 of them: films of modes then stay below 2 MB."""


FPS = 20
"""Frames a second."""


@dataclass(frozen=True, repr=False)
class Animation:
    """Images (n, height, width, 3), RGB, that follow each other in a loop, and how many a second."""

    images: NDArray[np.uint8]
    fps: float = FPS

    def __repr__(self) -> str:
        n, height, width, _ = self.images.shape
        return f"Animation({n} frames of {width} x {height} pixels, {n / self.fps:.3g} s)"


@verb
def animate_mode(
    model: FullOrderModel,
    displacements: ArrayLike,
    *,
    title: str,
    subtitle: str = "",
    warnings: Sequence[object] = (),
    scale: float | None = None,
    elev: float | None = None,
    azim: float | None = None,
    frames: int = 24,
) -> Animation:
    """One period of a vibration: the picture of `draw_mode`, which swings from one side to the other and back.

    Arguments as in `draw_mode`; `frames` (at least 4) make one period, 20 a second. Raises OptionError as that does.
    """
    if not isinstance(frames, int | np.integer) or not 4 <= frames <= 240:
        raise OptionError(f"an animation of a mode has from 4 to 240 frames, not {frames!r}")
    parts = solids(model, displacements)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE, FRAME_DPI)
    factor = scale_of(parts, scale)
    top = min(heading(figure, title, subtitle, warnings) - 0.01, 0.84)
    area = (0.035, 0.05, 0.82, top - 0.05)
    swing = factor * parts.motions
    view = view_of(figure, camera, np.concatenate([parts.points, parts.points + swing, parts.points - swing]), area)
    triad(figure, camera)
    colour_bar(figure, (0.912, 0.27, 0.017, min(0.45, top - 0.34)))
    paint(figure, ghost(parts, view))
    behind, colours = drawn_pixels(figure), mode_colours(parts)
    phases, at = np.unique(np.cos(2 * np.pi * np.arange(frames) / frames).round(9), return_inverse=True)
    images = [painted_over(behind, painting_of(parts, view, colours, share * factor)) for share in phases]
    return Animation(np.stack(images)[at])


def drawn_pixels(figure: Figure) -> NDArray[np.uint8]:
    """A figure as an image (height, width, 3)."""
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def painted_over(behind: NDArray[np.uint8], painting: Painting) -> NDArray[np.uint8]:
    """An image with a painting over it."""
    height, width, _ = behind.shape
    image, _ = render(painting.enlarged(FRAME_DPI / DPI), width, height)
    image = image[::-1]
    rows, columns = np.nonzero(image[..., 3])
    cover = image[rows, columns, 3:].astype(np.float32) / 255
    blended = cover * image[rows, columns, :3] + (1 - cover) * behind[rows, columns] + 0.5
    pixels = behind.copy()
    pixels[rows, columns] = blended.astype(np.uint8)
    return pixels
