"""What described loads and full commands do: displacements, readings, stresses with their margins, and buckling."""

from __future__ import annotations

from math import isfinite

import numpy as np

from flexura.analysis import Statics, preload, statics
from flexura.linalg import ranked
from flexura.mechanism import DOF_NAMES
from flexura.pages.report.document import Block, Bullets, Content, Evidence, Fact, Paragraph, Table
from flexura.pages.report.subject import Subject
from flexura.reduction import Certificate, proven_text
from flexura.units import format_number

MOST = 12
"""Members that are shown, as many as the command prints."""
FACTORS = 6
"""Frequencies and buckling factors."""


def static_response(subject: Subject) -> Content:
    """Displacements and readings under the loads that are described. Raises FlexuraError."""
    loads = _loads(subject)
    if not (loads or _has_gravity(subject)):
        text = "No loads and no gravity are described. Loads for one question are given to the command:"
        asked = subject.commands("statics", ["--gravity", "0,0,-9.81 m/s^2"], "gravity=(0, 0, -9.81)")
        return Content([Paragraph(text, "soft"), Evidence(asked, summary="command")], "absent")
    nodes = loads or ([subject.platform] if subject.platform else [])
    options = [word for node in nodes for word in ("--node", node)]
    found = statics(subject.plan, subject.parameters)
    evidence = Evidence(subject.commands("statics", options), [("note", note) for note in found.notes], essential=True)
    rows = [[node, *(f"{x:.5g}" for x in found.displacement(node))] for node in nodes]
    headings = ["node", *(f"{dof} {'m' if k < 3 else 'rad'}" for k, dof in enumerate(DOF_NAMES))]
    blocks: list[Block] = [Table(headings, rows, range(1, 7), "displacements, linear", evidence)]
    if found.readings:
        read = [[name, f"{value:.6g}"] for name, value in found.readings.items()]
        blocks.append(Table(["sensor", "reading, SI"], read, (1,), evidence=Evidence(evidence.command)))
    blocks += _warned(found)
    return Content(blocks, warnings=found.warnings, shown=(found,))


def stresses(subject: Subject) -> Content:
    """The largest stresses under what is described and with every actuator at its limit. Raises FlexuraError."""
    commands = {own.channel.name: own.limits[1] for own in subject.inputs if isfinite(own.limits[1])}
    units = {own.channel.name: own.channel.unit for own in subject.inputs}
    loaded = bool(_loads(subject)) or _has_gravity(subject)
    if not (commands or loaded or subject.plan.is_posed):
        text = (
            "No loads are described, and no actuator with a limit: nothing says how large stresses get. The stroke and"
            " the freedoms tell where the first member yields."
        )
        return Content([Paragraph(text, "soft")], "absent")
    options = [
        w for name, top in commands.items() for w in ("--actuator", f"{name}={format_number(top)} {units[name]}")
    ]
    command = subject.commands("statics", options, f"actuators={commands!r}" if commands else "")
    found = statics(subject.plan, subject.parameters, actuators=commands)
    own = found.stresses()
    worst = [m for m in own.members if m.von_mises]
    at = [
        part
        for part, there in (("the loads that are described", loaded), ("every actuator at its upper limit", commands))
        if there
    ]
    state = " and ".join(at) or "the pose"
    if not worst:
        return Content([Paragraph(f"Nothing is stressed under {state}.", "soft")], "absent")
    rows = []
    for m in worst[:MOST]:
        factor = "" if m.factor_to_yield is None else f"{m.factor_to_yield:.4g}"
        rows.append([m.name, f"{1e-6 * (m.von_mises or 0):.5g}", factor, f"{m.position:.2f} of its length"])
    lines = [("state", state), ("stress", "von Mises, with notch factors"), *(("note", note) for note in found.notes)]
    table = Table(
        ["member", "von Mises MPa", "factor to yield", "at"],
        rows,
        (1, 2),
        f"the largest stresses under {state}",
        Evidence(command, lines, essential=True),
    )
    blocks: list[Block] = [table]
    if len(worst) > MOST:
        blocks.append(Paragraph(f"and {len(worst) - MOST} members with less", "soft"))
    factor = own.factor_to_yield
    facts = [Fact("least factor to yield", f"{factor:.4g}, {state}")] if factor is not None and isfinite(factor) else []
    if not facts:
        blocks.append(Paragraph("No margin: the materials have no yield stress (`yield_stress`).", "warning"))
    return Content([*blocks, *_warned(found)], facts=facts, warnings=found.warnings)


def buckling(subject: Subject) -> Content:
    """Frequencies about the state under the loads that are described, and the factor at which it buckles. Raises
    FlexuraError."""
    if not (_loads(subject) or _has_gravity(subject)):
        text = "No loads and no gravity are described: nothing presses on the mechanism. For given loads:"
        asked = subject.commands("buckling", ["--gravity", "0,0,-9.81 m/s^2"], "gravity=(0, 0, -9.81)", posed=False)
        return Content([Paragraph(text, "soft"), Evidence(asked, summary="command")], "absent")
    found = preload(subject.plan, dict(subject.parameters))
    command = subject.commands("buckling", posed=False)
    states: list[Certificate] = [found.natural_frequencies(FACTORS, 0.0)]
    if not found.buckled:
        states.insert(0, found.natural_frequencies(FACTORS))
    rows = [
        [str(k + 1), *(text for own in states for text in _frequency(own, k))]
        for k in range(min(len(own.frequency_hz) for own in states))
    ]
    headings = ["mode", *("Hz", "proven", "unloaded Hz", "proven")[-2 * len(states) :]]
    numbers = range(1, len(headings), 2)
    blocks: list[Block] = [Table(headings, rows, numbers, evidence=Evidence(command, essential=True))]
    factors = found.buckling_factors(FACTORS)
    told = ", ".join(f"{f:.5g}" for f in factors) or "none: no load of this direction buckles it"
    blocks.append(Table(["what", "value"], [["buckling factors on all loads", told]], (1,), evidence=Evidence(command)))
    forces = list(found.axial_force.items())
    order = ranked([max(abs(f) for f in own) for _, own in forces])[:10]
    rows = [[forces[i][0], *(f"{f:.4g}" for f in forces[i][1])] for i in order]
    blocks.append(Table(["member", "least axial force N", "largest N"], rows, (1, 2), evidence=Evidence(command)))
    blocks += [Bullets([str(w) for w in found.warnings], "warning")] * bool(found.warnings)
    facts = [Fact("buckles at", f"{factors[0]:.5g} times the loads")] if len(factors) else []
    return Content(blocks, facts=facts, warnings=found.warnings)


def _frequency(own: Certificate, k: int) -> list[str]:
    hz, lower, upper = (float(values[k]) for values in (own.frequency_hz, own.lower_hz, own.upper_hz))
    interval = (lower if isfinite(lower) else None, upper if isfinite(upper) else None)
    return [f"{hz:.5g}", proven_text(hz, interval, bool(own.is_indexed[k]), upper == 0)]


def _warned(found: Statics) -> list[Block]:
    return [Bullets([str(w) for w in found.warnings], "warning")] if found.warnings else []


def _loads(subject: Subject) -> list[str]:
    """Nodes with loads that are not zero."""
    wrenches = subject.plan.loads.wrenches(subject.plan.values(dict(subject.parameters)))
    return [node for node, wrench in wrenches.items() if np.any(wrench)]


def _has_gravity(subject: Subject) -> bool:
    return bool(np.any(subject.plan.loads.gravity(subject.plan.values(dict(subject.parameters)))))
