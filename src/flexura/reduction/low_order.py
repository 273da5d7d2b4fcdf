"""The low-order model of a mechanism: every prototype reduced once, placed many times (eqs. 27-35)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.errors import OptionError
from flexura.linalg import Eigenpairs, lowest
from flexura.linalg.stacked import GUARD, lowest_values
from flexura.mechanism.substructure import DOF_NAMES, Mechanism
from flexura.reduction.chain import ChainKinematics, condense, find_chains, kinematics
from flexura.reduction.craig_bampton import ReducedPart, craig_bampton
from flexura.structure.full_order import block_diagonal
from flexura.structure.part import Part, PartMatrices
from flexura.structure.plan import Geometry, Plan, one_design, plan_of
from flexura.structure.scatter import Scatter
from flexura.structure.slots import Index

Array = NDArray[np.float64]

DENSE_ORDER = 1500
"""Up to this order the low-order K and M are dense arrays, beyond it sparse."""


STACK = 32
"""Designs evaluated together: enough to make Python's share small, few enough to stay in the cache."""


class PartReducer:
    """Reduces one prototype's own part to its boundary nodes."""

    def __init__(self, part: Part) -> None:
        self.part = part
        every = part.lump_nodes()
        elements = _node_dofs_each(part.connectivity)
        n = 6 * part.n_nodes
        self._stiffness = Scatter([elements, *(_node_dofs(nodes)[None] for nodes, k, _ in every if k)], n)
        self._mass = Scatter([elements, *(_node_dofs(nodes)[None] for nodes, _, m in every if m)], n)
        self.boundary_dofs = _node_dofs(part.boundary)
        self.interior_dofs = _node_dofs(part.interior)
        self.chains = find_chains(part)
        self._prepare_condensation()
        self._remembered: tuple[Geometry, list[ChainKinematics]] | None = None

    def _prepare_condensation(self) -> None:
        """Number the nodes that remain after chains are condensed: the boundary first, then the rest."""
        part = self.part
        lumps = part.lump_nodes()
        ends = {int(n) for group in self.chains for n in group.nodes[:, [0, -1]].ravel()}
        ends |= {n for nodes, _, _ in lumps for n in nodes}
        rest = sorted(ends - set(part.boundary.tolist()))
        number = np.full(part.n_nodes, -1)
        number[[*part.boundary, *rest]] = np.arange(len(part.boundary) + len(rest))
        chains = [_node_dofs_each(number[group.nodes[:, [0, -1]]]) for group in self.chains]
        n = 6 * (len(part.boundary) + len(rest))
        self._chain_stiffness = Scatter([*chains, *(_node_dofs(number[nodes])[None] for nodes, k, _ in lumps if k)], n)
        self._chain_mass = Scatter([*chains, *(_node_dofs(number[nodes])[None] for nodes, _, m in lumps if m)], n)

    def assembled(self, matrices: PartMatrices) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K and M (6n, 6n) of the part in its own frame, one design."""
        T = matrices.T
        Tt = np.swapaxes(T, -1, -2)
        K = [Tt @ matrices.elements.K @ T, *(lump.K[None] for lump in matrices.lumps if lump.K is not None)]
        M = [Tt @ matrices.elements.M @ T, *(lump.M[None] for lump in matrices.lumps if lump.M is not None)]
        return self._stiffness.sparse(K), self._mass.sparse(M)

    def craig_bampton(self, matrices: PartMatrices, count: int, below_hz: float) -> ReducedPart:
        """Craig-Bampton reduction with recovery, one design."""
        K, M = self.assembled(matrices)
        return craig_bampton(K, M, self.interior_dofs, self.boundary_dofs, count, below_hz)

    def condensed(self, matrices: PartMatrices, geometry: Geometry, lead: tuple[int, ...]) -> tuple[Array, Array]:
        """K and M (*lead, b, b) by constraint modes alone, for a stack of designs."""
        if self._remembered is None or self._remembered[0] is not geometry:
            self._remembered = (geometry, [kinematics(self.part, group, geometry) for group in self.chains])
        K, M = [], []
        for group, kin in zip(self.chains, self._remembered[1], strict=True):
            k, m = condense(group, kin, matrices.elements)
            K.append(k)
            M.append(m)
        K += [lump.K[..., None, :, :] for lump in matrices.lumps if lump.K is not None]
        M += [lump.M[..., None, :, :] for lump in matrices.lumps if lump.M is not None]
        return _guyan(self._chain_stiffness.dense(K, lead), self._chain_mass.dense(M, lead), len(self.boundary_dofs))


def _guyan(K: Array, M: Array, b: int) -> tuple[Array, Array]:
    """Statically condense everything behind the first b DOFs (Guyan 1965; theory eq. 52) of stacks (..., n, n)."""
    if K.shape[-1] == b:
        return K, M
    inner = K[..., b:, b:]
    d = 1 / np.sqrt(np.einsum("...ii->...i", inner))
    right = d[..., None] * K[..., b:, :b]
    psi = -d[..., None] * np.linalg.solve(inner * d[..., :, None] * d[..., None, :], right)
    pt = np.swapaxes(psi, -1, -2)
    cross = M[..., :b, b:] @ psi
    M_r = M[..., :b, :b] + cross + np.swapaxes(cross, -1, -2) + pt @ M[..., b:, b:] @ psi
    K_r = K[..., :b, :b] + K[..., :b, b:] @ psi
    return (K_r + np.swapaxes(K_r, -1, -2)) / 2, M_r


class LowOrderAssembler:
    """Numbers the low-order coordinates of a plan and assembles its reduced parts."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.reducers = {name: PartReducer(part) for name, part in plan.parts.items() if part.has_matrices}
        topology = plan.topology
        kept = np.zeros(topology.n_nodes, dtype=bool)
        for name, reducer in self.reducers.items():
            kept[topology.root[self._numbers(name, reducer.part.boundary)]] = True
        self.physical = np.flatnonzero((topology.dof >= 0) & kept[:, None])
        """Positions of the physical coordinates in the flattened (node, DOF) table."""
        self._dof = np.full(topology.dof.size, -1, dtype=np.intp)
        self._dof[self.physical] = np.arange(len(self.physical))
        self._dof = self._dof.reshape(topology.dof.shape)
        self._starts: dict[int, Eigenpairs] = {}
        self._scatters: dict[tuple[int, ...], Scatter] = {}
        self._remembered: tuple[Geometry, dict[str, Array]] | None = None

    def _numbers(self, name: str, nodes: Index) -> Index:
        return np.array(self.plan.topology.placed[name].offset, dtype=np.intp)[:, None] + nodes

    def coordinates(self, name: str, modes: int, first: int) -> Index:
        """Low-order coordinate (copies, b + modes) of every coordinate of a reduced part; -1 where held."""
        topology = self.plan.topology
        number = self._numbers(name, self.reducers[name].part.boundary)
        physical = self._dof[topology.root[number]].reshape(len(number), -1)
        modal = first + np.arange(len(number) * modes).reshape(len(number), modes)
        return np.hstack([physical, modal])

    def transforms(self, geometry: Geometry) -> dict[str, Array]:
        """Block-diagonal boundary transforms (..., copies, b, b) per prototype, kept while geometry stays the same."""
        if self._remembered is None or self._remembered[0] is not geometry:
            G = {
                name: block_diagonal(self.plan.node_transforms(name, reducer.part.boundary, geometry))
                for name, reducer in self.reducers.items()
            }
            self._remembered = (geometry, G)
        return self._remembered[1]

    def scatter(self, modes: tuple[int, ...]) -> Scatter:
        """Assembly pattern for so many kept modes per prototype."""
        if modes not in self._scatters:
            first = len(self.physical)
            dofs = []
            for name, k in zip(self.reducers, modes, strict=True):
                dofs.append(self.coordinates(name, k, first))
                first += k * len(dofs[-1])
            self._scatters[modes] = Scatter(dofs, first)
        return self._scatters[modes]

    def start(self, count: int) -> Eigenpairs:
        """Eigenpairs of the default design from which the iteration for `count` frequencies of others starts."""
        if count not in self._starts:
            K, M = self.stack(self.plan.values())
            self._starts[count] = lowest(K, M, count + GUARD)
        return self._starts[count]

    def stack(self, values: Array) -> tuple[Array, Array]:
        """K and M (..., n, n) with constraint modes alone for slot values (..., s): the paper's model, every design."""
        lead = values.shape[:-1]
        geometry = self.plan.geometry(values)
        matrices = self.plan.matrices(values, geometry)
        transforms = self.transforms(geometry)
        K, M = [], []
        for name, reducer in self.reducers.items():
            T = transforms[name]
            k, m = reducer.condensed(matrices[name], geometry, lead)
            Tt = np.swapaxes(T, -1, -2)
            K.append(Tt @ k[..., None, :, :] @ T)
            M.append(Tt @ m[..., None, :, :] @ T)
        scatter = self.scatter((0,) * len(self.reducers))
        return scatter.dense(K, lead), scatter.dense(M, lead)


