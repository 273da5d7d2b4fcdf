"""Curves of responses: Bode and Nyquist plots of one unit, and responses over time."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from flexura.analysis import (
    FrequencyResponse,
    Pair,
    ResponseCurve,
    ResponseGroup,
    TimeResponse,
    phase_in_degrees,
    response_group,
    response_units,
)
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.tables import in_hz
from flexura.view.drawing import (
    FAINT,
    SERIES,
    foot,
    frequency_axis,
    headline,
    legend_above,
    new_chart,
    plain_axes,
    remark_lines,
    shortened,
    style,
    value_axis,
    written_below,
)
from flexura.view.mechanisms import save_figures
from flexura.view.results.response_matrix import MOST_PANELS, draw_response_matrix

MOST_RESONANCES = 14
"""Resonances of which it is written what moves."""


@verb
def save_frequency_response(result: FrequencyResponse, folder: Path | str) -> list[Path]:
    """Write `bode.png` and `nyquist.png`, where there are several units `bode_01.png` and so on for each, and
    `matrix.png` where there are at most twelve inputs and outputs, complete or not at all.

    Raises OptionError when the folder cannot be written to.
    """
    units = response_units(result)
    figures: dict[str, Figure] = {}
    for k, unit in enumerate(units):
        end = f"_{k + 1:02d}" if len(units) > 1 else ""
        figures[f"bode{end}.png"] = draw_bode(result, unit=unit)
        figures[f"nyquist{end}.png"] = draw_nyquist(result, unit=unit)
    if max(result.response.shape[1:]) <= MOST_PANELS:
        figures["matrix.png"] = draw_response_matrix(result)
    return save_figures(figures, folder)


def _group(result: FrequencyResponse, pairs: Sequence[Pair] | None, unit: str | None) -> ResponseGroup:
    """The responses to draw. Raises OptionError."""
    if pairs is not None:
        if not pairs:
            raise OptionError("there is nothing to draw: no pair of output and input is given")
        own = {pair: result.unit(*pair) for pair in pairs for _ in [result.of(*pair)]}
        mixed = len(set(own.values())) > 1
        curves = [ResponseCurve([pair], result.of(*pair), f"  [{own[pair]}]" if mixed else "") for pair in pairs]
        return ResponseGroup("" if mixed else own[pairs[0]], curves, [])
    units = response_units(result)
    if unit is not None and unit not in units:
        raise OptionError(f"there is no response in {unit!r}; units are {', '.join(units)}")
    return response_group(result, units[0] if unit is None else unit)


def _left_out(group: ResponseGroup, width: float) -> list[str]:
    """Which responses a figure leaves out, in words, for a width in inches."""
    if not group.left_out:
        return []
    names = "; ".join(f"{o} / {i}" for o, i in group.left_out[:6]) + (" ..." if len(group.left_out) > 6 else "")
    count = len(group.left_out) + sum(len(curve.pairs) for curve in group.curves)
    text = f"{len(group.left_out)} of {count} responses in {group.unit} are left out, the smallest: {names}"
    return remark_lines([text], "not shown", width, 6.5)


@verb
def draw_bode(result: FrequencyResponse, pairs: Sequence[Pair] | None = None, *, unit: str | None = None) -> Figure:
    """Magnitude and phase over frequency of (output, input) pairs of one unit, resonances as numbered vertical lines
    with what moves in each.

    By default the pairs of the `unit`, or of the first one, that matter: at most eight different curves, none below a
    thousandth of the largest; what is left out is said. Raises OptionError for names and units that are not there.
    """
    group = _group(result, pairs, unit)
    figure = new_chart((7.4, 5.8))
    size, angle = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    hz = result.frequency_hz
    for k, curve in enumerate(group.curves):
        colour = SERIES[k % len(SERIES)]
        size.plot(hz, np.abs(curve.H), color=colour, linewidth=1.2, label=curve.label)
        angle.plot(hz, phase_in_degrees(curve.H), color=colour, linewidth=1.2)
    for axes in (size, angle):
        for f in result.resonances_hz:
            axes.axvline(f, color=FAINT, linewidth=0.8, zorder=0)
        style(axes)
    frequency_axis(size, float(hz[0]), float(hz[-1]))
    value_axis(size, np.concatenate([np.abs(curve.H) for curve in group.curves]))
    size.set_ylabel(", ".join(filter(None, ["magnitude", group.unit])), parse_math=False)
    angle.set_ylabel("phase, deg")
    angle.set_xlabel("frequency, Hz")
    low, high = angle.dataLim.intervaly
    angle.yaxis.set_major_locator(MultipleLocator(90 if high - low < 460 else 180))
    angle.set_ylim(min(low, -180) - 15, max(high, 0) + 15)
    headline(figure, result.name)
    foot(figure, result.warnings)
    written_below(figure, _left_out(group, 7.1), 6.5, "0.35")
    written_below(figure, _numbered(angle, result))
    legend_above(size)
    return figure


def _numbered(axes: Axes, result: FrequencyResponse) -> list[str]:
    """Write the numbers of resonances at the top of axes, close ones together; what moves in them, in words."""
    hz = result.resonances_hz
    if not len(hz):
        return []
    low, high = np.log(result.frequency_hz[[0, -1]])
    close = np.flatnonzero(np.diff(np.log(hz)) > 0.022 * max(high - low, 1e-9)) + 1
    for own in np.split(np.arange(len(hz)), close):
        text = f"{own[0] + 1}" if len(own) == 1 else f"{own[0] + 1}-{own[-1] + 1}"
        at = float(np.exp(np.log(hz[own]).mean()))
        axes.text(at, 1.0, text, size=6.5, color="0.35", ha="center", va="bottom", transform=axes.get_xaxis_transform())
    told = [
        f"{k + 1}  {in_hz(f, 4)}" + (f"  {shortened(words.partition(' (')[0], 64)}" if words else "")
        for k, (f, words) in enumerate(itertools.zip_longest(hz, result.resonance_motions))
    ]
    rest = len(told) - MOST_RESONANCES
    return told[:MOST_RESONANCES] + ([f"and {rest} more resonances"] if rest > 0 else [])


@verb
def draw_nyquist(result: FrequencyResponse, pairs: Sequence[Pair] | None = None, *, unit: str | None = None) -> Figure:
    """Imaginary over real part of (output, input) pairs of one unit, both to one scale; pairs and errors as in
    `draw_bode`."""
    group = _group(result, pairs, unit)
    figure = new_chart((5.6, 6.0))
    axes = figure.subplots()
    for k, curve in enumerate(group.curves):
        axes.plot(curve.H.real, curve.H.imag, color=SERIES[k % len(SERIES)], linewidth=1.2, label=curve.label)
    axes.axhline(0, color=FAINT, linewidth=0.8, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.8, zorder=0)
    style(axes)
    plain_axes(axes)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(", ".join(filter(None, ["real part", group.unit])), parse_math=False)
    axes.set_ylabel(", ".join(filter(None, ["imaginary part", group.unit])), parse_math=False)
    headline(figure, result.name)
    foot(figure, result.warnings)
    written_below(figure, _left_out(group, 5.3), 6.5, "0.35")
    legend_above(axes)
    return figure


@verb
def draw_time(result: TimeResponse, outputs: Sequence[str] | None = None) -> Figure:
    """Inputs above, and below them outputs over time, those of one unit in one panel.

    Raises OptionError for outputs that are not there.
    """
    names = [c.name for c in result.outputs] if outputs is None else list(outputs)
    unit = {c.name: c.unit for c in result.outputs}
    curves = {name: result.of(name) for name in names}
    units = list(dict.fromkeys(unit[name] for name in names))
    driven = list(dict.fromkeys(channel.unit for channel in result.inputs))
    figure = new_chart((7.4, 1.2 + 1.9 * (len(driven) + len(units))))
    panels = figure.subplots(len(driven) + len(units), 1, sharex=True, squeeze=False)[:, 0]
    for panel, own in zip(panels, driven, strict=False):
        channels = [(c, u) for c, u in zip(result.inputs, result.signals, strict=True) if c.unit == own]
        for k, (channel, u) in enumerate(channels):
            panel.plot(result.time, u, color=SERIES[k % len(SERIES)], linewidth=1.0, label=channel.name)
        panel.set_ylabel(f"input, {own}", fontsize=8, parse_math=False)
    for panel, own in zip(panels[len(driven) :], units, strict=True):
        for k, name in enumerate(n for n in names if unit[n] == own):
            panel.plot(result.time, curves[name], color=SERIES[k % len(SERIES)], linewidth=1.0, label=name)
        panel.set_ylabel(own, fontsize=8, parse_math=False)
    for panel in panels:
        style(panel)
        plain_axes(panel)
        panel.margins(x=0.0)
        legend_above(panel)
    panels[-1].set_xlabel("time, s")
    headline(figure, result.name)
    foot(figure, result.warnings)
    return figure
