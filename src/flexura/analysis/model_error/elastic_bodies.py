"""How much the solids of bodies that are rigid here would give, and of the ground, and of bodies that bend.

Each is an elastic box or cylinder, free or held at a face, solved by the Rayleigh-Ritz method (`flexura.beam.ritz`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam import Material, ModalSolid, Patches, RitzSolid, Solid
from flexura.mechanism import TOP, Mechanism, evaluated
from flexura.structure import BodyElement, FullOrderModel, MeshedSolid, inside
from flexura.thresholds import SAME_PLACE

PATCH_POINTS, PATCH_WEIGHTS = np.polynomial.legendre.leggauss(3)
"""Gauss points along each side of the patch that a member holds."""


def _in_mm(size: Array) -> str:
    return " x ".join(f"{1e3 * side:.3g}" for side in size)


Wrenches = Mapping[str, tuple[Array, Array]]
"""By prototype: forces and moments (i, e, 6, k) of all copies at the first and the second end of their elements,
element axes."""

DEPTH = 0.25
"""Depth of a block of the ground that is not drawn, over the largest distance that its members span."""

ONE_WAY = 0.999
"""Cosine of the angle between members up to which they leave one block of the ground."""


CORNERS = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
"""Of a section, in half sides."""


def place_of(name: str, key: str) -> str:
    """How a member or body of a prototype is called."""
    return f"{name}.{key}" if name != TOP else key


class MemberEnd(NamedTuple):
    """The end of a placed member: its node, its place (3,), m, the axes (3, 3) as columns of the member, x leading out
    of what holds it, half sides of its section (2, 3), m, and the wrench (6, k) with which it pulls at that, global."""

    node: int
    point: Array
    axes: Array
    sides: Array
    wrench: Array
    member: tuple[str, str]


@dataclass
class LoadedSolid:
    """A placed solid: its names, half sizes (3,), m, its place, its axes (3, 3) as columns, what pulls at it, global.

    A cylinder lies along its first axis; of a composite it is the box around it, whose middle is `middle` (3,), m, from
    its own origin. `held` is the axis and the side of the face that does not move; `is_sure`
    where the description says what it is and where it is held, `bends` where it is elastic in the model, too.
    """

    name: str
    kind: str
    half: Array
    material: Material
    centre: Array
    axes: Array
    is_round: bool = False
    held: tuple[int, int] | None = None
    is_sure: bool = True
    is_drawn: bool = True
    bends: bool = False
    mesh: MeshedSolid | None = None
    middle: Array = field(default_factory=lambda: np.zeros(3))
    ends: list[MemberEnd] = field(default_factory=list)

    @property
    def size(self) -> Array:
        """Its sides (3,), m."""
        return 2 * self.half

    @property
    def text(self) -> str:
        """What the description takes for granted of it."""
        if not self.is_drawn:
            return f"ground that is not drawn, rigid here; a block of {_in_mm(self.size)} mm, held behind, would give"
        if self.bends:
            return "body that bends, pulled at by patches"
        if self.held is None:
            return "body, rigid here; its solid would give"
        face = "clamped face" if self.is_sure else "face farthest from its members"
        return f"ground, rigid here; its solid, held at the {face}, would give"

    def distance(self, point: Array) -> float:
        """Distance of a point from the solid, m."""
        return float(np.linalg.norm(self.inside(point) - self.axes.T @ (point - self.centre)))

    def inside(self, point: Array) -> Array:
        """The nearest place (3,) in the solid, in its axes, m."""
        return inside(self.axes.T @ (point - self.centre), self.half, self.is_round)

    def flexibility(self) -> Array:
        """Products of deflection and load (k, k), J, of the loads at its ends; what is out of balance among them
        accelerates a free solid. Raises SolverError for a solid that is too slender."""
        mirror, turn = np.linalg.det(self.axes).round(), self.axes.T
        wrenches = [np.concatenate([turn @ end.wrench[:3], mirror * turn @ end.wrench[3:]]) for end in self.ends]
        patches = self._patches()
        if self.mesh is None:
            functions = RitzSolid.of(self.size, self.is_round, self.held, len(self.ends))
            solid: Solid = ModalSolid(functions, self.size, self.material)
        else:
            patches = Patches(patches.points + self.middle, patches.weights, patches.nodes + self.middle)
            solid = self.mesh.solid(patches, self.held)
        load = np.swapaxes(solid.rows(patches)[:, : 6 * len(wrenches)], -1, -2) @ np.concatenate(wrenches)
        return np.asarray((np.swapaxes(load, -1, -2) @ solid.solved(load)).sum(axis=0))

    def _patches(self) -> Patches:
        """Where members end on it."""
        y, z = (axis.ravel() for axis in np.meshgrid(PATCH_POINTS, PATCH_POINTS, indexing="ij"))
        weights = np.outer(PATCH_WEIGHTS, PATCH_WEIGHTS).ravel() / 4
        points = [
            inside(
                self.inside(end.point) + np.stack([y, z], axis=1) @ (end.sides @ self.axes), self.half, self.is_round
            )
            for end in self.ends
        ]
        nodes = np.stack([self.axes.T @ (end.point - self.centre) for end in self.ends])
        return Patches(np.stack(points), np.tile(weights, (len(points), 1)), nodes)


def loaded_solids(full: FullOrderModel, wrenches: Wrenches, values: Mapping[str, Any]) -> list[LoadedSolid]:
    """The solids of all bodies at which members pull with these wrenches, and blocks for the members that end in the
    ground where none is drawn; for parameter values in SI.

    A body of which a clamped node lies on a face is held there, another one that is clamped on the face that is
    farthest from its members. Members that leave the ground in one direction from one plane share a block: as large
    as what they span, and a quarter of that deep.
    """
    topology = full.plan.topology
    root = topology.root
    bodies = drawn_solids(full)
    by_name = {body.name: body for body in bodies}
    of_cluster: dict[int, list[LoadedSolid]] = {}
    for name, part in full.plan.parts.items():
        for key, (node, _) in part.bodies.items():
            on = part.elastic[key].carried if key in part.elastic else [node]
            for path, offset in zip(topology.copies[name].paths, topology.copies[name].offset, strict=True):
                if (body := by_name.get(".".join((*path, key)))) is not None:
                    for at in {int(root[offset + number]) for number in on}:
                        of_cluster.setdefault(at, []).append(body)
    held = set(np.flatnonzero(topology.held.all(axis=1)).tolist())
    bare: list[MemberEnd] = []
    for end in _ends(full, wrenches, {*of_cluster, *held}):
        carriers = of_cluster.get(int(root[end.node]), [])
        if carriers:
            min(carriers, key=lambda body: body.distance(end.point)).ends.append(end)
        else:
            bare.append(end)
    for cluster in held & {*of_cluster}:
        for body in of_cluster[cluster]:
            if body.ends and not body.bends:
                body.held, body.is_sure = _held(full, body, cluster)
    return [body for body in (*bodies, *_blocks(full, bare, values)) if body.ends]


def drawn_solids(full: FullOrderModel) -> list[LoadedSolid]:
    """Every placed body with a solid, without loads."""
    topology, solids = full.plan.topology, list[LoadedSolid]()
    for name, part in full.plan.parts.items():
        for key, (node, body) in part.bodies.items():
            if not body.has_form:
                continue
            rows, half = body.box(full.values)
            bending = part.elastic.get(key)
            hold = bending.hold if bending is not None else body.hold
            placed = topology.copies[name]
            for path, number, offset in zip(placed.paths, placed.number, placed.offset, strict=True):
                turned = full.geometry.Q[number] @ rows.T
                if body.mesh is None:
                    turned[:, 2] *= np.linalg.det(turned).round()  # boxes are their own mirror images, moments are not
                at = full.geometry.positions[offset + node] + full.geometry.Q[number] @ body.middle(full.values)
                solid = LoadedSolid(".".join((*path, key)), place_of(name, key), half, _of(body, full), at, turned)
                solid.is_round, solid.bends = body.is_round, bending is not None
                solid.held = None if hold is None else hold.face
                solid.mesh, solid.middle = body.mesh, rows @ body.middle(full.values)
                solids.append(solid)
    return solids


def _of(body: BodyElement, full: FullOrderModel) -> Material:
    return _limited(*map(float, body.material(full.values)))


def _limited(E: float, nu: float, rho: float) -> Material:
    return Material(np.array(E), np.array(np.clip(nu, -0.9, 0.495)), np.array(rho))


def node_of(full: FullOrderModel, name: str) -> int:
    """The number of a body's node."""
    *path, node = name.split(".")
    return full.plan.topology.node(tuple(path), node)


