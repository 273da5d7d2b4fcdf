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
from flexura.errors import SolverError, need
from flexura.fem import MILLIMETRE, MemberSolid
from flexura.solid.whole.pieces import Block, Held, Pieces, extended

STEEP = 60.0
"""Slope of a contour, degrees, up to which it belongs to what a notch ends in: its tips would be meshed badly alone."""
OVERLAPPING = 1e-9
"""Common volume of two pieces over that of the smaller one, above which they overlap."""
SLIVER = 1e-6
"""Volume of a fragment of a piece over that of the piece, up to which it is left out."""
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
    made = [_block(occ, piece) if isinstance(piece, Block) else _member(occ, piece) for piece in pieces.all]
    _hand_tips_over(occ, pieces, made)
    volumes = [piece.volume / MILLIMETRE**3 for piece in pieces.all]
    boxes = [_box(shape) for shape in made]
    for k in range(len(made)):
        for j in range(k):
            shared = np.minimum(boxes[k][1], boxes[j][1]) - np.maximum(boxes[k][0], boxes[j][0])
            if (shared >= 1e-6).all() and (made[k] * made[j]).mass > OVERLAPPING * min(volumes[k], volumes[j]):
                made[k] = made[k] - made[j]
    kept = []
    for k, shape in enumerate(made):
        for solid in shape.solids:
            if solid.mass > SLIVER * volumes[k]:
                solid.mat(str(k))
                kept.append(solid)
    try:
        glued = occ.Glue(kept)
    except Exception as error:
        raise SolverError(f"OpenCASCADE could not join the pieces: {error}") from None
    owners: dict[Any, set[int]] = {}
    for solid in glued.solids:
        for face in solid.faces:
            owners.setdefault(face, set()).add(int(solid.name))
            if any(held.piece == int(solid.name) and _lies_on(face, pieces, held) for held in pieces.held):
                face.name = "held"
    touching = frozenset((a, b) for numbers in owners.values() for a in numbers for b in numbers if a < b)
    return Part(glued, pieces, touching)


def _block(occ: ModuleType, block: Block) -> Any:
    if block.pieces is None:
        return _primitive(occ, block.centre, block.axes, block.half, block.is_round)
    pieces = block.pieces
    columns = pieces.centre, pieces.axes, pieces.half, pieces.is_round
    forms = enumerate(zip(*columns, strict=True))
    made = [_primitive(occ, *piece, outline=pieces.outlines.get(k)) for k, piece in forms]
    solid = made[0]
    for other in made[1 : pieces.added]:
        solid = solid + other
    for other in made[pieces.added :]:
        solid = solid - other
    return solid


def _primitive(
    occ: ModuleType, centre: Array, axes: Array, half: Array, is_round: bool, outline: Array | None = None
) -> Any:
    """A box, a cylinder about its first axis, or a prism of corners (n, 2), of half sizes (3,), m, with right-handed
    axes (3, 3) as rows."""
    centre, half = centre / MILLIMETRE, half / MILLIMETRE
    if outline is not None:
        base = centre - half[2] * axes[2] + outline / MILLIMETRE @ axes[:2]
        face = _face(occ, [np.stack(side) for side in pairwise([*base, base[0]])])
        return face.Extrude(occ.gp_Vec(*(2 * half[2] * axes[2])))
    if not is_round:
        return _prism(occ, centre, axes, half)
    base, along = occ.gp_Pnt(*(centre - half[0] * axes[0])), occ.gp_Vec(*axes[0])
    return occ.Cylinder(base, along, float(half[1]), 2 * float(half[0]))


def _prism(occ: ModuleType, centre: Array, axes: Array, half: Array) -> Any:
    """A box with its edges along right-handed axes (3, 3), mm."""
    corner = centre - half @ axes
    plane = occ.WorkPlane(occ.Axes(occ.gp_Pnt(*corner), n=occ.gp_Vec(*axes[2]), h=occ.gp_Vec(*axes[0])))
    return plane.Rectangle(float(2 * half[0]), float(2 * half[1])).Face().Extrude(float(2 * half[2]))


