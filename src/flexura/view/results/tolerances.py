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
from flexura.study.tolerances import Tolerance, Yield
from flexura.tables import Scale, number, quantity, scale_for
from flexura.testing.updating import Calibration
from flexura.view.drawing import (
    DPI,
    FAINT,
    INK,
    MOST_BARS,
    Bar,
    bar,
    draw_bars,
    foot,
    headline,
    new_chart,
    ranked,
    shortened,
    style,
    ticks_within,
)
from flexura.view.mechanisms import save_figures

TOTAL, FIRST, LIMIT = "#9db9dc", "#1f5fa8", "#c2182b"

MOST_ROWS = 4
"""Quantities of a picture."""

ROUND_OFF = 1e-12
"""Spread, relative to the value, that is none."""


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
    for own, (left, middle, right) in zip(shown, panels, strict=True):
        edges, counts = result.histogram(own.text)
        limits, share = result.yield_curve(own.text)
        scale = scale_for([*limits, own.nominal], own.unit)
        required = [one for one in result.yields if one.quantity == own.text]
        label = scale.label(shortened(own.text, 44))
        left.set_title(f"nominal {scale.text(own.nominal)}" if np.isfinite(own.nominal) else "", fontsize=8, loc="left")
        if len(limits) and np.ptp(limits) > ROUND_OFF * np.abs(limits).max():
            ends = _ends(limits, own.nominal, required)
            _histogram(left, edges, counts, scale)
            _yields(middle, result, own.text, limits, share, scale)
            for axes in (left, middle):
                _lines(axes, own.nominal, required, scale, ends, label)
            middle.set_title("\n".join(map(_said, required)), fontsize=7, color=LIMIT, loc="left", parse_math=False)
            _influence(right, result, own.text, slots)
        else:
            _empty((left, middle, right), label, "does not scatter" if len(limits) else "no sample has a value")
    more = len(result.quantities) - len(shown)
    headline(figure, f"{result.name}: {len(result.sizes)} independent sizes, {result.samples} samples")
    foot(figure, foremost(result.warnings, 1), [f"{more} more quantities are not drawn"] if more else [])
    return figure


def _ends(limits: np.ndarray, nominal: float, required: Sequence[Yield]) -> tuple[float, float]:
    """Ends of the axis of a quantity, SI, on which the limits stand that are not far off."""
    low, high = float(limits[0]), float(limits[-1])
    span = high - low
    beside = [one for own in required for one in [own.limit] if one is not None]
    near = [one for one in (nominal, *beside) if np.isfinite(one) and low - span < one < high + span]
    low, high = min([low, *near]), max([high, *near])
    return low - 0.03 * (high - low), high + 0.03 * (high - low)


def _histogram(axes: Axes, edges: np.ndarray, counts: np.ndarray, scale: Scale) -> None:
    axes.stairs(counts, edges / scale.size, fill=True, color=TOTAL, gid="histogram")
    axes.set_ylim(0, 1.08 * float(counts.max()))
    ticks_within(axes.yaxis, 0, 1.08 * float(counts.max()), 4)
    axes.set_ylabel("samples", fontsize=8)


def _yields(axes: Axes, result: Tolerance, text: str, limits: np.ndarray, share: np.ndarray, scale: Scale) -> None:
    low, high = result.yield_interval(text, limits)
    axes.fill_between(limits / scale.size, 100 * low, 100 * high, color=FIRST, alpha=0.25, lw=0, gid="interval")
    axes.plot(limits / scale.size, 100 * share, color=FIRST, lw=1.4, gid="yield")
    axes.set_ylim(0, 104)
    ticks_within(axes.yaxis, 0, 100, 5)
    axes.set_ylabel("parts with at least so much, %", fontsize=8)


def _lines(
    axes: Axes, nominal: float, required: Sequence[Yield], scale: Scale, ends: tuple[float, float], label: str
) -> None:
    """The nominal value, the limits, and the axis of the quantity."""
    if np.isfinite(nominal):
        axes.axvline(nominal / scale.size, color=INK, lw=0.9, ls="--", gid="nominal")
    for own in required:
        if own.limit is not None and ends[0] <= own.limit <= ends[1]:
            axes.axvline(own.limit / scale.size, color=LIMIT, lw=1.2, gid="limit")
    low, high = (end / scale.size for end in ends)
    axes.set_xlim(low, high)
    ticks_within(axes.xaxis, low, high, 5)
    axes.set_xlabel(label, fontsize=8, parse_math=False)
    style(axes)


def _said(own: Yield) -> str:
    """A requirement with its yield."""
    low, value, high = (number(100 * own, 4) for own in (own.share.low, own.share.value, own.share.high))
    return f"{shortened(own.text)}: {value} % of parts ({low} to {high})"


