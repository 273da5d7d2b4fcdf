"""What is asked of one design, quantity by quantity."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import sqrt
from typing import Any

from flexura.structure import Plan
from flexura.study.questions.answers import Bounded
from flexura.study.questions.catalogue import FREQUENCY, Quantity
from flexura.study.questions.followed import MODES, leading_mode
from flexura.study.questions.reach import reach
from flexura.study.questions.reading import Freedom, Port
from flexura.study.questions.responses import magnitude, peak
from flexura.study.questions.states import AtPose, AtRest, State, largest_stress, least_margin
from flexura.study.questions.statics import ROUNDING

READINGS: dict[str, Callable[..., float]] = {
    "stiffness": lambda state, of: state.stiffness(of),
    "compliance": lambda state, to, by=None: state.compliance(to, to if by is None else by),
    "coupling": lambda state, actuator, to: state.coupling(actuator, to),
    "amplification": lambda state, actuator, to: state.amplification(actuator, to),
    "stress": lambda state, of=None: largest_stress(state, of),
    "margin": lambda state, of=None: least_margin(state, of),
    "force": lambda state, of: state.force(of),
    "buckling": lambda state: state.buckling,
    "reach": lambda state, of: reach(state.plan, state.parameters, of),
    "frf": lambda state, out, into, hz: magnitude(state.plan, state.parameters, out, into, hz),
    "frf_peak": lambda state, out, into, low, high: peak(state.plan, state.parameters, out, into, low, high),
}
"""How a quantity of one design is read of the state that it is asked in."""


class OneDesign:
    """A design in the states that it is asked in, each worked out once."""

    def __init__(self, plan: Plan, parameters: Mapping[str, float], asked: tuple[Quantity, ...]) -> None:
        self.plan = plan
        self.parameters = parameters
        self.asked = asked
        self._states: dict[Any, State] = {}
        self._frequencies: dict[Any, Bounded] = {}

    def state(self, asked: Quantity) -> State:
        """The state that something is asked in."""
        key = asked.pose
        if key not in self._states:
            at_pose = AtPose(self.plan, self.parameters, key) if key else None
            self._states[key] = at_pose or AtRest(self.plan, self.parameters)
        return self._states[key]

    def read(self, asked: Quantity) -> float:
        """A quantity but for frequencies, masses and parameters, SI. Raises FlexuraError where it cannot be read."""
        return READINGS[asked.kind](self.state(asked), *asked.arguments)

    def round_off(self, asked: Quantity) -> float:
        """What a motion by a force elsewhere, which is what this is, is round-off below; 0 of anything else."""
        match self.state(asked), asked.kind, asked.arguments:
            case state, "compliance", (Freedom() as to, Freedom() as by):
                return ROUNDING * sqrt(abs(state.compliance(to, to) * state.compliance(by, by)))
            case state, "coupling" | "amplification" as kind, (Port() as actuator, Freedom() as to):
                return ROUNDING * state.most(kind, actuator, to)
        return 0.0

    def mode(self, asked: Quantity) -> tuple[int, str]:
        """The number of the mode whose frequency is asked for, from 0, and what is in doubt about that."""
        of = asked.arguments[0]
        if isinstance(of, int):
            return of - 1, ""
        assert isinstance(of, Freedom)
        return leading_mode(*self.state(asked).moved(of, min(MODES, self.plan.topology.n_dof)), of.name)

    def frequencies(self, asked: Quantity) -> Bounded:
        """The lowest frequencies, as many as are asked for in the same state, with their bounds."""
        if asked.pose not in self._frequencies:
            same = [own.arguments[0] for own in self.asked if own.kind == FREQUENCY and own.pose == asked.pose]
            count = max(own if isinstance(own, int) else MODES for own in same)
            found = self.state(asked).frequencies(min(count, self.plan.topology.n_dof))
            self._frequencies[asked.pose] = found
        return self._frequencies[asked.pose]
