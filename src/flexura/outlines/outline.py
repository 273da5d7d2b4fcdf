"""Outlines as data: loops of lines and circular arcs, what they enclose, and their offsets."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from types import ModuleType
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import ModelError, Problem, need
from flexura.records import Record
from flexura.tables import in_mm, quantity

Point = tuple[float, float]

LARGEST, SMALLEST = 3.0, 2e-4
"""Sizes, m, of parts beyond which units are likely wrong."""

DIGITS = 12
"""Decimals of coordinates, m, and bulges, to which outlines are alike."""

CHORD = 1e-5
"""Distance of chords from arcs, over the size of the outline, where loops are held against each other."""

TANGENT = 1e-6
"""Angle between segments, rad, up to which one runs on into the other."""


@dataclass(frozen=True)
class Segment(Record):
    """A line or a circular arc from `start` to `end`, m.

    `bulge` is the tangent of a quarter of the angle that the arc turns by, anticlockwise positive; 0 is a line, 1 a
    half circle. `layer` is that of the drawing.
    """

    start: Point
    end: Point
    bulge: float = 0.0
    layer: str = ""

    @property
    def is_line(self) -> bool:
        """Whether it is straight."""
        return self.bulge == 0.0

    @property
    def chord(self) -> float:
        """Distance of its ends, m."""
        return math.dist(self.start, self.end)

    @property
    def angle(self) -> float:
        """By how much it turns, rad, anticlockwise positive."""
        return 4 * math.atan(self.bulge)

    @property
    def radius(self) -> float:
        """Its radius, m; infinite of a line."""
        b = abs(self.bulge)
        return self.chord * (1 + b * b) / (4 * b) if b else math.inf

    @property
    def centre(self) -> Point:
        """The centre of an arc, m."""
        (x0, y0), (x1, y1), b = self.start, self.end, self.bulge
        k = (1 - b * b) / (4 * b)
        return (x0 + x1) / 2 - k * (y1 - y0), (y0 + y1) / 2 + k * (x1 - x0)

    @property
    def length(self) -> float:
        """Its length, m."""
        return self.chord if self.is_line else self.radius * abs(self.angle)

    def at(self, share: Array | float) -> Array:
        """Points (..., 2), m, at shares (...) of its length."""
        s = np.asarray(share, dtype=float)[..., None]
        start, end = np.array(self.start), np.array(self.end)
        if self.is_line:
            return start + s * (end - start)
        away, turned = start - self.centre, s[..., 0] * self.angle
        c, w = np.cos(turned), np.sin(turned)
        x, y = c * away[0] - w * away[1], w * away[0] + c * away[1]
        return np.stack([x, y], axis=-1) + self.centre

    def direction(self, share: float) -> Array:
        """The unit vector (2,) along it at a share of its length."""
        along = (np.array(self.end) - self.start) / self.chord
        turned = (share - 0.5) * self.angle
        c, s = math.cos(turned), math.sin(turned)
        return np.array([c * along[0] - s * along[1], s * along[0] + c * along[1]])

    def points(self, tolerance: float) -> Array:
        """Points (n, 2) on it from its start to before its end, whose chords are at most so far off, m."""
        if self.is_line:
            return np.array([self.start])
        step = 2 * math.acos(max(1 - tolerance / self.radius, 0.5))
        count = max(1, math.ceil(abs(self.angle) / step))
        return self.at(np.arange(count) / count)

    def reversed(self) -> Segment:
        """The same from its end to its start."""
        return Segment(self.end, self.start, -self.bulge, self.layer)


@dataclass(frozen=True)
class Loop(Record):
    """Segments of which each begins where the one before it ended, the first where the last one ended."""

    segments: tuple[Segment, ...]

    @cached_property
    def area(self) -> float:
        """The area within, m^2, negative where it runs clockwise."""
        total = 0.0
        for own in self.segments:
            (x0, y0), (x1, y1) = own.start, own.end
            total += (x0 * y1 - x1 * y0) / 2
            if not own.is_line:
                total += own.radius**2 * (own.angle - math.sin(own.angle)) / 2
        return total

    @cached_property
    def box(self) -> Array:
        """Lower and upper corner (2, 2), m."""
        points = [own.at(np.linspace(0, 1, 2)) for own in self.segments]
        for own in self.segments:
            if not own.is_line:
                far = np.array(own.centre) + own.radius * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
                start = math.atan2(*(np.array(own.start) - own.centre)[::-1])
                turned = (np.arange(4) * math.pi / 2 - start) * np.sign(own.bulge) % (2 * math.pi)
                points.append(far[turned <= abs(own.angle)])
        every = np.concatenate(points)
        return np.stack([every.min(axis=0), every.max(axis=0)])

    @property
    def length(self) -> float:
        """Its length, m."""
        return sum(own.length for own in self.segments)

    @property
    def circle(self) -> tuple[Point, float] | None:
        """Centre and radius, m, where it is a circle."""
        first = self.segments[0]
        if any(own.is_line for own in self.segments):
            return None
        near = 1e-6 * first.radius
        alike = all(math.dist(own.centre, first.centre) < near for own in self.segments)
        return (first.centre, first.radius) if alike else None

    def points(self, tolerance: float) -> Array:
        """Corners (n, 2), m, of a polygon along it whose sides are at most so far from arcs; not closed."""
        return np.concatenate([own.points(tolerance) for own in self.segments])

    def reversed(self) -> Loop:
        """The same the other way round."""
        return Loop(tuple(own.reversed() for own in reversed(self.segments)))


@dataclass(frozen=True)
class Outline(Record):
    """A planar part: its outer loop, anticlockwise, and then its holes, clockwise; SI.

    Loops are turned round and put in order where they are not so. Raises ModelError, with places, for loops that cross
    themselves or each other, for parts that do not hang together, islands in holes, and sizes that no part has. `notes`
    say what was healed and left out where it was read.
    """

    loops: tuple[Loop, ...]
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        if not self.loops:
            raise refused("", "a drawing has one closed loop at least", "is everything on a layer that is left out?")
        first, *holes = sorted(self.loops, key=lambda loop: -abs(loop.area))
        ordered = (first if first.area > 0 else first.reversed(), *(h if h.area < 0 else h.reversed() for h in holes))
        object.__setattr__(self, "loops", ordered)
        self._check()

    @property
    def outer(self) -> Loop:
        """The loop around everything."""
        return self.loops[0]

    @property
    def holes(self) -> tuple[Loop, ...]:
        """The loops within."""
        return self.loops[1:]

    @cached_property
    def area(self) -> float:
        """Area, m^2, without holes."""
        return sum(loop.area for loop in self.loops)

    @property
    def box(self) -> Array:
        """Lower and upper corner (2, 2), m."""
        return self.outer.box

    @property
    def size(self) -> float:
        """The longer side of its box, m."""
        return float(np.ptp(self.box, axis=0).max())

    @property
    def layers(self) -> tuple[str, ...]:
        """Layers that its segments are on."""
        return tuple(dict.fromkeys(own.layer for own in self.segments if own.layer))

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Segments of all loops."""
        return tuple(chain.from_iterable(loop.segments for loop in self.loops))

    def points(self, tolerance: float) -> list[Array]:
        """Corners (n, 2), m, of a polygon for each loop, whose sides are at most so far from arcs."""
        return [loop.points(tolerance) for loop in self.loops]

    def polygon(self, tolerance: float) -> Any:
        """The same as a polygon of shapely, with its holes. Raises OptionError without that."""
        outer, *holes = self.points(tolerance)
        return need("shapely", "solid").Polygon(outer, holes)

    def offset(self, by: float) -> Outline:
        """Grown outwards, or shrunk where `by` is negative, m, as a wire leaves it: lines and arcs stay such and meet
        where they do when they are extended. Raises ModelError where a segment would vanish or loops would meet."""
        return Outline(tuple(_offset(loop, by) for loop in self.loops), self.notes)

    def rounded(self) -> Outline:
        """The same to a picometre: however it was drawn, it is meshed alike, as round-off makes other meshes."""

        def own(x: float) -> float:
            return round(x, DIGITS) + 0.0

        def near(segment: Segment) -> Segment:
            (x, y), (u, v) = segment.start, segment.end
            return Segment((own(x), own(y)), (own(u), own(v)), own(segment.bulge), segment.layer)

        return Outline(tuple(Loop(tuple(map(near, loop.segments))) for loop in self.loops), self.notes)

    def _check(self) -> None:
        size = self.size
        if not SMALLEST <= size <= LARGEST:
            rule = f"a part is from {quantity(SMALLEST, 'm')} to {quantity(LARGEST, 'm')} long"
            raise refused(quantity(size, "m"), rule, "are units of the drawing right? name them, e.g. units='mm'")
        shapely = need("shapely", "solid")
        for loop in self.loops:
            if len(loop.points(CHORD * size)) < 3:
                raise refused(_place(loop.segments[0].start), "a loop encloses an area")
        rings = [shapely.LinearRing(points) for points in self.points(CHORD * size)]
        for loop, ring in zip(self.loops, rings, strict=True):
            if not ring.is_simple or abs(loop.area) <= CHORD * size * loop.length:
                where = loop.segments[0].start if ring.is_simple else _crossing(shapely, ring)
                rule = "a loop encloses an area and does not cross or touch itself"
                raise refused(_place(where), rule, "draw it as one simple loop")
        whole, *holes = (shapely.Polygon(ring) for ring in rings)
        for k, hole in enumerate(holes):
            shared = rings[0].intersection(rings[1 + k])
            if not shared.is_empty:
                raise refused(_place(shared.centroid.coords[0]), "loops do not touch or cross each other")
            if not whole.contains(hole):
                rule = "a part hangs together: one loop is around all others"
                raise refused(_place(hole.centroid.coords[0]), rule, "keep one part, e.g. by its layer")
            for other in holes[:k]:
                if hole.intersects(other):
                    within = other.contains(hole)
                    rule = "a hole has no islands in it" if within else "holes do not touch or cross each other"
                    common = hole if within else hole.boundary.intersection(other.boundary)
                    raise refused(_place(common.centroid.coords[0]), rule, "an island would be a part of its own")


