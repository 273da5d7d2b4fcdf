"""Parts with inertia, stiffness or damping that are not members: rigid bodies, point masses, springs, dashpots, stops,
superelements."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, model_validator
from pydantic.json_schema import SkipJsonSchema

from flexura.errors import OptionError
from flexura.mechanism.base import ORIGIN, Direction, Part, Vector, refuse
from flexura.mechanism.quantity import (
    Angle,
    AnyQuantity,
    ContactDamping,
    Density,
    ExpansionCoefficient,
    Inertia,
    Length,
    NonNegativeLength,
    NonNegativeMass,
    NonNegativeNumber,
    PerKelvin,
    PositiveLength,
    PositiveMass,
    PositivePressure,
    PositiveStiffness,
    RotationalDamping,
    RotationalStiffness,
    StiffnessRR,
    StiffnessTR,
    StiffnessTT,
    TranslationalDamping,
    TranslationalStiffness,
)
from flexura.sizes import beyond

OneOrTwo = Annotated[tuple[str, ...], Field(min_length=1, max_length=2)]
"""A node, or two."""
Principal = tuple[Inertia, Inertia, Inertia]
Tensor = tuple[Inertia, Inertia, Inertia, Inertia, Inertia, Inertia]
InertiaTensor = Principal | Tensor
"""(Ixx, Iyy, Izz) or (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about the centre of mass, kg m^2; Ixy = -integral of x y dm."""


def _inertia(raw: Any) -> Any:
    if isinstance(raw, list | tuple) and len(raw) not in (3, 6):
        raise refuse("an inertia has 3 entries (Ixx, Iyy, Izz) or 6 (and Ixy, Ixz, Iyz)")
    return raw


class Rotation(Part):
    """A right-handed rotation about an axis through the origin of the part."""

    axis: Direction
    angle: Angle


class Box(Part):
    """A solid box with its edges along the axes."""

    shape: Literal["box"] = "box"
    size: tuple[PositiveLength, PositiveLength, PositiveLength]
    material: str


class Cylinder(Part):
    """A solid cylinder."""

    shape: Literal["cylinder"] = "cylinder"
    diameter: PositiveLength
    length: PositiveLength
    axis: Direction = (0.0, 0.0, 1.0)
    material: str


class Plate(Part):
    """A solid rectangular plate: length along x, width along y, thickness along z."""

    shape: Literal["plate"] = "plate"
    length: PositiveLength
    width: PositiveLength
    thickness: PositiveLength
    material: str


class _Placed(Part):
    """Something with a place in the axes of a composite, which is turned about that."""

    at: Vector = ORIGIN
    """Its centre, m."""
    rotate: Rotation | None = None


class BoxPiece(_Placed):
    """A box with its edges along the axes."""

    shape: Literal["box"] = "box"
    size: tuple[PositiveLength, PositiveLength, PositiveLength]


class CylinderPiece(_Placed):
    """A cylinder."""

    shape: Literal["cylinder"] = "cylinder"
    diameter: PositiveLength
    length: PositiveLength
    axis: Direction = (0.0, 0.0, 1.0)


class PlatePiece(_Placed):
    """A rectangular plate: length along x, width along y, thickness along z."""

    shape: Literal["plate"] = "plate"
    length: PositiveLength
    width: PositiveLength
    thickness: PositiveLength


class PrismPiece(_Placed):
    """A polygon in the plane of x and y, extruded along z, as far up as down."""

    shape: Literal["prism"] = "prism"
    outline: tuple[tuple[Length, Length], ...] = Field(min_length=3, max_length=2000)
    """Its corners in order, from `at`, m; anticlockwise or clockwise."""
    thickness: PositiveLength

    @model_validator(mode="after")
    def _is_simple(self) -> Self:
        if all(isinstance(x, float) for corner in self.outline for x in corner):
            corners = np.array(self.outline, dtype=float)
            sides = np.roll(corners, -1, axis=0) - corners
            if (np.abs(sides).max(axis=1) == 0).any():
                raise refuse("two corners that follow each other are one: a side has a length")
            if (crossed := _crossed_sides(corners)) is not None:
                first, second = (k + 1 for k in crossed)
                raise refuse(f"sides {first} and {second} cross or touch: an outline does not cross itself")
        return self


def _crossed_sides(corners: NDArray[np.float64]) -> tuple[int, int] | None:
    """Two sides (n, 2) of a polygon that are no neighbours and meet."""
    a, b = corners, np.roll(corners, -1, axis=0)

    def turn(p: NDArray[np.float64], q: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
        return (q - p)[..., 0] * (r - p)[..., 1] - (q - p)[..., 1] * (r - p)[..., 0]

    a0, b0, a1, b1 = a[:, None], b[:, None], a[None], b[None]
    meets = (turn(a0, b0, a1) * turn(a0, b0, b1) <= 0) & (turn(a1, b1, a0) * turn(a1, b1, b0) <= 0)
    boxes = (np.maximum(a0, b0) >= np.minimum(a1, b1)).all(axis=-1)
    n = len(corners)
    apart = (np.arange(n)[:, None] - np.arange(n)) % n
    found = np.argwhere(meets & boxes & boxes.T & (apart > 1) & (apart < n - 1))
    return (int(found[0, 0]), int(found[0, 1])) if len(found) else None


Piece = Annotated[BoxPiece | CylinderPiece | PlatePiece | PrismPiece, Field(discriminator="shape")]


def _not_written(allowed: str) -> BeforeValidator:
    """Refuses what files have in a place that only programs fill; `allowed` are the keys beside it."""

    def check(value: Any) -> Any:
        if isinstance(value, dict | list | tuple | str | float | int):
            raise refuse("unknown key", f"allowed: {allowed}")
        return value

    return BeforeValidator(check)


class Composite(Part):
    """Boxes, cylinders, plates and prisms in one piece, less others: frames, brackets, plates with holes."""

    shape: Literal["composite"] = "composite"
    material: str
    add: tuple[Piece, ...] = Field(min_length=1)
    """What it is made up of; pieces touch or overlap."""
    cut: tuple[Piece, ...] = ()
    """What is taken out of that."""
    meshed: SkipJsonSchema[Annotated[Any, _not_written("add, cut, material, shape")]] = Field(
        default=None, exclude=True, repr=False
    )
    """Its solid once it is meshed (`with_solid_parts`), which no file has."""


Solid = Annotated[Box | Cylinder | Plate | Composite, Field(discriminator="shape")]


Face = Literal["x-", "x+", "y-", "y+", "z-", "z+"]
"""A face of a solid, by the axis of the solid that leads out of it."""


class Held(Part):
    """What the ground holds of a body."""

    face: Face


class RigidBody(Part):
    """A body that carries nodes: on rigid arms, or on its elastic solid.

    Its own node, at its centre, goes by the body's name and may be used like any other node; it moves as an
    elastic body does on the mean. Give `mass` and `inertia`, or a `solid`.
    """

    centre: Vector = ORIGIN
    """Centre of mass, m; of a composite the origin of its pieces."""
    carries: tuple[str, ...] = ()
    """Nodes fixed to the body; `*` matches any run of characters, as in `branch*.top`."""
    mass: PositiveMass | None = None
    inertia: Annotated[InertiaTensor, BeforeValidator(_inertia)] | None = None
    solid: Solid | None = None
    rotate: Rotation | None = None
    """Turns the solid, or the axes in which `inertia` is given."""
    expansion: ExpansionCoefficient | None = None
    """Coefficient of thermal expansion, 1/K; by default that of the material of its solid."""
    elastic: bool | Literal["auto"] = "auto"
    """Whether the solid bends; `auto`: where that matters."""
    held: Held | None = None
    """The face at which the ground holds the body."""

    @property
    def may_bend(self) -> bool:
        """Whether it bends where that matters."""
        return self.solid is not None and self.elastic is not False and bool(self.carries)

    @model_validator(mode="after")
    def _one_inertia(self) -> Self:
        given = (self.mass is not None) + (self.inertia is not None)
        if self.solid is not None and given:
            raise refuse("a rigid body has either a solid or mass and inertia, not both")
        if self.solid is None and given != 2:
            raise refuse("a rigid body needs mass and inertia, or a solid", "a point mass has mass alone")
        if self.solid is None and self.elastic is True:
            raise refuse("mass and inertia alone do not bend: an elastic body has a solid", "or elastic: false")
        if self.held is not None:
            if self.solid is None:
                raise refuse("a body of mass and inertia alone has no face to be held at", "give it a solid")
            if isinstance(self.solid, Cylinder) and self.held.face[0] != "x":
                raise refuse("a cylinder is held at an end", "x- or x+, x leading along its axis")
        return self


class PointMass(Part):
    """A mass at a node, or at `offset` from it on a rigid arm."""

    node: str
    mass: NonNegativeMass
    inertia: Annotated[InertiaTensor, BeforeValidator(_inertia)] | None = None
    offset: Vector = ORIGIN


class DiagonalStiffness(Part):
    """Stiffness along and about the three axes of a spring."""

    tx: TranslationalStiffness = 0.0
    ty: TranslationalStiffness = 0.0
    tz: TranslationalStiffness = 0.0
    rx: RotationalStiffness = 0.0
    ry: RotationalStiffness = 0.0
    rz: RotationalStiffness = 0.0


_RowT = tuple[StiffnessTT, StiffnessTT, StiffnessTT, StiffnessTR, StiffnessTR, StiffnessTR]
_RowR = tuple[StiffnessTR, StiffnessTR, StiffnessTR, StiffnessRR, StiffnessRR, StiffnessRR]
StiffnessMatrix = tuple[_RowT, _RowT, _RowT, _RowR, _RowR, _RowR]


class Spring(Part):
    """A 6-DOF spring from a node to ground, or between two nodes.

    It acts at `at` (default: the node, or midway between the two), to which both nodes reach by rigid arms, so that
    a rigid motion never strains it.
    """

    nodes: OneOrTwo
    stiffness: DiagonalStiffness | None = None
    matrix: StiffnessMatrix | None = None
    """Full symmetric 6 x 6 stiffness."""
    at: Vector | None = None
    rotate: Rotation | None = None
    """Turns the axes of the spring."""
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor."""

    @model_validator(mode="after")
    def _one_stiffness(self) -> Self:
        if (self.stiffness is None) == (self.matrix is None):
            raise refuse("both, or neither, is given: a spring has either stiffness (by DOF) or matrix (6 x 6)")
        return self


class DiagonalDamping(Part):
    """Viscous coefficients along and about the three axes of a dashpot."""

    tx: TranslationalDamping = 0.0
    ty: TranslationalDamping = 0.0
    tz: TranslationalDamping = 0.0
    rx: RotationalDamping = 0.0
    ry: RotationalDamping = 0.0
    rz: RotationalDamping = 0.0


class Dashpot(Part):
    """A viscous damper from a node to ground, or between two nodes; it acts at `at` as a spring does."""

    nodes: OneOrTwo
    damping: DiagonalDamping
    at: Vector | None = None
    rotate: Rotation | None = None
    """Turns the axes of the dashpot."""


class Stop(Part):
    """What a node meets once it has moved by `gap` along `direction`, or the second of two nodes as seen from the
    first, with which the direction turns; only large motion meets it.

    It pushes back with `stiffness` k at the depth p beyond the gap by k p (1 + c dp/dt), c the `damping`, and never
    pulls (Hunt and Crossley 1975).
    """

    nodes: OneOrTwo
    direction: Direction
    gap: NonNegativeLength
    stiffness: PositiveStiffness
    damping: ContactDamping = 0.0
    """What is lost: slow impacts at a speed v rebound with 1 - 2 c v / 3 of it."""


LARGEST_ENTRY = 1e150
"""Largest entry of a superelement matrix, whose square is still a finite number."""


class Matrix:
    """An immutable real matrix that compares by value; `surface` is that of what it is the stiffness of, where that is
    known."""

    def __init__(self, values: Any, surface: Any = None) -> None:
        self.array: NDArray[np.float64] = np.array(values, dtype=float)
        self.array.flags.writeable = False
        self.surface: Any = surface

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Matrix) and np.array_equal(self.array, other.array)

    def __hash__(self) -> int:
        return hash((self.array.shape, self.array.tobytes()))

    def __repr__(self) -> str:
        return f"Matrix({'x'.join(map(str, self.array.shape))})"


