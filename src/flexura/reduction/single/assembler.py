"""Numbering of the low-order coordinates of a plan, and assembly of its reduced parts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from flexura.arrays import Array, Index
from flexura.linalg import GUARD, Eigenpairs, lowest
from flexura.records import Kept, Latest
from flexura.reduction.chains import refuse_impossible
from flexura.reduction.single.parts import PartReducer
from flexura.structure import Design, PartMatrices, Plan, Scatter, block_diagonal


class LowOrderAssembler:
    """Numbers the low-order coordinates of a plan and assembles its reduced parts, of which `more` nodes than their
    boundary may be kept, by prototype."""

    def __init__(self, plan: Plan, more: Mapping[str, Sequence[int]] | None = None) -> None:
        self.plan = plan
        more = more or {}
        self.reducers: dict[str, PartReducer] = {
            name: PartReducer(part, more.get(name, ())) for name, part in plan.parts.items() if part.has_matrices
        }
        topology = plan.topology
        kept = np.zeros(topology.n_nodes, dtype=bool)
        for name, reducer in self.reducers.items():
            kept[topology.root[self._numbers(name, reducer.kept)]] = True
        self.physical: Index = np.flatnonzero((topology.dof >= 0) & kept[:, None])
        """Positions of the physical coordinates in the flattened (node, DOF) table."""
        self._dof = np.full(topology.dof.size, -1, dtype=np.intp)
        self._dof[self.physical] = np.arange(len(self.physical))
        self._dof = self._dof.reshape(topology.dof.shape)
        self._prepared = Kept()
        self._latest: Latest[dict[str, Array]] = Latest()

    def _numbers(self, name: str, nodes: Index) -> Index:
        return np.array(self.plan.topology.copies[name].offset, dtype=np.intp)[:, None] + nodes

    def coordinates(self, name: str, modes: int, first: int) -> Index:
        """Low-order coordinate (copies, b + modes) of every coordinate of a reduced part; -1 where held."""
        topology = self.plan.topology
        number = self._numbers(name, self.reducers[name].kept)
        physical = self._dof[topology.root[number]].reshape(len(number), -1)
        modal = first + np.arange(len(number) * modes).reshape(len(number), modes)
        return np.hstack([physical, modal])

    def transforms(self, design: Design) -> dict[str, Array]:
        """Block-diagonal boundary transforms (..., copies, b, b) per prototype, kept while geometry stays the same."""

        def found() -> dict[str, Array]:
            own = {name: reducer.kept for name, reducer in self.reducers.items()}
            return {name: block_diagonal(design.node_transforms(name, at)) for name, at in own.items()}

        return self._latest.get(design.geometry, found)

    def scatter(self, modes: tuple[int, ...]) -> Scatter:
        """Assembly pattern for so many kept modes per prototype."""

        def made() -> Scatter:
            first = len(self.physical)
            dofs = []
            for name, k in zip(self.reducers, modes, strict=True):
                dofs.append(self.coordinates(name, k, first))
                first += k * len(dofs[-1])
            return Scatter(dofs, first)

        return self._prepared.once(modes, made)

    def start(self, count: int) -> Eigenpairs:
        """Eigenpairs of the default design from which the iteration for `count` frequencies of others starts."""
        return self._prepared.once(count, lambda: lowest(*self.stack(Design.of(self.plan)), count + GUARD))

    def stack(self, design: Design) -> tuple[Array, Array]:
        """K and M (..., n, n) with constraint modes alone: the paper's model, every design of a stack.

        Raises ImpossibleDesignError.
        """
        lead, matrices = design.values.shape[:-1], _checked(design)
        own = {
            name: reducer.condensed(matrices[name], design.geometry, lead) for name, reducer in self.reducers.items()
        }
        K, M = (self._summed(design, {name: both[k] for name, both in own.items()}) for k in range(2))
        return K, M

    def stiffness(self, design: Design) -> Array:
        """K (..., n, n) of every design of a stack, of parts that keep all that is left behind their chains.

        Raises ImpossibleDesignError.
        """
        lead, matrices = design.values.shape[:-1], _checked(design)
        return self._summed(
            design,
            {name: reducer.stiffness(matrices[name], design.geometry, lead) for name, reducer in self.reducers.items()},
        )

    def _summed(self, design: Design, parts: Mapping[str, Array]) -> Array:
        """The sum (..., n, n) of the matrices (..., b, b) of parts, each placed as often as its prototype."""
        transforms, placed = self.transforms(design), []
        for name, own in parts.items():
            T = transforms[name]
            placed.append(np.swapaxes(T, -1, -2) @ own[..., None, :, :] @ T)
        return np.asarray(self.scatter((0,) * len(self.reducers)).dense(placed, design.values.shape[:-1]))

    def node_rows(self, design: Design, numbers: Index) -> Array:
        """B (..., k, 6, n): displacements of the global nodes `numbers` (k,), whose roots are kept, global frame."""
        D, _ = design.node_arms(numbers)
        place = self._dof[self.plan.topology.root[numbers]]
        found = np.zeros((*D.shape[:-2], 6, len(self.physical) + 1))
        found[..., np.arange(len(numbers))[:, None, None], np.arange(6)[:, None], place[:, None, :]] = D
        return found[..., :-1]


def _checked(design: Design) -> dict[str, PartMatrices]:
    """Matrices of the parts of a stack of designs. Raises ImpossibleDesignError."""
    matrices = design.matrices
    discrete = [element for own in matrices.values() for element in own.discrete_elements]
    refuse_impossible(design.elements, discrete, math.prod(design.values.shape[:-1]))
    return matrices


def with_modes(T: Array, k: int) -> Array:
    """Boundary transforms (copies, b, b) bordered by an identity for k modal coordinates."""
    if not k:
        return T
    b = T.shape[-1]
    out = np.zeros((len(T), b + k, b + k))
    out[:, :b, :b] = T
    out[:, np.arange(b, b + k), np.arange(b, b + k)] = 1.0
    return out


def low_order(plan: Plan) -> LowOrderAssembler:
    """The prepared low-order assembly of a plan, made on first use and kept with the plan."""
    return plan.prepared.once("low_order", lambda: LowOrderAssembler(plan))
