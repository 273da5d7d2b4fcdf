"""Patterns of limbs: where limbs may be in the room of a wish, and how long and broad.

A pattern is one limb, or two, three or four evenly around the normal of the base through the middle of the platform, or
two of which one is the mirror image of the other; of one, two and four the first is on an axis of the base, of four on
a diagonal as well, of two at a corner of a box, and of three at every thirty degrees.

A limb is of one kind and begins below the platform, in the middle or near its edge, or at its side: at its edges,
halfway between, and where the point of the wish is if that is at the side. It leads away from the platform along a
direction of the grammar: radial, tangential, along the normal, halfway between the normal and one of the others, or
where the lines that are borne at its beginning are one line or meet one of the planes between these three; in the
middle along the normal. It is wide along one of the three, or across one of them.

Patterns of which any limb bears a wrench that does work on a wished freedom are left out (Blanding 1999; Hopkins and
Culpepper 2010), whatever their sizes are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import compress, product
from typing import Literal, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.synthesis.limbs import KINDS, Kind, Terms, place, unit_sizes
from flexura.synthesis.posts import (
    BEHIND,
    GAP,
    HELD,
    leads_back,
    leads_on,
)
from flexura.synthesis.posts import POST as BREADTH
from flexura.synthesis.wish import ROOM, Room

COUNTS = (1, 2, 3, 4)
"""Limbs of a pattern."""

RADII = (0.8, 0.7, 0.6, 0.5, 0.4)
"""Distances from the axis of sites below the platform, over the way to its edge: as drawn first, and those of limbs
that are right at the one distance alone at which they are drawn."""

LUG = 0.06
"""Edge of a lug at the side of the platform, on which limbs begin that lead on beside it, over the smallest edge of the
envelope."""

STIFF = 0.12
"""Edge of a lug of several heads, over the room across the limb."""

BESIDE = 0.25
"""Clearance of limbs that are wide radially from the side of the platform, over the edge of a lug."""

ARM_AT = 0.4
"""Where along a limb its arm is, over the room along it, as to how much room that has."""

NARROWEST = 0.2
"""Least room across a limb that is broad, over the smallest edge of the envelope."""

FLAT = 0.5
"""Of the way that heads may be apart, what has to be on a flat side of the platform for them to begin there."""

SHORTEST = 0.1
"""Least length of a limb, over the smallest edge of the envelope."""

ALONG = 1e-6

SHARES = (0.5, 0.2, 0.85)
"""Where between their limits sizes are drawn first: the first of these at which a pattern fits."""

LEAST_AWAY = 0.025
"""Distance of limbs from each other, over the smallest edge of the envelope."""

SAMPLES = 24
"""Points along a member at which it is held against what is in its way."""


class Site(NamedTuple):
    """Where a limb begins: below the platform, at its side, or on a lug beside it, at an azimuth, rad, and a height, m.
    `reach` is how far from the axis the edge of the platform is there, or the middle of the lug, and below the platform
    it is drawn at so much of that, `out`. The one in the middle below it has a reach of zero."""

    where: Literal["below", "side", "beside"]
    azimuth: float
    height: float
    reach: float
    out: float = 1.0

    def head(self, room: Room) -> Array:
        """Its point (3,)."""
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        r = self.reach * self.out
        return np.array([room.middle[0] + r * c, room.middle[1] + r * s, self.height])

    @property
    def axes(self) -> Array:
        """Radial, tangential and normal directions there, columns (3, 3)."""
        return about_z(self.azimuth)


def sites(room: Room, count: int) -> list[Site]:
    """All sites of the first of so many limbs."""
    h = float(room.platform[2])
    low, z, high = room.middle[2] + np.array([-h, 0.0, h])
    inset, lug = min(LUG * room.size, h) / 2, LUG * room.size / 2
    heights = {round(float(own), 9) for own in (low + inset, z, high - inset, room.about[2])}
    heights = {own for own in heights if low - ALONG * room.size <= own <= high + ALONG * room.size}
    found = [Site("below", 0.0, float(low), 0.0)] if count == 1 else []
    for angle, reach in _edges(room, count):
        found += [Site("below", angle, float(low), reach, out) for out in (*RADII, *_below_point(room, angle, reach))]
        if count == 3 and room.shape == "box":
            continue
        for height in sorted(heights, key=lambda own: abs(own - z)):
            found.append(Site("side", angle, height, reach))
            if room.shape == "cylinder" or min(np.abs(np.sin(angle)), np.abs(np.cos(angle))) < ALONG:
                found.append(Site("beside", angle, height, reach + lug))
    return found


def _below_point(room: Room, angle: float, reach: float) -> Iterator[float]:
    """Where towards an azimuth the point of the wish is above or below the platform, over the way to its edge."""
    away = (room.about - room.middle)[:2]
    out = float(np.hypot(*away)) / reach
    if (
        LUG < out < 1 - LUG
        and np.abs(away - out * reach * np.array([np.cos(angle), np.sin(angle)])).max() < ALONG * reach
    ):
        yield out


def _edges(room: Room, count: int) -> Iterator[tuple[float, float]]:
    """Azimuths of the first of so many limbs, and how far the edge of the platform is there."""
    a, b = (float(own) for own in room.platform[:2])
    box = room.shape == "box"
    if count == 3:
        yield from ((np.pi * k / 6, min(a, b)) for k in range(4))
        return
    square = abs(a - b) < ALONG * room.size
    if count < 4 or square:
        quarters = {1: 4, 2: 2, 4: 1}[count]
        yield from ((np.pi / 2 * k, (a, b)[k % 2]) for k in range(quarters))
    elif box:
        yield 0.0, min(a, b)
    if box and (count == 2 or (count == 4 and square)):
        corner = float(np.arctan2(b, a))
        yield from ((own, float(np.hypot(a, b))) for own in ((corner, np.pi - corner) if count == 2 else (corner,)))
    elif count == 4 and not box:
        yield np.pi / 4, a


@dataclass(frozen=True)
class Pattern:
    """Equal limbs around the axis: their kind, the site of the first, its axes (m, e, d) as columns (3, 3), and how
    many there are.

    `run` is how long a limb can be before it leaves the envelope or meets another, m, and `across` how broad along m;
    `borne` are the wrenches (6, n) of one about its head, along its axes, of sizes that are told apart. Sites below the
    platform may be at any distance from the axis unless they are `pinned`, where limbs are right at the distance alone
    at which they are drawn first. What is pinned of the sizes of the kind is `held` at so much, m.

    `share` is where between their limits sizes are drawn first, and `deep` says that walls of the base stand on
    deeper blocks; posts may be so many times as `stout` as they have to be, and then end so `short` of the
    envelope, m. Two that would cross are `aside`, each so far along its width that they pass each other, which
    changes nothing of what they bear. The side of the platform is `flat` where all heads are at it.
    """

    kind: Kind
    site: Site
    axes: Array
    count: int
    run: float
    across: float
    borne: Array
    pinned: bool = False
    held: float = 0.0
    share: float = SHARES[0]
    aside: bool = False
    deep: bool = True
    stout: float = 0.0
    short: float = 0.0
    flat: bool = False
    mirrored: bool = False

    def turns(self) -> Array:
        """Rotations (n, 3, 3) of the copies about the axis; of a mirrored one the image in the plane across the radial
        direction of its site."""
        return _turns(self.site, self.count, self.mirrored)

    def wrenches(self, room: Room) -> Array:
        """What each copy bears, about the origin of the room (copies, 6, n), moments in m."""
        axis, turns = np.array([*room.middle[:2], 0.0]), self.turns()
        return _about_origin(self.borne, turns @ self.axes, turns @ (self.site.head(room) - axis) + axis)

    @property
    def n_constraints(self) -> int:
        """How many wrenches its limbs bear, each counted by itself, and so those that are side by side in one."""
        return self.count * (self.kind.n_borne if self.kind.is_side_by_side else self.borne.shape[1])

    @property
    def has_lug(self) -> bool:
        """Whether limbs begin on a lug of the platform: those that lead on beside it, and those of several heads for
        which its side is not broad and flat enough."""
        return self.site.where == "beside" or (self.site.where == "side" and len(self.kind.heads) > 1 and not self.flat)

    def lug(self, room: Room) -> float:
        """The edge of its lugs, m: stiff enough where it begins at the side with several heads."""
        several = self.site.where == "side" and any(own[0] for own in self.kind.spread.values())
        return max(LUG * room.size, STIFF * self.across * several)

    def shift(self, lug: float) -> tuple[Array, Terms]:
        """How limbs are drawn beside their site: so far, (3,), m, and by their sizes along (m, e, d). What they bear is
        the same. Those that are wide or thick radially begin clear of the side of the platform, on a lug of some edge,
        m; lugs of those with several heads are between them and the platform."""
        radial = self.site.axes[:, 0]
        if self.aside:
            return self.axes[:, 1] * lug / 3, {"width": (0.0, 0.5, 0.0)}
        if self.site.where == "side" and self.has_lug:
            return radial * lug, {}
        for k, is_large in enumerate((self.kind.has_thick_beginning, self.kind.width)):
            along = float(radial @ self.axes[:, k])
            if self.site.where == "beside" and is_large and abs(along) > 1 - ALONG:
                out = np.eye(3)[k] * np.sign(along) / 2
                half = {size: tuple((out * c).tolist()) for size, c in self.kind.face.items() if c[k]}
                return radial * lug * (BESIDE - 0.5), half
        return np.zeros(3), {}

    @property
    def is_asymmetric(self) -> bool:
        """Whether it is one limb that is not in the middle."""
        return self.count == 1 and self.site.reach > 0


def about_z(angle: float) -> Array:
    """The rotation (3, 3) about the normal of the base."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _cross(a: Array, b: Array) -> Array:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _turns(site: Site, count: int, mirrored: bool) -> Array:
    if mirrored:
        radial = site.axes[:, 0]
        return np.array([np.eye(3), np.eye(3) - 2 * np.outer(radial, radial)])
    return np.array([about_z(2 * np.pi * k / count) for k in range(count)])


