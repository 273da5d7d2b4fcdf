"""Sweeps in pictures: curves over one parameter, maps over two, and parallel coordinates over more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.charts import WIDE
from flexura.errors import OptionError, foremost
from flexura.study.engine import StudyTable, jumps_of
from flexura.tables import Scale, counted, scale_for
from flexura.thresholds import PROVEN
from flexura.view.drawing import (
    DPI,
    INK,
    SERIES,
    Coordinate,
    colour_axis,
    draw_parallel,
    fitted_axis,
    headline,
    held_axis,
    legend_above,
    limits_of,
    lone_values,
    named,
    panel_grid,
    plain,
    style,
    value_axis,
)
from flexura.view.mechanisms import save_figures
from flexura.view.scene import Array

FAILED, UNPROVEN = "#c2182b", "#8a5a00"
"""Colours of designs without a value, and of those that are not proven."""

BY_NUMBER = "#9aa3ad"
"""Frequencies by number where others are followed by what moves."""

ELSEWHERE: dict[str, Any] = {"ls": ":", "lw": 1.0, "marker": "o", "mfc": "white", "ms": 4.5}
"""Where a frequency that is followed goes over to another mode."""

MOST_PANELS = 6

FEW = 40
"""Designs up to which each has a dot on its curve."""

MOST_CROSSES = 400
"""Designs of a grid up to which those without a value have crosses."""

ALONG = 200
"""Values of a variable that a map or a curve has room for."""

MOST_LINES = 2000
"""Designs that are drawn one by one."""

CONSTANT_SPREAD = 1e-9
"""Spread, relative to the value, of a quantity that does not change."""

MOST_LEVELS = 8
"""Intervals between level lines, about."""

HATCHED: dict[str, Any] = {"facecolor": "#eceef1", "edgecolor": "#a9b0b9", "hatch": "////", "linewidth": 0.0}
"""How an area without values looks."""


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
    designs = _designs_shown(table)
    if not len(designs.is_proven):
        raise OptionError("no design of the study is worked out yet: there is nothing to draw")
    notes, count = [*designs.notes], len(designs.varied)
    if count == 1:
        figure = _draw_curves(designs, dpi)
    elif count == 2:
        figure = _draw_maps(designs, dpi)
        if len(designs.quantities) > MOST_PANELS:
            notes.append(f"{len(designs.quantities) - MOST_PANELS} more quantities are not drawn")
    else:
        has_all = ~np.any([np.isnan(values) for values in designs.quantities.values()], axis=0)
        columns = [*designs.varied.items(), *designs.quantities.items()]
        coordinates = [Coordinate(*named(heading), values[has_all]) for heading, values in columns]
        figure = draw_parallel(coordinates, coordinates[count], dpi)
        failed = int((~has_all).sum())
        notes += [f"{counted(failed, 'failed design')} left out"] if failed else []
    over = ", ".join(named(name)[0] for name in designs.varied)
    title = f"{table.name}: {counted(table.done, 'design')} over {over}"
    headline(figure, title, foremost(table.warnings, 1), [*notes, *table.notes])
    return legible(figure, figure.axes) if count == 2 else figure


@dataclass(frozen=True)
class _Designs:
    """Designs by heading (n,), SI: `varied` parameters, of more than one value, and `quantities` that were asked for;
    `lower` and `upper` proven bounds of some of these. `is_proven` (n,); `leaps` (n,) says of some quantities where
    they go over to another mode between a design and the one with the next larger value of the parameter, by which
    designs are in order where it varies alone."""

    varied: Mapping[str, Array]
    quantities: Mapping[str, Array]
    lower: Mapping[str, Array]
    upper: Mapping[str, Array]
    is_proven: NDArray[np.bool_]
    leaps: Mapping[str, NDArray[np.bool_]]
    is_grid: bool
    logarithmic: frozenset[str]
    notes: tuple[str, ...]

    def is_unproven(self, heading: str) -> NDArray[np.bool_]:
        """Designs (n,) that have a value of something that can be proven, without an interval as narrow as that of a
        proven one."""
        with np.errstate(invalid="ignore"):
            is_narrow = self.upper[heading] - self.lower[heading] <= PROVEN * self.lower[heading]
        return np.isfinite(self.quantities[heading]) & ~self.is_proven & ~is_narrow


def _designs_shown(table: StudyTable) -> _Designs:
    """The designs of a study, every so many where there are more than a picture has room for, which `notes` say.

    Raises OptionError for a shard that is damaged.
    """
    lower, upper = ({heading: _bound(heading, end) for heading in table.asked} for end in ("lower", "upper"))
    proven = [heading for heading in table.asked if {lower[heading], upper[heading]} <= set(table.columns)]
    leaps = {heading: jumps_of(heading) for heading in table.asked if jumps_of(heading) in table.columns}
    names = ["design", *table.parameters, *table.asked, "is proven", *leaps.values()]
    names += [bound[heading] for heading in proven for bound in (lower, upper)]
    steps = _steps(table)
    blocks = []
    for block in table.blocks(names):
        kept = _kept(block["design"], steps)
        blocks.append({name: values[kept] for name, values in block.items()})
    columns = {name: np.concatenate([block[name] for block in blocks] or [np.empty(0)]) for name in names}
    varied = [name for name in table.parameters if len(columns["design"]) and np.ptp(columns[name]) > 0]
    varied = varied or list(table.parameters[:1])
    if len(varied) == 1:
        order = np.argsort(columns[varied[0]], kind="stable")
        columns = {name: values[order] for name, values in columns.items()}
    step = int(np.prod([step for _, step in steps]))
    return _Designs(
        {name: columns[name] for name in varied},
        {heading: columns[heading] for heading in table.asked},
        {heading: columns[lower[heading]] for heading in proven},
        {heading: columns[upper[heading]] for heading in proven},
        columns["is proven"].astype(bool),
        {heading: columns[name].astype(bool) for heading, name in leaps.items()},
        table.space.get("sampling") == "grid",
        frozenset(name for name in table.parameters if _variable(table, name).get("scale") == "log"),
        (f"one of {step} designs is drawn",) if step > 1 else (),
    )


def _bound(heading: str, end: str) -> str:
    """The column of a proven bound."""
    name, unit = named(heading)
    return f"{name} {end} [{unit}]" if unit else f"{name} {end}"


def _variable(table: StudyTable, heading: str) -> Mapping[str, Any]:
    """The description of the variable of a column."""
    name = named(heading)[0].removeprefix("parameter ")
    return next((variable for variable in table.space.get("variables", ()) if variable.get("name") == name), {})


def _steps(table: StudyTable) -> list[tuple[int, int]]:
    """How many values each variable of a grid takes, and of how many one is shown; all designs as one variable where
    they are drawn one by one."""
    counts = [_value_count(_variable(table, name)) for name in table.parameters]
    several = sum(count > 1 for count in counts)
    if table.space.get("sampling") == "grid" and np.prod(counts, dtype=float) == table.designs and several <= 2:
        most = ALONG if several == 2 else MOST_LINES
        return [(count, ceil(count / most)) for count in counts]
    return [(table.designs, ceil(table.designs / MOST_LINES))]


def _value_count(variable: Mapping[str, Any]) -> int:
    """How many values a variable takes; 0 where they are not counted."""
    if "values" in variable:
        return len(variable["values"])
    if variable.get("count") is None:
        return int(variable.get("high", 0) - variable.get("low", 0)) + 1 if variable.get("kind") == "integer" else 0
    return int(variable["count"])


def _kept(numbers: NDArray[np.int64], steps: list[tuple[int, int]]) -> NDArray[np.bool_]:
    """Which designs are shown, by their numbers, in which the last variable runs fastest."""
    kept = np.ones(len(numbers), dtype=bool)
    for count, step in reversed(steps):
        numbers, place = np.divmod(numbers, max(count, 1))
        kept &= place % step == 0
    return kept


def _draw_curves(designs: _Designs, dpi: float) -> Figure:
    """A panel for each unit of the quantities, over the parameter."""
    ((name, values),) = designs.varied.items()
    scale = scale_for(values, named(name)[1])
    x = values / scale.size
    units: dict[str, list[str]] = {}
    for heading in designs.quantities:
        units.setdefault(named(heading)[1], []).append(heading)
    columns = 1 if len(units) == 1 else 2
    rows = -(-len(units) // columns)
    size = (8.0 if columns == 1 else 10.0, 4.8 if rows == 1 else 3.6 * rows)
    figure, panels = panel_grid(len(units), (rows, columns), size, dpi)
    for axes, headings in zip(panels, units.values(), strict=True):
        _draw_quantities(axes, designs, headings, x)
        axes.set_xlabel(scale.label(named(name)[0]), fontsize=8, parse_math=False)
        if x[0] < x[-1]:
            fitted_axis(axes.xaxis, float(x[0]), float(x[-1]), name in designs.logarithmic)
    return figure


def _draw_quantities(axes: Axes, designs: _Designs, headings: list[str], x: Array) -> None:
    """Curves of quantities of one unit, those by number grey where others are followed by what moves."""
    values = np.array([designs.quantities[heading] for heading in headings])
    scale = scale_for(values, named(headings[0])[1])
    followed = [heading for heading in headings if heading.startswith("f(")]
    by_number = [heading for heading in headings if followed and _is_number(heading)]
    for k, heading in enumerate(by_number):
        grey = {"color": BY_NUMBER, "lw": 3.2, "alpha": 0.6, "solid_capstyle": "butt", "gid": heading}
        axes.plot(x, _finite(designs.quantities[heading]) / scale.size, label="" if k else "by number", **grey)
    coloured = [heading for heading in headings if heading not in (*by_number, *followed)] + followed
    has_leapt = [
        _draw_quantity(axes, designs, heading, x, size=scale.size, colour=SERIES[k % len(SERIES)])
        for k, heading in enumerate(coloured)
    ]
    if any(has_leapt):
        axes.plot([], [], color=UNPROVEN, label="goes over to another mode", **ELSEWHERE)
    failed = x[np.isnan(values).any(axis=0)]
    if len(failed):
        lower_edge, cross = np.full(len(failed), 0.025), {"color": FAILED, "ms": 5}
        axes.plot(failed, lower_edge, "x", transform=axes.get_xaxis_transform(), gid="failed", **cross)
        axes.plot([], [], "x", label="failed", **cross)
    known = values[np.isfinite(values)] / scale.size
    if not len(known):
        axes.set_yticks([])
    elif known.min() > 0 and known.max() > WIDE * known.min():
        value_axis(axes, known)
    else:
        held_axis(axes.yaxis)
    axes.set_ylabel(_axis_label(headings, scale), fontsize=8, parse_math=False)
    style(axes)
    legend_above(axes)


def _draw_quantity(axes: Axes, designs: _Designs, heading: str, x: Array, *, size: float, colour: str) -> bool:
    """A curve with its band and rings, interrupted where it goes over to another mode; whether it does so."""
    y = _finite(designs.quantities[heading]) / size
    leaps = designs.leaps.get(heading, np.zeros(len(x), dtype=bool)).copy()
    leaps[-1] = False
    after = 1 + np.flatnonzero(leaps)
    broken_x, broken_y = (np.insert(values, after, np.nan) for values in (x, y))
    dots = list(range(len(broken_y))) if len(y) <= FEW else lone_values(broken_y)
    mark: dict[str, Any] = {"marker": "o", "ms": 2.6, "markevery": dots}
    axes.plot(broken_x, broken_y, color=colour, lw=1.4, label=named(heading)[0], gid=heading, **mark)
    for k in after:
        axes.plot(x[k - 1 : k + 1], y[k - 1 : k + 1], color=colour, gid=f"other mode {heading}", **ELSEWHERE)
    if heading in designs.lower:
        low, high = (np.insert(bound[heading] / size, after, np.nan) for bound in (designs.lower, designs.upper))
        axes.fill_between(broken_x, low, high, color=colour, alpha=0.25, lw=0, gid=f"bounds of {heading}")
        _draw_rings(axes, designs, heading, x, y, ms=6, gid=f"not proven {heading}")
    return bool(len(after))


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)


def _draw_rings(axes: Axes, designs: _Designs, heading: str, x: Array, y: Array, **style: Any) -> None:
    """Rings around designs that are not proven."""
    chosen = designs.is_unproven(heading)
    axes.plot(x[chosen], y[chosen], "o", mfc="none", mec=UNPROVEN, **style)


def _is_number(heading: str) -> bool:
    return heading[:1] == "f" and heading[1:2].isdigit()


def _axis_label(headings: list[str], scale: Scale) -> str:
    """What an axis of several quantities is called."""
    if all(_is_number(heading) or heading.startswith("f(") for heading in headings):
        return scale.label("natural frequency")
    names = {named(heading)[0].split("(")[0].split(" at ")[0] for heading in headings}
    return scale.label(names.pop() if len(names) == 1 else "")


def _draw_maps(designs: _Designs, dpi: float) -> Figure:
    """A map of each quantity over two parameters."""
    headings = list(designs.quantities)[:MOST_PANELS]
    columns = min(len(headings), 3 if len(headings) > 4 else 2)
    rows = -(-len(headings) // columns)
    size = (6.6, 4.9) if columns == 1 else (4.6 * columns, 3.9 * rows + 0.4)
    figure, panels = panel_grid(len(headings), (rows, columns), size, dpi)
    for axes, heading in zip(panels, headings, strict=True):
        _draw_map(axes, designs, heading)
    return figure


def _draw_map(axes: Axes, designs: _Designs, heading: str) -> None:
    """A quantity over the two parameters that vary, with the designs where it is highest and lowest."""
    scales = [scale_for(values, named(name)[1]) for name, values in designs.varied.items()]
    x, y = (values / scale.size for values, scale in zip(designs.varied.values(), scales, strict=True))
    name, unit = named(heading)
    scale = scale_for(designs.quantities[heading], unit)
    values = designs.quantities[heading] / scale.size
    if designs.is_grid:
        _draw_grid(axes, x, y, values)
    else:
        _draw_samples(axes, x, y, values, scale.label(name))
    if heading in designs.lower:
        _draw_rings(axes, designs, heading, x, y, ms=5, gid="not proven")
    finite = _finite(values)
    title = f"{scale.label(name)}: no design has a value"
    if not np.isnan(finite).all():
        for k, marker, gid in ((np.nanargmin(finite), "v", "lowest"), (np.nanargmax(finite), "^", "highest")):
            axes.plot(x[k], y[k], marker, color="white", mec=INK, ms=7, zorder=5, clip_on=False, gid=gid)
        low, high = (scale.text(scale.size * float(value)) for value in (np.nanmin(finite), np.nanmax(finite)))
        title = f"{name}\n▼ {low}   ▲ {high}"
    axes.set_title(title, fontsize=8.5, color=INK, parse_math=False)
    labels = [scale.label(named(name)[0]) for scale, name in zip(scales, designs.varied, strict=True)]
    axes.set_xlabel(labels[0], fontsize=8, parse_math=False)
    axes.set_ylabel(labels[1], fontsize=8, parse_math=False)
    axes.tick_params(labelsize=8, colors=INK)
    for name, place, axis in zip(designs.varied, (x, y), (axes.xaxis, axes.yaxis), strict=True):
        fitted_axis(axis, float(place.min()), float(place.max()), name in designs.logarithmic)


def _draw_grid(axes: Axes, x: Array, y: Array, values: Array) -> None:
    """Level lines over a grid, and crosses where there is no value, as long as they can be told apart."""
    grid_x, column = np.unique(x, return_inverse=True)
    grid_y, row = np.unique(y, return_inverse=True)
    grid = np.full((len(grid_y), len(grid_x)), np.nan)
    grid[row, column] = values
    draw_levels(axes, grid_x, grid_y, grid)
    j, i = np.nonzero(~np.isfinite(grid))
    if grid.size <= MOST_CROSSES and len(i):
        axes.plot(grid_x[i], grid_y[j], "x", color=FAILED, ms=4, clip_on=False, gid="failed")


def draw_levels(axes: Axes, x: Array, y: Array, grid: Array) -> None:
    """Labelled level lines of values (y, x) over a grid, and hatched cells where a corner has no value."""
    known = np.isfinite(grid)
    is_lost = ~(known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:])
    if is_lost.any():
        j, i = np.nonzero(is_lost)
        left, right, lower, upper = x[i], x[i + 1], y[j], y[j + 1]
        corners = np.stack([[left, left, right, right], [lower, upper, upper, lower]], axis=-1).transpose(1, 0, 2)
        axes.add_collection(PolyCollection(list(corners), gid="no value", **HATCHED))
    if is_lost.all():
        return
    masked = np.ma.masked_invalid(grid)
    low, high = float(masked.min()), float(masked.max())
    if high - low > CONSTANT_SPREAD * max(abs(low), abs(high)):
        limits = limits_of(grid)
        levels = (
            LogLocator(subs=(1.0, 2.0, 5.0)) if isinstance(limits, LogNorm) else MaxNLocator(MOST_LEVELS)
        ).tick_values(low, high)
        style: dict[str, Any] = {"levels": levels, "corner_mask": False}
        axes.contourf(x, y, masked, cmap="GnBu", norm=limits, extend="both", **style)
        lines = axes.contour(x, y, masked, colors=[INK], linewidths=0.7, **style)
        for text in axes.clabel(lines, fontsize=7, fmt=plain):
            text.set_parse_math(False)


def _draw_samples(axes: Axes, x: Array, y: Array, values: Array, label: str) -> None:
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
            if inside and box.y1 <= axes.bbox.y1 and not any(box.overlaps(other) for other in kept):
                kept.append(box)
            else:
                text.remove()
    return figure
