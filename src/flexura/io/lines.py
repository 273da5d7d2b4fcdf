"""The mesh of a full-order model as points and lines, for programs that draw it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array, Index
from flexura.structure import FullOrderModel

KINDS = ("link", "flexure", "body", "spring", "superelement")


@dataclass(frozen=True)
class Lines:
    """Points (n, 3), m, which are the nodes with a place; lines (e, 2) between them, each with the number of its part.

    `node` (n,) are the numbers of the points among all nodes of the model. `names` and `kinds` are those of the parts:
    a member is a chain of lines, a body a star of them from its centre to the nodes that it carries.
    """

    points: Array
    node: Index
    lines: Index
    part: Index
    names: list[str]
    kinds: list[str]


def lines_of(model: FullOrderModel) -> Lines:
    """Points and lines of a full-order model; arms from members' ends to nodes that stand apart are not drawn."""
    topology = model.plan.topology
    node = np.flatnonzero(topology.has_position)
    point = np.cumsum(topology.has_position) - 1
    found: list[tuple[str, str, Index]] = []
    for name, placed in topology.copies.items():
        part = model.plan.parts[name]
        flexures = set(model.plan.layout.prototypes[name].flexures)
        own = [
            (m, "flexure" if m in flexures else "link", part.connectivity[part.first[k] : part.first[k + 1]])
            for k, m in enumerate(part.members)
        ]
        own += [(b, "body", _star(n, part.carried.get(n, []))) for b, (n, _) in part.bodies.items()]
        own += [(key, "spring", _star(s.nodes[0], s.nodes[1:])) for key, s in part.springs.items()]
        own += [
            (s, "superelement", _star(n[0], [k for k in n[1:] if k < part.n_positioned]))
            for s, (n, _, _) in part.superelements.items()
        ]
        for path, offset in zip(placed.paths, placed.offset, strict=True):
            found += [(".".join((*path, key)), kind, point[offset + ends]) for key, kind, ends in own if len(ends)]
    part_of = np.repeat(np.arange(len(found)), [len(ends) for _, _, ends in found])
    ends = np.concatenate([ends for _, _, ends in found]) if found else np.empty((0, 2), dtype=np.intp)
    names, kinds = [name for name, _, _ in found], [kind for _, kind, _ in found]
    return Lines(model.positions[node], node, ends, part_of, names, kinds)


def _star(centre: int, others: list[int]) -> Index:
    return np.array([(centre, k) for k in others if k != centre], dtype=np.intp).reshape(-1, 2)
