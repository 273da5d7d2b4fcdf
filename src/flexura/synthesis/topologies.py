"""All topologies of a stated grammar that hold a platform in what is not wished, and in nothing that is.

A topology is one of the `patterns` of limbs, or two: of as many limbs of one kind each, or one of them a limb in the
middle. Two of as many limbs are one above the other or halfway between; where they lead alike at unlike heights, at the
two edges of the platform; and parallel where they are single. Those of a topology together bear all that does no work
on the wished freedoms, and none of its patterns can be left out. Of heights at which a pattern bears the same it is
nearest the middle. What differs by a symmetry of the wish is one topology, drawn where its limbs have the most room.
Where piezo stacks move the platform each topology is combined with all amplifiers that may reach (`drives`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from scipy.spatial import KDTree

from flexura.arrays import Array, Index
from flexura.synthesis.amplifiers import Drive
from flexura.synthesis.fitting import as_drawn, fitted, nearer, stouter
from flexura.synthesis.limbs import KINDS, unit_sizes
from flexura.synthesis.patterns import ALONG, LEAST_AWAY, RADII, Pattern, about_z, patterns
from flexura.synthesis.wish import Room

RANK = 1e-6
"""Eigenvalue of a sum of projections up to which it is none."""


STOUT = (8.0, 4.0, 2.0, 1.4, 1.0)
"""Times by which posts are stouter than they have to be, where there is room."""


@dataclass(frozen=True)
class Topology:
    """Patterns of limbs that hold the platform together. `over` counts constraints of single limbs beyond those that
    are needed; the `name` is such as `3 tangential wires at the side`. Piezo stacks move it by a `drive`."""

    patterns: tuple[Pattern, ...]
    over: int
    name: str
    drive: Drive | None = None

    @property
    def n_limbs(self) -> int:
        """How many limbs there are."""
        return sum(own.count for own in self.patterns)


def topologies(room: Room, process: str, thinnest: float) -> list[Topology]:
    """All topologies of a wish, the plainest first: few members, patterns and constraints that are not needed."""
    need = room.wrenches.dimension
    if need == 0:
        return []
    every = _first_that_fit(patterns(room, process), room, thinnest)
    if not every:
        return []
    P = np.array([_projection(own, room) for own in every])
    numbers = _numbers(every, room)
    swept = [as_drawn(own, room, thinnest).all for own in every]
    trees = [KDTree(own.reshape(-1, 3)) for own in swept]
    limbs, far = [own.count for own in every], LEAST_AWAY * room.size
    found: dict[tuple[int, ...], tuple[int, ...] | None] = {}
    for chosen in _sets(every, P, _ranks(P), room):
        own = [every[k] for k in chosen]
        if process == "wire-cut" and not _one_cut(own):
            continue
        key = min(map(tuple, np.sort(np.concatenate([numbers[k] for k in chosen], axis=1), axis=1).tolist()))
        kept = found.get(key)
        if key in found and (kept is None or _room_of(own) <= 1.05 * _room_of([every[k] for k in kept])):
            continue
        if any(_meet(trees[a], swept[b], limbs[a] == limbs[b], far) for a, b in combinations(chosen, 2)):
            found.setdefault(key, None)
            continue
        found[key] = chosen
    sets = [tuple(every[k] for k in chosen) for chosen in found.values() if chosen]
    listed = [
        Topology(own, sum(p.n_constraints for p in own) - need, " and ".join(_named(p, room) for p in own))
        for own in sets
    ]
    return _sorted(listed)


def with_stout_posts(own: Topology, room: Room, thinnest: float) -> Topology:
    """A topology with posts as stout as its other limbs and its drives leave room for, one pattern after another."""
    chosen = list(own.patterns)
    far = LEAST_AWAY * room.size
    for k, plain in enumerate(chosen):
        others = [as_drawn(other, room, thinnest).all.reshape(-1, 3) for other in chosen[:k] + chosen[k + 1 :]]
        for stout in STOUT:
            if (thick := stouter(plain, stout, room, thinnest)) is None:
                continue
            points = as_drawn(thick, room, thinnest).all.reshape(-1, 3)
            if own.drive is not None and own.drive.away(points) < far:
                continue
            if not any(_meet(KDTree(points), other[None], True, far) for other in others):
                chosen[k] = thick
                break
    return replace(own, patterns=tuple(chosen))


def _meet(tree: KDTree, swept: Array, alike: bool, far: float) -> bool:
    """Whether copies (n, p, 3) of a pattern come nearer than so far, m, to the points of another: the first stands for
    all of as many."""
    points = swept[0] if alike else swept.reshape(-1, 3)
    return nearer(tree, points, far)


def _room_of(own: Sequence[Pattern]) -> float:
    return min(p.run for p in own)


def _sorted(listed: Sequence[Topology]) -> list[Topology]:
    """The plainest first, of those that differ in heights, azimuths and distances from the middle alone: then all
    others, and those with mirrored pairs, again the plainest first. Those that are the same in words, which do not tell
    the sides of arms and which way round limbs lead, are numbered."""
    seen: set[tuple[object, ...]] = set()
    firsts, others = [], []
    for own in sorted(listed, key=_plainness):
        alike = tuple(
            (p.kind.name, p.count, p.site.where, _rounded(np.abs(p.site.axes.T @ p.axes[:, 1:]))) for p in own.patterns
        )
        is_further = any(p.mirrored or (p.pinned and p.site.out < RADII[0]) for p in own.patterns)
        (others if alike in seen or is_further else firsts).append(own)
        seen.add(alike)
    counts: dict[str, int] = {}
    listed = []
    for own in firsts + others:
        counts[own.name] = n = counts.get(own.name, 0) + 1
        listed.append(own if n == 1 else replace(own, name=f"{own.name} ({n})"))
    return listed


def _plainness(own: Topology) -> tuple[object, ...]:
    """What topologies are sorted by: flexures, constraints that are not needed, and what each further pattern and kind,
    each limb to one side, and patterns that slant are counted as."""
    order = list(KINDS)
    flexures = sum(p.count * p.kind.n_flexures for p in own.patterns)
    mixed = len({p.kind.name for p in own.patterns}) - 1
    lone = sum(p.is_asymmetric for p in own.patterns)
    slanting = sum(np.abs(p.site.axes.T @ p.axes[:, 2]).max() < 1 - ALONG for p in own.patterns)
    return (
        flexures + own.over / 3 + 3 * (len(own.patterns) - 1 + lone + mixed + 2 * slanting),
        own.over,
        [order.index(p.kind.name) for p in own.patterns],
        sum(p.site.where == "beside" for p in own.patterns),
        sum(p.site.azimuth for p in own.patterns),
        own.name,
    )


def _projection(own: Pattern, room: Room) -> Array:
    """The projection (6, 6) on what a pattern bears."""
    length = room.freedoms.length
    B = np.concatenate(list(own.wrenches(room)), axis=1)
    B = B / np.repeat([1.0, length], 3)[:, None]
    B = B / np.linalg.norm(B, axis=0)
    U, s, _ = np.linalg.svd(B, full_matrices=False)
    U = U[:, s > RANK * s[0]]
    return U @ U.T


def _first_that_fit(every: Sequence[Pattern], room: Room, thinnest: float) -> list[Pattern]:
    """Of patterns that bear the same and are the same but for their height, the sides of their arms and which way along
    d they lead, the one nearest the middle of the platform with the most room that fits."""
    found: dict[tuple[object, ...], tuple[int, Pattern]] = {}
    for k in sorted(range(len(every)), key=lambda k: _roominess(every[k], room)):
        own = every[k]
        is_moved = own.site.where == "below" and not own.pinned
        alike = own.site._replace(out=RADII[0]) if is_moved else own.site
        P = _rounded(_projection(replace(own, site=alike), room))
        e, d = own.axes[:, 1], own.axes[:, 2]
        lines = _rounded(np.outer(e, e)) if own.kind.width else P, _rounded(np.outer(d, d))
        key = own.kind.name, alike._replace(height=0.0), own.count, lines, P
        if key not in found and (fits := fitted(own, room, thinnest)):
            found[key] = k, fits
    return [own for _, own in sorted(found.values(), key=lambda own: own[0])]


def _roominess(own: Pattern, room: Room) -> tuple[float, ...]:
    """What patterns of the same are sorted by: nearest the middle of the platform, with the most room."""
    inside = 0.0 if own.pinned else -own.site.out
    return abs(own.site.height - room.middle[2]), inside, own.mirrored, -round(own.run, 9), -own.across


def _rounded(own: Array) -> bytes:
    return (np.round(own, 5) + 0.0).tobytes()


def _ranks(P: Array) -> Array:
    """Ranks (n,) of sums of projections (n, 6, 6)."""
    return (np.linalg.eigvalsh(P) > RANK).sum(axis=-1)


def _sets(every: Sequence[Pattern], P: Array, rank: Array, room: Room) -> Iterator[tuple[int, ...]]:
    """Sets of patterns that bear all that is needed: a pattern alone, or two, neither of which does, of as many equal
    limbs each, one above the other or halfway between, of single ones parallel, or with one
    of them a limb in the middle."""
    need = room.wrenches.dimension
    limbs = np.array([own.count for own in every])
    for k in np.flatnonzero(rank == need):
        yield (int(k),)
    middle = np.array([not own.site.reach for own in every], dtype=bool)
    sides = np.array([own.site.where != "below" for own in every])
    up = np.array([own.site.height - room.middle[2] for own in every])
    between = (np.abs(up) < ALONG * room.size) & (np.abs(up + room.middle[2] - room.about[2]) > ALONG * room.size)
    order = list(KINDS)
    kind = np.array([order.index(own.kind.name) for own in every])
    halves = np.array([own.site.azimuth for own in every]) * limbs / np.pi
    d = np.array([own.axes[:, 2] for own in every])
    ways = np.array([np.abs(own.site.axes.T @ own.axes[:, 2]) for own in every])
    alike = (np.abs(ways[:, None] - ways) < ALONG).all(axis=2) & sides[:, None] & sides
    short = np.flatnonzero(rank < need)
    for n, i in enumerate(short):
        others = short[n + 1 :]
        turned = halves[others] - halves[i]
        in_step = np.abs(turned - np.round(turned)) < ALONG
        equal = (limbs[others] == limbs[i]) & (kind[others] == kind[i]) & in_step & ~middle[i] & ~middle[others]
        equal &= ~alike[others, i] | ~(between[others] ^ between[i])
        parallel = (limbs[i] > 1) | (np.abs(d[others] @ d[i]) > 1 - ALONG)
        around = middle[i] & (limbs[others] > 1) | middle[others] & (limbs[i] > 1)
        others = others[equal & parallel | around]
        others = others[rank[i] + rank[others] >= need]
        if len(others):
            for j in others[_ranks(P[i] + P[others]) == need]:
                yield int(i), int(j)


def _one_cut(own: Sequence[Pattern]) -> bool:
    """Whether all flexures can be cut along one line."""
    widths = np.concatenate([p.turns() @ p.axes[:, 1] for p in own])
    return bool((np.abs(widths @ widths[0]) > 1 - ALONG).all())


def symmetries_of(room: Room) -> list[Array]:
    """Rotations and mirrors (3, 3) about the axis of the platform that leave the wish and the platform as they are."""
    axis = np.array([*room.middle[:2], 0.0])
    steps = 24 if room.shape == "cylinder" else 4 if abs(room.platform[0] - room.platform[1]) < ALONG * room.size else 2
    about = room.freedoms.moved(np.eye(3), -axis)
    found = []
    for k, mirrored in product(range(steps), (False, True)):
        S = about_z(2 * np.pi * k / steps) @ np.diag([1.0, -1.0 if mirrored else 1.0, 1.0])
        if about.holds(about.moved(S)):
            found.append(S)
    return found


def _numbers(every: Sequence[Pattern], room: Room) -> list[Index]:
    """Numbers (s, copies) of what the limbs of each pattern become by the symmetries of the wish, the same of the same:
    by kind, head, foot and width."""
    symmetries = np.array(symmetries_of(room))
    order = list(KINDS)
    known: dict[bytes, int] = {}
    numbers = []
    for p in every:
        head = (p.site.head(room) - [*room.middle[:2], 0.0]) / room.size
        foot = p.axes @ p.kind.points(unit_sizes(p.kind, 1.0))[p.kind.feet[0]]
        e = p.axes[:, 1] if p.kind.width else np.zeros(3)
        x = symmetries[:, None] @ p.turns() @ np.array([head, foot, e]).T
        wide = x[..., 2]
        first = (np.abs(wide) > ALONG).argmax(axis=-1)[..., None]
        wide = wide * np.sign(np.take_along_axis(wide, first, axis=-1))
        rows = np.round(np.concatenate([x[..., 0], x[..., 1], wide], axis=-1), 4) + 0.0
        told = bytes((order.index(p.kind.name), ("below", "side", "beside").index(p.site.where)))
        own = [known.setdefault(told + row.tobytes(), len(known)) for row in rows.reshape(-1, rows.shape[-1])]
        numbers.append(np.array(own).reshape(rows.shape[:2]))
    return numbers


def _named(own: Pattern, room: Room) -> str:
    """A pattern in words."""
    d = own.site.axes.T @ own.axes[:, 2]
    forth, back = ("radial", "tangential", "upward"), ("inward", "tangential", "upright")
    words = [b if x < 0 else f for f, b, x in zip(forth, back, d, strict=True) if abs(x) > ALONG]
    kind = own.kind.name if own.count == 1 else _PLURALS.get(own.kind.name, f"{own.kind.name}s")
    wide = ""
    if own.kind.width:
        e = np.abs(own.site.axes.T @ own.axes[:, 1])
        wide = f", wide {('radially', 'tangentially', 'upright')[int(np.argmax(e))]}"
    mirrored = "mirrored " * own.mirrored
    return f"{own.count} {mirrored}{'-'.join(words)} {kind} {_place(own, room)}{wide}"


def _place(own: Pattern, room: Room) -> str:
    """Where a pattern is, in words."""
    site = own.site
    angle = f" from {np.degrees(site.azimuth):.0f} deg on" if abs(site.azimuth) > ALONG else ""
    if site.where == "below":
        further = f" {100 * site.out:.0f} % out" if own.pinned and site.out < RADII[0] else ""
        return f"below{further}{angle}" if site.reach else "in the middle below"
    up = site.height - room.middle[2]
    if abs(up) < ALONG * room.size:
        return f"at the side{angle}"
    return f"at the {'upper' if up > 0 else 'lower'} edge{angle}"


_PLURALS = {
    "leaf": "leaves",
    "folded leaf": "folded leaves",
    "leaf folded on the axis": "leaves folded on the axis",
    "notch": "notches",
    "post on a notch": "posts on notches",
    "post on a round neck": "posts on round necks",
    "crossed guides": "crossed guides",
}