def _matrix(raw: Any) -> Matrix:
    if isinstance(raw, Matrix):
        return raw
    if isinstance(raw, list | tuple) and any(isinstance(x, str) for row in raw if isinstance(row, list) for x in row):
        raise refuse("entries of a superelement matrix are plain numbers", "`units` names the unit system")
    if isinstance(raw, np.ndarray) and np.iscomplexobj(raw):
        raise refuse("complex numbers stand here: entries of a superelement matrix are real")
    try:
        matrix = Matrix(raw)
    except (TypeError, ValueError):
        raise refuse("a matrix is a list of rows of numbers, all of one length") from None
    if matrix.array.ndim != 2 or matrix.array.shape[0] != matrix.array.shape[1]:
        raise refuse("rows and columns differ in number: a superelement matrix is square")
    if found := beyond("dense_entries", matrix.array.size):
        raise refuse(*found[1:])
    if not np.isfinite(matrix.array).all():
        raise refuse("an entry is infinite or no number: entries of a matrix are finite")
    if abs(matrix.array).max(initial=0.0) > LARGEST_ENTRY:
        raise refuse(f"entries of a matrix are at most {LARGEST_ENTRY:g} in size", "are they in the unit given?")
    return matrix


AmplitudeCount = Annotated[int, Field(ge=0, le=6000, strict=True)]
SquareMatrix = Annotated[
    Matrix,
    BeforeValidator(_matrix),
    PlainSerializer(lambda m: m.array.tolist()),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "array", "items": {"type": "array", "items": {"type": "number"}}},
                {"type": "object", "properties": {"file": {"type": "string"}}, "required": ["file"]},
            ],
            "description": "rows of numbers in SI, or {file: NAME.mtx} (Matrix Market)",
        }
    ),
]


