"""Natural frequencies and mode shapes with their proofs."""

from __future__ import annotations

from dataclasses import replace

from flexura.analysis import Mode
from flexura.pages.report.document import Block, Bullets, Content, Evidence, Fact, Paragraph, Table
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
    if found.warnings:
        blocks.append(Bullets([str(w) for w in found.warnings], "warning"))
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
