"""What all charts share: panels, ticks, legends beside the curves, bars, parallel coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike, NDArray

from flexura.charts import WIDE, Panel
from flexura.tables import counted, number, scale_for
from flexura.view.drawing.figures import DPI, EM, INK, new_chart, shortened, wrapped
from flexura.view.scene import Array

SERIES = ("#1f5fa8", "#d9541e", "#2c8a4b", "#7a4aa0", "#b8860b", "#0f8b8d", "#a23b57", "#5b6770")
FAINT = "#c9ced6"
GRID: Mapping[str, Any] = {"color": "#e8ebef", "linewidth": 0.6}

LEAST_SPAN = 10.0
"""Least ratio of the ends of a logarithmic axis of values."""

LEGEND_SIZE = 7.0
"""Size of the type of legends, points."""

_PREFIXED = EngFormatter()


LINES = {"solid": "-", "dashed": "--", "dotted": ":"}


def draw_panel(axes: Axes, panel: Panel, *, width: float = 1.0, size: float = 8.0) -> None:
    """Draw a panel: curves of each name in a colour of their own, lines of a width and labels of a size in points, and
    dots where a curve without markers has a single value between gaps."""
    colours: dict[str | int, str] = {}
    for k, curve in enumerate(panel.curves):
        label = curve.name if curve.name not in colours else ""
        colour = colours.setdefault(curve.name or k, SERIES[len(colours) % len(SERIES)])
        look = {"color": colour, "lw": width, "ls": LINES[curve.line], "label": label or None}
        if curve.upper is not None:
            axes.fill_between(curve.x, curve.y, curve.upper, color=colour, alpha=0.25, lw=0, label=label or None)
        else:
            own = [] if "marker" in curve.style else lone_values(curve.y)
            dots = {"marker": "o", "markersize": 3, "markevery": own} if own else {}
            axes.plot(curve.x, curve.y, **{**look, **dots, **curve.style})
    draw_marks(axes, [mark.x for mark in panel.marks], lw=0.65 * width)
    if panel.y.log:
        axes.set_yscale("log")
    axes.set_xlabel(panel.x.label, fontsize=size, parse_math=False)
    axes.set_ylabel(panel.y.label, fontsize=size, parse_math=False)
    # no power of ten stands above a logarithmic axis, which Matplotlib would look for before it places a title
    axes.set_title(panel.title, fontsize=size, color=INK, parse_math=False, y=1.0 if panel.y.log else None)
    style(axes)


def lone_values(y: NDArray[Any]) -> list[int]:
    """Where values (n,) stand between two gaps."""
    gap = np.isnan(np.concatenate([[np.nan], y, [np.nan]]))
    return np.flatnonzero(gap[:-2] & ~gap[1:-1] & gap[2:]).tolist()


def draw_marks(axes: Axes, places: ArrayLike, **look: Any) -> None:
    """Faint vertical lines behind the curves."""
    for x in np.asarray(places, dtype=float):
        axes.axvline(x, **{"color": FAINT, "zorder": 0} | look)


def panel_grid(
    count: int, shape: tuple[int, int], size: tuple[float, float], dpi: float = DPI, **options: Any
) -> tuple[Figure, list[Axes]]:
    """A chart of so many panels in rows and columns, of a size in inches; `options` of Matplotlib's subplots."""
    figure = new_chart(size, dpi)
    panels = figure.subplots(*shape, squeeze=False, **options).ravel().tolist()
    for axes in panels[count:]:
        axes.set_visible(False)
    return figure, panels[:count]


def style(axes: Axes) -> None:
    """A quiet grid, and no frame above and on the right."""
    axes.grid(True, which="both", **GRID)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8, colors=INK)
    without_frame(axes, "top", "right")


def without_frame(axes: Axes, *sides: str) -> None:
    """No frame on some sides, or on all."""
    for side in sides or axes.spines:
        axes.spines[side].set_visible(False)


def plain(value: float, _: object = None) -> str:
    """A number without an exponent, in thousands (k), millions (M) and so on where it is large."""
    return f"{value:.4g}" if 0.9e-3 < abs(value) < 1e4 or not value else _PREFIXED.format_eng(float(f"{value:.6g}"))


def plain_numbers(axis: Axis) -> None:
    """Plain numbers at the ticks of an axis, and none between them."""
    axis.set_major_formatter(FuncFormatter(plain))
    axis.set_minor_formatter(NullFormatter())


