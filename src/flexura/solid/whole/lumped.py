"""What of a part is not solid: bodies of mass alone, masses, springs, stacks, partial supports, links over gaps."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.errors import ModelError, Problem
from flexura.mechanism import DOF_NAMES
from flexura.solid.whole.elements import Elements, Patch
from flexura.solid.whole.pieces import Block, Pieces, beyond, clamped_nodes, is_ground, thickness
from flexura.solid.whole.shapes import Part
from flexura.structure import FullOrderModel
from flexura.tables import quantity

STIFF = 1e3
"""Stiffness of what ties mean motions, over that of a cube of the material as wide as the patch."""


class Lumped:
    """K and M of a part with what is not solid: bodies of mass alone, masses, springs, stacks, partial supports, links.

    Each acts on the mean motion of a patch at the place of its node; what hangs on nothing drawn has six DOFs of its
    own after those of the solid.
    """

    def __init__(self, model: FullOrderModel, part: Part, elements: Elements) -> None:
        self._model, self._part, self._elements = model, part, elements
        self._pieces: Pieces = part.pieces
        self._own: dict[int, int] = {}
        self.notes: list[str] = []
        self._terms: list[tuple[sp.csr_matrix, Array, bool]] = []
        topology = model.plan.topology
        self._clamped: NDArray[np.bool_] = np.asarray(topology.held.all(axis=1))
        self._join_gaps()
        self._discrete_elements()
        self._supports()
        n = elements.dofs + 6 * len(self._own)
        K, M = (_wider(matrix, n, n) for matrix in (elements.K, elements.M))
        for own, matrix, is_stiffness in self._terms:
            B = _wider(own, n)
            added = (B.T @ sp.csr_matrix(matrix) @ B).tocsr()
            if is_stiffness:
                K = K + added
            else:
                M = M + added
        self.K: sp.csr_matrix = K.tocsr()
        self.M: sp.csr_matrix = M.tocsr()
        self.is_free: bool = not self._pieces.held and not topology.held.any()

    def _names(self, piece: int) -> str:
        return self._pieces.all[piece].name

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
            for element in part.discrete_elements(model.values, geometry.parts[name]):
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
                    for matrix, is_stiffness in ((element.K, True), (element.M, False)):
                        if matrix is not None:
                            own = X @ matrix[np.ix_(at, at)] @ X.T
                            self._terms.append((B, own, is_stiffness))

    def _motion(self, node: int, label: str) -> sp.csr_matrix | None:
        """B (6, n) of a node's motion; None where it is held."""
        model = self._model
        root = int(model.plan.topology.root[node])
        point = model.positions[node]
        found = self._anchor(node)
        if found is not None:
            centre, B = found
            if np.linalg.norm(point - centre) > 0:
                B = sp.csr_matrix(rigid_arm(point - centre)) @ B
            return B
        if self._clamped[root]:
            return None
        if self._pieces.at_root(root):
            names = ", ".join(self._names(k) for k in self._pieces.at_root(root)[:3])
            rule = f"the node lies on what is drawn ({names})"
            hint = "move it there, or let a body that has a solid carry it"
            raise ModelError([Problem((label,), model.plan.topology.node_names[node], rule, hint)])
        n = self._elements.dofs
        if root not in self._own:
            self._own[root] = len(self._own)
            self.notes.append(
                f"{model.plan.topology.node_names[root]}: nothing is drawn there, it moves as a rigid body"
            )
        first = n + 6 * self._own[root]
        own = sp.csr_matrix((np.ones(6), (np.arange(6), first + np.arange(6))), shape=(6, first + 6))
        return sp.csr_matrix(rigid_arm(point - model.positions[root])) @ own

    def _anchor(self, node: int) -> tuple[Array, sp.csr_matrix] | None:
        """The patch that a node moves with: on the nearest body of its root, else at a member's end."""
        model, pieces = self._model, self._pieces
        root = int(model.plan.topology.root[node])
        point = model.positions[node]
        own = pieces.at_root(root)
        blocks = [k for k in own if isinstance(pieces.all[k], Block) and not is_ground(pieces.all[k])]
        if blocks:
            k = min(blocks, key=lambda k: float(beyond(pieces.all[k], point[None])[0]))
            block = pieces.all[k]
            assert isinstance(block, Block)
            at = block.nearest(point)
            gap = float(np.linalg.norm(at - point))
            if gap > 1e-3 * block.thin:
                self._note(
                    f"{model.plan.topology.node_names[node]}: a rigid arm of {quantity(gap, 'm', 3)} leads to"
                    f" {block.name}"
                )
            return self._patch(k, at)
        ends = [k for k in own if not isinstance(pieces.all[k], Block)]
        for k in ends:
            if float(beyond(pieces.all[k], point[None])[0]) < 1e-3 * thickness(pieces.all[k]):
                return self._patch(k, point)
        if root == node and self._clamped[root]:
            return None
        near = [(float(np.linalg.norm(_end_point(pieces, k, root) - point)), k) for k in ends]
        if near and self._is_carried(node):
            gap, k = min(near)
            name = model.plan.topology.node_names[node]
            self._note(f"{name}: a rigid arm of {quantity(gap, 'm', 3)} leads to the end of {self._names(k)}")
            return self._patch(k, _end_point(pieces, k, root))
        return None

    def _is_carried(self, node: int) -> bool:
        return bool(self._model.plan.topology.is_rigid[node])

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)

    def _patch(self, piece: int, point: Array) -> tuple[Array, sp.csr_matrix]:
        own = self._pieces.all[piece]
        if isinstance(own, Block):
            axes, radii = own.axes, np.full(3, float(own.half.min()))
        else:
            y, z = (float(h[0]) for h in own.outline.half(own.local(point)[:1]))
            axes, radii = own.axes, np.array([min(2 * min(y, z), own.length / 4), y * 1.01, z * 1.01])
        return point, self._elements.motion(Patch(point, axes, radii))

    def _supports(self) -> None:
        model, topology = self._model, self._model.plan.topology
        for node, mask in clamped_nodes(model).items():
            if all(mask) or not any(mask):
                continue
            B = self._motion(node, "ground")
            if B is None:
                continue
            stiff = self._stiffness_at(node)
            self._terms.append((B, np.diag(np.where(mask, stiff, 0.0)), True))
            directions = ", ".join(d for d, h in zip(DOF_NAMES, mask, strict=True) if h)
            self._note(f"{topology.node_names[node]}: its mean motion is held in {directions}")

    def _stiffness_at(self, node: int) -> Array:
        """Stiffness (6,) of a tie that hardly gives beside the pieces at a node."""
        own = self._pieces.at_root(int(self._model.plan.topology.root[node]))
        if not own:
            return np.full(6, 1e12)
        piece = max((self._pieces.all[k] for k in own), key=thickness)
        width = thickness(piece)
        along = STIFF * piece.material.E * width
        return np.array([along] * 3 + [along * width**2] * 3)

    def _join_gaps(self) -> None:
        """Tie members' ends that do not touch what they are joined to; raise ModelError where nothing allows it."""
        model, pieces = self._model, self._pieces
        topology = model.plan.topology
        problems = []
        for root in {r for m in pieces.members for r in m.roots}:
            own = pieces.at_root(root)
            if len(own) < 2:
                continue
            group = {k: k for k in own}
            for a in own:
                for b in own:
                    if (min(a, b), max(a, b)) in self._part.touching:
                        group = {k: group[a] if g == group[b] else g for k, g in group.items()}
            if len(set(group.values())) == 1:
                continue
            blocks = [k for k in own if isinstance(pieces.all[k], Block)]
            if self._clamped[root] and not any(not is_ground(pieces.all[k]) for k in blocks):
                continue
            main = group[blocks[0]] if blocks else max(group.values(), key=list(group.values()).count)
            for k in own:
                if group[k] == main or (isinstance(pieces.all[k], Block) and self._clamped[root]):
                    continue
                piece = pieces.all[k]
                if blocks:
                    self._link(k, root, blocks)
                    group = {j: main if g == group[k] else g for j, g in group.items()}
                    continue
                others = ", ".join(self._names(j) for j in own if group[j] == main)
                rule = f"{piece.name} touches what it is joined to ({others})"
                hint = "let its end reach there (offsets, lengths), or put a body with a solid between"
                problems.append(Problem((piece.name,), topology.node_names[root], rule, hint))
        if problems:
            raise ModelError(problems)

    def _link(self, k: int, root: int, blocks: list[int]) -> None:
        """A stiff massless link from an end, or a body, to the body that carries it."""
        pieces = self._pieces
        own = pieces.all[k]
        at = own.centre if isinstance(own, Block) else _end_point(pieces, k, root)
        host = min((j for j in blocks if j != k), key=lambda j: float(beyond(pieces.all[j], at[None])[0]))
        block = pieces.all[host]
        assert isinstance(block, Block)
        to = block.nearest(at)
        if isinstance(own, Block):
            at = own.nearest(to)
        (a, A), (b, B) = self._patch(k, at), self._patch(host, to)
        middle = (at + to) / 2
        A, B = (sp.csr_matrix(rigid_arm(middle - c)) @ X for c, X in ((a, A), (b, B)))
        width = thickness(own)
        along = STIFF * own.material.E * width
        self._terms.append(((A - B).tocsr(), np.diag([along] * 3 + [along * width**2] * 3), True))
        gap = 1e3 * float(np.linalg.norm(to - at))
        self._note(f"{own.name} does not touch {block.name}: a stiff massless link bridges {gap:.3g} mm")


def _end_point(pieces: Pieces, k: int, root: int) -> Array:
    """The middle of the end face of a member that moves with a root."""
    member = pieces.all[k]
    assert not isinstance(member, Block)
    end = member.roots.index(root)
    return member.placed(np.array([member.length * end, 0.0, 0.0]))


def _wider(matrix: sp.csr_matrix, n: int, rows: int | None = None) -> sp.csr_matrix:
    """The matrix with columns, and rows if these are given, of zeros up to n columns and so many rows."""
    more = 0 if rows is None else rows - matrix.shape[0]
    starts = np.append(matrix.indptr, np.full(more, matrix.indptr[-1]))
    return sp.csr_matrix((matrix.data, matrix.indices, starts), shape=(matrix.shape[0] + more, n))
