"""Assembling K, M and damping of the full order from small matrices, with the index work done once for a plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.duals import zeros
from flexura.errors import OptionError
from flexura.kernels import Kernel, address, is_compiled
from flexura.records import Latest
from flexura.sizes import within
from flexura.structure.design import Design
from flexura.structure.part import DiscreteElement
from flexura.structure.plan import Plan

ELEMENTS_AT_ONCE = 512
"""Elements that are placed at a time, so that their arrays stay in the processor's cache."""

MOST_ENTRIES = 2**31 - 1
"""Entries that 32-bit numbers, which factorisations take, can count."""


class Scatter:
    """A fixed pattern of small square matrices, `symmetric` unless said otherwise, at given DOFs; DOF -1 is dropped.

    `dofs` lists index arrays, each (k, m): k matrices of m rows.
    """

    def __init__(self, dofs: Sequence[Index], n: int, *, symmetric: bool = True) -> None:
        self.n = n
        self.symmetric = symmetric
        self._dofs = [np.asarray(d, dtype=np.intp) for d in dofs]
        self._dense_targets: dict[int, Index] = {}

    @cached_property
    def _key(self) -> Index:
        """Column times n plus row of every entry, -1 where one of both is dropped."""
        return np.concatenate([np.empty(0, dtype=np.intp), *(_keys(d, self.n) for d in self._dofs)])

    @cached_property
    def _sums(self) -> _Sorted | _Columns:
        entries = sum(count * width**2 for count, width in (d.shape for d in self._dofs))
        if entries > MOST_ENTRIES:
            raise OptionError(
                f"{entries:.3g} entries of small matrices are more than the {MOST_ENTRIES:.3g} of a sparse sum"
            )
        return (_Columns if is_compiled() else _Sorted)(self._dofs, self.n)

    @cached_property
    def _is_identity(self) -> bool:
        n = self.n
        return len(self._key) == n * n and np.array_equal(self._key.reshape(n, n).T.ravel(), np.arange(n * n))

    def sparse(self, matrices: Sequence[Array], *, symmetric: bool | None = None) -> sp.csc_matrix:
        """Sum matrices, one array (..., m, m) per entry of `dofs`, into a sparse (n, n), symmetric ones exactly so; of
        others the symmetric part where that is asked for."""
        sums = self._sums
        # arrays of its own: whoever holds the matrix may change its pattern
        numbers = sums.of(matrices, self.symmetric if symmetric is None else symmetric)
        stored = numbers, sums.rows.copy(), sums.start.copy()
        A = sp.csc_matrix(stored, shape=(self.n, self.n))
        A.has_canonical_format = True
        return A

    def dense(self, matrices: Sequence[Any], lead: tuple[int, ...] = ()) -> Any:
        """Sum matrices, one array (*lead, k, m, m) per entry of `dofs`, into dense (*lead, n, n)."""
        n = self.n
        within("dense_entries", n * n, f"a full matrix of order {n}")
        if any(np.iscomplexobj(m) for m in matrices):
            real, imaginary = (self.dense([part(m) for m in matrices], lead) for part in (np.real, np.imag))
            return real + 1j * imaginary
        if self._is_identity:
            only = matrices[0][..., 0, :, :]
            return only if only.shape[:-2] == lead else np.broadcast_to(only, (*lead, n, n))
        designs, size = math.prod(lead), n * n + 1
        each = [np.broadcast_to(m, (*lead, *m.shape[-3:])).reshape(designs, math.prod(m.shape[-3:]))
                for m in matrices]  # fmt: skip
        data = np.concatenate([np.empty((designs, 0)), *each], axis=1)
        summed = np.bincount(self._dense_target(designs), weights=data.ravel(), minlength=designs * size)
        whole = summed.astype(float, copy=False).reshape(designs, size)[:, :-1].reshape(*lead, n, n)
        return whole if self.symmetric else np.swapaxes(whole, -1, -2)  # columns were summed as rows

    def _dense_target(self, designs: int) -> Index:
        """Where the entries of so many designs go in stacked matrices, each one longer to take what is dropped."""
        if designs not in self._dense_targets:
            place = np.where(self._key < 0, self.n**2, self._key)
            self._dense_targets[designs] = (np.arange(designs)[:, None] * (self.n**2 + 1) + place).ravel()
        return self._dense_targets[designs]


def _keys(dofs: Index, n: int) -> Index:
    """Column times n plus row of every entry (k m m,) of matrices at DOFs (k, m), -1 where one of both is dropped."""
    row, column = dofs[:, :, None], dofs[:, None, :]
    return np.where((row >= 0) & (column >= 0), column * n + row, -1).ravel()


