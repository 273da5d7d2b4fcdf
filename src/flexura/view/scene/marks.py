"""Marks that help to read a picture: how nodes are held, and where parts meet."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.mechanism import TOP, matching
from flexura.structure import FullOrderModel
from flexura.view.scene.meshes import Array, Index, Mesh, box, cone, frame_along
from flexura.view.scene.motions import Motions
from flexura.view.scene.scene import Collector, Kind, Look

MOST_NODES = 160
"""More nodes than this are not marked; they would hide the mechanism."""


def add_marks(collector: Collector, model: FullOrderModel, motions: Motions, look: Look) -> None:
    """Add supports and nodes, moving with the nodes."""
    size, names = collector.size, model.plan.topology.node_names
    bodies = _body_nodes(model)
    supports = [(node, held) for node, held in _supported(model) if not (all(held) and node in bodies)]
    supports = [supports[k] for k in look.chosen(len(supports))]
    for (node, held), footing in zip(supports, _footings(model, [n for n, _ in supports]), strict=True):
        if all(held):
            section = np.clip(1.3 * footing.section, 0.05 * size, 0.5 * size)
            wall = box(np.array([0.014 * size, *section]), size)
            points = (wall.points + np.array([0.007 * size, 0.0, 0.0])) @ footing.frame
            kind, faces = Kind.CLAMP, wall.faces
        else:
            mark = cone(0.022 * size, 0.036 * size, footing.frame[0])
            points, kind, faces = mark.points, Kind.PARTLY_HELD, mark.faces
        points = points + model.geometry.positions[node]
        collector.mesh(Mesh(points, faces), np.broadcast_to(motions.shift[node], points.shape), kind, names[node])
    nodes = shared_nodes(model)
    if len(nodes) <= MOST_NODES:
        for node in nodes:
            collector.dot(model.geometry.positions[node], motions.shift[node], Kind.NODE, names[node])


def _supported(model: FullOrderModel) -> list[tuple[int, tuple[bool, ...]]]:
    """Nodes named under `ground`, with what is held of tx ty tz rx ry rz."""
    layout, topology = model.plan.layout, model.plan.topology
    exposed = layout.exposed(TOP)
    held: dict[int, tuple[bool, ...]] = {}
    for text, support in layout.mechanism.ground.items():
        for name in matching(text, exposed):
            held.setdefault(topology.node((), name), support.held)
    return [(node, mask) for node, mask in held.items() if any(mask)]


def _body_nodes(model: FullOrderModel) -> set[int]:
    """Own nodes of bodies; a clamped body shows by its colour."""
    placed = model.plan.topology.copies
    return {
        offset + node
        for name, part in model.plan.parts.items()
        for node, _ in part.bodies.values()
        for offset in placed[name].offset
    }


class _Footing(NamedTuple):
    """How a supported node meets its members: frame (3, 3), axes as rows, the first away from them; width and
    thickness (2,), m, of the section along the second and third."""

    frame: Array
    section: Array


def _footings(model: FullOrderModel, nodes: list[int]) -> list[_Footing]:
    if not nodes:
        return []
    x, root = model.geometry.positions, model.plan.topology.root
    node, frames, sections = _member_ends(model)
    reach = 1e-6 * (1e-3 + float(np.ptp(x, axis=0).max()))
    footings = []
    for k in nodes:
        at = np.flatnonzero(root[node] == root[k])
        at = at[np.linalg.norm(x[node[at]] - x[k], axis=1) <= reach]
        away = frames[at, 0].sum(axis=0)
        if len(at) == 1:
            footings.append(_Footing(frames[at[0]], sections[at[0]]))
        elif len(at) and np.linalg.norm(away) > 1e-3:
            footings.append(_Footing(frame_along(away), np.full(2, sections[at].max())))
        else:
            footings.append(_Footing(frame_along(np.array([0.0, 0.0, -1.0])), np.zeros(2)))
    return footings


def _member_ends(model: FullOrderModel) -> tuple[Index, Array, Array]:
    """All ends of members: their nodes (k,), frames (k, 3, 3) with the first axis leaving the member, and width and
    thickness (k, 2), m, of the sections there."""
    plan, geometry = model.plan, model.geometry
    nodes, frames, sizes = [np.empty(0, dtype=np.intp)], [np.empty((0, 3, 3))], [np.empty((0, 2))]
    for name, part in plan.parts.items():
        if not part.members:
            continue
        own, placed = geometry.parts[name], plan.topology.copies[name]
        _, _, nu, _ = part.table.moduli(model.values)
        sections = part.table.section_properties(model.values, nu, own.length)
        size = 2 * np.sqrt(3 * np.stack([sections.Iz, sections.Iy], axis=-1) / sections.A[:, None])
        R = own.R @ np.swapaxes(geometry.Q[placed.number], -1, -2)[:, None]
        for end, element, sign in ((0, part.first[:-1], -1.0), (1, part.first[1:] - 1, 1.0)):
            node = np.array(placed.offset)[:, None] + part.ends[:, end]
            turned = R * np.array([sign, 1.0, 1.0])[:, None]
            turned[np.linalg.det(turned) < 0, 2] *= -1
            nodes.append(node.ravel())
            frames.append(turned.reshape(-1, 3, 3))
            sizes.append(np.broadcast_to(size[element], (*node.shape, 2)).reshape(-1, 2))
    return np.concatenate(nodes), np.concatenate(frames), np.concatenate(sizes)


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
        for offset in plan.topology.copies[name].offset:
            chosen += [offset + k for k in own]
            named += [offset + k for k in range(part.n_own)]
    bodies = _body_nodes(model)
    nodes = [node for node in chosen if node not in bodies] or [node for node in named if node not in bodies]
    if not nodes:
        return []
    x = model.geometry.positions[nodes]
    grid = np.round(x / (1e-6 * (1e-3 + float(np.ptp(x, axis=0).max()))))
    _, first = np.unique(grid, axis=0, return_index=True)
    return [nodes[k] for k in sorted(first)]
