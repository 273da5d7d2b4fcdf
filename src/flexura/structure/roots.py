"""Elastic roots: how far the blocks reach in which members end, and how much their joints give.

A root is the flexibility that a thin member and the thicker block it ends in have together beyond what each has with a
rigid face (`flexura.beam.root_flexibility`). It belongs to the member's end element, so that no order grows. The block
is the box of a body that carries the node, or other members at the node. Where nothing is known of it (clamped ground,
bodies of mass and inertia alone, bodies drawn elsewhere) it is large beside the member on all sides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Bools, Index
from flexura.beam import FAR, root_flexibility
from flexura.duals import plain
from flexura.mechanism import origin_of
from flexura.structure.composites import ROOT_DEPTH
from flexura.structure.discrete_elements import BodyElement
from flexura.structure.members import Members
from flexura.structure.part import Part
from flexura.structure.topology import Geometry, Topology
from flexura.structure.values import joined_along

SAME_BLOCK = 1e-6
"""Relative difference of blocks below which copies of a member end in equal ones."""

DIRECTIONS = ("up", "down", "left", "right", "behind")
"""Distances of `Roots.reach`: along the member's z and against it, along its y and against it, and behind its end."""

ROD = np.zeros((12, 12))
"""The mean of both planes, for rods, of flexibilities as `root_flexibility` gives them."""
ROD[[0, 1], [0, 1]] = 1.0
for _one, _other, _sign in ((2, 5, 1.0), (3, 6, -1.0), (4, 7, 1.0)):
    ROD[[_one, _other], [_one, _other]] = 0.5
    ROD[[_one, _other], [_other, _one]] = 0.5 * _sign

HELD_FLAT = 0.15
"""How far a block reaches beyond a member, over its thickness, from which its end counts as held flat: what
that gives is in the root."""

FACING = 0.3
"""Cosine between a member and the normal of a face from which it may end at that face."""

LEAST_RADIUS = 1e-30
"""What keeps the axis of a cylinder from having a direction away from it."""

NEARLY_ALONG = 0.1
"""Sine of the angle between a line and a face up to which it may run along that."""

PARALLEL = 1e-9
"""Cosine below which a direction is along a face."""


class _End(NamedTuple):
    """One end of a placed member."""

    node: int
    instance: int
    member: int
    end: int


class _Body(NamedTuple):
    """A placed body; of a composite the `room` that a copy of an end is in, as middle and half sizes (3,), m, from its
    node and in its axes."""

    node: int
    instance: int
    element: BodyElement
    room: tuple[Array, Array] | None = None


class _Copy(NamedTuple):
    """An end of a placed member and the numbers of the boxes that it ends in, bodies before members; none where this is
    unknown and large."""

    end: _End
    hosts: list[int]


class _Sizes(NamedTuple):
    """Width and thickness (..., r), m, of the members at rooted ends, and of all members (..., m, 2)."""

    b: Array
    t: Array
    widths: Array
    thicknesses: Array


class _Joint(NamedTuple):
    """Width and thickness of the members at all copies, how far the block reaches beyond their faces along z and
    against it, at least beyond their sides, and behind them, each (..., k), m."""

    b: Array
    t: Array
    up: Array
    down: Array
    side: Array
    behind: Array


