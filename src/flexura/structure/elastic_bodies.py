"""Bodies that bend: their solids as superelements over patches at which members pull (theory eqs. O1-O5).

A member pulls at more than its own section: what its root gives lies in a part of the body that reaches from the
section as far as `flexura.structure.roots` takes it to, and only what lies beyond is in the body. So nothing is counted
twice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np

from flexura.arrays import Array, Bools, Index
from flexura.beam import (
    ElasticSolid,
    FiniteSolid,
    Material,
    ModalSolid,
    Patches,
    RitzSolid,
    Solid,
    block_rotation,
    elastic_body,
    leads,
)
from flexura.duals import plain, with_slopes_of
from flexura.records import Latest
from flexura.structure.composites import ROOT_DEPTH, MeshedSolid
from flexura.structure.discrete_elements import BodyElement, Hold, Lumped
from flexura.structure.values import common

AMPLITUDES = 6
"""Amplitudes of a body beside the displacements of its patches."""

STIFFEST = 0.495
"""Poisson's ratio above which polynomials would lock."""

BARE = 0.1
"""Half side, over the least half side of the body, of the patch of a node at which no member ends."""

LEAST = 0.02
"""How far a patch reaches at least, over the least half side of the body: at an edge, too."""

LEAST_SHARE = 0.5
"""Share of a patch that is on a composite, at least."""

POINTS = 5
"""Gauss points along each side of a patch on polynomials."""

FINE, FINEST = 2.0, (8, 40)
"""The same for every cell along the side of a patch on a mesh, and the least and the most."""


@cache
def _square(n: int) -> Array:
    """Places across and along a patch of half sides one, and weights (3, n^2) that add up to 1."""
    grid, weights = np.polynomial.legendre.leggauss(n)
    across, along = np.meshgrid(grid, grid, indexing="ij")
    return np.stack([across.ravel(), along.ravel(), np.outer(weights, weights).ravel() / 4])


@cache
def _disc(n: int) -> Array:
    """The same of a disc: rings by Gauss, each of as many points; the last ones count nothing."""
    rings = (n + 1) // 2
    count = n * n // rings
    square, share = np.polynomial.legendre.leggauss(rings)
    radius, angle = np.sqrt((square + 1) / 2), np.arange(count) * 2 * np.pi / count
    places = [np.outer(radius, wave(angle)).ravel() for wave in (np.cos, np.sin)]
    rows = np.stack([*places, np.repeat(share / (2 * count), count)])
    return np.pad(rows, ((0, 0), (0, n * n - rings * count)))


EndSizes: TypeAlias = tuple[Array, Array]
"""Widths and thicknesses (..., m, 2), m, at both ends of the members of all prototypes."""


class Bending(NamedTuple):
    """The bodies of a prototype that bend, by name, with how they are held; those of them that other bodies carry; and
    what bodies of this prototype carry of bodies that bend, by the names of their nodes and of their seats."""

    bodies: Mapping[str, Hold | None] = {}
    seated: frozenset[str] = frozenset()
    seats: Mapping[str, str] = {}


def seat(reference: str) -> str:
    """The node at which a body that bends sits on another one, by the name of its own."""
    return f"{reference}[seat]"


@dataclass(frozen=True)
class Pulls:
    """What pulls at the p carried nodes of a body: the member (p,) and its end (p,), -1 for none; its axes (p, 3, 3) as
    columns in those of the body, x leading into the body; the way (p, 3) from the node to its end, part's axes; whether
    it is a rod (p,); half sides (p, 2), m, of the patch where there is none; and whether a body sits there (p,)."""

    member: Index
    end: Index
    axes: Array
    offset: Array
    is_rod: Bools
    bare: Array
    is_seat: Bools


class OffSolidError(Exception):
    """What pulls at a composite where it has been cut away, or beside it: the place among what the body carries."""

    def __init__(self, carried: int) -> None:
        super().__init__(carried)
        self.carried = carried


