"""States of equilibrium with displacements prescribed and loads on: Newton's method with exact tangents."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.beam import skew
from flexura.duals import plain
from flexura.errors import OptionError, SolverError
from flexura.linalg import factorise, is_definite
from flexura.motion.elements import Frames
from flexura.motion.model import NO_LOADS, Forces, Loads, MovingModel
from flexura.motion.se3 import LARGEST_ROTATION, Logarithm

HALF_TURN = 3.1
"""Largest component, rad, of a rotation vector that is prescribed; it ends at half a turn."""

DENSE_EQUATIONS = 150
"""Equations up to which dense algebra is quicker."""

NEWTON_CONVERGED = 1e-8
"""Largest last step of Newton's method, over the size of the mechanism or in rad, after which nothing is left."""

INDEPENDENT = 1e-9
"""What of a prescribed displacement others must leave free, over its own size."""

UNSTRAINED = 1e-14
"""Forces at rest, over those of displacements as large as the mechanism or of rotations by 1 rad, that are none."""

NEWTON_STEPS = 12
"""Steps of Newton's method after which a smaller change of state is tried."""


TURNS = np.arange(3, 6)
"""Places of rotations among displacements."""


class Drive(NamedTuple):
    """A displacement that is prescribed: component 0 to 5, global axes, of a node that follows frame `root`.

    Rotations are components of the rotation vector of the frame.
    """

    name: str
    node: int
    root: int
    component: int

    def refuse_half_turn(self, *targets: float) -> None:
        """Raise OptionError for targets of a rotation that are no components of a rotation vector."""
        far = [target for target in targets if self.component >= 3 and abs(target) > HALF_TURN]
        if far:
            raise OptionError(
                f"{self.name} is a component of a rotation vector, up to {HALF_TURN} rad, not {far[0]:g} rad: beyond"
                " it, a displacement of what turns may be moved, or a moment put on"
            )


class Equilibrium(NamedTuple):
    """A state: frames, the forces of the drives that hold it (d,), N or N m, the loads on it, and what the mechanism
    answers with."""

    frames: Frames
    drive: Array
    loads: Loads
    tangent: Tangent
    iterations: int

    @property
    def held(self) -> Array:
        """Forces (e, 12) on the frames of the first kind of elements."""
        return self.tangent.forces.responses[0].force


class Tangent(NamedTuple):
    """What holds a state, derivatives of loads and drives included, the driven displacements (d,) and their rows
    (d, n)."""

    model: MovingModel
    forces: Forces
    travelled: Array
    rows: Array

    @property
    def K(self) -> sp.csc_matrix:
        """Derivatives (n, n) of the forces that hold the state by its free displacements."""
        return self.model.pattern.sparse(self.forces.blocks)