class Roots:
    """The ends (r,) of members of all prototypes that are rooted in something thicker.

    members: (r,), their place among all members; ends: (r,), 0 or 1; elements: (r,), the elements that hold the roots.
    `first`: the place of the first member of every part. Copies of a substructure's member that end in different blocks
    have the mean of their roots. `which`: the ends (m, 2) of the members of every part that are looked at. `beyond`
    (m, 2): how far the blocks of the ends of all members reach beyond both faces together, over the thickness.
    """

    def __init__(self, parts: dict[str, Part], topology: Topology, members: Members, which: dict[str, Bools]) -> None:
        self._parts, self._topology, self._table = parts, topology, members
        first = np.cumsum([0, *(len(part.members) for part in parts.values())])
        self.first: dict[str, int] = dict(zip(parts, first.tolist(), strict=False))
        self._bodies: list[_Body] = []
        self._ends: list[_End] = []
        self._next: dict[tuple[int, int, int], _End] = {}
        wanted = [
            (self.first[name] + m, end) for name, part in parts.items() for m, end in np.argwhere(which[name]).tolist()
        ]
        copies = self._copies(wanted) if wanted else {}
        rows = [key for key in wanted if copies[key]]
        ended: Index = np.array(rows, dtype=np.intp).reshape(-1, 2)
        self.members: Index = ended[:, 0]
        self.ends: Index = ended[:, 1]
        self.elements: Index = members.first[self.members + self.ends] - self.ends
        self._is_rod: Bools = members.is_round[self.members]
        self.beyond: Array = np.zeros((len(members.counts), 2))
        self._list([copies[key] for key in rows])

    def __len__(self) -> int:
        return len(self.members)

    @property
    def is_known(self) -> Bools:
        """Whether it is drawn (r,) what the ends of all copies are in."""
        return np.bincount(self._row[self._unknown], minlength=len(self)) == 0

    def _copies(self, wanted: list[tuple[int, int]]) -> dict[tuple[int, int], list[_Copy]]:
        """Ends of members, as placed, by member and end; those of one substructure with values of its own at several
        instances are together."""
        topology = self._topology
        bodies = self._place_bodies()
        meeting: dict[int, list[int]] = {}
        stiff: set[int] = set()
        for name, copies in topology.copies.items():
            part, first = self._parts[name], self.first[name]
            inner = {node for own in part.superelements.values() for node in own.nodes}
            for instance, offset in zip(copies.number, copies.offset, strict=True):
                stiff |= {int(topology.root[offset + node]) for node in inner}
                for m, ends in enumerate(part.ends.tolist()):
                    for end, node in enumerate(ends):
                        meeting.setdefault(int(topology.root[offset + node]), []).append(len(self._ends))
                        self._ends.append(_End(offset + node, instance, first + m, end))
        found: dict[tuple[int, int], list[_Copy]] = {}
        for root, numbers in meeting.items():
            if root in stiff:
                continue
            is_block = root in bodies or bool(topology.held[root].all())
            if len(numbers) == 2 and not is_block:
                one, other = (self._ends[k] for k in numbers)
                self._next |= {one[1:]: other, other[1:]: one}
            for k in numbers:
                if is_block:
                    hosts = [n for n in bodies.get(root, []) if self._bodies[n].element.has_form]
                else:
                    hosts = [len(self._bodies) + n for n in numbers if n != k]
                if hosts or is_block:
                    end = self._ends[k]
                    found.setdefault((end.member, end.end), []).append(_Copy(end, hosts))
        return self._together(found, wanted)

    def _place_bodies(self) -> dict[int, list[int]]:
        """The numbers of the bodies at every root: of rigid ones at their own, of others where something is carried."""
        bodies: dict[int, list[int]] = {}
        for name, copies in self._topology.copies.items():
            part = self._parts[name]
            for instance, offset in zip(copies.number, copies.offset, strict=True):
                for key, (node, body) in part.bodies.items():
                    on = part.elastic[key].carried if key in part.elastic else [node]
                    for root in {int(self._topology.root[offset + at]) for at in on}:
                        bodies.setdefault(root, []).append(len(self._bodies))
                    self._bodies.append(_Body(offset + node, instance, body))
        return bodies

    def _together(
        self, found: dict[tuple[int, int], list[_Copy]], wanted: list[tuple[int, int]]
    ) -> dict[tuple[int, int], list[_Copy]]:
        """The copies of every end with those of the same one in prototypes of the same origin."""
        together: dict[tuple[str, str, int], list[_Copy]] = {}
        keys: dict[tuple[int, int], tuple[str, str, int]] = {}
        for name, part in self._parts.items():
            for m, key in enumerate(part.members):
                for end in (0, 1):
                    place = self.first[name] + m, end
                    keys[place] = origin_of(name), key, end
                    together.setdefault(keys[place], []).extend(found.get(place, []))
        return {place: together[keys[place]] if place in found else [] for place in wanted}

    def _list(self, rows: list[list[_Copy]]) -> None:
        """The copies (k,) of all rows as arrays: `_row`, `_node`, `_instance`, `_member`, `_weight`, and `_host`
        (k, hosts), -1 for none."""
        copies = [(row, copy) for row, copies in enumerate(rows) for copy in copies]
        self._row: Index = np.array([row for row, _ in copies], dtype=np.intp)
        placed = np.array([copy.end for _, copy in copies], dtype=np.intp).reshape(-1, 4)
        self._node, self._instance, self._member = placed.T[:3]
        most = max((len(copy.hosts) for _, copy in copies), default=0)
        self._host: Index = np.full((len(copies), most), -1, dtype=np.intp)
        for k, (_, copy) in enumerate(copies):
            self._host[k, : len(copy.hosts)] = copy.hosts
        self._unknown: Bools = np.asarray((self._host < 0).all(axis=-1), dtype=bool)
        self._weight: Array = 1 / np.bincount(self._row, minlength=len(rows))[self._row]
        self._keep_used()

    def settle(self, values: Array, geometry: Geometry) -> None:
        """Take what lies beside its box for unknown, leave out what is no thicker than the member, and take copies that
        end in equal blocks as one; for one design."""
        if not len(self):
            return
        sizes = self._sizes(values, geometry)
        t = sizes.t[self._row]
        self._find_rooms(values, geometry, t)
        drawn = (self._host >= 0) & (self._host < len(self._bodies))
        is_off = (self.reach(values, geometry, sizes) < -t[:, None]).any(axis=-1)
        self._unknown = np.asarray(self._unknown | (drawn.any(axis=-1) & is_off), dtype=bool)
        reach = self.reach(values, geometry, sizes)
        up, down, _, _, behind = reach.T
        beyond = np.maximum(up, t / 2) + np.maximum(down, t / 2) - t
        thicker = (beyond > SAME_BLOCK * t) & (behind > 0)
        np.maximum.at(self.beyond, (self.members[self._row], self.ends[self._row]), np.where(thicker, beyond / t, 0.0))
        near = np.round(np.clip(reach / t[:, None], -FAR, FAR) / SAME_BLOCK)
        kept, weight = [], []
        for row in np.unique(self._row[thicker]).tolist():
            copies = np.flatnonzero(self._row == row)
            blocks = np.column_stack([near[copies], self._modulus(values, copies, np.ones(len(copies)))])
            _, first, which = np.unique(blocks, axis=0, return_index=True, return_inverse=True)
            kept.append(copies[first])
            weight.append(np.bincount(np.ravel(which)) / len(copies))
        copies = np.concatenate([np.empty(0, dtype=np.intp), *kept])
        rows, self._row = np.unique(self._row[copies], return_inverse=True)
        self._weight = np.concatenate([np.empty(0), *weight])
        self._node, self._instance, self._member = self._node[copies], self._instance[copies], self._member[copies]
        self._host, self._unknown = self._host[copies], self._unknown[copies]
        self.members, self.ends, self.elements = self.members[rows], self.ends[rows], self.elements[rows]
        self._is_rod = self._is_rod[rows]
        self._keep_used()
        runs = [self._run(geometry, sizes, k) for k in range(len(copies))]
        self._runs: Array = np.zeros((len(self._table.counts), len(runs)))
        for k, run in enumerate(runs):
            np.add.at(self._runs[:, k], run, 1.0)

    def _find_rooms(self, values: Array, geometry: Geometry, t: Array) -> None:
        """Let every copy that ends in a composite have a host of its own: the box that lines from there reach."""
        first, rooms = len(self._bodies), list[_Body]()
        where, axes, _ = self._placed(geometry, self._node, self._instance, self._member, self.ends[self._row])
        for k, j in np.argwhere((self._host >= 0) & (self._host < first)).tolist():
            body = self._bodies[self._host[k, j]]
            if (mesh := body.element.mesh) is None:
                continue
            turn = body.element.box(values)[0] @ geometry.Q[body.instance].T
            own = turn @ axes[k].T * np.array([2.0 * self.ends[self._row[k]] - 1.0, 1.0, 1.0])
            middle, half, _ = mesh.pieces.room(turn @ (where[k] - geometry.at(np.array([body.node]))[0]), own, t[k])
            self._host[k, j] = -2 - len(rooms)
            rooms.append(body._replace(room=(middle, half)))
        self._host[self._host >= first] += len(rooms)
        own = self._host < -1
        self._host[own] = first - 2 - self._host[own]
        self._bodies += rooms
        self._keep_used()

    @property
    def held(self) -> Array:
        """How far the ends of all members (m, 2) are held flat, from 0 to 1, as their roots take them to be."""
        return np.minimum(self.beyond / HELD_FLAT, 1.0)

    def _run(self, geometry: Geometry, sizes: _Sizes, copy: int) -> list[int]:
        """The members that a copy goes on in, in line and of one section, itself first."""
        instance, end = int(self._instance[copy]), int(self.ends[self._row[copy]])
        run = [int(self._member[copy])]
        while (instance, run[-1], 1 - end) in self._next:
            place = self._next[instance, run[-1], 1 - end]
            nodes, instances, members, ends = np.array([(0, instance, run[-1], 1 - end), place]).T
            x = self._placed(geometry, nodes, instances, members, ends)[1][:, 0]
            section = np.stack([size[members, ends] for size in (sizes.widths, sizes.thicknesses)])
            is_on = (1 - 2 * ends[0]) * (1 - 2 * ends[1]) * (x[0] @ x[1]) < SAME_BLOCK - 1
            if not is_on or place[2] in run or (np.abs(np.diff(section)) > SAME_BLOCK * section[:, :1]).any():
                break
            _, instance, member, end = place
            run.append(member)
        return run

    def _keep_used(self) -> None:
        """Keep only the boxes that ends are in, and columns of hosts that any has."""
        self._host[self._unknown] = -1
        used, place = np.unique(self._host, return_inverse=True)
        used, first = used[used >= 0], int((used < 0).any())
        self._host = np.reshape(place, self._host.shape) - first
        self._host = self._host[:, (self._host >= 0).any(axis=0)]
        count = len(self._bodies)
        self._ends = [self._ends[k - count] for k in used if k >= count]
        self._bodies = [self._bodies[k] for k in used if k < count]

    def _sizes(self, values: Array, geometry: Geometry) -> _Sizes:
        widths, thicknesses = self._table.end_sizes(values, geometry.lengths)
        rooted = (..., self.members, self.ends)
        return _Sizes(widths[rooted], thicknesses[rooted], widths, thicknesses)

    def _modulus(self, values: Array, copies: Index | slice, unknown: Array) -> Array:
        """Young's modulus (..., k) of the blocks that copies end in, Pa, the mean of all members that are one block;
        `unknown` (..., k) where nothing is known of it."""
        members = np.array([end.member for end in self._ends], dtype=np.intp)
        of_bodies = [body.element.modulus(values)[..., None] for body in self._bodies]
        E = joined_along([*of_bodies, self._table.moduli(values)[0][..., members]], -1)
        hosts = self._host.T[:, copies]
        if not len(hosts):
            return unknown
        total = sum(np.where(column >= 0, E[..., column], 0.0) for column in hosts)
        count = (hosts >= 0).sum(axis=0)
        return np.where(count > 0, total / np.maximum(count, 1), unknown)

    def _boxes(
        self, values: Array, geometry: Geometry, placed: tuple[Array, Array, Array], sizes: _Sizes
    ) -> tuple[Array, Array, Array, Bools]:
        """Centres (..., h, 3), axes (..., h, 3, 3) as rows, half sizes (..., h, 3), global frame, of all hosts, and
        which of them (h,) are cylinders about their first axis; `placed` as of `_placed` of those that are
        members."""
        centres, axes, halves = [], [], []
        if self._bodies:
            nodes = geometry.at(np.array([body.node for body in self._bodies], dtype=np.intp))
            for k, (_, instance, element, room) in enumerate(self._bodies):
                rows, half = element.box(values)
                axes.append((rows @ np.swapaxes(geometry.Q[..., instance, :, :], -1, -2))[..., None, :, :])
                centre = nodes[..., k : k + 1, :]
                if room is not None:
                    centre, half = centre + room[0] @ axes[-1][..., 0, :, :], room[1]
                centres.append(centre)
                halves.append(half[..., None, :])
        if self._ends:
            _, _, member, end = np.array(self._ends, dtype=np.intp).T
            where, rows, length = placed
            inward = (0.5 - end)[:, None] * length[..., None]
            centres.append(where + inward * rows[..., 0, :])
            axes.append(rows)
            width, thickness = sizes.widths[..., member, end] / 2, sizes.thicknesses[..., member, end] / 2
            halves.append(np.stack([length / 2 + 0 * width, width + 0 * length, thickness + 0 * length], axis=-1))
        is_round = np.array([body.element.is_round for body in self._bodies] + [False] * len(self._ends))
        return joined_along(centres, -2), joined_along(axes, -3), joined_along(halves, -2), is_round

    def _placed(
        self, geometry: Geometry, node: Index, instance: Index, member: Index, end: Index
    ) -> tuple[Array, Array, Array]:
        """Where ends of members are (..., k, 3), global frame, their axes (..., k, 3, 3) and lengths (..., k)."""
        parts = geometry.parts.values()
        R = joined_along([part.R for part in parts], -3)[..., member, :, :]
        length = geometry.lengths[..., member]
        offset = joined_along([part.offsets for part in parts], -3)[..., member, end, :]
        Q = geometry.Q[..., instance, :, :]
        arm = (Q @ offset[..., None])[..., 0]
        return geometry.at(node) + arm, R @ np.swapaxes(Q, -1, -2), length

    def reach(self, values: Array, geometry: Geometry, sizes: _Sizes | None = None) -> Array:
        """How far blocks reach, from a thickness behind the middle of the end faces (..., k, 5), m: along the member's
        z and against it, along its y and against it, and on behind it, for every copy. Below zero where the end is
        off."""
        sizes = self._sizes(values, geometry) if sizes is None else sizes
        t = sizes.t[..., self._row]
        large = np.stack([np.full(t.shape, np.inf)] * len(DIRECTIONS), axis=-1)
        if not self._host.shape[-1]:
            return large
        place, towards, half, is_round = self._in_blocks(values, geometry, sizes)
        into = (1.0 - 2.0 * self.ends[self._row])[:, None]  # x leads from the block into the member where it is 1
        place = place - (t[..., None] * into)[..., None] * towards[..., 0]
        on, back = _exit(place, towards, half, is_round, t[..., None])
        behind = np.where(into > 0, back[0], on[0])
        sides = (on[2], back[2], on[1], back[1], behind)
        every = np.where(self._host >= 0, np.stack(sides), -np.inf)
        farthest = every[..., 0]
        for other in np.moveaxis(every[..., 1:], -1, 0):
            farthest = -_lesser(-farthest, -other)
        return np.where(self._unknown[:, None], large, np.moveaxis(farthest, 0, -1))

    def _in_blocks(self, values: Array, geometry: Geometry, sizes: _Sizes) -> tuple[Array, Array, Array, Bools]:
        """For every copy and host (..., k, hosts, :), in the axes of the host: where the middle of the end face is, the
        axes of the member as columns, half sizes of the host, and whether (k, hosts) that is a cylinder."""
        rooted = np.stack([self._node, self._instance, self._member, self.ends[self._row]])
        hosts = np.array(self._ends, dtype=np.intp).reshape(-1, 4).T
        where, axes, length = self._placed(geometry, *np.concatenate([rooted, hosts], axis=1))
        k = len(self._row)
        placed = where[..., k:, :], axes[..., k:, :, :], length[..., k:]
        where, axes = where[..., :k, :], axes[..., :k, :, :]
        centre, turn, half, is_round = self._boxes(values, geometry, placed, sizes)
        into_box = turn[..., self._host, :, :]
        towards = into_box @ np.swapaxes(axes, -1, -2)[..., None, :, :]
        place = (into_box @ (where[..., None, :] - centre[..., self._host, :])[..., None])[..., 0]
        return place, towards, half[..., self._host, :], is_round[self._host]

    def slants(self, values: Array, geometry: Geometry) -> Array:
        """Slopes (r, 2) of the faces that roots are at, towards the member's y and z, the steepest of all copies; zero
        where faces are square to the member or not known; for one design."""
        slants = np.zeros((len(self), 2))
        if not self._host.shape[-1]:
            return slants
        sizes = self._sizes(values, geometry)
        place, towards, half, is_round = self._in_blocks(values, geometry, sizes)
        radius = np.hypot(place[..., 1], place[..., 2])
        normals = np.broadcast_to(np.eye(3), (*place.shape, 3)).copy()
        normals[is_round, 1:] = 0.0
        normals[is_round, 1, 1:] = (place[..., 1:] / np.maximum(radius, LEAST_RADIUS)[..., None])[is_round]
        slopes = np.abs(normals @ towards)
        off = np.abs(np.abs(place) - half)
        off[is_round, 1] = np.abs(radius - half[..., 1])[is_round]
        off[slopes[..., 0] < FACING] = np.inf
        nearest = np.take_along_axis(slopes, off.argmin(axis=-1)[..., None, None], axis=-2)[..., 0, :]
        slopes_at = nearest[..., 1:] / np.maximum(nearest[..., :1], FACING)
        is_at = (self._host >= 0) & ~self._unknown[:, None] & (off.min(axis=-1) < sizes.t[self._row, None] / 2)
        np.maximum.at(slants, self._row, np.where(is_at[..., None], slopes_at, 0.0).max(axis=1))
        return slants

    def of(self, values: Array, geometry: Geometry) -> tuple[Index, Index, Array] | None:
        """Elements and ends (r,) that have roots, and their flexibilities (..., r, 12); None without any."""
        if not len(self):
            return None
        E, _, nu, _ = self._table.moduli(values)
        return self.elements, self.ends, self.flexibility(values, geometry, E, nu)

    def fillets(self, values: Array, geometry: Geometry) -> tuple[Index, Index, Array] | None:
        """Members and ends (k,) that have fillets, and these over the thickness, along z and against it (..., k, 2);
        None without any."""
        has = self._table.filleted[self.members, self.ends]
        if not has.any():
            return None
        sizes = self._sizes(values, geometry)
        t = sizes.t[..., self._row]
        up, down = (beyond - t / 2 for beyond in np.moveaxis(self.reach(values, geometry, sizes), -1, 0)[:2])
        radii = self._radii(values, t, up, down)
        assert radii is not None
        each = (self._row == np.arange(len(self))[:, None]).astype(float) * self._weight
        mean = np.stack([(each @ (radius / t)[..., None])[..., 0] for radius in radii], axis=-1)
        return self.members[has], self.ends[has], mean[..., has, :]

    def _radii(self, values: Array, t: Array, up: Array, down: Array) -> tuple[Array, Array] | None:
        """Radius of the fillets (..., k), m, along z and against it, no larger than there is block: up and down, m."""
        if not self._table.filleted[self.members, self.ends].any():
            return None
        radius = self._table.fillets(values)[..., self.members, self.ends][..., self._row] + 0.0 * t
        above, below = (np.where(plain(beyond) > 0, _lesser(radius, beyond), 0.0 * radius) for beyond in (up, down))
        return above, below

    def flexibility(self, values: Array, geometry: Geometry, E: Array, nu: Array) -> Array:
        """Flexibilities (..., r, 12) of all roots, as `root_flexibility` gives them, x leading into the member; E, Pa,
        and nu (..., m) of the members."""
        b, t, up, down, side, behind = self._joints(values, geometry)
        E, nu, length = E[..., self._member], nu[..., self._member], geometry.lengths @ self._runs
        radii = self._radii(values, t, up, down)
        C = root_flexibility(self._modulus(values, slice(None), E), nu, b, t, length, up, down, side, radii)
        is_rod = self._is_rod[self._row]
        if is_rod.any():
            C = np.where(is_rod[:, None], C @ ROD, C)
        thick = _lesser(np.where(plain(behind) > 0, behind / (2 * t), 0.0), np.array(1.0)) * self._weight
        C = thick[..., None] * C
        return C if len(self) == len(self._row) else (self._row == np.arange(len(self))[:, None]).astype(float) @ C

    def _joints(self, values: Array, geometry: Geometry) -> _Joint:
        """The joints of all copies."""
        sizes = self._sizes(values, geometry)
        up, down, left, right, behind = np.moveaxis(self.reach(values, geometry, sizes), -1, 0)
        side = _lesser(left, right)
        is_rod = self._is_rod[self._row]
        if is_rod.any():  # they know no width
            across = _lesser(_lesser(up, down), side)
            up, down, side = (np.where(is_rod, across, beyond) for beyond in (up, down, side))
        b, t = sizes.b[..., self._row], sizes.t[..., self._row]
        up, down = (_lesser(beyond, t / 2 + ROOT_DEPTH * behind) for beyond in (up, down))
        return _Joint(b, t, up - t / 2, down - t / 2, side - b / 2, behind)

    def ratios(self, values: Array, geometry: Geometry) -> tuple[Index, Array]:
        """For all copies that have a root, which one (k,), and (k, 5) Poisson's ratio, and over the thickness the
        width, how far the block reaches beyond one face and beyond the other, the larger first, and beyond the sides;
        for one design. What lies beside its block, as where members meet off their axes, counts as wide as it."""
        b, t, up, down, side, behind = self._joints(values, geometry)
        nu = self._table.moduli(values)[2][self._member]
        larger, smaller = np.maximum(up, down), np.minimum(up, down)
        side = np.where(side < -b / 2, 0.0, np.minimum(side, FAR * b))
        ratios = np.stack(
            [nu, b / t, *(np.minimum(beyond / t, FAR) for beyond in (larger, smaller)), side / t], axis=-1
        )
        has = (larger > SAME_BLOCK * t) & (behind > 0)
        return self._row[has], ratios[has]


