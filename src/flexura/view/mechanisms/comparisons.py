"""Modes side by side: test and model, beams and solid; the errors of the beams, and sensors on the mechanism."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.linalg import ranked
from flexura.solid.verification import ShapePairs, Verification, VerificationRow
from flexura.tables import in_hz
from flexura.testing.correlation import Correlation, FRFOverlay
from flexura.testing.virtual import SensorPlacement
from flexura.view.drawing import (
    FAINT,
    INK,
    MODE_SIZE,
    SERIES,
    Box,
    Camera,
    Painting,
    View,
    camera_for,
    colour_bar,
    foot,
    frame,
    good_camera,
    heading,
    legend,
    legend_of,
    mode_painting,
    mode_scale,
    mode_view,
    new_chart,
    new_figure,
    paint,
    pixel_axes,
    remark_lines,
    rest_painting,
    triad,
)
from flexura.view.mechanisms.files import save_figures
from flexura.view.scene import meshed_solids, solids

AREAS: tuple[Box, Box] = ((0.02, 0.04, 0.42, 0.74), (0.475, 0.04, 0.42, 0.74))
"""Where test and model are drawn."""

MOST_NUMBERS = 14
"""Matrices with more rows or columns show colours alone."""

MOST_PANELS = 24
"""Responses in one figure."""

SENSOR = "#c2185b"
"""Colour of sensors and measured values."""


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
    model = [f"{k + 1}\n{hz:.4g}" for k, hz in enumerate(result.model_hz)]
    framed = [(p.test - 1, p.model - 1) for p in result.pairs]
    _matrix(panels[0, 0], result.mac, test, model, "MAC: test (rows), model (columns)", framed)
    rows = [f"{k + 1}  {in_hz(hz, 4)}" for k, hz in enumerate(result.model_hz)]
    _matrix(panels[0, 1], result.auto_mac_model, rows, model, "AutoMAC of the model at the sensors", [])
    pairs = [f"{p.test}  {in_hz(p.test_hz, 4)}" for p in result.pairs]
    partners = [f"{p.model}\n{p.model_hz:.4g}" for p in result.pairs]
    title = f"cross-orthogonality, reduced mass by {result.reduced_mass}"
    _matrix(panels[1, 0], result.cross_orthogonality, pairs, partners, title, [])
    _bars(panels[1, 1], result)
    figure.suptitle(f"{result.test_name} against {result.name}", size=11, color=INK)
    foot(figure, (), result.notes)
    return figure


def _matrix(
    axes: Axes, values: Array, rows: list[str], columns: list[str], title: str, framed: list[tuple[int, int]]
) -> None:
    """Numbers between 0 and 1 as colours and text."""
    axes.set_title(title, size=9, color=INK)
    if not values.size:
        axes.text(0.5, 0.5, "no pairs", ha="center", va="center", size=9, color="0.5", transform=axes.transAxes)
        axes.set_axis_off()
        return
    axes.imshow(values, vmin=0, vmax=1, cmap="Blues", aspect="auto")
    small = max(values.shape) <= MOST_NUMBERS
    if small:
        for (i, j), value in np.ndenumerate(values):
            colour = "white" if value > 0.6 else "0.3"
            axes.text(j, i, f"{value:.2f}", ha="center", va="center", size=7, color=colour)
    for i, j in framed:
        axes.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, edgecolor=SENSOR, linewidth=1.8))
    size = 7 if small else 5
    axes.set_xticks(range(len(columns)), columns, size=size)
    axes.set_yticks(range(len(rows)), rows, size=size)
    axes.tick_params(length=0, colors=INK)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _bars(axes: Axes, result: Correlation) -> None:
    """CoMAC of every channel, and its gain where that is out of the ordinary."""
    names = [m.channel.name for m in result.matched]
    values = np.nan_to_num(result.comac)
    axes.barh(range(len(names)), values, color=SERIES[0], height=0.7)
    for k, gain in enumerate(result.gain):
        if np.isfinite(gain):
            axes.text(min(values[k] + 0.01, 1.0), k, f"x {gain:.2f}", size=6.5, va="center", color="0.35")
    axes.set_yticks(range(len(names)), names, size=7 if len(names) <= MOST_NUMBERS else 5)
    axes.invert_yaxis()
    axes.set_xlim(0, 1.12)
    axes.set_title("CoMAC of the channels over the pairs; x gain of the channel", size=9, color=INK)
    axes.tick_params(colors=INK, labelsize=7)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


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
    expanded, own = result.expanded[:, :, test - 1], result.counterparts[:, :, result.pairs.index(pair)]
    parts = [solids(result.model, u) for u in (expanded, own)]
    camera = camera or good_camera(solids(result.model))
    figure = new_figure((12.0, 5.6))
    factor = min(mode_scale(p) for p in parts if p.largest_motion() > 0)
    views = [mode_view(figure, p, camera, factor, area) for p, area in zip(parts, AREAS, strict=True)]
    painted = [mode_painting(p, view, factor) for p, view in zip(parts, views, strict=True)]
    paint(figure, Painting.joined(painted))
    _readings(figure, result, test - 1, factor, views[0])
    space = "" if len(pair.model_space) == 1 else f", {pair.space_mac:.3f} within modes {_listed(pair.model_space)}"
    damping = f"damping {100 * pair.damping_ratio:.2g} %"
    text = f"MAC {pair.mac:.3f}{space}; the model is {100 * pair.error:+.2f} % off; {damping}"
    heading(figure, f"test mode {test}: {in_hz(pair.test_hz)}", text)
    names = (
        "test, expanded to the mechanism; readings as arrows",
        f"model, mode {pair.model}: {in_hz(pair.model_hz)}",
    )
    for (left, _, width, _), name in zip(AREAS, names, strict=True):
        figure.text(left + width / 2, 0.82, name, ha="center", size=10, weight="bold", color=INK, parse_math=False)
    triad(figure, camera, (0.915, 0.03, 0.065, 0.065 * 12.0 / 5.6))
    colour_bar(figure, (0.94, 0.30, 0.010, 0.44))
    return figure


def _readings(figure: Figure, result: Correlation, k: int, factor: float, view: View) -> None:
    """Displacements that sensors have read, as arrows from where they sit, to the scale of the picture."""
    sensors = result.sensors
    reading = np.real(result.test_shapes[:, k] * np.exp(-1j * _phase(result.test_shapes[:, k])))
    expected = result.sensors.rows @ _dof_vector(result, k)
    expected = np.where(sensors.turns, result.reach, 1.0) * expected
    used = result.used
    size = float(reading[used] @ reading[used])
    reading = reading * (float(reading[used] @ expected[used]) / size if size else 0.0)
    own = np.isfinite(sensors.positions).all(axis=1) & np.isfinite(sensors.directions).all(axis=1) & ~sensors.turns
    arrows = factor * reading[own, None] * sensors.directions[own]
    _arrows(pixel_axes(figure, zorder=8), view, sensors.positions[own], arrows)


def _phase(shape: NDArray[np.complex128]) -> float:
    """The phase that makes a shape as real as it can be."""
    return float(np.angle(np.sum(shape**2)) / 2)


def _dof_vector(result: Correlation, k: int) -> Array:
    """The expanded test shape over the DOFs of the model."""
    dof = result.model.plan.topology.dof
    vector = np.zeros(result.model.order)
    nodes, components = np.nonzero(dof >= 0)
    vector[dof[nodes, components]] = result.expanded[nodes, components, k]
    return vector


def _listed(numbers: tuple[int, ...]) -> str:
    return ", ".join(map(str, numbers))


def _arrows(axes: Axes, view: View, points: Array, vectors: Array, names: tuple[str, ...] = ()) -> None:
    """Arrows (k, 3), m, at points (k, 3), with numbers and a dot at each."""
    tails, heads = view.pixels(points)[:, :2], view.pixels(points + vectors)[:, :2]
    for k, (tail, head) in enumerate(zip(tails, heads, strict=True)):
        if np.linalg.norm(head - tail) > 4:
            style = {"arrowstyle": "-|>", "color": SENSOR, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", head, tail, arrowprops=style, annotation_clip=False)
        axes.plot(
            tail[0], tail[1], marker="o", markersize=4, color=SENSOR, markeredgecolor="white", markeredgewidth=0.6
        )
        if names:
            apart = head - tail if np.linalg.norm(head - tail) > 4 else np.array([10.0, 10.0])
            at = head + 11 * apart / np.linalg.norm(apart)
            axes.text(
                float(at[0]), float(at[1]), names[k], size=9, weight="bold", ha="center", va="center", color=SENSOR
            )


@verb
def draw_frf_overlay(result: Correlation, number: int = 0) -> Figure:
    """Draw the magnitudes of measured responses, of set `number` from 0, over those of the model, with the FRAC.

    Returns a matplotlib Figure with at most 24 panels, those with the largest responses. Raises OptionError when there
    is no such set.
    """
    if not 0 <= number < len(result.frfs):
        raise OptionError(f"there is no set of responses {number}: the measurement has {len(result.frfs)} in the model")
    overlay = result.frfs[number]
    chosen = _largest(overlay)
    columns = min(3, len(chosen))
    rows = -(-len(chosen) // columns)
    figure = new_chart((1.0 + 3.6 * columns, 0.9 + 2.0 * rows))
    panels = figure.subplots(rows, columns, sharex=True, squeeze=False)
    measured, hz = overlay.measured, overlay.measured.frequency_hz
    for axes, (i, j) in zip(panels.flat, chosen, strict=False):
        for f in result.model_hz[result.model_hz <= hz[-1]]:
            axes.axvline(f, color=FAINT, linewidth=0.6, zorder=0)
        axes.semilogy(hz, np.abs(measured.response[:, i, j]), color=SENSOR, linewidth=0.9, label="measured")
        axes.semilogy(hz, np.abs(overlay.response[:, i, j]), color=SERIES[0], linewidth=1.0, label="model")
        title = f"{measured.outputs[i].name} / {measured.inputs[j].name}: FRAC {overlay.frac[i, j]:.2f}"
        axes.set_title(title, fontsize=7.5, color=INK, parse_math=False)
        axes.grid(True, color="#e8ebef", linewidth=0.6)
        axes.tick_params(labelsize=7, colors=INK)
    for axes in list(panels.flat)[len(chosen) :]:
        axes.set_axis_off()
    legend_of(figure, panels[0, 0])
    figure.supxlabel("frequency, Hz", fontsize=8)
    setup = f", {measured.setup}" if measured.setup else ""
    figure.suptitle(f"{result.test_name}{setup}: damping {overlay.damping}", fontsize=10, color=INK)
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
    model = placement.model
    parts = solids(model)
    camera = good_camera(parts)
    figure = new_figure((12.0, 6.0))
    view = frame(figure, camera, parts.bounds(), (0.04, 0.16, 0.58, 0.72))
    paint(figure, rest_painting(parts, view, clear_bodies=True))
    own = np.isfinite(placement.positions).all(axis=1)
    reach = MODE_SIZE * parts.size()
    numbers = tuple(str(k + 1) for k in np.flatnonzero(own))
    axes = pixel_axes(figure, zorder=8)
    _arrows(axes, view, placement.positions[own], reach * placement.directions[own], numbers)
    heading(figure, placement.name, "; ".join((_subtitle(placement), *placement.notes)))
    legend(figure, parts)
    lines = [
        f"{k + 1}  {name}{' (rotation)' if turn else ''}: {value:.2f}"
        for k, (name, turn, value) in enumerate(
            zip(placement.sensors, placement.turns, placement.independence, strict=True)
        )
    ]
    figure.text(0.66, 0.84, "sensor: independence", size=10, weight="bold", va="top", color=INK)
    text = "\n".join(lines[:28])
    figure.text(0.66, 0.79, text, size=9, va="top", color=INK, linespacing=1.5, parse_math=False)
    return figure


def _subtitle(placement: SensorPlacement) -> str:
    """How well the sensors do."""
    count = len(placement.frequency_hz)
    return (
        f"{len(placement.sensors)} of {len(placement.candidates)} candidates for the first {count} modes;"
        f" largest MAC of two modes {placement.worst_mac:.2f}, condition {placement.condition:.3g}"
    )


SIZE = (12.0, 5.6)
"""Width and height of a pair of pictures, inches."""

MARKS = {"plain": ("#c0392b", "o"), "corrected": ("#1f5fa8", "s"), "as": ("#2c8a4b", "D")}
"""Colour and marker of a row, by the first word of its label."""


@verb
def save_verification(result: Verification, folder: Path | str) -> list[Path]:
    """Write `solid_mode_01.png` and so on, beams and solid side by side, and `errors.png`, into a folder.

    Files appear complete or not at all. Raises OptionError when the folder cannot be written to, or before there is a
    solid.
    """
    pairs = _pairs(result)
    camera = good_camera(solids(pairs.model))
    view = {"elev": camera.elev, "azim": camera.azim}
    numbers = range(1, len(result.frequency_hz) + 1)
    figures = {f"solid_mode_{k:02d}.png": draw_mode_pair(result, k, **view) for k in numbers}
    return save_figures({**figures, "errors.png": draw_verification(result)}, folder)


@verb
def draw_mode_pair(
    result: Verification, number: int, *, elev: float | None = None, azim: float | None = None
) -> Figure:
    """Draw a mode of the solid, from 1, and beside it that of the corrected beams, coloured by displacement.

    Each is scaled by its own largest displacement; elev, azim as in `draw_mechanism`. Returns a matplotlib Figure of
    1800 x 840 pixels. Raises OptionError before there is a solid, and for modes that there are not.
    """
    pairs = _pairs(result)
    k = number - 1
    if not 0 <= k < len(result.frequency_hz):
        raise OptionError(f"there is no mode {number}: the solid has modes 1 to {len(result.frequency_hz)}")
    camera = camera_for(solids(pairs.model), elev, azim)
    figure = new_figure(SIZE)
    row = next(row for row in result.rows if row.model == pairs.label)
    nodes = np.asarray(pairs.solid.solution.shapes)[:, :, k]
    moved = [(meshed_solids(pairs.model, nodes, pairs.solid.surfaces, k), AREAS[1])]
    if np.isfinite(pairs.beams[:, :, k]).all():
        moved.append((solids(pairs.model, pairs.beams[:, :, k]), AREAS[0]))
    else:
        figure.text(0.23, 0.4, "no counterpart", ha="center", size=12, color="0.5")
    painted = []
    for parts, area in moved:
        factor = mode_scale(parts)
        painted.append(mode_painting(parts, mode_view(figure, parts, camera, factor, area), factor))
    paint(figure, Painting.joined(painted))
    heading(
        figure,
        f"mode {number} of the solid: {in_hz(result.frequency_hz[k])}{_known(result, k)}",
        _beam_mode_text(row, k),
    )
    for (left, _, width, _), name in zip(AREAS, ("corrected beams", "solid"), strict=True):
        figure.text(left + width / 2, 0.82, name, ha="center", size=11, weight="bold", color=INK)
    triad(figure, camera, (0.915, 0.03, 0.065, 0.065 * SIZE[0] / SIZE[1]))
    colour_bar(figure, (0.94, 0.30, 0.010, 0.44))
    return figure


@verb
def draw_verification(result: Verification) -> Figure:
    """Errors of all rows over the modes, logarithmic, above the uncertainty of the solid itself.

    Filled marks lie above the solid's frequency and hollow ones below. Raises OptionError before there is a solid.
    """
    _pairs(result)
    remarks = [*result.notes, *(f"{row.model}: {row.failure}" for row in result.rows if row.failure)]
    said = remark_lines(remarks, "note", 7.6, 7.5)
    extra = 7.5 * 1.35 / 72 * len(said) + (0.1 if said else 0.0)
    figure = new_figure((8.0, 4.6 + extra))
    share = 4.6 / (4.6 + extra)
    low = 1 - share
    axes = figure.add_axes((0.1, low + 0.13 * share, 0.62, 0.74 * share))
    figure.text(0.025, 0.02, "\n".join(said), size=7.5, va="bottom", color="0.35", linespacing=1.35, parse_math=False)
    count = len(result.frequency_hz)
    rows = [row for row in result.rows if row.error]
    for k, row in enumerate(rows):
        _mark(axes, row, (k - (len(rows) - 1) / 2) * 0.12)
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
    axes.grid(True, axis="y", color="#e8ebef", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.legend(loc="center left", bbox_to_anchor=(0.73, low + 0.5 * share), frameon=False, fontsize=8)
    figure.text(0.985, low + 0.16 * share, "filled: too high\nhollow: too low", ha="right", size=8, color="0.35")
    figure.text(0.1, low + 0.92 * share, result.name, size=11, weight="bold", color=INK, parse_math=False)
    return figure


def _mark(axes: Axes, row: VerificationRow, shift: float) -> None:
    """The errors of a row, filled where it is too high."""
    colour, marker = MARKS[row.model.split()[0].rstrip(",")]
    full = 1.0 if "full" in row.model else 0.55
    marker = "^" if "exact" in row.model else marker
    found = [(k + 1 + shift, 100 * e) for k, e in enumerate(row.error) if e]
    if not found:
        return
    x, error = np.array(found).T
    style = {"linestyle": "", "marker": marker, "color": colour, "alpha": full, "markersize": 5}
    axes.plot([], [], label=row.model, **style)
    for above in (True, False):
        own = (error > 0) == above
        axes.plot(x[own], abs(error[own]), markerfacecolor=colour if above else "none", **style)


def _beam_mode_text(row: VerificationRow, k: int) -> str:
    """How near the beams' mode is."""
    hz, number, mac, error = (
        values[k] if values else None for values in (row.frequency_hz, row.number, row.mac, row.error)
    )
    if hz is None or error is None or mac is None:
        return "the corrected beams have no mode of this shape"
    return f"mode {number} of the corrected beams: {in_hz(hz)}, {100 * error:+.2f} %, MAC {mac:.4f}"


def _known(result: Verification, k: int) -> str:
    """How far off the solid's own frequency may be, after a comma."""
    own = result.uncertainty[k] if k < len(result.uncertainty) else None
    return ", its own error not known" if own is None else f", to {100 * own:.2g} %"


def _pairs(result: Verification) -> ShapePairs:
    if result.shapes is None:
        raise OptionError("there is nothing to draw: the solid has not been solved yet")
    return result.shapes
