"""Modes of beams and of the solid side by side, and the errors of the beams."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.solid.verification import ShapePairs, Verification, VerificationRow
from flexura.tables import in_hz
from flexura.view.drawing import (
    INK,
    Box,
    Painting,
    camera_for,
    colour_bar,
    good_camera,
    heading,
    mode_painting,
    mode_scale,
    mode_view,
    new_figure,
    paint,
    remark_lines,
    triad,
)
from flexura.view.mechanisms.files import save_figures
from flexura.view.scene import meshed_solids, solids

SIZE = (12.0, 5.6)
"""Width and height of a pair of pictures, inches."""

AREAS: tuple[Box, Box] = ((0.02, 0.04, 0.42, 0.74), (0.475, 0.04, 0.42, 0.74))
"""Where beams and solid are drawn."""

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
        _subtitle(row, k),
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


def _subtitle(row: VerificationRow, k: int) -> str:
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
