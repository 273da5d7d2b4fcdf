"""Assembly of a mechanism over the ends of its chains, many designs at once, with a bound on what is left out.

The coordinates are the displacements of every node that no chain passes through, held ones left out, then the kept
motions of the chains' interiors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.linalg import GUARD, Eigenpairs, lowest
from flexura.records import Latest
from flexura.reduction.chain import ChainKinematics, kinematics
from flexura.reduction.chain_moments import EPS, ChainMoments, PoleFrame, interior_modes, moments
from flexura.reduction.parts import PartReducer
from flexura.reduction.stacks import refuse_impossible
from flexura.structure import Design, DiscreteElement, Plan, Scatter, block_diagonal

Array = NDArray[np.float64]
Index = NDArray[np.intp]

ROUNDING = 64 * EPS
"""Relative error of an entry of L' A L, as a part of |L|' |A| |L|: two products of some twenty terms and their sums
(theory eq. N10)."""

Kind = tuple[str, int]
Maps = tuple[dict[Kind, tuple[PoleFrame, Array, Array]], list[Array]]
"""A group of chains of equal length: its prototype, and its position among that prototype's groups."""


@dataclass(frozen=True)
class ChainOrder:
    """Designs over the ends of their chains: K, M, R (designs, n, n) of the dynamic stiffness
    K - lambda M - lambda^2 R + ... (theory eq. N2), SI.

    `slack` (3, designs, n): the errors of K, M and R lie between these diagonals and their negatives. `slowness`
    (designs,) is at least 1/mu for all motions left out, `loss` (designs,) bounds the relative error in energy of
    chains. `slow` is the slowness by kind of chain.
    """

    K: Array
    M: Array
    R: Array
    slack: Array
    slowness: Array
    loss: Array
    slow: dict[Kind, float]


