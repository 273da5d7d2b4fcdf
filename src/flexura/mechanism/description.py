"""The mechanism as a whole: parameters, damping, reduction, substructures and where they are placed, supports."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterator
from itertools import pairwise
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from flexura.errors import OptionError, did_you_mean
from flexura.expressions import Dimension
from flexura.mechanism.base import ORIGIN, Name, Part, Text, Title, Vector, refuse
from flexura.mechanism.body import Composite, Dashpot, Matrix, PointMass, RigidBody, Spring, Stop, Superelement
from flexura.mechanism.channels import Actuator, ModalTest, Sensor
from flexura.mechanism.controllers import Controller
from flexura.mechanism.diaphragm import Diaphragm
from flexura.mechanism.disturbances import Disturbance
from flexura.mechanism.flat_spring import FlatSpring
from flexura.mechanism.loads import Gravity, Load, Motion, Prescribed
from flexura.mechanism.material import CATALOGUE, Material
from flexura.mechanism.member import Corrections, Fidelity, Flexure, Link, MeshSize, Theory
from flexura.mechanism.patterns import PLACE, Patterns, Turns
from flexura.mechanism.quantity import (
    AnyQuantity,
    DampingRatio,
    NonNegativeNumber,
    PositiveFrequency,
    Scalar,
)
from flexura.mechanism.section import Section
from flexura.mechanism.solid_part import SolidPart
from flexura.mechanism.studies import DescribedStudy, Label, PublishedValue, Question
from flexura.mechanism.temperatures import ThermalContact, Warmer
from flexura.results import Displayed
from flexura.tables import Facts, Item, Table, quantity


def _coherent(unit: str) -> str:
    if unit and Dimension.of_unit(unit) is None:
        raise refuse(
            "the unit of a parameter is a coherent SI unit, e.g. m, N/m or kg*m**-3",
            "values are in SI; text with other units belongs in a model file",
        )
    return unit


HELD = (
    "held by bounds that leave one value: solid and imported parts are made for it; fidelity: beam lets sizes of a"
    " solid member vary"
)
"""What is said of a parameter that is held where it is to vary."""


class Parameter(Part):
    """A named value, or an expression over other parameters, with bounds and a note on its origin.

    Parameters compare by their numbers; `unit` only says what these are numbers of.
    """

    value: AnyQuantity
    minimum: AnyQuantity | None = None
    maximum: AnyQuantity | None = None
    unit: Annotated[str, AfterValidator(_coherent)] = ""
    """SI unit of the value, e.g. `m`, `N/m`, `kg*m**2*s**(-2)` or `1`; a file sets it from the text, Python may
    leave it out."""
    source: Text = ""
    """Where the value comes from: measured, assumed, calibrated, or a reference."""

    @property
    def dimension(self) -> Dimension | None:
        """Physical dimension by `unit`; None when it was left out."""
        return Dimension.of_unit(self.unit) if self.unit else None

    @property
    def is_held(self) -> bool:
        """Whether the bounds leave no room, as where a solid member is made for the value."""
        return self.minimum is not None and self.minimum == self.maximum

    def written(self, value: float) -> str:
        """A number in the unit of the parameter, with it."""
        return f"{value:g} {self.unit}" if self.unit not in ("", "1") else f"{value:g}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Parameter) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        return (self.value, self.minimum, self.maximum, self.source)


class DampingBand(Part):
    """One damping ratio for all modes up to a frequency."""

    up_to: PositiveFrequency
    ratio: DampingRatio


class Rayleigh(Part):
    """C = alpha M + beta K, from damping ratios at two frequencies (Rayleigh 1877)."""

    frequencies: tuple[PositiveFrequency, PositiveFrequency]
    """Hz, the lower one first."""
    ratios: tuple[DampingRatio, DampingRatio]

    @model_validator(mode="after")
    def _order(self) -> Self:
        low, high = self.frequencies
        if isinstance(low, float) and isinstance(high, float) and low >= high:
            raise refuse(
                "equal, or in the wrong order: the two frequencies of Rayleigh damping differ, the lower one first"
            )
        zeta_low, zeta_high = self.ratios
        if all(isinstance(x, float) for x in (low, high, zeta_low, zeta_high)) and not (
            zeta_low * high >= zeta_high * low and zeta_high * high >= zeta_low * low  # type: ignore[operator]
        ):
            raise refuse("these ratios need a negative alpha or beta", "bring the two ratios closer together")
        return self


class Damping(Part):
    """Damping of the mechanism as a whole; all that is given acts together, with dashpots and loss factors of parts.

    `ratio` is the modal damping ratio of all modes, `bands` and `ratios` those of the modes in frequency bands and of
    the lowest ones in order, where given instead.
    """

    ratio: DampingRatio = 0.0
    ratios: tuple[DampingRatio, ...] = ()
    bands: tuple[DampingBand, ...] = ()
    rayleigh: Rayleigh | None = None
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor of everything elastic that has none of its own."""

    @model_validator(mode="before")
    @classmethod
    def _single(cls, raw: Any) -> Any:
        return {"ratio": raw} if isinstance(raw, int | float | str) and not isinstance(raw, bool) else raw

    @model_validator(mode="after")
    def _rising(self) -> Self:
        limits = [band.up_to for band in self.bands if isinstance(band.up_to, float)]
        if any(a >= b for a, b in pairwise(limits)):
            raise refuse("one begins below the one before it: bands are in order of their frequencies")
        return self


