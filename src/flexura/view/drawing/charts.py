"""What all curves have in common: colours, axes in plain numbers, legends beside the curves and never over them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from flexura.view.drawing.annotations import EM, line_height
from flexura.view.drawing.palette import INK
from flexura.view.scene import Array

SERIES = ("#1f5fa8", "#d9541e", "#2c8a4b", "#7a4aa0", "#b8860b", "#0f8b8d", "#a23b57", "#5b6770")
FAINT = "#c9ced6"
CENTRED = {"ha": "center", "va": "center"}

LEAST_SPAN = 10.0
"""Least ratio of the ends of a logarithmic axis of values."""

NAME = 44
"""Characters of a name in a legend."""


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


def shortened(name: str, most: int = NAME) -> str:
    """A name that is too long without its middle."""
    return name if len(name) <= most else f"{name[: most // 2 - 1]} ... {name[-(most - most // 2 - 4) :]}"


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
