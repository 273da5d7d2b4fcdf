"""The solids of a mechanism, as points that move with its nodes: geometry only, no drawing.

After members and bodies come the marks that help to read a picture: how nodes are held, where parts meet, and, where
asked for, actuators and sensors; piezo stacks are solids.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis import StressProfiles
from flexura.errors import OptionError
from flexura.fem import SurfaceShape
from flexura.mechanism import (
    TOP,
    BaseMotion,
    BaseRotation,
    ForceSensor,
    MomentActuator,
    PiezoStack,
    StrainActuator,
    matching,
)
from flexura.motion import Frames, pose_of
from flexura.structure import Copies, FullOrderModel
from flexura.thresholds import SAME_PLACE
from flexura.view.scene.diaphragms import add_diaphragms, add_surfaces
from flexura.view.scene.discrete_elements import add_discrete_elements
from flexura.view.scene.members import add_members, stresses_along
from flexura.view.scene.meshes import Array, Index, Mesh, box, cone, frame_along, sphere
from flexura.view.scene.scene import Collector, Kind, Look, Motions, Solids

SMALL = 1e-5
"""Displacements over the size of a mechanism that are small."""

PICTURE = Look()

NO_STRESS = StressProfiles({}, {})

MOST_NODES = 160
"""More nodes than this are not marked; they would hide the mechanism."""

LENGTH, WIDTH, BALL = 0.13, 0.011, 0.014
"""Length and half width of an arrow, and radius of a sensor, relative to the mechanism."""


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
    u = _node_motions(model, displacements)
    rotation = _largest_rotation(u)
    if (posed := pose_of(model)) is not None:
        return replace(_moving_on(model, posed.pose.state.frames, u, flagged, look), rotation=rotation)
    return _collected(model, Collector(Motions.small(u), look, frozenset(flagged))).solids(rotation)


def moved_solids(
    model: FullOrderModel,
    frames: Frames,
    profiles: StressProfiles = NO_STRESS,
    flagged: Collection[str] = frozenset(),
    look: Look = PICTURE,
) -> Solids:
    """The solids of a mechanism whose nodes have moved and turned as far as their frames have.

    `motions` lead from rest to there; `values` are stresses, Pa, by `profiles` of the first state.
    Raises OptionError when the model holds a stack of designs.
    """
    _node_motions(model, None)
    parts = _collected(model, Collector(Motions.finite(model, frames), look, frozenset(flagged))).solids(0.0)
    return replace(parts, values=stresses_along(parts, profiles))


def _moving_on(model: FullOrderModel, frames: Frames, u: Array, flagged: Collection[str], look: Look) -> Solids:
    """The solids where frames have moved, with small motions from there: the derivative by displacements u (n, 6)."""
    here = moved_solids(model, frames, flagged=flagged, look=look)
    points = here.points + here.motions
    largest = float(np.abs(u * [1, 1, 1, *[here.size()] * 3]).max(initial=0.0))
    motions = np.zeros(points.shape)
    if largest:
        step = SMALL * here.size() / largest
        moved = np.concatenate([u, np.zeros((1, 6))])
        ahead, behind = (
            moved_solids(model, frames.moved(sign * step * moved), flagged=flagged, look=look) for sign in (1, -1)
        )
        motions = (ahead.motions - behind.motions) / (2 * step)
    return replace(here, points=points, motions=motions)


def meshed_solids(
    model: FullOrderModel, displacements: ArrayLike, surfaces: Sequence[SurfaceShape], mode: int
) -> Solids:
    """The same with the surfaces of solid meshes in place of the members, moving in their mode of position `mode`."""
    u = _node_motions(model, displacements)
    collector = Collector(Motions.small(u), PICTURE)
    for surface in surfaces:
        mesh, motions = Mesh(surface.points, surface.facets), surface.displacement[:, :, mode]
        collector.mesh(mesh, motions, Kind.FLEXURE, surface.name)
    return _collected(model, collector, has_members=False).solids(_largest_rotation(u))


def _collected(model: FullOrderModel, collector: Collector, has_members: bool = True) -> Collector:
    """All parts of a mechanism, with or without members, and its marks."""
    if has_members:
        add_members(collector, model)
    collector.include(model.geometry.positions)
    add_diaphragms(collector, model)
    add_surfaces(collector, model)
    add_discrete_elements(collector, model)
    nodes, names = _shared_nodes(model), model.plan.topology.node_names
    _add_supports(collector, model, names)
    for node in nodes if len(nodes) <= MOST_NODES else ():
        collector.dot(model.geometry.positions[node], collector.motions.shift[node], Kind.NODE, names[node])
    if collector.look.channels:
        _add_channels(collector, model)
    return collector


def _node_motions(model: FullOrderModel, displacements: ArrayLike | None) -> Array:
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


def _largest_rotation(u: Array) -> float:
    return float(np.sqrt((u[:, 3:] ** 2).sum(axis=1).max(initial=0.0)))


def _add_supports(collector: Collector, model: FullOrderModel, names: list[str]) -> None:
    """Add marks of how nodes with names are held; clamped bodies show it by their colour."""
    size, bodies = collector.size, _body_nodes(model)
    supports = [(node, held) for node, held in _supported(model) if not (all(held) and node in bodies)]
    supports = [supports[k] for k in collector.look.chosen(len(supports))]
    for (node, held), footing in zip(supports, _footings(model, [node for node, _ in supports]), strict=True):
        if all(held):
            section = np.clip(1.3 * footing.section, 0.05 * size, 0.5 * size)
            wall = box(np.array([0.014 * size, *section]), size)
            mesh = Mesh((wall.points + np.array([0.007 * size, 0.0, 0.0])) @ footing.frame, wall.faces)
        else:
            mesh = cone(0.022 * size, 0.036 * size, footing.frame[0])
        points = mesh.points + model.geometry.positions[node]
        motions = np.broadcast_to(collector.motions.shift[node], points.shape)
        collector.mesh(Mesh(points, mesh.faces), motions, Kind.CLAMP if all(held) else Kind.PARTLY_HELD, names[node])


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
    nearest = SAME_PLACE * (1e-3 + float(np.ptp(x, axis=0).max()))
    footings = []
    for k in nodes:
        at = np.flatnonzero(root[node] == root[k])
        at = at[np.linalg.norm(x[node[at]] - x[k], axis=1) <= nearest]
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
        placing, placed = geometry.parts[name], plan.topology.copies[name]
        _, _, nu, _ = part.table.moduli(model.values)
        sections = part.table.section_properties(model.values, nu, placing.length)
        size = 2 * np.sqrt(3 * np.stack([sections.Iz, sections.Iy], axis=-1) / sections.A[:, None])
        R = placing.R @ np.swapaxes(geometry.Q[placed.number], -1, -2)[:, None]
        for end, element, sign in ((0, part.first[:-1], -1.0), (1, part.first[1:] - 1, 1.0)):
            node = np.array(placed.offset)[:, None] + part.ends[:, end]
            turned = R * np.array([sign, 1.0, 1.0])[:, None]
            turned[np.linalg.det(turned) < 0, 2] *= -1
            nodes.append(node.ravel())
            frames.append(turned.reshape(-1, 3, 3))
            sizes.append(np.broadcast_to(size[element], (*node.shape, 2)).reshape(-1, 2))
    return np.concatenate(nodes), np.concatenate(frames), np.concatenate(sizes)


def _shared_nodes(model: FullOrderModel) -> list[int]:
    """Nodes where parts meet: interfaces, joined and carried nodes, one for each place; or, when a mechanism has
    none of these, its named nodes."""
    plan = model.plan
    chosen: list[int] = []
    named: list[int] = []
    for name, part in plan.parts.items():
        interface = set(plan.layout.prototypes[name].interface)
        shared = [k for k, node in enumerate(part.node_names[: part.n_own]) if node in interface]
        shared += [k for nodes in (*part.joints, *part.carried.values()) for k in nodes]
        for offset in plan.topology.copies[name].offset:
            chosen += [offset + k for k in shared]
            named += [offset + k for k in range(part.n_own)]
    bodies = _body_nodes(model)
    nodes = [node for node in chosen if node not in bodies] or [node for node in named if node not in bodies]
    if not nodes:
        return []
    x = model.geometry.positions[nodes]
    grid = np.round(x / (SAME_PLACE * (1e-3 + float(np.ptp(x, axis=0).max()))))
    _, first = np.unique(grid, axis=0, return_index=True)
    return [nodes[k] for k in sorted(first)]


def _add_channels(collector: Collector, model: FullOrderModel) -> None:
    """Add described actuators and sensors, each where it is and along its positive direction."""
    size = collector.size
    for placed in model.plan.topology.copies.values():
        channels = placed.part.channels
        for copy in collector.look.chosen(len(placed.paths)) if channels.nodes else ():
            prefix = "".join(f"{step}." for step in placed.paths[copy])
            for key, actuator in channels.actuators.items():
                if not isinstance(actuator, PiezoStack):
                    nodes, direction = _port(model, placed, int(copy), ("actuator", key))
                    turns = isinstance(actuator, MomentActuator | BaseRotation | StrainActuator)
                    _add_actuator(_Attached(collector, model, prefix + key, size), nodes, direction, turns)
            for key, sensor in channels.sensors.items():
                source = ("actuator", sensor.actuator) if isinstance(sensor, ForceSensor) else ("sensor", key)
                nodes, direction = _port(model, placed, int(copy), source)
                _add_sensor(_Attached(collector, model, prefix + key, size), nodes, direction)


def _port(model: FullOrderModel, placed: Copies, copy: int, source: tuple[str, str]) -> tuple[list[int], Array | None]:
    """Nodes of an actuator or a sensor of one copy of a part, and its direction (3,), global frame; None where it has
    none."""
    channels, x = placed.part.channels, model.geometry.positions
    described = (channels.actuators if source[0] == "actuator" else channels.sensors)[source[1]]
    nodes = [placed.offset[copy] + node for node in channels.nodes[source]]
    if isinstance(described, BaseMotion | BaseRotation):  # the first node that is held moves with the base
        topology = model.plan.topology
        exposed = [topology.node((), name) for name in model.plan.layout.exposed(TOP)]
        nodes = [node for node in exposed if topology.held[topology.root[node]].any()][:1]
    along = channels.number(*source, "direction", model.values)
    if isinstance(described, StrainActuator):
        member = list(placed.part.members).index(described.member)
        along = model.geometry.parts[placed.part.name].R[member, 1]
    if along is not None:
        Q = model.geometry.Q[placed.number[copy]]
        is_axial = isinstance(described, MomentActuator | BaseRotation | StrainActuator)
        along = Q @ along * (round(float(np.linalg.det(Q))) if is_axial else 1)
    elif len(nodes) == 2:
        along = x[nodes[1]] - x[nodes[0]]
    length = 0.0 if along is None else float(np.linalg.norm(along))
    return nodes, None if along is None or not length > 0 else along / length


class _Attached(NamedTuple):
    """Meshes and lines of one name that are fixed to nodes; size: that of the mechanism, m."""

    collector: Collector
    model: FullOrderModel
    name: str
    size: float

    def path(self, node: int, points: Array, kind: Kind) -> None:
        """Add a line through points (p, 3), m, from a node."""
        motions = self.collector.motions.of(node).carried(points)
        self.collector.path(self.model.geometry.positions[node] + points, motions, kind, self.name)

    def mesh(self, node: int, mesh: Mesh, kind: Kind) -> None:
        """Add a mesh whose points are distances from a node."""
        motions = self.collector.motions.of(node).carried(mesh.points)
        placed = Mesh(self.model.geometry.positions[node] + mesh.points, mesh.faces)
        self.collector.mesh(placed, motions, kind, self.name)


def _add_actuator(attached: _Attached, nodes: list[int], direction: Array | None, turns: bool) -> None:
    """An arrow from the node, or from the second of two, and one the other way at the first; of what turns three
    quarters of a circle about the direction, right-handed."""
    if direction is None:
        return
    size = attached.size
    for node, sense in zip(nodes, (-1.0, 1.0) if len(nodes) == 2 else (1.0,), strict=False):
        heading = sense * direction
        line = np.outer([0.0, LENGTH * size], heading)
        if turns:
            _, heading, second = frame_along(heading)
            angle = np.linspace(0.0, 1.5 * np.pi, 25)
            line = LENGTH / 2 * size * (np.outer(np.cos(angle), heading) + np.outer(np.sin(angle), second))
        attached.path(node, line, Kind.ACTUATOR)
        head = cone(WIDTH * size, 3 * WIDTH * size, -heading, sides=8)
        attached.mesh(node, Mesh(head.points + line[-1] + 3 * WIDTH * size * heading, head.faces), Kind.ACTUATOR)


def _add_sensor(attached: _Attached, nodes: list[int], direction: Array | None) -> None:
    """A small ball at each node, with a line along what is read."""
    size = attached.size
    for node in nodes:
        attached.mesh(node, sphere(BALL * size, 8), Kind.SENSOR)
    if direction is not None and nodes:
        attached.path(nodes[-1], np.outer([0.0, 4 * BALL * size], direction), Kind.SENSOR)
