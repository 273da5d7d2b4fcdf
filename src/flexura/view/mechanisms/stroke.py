"""A mechanism over its stroke as curves: what holds it, its natural frequencies, its support stiffness."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.analysis import Stroke
from flexura.arguments import verb
from flexura.errors import OptionError, foremost
from flexura.mechanism import FORCE_UNITS, is_rotation
from flexura.tables import counted, scale_for, suited
from flexura.view.drawing import (
    DPI,
    INK,
    SERIES,
    WIDE,
    foot,
    headline,
    legend_above,
    new_chart,
    plain_axes,
    style,
    value_axis,
)
from flexura.view.mechanisms.animation import Format, animate_stroke, encoded, writable
from flexura.view.mechanisms.files import figure_files, make_folder, write_files
from flexura.view.mechanisms.poses import draw_poses

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
