"""What all charts share: curves and axes as data, ticks, legends beside the curves, bars, parallel coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike

from flexura.tables import counted, number, scale_for
from flexura.view.drawing.figures import EM, INK, line_height, new_chart, shortened, wrapped
from flexura.view.scene import Array

SERIES = ("#1f5fa8", "#d9541e", "#2c8a4b", "#7a4aa0", "#b8860b", "#0f8b8d", "#a23b57", "#5b6770")
FAINT = "#c9ced6"
CENTRED = {"ha": "center", "va": "center"}

LEAST_SPAN = 10.0
"""Least ratio of the ends of a logarithmic axis of values."""


_PREFIXED = EngFormatter()


def style(axes: Axes) -> None:
    """A quiet grid, and no frame above and on the right."""
    axes.grid(True, which="both", color="#e8ebef", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8, colors=INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def plain(value: float, _: object = None) -> str:
    """A number without an exponent, in thousands (k), millions (M) and so on where it is large."""
    return f"{value:.4g}" if 0.9e-3 < abs(value) < 1e4 or not value else _PREFIXED.format_eng(float(f"{value:.6g}"))


def frequency_axis(axes: Axes, low: float, high: float, room: int = 12) -> None:
    """A logarithmic axis of frequencies, Hz, with plain numbers: 1, 2, 5, 10 and so on, for about `room` of them."""
    axes.set_xscale("log")
    if low < high:
        axes.set_xlim(low, high)
    decades = np.log10(high / low) if low < high else 1.0
    if decades < 0.6:
        ticks = MaxNLocator(min(room, 7)).tick_values(low, high)
        axes.xaxis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    else:
        subs = (1.0, 2.0, 5.0) if 3 * decades <= room else (1.0,)
        axes.xaxis.set_major_locator(LogLocator(subs=subs, numticks=99))
    axes.xaxis.set_major_formatter(FuncFormatter(plain))
    axes.xaxis.set_minor_formatter(NullFormatter())


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
    few = high / low < 1e3
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axes.yaxis.set_major_formatter(FuncFormatter(plain))
    axes.yaxis.set_minor_formatter(NullFormatter())


def plain_axes(axes: Axes) -> None:
    """Linear axes without a power of ten that stands for itself."""
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(6))
        axis.set_major_formatter(FuncFormatter(plain))


def legend_above(axes: Axes, size: float = 7.0) -> None:
    """A legend above the curves, where it hides none, in as many columns as there is room for; names are not read as
    mathematics."""
    handles, labels = axes.get_legend_handles_labels()
    if not handles:
        return
    labels = [shortened(label) for label in labels]
    spec, inches = axes.get_subplotspec(), axes.bbox.width / axes.figure.dpi
    if spec is not None:  # the layout is still to come
        inches = 0.86 * axes.figure.bbox.width / axes.figure.dpi / spec.get_gridspec().ncols
    width = 72 * inches / size  # of the axes, in sizes of the type
    columns = int(np.clip(width / (EM * max(map(len, labels)) + 5.0), 1, min(len(labels), 6)))
    own = axes.legend(
        handles,
        labels,
        fontsize=size,
        frameon=False,
        ncols=columns,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.2,
        columnspacing=1.4,
        handlelength=1.8,
    )
    for text in own.get_texts():
        text.set_parse_math(False)


def legend_of(figure: Figure, axes: Axes, size: float = 7.0) -> None:
    """One legend for all panels of a figure whose layout is constrained, above them, of what one of them shows."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=size, frameon=False, ncols=6, loc="outside upper left")


def headline(figure: Figure, title: str) -> None:
    """A title over all axes, which is not read as mathematics."""
    figure.suptitle(shortened(title, 90), fontsize=10, color=INK, parse_math=False)


def written_below(figure: Figure, lines: list[str], size: float = 7.0, colour: str = INK) -> None:
    """Lines of text along the lower edge of a figure whose layout is constrained, above what is there already."""
    if not lines:
        return
    engine = figure.get_layout_engine()
    assert engine is not None
    left, bottom, width, height = engine.get()["rect"]  # type: ignore[index]
    gap = 0.05 / figure.get_figheight()
    own = len(lines) * line_height(figure, size) + 2 * gap
    engine.set(rect=(left, bottom + own, width, height - own))  # type: ignore[call-arg]
    style = {"va": "bottom", "size": size, "color": colour, "linespacing": 1.35, "parse_math": False}
    figure.text(0.015, bottom + gap, "\n".join(lines), **style)


def named(heading: str) -> tuple[str, str]:
    """A heading of a column as its name and its SI unit, empty without one."""
    name, bracket, unit = heading.rpartition(" [")
    return (name, unit.removesuffix("]")) if bracket and heading.endswith("]") else (heading, "")


