"""Mechanisms with many equal branches, split exactly into small eigenproblems.

In its own frame every one of c equal branches has the same K and M inside. What differs is how it hangs on the rest:
seen as vectors over the copies, the entries that couple a branch to the rest span a space of s dimensions, three in a
ring that carries one body, however large c is. Combinations of the copies in that space move the rest; those orthogonal
to it do not, and are motions of one branch with the rest held, c - s times over (the decomposition by symmetry-adapted
coordinates, Bossavit 1986; Healey and Treacy 1991; theory eqs. Y1-Y3). The problem of order c m + b is thus one of
order s m + b beside one of order m, without any approximation.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.linalg import EPS, Eigenpairs, Pencil, count_below, is_definite, lowest, residuals
from flexura.records import Kept, Record
from flexura.reduction.certificates import Certificate
from flexura.structure import FullOrderModel
from flexura.thresholds import SAME_SIZE

SPLIT_FROM = 5000
"""Smaller models are not worth it."""

SPLIT_GAIN = 4
"""Least ratio of the orders before and after."""

LEAST_COPIES = 8
"""Fewer equal branches are left as they are."""

NARROWEST = 1e-6
"""Least relative distance of the ends of a proven interval of a squared frequency."""

WIDEST_INTERVAL = 0.01

STORED_ROUNDING = 32
"""Units of round-off in an entry of K."""

SPARE_BLOCK_PAIRS = 4
"""Pairs of every problem beyond those asked for."""

COUPLING_RANK = 1e-12
"""Relative size of a singular value of the coupling that is round-off."""


@dataclass(frozen=True, repr=False)
class EqualBranches(Record):
    """Equal branches: DOFs (c, m) inside them, and `space` (c, s), orthonormal, of the combinations that move the rest.

    K, M (m, m) are those of one branch in its own frame with the rest held.
    """

    dofs: Index
    space: Array
    K: sp.csc_matrix
    M: sp.csc_matrix

    @property
    def copies(self) -> int:
        """How many combinations leave the rest at rest."""
        return len(self.space) - self.space.shape[1]

    def apart(self, count: int) -> Array:
        """Orthonormal combinations (c, count) of the copies that leave the rest at rest, at most `copies`."""
        c, s = self.space.shape
        count = min(count, self.copies)
        more = np.cos(np.outer(np.arange(c), 1.0 + np.arange(count)) + np.arange(count) ** 2)
        return np.asarray(la.qr(np.hstack([self.space, more]), mode="economic")[0][:, s : s + count], dtype=np.float64)


@dataclass(frozen=True, repr=False)
class SplitModel(Record):
    """A full-order model as a coupled problem K x = lambda M x over the rest, DOFs `rest` (b,), then s combinations of
    every kind of branch; and beside it the problem of one branch of every kind, `copies` times each.

    `turn` (n, n) takes displacements in the frames of the branches to those of the full-order model.
    """

    _shown = ("model",)

    model: FullOrderModel
    rest: Index
    branches: tuple[EqualBranches, ...]
    turn: sp.csr_matrix
    K: sp.csc_matrix
    M: sp.csc_matrix
    _solved: Kept = field(default_factory=Kept, repr=False, compare=False)

    @property
    def blocks(self) -> list[tuple[Any, Any, int]]:
        """K, M and how often each problem occurs."""
        return [(self.K, self.M, int(self.K.shape[0] > 0)), *((b.K, b.M, b.copies) for b in self.branches)]

    @property
    def summary(self) -> str:
        """What was split, in words."""
        texts = [
            f"{len(b.dofs)} equal branches move the rest in {b.space.shape[1]} combinations" for b in self.branches
        ]
        orders = " and ".join(str(K.shape[0]) for K, _, times in self.blocks if times)
        return f"{'; '.join(texts)}: solved as problems of order {orders}, without approximation"

    def count_below(self, value: float) -> int:
        """Number of eigenvalues of the full-order model below a value, by inertia (theory eq. 55)."""
        return sum(times * count_below(K, M, value) for K, M, times in self.blocks if times)

    def lowest(self, count: int) -> Eigenpairs:
        """The `count` lowest eigenpairs of the full-order model, finite ones only."""
        merged = sorted(
            (float(value), block, k)
            for block, (values, times) in enumerate(self._values(count))
            for k, value in enumerate(np.repeat(values, times)[:count])
        )[:count]
        vectors = np.zeros((self.model.order, len(merged)))
        apart = [branch.apart(count) for branch in self.branches]
        for column, (_, block, k) in enumerate(merged):
            x = self._pairs(block, count).vectors
            if block == 0:
                vectors[:, column] = self._coupled(x[:, k])
            else:
                branch = self.branches[block - 1]
                times = min(count, branch.copies)
                combination = apart[block - 1][:, k % branch.copies % times]
                vectors[branch.dofs, column] = combination[:, None] * x[:, k // branch.copies]
        return Eigenpairs(np.array([value for value, _, _ in merged]), np.asarray(self.turn @ vectors))

    def certificate(self, n: int) -> Certificate:
        """Intervals in which inertia counts find the `n` lowest frequencies, and how many there are up to the last.

        Each interval is as narrow as round-off in K leaves it, and no narrower than `NARROWEST` (theory eq. 55).
        """
        spectrum = [
            np.stack([np.repeat(field, times)[: n + 1] for field in (values, self._uncertain(block, n))])
            for block, (values, times) in enumerate(self._values(n + SPARE_BLOCK_PAIRS))
        ]
        values, margin = (merged := np.hstack(spectrum))[:, np.argsort(merged[0], kind="stable")][:, :n]
        lower, upper, indexed = np.zeros(n), np.full(n, np.inf), np.zeros(n, dtype=bool)
        for k in range(n):
            for wide in (1.0, 10.0, 100.0, 1000.0):
                edge = values[k] * (1 + np.array([-1, 1]) * min(wide * margin[k], WIDEST_INTERVAL))
                if self.count_below(edge[0]) <= k < self.count_below(edge[1]):
                    lower[k], upper[k], indexed[k] = *edge, True
                    break
        beyond = float(values[-1] * (1 + 2 * max(margin[-1], NARROWEST)))
        found = sum(times * int((each < beyond).sum()) for each, times in self._values(n + SPARE_BLOCK_PAIRS))
        hz, low, high, below = (np.sqrt(each) / (2 * np.pi) for each in (values, lower, upper, np.array(beyond)))
        return Certificate(hz, low, high, indexed, float(below), self.count_below(beyond), found)

    def residual(self, n: int) -> float:
        """The largest relative residual of the `n` lowest pairs of every problem, as `flexura.linalg.residuals`."""
        return max(
            float(residuals(Pencil.of(K, M), self._pairs(block, n)).max())
            for block, (K, M, times) in enumerate(self.blocks)
            if times
        )

    def _values(self, count: int) -> list[tuple[Array, int]]:
        """The lowest eigenvalues of every problem, and how often each occurs."""
        return [(self._pairs(block, count).values, times) for block, (_, _, times) in enumerate(self.blocks)]

    def _pairs(self, block: int, count: int) -> Eigenpairs:
        """The lowest pairs of a problem, finite ones only."""

        def solved() -> Eigenpairs:
            K, M, times = self.blocks[block]
            return lowest(K, M, min(count, K.shape[0]) if times else 0).finite

        return self._solved.once((block, count), solved)

    def _uncertain(self, block: int, n: int) -> Array:
        """How far, relative, round-off in K may move the eigenvalues of a problem, at least `NARROWEST`."""
        K, pairs = self.blocks[block][0], self._pairs(block, n + SPARE_BLOCK_PAIRS)
        size = np.abs(pairs.vectors)
        stiff = np.einsum("ik,ik->k", size, abs(K) @ size)  # vectors are M-orthonormal
        return np.maximum(STORED_ROUNDING * EPS * stiff / pairs.values, NARROWEST)

    def _coupled(self, x: Array) -> Array:
        """Displacements of the full-order model, branches in their own frames, from a vector of the coupled problem."""
        whole, at = np.zeros(self.model.order), len(self.rest)
        whole[self.rest] = x[:at]
        for branch in self.branches:
            m, s = branch.dofs.shape[1], branch.space.shape[1]
            whole[branch.dofs] = branch.space @ x[at : at + s * m].reshape(s, m)
            at += s * m
        return whole


def split(model: FullOrderModel) -> SplitModel | None:
    """The full-order model split by its equal branches, the instances at top level; None where that gains nothing."""
    if model.order < SPLIT_FROM:
        return None
    groups = _equal_instances(model)
    if not groups:
        return None
    inside = np.zeros(model.order, dtype=bool)
    for dofs, _ in groups:
        inside[dofs] = True
    rest = np.flatnonzero(~inside)
    if model.order < SPLIT_GAIN * len(rest):
        return None
    turn = _branch_axes(model, groups)
    whole = model.K.T, model.M.T  # they are symmetric: rows from columns
    sides = tuple((turn.T @ A[:, rest]).tocsr() for A in whole)
    branches: list[EqualBranches] = []
    couplings: list[list[Any]] = []
    for dofs, _ in groups:
        axes = turn[dofs[0]][:, dofs[0]]
        K, M = ((axes.T @ A[dofs[0]][:, dofs[0]] @ axes).tocsc() for A in whole)
        if not all(_acts_alike(A, first, dofs, turn) for A, first in ((model.K, K), (model.M, M))):
            return None
        outer = (model.K.diagonal()[rest], model.M.diagonal()[rest])
        space, coupling = _coupling(dofs, sides, (K, M), outer)
        branches.append(EqualBranches(dofs, space, K, M))
        couplings.append(coupling)
    order = len(rest) + sum(branch.space.shape[1] * branch.dofs.shape[1] for branch in branches)
    if model.order < SPLIT_GAIN * order:
        return None
    of_K, of_M = ([coupling[k] for coupling in couplings] for k in range(2))
    K = _assembled(whole[0][rest][:, rest], [branch.K for branch in branches], of_K, branches)
    M = _assembled(whole[1][rest][:, rest], [branch.M for branch in branches], of_M, branches)
    if not is_definite(K):  # something moves freely
        return None
    return SplitModel(model, rest, tuple(branches), turn, K, M)


def _equal_instances(model: FullOrderModel) -> list[tuple[Index, list[int]]]:
    """DOFs (c, m) inside the equal instances at top level, and their numbers among all instances.

    They are equal when their nodes follow each other in the same way and have the same freedoms; those to which
    something at top level or another instance is attached inside are left out, and nodes that are held in part.
    """
    topology = model.plan.topology
    place = {
        path[0]: (offset, number, name)
        for name, placed in topology.copies.items()
        for path, offset, number in zip(placed.paths, placed.offset, placed.number, strict=True)
        if len(path) == 1
    }
    starts = sorted(place.values())
    if len(starts) < LEAST_COPIES:
        return []
    ends = [start for start, _, _ in starts[1:]] + [topology.n_nodes]
    top = starts[0][0]
    touched = np.zeros(topology.n_nodes, dtype=bool)
    touched[topology.root[:top]] = True
    alike: dict[tuple[Any, ...], list[tuple[Index, int]]] = {}
    for (start, number, name), end in zip(starts, ends, strict=True):
        root, dof = topology.root[start:end], topology.dof[start:end]
        foreign = (root >= top) & ((root < start) | (root >= end))
        free = dof >= 0
        partly = free.any(axis=1) & ~free.all(axis=1) & topology.has_position[start:end]
        if foreign.any() or partly.any() or touched[start:end].any() or not free.any():
            continue
        follows = np.where(root < top, -1, root - start)
        key = (name, follows.tobytes(), free.tobytes(), topology.is_rigid[start:end].tobytes())
        alike.setdefault(key, []).append((dof[free], number))
    groups = [group for group in alike.values() if len(group) >= LEAST_COPIES]
    return [(np.array([dofs for dofs, _ in group]), [number for _, number in group]) for group in groups]


def _branch_axes(model: FullOrderModel, groups: list[tuple[Index, list[int]]]) -> sp.csr_matrix:
    """(n, n): displacements in global axes from those in the axes of the branches, which mirroring reverses."""
    topology = model.plan.topology
    rows, columns, values = [], [], []
    dof_node = np.nonzero(topology.dof >= 0)[0]
    turned = np.zeros(model.order, dtype=bool)
    for dofs, numbers in groups:
        Q = model.geometry.Q[numbers]
        placed = dofs[:, topology.has_position[dof_node[dofs[0]]]]
        components = placed.reshape(len(dofs), -1, 2, 3)  # nodes, displacement and rotation
        both = np.stack([Q, np.linalg.det(Q).round()[:, None, None] * Q], axis=1)[:, None]
        shape = (*components.shape, 3)
        rows.append(np.broadcast_to(components[..., :, None], shape).ravel())
        columns.append(np.broadcast_to(components[..., None, :], shape).ravel())
        values.append(np.broadcast_to(both, shape).ravel())
        turned[placed] = True
    still = np.flatnonzero(~turned)
    at = (np.concatenate([*rows, still]), np.concatenate([*columns, still]))
    return sp.csr_matrix((np.concatenate([*values, np.ones(len(still))]), at), shape=(model.order, model.order))


def _acts_alike(A: Any, first: Any, dofs: Index, turn: sp.csr_matrix) -> bool:
    """Whether the inside of every branch acts like `first` (m, m), that of the first, on one and the same motion."""
    motion, whole = np.cos(1.0 + np.arange(dofs.shape[1]) ** 2), np.zeros(A.shape[0])
    whole[dofs] = motion
    acts = (turn.T @ (A @ (turn @ whole)))[dofs]
    return bool((np.abs(acts - first @ motion) <= SAME_SIZE * (abs(first) @ np.abs(motion))).all())


def _coupling(
    dofs: Index, sides: tuple[Any, ...], inner: tuple[Any, Any], outer: tuple[Array, Array]
) -> tuple[Array, list[Any]]:
    """The space (c, s) of combinations of equal branches that couple to the rest, and for K and M the coupling
    (s m, b) of these combinations.

    Singular values of the coupling over the copies, in units of the diagonals, decide what is round-off.
    """
    c, m = dofs.shape
    entries, columns = [], []
    for side, inside, rest in zip(sides, inner, outer, strict=True):
        at = side[dofs.ravel()].tocoo()
        place = (at.row % m) * side.shape[1] + at.col
        kept, number = np.unique(place, return_inverse=True)
        coefficients = np.zeros((c, len(kept)))
        np.add.at(coefficients, (at.row // m, number), at.data)
        size = np.sqrt(np.abs(inside.diagonal()[kept // side.shape[1]] * rest[kept % side.shape[1]]))
        entries.append(coefficients / np.where(size > 0, size, 1.0))
        columns.append((kept, np.where(size > 0, size, 1.0)))
    U, size, _ = la.svd(np.hstack(entries), full_matrices=False)
    space = U[:, size > COUPLING_RANK * size.max(initial=0.0)] if size.size else np.zeros((c, 0))
    s, b = space.shape[1], sides[0].shape[1]
    coupling = []
    for coefficients, (kept, unit) in zip(entries, columns, strict=True):
        values = (space.T @ coefficients) * unit
        row = np.arange(s)[:, None] * m + kept // b
        column = np.broadcast_to(kept % b, row.shape)
        coupling.append(sp.csr_matrix((values.ravel(), (row.ravel(), column.ravel())), shape=(s * m, b)))
    return space, coupling


def _assembled(rest: Any, inner: list[Any], coupling: list[Any], branches: list[EqualBranches]) -> sp.csc_matrix:
    """One matrix of the coupled problem."""
    count = 1 + len(branches)
    blocks: list[list[Any]] = [[None] * count for _ in range(count)]
    blocks[0][0] = rest
    for k, (branch, A, side) in enumerate(zip(branches, inner, coupling, strict=True), 1):
        blocks[k][k] = sp.kron(sp.identity(branch.space.shape[1]), A)
        blocks[k][0], blocks[0][k] = side, side.T
    whole = sp.block_array(blocks).tocsc()
    return ((whole + whole.T) / 2).tocsc()