def refused(value: str, rule: str, hint: str = "") -> ModelError:
    """The error of an outline, with what stands there, or where."""
    return ModelError([Problem(("outline",), value, rule, hint)])


def _place(point: Point | Array) -> str:
    return f"({in_mm(point)}) mm"


def _crossing(shapely: ModuleType, ring: Any) -> Point:
    """Where a ring crosses or touches itself."""
    text = shapely.is_valid_reason(shapely.Polygon(ring))
    x, y = text[text.index("[") + 1 : text.index("]")].split()[:2] if "[" in text else (math.nan, math.nan)
    return float(x), float(y)


def _offset(loop: Loop, by: float) -> Loop:
    """A loop whose segments are moved to their right."""
    moved = []
    for own in loop.segments:
        new = own
        for share, name in ((0.0, "start"), (1.0, "end")):
            x, y = own.direction(share)
            px, py = getattr(own, name)
            at = (px + by * float(y), py - by * float(x))
            new = (
                Segment(at, new.end, own.bulge, own.layer)
                if name == "start"
                else Segment(new.start, at, own.bulge, own.layer)
            )
        if not own.is_line and own.radius + math.copysign(by, own.bulge * by) <= 0:
            raise refused(_place(own.start), "an arc vanishes in the offset", "offset by less than its radius")
        moved.append(new)
    joints: list[Point] = []
    for k, own in enumerate(loop.segments):
        before, after = loop.segments[k - 1], own
        a, b = moved[k - 1], moved[k]
        u, v = before.direction(1.0), after.direction(0.0)
        if abs(math.atan2(u[0] * v[1] - u[1] * v[0], float(u @ v))) < TANGENT:
            joints.append(((a.end[0] + b.start[0]) / 2, (a.end[1] + b.start[1]) / 2))
            continue
        met = _meet(a, b)
        if not met:
            raise refused(_place(own.start), "segments no longer meet in the offset", "offset by less")
        joints.append(min(met, key=lambda p: math.dist(p, own.start)))
    segments = []
    for k, (own, shifted) in enumerate(zip(loop.segments, moved, strict=True)):
        start, end = joints[k], joints[(k + 1) % len(joints)]
        bulge = own.bulge
        if own.is_line:
            is_lost = float((np.array(end) - start) @ own.direction(0.5)) <= 0
        else:
            c = np.array(shifted.centre)
            a, b = np.array(start) - c, np.array(end) - c
            turned = math.atan2(a[0] * b[1] - a[1] * b[0], float(a @ b)) * math.copysign(1.0, bulge) % (2 * math.pi)
            is_lost = abs(turned - abs(own.angle)) > math.pi
            bulge = math.copysign(math.tan(turned / 4), bulge)
        if is_lost:
            raise refused(_place(own.start), "a segment vanishes in the offset", "offset by less")
        segments.append(Segment(start, end, bulge, own.layer))
    return Loop(tuple(segments))


def _meet(a: Segment, b: Segment) -> list[Point]:
    """Where the lines or circles of two segments meet."""
    if a.is_line and b.is_line:
        u, v = a.direction(0.5), b.direction(0.5)
        t = float(np.linalg.solve(np.stack([u, -v], axis=1), np.array(b.start) - a.start)[0])
        return [(a.start[0] + t * u[0], a.start[1] + t * u[1])]
    if b.is_line:
        a, b = b, a
    c, r = np.array(b.centre), b.radius
    if a.is_line:
        u = a.direction(0.5)
        foot = a.start + u * ((c - a.start) @ u)
        half = r * r - float((foot - c) @ (foot - c))
    else:
        apart = np.array(a.centre) - c
        d = float(np.linalg.norm(apart))
        if d == 0:
            return []
        along = (d * d + r * r - a.radius**2) / (2 * d)
        foot, half, u = c + along * apart / d, r * r - along**2, np.array([-apart[1], apart[0]]) / d
    if half < 0:
        return []
    return [tuple((foot + s * math.sqrt(half) * u).tolist()) for s in (-1, 1)]
