"""Convex solids with eight corners: which of many pairs meet, how deep, and what volume they share.

Corner 4 i + 2 j + k of a solid is the one at end i, j, k (0 or 1) of its three directions; faces are plane. A face may
have shrunk to a line or a point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index

_FACES = np.array([[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]])
_EDGES = np.array([[a, a | bit] for bit in (4, 2, 1) for a in range(8) if not a & bit])
CHUNK = 2000
"""Pairs that are looked at together: their axes take some 100 MB."""

SWEPT = 2_000_000
"""Pairs of bounds that are looked at together."""

NEGLIGIBLE = 1e-12
"""Area of a face, length of an edge and slope of a line, over the largest of a solid, that count as none."""

PARALLEL_EDGES = 1e-6
"""Sine of the angle between edges that have no common normal."""

FLUSH = 1e-10
"""Distance of planes that are one, over the size of the solids."""

BESIDE = 1e-9
"""How far a line that is parallel to a face lies outside of it, over the size of the solid, to miss the solid."""


class Planes(NamedTuple):
    """Faces of solids: outward unit normals (n, 6, 3), zero for faces without area, and their distances (n, 6), m."""

    normals: Array
    offsets: Array


def boxes(centre: Array, axes: Array, half: Array) -> Array:
    """Corners (n, 8, 3) of boxes with centres (n, 3), unit axes as rows (n, 3, 3) and half edges (n, 3), m."""
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    return centre[:, None] + (signs * half[:, None]) @ axes


def planes(corners: Array) -> Planes:
    """The faces of solids with corners (n, 8, 3)."""
    face = corners[:, _FACES]
    area = np.cross(face[:, :, 2] - face[:, :, 0], face[:, :, 3] - face[:, :, 1])
    length = np.linalg.norm(area, axis=-1, keepdims=True)
    largest = length.max(axis=1, keepdims=True)
    normals = np.divide(area, length, out=np.zeros_like(area), where=length > NEGLIGIBLE * largest)
    middle = corners.mean(axis=1)
    outward = np.einsum("nfi,nfi->nf", normals, face.mean(axis=2) - middle[:, None])
    normals = normals * np.where(outward < 0, -1.0, 1.0)[..., None]
    return Planes(normals, np.einsum("nfi,nfi->nf", normals, face[:, :, 0]))


def overlapping_bounds(low: Array, high: Array, most: int) -> Index | None:
    """Pairs (p, 2), i < j, of axis-aligned bounds (n, 3) that meet; None when a sweep would look at more than `most`.

    A sweep along the direction in which fewest pairs follow each other.
    """
    best: tuple[int, Index, Index, Index] | None = None
    for axis in range(3):
        order = np.argsort(low[:, axis], kind="stable")
        last = np.searchsorted(low[order, axis], high[order, axis], side="right")
        count = last - np.arange(len(order)) - 1
        total = int(count.sum())
        if best is None or total < best[0]:
            best = (total, order, count, last)
    if best is None or best[0] > most:
        return None
    _, order, count, _ = best
    pairs = [np.empty((0, 2), dtype=np.intp)]
    ends = np.cumsum(count)
    start = 0
    while start < len(order):
        stop = max(int(np.searchsorted(ends, (ends[start - 1] if start else 0) + SWEPT, side="right")), start + 1)
        counts = count[start:stop]
        i = np.repeat(np.arange(start, stop), counts)
        j = i + 1 + np.arange(len(i)) - np.repeat(np.cumsum(counts) - counts, counts)
        pair = np.stack([order[i], order[j]], axis=-1)
        meets = ((low[pair[:, 0]] <= high[pair[:, 1]]) & (low[pair[:, 1]] <= high[pair[:, 0]])).all(axis=1)
        pairs.append(np.sort(pair[meets], axis=1))
        start = stop
    return np.concatenate(pairs).astype(np.intp)


def separations(first: Array, second: Array, are_boxes: bool = False) -> Array:
    """How far apart pairs of solids, corners (n, 8, 3) both, are (n,), m: minus the depth to which they overlap.

    Of boxes three faces and edges stand for all.

    The largest gap along the normals of faces and the products of edges (separating axes: Gottschalk, Lin and Manocha
    1996): its sign is exact, and so is a depth; a gap between two corners, or a corner and an edge, may be larger.
    """
    every = 4 if are_boxes else 1
    gaps = np.empty(len(first))
    for start in range(0, len(first), CHUNK):
        chunk = slice(start, start + CHUNK)
        a, b = first[chunk], second[chunk]
        faces = [planes(solid).normals[:, :: 2 if are_boxes else 1] for solid in (a, b)]
        gap = _gaps(a, b, np.concatenate(faces, axis=1)).max(axis=1)
        near = np.flatnonzero(gap <= 0)
        if len(near):
            edges = [_directions(solid[near])[:, ::every] for solid in (a, b)]
            axes = np.cross(edges[0][:, :, None], edges[1][:, None]).reshape(len(near), -1, 3)
            length = np.linalg.norm(axes, axis=-1, keepdims=True)
            axes = np.divide(axes, length, out=np.zeros_like(axes), where=length > PARALLEL_EDGES)
            gap[near] = np.maximum(gap[near], _gaps(a[near], b[near], axes).max(axis=1))
        gaps[chunk] = gap
    return gaps


def _directions(corners: Array) -> Array:
    """Unit directions (n, 12, 3) of edges, zero for those without length."""
    edge = corners[:, _EDGES[:, 1]] - corners[:, _EDGES[:, 0]]
    length = np.linalg.norm(edge, axis=-1, keepdims=True)
    return np.divide(
        edge, length, out=np.zeros_like(edge), where=length > NEGLIGIBLE * length.max(axis=1, keepdims=True)
    )


def _gaps(a: Array, b: Array, axes: Array) -> Array:
    """Gaps (n, k), m, of pairs of solids along unit axes (n, k, 3); minus infinity along those that are zero."""
    along = [solid @ np.swapaxes(axes, 1, 2) for solid in (a, b)]
    (low_a, high_a), (low_b, high_b) = ((x.min(axis=1), x.max(axis=1)) for x in along)
    gap = np.maximum(low_a - high_b, low_b - high_a)
    return np.where((axes != 0).any(axis=-1), gap, -np.inf)


def shared(first: Array, second: Array) -> tuple[Array, Array]:
    """Volumes (n,), m^3, that pairs of solids, corners (n, 8, 3) both, share, and middles (n, 3), m, of these.

    The faces of each within the other (Sutherland and Hodgman 1974) bound what they share; its volume follows from
    their areas (divergence theorem). The middle is that of its bounds.
    """
    volumes, middles = np.zeros(len(first)), (first.mean(axis=1) + second.mean(axis=1)) / 2
    for start in range(0, len(first), CHUNK):
        chunk = slice(start, start + CHUNK)
        volumes[chunk], middles[chunk] = _shared(first[chunk], second[chunk], middles[chunk])
    return volumes, middles


def _shared(first: Array, second: Array, origin: Array) -> tuple[Array, Array]:
    first, second = first - origin[:, None], second - origin[:, None]
    faces = planes(first), planes(second)
    size = np.maximum(np.ptp(first, axis=1), np.ptp(second, axis=1)).max(axis=1)
    tolerance = FLUSH * size
    n = len(first)
    volume, low, high = np.zeros(n), np.full((n, 3), np.inf), np.full((n, 3), -np.inf)
    for corners, own_faces, other in ((first, *faces), (second, *faces[::-1])):
        points, count = _within(corners[:, _FACES], other, tolerance)
        if own_faces is faces[1]:
            same = np.einsum("nfi,ngi->nfg", own_faces.normals, other.normals) > 1 - NEGLIGIBLE
            flush = np.abs(own_faces.offsets[:, :, None] - other.offsets[:, None]) <= 2 * tolerance[:, None, None]
            count[(same & flush).any(axis=2)] = 0
        is_point = np.arange(points.shape[2]) < count[..., None]
        # points that are not used repeat the first, and add no area
        points = np.where(is_point[..., None], points, points[:, :, :1])
        fan = points - points[:, :, :1]
        area = np.cross(fan[:, :, 1:-1], fan[:, :, 2:]).sum(axis=2) / 2
        size_of = np.where(count >= 3, np.abs(np.einsum("nfi,nfi->nf", area, own_faces.normals)), 0.0)
        volume += (size_of * own_faces.offsets).sum(axis=1) / 3
        used = is_point.any(axis=2)[..., None, None]
        low = np.minimum(low, np.where(used, points, np.inf).min(axis=(1, 2)))
        high = np.maximum(high, np.where(used, points, -np.inf).max(axis=(1, 2)))
    meets = np.isfinite(low).all(axis=1, keepdims=True)
    low, high = (np.where(meets, bound, 0.0) for bound in (low, high))
    return np.maximum(volume, 0.0), origin + (low + high) / 2


def _within(polygons: Array, other: Planes, tolerance: Array) -> tuple[Array, Index]:
    """Convex polygons (n, f, 4, 3) cut off at the planes of other solids: points (n, f, 10, 3) and how many (n, f)."""
    n, f = polygons.shape[:2]
    most = 10
    points = np.zeros((n, f, most, 3))
    points[:, :, :4] = polygons
    count = np.full((n, f), 4)
    k = np.arange(most)
    for plane in range(6):
        normal, offset = other.normals[:, plane], other.offsets[:, plane]
        height = np.einsum("nfki,ni->nfk", points, normal) - (offset + tolerance)[:, None, None]
        valid = k < count[..., None]
        after = np.where(k + 1 < count[..., None], k + 1, 0)
        end = np.take_along_axis(points, after[..., None], axis=2)
        end_height = np.take_along_axis(height, after, axis=2)
        inside = valid & (height <= 0)
        passes = valid & ((height <= 0) != (end_height <= 0))
        share = np.divide(height, height - end_height, out=np.zeros_like(height), where=passes)
        cut = points + share[..., None] * (end - points)
        both = np.stack([points, cut], axis=3).reshape(n, f, 2 * most, 3)
        kept = np.stack([inside, passes], axis=3).reshape(n, f, 2 * most)
        order = np.argsort(~kept, axis=2, kind="stable")[:, :, :most]
        points = np.take_along_axis(both, order[..., None], axis=2)
        count = np.minimum(kept.sum(axis=2), most)
    return points, count


def crossed(corners: Array, start: Array, end: Array) -> Array:
    """Fractions (n, 2) of the line from `start` (3,) to `end` (3,) at which it enters and leaves solids (n, 8, 3); the
    first exceeds the second for those that it misses."""
    normals, offsets = planes(corners)
    below, slope = offsets - normals @ start, normals @ (end - start)
    scale = np.abs(slope).max(axis=1, keepdims=True)
    at = np.divide(below, slope, out=np.zeros_like(below), where=np.abs(slope) > NEGLIGIBLE * scale)
    enters = np.where(slope < -NEGLIGIBLE * scale, at, -np.inf).max(axis=1)
    leaves = np.where(slope > NEGLIGIBLE * scale, at, np.inf).min(axis=1)
    size = np.ptp(corners, axis=1).max(axis=1)
    misses = ((np.abs(slope) <= NEGLIGIBLE * scale) & (below < -BESIDE * size[:, None])).any(axis=1)
    return np.stack([np.maximum(np.where(misses, 1.0, enters), 0.0), np.minimum(np.where(misses, 0.0, leaves), 1.0)], 1)
