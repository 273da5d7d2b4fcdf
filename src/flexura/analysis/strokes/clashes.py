"""Solids that are apart at rest and meet in a pose of a stroke: what theory lets go through each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.convex import overlapping_bounds, separations
from flexura.motion import Frames
from flexura.structure import Bars, Bodies, FullOrderModel, solids_of

FLUSH = 1e-6
"""Gap at rest over the smaller part's least size up to which two parts touch there."""

JOINED = 0.5
"""The same of two parts that are joined: where they meet they may be close."""

BULGE = 0.1
"""How far a member may bulge out between the ends of an element, over its length."""

MOST_PAIRS, MOST_PIECES = 2_000_000, 200_000
"""Pairs of parts at a pose, and of convex pieces at all poses, that are looked at."""


class Meeting(NamedTuple):
    """Two parts that meet, and in which of the poses."""

    first: str
    second: str
    poses: list[int]


class _Pieces(NamedTuple):
    """Convex pieces of a part at rest: corners (p, 8, 3), m, the nodes (p, 2) that they follow, and how far from the
    first to the second (p, 8)."""

    corners: Array
    nodes: Index
    share: Array


def solids_that_meet(model: FullOrderModel, poses: Sequence[Frames]) -> tuple[list[Meeting], bool]:
    """Pairs of members and bodies that are apart at rest and share space in poses, and whether all were looked at.

    Members are cut into convex pieces that follow the nodes of their elements.
    """
    parts = _Parts(model, *solids_of(model))
    if len(parts.names) < 2:
        return [], True
    found: dict[tuple[int, int], list[int]] = {}
    apart: dict[tuple[int, int], bool] = {}
    looked = 0
    for k, frames in enumerate(poses):
        pairs = overlapping_bounds(*parts.bounds(frames), MOST_PAIRS)
        if pairs is None:
            return _named(parts, found), False
        for i, j in pairs.tolist():
            if (i, j) not in apart:
                apart[i, j] = parts.gap(None, i, j)[0] > parts.least_gap(i, j)
            if not apart[i, j]:
                continue
            gap, count = parts.gap(frames, i, j)
            looked += count
            if looked > MOST_PIECES:
                return _named(parts, found), False
            if gap < 0:
                found.setdefault((i, j), []).append(k)
    return _named(parts, found), True


def _named(parts: _Parts, found: dict[tuple[int, int], list[int]]) -> list[Meeting]:
    return [Meeting(parts.names[i], parts.names[j], poses) for (i, j), poses in found.items()]


