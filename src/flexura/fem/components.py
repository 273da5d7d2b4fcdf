"""Members as pieces of solid, tied to the nodes of their beam model.

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
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.beam import block_rotation, rigid_arm
from flexura.errors import OptionError
from flexura.fem.geometry import ENDS, MemberSolid, closed, joints, normalised, solids
from flexura.fem.reduced import EndTie, Piece, ReducedPiece, Section
from flexura.mechanism import Faces
from flexura.structure import FullOrderModel

Path = tuple[str, ...]

LARGEST_NU = 0.499
"""Poisson's ratios beyond this one lock the cells."""


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
