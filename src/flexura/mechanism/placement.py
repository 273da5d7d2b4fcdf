"""Rigid placements: rotations, translations and mirror images, over an optional design axis.

The one rotation convention of flexura: matrices are active and act on column vectors, v' = Q v; a positive angle
turns right-handed about its axis (Rodrigues 1840).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.mechanism.base import Direction, Vector
from flexura.mechanism.expression import Expression
from flexura.mechanism.quantity import Scalar
from flexura.mechanism.substructure import CircularPattern, Instance, LinearPattern, MirrorPattern, Pattern

if TYPE_CHECKING:
    from flexura.mechanism.layout import Child, Layout

Array = NDArray[np.float64]
Point = tuple[float, float, float]


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


def copies(name: str, instance: Instance) -> list[tuple[str, tuple[Step, ...]]]:
    """Expand the patterns of an instance: the name and the placing steps of every copy, in order."""
    zero: Vector = (0.0, 0.0, 0.0)
    own: tuple[Step, ...] = tuple(Turn(r.axis, r.angle, zero) for r in instance.rotate)
    placed: list[tuple[Step, ...]] = [(*own, Move(instance.at))]
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
        return np.asarray(x) @ np.swapaxes(self.Q, -1, -2) + self.t[..., None, :]

    def then(self, outer: Affine) -> Affine:
        """This placement followed by `outer`."""
        return Affine(outer.Q @ self.Q, np.einsum("...ij,...j->...i", outer.Q, self.t) + outer.t)


IDENTITY = Affine(np.eye(3), np.zeros(3))


def rotation_matrix(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Active rotation matrix (..., 3, 3) about `axis` (..., 3; any length) by `angle` (...), rad (Rodrigues)."""
    a = np.asarray(axis, dtype=float)
    x, y, z = np.moveaxis(a / np.linalg.norm(a, axis=-1, keepdims=True), -1, 0)
    c, s = _cos_sin(np.asarray(angle, dtype=float))
    v = 1 - c
    rows = [
        [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
        [x * y * v + z * s, c + y * y * v, y * z * v - x * s],
        [x * z * v - y * s, y * z * v + x * s, c + z * z * v],
    ]
    return np.stack([np.stack(np.broadcast_arrays(*row), axis=-1) for row in rows], axis=-2)


def _cos_sin(angle: Array) -> tuple[Array, Array]:
    """Cosine and sine that are exact at multiples of a quarter turn, so that squared-up mechanisms stay square."""
    c, s = np.cos(angle), np.sin(angle)
    c, s = np.where(abs(c) < 1e-15, 0.0, c), np.where(abs(s) < 4e-16 * (1 + abs(angle)), 0.0, s)
    return np.where(s == 0, np.sign(c), c), np.where(c == 0, np.sign(s), s)


def turn(axis: ArrayLike, angle: ArrayLike, centre: ArrayLike) -> Affine:
    """Rotation about an axis through `centre` (..., 3)."""
    Q = rotation_matrix(axis, angle)
    c = np.asarray(centre, dtype=float)
    return Affine(Q, c - np.einsum("...ij,...j->...i", Q, c))


def reflect(normal: ArrayLike, point: ArrayLike) -> Affine:
    """Mirror image in the plane through `point` (..., 3) with `normal` (..., 3)."""
    n = np.asarray(normal, dtype=float)
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
    p = np.asarray(point, dtype=float)
    return Affine(np.eye(3) - 2 * n[..., :, None] * n[..., None, :], 2 * np.sum(n * p, -1)[..., None] * n)


def node_positions(layout: Layout, values: Mapping[str, float]) -> dict[str, dict[str, Point]]:
    """Positions (x, y, z) in m of all exposed nodes of every prototype, each in the prototype's own frame.

    `values` are those of the parameters. Interface nodes that do not exist are left out.
    Raises ExpressionError when a parameter is missing.
    """
    found: dict[str, dict[str, Point]] = {}
    for name, prototype in layout.prototypes.items():
        here = {node: _point(at, values) for node, at in prototype.nodes.items()}
        here |= {key: _point(body.centre, values) for key, body in prototype.bodies.items()}
        for (of, _), group in groupby(layout.children[name], key=_alike):
            children = list(group)
            nodes = [node for node in layout.interface(of) if node in found[of]]
            if nodes:
                points = _placed(children, values).points(np.array([found[of][node] for node in nodes]))
                for child, placed in zip(children, points.tolist(), strict=True):
                    here |= {f"{child.name}.{n}": (p[0], p[1], p[2]) for n, p in zip(nodes, placed, strict=True)}
        found[name] = here
    return found


def _alike(child: Child) -> tuple[str, tuple[type, ...]]:
    return child.prototype, tuple(type(step) for step in child.steps)


def _placed(children: list[Child], values: Mapping[str, float]) -> Affine:
    """Placements (n, ...) of children whose steps are alike."""
    result = Affine(np.broadcast_to(np.eye(3), (len(children), 3, 3)), np.zeros((len(children), 3)))
    for steps in zip(*(child.steps for child in children), strict=True):
        result = result.then(_stacked(steps, values))
    return result


def _stacked(steps: tuple[Step, ...], values: Mapping[str, float]) -> Affine:
    fields = [np.array([_numbers(field, values) for field in column]) for column in zip(*steps, strict=True)]
    if isinstance(steps[0], Turn):
        return turn(fields[0], fields[1][:, 0], fields[2])
    if isinstance(steps[0], Reflect):
        return reflect(fields[0], fields[1])
    return Affine(np.broadcast_to(np.eye(3), (len(steps), 3, 3)), fields[0])


def _numbers(field: Scalar | Iterable[Scalar], values: Mapping[str, float]) -> list[float]:
    scalars = field if isinstance(field, tuple) else (field,)
    return [float(s.evaluate(values)) if isinstance(s, Expression) else float(s) for s in scalars]  # type: ignore[arg-type]


def _point(vector: Vector, values: Mapping[str, float]) -> Point:
    x, y, z = _numbers(vector, values)
    return x, y, z
