"""A depth buffer in NumPy: triangles and lines to an image in which nearer ones hide farther ones, pixel by pixel.

Shapes are cut into rows of samples, all at once; a sample has one integer that is the larger, the nearer the surface,
and says whose it is, so that the largest wins. Lines are smooth, and so are surfaces whose outlines are drawn.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.view.scene import Array, Index

_CHUNK = 1 << 16
"""Samples that are worked on at once, few enough to stay in the cache of a processor."""
_TOUCH = 1e-9
"""Samples so near to an edge, relative to a pixel, are inside."""
_TIE = 1 / 32
"""Surfaces no farther behind each other, pixels, may be at one depth, where the one that is drawn last is seen."""
_ONE_LINE = 3.0
"""Lines no farther behind each other, pixels, are parts of one line."""


class Triangles(NamedTuple):
    """Triangles in a picture.

    corners: (t, 3, 3), x to the right, y up, z towards the viewer, pixels; colours: (t, 3, 3), RGB at the corners.
    """

    corners: Array
    colours: Array


class Lines(NamedTuple):
    """Straight lines in a picture: ends (l, 2, 3), pixels, colours (l, 3), RGB, and widths (l,), pixels.

    They have round ends and face the viewer.
    """

    ends: Array
    colours: Array
    width: Array


class Painting(NamedTuple):
    """What an image is made of; `glass` lets what is behind it show through."""

    solid: Triangles
    lines: Lines
    glass: Triangles

    @staticmethod
    def of(solid: Iterable[Triangles] = (), lines: Iterable[Lines] = (), glass: Iterable[Triangles] = ()) -> Painting:
        """All triangles and lines of several sets."""
        nothing = Triangles(np.empty((0, 3, 3)), np.empty((0, 3, 3)))
        one, two = (Triangles(*map(np.concatenate, zip(nothing, *sets, strict=True))) for sets in (solid, glass))
        empty = Lines(np.empty((0, 2, 3)), np.empty((0, 3)), np.empty(0))
        return Painting(one, Lines(*map(np.concatenate, zip(empty, *lines, strict=True))), two)

    def enlarged(self, factor: float) -> Painting:
        """The same, so many times as large."""
        solid, glass = (Triangles(factor * some.corners, some.colours) for some in (self.solid, self.glass))
        lines = self.lines
        return Painting(solid, Lines(factor * lines.ends, lines.colours, factor * lines.width), glass)

    @staticmethod
    def joined(paintings: Iterable[Painting]) -> Painting:
        """Several paintings in one."""
        every = list(paintings)
        return Painting.of((p.solid for p in every), (p.lines for p in every), (p.glass for p in every))


def of_faces(corners: Array, colours: Array) -> Triangles:
    """Triangles of faces with corners (f, 4, 3), pixels, and colours at the corners (f, 4, 3)."""
    halves = [[0, 1, 2], [0, 2, 3]]
    return Triangles(corners[:, halves].reshape(-1, 3, 3), colours[:, halves].reshape(-1, 3, 3))


def render(
    painting: Painting, width: int, height: int, *, opacity: float = 0.55
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Image (height, width, 4), RGBA with the lowest row first, and depth (height, width), pixels, of what is opaque.

    The background is transparent and infinitely far (-inf).
    """
    image = np.full(height * width, _NOTHING, dtype=np.uint32)
    surface = np.full(height * width, -np.inf, dtype=np.float32)
    pixel, rgb, z = _nearest(painting.solid, width, height)
    image[pixel], surface[pixel] = _packed(rgb), z
    strokes = _strokes(painting.lines, width, height, surface)
    pixel, rgb, z = _nearest(painting.glass, width, height)
    seen = z > surface[pixel] + _TIE
    pane = pixel[seen], rgb[seen], z[seen]
    is_touched = np.zeros(len(image), dtype=bool)
    is_touched[strokes.pixel] = is_touched[pane[0]] = True
    touched = np.flatnonzero(is_touched)
    image[touched] = _blended(_unpacked(image[touched]), touched, strokes, pane, opacity)
    return image.view(np.uint8).reshape(height, width, 4), surface.reshape(height, width)


