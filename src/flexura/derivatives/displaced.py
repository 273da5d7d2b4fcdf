"""A design in equilibrium with large displacements, and the path of equilibria that leads there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexura.analysis import LargestStresses, driven_displacement, largest_stresses, moved_deformations
from flexura.arrays import Array
from flexura.beam import skew
from flexura.derivatives.states import Repeated, State, repeated_groups, rounding_to
from flexura.duals import Dual, plain, slope_of
from flexura.errors import SolverError
from flexura.linalg import factorise, is_definite
from flexura.motion import (
    NO_LOADS,
    Equations,
    Equilibrium,
    Frames,
    Holding,
    Loads,
    MovedState,
    MovingModel,
    Path,
    Point,
    Pose,
    PosedDesign,
    Stopped,
    buckling_factor,
    critical_state,
    end_forces,
    loads_with,
    lowest_of_any,
    material_at,
    member_force_changes,
)
from flexura.structure import Design
from flexura.thresholds import STATIC_ROUND_OFF

GUARD = 3
"""Eigenvalues worked out beyond those wanted, to see whether the last one is repeated."""


@dataclass(frozen=True, repr=False)
class DisplacedState(State):
    """A design where displacements are prescribed, under the loads and gravity that are described: its `pose`, and of a
    design with slopes the same pose `moving` along. Derivatives are those of one smooth branch; without slopes they are
    by no parameters.
    """

    _shown = ("move",)

    design: Design
    move: Mapping[str, Any]
    pose: Pose
    moving: Pose | None = None

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

    def point_displacement(self, node: str, arm: Any) -> Any:
        """Displacement (3,) of a point that moves with a node, at an `arm` (3,) from it before anything moves."""
        root = int(self.best.equations.model.root[self._number(node)])
        return self.displacement(node)[:3] + (self.best.state.frames.R[root] - np.eye(3)) @ arm

    @cached_property
    def undriven(self) -> DisplacedState:
        """The state under the loads and gravity that are described alone."""
        return displaced_state(self.design, {})

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
        state: Any = self.best.state
        missing = rounding_to(design.parameters, state.missing, model.dof, share) if share else None
        deformed = moved_deformations(design, model, [self.best.state])
        return largest_stresses(design, forces.__getitem__, deformed, 1, rounding=missing)

    @property
    def is_stable(self) -> bool:
        """Whether the state is stable with the prescribed displacements held."""
        return is_definite(self.pose.held_K)

    def frequencies(self, n: int, held: bool = False) -> list[Repeated]:
        """The n lowest natural frequencies and further copies of the last, with the prescribed displacements held, or
        free under their forces; negative where the state is unstable, and without a derivative at zero (theory eq.
        V7)."""
        K, M = self.pose.matrices(held)
        pairs = lowest_of_any(K, M, min(n + GUARD, K.shape[0]))
        X = self.pose.holding.motions(pairs.vectors) if held else pairs.vectors
        masses = [] if self.moving is None else self.moving.equations.model.mass_blocks(self.moving.state.frames)
        frequencies = []
        for at, value, x in repeated_groups(pairs.values, X):
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
        at, value, shape = next(repeated_groups(factors, shapes))
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


def displaced_state(
    design: Design,
    move: Mapping[str, Any],
    force: Mapping[str, float] | None = None,
    command: Mapping[str, float] | None = None,
) -> DisplacedState:
    """A design with displacements prescribed by name, which may have slopes as its values may, under the loads and
    gravity that are described, dead forces `carriage.Fy`, N and N m, and commands of actuators by name.

    It is reached from the undeformed configuration by a path of equilibria (theory eqs. G1-G31). Raises OptionError for
    unknown nodes and axes and what cannot turn, and SolverError where no equilibrium leads there, or where the state
    has lost its stiffness.
    """
    return DisplacementPath(design, list(move), force, command).at(list(move.values()))


class DisplacementPath:
    """The equilibria of a design over displacements (d,) that are prescribed, one after another, each continued from
    the one before, under `force` and `command` as in `displaced_state`."""

    def __init__(
        self,
        design: Design,
        names: list[str],
        force: Mapping[str, float] | None = None,
        command: Mapping[str, float] | None = None,
    ) -> None:
        self.design = design
        self.names = names
        self._moving_model = MovingModel.of(design)
        model = self._moving_model.still if isinstance(design.values, Dual) else self._moving_model
        self.equations: Equations = Equations(model, [driven_displacement(model, name) for name in names])
        self.equations.independent()
        self._on = force or {}, command or {}
        self.loads: Loads = loads_with(model, *self._on)
        undeformed = np.zeros(len(names))
        self._path = Path(self.equations, self.equations.at_rest(), Point(undeformed, NO_LOADS))
        if self.loads.any:
            self.to(undeformed)

    def to(self, targets: Array) -> Equilibrium:
        """The state at displacements (d,), from the last one. Raises SolverError where no equilibrium leads there."""
        for drive, target in zip(self.equations.drives, targets.tolist(), strict=True):
            drive.refuse_half_turn(target)
        state = self._path.to(Point(targets, self.loads))
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
        sloped = Equations(self._moving_model, pose.equations.drives)
        loads = loads_with(sloped.model, *self._on)
        frames = _carried(sloped.model.rest, state.frames, count)
        missing, held = sloped.balance(frames, loads, state.drive)
        with_slopes: Any = Dual(values, np.reshape(targets, (len(targets), count)).T)
        gap = with_slopes - sloped.travelled(frames)
        step, drive = pose.equations.solver(state.tangent)(slope_of(missing).T, slope_of(gap).T)
        steps = np.stack([pose.equations.displacements(column) for column in step.T])
        force: Any = Dual(state.drive, drive.T)
        of_members: Any = held[0] if len(held) else None
        if (changes := member_force_changes(pose, np.moveaxis(steps, 0, -1))) is not None:
            of_members = Dual(of_members.value, of_members.slope + np.moveaxis(changes, -1, 0))
        moved: Any = MovedState(sloped, _stepped(frames, steps), force, loads, of_members)
        return replace(at, moving=Pose(sloped, moved))


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
