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
from flexura.kernels import Kernel, Struct, address, is_compiled
from flexura.linalg import LDL, Dense, factorise
from flexura.motion.elements import Frames, Rates
from flexura.motion.equilibrium import Equations
from flexura.motion.model import Loads
from flexura.motion.se3 import LARGEST_ROTATION
from flexura.motion.together import Together

_begin = Kernel("motion_begin", "aaaaaaaaaan")
_look = Kernel("motion_look", "aaaaaaaaaannaaa")

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
    """Frames, the forces of the drives (d,), N or N m, and `motion` (5, n) of the free displacements: how far a step
    has led to them, m, rad, velocities, accelerations, auxiliary accelerations and how accelerations change, 1/s."""

    frames: Frames
    motion: Array
    drive: Array

    @property
    def velocity(self) -> Array:
        """Velocities (n,), m/s, rad/s."""
        return self.motion[1]

    @property
    def acceleration(self) -> Array:
        """Accelerations (n,), m/s^2, rad/s^2."""
        return self.motion[2]


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
    """A step from the last state under loads, with driven displacements (d,) at targets: the `motion` (5, n) after it,
    its frames and the forces of the drives (d,), as far as they are known, the last `correction` (n,) of displacements,
    and those (2, n) to which accelerations and the last step `led`."""

    def __init__(self, last: MotionState, loads: Loads, targets: Array) -> None:
        self.last: MotionState = last
        self.loads: Loads = loads
        self.targets: Array = targets
        self.frames: Frames = last.frames.copy()
        self.motion: Array = np.empty(last.motion.shape)
        self.drive: Array = last.drive
        self.correction: Array = self.motion[0]
        self.led: Array = np.empty((2, last.motion.shape[1]))

    @property
    def state(self) -> MotionState:
        """The state after the step."""
        return MotionState(self.frames, self.motion, self.drive)


class Look(NamedTuple):
    """What a look at a step has found: the largest of its correction, of its local error, of accelerations times the
    squared step, of its displacements, and of what these are from where accelerations and where the last step led, over
    the size of the mechanism or in rad."""

    size: float
    error: float
    bent: float
    moved: float
    from_led: float
    from_last: float


class _ByNumpy:
    """A step looked at in NumPy."""

    def __init__(self, newton: Newton, at: Attempt) -> None:
        self.newton: Newton = newton
        self.at: Attempt = at

    def begin(self, is_smooth: bool) -> None:
        """Where accelerations lead that go on changing as they did, or the last step does if they are not smooth."""
        (newton, at), scheme = (self.newton, self.at), self.newton.scheme
        at.motion[:4] = scheme.led @ at.last.motion[1:]
        at.led[:] = at.motion[0], at.last.motion[0]
        if not is_smooth:
            at.motion[:4] += scheme.by_step[:, None] * (at.led[1] - at.led[0])
        at.frames = newton.equations.model.moved(at.last.frames, at.motion[0])

    def look(self) -> list[float]:
        """Correct the step by what it lacks of equilibrium; return the numbers of a `Look`."""
        (newton, at), scheme, (D, _, accelerated, *_) = (self.newton, self.at), self.newton.scheme, self.at.motion
        equations, last = newton.equations, at.last
        missing = newton.missing(at.state, at.loads)
        gap = at.targets - equations.travelled(at.frames)
        at.correction, more = newton.driven(missing, gap, 0 * missing)
        at.motion[:4] += scheme.by_step[:, None] * at.correction
        at.drive, at.frames = at.drive + more, equations.model.moved(last.frames, D)
        change = accelerated - last.acceleration
        at.motion[4] = change / scheme.h
        lengths = at.correction, scheme.off * change, scheme.h**2 * accelerated, D, *(D - at.led)
        return np.abs(np.array(lengths) * equations.scale).max(axis=1, initial=0.0).tolist()


class _Desk:
    """What kernels take of all steps of a scheme, and the memory that they work in."""

    def __init__(self, newton: Newton, together: Together) -> None:
        n, frames, scheme = newton.equations.model.n_dof, len(newton.equations.model.dof), newton.scheme
        numbers = np.concatenate([newton.damping, [scheme.off, scheme.h], scheme.by_step, scheme.led.ravel()])
        self._memory = np.zeros(6 + 3 * n + 18 * frames + together.memory)
        self._own: tuple[Any, ...] = together.struct, newton.equations.scale, numbers, self._memory
        self.found: Array = self._memory[:6]
        self.correction: Array = self._memory[6 : 6 + n]
        self.struct: Struct = Struct(*self._own)

    def take(self, factor: LDL | Dense | None) -> None:
        """Go on with the factors of another matrix, if there is one."""
        if factor is not None:
            self.struct = Struct(*self._own, isinstance(factor, Dense), *factor.arrays, factor.scale)


