"""Parallel coordinates: every design a line over the axes of its parameters and of what is asked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from flexura.tables import number, scale_for
from flexura.view.drawing.figures import new_chart
from flexura.view.drawing.lettering import wrapped
from flexura.view.drawing.palette import INK
from flexura.view.drawing.scales import colour_axis, limits_of
from flexura.view.scene import Array

MOST_AXES = 12


class Coordinate(NamedTuple):
    """A quantity of all designs: values (n,) in an SI unit."""

    name: str
    unit: str
    values: Array


def draw_parallel(coordinates: Sequence[Coordinate], coloured_by: Coordinate, dpi: float) -> Figure:
    """A figure of at most twelve coordinates of n designs, each from its lowest to its highest value; designs that are
    not finite in one of them pass through its end."""
    shown = coordinates[:MOST_AXES]
    figure = new_chart((max(1.25 * len(shown) + 1.6, 6.5), 4.8), dpi)
    axes = figure.subplots()
    heights = np.array([_part(own.values) for own in shown]).reshape(len(shown), -1)
    x = np.arange(len(shown), dtype=float)
    order = np.argsort(coloured_by.values, kind="stable")
    lines = [np.column_stack([x, heights[:, k]]) for k in order]
    scale = scale_for(coloured_by.values, coloured_by.unit)
    colours = coloured_by.values / scale.size
    limits = limits_of(colours)
    alpha = float(np.clip(60 / max(len(lines), 1), 0.12, 0.9))
    drawn = LineCollection(lines, cmap="viridis", norm=limits, linewidths=1.0, alpha=alpha, gid="designs")
    drawn.set_array(np.nan_to_num(colours[order], posinf=limits.vmax, neginf=limits.vmin))
    axes.add_collection(drawn)
    for at, own in zip(x, shown, strict=True):
        axes.plot([at, at], [0, 1], color=INK, linewidth=0.8)
        own_scale, known = scale_for(own.values, own.unit), own.values[np.isfinite(own.values)]
        style = {"ha": "center", "size": 7, "color": INK, "parse_math": False}
        for height, end, va in ((-0.03, "min", "top"), (1.03, "max", "bottom")):
            if len(known):
                axes.text(at, height, number(float(getattr(known, end)()) / own_scale.size, 4), va=va, **style)
        title = "\n".join(wrapped(own_scale.label(own.name), 1.15, 7, 3))
        axes.text(at, 1.11, title, va="bottom", **style)
    axes.set(xlim=(-0.5, len(shown) - 0.5), ylim=(-0.1, 1.36))
    axes.set_axis_off()
    bar = figure.colorbar(ScalarMappable(limits, "viridis"), ax=axes, fraction=0.03, pad=0.02)
    colour_axis(bar.ax, limits, scale.label(coloured_by.name))
    return figure


def _part(values: Array) -> Array:
    """Values as parts of the way from the lowest to the highest."""
    known = values[np.isfinite(values)]
    if not len(known) or not np.ptp(known) > 0:
        return np.full(len(values), 0.5)
    part = (values - known.min()) / np.ptp(known)
    return np.clip(np.nan_to_num(part, nan=0.5, posinf=1.0, neginf=0.0), 0.0, 1.0)
