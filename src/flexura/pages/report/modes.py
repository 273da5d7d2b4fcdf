"""What moves: natural modes with their certificates, freedoms of a platform and how actuators move it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexura.analysis import Freedom, Kinetostatics, Mode
from flexura.errors import SolverError
from flexura.mechanism import DOF_NAMES, FORCE_UNITS, UNITS
from flexura.pages.report.document import Block, Bullets, Content, Evidence, Fact, Folded, Paragraph, Table, warned
from flexura.pages.report.subject import Subject
from flexura.tables import number, quantity

FIRST = 3
"""Frequencies that the summary tells."""
LARGEST = 4
"""Shares of energy that are told of a mode."""


def certified_modes(subject: Subject) -> Content:
    """Frequencies with proven intervals, what moves, and which parts bend. Raises FlexuraError."""
    found = subject.modes
    meshed = any(mode.mesh_error is not None for mode in found.modes)
    errors = found.model_errors
    columns = {
        "mode": [str(mode.number) for mode in found.modes],
        "frequency [Hz]": [mode.frequency_cell for mode in found.modes],
        "rad/s": [number(mode.angular_frequency) for mode in found.modes],
        "full [Hz]": ["none" if (own := mode.full_frequency_hz) is None else own for mode in found.modes],
        "difference": [mode.difference_text for mode in found.modes],
        "proven": [mode.proven_text for mode in found.modes],
    }
    if meshed:
        meshes = [mode.mesh_error for mode in found.modes]
        columns["meshes"] = ["" if error is None else f"within {100 * error:.2g} %" for error in meshes]
    columns["model error"] = errors.texts
    columns["what moves"] = [mode.motion.summary for mode in found.modes]
    if any(mode.flag for mode in found.modes):
        columns["flag"] = [mode.flag for mode in found.modes]
    command = subject.commands("modes", ["-n", str(subject.n)], f"n={subject.n}")
    lines = [("order", f"{found.order} of {found.full_order}"), ("tolerance", f"{found.tolerance:g}")]
    lines += [("reduction", step) for step in found.steps]
    lines += [("evidence", line) for line in found.evidence.lines]
    lines.append(("complete", _complete(found.evidence.complete, found.evidence.is_counted)))
    table = replace(
        Table.of(columns, evidence=Evidence(command, lines, essential=True)),
        numbers=range(1, 4),
        motions=[f"mode-{mode.number}" for mode in found.modes],
        details=[
            [*_proof(mode), ("model error", ": ".join(filter(None, (error, causes))))]
            for mode, error, causes in zip(found.modes, errors.texts, errors.causes, strict=True)
        ],
    )
    blocks: list[Block] = [
        Paragraph(
            f"Each frequency of the low-order model, order {found.order}, lies in an interval that is proven to hold"
            f" one of the full-order model, order {found.full_order}."
            " Proven is how near a number is to that of the description; it says nothing of the part."
        ),
        Paragraph(
            "Model error is how far the frequency of the part may be from the one given, as beams, joints and bodies"
            " are not quite what the description takes them for: an estimate from measured errors, not a proof."
        ),
        table,
    ]
    blocks += warned(found.warnings)
    blocks += [
        Bullets(
            [
                f"{quantity(missed.frequency_hz, 'Hz')} is missing from the low-order model: {missed.summary}"
                for missed in found.evidence.missed
            ],
            "bad",
        )
    ] * bool(found.evidence.missed)
    hz = [mode.frequency_text for mode in found.modes[:FIRST]]
    facts = [Fact(f"lowest {len(hz)} frequencies" if len(hz) > 1 else "lowest frequency", ", ".join(hz))]
    return Content(blocks, facts=facts, warnings=found.warnings, shown=(found,))


def _complete(complete: bool, counted: bool) -> str:
    if complete:
        return "no mode is missing in this range"
    return "modes are missing from the low-order model" if counted else "round-off hides whether a mode is missing"


def _proof(mode: Mode) -> list[tuple[str, str]]:
    """What is proven of one mode, and where its energy is."""
    lower, upper = mode.interval_hz
    ends = [("?" if end is None else f"{end:.9g}") for end in (lower, upper)]
    lines = [("proven", f"a full-order frequency lies from {ends[0]} to {ends[1]} Hz")]
    if mode.is_indexed:
        lines.append(("number", f"it is that of mode {mode.number}, by an inertia count"))
    if mode.mac is not None:
        lines.append(("MAC", f"{mode.mac:.6f} with the full-order mode"))
    for word, shares in (("strain energy", mode.motion.strain_share), ("kinetic energy", mode.motion.kinetic_share)):
        most = sorted(shares.items(), key=lambda item: -item[1])[:LARGEST]
        lines.append((word, ", ".join(f"{name} {100 * share:.0f} %" for name, share in most if share >= 0.005)))
    return lines


ALIGNED = 5e-5
"""Components below this are zero in the digits that are shown."""


def freedoms(subject: Subject) -> Content:
    """Freedoms with their screw axes, coupling, stiffness, workspace. Raises FlexuraError."""
    if subject.platform is None:
        text = "No rigid body is there to be a platform; `flexura kinetostatics FILE --platform NODE` takes a node."
        return Content.absent(text)
    if subject.plan.is_posed:
        text = f"Freedoms of {subject.platform} are of the undeformed mechanism alone; this report is about a pose."
        return Content.absent(text)
    try:
        found = subject.kinetostatics
    except SolverError:
        if not any(mode.is_rigid for mode in subject.modes.modes):
            raise
        text = f"Parts of the mechanism float: freedoms of {subject.platform} are counted where elastic parts hold it."
        return Content.absent(text)
    named = ["--platform", found.platform]
    command = subject.commands("kinetostatics", named, f"platform={found.platform!r}", posed=False)
    why = "actuators own more than half of the compliance of each" if found.inputs else "compliances above a clear gap"
    lines = [("platform", found.platform), ("freedoms", why), *(("note", note) for note in found.notes)]
    evidence = Evidence(command, lines, essential=True)
    told = (
        f"{found.platform} has {found.kind}"
        if found.is_clear
        else f"{found.platform} has no freedoms that are clear cut"
    )
    blocks: list[Block] = [Paragraph(f"{told}.")]
    if found.freedoms:
        blocks.append(_freedoms(found, evidence))
    elif not found.inputs:
        blocks.append(_spectrum(found, evidence))
    if found.inputs:
        blocks.append(
            Table.of(found.coupling_columns(), "motion of the platform per unit of each command", Evidence(command))
        )
    blocks.append(
        Table.of(found.stiffness_columns(), "stiffness of the platform, one coordinate at a time", Evidence(command))
    )
    blocks.append(
        _compliance(
            found, subject.commands("kinetostatics", [*named, "--json"], f"platform={found.platform!r}", posed=False)
        )
    )
    if not found.inputs:
        blocks.append(Paragraph("No actuators are described: coupling, amplification and workspace need them.", "soft"))
    blocks += warned(found.warnings)
    facts = [Fact(f"freedoms of {found.platform}", found.kind)]
    facts += [
        Fact(f"range of commands {_along(own)}", f"± {quantity(own.stroke, UNITS[own.kind == 'R'], 4)}")
        for own in found.freedoms
        if own.stroke is not None
    ]
    return Content(blocks, facts=facts, warnings=found.warnings, shown=(found,))


def _along(own: Freedom) -> str:
    """The direction in words: `about x`, or with its components where it is no axis."""
    word, direction = "about" if own.kind == "R" else "along", own.axis.direction
    k = int(np.abs(direction).argmax())
    if np.abs(np.delete(direction, k)).max() < ALIGNED:
        return f"{word} {'xyz'[k]}" if direction[k] > 0 else f"{word} -{'xyz'[k]}"
    return f"{word} ({', '.join(f'{x + 0.0:.4f}' for x in direction)})"


def _freedoms(found: Kinetostatics, evidence: Evidence) -> Table:
    columns = found.freedom_columns() | {"axis": [_along(own) for own in found.freedoms]}
    motions = [f"freedom-{k + 1}" for k in range(len(found.freedoms))]
    return Table.of(columns, evidence=evidence, left=2, motions=motions)


def _spectrum(found: Kinetostatics, evidence: Evidence) -> Table:
    own = found.spectrum
    caption = f"compliances on one scale, rotations counted at {quantity(own.length, 'm', 4)}"
    return Table.of({"": range(1, 7), "compliance [m/N]": own.compliance}, caption, evidence)


def _compliance(found: Kinetostatics, command: str) -> Folded:
    """Rows of translations and of rotations, each in its unit."""
    columns: dict[str, list[str]] = {"displacement": [*DOF_NAMES]}
    for j, dof in enumerate(DOF_NAMES):
        per = FORCE_UNITS[j > 2]
        units = [f"{UNITS[k > 2]}/{per if j < 3 else f'({per})'}" for k in range(6)]
        heading = f"{'F' if j < 3 else 'M'}{dof[1]} 1 {per.replace('*', ' ')}"
        columns[heading] = [quantity(float(x), unit, 4) for x, unit in zip(found.compliance[:, j], units, strict=True)]
    table = Table.of(columns, "displacement by unit forces and moments at the platform", Evidence(command))
    return Folded("6 x 6 compliance of the platform, actuators mounted and not driven", [table])
