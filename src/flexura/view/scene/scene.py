"""What a picture is made of: points that move, and the faces, lines and dots over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.beam import skew
from flexura.motion import Frames
from flexura.structure import FullOrderModel
from flexura.view.scene.meshes import Array, Index, Mesh


class Kind(IntEnum):
    """What a face, line or dot belongs to."""

    FLEXURE = 0
    LINK = 1
    BODY = 2
    EQUIVALENT_BODY = 3
    SPRING = 4
    MASS = 5
    SUPERELEMENT = 6
    CLAMP = 7
    PARTLY_HELD = 8
    ARM = 9
    NODE = 10
    CENTRE = 11
    PIEZO = 12
    FLAGGED = 13
    FLAGGED_BODY = 14
    ACTUATOR = 15
    SENSOR = 16
    DASHPOT = 17
    STOP = 18


class Look(NamedTuple):
    """How finely a mechanism is drawn.

    Members are drawn in less detail to stay below `faces`, and as lines where the least detail has more than
    `most_faces`. Of more parts of a kind than `most` only so many are drawn, evenly chosen. `plain` leaves flat sides
    whole and gives round ones half the corners: enough where the picture is shaded by something else than us.
    `channels` are actuators and sensors.
    """

    faces: int = 20_000
    most_faces: int = 20_000
    most: int = 1_500
    plain: bool = False
    channels: bool = False

    def chosen(self, count: int, share: float = 1.0) -> Index:
        """Which of `count` things are drawn, at most a share of `most`, and one at least."""
        kept = min(count, max(1, int(share * self.most)))
        return np.arange(count) if kept == count else (np.arange(kept) * count / kept).astype(np.intp)


class Grid(NamedTuple):
    """Points of members of one group: from point `first` on, (c, m, p) of the `copies` (c,) and `members` (m,) of a
    `prototype`, by number; along: (p,), where on the member, as a fraction of its length."""

    prototype: str
    copies: Index
    members: Index
    along: Array
    first: int


@dataclass(frozen=True)
class Solids:
    """Everything there is to draw.

    points: (v, 3), m, undeformed, global frame; motions: (v, 3), what the displacements given move them by;
    faces: (f, 4), lines: (l, 2) and dots: (d,) index the points. The kinds go with them, and the parts, which index
    `names`, such as `arm[1].leaf`. rotation: largest rotation of any node in the displacements given. values: (v,),
    what colours the points, NaN where nothing does. grids: which points are of which members; surfaces: the name, the
    first point and the number of points of each surface of a superelement. notes: what is left out.
    """

    points: Array
    motions: Array
    faces: Index
    face_kinds: Index
    face_parts: Index
    lines: Index
    line_kinds: Index
    line_parts: Index
    dots: Index
    dot_kinds: Index
    dot_parts: Index
    names: tuple[str, ...]
    rotation: float
    values: Array
    grids: tuple[Grid, ...] = ()
    surfaces: tuple[tuple[str, int, int], ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def kinds(self) -> set[Kind]:
        """Kinds that occur."""
        kinds = np.unique(np.concatenate([self.face_kinds, self.line_kinds, self.dot_kinds]))
        return {Kind(k) for k in kinds}

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper corner (3,), m, of what is drawn, undeformed; 10 mm apart when it is a single point."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return (low, high) if (high > low).any() else (low - 0.005, high + 0.005)

    def size(self) -> float:
        """Longest side of the bounding box, m."""
        low, high = self.bounds()
        return float((high - low).max())

    def largest_motion(self) -> float:
        """Largest motion of any point, in the unit of the displacements."""
        return float(np.sqrt((self.motions**2).sum(axis=1).max(initial=0.0)))


class Motions(NamedTuple):
    """Motions of nodes: `shift` (..., n, 3), m, of where they are, and `turn` (..., n, 3, 3), global frame.

    What is fixed to a node at a distance d moves by `shift + turn @ d`. `is_finite` says that the identity and `turn`
    are a rotation; else `turn` is the vector product with small rotations.
    """

    shift: Array
    turn: Array
    is_finite: bool = False

    @staticmethod
    def small(u: Array) -> Motions:
        """Of displacements (..., n, 6), m and rad in any common scale."""
        return Motions(u[..., :3], skew(u[..., 3:]))

    @staticmethod
    def finite(model: FullOrderModel, frames: Frames) -> Motions:
        """Of frames of all nodes and the ground in a pose (theory of large motion, G1)."""
        topology, x = model.plan.topology, model.geometry.positions
        root = topology.root
        turn = frames.R[root] - np.eye(3)
        moved = frames.x[root] - x[root] + (turn @ (x - x[root])[..., None])[..., 0]
        placed = topology.has_position
        return Motions(np.where(placed[:, None], moved, 0.0), np.where(placed[:, None, None], turn, 0.0), True)

    def of(self, nodes: Any) -> Motions:
        """Those of some nodes, by numbers or a slice."""
        return Motions(self.shift[nodes], self.turn[nodes], self.is_finite)

    def carried(self, distance: Array) -> Array:
        """Motions (..., n, 3) of what is fixed to the nodes at distances (..., n, 3), m."""
        return self.shift + (self.turn @ distance[..., None])[..., 0]

    @property
    def rotations(self) -> Array:
        """Small rotations (..., n, 3)."""
        return self.turn[..., [2, 0, 1], [1, 2, 0]]


class Surfaces(NamedTuple):
    """Equal meshes of members in all copies of a part, global frame: points (c, m, p, 3), m, the motion of each with
    the nodes, and faces (f, 4) over the p points, or lines (l, 2)."""

    points: Array
    motions: Array
    faces: Index


_Cells = tuple[Index, Index, Index]
"""Faces (k, 4), lines (k, 2) or dots (k,), which index points, their kinds (k,) and their parts (k,)."""


@dataclass
class Collector:
    """Gathers meshes, lines and dots, each of a part with a name, into one set of points, while the parts of a
    mechanism are gone through: its nodes have `motions`, parts that are `flagged` a kind of their own."""

    motions: Motions
    look: Look
    flagged: frozenset[str] = frozenset()
    notes: list[str] = field(default_factory=list)
    _points: list[Array] = field(default_factory=lambda: [np.empty((0, 3))])
    _motions: list[Array] = field(default_factory=lambda: [np.empty((0, 3))])
    _faces: list[_Cells] = field(default_factory=lambda: [_cells(4)])
    _lines: list[_Cells] = field(default_factory=lambda: [_cells(2)])
    _dots: list[_Cells] = field(default_factory=lambda: [_cells()])
    _names: dict[str, int] = field(default_factory=dict)
    _grids: list[Grid] = field(default_factory=list)
    _surfaces: list[tuple[str, int, int]] = field(default_factory=list)
    _count: int = 0
    _low: Array = field(default_factory=lambda: np.full(3, np.inf))
    _high: Array = field(default_factory=lambda: np.full(3, -np.inf))

    def mesh(self, mesh: Mesh, motions: Array, kind: Kind, name: str) -> None:
        """Add a mesh whose points move by `motions` (v, 3)."""
        self._add(self._faces, (mesh.points, motions), mesh.faces, kind, self._number(name))

    def surface(self, mesh: Mesh, motions: Array, name: str) -> None:
        """Add the surface of a superelement."""
        self._surfaces.append((name, self._count, len(mesh.points)))
        self.mesh(mesh, motions, Kind.SUPERELEMENT, name)

    def path(self, points: Array, motions: Array, kind: Kind, name: str) -> None:
        """Add a line through points (p, 3)."""
        k = np.arange(len(points) - 1)
        self._add(self._lines, (points, motions), np.stack([k, k + 1], axis=-1), kind, self._number(name))

    def segments(self, ends: Array, motions: Array, kind: Kind, names: Sequence[str]) -> None:
        """Add a straight line of each name, with ends (k, 2, 3)."""
        points = ends.reshape(-1, 3), motions.reshape(-1, 3)
        parts = np.array([self._number(name) for name in names], dtype=np.intp)
        self._add(self._lines, points, np.arange(2 * len(ends)).reshape(-1, 2), kind, parts)

    def dot(self, point: Array, motion: Array, kind: Kind, name: str) -> None:
        """Add a dot."""
        self._add(self._dots, (point[None], motion[None]), np.zeros(1, dtype=np.intp), kind, self._number(name))

    def members(
        self, surfaces: Surfaces, grid: Grid, kinds: Index, names: Sequence[str], mirrored: NDArray[np.bool_]
    ) -> None:
        """Add the surfaces of members: `kinds` (c, m) and `names`, c times m, go by member; `mirrored` (c,) turns faces
        the other way round. Where the points are in the end is set in `grid`."""
        c, m, p, _ = surfaces.points.shape
        cells = p * np.arange(c * m).reshape(c, m, 1, 1) + surfaces.faces
        cells[mirrored] = cells[mirrored][..., ::-1]
        each, corners = surfaces.faces.shape
        self._grids.append(grid._replace(first=self._count))
        points = surfaces.points.reshape(-1, 3), surfaces.motions.reshape(-1, 3)
        parts = np.repeat([self._number(name) for name in names], each)
        shape = self._faces if corners == 4 else self._lines
        self._add(shape, points, cells.reshape(-1, corners), np.repeat(kinds.ravel(), each), parts)

    def _number(self, name: str) -> int:
        return self._names.setdefault(name, len(self._names))

    def _add(
        self, shape: list[_Cells], points: tuple[Array, Array], cells: Index, kinds: Index | Kind, parts: Index | int
    ) -> None:
        """Add cells over points, which have motions; kinds and parts are of each cell, or of all."""
        places, motions = points
        self._points.append(places)
        self._motions.append(motions)
        count = len(cells)
        shape.append((cells + self._count, np.full(count, kinds), np.full(count, parts)))
        self._count += len(places)
        self.include(places)

    def include(self, points: Array) -> None:
        """Count points (p, 3) towards the size without drawing anything there."""
        self._low = np.minimum(self._low, points.min(axis=0, initial=np.inf))
        self._high = np.maximum(self._high, points.max(axis=0, initial=-np.inf))

    @property
    def size(self) -> float:
        """Longest side of the bounding box so far, m; 10 mm when there is nothing yet."""
        longest = float((self._high - self._low).max())
        return longest if np.isfinite(longest) and longest > 0 else 0.01

    @property
    def middle(self) -> Array:
        """Middle of the bounding box so far, m."""
        return (self._low + self._high) / 2

    def solids(self, rotation: float) -> Solids:
        """What was gathered, with the largest rotation of any node."""

        def joined(cells: list[_Cells]) -> _Cells:
            indices, kinds, parts = (np.concatenate(arrays).astype(np.intp) for arrays in zip(*cells, strict=True))
            return indices, kinds, parts

        return Solids(
            np.concatenate(self._points),
            np.concatenate(self._motions),
            *joined(self._faces),
            *joined(self._lines),
            *joined(self._dots),
            tuple(self._names),
            rotation,
            np.full(self._count, np.nan),
            tuple(self._grids),
            tuple(self._surfaces),
            tuple(self.notes),
        )


def _cells(*width: int) -> _Cells:
    """No cells."""
    return np.empty((0, *width), dtype=np.intp), np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
