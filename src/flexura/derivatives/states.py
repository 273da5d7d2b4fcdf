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

from flexura.analysis import LargestStresses, Rounding, driven_displacement, largest_stresses, preload
from flexura.analysis import end_forces as linear_end_forces
from flexura.arrays import Array, Index
from flexura.beam import skew
from flexura.derivatives.families import FullOrderFamily
from flexura.duals import Dual, plain, slope_of
from flexura.errors import SolverError
from flexura.linalg import critical_shapes, factorise, is_definite
from flexura.mechanism import DISPLACEMENTS
from flexura.modal import close_groups
from flexura.motion import (
    NO_LOADS,
    Equations,
    Equilibrium,
    Frames,
    Holding,
    Loads,
    MovingModel,
    Path,
    Point,
    Pose,
    PosedDesign,
    Stopped,
    at_pose,
    buckling_factor,
    critical_state,
    described_loads,
    end_forces,
    lowest_of_any,
    material_at,
    reached,
)
from flexura.records import Record
from flexura.reduction import flexibility
from flexura.structure import Design, FullOrderModel, InputPort, Ports, dead_load, full_order_model, one_design
from flexura.thresholds import CROSS_COMPLIANCE, REPEATED_EIGENVALUES, ROUND_OFF, STATIC_ROUND_OFF

LOWEST_FACTORS = 4
"""Buckling factors that are worked out, to see whether the lowest is repeated."""

GUARD = 3
"""Eigenvalues worked out beyond those wanted, to see whether the last one is repeated."""

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


def _groups(values: Array, vectors: Array) -> Iterator[tuple[list[int], float, Array]]:
    """Eigenvalues that are repeated together: their numbers, their mean, and their vectors (n, m)."""
    for group in close_groups(values, REPEATED_EIGENVALUES):
        yield group.tolist(), float(np.mean(values[group])), vectors[:, group]


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


def _rounding(parameters: Mapping[str, Any], missing: Any, dof: Index, share: float) -> Rounding:
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

    def _stiffness_changes(self, X: Array, loaded: bool = True) -> Array:
        """K' X (P, n, k), with or without the geometric stiffness of described loads; NaN at kinks."""
        if not self.has_slopes:
            return np.zeros((0, *X.shape))
        changes = FullOrderFamily(self.design.plan, loaded=loaded).changes_of(self.design, X)
        return np.stack([change.K if change.is_smooth else change.K * np.nan for change in changes])

    def stresses_within(self, share: float) -> LargestStresses:
        """As `State.stresses_within`, under the loads and gravity that are described."""
        design = self.design
        missing = _rounding(design.parameters, self._residual, design.plan.topology.dof, share) if share else None
        gravity = design.plan.loads.gravity(design.values)
        weight = gravity if gravity.any() else None

        def forces(name: str) -> tuple[Array, Array]:
            return linear_end_forces(self.model, name, self._loaded, weight)

        return largest_stresses(self.model, forces, 1, rounding=missing)

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
        return (self._load - FullOrderFamily(self.design.plan).products_of(self.design, self._loaded)[0])[:, 0]

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
        at, value, x = next(_groups(factors, shapes))
        elastic, whole = (self._stiffness_changes(x, with_loads) for with_loads in (False, True))
        slope = value * (x.T @ ((1 - value) * elastic + value * whole))
        return Repeated(at, value, (slope + np.swapaxes(slope, 1, 2)) / 2)


