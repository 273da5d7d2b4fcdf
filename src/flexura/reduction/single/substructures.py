"""The substructures of a design, ready to be reduced: each prototype once at rest, every copy as it is at a pose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from flexura.arrays import Index
from flexura.mechanism import DOF_NAMES
from flexura.reduction.single.assembler import LowOrderAssembler
from flexura.reduction.single.craig_bampton import CraigBampton
from flexura.reduction.single.model import FullBasis, LowOrderModel, ProjectedBasis, assembled, kept_modes, state_of
from flexura.structure import Design, Posed


class Substructures(Protocol):
    """The prototypes of a design with their constraint modes and fixed-interface normal modes, by name."""

    modes: dict[str, CraigBampton]

    def counts(self, kept: Mapping[str, int]) -> dict[str, int]:
        """How many of `modes` are kept where so many are in each placed copy of a prototype."""
        ...

    def model(self, counts: Mapping[str, int], exact_at: tuple[str, ...]) -> LowOrderModel:
        """The low-order model with so many of `modes`."""
        ...


class EqualCopies:
    """At rest the copies of a prototype are equal: one stands for all."""

    def __init__(self, assembler: LowOrderAssembler, design: Design) -> None:
        self.assembler = assembler
        self.design = design
        matrices, geometry = self.design.matrices, self.design.geometry
        self.modes: dict[str, CraigBampton] = {
            name: reducer.craig_bampton(matrices[name], geometry) for name, reducer in assembler.reducers.items()
        }

    def counts(self, kept: Mapping[str, int]) -> dict[str, int]:
        """As many."""
        return dict(kept)

    def model(self, counts: Mapping[str, int], exact_at: tuple[str, ...]) -> LowOrderModel:
        """The low-order model with so many normal modes in every copy."""
        parts = {name: modes.reduced(counts[name]) for name, modes in self.modes.items()}
        return assembled(self.assembler, self.design, parts, exact_at)


class PosedCopies:
    """At a pose every copy of a prototype has turned and is loaded in a way of its own. `modes` are those of all copies
    of a prototype together, which do not touch one another but at what is kept."""

    def __init__(self, assembler: LowOrderAssembler, design: Design, at: Posed) -> None:
        self.assembler = assembler
        self.design = design
        self.K, self.M = at.K, at.M
        topology = design.plan.topology
        self.physical: Index = topology.dof.ravel()[assembler.physical]
        self.modes: dict[str, CraigBampton] = {}
        for name, reducer in assembler.reducers.items():
            number = np.array(topology.copies[name].offset, dtype=np.intp)[:, None] + reducer.part.interior
            inside = topology.dof[number].ravel()
            self.modes[name] = CraigBampton(at.K, at.M, inside[inside >= 0], self.physical)

    def counts(self, kept: Mapping[str, int]) -> dict[str, int]:
        """So many times the number of copies."""
        copies = self.design.plan.topology.copies
        return {name: count * len(copies[name].paths) for name, count in kept.items()}

    def model(self, counts: Mapping[str, int], exact_at: tuple[str, ...]) -> LowOrderModel:
        """The low-order model with so many normal modes in all copies of a prototype together."""
        topology, b = self.design.plan.topology, len(self.physical)
        T = np.zeros((topology.n_dof, b + sum(counts.values())))
        T[self.physical, np.arange(b)] = 1.0
        nodes, components = np.unravel_index(self.assembler.physical, topology.dof.shape)
        names = [f"{topology.node_names[n]}.{DOF_NAMES[c]}" for n, c in zip(nodes, components, strict=True)]
        found: dict[str, int] = {}
        for name, modes in self.modes.items():
            own = modes.normal_modes(counts[name]).vectors
            first, found[name] = len(names), own.shape[1]
            T[modes.interior, :b], T[modes.interior, first : first + own.shape[1]] = modes.constraint_modes, own
            names += [f"{name or 'mechanism'} mode {k + 1}" for k in range(own.shape[1])]
        T = T[:, : len(names)]
        K, M = (T.T @ (A @ T) for A in (self.K, self.M))
        basis = ProjectedBasis(FullBasis(self.design.plan), T, names)
        steps = (kept_modes(found), *state_of(self.design))
        return LowOrderModel(self.design, (K + K.T) / 2, (M + M.T) / 2, basis, steps, exact_at)


def substructures(assembler: LowOrderAssembler, design: Design) -> Substructures:
    """The substructures of one design. Raises SolverError when one can move freely with its interface held."""
    at = design.posed
    return EqualCopies(assembler, design) if at is None else PosedCopies(assembler, design, at)
