"""Natural modes of a mechanism whose members are solids, tied to the nodes of its beam model.

Members whose solids are fused make one piece; all else between pieces is rigid and lies at nodes. Pieces of equal
prototypes are equal but for their place, and are found once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import block_rotation, rigid_arm
from flexura.errors import OptionError
from flexura.linalg import lowest
from flexura.mechanism import Faces
from flexura.methods import Solution
from flexura.solid.fem.matrices import elastic_matrices
from flexura.solid.fem.reduced import (
    LEAST_MODES,
    Announce,
    EndTie,
    Matrices,
    Piece,
    ReducedPiece,
    Section,
    reduced_piece,
)
from flexura.solid.geometry import ENDS, MemberSolid, closed, joints, normalised, solids
from flexura.solid.mesh import SurfaceShape
from flexura.structure import FullOrderModel, full_order

Path = tuple[str, ...]

LARGEST_NU = 0.499
"""Poisson's ratios beyond this one lock the cells."""


REACH = 6.0
"""Fixed-interface modes are kept up to so many times the highest beam frequency asked for."""

SURE = 2.0
"""Modes are given up to the frequency, over this, from which fixed-interface modes are left out."""

OCTAVE = np.sqrt(2.0)
"""What modes left out may do is estimated by leaving out those of the last part of so much in frequency as well."""


class Copy(NamedTuple):
    """A placed copy of a component: its first member, turn Q (3, 3) and shift t (3,), m, from the first copy, and the
    numbers of its nodes by those of that."""

    name: str
    Q: Array
    t: Array
    node: Mapping[int, int]


@dataclass(frozen=True)
class Component:
    """A piece in place: members of its first copy, global frame, and all copies, the first one first.

    `nodes` (k,) are the numbers of the nodes that its faces follow, `section_nodes` those of its sections, in the first
    copy; `arms` (k, 3) and `section_arms` lead from the nodes to their places, m, global axes.
    """

    members: tuple[MemberSolid, ...]
    piece: Piece
    nodes: tuple[int, ...]
    arms: Array
    section_nodes: tuple[int, ...]
    section_arms: Array
    copies: tuple[Copy, ...]

    @property
    def label(self) -> str:
        """The first member, and how many more there are."""
        more = len(self.members) - 1
        return self.members[0].name + (f" and {more} more" if more else "")

    @property
    def tied(self) -> frozenset[str]:
        """End faces that follow nodes, such as `branch1.hinge start`."""
        return frozenset(f"{self.members[tie.member].name} {ENDS[tie.end]}" for tie in self.piece.ties)

    @property
    def frequency_scale(self) -> float:
        """Frequency of the piece in normal form over that of the component."""
        first = self.members[0]
        return first.length * np.sqrt(first.material.rho / first.material.E)

    def placed(self, unit: ReducedPiece) -> ReducedPiece:
        """The piece, worked out in normal form, over displacements of its nodes in the global axes of the first copy.

        Points and displacements of its surface are in these axes, too.
        """
        first = self.members[0]
        scaled = unit.scaled(first.length, first.material.E, first.material.rho)
        c, order = 6 * len(self.nodes), len(scaled.K)
        R = block_rotation(first.axes)
        T = la.block_diag(*(R @ rigid_arm(self.arms)), np.eye(order - c))
        average = (scaled.average @ T).reshape(-1, 6, order)
        average = (rigid_arm(-self.section_arms) @ R.T @ average).reshape(-1, order)
        rows = np.einsum("ji,sjc->sic", first.axes, scaled.surface.rows.reshape(-1, 3, order)).reshape(-1, order)
        rows[:, :c] = rows[:, :c] @ T[:c, :c]
        K, M = (T.T @ A @ T for A in (scaled.K, scaled.M))
        surface = replace(scaled.surface, points=first.placed(scaled.surface.points), rows=rows)
        return replace(scaled, K=(K + K.T) / 2, M=(M + M.T) / 2, average=average, surface=surface)


def components(model: FullOrderModel) -> list[Component]:
    """All members as components; equal ones once. Raises OptionError for members without a solid."""
    members = solids(model)
    fusions = joints(model, members)
    members = closed(members, fusions)
    where = _prototypes(model)
    equal: dict[tuple[str, tuple[str, ...], tuple[tuple[bool, ...], ...]], list[Sequence[int]]] = {}
    for group in fusions.groups:
        prefix = _prefix([members[k] for k in group])
        inside = tuple(members[k].name.split(".", len(prefix))[-1] for k in group)
        ties = tuple(tuple(fusions.tied[k].tolist()) for k in group)
        equal.setdefault((where[prefix][0], inside, ties), []).append(group)
    result = []
    for groups in equal.values():
        first, *others = ([members[k] for k in group] for group in groups)
        copies = [_copy(model, where, first, other) for other in (first, *others)]
        result.append(_component(model, where, first, fusions.tied[list(groups[0])], copies))
    return result


