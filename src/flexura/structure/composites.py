"""Solids that are made up of boxes, cylinders and prisms, less others: where they are, and where lines leave them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Bools, Index
from flexura.beam import FiniteSolid, Patches, member_frame
from flexura.mechanism import BoxPiece, Composite, CylinderPiece, PlatePiece, PrismPiece, rotation_matrix
from flexura.structure.prisms import beyond_prism, crossed, is_within, nearest_in_prism

ON = 1e-9
"""How far beside a line a place is looked at, over the size of the solid."""

ROOT_DEPTH = 0.5
"""How far the root reaches along its block, over the depth of this: what is further off bends as the block does."""

STEPS = 64
"""Places on the way at which the depth is looked at."""

SQUARE = 0.999
"""Cosine from which a member is along an axis of the body."""

PARALLEL = 1e-12
"""Cosine below which a line is along a face."""


@dataclass(frozen=True)
class Pieces:
    """Boxes, cylinders about their first axis, and prisms, the first `added` of which make up a solid that others are
    cut from.

    centre (k, 3), m; axes (k, 3, 3) as rows; half (k, 3), half sizes, m, of prisms those of the box around them;
    is_round (k,). `outlines` are the corners (n, 2) of prisms along their first two axes by the number of the piece.
    """

    centre: Array
    axes: Array
    half: Array
    is_round: Bools
    added: int
    outlines: dict[int, Array] = field(default_factory=dict)

    @staticmethod
    def of(solid: Composite) -> Pieces:
        """Of a composite whose numbers are resolved."""
        placed = [_placed(piece) for piece in (*solid.add, *solid.cut)]
        centre, axes, half, is_round = (np.array(column) for column in zip(*placed, strict=True))
        prisms = {k: p for k, p in enumerate((*solid.add, *solid.cut)) if isinstance(p, PrismPiece)}
        outlines = {k: _outline(piece)[0] for k, piece in prisms.items()}
        return Pieces(centre, axes, half, is_round, len(solid.add), outlines)

    def moved(self, Q: Array, t: Array) -> Pieces:
        """Turned, or mirrored, by Q (3, 3) and moved by t (3,), m; axes stay right-handed: pieces are their own mirror
        images across their third one."""
        axes = self.axes @ Q.T
        axes[:, 2] *= np.linalg.det(Q).round()
        return Pieces(self.centre @ Q.T + t, axes, self.half, self.is_round, self.added, self.outlines)

    @property
    def box(self) -> Array:
        """Lower and upper corner (2, 3) of the box around what is added."""
        added = slice(self.added)
        reach = np.abs(self.axes[added]) * self.half[added, :, None]
        across = np.hypot(reach[:, 1], reach[:, 2])  # an axis in the plane of a disc reaches as far as its radius
        reach = np.where(self.is_round[added, None], reach[:, 0] + across, reach.sum(axis=1))
        return np.stack([(self.centre[added] - reach).min(axis=0), (self.centre[added] + reach).max(axis=0)])

    def local(self, points: Array) -> Array:
        """Places (..., k, 3) of points (..., 3) in the axes of each piece."""
        return np.einsum("kij,...kj->...ki", self.axes, points[..., None, :] - self.centre)

    def beyond(self, points: Array) -> Array:
        """How far (...) points (..., 3) are outside, m; negative inside; not less than they are near edges."""
        at = self.local(points)
        away = np.abs(at) - self.half
        radial = np.linalg.norm(at[..., 1:], axis=-1) - self.half[:, 1]
        away = np.where(self.is_round, np.maximum(away[..., 0], radial), away.max(axis=-1))
        for k, outline in self.outlines.items():
            away[..., k] = beyond_prism(outline, self.half[k, 2], at[..., k, :])
        added, cut = away[..., : self.added].min(axis=-1), away[..., self.added :].min(axis=-1, initial=np.inf)
        return np.maximum(added, -cut)

    def nearest(self, points: Array) -> Array:
        """The nearest places (p, 3) of what is added to points (p, 3), as if nothing was cut."""
        at = self.local(points)[:, : self.added]
        half, added = self.half[: self.added], slice(self.added)
        radius = np.maximum(np.linalg.norm(at[..., 1:], axis=-1, keepdims=True), half[:, 1:2])
        box = np.clip(at, -half, half)
        disc = np.concatenate([box[..., :1], at[..., 1:] * half[:, 1:2] / radius], axis=-1)
        near = np.where(self.is_round[added, None], disc, box)
        for k, outline in self.outlines.items():
            if k < self.added:
                near[:, k] = nearest_in_prism(outline, self.half[k, 2], at[:, k])
        first = np.linalg.norm(near - at, axis=-1).argmin(axis=1)
        chosen = (near - at)[np.arange(len(points)), first]
        return points + np.einsum("pi,pij->pj", chosen, self.axes[first])

    def exits(self, points: Array, towards: Array) -> Array:
        """How far it is (p,), m, from points (p, 3) along unit vectors (p, 3) to where the solid ends; 0 outside."""
        enter, leave = self._crossed(points, towards)
        step = ON * float(np.ptp(self.box, axis=0).max())

        def is_in(at: Array) -> Bools:
            inside = (enter[:, None] < at) & (at < leave[:, None])
            for k, outline in self.outlines.items():
                local = (points + at[..., None] * towards - self.centre[k]) @ self.axes[k].T
                inside[k] = is_within(outline, local[..., :2]) & (np.abs(local[..., 2]) < self.half[k, 2])
            return np.asarray(inside[: self.added].any(axis=0) & ~inside[self.added :].any(axis=0), dtype=bool)

        faces = [
            crossed(outline, self.half[k, 2], (points - self.centre[k]) @ self.axes[k].T, towards @ self.axes[k].T)
            for k, outline in self.outlines.items()
        ]
        ends = np.concatenate([leave[: self.added], enter[self.added :], *faces, np.zeros((1, len(points)))])
        ends = np.where(ends >= 0, ends, np.inf)
        after = np.where(np.isfinite(ends), ends + step, 0.0)
        return np.where(is_in(after), np.inf, ends).min(axis=0)

    def _crossed(self, points: Array, towards: Array) -> tuple[Array, Array]:
        """Where lines enter and leave the pieces, (k, p) each; infinite and reversed where they pass beside."""
        at = np.moveaxis(self.local(points), 1, 0)
        slope = np.einsum("kij,pj->kpi", self.axes, towards)
        half = self.half[:, None, :]
        flat = np.abs(slope) < PARALLEL
        unit = np.where(flat, 1.0, slope)
        both = np.stack([(-half - at) / unit, (half - at) / unit])
        beside = flat & (np.abs(at) >= half)
        low = np.where(flat, np.where(beside, np.inf, -np.inf), both.min(axis=0))
        high = np.where(flat, np.where(beside, -np.inf, np.inf), both.max(axis=0))
        a = (slope[..., 1:] ** 2).sum(axis=-1)
        b = (slope[..., 1:] * at[..., 1:]).sum(axis=-1)
        c = (at[..., 1:] ** 2).sum(axis=-1) - half[..., 1] ** 2
        along, root = a < PARALLEL**2, b * b - a * c
        misses = np.where(along, c >= 0, root <= 0)
        width = np.sqrt(np.maximum(root, 0.0))
        unit = np.where(along, 1.0, a)
        in_disc = np.where(misses, np.inf, np.where(along, -np.inf, (-b - width) / unit))
        out_disc = np.where(misses, -np.inf, np.where(along, np.inf, (-b + width) / unit))
        is_round = self.is_round[:, None]
        enter = np.where(is_round, np.maximum(low[..., 0], in_disc), low.max(axis=-1))
        leave = np.where(is_round, np.minimum(high[..., 0], out_disc), high.min(axis=-1))
        return np.where(enter < leave, enter, np.inf), np.where(enter < leave, leave, -np.inf)

    def room(self, point: Array, axes: Array, t: float) -> tuple[Array, Array, float]:
        """The box along the axes, as middle (3,) and half sizes (3,), m, in which what ends at `point` (3,) is.

        axes (3, 3) are its own as columns, the first into the solid; t its thickness along the last one, m. Lines from
        a thickness below the face, or halfway to what is behind, find the sides. The box is no deeper than the solid is
        where the root reaches (`_depth`). Last, how deep these lines begin; 0 where there is no solid.
        """
        towards, step = axes[:, 0], 10 * ON * float(np.ptp(self.box, axis=0).max())
        deep = float(self.exits((point + step * towards)[None], towards[None])[0])
        depth = min(t, deep / 2)
        start = point + max(depth, step) * towards
        lines = np.concatenate([np.eye(3), -np.eye(3)])
        reach = self.exits(np.tile(start, (6, 1)), lines)
        k = int((lines @ towards).argmax())
        if lines[k] @ towards > SQUARE:
            reach[k] = min(reach[k], self._depth(point + step * towards, axes, deep) - depth)
        up, down = reach.reshape(2, 3)
        return start + (up - down) / 2, (up + down) / 2, depth

    def _depth(self, point: Array, axes: Array, deep: float) -> float:
        """How deep a root is that reaches along its thickness as far as half of the least depth on the way."""
        away = ROOT_DEPTH * deep * np.arange(1, STEPS + 1) / STEPS
        least = deep
        for side in (axes[:, 2], -axes[:, 2]):
            room = float(self.exits(point[None], side[None])[0])
            depths = self.exits(point + away[:, None] * side, np.tile(axes[:, 0], (STEPS, 1)))
            beyond = (ROOT_DEPTH * np.minimum.accumulate(depths) < away) & (away < room)
            if beyond.any():
                least = min(least, float(away[beyond.argmax()]) / ROOT_DEPTH)
        return least


class MeshedSolid(Protocol):
    """What `structure` asks of a composite that is meshed, in the axes of the body and from its centre.

    `rigid` (6, 6) is its mass matrix there; material E, Pa, nu, rho, kg/m^3.
    """

    pieces: Pieces
    material: tuple[float, float, float]

    @property
    def rigid(self) -> Array:
        """Mass matrix (6, 6) about the origin."""
        ...

    @property
    def volume(self) -> float:
        """Volume, m^3."""
        ...

    @property
    def thickness(self) -> float:
        """Mean thickness, m: twice the volume over the surface."""
        ...

    @property
    def cell(self) -> float:
        """Length of the cells of its mesh, m."""
        ...

    @property
    def cells(self) -> Array:
        """Corners (c, 4, 3), m, of the tetrahedra of a coarse mesh."""
        ...

    @property
    def surface(self) -> tuple[Array, Index]:
        """Points (n, 3), m, and triangles (t, 3)."""
        ...

    def solid(self, patches: Patches, held: tuple[int, int] | None) -> FiniteSolid:
        """What it does when it is pulled at patches, one design, free or held at a face of the box around it."""
        ...


def _placed(piece: BoxPiece | CylinderPiece | PlatePiece | PrismPiece) -> tuple[Array, Array, Array, bool]:
    """Centre (3,), axes (3, 3) as rows, half sizes (3,), and whether it is a cylinder."""
    turn = np.eye(3)
    if piece.rotate is not None:
        turn = rotation_matrix(_numbers(piece.rotate.axis), _numbers(piece.rotate.angle)).T
    match piece:
        case BoxPiece(size=size):
            half, axes = _numbers(size) / 2, np.eye(3)
        case PlatePiece(length=a, width=b, thickness=c):
            half, axes = _numbers((a, b, c)) / 2, np.eye(3)
        case CylinderPiece(diameter=d, length=length, axis=axis):
            half, along = _numbers((length, d, d)) / 2, _numbers(axis)
            axes = member_frame(along, np.eye(3)[int(np.abs(along).argmin())])
        case PrismPiece(thickness=t):
            outline, middle = _outline(piece)
            half, axes = np.append(np.abs(outline).max(axis=0), _numbers(t) / 2), np.eye(3)
            return _numbers(piece.at) + np.append(middle, 0.0) @ turn, turn, half, False
    return _numbers(piece.at), axes @ turn, half, isinstance(piece, CylinderPiece)


def _outline(piece: PrismPiece) -> tuple[Array, Array]:
    """Corners (n, 2), anticlockwise, from the middle (2,) of the box around them, and this."""
    corners = _numbers(piece.outline)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    x, y = (corners - middle).T
    area = x @ np.roll(y, -1) - y @ np.roll(x, -1)
    return (corners - middle)[:: 1 if area > 0 else -1], middle


def _numbers(values: Any) -> NDArray[np.float64]:
    return np.array(values, dtype=float)
