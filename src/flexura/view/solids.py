"""The solids of a mechanism, as points that move with its nodes: geometry only, no drawing."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.analysis import StressProfile
from flexura.errors import OptionError
from flexura.motion import Frames, pose_of
from flexura.solid.mesh import SurfaceShape
from flexura.structure import FullOrderModel
from flexura.view.channels import add_channels
from flexura.view.discrete_elements import add_discrete_elements
from flexura.view.marks import add_marks
from flexura.view.members import LEVELS, Detail, Placing, member_surfaces
from flexura.view.meshes import Array, Index, Mesh
from flexura.view.motions import Motions
from flexura.view.scene import Collector, Grid, Kind, Look, Solids

SMALL = 1e-5
"""Displacements over the size of a mechanism that are small."""

PICTURE = Look()


def solids(
    model: FullOrderModel,
    displacements: ArrayLike | None = None,
    doubted: Collection[str] = frozenset(),
    look: Look = PICTURE,
) -> Solids:
    """The solids of a mechanism, moving with its nodes.

    displacements: (n_nodes, 6), m and rad, global frame, as `FullOrderModel.node_displacements` gives them for one
    vector; none for a mechanism that stands still, at rest or at the pose that is described. doubted: names of members
    and bodies in doubt, such as `leaf1.blade`, or `leaf.blade` for all copies. Motions are linear in the displacements.
    Members carry their real sections; the number of faces stays near that of `look`, and members of very large
    mechanisms become lines. Raises OptionError when the displacements are not finite or have another shape, or when the
    model holds a stack of designs.
    """
    u = node_motions(model, displacements)
    turned = float(np.sqrt((u[:, 3:] ** 2).sum(axis=1).max(initial=0.0)))
    if (posed := pose_of(model)) is not None:
        return replace(_moving_on(model, posed.pose.state.frames, u, doubted, look), rotation=turned)
    return _collected(model, Motions.small(u), doubted, look).solids(turned)


def moved_solids(
    model: FullOrderModel,
    frames: Frames,
    profiles: Mapping[str, Sequence[StressProfile]],
    doubted: Collection[str] = frozenset(),
    look: Look = PICTURE,
) -> Solids:
    """The solids of a mechanism whose nodes have moved and turned as far as their frames have.

    `motions` lead from rest to there; `values` are stresses, Pa, by `profiles` of all prototypes, of the first state.
    Raises OptionError when the model holds a stack of designs.
    """
    node_motions(model, None)
    parts = _collected(model, Motions.finite(model, frames), doubted, look).solids(0.0)
    return replace(parts, values=stresses_along(parts, profiles))


def _moving_on(model: FullOrderModel, frames: Frames, u: Array, doubted: Collection[str], look: Look) -> Solids:
    """The solids where frames have moved, with small motions from there: the derivative by displacements u (n, 6)."""
    here = moved_solids(model, frames, {}, doubted, look)
    points = here.points + here.motions
    largest = float(np.abs(u * [1, 1, 1, *[here.size()] * 3]).max(initial=0.0))
    motions = np.zeros(points.shape)
    if largest:
        step = SMALL * here.size() / largest
        moved = np.concatenate([u, np.zeros((1, 6))])
        ahead, behind = (moved_solids(model, frames.moved(sign * step * moved), {}, doubted, look) for sign in (1, -1))
        motions = (ahead.motions - behind.motions) / (2 * step)
    return replace(here, points=points, motions=motions)


def _collected(model: FullOrderModel, motions: Motions, doubted: Collection[str], look: Look) -> Collector:
    collector = Collector()
    _add_members(collector, model, motions, doubted, look)
    collector.include(model.geometry.positions)
    add_discrete_elements(collector, model, motions, doubted, look)
    add_marks(collector, model, motions, look)
    if look.channels:
        add_channels(collector, model, motions, look)
    return collector


def meshed_solids(
    model: FullOrderModel, displacements: ArrayLike, surfaces: Sequence[SurfaceShape], mode: int
) -> Solids:
    """The same with the surfaces of solid meshes in place of the members, moving in their mode of position `mode`."""
    u = node_motions(model, displacements)
    collector = Collector()
    for surface in surfaces:
        collector.mesh(
            Mesh(surface.points, surface.facets), surface.displacement[:, :, mode], Kind.FLEXURE, surface.name
        )
    collector.include(model.geometry.positions)
    motions = Motions.small(u)
    add_discrete_elements(collector, model, motions, frozenset(), PICTURE)
    add_marks(collector, model, motions, PICTURE)
    return collector.solids(float(np.sqrt((u[:, 3:] ** 2).sum(axis=1).max(initial=0.0))))


def node_motions(model: FullOrderModel, displacements: ArrayLike | None) -> Array:
    """Displacements (n_nodes, 6) of all nodes; zero when none are given. Raises OptionError as `solids` does."""
    n = model.plan.topology.n_nodes
    if model.geometry.positions.ndim != 2 or model.values.ndim != 1:
        raise OptionError("a picture shows one design; this model holds a stack of them")
    if displacements is None:
        return np.zeros((n, 6))
    u = np.asarray(displacements, dtype=float)
    if u.shape != (n, 6):
        raise OptionError(f"displacements have shape ({n}, 6), one row for each node; found {u.shape}")
    if not np.isfinite(u).all():
        raise OptionError("displacements must be finite")
    return np.where(model.plan.topology.has_position[:, None], u, 0.0)


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


def _add_members(
    collector: Collector, model: FullOrderModel, motions: Motions, doubted: Collection[str], look: Look
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
            if doubted:
                labels = [f"{name}.{keys[k]}" for k in surface.members] * len(prefixes)
                in_doubt = [{*pair} & set(doubted) != set() for pair in zip(names, labels, strict=True)]
                kinds[np.reshape(in_doubt, kinds.shape)] = Kind.DOUBTED
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