class Meshed(Part):
    """The mesh that a superelement was reduced from."""

    size: Annotated[float, Field(gt=0, strict=True)]
    """Length of its cells relative to the mesher's own choice."""
    dofs: Annotated[int, Field(ge=1, strict=True)]
    """DOFs of the mesh."""
    complete_hz: Annotated[float, Field(gt=0, strict=True)] | None = None
    """Of a part from CAD or a mesh: frequency below which none of its modes with the interfaces held is left out."""
    error: Annotated[float, Field(ge=0, strict=True)] | None = None
    """Of such a part: what the mesh may make its frequencies wrong by, relative."""
    tolerance: Annotated[float, Field(gt=0, strict=True)] | None = None
    """What was asked of the error."""


class Sheet(Part):
    """The sheet that a superelement was reduced from, whose force along the normal is k s (1 + c s^2/t^2), of which the
    superelement has k s."""

    thickness: Annotated[float, Field(gt=0, strict=True)]
    """t, m."""
    normal: Direction
    stiffening: Annotated[float, Field(strict=True)]
    """c, of displacements of one node with the others held."""


class Variation(Part):
    """How a part from CAD varies with its sizes and its material, which no file has.

    With x the `sizes` less `centre`, over `reach`, K is the sum of all x^`powers`[k] `stiffness`[k], and as Young's
    modulus over that of `nominal`; M is so with `mass` and the density. Nodes are at `places`, m, from which rigid arms
    lead to where they have gone. `names` and `units` say what the sizes are, each from `least` to `most`, SI.
    """

    names: tuple[str, ...] = ()
    sizes: tuple[AnyQuantity, ...] = ()
    units: tuple[str, ...] = ()
    centre: tuple[float, ...] = ()
    reach: tuple[float, ...] = ()
    least: tuple[float, ...] = ()
    most: tuple[float, ...] = ()
    powers: tuple[tuple[int, ...], ...]
    stiffness: tuple[SquareMatrix, ...]
    mass: tuple[SquareMatrix, ...]
    material: tuple[PositivePressure, Density]
    nominal: tuple[float, float]
    places: tuple[tuple[float, float, float], ...]

    def refuse_beyond(self, sizes: NDArray[np.float64]) -> None:
        """Raise OptionError for sizes (..., k) beyond those that the part was reduced for."""
        for k, (name, unit) in enumerate(zip(self.names, self.units, strict=True)):
            own, room = sizes[..., k], 1e-9 * self.reach[k]
            wrong = own[(own < self.least[k] - room) | (own > self.most[k] + room)]
            if wrong.size:
                text = f"{name} = {float(wrong.flat[0]):g} {unit}: the part was meshed for {self.least[k]:g} to"
                raise OptionError(f"{text} {self.most[k]:g}; minimum and maximum of its parameters say how far")


