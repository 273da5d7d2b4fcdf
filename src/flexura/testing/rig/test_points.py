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
from flexura.derivatives import Change, Family, Matrices
from flexura.duals import real, zeros
from flexura.errors import OptionError, SolverError
from flexura.full_order import assemble, plan_of
from flexura.linalg import count_below
from flexura.mechanism import Accelerometer, Damping, HammerPoint, Mechanism, ModalTest, evaluated
from flexura.records import Latest
from flexura.structure import DERIVATIVE, Channel, Design, FullOrderModel, InputPort, OutputPort, Plan, one_design
from flexura.systems import ModalSystem, System, system
from flexura.testing.measurement import SAME_MODE_OF_SETUPS, MeasuredChannel


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
        return {name: self._point(name, "actuator", entry) for name, entry in self.test.hammer.items()}

    @cached_property
    def accelerometers(self) -> dict[str, TestPoint]:
        """Accelerometers by name."""
        return {name: self._point(name, "sensor", entry) for name, entry in self.test.accelerometers.items()}

    def added(self, placements: Sequence[str]) -> AddedMass:
        """Mean mass of the sensors of some placements, less those that the mechanism itself has (theory eq. H15)."""
        mass = {name: self.accelerometers[name].mass * share for name, share in self._shares(placements).items()}
        used = [name for name, m in mass.items() if m]
        nothing = sp.csr_array((0, self.design.plan.topology.n_dof))
        motion = sp.vstack([nothing, *(self.accelerometers[name].motion for name in used)], format="csr")
        return AddedMass(np.array([mass[name] for name in used], dtype=float), motion)

    def masses(self, placements: Sequence[str]) -> list[tuple[Any, int, Any]]:
        """The same as masses, kg, with the number of the node that carries each and where it is (3,), m; of a design
        that may have slopes."""
        masses = []
        for name, share in self._shares(placements).items():
            if share:
                number, at, part, _ = self._described("sensor", self.test.accelerometers[name])
                masses.append((share * part.mass, number, at))
        return masses

    def _shares(self, placements: Sequence[str]) -> dict[str, float]:
        """In how much of the placements each accelerometer is, less 1 for those of the mechanism itself."""
        placed, count = self.test.placed(), max(len(placements), 1)
        return {
            name: sum(name in placed[k] for k in placements) / count - isinstance(sensor, str)
            for name, sensor in self.test.accelerometers.items()
        }

    def _described(self, kind: str, entry: HammerPoint | Accelerometer | str) -> tuple[int, Any, Any, Array]:
        """Node of a test point and where it is (3,), m, with its numbers, and the axes (3, 3) of its direction.

        `entry` is a point of the test, or the name of an actuator or a sensor of the mechanism.
        """
        topology, geometry = self.design.plan.topology, self.design.geometry
        if not isinstance(entry, str):
            number = int(topology.numbers([entry.node])[0])
            at = geometry.positions[number] if entry.at is None else np.stack([real(x) for x in entry.at])
            return number, at, entry, np.eye(3)
        *path, key = entry.split(".")
        for placed in topology.copies.values():
            part = getattr(placed.part.channels, f"{kind}s").get(key)
            if part is not None and tuple(path) in placed.paths:
                copy = placed.paths.index(tuple(path))
                number = placed.offset[copy] + placed.part.channels.nodes[kind, key][0]
                numbers = evaluated(part, self._values)  # type: ignore[arg-type]
                return number, geometry.positions[number], numbers, geometry.Q[placed.number[copy]]
        raise OptionError(f"test: there is no {kind} {entry!r}")

    def _point(self, name: str, kind: str, entry: HammerPoint | Accelerometer | str) -> TestPoint:
        number, at, part, axes = self._described(kind, entry)
        is_at_node = isinstance(entry, str) or entry.at is None
        label = self.design.plan.topology.node_names[number] if is_at_node else name
        arm = np.asarray(at, dtype=float) - self.design.geometry.positions[number]
        motion = sp.csr_matrix(rigid_arm(arm)[:3]) @ self.design.node_rows(np.array([number]))
        direction = axes @ np.asarray(part.direction, dtype=float)
        dx, dy, dz = (direction / np.linalg.norm(direction)).tolist()
        x, y, z = np.asarray(at, dtype=float).tolist()
        quantity = "force" if kind == "actuator" else "acceleration"
        channel = MeasuredChannel(name, quantity, label, (dx, dy, dz), (x, y, z))
        return TestPoint(channel, number, sp.csr_matrix(motion), float(part.mass) if kind == "sensor" else 0.0)


def placements_of(plan: Plan, setups: Sequence[tuple[str, Sequence[MeasuredChannel]]]) -> tuple[str, ...]:
    """Placements of the described test with which data were taken, from the name of every setup and its outputs.

    A setup without a placement of its name has those of which it has all accelerometers. None without a test.
    """
    described = plan.mechanism.test
    if described is None:
        return ()
    placed, placements = described.placed(), []
    for name, outputs in setups:
        if name and name in placed:
            placements.append(name)
        else:
            names = {c.name for c in outputs}
            placements += [k for k, sensors in placed.items() if names.issuperset(sensors)]
    return tuple(dict.fromkeys(placements))


