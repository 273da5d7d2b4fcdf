"""Distributed beam finite elements at any refinement, in coordinates that keep their digits.

Every element of the full-order model is cut into equal pieces. The displacements along a serial chain are split into
the static shape that its ends impose and the rest, which is zero at the ends; the two do not share any strain energy
(theory eqs. L1-L2). Eigenvalues are those of the usual nodal coordinates, without the round-off of short stiff elements
in the stiffness that holds the mechanism together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.errors import OptionError
from flexura.linalg import lowest
from flexura.methods.chains import SegmentChains, segment_chains
from flexura.methods.solution import Solution
from flexura.methods.triplets import Triplets
from flexura.reduction.chain import find_chains
from flexura.structure.full_order import FullOrderModel
from flexura.structure.members import TAPERED_PIECES
from flexura.structure.slots import Index

Array = NDArray[np.float64]

NOISE = 1e-9
"""Relative differences of frequencies below this may be round-off: no order is observed from them."""


@dataclass(frozen=True)
class ChainedModel:
    """K and M (n, n), sparse, of the refined mesh: DOFs of chain ends and lumps, then displacements of the segment ends
    within chains relative to their static shape, in segment axes.

    `position` (full order,) is the coordinate of every full-order DOF, -1 within chains; `first` is the first
    coordinate of every set of chains.
    """

    model: FullOrderModel
    chains: list[SegmentChains]
    first: list[int]
    position: Index
    K: sp.csc_matrix
    M: sp.csc_matrix

    def recover(self, vectors: Array) -> Array:
        """Full-order DOF vectors (full order, k) for vectors (n, k) of the coordinates."""
        topology = self.model.plan.topology
        full = np.zeros((len(self.position), vectors.shape[1]))
        full[self.position >= 0] = vectors[self.position[self.position >= 0]]
        padded = np.concatenate([full, np.zeros((1, full.shape[1]))])
        for own, first in zip(self.chains, self.first, strict=True):
            number = own.numbers(self.model)
            if number.shape[2] == 2:
                continue
            ends = padded[topology.dof[topology.root[number[:, :, [0, -1]]]]].reshape(*number.shape[:2], 12, -1)
            twists = own.interior_twists @ (own.transforms(self.model) @ ends)[:, :, None]
            inner = vectors[_inner(own, first, len(number))]
            at = own.passed[:, 1:-1] - 1
            relative = inner[:, np.arange(len(at))[:, None], at]
            twists = twists + np.linalg.inv(_far(own)[np.arange(len(at))[:, None], at]) @ relative
            full[topology.dof[number[:, :, 1:-1]]] = own.outward(self.model) @ twists
        return full


def _far(own: SegmentChains) -> Array:
    """X (c, s - 1, 6, 6) from the twist of a segment end within the chain to its displacement, in the axes of the
    segment before it."""
    return own.X[:, :-1, 6:]


def _inner(own: SegmentChains, first: int, copies: int) -> Index:
    """Coordinates (copies, c, s - 1, 6) of the segment ends within chains."""
    c, s = own.X.shape[:2]
    return first + np.arange(copies * c * (s - 1) * 6).reshape(copies, c, s - 1, 6)


def chained(model: FullOrderModel, pieces: int = 1, tapered_pieces: int = TAPERED_PIECES) -> ChainedModel:
    """The full-order model with every element cut into `pieces`, in relative coordinates of its serial chains.

    Tapered elements stand as at most `tapered_pieces` uniform ones, each cut into `pieces` (`Elements.cut`). Raises
    OptionError for numbers below one.
    """
    plan = model.plan
    chains = [
        own
        for name in model.matrices
        if len(plan.parts[name].connectivity)
        for own in segment_chains(model, name, find_chains(plan.parts[name]), pieces, tapered_pieces)
    ]
    within = np.zeros(model.order, dtype=bool)
    for own in chains:
        within[plan.topology.dof[own.numbers(model)[:, :, 1:-1]]] = True
    position = np.where(within, -1, np.cumsum(~within) - 1)
    first, n = [], int((~within).sum())
    for own in chains:
        first.append(n)
        n += len(own.numbers(model)) * own.X.shape[0] * (own.X.shape[1] - 1) * 6
    K, M = Triplets(n, n), Triplets(n, n)
    kept = np.flatnonzero(~within)
    for lumped, out in zip(plan.full_order.lumped(model.values, model.geometry), (K, M), strict=True):
        entries = lumped[kept][:, kept].tocoo()
        row, column = (np.asarray(at, dtype=np.intp)[:, None] for at in (entries.row, entries.col))
        out.add(row, column, entries.data[:, None, None])
    for own, start in zip(chains, first, strict=True):
        _add_chains(model, own, start, position, K, M)
    return ChainedModel(model, chains, first, position, K.matrix(), M.matrix())


def _add_chains(
    model: FullOrderModel, own: SegmentChains, first: int, position: Index, K: Triplets, M: Triplets
) -> None:
    """Add K and M of all copies of equal chains."""
    topology, number = model.plan.topology, own.numbers(model)
    dof = topology.dof[topology.root[number[:, :, [0, -1]]]].reshape(*number.shape[:2], 12)
    ends = np.where(dof >= 0, position[dof], -1)
    G = own.transforms(model)
    Gt = np.swapaxes(G, -1, -2)
    # displacements of a segment's ends: V for those of the chain's ends, S for its own two relative displacements
    P = np.concatenate([own.shares[:, :-1], own.shares[:, 1:]], axis=-2)
    V = np.concatenate([own.X, np.zeros_like(own.X)], axis=-1)
    V[..., :6, 6:] = own.X[..., :6, :] @ P[..., :6, :]
    V[..., 6:, 6:] = own.X[..., 6:, :] @ P[..., 6:, :]
    V = V @ own.ends[:, None]
    S = np.broadcast_to(np.eye(12), own.m.shape).copy()
    S[:, 1:, :6, :6] = own.X[:, 1:, :6] @ np.linalg.inv(_far(own))
    mV, St = own.m @ V, np.swapaxes(S, -1, -2)
    K.add(ends, ends, Gt @ own.end_stiffness @ G)
    M.add(ends, ends, Gt @ np.einsum("csij,csik->cjk", V, mV) @ G)
    if own.X.shape[1] == 1:
        return
    inner = _inner(own, first, len(number))
    pad = np.full((*inner.shape[:2], 1, 6), -1)
    both = np.concatenate([np.concatenate([pad, inner], axis=2), np.concatenate([inner, pad], axis=2)], axis=-1)
    K.add(both, both, np.broadcast_to(St @ own.k @ S, (len(number), *own.k.shape)))
    M.add(both, both, np.broadcast_to(St @ own.m @ S, (len(number), *own.m.shape)))
    coupling = St @ mV
    at_end = coupling[:, :-1, 6:] + coupling[:, 1:, :6]
    at_end, ends = at_end @ G[:, :, None], np.broadcast_to(ends[:, :, None], (*inner.shape[:3], 12))
    M.add(inner, ends, at_end)
    M.add(ends, inner, np.swapaxes(at_end, -1, -2))


def finite_elements(model: FullOrderModel, count: int, pieces: int = 1) -> Solution:
    """The `count` lowest natural frequencies with every element of the full-order model cut into `pieces`.

    Consistent mass matrices (theory eqs. 15, 19); a tapered element stands as up to 16 uniform ones, each cut so.
    Frequencies converge from above to those of the exact dynamic stiffness, to order 4 in bending without shear, else
    to order 2. Raises OptionError when nothing can move or has mass, and SolverError.
    """
    if model.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    own = chained(model, pieces)
    pairs = lowest(own.K, own.M, count)
    finite = np.isfinite(pairs.values)
    if not finite.any():
        raise OptionError("the mechanism has no mass")
    hz = np.sqrt(np.maximum(pairs.values[finite], 0.0)) / (2 * np.pi)
    shapes = model.node_displacements(own.recover(pairs.vectors[:, finite]))
    return Solution(f"finite elements {pieces}x", own.K.shape[0], hz, shapes)


@dataclass(frozen=True)
class Convergence:
    """Observed order of convergence (k,), nan where differences are round-off or not monotone, and the frequencies
    (k,), Hz, extrapolated to elements of no length (theory eq. L3)."""

    order: Array
    frequency_hz: Array


def convergence(coarse: ArrayLike, medium: ArrayLike, fine: ArrayLike) -> Convergence:
    """Order of convergence and Richardson's estimate from the frequencies of three meshes, each twice as fine as the
    one before (Richardson 1911; Roache 1994)."""
    f1, f2, f4 = (np.asarray(f, dtype=float) for f in (coarse, medium, fine))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (f1 - f2) / (f2 - f4)
        seen = (np.abs(f2 - f4) > NOISE * f4) & (ratio > 1)
        order = np.where(seen, np.log2(np.where(seen, ratio, 1.0)), np.nan)
    return Convergence(order, np.where(seen, f4 + (f4 - f2) / np.where(seen, ratio - 1, 1.0), f4))