class Reduction(Part):
    """One of three ways: to a proven relative error, to constraint modes alone, or with a number of kept modes."""

    tolerance: Annotated[float, Field(gt=0, lt=1)] | None = None
    """Relative error that what is asked for is proven to."""
    constraint_modes: bool = False
    """Constraint modes alone, as in the RPR paper."""
    keep: Annotated[int, Field(ge=0)] | dict[str, Annotated[int, Field(ge=0)]] | None = None
    """Normal modes kept in each substructure, or by the substructure's name."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.tolerance is not None) + self.constraint_modes + (self.keep is not None) != 1:
            raise refuse("several, or none, are given: a reduction is one of tolerance, constraint_modes: true, keep")
        return self


P = TypeVar("P", bound="Substructure")

DOF_NAMES = ("tx", "ty", "tz", "rx", "ry", "rz")
Dof = Literal["tx", "ty", "tz", "rx", "ry", "rz"]


def is_rotation(displacement: str) -> bool:
    """Whether a displacement, such as `ry` or `carriage.ry`, is a rotation; what acts along it is a moment then."""
    return displacement.rpartition(".")[2].startswith("r")


UNITS, FORCE_UNITS, STIFFNESS_UNITS = ("m", "rad"), ("N", "N*m"), ("N/m", "N*m/rad")
"""SI units of displacements, of what acts along them, and of its ratio to them: of translations and, second, of
rotations (`is_rotation`)."""


class Instance(Part):
    """A substructure set in place: turned by `rotate` (in the order given) about its origin, then moved to `at`.

    A pattern makes copies named NAME1, NAME2, ...; several patterns apply one after the other. Inside an instance
    parameters may have values of its own, in all its copies or in some, and what follows from them follows there.
    """

    of: str
    at: Vector = ORIGIN
    rotate: Turns = ()
    pattern: Patterns = ()
    with_: Annotated[dict[Name, AnyQuantity], Field(alias="with")] = {}
    """Values of parameters inside, over parameters outside."""
    copies: dict[Name, dict[Name, AnyQuantity]] = {}
    """Such values of single copies, by the name of the copy; they go before those of all."""


def bindings(instance: Instance, copy: str) -> dict[str, Scalar]:
    """Values of parameters inside a copy of an instance."""
    return {**instance.with_, **instance.copies.get(copy, {})}


class Substructure(Part):
    """Nodes and the parts between them; others see its `interface` nodes only."""

    nodes: dict[Name, Vector] = {}
    links: dict[Name, Link] = {}
    flexures: dict[Name, Flexure] = {}
    diaphragms: dict[Name, Diaphragm] = {}
    flat_springs: dict[Name, FlatSpring] = {}
    springs: dict[Name, Spring] = {}
    bodies: dict[Name, RigidBody] = {}
    masses: dict[Name, PointMass] = {}
    superelements: dict[Name, Superelement] = {}
    dashpots: dict[Name, Dashpot] = {}
    stops: dict[Name, Stop] = {}
    actuators: dict[Name, Actuator] = {}
    sensors: dict[Name, Sensor] = {}
    instances: dict[Name, Instance] = {}
    parts: dict[Name, SolidPart] = {}
    """Solids from files of CAD; nodes of theirs are written PART.INTERFACE."""
    joints: tuple[tuple[str, str], ...] = ()
    """Pairs of nodes that are one; nodes of instances are written INSTANCE.NODE."""
    interface: tuple[str, ...] = ()
    """Nodes (or bodies) that others may join, carry or clamp."""
    fidelity: Fidelity | None = None
    """Whether members that do not say so themselves are beams or solids; None takes the mechanism's, or `beam`."""
    mesh_size: MeshSize | None = None
    """Relative size of the cells of solid members that do not say so themselves; None takes the mechanism's, or 1."""

    def members(self) -> Iterator[tuple[str, str, Link | Flexure]]:
        """Links and flexures: `links` or `flexures`, the name, and the member."""
        for kind, members in (("links", self.links), ("flexures", self.flexures)):
            for key, member in members.items():
                yield kind, key, member

    def with_members(self, change: Callable[[Link | Flexure], Link | Flexure]) -> Self:
        """The same substructure with every link and flexure changed, which is known to be valid."""
        kinds = {"links": self.links, "flexures": self.flexures}
        return self.replaced(
            {kind: {key: change(member) for key, member in members.items()} for kind, members in kinds.items()}
        )


