"""What is asked of one mechanism: names looked up in it, with what it has where they are not there."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from flexura.analysis import part_yield_stresses
from flexura.errors import ExpressionError, FlexuraError, OptionError
from flexura.expressions import FREQUENCY as HERTZ
from flexura.mechanism import DOF_NAMES, FORCES, UNIFORM, is_pattern, matching, parameter_dimensions, suggestion
from flexura.structure import Channel, Design, InputPort, OutputPort, Plan, Ports, actuator_names, unit_of_response
from flexura.study.questions.grammar import NOWHERE, STROKE, Asked, Place, Where
from flexura.study.questions.kinds import (
    FREQUENCY,
    KINDS,
    SIGNS,
    WORST,
    Argument,
    Held,
    Kind,
    Pose,
    Quantity,
    Worse,
    Worst,
    pose_text,
    unit_of,
    unknown_name,
)
from flexura.study.questions.strokes import StrokeLine
from flexura.units import format_quantity, is_unit, parse_quantity, parse_unit, split_quantity

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

    def quantity(self, asked: Asked, elsewhere: Where = NOWHERE) -> Quantity:
        """What an asked name stands for, `elsewhere` where it does not say itself where it is asked; at the last pose
        of a stroke over which all of it is asked."""
        over = asked.where.over
        if not over:
            return self._quantity(asked, asked.where if asked.where.is_given else elsewhere)
        one = self._quantity(replace(asked, where=NOWHERE), asked.where)
        return self.worst(one.bare, [one], itemgetter(one.text), KINDS[one.kind].worse, over, one.unit)

    def worst(
        self,
        text: str,
        quantities: Sequence[Quantity],
        evaluate: Callable[[Mapping[str, Any]], Any],
        worse: Worse,
        over: str,
        unit: str,
    ) -> Quantity:
        """The worst of what follows from quantities, over all poses of the stroke or of all commands."""
        of = Worst(tuple(quantities), worse, over, evaluate)
        return Quantity(f"{text.strip()} over {over}", unit, WORST, (of,))

    def _quantity(self, asked: Asked, where: Where) -> Quantity:
        """What an asked name stands for at one pose."""
        name, arguments, mode = asked.name, asked.arguments, None
        if (numbered := _NUMBERED.fullmatch(name)) is not None:
            mode = self.mode(asked, int(numbered[1]))
        elif name not in KINDS and not arguments and name in self.plan.mechanism.parameters:
            name, arguments = "parameter", (name,)
        kind = KINDS[FREQUENCY] if mode else KINDS.get(name)
        if kind is None:
            raise OptionError(unknown_name(name, list(self.plan.mechanism.parameters)))
        if where.source:
            arguments = self._under(kind, arguments, where.source, asked.where.is_given)
        pose = self.pose(kind, where, asked.where.is_given)
        read = (mode,) if mode else self.arguments(kind, arguments)
        shown = ", ".join(map(str, read))
        text = f"f{mode}" if mode else f"{kind.name}({shown})" if read else kind.name
        if kind.name == "parameter" and shown not in KINDS and not _NUMBERED.fullmatch(shown):
            text = shown
        at = f" {pose_text(pose)}" if pose else ""
        quantity = Quantity(text + at, self.unit(kind, read), kind.name, read, pose)
        self.refuse_meaningless(quantity)
        return quantity

    def _under(self, kind: Kind, arguments: tuple[str, ...], source: str, is_own: bool) -> tuple[str, ...]:
        """Arguments with the disturbance under which something is asked, the last of those that may have one."""
        if "disturbance" in kind.arguments:
            return (*arguments[: len(kind.arguments) - 1], source)
        if kind.poses == "same" and not is_own:
            return arguments
        known = suggestion(source, self.plan.mechanism.disturbances, "disturbances")
        raise OptionError(f"{kind.name} under {source}: of a disturbance there is rms(OUTPUT) alone; {known}")

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
        elif kind == "temperature":
            known = self.plan.temperatures.names
        else:
            known = self.plan.body_names if kind == "body" else list(self.plan.mechanism.parameters)
        if text not in known:
            many = {"body": "bodies", "temperature": "states of temperature"}.get(kind, f"{kind}s")
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
            case "reach" | "shift" | "parasitic" | "drift":
                unit = "rad" if read[0].turns else "m"
                return f"{unit}/K" if kind.name == "drift" and read[1:] in ((), (UNIFORM,)) else unit
            case "centre_shift":
                if not read[0].turns:
                    raise OptionError(f"centre_shift({read[0]}): of a rotation, e.g. {read[0].node}.rz")
                return "m"
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

    def pose(self, kind: Kind, where: Where, is_own: bool) -> Pose:
        """The pose at which something is asked."""
        if kind.poses == "needed" and not (where.places or where.over):
            raise OptionError(f"{kind.name} is of a pose: {kind.written} at NODE.DOF = VALUE UNIT, or over stroke")
        if kind.poses == "same" and not is_own:
            return ()
        if (where.places and kind.poses in ("same", "none")) or (where.over and kind.poses == "none"):
            why = "is the same at every pose" if kind.poses == "same" else "is not known at a pose"
            word = "over" if where.over else "under" if where.places[0].pushes else "at"
            raise OptionError(f"{kind.name} {why}; leave `{word}` out")
        if where.over:
            return StrokeLine.of(self.plan, where.over).poses[-1] if kind.poses != "same" else ()
        held = [own for place in where.places for own in self._held(place)]
        names = [own.name for own in held]
        twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
        if twice is not None:
            raise OptionError(f"at {twice}: it is given twice in one pose")
        return tuple(held)

    def _held(self, place: Place) -> list[Held]:
        """What is prescribed by one place of a pose."""
        name = self.stroke() if place.name == STROKE and not place.pushes else place.name
        driven = [] if place.pushes else list(self.plan.layout.commanded(name))
        if driven:
            ports = self.ports.commands(driven)
            moving = next((port for port in ports if port.base is not None), None)
            if moving is not None:
                raise OptionError(f"at {name}: {moving.channel.name} accelerates the base, which is at rest at a pose")
            found = [Held(port.channel.name, place.value, port.channel.unit, "command") for port in ports]
        else:
            freedom = self.freedom(name, "along" if place.pushes else "at")
            if place.pushes:
                axis, unit = FORCES[freedom.component], "N*m" if freedom.turns else "N"
                found = [Held(f"{freedom.node}.{axis}", place.value, unit, "force")]
            else:
                found = [Held(freedom.name, place.value, "rad" if freedom.turns else "m")]
        expected, dimension = parse_unit(found[0].unit)[1], place.dimension
        is_plain = dimension is None and (not place.value or found[0].unit == "1")
        if dimension != expected and not is_plain:
            kind = {"m": "a length is expected, e.g. in mm", "rad": "an angle is expected, in deg or rad"}
            given = "has no unit" if dimension is None else f"is in {dimension.unit() or 'rad'}"
            hint = kind.get(found[0].unit, f"it is in {found[0].unit}")
            raise OptionError(f"{'along' if place.pushes else 'at'} {place.name}: {hint}; {place.value:g} {given}")
        return found

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
        if is_bare and kind in ("stress", "margin", "buckling", "shift"):
            raise OptionError(
                f"{text}: nothing loads this mechanism; ask it at a pose, {text} at NODE.DOF = 2 mm, or"
                " describe `loads` or `gravity`"
            )
        if kind in ("margin", "reach"):
            named = [end.members for end in quantity.arguments if isinstance(end, Members)]
            of = named[0] if named else tuple(self.yield_stresses)
            if np.isnan([self.yield_stresses[name] for name in of]).all():
                raise OptionError(f"{text}: no yield stress is known; give the material a `yield_stress`")
        held = [own.name for own in quantity.pose if own.kind == "move"]
        if kind == "force" and str(quantity.arguments[0]) not in held:
            raise OptionError(f"{text}: a pose is held along its own displacements, {', '.join(held) or 'it has none'}")
