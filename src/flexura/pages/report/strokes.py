"""The mechanism over the stroke that its file describes."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np

from flexura.analysis import Stroke, stroke
from flexura.arrays import Array
from flexura.errors import foremost
from flexura.mechanism import FORCE_UNITS, is_rotation
from flexura.pages.report.chart import Chart, Curve, Panel
from flexura.pages.report.document import Block, Bullets, ChartFigure, Content, Evidence, Fact, Paragraph, Table
from flexura.pages.report.subject import Subject
from flexura.tables import counted, number, quantity, scale_for

MOST = 41
"""Poses that the command prints."""
MODES, MOST_MODES = 6, 9
"""Frequencies of a pose, and curves of modes, of which some may be among the lowest at a part of the poses alone."""
FAR = 30.0
"""Ratio of positive values from which on their axis is logarithmic."""
MOST_WARNINGS = 3


def over_the_stroke(subject: Subject) -> Content:
    """Equilibria, forces, frequencies, support stiffness and margins over the described stroke. Raises FlexuraError."""
    if subject.mechanism.motion is None:
        text = (
            "The file describes no stroke (`motion:`). How far it goes, its forces and frequencies there, for a stroke"
            " that is named:"
        )
        node = subject.platform or "NODE"
        asked = subject.commands(
            "stroke", ["--move", f"{node}.z=0:1mm"], f"move={{'{node}.z': (0, 1e-3)}}", posed=False
        )
        return Content([Paragraph(text, "soft"), Evidence(asked, summary="command")], "absent")
    found = stroke(subject.plan.at_rest(), subject.parameters)
    command = subject.commands("stroke", posed=False)
    if not found.poses:
        return Content(
            [Bullets([str(w) for w in found.warnings], "bad"), Evidence(command)], "failed", warnings=found.warnings
        )
    table = _table(found, command)
    blocks: list[Block] = [
        Paragraph(
            "Large displacements and rotations; frequencies with actuators free under the forces that hold the pose."
        ),
        ChartFigure(_chart(found), table) if len(found.poses) > 1 else table,
    ]
    if found.warnings:
        blocks.append(Bullets(foremost(found.warnings, MOST_WARNINGS), "warning"))
    margins = [(pose.stress_margin, pose) for pose in found.poses if pose.stress_margin is not None]
    least = min((margin for margin, _ in margins), default=None)
    facts = [Fact("poses reached", f"{len(found.poses)}")]
    if least is not None and isfinite(least):
        facts.append(Fact("least factor to yield over the stroke described", number(least, 4)))
    lowest = min((pose.frequency_hz[0] for pose in found.poses if pose.frequency_hz), default=None)
    if lowest is not None:
        told = quantity(lowest, "Hz") if lowest >= 0 else "none: unstable at every pose"
        facts.append(Fact("lowest frequency over the stroke", told))
    # a scene is of one pose: about another one the stroke stands in its curves alone
    shown = () if subject.plan.is_posed else (found,)
    return Content(blocks, facts=facts, warnings=found.warnings, shown=shown)


def _along(found: Stroke) -> tuple[Array, str, str]:
    """What the curves are over: the first that is prescribed where it only grows, else the number of the pose."""
    varied = [pose.varied for pose in found.poses]
    name = next(iter(varied[0]), "")
    if name:
        values = np.array([own[name] for own in varied])
        scale = scale_for(values, found.units[name])
        for own in (values, values[::-1]):
            if (np.diff(own) > 0).all():
                return values / scale.size, name, scale.unit
    return np.arange(1.0, len(varied) + 1), "pose", ""


def _chart(found: Stroke) -> Chart:
    x, label, unit = _along(found)
    order = np.argsort(x, kind="stable")
    poses = [found.poses[k] for k in order]
    hertz, changes = found.frequencies_hz[order][:, :MOST_MODES], found.frequency_changes[order][:, :MOST_MODES]
    named = [f"mode {k + 1}" if k < len(found.poses[0].frequency_hz) else "another mode" for k in range(hertz.shape[1])]
    panels = [
        _panel("natural frequency, each curve one mode by its shape", "Hz", [*zip(named, hertz.T, strict=True)]),
        _panel("change of frequency", "%", [*zip(named, 100 * changes.T, strict=True)]),
    ]
    for name in poses[0].move:
        force = np.array([pose.reaction[name] + 0.0 for pose in poses])
        what = "moment to hold" if is_rotation(name) else "force to hold"
        panels.append(_panel(what, FORCE_UNITS[is_rotation(name)], [(name, force)]))
    shifts = [(node, own[order]) for node, own in found.parasitic_shifts.items()]
    if shifts:
        panels.append(_panel("parasitic shift, in directions that are not driven", "m", shifts))
    support = np.array([pose.support_stiffness[:3] for pose in poses])
    shown = [(f"k{axis}", support[:, k]) for k, axis in enumerate("xyz") if np.isfinite(support[:, k]).any()]
    if shown:
        panels.append(_panel("support stiffness", "N/m", shown))
    margins = np.array([np.nan if p.stress_margin is None else p.stress_margin for p in poses])
    if np.isfinite(margins).any():
        limit = Curve("yield", np.ones(len(poses)), "bound")
        panels.append(
            Panel(
                "factor to yield",
                "",
                True,
                [Curve("factor to yield", np.where(np.isfinite(margins), margins, np.nan)), limit],
            )
        )
    title = f"over {label}" if label != "pose" else "pose by pose"
    said = f"{counted(len(poses), 'pose')}; panels: {', '.join(panel.label for panel in panels)}"
    return Chart("stroke", f"{found.name} {title}", said, label, unit, False, x[order], panels)


def _panel(label: str, unit: str, curves: Sequence[tuple[str, Array]]) -> Panel:
    """Curves of one unit, in equal ratios only where their values are far apart: a change of a few per cent is seen."""
    known = np.concatenate([own[np.isfinite(own)] for _, own in curves])
    far = len(known) > 0 and float(known.min()) > 0 and float(known.max()) > FAR * float(known.min())
    return Panel(label, unit, far, [Curve(name, own) for name, own in curves])


def _table(found: Stroke, command: str) -> Table:
    proven = all(pose.proven for pose in found.poses)
    lines = [
        (
            "frequencies",
            "proven, none missed, at every pose" if proven else "not proven at every pose: see the warnings",
        ),
        ("poses", f"{len(found.poses)}, each reached by a path of equilibria from the undeformed configuration"),
        *(("note", note) for note in found.notes),
    ]
    return Table.of(found.short_columns(MOST, MODES), "poses", Evidence(command, lines, essential=True), left=0)