class _Sorted:
    """Sparse sums of matrices at DOFs: their rows by column, the first of each in `start`, and their numbers."""

    def __init__(self, dofs: Sequence[Index], n: int) -> None:
        key = np.concatenate([np.empty(0, dtype=np.intp), *(_keys(d, n) for d in dofs)])
        unique, self._target = np.unique(np.where(key < 0, n * n, key), return_inverse=True)
        unique = unique[unique < n * n]
        column, row = np.divmod(unique, max(n, 1))
        self.start, self.rows = (a.astype(np.int32) for a in (np.searchsorted(unique, np.arange(n + 1) * n), row))
        self._across = np.lexsort((column, row))

    def of(self, matrices: Sequence[Array], symmetric: bool) -> Array:
        """The numbers of a sum, or of its symmetric part, one for each row that is stored."""
        data = np.concatenate([np.zeros(0), *(m.ravel() for m in matrices)])
        summed: Array = np.bincount(self._target, weights=data, minlength=len(self.rows) + 1).astype(float, copy=False)
        summed = summed[: len(self.rows)]
        return (summed + summed[self._across]) / 2 if symmetric else summed


_columns = Kernel("columns", "nnaaaa")
_pattern = Kernel("pattern", "n" + 8 * "a")
_pattern_sum = Kernel("pattern_sum", "n" + 8 * "a" + "naaa")


