"""Members: links and flexures between two nodes, with ends that may sit off their nodes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from flexura.mechanism.base import ORIGIN, Direction, Part, Vector
from flexura.mechanism.corrections import Correction, Corrections, Ends, Fillet, Root
from flexura.mechanism.profile import Leaf, Notch, Profile
from flexura.mechanism.quantity import NonNegativeNumber
from flexura.mechanism.section import Circle, Rectangle, Section, SectionConstants, Tube

Theory = Literal["rayleigh", "timoshenko", "euler_bernoulli"]
Integration = Literal["stepped", "tapered"]
Fidelity = Literal["beam", "solid"]
Faces = Literal["rigid", "averaged", "flexible"]
MeshSize = Annotated[float, Field(ge=0.05, le=5, strict=True)]
ElementCount = Annotated[int, Field(ge=1, le=10_000, strict=True)]


class Member(Part):
    """What links and flexures share.

    The member runs from `nodes[0] + start_offset` to `nodes[1] + end_offset`; the offsets are rigid massless arms
    (the RPR paper, eqs. 21-24).
    """

    nodes: tuple[str, str]
    material: str
    """A name from `materials`, or of the catalogue."""
    reference: Direction | None = None
    """Lies in the plane of the member axis and local z, the direction of the section's thickness."""
    start_offset: Vector = ORIGIN
    end_offset: Vector = ORIGIN
    theory: Theory | None = None
    """Beam theory; None takes the mechanism's."""
    corrections: Corrections | None = None
    """What is added to beam theory; None takes the mechanism's."""
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor; None takes the material's."""
    ends: Ends | None = None
    """Whether the end sections are held flat, so that they neither warp nor curl; None works it out."""
    root: Root = ("elastic", "elastic")
    """Whether the thicker part that an end is in gives there; `rigid` for a clamp that does not."""
    fillet: Fillet = (0.0, 0.0)
    """Radius of the fillets with which the ends run into the thicker part that they are in."""
    fidelity: Fidelity | None = None
    """`solid` takes a part reduced from a three-dimensional mesh in place of beam elements; None takes the
    substructure's."""
    mesh_size: MeshSize | None = None
    """Length of the cells of a solid member relative to the mesher's own choice; None takes the substructure's."""
    faces: Faces = "rigid"
    """How the end faces of a solid member follow its nodes: as they are, on average, or with deformations of their
    own."""


class Link(Member):
    """A uniform beam, cut into `elements` elements."""

    section: Section | str
    """A section, or the name of one in `sections`."""
    elements: ElementCount = 3


class Flexure(Member):
    """A flexure, cut into `elements` elements of equal length.

    `stepped` gives every element the uniform section at its middle, as the paper does; `tapered` integrates
    the varying section inside every element.
    """

    profile: Profile
    elements: ElementCount = 10
    integration: Integration = "stepped"


def possible_corrections(form: Section | Profile, theory: Theory) -> frozenset[Correction]:
    """Corrections that mean something for a section or profile under a beam theory."""
    names: set[Correction] = set() if theory == "euler_bernoulli" else {"shear"}
    if isinstance(form, Rectangle | Leaf | Notch):
        names |= {"plate", "warping"}
    if not isinstance(form, Rectangle | Circle | Tube | SectionConstants | Leaf):
        names.add("notch")
    if not isinstance(form, Tube | SectionConstants):
        names.add("root")
    return frozenset(names)
