"""Curves of responses: Bode and Nyquist plots of one unit, and responses over time."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from flexura.analysis import FrequencyResponse, TimeResponse
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.systems import unit_of_response
from flexura.view.annotations import foot, remark_lines
from flexura.view.charts import (
    COLOURS,
    FAINT,
    frequency_axis,
    headline,
    legend_above,
    plain_axes,
    shortened,
    style,
    value_axis,
    written_below,
)
from flexura.view.figures import new_chart
from flexura.view.files import save_figures
from flexura.view.response_matrix import MOST_PANELS, draw_response_matrix, heard

MOST_CURVES = 8
"""Curves in one Bode or Nyquist plot."""

MOST_PAIRS = 100
"""Pairs, the largest ones, that are looked at for curves that are equal."""

MATTERS = 1e-3
"""Responses whose largest magnitude is a smaller share of the largest of their unit are left out."""

SAME = 1e-3
"""Responses that differ by a smaller share of the largest are one curve."""

MOST_RESONANCES = 14
"""Resonances of which it is written what moves."""

Pair = tuple[str, str]
"""An output and an input, by name."""


class _Curve(NamedTuple):
    """A response, the pairs that have it, and its unit where the curves of a figure have several."""

    pairs: list[Pair]
    H: NDArray[np.complex128]
    unit: str = ""

    @property
    def label(self) -> str:
        """The first pair, and how many are like it."""
        output, input_ = self.pairs[0]
        more = len(self.pairs) - 1
        return f"{output} / {input_}" + (f", and {more} equal" if more else "") + self.unit


class _Group(NamedTuple):
    """What a figure shows: responses of one unit, none where pairs of several are asked for, and what is left out."""

    unit: str
    curves: list[_Curve]
    left_out: list[Pair]


@verb
def save_frequency_response(result: FrequencyResponse, folder: Path | str) -> list[Path]:
    """Write `bode.png` and `nyquist.png`, where there are several units `bode_01.png` and so on for each, and
    `matrix.png` where there are at most twelve inputs and outputs, complete or not at all.

    Raises OptionError when the folder cannot be written to.
    """
    units = _units(result)
    figures: dict[str, Figure] = {}
    for k, unit in enumerate(units):
        end = f"_{k + 1:02d}" if len(units) > 1 else ""
        figures[f"bode{end}.png"] = draw_bode(result, unit=unit)
        figures[f"nyquist{end}.png"] = draw_nyquist(result, unit=unit)
    if max(result.response.shape[1:]) <= MOST_PANELS:
        figures["matrix.png"] = draw_response_matrix(result)
    return save_figures(figures, folder)


def _units(result: FrequencyResponse) -> list[str]:
    """Units of the responses, each once."""
    return list(dict.fromkeys(unit_of_response(o, i) for o in result.outputs for i in result.inputs))


def _group(result: FrequencyResponse, pairs: Sequence[Pair] | None, unit: str | None) -> _Group:
    """The responses to draw. Raises OptionError."""
    if pairs is not None:
        if not pairs:
            raise OptionError("there is nothing to draw: no pair of output and input is given")
        own = {pair: result.unit(*pair) for pair in pairs for _ in [result.of(*pair)]}
        mixed = len(set(own.values())) > 1
        curves = [_Curve([pair], result.of(*pair), f"  [{own[pair]}]" if mixed else "") for pair in pairs]
        return _Group("" if mixed else own[pairs[0]], curves, [])
    units = _units(result)
    if unit is not None and unit not in units:
        raise OptionError(f"there is no response in {unit!r}; units are {', '.join(units)}")
    unit = units[0] if unit is None else unit
    size, sounds = np.abs(result.response).max(axis=0), heard(result)
    every, peaks, wanted = list[Pair](), dict[Pair, float](), list[Pair]()
    for (i, output), (j, input_) in itertools.product(enumerate(result.outputs), enumerate(result.inputs)):
        if unit_of_response(output, input_) == unit:
            pair = (output.name, input_.name)
            every.append(pair)
            peaks[pair] = float(size[i, j])
            wanted += [pair] if sounds[i, j] else []
    largest = max(peaks.values())
    wanted = [pair for pair in wanted if peaks[pair] >= MATTERS * largest]
    curves: list[_Curve] = []
    for pair in sorted(wanted, key=lambda own: -round(peaks[own] / largest, 6))[:MOST_PAIRS]:
        H = result.of(*pair)
        alike = next((c for c in curves if np.abs(c.H - H).max() <= SAME * peaks[pair]), None)
        if alike is not None:
            alike.pairs.append(pair)
        elif len(curves) < MOST_CURVES:
            curves.append(_Curve([pair], H))
    curves = curves or [_Curve(every[:1], result.of(*every[0]))]
    shown = {pair for curve in curves for pair in curve.pairs}
    return _Group(unit, curves, [pair for pair in every if pair not in shown])


def _left_out(group: _Group, width: float) -> list[str]:
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
        colour = COLOURS[k % len(COLOURS)]
        size.plot(hz, np.abs(curve.H), color=colour, linewidth=1.2, label=curve.label)
        angle.plot(hz, _phase(curve.H), color=colour, linewidth=1.2)
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
        f"{k + 1}  {f:.4g} Hz" + (f"  {shortened(words.partition(' (')[0], 64)}" if words else "")
        for k, (f, words) in enumerate(itertools.zip_longest(hz, result.resonance_motions))
    ]
    rest = len(told) - MOST_RESONANCES
    return told[:MOST_RESONANCES] + ([f"and {rest} more resonances"] if rest > 0 else [])


def _phase(H: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Phase in degrees, unwrapped, its first value within (-180, 180]."""
    phase = np.degrees(np.unwrap(np.angle(H)))
    shift = 360 * np.round(np.median(phase) / 360) if abs(np.median(phase)) > 360 else 0.0
    return phase - shift


@verb
def draw_nyquist(result: FrequencyResponse, pairs: Sequence[Pair] | None = None, *, unit: str | None = None) -> Figure:
    """Imaginary over real part of (output, input) pairs of one unit, both to one scale; pairs and errors as in
    `draw_bode`."""
    group = _group(result, pairs, unit)
    figure = new_chart((5.6, 6.0))
    axes = figure.subplots()
    for k, curve in enumerate(group.curves):
        axes.plot(curve.H.real, curve.H.imag, color=COLOURS[k % len(COLOURS)], linewidth=1.2, label=curve.label)
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
            panel.plot(result.time, u, color=COLOURS[k % len(COLOURS)], linewidth=1.0, label=channel.name)
        panel.set_ylabel(f"input, {own}", fontsize=8, parse_math=False)
    for panel, own in zip(panels[len(driven) :], units, strict=True):
        for k, name in enumerate(n for n in names if unit[n] == own):
            panel.plot(result.time, curves[name], color=COLOURS[k % len(COLOURS)], linewidth=1.0, label=name)
        panel.set_ylabel(own, fontsize=8, parse_math=False)
    for panel in panels:
        style(panel)
        panel.margins(x=0.0)
        legend_above(panel)
    panels[-1].set_xlabel("time, s")
    headline(figure, result.name)
    foot(figure, result.warnings)
    return figure
