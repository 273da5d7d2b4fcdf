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

from flexura.arrays import Array, Index
from flexura.errors import OptionError, need
from flexura.fem.geometry import MILLIMETRE
from flexura.fem.mesh_files import CORNERS, Cells, MeshFile, read_mesh
from flexura.fem.mesh_skin import edges_of, handed, joined_names, named_faces, outer_sides, pieces_of
from flexura.tables import in_mm

STRAIGHT = 1e-9
"""Distance of the middle of an edge from that of its ends, over the length of the mesh, up to which it is straight."""

FOLDED = 1e-9
"""Part of a cell where it is inside out, from which it is folded."""

FARTHEST = 1e6
"""Coordinates of points, m, at most."""

MOST_LISTED = 3

MIDDLE = -8.0
"""Coefficient of the function of order 2 of an edge for a displacement of one in its middle."""


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
    outer, owner, links = outer_sides(file.blocks, points)
    _refuse_pieces(file.blocks, points, links)
    # corners are numbered anew, in the order of the file
    corners = np.unique(np.concatenate([block.points[:, : CORNERS[block.shape]].ravel() for block in file.blocks]))
    number = np.full(len(points), -1)
    number[corners] = np.arange(len(corners))
    edges = edges_of(file.blocks, points)
    bent = np.linalg.norm(edges.places - points[edges.ends].mean(axis=1), axis=1)
    is_bent = bent > STRAIGHT * np.ptp(points[used], axis=0).max()
    solids, solid_of = _solids(file)
    face_of, face_names, empty = named_faces(file, points, outer, solid_of[owner], edges)
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
    hands = handed(block, points)
    if len(flat := np.flatnonzero(hands == 0)):
        raise _refused("cells have no volume", block, flat, points)
    wrong = np.flatnonzero(hands != np.sign(hands.sum()))
    if len(wrong):
        raise _refused("cells are inside out (negative Jacobian), where others are not", block, wrong, points)


def _refuse_pieces(blocks: Sequence[Cells], points: Array, links: Index) -> None:
    """Cells that do not hang together by sides."""
    n = sum(len(block.points) for block in blocks)
    pieces, of = pieces_of(n, links)
    if pieces == 1:
        return
    of_piece = np.bincount(of)
    middles = np.concatenate([points[block.points[:, : CORNERS[block.shape]]].mean(axis=1) for block in blocks])
    order = np.argsort(-of_piece)[: MOST_LISTED + 1]
    listed = "; ".join(f"{of_piece[k]} cells about {in_mm(middles[of == k].mean(axis=0))} mm" for k in order)
    hint = "merge points that coincide, or make parts of the pieces"
    raise ValueError(f"its cells make {pieces} pieces that share no side: {listed}: {hint}")


def _solids(file: MeshFile) -> tuple[tuple[str, ...], Index]:
    """Names of solids, those of the sets that each cell is in, and the solid of every cell."""
    count = sum(len(block.points) for block in file.blocks)
    sets = {name: own for name, own in file.cell_sets.items() if 0 < len(own) < count}
    member = np.zeros((count, len(sets)), dtype=bool)
    for k, own in enumerate(sets.values()):
        member[own, k] = True
    kinds, of = np.unique(member, axis=0, return_inverse=True)
    whole = [name for name, own in file.cell_sets.items() if len(own) == count]
    names = [joined_names(sets, row) for row in kinds]
    otherwise = (whole or ["solid 1"])[0] if len(names) == 1 else "no set"
    return tuple(name or otherwise for name in names), of.ravel()


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
