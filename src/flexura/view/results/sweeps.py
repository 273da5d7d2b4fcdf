"""Sweeps in pictures: curves over one parameter, maps over two, and parallel coordinates over more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.errors import OptionError, foremost
from flexura.study.engine import StudyTable, jumps_of
from flexura.tables import Scale, counted, scale_for
from flexura.view.drawing import (
    DPI,
    INK,
    SERIES,
    WIDE,
    Coordinate,
    colour_axis,
    draw_parallel,
    foot,
    headline,
    legend_above,
    limits_of,
    named,
    new_chart,
    plain,
    style,
    ticks_within,
    value_axis,
)
from flexura.view.mechanisms import save_figures
from flexura.view.scene import Array

FAILED, DOUBTED = "#c2182b", "#8a5a00"
"""Colours of designs without a value, and of those that are not proven."""

BY_NUMBER = "#9aa3ad"
"""Frequencies by number where others are followed by what moves."""

ELSEWHERE: dict[str, Any] = {"ls": ":", "lw": 1.0, "marker": "o", "mfc": "white", "ms": 4.5}
"""Where a frequency that is followed goes over to another mode."""

MOST_PANELS = 6

FEW = 40
"""Designs up to which each has a dot on its curve."""


@verb
def save_sweep(table: StudyTable, folder: Path | str, *, dpi: float = DPI) -> list[Path]:
    """Write the picture of `draw_sweep` as `sweep.png`. Raises OptionError as that, and when the folder cannot be
    written to."""
    return save_figures({"sweep.png": draw_sweep(table, dpi=dpi)}, folder)


@verb
def draw_sweep(table: StudyTable, *, dpi: float = DPI) -> Figure:
    """Draw what a sweep found: curves over one parameter that varies, a map of each quantity over two, and parallel
    coordinates of more.

    Curves have a panel for each unit, bands between proven bounds, a gap and a cross where a design failed, and rings
    where it is not proven; one that is followed by what moves breaks where it goes over to another mode, dots leading
    to where it goes on; where frequencies are followed by what moves, those by number are grey behind them. Maps
    have level lines over a grid, dots over samples; where a design failed nothing is interpolated and the area is
    hatched. Of parallel coordinates, coloured by the first quantity, failed designs are left out and counted. Of very
    many designs one of so many is drawn, which is said. dpi as in `draw_mechanism`. Returns a Figure. Raises
    OptionError for a study without designs.
    """
    shown = designs_shown(table)
    if not len(shown.is_proven):
        raise OptionError("no design of the study is worked out yet: there is nothing to draw")
    count = len(shown.varied)
    notes = [*shown.notes]
    if count == 1:
        figure = _curves(shown, dpi)
    elif count == 2:
        figure = _maps(shown, dpi)
        if len(shown.asked) > MOST_PANELS:
            notes.append(f"{len(shown.asked) - MOST_PANELS} more quantities are not drawn")
    else:
        figure, said = _lines(shown, dpi)
        notes += said
    over = ", ".join(named(name)[0] for name in shown.varied)
    headline(figure, f"{table.name}: {counted(table.done, 'design')} over {over}")
    foot(figure, foremost(table.warnings, 1), [*notes, *table.notes])
    return legible(figure, figure.axes) if count == 2 else figure


def _curves(shown: DesignsShown, dpi: float) -> Figure:
    """A panel for each unit of what is asked, over the parameter."""
    (name, x), *_ = shown.varied.items()
    order = np.argsort(x, kind="stable")
    across = scale_for(x, named(name)[1])
    units: dict[str, list[str]] = {}
    for heading in shown.asked:
        units.setdefault(named(heading)[1], []).append(heading)
    columns = 1 if len(units) == 1 else 2
    rows = -(-len(units) // columns)
    figure = new_chart((8.0 if columns == 1 else 10.0, 4.8 if rows == 1 else 3.6 * rows), dpi)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (unit, headings) in zip(panels, units.items(), strict=False):
        _panel(axes, shown, headings, unit, x[order] / across.size, order)
        axes.set_xlabel(across.label(named(name)[0]), fontsize=8, parse_math=False)
        low, high = float(x.min()) / across.size, float(x.max()) / across.size
        if low < high:
            axes.set_xlim(low, high)
            axes.set_xscale("log" if name in shown.logarithmic else "linear")
            ticks_within(axes.xaxis, low, high, logarithmic=name in shown.logarithmic)
    for axes in panels[len(units) :]:
        axes.set_visible(False)
    return figure


def _panel(axes: Axes, shown: DesignsShown, headings: list[str], unit: str, x: Array, order: np.ndarray) -> None:
    """Curves of quantities of one unit, with bands, rings and crosses."""
    values = np.array([shown.asked[heading] for heading in headings])
    scale = scale_for(values, unit)
    followed = [heading for heading in headings if heading.startswith("f(")]
    colours = iter(np.resize(np.array(SERIES), len(headings)).tolist())
    first, has_leapt = True, False
    for heading in sorted(headings, key=lambda own: own in followed):
        own = shown.asked[heading][order] / scale.size
        own[~np.isfinite(own)] = np.nan
        if followed and unit == "Hz" and heading not in followed and _is_number(heading):
            label = "by number" if first else None
            axes.plot(x, own, color=BY_NUMBER, lw=3.2, alpha=0.6, label=label, gid=heading, solid_capstyle="butt")
            first = False
            continue
        colour = next(colours)
        leaps = shown.leaps.get(heading, np.zeros(len(x), dtype=bool))[order]
        leaps[-1] = False
        behind = 1 + np.flatnonzero(leaps)
        along, line = (np.insert(values, behind, np.nan) for values in (x, own))
        gap = np.isnan(np.concatenate([[np.nan], line, [np.nan]]))
        alone = np.flatnonzero(gap[:-2] & gap[2:])
        dots = range(len(line)) if len(own) <= FEW else alone
        mark: dict[str, Any] = {"marker": "o", "ms": 2.6, "markevery": [*dots]}
        axes.plot(along, line, color=colour, lw=1.4, label=named(heading)[0], gid=heading, **mark)
        for k in behind:
            axes.plot(x[k - 1 : k + 1], own[k - 1 : k + 1], color=colour, gid=f"other mode {heading}", **ELSEWHERE)
        has_leapt |= bool(len(behind))
        if heading in shown.lower:
            bounds = (bound[heading][order] / scale.size for bound in (shown.lower, shown.upper))
            low, high = (np.insert(bound, behind, np.nan) for bound in bounds)
            axes.fill_between(along, low, high, color=colour, alpha=0.25, lw=0, gid=f"bounds of {heading}")
            doubted = shown.is_doubted(heading)[order]
            axes.plot(x[doubted], own[doubted], "o", mfc="none", mec=DOUBTED, ms=6, gid=f"not proven {heading}")
    if has_leapt:
        axes.plot([], [], color=DOUBTED, label="goes over to another mode", **ELSEWHERE)
    _crosses(axes, x[np.isnan(values[:, order]).any(axis=0)])
    finite = values[np.isfinite(values)] / scale.size
    if not len(finite):
        axes.set_yticks([])
    elif finite.min() > 0 and finite.max() > WIDE * finite.min():
        value_axis(axes, finite)
    else:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high)
        ticks_within(axes.yaxis, low, high)
    axes.set_ylabel(_called(headings, scale), fontsize=8, parse_math=False)
    style(axes)
    legend_above(axes)


def _is_number(heading: str) -> bool:
    return heading[:1] == "f" and heading[1:2].isdigit()


def _crosses(axes: Axes, x: Array) -> None:
    """Crosses on the lower edge where designs failed."""
    if len(x):
        axes.plot(
            x, np.full(len(x), 0.025), "x", color=FAILED, ms=5, transform=axes.get_xaxis_transform(), gid="failed"
        )
        axes.plot([], [], "x", color=FAILED, ms=5, label="failed")


def _called(headings: list[str], scale: Scale) -> str:
    """What an axis of several quantities is called."""
    words = {named(own)[0].split("(")[0].split(" at ")[0] for own in headings}
    if all(_is_number(own) or own.startswith("f(") for own in headings):
        return scale.label("natural frequency")
    return scale.label(words.pop() if len(words) == 1 else "")


def _maps(shown: DesignsShown, dpi: float) -> Figure:
    """A map of each quantity over two parameters."""
    headings = list(shown.asked)[:MOST_PANELS]
    columns = min(len(headings), 3 if len(headings) > 4 else 2)
    rows = -(-len(headings) // columns)
    figure = new_chart((6.6 if columns == 1 else 4.6 * columns, 4.9 if columns == 1 else 3.9 * rows + 0.4), dpi)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, heading in zip(panels, headings, strict=False):
        draw_map(axes, shown, heading)
    for axes in panels[len(headings) :]:
        axes.set_visible(False)
    return figure


def _lines(shown: DesignsShown, dpi: float) -> tuple[Figure, list[str]]:
    """Parallel coordinates of all parameters and what is asked, and what they leave out."""
    there = ~shown.is_failed
    all_columns = [*shown.varied.items(), *shown.asked.items()]
    coordinates = [Coordinate(*named(heading), own[there]) for heading, own in all_columns]
    heading = next(iter(shown.asked))
    figure = draw_parallel(coordinates, Coordinate(*named(heading), shown.asked[heading][there]), dpi)
    failed = int(shown.is_failed.sum())
    return figure, [f"{counted(failed, 'failed design')} left out"] if failed else []


ALONG = 200
"""Values of a variable that a map or a curve has room for."""

PROVEN = 1e-3
"""Width of the interval of a proven value, over its lower end, is no more."""

LINES = 2000
"""Designs that are drawn one by one."""


@dataclass(frozen=True)
class DesignsShown:
    """Designs by heading (n,), SI: `varied` parameters, of more than one value, and what is `asked`; `lower` and
    `upper` proven bounds of some of it. `is_proven` (n,); `leaps` (n,) says of some of it where it goes over to another
    mode between a design and the one with the next larger value of the parameter."""

    varied: Mapping[str, Array]
    asked: Mapping[str, Array]
    lower: Mapping[str, Array]
    upper: Mapping[str, Array]
    is_proven: NDArray[np.bool_]
    leaps: Mapping[str, NDArray[np.bool_]]
    is_grid: bool
    logarithmic: frozenset[str]
    notes: tuple[str, ...]

    @cached_property
    def is_failed(self) -> NDArray[np.bool_]:
        """Designs (n,) of which something asked is missing."""
        return np.any([np.isnan(own) for own in self.asked.values()], axis=0)

    def is_doubted(self, heading: str) -> NDArray[np.bool_]:
        """Designs (n,) that have a value of something that can be proven, without an interval as narrow as that of a
        proven one."""
        value = self.asked[heading]
        with np.errstate(invalid="ignore"):
            narrow = self.upper[heading] - self.lower[heading] <= PROVEN * self.lower[heading]
        return np.isfinite(value) & ~self.is_proven & ~narrow


def designs_shown(table: StudyTable) -> DesignsShown:
    """The designs of a study, every so many where there are more than a picture has room for, which `notes` say.

    Raises OptionError for a shard that is damaged.
    """
    bounds = {own: _bounds(own) for own in table.asked}
    bounds = {own: both for own, both in bounds.items() if set(both) <= set(table.columns)}
    leaps = {own: found for own in table.asked if (found := jumps_of(own)) in table.columns}
    names = ["design", *table.parameters, *table.asked, *(name for both in bounds.values() for name in both)]
    names += leaps.values()
    steps = _steps(table)
    blocks = []
    for block in table.blocks([*names, "is proven"]):
        kept = _kept(block["design"], steps)
        blocks.append({name: own[kept] for name, own in block.items()})
    found = {name: np.concatenate([own[name] for own in blocks] or [np.empty(0)]) for name in (*names, "is proven")}
    several = [name for name in table.parameters if len(found["design"]) and np.ptp(found[name]) > 0]
    step = int(np.prod([step for _, step in steps]))
    return DesignsShown(
        {name: found[name] for name in several or table.parameters[:1]},
        {name: found[name] for name in table.asked},
        {name: found[both[0]] for name, both in bounds.items()},
        {name: found[both[1]] for name, both in bounds.items()},
        found["is proven"].astype(bool),
        {name: found[own].astype(bool) for name, own in leaps.items()},
        table.space.get("sampling") == "grid",
        frozenset(name for name in table.parameters if _variable(table, name).get("scale") == "log"),
        (f"one of {step} designs is drawn",) if step > 1 else (),
    )


def _bounds(heading: str) -> tuple[str, str]:
    name, unit = named(heading)
    tail = f" [{unit}]" if unit else ""
    return f"{name} lower{tail}", f"{name} upper{tail}"


def _variable(table: StudyTable, heading: str) -> Mapping[str, Any]:
    """The description of the variable of a column."""
    name = named(heading)[0].removeprefix("parameter ")
    return next((own for own in table.space.get("variables", ()) if own.get("name") == name), {})


def _steps(table: StudyTable) -> list[tuple[int, int]]:
    """How many values each variable of a grid takes, and of how many one is shown; all designs as one variable where
    they are drawn one by one."""
    variables = [_variable(table, name) for name in table.parameters]
    levels = [_value_count(own) for own in variables]
    several = sum(own > 1 for own in levels)
    if table.space.get("sampling") == "grid" and np.prod(levels, dtype=float) == table.designs and several <= 2:
        most = ALONG if several == 2 else LINES
        return [(own, ceil(own / most)) for own in levels]
    return [(table.designs, ceil(table.designs / LINES))]


def _value_count(variable: Mapping[str, Any]) -> int:
    if "values" in variable:
        return len(variable["values"])
    if variable.get("count") is None:
        return int(variable.get("high", 0) - variable.get("low", 0)) + 1 if variable.get("kind") == "integer" else 0
    return int(variable["count"])


def _kept(numbers: NDArray[np.int64], steps: list[tuple[int, int]]) -> NDArray[np.bool_]:
    kept = np.ones(len(numbers), dtype=bool)
    for levels, step in reversed(steps):
        numbers, place = np.divmod(numbers, max(levels, 1))
        kept &= place % step == 0
    return kept


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
