"""Static states, freedoms and constraints in pictures: deformed, with loads as arrows; screw axes, compliance,
workspace."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from flexura.analysis import Freedom, FreedomSpaces, Kinetostatics, Preload, ScrewAxis, Statics
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.mechanism import DOF_NAMES, GROUND
from flexura.structure import FullOrderModel, Ports
from flexura.tables import quantity
from flexura.thresholds import ROUND_OFF
from flexura.view.drawing import (
    DPI,
    HIDDEN,
    INK,
    SERIES,
    Arrow,
    Box,
    Camera,
    Colours,
    View,
    camera_for,
    colour_scale,
    colours_by_stress,
    draw_arrows,
    draw_matrix,
    force_colours,
    frame,
    heading,
    headline,
    legend,
    mode_scale,
    mode_view,
    new_chart,
    new_figure,
    paint,
    painting_of,
    plain,
    rest_colours,
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

BAR_AREA: Box = (0.895, 0.27, 0.017, 0.34)
"""Where the scale of colours stands."""

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
    largest = float(np.nanmax(values, initial=0.0))
    factor = _round_below(mode_scale(parts)) if scale is None else scale_of(parts, scale)
    loads = {} if model.plan.is_posed else dict(model.plan.loads.wrenches(model.values))
    for node, load in result.loads.items():
        loads[node] = loads.get(node, np.zeros(6)) + np.asarray(load, dtype=float)
    commands = {state.name: state.command for state in result.actuators}
    state = _State(model, parts, factor, [*_arrows(model, factor * u[:, :3], loads, commands)])
    texts = ["static response", _factor_text(factor), f"the largest is {quantity(parts.largest_motion(), 'm')}"]
    if any(result.gravity):
        texts.append(f"gravity ({', '.join(f'{c:g}' for c in result.gravity)}) m/s²")
    figure = new_figure(SIZE, dpi)
    colours = colours_by_stress(replace(parts, values=values), largest)
    _draw_state(figure, state, colours, camera_for(parts, elev, azim), texts=texts, warnings=result.warnings)
    stress_bar(figure, largest, BAR_AREA)
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
    factor = mode_scale(parts) if shape is not None else _round_below(mode_scale(parts))
    text = f"buckles at {result.buckling_factor:.4g} times these loads, in this shape, drawn in any size"
    if shape is None:
        is_loaded = parts.largest_motion() > 0
        text = f"no load of this direction buckles it; {_factor_text(factor)}" if is_loaded else "no loads"
    state = _State(model, parts, factor, [*_arrows(model, factor * u[:, :3], result.loads, result.actuators)])
    figure = new_figure(SIZE, dpi)
    colours, largest = _colours_by_axial_force(parts, result.axial_force)
    _draw_state(figure, state, colours, camera_for(parts, elev, azim), texts=[text], warnings=result.warnings)
    if largest > 0:
        scale = force_colours(np.linspace(-1, 1, 256))
        ends = [f"{-largest:.3g}", "0", f"{largest:.3g}"]
        colour_scale(figure, BAR_AREA, scale, [0, 0.5, 1], ends, "axial force, N\ntension +")
    return figure


class _State(NamedTuple):
    """A deformed mechanism, by which factor its displacements are drawn, and its loads and commands as arrows."""

    model: FullOrderModel
    parts: Solids
    factor: float
    arrows: Sequence[Arrow]


def _draw_state(
    figure: Figure,
    state: _State,
    colours: Colours,
    camera: Camera,
    *,
    texts: Sequence[str],
    warnings: Sequence[object],
) -> None:
    """A heading, and below it a deformed mechanism over its ghost, with room for arrows."""
    model, parts, factor, arrows = state
    top = min(heading(figure, model.plan.mechanism.name, "; ".join([*texts, *parts.notes]), warnings) - 0.01, 0.86)
    view = mode_view(figure, parts, camera, factor, (0.08, 0.07, 0.76, top - 0.13))
    clear_bodies = visible_flexures(parts, camera) < HIDDEN
    axes, _ = paint(figure, painting_of(parts, view, colours, factor, over_ghost=True, clear_bodies=clear_bodies))
    draw_arrows(axes, view, arrows[:MOST_ARROWS])
    triad(figure, camera)


def _factor_text(factor: float) -> str:
    """How large displacements are drawn."""
    return "displacements to scale" if factor == 1 else f"displacements drawn {factor:g} times as large as they are"


def _round_below(factor: float) -> float:
    """The next smaller of 1, 2 and 5 times a power of ten."""
    if not factor > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(factor))
    return float(f"{max(step for step in (1, 2, 5) if step * power <= factor * (1 + 1e-9)) * power:.3g}")


def _arrows(
    model: FullOrderModel, shifts: Array, loads: Mapping[str, Array], commands: Mapping[str, float]
) -> Iterator[Arrow]:
    """Loads by node, and commands of actuators, where the nodes have moved to by `shifts` (n, 3), m."""
    x = model.geometry.positions + shifts
    for node, load in loads.items():
        yield from _force_and_moment(x[int(model.plan.topology.numbers([node])[0])], np.asarray(load, dtype=float))
    ports, topology = Ports(model.design), model.plan.topology
    for name, command in commands.items():
        port = ports.inputs([name])[0]
        if not command or port.base is not None:
            continue
        text = f"{name}: {quantity(command, port.channel.unit)}"
        if port.stiffness is not None and len(port.nodes) == 2:
            first, second = x[list(port.nodes)]
            if np.linalg.norm(second - first) > 0:
                yield Arrow(second, np.sign(port.stroke * command) * (second - first), text)
            continue
        for node in port.nodes:
            dof = topology.dof[topology.root[node]]
            load = np.where(dof >= 0, np.append(port.load, 0.0)[dof], 0.0) * command
            # the moment that a force has about the node that it is carried to is no command
            load[3:] *= port.channel.unit != "N"
            load[:3] *= port.channel.unit == "N"
            for arrow in _force_and_moment(x[node], load):
                yield arrow._replace(text=text)


def _force_and_moment(at: Array, load: Array) -> Iterator[Arrow]:
    """The arrows of a force and a moment."""
    for vector, unit, turns in ((load[:3], "N", False), (load[3:], "N m", True)):
        size = float(np.linalg.norm(vector))
        if size > ROUND_OFF * np.abs(load).max():
            yield Arrow(at, vector, quantity(size, unit), turns)


def _colours_by_axial_force(parts: Solids, forces: Mapping[str, tuple[float, float]]) -> tuple[Colours, float]:
    """Colours by the axial force of members, by kind where there is none, and the largest force, N."""
    extreme = {name: max(ends, key=abs) for name, ends in forces.items()}
    largest = max(map(abs, extreme.values()), default=0.0)
    colours = rest_colours(parts)
    if largest > 0:
        share = np.array([extreme.get(name, np.nan) / largest for name in parts.names] or [np.nan])
        for tinted, numbers in ((colours.faces, parts.face_parts), (colours.lines, parts.line_parts)):
            known = np.isfinite(share[numbers])
            tints = force_colours(share[numbers][known])
            tinted[known] = tints[:, None] if tinted.ndim == 3 else tints
    return colours, largest


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
    range, and arrows of translations.

    Rigid bodies are see-through. elev, azim, dpi and errors as in `draw_mechanism`.
    """
    parts = solids(model)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE, dpi)
    kind = f"freedoms {result.kind}" if result.is_clear else "no freedoms that are clear cut"
    texts = [f"{result.platform}: {kind}", *(_freedom_text(k, freedom) for k, freedom in enumerate(result.freedoms))]
    top = heading(figure, model.plan.mechanism.name, "; ".join(texts), result.warnings)
    view = frame(figure, camera, parts.bounds(), (0.09, 0.175, 0.76, min(0.70, top - 0.205)))
    axes, _ = paint(figure, painting_of(parts, view, rest_colours(parts), clear_bodies=True))
    platform = model.geometry.positions[int(model.plan.topology.numbers([result.platform])[0])]
    for k, freedom in enumerate(result.freedoms):
        _draw_freedom(axes, view, k, freedom, platform=platform, size=parts.size())
    legend(figure, parts)
    return figure


