"""How actuators move a platform, in pictures: its freedoms as screw axes, and coupling, compliance and workspace."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from flexura.analysis import Freedom, Kinetostatics
from flexura.arguments import verb
from flexura.mechanism import DOF_NAMES
from flexura.structure import FullOrderModel
from flexura.tables import quantity
from flexura.view.drawing import (
    DPI,
    INK,
    SERIES,
    Arrow,
    View,
    camera_for,
    draw_arrows,
    foot,
    frame,
    heading,
    headline,
    legend,
    new_chart,
    new_figure,
    paint,
    plain,
    rest_painting,
    shortened,
    style,
)
from flexura.view.mechanisms.files import save_figures
from flexura.view.mechanisms.pictures import SIZE
from flexura.view.scene import Array, solids

MOST_INPUTS = 16
"""Actuators whose coupling is drawn."""

NOTHING = 1e-9
"""Couplings below so much of the largest of their row are nothing."""


@verb
def save_kinetostatics(
    result: Kinetostatics, folder: Path | str, *, model: FullOrderModel, dpi: float = DPI
) -> list[Path]:
    """Write `freedoms.png` and `kinetostatics.png`, complete or not at all, of the model that the result is of.

    Raises OptionError when the folder cannot be written to.
    """
    figures = {
        "freedoms.png": draw_freedoms(model, result, dpi=dpi),
        "kinetostatics.png": draw_kinetostatics(result, dpi=dpi),
    }
    return save_figures(figures, folder)


@verb
def draw_freedoms(
    model: FullOrderModel,
    result: Kinetostatics,
    *,
    elev: float | None = None,
    azim: float | None = None,
    dpi: float = DPI,
) -> Figure:
    """Draw a mechanism with the freedoms of its platform: screw axes of rotations where they lie, with their pitch and
    reach, and arrows of translations.

    Rigid bodies are see-through. elev, azim, dpi and errors as in `draw_mechanism`.
    """
    parts = solids(model)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE, dpi)
    kind = f"freedoms {result.kind}" if result.is_clear else "no freedoms that are clear cut"
    told = [f"{result.platform}: {kind}", *(_said(k, one) for k, one in enumerate(result.freedoms))]
    top = heading(figure, model.plan.mechanism.name, "; ".join(told), result.warnings)
    view = frame(figure, camera, parts.bounds(), (0.09, 0.175, 0.76, min(0.70, top - 0.205)))
    axes, _ = paint(figure, rest_painting(parts, view, clear_bodies=True))
    node = model.geometry.positions[int(model.plan.topology.numbers([result.platform])[0])]
    for k, one in enumerate(result.freedoms):
        _draw_freedom(axes, view, k, one, node, parts.size())
    legend(figure, parts)
    return figure


def _said(k: int, one: Freedom) -> str:
    """A freedom in words."""
    unit = "rad" if one.kind == "R" else "m"
    words = f"{k + 1}: {'rotation' if one.kind == 'R' else 'translation'}"
    if one.kind == "R" and abs(one.axis.pitch) > 0:
        words += f", pitch {1e3 * one.axis.pitch:.3g} mm/rad"
    return words + ("" if one.stroke is None else f", range ±{quantity(one.stroke, unit)}")


def _draw_freedom(axes: Axes, view: View, k: int, one: Freedom, node: Array, size: float) -> None:
    """A screw axis as a dash-dotted line with an arrow of two heads, or the arrow of a translation."""
    way, colour = np.array(one.axis.direction, dtype=float), SERIES[k % len(SERIES)]
    name = f"{k + 1}  {one.kind}"
    if one.kind != "R":
        draw_arrows(axes, view, [Arrow(node + 0.3 * size * way, way, name)], colour)
        return
    point = np.array(one.axis.point, dtype=float)
    ends = point + np.outer([-0.6, 0.6], size * way)
    at = view.pixels(ends)[:, :2]
    axes.plot(*at.T, color=colour, linewidth=1.3, linestyle=(0, (9, 3, 2, 3)), zorder=9)
    axes.plot(*view.pixels(point[None])[0, :2], marker="o", markersize=4, color=colour, zorder=10)
    draw_arrows(axes, view, [Arrow(ends[1], way, name, turns=True)], colour)


@verb
def draw_kinetostatics(result: Kinetostatics, *, dpi: float = DPI) -> Figure:
    """Draw what a unit of each command moves the platform by, its compliance, and how far the commands reach.

    Numbers stand in SI units. Colours of the coupling go by row, from the largest one; those of the compliance are the
    coupling of two coordinates, C_ij over the root of C_ii C_jj. At most sixteen actuators are shown. dpi:
    dots per inch, 300 for print. Returns a Figure.
    """
    inputs = result.inputs[:MOST_INPUTS]
    figure = new_chart((8.0 + 0.25 * len(inputs), 8.4 if inputs else 5.0), dpi)
    panels = figure.subplots(
        2 if inputs else 1, 2 if inputs else 1, squeeze=False, height_ratios=[1, 1][: 2 if inputs else 1]
    )
    C = result.compliance
    root = np.sqrt(np.outer(np.diagonal(C), np.diagonal(C)))
    _matrix(panels[0, 0], C, C / np.where(root > 0, root, 1.0), DOF_NAMES, "compliance, m/N, rad/N, rad/(N m)")
    if inputs:
        own = result.coupling[:, : len(inputs)]
        most = np.abs(own).max(axis=1, keepdims=True)
        columns = [f"{shortened(c.name, 16)}\n[{c.unit}]" for c in inputs]
        share = np.where(most > 0, own / np.where(most > 0, most, 1.0), 0.0)
        _matrix(panels[0, 1], own, share, columns, "moved by a unit of each command, m, rad")
        for axes, span, unit, factor in (
            (panels[1, 0], slice(0, 3), "mm", 1e3),
            (panels[1, 1], slice(3, 6), "mrad", 1e3),
        ):
            _reach(axes, factor * result.workspace[span], DOF_NAMES[span], unit)
    kind = result.kind if result.is_clear else "no freedoms that are clear cut"
    headline(figure, f"{result.platform}: {kind}")
    foot(figure, result.warnings, result.notes)
    return figure


def _matrix(axes: Axes, values: Array, share: Array, columns, title: str) -> None:  # type: ignore[no-untyped-def]
    """Numbers over their share of something, from -1 to 1, as colour."""
    axes.imshow(share, vmin=-1.25, vmax=1.25, cmap="RdBu_r", aspect="auto")
    small = values.shape[1] <= 8
    for (i, j), value in np.ndenumerate(values):
        text = "0" if abs(share[i, j]) < NOTHING else f"{value:.3g}"
        colour = "white" if abs(share[i, j]) > 0.75 else INK
        axes.text(j, i, text, ha="center", va="center", size=7 if small else 4.5, color=colour)
    axes.set_xticks(range(len(columns)), columns, size=7 if small else 5, parse_math=False)
    if not small:
        axes.tick_params(axis="x", rotation=90)
    axes.set_yticks(range(6), DOF_NAMES, size=7)
    axes.tick_params(length=0, colors=INK)
    axes.set_title(title, size=9, color=INK)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _reach(axes: Axes, span: Array, names, unit: str) -> None:  # type: ignore[no-untyped-def]
    """From where to where (3, 2) the commands bring each coordinate within their limits."""
    axes.set_title(f"workspace, one coordinate at a time, {unit}", size=9, color=INK)
    style(axes)
    axes.set_yticks(range(3), names, size=8)
    axes.invert_yaxis()
    axes.axvline(0, color="0.6", linewidth=0.8)
    for k, (low, high) in enumerate(span):
        if np.isfinite([low, high]).all():
            axes.barh(k, high - low, left=low, height=0.5, color=SERIES[0], alpha=0.8)
            axes.text(high, k, f"  {low:.3g} to {high:.3g}", va="center", size=7, color=INK)
        else:
            axes.text(0, k, "  no limits", va="center", size=7, color="0.4")
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.xaxis.set_major_formatter(plain)
    known = np.append(span[np.isfinite(span)], 0.0)
    room = max(float(np.ptp(known)), 1e-300)
    axes.set_xlim(known.min() - 0.1 * room, known.max() + 0.7 * room)