@dataclass(frozen=True, repr=False)
class DisplacedState(State):
    """A design where displacements are prescribed, under the loads and gravity that are described: its `pose`, and of a
    design with slopes the same pose `moving` along. `missing` (n,) is what round-off leaves missing of its equilibrium,
    with slopes, N and N m. Derivatives are those of one smooth branch; without slopes they are by no parameters.
    """

    _shown = ("move",)

    design: Design
    move: Mapping[str, Any]
    pose: Pose
    moving: Pose | None = None
    missing: Any = None

    @property
    def best(self) -> Pose:
        """The pose with slopes where it has some."""
        return self.moving or self.pose

    @property
    def _at(self) -> Design:
        return replace(self.design, pose=PosedDesign(self.best, ""))

    @property
    def forces(self) -> dict[str, Any]:
        """The forces and moments that hold the prescribed displacements, by their names."""
        return {name: self.best.state.drive[k] for k, name in enumerate(self.move)}

    def displacement(self, node: str) -> Array:
        """Displacement (6,) of a node from the undeformed configuration, with its rotation vector."""
        return self.best.displacement(self._number(node))

    def rows(self, node: str) -> Any:
        """As `State.rows`."""
        return self.best.rows(self._number(node))

    def _number(self, node: str) -> int:
        return int(self.design.plan.topology.numbers([node])[0])

    def compliance(self, to: str, by: str) -> Any:
        """As `State.compliance`. Raises SolverError where the pose holds one of them."""
        scale, rows = self.pose.equations.scale, plain(np.stack([self.row(to), self.row(by)]))
        holding = self._holding([name for name in self.move if name not in (to, by)])
        free_sizes = np.linalg.norm(holding.rows(rows) / scale[holding.left], axis=1)
        for name, free, whole in zip((to, by), free_sizes, np.linalg.norm(rows / scale, axis=1), strict=True):
            if not free > STATIC_ROUND_OFF * whole:
                raise SolverError(f"{name} is held by the pose")
        return super().compliance(to, by)

    def _holding(self, held: Sequence[str]) -> Holding:
        """What is left where some of the prescribed displacements are held."""
        names = list(self.move)
        rows = self.pose.state.tangent.rows[[names.index(name) for name in held]]
        return Holding.of(rows, self.pose.equations.scale)

    def flexibility(self, rows: Any, held: Sequence[str] = ()) -> Any:
        """As `State.flexibility` (theory eq. V6)."""
        K, G, holding = self.pose.K, plain(rows), self._holding(held)
        free = holding.rows(G)
        solved = factorise(holding.matrix(K)).solve(np.ascontiguousarray(free.T))
        if not self.has_slopes:
            C = free @ solved
            return (C + C.T) / 2
        x = holding.motions(solved)
        C = G @ x
        moved = slope_of(rows) if isinstance(rows, Dual) else np.zeros((1, *G.shape))
        change = moved @ x - self._form(self._stiffness, x) / 2
        if len(held):
            change = change + self._pulled(x, K @ x - G.T, [list(self.move).index(name) for name in held])
        return Dual((C + C.T) / 2, change + np.swapaxes(change, 1, 2))

    def stresses_within(self, share: float) -> LargestStresses:
        """As `State.stresses_within`, at this equilibrium."""
        model, design = self.best.equations.model, self.design
        forces = end_forces(model, [self.best.state])
        missing = _rounding(design.parameters, self.missing, model.dof, share) if share else None
        return largest_stresses(design, forces.__getitem__, 1, rounding=missing)

    @property
    def is_stable(self) -> bool:
        """Whether the state is stable with the prescribed displacements held."""
        return is_definite(self.pose.matrices(held=True)[0])

    def frequencies(self, n: int, held: bool = False) -> list[Repeated]:
        """The n lowest natural frequencies and further copies of the last, with the prescribed displacements held, or
        free under their forces; negative where the state is unstable, and without a derivative at zero (theory eq.
        V7)."""
        K, M = self.pose.matrices(held)
        pairs = lowest_of_any(K, M, min(n + GUARD, K.shape[0]))
        X = self.pose.holding.motions(pairs.vectors) if held else pairs.vectors
        masses = [] if self.moving is None else self.moving.equations.model.mass_blocks(self.moving.state.frames)
        frequencies = []
        for at, value, x in _groups(pairs.values, X):
            if at[0] >= n:
                break
            slope = self._form(self._stiffness, x) - value * self._form(masses, x)
            if held:
                pull = self._pulled(x, self.pose.K @ x - value * (self.pose.M @ x))
                slope = slope - pull - np.swapaxes(pull, 1, 2)
            omega = float(np.sqrt(abs(value)))
            with np.errstate(divide="ignore", invalid="ignore"):
                slope = slope / (4 * np.pi * omega)
            frequencies.append(Repeated(at, float(np.sign(value)) * omega / (2 * np.pi), slope))
        return frequencies

    @property
    def buckling(self) -> Any:
        """As `State.buckling`."""
        if self.has_slopes:
            return super().buckling
        factor = buckling_factor(self.pose)
        return np.inf if factor is None else factor

    @property
    def buckling_factor(self) -> Repeated | None:
        """As `State.buckling_factor`, with the prescribed displacements held, linear from the pose (theory eq. V8)."""
        critical = critical_state(self.pose, 1 + GUARD)
        if critical is None:
            return None
        factors, shapes = critical
        at, value, shape = next(_groups(factors, shapes))
        x, best = self.pose.holding.motions(shape), self.best
        material = best.equations.model.material_blocks(best.state.frames, best.state.loads.actuators)
        rest, whole = (self._form(blocks, x) for blocks in (material, self._stiffness))
        pull = self._pulled(x, (1 - value) * (material_at(self.pose) @ x) + value * (self.pose.K @ x))
        slope = value * ((1 - value) * rest + value * whole - pull - np.swapaxes(pull, 1, 2))
        return Repeated(at, value, slope)

    @property
    def _stiffness(self) -> Sequence[Array]:
        """Blocks of the tangent stiffness."""
        return self.best.state.tangent.forces.blocks

    def _form(self, blocks: Sequence[Array], x: Array) -> Array:
        """Slopes (P, k, k) of x' A x, x (n, k), for the symmetric part A of a sum of blocks."""
        if self.moving is None:
            return np.zeros((0, x.shape[1], x.shape[1]))
        return slope_of(self.moving.equations.model.form(blocks, x))

    def _pulled(self, x: Array, forces: Array, held: Sequence[int] | None = None) -> Array:
        """Work (P, k, k), on motions x (n, k), of slopes of the rows that hold the drives, all or those `held`, under
        forces (n, k) that these exert."""
        if self.moving is None:
            return np.zeros((0, x.shape[1], x.shape[1]))
        whole: Any = self.moving.state.tangent.rows
        rows = whole if held is None else whole[list(held)]
        pull = np.linalg.lstsq(rows.value.T, forces, rcond=None)[0]
        return np.swapaxes(rows.slope @ x, 1, 2) @ pull


