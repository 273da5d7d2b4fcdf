"""Optima in pictures: the designs around, where searches ended, what holds them; and fronts of several goals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from flexura.arguments import verb
from flexura.errors import OptionError, foremost
from flexura.study.optimum import ActiveLimit, DesignSlice, Optimum, Pareto, slice_of
from flexura.tables import Scale, counted, quantity, scale_for
from flexura.view.drawing import (
    DPI,
    FAINT,
    INK,
    SERIES,
    Bar,
    Coordinate,
    draw_bars,
    draw_parallel,
    fitted_axis,
    headline,
    held_axis,
    legend_above,
    new_chart,
    ranked_bars,
    shortened,
    style,
    without_frame,
)
from flexura.view.mechanisms import save_figures
from flexura.view.results.sweeps import HATCHED, draw_levels, legible
from flexura.view.scene import Array

FOUND, OTHER, MISSED = "#1f5fa8", "#b8860b", "#c2182b"
"""Colours of searches that ended at the optimum, elsewhere, or where limits are missed."""

EDGES = (*SERIES[1:], SERIES[0])
"""Colours of the edges of limits, one after another."""

OPTIMUM, SEARCH = "#c2182b", "#5b6770"

BARS, HATCH = "#8d959f", "\\\\\\\\"
"""How designs look that miss a limit: paler, behind bars."""

ENTRY = 64
"""Letters of an entry of the legend."""

MISSED_BY = 1e-6
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
    if isinstance(result, Pareto):
        return _draw_front(result, dpi)
    shown = slice_of(result)
    heights = (1.2, 0.5 + 0.22 * min(len(result.variables), MOST_VARIABLES), 0.8 + 0.25 * max(len(result.active), 3))
    figure = new_chart((12.0, max(1.1 + sum(heights), 5.6)), dpi)
    grid = figure.add_gridspec(3, 2, width_ratios=(1.15, 1.0), height_ratios=heights)
    around = figure.add_subplot(grid[:, 0])
    _draw_slice(around, result, shown)
    upper, middle, lower = (figure.add_subplot(grid[row, 1]) for row in range(3))
    _draw_starts(upper, result)
    _draw_variables(middle, result)
    _draw_active(lower, result)
    outcome = f" {quantity(result.value, result.unit)}" if result.is_feasible else ": no design meets the limits"
    headline(
        figure, f"{result.name}: {result.goal}{outcome}", foremost(result.warnings, 1), [*shown.notes, *result.notes]
    )
    return legible(figure, [around])


def _write_alone(axes: Axes, text: str) -> None:
    """A text in place of a chart."""
    axes.set_axis_off()
    style = {"size": 8, "ha": "center", "va": "center", "color": INK, "parse_math": False}
    axes.text(0.5, 0.5, text, transform=axes.transAxes, **style)


def _draw_starts(axes: Axes, result: Optimum) -> None:
    """What each start ended at: at the optimum, elsewhere, or where limits are missed."""
    if not result.starts:
        _write_alone(axes, "no searches: combinations were compared")
        return
    scale = scale_for([result.value, *(start.value for start in result.starts)], result.unit)
    missed = [start for start in result.starts if start.violation > MISSED_BY]
    met = [start for start in result.starts if start not in missed]
    agreeing = [start for start in met if start.agrees]
    others = [start for start in met if not start.agrees and np.isfinite(start.value)]
    for starts, marker, colour, label in (
        (agreeing, "o", FOUND, "the design reported"),
        (others, "s", OTHER, "elsewhere"),
        (missed, "x", MISSED, "limits missed"),
    ):
        if starts:
            values = [start.value / scale.size for start in starts]
            numbers = [start.number + 1 for start in starts]
            axes.plot(numbers, values, marker, color=colour, ms=5, label=label, gid=label)
    axes.axhline(result.value / scale.size, color=FOUND, lw=0.8, ls=":")
    count = len(result.starts)
    axes.set_xlim(0.5, count + 0.5)
    axes.set_xticks(range(1, count + 1, -(-count // 8)))
    axes.set_xlabel("start", fontsize=8)
    axes.set_ylabel(scale.label(shortened(result.goal, 40)), fontsize=8, parse_math=False)
    low, high = axes.get_ylim()
    if high - low < 1e-3 * abs(high):
        low, high = sorted((0.95 * result.value / scale.size, 1.05 * result.value / scale.size))
    if low < high:
        fitted_axis(axes.yaxis, low, high)
    style(axes)
    legend_above(axes)


def _draw_variables(axes: Axes, result: Optimum) -> None:
    """Variables between their bounds."""
    shown = result.variables[:MOST_VARIABLES]
    for at, variable in zip(-np.arange(len(shown), dtype=float), shown, strict=True):
        before, now = (
            (value - variable.low) / ((variable.high - variable.low) or 1.0)
            for value in (variable.start, variable.value)
        )
        axes.plot([0, 1], [at, at], color=FAINT, lw=3, solid_capstyle="butt")
        white = {"mfc": "white", "mec": INK, "ms": 5, "gid": f"before {variable.name}"}
        axes.plot([min(max(before, 0.0), 1.0)], [at], "o", **white)
        axes.plot([now], [at], "D" if variable.at_bound else "o", color=FOUND, ms=5, gid=f"found {variable.name}")
        axes.text(1.05, at, quantity(variable.value, variable.unit, 4), size=7, va="center", color=INK)
    names = [shortened(variable.name, 26) for variable in shown]
    axes.set_yticks(-np.arange(len(shown)), names, fontsize=7, parse_math=False)
    axes.set(xlim=(-0.05, 1.35), ylim=(-max(len(shown), 2) + 0.4, 0.6))
    axes.set_xticks([0, 1], ["low", "high"], fontsize=7)
    axes.tick_params(axis="y", length=0, colors=INK)
    without_frame(axes)
    more = len(result.variables) - len(shown)
    title = "white: before; blue: found; diamond: at a bound" + (f"; {more} more" if more else "")
    axes.set_title(title, fontsize=7.5, color=INK, loc="left")


def _draw_active(axes: Axes, result: Optimum) -> None:
    """What a per cent of room in each limit buys, in the unit of the goal; of no optimum, what is missed."""
    active = result.active
    if not active:
        missed = "\n".join(shortened(str(violation), 70) for violation in result.violations)
        reason = "no limit holds it" if result.starts else "combinations have no multipliers"
        _write_alone(axes, missed or reason)
        return
    scale = scale_for([limit.per_percent for limit in active], active[0].goal_unit)
    bars = []
    for limit in active:
        value, text = limit.per_percent / scale.size, scale.text(limit.per_percent, 3)
        if not value:
            text = f"{quantity(limit.multiplier, limit.goal_unit, 3)} per {limit.unit or 'unit'}"
        bars.append(Bar(limit.text, value, text, value, value))
    sign = "falls by" if active[0].falls else "rises by"
    draw_bars(axes, ranked_bars(bars, scale.unit), scale.label(f"{shortened(active[0].goal, 24)} {sign}"), 3)
    axes.set_title("what 1 % of room in a limit buys", fontsize=7.5, color=INK, loc="left")


def _draw_front(result: Pareto, dpi: float) -> Figure:
    """Two goals against each other, or parallel coordinates."""
    if not len(result):
        raise OptionError("no design was found that meets the limits: there is no front to draw")
    goals = [Coordinate(*goal) for goal in zip(result.goals, result.units, result.values.T, strict=True)]
    if len(goals) > 2:
        parameters = zip(result.names, result.parameter_units, result.designs.T, strict=True)
        figure = draw_parallel([*goals, *(Coordinate(*parameter) for parameter in parameters)], goals[0], dpi)
    else:
        figure = new_chart((7.0, 5.0), dpi)
        axes = figure.subplots()
        scales = [scale_for(goal.values, goal.unit) for goal in goals]
        x, y = (goal.values / scale.size for goal, scale in zip(goals, scales, strict=True))
        axes.plot(x, y, "o", color=FOUND, ms=4, gid="front")
        knee = _knee(result.values)
        if knee is not None:
            label = f"knee, design {knee}"
            axes.plot(x[knee], y[knee], "D", mfc="none", mec=MISSED, ms=9, label=label, gid="knee")
        held_axis(axes.xaxis)
        held_axis(axes.yaxis)
        axes.set_xlabel(scales[0].label(goals[0].name), fontsize=8, parse_math=False)
        axes.set_ylabel(scales[1].label(goals[1].name), fontsize=8, parse_math=False)
        style(axes)
        legend_above(axes)
    title = f"{result.name}: {counted(len(result), 'design')} of which none is better in all goals"
    headline(figure, title, foremost(result.warnings, 1), result.notes)
    return figure


def _knee(values: Array) -> int | None:
    """The row of the design (N, 2) furthest from the line between the ends of a front, each goal over its range; None
    where there are fewer than three (Das 1999, "On characterizing the knee of the Pareto curve")."""
    span = np.ptp(values, axis=0)
    if len(values) < 3 or not (span > 0).all():
        return None
    share = (values - values.min(axis=0)) / span
    chord, offsets = share[-1] - share[0], share - share[0]
    return int(np.abs(chord[0] * offsets[:, 1] - chord[1] * offsets[:, 0]).argmax())


class _Slice(NamedTuple):
    """A slice through an optimum in the units of its axes: values of one or two variables, each with its scale, and the
    goal (n,) or (n, m) over them, NaN where there is no answer."""

    designs: DesignSlice
    x: list[Array]
    scales: list[Scale]
    goal: Array
    goal_scale: Scale

    @property
    def is_map(self) -> bool:
        """Whether two variables vary."""
        return len(self.x) == 2


def _draw_slice(axes: Axes, result: Optimum, designs: DesignSlice) -> None:
    """A slice through an optimum, and above it what lines are, with what 1 % of room in each limit buys."""
    scales = [scale_for(x, variable.unit) for x, variable in zip(designs.x, designs.along, strict=True)]
    goal_scale = scale_for(designs.goal, result.unit)
    is_known = np.all([~np.isnan(values) for values in (designs.goal, *designs.margins.values())], axis=0)
    goal = np.where(is_known, designs.goal / goal_scale.size, np.nan)
    shown = _Slice(designs, [x / s.size for x, s in zip(designs.x, scales, strict=True)], scales, goal, goal_scale)
    if shown.is_map:
        draw_levels(axes, shown.x[0], shown.x[1], goal.T)
    else:
        line: dict[str, Any] = {"lw": 0.8, "ls": ":", "marker": "o", "ms": 3.5} if designs.is_discrete else {"lw": 1.4}
        axes.plot(shown.x[0], goal, color=INK, **line, gid="goal")
        style(axes)
    entries = [*_edges(axes, result, shown), *_missed(axes, shown), *_marks(axes, result, shown)]
    goal_label = goal_scale.label(shortened(result.goal.partition(" ")[2], 40))
    labels = [s.label(shortened(variable.name, 40)) for variable, s in zip(designs.along, scales, strict=True)]
    axes.tick_params(labelsize=8, colors=INK)
    axes.set_xlabel(labels[0], fontsize=8, parse_math=False)
    axes.set_ylabel(labels[1] if shown.is_map else goal_label, fontsize=8, parse_math=False)
    for x, axis, is_logarithmic in zip(shown.x, (axes.xaxis, axes.yaxis), designs.by_logarithm, strict=False):
        fitted_axis(axis, float(x[0]), float(x[-1]), is_logarithmic)
    if not shown.is_map:
        held_axis(axes.yaxis)
    over = " and ".join(shortened(variable.name, 28) for variable in designs.along)
    title = f"{'level lines of ' if shown.is_map else ''}{goal_label} over {over}"
    if designs.held:
        held = ", ".join(f"{variable.name} {quantity(variable.value, variable.unit, 4)}" for variable in designs.held)
        title += f"\nall else as {'found' if result.is_feasible else 'in the nearest design'}: {shortened(held, 70)}"
    _draw_legend(axes, title, entries)


def _edges(axes: Axes, result: Optimum, shown: _Slice) -> Iterator[Artist]:
    """The edge of each limit, where it is just met, in a colour of its own."""
    active, x = {limit.text: limit for limit in result.active}, shown.x
    for k, (text, infinite_margin) in enumerate(shown.designs.margins.items()):
        colour, margin = EDGES[k % len(EDGES)], _finite(infinite_margin)
        known = margin[np.isfinite(margin)]
        is_there = bool(len(known)) and known.min() < 0 <= known.max()
        if is_there and shown.is_map:
            lines = axes.contour(*x, np.ma.masked_invalid(margin.T), [0.0], colors=[colour], linewidths=2.0)
            lines.set_gid(text)
        elif is_there and not shown.designs.is_discrete:
            for at in _crossings(x[0], margin):
                axes.axvline(at, color=colour, lw=1.8, gid=text)
        label = _limit_label(text, active.get(text))
        if not is_there:
            label += ": no answer" if not len(known) else ": met here" if known.min() >= 0 else ": missed here"
        yield Line2D([], [], color=colour, lw=2.0 if is_there else 0.8, ls="-" if is_there else ":", label=label)


def _limit_label(text: str, limit: ActiveLimit | None) -> str:
    """A limit, with what 1 % of it buys, or a unit, where it is active."""
    if limit is None or not limit.multiplier:
        return shortened(text, ENTRY)
    gain = quantity(limit.per_percent or limit.multiplier, limit.goal_unit, 3)
    bought = f": {'1 %' if limit.per_percent else limit.unit or 'a unit'} buys {gain}"
    return shortened(text, ENTRY - len(bought)) + bought


def _missed(axes: Axes, shown: _Slice) -> Iterator[Artist]:
    """Where a limit is missed, and where there is no answer."""
    designs, x = shown.designs, shown.x
    worst = np.min([_finite(margin) for margin in designs.margins.values()] or [np.ones_like(designs.goal)], axis=0)
    known = worst[np.isfinite(worst)]
    if len(known) and known.min() < 0:
        if shown.is_map:
            masked, levels = np.ma.masked_invalid(worst.T), [float(known.min()) - 1.0, 0.0]
            pale: dict[str, Any] = {"colors": ["#ffffff"], "alpha": 0.45, "hatches": [HATCH], "zorder": 1.5}
            area = axes.contourf(*x, masked, levels=levels, **pale)
            area.set(edgecolor=BARS, linewidth=0.0, gid="missed")
        else:
            bars: dict[str, Any] = {"facecolor": "none", "edgecolor": BARS, "hatch": HATCH, "lw": 0.0}
            for low, high in _spans(x[0], worst, designs.is_discrete):
                axes.axvspan(low, high, **bars, gid="missed", zorder=0.5)
        yield Patch(facecolor="white", edgecolor=BARS, hatch=HATCH, linewidth=0.0, label="limits missed")
    if np.isnan(shown.goal).any():
        if not shown.is_map:
            for low, high in _spans(x[0], np.where(np.isnan(shown.goal), -1.0, 1.0), is_discrete=True):
                axes.axvspan(low, high, **HATCHED, gid="no value", zorder=0.4)
        yield Patch(**HATCHED, label="no answer")


def _finite(margin: Array) -> Array:
    """Margins without infinite ones, which are larger than all others."""
    known = margin[np.isfinite(margin)]
    return np.where(np.isposinf(margin), known.max(initial=0.0) + 1.0, margin)


def _crossings(x: Array, margin: Array) -> Array:
    """Where a margin (n,) over x goes through zero, straight between its values."""
    k = np.flatnonzero(np.isfinite(margin[:-1] + margin[1:]) & ((margin[:-1] < 0) != (margin[1:] < 0)))
    return x[k] - margin[k] * (x[k + 1] - x[k]) / (margin[k + 1] - margin[k])


def _spans(x: Array, worst: Array, is_discrete: bool) -> Iterator[tuple[float, float]]:
    """Intervals in which a margin (n,) is negative; of single values, half the way to those beside them."""
    if is_discrete:
        ends = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, x[-1:]])
        yield from ((float(ends[k]), float(ends[k + 1])) for k in np.flatnonzero(worst < 0))
        return
    ends = np.unique(np.concatenate([x, _crossings(x, worst)]))
    middle = np.interp((ends[1:] + ends[:-1]) / 2, x, worst)
    inside = np.concatenate([[False], middle < 0, [False]])
    edges = np.flatnonzero(inside[1:] != inside[:-1])
    yield from ((float(ends[low]), float(ends[high])) for low, high in edges.reshape(-1, 2))


def _marks(axes: Axes, result: Optimum, shown: _Slice) -> Iterator[Artist]:
    """The design before, the searches and where they ended, where nothing else varies, and the design found."""
    designs, names = shown.designs, [variable.name for variable in shown.designs.along]

    def at(design: Sequence[float], goal: float | None = None) -> list[float]:
        """Where a design is: on a curve at its goal, SI, or where the curve is."""
        place = [value / scale.size for value, scale in zip(design, shown.scales, strict=True)]
        if shown.is_map:
            return place
        height = np.interp(place[0], shown.x[0], shown.goal) if goal is None else goal / shown.goal_scale.size
        return [place[0], float(height)]

    if not designs.held:
        line = {"color": SEARCH, "lw": 0.9, "ls": "--" if shown.is_map else "", "clip_on": False}
        for k, start in enumerate(result.starts):
            path = [at([start.start[name] for name in names])]
            if start.end:
                path.append(at([start.end[name] for name in names], start.value))
            axes.plot(*np.transpose(path), marker=".", ms=5, gid=f"search {k}", **line)
        if result.starts:
            yield Line2D([], [], color=SEARCH, lw=0.9, ls="--", marker=".", label="searches, from start to end")
        if all(variable.low <= variable.start <= variable.high for variable in designs.along):
            ring = {"marker": "o", "mfc": "white", "mec": INK, "ms": 6, "ls": ""}
            axes.plot(*at([variable.start for variable in designs.along]), **ring, gid="before", clip_on=False)
            yield Line2D([], [], **ring, label="before")
    star = {"marker": "*", "mfc": OPTIMUM, "mec": "white", "mew": 0.7, "ms": 13, "ls": ""}
    place = at([variable.value for variable in designs.along], result.value)
    axes.plot(*place, **star, gid="found", clip_on=False, zorder=6)
    name = "optimum" if result.is_feasible else "nearest"
    yield Line2D([], [], **star, label=f"{name}: {quantity(result.value, result.unit)}")


def _draw_legend(axes: Axes, title: str, entries: Sequence[Artist]) -> None:
    """What is drawn, above it."""
    longest = max(len(str(entry.get_label())) for entry in entries)
    legend = axes.legend(
        handles=entries,
        title=title,
        title_fontsize=8,
        alignment="left",
        fontsize=7,
        frameon=False,
        ncols=1 if longest > ENTRY // 2 else 2,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.2,
    )
    for text in (*legend.get_texts(), legend.get_title()):
        text.set_parse_math(False)
