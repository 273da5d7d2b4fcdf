"""Structured meshes of boxes, built by hand."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from flexura.fem.geometry import SolidMaterial
from flexura.fem.solid_mesh import SolidMesh, shape_of

ALUMINIUM = SolidMaterial("aluminium", 71.7e9, 0.33, 2810.0)

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
KUHN = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
"""Six tetrahedra round the diagonal of a cube (Kuhn 1960), all the right way round."""


def local_points(kind):
    """Coordinates (cells, points, 3), in 0 .. 2 along each side, of the cells of one kind in a cube."""
    points = shape_of(kind).points
    if kind != "tetra10":
        return np.round(points + 1).astype(int)[None]
    corners = 2 * np.array(CORNERS)[np.array(KUHN)]
    weights = np.column_stack([1 - points.sum(axis=1), points])
    return np.round(weights @ corners).astype(int)


def grid(kind, *boxes):
    """Points (n, 3) and cells of boxes, each three lists of ascending coordinates; equal points of them are one."""
    local = local_points(kind)
    places, cells, count = [], [], 0
    for ticks in boxes:
        fine = [np.sort(np.append(t, [(a + b) / 2 for a, b in pairwise(t)])) for t in ticks]
        at = np.meshgrid(*(2 * np.arange(len(t) - 1) for t in ticks), indexing="ij")
        ijk = np.stack(at, axis=-1).reshape(-1, 1, 1, 3) + local
        places.append(np.stack([fine[k][ijk[..., k]] for k in range(3)], axis=-1).reshape(-1, 3))
        cells.append(count + np.arange(len(places[-1])).reshape(-1, local.shape[1]))
        count += len(places[-1])
    everywhere = np.concatenate(places)
    _, first, number = np.unique(np.round(everywhere / 1e-9), axis=0, return_index=True, return_inverse=True)
    return everywhere[first], number.reshape(-1)[np.concatenate(cells)]


def mesh_of(kind, points, cells, sets=None, material=ALUMINIUM):
    """Return a mesh of one kind of cells and one material."""
    return SolidMesh(points, {kind: cells}, {kind: np.zeros(len(cells), int)}, (material,), sets or {})


def box(kind, size, counts, sets=(), material=ALUMINIUM):
    """Return a mesh of a box from the origin, with the point sets x0, x1, y0, ... of its faces."""
    points, cells = grid(kind, [np.linspace(0, s, n + 1) for s, n in zip(size, counts, strict=True)])
    found = {}
    for k, axis in enumerate("xyz"):
        found[axis + "0"] = np.flatnonzero(points[:, k] < 1e-9 * size[k])
        found[axis + "1"] = np.flatnonzero(points[:, k] > (1 - 1e-9) * size[k])
    return mesh_of(kind, points, cells, found, material)


def distorted(mesh, amount, seed=0):
    """The mesh with inner corners of its cells moved by a part of the mean cell size, middles kept in the middle."""
    kind = next(iter(mesh.cells))
    cells, shape = mesh.cells[kind], shape_of(kind)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    corner = np.zeros(len(mesh.points), bool)
    corner[cells[:, : shape.corners]] = True
    inside = corner & ((mesh.points > low + 1e-9) & (mesh.points < high - 1e-9)).all(axis=1)
    size = np.prod(high - low) ** (1 / 3) / len(cells) ** (1 / 3)
    moved = mesh.points.copy()
    moved[inside] += amount * size * np.random.default_rng(seed).uniform(-1, 1, (inside.sum(), 3))
    reference = shape.points[: shape.corners]
    if kind == "tetra10":
        onto = np.column_stack([1 - shape.points.sum(axis=1), shape.points])
    else:
        onto = np.prod(1 + shape.points[:, None, :] * reference, axis=2) / 8
    moved[cells] = onto @ moved[cells[:, : shape.corners]]
    return SolidMesh(moved, mesh.cells, mesh.cell_materials, mesh.materials, mesh.point_sets)


def leaf_and_block(kind, leaf_counts, block_layers):
    """A 10 x 10 x 0.3 mm leaf along x, clamped at the set `clamped`, with a 10 x 10 x 8 mm block beyond it."""
    nx, ny, nz = leaf_counts
    L, B, T, H = 10e-3, 10e-3, 0.3e-3, 8e-3
    thin = np.linspace(-T / 2, T / 2, nz + 1)
    above = T / 2 + (H - T) / 2 * np.linspace(0, 1, block_layers + 1) ** 2
    y = np.linspace(0, B, ny + 1)
    x = L * (1 - np.cos(np.linspace(0, np.pi, nx + 1))) / 2
    beyond = L + B * np.linspace(0, 1, block_layers + 2) ** 1.5
    whole = np.concatenate([-above[:0:-1], thin, above[1:]])
    points, cells = grid(kind, (x, y, thin), (beyond, y, whole))
    return mesh_of(kind, points, cells, {"clamped": np.flatnonzero(points[:, 0] < 1e-9)})
