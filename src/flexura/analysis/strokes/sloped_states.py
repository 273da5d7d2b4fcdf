"""What a design is in one state, with exact derivatives by its parameters: linear about the undeformed configuration or
the loads that are described, or in equilibrium with large displacements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexura.analysis.limits import preload
from flexura.analysis.strain import LargestStresses, Missing, largest_stresses
from flexura.analysis.strain import end_forces as linear_end_forces
from flexura.analysis.strokes.equilibrium_path import driven_displacement
from flexura.arrays import Array
from flexura.duals import Dual, plain, slope_of
from flexura.errors import SolverError
from flexura.full_order import assemble
from flexura.linalg import critical_shapes, is_definite
from flexura.modal import close_groups
from flexura.motion import (
    NO_LOADS,
    Equations,
    Equilibrium,
    Loads,
    MovingModel,
    Path,
    Point,
    Pose,
    PosedDesign,
    Repeated,
    SlopedPose,
    Stopped,
    described_loads,
    end_forces,
)
from flexura.records import Record
from flexura.reduction import Flexibility, flexibility
from flexura.sensitivity import FullOrderFamily
from flexura.structure import Design, FullOrderModel, InputPort, Plan, Ports, dead_load
from flexura.thresholds import REPEATED_EIGENVALUES

LOWEST_FACTORS = 4
"""Buckling factors that are worked out, to see whether the lowest is repeated."""


class _State(Record):
    """What both kinds of states are read by. A slope is NaN where members or sections are stressed alike and part as a
    parameter moves, where something is zero of which the size counts, and at kinks of a description."""

    def stresses_within(self, share: float) -> LargestStresses:
        """As `stresses`, where slopes of forces count as equal that differ by less than a share of the residual of
        equilibrium."""
        raise NotImplementedError

    @cached_property
    def stresses(self) -> LargestStresses:
        """The largest stresses, (m, 1), in the members whose sections are known."""
        return self.stresses_within(0.0)


@dataclass(frozen=True, repr=False)
class LinearState(_State):
    """A design of a plan, linear about the undeformed configuration or about the loads and gravity that are described,
    with derivatives by the parameters `names`; m, rad, N, N m, Pa.

    Raises OptionError where a pose is described, and SolverError where something can move freely or loads are beyond
    buckling.
    """

    _shown = ("names",)

    plan: Plan
    parameters: Mapping[str, float]
    names: Sequence[str]

    @cached_property
    def model(self) -> FullOrderModel:
        """The full-order model, the design of which has slopes, its matrices not."""
        self.plan.refuse_pose("derivatives of what is linear")
        return replace(self._plain, design=Design.with_slopes(self.plan, self.parameters, self.names))

    @cached_property
    def _plain(self) -> FullOrderModel:
        return assemble(self.plan, self.parameters)

    @cached_property
    def _flexibility(self) -> Flexibility:
        return flexibility(self._plain)

    def response(self, load: Any) -> Any:
        """Displacements (n, k) under loads (n, k), with slopes: u' = K^-1 (f' - K' u) (theory eq. V1)."""
        u = self._flexibility.held(plain(load))
        residual = -self._stiffness_changes(u, loaded=True)
        if isinstance(load, Dual):
            residual = residual + load.slope
        columns = np.moveaxis(residual, 0, 1).reshape(len(u), -1)
        slope = self._flexibility.held(columns).reshape(len(u), len(self.names), -1)
        return Dual(u, np.moveaxis(slope, 1, 0))

    def _stiffness_changes(self, X: Array, loaded: bool) -> Array:
        """K' X (P, n, k), with or without the geometric stiffness of described loads; NaN at kinks."""
        family = FullOrderFamily(self.plan, loaded=loaded)
        changes = family.changes(self.parameters, list(self.names), X)
        return np.stack([change.K if change.is_smooth else change.K * np.nan for change in changes])

    def stresses_within(self, share: float) -> LargestStresses:
        """As `_State.stresses_within`, under the loads and gravity that are described."""
        missing = Missing.of(self._residual, self.plan.topology.dof, share) if share else None
        gravity = self.plan.loads.gravity(self.model.values)
        weight = gravity if gravity.any() else None

        def forces(name: str) -> tuple[Array, Array]:
            return linear_end_forces(self.model, name, self._loaded, weight)

        return largest_stresses(self.model, forces, 1, missing=missing)

    @cached_property
    def _load(self) -> Any:
        """The loads and gravity (n, 1) that are described, with slopes."""
        loads, values = self.plan.loads, self.model.values
        return dead_load(self.model, loads.gravity(values), loads.wrenches(values))[:, None]

    @cached_property
    def _loaded(self) -> Any:
        """Displacements (n, 1) under them, with slopes."""
        return self.response(self._load)

    @cached_property
    def _residual(self) -> Any:
        """f - K u (n,) of these, with slopes."""
        return (self._load - FullOrderFamily(self.plan).products_of(self.model.design, self._loaded)[0])[:, 0]

    def coupling(self, actuator: str, node: str) -> tuple[Any, Any]:
        """Displacements (6,) of a node per unit of a command, and the elongation of the actuator, with slopes. Raises
        OptionError for unknown names."""
        design = self.model.design
        port: InputPort = Ports(design).inputs([actuator])[0]
        u = self.response(port.load[:, None])
        rows = design.dense_rows(self.plan.topology.numbers([node]))
        return (rows @ u)[:, 0], (port.row @ u)[0]

    @property
    def buckling_factor(self) -> Repeated | None:
        """The factor on the described loads and gravity at which it buckles, with slopes (theory eq. V4); None where it
        does not."""
        loaded = preload(self.plan, self.parameters)
        factors, shapes = critical_shapes(loaded.model.K, loaded.K_g, LOWEST_FACTORS)
        if not len(factors):
            return None
        at = close_groups(factors, REPEATED_EIGENVALUES)[0].tolist()
        value, x = float(np.mean(factors[at])), shapes[:, at]
        elastic, whole = (self._stiffness_changes(x, loaded) for loaded in (False, True))
        slope = value * (x.T @ ((1 - value) * elastic + value * whole))
        return Repeated(at, value, (slope + np.swapaxes(slope, 1, 2)) / 2)


