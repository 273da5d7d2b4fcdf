"""How much the solids of rigid bodies would give, and the block of the ground, under the forces of members."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from flexura.analysis.model_error.elastic_solids import ElasticSolid, Patch
from flexura.arrays import Array
from flexura.mechanism import TOP, Box, Cylinder, Mechanism, Plate, RigidBody, evaluated, rotation_matrix
from flexura.structure import FullOrderModel

Wrenches = Mapping[str, tuple[Array, Array]]
"""By prototype: forces and moments (i, e, 6, k) of all copies at the first and the second end of their elements,
element axes."""

DEPTH = 0.25
"""Depth of a block of the ground that is not drawn, over the largest distance that its members span."""

ON = 1e-6
"""Distance of a node from a face, relative to the solid's size, up to which it lies on it."""

ALIKE = 0.999
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
    """A placed solid: its names, its place, its axes (3, 3) as columns, and what pulls at it, global; `is_sure` where
    the description says what it is and where it is held."""

    name: str
    kind: str
    solid: ElasticSolid
    centre: Array
    axes: Array
    is_sure: bool = True
    is_drawn: bool = True
    ends: list[MemberEnd] = field(default_factory=list)

    @property
    def text(self) -> str:
        """What the description takes for granted of it."""
        size = " x ".join(f"{1e3 * own:.3g}" for own in self.solid.size)
        if not self.is_drawn:
            return f"ground that is not drawn, rigid here; a block of {size} mm, held behind, would give"
        if self.solid.held is None:
            return "body, rigid here; its solid would give"
        face = "clamped face" if self.is_sure else "face farthest from its members"
        return f"ground, rigid here; its solid, held at the {face}, would give"

    def distance(self, point: Array) -> float:
        """Distance of a point from the solid, m."""
        return float(np.linalg.norm(self.inside(point) - self.axes.T @ (point - self.centre)))

    def inside(self, point: Array) -> Array:
        """The nearest place (3,) in the solid, in its axes, m."""
        half = np.array(self.solid.size) / 2
        own = self.axes.T @ (point - self.centre)
        if self.solid.is_cylinder:
            radius = float(np.linalg.norm(own[:2] / half[:2]))
            own = np.concatenate([own[:2] / max(1.0, radius), own[2:]])
        return np.clip(own, -half, half)

    def flexibility(self) -> Array:
        """Products of deflection and load (k, k), J, of the loads at its ends; zero without any."""
        patches, own = [], []
        for end in self.ends:
            patch = Patch(self.inside(end.point), end.sides @ self.axes)
            force, moment = self.axes.T @ end.wrench[:3], self.axes.T @ end.wrench[3:]
            arm = self.axes.T @ (end.point - self.centre) - patch.centre
            patches.append(patch)
            own.append(np.concatenate([force, moment + np.cross(arm, force, axisb=0, axisc=0)]))
        return self.solid.flexibility(patches, np.stack(own))


def loaded_solids(full: FullOrderModel, wrenches: Wrenches, values: Mapping[str, Any]) -> list[LoadedSolid]:
    """The solids of all bodies at which members pull with these wrenches, and blocks for the members that end in the
    ground where none is drawn; for parameter values in SI.

    A body of which a clamped node lies on a face is held there, another one that is clamped on the face that is
    farthest from its members. Members that leave the ground in one direction from one plane share a block: as large
    as what they span, and a quarter of that deep.
    """
    root = full.plan.topology.root
    bodies = drawn_solids(full, values)
    of: dict[int, list[LoadedSolid]] = {}
    for body in bodies:
        of.setdefault(int(root[node_of(full, body.name)]), []).append(body)
    held = set(np.flatnonzero(full.plan.topology.held.all(axis=1)).tolist())
    bare: list[MemberEnd] = []
    for end in _ends(full, wrenches, {*of, *held}):
        own = of.get(int(root[end.node]), [])
        if own:
            min(own, key=lambda b: b.distance(end.point)).ends.append(end)
        else:
            bare.append(end)
    for body in bodies:
        cluster = int(root[node_of(full, body.name)])
        if cluster in held and body.ends:
            body.solid, body.is_sure = _held(full, body, cluster)
    return [body for body in (*bodies, *_blocks(full, bare, values)) if body.ends]


def drawn_solids(full: FullOrderModel, values: Mapping[str, Any]) -> list[LoadedSolid]:
    """Every placed body with a solid, without loads; for parameter values in SI."""
    topology, found = full.plan.topology, []
    for name, part in full.plan.parts.items():
        described = full.plan.layout.prototypes[name].bodies
        for key, (node, _) in part.bodies.items():
            body = evaluated(described[key], values)
            if body.solid is None:
                continue
            solid, axes = _solid(body, full.plan.layout.mechanism, values)
            placed = topology.copies[name]
            for path, number, offset in zip(placed.paths, placed.number, placed.offset, strict=True):
                turned = full.geometry.Q[number] @ axes
                turned[:, 2] *= np.linalg.det(turned).round()  # solids are their own mirror images, moments are not
                at = full.geometry.positions[offset + node]
                found.append(LoadedSolid(".".join((*path, key)), place_of(name, key), solid, at, turned))
    return found


