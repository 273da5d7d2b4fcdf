"""How much the solids of rigid bodies would give, and the block of the ground, under the forces of members.

Each is an elastic box or cylinder, free or held at a face, solved by the Rayleigh-Ritz method.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
from numpy.polynomial import legendre

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.mechanism import TOP, Box, Cylinder, Mechanism, Plate, RigidBody, evaluated, rotation_matrix
from flexura.structure import FullOrderModel
from flexura.thresholds import SAME_PLACE

ORDER = 8
"""Largest order of the products of Legendre polynomials: 165 functions for each displacement."""

ORDERS = np.array([at for at in np.ndindex(ORDER + 1, ORDER + 1, ORDER + 1) if sum(at) <= ORDER])
"""Orders (n, 3) along the axes of these products."""

SLENDEREST = 1e-15
"""Squared frequency over the largest one that is round-off: of rods from some 1500 times as long as thick on."""

PATCH_POINTS = 3
"""Gauss points along each side of the patch that a member holds."""


KEPT = 32
"""Solids whose modes are remembered."""


@dataclass(frozen=True)
class Patch:
    """Where a member ends on a solid, in its axes: the centre (3,) and the half sides of the section (2, 3), m."""

    centre: Array
    sides: Array


@dataclass(frozen=True)
class ElasticSolid:
    """An isotropic box of `size` (3,), m, or the elliptic cylinder about z that fits into it, in its own axes.

    Displacements are products of Legendre polynomials (W. M. Visscher, A. Migliori, T. M. Bell, R. A. Reinert, J.
    Acoust. Soc. Am. 90 (1991) 2154), so that frequencies are upper and deflections lower bounds. They do
    not show how a patch that is small beside the solid presses into it. `held` is the axis and the side, -1 or 1, of
    the face that does not move; the functions are then multiplied by the distance from it.
    """

    size: tuple[float, float, float]
    E: float
    nu: float
    rho: float
    is_cylinder: bool = False
    held: tuple[int, int] | None = None

    def functions(self, points: Array) -> tuple[Array, Array]:
        """Functions (p, n) and their gradients (3, p, n), 1/m, at points (p, 3), m."""
        x = 2 * points / np.array(self.size)
        X, Y, Z = (legendre.legvander(x[:, i], ORDER)[:, ORDERS[:, i]] for i in range(3))
        slopes = legendre.legder(np.eye(ORDER + 1))
        grown = [legendre.legvander(x[:, i], ORDER - 1) @ slopes for i in range(3)]
        dX, dY, dZ = (2 / self.size[i] * grown[i][:, ORDERS[:, i]] for i in range(3))
        functions, gradients = X * Y * Z, np.stack([dX * Y * Z, X * dY * Z, X * Y * dZ])
        if self.held is None:
            return functions, gradients
        axis, side = self.held
        distance = (1 - side * x[:, axis])[:, None]
        gradients = gradients * distance
        gradients[axis] -= 2 * side / self.size[axis] * functions
        return functions * distance, gradients

    def quadrature(self) -> tuple[Array, Array]:
        """Points (q, 3), m, and weights (q,), m^3, that integrate products of two functions exactly."""
        t, w = legendre.leggauss(ORDER + 2)
        if self.is_cylinder:
            angle = np.arange(2 * ORDER + 4) * np.pi / (ORDER + 2)
            r, wr = (t + 1) / 2, w / 2
            plane = (r[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)).reshape(-1, 2)
            area = np.repeat(wr * r, len(angle)) * np.pi / (ORDER + 2)
        else:
            plane = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
            area = np.outer(w, w).ravel()
        points = np.concatenate([np.repeat(plane, len(t), axis=0), np.tile(t, len(plane))[:, None]], axis=1)
        half = np.array(self.size) / 2
        return points * half, np.outer(area, w).ravel() * half.prod()

    @property
    def modes(self) -> tuple[Array, Array]:
        """Squared angular frequencies (k,), 1/s^2, and shapes (3, n, k) of the elastic modes, of unit modal mass.

        Raises SolverError where round-off hides the lowest.
        """
        return _modes(self)

    def flexibility(self, patches: Sequence[Patch], wrenches: Array) -> Array:
        """Products of deflection and load (k, k), J, for k loads at once: wrenches (p, 6, k), N and N m, on patches.

        What is out of balance among them accelerates the solid and is balanced by its inertia.
        """
        squared, shapes = self.modes
        load = np.zeros((len(squared), wrenches.shape[-1]))
        for patch, wrench in zip(patches, wrenches, strict=True):
            load += self._patch_rows(patch, shapes).T @ wrench
        return (load.T / squared) @ load

    def _patch_rows(self, patch: Patch, shapes: Array) -> Array:
        """Mean displacement and rotation (6, k) of a patch in the modes: those of the plane that fits best."""
        t, _ = legendre.leggauss(PATCH_POINTS)
        grid = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
        half = np.array(self.size) / 2
        points = np.clip(patch.centre + grid @ patch.sides, -half, half)
        moved = np.einsum("pn,ank->pak", self.functions(points)[0], shapes)
        r = points - points.mean(axis=0)
        cross = np.zeros((len(r), 3, 3))
        for k, j, i in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            cross[:, i, k], cross[:, k, i] = r[:, j], -r[:, j]  # what a rotation about each axis moves: theta x r
        inertia = np.einsum("pji,pjk->ik", cross, cross)
        turned = np.linalg.pinv(inertia, rcond=1e-9) @ np.einsum("pji,pjk->ik", cross, moved - moved.mean(axis=0))
        return np.concatenate([moved.mean(axis=0), turned])


@lru_cache(KEPT)
def _modes(solid: ElasticSolid) -> tuple[Array, Array]:
    points, weights = solid.quadrature()
    N, G = solid.functions(points)
    E, nu = solid.E, solid.nu
    lame, mu = E * nu / ((1 + nu) * (1 - 2 * min(nu, 0.4999))), E / (2 * (1 + nu))
    S = np.einsum("iqm,q,jqn->ijmn", G, weights, G, optimize=True)
    n = N.shape[1]
    K = np.zeros((3, n, 3, n))
    for a in range(3):
        for b in range(3):
            K[a, :, b] = lame * S[a, b] + mu * S[b, a]
        K[a, :, a] += mu * (S[0, 0] + S[1, 1] + S[2, 2])
    mass = solid.rho * (N.T * weights) @ N
    squared, shapes = la.eigh(K.reshape(3 * n, 3 * n), la.block_diag(mass, mass, mass))
    rigid = 6 if solid.held is None else 0
    if not squared[rigid] > SLENDEREST * squared[-1]:
        raise SolverError(f"a solid of {_in_mm(solid.size)} mm is too slender for an estimate of how it gives")
    return squared[rigid:], shapes[:, rigid:].reshape(3, n, -1)


def _in_mm(size: tuple[float, ...]) -> str:
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
        if not self.is_drawn:
            size = _in_mm(self.solid.size)
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
        x = self.axes.T @ (point - self.centre)
        if self.solid.is_cylinder:
            x[:2] /= max(1.0, float(np.linalg.norm(x[:2] / half[:2])))
        return np.clip(x, -half, half)

    def flexibility(self) -> Array:
        """Products of deflection and load (k, k), J, of the loads at its ends; zero without any."""
        patches, wrenches = [], []
        for end in self.ends:
            patch = Patch(self.inside(end.point), end.sides @ self.axes)
            force, moment = self.axes.T @ end.wrench[:3], self.axes.T @ end.wrench[3:]
            arm = self.axes.T @ (end.point - self.centre) - patch.centre
            patches.append(patch)
            wrenches.append(np.concatenate([force, moment + np.cross(arm, force, axisb=0, axisc=0)]))
        return self.solid.flexibility(patches, np.stack(wrenches))


def loaded_solids(full: FullOrderModel, wrenches: Wrenches, values: Mapping[str, Any]) -> list[LoadedSolid]:
    """The solids of all bodies at which members pull with these wrenches, and blocks for the members that end in the
    ground where none is drawn; for parameter values in SI.

    A body of which a clamped node lies on a face is held there, another one that is clamped on the face that is
    farthest from its members. Members that leave the ground in one direction from one plane share a block: as large
    as what they span, and a quarter of that deep.
    """
    root = full.plan.topology.root
    bodies = drawn_solids(full, values)
    of_cluster: dict[int, list[LoadedSolid]] = {}
    for body in bodies:
        of_cluster.setdefault(int(root[node_of(full, body.name)]), []).append(body)
    held = set(np.flatnonzero(full.plan.topology.held.all(axis=1)).tolist())
    bare: list[MemberEnd] = []
    for end in _ends(full, wrenches, {*of_cluster, *held}):
        carriers = of_cluster.get(int(root[end.node]), [])
        if carriers:
            min(carriers, key=lambda body: body.distance(end.point)).ends.append(end)
        else:
            bare.append(end)
    for cluster in held & {*of_cluster}:
        for body in of_cluster[cluster]:
            if body.ends:
                body.solid, body.is_sure = _held(full, body, cluster)
    return [body for body in (*bodies, *_blocks(full, bare, values)) if body.ends]


def drawn_solids(full: FullOrderModel, values: Mapping[str, Any]) -> list[LoadedSolid]:
    """Every placed body with a solid, without loads; for parameter values in SI."""
    topology, solids = full.plan.topology, list[LoadedSolid]()
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
                solids.append(LoadedSolid(".".join((*path, key)), place_of(name, key), solid, at, turned))
    return solids


def node_of(full: FullOrderModel, name: str) -> int:
    """The number of a body's node."""
    *path, node = name.split(".")
    return full.plan.topology.node(tuple(path), node)


