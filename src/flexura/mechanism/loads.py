"""What a mechanism carries, and where it is moved: dead loads and gravity, the pose it is described at, its stroke."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Self

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from flexura.mechanism.base import Part, axis_direction, refuse
from flexura.mechanism.channels import Actuator, MomentActuator, PiezoStack, StrainActuator
from flexura.mechanism.quantity import (
    CONTEXT_KEY,
    Acceleration,
    Angle,
    Force,
    Length,
    Moment,
    Number,
    Temperature,
    Voltage,
)
from flexura.mechanism.temperatures import Warming

STANDARD_GRAVITY = 9.80665
"""m/s^2, of a gravity that is given as a direction alone (CGPM 1901)."""


class Load(Part):
    """A force and a moment at a node, in global axes: a dead load, which keeps its size and direction.

    One of both is given, and may be zero.
    """

    force: tuple[Force, Force, Force] = (0.0, 0.0, 0.0)
    moment: tuple[Moment, Moment, Moment] = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.model_fields_set:
            raise refuse("nothing is given: a load has a force or a moment", "e.g. {force: [0, 0, -20 N]}")
        return self


def _of_direction(raw: Any, info: ValidationInfo) -> Any:
    """A direction by its name stands for standard gravity along it."""
    if not isinstance(raw, str):
        return raw
    unit = " m/s^2" if CONTEXT_KEY in (info.context or {}) else ""
    return tuple(f"{STANDARD_GRAVITY * c}{unit}" if c else 0.0 for c in axis_direction(raw))


Gravity = Annotated[tuple[Acceleration, Acceleration, Acceleration], BeforeValidator(_of_direction)]
"""Acceleration of free fall, m/s^2, global axes; in a file also `-z` and so on, for 9.80665 m/s^2 that way."""


DISPLACEMENTS = ("x", "y", "z", "rx", "ry", "rz")
"""Names of displacements along and about the global axes."""

FORCES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
"""Names of forces and moments along and about the global axes."""

COMMANDS = ("expansion", "voltage", "force", "moment", "temperature", "share")
"""Names of the commands of actuators and of states of temperature."""


class OneKind(Part):
    """Either what a node is moved by, or the command of an actuator."""

    EXAMPLE: ClassVar[str]

    @property
    def given(self) -> tuple[str, ...]:
        """Names of what is given."""
        return tuple(name for name in (*DISPLACEMENTS, *FORCES, *COMMANDS) if getattr(self, name, None) is not None)

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        commands = [name for name in self.given if name in COMMANDS]
        if not self.given or (commands and len(self.given) > 1):
            raise refuse("either displacements of a node or one command of an actuator", self.EXAMPLE)
        return self


class Prescribed(OneKind):
    """Where a node is held from rest, global axes: displacements, m, and components of its rotation vector, rad; what
    is left out stays free. Dead forces, N, and moments, N m, act on it beside those of `loads`.

    Or the command of an actuator: the free expansion of a piezo stack, m, or its voltage, V, where it has a gain; a
    force, N; a moment, N m; the voltage of layers, V, or by how much they are warmer, K. Or of a state of temperature
    by its name the share of it; of `temperature` by how much everything is warmer, K.
    """

    EXAMPLE: ClassVar[str] = "e.g. {y: 5 mm}, or {expansion: 10 um}"

    x: Length | None = None
    y: Length | None = None
    z: Length | None = None
    rx: Angle | None = None
    ry: Angle | None = None
    rz: Angle | None = None
    Fx: Force | None = None
    Fy: Force | None = None
    Fz: Force | None = None
    Mx: Moment | None = None
    My: Moment | None = None
    Mz: Moment | None = None
    expansion: Length | None = None
    voltage: Voltage | None = None
    force: Force | None = None
    moment: Moment | None = None
    temperature: Temperature | None = None
    share: Number | None = None


def command_of(actuator: Actuator | Warming) -> str | None:
    """Name of the command of an actuator or a state of temperature; None where it moves the base."""
    if isinstance(actuator, Warming):
        return actuator.command
    if isinstance(actuator, PiezoStack):
        return "expansion" if actuator.gain is None else "voltage"
    if isinstance(actuator, StrainActuator):
        return actuator.by
    if isinstance(actuator, MomentActuator):
        return "moment"
    return "force" if actuator.type == "force" else None


def _ends(raw: Any) -> Any:
    """One value stands for one pose."""
    return raw if isinstance(raw, list | tuple) else (raw,)


_ONE_OR_TWO = (Field(min_length=1, max_length=2), BeforeValidator(_ends))

LengthRange = Annotated[tuple[Length, ...], *_ONE_OR_TWO]
AngleRange = Annotated[tuple[Angle, ...], *_ONE_OR_TWO]
ForceRange = Annotated[tuple[Force, ...], *_ONE_OR_TWO]
MomentRange = Annotated[tuple[Moment, ...], *_ONE_OR_TWO]
VoltageRange = Annotated[tuple[Voltage, ...], *_ONE_OR_TWO]
NumberRange = Annotated[tuple[Number, ...], *_ONE_OR_TWO]
TemperatureRange = Annotated[tuple[Temperature, ...], *_ONE_OR_TWO]


class Moved(OneKind):
    """What a node is moved by from rest, or the command of an actuator, as `Prescribed`: one value, or from one to
    another."""

    EXAMPLE: ClassVar[str] = "e.g. {y: [-5 mm, 5 mm]}, or {expansion: [0, 10 um]}"

    x: LengthRange | None = None
    y: LengthRange | None = None
    z: LengthRange | None = None
    rx: AngleRange | None = None
    ry: AngleRange | None = None
    rz: AngleRange | None = None
    expansion: LengthRange | None = None
    voltage: VoltageRange | None = None
    force: ForceRange | None = None
    moment: MomentRange | None = None
    temperature: TemperatureRange | None = None
    share: NumberRange | None = None


class Motion(Part):
    """A stroke, in `steps` poses at equal distances."""

    move: dict[str, Moved] = {}
    """What is moved, by node, and commands by actuator."""
    loads: dict[str, Load] = {}
    """Dead loads that come on along the way, by node, global axes."""
    follower: dict[str, Load] = {}
    """Loads that come on along the way and turn with their nodes."""
    steps: Annotated[int, Field(ge=2, strict=True)] = 21
    modes: Annotated[int, Field(ge=1, strict=True)] = 6
    """Modes at each pose."""
    nodes: tuple[str, ...] = ()
    """Nodes whose displacements are told; those that move where it is left out."""

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not (self.move or self.loads or self.follower):
            raise refuse(
                "nothing moves: a motion has move, loads or follower", "e.g. move: {carriage: {y: [-5 mm, 5 mm]}}"
            )
        return self