def node_of(full: FullOrderModel, name: str) -> int:
    """The number of a body's node."""
    *path, node = name.split(".")
    return full.plan.topology.node(tuple(path), node)


def _held(full: FullOrderModel, body: LoadedSolid, cluster: int) -> tuple[ElasticSolid, bool]:
    """The solid held at a face, and whether a clamped node says at which."""
    topology, solid = full.plan.topology, body.solid
    half, own = np.array(solid.size) / 2, None
    for node in np.flatnonzero(topology.is_clamped & (topology.root == cluster)):
        at = body.axes.T @ (full.geometry.positions[node] - body.centre) / half
        axis = int(np.abs(at).argmax())
        if abs(abs(at[axis]) - 1) < ON:
            own = axis, int(np.sign(at[axis]))
    is_sure = own is not None
    if own is None:
        points = np.stack([body.inside(end.point) for end in body.ends])
        faces = [(axis, side) for axis in ((2,) if solid.is_cylinder else range(3)) for side in (-1, 1)]
        own = max(faces, key=lambda face: float((half[face[0]] - face[1] * points[:, face[0]]).min()))
    return ElasticSolid(solid.size, solid.E, solid.nu, solid.rho, solid.is_cylinder, own), is_sure


def _solid(body: RigidBody, mechanism: Mechanism, values: Mapping[str, Any]) -> tuple[ElasticSolid, Array]:
    """The elastic solid of a body, and its axes (3, 3) as columns in the axes of the part."""
    solid = body.solid
    assert solid is not None
    Q = np.eye(3)
    if body.rotate is not None:
        axis_of, angle = np.array(body.rotate.axis, dtype=float), np.array(body.rotate.angle, dtype=float)
        Q = rotation_matrix(axis_of, angle)
    own = np.eye(3)
    match solid:
        case Box(size=size):
            sizes = size
        case Plate(length=a, width=b, thickness=c):
            sizes = (a, b, c)
        case Cylinder(diameter=d, length=length, axis=axis):
            sizes = (d, d, length)
            along = np.array(axis, dtype=float)
            _, _, own = np.linalg.svd(along[None, :] / np.linalg.norm(along))
            own = np.roll(own, -1, axis=0).T
    x, y, z = (float(s) for s in sizes)  # type: ignore[arg-type]
    return ElasticSolid((x, y, z), *_material(mechanism, solid.material, values), isinstance(solid, Cylinder)), Q @ own


def _material(mechanism: Mechanism, name: str, values: Mapping[str, Any]) -> tuple[float, float, float]:
    """E, Pa, nu and rho, kg/m^3, of a material."""
    own = evaluated(mechanism.material(name), values)
    E, rho = float(own.E), float(own.rho)  # type: ignore[arg-type]
    nu = float(own.nu) if own.nu is not None else E / (2 * float(own.G)) - 1  # type: ignore[arg-type]
    return E, float(np.clip(nu, -0.9, 0.495)), rho


def _blocks(full: FullOrderModel, ends: list[MemberEnd], values: Mapping[str, Any]) -> Iterator[LoadedSolid]:
    """Blocks of the ground, held behind, for members that end in it with nothing drawn there."""
    together: list[list[MemberEnd]] = []
    for end in ends:
        out, size = end.axes[:, 0], float(np.linalg.norm(end.sides, axis=1).max())
        for group in together:
            first = group[0]
            is_level = abs((end.point - first.point) @ first.axes[:, 0]) < ON + 0.1 * size
            if out @ first.axes[:, 0] > ALIKE and is_level:
                group.append(end)
                break
        else:
            together.append([end])
    for group in together:
        axes = group[0].axes
        own = np.concatenate([end.point + CORNERS @ end.sides for end in group]) @ axes
        low, high = own.min(axis=0), own.max(axis=0)
        depth = DEPTH * float((high - low)[1:].max())
        size = np.maximum(high - low, depth)
        middle = (low + high) / 2
        middle[0] -= depth / 2
        name, key = group[0].member
        member = full.plan.parts[name].members[key]
        solid = ElasticSolid(
            (depth, float(size[1]), float(size[2])),
            *_material(full.plan.layout.mechanism, member.material, values),
            held=(0, -1),
        )
        place = place_of(name, key)
        yield LoadedSolid(place, place, solid, axes @ middle, axes, False, False, group)


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
                own = slice(part.first[m], part.first[m + 1])
                for end, inner in enumerate(both):
                    node = offset + inner
                    if int(root[node]) not in clusters:
                        continue
                    element = own.start if end == 0 else own.stop - 1
                    on = at_start[copy, element] if end == 0 else -at_end[copy, element]
                    turned = Q @ geometry.R[m].T
                    wrench = np.concatenate([turned @ on[:3], mirror * turned @ on[3:]])
                    point = full.geometry.positions[node] + Q @ geometry.offsets[m, end]
                    # a notch leads its load through its web, so that it presses on less than its whole end
                    broad, tall = (np.sqrt(s[element] * s[own].min()) for s in (wide, deep))
                    sides = np.stack([broad * turned[:, 1], tall * turned[:, 2]])
                    x = turned[:, 0] * (1 - 2 * end)
                    axes = np.stack([x, turned[:, 1], np.cross(x, turned[:, 1])], axis=1)
                    yield MemberEnd(node, point, axes, sides, wrench, (name, keys[m]))