def _blended(
    image: NDArray[np.float32],
    where: Index,
    strokes: _Strokes,
    pane: tuple[Index, NDArray[np.float32], NDArray[np.float32]],
    opacity: float,
) -> NDArray[np.uint32]:
    """Pixels (n, 4), premultiplied RGBA, under strokes and glass, with glass before some of the strokes.

    where: (n,), which pixels of the picture they are; pane: which of them are seen through glass (k,), its
    colours (k, 3) and depth (k,).
    """
    pixel, rgb, z = pane
    strokes = strokes._replace(pixel=np.searchsorted(where, strokes.pixel))
    if len(pixel):
        at = np.searchsorted(where, pixel)
        glass = np.full(len(where), -np.inf, dtype=np.float32)
        glass[at] = z
        behind = strokes.z < glass[strokes.pixel]
        _laid(image, strokes.of(behind))
        strokes = strokes.of(~behind)
        image[at] *= np.float32(1 - opacity)
        image[at, :3] += np.float32(opacity) * rgb
        image[at, 3] += np.float32(opacity)
    _laid(image, strokes)
    image[:, :3] /= image[:, 3:]
    return _packed(image)


_NOTHING = np.frombuffer(b"\xff\xff\xff\x00", dtype=np.uint32)[0]
"""A transparent pixel, white."""


def _packed(colours: NDArray[np.float32]) -> NDArray[np.uint32]:
    """RGB (k, 3), opaque, or RGBA (k, 4), as pixels of four bytes (k,)."""
    pixels = np.full((len(colours), 4), 255, dtype=np.uint8)
    for begin in range(0, len(colours), _CHUNK):
        piece = slice(begin, begin + _CHUNK)
        pixels[piece, : colours.shape[1]] = (colours[piece] * np.float32(255) + np.float32(0.5)).clip(0, 255)
    return pixels.view(np.uint32)[:, 0]


