"""Frequency responses between what the file drives and reads, or at the platform."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.analysis import FrequencyResponse, Mode, frequency_response, modes
from flexura.errors import FlexuraError
from flexura.mechanism import DOF_NAMES
from flexura.pages.report.chart import Chart, Curve, Mark, Panel
from flexura.pages.report.document import Block, Bullets, ChartFigure, Content, Evidence, Paragraph, Table
from flexura.pages.report.subject import Subject
from flexura.units import format_number

Array = NDArray[np.float64]
SILENT = 1e-6
"""Responses whose peak is below so much of the largest of their row and of their column do not matter: symmetry."""
MOST_CURVES = 8
MOST_PAIRS = 12
"""Pairs in the table of gains, as many as the command prints."""
SPREAD = 24
"""Frequencies of a chart's table, beside the resonances."""
SAME = 0.005
"""Relative difference up to which a resonance is that of a mode."""
PREFIXES = {-1: (1e3, "m"), -2: (1e6, "µ"), -3: (1e9, "n")}


@dataclass(frozen=True)
class Pair:
    """An output over an input that matters, with its response."""

    output: str
    input: str
    unit: str
    response: NDArray[np.complex128]

    @property
    def name(self) -> str:
        """`output / input`."""
        return f"{self.output} / {self.input}"


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
    named = _named(subject, found)
    pairs = pairs_that_matter(found)
    lines = [("from", why), ("model", f"order {found.order}"), *(("note", note) for note in found.notes)]
    evidence = Evidence(command, lines, essential=True)
    blocks: list[Block] = [
        Paragraph(f"{why} From {format_number(band[0])} to {format_number(band[1])} Hz."),
        _gains(found, evidence),
    ]
    if len(found.resonances_hz):
        blocks.append(_resonances(found, named, command))
    for k, unit in enumerate(dict.fromkeys(pair.unit for pair in pairs)):
        own = [pair for pair in pairs if pair.unit == unit]
        chart = response_chart(f"response-{k + 1}", found, own[:MOST_CURVES], named, subject.platform)
        blocks.append(ChartFigure(chart, _values(found, own[:MOST_CURVES], every)))
        if len(own) > MOST_CURVES:
            blocks.append(
                Paragraph(
                    f"The {MOST_CURVES} largest of {len(own)} responses in {unit or 'plain numbers'} are drawn.", "soft"
                )
            )
    count = len(found.inputs) * len(found.outputs)
    if len(pairs) < count:
        blocks.append(
            Paragraph(
                f"{count - len(pairs)} of {count} pairs are left out: their response is zero but for round-off.", "soft"
            )
        )
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


def _named(subject: Subject, found: FrequencyResponse) -> list[Mode | None]:
    """The mode that each resonance is, where that is clear."""
    try:
        known = modes(subject.plan, subject.parameters, n=subject.n + len(found.resonances_hz)).modes
    except FlexuraError:
        known = subject.modes.modes
    named: list[Mode | None] = []
    for hz in found.resonances_hz:
        near = min(known, key=lambda mode: abs(mode.frequency_hz - hz))
        known = tuple(mode for mode in known if mode is not near) or known
        named.append(near if abs(near.frequency_hz / hz - 1) < SAME else None)
    return named


def pairs_that_matter(found: FrequencyResponse) -> list[Pair]:
    """The pairs that are not zero but for round-off, the largest first among those of one unit."""
    peak = np.abs(found.response).max(axis=0)
    size = np.sqrt(np.outer(peak.max(axis=1), peak.max(axis=0)))
    chosen = [(i, j) for i, j in np.argwhere(peak > SILENT * size).tolist()]
    chosen.sort(key=lambda ij: -peak[ij])
    return [
        Pair(o.name, i.name, found.unit(o.name, i.name), found.of(o.name, i.name))
        for o, i in ((found.outputs[i], found.inputs[j]) for i, j in chosen)
    ]


