"""Parts that are made elsewhere: solids in files of CAD or meshes, and the faces at which others meet them."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flexura.mechanism.base import ORIGIN, Direction, Name, Text, Vector, refuse
from flexura.mechanism.base import Part as Described
from flexura.mechanism.patterns import Patterns, Turns
from flexura.mechanism.planar import AnyHole, Corners
from flexura.mechanism.quantity import Length, NonNegativeNumber, PositiveFrequency, PositiveLength

FaceNumber = Annotated[int, Field(ge=1, strict=True)]
Colour = Annotated[str, Field(pattern=r"^#[0-9a-fA-F]{6}$")]
MESH_UNITS = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 25.4e-3}
"""Units of length of meshes, m."""

CHOICES = ("face", "colour", "x", "y", "z", "normal", "radius", "near")


class Interface(Described):
    """Faces of a part that move with one node, in the axes of its file; all that is said of them holds for each.

    Of `near` the nearest of them is meant. The node is called by the part and the interface, as in `bracket.left`.
    """

    face: FaceNumber | tuple[FaceNumber, ...] | Text | None = None
    """Name, that of a set of a mesh too, or number, or a list of numbers, as `flexura faces` shows them."""
    colour: Colour | None = None
    """Colour in the file, such as `#ff0000`."""
    x: Length | None = None
    """In the plane of this x."""
    y: Length | None = None
    z: Length | None = None
    normal: Direction | None = None
    """Plane, and looking outwards along this direction."""
    radius: PositiveLength | None = None
    """Part of a cylinder of this radius."""
    near: Vector | None = None
    """The nearest to this point."""
    at: Vector | None = None
    """Where the node is; by default in the middle of the faces."""
    follow: Literal["rigid", "averaged"] | None = None
    """Whether all of it moves rigidly with the node, or on the mean; by default rigid where the ground clamps the node,
    else averaged."""

    @model_validator(mode="after")
    def _chosen(self) -> Self:
        if all(getattr(self, name) is None for name in CHOICES):
            raise refuse(f"nothing says which face it is: give {', '.join(CHOICES[:-1])} or {CHOICES[-1]}")
        return self


class SolidPart(Described):
    """One solid, or several that touch, from a STEP file, a drawing or an outline with a thickness, or a mesh; a node
    for each
    interface.

    It is turned by `rotate` about the origin of the file, moved to `at` and repeated by `pattern`, as instances are.
    It is linear inside, and reduced to its interfaces and its lowest modes with these held.
    """

    step: Text | None = None
    """A STEP file."""
    drawing: Text | None = None
    """In place of it a DXF or SVG drawing of the outline of a planar part, whose layers name faces."""
    outline: Corners | None = None
    """In place of both the outline of a planar part, whose sides name faces."""
    holes: tuple[AnyHole, ...] = ()
    """In that outline."""
    mesh: Text | None = None
    """Or a solid mesh, taken as it is: Abaqus and CalculiX .inp, Nastran .bdf, .nas or .dat, or what meshio reads, as
    .med and .vtu."""
    unit: Literal["um", "mm", "cm", "m", "in"] | None = None
    """Of the coordinates of a mesh, which its file does not say."""
    thickness: PositiveLength | None = None
    """Of a planar part, from z = 0 up."""
    offset: Length = 0.0
    """By how much the outline of a planar part is larger than drawn, on all sides: what a wire leaves, or takes."""
    material: str
    at: Vector = ORIGIN
    rotate: Turns = ()
    pattern: Patterns = ()
    solids: dict[str, str] = {}
    """Materials of solids that have another one, by their names in the file, of a mesh by those of sets of cells."""
    interfaces: dict[Name, Interface] = Field(min_length=1)
    up_to: PositiveFrequency | None = None
    """Frequency up to which the modes of the mechanism are to be right."""
    mesh_tolerance: Annotated[float, Field(gt=1e-5, lt=0.5)] = 1.5e-2
    """How far frequencies may be off for the mesh, relative, as two orders and a recovered stress estimate it."""
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor; by default that of the material."""

    @property
    def file(self) -> str:
        """The file that it is made in; empty of one with an outline."""
        return self.step or self.drawing or self.mesh or ""

    @model_validator(mode="after")
    def _one_file(self) -> Self:
        if sum(own is not None for own in (self.step, self.drawing, self.outline, self.mesh)) != 1:
            raise refuse("a part has one of these: a step, a drawing, an outline or a mesh")
        if (self.mesh is None) != (self.unit is None):
            rule = "a mesh has a unit of length, which its file does not say, and nothing else has one"
            raise refuse(rule, "unit: mm, as most have, or um, cm, m, in")
        is_planar = self.drawing is not None or self.outline is not None
        if is_planar != (self.thickness is not None):
            raise refuse("a drawing or an outline has a thickness, and nothing else has one")
        if not is_planar and self.offset != 0.0:
            raise refuse("an outline has an offset, and nothing else has one")
        if self.outline is None and self.holes:
            raise refuse("holes are those of an outline that is written here")
        return self
