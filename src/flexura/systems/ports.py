"""Actuators and sensors where they are placed: vectors over the DOFs of the full-order model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from typing import Any

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
    is_pattern,
    origin_of,
    suggestion,
)
from flexura.records import Record
from flexura.structure import Design, Geometry, Plan
from flexura.systems.channel import Action, Channel, signs_of

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
        self._actuators = dict(self._described("actuator"))
        self._sensors = dict(self._described("sensor"))

    def _described(self, kind: str) -> Iterator[tuple[str, tuple[str, int, str]]]:
        for name, placed in self.plan.topology.copies.items():
            entries = getattr(placed.part.channels, f"{kind}s")
            for copy, path in enumerate(placed.paths):
                for key in entries:
                    yield ".".join((*path, key)), (name, copy, key)

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
        ports = []
        for name in self._expanded(names, self._actuators, "input"):
            ports.append(self._actuator(name) if name in self._actuators else self._dof_input(name))
        return ports

    def action(self, name: str) -> Action:
        """What an actuator, or a force or moment on a DOF, acts along, of one design or of a stack.

        Raises OptionError and ModelError as `inputs`, and OptionError for motions of the base.
        """
        if name not in self._actuators:
            node, dof = self._node_and_dof(name, "input", self._actuators)
            if node is None:
                raise OptionError(f"{name} accelerates the base, and acts along nothing")
            return Action([node], np.eye(3)[dof % 3], dof >= 3, 1.0)
        prototype, _, key = entry = self._actuators[name]
        channels = self.plan.topology.copies[prototype].part.channels
        part: Actuator = channels.actuators[key]
        if isinstance(part, BaseMotion | BaseRotation):
            raise OptionError(f"{name} accelerates the base, and acts along nothing")
        turns = isinstance(part, MomentActuator)
        stiffness, gain = (
            channels.number("actuator", key, quantity, self.values) if isinstance(part, PiezoStack) else None
            for quantity in ("stiffness", "gain")
        )
        force = (1.0 if stiffness is None else stiffness) * (1.0 if gain is None else gain)
        return Action(*self._directed(entry, "actuator", turns), turns, force)

    def outputs(self, names: Sequence[str] | None = None) -> list[OutputPort]:
        """Outputs by name, wildcards allowed; all described sensors when none are named.

        Raises OptionError for names that mean nothing, and ModelError for sensors where nothing can move.
        """
        ports = []
        for name in self._expanded(names, self._sensors, "output"):
            ports.append(self._sensor(name) if name in self._sensors else self._dof_output(name))
        return ports

    def _expanded(self, names: Sequence[str] | None, known: dict[str, tuple[str, int, str]], what: str) -> list[str]:
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
        x = self.design.positions[number]
        return rigid_arm(x)

    def _along(self, entry: tuple[str, int, str], kind: str, turns: bool) -> tuple[Array, Array, dict[str, Any]]:
        """Row (n,) of the motion along or about a direction, of one node or of the second against the first, its
        reading (6,) in rigid motions of the base, and the place that a channel has there."""
        numbers, d = self._directed(entry, kind, turns)
        at = slice(3, 6) if turns else slice(0, 3)
        rows, signs = self._rows(numbers), signs_of(numbers)
        row = sum(s * (d @ rows[6 * k : 6 * k + 6][at]) for k, s in enumerate(signs))
        absolute = sum(s * (d @ self._rigid(n)[at]) for s, n in zip(signs, numbers, strict=True))
        return real(row), real(absolute), self._place(numbers, d)

    def _directed(self, entry: tuple[str, int, str], kind: str, turns: bool) -> tuple[list[int], Array]:
        """The global nodes of an actuator or a sensor and its direction (..., 3), of one design or of a stack."""
        name, copy, key = entry
        placed = self.plan.topology.copies[name]
        channels = placed.part.channels
        numbers = [placed.offset[copy] + k for k in channels.nodes[kind, key]]
        direction = channels.number(kind, key, "direction", self.values)
        if direction is None:
            ends = self.design.positions[..., numbers, :]
            d = ends[..., 1, :] - ends[..., 0, :]
            if not (np.linalg.norm(plain(d), axis=-1) > 0).all():
                raise ModelError([Problem((f"{kind}s", key), "", "its two nodes are at one place", "give a direction")])
        else:
            Q = self.geometry.Q[..., placed.number[copy], :, :]
            d = (Q @ direction[..., None])[..., 0]
            if turns:
                d = d * np.linalg.det(plain(Q)).round()[..., None]
            if (posed := self.design.posed) is not None and self._turns_along(channels, kind, key):
                d = posed.rotations[numbers[0]] @ d
        return numbers, d / np.linalg.norm(d, axis=-1, keepdims=True)

    @staticmethod
    def _turns_along(channels: Any, kind: str, key: str) -> bool:
        """Whether the direction of a channel turns with its first node: of what is between two nodes, and of
        accelerometers, which are mounted there."""
        channel = getattr(channels, f"{kind}s")[key]
        return len(channels.nodes[kind, key]) > 1 or channel.type.endswith("acceleration")

    def _place(self, numbers: Sequence[int], direction: Array) -> dict[str, Any]:
        """Where a channel is that acts on one global node, or on the second of two against the first."""
        label = [self._names[n] for n in numbers]
        if len(numbers) == 2:
            return {"node": label[1], "against": label[0], "direction": _triple(direction)}
        position = self.design.positions[numbers[0]]
        return {"node": label[0], "direction": _triple(direction), "position": _triple(position)}

    def _actuator(self, name: str) -> InputPort:
        entry = self._actuators[name]
        prototype, _, key = entry
        placed = self.plan.topology.copies[prototype]
        channels = placed.part.channels
        part: Actuator = channels.actuators[key]
        nothing = np.zeros(self.plan.topology.n_dof)
        if isinstance(part, BaseMotion | BaseRotation):
            base = self._base(entry)
            return InputPort(_of_base(name, _BASE[part.type], base), nothing, nothing, base)
        row, _, at = self._along(entry, "actuator", isinstance(part, MomentActuator))
        if not row.any():
            _refuse_still("actuators", prototype, key)
        value: dict[str, Any] = {
            k: v if isinstance(v, Dual) else float(v)
            for k in ("limit", "stiffness", "free_stroke", "blocked_force", "gain")
            if (v := channels.number("actuator", key, k, self.values)) is not None
        }
        nodes = tuple(placed.offset[entry[1]] + n for n in channels.nodes["actuator", key])
        if not isinstance(part, PiezoStack):
            limit = value.get("limit", np.inf)
            quantity = "moment" if isinstance(part, MomentActuator) else "force"
            return InputPort(Channel(name, quantity, **at), row, row, nodes=nodes, limits=(-limit, limit))
        k = value["stiffness"]
        top = value.get("free_stroke", value.get("blocked_force", np.inf) / k)
        gain = value.get("gain")
        stroke = 1.0 if gain is None else gain
        quantity = "expansion" if gain is None else "voltage"
        channel = Channel(name, quantity, **at)
        return InputPort(channel, k * stroke * row, row, None, k, stroke, nodes, (0.0, top / stroke))

    def _base(self, entry: tuple[str, int, str]) -> Array:
        prototype, copy, key = entry
        placed = self.plan.topology.copies[prototype]
        channels = placed.part.channels
        direction = channels.number("actuator", key, "direction", self.values)
        assert direction is not None
        Q, t = self.geometry.Q[placed.number[copy]], self.geometry.t[placed.number[copy]]
        d = Q @ direction / np.linalg.norm(direction)
        if isinstance(channels.actuators[key], BaseMotion):
            return np.concatenate([d, np.zeros(3)])
        point = channels.number("actuator", key, "point", self.values)
        d = d * round(float(np.linalg.det(plain(Q))))
        return np.concatenate([np.cross(Q @ point + t, d), d])

    def _sensor(self, name: str) -> OutputPort:
        prototype, _, key = self._sensors[name]
        part: Sensor = self.plan.topology.copies[prototype].part.channels.sensors[key]
        if isinstance(part, ForceSensor):
            return self._force_sensor(name, part)
        turns = part.type.startswith(("rotation", "angular"))
        row, absolute, at = self._along(self._sensors[name], "sensor", turns)
        if not row.any():
            _refuse_still("sensors", prototype, key)
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
        nothing = np.zeros(self.plan.topology.n_dof)
        if node is None:
            base = np.eye(6)[dof]
            channel = _of_base(name, _BASE["base_rotation" if turns else "base"], base)
            return InputPort(channel, nothing, nothing, base)
        row = self._rows([node])[dof]
        if not row.any():
            raise OptionError(f"{name} is held: it can be neither driven nor read")
        at = self._place([node], np.eye(3)[dof % 3])
        return InputPort(Channel(name, "moment" if turns else "force", **at), row, row, nodes=(node,))

    def _dof_output(self, name: str) -> OutputPort:
        where, _, word = name.partition(":")
        if word and word not in _WORDS:
            raise OptionError(f"{name}: after the colon stands {', '.join(_WORDS)}, not {word!r}")
        node, dof = self._node_and_dof(where, "output", self._sensors)
        if node is None:
            raise OptionError(f"{name} is an input; name a node whose motion is read")
        row = self._rows([node])[dof]
        if not row.any():
            raise OptionError(f"{name} is held: it can be neither driven nor read")
        derivative = _WORDS.index(word) if word else 0
        quantity = (_TURNS if dof >= 3 else _WORDS)[derivative]
        at = self._place([node], np.eye(3)[dof % 3])
        return OutputPort(Channel(name, quantity, **at), row, derivative, self._rigid(node)[dof])

    def _node_and_dof(self, name: str, what: str, known: dict[str, tuple[str, int, str]]) -> tuple[int | None, int]:
        node, _, dof = name.rpartition(".")
        if dof in DOF_NAMES and node:
            try:
                return int(self.plan.topology.numbers([node])[0]), DOF_NAMES.index(dof)
            except OptionError:
                if node == GROUND:
                    return None, DOF_NAMES.index(dof)
        hint = suggestion(name, known, f"described {what}s") if known else ""
        rule = f"there is no {what} {name!r}: it is a described {_PARTS[what]}, or a DOF such as NODE.tx"
        raise OptionError(f"{rule}; {hint}" if hint else rule)


def _triple(v: Array) -> tuple[float, float, float]:
    x, y, z = (float(entry) + 0.0 for entry in plain(v))
    return x, y, z


def _of_base(name: str, quantity: str, base: Array) -> Channel:
    """The channel of a motion of the base: of no node, along or about the direction of it."""
    return Channel(name, quantity, direction=_triple(base[3:] if base[3:].any() else base[:3]))


def actuator_names(plan: Plan) -> list[str]:
    """Names of all described actuators as placed."""
    return [
        ".".join((*path, key))
        for placed in plan.topology.copies.values()
        for path in placed.paths
        for key in placed.part.channels.actuators
    ]


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


def _refuse_still(kind: str, prototype: str, key: str) -> None:
    path = (kind, key) if not prototype else ("substructures", origin_of(prototype), kind, key)
    rule = "nothing can move here: the DOF is held"
    raise ModelError([Problem(path, "", rule, "name a node that is free in this direction")])


_BASE = {"base": "acceleration", "base_rotation": "angular_acceleration"}
_TURNS = ("rotation", "angular_velocity", "angular_acceleration")
_PARTS = {"input": "actuator", "output": "sensor"}