@dataclass(frozen=True)
class LowOrderModel:
    """K and M of the low-order model, and how to get every physical displacement back (theory eqs. 41-43).

    K, M: (n, n), dense arrays up to order 1500, else sparse; rows follow `coordinate_names`: physical DOFs of kept
    nodes, then amplitudes of fixed-interface normal modes. `parts` holds each prototype's reduction.
    """

    plan: Plan
    values: Array
    geometry: Geometry
    K: Any
    M: Any
    parts: dict[str, ReducedPart]
    assembler: LowOrderAssembler

    @property
    def order(self) -> int:
        """Number of coordinates."""
        return self.K.shape[0]

    @cached_property
    def coordinate_names(self) -> list[str]:
        """Names of the coordinates, e.g. `platform.rz` or `branch1.amplifier mode 2`."""
        topology = self.plan.topology
        nodes, components = np.unravel_index(self.assembler.physical, topology.dof.shape)
        names = topology.node_names
        labels = [f"{names[n]}.{DOF_NAMES[c]}" for n, c in zip(nodes, components, strict=True)]
        for name, part in self.parts.items():
            for path in topology.placed[name].paths:
                where = ".".join(path) or "mechanism"
                labels += [f"{where} mode {k + 1}" for k in range(len(part.frequencies))]
        return labels

    @cached_property
    def recovery(self) -> sp.csr_matrix:
        """T (full order, low order): all DOFs of the full-order model from the low-order coordinates."""
        topology = self.plan.topology
        rows = [topology.dof.ravel()[self.assembler.physical]]
        columns = [np.arange(len(rows[0]))]
        entries = [np.ones(len(rows[0]))]
        first = len(rows[0])
        for name, part in self.parts.items():
            own = self.assembler.reducers[name].part
            if len(own.interior):
                column = self.assembler.coordinates(name, len(part.frequencies), first)
                row, value = self._interior_rows(name, part)
                keep = np.broadcast_to((column >= 0)[:, None, :], value.shape)
                rows.append(np.broadcast_to(row[:, :, None], value.shape)[keep])
                columns.append(np.broadcast_to(column[:, None, :], value.shape)[keep])
                entries.append(value[keep])
            first += len(part.frequencies) * len(topology.placed[name].paths)
        where = (np.concatenate(rows), np.concatenate(columns))
        return sp.csr_matrix((np.concatenate(entries), where), shape=(topology.n_dof, self.order))

    def _interior_rows(self, name: str, part: ReducedPart) -> tuple[Index, Array]:
        """Full-order DOF numbers (copies, i) of the interior and their recovery (copies, i, b + k), global frame."""
        topology, reducer = self.plan.topology, self.assembler.reducers[name]
        interior = reducer.part.interior
        number = np.array(topology.placed[name].offset)[:, None] + interior
        G = self.plan.node_transforms(name, interior, self.geometry)
        Tb = self.assembler.transforms(self.geometry)[name]
        b = Tb.shape[-1]
        own = part.T[reducer.interior_dofs]
        local = np.concatenate([own[:, :b] @ Tb, np.broadcast_to(own[:, b:], (len(Tb), *own[:, b:].shape))], axis=-1)
        blocks = local.reshape(len(Tb), len(interior), 6, -1)
        value = np.swapaxes(G, -1, -2) @ blocks
        return topology.dof[number].reshape(len(Tb), -1), value.reshape(*local.shape)

    def recover(self, coordinates: Array) -> Array:
        """Full-order DOF vectors (full order, k) for low-order coordinates (n, k)."""
        return self.recovery @ coordinates


