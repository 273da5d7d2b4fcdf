"""Static response of the full-order model to loads, gravity and actuators."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.limits import (
    States,
    bent_most,
    command_limits,
    force_limits,
    motion_limits,
    not_looked_at,
    pose_limits,
    preload,
    stiffening_limits,
    stop_limits,
    stress_limits,
)
from flexura.analysis.model_error import Interval, ModelError, errors_of, interval_text
from flexura.analysis.strain import (
    KINDS,
    PartStress,
    Stresses,
    StressProfiles,
    deformations,
    edge_notes,
    end_forces,
    energies,
    finite_numbers,
    member_stresses,
    motion_meshes,
    part_stresses,
    stress_profiles,
)
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.full_order import assemble
from flexura.mechanism import DOF_NAMES, FORCE_UNITS, UNITS, Mechanism
from flexura.reduction import flexibility, state_of
from flexura.results import Tabular
from flexura.structure import FullOrderModel, Plan, Ports, dead_load, matched
from flexura.tables import SHOWN_AS_ZERO, Facts, Item, Table, quantity

NOTCH_FACTOR_ERROR = 0.05
"""How far off, relative, the stress factors of notches may be."""

MOST_NODES = 6
"""Nodes that a notebook shows: those that carry loads and bodies first, then those that move most."""

MOST_MEMBERS = 10
"""Members that yield first, in a notebook."""


@dataclass(frozen=True)
class ActuatorState:
    """An actuator in a static state: its command, in `unit`, the change of its length (or the motion that it works on),
    m or rad, and the force that it exerts, N, pushing apart positive, or moment, N m; None of layers, which stretch and
    bend at once."""

    name: str
    command: float
    unit: str
    elongation: float | None
    force: float | None


@dataclass(frozen=True, repr=False)
class Statics(Tabular):
    """The linear static response u (n,) of `model` to a load vector (n,), m and rad, N and N m.

    `readings` are those of the described displacement, rotation and force sensors, `actuators` the state of each
    described actuator, `gravity` (3,) m/s^2 what the members' own weight came from, `loads` (6,) dead loads by node.
    """

    _shown = ("model", "readings", "loads")

    model: FullOrderModel
    load: Array
    displacement_vector: Array
    gravity: tuple[float, float, float]
    readings: dict[str, float]
    actuators: tuple[ActuatorState, ...]
    loads: dict[str, Array] = field(default_factory=dict)

    def displacement(self, node: str) -> Array:
        """Displacement (6,) of a node, m and rad, global frame. Raises OptionError for unknown nodes."""
        plan = self.model.plan
        rows = self.model.design.node_rows(plan.topology.numbers([node]))
        return np.asarray(rows @ self.displacement_vector)

    def stresses(self) -> Stresses:
        """The largest stress in every link, flexure and part."""
        return member_stresses(self.model, self.displacement_vector, gravity=self._weight)

    def stress_profiles(self) -> StressProfiles:
        """Stresses along the members of every prototype, and over parts."""
        states = self.displacement_vector[:, None]
        weight = None if self._weight is None else np.array(self._weight)

        def forces(name: str) -> tuple[Array, Array]:
            return end_forces(self.model, name, states, weight)

        names = [name for name in self.model.matrices if self.model.plan.parts[name].members]
        return stress_profiles(self.model, names, forces, deformations(self.model, states))

    @property
    def _weight(self) -> tuple[float, float, float] | None:
        return self.gravity if any(self.gravity) else None

    @cached_property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Where this response stops holding: large motion, ranges of actuators, yield, buckling, coarse meshes."""
        states = States(self.model, self.displacement_vector[:, None])
        ports, commands = Ports(self.model.design), np.array([actuator.command for actuator in self.actuators])
        inputs = ports.inputs([actuator.name for actuator in self.actuators])
        by_name = {actuator.name: np.array([actuator.command]) for actuator in self.actuators}
        return (
            *command_limits(inputs, commands[:, None]),
            *force_limits(states, ports, by_name),
            *motion_limits(states),
            *stop_limits(states),
            *stiffening_limits(self.model, bent_most(states), inputs, commands),
            *stress_limits(states, self._weight),
            *self._buckling[0],
            *pose_limits(self.model),
            *motion_meshes(self.model, self.displacement_vector[:, None], ["under these loads"]),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """About which state it is linear, and what could not be looked at."""
        deformed = deformations(self.model, self.displacement_vector[:, None])
        edges = edge_notes(part_stresses(self.model, deformed))
        return (*state_of(self.model.design), *self._buckling[1], *not_looked_at(self.model), *edges)

    @cached_property
    def model_errors(self) -> ModelError:
        """How far the part may be from the model: in the energy of its members, in all `readings` of displacements, and
        in the motion of the nodes that carry `loads`, along the direction in which each moves."""
        u = self.displacement_vector
        rows = list(_displacement_rows(self.model, self.readings).values())
        for node in self.loads:
            moved = self.displacement(node)[:3]
            translation = self.model.design.node_rows(self.model.plan.topology.numbers([node])).toarray()[:3]
            rows.append(moved @ translation / (np.linalg.norm(moved) or 1.0))
        R = np.reshape(rows, (-1, self.model.order))
        states = np.column_stack([u, flexibility(self.model).held(np.ascontiguousarray(R.T))])
        spring = KINDS.index("spring")
        strained = [
            2 * float(np.delete(kinds[:, 0], spring).sum())
            for part in energies(self.model, self.model.node_displacements(u[:, None]))
            for kinds in part.strain.values()
        ]
        base = np.array([sum(strained), *(R @ u)])
        return errors_of(self.model, states, lambda E: base + E[:, 0])

    @property
    def model_error(self) -> dict[str, Interval | None]:
        """By sensor of a displacement and by loaded node, where the part's displacement lies: between 1 + low and
        1 + high times the one given; None where there is no evidence."""
        names = (*_displacement_rows(self.model, self.readings), *self.loads)
        return dict(zip(names, self.model_errors.intervals[1:], strict=True))

    @property
    def stress_error(self) -> Interval | None:
        """Where the part's stresses lie, relative to those given; None where there is no evidence. They change by no
        more than the stiffness of what is bent, and factors of notches (Neuber 1958) are off by 5 % at most. A sharp
        corner where a member ends has no finite stress, which is not in it. In parts they are off for the mesh."""
        interval, stresses = self.model_errors.intervals[0], self.stresses().members
        most = [own.error for own in stresses if isinstance(own, PartStress) and own.error is not None]
        if interval is not None:
            most.append(max(map(abs, interval)) + NOTCH_FACTOR_ERROR)
        elif len(most) < len(stresses):
            return None
        return (-max(most), max(most)) if most else None

    @cached_property
    def _buckling(self) -> tuple[tuple[Diagnostic, ...], tuple[str, ...]]:
        """Whether the loads are beyond buckling, and why that is not known where it is not."""
        if self.model.plan.is_posed:
            return (), ("whether these loads buckle it at the pose is not known: use a stroke with them",)
        commands = {a.name: a.command for a in self.actuators}
        try:
            return preload(self.model, gravity=self.gravity, loads=self.loads, actuators=commands).buckled, ()
        except (OptionError, SolverError) as reason:
            return (), (f"whether it buckles is not known: {reason}",)

    def to_dict(self, nodes: Sequence[str] | None = None) -> dict[str, Any]:
        """Plain data for JSON, with the displacements of some nodes, by default of those that carry `loads`.

        Raises OptionError for unknown nodes.
        """
        chosen = self.loads if nodes is None else nodes
        return {"displacement": {node: self.displacement(node).tolist() for node in chosen}, **super().to_dict()}

    def _data(self) -> dict[str, Any]:
        stresses = self.stresses()
        return {
            "model_error": self.model_error,
            "stress_error": self.stress_error,
            "readings": self.readings,
            "actuators": self.actuators,
            "stress": [
                {"member": m.name, "von_mises_Pa": m.von_mises, "factor_to_yield": m.factor_to_yield}
                | (m.of_surface() if isinstance(m, PartStress) else {})
                for m in stresses.members
            ],
            "factor_to_yield": stresses.factor_to_yield,
        }

    def _title(self) -> str:
        return f"{self.model.plan.name}: static response, linear"

    def presentation(self, nodes: Sequence[str] | None = None) -> Iterator[Item]:
        """Displacements of nodes, by default of those that carry loads, of bodies and of those that move most,
        readings, actuators, and the members with the largest stress. Raises OptionError for unknown nodes."""
        table = self._columns()
        headings, node_names = list(table), table["node"]
        for alike in (headings[1:4], headings[4:]):
            least = SHOWN_AS_ZERO * max(np.abs(table[name]).max(initial=0.0) for name in alike)
            table |= {name: np.where(np.abs(table[name]) > least, table[name], 0.0) for name in alike}
        rows = {name: k for k, name in reversed(list(enumerate(node_names)))}  # the first node of each name
        if nodes is None:
            moved = np.abs([table[name] for name in headings[1:4]]).max(axis=0)
            named = {*self.loads, *self.model.plan.body_names}
            nodes = sorted(rows, key=lambda name: (name not in named, -moved[rows[name]], rows[name]))[:MOST_NODES]
            count = len(rows)
        else:
            self.model.plan.topology.numbers(nodes)
            count = len(nodes)
        shown = {name: [column[rows[node]] for node in nodes] for name, column in table.items()}
        yield Table(shown, "nodes", count=count)
        yield Table(self.reading_columns(), "sensors")
        yield Table(self.actuator_columns(), "actuators")
        stresses = self.stresses()
        yield stresses.most_loaded(MOST_MEMBERS)
        factor = stresses.factor_to_yield
        if factor is not None and np.isfinite(factor):
            yields = "with what the pose stresses" if self.model.plan.is_posed else "times these loads and commands"
            yield Facts(
                {"model error of stresses": interval_text(self.stress_error), "yields at": f"{factor:.4g} {yields}"}
            )

    def reading_columns(self) -> dict[str, Any]:
        """What each sensor reads, with its unit."""
        units = {out.channel.name: out.channel.unit for out in Ports(self.model.design).outputs(list(self.readings))}
        largest = {unit: max(abs(self.readings[n]) for n in units if units[n] == unit) for unit in units.values()}
        readings = [
            quantity(value if abs(value) > SHOWN_AS_ZERO * largest[units[name]] else 0.0, units[name])
            for name, value in self.readings.items()
        ]
        errors = {name: interval_text(interval) for name, interval in self.model_error.items()}
        texts = [errors.get(name, "") for name in self.readings]
        return {"sensor": list(self.readings), "reading": readings, "model error": texts}

    def actuator_columns(self) -> dict[str, Any]:
        """What each actuator is commanded to, how far it moves, and the force or moment with which it does."""
        actuators = self.actuators
        return {
            "actuator": [a.name for a in actuators],
            "command": [quantity(a.command, a.unit) for a in actuators],
            "elongation": [quantity(a.elongation, UNITS[a.unit == "N*m"]) for a in actuators],
            "force": [quantity(a.force, FORCE_UNITS[a.unit == "N*m"]) for a in actuators],
        }

    def _columns(self) -> dict[str, Any]:
        """Displacements of all nodes."""
        topology = self.model.plan.topology
        placed = np.flatnonzero(topology.has_position)
        u = self.model.node_displacements(self.displacement_vector[:, None])[placed, :, 0]
        moves = {f"{dof} [{'m' if dof[0] == 't' else 'rad'}]": u[:, k] for k, dof in enumerate(DOF_NAMES)}
        return {"node": [topology.node_names[k] for k in placed], **moves}


def _displacement_rows(model: FullOrderModel, readings: Mapping[str, float]) -> dict[str, Array]:
    """Rows (n,) of the sensors that read displacements and rotations alone."""
    outputs = Ports(model.design).outputs(list(readings))
    return {
        out.channel.name: np.asarray(out.row)
        for out in outputs
        if out.channel.quantity in ("displacement", "rotation") and not out.feed
    }


@verb
def statics(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    loads: Mapping[str, ArrayLike] | None = None,
    gravity: Sequence[float] | None = None,
    actuators: Mapping[str, float] | None = None,
) -> Statics:
    """Static response to loads, (6,) N and N m by node, gravity, (3,) m/s^2, and actuator commands by name,
    wildcards allowed, beside the loads and gravity that are described.

    It is linear, with the stiffness about the state under the loads and gravity that are described (theory eq. P9).
    About a pose that is described it is what these add there, where described loads and gravity are on already.
    Commands are in the units of the inputs: N, N m, m of free expansion, V, or m/s^2 of a steadily accelerated base
    (theory eq. T1). Raises ModelError; OptionError for unknown nodes and actuators and for impossible numbers;
    SolverError when something can move freely.
    """
    model = assemble(model, parameters)
    if model.plan.is_posed:
        if gravity is not None:
            raise OptionError("gravity is on at the pose that is described: change it in the description")
        return response_to(model, actuators, loads)
    described = model.plan.loads.gravity(model.values)
    g = described if gravity is None else finite_numbers("gravity", gravity, 3)
    if described.any() and not np.array_equal(described, g):
        text = ", ".join(f"{c:g}" for c in described)
        raise OptionError(f"gravity is described as [{text}] m/s^2, about which the stiffness is: change it there")
    dead = dead_load(model, g, model.plan.loads.wrenches(model.values))
    return _response(model, g, dead, loads or {}, actuators or {})


def response_to(
    model: FullOrderModel,
    actuators: Mapping[str, float] | None = None,
    loads: Mapping[str, ArrayLike] | None = None,
) -> Statics:
    """What actuator commands and loads add to the state under the loads and gravity that are described; as
    `statics`."""
    return _response(model, np.zeros(3), np.zeros(model.order), loads or {}, actuators or {})


def _response(
    model: FullOrderModel, g: Array, load: Array, loads: Mapping[str, ArrayLike], actuators: Mapping[str, float]
) -> Statics:
    """The response to a load vector (n,), which has gravity, and what `loads` and `actuators` add to it."""
    ports = Ports(model.design)
    wrenches = {node: finite_numbers(f"load on {node}", value, 6) for node, value in loads.items()}
    for node, wrench in wrenches.items():
        load = load + model.design.node_rows(model.plan.topology.numbers([node])).T @ wrench
    names = matched(actuators, ports.actuators)
    commands = {name: _command(pattern, value) for pattern, value in actuators.items() for name in names[pattern]}
    driven = ports.inputs(list(commands))
    base = np.zeros(6)
    for port, command in zip(driven, commands.values(), strict=True):
        load = load + command * port.load
        if port.base is not None:
            base += command * port.base
    load = load - model.base_inertia_forces @ base
    u = flexibility(model).held(load[:, None])[:, 0]
    states = []
    for port in {port.channel.name: port for port in (*ports.inputs(ports.actuators), *driven)}.values():
        if port.base is None:
            command, elongation = commands.get(port.channel.name, 0.0), float(port.row @ u)
            force = command if port.stiffness is None else port.stiffness * (port.stroke * command - elongation)
            if port.strains:
                elongation = force = None
            states.append(ActuatorState(port.channel.name, command, port.channel.unit, elongation, force))
    readings = {}
    for out in ports.outputs(ports.sensors):
        if out.derivative == 0:
            fed = sum(out.feed.get(name, 0.0) * command for name, command in commands.items())
            readings[out.channel.name] = float(out.row @ u + fed)
    return Statics(model, load, u, (float(g[0]), float(g[1]), float(g[2])), readings, tuple(states), wrenches)


def _command(name: str, value: object) -> float:
    try:
        command = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise OptionError(f"the command of {name} is a number, not {value!r}") from None
    if not np.isfinite(command):
        raise OptionError(f"the command of {name} is a finite number, not {command}")
    return command


@verb
def compliance(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    nodes: Sequence[str],
) -> Array:
    """Displacements (6k, 6k) of `nodes` (k) per unit force and moment at them: m/N, rad/N, rad/(N m), global frame.

    The stiffness at a single node is its inverse. Raises ModelError, OptionError for unknown nodes, SolverError when
    something can move freely.
    """
    model = assemble(model, parameters)
    rows = model.design.node_rows(model.plan.topology.numbers(nodes)).toarray()
    C = rows @ flexibility(model).held(np.ascontiguousarray(rows.T))
    return (C + C.T) / 2
