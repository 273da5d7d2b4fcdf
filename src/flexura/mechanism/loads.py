"""Dead loads and gravity: what a mechanism carries at rest."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, ValidationInfo, model_validator

from flexura.mechanism.base import Part, axis_direction, refuse
from flexura.mechanism.quantity import CONTEXT_KEY, Acceleration, Force, Moment

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
