"""Plane figures of sheets: outlines, holes, slits and strips, and the curves along which nodes hold them.

Coordinates are in the plane of the sheet, m.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam import block_rotation, member_frame, rigid_arm
from flexura.fem.geometry import SolidMaterial
from flexura.fem.surfaces import Surface
from flexura.mechanism import Diaphragm, FlatSpring, Material, edges_of
from flexura.structure import least_aligned


class Curve(NamedTuple):
    """A line or an arc through points (2 or 3, 2), m, or a circle about the first of two points through the other."""

    points: tuple[tuple[float, float], ...]
    is_circle: bool = False

    def distance(self, at: Array) -> Array:
        """Distances (n,), m, of points (n, 2) from the curve."""
        p = np.array(self.points)
        if self.is_circle:
            return np.abs(np.linalg.norm(at - p[0], axis=1) - np.linalg.norm(p[1] - p[0]))
        if len(p) == 2:
            along = p[1] - p[0]
            share = np.clip((at - p[0]) @ along / (along @ along), 0.0, 1.0)
            return np.linalg.norm(at - p[0] - share[:, None] * along, axis=1)
        centre = centre_of(p)
        off = np.abs(np.linalg.norm(at - centre, axis=1) - np.linalg.norm(p[0] - centre))
        turns = [_turn(p[0] - centre, x - centre) for x in (p[1], p[2])]
        sign = 1.0 if 0 < turns[0] < turns[1] else -1.0
        reached = _turn(p[0] - centre, at - centre, sign)
        beyond = reached > (turns[1] if sign > 0 else 2 * np.pi - turns[1])
        ends = np.minimum(*(np.linalg.norm(at - x, axis=1) for x in (p[0], p[2])))
        return np.where(beyond, ends, off)


Loop = tuple[Curve, ...]


def centre_of(p: Array) -> Array:
    """Centre (2,) of the circle through three points (3, 2)."""
    a, b = p[1] - p[0], p[2] - p[0]
    return p[0] + np.linalg.solve(2 * np.stack([a, b]), np.array([a @ a, b @ b]))


def _turn(start: Array, to: Array, sign: float = 1.0) -> Array:
    """Angle (...) from one vector (2,) to others (..., 2), from 0 to a full turn, left or right round."""
    cross = start[0] * to[..., 1] - start[1] * to[..., 0]
    return np.mod(sign * np.arctan2(cross, to @ start), 2 * np.pi)


@dataclass(frozen=True)
class Figure:
    """What is inside an outline but not in holes nor cut out, and, where strips are given, in one of these.

    `pads` are the curves, on outline or holes, along which each node holds the sheet.
    """

    outline: Loop
    holes: tuple[Loop, ...]
    cuts: tuple[Loop, ...]
    strips: tuple[Loop, ...]
    pads: tuple[Loop, ...]


def polygon(corners: Sequence[Array]) -> Loop:
    """A closed loop of straight lines through points (n, 2)."""
    places = [(float(x), float(y)) for x, y in corners]
    return tuple(Curve(pair) for pair in pairwise([*places, places[0]]))


def circle(radius: float, centre: tuple[float, float] = (0.0, 0.0)) -> Loop:
    """A circle."""
    return (Curve((centre, (centre[0] + radius, centre[1])), is_circle=True),)


def slit(ends: tuple[tuple[float, float], tuple[float, float]], width: float, turn: float) -> Loop:
    """A slit with round ends along a spiral between two points, radius and angle, turned by an angle, rad."""
    (r, angle), (to_r, to_angle) = ends
    share = np.linspace(0.0, 1.0, max(5, int(np.ceil(abs(to_angle - angle) / 0.1)) + 1))
    radius, at = r + (to_r - r) * share, angle + turn + (to_angle - angle) * share
    x = np.stack([radius * np.cos(at), radius * np.sin(at)], axis=-1)
    out, around = np.stack([np.cos(at), np.sin(at)], axis=-1), np.stack([-np.sin(at), np.cos(at)], axis=-1)
    along = (to_r - r) * out + ((to_angle - angle) * radius)[:, None] * around
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    across = width / 2 * np.stack([-along[:, 1], along[:, 0]], axis=-1)
    ends_out = x[-1] + width / 2 * along[-1], x[0] - width / 2 * along[0]
    sides = [x - across, (x + across)[::-1]]
    if abs(to_angle - angle) < 1e-12:
        sides = [side[[0, -1]] for side in sides]
    runs = [sides[0], np.array([sides[0][-1], ends_out[0], sides[1][0]])]
    runs += [sides[1], np.array([sides[1][-1], ends_out[1], sides[0][0]])]
    return tuple(Curve(tuple((float(a), float(b)) for a, b in run)) for run in runs)


def strip(width: float, length: float, angle: float) -> Loop:
    """A strip from the origin outwards, along an angle, rad."""
    along, across = np.array([np.cos(angle), np.sin(angle)]), width / 2 * np.array([-np.sin(angle), np.cos(angle)])
    return polygon([-across, length * along - across, length * along + across, across])


def ring(diaphragm: Diaphragm) -> Figure:
    """The figure of a diaphragm of numbers: held along rim and hub."""
    rim, hub = circle(_number(diaphragm.rim_diameter) / 2), circle(_number(diaphragm.hub_diameter) / 2)
    cuts = tuple(
        slit((_point(own.from_), _point(own.to)), _number(own.width), 2 * np.pi * k / own.count)
        for own in diaphragm.slits
        for k in range(own.count)
    )
    spokes, strips = diaphragm.spokes, ()
    if spokes is not None:
        angles = 2 * np.pi * np.arange(spokes.count) / spokes.count
        reach = 1.1 * _number(diaphragm.rim_diameter) / 2
        strips = tuple(strip(_number(spokes.width), reach, angle) for angle in angles.tolist())
    return Figure(rim, (hub,), cuts, strips, (rim, hub))


def outlined(spring: FlatSpring) -> Figure:
    """The figure of a flat spring of numbers: held along its pads."""
    edges = [Curve(tuple(at for at in own[:3] if at is not None)) for own in edges_of(spring.outline)]
    holes = tuple(circle(_number(hole.diameter) / 2, _point(hole.centre)) for hole in spring.holes)
    pads = [[edges[k - 1] for k in pad.edges] + [holes[k - 1][0] for k in pad.holes] for pad in spring.pads.values()]
    return Figure(tuple(edges), holes, (), (), tuple(tuple(pad) for pad in pads))


class PlacedSheet(NamedTuple):
    """A figure with its thickness, m, and material; origin (3,), m, and axes (3, 3) of its plane as rows, and what
    leads from the displacements of each node to those of its pad about that origin (6, 6)."""

    figure: Figure
    thickness: float
    material: SolidMaterial
    origin: Array
    axes: Array
    to_pads: list[Array]

    def surface(self, flat: Surface, T: Array) -> Surface:
        """A surface in axes of the plane, in place; T leads from coordinates of the nodes to those of the pads."""
        rows = np.einsum("ij,sic->sjc", self.axes, flat.rows.reshape(-1, 3, len(T))).reshape(-1, len(T)) @ T
        return Surface(flat.points @ self.axes + self.origin, flat.facets, rows)


def sheet_of(described: Diaphragm | FlatSpring, metal: Material, positions: Array) -> PlacedSheet:
    """A sheet of numbers whose nodes are at `positions` (n, 3), m, in the frame of its substructure."""
    normal = np.array(described.normal, dtype=float)[None]
    reference = least_aligned(normal) if described.reference is None else np.array(described.reference, dtype=float)
    axes = member_frame(normal, reference)[0, [2, 1, 0]] * np.array([[1.0], [-1.0], [1.0]])
    is_ring = isinstance(described, Diaphragm)
    figure = ring(described) if is_ring else outlined(described)
    origin = positions[1] if is_ring else np.array(described.origin, dtype=float)
    E, nu = _number(metal.E), _number(metal.nu if metal.nu is not None else metal.E / (2 * _number(metal.G)) - 1)
    X = block_rotation(axes)
    return PlacedSheet(
        figure,
        _number(described.thickness),
        SolidMaterial(described.material, E, nu, _number(metal.rho)),
        origin,
        axes,
        [X @ rigid_arm(origin - position) for position in positions],
    )


def _point(polar: Sequence[object]) -> tuple[float, float]:
    return _number(polar[0]), _number(polar[1])


def _number(value: Any) -> float:
    """A number of a description in which expressions have their values."""
    return float(value)
