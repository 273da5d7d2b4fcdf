"""The low-order model: its matrices, what its coordinates are, and how to get every displacement back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import OptionError, SolverError
from flexura.linalg import factorise, is_definite, scaled, unit_scale
from flexura.mechanism import DOF_NAMES, TOP
from flexura.records import Record
from flexura.reduction.single.assembler import LowOrderAssembler, low_order, with_modes
from flexura.reduction.single.craig_bampton import ReducedPart
from flexura.reduction.single.intervals import Certificate
from flexura.results import Result
from flexura.sizes import within
from flexura.structure import Design, OfDesign, Plan, described_prestress, solve_definite, stiffness_and_mass
from flexura.tables import Facts, Table


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
        topology = self.assembler.plan.topology
        nodes, components = np.unravel_index(self.assembler.physical, topology.dof.shape)
        names = topology.node_names
        labels = [f"{names[n]}.{DOF_NAMES[c]}" for n, c in zip(nodes, components, strict=True)]
        for name, part in self.parts.items():
            for path in topology.copies[name].paths:
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
            own = self.assembler.reducers[name].part
            if len(own.interior):
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
        found = np.empty((topology.n_dof + 1, coordinates.shape[1]))  # DOF -1 goes to the last row
        found[physical] = coordinates[: len(physical)]
        first = len(physical)
        padded = np.vstack([coordinates, np.zeros((1, coordinates.shape[1]))])
        for name, part in self.parts.items():
            own, k = self.assembler.reducers[name].part, len(part.frequencies)
            if len(own.interior):
                q = padded[self.assembler.coordinates(name, k, first)]
                b = q.shape[1] - k
                q[:, :b] = self.assembler.transforms(self.design)[name] @ q[:, :b]
                number = np.array(topology.copies[name].offset)[:, None] + own.interior
                G = self.design.node_transforms(name, own.interior)
                inside = (part.T[self.assembler.reducers[name].interior_dofs] @ q).reshape(*number.shape, 6, -1)
                found[topology.dof[number]] = np.swapaxes(G, -1, -2) @ inside
            first += k * len(topology.copies[name].paths)
        return found[:-1]

    def _interior_rows(self, name: str, part: ReducedPart) -> tuple[Index, Array]:
        """Full-order DOF numbers (copies, i) of the interior and their recovery (copies, i, b + k), global frame."""
        topology, reducer = self.assembler.plan.topology, self.assembler.reducers[name]
        interior = reducer.part.interior
        number = np.array(topology.copies[name].offset)[:, None] + interior
        G = self.design.node_transforms(name, interior)
        Tb = self.assembler.transforms(self.design)[name]
        b = Tb.shape[-1]
        own = part.T[reducer.interior_dofs]
        local = np.concatenate([own[:, :b] @ Tb, np.broadcast_to(own[:, b:], (len(Tb), *own[:, b:].shape))], axis=-1)
        blocks = local.reshape(len(Tb), len(interior), 6, -1)
        value = np.swapaxes(G, -1, -2) @ blocks
        return topology.dof[number].reshape(len(Tb), -1), value.reshape(*local.shape)


@dataclass(frozen=True, repr=False)
class FullBasis(Record):
    """The DOFs of the full-order model themselves."""

    _shown = ("plan",)

    plan: Plan

    @property
    def parts(self) -> dict[str, ReducedPart]:
        """No prototype is reduced."""
        return {}

    @property
    def coordinate_names(self) -> list[str]:
        """E.g. `platform.rz`."""
        return self.plan.topology.dof_names()

    @property
    def recovery(self) -> sp.csr_matrix:
        """All DOFs of the full-order model from the coordinates, which they are."""
        return sp.csr_matrix(sp.identity(self.plan.topology.n_dof, format="csr"))

    def recover(self, coordinates: Array) -> Array:
        """Full-order DOF vectors (full order, k) for coordinates (n, k)."""
        return coordinates


@dataclass(frozen=True, repr=False)
class ProjectedBasis(Record):
    """Coordinates that determine those of another model: q_parent = T q."""

    _shown = ("T", "parent")

    parent: Basis
    T: Any
    coordinate_names: list[str]

    @property
    def parts(self) -> dict[str, ReducedPart]:
        """Each prototype's reduction."""
        return self.parent.parts

    @cached_property
    def recovery(self) -> Any:
        """All DOFs of the full-order model from the coordinates."""
        return self.parent.recover(self.T)

    def recover(self, coordinates: Array) -> Array:
        """Full-order DOF vectors (full order, k) for coordinates (n, k)."""
        return self.parent.recover(self.T @ coordinates)


