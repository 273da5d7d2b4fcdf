"""Modes side by side: test and model, beams and solid; the errors of the beams, and sensors on the mechanism."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.charts import Axis, Curve, Mark, Panel
from flexura.errors import OptionError
from flexura.linalg import ranked
from flexura.solid.verification import ShapePairs, Verification, VerificationRow
from flexura.tables import in_hz
from flexura.testing.correlation import Correlation, FRFOverlay
from flexura.testing.virtual import SensorPlacement
from flexura.view.drawing import (
    GREY,
    GRID,
    INK,
    MODE_SIZE,
    SERIES,
    Box,
    Camera,
    Painting,
    View,
    camera_for,
    colour_bar,
    draw_matrix,
    draw_panel,
    frame,
    good_camera,
    heading,
    headline,
    legend,
    legend_of,
    mode_colours,
    mode_scale,
    mode_view,
    new_chart,
    new_figure,
    paint,
    painting_of,
    panel_grid,
    pixel_axes,
    remark_lines,
    rest_colours,
    triad,
    without_frame,
    write,
)
from flexura.view.mechanisms.files import save_figures
from flexura.view.scene import Solids, meshed_solids, solids

PAIR_SIZE = (12.0, 5.6)
"""Width and height of a pair of pictures, inches."""

AREAS: tuple[Box, Box] = ((0.02, 0.04, 0.42, 0.74), (0.475, 0.04, 0.42, 0.74))
"""Where the two of a pair are drawn."""

MOST_NUMBERS = 14
"""Matrices with more rows or columns show colours alone."""

MOST_PANELS = 24
"""Responses in one figure."""

MOST_SENSORS = 28
"""Sensors whose independence is listed."""

SENSOR = "#c2185b"
"""Colour of sensors and measured values."""

MARKS = {"plain": ("#c0392b", "o"), "corrected": ("#1f5fa8", "s"), "as": ("#2c8a4b", "D")}
"""Colour and marker of a row of a verification, by the first word of its label."""


@verb
def save_correlation(result: Correlation, folder: Path | str) -> list[Path]:
    """Write `correlation.png`, `pair_01.png` and so on for every pair, and `frf_01.png` and so on, into a folder.

    Files appear complete or not at all. Raises OptionError when the folder cannot be written to.
    """
    figures = {"correlation.png": draw_correlation(result)}
    camera = good_camera(solids(result.model))
    figures |= {f"pair_{p.test:02d}.png": draw_shape_pair(result, p.test, camera=camera) for p in result.pairs}
    figures |= {
        f"frf_{k + 1:02d}.png": draw_frf_overlay(result, k)
        for k, overlay in enumerate(result.frfs)
        if len(overlay.measured.frequency_hz)
    }
    return save_figures(figures, folder)


@verb
def draw_correlation(result: Correlation) -> Figure:
    """Draw MAC of test and model with the pairs framed, AutoMAC of the model, cross-orthogonality, and CoMAC.

    Returns a matplotlib Figure.
    """
    figure = new_chart((11.0, 9.0))
    panels = figure.subplots(2, 2)
    test = [f"{k + 1}  {in_hz(hz, 4)}" for k, hz in enumerate(result.test_hz)]
    model = [f"{k + 1}  {in_hz(hz, 4)}" for k, hz in enumerate(result.model_hz)]
    columns = [f"{k + 1}\n{hz:.4g}" for k, hz in enumerate(result.model_hz)]
    _draw_criterion(panels[0, 0], result.mac, (test, columns), "MAC: test (rows), model (columns)")
    for pair in result.pairs:
        corner, style = (pair.model - 1.5, pair.test - 1.5), {"fill": False, "edgecolor": SENSOR, "linewidth": 1.8}
        panels[0, 0].add_patch(Rectangle(corner, 1, 1, **style))
    _draw_criterion(panels[0, 1], result.auto_mac_model, (model, columns), "AutoMAC of the model at the sensors")
    pairs = [f"{pair.test}  {in_hz(pair.test_hz, 4)}" for pair in result.pairs]
    partners = [f"{pair.model}\n{pair.model_hz:.4g}" for pair in result.pairs]
    title = f"cross-orthogonality, reduced mass by {result.reduced_mass}"
    _draw_criterion(panels[1, 0], result.cross_orthogonality, (pairs, partners), title)
    _draw_comac(panels[1, 1], result)
    headline(figure, f"{result.test_name} against {result.name}", notes=result.notes)
    return figure


def _draw_criterion(axes: Axes, values: Array, labels: tuple[list[str], list[str]], title: str) -> None:
    """A matrix of numbers between 0 and 1 as colours, and as text where there is room."""
    if values.size:
        is_small = max(values.shape) <= MOST_NUMBERS
        texts = np.vectorize("{:.2f}".format)(values) if is_small else None
        draw_matrix(axes, values, texts, labels, title=title, size=7 if is_small else 5)
        return
    axes.set_title(title, size=9, color=INK)
    axes.text(0.5, 0.5, "no pairs", ha="center", va="center", size=9, color="0.5", transform=axes.transAxes)
    axes.set_axis_off()


def _draw_comac(axes: Axes, result: Correlation) -> None:
    """CoMAC of every channel, and its gain where that is out of the ordinary."""
    names = [match.channel.name for match in result.matched]
    values = np.nan_to_num(result.comac)
    axes.barh(range(len(names)), values, color=SERIES[0], height=0.7)
    for k, gain in enumerate(result.gain):
        if np.isfinite(gain):
            axes.text(min(values[k] + 0.01, 1.0), k, f"x {gain:.2f}", size=6.5, va="center", color=GREY)
    axes.tick_params(colors=INK, labelsize=7)
    axes.set_yticks(range(len(names)), names, size=7 if len(names) <= MOST_NUMBERS else 5)
    axes.invert_yaxis()
    axes.set_xlim(0, 1.12)
    axes.set_title("CoMAC of the channels over the pairs; x gain of the channel", size=9, color=INK)
    without_frame(axes, "top", "right")


def _draw_pair(
    sides: Sequence[tuple[Solids, float] | None], names: Sequence[str], camera: Camera, title: str, subtitle: str
) -> tuple[Figure, list[View]]:
    """A figure of two modes side by side, each a scene and the factor on its motions, and their views."""
    figure = new_figure(PAIR_SIZE)
    heading(figure, title, subtitle)
    views, paintings = [], []
    for side, name, area in zip(sides, names, AREAS, strict=True):
        middle = area[0] + area[2] / 2
        write(figure, middle, 0.82, name, ha="center", size=10, weight="bold")
        if side is None:
            write(figure, middle, 0.4, "no counterpart", ha="center", size=12, color="0.5")
            continue
        parts, factor = side
        views.append(mode_view(figure, parts, camera, factor, area))
        paintings.append(painting_of(parts, views[-1], mode_colours(parts), factor, over_ghost=True))
    paint(figure, Painting.joined(paintings))
    triad(figure, camera, (0.915, 0.03, 0.065, 0.065 * PAIR_SIZE[0] / PAIR_SIZE[1]))
    colour_bar(figure, (0.94, 0.30, 0.010, 0.44))
    return figure, views


@verb
def draw_shape_pair(result: Correlation, test: int, *, camera: Camera | None = None) -> Figure:
    """Draw a test mode, from 1, expanded to the mechanism, with what the sensors read, beside its counterpart.

    Close modes of the model are turned within their space to be nearest to the test's. Both are drawn to the scale of
    the model's mode. Returns a matplotlib Figure of 1800 x 840 pixels. Raises OptionError for a mode without a
    counterpart.
    """
    pair = next((p for p in result.pairs if p.test == test), None)
    if pair is None:
        known = ", ".join(str(p.test) for p in result.pairs) or "none"
        raise OptionError(f"test mode {test} has no counterpart in the model; those with one: {known}")
    shapes = result.expanded[:, :, test - 1], result.counterparts[:, :, result.pairs.index(pair)]
    scenes = [solids(result.model, shape) for shape in shapes]
    factor = min(mode_scale(parts) for parts in scenes if parts.largest_motion() > 0)
    within = ", ".join(map(str, pair.model_space))
    space = "" if len(pair.model_space) == 1 else f", {pair.space_mac:.3f} within modes {within}"
    damping = f"damping {100 * pair.damping_ratio:.2g} %"
    names = (
        "test, expanded to the mechanism; readings as arrows",
        f"model, mode {pair.model}: {in_hz(pair.model_hz)}",
    )
    figure, views = _draw_pair(
        [(parts, factor) for parts in scenes],
        names,
        camera or good_camera(solids(result.model)),
        f"test mode {test}: {in_hz(pair.test_hz)}",
        f"MAC {pair.mac:.3f}{space}; the model is {100 * pair.error:+.2f} % off; {damping}",
    )
    _draw_readings(figure, result, test - 1, factor, views[0])
    return figure


def _draw_readings(figure: Figure, result: Correlation, k: int, factor: float, view: View) -> None:
    """Displacements that sensors have read, as arrows from where they sit, to the scale of the picture."""
    sensors, used, shape = result.sensors, result.used, result.test_shapes[:, k]
    phase = np.angle(np.sum(shape**2)) / 2  # makes a shape as real as it can be
    reading = np.real(shape * np.exp(-1j * phase))
    dof = result.model.plan.topology.dof
    expanded = np.zeros(result.model.order)
    expanded[dof[dof >= 0]] = result.expanded[:, :, k][dof >= 0]
    expected = np.where(sensors.turns, result.reach, 1.0) * (sensors.rows @ expanded)
    size = float(reading[used] @ reading[used])
    reading = reading * (float(reading[used] @ expected[used]) / size if size else 0.0)
    is_shown = np.isfinite(sensors.positions).all(axis=1) & np.isfinite(sensors.directions).all(axis=1) & ~sensors.turns
    arrows = factor * reading[is_shown, None] * sensors.directions[is_shown]
    _draw_sensor_arrows(pixel_axes(figure, zorder=8), view, sensors.positions[is_shown], arrows)


def _draw_sensor_arrows(axes: Axes, view: View, points: Array, vectors: Array, names: Sequence[str] = ()) -> None:
    """Arrows (k, 3), m, at points (k, 3), with numbers and a dot at each."""
    tails, heads = view.pixels(points)[:, :2], view.pixels(points + vectors)[:, :2]
    dot = {"marker": "o", "markersize": 4, "color": SENSOR, "markeredgecolor": "white", "markeredgewidth": 0.6}
    arrow = {"arrowstyle": "-|>", "color": SENSOR, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
    text_style = {"size": 9, "weight": "bold", "ha": "center", "va": "center", "color": SENSOR}
    for k, (tail, head) in enumerate(zip(tails, heads, strict=True)):
        is_visible = np.linalg.norm(head - tail) > 4
        if is_visible:
            axes.annotate("", head, tail, arrowprops=arrow, annotation_clip=False)
        axes.plot(*tail, **dot)
        if names:
            apart = head - tail if is_visible else np.array([10.0, 10.0])
            x, y = head + 11 * apart / np.linalg.norm(apart)
            axes.text(x, y, names[k], **text_style)


@verb
def draw_frf_overlay(result: Correlation, number: int = 0) -> Figure:
    """Draw the magnitudes of measured responses, of set `number` from 0, over those of the model, with the FRAC.

    Returns a matplotlib Figure with at most 24 panels, those with the largest responses. Raises OptionError when there
    is no such set.
    """
    if not 0 <= number < len(result.frfs):
        raise OptionError(f"there is no set of responses {number}: the measurement has {len(result.frfs)} in the model")
    overlay = result.frfs[number]
    measured, hz, chosen = overlay.measured, overlay.measured.frequency_hz, _largest(overlay)
    columns = min(3, len(chosen))
    rows = -(-len(chosen) // columns)
    size = (1.0 + 3.6 * columns, 0.9 + 2.0 * rows)
    figure, panels = panel_grid(len(chosen), (rows, columns), size, sharex=True)
    for axes, (i, j) in zip(panels, chosen, strict=True):
        curves = [
            Curve(hz, np.abs(measured.response[:, i, j]), "measured", style={"color": SENSOR, "lw": 0.9}),
            Curve(hz, np.abs(overlay.response[:, i, j]), "model", style={"color": SERIES[0]}),
        ]
        title = f"{measured.outputs[i].name} / {measured.inputs[j].name}: FRAC {overlay.frac[i, j]:.2f}"
        marks = [Mark(at) for at in result.model_hz if at <= hz[-1]]
        draw_panel(axes, Panel(curves, y=Axis(log=True), title=title, marks=marks), size=7.5)
    legend_of(figure, panels[0])
    figure.supxlabel("frequency, Hz", fontsize=8)
    setup = f", {measured.setup}" if measured.setup else ""
    headline(figure, f"{result.test_name}{setup}: damping {overlay.damping}")
    return figure


def _largest(overlay: FRFOverlay) -> list[tuple[int, int]]:
    """Outputs and inputs of the largest responses, in their own order."""
    size = np.abs(overlay.measured.response).max(axis=0, initial=0.0)
    order = ranked(size.ravel())[:MOST_PANELS]
    return [(int(i), int(j)) for i, j in zip(*np.unravel_index(np.sort(order), size.shape), strict=True)]


@verb
def draw_sensors(placement: SensorPlacement) -> Figure:
    """Draw chosen sensors on the mechanism, numbered by importance, with their directions as arrows.

    Returns a matplotlib Figure of 1800 x 900 pixels. Sensors between two nodes are listed without a position.
    """
    parts = solids(placement.model)
    camera = good_camera(parts)
    figure = new_figure((12.0, 6.0))
    view = frame(figure, camera, parts.bounds(), (0.04, 0.16, 0.58, 0.72))
    paint(figure, painting_of(parts, view, rest_colours(parts), clear_bodies=True))
    is_placed = np.isfinite(placement.positions).all(axis=1)
    arrows = MODE_SIZE * parts.size() * placement.directions[is_placed]
    numbers = [str(k + 1) for k in np.flatnonzero(is_placed)]
    _draw_sensor_arrows(pixel_axes(figure, zorder=8), view, placement.positions[is_placed], arrows, numbers)
    subtitle = (
        f"{len(placement.sensors)} of {len(placement.candidates)} candidates for the first"
        f" {len(placement.frequency_hz)} modes; largest MAC of two modes {placement.worst_mac:.2f},"
        f" condition {placement.condition:.3g}"
    )
    heading(figure, placement.name, "; ".join((subtitle, *placement.notes)))
    legend(figure, parts)
    rows = zip(placement.sensors, placement.turns, placement.independence, strict=True)
    lines = [
        f"{k + 1}  {name}{' (rotation)' if is_rotation else ''}: {value:.2f}"
        for k, (name, is_rotation, value) in enumerate(rows)
    ]
    write(figure, 0.66, 0.84, "sensor: independence", size=10, weight="bold", va="top")
    write(figure, 0.66, 0.79, lines[:MOST_SENSORS], size=9, va="top", linespacing=1.5)
    return figure


@verb
def save_verification(result: Verification, folder: Path | str) -> list[Path]:
    """Write `solid_mode_01.png` and so on, beams and solid side by side, and `errors.png`, into a folder.

    Files appear complete or not at all. Raises OptionError when the folder cannot be written to, or before there is a
    solid.
    """
    camera = good_camera(solids(_shape_pairs(result).model))
    numbers = range(1, len(result.frequency_hz) + 1)
    figures = {
        f"solid_mode_{k:02d}.png": draw_mode_pair(result, k, elev=camera.elev, azim=camera.azim) for k in numbers
    }
    return save_figures({**figures, "errors.png": draw_verification(result)}, folder)


@verb
def draw_mode_pair(
    result: Verification, number: int, *, elev: float | None = None, azim: float | None = None
) -> Figure:
    """Draw a mode of the solid, from 1, and beside it that of the corrected beams, coloured by displacement.

    Each is scaled by its own largest displacement; elev, azim as in `draw_mechanism`. Returns a matplotlib Figure of
    1800 x 840 pixels. Raises OptionError before there is a solid, and for modes that there are not.
    """
    pairs = _shape_pairs(result)
    k = number - 1
    if not 0 <= k < len(result.frequency_hz):
        raise OptionError(f"there is no mode {number}: the solid has modes 1 to {len(result.frequency_hz)}")
    shape = np.asarray(pairs.solid.solution.shapes)[:, :, k]
    solid, beams = meshed_solids(pairs.model, shape, pairs.solid.surfaces, k), None
    if np.isfinite(pairs.beams[:, :, k]).all():
        beams = solids(pairs.model, pairs.beams[:, :, k])
    sides = [None if parts is None else (parts, mode_scale(parts)) for parts in (beams, solid)]
    error = result.uncertainty[k] if k < len(result.uncertainty) else None
    known = ", its own error not known" if error is None else f", to {100 * error:.2g} %"
    title = f"mode {number} of the solid: {in_hz(result.frequency_hz[k])}{known}"
    row = next(row for row in result.rows if row.model == pairs.label)
    camera = camera_for(solids(pairs.model), elev, azim)
    return _draw_pair(sides, ("corrected beams", "solid"), camera, title, _beam_mode_text(row, k))[0]


def _beam_mode_text(row: VerificationRow, k: int) -> str:
    """How near the beams' mode is."""
    columns = (row.frequency_hz, row.number, row.mac, row.error)
    hz, number, mac, error = (values[k] if values else None for values in columns)
    if hz is None or error is None or mac is None:
        return "the corrected beams have no mode of this shape"
    return f"mode {number} of the corrected beams: {in_hz(hz)}, {100 * error:+.2f} %, MAC {mac:.4f}"


