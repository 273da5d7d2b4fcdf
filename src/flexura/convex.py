"""Convex solids with eight corners: which of many pairs meet, how deep, and what volume they share.

Corner 4 i + 2 j + k of a solid is the one at end i, j, k (0 or 1) of its three directions; faces are plane. A face may
have shrunk to a line or a point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_FACES = np.array([[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]])
_EDGES = np.array([[a, a | bit] for bit in (4, 2, 1) for a in range(8) if not a & bit])
CHUNK = 2000
"""Pairs that are looked at together: their axes take some 100 MB."""


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
    normals = np.divide(area, length, out=np.zeros_like(area), where=length > 1e-12 * largest)
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
    found = [np.empty((0, 2), dtype=np.intp)]
    ends = np.cumsum(count)
    start = 0
    while start < len(order):
        stop = max(int(np.searchsorted(ends, (ends[start - 1] if start else 0) + 2_000_000, side="right")), start + 1)
        own = count[start:stop]
        i = np.repeat(np.arange(start, stop), own)
        j = i + 1 + np.arange(len(i)) - np.repeat(np.cumsum(own) - own, own)
        pair = np.stack([order[i], order[j]], axis=-1)
        meets = ((low[pair[:, 0]] <= high[pair[:, 1]]) & (low[pair[:, 1]] <= high[pair[:, 0]])).all(axis=1)
        found.append(np.sort(pair[meets], axis=1))
        start = stop
    return np.concatenate(found).astype(np.intp)


def separations(first: Array, second: Array) -> Array:
    """How far apart pairs of solids, corners (n, 8, 3) both, are (n,), m: minus the depth to which they overlap.

    The largest gap along the normals of faces and the products of edges (separating axes: Gottschalk, Lin and Manocha
    1996): its sign is exact, and so is a depth; a gap between two corners, or a corner and an edge, may be larger.
    """
    found = np.empty(len(first))
    for start in range(0, len(first), CHUNK):
        own = slice(start, start + CHUNK)
        a, b = first[own], second[own]
        gap = _gaps(a, b, np.concatenate([planes(a).normals, planes(b).normals], axis=1)).max(axis=1)
        near = np.flatnonzero(gap <= 0)
        if len(near):
            edges = [_directions(solid[near]) for solid in (a, b)]
            axes = np.cross(edges[0][:, :, None], edges[1][:, None]).reshape(len(near), -1, 3)
            length = np.linalg.norm(axes, axis=-1, keepdims=True)
            axes = np.divide(axes, length, out=np.zeros_like(axes), where=length > 1e-6)
            gap[near] = np.maximum(gap[near], _gaps(a[near], b[near], axes).max(axis=1))
        found[own] = gap
    return found


def _directions(corners: Array) -> Array:
    """Unit directions (n, 12, 3) of edges, zero for those without length."""
    edge = corners[:, _EDGES[:, 1]] - corners[:, _EDGES[:, 0]]
    length = np.linalg.norm(edge, axis=-1, keepdims=True)
    return np.divide(edge, length, out=np.zeros_like(edge), where=length > 1e-12 * length.max(axis=1, keepdims=True))


def _gaps(a: Array, b: Array, axes: Array) -> Array:
    """Gaps (n, k), m, of pairs of solids along unit axes (n, k, 3); minus infinity along those that are zero."""
    along = [solid @ np.swapaxes(axes, 1, 2) for solid in (a, b)]
    (low_a, high_a), (low_b, high_b) = ((x.min(axis=1), x.max(axis=1)) for x in along)
    gap = np.maximum(low_a - high_b, low_b - high_a)
    return np.where((axes != 0).any(axis=-1), gap, -np.inf)


def shared(first: Array, second: Array) -> tuple[Array, Array]:
    """Volumes (n,), m^3, that pairs of solids, corners (n, 8, 3) both, share, and middles (n, 3), m, of these.

    The convex hull of the corners of each inside the other and of the points at which edges pass faces.
    """
    from scipy.spatial import ConvexHull, QhullError

    volumes, middles = np.zeros(len(first)), (first.mean(axis=1) + second.mean(axis=1)) / 2
    for k, points in enumerate(_common_points(first, second)):
        if not len(points):
            continue
        middles[k] = (points.min(axis=0) + points.max(axis=0)) / 2
        size = float(np.ptp(points, axis=0).max())
        if len(points) < 4 or size == 0:
            continue
        try:
            volumes[k] = ConvexHull((points - middles[k]) / size).volume * size**3
        except QhullError:  # they meet in a face, a line or a point
            continue
    return volumes, middles


def _common_points(first: Array, second: Array) -> list[Array]:
    """For each pair the points among which are all corners of what two solids share."""
    found: list[list[Array]] = [[] for _ in first]
    faces = (planes(first), planes(second))
    sizes = np.maximum(np.ptp(first, axis=1), np.ptp(second, axis=1)).max(axis=1)
    tolerance = 1e-10 * sizes
    for own, other in ((0, 1), (1, 0)):
        corners, (normals, offsets) = (first, second)[own], faces[other]
        height = np.einsum("nfi,nci->ncf", normals, corners) - offsets[:, None]
        start, end = height[:, _EDGES[:, 0]], height[:, _EDGES[:, 1]]
        rise = end - start
        passes = (np.minimum(start, end) < 0) & (np.maximum(start, end) > 0)
        share = np.divide(-start, rise, out=np.zeros_like(rise), where=passes)
        p, q = corners[:, _EDGES[:, 0], None], corners[:, _EDGES[:, 1], None]
        candidates = np.concatenate([corners, (p + share[..., None] * (q - p)).reshape(len(first), -1, 3)], axis=1)
        wanted = np.concatenate([np.ones(corners.shape[:2], dtype=bool), passes.reshape(len(first), -1)], axis=1)
        above = np.einsum("nfi,nci->ncf", normals, candidates) - offsets[:, None]
        inside = wanted & (above <= tolerance[:, None, None]).all(axis=-1)
        for k in range(len(first)):
            found[k].append(candidates[k, inside[k]])
    return [np.concatenate(points) for points in found]


def crossed(corners: Array, start: Array, end: Array) -> Array:
    """Fractions (n, 2) of the way from `start` (3,) to `end` (3,) at which a line enters and leaves solids (n, 8, 3);
    the first exceeds the second for those that it misses."""
    normals, offsets = planes(corners)
    below, slope = offsets - normals @ start, normals @ (end - start)
    scale = np.abs(slope).max(axis=1, keepdims=True)
    at = np.divide(below, slope, out=np.zeros_like(below), where=np.abs(slope) > 1e-12 * scale)
    enters = np.where(slope < -1e-12 * scale, at, -np.inf).max(axis=1)
    leaves = np.where(slope > 1e-12 * scale, at, np.inf).min(axis=1)
    size = np.ptp(corners, axis=1).max(axis=1)
    misses = ((np.abs(slope) <= 1e-12 * scale) & (below < -1e-9 * size[:, None])).any(axis=1)
    return np.stack([np.maximum(np.where(misses, 1.0, enters), 0.0), np.minimum(np.where(misses, 0.0, leaves), 1.0)], 1)
