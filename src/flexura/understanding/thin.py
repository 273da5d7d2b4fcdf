"""Thin places of a planar part: where they are, what they are, and what they join."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import OptionError, need
from flexura.outlines import Outline
from flexura.understanding.sections import Axis, Boundary, Walk

Kind = Literal["leaf", "tapered", "circular", "elliptical", "corner_filleted", "table"]

MOST_SEGMENTS = 5000
"""Segments of a drawing in which flexures are looked for."""

SAMPLES = 300
"""Places along the longer side of the part at which its thickness is looked at."""

FACING = -0.94
"""Cosine between outward normals of faces that are opposite each other, at most."""

OPENS = 1.5
"""How much thicker a part is behind a flexure than in it, at least."""

SLENDER = 3.0
"""Length of a flexure over its least thickness, at least."""

SHARE = 2e-3
"""Bending flexibility, the integral of 1 / h^3, over that of the most flexible one, below which a thin place is left to
the block that it is in."""

TAPERS = 1e-3
"""How much the slope of the thickness of a leaf changes that tapers evenly."""

ALIKE = 0.01
"""Relative deviation of faces from a contour that they are taken for; of the radii of two arcs."""

STRAIGHT_SHARE, LARGE_FILLET, SHORT = 0.6, 2.0, 20.0
"""Share of a leaf with fillets that is straight, at least, the radius of these over its thickness, at most, and its
length over this, at least; else it is a notch. Hinges of 8 thicknesses came within 1.9 % of a solid as notches, and
were 8.7 % off as leaves; leaves of 40 came within 1.5 %, and were 21 % off as notches, in twist."""

STRAIGHT = 1e-6
"""Angle, rad, between the axis of a flexure and one of the drawing up to which they are parallel."""

TURNS = 4
"""How often an axis is moved to the thinnest section nearby and turned along its faces."""

NEARBY = 0.25
"""How far on both sides the middle of the faces gives the direction of an axis, over the thickness."""

NEXT = 0.02
"""Relative change of thickness a thousandth of it further on that is a wall."""

NEAREST = 0.7
"""Thickness over that of a sample, below which what is next to it is something else."""

SLIVER = 1e-5
"""Area of what is left between flexures and arms, over that of the part, that is no block."""

STATIONS = 61
"""Places along a contour that is a table."""


@dataclass(frozen=True)
class Flexure:
    """A thin place: `centre` (2,), m, at its thinnest section, `along` (2,) its direction, both as tuples.

    `start`, `end`, m, are its ends along from the centre, `web` its least thickness, `thick` that at both ends,
    `radius` that of a circular notch or of the fillets at both ends. `shift`, m, is how far its axis lies off the
    middle of the faces at most. `stub` is how far the part goes on unchanged behind each end, `aside` how far the
    middle of that lies across from the axis.
    """

    kind: Kind
    centre: tuple[float, float]
    along: tuple[float, float]
    start: float
    end: float
    web: float
    thick: tuple[float, float]
    radius: tuple[float, float]
    stub: tuple[float, float]
    shift: float
    aside: tuple[float, float] = (0.0, 0.0)
    table: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())

    @property
    def length(self) -> float:
        """Its length, m."""
        return self.end - self.start

    def at(self, x: float, y: float = 0.0) -> Array:
        """A point (2,), m, along from the centre and across."""
        c, u = np.array(self.centre), np.array(self.along)
        return c + x * u + y * np.array([-u[1], u[0]])


def thin_places(outline: Outline) -> list[Flexure]:
    """The thin places of an outline that may be flexures, the most flexible ones first. Raises OptionError for outlines
    of very many segments."""
    if len(outline.segments) > MOST_SEGMENTS:
        rule = f"at most {MOST_SEGMENTS} lines and arcs are looked through for flexures"
        raise OptionError(f"{rule}, the drawing has {len(outline.segments)}: draw arcs as arcs, not as short lines")
    boundary = Boundary(outline.segments)
    number, share = _samples(outline)
    points, inward = _at(boundary, number, share)
    distance, opposite = boundary.distance(points, inward)
    reach = np.where(np.isfinite(distance), distance, 0.0)
    hit = points + reach[:, None] * inward
    normals = _inward(boundary, opposite, hit)
    faces = (np.einsum("ni,ni->n", inward, normals) < FACING) & np.isfinite(distance)
    results: list[tuple[float, Flexure]] = []
    done = ~faces
    middle = points + reach[:, None] * inward / 2
    for k in np.argsort(distance):
        if done[k] or distance[k] > outline.size / 4:
            continue
        axis = _thinnest(boundary, number, share, int(k))
        walks = axis.walk(-1), axis.walk(1)
        low, high = -walks[0].on, walks[1].on
        local = (middle - axis.origin) @ np.stack([axis.along, axis.across], axis=1)
        near = 1e-6 * outline.size
        wide = max(walk.thick for walk in walks)
        done |= (local[:, 0] >= low - near) & (local[:, 0] <= high + near) & (np.abs(local[:, 1]) < wide)
        done[k] = True
        flexure = _classified(axis, *walks)
        if flexure is not None:
            x = np.linspace(flexure.start, flexure.end, 2001)[1:-1]
            results.append((float(np.mean(axis.thickness(x) ** -3.0)) * flexure.length, flexure))
    most = max((c for c, _ in results), default=0.0)
    kept = sorted((own for own in results if own[0] >= SHARE * most), key=lambda own: -own[0])
    return [flexure for _, flexure in kept]


def _samples(outline: Outline) -> tuple[Index, Array]:
    """Segments (n,) and shares of their length (n,) at which thickness is looked at."""
    spacing = outline.size / SAMPLES
    counts = [max(5 if own.is_line else 9, math.ceil(own.length / spacing)) for own in outline.segments]
    shares = [(np.arange(count) + 0.5) / count for count in counts]
    return np.repeat(np.arange(len(counts)), counts), np.concatenate(shares)


def _at(boundary: Boundary, number: Index, share: Array) -> tuple[Array, Array]:
    """Points and inward normals (n, 2)."""
    points = np.array([boundary.segments[k].at(s) for k, s in zip(number, share, strict=True)])
    along = np.array([boundary.segments[k].direction(float(s)) for k, s in zip(number, share, strict=True)])
    return points, np.stack([-along[:, 1], along[:, 0]], axis=1)


def _inward(boundary: Boundary, number: Index, points: Array) -> Array:
    """Inward normals (n, 2) of segments at points on them."""
    chord = boundary.end[number] - boundary.start[number]
    line = np.stack([-chord[:, 1], chord[:, 0]], axis=1)
    arc = (boundary.centre[number] - points) * np.sign(boundary.bulge[number])[:, None]
    normals = np.where(boundary.is_line[number][:, None], line, arc)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _thinnest(boundary: Boundary, number: Index, share: Array, k: int) -> Axis:
    """The axis through the thinnest place near a sample."""
    points, inward = _at(boundary, number[k : k + 1], share[k : k + 1])
    least = boundary.distance(points, inward)[0]
    axis = Axis(boundary, (points + least[:, None] * inward / 2)[0], np.array([inward[0, 1], -inward[0, 0]]))
    for _ in range(TURNS):
        axis = _centred(axis)
    before, after = axis.walk(-1).flat, axis.walk(1).flat
    return Axis(boundary, axis.at((after - before) / 2), axis.along)


def _centred(axis: Axis) -> Axis:
    """The axis moved to where it is thinnest nearby, midway between both faces and along them."""
    from scipy.optimize import minimize_scalar  # slow to import

    def thickness(x: float) -> float:
        return float(np.nan_to_num(axis.thickness(np.array([x]))[0], posinf=1e9))

    here = thickness(0.0)
    options: Any = {"xatol": 1e-9 * here}
    better: Any = minimize_scalar(thickness, bounds=(-here, here), method="bounded", options=options)
    x = float(better.x) if NEAREST * here < float(better.fun) < here else 0.0
    around = [thickness(x + step) for step in (-1e-3 * here, 1e-3 * here)]
    if max(around) > (1 + NEXT) * here:  # at a wall: what tapers is thinnest there
        x = 0.0
    low, high, down, up = axis.faces(np.array([x]))
    if not np.isfinite(low + high).all():
        return axis
    faces = np.stack([axis.at(x, float(y[0])) for y in (low, high)])
    normals = _inward(axis.boundary, np.concatenate([down, up]), faces)
    along = np.array([1.0, -1.0]) @ np.stack([normals[:, 1], -normals[:, 0]], axis=1)
    around = np.array([x - NEARBY * here, x + NEARBY * here])
    bottom, top, _, _ = axis.faces(around)
    if (np.abs(top - bottom - here) < here / 2).all():  # short lines that stand for a curve have normals of their own
        ends = [axis.at(at, y) for at, y in zip(around, (bottom + top) / 2, strict=True)]
        along = ends[1] - ends[0]
    along = along / np.linalg.norm(along)
    if along[np.abs(along).argmax()] < 0:
        along = -along
    if np.abs(along).min() < STRAIGHT:
        along = along.round() + 0.0
    return Axis(axis.boundary, faces.mean(axis=0), along)


def _classified(axis: Axis, before: Walk, after: Walk) -> Flexure | None:
    """What a thin place is; None where it is no flexure."""
    start, end, web = -before.grown, after.grown, after.thin
    if not (0 < SLENDER * web < end - start and np.isfinite([before.thick, after.thick]).all()):
        return None
    opens = [max(w.thick / web, w.step if w.on == w.grown and w.ends == "wall" else 0.0) for w in (before, after)]
    if min(opens) < OPENS:
        return None
    x = np.linspace(start, end, 401)[1:-1]
    low, high, down, up = axis.faces(x)
    if not np.isfinite(high - low).all():
        return None
    shift = float(np.abs(high + low).max() / 2)
    radii: list[float] = []
    is_round = True
    near = 1e-6 * (end - start)
    for side, walk in ((x < -before.flat - near, before), (x > after.flat + near, after)):
        arcs = {*down[side].tolist(), *up[side].tolist()}
        r = axis.boundary.radius[sorted(arcs)] if arcs else np.zeros(1)
        has_arcs = walk.grown > walk.flat and bool(np.isfinite(r).all())
        is_round &= walk.grown == walk.flat or (has_arcs and bool(np.ptp(r) <= ALIKE * r.min()))
        radii.append(float(r.mean()) if has_arcs else 0.0)
    is_even = shift <= ALIKE * web
    kind = _kind(axis, before, after, radii, is_round, is_even)
    table: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    if kind == "table":
        at = _stations(start, end)
        inside = np.clip(at, start + 1e-7 * (end - start), end - 1e-7 * (end - start))
        table = tuple((at - start).tolist()), tuple(axis.thickness(inside).tolist())
    if kind == "table" and is_even and (np.ptp(np.gradient(high - low, x)) < TAPERS):
        kind = "tapered"
    thick, aside = [before.thick, after.thick], [0.0, 0.0]
    for e, (s, w) in enumerate(((-1, before), (1, after))):
        if w.on > w.grown:
            bottom, top, _, _ = axis.faces(np.array([s * (w.grown + w.on) / 2]))
            thick[e], aside[e] = float((top - bottom)[0]), float((top + bottom)[0] / 2)
    stub = tuple(w.on - w.grown if w.ends in ("wall", "narrows") else 0.0 for w in (before, after))
    return Flexure(
        kind, _pair(axis.origin), _pair(axis.along), start, end, web, (thick[0], thick[1]),
        (radii[0], radii[1]), (stub[0], stub[1]), shift, (aside[0], aside[1]), table,
    )  # fmt: skip


def _stations(start: float, end: float) -> Array:
    """Places along a contour from one end to the other, most of them near its middle and its ends."""
    s = np.linspace(0, 1, STATIONS)
    return start + (end - start) * (s - np.sin(4 * np.pi * s) / (8 * np.pi))


def _kind(axis: Axis, before: Walk, after: Walk, radii: list[float], is_round: bool, is_even: bool) -> Kind:
    straight, length = before.flat + after.flat, before.grown + after.grown
    alike = abs(before.grown - after.grown) <= ALIKE * length
    has_same_radii = abs(radii[0] - radii[1]) <= ALIKE * max(radii)
    r = max(radii)
    is_quarter = all(
        abs(w.grown - w.flat - own) <= ALIKE * own for w, own in zip((before, after), radii, strict=True) if own > 0
    )
    if straight > ALIKE * length:
        if r == 0.0 or (is_round and is_quarter and straight >= STRAIGHT_SHARE * length):
            is_notch = r > LARGE_FILLET * after.thin or (r > 0 and length < SHORT * after.thin)
            return "corner_filleted" if is_notch and is_even and has_same_radii else "leaf"
        return "corner_filleted" if is_round and is_quarter and is_even and has_same_radii else "table"
    if not alike:
        return "table"
    if is_even and is_round and has_same_radii:
        return "circular"
    a, b = length / 2, (after.thick - after.thin) / 2
    x = np.linspace(-0.98, 0.98, 101) * a
    fitted = after.thin + 2 * b * (1 - np.sqrt(1 - (x / a) ** 2))
    return "elliptical" if (np.abs(axis.thickness(x) / fitted - 1) < 2 * ALIKE).all() else "table"


def _pair(at: Array) -> tuple[float, float]:
    return float(at[0]), float(at[1])


@dataclass(frozen=True)
class Link:
    """A straight arm of constant thickness, m, between the end of one flexure and that of another, or the block that
    this end is on a stub of: `ends` are (flexure, 0 or 1), the second one None at a block. `start` and `end` are in the
    middle of its own faces."""

    start: tuple[float, float]
    end: tuple[float, float]
    thickness: float
    ends: tuple[tuple[int, int], tuple[int, int] | None]


def links_of(flexures: list[Flexure], near: float) -> list[Link]:
    """Arms between flexures, and stubs of them on blocks."""
    ends = {(k, e): own.at((own.start, own.end)[e]) for k, own in enumerate(flexures) for e in (0, 1)}
    links, used = [], set[tuple[int, int]]()
    for k, e in ends:
        own = flexures[k]
        if (k, e) in used or own.stub[e] <= near:
            continue
        x = own.end if e else own.start
        begin = own.at(x, own.aside[e])
        far = own.at(x + own.stub[1] if e else x - own.stub[0], own.aside[e])
        met = []
        for key, at in ends.items():
            away = at - far
            along = abs(float(away @ own.along))
            if key != (k, e) and along < near and float(np.linalg.norm(away)) < own.thick[e] / 2:
                met.append(key)
        other = next((key for key in met if abs(flexures[key[0]].thick[key[1]] / own.thick[e] - 1) < ALIKE), None)
        used |= {(k, e)} | ({other} if other else set())
        links.append(Link(_pair(begin), _pair(far), own.thick[e], ((k, e), other)))
    return links


@dataclass(frozen=True)
class Block:
    """What is left of a part without its flexures and arms: a polygon of shapely, m, and the ends that it carries."""

    polygon: Any
    flexures: tuple[tuple[int, int], ...]
    links: tuple[int, ...]


def blocks_of(
    outline: Outline, flexures: list[Flexure], tolerance: float
) -> tuple[list[Flexure], list[Link], list[Block]]:
    """Flexures that join two blocks, arms, and blocks, each with the ends that it carries. Flexures both ends of which
    are in one block are left to that."""
    shapely = need("shapely", "solid")
    boundary, near = Boundary(outline.segments), 1e-5 * outline.size
    whole = outline.polygon(tolerance)
    while True:
        links = links_of(flexures, near)
        thin = [_strip(shapely, Axis(boundary, np.array(f.centre), np.array(f.along)), f, near / 10) for f in flexures]
        arms = [_arm(shapely, link, near / 10) for link in links]
        rest = whole.difference(shapely.union_all([*thin, *arms])) if thin else whole
        rest = rest.buffer(-near, join_style="mitre").buffer(near, join_style="mitre")
        parts = [own.simplify(near / 10) for own in getattr(rest, "geoms", [rest]) if own.area > SLIVER * outline.area]
        carried: list[tuple[list[tuple[int, int]], list[int]]] = [([], []) for _ in parts]
        joined = {end for link in links for end in link.ends if end is not None}

        def at(point: Array, parts: list[Any] = parts) -> int:
            return int(np.argmin(shapely.distance(parts, shapely.Point(*point))))

        host: dict[tuple[int, int], int] = {}
        for j, link in enumerate(links):
            if link.ends[1] is None:
                host[link.ends[0]] = at(np.array(link.end))
                carried[host[link.ends[0]]][1].append(j)
        for k, own in enumerate(flexures):
            for e in (0, 1):
                if (k, e) not in joined:
                    host[k, e] = at(own.at((own.start, own.end)[e]))
                    carried[host[k, e]][0].append((k, e))
        loose = {k for k in range(len(flexures)) if (k, 0) in host and host[k, 0] == host.get((k, 1))}
        if not loose:
            blocks = [Block(own, tuple(f), tuple(n)) for own, (f, n) in zip(parts, carried, strict=True)]
            return flexures, links, blocks
        flexures = [own for k, own in enumerate(flexures) if k not in loose]


def _strip(shapely: Any, axis: Axis, flexure: Flexure, near: float) -> Any:
    """The polygon of a flexure, a little wider than it is."""
    x = _stations(flexure.start, flexure.end)
    inside = np.clip(x, flexure.start + 1e-9 * flexure.length, flexure.end - 1e-9 * flexure.length)
    low, high, _, _ = axis.faces(inside)
    sides = [[axis.at(a, b - near) for a, b in zip(x, low, strict=True)]]
    sides.append([axis.at(a, b + near) for a, b in zip(x, high, strict=True)][::-1])
    thick = shapely.Polygon([p for side in sides for p in side])
    return thick.buffer(0)


def _arm(shapely: Any, link: Link, near: float) -> Any:
    a, b = np.array(link.start), np.array(link.end)
    u = (b - a) / np.linalg.norm(b - a)
    across = np.array([-u[1], u[0]]) * (link.thickness / 2 + near)
    return shapely.Polygon([a - across, b - across, b + across, a + across])
