"""A mechanism as uniform beam segments between nodes: what every method that solves beams its own way starts from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import UniformBeam
from flexura.errors import OptionError
from flexura.structure.assembly import Scatter, block_diagonal, full_order
from flexura.structure.elements import TAPERED_PIECES, Cut, ElementSlice
from flexura.structure.model import FullOrderModel

FADED = 1e-8
"""Flexibility of a root, beside that of its element, up to which it is rigid: that of a member which slides off its
block fades, and as a spring would cost every other stiffness its digits."""


@dataclass(frozen=True)
class PlacedMember:
    """A member as placed: its name with the path of its instance, e.g. `branch1.hinge`, and its segments, from its
    first end to its second."""

    name: str
    prototype: str
    position: int
    """Place of the member in its prototype's list of members."""
    is_flexure: bool
    segments: range


@dataclass(frozen=True)
class Segments:
    """All placed members cut into uniform segments, and everything else as K and M.

    Segment k is the beam `beam.take(kind[k])`; equal segments share a kind. `dof` (s, 2, 6) numbers the DOFs of its
    ends (-1: held), and `X` (s, 2, 6, 6) takes those DOFs to the displacement of the end in the segment's axes. The
    first `model.order` of all `n` DOFs are those of the full-order model; others belong to cuts inside its elements.
    K, M (n, n) hold springs, superelements, bodies and point masses, and what strips share.
    """

    model: FullOrderModel
    beam: UniformBeam
    kind: Index
    dof: Index
    X: Array
    members: tuple[PlacedMember, ...]
    n: int
    K: sp.csc_matrix
    M: sp.csc_matrix

    def scatter(self) -> Scatter:
        """Where 12 x 12 matrices (s, 12, 12) of the segments, over their DOFs, go in (n, n)."""
        return Scatter([self.dof.reshape(-1, 12)], self.n)

    @property
    def transforms(self) -> Array:
        """T (s, 12, 12): displacements of both ends in segment axes from the segment's DOFs."""
        return block_diagonal(self.X)


def segments(
    model: FullOrderModel, pieces: int = 1, tapered_pieces: int = TAPERED_PIECES, roots: bool = True
) -> Segments:
    """Cut every element of a full-order model into `pieces` uniform segments of equal length.

    Elements that are integrated as tapered become at most `tapered_pieces` times as many, as many as their section
    changes (`Elements.cut`). Elastic roots are springs of K between nodes and ends of segments that have DOFs of their
    own, or left out. Raises OptionError for numbers below one.
    """
    if pieces < 1 or tapered_pieces < 1:
        raise OptionError("an element is cut into at least one piece")
    plan = model.plan
    plan.refuse_loads("beams as exact solutions of their own", model.values)
    beams: list[UniformBeam] = []
    kinds, dofs, ends, members = [], [], [], []
    springs: list[tuple[Index, Array, Array]] = []
    first_kind, first_segment, n = 0, 0, model.order
    for name, matrices in model.matrices.items():
        part, placed = plan.parts[name], plan.topology.copies[name]
        if not len(part.connectivity):
            continue
        assert isinstance(matrices.elements, ElementSlice)
        cut = matrices.elements.cut(pieces, tapered_pieces)
        counts = cut.counts
        beams.append(cut.beam)
        start = np.concatenate([[0], np.cumsum(counts)])
        e = np.repeat(np.arange(len(counts)), counts)
        at_start, at_end = np.zeros(len(e), bool), np.zeros(len(e), bool)
        at_start[start[:-1]], at_end[start[1:] - 1] = True, True
        is_root = _springy(cut, matrices.elements) if roots else np.zeros(cut.root.shape, dtype=bool)
        G = model.design.node_transforms(name, np.arange(part.n_nodes))
        T = matrices.T
        for copy, (path, offset) in enumerate(zip(placed.paths, placed.offset, strict=True)):
            X = np.broadcast_to(np.eye(6), (len(e), 2, 6, 6)).copy()
            dof = np.full((len(e), 2, 6), -1, dtype=np.intp)
            inner = n + np.arange(6 * (~at_end).sum()).reshape(-1, 6)
            dof[~at_end, 1] = dof[~at_start, 0] = inner
            n += inner.size
            nodes = part.connectivity[e]
            for end, here in ((0, at_start), (1, at_end)):
                six, at = slice(6 * end, 6 * end + 6), nodes[here, end]
                X[here, end] = T[e[here], six, six] @ G[copy, at]
                dof[here, end] = plan.topology.dof[plan.topology.root[offset + at]]
                for k in np.flatnonzero(here & is_root[e, end]):
                    inside = n + np.arange(6)
                    springs.append(
                        (np.concatenate([dof[k, end], inside]), X[k, end].copy(), cut.roots[cut.root[e[k], end]])
                    )
                    dof[k, end], X[k, end] = inside, np.eye(6)
                    n += 6
            kinds.append(first_kind + cut.kind)
            dofs.append(dof)
            ends.append(X)
            for k, member in enumerate(part.members):
                span = range(first_segment + start[part.first[k]], first_segment + start[part.first[k + 1]])
                is_flexure = member in plan.layout.prototypes[name].flexures
                members.append(PlacedMember(".".join((*path, member)), name, k, is_flexure, span))
            first_segment += len(e)
        first_kind += len(cut.beam.length)
    K, M = (_enlarged(A, n) for A in full_order(plan).with_shared_warping(model.design))
    K = _with_springs(K, springs)
    if not beams:
        empty = UniformBeam(*(np.empty(0) for _ in UniformBeam._fields))
        return Segments(model, empty, np.empty(0, int), np.empty((0, 2, 6), int), np.empty((0, 2, 6, 6)), (), n, K, M)
    beam = UniformBeam(*(np.concatenate(fields) for fields in zip(*beams, strict=True)))
    kind, dof, X = (np.concatenate(parts) for parts in (kinds, dofs, ends))
    return Segments(model, beam, kind, dof, X, tuple(members), n, K, M)


def _springy(cut: Cut, elements: ElementSlice) -> NDArray[np.bool_]:
    """Which ends (e, 2) of elements have roots that give."""
    least = FADED * elements.member_C.diagonal(axis1=1, axis2=2)
    gives = (
        [(cut.roots[k].diagonal(axis1=1, axis2=2) > least).any(axis=1) for k in cut.root.T] if len(cut.roots) else []
    )
    return np.asarray((cut.root >= 0) & (np.stack(gives, axis=1) if gives else False), dtype=bool)


def _with_springs(K: sp.csc_matrix, springs: list[tuple[Index, Array, Array]]) -> sp.csc_matrix:
    """K with elastic roots: DOFs (12,) of the node and of the segment's end, what takes the former to the latter's axes
    (6, 6), and the flexibility (6, 6) of each."""
    if not springs:
        return K
    T = [np.hstack([-X, np.eye(6)]) for _, X, _ in springs]
    stiffness = [t.T @ np.linalg.solve(C, t) for t, (_, _, C) in zip(T, springs, strict=True)]
    return sp.csc_matrix(
        K + Scatter([np.stack([dof for dof, _, _ in springs])], K.shape[0]).sparse([np.stack(stiffness)])
    )


def _enlarged(A: sp.csc_matrix, n: int) -> sp.csc_matrix:
    """A with empty rows and columns added up to order n."""
    at = A.tocoo()
    return sp.csc_matrix((at.data, (at.row, at.col)), shape=(n, n))
