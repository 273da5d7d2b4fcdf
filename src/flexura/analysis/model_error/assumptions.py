"""What a description takes for granted of the part: beams, joints, bodies and the ground, and how wrong each may be.

Every assumption is a flexibility E that is left out or uncertain, of which a share, from measured errors, is to be
added to that of the model: of a member's own, of a root, of a body's solid. What it is for the forces f of motions is
f'E f, so that each is weighted by the energy that it holds of the very number that is asked for (theory eq. A1).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from flexura.analysis.model_error.elastic_bodies import Wrenches, loaded_solids, place_of
from flexura.analysis.model_error.measured import ratios_of, root_shares, stiffness_errors, unlike
from flexura.analysis.strain import bent_plates
from flexura.arrays import Array
from flexura.beam import COUPLED_FLEXIBILITY_BASIS, combine, ring_plate, root_coefficients
from flexura.errors import SolverError
from flexura.mechanism import CORRECTIONS, Flexure, Link, evaluated
from flexura.structure import MOST_SHARING, FullOrderModel

Interval = tuple[float, float]

ROOT_DRAWN = (-0.2, 0.2)
"""How far off at least, relative, the flexibility of a root is whose block is drawn."""

ROOT_TWIST = (-0.2, 0.3)
"""The same of its twist."""

ROOT_NOT_DRAWN = (-1.0, 0.5)
"""The same of a block that is not: from a rigid one to an edge of it."""

ROOT_LEFT_OUT = (0.0, 1.2)
"""Share of a root's flexibility that a model without it lacks."""

BODY = (0.1, 1.2)
"""Share of the estimated flexibility of a body that it has."""

BENDS = (-0.15, 0.15)
"""The same of a body that bends: how it differs from one that is pulled at by patches."""

AT_NOTCH = 3.5
"""The most of it where notches end in the body, whose flanks lead their load into little of it."""

GROUND = (0.0, 1.2)
"""Share of the estimated flexibility that the ground has where no block, or no held face of it, is described."""

ASKEW = (-1.3, -0.5)
"""Share of what is held by the nearer edge of a face that is not square to the member."""

SQUARE = 1e-4
"""Slope squared of a face from which it is not square to its member."""

GOES_ON = 0.05
"""How much more, relative, a member may give than between rigid faces where it goes on in a like section."""

RIGID_FACE = 2.0
"""How far what it ends in reaches beyond both its faces, over its thickness, from which that is a rigid face to it; one
thickness less, it goes on."""

EDGES = 2.65
"""What both edges of a diaphragm on half planes add to its flexibility, per thickness over width: each turns as 0.442
thicknesses more do (W. J. O'Donnell, J. Appl. Mech. 27 (1960) 461)."""

FEW = 1e-4
"""Relative change of a member's stiffness by more elements from which it is looked at."""

EVERYTHING = 1e30
"""Flexibility, J, of what is not known at all: beside it nothing else counts."""

DEFORMATIONS = ("stretch", "twist", "thickness bending", "thickness bending", "width bending", "width bending")
"""What is deformed in each of `ERRORS`, bending first by moments and then between parallel ends."""

WARPING, ROOT = CORRECTIONS.index("warping"), CORRECTIONS.index("root")

QUICKER, QUICKER_STRIP = 2.6, 5.5
"""Squared frequency of twisting vibrations, at most, over that of a model that twists evenly: of notches, and of strips
of so many elements that these do not share their warping, 500.56/12 pi^2 and a third for what thin strips leave out."""


@dataclass(frozen=True)
class Assumption:
    """What the description takes for granted, and how wrong that may be.

    `kind`: beam, elements, root, body, ground or mesh; `place`: what it is about; `text`: what is assumed.
    `flexibility` (k, k), J, is that of the forces of k motions; `share`: the least and the most of it that is to be
    added, None where there is no evidence, for a `reason`. Assumptions of one `group` are wrong alike.
    """

    kind: str
    place: str
    text: str
    group: str
    flexibility: Array
    share: Interval | None
    reason: str = ""
    whole: Array | None = None
    """Flexibility (k, k), J, of a part that is drawn, in which nothing else is taken for granted."""


