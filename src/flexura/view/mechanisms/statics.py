"""Static states and freedoms in pictures: deformed, with loads as arrows; screw axes, compliance, workspace."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from flexura.analysis import Freedom, Kinetostatics, Preload, Statics
from flexura.arguments import verb
from flexura.mechanism import DOF_NAMES
from flexura.structure import FullOrderModel
from flexura.systems import Ports
from flexura.tables import quantity
from flexura.view.drawing import (
    DPI,
    HIDDEN,
    INK,
    SERIES,
    Arrow,
    Camera,
    View,
    camera_for,
    colour_scale,
    colours_by_stress,
    draw_arrows,
    foot,
    force_colours,
    frame,
    heading,
    headline,
    legend,
    mode_scale,
    mode_view,
    new_chart,
    new_figure,
    over_ghost,
    paint,
    plain,
    rest_colours,
    rest_painting,
    scale_of,
    shortened,
    stress_bar,
    style,
    triad,
    visible_flexures,
)
from flexura.view.mechanisms.files import save_figures
from flexura.view.mechanisms.pictures import SIZE
from flexura.view.scene import Array, Solids, solids, stresses_along

AREA = (0.08, 0.07, 0.76)
"""Left, bottom and width of what is drawn; arrows reach beyond it."""

NO_LOAD = 1e-12
"""Forces below so much of the largest are none."""

MOST_ARROWS = 24
"""Loads that are drawn."""


@verb
def save_statics(result: Statics, folder: Path | str, *, scale: float | None = None, dpi: float = DPI) -> list[Path]:
    """Write the picture of `draw_statics` as `statics.png`. Raises OptionError when the folder cannot be written to."""
    return save_figures({"statics.png": draw_statics(result, scale=scale, dpi=dpi)}, folder)


@verb
def draw_statics(
    result: Statics,
    *,
    scale: float | None = None,
    elev: float | None = None,
    azim: float | None = None,
    dpi: float = DPI,
) -> Figure:
    """Draw a static response over a ghost of the mechanism at rest: deformed, coloured by the largest von Mises stress
    in the section, loads and commands as arrows.

    scale: factor on the displacements, which the picture says; by default a round number that makes them visible.
    Sections whose stress is not known have the colour of their kind. elev, azim, dpi as in `draw_mechanism`. Returns a
    Figure. Raises OptionError for a scale that is not finite.
    """
    model = result.model
    u = model.node_displacements(result.displacement_vector[:, None])[:, :, 0]
    parts = solids(model, u)
    values = stresses_along(parts, result.stress_profiles())
    factor = _round(mode_scale(parts)) if scale is None else scale_of(parts, scale)
    largest = float(np.nanmax(values, initial=0.0))
    loads = _sum(model.plan.loads.wrenches(model.values) if not model.plan.is_posed else {}, result.loads)
    commands = {state.name: state.command for state in result.actuators}
    words = ["static response", _times(factor), f"the largest is {quantity(parts.largest_motion(), 'm')}"]
    if any(result.gravity):
        words.append(f"gravity ({', '.join(f'{c:g}' for c in result.gravity)}) m/s²")
    figure = new_figure(SIZE, dpi)
    view = _view(figure, model, parts, camera_for(parts, elev, azim), factor, words, result.warnings)
    colours = colours_by_stress(replace(parts, values=values), largest)
    axes, _ = paint(figure, over_ghost(parts, view, factor, *colours, visible_flexures(parts, view.camera) < HIDDEN))
    draw_arrows(axes, view, list(_arrows(model, u, factor, loads, commands))[:MOST_ARROWS])
    triad(figure, view.camera, (0.875, 0.03, 0.10, 0.133))
    if largest > 0:
        stress_bar(figure, largest, (0.895, 0.27, 0.017, 0.34))
    return figure


@verb
def save_preload(result: Preload, folder: Path | str, *, dpi: float = DPI) -> list[Path]:
    """Write the picture of `draw_buckling` as `buckling.png`. Raises OptionError when the folder cannot be written
    to."""
    return save_figures({"buckling.png": draw_buckling(result, dpi=dpi)}, folder)


@verb
def draw_buckling(result: Preload, *, elev: float | None = None, azim: float | None = None, dpi: float = DPI) -> Figure:
    """Draw the shape in which a mechanism buckles first under multiples of its loads, members coloured by their axial
    force under the loads as they are, loads as arrows.

    Where no load of this direction buckles it, the linear response is drawn, enlarged as is said. elev, azim, dpi as in
    `draw_mechanism`. Returns a Figure.
    """
    model, shape = result.model, result.buckling_shape
    u = model.node_displacements((result.displacement_vector if shape is None else shape)[:, None])[:, :, 0]
    parts = solids(model, u)
    factor = mode_scale(parts)
    if shape is None:
        factor = _round(factor)
        told = f"no load of this direction buckles it; {_times(factor)}" if parts.largest_motion() > 0 else "no loads"
    else:
        told = f"buckles at {result.buckling_factor:.4g} times these loads, in this shape, drawn in any size"
    figure = new_figure(SIZE, dpi)
    view = _view(figure, model, parts, camera_for(parts, elev, azim), factor, [told], result.warnings)
    colours, largest = _axial(parts, result.axial_force)
    axes, _ = paint(figure, over_ghost(parts, view, factor, *colours, visible_flexures(parts, view.camera) < HIDDEN))
    loads, commands = result.loads, result.actuators
    draw_arrows(axes, view, list(_arrows(model, u, factor, loads, commands))[:MOST_ARROWS])
    triad(figure, view.camera, (0.875, 0.03, 0.10, 0.133))
    if largest > 0:
        scale = force_colours(np.linspace(-1, 1, 256))
        ends = [f"{-largest:.3g}", "0", f"{largest:.3g}"]
        colour_scale(figure, (0.895, 0.27, 0.017, 0.34), scale, [0, 0.5, 1], ends, "axial force, N\ntension +")
    return figure


def _view(
    figure: Figure,
    model: FullOrderModel,
    parts: Solids,
    camera: Camera,
    factor: float,
    words: Sequence[str],
    warnings: Sequence[object],
) -> View:
    """Write the heading of a figure; the view in which a mechanism fills what is left, with room for arrows."""
    top = min(heading(figure, model.plan.mechanism.name, "; ".join([*words, *parts.notes]), warnings) - 0.01, 0.86)
    return mode_view(figure, parts, camera, factor, (AREA[0], AREA[1], AREA[2], top - AREA[1] - 0.06))


def _times(factor: float) -> str:
    """How large displacements are drawn."""
    return "displacements to scale" if factor == 1 else f"displacements drawn {factor:g} times as large as they are"


def _round(factor: float) -> float:
    """The next smaller of 1, 2 and 5 times a power of ten."""
    if not factor > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(factor))
    return float(f"{max(step for step in (1, 2, 5) if step * power <= factor * (1 + 1e-9)) * power:.3g}")


def _sum(one: Mapping[str, Array], other: Mapping[str, ArrayLike]) -> dict[str, Array]:
    """Loads (6,) by node, those of both together."""
    total = {node: np.asarray(load, dtype=float) for node, load in one.items()}
    for node, load in other.items():
        total[node] = total.get(node, np.zeros(6)) + np.asarray(load, dtype=float)
    return total


def _arrows(
    model: FullOrderModel, u: Array, factor: float, loads: Mapping[str, Array], commands: Mapping[str, float]
) -> Iterator[Arrow]:
    """Loads by node, and commands of actuators, where the nodes have moved to."""
    x = model.geometry.positions + factor * u[:, :3]
    for node, load in loads.items():
        at = x[int(model.plan.topology.numbers([node])[0])]
        yield from _pair(at, np.asarray(load, dtype=float), "")
    ports = Ports(model.design)
    for name, command in commands.items():
        own = ports.inputs([name])[0]
        if not command or own.base is not None:
            continue
        written = f"{name}: {quantity(command, own.channel.unit)}"
        if own.stiffness is not None and len(own.nodes) == 2:
            a, b = x[list(own.nodes)]
            if np.linalg.norm(b - a) > 0:
                yield Arrow(b, np.sign(own.stroke * command) * (b - a), written)
            continue
        topology = model.plan.topology
        for node in own.nodes:
            dof = topology.dof[topology.root[node]]
            force = np.where(dof >= 0, np.append(own.load, 0.0)[dof], 0.0) * command
            named = force if np.abs(force[:3]).max() > 0 and own.channel.unit == "N" else force * ([0] * 3 + [1] * 3)
            for arrow in _pair(x[node], named * ([1] * 3 + [0] * 3) if own.channel.unit == "N" else named, ""):
                yield arrow._replace(text=written)


def _pair(at: Array, load: Array, name: str) -> Iterator[Arrow]:
    """The arrows of a force and a moment."""
    for own, unit, turns in ((load[:3], "N", False), (load[3:], "N m", True)):
        size = float(np.linalg.norm(own))
        if size > NO_LOAD * np.abs(load).max() and size > 0:
            yield Arrow(at, own, f"{name}{quantity(size, unit)}", turns)


def _axial(parts: Solids, forces: Mapping[str, tuple[float, float]]) -> tuple[tuple[Array, Array], float]:
    """Colours of faces (f, 4, 3) and lines (l, 3) by the axial force of members, and the largest, N; those of the kinds
    where there is none."""
    extreme = {name: max(own, key=abs) for name, own in forces.items()}
    largest = max(map(abs, extreme.values()), default=0.0)
    faces, lines = rest_colours(parts)
    if not largest > 0:
        return (faces, lines), 0.0
    own = np.array([extreme.get(name, np.nan) / largest for name in parts.names] or [np.nan])
    for colours, numbers in ((faces, parts.face_parts), (lines, parts.line_parts)):
        known = np.isfinite(own[numbers])
        tinted = force_colours(own[numbers][known])
        colours[known] = tinted[:, None] if colours.ndim == 3 else tinted
    return (faces, lines), largest


MOST_INPUTS = 16
"""Actuators whose coupling is drawn."""

NO_COUPLING = 1e-9
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
        text = "0" if abs(share[i, j]) < NO_COUPLING else f"{value:.3g}"
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
