"""Newton's method for the steps of a motion: one matrix as long as it serves, and looks at what a step lacks.

Source: Brüls, Cardona, Arnold (2012), Mech. Mach. Theory 48, 121: the method of Chung and Hulbert (1993) with steps
that are displacements and rotation vectors from the last state, of second order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.kernels import Kernel, Struct, is_compiled
from flexura.linalg import LDL, Dense, factorise
from flexura.motion.elements import Frames, Rates
from flexura.motion.equilibrium import Equations
from flexura.motion.model import Loads, MovingModel
from flexura.motion.se3 import LARGEST_ROTATION
from flexura.motion.together import Together

_look = Kernel("motion_look", "aaaaannaaaaaaaa")

STEP_CONVERGED = 1e-3, 1e-6, 1e-10
"""What is left of a step by Newton's method: over its local error, over what accelerations change in it, and over
itself; the larger one of the first two."""

MOST_LEFT = 1e-5
"""What is left of a step over itself at most: errors of modes that steps do not resolve are larger than the motion."""

STEP_ITERATIONS = 12
"""Iterations with one matrix after which it is made anew; twice as many end the motion."""

SLOW_RATE = 0.2
"""Part of the error that an iteration leaves, from which the matrix is made anew."""

SLOW_STEP = 4
"""Iterations of a step from which the matrix is made anew for the next one."""

LEAST_RATE = 0.01
"""Part that an iteration is expected to leave at least."""

OLDER = 1.5
"""Growth of the part that an iteration is expected to leave, where a step took a single one."""

NO_STEP = 1e-14
"""Step over the size of the mechanism, or in rad, that counts as none."""


class MotionState(NamedTuple):
    """Frames with velocities and accelerations (n,) of the free displacements, m/s, rad/s, m/s^2, rad/s^2, and the
    forces of the drives (d,), N or N m."""

    frames: Frames
    velocity: Array
    acceleration: Array
    drive: Array


class Damping(NamedTuple):
    """Rayleigh damping: `alpha`, 1/s, times mass, and `beta`, s, times the stiffness of elements as they deform."""

    alpha: float
    beta: float


@dataclass(frozen=True)
class Scheme:
    """Generalised-alpha with steps of `h`, s, and its four numbers."""

    h: float
    am: float
    af: float
    gamma: float
    beta: float

    @staticmethod
    def of(rho: float, h: float) -> Scheme:
        """That of a spectral radius at high frequencies."""
        am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + af - am
        return Scheme(h, am, af, gamma, (gamma + 0.5) ** 2 / 4)

    @cached_property
    def by_step(self) -> Array:
        """Derivatives (4,) of displacements, velocities, accelerations and auxiliary ones by the displacements of a
        step."""
        h = self.h
        auxiliary = 1 / (self.beta * h**2)
        return np.array([1.0, self.gamma * h * auxiliary, (1 - self.am) / (1 - self.af) * auxiliary, auxiliary])

    @cached_property
    def led(self) -> Array:
        """Displacements, velocities, accelerations and auxiliary ones after a step (4, 4) in which accelerations go on
        as they did, by velocities, accelerations, auxiliary ones and the changes of accelerations, 1/s, before it."""
        h, (v, acceleration, a, jerk) = self.h, np.eye(4)
        accelerated = acceleration + h * jerk
        after = ((1 - self.af) * accelerated + self.af * acceleration - self.am * a) / (1 - self.am)
        D = h * v + h**2 * ((0.5 - self.beta) * a + self.beta * after)
        return np.array([D, v + h * ((1 - self.gamma) * a + self.gamma * after), accelerated, after])

    @property
    def ahead(self) -> float:
        """By how much velocities are ahead of their displacements, over the jerk, s^2."""
        return (1 / 6 - self.beta - (self.am - self.af) / 2) * self.h**2

    @property
    def later(self) -> float:
        """By how much auxiliary accelerations are those of a later time, s."""
        return (self.am - self.af) * self.h

    @property
    def off(self) -> float:
        """Local errors of displacements over what accelerations change in a step, s^2."""
        return (self.beta - 1 / 6) * self.h**2


class Attempt:
    """A step from the last state under loads, with driven displacements (d,) at targets: displacements, velocities,
    accelerations and auxiliary ones after it, `moving` (4, n), the frames there and the forces of the drives (d,), as
    far as they are known, and the last `correction` (n,) of displacements, beside others that `led` (2, n) there."""

    def __init__(
        self, model: MovingModel, last: MotionState, moving: Array, led: Array, loads: Loads, targets: Array
    ) -> None:
        self.last, self.moving, self.led, self.loads, self.targets = last, moving, led, loads, targets
        self.frames: Frames = model.moved(last.frames, moving[0])
        self.drive: Array = last.drive
        self.correction: Array = moving[0]

    @property
    def state(self) -> MotionState:
        """The state after the step."""
        return MotionState(self.frames, self.moving[1], self.moving[2], self.drive)


class Look(NamedTuple):
    """What a look at a step has found: the largest of its correction, of its local error, of accelerations times the
    squared step, of its displacements, and of what they are from two that led there, over the size of the mechanism or
    in rad."""

    size: float
    error: float
    bent: float
    moved: float
    astray: float
    other: float


class _ByKernel:
    """Looks by a kernel with the factors of one matrix, in memory of their own."""

    def __init__(
        self, equations: Equations, together: Together, damping: Damping, scheme: Scheme, factor: LDL | Dense
    ) -> None:
        self.model: MovingModel = equations.model
        n, frames = self.model.n_dof, len(self.model.dof)
        self._memory = np.zeros(6 + 3 * n + 18 * frames + together.memory)
        self._found, self._correction = self._memory[:6], self._memory[6 : 6 + n]
        numbers = np.array([*damping, scheme.off, scheme.h**2, *scheme.by_step])
        own = isinstance(factor, Dense), *factor.arrays, factor.scale, equations.scale, numbers, self._memory
        self._struct = Struct(together.struct, *own)

    def looks(self, at: Attempt) -> Callable[[], Look]:
        """As `Newton.looks`."""
        last, (dead, follower, gravity, _) = at.last, vars(at.loads).values()
        nodes = np.array([*dead, *follower], dtype=np.int64)
        wrenches = np.array([*dead.values(), *follower.values()], dtype=float)
        loads = len(dead), len(follower), nodes, wrenches, gravity
        start, found = (self._struct.address, *last.frames[:3], last.acceleration), self._found
        again = _look.again(*start, *loads, at.led, at.moving, *at.frames[:3])
        at.correction = self._correction

        def look() -> Look:
            again.call()
            return Look(*found.tolist())

        return look


class Newton:
    """Newton's method for steps of a scheme, which changes with the length of steps."""

    def __init__(self, equations: Equations, damping: Damping, scheme: Scheme) -> None:
        self.equations = equations
        self.damping = damping
        self.scheme: Scheme = scheme
        self._factor: Any = None
        self._by_kernel: _ByKernel | None = None
        self._rows, self._by_drive = np.empty((0, 0)), np.empty((0, 0))
        self._rate = 0.5

    def turn_to(self, scheme: Scheme) -> None:
        """Go on with another scheme."""
        self.scheme, self._factor, self._rate = scheme, None, 0.5

    def forget(self) -> None:
        """Make the matrix anew when it is needed next."""
        self._factor = None

    def driven(self, force: Array, wanted: Array, had: Array) -> tuple[Array, Array]:
        """Motions (n,) by forces, and the forces (d,) of drives that make driven displacements as wanted beyond those
        (n,) that are there, by the last matrix."""
        motion = np.asarray(self._factor.solve(force), dtype=float)
        if not len(wanted):
            return motion, wanted
        left = wanted - self._rows @ (had + motion)
        drive = np.asarray(np.linalg.solve(self._rows @ self._by_drive, left), dtype=float)
        return motion + self._by_drive @ drive, drive

    def settle(self, at: Attempt) -> Look:
        """Work out a step; return its last look.

        Raises SolverError where it does not settle.
        """
        size, done, look = np.inf, 0, self._looks(at)
        while True:
            if self._factor is None:
                self.renew(at.state, at.loads)
                look = self._looks(at)
            before, found, done = size, look(), done + 1
            size, error, bent, moved, *_ = found
            if not np.isfinite(size) or size > LARGEST_ROTATION or done >= 2 * STEP_ITERATIONS:
                raise SolverError(f"{self._furthest(at.correction)} moves by more with each iteration")
            rate = min(size / before, 0.999) if done > 1 else self._rate
            small = min(max(STEP_CONVERGED[0] * error, STEP_CONVERGED[1] * bent), MOST_LEFT * moved)
            small += STEP_CONVERGED[2] * moved + NO_STEP
            if size * rate / (1 - rate) <= small:
                break
            if done == STEP_ITERATIONS or (done > 1 and rate > SLOW_RATE):
                self._factor = None
        if done > 1:
            self._rate = max(rate, LEAST_RATE)
            if done >= SLOW_STEP:
                self._factor = None
        else:  # nothing was measured, and the matrix has grown older
            self._rate = min(OLDER * self._rate, 0.5)
        return found

    def _looks(self, at: Attempt) -> Callable[[], Look]:
        """What takes a look at a step, which corrects it by what it lacks of equilibrium."""
        by_kernel = is_compiled() and isinstance(self._factor, LDL | Dense) and not len(at.drive)
        together = self.equations.model.all_together(at.loads.actuators) if by_kernel else None
        if together is None:
            return partial(self._look, at)
        if self._by_kernel is None:
            self._by_kernel = _ByKernel(self.equations, together, self.damping, self.scheme, self._factor)
        return self._by_kernel.looks(at)

    def _look(self, at: Attempt) -> Look:
        """A look in NumPy."""
        equations, scheme, (D, _, accelerated, _) = self.equations, self.scheme, at.moving
        missing = self.missing(at.frames, at.moving[1:3], at.drive, at.loads)
        gap = at.targets - equations.travelled(at.frames)
        at.correction, more = self.driven(missing, gap, 0 * missing)
        at.moving += scheme.by_step[:, None] * at.correction
        at.drive, at.frames = at.drive + more, equations.model.moved(at.last.frames, D)
        off = scheme.off * (accelerated - at.last.acceleration)
        sizes = np.array([at.correction, off, scheme.h**2 * accelerated, D, *(D - at.led)]) * equations.scale
        return Look(*np.abs(sizes).max(axis=1, initial=0.0).tolist())

    def _furthest(self, correction: Array) -> str:
        """The name of what moves by most in an iteration, displacements over the size of the mechanism."""
        equations = self.equations
        moved = np.abs(equations.displacements(correction * equations.scale)).max(axis=1)
        return equations.model.name_at(int(np.argmax(np.nan_to_num(moved, nan=np.inf))))

    def missing(self, frames: Frames, moving: Array, drive: Array, loads: Loads) -> Array:
        """The forces (n,) that are missing in a state for equilibrium with inertia and damping: `moving` (2, n) has
        velocities and accelerations, `drive` the forces (d,) of the drives."""
        equations, model, (alpha, beta) = self.equations, self.equations.model, self.damping
        velocity, acceleration = model.displacements(moving)
        rates = Rates(velocity, acceleration + alpha * velocity, beta)
        missing = -equations.free(model.kinetics(frames, rates, loads.gravity, loads.actuators).force)
        if loads.dead or loads.follower:
            missing += equations.free(loads.forces(model, frames))
        return missing + drive @ equations.rows(frames) if len(drive) else missing

    def ensure(self, state: MotionState) -> None:
        """Make the matrix about a state where there is none, under the loads of the last one."""
        if self._factor is None:
            self.renew(state, self._last_loads)

    def renew(self, state: MotionState, loads: Loads) -> None:
        """Factorise the matrix about a state."""
        frames, self._last_loads = state.frames, loads
        equations, model, (_, by_v, by_a, _) = self.equations, self.equations.model, self.scheme.by_step.tolist()
        tangent, _ = equations.tangent(frames, loads, state.drive)
        masses, by_mass = model.mass_blocks(frames), by_a + self.damping.alpha * by_v
        blocks = [k + by_mass * m for k, m in zip(tangent.forces.blocks, masses, strict=True)]
        if self.damping.beta:
            material = model.material_blocks(frames, loads.actuators)
            blocks = [k + self.damping.beta * by_v * m for k, m in zip(blocks, material, strict=True)]
        S = model.matrix(blocks)
        if model.dashpots:
            S = S + by_v * model.viscous(frames)
        if model.stops:
            S = S + model.stopping(frames, equations.displacements(state.velocity), by_v)
        self._factor, self._by_kernel = factorise(S), None
        self._rows = tangent.rows
        self._by_drive = np.asarray(self._factor.solve(tangent.rows.T)) if len(tangent.rows) else tangent.rows.T
