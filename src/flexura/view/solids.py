"""The solids of a mechanism, as points that move with its nodes: geometry only, no drawing."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis import StressProfile
from flexura.errors import OptionError
from flexura.motion import Frames, pose_of
from flexura.solid.mesh import SurfaceShape
from flexura.structure import FullOrderModel
from flexura.view.discrete_elements import add_discrete_elements
from flexura.view.marks import add_marks
from flexura.view.members import LEVELS, Detail, Placing, Surfaces, member_surfaces
from flexura.view.meshes import Array, Mesh
from flexura.view.motions import Motions
from flexura.view.scene import Collector, Kind, Solids

SMALL = 1e-5
"""Displacements over the size of a mechanism that are small."""

FACE_BUDGET = 20_000
"""Members are drawn in less detail, in the end as lines, to stay below this many faces."""


def solids(
    model: FullOrderModel, displacements: ArrayLike | None = None, doubted: Collection[str] = frozenset()
) -> Solids:
    """The solids of a mechanism, moving with its nodes.

    displacements: (n_nodes, 6), m and rad, global frame, as `FullOrderModel.node_displacements` gives them for one
    vector; none for a mechanism that stands still, at rest or at the pose that is described. doubted: names of members
    and bodies in doubt, such as `leaf1.blade`, or `leaf.blade` for all copies. Motions are linear in the displacements.
    Members carry their real sections; the number of faces stays near FACE_BUDGET, and members of very large mechanisms
    become lines. Raises OptionError when the displacements are not finite or have another shape, or when the model
    holds a stack of designs.
    """
    u = node_motions(model, displacements)
    turned = float(np.sqrt((u[:, 3:] ** 2).sum(axis=1).max(initial=0.0)))
    if (posed := pose_of(model)) is not None:
        return replace(_moving_on(model, posed.pose.state.frames, u), rotation=turned)
    return _collected(model, Motions.small(u), doubted).solids(turned)


def moved_solids(model: FullOrderModel, frames: Frames, profiles: Mapping[str, Sequence[StressProfile]]) -> Solids:
    """The solids of a mechanism whose nodes have moved and turned as far as their frames have.

    `motions` lead from rest to there; `values` are stresses, Pa, by `profiles` of all prototypes, of the first state.
    Raises OptionError when the model holds a stack of designs.
    """
    node_motions(model, None)
    return _collected(model, Motions.finite(model, frames), frozenset(), profiles).solids(0.0)


def _moving_on(model: FullOrderModel, frames: Frames, u: Array) -> Solids:
    """The solids where frames have moved, with small motions from there: the derivative by displacements u (n, 6)."""
    here = moved_solids(model, frames, {})
    points = here.points + here.motions
    largest = float(np.abs(u * [1, 1, 1, *[here.size()] * 3]).max(initial=0.0))
    motions = np.zeros(points.shape)
    if largest:
        step = SMALL * here.size() / largest
        moved = np.concatenate([u, np.zeros((1, 6))])
        ahead, behind = (moved_solids(model, frames.moved(sign * step * moved), {}) for sign in (1, -1))
        motions = (ahead.motions - behind.motions) / (2 * step)
    return replace(here, points=points, motions=motions)


def _collected(
    model: FullOrderModel,
    motions: Motions,
    doubted: Collection[str],
    profiles: Mapping[str, Sequence[StressProfile]] | None = None,
) -> Collector:
    collector = Collector()
    _add_members(collector, model, motions, doubted, profiles or {})
    collector.include(model.geometry.positions)
    add_discrete_elements(collector, model, motions, doubted)
    add_marks(collector, model, motions)
    return collector


def meshed_solids(
    model: FullOrderModel, displacements: ArrayLike, surfaces: Sequence[SurfaceShape], mode: int
) -> Solids:
    """The same with the surfaces of solid meshes in place of the members, moving in their mode of position `mode`."""
    u = node_motions(model, displacements)
    collector = Collector()
    for surface in surfaces:
        collector.mesh(Mesh(surface.points, surface.facets), surface.displacement[:, :, mode], Kind.FLEXURE)
    collector.include(model.geometry.positions)
    motions = Motions.small(u)
    add_discrete_elements(collector, model, motions)
    add_marks(collector, model, motions)
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


def _detail(model: FullOrderModel) -> Detail:
    """The finest level of detail that keeps to the budget of faces."""
    plan = model.plan
    for level in LEVELS[:-1]:
        total = sum(
            len(plan.topology.copies[name].paths) * len(group.index) * level.faces(group, elements)
            for name, part in plan.parts.items()
            for group, elements, _ in part.table.groups
        )
        if total <= FACE_BUDGET:
            return level
    return LEVELS[-1]


def _add_members(
    collector: Collector,
    model: FullOrderModel,
    motions: Motions,
    doubted: Collection[str],
    profiles: Mapping[str, Sequence[StressProfile]],
) -> None:
    geometry, detail = model.geometry, _detail(model)
    for name, part in model.plan.parts.items():
        placed = model.plan.topology.copies[name]
        nodes = np.array(placed.offset)[:, None] + np.arange(part.n_nodes)
        placing = Placing(geometry.Q[placed.number], geometry.t[placed.number], motions.of(nodes))
        mirrored = np.linalg.det(placing.Q) < 0
        own, T, keys = geometry.parts[name], geometry.T[name], list(part.members)
        for surface in member_surfaces(part, model.values, own, T, placing, detail):
            kinds = np.where(surface.is_flexure, Kind.FLEXURE, Kind.LINK).astype(np.intp)
            kinds = np.tile(kinds, (len(placed.paths), 1))
            if doubted:
                own_names = [(keys[k], f"{name}.{keys[k]}") for k in surface.members]
                for c, path in enumerate(placed.paths):
                    kinds[c, [{".".join((*path, key)), label} & set(doubted) != set() for key, label in own_names]] = (
                        Kind.DOUBTED
                    )
            stress = _stresses(surface, profiles.get(name, ()))
            collector.grid(surface.points, surface.motions, surface.faces, kinds, mirrored, stress)


def _stresses(surface: Surfaces, profiles: Sequence[StressProfile]) -> Array | None:
    """Stresses (c, m, p), Pa, at the points of members, the largest from there halfway to the next; None where they are
    not known."""
    for profile in profiles:
        if np.array_equal(profile.members, surface.members):
            stations, number = np.unique(surface.along, return_inverse=True)
            middles = (stations[1:] + stations[:-1]) / 2
            found = np.empty((*profile.von_mises.shape[:2], len(stations)))
            for m, x in enumerate(profile.fractions):
                for c, own in enumerate(profile.von_mises[:, m, :, 0]):
                    found[c, m] = np.interp(stations, x, own)
                    np.maximum.at(found[c, m], np.searchsorted(middles, x), own)
            return found[..., number]
    return None