def added_mass(model: FullOrderModel, placements: Sequence[str]) -> AddedMass | None:
    """Mean mass that the sensors of some placements add to a model; None for no placements."""
    return TestPoints(model.design).added(placements) if placements else None


def with_sensors(model: FullOrderModel, placements: Sequence[str]) -> FullOrderModel:
    """A model that carries the mean mass of the sensors of some placements of its test; itself for none."""
    added = added_mass(model, placements)
    return model if added is None else replace(model, M=sp.csc_matrix(model.M + added.on()))


def placement_frequencies(model: FullOrderModel, placements: Sequence[str], hz: Array, vectors: Array) -> Array:
    """Frequencies (placements, k), Hz, of every placement by itself, from modes with their mean mass (Rayleigh-Ritz in
    the space of these)."""
    each = np.empty((len(placements), len(hz)))
    if not placements:
        return each
    points = TestPoints(model.design)
    mean = points.added(placements)
    mean_mass = mean.on(mean.motion @ vectors)
    for row, placement in zip(each, placements, strict=True):
        added = points.added([placement])
        L = np.linalg.cholesky(np.eye(len(hz)) + added.on(added.motion @ vectors) - mean_mass)
        root = np.linalg.solve(L, np.diag((2 * np.pi * hz) ** 2))
        values = np.linalg.eigvalsh(np.linalg.solve(L, root.T))
        row[:] = np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi)
    return each


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
    ratios = []
    for model_hz, hz in zip(each[:, column], measured, strict=True):
        distance = np.abs(np.log(hz / test_hz))
        if distance.min(initial=np.inf) < SAME_MODE_OF_SETUPS:
            ratios.append(model_hz / hz[np.argmin(distance)])
    return float(np.mean(ratios)) if ratios else float(each[:, column].mean() / test_hz)


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
        return self._latest.get(frozenset(at.items()), lambda: self._loaded(at))

    def _loaded(self, at: dict[str, float]) -> FullOrderModel | Matrices:
        model = self._family.model(at)
        added = TestPoints(Design.of(self._family.plan, at)).added(self._placements)
        if isinstance(model, FullOrderModel):
            return replace(model, M=sp.csc_matrix(model.M + added.on()))
        return replace(model, M=model.M + added.on(self._family.over_coordinates(at, added.motion)))

    def changes(self, parameters: Mapping[str, float], names: Sequence[str], X: Array) -> list[Change]:
        """Derivatives by each of some parameters of K X and M X (n, k) with the sensors, and of readings."""
        return self._family.changes(parameters, names, X, self._sensors)

    def _sensors(self, design: Design, X: Array) -> Any:
        """The sensors' mass times displacements X (n, k) of the full-order model, of a design that may have slopes."""
        topology, x = design.plan.topology, design.geometry.positions
        padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
        forces = zeros(padded.shape, design.values)
        for mass, number, at in TestPoints(design).masses(self._placements):
            root = topology.root[number]
            D, dof = rigid_arm(at - x[root])[:3], topology.dof[root]
            forces[dof] += D.T @ (mass * (D @ padded[dof]))
        return forces[:-1]

    def readings(self, parameters: Mapping[str, float], X: Array) -> Array:
        """What the rows read off coordinate vectors X: (o, k)."""
        return self._family.readings(parameters, X)

    def rows(self, parameters: Mapping[str, float]) -> Array:
        """The rows themselves over the coordinates: (o, n)."""
        return self._family.rows(parameters)


AnyFamily = Family | MassLoadedFamily


def between(built: System, inputs: Sequence[Channel], outputs: Sequence[Channel]) -> System:
    """A system with other inputs and outputs, which is still to be given their `B` and `rows`."""
    p, m = len(outputs), len(inputs)
    return replace(
        built,
        derivative=np.array([DERIVATIVE.get(c.quantity, 0) for c in outputs], dtype=np.intp),
        D=np.zeros((p, m)),
        residual=np.zeros((p, m)),
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        limits=((-np.inf, np.inf),) * m,
    )


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
        placed = self.test.placed().items()
        return {placement: tuple(self.accelerometers[name] for name in names) for placement, names in placed}

    def system(self, placement: str | None) -> System:
        """Forces of the hammer to readings of all accelerometers, with the mass of those of one placement, or of none.

        theory eq. H15.
        """
        added = self._points.added([] if placement is None else [placement])
        M = sp.csc_matrix(self.model.M + added.on())
        sensors = list(self.accelerometers.values())
        return replace(
            between(self._built, [h.channel for h in self.hammer], [a.channel for a in sensors]),
            M=M,
            C=self._built.C + self._built.law.alpha * (M - self.model.M),
            B=np.stack([h.row for h in self.hammer], axis=1),
            rows=np.stack([a.row for a in sensors]),
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
