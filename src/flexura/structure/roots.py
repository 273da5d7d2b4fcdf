"""Elastic roots: how far the blocks reach in which members end, and how much their joints give.

A root is the flexibility that a thin member and the thicker block it ends in have together beyond what each has with a
rigid face (`flexura.beam.root_flexibility`). It belongs to the member's end element, so that no order grows. The block
is the box of a body that carries the node, or other members at the node. Where nothing is known of it (clamped ground,
bodies of mass and inertia alone, bodies drawn elsewhere) it is large beside the member and as wide as it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.beam import FAR, root_flexibility
from flexura.mechanism import origin_of
from flexura.structure.discrete_elements import BodyElement
from flexura.structure.geometry import Geometry
from flexura.structure.members import Members
from flexura.structure.part import Part
from flexura.structure.stacking import joined_along
from flexura.structure.topology import Topology
from flexura.structure.value_table import Index

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
"""Truth values."""

SAME = 1e-6
"""Relative difference of blocks below which copies of a member end in equal ones."""

SIDES = ("up", "down", "left", "right", "behind")
"""Distances of `Roots.reach`: along the member's z and against it, along its y and against it, and behind its end."""

ROD = np.zeros((12, 12))
"""The mean of both planes, for rods, of flexibilities as `root_flexibility` gives them."""
ROD[[0, 1], [0, 1]] = 1.0
for _one, _other, _sign in ((2, 5, 1.0), (3, 6, -1.0), (4, 7, 1.0)):
    ROD[[_one, _other], [_one, _other]] = 0.5
    ROD[[_one, _other], [_other, _one]] = 0.5 * _sign

ALONG = 1e-9
"""Cosine below which a direction is along a face."""


class _Host(NamedTuple):
    """A box that members may end in, by its place in the list of bodies or of members at nodes."""

    is_body: bool
    number: int


class _Copy(NamedTuple):
    """One end of a placed member: node, instance, member, and what it ends in; nothing: what is unknown and large."""

    node: int
    instance: int
    member: int
    hosts: list[_Host]