def own_components(
    model: FullOrderModel, prototype: str, chosen: Sequence[str], needed: AbstractSet[str]
) -> list[Component]:
    """Components of some members of a prototype, in its first placed copy; faces at the nodes `needed` are tied."""
    placed = model.plan.topology.copies[prototype]
    prefix, offset = placed.paths[0], placed.offset[0]
    names = {".".join((*prefix, name)) for name in chosen}
    members = solids(model, names)
    fusions = joints(model, members)
    members = closed(members, fusions)
    numbers = {offset + number for node, number in placed.part.node_number.items() if node in needed}
    tied = fusions.tied | np.array([[node in numbers for node in m.nodes] for m in members])
    where = _prototypes(model)
    here = Copy("", np.eye(3), np.zeros(3), {})
    return [
        _component(model, where, [members[k] for k in group], tied[list(group)], [here]) for group in fusions.groups
    ]


def turned(Q: Array) -> Array:
    """(6, 6) that turns a displacement; rotations are axial vectors, which mirror images turn the other way."""
    out = np.zeros((6, 6))
    out[:3, :3], out[3:, 3:] = Q, np.linalg.det(Q).round() * Q
    return out


def _component(
    model: FullOrderModel,
    where: Mapping[Path, tuple[str, int]],
    members: Sequence[MemberSolid],
    tied: NDArray[np.bool_],
    copies: Sequence[Copy],
) -> Component:
    """Fused members with the faces `tied` (m, 2)."""
    described = [_described(model, where, member) for member in members]
    nodes: list[int] = []
    ties = []
    for k, (member, (faces, _)) in enumerate(zip(members, described, strict=True)):
        if faces != "rigid" and tied[k].any() and member.shape.ends_in_edges:
            rule = f"member {member.name}: faces {faces} load the edges without thickness in which its contour ends"
            raise OptionError(f"{rule}, so that no mesh is fine enough; faces: rigid")
        if member.material.nu > LARGEST_NU:
            rule = f"member {member.name}: nu = {member.material.nu:g} is too near 0.5 for a solid"
            raise OptionError(f"{rule}; at most {LARGEST_NU}")
        for end in np.flatnonzero(tied[k]).tolist():
            if member.nodes[end] not in nodes:
                nodes.append(member.nodes[end])
            ties.append(EndTie(nodes.index(member.nodes[end]), k, end, faces))
    if not ties:
        raise OptionError(f"member {members[0].name} hangs on no node: none of its end faces is tied")
    sections: dict[int, Section] = {}
    for k, (_, inner) in enumerate(described):
        for element, node in enumerate((members[k].nodes[0], *inner, members[k].nodes[1])):
            if node not in nodes:
                sections.setdefault(node, Section(k, element, len(inner) + 1))
    normal = [replace(member, name=str(k)) for k, member in enumerate(normalised(members))]
    piece = Piece(tuple(normal), tuple(ties), tuple(sections.values()))
    first, positions = members[0], model.geometry.positions
    at_sections = np.array([piece.on_axis(s.member, s.element / s.elements) for s in sections.values()]).reshape(-1, 3)
    arms, section_arms = (
        first.placed(first.length * at) - positions[list(numbers)]
        for at, numbers in ((piece.places, nodes), (at_sections, sections))
    )
    return Component(tuple(members), piece, tuple(nodes), arms, tuple(sections), section_arms, tuple(copies))


def _prototypes(model: FullOrderModel) -> dict[Path, tuple[str, int]]:
    """Prototype and position among its copies of every instance."""
    return {
        path: (prototype, copy)
        for prototype, placed in model.plan.topology.copies.items()
        for copy, path in enumerate(placed.paths)
    }


def _described(
    model: FullOrderModel, where: Mapping[Path, tuple[str, int]], member: MemberSolid
) -> tuple[Faces, list[int]]:
    """How a placed member's faces follow, and the numbers of the nodes between its elements."""
    *path, name = member.name.split(".")
    prototype, copy = where[tuple(path)]
    part, offset = model.plan.parts[prototype], model.plan.topology.copies[prototype].offset[copy]
    elements = int(part.counts[list(part.members).index(name)])
    inner = [offset + part.node_number[f"{name}[{i}]"] for i in range(1, elements)]
    return part.members[name].faces, inner


def _prefix(members: Sequence[MemberSolid]) -> Path:
    """The longest path of an instance that holds all members."""
    paths = [member.name.split(".")[:-1] for member in members]
    same = takewhile(lambda keys: len(set(keys)) == 1, zip(*paths, strict=False))
    return tuple(keys[0] for keys in same)


