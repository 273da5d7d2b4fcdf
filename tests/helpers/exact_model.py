"""K and M of a mechanism's full-order model summed in pairs of doubles, in the displacements of its nodes.

Sizes, directions and positions are the doubles that flexura works with; from there on nothing is rounded to double. The
stiffness of elements and springs is that of relative displacements, B' k B, so that rigid motions strain nothing but by
the last digits of positions. Unlike flexura's proofs this uses no chains, no strains and no Ritz vectors.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from flexura.beam import rigid_arm
from helpers.double_double import Pairs, negative_pivots


def _relative(arm: np.ndarray) -> Pairs:
    """[-D, I] (..., 6, 12) for arms (..., 3)."""
    D = rigid_arm(arm)
    return Pairs.of(np.concatenate([-D, np.broadcast_to(np.eye(6), D.shape)], axis=-1))


def _inverse(C: np.ndarray) -> Pairs:
    """C^-1 (..., n, n) to 32 digits: Newton's iteration from the inverse in double precision."""
    d = 2.0 ** np.round(np.log2(np.einsum("...ii->...i", C)) / 2)
    scale = d[..., :, None] * d[..., None, :]
    own = Pairs.of(C / scale / 2)
    own = own + own.T  # closed forms are symmetric but for their last digits
    X = Pairs.of(np.linalg.inv(C / scale))
    for _ in range(3):
        X = X + X @ (Pairs.of(np.broadcast_to(np.eye(C.shape[-1]), C.shape)) - own @ X)
    return Pairs(X.hi / scale, X.lo / scale)


class ExactModel:
    """Counts the natural frequencies below any frequency."""

    def __init__(self, model) -> None:
        self.n = model.order
        topology = model.plan.topology
        blocks = []
        for name, matrices in model.matrices.items():
            part = model.plan.parts[name]
            number = np.array(topology.copies[name].offset)[:, None] + np.arange(part.n_nodes)
            dof = topology.dof[topology.root[number]]
            G = model.design.node_transforms(name, np.arange(part.n_nodes))
            for copy in range(len(dof)):
                if len(part.connectivity):
                    blocks += self._elements(part, matrices, dof[copy], G[copy])
                resisted = part.resisted(model.values, model.geometry.parts[name])
                for discrete, own in zip(matrices.discrete_elements, resisted, strict=True):
                    blocks.append(self._discrete(discrete, own, dof[copy], G[copy]))
        self._assemble(blocks)

    @staticmethod
    def _elements(part, matrices, dof, G):
        ends = part.connectivity
        length = np.zeros((len(ends), 3))
        length[:, 0] = matrices.elements.length
        turn = np.zeros((len(ends), 12, 12))
        turn[:, :6, :6], turn[:, 6:, 6:] = G[ends[:, 0]], G[ends[:, 1]]
        T = Pairs.of(matrices.T) @ Pairs.of(turn)
        B = _relative(length) @ T
        K = B.T @ (_inverse(matrices.elements.C) @ B)
        M = T.T @ (Pairs.of(matrices.elements.M) @ T)
        blocks, together = [], set()
        for elements, S in matrices.elements.couplings:
            n = elements.shape[1]
            for strip, shared in zip(elements.tolist(), S, strict=True):
                flexibility, D = np.zeros((6 * n, 6 * n)), Pairs.of(np.zeros((6 * n, 6 * n + 6)))
                flexibility[3::6, 3::6] = -shared
                for k, e in enumerate(strip):
                    flexibility[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] += matrices.elements.C[e]
                    D[6 * k : 6 * k + 6, 6 * k : 6 * k + 12] = B[e]
                nodes = [*ends[strip, 0], ends[strip[-1], 1]]
                blocks.append((dof[nodes].ravel(), D.T @ (_inverse(flexibility) @ D), None))
                together.update(strip)
        return blocks + [(dof[ends[e]].ravel(), None if e in together else K[e], M[e]) for e in range(len(ends))]

    @staticmethod
    def _discrete(discrete, resisted, dof, G):
        m = len(discrete.nodes)
        turn = np.zeros((6 * m, 6 * m))
        for k, node in enumerate(discrete.nodes):
            turn[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = G[node]
        T = Pairs.of(turn)
        K = M = None
        if discrete.M is not None:
            M = T.T @ (Pairs.of(discrete.M) @ T)
        if discrete.K is not None and resisted is not None:
            B = Pairs.of(resisted[1]) @ T
            K = B.T @ (Pairs.of(resisted[0]) @ B)
        elif discrete.K is not None:
            K = T.T @ (Pairs.of(discrete.K) @ T)
        return dof[discrete.nodes].ravel(), K, M

    def _assemble(self, blocks) -> None:
        rows = np.concatenate([np.repeat(at, len(at)) for at, _, _ in blocks])
        columns = np.concatenate([np.tile(at, len(at)) for at, _, _ in blocks])
        kept = (rows >= 0) & (columns >= 0)
        pattern = sp.csr_matrix((np.ones(kept.sum()), (rows[kept], columns[kept])), shape=(self.n, self.n))
        place = np.empty(self.n, dtype=int)
        place[reverse_cuthill_mckee(pattern, symmetric_mode=True)] = np.arange(self.n)
        width = int(np.abs(place[rows[kept]] - place[columns[kept]]).max(initial=0)) + 1
        self.K, self.M = (Pairs.of(np.zeros((self.n, width))) for _ in range(2))
        for at, K, M in blocks:
            for out, own in ((self.K, K), (self.M, M)):
                if own is None:
                    continue
                i, j = np.nonzero((at[:, None] >= 0) & (at >= 0))
                p, q = place[at[i]], place[at[j]]
                upper = q >= p
                i, j, where = i[upper], j[upper], (p[upper], (q - p)[upper])
                entries = own[i, j]
                while len(entries.hi):  # a place that turns up twice in one block is summed in turns
                    _, first = np.unique(where[0] * width + where[1], return_index=True)
                    here = (where[0][first], where[1][first])
                    out[here] = out[here] + entries[first]
                    rest = np.setdiff1d(np.arange(len(entries.hi)), first)
                    entries, where = entries[rest], (where[0][rest], where[1][rest])

    def count_below(self, hz: float) -> int:
        """Number of natural frequencies below `hz`."""
        lam = Pairs.of((2 * np.pi * hz) ** 2)
        shift = Pairs(np.full(self.M.hi.shape, lam.hi), np.full(self.M.hi.shape, lam.lo))
        return negative_pivots(self.K - shift * self.M)