class Roots:
    """The ends (r,) of members of all prototypes that are rooted in something thicker.

    members: (r,), their place among all members; ends: (r,), 0 or 1; elements: (r,), the elements that hold the roots.
    Copies of a substructure's member that end in different blocks have the mean of their roots. `which`: the ends
    (m, 2) of the members of every part that are looked at.
    """

    def __init__(self, parts: dict[str, Part], topology: Topology, members: Members, which: dict[str, Bools]) -> None:
        self._parts, self._topology, self._table = parts, topology, members
        first = np.cumsum([0, *(len(part.members) for part in parts.values())])
        self._first = dict(zip(parts, first.tolist(), strict=False))
        self._bodies: list[tuple[int, int, BodyElement]] = []
        self._ends: list[tuple[int, int, int, int]] = []
        wanted = [
            (self._first[name] + m, end) for name, part in parts.items() for m, end in np.argwhere(which[name]).tolist()
        ]
        copies = self._copies(wanted) if wanted else {}
        rows = [key for key in wanted if copies[key]]
        self.members, self.ends = np.array(rows, dtype=np.intp).reshape(-1, 2).T
        self.elements: Index = members.first[self.members + self.ends] - self.ends
        self._pad([copies[key] for key in rows])

    def __len__(self) -> int:
        return len(self.members)

    @property
    def is_known(self) -> Bools:
        """Whether it is drawn (r,) what the ends of all copies are in."""
        return np.asarray(~(self._unknown & (self._weight > 0)).any(axis=1), dtype=bool)

    def _copies(self, wanted: list[tuple[int, int]]) -> dict[tuple[int, int], list[_Copy]]:
        """Ends of members, as placed, by member and end; those of one substructure with values of its own at several
        instances are together."""
        topology = self._topology
        bodies: dict[int, list[tuple[int, int, BodyElement]]] = {}
        meeting: dict[int, list[tuple[int, int, int, int]]] = {}
        stiff: set[int] = set()
        for name, copies in topology.copies.items():
            part, first = self._parts[name], self._first[name]
            inner = {node for nodes, _, _ in part.superelements.values() for node in nodes}
            for instance, offset in zip(copies.number, copies.offset, strict=True):
                for node, body in part.bodies.values():
                    bodies.setdefault(int(topology.root[offset + node]), []).append((offset + node, instance, body))
                stiff |= {int(topology.root[offset + node]) for node in inner}
                for m, ends in enumerate(part.ends.tolist()):
                    for end, node in enumerate(ends):
                        own = (offset + node, instance, first + m, end)
                        meeting.setdefault(int(topology.root[offset + node]), []).append(own)
        found: dict[tuple[int, int], list[_Copy]] = {}
        for root, ends in meeting.items():
            if root in stiff:
                continue
            own_bodies = bodies.get(root, [])
            is_block = bool(own_bodies) or bool(topology.held[root].all())
            for own in ends:
                hosts = [self._host_of(body) for body in own_bodies if body[2].has_form]
                if not is_block:
                    hosts = [self._host_of(other) for other in ends if other is not own]
                if hosts or is_block:
                    found.setdefault((own[2], own[3]), []).append(_Copy(*own[:3], hosts))
        return self._together(found, wanted)

    def _together(
        self, found: dict[tuple[int, int], list[_Copy]], wanted: list[tuple[int, int]]
    ) -> dict[tuple[int, int], list[_Copy]]:
        """The copies of every end with those of the same one in prototypes of the same origin."""
        together: dict[tuple[str, str, int], list[_Copy]] = {}
        keys: dict[tuple[int, int], tuple[str, str, int]] = {}
        for name, part in self._parts.items():
            for m, key in enumerate(part.members):
                for end in (0, 1):
                    place = self._first[name] + m, end
                    keys[place] = origin_of(name), key, end
                    together.setdefault(keys[place], []).extend(found.get(place, []))
        return {place: together[keys[place]] if place in found else [] for place in wanted}

    def _host_of(self, own: tuple[int, int, BodyElement] | tuple[int, int, int, int]) -> _Host:
        if len(own) == 3:
            self._bodies.append(own)
            return _Host(True, len(self._bodies) - 1)
        self._ends.append(own)
        return _Host(False, len(self._ends) - 1)

    def _pad(self, rows: list[list[_Copy]]) -> None:
        """Rows as arrays: `weight`, `_node`, `_instance` and `_member` (r, copies), `_host` (r, copies, hosts), -1 for
        none."""
        copies = max((len(row) for row in rows), default=0)
        hosts = max((len(own.hosts) for row in rows for own in row), default=0)
        self._node: Index = np.zeros((len(rows), copies), dtype=np.intp)
        self._instance: Index = self._node.copy()
        self._member: Index = self._node.copy()
        self._weight: Array = np.zeros((len(rows), copies))
        self._host: Index = np.full((len(rows), copies, hosts), -1, dtype=np.intp)
        for r, row in enumerate(rows):
            for c in range(copies):
                own = row[c if c < len(row) else 0]
                self._node[r, c], self._instance[r, c], self._member[r, c] = own[:3]
                numbers = [host.number + (0 if host.is_body else len(self._bodies)) for host in own.hosts]
                self._host[r, c, : len(numbers)] = numbers
            self._weight[r, : len(row)] = 1 / len(row)
        self._unknown: Bools = np.asarray((self._host < 0).all(axis=-1), dtype=bool)
        self._is_rod = self._table.is_round[self.members]

    def settle(self, values: Array, geometry: Geometry) -> None:
        """Take what lies beside its box for unknown, leave out what is no thicker than the member, and take copies that
        end in equal blocks as one; for one design."""
        if not len(self):
            return
        t = self._sizes(values, geometry)[1][:, None]
        drawn = (self._host >= 0) & (self._host < len(self._bodies))
        is_off = (self.reach(values, geometry) < -t[..., None]).any(axis=-1)
        self._unknown = np.asarray(self._unknown | (drawn.any(axis=-1) & is_off), dtype=bool)
        up, down, _, _, behind = np.moveaxis(self.reach(values, geometry), -1, 0)
        thicker = (np.maximum(up, t / 2) + np.maximum(down, t / 2) > (1 + SAME) * t) & (behind > 0)
        self._take(np.flatnonzero((thicker & (self._weight > 0)).any(axis=1)))
        if not len(self):
            return
        t = self._sizes(values, geometry)[1][:, None, None]
        near = np.round(np.clip(self.reach(values, geometry) / t, -FAR, FAR) / SAME)
        keep, weight = np.zeros_like(self._weight, dtype=bool), np.zeros_like(self._weight)
        for r in range(len(self)):
            n = int((self._weight[r] > 0).sum())
            _, first, which = np.unique(near[r, :n], axis=0, return_index=True, return_inverse=True)
            keep[r, first], weight[r, first] = True, np.bincount(np.ravel(which)) / n
        order = np.argsort(~keep, axis=1, kind="stable")[:, : keep.sum(axis=1).max()]
        rows = np.arange(len(self))[:, None]
        self._node, self._instance, self._member = (
            own[rows, order] for own in (self._node, self._instance, self._member)
        )
        self._weight, self._unknown, self._host = (
            weight[rows, order],
            self._unknown[rows, order],
            self._host[rows, order],
        )
        self._keep_used()

    def _keep_used(self) -> None:
        """Keep only the boxes that ends are in."""
        self._host[self._unknown] = -1
        used, place = np.unique(self._host, return_inverse=True)
        used, first = used[used >= 0], int((used < 0).any())
        self._host = np.reshape(place, self._host.shape) - first
        count = len(self._bodies)
        self._ends = [self._ends[k - count] for k in used if k >= count]
        self._bodies = [self._bodies[k] for k in used if k < count]

    def _take(self, rows: Index) -> None:
        """Keep some ends."""
        self.members, self.ends, self.elements = self.members[rows], self.ends[rows], self.elements[rows]
        self._node, self._instance, self._weight = self._node[rows], self._instance[rows], self._weight[rows]
        self._member, self._is_rod = self._member[rows], self._is_rod[rows]
        self._host, self._unknown = self._host[rows], self._unknown[rows]

    def _sizes(self, values: Array, geometry: Geometry) -> tuple[Array, Array]:
        """Width and thickness (..., r), m, of the members at these ends."""
        lengths = joined_along([own.length for own in geometry.parts.values()], -1)
        b, t = self._table.end_sizes(values, lengths)
        return b[..., self.members, self.ends], t[..., self.members, self.ends]

    def _boxes(self, values: Array, geometry: Geometry) -> tuple[Array, Array, Array, Bools]:
        """Centres (..., h, 3), axes (..., h, 3, 3) as rows, half sizes (..., h, 3), global frame, of all hosts, and
        which of them (h,) are cylinders about their first axis."""
        centres, axes, halves = [], [], []
        if self._bodies:
            nodes = np.array([node for node, _, _ in self._bodies], dtype=np.intp)
            centres.append(geometry.at(nodes))
            for _, instance, body in self._bodies:
                own, half = body.box(values)
                axes.append((own @ np.swapaxes(geometry.Q[..., instance, :, :], -1, -2))[..., None, :, :])
                halves.append(half[..., None, :])
        if self._ends:
            node, instance, member, end = np.array(self._ends, dtype=np.intp).T
            b, t = self._table.end_sizes(values, joined_along([g.length for g in geometry.parts.values()], -1))
            where, own, length = self._placed(geometry, node, instance, member, end)
            inward = (0.5 - end)[:, None] * length[..., None]
            centres.append(where + inward * own[..., 0, :])
            axes.append(own)
            width, thickness = b[..., member, end] / 2, t[..., member, end] / 2
            halves.append(np.stack([length / 2 + 0 * width, width + 0 * length, thickness + 0 * length], axis=-1))
        is_round = np.array([body.is_round for _, _, body in self._bodies] + [False] * len(self._ends))
        return joined_along(centres, -2), joined_along(axes, -3), joined_along(halves, -2), is_round

    def _placed(
        self, geometry: Geometry, node: Index, instance: Index, member: Index, end: Index
    ) -> tuple[Array, Array, Array]:
        """Where ends of members are (..., k, 3), global frame, their axes (..., k, 3, 3) and lengths (..., k)."""
        parts = geometry.parts.values()
        R = joined_along([own.R for own in parts], -3)[..., member, :, :]
        length = joined_along([own.length for own in parts], -1)[..., member]
        offset = joined_along([own.offsets for own in parts], -3)[..., member, end, :]
        Q = geometry.Q[..., instance, :, :]
        arm = (Q @ offset[..., None])[..., 0]
        return geometry.at(node) + arm, R @ np.swapaxes(Q, -1, -2), length

    def reach(self, values: Array, geometry: Geometry) -> Array:
        """How far blocks reach, from a thickness behind the middle of the end faces (..., r, copies, 5), m: along the
        member's z and against it, along its y and against it, and on behind it. Below zero where the end is off."""
        shape = self._node.shape
        ends = np.repeat(self.ends, shape[1])
        where, axes, _ = self._placed(geometry, self._node.ravel(), self._instance.ravel(), self._member.ravel(), ends)
        where, axes = (
            own.reshape(*own.shape[: own.ndim - k], *shape, *own.shape[own.ndim - k + 1 :])
            for own, k in ((where, 2), (axes, 3))
        )
        b, t = (own[..., None] for own in self._sizes(values, geometry))
        sense = (1.0 - 2.0 * self.ends)[:, None, None]  # x leads from the block into the member
        x, y, z = axes[..., 0, :] * sense, axes[..., 1, :], axes[..., 2, :]
        start = where - t[..., None] * x
        found: Array = np.full((*shape, len(SIDES)), -np.inf)
        if (self._host >= 0).any():
            centre, turn, half, is_round = self._boxes(values, geometry)
            for k in range(self._host.shape[-1]):
                host, known = self._host[..., k], self._host[..., k] >= 0
                own = turn[..., host, :, :]
                place = (own @ (start - centre[..., host, :])[..., None])[..., 0]
                towards = own @ np.stack([z, -z, y, -y, -x], axis=-1)
                away = _exit(place, towards, half[..., host, :], is_round[host])
                away = np.where(known[..., None], away, -np.inf)
                found = away if k == 0 else np.maximum(found, away)
        beside = np.where(self._is_rod[:, None], np.inf, b / 2 + 0 * t + np.zeros(shape))
        far = np.full(beside.shape, np.inf)
        large = np.stack([far, far, beside, beside, far], axis=-1)
        return np.where(np.asarray(self._unknown)[..., None], large, found)

    def of(self, values: Array, geometry: Geometry) -> tuple[Index, Index, Array] | None:
        """Elements and ends (r,) that have roots, and their flexibilities (..., r, 12); None without any."""
        if not len(self):
            return None
        E, _, nu, _ = self._table.moduli(values)
        return self.elements, self.ends, self.flexibility(values, geometry, E, nu)

    def flexibility(self, values: Array, geometry: Geometry, E: Array, nu: Array) -> Array:
        """Flexibilities (..., r, 12) of all roots, as `root_flexibility` gives them, x leading into the member; E, Pa,
        and nu (..., m) of the members."""
        b, t = (own[..., None] for own in self._sizes(values, geometry))
        reach = self.reach(values, geometry)
        across = reach[..., :4].min(axis=-1, keepdims=True)  # rods know no width
        reach = np.where(self._is_rod[:, None, None] & (np.arange(5) < 4), across, reach)
        up, down, _, _, behind = np.moveaxis(reach, -1, 0)
        length = joined_along([own.length for own in geometry.parts.values()], -1)
        own_E, own_nu, length = (own[..., self.members, None] for own in (E, nu, length))
        C = root_flexibility(own_E, own_nu, b, t, length, up - t / 2, down - t / 2)
        if self._is_rod.any():
            C = np.where(self._is_rod[:, None, None], C @ ROD, C)
        thick = np.minimum(np.maximum(behind / (2 * t), 0.0), 1.0) * self._weight
        return (thick[..., None] * C).sum(axis=-2)


