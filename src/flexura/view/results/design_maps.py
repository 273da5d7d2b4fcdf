"""Maps of a quantity over two parameters: level lines over a grid, dots over samples, hatched without values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator
from matplotlib.transforms import Bbox

from flexura.tables import Scale, scale_for
from flexura.view.drawing import INK, colour_axis, limits_of, named, plain, ticks_within
from flexura.view.results.designs_shown import DesignsShown
from flexura.view.scene import Array

LEVELS = 8


class Hatched(TypedDict):
    """Options of a Matplotlib patch that is hatched."""

    facecolor: str
    edgecolor: str
    hatch: str
    linewidth: float


CONSTANT = 1e-9
"""Spread, relative to the value, of a quantity that does not change."""

HATCHED: Hatched = {"facecolor": "#eceef1", "edgecolor": "#a9b0b9", "hatch": "////", "linewidth": 0.0}
"""How an area without values looks."""

DOUBTED, FAILED = "#8a5a00", "#c2182b"


def draw_map(axes: Axes, shown: DesignsShown, heading: str) -> None:
    """Draw a quantity over the two parameters that vary, with the designs where it is highest and lowest."""
    (name_x, x), (name_y, y) = shown.varied.items()
    across, up = scale_for(x, named(name_x)[1]), scale_for(y, named(name_y)[1])
    x, y, values = x / across.size, y / up.size, shown.asked[heading]
    scale = scale_for(values, named(heading)[1])
    values = values / scale.size
    if shown.is_grid:
        _levels(axes, x, y, values)
    else:
        _dots(axes, x, y, values, scale.label(named(heading)[0]))
    if heading in shown.lower:
        doubted = shown.is_doubted(heading)
        axes.plot(x[doubted], y[doubted], "o", mfc="none", mec=DOUBTED, ms=5, gid="not proven")
    axes.set_title(_title(axes, named(heading)[0], scale, x, y, values), fontsize=8.5, color=INK, parse_math=False)
    axes.set_xlabel(across.label(named(name_x)[0]), fontsize=8, parse_math=False)
    axes.set_ylabel(up.label(named(name_y)[0]), fontsize=8, parse_math=False)
    axes.tick_params(labelsize=8, colors=INK)
    axes.set_xscale("log" if name_x in shown.logarithmic else "linear")
    axes.set_yscale("log" if name_y in shown.logarithmic else "linear")
    for name, own, axis in ((name_x, x, axes.xaxis), (name_y, y, axes.yaxis)):
        low, high = float(own.min()), float(own.max())
        axis.set_view_interval(low, high, ignore=True)
        ticks_within(axis, low, high, logarithmic=name in shown.logarithmic)


def _title(axes: Axes, name: str, scale: Scale, x: Array, y: Array, values: Array) -> str:
    """The name of a quantity and its extremes, which are marked."""
    finite = np.where(np.isfinite(values), values, np.nan)
    if np.isnan(finite).all():
        return f"{scale.label(name)}: no design has a value"
    for k, marker, gid in ((np.nanargmin(finite), "v", "lowest"), (np.nanargmax(finite), "^", "highest")):
        axes.plot(x[k], y[k], marker, color="white", mec=INK, ms=7, zorder=5, clip_on=False, gid=gid)
    low, high = (scale.text(scale.size * float(own)) for own in (np.nanmin(finite), np.nanmax(finite)))
    return f"{name}\n▼ {low}   ▲ {high}"


def _levels(axes: Axes, x: Array, y: Array, values: Array) -> None:
    """Level lines over a grid, and crosses where there is no value, as long as they can be told apart."""
    own_x, column = np.unique(x, return_inverse=True)
    own_y, row = np.unique(y, return_inverse=True)
    grid = np.full((len(own_y), len(own_x)), np.nan)
    grid[row, column] = values
    draw_levels(axes, own_x, own_y, grid)
    j, i = np.nonzero(~np.isfinite(grid))
    if len(own_x) * len(own_y) <= 400 and len(i):
        axes.plot(own_x[i], own_y[j], "x", color=FAILED, ms=4, clip_on=False, gid="failed")


def draw_levels(axes: Axes, x: Array, y: Array, grid: Array) -> None:
    """Labelled level lines of values (y, x) over a grid, and hatched cells where a corner has no value."""
    known = np.isfinite(grid)
    lost = ~(known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:])
    if lost.any():
        j, i = np.nonzero(lost)
        left, right, lower, upper = x[i], x[i + 1], y[j], y[j + 1]
        corners = np.stack([[left, left, right, right], [lower, upper, upper, lower]], axis=-1).transpose(1, 0, 2)
        axes.add_collection(PolyCollection(list(corners), gid="no value", **HATCHED))
    if lost.all():
        return
    masked = np.ma.masked_invalid(grid)
    low, high = float(masked.min()), float(masked.max())
    if high - low > CONSTANT * max(abs(low), abs(high)):
        limits = limits_of(grid)
        wide = isinstance(limits, LogNorm)
        levels = (LogLocator(subs=(1.0, 2.0, 5.0)) if wide else MaxNLocator(LEVELS)).tick_values(low, high)
        style: dict[str, Any] = {"levels": levels, "corner_mask": False}
        axes.contourf(x, y, masked, cmap=_LIGHT, norm=limits, extend="both", **style)
        lines = axes.contour(x, y, masked, colors=[INK], linewidths=0.7, **style)
        for text in axes.clabel(lines, fontsize=7, fmt=plain):
            text.set_parse_math(False)


def _dots(axes: Axes, x: Array, y: Array, values: Array, label: str) -> None:
    """Samples in the colour of their value, crosses where there is none."""
    known = np.isfinite(values)
    limits = limits_of(values)
    style = {"cmap": "viridis", "norm": limits, "s": 16, "linewidths": 0, "clip_on": False, "gid": "designs"}
    dots = axes.scatter(x[known], y[known], c=values[known], **style)
    axes.plot(x[~known], y[~known], "x", color=FAILED, ms=4, clip_on=False, gid="failed")
    if known.any():
        colour_axis(axes.figure.colorbar(dots, ax=axes, fraction=0.045, pad=0.02).ax, limits, label)


def legible(figure: Figure, maps: Sequence[Axes]) -> Figure:
    """A figure without those labels of lines in its maps that stand over one another or beyond the map."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in maps:
        kept: list[Bbox] = []
        for text in [*axes.texts]:
            box = text.get_window_extent()
            inside = axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1 and axes.bbox.y0 <= box.y0
            if inside and box.y1 <= axes.bbox.y1 and not any(box.overlaps(own) for own in kept):
                kept.append(box)
            else:
                text.remove()
    return figure


_LIGHT = colormaps["GnBu"]
