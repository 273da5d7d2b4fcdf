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
    what colours the points, NaN where nothing does. grids: which points are of which members. notes: what is left out.
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
    notes: tuple[str, ...] = ()

    @property
    def kinds(self) -> set[Kind]:
        """Kinds that occur."""
        found = np.unique(np.concatenate([self.face_kinds, self.line_kinds, self.dot_kinds]))
        return {Kind(k) for k in found}

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


class _Runs(NamedTuple):
    """Cells one after another, of several parts in equal numbers: the parts (k,), their kinds (k,), cells of each."""

    parts: Index
    kinds: Index
    each: int


@dataclass
class Collector:
    """Gathers meshes, lines and dots, each of a part with a name, into one set of points."""

    notes: list[str] = field(default_factory=list)
    _points: list[Array] = field(default_factory=list)
    _motions: list[Array] = field(default_factory=list)
    _cells: dict[str, list[Index]] = field(default_factory=lambda: {"faces": [], "lines": [], "dots": []})
    _runs: dict[str, list[_Runs]] = field(default_factory=lambda: {"faces": [], "lines": [], "dots": []})
    _names: dict[str, int] = field(default_factory=dict)
    _grids: list[Grid] = field(default_factory=list)
    _count: int = 0
    _low: Array = field(default_factory=lambda: np.full(3, np.inf))
    _high: Array = field(default_factory=lambda: np.full(3, -np.inf))

    def mesh(self, mesh: Mesh, motions: Array, kind: Kind, name: str) -> None:
        """Add a mesh whose points move by `motions` (v, 3)."""
        self._add("faces", mesh.points, motions, mesh.faces, self._run(kind, name, len(mesh.faces)))

    def path(self, points: Array, motions: Array, kind: Kind, name: str) -> None:
        """Add a line through points (p, 3)."""
        k = np.arange(len(points) - 1)
        self._add("lines", points, motions, np.stack([k, k + 1], axis=-1), self._run(kind, name, len(k)))

    def segments(self, ends: Array, motions: Array, kind: Kind, names: Sequence[str]) -> None:
        """Add a straight line of each name, with ends (k, 2, 3)."""
        numbers = np.array([self._number(name) for name in names], dtype=np.intp)
        cells = np.arange(2 * len(ends)).reshape(-1, 2)
        runs = _Runs(numbers, np.full(len(ends), kind), 1)
        self._add("lines", ends.reshape(-1, 3), motions.reshape(-1, 3), cells, runs)

    def dot(self, point: Array, motion: Array, kind: Kind, name: str) -> None:
        """Add a dot."""
        self._add("dots", point[None], motion[None], np.zeros(1, dtype=np.intp), self._run(kind, name, 1))

    def grid(
        self,
        grid: Grid,
        points: Array,
        motions: Array,
        cells: Index,
        kinds: Index,
        mirrored: NDArray[np.bool_],
        names: Sequence[str],
    ) -> None:
        """Add equal meshes: points, motions (c, m, p, 3), faces (f, 4) or lines (l, 2) over the p points.

        `kinds` (c, m) and `names`, c times m, go by member; `mirrored` (c,) turns faces the other way round. Where the
        points are in the end is set in `grid`.
        """
        c, m, p, _ = points.shape
        first = p * np.arange(c * m).reshape(c, m, 1, 1)
        numbered = first + cells
        numbered[mirrored] = numbered[mirrored][..., ::-1]
        shape = "faces" if cells.shape[1] == 4 else "lines"
        runs = _Runs(np.array([self._number(name) for name in names], dtype=np.intp), kinds.ravel(), len(cells))
        cells = numbered.reshape(-1, cells.shape[1])
        self._grids.append(grid._replace(first=self._count))
        self._add(shape, points.reshape(-1, 3), motions.reshape(-1, 3), cells, runs)

    def _number(self, name: str) -> int:
        return self._names.setdefault(name, len(self._names))

    def _run(self, kind: Kind, name: str, count: int) -> _Runs:
        return _Runs(np.array([self._number(name)]), np.array([kind]), count)

    def _add(self, shape: str, points: Array, motions: Array, cells: Index, runs: _Runs) -> None:
        self._points.append(points)
        self._motions.append(motions)
        self._cells[shape].append(cells + self._count)
        self._runs[shape].append(runs)
        self._count += len(points)
        self.include(points)

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

        def joined(shape: str, *width: int) -> tuple[Index, Index, Index]:
            """Cells, their kinds and their parts."""
            cells = np.concatenate([np.empty((0, *width), dtype=np.intp), *self._cells[shape]]).astype(np.intp)
            runs = self._runs[shape]
            each = np.repeat([own.each for own in runs], [len(own.parts) for own in runs]).astype(np.intp)
            kinds, parts = (
                np.repeat(np.concatenate([np.empty(0, dtype=np.intp), *own]), each)
                for own in ([own.kinds for own in runs], [own.parts for own in runs])
            )
            return cells, kinds, parts

        return Solids(
            np.concatenate([np.empty((0, 3)), *self._points]),
            np.concatenate([np.empty((0, 3)), *self._motions]),
            *joined("faces", 4),
            *joined("lines", 2),
            *joined("dots"),
            tuple(self._names),
            rotation,
            np.full(self._count, np.nan),
            tuple(self._grids),
            tuple(self.notes),
        )


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
