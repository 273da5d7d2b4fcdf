"""Segments of a drawing, in any order and sense, chained to loops."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.outlines.outline import Loop, Outline, Point, Segment, refused
from flexura.sizes import beyond
from flexura.tables import counted, in_mm, quantity

SAME_POINT, HEALED = 1e-6, 1e-4
"""Distance of ends, over the size of the drawing, that are one point, and up to which a gap is closed."""


def outline_of(segments: Iterable[Segment], notes: Sequence[str] = ()) -> Outline:
    """The outline of segments in any order and sense, m.

    Ends within 1e-6 of the size are one point, gaps up to 1e-4 are closed and noted, lines that are drawn twice or have
    no length are dropped and noted. Raises ModelError, with the place, for larger gaps, for points at which more than
    two lines end, and as `Outline`; for more segments than the limit `drawing_segments`.
    """
    given, noted = list(segments), list(notes)
    if found := beyond("drawing_segments", len(given)):
        raise refused(*found)
    if not given:
        raise refused("", "a drawing has lines or arcs", "is everything on a layer that is left out, or in a block?")
    ends = np.array([[own.start, own.end] for own in given], dtype=float)
    if not np.isfinite(ends).all() or not all(math.isfinite(own.bulge) for own in given):
        raise refused("", "coordinates are finite numbers")
    size = float(np.ptp(ends.reshape(-1, 2), axis=0).max()) or max(own.radius for own in given)
    given, ends = _without_points(given, ends, SAME_POINT * size, noted)
    corners, points = _joined(ends, SAME_POINT * size)
    given, corners = _without_copies(given, corners, SAME_POINT * size, noted)
    corners = _healed(corners, points, HEALED * size, noted)
    return Outline(tuple(_loops(given, corners, points)), tuple(noted))


def _without_points(given: list[Segment], ends: Array, near: float, notes: list[str]) -> tuple[list[Segment], Array]:
    has_length = np.array([own.chord > near and own.length > near for own in given], dtype=bool)
    if not has_length.all():
        first = ends[int(np.argmin(has_length)), 0]
        count = counted(int((~has_length).sum()), "segment")
        notes.append(f"{count} without length left out, the first at ({in_mm(first)}) mm")
    kept = [own for own, keep in zip(given, has_length, strict=True) if keep]
    if not kept:
        raise refused(f"({in_mm(ends[0, 0])}) mm", "lines and arcs have a length", "nothing else is drawn")
    return kept, ends[has_length]


def _joined(ends: Array, near: float) -> tuple[Index, Array]:
    """The numbers (n, 2) of the points at which segments end, and these points (p, 2), m."""
    from scipy.spatial import KDTree  # slow to import

    flat = ends.reshape(-1, 2)
    pairs = KDTree(flat).query_pairs(near, output_type="ndarray")
    links = sp.coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(flat), len(flat)))
    count, label = sp.csgraph.connected_components(links, directed=False)
    points = np.stack([np.bincount(label, flat[:, k], count) for k in (0, 1)], axis=1)
    return label.reshape(-1, 2).astype(np.intp), points / np.bincount(label, minlength=count)[:, None]


def _without_copies(given: list[Segment], corners: Index, near: float, notes: list[str]) -> tuple[list[Segment], Index]:
    """Without segments that lie on another one with the same ends."""
    seen: dict[tuple[int, int], list[Array]] = {}
    kept, where = [], []
    for k, own in enumerate(given):
        key = (int(corners[k].min()), int(corners[k].max()))
        middle = own.at(0.5)
        if any(np.linalg.norm(middle - other) < near for other in seen.setdefault(key, [])):
            where.append(middle)
            continue
        seen[key].append(middle)
        kept.append(k)
    if where:
        count = counted(len(where), "segment")
        notes.append(f"{count} drawn twice left out, the first at ({in_mm(where[0])}) mm")
    return [given[k] for k in kept], corners[kept]


def _healed(corners: Index, points: Array, most: float, notes: list[str]) -> Index:
    """Points at which one segment ends joined with the nearest such one."""
    from scipy.spatial import KDTree  # slow to import

    count = np.bincount(corners.ravel(), minlength=len(points))
    if (count > 2).any():
        k = int(np.argmax(count))
        rule = "two segments end at each point of a loop"
        hint = "lines that lie on each other in part, or that split the part, are to be taken out"
        raise refused(f"{count[k]} at ({in_mm(points[k])}) mm", rule, hint)
    loose = np.flatnonzero(count == 1)
    if not len(loose):
        return corners
    distances, order = KDTree(points[loose]).query(points[loose], k=2)
    gap, other = np.asarray(distances)[:, 1], np.asarray(order)[:, 1]
    worst = int(np.argmax(gap))
    mutual = other[other] == np.arange(len(loose))
    if gap[worst] > most or not mutual.all():
        bad = worst if gap[worst] > most else int(np.argmin(mutual))
        rule = f"loops are closed; gaps up to {quantity(most, 'm', 3)} are healed"
        value = f"{quantity(float(gap[bad]), 'm', 4)} at ({in_mm(points[loose[bad]])}) mm"
        raise refused(f"a gap of {value}", rule, "close it in the drawing")
    at = in_mm(points[loose[worst]])
    closed = counted(len(loose) // 2, "gap")
    notes.append(f"{closed} closed, the widest of {quantity(float(gap[worst]), 'm', 3)} at ({at}) mm")
    joined = np.arange(len(points))
    for a, b in zip(loose, loose[other], strict=True):
        joined[max(a, b)] = min(a, b)
    return joined[corners]


def _loops(given: list[Segment], corners: Index, points: Array) -> list[Loop]:
    at: dict[int, list[int]] = {}
    for k, pair in enumerate(corners.tolist()):
        for corner in pair:
            at.setdefault(corner, []).append(k)
    left, loops = set(range(len(given))), []
    while left:
        k, start = min(left), int(corners[min(left), 0])
        here, segments = start, []
        while k in left:
            left.discard(k)
            a, b = corners[k].tolist()
            there = b if a == here else a
            own = given[k] if a == here else given[k].reversed()
            segments.append(Segment(_point(points[here]), _point(points[there]), own.bulge, own.layer))
            here = there
            k = next((j for j in at[here] if j in left), -1)
        loops.append(Loop(tuple(segments)))
    return loops


def _point(at: Array) -> Point:
    return float(at[0]), float(at[1])