def _freedom_text(k: int, freedom: Freedom) -> str:
    """A freedom in words."""
    name, unit = ("rotation", "rad") if freedom.kind == "R" else ("translation", "m")
    has_pitch = freedom.kind == "R" and abs(freedom.axis.pitch) > 0
    pitch = f", pitch {1e3 * freedom.axis.pitch:.3g} mm/rad" if has_pitch else ""
    return f"{k + 1}: {name}{pitch}" + ("" if freedom.stroke is None else f", range ±{quantity(freedom.stroke, unit)}")


def _draw_freedom(axes: Axes, view: View, k: int, freedom: Freedom, *, platform: Array, size: float) -> None:
    """The axis of a rotation or the arrow of a translation."""
    axis = freedom.axis if freedom.kind == "R" else replace(freedom.axis, pitch=np.inf)
    colour = SERIES[k % len(SERIES)]
    draw_arrows(axes, view, [_draw_axis(axes, view, axis, f"{k + 1}  {freedom.kind}", colour, platform, size)], colour)


HELIX = 0.04
"""Radius of the helix of a screw, and its most rise per radian, of the size of a mechanism."""


def _draw_axis(
    axes: Axes, view: View, axis: ScrewAxis, name: str, colour: str, at: Array, size: float, side: float = 1.0
) -> Arrow:
    """A screw axis as a line with a dot at its point, dash-dotted where it is free, with a helix where it has a pitch,
    and the arrow at its end; what has no axis as an arrow at a point (3,), m. What is borne is on the other `side`, -1,
    where forces have the heads of translations."""
    direction = side * np.array(axis.direction, dtype=float)
    if axis.is_translation:
        return Arrow(at + 0.3 * size * direction, direction, name, turns=side < 0)
    point = np.array(axis.point, dtype=float)
    ends = point + np.outer([-0.6, 0.6], size * direction)
    style = (0, (9, 3, 2, 3)) if side > 0 else "-"
    axes.plot(*view.pixels(ends)[:, :2].T, color=colour, linewidth=1.3, linestyle=style, zorder=9)
    axes.plot(*view.pixels(point[None])[0, :2], marker="o", markersize=4, color=colour, zorder=10)
    if abs(axis.pitch) > ROUND_OFF * size:
        across = la.null_space(direction[None])
        across[:, 1] *= np.sign(direction @ np.cross(across[:, 0], across[:, 1]))
        angle = np.linspace(-2 * np.pi, 2 * np.pi, 121)[:, None]
        turned = HELIX * size * (np.cos(angle) * across[:, 0] + np.sin(angle) * across[:, 1])
        rise = np.clip(axis.pitch, -HELIX * size, HELIX * size)
        helix = view.pixels(point + turned + rise * angle * direction)
        axes.plot(*helix[:, :2].T, color=colour, linewidth=1.1, zorder=9)
    return Arrow(ends[1], direction, name, turns=side > 0)


