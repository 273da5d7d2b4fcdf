"""Stiffness and mass of the whole part: curved tetrahedra by NGSolve, and what of it is not solid.

Bodies of mass alone, masses, springs, stacks, partial supports and links over gaps act on mean motions of patches.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.errors import ModelError, OptionError, Problem, SolverError, need
from flexura.fem import MILLIMETRE, CurvedElements, MemberSolid, fit_forms, refuse_memory
from flexura.mechanism import DOF_NAMES
from flexura.solid.whole.pieces import Block, Piece, Pieces, clamped_nodes, is_ground
from flexura.solid.whole.shapes import Part
from flexura.structure import FullOrderModel
from flexura.tables import quantity

ON_EDGE = 1e-4
"""Distance over the thickness up to which an edge lies in an end face."""
GRADING = 0.4
"""How fast tetrahedra grow away from fine places (netgen's own measure)."""
CURVATURE = 2.0
"""How many tetrahedra a radius of curvature is long, at least (netgen's own measure)."""
LEAF, ROD, NOTCH, BLOCK = 5.0, 1.5, 1.5, 1.0
"""Length of tetrahedra of size 1 over the thickness of what they are in."""
BUMP_ORDER = 14
"""Order of integration of bumps beyond that of the elements: a patch may be smaller than a cell."""
STATIONS = 81
"""Places along a contour at which its thickness bounds the length of tetrahedra."""
DOFS_OF_CELL = {2: 5.5, 3: 18.0, 4: 40.0, 5: 74.0}
"""DOFs over tetrahedra, of thin parts, by order."""

MOST_TIED = 12_000
"""DOFs whose mean motions may be tied to each other: their matrix is dense, and its factors take some gigabytes."""

STIFF = 1e3
"""Stiffness of what ties mean motions, over that of a cube of the material as wide as the patch."""

STIFF_ALONE = 1e12
"""The same, N/m and N m/rad, where nothing is drawn."""


@dataclass(frozen=True)
class Patch:
    """A bump about `centre` (3,), m, that reaches `radii` (3,), m, along `axes` (3, 3) as rows."""

    centre: Array
    axes: Array
    radii: Array


class Elements(CurvedElements):
    """The matrices of a meshed part with elements of some order, some pieces so many times as stiff; what is held is
    left out. Raises as `CurvedElements`."""

    def __init__(
        self, part: Part, mesh: Any, order: int, announce: Callable[[str], None], stiffer: Mapping[int, float]
    ) -> None:
        materials = {
            str(k): replace(piece.material, E=piece.material.E * stiffer.get(k, 1.0))
            for k, piece in enumerate(part.pieces.all)
        }
        super().__init__(mesh, order, materials, announce, held="held")

    def motion(self, patch: Patch) -> sp.csr_matrix:
        """B (6, n): displacement of the centre and rotation of the rigid motion that fits a patch best, weighted by its
        bump, by the DOFs."""
        ng = self._ng
        at = [x * MILLIMETRE - c for x, c in zip((ng.x, ng.y, ng.z), patch.centre, strict=True)]
        weight: Any = 1.0
        for axis, radius in zip(patch.axes, patch.radii, strict=True):
            s = (axis[0] * at[0] + axis[1] * at[1] + axis[2] * at[2]) / radius
            weight = weight * ng.IfPos(1 - s * s, 1 - s * s, 0.0)
        region = ng.dx(definedonelements=self._cells_near(patch), bonus_intorder=BUMP_ORDER)
        width = float(patch.radii.max())
        rows = self.loads(fit_forms(self.space.TestFunction(), at, weight, width, region))
        moved = rows @ (self.rigid_motions @ rigid_arm(-patch.centre))
        if not np.linalg.cond(moved * np.append(np.ones(3), np.full(3, 1 / width))) < 1e12:
            raise SolverError(f"too little of the mesh lies within {width:.3g} m of {patch.centre}")
        return sp.csr_matrix(np.linalg.solve(moved, rows[:, self.free]))

    def _cells_near(self, patch: Patch) -> Any:
        """Which tetrahedra may reach into a patch."""
        centre, radius = self._places
        local = np.abs((centre - patch.centre) @ patch.axes.T)
        near: NDArray[np.bool_] = np.asarray((local <= patch.radii + 1.5 * radius[:, None]).all(axis=1))
        marked = self._ng.BitArray(len(near))
        marked.Clear()
        for k in np.flatnonzero(near).tolist():
            marked.Set(k)
        return marked

    @cached_property
    def _places(self) -> tuple[Array, Array]:
        """Centres (cells, 3) and radii (cells,) of the cells, m."""
        points = np.array([v.point for v in self.mesh.vertices]) * MILLIMETRE
        # those cut next to corners are prisms and pyramids as well
        corners = [points[[v.nr for v in cell.vertices]] for cell in self.mesh.Elements(self._ng.VOL)]
        centre = np.array([of_cell.mean(axis=0) for of_cell in corners])
        radii = [np.linalg.norm(of_cell - at, axis=1).max() for of_cell, at in zip(corners, centre, strict=True)]
        return centre, np.array(radii)


def length_of_cells(piece: Piece, size: float) -> float:
    """Largest length of tetrahedra in a piece, m."""
    if isinstance(piece, Block):
        return size * BLOCK * piece.thickness
    outline = piece.outline
    if not outline.is_straight:
        return size * BLOCK * 2 * float(min(outline.y.max(), outline.z.max()))
    if outline.is_round:
        return size * ROD * (2 * float(outline.y[0]) if outline.inner == 0 else 3 * piece.thickness)
    return size * min(LEAF * piece.thickness, piece.length / 2)


def _fine_points(piece: MemberSolid, size: float) -> tuple[Array, Array]:
    """Points (p, 3), m, along the thin places of a contour and the lengths of tetrahedra (p,), m, there."""
    outline = piece.outline
    points, lengths = [], []
    coarse, last = length_of_cells(piece, size), -np.inf
    for x in np.linspace(0.0, piece.length, STATIONS):
        half_y, half_z = (float(h[0]) for h in outline.half(np.array([x])))
        h = size * NOTCH * 2 * min(half_y, half_z)
        if h >= coarse or x - last < h / 2:
            continue
        last = x
        wide = max(half_y, half_z) if not outline.is_round else 0.0
        across = np.linspace(-wide, wide, max(2, math.ceil(2 * wide / h)) + 1) if wide else np.zeros(1)
        none = 0 * across
        local = [none + x, across, none] if half_y >= half_z else [none + x, none, across]
        points.append(piece.placed(np.stack(local, axis=-1)))
        lengths.append(none + h)
    if not points:
        return np.empty((0, 3)), np.empty(0)
    return np.concatenate(points), np.concatenate(lengths)


def meshed(part: Part, order: int, size: float, announce: Callable[[str], None]) -> Any:
    """The mesh of a part for elements up to some order. Raises OptionError where these would not fit into memory, and
    SolverError where netgen fails."""
    ng = need("ngsolve", "solid")
    meshing, occ = need("netgen.meshing", "solid"), need("netgen.occ", "solid")
    refuse_memory(sum(_least_cells(piece, size) for piece in part.pieces.all) * DOFS_OF_CELL[order], order)
    pieces = part.pieces.all
    coarsest = max(length_of_cells(piece, size) for piece in pieces) / MILLIMETRE
    for solid in part.shape.solids:
        solid.maxh = length_of_cells(pieces[int(solid.name)], size) / MILLIMETRE
    graded = _mark_corners(part)
    parameters = meshing.MeshingParameters(maxh=coarsest, grading=GRADING, curvaturesafety=CURVATURE)
    for piece in part.pieces.members:
        if not piece.outline.is_straight:
            for p, h in zip(*_fine_points(piece, size), strict=True):
                x, y, z = p / MILLIMETRE
                parameters.RestrictH(x=x, y=y, z=z, h=h / MILLIMETRE)
    announce("mesh of the whole part")
    try:
        mesh = ng.Mesh(occ.OCCGeometry(part.shape).GenerateMesh(parameters))
    except Exception as error:
        raise SolverError(f"netgen could not mesh the part: {error}; another size may do") from None
    if graded:
        mesh.RefineHP(1)
    return mesh


def _least_cells(piece: Piece, size: float) -> float:
    """Tetrahedra that a piece has at least, about."""
    if isinstance(piece, Block):
        sizes = 2 * piece.half
    else:
        sizes = np.array([piece.length, 2 * float(piece.outline.y.max()), 2 * float(piece.outline.z.max())])
    return 5 * float(np.prod(np.maximum(sizes / length_of_cells(piece, size), 1.0)))


def _mark_corners(part: Part) -> bool:
    """Mark the edges at which members of one section come out of something wider: stresses there are infinite, and
    cells next to them are cut (hp refinement), so that the root gives what it does."""
    pieces, is_marked = part.pieces.all, False
    for solid in part.shape.solids:
        k = int(solid.name)
        member = pieces[k]
        if isinstance(member, Block) or not member.outline.is_straight:
            continue
        outline, thin = member.outline, member.thickness
        half = np.array([float(outline.y[0]), float(outline.z[0])])
        hosts = [pieces[b if a == k else a] for a, b in part.touching if k in (a, b)]
        for edge in solid.edges:
            middle = edge.center
            at = member.local(np.array([middle.x, middle.y, middle.z]) * MILLIMETRE)
            end = at[0] > member.length / 2
            if abs(at[0] - member.length * end) > ON_EDGE * thin:
                continue
            # a point a little outside of the edge, along and across
            out = at.copy()
            out[0] += (1 if end else -1) * 0.1 * thin
            if not outline.is_round:
                on_edge = np.abs(np.abs(at[1:]) - half) < ON_EDGE * thin
                out[1:] += np.where(on_edge, np.sign(at[1:]) * 0.1 * thin, 0.0)
            elif np.hypot(*at[1:]) > 0:
                out[1:] *= 1.2
            else:
                out[1] = half[0] * 1.2
            if any(float(host.beyond(member.placed(out))) < 0 for host in hosts):
                edge.hpref = 1
                is_marked = True
    return is_marked


class Lumped:
    """K and M of a part with what is not solid: bodies of mass alone, masses, springs, stacks, partial supports, links.

    Each acts on the mean motion of a patch at the place of its node; what hangs on nothing drawn has six DOFs of its
    own after those of the solid.
    """

    def __init__(self, model: FullOrderModel, part: Part, elements: Elements) -> None:
        self._model, self._part, self._elements = model, part, elements
        self._pieces: Pieces = part.pieces
        self._loose: dict[int, int] = {}  # roots with six DOFs of their own, by their number
        self.notes: list[str] = []
        self._stiffness: list[tuple[sp.csr_matrix, Array]] = []  # of motions B of patches
        self._mass: list[tuple[sp.csr_matrix, Array]] = []
        topology = model.plan.topology
        self._clamped: NDArray[np.bool_] = np.asarray(topology.held.all(axis=1))
        self._join_gaps()
        self._discrete_elements()
        self._supports()
        self.K: sp.csr_matrix = self._with(elements.K, self._stiffness)
        self.M: sp.csr_matrix = self._with(elements.M, self._mass)
        self.is_free: bool = not self._pieces.held and not topology.held.any()

    def _with(self, matrix: sp.csr_matrix, terms: list[tuple[sp.csr_matrix, Array]]) -> sp.csr_matrix:
        """A matrix of the solid with terms B' A B."""
        n = self._elements.dofs + 6 * len(self._loose)
        matrix = _wider(matrix, n, n)
        for motion, A in terms:
            if (tied := len(np.unique(motion.indices))) > MOST_TIED:
                where = "; ".join(self.notes) or "springs, masses and partial supports act on patches that large"
                rule = f"{tied} DOFs would be tied to each other, which takes too much memory"
                raise OptionError(f"{rule}: {where}; let solids touch over a face")
            B = _wider(motion, n)
            matrix = matrix + (B.T @ sp.csr_matrix(A) @ B).tocsr()
        return matrix.tocsr()

    def _discrete_elements(self) -> None:
        model = self._model
        plan, geometry = model.plan, model.geometry
        for name, placed in plan.topology.copies.items():
            part = placed.part
            if part.superelements:
                key = next(iter(part.superelements))
                rule = "a superelement has no form, so that there is no whole solid of it"
                raise ModelError([Problem(("superelements", key), "matrices", rule, "describe its members and bodies")])
            formed = {key for key, (_, body) in part.bodies.items() if body.has_form}
            for element in part.discrete_elements(model.values, geometry.parts[name], None):
                if element.name in formed and element.K is None:
                    continue
                for number, offset, path in zip(placed.number, placed.offset, placed.paths, strict=True):
                    label = ".".join((*path, element.name))
                    rows = [self._motion(offset + node, label) for node in element.nodes]
                    turn = geometry.turning[number]
                    moving = [(k, B) for k, B in enumerate(rows) if B is not None]
                    if not moving:
                        continue
                    at = np.concatenate([6 * k + np.arange(6) for k, _ in moving])
                    X = np.kron(np.eye(len(moving)), turn)
                    width = max(B.shape[1] for _, B in moving)
                    B = sp.vstack([_wider(B, width) for _, B in moving]).tocsr()
                    for matrix, terms in ((element.K, self._stiffness), (element.M, self._mass)):
                        if matrix is not None:
                            terms.append((B, X @ matrix[np.ix_(at, at)] @ X.T))

    def _motion(self, node: int, label: str) -> sp.csr_matrix | None:
        """B (6, n) of a node's motion; None where it is held."""
        model = self._model
        root = int(model.plan.topology.root[node])
        point = model.positions[node]
        anchor = self._anchor(node)
        if anchor is not None:
            centre, B = anchor
            if np.linalg.norm(point - centre) > 0:
                B = sp.csr_matrix(rigid_arm(point - centre)) @ B
            return B
        if self._clamped[root]:
            return None
        if drawn := self._pieces.at_root(root):
            names = ", ".join(self._pieces.all[k].name for k in drawn[:3])
            rule = f"the node lies on what is drawn ({names})"
            hint = "move it there, or let a body that has a solid carry it"
            raise ModelError([Problem((label,), model.plan.topology.node_names[node], rule, hint)])
        n = self._elements.dofs
        if root not in self._loose:
            self._loose[root] = len(self._loose)
            self.notes.append(
                f"{model.plan.topology.node_names[root]}: nothing is drawn there, it moves as a rigid body"
            )
        first = n + 6 * self._loose[root]
        of_root = sp.csr_matrix((np.ones(6), (np.arange(6), first + np.arange(6))), shape=(6, first + 6))
        return sp.csr_matrix(rigid_arm(point - model.positions[root])) @ of_root

    def _anchor(self, node: int) -> tuple[Array, sp.csr_matrix] | None:
        """The patch that a node moves with: on the nearest body of its root, else at a member's end."""
        model, pieces = self._model, self._pieces
        root = int(model.plan.topology.root[node])
        point = model.positions[node]
        name = model.plan.topology.node_names[node]
        numbers = pieces.at_root(root)
        blocks = [k for k in numbers if isinstance(pieces.all[k], Block) and not is_ground(pieces.all[k])]
        if blocks:
            k = min(blocks, key=lambda k: float(pieces.all[k].beyond(point)))
            block = pieces.all[k]
            assert isinstance(block, Block)
            at = block.nearest(point)
            gap = float(np.linalg.norm(at - point))
            if gap > 1e-3 * block.thickness:
                self._note(f"{name}: a rigid arm of {quantity(gap, 'm', 3)} leads to {block.name}")
            return self._patch(k, at)
        ends = [k for k in numbers if not isinstance(pieces.all[k], Block)]
        for k in ends:
            if float(pieces.all[k].beyond(point)) < 1e-3 * pieces.all[k].thickness:
                return self._patch(k, point)
        if root == node and self._clamped[root]:
            return None
        near = [(float(np.linalg.norm(_end_point(pieces, k, root) - point)), k) for k in ends]
        if near and model.plan.topology.is_rigid[node]:
            gap, k = min(near)
            self._note(f"{name}: a rigid arm of {quantity(gap, 'm', 3)} leads to the end of {pieces.all[k].name}")
            return self._patch(k, _end_point(pieces, k, root))
        return None

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)

    def _patch(self, piece: int, point: Array) -> tuple[Array, sp.csr_matrix]:
        solid = self._pieces.all[piece]
        if isinstance(solid, Block):
            radii = np.full(3, float(solid.half.min()))
        else:
            y, z = (float(h[0]) for h in solid.outline.half(solid.local(point)[:1]))
            radii = np.array([min(2 * min(y, z), solid.length / 4), y * 1.01, z * 1.01])
        return point, self._elements.motion(Patch(point, solid.axes, radii))

    def _supports(self) -> None:
        model, topology = self._model, self._model.plan.topology
        for node, mask in clamped_nodes(model).items():
            if all(mask) or not any(mask):
                continue
            B = self._motion(node, "ground")
            if B is None:
                continue
            solids = [self._pieces.all[k] for k in self._pieces.at_root(int(topology.root[node]))]
            thickest = max(solids, key=lambda solid: solid.thickness, default=None)
            stiff = np.full(6, STIFF_ALONE) if thickest is None else _tie_stiffness(thickest)
            self._stiffness.append((B, np.diag(np.where(mask, stiff, 0.0))))
            directions = ", ".join(d for d, h in zip(DOF_NAMES, mask, strict=True) if h)
            self._note(f"{topology.node_names[node]}: its mean motion is held in {directions}")

    def _join_gaps(self) -> None:
        """Tie members' ends that do not touch what they are joined to; raise ModelError where nothing allows it."""
        model, pieces = self._model, self._pieces
        topology = model.plan.topology
        problems = []
        for root in {r for m in pieces.members for r in m.roots}:
            numbers = pieces.at_root(root)
            if len(numbers) < 2:
                continue
            group = {k: k for k in numbers}
            for a, b in combinations(numbers, 2):
                if (min(a, b), max(a, b)) in self._part.touching:
                    group = {k: group[a] if g == group[b] else g for k, g in group.items()}
            if len(set(group.values())) == 1:
                continue
            blocks = [k for k in numbers if isinstance(pieces.all[k], Block)]
            if self._clamped[root] and not any(not is_ground(pieces.all[k]) for k in blocks):
                continue
            main = group[blocks[0]] if blocks else max(group.values(), key=list(group.values()).count)
            for k in numbers:
                if group[k] == main or (isinstance(pieces.all[k], Block) and self._clamped[root]):
                    continue
                piece = pieces.all[k]
                if blocks:
                    self._link(k, root, blocks)
                    group = {j: main if g == group[k] else g for j, g in group.items()}
                    continue
                others = ", ".join(pieces.all[j].name for j in numbers if group[j] == main)
                rule = f"{piece.name} touches what it is joined to ({others})"
                hint = "let its end reach there (offsets, lengths), or put a body with a solid between"
                problems.append(Problem((piece.name,), topology.node_names[root], rule, hint))
        if problems:
            raise ModelError(problems)

    def _link(self, k: int, root: int, blocks: list[int]) -> None:
        """A stiff massless link from an end, or a body, to the body that carries it."""
        pieces = self._pieces
        piece = pieces.all[k]
        at = piece.centre if isinstance(piece, Block) else _end_point(pieces, k, root)
        host = min((j for j in blocks if j != k), key=lambda j: float(pieces.all[j].beyond(at)))
        block = pieces.all[host]
        assert isinstance(block, Block)
        to = block.nearest(at)
        if isinstance(piece, Block):
            at = piece.nearest(to)
        (a, A), (b, B) = self._patch(k, at), self._patch(host, to)
        middle = (at + to) / 2
        A, B = (sp.csr_matrix(rigid_arm(middle - c)) @ X for c, X in ((a, A), (b, B)))
        self._stiffness.append(((A - B).tocsr(), np.diag(_tie_stiffness(piece))))
        gap = 1e3 * float(np.linalg.norm(to - at))
        self._note(f"{piece.name} does not touch {block.name}: a stiff massless link bridges {gap:.3g} mm")


def _tie_stiffness(piece: Piece) -> Array:
    """Stiffness (6,) of a tie that hardly gives beside a piece."""
    width = piece.thickness
    along = STIFF * piece.material.E * width
    return np.array([along] * 3 + [along * width**2] * 3)


def _end_point(pieces: Pieces, k: int, root: int) -> Array:
    """The middle of the end face of a member that moves with a root."""
    member = pieces.all[k]
    assert not isinstance(member, Block)
    return member.end_point(member.roots.index(root))


def _wider(matrix: sp.csr_matrix, n: int, rows: int | None = None) -> sp.csr_matrix:
    """The matrix with columns, and rows if these are given, of zeros up to n columns and so many rows."""
    more = 0 if rows is None else rows - matrix.shape[0]
    starts = np.append(matrix.indptr, np.full(more, matrix.indptr[-1]))
    return sp.csr_matrix((matrix.data, matrix.indices, starts), shape=(matrix.shape[0] + more, n))