def _influence(axes: Axes, result: Tolerance, text: str, slots: int) -> None:
    """Shares of the variance by tolerance: wide bars with all interactions, narrow ones alone."""
    k = [own.text for own in result.quantities].index(text)
    indices, names = result.indices, list(result.influence(text))
    if indices is None:
        _empty((axes,), "", "no shares of the variance were asked for")
        return
    shown = names[:MOST_BARS]
    y = -np.arange(len(shown), dtype=float)
    places = [result.tolerances.index(name) for name in shown]
    total, half, first = (100 * own[places, k] for own in (indices.total, indices.total_half, indices.first))
    axes.barh(y, total, 0.7, color=TOTAL, label="with all others", gid="total")
    axes.barh(y, np.maximum(first, 0.0), 0.32, color=FIRST, label="alone", gid="first")
    reach = np.nan_to_num(total + half, nan=0.0)
    axes.hlines(y, np.maximum(total - half, 0.0), total + half, color=INK, lw=0.8, gid="interval")
    for at, end, value, off in zip(y, reach, total, half, strict=True):
        said = f"{number(value, 3)} ± {number(off, 2)} %" if np.isfinite(value) else "unknown"
        axes.annotate(said, (end, at), (4, 0), textcoords="offset points", va="center", size=7, color=INK)
    axes.set_yticks(y, [shortened(name, 26) for name in shown], fontsize=7, parse_math=False)
    high = 1.55 * max(float(reach.max(initial=0.0)), 1.0)
    axes.set_xlim(0, high)
    axes.set_ylim(-slots + 0.4, 0.6)
    more = len(names) - len(shown)
    axes.set_xlabel("share of the variance, %" + (f"; {more} more answer for less" if more else ""), fontsize=8)
    style(axes)
    axes.tick_params(axis="y", length=0, labelsize=7)
    ticks_within(axes.xaxis, 0, min(high, 100.0), 5)
    axes.legend(fontsize=7, frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1)


def _empty(panels: Sequence[Axes], label: str, said: str) -> None:
    """Panels of what there is nothing to draw of."""
    for axes in panels:
        axes.set(xticks=[], yticks=[])
        for spine in axes.spines.values():
            spine.set_color(FAINT)
    panels[0].set_xlabel(label, fontsize=8, parse_math=False)
    panels[0].text(0.5, 0.5, said, size=8, color=INK, ha="center", va="center", transform=panels[0].transAxes)


MOST_PANELS = 6
"""Quantities of a picture."""


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
    bars = [ranked(list(_bars(result, k))) for k in range(count)]
    most = max((len(own) for own in bars), default=1)
    figure = new_chart((3.9 * columns if columns > 1 else 6.0, rows * (1.1 + 0.21 * max(most, 3)) + 0.6), dpi)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for k, axes in enumerate(panels):
        if k >= count:
            axes.set_visible(False)
            continue
        draw_bars(axes, bars[k], "change per +1 %, %", most)
        value, unit = float(result.value[k]), result.units[k]
        told = quantity(value, unit, 4) if np.isfinite(value) else "no value"
        title = f"{shortened(result.quantities[k], 40)}: {told}"
        axes.set_title(title, fontsize=8.5, color=INK, loc="left", parse_math=False)
        if not bars[k]:
            axes.set_axis_off()
            axes.text(0.0, 0.8, "no slope has a per cent", size=8, color=INK, transform=axes.transAxes)
    headline(figure, f"{result.name}: what a per cent of each parameter does")
    left = [f"{len(result.quantities) - count} more quantities are not drawn"] if len(result.quantities) > count else []
    foot(figure, result.warnings, [*left, *result.notes])
    return figure


def _bars(result: Sensitivity, k: int) -> Iterator[Bar]:
    """Changes of a quantity in per cent; what has none is left out."""
    value = float(result.value[k])
    for p, name in enumerate(result.parameters):
        share = float(result.relative[k, p])
        if np.isfinite(share):
            ends = (result.nominal[p] / value * result.lowest[k, p], result.nominal[p] / value * result.highest[k, p])
            yield bar(name, share, "%", (float(ends[0]), float(ends[1])))


BEFORE, AFTER = "#c9ced6", "#1f5fa8"


@verb
def draw_calibration(result: Calibration) -> Figure:
    """Prior and posterior intervals of the parameters in prior standard deviations, and errors of the frequencies."""
    count = len(result.parameters)
    figure = new_chart((8.4, 1.4 + 0.3 * max(count, 6)))
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    own, deviation = result.z, np.sqrt(np.minimum(np.diagonal(result.covariance), 1e6))
    y = np.arange(count)[::-1]
    low, high = result.problem.unknown.z_bounds
    for k, p in enumerate(result.parameters):
        ends = np.clip([own[k] - 1.96 * deviation[k], own[k] + 1.96 * deviation[k]], low[k], high[k])
        left.plot(np.clip([-1.96, 1.96], low[k], high[k]), [y[k]] * 2, color=BEFORE, linewidth=7, solid_capstyle="butt")
        left.plot(ends, [y[k]] * 2, color=AFTER, linewidth=2.5, solid_capstyle="butt")
        left.plot([own[k]], [y[k]], "D" if p.at_bound else "o", color=AFTER, markersize=5)
    left.set_yticks(y, [p.name for p in result.parameters], fontsize=8)
    left.set_xlabel("prior standard deviations from the prior's middle")
    left.set_title("grey: 95 % before; blue: after; diamond: at a bound", fontsize=8, color=INK)
    measured = np.array([m.number for m in result.modes])
    for errors, colour, shift, label in (
        ([m.start_error for m in result.modes], BEFORE, -0.2, "before"),
        ([m.error for m in result.modes], AFTER, 0.2, "after"),
    ):
        right.bar(np.arange(len(measured)) + shift, 100 * np.array(errors), 0.38, color=colour, label=label)
    right.axhline(0, color=INK, linewidth=0.8)
    right.set_xticks(np.arange(len(measured)), [str(n) for n in measured])
    right.set_xlabel("measured mode")
    right.set_ylabel("error of frequency, %")
    if result.modes:
        right.legend(fontsize=8, frameon=False)
    for axes in (left, right):
        axes.tick_params(labelsize=8, colors=INK)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    figure.suptitle(result.mechanism.name, fontsize=10, color=INK)
    foot(figure, result.warnings, result.notes)
    return figure


@verb
def save_calibration(result: Calibration, folder: Path | str) -> list[Path]:
    """Write `calibration.png` into a folder, complete or not at all.

    Raises OptionError when the folder cannot be written to.
    """
    return save_figures({"calibration.png": draw_calibration(result)}, folder)
