"""What a designer wishes: freedoms about a point, strokes, the room there is, how it is driven and made."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from flexura.arrays import Array
from flexura.expressions import Expression
from flexura.mechanism import (
    CATALOGUE,
    Direction,
    Label,
    Length,
    Name,
    Part,
    PositiveAngle,
    PositiveForce,
    PositiveLength,
    PositiveMass,
    PositiveStiffness,
    Question,
    Scalar,
    Vector,
    refuse,
)
from flexura.screws import ScrewSpace

DOFS = ("x", "y", "z", "rx", "ry", "rz")

LEAST_GAP = 10.0
"""How many times as compliant the stiffest wished freedom is to be as the softest constraint, where nothing is said."""

WITHIN_YIELD = "within yield"
"""What is required of a stroke where nothing else is."""

Process = Literal["wire-cut", "milled", "printed", "assembled"]

MOST_TURNED = 0.5
"""Rad to either side."""

ROOM = 0.02
"""Clearance to the faces of the envelope, over its smallest side."""


WIRE_RADIUS = 0.15e-3
"""Radius of the corners that a wire cuts, its gap included, m."""
CERAMIC = 7800.0
"""Density of the ceramic of stacks, kg/m^3."""


class Stack(NamedTuple):
    """A piezo stack: its largest expansion without load, m, stiffness, N/m, length and edge, m, and mass, kg."""

    free_stroke: float
    stiffness: float
    length: float
    edge: float
    mass: float


STACK = Stack(15e-6, 50e6, 18e-3, 5e-3, CERAMIC * 18e-3 * 5e-3**2)
"""An ordinary multilayer stack: about a thousandth of its length, 750 N blocked."""


def si(value: Scalar) -> float:
    """A number of a wish, which has no parameters."""
    return float(value)  # type: ignore[arg-type]


def _dof(raw: Any) -> Any:
    return raw[1:] if isinstance(raw, str) and re.fullmatch(r"t[xyz]", raw) else raw


Dof = Annotated[Literal["x", "y", "z", "rx", "ry", "rz"], BeforeValidator(_dof)]


def _pitch(raw: Any, read: ValidatorFunctionWrapHandler) -> Scalar:
    return np.inf if raw in ("infinite", np.inf) else read(raw)


class Wished(Part):
    """Part of a wish, which has no parameters."""

    @model_validator(mode="after")
    def _numbers(self) -> Self:
        for name, value in self:
            for own in value if isinstance(value, tuple) else (value,):
                if isinstance(own, Expression):
                    raise refuse(f"{name}: {own} is no number, and a wish has no parameters")
        return self


class WishedScrew(Wished):
    """A freedom along and about an axis through a point, about which a turn of one radian advances by the pitch; one of
    `infinite` pitch is a translation."""

    axis: Direction
    point: Vector = (0.0, 0.0, 0.0)
    pitch: Annotated[Length, WrapValidator(_pitch)] = 0.0

    @property
    def turns(self) -> bool:
        """Whether it turns."""
        return bool(np.isfinite(si(self.pitch)))

    def twist(self, about: Array) -> Array:
        """The motion (6,) of a point by one radian, or by one metre."""
        d = np.array(self.axis, dtype=float)
        d /= np.linalg.norm(d)
        if not self.turns:
            return np.array([*d, 0.0, 0.0, 0.0])
        arm = about - np.array(self.point, dtype=float)
        return np.array([*(np.cross(d, arm) + si(self.pitch) * d), *d])


class WishedFreedoms(Wished):
    """What is to be free: displacements of the platform about the point of the wish, or screws."""

    platform: Annotated[tuple[Dof, ...], Field(max_length=6)] | None = None
    screws: dict[Name, WishedScrew] = {}

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.platform is None) == (not self.screws):
            raise refuse("freedoms are those of the platform or screws", "e.g. {platform: [rx, ry, z]}")
        if self.platform is not None and len(set(self.platform)) < len(self.platform):
            raise refuse("a freedom is named twice")
        return self


_LENGTH, _ANGLE = TypeAdapter(PositiveLength), TypeAdapter(PositiveAngle)


def _amount(raw: Any, info: ValidationInfo) -> Any:
    """What is given, as a length and as an angle, as far as it is one."""
    found = {}
    for turns, own in ((False, _LENGTH), (True, _ANGLE)):
        with suppress(ValidationError, TypeError):
            found[turns] = si(own.validate_python(raw, context=info.context))
    if not found:
        raise refuse("a stroke is a length or an angle, positive and with its unit", "e.g. 0.5 mm or 2 deg")
    return found


Amount = Annotated[dict[bool, float], BeforeValidator(_amount)]
"""A stroke by whether it turns."""


def _by_dof(raw: Any) -> Any:
    return {_dof(name): value for name, value in raw.items()} if isinstance(raw, dict) else raw


class Base(Wished):
    """Where it is held: the face of the envelope that the base is, which is a coordinate plane. Posts stand on it. With
    a `frame` the base is around the envelope as well, and holds limbs that lead sideways."""

    plane: Literal["x-", "x+", "y-", "y+", "z-", "z+"] = "z-"
    frame: bool = False


def _in_catalogue(material: str) -> None:
    if material not in CATALOGUE:
        raise refuse(f"{material} is no material of the catalogue", f"one of {', '.join(CATALOGUE)}")


class Platform(Wished):
    """What is moved: a cylinder along the normal of the base, or a box along global axes, of the material of the rest
    or of one of its own; and what it carries as well, as a mass in its middle."""

    shape: Literal["cylinder", "box"] = "cylinder"
    size: Annotated[tuple[PositiveLength, ...], Field(min_length=2, max_length=3)] | None = None
    """Diameter and length, or three edges; by default from the envelope."""
    at: Vector | None = None
    """Its middle; by default as far from the base as the envelope allows."""
    material: str | None = None
    mass: PositiveMass | None = None

    @model_validator(mode="after")
    def _sized(self) -> Self:
        if self.size is not None and len(self.size) != (2 if self.shape == "cylinder" else 3):
            raise refuse("a cylinder has a diameter and a length, a box three edges")
        if self.material is not None:
            _in_catalogue(self.material)
        return self


_DRIVES = re.compile(r"(\d+)\s+(voice coil|piezo stack)s?\s+along\s+([xyz](?:\s+and\s+[xyz])?)")


class Drives(Wished):
    """So many drives of one kind along one axis, evenly around the middle of the platform where there are several, or
    by turns along two axes of the base.

    Piezo stacks are what their data sheets say: two of free stroke, blocked force and stiffness, the length, the edge
    of their square section and the mass. Without any of these they are ordinary multilayer stacks.
    """

    kind: Literal["voice coil", "piezo stack"]
    count: Annotated[int, Field(ge=1, le=6)]
    along: Literal["x", "y", "z", "x and y", "y and z", "x and z"]
    free_stroke: PositiveLength | None = None
    blocked_force: PositiveForce | None = None
    stiffness: PositiveStiffness | None = None
    length: PositiveLength | None = None
    edge: PositiveLength | None = None
    mass: PositiveMass | None = None

    @model_validator(mode="after")
    def _of_a_data_sheet(self) -> Self:
        three = (self.free_stroke, self.blocked_force, self.stiffness)
        given = [*three, self.length, self.edge, self.mass]
        if self.kind == "voice coil" and any(value is not None for value in given):
            raise refuse("voice coils have a count and an axis alone")
        if any(value is not None for value in given):
            if sum(value is not None for value in three) != 2:
                raise refuse("a stack has two of free_stroke, blocked_force and stiffness", "the third follows")
            if self.length is None or self.edge is None:
                raise refuse("a stack has a length and an edge", "e.g. length: 18 mm, edge: 5 mm")
        return self

    @property
    def axes(self) -> list[str]:
        """The axis of each, the first of all of one axis first."""
        return sorted(axes[k % len(axes)] for axes in [self.along.split(" and ")] for k in range(self.count))

    @property
    def is_stacks(self) -> bool:
        """Whether they are piezo stacks."""
        return self.kind == "piezo stack"

    @property
    def stack(self) -> Stack:
        """The stack of which there are so many; without its mass given as dense as its ceramic."""
        if self.length is None or self.edge is None:
            return STACK
        stroke, force, k = (
            0.0 if own is None else si(own) for own in (self.free_stroke, self.blocked_force, self.stiffness)
        )
        length, edge = si(self.length), si(self.edge)
        stroke = stroke or force / k
        mass = si(self.mass) if self.mass is not None else CERAMIC * length * edge**2
        return Stack(stroke, k or force / stroke, length, edge, mass)


def _drives(raw: Any) -> Any:
    if raw == "none":
        return None
    if isinstance(raw, str):
        if found := _DRIVES.fullmatch(raw.strip()):
            return {"count": int(found[1]), "kind": found[2], "along": " ".join(found[3].split())}
        hint = "e.g. 3 voice coils along z, 3 piezo stacks along z, 2 piezo stacks along x and y, or none"
        raise refuse("drives are so many of a kind along an axis", hint)
    return raw


class Make(Wished):
    """Of what it is made and how: the material, the thinnest web, the process, and the radius of the tool, which inner
    corners have; of a wire 0.15 mm where nothing is said."""

    material: str = "Al-7075-T6"
    thinnest: PositiveLength = 0.3e-3
    process: Process = "assembled"
    tool_radius: Annotated[PositiveLength | None, Field(alias="tool radius")] = None

    @model_validator(mode="after")
    def _known(self) -> Self:
        _in_catalogue(self.material)
        return self

    @property
    def radius(self) -> float | None:
        """The radius of inner corners, m, if they have one."""
        if self.tool_radius is None:
            return WIRE_RADIUS if self.process == "wire-cut" else None
        return si(self.tool_radius)


class Wish(Wished):
    """A wish, before there is a mechanism."""

    freedoms: WishedFreedoms
    about: Vector | None = None
    """The point that rotations pass through; by default the middle of the platform."""
    stroke: Annotated[dict[Name, Amount], BeforeValidator(_by_dof)] = {}
    """How far to either side, by freedom, all at once."""
    envelope: tuple[PositiveLength, PositiveLength, PositiveLength]
    """Edges of the box along x, y and z that holds all of it. It stands on the base, with the origin in the middle."""
    base: Base = Base()
    platform: Platform = Platform()
    drives: Annotated[Drives | None, BeforeValidator(_drives)] = None
    make: Make = Make()
    gap: Annotated[float, Field(gt=0)] = LEAST_GAP
    """How many times as compliant the stiffest freedom is to be as the softest constraint."""

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if self.drives is not None and self.drives.is_stacks and not (self.stroke and self.freedoms.platform):
            raise refuse("piezo stacks are chosen by strokes of platform, and none is given", "e.g. stroke: {z: 50 um}")
        if self.drives is not None and " " in self.drives.along and self.base.plane[0] in self.drives.along:
            raise refuse(f"drives along two axes are along the base, and that is {self.base.plane}")
        size, turn = np.array(self.envelope, dtype=float), TURNS[self.base.plane]
        second = float(np.sort(size)[1])  # a layer may be as thin as its webs
        if si(self.make.thinnest) > second / 2:
            raise refuse(
                f"webs of {1e3 * si(self.make.thinnest):g} mm are thicker than half the envelope",
                f"it is {1e3 * second:g} mm along its second smallest edge",
            )
        arm = np.abs(turn.T @ size)[2] / 2 * turn[:, 2] - self.centre
        for name, own in self.stroke.items():
            if name not in self.twists:
                raise refuse(f"a stroke along {name}, which is no freedom", f"freedoms: {', '.join(self.twists)}")
            v, w = np.split(self.twists[name], 2)
            turns = bool(w.any())
            if turns not in own:
                raise refuse(f"the stroke of {name} is {'an angle' if turns else 'a length'}")
            if turns and own[turns] > MOST_TURNED:
                raise refuse("a rotation of more than 0.5 rad to either side is beyond what flexures are made for")
            moved = np.abs(v + np.cross(w, arm)) * own[turns]
            k = int((moved / size).argmax())
            if 2 * moved[k] > size[k]:
                raise refuse(
                    f"the stroke of {name} moves the middle of the envelope by {1e3 * moved[k]:g} mm to either side",
                    f"along {'xyz'[k]}, where the envelope is {1e3 * size[k]:g} mm; in all at most that",
                )
        return self

    @property
    def place(self) -> tuple[Array, Array]:
        """Half edges (3,) of the platform and its middle (3,), along axes of which the base is the plane z = 0, m."""
        turn, own = TURNS[self.base.plane], self.platform
        half = np.abs(turn.T @ np.array(self.envelope, dtype=float)) / 2
        if own.size is None:
            across = np.array([0.6 * half[:2].min()] * 2) if own.shape == "cylinder" else 0.6 * half[:2]
            edges = np.array([*across, 0.2 * half[2]])
        elif own.shape == "cylinder":
            edges = np.array([own.size[0], own.size[0], own.size[1]], dtype=float) / 2
        else:
            edges = np.abs(turn.T @ np.array(own.size, dtype=float)) / 2
        if own.at is not None:
            return edges, turn.T @ np.array(own.at, dtype=float)
        return edges, np.array([0.0, 0.0, 2 * half[2] - edges[2]])

    @property
    def centre(self) -> Array:
        """The point (3,) that rotations pass through, m."""
        if self.about is None:
            return TURNS[self.base.plane] @ self.place[1]
        return np.array(self.about, dtype=float)

    @property
    def twists(self) -> dict[str, Array]:
        """The wished freedoms by name, each as the motion (6,) of the point of the wish by one metre or radian."""
        about = self.centre
        dofs = {name: np.eye(6)[DOFS.index(name)] for name in self.freedoms.platform or ()}
        return dofs | {name: own.twist(about) for name, own in self.freedoms.screws.items()}

    @property
    def stroke_twist(self) -> Array:
        """Motion (6,) of the point of the wish to one end of the stroke, m and rad."""
        turns = {name: bool(own[3:].any()) for name, own in self.twists.items()}
        return sum((own[turns[name]] * self.twists[name] for name, own in self.stroke.items()), np.zeros(6))


class WishFile(Part):
    """A file with a wish and what is required of each design."""

    name: Label = "wish"
    wish: Wish
    requirements: dict[Label, Question] = {}

    @model_validator(mode="after")
    def _names(self) -> Self:
        stacks = self.wish.drives is not None and self.wish.drives.is_stacks
        if stacks and any(name.startswith("reach") for name in self.requirements):
            raise refuse("requirements whose names begin with reach are those of the stacks", "name it otherwise")
        return self

    @property
    def required(self) -> dict[str, str]:
        """What is required of each design: what the file says and, of a stroke of which it says nothing, that the
        yield stress is not reached."""
        said = any("over stroke" in text for text in self.requirements.values())
        known = CATALOGUE[self.wish.make.material].yield_stress is not None
        implied = {WITHIN_YIELD: "margin >= 1 over stroke"} if self.wish.stroke and known and not said else {}
        return {**self.requirements, **implied}


@dataclass(frozen=True)
class Room:
    """The room of a wish in its own frame, in which the base is the plane z = 0 and all else above it.

    `turn` (3, 3) leads from this frame to the global one; `half` (3,) are half the edges of the envelope, its middle at
    `half[2]` above the base. The platform is a cylinder or a box with half edges `platform` (3,), its middle at
    `middle` (3,). `freedoms` are about the origin of this frame. With a `frame` the base is around the envelope too.
    """

    turn: Array
    half: Array
    shape: str
    platform: Array
    middle: Array
    about: Array
    freedoms: ScrewSpace
    clear: Array = field(default_factory=lambda: np.zeros(3))
    """How far the platform moves along each axis (3,), m, but by its turns."""
    frame: bool = False

    @cached_property
    def wrenches(self) -> ScrewSpace:
        """What limbs are to bear, and nothing else."""
        return self.freedoms.reciprocal()

    @property
    def size(self) -> float:
        """The smallest edge of the envelope, m; of a layer, which is thin, a quarter of the next."""
        least, second, _ = np.sort(2 * self.half)
        return float(max(least, second / 4))

    def outside(self, points: Array) -> Array:
        """How far points (n, 3) are outside of the envelope, m, over no clearance; negative within."""
        return (np.abs(points - [0.0, 0.0, self.half[2]]) - self.half).max(axis=1)

    def in_platform(self, points: Array, by: float | Array = 0.0) -> Array:
        """Whether points (n, 3) are within the platform by more than so much, m, in all or along each axis (3,)."""
        x, half = np.abs(points - self.middle), self.platform - by
        tall = x[:, 2] < half[2]
        if self.shape == "box":
            return tall & (x[:, :2] < half[:2]).all(axis=1)
        return tall & (np.hypot(x[:, 0], x[:, 1]) < half[:2].max())


TURNS: dict[str, Array] = {
    "z-": np.eye(3),
    "z+": np.diag([1.0, -1.0, -1.0]),
    "x-": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "x+": np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
    "y-": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y+": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]]),
}
"""Frames whose z axis leads away from the base: columns are its axes in the global frame."""


def room_of(wish: Wish) -> Room:
    """The room of a wish."""
    turn = TURNS[wish.base.plane]
    half = np.abs(turn.T @ np.array(wish.envelope, dtype=float)) / 2
    platform, middle = wish.place
    about = turn.T @ wish.centre
    length = float(half.max())
    clear = np.abs(turn.T @ wish.stroke_twist[:3])
    return Room(
        turn,
        half,
        wish.platform.shape,
        platform,
        middle,
        about,
        _freedoms(wish, turn, about, length),
        clear,
        wish.base.frame,
    )


def _freedoms(wish: Wish, turn: Array, about: Array, length: float) -> ScrewSpace:
    """The wished freedoms as twists about the origin of the room."""
    own = np.array(list(wish.twists.values())).reshape(-1, 2, 3) @ turn
    own[:, 0] -= np.cross(own[:, 1], about)
    return ScrewSpace.of("twists", own.reshape(-1, 6).T, length)
