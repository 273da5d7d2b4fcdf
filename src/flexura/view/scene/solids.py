"""The solids of a mechanism, as points that move with its nodes: geometry only, no drawing.

Actuators and sensors as arrows and marks that move with their nodes; piezo stacks are solids and drawn elsewhere.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis import StressProfile
from flexura.errors import OptionError
from flexura.mechanism import TOP, BaseMotion, BaseRotation, ForceSensor, MomentActuator, PiezoStack, matching
from flexura.motion import Frames, pose_of
from flexura.solid.mesh import SurfaceShape
from flexura.structure import Copies, FullOrderModel
from flexura.view.scene.discrete_elements import add_discrete_elements
from flexura.view.scene.members import add_members, stresses_along
from flexura.view.scene.meshes import Array, Index, Mesh, box, cone, frame_along, sphere
from flexura.view.scene.scene import Collector, Kind, Look, Motions, Solids

LENGTH, WIDTH, BALL = 0.13, 0.011, 0.014
"""Length and half width of an arrow, and radius of a sensor, relative to the mechanism."""


def add_channels(collector: Collector, model: FullOrderModel, motions: Motions, look: Look) -> None:
    """Add described actuators and sensors, each where it is and along its positive direction."""
    size = collector.size
    for placed in model.plan.topology.copies.values():
        channels = placed.part.channels
        for copy in look.chosen(len(placed.paths)) if channels.nodes else ():
            prefix = "".join(f"{step}." for step in placed.paths[copy])
            for key, actuator in channels.actuators.items():
                if not isinstance(actuator, PiezoStack):
                    own = _Placed(model, motions, placed, int(copy), ("actuator", key))
                    turns = isinstance(actuator, MomentActuator | BaseRotation)
                    own.add_arrow(collector, prefix + key, size, turns)
            for key, sensor in channels.sensors.items():
                source = ("actuator", sensor.actuator) if isinstance(sensor, ForceSensor) else ("sensor", key)
                _Placed(model, motions, placed, int(copy), source).add_mark(collector, prefix + key, size)


class _Placed:
    """An actuator or a sensor of one copy of a part: nodes, and its direction (3,), global frame; None where it has
    none."""

    def __init__(
        self, model: FullOrderModel, motions: Motions, placed: Copies, copy: int, own: tuple[str, str]
    ) -> None:
        channels, geometry = placed.part.channels, model.geometry
        number = placed.number[copy]
        described = (channels.actuators if own[0] == "actuator" else channels.sensors)[own[1]]
        self.nodes = [placed.offset[copy] + node for node in channels.nodes[own]]
        if isinstance(described, BaseMotion | BaseRotation):
            self.nodes = _held(model)
        self.x, self.motions = geometry.positions, motions
        along = channels.number(*own, "direction", model.values)
        if along is not None:
            axial = isinstance(described, MomentActuator | BaseRotation)
            along = geometry.Q[number] @ along * (round(float(np.linalg.det(geometry.Q[number]))) if axial else 1)
        elif len(self.nodes) == 2:
            along = self.x[self.nodes[1]] - self.x[self.nodes[0]]
        length = 0.0 if along is None else float(np.linalg.norm(along))
        self.direction = along / length if along is not None and length > 0 else None

    def add_arrow(self, collector: Collector, name: str, size: float, turns: bool) -> None:
        """An arrow from the node, or from the second of two, and one the other way at the first."""
        if self.direction is None or not self.nodes:
            return
        senses = (-1.0, 1.0) if len(self.nodes) == 2 else (1.0,)
        for node, sense in zip(self.nodes, senses, strict=True):
            way = sense * self.direction
            points, tip, heading = _ring(way, size) if turns else _shaft(way, size)
            self._path(collector, name, node, points)
            head = cone(WIDTH * size, 3 * WIDTH * size, -heading, sides=8)
            self._mesh(collector, name, node, Mesh(head.points + tip, head.faces), Kind.ACTUATOR)

    def add_mark(self, collector: Collector, name: str, size: float) -> None:
        """A small ball at each node, with a line along what is read."""
        for node in self.nodes:
            self._mesh(collector, name, node, sphere(BALL * size, 8), Kind.SENSOR)
        if self.direction is not None and self.nodes:
            reach = np.outer([0.0, 4 * BALL * size], self.direction)
            self._path(collector, name, self.nodes[-1], reach, Kind.SENSOR)

    def _path(self, collector: Collector, name: str, node: int, points: Array, kind: Kind = Kind.ACTUATOR) -> None:
        collector.path(self.x[node] + points, self.motions.of(node).carried(points), kind, name)

    def _mesh(self, collector: Collector, name: str, node: int, mesh: Mesh, kind: Kind) -> None:
        moved = self.motions.of(node).carried(mesh.points)
        collector.mesh(Mesh(self.x[node] + mesh.points, mesh.faces), moved, kind, name)


def _shaft(way: Array, size: float) -> tuple[Array, Array, Array]:
    """A straight arrow from a node: points (2, 3), where its tip is, and where it points."""
    return np.outer([0.0, LENGTH * size], way), (LENGTH + 3 * WIDTH) * size * way, way


def _ring(way: Array, size: float) -> tuple[Array, Array, Array]:
    """Three quarters of a circle about an axis, right-handed: points (k, 3), where the tip is, and where it points."""
    _, first, second = frame_along(way)
    angle = np.linspace(0.0, 1.5 * np.pi, 25)
    points = LENGTH / 2 * size * (np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second))
    return points, points[-1] + 3 * WIDTH * size * first, first


def _held(model: FullOrderModel) -> list[int]:
    """The first node that is held, which moves with the base."""
    topology = model.plan.topology
    names = model.plan.layout.exposed(TOP)
    held = [k for k in (topology.node((), name) for name in names) if topology.held[topology.root[k]].any()]
    return held[:1]


SMALL = 1e-5
"""Displacements over the size of a mechanism that are small."""

PICTURE = Look()


def solids(
    model: FullOrderModel,
    displacements: ArrayLike | None = None,
    flagged: Collection[str] = frozenset(),
    look: Look = PICTURE,
) -> Solids:
    """The solids of a mechanism, moving with its nodes.

    displacements: (n_nodes, 6), m and rad, global frame, as `FullOrderModel.node_displacements` gives them for one
    vector; none for a mechanism that stands still, at rest or at the pose that is described. flagged: names of members
    and bodies with warnings, such as `leaf1.blade`, or `leaf.blade` for all copies. Motions are linear in the
    displacements. Members carry their real sections; the number of faces stays near that of `look`, and members of very
    large mechanisms become lines. Raises OptionError when the displacements are not finite or have another shape, or
    when the model holds a stack of designs.
    """
    u = node_motions(model, displacements)
    turned = float(np.sqrt((u[:, 3:] ** 2).sum(axis=1).max(initial=0.0)))
    if (posed := pose_of(model)) is not None:
        return replace(_moving_on(model, posed.pose.state.frames, u, flagged, look), rotation=turned)
    return _collected(model, Motions.small(u), flagged, look).solids(turned)


def moved_solids(
    model: FullOrderModel,
    frames: Frames,
    profiles: Mapping[str, Sequence[StressProfile]],
    flagged: Collection[str] = frozenset(),
    look: Look = PICTURE,
) -> Solids:
    """The solids of a mechanism whose nodes have moved and turned as far as their frames have.

    `motions` lead from rest to there; `values` are stresses, Pa, by `profiles` of all prototypes, of the first state.
    Raises OptionError when the model holds a stack of designs.
    """
    node_motions(model, None)
    parts = _collected(model, Motions.finite(model, frames), flagged, look).solids(0.0)
    return replace(parts, values=stresses_along(parts, profiles))


def _moving_on(model: FullOrderModel, frames: Frames, u: Array, flagged: Collection[str], look: Look) -> Solids:
    """The solids where frames have moved, with small motions from there: the derivative by displacements u (n, 6)."""
    here = moved_solids(model, frames, {}, flagged, look)
    points = here.points + here.motions
    largest = float(np.abs(u * [1, 1, 1, *[here.size()] * 3]).max(initial=0.0))
    motions = np.zeros(points.shape)
    if largest:
        step = SMALL * here.size() / largest
        moved = np.concatenate([u, np.zeros((1, 6))])
        ahead, behind = (moved_solids(model, frames.moved(sign * step * moved), {}, flagged, look) for sign in (1, -1))
        motions = (ahead.motions - behind.motions) / (2 * step)
    return replace(here, points=points, motions=motions)


def _collected(model: FullOrderModel, motions: Motions, flagged: Collection[str], look: Look) -> Collector:
    collector = Collector()
    add_members(collector, model, motions, flagged, look)
    collector.include(model.geometry.positions)
    add_discrete_elements(collector, model, motions, flagged, look)
    add_marks(collector, model, motions, look)
    if look.channels:
        add_channels(collector, model, motions, look)
    return collector


def meshed_solids(
    model: FullOrderModel, displacements: ArrayLike, surfaces: Sequence[SurfaceShape], mode: int
) -> Solids:
    """The same with the surfaces of solid meshes in place of the members, moving in their mode of position `mode`."""
    u = node_motions(model, displacements)
    collector = Collector()
    for surface in surfaces:
        collector.mesh(
            Mesh(surface.points, surface.facets), surface.displacement[:, :, mode], Kind.FLEXURE, surface.name
        )
    collector.include(model.geometry.positions)
    motions = Motions.small(u)
    add_discrete_elements(collector, model, motions, frozenset(), PICTURE)
    add_marks(collector, model, motions, PICTURE)
    return collector.solids(float(np.sqrt((u[:, 3:] ** 2).sum(axis=1).max(initial=0.0))))


def node_motions(model: FullOrderModel, displacements: ArrayLike | None) -> Array:
    """Displacements (n_nodes, 6) of all nodes; zero when none are given. Raises OptionError as `solids` does."""
    n = model.plan.topology.n_nodes
    if model.geometry.positions.ndim != 2 or model.values.ndim != 1:
        raise OptionError("a picture shows one design; this model holds a stack of them")
    if displacements is None:
        return np.zeros((n, 6))
    u = np.asarray(displacements, dtype=float)
    if u.shape != (n, 6):
        raise OptionError(f"displacements have shape ({n}, 6), one row for each node; found {u.shape}")
    if not np.isfinite(u).all():
        raise OptionError("displacements must be finite")
    return np.where(model.plan.topology.has_position[:, None], u, 0.0)


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