STATE = "about the state under the loads and gravity that are described"
"""What the stiffness of a mechanism is whose description has loads or gravity."""


def state_of(design: Design) -> tuple[str, ...]:
    """About which state a design is linear, in words; nothing at rest without loads."""
    if (posed := design.posed) is not None:
        return (posed.words,)
    return (STATE,) if design.plan.is_loaded else ()


MOST_NAMED = 4
"""Coordinates and nodes that a notebook names."""

DENSE_ORDER = 1500
"""Up to this order the low-order K and M are dense arrays, beyond it sparse."""

Basis: TypeAlias = SubstructureBasis | FullBasis | ProjectedBasis


@dataclass(frozen=True, repr=False)
class LowOrderModel(OfDesign, Result):
    """K and M of a low-order model, and how to get every physical displacement back.

    K, M: (n, n), dense or sparse, SI; rows follow `coordinate_names`. `steps` say in words what was kept and why.
    Static response is that of the full-order model at the `static_nodes`: `residual` is the flexibility that the
    coordinates alone lack there. `origin` is the model that this one was projected from.
    """

    _shown = ("name", "order", "steps")
    _told = ("name", "order", "parameters", "coordinate_names", "K", "M", "static_nodes", "certificate")

    design: Design
    K: Any
    M: Any
    basis: Basis
    steps: tuple[str, ...] = ()
    static_nodes: tuple[str, ...] = ()
    origin: LowOrderModel | None = None
    certificate: Certificate | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """The steps of the reduction."""
        return self.steps

    @property
    def order(self) -> int:
        """Number of coordinates."""
        return self.K.shape[0]

    def _view(self) -> Iterator[Facts | Table]:
        names = self.coordinate_names
        coordinates = ", ".join(names[:MOST_NAMED]) + (", ..." if len(names) > MOST_NAMED else "")
        proven = "" if self.certificate is None else self.certificate.text
        static = ", ".join(self.static_nodes[:MOST_NAMED]) + (", ..." if len(self.static_nodes) > MOST_NAMED else "")
        order = f"{self.order} of {self.plan.topology.n_dof}"
        yield Facts({"order": order, "coordinates": coordinates, "static response exact at": static, "proven": proven})
        if self.certificate is not None:
            yield from self.certificate._view()

    @property
    def coordinate_names(self) -> list[str]:
        """Names of the coordinates, e.g. `platform.rz` or `branch1.amplifier mode 2`."""
        return self.basis.coordinate_names

    @property
    def parts(self) -> dict[str, ReducedPart]:
        """Each prototype's reduction."""
        return self.basis.parts

    @property
    def recovery(self) -> Any:
        """T (full order, n): all DOFs of the full-order model from the coordinates, sparse or dense."""
        return self.basis.recovery

    def recover(self, coordinates: Array) -> Array:
        """Full-order DOF vectors (full order, k) for low-order coordinates (n, k)."""
        return self.basis.recover(coordinates)

    def node_rows(self, nodes: Sequence[str]) -> Array:
        """B (6k, n): displacements tx ty tz rx ry rz of named nodes, global frame, from the coordinates.

        Raises OptionError for names that are no nodes.
        """
        numbers = self.plan.topology.numbers(nodes)
        rows = self.design.node_rows(numbers) @ self.recovery
        return np.asarray(rows.toarray() if hasattr(rows, "toarray") else rows)

    def compliance(self, nodes: Sequence[str] | None = None) -> Array:
        """Static displacements (6k, 6k) of named nodes per unit force and moment at them, m/N, rad/N, rad/(N m).

        Equal to the full-order model's at the `static_nodes`, which are taken when none are named. Raises OptionError
        for other nodes and SolverError when something can move freely.
        """
        nodes = self.static_nodes if nodes is None else tuple(nodes)
        unknown = sorted(set(nodes) - set(self.static_nodes))
        if unknown:
            known = ", ".join(self.static_nodes) or "none"
            raise OptionError(f"static response is exact at {known}; name {unknown[0]} in `static_at` when reducing")
        within("dense_entries", 6 * len(nodes) * self.order, f"the compliance at {len(nodes)} nodes")
        if self.origin is not None:
            found = self.origin.compliance(nodes)
        elif self.plan.is_loaded and not isinstance(self.basis, FullBasis):
            found = self._full_flexibility(nodes)
        else:
            found = self._own_flexibility(nodes)
        return (found + found.T) / 2

    @cached_property
    def residual(self) -> Array | None:
        """Flexibility (6k, 6k) at the static nodes that the coordinates alone lack; None where they lack none.

        Constraint modes are static shapes without load, so that under loads they lack some too.
        """
        if self.origin is None and not self.plan.is_loaded:
            return None
        lost = self.compliance() - self._own_flexibility(self.static_nodes)
        return (lost + lost.T) / 2

    def _full_flexibility(self, nodes: Sequence[str]) -> Array:
        """Flexibility (6k, 6k) at named nodes of the full-order model."""
        K, _ = stiffness_and_mass(self.design)
        rows = self.design.node_rows(self.plan.topology.numbers(nodes)).toarray()
        return np.asarray(rows @ solve_definite(K, rows.T))

    def _own_flexibility(self, nodes: Sequence[str]) -> Array:
        """Flexibility (6k, 6k) at named nodes of the coordinates alone."""
        if not is_definite(self.K):
            raise SolverError("static response is undefined: something can move freely")
        B = self.node_rows(nodes)
        if not isinstance(self.K, np.ndarray):
            return B @ factorise(self.K).solve(B.T)
        d = unit_scale(self.K)
        return (B * d) @ la.cho_solve(la.cho_factor(scaled(self.K, d)), d[:, None] * B.T)

    def projected(self, T: Any, names: list[str], step: str) -> LowOrderModel:
        """The model in fewer coordinates q with this one's = T q, T (n, r); static response at the static nodes stays
        exact, by their `residual` flexibility (theory eq. R1).

        K and M become T' K T and T' M T.
        """
        K, M = (np.asarray(T.T @ (A @ T)) for A in (self.K, self.M))
        basis, steps = ProjectedBasis(self.basis, T, names), (*self.steps, step)
        return replace(self, K=(K + K.T) / 2, M=(M + M.T) / 2, basis=basis, steps=steps, origin=self, certificate=None)

    def in_modes(self, values: Array, T: Array, step: str) -> LowOrderModel:
        """The model in its own modes T (n, r), M-orthonormal, with squared frequencies `values` (r,) that are known to
        more digits than K has."""
        names = [f"mode {k + 1}" for k in range(len(values))]
        return replace(self.projected(T, names, step), K=np.diag(values), M=np.eye(len(values)))


