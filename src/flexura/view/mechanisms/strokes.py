"""A mechanism over its stroke: at its poses, to scale, with stress as colour; in motion; and as curves."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.analysis import Stroke, StrokePose, stroke_chart
from flexura.arguments import verb
from flexura.errors import OptionError, foremost
from flexura.mechanism import FORCE_UNITS, is_rotation
from flexura.tables import counted, number, quantity
from flexura.view.drawing import (
    DPI,
    GREY,
    HIDDEN,
    INK,
    WARNING,
    Camera,
    Painting,
    View,
    camera_for,
    colours_by_stress,
    draw_panel,
    ghost,
    heading,
    headline,
    legend_above,
    line_height,
    new_figure,
    paint,
    painting_of,
    panel_grid,
    plain_axes,
    remark_lines,
    stress_bar,
    triad,
    value_axis,
    view_of,
    visible_flexures,
    write,
)
from flexura.view.mechanisms.files import Format, encoded, figure_files, make_folder, writable, write_files
from flexura.view.mechanisms.pictures import FRAME_DPI, SIZE, Animation, drawn_pixels, painted_over
from flexura.view.scene import Array, Solids, moved_solids

MOST_POSES = 6
"""Poses in one picture."""

ANIMATED_POSES = 40
"""Poses of a stroke that an animation goes through, to and fro."""

WIDTH = 12.0
"""Width of the picture, inches."""

SIDES = (0.02, 0.905)
"""Where the poses begin and end, of the width."""

LEAST_HEIGHT, MOST_HEIGHT = 1.8, 5.0
"""Height of a pose, inches."""


@verb
def save_stroke(result: Stroke, folder: Path | str, *, animate: Format | None = None, dpi: float = DPI) -> list[Path]:
    """Write `stroke.png`, curves over at least two poses, and `poses.png`, the first, a middle and the last one, into a
    folder, complete or not at all; and with `animate`, `gif`, `webp` or `mp4`, the mechanism in motion, such as
    `stroke.gif`. dpi: dots per inch of the pictures, 300 for print.

    Returns the paths, none where there is no pose. Raises OptionError when the folder cannot be written to, and as
    `save_animation` does.
    """
    form = None if animate is None else writable(animate)
    figures = {"stroke.png": draw_stroke(result, dpi=dpi)} if len(result.poses) > 1 else {}
    figures |= {"poses.png": draw_poses(result, dpi=dpi)} if result.poses else {}
    films = {f"stroke.{form}": encoded(animate_stroke(result), form)} if form and len(result.poses) > 1 else {}
    return write_files(figure_files(figures) | films, make_folder(Path(folder)))


class _Scenes(NamedTuple):
    """Poses as scenes, the direction from which all are seen, all points (n, 3), m, undeformed and moved, the largest
    stress, Pa, and whether bodies are see-through."""

    parts: list[Solids]
    camera: Camera
    outline: Array
    largest: float
    clear_bodies: bool


def _scenes(result: Stroke, numbers: Sequence[int], elev: float | None, azim: float | None) -> _Scenes:
    scenes = [moved_solids(result.model, result.frames[k], result.stress_profiles(k)) for k in numbers]
    camera = camera_for(scenes[0], elev, azim)
    outline = np.concatenate([points for parts in scenes for points in (parts.points, parts.points + parts.motions)])
    largest = max(float(np.nanmax(parts.values, initial=0.0)) for parts in scenes)
    return _Scenes(scenes, camera, outline, largest, visible_flexures(scenes[0], camera) < HIDDEN)


def _checked_numbers(result: Stroke, poses: Sequence[int], most: int) -> list[int]:
    """Numbers of poses. Raises OptionError for those that there are not, and for more than `most`."""
    count = len(result.poses)
    if not count:
        raise OptionError("there is no pose to be drawn")
    numbers = list(poses)
    if not 1 <= len(numbers) <= most or not all(isinstance(k, int) and 0 <= k < count for k in numbers):
        raise OptionError(f"1 to {most} poses are drawn, by their numbers from 0 to {count - 1}, not {poses!r}")
    return numbers


@verb
def draw_poses(
    result: Stroke,
    poses: Sequence[int] | None = None,
    *,
    elev: float | None = None,
    azim: float | None = None,
    dpi: float = DPI,
) -> Figure:
    """Draw the mechanism at some poses of its stroke, by their numbers, each over a ghost of the mechanism at rest.

    poses: up to 6; by default the first, the one in the middle and the last. Everything is where it is, and not
    exaggerated: members are bent, bodies turned. Colour is the largest von Mises stress in the section, notch factors
    included; links and flexures whose stress is not known, and all else, have the colours of their kind. elev,
    azim, dpi as in `draw_mechanism`. Returns a Figure. Raises OptionError for poses that are not there.
    """
    count = len(result.poses)
    chosen = sorted({0, (count - 1) // 2, count - 1}) if poses is None else poses
    numbers = _checked_numbers(result, chosen, MOST_POSES)
    scenes = _scenes(result, numbers, elev, azim)
    figure, areas = _laid_out(result, [result.poses[k] for k in numbers], scenes, dpi)
    views = [View.fitting(scenes.camera, scenes.outline, area[:2], area[:2] + area[2:]) for area in areas]
    clear_bodies, paintings = scenes.clear_bodies, []
    for parts, view in zip(scenes.parts, views, strict=True):
        colours = colours_by_stress(parts, scenes.largest)
        paintings.append(painting_of(parts, view, colours, 1.0, over_ghost=True, clear_bodies=clear_bodies))
    axes, _ = paint(figure, Painting.joined(paintings))
    _draw_scale_bar(axes, views[0], areas[0])
    triad(figure, scenes.camera, (0.925, 0.02, 0.06, 0.06 * WIDTH / figure.get_figheight()))
    stress_bar(figure, scenes.largest, (0.925, 0.36, 0.010, 0.40))
    return figure


def _laid_out(result: Stroke, poses: list[StrokePose], scenes: _Scenes, dpi: float) -> tuple[Figure, list[Array]]:
    """A figure with headings, and for each pose, three in a row, left, bottom, width and height of its area, pixels."""
    count = len(poses)
    columns = count if count <= 3 else -(-count // 2)
    extent = np.ptp(scenes.outline @ scenes.camera.axes[:2].T, axis=0)
    width = (SIDES[1] - SIDES[0]) * WIDTH / columns
    height = float(np.clip(0.92 * width * extent[1] / max(extent[0], 1e-300), LEAST_HEIGHT, MOST_HEIGHT))
    rows, row = -(-count // columns), height + 0.9
    warnings = remark_lines(foremost(result.warnings, 1), "warning", 0.85 * WIDTH, 8.5)
    foot = 0.45 + len(warnings) * 1.35 * 8.5 / 72
    total = 0.85 + rows * row + foot
    figure = new_figure((WIDTH, total), dpi)
    write(figure, 0.03, 1 - 0.16 / total, result.name, size=14, weight="bold", va="top")
    subtitle = "; ".join(["over its stroke, to scale", "light grey: undeformed", *result.notes[:1]])
    write(figure, 0.03, 1 - 0.45 / total, subtitle, size=9.5, color=GREY, va="top")
    write(figure, 0.03, 0.08 / total, warnings, size=8.5, color=WARNING, va="bottom")
    areas = []
    for k, pose in enumerate(poses):
        left, bottom = SIDES[0] * WIDTH + (k % columns) * width, foot + (rows - 1 - k // columns) * row
        areas.append(DPI * np.array([left + 0.04 * width, bottom, 0.92 * width, height]))
        middle, top = (left + width / 2) / WIDTH, (bottom + row) / total
        title, centred = _pose_title(result, pose), {"ha": "center", "va": "top"}
        size = 12 if len(title) < 34 else 9.5
        write(figure, middle, top, title, size=size, weight="bold", **centred)
        below = top - 2.1 * line_height(figure, 9.5)
        write(figure, middle, below, _pose_text(pose).splitlines(), size=9, color=GREY, **centred)
    return figure, areas


def _pose_title(result: Stroke, pose: StrokePose) -> str:
    """What is prescribed at a pose, equal values of one unit together, in at most two lines."""
    names: dict[str, list[str]] = {}
    for name, value in pose.varied.items():
        names.setdefault(quantity(value, result.units[name], 4), []).append(name)
    texts = [
        f"{', '.join(equal) if len(equal) < 3 else f'{equal[0]} and {len(equal) - 1} more'} = {value}"
        for value, equal in names.items()
    ]
    whole = ", ".join(text.replace(" ", "\N{NO-BREAK SPACE}") for text in texts)
    return "\n".join(textwrap.wrap(whole, 42, max_lines=2, placeholder=" ..."))


def _pose_text(pose: StrokePose) -> str:
    """What holds a pose, and how far it is from yield."""
    texts = [quantity(force, FORCE_UNITS[is_rotation(name)], 4) for name, force in pose.reaction.items()]
    texts += [f"f1 {quantity(hertz, 'Hz')}" for hertz in pose.frequency_hz[:1]]
    margin = np.inf if pose.stress_margin is None else pose.stress_margin
    return ", ".join(texts) + (f"\nyields at {number(margin, 4)} times this stress" if np.isfinite(margin) else "")


def _draw_scale_bar(axes: Axes, view: View, area: Array) -> None:
    """A bar of round length in the plane of the picture, below an area in pixels."""
    left, bottom, width, _ = area
    most = 0.22 * width / view.scale
    decade = 10.0 ** np.floor(np.log10(most))
    length = max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= most)
    x = left + np.array([0.0, length * view.scale])
    y = bottom - 0.22 * DPI
    axes.plot(x, [y, y], color=INK, lw=1.6, solid_capstyle="butt")
    label = f"{1e3 * length:g} mm" if length >= 1e-4 else f"{1e6 * length:g} \N{MICRO SIGN}m"
    axes.text(float(x.mean()), y + 6, label, size=8, ha="center", va="bottom", color=INK)


@verb
def animate_stroke(
    result: Stroke, poses: Sequence[int] | None = None, *, elev: float | None = None, azim: float | None = None
) -> Animation:
    """A mechanism that goes through poses of its stroke and back, to scale, coloured by stress as in `draw_poses`.

    poses: numbers in the order in which they are gone through, by default all, or 40 of them, evenly chosen. Raises
    OptionError for fewer than two poses, and for numbers that there are not.
    """
    count = len(result.poses)
    if count < 2:
        raise OptionError("a stroke is animated over at least two poses")
    evenly = np.unique(np.linspace(0, count - 1, min(count, ANIMATED_POSES)).round().astype(int)).tolist()
    numbers = evenly if poses is None else _checked_numbers(result, poses, ANIMATED_POSES)
    scenes = _scenes(result, numbers, elev, azim)
    figure = new_figure(SIZE, FRAME_DPI)
    top = min(heading(figure, result.name, "over its stroke, to scale; light grey: undeformed"), 0.84)
    view = view_of(figure, scenes.camera, scenes.outline, (0.035, 0.11, 0.82, top - 0.12))
    triad(figure, scenes.camera)
    stress_bar(figure, scenes.largest, (0.895, 0.27, 0.017, 0.45))
    style = {"va": "bottom", "size": 11, "weight": "bold", "color": INK, "parse_math": False}
    title = figure.text(0.035, 0.035, "", **style)
    paint(figure, ghost(scenes.parts[0], view))
    images = []
    for k, parts in zip(numbers, scenes.parts, strict=True):
        title.set_text(_pose_title(result, result.poses[k]))
        colours = colours_by_stress(parts, scenes.largest)
        painting = painting_of(parts, view, colours, 1.0, clear_bodies=scenes.clear_bodies)
        images.append(painted_over(drawn_pixels(figure), painting))
    return Animation(np.stack([*images, *images[-2:0:-1]]))


@verb
def draw_stroke(result: Stroke, *, dpi: float = DPI) -> Figure:
    """Natural frequencies tracked by shape and how they change, forces of the drives, support stiffness, how far driven
    nodes shift where they are not driven, and the factor to yield, all over the first drive; a report has the same.

    Full lines: actuators free under the forces that hold the pose; dashed ones: actuators locked. Axes are
    logarithmic where values are far apart. Raises OptionError for a stroke of fewer than two poses.
    """
    if len(result.poses) < 2:
        raise OptionError("a stroke is drawn over at least two poses")
    panels = [panel.suited() for panel in stroke_chart(result).panels]
    columns = next((k for k in (2, 3) if len(panels) <= 2 * k), 4)
    rows = -(-len(panels) // columns)
    figure, every_axes = panel_grid(len(panels), (rows, columns), (4.2 * columns, 4.0 * rows), dpi)
    named = set[str]()
    for axes, panel in zip(every_axes, panels, strict=True):
        plain_axes(axes)
        draw_panel(axes, panel, width=1.4)
        if panel.y.log:
            value_axis(axes, np.concatenate([curve.y for curve in panel.curves]))
        x = panel.curves[0].x
        axes.set_xlim(x.min(), x.max())
        names = {curve.name for curve in panel.curves}
        if names - named:
            legend_above(axes)
        named |= names
    title = f"{result.name}: over its stroke, {counted(len(result.poses), 'pose')}"
    headline(figure, title, foremost(result.warnings, 1), result.notes)
    return figure
