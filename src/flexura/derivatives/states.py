"""What a design is in one state: linear about the undeformed configuration or the loads that are described, or in
equilibrium with large displacements.

A state is asked the same whether or not the values of its design have slopes. Where they have, so has every answer, by
the parameters of the design, those of the state itself included: forces are worked out in the state by the code that
found it, and what they miss of equilibrium says how the state moves (theory eq. V5); at the state that moves along,
whatever is worked out has its total derivative.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from flexura.analysis import LargestStresses, Rounding, deformations, largest_stresses, preload
from flexura.analysis import end_forces as linear_end_forces
from flexura.arrays import Array, Index
from flexura.derivatives.eigenpairs import clusters
from flexura.derivatives.families import FullOrderFamily
from flexura.duals import Dual, plain, slope_of
from flexura.errors import SolverError
from flexura.linalg import critical_shapes
from flexura.mechanism import DISPLACEMENTS
from flexura.motion import (
    at_pose,
    buckling_factor,
    reached,
    warming_load,
)
from flexura.records import Record
from flexura.reduction import flexibility
from flexura.structure import Design, FullOrderModel, InputPort, Ports, dead_load, full_order_model, one_design
from flexura.thresholds import CROSS_COMPLIANCE, ROUND_OFF

LOWEST_FACTORS = 4
"""Buckling factors that are worked out, to see whether the lowest is repeated."""

UNKNOWN_STRESS = "no stress is known of sections that are given by constants"

MISSING_SHARES = (1e-3, 1e-2, 1e-1, 1.0)
"""Shares of what is missing of equilibrium in which slopes of forces are told apart, the finest one first."""


def without_round_off(displacement: Any, bound: Any) -> Any:
    """Displacements by forces elsewhere, zero where they are round-off of the bound that stands for C_ii C_jj."""
    return np.where(abs(displacement) < CROSS_COMPLIANCE * np.sqrt(abs(bound)), 0.0, displacement)


class Repeated(NamedTuple):
    """An eigenvalue of multiplicity m, numbers `at` (m,), with the derivatives (P, m, m) of its space: their
    eigenvalues are the slopes of the branches into which it goes as a parameter moves (theory eq. K5)."""

    at: list[int]
    value: float
    slope: Array

    @property
    def lowest(self) -> Dual:
        """The eigenvalue with the slopes of the lowest of its branches."""
        return Dual(np.array(self.value), np.linalg.eigvalsh(self.slope)[:, 0])


def repeated_groups(values: Array, vectors: Array) -> Iterator[tuple[list[int], float, Array]]:
    """Eigenvalues that are repeated together: their numbers, their mean, and their vectors (n, m)."""
    for at in clusters(values):
        yield at, float(np.mean(values[at])), vectors[:, at]


class State(Record):
    """What both kinds of states are asked; m, rad, N, N m, Pa, Hz. Displacements are named `NODE.AXIS`, as
    `carriage.y` or `platform.rz`, and those of `move` are prescribed. A slope is NaN where members or sections are
    stressed alike and part as a parameter moves, where something is zero of which the size counts, and at kinks of a
    description.

    Raises OptionError for unknown names, and SolverError where the state has lost its stiffness.
    """

    design: Design
    move: Mapping[str, Any]

    @property
    def has_slopes(self) -> bool:
        """Whether what is read has slopes."""
        return isinstance(self.design.values, Dual)

    @property
    def held(self) -> State:
        """The state with what is prescribed held, but for what is asked of: itself."""
        return self

    @property
    def free(self) -> State:
        """The state with nothing held but by forces that stay as they are: itself, where nothing is asked to be
        held."""
        return self

    def rows(self, node: str) -> Any:
        """Displacements (6, n) of a node from the free displacements."""
        raise NotImplementedError

    def displacement(self, node: str) -> Any:
        """Displacement (6,) of a node from the undeformed configuration, with its rotation vector."""
        raise NotImplementedError

    def flexibility(self, rows: Any, held: Sequence[str] = ()) -> Any:
        """Motions (k, k) along rows (k, n) over the free displacements per unit force along each, with the prescribed
        displacements of some names held, the others free under their forces."""
        raise NotImplementedError

    def stresses_within(self, share: float) -> LargestStresses:
        """As `stresses`, where slopes of forces count as equal that differ by less than a share of the residual of
        equilibrium."""
        raise NotImplementedError

    @property
    def buckling_factor(self) -> Repeated | None:
        """The factor on all loads, and forces that hold it, at which the state would buckle; None where nothing
        does."""
        raise NotImplementedError

    @property
    def _at(self) -> Design:
        """The design where it is."""
        raise NotImplementedError

    @cached_property
    def _ports(self) -> Ports:
        return Ports(self._at)

    def row(self, displacement: str) -> Any:
        """The row (n,) that reads a displacement."""
        node, _, axis = displacement.rpartition(".")
        return self.rows(node)[DISPLACEMENTS.index(axis)]

    def input(self, actuator: str) -> InputPort:
        """The input of an actuator."""
        return self._ports.inputs([actuator])[0]

    def _moved(self, to: Any, by: Any, held: Sequence[str] = ()) -> tuple[Any, Any]:
        """What moves along a row by a unit force along another, zero where it is round-off, and what moves along this
        one itself."""
        C = self.flexibility(np.stack([to, by]), held)
        return C[0, 1] if self.has_slopes else float(without_round_off(C[0, 1], C[0, 0] * C[1, 1])), C[1, 1]

    def compliance(self, to: str, by: str) -> Any:
        """Displacement per force or moment, the prescribed displacements held but for those asked of."""
        held = [name for name in self.move if name not in (to, by)]
        return self._moved(self.row(to), self.row(by), held)[0]

    def coupling(self, actuator: str, to: str) -> Any:
        """Displacement per unit command, nothing held but by forces that stay as they are."""
        port = self.input(actuator)
        return self._moved(self.row(to), port.row)[0] * port.gain

    def drift(self, temperature: str, to: str) -> Any:
        """Displacement by a unit of a state of temperature, linear from here, nothing held but by forces that stay as
        they are."""
        raise NotImplementedError

    def amplification(self, actuator: str, to: str) -> Any:
        """Displacement per elongation of the actuator that makes it."""
        port = self.input(actuator)
        moved, elongation = self._moved(self.row(to), port.row)
        return moved * port.gain / abs(elongation * port.gain)

    @cached_property
    def stresses(self) -> LargestStresses:
        """The largest stresses, (m, 1), in the members whose sections are known."""
        return self.stresses_within(0.0)

    def stressed(
        self, members: Collection[str] | None, over_yield: bool, share: float = 0.0
    ) -> tuple[list[str], Any, Any]:
        """Names of some members, of all by default, their largest stresses (m,) and their yield stresses, all of which
        are known where they are looked at `over_yield`; `share` as in `stresses_within`."""
        stresses = self.stresses_within(share) if share else self.stresses
        limit, size = stresses.yield_stress, stresses.von_mises[:, 0]
        if not isinstance(size, Dual):
            size = np.where(size > ROUND_OFF * size[np.isfinite(size)].max(initial=0.0), size, 0.0)
        chosen = [
            k
            for k, name in enumerate(stresses.names)
            if (members is None or name in members) and not (over_yield and np.isnan(plain(limit)[k]))
        ]
        return [stresses.names[k] for k in chosen], size[chosen], limit[chosen]

    def stress(self, members: Collection[str] | None = None) -> Any:
        """The largest von Mises stress, notch factors included, of all members or of some, of sections that are
        known."""
        if not self.stressed(members, over_yield=False)[0]:
            raise SolverError(UNKNOWN_STRESS)
        return _settled(lambda share: np.max(self.stressed(members, False, share)[1]))

    def margin(self, members: Collection[str] | None = None) -> Any:
        """The least yield stress over stress of all members or of some, of those whose yield stress is known."""
        if not self.stressed(members, over_yield=True)[0]:
            return np.inf

        def least(share: float) -> Any:
            _, stress, limit = self.stressed(members, True, share)
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.min(limit / stress)

        return _settled(least)

    @property
    def largest_yield_ratio(self) -> Any:
        """The largest stress over yield stress of all members whose yield stress is known."""

        def largest(share: float) -> Any:
            _, stress, limit = self.stressed(None, True, share)
            return np.max(stress / limit)

        return _settled(largest)

    @property
    def buckling(self) -> Any:
        """The least factor on all loads, and on forces that hold it, at which it buckles; infinite where nothing
        does."""
        factor = self.buckling_factor
        return np.inf if factor is None else factor.lowest


def _settled(read: Callable[[float], Any]) -> Any:
    """What is read of the stresses in a state whose slopes of forces are told apart in a share of what is missing of
    equilibrium, the least one, if any, at which it has a derivative by a parameter.

    Stresses that are alike have one where their slopes are; round-off parts these.
    """
    stress = read(0.0)
    for share in MISSING_SHARES:
        if not isinstance(stress, Dual) or not np.isnan(stress.slope).any():
            break
        stress = Dual(stress.value, np.where(np.isnan(stress.slope), slope_of(read(share)), stress.slope))
    return stress


def rounding_to(parameters: Mapping[str, Any], missing: Any, dof: Index, share: float) -> Rounding:
    """What rounds slopes of internal forces (i, m, stations, k, 6) of members of lengths (m,) to a `share` of what is
    `missing` (n,) of equilibrium, with slopes, on the free displacements that `dof` (frames, 6) numbers; others have
    -1.

    That is what the state misses over the size of the parameter, and what its slope misses, which exact numbers would
    not, in norms of all forces and of all moments, forces with a member's length for an arm; slopes are known to it
    upwards and downwards, so that steps are twice as large. By parameters that are zero slopes stay.
    """
    parts = share * np.concatenate([missing.value[None], slope_of(missing)])
    turns = np.zeros(parts.shape[1] + 1, dtype=bool)
    turns[dof[:, 3:]] = True
    norms = [np.linalg.norm(parts[:, turns[:-1] == turning], axis=1) for turning in (False, True)]
    sizes = sum(np.abs(x.value * x.slope) for x in parameters.values() if isinstance(x, Dual))
    with np.errstate(divide="ignore"):
        lost, turned = (np.reshape(norm[0] / sizes + norm[1:], (-1, 1, 1, 1, 1, 1)) for norm in norms)

    def rounded(force: Any, length: Any) -> Any:
        arm = plain(length)[:, None, None, None] * np.array([0.0, 0, 0, 1, 1, 1])
        forces = np.array([1.0, 1, 1, 0, 0, 0])
        step = 2 * np.where(forces > 0, lost, lost * arm + turned)
        known = np.isfinite(step) & (step > 0)
        step = np.where(known, step, 1.0)
        return Dual(force.value, np.where(known, np.round(force.slope / step) * step, force.slope))

    return rounded


@dataclass(frozen=True, repr=False)
class LinearState(State):
    """A design, linear about where its description leaves it: the undeformed configuration, or the loads and gravity,
    or without slopes the pose, that are described.

    Raises OptionError where a pose is described and slopes are wanted, and SolverError where something can move freely
    or loads are beyond buckling.
    """

    _shown = ("design",)

    design: Design
    move: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def model(self) -> FullOrderModel:
        """The full-order model, the design of which may have slopes, its matrices not."""
        if not self.has_slopes:
            return full_order_model(at_pose(self.design))
        self.design.plan.refuse_pose("derivatives of what is linear")
        return replace(full_order_model(self.design.still), design=self.design)

    @property
    def _at(self) -> Design:
        return self.model.design

    @cached_property
    def _solve(self) -> Callable[[Array], Array]:
        return flexibility(replace(self.model, design=self._at.still)).held

    @cached_property
    def _by_row(self) -> dict[bytes, tuple[Array, Array]]:
        return {}

    def _by(self, row: Array) -> tuple[Array, Array]:
        """Displacements u (n,) by a unit force along a row (n,), and K' u (P, n); each worked out once."""
        key = row.tobytes()
        if key not in self._by_row:
            u = self._solve(np.ascontiguousarray(row[:, None]))
            self._by_row[key] = u[:, 0], self._stiffness_changes(u)[..., 0]
        return self._by_row[key]

    def moved_by(self, rows: Sequence[Array]) -> Array:
        """Displacements (n, k) by a unit force along each of some rows (n,)."""
        return np.column_stack([self._by(row)[0] for row in rows])

    def rows(self, node: str) -> Any:
        """As `State.rows`."""
        return self._at.dense_rows(self._at.plan.topology.numbers([node]))

    def displacement(self, node: str) -> Any:
        """As `State.displacement`: linear, of loads and gravity, or at the pose that is described."""
        if self.design.plan.is_posed:
            return reached(self.design).pose.displacement(int(self.design.plan.topology.numbers([node])[0]))
        return self.rows(node) @ self._loaded[:, 0]

    def flexibility(self, rows: Any, held: Sequence[str] = ()) -> Any:  # noqa: ARG002
        """As `State.flexibility`; nothing is prescribed (theory eq. V3)."""
        G = plain(rows)
        by = [self._by(row) for row in G]
        C = np.array([[row @ u for u, _ in by] for row in G])
        C = (C + C.T) / 2
        if not self.has_slopes:
            return C
        x = self.moved_by(G)
        moved = slope_of(rows) @ x if isinstance(rows, Dual) else np.zeros((1, *C.shape))
        change = moved - np.stack([force @ x for _, force in by], axis=1) / 2
        return Dual(C, change + np.swapaxes(change, 1, 2))

    def response(self, load: Any) -> Any:
        """Displacements (n, k) under loads (n, k): u' = K^-1 (f' - K' u) (theory eq. V1)."""
        u = self._solve(plain(load))
        if not self.has_slopes:
            return u
        residual = -self._stiffness_changes(u)
        if isinstance(load, Dual):
            residual = residual + load.slope
        columns = np.moveaxis(residual, 0, 1).reshape(len(u), -1)
        slope = self._solve(columns).reshape(len(u), len(residual), -1)
        return Dual(u, np.moveaxis(slope, 1, 0))

    def drift(self, temperature: str, to: str) -> Any:
        """As `State.drift` (theory eq. W16)."""
        node, _, axis = to.rpartition(".")
        load, grown = warming_load(self._at, temperature)
        beside = grown[int(self._at.plan.topology.numbers([node])[0]), DISPLACEMENTS.index(axis)]
        return self.row(to) @ self.response(load[:, None])[:, 0] + beside

    def _stiffness_changes(self, X: Array, loaded: bool = True) -> Array:
        """K' X (P, n, k), with or without the geometric stiffness of described loads; NaN at kinks."""
        if not self.has_slopes:
            return np.zeros((0, *X.shape))
        changes = FullOrderFamily(self.design.plan, loaded=loaded).changes_of(self.design, X)
        return np.stack([change.K if change.is_smooth else change.K * np.nan for change in changes])

    def stresses_within(self, share: float) -> LargestStresses:
        """As `State.stresses_within`, under the loads and gravity that are described."""
        design = self.design
        missing = rounding_to(design.parameters, self._residual, design.plan.topology.dof, share) if share else None
        gravity = design.plan.loads.gravity(design.values)
        weight = gravity if gravity.any() else None

        def forces(name: str) -> tuple[Array, Array]:
            return linear_end_forces(self.model, name, self._loaded, weight)

        return largest_stresses(self.model, forces, deformations(self.model, self._loaded), 1, rounding=missing)

    @cached_property
    def _load(self) -> Any:
        """The loads and gravity (n, 1) that are described."""
        loads, values = self.design.plan.loads, self.design.values
        return dead_load(self.model, loads.gravity(values), loads.wrenches(values))[:, None]

    @cached_property
    def _loaded(self) -> Any:
        """Displacements (n, 1) under them."""
        return self.response(self._load)

    @cached_property
    def _residual(self) -> Any:
        """f - K u (n,) of these."""
        return (self._load - FullOrderFamily(self.design.plan).forces_of(self.design, self._loaded))[:, 0]

    @property
    def buckling(self) -> Any:
        """As `State.buckling`."""
        if self.has_slopes:
            return super().buckling
        if not self.design.plan.is_posed:
            return preload(self.design.plan, one_design(self.design.parameters)).buckling_factor
        factor = buckling_factor(reached(self.design).pose)
        return np.inf if factor is None else factor

    @property
    def buckling_factor(self) -> Repeated | None:
        """As `State.buckling_factor`, on the described loads and gravity (theory eq. V4)."""
        loaded = preload(self.design.plan, one_design(self.design.still.parameters))
        factors, shapes = critical_shapes(loaded.model.K, loaded.K_g, LOWEST_FACTORS)
        if not len(factors):
            return None
        at, value, x = next(repeated_groups(factors, shapes))
        elastic, whole = (self._stiffness_changes(x, with_loads) for with_loads in (False, True))
        slope = value * (x.T @ ((1 - value) * elastic + value * whole))
        return Repeated(at, value, (slope + np.swapaxes(slope, 1, 2)) / 2)