class _Beam(NamedTuple):
    """A member: prototype, its elements there, what it is called and of what kind it is, the shares of its flexibility
    in each of DEFORMATIONS, None where there are none for a `reason`, those by the number of elements, and that of
    uneven twist, None where it does not count."""

    name: str
    elements: slice
    place: str
    kind: str
    taken_as: str
    shares: Sequence[Interval | None]
    few_elements: Sequence[float]
    uneven_twist: Interval | None
    reason: str


class _Root(NamedTuple):
    """A root: prototype, element and end there, parts of its flexibility (6, 6), element axes, each with its share, and
    what is assumed of it."""

    name: str
    element: int
    end: int
    parts: Sequence[tuple[Array, Interval]]
    place: str
    text: str
    group: str


class Assumptions:
    """What a model assumes, worked out once for the forces of many motions."""

    def __init__(self, full: FullOrderModel) -> None:
        self._full = full
        self._values = full.plan.scoped_values(full.parameters)
        self._beams = [beam for name in full.matrices for beam in _beams(full, name, self._values)]
        self._roots = list(_roots(full))

    def of(self, wrenches: Wrenches, states: Array) -> list[Assumption]:
        """All of them, with their flexibility in k motions: by the forces in members, and displacements (order, k)."""
        assumptions = [one for beam in self._beams for one in self._of_beam(beam, wrenches[beam.name])]
        for root in self._roots:
            force = wrenches[root.name][root.end][:, root.element]
            for flexibility, share in root.parts:
                E = np.einsum("icj,cd,idk->jk", force, flexibility, force)
                assumptions.append(Assumption("root", root.place, root.text, root.group, E, share))
        assumptions += _of_diaphragms(self._full, states)
        assumptions += _of_meshes(self._full, states)
        for body in loaded_solids(self._full, wrenches, self._values):
            kind = "ground" if body.held else "body"
            least, most = BENDS if body.bends else BODY if body.is_sure else GROUND
            members = [self._full.plan.parts[name].members[key] for name, key in (end.member for end in body.ends)]
            if not body.bends and any(
                isinstance(member, Flexure) and member.profile.type == "notch" for member in members
            ):
                most = AT_NOTCH
            about = kind, body.kind, body.text, kind
            try:
                assumptions.append(Assumption(*about, body.flexibility(), (least, most)))
            except SolverError as error:
                unknown = EVERYTHING * np.eye(body.ends[0].wrench.shape[-1])
                assumptions.append(Assumption(*about, unknown, None, str(error)))
        return assumptions

    def _of_beam(self, beam: _Beam, forces: tuple[Array, Array]) -> Iterator[Assumption]:
        """A member in every direction, from forces (i, e, 6, k) at both ends of the elements of its prototype."""
        C = self._full.matrices[beam.name].elements.member_C[beam.elements]
        start, force = (of_end[:, beam.elements] for of_end in forces)
        E = np.einsum("iecj,ieck->cjk", force, C @ force)
        parts = [E[0], E[3]]
        for along, about in ((2, 4), (1, 5)):
            bend = C[:, about, about]
            mean = np.einsum("e,iej->ij", bend / bend.sum(), (start[:, :, about] + force[:, :, about]) / 2)
            by_moments = bend.sum() * mean.T @ mean
            parts += [by_moments, E[along] + E[about] - by_moments]
        if max(map(abs, beam.few_elements)) > FEW:
            E = np.tensordot(np.array(beam.few_elements), [(part + part.T) / 2 for part in parts], axes=1)
            text = f"{beam.kind} in {len(C)} elements, where more are needed"
            yield Assumption("elements", beam.place, text, text, E, (1.0, 1.0))
        deformations, shares = [*DEFORMATIONS], [*beam.shares]
        if beam.uneven_twist is not None:
            twist, torque = C[:, 3, 3], force[:, :, 3]
            uneven = torque - np.einsum("e,iej->ij", twist / twist.sum(), torque)[:, None]
            E = np.einsum("e,iej,iek->jk", twist, uneven, uneven)
            parts[1] = parts[1] - E
            parts, deformations, shares = [*parts, E], [*deformations, "uneven twist"], [*shares, beam.uneven_twist]
        for deformation, part, share in zip(deformations, parts, shares, strict=True):
            text, group = f"{deformation} of a {beam.kind}, taken as a {beam.taken_as}", f"{beam.kind} {deformation}"
            reason = "" if share else beam.reason
            yield Assumption("beam", beam.place, text, group, (part + part.T) / 2, share, reason)


