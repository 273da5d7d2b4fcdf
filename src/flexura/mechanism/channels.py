"""Where a mechanism is driven and where its motion is read: actuators and sensors."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexura.mechanism.base import ORIGIN, Direction, Part, Vector, refuse
from flexura.mechanism.quantity import (
    NonNegativeMass,
    Number,
    PositiveForce,
    PositiveLength,
    PositiveMoment,
    PositiveStiffness,
    PositiveStroke,
)
from flexura.mechanism.section import Section

OneOrTwo = Annotated[tuple[str, ...], Field(min_length=1, max_length=2)]


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


Actuator = Annotated[
    ForceActuator | MomentActuator | BaseMotion | BaseRotation | PiezoStack, Field(discriminator="type")
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
