"""Cross-sections of members. Local x runs along the member, local z along the section's thickness."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexura.mechanism.base import Part, refuse
from flexura.mechanism.quantity import (
    NonNegativeLength,
    PositiveArea,
    PositiveLength,
    PositiveNumber,
    SecondMoment,
)


class Rectangle(Part):
    """A solid rectangle: `width` along local y, `thickness` along local z."""

    shape: Literal["rectangle"] = "rectangle"
    width: PositiveLength
    thickness: PositiveLength


class Circle(Part):
    """A solid circle."""

    shape: Literal["circle"] = "circle"
    diameter: PositiveLength


class Tube(Part):
    """A circular tube."""

    shape: Literal["tube"] = "tube"
    outer_diameter: PositiveLength
    inner_diameter: NonNegativeLength

    @model_validator(mode="after")
    def _hollow(self) -> Self:
        outer, inner = self.outer_diameter, self.inner_diameter
        if isinstance(outer, float) and isinstance(inner, float) and inner >= outer:
            raise refuse("there is no wall: the inner diameter of a tube is smaller than the outer one")
        return self


class SectionConstants(Part):
    """A section of any form, given by its constants."""

    shape: Literal["constants"] = "constants"
    A: PositiveArea
    """Area, m^2."""
    Iy: SecondMoment
    """Second moment of area about local y, m^4 (bending in the local xz plane)."""
    Iz: SecondMoment
    """Second moment of area about local z, m^4 (bending in the local xy plane)."""
    J: SecondMoment
    """Saint-Venant torsion constant, m^4; not the polar second moment."""
    ky: PositiveNumber = 1.0
    """Shear coefficient for shear along local y."""
    kz: PositiveNumber = 1.0
    """Shear coefficient for shear along local z."""


Section = Annotated[Rectangle | Circle | Tube | SectionConstants, Field(discriminator="shape")]
ROUND_SECTIONS = (Circle, Tube)
"""Sections whose orientation about the member axis does not matter."""
