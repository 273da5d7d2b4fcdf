"""Frequency responses between what the file drives and reads, and the mechanism over its stroke."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from math import isfinite

import numpy as np

from flexura.analysis import (
    FrequencyResponse,
    ResponseGroup,
    Stroke,
    frequency_response,
    phase_in_degrees,
    response_group,
    response_units,
    stroke,
)
from flexura.arrays import Array
from flexura.errors import foremost
from flexura.mechanism import DOF_NAMES, FORCE_UNITS, is_rotation
from flexura.pages.report.chart import Chart, Curve, Mark, Panel
from flexura.pages.report.document import Block, Bullets, ChartFigure, Content, Evidence, Fact, Paragraph, Table
from flexura.pages.report.subject import Subject
from flexura.tables import counted, in_hz, number, quantity, scale_for
from flexura.units import format_number

MOST_PAIRS = 12
"""Pairs in the table of gains, as many as the command prints."""
SPREAD = 24
"""Frequencies of a chart's table, beside the resonances."""
LONGEST = 44
"""Characters of the label of a resonance."""


def frequency_responses(subject: Subject) -> Content:
    """Magnitude and phase of the pairs that matter, one chart for each unit. Raises FlexuraError."""
    inputs, outputs, why = _channels(subject)
    if not inputs or not outputs:
        return Content([Paragraph(why, "soft")], "absent")
    band = _band(subject)
    if band is None:
        text = "No band: the mechanism has no frequency above zero among the modes above."
        return Content([Paragraph(text, "soft")], "absent")
    text = f"{format_number(band[0])},{format_number(band[1])} Hz"
    options = [
        "--band",
        text,
        *(w for name in inputs for w in ("-i", name)),
        *(w for name in outputs for w in ("-o", name)),
    ]
    python = f"band={band}, inputs={inputs}, outputs={outputs}"
    command = subject.commands("frequency-response", options, python)
    every = subject.commands("frequency-response", [*options, "--out", "responses.csv"], python)
    found = frequency_response(subject.plan, subject.parameters, inputs=inputs, outputs=outputs, band=band)
    lines = [("from", why), ("model", f"order {found.order}"), *(("note", note) for note in found.notes)]
    evidence = Evidence(command, lines, essential=True)
    told = f"{why} From {format_number(band[0])} to {format_number(band[1])} Hz."
    blocks: list[Block] = [Paragraph(told), _gains(found, evidence)]
    if len(found.resonances_hz):
        blocks.append(_resonances(found, command))
    for k, unit in enumerate(response_units(found)):
        group = response_group(found, unit)
        chart = response_chart(f"response-{k + 1}", found, group, subject.platform)
        blocks.append(ChartFigure(chart, _values(found, group, every)))
        if group.left_out:
            count = len(group.left_out) + sum(len(curve.pairs) for curve in group.curves)
            text = f"{len(group.left_out)} of {count} responses in {unit} are left out, the smallest."
            blocks.append(Paragraph(text, "soft"))
    if found.warnings:
        blocks.append(Bullets([str(w) for w in found.warnings], "warning"))
    return Content(blocks, warnings=found.warnings)


def _channels(subject: Subject) -> tuple[list[str], list[str], str]:
    """Inputs and outputs: those of the file, or the displacements of the platform."""
    inputs = [own.channel.name for own in subject.inputs]
    outputs = subject.sensors
    drive = [] if subject.platform is None else [f"{subject.platform}.{dof}" for dof in DOF_NAMES]
    moves = [name for name in drive if subject.is_free(name)]
    if inputs and outputs:
        return inputs, outputs, "From the actuators to the sensors that the file describes."
    if not moves:
        return [], [], "No actuators with sensors are described, and there is no rigid body to push at."
    if inputs:
        return inputs, moves, f"No sensors are described: the motion of {subject.platform} is read."
    if outputs:
        return moves, outputs, f"No actuators are described: forces and moments act on {subject.platform}."
    return (
        moves,
        moves,
        f"No actuators and no sensors are described: {subject.platform} is pushed and read at its node.",
    )


