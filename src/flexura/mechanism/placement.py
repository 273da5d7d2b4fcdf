"""Rigid placements: rotations, translations and mirror images, over an optional design axis.

The one rotation convention of flexura: matrices are active and act on column vectors, v' = Q v; a positive angle
turns right-handed about its axis (Rodrigues 1840).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.duals import plain, real
from flexura.mechanism.base import Direction, Vector
from flexura.mechanism.description import Instance
from flexura.mechanism.patterns import CircularPattern, LinearPattern, MirrorPattern, Pattern
from flexura.mechanism.quantity import Scalar
from flexura.mechanism.solid_part import SolidPart


class Turn(NamedTuple):
    """A rotation by `angle` about `axis` through `centre`."""

    axis: Direction
    angle: Scalar
    centre: Vector


class Move(NamedTuple):
    """A translation."""

    by: Vector


class Reflect(NamedTuple):
    """A mirror image in the plane through `point` with the given normal."""

    normal: Direction
    point: Vector


Step = Turn | Move | Reflect


def copies(name: str, instance: Instance | SolidPart) -> list[tuple[str, tuple[Step, ...]]]:
    """Expand the patterns of an instance or a part: the name and the placing steps of every copy, in order."""
    zero: Vector = (0.0, 0.0, 0.0)
    turned: tuple[Step, ...] = tuple(Turn(r.axis, r.angle, zero) for r in instance.rotate)
    placed: list[tuple[Step, ...]] = [(*turned, Move(instance.at))]
    for pattern in instance.pattern:
        placed = [(*steps, *extra) for extra in _pattern_steps(pattern) for steps in placed]
    if not instance.pattern:
        return [(name, placed[0])]
    return [(f"{name}{k}", steps) for k, steps in enumerate(placed, start=1)]


def _pattern_steps(pattern: Pattern) -> list[tuple[Step, ...]]:
    match pattern:
        case CircularPattern():
            step: Scalar = 2 * np.pi / pattern.count if pattern.step is None else pattern.step
            turns = [Turn(pattern.axis, k * step, pattern.centre) for k in range(1, pattern.count)]
            return [(), *((turn,) for turn in turns)]
        case LinearPattern():
            x, y, z = pattern.step
            return [(), *((Move((k * x, k * y, k * z)),) for k in range(1, pattern.count))]
        case MirrorPattern():
            return [(), (Reflect(pattern.normal, pattern.point),)]


class Affine(NamedTuple):
    """x' = Q x + t with Q orthogonal (a mirror image has det Q = -1); leading axes count designs."""

    Q: Array
    t: Array

    def points(self, x: ArrayLike) -> Array:
        """Map points (..., n, 3)."""
        return real(x) @ np.swapaxes(self.Q, -1, -2) + self.t[..., None, :]

    def then(self, outer: Affine) -> Affine:
        """This placement followed by `outer`."""
        return Affine(outer.Q @ self.Q, np.einsum("...ij,...j->...i", outer.Q, self.t) + outer.t)


IDENTITY = Affine(np.eye(3), np.zeros(3))


def rotation_matrix(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Active rotation matrix (..., 3, 3) about `axis` (..., 3; any length) by `angle` (...), rad (Rodrigues)."""
    a = real(axis)
    x, y, z = np.moveaxis(a / np.linalg.norm(a, axis=-1, keepdims=True), -1, 0)
    c, s = _cos_sin(real(angle))
    v = 1 - c
    rows = [
        [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
        [x * y * v + z * s, c + y * y * v, y * z * v - x * s],
        [x * z * v - y * s, y * z * v + x * s, c + z * z * v],
    ]
    return np.stack([np.stack(np.broadcast_arrays(*row), axis=-1) for row in rows], axis=-2)


def _cos_sin(angle: Array) -> tuple[Array, Array]:
    """Cosine and sine that are exact at multiples of a quarter turn, so that squared-up mechanisms stay square."""
    c, s, size = np.cos(angle), np.sin(angle), abs(plain(angle))
    near_c, near_s = plain(c), plain(s)
    near_c, near_s = np.where(abs(near_c) < 1e-15, 0.0, near_c), np.where(abs(near_s) < 4e-16 * (1 + size), 0.0, near_s)
    near_c, near_s = np.where(near_s == 0, np.sign(near_c), near_c), np.where(near_c == 0, np.sign(near_s), near_s)
    return c + (near_c - plain(c)), s + (near_s - plain(s))


def turn(axis: ArrayLike, angle: ArrayLike, centre: ArrayLike) -> Affine:
    """Rotation about an axis through `centre` (..., 3)."""
    Q = rotation_matrix(axis, angle)
    c = real(centre)
    return Affine(Q, c - np.einsum("...ij,...j->...i", Q, c))


def reflect(normal: ArrayLike, point: ArrayLike) -> Affine:
    """Mirror image in the plane through `point` (..., 3) with `normal` (..., 3)."""
    n = real(normal)
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
    p = real(point)
    return Affine(np.eye(3) - 2 * n[..., :, None] * n[..., None, :], 2 * np.sum(n * p, -1)[..., None] * n)
