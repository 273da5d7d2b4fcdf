"""What a part consists of: members, bodies and blocks of ground with places, sizes and materials; numbers only."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import ModelError, Problem
from flexura.fem import BodySolid, MemberSolid, body_solids, solids
from flexura.mechanism import matching
from flexura.structure import FullOrderModel, solids_of
from flexura.thresholds import SAME_PLACE

DEPTHS = (6.0, 3.0, 1.5)
"""Depths of a block of ground, and how far it reaches beyond the faces of its member, in thicknesses of this: the first
that touches nothing else."""


@dataclass(frozen=True, kw_only=True)
class Block(BodySolid):
    """A body, or a block of ground, whose `node` is -1; `root` is the node that it moves with as a rigid body."""

    root: int

    @property
    def is_ground(self) -> bool:
        """Whether it is a block of ground."""
        return self.node < 0

    def local(self, points: Array) -> Array:
        """Coordinates (..., 3) of global points in its own axes from its centre."""
        return (points - self.centre) @ self.axes.T

    def beyond(self, points: Array) -> Array:
        """How far (...) points (..., 3) lie outside, m; negative inside, the distance of the nearest face."""
        if self.pieces is not None:
            return self.pieces.beyond(points)
        away = np.abs(self.local(points)) - self.half
        if self.is_round:
            radius = np.linalg.norm(self.local(points)[..., 1:], axis=-1) - self.half[1]
            return np.maximum(away[..., 0], radius)
        return away.max(axis=-1)

    def nearest(self, point: Array) -> Array:
        """The point (3,) of the block that is nearest to one."""
        if self.pieces is not None:
            return self.pieces.nearest(point[None])[0]
        local = self.local(point)
        if self.is_round:
            r = float(np.linalg.norm(local[1:]))
            local[1:] *= min(1.0, self.half[1] / r) if r > 0 else 1.0
        return np.clip(local, -self.half, self.half) @ self.axes + self.centre

    @property
    def box(self) -> Array:
        """Lower and upper corner (2, 3) of its bounding box, m."""
        half = np.abs(self.axes).T @ self.half
        return np.stack([self.centre - half, self.centre + half])


Piece = Block | MemberSolid


@dataclass(frozen=True)
class Held:
    """What is held: a face of a block or of a member's end, all of it, by its number among the pieces.

    `axis` and `side` (-1 or 1) name the face of a block in its axes, axis 3 the mantle of a cylinder; of a member axis
    0 is meant and `side` -1 its start.
    """

    piece: int
    axis: int
    side: int


@dataclass(frozen=True)
class Pieces:
    """The pieces of a part in the order in which they take up space: bodies, ground, members, thick ones first.

    `ends` are (piece, end, root) of all members' ends; `held` faces; `notes` what a reader should know of it.
    """

    blocks: tuple[Block, ...]
    members: tuple[MemberSolid, ...]
    held: tuple[Held, ...]
    notes: tuple[str, ...] = field(default=())

    @property
    def all(self) -> tuple[Piece, ...]:
        """Blocks first, then members."""
        return (*self.blocks, *self.members)

    def at_root(self, root: int) -> list[int]:
        """Pieces that move with a root, or end there."""
        roots = [*((block.root,) for block in self.blocks), *(member.roots for member in self.members)]
        return [k for k, of_piece in enumerate(roots) if root in of_piece]


def pieces_of(model: FullOrderModel) -> Pieces:
    """The pieces of a mechanism, and what of them is held. Raises OptionError for sections that have no form and
    ModelError for bodies that hold much together and have no form."""
    members = sorted(solids(model), key=lambda m: -m.thickness)
    topology = model.plan.topology
    bodies = [Block(**vars(body), root=int(topology.root[body.node])) for body in body_solids(model)]
    bodies.sort(key=lambda block: -block.thickness)
    clamped: NDArray[np.bool_] = np.asarray(topology.held.all(axis=1))
    notes: list[str] = []
    held: list[Held] = []
    drawn = {block.root for block in bodies}
    _refuse_unknown(model, members, drawn)
    for root in dict.fromkeys(block.root for block in bodies if clamped[block.root]):
        held += _held_faces(model, bodies, members, root, notes)
    ends = [
        (k, end) for k, m in enumerate(members) for end in (0, 1) if clamped[m.roots[end]] and m.roots[end] not in drawn
    ]
    rigid = _rigid_ends(model)
    grounds: list[Block] = []
    at_ends: list[tuple[int, int]] = []
    for k, end in ends:
        member = members[k]
        others = [*bodies, *(other for other in members if other is not member)]
        block = None if (member.name, end) in rigid else _ground(member, end, others)
        if block is None:
            at_ends.append((k, end))
            why = "its root is rigid" if (member.name, end) in rigid else "a block of ground there would touch the part"
            notes.append(f"{member.name}: its {('first', 'last')[end]} end face is held, {why}")
        else:
            grounds.append(block)
    if grounds:
        notes.append(
            f"{len(grounds)} ends of members are in blocks of ground as wide as the member, 6 thicknesses deep and "
            f"as far beyond its faces, less where there is no room; held behind and at the far sides"
        )
    blocks = (*bodies, *grounds)
    for k, block in enumerate(blocks):
        if block.is_ground:
            held += [Held(k, 0, -1), Held(k, 2, -1), Held(k, 2, 1)]
    held += [Held(len(blocks) + k, 0, 2 * end - 1) for k, end in at_ends]
    return Pieces(blocks, tuple(members), tuple(held), tuple(notes))


def is_ground(piece: Piece) -> bool:
    """Whether a piece is a block of ground."""
    return isinstance(piece, Block) and piece.is_ground


def _refuse_unknown(model: FullOrderModel, members: list[MemberSolid], drawn: set[int]) -> None:
    """Raise ModelError for bodies of which only mass and inertia are known, where several members end in them."""
    names = model.plan.topology.node_names
    _, solid_bodies = solids_of(model)
    problems = []
    for root in solid_bodies.unknown - drawn:
        ends = [m.name for m in members if root in m.roots]
        if len(ends) > 1:
            rule = f"what holds {', '.join(ends[:4])} together has a form in a whole solid"
            hint = "give the body `solid` in place of mass and inertia"
            problems.append(Problem(("bodies", names[root]), "mass and inertia alone", rule, hint))
    if problems:
        raise ModelError(problems)


def clamped_nodes(model: FullOrderModel) -> dict[int, tuple[bool, ...]]:
    """Nodes that are held, by the description, with what of them is."""
    plan = model.plan
    exposed = plan.layout.exposed("")
    return {
        plan.topology.node((), name): support.held
        for text, support in plan.mechanism.ground.items()
        for name in matching(text, exposed)
    }


def _held_faces(
    model: FullOrderModel, bodies: list[Block], members: list[MemberSolid], root: int, notes: list[str]
) -> Iterator[Held]:
    """Faces of the bodies of a clamped root: those that clamped nodes lie on, else that farthest from the members."""
    names, roots = model.plan.topology.node_names, model.plan.topology.root
    numbers = [k for k, block in enumerate(bodies) if block.root == root]
    clamped = [node for node, held in clamped_nodes(model).items() if roots[node] == root and all(held)]
    on_faces = False
    faces_held = {
        ".".join((*path, key)): body.hold.face
        for name, part in model.plan.parts.items()
        for key, (_, body) in part.bodies.items()
        for path in model.plan.topology.copies[name].paths
        if body.hold is not None
    }
    for k in numbers:
        if bodies[k].name in faces_held:
            on_faces = True
            yield Held(k, *faces_held[bodies[k].name])
    if on_faces:
        return
    for node in clamped:
        faces = ((k, _face_at(bodies[k], model.positions[node])) for k in numbers)
        k, face = next(((k, face) for k, face in faces if face is not None), (0, None))
        if face is not None:
            on_faces = True
            notes.append(f"{bodies[k].name}: held on the face that {names[node]} lies on")
            yield Held(k, *face)
    if on_faces:
        return
    inside = [k for node in clamped for k in numbers if bodies[k].beyond(model.positions[node]) < 0]
    k = (inside or numbers)[0]
    body = bodies[k]
    ends = [m.end_point(e) for m in members for e in (0, 1) if m.roots[e] == root]
    towards = body.local(np.mean(ends, axis=0) if ends else body.centre)
    options = [(axis, side) for axis in ((0,) if body.is_round else (0, 1, 2)) for side in (-1, 1)]
    axis, side = min(options, key=lambda o: (round(float(o[1] * towards[o[0]] / body.half[o[0]]), 3), -body.half[o[0]]))
    sense = side * body.axes[axis]
    largest = int(np.argmax(np.abs(sense)))
    towards_axis = ("-" if sense[largest] < 0 else "+") + "xyz"[largest]
    rule = "held on its face towards" if abs(sense[largest]) > 0.999 else "held on its face that looks most towards"
    hint = "a clamped node on a face chooses another"
    notes.append(f"{body.name}: {rule} {towards_axis}, farthest from its members; {hint}")
    yield Held(k, axis, side)


def _face_at(block: Block, point: Array) -> tuple[int, int] | None:
    """The face of a block that a point lies on."""
    if abs(float(block.beyond(point))) > SAME_PLACE * 2 * float(block.half.max()):
        return None
    local = block.local(point)
    if block.is_round:
        across = block.half[1] - float(np.linalg.norm(local[1:]))
        return (0, int(np.sign(local[0]))) if block.half[0] - abs(local[0]) <= across else (3, 1)
    axis = int(np.argmin(block.half - np.abs(local)))
    return axis, int(np.sign(local[axis]))


def _rigid_ends(model: FullOrderModel) -> set[tuple[str, int]]:
    """Members' ends, as placed, whose roots are rigid by the description."""
    return {
        (".".join((*path, key)), end)
        for placed in model.plan.topology.copies.values()
        for path in placed.paths
        for key, member in placed.part.members.items()
        for end, kind in enumerate(member.root)
        if kind == "rigid"
    }


