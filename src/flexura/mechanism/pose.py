"""The pose about which a mechanism is described: displacements that are prescribed, however large."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from flexura.mechanism.base import Part, refuse
from flexura.mechanism.quantity import Angle, Length

DISPLACEMENTS = ("x", "y", "z", "rx", "ry", "rz")
"""Names of displacements along and about the global axes."""


class Displacement(Part):
    """Where a node is held from rest, global axes: displacements, m, and components of its rotation vector, rad. What
    is left out stays free."""

    x: Length | None = None
    y: Length | None = None
    z: Length | None = None
    rx: Angle | None = None
    ry: Angle | None = None
    rz: Angle | None = None

    @model_validator(mode="after")
    def _something(self) -> Self:
        if all(getattr(self, axis) is None for axis in DISPLACEMENTS):
            raise refuse("a displacement names at least one axis", "e.g. {y: 5 mm}")
        return self
