"""Marks that help to read a picture: how nodes are held, and where parts meet."""

from __future__ import annotations

import numpy as np

from flexura.mechanism.layout import TOP, matching
from flexura.structure import FullOrderModel
from flexura.view.meshes import Array, Mesh, box, cone, frame_along
from flexura.view.scene import Collector, Kind

MOST_NODES = 160
"""More nodes than this are not marked; they would hide the mechanism."""


def add_marks(collector: Collector, model: FullOrderModel, u: Array) -> None:
    """Add supports and nodes; u (n_nodes, 6) are the displacements of the nodes."""
    size = collector.size
    supports = _supported(model)
    outward = _outward(model, [node for node, _ in supports])
    for (node, held), (away, section) in zip(supports, outward, strict=True):
        at = model.geometry.positions[node]
        if all(held):
            side = max(0.035 * size, 1.5 * section)
            thickness = 0.012 * size
            wall = box(np.array([thickness, side, side]), side / 3)
            points = (wall.points + [thickness / 2, 0.0, 0.0]) @ frame_along(away) + at
            collector.mesh(Mesh(points, wall.faces), np.broadcast_to(u[node, :3], points.shape), Kind.CLAMP)
        else:
            mark = cone(0.022 * size, 0.036 * size, away)
            points = mark.points + at
            collector.mesh(Mesh(points, mark.faces), np.broadcast_to(u[node, :3], points.shape), Kind.PARTLY_HELD)
    nodes = shared_nodes(model)
    if len(nodes) <= MOST_NODES:
        for node in nodes:
            collector.dot(model.geometry.positions[node], u[node, :3], Kind.NODE)


def _supported(model: FullOrderModel) -> list[tuple[int, tuple[bool, ...]]]:
    """Nodes named under `ground`, with what is held of tx ty tz rx ry rz."""
    layout, topology = model.plan.layout, model.plan.topology
    exposed = layout.exposed(TOP)
    held: dict[int, tuple[bool, ...]] = {}
    for text, support in layout.mechanism.ground.items():
        for name in matching(text, exposed):
            held.setdefault(topology.node((), name), support.held)
    return [(node, mask) for node, mask in held.items() if any(mask)]


def _outward(model: FullOrderModel, nodes: list[int]) -> list[tuple[Array, float]]:
    """For each node the direction (3,) away from the members that end there, and the width of their sections, m."""
    if not nodes:
        return []
    x, topology = model.geometry.positions, model.plan.topology
    away, width = np.zeros((len(nodes), 3)), np.zeros(len(nodes))
    reach = 1e-6 * (1e-3 + float(np.ptp(x, axis=0).max()))
    for name, part in model.plan.parts.items():
        if not part.members:
            continue
        _, _, nu, _ = part.table.moduli(model.values)
        sections, _ = part.table.section_properties(model.values, nu, model.geometry.parts[name].length)
        largest = 2 * np.sqrt(3 * np.maximum(sections.Iy, sections.Iz) / sections.A)
        for offset in topology.placed[name].offset:
            ends = part.ends + offset
            for end, element in ((0, part.first[:-1]), (1, part.first[1:] - 1)):
                here, there = ends[:, end], ends[:, 1 - end]
                for k, node in enumerate(nodes):
                    at = (topology.root[here] == topology.root[node]) & (
                        np.linalg.norm(x[here] - x[node], axis=1) <= reach
                    )
                    if at.any():
                        span = x[here[at]] - x[there[at]]
                        away[k] += (span / np.linalg.norm(span, axis=1, keepdims=True)).sum(axis=0)
                        width[k] = max(width[k], float(largest[element[at]].max()))
    clear = np.linalg.norm(away, axis=1) > 1e-3
    away[~clear] = (0.0, 0.0, -1.0)
    return list(zip(away, width.tolist(), strict=True))


def shared_nodes(model: FullOrderModel) -> list[int]:
    """Nodes where parts meet: interfaces, joined and carried nodes, one for each place; or, when a mechanism has
    none of these, its named nodes."""
    plan = model.plan
    chosen: list[int] = []
    named: list[int] = []
    for name, part in plan.parts.items():
        interface = set(plan.layout.interface(name))
        own = [k for k, node in enumerate(part.node_names[: part.n_own]) if node in interface]
        own += [k for joint in part.joints for k in joint]
        own += [k for carried in part.carried.values() for k in carried]
        bodies = {node for node, _ in part.bodies.values()}
        for offset in plan.topology.placed[name].offset:
            chosen += [offset + k for k in own if k not in bodies]
            named += [offset + k for k in range(part.n_own) if k not in bodies]
    nodes = chosen or named
    if not nodes:
        return []
    x = model.geometry.positions[nodes]
    grid = np.round(x / (1e-6 * (1e-3 + float(np.ptp(x, axis=0).max()))))
    _, first = np.unique(grid, axis=0, return_index=True)
    return [nodes[k] for k in sorted(first)]
