"""The pose about which a mechanism is described: displacements and commands that are prescribed, however large."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import model_validator

from flexura.mechanism.base import Part, refuse
from flexura.mechanism.channels import Actuator, MomentActuator, PiezoStack
from flexura.mechanism.quantity import Angle, Force, Length, Moment, Voltage

DISPLACEMENTS = ("x", "y", "z", "rx", "ry", "rz")
"""Names of displacements along and about the global axes."""

COMMANDS = ("expansion", "voltage", "force", "moment")
"""Names of the commands of actuators."""


class OneKind(Part):
    """Either displacements of a node, or the command of an actuator."""

    EXAMPLE: ClassVar[str]

    @property
    def given(self) -> tuple[str, ...]:
        """Names of what is given."""
        return tuple(name for name in (*DISPLACEMENTS, *COMMANDS) if getattr(self, name) is not None)

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        commands = [name for name in self.given if name in COMMANDS]
        if not self.given or (commands and len(self.given) > 1):
            raise refuse("either displacements of a node or one command of an actuator", self.EXAMPLE)
        return self


class Prescribed(OneKind):
    """Where a node is held from rest, global axes: displacements, m, and components of its rotation vector, rad; what
    is left out stays free.

    Or the command of an actuator: the free expansion of a piezo stack, m, or its voltage, V, where it has a gain; a
    force, N; a moment, N m.
    """

    EXAMPLE: ClassVar[str] = "e.g. {y: 5 mm}, or {expansion: 10 um}"

    x: Length | None = None
    y: Length | None = None
    z: Length | None = None
    rx: Angle | None = None
    ry: Angle | None = None
    rz: Angle | None = None
    expansion: Length | None = None
    voltage: Voltage | None = None
    force: Force | None = None
    moment: Moment | None = None


def command_of(actuator: Actuator) -> str | None:
    """Name of the command of an actuator; None where it moves the base."""
    if isinstance(actuator, PiezoStack):
        return "expansion" if actuator.gain is None else "voltage"
    if isinstance(actuator, MomentActuator):
        return "moment"
    return "force" if actuator.type == "force" else None
