"""Members as solids: their true sections along the length, bent with the shape functions of their elements, or along
axes between nodes that have moved and turned as far as they like."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.analysis import StressProfile, StressProfiles
from flexura.beam import SectionProperties, shape_functions
from flexura.structure import FullOrderModel, Part, PartGeometry, SectionGroup
from flexura.view.scene.meshes import Array, Index, loft_faces, polygon, square
from flexura.view.scene.scene import Collector, Grid, Kind, Look, Motions, Solids, Surfaces

_ROUND = ("circle", "round", "tube", "constants")
_VARYING = ("notch", "round", "two_axis")


@dataclass(frozen=True)
class Detail:
    """How finely members are drawn: segments of uniform and of varying members, sides of round ones.

    `lines` draws axes only.
    """

    uniform: int
    varying: int
    sides: int
    across: int = 1
    lines: bool = False

    def plain(self) -> Detail:
        """The same with flat sides whole, so that how many faces there are does not depend on sizes."""
        return replace(self, across=1)

    def segments(self, group: SectionGroup, elements: int) -> int:
        """Segments along a member of the group."""
        if self.lines:
            return self.uniform
        if group.kind[0] in _VARYING:
            return max(self.varying, min(4 * -(-elements // 4), 2 * self.varying))
        return int(np.clip(3 * elements, self.uniform // 2, 2 * self.uniform))

    def faces(self, group: SectionGroup, elements: int) -> int:
        """Most faces of one member of the group."""
        if self.lines:
            return self.uniform
        around = self.sides * (1 + (group.kind[0] == "tube")) if group.kind[0] in _ROUND else 2 + 2 * self.across
        return (self.segments(group, elements) + 2) * around


LEVELS = (
    Detail(16, 36, 24, across=2),
    Detail(10, 20, 14),
    Detail(5, 12, 8),
    Detail(2, 6, 6),
    Detail(4, 4, 0, lines=True),
)


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
    drawn = {}
    for name, (c, m) in counts.items():
        copies = look.chosen(c, c / max(total, 1))
        share = c / len(copies) if len(copies) else 1.0
        members = np.zeros(m, dtype=bool)
        members[look.chosen(m, share * m / max(total, 1))] = True
        drawn[name] = _Drawn(copies, members)
    return drawn


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


def add_members(collector: Collector, model: FullOrderModel) -> None:
    """Add members with their real sections, and note which are not drawn as they are."""
    drawn = _drawn(model, collector.look)
    detail = _detail(model, drawn, collector.look)
    for name, part in model.plan.parts.items():
        if part.members:
            _add_part(collector, model, name, drawn[name], detail)
    copies = model.plan.topology.copies
    total = sum(len(copies[name].paths) * len(chosen.members) for name, chosen in drawn.items())
    shown = sum(len(chosen.copies) * int(chosen.members.sum()) for chosen in drawn.values())
    if shown < total:
        collector.notes.append(f"{shown} of {total} members are drawn")
    if detail.lines and total:
        collector.notes.append("members are drawn as lines: there are too many to be drawn as solids")


class _Placing(NamedTuple):
    """Copies of a part: Q (c, 3, 3) and t (c, 3) place it in the global frame; its nodes (c, n) have motions."""

    Q: Array
    t: Array
    motions: Motions

    def end_displacements(self, T: Array, connectivity: Index) -> Array:
        """Displacements (c, e, 12) of the element ends in the elements' axes; rotations are axial vectors."""
        handed = np.linalg.det(self.Q).round()[:, None, None]
        u = np.concatenate([self.motions.shift @ self.Q, handed * (self.motions.rotations @ self.Q)], axis=-1)
        return np.einsum("eij,cej->cei", T, u[:, connectivity].reshape(len(u), len(connectivity), 12))


class _Stations(NamedTuple):
    """Stations s along members m of one group of a part, at `fractions` (s,) of their lengths (m,), m; each member, by
    number, has so many elements."""

    part: Part
    geometry: PartGeometry
    members: Index
    elements: int
    length: Array
    fractions: Array

    @property
    def element(self) -> Index:
        """In which element of its member each is (s,)."""
        return np.minimum((self.fractions * self.elements).astype(np.intp), self.elements - 1)

    @property
    def share(self) -> Array:
        """Where in its element each is, from 0 to 1 (s,)."""
        return self.fractions * self.elements - self.element

    @property
    def element_length(self) -> Array:
        """Lengths (m, 1), m, of elements."""
        return (self.length / self.elements)[:, None]

    @property
    def starts(self) -> Array:
        """Where members begin (m, 3), m, in the part's frame."""
        return self.geometry.positions[self.part.ends[self.members, 0]] + self.geometry.offsets[self.members, 0]