def _beams(full: FullOrderModel, name: str, values: Mapping[str, Any]) -> Iterator[_Beam]:
    """The members of a prototype, with how far their stiffness was measured to be off."""
    part, lengths, elements = full.plan.parts[name], full.geometry.parts[name].length, full.matrices[name].elements
    if not part.members:
        return
    nu = part.table.moduli(full.values)[2]
    active = part.table.corrections.active
    beyond = full.plan.roots.beyond[full.plan.roots.first[name] :]
    for m, (key, described) in enumerate(part.members.items()):
        own, length = slice(part.first[m], part.first[m + 1]), float(lengths[m])
        member = _with_section(full, evaluated(described, values))
        is_corrected = bool(active[m, :-1].any())
        errors = stiffness_errors(member, length, is_corrected, shears=bool(part.table.shear[m]), nu=float(nu[m]))
        kind, _ = ratios_of(member.section if isinstance(member, Link) else member.profile, length)
        uneven = None
        is_strip = bool(elements.torsion.place[own.start])
        is_shared = full.design.pose is not None or part.counts[m] <= MOST_SHARING
        if active[m, WARPING] and not (is_strip and is_shared):
            uneven = 1 / (QUICKER_STRIP if is_strip else QUICKER) - 1, 0.0
        goes_on = float(np.clip(RIGID_FACE - beyond[m].min(), 0.0, 1.0)) if active[m, ROOT] else 1.0
        shares = [
            (low + goes_on * (min(low, 0.0) - low), high + goes_on * (max(high, 0.0) + GOES_ON - high))
            for low, high in np.stack([errors.least, errors.most], axis=1) - errors.elements[:, None]
        ]
        yield _Beam(
            name=name,
            elements=own,
            place=place_of(name, key),
            kind=kind,
            taken_as="corrected beam" if is_corrected else "plain beam",
            shares=[None] * len(shares) if errors.reason else shares,
            few_elements=errors.elements.tolist(),
            uneven_twist=uneven,
            reason=errors.reason,
        )


def _of_meshes(full: FullOrderModel, states: Array) -> Iterator[Assumption]:
    """Parts that were reduced from a mesh, which is stiffer than they are: by as much as a second one tells."""
    text, topology = "taken as stiff as a mesh of it", full.plan.topology
    for name, prototype in full.plan.layout.prototypes.items():
        for key, part in prototype.superelements.items():
            if part.stiffness_error is None:
                continue
            for path in topology.copies[name].paths:
                place = ".".join((*path, key))
                q = full.superelement_coordinates(states, place)
                own, x = full.plan.parts[name].superelements[key], full.geometry.parts[name].positions
                at = x[own.nodes]
                K, n = own.matrices(full.values, at)[0], len(q)
                E, K = (q.T @ A @ q for A in (own.over_nodes(part.stiffness_error.array, at), K[:n, :n]))
                whole = K if part.mesh is not None and part.mesh.complete_hz is not None else None
                yield Assumption("mesh", place, text, "mesh", E, (0.0, 1.0), whole=whole)


def _of_diaphragms(full: FullOrderModel, states: Array) -> Iterator[Assumption]:
    """Shear, which Kirchhoff's plates leave out, and edges that give, as a half plane does, where none is drawn."""
    for bent in bent_plates(full, full.node_displacements(states)):
        plate, d = bent.plate, bent.motion
        if plate is None:
            continue
        k = ring_plate.stiffnesses(plate) * np.array([0, 0, 1, 1, 1, 0])
        E = d.T @ (k[:, None] * d)
        edges = EDGES * float(plate.thickness / (plate.rim - plate.hub))
        for what, share in (("without shear", (0.0, 2 * float(plate.shear))), ("between rigid edges", (0.0, edges))):
            yield Assumption("plate", bent.place, f"bending of a diaphragm {what}", f"diaphragm {what}", E, share)


def _with_section(full: FullOrderModel, member: Link | Flexure) -> Link | Flexure:
    """A member with its own section, in numbers, where it names one."""
    if isinstance(member, Link) and isinstance(member.section, str):
        section = full.plan.layout.mechanism.sections[member.section]
        return member.model_copy(update={"section": evaluated(section, full.plan.scoped_values(full.parameters))})
    return member


