"""Prisms: polygons in a plane that are extruded across it, and where points and lines are beside and in them."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array, Bools

CHUNK = 4_000_000
"""Pairs of points and sides that are looked at together."""


def is_within(outline: Array, points: Array) -> Bools:
    """Whether points (..., 2) are within a polygon (n, 2): a ray from them crosses its sides an odd number of times."""
    a, b = outline, np.roll(outline, -1, axis=0)
    x, y = points[..., None, 0], points[..., None, 1]
    straddles = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(a[:, 1] == b[:, 1], 1.0, b[:, 1] - a[:, 1])
    right = x < a[:, 0] + (y - a[:, 1]) / rise * (b[:, 0] - a[:, 0])
    return np.asarray((straddles & right).sum(axis=-1) % 2 == 1, dtype=bool)


def nearest_side(outline: Array, points: Array) -> Array:
    """The nearest places (..., 2) on the sides of a polygon (n, 2) to points (..., 2)."""
    flat = points.reshape(-1, 2)
    step = max(1, CHUNK // len(outline))
    parts = [_nearest_side(outline, flat[k : k + step]) for k in range(0, len(flat), step)]
    return np.concatenate(parts).reshape(points.shape) if parts else points


def _nearest_side(outline: Array, points: Array) -> Array:
    a, along = outline, np.roll(outline, -1, axis=0) - outline
    away = points[:, None, :] - a
    share = np.clip((away * along).sum(axis=-1) / (along * along).sum(axis=-1), 0.0, 1.0)
    near = a + share[..., None] * along
    first = np.linalg.norm(near - points[:, None, :], axis=-1).argmin(axis=1)
    return near[np.arange(len(points)), first]


def beyond_prism(outline: Array, half: float, at: Array) -> Array:
    """How far (...) points (..., 3) are out of a prism of a polygon (n, 2), from -half to half, m; negative inside."""
    flat = at[..., :2]
    side = np.linalg.norm(flat - nearest_side(outline, flat), axis=-1)
    return np.maximum(np.where(is_within(outline, flat), -side, side), np.abs(at[..., 2]) - half)


def nearest_in_prism(outline: Array, half: float, at: Array) -> Array:
    """The nearest places (p, 3) of a prism to points (p, 3)."""
    flat = at[:, :2]
    near = np.where(is_within(outline, flat)[:, None], flat, nearest_side(outline, flat))
    return np.concatenate([near, np.clip(at[:, 2:], -half, half)], axis=1)


def crossed(outline: Array, half: float, at: Array, slope: Array) -> Array:
    """Where (n + 2, p) lines at + s slope, both (p, 3), cross the planes of a prism's faces; infinite beside sides."""
    a, along = outline[:, None, :], (np.roll(outline, -1, axis=0) - outline)[:, None, :]
    away = at[:, :2] - a
    with np.errstate(divide="ignore", invalid="ignore"):
        denominator = along[..., 0] * slope[:, 1] - along[..., 1] * slope[:, 0]
        s = (along[..., 1] * away[..., 0] - along[..., 0] * away[..., 1]) / denominator
        share = (slope[:, 1] * away[..., 0] - slope[:, 0] * away[..., 1]) / denominator
        ends = np.stack([(-half - at[:, 2]) / slope[:, 2], (half - at[:, 2]) / slope[:, 2]])
    sides = np.where((share >= 0) & (share <= 1), s, np.inf)
    return np.nan_to_num(np.concatenate([sides, ends]), nan=np.inf, neginf=-np.inf, posinf=np.inf)
