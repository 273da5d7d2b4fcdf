"""What described loads and full commands do: displacements, readings, stresses with their margins, and buckling.

The commands within the limits of all actuators that stress each member most.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product
from math import inf, isfinite

import numpy as np

from flexura.analysis import MemberStress, PartStress, Statics, member_stresses, preload, statics
from flexura.linalg import ranked
from flexura.mechanism import DOF_NAMES, UNITS
from flexura.pages.report.document import Block, Content, Evidence, Fact, Paragraph, Table, warned
from flexura.pages.report.subject import Subject
from flexura.reduction import Certificate, proven_text
from flexura.tables import counted, number, quantity
from flexura.units import format_number

MOST_SEARCHED = 12
"""Actuators whose corners are all looked at, 4096 of them."""
BLOCK = 256
"""Corners at a time."""


@dataclass(frozen=True)
class Corner:
    """Commands by actuator, SI, and the members that they stress most among all corners, the nearest to yield first."""

    commands: dict[str, float]
    members: tuple[MemberStress | PartStress, ...]


def limited(subject: Subject) -> dict[str, tuple[float, float]]:
    """The limits of the actuators that have them, SI."""
    return {own.channel.name: own.limits for own in subject.inputs if all(map(isfinite, own.limits))}


def told(commands: dict[str, float], subject: Subject) -> list[str]:
    """Commands as `--actuator` takes them."""
    units = {own.channel.name: own.channel.unit for own in subject.inputs}
    return [f"{name}={format_number(float(f'{value:.12g}'))} {units[name]}" for name, value in commands.items()]


def worst_corners(subject: Subject) -> list[Corner]:
    """Every member under the corner that is worst for it, the worst corner first.

    Forces in members are linear in the commands and the von Mises stress is convex in the forces, so it is largest at a
    corner. With more than `MOST_SEARCHED` actuators only the corner of all upper limits is looked at.
    """
    limits = limited(subject)
    rest = statics(subject.plan, subject.parameters)
    gravity = rest.gravity if any(rest.gravity) else None
    units = [
        statics(subject.plan, subject.parameters, actuators={name: 1.0}).displacement_vector - rest.displacement_vector
        for name in limits
    ]
    searched = len(limits) <= MOST_SEARCHED
    corners = product(*limits.values()) if searched else iter([tuple(top for _, top in limits.values())])
    worst: dict[str, tuple[tuple[float, ...], MemberStress | PartStress]] = {}
    for block in _blocks(corners):
        moved = sum((np.outer(u, c) for u, c in zip(units, np.transpose(block), strict=True)), 0.0)
        found = member_stresses(rest.model, rest.displacement_vector[:, None] + moved, gravity=gravity)
        for own in found.members:
            if own.name not in worst or (own.von_mises or 0) > (worst[own.name][1].von_mises or 0):
                worst[own.name] = (block[own.state], own)
    by_corner: dict[tuple[float, ...], list[MemberStress | PartStress]] = {}
    for commands, own in sorted(worst.values(), key=lambda found: _margin(found[1])):
        if own.von_mises:
            by_corner.setdefault(commands, []).append(own)
    return [Corner(dict(zip(limits, own, strict=True)), tuple(members)) for own, members in by_corner.items()]


def _margin(own: MemberStress | PartStress) -> tuple[float, float]:
    """What orders members: the factor to yield, then the stress where that is not known."""
    return inf if own.factor_to_yield is None else own.factor_to_yield, -(own.von_mises or 0.0)


def _blocks(corners: Iterator[tuple[float, ...]]) -> Iterator[Sequence[tuple[float, ...]]]:
    while block := list(islice(corners, BLOCK)):
        yield block


MOST = 12
"""Members that are shown, as many as the command prints."""
MOST_CORNERS = 4
"""Corners of the limits that are shown with the members that they stress most."""
FACTORS = 6
"""Frequencies and buckling factors."""


def static_response(subject: Subject) -> Content:
    """Displacements and readings under the loads that are described. Raises FlexuraError."""
    loads = _loads(subject)
    if not (loads or _has_gravity(subject)):
        text = "No loads and no gravity are described. Loads for one question are given to the command:"
        asked = subject.commands("statics", ["--gravity", "0,0,-9.81 m/s^2"], "gravity=(0, 0, -9.81)")
        return Content.absent(text, asked)
    nodes = loads or ([subject.platform] if subject.platform else [])
    options = [word for node in nodes for word in ("--node", node)]
    found = statics(subject.plan, subject.parameters)
    evidence = Evidence(subject.commands("statics", options), [("note", note) for note in found.notes], essential=True)
    moved = np.array([found.displacement(node) for node in nodes]).reshape(-1, 6)
    columns = {f"{dof} [{UNITS[k > 2]}]": moved[:, k] for k, dof in enumerate(DOF_NAMES)}
    blocks: list[Block] = [Table.of({"node": nodes, **columns}, "displacements, linear", evidence)]
    if found.readings:
        blocks.append(Table.of(found.reading_columns(), evidence=Evidence(evidence.command)))
    blocks += warned(found.warnings)
    return Content(blocks, warnings=found.warnings, shown=(found,))


def stresses(subject: Subject) -> Content:
    """The largest stresses under what is described, each member with the commands that are worst for it. Raises
    FlexuraError."""
    limits = limited(subject)
    loaded = bool(_loads(subject)) or _has_gravity(subject)
    if not (limits or loaded or subject.plan.is_posed):
        text = (
            "No loads are described, and no actuator with a limit: how large stresses get is not known. The stroke and"
            " the freedoms tell where the first member yields."
        )
        return Content.absent(text)
    state = "the loads that are described" if loaded else "the pose" if subject.plan.is_posed else "commands alone"
    corners = worst_corners(subject)
    if not corners:
        return Content.absent(f"Nothing is stressed under {state}.")
    blocks: list[Block] = [Paragraph(text) for text in [_searched(subject, state)] if limits]
    left, shown = MOST, list[Statics]()
    for corner in corners[:MOST_CORNERS]:
        if left > 0:
            shown.append(statics(subject.plan, subject.parameters, actuators=corner.commands))
            blocks.append(_stressed(subject, corner, corner.members[:left], state, shown[-1].notes))
            left -= len(corner.members)
    every = [own for corner in corners for own in corner.members]
    count = len(every) - sum(len(own.rows) for own in blocks if isinstance(own, Table))
    blocks += [Paragraph(f"and {counted(count, 'member')} under other commands or with less", "soft")] * (count > 0)
    factors = [own.factor_to_yield for own in every if own.factor_to_yield is not None]
    facts = [Fact("least factor to yield", number(min(factors), 4))] if factors and isfinite(min(factors)) else []
    if not facts:
        blocks.append(Paragraph("No margin: the materials have no yield stress (`yield_stress`).", "warning"))
    warnings = tuple({str(own): own for found in shown for own in found.warnings}.values())
    blocks += warned(warnings)
    return Content(blocks, facts=facts, warnings=warnings)


def _searched(subject: Subject, state: str) -> str:
    """Which corners of the limits were looked at."""
    count = len(limited(subject))
    free = len(subject.inputs) - count
    rest = f" {free} actuators without limits are at zero." if free else ""
    if count > MOST_SEARCHED:
        return (
            f"{state}: {count} actuators are at their upper limits; other corners were not searched.{rest}".capitalize()
        )
    return (
        f"Each member is under the commands within the limits that stress it most, found among all {2**count} corners"
        f" of the limits, with {state}.{rest}"
    )


def _stressed(
    subject: Subject, corner: Corner, members: Sequence[MemberStress | PartStress], state: str, notes: Sequence[str]
) -> Table:
    """Members that one corner of the limits stresses most."""
    given = told(corner.commands, subject)
    command = subject.commands(
        "statics",
        [word for own in given for word in ("--actuator", own)],
        f"actuators={corner.commands!r}" if corner.commands else "",
    )
    columns = {
        "member": [m.name for m in members],
        "von Mises [Pa]": [m.von_mises for m in members],
        "factor to yield": ["" if m.factor_to_yield is None else number(m.factor_to_yield, 4) for m in members],
        "at": [m.at for m in members],
    }
    lines = [("state", state), ("stress", "von Mises, with notch factors"), *(("note", note) for note in notes)]
    units = {own.channel.name: own.channel.unit for own in subject.inputs}
    named = ", ".join(f"{name} at {quantity(value, units[name])}" for name, value in corner.commands.items())
    caption = f"most stressed with {named}" if given else f"the largest stresses under {state}"
    return replace(Table.of(columns, caption, Evidence(command, lines, essential=True)), numbers=(1, 2))


def buckling(subject: Subject) -> Content:
    """Frequencies about the state under the loads that are described, and the factor at which it buckles. Raises
    FlexuraError."""
    if not (_loads(subject) or _has_gravity(subject)):
        text = "No loads and no gravity are described: nothing presses on the mechanism. For given loads:"
        asked = subject.commands("buckling", ["--gravity", "0,0,-9.81 m/s^2"], "gravity=(0, 0, -9.81)", posed=False)
        return Content.absent(text, asked)
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
    told = ", ".join(number(f) for f in factors) or "none: no load of this direction buckles it"
    blocks.append(Table(["what", "value"], [["buckling factors on all loads", told]], (1,), evidence=Evidence(command)))
    forces = list(found.axial_force.items())
    order = ranked([max(abs(f) for f in own) for _, own in forces])[:10]
    columns = {"member": [forces[i][0] for i in order]}
    for k, heading in enumerate(("least axial force [N]", "largest [N]")):
        columns[heading] = [forces[i][1][k] for i in order]
    blocks.append(Table.of(columns, evidence=Evidence(command)))
    blocks += warned(found.warnings)
    facts = [Fact("buckles at", f"{number(factors[0])} times the loads")] if len(factors) else []
    return Content(blocks, facts=facts, warnings=found.warnings, shown=(found,))


def _frequency(own: Certificate, k: int) -> list[str]:
    hz, lower, upper = (float(values[k]) for values in (own.frequency_hz, own.lower_hz, own.upper_hz))
    interval = (lower if isfinite(lower) else None, upper if isfinite(upper) else None)
    return [number(hz), proven_text(hz, interval, bool(own.is_indexed[k]), upper == 0)]


def _loads(subject: Subject) -> list[str]:
    """Nodes with loads that are not zero."""
    wrenches = subject.plan.loads.wrenches(subject.plan.values(dict(subject.parameters)))
    return [node for node, wrench in wrenches.items() if np.any(wrench)]


def _has_gravity(subject: Subject) -> bool:
    return bool(np.any(subject.plan.loads.gravity(subject.plan.values(dict(subject.parameters)))))
