"""Frequency responses between what the file drives and reads, or at the platform."""

from __future__ import annotations

from dataclasses import replace
from itertools import zip_longest

import numpy as np

from flexura.analysis import (
    FrequencyResponse,
    ResponseGroup,
    frequency_response,
    phase_in_degrees,
    response_group,
    response_units,
)
from flexura.mechanism import DOF_NAMES
from flexura.pages.report.chart import Chart, Curve, Mark, Panel
from flexura.pages.report.document import Block, Bullets, ChartFigure, Content, Evidence, Paragraph, Table
from flexura.pages.report.subject import Subject
from flexura.tables import counted, in_hz, number
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
