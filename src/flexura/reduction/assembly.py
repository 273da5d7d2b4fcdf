"""Low-order coordinates of a plan, assembly of its reduced parts for one design or a stack of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array, Index
from flexura.errors import ModelError, OptionError
from flexura.kernels import is_compiled
from flexura.linalg import GUARD, Eigenpairs, lowest
from flexura.mechanism import DOF_NAMES
from flexura.records import Kept, Latest, Record
from flexura.reduction.parts import PartReducer, ReducedPart
from flexura.structure import Design, DiscreteElement, Elements, PartMatrices, Plan, Scatter, block_diagonal

STACK = 64
"""Designs evaluated together: enough to make Python's share small, few enough to stay in the cache."""

LARGE_STACK, SMALL_ORDER = 256, 60
"""The same of designs of so many coordinates at most by kernels, which keep a few designs in the cache themselves."""

OFF_ZERO = 1e-9
"""A coordinate, m, that is a little off zero."""

LARGEST_FREED = 31 << 20
"""Bytes just below the largest block that moves the thresholds of glibc's malloc."""


class LowOrderAssembler:
    """Numbers the low-order coordinates of a plan and assembles its reduced parts, of which `more` nodes than their
    boundary may be kept, by prototype; chains end at every node of strips where these are not `in_chains`."""

    def __init__(self, plan: Plan, more: Mapping[str, Sequence[int]] | None = None, *, in_chains: bool = True) -> None:
        self.plan = plan
        more = more or {}
        self.reducers: dict[str, PartReducer] = {
            name: PartReducer(part, more.get(name, ()), in_chains=in_chains)
            for name, part in plan.parts.items()
            if part.has_matrices
        }
        topology = plan.topology
        kept = np.zeros(topology.n_nodes, dtype=bool)
        for name, reducer in self.reducers.items():
            kept[topology.root[self.numbers(name, reducer.kept)]] = True
        self.physical: Index = np.flatnonzero((topology.dof >= 0) & kept[:, None])
        """Positions of the physical coordinates in the flattened (node, DOF) table."""
        self._dof = np.full(topology.dof.size, -1, dtype=np.intp)
        self._dof[self.physical] = np.arange(len(self.physical))
        self._dof = self._dof.reshape(topology.dof.shape)
        self._prepared = Kept()
        self._latest: Latest[dict[str, Array]] = Latest()

    def numbers(self, name: str, nodes: Index) -> Index:
        """Global numbers (copies, k) of nodes (k,) of a prototype."""
        return np.array(self.plan.topology.copies[name].offset, dtype=np.intp)[:, None] + nodes

    @property
    def physical_names(self) -> list[str]:
        """Names of the physical coordinates, e.g. `platform.rz`."""
        topology = self.plan.topology
        nodes, components = np.unravel_index(self.physical, topology.dof.shape)
        names = topology.node_names
        return [f"{names[n]}.{DOF_NAMES[c]}" for n, c in zip(nodes, components, strict=True)]

    def coordinates(self, name: str, modes: int, first: int) -> Index:
        """Low-order coordinate (copies, b + modes) of every coordinate of a reduced part; -1 where held."""
        topology = self.plan.topology
        number = self.numbers(name, self.reducers[name].kept)
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
        condensed = {
            name: reducer.condensed(matrices[name], design.geometry, lead) for name, reducer in self.reducers.items()
        }
        K, M = (self._summed(design, {name: both[k] for name, both in condensed.items()}) for k in range(2))
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
        for name, matrix in parts.items():
            T = transforms[name]
            placed.append(T.mT @ matrix[..., None, :, :] @ T)
        return np.asarray(self.scatter((0,) * len(self.reducers)).dense(placed, design.values.shape[:-1]))

    def node_rows(self, design: Design, numbers: Index) -> Array:
        """B (..., k, 6, n): displacements of the global nodes `numbers` (k,), whose roots are kept, global frame."""
        D, _ = design.node_arms(numbers)
        place = self._dof[self.plan.topology.root[numbers]]
        rows = np.zeros((*D.shape[:-2], 6, len(self.physical) + 1))
        rows[..., np.arange(len(numbers))[:, None, None], np.arange(6)[:, None], place[:, None, :]] = D
        return rows[..., :-1]


def _checked(design: Design) -> dict[str, PartMatrices]:
    """Matrices of the parts of a stack of designs. Raises ImpossibleDesignError."""
    matrices = design.matrices
    discrete = [element for part in matrices.values() for element in part.discrete_elements]
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


def exact_order(plan: Plan) -> LowOrderAssembler:
    """The same with chains that end at every node of strips, for members that are no finite elements."""
    if not any(part.strips for part in plan.parts.values()):
        return low_order(plan)
    return plan.prepared.once("exact order", lambda: LowOrderAssembler(plan, in_chains=False))


