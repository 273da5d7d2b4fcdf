"""Rigid bodies, point masses, springs, dashpots and superelements as solids and lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from flexura.fem import surface_of
from flexura.mechanism import (
    DOF_NAMES,
    Box,
    Composite,
    Cylinder,
    Dashpot,
    Plate,
    PointMass,
    RigidBody,
    Rotation,
    Spring,
    Stop,
    Superelement,
    evaluated,
    rotation_matrix,
)
from flexura.structure import FullOrderModel, Part, inertia_tensor
from flexura.view.scene.meshes import Array, Hulls, Index, Mesh, box, cylinder, frame_along, is_inside, sphere
from flexura.view.scene.scene import Collector, Kind, Motions

Element = TypeVar("Element", RigidBody, PointMass, Spring, Dashpot, Stop)

_STEEL = 7850.0
_SPRING_LENGTH = 0.09
"""Drawn length of a spring or dashpot that has none of its own, relative to the mechanism."""

_STOP = np.array([0.008, 0.05, 0.05])
"""Drawn thickness and sides of the plate of a stop, relative to the mechanism."""

_ROUND, _BALL, _POT_SIDES = 64, 24, 16
"""Sides of cylinders, of balls, and of the pots of dashpots."""

ON_SURFACE = 1e-6
"""Distance from a solid, over its size, up to which a place is on it."""

_MOST_ARMS = 60
"""The arms of a body that carries more nodes than this would hide everything else."""

_NO_ARM = 1e-9
"""Arms shorter than so much of how far from the origin they end, and of a mm, are none."""


def add_discrete_elements(collector: Collector, model: FullOrderModel) -> None:
    """Add the parts of a mechanism that are not members, moving with its nodes."""
    plan, geometry, look = model.plan, model.geometry, collector.look
    values = {name: _number(value) for name, value in plan.scoped_values(model.parameters).items()}
    count = sum(len(plan.topology.copies[name].paths) * len(part.bodies) for name, part in plan.parts.items())
    size = collector.size
    scene = _Scene(collector, Hulls(), np.inf if look.plain else size / (20 if count <= 20 else 8), size)

    def chosen(described: Mapping[str, Element]) -> dict[str, Element]:
        """What of a prototype's parts of a kind is drawn, its numbers resolved."""
        keys = list(described)
        return {keys[k]: evaluated(described[keys[k]], values) for k in look.chosen(len(keys))}

    total = shown = 0
    for name, part in plan.parts.items():
        placed, prototype = plan.topology.copies[name], plan.layout.prototypes[name]
        bodies, masses = chosen(prototype.bodies), chosen(prototype.masses)
        springs, dashpots = chosen(prototype.springs), chosen(prototype.dashpots)
        stops = chosen(prototype.stops)
        described = (prototype.bodies, prototype.masses, prototype.springs, prototype.dashpots, prototype.stops)
        members, offsets = list(part.members), geometry.parts[name].offsets
        arms = np.argwhere(np.any(offsets, axis=-1))
        arms = arms[look.chosen(len(arms))]
        copies = look.chosen(len(placed.paths))
        total += len(placed.paths) * sum(map(len, described))
        shown += len(copies) * sum(map(len, (bodies, masses, springs, dashpots, stops)))
        for k in copies:
            path, span = placed.paths[k], slice(placed.offset[k], placed.offset[k] + part.n_nodes)
            copy = _Copy(
                scene,
                part,
                geometry.Q[placed.number[k]],
                geometry.t[placed.number[k]],
                geometry.positions[span],
                collector.motions.of(span),
                np.all(plan.topology.held[plan.topology.root[span]], axis=1),
                "".join(f"{step}." for step in path),
            )
            if part.elastic:
                own, sizes = geometry.parts[name].positions, plan.members.end_sizes(model.values, geometry.lengths)
                for key, bending in part.elastic.items():
                    copy.bending[key] = partial(bending.bent, model.values, own[bending.nodes], sizes)
            copy.add(bodies, masses, springs, dashpots, prototype.superelements)
            for key, stop in stops.items():
                copy.add_stop(key, stop)
            for key, piezo in part.channels.piezos.items():
                section = piezo.section(model.values)
                copy.add_stack(key, piezo.nodes, None if section is None else float(np.sqrt(section.A)))
            if len(arms):
                copy.add_member_arms([members[m] for m in arms[:, 0]], part.ends[*arms.T], offsets[*arms.T])
    if shown < total:
        collector.notes.append(f"{shown} of {total} bodies, masses, springs, dashpots and stops are drawn")


