"""What a design is at one pose of large displacements, with exact derivatives by its parameters where it has slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from flexura.analysis.strain import LargestStresses, Missing, largest_stresses
from flexura.analysis.strokes.ways import Given, course
from flexura.arrays import Array
from flexura.duals import Dual, plain, slope_of
from flexura.errors import SolverError
from flexura.linalg import is_definite
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
from flexura.structure import Design
from flexura.systems import InputPort, Ports


@dataclass(frozen=True, repr=False)
class AtPose(Record):
    """A design where displacements are prescribed, under the loads and gravity that are described; m, rad, N, N m, Hz.

    Of a `design` whose values have slopes, all that is read has exact derivatives by its parameters, those of the
    state of equilibrium included. They are those of one smooth branch: a slope is NaN where members or sections are
    stressed alike and part as a parameter moves, and where something is zero of which the size counts.
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
        """Displacement (6,) of a node from rest, with its rotation vector. Raises OptionError for unknown nodes."""
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
        """As `AtRest.coupling`, the prescribed displacements free under their forces."""
        own = self.design
        there = _Displaced(own.plan, own.parameters, own.values, own.geometry, PosedDesign(self.state.best, ""))
        port: InputPort = Ports(there).inputs([actuator])[0]
        rows = np.concatenate([self.rows(node), port.row[None]])
        moved = self.flexibility(rows, ())[:, -1] * port.gain
        return moved[:-1], moved[-1]

    @cached_property
    def stresses(self) -> LargestStresses:
        """The largest stresses in the members whose sections are known, (m, 1)."""
        return self.stresses_within(0.0)

    def stresses_within(self, share: float) -> LargestStresses:
        """As `stresses`, with slopes of forces told apart in a share of what is missing of equilibrium."""
        pose = self.state.best
        model = pose.equations.model
        forces = end_forces(model, [pose.state])
        missing = Missing.of(self.state.missing, model.dof, share) if share else None
        return largest_stresses(self.design, forces.__getitem__, 1, missing=missing)

    @property
    def is_stable(self) -> bool:
        """Whether the state is stable with the prescribed displacements held."""
        return is_definite(self.state.pose.matrices(held=True)[0])

    def frequencies(self, n: int, held: bool = False) -> list[Repeated]:
        """The n lowest natural frequencies, Hz, and further copies of the last, with the prescribed displacements held,
        or free under their forces; negative where the state is unstable."""
        return [_hertz(own) for own in self.state.eigenvalues(n, held)]

    @property
    def buckling_factor(self) -> Repeated | None:
        """The factor on all loads and forces at which the state would buckle with the prescribed displacements held,
        linear from the pose; None where nothing buckles."""
        return self.state.buckling_factor()

    def _number(self, node: str) -> int:
        return int(self.design.plan.topology.numbers([node])[0])


@dataclass(frozen=True, repr=False)
class _Displaced(Design):
    """A design that is `there`, wherever its plan says."""

    there: PosedDesign

    @property
    def posed(self) -> PosedDesign:
        return self.there


def _hertz(own: Repeated) -> Repeated:
    """A frequency from an eigenvalue; without a derivative at zero."""
    omega = float(np.sqrt(abs(own.value)))
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = own.slope / (4 * np.pi * omega)
    return own._replace(value=float(np.sign(own.value)) * omega / (2 * np.pi), slope=slope)


def at_pose(design: Design, move: Mapping[str, Any]) -> AtPose:
    """A design with displacements prescribed by name, `carriage.y` or `platform.rz`, m or rad, which may have slopes as
    its values may, under the loads and gravity that are described.

    It is reached from the undeformed configuration by a path of equilibria (theory eqs. G1-G31). Raises OptionError for
    unknown nodes and axes and what cannot turn, and SolverError where no equilibrium leads there, or where the state
    has lost its stiffness.
    """
    way = Way(design, list(move))
    return way.at([move[name] for name in move])


class Way:
    """The equilibria of a design over displacements (d,) that are prescribed, one after another."""

    def __init__(self, design: Design, names: list[str]) -> None:
        self.design = design
        self.names = names
        self._plain = design.still
        model = MovingModel.of(self._plain)
        planned = course(model, Given(dict.fromkeys(names, 0.0), {}, {}, None, {}), 1)
        self.equations: Equations = Equations(model, planned.drives)
        self.equations.independent()
        self.loads: Loads = planned.rest.loads
        start = self.equations.at_rest()
        self._path = Path(self.equations, start, Point(planned.rest.targets, NO_LOADS))
        if self.loads.any:
            self.to(planned.rest.targets)

    @property
    def count(self) -> int:
        """Number of slopes of the design."""
        return len(slope_of(self.design.values)) if isinstance(self.design.values, Dual) else 0

    def to(self, targets: Array) -> Equilibrium:
        """The state at displacements (d,), from the last one. Raises SolverError where no equilibrium leads there."""
        for drive, target in zip(self.equations.drives, targets.tolist(), strict=True):
            drive.refuse_half_turn(target)
        found = next(iter(self._path.through([Point(targets, self.loads)])))
        if isinstance(found, Stopped):
            said = ", ".join(f"{name} = {target:.4g}" for name, target in zip(self.names, targets, strict=True))
            share = f"{100 * found.share:.3g} %"
            raise SolverError(f"at {said}: no equilibrium is found beyond {share} of the path; flexura stroke shows it")
        return found

    def at(self, targets: list[Any]) -> AtPose:
        """What the design is at displacements (d,)."""
        values = np.array([float(plain(own)) for own in targets])
        pose = Pose(self.equations, self.to(values))
        move = dict(zip(self.names, targets, strict=True))
        if not isinstance(self.design.values, Dual):
            return AtPose(self.design, move, SlopedPose(pose))
        slopes = [own.slope if isinstance(own, Dual) else np.zeros(self.count) for own in targets]
        wanted: Any = Dual(values, np.stack(slopes, axis=1))
        return AtPose(self.design, move, SlopedPose.of(pose, self.design, described_loads(self.design), wanted))
