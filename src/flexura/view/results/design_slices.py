"""Designs around an optimum: level lines of the goal, or its curve, edges of limits, what misses them, and the way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from flexura.study.optimum import ActiveLimit, DesignSlice, Optimum
from flexura.tables import Scale, quantity, scale_for
from flexura.view.drawing import INK, SERIES, shortened, style, ticks_within
from flexura.view.results.design_maps import HATCHED, draw_levels
from flexura.view.scene import Array

EDGES = (*SERIES[1:], SERIES[0])
"""Colours of the edges of limits, one after another."""

FOUND, WAY = "#c2182b", "#5b6770"

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
    mark = {"marker": "*", "mfc": FOUND, "mec": "white", "mew": 0.7, "ms": 13, "ls": ""}
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
