"""Doubts about rigid bodies: solids that would bend enough to lower a frequency, and nodes that lie outside them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.doubts import Doubt, place_of
from flexura.analysis.elastic_solids import ElasticSolid, Patch
from flexura.analysis.energy import placed_motions
from flexura.beam import rigid_arm
from flexura.errors import SolverError
from flexura.linalg import lowest_modes
from flexura.mechanism import Box, Cylinder, Mechanism, Plate, RigidBody, evaluated, rotation_matrix
from flexura.reduction import chained
from flexura.structure import FullOrderModel

Array = NDArray[np.float64]

LOWERED = 0.02
"""Relative lowering of a frequency by elastic bodies from which it is a doubt."""

MODES = 6
"""Lowest modes that are asked for by default; twice as many are taken to estimate them."""

SHARE = 0.2
"""Part of the lowering of a mode from which a body is named."""

OUTSIDE = 0.25
"""Distance of a carried node from the solid, relative to the size of the solid, from which it is a doubt."""


@dataclass
class _Loaded:
    """A placed body with a solid: its names, its place, its axes (3, 3) as columns, and what pulls at it, global."""

    name: str
    kind: str
    solid: ElasticSolid
    centre: Array
    axes: Array
    points: list[Array] = field(default_factory=list)
    sides: list[Array] = field(default_factory=list)
    wrenches: list[Array] = field(default_factory=list)

    def distance(self, point: Array) -> float:
        """Distance of a point from the solid, m."""
        return float(np.linalg.norm(self._inside(point) - self.axes.T @ (point - self.centre)))

    def _inside(self, point: Array) -> Array:
        half = np.array(self.solid.size) / 2
        own = self.axes.T @ (point - self.centre)
        if self.solid.is_cylinder:
            radius = float(np.linalg.norm(own[:2] / half[:2]))
            own = np.concatenate([own[:2] / max(1.0, radius), own[2:]])
        return np.clip(own, -half, half)

    def flexibility(self, modes: int) -> Array:
        """Products of deflection and load (k, k), J, in the modes."""
        if not self.points:
            return np.zeros((modes, modes))
        patches, own = [], []
        for point, sides, wrench in zip(self.points, self.sides, self.wrenches, strict=True):
            patch = Patch(self._inside(point), sides @ self.axes)
            force, moment = self.axes.T @ wrench[:3], self.axes.T @ wrench[3:]
            arm = self.axes.T @ (point - self.centre) - patch.centre
            patches.append(patch)
            own.append(np.concatenate([force, moment + np.cross(arm, force, axisb=0, axisc=0)]))
        return self.solid.flexibility(patches, np.stack(own))


@dataclass(frozen=True)
class Lowered:
    """Frequencies (k,), Hz, with rigid bodies, in ascending order; how far elastic solids lower each, relative; and the
    part (bodies, k) of every body in that."""

    bodies: tuple[_Loaded, ...]
    frequency_hz: Array
    lowering: Array
    shares: Array


def lowered_by_bodies(full: FullOrderModel, values: Mapping[str, Any] | None = None) -> Lowered:
    """How far the lowest frequencies fall if bodies are as elastic as their solids, for parameter values in SI.

    The flexibility of the solids under the forces of the modes is added to that of the mechanism, in the space of its
    lowest modes: 1/omega^2 + f' C f/omega^4 (as S. Dunkerley, Phil. Trans. R. Soc. A 185 (1894) 279).
    """
    values = full.plan.scoped_values(full.parameters) if values is None else values
    bodies = _bodies(full, values)
    none = np.zeros(0)
    if not bodies or not full.order:
        return Lowered(tuple(bodies), none, none, np.zeros((len(bodies), 0)))
    apart = chained(full)
    pairs = lowest_modes(apart.pencil, min(2 * MODES, full.order), apart.rigid_motions)
    at = np.flatnonzero(pairs.values > 0)
    vectors = apart.recover(pairs.vectors[:, at])
    vectors = vectors / np.sqrt(np.einsum("ik,ik->k", vectors, full.M @ vectors))
    squared = pairs.values[at]
    _pull(full, bodies, full.node_displacements(vectors))
    own = np.stack([b.flexibility(len(at)) / np.outer(squared, squared) for b in bodies])
    if not np.isfinite(own).all():
        raise SolverError("the flexibility of a body is beyond what double precision holds")
    added, shapes = np.linalg.eigh(np.diag(1 / squared) + own.sum(axis=0))
    hz = np.sort(np.sqrt(squared)) / (2 * np.pi)
    shares = np.einsum("km,bkl,lm->bm", shapes[:, ::-1], own, shapes[:, ::-1])
    lowering = 1 - 1 / np.sqrt(added[::-1]) / (2 * np.pi * hz)
    return Lowered(tuple(bodies), hz, lowering, shares / np.maximum(shares.sum(axis=0), 1e-300))


def body_doubts(full: FullOrderModel, values: Mapping[str, Any], told: Collection[int] = ()) -> list[Doubt]:
    """Bodies whose solids, if they were elastic, would lower one of the lowest frequencies by 2 % or more, and carried
    nodes well outside the solid, for parameter values in SI; nodes `told` are in doubt already for where they are."""
    try:
        found = lowered_by_bodies(full, values)
    except SolverError as error:
        return [Doubt("proof", "mechanism", f"whether bodies are stiff enough is not known: {error}")]
    doubts = _outside(full, found.bodies, told)
    for kind in dict.fromkeys(b.kind for b in found.bodies) if len(found.frequency_hz) else ():
        doubts += _elastic(kind, found)
    return doubts


def _elastic(kind: str, found: Lowered) -> list[Doubt]:
    """A doubt about a body and all of its copies."""
    mine = [k for k, b in enumerate(found.bodies) if b.kind == kind]
    share, hz = found.shares[mine].sum(axis=0), found.frequency_hz
    first, highest = found.bodies[mine[0]].solid.first_hz, float(hz[:MODES][-1])
    at = [k for k in range(min(MODES, len(hz))) if found.lowering[k] >= LOWERED and share[k] >= SHARE]
    if at:
        listed = ", ".join(f"mode {k + 1} ({hz[k]:.4g} Hz) by about {found.lowering[k]:.0%}" for k in at)
        among = "" if share[at].max() > 0.95 else f", of which {share[at].max():.0%} or less its own"
        text = (
            f"rigid here; as elastic as its solid it would lower {listed}{among}; its own first elastic "
            f"frequency is {first:.4g} Hz. The estimate is often low; links with fidelity: solid show it"
        )
        return [Doubt("elastic", kind, text)]
    if first < highest:
        text = f"rigid here; its own first elastic frequency, {first:.4g} Hz, is below mode {MODES}, {highest:.4g} Hz"
        return [Doubt("elastic", kind, text)]
    return []


def _bodies(full: FullOrderModel, values: Mapping[str, Any]) -> list[_Loaded]:
    """Every placed body with a solid."""
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
                kind = place_of(name, key)
                turned = full.geometry.Q[number] @ axes
                turned[:, 2] *= np.linalg.det(turned).round()  # solids are their own mirror images, moments are not
                at = full.geometry.positions[offset + node]
                found.append(_Loaded(".".join((*path, key)), kind, solid, at, turned))
    return found


def _solid(body: RigidBody, mechanism: Mechanism, values: Mapping[str, Any]) -> tuple[ElasticSolid, Array]:
    """The elastic solid of a body, and its axes (3, 3) as columns in the axes of the part."""
    solid = body.solid
    assert solid is not None
    Q = np.eye(3)
    if body.rotate is not None:
        axis_of, angle = np.array(body.rotate.axis, dtype=float), np.array(body.rotate.angle, dtype=float)
        Q = rotation_matrix(axis_of, angle)
    material = evaluated(mechanism.material(solid.material), values)
    E, rho = float(material.E), float(material.rho)  # type: ignore[arg-type]
    nu = float(material.nu) if material.nu is not None else E / (2 * float(material.G)) - 1  # type: ignore[arg-type]
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
    return ElasticSolid((x, y, z), E, float(np.clip(nu, -0.9, 0.495)), rho, isinstance(solid, Cylinder)), Q @ own


def _pull(full: FullOrderModel, bodies: list[_Loaded], displacements: Array) -> None:
    """Give every body the wrenches with which members and springs pull at it in motions (n, 6, k), global."""
    root = full.plan.topology.root
    of: dict[int, list[_Loaded]] = {}
    for body in bodies:
        node = full.plan.topology.numbers([body.name])[0] if "." not in body.name else _node(full, body.name)
        of.setdefault(int(root[node]), []).append(body)
    for node, point, sides, wrench in _wrenches(full, displacements):
        own = of.get(int(root[node]), [])
        if own:
            body = min(own, key=lambda b: b.distance(point))
            body.points.append(point)
            body.sides.append(sides)
            body.wrenches.append(wrench)


def _node(full: FullOrderModel, name: str) -> int:
    *path, node = name.split(".")
    return full.plan.topology.node(tuple(path), node)


def _wrenches(full: FullOrderModel, displacements: Array) -> Iterator[tuple[int, Array, Array, Array]]:
    """For every end of a member: its node, its place (3,), half sides of its section (2, 3), m, and the wrench (6, k)
    with which it pulls at what holds it, global."""
    for name, matrices in full.matrices.items():
        part, placed = full.plan.parts[name], full.plan.topology.copies[name]
        if not part.members:
            continue
        geometry = full.geometry.parts[name]
        _, _, nu, _ = part.table.moduli(full.values)
        sections = part.table.section_properties(full.values, nu, geometry.length)
        deep, wide = np.sqrt(3 * sections.Iy / sections.A), np.sqrt(3 * sections.Iz / sections.A)
        ends = part.ends
        for (_, u), number, offset in zip(
            placed_motions(full, displacements, name), placed.number, placed.offset, strict=True
        ):
            Q = full.geometry.Q[number]
            mirror = round(float(np.linalg.det(Q)))
            for k in range(len(part.members)):
                R = geometry.R[k]
                for end, element in ((0, part.first[k]), (1, part.first[k + 1] - 1)):
                    v = matrices.T[element] @ u[part.connectivity[element]].reshape(12, -1)
                    arm = rigid_arm(np.array([float(np.ravel(matrices.elements.length)[element]), 0.0, 0.0]))
                    C = matrices.elements.C[element]
                    force = np.linalg.solve(C, v[6:] - arm @ v[:6])
                    on = -force if end == 1 else arm.T @ force
                    turned = Q @ R.T
                    wrench = np.concatenate([turned @ on[:3], mirror * turned @ on[3:]])
                    node = offset + ends[k, end]
                    point = full.geometry.positions[node] + Q @ geometry.offsets[k, end]
                    own = slice(part.first[k], part.first[k + 1])
                    # a notch leads its load through its web, so that it presses on less than its whole end
                    broad, tall = (np.sqrt(s[element] * s[own].min()) for s in (wide, deep))
                    sides = np.stack([broad * turned[:, 1], tall * turned[:, 2]])
                    yield int(node), point, sides, wrench


def _outside(full: FullOrderModel, bodies: Sequence[_Loaded], told: Collection[int]) -> list[Doubt]:
    """Doubts about nodes that a body carries on long arms."""
    doubts: dict[str, Doubt] = {}
    names = full.plan.topology.node_names
    for body in bodies:
        own = _node(full, body.name)
        root = full.plan.topology.root
        together = [b for b in bodies if root[_node(full, b.name)] == root[own]]
        if len(together) > 1:
            continue
        on_body = np.flatnonzero((root == root[own]) & full.plan.topology.has_position)
        nodes = [int(n) for n in on_body if int(n) not in told]
        far = max(nodes, key=lambda n: body.distance(full.geometry.positions[n]), default=own)
        reach = body.distance(full.geometry.positions[far])
        if far not in told and reach > OUTSIDE * max(body.solid.size):
            text = (
                f"{names[far]} lies {1e3 * reach:.3g} mm outside the solid of {1e3 * max(body.solid.size):.3g} mm: "
                "what leads there is taken as rigid and without mass; add links or bodies for it"
            )
            doubts.setdefault(body.kind, Doubt("reach", body.kind, text))
    return list(doubts.values())
