"""Bars about zero, the longest first: what rises to the right, what falls to the left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from flexura.tables import counted, number
from flexura.view.drawing.charts import shortened
from flexura.view.drawing.palette import INK
from flexura.view.drawing.scales import ticks_within

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