def _exit(place: Array, towards: Array, half: Array, is_round: Bools) -> Array:
    """How far it is (..., k), m, from points at (..., 3) in the axes of boxes, or of cylinders about their first axis,
    of half sizes (..., 3) to where the directions towards (..., 3, k) leave them; below zero from outside."""
    found: Array = np.array(np.inf)
    for axis in range(3):
        slope, at = towards[..., axis, :], place[..., axis, None]
        steep = np.abs(slope) > ALONG
        room = half[..., axis, None]
        beyond = np.where(np.abs(at) > room, room - np.abs(at), np.inf)  # along a face, beside it
        away = np.where(steep, (room - np.sign(slope) * at) / np.where(steep, np.abs(slope), 1.0), beyond)
        if axis and is_round.any():
            away = np.where(is_round[..., None], np.inf, away)
        found = np.minimum(found, away)
    if is_round.any():
        across, at = towards[..., 1:, :], place[..., 1:, None]
        a, b = (across * across).sum(axis=-2), (across * at).sum(axis=-2)
        c = half[..., 1, None] ** 2 - (at * at).sum(axis=-2)
        steep = a > ALONG
        inside = np.where(is_round[..., None] & (c > 0) & steep, c, 1.0)
        unit = np.where(steep, a, 1.0)
        away = np.where(c > 0, (np.sqrt(b * b + unit * inside) - b) / unit, c / (2 * half[..., 1, None]))
        found = np.minimum(found, np.where(is_round[..., None] & (steep | (c <= 0)), away, np.inf))
    return found
