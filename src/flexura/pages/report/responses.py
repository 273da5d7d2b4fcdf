"""Frequency responses between what the file drives and reads, or at the platform."""

from __future__ import annotations

import math
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
from flexura.tables import counted
from flexura.units import format_number

MOST_PAIRS = 12
"""Pairs in the table of gains, as many as the command prints."""
SPREAD = 24
"""Frequencies of a chart's table, beside the resonances."""
LONGEST = 44
"""Characters of the label of a resonance."""
PREFIXES = {-1: (1e3, "m"), -2: (1e6, "µ"), -3: (1e9, "n")}


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
    factor, unit = scaled_unit(max(float(np.abs(curve.H).max()) for curve in group.curves), group.unit)
    unit = unit.replace("*", "·")
    size = [Curve(curve.label, factor * np.abs(curve.H)) for curve in group.curves]
    angle = [Curve(curve.label, phase_in_degrees(curve.H)) for curve in group.curves]
    marks = []
    for k, (hz, words) in enumerate(zip_longest(found.resonances_hz, found.resonance_motions, fillvalue="")):
        label = f"{hz:.4g} Hz {_moves(words, platform)}".strip()
        marks.append(Mark(float(hz), label if len(label) <= LONGEST else f"{label[: LONGEST - 1]}…", str(k + 1)))
    hertz = ", ".join(f"{hz:.4g}" for hz in found.resonances_hz)
    said = f"{counted(len(size), 'curve')}, {counted(len(marks), 'resonance')}" + (f": {hertz} Hz" if marks else "")
    panels = [Panel("magnitude", unit, True, size), Panel("phase", "deg", False, angle)]
    title = f"Frequency responses in {group.unit}"
    return Chart(name, title, said, "frequency", "Hz", True, found.frequency_hz, panels, marks)


def scaled_unit(largest: float, unit: str) -> tuple[float, str]:
    """A factor and a prefix of the unit with which the largest value lies near one; of angles and lengths only."""
    if unit.partition("/")[0] not in ("m", "rad") or not largest > 0:
        return 1.0, unit
    factor, prefix = PREFIXES.get(max(-3, math.floor(math.log10(largest) / 3)), (1.0, ""))
    return factor, prefix + unit


def _gains(found: FrequencyResponse, evidence: Evidence) -> Table:
    size = np.abs(found.response)
    peak, hz = size.max(axis=0), found.frequency_hz
    order = [(i, j) for i in range(len(found.outputs)) for j in range(len(found.inputs))]
    shown = [(i, j) for i, j in order if peak[i, j] > 1e-9 * np.sqrt(peak[i].max() * peak[:, j].max())]
    rows = []
    for i, j in shown[:MOST_PAIRS]:
        own, out, into = size[:, i, j], found.outputs[i].name, found.inputs[j].name
        rows.append(
            [
                f"{out} / {into}",
                f"{own[0]:.5g}",
                f"{own.max():.5g}",
                f"{hz[int(own.argmax())]:.5g}",
                found.unit(out, into),
            ]
        )
    headings = ["output / input", f"at {hz[0]:.5g} Hz", "largest", "at Hz", "unit"]
    caption = "gains and peaks" + (f" of {MOST_PAIRS} of {len(shown)} pairs" if len(shown) > MOST_PAIRS else "")
    return Table(headings, rows, (1, 2, 3), caption, evidence)


def _resonances(found: FrequencyResponse, command: str) -> Table:
    rows = [
        [str(k + 1), f"{hz:.5g}", f"{zeta:.4g}", words]
        for k, (hz, zeta, words) in enumerate(
            zip_longest(found.resonances_hz, found.ratios, found.resonance_motions, fillvalue="")
        )
    ]
    headings = ["resonance", "Hz", "damping ratio", "what moves"]
    return Table(headings, rows, (1, 2), "resonances in the band", Evidence(command))


def _values(found: FrequencyResponse, group: ResponseGroup, command: str) -> Table:
    """Some values of a chart: at the resonances and at frequencies spread over the band."""
    hz = found.frequency_hz
    wanted = np.concatenate([np.geomspace(hz[0], hz[-1], SPREAD), found.resonances_hz])
    chosen = np.unique(np.abs(hz[:, None] - wanted).argmin(axis=0))
    columns = [values for curve in group.curves for values in (np.abs(curve.H), phase_in_degrees(curve.H))]
    headings = [
        "Hz",
        *(f"{' / '.join(c.pairs[0])} {what}" for c in group.curves for what in (group.unit.replace("*", "·"), "deg")),
    ]
    rows = [[f"{hz[k]:.5g}", *(f"{values[k]:.5g}" for values in columns)] for k in chosen]
    note = f"{len(rows)} of {len(hz)} frequencies; the command writes all, phases within half a turn"
    return Table(headings, rows, range(len(headings)), note, Evidence(command))
