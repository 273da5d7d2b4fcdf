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
from flexura.motion.elements import Frames
from flexura.motion.equilibrium import Equations
from flexura.motion.model import Loads
from flexura.motion.path import displacement
from flexura.motion.se3 import LARGEST_ROTATION
from flexura.motion.stops import Contacts
from flexura.tables import quantity

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

SMOOTH = 0.2
"""How far accelerations that go on changing as they did lead from a step, over how far the last step is from it, below
which the next one starts with them: with what steps do not resolve they swing, and lead astray."""

LEAST_RATE = 0.01
"""Part that an iteration is expected to leave at least."""

OLDER = 1.5
"""Growth of the part that an iteration is expected to leave, where a step took a single one."""

MOST_HALVINGS = 12
"""Times that dt is halved at most for local errors."""

MOST_UNSETTLED = 6
"""Times that it is halved for steps that do not settle: beyond, it is not their length that keeps them from it."""

MOST_PATIENT = 64
"""Steps after which a longer one is tried again at most."""

EASY = 0.08
"""Share of the tolerance below which a step twice as long will do."""

LEAST_MOTION = 1e-4
"""Motion, over the size of the mechanism or in rad, to which local errors are related at least."""

CONTACT_ERROR = 1e-3
"""Local error in contact over its depth above which steps are halved: some 28 steps in half a period on the stop."""

NO_STEP = 1e-14
"""Step over the size of the mechanism, or in rad, that counts as none."""


class MotionState(NamedTuple):
    """Frames with velocities and accelerations (n,) of the free displacements, m/s, rad/s, m/s^2, rad/s^2, and the
    forces of the drives (d,), N or N m."""

    frames: Frames
    velocity: Array
    acceleration: Array
    drive: Array


class Moved(NamedTuple):
    """Driven displacements (d,), m and rad, with their derivatives by time."""

    place: Array
    rate: Array
    second: Array
    third: Array


NOTHING_MOVED = Moved(*np.zeros((4, 0)))
"""Where no displacement is prescribed."""


class Damping(NamedTuple):
    """Rayleigh damping: `alpha`, 1/s, times mass, and `beta`, s, times the stiffness of elements as they deform."""

    alpha: float
    beta: float


class _Pace:
    """Where a motion is: auxiliary accelerations, how accelerations change, 1/s, the mean velocities of the last step,
    whether accelerations led near its end, and how often dt is halved, of that for steps that did not settle."""

    def __init__(self, a: Array, jerk: Array, rate: Array) -> None:
        self.a, self.jerk, self.rate = a, jerk, rate
        self.is_smooth = True
        self.level, self.unsettled, self._since, self._patience = 0, 0, 0, 1

    def shorter(self, is_unsettled: bool) -> None:
        """Halve the step; where a longer one was just tried in vain, wait longer with the next one."""
        if self._since == 0 and self._patience > 1:
            self._patience = min(2 * self._patience, MOST_PATIENT)
        self.level, self.unsettled, self._since = self.level + 1, self.unsettled + is_unsettled, 0
        self._patience = max(self._patience, 2)

    def longer(self, is_easy: bool, done: float) -> None:
        """Double the step after some easy ones, where a sample is a whole number of them away."""
        self._since += 1
        if self.level and is_easy and self._since >= self._patience and (done * 2 ** (self.level - 1)) % 1 == 0:
            self.level, self.unsettled, self._since = self.level - 1, max(self.unsettled - 1, 0), 0

    def went_on(self, stepped: _Stepped, last: MotionState, h: float) -> None:
        """After a step."""
        self.a, self.jerk = stepped.a, (stepped.state.acceleration - last.acceleration) / h
        self.rate, self.is_smooth = stepped.D / h, stepped.is_smooth


class StepsTaken(NamedTuple):
    """Numbers of steps taken and of steps tried again at half the length, because they did not settle or for their
    local error, and the shortest one that was taken, s."""

    taken: int = 0
    not_settled: int = 0
    not_accurate: int = 0
    shortest: float = np.inf