class Equations:
    """Equilibrium of a model under loads with some displacements prescribed."""

    def __init__(self, model: MovingModel, drives: Sequence[Drive] = ()) -> None:
        self.model = model
        self.drives: tuple[Drive, ...] = tuple(drives)
        self._free = model.dof >= 0
        self._places = np.empty(model.n_dof, dtype=np.intp)
        self._places[model.dof[self._free]] = np.flatnonzero(self._free)
        x = plain(model.rest.x[:-1])
        self.size: float = float(np.linalg.norm(x.max(axis=0) - x.min(axis=0))) or 1.0
        """Diagonal of the box around the mechanism, m."""
        self.scale: Array = np.where(self._places % 6 < 3, 1 / self.size, 1.0)

    def independent(self) -> None:
        """Raise OptionError where displacements that are prescribed cannot be, all by themselves, at rest."""
        rows = self._undeformed[0].rows / self.scale if len(self.drives) > 1 else np.empty(0)
        for k, drive in enumerate(self.drives[1:], 1):
            others = rows[:k]
            left = rows[k] - np.linalg.lstsq(others.T, rows[k], rcond=None)[0] @ others
            if np.linalg.norm(left) < INDEPENDENT * np.linalg.norm(rows[k]):
                before = ", ".join(other.name for other in self.drives[:k])
                raise OptionError(f"{drive.name} already follows from {before}: one of them is enough")

    def displacements(self, step: Array) -> Array:
        """Displacements (..., n + 1, 6) of all frames from those that are free (..., n)."""
        return self.model.displacements(step)

    def free(self, of_frames: Array) -> Array:
        """The entries (n,) of values (n + 1, 6) of frames that belong to free displacements."""
        return of_frames.reshape(-1)[self._places]

    def travelled(self, frames: Frames) -> Array:
        """The driven displacements (d,), m and rad, in a state."""
        travel = np.zeros(len(self.drives), like=frames.x)
        for i, drive in enumerate(self.drives):
            travel[i] = self._drive(frames, drive)[0]
        return travel

    def rows(self, frames: Frames) -> Array:
        """Derivatives (d, n) of the driven displacements by the free ones in a state."""
        rows = np.zeros((len(self.drives), self.model.n_dof), like=frames.x)
        for i, drive in enumerate(self.drives):
            dof = self.model.dof[drive.root]
            rows[i, dof[dof >= 0]] = self._drive(frames, drive)[1][dof >= 0]
        return rows

    def _drive(self, frames: Frames, drive: Drive) -> tuple[np.float64, Array, Array]:
        """A driven displacement, its derivatives (6,) by those of its frame, and theirs (6, 6)."""
        row, second = np.zeros(6, like=frames.x), np.zeros((6, 6), like=frames.x)
        k, root = drive.component, drive.root
        if k < 3:
            arm = self.model.arm[drive.node]
            now = frames.R[root] @ arm
            row[k] = 1.0
            row[3:] = skew(now)[:, k]
            # skew(axis) skew(now) = now axis' - axis'now
            second[3:, 3 + k] = now
            second[TURNS, TURNS] -= now[k]
            moved = frames.x[root] + now - self.model.rest.x[root] - arm
            return moved[k], row, second
        log = Logarithm(frames.R[root], np.zeros(3))
        row[3:] = log.before[k, 3:]
        unit = np.zeros(6)
        unit[k] = 1.0
        second[3:, 3:] = log.second(unit)[0][3:, 3:] @ log.before[3:, 3:]
        return log.e[k], row, second

    def tangent(self, frames: Frames, loads: Loads, multipliers: Array) -> tuple[Tangent, Array]:
        """The tangent in a state, and the forces (n,) that are missing for its equilibrium without the drives."""
        forces = self.model.forces(frames, loads.gravity, loads.actuators)
        local = forces.blocks[-1]
        external, slope = loads.external(self.model, frames)
        local -= slope
        travelled = np.zeros(len(self.drives), like=frames.x)
        rows = np.zeros((len(self.drives), self.model.n_dof), like=frames.x)
        for i, (drive, multiplier) in enumerate(zip(self.drives, multipliers, strict=True)):
            travelled[i], row, second = self._drive(frames, drive)
            local[drive.root] -= multiplier * second
            dof = self.model.dof[drive.root]
            rows[i, dof[dof >= 0]] = row[dof >= 0]
        return Tangent(self.model, forces, travelled, rows), self.free(external - forces.force)

    def balance(self, frames: Frames, loads: Loads, multipliers: Array) -> tuple[Array, list[Array]]:
        """The forces (n,) that are missing for equilibrium in a state under forces of the drives, and those on the
        frames of each kind of elements."""
        force, held = self.model.held(frames, loads.gravity, loads.actuators)
        return self.free(loads.forces(self.model, frames) - force) + multipliers @ self.rows(frames), held

    def missing(self, state: Equilibrium) -> Array:
        """The forces (n,) that are missing in a state for equilibrium without the drives."""
        return self.free(state.loads.forces(self.model, state.frames) - state.tangent.forces.force)

    @cached_property
    def _undeformed(self) -> tuple[Tangent, Array]:
        """The tangent without loads and with nothing moved, and what forces are missing there."""
        return self.tangent(self.model.rest, NO_LOADS, np.zeros(len(self.drives)))

    def ground_reaction(self, state: Equilibrium) -> Array:
        """Force and moment (6,) about the global origin that the ground exerts, N and N m (theory eq. G19)."""
        frames = state.frames
        exerted = state.tangent.forces.force - state.loads.forces(self.model, frames)
        for drive, force in zip(self.drives, state.drive, strict=True):
            exerted[drive.root] -= force * self._drive(frames, drive)[1]
        exerted[self._free] = 0.0
        moments = exerted[:, 3:] + np.cross(frames.x, exerted[:, :3])
        return np.append(exerted[:, :3].sum(axis=0), moments.sum(axis=0))

    def solve(self, start: Frames, loads: Loads = NO_LOADS, targets: ArrayLike = ()) -> Equilibrium:
        """The state of equilibrium next to `start` with the driven displacements at their targets, m and rad.

        Raises SolverError when Newton's method does not get there.
        """
        frames, multipliers = start, np.zeros(len(self.drives))
        wanted, last = np.asarray(targets, dtype=float), np.inf
        for iteration in range(1, NEWTON_STEPS + 1):
            tangent, missing = self.tangent(frames, loads, multipliers)
            step, multipliers = self.solver(tangent)(missing, wanted - tangent.travelled)
            if not np.isfinite(step).all():
                break
            size = float(np.abs(step * self.scale).max(initial=0.0))
            if size > LARGEST_ROTATION or (iteration > 6 and size > last):
                break
            frames, last = frames.moved(self.displacements(step)), size
            if size < NEWTON_CONVERGED:
                tangent, _ = self.tangent(frames, loads, multipliers)
                return Equilibrium(frames, multipliers, loads, tangent, iteration)
        raise SolverError("no equilibrium is found near the last one")

    def at_rest(self) -> Equilibrium:
        """The state without loads and with nothing moved. Raises SolverError where it is free to move."""
        (tangent, missing), nowhere = self._undeformed, np.zeros(len(self.drives))
        K, rows = self.model.matrix(tangent.forces.blocks), tangent.rows
        diagonal = K.diagonal()
        softness = np.reciprocal(np.where(diagonal > 0, diagonal, diagonal.max(initial=1.0)))
        springs = rows / np.sqrt(rows**2 @ softness)[:, None]  # they hold what is driven
        holding: Any = springs if isinstance(K, np.ndarray) else sp.csr_matrix(springs)
        if not is_definite(K + holding.T @ holding):
            raise SolverError(
                "the undeformed mechanism is free to move: hold or move all of it; flexura check lists what is free"
            )
        if (np.abs(missing * self.scale) <= UNSTRAINED * diagonal).all():
            return Equilibrium(self.model.rest, nowhere, NO_LOADS, tangent, 1)
        return self.solve(self.model.rest, NO_LOADS, nowhere)

    def solver(self, tangent: Tangent) -> Callable[[Array, Array], tuple[Array, Array]]:
        """What gives steps (n,) or (n, k) towards equilibrium, and the forces (d,) of the drives after them, from the
        forces that are missing (n,) and the displacements (d,) that are left to the drives (theory eq. G14).

        Raises SolverError where the mechanism has lost its stiffness.
        """
        n, d = self.model.n_dof, len(self.drives)
        if n + d <= DENSE_EQUATIONS:
            A = np.zeros((n + d, n + d))
            A[:n, :n] = self.model.pattern.dense(tangent.forces.blocks)
            A[:n, n:], A[n:, :n] = -tangent.rows.T, tangent.rows
            solve: Callable[[Array], Any] = partial(np.linalg.solve, A)
        else:
            rows = sp.csc_matrix(tangent.rows)
            sparse: Any = sp.bmat([[tangent.K, -rows.T], [rows, None]], format="csc") if d else tangent.K
            solve = factorise(sparse).solve

        def step(missing: Array, gap: Array) -> tuple[Array, Array]:
            try:
                solution = np.asarray(solve(np.concatenate([missing, gap])), dtype=float)
            except np.linalg.LinAlgError:
                raise SolverError("the mechanism has lost its stiffness") from None
            return solution[:n], solution[n:]

        return step


@dataclass(frozen=True)
class MovedState:
    """An `Equilibrium` whose numbers have slopes.

    Its tangent and what round-off leaves `missing` (n,) of it, of which most that is asked there needs nothing, are
    worked out when they are first asked for.
    """

    equations: Equations
    frames: Frames
    drive: Array
    loads: Loads
    held: Array

    @cached_property
    def tangent(self) -> Tangent:
        """As of `Equilibrium`."""
        return self.equations.tangent(self.frames, self.loads, self.drive)[0]

    @cached_property
    def missing(self) -> Array:
        """The forces (n,) that are missing, N and N m."""
        return self.equations.balance(self.frames, self.loads, self.drive)[0]