class _Scene(NamedTuple):
    """What is drawn into: bodies so far, global frame, how long the sides of cells of flat faces are, m, and the size
    of the mechanism, m."""

    collector: Collector
    bodies: Hulls
    cell: float
    size: float


class _Coupling(NamedTuple):
    """A spring or dashpot of a kind, its name, its numbers resolved, its one or two nodes, and where it acts, m, where
    that is described."""

    kind: Kind
    name: str
    element: Spring | Dashpot
    nodes: list[int]
    at: Array | None


@dataclass(frozen=True)
class _Copy:
    """One placed copy of a part: Q (3, 3) and origin (3,), m, into the global frame, node positions x (n, 3), m,
    motions of the n nodes, whether these are clamped (n,), and what names begin with."""

    scene: _Scene
    part: Part
    Q: Array
    origin: Array
    x: Array
    motions: Motions
    clamped: NDArray[np.bool_]
    prefix: str
    bending: dict[str, Callable[[Array], Array]] = field(default_factory=dict)
    """By bodies that bend: displacements (q, 3, 6p) of points (q, 3), both in the part's axes, by how far their nodes
    leave the places to which the first carries them."""

    def attached(self, node: int, points: Array) -> Array:
        """Motions (p, 3) of points (p, 3), global frame, fixed to a node."""
        return self.motions.of(node).carried(points - self.x[node])

    def add(
        self,
        bodies: Mapping[str, RigidBody],
        masses: Mapping[str, PointMass],
        springs: Mapping[str, Spring],
        dashpots: Mapping[str, Dashpot],
        superelements: Mapping[str, Superelement],
    ) -> None:
        """Add the elements of the part, with all numbers resolved, and superelements of which no surface is known."""
        for key, body in bodies.items():
            self._add_body(key, body)
        for key, mass in masses.items():
            self._add_mass(key, mass)
        couplings = [(Kind.SPRING, key, spring, self.part.springs[key].nodes) for key, spring in springs.items()]
        couplings += [(Kind.DASHPOT, key, dashpot, self.part.dashpots[key].nodes) for key, dashpot in dashpots.items()]
        for kind, key, element, nodes in couplings:
            at = None if element.at is None else self.Q @ _vector(element.at) + self.origin
            add_coupling = self._add_grounded if len(nodes) == 1 else self._add_between
            add_coupling(_Coupling(kind, self.prefix + key, element, nodes, at))
        for key, nodes in ((key, own.nodes) for key, own in self.part.superelements.items()):
            if surface_of(superelements[key]) is None:
                self._add_star(self.prefix + key, [node for node in nodes if node < self.part.n_positioned])

    def add_stop(self, key: str, stop: Stop) -> None:
        """The plate of a stop, a gap beyond the node that meets it and the body around this, which the other node or
        the ground carries."""
        nodes, size = self.part.stops[key].nodes, self.scene.size
        direction = self.Q @ _vector(stop.direction)
        direction /= np.linalg.norm(direction)
        sides, start = _STOP * size, self.x[nodes[-1]]
        away = self.scene.bodies.way_out(start, direction) + _number(stop.gap) + sides[0] / 2
        plate = box(sides, np.inf)
        points = plate.points @ frame_along(direction) + start + away * direction
        moved = self.attached(nodes[0], points) if len(nodes) == 2 else np.zeros_like(points)
        self.scene.collector.mesh(Mesh(points, plate.faces), moved, Kind.STOP, self.prefix + key)

    def add_arm(self, name: str, node: int, end: Array) -> None:
        """A rigid arm from a node to a point."""
        if np.linalg.norm(end - self.x[node]) > _NO_ARM * (1e-3 + abs(end).max()):
            points = np.stack([self.x[node], end])
            self.scene.collector.path(points, self.attached(node, points), Kind.ARM, name)

    def add_member_arms(self, keys: list[str], nodes: Index, arms: Array) -> None:
        """Rigid arms (k, 3), m, in the part's frame, from nodes (k,) to where members begin or end."""
        start, arms = self.x[nodes], arms @ self.Q.T
        drawn = np.linalg.norm(arms, axis=1) > _NO_ARM * (1e-3 + np.abs(start + arms).max(axis=1, initial=0.0))
        motions = self.motions.of(nodes)
        ends = np.stack([start, start + arms], axis=1)[drawn]
        moved = np.stack([motions.shift, motions.carried(arms)], axis=1)[drawn]
        names = [self.prefix + keys[k] for k in np.flatnonzero(drawn)]
        self.scene.collector.segments(ends, moved, Kind.ARM, names)

    def add_stack(self, key: str, nodes: list[int], side: float | None) -> None:
        """A piezo stack as a square prism between its nodes, a tenth of its length thick where its side, m, is not
        known."""
        ends, motions = self.x[nodes], self.motions.shift[nodes]
        along = ends[1] - ends[0]
        length = float(np.linalg.norm(along))
        side = 0.1 * length if side is None else side
        mesh = box(np.array([length, side, side]), self.scene.cell)
        points = ends.mean(axis=0) + mesh.points @ frame_along(along)
        share = (mesh.points[:, :1] / length) + 0.5
        moved = motions[0] + share * (motions[1] - motions[0])
        self.scene.collector.mesh(Mesh(points, mesh.faces), moved, Kind.PIEZO, self.prefix + key)

    def _add_body(self, key: str, body: RigidBody) -> None:
        node, name, collector = self.part.bodies[key][0], self.prefix + key, self.scene.collector
        mesh, kind = body_mesh(body, self.scene.cell, _ROUND // 2 if collector.look.plain else _ROUND)
        labels = {name, f"{self.part.name}.{key}"}
        kind = Kind.FLAGGED_BODY if labels & collector.flagged else Kind.CLAMP if self.clamped[node] else kind
        centre = self.x[node]
        faces = mesh.faces[:, ::-1] if np.linalg.det(self.Q) < 0 else mesh.faces
        placed = Mesh(mesh.points @ self.Q.T + centre, faces)
        moved = self.attached(node, placed.points) if key not in self.bending else self._bent(key, mesh.points, placed)
        collector.mesh(placed, moved, kind, name)
        if body.solid is None:
            collector.dot(centre, self.motions.shift[node], Kind.CENTRE, name)
        carries = self.part.carried.get(node, [])
        for carried in carries if len(carries) <= _MOST_ARMS else []:
            if kind is Kind.EQUIVALENT_BODY or not self._is_inside(body, node, placed, self.x[carried]):
                self.add_arm(name, node, self.x[carried])
        if not isinstance(body.solid, Composite):  # which is not convex
            self.scene.bodies.add(placed)

    def _is_inside(self, body: RigidBody, node: int, placed: Mesh, point: Array) -> bool:
        """Whether a place (3,) is in the solid of a body, or on it."""
        if isinstance(body.solid, Composite) and body.solid.meshed is not None:
            size = float(np.ptp(placed.points, axis=0).max())
            return bool(body.solid.meshed.pieces.beyond(self.Q.T @ (point - self.x[node])) <= ON_SURFACE * size)
        return is_inside(placed, point)

    def _bent(self, key: str, points: Array, placed: Mesh) -> Array:
        """Motions (p, 3) of the points of a body that bends, part's axes, which are placed."""
        first, *others = [node for node in self.part.elastic[key].nodes if node < self.part.n_positioned]
        carrier, led = self.motions.of(first), self.motions.of(others)
        turn = self.Q.T @ (np.eye(3) + (carrier.turn if carrier.is_finite else 0.0)).T
        shift = (led.shift - carrier.carried(self.x[others] - self.x[first])) @ turn.T
        rotation = np.linalg.det(self.Q).round() * (turn @ (led.turn - carrier.turn) @ self.Q)
        turned = (rotation[..., [2, 0, 1], [1, 2, 0]] - rotation[..., [1, 2, 0], [2, 0, 1]]) / 2
        own = self.bending[key](points) @ np.concatenate([shift, turned], axis=1).ravel()
        return self.attached(first, placed.points) + own @ turn

    def _add_mass(self, key: str, mass: PointMass) -> None:
        """A ball of steel of that mass, within limits that keep it visible."""
        node, name, size = self.part.points[key][0], self.prefix + key, self.scene.size
        radius = (3 * _number(mass.mass) / (4 * np.pi * _STEEL)) ** (1 / 3)
        sides = _BALL // 2 if self.scene.collector.look.plain else _BALL
        ball = sphere(float(np.clip(radius, 0.012 * size, 0.04 * size)), sides)
        at = self.x[node] + self.Q @ _vector(mass.offset)
        points = ball.points + at
        self.scene.collector.mesh(Mesh(points, ball.faces), self.attached(node, points), Kind.MASS, name)
        self.add_arm(name, node, at)

    def _add_grounded(self, coupling: _Coupling) -> None:
        """A spring or dashpot from a node, or from the surface of the body in which it lies, outwards to ground."""
        (node,), size = coupling.nodes, self.scene.size
        start = self.x[node] if coupling.at is None else coupling.at
        direction = _strongest(coupling.element, self.Q)
        if (start - self.scene.collector.middle) @ direction < -1e-6 * size:
            direction = -direction
        begin = start + self.scene.bodies.way_out(start, direction) * direction
        self.add_arm(coupling.name, node, begin)
        ends = np.stack([begin, begin + _SPRING_LENGTH * size * direction])
        motions = np.stack([self.attached(node, begin[None])[0], np.zeros(3)])
        _add_glyph(self.scene, coupling, ends, motions, grounded=True)

    def _add_between(self, coupling: _Coupling) -> None:
        """A spring or dashpot between two nodes, or a short one where it acts when they coincide or reach there by
        arms."""
        nodes, at, length = coupling.nodes, coupling.at, _SPRING_LENGTH * self.scene.size
        span = self.x[nodes[1]] - self.x[nodes[0]]
        distance = float(np.linalg.norm(span))
        if at is None and distance > 0.2 * length:
            _add_glyph(self.scene, coupling, self.x[nodes], self.motions.shift[nodes])
            return
        middle = self.x[nodes].mean(axis=0) if at is None else at
        direction = span / distance if distance > 0.01 * length else _strongest(coupling.element, self.Q)
        ends = middle + np.array([[-0.5], [0.5]]) * length * direction
        for node, end in zip(nodes, ends, strict=True):
            self.add_arm(coupling.name, node, end)
        motions = [self.attached(node, end[None])[0] for node, end in zip(nodes, ends, strict=True)]
        _add_glyph(self.scene, coupling, ends, np.stack(motions))

    def _add_star(self, name: str, nodes: list[int]) -> None:
        """Lines from the middle of a superelement's nodes to each of them."""
        collector, shift = self.scene.collector, self.motions.shift
        middle, motion = self.x[nodes].mean(axis=0), shift[nodes].mean(axis=0)
        for node in nodes if len(nodes) > 1 else ():
            ends, moved = np.stack([middle, self.x[node]]), np.stack([motion, shift[node]])
            collector.path(ends, moved, Kind.SUPERELEMENT, name)
        collector.dot(middle, motion, Kind.SUPERELEMENT, name)


def _vector(values: object) -> Array:
    return np.array(values, dtype=float)


def _number(value: object) -> float:
    return float(np.array(value, dtype=float))


def _turned(rotation: Rotation | None) -> Array:
    return np.eye(3) if rotation is None else rotation_matrix(_vector(rotation.axis), _number(rotation.angle))


def body_mesh(body: RigidBody, cell: float, sides: int = _ROUND) -> tuple[Mesh, Kind]:
    """A body as a mesh about its node, in the part's axes; numbers of `body` are resolved. Round ones have so
    many sides.

    A body given by mass and inertia becomes the solid box that has them.
    """
    kind = Kind.BODY
    match body.solid:
        case Box(size=size):
            mesh = box(_vector(size), cell)
        case Plate(length=a, width=b, thickness=c):
            mesh = box(_vector((a, b, c)), cell)
        case Cylinder(diameter=d, length=length, axis=axis):
            mesh = cylinder(_number(d), _number(length), _vector(axis), cell, sides)
        case Composite(meshed=meshed) if meshed is not None:
            points, triangles = meshed.surface
            mesh = Mesh(points, triangles[:, [0, 1, 2, 2]])
        case _:
            kind = Kind.EQUIVALENT_BODY
            size, axes = equivalent_box(_number(body.mass), inertia_tensor(_vector(body.inertia)))
            mesh = box(size, cell)
            mesh = Mesh(mesh.points @ axes.T, mesh.faces)
    return Mesh(mesh.points @ _turned(body.rotate).T, mesh.faces), kind


def equivalent_box(mass: float, inertia: Array) -> tuple[Array, Array]:
    """Edges (3,), m, and axes (3, 3), columns, of the uniform box with this mass, kg, and inertia (3, 3), kg m^2.

    Where no box has the inertia (one principal moment exceeds the sum of the others) an edge is nearly zero.
    """
    diagonal = np.diagonal(inertia)
    moments, axes = diagonal.copy(), np.eye(3)
    if abs(inertia - np.diag(diagonal)).max() > 1e-9 * abs(diagonal).max():
        moments, axes = np.linalg.eigh(inertia)
        if np.linalg.det(axes) < 0:
            axes[:, 0] *= -1
    square = 6 / mass * (moments.sum() - 2 * moments) if mass > 0 else np.zeros(3)
    largest = max(float(square.max()), 0.0)
    return np.sqrt(np.maximum(square, 1e-4 * largest)), axes


def _strongest(element: Spring | Dashpot, Q: Array) -> Array:
    """Direction (3,), global frame, in which a spring or dashpot of a copy with axes Q resists most; its rotations
    count when no translation does."""
    if isinstance(element, Spring) and element.matrix is not None:
        K = _vector(element.matrix)
    else:
        rates = element.stiffness if isinstance(element, Spring) else element.damping
        K = np.diag(_vector([getattr(rates, name) for name in DOF_NAMES])) if rates is not None else np.zeros((6, 6))
    block = K[:3, :3] if abs(K[:3, :3]).max() > 0 else K[3:, 3:]
    direction = np.linalg.eigh(block)[1][:, -1]
    direction = direction * (-1.0 if direction.sum() > 0 else 1.0)
    return Q @ _turned(element.rotate) @ direction


def _add_glyph(scene: _Scene, coupling: _Coupling, ends: Array, motions: Array, grounded: bool = False) -> None:
    """Add a spring as a coil or a dashpot as a piston in a pot, of lines, between two ends (2, 3), m, that move by
    `motions` (2, 3), with a square at the second where it is `grounded`."""
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    if length == 0:
        return
    across = -frame_along(along)[1:]
    width = min(0.022 * scene.size, 0.2 * length)
    for share, swing, follows in _coil(length, width) if coupling.kind is Kind.SPRING else _pot(width):
        path = ends[0] + share[:, None] * along + swing @ across
        moved = motions[0] + follows[:, None] * (motions[1] - motions[0])
        scene.collector.path(path, moved, coupling.kind, coupling.name)
    if grounded:
        square = 1.4 * width * np.concatenate([across, -across, across[:1]])
        scene.collector.path(ends[1] + square, np.zeros((5, 3)) + motions[1], coupling.kind, coupling.name)


_Paths = list[tuple[Array, Array, Array]]
"""Paths: of every point the share (p,) of the way, the distances (p, 2) from the axis, m, and how far it follows the
second end, (p,)."""


def _coil(length: float, width: float) -> _Paths:
    """The whole of it is stretched."""
    coils = int(np.clip(0.7 * length / (1.6 * width), 4, 16))
    turns = np.arange(8 * coils + 1) / (8 * coils)
    angle = 2 * np.pi * coils * turns
    share = np.concatenate([[0, 0.15], 0.15 + 0.7 * turns, [0.85, 1.0]])
    swing = np.concatenate([np.zeros((2, 2)), np.stack([np.cos(angle), np.sin(angle)], axis=1), np.zeros((2, 2))])
    return [(share, width * swing, share)]


def _pot(width: float) -> _Paths:
    """A rod with its piston moves with the first end, the pot around it with the second."""
    angle = 2 * np.pi * np.arange(_POT_SIDES + 1) / _POT_SIDES
    ring = width * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    axis, rod, pot = np.zeros((2, 2)), np.zeros, np.ones
    bottom = np.concatenate([axis[:1], ring])
    paths = [
        (np.array([0.0, 0.5]), axis, rod(2)),
        (np.full(_POT_SIDES + 2, 0.5), 0.75 * bottom, rod(_POT_SIDES + 2)),
        (np.full(_POT_SIDES + 1, 0.3), ring, pot(_POT_SIDES + 1)),
        (np.full(_POT_SIDES + 2, 0.75), bottom, pot(_POT_SIDES + 2)),
        (np.array([0.75, 1.0]), axis, pot(2)),
    ]
    walls = [(np.array([0.3, 0.75]), ring[[k, k]], pot(2)) for k in range(0, _POT_SIDES, _POT_SIDES // 4)]
    return paths + walls
