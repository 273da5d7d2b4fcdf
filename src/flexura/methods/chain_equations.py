"""What methods share that write one equation system for all chains and junctions of a mechanism."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Index
from flexura.methods.dense import refuse_large
from flexura.methods.dynamic_stiffness import DynamicStiffness
from flexura.methods.exact_chains import ExactChains
from flexura.structure import FullOrderModel, Scatter

Array = NDArray[Any]

LARGE = 400
"""Unknowns of chains beyond which they are eliminated."""


class ChainEquations(ABC):
    """Equations over the displacements of all junctions and further unknowns of every chain.

    Junctions are the nodes that substructures keep, in the global frame, and those where members branch or discrete
    elements sit, in the frame of their part. Elements are cut into `pieces` uniform beams. `is_real` says that the
    equations are real at real frequencies. Raises SolverError where the equations are too many.
    """

    pieces = 1
    is_real = True

    def __init__(self, model: FullOrderModel) -> None:
        self.exact: DynamicStiffness = DynamicStiffness(model, self.pieces)
        assembler = self.exact.assembler
        self._ends = {name: self._number(name) for name in self.exact.parts}
        unknowns = (
            copies * self.extra(own) * len(own.kind)
            for part, copies in zip(self.exact.parts.values(), self.exact.copies, strict=True)
            for own in part.chains
        )
        self.condensed: bool = sum(unknowns) > LARGE
        """Whether the unknowns of chains are eliminated part by part."""
        dofs, first = [], len(assembler.physical)
        for name, part in self.exact.parts.items():
            boundary = assembler.coordinates(name, 0, 0)
            chains = 0 if self.condensed else sum(self.extra(own) * len(own.kind) for own in part.chains)
            inner = 6 * len(part.reducer.remaining) - boundary.shape[1] + chains
            refuse_large(first + inner * len(boundary), "junctions and chains")
            more = first + np.arange(inner * len(boundary)).reshape(len(boundary), inner)
            dofs.append(np.hstack([boundary, more]))
            first += more.size
        self._scatter = Scatter(dofs, first)

    def _number(self, name: str) -> list[tuple[Index, Index]]:
        """DOFs (c, 6) of the first and the last node of the chains of every group, among the remaining nodes."""
        part = self.exact.parts[name]
        number = np.full(part.reducer.part.n_nodes, -1)
        number[part.reducer.remaining] = np.arange(len(part.reducer.remaining))
        ends = [6 * number[own.nodes[:, [0, -1]]][..., None] + np.arange(6) for own in part.chains]
        return [(own[:, 0], own[:, 1]) for own in ends]

    @property
    def physical(self) -> int:
        """How many of the unknowns, the first ones, are kept DOFs of the low-order model."""
        return len(self.exact.assembler.physical)

    def matrix(self, omega: complex) -> Array:
        """The matrix (n, n) of all equations at an angular frequency, rad/s; real for real omega."""
        lam = omega**2
        transforms = self.exact.assembler.transforms(self.exact.model.design)
        blocks = []
        for name in self.exact.parts:
            T = transforms[name]
            b = T.shape[-1]
            local = self._part(name, lam)
            wide = np.zeros((len(T), len(local), len(local)))
            wide[:, np.arange(b, len(local)), np.arange(b, len(local))] = 1.0
            wide[:, :b, :b] = T
            blocks.append(np.swapaxes(wide, -1, -2) @ local @ wide)
        return self._scatter.dense(blocks)

    def _part(self, name: str, lam: complex) -> Array:
        """Equations of one prototype: equilibrium of its nodes, then those of its chains."""
        part = self.exact.parts[name]
        n = 6 * len(part.reducer.remaining)
        extra = [self.extra(own) for own in part.chains]
        size = n + sum(more * len(own.kind) for more, own in zip(extra, part.chains, strict=True))
        local = np.zeros((size, size), dtype=np.result_type(lam, float if self.is_real else complex))
        zeros = [np.zeros((len(group.nodes), 12, 12)) for group in part.reducer.chains]
        local[:n, :n], _ = part.reducer.assembled_chains(zeros, zeros, lam, part.discrete_elements)
        at = n
        for own, more, (first, last) in zip(part.chains, extra, self._ends[name], strict=True):
            unknowns = at + np.arange(more * len(own.kind)).reshape(-1, more)
            self.add_chains(local, own, first, last, unknowns, lam)
            at += unknowns.size
        if not self.condensed or at == n:
            return local
        inner = local[n:, n:]
        scale = 1 / np.maximum(np.abs(inner).max(axis=1), 1e-300)
        return local[:n, :n] - local[:n, n:] @ np.linalg.solve(inner * scale[:, None], scale[:, None] * local[n:, :n])

    def poles(self, omega: float) -> int:
        """Number of poles of det below omega, rad/s: those of the chains' own equations, or when these have been
        eliminated, frequencies at which a chain with held ends vibrates."""
        total = 0
        for part, copies in zip(self.exact.parts.values(), self.exact.copies, strict=True):
            for own in part.chains:
                found = int(own.joined(omega**2)[0].J0.sum()) if self.condensed else self.own_poles(own, omega**2)
                total += copies * found
        return total

    def own_poles(self, chains: ExactChains, lam: float) -> int:
        """Number of poles below lam that the equations of chains have."""
        del chains, lam
        return 0

    def extra(self, chains: ExactChains) -> int:
        """Number of unknowns that each of the chains adds."""
        del chains
        return 6

    @abstractmethod
    def add_chains(
        self, local: Array, chains: ExactChains, first: Index, last: Index, own: Index, lam: complex
    ) -> None:
        """Add the equations of chains (c,) to those of their part: DOFs of their ends `first`, `last` (c, 6) and their
        own unknowns (c, extra)."""