def _about_origin(borne: Array, frames: Array, places: Array) -> Array:
    """Wrenches (copies, 6, n) about the origin, of some (6, n) in frames (copies, 3, 3) about places (copies, 3);
    moments turn round in frames that are mirrored."""
    force, moment = frames @ borne[:3], np.linalg.det(frames)[:, None, None] * (frames @ borne[3:])
    x, y, z = places.T
    zero = np.zeros(len(x))
    arm = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    return np.concatenate([force, moment + arm @ force], axis=1)


_PLAIN = np.array([c for c in product((-1.0, 0.0, 1.0), repeat=3) if 0 < np.abs(c).sum() < 3 and not (c[0] and c[1])])
"""Directions of the grammar at every site (n, 3), radial, tangential and along the normal."""


def _directions(site: Site, borne: Array) -> list[Array]:
    """Directions of the grammar at a site, of which lines are borne there (3, k) at all: unit vectors (3,). From
    below the platform they lead down, in the middle straight; from its side outward, and from a lug beside it."""
    if not site.reach:
        return [-site.axes[:, 2]]
    found = [site.axes @ c for c in _PLAIN]
    if borne.shape[1] == 1:
        found += [borne[:, 0], -borne[:, 0]]
    if borne.shape[1] == 2:
        normal = _cross(borne[:, 0], borne[:, 1])
        lines = [_cross(normal, own) for own in site.axes.T]
        found += [s * line for line in lines if np.linalg.norm(line) > ALONG for s in (1.0, -1.0)]
    units = [own / np.linalg.norm(own) for own in found]
    radial = site.axes[:, 0]
    if site.where == "below":
        units = [d for d in units if d[2] < -ALONG]
    else:
        units = [d for d in units if (d @ radial > ALONG if site.where == "side" else abs(d @ radial) < ALONG)]
    return list({tuple(np.round(d, 6) + 0.0): d for d in units}.values())


