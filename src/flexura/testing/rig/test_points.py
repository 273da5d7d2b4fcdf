"""A mechanism on its test rig: hammer points, accelerometers, and the mass that a placement of these adds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.duals import real, zeros
from flexura.errors import OptionError, SolverError
from flexura.linalg import count_below
from flexura.mechanism import Accelerometer, Damping, HammerPoint, Mechanism, ModalTest, evaluated
from flexura.records import Latest
from flexura.sensitivity import Change, Family, Matrices
from flexura.structure import Design, FullOrderModel, Plan, assemble, one_design, plan_of
from flexura.systems import InputPort, ModalSystem, OutputPort, System, system
from flexura.testing.measurement import MeasuredChannel

SHIFT = 0.1
"""Frequencies of one mode differ by less between setups, relative."""


@dataclass(frozen=True)
class TestPoint:
    """A test point of a mechanism: `motion` (3, n), its displacement from the DOFs of the full-order model, and a
    channel along a direction there, with the mass of its sensor, kg, and the `number` of the node that carries it."""

    channel: MeasuredChannel
    number: int
    motion: Any
    mass: float = 0.0

    @property
    def row(self) -> Array:
        """Displacement (n,) along the direction of the channel."""
        return np.asarray(self.channel.direction) @ self.motion.toarray()

    @property
    def rigid(self) -> Array:
        """Reading (6,) in unit rigid motions of and about the global origin."""
        d, x = np.asarray(self.channel.direction), np.asarray(self.channel.position)
        return np.concatenate([d, np.cross(x, d)])


@dataclass(frozen=True)
class AddedMass:
    """Masses (q,), kg, each on the three displacements `motion` (3 q, n) of a point of the full-order model.

    A negative one takes off the mass of a described sensor that is not in the placement.
    """

    mass: Array
    motion: Any

    def on(self, rows: Any = None) -> Any:
        """Mass matrix (n, n), kg, over the DOFs, or over coordinates that have `rows` (3 q, m) for the motion."""
        rows = self.motion if rows is None else rows
        weight = np.repeat(self.mass, 3)
        across: Any = rows.T
        return across @ (sp.csr_array(sp.diags_array(weight)) @ rows)


class TestPoints:
    """The test points of a test in one design of a mechanism, with what they weigh.

    Raises OptionError for a name that the mechanism does not have.
    """

    def __init__(self, design: Design) -> None:
        self.design = design
        described = design.plan.mechanism.test
        if described is None:
            raise OptionError(f"{design.name} describes no test: add the key test to its file")
        self._values = design.plan.parameter_values(design.parameters)
        numbers = evaluated(described, self._values)  # type: ignore[arg-type]
        self.test: ModalTest = ModalTest.model_construct(
            **{name: getattr(numbers, name) for name in ModalTest.model_fields}
        )

    @cached_property
    def hammer(self) -> dict[str, TestPoint]:
        """Hammer points by name."""
        return {name: self._hammer(name, point) for name, point in self.test.hammer.items()}

    @cached_property
    def accelerometers(self) -> dict[str, TestPoint]:
        """Accelerometers by name."""
        return {name: self._sensor(name, own) for name, own in self.test.accelerometers.items()}

    def added(self, placements: Sequence[str]) -> AddedMass:
        """Mean mass of the sensors of some placements, less those that the mechanism itself has (theory eq. H15)."""
        own = self.accelerometers
        weight = {name: own[name].mass * share for name, share in self._shares(placements).items()}
        used = [name for name, w in weight.items() if w]
        n = self.design.plan.topology.n_dof
        motion = sp.vstack([sp.csr_array((0, n)), *(own[name].motion for name in used)], format="csr")
        return AddedMass(np.array([weight[name] for name in used], dtype=float), motion)

    def masses(self, placements: Sequence[str]) -> list[tuple[Any, int, Any]]:
        """The same as masses, kg, with the number of the node that carries each and where it is (3,), m; of a design
        that may have slopes."""
        found = []
        for name, share in self._shares(placements).items():
            sensor, position = self.test.accelerometers[name], self.design.geometry.positions
            if isinstance(sensor, str):
                number, part = self._own(sensor)
                found.append((share * part.mass, number, position[number]))
            else:
                number = int(self.design.plan.topology.numbers([sensor.node])[0])
                at = position[number] if sensor.at is None else np.stack([real(x) for x in sensor.at])
                found.append((share * sensor.mass, number, at))
        return found

    def _shares(self, placements: Sequence[str]) -> dict[str, float]:
        """In how much of the placements each accelerometer is, less 1 for those of the mechanism itself."""
        placed, count = self.test.placed(), max(len(placements), 1)
        return {
            name: sum(name in placed[k] for k in placements) / count - isinstance(sensor, str)
            for name, sensor in self.test.accelerometers.items()
        }

    def _own(self, described: str) -> tuple[int, Any]:
        """The number of the node of a sensor of the mechanism, and its numbers."""
        *path, key = described.split(".")
        for placed in self.design.plan.topology.copies.values():
            part = placed.part.channels.sensors.get(key)
            if part is not None and tuple(path) in placed.paths:
                number = placed.offset[placed.paths.index(tuple(path))] + placed.part.channels.nodes["sensor", key][0]
                return number, evaluated(part, self._values)  # type: ignore[arg-type]
        raise OptionError(f"test: there is no sensor {described!r}")

    def _hammer(self, name: str, point: HammerPoint | str) -> TestPoint:
        if isinstance(point, str):
            return self._described("actuator", name, point)
        return self._inline(name, "force", point)

    def _sensor(self, name: str, sensor: Accelerometer | str) -> TestPoint:
        if isinstance(sensor, str):
            return self._described("sensor", name, sensor)
        point = self._inline(name, "acceleration", sensor)
        return replace(point, mass=float(sensor.mass))  # type: ignore[arg-type]

    def _inline(self, name: str, quantity: str, part: HammerPoint | Accelerometer) -> TestPoint:
        number = int(self.design.plan.topology.numbers([part.node])[0])
        here = self.design.geometry.positions[number]
        at = here if part.at is None else np.asarray(part.at, dtype=float)
        label = part.node if part.at is None else name
        return self._point(name, quantity, number, label, at, np.asarray(part.direction, dtype=float))

    def _point(self, name: str, quantity: str, number: int, label: str, at: Array, direction: Array) -> TestPoint:
        arm = at - self.design.geometry.positions[number]
        S = np.array([[0.0, arm[2], -arm[1]], [-arm[2], 0.0, arm[0]], [arm[1], -arm[0], 0.0]])
        motion = sp.csr_matrix(np.hstack([np.eye(3), S])) @ self.design.node_rows(np.array([number]))
        dx, dy, dz = (direction / np.linalg.norm(direction)).tolist()
        x, y, z = at.tolist()
        channel = MeasuredChannel(name, quantity, label, (dx, dy, dz), (x, y, z))
        return TestPoint(channel, number, sp.csr_matrix(motion))

    def _described(self, kind: str, name: str, described: str) -> TestPoint:
        """A force or a sensor of the mechanism, under its name in the test."""
        plan, geometry = self.design.plan, self.design.geometry
        *path, key = described.split(".")
        for placed in plan.topology.copies.values():
            channels = placed.part.channels
            part = getattr(channels, f"{kind}s").get(key)
            if part is None or tuple(path) not in placed.paths:
                continue
            copy = placed.paths.index(tuple(path))
            number = placed.offset[copy] + channels.nodes[kind, key][0]
            own = channels.number(kind, key, "direction", self.design.values)
            direction = geometry.Q[placed.number[copy]] @ np.asarray(own)
            quantity = "force" if kind == "actuator" else "acceleration"
            label = plan.topology.node_names[number]
            point = self._point(name, quantity, number, label, geometry.positions[number], direction)
            mass = float(evaluated(part, self._values).mass) if kind == "sensor" else 0.0  # type: ignore[arg-type]
            return replace(point, mass=mass)
        raise OptionError(f"test: there is no {kind} {described!r}")


def placements_of(plan: Plan, setups: Sequence[tuple[str, Sequence[MeasuredChannel]]]) -> tuple[str, ...]:
    """Placements of the described test with which data were taken, from the name of every setup and its outputs.

    A setup without a placement of its name has those of which it has all accelerometers. None without a test.
    """
    described = plan.mechanism.test
    if described is None:
        return ()
    placed, found = described.placed(), []
    for name, outputs in setups:
        if name and name in placed:
            found.append(name)
        else:
            names = {c.name for c in outputs}
            found += [k for k, own in placed.items() if names.issuperset(own)]
    return tuple(dict.fromkeys(found))


def added_mass(model: FullOrderModel, placements: Sequence[str]) -> AddedMass | None:
    """Mean mass that the sensors of some placements add to a model; None for no placements."""
    return TestPoints(model.design).added(placements) if placements else None


def with_sensors(model: FullOrderModel, placements: Sequence[str]) -> FullOrderModel:
    """A model that carries the mean mass of the sensors of some placements of its test; itself for none."""
    own = added_mass(model, placements)
    return model if own is None else replace(model, M=sp.csc_matrix(model.M + own.on()))


def placement_frequencies(model: FullOrderModel, placements: Sequence[str], hz: Array, vectors: Array) -> Array:
    """Frequencies (placements, k), Hz, of every placement by itself, from modes with their mean mass (Rayleigh-Ritz in
    the space of these)."""
    if not placements:
        return np.empty((0, len(hz)))
    points = TestPoints(model.design)
    mean = points.added(placements)
    mean_mass = mean.on(mean.motion @ vectors)
    found = np.empty((len(placements), len(hz)))
    for row, placement in zip(found, placements, strict=True):
        own = points.added([placement])
        found_mass = np.eye(len(hz)) + own.on(own.motion @ vectors) - mean_mass
        L = np.linalg.cholesky(found_mass)
        root = np.linalg.solve(L, np.diag((2 * np.pi * hz) ** 2))
        values = np.linalg.eigvalsh(np.linalg.solve(L, root.T))
        row[:] = np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi)
    return found


def sensors_note(model: FullOrderModel, placements: Sequence[str], each: Array) -> list[str]:
    """What was done about the mass of sensors; `each` (placements, r) has the frequencies of paired modes, Hz."""
    if not placements:
        if model.plan.mechanism.test is None:
            return []
        return ["no setup of the data is a placement of the described test: the mass of sensors is left out"]
    names = ", ".join(placements) if any(placements) else "the test"
    note = f"the model carries the sensors of {names}"
    if len(placements) > 1 and each.shape[1]:
        spread = float((np.ptp(each, axis=0) / each.mean(axis=0)).max())
        note += f"; frequencies are means over these, between which they differ by up to {100 * spread:.2g} %"
    return [note]


def frequency_ratios(each: Array, measured: Sequence[Array], test_hz: float, column: int) -> float:
    """Frequency of a mode of the model over that of the test, mean over the setups that have it.

    `each` (setups, k) are those of the model, `measured` those of every setup and `test_hz` the merged one, Hz.
    """
    found = []
    for own, hz in zip(each[:, column], measured, strict=True):
        nearest = np.argmin(np.abs(np.log(hz / test_hz))) if len(hz) else 0
        if len(hz) and abs(np.log(hz[nearest] / test_hz)) < SHIFT:
            found.append(own / hz[nearest])
    return float(np.mean(found)) if found else float(each[:, column].mean() / test_hz)


class MassLoadedFamily:
    """A family with the mean mass of the sensors of some placements, where and as heavy as the test of a design says.

    theory eq. K20.
    """

    def __init__(self, family: Family, placements: Sequence[str]) -> None:
        self._family, self._placements = family, tuple(placements)
        self._latest: Latest[FullOrderModel | Matrices] = Latest()

    def model(self, parameters: Mapping[str, float]) -> FullOrderModel | Matrices:
        """The model for one design with the sensors; the last one is remembered."""
        at = dict(parameters)
        return self._latest.get(frozenset(at.items()), lambda: self._built(at))

    def _built(self, at: dict[str, float]) -> FullOrderModel | Matrices:
        own = self._family.model(at)
        added = self._points(at).added(self._placements)
        if isinstance(own, FullOrderModel):
            return replace(own, M=sp.csc_matrix(own.M + added.on()))
        return replace(own, M=own.M + added.on(self._family.over_coordinates(at, added.motion)))

    def changes(self, parameters: Mapping[str, float], names: Sequence[str], X: Array) -> list[Change]:
        """Derivatives by each of some parameters of K X and M X (n, k) with the sensors, and of readings."""
        return self._family.changes(parameters, names, X, self._sensors)

    def _sensors(self, design: Design, X: Array) -> Any:
        """The sensors' mass times displacements X (n, k) of the full-order model, of a design that may have slopes."""
        topology, x = design.plan.topology, design.geometry.positions
        padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
        found = zeros(padded.shape, design.values)
        for mass, number, at in TestPoints(design).masses(self._placements):
            root = topology.root[number]
            D, dof = rigid_arm(at - x[root])[:3], topology.dof[root]
            found[dof] += D.T @ (mass * (D @ padded[dof]))
        return found[:-1]

    def readings(self, parameters: Mapping[str, float], X: Array) -> Array:
        """What the rows read off coordinate vectors X: (o, k)."""
        return self._family.readings(parameters, X)

    def rows(self, parameters: Mapping[str, float]) -> Array:
        """The rows themselves over the coordinates: (o, n)."""
        return self._family.rows(parameters)

    def _points(self, parameters: Mapping[str, float]) -> TestPoints:
        return TestPoints(Design.of(self._family.plan, parameters))