def low_order(plan: Plan) -> LowOrderAssembler:
    """The prepared low-order assembly of a plan, made on first use and kept with the plan."""
    return plan.prepared.once("low_order", lambda: LowOrderAssembler(plan))


@dataclass(frozen=True, repr=False)
class SubstructureBasis(Record):
    """Physical DOFs of the substructures' boundary nodes, then amplitudes of kept normal modes (theory eqs. 41-43)."""

    _shown = ("parts",)

    design: Design
    parts: dict[str, ReducedPart]

    @property
    def assembler(self) -> LowOrderAssembler:
        """The prepared low-order assembly."""
        return low_order(self.design.plan)

    @cached_property
    def coordinate_names(self) -> list[str]:
        """E.g. `platform.rz` or `branch1.amplifier mode 2`."""
        labels = self.assembler.physical_names
        for name, part in self.parts.items():
            for path in self.assembler.plan.topology.copies[name].paths:
                where = ".".join(path) or "mechanism"
                labels += [f"{where} mode {k + 1}" for k in range(len(part.frequencies))]
        return labels

    @cached_property
    def recovery(self) -> sp.csr_matrix:
        """T (full order, low order): all DOFs of the full-order model from the low-order coordinates."""
        topology = self.assembler.plan.topology
        rows = [topology.dof.ravel()[self.assembler.physical]]
        columns = [np.arange(len(rows[0]))]
        entries = [np.ones(len(rows[0]))]
        first = len(rows[0])
        for name, part in self.parts.items():
            prototype = self.assembler.reducers[name].part
            if len(prototype.interior):
                column = self.assembler.coordinates(name, len(part.frequencies), first)
                row, value = self._interior_rows(name, part)
                keep = np.broadcast_to((column >= 0)[:, None, :] & (row >= 0)[:, :, None], value.shape)
                rows.append(np.broadcast_to(row[:, :, None], value.shape)[keep])
                columns.append(np.broadcast_to(column[:, None, :], value.shape)[keep])
                entries.append(value[keep])
            first += len(part.frequencies) * len(topology.copies[name].paths)
        where = (np.concatenate(rows), np.concatenate(columns))
        return sp.csr_matrix((np.concatenate(entries), where), shape=(topology.n_dof, first))

    def recover(self, coordinates: Array) -> Array:
        """Full-order DOF vectors (full order, k) for coordinates (n, k), without forming the recovery."""
        topology = self.assembler.plan.topology
        physical = topology.dof.ravel()[self.assembler.physical]
        full = np.empty((topology.n_dof + 1, coordinates.shape[1]))  # DOF -1 goes to the last row
        full[physical] = coordinates[: len(physical)]
        first = len(physical)
        padded = np.vstack([coordinates, np.zeros((1, coordinates.shape[1]))])
        for name, part in self.parts.items():
            prototype, k = self.assembler.reducers[name].part, len(part.frequencies)
            if len(prototype.interior):
                q = padded[self.assembler.coordinates(name, k, first)]
                b = q.shape[1] - k
                q[:, :b] = self.assembler.transforms(self.design)[name] @ q[:, :b]
                number = self.assembler.numbers(name, prototype.interior)
                G = self.design.node_transforms(name, prototype.interior)
                inside = (part.T[self.assembler.reducers[name].interior_dofs] @ q).reshape(*number.shape, 6, -1)
                full[topology.dof[number]] = G.mT @ inside
            first += k * len(topology.copies[name].paths)
        return full[:-1]

    def _interior_rows(self, name: str, part: ReducedPart) -> tuple[Index, Array]:
        """Full-order DOF numbers (copies, i) of the interior and their recovery (copies, i, b + k), global frame."""
        topology, reducer = self.assembler.plan.topology, self.assembler.reducers[name]
        interior = reducer.part.interior
        number = self.assembler.numbers(name, interior)
        G = self.design.node_transforms(name, interior)
        Tb = self.assembler.transforms(self.design)[name]
        b = Tb.shape[-1]
        inside = part.T[reducer.interior_dofs]
        local = np.concatenate(
            [inside[:, :b] @ Tb, np.broadcast_to(inside[:, b:], (len(Tb), *inside[:, b:].shape))], axis=-1
        )
        blocks = local.reshape(len(Tb), len(interior), 6, -1)
        value = G.mT @ blocks
        return topology.dof[number].reshape(len(Tb), -1), value.reshape(*local.shape)


@cache
def keep_freed_memory() -> None:
    """Have the arrays of one stack reused for the next one: freeing a block of this size, which is never touched, tells
    glibc's malloc not to give smaller ones back to the system (mallopt(3), M_MMAP_THRESHOLD), from where they would
    come again page by page, at up to half the cost of a stack. Other libraries are not told anything."""
    np.empty(LARGEST_FREED, dtype=np.uint8)


