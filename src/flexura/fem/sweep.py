"""Fused members that are one plane figure of one width, on a grid of lines along and across them: hexahedra."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from flexura.arrays import Array, Index
from flexura.fem.geometry import MemberSolid, Outline
from flexura.fem.mapped import stations

NEAR = (0.3, 1.0, 3.0)
"""Distances from corners and ends at which figures are cut, over the thickness that ends there."""

SAME = 1e-6
"""Distance over the thickness up to which lines are one."""


@dataclass(frozen=True)
class Bar:
    """A member in the plane of its group: it starts at `start` (2,), m, and leads along an `axis` of the plane, 0 or 1,
    in the `sense` 1 or -1; `across` is its own axis in the plane across it, 1 or 2."""

    member: MemberSolid
    start: Array
    axis: int
    sense: int
    across: int

    def half(self, x: Array) -> Array:
        """Half sizes (n,), m, at distances x (n,), m, from its start."""
        shape, length = self.member.shape, self.member.length
        return length / 2 * shape.at(np.clip(x / length, 0.0, 1.0))[self.across - 1]

    @cached_property
    def is_straight(self) -> bool:
        """Whether it is as thick everywhere."""
        return self.member.shape.is_straight

    @cached_property
    def box(self) -> Array:
        """Lower and upper corner (2, 2) of the rectangle that it fills, or would with the thickness of its start."""
        ends = self.start + np.outer([0.0, self.member.length * self.sense], np.eye(2)[self.axis])
        half = self.thickness / 2 * np.eye(2)[1 - self.axis]
        return np.stack([ends.min(axis=0) - half, ends.max(axis=0) + half])

    @cached_property
    def thickness(self) -> float:
        """At its start, m."""
        return 2 * float(self.half(np.zeros(1))[0])

    def steps(self, width: float, size: float) -> Array:
        """Lengths of cells along both axes of the plane, m."""
        t, L = self.thickness, self.member.length
        if not self.is_straight:
            return np.full(2, size * t / 2)
        along = size * min(max(1.5 * t, min(L / 8, width / 4)), L / 2)
        across = size * (t if t < width / 4 or t < L / 8 else t / 2)
        return np.array([along, across] if self.axis == 0 else [across, along])

    def placed(self, points: Array) -> Array:
        """Where points (n, 2) of the rectangle are in the member."""
        if self.is_straight:
            return points
        points, middle = points.copy(), self.start[1 - self.axis]
        half = self.half(self.sense * (points[:, self.axis] - self.start[self.axis]))
        points[:, 1 - self.axis] = middle + (points[:, 1 - self.axis] - middle) * half / (self.thickness / 2)
        return points


@dataclass(frozen=True)
class Swept:
    """Members of one width: `frame` (3, 3) holds the two axes of their plane and the direction of the sweep as rows."""

    bars: tuple[Bar, ...]
    origin: Array
    frame: Array
    width: float

    def heights(self, size: float) -> Array:
        """Positions from 0 to the width between layers of cells, m, closer at the free edges of wide thin figures."""
        w, thinnest = self.width, min(bar.member.thickness for bar in self.bars)
        step = size * max(w / 6, thinnest)
        graded = 12 * thinnest < w and step > 2 * thinnest and any(bar.is_straight for bar in self.bars)
        edge = np.array([0.0, thinnest, 3 * thinnest]) if graded else np.zeros(1)
        inner = np.linspace(edge[-1], w - edge[-1], max(2, _count((w - 2 * edge[-1]) / step)) + 1)
        return np.concatenate([edge[:-1], inner, w - edge[:-1][::-1]])

    def plane_mesh(self, size: float) -> tuple[Array, Index, Index] | None:
        """Plane points (p, 2), m, quadrilaterals (q, 9), rows of three, and the member (q,) of each; None where the
        cells of two members do not match."""
        lines = [self._lines(axis, size) for axis in (0, 1)]
        centre = np.stack(np.meshgrid(*(x[1::2] for x in lines), indexing="ij"), axis=-1)
        inside = np.stack([((centre > bar.box[0]) & (centre < bar.box[1])).all(axis=-1) for bar in self.bars])
        if any((inside[k] & (inside.sum(axis=0) > 1)).any() for k, bar in enumerate(self.bars) if not bar.is_straight):
            return None
        i, j = np.nonzero(inside.any(axis=0))
        owner = inside.argmax(axis=0)[i, j]
        rows = len(lines[0])
        quads = (2 * i + rows * 2 * j)[:, None] + (rows * np.arange(3)[:, None] + np.arange(3)).ravel()
        flat = np.stack(np.meshgrid(*lines, indexing="xy"), axis=-1).reshape(-1, 2)
        points = np.full(flat.shape, np.nan)
        for k, bar in enumerate(self.bars):
            used = np.unique(quads[owner == k])
            places, before = bar.placed(flat[used]), points[used]
            if np.nanmax(np.abs(places - before), initial=0.0) > SAME * bar.member.thickness:
                return None
            points[used] = places
        kept, quads = np.unique(quads, return_inverse=True)
        return points[kept], quads.reshape(-1, 9), owner

    def _lines(self, axis: int, size: float) -> Array:
        """Lines (2 n + 1,), m, between n rows of cells along an axis and in their middles."""
        near = SAME * min(bar.member.thickness for bar in self.bars)
        corners = _apart(np.sort([x for bar in self.bars for x in bar.box[:, axis]]), near)
        fine = [bar for bar in self.bars if not bar.is_straight and bar.axis == axis]
        between = [bar.box[:, axis] for bar in fine]
        for at, gap in sorted(self._close(axis), key=lambda line: line[1]):
            if np.abs(np.array(corners) - at).min() > 0.5 * gap and not any(a < at < b for a, b in between):
                corners.append(at)
        own = [self._stations(bar, size) for bar in fine]
        corners = _apart(np.sort([*corners, *(x for places in own for x in places[::2])]), near)
        steps = [(bar.box[:, axis], float(bar.steps(self.width, size)[axis])) for bar in self.bars if bar not in fine]
        lines = [corners[0]]
        for a, b in pairwise(corners):
            middle = next((m for p in own for m in p[1::2] if a < m < b), None)
            if middle is not None:
                known = any(np.abs(p[:-2:2] - a).min() < near and np.abs(p[2::2] - b).min() < near for p in own)
                lines += [middle if known else (a + b) / 2, b]
                continue
            wanted = [step for (low, high), step in steps if low < (a + b) / 2 < high]
            lines += np.linspace(a, b, 2 * max(_count((b - a) / step) for step in wanted or [b - a]) + 1)[1:].tolist()
        return np.array(lines)

    def _stations(self, bar: Bar, size: float) -> Array:
        """Lines, m, at which a contour is cut into cells."""
        x = bar.start[bar.axis] + bar.sense * bar.member.length * stations(bar.member.shape, size)
        return np.sort(x)

    def _close(self, axis: int) -> Iterator[tuple[float, float]]:
        """Lines near the ends of thin members, and near their corners in others: stresses are infinite there. Their
        place, and how far they are from the corner, m."""
        for bar in self.bars:
            t, (low, high) = bar.thickness, bar.box
            if bar.is_straight and bar.axis == axis and t < bar.member.length / 8:
                for n in NEAR:
                    yield from ((float(low[axis] + n * t), n * t), (float(high[axis] - n * t), n * t))
            for other in self.bars:
                if other is bar or not other.is_straight or t > other.thickness / 2:
                    continue
                margin = SAME * t
                for end in (low, high):
                    middle = np.where(np.arange(2) == bar.axis, end, (low + high) / 2)
                    if (middle < other.box[0] - margin).any() or (middle > other.box[1] + margin).any():
                        continue
                    sense = 1.0 if end is high else -1.0
                    for n in NEAR:
                        beside = ((high[axis] + n * t), (low[axis] - n * t))
                        places = (end[axis] + sense * n * t,) if axis == bar.axis else beside
                        yield from ((float(x), n * t) for x in places if other.box[0, axis] < x < other.box[1, axis])


def _count(number: float) -> int:
    """A number of cells, rounded up, at least one."""
    return max(1, int(np.ceil(number - 1e-6)))


def _apart(values: Array, near: float) -> list[float]:
    """Sorted values, without those that hardly differ from the one before."""
    return [float(x) for k, x in enumerate(values) if k == 0 or x - values[k - 1] > near]


def swept(members: Sequence[MemberSolid]) -> Swept | None:
    """The members as one plane figure swept through one width, along and across the first; None when they are not."""
    outlines = [member.outline for member in members]
    first = members[0]
    for k in _directions(outlines[0]):
        direction, half = first.axes[k], _end_size(outlines[0], k)
        frame = np.stack([first.axes[0], np.cross(direction, first.axes[0]), direction])
        origin = first.start - half * direction
        bars = []
        for member, outline in zip(members, outlines, strict=True):
            along = frame[:2] @ member.axes[0]
            axis = int(np.abs(along).argmax())
            fits = [
                j
                for j in _directions(outline)
                if abs(member.axes[j] @ direction) > 1 - 1e-9
                and abs(_end_size(outline, j) - half) < 1e-6 * half
                and abs((member.start - first.start) @ direction) < 1e-6 * half
            ]
            if not fits or abs(along[axis]) < 1 - 1e-9:
                break
            start = frame[:2] @ (member.start - origin)
            bars.append(Bar(member, start, axis, int(np.sign(along[axis])), 3 - fits[0]))
        else:
            return Swept(tuple(bars), origin, frame, 2 * half)
    return None


def _directions(outline: Outline) -> list[int]:
    """Local axes along which a member is as wide everywhere, the widest first."""
    match outline.family:
        case "rectangle":
            return [1, 2] if outline.y[0] >= outline.z[0] else [2, 1]
        case "notch":
            return [1]
        case "tapered":
            return [k for k, half in ((1, outline.y), (2, outline.z)) if np.ptp(half) <= 1e-9 * half.max()]
    return []


def _end_size(outline: Outline, axis: int) -> float:
    return float((outline.y if axis == 1 else outline.z)[0])
