"""Members as solids in the global frame: numbers only, for solid modellers and meshers.

A member is its section swept from its first to its second end. Left-handed (mirrored) axes are turned right-handed by
reversing local y, about which every section is symmetric.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.solid.geometry.contours import DIGITS, MemberShape, Outline
from flexura.structure import FullOrderModel, SectionGroup

ENDS = ("start", "end")


@dataclass(frozen=True)
class SolidMaterial:
    """An isotropic material: E, Pa; nu; rho, kg/m^3."""

    name: str
    E: float
    nu: float
    rho: float


@dataclass(frozen=True)
class MemberSolid:
    """A placed member: `axes` (3, 3) are its right-handed local axes as rows, `start` (3,) its first end, `length`, m.

    `nodes` are the global numbers of its end nodes and `roots` of what these follow.
    """

    name: str
    shape: MemberShape
    length: float
    material: SolidMaterial
    start: Array
    axes: Array
    nodes: tuple[int, int]
    roots: tuple[int, int]

    @property
    def key(self) -> Hashable:
        """What tells normalised members apart but for their names: shape, size, place and material."""
        own = self.material
        return self.shape, self.length, own.E, own.nu, own.rho, *self.start.tolist(), *self.axes.ravel().tolist()

    @cached_property
    def outline(self) -> Outline:
        """The contour, sampled, m."""
        return self.shape.outline(self.length)

    @property
    def volume(self) -> float:
        """Volume, m^3, of sections along the length."""
        return self.shape.volume * self.length**3

    def local(self, points: Array) -> Array:
        """Local coordinates (..., 3) of global points."""
        return (points - self.start) @ self.axes.T

    def placed(self, points: Array) -> Array:
        """Global coordinates (..., 3) of local points."""
        return points @ self.axes + self.start

    @cached_property
    def box(self) -> Array:
        """Lower and upper corner (2, 3) of its bounding box, m."""
        y, z = self.outline.y.max(), self.outline.z.max()
        corners = [[x, s * y, t * z] for x in (0.0, self.length) for s in (-1, 1) for t in (-1, 1)]
        placed = self.placed(np.array(corners))
        return np.stack([placed.min(axis=0), placed.max(axis=0)])

    def end_samples(self, end: int, inset: float, count: int = 12) -> Array:
        """Points (n, 3) spread evenly over an end face, `inset` inside it, global frame."""
        shape = self.outline
        y, z, x = shape.y[-end], shape.z[-end], self.length - inset if end else inset
        middle = (np.arange(count) + 0.5) / count
        if shape.is_round:
            r = np.sqrt(shape.inner**2 + (y**2 - shape.inner**2) * middle)[:, None]
            angle = 2 * np.pi * middle
            across = [r * np.cos(angle), r * np.sin(angle)]
        else:
            across = np.meshgrid(y * (2 * middle - 1), z * (2 * middle - 1))
        return self.placed(np.stack([np.full(count**2, x), *(np.ravel(c) for c in across)], axis=-1))

    def samples(self, count: int = 10) -> Array:
        """Points (n, 3) spread over the solid, global frame."""
        middle = (np.arange(count) + 0.5) / count
        x, v, w = (a.ravel() for a in np.meshgrid(middle * self.length, 2 * middle - 1, 2 * middle - 1, indexing="ij"))
        y, z = self.outline.half(x)
        points = np.stack([x, v * y, w * z], axis=-1)
        return self.placed(points[self.outline.holds(points, 0.0)])

    def on_end(self, end: int, points: Array, tolerance: float) -> NDArray[np.bool_]:
        """Which global points (n, 3) lie on an end face."""
        local = self.local(points)
        at = self.length if end else 0.0
        flat = np.abs(local[:, 0] - at) <= tolerance
        local[:, 0] = at
        return flat & self.outline.holds(local, tolerance)


def normalised(members: Sequence[MemberSolid]) -> tuple[MemberSolid, ...]:
    """Members in the axes of the first one, with lengths over its length and E and rho over its own.

    Rounded to 12 digits, nodes aside, so that copies of any place, size and metal give equal numbers.
    """
    first = members[0]

    def alike(member: MemberSolid) -> MemberSolid:
        own = member.material
        return replace(
            member,
            length=float(_rounded(member.length / first.length)),
            material=replace(
                own,
                E=float(_rounded(own.E / first.material.E)),
                rho=float(_rounded(own.rho / first.material.rho)),
            ),
            start=_rounded(first.local(member.start) / first.length),
            axes=_rounded(member.axes @ first.axes.T),
        )

    return tuple(map(alike, members))


def _rounded(values: Array | float) -> Array:
    return np.round(values, DIGITS) + 0.0


def solids(model: FullOrderModel, only: str | Collection[str] | None = None) -> tuple[MemberSolid, ...]:
    """All placed members as solids, or those of the instance or member with the path `only`, or with names in it.

    Raises OptionError for sections given by constants, which have no solid, and when `only` names nothing.
    """
    plan, geometry, values = model.plan, model.geometry, model.values
    found: list[MemberSolid] = []
    for name, part in plan.parts.items():
        placed = plan.topology.copies[name]
        prefixes = [".".join(path) for path in placed.paths]
        wanted = [
            (copy, k, ".".join(filter(None, (prefix, member))))
            for copy, prefix in enumerate(prefixes)
            for k, member in enumerate(part.members)
        ]
        if isinstance(only, str):
            wanted = [w for w in wanted if w[2] == only or w[2].startswith(f"{only}.")]
        elif only is not None:
            wanted = [w for w in wanted if w[2] in only]
        if not wanted:
            continue
        own = geometry.parts[name]
        E, rho, nu, _ = part.table.moduli(values)
        shapes = _shapes(part.table.groups, values, own.length, {k: path for _, k, path in wanted})
        for copy, k, path in wanted:
            Q, t = geometry.Q[placed.number[copy]], geometry.t[placed.number[copy]]
            axes = own.R[k] @ Q.T
            if np.linalg.det(axes) < 0:
                axes = axes * np.array([[1.0], [-1.0], [1.0]])
            start = Q @ (own.positions[part.ends[k, 0]] + own.offsets[k, 0]) + t
            first, second = (placed.offset[copy] + int(n) for n in part.ends[k])
            roots = (int(plan.topology.root[first]), int(plan.topology.root[second]))
            prototype = list(part.members.values())[k]
            material = SolidMaterial(prototype.material, float(E[k]), float(nu[k]), float(rho[k]))
            found.append(
                MemberSolid(path, shapes[k], float(own.length[k]), material, start, axes, (first, second), roots)
            )
    if not found:
        what = "there are no members" if only is None else f"no placed member is named {only!r} or lies in it"
        raise OptionError(f"{what}; solids are made of members, written INSTANCE.MEMBER")
    return tuple(found)


def _shapes(
    groups: Sequence[tuple[SectionGroup, int, bool]], values: Array, length: Array, wanted: dict[int, str]
) -> dict[int, MemberShape]:
    """Shapes of the members wanted, by their position in the part; `wanted` holds their names."""
    found: dict[int, MemberShape] = {}
    for group, _, _ in groups:
        for row, k in enumerate(group.index.tolist()):
            if k in wanted:
                if group.kind[0] == "constants":
                    raise OptionError(f"{wanted[k]}: a section given by constants has no solid; give it a shape")
                found[k] = MemberShape.of(group, row, values, float(length[k]))
    return found


@dataclass(frozen=True)
class Joints:
    """Which members are one piece, and which end faces are tied to their nodes.

    `groups` are positions of fused members; `tied` (m, 2) marks end faces that follow their nodes rigidly, `fused`
    (m, 2) those that meet a fused member.
    """

    groups: tuple[tuple[int, ...], ...]
    tied: NDArray[np.bool_]
    fused: NDArray[np.bool_]


def joints(model: FullOrderModel, members: Sequence[MemberSolid]) -> Joints:
    """Find which members are fused where they meet.

    Two members that meet at a free node of their own are fused when one's end face lies wholly on the other or both
    overlap there; an end that another touches in part only is not. A node at which all members are one piece and that
    carries nothing else has no need of a tie: its end faces are free inside the piece.
    """
    topology = model.plan.topology
    discrete_elements = _discrete_roots(model)
    at: dict[int, list[tuple[int, int]]] = {}
    for k, member in enumerate(members):
        for end, root in enumerate(member.roots):
            at.setdefault(root, []).append((k, end))
    group = np.arange(len(members))
    fused = np.zeros((len(members), 2), dtype=bool)
    tied = np.zeros((len(members), 2), dtype=bool)
    degrees = _degrees(model)
    for root, ends in at.items():
        rigid = bool(topology.is_rigid[root] or topology.held[root].any())
        cluster = {k: k for k, _ in ends}
        for i, (a, end_a) in enumerate(ends):
            for b, end_b in ends[i + 1 :]:
                if not rigid and a != b and _meet(members[a], end_a, members[b], end_b):
                    fused[a, end_a] = fused[b, end_b] = True
                    cluster = {k: cluster[a] if c == cluster[b] else c for k, c in cluster.items()}
                    group[group == group[b]] = group[a]
        if rigid or root in discrete_elements or len(set(cluster.values())) > 1 or len(ends) < max(degrees[root], 2):
            for k, end in ends:
                tied[k, end] = True
    groups = tuple(tuple(np.flatnonzero(group == g).tolist()) for g in dict.fromkeys(group.tolist()))
    return Joints(groups, tied, fused)


def closed(members: Sequence[MemberSolid], found: Joints) -> tuple[MemberSolid, ...]:
    """The members, those of one section reaching so far into what they are fused with that their whole end face is in
    it: across an oblique end face there would be a gap beside the line in which both meet.
    """
    result = list(members)
    for group in found.groups:
        for k, other in permutations(group, 2):
            for end in np.flatnonzero(found.fused[k] & ~found.tied[k]).tolist():
                if members[k].shape.is_straight and members[k].roots[end] in members[other].roots:
                    result[k] = _reaching(result[k], end, members[other])
    return tuple(result)


def _reaching(member: MemberSolid, end: int, other: MemberSolid) -> MemberSolid:
    """The member with an end moved on until its face is in the other one, if it is so within half its thickness."""
    thin = 2 * float(min(member.outline.y[-end], member.outline.z[-end]))
    for by in np.linspace(0.0, thin / 2, 26):
        points = member.end_samples(end, -float(by))
        if other.outline.holds(other.local(points), 1e-5 * thin).all():
            return _longer(member, end, float(by)) if by else member
    return member


def _longer(member: MemberSolid, end: int, by: float) -> MemberSolid:
    length = member.length + by
    sizes = tuple(
        (name, tuple(float(f"{x * member.length / length:.{DIGITS - 1}e}") for x in own))
        for name, own in member.shape.sizes
    )
    start = member.start if end else member.start - by * member.axes[0]
    return replace(member, shape=replace(member.shape, sizes=sizes), length=length, start=start)


def _meet(a: MemberSolid, end_a: int, b: MemberSolid, end_b: int) -> bool:
    """Whether one end face lies on the other member or both members overlap at their ends."""
    for one, end, other in ((a, end_a, b), (b, end_b, a)):
        scale = min(one.length, other.length, float(one.outline.z[-end]), float(other.outline.z[0]))
        near = 1e-5 * scale
        covered = other.outline.holds(other.local(one.end_samples(end, 0.0)), near)
        inside = other.outline.holds(other.local(one.end_samples(end, 1e-2 * scale)), -near)
        if covered.mean() > 0.99 or inside.mean() > 0.05:
            return True
    return False


def _discrete_roots(model: FullOrderModel) -> set[int]:
    """Roots of all nodes at which bodies, masses, springs, superelements or piezo stacks act."""
    topology = model.plan.topology
    nodes = [
        offset + node
        for placed in topology.copies.values()
        for own, _, _ in placed.part.discrete_nodes()
        for node in own
        for offset in placed.offset
    ]
    return set(topology.root[np.array(nodes, dtype=np.intp)].tolist())


def _degrees(model: FullOrderModel) -> Index:
    """Number of member ends at every root, placed members that are not looked at included."""
    topology = model.plan.topology
    ends = [topology.root[np.add.outer(p.offset, p.part.ends).ravel()] for p in topology.copies.values()]
    return np.bincount(np.concatenate(ends).astype(np.intp), minlength=topology.n_nodes)
