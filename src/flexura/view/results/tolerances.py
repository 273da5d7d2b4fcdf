"""What parameters do: scatter and shares of its variance, per cents of each, and what a calibration makes of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.arguments import verb
from flexura.errors import foremost
from flexura.study.influence import Sensitivity
from flexura.study.tolerances import QuantitySpread, Tolerance, Yield
from flexura.tables import Scale, number, quantity, scale_for
from flexura.testing.updating import Calibration
from flexura.thresholds import ROUND_OFF
from flexura.view.drawing import (
    DPI,
    FAINT,
    INK,
    MOST_BARS,
    Bar,
    draw_bars,
    headline,
    new_chart,
    panel_grid,
    percent_bar,
    ranked_bars,
    shortened,
    style,
    ticks_within,
    without_frame,
)
from flexura.view.mechanisms import save_figures
from flexura.view.scene import Array

TOTAL, FIRST, LIMIT = "#9db9dc", "#1f5fa8", "#c2182b"
"""Colours of shares of the variance with all interactions and alone, and of limits."""

BEFORE, AFTER = "#c9ced6", "#1f5fa8"
"""Colours of what is known before a calibration, and after it."""

MOST_ROWS = 4
"""Quantities of a picture of tolerances."""

MOST_PANELS = 6
"""Quantities of a picture of sensitivities."""


@verb
def save_tolerance(result: Tolerance, folder: Path | str, *, dpi: float = DPI) -> list[Path]:
    """Write the picture of `draw_tolerance` as `tolerance.png`. Raises OptionError when the folder cannot be written
    to."""
    return save_figures({"tolerance.png": draw_tolerance(result, dpi=dpi)}, folder)


@verb
def draw_tolerance(result: Tolerance, *, dpi: float = DPI) -> Figure:
    """Draw each of the first four quantities: a histogram of the samples, the share of parts that have at least so much
    with its interval, and what share of the variance each tolerance answers for, alone and with all others.

    A dashed line is the nominal design, red ones are limits of what is required, with their yields. dpi as in
    `draw_mechanism`. Returns a Figure.
    """

    shown = result.quantities[:MOST_ROWS]
    slots = min(len(result.tolerances), MOST_BARS + 1)
    figure = new_chart((11.0, max(2.5, 1.3 + 0.19 * slots) * len(shown) + 0.7), dpi)
    panels = figure.subplots(len(shown), 3, squeeze=False, width_ratios=(1.0, 1.1, 1.0))
    for spread, (left, middle, right) in zip(shown, panels, strict=True):
        limits, share = result.yield_curve(spread.text)
        scale = scale_for([*limits, spread.nominal], spread.unit)
        label = scale.label(shortened(spread.text, 44))
        title = f"nominal {scale.text(spread.nominal)}" if np.isfinite(spread.nominal) else ""
        left.set_title(title, fontsize=8, loc="left")
        if not len(limits) or not np.ptp(limits) > ROUND_OFF * np.abs(limits).max():
            _leave_empty((left, middle, right), label, "does not scatter" if len(limits) else "no sample has a value")
            continue
        required = [one for one in result.yields if one.quantity == spread.text]
        _draw_histogram(left, result, spread.text, scale)
        _draw_yields(middle, result, spread.text, limits, share=share, scale=scale)
        low, high = _ends(limits, spread.nominal, required)
        for axes in (left, middle):
            _draw_limits(axes, spread, required, scale, ends=(low, high))
            axes.set_xlabel(label, fontsize=8, parse_math=False)
        texts = "\n".join(map(_yield_text, required))
        middle.set_title(texts, fontsize=7, color=LIMIT, loc="left", parse_math=False)
        _draw_shares(right, result, spread.text, slots)
    more = len(result.quantities) - len(shown)
    title = f"{result.name}: {len(result.sizes)} independent sizes, {result.samples} samples"
    notes = [f"{more} more quantities are not drawn"] if more else []
    headline(figure, title, foremost(result.warnings, 1), notes)
    return figure


def _draw_histogram(axes: Axes, result: Tolerance, text: str, scale: Scale) -> None:
    edges, counts = result.histogram(text)
    high = 1.08 * float(counts.max())
    axes.stairs(counts, edges / scale.size, fill=True, color=TOTAL, gid="histogram")
    axes.set_ylim(0, high)
    ticks_within(axes.yaxis, 0, high, 4)
    axes.set_ylabel("samples", fontsize=8)


def _draw_yields(axes: Axes, result: Tolerance, text: str, limits: Array, *, share: Array, scale: Scale) -> None:
    low, high = result.yield_interval(text, limits)
    axes.fill_between(limits / scale.size, 100 * low, 100 * high, color=FIRST, alpha=0.25, lw=0, gid="interval")
    axes.plot(limits / scale.size, 100 * share, color=FIRST, lw=1.4, gid="yield")
    axes.set_ylim(0, 104)
    ticks_within(axes.yaxis, 0, 100, 5)
    axes.set_ylabel("parts with at least so much, %", fontsize=8)


def _ends(limits: Array, nominal: float, required: Sequence[Yield]) -> tuple[float, float]:
    """Ends of the axis of a quantity, SI, on which the limits stand that are not far off."""
    low, high = float(limits[0]), float(limits[-1])
    span = high - low
    candidates = [nominal, *(one.limit for one in required if one.limit is not None)]
    near = [value for value in candidates if np.isfinite(value) and low - span < value < high + span]
    low, high = min([low, *near]), max([high, *near])
    return low - 0.03 * (high - low), high + 0.03 * (high - low)


def _draw_limits(
    axes: Axes, spread: QuantitySpread, required: Sequence[Yield], scale: Scale, *, ends: tuple[float, float]
) -> None:
    """The nominal value and the limits on an axis with such ends, SI."""
    if np.isfinite(spread.nominal):
        axes.axvline(spread.nominal / scale.size, color=INK, lw=0.9, ls="--", gid="nominal")
    for one in required:
        if one.limit is not None and ends[0] <= one.limit <= ends[1]:
            axes.axvline(one.limit / scale.size, color=LIMIT, lw=1.2, gid="limit")
    low, high = (end / scale.size for end in ends)
    axes.set_xlim(low, high)
    ticks_within(axes.xaxis, low, high, 5)
    style(axes)


def _yield_text(one: Yield) -> str:
    """A requirement with its yield."""
    low, value, high = (number(100 * share, 4) for share in (one.share.low, one.share.value, one.share.high))
    return f"{shortened(one.text)}: {value} % of parts ({low} to {high})"


def _draw_shares(axes: Axes, result: Tolerance, text: str, slots: int) -> None:
    """Shares of the variance by tolerance: wide bars with all interactions, narrow ones alone."""
    k = [spread.text for spread in result.quantities].index(text)
    indices, names = result.indices, list(result.influence(text))
    if indices is None:
        _leave_empty((axes,), "", "no shares of the variance were asked for")
        return
    shown = names[:MOST_BARS]
    y = -np.arange(len(shown), dtype=float)
    rows = [result.tolerances.index(name) for name in shown]
    total, half_width, first = (100 * shares[rows, k] for shares in (indices.total, indices.total_half, indices.first))
    ends = np.nan_to_num(total + half_width, nan=0.0)
    axes.barh(y, total, 0.7, color=TOTAL, label="with all others", gid="total")
    axes.barh(y, np.maximum(first, 0.0), 0.32, color=FIRST, label="alone", gid="first")
    axes.hlines(y, np.maximum(total - half_width, 0.0), total + half_width, color=INK, lw=0.8, gid="interval")
    for at, end, value, half in zip(y, ends, total, half_width, strict=True):
        share = f"{number(value, 3)} ± {number(half, 2)} %" if np.isfinite(value) else "unknown"
        axes.annotate(share, (end, at), (4, 0), textcoords="offset points", va="center", size=7, color=INK)
    axes.set_yticks(y, [shortened(name, 26) for name in shown], fontsize=7, parse_math=False)
    high = 1.55 * max(float(ends.max(initial=0.0)), 1.0)
    axes.set_xlim(0, high)
    axes.set_ylim(-slots + 0.4, 0.6)
    more = len(names) - len(shown)
    axes.set_xlabel("share of the variance, %" + (f"; {more} more answer for less" if more else ""), fontsize=8)
    style(axes)
    axes.tick_params(axis="y", length=0, labelsize=7)
    ticks_within(axes.xaxis, 0, min(high, 100.0), 5)
    axes.legend(fontsize=7, frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1)


def _leave_empty(panels: Sequence[Axes], label: str, reason: str) -> None:
    """Panels of what there is nothing to draw of."""
    for axes in panels:
        axes.set(xticks=[], yticks=[])
        for spine in axes.spines.values():
            spine.set_color(FAINT)
    panels[0].set_xlabel(label, fontsize=8, parse_math=False)
    panels[0].text(0.5, 0.5, reason, size=8, color=INK, ha="center", va="center", transform=panels[0].transAxes)


@verb
def save_sensitivity(result: Sensitivity, folder: Path | str, *, dpi: float = DPI) -> list[Path]:
    """Write the picture of `draw_sensitivity` as `sensitivity.png`. Raises OptionError when the folder cannot be
    written to."""
    return save_figures({"sensitivity.png": draw_sensitivity(result, dpi=dpi)}, folder)


@verb
def draw_sensitivity(result: Sensitivity, *, dpi: float = DPI) -> Figure:
    """A tornado chart of each of the first six quantities: its change in per cent when a parameter rises by 1 %, the
    largest first, after twelve the others added up.

    Frequencies that coincide have a line from the lowest to the highest slope. Slopes without a per cent, of what is
    zero, are named below. dpi as in `draw_mechanism`. Returns a Figure.
    """
    count = min(len(result.quantities), MOST_PANELS)
    columns = min(max(count, 1), 2 if count in (1, 2, 4) else 3)
    rows = -(-max(count, 1) // columns)
    charts = [ranked_bars(list(_percents(result, k))) for k in range(count)]
    most = max(map(len, charts), default=1)
    size = (3.9 * columns if columns > 1 else 6.0, rows * (1.1 + 0.21 * max(most, 3)) + 0.6)
    figure, panels = panel_grid(count, (rows, columns), size, dpi)
    for k, (axes, bars) in enumerate(zip(panels, charts, strict=True)):
        draw_bars(axes, bars, "change per +1 %, %", most)
        value, unit = float(result.value[k]), result.units[k]
        text = quantity(value, unit, 4) if np.isfinite(value) else "no value"
        title = f"{shortened(result.quantities[k], 40)}: {text}"
        axes.set_title(title, fontsize=8.5, color=INK, loc="left", parse_math=False)
        if not bars:
            axes.set_axis_off()
            axes.text(0.0, 0.8, "no slope has a per cent", size=8, color=INK, transform=axes.transAxes)
    more = len(result.quantities) - count
    notes = [*([f"{more} more quantities are not drawn"] if more else []), *result.notes]
    headline(figure, f"{result.name}: what a per cent of each parameter does", result.warnings, notes)
    return figure


def _percents(result: Sensitivity, k: int) -> Iterator[Bar]:
    """Changes of a quantity in per cent; what has none is left out."""
    value = float(result.value[k])
    for p, name in enumerate(result.parameters):
        share = float(result.relative[k, p])
        if np.isfinite(share):
            low, high = (result.nominal[p] / value * slope[k, p] for slope in (result.lowest, result.highest))
            yield percent_bar(name, share, (float(low), float(high)))


@verb
def save_calibration(result: Calibration, folder: Path | str) -> list[Path]:
    """Write `calibration.png` into a folder, complete or not at all.

    Raises OptionError when the folder cannot be written to.
    """
    return save_figures({"calibration.png": draw_calibration(result)}, folder)


@verb
def draw_calibration(result: Calibration) -> Figure:
    """Prior and posterior intervals of the parameters in prior standard deviations, and errors of the frequencies."""
    count = len(result.parameters)
    figure = new_chart((8.4, 1.4 + 0.3 * max(count, 6)))
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    mean, deviation = result.z, np.sqrt(np.minimum(np.diagonal(result.covariance), 1e6))
    y = np.arange(count)[::-1]
    for k, (p, low, high) in enumerate(zip(result.parameters, *result.problem.unknown.z_bounds, strict=True)):
        prior = np.clip([-1.96, 1.96], low, high)
        posterior = np.clip([mean[k] - 1.96 * deviation[k], mean[k] + 1.96 * deviation[k]], low, high)
        left.plot(prior, [y[k]] * 2, color=BEFORE, linewidth=7, solid_capstyle="butt")
        left.plot(posterior, [y[k]] * 2, color=AFTER, linewidth=2.5, solid_capstyle="butt")
        left.plot([mean[k]], [y[k]], "D" if p.at_bound else "o", color=AFTER, markersize=5)
    left.set_yticks(y, [p.name for p in result.parameters], fontsize=8)
    left.set_xlabel("prior standard deviations from the prior's middle")
    left.set_title("grey: 95 % before; blue: after; diamond: at a bound", fontsize=8, color=INK)
    at = np.arange(len(result.modes))
    before, after = ([m.start_error for m in result.modes], [m.error for m in result.modes])
    right.bar(at - 0.2, 100 * np.array(before), 0.38, color=BEFORE, label="before")
    right.bar(at + 0.2, 100 * np.array(after), 0.38, color=AFTER, label="after")
    right.axhline(0, color=INK, linewidth=0.8)
    right.set_xticks(at, [str(m.number) for m in result.modes])
    right.set_xlabel("measured mode")
    right.set_ylabel("error of frequency, %")
    if result.modes:
        right.legend(fontsize=8, frameon=False)
    for axes in (left, right):
        axes.tick_params(labelsize=8, colors=INK)
        without_frame(axes, "top", "right")
    headline(figure, result.mechanism.name, result.warnings, result.notes)
    return figure
