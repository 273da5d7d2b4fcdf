"""The stroke of a mechanism: what moves from where to where, and what comes on along the way."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Self

from pydantic import BeforeValidator, Field, model_validator

from flexura.mechanism.base import Part, refuse
from flexura.mechanism.loads import Load
from flexura.mechanism.pose import OneKind
from flexura.mechanism.quantity import Angle, Force, Length, Moment, Voltage


def _ends(raw: Any) -> Any:
    """One value stands for one pose."""
    return raw if isinstance(raw, list | tuple) else (raw,)


_ONE_OR_TWO = (Field(min_length=1, max_length=2), BeforeValidator(_ends))

LengthRange = Annotated[tuple[Length, ...], *_ONE_OR_TWO]
AngleRange = Annotated[tuple[Angle, ...], *_ONE_OR_TWO]
ForceRange = Annotated[tuple[Force, ...], *_ONE_OR_TWO]
MomentRange = Annotated[tuple[Moment, ...], *_ONE_OR_TWO]
VoltageRange = Annotated[tuple[Voltage, ...], *_ONE_OR_TWO]


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
