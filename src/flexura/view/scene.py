"""What a picture is made of: points that move, and the faces, lines and dots over them."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from flexura.view.meshes import Array, Index, Mesh


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
    DOUBTED = 13
    DOUBTED_BODY = 14


@dataclass(frozen=True)
class Solids:
    """Everything there is to draw.

    points: (v, 3), m, undeformed, global frame; motions: (v, 3), what the displacements given move them by;
    faces: (f, 4), lines: (l, 2) and dots: (d,) index the points; the kinds go with them. rotation: largest rotation of
    any node in the displacements given. values: (v,), what colours the points, NaN where nothing does.
    """

    points: Array
    motions: Array
    faces: Index
    face_kinds: Index
    lines: Index
    line_kinds: Index
    dots: Index
    dot_kinds: Index
    rotation: float
    values: Array

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


@dataclass
class Collector:
    """Gathers meshes, lines and dots into one set of points."""

    _points: list[Array] = field(default_factory=list)
    _motions: list[Array] = field(default_factory=list)
    _values: list[Array] = field(default_factory=list)
    _cells: dict[str, list[Index]] = field(default_factory=lambda: {"faces": [], "lines": [], "dots": []})
    _kinds: dict[str, list[Index]] = field(default_factory=lambda: {"faces": [], "lines": [], "dots": []})
    _count: int = 0
    _low: Array = field(default_factory=lambda: np.full(3, np.inf))
    _high: Array = field(default_factory=lambda: np.full(3, -np.inf))

    def mesh(self, mesh: Mesh, motions: Array, kind: Kind) -> None:
        """Add a mesh whose points move by `motions` (v, 3)."""
        self._add("faces", mesh.points, motions, mesh.faces, np.full(len(mesh.faces), kind))

    def path(self, points: Array, motions: Array, kind: Kind) -> None:
        """Add a line through points (p, 3)."""
        k = np.arange(len(points) - 1)
        self._add("lines", points, motions, np.stack([k, k + 1], axis=-1), np.full(len(k), kind))

    def dot(self, point: Array, motion: Array, kind: Kind) -> None:
        """Add a dot."""
        self._add("dots", point[None], motion[None], np.zeros(1, dtype=np.intp), np.full(1, kind))

    def grid(
        self,
        points: Array,
        motions: Array,
        cells: Index,
        kinds: Index,
        mirrored: NDArray[np.bool_],
        values: Array | None = None,
    ) -> None:
        """Add equal meshes: points, motions (c, m, p, 3), faces (f, 4) or lines (l, 2) over the p points.

        `kinds` (c, m) goes by member; `mirrored` (c,) turns faces the other way round; `values` (c, m, p) colour.
        """
        c, m, p, _ = points.shape
        first = p * np.arange(c * m).reshape(c, m, 1, 1)
        numbered = first + cells
        numbered[mirrored] = numbered[mirrored][..., ::-1]
        kind = np.broadcast_to(kinds[:, :, None], (c, m, len(cells))).ravel()
        shape = "faces" if cells.shape[1] == 4 else "lines"
        cells = numbered.reshape(-1, cells.shape[1])
        self._add(shape, points.reshape(-1, 3), motions.reshape(-1, 3), cells, kind, values)

    def _add(
        self, shape: str, points: Array, motions: Array, cells: Index, kinds: Index, values: Array | None = None
    ) -> None:
        self._points.append(points)
        self._motions.append(motions)
        self._values.append(np.full(len(points), np.nan) if values is None else values.ravel())
        self._cells[shape].append(cells + self._count)
        self._kinds[shape].append(kinds)
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

        def joined(arrays: list[Index], *shape: int) -> Index:
            return np.concatenate([np.empty((0, *shape), dtype=np.intp), *arrays]).astype(np.intp)

        cells, kinds = self._cells, self._kinds
        return Solids(
            np.concatenate([np.empty((0, 3)), *self._points]),
            np.concatenate([np.empty((0, 3)), *self._motions]),
            joined(cells["faces"], 4),
            joined(kinds["faces"]),
            joined(cells["lines"], 2),
            joined(kinds["lines"]),
            joined(cells["dots"]),
            joined(kinds["dots"]),
            rotation,
            np.concatenate([np.empty(0), *self._values]),
        )