def _unpacked(pixels: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Premultiplied RGBA (k, 4) of pixels (k,) that are opaque or transparent."""
    colours = (pixels.view(np.uint8).reshape(-1, 4) / np.float32(255)).astype(np.float32)
    colours *= colours[:, 3:]
    return colours


class _Rows(NamedTuple):
    """Rows of samples of convex shapes: whose they are (r,), their y (r,), first x (r,) and number (r,)."""

    owner: Index
    y: Index
    x: Index
    count: Index


def _rows(corners: Array, sides: Array, w: int, h: int) -> _Rows:
    """Samples of convex shapes with corners (t, k, 2) whose inside is where the sides (t, k, 3), a x + b y + c, are
    at least 0."""
    y = corners[..., 1]
    low = np.ceil(y.min(axis=1) - 0.5).clip(0, h).astype(np.intp)
    high = np.floor(y.max(axis=1) - 0.5).clip(-1, h - 1).astype(np.intp)
    rows = np.maximum(high - low + 1, 0)
    owner = np.repeat(np.arange(len(rows)), rows)
    at = np.arange(len(owner)) - np.repeat(np.cumsum(rows) - rows - low, rows)
    first, last = np.full(len(owner), -1.0), np.full(len(owner), w + 1.0)
    for a, b, c in np.moveaxis(sides, (1, 2), (0, 1)):
        with np.errstate(divide="ignore", invalid="ignore"):
            edge = (-c / a)[owner] - (b / a)[owner] * (at + 0.5)
        rises, falls = (a > 0)[owner], (a < 0)[owner]
        np.maximum(first, edge, out=first, where=rises)
        np.minimum(last, edge, out=last, where=falls)
        level = ~(rises | falls)
        last[level & (b[owner] * (at + 0.5) + c[owner] < -_TOUCH)] = -1.0
    x = np.ceil(first - 0.5 - _TOUCH).clip(0, w).astype(np.intp)
    count = np.floor(last - 0.5 + _TOUCH).clip(-1, w - 1).astype(np.intp) - x + 1
    kept = np.flatnonzero(count > 0)
    return _Rows(owner[kept], at[kept], x[kept], count[kept])


def _samples(rows: _Rows) -> Iterator[tuple[Index, Index]]:
    """The row (k,) and the x (k,) of all samples, in pieces."""
    bounds = np.flatnonzero(np.diff(np.cumsum(rows.count) // _CHUNK)) + 1
    for piece in np.split(np.arange(len(rows.count)), bounds):
        count = rows.count[piece]
        row = np.repeat(piece, count)
        yield row, np.arange(len(row)) - np.repeat(np.cumsum(count) - count - rows.x[piece], count)


class _Front(NamedTuple):
    """What is nearest in a picture: pixels (k,) that a triangle covers, which triangle (k,), and its depth (k,)."""

    pixel: Index
    owner: Index
    z: NDArray[np.float32]


def nearest_triangles(triangles: Triangles, width: int, height: int) -> Index:
    """Which triangle is nearest, (k,), for each of the pixels that any covers."""
    corners = triangles.corners
    return _front(corners, *_sides(corners[..., :2]), width, height).owner


def _front(corners: Array, area: Array, sides: Array, w: int, h: int) -> _Front:
    """The nearest of triangles (t, 3, 3) with the areas and sides of `_sides`; those seen edge-on are left out."""
    kept = np.flatnonzero(np.abs(area) > 1e-9)
    inside = _inside(corners[kept, :, :2].reshape(-1, 2), w, h)
    if inside is None:
        return _Front(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp), np.empty(0, dtype=np.float32))
    left, low, wide, high = inside
    z, sides, area = corners[kept, :, 2], sides[kept], area[kept]
    least = float(z.min())
    bits = len(kept).bit_length()
    step = 2.0 ** (61 - bits) / (float(z.max()) - least + _TIE)
    # a value at the corners, times the side opposite each, over the area, is linear over the triangle
    plane = np.einsum("tk,tkc->tc", (z - least) / area[:, None], sides)
    lift = np.linspace(0.0, _TIE, len(kept))
    plane[:, 2] += lift
    rows = _rows(corners[kept, :, :2], sides * np.sign(area)[:, None, None], w, h)
    begin = plane[rows.owner, 1] * (rows.y + 0.5) + plane[rows.owner, 2] + 0.5 * plane[rows.owner, 0]
    slope = plane[rows.owner, 0]
    best = np.full(high * wide, -1, dtype=np.int64)
    first = (rows.y - low) * wide - left
    for row, x in _samples(rows):
        depth = (begin[row] + slope[row] * x) * step
        key = (depth.clip(0, 2.0 ** (62 - bits)).astype(np.int64) << bits) | rows.owner[row]
        np.maximum.at(best, first[row] + x, key)
    at = np.flatnonzero(best >= 0)
    keys = best[at]
    y, x = np.divmod(at, wide)
    triangle = keys & ((1 << bits) - 1)
    return _Front(
        (y + low) * w + x + left, kept[triangle], ((keys >> bits) / step + least - lift[triangle]).astype(np.float32)
    )


def _inside(points: Array, w: int, h: int) -> tuple[int, int, int, int] | None:
    """The part of a picture that points (n, 2) span: first column and row, and how many of both; None when it is
    empty."""
    if not len(points):
        return None
    low = np.floor(points.min(axis=0)).clip(0, (w, h)).astype(int)
    size = np.ceil(points.max(axis=0)).clip(0, (w, h)).astype(int) - low
    return None if (size <= 0).any() else (int(low[0]), int(low[1]), int(size[0]), int(size[1]))


def _nearest(triangles: Triangles, w: int, h: int) -> tuple[Index, NDArray[np.float32], NDArray[np.float32]]:
    """Pixels (k,) that a triangle covers, the colour (k, 3) of the nearest one there, and its depth (k,)."""
    area, sides = _sides(triangles.corners[..., :2])
    pixel, owner, z = _front(triangles.corners, area, sides, w, h)
    if not len(pixel):
        return pixel, np.empty((0, 3), dtype=np.float32), z
    share = triangles.colours / np.where(area == 0, 1.0, area)[:, None, None]
    slopes = np.einsum("tkr,tkc->tcr", share, sides).astype(np.float32)
    rgb = np.empty((len(pixel), 3), dtype=np.float32)
    for begin in range(0, len(pixel), _CHUNK):
        piece = slice(begin, begin + _CHUNK)
        plane = slopes[owner[piece]]
        y, x = (at.astype(np.float32) + np.float32(0.5) for at in np.divmod(pixel[piece], w))
        (plane[:, 0] * x[:, None] + plane[:, 1] * y[:, None] + plane[:, 2]).clip(0.0, 1.0, out=rgb[piece])
    return pixel, rgb, z


def _sides(corners: Array) -> tuple[Array, Array]:
    """Twice the signed area (t,) of triangles, and the lines (t, 3, 3), a x + b y + c, opposite their corners, each as
    large at its corner as that."""
    p, q = corners[:, [1, 2, 0]], corners[:, [2, 0, 1]]
    a, b = (p - q)[..., 1], (q - p)[..., 0]
    sides = np.stack([a, b, p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]], axis=-1)
    return sides[..., 2].sum(axis=1), sides


class _Strokes(NamedTuple):
    """Samples of lines: where they are (k,), depth (k,), how much of a sample is covered (k,), and colour (k, 3)."""

    pixel: Index
    z: Array
    cover: NDArray[np.float32]
    colour: NDArray[np.float32]

    def of(self, which: Index | NDArray[np.bool_]) -> _Strokes:
        """Some of them."""
        return _Strokes(self.pixel[which], self.z[which], self.cover[which], self.colour[which])


def _strokes(lines: Lines, w: int, h: int, surface: NDArray[np.float32]) -> _Strokes:
    """Samples of lines that are not behind the surface (h * w,)."""
    ends, half = lines.ends, lines.width / 2
    span = ends[:, 1, :2] - ends[:, 0, :2]
    length = np.linalg.norm(span, axis=1, keepdims=True)
    along = np.where(length > 1e-9, span / np.maximum(length, 1e-9), [1.0, 0.0])
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    margin = (half + 0.5)[:, None]
    low, high = ends[:, 0, :2] - margin * along, ends[:, 1, :2] + margin * along
    corners = np.stack(
        [low - margin * across, high - margin * across, high + margin * across, low + margin * across], 1
    )
    sides = np.empty((len(ends), 4, 3))
    for k, normal in enumerate((across, -along, -across, along)):
        sides[:, k, :2], sides[:, k, 2] = normal, -np.einsum("ij,ij->i", normal, corners[:, k])
    rows = _rows(corners, sides, w, h)
    samples = []
    for row, x in _samples(rows):
        line = rows.owner[row]
        apart = np.stack([x + 0.5, rows.y[row] + 0.5], axis=-1) - ends[line, 0, :2]
        on = np.einsum("ij,ij->i", apart, along[line])
        off = np.einsum("ij,ij->i", apart, across[line])
        beyond = on - on.clip(0.0, length[line, 0])
        cover = (half[line] + 0.5 - np.hypot(off, beyond)).clip(0.0, np.minimum(2 * half[line], 1.0))
        share = ((on - beyond) / np.maximum(length[line, 0], 1e-9)).clip(0.0, 1.0)
        z = ends[line, 0, 2] + share * (ends[line, 1, 2] - ends[line, 0, 2])
        pixel = rows.y[row] * w + x
        kept = (cover > 0) & (z >= surface[pixel])
        line = line[kept]
        samples.append((pixel[kept], z[kept], cover[kept].astype(np.float32), lines.colours[line].astype(np.float32)))
    return _Strokes(*map(np.concatenate, zip(*samples, strict=True)))


def _laid(image: NDArray[np.float32], strokes: _Strokes) -> None:
    """Lay samples of lines over an image (n, 4), premultiplied RGBA, the farthest first.

    Where lines of one depth overlap, as at the corners of a path, they cover as much as the one that covers most.
    """
    if not len(strokes.pixel):
        return
    order = np.lexsort((strokes.z, strokes.pixel))
    pixel, z, cover, colour = strokes.of(order)
    starts = np.flatnonzero(np.diff(pixel, prepend=-1))
    count = np.diff(starts, append=len(pixel))
    covered, depth = np.zeros(len(starts), dtype=np.float32), np.full(len(starts), -np.inf)
    for layer in range(int(count.max())):
        deep = np.flatnonzero(count > layer)
        k = starts[deep] + layer
        before = np.where(z[k] - depth[deep] < _ONE_LINE, covered[deep], np.float32(0.0))
        more = np.maximum(cover[k], before)
        alpha = ((more - before) / np.maximum(1 - before, np.float32(1e-6)))[:, None].clip(0.0, 1.0)
        covered[deep], depth[deep] = more, z[k]
        at = pixel[k]
        image[at] *= 1 - alpha
        image[at, :3] += alpha * colour[k]
        image[at, 3] += alpha[:, 0]
