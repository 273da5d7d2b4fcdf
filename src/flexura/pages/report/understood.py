"""The model summary: sizes, masses, what is held and driven, every warning; and the scenes of a report."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from matplotlib.figure import Figure
from PIL import Image

from flexura.analysis import CheckReport, Modes, check
from flexura.errors import FlexuraError
from flexura.expressions import Expression
from flexura.full_order import assemble
from flexura.mechanism import CATALOGUE, Layout, parameter_dimensions
from flexura.pages.report.document import (
    Block,
    Bullets,
    Content,
    Evidence,
    Fact,
    Folded,
    Paragraph,
    Table,
    ViewerFigure,
    grouped,
)
from flexura.pages.report.subject import Subject
from flexura.pages.viewer import Shown, scene_of, to_json
from flexura.tables import counted, in_mm, quantity, vector
from flexura.units import format_quantity
from flexura.view import draw_mechanism, draw_sheet, draw_warnings

PICTURE_DPI = 96
COLOURS = 96
"""Colours of the picture that stands where nothing moves."""
MODES = 6
"""Modes on that picture."""


def doubts_figure(subject: Subject, check: CheckReport) -> list[Block]:
    """The undeformed mechanism with marks where its warnings are; nothing without any."""
    if not check.warnings:
        return []
    model = assemble(subject.plan.at_rest(), subject.parameters)
    try:
        scene, picture = scene_of(model, check), png_of(draw_warnings(model, check))
    except FlexuraError as error:
        return [Paragraph(f"The warnings cannot be shown in three dimensions: {error}", "bad")]
    return [ViewerFigure("doubts", to_json(scene), picture, f"{scene.name}, with its warnings where they are")]


def scene_content(subject: Subject, shown: Sequence[Shown]) -> Content:
    """One scene of all results of a report that move, or why there is none."""
    try:
        scene = scene_of(subject.model, *shown)
    except FlexuraError as error:
        return Content([Paragraph(f"Nothing can be shown in three dimensions: {error}", "bad")], "failed")
    modes = [own for own in shown if isinstance(own, Modes)]
    picture = png_of(_sheet(modes[0]) if modes else draw_mechanism(subject.model, dpi=PICTURE_DPI))
    blocks: list[Block] = [
        ViewerFigure("scene", to_json(scene), picture, f"{scene.name}: {counted(len(scene.motions), 'motion')}")
    ]
    return Content([*blocks, Bullets(scene.notes, "soft")] if scene.notes else blocks)


def _sheet(found: Modes) -> Figure:
    """The first modes on one sheet."""
    modes = found.modes[:MODES]
    titles = [f"mode {mode.number}: {mode.frequency_text}" for mode in modes]
    said = [mode.motion.summary for mode in modes]
    flags = [mode.flag for mode in modes]
    return draw_sheet(found.model, found.shapes[:, :, : len(modes)], titles, said, flags=flags, dpi=PICTURE_DPI)


def png_of(figure: Figure) -> str:
    """A small PNG as a data URI."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=PICTURE_DPI)
    Image.open(drawn).convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE).save(packed, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(packed.getvalue()).decode()}"


T = TypeVar("T")
MOST = 10
"""Bodies of which the masses are shown; the command prints as many."""


def understood(subject: Subject) -> Content:
    """Masses, materials, counts, what is held and driven, parameters, and the doubts. Raises FlexuraError."""
    found = check(subject.plan, subject.parameters)
    command = subject.commands("check", posed=False)
    evidence = Evidence(command, _words(found), essential=True)
    blocks: list[Block] = []
    if subject.mechanism.description.strip():
        blocks.append(Paragraph(" ".join(subject.mechanism.description.split())))
    if subject.plan.is_posed:
        blocks.append(
            Paragraph("This section is about the undeformed mechanism; all others are about its pose.", "warning")
        )
    blocks.append(replace(_overview(found), evidence=evidence))
    blocks.append(_parts(found, command))
    blocks += _bodies(found, command)
    blocks += [_materials(subject), parameters_of(subject)]
    if found.warnings:
        count = len(found.warnings)
        blocks.append(
            Paragraph(
                f"{count} warning{'s' if count > 1 else ''}: what may not be meant, or what no theory in use covers"
            )
        )
        blocks += [Bullets(grouped(found.warnings), "warning"), *doubts_figure(subject, found)]
    else:
        blocks.append(Paragraph("No warnings.", "good"))
    if found.minor:
        heading = f"{counted(len(found.minor), 'assumption')} that move no frequency by 1 %"
        every = Evidence(subject.commands("check", ["--all"], posed=False))
        blocks.append(Folded(heading, [Bullets(grouped(found.minor), "soft"), every]))
    facts = [Fact("mass", quantity(found.mass.mass, "kg")), Fact("warnings", str(len(found.warnings)))]
    return Content(blocks, facts=facts, warnings=found.warnings)