def _exit(place: Array, towards: Array, half: Array, is_round: Bools, t: Array) -> tuple[Array, Array]:
    """How far it is (3, ...), m, from points at (..., 3) in the axes of boxes, or of cylinders about their first axis,
    of half sizes (..., 3) to where lines along the columns of `towards` (..., 3, 3) leave them, and against these;
    below zero from outside. Lines along a face, beside it, end the sooner the farther off they are, at once from half
    of the member's thickness t (...) on, so that roots fade as members slide off their blocks."""
    exits: list[Array] = [np.array(np.inf)] * 2
    any_round = bool(is_round.any())
    slopes = [np.stack([towards[..., axis, column] for column in range(3)]) for axis in range(3)]
    slopes = [slope.reshape(3, *(1,) * (place.ndim - towards.ndim + 1), *slope.shape[1:]) for slope in slopes]
    for axis, slope in enumerate(slopes):
        at, room = place[..., axis], half[..., axis]
        size, sense = np.abs(plain(slope)), np.sign(plain(slope))
        off = np.where(plain(at) > 0, at, -at) - room
        is_off = plain(off) > 0
        beyond = np.where(is_off, t * (t - 2 * off) / np.where(is_off, off, 1.0), np.inf)
        ahead = sense * at
        # a line beside a face that it would meet a thickness further on, or never, runs along it
        is_along = is_off & (size < NEARLY_ALONG) & (plain(off) > size * plain(t))
        steep = (size > PARALLEL) & ~is_along
        size = np.where(steep, sense * slope, 1.0)
        for k, distance in enumerate((room - ahead, room + ahead)):
            away = np.where(steep, distance / size, beyond)
            exits[k] = _lesser(exits[k], np.where(is_round, np.inf, away) if axis and any_round else away)
    if any_round:
        y, z = place[..., 1], place[..., 2]
        a, b = slopes[1] * slopes[1] + slopes[2] * slopes[2], slopes[1] * y + slopes[2] * z
        c = half[..., 1] ** 2 - place[..., 1] ** 2 - place[..., 2] ** 2
        steep, is_in = plain(a) > PARALLEL, plain(c) > 0
        inside, unit = np.where(is_round & is_in & steep, c, 1.0), np.where(steep, a, 1.0)
        root, outside = np.sqrt(b * b + unit * inside), c / (2 * half[..., 1])
        for k, along in enumerate((b, -b)):
            away = np.where(is_in, (root - along) / unit, outside)
            exits[k] = _lesser(exits[k], np.where(is_round & (steep | ~is_in), away, np.inf))
    return exits[0], exits[1]


def _lesser(a: Array, b: Array) -> Array:
    """The smaller of two, with its slopes; of equal ones the first."""
    return np.where(plain(b) < plain(a), b, a)
