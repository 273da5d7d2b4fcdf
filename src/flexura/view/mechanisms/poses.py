"""A mechanism at poses of its stroke: where everything is, to scale, with stress as colour."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from flexura.analysis import Stroke, StrokePose
from flexura.arguments import verb
from flexura.errors import OptionError, foremost
from flexura.mechanism import FORCE_UNITS, is_rotation
from flexura.tables import number, quantity
from flexura.view.drawing import (
    DPI,
    HIDDEN,
    INK,
    WARNING,
    Box,
    Camera,
    Painting,
    View,
    camera_for,
    colour_scale,
    line_height,
    new_figure,
    over_ghost,
    paint,
    remark_lines,
    rest_colours,
    stress_colours,
    triad,
    visible_flexures,
)
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
        painting.append(over_ghost(panel.parts, view, 1.0, *pose_colours(panel.parts, largest), clear))
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


def pose_colours(parts: Solids, largest: float) -> tuple[Array, Array]:
    """Colours of faces (f, 4, 3) and lines (l, 3): by stress where it is known, of which the largest is given."""
    faces, lines = rest_colours(parts)
    colours = stress_colours(np.nan_to_num(parts.values) / (largest or 1.0))
    faces = np.where(np.isnan(parts.values[parts.faces][..., None]), faces, colours[parts.faces])
    unknown = np.isnan(parts.values[parts.lines].sum(axis=1, keepdims=True))
    return faces, np.where(unknown, lines, colours[parts.lines].mean(axis=1))


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


def stress_bar(figure: Figure, largest: float, area: Box) -> None:
    """The scale of stress, MPa."""
    top = largest / 1e6
    ticks = [tick for tick in MaxNLocator(5).tick_values(0.0, top) if 0 <= tick <= top]
    colour_scale(
        figure,
        area,
        stress_colours(np.linspace(0, 1, 256)),
        [tick / top for tick in ticks],
        [f"{tick:g}" for tick in ticks],
        "largest stress\nin section, MPa",
    )