def displaced_state(design: Design, move: Mapping[str, Any]) -> DisplacedState:
    """A design with displacements prescribed by name, which may have slopes as its values may, under the loads and
    gravity that are described.

    It is reached from the undeformed configuration by a path of equilibria (theory eqs. G1-G31). Raises OptionError for
    unknown nodes and axes and what cannot turn, and SolverError where no equilibrium leads there, or where the state
    has lost its stiffness.
    """
    return DisplacementPath(design, list(move)).at(list(move.values()))


class DisplacementPath:
    """The equilibria of a design over displacements (d,) that are prescribed, one after another, each continued from
    the one before."""

    def __init__(self, design: Design, names: list[str]) -> None:
        self.design = design
        self.names = names
        still = design.still
        model = MovingModel.of(still)
        self.equations: Equations = Equations(model, [driven_displacement(model, name) for name in names])
        self.equations.independent()
        self.loads: Loads = described_loads(still)
        undeformed = np.zeros(len(names))
        self._path = Path(self.equations, self.equations.at_rest(), Point(undeformed, NO_LOADS))
        if self.loads.any:
            self.to(undeformed)

    def to(self, targets: Array) -> Equilibrium:
        """The state at displacements (d,), from the last one. Raises SolverError where no equilibrium leads there."""
        for drive, target in zip(self.equations.drives, targets.tolist(), strict=True):
            drive.refuse_half_turn(target)
        state = next(iter(self._path.through([Point(targets, self.loads)])))
        if isinstance(state, Stopped):
            place = ", ".join(f"{name} = {target:.4g}" for name, target in zip(self.names, targets, strict=True))
            share = f"{100 * state.share:.3g} %"
            raise SolverError(
                f"at {place}: no equilibrium is found beyond {share} of the path; flexura stroke shows it"
            )
        return state

    def at(self, targets: Sequence[Any]) -> DisplacedState:
        """What the design is at displacements (d,), which may have slopes. Raises SolverError where it has lost its
        stiffness: there the state has no derivative."""
        values = np.array([float(plain(target)) for target in targets])
        pose = Pose(self.equations, self.to(values))
        state = DisplacedState(self.design, dict(zip(self.names, targets, strict=True)), pose)
        return self._moving(state, values) if state.has_slopes else state

    def _moving(self, at: DisplacedState, values: Array) -> DisplacedState:
        """A state at displacements of `values` (d,) with its pose moving along (theory eq. V5)."""
        pose, state = at.pose, at.pose.state
        count = len(slope_of(self.design.values))
        targets = [t.slope if isinstance(t, Dual) else np.zeros(count) for t in at.move.values()]
        loads = described_loads(self.design)
        sloped = Equations(MovingModel.of(self.design), pose.equations.drives)
        frames = _carried(sloped.model.rest, state.frames, count)
        tangent, missing = sloped.tangent(frames, loads, state.drive)
        missing = missing + state.drive @ tangent.rows
        with_slopes: Any = Dual(values, np.stack(targets, axis=1))
        gap = with_slopes - sloped.travelled(frames)
        step, drive = pose.equations.solver(state.tangent)(slope_of(missing).T, slope_of(gap).T)
        frames = _stepped(frames, np.stack([pose.equations.displacements(column) for column in step.T]))
        force: Any = Dual(state.drive, drive.T)
        tangent, missing = sloped.tangent(frames, loads, force)
        moving = Pose(sloped, Equilibrium(frames, force, loads, tangent, state.iterations))
        return replace(at, moving=moving, missing=missing + force @ tangent.rows)


def _carried(rest: Frames, at: Frames, count: int) -> Frames:
    """Frames `at` a state with the slopes that they have where displacements from rest stay as they are."""
    moved = slope_of(rest.x) if isinstance(rest.x, Dual) else np.zeros((count, *at.x.shape))
    R, z = (np.zeros((count, *field.shape)) for field in (at.R, at.z))
    return _frames(at, moved, R, z)


def _stepped(frames: Frames, step: Array) -> Frames:
    """Frames with slopes (P, n, 6) of displacements added to theirs."""
    moves = frames.placed[:, None]
    turned = skew(np.where(moves, step[..., 3:], 0.0)) @ plain(frames.R)
    slopes = np.where(moves, step[..., :3], 0.0), turned, np.where(moves, 0.0, step)
    return _frames(frames, *(slope_of(field) + more for field, more in zip(frames, slopes, strict=False)))


def _frames(at: Frames, *slopes: Array) -> Frames:
    """Frames with slopes of positions, rotations and amplitudes."""
    x, R, z = (Dual(plain(field), slope) for field, slope in zip(at, slopes, strict=False))
    return at._replace(x=x, R=R, z=z)
