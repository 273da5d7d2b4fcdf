"""Flat springs: sheets of any outline, held along edges and round holes."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from flexura.mechanism.base import ORIGIN, Direction, Part, Vector, refuse
from flexura.mechanism.member import MeshSize
from flexura.mechanism.planar import Corners, Hole, Side
from flexura.mechanism.quantity import NonNegativeNumber, PositiveLength

Number = Annotated[int, Field(ge=1, le=10_000, strict=True)]


class Pad(Part):
    """Edges and holes, by their numbers from 1, that one node holds rigidly.

    The first edge of an outline leads from its first corner to the second, the last one back to the first.
    """

    edges: tuple[Number, ...] = ()
    holes: tuple[Number, ...] = ()

    @model_validator(mode="after")
    def _some(self) -> Self:
        if not self.edges and not self.holes:
            raise refuse("a pad has edges or holes", "edges: [1]")
        return self


class FlatSpring(Part):
    """A sheet of one thickness with an outline in its plane, as a solid; its pads are rigid and follow nodes by rigid
    arms."""

    pads: dict[str, Pad] = Field(min_length=1)
    """What holds it, by the name of the node."""
    material: str
    """A name from `materials`, or of the catalogue."""
    normal: Direction = (0.0, 0.0, 1.0)
    """Normal of its plane, which lies in the middle of its thickness."""
    reference: Direction
    """First axis of the plane; the second one is right-handed about the normal."""
    origin: Vector = ORIGIN
    """Where the axes of the plane begin, m."""
    outline: Corners
    """In its plane."""
    holes: tuple[Hole, ...] = ()
    thickness: PositiveLength
    mesh_size: MeshSize | None = None
    """Length of the cells relative to the mesher's own choice; None takes the substructure's."""
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor; None takes the material's."""

    @model_validator(mode="after")
    def _no_names(self) -> Self:
        if any(isinstance(own, Side | Hole) and own.name for own in (*self.outline, *self.holes)):
            raise refuse("edges and holes of a flat spring have numbers: names are those of faces of parts")
        return self

    @property
    def nodes(self) -> tuple[str, ...]:
        """Nodes that hold it."""
        return tuple(self.pads)