class ChainAssembler:
    """Numbers the ends of all chains of a plan and assembles their moments, springs, bodies and superelements."""

    def __init__(self, plan: Plan, reducers: dict[str, PartReducer]) -> None:
        self.plan, self.reducers = plan, reducers
        topology = plan.topology
        sizes = np.cumsum([0, *(len(part.connectivity) for part in plan.parts.values())]).tolist()
        self._first = dict(zip(plan.parts, sizes, strict=False))
        kept = np.zeros(topology.n_nodes, dtype=bool)
        for name, reducer in reducers.items():
            kept[topology.root[self._numbers(name, reducer.remaining)]] = True
        physical = np.flatnonzero((topology.dof >= 0) & kept[:, None])
        self._dof = np.full(topology.dof.size, -1, dtype=np.intp)
        self._dof[physical] = np.arange(len(physical))
        self._dof = self._dof.reshape(topology.dof.shape)
        self.n_nodal = len(physical)
        """Coordinates that are displacements of nodes."""
        self._groups = [(name, g) for name, reducer in reducers.items() for g in range(len(reducer.chains))]
        self.forces: dict[Kind, Array] = {
            (name, g): np.zeros((*reducers[name].chains[g].elements.shape, 12, 0)) for name, g in self._groups
        }
        """Forces to which the kept motions of every kind of chain are the response."""
        self._number()
        self._starts: dict[int, Eigenpairs] = {}
        self._latest: Latest[Maps] = Latest()

    def _numbers(self, name: str, nodes: Index) -> Index:
        return np.array(self.plan.topology.copies[name].offset, dtype=np.intp)[:, None] + np.ravel(nodes)

    def _nodal(self, name: str, nodes: Index) -> Index:
        """Coordinates (copies, nodes, 6) of nodes of a prototype; -1 where held."""
        return self._dof[self.plan.topology.root[self._numbers(name, nodes)]]

    def _number(self) -> None:
        """Number the coordinates for the kept motions that there are."""
        first, chains, discrete_elements = self.n_nodal, [], []
        for name, g in self._groups:
            group, kept = self.reducers[name].chains[g], self.forces[name, g].shape[-1]
            ends = self._nodal(name, group.nodes[:, [0, -1]])
            copies, c = len(ends), len(group.nodes)
            own = first + np.arange(copies * c * kept).reshape(copies * c, kept)
            chains.append(np.hstack([ends.reshape(copies * c, 12), own]))
            first += own.size
        self.order = first
        for name, reducer in self.reducers.items():
            for nodes, _, _ in reducer.part.discrete_nodes():
                dofs = self._nodal(name, np.array(nodes))
                discrete_elements.append(dofs.reshape(len(dofs), -1))
        self._places = [*chains, *discrete_elements]
        has = [k_m for reducer in self.reducers.values() for k_m in reducer.part.discrete_nodes()]
        self._scatters = (
            Scatter([*chains, *(p for p, (_, K, _) in zip(discrete_elements, has, strict=True) if K)], first),
            Scatter([*chains, *(p for p, (_, _, M) in zip(discrete_elements, has, strict=True) if M)], first),
            Scatter(chains, first),
        )

    def keep(self, counts: dict[Kind, int], design: Design) -> None:
        """Keep so many fixed-interface modes of each kind of chain, those of one design."""
        for kind, count in counts.items():
            name, g = kind
            frame, _ = self._frame(name, g, design)
            self.forces[kind] = interior_modes(frame, design.elements, count)
        self._number()

    def _frame(self, name: str, g: int, design: Design) -> tuple[PoleFrame, ChainKinematics]:
        """The chains of a kind in the geometry of a design."""
        group = self.reducers[name].chains[g]
        kin = kinematics(self.reducers[name].part, group, design.geometry)
        return PoleFrame(group.elements + self._first[name], group.reverse, kin.X, kin.Xj_inverse), kin

    def _maps(self, design: Design) -> Maps:
        """What depends on geometry alone: for every kind of chain its pole frame and the map L (..., copies, c, 12, 12)
        from global displacements of its ends to its twists, with |L| before digits cancel; maps of the discrete
        elements."""

        def found() -> Maps:
            chains, discrete_elements = {}, []
            for name, g in self._groups:
                group = self.reducers[name].chains[g]
                frame, kin = self._frame(name, g, design)
                G = design.node_transforms(name, group.nodes[:, [0, -1]].ravel())
                T = block_diagonal(G.reshape(*G.shape[:-3], len(group.nodes), 2, 6, 6))
                B = kin.B[..., None, :, :, :]
                chains[name, g] = (frame, B @ T, abs(B) @ abs(T))
            for name, reducer in self.reducers.items():
                for nodes, _, _ in reducer.part.discrete_nodes():
                    discrete_elements.append(block_diagonal(design.node_transforms(name, np.array(nodes))))
            return chains, discrete_elements

        return self._latest.get(design.geometry, found)

    def __call__(self, design: Design) -> ChainOrder:
        """Assemble a stack of designs. Raises ImpossibleDesignError."""
        designs, matrices = len(design.values), design.matrices
        refuse_impossible(matrices, designs)
        chains, discrete_maps = self._maps(design)
        K: list[Array] = []
        M: list[Array] = []
        R: list[Array] = []
        spread: list[Array] = []
        slowness, loss, slow = np.zeros(designs), np.zeros(designs), {}
        for kind, (frame, L, size) in chains.items():
            own = moments(frame, design.elements, self.forces[kind])
            for out, A in zip((K, M, R), _placed(own, L), strict=True):
                out.append(A)
            spread.append(_spread(own, size))
            slowness = np.maximum(slowness, own.slowness.max(axis=-1))
            loss = np.maximum(loss, own.loss.max(axis=-1))
            slow[kind] = float(own.slowness.max())
        discrete_elements = [discrete for name in self.reducers for discrete in matrices[name].discrete_elements]
        for discrete, T in zip(discrete_elements, discrete_maps, strict=True):
            for out, A in ((K, discrete.K), (M, discrete.M)):
                if A is not None:
                    out.append(np.swapaxes(T, -1, -2) @ A[..., None, :, :] @ T)
            spread.append(_discrete_spread(discrete, T))
        lead = (designs,)
        k, m, r = (scatter.dense(A, lead) for scatter, A in zip(self._scatters, (K, M, R), strict=True))
        return ChainOrder(k, m, r, self._slack(spread, designs), slowness * (1 + 1e-6), loss, slow)

    def _slack(self, spread: list[Array], designs: int) -> Array:
        """Diagonals (3, designs, n) from spreads (3, ..., copies, m) at the places of the matrices."""
        n = self.order + 1
        out = np.zeros((3 * designs, n))
        for place, s in zip(self._places, spread, strict=True):
            m = place.shape[-1]
            flat = np.broadcast_to(s, (3, designs, *s.shape[-2:])).reshape(3 * designs, -1)
            at = (np.arange(3 * designs)[:, None] * n + np.where(place < 0, n - 1, place).ravel()).ravel()
            weights = (ROUNDING * m) * flat.ravel()
            out += np.bincount(at, weights=weights, minlength=3 * designs * n).reshape(3 * designs, n)
        return out[:, :-1].reshape(3, designs, -1)

    def start(self, count: int) -> Eigenpairs:
        """Eigenpairs of the default design from which the search for `count` frequencies of others starts."""
        if count not in self._starts:
            own = self(Design.of(self.plan).stacked())
            self._starts[count] = self._lowest(own, count)
        return self._starts[count]

    @staticmethod
    def _lowest(own: ChainOrder, count: int) -> Eigenpairs:
        """So many elastic eigenpairs and GUARD more, with the rigid ones."""
        pairs = lowest(own.K[0], own.M[0], count + GUARD)
        rigid = int((pairs.values == 0).sum())
        return lowest(own.K[0], own.M[0], count + GUARD + 6) if rigid else pairs

    def most(self, kind: Kind) -> int:
        """How many modes a kind of chain has: as many as its interior has displacements, unless some lack mass."""
        name, g = kind
        return 6 * (self.reducers[name].chains[g].elements.shape[1] - 1)

    def order_with(self, counts: dict[Kind, int]) -> int:
        """Number of coordinates with so many kept modes."""
        placed = self.plan.topology.copies
        return self.n_nodal + sum(
            count * len(self.forces[name, g]) * len(placed[name].offset) for (name, g), count in counts.items()
        )