class _Columns:
    """The same column by column, by kernels."""

    def __init__(self, dofs: Sequence[Index], n: int) -> None:
        self._n, self._shapes = n, [d.shape for d in dofs]
        shapes = np.array(self._shapes, dtype=np.int64).reshape(-1, 2)
        before = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(shapes.prod(axis=1))])
        flat = np.concatenate([np.empty(0, dtype=np.int64), *(d.ravel() for d in dofs)])
        first, touching = np.empty(n + 1, dtype=np.int64), np.empty((len(flat), 2), dtype=np.int64)
        _columns(n, len(shapes), shapes, flat, first, touching)
        most = int(shapes.prod(axis=1) @ shapes[:, 1])
        start, rows = (np.empty(size // 2 + 1, dtype=np.int64) for size in (n + 1, most))
        parts = shapes, before, flat, first, touching
        stored = _pattern(n, *parts, start, rows, np.empty(n, dtype=np.int64))
        self.start, self.rows = start.view(np.int32)[: n + 1], rows.view(np.int32)[:stored]
        self._kept = *parts, start, rows

    def of(self, matrices: Sequence[Array], symmetric: bool) -> Array:
        """The numbers of a sum, or of its symmetric part, one for each row that is stored."""
        A = [np.ascontiguousarray(m, dtype=float) for m in matrices]
        if [math.prod(m.shape) for m in A] != [count * width**2 for count, width in self._shapes]:
            raise ValueError(f"matrices {[m.shape for m in A]} at DOFs {self._shapes}")
        out, sums = np.empty(len(self.rows)), np.empty(self._n)
        at = np.array([address(m) for m in A], dtype=np.int64)
        _pattern_sum(self._n, *self._kept, at, symmetric, out, sums, np.empty(self._n, dtype=np.int64))
        return out


def node_dofs(nodes: Any) -> Index:
    """Numbers (..., 6k) of the displacements of nodes (..., k), six each in their order."""
    at = np.asarray(nodes, dtype=np.intp)
    return (6 * at[..., None] + np.arange(6)).reshape(*at.shape[:-1], 6 * at.shape[-1])


def block_diagonal(blocks: Array) -> Array:
    """Blocks (..., k, 6, 6) on the diagonal of (..., 6k, 6k)."""
    k = blocks.shape[-3]
    out = np.zeros((*blocks.shape[:-3], 6 * k, 6 * k), like=blocks)
    for i in range(k):
        out[..., 6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = blocks[..., i, :, :]
    return out


def _placed(K: Array, G: Array) -> Array:
    """K (..., 6k, 6k) over nodes with the transforms G (copies, ..., k, 6, 6), over their roots."""
    T = block_diagonal(G)
    return np.swapaxes(T, -1, -2) @ K @ T


class Triplets:
    """Entries of a sparse matrix of given shape; equal places are summed, rows and columns below zero dropped."""

    def __init__(self, rows: int, columns: int) -> None:
        self.shape: tuple[int, int] = (rows, columns)
        self._rows: list[Index] = []
        self._columns: list[Index] = []
        self._values: list[Array] = []

    def add(self, rows: Index, columns: Index, blocks: Array) -> None:
        """Add blocks (..., r, c) at rows (..., r) and columns (..., c)."""
        row = np.broadcast_to(rows[..., :, None], blocks.shape)
        column = np.broadcast_to(columns[..., None, :], blocks.shape)
        taken = (row >= 0) & (column >= 0) & (blocks != 0)
        self._rows.append(row[taken])
        self._columns.append(column[taken])
        self._values.append(blocks[taken])

    def matrix(self) -> sp.csc_matrix:
        """The sum."""
        rows = np.concatenate([np.empty(0, dtype=np.intp), *self._rows])
        columns = np.concatenate([np.empty(0, dtype=np.intp), *self._columns])
        return sp.csc_matrix((np.concatenate([np.empty(0), *self._values]), (rows, columns)), shape=self.shape)


class FullOrderAssembler:
    """Assembles K and M of a plan (theory eq. 38); the index work is done once."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._names = [name for name, part in plan.parts.items() if part.has_matrices]
        topology = plan.topology
        self._dofs = {name: topology.dof[topology.root[topology.copies[name].numbers()]] for name in self._names}
        """DOF numbers (i, nodes, 6) of the roots of all nodes of placed copies, by prototype."""
        members = [_dofs(self._dofs[name], plan.parts[name].connectivity) for name in self._names]
        discrete_elements = [
            (_dofs(self._dofs[name], np.array([nodes])), has_K, has_M)
            for name in self._names
            for nodes, has_K, has_M in plan.parts[name].discrete_nodes()
        ]
        n = plan.topology.n_dof
        stiff, massive = (
            [dofs for dofs, has_K, _ in discrete_elements if has_K],
            [dofs for dofs, _, has_M in discrete_elements if has_M],
        )
        strips = [_dofs(self._dofs[name], nodes) for name in self._names for nodes in plan.parts[name].strips]
        self._stiffness = Scatter([*members, *stiff, *strips], n)
        same = not strips and all(has_K and has_M for _, has_K, has_M in discrete_elements)
        self._mass = self._stiffness if same else Scatter([*members, *massive], n)
        self._discrete_stiffness, self._discrete_mass = Scatter(stiff, n), Scatter(massive, n)
        self._transformed: Latest[dict[str, Array]] = Latest()

    def elastic(self, design: Design) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K (N/m, N, N m) and M (kg, kg m, kg m^2), both (n, n), of one design without any load."""
        transforms, matrices = self.transforms(design), design.matrices
        discrete_K, discrete_M = self._discrete(
            {name: part.discrete_elements for name, part in matrices.items()}, transforms
        )
        K: list[Array] = []
        M: list[Array] = []
        strips: list[Array] = []
        for name, G in transforms.items():
            elements = matrices[name].elements
            for kind, placed in zip(
                (K, M), self._elements(name, G, matrices[name].T, elements.K, elements.M), strict=True
            ):
                kind.append(placed)
            strips += [_placed(strip.K, G[:, strip.nodes]) for strip in matrices[name].strips]
        stiffness = self._stiffness.sparse([*K, *discrete_K, *strips])
        K.clear()  # memory for the sum of masses
        return stiffness, self._mass.sparse([*M, *discrete_M])

    def discrete_matrices(self, design: Design) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K and M (n, n) of springs, superelements, bodies and point masses alone."""
        discrete_K, discrete_M = self._discrete(design.discrete_elements, self.transforms(design))
        return self._discrete_stiffness.sparse(discrete_K), self._discrete_mass.sparse(discrete_M)

    def with_shared_warping(self, design: Design) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """The same, with what strips add to the stiffness of their elements; one design."""
        dofs, added = list[Index](), list[Array]()
        for name, G in self.transforms(design).items():
            for strips in design.matrices[name].strips:
                dofs.append(_dofs(self._dofs[name], strips.nodes))
                added.append(_placed(strips.K, G[:, strips.nodes]))
        K, M = self.discrete_matrices(design)
        return sp.csc_matrix(K + Scatter(dofs, self.plan.topology.n_dof).sparse(added)), M

    def dissipation(self, design: Design, default: float = 0.0) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """C (N s/m, N s, N m s) of dashpots and H (N/m, N, N m) of structural damping, K + i H, both (n, n).

        H sums the stiffness of every part times its loss factor, `default` where it has none (theory eq. T5). One
        design.
        """
        values, matrices = design.values, design.matrices
        C: list[Array] = []
        H: list[Array] = []
        discrete_elements: list[Array] = []
        strips: list[Array] = []
        places: list[Index] = []
        for name, G in self.transforms(design).items():
            part, part_matrices = self.plan.parts[name], matrices[name]
            eta = part.table.loss_factors(values, default)
            H += self._elements(name, G, part_matrices.T, eta[:, None, None] * part_matrices.elements.K)
            for strip in part_matrices.strips:
                strips.append(_placed(eta[strip.elements[:, 0], None, None] * strip.K, G[:, strip.nodes]))
            for discrete, loss in zip(
                part_matrices.discrete_elements, part.discrete_losses(values, default), strict=True
            ):
                if discrete.K is not None:
                    discrete_elements.append(_placed(loss * discrete.K, G[:, discrete.nodes]))
            for dashpot, matrix in zip(
                part.dashpots.values(), part.dashpot_matrices(values, design.geometry.parts[name]), strict=True
            ):
                C.append(_placed(matrix, G[:, dashpot.nodes]))
                places.append(_dofs(self._dofs[name], np.array([dashpot.nodes])))
        return Scatter(places, self.plan.topology.n_dof).sparse(C), self._stiffness.sparse(
            [*H, *discrete_elements, *strips]
        )

    def base_inertia_forces(self, design: Design) -> Array:
        """Forces (n, 6) on the DOFs that it takes to accelerate everything, what is held included, in unit rigid
        motions of and about the global origin: kg, kg m, kg m^2. One design.

        This is M times `rigid_body_motions` and, beside it, the inertia of members between free and held nodes.
        """
        topology, forces = self.plan.topology, zeros((self.plan.topology.n_dof + 1, 6), design.values)
        for name, G in self.transforms(design).items():
            part, part_matrices = self.plan.parts[name], design.matrices[name]
            number = topology.copies[name].numbers()
            rigid = rigid_arm(design.geometry.positions[topology.root[number]])
            rigid[~topology.has_position[number]] = 0.0
            groups = [(part.connectivity, part_matrices.T, part_matrices.elements.M)]
            groups += [
                (np.array([u.nodes]), np.eye(6 * len(u.nodes)), u.M)
                for u in part_matrices.discrete_elements
                if u.M is not None
            ]
            for nodes, turn, M in groups:
                T = turn @ block_diagonal(G[:, nodes])
                force = np.swapaxes(T, -1, -2) @ (M @ (T @ rigid[:, nodes].reshape(*T.shape[:-1], 6)))
                np.add.at(forces, self._dofs[name][:, nodes].reshape(T.shape[:-1]), force)
        return forces[:-1]

    def transforms(self, design: Design) -> dict[str, Array]:
        """Transforms of all nodes by prototype (`Design.node_transforms`), kept while the geometry stays the same."""

        def found() -> dict[str, Array]:
            count = {name: self.plan.parts[name].n_nodes for name in self._names}
            return {name: design.node_transforms(name, np.arange(n)) for name, n in count.items()}

        return self._transformed.get(design.geometry, found)

    def _elements(self, name: str, G: Array, turn: Array, *given: Array) -> list[Array]:
        """Matrices (e, 12, 12) of the elements of a part over their roots (copies, e, 12, 12), some copies at a time:
        what memory is had for once stays in use."""
        nodes = self.plan.parts[name].connectivity
        out = [np.empty((len(G), *A.shape)) for A in given]
        some = max(ELEMENTS_AT_ONCE // max(len(nodes), 1), 1)
        for start in range(0, len(G), some):
            T = turn @ block_diagonal(G[start : start + some, nodes])
            for A, placed in zip(given, out, strict=True):
                np.matmul(np.swapaxes(T, -1, -2) @ A, T, out=placed[start : start + some])
        return out

    @staticmethod
    def _discrete(
        discrete_elements: dict[str, list[DiscreteElement]], transforms: dict[str, Array]
    ) -> tuple[list[Array], list[Array]]:
        K: list[Array] = []
        M: list[Array] = []
        for name, own_elements in discrete_elements.items():
            for discrete in own_elements:
                T = block_diagonal(transforms[name][:, discrete.nodes])
                for out, matrix in ((K, discrete.K), (M, discrete.M)):
                    if matrix is not None:
                        out.append(np.swapaxes(T, -1, -2) @ matrix @ T)
        return K, M


def _dofs(dof: Index, nodes: Index) -> Index:
    """DOFs (i * elements, 6 * ends) of elements over `nodes` (elements, ends) in all copies."""
    return dof[:, nodes].reshape(-1, 6 * nodes.shape[-1])


def full_order(plan: Plan) -> FullOrderAssembler:
    """The prepared full-order assembly of a plan, made on first use and kept with the plan."""
    return plan.prepared.once("full_order", lambda: FullOrderAssembler(plan))