def _is_plain(site: Site, d: Array) -> bool:
    """Whether a direction of the grammar is one wherever the site is."""
    return len(np.unique(np.round(np.abs(site.axes.T @ d), 6))) == 2


def _widths(site: Site, d: Array) -> list[Array]:
    """Directions across d along which a limb may be wide."""
    across = [own for own in site.axes.T if abs(own @ d) < ALONG]
    slanting = [_cross(d, own) for own in site.axes.T if ALONG < abs(own @ d) < 1 - ALONG]
    chosen: list[Array] = []
    for own in (*across, *slanting):
        e = own / np.linalg.norm(own)
        if not any(abs(e @ other) > 1 - ALONG for other in chosen):
            chosen.append(e)
    return chosen


def patterns(room: Room, process: str) -> list[Pattern]:
    """All patterns of the grammar of which no limb works against a wished freedom."""
    kinds = [kind for kind in KINDS.values() if process in kind.processes]
    borne = {kind.name: _borne(kind, room) for kind in kinds}
    fixed, moved = [kind for kind in kinds if not kind.pinned], [kind for kind in kinds if kind.pinned]
    every = np.concatenate([borne[kind.name] for kind in fixed], axis=1)
    first = np.cumsum([0, *(borne[kind.name].shape[1] for kind in fixed)])[:-1]
    breadth = 0.0 if room.frame else BREADTH
    beside = {kind.name: 2 * (GAP + breadth) * room.size * leads_back(kind) for kind in kinds}
    found = []
    every_site = [(n, site, False) for n in COUNTS for site in sites(room, n)]
    for count, site, mirrored in every_site + [(2, site, True) for site in sites(room, 2)]:
        another = site._replace(out=RADII[1] if site.out == RADII[0] else RADII[0])
        turns = _turns(site, count, mirrored)
        F, further = (_freedoms(room, own.head(room), turns) for own in (site, another))
        for d in _directions(site, room.wrenches.directions_at(site.head(room))):
            if (whole := _run(room, site, d, turns)) < SHORTEST * room.size:
                continue
            apart = min(whole, _meeting(room, site, d) - 2 * LEAST_AWAY * room.size) if count > 1 else whole
            upright, is_held = abs(d[2]) > 1 - ALONG, room.frame or abs(d[2]) > ALONG
            behind = 0.0 if upright else ((HELD if is_held else BEHIND) - ROOM) * room.size
            passing = apart < whole and count == 2 and site.where == "below" and process != "wire-cut"
            here = []
            for (k, e), sign in product(enumerate(_widths(site, d)), (1.0, -1.0)):
                axes = np.array([_cross(sign * e, d), sign * e, d]).T
                own, other = _along(axes, F), _along(axes, further)
                work = np.abs(own.T @ every).max(axis=0, initial=0.0)
                is_right = np.maximum.reduceat(work, first) < ALONG
                right = [(kind, borne[kind.name], 0.0) for kind in compress(fixed, is_right)]
                right += [found for kind in moved for found in _pinned(kind, borne[kind.name], own, apart)]
                for kind, W, held in right:
                    if mirrored and _is_its_image(kind, site, axes):
                        continue
                    if (kind.is_round and k) or (sign < 0 and (kind.is_round or not kind.is_one_sided)):
                        continue
                    sideways = site.where == "side" and abs(site.axes[:, 1] @ axes[:, 0]) > 1 - ALONG
                    if kind.is_side_by_side and not sideways:  # they are a pattern of two, or of two rows
                        continue
                    aside = passing and kind.width and "thickness" in kind.sizes and not kind.pinned
                    run = (whole if aside else apart) - behind * leads_on(kind)
                    across = _across(room, site, ARM_AT * run * d, axes[:, 0], turns, kind)
                    is_along = abs(axes[2, 1]) > 1 - ALONG  # posts of its feet stand along its width
                    across -= min(beside[kind.name], BREADTH * room.size) if is_along else beside[kind.name]
                    if run < SHORTEST * room.size or (kind.is_broad and across < NARROWEST * room.size):
                        continue
                    pinned = site.where == "below" and np.abs(other.T @ W).max(initial=0.0) > ALONG
                    if not pinned and site.out < RADII[0] and not (site.out in RADII and _is_plain(site, d)):
                        continue
                    bears = W[:, : W.shape[1] // 2]
                    plain = Pattern(kind, site, axes, count, run, across, bears, bool(pinned), held)
                    placed = _at_side(replace(plain, aside=aside, mirrored=mirrored), room)
                    if placed.run >= SHORTEST * room.size:
                        here.append(placed)
            found += sorted(here, key=lambda own: kinds.index(own.kind))
    return found


def _at_side(own: Pattern, room: Room) -> Pattern:
    """A pattern that begins right at the side of the platform where all heads are at that, or else behind its lug."""
    if own.site.where != "side" or len(own.kind.heads) == 1:
        return own
    face = face_of(own, room)
    if face is not None and (np.abs(own.axes @ np.diag(_most_spread(own, room))).max(axis=1) * FLAT <= face).all():
        return replace(own, flat=True)
    return replace(own, run=own.run - own.lug(room))


def _most_spread(own: Pattern, room: Room) -> Array:
    """How far heads are apart along (m, e, d) at most, (3,), m."""
    scales = {"room": own.run, "across": own.across, "size": room.size}
    sizes = {name: limit.most * scales.get(limit.of, 0.0) for name, limit in own.kind.sizes.items()}
    return place(own.kind.spread, sizes)


def face_of(own: Pattern, room: Room) -> Array | None:
    """Edges (3,) of the flat side that a limb begins at, m, about its middle; none where that is not flat."""
    if room.shape != "box":
        return None
    face = 2 * (room.platform - np.abs(own.site.height - room.middle) * [0.0, 0.0, 1.0])
    face[np.abs(own.site.axes[:, 0]) > ALONG] = 0.0
    return face + ALONG * room.size


def _borne(kind: Kind, room: Room) -> Array:
    """What a kind bears (6, 2n) in two sizes, between which nothing may differ that does work on a freedom: about its
    head, or about its centre where a size is pinned."""
    found = []
    for scale in (1.0, 0.7):
        sizes = unit_sizes(kind, scale * room.freedoms.length)
        found.append(_about(kind.bears(sizes), -place(kind.centre, sizes)))
    return np.concatenate(found, axis=1)


def _about(W: Array, point: Array) -> Array:
    """Wrenches (6, n) about a point, (3,), of those about the origin, if both points change places."""
    return np.concatenate([W[:3], W[3:] + np.cross(point, W[:3], axisb=0, axisc=0)])


def _is_its_image(kind: Kind, site: Site, axes: Array) -> bool:
    """Whether a limb is the same in a mirror along the radial plane of its site: two of them that are turned by half a
    turn are then mirrored as well."""
    m, e, d = np.abs(site.axes[:, 1] @ axes)
    is_across = min(e, 1 - e) > ALONG and kind.width
    return d < ALONG and not is_across and not (kind.is_one_sided and m > ALONG)


def _freedoms(room: Room, head: Array, turns: Array) -> Array:
    """The wished freedoms (2, 3, f), velocities and rotations, of the heads of limbs, in axes that turn with them
    (copies, 3, 3)."""
    F = room.freedoms.basis / np.repeat([1.0, room.freedoms.length], 3)[:, None]
    axis = np.array([*room.middle[:2], 0.0])
    places = turns @ (head - axis) + axis
    moved = F[:3] + np.cross(F[None, 3:], places[:, :, None], axis=1)
    both = np.stack([moved, np.linalg.det(turns)[:, None, None] * np.broadcast_to(F[3:], moved.shape)])
    return np.concatenate(list((turns.transpose(0, 2, 1) @ both).swapaxes(0, 1)), axis=-1)


def _along(axes: Array, F: Array) -> Array:
    """Velocities and rotations (2, 3, f) along axes (3, 3), as twists (6, f)."""
    return (axes.T @ F).reshape(6, -1)


def _pinned(kind: Kind, W: Array, F: Array, run: float) -> Iterator[tuple[Kind, Array, float]]:
    """A kind that bears W (6, n) about its centre, with what it bears about its head, and the size that has its centre
    on the axes of freedoms (6, f), twists of the head, if there is one: work is linear in how far away the centre is.
    """
    slope = np.stack([F[4], -F[3], np.zeros(F.shape[1])], axis=1) @ W[:3]
    work = F.T @ W
    if (size := float((slope**2).sum())) < ALONG**2:
        return
    away = -float((slope * work).sum()) / size
    held, limit = away / kind.centre[kind.pinned][2], kind.sizes[kind.pinned]
    if limit.least * run <= held <= limit.most * run and np.abs(work + away * slope).max() < ALONG:
        yield kind, _about(W, np.array([0.0, 0.0, away])), held


def _meeting(room: Room, site: Site, d: Array) -> float:
    """How far from its head a limb along d meets the axis, and so its copies, m."""
    head = site.head(room)[:2] - room.middle[:2]
    speed = float(d[:2] @ d[:2])
    if speed < ALONG or abs(head[0] * d[1] - head[1] * d[0]) > ALONG * float(np.hypot(*head)):
        return np.inf
    way = -float(head @ d[:2]) / speed
    return way if way > 0 else np.inf


def _run(room: Room, site: Site, d: Array, turns: Array) -> float:
    """How long limbs may be along d before the first of them is at the base, where that is straight ahead, or else
    leaves the envelope, m."""
    axis = np.array([*room.middle[:2], 0.0])
    clear = clear_along(room, turns @ (site.head(room) - axis) + axis, turns @ d)
    return clear + ROOM * room.size * (d[2] < ALONG - 1)


def _across(room: Room, site: Site, along: Array, m: Array, turns: Array, kind: Kind) -> float:
    """How broad limbs may be along m before one of them leaves the envelope or is nearer to another, m: about their
    head, or to one side of a point so far along (3,) from that, where the platform may be as well."""
    axis = np.array([*room.middle[:2], 0.0])
    point = site.head(room) + along * kind.is_one_sided
    ways = [clear_along(room, turns @ (point - axis) + axis, turns @ own) for own in (m, -m)]
    for side in (1, -1) if len(turns) > 1 else ():
        angle = side * np.pi / len(turns)  # the plane halfway to the next copy, and how far it is
        normal = side * site.axes @ [-np.sin(angle), np.cos(angle), 0.0]
        left, speed = -float((point - axis) @ normal), float(m @ normal)
        if left > 0 and abs(speed) > ALONG:
            ways[speed < 0] = min(ways[speed < 0], left / abs(speed))
    if not kind.is_one_sided:
        return 2 * min(ways)
    arms = ways[0] * (np.arange(SAMPLES) + 0.5) / SAMPLES
    inside = room.in_platform(point + arms[:, None] * m, -0.02 * room.size)
    return float(arms[inside.argmax()]) if inside.any() else ways[0]


def clear_along(room: Room, points: Array, directions: Array) -> float:
    """How far the first of some points (n, 3) along its direction (n, 3) is from a face of the envelope, m."""
    p = points - [0.0, 0.0, room.half[2]]
    with np.errstate(divide="ignore", invalid="ignore"):
        way = np.where(np.abs(directions) > ALONG, (np.sign(directions) * room.half - p) / directions, np.inf)
    return float(way.min()) - ROOM * room.size
