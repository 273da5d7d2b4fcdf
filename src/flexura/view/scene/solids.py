"""The solids of a mechanism, as points that move with its nodes: geometry only, no drawing.

Actuators and sensors as arrows and marks that move with their nodes; piezo stacks are solids and drawn elsewhere.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.analysis import StressProfile
from flexura.errors import OptionError
from flexura.mechanism import TOP, BaseMotion, BaseRotation, ForceSensor, MomentActuator, PiezoStack
from flexura.motion import Frames, pose_of
from flexura.solid.mesh import SurfaceShape
from flexura.structure import Copies, FullOrderModel
from flexura.view.scene.discrete_elements import add_discrete_elements
from flexura.view.scene.marks import add_marks
from flexura.view.scene.members import LEVELS, Detail, Placing, member_surfaces
from flexura.view.scene.meshes import Array, Index, Mesh, cone, frame_along, sphere
from flexura.view.scene.motions import Motions
from flexura.view.scene.scene import Collector, Grid, Kind, Look, Solids

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
    doubted: Collection[str] = frozenset(),
    look: Look = PICTURE,
) -> Solids:
    """The solids of a mechanism, moving with its nodes.

    displacements: (n_nodes, 6), m and rad, global frame, as `FullOrderModel.node_displacements` gives them for one
    vector; none for a mechanism that stands still, at rest or at the pose that is described. doubted: names of members
    and bodies in doubt, such as `leaf1.blade`, or `leaf.blade` for all copies. Motions are linear in the displacements.
    Members carry their real sections; the number of faces stays near that of `look`, and members of very large
    mechanisms become lines. Raises OptionError when the displacements are not finite or have another shape, or when the
    model holds a stack of designs.
    """
    u = node_motions(model, displacements)
    turned = float(np.sqrt((u[:, 3:] ** 2).sum(axis=1).max(initial=0.0)))
    if (posed := pose_of(model)) is not None:
        return replace(_moving_on(model, posed.pose.state.frames, u, doubted, look), rotation=turned)
    return _collected(model, Motions.small(u), doubted, look).solids(turned)


def moved_solids(
    model: FullOrderModel,
    frames: Frames,
    profiles: Mapping[str, Sequence[StressProfile]],
    doubted: Collection[str] = frozenset(),
    look: Look = PICTURE,
) -> Solids:
    """The solids of a mechanism whose nodes have moved and turned as far as their frames have.

    `motions` lead from rest to there; `values` are stresses, Pa, by `profiles` of all prototypes, of the first state.
    Raises OptionError when the model holds a stack of designs.
    """
    node_motions(model, None)
    parts = _collected(model, Motions.finite(model, frames), doubted, look).solids(0.0)
    return replace(parts, values=stresses_along(parts, profiles))


def _moving_on(model: FullOrderModel, frames: Frames, u: Array, doubted: Collection[str], look: Look) -> Solids:
    """The solids where frames have moved, with small motions from there: the derivative by displacements u (n, 6)."""
    here = moved_solids(model, frames, {}, doubted, look)
    points = here.points + here.motions
    largest = float(np.abs(u * [1, 1, 1, *[here.size()] * 3]).max(initial=0.0))
    motions = np.zeros(points.shape)
    if largest:
        step = SMALL * here.size() / largest
        moved = np.concatenate([u, np.zeros((1, 6))])
        ahead, behind = (moved_solids(model, frames.moved(sign * step * moved), {}, doubted, look) for sign in (1, -1))
        motions = (ahead.motions - behind.motions) / (2 * step)
    return replace(here, points=points, motions=motions)


def _collected(model: FullOrderModel, motions: Motions, doubted: Collection[str], look: Look) -> Collector:
    collector = Collector()
    _add_members(collector, model, motions, doubted, look)
    collector.include(model.geometry.positions)
    add_discrete_elements(collector, model, motions, doubted, look)
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


class _Drawn(NamedTuple):
    """Which copies (c,) of a part are drawn, by position, and which members (m,) of them."""

    copies: Index
    members: NDArray[np.bool_]


def _drawn(model: FullOrderModel, look: Look) -> dict[str, _Drawn]:
    """What of the members is drawn: first fewer copies of every prototype, then fewer members of what has one copy."""
    counts = {
        name: (len(model.plan.topology.copies[name].paths), len(part.members))
        for name, part in model.plan.parts.items()
    }
    total = sum(c * m for c, m in counts.values())
    found = {}
    for name, (c, m) in counts.items():
        copies = look.chosen(c, c / max(total, 1))
        share = c / len(copies) if len(copies) else 1.0
        members = np.zeros(m, dtype=bool)
        members[look.chosen(m, share * m / max(total, 1))] = True
        found[name] = _Drawn(copies, members)
    return found


def _detail(model: FullOrderModel, drawn: Mapping[str, _Drawn], look: Look) -> Detail:
    """The finest level of detail that keeps to the budget of faces."""
    total = 0
    for level in LEVELS[:-1]:
        total = sum(
            len(drawn[name].copies) * int(drawn[name].members[group.index].sum()) * level.faces(group, elements)
            for name, part in model.plan.parts.items()
            for group, elements, _ in part.table.groups
        )
        if total <= look.faces:
            return level.plain() if look.plain else level
    return LEVELS[-2] if total <= look.most_faces else LEVELS[-1]


def _add_members(
    collector: Collector, model: FullOrderModel, motions: Motions, doubted: Collection[str], look: Look
) -> None:
    geometry, drawn = model.geometry, _drawn(model, look)
    detail = _detail(model, drawn, look)
    for name, part in model.plan.parts.items():
        placed, chosen = model.plan.topology.copies[name], drawn[name]
        nodes = np.array(placed.offset)[chosen.copies, None] + np.arange(part.n_nodes)
        number = np.array(placed.number)[chosen.copies]
        placing = Placing(geometry.Q[number], geometry.t[number], motions.of(nodes))
        mirrored = np.linalg.det(placing.Q) < 0
        own, T, keys = geometry.parts[name], geometry.T[name], list(part.members)
        prefixes = ["".join(f"{step}." for step in placed.paths[c]) for c in chosen.copies]
        for surface in member_surfaces(part, model.values, own, T, placing, detail, chosen.members):
            kinds = np.where(surface.is_flexure, Kind.FLEXURE, Kind.LINK).astype(np.intp)
            kinds = np.tile(kinds, (len(prefixes), 1))
            names = [prefix + keys[k] for prefix in prefixes for k in surface.members]
            if doubted:
                labels = [f"{name}.{keys[k]}" for k in surface.members] * len(prefixes)
                in_doubt = [{*pair} & set(doubted) != set() for pair in zip(names, labels, strict=True)]
                kinds[np.reshape(in_doubt, kinds.shape)] = Kind.DOUBTED
            grid = Grid(name, chosen.copies, surface.members, surface.along, 0)
            collector.grid(grid, surface.points, surface.motions, surface.faces, kinds, mirrored, names)
    _say(collector, drawn, detail, model)


def _say(collector: Collector, drawn: Mapping[str, _Drawn], detail: Detail, model: FullOrderModel) -> None:
    """Note which members are not drawn as they are."""
    topology = model.plan.topology
    total = sum(len(topology.copies[name].paths) * len(own.members) for name, own in drawn.items())
    shown = sum(len(own.copies) * int(own.members.sum()) for own in drawn.values())
    if shown < total:
        collector.notes.append(f"{shown} of {total} members are drawn")
    if detail.lines and total:
        collector.notes.append("members are drawn as lines: there are too many to be drawn as solids")


def stresses_along(parts: Solids, profiles: Mapping[str, Sequence[StressProfile]]) -> Array:
    """Stresses (v,), Pa, at the points of members, the largest from there halfway to the next, by `profiles` of all
    prototypes, of the first state; NaN where they are not known."""
    values = np.full(len(parts.points), np.nan)
    for grid in parts.grids:
        for profile in profiles.get(grid.prototype, ()):
            if set(grid.members) <= set(profile.members):
                own = _stresses(grid, profile)
                values[grid.first : grid.first + own.size] = own.ravel()
    return values


def _stresses(grid: Grid, profile: StressProfile) -> Array:
    """Stresses (c, m, p), Pa, at the points of members."""
    stations, number = np.unique(grid.along, return_inverse=True)
    middles = (stations[1:] + stations[:-1]) / 2
    found = np.empty((len(grid.copies), len(grid.members), len(stations)))
    for k, m in enumerate(np.searchsorted(profile.members, grid.members)):
        x = profile.fractions[m]
        for c, own in enumerate(profile.von_mises[grid.copies, m, :, 0]):
            found[c, k] = np.interp(stations, x, own)
            np.maximum.at(found[c, k], np.searchsorted(middles, x), own)
    return found[..., number]
