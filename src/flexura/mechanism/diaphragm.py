"""Diaphragms: thin rings in a plane that guide a hub in a rim, whole, or with slits or spokes."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from flexura.mechanism.base import Direction, Part, refuse
from flexura.mechanism.member import Fidelity, MeshSize
from flexura.mechanism.quantity import Angle, NonNegativeNumber, PositiveLength

AroundCount = Annotated[int, Field(ge=1, le=360, strict=True)]


class Slit(Part):
    """Slits of one width with round ends, `count` of them evenly around, each along a spiral between two points.

    A point is a radius and an angle from `reference`; the radius changes evenly with the angle: an arc where both radii
    are one, a straight radial slit where both angles are.
    """

    from_: Annotated[tuple[PositiveLength, Angle], Field(alias="from")]
    to: tuple[PositiveLength, Angle]
    width: PositiveLength
    count: AroundCount = 1


class Spokes(Part):
    """Straight spokes of one width, `count` of them evenly around, the first along `reference`; all else is open."""

    count: AroundCount
    width: PositiveLength


class Diaphragm(Part):
    """A flat ring between a rigid rim and a rigid hub: a plate in closed form, or a solid as those with openings are.

    Its centre is at the node of the hub, in the middle of its thickness; the node of the rim reaches it by a rigid arm.
    """

    nodes: tuple[str, str]
    """The node of the rim, and that of the hub."""
    material: str
    """A name from `materials`, or of the catalogue."""
    normal: Direction = (0.0, 0.0, 1.0)
    """Normal of its plane."""
    reference: Direction | None = None
    """Angles in its plane count from here, right-handed about the normal."""
    rim_diameter: PositiveLength
    """Diameter inside which it is free."""
    hub_diameter: PositiveLength
    """Diameter outside which it is free."""
    thickness: PositiveLength
    slits: tuple[Slit, ...] = ()
    spokes: Spokes | None = None
    fidelity: Fidelity | None = None
    """`solid` takes a part reduced from a three-dimensional mesh in place of the plate."""
    mesh_size: MeshSize | None = None
    """Length of the cells relative to the mesher's own choice; None takes the substructure's."""
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor; None takes the material's."""

    @model_validator(mode="after")
    def _openings(self) -> Self:
        if self.slits and self.spokes is not None:
            raise refuse("both are given: a diaphragm has either slits or spokes")
        if self.is_sheet and self.fidelity == "beam":
            raise refuse("slits and spokes are those of solids", "leave fidelity out")
        if (self.slits or self.spokes) and self.reference is None:
            raise refuse(
                "angles of slits and spokes count from `reference`, a direction in the plane, which is missing"
            )
        return self

    @property
    def is_sheet(self) -> bool:
        """Whether it is a solid sheet, and no plate in closed form."""
        return bool(self.slits) or self.spokes is not None or self.fidelity == "solid"

    @property
    def as_ring(self) -> Diaphragm:
        """The whole ring, as a plate."""
        return self.replaced({"slits": (), "spokes": None, "fidelity": None, "mesh_size": None})
