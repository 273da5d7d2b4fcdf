"""Where copies of something stand: turned, moved, and repeated by patterns."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from flexura.mechanism.base import ORIGIN, Direction, Part, Vector
from flexura.mechanism.body import Rotation
from flexura.mechanism.quantity import Angle

PatternCount = Annotated[int, Field(ge=1, le=100_000, strict=True)]


class CircularPattern(Part):
    """`count` copies, each turned by `step` (default: a full turn divided by `count`) about an axis."""

    type: Literal["circular"] = "circular"
    count: PatternCount
    axis: Direction = (0.0, 0.0, 1.0)
    centre: Vector = ORIGIN
    step: Angle | None = None


class MirrorPattern(Part):
    """The instance and its mirror image in a plane."""

    type: Literal["mirror"] = "mirror"
    normal: Direction
    point: Vector = ORIGIN


class LinearPattern(Part):
    """`count` copies, each moved on by `step`."""

    type: Literal["linear"] = "linear"
    count: PatternCount
    step: Vector


Pattern = Annotated[CircularPattern | MirrorPattern | LinearPattern, Field(discriminator="type")]


def _one_or_more(raw: Any) -> Any:
    return (raw,) if isinstance(raw, dict | Rotation | CircularPattern | MirrorPattern | LinearPattern) else raw


Turns = Annotated[tuple[Rotation, ...], BeforeValidator(_one_or_more)]
"""Rotations in the order given, one or several."""

Patterns = Annotated[tuple[Pattern, ...], BeforeValidator(_one_or_more)]
"""Patterns that apply one after the other."""

PLACE = ("at", "rotate", "pattern")
"""Fields that say where something stands."""
