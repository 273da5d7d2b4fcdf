"""Members as solids: their true sections along the length, bent with the shape functions of their elements.

Axes of members between nodes that have moved and turned as far as they like.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.analysis import StressProfile
from flexura.beam import SectionProperties, shape_functions
from flexura.structure import FullOrderModel, Part, PartGeometry, SectionGroup
from flexura.view.scene.meshes import Array, Index, loft_faces, polygon, square
from flexura.view.scene.scene import Collector, Grid, Kind, Look, Motions, Solids


class Stations(NamedTuple):
    """Stations s along members: in which element, and where in it, from 0 to 1 (s,), its length l (m, 1), m, the nodes
    (m, s, 2) at its ends, and where at rest the ends of the element are from these nodes (c, m, s, 2, 3), m."""

    share: Array
    length: Array
    nodes: Index
    arms: Array


def bent_axes(stations: Stations, positions: Array, axes: Array, motions: Motions) -> tuple[Array, Array]:
    """Where stations are (c, m, s, 3), m, and the axes of their sections (c, m, s, 3, 3) as rows, global frame.

    positions: (c, n, 3) of nodes at rest, m; axes: (c, m, 3, 3) of members at rest as rows. Between the ends of an
    element, which move and turn with their nodes, its axis is the cubic that leaves both along their normals, and its
    section turns with the axis, and about it from one end to the other.
    """
    ends = motions.of((slice(None), stations.nodes))
    x = positions[:, stations.nodes] + stations.arms + ends.carried(stations.arms)
    own = axes[:, :, None, None] @ np.swapaxes(np.eye(3) + ends.turn, -1, -2)
    s, length = stations.share[:, None], stations.length[..., None]
    a, b = x[..., 0, :], x[..., 1, :]
    u, v = length * own[..., 0, 0, :], length * own[..., 1, 0, :]
    at = (1 + 2 * s) * (1 - s) ** 2 * a + s * (1 - s) ** 2 * u + s**2 * (3 - 2 * s) * b - s**2 * (1 - s) * v
    along = 6 * s * (1 - s) * (b - a) + (1 - s) * (1 - 3 * s) * u + s * (3 * s - 2) * v
    first = _unit(along)
    across = (1 - s) * own[..., 0, 1, :] + s * own[..., 1, 1, :]
    second = _unit(across - np.einsum("...i,...i->...", across, first)[..., None] * first)
    handed = np.linalg.det(axes).round()[:, :, None, None]
    return at, np.stack([first, second, handed * np.cross(first, second)], axis=-2)


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


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


class Surfaces(NamedTuple):
    """Members of one group in all copies of a part, global frame.

    points, motions: (c, m, p, 3), m, and the motion of each point with the nodes; faces: (f, 4) over the p points, or
    lines (l, 2) when members are drawn as lines; is_flexure: (m,); members: (m,), their numbers; along: (p,), where the
    points are, as a fraction of the length.
    """

    points: Array
    motions: Array
    faces: Index
    is_flexure: NDArray[np.bool_]
    members: Index
    along: Array


class Placing(NamedTuple):
    """Copies of a part: Q (c, 3, 3) and t (c, 3) place it in the global frame; its nodes (c, n) have motions."""

    Q: Array
    t: Array
    motions: Motions

    def nodes(self, geometry: PartGeometry) -> Array:
        """Positions (c, n, 3), m, of the nodes at rest."""
        return geometry.positions @ np.swapaxes(self.Q, -1, -2) + self.t[:, None]

    def end_displacements(self, T: Array, connectivity: Index) -> Array:
        """Displacements (c, e, 12) of the element ends in the elements' axes; rotations are axial vectors."""
        handed = np.linalg.det(self.Q).round()[:, None, None]
        own = np.concatenate([self.motions.shift @ self.Q, handed * (self.motions.rotations @ self.Q)], axis=-1)
        ends = own[:, connectivity].reshape(len(own), len(connectivity), 12)
        return np.einsum("eij,cej->cei", T, ends)


