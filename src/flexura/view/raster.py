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

    `lift` moves them towards the viewer, pixels, so that lines on a surface are not buried in it.
    """
    along = ends[:, 1, :2] - ends[:, 0, :2]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.where(length > 1e-9, along / np.maximum(length, 1e-9), [1.0, 0.0]) * width[:, None] / 2
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    corners = ends[:, [0, 1, 1, 0]].copy()
    corners[:, :, 2] += lift
    corners[:, [0, 3], :2] -= along[:, None]
    corners[:, [1, 2], :2] += along[:, None]
    corners[:, :2, :2] -= across[:, None]
    corners[:, 2:, :2] += across[:, None]
    return of_faces(corners, np.repeat(colours[:, None], 4, axis=1))


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
    premultiplied = np.column_stack([colour * alpha[:, None], alpha]).reshape(height, n, width, n, 4).mean(axis=(1, 3))
    opaque = premultiplied[..., 3:]
    image = np.concatenate([np.where(opaque > 0, premultiplied[..., :3] / np.maximum(opaque, 1e-9), 1.0), opaque], -1)
    return image.clip(0.0, 1.0), surface.reshape(height, n, width, n)[:, 0, :, 0]


def _nearest(triangles: Triangles, w: int, h: int, depth: Array) -> tuple[Index, Array]:
    """Samples (k,) at which one of the triangles is the nearest surface, and its colours (k, 3) there.

    depth: (h * w,), raised to that of the triangles.
    """
    corners = triangles.corners * [OVERSAMPLING, OVERSAMPLING, 1.0]
    low = np.ceil(corners[..., :2].min(axis=1) - 0.5).clip(0, None).astype(np.intp)
    high = np.floor(corners[..., :2].max(axis=1) - 0.5).clip(None, [w - 1, h - 1]).astype(np.intp)
    box = np.maximum(high - low + 1, 0)
    samples = box[:, 0] * box[:, 1]
    kept = np.flatnonzero(samples)
    g = _gradients(corners)
    owner = np.full(h * w, -1, dtype=np.intp)
    bounds = np.flatnonzero(np.diff(np.cumsum(samples[kept]) // _CHUNK)) + 1
    for chunk in np.split(kept, bounds):
        t = np.repeat(chunk, samples[chunk])
        k = np.arange(len(t)) - np.repeat(np.cumsum(samples[chunk]) - samples[chunk], samples[chunk])
        x, y = low[t, 0] + k % box[t, 0], low[t, 1] + k // box[t, 0]
        weights = _weights(g[t], x, y)
        inside = (weights >= -1e-9).all(axis=1)
        t, pixel = t[inside], (y * w + x)[inside]
        z = np.einsum("ij,ij->i", weights[inside], corners[t, :, 2])
        np.maximum.at(depth, pixel, z)
        first = z >= depth[pixel]
        owner[pixel[first]] = t[first]
    pixel = np.flatnonzero(owner >= 0)
    t = owner[pixel]
    weights = _weights(g[t], pixel % w, pixel // w)
    return pixel, np.einsum("ij,ijk->ik", weights, triangles.colours[t])


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


def _weights(g: Array, x: Index, y: Index) -> Array:
    """Barycentric coordinates (k, 3) in the middle of samples x, y (k,), gradients g (k, 2, 3)."""
    out = np.empty((len(g), 3))
    for i in range(2):
        out[:, i] = g[:, i, 0] * (x + 0.5) + g[:, i, 1] * (y + 0.5) + g[:, i, 2]
    out[:, 2] = 1 - out[:, 0] - out[:, 1]
    return out
