"""Members and bodies as the solids that they are, in place: lofts through sections, boxes, cylinders."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.convex import boxes
from flexura.structure.composites import MeshedSolid
from flexura.structure.model import FullOrderModel
from flexura.structure.sections import SectionGroup

GROUND = -1
"""The cluster of all nodes that are clamped."""
DISC_SLICES = 8
"""Slices of a disc; it has twice as many sides, as has a ring, and lies in the circle."""
ROUND = np.pi / (DISC_SLICES * np.sin(np.pi / DISC_SLICES))
"""Area of a circle over that of the polygon in it."""
LOFT_SECTIONS = 33
"""Sections along a member whose section varies."""

_VARYING = ("notch", "round", "two_axis")
_ROUND = ("circle", "round", "tube")


@dataclass(frozen=True)
class Bars:
    """Members whose section has a form, all placed copies (n); those of section constants are left out.

    origin: (n, 3), m, where they begin; axes: (n, 3, 3), local axes as rows, global frame; length: (n,), m; half:
    (n, 2), m, largest half sizes along local y and z; end_half: (n, 2, 2), those at both ends, which come last;
    clusters: (n, 2), what the ends move with; group, row: (n,), the loft of each.
    """

    names: list[str]
    labels: list[str]
    nodes: Index
    origin: Array
    axes: Array
    length: Array
    half: Array
    end_half: Array
    clusters: Index
    group: Index
    row: Index
    lofts: list[Loft]

    def end(self, which: int) -> Array:
        """Points (n, 3), m, at which the members begin (0) or end (1)."""
        return self.origin + (self.axes[:, 0] * self.length[:, None] if which else 0.0)

    def boxes(self, index: Index, span: Array, half: Array) -> Array:
        """Corners (k, 8, 3) of boxes around the axes of members `index` (k,), with half sizes (k, 2), m, from one
        fraction of the length to another, span (k, 2)."""
        axes, L = self.axes[index], self.length[index]
        centre = self.origin[index] + (span.mean(axis=1) * L)[:, None] * axes[:, 0]
        sizes = np.column_stack([np.maximum(span[:, 1] - span[:, 0], 0.0) * L / 2, half])
        return boxes(centre, axes, sizes)

    def pieces(self, k: int, first: float = 0.0, last: float = 1.0) -> Array:
        """Corners (p, 8, 3) of the convex pieces of member k from one fraction of its length to another."""
        local = self.lofts[self.group[k]].pieces(int(self.row[k]), first, last)
        local[..., 0] *= self.length[k]
        return self.origin[k] + local @ self.axes[k]


@dataclass(frozen=True)
class Loft:
    """Sections of equal members at fractions (s,) of their length: half sizes y and z (m, s), m; inner: (m,), the bore
    of tubes over their diameter."""

    is_round: bool
    fractions: Array
    y: Array
    z: Array
    inner: Array

    def pieces(self, row: int, first: float, last: float) -> Array:
        """Convex pieces (p, 8, 3) of a member: x in fractions of the length, y and z in m."""
        x = self.fractions
        inside = x[(x > first) & (x < last)]
        x = np.concatenate([[first], inside, [last]]) if last > first else np.array([first])
        y, z = (np.interp(x, self.fractions, size[row]) for size in (self.y, self.z))
        if not self.is_round:
            outline = np.array([[[-1, -1], [-1, 1], [1, -1], [1, 1]]], dtype=float)
        else:
            outline = ring(float(self.inner[row])) if self.inner[row] > 0 else disc()
        corners = np.empty((len(x) - 1, len(outline), 8, 3))
        for end, ends in ((0, slice(None, -1)), (1, slice(1, None))):
            sizes = np.stack([y[ends], z[ends]], axis=-1)
            corners[:, :, 4 * end : 4 * end + 4, 0] = x[ends, None, None]
            corners[:, :, 4 * end : 4 * end + 4, 1:] = outline * sizes[:, None, None]
        return corners.reshape(-1, 8, 3)


def disc() -> Array:
    """Slices (s, 4, 2) of a polygon in the unit circle."""
    angle = np.pi * np.arange(DISC_SLICES + 1) / DISC_SLICES
    y, z = np.sin(angle), -np.cos(angle)
    low, high = slice(None, -1), slice(1, None)
    corners = [(-y[low], z[low]), (-y[high], z[high]), (y[low], z[low]), (y[high], z[high])]
    return np.stack([np.stack(c, axis=-1) for c in corners], axis=1)


def ring(inner: float) -> Array:
    """Sectors (s, 4, 2) of a ring in the unit circle; its bore is drawn as wide as it is."""
    angle = np.pi * np.arange(2 * DISC_SLICES + 1) / DISC_SLICES
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    bore = inner / np.cos(np.pi / (2 * DISC_SLICES)) * rim
    return np.stack([bore[:-1], rim[:-1], bore[1:], rim[1:]], axis=1)


@dataclass(frozen=True)
class Bodies:
    """Rigid bodies given as solids, all placed copies (n).

    origin: (n, 3), m, middles of the boxes around them; axes: (n, 3, 3) as rows, global frame; half: (n, 3), half
    sizes, m; is_round: (n,), cylinders about their first axis; nodes, clusters (n,); unknown: pieces of bodies of which
    only mass and inertia are known; meshes: those that are composites, by number, with their place from the origin.
    """

    names: list[str]
    labels: list[str]
    nodes: Index
    origin: Array
    axes: Array
    half: Array
    is_round: NDArray[np.bool_]
    clusters: Index
    unknown: frozenset[int]
    meshes: dict[int, tuple[MeshedSolid, Array]] = field(default_factory=dict)

    def boxes(self, index: Index) -> Array:
        """Corners (k, 8, 3) of the boxes around bodies."""
        return boxes(self.origin[index], self.axes[index], self.half[index])

    def pieces(self, k: int) -> Array:
        """Corners (p, 8, 3) of the convex pieces of a body."""
        if k in self.meshes:
            mesh, away = self.meshes[k]
            return self.origin[k] + (mesh.cells[:, [0, 1, 2, 3, 0, 1, 2, 3]] + away) @ self.axes[k]
        if not self.is_round[k]:
            return self.boxes(np.array([k]))
        outline = disc()
        local = np.empty((len(outline), 8, 3))
        for end in (0, 1):
            local[:, 4 * end : 4 * end + 4, 0] = (2 * end - 1) * self.half[k, 0]
            local[:, 4 * end : 4 * end + 4, 1:] = outline * self.half[k, 1]
        return self.origin[k] + local @ self.axes[k]

    def volume(self, k: int) -> float:
        """Volume of a body, m^3."""
        if k in self.meshes:
            return self.meshes[k][0].volume
        return float(np.prod(2 * self.half[k])) * (np.pi / 4 if self.is_round[k] else 1.0)

    def nearest(self, k: int, points: Array) -> Array:
        """Vectors (p, 3), m, from points (p, 3) to the nearest points of a body; zero inside it."""
        local = (points - self.origin[k]) @ self.axes[k].T
        if k in self.meshes:
            mesh, away = self.meshes[k]
            near = mesh.pieces.nearest(local - away) + away
        elif self.is_round[k]:
            radius = np.linalg.norm(local[:, 1:], axis=1, keepdims=True)
            inside = local[:, 1:] * np.minimum(1.0, self.half[k, 1] / np.maximum(radius, 1e-300))
            near = np.column_stack([np.clip(local[:, 0], -self.half[k, 0], self.half[k, 0]), inside])
        else:
            near = np.clip(local, -self.half[k], self.half[k])
        return (near - local) @ self.axes[k]


def solids_of(model: FullOrderModel) -> tuple[Bars, Bodies]:
    """Members and bodies of a model (one design) as solids in place."""
    clusters = _clusters(model)
    return _bars(model, clusters), _bodies(model, clusters)


def _clusters(model: FullOrderModel) -> Index:
    """What each node (n,) moves with: the piece that it is of, or the ground."""
    topology = model.plan.topology
    return np.where(topology.grounded, GROUND, topology.piece)


def _bars(model: FullOrderModel, clusters: Index) -> Bars:
    plan, geometry, values = model.plan, model.geometry, model.values
    names: list[str] = []
    labels: list[str] = []
    lofts: list[Loft] = []
    empty = ((0, 2), (0, 3), (0, 3, 3), (0,), (0, 2), (0, 2, 2), (0,), (0,))
    columns: list[list[Any]] = [[np.empty(shape)] for shape in empty]
    for name, part in plan.parts.items():
        if not part.members:
            continue
        own, placed, keys = geometry.parts[name], plan.topology.copies[name], list(part.members)
        start = own.positions[part.ends[:, 0]] + own.offsets[:, 0]
        Q, t = geometry.Q[placed.number], geometry.t[placed.number]
        for group, _, _ in part.table.groups:
            if group.family == "constants":
                continue
            at, copies = group.index, len(placed.paths)
            loft = _loft(group, values, own.length[at])
            half = np.stack([loft.y.max(axis=1), loft.z.max(axis=1)], axis=-1)
            ends = np.stack([loft.y[:, [0, -1]], loft.z[:, [0, -1]]], axis=1)
            node = placed.numbers(part.ends[at])
            rows = (
                node.reshape(-1, 2),
                (start[at] @ np.swapaxes(Q, -1, -2) + t[:, None]).reshape(-1, 3),
                (own.R[at] @ np.swapaxes(Q, -1, -2)[:, None]).reshape(-1, 3, 3),
                *(np.tile(f, (copies, *[1] * (f.ndim - 1))) for f in (own.length[at], half, ends)),
                np.full(copies * len(at), len(lofts)),
                np.tile(np.arange(len(at)), copies),
            )
            for column, found in zip(columns, rows, strict=True):
                column.append(found)
            names += [".".join((*path, keys[k])) for path in placed.paths for k in at]
            labels += [".".join(filter(None, (name, keys[k]))) for k in at] * copies
            lofts.append(loft)
    nodes, origin, axes, length, half, ends, number, row = (np.concatenate(c) for c in columns)
    nodes, number, row = (x.astype(np.intp) for x in (nodes, number, row))
    return Bars(names, labels, nodes, origin, axes, length, half, ends, clusters[nodes], number, row, lofts)


def _loft(group: SectionGroup, values: Array, length: Array) -> Loft:
    """The sections of a group's members, closer towards both ends of a notch."""
    fractions = np.array([0.0, 1.0])
    if group.kind[0] in _VARYING:
        fractions = (1 - np.cos(np.pi * np.linspace(0, 1, LOFT_SECTIONS))) / 2
        if group.kind[0] == "two_axis":
            fractions = np.concatenate([fractions / 2, fractions[1:] / 2 + 0.5])
        fractions = np.union1d(fractions, group.corners(values, length).ravel())
    sizes = group.sizes(values, length, fractions)
    y, z = (np.broadcast_to(size / 2, (len(length), len(fractions))) for size in (sizes[0], sizes[-1]))
    inner = np.zeros(len(length))
    if group.kind[0] == "tube":
        z, inner = y, z[:, 0] / y[:, 0]
    return Loft(group.kind[0] in _ROUND, fractions, y, z, inner)


