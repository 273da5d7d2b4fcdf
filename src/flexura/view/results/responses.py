"""Responses, computed and measured: Bode and Nyquist plots, time, matrices, stabilisation diagrams, virtual tests."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MultipleLocator
from numpy.typing import NDArray

from flexura.analysis import (
    FrequencyResponse,
    Pair,
    ResponseCurve,
    ResponseGroup,
    TimeResponse,
    heard,
    phase_in_degrees,
    response_group,
    response_units,
)
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.linalg import leading, ranked
from flexura.tables import counted, in_hz
from flexura.testing.identification import Data, frfs_of, mode_indicators, modes_of_setup
from flexura.testing.measurement import IdentifiedModes, Poles, ResponseMatrix, response_matrices
from flexura.testing.updating import MeasuredFrequencies
from flexura.testing.virtual import VirtualTest
from flexura.view.drawing import (
    CENTRED,
    FAINT,
    INK,
    SERIES,
    foot,
    frequency_axis,
    headline,
    legend_above,
    legend_of,
    new_chart,
    plain_axes,
    remark_lines,
    shortened,
    style,
    value_axis,
    written_below,
)
from flexura.view.mechanisms import save_figures

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
    if max(result.response.shape[1:]) <= MOST_CHANNELS:
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


MOST_CHANNELS = 12
"""Inputs, and outputs, in a matrix of responses."""


@verb
def draw_response_matrix(result: FrequencyResponse) -> Figure:
    """Magnitudes of all responses: a row for every output, a column for every input, one scale in each row.

    Raises OptionError for more than twelve inputs or outputs.
    """
    p, m = len(result.outputs), len(result.inputs)
    if max(p, m) > MOST_CHANNELS:
        raise OptionError(f"a matrix has at most {MOST_CHANNELS} inputs and outputs; name some of the {p} x {m}")
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