def _member(occ: ModuleType, member: MemberSolid) -> Any:
    shape = member.outline
    start, along = member.start / MILLIMETRE, member.axes[0]
    length = member.length / MILLIMETRE
    if shape.family in ("circle", "tube"):
        outer = occ.Cylinder(occ.gp_Pnt(*start), occ.gp_Vec(*along), float(shape.y[0]) / MILLIMETRE, length)
        if shape.inner == 0:
            return outer
        return outer - occ.Cylinder(occ.gp_Pnt(*start), occ.gp_Vec(*along), shape.inner / MILLIMETRE, length)

    def placed(x: Array | float, y: Array | float, z: Array | float) -> Array:
        return member.placed(np.stack(np.broadcast_arrays(x, y, z), axis=-1)) / MILLIMETRE

    if shape.family == "round":
        face = _face(occ, [placed(run[:, 0], 0.0, run[:, 1]) for run in shape.meridian()])
        return face.Revolve(occ.Axis(occ.gp_Pnt(*start), occ.gp_Vec(*along)), 360)
    y = float(shape.y.max())
    made = _face(occ, [placed(run[:, 0], -y, run[:, 1]) for run in shape.runs(shape.z)])
    solid = made.Extrude(occ.gp_Vec(*(2 * y / MILLIMETRE * member.axes[1])))
    if np.ptp(shape.y) > 1e-9 * y:
        z = float(shape.z.max())
        other = _face(occ, [placed(run[:, 0], run[:, 1], -z) for run in shape.runs(shape.y)])
        solid = solid * other.Extrude(occ.gp_Vec(*(2 * z / MILLIMETRE * member.axes[2])))
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
    everything = pieces.all
    for k, member in enumerate(pieces.members, len(pieces.blocks)):
        for end, root in enumerate(member.roots):
            face, near = member.end_samples(end, 0.0), 1e-3 * member.thickness
            hosts = [
                j
                for j in pieces.at_root(root)
                if j != k and (not isinstance(everything[j], Block) or (everything[j].beyond(face) < near).any())
            ]
            if not hosts:
                continue
            by = extended(member, end, [everything[j] for j in hosts])
            if by:
                made[k] = made[k] + _slab(occ, member, end, by)
            depth = _steep(member, end)
            host = next((j for j in hosts if everything[j].thickness > member.thickness), None)
            if depth and host is not None:
                cutter = _cutter(occ, member, end, depth)
                joined = made[host] + made[k] * cutter
                if joined.mass < (1 - FLAT) * made[host].mass:  # as where OpenCASCADE loses round ends that are flush
                    continue
                made[k] = made[k] - cutter
                made[host] = joined


def _slab(occ: ModuleType, member: MemberSolid, end: int, by: float) -> Any:
    """The end section swept on by some length, m."""
    y, z = float(member.outline.y[-end]), float(member.outline.z[-end])
    x = member.length if end else -by
    if member.outline.is_round:
        base = member.placed(np.array([x, 0.0, 0.0])) / MILLIMETRE
        return occ.Cylinder(occ.gp_Pnt(*base), occ.gp_Vec(*member.axes[0]), z / MILLIMETRE, by / MILLIMETRE)
    centre = member.placed(np.array([x + by / 2, 0.0, 0.0]))
    return _prism(occ, centre / MILLIMETRE, member.axes, np.array([by / 2, y, z]) / MILLIMETRE)


def _cutter(occ: ModuleType, member: MemberSolid, end: int, depth: float) -> Any:
    """A box around the last `depth` of a member, m."""
    reach = 2 * float(max(member.outline.y.max(), member.outline.z.max()))
    x = member.length + reach / 2 - depth / 2 if end else depth / 2 - reach / 2
    half = np.array([(reach + depth) / 2, reach, reach])
    return _prism(occ, member.placed(np.array([x, 0.0, 0.0])) / MILLIMETRE, member.axes, half / MILLIMETRE)


def _steep(member: MemberSolid, end: int) -> float:
    """How far from an end the contour is steeper than STEEP, m."""
    depth = 0.0
    for half in (member.outline.y, member.outline.z):
        x = member.outline.x if end == 0 else member.length - member.outline.x[::-1]
        size = half if end == 0 else half[::-1]
        slope = -np.diff(size) / np.diff(x)
        steep = slope > math.tan(math.radians(STEEP))
        if steep[0]:
            first = int(np.argmin(steep)) if not steep.all() else len(steep) - 1
            depth = max(depth, float(x[first]))
    return depth


def _box(shape: Any) -> Array:
    low, high = shape.bounding_box
    return np.array([[low.x, low.y, low.z], [high.x, high.y, high.z]])


def _lies_on(face: Any, pieces: Pieces, held: Held) -> bool:
    """Whether a face is part of the face of a piece that is held."""
    piece = pieces.all[held.piece]
    points = np.array([[p.x, p.y, p.z] for p in (*(v.p for v in face.vertices), face.center)]) * MILLIMETRE
    near = FLAT * (2 * float(piece.half.max()) if isinstance(piece, Block) else piece.length)
    local = piece.local(points)
    if held.axis == 3:
        assert isinstance(piece, Block)
        on_mantle = np.abs(np.linalg.norm(local[:-1, 1:], axis=1) - piece.half[1]) < near
        return bool(on_mantle.all() and abs(local[-1, 0]) < piece.half[0] - near)
    at = held.side * piece.half[held.axis] if isinstance(piece, Block) else piece.length * (held.side > 0)
    return bool((np.abs(local[:, held.axis] - at) < near).all())
