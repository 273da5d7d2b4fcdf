"""What a report is about: a mechanism, its plan, and results that several sections share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from flexura.analysis import Kinetostatics, Modes, kinetostatics, modes
from flexura.expressions import Expression
from flexura.full_order import assemble
from flexura.mechanism import DOF_NAMES, Mechanism, MotionSensor
from flexura.pages.report.commands import Commands
from flexura.structure import FullOrderModel, InputPort, Plan, Ports


@dataclass(frozen=True)
class Subject:
    """A mechanism with parameters (SI) and the commands that make its numbers again; `n` modes are asked for, `solid`
    asks for finite elements."""

    mechanism: Mechanism
    plan: Plan
    parameters: Mapping[str, float]
    commands: Commands
    n: int
    solid: bool

    @cached_property
    def modes(self) -> Modes:
        """The certified modes."""
        return modes(self.plan, self.parameters, n=self.n)

    @cached_property
    def model(self) -> FullOrderModel:
        """The full-order model."""
        return assemble(self.plan, self.parameters)

    @cached_property
    def platform(self) -> str | None:
        """The node that is moved: the only rigid body, else the one that a sensor is at, else the heaviest; None
        without bodies."""
        masses = {
            ".".join((*path, key)): float(body.mass_and_inertia(self.model.values)[0])
            for name, part in self.plan.parts.items()
            for path in self.plan.topology.copies[name].paths
            for key, (_, body) in part.bodies.items()
            if not self._is_held(".".join((*path, key)))
        }
        read = [node for node in self._read if node in masses]
        return next(iter(read), max(masses, key=masses.__getitem__, default=None))

    @property
    def _read(self) -> list[str]:
        """Nodes that sensors of motion are at."""
        own = [sensor for sensor in self.mechanism.sensors.values() if isinstance(sensor, MotionSensor)]
        return [node for sensor in own for node in sensor.nodes]

    def _is_held(self, node: str) -> bool:
        topology = self.plan.topology
        return bool(topology.held[topology.root[topology.numbers([node])]].all())

    @cached_property
    def kinetostatics(self) -> Kinetostatics:
        """How the actuators move the platform. Raises OptionError without a body."""
        return kinetostatics(self.plan, self.parameters, platform=self.platform)

    @cached_property
    def inputs(self) -> list[InputPort]:
        """The actuators that are described, but moved bases."""
        ports = Ports(self.model.design)
        return [own for own in ports.inputs(ports.actuators) if own.base is None]

    @cached_property
    def sensors(self) -> list[str]:
        """Names of the sensors that are described."""
        return Ports(self.model.design).sensors

    @cached_property
    def samples(self) -> float:
        """Samples in time of all hits of the test that is described; zero without one."""
        test = self.mechanism.test
        if test is None:
            return 0.0
        values = self.plan.parameter_values(dict(self.parameters))
        rate, seconds = (
            float(own.evaluate(values) if isinstance(own, Expression) else own)
            for own in (test.sample_rate, test.duration)
        )
        records = test.hits * len(test.hammer) * len(test.placed())
        return rate * seconds * records

    def is_free(self, name: str) -> bool:
        """Whether a displacement such as `platform.tz` is not held."""
        node, _, dof = name.rpartition(".")
        topology = self.plan.topology
        return not topology.held[topology.root[topology.numbers([node])], DOF_NAMES.index(dof)].any()
