"""What is asked of one design, quantity by quantity."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import sqrt
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from flexura.analysis import SlopedResponse, Way, frequency_response, ratios_to_yield, settled
from flexura.arrays import Array
from flexura.duals import Dual, plain
from flexura.errors import SolverError
from flexura.motion import (
    NO_LOADS,
    Drive,
    Equations,
    Equilibrium,
    MovingModel,
    Path,
    Point,
    Stopped,
    described_loads,
    end_forces,
)
from flexura.structure import Design, Plan, at_rest
from flexura.study.questions.blocks import ROUNDING, Bounded
from flexura.study.questions.grammar import FREQUENCY, Quantity
from flexura.study.questions.reading import Freedom, Hertz, Port
from flexura.study.questions.states import MODES, AtPose, AtRest, State, largest_stress, leading_mode, least_margin
from flexura.tables import in_hz

SMALL = 1e-4
"""First step, over the size of the mechanism or in rad, from which the stroke at yield is estimated."""

PARTS = 4
"""Steps to the stroke at which it would yield if stress rose on as it does."""

GROWTH = 30.0
"""Of a step over the one before: under loads stress may fall, or stay, before it rises."""

MOST = 200
"""Steps after which nothing is said to yield."""

EXACT = 1e-10
"""Relative error of a reach."""

ALIKE = 1e-7
"""Relative difference of strokes to both sides, and of their slopes, that is none."""

HALF_TURN = 3.1
"""Largest rotation that is looked at, rad."""


class _Stroke:
    """One displacement of a design, prescribed from rest on."""

    def __init__(self, plan: Plan, parameters: Mapping[str, float], of: Freedom) -> None:
        self.full = at_rest(plan, parameters)
        self.of = of
        model = MovingModel.of(self.full.design)
        number = int(self.full.plan.topology.numbers([of.node])[0])
        self.equations = Equations(model, [Drive(of.name, number, int(model.root[number]), of.component)])
        self.equations.independent()
        self.loads = described_loads(self.full.design)
        self.size = 1.0 if of.turns else self.equations.size
        start = self.equations.at_rest()
        self.rest = self.there(start, Point(np.zeros(1), NO_LOADS), 0.0)

    def there(self, start: Equilibrium, at: Point, value: float) -> Equilibrium:
        """The state at a value of the displacement, from another one. Raises SolverError where there is none."""
        found = next(iter(Path(self.equations, start, at).through([self.point(value)])))
        if isinstance(found, Stopped):
            raise SolverError(f"nothing yields before its way ends near {self.of.name} = {self.said(start)}")
        return found

    def point(self, value: float) -> Point:
        """What is prescribed there."""
        return Point(np.array([value]), self.loads)

    def said(self, state: Equilibrium) -> str:
        """The displacement of a state in words."""
        return f"{self.equations.travelled(state.frames)[0]:.4g} {'rad' if self.of.turns else 'm'}"

    def ratio(self, state: Equilibrium) -> float:
        """Largest stress over yield stress."""
        forces = end_forces(self.equations.model, [state])
        return float(ratios_to_yield(self.full, forces.__getitem__, 1).ratio.max())

    def until(self, side: float, most: float) -> float:
        """The displacement, to one side, at which something yields first, or more than `most`, m or rad."""
        last, before, step = self.rest, 0.0, SMALL * self.size
        reached = self.ratio(last)
        if reached >= 1:
            return 0.0
        for _ in range(MOST):
            value = min(before + step, HALF_TURN) if self.of.turns else before + step
            if before >= most or value <= before:
                return np.inf
            state = self.there(last, self.point(side * before), side * value)
            now = self.ratio(state)
            if now >= 1:
                return self._first(last, before, value, side)
            left = (1 - now) / (now - reached) * (value - before) if now > reached else np.inf
            step = min(max(left / PARTS, step), GROWTH * step, self.size)
            last, before, reached = state, value, now
        raise SolverError(f"nothing yields up to {self.of.name} = {self.said(last)}")

    def _first(self, last: Equilibrium, low: float, high: float, side: float) -> float:
        """Where between two displacements the stress reaches yield; `last` is the state at the first one."""

        def beyond(value: float) -> float:
            state = last if value == low else self.there(last, self.point(side * low), side * value)
            return self.ratio(state) - 1

        return float(brentq(beyond, low, high, xtol=EXACT * high, rtol=4 * EXACT))


def reach(plan: Plan, parameters: Mapping[str, float], of: Freedom) -> float:
    """Stroke, m or rad, to either side at which something yields first, the lesser of both, described loads on.

    Raises SolverError where a way of equilibria ends before, and where nothing yields.
    """
    return min(_sides(plan, parameters, of).values())


def sloped_reach(plan: Plan, parameters: Mapping[str, float], names: Sequence[str], of: Freedom) -> Dual:
    """As `reach`, with its exact slopes by some parameters: where stress(stroke, p) is that of yield, the stroke moves
    by minus the slope of the stress by p over that by the stroke (theory eq. V9).

    A slope is NaN where both sides yield alike and part as a parameter moves. Raises as `reach`.
    """
    sides = _sides(plan, parameters, of)
    least = min(sides.values())
    if least == 0:
        return Dual(np.zeros(()), np.zeros(len(names)))
    way = Way(Design.with_slopes(plan.at_rest(), parameters, names), [of.name])
    moved = [
        _stroke_slope(way, side * stroke) * side for side, stroke in sides.items() if stroke <= least * (1 + ALIKE)
    ]
    size = np.max(np.abs(moved), axis=0)
    return Dual(np.array(least), np.where(np.ptp(moved, axis=0) <= ALIKE * size, moved[0], np.nan))


def _stroke_slope(way: Way, stroke: float) -> Array:
    """Slopes (P,) of a signed stroke at which the largest stress over yield stress is held."""
    way.to(np.zeros(1))
    held, driven = (_ratio(way.at([own])).slope for own in (stroke, Dual(np.array(stroke), np.ones(way.count))))
    least = np.argmin(np.abs(held))
    return -held / (driven - held)[least]


def _ratio(at: Any) -> Any:
    """Largest stress over yield stress at a pose."""

    def largest(share: float) -> Any:
        found = at.stresses_within(share) if share else at.stresses
        known = ~np.isnan(plain(found.yield_stress))
        return np.max(found.von_mises[known, 0] / found.yield_stress[known])

    return settled(largest)


def _sides(plan: Plan, parameters: Mapping[str, float], of: Freedom) -> dict[float, float]:
    """Strokes to the sides 1 and -1, infinite where nothing yields on a side before the other does."""
    stroke = _Stroke(plan, parameters, of)
    first = stroke.until(1.0, np.inf)
    found = {1.0: first, -1.0: stroke.until(-1.0, first)}
    if not np.isfinite(min(found.values())):
        raise SolverError(f"nothing yields up to {of.name} = {HALF_TURN} rad")
    return found


POINTS = 200
"""Frequencies of a band, beside those around its resonances."""

NARROW = 1e-10
"""Relative width of the interval in which a peak is told."""

ROOT = 4 * np.finfo(float).eps
"""The same of a peak at which slopes are wanted."""


def magnitude(plan: Plan, parameters: Mapping[str, float], out: Port, into: Port, hz: Hertz) -> float:
    """Magnitude of a response at a frequency, in SI: of the full-order model, of the low-order one where round-off
    would show in a direct solution. Raises SolverError at a resonance that nothing damps."""
    own = SlopedResponse(plan, parameters, (), out.known, into.known, float(hz))
    if own.is_known:
        return abs(own.at(float(hz)))
    found = frequency_response(plan, parameters, frequency_hz=[hz], inputs=[into.known], outputs=[out.known])
    return float(abs(found.response[0, 0, 0]))


def peak(plan: Plan, parameters: Mapping[str, float], out: Port, into: Port, low: Hertz, high: Hertz) -> float:
    """The largest magnitude of a response in a band, in SI, of models as `magnitude`. Raises SolverError where a
    resonance is not damped."""
    found = _scanned(plan, parameters, out, into, low, high)
    own = SlopedResponse(plan, parameters, (), out.known, into.known, float(high))
    if own.is_known:
        return abs(own.at(_top(own, found.low, found.high, (float(low), float(high)), NARROW)))
    modes = found.modes
    if modes is None:
        return found.size
    refined = minimize_scalar(
        lambda f: -abs(modes.response(np.array([f]))[0, 0, 0]),
        bounds=(found.low, found.high),
        method="bounded",
        options={"xatol": 1e-9 * found.low},
    )
    return float(max(found.size, -refined.fun))


class _Scanned(NamedTuple):
    """The largest magnitude of the low-order model in a band, frequencies, Hz, on both sides of where it is, which is
    at one of them where it is at an end, and the modes."""

    size: float
    low: float
    high: float
    modes: Any


def _scanned(plan: Plan, parameters: Mapping[str, float], out: Port, into: Port, low: Hertz, high: Hertz) -> _Scanned:
    band = (float(low), float(high))
    # at a pose no two copies of a part are alike, and modes of the full order are found sooner
    order: Literal["low", "full"] = "full" if plan.is_posed else "low"
    found = frequency_response(
        plan, parameters, band=band, points=POINTS, inputs=[into.known], outputs=[out.known], order=order
    )
    undamped = next((f for f, z in zip(found.resonances_hz, found.ratios, strict=True) if not z > 0), None)
    if undamped is not None:
        raise SolverError(f"nothing damps the resonance at {in_hz(undamped)}: its peak is infinite; describe `damping`")
    size, hz = np.abs(found.response[:, 0, 0]), found.frequency_hz
    best = int(np.argmax(size))
    ends = float(hz[max(best - 1, 0)]), float(hz[min(best + 1, len(hz) - 1)])
    return _Scanned(float(size[best]), *ends, found.modes)


def _top(own: SlopedResponse, low: float, high: float, band: tuple[float, float], narrow: float) -> float:
    """The frequency of the largest magnitude between two frequencies, or beyond them within a band: where low orders
    place a sharp peak may be outside."""
    rises, falls = own.by_frequency(low) > 0, own.by_frequency(high) < 0
    while not (rises and falls):
        if (not rises and low <= band[0]) or (not falls and high >= band[1]):
            return max((low, high), key=lambda hz: abs(own.at(hz)))
        wide = high - low
        if not rises:
            low = max(low - wide, band[0])
            rises = own.by_frequency(low) > 0
        if not falls:
            high = min(high + wide, band[1])
            falls = own.by_frequency(high) < 0
    return float(brentq(own.by_frequency, low, high, xtol=narrow * high, rtol=max(narrow, ROOT)))


def sloped_magnitude(
    plan: Plan, parameters: Mapping[str, float], names: Sequence[str], asked: Sequence[Any]
) -> Dual | None:
    """A response with its exact slopes, at a frequency or the largest in a band, whose slope is that at the frequency
    where it is (the envelope theorem); None at poses. Raises as `peak`."""
    if plan.is_posed:
        return None
    out, into, *band = asked
    own = SlopedResponse(plan, parameters, names, out.known, into.known, float(band[-1]))
    if not own.is_known:
        return None
    if len(band) == 1:
        return own.magnitude(float(band[0]))
    found = _scanned(plan, parameters, out, into, *band)
    return own.magnitude(_top(own, found.low, found.high, (float(band[0]), float(band[1])), ROOT))


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
