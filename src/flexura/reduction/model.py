"""The low-order model: its matrices, what its coordinates are, how to get every displacement back, and its certificate.

It is made of the substructures of a design: each prototype once at rest, every copy as it is at a pose.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, count_below, factorise, is_definite, lowest, ritz_pairs, scaled, unit_scale
from flexura.mechanism import TOP
from flexura.records import Record
from flexura.reduction.assembly import LowOrderAssembler, SubstructureBasis, with_modes
from flexura.reduction.certificates import HERTZ, SPARE_PAIRS, Certificate, certificate, cluster_end, more_pairs
from flexura.reduction.chained_model import ChainedModel, chained
from flexura.reduction.parts import CraigBampton, ReducedPart
from flexura.results import Result
from flexura.sizes import within
from flexura.structure import (
    Design,
    FullOrderModel,
    OfDesign,
    Plan,
    Posed,
    described_prestress,
    full_order_model,
    solve_definite,
    stiffness_and_mass,
)
from flexura.tables import Facts, Item

STATE = "about the state under the loads and gravity that are described"
"""What the stiffness of a mechanism is whose description has loads or gravity."""

MOST_NAMED = 4
"""Coordinates and nodes that a notebook names."""

DENSE_ORDER = 1500
"""Up to this order the low-order K and M are dense arrays, beyond it sparse."""

LOST_DIGITS = 1e-6
"""Relative difference of squared frequencies from those in energies at which K of a model has lost too many digits."""

WHOLE_SPACE = 400
"""Up to this order a model whose K has lost its digits is solved in energies."""


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


def state_of(design: Design) -> tuple[str, ...]:
    """About which state a design is linear, in words; nothing at rest without loads."""
    if (posed := design.posed) is not None:
        return (posed.words,)
    return (STATE,) if design.plan.is_loaded else ()


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

    def presentation(self) -> Iterator[Item]:
        names = self.coordinate_names
        coordinates = ", ".join(names[:MOST_NAMED]) + (", ..." if len(names) > MOST_NAMED else "")
        proven = "" if self.certificate is None else self.certificate.text
        static = ", ".join(self.static_nodes[:MOST_NAMED]) + (", ..." if len(self.static_nodes) > MOST_NAMED else "")
        order = f"{self.order} of {self.plan.topology.n_dof}"
        yield Facts({"order": order, "coordinates": coordinates, "static response exact at": static, "proven": proven})
        if self.certificate is not None:
            yield from self.certificate.presentation()

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
            compliance = self.origin.compliance(nodes)
        elif self.plan.is_loaded and not isinstance(self.basis, FullBasis):
            compliance = self._full_flexibility(nodes)
        else:
            compliance = self._own_flexibility(nodes)
        return (compliance + compliance.T) / 2

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
        Tt = T.mT
        K.append(Tt @ part.K @ T)
        M.append(Tt @ part.M @ T)
    build = scatter.dense if scatter.n <= DENSE_ORDER else scatter.sparse
    basis = SubstructureBasis(design, parts)
    stiffness, mass = ((A + A.T) / 2 if isinstance(A, np.ndarray) else A for A in (build(K), build(M)))
    if design.plan.is_loaded:
        added = basis.recovery.T @ described_prestress(design).K_g @ basis.recovery
        added = sp.csc_matrix((added + added.T) / 2)
        is_dense = isinstance(stiffness, np.ndarray)
        stiffness = stiffness + added.toarray() if is_dense else sp.csc_matrix(stiffness + added)
    steps = (kept_modes({name: len(part.frequencies) for name, part in parts.items()}), *state_of(design))
    return LowOrderModel(design, stiffness, mass, basis, steps, exact_at)


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
    chosen = plan.layout.prototypes[TOP].interface if names is None else names
    if names is None and not chosen:
        chosen = plan.moving_bodies or plan.parts[TOP].node_names[: plan.parts[TOP].n_own]
    kept = set(np.unravel_index(assembler.physical, topology.dof.shape)[0].tolist())
    static = []
    for name, root in zip(chosen, topology.root[topology.numbers(chosen)], strict=True):
        if int(root) in kept:
            static.append(name)
        elif names is not None and not topology.held[root].all():
            raise OptionError(f"node {name} is inside a substructure and is removed; make it an interface of that")
    return tuple(static)


@verb
def certify(
    low: LowOrderModel, full: FullOrderModel | None = None, *, n: int = 6, up_to: float | None = None
) -> Certificate:
    """Prove intervals for the `n` lowest frequencies of a low-order model, or for all up to `up_to` Hz.

    Upper bounds are Ritz values, lower bounds those of Lehmann and Maehly; where the low-order model misses a mode
    the intervals of Krylov and Weinstein remain (theory eqs. C1-C5). The frequencies are Rayleigh quotients of the
    model's shapes in energies, which K of the model has but for round-off. `full` is assembled when it is not given.
    Raises OptionError for impossible options and SolverError when a factorisation fails.
    """
    if n < 1 or (up_to is not None and not (np.isfinite(up_to) and up_to > 0)):
        raise OptionError("a certificate is for at least one mode, and up to a positive frequency")
    if up_to is not None:
        n = max(count_below(low.K, low.M, (HERTZ * up_to) ** 2), 1)
    reference = chained(full_order_model(low.design) if full is None else full)
    return certificate(reference, model_pairs(low, reference, n), n, up_to)


def model_pairs(low: LowOrderModel, full: ChainedModel, n: int) -> Eigenpairs:
    """The lowest modes of a low-order model as Ritz pairs of the full-order one in its chained coordinates: `n`, all of
    a cluster that n cuts, and the next, which show the gap that follows."""
    pencil, rigid = full.pencil, full.rigid_motions
    count = min(n + SPARE_PAIRS, low.order)
    while True:
        stored = lowest(low.K, low.M, count).finite
        pairs = ritz_pairs(pencil, full.coordinates(low.recover(stored.vectors)), rigid)
        k = len(pairs.values)
        off = np.abs(stored.values[:k] - pairs.values) > LOST_DIGITS * pairs.values
        if (off & (pairs.values > 0)).any() and low.order <= WHOLE_SPACE:
            pairs = ritz_pairs(pencil, full.coordinates(low.recover(_with_mass(low.K, low.M))), rigid)
        if count >= low.order or cluster_end(pairs.values, min(n, k)) < k:
            return pairs
        count = min(more_pairs(count, n), low.order)


def _with_mass(K: Array, M: Array) -> Array:
    """Motions (n, k) that have mass, all others following statically: of points that turn, and have no inertia."""
    mass = np.diagonal(M) > 0
    X = np.eye(len(M))[:, mass]
    X[~mass] = -la.solve(K[np.ix_(~mass, ~mass)], K[np.ix_(~mass, mass)], assume_a="pos")
    return X


def low_order_modes(low: LowOrderModel, model: FullOrderModel, n: int) -> Eigenpairs:
    """The `n` lowest modes (full order, n) of a low-order model of `model`, as `full_order_modes`."""
    full = chained(model)
    pairs = model_pairs(low, full, min(n, low.order)).first(n)
    return Eigenpairs(pairs.values, full.recover(pairs.vectors))


class EqualCopies:
    """At rest the copies of a prototype are equal: one stands for all."""

    def __init__(self, assembler: LowOrderAssembler, design: Design) -> None:
        self.assembler = assembler
        self.design = design
        self.modes: dict[str, CraigBampton] = {
            name: reducer.craig_bampton(design.matrices[name], design.geometry)
            for name, reducer in assembler.reducers.items()
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
            inside = topology.dof[assembler.numbers(name, reducer.part.interior)].ravel()
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
        names = self.assembler.physical_names
        kept: dict[str, int] = {}
        for name, modes in self.modes.items():
            shapes = modes.normal_modes(counts[name]).vectors
            first, kept[name] = len(names), shapes.shape[1]
            T[modes.interior, :b], T[modes.interior, first : first + kept[name]] = modes.constraint_modes, shapes
            names += [f"{name or 'mechanism'} mode {k + 1}" for k in range(kept[name])]
        T = T[:, : len(names)]
        K, M = (T.T @ (A @ T) for A in (self.K, self.M))
        basis = ProjectedBasis(FullBasis(self.design.plan), T, names)
        steps = (kept_modes(kept), *state_of(self.design))
        return LowOrderModel(self.design, (K + K.T) / 2, (M + M.T) / 2, basis, steps, exact_at)


def substructures(assembler: LowOrderAssembler, design: Design) -> EqualCopies | PosedCopies:
    """The substructures of one design. Raises SolverError when one can move freely with its interface held."""
    at = design.posed
    return EqualCopies(assembler, design) if at is None else PosedCopies(assembler, design, at)
