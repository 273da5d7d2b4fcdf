"""A mechanism over its stroke: at its poses, to scale, with stress as colour; in motion; and as curves."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.analysis import Stroke, StrokePose
from flexura.arguments import verb
from flexura.errors import OptionError, foremost
from flexura.mechanism import FORCE_UNITS, is_rotation
from flexura.tables import counted, number, quantity, scale_for, suited
from flexura.view.drawing import (
    DPI,
    HIDDEN,
    INK,
    SERIES,
    WARNING,
    WIDE,
    Camera,
    Painting,
    View,
    camera_for,
    colours_by_stress,
    foot,
    ghost,
    heading,
    headline,
    legend_above,
    line_height,
    moved_painting,
    new_chart,
    new_figure,
    over_ghost,
    paint,
    plain_axes,
    remark_lines,
    stress_bar,
    style,
    triad,
    value_axis,
    view_of,
    visible_flexures,
)
from flexura.view.mechanisms.files import Format, encoded, figure_files, make_folder, writable, write_files
from flexura.view.mechanisms.pictures import FRAME_DPI, SIZE, Animation, drawn_pixels, painted_over
from flexura.view.scene import Array, Solids, moved_solids

MOST_POSES = 6
"""Poses in one picture."""

WIDTH = 12.0
"""Width of the picture, inches."""

SIDES = (0.02, 0.905)
"""Where the poses begin and end, of the width."""

LEAST_HEIGHT, MOST_HEIGHT = 1.8, 5.0
"""Height of a pose, inches."""


class _Panel(NamedTuple):
    """A pose and where it is drawn: left, bottom, width and height, inches."""

    pose: StrokePose
    parts: Solids
    area: tuple[float, float, float, float]


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
    numbers = numbered(result, sorted({0, (count - 1) // 2, count - 1}) if poses is None else poses, MOST_POSES)
    scenes = [moved_solids(result.model, result.frames[k], result.stress_profiles(k)) for k in numbers]
    camera = camera_for(scenes[0], elev, azim)
    outline = np.concatenate([own for parts in scenes for own in (parts.points, parts.points + parts.motions)])
    figure, panels = _laid_out(result, [result.poses[k] for k in numbers], scenes, camera, outline, dpi)
    largest = max(float(np.nanmax(parts.values, initial=0.0)) for parts in scenes)
    clear = visible_flexures(scenes[0], camera) < HIDDEN
    painting: list[Painting] = []
    views = [_view(panel, camera, outline) for panel in panels]
    for panel, view in zip(panels, views, strict=True):
        painting.append(over_ghost(panel.parts, view, 1.0, *colours_by_stress(panel.parts, largest), clear))
    axes, _ = paint(figure, Painting.joined(painting))
    _scale_bar(axes, views[0], panels[0])
    height = figure.get_figheight()
    triad(figure, camera, (0.925, 0.02, 0.06, 0.06 * WIDTH / height))
    if largest > 0:
        stress_bar(figure, largest, (0.925, 0.36, 0.010, 0.40))
    return figure


def numbered(result: Stroke, poses: Sequence[int], most: int) -> list[int]:
    """Numbers of poses. Raises OptionError for those that there are not, and for more than `most`."""
    count = len(result.poses)
    if not count:
        raise OptionError("there is no pose to be drawn")
    numbers = list(poses)
    if not 1 <= len(numbers) <= most or not all(isinstance(k, int) and 0 <= k < count for k in numbers):
        raise OptionError(f"1 to {most} poses are drawn, by their numbers from 0 to {count - 1}, not {poses!r}")
    return numbers


def _laid_out(
    result: Stroke, poses: list[StrokePose], scenes: list[Solids], camera: Camera, outline: Array, dpi: float
) -> tuple[Figure, list[_Panel]]:
    """A figure with headings, and a panel for each pose, three in a row."""
    count = len(poses)
    columns = count if count <= 3 else -(-count // 2)
    extent = np.ptp(outline @ camera.axes[:2].T, axis=0)
    width = (SIDES[1] - SIDES[0]) * WIDTH / columns
    height = float(np.clip(0.92 * width * extent[1] / max(extent[0], 1e-300), LEAST_HEIGHT, MOST_HEIGHT))
    rows, row = -(-count // columns), height + 0.9
    said = remark_lines(foremost(result.warnings, 1), "warning", 0.85 * WIDTH, 8.5)
    foot = 0.45 + len(said) * 1.35 * 8.5 / 72
    total = 0.85 + rows * row + foot
    figure = new_figure((WIDTH, total), dpi)
    style = {"va": "top", "parse_math": False}
    figure.text(0.03, 1 - 0.16 / total, result.name, size=14, weight="bold", color=INK, **style)
    above = "; ".join(["over its stroke, to scale", "light grey: undeformed", *result.notes[:1]])
    figure.text(0.03, 1 - 0.45 / total, above, size=9.5, color="0.35", **style)
    if said:
        style = {"va": "bottom", "size": 8.5, "color": WARNING, "linespacing": 1.35, "parse_math": False}
        figure.text(0.03, 0.08 / total, "\n".join(said), **style)
    panels = []
    for k, (pose, parts) in enumerate(zip(poses, scenes, strict=True)):
        left = SIDES[0] * WIDTH + (k % columns) * width
        bottom = foot + (rows - 1 - k // columns) * row
        panels.append(_Panel(pose, parts, (left + 0.04 * width, bottom, 0.92 * width, height)))
        middle, upper = (left + width / 2) / WIDTH, (bottom + row) / total
        style = {"ha": "center", "va": "top", "parse_math": False}
        title = pose_title(result, pose)
        figure.text(middle, upper, title, size=12 if len(title) < 34 else 9.5, weight="bold", color=INK, **style)
        figure.text(
            middle, upper - 2.1 * line_height(figure, 9.5), _told(pose), size=9, color="0.35", linespacing=1.35, **style
        )
    return figure, panels


def pose_title(result: Stroke, pose: StrokePose) -> str:
    """What is prescribed at a pose, equal values of one unit together, in at most two lines."""
    names: dict[str, list[str]] = {}
    for name, value in pose.varied.items():
        names.setdefault(quantity(value, result.units[name], 4), []).append(name)
    told = [
        f"{', '.join(own) if len(own) < 3 else f'{own[0]} and {len(own) - 1} more'} = {value}"
        for value, own in names.items()
    ]
    whole = ", ".join(text.replace(" ", "\N{NO-BREAK SPACE}") for text in told)
    return "\n".join(textwrap.wrap(whole, 42, max_lines=2, placeholder=" ..."))


def _told(pose: StrokePose) -> str:
    """What holds a pose, and how far it is from yield."""
    told = [quantity(force, FORCE_UNITS[is_rotation(name)], 4) for name, force in pose.reaction.items()]
    told += [f"f1 {quantity(hertz, 'Hz')}" for hertz in pose.frequency_hz[:1]]
    margin = np.inf if pose.stress_margin is None else pose.stress_margin
    return ", ".join(told) + (f"\nyields at {number(margin, 4)} times this stress" if np.isfinite(margin) else "")


def _view(panel: _Panel, camera: Camera, outline: Array) -> View:
    left, bottom, width, height = (DPI * inches for inches in panel.area)
    return View.fitting(camera, outline, np.array([left, bottom]), np.array([left + width, bottom + height]))


def _scale_bar(axes: Axes, view: View, panel: _Panel) -> None:
    """A bar of round length in the plane of the picture."""
    left, bottom, width, _ = (DPI * inches for inches in panel.area)
    wanted = 0.22 * width / view.scale
    decade = 10.0 ** np.floor(np.log10(wanted))
    length = max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= wanted)
    x = left + np.array([0.0, length * view.scale])
    y = bottom - 0.22 * DPI
    axes.plot(x, [y, y], color=INK, lw=1.6, solid_capstyle="butt")
    label = f"{1e3 * length:g} mm" if length >= 1e-4 else f"{1e6 * length:g} \N{MICRO SIGN}m"
    axes.text(float(x.mean()), y + 6, label, size=8, ha="center", va="bottom", color=INK)


DOFS = ("x", "y", "z", "about x", "about y", "about z")


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


ANIMATED_POSES = 40
"""Poses of a stroke that an animation goes through, to and fro."""


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
    chosen = np.unique(np.linspace(0, count - 1, min(count, ANIMATED_POSES)).round().astype(int)).tolist()
    numbers = chosen if poses is None else numbered(result, poses, ANIMATED_POSES)
    scenes = [moved_solids(result.model, result.frames[k], result.stress_profiles(k)) for k in numbers]
    camera = camera_for(scenes[0], elev, azim)
    outline = np.concatenate([own for parts in scenes for own in (parts.points, parts.points + parts.motions)])
    figure = new_figure(SIZE, FRAME_DPI)
    top = min(heading(figure, result.name, "over its stroke, to scale; light grey: undeformed"), 0.84)
    view = view_of(figure, camera, outline, (0.035, 0.11, 0.82, top - 0.12))
    largest = max(float(np.nanmax(parts.values, initial=0.0)) for parts in scenes)
    clear = visible_flexures(scenes[0], camera) < HIDDEN
    triad(figure, camera, (0.875, 0.03, 0.10, 0.133))
    if largest > 0:
        stress_bar(figure, largest, (0.895, 0.27, 0.017, 0.45))
    style = {"va": "bottom", "size": 11, "weight": "bold", "color": INK, "parse_math": False}
    said = figure.text(0.035, 0.035, "", **style)
    paint(figure, ghost(scenes[0], view))
    images = []
    for k, parts in zip(numbers, scenes, strict=True):
        said.set_text(pose_title(result, result.poses[k]))
        painting = moved_painting(parts, view, 1.0, *colours_by_stress(parts, largest), clear)
        images.append(painted_over(drawn_pixels(figure), painting))
    return Animation(np.stack([*images, *images[-2:0:-1]]))


@verb
def draw_stroke(result: Stroke, *, dpi: float = DPI) -> Figure:
    """Forces of the drives, natural frequencies tracked by shape and how they change, support stiffness, and how far
    driven nodes shift where they are not driven, all over the first drive.

    Full lines: actuators free under the forces that hold the pose; dashed ones: actuators locked. Axes are
    logarithmic where values are far apart. Raises OptionError for a stroke of fewer than two poses.
    """
    if len(result.poses) < 2:
        raise OptionError("a stroke is drawn over at least two poses")
    first = next(iter(result.poses[0].varied))
    along = np.array([pose.varied[first] for pose in result.poses])
    scale = scale_for(along, result.units[first])
    x = along / scale.size
    figure = new_chart((12.6, 8.0), dpi)
    panels = figure.subplots(2, 3)
    for axes in panels.ravel():
        plain_axes(axes)
    _forces(panels[0, 0], result, x)
    _frequencies(panels[0, 1], result, x)
    _changes(panels[0, 2], result, x)
    _stiffness(panels[1, 0], result, x, slice(0, 3), "N/m")
    _stiffness(panels[1, 1], result, x, slice(3, 6), "N*m/rad")
    _shifts(panels[1, 2], result, x)
    for axes in panels.ravel():
        axes.set_xlabel(scale.label(first), fontsize=8, parse_math=False)
        axes.set_xlim(x.min(), x.max())
        style(axes)
    headline(figure, f"{result.name}: over its stroke, {counted(len(result.poses), 'pose')}")
    foot(figure, foremost(result.warnings, 1), result.notes)
    return figure


def _forces(axes: Axes, result: Stroke, x: np.ndarray) -> None:
    first = result.poses[0]
    named = first.move or first.displacement
    for k, name in enumerate(named):
        if first.move:
            unit, values = FORCE_UNITS[is_rotation(name)], np.array([p.reaction[name] for p in result.poses])
        else:
            unit, values = "m", np.array([np.linalg.norm(p.displacement[name][:3]) for p in result.poses])
        scale = scale_for(values, unit)
        axes.plot(x, values / scale.size, color=SERIES[k % len(SERIES)], lw=1.4, label=scale.label(name))
    axes.set_ylabel("force or moment of the drive" if first.move else "displacement", fontsize=8)
    legend_above(axes)


def _frequencies(axes: Axes, result: Stroke, x: np.ndarray) -> None:
    """Curves by mode, actuators free, and the first ones with actuators locked."""
    _modes(axes, result, x, np.where(result.frequencies_hz > 0, result.frequencies_hz, np.nan))
    least = min(len(pose.frequency_hz_held) for pose in result.poses)
    for k in range(min(least, 2)):
        held = np.array([pose.frequency_hz_held[k] for pose in result.poses])
        axes.plot(x, np.where(held > 0, held, np.nan), color=INK, lw=0.9, ls="--", label="held" if k == 0 else None)
    _spread(axes)
    axes.set_ylabel("natural frequency, Hz", fontsize=8)
    legend_above(axes)


def _modes(axes: Axes, result: Stroke, x: np.ndarray, values: np.ndarray) -> None:
    """A curve for each mode: gaps where it is not among the lowest, dots where it is so at a single pose."""
    first = len(result.poses[0].frequency_hz)
    for k in range(values.shape[1]):
        gap = np.isnan(np.concatenate([[np.nan], values[:, k], [np.nan]]))
        alone = np.flatnonzero(gap[:-2] & gap[2:])
        dots = {"marker": "o", "markersize": 3, "markevery": list(alone)} if len(alone) else {}
        label = f"mode {k + 1}" if k < first else "another mode"
        axes.plot(x, values[:, k], color=SERIES[k % len(SERIES)], lw=1.4, label=label, **dots)


def _changes(axes: Axes, result: Stroke, x: np.ndarray) -> None:
    """How much each frequency is off that of the least strained pose."""
    _modes(axes, result, x, 100 * result.frequency_changes)
    axes.set_ylabel("change of natural frequency, %", fontsize=8)


def _shifts(axes: Axes, result: Stroke, x: np.ndarray) -> None:
    """Curves by driven node."""
    shifts = result.parasitic_shifts
    scale = suited([own.tolist() for own in shifts.values()], "m")
    for k, (node, own) in enumerate(shifts.items()):
        axes.plot(x, own / scale.size, color=SERIES[k % len(SERIES)], lw=1.4, label=node)
    axes.set_ylabel(scale.label("parasitic shift, not driven"), fontsize=8)
    axes.set_visible(bool(shifts))
    legend_above(axes)


def _stiffness(axes: Axes, result: Stroke, x: np.ndarray, own: slice, unit: str) -> None:
    stiffness = np.array([pose.support_stiffness[own] for pose in result.poses], dtype=float)
    scale = suited(stiffness.T.tolist(), unit)
    for k, name in enumerate(DOFS[own]):
        if np.isfinite(stiffness[:, k]).any():
            axes.plot(x, stiffness[:, k] / scale.size, color=SERIES[k], lw=1.4, label=name)
    _spread(axes)
    axes.set_ylabel(scale.label("support stiffness"), fontsize=8)
    legend_above(axes)


def _spread(axes: Axes) -> None:
    """A logarithmic axis where the curves are far apart."""
    values = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.lines] or [np.empty(0)])
    known = values[np.isfinite(values) & (values > 0)]
    if len(known) and known.max() > WIDE * known.min():
        value_axis(axes, values)
