"""The outer side of a mesh of others: sides that belong to one cell, divided into faces by bends and by named sets."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Index
from flexura.fem.mesh_files import CORNERS, Cells, MeshFile, sorted_sides
from flexura.fem.solid_mesh import EDGES, SIDES
from flexura.tables import in_mm

BEND = np.radians(30.0)
"""Angle by which normals turn across an edge, from which it parts two faces."""

FLAT = 1e-9
"""Volume of a cell over the cube of its longest edge from which it is one."""

ACROSS: dict[int, tuple[tuple[float, ...], tuple[float, ...]]] = {
    3: ((-0.5, -0.5, -1.0), (-2.0, 2.0, 2.0)),
    4: ((-0.5, -0.5, -0.5, -0.5), (-0.5, 1.0, 0.5, 1.0)),
}
"""Slope across an edge in its middle, by corners and middles of a triangle or quadrilateral that begin with it."""


def handed(block: Cells, points: Array) -> Array:
    """1 or -1 of each cell (c,), for the side of its base on which its other corners are, 0 of flat ones."""
    x = points[block.points[:, : CORNERS[block.shape]]]
    base = 4 if block.shape in ("hexahedron", "pyramid") else 3
    ring = x[:, :base] - x[:, :base].mean(axis=1, keepdims=True)
    normal = np.cross(ring, np.roll(ring, -1, axis=1)).sum(axis=1)
    height = np.einsum("ci,ci->c", normal, x[:, base:].mean(axis=1) - x[:, :base].mean(axis=1))
    longest = np.ptp(x, axis=1).max(axis=1)
    return np.where(np.abs(height) > FLAT * longest**3, np.sign(height), 0.0)


def outer_sides(blocks: Sequence[Cells], points: Array) -> tuple[Index, Index, Index]:
    """Sides (s, 4) that belong to one cell, from outside anticlockwise, triangles with their last corner twice, the
    positions of their cells, and pairs (i, 2) of cells that share a side. ValueError where more than two share one."""
    sides, owners, start = [], [], 0
    for block in blocks:
        own = block.points[:, np.array(SIDES[block.shape])]
        if handed(block, points).sum() < 0:
            own = own[..., [1, 0, 3, 2]]
        sides.append(own.reshape(-1, 4))
        owners.append(np.repeat(start + np.arange(len(own)), own.shape[1]))
        start += len(own)
    corners, owner = np.concatenate(sides), np.concatenate(owners)
    _, first, inverse, count = np.unique(
        sorted_sides(corners), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    if count.max() > 2:
        k = first[count.argmax()]
        place = in_mm(points[corners[k]].mean(axis=0))
        raise ValueError(f"{count.max()} cells share a side near {place} mm: cells are there twice, or lie over others")
    order = np.argsort(inverse.ravel(), kind="stable")
    shared = order[np.flatnonzero(np.repeat(count == 2, count))].reshape(-1, 2)
    outer = np.sort(first[count == 1])
    return corners[outer], owner[outer], owner[shared]


def pieces_of(n: int, pairs: Index) -> tuple[int, Index]:
    """How many pieces n things make that hang together by pairs (p, 2), and the piece (n,) of each."""
    count, of = connected_components(sp.coo_matrix((np.ones(len(pairs)), pairs.T), shape=(n, n)), directed=False)
    return count, of.astype(np.intp)


class Edges(NamedTuple):
    """All edges: ends (e, 2), ascending, and in this order, the points in their middles (e,), else -1, and places."""

    ends: Index
    middle: Index
    places: Array


def edges_of(blocks: Sequence[Cells], points: Array) -> Edges:
    """The edges of cells, with points (n, 3) in their middles where cells have these."""
    ends, middle = [], []
    for block in blocks:
        own = block.points[:, np.array(EDGES[block.shape])]
        ends.append(own.reshape(-1, 2))
        given = block.points[:, CORNERS[block.shape] :]
        middle.append(given.ravel() if given.size else np.full(own[..., 0].size, -1))
    edges, first = np.unique(np.sort(np.concatenate(ends), axis=1), axis=0, return_index=True)
    found = np.concatenate(middle)[first]
    places = np.where(found[:, None] >= 0, points[found], points[edges].mean(axis=1))
    return Edges(edges, found, places)


def joined_names(names: Iterable[str], member: Iterable[bool]) -> str:
    """Those names of sets that something is a member of."""
    return " + ".join(name for name, is_in in zip(names, member, strict=True) if is_in)


def named_faces(
    file: MeshFile, points: Array, outer: Index, solid: Index, edges: Edges
) -> tuple[Index, tuple[str, ...], dict[str, str]]:
    """Number of the face of each outer side, names of faces, and sets that have no outer side."""
    sides = sorted_sides(outer)
    position = {tuple(side): k for k, side in enumerate(sides.tolist())}
    by = [len(points), 1]
    number = np.searchsorted(edges.ends @ by, np.sort(_side_edges(outer), axis=-1) @ by)
    middle = edges.middle[number]
    sets: dict[str, Index] = {}
    empty = {}
    for name, own in file.side_sets.items():
        keys = [tuple(side) for side in own.tolist()]
        sets[name] = np.array([position[key] for key in keys if key in position], dtype=np.intp)
        if not len(sets[name]):
            empty[name] = f"its {len(own)} sides lie inside the mesh"
    for name, own in file.point_sets.items():
        inside = np.zeros(len(points), dtype=bool)
        inside[own] = True
        held = inside[outer]
        if inside[middle[middle >= 0]].any():  # points in the middle of edges count where the set has any
            held &= inside[middle] | (middle < 0)
        found = np.flatnonzero(held.all(axis=1))
        sets[name] = np.union1d(sets.get(name, found), found)
        if not len(found):
            empty[name] = f"none of its {len(own)} points hold a whole side of a cell"
    for name, own in file.cell_sets.items():
        empty[name] = f"it is of {len(own)} solid cells, which `solids` may give a material"
    empty = {name: why for name, why in empty.items() if not len(sets.get(name, []))}
    sets = {name: own for name, own in sets.items() if 0 < len(own) < len(outer)}
    member = np.zeros((len(outer), len(sets)), dtype=bool)
    for k, own in enumerate(sets.values()):
        member[own, k] = True
    kind = np.unique(np.column_stack([member, solid]), axis=0, return_inverse=True)[1].ravel()
    pairs = _smooth(outer, number, points, edges.places, kind)
    _, of = pieces_of(len(outer), pairs)
    # in the order of their first sides
    first = np.unique(of, return_index=True)[1]
    order = np.argsort(np.argsort(first))
    names = tuple(joined_names(sets, member[k]) for k in np.sort(first))
    return order[of], names, empty


def _side_edges(sides: Index) -> Index:
    """Ends (s, 4, 2) of the edges of sides; of triangles the third is there twice."""
    following = np.roll(sides, -1, axis=1)
    is_triangle = sides[:, 3] == sides[:, 2]
    ends = np.stack([sides, following], axis=-1)
    ends[is_triangle, 2] = ends[is_triangle, 3]
    return ends


def _smooth(outer: Index, number: Index, points: Array, middles: Array, kind: Index) -> Index:
    """Pairs of sides of one kind that meet at an edge without a bend; `number` (s, 4) are those of their edges."""
    normals = np.empty((*outer.shape, 3))
    for count in (3, 4):
        own = np.flatnonzero((outer[:, 3] == outer[:, 2]) == (count == 3))
        x, m = points[outer[own, :count]], middles[number[own, :count]]
        if count == 3:  # the third edge is the last one
            m = middles[number[own][:, [0, 1, 3]]]
        corners, between = (np.array(row) for row in ACROSS[count])
        for k in range(count):
            turned, mid = np.roll(x, -k, axis=1), np.roll(m, -k, axis=1)
            across = np.einsum("i,sij->sj", corners, turned) + np.einsum("i,sij->sj", between, mid)
            normal = np.cross(turned[:, 1] - turned[:, 0], across)
            length = np.linalg.norm(normal, axis=1, keepdims=True)
            normals[own, k] = normal / np.where(length > 0, length, 1.0)
        if count == 3:
            normals[own, 3] = normals[own, 2]
    flat, of = number.ravel(), np.repeat(np.arange(len(outer)), 4)
    normal = normals.reshape(-1, 3)
    real = np.ones((len(outer), 4), dtype=bool)
    real[outer[:, 3] == outer[:, 2], 2] = False
    flat, of, normal = flat[real.ravel()], of[real.ravel()], normal[real.ravel()]
    order = np.argsort(flat, kind="stable")
    _, start, count = np.unique(flat[order], return_index=True, return_counts=True)
    # more than two sides meet where solids touch along an edge alone
    a, b = order[start[count == 2]], order[start[count == 2] + 1]
    is_smooth = (np.einsum("ij,ij->i", normal[a], normal[b]) > np.cos(BEND)) & (kind[of[a]] == kind[of[b]])
    return np.column_stack([of[a], of[b]])[is_smooth]