def _placed(own: ChainMoments, L: Array) -> tuple[Array, Array, Array]:
    """K, M, R (designs, copies c, 12 + k, 12 + k) of the chains where they are placed."""
    kept = own.k_modes.shape[-1]
    n = 12 + kept
    lead = np.broadcast_shapes(own.k.shape[:-3], L.shape[:-4])
    shape = (*lead, L.shape[-4] * L.shape[-3], n, n)
    relative = L[..., 6:, :]
    K = np.swapaxes(relative, -1, -2) @ own.k[..., None, :, :, :] @ relative
    if kept:
        wide = np.zeros((*L.shape[:-2], n, n))
        wide[..., :12, :12] = L
        wide[..., np.arange(12, n), np.arange(12, n)] = 1.0
        L = wide
        whole = np.zeros((*K.shape[:-2], n, n))
        whole[..., :12, :12], whole[..., 12:, 12:] = K, own.k_modes[..., None, :, :, :]
        K = whole
    Lt = np.swapaxes(L, -1, -2)
    M, R = (Lt @ A[..., None, :, :, :] @ L for A in (own.M, own.R))
    return K.reshape(shape), M.reshape(shape), R.reshape(shape)


def _spread(own: ChainMoments, size: Array) -> Array:
    """Squares (3, designs, copies c, 12 + k) of |L|' sqrt(diag A) for K, M and R."""
    roots = np.zeros((*own.M.shape[:-1], 3))
    roots[..., 6:12, 0] = np.sqrt(abs(np.einsum("...ii->...i", own.k)))
    roots[..., 12:, 0] = np.sqrt(abs(np.einsum("...ii->...i", own.k_modes)))
    roots[..., 1] = np.sqrt(abs(np.einsum("...ii->...i", own.M)))
    roots[..., 2] = np.sqrt(abs(np.einsum("...ii->...i", own.R)))
    nodal = np.swapaxes(size, -1, -2) @ roots[..., None, :, :12, :]
    modal = np.broadcast_to(roots[..., None, :, 12:, :], (*nodal.shape[:-2], own.k_modes.shape[-1], 3))
    s = np.concatenate([nodal, modal], axis=-2) ** 2
    flat = s.reshape(*_joined(s.shape), 3)
    return np.moveaxis(flat, -1, 0)


def _joined(shape: tuple[int, ...]) -> tuple[int, ...]:
    """A shape (..., copies, c, n, 3) as (..., copies c, n)."""
    *lead, copies, chains, n, _ = shape
    return (*lead, copies * chains, n)


def _discrete_spread(discrete: DiscreteElement, T: Array) -> Array:
    """The same (3, ..., copies, m) of a discrete element."""
    found = []
    for A in (discrete.K, discrete.M):
        diagonal = np.zeros(T.shape[-1]) if A is None else np.einsum("...ii->...i", A)
        found.append(np.einsum("...ij,...i->...j", abs(T), np.sqrt(abs(diagonal))[..., None, :]) ** 2)
    shape = np.broadcast_shapes(*(f.shape for f in found))
    shape = shape if len(shape) > 2 else (1, *shape)
    return np.stack([np.broadcast_to(f, shape) for f in (*found, np.zeros(1))])
