"""How a platform is free and how actuators move it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.analysis import Freedom, Kinetostatics
from flexura.errors import SolverError
from flexura.mechanism import DOF_NAMES
from flexura.pages.report.document import Block, Bullets, Content, Evidence, Fact, Folded, Paragraph, Table
from flexura.pages.report.subject import Subject
from flexura.tables import stiffness

ALIGNED = 5e-5
"""Components below this are zero in the digits that are shown."""
ROUND_OFF = 1e-4
"""Drifts below this, mm or mrad, are round-off."""


def freedoms(subject: Subject) -> Content:
    """Freedoms with their screw axes, coupling, stiffness, workspace. Raises FlexuraError."""
    if subject.platform is None:
        text = "No rigid body is there to be a platform; `flexura kinetostatics FILE --platform NODE` takes a node."
        return Content([Paragraph(text, "soft")], "absent")
    if subject.plan.is_posed:
        text = f"Freedoms of {subject.platform} are of the undeformed mechanism alone; this report is about a pose."
        return Content([Paragraph(text, "soft")], "absent")
    try:
        found = subject.kinetostatics
    except SolverError:
        if not any(mode.is_rigid for mode in subject.modes.modes):
            raise
        text = f"Parts of the mechanism float: freedoms of {subject.platform} are counted where elastic parts hold it."
        return Content([Paragraph(text, "soft")], "absent")
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
        blocks.append(_coupling(found, command))
    blocks.append(_stiffness(found, command))
    blocks.append(
        _compliance(
            found, subject.commands("kinetostatics", [*named, "--json"], f"platform={found.platform!r}", posed=False)
        )
    )
    if not found.inputs:
        blocks.append(Paragraph("No actuators are described: coupling, amplification and workspace need them.", "soft"))
    blocks += [Bullets([str(w) for w in found.warnings], "warning")] * bool(found.warnings)
    facts = [Fact(f"freedoms of {found.platform}", found.kind)]
    facts += [Fact(f"reach {_along(own)}", _reach(own)) for own in found.freedoms if own.stroke is not None]
    return Content(blocks, facts=facts, warnings=found.warnings, shown=(found,))


def _along(own: Freedom) -> str:
    """The direction in words: `about x`, or with its components where it is no axis."""
    word, direction = "about" if own.kind == "R" else "along", own.axis.direction
    k = int(np.abs(direction).argmax())
    if np.abs(np.delete(direction, k)).max() < ALIGNED:
        return f"{word} {'xyz'[k]}" if direction[k] > 0 else f"{word} -{'xyz'[k]}"
    return f"{word} ({', '.join(f'{x + 0.0:.4f}' for x in direction)})"


def _reach(own: Freedom) -> str:
    return "" if own.stroke is None else f"±{1e3 * own.stroke:.4g} {'mm' if own.kind == 'T' else 'mrad'}"


def _freedoms(found: Kinetostatics, evidence: Evidence) -> Table:
    headings = ("freedom", "axis", "through mm", "pitch mm/rad", "owned", "reach", "axis drifts", "yields at")
    rows = []
    for own in found.freedoms:
        axis = _along(own)
        through, pitch = "", ""
        if own.kind == "R":
            through = f"({', '.join(f'{1e3 * x:.4g}' for x in np.round(own.axis.point, 9) + 0.0)})"
            pitch = f"{1e3 * own.axis.pitch:.3g}"
        share = "" if np.isnan(own.share) else f"{100 * own.share:.1f} %"
        drift = ""
        if own.shift is not None and own.tilt is not None:
            drift = f"{_clean(1e3 * own.shift):.3g} mm, {_clean(1e3 * own.tilt):.3g} mrad"
        limit = (
            "" if own.yield_stroke is None else f"{1e3 * own.yield_stroke:.4g} {'mm' if own.kind == 'T' else 'mrad'}"
        )
        limit += "" if own.yields_in_range else ", beyond linear theory"
        kind = "rotation" if own.kind == "R" else "translation"
        rows.append([kind, axis, through, pitch, share, _reach(own), drift, limit])
    motions = [f"freedom-{k + 1}" for k in range(len(rows))]
    return Table(headings, rows, range(2, 8), evidence=evidence, motions=motions)


def _clean(value: float) -> float:
    return 0.0 if abs(value) < ROUND_OFF else value


def _spectrum(found: Kinetostatics, evidence: Evidence) -> Table:
    own = found.spectrum
    rows = [[str(k + 1), f"{1e6 * c:.4g}"] for k, c in enumerate(own.compliance)]
    caption = f"compliances on one scale, rotations counted at {1e3 * own.length:.4g} mm"
    return Table(["compliance", "um/N"], rows, (1,), caption, evidence)


def _coupling(found: Kinetostatics, command: str) -> Table:
    headings = ["per unit command", *(f"{c.name} [{c.unit.replace('*', '·')}]" for c in found.inputs)]
    rows = [[_named(k), *(f"{x:.4g}" for x in found.coupling[k])] for k in range(6)]
    rows.append(["input stiffness N/m", *(f"{x:.4g}" for x in found.input_stiffness)])
    return Table(
        headings, rows, range(1, len(headings)), "motion of the platform per unit of each command", Evidence(command)
    )


def _named(k: int) -> str:
    return f"{DOF_NAMES[k]} {'m' if k < 3 else 'rad'}"


def _stiffness(found: Kinetostatics, command: str) -> Table:
    headings = ["coordinate", "stiffness", "actuators free", "actuators locked", "unit", "workspace"]
    rows = []
    for k, dof in enumerate(DOF_NAMES):
        free, locked = float(found.compliance_free[k, k]), float(found.compliance_locked[k, k])
        low, high = found.workspace[k]
        span = f"{low:.4g} to {high:.4g} {'m' if k < 3 else 'rad'}" if np.isfinite([low, high]).all() else "no limits"
        unit = "N/m" if k < 3 else "N·m/rad"
        own = stiffness(float(found.compliance[k, k]))
        rows.append([dof, own, stiffness(free), stiffness(locked, free), unit, span])
    if not found.inputs:
        headings, rows = ["coordinate", "stiffness", "unit"], [[row[0], row[1], row[4]] for row in rows]
    return Table(
        headings,
        rows,
        (1, 2, 3, 5) if found.inputs else (1,),
        "stiffness of the platform, one coordinate at a time",
        Evidence(command),
    )


def _compliance(found: Kinetostatics, command: str) -> Folded:
    matrix: NDArray[np.float64] = found.compliance
    rows = [[_named(k), *(f"{x:.4g}" for x in matrix[k])] for k in range(6)]
    headings = [
        "displacement",
        *(f"{'F' if k < 3 else 'M'}{dof[1]} 1 {'N' if k < 3 else 'N·m'}" for k, dof in enumerate(DOF_NAMES)),
    ]
    table = Table(
        headings, rows, range(1, 7), "displacement by unit forces and moments at the platform", Evidence(command)
    )
    return Folded("6 x 6 compliance of the platform, actuators mounted and not driven", [table])
