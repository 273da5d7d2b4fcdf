"""Mapped hexahedra of 27 nodes of single members, from their true contours.

A mesh of the section, of the unit square or disc, is carried along the member and scaled with its sizes at every
station. Axes are those of the member: x from its first end, y along the width, z along the thickness.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from flexura.arrays import Array, Index
from flexura.fem.geometry import MemberShape
from flexura.fem.solid_mesh import shape_of

KIND = "hexahedron27"
CONTOUR_SAMPLES = 4000
"""Points at which a contour is followed to place the stations of the mesh."""
THIN_STRIP = 0.25
"""A strip thinner than so many times its width has one cell across its thickness: 27-node cells bend as they should."""
CELLS_PER_RADIAN = 3.0
"""Cells along an arc for every radian that it turns."""
UNEVEN = 0.27
"""Least part of a cell's length on one side of its middle."""


def shape_cells(shape: MemberShape, size: float = 1.0) -> tuple[Array, Index]:
    """Points (n, 3) and cells (c, 27) of a member of unit length; `size` scales the cells."""
    face, quads = section_mesh(shape, size)
    x = stations(shape, size)
    along_y, along_z = shape.at(x)
    n = len(face)
    points = np.empty((len(x), n, 3))
    points[..., 0] = x[:, None]
    points[..., 1] = along_y[:, None] * face[:, 0]
    points[..., 2] = along_z[:, None] * face[:, 1]
    return points.reshape(-1, 3), layered(quads, n, len(x) // 2)


def layered(quads: Index, n: int, layers: int) -> Index:
    """Hexahedra (c, 27) on quadrilaterals (q, 9) of n points, three rows of three, in layers of three levels each."""
    across, up, on = (shape_of(KIND).points.astype(int) + 1).T
    levels = 2 * np.arange(layers)[:, None, None] + on
    return (quads[:, 3 * up + across] + n * levels).reshape(-1, 27)


def stations(shape: MemberShape, size: float = 1.0) -> Array:
    """Fractions (2 n + 1,) of the length at which the points of n cells lie.

    Cells are as long along the contour as sqrt(h L)/3, h the lesser size of the section and L the length: a notch of
    radius R with the web t is at its thinnest over about sqrt(R t). Towards the ends they shrink to the size of the
    end.
    """
    breaks, stations = shape.breaks, [np.zeros(1)]
    turn = (1 - np.cos(np.pi * np.arange(CONTOUR_SAMPLES + 1) / CONTOUR_SAMPLES)) / 2
    for first, last in pairwise(breaks):
        x = first + (last - first) * turn
        y, z = shape.at(np.clip(x, first + 1e-12, last - 1e-12))
        h = np.minimum(y, z)
        step = np.sqrt(np.diff(x) ** 2 + (np.diff(y) ** 2 + np.diff(z) ** 2) / 4)
        middle, depth = (x[1:] + x[:-1]) / 2, (h[1:] + h[:-1]) / 2
        end_y, end_z = shape.at(np.array([0.0, 1.0]))
        end = np.minimum(end_y, end_z)
        density = 3 / np.sqrt(depth) + 0.7 / (middle + end[0]) + 0.7 / (1 - middle + end[1])
        turned = sum(abs(np.gradient(np.arctan2(np.diff(side) / 2, np.diff(x)))) for side in (y, z))
        count = np.concatenate([[0.0], np.cumsum(density * step + CELLS_PER_RADIAN * turned)])
        cells = max(1, round(count[-1] / size))
        stations.append(np.interp(np.linspace(0, count[-1], 2 * cells + 1)[1:], count, x))
    return _centred(shape, np.concatenate(stations))


def _centred(shape: MemberShape, x: Array) -> Array:
    """Stations with the middle points of cells in their middle, but for those on flanks steeper than 45 degrees.

    Cells that are stretched unevenly cannot bend as well as others, and at a quarter of their length they fold.
    """
    x = x.copy()
    y, z = shape.at(x)
    rise = np.maximum(abs(y[2::2] - y[:-2:2]), abs(z[2::2] - z[:-2:2])) / 2
    is_flat = rise < x[2::2] - x[:-2:2]
    step = x[2::2] - x[:-2:2]
    part = np.clip((x[1::2] - x[:-2:2]) / step, UNEVEN, 1 - UNEVEN)
    x[1::2] = x[:-2:2] + np.where(is_flat, 0.5, part) * step
    return x


def section_mesh(shape: MemberShape, size: float = 1.0) -> tuple[Array, Index]:
    """Points (n, 2) of the section in units of its sizes along y and z, and quadrilaterals (q, 9), three rows of three
    points each along y."""
    if shape.family == "rectangle":
        x = stations(shape)
        y, z = shape.at(x)
        thin = np.argmin(np.minimum(y, z))
        aspect = float(y[thin] / z[thin])
        notched = (bool(np.ptp(y) > 0), bool(np.ptp(z) > 0))
        cells = [_across(*each, size) for each in zip((aspect, 1 / aspect), notched, strict=True)]
        return _patch(*(_towards_edges(n) for n in cells))
    round_cells = max(1, round(1 / size))
    return _ring(shape.bore, round_cells) if shape.bore else _disc(1 + 2 * round_cells, round_cells)


def _across(ratio: float, notched: bool, size: float) -> int:
    """Cells along a side of the section that is `ratio` times the other."""
    least = 3 if notched else 1 if ratio < THIN_STRIP else 2
    return max(1, round((least + np.log2(max(ratio, 1.0))) / size))


def _towards_edges(cells: int) -> Array:
    """Positions (2 cells + 1,) from -1/2 to 1/2, closer at both; every other one is in the middle of its neighbours."""
    s = np.linspace(-1, 1, cells + 1)
    lines = (0.5 * s + 0.5 * np.sin(np.pi * s / 2)) / 2
    return np.interp(np.arange(2 * cells + 1) / 2, np.arange(cells + 1), lines)


def _patch(y: Array, z: Array) -> tuple[Array, Index]:
    """A grid of quadrilaterals on lines (2 n + 1,) and (2 m + 1,)."""
    points = np.stack(np.meshgrid(y, z, indexing="xy"), axis=-1).reshape(-1, 2)
    return points, _grid(len(y) // 2, len(z) // 2)


def _grid(n: int, m: int) -> Index:
    """Quadrilaterals (n m, 9) on a grid of (2 m + 1) rows of 2 n + 1 points."""
    row = 2 * n + 1
    corner = (2 * row * np.arange(m)[:, None] + 2 * np.arange(n)).reshape(-1, 1)
    return corner + (row * np.arange(3)[:, None] + np.arange(3)).ravel()


def _ring(bore: float, cells: int) -> tuple[Array, Index]:
    """An annulus of outer diameter one."""
    n = 12 * cells
    angle = 2 * np.pi * np.linspace(0, 1, 2 * n + 1)
    radius = np.linspace(1, bore, 2 * cells + 1)[:, None] / 2
    return _merged(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1).reshape(-1, 2), _grid(n, cells))


def _disc(n: int, cells: int) -> tuple[Array, Index]:
    """A disc of diameter one: a square of n x n cells with four patches of n x cells around it."""
    s = np.linspace(-1, 1, 2 * n + 1)
    inner = 0.25 * s
    points, quads = _patch(inner, inner)
    pieces, cell_list = [points], [quads]
    side = np.column_stack([inner, np.full(len(s), inner[-1])])
    arc = np.column_stack([np.sin(np.pi / 4 * s), np.cos(np.pi / 4 * s)]) / 2
    out = np.linspace(0, 1, 2 * cells + 1)[:, None, None]
    patch = (out * arc + (1 - out) * side).reshape(-1, 2)
    for quarter in range(4):
        angle = quarter * np.pi / 2
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        cell_list.append(_grid(n, cells) + sum(map(len, pieces)))
        pieces.append(patch @ turn)
    return _merged(np.concatenate(pieces), np.concatenate(cell_list))


def _merged(points: Array, quads: Index) -> tuple[Array, Index]:
    """Points that coincide made one."""
    _, first, number = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    return points[first], number.ravel()[quads]
