"""One prototype's own part: the nodes and members declared in it, laid out once and evaluated for many designs.

Quantities are in the prototype's own frame. Nodes are numbered: own nodes, bodies, nodes of instances that own parts
refer to ("foreign" nodes), then the mesh nodes inside members. Amplitudes of superelements come last, six to a node
that has no position: frames and rigid arms leave them alone, and what the last of these nodes does not use is unit
stiffness without mass in the part's matrices and has no DOF.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import SectionProperties, member_frame, rigid_arm
from flexura.duals import with_slopes_of, zeros
from flexura.mechanism import TOP, Flexure, Layout, Link, matching
from flexura.records import Latest
from flexura.structure.diaphragms import DiaphragmElement
from flexura.structure.discrete_elements import (
    BodyElement,
    Lumped,
    PartChannels,
    PointMassElement,
    SpringElement,
    StopElement,
    SuperelementMatrices,
    least_aligned,
)
from flexura.structure.elastic_bodies import AMPLITUDES, Bending, ElasticBody, EndSizes, seat
from flexura.structure.elements import STATIONS, WEIGHTS, ElementSlice
from flexura.structure.members import Members
from flexura.structure.values import ValueTable, common, picked

GIVEN_AXES = (2, 3, 2, 2, 1)
"""Axes, beside that of designs, of positions of own nodes, offsets, references, positions of foreign nodes, and shifts
of neutral axes."""


class PartGeometry(NamedTuple):
    """Where everything is: node positions (..., n, 3), m; member lengths (..., m), m, frames R (..., m, 3, 3)
    with local axes as rows; end offsets (..., m, 2, 3), m."""

    positions: Array
    length: Array
    R: Array
    offsets: Array

    def one(self, number: int) -> PartGeometry:
        """That of one design of a stack."""
        own = zip(self, (2, 1, 3, 3), strict=True)
        return PartGeometry(*(field[number] if field.ndim > axes else field for field, axes in own))


class DiscreteElement(NamedTuple):
    """A dense matrix over some nodes of a part, by the name of what it stands for; K and M may be None."""

    name: str
    nodes: list[int]
    K: Array | None
    M: Array | None

    def one(self, number: int) -> DiscreteElement:
        """That of one design of a stack."""
        K, M = (own if own is None or own.ndim < 3 else own[number] for own in (self.K, self.M))
        return self._replace(K=K, M=M)


@dataclass(frozen=True)
class Strips:
    """What resists torque that varies along strips, whose elements (m, n) share their warping, over their nodes
    (m, n + 1), part's frame.

    `torque` (..., m, n, 6n + 6) is that of each element by displacements, as if by itself; the others add
    N (..., m, n, n) times it (theory eq. F28).
    """

    elements: Index
    nodes: Index
    torque: Array
    N: Array

    @cached_property
    def K(self) -> Array:
        """Stiffness (..., m, 6n + 6, 6n + 6)."""
        return np.swapaxes(self.torque, -1, -2) @ self.N @ self.torque

    @property
    def each(self) -> Iterator[DiscreteElement]:
        """The strips one by one."""
        for k, nodes in enumerate(self.nodes.tolist()):
            yield DiscreteElement("", nodes, self.K[..., k, :, :], None)


@dataclass(frozen=True)
class PartMatrices:
    """Everything elastic and massive of a part for one design or a stack of them.

    T (..., e, 12, 12) leads from the nodes' displacements in the part's frame to those of the elements' ends in
    element axes, and `connectivity` (e, 2) numbers the nodes.
    """

    elements: ElementSlice
    connectivity: Index
    transforms: Callable[[], Array]
    discrete: Callable[[], list[DiscreteElement]]

    @cached_property
    def T(self) -> Array:
        """T (..., e, 12, 12)."""
        return self.transforms()

    @cached_property
    def discrete_elements(self) -> list[DiscreteElement]:
        """Matrices of everything but beams."""
        return self.discrete()

    @cached_property
    def strips(self) -> list[Strips]:
        """What strips add to the stiffness of their elements, which share their warping (theory eq. F28)."""
        strips = []
        for elements, S in self.elements.couplings:
            n = elements.shape[1]
            k = self.elements.K[..., elements, 9, :]
            rows = (k[..., None, :] @ self.T[..., elements, :, :])[..., 0, :]
            A = zeros((*rows.shape[:-1], 6 * n + 6), rows)
            for e in range(n):
                A[..., e, 6 * e : 6 * e + 12] = rows[..., e, :]
            N = np.linalg.inv(np.eye(n) - S * k[..., None, :, 9]) @ S
            nodes = np.concatenate([self.connectivity[elements, 0], self.connectivity[elements[:, -1:], 1]], axis=1)
            strips.append(Strips(elements, nodes, A, (N + np.swapaxes(N, -1, -2)) / 2))
        return strips

    def twist_shared(self, u: Array) -> Array:
        """Twist (copies, e, k), rad, by which elements are as if wound further, since they share their warping, for
        displacements u (copies, nodes, 6, k) in the part's frame: a wrench more of `C^-1` or K times it."""
        shared = zeros((len(u), len(self.connectivity), u.shape[-1]), u, self.T)
        for strips in self.strips:
            count, n = strips.nodes.shape
            moved = u[:, strips.nodes].reshape(len(u), count, 6 * n, u.shape[-1])
            shared[:, strips.elements] = strips.N @ (strips.torque @ moved)
        return shared