def _bodies(model: FullOrderModel, clusters: Index) -> Bodies:
    plan, geometry = model.plan, model.geometry
    names: list[str] = []
    labels: list[str] = []
    nodes, origin, axes, half, is_round = [], [], [], [], []
    meshes: dict[int, tuple[MeshedSolid, Array]] = {}
    unknown: set[int] = set()
    for name, part in plan.parts.items():
        placed = plan.topology.copies[name]
        for key, (node, body) in part.bodies.items():
            form = body.form(model.values)
            for number, offset, path in zip(placed.number, placed.offset, placed.paths, strict=True):
                if form is None:
                    unknown.add(int(plan.topology.piece[offset + node]))
                    continue
                if body.mesh is not None:
                    meshes[len(names)] = body.mesh, -form.axes @ form.middle
                names.append(".".join((*path, key)))
                labels.append(".".join(filter(None, (name, key))))
                origin.append(geometry.positions[offset + node] + geometry.Q[number] @ form.middle)
                axes.append(form.axes @ geometry.Q[number].T)
                half.append(form.half)
                is_round.append(form.is_round)
                nodes.append(offset + node)
    at = np.array(nodes, dtype=np.intp)
    return Bodies(
        names,
        labels,
        at,
        np.array(origin).reshape(-1, 3),
        np.array(axes).reshape(-1, 3, 3),
        np.array(half).reshape(-1, 3),
        np.array(is_round, dtype=bool),
        clusters[at],
        frozenset(unknown),
        meshes,
    )
