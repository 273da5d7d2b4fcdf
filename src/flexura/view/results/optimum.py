"""Optima in pictures: the designs around, where searches ended, what holds them; and fronts of several goals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

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
from flexura.view.results.sweeps import HATCHED, draw_levels, legible
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


EDGES = (*SERIES[1:], SERIES[0])
"""Colours of the edges of limits, one after another."""

OPTIMUM, WAY = "#c2182b", "#5b6770"

PALE, BARS, HATCH = "#ffffff", "#8d959f", "\\\\\\\\"
"""How designs look that miss a limit: paler, behind bars."""

ENTRY = 64
"""Letters of an entry of the legend."""


def draw_slice(axes: Axes, result: Optimum, shown: DesignSlice) -> None:
    """Draw a slice through an optimum, and above it what lines are, with what 1 % of room in each limit buys."""
    scales = [scale_for(x, own.unit) for x, own in zip(shown.x, shown.along, strict=True)]
    goal_scale = scale_for(shown.goal, result.unit)
    x = [own / scale.size for own, scale in zip(shown.x, scales, strict=True)]
    is_known = np.all([~np.isnan(own) for own in (shown.goal, *shown.margins.values())], axis=0)
    goal = np.where(is_known, shown.goal / goal_scale.size, np.nan)
    if len(x) == 2:
        draw_levels(axes, x[0], x[1], goal.T)
    else:
        line: dict[str, Any] = {"lw": 0.8, "ls": ":", "marker": "o", "ms": 3.5} if shown.is_discrete else {"lw": 1.4}
        axes.plot(x[0], goal, color=INK, **line, gid="goal")
        style(axes)
    entries = [*_edges(axes, result, shown, x), *_missed(axes, shown, x, goal)]
    entries += _marks(axes, result, shown, [own.size for own in (*scales, goal_scale)], x, goal)
    _axes(axes, shown, x, scales, goal_scale.label(shortened(_goal(result), 40)))
    _legend(axes, _title(result, shown, goal_scale), entries)


def _goal(result: Optimum) -> str:
    return result.goal.partition(" ")[2]


def _title(result: Optimum, shown: DesignSlice, scale: Scale) -> str:
    what = "level lines of " if len(shown.along) == 2 else ""
    over = " and ".join(shortened(own.name, 28) for own in shown.along)
    text = f"{what}{scale.label(shortened(_goal(result), 40))} over {over}"
    if not shown.held:
        return text
    held = ", ".join(f"{own.name} {quantity(own.value, own.unit, 4)}" for own in shown.held)
    return f"{text}\nall else as {'found' if result.is_feasible else 'in the nearest design'}: {shortened(held, 70)}"


def _edges(axes: Axes, result: Optimum, shown: DesignSlice, x: Sequence[Array]) -> Iterator[Artist]:
    """The edge of each limit, where it is just met, in a colour of its own."""
    active = {own.text: own for own in result.active}
    for k, (text, margin) in enumerate(shown.margins.items()):
        colour, own = EDGES[k % len(EDGES)], _finite(margin)
        known = own[np.isfinite(own)]
        is_there = bool(len(known)) and known.min() < 0 <= known.max()
        if is_there and len(x) == 2:
            lines = axes.contour(x[0], x[1], np.ma.masked_invalid(own.T), [0.0], colors=[colour], linewidths=2.0)
            lines.set_gid(text)
        elif is_there and not shown.is_discrete:
            for at in _crossings(x[0], own):
                axes.axvline(at, color=colour, lw=1.8, gid=text)
        label = _bought(text, active.get(text))
        if not is_there:
            label += ": no answer" if not len(known) else ": met here" if known.min() >= 0 else ": missed here"
        yield Line2D([], [], color=colour, lw=2.0 if is_there else 0.8, ls="-" if is_there else ":", label=label)


def _bought(text: str, own: ActiveLimit | None) -> str:
    """A limit, with what 1 % of it buys, or a unit."""
    if own is None or not own.multiplier:
        return shortened(text, ENTRY)
    gain = own.per_percent or own.multiplier
    said = f": {'1 %' if own.per_percent else own.unit or 'a unit'} buys {quantity(gain, own.goal_unit, 3)}"
    return shortened(text, ENTRY - len(said)) + said


def _missed(axes: Axes, shown: DesignSlice, x: Sequence[Array], goal: Array) -> Iterator[Artist]:
    """Where a limit is missed, and where there is no answer."""
    worst = np.min([_finite(own) for own in shown.margins.values()] or [np.ones_like(shown.goal)], axis=0)
    known = worst[np.isfinite(worst)]
    if len(known) and known.min() < 0:
        if len(x) == 2:
            own, levels = np.ma.masked_invalid(worst.T), [float(known.min()) - 1.0, 0.0]
            area = axes.contourf(x[0], x[1], own, levels=levels, colors=[PALE], alpha=0.45, hatches=[HATCH], zorder=1.5)
            area.set(edgecolor=BARS, linewidth=0.0, gid="missed")
        else:
            for low, high in _spans(x[0], worst, shown.is_discrete):
                axes.axvspan(low, high, facecolor="none", edgecolor=BARS, hatch=HATCH, lw=0.0, gid="missed", zorder=0.5)
        yield Patch(facecolor="white", edgecolor=BARS, hatch=HATCH, linewidth=0.0, label="limits missed")
    if np.isnan(goal).any():
        if len(x) == 1:
            for low, high in _spans(x[0], np.where(np.isnan(goal), -1.0, 1.0), is_discrete=True):
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


def _marks(
    axes: Axes, result: Optimum, shown: DesignSlice, sizes: Sequence[float], x: Sequence[Array], goal: Array
) -> Iterator[Artist]:
    """The design before, the searches and where they ended, where nothing else varies, and the design found."""
    names = [own.name for own in shown.along]
    value = result.value / sizes[-1]

    def at(design: Sequence[float], own: float | None = None) -> list[float]:
        place = [float(v) / size for v, size in zip(design, sizes, strict=False)]
        return place if len(place) == 2 else [place[0], float(np.interp(place[0], x[0], goal)) if own is None else own]

    if not shown.held:
        for k, own in enumerate(result.starts):
            ways = [at([own.start[name] for name in names])]
            if own.end:
                ways.append(at([own.end[name] for name in names], own.value / sizes[-1]))
            line = {"color": WAY, "lw": 0.9, "ls": "--" if len(x) == 2 else "", "gid": f"search {k}", "clip_on": False}
            axes.plot(*np.transpose(ways), marker=".", ms=5, **line)
        if result.starts:
            yield Line2D([], [], color=WAY, lw=0.9, ls="--", marker=".", label="searches, from start to end")
        before = [own.start for own in shown.along]
        if all(own.low <= own.start <= own.high for own in shown.along):
            mark = {"marker": "o", "mfc": "white", "mec": INK, "ms": 6, "ls": ""}
            axes.plot(*at(before), **mark, gid="before", clip_on=False)
            yield Line2D([], [], **mark, label="before")
    mark = {"marker": "*", "mfc": OPTIMUM, "mec": "white", "mew": 0.7, "ms": 13, "ls": ""}
    axes.plot(*at([own.value for own in shown.along], value), **mark, gid="found", clip_on=False, zorder=6)
    found = "optimum" if result.is_feasible else "nearest"
    yield Line2D([], [], **mark, label=f"{found}: {quantity(result.value, result.unit)}")


def _axes(axes: Axes, shown: DesignSlice, x: Sequence[Array], scales: Sequence[Scale], goal: str) -> None:
    """Names, units and round numbers."""
    axes.tick_params(labelsize=8, colors=INK)
    labels = [scale.label(shortened(own.name, 40)) for own, scale in zip(shown.along, scales, strict=True)]
    axes.set_xlabel(labels[0], fontsize=8, parse_math=False)
    axes.set_ylabel(labels[1] if len(x) == 2 else goal, fontsize=8, parse_math=False)
    for own, axis, name, wide in zip(x, (axes.xaxis, axes.yaxis), "xy", shown.by_logarithm, strict=False):
        low, high = float(own[0]), float(own[-1])
        axes.set(**{f"{name}scale": "log" if wide else "linear"})
        if low < high:
            axis.set_view_interval(low, high, ignore=True)
        ticks_within(axis, low, high, logarithmic=wide)
    if len(x) == 1:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high)
        ticks_within(axes.yaxis, low, high)


def _legend(axes: Axes, title: str, entries: Sequence[Artist]) -> None:
    """What is drawn, above it."""
    longest = max(len(str(own.get_label())) for own in entries)
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