def _roots(full: FullOrderModel) -> Iterator[_Root]:
    """Every elastic root, and those that are left out."""
    plan, first = full.plan, 0
    members: list[tuple[str, str, int]] = []
    for name, part in plan.parts.items():
        members += [(name, key, first) for key in part.members]
        first += len(part.connectivity)
    for roots, is_in in ((plan.roots, True), (plan.roots_left_out, False)):
        found = roots.of(full.values, full.geometry)
        if found is None:
            continue
        copies, ratios = roots.ratios(full.values, full.geometry)
        slants = roots.slants(full.values, full.geometry)
        measured, differences = root_shares(ratios), unlike(ratios)
        for k, (element, end, coefficients) in enumerate(zip(*found, strict=True)):
            rows, is_drawn = np.flatnonzero(copies == k), bool(roots.is_known[k])
            if not len(rows):  # off its block in this design: there is no root
                continue
            text, shares = _joint(is_drawn, max(differences[i] for i in rows), measured[rows])
            if not is_in:
                text, shares = "rigid joint, without the correction for roots", [ROOT_LEFT_OUT] * 4
            steep = float((slants[k] ** 2).sum())
            shares = [(max(low - steep / (1 + steep), -1.0), high) for low, high in shares]
            name, key, start = members[roots.members[k]]
            at, place = (name, int(element) - start, int(end)), place_of(name, key)
            group = "root" if is_drawn else "root not drawn"
            stretch, twist, *bending = zip(_deformed(coefficients, int(end)), shares, strict=True)
            in_twist = f"{text}, in twist" if is_in and is_drawn else text
            yield _Root(*at, [stretch, *bending], place, text, group)
            yield _Root(*at, [twist], place, in_twist, f"{group} in twist")
            if steep > SQUARE:
                held = _held_askew(full, int(roots.members[k] - roots.first[name]), at, slants[k])
                yield _Root(*at, [(held, ASKEW)], place, "end at an angle to its block", "askew")


def _joint(is_drawn: bool, difference: str, measured: Array) -> tuple[str, list[Interval]]:
    """What is assumed of a joint with a block, and the shares of its flexibility in stretch, twist, thickness and width
    bending, from those (i, 4, 2) that were measured of joints like its copies; `difference` says in what they are
    unlike."""
    if is_drawn:
        text, shares = "joint with a block", [ROOT_DRAWN, ROOT_TWIST, ROOT_DRAWN, ROOT_DRAWN]
    else:
        text, shares = "joint with a block that is not drawn, taken as a large one", [ROOT_NOT_DRAWN] * 4
    if is_drawn or difference:
        least, most = measured[..., 0].min(axis=0).tolist(), measured[..., 1].max(axis=0).tolist()
        shares = [(min(low, a), max(high, b)) for (low, high), a, b in zip(shares, least, most, strict=True)]
    return f"{text} {difference}".strip(), shares


def _deformed(coefficients: Array, end: int) -> list[Array]:
    """A root's flexibility as parts (6, 6) in stretch, twist, thickness bending and width bending, with couplings in
    the bending."""
    C = combine(root_coefficients(coefficients, 0.0, end), COUPLED_FLEXIBILITY_BASIS, 6)
    parts = [np.zeros_like(C) for _ in range(4)]
    parts[0][0, 0], parts[1][3, 3] = C[0, 0], C[3, 3]
    for part, plane, other in ((parts[2], (0, 2, 4), 0), (parts[3], (1, 3, 5), 3)):
        part[np.ix_(plane, plane)] = C[np.ix_(plane, plane)]
        part[other, other] = 0.0
    return parts


def _held_askew(full: FullOrderModel, m: int, at: tuple[str, int, int], slopes: Array) -> Array:
    """Flexibility (6, 6), element axes, of what of member m is held by the nearer edge of a face that is not square to
    it, of slopes (2,) towards y and z: in plane strain a quarter of its size times the slope squared."""
    name, element, end = at
    part, C = full.plan.parts[name], full.matrices[name].elements.member_C[element]
    step = full.geometry.parts[name].length[m] / (part.first[m + 1] - part.first[m])
    sizes = [size[m, end] for size in part.table.end_sizes(full.values, full.geometry.parts[name].length)]
    width, thickness = 0.25 * np.array(sizes) * slopes**2 / (1 + 0.12 * slopes**2)
    return np.diag([0.0, 0.0, 0.0, 0.0, C[4, 4] * thickness / step, C[5, 5] * width / step])
