"""Curves: Bode and Nyquist plots, the matrix of all frequency responses, and time responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from flexura.analysis import FrequencyResponse, TimeResponse
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.view.annotations import foot
from flexura.view.figures import new_chart
from flexura.view.palette import INK

COLOURS = ("#1f5fa8", "#d9541e", "#2c8a4b", "#7a4aa0", "#b8860b", "#0f8b8d", "#a23b57", "#5b6770")
FAINT = "#c9ced6"
CENTRED = {"ha": "center", "va": "center"}

MOST_CURVES = 8
"""Curves in one Bode or Nyquist plot."""

MOST_PANELS = 12
"""Inputs, and outputs, in a matrix of responses."""

SILENT = 1e-9
"""Responses that stay below so much of the largest of their row and column are drawn as nothing: symmetry."""


def _pairs(result: FrequencyResponse, pairs: Sequence[tuple[str, str]] | None) -> list[tuple[str, str]]:
    """The (output, input) pairs to draw: those given, else each output from each input as far as room is."""
    if pairs is not None:
        if not pairs:
            raise OptionError("there is nothing to draw: no pair of output and input is given")
        return list(pairs)
    every = [(o.name, i.name) for o in result.outputs for i in result.inputs]
    if len(result.inputs) == len(result.outputs) > 1 and len(every) > MOST_CURVES:
        every = [(o.name, i.name) for o, i in zip(result.outputs, result.inputs, strict=True)]
    return every[:MOST_CURVES]


def _style(axes) -> None:  # type: ignore[no-untyped-def]
    axes.grid(True, which="both", color="#e8ebef", linewidth=0.6)
    axes.tick_params(labelsize=8, colors=INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


@verb
def draw_bode(result: FrequencyResponse, pairs: Sequence[tuple[str, str]] | None = None) -> Figure:
    """Magnitude and phase over frequency of some (output, input) pairs, resonances as vertical lines.

    By default every pair, or those of equal position where there are more than eight. Raises OptionError for names that
    are not there.
    """
    chosen = _pairs(result, pairs)
    figure = new_chart((7.2, 5.4))
    size, angle = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for k, (output, input_) in enumerate(chosen):
        H = result.of(output, input_)
        colour = COLOURS[k % len(COLOURS)]
        label = f"{output} / {input_}  [{result.unit(output, input_)}]"
        size.loglog(result.frequency_hz, np.abs(H), color=colour, linewidth=1.2, label=label)
        angle.semilogx(result.frequency_hz, _phase(H), color=colour, linewidth=1.2)
    for axes in (size, angle):
        for f in result.resonances_hz:
            axes.axvline(f, color=FAINT, linewidth=0.8, zorder=0)
        _style(axes)
    size.set_ylabel("magnitude")
    size.set_title(result.name, fontsize=10, color=INK)
    size.legend(fontsize=7, frameon=False)
    angle.set_ylabel("phase, deg")
    angle.set_xlabel("frequency, Hz")
    angle.set_yticks([-360, -270, -180, -90, 0, 90, 180])
    low, high = angle.dataLim.intervaly
    angle.set_ylim(min(low, -180) - 15, max(high, 0) + 15)
    foot(figure, result.warnings)
    return figure


def _phase(H: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Phase in degrees, unwrapped, its first value within (-180, 180]."""
    phase = np.degrees(np.unwrap(np.angle(H)))
    shift = 360 * np.round(np.median(phase) / 360) if abs(np.median(phase)) > 360 else 0.0
    return phase - shift


