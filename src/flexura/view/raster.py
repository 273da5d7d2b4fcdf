"""A depth buffer in NumPy: triangles to an image in which nearer surfaces hide farther ones, pixel by pixel.

matplotlib sorts whole polygons by depth, which tears surfaces that meet or run into each other, as hinges do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.view.meshes import Array, Index

OVERSAMPLING = 2
"""Samples per pixel in each direction."""
_CHUNK = 1_000_000
_PIECE = 16.0


class Triangles(NamedTuple):
    """Triangles in a picture.

    corners: (t, 3, 3), x to the right, y up, z towards the viewer, pixels; colours: (t, 3, 3), RGB at the corners.
    """

    corners: Array
    colours: Array

    @staticmethod
    def joined(parts: list[Triangles]) -> Triangles:
        """All triangles of several sets."""
        if not parts:
            return Triangles(np.empty((0, 3, 3)), np.empty((0, 3, 3)))
        return Triangles(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def of_faces(corners: Array, colours: Array) -> Triangles:
    """Triangles of faces with corners (f, 4, 3), pixels, and colours at the corners (f, 4, 3)."""
    halves = [[0, 1, 2], [0, 2, 3]]
    return Triangles(corners[:, halves].reshape(-1, 3, 3), colours[:, halves].reshape(-1, 3, 3))


def of_lines(ends: Array, colours: Array, width: Array, lift: float = 0.0) -> Triangles:
    """Triangles of lines with ends (l, 2, 3), pixels, colours (l, 3) and widths (l,), pixels, facing the viewer.

    `lift` moves them towards the viewer, pixels, so that lines on a surface are not buried in it. Long lines are cut
    up, because the work on a triangle goes with the area of its bounding box.
    """
    line, first, last = _cuts(np.linalg.norm(ends[:, 1, :2] - ends[:, 0, :2], axis=1))
    span = ends[line, 1] - ends[line, 0]
    ends = np.stack([ends[line, 0] + first[:, None] * span, ends[line, 0] + last[:, None] * span], axis=1)
    length = np.linalg.norm(span[:, :2], axis=1, keepdims=True)
    along = np.where(length > 1e-9, span[:, :2] / np.maximum(length, 1e-9), [1.0, 0.0]) * width[line, None] / 2
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    corners = ends[:, [0, 1, 1, 0]].copy()
    corners[:, :, 2] += lift
    corners[:, [0, 3], :2] -= along[:, None]
    corners[:, [1, 2], :2] += along[:, None]
    corners[:, :2, :2] -= across[:, None]
    corners[:, 2:, :2] += across[:, None]
    return of_faces(corners, np.repeat(colours[line, None], 4, axis=1))


def _cuts(length: Array) -> tuple[Index, Array, Array]:
    """Pieces of lines of given lengths (l,), pixels: the line of each, and where it begins and ends, 0 to 1."""
    count = np.maximum(np.ceil(length / _PIECE), 1).astype(np.intp)
    line = np.repeat(np.arange(len(length)), count)
    k = np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count)
    return line, k / count[line], (k + 1) / count[line]


def render(solid: Triangles, glass: Triangles, width: int, height: int, opacity: float = 0.55) -> tuple[Array, Array]:
    """Image (height, width, 4), RGBA with the lowest row first, and depth (height, width), pixels.

    `glass` lets what is behind it show through. The background is transparent and infinitely far (-inf).
    """
    n = OVERSAMPLING
    w, h = width * n, height * n
    colour, alpha = np.ones((h * w, 3)), np.zeros(h * w)
    depth = np.full(h * w, -np.inf)
    found = _nearest(solid, w, h, depth)
    alpha[found[0]], colour[found[0]] = 1.0, found[1]
    surface = depth.copy()
    pixel, rgb = _nearest(glass, w, h, depth)
    total = opacity + alpha[pixel] * (1 - opacity)
    behind = (alpha[pixel] * (1 - opacity) / total)[:, None]
    colour[pixel] = rgb * (1 - behind) + colour[pixel] * behind
    alpha[pixel] = total
    colour *= alpha[:, None]
    opaque = _averaged(alpha[:, None], w, h)
    image = np.concatenate([_averaged(colour, w, h) / np.where(opaque > 0, opaque, 1.0), opaque], axis=-1)
    image[image[..., 3] == 0.0] = (1.0, 1.0, 1.0, 0.0)
    return image.clip(0.0, 1.0), surface.reshape(height, n, width, n)[:, 0, :, 0]


def _averaged(samples: Array, w: int, h: int) -> Array:
    """Means (height, width, c) over the samples (h * w, c) of each pixel."""
    n, grid = OVERSAMPLING, samples.reshape(h, w, -1)
    total = np.zeros((h // n, w // n, grid.shape[2]))
    for i in range(n):
        for j in range(n):
            total += grid[i::n, j::n]
    return total / n**2


def _nearest(triangles: Triangles, w: int, h: int, depth: Array) -> tuple[Index, Array]:
    """Samples (k,) at which one of the triangles is the nearest surface, and its colours (k, 3) there.

    depth: (h * w,), raised to that of the triangles.
    """
    corners = triangles.corners * [OVERSAMPLING, OVERSAMPLING, 1.0]
    corners[:, :, 2] += 1e-6 * np.arange(len(corners))[:, None]  # settles which of two coincident faces is seen
    low = np.ceil(corners[..., :2].min(axis=1) - 0.5).clip(0, None).astype(np.intp)
    high = np.floor(corners[..., :2].max(axis=1) - 0.5).clip(None, [w - 1, h - 1]).astype(np.intp)
    box = np.maximum(high - low + 1, 0)
    samples = box[:, 0] * box[:, 1]
    kept = np.flatnonzero(samples)
    g = _gradients(corners)
    owner = np.full(h * w, -1, dtype=np.intp)
    bounds = np.flatnonzero(np.diff(np.cumsum(samples[kept]) // _CHUNK)) + 1
    for chunk in np.split(kept, bounds):
        x, y, t = _boxes(low[chunk], box[chunk], chunk)
        one, two, three = _weights(g, t, x, y)
        inside = np.flatnonzero((one >= -1e-9) & (two >= -1e-9) & (three >= -1e-9))
        t, pixel = t[inside], y[inside] * w + x[inside]
        z = corners[:, :, 2]
        depths = one[inside] * z[t, 0] + two[inside] * z[t, 1] + three[inside] * z[t, 2]
        np.maximum.at(depth, pixel, depths)
        first = depths >= depth[pixel]
        owner[pixel[first]] = t[first]
    pixel = np.flatnonzero(owner >= 0)
    t = owner[pixel]
    weights = _weights(g, t, pixel % w, pixel // w)
    return pixel, sum((weight[:, None] * triangles.colours[t, k] for k, weight in enumerate(weights)), np.zeros(3))


def _boxes(low: Index, box: Index, number: Index) -> tuple[Index, Index, Index]:
    """All samples x, y (k,) of boxes with lowest samples `low` (t, 2) and sizes `box` (t, 2), and whose they are."""
    rows = np.repeat(np.arange(len(box)), box[:, 1])
    y = low[rows, 1] + np.arange(len(rows)) - np.repeat(np.cumsum(box[:, 1]) - box[:, 1], box[:, 1])
    width = box[rows, 0]
    start = low[rows, 0] - (np.cumsum(width) - width)
    x = np.arange(width.sum()) + np.repeat(start, width)
    return x, np.repeat(y, width), np.repeat(number[rows], width)


def _gradients(corners: Array) -> Array:
    """Barycentric coordinates of two corners as g (t, 2, 3): g[0] x + g[1] y + g[2]; -1 in triangles without area."""
    a, b, c = (corners[:, i, :2] for i in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    flat = np.abs(area) < 1e-12
    inverse = 1 / np.where(flat, 1.0, area)
    g = np.empty((len(corners), 2, 3))
    for i, (p, q) in enumerate(((b, c), (c, a))):
        g[:, i, 0], g[:, i, 1] = (p - q)[:, 1] * inverse, (q - p)[:, 0] * inverse
        g[:, i, 2] = -(q[:, 0] * g[:, i, 0] + q[:, 1] * g[:, i, 1])
    g[flat] = [0.0, 0.0, -1.0]
    return g


def _weights(g: Array, t: Index, x: Index, y: Index) -> tuple[Array, Array, Array]:
    """Barycentric coordinates, each (k,), of the middle of samples x, y (k,) in triangles t (k,)."""
    px, py = x + 0.5, y + 0.5
    one = g[t, 0, 0] * px + g[t, 0, 1] * py + g[t, 0, 2]
    two = g[t, 1, 0] * px + g[t, 1, 1] * py + g[t, 1, 2]
    return one, two, 1 - one - two