class BentBody(NamedTuple):
    """A body that bends, by its name, and its matrices over its nodes."""

    name: str
    body: ElasticBody
    K: Array
    M: Array


class _Nodes:
    """Numbers the nodes of a part while its members are laid out."""

    def __init__(self, names: list[str]) -> None:
        self.names = list(names)
        self.number = {name: k for k, name in enumerate(names)}

    def get(self, name: str) -> int:
        if name not in self.number:
            self.number[name] = len(self.names)
            self.names.append(name)
        return self.number[name]


class Part:
    """Layout of one prototype's own part."""

    def __init__(self, layout: Layout, name: str, table: ValueTable, bending: Bending) -> None:
        self.name = name
        prototype = layout.prototypes[name]
        mechanism = layout.mechanism
        frames = {key: f"{key}[held]" for key, hold in bending.bodies.items() if hold is not None}
        seats = {key: seat(key) for key in prototype.bodies if key in bending.seated}
        nodes = _Nodes([*layout.own_nodes(name), *frames.values(), *seats.values()])
        self.n_own: int = len(nodes.names)
        self.members: dict[str, Link | Flexure] = {**prototype.links, **prototype.flexures}
        ends = [[nodes.get(end) for end in member.nodes] for member in self.members.values()]
        self.diaphragms: dict[str, DiaphragmElement] = {
            key: DiaphragmElement(table, diaphragm, mechanism, [nodes.get(n) for n in diaphragm.nodes])
            for key, diaphragm in prototype.diaphragms.items()
        }
        self.springs: dict[str, SpringElement] = {
            key: SpringElement(table, spring, [nodes.get(n) for n in spring.nodes])
            for key, spring in prototype.springs.items()
        }
        self.points: dict[str, tuple[int, PointMassElement]] = {
            key: (nodes.get(point.node), PointMassElement(table, point)) for key, point in prototype.masses.items()
        }
        self.bodies: dict[str, tuple[int, BodyElement]] = {
            key: (nodes.get(key), BodyElement(table, body, mechanism)) for key, body in prototype.bodies.items()
        }
        self.superelements: dict[str, SuperelementMatrices] = {
            key: SuperelementMatrices(table, part, [nodes.get(n) for n in part.nodes])
            for key, part in prototype.superelements.items()
        }
        self.dashpots: dict[str, SpringElement] = {
            key: SpringElement(table, dashpot, [nodes.get(n) for n in dashpot.nodes])
            for key, dashpot in prototype.dashpots.items()
        }
        self.stops: dict[str, StopElement] = {
            key: StopElement(table, stop, [nodes.get(n) for n in stop.nodes]) for key, stop in prototype.stops.items()
        }
        self.channels: PartChannels = PartChannels(table, prototype, nodes.get)
        exposed = layout.exposed(name)
        self.carried: dict[int, list[int]] = {
            nodes.number[key]: [
                nodes.get(bending.seats.get(n, n)) for text in body.carries for n in matching(text, exposed)
            ]
            for key, body in prototype.bodies.items()
        }
        held = [key for key, body in prototype.bodies.items() if body.held is not None or key in frames]
        self.clamped: list[int] = [nodes.number[frames.get(key, key)] for key in held]
        """Nodes of what the ground holds at a face."""
        self.elastic: dict[str, ElasticBody] = {}
        """The bodies that bend, by name."""
        self.joints: list[tuple[int, int]] = [(nodes.get(a), nodes.get(b)) for a, b in prototype.joints]
        for key, hold in bending.bodies.items():
            number, body = self.bodies[key]
            on_face = [nodes.get(node) for node in hold.nodes] if hold is not None else []
            pulled = [n for n in self.carried[number] if n not in on_face]
            pulled += [nodes.number[seats[key]]] if key in seats else []
            frame = nodes.number[frames[key]] if key in frames else None
            self.elastic[key] = ElasticBody(body, number, pulled, frame, hold)
            self.joints += [(frame, node) for node in on_face if frame is not None]
        self.foreign: list[str] = nodes.names[self.n_own :]
        self.n_named: int = len(nodes.names)
        bodies = prototype.bodies
        centres = [body.centre for body in bodies.values()] + [bodies[key].centre for key in (*frames, *seats)]
        own_positions = [*prototype.nodes.values(), *centres]
        self._position_entries = np.array([table.add_all(p) for p in own_positions], dtype=np.intp).reshape(-1, 3)
        self._lay_out_members(layout, table, np.array(ends, dtype=np.intp).reshape(-1, 2))
        self._mesh(nodes)
        self.strips: list[Index] = []
        """Nodes (m, n + 1) of the strips whose elements share their warping, once the plan has settled them."""
        self.n_positioned: int = len(nodes.names)
        self._add_amplitudes(nodes)
        self.discrete: list[tuple[str, list[int], Lumped]] = self._discrete()
        """What is no member: names, nodes and what has the matrices."""
        self.node_names: list[str] = nodes.names
        self.node_number: dict[str, int] = nodes.number
        self.boundary: Index = self._boundary(layout, nodes)
        self._latest: Latest[PartGeometry] = Latest()

    def _lay_out_members(self, layout: Layout, table: ValueTable, ends: Index) -> None:
        mechanism = layout.mechanism
        members = list(self.members.values())
        self.ends = ends
        offsets = [[*m.start_offset, *m.end_offset] for m in members]
        self._offset_entries = np.array([table.add_all(o) for o in offsets], dtype=np.intp).reshape(-1, 2, 3)
        self._free_frame = np.array([m.reference is None for m in members], dtype=bool)
        references = [table.add_all(m.reference or (0.0, 0.0, 1.0)) for m in members]
        self._reference_entries = np.array(references, dtype=np.intp).reshape(-1, 3)
        strained = {own.member for own in layout.prototypes[self.name].actuators.values() if own.type == "strain"}
        self.driven: list[bool] = [key in strained for key in self.members]
        self.table: Members = Members(members, mechanism, table, self.driven)

    def _mesh(self, nodes: _Nodes) -> None:
        """Cut the members: mesh nodes `member[k]`, and the elements in order of members."""
        connectivity: list[tuple[int, int]] = []
        self.mesh_member: list[int] = []
        self.mesh_fraction: list[float] = []
        for position, (name, n) in enumerate(zip(self.members, self.counts, strict=True)):
            inner = [nodes.get(f"{name}[{k}]") for k in range(1, n)]
            chain = [self.ends[position, 0], *inner, self.ends[position, 1]]
            connectivity += list(pairwise(chain))
            self.mesh_member += [position] * (n - 1)
            self.mesh_fraction += [k / n for k in range(1, n)]
        self.connectivity: Index = np.array(connectivity, dtype=np.intp).reshape(-1, 2)

    def _add_amplitudes(self, nodes: _Nodes) -> None:
        """Number nodes without a position for the amplitudes of superelements, and let their matrices reach over
        these."""
        self.amplitude_names: dict[int, list[str]] = {}
        self.amplitude_at: list[int] = []
        for key, own in self.superelements.items():
            own.nodes += self._amplitude_nodes(nodes, key, own.amplitudes, own.nodes[0])
        for key, body in self.elastic.items():
            body.nodes += self._amplitude_nodes(nodes, key, AMPLITUDES, body.nodes[0])
        self.unused: NDArray[np.bool_] = np.zeros((len(nodes.names), 6), dtype=bool)
        """Which freedoms (n, 6) of the nodes for amplitudes stand for nothing."""
        for node, names in self.amplitude_names.items():
            self.unused[node, len(names) :] = True

    def _amplitude_nodes(self, nodes: _Nodes, key: str, count: int, at: int) -> list[int]:
        """Nodes that hold the amplitudes of a superelement; their place is that of one of its nodes."""
        names, extra = [f"{key} amplitude {k + 1}" for k in range(count)], []
        for first in range(0, count, 6):
            node = nodes.get(f"{key} amplitudes {first + 1} to {min(first + 6, count)}")
            self.amplitude_names[node] = names[first : first + 6]
            self.amplitude_at.append(at)
            extra.append(node)
        return extra

    def _boundary(self, layout: Layout, nodes: _Nodes) -> Index:
        """Nodes that a reduction keeps: the interface, what bodies carry, bodies, and nodes shared with instances.

        The mechanism itself keeps all its named nodes, unless it declares an interface. Nodes that nothing elastic or
        massive of this part touches are left out.
        """
        keep = {nodes.number[n] for n in layout.prototypes[self.name].interface if n in nodes.number}
        keep |= set(range(self.n_own, self.n_named))
        keep |= {node for node, _ in self.bodies.values()} | {n for ns in self.carried.values() for n in ns}
        keep |= {nodes.number[name] for name in nodes.number if name.endswith("[seat]")}
        keep |= {*self.clamped, *(n for joint in self.joints for n in joint)}
        if self.name == TOP:
            held = {n for text in layout.mechanism.ground for n in matching(text, list(nodes.number))}
            keep |= {nodes.number[n] for n in held}
            if not layout.prototypes[TOP].interface:
                keep |= set(range(self.n_named))
        return np.array(sorted(keep & self._active()), dtype=np.intp)

    def _active(self) -> set[int]:
        """Nodes that have elements or discrete elements of this part."""
        return set(self.connectivity.ravel().tolist()) | {n for nodes, _, _ in self.discrete_nodes() for n in nodes}

    @property
    def n_nodes(self) -> int:
        """Number of nodes, mesh nodes and those for amplitudes included."""
        return len(self.node_names)

    @cached_property
    def interior(self) -> Index:
        """Nodes that a reduction may remove."""
        return np.array(sorted(self._active() - set(self.boundary.tolist())), dtype=np.intp)

    @property
    def has_matrices(self) -> bool:
        """True when anything elastic or massive is declared in this prototype itself."""
        return bool(self.members or self.discrete or self.dashpots)

    @property
    def counts(self) -> Index:
        """Elements of every member (m,)."""
        return self.table.counts

    @property
    def first(self) -> Index:
        """First element of every member, and the number of all elements (m + 1,)."""
        return self.table.first

    def _discrete(self) -> list[tuple[str, list[int], Lumped]]:
        return [
            *((key, diaphragm.nodes, diaphragm) for key, diaphragm in self.diaphragms.items()),
            *((key, [node], body) for key, (node, body) in self.bodies.items() if key not in self.elastic),
            *((key, body.nodes, body) for key, body in self.elastic.items()),
            *((key, [node], point) for key, (node, point) in self.points.items()),
            *((key, spring.nodes, spring) for key, spring in self.springs.items()),
            *((key, own.nodes, own) for key, own in self.superelements.items()),
            *((key, piezo.nodes, piezo) for key, piezo in self.channels.piezos.items()),
            *((key, [node], mass) for key, node, mass in self.channels.masses),
        ]

    def discrete_nodes(self) -> list[tuple[list[int], bool, bool]]:
        """Nodes of the discrete elements in the order of their matrices, and whether they have stiffness and mass."""
        return [(nodes, part.has_stiffness, part.has_mass) for _, nodes, part in self.discrete]

    def offsets(self, values: Array) -> Array:
        """Offsets of the ends of members (..., m, 2, 3), m, as described, to the middle of their sections."""
        return picked(values, self._offset_entries)

    @property
    def geometry_entries(self) -> Index:
        """Entries on which node positions, and where members are, depend."""
        entries = (self._position_entries, self._offset_entries, self._reference_entries, self.table.shift_entries)
        return np.concatenate([own.ravel() for own in entries])

    def geometry(self, values: Array, foreign: Array) -> PartGeometry:
        """Geometry for values (..., s) and positions of the foreign nodes (..., f, 3); remembered while it is the same
        in all designs. What does not vary along the design axis lacks it."""
        positions, offsets = picked(values, self._position_entries), self.offsets(values)
        shift = self.table.axis_shift(values)
        shift = np.zeros(0) if shift is None else common(shift, 1)
        given = positions, offsets, picked(values, self._reference_entries), foreign, shift
        varies = any(numbers.ndim > n for numbers, n in zip(given, GIVEN_AXES, strict=True))
        if varies or with_slopes_of(*given) is not None:
            return self._geometry(*given)
        return self._latest.get(b"".join(numbers.tobytes() for numbers in given), lambda: self._geometry(*given))

    def _geometry(self, own: Array, offsets: Array, reference: Array, foreign: Array, shift: Array) -> PartGeometry:
        """Geometry for positions of own nodes (..., n, 3), offsets (..., m, 2, 3), references (..., m, 3) and shifts of
        neutral axes (..., m) or (0,)."""
        lead = np.broadcast_shapes(own.shape[:-2], offsets.shape[:-3], foreign.shape[:-2], shift.shape[:-1])
        positions = zeros((*lead, self.n_nodes, 3), own, offsets, foreign, reference, shift)
        positions[..., : self.n_own, :] = own
        positions[..., self.n_own : self.n_named, :] = foreign
        if not self.members:
            positions[..., self.n_positioned :, :] = positions[..., self.amplitude_at, :]
            return PartGeometry(positions, np.zeros(0), np.zeros((0, 3, 3)), offsets)
        ends = positions[..., self.ends, :] + offsets
        axis = ends[..., 1, :] - ends[..., 0, :]
        length = np.sqrt(np.einsum("...i,...i->...", axis, axis))
        if self._free_frame.any():
            reference = np.where(self._free_frame[:, None], least_aligned(axis), reference)
        R = member_frame(axis, reference)
        if shift.size:
            arm = shift[..., None] * R[..., 2, :]
            offsets, ends = offsets + arm[..., None, :], ends + arm[..., None, :]
        positions[..., self.n_named : self.n_positioned, :] = (
            ends[..., self.mesh_member, 0, :] + np.array(self.mesh_fraction)[:, None] * axis[..., self.mesh_member, :]
        )
        positions[..., self.n_positioned :, :] = positions[..., self.amplitude_at, :]
        return PartGeometry(positions, length, R, offsets)

    def element_transforms(self, geometry: PartGeometry) -> Array:
        """T (..., e, 12, 12): element-end displacements in element axes from node displacements, eqs. 21-23
        (theory eq. 37)."""
        R = geometry.R[..., self.table.element_member, :, :]
        T = np.zeros((*R.shape[:-2], 12, 12), like=R)
        for k in range(4):
            T[..., 3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = R
        for end, at in ((0, self.first[:-1]), (1, self.first[1:] - 1)):
            D = rigid_arm(geometry.offsets[..., end, :])
            six = slice(6 * end, 6 * end + 6)
            T[..., at, six, six] = T[..., at, six, six] @ D
        return T

    def prisms(self, values: Array, geometry: PartGeometry) -> list[tuple[Array, Array, Array]]:
        """Members as prisms: mass (e,), kg, inertia about the centre (e, 3, 3), kg m^2, and centre (e, 3), m.

        Part's frame; one design. Tapered elements give a slice for every station. Straight from density and sections,
        without the element mass matrices, for checking those.
        """
        _, rho, nu, _ = self.table.moduli(values)
        sections = self.table.section_properties(values, nu, geometry.length)
        tapered_fields = self.table.stations(values, nu, geometry.length)
        every = np.arange(len(self.connectivity))
        uniform = np.setdiff1d(every, np.concatenate([at for at, _ in tapered_fields]) if tapered_fields else [])
        section = SectionProperties(*(field[uniform] for field in sections))
        pieces = [self._prism(uniform, 0.5, 1.0, section, rho, geometry)]
        for at, stations in tapered_fields:
            for g, (x, w) in enumerate(zip(STATIONS, WEIGHTS, strict=True)):
                section = SectionProperties(*(field[:, g] for field in stations))
                pieces.append(self._prism(at, x, w, section, rho, geometry))
        return pieces

    def _prism(
        self, at: Index, x: float, share: float, section: SectionProperties, rho: Array, geometry: PartGeometry
    ) -> tuple[Array, Array, Array]:
        m = self.table.element_member[at]
        start = geometry.positions[self.ends[m, 0]] + geometry.offsets[m, 0]
        L, R = geometry.length[m] / self.counts[m], geometry.R[m]
        centre = start + ((at - self.first[m] + x) * L)[:, None] * R[:, 0]
        mass = rho[m] * section.A * L * share
        slender = mass * L**2 / 12 * (share == 1.0)
        rotary = rho[m] * L * share * self.table.rotary[m]
        polar = rho[m] * L * share * (section.Iy + section.Iz)
        local = np.stack([polar, slender + rotary * section.Iy, slender + rotary * section.Iz], axis=-1)
        return mass, np.einsum("eji,ej,ejk->eik", R, local, R), centre

    def discrete_elements(self, values: Array, geometry: PartGeometry, ends: EndSizes | None) -> list[DiscreteElement]:
        """Matrices of diaphragms, bodies, point masses, springs and superelements for values (..., s); `ends` are the
        sizes of the members of all prototypes, where bodies bend."""
        x = geometry.positions
        return [
            DiscreteElement(
                name,
                nodes,
                *(
                    part.superelement(values, x[..., nodes, :], ends)
                    if isinstance(part, ElasticBody) and ends is not None
                    else part.matrices(values, x[..., nodes, :])
                ),
            )
            for name, nodes, part in self.discrete
        ]

    def bent_bodies(self, discrete_elements: list[DiscreteElement]) -> Iterator[BentBody]:
        """The bodies that bend among the discrete elements of a design."""
        for (key, _, own), element in zip(self.discrete, discrete_elements, strict=True):
            if isinstance(own, ElasticBody) and element.K is not None and element.M is not None:
                yield BentBody(key, own, element.K, element.M)

    def resisted(self, values: Array, geometry: PartGeometry) -> list[tuple[Array, Array] | None]:
        """For the discrete elements in the order of `discrete_elements`, stiffness k and B (r, 6n) with K = B' k B
        where a discrete element resists displacements B u of its n nodes, as springs and pinned stacks do; else None.
        One design."""
        return [part.resisted(values, geometry.positions[nodes]) for _, nodes, part in self.discrete]

    def discrete_losses(self, values: Array, default: Any) -> list[Any]:
        """Loss factors of the discrete elements in the order of `discrete_elements`; `default` where there is none.
        One design."""
        return [default if part.loss is None else values[part.loss] for _, _, part in self.discrete]

    def dashpot_matrices(self, values: Array, geometry: PartGeometry) -> list[Array]:
        """Damping matrices (6n, 6n) of the dashpots over their nodes, part's axes."""
        return [d.matrix(values, geometry.positions[..., d.nodes, :]) for d in self.dashpots.values()]


CLAMPING_ARM = 0.5
"""Length of a rigid arm over the member's least thickness from which it holds the end flat altogether."""


def settle_ends(layout: Layout, part: Part, values: Array, geometry: PartGeometry) -> Array:
    """Return how far the ends of a part's members are clamped (m, 2), from 0, free, to 1, held flat.

    An end is clamped at a node that is held, carried, an interface or a joint to other parts, and on a rigid arm; free
    where it meets nothing. Other members hold it the more the bulkier they are (theory eq. F20), and so does a notch
    that is bulkier at its end than at its web; a right-circular one is held by the blocks that its factors are for.
    What holds most counts. What a member says of its `ends` goes before. One design: values (s,).
    """
    table = part.table
    J, web, thickness = table.bulk(values, geometry.length)
    arm = np.linalg.norm(part.offsets(values), axis=-1) / (CLAMPING_ARM * thickness[:, None])
    own = np.maximum(_hold(J / web, 0.0), table.corrections.held(values, geometry.length)[:, None])
    clamped = np.maximum(np.minimum(arm, 1.0), own)
    shared = _clamping_nodes(layout, part)
    axis = geometry.R[:, 0]
    at: dict[int, list[tuple[int, int]]] = {}
    for member, ends in enumerate(part.ends.tolist()):
        for end, node in enumerate(ends):
            at.setdefault(node, []).append((member, end))
    for node, meeting in at.items():
        if node in shared:
            for place in meeting:
                clamped[place] = 1.0
            continue
        members, ends = np.array(meeting).T
        sine = np.linalg.norm(np.cross(axis[members][:, None], axis[members]), axis=-1)
        across = np.maximum(sine**2, np.minimum(arm[members, ends], 1.0))
        held = _hold(J[members, ends] / J[members, ends][:, None], across)
        held[members[:, None] == members] = 0.0
        clamped[members, ends] = np.maximum(clamped[members, ends], held.max(axis=1))
    for k, member in enumerate(part.members.values()):
        if member.ends is not None:
            clamped[k] = [end == "clamped" for end in member.ends]
    return clamped


def _hold(ratio: Array, across: Array | float) -> Array:
    """How far an end is held by what has `ratio` times its torsion constant (theory eq. F20).

    `across` is the square of the sine of the angle between the two.
    """
    return np.clip((ratio * (1 + across) - (1 - across)) / (1 + ratio), 0.0, 1.0)


def _clamping_nodes(layout: Layout, part: Part) -> set[int]:
    """Nodes that anything but this part's own members holds."""
    prototype = layout.prototypes[part.name]
    names = set(prototype.interface) | set(prototype.bodies)
    names |= {name for joint in prototype.joints for name in joint}
    held = (*prototype.diaphragms.values(), *prototype.superelements.values())
    names |= {name for element in held for name in element.nodes}
    if part.name == TOP:
        names |= {name for text in prototype.ground for name in matching(text, list(part.node_number))}  # type: ignore[attr-defined]
    nodes = {part.node_number[name] for name in names if name in part.node_number}
    nodes |= {node for carried in part.carried.values() for node in carried}
    return nodes | set(range(part.n_own, part.n_named))
