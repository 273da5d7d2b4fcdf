"""What the model is held against: solid finite elements, and a test."""

from __future__ import annotations

import math

from flexura.pages.report.document import Block, Bullets, Content, Evidence, Fact, Paragraph, Table
from flexura.pages.report.subject import Subject
from flexura.solid.verification import verify
from flexura.tables import number, quantity
from flexura.testing.virtual import FoundMode, virtual_test

QUICK = 1_000_000
"""Samples in time of all hits up to which a test is simulated for a report."""
HEADINGS = {
    "solid frequency [Hz]": "solid Hz",
    "frequency [Hz]": "beams Hz",
    "relative error": "relative difference",
    "mac": "MAC",
}
"""Columns of a verification, in words."""


def against_the_solid(subject: Subject) -> Content:
    """Beam models beside solid finite elements, where that is asked for. Raises FlexuraError."""
    options = ["-n", str(subject.n)]
    command = subject.commands("verify", options, f"n={subject.n}", posed=False)
    if not subject.solid:
        text = (
            "The validity of beams on this mechanism is not in this report: solid finite elements take seconds"
            " to minutes. --solid puts them in; alone they are:"
        )
        blocks = [Paragraph(text, "soft"), Evidence(command, summary="command")]
        return Content(blocks, "absent")
    found = verify(subject.mechanism, dict(subject.parameters), n=subject.n)
    columns = found.to_columns()
    rows = [[_cell(columns[name][k]) for name in columns] for k in range(len(next(iter(columns.values()), ())))]
    numbers = [k for k, name in enumerate(columns) if name not in ("model", "pair", "what moves")]
    lines = [("note", note) for note in found.notes]
    headings = [HEADINGS.get(name, name) for name in columns]
    made: list[Block] = [Table(headings, rows, numbers, evidence=Evidence(f"{command} --json", lines, essential=True))]
    made += [Bullets([str(w) for w in found.warnings], "warning")] * bool(found.warnings)
    return Content(made, warnings=found.warnings)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else number(value)
    return "" if value is None else str(value)


def tested(subject: Subject) -> Content:
    """The described hammer test, simulated and identified, where it is quick. Raises FlexuraError."""
    test = subject.mechanism.test
    if test is None:
        text = (
            "The file describes no test (`test:`), so none is simulated; `flexura calibrate` fits parameters to"
            " measured frequencies."
        )
        return Content([Paragraph(text, "soft")], "absent")
    command = subject.commands("virtual-test", posed=False)
    samples = subject.samples
    if samples > QUICK:
        text = f"The test has {samples:.3g} samples, too many to simulate for a report; by itself it is:"
        return Content([Paragraph(text, "soft"), Evidence(command, summary="command")], "absent")
    found = virtual_test(subject.mechanism, dict(subject.parameters))
    headings = [
        "mode",
        "no sensors Hz",
        "sensors on Hz",
        "mass effect",
        "identified Hz",
        "rad/s",
        "off",
        "damping %",
        "off",
        "MAC",
        "confidence",
    ]
    rows = [
        [str(m.number), number(m.bare_hz), number(m.mass_loaded_hz), f"{100 * m.mass_effect:+.2f} %", *_identified(m)]
        for m in found.modes
    ]
    hits, placements = len(found.measurement.recordings), len(list(found.test.placed()))
    lines = [("records", f"{hits} hits, {placements} placements, noise with seed {found.seed}")]
    lines += [("note", note) for note in dict.fromkeys(found.notes)]
    blocks: list[Block] = [
        Paragraph(
            "Simulated with the noise that the file describes, then identified as a measurement would be; nothing here"
            " was measured."
        ),
        Table(headings, rows, range(11), evidence=Evidence(command, lines, essential=True)),
    ]
    if found.false_hz:
        listed = ", ".join(quantity(f, "Hz") for f in found.false_hz)
        blocks.append(Paragraph(f"Identified where there is no mode: {listed}", "warning"))
    missed = sum(m.identified_hz is None for m in found.modes)
    facts = [Fact("modes that the test would find", f"{len(found.modes) - missed} of {len(found.modes)}")]
    return Content(blocks, facts=facts, warnings=found.warnings)


def _identified(mode: FoundMode) -> list[str]:
    if mode.identified_hz is None or mode.identified_damping is None or mode.mac is None or mode.confidence is None:
        return ["missed", "", "", f"({100 * mode.damping_ratio:.3g})", "", "", ""]
    hz = mode.identified_hz
    errors = [f"{100 * (mode.error or 0.0):+.3f} %", f"{100 * mode.identified_damping:.3f}"]
    errors.append("" if mode.damping_error is None else f"{100 * mode.damping_error:+.1f} %")
    return [number(hz), number(2 * math.pi * hz), *errors, f"{mode.mac:.3f}", f"{mode.confidence:.2f}"]
