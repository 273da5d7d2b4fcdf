"""A mechanism on the stand: hammer points and accelerometers placed on the full-order model, with the sensors' mass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.errors import OptionError, SolverError
from flexura.experiment.measurement import MeasuredChannel
from flexura.linalg import count_below
from flexura.mechanism import Accelerometer, HammerPoint, Mechanism, ModalTest
from flexura.mechanism.damping import Damping
from flexura.mechanism.evaluation import evaluated
from flexura.structure import Plan, assemble
from flexura.structure.plan import one_design, plan_of
from flexura.systems import ModalSystem, System, system
from flexura.systems.placed import PlacedInput, PlacedOutput

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """A place on a mechanism: `motion` (3, n), its displacement from the DOFs of the full-order model, and a channel
    along a direction there, with the mass of its sensor, kg."""

    channel: MeasuredChannel
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
class TrueModes:
    """What a test should find: undamped frequencies (n,), damping ratios (n,) and shapes (p, n) at all accelerometers
    of the test, unit modal mass. `placement` is the one whose sensors are on the mechanism, None for no sensors.
    """

    placement: str | None
    frequency_hz: Array
    damping_ratio: Array
    shapes: Array


class Stand:
    """A mechanism ready for the test that it describes, or for `test`.

    Raises OptionError without a test and for places that cannot move, ModelError for a description that cannot be used.
    """

    def __init__(
        self,
        mechanism: Mechanism | Plan,
        parameters: Mapping[str, ArrayLike] | None = None,
        test: ModalTest | None = None,
        damping: Damping | float | Mapping[str, Any] | None = None,
    ) -> None:
        plan = plan_of(mechanism)
        described = test or plan.mechanism.test
        if described is None:
            raise OptionError(f"{plan.mechanism.name} describes no test: add the key test to its file")
        single = one_design(parameters)
        if test is not None:
            plan = plan_of(plan.mechanism.model_copy(update={"test": test}))
        self.model = assemble(plan, single)
        self._values = plan.parameter_values(single)
        numbers = evaluated(described, self._values)  # type: ignore[arg-type]
        self.test = ModalTest(**{name: getattr(numbers, name) for name in ModalTest.model_fields})
        self._built = system(self.model, [], [], damping=damping)
        self.hammer = [self._hammer(name, point) for name, point in self.test.hammer.items()]
        self.accelerometers = {name: self._sensor(name, own) for name, own in self.test.accelerometers.items()}
        for place in [*self.hammer, *self.accelerometers.values()]:
            if not place.row.any():
                raise OptionError(f"test: {place.channel.name} is at {place.channel.node}, which is held there")

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.model.plan.mechanism.name

    @cached_property
    def placements(self) -> dict[str, tuple[Place, ...]]:
        """Accelerometers in every placement."""
        return {k: tuple(self.accelerometers[name] for name in own) for k, own in self.test.placed().items()}

    def system(self, placement: str | None) -> System:
        """Forces of the hammer to readings of all accelerometers, with the mass of those of one placement, or of none.

        theory eq. H15.
        """
        M = self.model.M
        declared = [a for name, a in self.accelerometers.items() if isinstance(self.test.accelerometers[name], str)]
        on = () if placement is None else self.placements[placement]
        for place, sign in [(p, -1.0) for p in declared] + [(p, 1.0) for p in on]:
            if place.mass:
                M = M + sign * place.mass * (place.motion.T @ place.motion)
        M = sp.csc_matrix(M)
        built, places = self._built, list(self.accelerometers.values())
        p, m = len(places), len(self.hammer)
        return replace(
            built,
            M=M,
            C=built.C + built.law.alpha * (M - self.model.M),
            B=np.stack([h.row for h in self.hammer], axis=1),
            rows=np.stack([a.row for a in places]),
            derivative=np.full(p, 2, dtype=np.intp),
            D=np.zeros((p, m)),
            residual=np.zeros((p, m)),
            inputs=tuple(h.channel for h in self.hammer),
            outputs=tuple(a.channel for a in places),
            limits=((-np.inf, np.inf),) * m,
            placed_inputs=tuple(PlacedInput(h.channel, h.row, h.row) for h in self.hammer),
            placed_outputs=tuple(PlacedOutput(a.channel, a.row, 2, a.rigid) for a in places),
        )

    def modes(self, placement: str | None) -> ModalSystem:
        """The system in its modes up to half the sample rate. Raises SolverError when there are none."""
        built = self.system(placement)
        nyquist = float(self.test.sample_rate) / 2  # type: ignore[arg-type]
        if not count_below(built.K, built.M, (2 * np.pi * nyquist) ** 2):
            raise SolverError(f"there is no mode up to {nyquist:g} Hz, half the sample rate of the test")
        return built.modal(up_to=nyquist)

    def _hammer(self, name: str, point: HammerPoint | str) -> Place:
        if isinstance(point, str):
            return self._described("actuator", name, point)
        return self._inline(name, "force", point)

    def _sensor(self, name: str, sensor: Accelerometer | str) -> Place:
        if isinstance(sensor, str):
            return self._described("sensor", name, sensor)
        place = self._inline(name, "acceleration", sensor)
        return replace(place, mass=float(sensor.mass))  # type: ignore[arg-type]

    def _inline(self, name: str, quantity: str, part: HammerPoint | Accelerometer) -> Place:
        number = int(self.model.plan.topology.numbers([part.node])[0])
        here = self.model.geometry.positions[number]
        at = here if part.at is None else np.asarray(part.at, dtype=float)
        label = part.node if part.at is None else name
        return self._place(name, quantity, number, label, at, np.asarray(part.direction, dtype=float))

    def _place(self, name: str, quantity: str, number: int, label: str, at: Array, direction: Array) -> Place:
        plan, geometry = self.model.plan, self.model.geometry
        arm = at - geometry.positions[number]
        S = np.array([[0.0, arm[2], -arm[1]], [-arm[2], 0.0, arm[0]], [arm[1], -arm[0], 0.0]])
        motion = sp.csr_matrix(np.hstack([np.eye(3), S])) @ plan.node_rows(np.array([number]), geometry)
        dx, dy, dz = (direction / np.linalg.norm(direction)).tolist()
        x, y, z = at.tolist()
        channel = MeasuredChannel(name, quantity, label, (dx, dy, dz), (x, y, z))
        return Place(channel, sp.csr_matrix(motion))

    def _described(self, kind: str, name: str, described: str) -> Place:
        """A force or a sensor of the mechanism, under its name in the test."""
        plan, geometry = self.model.plan, self.model.geometry
        *path, key = described.split(".")
        for placed in plan.topology.placed.values():
            channels = placed.part.channels
            part = getattr(channels, f"{kind}s").get(key)
            if part is None or tuple(path) not in placed.paths:
                continue
            copy = placed.paths.index(tuple(path))
            number = placed.offset[copy] + channels.nodes[kind, key][0]
            own = channels.number(kind, key, "direction", self.model.values)
            direction = geometry.Q[placed.number[copy]] @ np.asarray(own)
            quantity = "force" if kind == "actuator" else "acceleration"
            label = plan.topology.node_names[number]
            place = self._place(name, quantity, number, label, geometry.positions[number], direction)
            mass = float(evaluated(part, self._values).mass) if kind == "sensor" else 0.0  # type: ignore[arg-type]
            return replace(place, mass=mass)
        raise OptionError(f"test: there is no {kind} {described!r}")