def _words(found: CheckReport) -> list[tuple[str, str]]:
    """What is held, corrected, driven and read."""
    lines = [("held", f"{node} {'clamped' if len(dofs) == 6 else ' '.join(dofs)}") for node, dofs in _few(found.held)]
    corrected = sorted({name for names in found.corrections.values() for name in names})
    if corrected:
        lines.append(("corrected", f"{', '.join(corrected)}: {', '.join(name for name, _ in _few(found.corrections))}"))
    lines.append(("held", f"{counted(len(found.held), 'node')} in all"))
    lines += [("solid part", f"{name}: {mesh}") for name, mesh in _few(found.solid_parts)]
    lines += [("actuator", f"{name}: {text}") for name, text in _few(found.actuators)]
    lines += [("sensor", f"{name}: {text}") for name, text in _few(found.sensors)]
    return lines


def _few(named: Mapping[str, T], most: int = 20) -> list[tuple[str, T]]:
    return list(named.items())[:most]


def _overview(found: CheckReport) -> Table:
    rows = [
        ["mass", quantity(found.mass.mass, "kg")],
        ["centre of mass", f"({in_mm(found.mass.centre)}) mm"],
        ["degrees of freedom", f"full order {found.full_order}, low order {found.low_order} before modes are kept"],
        ["damping", found.damping],
        ["actuators, sensors", f"{len(found.actuators)}, {len(found.sensors)}"],
    ]
    if found.rigid_body_modes:
        rows.append(["rigid-body modes", str(found.rigid_body_modes)])
    if found.lowest_hz is not None:
        rows.append(["lowest frequency", found.lowest_text])
    rows += [[f"load on {node}", _wrench(own)] for node, own in _few(found.loads)]
    if any(found.gravity):
        rows.append(["gravity", vector(found.gravity, "m/s^2")])
    if found.is_preloaded:
        rows.append(["preloaded", "stiffness, and all that follows from it, is about the state under these loads"])
    return Table(["what", "in the model"], rows)


def _wrench(own: Iterable[float]) -> str:
    wrench = list(own)
    parts = [vector(w, unit) for w, unit in ((wrench[:3], "N"), (wrench[3:], "N*m")) if any(w)]
    return ", ".join(parts) or "none"


def _parts(found: CheckReport, command: str) -> Table:
    return replace(Table.of(found.substructure_columns(), "substructures", Evidence(command)), numbers=range(1, 7))


def _bodies(found: CheckReport, command: str) -> list[Block]:
    if not found.rigid_bodies:
        return []
    shown = list(found.rigid_bodies.items())[:MOST]
    columns = {"body": [name for name, _ in shown], "mass [kg]": [mass for _, mass in shown]}
    blocks: list[Block] = [Table.of(columns, "bodies", Evidence(command))]
    more = len(found.rigid_bodies) - MOST
    return [*blocks, Paragraph(f"and {more} more bodies; --json has all", "soft")] if more > 0 else blocks


def _materials(subject: Subject) -> Block:
    """The materials that are named anywhere, as they are described."""
    layout = Layout(subject.mechanism)
    mechanism = layout.mechanism
    parts = layout.prototypes.values()
    solids = [body.solid for part in parts for body in part.bodies.values() if body.solid is not None]
    members = [member for part in parts for _, _, member in part.members()]
    named = [name for own in (*members, *solids) if (name := getattr(own, "material", None)) in CATALOGUE]
    used = dict.fromkeys([*mechanism.materials, *named])
    rows = []
    for name in used:
        own = mechanism.material(name)
        units = {"E": "Pa", "nu": "", "G": "Pa", "rho": "kg/m^3", "yield_stress": "Pa"}
        rows.append([name, *(_described(getattr(own, key), unit) for key, unit in units.items()), own.source])
    headings = ["material", "E", "Poisson's ratio", "G", "density", "yield stress", "source"]
    return Folded("materials, as described", [Table(headings, rows)])


def _described(value: object, unit: str) -> str:
    """A value of a description; an expression as it is written."""
    if isinstance(value, Expression):
        return str(value)
    return quantity(value, unit) if isinstance(value, float) else ""


def parameters_of(subject: Subject) -> Block:
    """Parameters with bounds and sources; replaced ones say so."""
    own = subject.mechanism.parameters
    dimensions = parameter_dimensions(own)
    values = subject.plan.parameter_values(dict(subject.parameters))

    def text(value: Any, name: str) -> str:
        dimension = dimensions[name]
        if value is None or isinstance(value, Expression):
            return "" if value is None else str(value)
        number = float(f"{value:.6g}")
        return f"{number:g}" if dimension is None else format_quantity(number, dimension)

    rows = [
        [
            name,
            text(values[name], name) + (" (replaced)" if name in subject.parameters else ""),
            text(parameter.minimum, name),
            text(parameter.maximum, name),
            parameter.source,
        ]
        for name, parameter in own.items()
    ]
    if not rows:
        return Paragraph("The description has no parameters.", "soft")
    return Folded(
        f"{counted(len(rows), 'parameter')}, as described",
        [Table(["parameter", "value", "least", "largest", "source"], rows)],
    )
