"""Where the nodes of every prototype are, for one design."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import groupby

import numpy as np

from flexura.expressions import Expression
from flexura.mechanism.base import Vector
from flexura.mechanism.layout import Child, Layout
from flexura.mechanism.placement import Affine, Reflect, Step, Turn, reflect, turn
from flexura.mechanism.quantity import Scalar

Point = tuple[float, float, float]


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