class _ByKernel:
    """A step looked at by kernels: `begin` and `look` as `_ByNumpy`."""

    def __init__(self, desk: _Desk, at: Attempt) -> None:
        dead, follower = at.loads.dead, at.loads.follower
        nodes = np.array([*dead, *follower], dtype=np.int64)
        wrenches = np.array([*dead.values(), *follower.values()], dtype=float)
        steps = *at.last.frames[:3], at.last.motion, *at.frames[:3], at.motion, at.led
        loads = nodes, wrenches, np.ascontiguousarray(at.loads.gravity, dtype=float)
        own = desk.struct.address, *map(address, steps)
        self.begin: Callable[[bool], int] = partial(_begin.bare, *own)
        self._look = partial(_look.bare, *own, len(dead), len(follower), *map(address, loads))
        self._found, self._kept = desk.found, (desk.struct, steps, loads)
        at.correction = desk.correction

    def look(self) -> list[float]:
        self._look()
        return self._found.tolist()


class Newton:
    """Newton's method for steps of a scheme, which changes with the length of steps."""

    def __init__(self, equations: Equations, damping: Damping, scheme: Scheme) -> None:
        self.equations = equations
        self.damping = damping
        self.scheme: Scheme = scheme
        self._factor: Any = None
        self._desk: _Desk | None = None
        self._rows, self._by_drive = np.empty((0, 0)), np.empty((0, 0))
        self._rate = 0.5

    def turn_to(self, scheme: Scheme) -> None:
        """Go on with another scheme."""
        self.scheme, self._factor, self._desk, self._rate = scheme, None, None, 0.5

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

    def settle(self, at: Attempt, is_smooth: bool) -> Look:
        """Work out a step, from where accelerations lead, or the last step does if they are not smooth; return its last
        look.

        Raises SolverError where it does not settle.
        """
        size, done, step = np.inf, 0, self.looked_at(at)
        step.begin(is_smooth)
        while True:
            if self._factor is None:
                self.renew(at.state, at.loads)
                step = self.looked_at(at)
            before, found, done = size, step.look(), done + 1
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
        return Look(*found)

    def looked_at(self, at: Attempt) -> _ByKernel | _ByNumpy:
        """What takes looks at a step."""
        together = None if len(at.drive) or at.loads.actuators else self.equations.model.all_together
        if together is None or not is_compiled() or not isinstance(self._factor, LDL | Dense | None):
            return _ByNumpy(self, at)
        if self._desk is None:
            self._desk = _Desk(self, together)
            self._desk.take(self._factor)
        return _ByKernel(self._desk, at)

    def _furthest(self, correction: Array) -> str:
        """The name of what moves by most in an iteration, displacements over the size of the mechanism."""
        equations = self.equations
        moved = np.abs(equations.displacements(correction * equations.scale)).max(axis=1)
        return equations.model.name_at(int(np.argmax(np.nan_to_num(moved, nan=np.inf))))

    def missing(self, state: MotionState, loads: Loads) -> Array:
        """The forces (n,) that are missing in a state for equilibrium with inertia and damping."""
        equations, model, (alpha, beta) = self.equations, self.equations.model, self.damping
        velocity, acceleration = model.displacements(state.motion[1:3])
        rates = Rates(velocity, acceleration + alpha * velocity, beta)
        missing = -equations.free(model.kinetics(state.frames, rates, loads.gravity, loads.actuators).force)
        if loads.dead or loads.follower:
            missing += equations.free(loads.forces(model, state.frames))
        return missing + state.drive @ equations.rows(state.frames) if len(state.drive) else missing

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
        self._factor = factorise(S)
        if self._desk is not None and isinstance(self._factor, LDL | Dense):
            self._desk.take(self._factor)
        self._rows = tangent.rows
        self._by_drive = np.asarray(self._factor.solve(tangent.rows.T)) if len(tangent.rows) else tangent.rows.T