def _moves(mode: Mode, platform: str | None) -> str:
    """What moves, without its parts that bend, and without the name of the platform."""
    return mode.motion.summary.partition(" (")[0].removeprefix(f"{platform} ")


def response_chart(
    name: str, found: FrequencyResponse, pairs: Sequence[Pair], named: Sequence[Mode | None], platform: str | None
) -> Chart:
    """Magnitude over phase of pairs of one unit, resonances marked with what moves in them."""
    factor, unit = scaled_unit(max(float(np.abs(pair.response).max()) for pair in pairs), pairs[0].unit)
    size = [Curve(pair.name, factor * np.abs(pair.response)) for pair in pairs]
    angle = [Curve(pair.name, phase(pair.response)) for pair in pairs]
    marks = []
    for k, (hz, mode) in enumerate(zip(found.resonances_hz, named, strict=True)):
        moves = "" if mode is None else f" {_moves(mode, platform)}"
        label = f"{hz:.4g} Hz{moves}"
        marks.append(Mark(float(hz), label if len(label) <= 44 else f"{label[:43]}…", str(k + 1)))
    said = (
        f"{len(pairs)} curves, {len(marks)} resonances: " + ", ".join(f"{hz:.4g}" for hz in found.resonances_hz) + " Hz"
    )
    panels = [Panel("magnitude", unit or "1", True, size), Panel("phase", "deg", False, angle)]
    return Chart(
        name,
        f"Frequency responses in {pairs[0].unit}",
        said,
        "frequency",
        "Hz",
        True,
        found.frequency_hz,
        panels,
        marks,
    )


def scaled_unit(largest: float, unit: str) -> tuple[float, str]:
    """A factor and a prefix of the unit with which the largest value lies near one; of angles and lengths only."""
    if unit.partition("/")[0] not in ("m", "rad") or not largest > 0:
        return 1.0, unit
    factor, prefix = PREFIXES.get(max(-3, math.floor(math.log10(largest) / 3)), (1.0, ""))
    return factor, prefix + unit


def phase(H: NDArray[np.complex128]) -> Array:
    """Phase in degrees, unwrapped, moved by whole turns so that its median is within a turn."""
    found = np.degrees(np.unwrap(np.angle(H)))
    return found - 360 * np.round(np.median(found) / 360)


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


def _resonances(found: FrequencyResponse, named: Sequence[Mode | None], command: str) -> Table:
    rows = [
        [str(k + 1), f"{hz:.5g}", f"{zeta:.4g}", "" if mode is None else mode.motion.summary]
        for k, (hz, zeta, mode) in enumerate(zip(found.resonances_hz, found.ratios, named, strict=True))
    ]
    return Table(
        ["resonance", "Hz", "damping ratio", "what moves"], rows, (1, 2), "resonances in the band", Evidence(command)
    )


def _values(found: FrequencyResponse, pairs: Sequence[Pair], command: str) -> Table:
    """Some values of a chart: at the resonances and at frequencies spread over the band."""
    hz = found.frequency_hz
    spread = np.geomspace(hz[0], hz[-1], SPREAD)
    chosen = np.unique(np.abs(hz[:, None] - np.concatenate([spread, found.resonances_hz])).argmin(axis=0))
    angles = [phase(pair.response) for pair in pairs]
    headings = ["Hz", *(f"{pair.name} {what}" for pair in pairs for what in (pair.unit or "1", "deg"))]
    rows = [
        [
            f"{hz[k]:.5g}",
            *(
                text
                for pair, own in zip(pairs, angles, strict=True)
                for text in (f"{abs(pair.response[k]):.5g}", f"{own[k]:.4g}")
            ),
        ]
        for k in chosen
    ]
    note = f"{len(rows)} of {len(hz)} frequencies; the command writes all, phases within half a turn"
    return Table(headings, rows, range(len(headings)), note, Evidence(command))