def _held(full: FullOrderModel, body: LoadedSolid, cluster: int) -> tuple[tuple[int, int], bool]:
    """The face at which a body is held, and whether the description says at which."""
    if body.held is not None:
        return body.held, True
    topology, half = full.plan.topology, body.half
    clamped: tuple[int, int] | None = None
    for node in np.flatnonzero(topology.is_clamped & (topology.root == cluster)):
        at = body.axes.T @ (full.geometry.positions[node] - body.centre) / half
        axis = int(np.abs(at).argmax())
        if abs(abs(at[axis]) - 1) < SAME_PLACE:
            clamped = axis, int(np.sign(at[axis]))
    if clamped is not None:
        return clamped, True
    points = np.stack([body.inside(end.point) for end in body.ends])
    faces = [(axis, side) for axis in ((0,) if body.is_round else range(3)) for side in (-1, 1)]
    return max(faces, key=lambda face: float((half[face[0]] - face[1] * points[:, face[0]]).min())), False


def _material(mechanism: Mechanism, name: str, values: Mapping[str, Any]) -> Material:
    """What a material is, for parameter values in SI."""
    material = evaluated(mechanism.material(name), values)
    E, rho = float(material.E), float(material.rho)  # type: ignore[arg-type]
    nu = float(material.nu) if material.nu is not None else E / (2 * float(material.G)) - 1  # type: ignore[arg-type]
    return _limited(E, nu, rho)