class ImpossibleDesignError(OptionError):
    """A design of a stack, by its `number` there, has a stiffness or mass that is not positive and finite."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__("a stiffness or mass is not positive")


def stacks(designs: int, order: int | None = None) -> list[slice]:
    """So many designs, each of some `order` if that is known, cut into stacks, the memory for which is kept."""
    keep_freed_memory()
    size = LARGE_STACK if order is not None and order <= SMALL_ORDER and is_compiled() else STACK
    return [slice(k, min(k + size, designs)) for k in range(0, designs, size)]


def independent_stacks(
    plan: Plan, parameters: Mapping[str, ArrayLike]
) -> Iterator[tuple[slice, NDArray[np.float64], dict[str, ArrayLike]]]:
    """Designs in stacks that are filled up to one size, so that each is worked out to the last bit the same whatever
    others stand beside it: which designs of all a stack begins with, and its values (k, s) and parameters.

    Where parameters may place nodes, there is a design behind a stack that was not asked for and stands a little off
    the others in all of these, so that designs of one geometry, or of one in some parts, are worked out like any other.
    """
    every, placing = np.atleast_2d(plan.values(parameters)), plan.placing(parameters)
    for used in stacks(len(every)):
        numbers = np.minimum(used.start + np.arange(STACK + bool(len(placing))), used.stop - 1)
        values = every[numbers]
        values[-1, placing] = np.where(values[-1, placing] == 0, OFF_ZERO, values[-1, placing] * (1 + 1e-6))
        yield used, values, {name: np.ravel(v)[numbers] if np.ndim(v) else v for name, v in parameters.items()}


def refuse_impossible(elements: Elements, discrete_elements: Sequence[DiscreteElement], designs: int) -> None:
    """Raise ImpossibleDesignError for the first design with an element, of a beam or discrete, that is not positive
    and finite."""
    rows = [
        (A.diagonal(axis1=-2, axis2=-1)[..., None], 0.0) for d in discrete_elements for A in (d.K, d.M) if A is not None
    ]
    if not elements.can_be:
        flexible, massive = elements.flexibility_coefficients, elements.mass_coefficients
        rows.append((flexible[..., _on_diagonal(elements.flexibility_basis)], np.finfo(float).tiny))
        rows.append((massive[..., _on_diagonal(elements.mass_basis)], 0.0))
    if all(not sizes.size or (sizes.min() >= least and sizes.max() < np.inf) for sizes, least in rows):
        return
    good = np.ones(designs, dtype=bool)
    for sizes, least in rows:
        good &= ((sizes >= least) & (sizes < np.inf)).all(axis=(-1, -2))
    raise ImpossibleDesignError(int(np.flatnonzero(~good)[0]))


def _on_diagonal(basis: Array) -> NDArray[np.bool_]:
    """Which terms (k,) of a basis (k, n n) are on the diagonal."""
    n = round(basis.shape[1] ** 0.5)
    return (basis[:, :: n + 1] != 0).any(axis=1)


def refuse_turned(plan: Plan, values: NDArray[np.float64], parameters: Mapping[str, ArrayLike]) -> None:
    """Raise OptionError for the first design of values (..., s) that has a size on the other side of zero than the
    default one, which breaks the description: a section's formula does not always see its sign."""
    for d in plan.turned(values if values.ndim > 1 else values[None]):
        single = one_of(parameters, int(d))
        try:
            plan.verify(single)
        except ModelError as error:
            what = error.problems[0]
            text = f"{what.place}: {what.rule} (found {what.value})"
            raise OptionError(f"design {d} ({_values_text(single)}): {text}") from None


def named(error: ImpossibleDesignError, first: int, parameters: Mapping[str, ArrayLike]) -> OptionError:
    """The error with the design's number among all and its parameters."""
    number = first + error.number
    return OptionError(
        f"design {number} ({_values_text(one_of(parameters, number))}): {error}; a size has gone through zero;"
        " `check` with these parameters names it"
    )


def _values_text(parameters: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in parameters.items()) or "default parameters"


def some_of(parameters: Mapping[str, ArrayLike], designs: slice) -> dict[str, ArrayLike]:
    """Parameters of some designs of many."""
    return {name: np.ravel(v)[designs] if np.ndim(v) else v for name, v in parameters.items()}


def one_of(parameters: Mapping[str, ArrayLike], number: int) -> dict[str, float]:
    """Parameters of one design of many."""
    return {name: float(np.ravel(v)[number if np.ndim(v) else 0]) for name, v in parameters.items()}
