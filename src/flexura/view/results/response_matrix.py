"""The matrix of all frequency responses."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from flexura.analysis import FrequencyResponse, heard
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.view.drawing import (
    CENTRED,
    FAINT,
    INK,
    SERIES,
    foot,
    frequency_axis,
    headline,
    new_chart,
    shortened,
    style,
)

MOST_PANELS = 12
"""Inputs, and outputs, in a matrix of responses."""


@verb
def draw_response_matrix(result: FrequencyResponse) -> Figure:
    """Magnitudes of all responses: a row for every output, a column for every input, one scale in each row.

    Raises OptionError for more than twelve inputs or outputs.
    """
    p, m = len(result.outputs), len(result.inputs)
    if max(p, m) > MOST_PANELS:
        raise OptionError(f"a matrix has at most {MOST_PANELS} inputs and outputs; name some of the {p} x {m}")
    figure = new_chart((1.3 + 1.7 * m, 1.0 + 1.3 * p))
    panels = figure.subplots(p, m, sharex=True, sharey="row", squeeze=False)
    magnitude, hz, sounds = np.abs(result.response), result.frequency_hz, heard(result)
    for i, output in enumerate(result.outputs):
        drawn = []
        for j, axes in enumerate(panels[i]):
            own = magnitude[:, i, j]
            for f in result.resonances_hz:
                axes.axvline(f, color=FAINT, linewidth=0.6, zorder=0)
            if sounds[i, j]:
                axes.plot(hz, own, color=SERIES[0], linewidth=0.9)
                drawn.append(own)
            else:
                axes.text(0.5, 0.5, "0", color="#8a93a0", fontsize=9, transform=axes.transAxes, **CENTRED)
            style(axes)
        _scale(panels[i, 0], np.concatenate(drawn) if drawn else np.empty(0))
        for axes in panels[i]:
            frequency_axis(axes, float(hz[0]), float(hz[-1]), room=7)
            axes.minorticks_off()
            axes.tick_params(labelsize=6)
            axes.tick_params(labelbottom=i == p - 1, labelleft=axes is panels[i, 0], length=2)
        panels[i, 0].set_ylabel(
            f"{shortened(output.name, 26)}\n[{output.unit}]", fontsize=7, color=INK, parse_math=False
        )
    for axes, channel in zip(panels[0], result.inputs, strict=True):
        axes.set_title(f"{shortened(channel.name, 26)}\n[{channel.unit}]", fontsize=7, color=INK, parse_math=False)
    figure.supxlabel("frequency, Hz", fontsize=8)
    headline(figure, result.name)
    foot(figure, result.warnings)
    return figure


def _scale(axes, values: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    """One logarithmic scale for a row, in whole powers of ten of which at most five are written."""
    values = values[values > 0]
    if not len(values):
        axes.set_yticks([])
        return
    low, high = np.floor(np.log10(values.min())), np.ceil(np.log10(values.max()))
    low = max(low, high - 9)
    axes.set_yscale("log")
    axes.set_ylim(10.0**low, 10.0 ** max(high, low + 1))
    step = -(-int(max(high - low, 1)) // 4)
    axes.yaxis.set_major_locator(LogLocator(base=10.0**step, numticks=99))
