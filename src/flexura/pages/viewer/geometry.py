"""Points, triangles and parts of a mechanism, in an order that stays while its numbers change."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import NamedTuple, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array, Index
from flexura.pages.viewer.buffers import Buffer
from flexura.structure import FullOrderModel
from flexura.view import Look, Solids, mode_scale, solids

PAGE = Look(faces=8_000, most_faces=16_000, most=1_000, plain=True, channels=True)
"""How finely pages draw a mechanism: with some sixteen thousand triangles, and twice as many where members are many."""


class Cells(NamedTuple):
    """Triangles (n, 3), lines (n, 2) or dots (n,), in the order of their parts, and how many of them each part has
    (parts,)."""

    cells: Index
    counts: Index


@dataclass(frozen=True, eq=False)
class Drawing:
    """A mechanism at rest, or at the pose that is described, as a page draws it.

    parts: (parts, 2), the name of each part, an index into `solids.names`, and its kind; model: what was drawn.
    """

    model: FullOrderModel
    solids: Solids
    doubted: frozenset[str]
    parts: Index
    triangles: Cells
    lines: Cells
    dots: Cells

    @staticmethod
    def of(model: FullOrderModel, doubted: Collection[str] = ()) -> Drawing:
        """The drawing of one design; parts by name that are `doubted` are of a kind of their own.

        Raises OptionError for a stack of designs, and as `FullOrderModel` does at a pose that is not reached.
        """
        drawn = solids(model, None, frozenset(doubted), PAGE)
        faces = drawn.faces
        split = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
        whole = np.flatnonzero(_has_sides(drawn.points, split))
        owners = [np.tile(np.stack([drawn.face_parts, drawn.face_kinds], axis=1), (2, 1))[whole]]
        owners += [np.stack([drawn.line_parts, drawn.line_kinds], axis=1)]
        owners += [np.stack([drawn.dot_parts, drawn.dot_kinds], axis=1)]
        names, kinds = np.concatenate(owners).T
        codes, number = np.unique(kinds * max(1, len(drawn.names)) + names, return_inverse=True)
        parts = np.stack([codes % max(1, len(drawn.names)), codes // max(1, len(drawn.names))], axis=1)
        at = np.split(number, np.cumsum([len(own) for own in owners])[:-1])
        shapes = (split[whole], drawn.lines, drawn.dots)
        cells = [_by_part(own, who, len(parts)) for own, who in zip(shapes, at, strict=True)]
        return Drawing(model, drawn, frozenset(doubted), parts, *cells)

    def moved(self, displacements: ArrayLike) -> Solids:
        """The same, moving with displacements (n_nodes, 6) of the nodes, m and rad in any common scale."""
        return solids(self.model, displacements, self.doubted, PAGE)

    def redrawn(self, model: FullOrderModel, displacements: ArrayLike | None = None) -> Solids | None:
        """Points and motions of another design of the same plan, in the same order; None where it has other parts or
        corners, so that it wants a drawing of its own."""
        other = solids(model, displacements, self.doubted, PAGE)
        same = (
            len(other.points) == len(self.solids.points)
            and np.array_equal(other.faces, self.solids.faces)
            and np.array_equal(other.lines, self.solids.lines)
            and np.array_equal(other.face_kinds, self.solids.face_kinds)
            and other.names == self.solids.names
        )
        return other if same else None


def quick(
    drawing: Drawing, model: FullOrderModel, displacements: ArrayLike
) -> tuple[Drawing, dict[str, Buffer]] | None:
    """What of a scene changes with the parameters: `points` (v, 3) and `displacement` (v, 3) of one motion, as buffers.

    drawing: that of another design of the same plan, which the page has the scene of; model: the design that is to be
    shown; displacements: (n_nodes, 6), m and rad in any common scale, such as one of `Modes.shapes`. Returned are the
    drawing of this design as well, to go on from. The page colours it by displacement by itself. None where the design
    has other parts or corners than the drawing: the page then wants a whole scene. Some 7 ms for the paper's platform.
    """
    found = drawing.redrawn(model, displacements)
    if found is None:
        return None
    own = replace(drawing, model=model, solids=found)
    return own, {"points": Buffer.floats(found.points), "displacement": Buffer.field(found.motions)}


class Moving(TypedDict):
    """How points move: those fields of a `ShownMotion`."""

    displacement: Buffer
    nature: str
    factor: float
    largest: float | None


def vibrating(moved: Solids, factor: float | None = None) -> Moving:
    """A shape whose size is not known, drawn as large as `mode_scale` has it unless a factor is given."""
    own = mode_scale(moved) if factor is None else factor
    return {"displacement": Buffer.field(moved.motions), "nature": "vibration", "factor": own, "largest": None}


def displaced(moved: Solids, factor: float, largest: float | None = None) -> Moving:
    """Displacements that are true at a factor of one; largest, m, is that of all points unless it is given."""
    own = moved.largest_motion() if largest is None else largest
    return {"displacement": Buffer.field(moved.motions), "nature": "displacement", "factor": factor, "largest": own}


def still(drawing: Drawing) -> Moving:
    """Nothing moves."""
    return displaced(replace(drawing.solids, motions=np.zeros_like(drawing.solids.points)), 1.0)


def _has_sides(points: Array, triangles: Index) -> NDArray[np.bool_]:
    """Which triangles have three different corners: a face that repeats one leaves a half without area."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return (a != b).any(axis=1) & (b != c).any(axis=1) & (a != c).any(axis=1)


def _by_part(cells: Index, part: Index, count: int) -> Cells:
    return Cells(cells[np.argsort(part, kind="stable")], np.bincount(part, minlength=count))