def ticks_within(axis: Axis, low: float, high: float, room: int = 6, logarithmic: bool = False) -> None:
    """Round numbers between the ends of an axis and none beyond, for about `room` of them."""
    wide = logarithmic and high > 4 * low
    ticks = (
        LogLocator(subs=(1.0, 2.0, 5.0)).tick_values(low, high) if wide else MaxNLocator(room).tick_values(low, high)
    )
    axis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    axis.set_major_formatter(FuncFormatter(plain))
    axis.set_minor_formatter(NullFormatter())


def colour_axis(bar: Axes, limits: Normalize, label: str) -> None:
    """Round numbers beside a scale of colours."""
    low, high = float(limits.vmin or 0.0), float(limits.vmax or 0.0)
    ticks_within(bar.yaxis, low, high, logarithmic=isinstance(limits, LogNorm))
    bar.minorticks_off()
    bar.tick_params(labelsize=7, colors=INK)
    bar.set_ylabel(label, fontsize=8, parse_math=False)


def limits_of(values: ArrayLike) -> Normalize:
    """From the lowest to the highest finite value, in equal ratios where they are far apart."""
    own = np.asarray(values, dtype=float)
    own = own[np.isfinite(own)]
    if not len(own):
        return Normalize(0.0, 1.0)
    low, high = float(own.min()), float(own.max())
    return LogNorm(low, high) if low > 0 and WIDE * low < high else Normalize(low, high)


WIDE = 30.0
"""Ratio of positive values from which their scale is logarithmic."""


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


def bar(name: str, value: float, unit: str = "%", ends: tuple[float, float] | None = None) -> Bar:
    """A bar that says its value."""
    low, high = sorted(ends) if ends else (value, value)
    text = _signed(value, unit) if high - low <= 1e-6 * abs(value) else f"{_signed(low, unit)} to {_signed(high, unit)}"
    return Bar(name, value, text, low, high)


def ranked(bars: Sequence[Bar], unit: str = "%") -> list[Bar]:
    """The longest bars, longest first, then all others added up, those that rise and those that fall apart."""
    known = sorted((own for own in bars if np.isfinite(own.value)), key=lambda own: -_reach(own))
    seen = sum(_reach(own) > FAINTEST * _reach(known[0]) for own in known)
    shown = min(seen, MOST_BARS)
    if len(known) <= shown + 1:
        return known
    rest = known[shown:]
    up, down = sum(max(own.value, 0.0) for own in rest), sum(min(own.value, 0.0) for own in rest)
    text = ", ".join(_signed(own, unit) for own in (up, down) if own) or _signed(0.0, unit)
    return [*known[:shown], Bar(f"{counted(len(rest), 'other')}, added up", up or down, text, down, up)]


def _reach(own: Bar) -> float:
    return max(abs(own.value), abs(own.low), abs(own.high))


def draw_bars(axes: Axes, bars: Sequence[Bar], label: str, room_for: int = 0) -> None:
    """Draw bars from above to below, with room for what stands at their ends, and as thick as so many would be."""
    y = -np.arange(len(bars), dtype=float)
    for at, own in zip(y, bars, strict=True):
        spans_zero = own.low < 0 < own.high
        for value in (own.low, own.high) if spans_zero else (own.value,):
            axes.barh(at, value, 0.66, color=RISES if value >= 0 else FALLS)
        if own.high > own.low and not spans_zero:
            axes.plot([own.low, own.high], [at, at], color=INK, linewidth=1.2, marker="|", markersize=5)
        right = spans_zero or own.value >= 0
        end = own.high if right else own.low
        axes.annotate(
            own.text,
            (max(end, own.value) if right else min(end, own.value), at),
            (4 if right else -4, 0),
            textcoords="offset points",
            ha="left" if right else "right",
            va="center",
            size=7,
            color=INK,
        )
    axes.set_yticks(y, [shortened(own.name, 30) for own in bars], fontsize=7, parse_math=False)
    axes.axvline(0, color=INK, linewidth=0.8)
    axes.set_xlim(*_ends(axes, bars))
    axes.set_ylim(-max(len(bars), room_for) + 0.4, 0.6)
    ticks_within(axes.xaxis, *axes.get_xlim(), 5)
    axes.set_xlabel(label, fontsize=8)
    axes.tick_params(labelsize=7, colors=INK)
    axes.grid(True, axis="x", color="#e8ebef", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.tick_params(axis="y", length=0)


def _ends(axes: Axes, bars: Sequence[Bar]) -> tuple[float, float]:
    """Ends of an axis on which the bars with their texts have room."""
    spec = axes.get_subplotspec()
    columns = spec.get_gridspec().ncols if spec is not None else 1
    figure = axes.get_figure(root=True)
    inches = SHARE * figure.get_figwidth() / columns if figure is not None else 1.0
    rises = [(max(own.high, own.value), own.text) for own in bars if own.value >= 0 or own.low < 0 < own.high]
    falls = [(-min(own.low, own.value), own.text) for own in bars if own.value < 0 and not own.low < 0 < own.high]
    falls += [(-own.low, "") for own in bars if own.low < 0 < own.high]
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