FREE, BORNE = "#c8102e", "#1f5fa8"
"""Colours of freedoms and of constraints."""


@verb
def save_free(result: FreedomSpaces, folder: Path | str, *, dpi: float = DPI) -> list[Path]:
    """Write the picture of `draw_free` of each body, such as `free_table.png`, complete or not at all.

    Raises OptionError when the folder cannot be written to.
    """
    return save_figures(
        {f"free_{own.body}.png": draw_free(result, body=own.body, dpi=dpi) for own in result.bodies}, folder
    )


@verb
def draw_free(
    result: FreedomSpaces,
    *,
    body: str | None = None,
    elev: float | None = None,
    azim: float | None = None,
    dpi: float = DPI,
) -> Figure:
    """Draw a mechanism with the screws of one of its bodies, the first unless another is named: what is free in red,
    what is borne in blue, with the names of both spaces.

    Rotations are dash-dotted lines, forces lines; screws and wrenches have a helix and their pitch; translations are
    arrows and couples arrows with two heads, at the body. Rigid bodies are see-through. elev, azim, dpi and errors as
    in `draw_mechanism`; OptionError for a body that the result does not have.
    """
    found = {own.body: own for own in result.bodies}
    if body is not None and body not in found:
        raise OptionError(f"there are no spaces of {body}; there are those of {', '.join([*found][:8])}")
    own = result.bodies[0] if body is None else found[body]
    model, parts = result.model, solids(result.model)
    camera = camera_for(parts, elev, azim)
    figure = new_figure(SIZE, dpi)
    texts = [f"{own.body} relative to {result.held}: {own.freedom.name}", f"held by {own.constraint.name}"]
    warnings = [warning for warning in result.warnings if warning.place == own.body]
    top = heading(figure, model.plan.mechanism.name, "; ".join(texts), warnings)
    view = frame(figure, camera, parts.bounds(), (0.09, 0.175, 0.76, min(0.70, top - 0.205)))
    axes, _ = paint(figure, painting_of(parts, view, rest_colours(parts), clear_bodies=True))
    named = result.held if own.body == GROUND else own.body
    at = model.geometry.positions[int(model.plan.topology.numbers([named])[0])]
    for space, colour, side in ((own.constraint, BORNE, -1.0), (own.freedom, FREE, 1.0)):
        arrows = [
            _draw_axis(axes, view, screw.axis, screw.told, colour, at, parts.size(), side) for screw in space.screws
        ]
        draw_arrows(axes, view, arrows, colour)
    legend(figure, parts)
    return figure