@dataclass(frozen=True, repr=False)
class DisplacedState(_State):
    """A design where displacements are prescribed, under the loads and gravity that are described; m, rad, N, N m, Hz.

    Of a `design` whose values have slopes, all that is read has exact derivatives by its parameters, those of the
    state of equilibrium included. They are those of one smooth branch.
    """

    _shown = ("move",)

    design: Design
    move: Mapping[str, Any]
    state: SlopedPose

    @property
    def forces(self) -> dict[str, Any]:
        """The forces and moments that hold the prescribed displacements, by their names."""
        return {name: self.state.best.state.drive[k] for k, name in enumerate(self.move)}

    def displacement(self, node: str) -> Array:
        """Displacement (6,) of a node from the undeformed configuration, with its rotation vector. Raises OptionError
        for unknown nodes."""
        return self.state.best.displacement(self._number(node))

    def compliance(self, node: str, held: bool = True) -> Array:
        """Displacements (6, 6) of a node per force and moment on it, with the prescribed displacements held, or free
        under their forces.

        Raises OptionError for unknown nodes and SolverError where the state has lost its stiffness.
        """
        return self.state.compliance(self._number(node), held)

    def flexibility(self, rows: Array, held: Sequence[str]) -> Array:
        """Motions (k, k) along rows (k, n) over the free displacements per unit force along each, with the prescribed
        displacements of some names held, the others free under their forces. Raises SolverError as `compliance`."""
        names = list(self.move)
        return self.state.flexibility(rows, [names.index(name) for name in held])

    def rows(self, node: str) -> Array:
        """Displacements (6, n) of a node from the free displacements. Raises OptionError for unknown nodes."""
        return self.state.best.rows(self._number(node))

    def coupling(self, actuator: str, node: str) -> tuple[Any, Any]:
        """As `LinearState.coupling`, the prescribed displacements free under their forces."""
        there = replace(self.design, pose=PosedDesign(self.state.best, ""))
        port: InputPort = Ports(there).inputs([actuator])[0]
        rows = np.concatenate([self.rows(node), port.row[None]])
        moved = self.flexibility(rows, ())[:, -1] * port.gain
        return moved[:-1], moved[-1]

    def stresses_within(self, share: float) -> LargestStresses:
        """As `_State.stresses_within`, at this equilibrium."""
        pose = self.state.best
        forces = end_forces(pose.equations.model, [pose.state])
        missing = Missing.of(self.state.missing, pose.equations.model.dof, share) if share else None
        return largest_stresses(self.design, forces.__getitem__, 1, missing=missing)

    @property
    def is_stable(self) -> bool:
        """Whether the state is stable with the prescribed displacements held."""
        return is_definite(self.state.pose.matrices(held=True)[0])

    def frequencies(self, n: int, held: bool = False) -> list[Repeated]:
        """The n lowest natural frequencies, Hz, and further copies of the last, with the prescribed displacements held,
        or free under their forces; negative where the state is unstable, and without a derivative at zero."""
        frequencies = []
        for eigenvalue in self.state.eigenvalues(n, held):
            omega = float(np.sqrt(abs(eigenvalue.value)))
            with np.errstate(divide="ignore", invalid="ignore"):
                slope = eigenvalue.slope / (4 * np.pi * omega)
            hertz = float(np.sign(eigenvalue.value)) * omega / (2 * np.pi)
            frequencies.append(eigenvalue._replace(value=hertz, slope=slope))
        return frequencies

    @property
    def buckling_factor(self) -> Repeated | None:
        """The factor on all loads and forces at which the state would buckle with the prescribed displacements held,
        linear from the pose; None where nothing buckles."""
        return self.state.buckling_factor()

    def _number(self, node: str) -> int:
        return int(self.design.plan.topology.numbers([node])[0])


def displaced_state(design: Design, move: Mapping[str, Any]) -> DisplacedState:
    """A design with displacements prescribed by name, `carriage.y` or `platform.rz`, m or rad, which may have slopes as
    its values may, under the loads and gravity that are described.

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

    @property
    def count(self) -> int:
        """Number of slopes of the design."""
        return len(slope_of(self.design.values)) if isinstance(self.design.values, Dual) else 0

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
        """What the design is at displacements (d,), which may have slopes."""
        values = np.array([float(plain(target)) for target in targets])
        pose = Pose(self.equations, self.to(values))
        move = dict(zip(self.names, targets, strict=True))
        if not isinstance(self.design.values, Dual):
            return DisplacedState(self.design, move, SlopedPose(pose))
        slopes = [target.slope if isinstance(target, Dual) else np.zeros(self.count) for target in targets]
        with_slopes: Any = Dual(values, np.stack(slopes, axis=1))
        return DisplacedState(
            self.design, move, SlopedPose.of(pose, self.design, described_loads(self.design), with_slopes)
        )