def _ground(member: MemberSolid, end: int, others: Sequence[Piece]) -> Block | None:
    """The block of ground at an end of a member, the largest that touches nothing else."""
    shape = member.outline
    y, z = float(shape.y[-end]), float(shape.z[-end])
    t = 2 * min(y, z)
    sense = member.axes[0] * (1 if end else -1)
    at = member.end_point(end)
    across = member.axes[1] if z <= y else member.axes[2]
    for depth in DEPTHS:
        half = np.array([depth * t / 2, max(y, z), t / 2 + depth * t])
        if shape.is_round:
            half[1] = half[2]
        # first axis towards the member, so that its negative side is the back
        axes = np.stack([-sense, across, np.cross(-sense, across)])
        centre = at + sense * half[0]
        name = f"ground of {member.name}"
        block = Block(name, -1, centre, axes, half, is_round=False, material=member.material, root=member.roots[end])
        if not any(_touches(block, other) for other in others):
            return block
    return None


def _touches(block: Block, other: Piece) -> bool:
    """Whether points of a piece lie in a block or at most a little beside it."""
    low, high = block.box
    their_low, their_high = other.box
    near = 1e-3 * block.thickness
    if (their_low > high + near).any() or (their_high < low - near).any():
        return False
    return bool((block.beyond(_points(other)) < near).any())