def member_surfaces(
    part: Part,
    values: Array,
    geometry: PartGeometry,
    T: Array,
    placing: Placing,
    detail: Detail,
    chosen: NDArray[np.bool_],
) -> Iterator[Surfaces]:
    """Surfaces of the `chosen` (m,) members of a part, group by group.

    values: (s,) values of the table; geometry and T (e, 12, 12) in the part's frame.
    """
    if not part.members:
        return
    d = placing.end_displacements(T, part.connectivity)
    _, _, nu, _ = part.table.moduli(values)
    is_flexure = np.array([hasattr(member, "profile") for member in part.members.values()])
    start = geometry.positions[part.ends[:, 0]] + geometry.offsets[:, 0]
    for group, n, _ in part.table.groups:
        drawn = chosen[group.index]
        at, L = group.index, geometry.length[group.index]
        fractions = station_fractions(group, detail.segments(group, n))
        section = group.properties(values, nu[at], L, fractions)
        rings = _rings(group, section, L, fractions, detail)
        rings, at, L = rings._replace(across=rings.across[drawn]), at[drawn], L[drawn]
        local = np.zeros((*rings.across.shape[:-1], 3))
        local[..., 1:] = rings.across
        R = geometry.R[at] @ np.swapaxes(placing.Q, -1, -2)[:, None]
        first = start[at] @ np.swapaxes(placing.Q, -1, -2) + placing.t[:, None]
        along = (L[:, None] * fractions)[:, rings.station, None, None]
        points = first[:, :, None, None] + along * R[:, :, None, None, 0] + local @ R[:, :, None]
        if placing.motions.is_finite:
            where, axes = bent_axes(
                _ends(part, at, n, L, fractions, geometry, placing), placing.nodes(geometry), R, placing.motions
            )
            moved = where[:, :, rings.station, None] + local @ axes[:, :, rings.station] - points
        else:
            u, turn = np.split(_stations(part, at, n, L, fractions, d)[:, :, rings.station, None], 2, axis=-1)
            moved = (u + np.cross(turn, local)) @ R[:, :, None]
        flat = (*points.shape[:2], -1, 3)
        share = np.repeat(fractions[rings.station], rings.across.shape[2])
        yield Surfaces(points.reshape(flat), moved.reshape(flat), rings.faces, is_flexure[at], at, share)


def _ends(
    part: Part, at: Index, n: int, L: Array, fractions: Array, geometry: PartGeometry, placing: Placing
) -> Stations:
    """The elements in which stations of members are."""
    k = np.minimum((fractions * n).astype(np.intp), n - 1)
    nodes = part.connectivity[part.first[at][:, None] + k]
    start = geometry.positions[part.ends[at, 0]] + geometry.offsets[at, 0]
    share = (np.stack([k, k + 1], axis=-1) / n)[..., None]
    ends = start[:, None, None] + share * (L[:, None] * geometry.R[at, 0])[:, None, None]
    arms = (ends - geometry.positions[nodes]) @ np.swapaxes(placing.Q, -1, -2)[:, None, None]
    return Stations(fractions * n - k, (L / n)[:, None], nodes, arms)


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


def _stations(part: Part, at: Index, n: int, L: Array, fractions: Array, d: Array) -> Array:
    """Small motions (c, m, s, 6) of stations along the members, member axes.

    Inside an element the motion follows the shape functions without shear, whatever its section (eq. 12 of the RPR
    paper): it is exact at the nodes.
    """
    k = np.minimum((fractions * n).astype(np.intp), n - 1)
    one = np.ones(())
    section = SectionProperties(one, one, one, one, one, one)
    length = (L / n)[:, None]
    x = (fractions * n - k) * length
    N = shape_functions(x, 1.0, 1.0, section, np.broadcast_to(length, x.shape), 0.0)
    ends = d[:, part.first[at][:, None] + k]
    return np.einsum("msij,cmsj->cmsi", N, ends)


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


def add_members(
    collector: Collector, model: FullOrderModel, motions: Motions, flagged: Collection[str], look: Look
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
            if flagged:
                labels = [f"{name}.{keys[k]}" for k in surface.members] * len(prefixes)
                is_flagged = [{*pair} & set(flagged) != set() for pair in zip(names, labels, strict=True)]
                kinds[np.reshape(is_flagged, kinds.shape)] = Kind.FLAGGED
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