def _copy(
    model: FullOrderModel,
    where: Mapping[Path, tuple[str, int]],
    first: Sequence[MemberSolid],
    other: Sequence[MemberSolid],
) -> Copy:
    """How one group of members lies to an equal one."""
    placed, geometry = model.plan.topology.copies, model.geometry
    prefixes = [_prefix(group) for group in (first, other)]
    old, new = (placed[where[prefix][0]].number[where[prefix][1]] for prefix in prefixes)
    Q = geometry.Q[new] @ geometry.Q[old].T
    node: dict[int, int] = {}
    for a, b in zip(first, other, strict=True):
        (prototype, i), (_, j) = (where[tuple(m.name.split("."))[:-1]] for m in (a, b))
        offset = placed[prototype].offset
        node |= {offset[i] + k: offset[j] + k for k in range(model.plan.parts[prototype].n_nodes)}
    return Copy(other[0].name, Q, geometry.t[new] - Q @ geometry.t[old], node)


@dataclass(frozen=True)
class SolidModes:
    """The lowest modes of a mechanism of solids.

    `solution` has frequencies and shapes at the nodes of the beam model, means over sections (theory eq. E6), of length
    one in the solid's mass matrix; `surfaces` are those of all placed pieces in these modes. `order` is that of the
    problem solved, `dofs` that of all meshes placed, `meshed_dofs` and `cells` of the distinct meshes; `mass`, kg, of
    solids and discrete elements; `size` the relative mesh size. `truncation` (m,) is about how much of each frequency
    the fixed-interface modes that are left out may take, relative; all up to `complete_hz` are kept.
    """

    solution: Solution
    order: int
    dofs: int
    meshed_dofs: int
    cells: int
    mass: float
    size: float
    truncation: Array
    complete_hz: float
    surfaces: tuple[SurfaceShape, ...] = ()


@dataclass(frozen=True)
class _Placed:
    """A copy of a component: its coordinates are S times those of the mechanism."""

    component: Component
    reduced: ReducedPiece
    copy: Copy
    S: sp.csc_matrix


def solid_modes(
    model: FullOrderModel,
    n: int = 6,
    size: float = 1.0,
    *,
    more: int = 0,
    hexahedra: bool = True,
    matrices: Matrices = elastic_matrices,
    announce: Announce = lambda _: None,
) -> SolidModes:
    """The `n` lowest modes with every member a solid that follows nodes at its ends (theory eqs. E1-E8).

    Distinct pieces are meshed and reduced once, with the fixed-interface modes up to `REACH` times the highest of the
    beam model's `n` frequencies, as far as MOST_MODES of a piece reach: there are fewer than `n` where that is
    less than SURE times their frequency. So many `more` come with them, less accurate, to be paired. `hexahedra`,
    `matrices` and `announce` as in `reduced_piece`. Raises OptionError and SolverError.
    """
    values = lowest(model.K, model.M, min(n, model.order)).values
    top = REACH * float(np.sqrt(max(values[np.isfinite(values)].max(initial=0.0), 0.0)) / (2 * np.pi))
    made: list[tuple[Component, ReducedPiece]] = []
    for component in components(model):
        label = f"solid of {component.label}, size {size:g}"
        unit = reduced_piece(
            component.piece,
            size,
            LEAST_MODES,
            top * component.frequency_scale,
            hexahedra=hexahedra,
            matrices=matrices,
            announce=lambda stage, label=label: announce(f"{label}: {stage}"),
        )
        made.append((component, component.placed(unit)))
    return _solved(model, made, n + more, size, top)


def beam_mass(model: FullOrderModel) -> float:
    """Mass, kg, of all placed members by density, section and length."""
    total = 0.0
    for name, placed in model.plan.topology.copies.items():
        part = model.plan.parts[name]
        if part.members:
            masses = [mass.sum() for mass, _, _ in part.prisms(model.values, model.geometry.parts[name])]
            total += len(placed.paths) * float(np.sum(masses))
    return total


