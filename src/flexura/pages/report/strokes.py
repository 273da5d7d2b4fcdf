"""The mechanism over the stroke that its file describes."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from flexura.analysis import Stroke, StrokePose, stroke
from flexura.errors import foremost
from flexura.pages.report.chart import Chart, Curve, Panel
from flexura.pages.report.document import Block, Bullets, ChartFigure, Content, Evidence, Fact, Paragraph, Table
from flexura.pages.report.subject import Subject
from flexura.tables import counted

Array = NDArray[np.float64]
MOST = 41
"""Poses that the command prints."""
MODES = 6
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
        ChartFigure(_chart(found), table),
    ]
    if found.warnings:
        blocks.append(Bullets(foremost(found.warnings, MOST_WARNINGS), "warning"))
    margins = [(pose.stress_margin, pose) for pose in found.poses if pose.stress_margin is not None]
    least = min((margin for margin, _ in margins), default=None)
    facts = [Fact("poses reached", f"{len(found.poses)}")]
    if least is not None and isfinite(least):
        facts.append(Fact("least factor to yield over the stroke", _factor(least)))
    lowest = min((pose.frequency_hz[0] for pose in found.poses if pose.frequency_hz), default=None)
    if lowest is not None:
        told = f"{lowest:.5g} Hz" if lowest >= 0 else "none: unstable at every pose"
        facts.append(Fact("lowest frequency over the stroke", told))
    # a scene is of one pose: about another one the stroke stands in its curves alone
    shown = () if subject.plan.is_posed else (found,)
    return Content(blocks, facts=facts, warnings=found.warnings, shown=shown)


def _factor(value: float | None) -> str:
    return "" if value is None or not isfinite(value) else f"{value:.3g}"


def _scale(name: str) -> tuple[float, str]:
    """What multiplies a prescribed displacement, and its unit."""
    return (1.0, "rad") if name.rpartition(".")[2].startswith("r") else (1e3, "mm")


def _along(found: Stroke) -> tuple[Array, str, str]:
    """What the curves are over: the first that is prescribed where it only grows, else the number of the pose."""
    varied = [pose.varied for pose in found.poses]
    name = next(iter(varied[0]), "")
    if name:
        factor, unit = _scale(name) if name in found.poses[0].move else (1.0, found.units[name])
        values = factor * np.array([own[name] for own in varied])
        for own in (values, values[::-1]):
            if (np.diff(own) > 0).all():
                return values, name, unit
    return np.arange(1.0, len(varied) + 1), "pose", ""


def _chart(found: Stroke) -> Chart:
    x, label, unit = _along(found)
    order = np.argsort(x, kind="stable")
    poses = [found.poses[k] for k in order]
    n = min(MODES, found.frequencies_hz.shape[1])
    tracked = found.frequencies_hz[order]
    panels = [
        Panel(
            "natural frequency", "Hz", True, [Curve(f"mode {k + 1} at the first pose", tracked[:, k]) for k in range(n)]
        )
    ]
    for name in poses[0].move:
        turns = _scale(name)[1] == "rad"
        force = np.array([pose.reaction[name] + 0.0 for pose in poses])
        panels.append(
            Panel("moment to hold" if turns else "force to hold", "N·m" if turns else "N", False, [Curve(name, force)])
        )
    support = np.array([pose.support_stiffness[:3] for pose in poses])
    shown = [Curve(f"k{axis}", support[:, k]) for k, axis in enumerate("xyz") if np.isfinite(support[:, k]).any()]
    if shown:
        panels.append(Panel("support stiffness", "N/m", True, shown))
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


def _table(found: Stroke, command: str) -> Table:
    first = found.poses[0]
    changing = {**first.load, **first.actuators}
    headings = [f"{name} {found.units[name]}" for name in changing]
    for name in first.move:
        turns = _scale(name)[1] == "rad"
        headings += [f"{name} {'rad' if turns else 'mm'}", "force N·m" if turns else "force N"]
    n = min(len(first.frequency_hz), MODES)
    headings += [*(f"f{k + 1} Hz" for k in range(n)), *(f"k{axis} N/m" for axis in "xyz"), "to yield", "to buckle"]
    every = max(1, -(-len(found.poses) // MOST))
    rows = [_row(pose, list(changing)) for pose in found.poses[::every]]
    proven = all(pose.proven for pose in found.poses)
    lines = [
        (
            "frequencies",
            "proven, none missed, at every pose" if proven else "not proven at every pose: see the warnings",
        ),
        ("poses", f"{len(found.poses)}, each reached by a path of equilibria from the undeformed configuration"),
        *(("note", note) for note in found.notes),
    ]
    return Table(headings, rows, range(len(headings)), "poses", Evidence(command, lines, essential=True))


def _row(pose: StrokePose, changing: list[str]) -> list[str]:
    cells = [f"{pose.varied[name]:.5g}" for name in changing]
    for name, value in pose.move.items():
        cells += [f"{_scale(name)[0] * value:.5g}", f"{pose.reaction[name] + 0.0:.5g}"]
    cells += [f"{f:.5g}" for f in pose.frequency_hz[:MODES]]
    cells += ["driven" if np.isnan(k) else f"{k:.4g}" for k in pose.support_stiffness[:3]]
    return [*cells, _factor(pose.stress_margin), _factor(pose.buckling_factor)]
