"""Mechanisms in which superelements that are reduced from solid meshes take the place of members.

How far the stiffness of a reduced piece may be off for its mesh, from that of a second mesh (theory eqs. B7-B8).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any, Literal, TypeVar

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.deadline import Listener, announcer
from flexura.errors import ModelError, OptionError, Problem, SolverError
from flexura.expressions import Expression
from flexura.fem.bodies import held_parameters, with_meshed_bodies
from flexura.fem.components import Component, own_components, turned
from flexura.fem.drawn_parts import with_parts_reduced
from flexura.fem.figures import sheet_of
from flexura.fem.geometry import MemberSolid
from flexura.fem.meshing import SIZES
from flexura.fem.reduced import Announce, Piece, ReducedPiece, reduced_piece
from flexura.fem.sheets import CutApartError, ReducedSheet, reduced_sheet
from flexura.mechanism import (
    TOP,
    Box,
    Composite,
    DiagonalStiffness,
    Diaphragm,
    FlatSpring,
    Flexure,
    Layout,
    Link,
    Matrix,
    Mechanism,
    Meshed,
    Part,
    RigidBody,
    Sheet,
    Spring,
    Substructure,
    Superelement,
    composites,
    evaluated,
    expanding,
    has_solid_members,
    matching,
    mesh_sizes,
    needs_meshes,
    origin_of,
    problems,
    scalars,
    sheets,
    solid_members,
    with_rigid_roots,
)
from flexura.structure import FullOrderModel, Plan, checked_design, full_order_model

ORDERS = (1.4, 1.0)
"""Orders with the length of cells to which the stiffness of members by themselves, and of fused ones, is taken to
converge: stresses at a held edge make it 1.42 (nu = 0.3), in a corner between members 1.09 (Williams, 1952)."""

MESH_RATIOS = (2.0, 1.5)
"""Least ratio of the DOFs of a mesh to those of a coarser one, and of a finer one to its, at which the two tell an
error: others may differ in nothing that matters."""


Meshables = Mapping[str, Link | Flexure | Diaphragm | FlatSpring]
BLANK = (1e-3, 1e-3, 1e-3)
"""Sides of the boxes that stand for composites before these are meshed, m."""

LEFT_OUT = {"mesh_size", "slits", "flat_springs"}
"""What of a description the plan has not from which places are taken."""
KINDS: dict[type[Part], str] = {
    Link: "links",
    Flexure: "flexures",
    Diaphragm: "diaphragms",
    FlatSpring: "flat_springs",
    RigidBody: "bodies",
}
P = TypeVar("P", bound=Substructure)


def stiffness_error(piece: Piece, reduced: ReducedPiece, size: float, modes: int, announce: Announce) -> Array:
    """E (n, n), positive semidefinite: strain energy of displacements v is uncertain by half of v' E v (eq. B8).

    `reduced` is the piece in normal form, from the mesh of a `size` with `modes` fixed-interface modes. Beside it
    stands a mesh of cells twice as long, or finer ones where that is hardly coarser. Raises SolverError when there is
    no second mesh, and errors as `reduced_piece` does.
    """
    for other, second in _others(piece, size, modes, announce):
        ratio = other.dofs / reduced.dofs
        if 1 / MESH_RATIOS[0] < ratio < MESH_RATIOS[1] or other.amplitudes < reduced.amplitudes:
            continue
        longer = min(max(ratio, 1 / ratio) ** (1 / 3), max(second / size, size / second))
        longer **= ORDERS[len(piece.members) > 1]
        off = (1 if ratio < 1 else longer) / (longer - 1)
        return off * _difference(piece.places, reduced, other)
    raise SolverError(f"no second mesh tells how fine that of size {size:g} is: the errors of others are not known")


def _others(piece: Piece, size: float, modes: int, announce: Announce) -> Iterator[tuple[ReducedPiece, float]]:
    """The piece reduced from other meshes, and their sizes: a coarser one, then finer ones."""
    finer = (2.0, 4.0, 8.0) if len(piece.members) == 1 else (1.5, 2.0, 4.0, 8.0)
    for second in (2 * size, *(size / factor for factor in finer)):
        if not SIZES[0] <= second <= SIZES[1]:
            continue
        label = f"{'coarser' if second > size else 'finer'} mesh, size {second:g}"
        try:
            other = reduced_piece(
                piece, second, modes, announce=lambda stage, label=label: announce(f"{label}: {stage}")
            )
        except SolverError:
            if second < size:
                raise
            continue  # a mesh may be too coarse for its solid
        yield other, second


def _difference(places: Array, reduced: ReducedPiece | ReducedSheet, other: ReducedPiece | ReducedSheet) -> Array:
    """The absolute value of the difference of two stiffnesses, in the norm of the first (eq. B7)."""
    n, m = len(reduced.K), len(reduced.fixed_hz)
    b = n - m
    rigid = np.zeros((b, 6))
    rigid[: 6 * len(places)] = rigid_arm(places - places[0]).reshape(-1, 6)
    stiff = np.sqrt(np.maximum(reduced.K.diagonal()[:b], 0.0))
    difference = np.zeros((n, n))
    if b > 6:
        scaled, wanted = (A[:b, :b] / np.outer(stiff, stiff) for A in (reduced.K, other.K))
        Q = la.null_space((stiff[:, None] * rigid).T)
        values, vectors = la.eigh(Q.T @ (wanted - scaled) @ Q, Q.T @ scaled @ Q)
        half = stiff[:, None] * (scaled @ (Q @ vectors))
        difference[:b, :b] = (half * np.abs(values)) @ half.T
    at = np.arange(b, n)
    difference[at, at] = np.abs((other.fixed_hz[:m] / reduced.fixed_hz) ** 2 - 1) * reduced.K[at, at]
    return difference


@verb
def with_solid_parts(
    model: Mechanism,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    keep: int = 2,
    size: float = 1.0,
    progress: Listener | None = None,
) -> Mechanism:
    """The mechanism with its parts from CAD, members of `fidelity: solid`, and sheets, as superelements, and its
    composites meshed, all else unchanged.

    Solid members of one substructure that meet are fused into one superelement, which has the name of its first member;
    nodes inside it that nothing else names are left out. `keep` fixed-interface modes of every superelement are kept;
    `size` multiplies the `mesh_size` of all members, of which fused ones take the smallest; `progress` is told each
    step. A second mesh tells how far off the stiffness may be, which every superelement carries as `stiffness_error`.
    `parameters` become the values of those parameters, and all parameters on which a solid depends are held at their
    values. Superelements keep the loss factor of their members and have no stresses. Raises OptionError for members
    without a form, such as sections given by constants, and fused ones of different loss factors; ModelError for names
    that a superelement has already.
    """
    if not isinstance(model, Mechanism):
        raise OptionError(f"a Mechanism is expected, not a {type(model).__name__}; flexura.load reads a file")
    if not isinstance(keep, int) or keep < 0:
        raise OptionError(f"keep = {keep!r}: a whole number, zero or more")
    if not needs_meshes(model):
        return model
    if not 0 < size < np.inf:
        raise OptionError(f"size = {size!r}: what multiplies the mesh sizes of the description is above zero")
    tell = announcer(progress)
    model = with_parts_reduced(model, tell)
    if impossible := [problem for problem in problems(model) if LEFT_OUT & {*problem.path}]:
        raise ModelError(impossible)
    if not needs_meshes(model):
        return model
    plan = Plan(without_composites(without_sheets(as_beams(model))).replaced({"at": {}}))
    shaped = {name: found for name in plan.layout.prototypes if (found := composites(model, origin_of(name)))}
    _refuse_own_values(shaped)
    model = with_meshed_bodies(plan, model, shaped, parameters, tell)
    if not has_solid_members(model):
        return model
    chosen: dict[str, Meshables] = {
        name: meshed
        for name in plan.layout.prototypes
        if (meshed := {**solid_members(model, origin_of(name)), **sheets(model, origin_of(name))})
    }
    _refuse_own_values(chosen)
    plan.refuse_loads("members as solids")
    full = full_order_model(checked_design(plan, parameters))
    changed = {}
    for name, meshed in chosen.items():
        members = {key: member for key, member in meshed.items() if isinstance(member, Link | Flexure)}
        part: Substructure = model if name == TOP else model.substructures[name]
        superelements: dict[str, Superelement] = {}
        sizes = {key: size * relative for key, relative in mesh_sizes(model, name).items()}
        for component in own_components(full, name, list(members), _needed(model, part)) if members else ():
            cell_size = min(sizes[_short(member)] for member in component.members)
            element = _superelement(full, name, component, keep, size=cell_size, announce=tell)
            superelements[_short(component.members[0])] = element
        for key, described in meshed.items():
            if isinstance(described, Diaphragm | FlatSpring):
                superelements[key] = _sheet(full, name, key, described, keep, size=sizes[key], announce=tell)
        if taken := superelements.keys() & part.superelements.keys():
            above = () if name == TOP else ("substructures", name)
            rule, hint = "a superelement has the name of a solid member", "give it another name"
            raise ModelError(
                [Problem((*above, "superelements", key), "", rule, hint) for key in superelements if key in taken]
            )
        kept = {key: member for key, member in {**part.links, **part.flexures}.items() if key not in members}
        fused = {node for member in members.values() for node in member.nodes} - {
            node for member in (*kept.values(), *superelements.values()) for node in member.nodes
        }
        changed[name] = part.replaced(
            {
                "nodes": {key: at for key, at in part.nodes.items() if key not in fused},
                "links": {key: member for key, member in part.links.items() if key in kept},
                "flexures": {key: member for key, member in part.flexures.items() if key in kept},
                "diaphragms": {key: own for key, own in part.diaphragms.items() if key not in meshed},
                "flat_springs": {},
                "superelements": {**part.superelements, **superelements},
                "mesh_size": None,
            }
        )
    result = changed.get(TOP, model)
    substructures = {name: changed.get(name, part) for name, part in model.substructures.items()}
    held = held_parameters(plan, model, _names(plan.layout, model, chosen), parameters)
    return result.replaced({"substructures": substructures, "parameters": held, "mesh_size": None})


def as_beams(mechanism: Mechanism, corrections: Literal["auto", "none"] | None = None) -> Mechanism:
    """The same mechanism with all its members as beams, and with the same corrections for all where they are named."""
    solid: dict[str, Any] = {"fidelity": None, "mesh_size": None}
    update = solid if corrections is None else {**solid, "corrections": None}

    def beams(part: P) -> P:
        return part.with_members(lambda member: member.model_copy(update=update)).replaced(solid)

    parts = {name: beams(part) for name, part in mechanism.substructures.items()}
    named = {} if corrections is None else {"corrections": corrections}
    return beams(mechanism).replaced({"substructures": parts, **named})


def without_sheets(mechanism: Mechanism) -> Mechanism:
    """The same mechanism with whole rings, as plates, in the place of those with openings, and with springs between the
    nodes of flat ones."""

    def whole(part: P) -> P:
        rings = {key: own.as_ring for key, own in part.diaphragms.items()}
        soft = DiagonalStiffness(tx=1.0, ty=1.0, tz=1.0)
        pairs = {
            f"{key}{k}": pair for key, own in part.flat_springs.items() for k, pair in enumerate(pairwise(own.nodes))
        }
        springs = {key: Spring(nodes=pair, stiffness=soft) for key, pair in pairs.items()}
        return part.replaced({"diaphragms": rings, "flat_springs": {}, "springs": {**part.springs, **springs}})

    return whole(mechanism).replaced({"substructures": {k: whole(part) for k, part in mechanism.substructures.items()}})


def without_composites(mechanism: Mechanism) -> Mechanism:
    """The same mechanism with rigid boxes in the place of composites that are not meshed."""

    def boxed(part: P) -> P:
        bodies = {
            key: body.replaced({"solid": Box(size=BLANK, material=body.solid.material), "elastic": False})
            for key, body in part.bodies.items()
            if isinstance(body.solid, Composite) and body.solid.meshed is None
        }
        return part.replaced({"bodies": {**part.bodies, **bodies}})

    return boxed(mechanism).replaced({"substructures": {k: boxed(part) for k, part in mechanism.substructures.items()}})


def with_rigid_faces(mechanism: Mechanism) -> Mechanism:
    """The same mechanism with rigid roots where anything else than members is: there solids end in rigid faces."""

    return with_rigid_roots(mechanism, lambda part: _needed(mechanism, part))


def _needed(mechanism: Mechanism, part: Substructure) -> set[str]:
    """Own nodes of a substructure that something else than its members names."""
    nodes = list(part.nodes)
    texts = [*part.interface, *(node for joint in part.joints for node in joint)]
    for kind in ("diaphragms", "flat_springs", "springs", "superelements", "dashpots", "stops", "actuators", "sensors"):
        texts += [node for item in getattr(part, kind).values() for node in getattr(item, "nodes", ())]
    texts += [mass.node for mass in part.masses.values()]
    texts += [text for body in part.bodies.values() for text in body.carries]
    texts += list(mechanism.ground) if part is mechanism else []
    return {node for text in texts for node in matching(text, nodes)}


def _short(member: MemberSolid) -> str:
    """The name of a member in its prototype."""
    return member.name.split(".")[-1]


def _superelement(
    model: FullOrderModel,
    prototype: str,
    component: Component,
    modes: int,
    *,
    size: float,
    announce: Announce,
) -> Superelement:
    """A component over its nodes, in the frame of its prototype."""
    label = f"solid of {component.label}, size {size:g}"

    def tell(stage: str) -> None:
        announce(f"{label}: {stage}")

    unit = reduced_piece(component.piece, size, modes, announce=tell)
    error = stiffness_error(component.piece, unit, size, modes, tell)
    reduced = component.placed(unit)
    placed = model.plan.topology.copies[prototype]
    turn = turned(model.geometry.Q[placed.number[0]])
    T = la.block_diag(*[turn] * len(component.nodes), np.eye(reduced.amplitudes))
    K, M, E = (T.T @ A @ T for A in (reduced.K, reduced.M, component.placed(replace(unit, K=error)).K))
    part = model.plan.parts[prototype]
    losses = set()
    for member in component.members:
        described = part.members[_short(member)]
        loss = model.plan.mechanism.material(described.material).loss_factor
        losses.add(loss if described.loss_factor is None else described.loss_factor)
    if len(losses) > 1:
        rule = f"member {component.members[0].name} and those fused with it have different loss factors"
        raise OptionError(f"{rule}; give them all one loss_factor, or some of them fidelity: beam")
    metals = [model.plan.mechanism.material(part.members[_short(own)].material) for own in component.members]
    return Superelement(
        **expanding(metals),
        nodes=tuple(part.node_names[number - placed.offset[0]] for number in component.nodes),
        amplitudes=reduced.amplitudes,
        stiffness=Matrix((K + K.T) / 2),
        mass=Matrix((M + M.T) / 2),
        loss_factor=losses.pop(),
        stiffness_error=Matrix((E + E.T) / 2),
        mesh=Meshed(size=size, dofs=reduced.dofs),
    )


SHEET_RATIO = 1.5
"""Least ratio of the DOFs of a mesh to those of a coarser one at which the two tell an error of sheets."""


def _sheet(
    model: FullOrderModel,
    prototype: str,
    key: str,
    described: Diaphragm | FlatSpring,
    modes: int,
    *,
    size: float,
    announce: Announce,
) -> Superelement:
    """A sheet over its nodes, in the frame of its prototype. Raises ModelError where it is cut apart."""
    plan = model.plan
    values, part = plan.scoped_values(model.parameters), plan.parts[prototype]
    own, metal = evaluated(described, values), evaluated(plan.layout.mechanism.material(described.material), values)
    positions = model.geometry.parts[prototype].positions[[part.node_number[node] for node in described.nodes]]
    placed = sheet_of(own, metal, positions)
    place = ".".join(filter(None, (prototype, key)))

    def reduced(at: float, which: str = "") -> ReducedSheet:
        label = f"{which}sheet {place}, size {at:g}"
        return reduced_sheet(
            placed.figure, placed.thickness, placed.material, at, modes, lambda stage: announce(f"{label}: {stage}")
        )

    try:
        unit, other = reduced(size), reduced(2 * size, "second mesh of ")
        if unit.dofs < SHEET_RATIO * other.dofs:
            other = reduced(size / 2, "second mesh of ")
    except CutApartError as error:
        above = ("substructures", origin_of(prototype)) if prototype else ()
        hint = "shorter slits or wider spokes, or pads that meet what they hold"
        raise ModelError([Problem((*above, KINDS[type(described)], key), "", str(error), hint)]) from None
    count, origin = len(unit.fixed_hz), np.zeros((len(positions), 3))
    longer = max(unit.dofs / other.dofs, other.dofs / unit.dofs) ** (ORDERS[0] / 2)
    E = (1 if other.dofs < unit.dofs else longer) / (longer - 1) * _difference(origin, unit, other)
    T = la.block_diag(*placed.to_pads, np.eye(count))
    K, M, E = (T.T @ A @ T for A in (unit.K, unit.M, E))
    return Superelement(
        **expanding([metal]),
        nodes=described.nodes,
        amplitudes=count,
        stiffness=Matrix((K + K.T) / 2, placed.surface(unit.surface, T)),
        mass=Matrix((M + M.T) / 2),
        loss_factor=metal.loss_factor if own.loss_factor is None else own.loss_factor,
        stiffness_error=Matrix((E + E.T) / 2),
        mesh=Meshed(size=size, dofs=unit.dofs),
        sheet=Sheet(thickness=placed.thickness, normal=tuple(placed.axes[2].tolist()), stiffening=unit.stiffening),
    )


def _refuse_own_values(chosen: Mapping[str, Mapping[str, Part]]) -> None:
    """Raise ModelError for solids in instances with values of their own, which are meshed once."""
    rule = "a solid has one form, but an instance has values of its own for parameters that it depends on"
    bodies = any(isinstance(part, RigidBody) for parts in chosen.values() for part in parts.values())
    hint = "give that instance a substructure of its own" + ("" if bodies else ", or fidelity: beam")
    wrong = [
        ("substructures", origin_of(name), KINDS[type(member)], key)
        for name, members in chosen.items()
        for key, member in members.items()
        if origin_of(name) != name
    ]
    if wrong:
        raise ModelError(Problem(path, "", rule, hint) for path in dict.fromkeys(wrong))


def _names(layout: Layout, mechanism: Mechanism, chosen: Mapping[str, Meshables]) -> set[str]:
    """Parameters in members, their materials and sections, and the places of their nodes."""
    names: set[str] = set()
    for name, members in chosen.items():
        prototype = layout.prototypes[name]
        for member in members.values():
            parts: list[Any] = [member, mechanism.material(member.material)]
            if isinstance(member, Link) and isinstance(member.section, str):
                parts.append(mechanism.sections[member.section])
            for node in member.nodes:
                at = prototype.nodes.get(node)
                if at is not None:
                    names |= {n for x in at if isinstance(x, Expression) for n in x.names}
                else:
                    parts.append(prototype.bodies.get(node, prototype))
            if any("." in node for node in member.nodes):
                parts += mechanism.substructures.values()
            names |= {n for part in parts for _, _, x in scalars(part) if isinstance(x, Expression) for n in x.names}
    return names