def frequency_axis(axes: Axes, low: float, high: float, room: int = 12) -> None:
    """A logarithmic axis of frequencies, Hz, with plain numbers: 1, 2, 5, 10 and so on, for about `room` of them."""
    axes.set_xscale("log")
    if low < high:
        axes.set_xlim(low, high)
    decades = np.log10(high / low) if low < high else 1.0
    if decades < 0.6:
        ticks_within(axes.xaxis, low, high, min(room, 7))
        return
    subs = (1.0, 2.0, 5.0) if 3 * decades <= room else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=subs, numticks=99))
    plain_numbers(axes.xaxis)


def value_axis(axes: Axes, values: Array) -> None:
    """A logarithmic axis of values (n,), of which those that are positive count, over a decade at least; 1, 2 and 5
    where there are few decades."""
    values = values[np.isfinite(values) & (values > 0)]
    if not len(values):
        return
    low, high = float(values.min()), float(values.max())
    stretch = max(1.0, np.sqrt(LEAST_SPAN * low / high))
    axes.set_yscale("log")
    axes.set_ylim(low / stretch / 1.1, high * stretch * 1.1)
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high / low < 1e3 else (1.0,)))
    plain_numbers(axes.yaxis)


def plain_axes(axes: Axes) -> None:
    """Linear axes without a power of ten that stands for itself."""
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(6))
        axis.set_major_formatter(FuncFormatter(plain))


def ticks_within(axis: Axis, low: float, high: float, room: int = 6, logarithmic: bool = False) -> None:
    """Round numbers between the ends of an axis and none beyond, for about `room` of them."""
    wide = logarithmic and high > 4 * low
    ticks = (LogLocator(subs=(1.0, 2.0, 5.0)) if wide else MaxNLocator(room)).tick_values(low, high)
    axis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    plain_numbers(axis)


def fitted_axis(axis: Axis, low: float, high: float, logarithmic: bool = False) -> None:
    """An axis from `low` to `high`, and round numbers on it."""
    name = "x" if isinstance(axis, XAxis) else "y"
    axis.axes.set(**{f"{name}scale": "log" if logarithmic else "linear"})
    if low < high:
        axis.axes.set(**{f"{name}lim": (low, high)})
    ticks_within(axis, low, high, logarithmic=logarithmic)


def held_axis(axis: Axis) -> None:
    """An axis that ends where it does now, with round numbers on it."""
    low, high = sorted(axis.get_view_interval())
    fitted_axis(axis, low, high)


def named(heading: str) -> tuple[str, str]:
    """A heading of a column as its name and its SI unit, empty without one."""
    name, bracket, unit = heading.rpartition(" [")
    return (name, unit.removesuffix("]")) if bracket and heading.endswith("]") else (heading, "")


def colour_axis(bar: Axes, limits: Normalize, label: str) -> None:
    """Round numbers beside a scale of colours."""
    low, high = float(limits.vmin or 0.0), float(limits.vmax or 0.0)
    ticks_within(bar.yaxis, low, high, logarithmic=isinstance(limits, LogNorm))
    bar.minorticks_off()
    bar.tick_params(labelsize=7, colors=INK)
    bar.set_ylabel(label, fontsize=8, parse_math=False)


def limits_of(values: ArrayLike) -> Normalize:
    """From the lowest to the highest finite value, in equal ratios where they are far apart."""
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values)]
    if not len(values):
        return Normalize(0.0, 1.0)
    low, high = float(values.min()), float(values.max())
    return LogNorm(low, high) if low > 0 and WIDE * low < high else Normalize(low, high)


def legend_above(axes: Axes) -> None:
    """A legend above the curves, where it hides none, in as many columns as there is room for; names are not read as
    mathematics."""
    handles, labels = axes.get_legend_handles_labels()
    if not handles:
        return
    labels = [shortened(label) for label in labels]
    spec, inches = axes.get_subplotspec(), axes.bbox.width / axes.figure.dpi
    if spec is not None:  # the layout is still to come
        inches = 0.86 * axes.figure.bbox.width / axes.figure.dpi / spec.get_gridspec().ncols
    width = 72 * inches / LEGEND_SIZE  # of the axes, in sizes of the type
    columns = int(np.clip(width / (EM * max(map(len, labels)) + 5.0), 1, min(len(labels), 6)))
    legend = axes.legend(
        handles,
        labels,
        fontsize=LEGEND_SIZE,
        frameon=False,
        ncols=columns,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.2,
        columnspacing=1.4,
        handlelength=1.8,
    )
    for text in legend.get_texts():
        text.set_parse_math(False)