def _shape_pairs(result: Verification) -> ShapePairs:
    if result.shapes is None:
        raise OptionError("there is nothing to draw: the solid has not been solved yet")
    return result.shapes


@verb
def draw_verification(result: Verification) -> Figure:
    """Errors of all rows over the modes, logarithmic, above the uncertainty of the solid itself.

    Filled marks lie above the solid's frequency and hollow ones below. Raises OptionError before there is a solid.
    """
    _shape_pairs(result)
    remarks = [*result.notes, *(f"{row.model}: {row.failure}" for row in result.rows if row.failure)]
    lines = remark_lines(remarks, "note", 7.6, 7.5)
    extra = 7.5 * 1.35 / 72 * len(lines) + (0.1 if lines else 0.0)
    figure = new_figure((8.0, 4.6 + extra))
    share = 4.6 / (4.6 + extra)
    low = 1 - share
    axes = figure.add_axes((0.1, low + 0.13 * share, 0.62, 0.74 * share))
    write(figure, 0.025, 0.02, lines, size=7.5, va="bottom", color=GREY)
    count = len(result.frequency_hz)
    rows = [row for row in result.rows if row.error]
    for k, row in enumerate(rows):
        _draw_errors(axes, row, (k - (len(rows) - 1) / 2) * 0.12)
    known = [(k, 100 * u) for k, u in enumerate(result.uncertainty) if u is not None]
    if known:
        at, height = np.array(known).T
        axes.bar(at + 1, height, 0.8, color="0.88", zorder=0, label="uncertainty of the solid")
    axes.set_yscale("log")
    errors = [100 * abs(e) for row in rows for e in row.error if e] + [u for _, u in known]
    axes.set_ylim(max(0.4 * min(errors, default=1.0), 1e-3), 2 * max(errors, default=1.0))
    axes.set_xlim(0.4, count + 0.6)
    axes.set_xticks(range(1, count + 1), [f"{k + 1}\n{in_hz(hz, 4)}" for k, hz in enumerate(result.frequency_hz)])
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_ylabel("error against the solid, %", size=9, color=INK)
    axes.tick_params(labelsize=8 if count <= 8 else 6, colors=INK)
    axes.grid(True, axis="y", **GRID)
    axes.set_axisbelow(True)
    without_frame(axes, "top", "right")
    figure.legend(loc="center left", bbox_to_anchor=(0.73, low + 0.5 * share), frameon=False, fontsize=8)
    write(figure, 0.985, low + 0.16 * share, "filled: too high\nhollow: too low", ha="right", size=8, color=GREY)
    write(figure, 0.1, low + 0.92 * share, result.name, size=11, weight="bold")
    return figure


def _draw_errors(axes: Axes, row: VerificationRow, shift: float) -> None:
    """The errors of a row, filled where it is too high."""
    colour, marker = MARKS[row.model.split()[0].rstrip(",")]
    errors = [(k + 1 + shift, 100 * e) for k, e in enumerate(row.error) if e]
    if not errors:
        return
    x, error = np.array(errors).T
    style = {"linestyle": "", "marker": "^" if "exact" in row.model else marker, "color": colour, "markersize": 5}
    style["alpha"] = 1.0 if "full" in row.model else 0.55
    axes.plot([], [], label=row.model, **style)
    for is_high, face in ((error > 0, colour), (error <= 0, "none")):
        axes.plot(x[is_high], abs(error[is_high]), markerfacecolor=face, **style)
