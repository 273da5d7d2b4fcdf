"""Poses of a stroke that is described, or of all corners of the ranges of actuators, and designs at any pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from flexura.errors import OptionError
from flexura.expressions import Expression
from flexura.mechanism import DISPLACEMENTS, FORCES, Mechanism, Parameter, Prescribed, at
from flexura.structure import Design, Plan, Ports, actuator_names
from flexura.study.questions.grammar import COMMANDS
from flexura.study.questions.kinds import Held, Pose

MOST_RANGES = 6
"""Actuators with ranges of which all corners are looked at."""


class StrokeLine(NamedTuple):
    """Poses of a stroke: `poses`, as many as are described, and the `ends` between which each lies in proportion to its
    share of the way; of corners of commands none."""

    poses: tuple[Pose, ...]
    ends: tuple[Pose, Pose] | None

    @staticmethod
    def of(plan: Plan, over: str, parameters: Mapping[str, float] | None = None) -> StrokeLine:
        """Those of one design. Raises OptionError where nothing is described."""
        rest = plan.at_rest()
        design = Design.of(rest, parameters)
        return _corners(design) if over == COMMANDS else _stroke(design)

    def at(self, share: float) -> Pose:
        """The pose at a share of the way."""
        assert self.ends is not None
        pairs = zip(*self.ends, strict=True)
        return tuple(a._replace(value=(1 - share) * a.value + share * b.value) for a, b in pairs)

    @property
    def nearest(self) -> int:
        """Number of the pose that is nearest to the undeformed configuration."""
        sizes = np.abs([[own.value for own in pose] for pose in self.poses])
        return int(np.argmin((sizes / np.maximum(sizes.max(axis=0), 1e-300)).sum(axis=1)))


def _stroke(design: Design) -> StrokeLine:
    motion, values = design.plan.motion, design.values
    if motion.motion is None:
        raise OptionError("over stroke: none is described; describe `motion`, or ask at a pose")
    if motion.motion.follower:
        raise OptionError("over stroke: follower loads have no place at a pose; leave them out of `motion`")
    ends: list[tuple[str, Any, str, Any]] = []
    ends += [(name, value, "rad" if _axis(name) >= 3 else "m", "move") for name, value in motion.moved(values).items()]
    for node, wrench in motion.wrenches("loads", values).items():
        sizes = zip(FORCES, wrench.T, (*["N"] * 3, *["N*m"] * 3), strict=True)
        ends += [(f"{node}.{axis}", size, unit, "force") for axis, size, unit in sizes if size.any()]
    commands = motion.commands(values)
    ports = Ports(design).commands(list(commands)) if commands else []
    named = zip(ports, commands.values(), strict=True)
    ends += [(port.channel.name, value, port.channel.unit, "command") for port, value in named]
    first, last = (
        tuple(Held(name, float(np.broadcast_to(value, 2)[k]), unit, kind) for name, value, unit, kind in ends)
        for k in (0, 1)
    )
    shares = np.linspace(0.0, 1.0, motion.motion.steps) if first != last else np.ones(1)
    line = StrokeLine((), (first, last))
    return line._replace(poses=tuple(map(line.at, shares.tolist())))


def _axis(name: str) -> int:
    return DISPLACEMENTS.index(name.rpartition(".")[2])


def _corners(design: Design) -> StrokeLine:
    ports = Ports(design).inputs(actuator_names(design.plan)) if actuator_names(design.plan) else []
    ranged = [port for port in ports if port.base is None and np.isfinite(port.limits).all()]
    if not ranged:
        raise OptionError("over commands: no actuator has a range; describe its `limits`, or ask at a command")
    if len(ranged) > MOST_RANGES:
        raise OptionError(
            f"over commands: {len(ranged)} actuators have ranges, of which {2 ** len(ranged)} corners follow; at most"
            f" {MOST_RANGES} are looked at; describe the `motion` and ask over stroke"
        )
    corners = product(*([float(end) for end in port.limits] for port in ranged))
    poses = [
        tuple(Held(p.channel.name, v, p.channel.unit, "command") for p, v in zip(ranged, corner, strict=True))
        for corner in corners
    ]
    return StrokeLine(tuple(poses), None)


def posed_design(plan: Plan, parameters: Mapping[str, float], pose: Pose, rest: Design | None = None) -> Design:
    """A design at a pose: of one plan for all poses that prescribe the same, at `rest` where it is by itself."""
    names = tuple(own.name for own in pose)
    numbers = [_free(f"pose_{k}", plan) for k in range(len(names))]
    posed = plan.prepared.once(("posed", names), lambda: Plan(_posed(plan, names, numbers)))
    values = dict(zip(numbers, (own.value for own in pose), strict=True))
    every = {**parameters, **values}
    if rest is None:
        return Design.of(posed, every)
    return Design(posed, every, posed.values(every), replace(rest.geometry, topology=posed.topology))


def _posed(plan: Plan, names: tuple[str, ...], numbers: list[str]) -> Mechanism:
    """The mechanism at a pose whose values are parameters of these names."""
    parameters = {number: Parameter(value=0.0) for number in numbers}
    described = at(plan.mechanism, {name: float(k) for k, name in enumerate(names)}).at
    moved = {
        node: Prescribed(**{key: Expression.parse(numbers[int(getattr(own, key))]) for key in own.given})
        for node, own in described.items()
    }
    return plan.mechanism.replaced({"at": moved, "parameters": {**plan.mechanism.parameters, **parameters}})


def _free(name: str, plan: Plan) -> str:
    """A name that no parameter has."""
    while name in plan.mechanism.parameters:
        name += "_"
    return name