def legend_of(figure: Figure, axes: Axes) -> None:
    """One legend for all panels of a figure whose layout is constrained, above them, of what one of them shows."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=LEGEND_SIZE, frameon=False, ncols=6, loc="outside upper left")


def draw_matrix(
    axes: Axes,
    shares: Array,
    texts: NDArray[np.str_] | None,
    labels: tuple[Sequence[str], Sequence[str]],
    *,
    title: str,
    size: float = 7,
    is_signed: bool = False,
) -> None:
    """Draw a matrix (n, m) of shares from 0, or from -1 where it `is_signed`, to 1 as colour, with texts of a size in
    points over them, and labels of rows and columns."""
    low, high, colours = (-1.25, 1.25, "RdBu_r") if is_signed else (0, 1, "Blues")
    axes.imshow(shares, vmin=low, vmax=high, cmap=colours, aspect="auto")
    for (i, j), text in np.ndenumerate(texts) if texts is not None else ():
        colour = "white" if abs(shares[i, j]) > 0.6 * high else INK
        axes.text(j, i, text, ha="center", va="center", size=size, color=colour)
    rows, columns = labels
    axes.set_yticks(range(len(rows)), rows, size=max(size, 5), parse_math=False)
    axes.set_xticks(range(len(columns)), columns, size=max(size, 5), parse_math=False)
    axes.tick_params(length=0, colors=INK)
    axes.set_title(title, size=9, color=INK, parse_math=False)
    without_frame(axes)


RISES, FALLS = "#1f5fa8", "#d9541e"

MOST_BARS = 12
"""Bars of one chart; what is left is added up in one more."""

FAINTEST = 0.005
"""Bars shorter than so much of the longest are added up, too."""


class Bar(NamedTuple):
    """A bar from zero to a value, in the unit of its axis, with what stands at its end; `low` and `high` where the
    value is a range."""

    name: str
    value: float
    text: str
    low: float
    high: float

    @property
    def length(self) -> float:
        """How far it is from zero at most."""
        return max(abs(self.value), abs(self.low), abs(self.high))

    @property
    def spans_zero(self) -> bool:
        """Whether it is on both sides of zero."""
        return self.low < 0 < self.high

    @property
    def points_right(self) -> bool:
        """Whether its text stands on the right."""
        return self.spans_zero or self.value >= 0

    @property
    def end(self) -> float:
        """Where its text stands."""
        return max(self.high, self.value) if self.points_right else min(self.low, self.value)


def percent_bar(name: str, value: float, ends: tuple[float, float]) -> Bar:
    """A bar of per cents, or a range of these, that says its value."""
    low, high = sorted(ends)
    text = _signed(value, "%") if high - low <= 1e-6 * abs(value) else f"{_signed(low, '%')} to {_signed(high, '%')}"
    return Bar(name, value, text, low, high)


def ranked_bars(bars: Sequence[Bar], unit: str = "%") -> list[Bar]:
    """The longest bars, longest first, then all others added up, those that rise and those that fall apart."""
    known = sorted((bar for bar in bars if np.isfinite(bar.value)), key=lambda bar: -bar.length)
    shown = min(sum(bar.length > FAINTEST * known[0].length for bar in known), MOST_BARS)
    if len(known) <= shown + 1:
        return known
    rest = known[shown:]
    up, down = sum(max(bar.value, 0.0) for bar in rest), sum(min(bar.value, 0.0) for bar in rest)
    text = ", ".join(_signed(total, unit) for total in (up, down) if total) or _signed(0.0, unit)
    return [*known[:shown], Bar(f"{counted(len(rest), 'other')}, added up", up or down, text, down, up)]


def draw_bars(axes: Axes, bars: Sequence[Bar], label: str, room_for: int = 0) -> None:
    """Draw bars from above to below, with room for what stands at their ends, and as thick as so many would be."""
    y = -np.arange(len(bars), dtype=float)
    for at, bar in zip(y, bars, strict=True):
        for value in (bar.low, bar.high) if bar.spans_zero else (bar.value,):
            axes.barh(at, value, 0.66, color=RISES if value >= 0 else FALLS)
        if bar.high > bar.low and not bar.spans_zero:
            axes.plot([bar.low, bar.high], [at, at], color=INK, linewidth=1.2, marker="|", markersize=5)
        offset, side = (4, "left") if bar.points_right else (-4, "right")
        text_style = {"textcoords": "offset points", "ha": side, "va": "center", "size": 7, "color": INK}
        axes.annotate(bar.text, (bar.end, at), (offset, 0), **text_style)
    axes.set_yticks(y, [shortened(bar.name, 30) for bar in bars], fontsize=7, parse_math=False)
    axes.axvline(0, color=INK, linewidth=0.8)
    axes.set_xlim(*_bar_limits(axes, bars))
    axes.set_ylim(-max(len(bars), room_for) + 0.4, 0.6)
    ticks_within(axes.xaxis, *axes.get_xlim(), 5)
    axes.set_xlabel(label, fontsize=8)
    axes.tick_params(labelsize=7, colors=INK)
    axes.tick_params(axis="y", length=0)
    axes.grid(True, axis="x", **GRID)
    axes.set_axisbelow(True)
    without_frame(axes, "top", "right", "left")


def _bar_limits(axes: Axes, bars: Sequence[Bar]) -> tuple[float, float]:
    """Ends of an axis on which the bars with their texts have room."""
    spec = axes.get_subplotspec()
    columns = spec.get_gridspec().ncols if spec is not None else 1
    figure = axes.get_figure(root=True)
    inches = SHARE * figure.get_figwidth() / columns if figure is not None else 1.0
    rises = [(bar.end, bar.text) for bar in bars if bar.points_right]
    falls = [(-bar.end, bar.text) for bar in bars if not bar.points_right]
    falls += [(-bar.low, "") for bar in bars if bar.spans_zero]
    left = right = 0.0
    for _ in range(ROUNDS):
        span = (left + right) or max((end for end, _ in rises + falls), default=1.0) or 1.0
        room = span / inches
        right = max((end + room * (GAP + LETTER * len(text)) for end, text in rises), default=0.02 * span)
        left = max((end + room * (GAP + LETTER * len(text)) for end, text in falls), default=0.02 * span)
    return -left, right


SHARE = 0.62
"""Width of the bars of a column over that of the column."""

GAP, LETTER = 0.12, 0.056
"""Inches beside a text, and of a letter."""

ROUNDS = 40
"""A wider axis needs more room for its texts, which converges as long as they are narrower than the axis."""


def _signed(value: float, unit: str) -> str:
    text = number(value, 3)
    return f"{'+' if value > 0 else ''}{text} {unit}".replace("-", "−").strip()


MOST_AXES = 12


class Coordinate(NamedTuple):
    """A quantity of all designs: values (n,) in an SI unit."""

    name: str
    unit: str
    values: Array


def draw_parallel(coordinates: Sequence[Coordinate], coloured_by: Coordinate, dpi: float) -> Figure:
    """A figure of at most twelve parallel coordinates of n designs, each a line over them, from the lowest to the
    highest value; designs that are not finite in one of them pass through its end."""
    shown = coordinates[:MOST_AXES]
    figure = new_chart((max(1.25 * len(shown) + 1.6, 6.5), 4.8), dpi)
    axes = figure.subplots()
    heights = np.array([_heights(coordinate.values) for coordinate in shown]).reshape(len(shown), -1)
    x = np.arange(len(shown), dtype=float)
    order = np.argsort(coloured_by.values, kind="stable")
    lines = [np.column_stack([x, heights[:, k]]) for k in order]
    scale = scale_for(coloured_by.values, coloured_by.unit)
    colours = coloured_by.values / scale.size
    limits = limits_of(colours)
    alpha = float(np.clip(60 / max(len(lines), 1), 0.12, 0.9))
    designs = LineCollection(lines, cmap="viridis", norm=limits, linewidths=1.0, alpha=alpha, gid="designs")
    designs.set_array(np.nan_to_num(colours[order], posinf=limits.vmax, neginf=limits.vmin))
    axes.add_collection(designs)
    text_style = {"ha": "center", "size": 7, "color": INK, "parse_math": False}
    for at, (name, unit, values) in zip(x, shown, strict=True):
        axes.plot([at, at], [0, 1], color=INK, linewidth=0.8)
        own_scale, known = scale_for(values, unit), values[np.isfinite(values)]
        if len(known):
            axes.text(at, -0.03, number(float(known.min()) / own_scale.size, 4), va="top", **text_style)
            axes.text(at, 1.03, number(float(known.max()) / own_scale.size, 4), va="bottom", **text_style)
        axes.text(at, 1.11, "\n".join(wrapped(own_scale.label(name), 1.15, 7, 3)), va="bottom", **text_style)
    axes.set(xlim=(-0.5, len(shown) - 0.5), ylim=(-0.1, 1.36))
    axes.set_axis_off()
    bar = figure.colorbar(ScalarMappable(limits, "viridis"), ax=axes, fraction=0.03, pad=0.02)
    colour_axis(bar.ax, limits, scale.label(coloured_by.name))
    return figure


def _heights(values: Array) -> Array:
    """Values as parts of the way from the lowest to the highest."""
    known = values[np.isfinite(values)]
    if not len(known) or not np.ptp(known) > 0:
        return np.full(len(values), 0.5)
    part = (values - known.min()) / np.ptp(known)
    return np.clip(np.nan_to_num(part, nan=0.5, posinf=1.0, neginf=0.0), 0.0, 1.0)
