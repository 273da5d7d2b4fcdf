"""Responses, computed and measured: Bode and Nyquist plots, time, matrices, stabilisation diagrams, virtual tests."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MultipleLocator

from flexura.analysis import (
    Backbone,
    Budget,
    FrequencyResponse,
    NonlinearResponse,
    Pair,
    ResponseCurve,
    ResponseGroup,
    TimeResponse,
    backbone_chart,
    budget_chart,
    heard,
    nonlinear_response_chart,
    response_chart,
    response_group,
    response_units,
)
from flexura.arguments import verb
from flexura.charts import Axis, Chart, Curve, Mark, Panel
from flexura.errors import OptionError
from flexura.linalg import leading, ranked
from flexura.tables import counted, in_hz
from flexura.testing.identification import Data, matrices_of, mode_indicators, modes_of_setup
from flexura.testing.measurement import IdentifiedModes, Poles, ResponseMatrix
from flexura.testing.updating import MeasuredFrequencies
from flexura.testing.virtual import VirtualTest
from flexura.view.drawing import (
    FAINT,
    GREY,
    INK,
    SERIES,
    draw_marks,
    draw_panel,
    frequency_axis,
    headline,
    legend_above,
    legend_of,
    new_chart,
    panel_grid,
    plain_axes,
    remark_lines,
    shortened,
    style,
    value_axis,
    written_below,
)
from flexura.view.mechanisms import save_figures
from flexura.view.scene import Array

MOST_RESONANCES = 14
"""Resonances of which it is written what moves."""

MOST_CHANNELS = 12
"""Inputs, and outputs, in a matrix of responses."""

MOST_BUDGETS = 8
"""Outputs whose budgets are drawn."""

MOST_PANELS = 12
"""Measured responses in one figure."""

CLOSE = 0.022
"""Resonances nearer to each other, relative to the width of a logarithmic axis, have one label."""


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


@verb
def draw_bode(result: FrequencyResponse, pairs: Sequence[Pair] | None = None, *, unit: str | None = None) -> Figure:
    """Magnitude and phase over frequency of (output, input) pairs of one unit, resonances as numbered vertical lines
    with what moves in each.

    By default the pairs of the `unit`, or of the first one, that matter: at most eight different curves, none below a
    thousandth of the largest; what is left out is said. Raises OptionError for names and units that are not there.
    """
    group = _group(result, pairs, unit)
    hz, (magnitude, phase) = result.frequency_hz, response_chart(result, group).panels
    figure = new_chart((7.4, 5.8))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    draw_panel(upper, replace(magnitude, x=Axis()), width=1.2, size=10)
    draw_panel(lower, phase, width=1.2, size=10)
    frequency_axis(upper, float(hz[0]), float(hz[-1]))
    value_axis(upper, np.concatenate([np.abs(curve.H) for curve in group.curves]))
    low, high = lower.dataLim.intervaly
    lower.yaxis.set_major_locator(MultipleLocator(90 if high - low < 460 else 180))
    lower.set_ylim(min(low, -180) - 15, max(high, 0) + 15)
    headline(figure, result.name, result.warnings)
    written_below(figure, _left_out(group, 7.1), 6.5, GREY)
    written_below(figure, _numbered(lower, result))
    legend_above(upper)
    return figure


@verb
def draw_nyquist(result: FrequencyResponse, pairs: Sequence[Pair] | None = None, *, unit: str | None = None) -> Figure:
    """Imaginary over real part of (output, input) pairs of one unit, both to one scale; pairs and errors as in
    `draw_bode`."""
    group = _group(result, pairs, unit)
    figure = new_chart((5.6, 6.0))
    axes = figure.subplots()
    curves = [Curve(curve.H.real, curve.H.imag, curve.label) for curve in group.curves]
    draw_panel(
        axes, Panel(curves, Axis("real part", group.unit), Axis("imaginary part", group.unit)), width=1.2, size=10
    )
    axes.axhline(0, color=FAINT, linewidth=0.8, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.8, zorder=0)
    plain_axes(axes)
    axes.set_aspect("equal", adjustable="datalim")
    headline(figure, result.name, result.warnings)
    written_below(figure, _left_out(group, 5.3), 6.5, GREY)
    legend_above(axes)
    return figure


def _group(result: FrequencyResponse, pairs: Sequence[Pair] | None, unit: str | None) -> ResponseGroup:
    """The responses to draw. Raises OptionError."""
    if pairs is None:
        units = response_units(result)
        if unit is not None and unit not in units:
            raise OptionError(f"there is no response in {unit!r}; units are {', '.join(units)}")
        return response_group(result, units[0] if unit is None else unit)
    if not pairs:
        raise OptionError("there is nothing to draw: no pair of output and input is given")
    responses = [result.of(*pair) for pair in pairs]
    units = [result.unit(*pair) for pair in pairs]
    is_mixed = len(set(units)) > 1
    curves = [
        ResponseCurve([pair], response, f"  [{unit}]" if is_mixed else "")
        for pair, response, unit in zip(pairs, responses, units, strict=True)
    ]
    return ResponseGroup("" if is_mixed else units[0], curves, [])


def _left_out(group: ResponseGroup, width: float) -> list[str]:
    """Which responses a figure leaves out, in words, for a width in inches."""
    if not group.left_out:
        return []
    names = "; ".join(f"{o} / {i}" for o, i in group.left_out[:6]) + (" ..." if len(group.left_out) > 6 else "")
    count = len(group.left_out) + sum(len(curve.pairs) for curve in group.curves)
    text = f"{len(group.left_out)} of {count} responses in {group.unit} are left out, the smallest: {names}"
    return remark_lines([text], "not shown", width, 6.5)


def _numbered(axes: Axes, result: FrequencyResponse) -> list[str]:
    """Write the numbers of resonances at the top of axes, close ones together; what moves in them, in words."""
    hz = result.resonances_hz
    if not len(hz):
        return []
    low, high = np.log(result.frequency_hz[[0, -1]])
    far = np.flatnonzero(np.diff(np.log(hz)) > CLOSE * max(high - low, 1e-9)) + 1
    for cluster in np.split(np.arange(len(hz)), far):
        text = f"{cluster[0] + 1}" if len(cluster) == 1 else f"{cluster[0] + 1}-{cluster[-1] + 1}"
        at = float(np.exp(np.log(hz[cluster]).mean()))
        axes.text(at, 1.0, text, size=6.5, color=GREY, ha="center", va="bottom", transform=axes.get_xaxis_transform())
    lines = [
        f"{k + 1}  {in_hz(f, 4)}" + (f"  {shortened(motion.partition(' (')[0], 64)}" if motion else "")
        for k, (f, motion) in enumerate(itertools.zip_longest(hz, result.resonance_motions))
    ]
    rest = len(lines) - MOST_RESONANCES
    return lines[:MOST_RESONANCES] + ([f"and {rest} more resonances"] if rest > 0 else [])


@verb
def draw_time(result: TimeResponse, outputs: Sequence[str] | None = None) -> Figure:
    """Inputs above, and below them outputs over time, those of one unit in one panel.

    Raises OptionError for outputs that are not there.
    """
    names = [c.name for c in result.outputs] if outputs is None else list(outputs)
    responses = {name: result.of(name) for name in names}
    unit = {c.name: c.unit for c in result.outputs}
    curves: dict[Axis, list[Curve]] = {}
    for channel, signal in zip(result.inputs, result.signals, strict=True):
        curves.setdefault(Axis("input", channel.unit), []).append(Curve(result.time, signal, channel.name))
    for name, response in responses.items():
        curves.setdefault(Axis("", unit[name]), []).append(Curve(result.time, response, name))
    figure = new_chart((7.4, 1.2 + 1.9 * len(curves)))
    every_axes = figure.subplots(len(curves), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (along, listed) in zip(every_axes, curves.items(), strict=True):
        draw_panel(axes, Panel(listed, y=along))
        plain_axes(axes)
        axes.margins(x=0.0)
        legend_above(axes)
    every_axes[-1].set_xlabel("time, s", fontsize=10)
    headline(figure, result.name, result.warnings)
    return figure


@verb
def draw_budget(result: Budget, outputs: Sequence[str] | None = None) -> Figure:
    """Amplitude density of outputs on the left, and on the right their cumulative amplitude, with that of every source.

    By default of the first eight. Raises OptionError for outputs that are not there.
    """
    names = [c.name for c in result.outputs]
    chosen = names[:MOST_BUDGETS] if outputs is None else list(outputs)
    unknown = next((name for name in chosen if name not in names), None)
    if unknown is not None:
        raise OptionError(f"there is no output {unknown!r}; known: {', '.join(names)}")
    hz = result.frequency_hz
    figure = new_chart((9.0, 0.8 + 2.4 * len(chosen)))
    rows = figure.subplots(len(chosen), 2, sharex=True, squeeze=False)
    for (left, right), name in zip(rows, chosen, strict=True):
        density, cumulative = budget_chart(result, names.index(name)).suited().panels
        draw_panel(left, replace(density, x=Axis(), title=name), width=1.2)
        draw_panel(right, replace(cumulative, x=Axis(), title=f"cumulative amplitude of {name}"), width=1.2)
        right.set_ylim(bottom=0)
        right.legend(fontsize=6, frameon=False)
        for axes in (left, right):
            frequency_axis(axes, float(hz[0]), float(hz[-1]))
    headline(figure, result.name, result.warnings)
    return figure


@verb
def draw_backbone(result: Backbone) -> Figure:
    """Amplitude over frequency of free motions, dashed where they are unstable."""
    return _over_frequency(backbone_chart(result), result)


@verb
def draw_nonlinear_response(result: NonlinearResponse) -> Figure:
    """Largest values of outputs over frequency, dashed where motions are unstable."""
    return _over_frequency(nonlinear_response_chart(result), result)


def _over_frequency(chart: Chart, result: Backbone | NonlinearResponse) -> Figure:
    """Panels one below the other."""
    panels = chart.suited().panels
    figure = new_chart((5.5, 0.8 + 2.8 * len(panels)))
    for axes, panel in zip(figure.subplots(len(panels), 1, squeeze=False)[:, 0], panels, strict=True):
        draw_panel(axes, panel, width=1.2)
        axes.set_ylim(bottom=0)
        if len(panel.curves) > 1:
            axes.legend(fontsize=6, frameon=False)
    headline(figure, result.headline, result.warnings)
    return figure


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
    magnitude, hz, is_heard = np.abs(result.response), result.frequency_hz, heard(result)
    for i, output in enumerate(result.outputs):
        for j, axes in enumerate(panels[i]):
            curves = [Curve(hz, magnitude[:, i, j], style={"color": SERIES[0]})] if is_heard[i, j] else []
            draw_panel(axes, Panel(curves, marks=list(map(Mark, result.resonances_hz))), width=0.9)
            if not curves:
                zero = {"color": "#8a93a0", "fontsize": 9, "ha": "center", "va": "center"}
                axes.text(0.5, 0.5, "0", transform=axes.transAxes, **zero)
        _whole_decades(panels[i, 0], magnitude[:, i, is_heard[i]])
        for axes in panels[i]:
            frequency_axis(axes, float(hz[0]), float(hz[-1]), room=7)
            axes.minorticks_off()
            is_first = axes is panels[i, 0]
            axes.tick_params(labelsize=6, labelbottom=i == p - 1, labelleft=is_first, length=2)
        panels[i, 0].set_ylabel(_channel_label(output.name, output.unit), fontsize=7, color=INK, parse_math=False)
    for axes, channel in zip(panels[0], result.inputs, strict=True):
        axes.set_title(_channel_label(channel.name, channel.unit), fontsize=7, color=INK, parse_math=False)
    figure.supxlabel("frequency, Hz", fontsize=8)
    headline(figure, result.name, result.warnings)
    return figure


def _channel_label(name: str, unit: str) -> str:
    return f"{shortened(name, 26)}\n[{unit}]"


def _whole_decades(axes: Axes, values: Array) -> None:
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


@verb
def save_identification(result: IdentifiedModes, folder: Path | str, *, data: Data) -> list[Path]:
    """Write `stabilisation.png` and `synthesis.png`, one for every setup where there are several, into a folder.

    Files appear complete or not at all. Raises OptionError when the folder cannot be written to, and for `data` that
    the modes are not from.
    """
    setups = result.setups or (result,)
    figures = {}
    for k, setup in enumerate(setups):
        end = f"_{k + 1:02d}" if len(setups) > 1 else ""
        matrix = _matrix_of(setup, data, len(setups) > 1)
        figures[f"stabilisation{end}.png"] = draw_stabilisation(setup, matrix)
        figures[f"synthesis{end}.png"] = draw_synthesis(setup, matrix)
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
        _draw_indicators(axes, _matrix_of(result, data, bool(result.setup)))
    # bits of `stable`: frequency 1, damping 2, shape 4
    poles_by_class = (
        ("pole", (poles.stable & 3) != 3, "#c9ced6", "."),
        ("frequency and damping stable", (poles.stable & 7) == 3, "#b8860b", "x"),
        ("shape stable too", (poles.stable & 7) == 7, "#2c8a4b", "o"),
    )
    curves = [
        Curve(
            poles.frequency_hz[chosen],
            poles.order[chosen],
            name,
            style={"ls": "", "marker": marker, "color": colour, "ms": 3 if marker == "." else 4, "mfc": "none"},
        )
        for name, chosen, colour, marker in poles_by_class
    ]
    draw_panel(axes, Panel(curves, Axis("frequency", "Hz"), Axis("model order")), size=9)
    for hz, evidence in zip(result.frequency_hz, result.evidence, strict=True):
        axes.axvline(hz, color=SERIES[1], linewidth=0.4 + 0.8 * evidence.confidence, zorder=1)
    axes.set_ylim(0, poles.order.max(initial=1) * 1.12)
    legend_above(axes)
    headline(figure, _modes_title(result), notes=result.notes)
    return figure


def _draw_indicators(axes: Axes, matrix: ResponseMatrix) -> None:
    """Mode indicator functions behind the poles, on an axis of their own."""
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
    matrix = _matrix_of(result, data, bool(result.setup))
    synthesis = modes_of_setup(result, matrix)
    chosen, hz = _chosen_pairs(matrix, pairs), matrix.frequency_hz
    columns = min(3, len(chosen))
    rows = -(-len(chosen) // columns)
    size = (1.0 + 2.9 * columns, 0.8 + 1.9 * rows)
    figure, panels = panel_grid(len(chosen), (rows, columns), size, sharex=True)
    for axes, (i, j) in zip(panels, chosen, strict=True):
        measured = Curve(hz, np.abs(matrix.response[:, i, j]), "measured")
        given_back = Curve(hz, np.abs(synthesis[:, i, j]), "modes", "dashed")
        title = f"{matrix.outputs[i].name} / {matrix.inputs[j].name}"
        panel = Panel([measured, given_back], y=Axis(log=True), title=title, marks=list(map(Mark, result.frequency_hz)))
        draw_panel(axes, panel, width=0.9)
    legend_of(figure, panels[0])
    figure.supxlabel("frequency, Hz", fontsize=8)
    headline(figure, _modes_title(result), notes=result.notes)
    return figure


def _chosen_pairs(matrix: ResponseMatrix, pairs: Sequence[tuple[str, str]] | None) -> list[tuple[int, int]]:
    """Outputs and inputs, by position, of named responses, or of the largest. Raises OptionError."""
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


def _matrix_of(result: IdentifiedModes, data: Data | ResponseMatrix, has_setups: bool) -> ResponseMatrix:
    """The responses that the modes of one setup are from. Raises OptionError."""
    if isinstance(data, ResponseMatrix):
        return data
    matrices = matrices_of(data, result.band, together=not has_setups).matrices
    matrix = next((one for one in matrices if not has_setups or one.setup == result.setup), None)
    if matrix is None:
        raise OptionError(f"the data have no setup {result.setup!r}, which the modes are from")
    if [c.name for c in matrix.outputs] != [c.name for c in result.outputs]:
        raise OptionError("the modes are not from these data: their outputs differ")
    return matrix


def _one_diagram(result: IdentifiedModes) -> Poles:
    """The poles of modes of one setup. Raises OptionError for several."""
    if len(result.diagram) != 1:
        raise OptionError(f"these are modes of {len(result.diagram)} setups: draw those of each, in `setups`")
    return result.diagram[0]


def _modes_title(result: IdentifiedModes) -> str:
    setup = f", {result.setup}" if result.setup and result.setup != result.name else ""
    error = f"synthesis error {100 * result.synthesis_error:.2g} %"
    return f"{result.name}{setup}: {counted(len(result.poles), 'mode')}, {error}"


@verb
def save_virtual_test(
    result: VirtualTest, folder: Path | str, *, measured: MeasuredFrequencies | None = None
) -> list[Path]:
    """Write `virtual_test.png` and the pictures of the identification into a folder, each complete or not at all.

    Raises OptionError when the folder cannot be written to, and for a test without frequency responses.
    """
    paths = save_figures({"virtual_test.png": draw_virtual_test(result, measured)}, folder)
    if result.identified is not None:
        paths += save_identification(result.identified, folder, data=result.measurement)
    return paths


@verb
def draw_virtual_test(result: VirtualTest, measured: MeasuredFrequencies | None = None) -> Figure:
    """The largest frequency response of every placement, its coherence, and the shift of every mode in per cent.

    Vertical lines: modes without sensors dashed, identified ones full, `measured` frequencies dotted. Raises
    OptionError for a test without frequency responses.
    """
    frfs = result.measurement.frfs
    if not frfs:
        raise OptionError("; ".join(result.notes) or "the test has no frequency responses")
    magnitudes, coherences = [], []
    for k, frf in enumerate(frfs):
        size = np.abs(frf.response).max(axis=0)
        i, j = np.unravel_index(int(leading(size.ravel())), size.shape)
        name = f"{frf.outputs[i].name} / {frf.inputs[j].name}" + (f", {frf.setup}" if frf.setup else "")
        colour = {"color": SERIES[k % len(SERIES)]}
        magnitudes.append(Curve(frf.frequency_hz, np.abs(frf.response[:, i, j]), name))
        if frf.coherence is not None:
            coherences.append(Curve(frf.frequency_hz, frf.coherence[:, i, j], style=colour))
    figure = new_chart((9.0, 6.4))
    upper, middle, lower = figure.subplots(3, 1, height_ratios=(3, 1, 1.4))
    draw_panel(upper, Panel(magnitudes, y=Axis("", "(m/s²)/N", log=True)))
    _draw_frequencies(upper, result, measured)
    draw_panel(middle, Panel(coherences, Axis("frequency", "Hz"), Axis("coherence")), width=0.9)
    legend_above(upper)
    middle.set_ylim(0, 1.05)
    for axes in (upper, middle):
        axes.set_xlim(*result.band)
    _draw_shifts(lower, result)
    title = f"{result.name}: virtual test, {counted(len(result.measurement.recordings), 'hit')}"
    headline(figure, title, notes=result.notes)
    return figure


def _draw_frequencies(axes: Axes, result: VirtualTest, measured: MeasuredFrequencies | None) -> None:
    """Vertical lines at natural frequencies: of the model, identified, measured."""
    for name, frequencies, colour, dashes in (
        ("without sensors", [m.bare_hz for m in result.modes], INK, "--"),
        ("identified", [m.identified_hz for m in result.modes if m.identified_hz is not None], "#9aa3ad", "-"),
        ("measured", [] if measured is None else measured.frequency_hz.tolist(), INK, ":"),
    ):
        for k, hz in enumerate(frequencies):
            draw_marks(axes, [hz], lw=0.8, color=colour, ls=dashes, label="" if k else name)


def _draw_shifts(axes: Axes, result: VirtualTest) -> None:
    """Shift of every mode by the mass of the sensors of each placement, lines true and marks identified."""
    numbers = np.array([m.number for m in result.modes])
    bare = np.array([m.bare_hz for m in result.modes])
    for k, placement in enumerate(result.test.placed()):
        colour, at = SERIES[k % len(SERIES)], numbers + 0.12 * (k - len(result.mass_loaded) / 2)
        hz = np.array([m.placement_hz[placement] for m in result.modes], dtype=float).reshape(-1, 2)
        true, identified = 100 * (hz.T / bare - 1)
        axes.bar(at, true, width=0.1, color=colour, alpha=0.35)
        axes.plot(at, identified, linestyle="", marker="_", markersize=7, color=colour)
    axes.axhline(0, color=INK, linewidth=0.6)
    axes.set_xticks(numbers)
    axes.set_xlabel("mode (bars: true, marks: identified)", fontsize=8)
    axes.set_ylabel("shift by sensors, %", fontsize=8)
    style(axes)
