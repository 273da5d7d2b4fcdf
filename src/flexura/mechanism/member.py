"""Members: links and flexures between two nodes, with ends that may sit off their nodes; their corrections beyond beam
theory, and how their ends are held."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field

from flexura.errors import did_you_mean
from flexura.mechanism.base import ORIGIN, Direction, Part, Vector, refuse
from flexura.mechanism.quantity import NonNegativeLength, NonNegativeNumber
from flexura.mechanism.section import Circle, Layered, Leaf, Notch, Profile, Rectangle, Section, SectionConstants, Tube

Correction = Literal["plate", "warping", "shear", "notch", "root"]
CORRECTIONS: tuple[Correction, ...] = get_args(Correction)
_RULE = f"corrections are auto, none, or a list of some of {', '.join(CORRECTIONS)}"
_ROOT = "root is elastic or rigid, for both ends or as a pair, the first for the first node, as in [rigid, elastic]"
_FILLET = "fillet is a radius, for both ends or as a pair, the first for the first node, as in [0 mm, 1 mm]"
_ENDS = "ends are two of clamped and free, the first for the first node, as in [clamped, free]"


def _corrections(raw: Any) -> Any:
    if raw in ("auto", "none") and isinstance(raw, str):
        return raw
    names = (raw,) if isinstance(raw, str) else raw
    if not isinstance(names, list | tuple) or not names or not all(isinstance(name, str) for name in names):
        raise refuse(_RULE, "corrections: none leaves beam theory as it is")
    for name in names:
        if name not in CORRECTIONS:
            known = (*CORRECTIONS, "auto", "none")
            raise refuse(_RULE, did_you_mean(name, known, f"{name!r} is none of them", quoted=False))
    if len(set(names)) < len(names):
        raise refuse("one is named twice: every correction is named once")
    return tuple(names)


def _ends(raw: Any) -> Any:
    if raw is None or (
        isinstance(raw, list | tuple) and len(raw) == 2 and all(end in ("clamped", "free") for end in raw)
    ):
        return raw
    raise refuse(_ENDS)


def _root(raw: Any) -> Any:
    kinds = [raw, raw] if isinstance(raw, str) else raw
    if isinstance(kinds, list | tuple) and len(kinds) == 2 and all(kind in ("elastic", "rigid") for kind in kinds):
        return tuple(kinds)
    raise refuse(_ROOT)


def _fillet(raw: Any) -> Any:
    pair = raw if isinstance(raw, list | tuple) else [raw, raw]
    if len(pair) != 2:
        raise refuse(_FILLET)
    return tuple(pair)


Corrections = Annotated[Literal["auto", "none"] | tuple[Correction, ...], BeforeValidator(_corrections)]
"""`auto`, `none`, or the names of corrections that apply whatever the theory says of itself."""
End = Literal["clamped", "free"]
Ends = Annotated[tuple[End, End], BeforeValidator(_ends)]
RootKind = Literal["elastic", "rigid"]
Fillet = Annotated[tuple[NonNegativeLength, NonNegativeLength], BeforeValidator(_fillet)]
Root = Annotated[tuple[RootKind, RootKind], BeforeValidator(_root)]


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
    the varying section inside every element. None is `tapered` for a leaf that tapers, otherwise `stepped`.
    """

    profile: Profile
    elements: ElementCount = 10
    integration: Integration | None = None


def possible_corrections(form: Section | Profile, theory: Theory) -> frozenset[Correction]:
    """Corrections that mean something for a section or profile under a beam theory."""
    names: set[Correction] = set() if theory == "euler_bernoulli" else {"shear"}
    if isinstance(form, Rectangle | Leaf | Layered | Notch):
        names |= {"warping"} if isinstance(form, Layered) else {"plate", "warping"}
    if (
        form.tapers
        if isinstance(form, Leaf)
        else not isinstance(form, Layered | Rectangle | Circle | Tube | SectionConstants)
    ):
        names.add("notch")
    if not isinstance(form, Tube | SectionConstants | Layered):
        names.add("root")
    return frozenset(names)