def _points(piece: Piece, count: int = 25) -> Array:
    """Points (n, 3) spread over a piece and its surface."""
    grid = np.linspace(-1, 1, count)
    x, v, w = (a.ravel() for a in np.meshgrid(grid, grid[::3], grid[::3], indexing="ij"))
    if isinstance(piece, Block):
        if piece.is_round:
            v, w = v * np.sqrt(1 - w**2 / 2), w * np.sqrt(1 - v**2 / 2)
        points = np.stack([x, v, w], axis=-1) * piece.half @ piece.axes + piece.centre
        return points if piece.pieces is None else points[piece.beyond(points) <= 0]
    x = (x + 1) / 2 * piece.length
    y, z = piece.outline.half(x)
    if piece.outline.is_round:
        v, w = v * np.sqrt(1 - w**2 / 2), w * np.sqrt(1 - v**2 / 2)
    return piece.placed(np.stack([x, v * y, w * z], axis=-1))


def extended(member: MemberSolid, end: int, hosts: list[Piece]) -> float:
    """How far an end is to reach on, m, for its whole face to be in one of the hosts; zero where it is or cannot be."""
    thin = 2 * float(min(member.outline.y[-end], member.outline.z[-end]))
    middle = member.end_point(end)[None]
    for by in np.concatenate([[0.0], np.linspace(0.02, 1.0, 50)]) * thin:
        points = np.concatenate([member.end_samples(end, -float(by)), middle])
        inside = np.min([host.beyond(points) for host in hosts], axis=0) <= SAME_PLACE * thin
        if inside.all():
            return float(by)
        if not inside.any():
            return 0.0
    return 0.0
