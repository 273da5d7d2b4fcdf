"""Identified modes: stabilisation diagrams, and measured responses beside those that the modes give back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.linalg import ranked
from flexura.testing.identification import Data, frfs_of, mode_indicators, modes_of_setup
from flexura.testing.measurement import IdentifiedModes, Poles, ResponseMatrix, response_matrices
from flexura.view.drawing import FAINT, INK, SERIES, foot, headline, legend_above, legend_of, new_chart, style
from flexura.view.mechanisms import save_figures

Bits = NDArray[np.integer[Any]]
"""Which marks a pole has, as the bits of a number."""

MOST_PANELS = 12
"""Responses in one figure."""

CLASSES: tuple[tuple[str, Callable[[Bits], NDArray[np.bool_]], str, str], ...] = (
    ("pole", lambda bits: (bits & 3) != 3, "#c9ced6", "."),
    ("frequency and damping stable", lambda bits: (bits & 7) == 3, "#b8860b", "x"),
    ("shape stable too", lambda bits: (bits & 7) == 7, "#2c8a4b", "o"),
)
"""Poles of a diagram: label, which bits, colour and marker."""


@verb
def save_identification(result: IdentifiedModes, folder: Path | str, *, data: Data) -> list[Path]:
    """Write `stabilisation.png` and `synthesis.png`, one for every setup where there are several, into a folder.

    Files appear complete or not at all. Raises OptionError when the folder cannot be written to, and for `data` that
    the modes are not from.
    """
    each = result.setups or (result,)
    figures = {}
    for k, own in enumerate(each):
        end = f"_{k + 1:02d}" if len(each) > 1 else ""
        matrix = _matrix_of(own, data, len(each) > 1)
        figures[f"stabilisation{end}.png"] = draw_stabilisation(own, matrix)
        figures[f"synthesis{end}.png"] = draw_synthesis(own, matrix)
    return save_figures(figures, folder)


@verb
def draw_stabilisation(result: IdentifiedModes, data: Data | ResponseMatrix | None = None) -> Figure:
    """All poles of every model order over frequency, the modes as vertical lines, over the mode indicator functions.

    One setup in a figure: of the modes of several, draw those in `setups`. Raises OptionError for more, and for data
    that the modes are not from.
    """
    poles = _one_diagram(result)
    figure = new_chart((8.6, 5.2))
    axes = figure.subplots()
    if data is not None:
        matrix = data if isinstance(data, ResponseMatrix) else _matrix_of(result, data, bool(result.setup))
        _indicators(axes, matrix)
    for label, own, colour, marker in CLASSES:
        at = own(poles.stable)
        dots = {"linestyle": "", "marker": marker, "color": colour, "markersize": 4 if marker != "." else 3}
        axes.plot(poles.frequency_hz[at], poles.order[at], label=label, markerfacecolor="none", **dots)
    for hz, evidence in zip(result.frequency_hz, result.evidence, strict=True):
        axes.axvline(hz, color=SERIES[1], linewidth=0.4 + 0.8 * evidence.confidence, zorder=1)
    axes.set_xlabel("frequency, Hz", fontsize=9)
    axes.set_ylabel("model order", fontsize=9)
    axes.set_ylim(0, poles.order.max(initial=1) * 1.12)
    style(axes)
    legend_above(axes)
    headline(figure, _title(result))
    foot(figure, (), result.notes)
    return figure


def _indicators(axes: Axes, matrix: ResponseMatrix) -> None:
    behind = axes.twinx()
    for k, values in enumerate(mode_indicators(matrix).T):
        colour = SERIES[0] if k == 0 else "#8fb0d6"
        behind.semilogy(matrix.frequency_hz, values, color=colour, linewidth=0.9, alpha=0.8, zorder=0)
    behind.set_ylabel("mode indicator functions", fontsize=8, color=SERIES[0])
    behind.tick_params(labelsize=7, colors=INK)
    behind.spines["top"].set_visible(False)
    axes.set_zorder(behind.get_zorder() + 1)
    axes.patch.set_visible(False)
    axes.set_xlim(matrix.frequency_hz[0], matrix.frequency_hz[-1])


@verb
def draw_synthesis(
    result: IdentifiedModes, data: Data | ResponseMatrix, *, pairs: Sequence[tuple[str, str]] | None = None
) -> Figure:
    """Magnitude of measured responses, and of those that modes and residuals give back, in panels.

    `pairs` are (output, input) by name; by default the largest responses, twelve at most. One setup in a figure. Raises
    OptionError for more, for pairs that there are not, and for data that the modes are not from.
    """
    _one_diagram(result)
    matrix = data if isinstance(data, ResponseMatrix) else _matrix_of(result, data, bool(result.setup))
    given = modes_of_setup(result, matrix)
    chosen = _pairs(matrix, pairs)
    columns = min(3, len(chosen))
    rows = -(-len(chosen) // columns)
    figure = new_chart((1.0 + 2.9 * columns, 0.8 + 1.9 * rows))
    panels = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for panel in panels.flat[len(chosen) :]:
        panel.set_visible(False)
    for panel, (i, j) in zip(panels.flat, chosen, strict=False):
        panel.semilogy(matrix.frequency_hz, np.abs(matrix.response[:, i, j]), color=SERIES[0], lw=0.9, label="measured")
        panel.semilogy(matrix.frequency_hz, np.abs(given[:, i, j]), color=SERIES[1], lw=0.9, ls="--", label="modes")
        for hz in result.frequency_hz:
            panel.axvline(hz, color=FAINT, linewidth=0.6, zorder=0)
        title = f"{matrix.outputs[i].name} / {matrix.inputs[j].name}"
        panel.set_title(title, fontsize=8, color=INK, parse_math=False)
        style(panel)
    legend_of(figure, panels[0, 0])
    figure.supxlabel("frequency, Hz", fontsize=8)
    headline(figure, _title(result))
    foot(figure, (), result.notes)
    return figure


def _pairs(matrix: ResponseMatrix, pairs: Sequence[tuple[str, str]] | None) -> list[tuple[int, int]]:
    outputs, inputs = [c.name for c in matrix.outputs], [c.name for c in matrix.inputs]
    if pairs is None:
        size = np.abs(matrix.scaled).max(axis=0)
        order = ranked(size.ravel())[:MOST_PANELS]
        return sorted((int(k // len(inputs)), int(k % len(inputs))) for k in order)
    for output, into in pairs:
        if output not in outputs or into not in inputs:
            raise OptionError(
                f"there is no response {output} / {into}; outputs: {', '.join(outputs)}; inputs: {', '.join(inputs)}"
            )
    if not 0 < len(pairs) <= MOST_PANELS:
        raise OptionError(f"between 1 and {MOST_PANELS} responses are drawn, not {len(pairs)}")
    return [(outputs.index(output), inputs.index(into)) for output, into in pairs]


def _matrix_of(result: IdentifiedModes, data: Data, several: bool) -> ResponseMatrix:
    """The responses that the modes of one setup are from."""
    frfs = [frf for frf in frfs_of(data)[1] if not several or frf.setup == result.setup]
    if not frfs:
        raise OptionError(f"the data have no setup {result.setup!r}, which the modes are from")
    matrix = response_matrices(frfs, result.band, together=not several)[0]
    if [c.name for c in matrix.outputs] != [c.name for c in result.outputs]:
        raise OptionError("the modes are not from these data: their outputs differ")
    return matrix


def _one_diagram(result: IdentifiedModes) -> Poles:
    if len(result.diagram) != 1:
        raise OptionError(f"these are modes of {len(result.diagram)} setups: draw those of each, in `setups`")
    return result.diagram[0]


def _title(result: IdentifiedModes) -> str:
    n = len(result.poles)
    where = f", {result.setup}" if result.setup and result.setup != result.name else ""
    return f"{result.name}{where}: {n} mode{'s' * (n != 1)}, synthesis error {100 * result.synthesis_error:.2g} %"