class ElasticBody(Lumped):
    """K and M of a body that bends over its own node, the frame of its held face, carried nodes, and amplitudes."""

    body: BodyElement
    own: int
    carried: list[int]
    hold: Hold | None
    pulls: Pulls
    solid: RitzSolid
    finite: FiniteSolid
    """What a composite does, in place of `solid`."""
    points: int = POINTS
    """Points along each side of its patches."""
    rooms: tuple[Array, Array, Array] | None = None
    """Middles and half sizes (p, 3), m, of the boxes in which a composite is pulled at, and how much of the patches
    (p, q) is on it."""
    shapes: Array
    """Displacements (c, s, AMPLITUDES) whose amplitudes are coordinates."""

    def __init__(
        self, body: BodyElement, node: int, carried: list[int], frame: int | None = None, hold: Hold | None = None
    ) -> None:
        self.body, self.own, self.carried, self.hold = body, node, carried, hold
        self._latest: Latest[ElasticSolid] = Latest()
        self.nodes: list[int] = [node, *carried] if frame is None else [frame, *carried, node]
        """Nodes in the order of the matrices; those of the amplitudes last."""

    def place(self, values: Array, pulls: Pulls, positions: Array, ends: EndSizes) -> None:
        """Settle for one design what pulls at the body, and which functions it has; positions (n, 3) of its nodes.

        Raises OffSolidError where there is nothing of a composite to pull at.
        """
        self.pulls = pulls
        if self.body.mesh is not None:
            self._place_on(self.body.mesh, values, positions, ends)
            return
        _, half = self.body.box(values)
        self.solid = RitzSolid.of(2 * half, self.body.is_round, self.hold and self.hold.face, len(self.carried))
        self.shapes = ModalSolid(self.solid, 2 * half, self.material(values)).modes(AMPLITUDES)[1]

    def _place_on(self, mesh: MeshedSolid, values: Array, positions: Array, ends: EndSizes) -> None:
        pulls, pieces, rows = self.pulls, mesh.pieces, self.body.box(values)[0]
        at = (positions[1 : 1 + len(self.carried)] - positions[0] + pulls.offset) @ rows.T
        low, high = pieces.box
        at = np.clip(at, low, high)
        into = pulls.axes[..., 0]
        t, is_member = np.full(len(at), BARE * (high - low).min()), pulls.member >= 0
        t[is_member] = ends[1][pulls.member[is_member], pulls.end[is_member]]
        rooms = [pieces.room(*place) for place in zip(at, pulls.axes, t.tolist(), strict=True)]
        middle, half, depth = (np.array(column) for column in zip(*rooms, strict=True))
        self.rooms = middle, half, np.array(1.0)
        if not (depth > 0).all():
            raise OffSolidError(int(np.argmin(depth)))
        self.points = POINTS
        longest = np.ptp(self.patches(values, positions, ends).points, axis=1).max()
        self.points = int(np.clip(np.ceil(FINE * longest / mesh.cell), *FINEST))
        patches = self.patches(values, positions, ends)
        is_on = pieces.beyond(patches.points + (depth[:, None] * into)[:, None]) < 0
        self.rooms = middle, half, is_on.astype(float)
        if not (on := (patches.weights * is_on).sum(axis=1) > LEAST_SHARE).all():
            raise OffSolidError(int(np.argmin(on)))
        self.finite = mesh.solid(self.patches(values, positions, ends), self.hold and self.hold.face)
        self.shapes = self.finite.lowest(AMPLITUDES)

    def modal(self, values: Array) -> Solid:
        """The solid of one design."""
        if self.body.mesh is not None:
            return self.finite
        return ModalSolid(self.solid, 2 * self.body.box(values)[1], self.material(values))

    def material(self, values: Array) -> Material:
        """What it is made of, less incompressible than polynomials can follow."""
        E, nu, rho = (common(number, 0) for number in self.body.material(values))
        return Material(E, _lesser(nu, np.array(STIFFEST)), rho)

    def patches(self, values: Array, positions: Array, ends: EndSizes) -> Patches:
        """Where it is pulled at, in its own axes; positions (..., n, 3) of its nodes, part's axes."""
        pulls, count, n = self.pulls, len(self.carried), self.points
        rows, half = self.body.box(values)
        half, middle, share = half[..., None, :], np.zeros(3), np.array(1.0)
        if self.rooms is not None:
            middle, half, share = self.rooms
        turned = np.swapaxes(rows, -1, -2)
        nodes = (
            positions[..., 1 : 1 + count, :] - positions[..., :1, :]
        )  # the frame of a held face is at the centre, too
        at, nodes = (nodes + pulls.offset) @ turned - middle, nodes @ turned
        at = inside(at, half, self.body.is_round)
        is_member = pulls.member >= 0
        b, t = (
            np.where(is_member, size[..., pulls.member, pulls.end], 2 * bare) if is_member.any() else 2 * bare
            for size, bare in zip(ends, pulls.bare.T, strict=True)
        )
        # from a thickness within, or halfway through: beside the block, lines nearly along it would end at once
        deep = _exits(at, pulls.axes[..., 0], half, self.body.is_round)
        start = _lesser(t, np.where(plain(deep) > 0, deep / 2, t))
        inner = at + np.where(is_member[:, None], start[..., None] * pulls.axes[..., 0], 0.0)
        sides = [_exits(inner, sign * pulls.axes[..., k], half, self.body.is_round) for k in (2, 1) for sign in (1, -1)]
        behind = _exits(inner, pulls.axes[..., 0], half, self.body.is_round)
        behind = behind + np.where(is_member, start, t)
        up, down, left, right = (
            _lesser(side, reached) for side, reached in zip(sides, self._reach(b, t, behind), strict=True)
        )
        up, down = (_lesser(side, room) for side, room in zip((up, down), self._between(at, b, t), strict=True))
        least = LEAST * np.min(half, axis=-1)
        up, down, left, right = (-_lesser(-side, -least + 0 * side) for side in (up, down, left, right))
        y, z = pulls.axes[..., 1], pulls.axes[..., 2]
        centre = at + (up - down)[..., None] / 2 * z + (left - right)[..., None] / 2 * y
        across, along, shares = np.where(pulls.is_rod[:, None], _disc(n)[:, None], _square(n)[:, None])
        points = centre[..., None, :] + ((left + right) / 2)[..., None, None] * (across[..., None] * y[:, None])
        points = points + ((up + down) / 2)[..., None, None] * (along[..., None] * z[:, None])
        points = inside(points, half[..., None, :], self.body.is_round) + middle[..., None, :]
        if self.rooms is not None:
            shares = shares * share
            shares = shares / shares.sum(axis=-1)[..., None]
        return Patches(points, shares + 0 * points[..., 0], nodes)

    def _reach(self, b: Array, t: Array, behind: Array) -> tuple[Array, Array, Array, Array]:
        """How far patches reach along and against the member's z and y, at most."""
        share = _lesser(behind / (2 * t), np.array(1.0))
        beyond = np.where(self.pulls.member >= 0, share * ROOT_DEPTH * behind, 0.0)
        tall = np.where(plain(beyond) > plain(t) / 2, beyond, t / 2)
        wide = np.where(self.pulls.is_rod, tall, b / 2)
        return tall, tall, wide, wide

    def _between(self, at: Array, b: Array, t: Array) -> tuple[Array, Array]:
        """How far (..., p) patches may reach along and against the members' z: halfway to the next member beside."""
        axes, apart = self.pulls.axes, at[..., None, :, :] - at[..., :, None, :]
        x, y, z = (np.einsum("...kji,ki->...kj", apart, axes[..., k]) for k in range(3))
        b, t = (size + 0 * at[..., 0] for size in (b, t))
        beside = (np.abs(plain(y)) < plain(b[..., None, :] + b[..., :, None]) / 2) & (
            np.abs(plain(x)) < plain(t[..., None])
        )
        beside = beside & (self.pulls.member >= 0)
        rooms = []
        for sign in (1, -1):
            halfway = (sign * z + (t[..., :, None] - t[..., None, :]) / 2) / 2
            is_next = beside & (plain(sign * z) > 0)
            room = np.min(np.where(is_next, halfway, LARGE), axis=-1)
            rooms.append(np.where(plain(room) > plain(t) / 2, room, t / 2))
        return rooms[0], rooms[1]

    def _placed(self, values: Array, positions: Array, ends: EndSizes) -> tuple[Solid, Patches]:
        """Its solid and what pulls at it; what does not vary in a stack lacks its axis."""
        if self.body.mesh is not None:
            every = zip(self.patches(values, positions, ends), (3, 2, 2), strict=True)
            return self.finite, Patches(*(common(one, n) for one, n in every))
        size = common(2 * self.body.box(values)[1], 1)
        every = zip(self.patches(values, positions, ends), (3, 2, 2), strict=True)
        numbers = [size, *self.material(values)]
        solid = ElasticSolid(self.solid, size, self.material(values))
        if with_slopes_of(*numbers) is None:  # its inverse is kept
            key = b"".join(np.asarray(number).tobytes() for number in numbers)
            solid = self._latest.get(key, lambda: ElasticSolid(self.solid, size, self.material(values)))
        return solid, Patches(*(common(one, n) for one, n in every))

    def bent(self, values: Array, positions: Array, ends: EndSizes, points: Array) -> Array:
        """Displacements (q, 3, 6p) of points (q, 3) from its centre, part's axes, when its nodes after the first leave
        the places to which that carries them; one design."""
        rows, _ = self.body.box(values)
        solid, patches = self._placed(values, positions, ends)
        own = solid.displaced(leads(solid, patches)[0], points @ rows.T)
        count = own.shape[-1] // 3
        return np.asarray(rows.T @ (own.reshape(len(own), 3, count, 3) @ rows).reshape(own.shape))

    def superelement(self, values: Array, positions: Array, ends: EndSizes) -> tuple[Array, Array]:
        """K and M over its nodes, part's axes; `ends` are the sizes of all members."""
        rows, _ = self.body.box(values)
        turn = block_rotation(rows)
        rigid = turn @ self.body.matrix(values) @ np.swapaxes(turn, -1, -2)
        K, M = elastic_body(*self._placed(values, positions, ends), self.shapes, common(rigid, 2))
        count = len(self.nodes) - AMPLITUDES // 6
        T = np.zeros((*rows.shape[:-2], K.shape[-1], K.shape[-1]), like=rows)
        T[..., range(6 * count, K.shape[-1]), range(6 * count, K.shape[-1])] = 1.0
        for k in range(2 * count):
            T[..., 3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = rows
        T = common(T, 2)
        Tt = np.swapaxes(T, -1, -2)
        return Tt @ K @ T, Tt @ M @ T


LARGE = 1e30
"""A distance, m, that nothing is as large as."""

PARALLEL = 1e-9
"""Cosine below which a direction is along a face."""


def inside(points: Array, half: Array, is_round: bool) -> Array:
    """The nearest points (..., 3) within half sizes (..., 3) of a box, or of a cylinder about the first axis."""
    if not is_round:
        return -_lesser(-_lesser(points, half + 0 * points), half + 0 * points)
    radius = np.sqrt((points[..., 1:] ** 2).sum(axis=-1) + TINY * half[..., 1] ** 2)
    share = _lesser(half[..., 1] / radius, np.array(1.0))
    along = np.clip(points[..., :1], -half[..., :1], half[..., :1])
    return np.concatenate([along, points[..., 1:] * share[..., None]], axis=-1)


TINY = 1e-24
"""What keeps the axis of a cylinder from having a direction away from it."""


def _exits(at: Array, towards: Array, half: Array, is_round: bool) -> Array:
    """How far it is (..., p), m, from points (..., p, 3) in solids of half sizes (..., 1 or p, 3) along unit vectors
    (p, 3) to where they end."""
    exits: Array | None = None
    for axis in range(1 if is_round else 3):
        slope = towards[..., axis]
        steep = np.abs(slope) > PARALLEL
        size = np.where(steep, np.abs(slope), 1.0)
        room = (half[..., axis] - np.sign(slope) * at[..., axis]) / size
        room = np.where(steep, room, LARGE)
        exits = room if exits is None else _lesser(exits, room)
    assert exits is not None
    if is_round:
        y, z = at[..., 1], at[..., 2]
        a = (towards[..., 1:] ** 2).sum(axis=-1)
        b = (towards[..., 1:] * at[..., 1:]).sum(axis=-1)
        steep = a > PARALLEL
        unit = np.where(steep, a, 1.0)
        c = half[..., 1] ** 2 - y * y - z * z
        c = np.where(plain(c) > 0, c, 0.0 * c)
        room = (np.sqrt(b * b + unit * c + TINY * half[..., 1] ** 2) - b) / unit
        exits = _lesser(exits, np.where(steep, room, LARGE))
    return np.where(plain(exits) > 0, exits, 0.0 * exits)


def _lesser(a: Array, b: Array) -> Array:
    """The smaller of two, with its slopes; of equal ones the first."""
    return np.where(plain(b) < plain(a), b, a)