@verb
def draw_nyquist(result: FrequencyResponse, pairs: Sequence[tuple[str, str]] | None = None) -> Figure:
    """Imaginary over real part of some (output, input) pairs. Raises OptionError for names that are not there."""
    chosen = _pairs(result, pairs)
    figure = new_chart((5.4, 5.4))
    axes = figure.subplots()
    for k, (output, input_) in enumerate(chosen):
        H = result.of(output, input_)
        label = f"{output} / {input_}  [{result.unit(output, input_)}]"
        axes.plot(H.real, H.imag, color=COLOURS[k % len(COLOURS)], linewidth=1.2, label=label)
    axes.axhline(0, color=FAINT, linewidth=0.8, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.8, zorder=0)
    _style(axes)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
    axes.set_title(result.name, fontsize=10, color=INK)
    axes.legend(fontsize=7, frameon=False)
    foot(figure, result.warnings)
    return figure


@verb
def draw_response_matrix(result: FrequencyResponse) -> Figure:
    """Magnitudes of all responses: a row for every output, a column for every input, one scale in each row.

    Raises OptionError for more than twelve inputs or outputs.
    """
    p, m = len(result.outputs), len(result.inputs)
    if max(p, m) > MOST_PANELS:
        raise OptionError(f"a matrix has at most {MOST_PANELS} inputs and outputs; name some of the {p} x {m}")
    figure = new_chart((1.2 + 1.55 * m, 0.9 + 1.25 * p))
    panels = figure.subplots(p, m, sharex=True, squeeze=False)
    magnitude = np.abs(result.response)
    for i in range(p):
        for j in range(m):
            axes = panels[i, j]
            own = magnitude[:, i, j]
            peers = np.sqrt(magnitude[:, i].max() * magnitude[:, :, j].max())
            for f in result.resonances_hz:
                axes.axvline(f, color=FAINT, linewidth=0.6, zorder=0)
            if own.max() > SILENT * peers:
                axes.loglog(result.frequency_hz, own, color=COLOURS[0], linewidth=0.9)
            else:
                axes.set_xscale("log")
                axes.set_yticks([])
                axes.text(0.5, 0.5, "0", color="#8a93a0", fontsize=9, transform=axes.transAxes, **CENTRED)
            axes.set_xlim(result.frequency_hz[0], result.frequency_hz[-1])
            _style(axes)
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter(NullFormatter())
            axes.tick_params(labelsize=6)
            if i == 0:
                axes.set_title(f"{result.inputs[j].name}\n[{result.inputs[j].unit}]", fontsize=7, color=INK)
            if j == 0:
                axes.set_ylabel(f"{result.outputs[i].name}\n[{result.outputs[i].unit}]", fontsize=7, color=INK)
    figure.supxlabel("frequency, Hz", fontsize=8)
    figure.suptitle(result.name, fontsize=10, color=INK)
    foot(figure, result.warnings)
    return figure


@verb
def draw_time(result: TimeResponse, outputs: Sequence[str] | None = None) -> Figure:
    """Inputs above, and below them outputs over time, those of one unit in one panel.

    Raises OptionError for outputs that are not there.
    """
    names = [c.name for c in result.outputs] if outputs is None else list(outputs)
    unit = {c.name: c.unit for c in result.outputs}
    for name in names:
        result.of(name)
    units = list(dict.fromkeys(unit[name] for name in names))
    figure = new_chart((7.2, 1.6 + 1.9 * len(units)))
    panels = figure.subplots(1 + len(units), 1, sharex=True, squeeze=False)[:, 0]
    for k, (channel, u) in enumerate(zip(result.inputs, result.signals, strict=True)):
        panels[0].plot(result.time, u, color=COLOURS[k % len(COLOURS)], linewidth=1.0, label=str(channel))
    for panel, own in zip(panels[1:], units, strict=True):
        for k, name in enumerate(n for n in names if unit[n] == own):
            panel.plot(result.time, result.of(name), color=COLOURS[k % len(COLOURS)], linewidth=1.0, label=name)
        panel.set_ylabel(own, fontsize=9)
    for panel in panels:
        _style(panel)
        panel.legend(fontsize=7, frameon=False, loc="upper right")
    panels[-1].set_xlabel("time, s")
    panels[0].set_title(result.name, fontsize=10, color=INK)
    foot(figure, result.warnings)
    return figure