class _Parts:
    """Members, then bodies, wherever the nodes have moved."""

    def __init__(self, model: FullOrderModel, bars: Bars, bodies: Bodies) -> None:
        self.names = [*bars.names, *bodies.names]
        self._bars, self._bodies = bars, bodies
        self._root = model.plan.topology.root
        self._rest = model.geometry.positions[self._root]
        self._chains = list(_chains(model))
        self._size = np.concatenate([2 * bars.half.min(axis=1), 2 * bodies.half.min(axis=1)])
        self._clusters = [set(own.tolist()) for own in bars.clusters] + [{own} for own in bodies.clusters.tolist()]
        self._cut: dict[int, _Pieces] = {}

    def least_gap(self, i: int, j: int) -> float:
        """The gap at rest, m, beyond which two parts are apart."""
        joined = bool(self._clusters[i] & self._clusters[j])
        return (JOINED if joined else FLUSH) * float(min(self._size[i], self._size[j]))

    def bounds(self, frames: Frames) -> tuple[Array, Array]:
        """Bounds (n, 3) of all parts."""
        points, nodes, radius, first = self._outline
        x = self._moved(frames, points, nodes)
        low = np.minimum.reduceat(x - radius[:, None], first)
        return low, np.maximum.reduceat(x + radius[:, None], first)

    @cached_property
    def _outline(self) -> tuple[Array, Index, Array, Index]:
        """Points (q, 3), m, around all parts at rest, the nodes (q,) they follow, radii (q,) about them, and the first
        of every part."""
        bars, bodies = self._bars, self._bodies
        points, nodes, radii = [], [], []
        for k, chain in enumerate(self._chains):
            share = np.linspace(0.0, 1.0, len(chain) + 1)[:, None]
            points.append(bars.origin[k] + share * bars.length[k] * bars.axes[k, 0])
            nodes.append(np.append(chain[:, 0], chain[-1, 1]))
            reach = np.linalg.norm(bars.half[k]) + BULGE * bars.length[k] / len(chain)
            radii.append(np.full(len(share), reach))
        corners = bodies.boxes(np.arange(len(bodies.names)))
        points += list(corners)
        nodes += [np.full(8, node) for node in bodies.nodes]
        radii += [np.zeros(8)] * len(corners)
        first = np.cumsum([0, *(len(own) for own in points[:-1])])
        return np.concatenate(points), np.concatenate(nodes), np.concatenate(radii), first

    def _moved(self, frames: Frames, points: Array, nodes: Index) -> Array:
        """Points (..., 3) that follow nodes (...)."""
        turned = frames.R[self._root[nodes]] @ (points - self._rest[nodes])[..., None]
        return frames.x[self._root[nodes]] + turned[..., 0]

    def gap(self, frames: Frames | None, i: int, j: int) -> tuple[float, int]:
        """How far apart two parts are, m, negative where they overlap, at rest where there are no frames, and how many
        pairs of pieces were looked at. Pieces whose bounds do not meet are not."""
        first, second = (self._placed(frames, part) for part in (i, j))
        margin = 0.0 if frames is not None else self.least_gap(i, j)
        (low_a, high_a), (low_b, high_b) = ((own.min(axis=1), own.max(axis=1)) for own in (first, second))
        meets = (low_a[:, None] <= high_b + margin) & (low_b <= high_a[:, None] + margin)
        a, b = np.nonzero(meets.all(axis=-1))
        return float(separations(first[a], second[b]).min(initial=np.inf)), len(a)

    def _placed(self, frames: Frames | None, part: int) -> Array:
        """Corners (p, 8, 3) of the pieces of a part."""
        if part not in self._cut:
            self._cut[part] = self._pieces(part)
        own = self._cut[part]
        if frames is None:
            return own.corners
        ends = [self._moved(frames, own.corners, np.repeat(own.nodes[:, [end]], 8, axis=1)) for end in (0, 1)]
        return ends[0] + own.share[..., None] * (ends[1] - ends[0])

    def _pieces(self, part: int) -> _Pieces:
        count, bars = len(self._chains), self._bars
        if part >= count:
            corners = self._bodies.pieces(part - count)
            nodes = np.full((len(corners), 2), self._bodies.nodes[part - count])
            return _Pieces(corners, nodes, np.zeros(corners.shape[:2]))
        chain = self._chains[part]
        n = len(chain)
        own = [bars.pieces(part, k / n, (k + 1) / n) for k in range(n)]
        corners, nodes = np.concatenate(own), np.repeat(chain, [len(pieces) for pieces in own], axis=0)
        along = (corners - bars.origin[part]) @ bars.axes[part, 0] / bars.length[part] * n
        return _Pieces(corners, nodes, along - np.repeat(np.arange(n), [len(pieces) for pieces in own])[:, None])


def _chains(model: FullOrderModel) -> Iterator[Index]:
    """Nodes (n, 2) at the ends of the elements of every member of `Bars`."""
    for name, part in model.plan.parts.items():
        if not part.members:
            continue
        for group, n, _ in part.table.groups:
            if group.family != "constants":
                for offset in model.plan.topology.copies[name].offset:
                    for k in group.index:
                        yield offset + part.connectivity[part.first[k] : part.first[k] + n]
