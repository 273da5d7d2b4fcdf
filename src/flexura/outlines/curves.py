"""Curves as circular arcs within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from flexura.arrays import Array
from flexura.outlines.outline import Segment

NEAR = 1e-5
"""Distance of arcs from the curve that they stand for, over the size of the curve."""

DEEPEST = 16
"""How often a curve is halved at most."""

Curve = Callable[[Array], Array]
"""Points (n, 2), m, at parameters (n,)."""


def as_arcs(curve: Curve, first: float, last: float, layer: str = "", pieces: int = 4) -> list[Segment]:
    """Arcs through points of a smooth curve from one parameter to another, at most NEAR of its size beside it: each
    through three points, halved until those between are near enough."""
    spread = curve(np.linspace(first, last, 4 * pieces + 1))
    near = NEAR * max(float(np.ptp(spread, axis=0).max()), 1e-300)
    ends = np.linspace(first, last, pieces + 1)
    return [own for a, b in pairwise(ends) for own in _arcs(curve, float(a), float(b), layer, near, 0)]


def _arcs(curve: Curve, a: float, b: float, layer: str, near: float, depth: int) -> Iterator[Segment]:
    points = curve(np.linspace(a, b, 5))
    start, one, middle, three, end = points
    arc = Segment(_point(start), _point(end), bulge_through(start, middle, end), layer)
    if arc.is_line:
        away = np.abs(_beside(points, start, end))
    else:
        away = np.abs(np.linalg.norm(np.array([one, three]) - arc.centre, axis=1) - arc.radius)
    if depth >= DEEPEST or (float(away.max()) <= near and abs(arc.bulge) < 0.5):
        yield arc
        return
    half = (a + b) / 2
    yield from _arcs(curve, a, half, layer, near, depth + 1)
    yield from _arcs(curve, half, b, layer, near, depth + 1)


def bulge_through(start: Array, middle: Array, end: Array) -> float:
    """The bulge of the arc through three points (2,); 0 where they are in line."""
    u, v = middle - start, end - middle
    turn = math.atan2(float(u[0] * v[1] - u[1] * v[0]), float(u @ v))
    return 0.0 if abs(turn) < 1e-9 else math.tan(turn / 2)


def _beside(points: Array, start: Array, end: Array) -> Array:
    """Distances (n,) of points from a line."""
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-300)
    away = points - start
    return away[:, 0] * along[1] - away[:, 1] * along[0]


def _point(at: Array) -> tuple[float, float]:
    return float(at[0]), float(at[1])
