"""A mechanism over its stroke as curves: what holds it, its natural frequencies, its support stiffness."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.analysis import Stroke
from flexura.arguments import verb
from flexura.errors import OptionError, foremost
from flexura.tables import counted
from flexura.view.animation import Format, animate_stroke, encoded, writable
from flexura.view.annotations import foot
from flexura.view.charts import COLOURS, headline, legend_above, plain_axes, style, value_axis
from flexura.view.figures import DPI, new_chart
from flexura.view.files import figure_files, make_folder, write_files
from flexura.view.palette import INK
from flexura.view.poses import draw_poses

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
    """Forces of the drives, natural frequencies tracked by shape, and support stiffness, all over the first drive.

    Full lines: actuators free under the forces that hold the pose; dashed ones: actuators locked. Stiffness has a
    logarithmic axis, translations and rotations one each. Raises OptionError for a stroke of fewer than two poses.
    """
    if len(result.poses) < 2:
        raise OptionError("a stroke is drawn over at least two poses")
    first = next(iter(result.poses[0].varied))
    unit, factor = SHOWN.get(result.units[first], (result.units[first], 1.0))
    x = factor * np.array([pose.varied[first] for pose in result.poses])
    figure = new_chart((9.0, 8.0), dpi)
    panels = figure.subplots(2, 2)
    for axes in panels.ravel():
        plain_axes(axes)
    _forces(panels[0, 0], result, x)
    _frequencies(panels[0, 1], result, x)
    _stiffness(panels[1, 0], result, x, slice(0, 3), "support stiffness, N/m")
    _stiffness(panels[1, 1], result, x, slice(3, 6), "support stiffness, N m/rad")
    for axes in panels.ravel():
        axes.set_xlabel(f"{first}, {unit}", fontsize=8)
        axes.set_xlim(x.min(), x.max())
        style(axes)
    headline(figure, f"{result.name}: over its stroke, {counted(len(result.poses), 'pose')}")
    foot(figure, foremost(result.warnings, 1), result.notes)
    return figure


SHOWN = {"m": ("mm", 1e3), "rad": ("degrees", 180 / np.pi)}


def _turns(name: str) -> bool:
    return name.rpartition(".")[2].startswith("r")


def _forces(axes: Axes, result: Stroke, x: np.ndarray) -> None:
    first = result.poses[0]
    if first.move:
        units = {name: "N m" if _turns(name) else "N" for name in first.move}
        curves = {f"{name}, {unit}": [p.reaction[name] for p in result.poses] for name, unit in units.items()}
    else:
        curves = {
            node: [1e3 * np.linalg.norm(p.displacement[node][:3]) for p in result.poses] for node in first.displacement
        }
    for k, (label, curve) in enumerate(curves.items()):
        axes.plot(x, curve, color=COLOURS[k % len(COLOURS)], lw=1.4, label=label)
    axes.set_ylabel("force or moment of the drive" if first.move else "displacement, mm", fontsize=8)
    legend_above(axes)


def _frequencies(axes: Axes, result: Stroke, x: np.ndarray) -> None:
    """Curves by mode, actuators free, and the first ones with actuators locked."""
    tracked = result.frequencies_hz
    for k in range(tracked.shape[1]):
        positive = np.where(tracked[:, k] > 0, tracked[:, k], np.nan)
        gap = np.isnan(np.concatenate([[np.nan], positive, [np.nan]]))
        alone = np.flatnonzero(gap[:-2] & gap[2:])
        colour, dots = COLOURS[k % len(COLOURS)], {"marker": "o", "markersize": 3, "markevery": list(alone)}
        axes.plot(x, positive, color=colour, lw=1.4, label=f"mode {k + 1}", **(dots if len(alone) else {}))
    least = min(len(pose.frequency_hz_held) for pose in result.poses)
    for k in range(min(least, 2)):
        held = np.array([pose.frequency_hz_held[k] for pose in result.poses])
        axes.plot(x, np.where(held > 0, held, np.nan), color=INK, lw=0.9, ls="--", label="held" if k == 0 else None)
    value_axis(axes, _drawn(axes))
    axes.set_ylabel("natural frequency, Hz", fontsize=8)
    legend_above(axes)


def _stiffness(axes: Axes, result: Stroke, x: np.ndarray, own: slice, label: str) -> None:
    stiffness = np.array([pose.support_stiffness[own] for pose in result.poses], dtype=float)
    for k, name in enumerate(DOFS[own]):
        if np.isfinite(stiffness[:, k]).any():
            axes.plot(x, stiffness[:, k], color=COLOURS[k], lw=1.4, label=name)
    value_axis(axes, _drawn(axes))
    axes.set_ylabel(label, fontsize=8)
    legend_above(axes)


def _drawn(axes: Axes) -> np.ndarray:
    """Values of all curves."""
    return np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.lines] or [np.empty(0)])
