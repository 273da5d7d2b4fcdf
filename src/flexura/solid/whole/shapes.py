"""Pieces as boundary representations of OpenCASCADE by netgen, in millimetres, glued into one part."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.extras import need
from flexura.solid.geometry import MILLIMETRE, MemberSolid, runs
from flexura.solid.whole.pieces import Block, Held, Piece, Pieces, extended, thickness

STEEP = 60.0
"""Slope of a contour, degrees, up to which it belongs to what a notch ends in: its tips would be meshed badly alone."""
LEAST = 1e-9
"""Common volume of two pieces over that of the smaller one, above which they overlap."""
FLAT = 1e-6
"""Distance of a face from a plane, over the size of the piece, up to which it lies in it."""


@dataclass(frozen=True)
class Part:
    """The glued part: `shape` with solids named by the numbers of their pieces and held faces named `held`.

    `touching` holds pairs of pieces that share a face.
    """

    shape: Any
    pieces: Pieces
    touching: frozenset[tuple[int, int]]


def part_of(pieces: Pieces) -> Part:
    """Cut, join and glue all pieces. Raises OptionError without netgen and SolverError where OpenCASCADE fails."""
    occ = need("netgen.occ", "solid")
    made = [_block(occ, own) if isinstance(own, Block) else _member(occ, own) for own in pieces.all]
    _hand_tips_over(occ, pieces, made)
    everything = pieces.all
    boxes = [_box(shape) for shape in made]
    for k in range(len(made)):
        for j in range(k):
            if _apart(boxes[k], boxes[j]) or made[j] is None:
                continue
            common = (made[k] * made[j]).mass
            if common > LEAST * min(_size(everything[k]), _size(everything[j])):
                made[k] = made[k] - made[j]
    kept = []
    for k, shape in enumerate(made):
        for solid in shape.solids:
            if solid.mass > 1e-6 * _size(everything[k]):
                solid.mat(str(k))
                kept.append(solid)
    try:
        glued = occ.Glue(kept)
    except Exception as error:
        raise SolverError(f"OpenCASCADE could not join the pieces: {error}") from None
    touching = _touching(glued)
    _name_held(glued, pieces)
    return Part(glued, pieces, touching)


def _size(piece: Piece) -> float:
    """Volume, mm^3."""
    if isinstance(piece, Block):
        return float(np.prod(2 * piece.half)) * (math.pi / 4 if piece.is_round else 1.0) / MILLIMETRE**3
    return piece.volume / MILLIMETRE**3


def _block(occ: ModuleType, own: Block) -> Any:
    half = own.half / MILLIMETRE
    centre = own.centre / MILLIMETRE
    if own.is_round:
        base = centre - half[0] * own.axes[0]
        return occ.Cylinder(occ.gp_Pnt(*base), occ.gp_Vec(*own.axes[0]), float(half[1]), float(2 * half[0]))
    return _prism(occ, centre, own.axes, half)


def _prism(occ: ModuleType, centre: Array, axes: Array, half: Array) -> Any:
    """A box with its edges along right-handed axes (3, 3), mm."""
    corner = centre - half @ axes
    plane = occ.WorkPlane(occ.Axes(occ.gp_Pnt(*corner), n=occ.gp_Vec(*axes[2]), h=occ.gp_Vec(*axes[0])))
    return plane.Rectangle(float(2 * half[0]), float(2 * half[1])).Face().Extrude(float(2 * half[2]))


def _member(occ: ModuleType, own: MemberSolid) -> Any:
    shape = own.outline
    start, along = own.start / MILLIMETRE, own.axes[0]
    length = own.length / MILLIMETRE
    if shape.family in ("circle", "tube"):
        outer = occ.Cylinder(occ.gp_Pnt(*start), occ.gp_Vec(*along), float(shape.y[0]) / MILLIMETRE, length)
        if shape.inner == 0:
            return outer
        return outer - occ.Cylinder(occ.gp_Pnt(*start), occ.gp_Vec(*along), shape.inner / MILLIMETRE, length)

    def placed(x: Array | float, y: Array | float, z: Array | float) -> Array:
        return own.placed(np.stack(np.broadcast_arrays(x, y, z), axis=-1)) / MILLIMETRE

    if shape.family == "round":
        upper = [np.stack([shape.x[a : b + 1], shape.z[a : b + 1]], axis=-1) for a, b in pairwise(shape.breaks)]
        end, first = upper[-1][-1], upper[0][0]
        axis = [np.array([end, [end[0], 0]]), np.array([[end[0], 0], [first[0], 0]]), np.array([[first[0], 0], first])]
        face = _face(occ, [placed(run[:, 0], 0.0, run[:, 1]) for run in (*upper, *axis)])
        return face.Revolve(occ.Axis(occ.gp_Pnt(*start), occ.gp_Vec(*along)), 360)
    y = float(shape.y.max())
    made = _face(occ, [placed(run[:, 0], -y, run[:, 1]) for run in runs(shape, shape.z)])
    solid = made.Extrude(occ.gp_Vec(*(2 * y / MILLIMETRE * own.axes[1])))
    if np.ptp(shape.y) > 1e-9 * y:
        z = float(shape.z.max())
        other = _face(occ, [placed(run[:, 0], run[:, 1], -z) for run in runs(shape, shape.y)])
        solid = solid * other.Extrude(occ.gp_Vec(*(2 * z / MILLIMETRE * own.axes[2])))
    return solid


def _face(occ: ModuleType, outline: Sequence[Array]) -> Any:
    """A plane face within runs of points (n, 3), mm: lines, arcs where the points lie on a circle, else splines."""
    edges = []
    for run in outline:
        points = [occ.gp_Pnt(*p) for p in run]
        along = run[-1] - run[0]
        off = np.linalg.norm(np.cross(run - run[0], along), axis=1).max() / (along @ along)
        if len(run) == 2 or off < 1e-9:
            edges.append(occ.Segment(points[0], points[-1]))
        elif _is_arc(run):
            edges.append(occ.ArcOfCircle(points[0], points[len(run) // 2], points[-1]))
        else:
            edges.append(occ.SplineInterpolation(points))
    return occ.Face(occ.Wire(edges))


def _is_arc(run: Array) -> bool:
    """Whether points (n, 3) lie on one circle."""
    a, b = run[len(run) // 2] - run[0], run[-1] - run[0]
    normal = np.cross(a, b)
    centre = run[0] + np.cross(a @ a * b - b @ b * a, normal) / (2 * normal @ normal)
    radius = np.linalg.norm(run - centre, axis=1)
    return bool(np.ptp(radius) < 1e-9 * radius[0])


def _hand_tips_over(occ: ModuleType, pieces: Pieces, made: list[Any]) -> None:
    """Let oblique ends reach into what they end in, and give steep ends of notches to what they end in."""
    offset = len(pieces.blocks)
    for m, own in enumerate(pieces.members):
        k = offset + m
        for end in (0, 1):
            hosts = [
                j
                for j in pieces.at_root(own.roots[end])
                if j != k and (not isinstance(pieces.all[j], Block) or _is_near(pieces.all[j], own, end))
            ]
            if not hosts:
                continue
            by = extended(own, end, [pieces.all[j] for j in hosts])
            if by:
                made[k] = made[k] + _slab(occ, own, end, by)
            depth = _steep(own, end)
            host = next((j for j in hosts if thickness(pieces.all[j]) > thickness(own)), None)
            if depth and host is not None:
                tip = made[k] * _cutter(occ, own, end, depth)
                joined = made[host] + tip
                if joined.mass < (1 - FLAT) * made[host].mass:  # as where OpenCASCADE loses round ends that are flush
                    continue
                made[k] = made[k] - _cutter(occ, own, end, depth)
                made[host] = joined


def _is_near(block: Piece, own: MemberSolid, end: int) -> bool:
    assert isinstance(block, Block)
    points = own.end_samples(end, 0.0)
    return bool((block.beyond(points) < 1e-3 * thickness(own)).any())


def _slab(occ: ModuleType, own: MemberSolid, end: int, by: float) -> Any:
    """The end section swept on by some length, m."""
    y, z = float(own.outline.y[-end]), float(own.outline.z[-end])
    x = own.length if end else -by
    if own.outline.is_round:
        base = own.placed(np.array([x, 0.0, 0.0])) / MILLIMETRE
        return occ.Cylinder(occ.gp_Pnt(*base), occ.gp_Vec(*own.axes[0]), z / MILLIMETRE, by / MILLIMETRE)
    centre = own.placed(np.array([x + by / 2, 0.0, 0.0]))
    return _prism(occ, centre / MILLIMETRE, own.axes, np.array([by / 2, y, z]) / MILLIMETRE)


def _cutter(occ: ModuleType, own: MemberSolid, end: int, depth: float) -> Any:
    """A box around the last `depth` of a member, m."""
    reach = 2 * float(max(own.outline.y.max(), own.outline.z.max()))
    x = own.length + reach / 2 - depth / 2 if end else depth / 2 - reach / 2
    half = np.array([(reach + depth) / 2, reach, reach])
    return _prism(occ, own.placed(np.array([x, 0.0, 0.0])) / MILLIMETRE, own.axes, half / MILLIMETRE)


def _steep(own: MemberSolid, end: int) -> float:
    """How far from an end the contour is steeper than STEEP, m."""
    found = 0.0
    for half in (own.outline.y, own.outline.z):
        x = own.outline.x if end == 0 else own.length - own.outline.x[::-1]
        size = half if end == 0 else half[::-1]
        slope = -np.diff(size) / np.diff(x)
        steep = slope > math.tan(math.radians(STEEP))
        if steep[0]:
            first = int(np.argmin(steep)) if not steep.all() else len(steep) - 1
            found = max(found, float(x[first]))
    return found


def _box(shape: Any) -> Array:
    low, high = shape.bounding_box
    return np.array([[low.x, low.y, low.z], [high.x, high.y, high.z]])


def _apart(one: Array, other: Array) -> bool:
    """Whether two bounding boxes (2, 3) have no volume in common."""
    shared = np.minimum(one[1], other[1]) - np.maximum(one[0], other[0])
    return bool((shared < 1e-6).any())


def _touching(glued: Any) -> frozenset[tuple[int, int]]:
    """Pairs of pieces that share a face."""
    owners: dict[Any, set[int]] = {}
    for solid in glued.solids:
        for face in solid.faces:
            owners.setdefault(face, set()).add(int(solid.name))
    return frozenset((a, b) for own in owners.values() for a in own for b in own if a < b)


def _name_held(glued: Any, pieces: Pieces) -> None:
    """Name the faces that are held."""
    everything = pieces.all
    by_piece: dict[int, list[Held]] = {}
    for held in pieces.held:
        by_piece.setdefault(held.piece, []).append(held)
    for solid in glued.solids:
        for held in by_piece.get(int(solid.name), []):
            for face in solid.faces:
                if _lies_on(face, everything[held.piece], held):
                    face.name = "held"


def _lies_on(face: Any, piece: Piece, held: Held) -> bool:
    """Whether a face is part of the face of a piece that is held."""
    points = np.array([[p.x, p.y, p.z] for p in (*(v.p for v in face.vertices), face.center)]) * MILLIMETRE
    near = FLAT * _reach(piece)
    local = piece.local(points)
    if held.axis == 3:
        assert isinstance(piece, Block)
        on_mantle = np.abs(np.linalg.norm(local[:-1, 1:], axis=1) - piece.half[1]) < near
        return bool(on_mantle.all() and abs(local[-1, 0]) < piece.half[0] - near)
    last = 0.0 if isinstance(piece, Block) else piece.length
    at = held.side * piece.half[held.axis] if isinstance(piece, Block) else last * (held.side > 0)
    return bool((np.abs(local[:, held.axis] - at) < near).all())


def _reach(piece: Piece) -> float:
    return 2 * float(piece.half.max()) if isinstance(piece, Block) else piece.length
