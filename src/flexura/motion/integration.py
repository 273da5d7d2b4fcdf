"""Motion over time with large displacements and rotations: generalised-alpha on frames that turn.

Source: Brüls, Cardona, Arnold (2012), Mech. Mach. Theory 48, 121: the method of Chung and Hulbert (1993) with steps
that are displacements and rotation vectors from the last state, of second order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg import factorise
from flexura.motion.elements import Frames, Rates
from flexura.motion.equilibrium import Equations
from flexura.motion.model import Loads
from flexura.motion.se3 import LARGEST_ROTATION
from flexura.tables import quantity

STEP_CONVERGED = 1e-6, 1e-10
"""What is left of a step by Newton's method: over what accelerations change in it, and over itself."""

STEP_ITERATIONS = 12
"""Iterations with one matrix after which it is made anew; twice as many end the motion."""

SLOW_RATE = 0.3
"""Part of the error that an iteration leaves, from which the matrix is made anew for the next step."""

LEAST_RATE = 0.01
"""Part that an iteration is expected to leave at least."""

NO_STEP = 1e-14
"""Step over the size of the mechanism, or in rad, that counts as none."""


class MotionState(NamedTuple):
    """Frames with velocities and accelerations (n,) of the free displacements, m/s, rad/s, m/s^2, rad/s^2."""

    frames: Frames
    velocity: Array
    acceleration: Array


class Damping(NamedTuple):
    """Rayleigh damping: `alpha`, 1/s, times mass, and `beta`, s, times the stiffness of elements as they deform."""

    alpha: float
    beta: float


class Integrator:
    """Generalised-alpha for a model under loads in steps of dt, s, of a spectral radius `rho` at high frequencies."""

    def __init__(self, equations: Equations, damping: Damping, dt: float, rho: float) -> None:
        self.equations = equations
        self.damping = damping
        self.dt = dt
        self.am: float = (2 * rho - 1) / (rho + 1)
        self.af: float = rho / (rho + 1)
        self.gamma: float = 0.5 + self.af - self.am
        self.beta: float = (self.gamma + 0.5) ** 2 / 4
        self._factor: Any = None
        self._rate = 0.5

    def through(
        self, start: Frames, velocity: Array, loads: Callable[[int], Loads], count: int
    ) -> Iterator[MotionState]:
        """States at the times 0, dt, ... (count - 1) dt, under loads by number of the time.

        Raises SolverError where a step does not settle.
        """
        state = MotionState(start, velocity, np.zeros(len(velocity)))
        missing = self._missing(state, loads(0))
        self._renew(state.frames, loads(0))
        # masses times accelerations alone would be singular where something has no mass
        acceleration = self._factor.solve(missing) * self._by_step[1]
        state = state._replace(acceleration=acceleration)
        a = acceleration
        yield state
        for number in range(1, count):
            try:
                state, a = self._step(state, a, loads(number))
            except SolverError:
                raise SolverError(
                    f"the motion does not settle at {quantity(number * self.dt, 's', 6)}: shorten the step"
                ) from None
            yield state

    @property
    def _by_step(self) -> tuple[float, float]:
        """Derivatives of velocities and accelerations by the displacements of a step."""
        h = self.dt
        return self.gamma / (self.beta * h), (1 - self.am) / (self.beta * h**2 * (1 - self.af))

    def _step(self, last: MotionState, a: Array, loads: Loads) -> tuple[MotionState, Array]:
        """The next state, and the auxiliary accelerations there."""
        h, (by_v, by_a) = self.dt, self._by_step
        equations, scale = self.equations, self.equations.scale
        after = (last.acceleration - self.am * a) / (1 - self.am)
        D = h * last.velocity + h**2 * ((0.5 - self.beta) * a + self.beta * after)
        v = last.velocity + h * ((1 - self.gamma) * a + self.gamma * after)
        accelerated, size, done = last.acceleration, np.inf, 0
        while True:
            now = MotionState(last.frames.moved(equations.displacements(D)), v, accelerated)
            correction = self._factor.solve(self._missing(now, loads))
            D, v, accelerated = D + correction, v + by_v * correction, accelerated + by_a * correction
            after = after + correction / (self.beta * h**2)
            before, size, done = size, float(np.abs(correction * scale).max(initial=0.0)), done + 1
            if not np.isfinite(size) or size > LARGEST_ROTATION or done >= 2 * STEP_ITERATIONS:
                raise SolverError("a step does not settle")
            rate = min(size / before, 0.999) if done > 1 else self._rate
            moved, bent = (float(np.abs(change * scale).max(initial=0.0)) for change in (D, h**2 * accelerated))
            if size * rate / (1 - rate) <= STEP_CONVERGED[0] * bent + STEP_CONVERGED[1] * moved + NO_STEP:
                break
            if done == STEP_ITERATIONS or (done > 1 and rate > 0.5):
                self._renew(now.frames, loads)
        if done > 1:
            self._rate = max(rate, LEAST_RATE)
            if rate > SLOW_RATE:
                self._factor = None
        state = MotionState(last.frames.moved(equations.displacements(D)), v, accelerated)
        if self._factor is None:
            self._renew(state.frames, loads)
        return state, after

    def _missing(self, state: MotionState, loads: Loads) -> Array:
        """Forces (n,) that are missing for equilibrium with inertia and damping."""
        equations, model = self.equations, self.equations.model
        velocity = equations.displacements(state.velocity)
        acceleration = equations.displacements(state.acceleration + self.damping.alpha * state.velocity)
        rates = Rates(velocity, acceleration, self.damping.beta)
        held = model.kinetics(state.frames, rates, loads.gravity, loads.actuators)
        if loads.dead or loads.follower:
            return equations.free(loads.forces(model, state.frames) - held.force)
        return equations.free(-held.force)

    def _renew(self, frames: Frames, loads: Loads) -> None:
        """Factorise the matrix of Newton's method about a state."""
        equations, model, (by_v, by_a) = self.equations, self.equations.model, self._by_step
        tangent, _ = equations.tangent(frames, loads, np.empty(0))
        K = model.matrix(tangent.forces.blocks)
        S = K + (by_a + self.damping.alpha * by_v) * model.mass(frames)
        if self.damping.beta:
            S = S + self.damping.beta * by_v * model.material(frames, loads.actuators)
        if model.dashpots:
            S = S + by_v * model.viscous(frames)
        self._factor = factorise(S)