def _held(full: FullOrderModel, body: LoadedSolid, cluster: int) -> tuple[ElasticSolid, bool]:
    """The solid held at a face, and whether a clamped node says at which."""
    topology, solid = full.plan.topology, body.solid
    half = np.array(solid.size) / 2
    clamped: tuple[int, int] | None = None
    for node in np.flatnonzero(topology.is_clamped & (topology.root == cluster)):
        at = body.axes.T @ (full.geometry.positions[node] - body.centre) / half
        axis = int(np.abs(at).argmax())
        if abs(abs(at[axis]) - 1) < SAME_PLACE:
            clamped = axis, int(np.sign(at[axis]))
    if clamped is not None:
        return replace(solid, held=clamped), True
    points = np.stack([body.inside(end.point) for end in body.ends])
    faces = [(axis, side) for axis in ((2,) if solid.is_cylinder else range(3)) for side in (-1, 1)]
    farthest = max(faces, key=lambda face: float((half[face[0]] - face[1] * points[:, face[0]]).min()))
    return replace(solid, held=farthest), False


def _solid(body: RigidBody, mechanism: Mechanism, values: Mapping[str, Any]) -> tuple[ElasticSolid, Array]:
    """The elastic solid of a body, and its axes (3, 3) as columns in the axes of the part."""
    solid, axes = body.solid, np.eye(3)
    assert solid is not None
    match solid:
        case Box(size=size):
            sides = size
        case Plate(length=a, width=b, thickness=c):
            sides = (a, b, c)
        case Cylinder(diameter=d, length=length, axis=axis):
            sides = (d, d, length)
            along = np.array(axis, dtype=float)
            _, _, rows = np.linalg.svd(along[None, :] / np.linalg.norm(along))
            axes = np.roll(rows, -1, axis=0).T
    if body.rotate is not None:
        axis, angle = (np.array(number, dtype=float) for number in (body.rotate.axis, body.rotate.angle))
        axes = rotation_matrix(axis, angle) @ axes
    x, y, z = (float(side) for side in sides)  # type: ignore[arg-type]
    material = _material(mechanism, solid.material, values)
    return ElasticSolid((x, y, z), *material, isinstance(solid, Cylinder)), axes


def _material(mechanism: Mechanism, name: str, values: Mapping[str, Any]) -> tuple[float, float, float]:
    """E, Pa, nu and rho, kg/m^3, of a material."""
    material = evaluated(mechanism.material(name), values)
    E, rho = float(material.E), float(material.rho)  # type: ignore[arg-type]
    nu = float(material.nu) if material.nu is not None else E / (2 * float(material.G)) - 1  # type: ignore[arg-type]
    return E, float(np.clip(nu, -0.9, 0.495)), rho


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
