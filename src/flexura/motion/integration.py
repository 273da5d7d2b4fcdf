"""Motion over time with large displacements and rotations: generalised-alpha on frames that turn.

Source: Brüls, Cardona, Arnold (2012), Mech. Mach. Theory 48, 121: the method of Chung and Hulbert (1993) with steps
that are displacements and rotation vectors from the last state, of second order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.motion.elements import Frames
from flexura.motion.equilibrium import Equations
from flexura.motion.model import Loads
from flexura.motion.newton import Attempt, Damping, MotionState, Newton, Scheme
from flexura.motion.path import displacement
from flexura.motion.stops import Contacts
from flexura.tables import quantity

SMOOTH = 0.2
"""How far accelerations that go on changing as they did lead from a step, over how far the last step is from it, below
which the next one starts with them: with what steps do not resolve they swing, and lead astray."""

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


class Moved(NamedTuple):
    """Driven displacements (d,), m and rad, with their derivatives by time."""

    place: Array
    rate: Array
    second: Array
    third: Array


NOTHING_MOVED = Moved(*np.zeros((4, 0)))
"""Where no displacement is prescribed."""


class _Pace:
    """How often dt is halved, of that for steps that did not settle, and whether accelerations led near the end of the
    last step."""

    def __init__(self) -> None:
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


class StepsTaken(NamedTuple):
    """Numbers of steps taken and of steps tried again at half the length, because they did not settle or for their
    local error, and the shortest one that was taken, s."""

    taken: int = 0
    not_settled: int = 0
    not_accurate: int = 0
    shortest: float = np.inf


class _Stepped(NamedTuple):
    """The state after a step, whether accelerations led near it, and local errors of displacements and, over the depth
    of contacts, in the directions of stops."""

    state: MotionState
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
        self.dt = dt
        self.tolerance = tolerance
        self.steps: StepsTaken = StepsTaken()
        model = equations.model
        self.contacts: list[Contacts] = [Contacts(own, model.names_of_stops) for own in model.stops]
        self._newton = Newton(equations, damping, Scheme.of(rho, dt))
        self._moved: Callable[[float], Moved] = lambda _: NOTHING_MOVED
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
        none, motion = np.zeros(len(self.equations.drives)), np.zeros((5, len(velocity)))
        newton, scheme, still = self._newton, self._newton.scheme, motion[0].copy()
        motion[1] = velocity
        state = MotionState(start, motion, none)
        newton.renew(state, loads(0))
        at_start, by_a = moved(0), float(scheme.by_step[2])
        # masses times accelerations alone would be singular where something has no mass
        motion[1] += newton.driven(still, at_start.rate, velocity)[0]
        motion[2], drive = newton.driven(newton.missing(state, loads(0)) * by_a, at_start.second, still)
        state = state._replace(drive=drive / by_a)
        self._saw(state, is_start=True)
        yield state
        # auxiliary accelerations are those at another time: without this the forces of drives would swing
        jerk, _ = newton.driven(still, at_start.third, still)
        velocity, acceleration = state.velocity + scheme.ahead * jerk, state.acceleration
        led = scheme.h * (velocity + scheme.h / 2 * acceleration)
        motion = np.array([led, velocity, acceleration, acceleration + scheme.later * jerk, jerk])
        state, pace = state._replace(motion=motion), _Pace()
        for number in range(1, count):
            state = self._sample(state, pace, loads, number)
            yield state

    def _sample(self, state: MotionState, pace: _Pace, loads: Callable[[float], Loads], number: int) -> MotionState:
        """The state at the next sample, in as many steps as it takes."""
        newton, done = self._newton, 0.0
        while done < 1.0:
            part = 0.5**pace.level
            state = self._set(part * self.dt, state, number - 1 + done)
            try:
                time = number - 1 + done + part
                stepped = self._step(state, pace.is_smooth, loads(time), self._moved(time).place)
            except SolverError as error:
                if pace.is_smooth:
                    pace.is_smooth = False
                    newton.forget()
                    continue
                if max(pace.unsettled - MOST_UNSETTLED, pace.level - MOST_HALVINGS) >= 0:
                    raise self._unsettled(error, (number - 1 + done) * self.dt) from None
                pace.shorter(is_unsettled=True)
                newton.forget()
                self.steps = self.steps._replace(not_settled=self.steps.not_settled + 1)
                continue
            if self._is_rough(stepped) and pace.level < MOST_HALVINGS:
                pace.shorter(is_unsettled=False)
                newton.forget()
                self.steps = self.steps._replace(not_accurate=self.steps.not_accurate + 1)
                continue
            done += part
            state, pace.is_smooth = stepped.state, stepped.is_smooth
            self._saw(state)
            shortest = min(self.steps.shortest, newton.scheme.h)
            self.steps = self.steps._replace(taken=self.steps.taken + 1, shortest=shortest)
            pace.longer(not self._is_rough(stepped, EASY), done)
        return state

    def _unsettled(self, error: SolverError, time: float) -> SolverError:
        """What to tell of a motion that does not go on."""
        scheme = self._newton.scheme
        hint = (
            "a rho_infinity below 1 damps what swings too quickly for the steps, which at 1 does so for ever"
            if scheme.am == scheme.af
            else "a shorter dt or a smaller rho_infinity may help"
        )
        return SolverError(
            f"the motion does not settle at {quantity(time, 's', 6)}, in steps of {quantity(scheme.h, 's', 2)} either:"
            f" {error}; {hint}"
        )

    def _is_rough(self, stepped: _Stepped, share: float = 1.0) -> bool:
        """Whether the local error of a step is more than a share of what is tolerated."""
        if stepped.contact > share * (self.tolerance or CONTACT_ERROR):
            return True
        return self.tolerance is not None and stepped.error > share * self.tolerance * self._largest

    def _set(self, h: float, state: MotionState, time: float) -> MotionState:
        """The state from which steps of another length are taken: the auxiliary accelerations are those of another time
        then, and velocities that drives give are ahead by something else."""
        newton, last = self._newton, self._newton.scheme
        if h == last.h:
            return state
        scheme, motion, third = replace(last, h=h), state.motion.copy(), self._moved(time).third
        jerk = motion[4]
        if len(third):
            newton.ensure(state)
            jerk = jerk + newton.driven(0 * jerk, third, jerk)[0]
            motion[1] += (scheme.ahead - last.ahead) * newton.driven(0 * jerk, third, 0 * jerk)[0]
        motion[0] *= h / last.h
        motion[3] += (scheme.later - last.later) * jerk
        newton.turn_to(scheme)
        return state._replace(motion=motion)

    def _saw(self, state: MotionState, is_start: bool = False) -> None:
        """Keep the largest motion so far, over the size of the mechanism or in rad, and what stops meet."""
        equations = self.equations
        for own in self.contacts:
            own.saw(state.frames, equations.displacements(state.velocity), is_start)
        if self.tolerance is not None:
            moved = equations.free(displacement(equations.model.rest, state.frames)) * equations.scale
            self._largest = max(self._largest, float(np.abs(moved).max(initial=0.0)))

    def _step(self, last: MotionState, is_smooth: bool, loads: Loads, targets: Array) -> _Stepped:
        """The next state, with the driven displacements (d,) at their targets."""
        at, newton, equations = Attempt(last, loads, targets), self._newton, self.equations
        found, state, contact = newton.settle(at, is_smooth), at.state, 0.0
        if self.contacts:
            off = equations.displacements(newton.scheme.off * (state.acceleration - last.acceleration))
            contact = max(own.error(last.frames, state.frames, off) for own in self.contacts)
        return _Stepped(state, found.from_led < SMOOTH * found.from_last, found.error, contact)