def _add_part(collector: Collector, model: FullOrderModel, name: str, drawn: _Drawn, detail: Detail) -> None:
    """Add the members of a part that are drawn, group by group."""
    part, geometry, placed = model.plan.parts[name], model.geometry.parts[name], model.plan.topology.copies[name]
    nodes = np.array(placed.offset)[drawn.copies, None] + np.arange(part.n_nodes)
    number = np.array(placed.number)[drawn.copies]
    placing = _Placing(model.geometry.Q[number], model.geometry.t[number], collector.motions.of(nodes))
    displacements = placing.end_displacements(model.geometry.T[name], part.connectivity)
    _, _, nu, _ = part.table.moduli(model.values)
    is_flexure = np.array([hasattr(member, "profile") for member in part.members.values()])
    keys, prefixes = list(part.members), ["".join(f"{step}." for step in placed.paths[c]) for c in drawn.copies]
    for group, elements, _ in part.table.groups:
        is_drawn = drawn.members[group.index]
        length = geometry.length[group.index]
        fractions = station_fractions(group, detail.segments(group, elements))
        section = group.properties(model.values, nu[group.index], length, fractions)
        rings = _rings(group, section, length, fractions, detail)
        rings, members = rings._replace(across=rings.across[is_drawn]), group.index[is_drawn]
        stations = _Stations(part, geometry, members, elements, length[is_drawn], fractions)
        names = [prefix + keys[k] for prefix in prefixes for k in members]
        kinds = np.tile(np.where(is_flexure[members], Kind.FLEXURE, Kind.LINK).astype(np.intp), (len(prefixes), 1))
        if collector.flagged:
            labels = [f"{name}.{keys[k]}" for k in members] * len(prefixes)
            is_flagged = [not collector.flagged.isdisjoint(pair) for pair in zip(names, labels, strict=True)]
            kinds[np.reshape(is_flagged, kinds.shape)] = Kind.FLAGGED
        along = np.repeat(fractions[rings.station], rings.across.shape[2])
        surfaces = _surfaces(stations, rings, placing, displacements)
        grid = Grid(name, drawn.copies, members, along, 0)
        collector.members(surfaces, grid, kinds, names, np.linalg.det(placing.Q) < 0)


def _surfaces(stations: _Stations, rings: _Rings, placing: _Placing, displacements: Array) -> Surfaces:
    """Surfaces of members in all copies of their part, and their motions; displacements: (c, e, 12) of the ends of all
    elements in their axes, if motions are small."""
    turned = np.swapaxes(placing.Q, -1, -2)
    local = np.zeros((*rings.across.shape[:-1], 3))
    local[..., 1:] = rings.across
    R = stations.geometry.R[stations.members] @ turned[:, None]
    first = stations.starts @ turned + placing.t[:, None]
    along = (stations.length[:, None] * stations.fractions)[:, rings.station, None, None]
    points = first[:, :, None, None] + along * R[:, :, None, None, 0] + local @ R[:, :, None]
    if placing.motions.is_finite:
        x, axes = _bent_axes(stations, placing, R)
        moved = x[:, :, rings.station, None] + local @ axes[:, :, rings.station] - points
    else:
        small = _small_motions(stations, displacements)[:, :, rings.station, None]
        u, turn = np.split(small, 2, axis=-1)
        moved = (u + np.cross(turn, local)) @ R[:, :, None]
    flat = (*points.shape[:2], -1, 3)
    return Surfaces(points.reshape(flat), moved.reshape(flat), rings.faces)


def _small_motions(stations: _Stations, displacements: Array) -> Array:
    """Small motions (c, m, s, 6) of stations along the members, member axes.

    Inside an element the motion follows the shape functions without shear, whatever its section (eq. 12 of the RPR
    paper): it is exact at the nodes.
    """
    one = np.ones(())
    section = SectionProperties(one, one, one, one, one, one)
    x = stations.share * stations.element_length
    N = shape_functions(x, 1.0, 1.0, section, np.broadcast_to(stations.element_length, x.shape), 0.0)
    ends = displacements[:, stations.part.first[stations.members][:, None] + stations.element]
    return np.einsum("msij,cmsj->cmsi", N, ends)


