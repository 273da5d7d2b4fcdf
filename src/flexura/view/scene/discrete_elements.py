"""Rigid bodies, point masses, springs, dashpots and superelements as solids and lines."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from flexura.beam import SectionProperties
from flexura.mechanism import (
    DOF_NAMES,
    Box,
    Cylinder,
    Dashpot,
    Plate,
    PointMass,
    RigidBody,
    Rotation,
    Spring,
    evaluated,
    rotation_matrix,
)
from flexura.structure import FullOrderModel, Part, inertia_tensor
from flexura.view.scene.meshes import Array, Hulls, Index, Mesh, box, cylinder, is_inside, sphere
from flexura.view.scene.scene import Collector, Kind, Look, Motions

T = TypeVar("T")

_STEEL = 7850.0
_SPRING_LENGTH = 0.09
"""Drawn length of a spring or dashpot that has none of its own, relative to the mechanism."""

_ROUND, _BALL = 64, 24
"""Sides of cylinders and balls."""

_MOST_ARMS = 60
"""The arms of a body that carries more nodes than this would hide everything else."""


@dataclass(frozen=True)
class _Copy:
    """One placed copy of a part: Q (3, 3) into the global frame, node positions x (n, 3), m, motions of the n nodes,
    and whether these are clamped (n,)."""

    Q: Array
    x: Array
    motions: Motions
    clamped: NDArray[np.bool_]

    def attached(self, node: int, points: Array) -> Array:
        """Motions (p, 3) of points (p, 3), global frame, fixed to a node."""
        return self.motions.of(node).carried(points - self.x[node])


def add_discrete_elements(
    collector: Collector, model: FullOrderModel, motions: Motions, flagged: Collection[str], look: Look
) -> None:
    """Add the parts of a mechanism that are not members, moving with its nodes; the bodies called `flagged` are of the
    kind for these."""
    plan, geometry = model.plan, model.geometry
    values = {name: _number(value) for name, value in plan.scoped_values(model.parameters).items()}
    size = collector.size
    bodies = sum(len(plan.topology.copies[name].paths) * len(part.bodies) for name, part in plan.parts.items())
    cell = np.inf if look.plain else size / (20 if bodies <= 20 else 8)
    hulls = Hulls()
    total = shown = 0
    for name, part in plan.parts.items():
        placed = plan.topology.copies[name]
        prototype = plan.layout.prototypes[name]
        drawn = _Drawn(
            part,
            {key: evaluated(body, values) for key, body in _chosen(prototype.bodies, look)},
            {key: evaluated(mass, values) for key, mass in _chosen(prototype.masses, look)},
            {key: evaluated(spring, values) for key, spring in _chosen(prototype.springs, look)},
            {key: evaluated(dashpot, values) for key, dashpot in _chosen(prototype.dashpots, look)},
            _member_arms(part, geometry.parts[name].offsets, look),
            model.values,
            hulls,
            cell,
            look.plain,
        )
        copies = look.chosen(len(placed.paths))
        kinds = (prototype.bodies, prototype.masses, prototype.springs, prototype.dashpots)
        total += len(placed.paths) * sum(map(len, kinds))
        shown += len(copies) * sum(map(len, (drawn.bodies, drawn.masses, drawn.springs, drawn.dashpots)))
        for k in copies:
            number, offset, path = placed.number[k], placed.offset[k], placed.paths[k]
            names = {key: {".".join((*path, key)), f"{name}.{key}"} for key in prototype.bodies if flagged}
            drawn.flagged = {key for key, own in names.items() if own & set(flagged)}
            drawn.prefix = "".join(f"{step}." for step in path)
            span = slice(offset, offset + part.n_nodes)
            held = np.all(plan.topology.held[plan.topology.root[span]], axis=1)
            copy = _Copy(geometry.Q[number], geometry.positions[span], motions.of(span), held)
            drawn.add(collector, copy, geometry.t[number], size)
    if shown < total:
        collector.notes.append(f"{shown} of {total} bodies, masses, springs and dashpots are drawn")


def _chosen(described: Mapping[str, T], look: Look) -> list[tuple[str, T]]:
    """What of a prototype's parts of a kind is drawn."""
    every = list(described.items())
    return [every[k] for k in look.chosen(len(every))]


