"""Optima in pictures: the designs around, where searches ended, what holds them; and fronts of several goals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.arguments import verb
from flexura.errors import OptionError, foremost
from flexura.study.optimum import ActiveLimit, Optimum, Pareto, slice_of
from flexura.tables import counted, quantity, scale_for
from flexura.view.drawing import (
    DPI,
    FAINT,
    INK,
    Bar,
    Coordinate,
    draw_bars,
    draw_parallel,
    foot,
    headline,
    legend_above,
    new_chart,
    ranked,
    shortened,
    style,
    ticks_within,
)
from flexura.view.mechanisms import save_figures
from flexura.view.results.design_maps import legible
from flexura.view.results.design_slices import draw_slice
from flexura.view.scene import Array

FOUND, OTHER, MISSED = "#1f5fa8", "#b8860b", "#c2182b"

FEASIBLE = 1e-6
"""Limits that are missed by more of their scale are missed."""

MOST_VARIABLES = 16


@verb
def save_optimum(result: Optimum | Pareto, folder: Path | str, *, dpi: float = DPI) -> list[Path]:
    """Write the picture of `draw_optimum` as `optimum.png`. Raises OptionError as that, and when the folder cannot be
    written to."""
    return save_figures({"optimum.png": draw_optimum(result, dpi=dpi)}, folder)


@verb
def draw_optimum(result: Optimum | Pareto, *, dpi: float = DPI) -> Figure:
    """Draw an optimum: level lines of the goal around it over two variables, or its curve over one, with the edge of
    each limit, designs that miss one behind bars and the searches; the value that each of these ended at, where every
    variable lies between its bounds, and what 1 % of room in each limit that holds it would buy. Of a front of two
    goals the designs, with the knee, the design furthest from the line between the ends; of more goals parallel
    coordinates.

    Of more than two variables those two are shown that change the goal, or a limit that holds it, most; all else is as
    found. What takes each design by itself is interpolated between some, as are frequencies where that is within
    0.1 %, and notes say how far each is off at others.
    dpi as in `draw_mechanism`. Returns a Figure. Raises OptionError for a front without designs.
    """
    if isinstance(result, Optimum):
        return _optimum(result, dpi)
    figure = _front(result, dpi)
    foot(figure, foremost(result.warnings, 1), result.notes)
    return figure


def _optimum(result: Optimum, dpi: float) -> Figure:
    shown = slice_of(result)
    heights = (1.2, 0.5 + 0.22 * min(len(result.variables), MOST_VARIABLES), 0.8 + 0.25 * max(len(result.active), 3))
    figure = new_chart((12.0, max(1.1 + sum(heights), 5.6)), dpi)
    grid = figure.add_gridspec(3, 2, width_ratios=(1.15, 1.0), height_ratios=heights)
    around = figure.add_subplot(grid[:, 0])
    draw_slice(around, result, shown)
    upper, middle, lower = (figure.add_subplot(grid[row, 1]) for row in range(3))
    _starts(upper, result)
    _variables(middle, result)
    _active(lower, result)
    value = quantity(result.value, result.unit)
    said = f"{result.goal} {value}" if result.is_feasible else f"{result.goal}: no design meets the limits"
    headline(figure, f"{result.name}: {said}")
    foot(figure, foremost(result.warnings, 1), [*shown.notes, *result.notes])
    return legible(figure, [around])


def _words(axes: Axes, said: str) -> None:
    axes.set_axis_off()
    style = {"size": 8, "ha": "center", "va": "center", "color": INK, "parse_math": False}
    axes.text(0.5, 0.5, said, transform=axes.transAxes, **style)


def _starts(axes: Axes, result: Optimum) -> None:
    """What each start ended at: at the optimum, elsewhere, or where limits are missed."""
    if not result.starts:
        _words(axes, "no searches: combinations were compared")
        return
    scale = scale_for([result.value, *(own.value for own in result.starts)], result.unit)
    missed = [own for own in result.starts if own.violation > FEASIBLE]
    here = [own for own in result.starts if own.agrees and own not in missed]
    others = [own for own in result.starts if own not in here and own not in missed and np.isfinite(own.value)]
    groups = ((here, "o", FOUND, "the design reported"), (others, "s", OTHER, "elsewhere"), (missed, "x", MISSED, ""))
    for own, marker, colour, name in groups:
        label = name or "limits missed"
        if own:
            values = [one.value / scale.size for one in own]
            axes.plot([one.number + 1 for one in own], values, marker, color=colour, ms=5, label=label, gid=label)
    axes.axhline(result.value / scale.size, color=FOUND, lw=0.8, ls=":")
    count = max(len(result.starts), 1)
    axes.set_xlim(0.5, count + 0.5)
    axes.set_xticks(range(1, count + 1, -(-count // 8)))
    axes.set_xlabel("start", fontsize=8)
    axes.set_ylabel(scale.label(shortened(result.goal, 40)), fontsize=8, parse_math=False)
    low, high = axes.get_ylim()
    if high - low < 1e-3 * abs(high):
        low, high = sorted((0.95 * result.value / scale.size, 1.05 * result.value / scale.size))
    if low < high:
        axes.set_ylim(low, high)
        ticks_within(axes.yaxis, low, high)
    style(axes)
    legend_above(axes)


def _variables(axes: Axes, result: Optimum) -> None:
    """Variables between their bounds."""
    shown = result.variables[:MOST_VARIABLES]
    for at, own in zip(-np.arange(len(shown), dtype=float), shown, strict=True):
        part = [(one - own.low) / ((own.high - own.low) or 1.0) for one in (own.start, own.value)]
        axes.plot([0, 1], [at, at], color=FAINT, lw=3, solid_capstyle="butt")
        axes.plot([min(max(part[0], 0.0), 1.0)], [at], "o", mfc="white", mec=INK, ms=5, gid=f"before {own.name}")
        axes.plot([part[1]], [at], "D" if own.at_bound else "o", color=FOUND, ms=5, gid=f"found {own.name}")
        axes.text(1.05, at, quantity(own.value, own.unit, 4), size=7, va="center", color=INK)
    axes.set_yticks(-np.arange(len(shown)), [shortened(own.name, 26) for own in shown], fontsize=7, parse_math=False)
    axes.set(xlim=(-0.05, 1.35), ylim=(-max(len(shown), 2) + 0.4, 0.6))
    axes.set_xticks([0, 1], ["low", "high"], fontsize=7)
    axes.tick_params(axis="y", length=0, colors=INK)
    for spine in axes.spines.values():
        spine.set_visible(False)
    more = len(result.variables) - len(shown)
    title = "white: before; blue: found; diamond: at a bound" + (f"; {more} more" if more else "")
    axes.set_title(title, fontsize=7.5, color=INK, loc="left")


def _active(axes: Axes, result: Optimum) -> None:
    """What a per cent of room in each limit buys, in the unit of the goal; of no optimum, what is missed."""
    active = result.active
    if not active:
        said = "combinations have no multipliers" if not result.starts else "no limit holds it"
        said = "\n".join(shortened(str(own), 70) for own in result.violations) or said
        _words(axes, said)
        return
    scale = scale_for([own.per_percent for own in active], active[0].goal_unit)
    bars = [_bar(own, own.per_percent / scale.size, scale.text(own.per_percent, 3)) for own in active]
    sign = "falls by" if active[0].falls else "rises by"
    draw_bars(axes, ranked(bars, scale.unit), scale.label(f"{shortened(active[0].goal, 24)} {sign}"), 3)
    axes.set_title("what 1 % of room in a limit buys", fontsize=7.5, color=INK, loc="left")


def _bar(own: ActiveLimit, value: float, said: str) -> Bar:
    text = said if value else f"{quantity(own.multiplier, own.goal_unit, 3)} per {own.unit or 'unit'}"
    return Bar(own.text, value, text, value, value)


def _front(result: Pareto, dpi: float) -> Figure:
    """Two goals against each other, or parallel coordinates."""
    if not len(result):
        raise OptionError("no design was found that meets the limits: there is no front to draw")
    columns = [*zip(result.goals, result.units, result.values.T, strict=True)]
    if len(columns) > 2:
        parameters = zip(result.names, result.parameter_units, result.designs.T, strict=True)
        coordinates = [Coordinate(*own) for own in (*columns, *parameters)]
        figure = draw_parallel(coordinates, coordinates[0], dpi)
    else:
        figure = new_chart((7.0, 5.0), dpi)
        axes = figure.subplots()
        scales = [scale_for(values, unit) for _, unit, values in columns]
        x, y = (values / own.size for own, (_, _, values) in zip(scales, columns, strict=True))
        axes.plot(x, y, "o", color=FOUND, ms=4, gid="front")
        knee = _knee(result.values)
        if knee is not None:
            label = f"knee, design {knee}"
            axes.plot(x[knee], y[knee], "D", mfc="none", mec=MISSED, ms=9, label=label, gid="knee")
        for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            axis.set_view_interval(low, high, ignore=True)
            ticks_within(axis, low, high)
        axes.set_xlabel(scales[0].label(columns[0][0]), fontsize=8, parse_math=False)
        axes.set_ylabel(scales[1].label(columns[1][0]), fontsize=8, parse_math=False)
        style(axes)
        legend_above(axes)
    headline(figure, f"{result.name}: {counted(len(result), 'design')} of which none is better in all goals")
    return figure


def _knee(values: Array) -> int | None:
    """The row of the design (N, 2) furthest from the line between the ends of a front, each goal over its range; None
    where there are fewer than three (Das 1999, "On characterizing the knee of the Pareto curve")."""
    span = np.ptp(values, axis=0)
    if len(values) < 3 or not (span > 0).all():
        return None
    own = (values - values.min(axis=0)) / span
    way = own[-1] - own[0]
    off = np.abs(way[0] * (own[:, 1] - own[0, 1]) - way[1] * (own[:, 0] - own[0, 0]))
    return int(off.argmax())