def low_order(plan: Plan) -> LowOrderAssembler:
    """The prepared low-order assembly of a plan, made on first use and kept with the plan."""
    if "low_order" not in plan.prepared:
        plan.prepared["low_order"] = LowOrderAssembler(plan)
    return plan.prepared["low_order"]


def reduce(
    mechanism: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    keep: int | Mapping[str, int] = 0,
    keep_below: float = 0.0,
) -> LowOrderModel:
    """Reduce a mechanism by Craig-Bampton: constraint modes of every substructure, and normal modes on request.

    `keep` is the number of fixed-interface normal modes kept in each substructure (or a number by prototype name);
    `keep_below` keeps all below that frequency, Hz. With neither this is the model of the RPR paper.
    Raises ModelError for a description that cannot be used, OptionError for impossible options.
    """
    plan, single = plan_of(mechanism), one_design(parameters)
    assembler = low_order(plan)
    counts = _counts(assembler, keep)
    if not (np.isfinite(keep_below) and keep_below >= 0):
        raise OptionError(f"keep_below is a frequency in Hz, zero or more, not {keep_below}")
    plan.verify(single)
    values = plan.values(single)
    geometry = plan.geometry(values)
    matrices = plan.matrices(values, geometry)
    parts = {
        name: reducer.craig_bampton(matrices[name], counts[name], keep_below)
        for name, reducer in assembler.reducers.items()
    }
    scatter = assembler.scatter(tuple(len(part.frequencies) for part in parts.values()))
    K, M = [], []
    for name, part in parts.items():
        T = _with_modes(assembler.transforms(geometry)[name], len(part.frequencies))
        Tt = np.swapaxes(T, -1, -2)
        K.append(Tt @ part.K @ T)
        M.append(Tt @ part.M @ T)
    build = scatter.dense if scatter.n <= DENSE_ORDER else scatter.sparse
    return LowOrderModel(plan, values, geometry, build(K), build(M), parts, assembler)


