"""Pieces of a part drawn by OpenCASCADE, in millimetres, and glued into one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError, need
from flexura.fem import MILLIMETRE, MemberSolid, body_shape, box_shape, member_shape
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
    made = [body_shape(occ, piece) if isinstance(piece, Block) else member_shape(occ, piece) for piece in pieces.all]
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
    return box_shape(occ, centre / MILLIMETRE, member.axes, np.array([by / 2, y, z]) / MILLIMETRE)


def _cutter(occ: ModuleType, member: MemberSolid, end: int, depth: float) -> Any:
    """A box around the last `depth` of a member, m."""
    reach = 2 * float(max(member.outline.y.max(), member.outline.z.max()))
    x = member.length + reach / 2 - depth / 2 if end else depth / 2 - reach / 2
    half = np.array([(reach + depth) / 2, reach, reach])
    return box_shape(occ, member.placed(np.array([x, 0.0, 0.0])) / MILLIMETRE, member.axes, half / MILLIMETRE)


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
