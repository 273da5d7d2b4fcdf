"""Where a mechanism is driven and where its motion is read: actuators, sensors, and those of a modal test."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexura.mechanism.base import ORIGIN, Direction, Name, Part, Vector, refuse
from flexura.mechanism.body import OneOrTwo
from flexura.mechanism.quantity import (
    NonNegativeAcceleration,
    NonNegativeForce,
    NonNegativeMass,
    NonNegativeNumber,
    Number,
    PositiveForce,
    PositiveFrequency,
    PositiveLength,
    PositiveMoment,
    PositiveNumber,
    PositiveStiffness,
    PositiveStroke,
    PositiveTime,
    PositiveVoltage,
)
from flexura.mechanism.section import Section
from flexura.tables import quantity


class _Directed(Part):
    """At one node, or from the first of two to the second, along (or about) `direction`.

    Between two nodes the direction may be left out: it is then the line from the first to the second. What acts
    between two nodes acts on the second, and the opposite on the first; what is read between them is the second less
    the first.
    """

    nodes: OneOrTwo
    direction: Direction | None = None

    @model_validator(mode="after")
    def _has_direction(self) -> Self:
        if len(self.nodes) == 1 and self.direction is None:
            raise refuse("at a single node a direction is needed", "e.g. direction: z")
        return self


class ForceActuator(_Directed):
    """A force; input in N."""

    type: Literal["force"] = "force"
    limit: PositiveForce | None = None
    """Largest force in either sense, N."""


class MomentActuator(_Directed):
    """A moment about `direction`; input in N m."""

    type: Literal["moment"] = "moment"
    limit: PositiveMoment | None = None
    """Largest moment in either sense, N m."""


class BaseMotion(Part):
    """Everything that is grounded accelerates along `direction`; input in m/s^2.

    Displacements and velocities are then relative to the moving base, and accelerations absolute.
    """

    type: Literal["base"] = "base"
    direction: Direction


class BaseRotation(Part):
    """Everything that is grounded turns about `direction` through `point`; input in rad/s^2, small angles."""

    type: Literal["base_rotation"] = "base_rotation"
    direction: Direction
    point: Vector = ORIGIN


class PiezoStack(Part):
    """A piezo stack between two nodes; input is its free expansion, m, or with `gain` the voltage, V.

    It is a spring along the line between the nodes that would like to be longer: F = k (expansion - elongation).
    `section` says that it is bonded at both ends: it then also bends, twists and shears as a prism with its axial
    stiffness k = E A / L. Without, its tips are pivots.
    """

    type: Literal["piezo"] = "piezo"
    nodes: tuple[str, str]
    stiffness: PositiveStiffness
    """Axial stiffness k, short-circuited (driven by voltage), N/m."""
    free_stroke: PositiveLength | None = None
    """Largest expansion without load, m."""
    blocked_force: PositiveForce | None = None
    """Largest force at zero elongation, N: the stiffness times the free stroke."""
    gain: PositiveStroke | None = None
    """Free expansion per volt, m/V."""
    mass: NonNegativeMass = 0.0
    section: Section | None = None
    nu: Number = 0.3
    """Poisson's ratio of a bonded stack, for its shear modulus."""

    @model_validator(mode="after")
    def _one_range(self) -> Self:
        if self.free_stroke is not None and self.blocked_force is not None:
            raise refuse(
                "both are given: a piezo stack has free_stroke or blocked_force", "the other is the stiffness times it"
            )
        if isinstance(self.nu, float) and not -1 < self.nu <= 0.5:
            raise refuse("Poisson's ratio lies in -1 < nu <= 0.5")
        return self


class StrainActuator(Part):
    """The free strain of the layers of a leaf; input in V, or in K by which it is warmer.

    It would like to be longer and bent: the leaf resists by the force and the moment that block it.
    """

    type: Literal["strain"] = "strain"
    member: str
    """A flexure of the same substructure whose profile is layered."""
    by: Literal["voltage", "temperature"] = "voltage"
    """Whether layers strain by their `free_strain`, or by the expansion of their materials."""
    limit: PositiveVoltage | None = None
    """Largest voltage in either sense, V."""

    @model_validator(mode="after")
    def _has_volts(self) -> Self:
        if self.limit is not None and self.by != "voltage":
            raise refuse("a limit is a voltage", "leave it out")
        return self


Actuator = Annotated[
    ForceActuator | MomentActuator | BaseMotion | BaseRotation | PiezoStack | StrainActuator,
    Field(discriminator="type"),
]

MotionQuantity = Literal[
    "displacement", "velocity", "acceleration", "rotation", "angular_velocity", "angular_acceleration"
]


