"""How large limbs of a pattern are drawn, where their members, posts and lugs are then, and whether all of it fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from flexura.arrays import Array
from flexura.synthesis.limbs import BAR, POST, STOUT, WIDE, Kind, Sizes, Terms, place
from flexura.synthesis.patterns import ALONG, BESIDE, LEAST_AWAY, LUG, SAMPLES, SHARES, Pattern, clear_along, face_of
from flexura.synthesis.posts import BEHIND, BELOW, GAP, MARGIN, SECTIONS, Ground, Post, posts_of, value_of
from flexura.synthesis.wish import ROOM, Room

SPACING = 0.05
"""Distance of points of posts, over the same."""

MOST_OF_POST = 0.95
"""Radius of a notch over the length of the post on it, at most."""

WIDEST = 1.5
"""Room along a limb over the greatest width of its flexures."""


def limits_of(pattern: Pattern, room: Room, thinnest: float) -> dict[str, tuple[float, float]]:
    """Least and most of each size of a limb, m."""
    scales = {"thinnest": thinnest, "room": pattern.run, "size": room.size, "across": pattern.across}
    scales["width"] = _width_room(pattern, room)
    found = {}
    for name, limit in pattern.kind.sizes.items():
        low, high = limit.least * scales[limit.of], limit.most * scales[limit.of]
        high = min(high, max(1.5 * low, limit.share * pattern.run))
        if name == "radius" and pattern.kind.pinned == "post":
            high = min(high, MOST_OF_POST * pattern.held)
        if pattern.flat and name in pattern.kind.spread:  # no wider than the side of the platform
            along = np.abs(pattern.axes @ np.array(pattern.kind.spread[name]))
            face = face_of(pattern, room)
            high = (
                min(high, *(f / a for f, a in zip(face, along, strict=True) if a > ALONG)) if face is not None else high
            )
        found[name] = (pattern.held, pattern.held) if name == pattern.kind.pinned else (low, high)
    return found


def drawn_first(pattern: Pattern, room: Room, thinnest: float) -> Sizes:
    """Sizes, m, as they are drawn first."""
    limits = limits_of(pattern, room, thinnest)
    return {name: low + pattern.share * (high - low) for name, (low, high) in limits.items()}


def _width_room(pattern: Pattern, room: Room) -> float:
    """How wide a limb may be where it begins, m."""
    e, site = np.abs(pattern.site.axes.T @ pattern.axes[:, 1]), pattern.site
    edge = float(room.platform[:2].min())
    if site.where == "below":
        free = not site.reach or (pattern.count <= 2 and e[1] > 1 - ALONG)
        wide = _extent(room, pattern.axes[:, 1]) if free else edge
    elif e[2] > ALONG:
        wide = 2 * float(room.platform[2] - abs(site.height - room.middle[2]))
    else:
        wide = edge
    if site.where == "beside" and e[0] > 1 - ALONG:
        axis, turns, lug = np.array([*room.middle[:2], 0.0]), pattern.turns(), LUG * room.size
        clear = clear_along(room, turns @ (site.head(room) - axis) + axis, turns @ site.axes[:, 0])
        clear += ROOM * room.size + (0.5 - BESIDE) * lug - max(BESIDE * lug, MARGIN * room.size)
        wide = min(wide, max(clear, 0.0))
    if pattern.aside:
        wide = wide / 2 - LUG * room.size / 3
    return min(wide, pattern.run / WIDEST)


def _extent(room: Room, e: Array) -> float:
    """How wide the platform is along e about its middle, m."""
    if room.shape == "cylinder":
        return 2 * float(room.platform[0])
    with np.errstate(divide="ignore"):
        return 2 * float((room.platform[:2] / np.where(np.abs(e[:2]) > ALONG, np.abs(e[:2]), 0.0)).min())


def _copies(pattern: Pattern, room: Room, sizes: Sizes, points: Array) -> Array:
    """Points (n, 3) of a limb, along its axes from its head, in all copies (copies, n, 3), m."""
    axis = np.array([*room.middle[:2], 0.0])
    fixed, drawn = pattern.shift(pattern.lug(room))
    start = pattern.site.head(room) + fixed - axis
    return (start + (place(drawn, sizes) + points) @ pattern.axes.T) @ pattern.turns().transpose(0, 2, 1) + axis


def lug_of(pattern: Pattern, room: Room) -> tuple[Terms, Array]:
    """Edges of a lug by its sizes, and what is added to them, m, (3,): with room for all heads, along the normal of
    the base as wide as these."""
    edge, kind = pattern.lug(room), pattern.kind
    flush = kind.width and abs(pattern.axes[2, 1]) > 1 - ALONG
    return kind.face, edge * np.array(
        [2 * BESIDE if kind.has_thick_beginning else 1.0, 0.0 if flush else 2 * BESIDE if kind.width else 1.0, 1.0]
    )


def too_near(pattern: Pattern, room: Room, sizes: Sizes) -> list[float]:
    """By how much what moves would come too near, over the stroke, to what stands beside it, m, linear in the sizes."""
    m, kind = pattern.axes[:, 0], pattern.kind
    return [float(np.abs(m) @ room.clear) + GAP * room.size - float(place(kind.apart, sizes)[0])] if kind.apart else []


def corners_of(pattern: Pattern, posts: Sequence[Post], room: Room, sizes: Sizes) -> Array:
    """Corners (n, 3) of members, blocks, lugs and some posts of all copies, m: linear in the sizes, and in how far out
    the site is."""
    kind = pattern.kind
    nodes = kind.points(sizes)
    found = []
    for a, b, profile in kind.members.values():
        d = (nodes[b] - nodes[a]) / np.linalg.norm(nodes[b] - nodes[a])
        thick, wide = (value_of(form, sizes) for form in SECTIONS[profile])
        across = np.array([s * thick * np.array([d[2], 0.0, -d[0]]) + [0.0, r * wide, 0.0] for s, r in _SIGNS])
        found += [nodes[a] + across, nodes[b] + across]
    found += [_between(place(low, sizes), place(high, sizes)) for low, high in kind.blocks.values()]
    if pattern.has_lug:
        longer, edges = lug_of(pattern, room)
        half = (edges + place(longer, sizes)) / 2
        found.append(_between(-half, half) - [0.0, 0.0, half[2]])
    found += [_between(*post.ends(sizes)) @ post.axes.T for post in posts]
    return _copies(pattern, room, sizes, np.concatenate(found)).reshape(-1, 3)


_SIGNS = tuple(product((-1.0, 1.0), repeat=2))


def _between(low: Array, high: Array) -> Array:
    """Corners (8, 3) of a box."""
    return np.array(list(product(*zip(low, high, strict=True))))


class Drawn(NamedTuple):
    """A pattern as drawn first: points (copies, n, 3) along the middle and both edges of members, the same and those of
    blocks, of posts, and of all of it and of lugs."""

    members: Array
    moving: Array
    posts: Array
    all: Array


_GRID, _FINE = (np.array(list(product(np.linspace(0.0, 1.0, n), repeat=3))) for n in (3, 5))


def _points(kind: Kind, sizes: Sizes) -> tuple[Array, Array]:
    """Points (n, 3) of the members of a limb, and of its blocks, along its axes from its head, m."""
    nodes = kind.points(sizes)
    at = (np.arange(SAMPLES)[:, None] + 0.5) / SAMPLES
    members = [
        nodes[a] + at * (nodes[b] - nodes[a]) + aside
        for a, b, profile in kind.members.values()
        for aside in _edges_of(profile, nodes[b] - nodes[a], sizes)
    ]
    corners = [(place(low, sizes), place(high, sizes)) for low, high in kind.blocks.values()]
    blocks = [low + _FINE * (high - low) for low, high in corners]
    return np.concatenate(members), np.concatenate([np.empty((0, 3)), *blocks])


def as_drawn(pattern: Pattern, room: Room, thinnest: float) -> Drawn:
    """A pattern as it is drawn first."""
    sizes, kind = drawn_first(pattern, room, thinnest), pattern.kind
    members, blocks = _points(kind, sizes)
    moving = np.concatenate([members, blocks])
    every = moving
    if pattern.has_lug:
        longer, edges = lug_of(pattern, room)
        half = (edges + place(longer, sizes)) / 2
        every = np.concatenate([moving, (2 * _GRID - 1) * half - [0.0, 0.0, half[2]]])
    standing = _standing(posts_at(pattern, room, np.eye(3), []), sizes, room)
    own, n = _copies(pattern, room, sizes, np.concatenate([standing, every])), len(standing)
    return Drawn(own[:, n : n + len(members)], own[:, n : n + len(moving)], own[:, :n], own)


def _standing(posts: Sequence[Post], sizes: Sizes, room: Room) -> Array:
    """Points (n, 3) of posts."""
    return np.concatenate([np.empty((0, 3)), *(own.points(sizes, SPACING * room.size) for own in posts)])


def _beside(pattern: Pattern, room: Room) -> float:
    """How much room there is at the edges of a limb within the envelope, as wide as it may be, m."""
    axis, turns, e = np.array([*room.middle[:2], 0.0]), pattern.turns(), pattern.axes[:, 1]
    points = turns @ (pattern.site.head(room) - axis) + axis
    way = min(clear_along(room, points, turns @ own) for own in (e, -e)) + ROOM * room.size
    return max(way - _width_room(pattern, room) / 2, 0.0)


def posts_at(pattern: Pattern, room: Room, axes: Array, head: Sequence[tuple[str | None, Array]]) -> list[Post]:
    """Posts of the first limb of a pattern, whose axes are columns (3, 3) of some frame and whose head is at a point of
    that, or at its origin."""
    fixed, _ = pattern.shift(pattern.lug(room))
    level = -float((pattern.site.head(room) + fixed)[2]) if not head else 0.0
    shelf = level + float(room.middle[2] - room.platform[2]) - float(room.clear[2]) - GAP * room.size
    end = pattern.run + BEHIND * room.size - pattern.short
    top = level + 2 * float(room.half[2])
    beside = min(MARGIN * max(pattern.stout, 1.0) * room.size, _beside(pattern, room))
    deep, frame, stout = pattern.deep, room.frame, pattern.stout
    ground = Ground(axes @ pattern.axes[2], level, top, shelf, room.size, deep, frame, stout, end, beside)
    return posts_of(pattern.kind, head, axes, ground)


def _edges_of(profile: str, way: Array, sizes: Sizes) -> Array:
    """How far the middle and the edges of a member are from the line between its nodes, m, (k, 3)."""
    e = np.array([0.0, 0.4 * sizes["width"] if profile in WIDE else 0.0, 0.0])
    m = np.zeros(3)
    if profile in (BAR, POST):
        thick = STOUT * sizes["radius"] + sizes["web"]
        m = np.array([way[2], 0.0, -way[0]]) * thick / (2 * np.linalg.norm(way))
    return np.array([0 * e, e, -e, m, -m])[: 5 if m.any() else 3 if e.any() else 1]


def obstacles(pattern: Pattern, room: Room, thinnest: float) -> Array:
    """Points (n, 3), m, of limbs as drawn first, and from their feet down to the base, where posts may stand."""
    nodes = pattern.kind.points(sizes := drawn_first(pattern, room, thinnest))
    feet = _copies(pattern, room, sizes, np.array([nodes[foot] for foot in pattern.kind.feet])).reshape(-1, 3)
    posts = np.repeat(feet[:, None], SAMPLES, axis=1)
    posts[:, :, 2] *= np.linspace(0.0, 1.0, SAMPLES)
    return np.concatenate([as_drawn(pattern, room, thinnest).all.reshape(-1, 3), posts.reshape(-1, 3)])


def fitted(pattern: Pattern, room: Room, thinnest: float) -> Pattern | None:
    """The pattern with the first sizes at which all copies are within the envelope, outside of the platform, begin at
    it and are clear of each other; None where there are none."""
    if (
        pattern.site.where == "beside"
        and len(pattern.kind.heads) > 1
        and abs(pattern.site.axes[:, 0] @ pattern.axes[:, 0]) > ALONG
    ):
        return None
    walls = {deep: posts_at(replace(pattern, deep=deep), room, np.eye(3), []) for deep in (True, False)}
    if not walls[True] or any(low > high for low, high in limits_of(pattern, room, thinnest).values()):
        return None
    if not any(post.name.endswith(BELOW) for post in walls[True]):
        del walls[False]
    each = (replace(pattern, share=share, deep=deep) for share, deep in product(SHARES, walls))
    return next((own for own in each if _fits(own, walls[own.deep], room, thinnest)), None)


def stouter(pattern: Pattern, stout: float, room: Room, thinnest: float) -> Pattern | None:
    """A pattern that fits with posts so many times as stout as they have to be; None where that does not fit."""
    own = replace(pattern, stout=stout)
    beyond = float(room.outside(as_drawn(own, room, thinnest).posts.reshape(-1, 3)).max())
    if beyond > 0:  # by corners of those that slant
        own = replace(own, short=min(2 * beyond, BEHIND * room.size))
    plain, posts = (posts_at(each, room, np.eye(3), []) for each in (pattern, own))
    if not _fits(own, posts, room, thinnest):
        return None
    sizes = drawn_first(own, room, thinnest)
    moving = np.concatenate(_points(own.kind, sizes))
    for before, post in zip(plain, posts, strict=True):
        away = post.away(moving, sizes)
        if (away < np.minimum(before.away(moving, sizes) - ALONG * room.size, GAP * room.size)).any():
            return None
    return own


def _fits(own: Pattern, posts: Sequence[Post], room: Room, thinnest: float) -> bool:
    """Whether all copies, as drawn, are within the envelope, outside of the platform, begin at it and are clear of each
    other; where corners and posts are is looked at first, as that is what most fail in."""
    sizes = drawn_first(own, room, thinnest)
    if (room.outside(corners_of(own, posts, room, sizes)) > ALONG * room.size).any():
        return False
    if max(too_near(own, room, sizes), default=0.0) > 0:
        return False
    if room.in_platform(_copies(own, room, sizes, _standing(posts, sizes, room)).reshape(-1, 3), -room.clear).any():
        return False
    if not _begins(own, room, sizes) or _links_meet(own, room, sizes):
        return False
    drawn = as_drawn(own, room, thinnest)
    if room.in_platform(drawn.moving.reshape(-1, 3), 0.02 * room.size).any():
        return False
    others = drawn.all[1 : 1 + own.count // 2].reshape(-1, 3)
    return not len(others) or not nearer(KDTree(others), drawn.all[0], LEAST_AWAY * room.size)


def nearer(tree: KDTree, points: Array, far: float) -> bool:
    """Whether any of some points (n, 3) is nearer than so far, m, to those of a tree."""
    return bool(np.isfinite(tree.query(points, 1, 0.0, 2, far)[0]).any())


def _begins(pattern: Pattern, room: Room, sizes: Sizes) -> bool:
    """Whether all heads of all copies are at the platform, or on a lug."""
    if pattern.has_lug:
        return True
    nodes = pattern.kind.points(sizes)
    heads = _copies(pattern, room, sizes, np.array([nodes[head] for head in pattern.kind.heads]))
    return bool(room.in_platform(heads.reshape(-1, 3), -1e-3 * room.size).all())


def _links_meet(pattern: Pattern, room: Room, sizes: Sizes) -> bool:
    """Whether corners of links that do not begin at the platform are in it."""
    kind = pattern.kind
    if not any(own.profile == BAR for own in kind.members.values()):
        return False
    nodes = kind.points(sizes)
    ends = [
        nodes[node] + _edges_of(profile, nodes[b] - nodes[a], sizes)
        for a, b, profile in kind.members.values()
        for node in (a, b)
        if profile == BAR and a not in kind.heads
    ]
    if not ends:
        return False
    corners = _copies(pattern, room, sizes, np.concatenate(ends))
    return bool(room.in_platform(corners.reshape(-1, 3), 1e-3 * room.size).any())
