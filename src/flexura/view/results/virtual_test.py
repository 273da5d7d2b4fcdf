"""A virtual test in pictures: frequency responses with their coherence, and what the sensors' mass does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.linalg import leading
from flexura.tables import counted
from flexura.testing.updating import MeasuredFrequencies
from flexura.testing.virtual import VirtualTest
from flexura.view.drawing import INK, SERIES, foot, legend_above, new_chart, style
from flexura.view.mechanisms import save_figures
from flexura.view.results.identification import save_identification


@verb
def save_virtual_test(
    result: VirtualTest, folder: Path | str, *, measured: MeasuredFrequencies | None = None
) -> list[Path]:
    """Write `virtual_test.png` and the pictures of the identification into a folder, each complete or not at all.

    Raises OptionError when the folder cannot be written to, and for a test without frequency responses.
    """
    found = save_figures({"virtual_test.png": draw_virtual_test(result, measured)}, folder)
    if result.identified is not None:
        found += save_identification(result.identified, folder, data=result.measurement)
    return found


@verb
def draw_virtual_test(result: VirtualTest, measured: MeasuredFrequencies | None = None) -> Figure:
    """The largest frequency response of every placement, its coherence, and the shift of every mode in per cent.

    Vertical lines: modes without sensors dashed, identified ones full, `measured` frequencies dotted. Raises
    OptionError for a test without frequency responses.
    """
    frfs = result.measurement.frfs
    if not frfs:
        raise OptionError("; ".join(result.notes) or "the test has no frequency responses")
    figure = new_chart((9.0, 6.4))
    magnitude, coherence, shift = figure.subplots(3, 1, height_ratios=(3, 1, 1.4))
    for k, frf in enumerate(frfs):
        size = np.abs(frf.response).max(axis=0)
        i, j = np.unravel_index(int(leading(size.ravel())), size.shape)
        label = f"{frf.outputs[i].name} / {frf.inputs[j].name}" + (f", {frf.setup}" if frf.setup else "")
        colour = SERIES[k % len(SERIES)]
        magnitude.semilogy(frf.frequency_hz, np.abs(frf.response[:, i, j]), color=colour, lw=1.0, label=label)
        if frf.coherence is not None:
            coherence.plot(frf.frequency_hz, frf.coherence[:, i, j], color=colour, lw=0.9)
    _lines(magnitude, result, measured)
    magnitude.set_ylabel("(m/s²)/N", fontsize=8)
    legend_above(magnitude)
    coherence.set_ylabel("coherence", fontsize=8)
    coherence.set_ylim(0, 1.05)
    coherence.set_xlabel("frequency, Hz", fontsize=8)
    for axes in (magnitude, coherence):
        axes.set_xlim(*result.band)
    _shifts(shift, result)
    for axes in (magnitude, coherence, shift):
        style(axes)
    title = f"{result.name}: virtual test, {counted(len(result.measurement.recordings), 'hit')}"
    figure.suptitle(title, fontsize=10, color=INK)
    foot(figure, (), result.notes)
    return figure


def _lines(axes: Axes, result: VirtualTest, measured: MeasuredFrequencies | None) -> None:
    styles = (
        ("without sensors", [m.bare_hz for m in result.modes], INK, "--"),
        ("identified", [m.identified_hz for m in result.modes], "#9aa3ad", "-"),
        ("measured", [] if measured is None else measured.frequency_hz.tolist(), INK, ":"),
    )
    for label, listed, colour, dashes in styles:
        for n, hz in enumerate(hz for hz in listed if hz is not None):
            axes.axvline(hz, linewidth=0.8, zorder=0, label="" if n else label, color=colour, linestyle=dashes)


def _shifts(axes: Axes, result: VirtualTest) -> None:
    """Shift of every mode by the mass of the sensors of each placement, lines true and marks identified."""
    numbers = np.array([m.number for m in result.modes])
    for k, placement in enumerate(result.test.placed()):
        colour, at = SERIES[k % len(SERIES)], numbers + 0.12 * (k - len(result.mass_loaded) / 2)
        pairs = [m.placement_hz[placement] for m in result.modes]
        true = [100 * (t / m.bare_hz - 1) for (t, _), m in zip(pairs, result.modes, strict=True)]
        found = [
            np.nan if f is None else 100 * (f / m.bare_hz - 1) for (_, f), m in zip(pairs, result.modes, strict=True)
        ]
        axes.bar(at, true, width=0.1, color=colour, alpha=0.35)
        axes.plot(at, found, linestyle="", marker="_", markersize=7, color=colour)
    axes.axhline(0, color=INK, linewidth=0.6)
    axes.set_xticks(numbers)
    axes.set_xlabel("mode (bars: true, marks: identified)", fontsize=8)
    axes.set_ylabel("shift by sensors, %", fontsize=8)
