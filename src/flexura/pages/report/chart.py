"""A chart as pages have it: as data for their script, and as SVG for before that runs and for print."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.charts import Axis, Chart, Curve, Mark, Panel
from flexura.results import plain

ANGLES = (1, 2, 5, 10, 15, 30, 45, 90, 180, 360)
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
PLAIN = (1e-3, 1e4)
"""Between these numbers of logarithmic axes are plain; the script of pages has the same."""
TINY = 1e-300
"""Smaller numbers, such as round-off of a force that is zero, are drawn as zero: parts of their range underflow."""
LONG = 1e6
"""Up to here those of even axes are."""


@dataclass(frozen=True)
class Scale:
    """An axis from `low` to `high`, which lie at `start` and `end` on the paper."""

    low: float
    high: float
    log: bool
    start: float
    end: float

    def __call__(self, values: Array) -> Array:
        """Where values lie; NaN for those that a logarithmic axis cannot show."""
        x = np.asarray(values, dtype=float)
        with np.errstate(all="ignore"):
            if self.log:
                share = np.log(x / self.low) / math.log(self.high / self.low)
            else:
                share = (x - self.low) / (self.high - self.low)
        return self.start + np.where(np.isfinite(share), share, np.nan) * (self.end - self.start)


def ends(values: Array, log: bool, unit: str) -> tuple[float, float]:
    """Ends on round numbers that hold all finite values, on a logarithmic axis the positive ones."""
    values = np.where(np.abs(values) < TINY, 0.0, values)
    shown = values[np.isfinite(values) & ((values > 0) | (not log))]
    if not len(shown):
        return (0.1, 10.0) if log else (-1.0, 1.0)
    low, high = float(shown.min()), float(shown.max())
    if log:
        stretch = max(1.0, math.sqrt(10 * low / high))
        return _below(low / stretch / 1.05), _above(high * stretch * 1.05)
    flat = max(abs(low), abs(high)) or 1.0
    spread = high - low if high - low > 1e-9 * flat else 0.2 * flat
    middle, step = (low + high) / 2, _step(1.1 * spread, 5, unit)
    return step * math.floor((middle - 0.52 * spread) / step), step * math.ceil((middle + 0.52 * spread) / step)


def ticks(low: float, high: float, log: bool, most: float, unit: str = "") -> list[tuple[float, str]]:
    """Ticks with their text, about `most` of them."""
    most = max(2.0, most)
    if log and high / low >= 4:
        return _logarithmic(low, high, most)
    step = _step(high - low, most, unit)
    return [
        (k * step, _tick_text(k * step, step))
        for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    ]


def _step(span: float, most: float, unit: str) -> float:
    """A step of 1, 2 or 5 times a power of ten, or of usual angles."""
    if unit == "deg" and span > 10:
        return next((step for step in ANGLES if span / step <= most), 360 * math.ceil(span / 360 / most))
    ten = 10.0 ** math.floor(math.log10(span / most))
    return ten * next((factor for factor in (1, 2, 5) if span / (factor * ten) <= most), 10)


def _logarithmic(low: float, high: float, most: float) -> list[tuple[float, str]]:
    decades = math.log10(high / low)
    within = (1, 2, 5) if 3 * decades <= most else (1,)
    every = max(1, math.ceil(decades / most))
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    found = [(factor, power) for power in exponents if power % every == 0 for factor in within]
    return [
        (factor * 10.0**power, _plain(factor * 10.0**power, PLAIN[1] * (1 + 1e-9)))
        for factor, power in found
        if low * (1 - 1e-9) <= factor * 10.0**power <= high * (1 + 1e-9)
    ]


def _plain(value: float, most: float) -> str:
    """A plain number of six digits, or one with a power of ten where it is more than `most` or very small."""
    if value == 0 or PLAIN[0] * (1 - 1e-9) <= abs(value) < most:
        return f"{float(f'{value:.6g}'):.12g}"
    factor, power = f"{value:.5e}".split("e")
    factor = factor.rstrip("0").rstrip(".")
    return ("" if factor == "1" else f"{factor}·") + "10" + str(int(power)).translate(SUPERSCRIPTS)


def _tick_text(value: float, step: float) -> str:
    if abs(value) < 1e-9 * step:
        return "0"
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    return f"{value:.{digits}f}" if digits <= 4 and abs(value) < LONG else _plain(value, LONG)


def _below(value: float) -> float:
    ten = 10.0 ** math.floor(math.log10(value))
    return ten * (5 if value / ten >= 5 else 2 if value / ten >= 2 else 1)


def _above(value: float) -> float:
    ten = 10.0 ** math.floor(math.log10(value))
    return ten * next((factor for factor in (1, 2, 5) if value / ten <= factor), 10)


@dataclass(frozen=True)
class Point:
    """A point of a scatter with the number that stands in it and where it leads to; it `meets` all, or not."""

    x: float
    y: float
    number: int
    link: str
    title: str
    meets: bool


@dataclass(frozen=True)
class Scatter:
    """Points over two axes, with a line through those that are `best`, and what is said of them to those who do not
    see them."""

    title: str
    description: str
    x: Axis
    y: Axis
    points: Sequence[Point]
    best: Sequence[Point]


COLOURS = ("#1f5fa8", "#c8460f", "#217a3f", "#7a4aa0", "#8a6a00", "#0a7577", "#a23b57", "#5b6770")
INK, SOFT, LINE = "#22262b", "#5a626c", "#d5d9de"
WIDTH, RIGHT = 760, 14
TALL, LOW = 210, 120
"""Heights of the first panel and of others."""
ROW, ROWS = 15, 3
"""Height of a line of text, and rows of labels above the first panel."""
CHARACTER = 6.2
"""Width of a character, on average."""
DASHES = {"solid": "", "dashed": ' stroke-dasharray="6 4"', "dotted": ' stroke-dasharray="1.5 3"'}
STYLES = {"solid": "line", "dashed": "pinned", "dotted": "bound"}
"""What the script calls lines."""
DIGITS = 7
"""Significant digits of the values in a page."""


def chart_data(chart: Chart) -> dict[str, Any]:
    """What the script takes of a chart; None where there is no value."""
    first = chart.panels[0]
    axis = {"label": first.x.quantity, "unit": first.x.unit, "log": first.x.log, "values": _short(chart.x)}
    panels = [
        {"label": own.y.quantity, "unit": own.y.unit, "log": own.y.log, "curves": [*map(_curve_data, own.curves)]}
        for own in chart.panels
    ]
    panels[0]["marks"] = [{"x": own.x, "label": own.label, "short": own.short} for own in first.marks]
    return {"id": chart.id, "title": chart.title, "description": chart.description, "x": axis, "panels": panels}


def _curve_data(curve: Curve) -> dict[str, Any]:
    if curve.upper is not None:
        return {"name": curve.name, "values": _short(curve.y), "style": "bound", "upper": _short(curve.upper)}
    return {"name": curve.name, "values": _short(curve.y), "style": STYLES[curve.line]}


def _short(values: Array) -> list[Any]:
    return plain(np.array([float(f"{value:.{DIGITS}g}") for value in values]))


def chart_svg(chart: Chart) -> str:
    """The chart as one SVG element, on paper of its own, with its legend below."""
    names = list(dict.fromkeys(curve.name for panel in chart.panels for curve in panel.curves))
    colours = {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(names)}
    heights = [TALL if k == 0 else LOW for k in range(len(chart.panels))]
    spans = [ends(_values(panel), panel.y.log, panel.y.unit) for panel in chart.panels]
    y_ticks = [
        ticks(*span, panel.y.log, height / 26, panel.y.unit)
        for span, panel, height in zip(spans, chart.panels, heights, strict=True)
    ]
    left = max([20.0, *(CHARACTER * len(text) for own in y_ticks for _, text in own)]) + 12
    along, marks = chart.panels[0].x, chart.panels[0].marks
    x = Scale(float(chart.x[0]), float(chart.x[-1]), along.log, left, WIDTH - RIGHT)
    parts, top, boxes = [], 0.0, list[tuple[float, float]]()
    for k, (panel, height, span, own) in enumerate(zip(chart.panels, heights, spans, y_ticks, strict=True)):
        title_at = top + ROW - 4
        top += ROW + 5 + (ROWS * ROW + 4 if k == 0 and marks else 0)
        y = Scale(*span, panel.y.log, top + height, top)
        boxes.append((top, top + height))
        parts += [_text(left, title_at, panel.y.label, INK), *_grid(own, y, left)]
        parts += [_curve(curve, x, y, colours[curve.name]) for curve in panel.curves]
        parts.append(f'<path d="M{left:.1f},{top:.1f}V{top + height:.1f}H{WIDTH - RIGHT}" stroke="{SOFT}"/>')
        top += height + 6
    bottom = boxes[-1][1]
    parts += _x_axis(along, x, boxes, bottom)
    parts += _marks(marks, x, boxes)
    below = bottom + 50
    parts += _legend(colours, below)
    height = below + ROW * -(-len(names) // 2)
    return (
        f'<svg class="chart-static" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0f}" role="img"'
        f' aria-label="{escape(f"{chart.title}. {chart.description}")}" font-family="system-ui, sans-serif"'
        f' font-size="11" fill="none"><rect width="{WIDTH}" height="{height:.0f}" fill="#ffffff"/>'
        + "".join(parts)
        + "</svg>"
    )


def _values(panel: Panel) -> Array:
    own = [values for curve in panel.curves for values in (curve.y, curve.upper) if values is not None]
    return np.concatenate([np.empty(0), *own])


def _text(x: float, y: float, text: str, colour: str = SOFT, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" text-anchor="{anchor}">{escape(text)}</text>'


def _grid(own: Sequence[tuple[float, str]], y: Scale, left: float) -> list[str]:
    at = y(np.array([value for value, _ in own]))
    lines = "".join(f"M{left:.1f},{own_y:.1f}H{WIDTH - RIGHT}" for own_y in at)
    texts = [_text(left - 6, own_y + 4, text, anchor="end") for own_y, (_, text) in zip(at, own, strict=True)]
    return [f'<path d="{lines}" stroke="{LINE}" stroke-width="0.7"/>', *texts]


def _x_axis(along: Axis, x: Scale, boxes: Sequence[tuple[float, float]], bottom: float) -> list[str]:
    own = ticks(x.low, x.high, x.log, (x.end - x.start) / 60, along.unit)
    at = x(np.array([value for value, _ in own]))
    lines = "".join(f"M{own_x:.1f},{top:.1f}V{low:.1f}" for own_x in at for top, low in boxes)
    texts = [_text(own_x, bottom + ROW, text, anchor="middle") for own_x, (_, text) in zip(at, own, strict=True)]
    title = _text((x.start + x.end) / 2, bottom + 32, along.label, INK, "middle")
    return [f'<path d="{lines}" stroke="{LINE}" stroke-width="0.7"/>', *texts, title]


def _curve(curve: Curve, x: Scale, y: Scale, colour: str) -> str:
    px, py = x(curve.x), np.clip(y(curve.y), -1e4, 1e4)
    if curve.upper is not None:
        there = [f"{a:.1f},{b:.1f}" for a, b in zip(px, y(curve.upper), strict=True) if np.isfinite(b)]
        low = np.where(np.isfinite(py), py, y.start)
        back = [f"{a:.1f},{b:.1f}" for a, b, c in zip(px, low, y(curve.upper), strict=True) if np.isfinite(c)]
        return f'<path d="M{"L".join([*there, *back[::-1]])}Z" fill="{colour}" fill-opacity="0.18"/>' if there else ""
    good = np.isfinite(px) & np.isfinite(py)
    steps = ["M" if not before else "L" for before in [False, *good[:-1]]]
    points = [f"{step}{a:.1f},{b:.1f}" for step, a, b, own in zip(steps, px, py, good, strict=True) if own]
    return f'<path d="{"".join(points)}" stroke="{colour}" stroke-width="1.5"{DASHES[curve.line]}/>'


def _marks(marks: Sequence[Mark], x: Scale, boxes: Sequence[tuple[float, float]]) -> list[str]:
    """Lines of marks through all panels, with labels above, short ones where these leave room for more."""
    inside = sorted((own for own in marks if x.low <= own.x <= x.high), key=lambda own: own.x)
    at = [float(own) for own in x(np.array([own.x for own in inside]))]
    long = _rows([(own.label, own.short) for own in inside], at)
    short = long if None not in long else _rows([(own.short or own.label,) for own in inside], at)
    lines, found = "", []
    for own_x, placed in zip(at, short if short.count(None) < long.count(None) else long, strict=True):
        lines += "".join(f"M{own_x:.1f},{top:.1f}V{bottom:.1f}" for top, bottom in boxes)
        if placed is not None:
            row, text = placed
            base = boxes[0][0] - 5 - row * ROW
            lines += f"M{own_x:.1f},{boxes[0][0]:.1f}V{base + 2:.1f}"
            found.append(_text(own_x + 2, base, text))
    return [f'<path d="{lines}" stroke="{SOFT}" stroke-width="0.8" stroke-dasharray="2 3"/>', *found] if inside else []


def _rows(texts: Sequence[Sequence[str]], at: Sequence[float]) -> list[tuple[int, str] | None]:
    """Row and text of every label, the first of its texts that has room, from the right: none over another or over a
    line to one; None without room."""
    starts = [float(WIDTH)] * ROWS
    found: list[tuple[int, str] | None] = []
    for own, x in zip(reversed(texts), reversed(at), strict=True):
        rooms = (
            (row, text)
            for text in own
            for row in range(ROWS)
            if text and x + CHARACTER * len(text) + 6 <= starts[row] and all(b >= x for b in starts[:row])
        )
        placed = next(rooms, None)
        found.append(placed)
        if placed is not None:
            starts[: placed[0] + 1] = [x] * (placed[0] + 1)
    return found[::-1]


def _legend(colours: dict[str, str], top: float) -> list[str]:
    """Names in two columns below the plot, each cut to its column."""
    most = int((WIDTH / 2 - 50) / CHARACTER)
    found = []
    for k, (name, colour) in enumerate(colours.items()):
        x, y = 12 + (k % 2) * WIDTH / 2, top + ROW * (k // 2)
        shown = name if len(name) <= most else f"{name[: most - 1]}…"
        found += [
            f'<path d="M{x:.1f},{y - 4:.1f}h22" stroke="{colour}" stroke-width="2"/>',
            _text(x + 28, y, shown, INK),
        ]
    return found


SIDE, BASE, DOT = 400, 300, 8.5
"""Width and height of a scatter without its labels, and radius of its points."""


def scatter_svg(own: Scatter) -> str:
    """A scatter as one SVG element in the colours of its page: points are links, filled where they meet all."""
    shown = [each for each in own.points if math.isfinite(each.x) and math.isfinite(each.y)]
    along, up = (
        Scale(*ends(np.array(values), axis.log, axis.unit), axis.log, start, end)
        for values, axis, start, end in (
            ([each.x for each in shown], own.x, 52.0, SIDE - 12.0),
            ([each.y for each in shown], own.y, BASE - 40.0, 24.0),
        )
    )
    at = {each.number: (float(along(np.array(each.x))), float(up(np.array(each.y)))) for each in shown}
    parts = [f'<text x="8" y="12">{escape(own.y.label)}</text>']
    for value, text in ticks(up.low, up.high, up.log, 6, own.y.unit):
        y = float(up(np.array(value)))
        parts.append(f'<path d="M{along.start},{y:.1f}H{along.end}"/>{_tick(along.start - 5, y + 4, text, "end")}')
    for value, text in ticks(along.low, along.high, along.log, 5, own.x.unit):
        x = float(along(np.array(value)))
        parts.append(f'<path d="M{x:.1f},{up.start}V{up.end}"/>{_tick(x, up.start + 16, text, "middle")}')
    parts.append(_tick((along.start + along.end) / 2, BASE - 6, own.x.label, "middle"))
    line = "L".join(f"{x:.1f},{y:.1f}" for x, y in (at[each.number] for each in own.best if each in shown))
    parts.append(f'<path class="best" d="M{line}"/>' if line else "")
    for each in reversed(shown):
        x, y = at[each.number]
        kind = " ".join(["dot", *["meets"] * each.meets, *["best"] * (each in own.best)])
        parts.append(
            f'<a href="#{escape(each.link)}" class="{kind}"><title>{escape(each.title)}</title>'
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{DOT}"/>{_tick(x, y + 3.5, str(each.number), "middle")}</a>'
        )
    return (
        f'<svg class="scatter" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIDE} {BASE}" role="group"'
        f' aria-label="{escape(f"{own.title}. {own.description}")}">{"".join(parts)}</svg>'
    )


def _tick(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