def _solved(
    model: FullOrderModel, made: list[tuple[Component, ReducedPiece]], n: int, size: float, top: float
) -> SolidModes:
    """Place all copies among the discrete elements of the beam model and solve."""
    complete = min((reduced.complete_hz for _, reduced in made), default=np.inf)
    high = np.zeros(0, dtype=np.intp)
    total = model.order + sum(len(component.copies) * reduced.amplitudes for component, reduced in made)
    K, M = (
        sp.csc_matrix((A.data, A.indices, np.append(A.indptr, [A.nnz] * (total - model.order))), (total, total))
        for A in full_order(model.plan).discrete_matrices(model.design)
    )
    placed, first = [], model.order
    for component, reduced in made:
        for copy in component.copies:
            numbers = np.array([copy.node[node] for node in component.nodes])
            S = _placing(model, turned(copy.Q), numbers, slice(first, first + reduced.amplitudes), total)
            K, M = K + S.T @ sp.csc_matrix(reduced.K) @ S, M + S.T @ sp.csc_matrix(reduced.M) @ S
            placed.append(_Placed(component, reduced, copy, S))
            first += reduced.amplitudes
            above = np.flatnonzero(reduced.fixed_hz[::-1] > complete / OCTAVE)
            high = np.concatenate([high, first - 1 - above])
    used = np.flatnonzero((K.diagonal() > 0) | (M.diagonal() > 0))
    if not len(used):
        raise OptionError("nothing in this mechanism can move: every node is held")
    hz, vectors = _lowest_hz(K, M, used, n)
    truncation = np.zeros(len(hz))
    if complete < top:
        sure = hz <= complete / SURE
        hz, vectors = hz[sure], vectors[:, sure]
        without = _lowest_hz(K, M, np.setdiff1d(used, high), len(hz))[0]
        truncation = without / np.where(hz > 0, hz, 1.0) - np.where(hz > 0, 1.0, 0.0)
    x = np.zeros((total, len(hz)))
    x[used] = vectors
    return SolidModes(
        solution=Solution("solid", len(used), hz, _shapes(model, placed, used, x)),
        order=len(used),
        dofs=sum(piece.reduced.dofs for piece in placed),
        meshed_dofs=sum(reduced.dofs for _, reduced in made),
        cells=sum(reduced.cells for _, reduced in made),
        mass=sum(len(component.copies) * reduced.mass for component, reduced in made),
        size=size,
        truncation=truncation,
        complete_hz=complete,
        surfaces=tuple(_surface(piece, x) for piece in placed),
    )


def _lowest_hz(K: sp.csc_matrix, M: sp.csc_matrix, used: Index, n: int) -> tuple[Array, Array]:
    """Frequencies (k,), Hz, and vectors of the `n` lowest modes, or fewer, over the coordinates `used`."""
    pairs = lowest(sp.csc_matrix(K[used][:, used]), sp.csc_matrix(M[used][:, used]), min(n, len(used)))
    finite = np.isfinite(pairs.values)
    return np.sqrt(np.maximum(pairs.values[finite], 0.0)) / (2 * np.pi), pairs.vectors[:, finite]


def _placing(model: FullOrderModel, turn: Array, nodes: Index, amplitudes: slice, total: int) -> sp.csc_matrix:
    """S (6 k + a, total): coordinates of a copy of a component from all coordinates, of which its a amplitudes are some
    (theory eq. E4); `turn` (6, 6) leads from its first copy, `nodes` (k,) are its own."""
    rows = sp.kron(sp.eye(len(nodes)), turn.T) @ model.design.node_rows(nodes)
    inner = sp.eye(amplitudes.stop - amplitudes.start, total, k=amplitudes.start)
    outer = sp.csc_matrix((rows.shape[0], total - rows.shape[1]))
    return sp.csc_matrix(sp.vstack([sp.hstack([rows, outer]), inner]))


def _shapes(model: FullOrderModel, placed: list[_Placed], used: Index, x: Array) -> Array:
    """Displacements (n_nodes, 6, m) of all beam nodes: of what they are tied to, else means over sections."""
    topology = model.plan.topology
    u = model.node_displacements(x[: model.order])
    is_tied = np.asarray(np.isin(topology.dof, used).any(axis=1))[topology.root]
    for piece in placed:
        means = (piece.reduced.average @ (piece.S @ x)).reshape(len(piece.component.section_nodes), 6, -1)
        for node, mean in zip(piece.component.section_nodes, means, strict=True):
            root = topology.root[piece.copy.node[node]]
            if not is_tied[root]:
                u[root] = turned(piece.copy.Q) @ mean
    loose = np.flatnonzero(~is_tied & ~topology.is_rigid)
    u[loose] = u[topology.root[loose]]
    return u


def _surface(piece: _Placed, x: Array) -> SurfaceShape:
    """The surface of a placed piece, mirrored facets turned round."""
    Q, surface = piece.copy.Q, piece.reduced.surface
    moved = np.einsum("ij,sjm->sim", Q, (surface.rows @ (piece.S @ x)).reshape(len(surface.points), 3, -1))
    facets = surface.facets if np.linalg.det(Q) > 0 else surface.facets[:, ::-1]
    return SurfaceShape(piece.copy.name, surface.points @ Q.T + piece.copy.t, facets, moved)