class MotionSensor(_Directed):
    """Reads a motion of a node, or of one against another, along (or about) `direction`."""

    type: MotionQuantity
    mass: NonNegativeMass = 0.0
    """Mass of the sensor, half on each node when there are two, kg."""


class ForceSensor(Part):
    """Reads the force that an actuator exerts on what it is built into, N: pushing apart is positive."""

    type: Literal["force"] = "force"
    actuator: str
    """An actuator of the same substructure: a piezo stack, or a force."""


Sensor = Annotated[MotionSensor | ForceSensor, Field(discriminator="type")]


LEAST_SAMPLES = 64
"""Samples in a record at least."""

LEAST_IN_PULSE = 4
"""Samples in a pulse at least."""


def _in_units(duration: float, rate: float) -> str:
    """A time at a sample rate, and how many samples it has."""
    count = f"{math.floor(1e3 * duration * rate * (1 + 1e-9)) / 1e3:.5g}"
    return f"{quantity(duration, 's')} at {quantity(rate, 'Hz')} has {count}"


class HammerPoint(Part):
    """Where a hammer hits: a place that moves rigidly with a node, and the direction of the force.

    `at` is a position in the axes of the mechanism; the node itself where it is left out.
    """

    node: str
    direction: Direction
    at: Vector | None = None


class Accelerometer(Part):
    """A sensor of acceleration along `direction` at a place that moves rigidly with a node, and its mass, kg."""

    node: str
    direction: Direction
    at: Vector | None = None
    mass: NonNegativeMass = 0.0


class ModalTest(Part):
    """A hammer test. Sensors are on the mechanism, with their mass, in their own placements only.

    Entries of `hammer` and `accelerometers` may also be names of forces among the actuators, and of sensors of
    acceleration, of the mechanism.
    """

    sample_rate: PositiveFrequency
    duration: PositiveTime
    """Length of a record, s."""
    pulse: PositiveTime
    """Length of the hammer pulse from zero to zero, s."""
    hammer: Annotated[dict[Name, HammerPoint | str], Field(min_length=1)]
    accelerometers: Annotated[dict[Name, Accelerometer | str], Field(min_length=1)]
    placements: dict[Name, tuple[str, ...]] = {}
    """Accelerometers of each step of the test; one placement of all where it is left out."""
    hits: Annotated[int, Field(ge=1, le=1000, strict=True)] = 5
    """Hits at every hammer point in every placement."""
    peak: PositiveForce = 10.0
    """Peak of the force, N."""
    peak_scatter: NonNegativeNumber = 0.1
    """Standard deviation of the peak from hit to hit, relative."""
    force_noise: NonNegativeForce = 0.0
    """Standard deviation of the noise of the hammer, N."""
    acceleration_noise: NonNegativeAcceleration = 0.0
    """Standard deviation of the noise of accelerometers, m/s^2."""
    exponential: PositiveNumber | None = None
    """Value at the end of the record of an exponential window."""
    force_window: PositiveTime | None = None
    """How long the force counts from the beginning of the pulse, s."""
    band: tuple[PositiveFrequency, PositiveFrequency] | None = None
    """Frequencies between which modes are identified, Hz."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        rate, duration, pulse = self.sample_rate, self.duration, self.pulse
        if isinstance(rate, float) and isinstance(duration, float) and rate * duration < LEAST_SAMPLES:
            text = f"a record of {_in_units(duration, rate)} samples; at least {LEAST_SAMPLES} are needed"
            raise refuse(text, "record longer or faster")
        if isinstance(rate, float) and isinstance(pulse, float) and rate * pulse < LEAST_IN_PULSE:
            text = f"a pulse of {_in_units(pulse, rate)} samples; at least {LEAST_IN_PULSE} are needed"
            raise refuse(text, "sample faster, or give a longer pulse")
        if isinstance(duration, float) and isinstance(pulse, float) and pulse > duration / 4:
            share = f"a pulse of {quantity(pulse, 's')} in a record of {quantity(duration, 's')}"
            raise refuse(f"{share}: it takes at most a quarter of it", "record longer, or give a shorter pulse")
        if isinstance(self.exponential, float) and self.exponential > 1:
            raise refuse("above 1 it would grow: the exponential window ends between 0 and 1", "e.g. exponential: 0.01")
        low, high = self.band or (0.0, 1.0)
        if isinstance(low, float) and isinstance(high, float) and low >= high:
            raise refuse("it is empty: a band is from a lower to a higher frequency")
        for name, members in self.placements.items():
            if not members:
                raise refuse(f"placement {name} holds no accelerometer")
            if len(set(members)) < len(members):
                raise refuse(f"placement {name} holds an accelerometer twice")
        return self

    def placed(self) -> dict[str, tuple[str, ...]]:
        """Accelerometers of every placement."""
        return dict(self.placements) or {"": tuple(self.accelerometers)}