AnyFamily = Family | MassLoadedFamily


@dataclass(frozen=True)
class TrueModes:
    """What a test should find: undamped frequencies (n,), damping ratios (n,) and shapes (p, n) at all accelerometers
    of the test, unit modal mass. `placement` is the one whose sensors are on the mechanism, None for no sensors.
    """

    placement: str | None
    frequency_hz: Array
    damping_ratio: Array
    shapes: Array


class ModalTestRig:
    """A mechanism ready for the test that it describes, or for `test`.

    Raises OptionError without a test and for test points that cannot move, ModelError for a description that cannot be
    used.
    """

    def __init__(
        self,
        mechanism: Mechanism | Plan,
        parameters: Mapping[str, ArrayLike] | None = None,
        test: ModalTest | None = None,
        damping: Damping | float | Mapping[str, Any] | None = None,
    ) -> None:
        plan = plan_of(mechanism, parameters)
        plan.refuse_pose("virtual tests")
        described = test or plan.mechanism.test
        if described is None:
            raise OptionError(f"{plan.mechanism.name} describes no test: add the key test to its file")
        single = one_design(parameters)
        if test is not None:
            plan = plan_of(plan.mechanism.model_copy(update={"test": test}))
        self.model: FullOrderModel = assemble(plan, single)
        self._points = TestPoints(self.model.design)
        self.test: ModalTest = self._points.test
        self._built = system(self.model, inputs=[], outputs=[], damping=damping)
        self.hammer: list[TestPoint] = list(self._points.hammer.values())
        self.accelerometers: dict[str, TestPoint] = self._points.accelerometers
        for point in [*self.hammer, *self.accelerometers.values()]:
            if not point.row.any():
                raise OptionError(f"test: {point.channel.name} is at {point.channel.node}, which is held there")

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.model.plan.mechanism.name

    @cached_property
    def placements(self) -> dict[str, tuple[TestPoint, ...]]:
        """Accelerometers in every placement."""
        return {k: tuple(self.accelerometers[name] for name in own) for k, own in self.test.placed().items()}

    def system(self, placement: str | None) -> System:
        """Forces of the hammer to readings of all accelerometers, with the mass of those of one placement, or of none.

        theory eq. H15.
        """
        added = self._points.added([] if placement is None else [placement])
        M = sp.csc_matrix(self.model.M + added.on())
        built, sensors = self._built, list(self.accelerometers.values())
        p, m = len(sensors), len(self.hammer)
        return replace(
            built,
            M=M,
            C=built.C + built.law.alpha * (M - self.model.M),
            B=np.stack([h.row for h in self.hammer], axis=1),
            rows=np.stack([a.row for a in sensors]),
            derivative=np.full(p, 2, dtype=np.intp),
            D=np.zeros((p, m)),
            residual=np.zeros((p, m)),
            inputs=tuple(h.channel for h in self.hammer),
            outputs=tuple(a.channel for a in sensors),
            limits=((-np.inf, np.inf),) * m,
            input_ports=tuple(InputPort(h.channel, h.row, h.row) for h in self.hammer),
            output_ports=tuple(OutputPort(a.channel, a.row, 2, a.rigid) for a in sensors),
        )

    def modes(self, placement: str | None) -> ModalSystem:
        """The system in its modes up to half the sample rate. Raises SolverError when there are none."""
        built = self.system(placement)
        nyquist = float(self.test.sample_rate) / 2  # type: ignore[arg-type]
        if not count_below(built.K, built.M, (2 * np.pi * nyquist) ** 2):
            raise SolverError(f"there is no mode up to {nyquist:g} Hz, half the sample rate of the test")
        return built.modal(up_to=nyquist)