@verb
def draw_kinetostatics(result: Kinetostatics, *, dpi: float = DPI) -> Figure:
    """Draw what a unit of each command moves the platform by, its compliance, and how far the commands reach.

    Numbers stand in SI units. Colours of the coupling go by row, from the largest one; those of the compliance are the
    coupling of two coordinates, C_ij over the root of C_ii C_jj. At most sixteen actuators are shown. dpi:
    dots per inch, 300 for print. Returns a Figure.
    """
    inputs = result.inputs[:MOST_INPUTS]
    figure = new_chart((8.0 + 0.25 * len(inputs), 8.4 if inputs else 5.0), dpi)
    side = 2 if inputs else 1
    panels = figure.subplots(side, side, squeeze=False)
    C = result.compliance
    root = np.sqrt(np.outer(np.diagonal(C), np.diagonal(C)))
    share = C / np.where(root > 0, root, 1.0)
    _draw_numbers(panels[0, 0], C, share, DOF_NAMES, "compliance, m/N, rad/N, rad/(N m)")
    if inputs:
        coupling = result.coupling[:, : len(inputs)]
        largest = np.abs(coupling).max(axis=1, keepdims=True)
        share = coupling / np.where(largest > 0, largest, 1.0)
        columns = [f"{shortened(c.name, 16)}\n[{c.unit}]" for c in inputs]
        _draw_numbers(panels[0, 1], coupling, share, columns, "moved by a unit of each command, m, rad")
        _draw_workspace(panels[1, 0], 1e3 * result.workspace[:3], DOF_NAMES[:3], "mm")
        _draw_workspace(panels[1, 1], 1e3 * result.workspace[3:], DOF_NAMES[3:], "mrad")
    kind = result.kind if result.is_clear else "no freedoms that are clear cut"
    headline(figure, f"{result.platform}: {kind}", result.warnings, result.notes)
    return figure


def _draw_numbers(axes: Axes, values: Array, share: Array, columns: Sequence[str], title: str) -> None:
    """Numbers of the platform's coordinates over their share of something, from -1 to 1, as colour."""
    texts = np.where(np.abs(share) < NO_COUPLING, "0", np.vectorize("{:.3g}".format)(values))
    is_small = values.shape[1] <= 8
    draw_matrix(axes, share, texts, (DOF_NAMES, columns), title=title, size=7 if is_small else 4.5, is_signed=True)
    if not is_small:
        axes.tick_params(axis="x", rotation=90)


def _draw_workspace(axes: Axes, ranges: Array, names: Sequence[str], unit: str) -> None:
    """From where to where (3, 2) the commands bring each coordinate within their limits."""
    axes.set_title(f"workspace, one coordinate at a time, {unit}", size=9, color=INK)
    style(axes)
    axes.set_yticks(range(3), names, size=8)
    axes.invert_yaxis()
    axes.axvline(0, color="0.6", linewidth=0.8)
    for k, (low, high) in enumerate(ranges):
        if np.isfinite([low, high]).all():
            axes.barh(k, high - low, left=low, height=0.5, color=SERIES[0], alpha=0.8)
            axes.text(high, k, f"  {low:.3g} to {high:.3g}", va="center", size=7, color=INK)
        else:
            axes.text(0, k, "  no limits", va="center", size=7, color="0.4")
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.xaxis.set_major_formatter(plain)
    known = np.append(ranges[np.isfinite(ranges)], 0.0)
    span = max(float(np.ptp(known)), 1e-300)
    axes.set_xlim(known.min() - 0.1 * span, known.max() + 0.7 * span)