def _band(subject: Subject) -> tuple[float, float] | None:
    """From a fifth of the lowest frequency to twice the highest one that was asked for, in two digits."""
    hz = [f for f in subject.modes.frequency_hz.tolist() if f > 0]
    return (float(f"{hz[0] / 5:.1g}"), float(f"{2 * hz[-1]:.2g}")) if hz else None


def _moves(words: str, platform: str | None) -> str:
    """What moves, without its parts that bend, and without the name of the platform."""
    return words.partition(" (")[0].removeprefix(f"{platform} ")


def response_chart(name: str, found: FrequencyResponse, group: ResponseGroup, platform: str | None) -> Chart:
    """Magnitude over phase of responses of one unit, resonances marked with what moves in them."""
    size = [Curve(curve.label, np.abs(curve.H)) for curve in group.curves]
    angle = [Curve(curve.label, phase_in_degrees(curve.H)) for curve in group.curves]
    marks = []
    for k, (hz, words) in enumerate(zip_longest(found.resonances_hz, found.resonance_motions, fillvalue="")):
        label = f"{in_hz(float(hz), 4)} {_moves(words, platform)}".strip()
        marks.append(Mark(float(hz), label if len(label) <= LONGEST else f"{label[: LONGEST - 1]}…", str(k + 1)))
    hertz = ", ".join(f"{hz:.4g}" for hz in found.resonances_hz)
    said = f"{counted(len(size), 'curve')}, {counted(len(marks), 'resonance')}" + (f": {hertz} Hz" if marks else "")
    panels = [Panel("magnitude", group.unit, True, size), Panel("phase", "deg", False, angle)]
    title = f"Frequency responses in {group.unit}"
    return Chart(name, title, said, "frequency", "Hz", True, found.frequency_hz, panels, marks)


def _gains(found: FrequencyResponse, evidence: Evidence) -> Table:
    columns = found.gain_columns()
    count = len(columns["peak"])
    caption = "gains and peaks" + (f" of {MOST_PAIRS} of {count} pairs" if count > MOST_PAIRS else "")
    return Table.of({name: own[:MOST_PAIRS] for name, own in columns.items()}, caption, evidence, left=2)


def _resonances(found: FrequencyResponse, command: str) -> Table:
    rows = [
        (str(k + 1), float(hz), "" if zeta == "" else number(float(zeta), 4), words)
        for k, (hz, zeta, words) in enumerate(
            zip_longest(found.resonances_hz, found.ratios, found.resonance_motions, fillvalue="")
        )
    ]
    headings = ("resonance", "frequency [Hz]", "damping ratio", "what moves")
    columns = {name: [row[k] for row in rows] for k, name in enumerate(headings)}
    return replace(Table.of(columns, "resonances in the band", Evidence(command)), numbers=(1, 2))


def _values(found: FrequencyResponse, group: ResponseGroup, command: str) -> Table:
    """Some values of a chart: at the resonances and at frequencies spread over the band."""
    hz = found.frequency_hz
    wanted = np.concatenate([np.geomspace(hz[0], hz[-1], SPREAD), found.resonances_hz])
    chosen = np.unique(np.abs(hz[:, None] - wanted).argmin(axis=0))
    columns = {"frequency [Hz]": hz[chosen]}
    for curve in group.curves:
        pair = " / ".join(curve.pairs[0])
        columns[f"{pair} [{group.unit}]"] = np.abs(curve.H)[chosen]
        columns[f"{pair} phase [deg]"] = phase_in_degrees(curve.H)[chosen]
    note = f"{len(chosen)} of {len(hz)} frequencies; the command writes all, phases within half a turn"
    return Table.of(columns, note, Evidence(command), left=0)


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
