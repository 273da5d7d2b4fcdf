"""Cross-sections of members, and how those of flexures vary along their length.

Local x runs along the member, local z along the section's thickness. A contour gives the thickness h(xi) of a notch
that spans the member, xi measured from its middle.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from flexura.mechanism.base import Part, refuse
from flexura.mechanism.quantity import (
    Length,
    NonNegativeLength,
    PositiveAngle,
    PositiveArea,
    PositiveLength,
    PositiveNumber,
    SecondMoment,
    StrainPerVolt,
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


class CircularContour(Part):
    """Circular arcs of one radius on both faces, leaving a web between them. Right-circular when radius = length/2."""

    shape: Literal["circular"] = "circular"
    radius: PositiveLength
    web: PositiveLength


class EllipticalContour(Part):
    """Half ellipses on both faces; semi-axes are half the member's length and `depth`."""

    shape: Literal["elliptical"] = "elliptical"
    depth: NonNegativeLength
    web: PositiveLength


class ParabolicContour(Part):
    """Parabolas on both faces that are `depth` away from the web at the ends."""

    shape: Literal["parabolic"] = "parabolic"
    depth: NonNegativeLength
    web: PositiveLength


class HyperbolicContour(Part):
    """Hyperbolas on both faces that are `depth` away from the web at the ends."""

    shape: Literal["hyperbolic"] = "hyperbolic"
    depth: NonNegativeLength
    web: PositiveLength


class CornerFilletedContour(Part):
    """A straight web with circular fillets in its four corners."""

    shape: Literal["corner_filleted"] = "corner_filleted"
    fillet_radius: NonNegativeLength
    web: PositiveLength


class VShapedContour(Part):
    """Straight flanks at `angle` to the member axis, tangent to a root arc."""

    shape: Literal["v_shaped"] = "v_shaped"
    angle: PositiveAngle
    root_radius: NonNegativeLength
    web: PositiveLength


class TabulatedContour(Part):
    """Thickness at positions along the member (from its start), linear in between."""

    shape: Literal["table"] = "table"
    positions: tuple[Length, ...] = Field(min_length=2)
    thicknesses: tuple[PositiveLength, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _table(self) -> Self:
        if len(self.positions) != len(self.thicknesses):
            raise refuse("their numbers differ: a table has as many thicknesses as positions")
        known = [p for p in self.positions if isinstance(p, float)]
        if len(known) == len(self.positions) and any(b <= a for a, b in pairwise(known)):
            raise refuse("one is not behind the one before it: positions of a table increase")
        return self


class StraightContour(Part):
    """Constant thickness."""

    shape: Literal["straight"] = "straight"
    web: PositiveLength


Contour = Annotated[
    CircularContour
    | EllipticalContour
    | ParabolicContour
    | HyperbolicContour
    | CornerFilletedContour
    | VShapedContour
    | TabulatedContour
    | StraightContour,
    Field(discriminator="shape"),
]


def _ends(raw: Any) -> str:
    return "two" if isinstance(raw, list | tuple) else "one"


Tapering = Annotated[
    Annotated[PositiveLength, Tag("one")] | Annotated[tuple[PositiveLength, PositiveLength], Tag("two")],
    Discriminator(_ends),
]
"""A size all along, or those at the first and at the second end, linear in between."""


class Leaf(Part):
    """A leaf: `width` along local y, `thickness` along local z; a pair of sizes is that at both ends, linear in
    between."""

    type: Literal["leaf"] = "leaf"
    width: Tapering
    thickness: Tapering

    @property
    def tapers(self) -> bool:
        """Whether the sizes at both ends may differ."""
        return isinstance(self.width, tuple) or isinstance(self.thickness, tuple)


class Layer(Part):
    """One layer of a layered leaf."""

    thickness: PositiveLength
    material: str | None = None
    """A name from `materials`, or of the catalogue; None is that of the member."""
    free_strain: StrainPerVolt | None = None
    """Strain along the member that a volt causes where nothing holds it, 1/V, its sign by how the layer is poled."""


class Layered(Part):
    """A leaf of bonded layers across its thickness, the first one at the face towards -z: `width` along local y."""

    type: Literal["layered"] = "layered"
    width: PositiveLength
    layers: tuple[Layer, ...] = Field(min_length=1, max_length=100)


class Notch(Part):
    """A one-axis notch hinge: constant `width` along local y, thickness along local z by the contour."""

    type: Literal["notch"] = "notch"
    width: PositiveLength
    contour: Contour


class TwoAxisNotch(Part):
    """A two-axis hinge (U pair): contours on both pairs of faces.

    With `shift` zero both notches sit at the same place and both hinge axes cross there. Otherwise their
    centres are `shift` apart along the member (the y contour first); each notch is then `length - |shift|` long
    and keeps its full thickness outside, so that they overlap, or follow each other when shift is half the length.
    """

    type: Literal["two_axis"] = "two_axis"
    y_contour: Contour
    """Size along local y: bends about local z."""
    z_contour: Contour
    """Size along local z: bends about local y."""
    shift: Length = 0.0


class RoundNotch(Part):
    """A circular-symmetric hinge (S pair): a body of revolution whose diameter follows the contour."""

    type: Literal["round"] = "round"
    contour: Contour


Profile = Annotated[Leaf | Layered | Notch | TwoAxisNotch | RoundNotch, Field(discriminator="type")]