class _MemberArms(NamedTuple):
    """Rigid arms of members: the keys of these, the nodes (k,) that arms begin at, and the arms (k, 3), m, to where the
    members begin or end."""

    keys: list[str]
    nodes: Index
    arms: Array


class _Coupling(NamedTuple):
    """A spring or dashpot of a kind, its name, its numbers resolved, and its one or two nodes."""

    kind: Kind
    name: str
    element: Spring | Dashpot
    nodes: list[int]


@dataclass
class _Drawn:
    """The discrete elements of a part with all numbers resolved."""

    part: Part
    bodies: Mapping[str, RigidBody]
    masses: Mapping[str, PointMass]
    springs: Mapping[str, Spring]
    dashpots: Mapping[str, Dashpot]
    arms: _MemberArms
    values: Array
    """Values of the table of the design."""
    hulls: Hulls
    """Bodies drawn so far, global frame, those of all other parts included."""
    cell: float
    """Into what flat sides are cut, m."""
    plain: bool
    """Whether round things have half the corners."""
    prefix: str = ""
    """What the names of the copy that is drawn begin with."""
    flagged: Collection[str] = frozenset()
    """Bodies of the copy that is drawn that have warnings."""

    def add(self, collector: Collector, copy: _Copy, origin: Array, size: float) -> None:
        """Add the discrete elements of one copy; `origin` (3,), m, is where its frame has its origin."""
        for key, body in self.bodies.items():
            self.hulls.add(self._add_body(collector, copy, key, body))
        for key, mass in self.masses.items():
            self._add_mass(collector, copy, key, mass, size)
        for key, spring in self.springs.items():
            own = _Coupling(Kind.SPRING, self.prefix + key, spring, self.part.springs[key].nodes)
            self._add_coupling(collector, copy, own, origin, size)
        for key, dashpot in self.dashpots.items():
            own = _Coupling(Kind.DASHPOT, self.prefix + key, dashpot, self.part.dashpots[key].nodes)
            self._add_coupling(collector, copy, own, origin, size)
        for key, (nodes, _, _) in self.part.superelements.items():
            _add_star(collector, copy, self.prefix + key, [node for node in nodes if node < self.part.n_positioned])
        for key, piezo in self.part.channels.piezos.items():
            section = piezo.section(self.values)
            _add_stack(collector, copy, self.prefix + key, piezo.nodes, section, self.cell)
        self._add_member_arms(collector, copy)

    def _add_member_arms(self, collector: Collector, copy: _Copy) -> None:
        start = copy.x[self.arms.nodes]
        arms = self.arms.arms @ copy.Q.T
        drawn = np.linalg.norm(arms, axis=1) > 1e-9 * (1e-3 + np.abs(start + arms).max(axis=1))
        if drawn.any():
            own = copy.motions.of(self.arms.nodes[drawn])
            ends = np.stack([start, start + arms], axis=1)[drawn]
            moved = np.stack([own.shift, own.carried(arms[drawn])], axis=1)
            collector.segments(ends, moved, Kind.ARM, [self.prefix + self.arms.keys[k] for k in np.flatnonzero(drawn)])

    def _add_body(self, collector: Collector, copy: _Copy, key: str, body: RigidBody) -> Mesh:
        node, name = self.part.bodies[key][0], self.prefix + key
        mesh, kind = body_mesh(body, self.cell, _ROUND // 2 if self.plain else _ROUND)
        kind = Kind.FLAGGED_BODY if key in self.flagged else Kind.CLAMP if copy.clamped[node] else kind
        centre = copy.x[node]
        points = mesh.points @ copy.Q.T + centre
        faces = mesh.faces[:, ::-1] if np.linalg.det(copy.Q) < 0 else mesh.faces
        placed = Mesh(points, faces)
        collector.mesh(placed, copy.attached(node, points), kind, name)
        if body.solid is None:
            collector.dot(centre, copy.motions.shift[node], Kind.CENTRE, name)
        carries = self.part.carried.get(node, [])
        for carried in carries if len(carries) <= _MOST_ARMS else []:
            if kind is Kind.EQUIVALENT_BODY or not is_inside(placed, copy.x[carried]):
                _add_arm(collector, copy, name, node, copy.x[carried])
        return placed

    def _add_mass(self, collector: Collector, copy: _Copy, key: str, mass: PointMass, size: float) -> None:
        """A ball of steel of that mass, within limits that keep it visible."""
        node, name = self.part.points[key][0], self.prefix + key
        radius = (3 * _number(mass.mass) / (4 * np.pi * _STEEL)) ** (1 / 3)
        ball = sphere(float(np.clip(radius, 0.012 * size, 0.04 * size)), _BALL // 2 if self.plain else _BALL)
        at = copy.x[node] + copy.Q @ _vector(mass.offset)
        points = ball.points + at
        collector.mesh(Mesh(points, ball.faces), copy.attached(node, points), Kind.MASS, name)
        _add_arm(collector, copy, name, node, at)

    def _add_coupling(self, collector: Collector, copy: _Copy, coupling: _Coupling, origin: Array, size: float) -> None:
        at = None if coupling.element.at is None else copy.Q @ _vector(coupling.element.at) + origin
        if len(coupling.nodes) == 1:
            self._add_grounded(collector, copy, coupling, at, size)
        else:
            _add_between(collector, copy, coupling, at, size)

    def _add_grounded(
        self, collector: Collector, copy: _Copy, coupling: _Coupling, at: Array | None, size: float
    ) -> None:
        """A spring or dashpot from a node, or from the surface of the body in which it lies, outwards to ground."""
        node = coupling.nodes[0]
        start = copy.x[node] if at is None else at
        way = _strongest(coupling.element, copy)
        if (start - collector.middle) @ way < -1e-6 * size:
            way = -way
        begin = start + self.hulls.way_out(start, way) * way
        _add_arm(collector, copy, coupling.name, node, begin)
        ends = np.stack([begin, begin + _SPRING_LENGTH * size * way])
        motion = np.stack([copy.attached(node, begin[None])[0], np.zeros(3)])
        add_glyph(collector, coupling.kind, coupling.name, ends, motion, size, grounded=True)


def _member_arms(part: Part, offsets: Array, look: Look) -> _MemberArms:
    """Offsets (m, 2, 3), m, that are not zero."""
    found, keys = np.argwhere(np.any(offsets, axis=-1)), list(part.members)
    m, end = found[look.chosen(len(found))].T
    return _MemberArms([keys[k] for k in m], part.ends[m, end], offsets[m, end])


def _vector(values: object) -> Array:
    return np.array(values, dtype=float)


def _number(value: object) -> float:
    return float(np.array(value, dtype=float))


def _turned(rotation: Rotation | None) -> Array:
    return np.eye(3) if rotation is None else rotation_matrix(_vector(rotation.axis), _number(rotation.angle))


def body_mesh(body: RigidBody, cell: float, sides: int = _ROUND) -> tuple[Mesh, Kind]:
    """A body as a mesh about its centre of mass, in the part's axes; numbers of `body` are resolved. Round ones have so
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


def _add_arm(collector: Collector, copy: _Copy, name: str, node: int, end: Array) -> None:
    """A rigid arm from a node to a point."""
    if np.linalg.norm(end - copy.x[node]) > 1e-9 * (1e-3 + abs(end).max()):
        points = np.stack([copy.x[node], end])
        collector.path(points, copy.attached(node, points), Kind.ARM, name)


def _add_star(collector: Collector, copy: _Copy, name: str, nodes: list[int]) -> None:
    """Lines from the middle of a superelement's nodes to each of them."""
    middle, motion = copy.x[nodes].mean(axis=0), copy.motions.shift[nodes].mean(axis=0)
    for node in nodes:
        if len(nodes) > 1:
            path, moved = np.stack([middle, copy.x[node]]), np.stack([motion, copy.motions.shift[node]])
            collector.path(path, moved, Kind.SUPERELEMENT, name)
    collector.dot(middle, motion, Kind.SUPERELEMENT, name)


def _add_stack(
    collector: Collector, copy: _Copy, name: str, nodes: list[int], section: SectionProperties | None, cell: float
) -> None:
    """A piezo stack as a square prism between its nodes, a tenth of its length thick where its section is not known."""
    ends, motions = copy.x[nodes], copy.motions.shift[nodes]
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    side = 0.1 * length if section is None else float(np.sqrt(section.A))
    x = along / length
    y = np.cross(x, np.eye(3)[np.argmin(abs(x))])
    y /= np.linalg.norm(y)
    mesh = box(np.array([length, side, side]), cell)
    points = ends.mean(axis=0) + mesh.points @ np.stack([x, y, np.cross(x, y)])
    share = (mesh.points[:, :1] / length) + 0.5
    collector.mesh(Mesh(points, mesh.faces), motions[0] + share * (motions[1] - motions[0]), Kind.PIEZO, name)


def _add_between(collector: Collector, copy: _Copy, coupling: _Coupling, at: Array | None, size: float) -> None:
    """A spring or dashpot between two nodes, or a short one where it acts when they coincide or reach there by arms."""
    kind, name, element, nodes = coupling
    length = _SPRING_LENGTH * size
    a, b = nodes
    span = copy.x[b] - copy.x[a]
    distance = float(np.linalg.norm(span))
    if at is None and distance > 0.2 * length:
        add_glyph(collector, kind, name, copy.x[nodes], copy.motions.shift[nodes], size)
        return
    middle = copy.x[nodes].mean(axis=0) if at is None else at
    way = span / distance if distance > 0.01 * length else _strongest(element, copy)
    ends = middle + np.array([[-0.5], [0.5]]) * length * way
    motions = np.concatenate([copy.attached(a, ends[:1]), copy.attached(b, ends[1:])])
    for node, end in zip(nodes, ends, strict=True):
        _add_arm(collector, copy, name, node, end)
    add_glyph(collector, kind, name, ends, motions, size)


def _strongest(element: Spring | Dashpot, copy: _Copy) -> Array:
    """Direction (3,), global frame, in which a spring or dashpot resists most; its rotations count when no translation
    does."""
    if isinstance(element, Spring) and element.matrix is not None:
        K = _vector(element.matrix)
    else:
        own = element.stiffness if isinstance(element, Spring) else element.damping
        K = np.diag(_vector([getattr(own, name) for name in DOF_NAMES])) if own is not None else np.zeros((6, 6))
    block = K[:3, :3] if abs(K[:3, :3]).max() > 0 else K[3:, 3:]
    direction = np.linalg.eigh(block)[1][:, -1]
    direction = direction * (-1.0 if direction.sum() > 0 else 1.0)
    return copy.Q @ _turned(element.rotate) @ direction


_SIDES = 16
"""Corners of the rings of a dashpot."""


def add_glyph(
    collector: Collector, kind: Kind, name: str, ends: Array, motions: Array, size: float, grounded: bool = False
) -> None:
    """Add a spring or a dashpot between two ends (2, 3), m, that move by `motions` (2, 3), with a square at the second
    where it is `grounded`."""
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    if length == 0:
        return
    x = along / length
    side = np.cross(x, np.eye(3)[np.argmin(abs(x))])
    side /= np.linalg.norm(side)
    across = np.stack([side, np.cross(x, side)])
    width = min(0.022 * size, 0.2 * length)
    for share, swing, follows in _coil(length, width) if kind is Kind.SPRING else _pot(width):
        path = ends[0] + share[:, None] * along + swing @ across
        collector.path(path, motions[0] + follows[:, None] * (motions[1] - motions[0]), kind, name)
    if grounded:
        cross = 1.4 * width * np.stack([side, across[1], -side, -across[1], side])
        collector.path(ends[1] + cross, np.zeros((5, 3)) + motions[1], kind, name)


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
    angle = 2 * np.pi * np.arange(_SIDES + 1) / _SIDES
    ring = width * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    axis, own, other = np.zeros((2, 2)), np.zeros, np.ones
    bottom = np.concatenate([axis[:1], ring])
    paths = [
        (np.array([0.0, 0.5]), axis, own(2)),
        (np.full(_SIDES + 2, 0.5), 0.75 * bottom, own(_SIDES + 2)),
        (np.full(_SIDES + 1, 0.3), ring, other(_SIDES + 1)),
        (np.full(_SIDES + 2, 0.75), bottom, other(_SIDES + 2)),
        (np.array([0.75, 1.0]), axis, other(2)),
    ]
    walls = [(np.array([0.3, 0.75]), ring[[k, k]], other(2)) for k in range(0, _SIDES, _SIDES // 4)]
    return paths + walls