def natural_frequencies(
    mechanism: Mechanism | Plan, parameters: Mapping[str, ArrayLike] | None = None, count: int = 6
) -> Array:
    """Lowest natural frequencies, Hz, of the low-order model with constraint modes alone: the quick way for sweeps.

    Parameters may be arrays over designs; the result is (count,) or (designs, count). No evidence comes with these
    numbers; ask `modes` for one design when in doubt. Raises OptionError and SolverError.
    """
    plan = plan_of(mechanism)
    values = plan.values(parameters)
    assembler = low_order(plan)
    if count < 1:
        raise OptionError(f"the number of frequencies is at least 1, not {count}")
    count = min(count, len(assembler.physical))
    stacks = [values] if values.ndim == 1 else [values[k : k + STACK] for k in range(0, len(values), STACK)]
    found = []
    for stack in stacks:
        K, M = assembler.stack(stack)
        _refuse_impossible(K, M)
        found.append(lowest_values(K, M, count, assembler.start(count)))
    values = np.concatenate([np.empty((0, count)), *found]) if values.ndim > 1 else found[0]
    return np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi)


def _refuse_impossible(K: Array, M: Array) -> None:
    """Raise OptionError when a design has come out with a stiffness or mass that is not positive and finite."""
    k, m = (np.einsum("...ii->...i", A) for A in (K, M))
    if not ((k > 0) & np.isfinite(k) & (m >= 0) & np.isfinite(m)).all():
        raise OptionError(
            "a design has a stiffness or mass that is not positive: a size has gone through zero;"
            " `check` with these parameters names it"
        )


def _with_modes(T: Array, k: int) -> Array:
    """Boundary transforms (copies, b, b) bordered by an identity for k modal coordinates."""
    if not k:
        return T
    b = T.shape[-1]
    out = np.zeros((len(T), b + k, b + k))
    out[:, :b, :b] = T
    out[:, np.arange(b, b + k), np.arange(b, b + k)] = 1.0
    return out


def _counts(assembler: LowOrderAssembler, keep: int | Mapping[str, int]) -> dict[str, int]:
    names = list(assembler.reducers)
    if isinstance(keep, Mapping):
        labels = [name or "mechanism" for name in names]
        unknown = sorted(set(keep) - set(labels))
        if unknown:
            known = ", ".join(labels)
            raise OptionError(f"keep names {unknown[0]!r}, which is no substructure with members; there are {known}")
        counts = {name: keep.get(name or "mechanism", 0) for name in names}
    else:
        counts = dict.fromkeys(names, keep)
    for name, count in counts.items():
        if not isinstance(count, int | np.integer) or count < 0:
            raise OptionError(f"the number of kept modes is a whole number, zero or more, not {count!r} ({name})")
    return counts


def _node_dofs(nodes: Any) -> Index:
    return (6 * np.asarray(nodes, dtype=np.intp)[:, None] + np.arange(6)).ravel()


def _node_dofs_each(nodes: Index) -> Index:
    return (6 * nodes[..., None] + np.arange(6)).reshape(len(nodes), 6 * nodes.shape[1])
