"""What is asked of one mechanism: names looked up in it, with what it has where they are not there."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from flexura.analysis import part_yield_stresses
from flexura.errors import ExpressionError, FlexuraError, OptionError
from flexura.expressions import FREQUENCY as HERTZ
from flexura.expressions import LENGTH, NUMBER
from flexura.mechanism import DOF_NAMES, is_pattern, matching, parameter_dimensions, suggestion
from flexura.structure import Channel, Design, InputPort, OutputPort, Plan, Ports, actuator_names, unit_of_response
from flexura.study.questions.grammar import (
    FREQUENCY,
    KINDS,
    SIGNS,
    STROKE,
    Argument,
    Asked,
    Kind,
    Place,
    Quantity,
    unit_of,
    unknown_name,
)
from flexura.units import format_quantity, is_unit, parse_quantity, split_quantity

AXES = ("x", "y", "z", "rx", "ry", "rz")
"""Axes of displacements as they are shown; those of DOFs are read as well."""

MOST_FREQUENCIES = 10_000

_NUMBERED = re.compile(r"f([1-9]\d{0,8})")
_SPELLING: dict[str, str] = dict(zip((*DOF_NAMES, *AXES), (*AXES, *AXES), strict=True))


class Freedom(NamedTuple):
    """A displacement that is asked of: its node, by name, and its component, 0 to 5."""

    node: str
    component: int

    @property
    def name(self) -> str:
        """E.g. `platform.x`."""
        return f"{self.node}.{AXES[self.component]}"

    @property
    def turns(self) -> bool:
        """Whether it is a rotation."""
        return self.component >= 3

    @property
    def channel(self) -> Channel:
        """What a sensor of it reads."""
        return Channel(self.name, "rotation" if self.turns else "displacement")

    def __str__(self) -> str:
        return self.name


class Members(NamedTuple):
    """Members that are asked of, as placed, by one name for all: a member, an instance or a pattern."""

    name: str
    members: tuple[str, ...]

    def __str__(self) -> str:
        return self.name


class Hertz(float):
    """A frequency that is asked at."""

    def __str__(self) -> str:
        return format_quantity(float(self), HERTZ)


class Port(NamedTuple):
    """An input or output that is asked of: its name as shown, and as `Ports` knows it."""

    name: str
    known: str

    def __str__(self) -> str:
        return self.name


def pose_text(pose: Sequence[tuple[str, float]]) -> str:
    """A pose as it is written."""
    turns = [_SPELLING[name.rpartition(".")[2]][0] == "r" for name, _ in pose]
    return ", ".join(
        f"{name} = {format_quantity(value, NUMBER if turn else LENGTH, angle=turn)}"
        for (name, value), turn in zip(pose, turns, strict=True)
    )


class Reader:
    """Reads what is asked of the mechanism of a plan. Raises OptionError for what it has not."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    @cached_property
    def ports(self) -> Ports:
        """What drives the default design, and what is read of it."""
        return Ports(Design.of(self.plan.at_rest()))

    def is_unit(self, name: str) -> bool:
        """Whether a name is a unit and nothing that may be asked."""
        is_asked = name in KINDS or _NUMBERED.fullmatch(name) or name in self.plan.mechanism.parameters
        return not is_asked and is_unit(name)

    def quantity(self, asked: Asked, places: Sequence[Place] = ()) -> Quantity:
        """What an asked name stands for, at the pose of `places` where it has none of its own."""
        name, arguments, mode = asked.name, asked.arguments, None
        if (numbered := _NUMBERED.fullmatch(name)) is not None:
            mode = self.mode(asked, int(numbered[1]))
        elif name not in KINDS and not arguments and name in self.plan.mechanism.parameters:
            name, arguments = "parameter", (name,)
        kind = KINDS[FREQUENCY] if mode else KINDS.get(name)
        if kind is None:
            raise OptionError(unknown_name(name, list(self.plan.mechanism.parameters)))
        pose = self.pose(kind, asked.at or places, bool(asked.at))
        read = (mode,) if mode else self.arguments(kind, arguments)
        shown = ", ".join(map(str, read))
        text = f"f{mode}" if mode else f"{kind.name}({shown})" if read else kind.name
        if kind.name == "parameter" and shown not in KINDS and not _NUMBERED.fullmatch(shown):
            text = shown
        at = f" at {pose_text(pose)}" if pose else ""
        quantity = Quantity(text + at, self.unit(kind, read), kind.name, read, pose)
        self.refuse_meaningless(quantity)
        return quantity

    def mode(self, asked: Asked, number: int) -> int:
        """The number of a mode."""
        most = min(self.plan.topology.n_dof, MOST_FREQUENCIES)
        if asked.arguments:
            raise OptionError(f"{asked.name} takes no arguments; f(NODE.DOF) is the mode in which that moves most")
        if number > most:
            raise OptionError(f"{asked.name}: there are frequencies from f1 to f{most}")
        return number

    def arguments(self, kind: Kind, texts: Sequence[str]) -> tuple[object, ...]:
        """What the arguments of a name stand for."""
        least, most = len(kind.arguments) - kind.optional, len(kind.arguments)
        if not least <= len(texts) <= most or not all(texts):
            is_parameter = not texts and kind.name in self.plan.mechanism.parameters
            hint = f"; the parameter is parameter({kind.name})" if is_parameter else ""
            raise OptionError(f"{kind.name} is written {kind.written}, not with ({', '.join(texts)}){hint}")
        pairs = zip(kind.arguments, texts, strict=False)
        read = tuple(self.argument(kind.name, argument, text) for argument, text in pairs)
        if kind.name == "frf_peak" and not float(read[2]) < float(read[3]):  # type: ignore[arg-type]
            raise OptionError(
                f"frf_peak: a band goes from a lower frequency to a higher one, not {texts[2]}, {texts[3]}"
            )
        return read

    def argument(self, name: str, kind: Argument, text: str) -> object:
        """What one argument stands for."""
        if kind == "dof":
            return self.freedom(text, name)
        if kind == "member":
            return self.members(name, text)
        if kind == "hertz":
            return self.hertz(name, text)
        if kind in ("actuator", "input", "output"):
            return self.port(name, kind, text)
        if kind == "disturbance":
            known = list(self.plan.mechanism.disturbances)
        else:
            known = self.plan.body_names if kind == "body" else list(self.plan.mechanism.parameters)
        if text not in known:
            many = "bodies" if kind == "body" else f"{kind}s"
            raise OptionError(f"{name}({SIGNS[kind]}): there is no {kind} {text!r}; {suggestion(text, known, many)}")
        return text

    def members(self, name: str, text: str) -> Members:
        """The members of a name: one, all of an instance, or all that match."""
        known = self.yield_stresses
        if is_pattern(text):
            chosen = {*matching(text, known), *matching(f"{text}.*", known)}
        else:
            chosen = {member for member in known if member == text or member.startswith(f"{text}.")}
        members = [member for member in known if member in chosen]
        if not members:
            paths = [member.split(".") for member in known]
            steps = dict.fromkeys(".".join(path[:k]) for path in paths for k in range(1, len(path) + 1))
            raise OptionError(
                f"{name}(MEMBER): there is no member or instance {text!r}; {suggestion(text, steps, 'members')}"
            )
        return Members(text, tuple(members))

    @cached_property
    def yield_stresses(self) -> dict[str, float]:
        """Yield stress, Pa, of all members and parts as placed, NaN where it is not known."""
        stresses, values = part_yield_stresses(self.plan), self.plan.values()
        for name, part in self.plan.parts.items():
            limits = part.table.yield_stress(values) if part.members else ()
            for path in self.plan.topology.copies[name].paths:
                stresses |= {".".join((*path, key)): limit for key, limit in zip(part.members, limits, strict=True)}
        return stresses

    def hertz(self, name: str, text: str) -> Hertz:
        """A frequency to ask at."""
        try:
            value, dimension = parse_quantity(text)
        except ExpressionError as error:
            raise OptionError(f"{name}(HZ): {error}") from None
        if not split_quantity(text)[1]:
            raise OptionError(f"{name}(HZ): the unit of {text!r} is missing; write {text} Hz")
        if dimension != HERTZ or "Hz" not in text or value <= 0:
            raise OptionError(f"{name}(HZ): a positive frequency in Hz or kHz is expected, e.g. 20 Hz, not {text!r}")
        return Hertz(value)

    def port(self, name: str, kind: Argument, text: str) -> Port:
        """An actuator or sensor, or a DOF."""
        where, colon, word = text.partition(":")
        axis = where.rpartition(".")[2]
        described = where in {*self.ports.actuators, *self.ports.sensors}
        shown, known = text, text
        if not described and axis in _SPELLING and not where.startswith("ground."):
            freedom = self.freedom(where, name)
            shown, known = freedom.name + colon + word, f"{freedom.node}.{DOF_NAMES[freedom.component]}{colon}{word}"
        try:
            ports: Sequence[InputPort | OutputPort] = (
                self.ports.outputs([known]) if kind == "output" else self.ports.inputs([known])
            )
        except FlexuraError as error:
            raise OptionError(f"{name}({SIGNS[kind]}): {error}") from None
        if len(ports) != 1:
            raise OptionError(f"{name}({SIGNS[kind]}): {text!r} is several; name one")
        if kind == "actuator" and isinstance(ports[0], InputPort) and ports[0].base is not None:
            hint = suggestion("", actuator_names(self.plan), "actuators")
            raise OptionError(f"{name}(ACTUATOR): {text} accelerates the base; {hint}")
        return Port(shown, known)

    def unit(self, kind: Kind, read: Sequence[Any]) -> str:
        """SI unit of what is asked."""
        match kind.name:
            case "stiffness":
                return "N*m/rad" if read[0].turns else "N/m"
            case "compliance":
                unit = "rad" if read[0].turns else "m"
                return f"{unit}/(N*m)" if read[-1].turns else f"{unit}/N"
            case "coupling":
                return unit_of_response(read[1].channel, self.ports.inputs([read[0].known])[0].channel)
            case "amplification":
                moment = self.ports.inputs([read[0].known])[0].channel.quantity == "moment"
                return unit_of_response(read[1].channel, Channel("", "rotation" if moment else "displacement"))
            case "force":
                return "N*m" if read[0].turns else "N"
            case "reach":
                return "rad" if read[0].turns else "m"
            case "rms":
                return self.ports.outputs([read[0].known])[0].channel.unit
            case "frf" | "frf_peak":
                out, into = self.ports.outputs([read[0].known])[0], self.ports.inputs([read[1].known])[0]
                return unit_of_response(out.channel, into.channel)
            case "parameter":
                dimension = parameter_dimensions(self.plan.mechanism.parameters)[read[0]]
                if dimension is None:
                    raise OptionError(f"{read[0]}: the dimension of this parameter is not known; give it a unit")
                return unit_of(dimension)
        return {FREQUENCY: "Hz", "mass": "kg", "stress": "Pa", "margin": "1", "buckling": "1"}[kind.name]

    def freedom(self, text: str, name: str = "at") -> Freedom:
        """The displacement of a name such as `platform.rz`, or `rz` where there is one body."""
        node, _, axis = text.rpartition(".")
        if axis not in _SPELLING:
            raise OptionError(f"{name}: {text!r} is no displacement: write NODE.DOF, a DOF of {', '.join(AXES)}")
        if not node:
            bodies = self.plan.moving_bodies
            if len(bodies) != 1:
                raise OptionError(f"{name}: {text!r} of which node? {suggestion('', bodies, 'bodies')}")
            node = bodies[0]
        topology = self.plan.topology
        try:
            number = int(topology.numbers([node])[0])
        except OptionError:
            raise OptionError(f"{name}: there is no node {node!r}; {self._nodes_like(node)}") from None
        if not topology.has_position[number]:
            raise OptionError(
                f"{name}: {node} holds amplitudes of a superelement, which are no displacements; {self._nodes_like('')}"
            )
        root, component = topology.root[number], AXES.index(_SPELLING[axis])
        alone = not topology.is_rigid[number] and topology.held[root, component]
        if alone or topology.held[root].all():
            raise OptionError(f"{name}: {text} cannot move: it is held by the ground")
        return Freedom(node, component)

    def _nodes_like(self, node: str) -> str:
        """Which bodies and nodes with a position can be meant."""
        topology = self.plan.topology
        named = zip(topology.node_names, topology.has_position, strict=True)
        known = [*self.plan.body_names, *(name for name, has_position in named if has_position and "[" not in name)]
        return suggestion(node, known, "nodes")

    def pose(self, kind: Kind, places: Sequence[Place], is_own: bool) -> tuple[tuple[str, float], ...]:
        """The displacements of the pose at which something is asked, m and rad."""
        if kind.poses == "needed" and not places:
            raise OptionError(f"{kind.name} is of a pose: {kind.written} at NODE.DOF = VALUE UNIT")
        if kind.poses == "same" and not is_own:
            return ()
        pose: dict[str, float] = {}
        for place in places:
            freedom = self.freedom(self.stroke() if place.name == STROKE else place.name)
            turns, dimension = freedom.turns, place.dimension
            if dimension != (NUMBER if turns else LENGTH) and (place.value or dimension is not None):
                expected = "an angle is expected, in deg or rad" if turns else "a length is expected, e.g. in mm"
                given = "has no unit" if dimension is None else f"is in {dimension.unit() or 'rad'}"
                raise OptionError(f"at {place.name}: {expected}; {place.value:g} {given}")
            if freedom.name in pose:
                raise OptionError(f"at {freedom.name}: a displacement is given twice in one pose")
            pose[freedom.name] = place.value
        if pose and kind.poses in ("same", "none"):
            why = "is the same at every pose" if kind.poses == "same" else "is not known at a pose"
            raise OptionError(f"{kind.name} {why}; leave `at` out")
        return tuple(pose.items())

    def stroke(self) -> str:
        """Name of the only displacement of the described motion."""
        moved = list(self.plan.motion.moved(self.plan.values()))
        if len(moved) != 1:
            what = f"there are {len(moved)}: {', '.join(moved)}" if moved else "none is described"
            raise OptionError(f"`at stroke` is along the one displacement of `motion`; {what}; write at NODE.DOF = ...")
        return moved[0]

    def refuse_meaningless(self, quantity: Quantity) -> None:
        """Raise OptionError for what is nothing without loads or yield stresses, where there are none, and for forces
        along what does not hold a pose."""
        text, kind = quantity.text, quantity.kind
        is_bare = not (quantity.pose or self.plan.is_loaded or self.plan.is_posed)
        if is_bare and kind in ("stress", "margin", "buckling"):
            raise OptionError(
                f"{text}: nothing loads this mechanism; ask it at a pose, {text} at NODE.DOF = 2 mm, or"
                " describe `loads` or `gravity`"
            )
        if kind in ("margin", "reach"):
            named = [end.members for end in quantity.arguments if isinstance(end, Members)]
            of = named[0] if named else tuple(self.yield_stresses)
            if np.isnan([self.yield_stresses[name] for name in of]).all():
                raise OptionError(f"{text}: no yield stress is known; give the material a `yield_stress`")
        if kind == "force" and str(quantity.arguments[0]) not in dict(quantity.pose):
            driven = ", ".join(name for name, _ in quantity.pose)
            raise OptionError(f"{text}: a pose is held along its own displacements, {driven}")
