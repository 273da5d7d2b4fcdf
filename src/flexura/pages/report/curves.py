"""Frequency responses between what the file drives and reads, and the mechanism over its stroke."""

from __future__ import annotations

from dataclasses import replace
from itertools import zip_longest
from math import isfinite

import numpy as np

from flexura.analysis import (
    FrequencyResponse,
    ResponseGroup,
    Stroke,
    budget,
    budget_chart,
    frequency_response,
    phase_in_degrees,
    response_chart,
    response_group,
    response_units,
    stroke,
    stroke_chart,
)
from flexura.charts import Axis, Chart
from flexura.errors import foremost
from flexura.mechanism import DOF_NAMES
from flexura.pages.report.document import Block, Bullets, ChartFigure, Content, Evidence, Fact, Paragraph, Table, warned
from flexura.pages.report.subject import Subject
from flexura.tables import Table as ShownTable
from flexura.tables import number, quantity
from flexura.units import format_number

MOST_PAIRS = 12
"""Pairs in the table of gains, as many as the command prints."""
MOST_BUDGETS = 4
"""Outputs whose budgets are drawn."""
DRAWN = 240
"""Frequencies of their curves."""
SPREAD = 24
"""Frequencies of a chart's table, beside the resonances."""


def frequency_responses(subject: Subject) -> Content:
    """Magnitude and phase of the pairs that matter, one chart for each unit. Raises FlexuraError."""
    inputs, outputs, why = _channels(subject)
    if not inputs or not outputs:
        return Content.absent(why)
    band = _band(subject)
    if band is None:
        text = "No band: the mechanism has no frequency above zero among the modes above."
        return Content.absent(text)
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
        chart = response_chart(found, group, subject.platform).suited()
        blocks.append(ChartFigure(replace(chart, id=f"response-{k + 1}"), _values(found, group, every)))
        if group.left_out:
            count = len(group.left_out) + sum(len(curve.pairs) for curve in group.curves)
            text = f"{len(group.left_out)} of {count} responses in {unit} are left out, the smallest."
            blocks.append(Paragraph(text, "soft"))
    blocks += warned(found.warnings)
    return Content(blocks, warnings=found.warnings)


def error_budget(subject: Subject) -> Content:
    """What the disturbances described make of outputs: the table of a design review, and cumulative amplitudes. Raises
    FlexuraError."""
    if not subject.mechanism.disturbances:
        return Content.absent("No `disturbances` are described.")
    command = subject.commands("budget", [], "")
    found = budget(subject.plan, subject.parameters)
    lines = [("loops", found.loop), *(("note", note) for note in found.notes)]
    review, parts = [own for own in found.presentation() if isinstance(own, ShownTable)]
    evidence = Evidence(command, lines, essential=True)
    blocks: list[Block] = [
        Table.of(dict(review.columns), f"root mean squares, {found.loop} loop", evidence, left=1),
        Table.of(dict(parts.columns), parts.title, Evidence(command), left=1),
    ]
    thin = np.unique(np.linspace(0, len(found.frequency_hz) - 1, DRAWN).astype(int))
    found = replace(
        found, frequency_hz=found.frequency_hz[thin], density=found.density[:, thin], up_to=found.up_to[:, thin]
    )
    for k in range(min(len(found.outputs), MOST_BUDGETS)):
        chart = budget_chart(found, k).suited()
        at = np.unique(np.linspace(0, len(found.frequency_hz) - 1, SPREAD).astype(int))
        values = {"frequency [Hz]": found.frequency_hz[at].tolist()}
        values |= {f"cumulative [{found.outputs[k].unit}]": found.cumulative[at, k].tolist()}
        blocks.append(ChartFigure(chart, Table.of(values, "some of its values", Evidence(command))))
    blocks += warned(found.warnings)
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
MODES = 6
"""Frequencies of a pose."""
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
        return Content.absent(text, asked)
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
        ChartFigure(_ascending(stroke_chart(found).suited()), table) if len(found.poses) > 1 else table,
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


def _ascending(chart: Chart) -> Chart:
    """A chart over what only grows: what it is over, backwards where that falls, else the number of the pose."""
    x, order = chart.x, slice(None)
    if (np.diff(x) < 0).all():
        order = slice(None, None, -1)
    elif not (np.diff(x) > 0).all():
        x, along = np.arange(1.0, len(x) + 1), Axis("pose")
        chart = replace(chart, panels=[replace(own, x=along) for own in chart.panels])
    panels = [
        replace(own, curves=[replace(curve, x=x[order], y=curve.y[order]) for curve in own.curves])
        for own in chart.panels
    ]
    return replace(chart, panels=panels)


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