def _blocks(full: FullOrderModel, ends: list[MemberEnd], values: Mapping[str, Any]) -> Iterator[LoadedSolid]:
    """Blocks of the ground, held behind, for members that end in it with nothing drawn there."""
    groups: list[list[MemberEnd]] = []
    for end in ends:
        out, size = end.axes[:, 0], float(np.linalg.norm(end.sides, axis=1).max())
        for group in groups:
            first = group[0]
            is_level = abs((end.point - first.point) @ first.axes[:, 0]) < SAME_PLACE + 0.1 * size
            if out @ first.axes[:, 0] > ONE_WAY and is_level:
                group.append(end)
                break
        else:
            groups.append([end])
    for group in groups:
        axes = group[0].axes
        corners = np.concatenate([end.point + CORNERS @ end.sides for end in group]) @ axes
        low, high = corners.min(axis=0), corners.max(axis=0)
        depth = DEPTH * float((high - low)[1:].max())
        size = np.maximum(high - low, depth)
        middle = (low + high) / 2
        middle[0] -= depth / 2
        name, key = group[0].member
        member = full.plan.parts[name].members[key]
        size[0], place = depth, place_of(name, key)
        material = _material(full.plan.layout.mechanism, member.material, values)
        block = LoadedSolid(place, place, size / 2, material, axes @ middle, axes, held=(0, -1))
        block.is_sure, block.is_drawn, block.ends = False, False, group
        yield block


def _ends(full: FullOrderModel, wrenches: Wrenches, clusters: set[int]) -> Iterator[MemberEnd]:
    """Ends of members at nodes of some rigid clusters, by their roots."""
    root = full.plan.topology.root
    for name, (at_start, at_end) in wrenches.items():
        part, placed = full.plan.parts[name], full.plan.topology.copies[name]
        geometry = full.geometry.parts[name]
        _, _, nu, _ = part.table.moduli(full.values)
        sections = part.table.section_properties(full.values, nu, geometry.length)
        deep, wide = np.sqrt(3 * sections.Iy / sections.A), np.sqrt(3 * sections.Iz / sections.A)
        keys = list(part.members)
        for copy, (number, offset) in enumerate(zip(placed.number, placed.offset, strict=True)):
            Q = full.geometry.Q[number]
            mirror = round(float(np.linalg.det(Q)))
            for m, both in enumerate(part.ends.tolist()):
                elements = slice(part.first[m], part.first[m + 1])
                for end, inner in enumerate(both):
                    node = offset + inner
                    if int(root[node]) not in clusters:
                        continue
                    element = elements.start if end == 0 else elements.stop - 1
                    on = at_start[copy, element] if end == 0 else -at_end[copy, element]
                    turned = Q @ geometry.R[m].T
                    wrench = np.concatenate([turned @ on[:3], mirror * turned @ on[3:]])
                    point = full.geometry.positions[node] + Q @ geometry.offsets[m, end]
                    # a notch leads its load through its web, so that it presses on less than its whole end
                    broad, tall = (np.sqrt(s[element] * s[elements].min()) for s in (wide, deep))
                    sides = np.stack([broad * turned[:, 1], tall * turned[:, 2]])
                    x = turned[:, 0] * (1 - 2 * end)
                    axes = np.stack([x, turned[:, 1], np.cross(x, turned[:, 1])], axis=1)
                    yield MemberEnd(node, point, axes, sides, wrench, (name, keys[m]))
