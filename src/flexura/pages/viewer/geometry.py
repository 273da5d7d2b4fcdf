"""What pages draw of a mechanism, in an order that stays while its numbers change, and what colours it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.analysis import PartStress, Stresses, element_strains, energies
from flexura.arrays import Array, Index
from flexura.pages.viewer.scene import Buffer, ByPart, Colouring
from flexura.structure import FullOrderModel
from flexura.tables import number, percent, quantity
from flexura.view import Grid, Kind, Look, Solids, mode_scale, solids

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


DISPLACEMENT = Colouring("displacement", "displacement", "m", None, None)

BODIES = {Kind.BODY, Kind.FLAGGED_BODY, Kind.CLAMP}
STRAINED = {Kind.FLEXURE, Kind.LINK, Kind.SPRING, Kind.SUPERELEMENT, Kind.PIEZO, *BODIES}
MEMBERS = {Kind.FLEXURE, Kind.LINK}
STRESSED = {*MEMBERS, Kind.SUPERELEMENT}
HEAVY = {Kind.BODY, Kind.EQUIVALENT_BODY, Kind.MASS, Kind.SENSOR}

LEAST = 5e-4
"""Share of the energy below which nothing is said of a part."""


class Energy:
    """Strain energies of k motions of all nodes, displacements (n_nodes, 6, k), m and rad in any common scale."""

    def __init__(self, drawing: Drawing, displacements: Array) -> None:
        self.drawing = drawing
        self.model: FullOrderModel = drawing.model
        parts = energies(self.model, displacements)
        prefixes = ["" if own.path == "mechanism" and not own.prototype else f"{own.path}." for own in parts]
        self.strain: dict[str, Array] = {
            prefix + key: kinds.sum(axis=0)
            for prefix, own in zip(prefixes, parts, strict=True)
            for key, kinds in own.strain.items()
        }
        self.total: Array = sum(self.strain.values(), np.zeros(displacements.shape[2]))
        self._densities = [(grid, self._density(grid, displacements)) for grid in drawing.solids.grids]

    def _density(self, grid: Grid, displacements: Array) -> Array:
        """Strain energy over volume (c, m, p, k), J/m^3, the mean over the section, at the points of members."""
        part = self.model.plan.parts[grid.prototype]
        volume = _volumes(self.model, grid.prototype)
        n = int(part.counts[grid.members[0]])
        elements = part.first[grid.members][:, None] + np.arange(n)
        if self.model.plan.is_posed:
            names = [_names(self.model, grid, c) for c in grid.copies]
            own = np.array([[self.strain[name] for name in names_of] for names_of in names])
            density = (own / volume[elements].sum(axis=1)[:, None])[:, :, None]
            return np.repeat(density, len(grid.along), axis=2)
        strains = element_strains(self.model, displacements, grid.prototype, grid.copies.tolist())
        density = strains[:, elements] / volume[elements][..., None]
        middles = (np.arange(n) + 0.5) / n
        weights = np.stack([np.interp(grid.along, middles, row) for row in np.eye(n)], axis=-1)
        return np.einsum("pe,cmek->cmpk", weights, density)

    def colouring(self, k: int) -> Colouring | None:
        """Density of the strain energy in motion k, members alone; None where nothing is strained."""
        values = np.full(len(self.drawing.solids.points), np.nan)
        for grid, density in self._densities:
            own = density[..., k].ravel()
            values[grid.first : grid.first + len(own)] = own
        largest = float(np.nanmax(values, initial=0.0))
        if not largest > 0 or not self.total[k] > 0:
            return None
        return Colouring("energy", "strain energy density", "", None, Buffer.shares(values, largest))

    def by_part(self, k: int) -> ByPart:
        """Shares of the strain energy in motion k."""
        total = float(self.total[k])
        shares = {name: float(own[k]) / total for name, own in self.strain.items()} if total > 0 else {}
        return by_part(
            self.drawing, "strain energy", STRAINED, {n: percent(s) for n, s in shares.items() if s >= LEAST}
        )


def stress_colouring(values: Array, largest: float | None = None) -> Colouring | None:
    """Stresses (v,), Pa, NaN where they are not known; `largest` of several motions that are to be compared."""
    most = float(np.nanmax(values, initial=0.0)) if largest is None else largest
    return (
        Colouring("stress", "largest von Mises stress in the section", "Pa", most, Buffer.shares(values, most))
        if most > 0
        else None
    )


def stress_by_part(drawing: Drawing, stresses: Stresses) -> tuple[ByPart, ...]:
    """Largest stress of each member and part, and how far it is from yield."""
    most, margin = dict[str, str](), dict[str, str]()
    for own in reversed(stresses.members):  # of several solids of a part the most stressed one comes last
        name = own.superelement if isinstance(own, PartStress) else own.name
        if own.von_mises is not None:
            most[name] = quantity(own.von_mises, "Pa", 4)
        if own.factor_to_yield is not None and np.isfinite(own.factor_to_yield):
            margin[name] = f"at {number(own.factor_to_yield, 4)} times this"
    return by_part(drawing, "largest stress", STRESSED, most), by_part(drawing, "yields", STRESSED, margin)


def by_part(drawing: Drawing, label: str, kinds: set[Kind], told: Mapping[str, str]) -> ByPart:
    """What is told of parts by name, of those of some kinds, as the page has it."""
    names = drawing.solids.names
    held = {*kinds, Kind.FLAGGED, Kind.FLAGGED_BODY}
    return ByPart(
        label, tuple(told.get(names[n], "") if Kind(kind) in held else "" for n, kind in drawing.parts.tolist())
    )


def _names(model: FullOrderModel, grid: Grid, copy: int) -> list[str]:
    keys = list(model.plan.parts[grid.prototype].members)
    path = model.plan.topology.copies[grid.prototype].paths[copy]
    return [".".join((*path, keys[m])) for m in grid.members]


def _volumes(model: FullOrderModel, name: str) -> Array:
    """Volumes (e,), m^3, of the elements of a prototype."""
    part, length = model.plan.parts[name], model.geometry.parts[name].length
    nu = part.table.moduli(model.values)[2]
    area: Any = part.table.section_properties(model.values, nu, length).A
    member = part.table.element_member
    return area * (length / np.asarray(part.counts))[member]
