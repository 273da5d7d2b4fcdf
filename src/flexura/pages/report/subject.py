"""What a report is about: a mechanism, its plan, results that sections share, and commands that make numbers again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from flexura.analysis import Kinetostatics, Modes, kinetostatics, modes
from flexura.expressions import Expression
from flexura.full_order import assemble
from flexura.mechanism import (
    DOF_NAMES,
    Layout,
    Mechanism,
    MotionSensor,
    command_of,
    is_rotation,
    parameter_dimensions,
)
from flexura.structure import FullOrderModel, InputPort, Plan, Ports
from flexura.units import format_number, format_quantity

POSED = {
    "displacement": "m",
    "rotation": "rad",
    "expansion": "m",
    "voltage": "V",
    "temperature": "K",
    "force": "N",
    "moment": "N*m",
}


@dataclass(frozen=True)
class Commands:
    """What makes numbers of one mechanism again, with its parameters and its pose as a command line has them."""

    file: Path | None
    settings: tuple[str, ...]
    pose: tuple[str, ...]

    @staticmethod
    def of(
        mechanism: Mechanism, file: Path | None, parameters: Mapping[str, float], at: Mapping[str, float]
    ) -> Commands:
        """Those of a mechanism from a file, with parameters and a pose in SI."""
        dimensions = parameter_dimensions(mechanism.parameters)
        settings = [f"{name}={_quantity(value, dimensions.get(name))}" for name, value in parameters.items()]
        layout = Layout(mechanism)
        pose = []
        for name, value in at.items():
            own = next(map(command_of, layout.commanded(name).values()), None)
            kind = own or ("rotation" if is_rotation(name) else "displacement")
            pose.append(f"{name}={format_number(value)} {POSED[kind]}")
        return Commands(file, tuple(settings), tuple(pose))

    def __call__(self, verb: str, options: Sequence[str] = (), python: str = "", *, posed: bool = True) -> str:
        """The command of a verb with its options; `python` are the same options as arguments. Verbs that know of no
        pose go without."""
        if self.file is None:
            given = ", ".join(part for part in ("mechanism, parameters", python) if part)
            return f"fx.{verb.replace('-', '_')}({given})"
        words = ["flexura", verb, str(self.file), *options]
        for setting in self.settings:
            words += ["--set", setting]
        for own in self.pose if posed else ():
            words += ["--at", own]
        return shlex.join(words)


def _quantity(value: float, dimension: object) -> str:
    return format_number(value) if dimension is None else format_quantity(value, dimension)  # type: ignore[arg-type]


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
