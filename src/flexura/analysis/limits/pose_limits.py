"""Where poses are doubtful: meshes that are too coarse, solids that meet, which theory lets go through each other, and
the limits of a pose that is described."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from flexura.analysis.limits.limits import LIMIT_ROUND_OFF, command_limits, times
from flexura.analysis.strain import yield_ratios
from flexura.arrays import Array, Index
from flexura.convex import overlapping_bounds, separations
from flexura.errors import Diagnostic
from flexura.linalg import leading
from flexura.motion import Frames, Pose, PosedDesign, beyond, pose_of, stiffness_errors
from flexura.structure import FullOrderModel, Ports, solids_of
from flexura.thresholds import SAME_PLACE

CONTRIBUTING_SHARE = 0.2
"""Share of the most that any member has in an error, from which on this is also that of the member."""

COARSE_MESH = 0.01
"""Estimated relative error of stiffness from which on elements are too few."""

LEAST_MESH_ERROR = 1e-4
"""Errors of stiffness below this are left out."""

LOWEST_MODES = 6
"""Modes at a described pose whose stiffness is looked at for want of elements."""

JOINED_GAP = 0.5
"""The same of two parts that are joined: where they meet they may be close."""

LARGEST_BULGE = 0.1
"""How far a member may bulge out between the ends of an element, over its length."""

MOST_PAIRS, MOST_PIECES = 2_000_000, 200_000
"""Pairs of parts at a pose, and of convex pieces at all poses, that are looked at."""


def mesh_errors(pose: Pose, motions: Array, energies: Array) -> dict[str, float]:
    """By member, the largest relative error of the stiffness that free displacements (n, k) from a pose meet in all
    members together, of those errors of which it has a good share; `energies` (k,), N m, are twice those of the
    displacements."""
    stable = energies > 0
    errors = stiffness_errors(pose.equations.model, pose.state.frames, motions[:, stable], energies[stable])
    if not errors or not stable.any():
        return {}
    each = np.stack(list(errors.values()))
    total = np.where(each >= CONTRIBUTING_SHARE * each.max(axis=0), each.sum(axis=0), 0.0).max(axis=1)
    return {name: float(error) for name, error in zip(errors, total, strict=True) if error > LEAST_MESH_ERROR}


def coarse_mesh(model: FullOrderModel, name: str, error: float, where: str) -> Diagnostic | None:
    """The warning of an error of stiffnesses that is owed to a member with few elements, or to a superelement that
    bends; None where it is small."""
    if not error > COARSE_MESH:
        return None
    copies = model.plan.topology.copies.values()
    inside = {".".join((*path, key)) for copy in copies for path in copy.paths for key in copy.part.superelements}
    off = f"{where} support stiffnesses or squares of frequencies are too large by some {100 * error:.2g} %"
    if name in inside and error >= 1:
        text = (
            f"superelement {name}: {where} a beam of its stiffness would have lost its stability: it is linear inside"
        )
    elif name in inside:
        text = f"superelement {name}: {off}, as far as it is a beam: it is linear inside, and bending softens beams"
    else:
        text = f"member {name}: {off}, the error of its mesh: refine it"
    return Diagnostic("mesh", name, error, COARSE_MESH, "1", text)


class Meeting(NamedTuple):
    """Two parts that meet, and in which of the poses."""

    first: str
    second: str
    poses: list[int]


class _Pieces(NamedTuple):
    """Convex pieces of an undeformed part: corners (p, 8, 3), m, the nodes (p, 2) that they follow, and how far from
    the first to the second (p, 8)."""

    corners: Array
    nodes: Index
    share: Array


def solids_that_meet(model: FullOrderModel, poses: Sequence[Frames]) -> tuple[list[Meeting], bool]:
    """Pairs of members and bodies that are apart when undeformed and share space in poses, and whether all were looked
    at.

    Members are cut into convex pieces that follow the nodes of their elements.
    """
    parts = _Parts(model)
    if len(parts.names) < 2:
        return [], True
    meetings: dict[tuple[int, int], Meeting] = {}
    apart: dict[tuple[int, int], bool] = {}
    looked = 0
    for k, frames in enumerate(poses):
        pairs = overlapping_bounds(*parts.bounds(frames), MOST_PAIRS)
        if pairs is None:
            return list(meetings.values()), False
        for i, j in pairs.tolist():
            if (i, j) not in apart:
                apart[i, j] = parts.gap(None, i, j)[0] > parts.least_gap(i, j)
            if not apart[i, j]:
                continue
            gap, count = parts.gap(frames, i, j)
            looked += count
            if looked > MOST_PIECES:
                return list(meetings.values()), False
            if gap < 0:
                meetings.setdefault((i, j), Meeting(parts.names[i], parts.names[j], [])).poses.append(k)
    return list(meetings.values()), True


class _Parts:
    """Members, then bodies, wherever the nodes have moved."""

    def __init__(self, model: FullOrderModel) -> None:
        bars, bodies = solids_of(model)
        self.names = [*bars.names, *bodies.names]
        self._bars, self._bodies = bars, bodies
        self._root = model.plan.topology.root
        self._rest = model.geometry.positions[self._root]
        self._chains = list(_chains(model))
        self._size = np.concatenate([2 * bars.half.min(axis=1), 2 * bodies.half.min(axis=1)])
        self._clusters = [set(roots) for roots in bars.clusters.tolist()] + [
            {root} for root in bodies.clusters.tolist()
        ]
        self._cut: dict[int, _Pieces] = {}

    def least_gap(self, i: int, j: int) -> float:
        """The undeformed gap, m, beyond which two parts are apart."""
        joined = bool(self._clusters[i] & self._clusters[j])
        return (JOINED_GAP if joined else SAME_PLACE) * float(min(self._size[i], self._size[j]))

    def bounds(self, frames: Frames) -> tuple[Array, Array]:
        """Bounds (n, 3) of all parts."""
        points, nodes, radius, first = self._outline
        x = self._moved(frames, points, nodes)
        low = np.minimum.reduceat(x - radius[:, None], first)
        return low, np.maximum.reduceat(x + radius[:, None], first)

    @cached_property
    def _outline(self) -> tuple[Array, Index, Array, Index]:
        """Points (q, 3), m, around all undeformed parts, the nodes (q,) they follow, radii (q,) about them, and the
        first of every part."""
        bars, bodies = self._bars, self._bodies
        points, nodes, radii = [], [], []
        for k, chain in enumerate(self._chains):
            share = np.linspace(0.0, 1.0, len(chain) + 1)[:, None]
            points.append(bars.origin[k] + share * bars.length[k] * bars.axes[k, 0])
            nodes.append(np.append(chain[:, 0], chain[-1, 1]))
            radius = np.linalg.norm(bars.half[k]) + LARGEST_BULGE * bars.length[k] / len(chain)
            radii.append(np.full(len(share), radius))
        corners = bodies.boxes(np.arange(len(bodies.names)))
        points += list(corners)
        nodes += [np.full(8, node) for node in bodies.nodes]
        radii += [np.zeros(8)] * len(corners)
        first = np.cumsum([0, *(len(part) for part in points[:-1])])
        return np.concatenate(points), np.concatenate(nodes), np.concatenate(radii), first

    def _moved(self, frames: Frames, points: Array, nodes: Index) -> Array:
        """Points (..., 3) that follow nodes (...)."""
        turned = frames.R[self._root[nodes]] @ (points - self._rest[nodes])[..., None]
        return frames.x[self._root[nodes]] + turned[..., 0]

    def gap(self, frames: Frames | None, i: int, j: int) -> tuple[float, int]:
        """How far apart two parts are, m, negative where they overlap, undeformed where there are no frames, and how
        many pairs of pieces were looked at. Pieces whose bounds do not meet are not."""
        first, second = (self._placed(frames, part) for part in (i, j))
        margin = 0.0 if frames is not None else self.least_gap(i, j)
        (low_a, high_a), (low_b, high_b) = ((x.min(axis=1), x.max(axis=1)) for x in (first, second))
        meets = (low_a[:, None] <= high_b + margin) & (low_b <= high_a[:, None] + margin)
        a, b = np.nonzero(meets.all(axis=-1))
        return float(separations(first[a], second[b]).min(initial=np.inf)), len(a)

    def _placed(self, frames: Frames | None, part: int) -> Array:
        """Corners (p, 8, 3) of the pieces of a part."""
        if part not in self._cut:
            self._cut[part] = self._pieces(part)
        corners, nodes, share = self._cut[part]
        if frames is None:
            return corners
        first, second = (self._moved(frames, corners, np.repeat(nodes[:, [end]], 8, axis=1)) for end in (0, 1))
        return first + share[..., None] * (second - first)

    def _pieces(self, part: int) -> _Pieces:
        count, bars = len(self._chains), self._bars
        if part >= count:
            corners = self._bodies.pieces(part - count)
            nodes = np.full((len(corners), 2), self._bodies.nodes[part - count])
            return _Pieces(corners, nodes, np.zeros(corners.shape[:2]))
        chain = self._chains[part]
        n = len(chain)
        cut = [bars.pieces(part, k / n, (k + 1) / n) for k in range(n)]
        counts = [len(pieces) for pieces in cut]
        corners, nodes = np.concatenate(cut), np.repeat(chain, counts, axis=0)
        along = (corners - bars.origin[part]) @ bars.axes[part, 0] / bars.length[part] * n
        return _Pieces(corners, nodes, along - np.repeat(np.arange(n), counts)[:, None])


def _chains(model: FullOrderModel) -> Iterator[Index]:
    """Nodes (n, 2) at the ends of the elements of every member of `Bars`."""
    for name, part in model.plan.parts.items():
        if not part.members:
            continue
        for group, n, _ in part.table.groups:
            if group.has_stress:
                for offset in model.plan.topology.copies[name].offset:
                    for k in group.index:
                        yield offset + part.connectivity[part.first[k] : part.first[k] + n]


def pose_limits(model: FullOrderModel) -> tuple[Diagnostic, ...]:
    """Where the pose that a mechanism is described at is doubtful, for every result about it: members that bend too
    far for their elements or have too few of them, superelements that turn within themselves, edges that twist
    stretches, nodes of which one rotation is held, solids that meet, members beyond yield. Nothing without a pose."""
    posed = pose_of(model)
    if posed is None:
        return ()
    return model.prepared.once("pose limits", lambda: tuple(_pose_limits(model, posed)))


def _pose_limits(model: FullOrderModel, posed: PosedDesign) -> Iterator[Diagnostic]:
    commands, frames = model.plan.pose.commands(model.values), [posed.pose.state.frames]
    yield from command_limits(Ports(model.design).commands(list(commands)), np.array([*commands.values()])[:, None])
    yield from beyond(posed.model, frames)
    for meeting in solids_that_meet(model, frames)[0]:
        text = f"{meeting.first} and {meeting.second} meet at the pose, and go through each other"
        yield Diagnostic("contact", meeting.first, np.nan, np.nan, "m", text)
    modes = posed.pose.modes(min(LOWEST_MODES, model.order))
    for name, error in mesh_errors(posed.pose, modes.vectors, modes.values).items():
        if (warning := coarse_mesh(model, name, error, "at the pose")) is not None:
            yield warning
    yields = yield_ratios(model, np.zeros((model.order, 1)))
    if yields.names and float(yields.ratio.max()) > 1 + LIMIT_ROUND_OFF:
        worst = int(leading(yields.ratio[:, 0]))
        name, ratio = yields.names[worst], float(yields.ratio[worst, 0])
        text = f"{name} is stressed beyond its yield stress at the pose, {times(ratio)} times"
        yield Diagnostic("stress", name, ratio, 1.0, "1", text)