class _Stepped(NamedTuple):
    """The state after a step, the auxiliary accelerations there, its displacements (n,), whether accelerations led near
    these, and local errors of the displacements and, over the depth of contacts, in the directions of stops."""

    state: MotionState
    a: Array
    D: Array
    is_smooth: bool
    error: float
    contact: float


class Integrator:
    """Generalised-alpha for a model under loads, of a spectral radius `rho` at high frequencies.

    Steps are `dt`, s, or halves, quarters ... of it where they do not settle, and where their local error is larger
    than a `tolerance`, over the largest motion so far (Zienkiewicz and Xie
    1991, Earthq. Eng. Struct. Dyn. 20). In contact with a stop they always have one, over its depth. `steps` tells what
    was taken, `contacts` what stops have met.
    """

    def __init__(
        self, equations: Equations, damping: Damping, dt: float, rho: float, tolerance: float | None = None
    ) -> None:
        self.equations = equations
        self.damping = damping
        self.dt = dt
        self.tolerance = tolerance
        self.am: float = (2 * rho - 1) / (rho + 1)
        self.af: float = rho / (rho + 1)
        self.gamma: float = 0.5 + self.af - self.am
        self.beta: float = (self.gamma + 0.5) ** 2 / 4
        self.steps: StepsTaken = StepsTaken()
        model = equations.model
        self.contacts: list[Contacts] = [Contacts(own, model.names_of_stops) for own in model.stops]
        self._h = dt
        self._factor: Any = None
        self._rows, self._by_drive = np.empty((0, 0)), np.empty((0, 0))
        self._moved: Callable[[float], Moved] = lambda _: NOTHING_MOVED
        self._rate = 0.5
        self._largest = LEAST_MOTION

    def through(
        self,
        start: Frames,
        velocity: Array,
        loads: Callable[[float], Loads],
        count: int,
        moved: Callable[[float], Moved] = lambda _: NOTHING_MOVED,
    ) -> Iterator[MotionState]:
        """States at the times 0, dt, ... (count - 1) dt, under loads and with the displacements of drives by number of
        the time, with parts of it where steps are shorter. What drives set in motion at the start gives way at once.

        Raises SolverError where the shortest step does not settle.
        """
        self._moved = moved
        none = np.zeros(len(self.equations.drives))
        state = MotionState(start, velocity, np.zeros(len(velocity)), none)
        self._renew(state, loads(0))
        at_start, by_a = moved(0), self._by_step[1]
        # masses times accelerations alone would be singular where something has no mass
        state = state._replace(velocity=velocity + self._driven(0 * velocity, at_start.rate, velocity)[0])
        _, missing = self._missing(start, np.array([0 * velocity, state.velocity, state.acceleration]), none, loads(0))
        acceleration, drive = self._driven(missing * by_a, at_start.second, 0 * velocity)
        state = state._replace(acceleration=acceleration, drive=drive / by_a)
        self._saw(state, is_start=True)
        yield state
        # auxiliary accelerations are those at another time: without this the forces of drives would swing
        jerk, _ = self._driven(0 * velocity, at_start.third, 0 * velocity)
        state = state._replace(velocity=state.velocity + self._ahead * self._h**2 * jerk)
        a = acceleration + (self.am - self.af) * self._h * jerk
        pace = _Pace(a, jerk, state.velocity + self._h / 2 * acceleration)
        for number in range(1, count):
            state = self._sample(state, pace, loads, number)
            yield state

    def _sample(self, state: MotionState, pace: _Pace, loads: Callable[[float], Loads], number: int) -> MotionState:
        """The state at the next sample, in as many steps as it takes."""
        done = 0.0
        while done < 1.0:
            part = 0.5**pace.level
            state = self._set(part * self.dt, pace, state, number - 1 + done)
            try:
                time = number - 1 + done + part
                stepped = self._step(state, pace, loads(time), self._moved(time).place)
            except SolverError as error:
                if pace.is_smooth:
                    pace.is_smooth, self._factor = False, None
                    continue
                if max(pace.unsettled - MOST_UNSETTLED, pace.level - MOST_HALVINGS) >= 0:
                    raise self._unsettled(error, (number - 1 + done) * self.dt) from None
                pace.shorter(is_unsettled=True)
                self._factor = None
                self.steps = self.steps._replace(not_settled=self.steps.not_settled + 1)
                continue
            if self._is_rough(stepped) and pace.level < MOST_HALVINGS:
                pace.shorter(is_unsettled=False)
                self._factor = None
                self.steps = self.steps._replace(not_accurate=self.steps.not_accurate + 1)
                continue
            done += part
            pace.went_on(stepped, state, self._h)
            state = stepped.state
            self._saw(state)
            shortest = min(self.steps.shortest, self._h)
            self.steps = self.steps._replace(taken=self.steps.taken + 1, shortest=shortest)
            pace.longer(not self._is_rough(stepped, EASY), done)
        return state

    def _unsettled(self, error: SolverError, time: float) -> SolverError:
        """What to tell of a motion that does not go on."""
        hint = (
            "a rho_infinity below 1 damps what swings too quickly for the steps, which at 1 does so for ever"
            if self.am == self.af
            else "a shorter dt or a smaller rho_infinity may help"
        )
        return SolverError(
            f"the motion does not settle at {quantity(time, 's', 6)}, in steps of {quantity(self._h, 's', 2)} either:"
            f" {error}; {hint}"
        )

    def _is_rough(self, stepped: _Stepped, share: float = 1.0) -> bool:
        """Whether the local error of a step is more than a share of what is tolerated."""
        if stepped.contact > share * (self.tolerance or CONTACT_ERROR):
            return True
        return self.tolerance is not None and stepped.error > share * self.tolerance * self._largest

    def _set(self, h: float, pace: _Pace, state: MotionState, time: float) -> MotionState:
        """The state from which steps of another length are taken: the auxiliary accelerations are those of another time
        then, and velocities that drives give are ahead by something else."""
        if h == self._h:
            return state
        jerk, third = pace.jerk, self._moved(time).third
        if len(third):
            if self._factor is None:
                self._renew(state, self._last_loads)
            none = 0 * jerk
            jerk = jerk + self._driven(none, third, jerk)[0]
            ahead = self._ahead * (h**2 - self._h**2) * self._driven(none, third, none)[0]
            state = state._replace(velocity=state.velocity + ahead)
        pace.a = pace.a + (self.am - self.af) * (h - self._h) * jerk
        self._h, self._factor, self._rate = h, None, 0.5
        return state

    def _saw(self, state: MotionState, is_start: bool = False) -> None:
        """Keep the largest motion so far, over the size of the mechanism or in rad, and what stops meet."""
        equations = self.equations
        for own in self.contacts:
            own.saw(state.frames, equations.displacements(state.velocity), is_start)
        if self.tolerance is not None:
            moved = equations.free(displacement(equations.model.rest, state.frames)) * equations.scale
            self._largest = max(self._largest, float(np.abs(moved).max(initial=0.0)))

    @property
    def _ahead(self) -> float:
        """By how much velocities are ahead of their displacements, over the squared step and the jerk."""
        return 1 / 6 - self.beta - (self.am - self.af) / 2

    @property
    def _by_step(self) -> tuple[float, float]:
        """Derivatives of velocities and accelerations by the displacements of a step."""
        h = self._h
        return self.gamma / (self.beta * h), (1 - self.am) / (self.beta * h**2 * (1 - self.af))

    def _driven(self, force: Array, wanted: Array, had: Array) -> tuple[Array, Array]:
        """Motions (n,) by forces, and the forces (d,) of drives that make driven displacements as wanted beyond those
        (n,) that are there, by the last matrix."""
        motion = np.asarray(self._factor.solve(force), dtype=float)
        if not len(wanted):
            return motion, wanted
        left = wanted - self._rows @ (had + motion)
        drive = np.asarray(np.linalg.solve(self._rows @ self._by_drive, left), dtype=float)
        return motion + self._by_drive @ drive, drive

    def _step(self, last: MotionState, pace: _Pace, loads: Loads, targets: Array) -> _Stepped:
        """The next state, with the driven displacements (d,) at their targets."""
        h, (by_v, by_a), a = self._h, self._by_step, pace.a
        equations, scale = self.equations, self.equations.scale
        accelerated = last.acceleration + h * pace.jerk
        after = ((1 - self.af) * accelerated + self.af * last.acceleration - self.am * a) / (1 - self.am)
        D = expected = h * last.velocity + h**2 * ((0.5 - self.beta) * a + self.beta * after)
        if not pace.is_smooth:
            D = h * pace.rate
            after = after + (D - expected) / (self.beta * h**2)
            accelerated = accelerated + by_a * (D - expected)
        v = last.velocity + h * ((1 - self.gamma) * a + self.gamma * after)
        moving, grown = np.array([D, v, accelerated, after]), np.array([1.0, by_v, by_a, 1 / (self.beta * h**2)])
        size, done, drive = np.inf, 0, last.drive
        while True:
            D, v, accelerated, _ = moving
            frames, missing = self._missing(last.frames, moving[:3], drive, loads)
            if self._factor is None:
                self._renew(MotionState(frames, v, accelerated, drive), loads)
            gap = targets - equations.travelled(frames)
            correction, more = self._driven(missing, gap, 0 * D)
            moving, drive = moving + grown[:, None] * correction, drive + more
            D, v, accelerated, after = moving
            off = (self.beta - 1 / 6) * h**2 * (accelerated - last.acceleration)
            sizes = np.abs(np.array([correction, off, h**2 * accelerated, D]) * scale).max(axis=1, initial=0.0)
            before, (size, error, bent, moved), done = size, sizes.tolist(), done + 1
            if not np.isfinite(size) or size > LARGEST_ROTATION or done >= 2 * STEP_ITERATIONS:
                raise SolverError(f"{self._furthest(correction)} moves by more with each iteration")
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
        state = MotionState(last.frames.moved(equations.displacements(D)), v, accelerated, drive)
        missed = equations.displacements(off) if self.contacts else off
        contact = max((own.error(last.frames, state.frames, missed) for own in self.contacts), default=0.0)
        astray, as_last = (float(np.abs((D - led) * scale).max(initial=0.0)) for led in (expected, h * pace.rate))
        return _Stepped(state, after, D, astray < SMOOTH * as_last, error, contact)

    def _furthest(self, correction: Array) -> str:
        """The name of what moves by most in an iteration, displacements over the size of the mechanism."""
        equations = self.equations
        moved = np.abs(equations.displacements(correction * equations.scale)).max(axis=1)
        return equations.model.name_at(int(np.argmax(np.nan_to_num(moved, nan=np.inf))))

    def _missing(self, start: Frames, moving: Array, drive: Array, loads: Loads) -> tuple[Frames, Array]:
        """The frames after displacements from a state, and the forces (n,) that are missing there for equilibrium with
        inertia and damping: `moving` (3, n) has displacements, velocities and accelerations, `drive` forces (d,)."""
        equations, model = self.equations, self.equations.model
        frames, held = model.after(start, moving, self.damping, loads.gravity, loads.actuators)
        missing = -equations.free(held)
        if loads.dead or loads.follower:
            missing += equations.free(loads.forces(model, frames))
        return frames, missing + drive @ equations.rows(frames) if len(drive) else missing

    def _renew(self, state: MotionState, loads: Loads) -> None:
        """Factorise the matrix of Newton's method about a state."""
        frames, self._last_loads = state.frames, loads
        equations, model, (by_v, by_a) = self.equations, self.equations.model, self._by_step
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
        self._rows = tangent.rows
        self._by_drive = np.asarray(self._factor.solve(tangent.rows.T)) if len(tangent.rows) else tangent.rows.T