class Support(Part):
    """How a node is held: `clamped`, some DOFs `fixed`, or all but some `free`."""

    fixed: tuple[Dof, ...] | None = None
    free: tuple[Dof, ...] | None = None

    @model_validator(mode="before")
    @classmethod
    def _word(cls, raw: Any) -> Any:
        if raw == "clamped":
            return {"fixed": DOF_NAMES}
        if isinstance(raw, str):
            raise refuse("a support is clamped, {fixed: [DOF, ...]} or {free: [DOF, ...]}")
        return raw

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.fixed is None) == (self.free is None):
            raise refuse("both, or neither, is given: a support has either fixed or free")
        return self

    @property
    def held(self) -> tuple[bool, ...]:
        """For each of tx ty tz rx ry rz, whether it is held."""
        if self.fixed is not None:
            return tuple(dof in self.fixed for dof in DOF_NAMES)
        return tuple(dof not in (self.free or ()) for dof in DOF_NAMES)


class Mechanism(Substructure, Displayed):
    """The whole description: parameters, materials and sections, substructures, what is assembled and what is held."""

    name: Title = "mechanism"
    description: Text = ""
    theory: Theory = "rayleigh"
    """Beam theory of members that do not name their own; the paper's is `rayleigh`."""
    corrections: Corrections = "auto"
    """What is added to the beam theory of members that do not say so themselves; the paper adds nothing, `none`."""
    damping: Damping = Damping()
    """Damping of the mechanism as a whole; a single number is the modal damping ratio of all modes."""
    reduction: Reduction | None = None
    """How it is reduced where nothing else is asked for; by default to a proven relative error of 1e-3."""
    parameters: dict[Name, Parameter] = {}
    materials: dict[Name, Material | str] = {}
    """Own materials, or other names for those of the catalogue."""
    sections: dict[Name, Section] = {}
    substructures: dict[Name, Substructure] = {}
    ground: dict[str, Support] = {}
    """Nodes that are held, by name; `*` matches any run of characters."""
    gravity: Gravity = (0.0, 0.0, 0.0)
    """Acceleration of free fall, m/s^2, global axes: everything has its weight."""
    loads: dict[str, Load] = {}
    """Dead loads by the node that they act on, global axes; `*` matches any run of characters, each match has one."""
    at: dict[str, Prescribed] = {}
    """The pose about which everything is linear, by the nodes that are moved there; at rest when there is none."""
    motion: Motion | None = None
    """The stroke of the mechanism."""
    temperatures: dict[Name, dict[str, Warmer]] = {}
    """States of temperature by name: how much warmer members, bodies, parts, instances and the `ground` are; `*`
    matches any run of characters, and what is named later goes before what is named earlier."""
    thermal_contacts: dict[Name, ThermalContact] = {}
    """What leads heat, beside members: joints, air."""
    ground_material: str | None = None
    """What the ground expands as where it is warmer; without it the ground keeps its size."""
    disturbances: dict[Name, Disturbance] = {}
    """What shakes it: floors, noise of actuators and sensors, random forces."""
    controllers: dict[Name, Controller] = {}
    """Loops that may be closed around it."""
    test: ModalTest | None = None
    """A modal test of the mechanism."""
    requirements: dict[Label, Question] = {}
    """What the mechanism is asked to do, by name: relations, as `f1 >= 300 Hz` or `margin >= 2 over stroke`."""
    studies: dict[Name, DescribedStudy] = {}
    """Studies of many designs."""
    published: tuple[PublishedValue, ...] = ()
    """Numbers that others give of it, with their sources."""

    def __repr__(self) -> str:
        counts = ", ".join(f"{len(parts)} {kind}" for kind, parts in self._counts().items() if parts)
        return f"Mechanism({self.name!r}, {counts})" if counts else f"Mechanism({self.name!r})"

    __str__ = __repr__

    def _counts(self) -> dict[str, dict[str, Any]]:
        """What is described, by kind."""
        kinds = (
            "parameters",
            "substructures",
            "instances",
            "parts",
            "flexures",
            "diaphragms",
            "flat_springs",
            "links",
            "springs",
            "bodies",
            "actuators",
        )
        return {kind: getattr(self, kind) for kind in (*kinds, "sensors", "ground", "loads", "at")}

    def presentation(self) -> Iterator[Item]:
        yield Facts({kind: ", ".join(names) for kind, names in self._counts().items() if kind != "parameters"})
        parameters = self.parameters

        def texts(name: str) -> list[str]:
            """A value or a bound of every parameter; expressions as they are."""
            values = ((getattr(p, name), p.unit) for p in parameters.values())
            return [quantity(x, unit) if isinstance(x, float) else "" if x is None else str(x) for x, unit in values]

        columns = {
            "parameter": list(parameters),
            "value": texts("value"),
            "least": texts("minimum"),
            "most": texts("maximum"),
        }
        yield Table({**columns, "source": [p.source for p in parameters.values()]}, "parameters")

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name. Raises OptionError when there is none."""
        if name not in self.parameters:
            known = f"parameters: {', '.join(self.parameters) or 'none'}"
            raise OptionError(f"{name!r} is not a parameter; {did_you_mean(str(name), self.parameters, known)}")
        return self.parameters[name]

    def material(self, name: str) -> Material:
        """The material of that name: an own one, another name for a catalogue one, or one of the catalogue.

        Raises KeyError when there is none.
        """
        material = self.materials.get(name, name)
        return material if isinstance(material, Material) else CATALOGUE[material]


def refined(mechanism: Mechanism, times: int) -> Mechanism:
    """The mechanism with every member cut into so many times the elements."""

    return _with_elements(mechanism, lambda elements: times * elements)


def with_elements(mechanism: Mechanism, most: int) -> Mechanism:
    """The mechanism with no member of more than so many elements."""
    return _with_elements(mechanism, lambda elements: min(most, elements))


def _with_elements(mechanism: Mechanism, number: Callable[[int], int]) -> Mechanism:
    """The mechanism with other numbers of elements in every member."""

    def meshed(part: P) -> P:
        return part.with_members(lambda member: member.replaced({"elements": number(member.elements)}))

    parts = {name: meshed(part) for name, part in mechanism.substructures.items()}
    return meshed(mechanism).replaced({"substructures": parts})


def sheets(mechanism: Mechanism, name: str) -> dict[str, Diaphragm | FlatSpring]:
    """Flat springs, and diaphragms that are solids, of a substructure or with no name of the mechanism itself."""
    part = mechanism.substructures[name] if name else mechanism
    openings = {key: diaphragm for key, diaphragm in part.diaphragms.items() if diaphragm.is_sheet}
    return {**openings, **part.flat_springs}


def solid_members(mechanism: Mechanism, name: str) -> dict[str, Link | Flexure]:
    """Links and flexures of fidelity `solid` declared in a substructure, or with no name in the mechanism itself."""
    part = mechanism.substructures[name] if name else mechanism
    default = part.fidelity or mechanism.fidelity
    return {key: member for _, key, member in part.members() if (member.fidelity or default) == "solid"}


def mesh_sizes(mechanism: Mechanism, name: str) -> dict[str, float]:
    """Relative sizes of the cells of the solids of a substructure, or with no name of the mechanism itself."""
    part = mechanism.substructures[name] if name else mechanism
    default = part.mesh_size or mechanism.mesh_size or 1.0
    meshed = {**solid_members(mechanism, name), **sheets(mechanism, name)}
    return {key: member.mesh_size or default for key, member in meshed.items()}


def has_solid_members(mechanism: Mechanism) -> bool:
    """Whether any member or sheet is to be a solid."""
    return any(solid_members(mechanism, name) or sheets(mechanism, name) for name in ("", *mechanism.substructures))


def composites(mechanism: Mechanism, name: str) -> dict[str, RigidBody]:
    """Bodies of a substructure, or with no name of the mechanism itself, whose composites are not meshed yet."""
    part = mechanism.substructures[name] if name else mechanism
    return {k: b for k, b in part.bodies.items() if isinstance(b.solid, Composite) and b.solid.meshed is None}


def needs_meshes(mechanism: Mechanism) -> bool:
    """Whether solids are to be meshed before there is a plan: parts, members, sheets and bodies of composites."""
    names = ("", *mechanism.substructures)
    if any(part.parts for part in (mechanism, *mechanism.substructures.values())):
        return True
    return has_solid_members(mechanism) or any(composites(mechanism, name) for name in names)


def with_rigid_roots(mechanism: Mechanism, nodes: Callable[[Substructure], Container[str]] | None = None) -> Mechanism:
    """The same mechanism with rigid roots of its members, at all nodes or at those named of each substructure."""

    def rooted(part: P) -> P:
        rigid = None if nodes is None else nodes(part)
        return part.with_members(lambda member: _rooted(member, rigid))

    parts = {name: rooted(part) for name, part in mechanism.substructures.items()}
    return rooted(mechanism).replaced({"substructures": parts})


def without_fillets(mechanism: Mechanism) -> Mechanism:
    """The same mechanism with sharp corners at the ends of its members."""

    def sharp(part: P) -> P:
        return part.with_members(
            lambda member: member.replaced({"fillet": (0.0, 0.0)}) if any(member.fillet) else member
        )

    parts = {name: sharp(part) for name, part in mechanism.substructures.items()}
    return sharp(mechanism).replaced({"substructures": parts})


def with_rigid_bodies(mechanism: Mechanism) -> Mechanism:
    """The same mechanism with bodies none of which bends."""

    def rigid(part: P) -> P:
        return part.replaced({"bodies": {key: body.replaced({"elastic": False}) for key, body in part.bodies.items()}})

    parts = {name: rigid(part) for name, part in mechanism.substructures.items()}
    return rigid(mechanism).replaced({"substructures": parts})


def _rooted(member: Link | Flexure, rigid: Container[str] | None) -> Link | Flexure:
    pairs = zip(member.nodes, member.root, strict=True)
    root = tuple("rigid" if rigid is None or node in rigid else kind for node, kind in pairs)
    fillet = tuple(0.0 if kind == "rigid" else radius for kind, radius in zip(root, member.fillet, strict=True))
    return member.model_copy(update={"root": root, "fillet": fillet})


def blank_part(part: SolidPart) -> Substructure:
    """What stands for a part before its file is read: its nodes, nobody knows where, between which something is."""
    nowhere = (math.nan, math.nan, math.nan)
    names = tuple(part.interfaces)
    nothing = Matrix(np.zeros((6 * len(names), 6 * len(names))))
    element = Superelement(nodes=names, stiffness=nothing, mass=nothing)
    return Substructure(superelements={"solid": element}, interface=names).replaced(
        {"nodes": dict.fromkeys(names, nowhere)}
    )


def with_parts_placed(
    mechanism: Mechanism, made: Callable[[str, str, SolidPart], Substructure] = lambda _, __, part: blank_part(part)
) -> Mechanism:
    """The same mechanism with an instance of a substructure in the place of each part; of equal parts one is made.

    `made` gets the substructure that a part is described in, empty for the mechanism itself, its name there and the
    part. An instance of the same name, which is wrong, stays.
    """
    substructures: dict[str, Substructure] = {}
    known: list[tuple[SolidPart, str]] = []

    def placed(name: str, holder: P) -> P:
        instances = dict(holder.instances)
        for key, part in holder.parts.items():
            here = {field: getattr(part, field) for field in PLACE}
            alike = part.replaced({field: SolidPart.model_fields[field].default for field in PLACE})
            of = next((of for other, of in known if other == alike), None)
            if of is None:
                of = f"{key} of {name}" if name else key
                while of in mechanism.substructures or of in substructures:
                    of = f"part {of}"
                known.append((alike, of))
                substructures[of] = made(name, key, part)
            instances.setdefault(key, Instance(of=of, **here))
        return holder.replaced({"instances": instances, "parts": {}})

    inside = {name: placed(name, part) for name, part in mechanism.substructures.items()}
    top = placed("", mechanism)
    return top.replaced({"substructures": {**inside, **substructures}})
