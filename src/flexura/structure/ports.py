"""Actuators and sensors where they are placed: vectors over the DOFs of the full-order model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from typing import Any, Literal

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.duals import Dual, plain, real
from flexura.errors import ModelError, OptionError, Problem
from flexura.mechanism import (
    DOF_NAMES,
    Actuator,
    BaseMotion,
    BaseRotation,
    ForceSensor,
    MomentActuator,
    PiezoStack,
    Sensor,
    StrainActuator,
    is_pattern,
    origin_of,
    suggestion,
    warmings,
)
from flexura.records import Record
from flexura.structure.channel import Action, Channel, wrenches_along
from flexura.structure.design import Design
from flexura.structure.plan import Plan
from flexura.structure.topology import Copies, Geometry

DERIVATIVE = {
    "displacement": 0,
    "rotation": 0,
    "velocity": 1,
    "angular_velocity": 1,
    "acceleration": 2,
    "angular_acceleration": 2,
}
"""How often displacements are differentiated for a quantity."""

GROUND = "ground"
"""Name under which inputs like `ground.tx` move everything that is held."""

STRETCHING = 1e-6
"""Force that layers exert along their member times its length, over the moment, up to which it only bends."""

_WORDS = ("displacement", "velocity", "acceleration")


@dataclass(frozen=True, repr=False)
class InputPort(Record):
    """An input: the load (n,) that one unit of it puts on the DOFs of the full-order model, or the motion of the base.

    `base` (6,) is a unit acceleration of the ground, of and about the global origin; loads follow from masses.
    `nodes` are the global nodes that it acts on, and `row` (n,) the motion that it works on, of a piezo stack its
    elongation; this has a `stiffness`, N/m, and `stroke` is its free expansion per unit of input, m. `limits` bound the
    input; infinite where nothing does.
    """

    _shown = ("channel",)

    channel: Channel
    load: Array
    row: Array
    base: Array | None = None
    stiffness: float | None = None
    stroke: float = 0.0
    nodes: tuple[int, ...] = ()
    limits: tuple[float, float] = (-np.inf, np.inf)
    warms: bool = False
    """Whether it is a state of temperature."""

    @property
    def strains(self) -> bool:
        """Whether it is the free strain of layers."""
        return self.stiffness is None and self.channel.quantity in ("voltage", "temperature")

    @property
    def gain(self) -> Any:
        """What the load is of the motion that it works on."""
        return 1.0 if self.stiffness is None else self.stiffness * self.stroke


@dataclass(frozen=True, repr=False)
class OutputPort(Record):
    """An output: row (n,) over the DOFs, differentiated `derivative` times.

    `absolute` (6,) is its reading in unit rigid motions of the base, of and about the global origin; `feed` what inputs
    add to it directly, by name.
    """

    _shown = ("channel",)

    channel: Channel
    row: Array
    derivative: int
    absolute: Array
    feed: dict[str, float] = field(default_factory=dict)

    def direct(self, driven: InputPort) -> Any:
        """What a unit of an input adds to it directly: to force sensors, and to absolute accelerations as the base."""
        fed: Any = self.feed.get(driven.channel.name, 0.0)
        return fed if driven.base is None or self.derivative != 2 else fed + self.absolute @ driven.base


@dataclass(frozen=True)
class _Described:
    """A described actuator or sensor as placed: its `kind`, the number among the copies of its prototype, its key."""

    kind: Literal["actuator", "sensor"]
    copies: Copies
    copy: int
    key: str

    @property
    def described(self) -> Any:
        """What the description says of it."""
        return getattr(self.copies.part.channels, f"{self.kind}s")[self.key]

    @property
    def nodes(self) -> list[int]:
        """The global nodes that it acts on or reads."""
        return [self.copies.offset[self.copy] + k for k in self.copies.part.channels.nodes[self.kind, self.key]]

    @property
    def instance(self) -> int:
        """Number of the instance that it belongs to."""
        return self.copies.number[self.copy]

    def number(self, quantity: str, values: Array) -> Any:
        """A quantity of it at parameter values; None where it has none."""
        return self.copies.part.channels.number(self.kind, self.key, quantity, values)

    @property
    def turns_along(self) -> bool:
        """Whether its direction turns with its first node: of what is between two nodes, and of accelerometers, which
        are mounted there."""
        return len(self.nodes) > 1 or self.described.type.endswith("acceleration")

    def refuse_still(self, row: Array) -> None:
        """Raise ModelError where nothing can move."""
        if row.any():
            return
        prototype = self.copies.part.name
        path = (f"{self.kind}s", self.key)
        path = path if not prototype else ("substructures", origin_of(prototype), *path)
        rule = "nothing can move here: the DOF is held"
        raise ModelError([Problem(path, "", rule, "name a node that is free in this direction")])


def _described(plan: Plan, kind: Literal["actuator", "sensor"]) -> dict[str, _Described]:
    """All described actuators or sensors as placed, by name."""
    return {
        ".".join((*path, key)): _Described(kind, placed, copy, key)
        for placed in plan.topology.copies.values()
        for copy, path in enumerate(placed.paths)
        for key in getattr(placed.part.channels, f"{kind}s")
    }


class Ports:
    """Everything that can drive a mechanism of one design, or be read from it, by name.

    Described actuators and sensors go by `NAME` or `INSTANCE.NAME`; beside them any DOF of a node is an input, a force
    or a moment, and an output, as in `platform.tz`, `platform.tz:velocity` or `platform.tz:acceleration`; `ground.tx`
    is the acceleration of everything that is held.
    """

    def __init__(self, design: Design) -> None:
        self.design = design
        self.plan: Plan = design.plan
        self.values: Array = design.values
        self.geometry: Geometry = design.geometry
        self._actuators = _described(self.plan, "actuator")
        self._sensors = _described(self.plan, "sensor")

    @cached_property
    def _names(self) -> list[str]:
        """Names of all global nodes."""
        return self.plan.topology.node_names

    @property
    def actuators(self) -> list[str]:
        """Names of the described actuators."""
        return list(self._actuators)

    @property
    def sensors(self) -> list[str]:
        """Names of the described sensors."""
        return list(self._sensors)

    def inputs(self, names: Sequence[str] | None = None) -> list[InputPort]:
        """Inputs by name, wildcards allowed; all described actuators when none are named.

        Raises OptionError for names that mean nothing, and ModelError for actuators that can move nothing.
        """
        return [
            self._actuator(name) if name in self._actuators else self._dof_input(name)
            for name in self._expanded(names, self._actuators, "input")
        ]

    def commands(self, names: Sequence[str]) -> list[InputPort]:
        """What may be commanded at a pose, as `inputs`; states of temperature too, which have no load of their own."""
        states = warmings(self.plan.mechanism.temperatures)
        ports = list[InputPort]()
        for name in names:
            if name in states and name not in self._actuators:
                nothing = np.zeros(self.plan.topology.n_dof)
                ports.append(InputPort(Channel(name, states[name].quantity), nothing, nothing, warms=True))
            else:
                ports += self.inputs([name])
        return ports

    def action(self, name: str) -> Action:
        """What an actuator, or a force or moment on a DOF, acts along, of one design or of a stack.

        Raises OptionError and ModelError as `inputs`, and OptionError for motions of the base.
        """
        if name not in self._actuators:
            node, dof = self._node_and_dof(name, "input", self._actuators)
            if node is None:
                raise OptionError(f"{name} accelerates the base, and acts along nothing")
            return Action([node], np.eye(6)[dof][None], 1.0)
        actuator = self._actuators[name]
        part: Actuator = actuator.described
        if isinstance(part, BaseMotion | BaseRotation):
            raise OptionError(f"{name} accelerates the base, and acts along nothing")
        if isinstance(part, StrainActuator):
            return Action(actuator.nodes, self._strain(actuator)[0], 1.0)
        turns = isinstance(part, MomentActuator)
        stiffness, gain = (
            actuator.number(quantity, self.values) if isinstance(part, PiezoStack) else None
            for quantity in ("stiffness", "gain")
        )
        force = (1.0 if stiffness is None else stiffness) * (1.0 if gain is None else gain)
        along = wrenches_along(self._direction(actuator, turns), turns, len(actuator.nodes))
        return Action(actuator.nodes, along, force)

    def refuse_stretching(self, port: InputPort) -> None:
        """Raise OptionError for a unit of an input that stretches a layered member as well as it bends it: what that
        does to its axial force is not known where it has moved."""
        if not port.strains:
            return
        actuator = self._actuators[port.channel.name]
        N, M, member = self._blocking(actuator)
        length = self.geometry.parts[actuator.copies.part.name].length[member]
        if abs(plain(N)) * plain(length) > STRETCHING * abs(plain(M)):
            raise OptionError(
                f"{port.channel.name} also stretches its member, which is known at rest alone: large motion and "
                "buckling take layers whose forces are in balance, as those of a bimorph"
            )

    def outputs(self, names: Sequence[str] | None = None) -> list[OutputPort]:
        """Outputs by name, wildcards allowed; all described sensors when none are named.

        Raises OptionError for names that mean nothing, and ModelError for sensors where nothing can move.
        """
        return [
            self._sensor(name) if name in self._sensors else self._dof_output(name)
            for name in self._expanded(names, self._sensors, "output")
        ]

    def _expanded(self, names: Sequence[str] | None, known: Mapping[str, _Described], what: str) -> list[str]:
        if names is None:
            return list(known)
        if isinstance(names, str):
            names = [names]
        expanded: list[str] = []
        for name in names:
            if not isinstance(name, str):
                raise OptionError(f"an {what} is named by text, not by {name!r}")
            matches = [k for k in known if fnmatchcase(k, name)] if is_pattern(name) else [name]
            if not matches:
                raise OptionError(f"no {what} matches {name!r}; known: {', '.join(known) or 'none'}")
            expanded += matches
        twice = next((n for n in expanded if expanded.count(n) > 1), None)
        if twice is not None:
            raise OptionError(f"the {what} {twice} is named twice")
        return expanded

    def _rows(self, numbers: Sequence[int]) -> Array:
        """Displacements (6k, n) of global nodes."""
        return self.design.dense_rows(np.array(numbers, dtype=np.intp))

    def _rigid(self, number: int) -> Array:
        """Displacement (6, 6) of a node in unit rigid motions of and about the global origin."""
        return rigid_arm(self.design.positions[number])

    def _along(self, described: _Described, turns: bool) -> tuple[Array, Array, dict[str, Any]]:
        """Row (n,) of the motion along or about a direction, of one node or of the second against the first, its
        reading (6,) in rigid motions of the base, and the place that a channel has there.

        Raises ModelError where nothing can move.
        """
        numbers = described.nodes
        if isinstance(described.described, StrainActuator):
            wrenches, d = self._strain(described)
        else:
            d = self._direction(described, turns)
            wrenches = wrenches_along(d, turns, len(numbers))
        rows = self._rows(numbers)
        row = real(sum(wrench @ rows[6 * k : 6 * k + 6] for k, wrench in enumerate(wrenches)))
        described.refuse_still(row)
        absolute = sum(wrench @ self._rigid(n) for wrench, n in zip(wrenches, numbers, strict=True))
        return row, real(absolute), self._place(numbers, d)

    def _blocking(self, described: _Described) -> tuple[Array, Array, int]:
        """Force and moment (...) that block a unit of what layers strain by, and the number of the member."""
        part = described.copies.part
        member = list(part.members).index(described.described.member)
        return *part.table.blocking(member, described.described.by, self.values), member

    def _strain(self, described: _Described) -> tuple[Array, Array]:
        """Forces and moments (..., 2, 6) on the ends of a member whose layers strain, per unit, and the direction
        (..., 3) about which the moment is, global axes (theory eq. J5)."""
        N, M, member = self._blocking(described)
        local = self.geometry.parts[described.copies.part.name]
        Q = self.geometry.Q[..., described.instance, :, :]
        handed = np.linalg.det(plain(Q)).round()[..., None]
        x, y = ((Q @ local.R[..., member, k, :, None])[..., 0] for k in (0, 1))
        arms = (Q[..., None, :, :] @ local.offsets[..., member, :, :, None])[..., 0]
        turn = np.eye(3) if self.design.posed is None else self.design.posed.rotations[described.nodes[0]]
        force, moment = ((turn @ v[..., None])[..., 0] for v in (N[..., None] * x, M[..., None] * handed * y))
        arms = (turn @ arms[..., None])[..., 0]
        ends = [
            np.concatenate([sign * force, sign * (moment + np.cross(arms[..., k, :], force))], axis=-1)
            for k, sign in enumerate((-1.0, 1.0))
        ]
        return np.stack(ends, axis=-2), (turn @ (handed * y)[..., None])[..., 0]

    def _direction(self, described: _Described, turns: bool) -> Array:
        """The unit direction (..., 3) of an actuator or a sensor, of one design or of a stack."""
        direction = described.number("direction", self.values)
        if direction is None:
            ends = self.design.positions[..., described.nodes, :]
            d = ends[..., 1, :] - ends[..., 0, :]
            if not (np.linalg.norm(plain(d), axis=-1) > 0).all():
                path = (f"{described.kind}s", described.key)
                raise ModelError([Problem(path, "", "its two nodes are at one place", "give a direction")])
        else:
            Q = self.geometry.Q[..., described.instance, :, :]
            d = (Q @ direction[..., None])[..., 0]
            if turns:
                d = d * np.linalg.det(plain(Q)).round()[..., None]
            if (posed := self.design.posed) is not None and described.turns_along:
                d = posed.rotations[described.nodes[0]] @ d
        return d / np.linalg.norm(d, axis=-1, keepdims=True)

    def _place(self, numbers: Sequence[int], direction: Array) -> dict[str, Any]:
        """Where a channel is that acts on one global node, or on the second of two against the first."""
        label = [self._names[n] for n in numbers]
        if len(numbers) == 2:
            return {"node": label[1], "against": label[0], "direction": _triple(direction)}
        position = self.design.positions[numbers[0]]
        return {"node": label[0], "direction": _triple(direction), "position": _triple(position)}

    def _actuator(self, name: str) -> InputPort:
        actuator = self._actuators[name]
        part: Actuator = actuator.described
        if isinstance(part, BaseMotion | BaseRotation):
            return self._base_input(name, part.type, self._base(actuator))
        row, _, at = self._along(actuator, isinstance(part, MomentActuator))
        value: dict[str, Any] = {
            k: v if isinstance(v, Dual) else float(v)
            for k in ("limit", "stiffness", "free_stroke", "blocked_force", "gain")
            if (v := actuator.number(k, self.values)) is not None
        }
        nodes = tuple(actuator.nodes)
        if not isinstance(part, PiezoStack):
            limit = value.get("limit", np.inf)
            quantity = "moment" if isinstance(part, MomentActuator) else "force"
            quantity = part.by if isinstance(part, StrainActuator) else quantity
            port = InputPort(Channel(name, quantity, **at), row, row, nodes=nodes, limits=(-limit, limit))
            if self.design.posed is not None:
                self.refuse_stretching(port)
            return port
        k = value["stiffness"]
        top = value.get("free_stroke", value.get("blocked_force", np.inf) / k)
        gain = value.get("gain")
        stroke = 1.0 if gain is None else gain
        quantity = "expansion" if gain is None else "voltage"
        channel = Channel(name, quantity, **at)
        return InputPort(channel, k * stroke * row, row, None, k, stroke, nodes, (0.0, top / stroke))

    def _base_input(self, name: str, kind: str, base: Array) -> InputPort:
        """An acceleration of the base: of no node, along or about the direction of it."""
        nothing, along = np.zeros(self.plan.topology.n_dof), base[3:] if base[3:].any() else base[:3]
        return InputPort(Channel(name, _BASE[kind], direction=_triple(along)), nothing, nothing, base)

    def _base(self, actuator: _Described) -> Array:
        """Unit acceleration (6,) of the base, of and about the global origin."""
        direction = actuator.number("direction", self.values)
        Q, t = self.geometry.Q[actuator.instance], self.geometry.t[actuator.instance]
        d = Q @ direction / np.linalg.norm(direction)
        if isinstance(actuator.described, BaseMotion):
            return np.concatenate([d, np.zeros(3)])
        point = actuator.number("point", self.values)
        d = d * round(float(np.linalg.det(plain(Q))))
        return np.concatenate([np.cross(Q @ point + t, d), d])

    def _sensor(self, name: str) -> OutputPort:
        part: Sensor = self._sensors[name].described
        if isinstance(part, ForceSensor):
            return self._force_sensor(name, part)
        turns = part.type.startswith(("rotation", "angular"))
        row, absolute, at = self._along(self._sensors[name], turns)
        return OutputPort(Channel(name, part.type, **at), row, DERIVATIVE[part.type], absolute)

    def _force_sensor(self, name: str, sensor: ForceSensor) -> OutputPort:
        source = self._actuator(".".join((*name.split(".")[:-1], sensor.actuator)))
        channel = replace(source.channel, name=name, quantity="force")
        if source.stiffness is None:
            return OutputPort(channel, 0 * source.row, 0, np.zeros(6), {source.channel.name: 1.0})
        feed = {source.channel.name: source.stiffness * source.stroke}
        return OutputPort(channel, -source.stiffness * source.row, 0, np.zeros(6), feed)

    def _dof_input(self, name: str) -> InputPort:
        node, dof = self._node_and_dof(name, "input", self._actuators)
        turns = dof >= 3
        if node is None:
            return self._base_input(name, "base_rotation" if turns else "base", np.eye(6)[dof])
        row, at = self._dof_row(name, node, dof)
        return InputPort(Channel(name, "moment" if turns else "force", **at), row, row, nodes=(node,))

    def _dof_output(self, name: str) -> OutputPort:
        where, _, word = name.partition(":")
        if word and word not in _WORDS:
            raise OptionError(f"{name}: after the colon stands {', '.join(_WORDS)}, not {word!r}")
        node, dof = self._node_and_dof(where, "output", self._sensors)
        if node is None:
            raise OptionError(f"{name} is an input; name a node whose motion is read")
        row, at = self._dof_row(name, node, dof)
        derivative = _WORDS.index(word) if word else 0
        quantity = (_TURNS if dof >= 3 else _WORDS)[derivative]
        return OutputPort(Channel(name, quantity, **at), row, derivative, self._rigid(node)[dof])

    def _dof_row(self, name: str, node: int, dof: int) -> tuple[Array, dict[str, Any]]:
        """Row (n,) of a DOF of a node, and the place of its channel. Raises OptionError where it is held."""
        row = self._rows([node])[dof]
        if not row.any():
            raise OptionError(f"{name} is held: it can be neither driven nor read")
        return row, self._place([node], np.eye(3)[dof % 3])

    def _node_and_dof(self, name: str, what: str, known: Mapping[str, _Described]) -> tuple[int | None, int]:
        node, _, dof = name.rpartition(".")
        if dof in DOF_NAMES and node:
            try:
                return int(self.plan.topology.numbers([node])[0]), DOF_NAMES.index(dof)
            except OptionError:
                if node == GROUND:
                    return None, DOF_NAMES.index(dof)
        hint = suggestion(name, known, f"described {what}s") if known else ""
        rule = f"there is no {what} {name!r}: it is a described {_PARTS[what]}, or a DOF such as NODE.tx"
        if name in warmings(self.plan.mechanism.temperatures):
            rule = f"{name} is a state of temperature, which is no {what}"
            hint = "it is on at a pose (`at`), over a stroke and in `heat`"
        raise OptionError(f"{rule}; {hint}" if hint else rule)


def _triple(v: Array) -> tuple[float, float, float]:
    x, y, z = (float(entry) + 0.0 for entry in plain(v))
    return x, y, z


def actuator_names(plan: Plan) -> list[str]:
    """Names of all described actuators as placed."""
    return list(_described(plan, "actuator"))


def sensor_names(plan: Plan) -> list[str]:
    """Names of all described sensors as placed."""
    return list(_described(plan, "sensor"))


def default_dofs(plan: Plan, nodes: Sequence[str]) -> list[str]:
    """Names of the free DOFs of nodes."""
    topology = plan.topology
    numbers: Index = topology.numbers(nodes)
    return [
        f"{node}.{dof}"
        for node, root in zip(nodes, topology.root[numbers], strict=True)
        for dof, held in zip(DOF_NAMES, topology.held[root], strict=True)
        if not held
    ]


_BASE = {"base": "acceleration", "base_rotation": "angular_acceleration"}
_TURNS = ("rotation", "angular_velocity", "angular_acceleration")
_PARTS = {"input": "actuator", "output": "sensor"}