def assembled(
    assembler: LowOrderAssembler, design: Design, parts: dict[str, ReducedPart], exact_at: tuple[str, ...]
) -> LowOrderModel:
    """The low-order model made of reduced parts, each placed as often as its prototype."""
    scatter = assembler.scatter(tuple(len(part.frequencies) for part in parts.values()))
    K, M = [], []
    for name, part in parts.items():
        T = with_modes(assembler.transforms(design)[name], len(part.frequencies))
        Tt = np.swapaxes(T, -1, -2)
        K.append(Tt @ part.K @ T)
        M.append(Tt @ part.M @ T)
    build = scatter.dense if scatter.n <= DENSE_ORDER else scatter.sparse
    basis = SubstructureBasis(design, parts)
    own, mass = ((A + A.T) / 2 if isinstance(A, np.ndarray) else A for A in (build(K), build(M)))
    if design.plan.is_loaded:
        added = basis.recovery.T @ described_prestress(design).K_g @ basis.recovery
        added = sp.csc_matrix((added + added.T) / 2)
        own = own + added.toarray() if isinstance(own, np.ndarray) else sp.csc_matrix(own + added)
    steps = (kept_modes({name: len(part.frequencies) for name, part in parts.items()}), *state_of(design))
    return LowOrderModel(design, own, mass, basis, steps, exact_at)


def kept_modes(counts: Mapping[str, int]) -> str:
    """What is kept of each prototype, in words."""
    kept = [f"{count} of {name or 'mechanism'}" for name, count in counts.items() if count]
    return "constraint modes of every substructure" + (f", normal modes: {', '.join(kept)}" if kept else "")


def static_nodes(assembler: LowOrderAssembler, names: Sequence[str] | None) -> tuple[str, ...]:
    """The nodes at which static response stays exact: those named, else the mechanism's interface, else its rigid
    bodies, else its own kept nodes.

    Raises OptionError for a name that is no node, or a node that the reduction removes.
    """
    plan = assembler.plan
    topology = plan.topology
    chosen = plan.layout.interface(TOP) if names is None else names
    if names is None and not chosen:
        chosen = plan.body_names or plan.parts[TOP].node_names[: plan.parts[TOP].n_own]
    kept = set(np.unravel_index(assembler.physical, topology.dof.shape)[0].tolist())
    found = []
    for name, root in zip(chosen, topology.root[topology.numbers(chosen)], strict=True):
        if int(root) in kept:
            found.append(name)
        elif names is not None and not topology.held[root].all():
            raise OptionError(f"node {name} is inside a substructure and is removed; make it an interface of that")
    return tuple(found)
