"""All topologies of a stated grammar that hold a platform in what is not wished, and in nothing that is.

A topology is one pattern of limbs, or two: of as many limbs of one kind each, or one of them a limb in the middle. A
pattern is one limb, or two, three or four evenly around the normal of the base through the middle of the platform. A
limb is of one kind, begins at a site of the platform, and leads along a direction of the grammar: radial, tangential and
along the normal at its site, halfway between two of these, or where the lines that are borne there meet one of their
planes. Limbs of which any bears a wrench that does work on a
wished freedom are left out (Blanding 1999; Hopkins and Culpepper 2010); those of a topology together bear all others,
and none of its patterns can be left out. What differs by a symmetry of the wish is one topology.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from flexura.arrays import Array
from flexura.screws import ScrewSpace
from flexura.synthesis.limbs import KINDS, Kind, Sizes, unit_sizes
from flexura.synthesis.wish import ROOM, Room

COUNTS = (1, 2, 3, 4)
"""Limbs of a pattern."""


RADII = (0.8, 0.55)
"""Distance from the axis of sites below the platform, over the way to its edge: as drawn first, and another one for
what must not depend on it."""

RANK = 1e-6
"""Eigenvalue of a sum of projections up to which it is none."""

SHORTEST = 0.1
"""Least length of a limb, over the smallest edge of the envelope."""

ALONG = 1e-6


class Site(NamedTuple):
    """Where a limb begins: below the platform or at its side, at an azimuth, rad, and a height, m; `reach` is how far
    from the axis the edge of the platform is there. The one in the middle below it has a reach of zero."""

    where: str
    azimuth: float
    height: float
    reach: float

    def head(self, room: Room, radius: float) -> Array:
        """Its point (3,), so far from the axis over the reach."""
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        r = self.reach * (radius if self.where == "below" else 1.0 if radius == RADII[0] else 1.2)
        return np.array([room.middle[0] + r * c, room.middle[1] + r * s, self.height])

    @property
    def axes(self) -> Array:
        """Radial, tangential and normal directions there, columns (3, 3)."""
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def sites(room: Room) -> list[Site]:
    """All sites of a platform: below it and at its sides, at the heights of its edges, its middle and of the point that
    rotations pass through."""
    a, b, h = room.platform
    z = room.middle[2]
    low, high = z - h, z + h
    heights = sorted({round(float(own), 9) for own in (low, z, high, room.about[2]) if 0 < own <= 2 * room.half[2]})
    if room.shape == "box":
        corner = float(np.arctan2(b, a))
        edges = [(0.0, a), (np.pi / 2, b), (corner, float(np.hypot(a, b)))]
    else:
        edges = [(angle, a) for angle in (0.0, np.pi / 2, np.pi / 4, np.pi / 3)]
    found = [Site("below", 0.0, float(low), 0.0)]
    found += [Site("below", float(angle), float(low), float(reach)) for angle, reach in edges]
    found += [Site("side", float(angle), height, float(reach)) for height in heights for angle, reach in edges]
    return found


@dataclass(frozen=True)
class Pattern:
    """Equal limbs around the axis: their kind, the site of the first, its axes (m, e, d) as columns (3, 3), and how
    many there are. `run` is how long a limb can be before it leaves the envelope, m."""

    kind: Kind
    site: Site
    axes: Array
    count: int
    run: float

    def turns(self) -> list[Array]:
        """Rotations (3, 3) of the copies about the axis."""
        return [_about_z(2 * np.pi * k / self.count) for k in range(self.count)]

    def spaces(self, room: Room, sizes: Sizes, radius: float) -> list[ScrewSpace]:
        """What each copy bears, about the origin of the room."""
        axis = np.array([*room.middle[:2], 0.0])
        own = self.kind.wrenches(sizes, room.freedoms.length).moved(self.axes, self.site.head(room, radius) - axis)
        return [own.moved(turn).moved(np.eye(3), axis) for turn in self.turns()]

    @property
    def n_constraints(self) -> int:
        """How many wrenches its limbs bear, each counted by itself."""
        return self.count * self.kind.wrenches(unit_sizes(self.kind, 1.0), 1.0).dimension

    def key(self) -> tuple[object, ...]:
        """What tells it from others of the same wish."""
        return self.kind.name, self.site, tuple(np.round(self.axes, 6).ravel().tolist()), self.count


@dataclass(frozen=True)
class Topology:
    """Patterns of limbs that hold the platform together. `over` counts constraints of single limbs beyond those that
    are needed."""

    patterns: tuple[Pattern, ...]
    over: int

    @property
    def n_limbs(self) -> int:
        """How many limbs there are."""
        return sum(own.count for own in self.patterns)

    @cached_property
    def name(self) -> str:
        """Such as `3 tangential wires at the side`."""
        return " and ".join(map(_named, self.patterns))


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _directions(site: Site, borne: Array) -> list[Array]:
    """Directions of the grammar at a site, of which lines are borne there (3, k) at all: unit vectors (3,)."""
    axes = site.axes
    found = [axes @ np.array(c, dtype=float) for c in product((-1, 0, 1), repeat=3) if 0 < np.abs(c).sum() < 3]
    if borne.shape[1] == 1:
        found += [borne[:, 0], -borne[:, 0]]
    if borne.shape[1] == 2:
        normal = np.cross(borne[:, 0], borne[:, 1])
        for own in axes.T:
            line = np.cross(normal, own)
            if np.linalg.norm(line) > ALONG:
                found += [line, -line]
    unique: dict[tuple[float, ...], Array] = {}
    for own in found:
        d = own / np.linalg.norm(own)
        unique.setdefault(tuple(np.round(d, 6) + 0.0), d)
    return list(unique.values())


def _widths(site: Site, d: Array, kind: Kind) -> Iterator[Array]:
    """Directions across d along which a limb may be wide."""
    across = [own for own in site.axes.T if abs(own @ d) < ALONG]
    slanting = [np.cross(d, own) for own in site.axes.T if ALONG < abs(own @ d) < 1 - ALONG]
    unique: dict[tuple[float, ...], Array] = {}
    for own in (*across, *slanting):
        e = own / np.linalg.norm(own)
        unique.setdefault(tuple(np.round(e, 6) + 0.0), e)
    chosen = [e for key, e in unique.items() if tuple(-np.array(key) + 0.0) not in unique or key > tuple(-np.array(key))]
    if kind.is_round:
        yield chosen[0]
        return
    one_sided = any(abs(axes[0]) > 0 for name in kind.feet for axes in kind.nodes[name].values())
    for e in chosen:
        yield e
        if one_sided and len(kind.heads) == 1 or kind.name == "crossed guides":
            yield -e


def patterns(room: Room, process: str) -> list[Pattern]:
    """All patterns of the grammar of which no limb works against a wished freedom."""
    found: dict[tuple[object, ...], Pattern] = {}
    kinds = [kind for kind in KINDS.values() if process in kind.processes]
    kinds = [kind for kind in kinds if process != "wire-cut" or kind.is_planar]
    for site in sites(room):
        borne = room.wrenches.directions_at(site.head(room, RADII[0]))
        for d in _directions(site, borne):
            run = _run(room, site, d)
            counts = [n for n in (COUNTS if site.reach else (1,)) if run[n - 1] >= SHORTEST * room.size]
            for kind in kinds if counts else ():
                for e in _widths(site, d, kind):
                    axes = np.stack([np.cross(e, d), e, d], axis=1)
                    if _works(kind, axes, site, room):
                        continue
                    for count in counts:
                        if _are_free(kind, axes, site, room, count):
                            own = Pattern(kind, site, axes, count, run[count - 1])
                            found.setdefault(own.key(), own)
    return list(found.values())


def _works(kind: Kind, axes: Array, site: Site, room: Room) -> bool:
    """Whether one limb works against a wished freedom, whatever its sizes are and however far from the axis it is."""
    F = room.freedoms.basis / np.repeat([1.0, room.freedoms.length], 3)[:, None]
    for scale, radius in zip((1.0, 0.7), RADII, strict=True):
        sizes = unit_sizes(kind, scale * room.freedoms.length)
        if np.abs(F.T @ _borne(kind, axes, site.head(room, radius), sizes)).max(initial=0.0) > ALONG:
            return True
    return False


def _borne(kind: Kind, axes: Array, head: Array, sizes: Sizes) -> Array:
    """Wrenches (6, n) of a limb about the origin of the room, moments in m."""
    own = kind.bears(sizes)
    force, moment = axes @ own[:3], axes @ own[3:]
    return np.concatenate([force, moment + np.cross(head, force, axis=0)])


def _are_free(kind: Kind, axes: Array, site: Site, room: Room, count: int) -> bool:
    """Whether no copy of several works against a wished freedom."""
    axis = np.array([*room.middle[:2], 0.0])
    F = room.freedoms.basis / np.repeat([1.0, room.freedoms.length], 3)[:, None]
    sizes, head = unit_sizes(kind, room.freedoms.length), site.head(room, RADII[0]) - axis
    for k in range(1, count):
        turn = _about_z(2 * np.pi * k / count)
        if np.abs(F.T @ _borne(kind, turn @ axes, turn @ head + axis, sizes)).max(initial=0.0) > ALONG:
            return False
    return True


def _run(room: Room, site: Site, d: Array) -> list[float]:
    """How long limbs may be along d before the first of one, two, three or four of them leaves the envelope, m."""
    head = site.head(room, RADII[0])
    axis = np.array([*room.middle[:2], 0.0])
    runs = []
    for count in COUNTS:
        shortest = np.inf
        for k in range(count):
            turn = _about_z(2 * np.pi * k / count)
            p, v = turn @ (head - axis) + axis - [0.0, 0.0, room.half[2]], turn @ d
            with np.errstate(divide="ignore", invalid="ignore"):
                way = np.where(np.abs(v) > ALONG, (np.sign(v) * room.half - p) / v, np.inf)
            shortest = min(shortest, float(way.min()))
        runs.append(shortest - ROOM * room.size)
    return runs


def drawn_first(pattern: Pattern, room: Room, thinnest: float) -> Sizes:
    """Sizes, m, in the middle of their limits."""
    return {
        name: scale_of(limit.of, pattern, room, thinnest) * (limit.least + limit.most) / 2
        for name, limit in pattern.kind.sizes.items()
    }


def scale_of(of: str, pattern: Pattern, room: Room, thinnest: float) -> float:
    """What the limits of a size are multiples of, m."""
    if of == "thinnest":
        return thinnest
    if of == "room":
        return pattern.run
    if of == "size":
        return room.size
    return _width_room(pattern, room)


def _width_room(pattern: Pattern, room: Room) -> float:
    """How wide a limb may be where it begins, m."""
    e, site = np.abs(pattern.site.axes.T @ pattern.axes[:, 1]), pattern.site
    tall = 2 * float(room.platform[2])
    edge = float(room.platform[:2].min())
    if e[2] > 1 - ALONG:
        return tall
    if site.where == "side":
        return min(edge, tall)
    across = 2 * edge if pattern.count <= 2 and e[1] > 1 - ALONG else edge
    return across if site.reach else edge


def points_of(pattern: Pattern, room: Room, sizes: Sizes) -> list[dict[str, Array]]:
    """Nodes of every copy in the frame of the room, m."""
    axis = np.array([*room.middle[:2], 0.0])
    head = pattern.site.head(room, RADII[0]) - axis
    own = {name: head + pattern.axes @ x for name, x in pattern.kind.points(sizes).items()}
    return [{name: turn @ x + axis for name, x in own.items()} for turn in pattern.turns()]


LEAST_AWAY = 3.0
"""Distance of limbs from each other, over the thinnest web."""

SAMPLES = 9
"""Points along a member at which it is held against what is in its way."""


def _swept(pattern: Pattern, room: Room, thinnest: float) -> Array:
    """Points (copies, n, 3) along the middle and both edges of all members of each copy."""
    sizes = drawn_first(pattern, room, thinnest)
    wide = sizes.get("width", 0.0) / 2 * 0.8
    at = (np.arange(SAMPLES) + 0.5) / SAMPLES
    every = []
    for turn, nodes in zip(pattern.turns(), points_of(pattern, room, sizes), strict=True):
        e = turn @ pattern.axes[:, 1] * wide
        lines = [nodes[a] + at[:, None] * (nodes[b] - nodes[a]) for a, b, _ in pattern.kind.members.values()]
        line = np.concatenate(lines)
        every.append(np.concatenate([line, line + e, line - e]) if wide else line)
    return np.array(every)


def fits(pattern: Pattern, room: Room, thinnest: float) -> bool:
    """Whether all copies, drawn first, are within the envelope, outside of the platform and clear of each other."""
    points = _swept(pattern, room, thinnest)
    flat = points.reshape(-1, 3)
    if (room.outside(flat) > 0).any() or room.in_platform(flat, 0.02 * room.size).any():
        return False
    others = points[1:].reshape(-1, 3)
    return not len(others) or bool(cdist(points[0], others).min() > LEAST_AWAY * thinnest)


def topologies(room: Room, process: str, thinnest: float) -> list[Topology]:
    """All topologies of a wish, the plainest first: fewest limbs, constraints and patterns."""
    need = room.wrenches.dimension
    if need == 0:
        return []
    every = [own for own in patterns(room, process) if fits(own, room, thinnest)]
    if not every:
        return []
    projections = np.array([_projection(own, room) for own in every])
    rank = _ranks(projections)
    swept = [_swept(own, room, thinnest) for own in every]
    trees = [KDTree(own.reshape(-1, 3)) for own in swept]
    far = LEAST_AWAY * thinnest
    found: dict[bytes, Topology] = {}
    symmetries = np.array(symmetries_of(room))
    for chosen in _sets(every, projections, rank, need):
        own = [every[k] for k in chosen]
        if process == "wire-cut" and not _one_cut(own):
            continue
        if any(np.isfinite(trees[a].query(swept[b][0], 1, 0.0, 2, far)[0]).any() for a, b in combinations(chosen, 2)):
            continue
        found.setdefault(
            _canonical(own, room, symmetries), Topology(tuple(own), sum(p.n_constraints for p in own) - need)
        )
    return sorted(found.values(), key=_plainness)


def _plainness(own: Topology) -> tuple[object, ...]:
    order = list(KINDS)
    lone = sum(p.count == 1 and p.site.reach > 0 for p in own.patterns)
    return (
        len(own.patterns) + lone,
        own.n_limbs + own.over / 2,
        own.over,
        [order.index(p.kind.name) for p in own.patterns],
        own.name,
    )


def _projection(own: Pattern, room: Room) -> Array:
    """The projection (6, 6) on what a pattern bears."""
    spaces = own.spaces(room, unit_sizes(own.kind, room.freedoms.length), RADII[0])
    B = np.concatenate([space.basis for space in spaces], axis=1)
    U, s, _ = np.linalg.svd(B, full_matrices=False)
    U = U[:, s > RANK * s[0]]
    return U @ U.T


def _ranks(P: Array) -> Array:
    """Ranks (n,) of sums of projections (n, 6, 6)."""
    return (np.linalg.eigvalsh(P) > RANK).sum(axis=-1)


def _sets(every: Sequence[Pattern], P: Array, rank: Array, need: int) -> Iterator[tuple[int, ...]]:
    """Sets of patterns that bear all that is needed: a pattern alone, or two, neither of which does, of as many equal
    limbs each or with one of them a limb in the middle."""
    limbs = np.array([own.count for own in every])
    for k in np.flatnonzero(rank == need):
        yield (int(k),)
    middle = np.array([not own.site.reach for own in every], dtype=bool)
    kind = np.array([own.kind.name for own in every])
    short = np.flatnonzero((rank < need) & ((limbs > 1) | middle))
    for n, i in enumerate(short):
        others = short[n + 1 :]
        others = others[((limbs[others] == limbs[i]) & (kind[others] == kind[i])) | middle[i] | middle[others]]
        others = others[rank[i] + rank[others] >= need]
        if len(others):
            for j in others[_ranks(P[i] + P[others]) == need]:
                yield int(i), int(j)


def _one_cut(own: Iterable[Pattern]) -> bool:
    """Whether all flexures can be cut along one line."""
    widths = np.array([turn @ p.axes[:, 1] for p in own for turn in p.turns()])
    return bool((np.abs(widths @ widths[0]) > 1 - ALONG).all())


def symmetries_of(room: Room) -> list[Array]:
    """Rotations and mirrors (3, 3) about the axis of the platform that leave the wish and the platform as they are."""
    axis = np.array([*room.middle[:2], 0.0])
    steps = 24 if room.shape == "cylinder" else 4 if abs(room.platform[0] - room.platform[1]) < ALONG * room.size else 2
    found = []
    for k, mirrored in product(range(steps), (False, True)):
        S = _about_z(2 * np.pi * k / steps) @ np.diag([1.0, -1.0 if mirrored else 1.0, 1.0])
        moved = room.freedoms.moved(np.eye(3), -axis).moved(S).moved(np.eye(3), axis)
        if room.freedoms.holds(moved):
            found.append(S)
    return found


def _canonical(own: Sequence[Pattern], room: Room, symmetries: Array) -> bytes:
    """What all topologies have in common that differ by a symmetry (s, 3, 3) of the wish: the least of the sorted rows
    of their limbs, one for each."""
    rows = []
    order = list(KINDS)
    for p in own:
        head = p.site.head(room, RADII[0]) - [*room.middle[:2], 0.0]
        far = p.axes @ sum(
            (
                (1.0 + 0.37 * k) * np.array(axes)
                for node in p.kind.feet[:1]
                for k, axes in enumerate(p.kind.nodes[node].values())
            ),
            np.zeros(3),
        )
        e = p.axes[:, 1] if p.kind.width else np.zeros(3)
        for turn in p.turns():
            x = symmetries @ turn @ np.stack([head / room.size, far, e], axis=1)
            first = np.abs(x[:, :, 2]) > ALONG
            sign = np.take_along_axis(np.sign(x[:, :, 2]), first.argmax(axis=1)[:, None], axis=1)
            x[:, :, 2] *= np.where(sign == 0, 1.0, sign)
            kind = np.full((len(x), 2), [order.index(p.kind.name), p.site.where == "below"])
            rows.append(np.concatenate([kind, x.transpose(0, 2, 1).reshape(-1, 9)], axis=1))
    stacked = np.round(np.stack(rows, axis=1), 4) + 0.0
    return min(own[np.lexsort(own.T[::-1])].tobytes() for own in stacked)


def _named(own: Pattern) -> str:
    """A pattern in words."""
    d = own.site.axes.T @ own.axes[:, 2]
    words = [word for word, part in zip(("radial", "tangential", "upright"), d, strict=True) if abs(part) > ALONG]
    how = words[0] if len(words) == 1 else "-".join(words)
    kind = own.kind.name if own.count == 1 else _plural(own.kind.name)
    where = "below" if own.site.where == "below" else "at the side"
    wide = ""
    if own.kind.width:
        e = np.abs(own.site.axes.T @ own.axes[:, 1])
        wide = f", wide {('radially', 'tangentially', 'upright')[int(np.argmax(e))]}"
    return f"{own.count} {how} {kind} {where}{wide}"


def _plural(name: str) -> str:
    return {"leaf": "leaves", "folded leaf": "folded leaves", "notch": "notches", "crossed guides": "crossed guides"}.get(name, f"{name}s")
