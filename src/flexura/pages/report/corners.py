"""The commands within the limits of all actuators that stress each member most."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, product
from math import inf, isfinite

import numpy as np

from flexura.analysis import MemberStress, member_stresses, statics
from flexura.pages.report.subject import Subject
from flexura.units import format_number

MOST_SEARCHED = 12
"""Actuators whose corners are all looked at, 4096 of them."""
BLOCK = 256
"""Corners at a time."""


@dataclass(frozen=True)
class Corner:
    """Commands by actuator, SI, and the members that they stress most among all corners, the nearest to yield first."""

    commands: dict[str, float]
    members: tuple[MemberStress, ...]


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
    worst: dict[str, tuple[tuple[float, ...], MemberStress]] = {}
    for block in _blocks(corners):
        moved = sum((np.outer(u, c) for u, c in zip(units, np.transpose(block), strict=True)), 0.0)
        found = member_stresses(rest.model, rest.displacement_vector[:, None] + moved, gravity=gravity)
        for own in found.members:
            if own.name not in worst or (own.von_mises or 0) > (worst[own.name][1].von_mises or 0):
                worst[own.name] = (block[own.state], own)
    by_corner: dict[tuple[float, ...], list[MemberStress]] = {}
    for commands, own in sorted(worst.values(), key=lambda found: _margin(found[1])):
        if own.von_mises:
            by_corner.setdefault(commands, []).append(own)
    return [Corner(dict(zip(limits, own, strict=True)), tuple(members)) for own, members in by_corner.items()]


def _margin(own: MemberStress) -> tuple[float, float]:
    """What orders members: the factor to yield, then the stress where that is not known."""
    return inf if own.factor_to_yield is None else own.factor_to_yield, -(own.von_mises or 0.0)


def _blocks(corners: Iterator[tuple[float, ...]]) -> Iterator[Sequence[tuple[float, ...]]]:
    while block := list(islice(corners, BLOCK)):
        yield block