def _bent_axes(stations: _Stations, placing: _Placing, axes: Array) -> tuple[Array, Array]:
    """Where stations are (c, m, s, 3), m, and the axes of their sections (c, m, s, 3, 3) as rows, global frame.

    axes: (c, m, 3, 3) of members at rest as rows. Between the ends of an element, which move and turn with their nodes,
    its axis is the cubic that leaves both along their normals, and its section turns with the axis, and about it from
    one end to the other.
    """
    part, geometry, members = stations.part, stations.geometry, stations.members
    turned, k = np.swapaxes(placing.Q, -1, -2), stations.element
    nodes = part.connectivity[part.first[members][:, None] + k]
    fractions = (np.stack([k, k + 1], axis=-1) / stations.elements)[..., None]
    directions = stations.length[:, None] * geometry.R[members, 0]
    at_rest = stations.starts[:, None, None] + fractions * directions[:, None, None]
    arms = (at_rest - geometry.positions[nodes]) @ turned[:, None, None]
    positions = geometry.positions @ turned + placing.t[:, None]
    ends = placing.motions.of((slice(None), nodes))
    x = positions[:, nodes] + arms + ends.carried(arms)
    end_axes = axes[:, :, None, None] @ np.swapaxes(np.eye(3) + ends.turn, -1, -2)
    s, length = stations.share[:, None], stations.element_length[..., None]
    a, b = x[..., 0, :], x[..., 1, :]
    u, v = length * end_axes[..., 0, 0, :], length * end_axes[..., 1, 0, :]
    at = (1 + 2 * s) * (1 - s) ** 2 * a + s * (1 - s) ** 2 * u + s**2 * (3 - 2 * s) * b - s**2 * (1 - s) * v
    along = 6 * s * (1 - s) * (b - a) + (1 - s) * (1 - 3 * s) * u + s * (3 * s - 2) * v
    first = _unit(along)
    across = (1 - s) * end_axes[..., 0, 1, :] + s * end_axes[..., 1, 1, :]
    second = _unit(across - np.einsum("...i,...i->...", across, first)[..., None] * first)
    handed = np.linalg.det(axes).round()[:, :, None, None]
    return at, np.stack([first, second, handed * np.cross(first, second)], axis=-2)


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def station_fractions(group: SectionGroup, segments: int) -> Array:
    """Where along a member (0 to 1) its section is drawn.

    Closer towards the ends of notches, which are steep there; the middle of a notch is met, and in two-axis notches
    the quarters as well.
    """
    even = np.linspace(0, 1, segments + 1)
    if group.kind[0] not in _VARYING:
        return even
    if group.kind[0] == "two_axis" and segments % 2 == 0:
        half = _crowded(segments // 2) / 2
        return np.concatenate([half, half[1:] + 0.5])
    return _crowded(segments)


def _crowded(segments: int) -> Array:
    """Stations from 0 to 1, closer towards both ends."""
    return (1 - np.cos(np.pi * np.linspace(0, 1, segments + 1))) / 2


class _Rings(NamedTuple):
    """Rings of points around a member: the station of each (r,), offsets (m, r, sides, 2), m, in local y and z, and
    the faces between them."""

    station: Index
    across: Array
    faces: Index


def _rings(group: SectionGroup, section: SectionProperties, L: Array, fractions: Array, detail: Detail) -> _Rings:
    S = len(fractions)
    station = np.arange(S)
    A, Iy, Iz = (np.broadcast_to(value, (len(L), S)) for value in section[:3])
    if detail.lines:
        faces = np.stack([station[:-1], station[1:]], axis=-1)
        return _Rings(station, np.zeros((len(L), S, 1, 2)), faces)
    if group.kind[0] == "tube":
        outer = np.sqrt(2 * Iy / A + A / (2 * np.pi))
        inner = np.sqrt(np.maximum(outer**2 - A / np.pi, 0.0))
        both = np.concatenate([outer, inner[:, ::-1]], axis=1)
        across = both[..., None, None] * polygon(detail.sides)
        return _Rings(np.concatenate([station, station[::-1]]), across, loft_faces(2 * S, detail.sides, cyclic=True))
    station = np.concatenate([[0], station, [S - 1]])
    if group.kind[0] in _ROUND:
        half = np.repeat(np.sqrt(A / np.pi)[..., None], 2, axis=-1)
        outline = polygon(detail.sides)
    else:
        half = np.stack([np.sqrt(3 * Iz / A), np.sqrt(3 * Iy / A)], axis=-1)
        ratio = 2 * half.mean(axis=1) / (L[:, None] / (S - 1))
        ny, nz = np.clip(np.median(ratio, axis=0).round(), 1, detail.across).astype(int)
        outline = square(ny, nz)
    across = half[:, station, None, :] * outline
    across[:, [0, -1]] = 0.0
    return _Rings(station, across, loft_faces(S + 2, len(outline)))


def stresses_along(parts: Solids, profiles: StressProfiles) -> Array:
    """Stresses (v,), Pa, at the points of members, the largest from there halfway to the next, and of parts, by
    `profiles` of the first state; NaN where they are not known."""
    values = np.full(len(parts.points), np.nan)
    for grid in parts.grids:
        for profile in profiles.members.get(grid.prototype, ()):
            if set(grid.members) <= set(profile.members):
                stresses = _stresses(grid, profile)
                values[grid.first : grid.first + stresses.size] = stresses.ravel()
    for name, first, count in parts.surfaces:
        if name in profiles.surfaces:
            values[first : first + count] = profiles.surfaces[name][:count, 0]
    return values


def _stresses(grid: Grid, profile: StressProfile) -> Array:
    """Stresses (c, m, p), Pa, at the points of members."""
    stations, number = np.unique(grid.along, return_inverse=True)
    middles = (stations[1:] + stations[:-1]) / 2
    stresses = np.empty((len(grid.copies), len(grid.members), len(stations)))
    for k, m in enumerate(np.searchsorted(profile.members, grid.members)):
        x = profile.fractions[m]
        for c, von_mises in enumerate(profile.von_mises[grid.copies, m, :, 0]):
            stresses[c, k] = np.interp(stations, x, von_mises)
            np.maximum.at(stresses[c, k], np.searchsorted(middles, x), von_mises)
    return stresses[..., number]