class Superelement(Part):
    """Stiffness and mass matrices of an elastic part over named nodes, from another program or a reduced mechanism.

    The 6 DOFs of each node follow each other in the order of `nodes` (tx ty tz rx ry rz), SI units, in the frame of
    the substructure. After them come `amplitudes` generalised coordinates, such as those of fixed-interface normal
    modes, all zero in a rigid motion.
    """

    nodes: tuple[str, ...] = Field(min_length=1)
    amplitudes: AmplitudeCount = 0
    stiffness: SquareMatrix
    mass: SquareMatrix
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor."""
    expansion: ExpansionCoefficient | None = None
    """Coefficient of thermal expansion, 1/K, of a homogeneous part."""
    softening: PerKelvin | None = None
    """Relative change of its moduli with temperature, 1/K."""
    stiffness_error: SquareMatrix | None = None
    """How far off the stiffness may be: the strain energy of displacements v is uncertain by half of v' E v."""
    mesh: Meshed | None = None
    """The mesh that it was reduced from, where that is known."""
    sheet: Sheet | None = None
    """The sheet that it is, if it is one."""
    variation: SkipJsonSchema[
        Annotated[Variation | None, _not_written("amplitudes, loss_factor, mass, nodes, stiffness, stiffness_error")]
    ] = Field(default=None, exclude=True, repr=False)
    """How it varies, which no file has."""

    @model_validator(mode="after")
    def _sizes(self) -> Self:
        n, a = 6 * len(self.nodes), self.amplitudes
        rule = f"six DOFs for each of {len(self.nodes)} nodes" + (f", and {a} amplitudes" if a else "")
        for name in ("stiffness", "mass", "stiffness_error"):
            given = getattr(self, name)
            if given is None:
                continue
            matrix = given.array
            if matrix.shape != (n + a, n + a):
                hint = "" if a else "`amplitudes` is how many generalised coordinates follow the DOFs of the nodes"
                raise refuse(f"{name} is {n + a} x {n + a}: {rule}", hint)
            scaled = matrix / (abs(matrix).max() or 1.0)
            if not np.allclose(scaled, scaled.T, rtol=0, atol=1e-6):
                raise refuse(f"its two halves differ: {name} of a superelement is symmetric")
            try:  # Cholesky's factors exist when no eigenvalue is below the round-off that is let pass
                np.linalg.cholesky((scaled + scaled.T) / 2 + 1e-6 * np.eye(n + a))
            except np.linalg.LinAlgError:
                raise refuse(
                    f"some motion would release energy: {name} of a superelement has no negative eigenvalue"
                ) from None
        if not (self.stiffness.array.diagonal()[n:] > 0).all():
            raise refuse(
                "one has none: every amplitude of a superelement has stiffness", "rigid motions are those of its nodes"
            )
        return self
