"""Meshes that others made as parts: what is wrong with one, its outer side divided into faces, and a mesh of NGSolve.

Curved cells are straight ones that a field of order 2 moves onto the middles of their edges.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Index
from flexura.errors import OptionError, need
from flexura.fem.geometry import MILLIMETRE
from flexura.fem.mesh_files import CORNERS, Cells, MeshFile, read_mesh, sorted_sides
from flexura.fem.solid_mesh import EDGES, SIDES
from flexura.tables import in_mm

BEND = np.radians(30.0)
"""Angle by which normals turn across an edge, from which it parts two faces."""

STRAIGHT = 1e-9
"""Distance of the middle of an edge from that of its ends, over the length of the mesh, up to which it is straight."""

FLAT = 1e-9
"""Volume of a cell over the cube of its longest edge from which it is one."""

FOLDED = 1e-9
"""Part of a cell where it is inside out, from which it is folded."""

FARTHEST = 1e6
"""Coordinates of points, m, at most."""

MOST_LISTED = 3

MIDDLE = -8.0
"""Coefficient of the function of order 2 of an edge for a displacement of one in its middle."""

ACROSS = {
    3: ((-0.5, -0.5, -1.0), (-2.0, 2.0, 2.0)),
    4: ((-0.5, -0.5, -0.5, -0.5), (-0.5, 1.0, 0.5, 1.0)),
}
"""Slope across an edge in its middle, by corners and middles of a triangle or quadrilateral that begin with it."""


class GivenFace(NamedTuple):
    """A face: names of its sets, the name of its solid, area, m^2, centre (3,) and triangles (t, 3, 3), m."""

    name: str
    solid: str
    area: float
    centre: Array
    triangles: Array


@dataclass(frozen=True, repr=False)
class GivenMesh:
    """A mesh of others, m: corner points (n, 3), cells by shape with the number of their solid, and sides (s, 4).

    `edges` (e, 2) and `middles` (e, 3) are corners and middles of edges that are not straight, `face_of` (s,) numbers
    of faces. Sets without any outer side are `empty`, with what they hold.
    """

    points: Array
    cells: tuple[tuple[Index, Index], ...]
    edges: Index
    middles: Array
    sides: Index
    face_of: Index
    face_solids: Index
    solids: tuple[str, ...]
    face_names: tuple[str, ...]
    empty: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def digest(self) -> str:
        """That of all that is worked with."""
        found = hashlib.sha256(repr(self.solids).encode())
        arrays = (
            self.points,
            self.edges,
            self.middles,
            self.sides,
            self.face_of,
            *(a for own in self.cells for a in own),
        )
        for array in arrays:
            found.update(np.ascontiguousarray(array).tobytes())
        return found.hexdigest()

    def mesh(self, names: Sequence[str]) -> Any:
        """NGSolve's mesh, mm, whose faces have names."""
        ng, meshing = need("ngsolve", "solid"), need("netgen.meshing", "solid")
        made = meshing.Mesh(3)
        made.AddPoints(self.points / MILLIMETRE)
        for k, (name, solid) in enumerate(zip(names, self.face_solids.tolist(), strict=True)):
            made.Add(meshing.FaceDescriptor(surfnr=k + 1, domin=solid + 1, domout=0, bc=k + 1))
            made.SetBCName(k, name)
        for k, name in enumerate(self.solids, 1):
            made.SetMaterial(k, name)
        ids = [meshing.PointId(k + 1) for k in range(len(self.points))]
        for corners, solids in self.cells:
            for row, solid in zip(corners.tolist(), solids.tolist(), strict=True):
                made.Add(meshing.Element3D(solid + 1, [ids[k] for k in row]))
        for row, face in zip(self.sides.tolist(), self.face_of.tolist(), strict=True):
            made.Add(meshing.Element2D(face + 1, [ids[k] for k in row[: 3 if row[3] == row[2] else 4]]))
        mesh = ng.Mesh(made)
        if len(self.edges):
            mesh.SetDeformation(self._curved(mesh))
        return mesh

    def _curved(self, mesh: Any) -> Any:
        """The field that moves straight edges onto their middles."""
        ng = need("ngsolve", "solid")
        space = ng.VectorH1(mesh, order=2)
        moved, n = ng.GridFunction(space), len(self.points)
        ends = np.sort([[v.nr for v in edge.vertices] for edge in mesh.edges], axis=1)
        key, wanted = ends @ [n, 1], self.edges @ [n, 1]
        order = np.argsort(key)
        at = order[np.searchsorted(key[order], wanted)]
        off = (self.middles - self.points[self.edges].mean(axis=1)) / MILLIMETRE
        coefficients = np.zeros((3, space.ndof // 3))
        coefficients[:, n + at] = MIDDLE * off.T
        moved.vec.FV().NumPy()[:] = coefficients.ravel()
        return moved

    def faces(self) -> list[GivenFace]:
        """Its faces, whose areas and centres are those of the curved sides."""
        ng = need("ngsolve", "solid")
        mesh = self.mesh([str(k) for k in range(len(self.face_names))])
        sums = [np.array(ng.Integrate(f, mesh, ng.BND, region_wise=True)) for f in (ng.CF(1.0), ng.x, ng.y, ng.z)]
        corners = self.points[self.sides]
        is_quad = self.sides[:, 3] != self.sides[:, 2]
        found = []
        for k, name in enumerate(self.face_names):
            own = self.face_of == k
            triangles = np.concatenate([corners[own][:, :3], corners[own & is_quad][:, [0, 2, 3]]])
            area = float(sums[0][k])
            centre = np.array([float(own[k]) for own in sums[1:]]) / area * MILLIMETRE
            solid = self.solids[self.face_solids[k]]
            found.append(GivenFace(name, solid, area * MILLIMETRE**2, centre, triangles))
        return found


def given_mesh(path: Path, unit: float) -> GivenMesh:
    """The mesh of a file whose unit is so many metres.

    Raises OptionError for files that cannot be read, and for meshes without solid cells, or with cells that are
    degenerate, inside out, folded, or hang together by less than a side.
    """
    file = read_mesh(path)
    try:
        return _checked(file, unit)
    except ValueError as error:
        raise OptionError(f"{path}: {error}") from None


def _checked(file: MeshFile, unit: float) -> GivenMesh:
    if not file.blocks:
        kinds = ", ".join(f"{count} {kind}" for kind, count in file.others.items()) or "no elements"
        raise ValueError(f"it has no solid cells, but {kinds}: mesh the volume, not its surface or middle plane")
    points = file.points * unit
    used = np.unique(np.concatenate([block.points.ravel() for block in file.blocks]))
    if used[0] < 0 or used[-1] >= len(points):
        raise ValueError(f"a cell has the point {used[-1] + 1}, of {len(points)}")
    if not (np.abs(points[used]) < FARTHEST).all():
        raise ValueError(f"a point of a cell is farther away than {FARTHEST:g} m, or nowhere")
    notes = [f"{count} {kind} are no solids and are left out" for kind, count in file.others.items()]
    if loose := len(points) - len(used):
        notes.append(f"{loose} points belong to no cell and are left out")
    for block in file.blocks:
        _refuse_degenerate(block, points)
    outer, owner, links = _outer_sides(file.blocks, points)
    _refuse_pieces(file.blocks, points, links)
    # corners are numbered anew, in the order of the file
    corners = np.unique(np.concatenate([block.points[:, : CORNERS[block.shape]].ravel() for block in file.blocks]))
    number = np.full(len(points), -1)
    number[corners] = np.arange(len(corners))
    edges = _edges(file.blocks, points)
    bent = np.linalg.norm(edges.places - points[edges.ends].mean(axis=1), axis=1)
    is_bent = bent > STRAIGHT * np.ptp(points[used], axis=0).max()
    solids, solid_of = _solids(file)
    face_of, face_names, empty = _faces(file, points, outer, solid_of[owner], edges)
    first = np.unique(face_of, return_index=True)[1]
    starts = np.cumsum([0, *(len(block.points) for block in file.blocks)])
    mesh = GivenMesh(
        points[corners],
        tuple(
            (number[block.points[:, : CORNERS[block.shape]]], solid_of[a:b])
            for block, (a, b) in zip(file.blocks, pairwise(starts), strict=True)
        ),
        np.sort(number[edges.ends[is_bent]], axis=1),
        edges.places[is_bent],
        number[outer],
        face_of,
        solid_of[owner][first],
        solids,
        face_names,
        empty,
        tuple(notes),
    )
    _refuse_folded(mesh, file.blocks, points)
    return mesh


def _place(block: Cells, k: int, points: Array) -> str:
    """The number of a cell and its middle."""
    return f"cell {block.numbers[k]} near {in_mm(points[block.points[k, : CORNERS[block.shape]]].mean(axis=0))} mm"


def _refused(rule: str, block: Cells, wrong: Index, points: Array) -> ValueError:
    listed = "; ".join(_place(block, int(k), points) for k in wrong[:MOST_LISTED])
    more = f" and {len(wrong) - MOST_LISTED} more" if len(wrong) > MOST_LISTED else ""
    return ValueError(f"{rule}: {listed}{more}")


def _refuse_degenerate(block: Cells, points: Array) -> None:
    """Cells that have a point twice, or are inside out among others that are not.

    Where all cells of a shape are left-handed, as in files of MED, the format has them so.
    """
    count = CORNERS[block.shape]
    corners = np.sort(block.points[:, :count], axis=1)
    if len(twice := np.flatnonzero((np.diff(corners, axis=1) == 0).any(axis=1))):
        rule = "cells have the same point twice, where wedges, pyramids or tetrahedra are meant"
        raise _refused(rule, block, twice, points)
    handed = _handed(block, points)
    if len(flat := np.flatnonzero(handed == 0)):
        raise _refused("cells have no volume", block, flat, points)
    wrong = np.flatnonzero(handed != np.sign(handed.sum()))
    if len(wrong):
        raise _refused("cells are inside out (negative Jacobian), where others are not", block, wrong, points)


def _handed(block: Cells, points: Array) -> Array:
    """1 or -1 of each cell (c,), for the side of its base on which its other corners are, 0 of flat ones."""
    x = points[block.points[:, : CORNERS[block.shape]]]
    base = 4 if block.shape in ("hexahedron", "pyramid") else 3
    ring = x[:, :base] - x[:, :base].mean(axis=1, keepdims=True)
    normal = np.cross(ring, np.roll(ring, -1, axis=1)).sum(axis=1)
    height = np.einsum("ci,ci->c", normal, x[:, base:].mean(axis=1) - x[:, :base].mean(axis=1))
    longest = np.ptp(x, axis=1).max(axis=1)
    return np.where(np.abs(height) > FLAT * longest**3, np.sign(height), 0.0)


def _outer_sides(blocks: Sequence[Cells], points: Array) -> tuple[Index, Index, Index]:
    """Sides (s, 4) that belong to one cell, from outside anticlockwise, triangles with their last corner twice, the
    positions of their cells, and pairs (i, 2) of cells that share a side."""
    sides, owners, start = [], [], 0
    for block in blocks:
        own = block.points[:, np.array(SIDES[block.shape])]
        if _handed(block, points).sum() < 0:
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


def _pieces(n: int, pairs: Index) -> tuple[int, Index]:
    """How many pieces n things make that hang together by pairs (p, 2), and the piece (n,) of each."""
    return connected_components(sp.coo_matrix((np.ones(len(pairs)), pairs.T), shape=(n, n)), directed=False)


def _refuse_pieces(blocks: Sequence[Cells], points: Array, links: Index) -> None:
    """Cells that do not hang together by sides."""
    n = sum(len(block.points) for block in blocks)
    pieces, of = _pieces(n, links)
    if pieces == 1:
        return
    of_piece = np.bincount(of)
    middles = np.concatenate([points[block.points[:, : CORNERS[block.shape]]].mean(axis=1) for block in blocks])
    order = np.argsort(-of_piece)[: MOST_LISTED + 1]
    listed = "; ".join(f"{of_piece[k]} cells about {in_mm(middles[of == k].mean(axis=0))} mm" for k in order)
    hint = "merge points that coincide, or make parts of the pieces"
    raise ValueError(f"its cells make {pieces} pieces that share no side: {listed}: {hint}")


class _Edges(NamedTuple):
    """All edges: ends (e, 2), ascending, and in this order, the points in their middles (e,), else -1, and places."""

    ends: Index
    middle: Index
    places: Array


def _edges(blocks: Sequence[Cells], points: Array) -> _Edges:
    ends, middle = [], []
    for block in blocks:
        own = block.points[:, np.array(EDGES[block.shape])]
        ends.append(own.reshape(-1, 2))
        given = block.points[:, CORNERS[block.shape] :]
        middle.append(given.ravel() if given.size else np.full(own[..., 0].size, -1))
    edges, first = np.unique(np.sort(np.concatenate(ends), axis=1), axis=0, return_index=True)
    found = np.concatenate(middle)[first]
    places = np.where(found[:, None] >= 0, points[found], points[edges].mean(axis=1))
    return _Edges(edges, found, places)


def _solids(file: MeshFile) -> tuple[tuple[str, ...], Index]:
    """Names of solids, those of the sets that each cell is in, and the solid of every cell."""
    count = sum(len(block.points) for block in file.blocks)
    sets = {name: own for name, own in file.cell_sets.items() if 0 < len(own) < count}
    member = np.zeros((count, len(sets)), dtype=bool)
    for k, own in enumerate(sets.values()):
        member[own, k] = True
    kinds, of = np.unique(member, axis=0, return_inverse=True)
    whole = [name for name, own in file.cell_sets.items() if len(own) == count]
    names = [_joined(sets, row) for row in kinds]
    otherwise = (whole or ["solid 1"])[0] if len(names) == 1 else "no set"
    return tuple(name or otherwise for name in names), of.ravel()


def _joined(names: Mapping[str, Any], member: Any) -> str:
    return " + ".join(name for name, is_in in zip(names, member, strict=True) if is_in)


def _faces(
    file: MeshFile, points: Array, outer: Index, solid: Index, edges: _Edges
) -> tuple[Index, tuple[str, ...], dict[str, str]]:
    """Number of the face of each outer side, names of faces, and sets that have no outer side."""
    sides = sorted_sides(outer)
    position = {tuple(side): k for k, side in enumerate(sides.tolist())}
    key = [len(points), 1]
    number = np.searchsorted(edges.ends @ key, np.sort(_side_edges(outer), axis=-1) @ key)
    middle = edges.middle[number]
    sets: dict[str, Index] = {}
    empty = {}
    for name, own in file.side_sets.items():
        sets[name] = np.array(
            [position[key] for side in own.tolist() if (key := tuple(side)) in position], dtype=np.intp
        )
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
        if not len(sets.get(name, [])):
            empty[name] = f"it is of {len(own)} solid cells, which `solids` may give a material"
    sets = {name: own for name, own in sets.items() if 0 < len(own) < len(outer)}
    member = np.zeros((len(outer), len(sets)), dtype=bool)
    for k, own in enumerate(sets.values()):
        member[own, k] = True
    kind = np.unique(np.column_stack([member, solid]), axis=0, return_inverse=True)[1].ravel()
    pairs = _smooth(outer, number, points, edges.places, kind)
    _, of = _pieces(len(outer), pairs)
    # in the order of their first sides
    first = np.unique(of, return_index=True)[1]
    order = np.argsort(np.argsort(first))
    names = tuple(_joined(sets, member[k]) for k in np.sort(first))
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


def _refuse_folded(mesh: GivenMesh, blocks: Sequence[Cells], points: Array) -> None:
    """Cells that are inside out in a part of them."""
    ng = need("ngsolve", "solid")
    made = mesh.mesh(["" for _ in mesh.face_names])
    sign = ng.IfPos(ng.Det(ng.specialcf.JacobianMatrix(3)), 1.0, -1.0)
    volume, signed = (ng.Integrate(f, made, ng.VOL, order=6, element_wise=True).NumPy() for f in (ng.CF(1.0), sign))
    is_folded = np.abs(signed) < (1 - FOLDED) * volume
    start = 0
    for block in blocks:
        wrong = np.flatnonzero(is_folded[start : start + len(block.points)])
        if len(wrong):
            raise _refused("cells are folded (negative Jacobian in a part of them)", block, wrong, points)
        start += len(block.points)
