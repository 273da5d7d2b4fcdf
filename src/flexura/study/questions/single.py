"""What is asked of one design, quantity by quantity: strokes until something yields, magnitudes of frequency responses,
and what is read of the states that it is asked in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from math import sqrt
from typing import Any, Literal, NamedTuple

import numpy as np

from flexura.analysis import driven_displacement, frequency_response, moved_deformations, ratios_to_yield
from flexura.arrays import Array
from flexura.derivatives import DisplacedState, DisplacementPath, LinearState, SlopedResponse, SlopedRms
from flexura.duals import Dual, slope_of
from flexura.errors import Diagnostic, SolverError
from flexura.full_order import at_rest
from flexura.mechanism import UNIFORM
from flexura.motion import (
    NO_LOADS,
    Equations,
    Equilibrium,
    MovingModel,
    Path,
    Point,
    Stopped,
    described_loads,
    end_forces,
)
from flexura.structure import Design, Plan
from flexura.study.questions.blocks import FAILURES, Bounded, mass_of
from flexura.study.questions.kinds import FREQUENCY, WORST, Pose, Quantity
from flexura.study.questions.reading import Freedom, Port
from flexura.study.questions.states import MODES_FOLLOWED, PosedState, ReferenceState, leading_mode
from flexura.study.questions.worst import StrokeStates, WorstPose, worst_of
from flexura.tables import in_hz
from flexura.thresholds import CROSS_COMPLIANCE

FIRST_STEP = 1e-4
"""First step, over the size of the mechanism or in rad, from which the stroke to yield is estimated."""

STEPS_TO_YIELD = 4
"""Steps to the stroke at which it would yield if stress rose on as it does."""

STEP_GROWTH = 30.0
"""Of a step over the one before: under loads stress may fall, or stay, before it rises."""

MOST_STROKE_STEPS = 200
"""Steps after which nothing is said to yield."""

STROKE_TOLERANCE = 1e-10
"""Relative error of a stroke to yield."""

EQUAL_STROKES = 1e-7
"""Relative difference of strokes to both sides, and of their slopes, that is none."""

LARGEST_ROTATION = 3.1
"""Largest rotation that is looked at, rad."""


class _Displacement:
    """One displacement of a design, prescribed from rest on."""

    def __init__(self, design: Design, freedom: Freedom) -> None:
        self.full = at_rest(design.plan, design.parameters)
        self.freedom = freedom
        model = MovingModel.of(self.full.design)
        self.equations = Equations(model, [driven_displacement(model, freedom.name)])
        self.equations.independent()
        self.loads = described_loads(self.full.design)
        self.size = 1.0 if freedom.turns else self.equations.size
        self.rest = self.state(self.equations.at_rest(), Point(np.zeros(1), NO_LOADS), 0.0)

    def state(self, start: Equilibrium, at: Point, value: float) -> Equilibrium:
        """The state at a value, from another one. Raises SolverError where there is none."""
        state = Path(self.equations, start, at).to(self.point(value))
        if isinstance(state, Stopped):
            raise SolverError(f"nothing yields before its way ends near {self.freedom.name} = {self.text(start)}")
        return state

    def point(self, value: float) -> Point:
        """What is prescribed there."""
        return Point(np.array([value]), self.loads)

    def text(self, state: Equilibrium) -> str:
        """The displacement of a state in words."""
        return f"{self.equations.travelled(state.frames)[0]:.4g} {'rad' if self.freedom.turns else 'm'}"

    def stress_ratio(self, state: Equilibrium) -> float:
        """Largest stress over yield stress."""
        model = self.equations.model
        forces, deformed = end_forces(model, [state]), moved_deformations(self.full, model, [state])
        return float(ratios_to_yield(self.full, forces.__getitem__, deformed, 1).ratio.max())

    def to_yield(self, side: float, most: float) -> float:
        """The displacement, to one side, at which something yields first; infinite beyond `most`, m or rad."""
        last, before, step = self.rest, 0.0, FIRST_STEP * self.size
        ratio_before = self.stress_ratio(last)
        if ratio_before >= 1:
            return 0.0
        for _ in range(MOST_STROKE_STEPS):
            value = min(before + step, LARGEST_ROTATION) if self.freedom.turns else before + step
            if before >= most or value <= before:
                return np.inf
            state = self.state(last, self.point(side * before), side * value)
            ratio = self.stress_ratio(state)
            if ratio >= 1:
                return self._yield_between(last, before, value, side)
            rise = ratio - ratio_before
            left = (1 - ratio) / rise * (value - before) if rise > 0 else np.inf
            step = min(max(left / STEPS_TO_YIELD, step), STEP_GROWTH * step, self.size)
            last, before, ratio_before = state, value, ratio
        raise SolverError(f"nothing yields up to {self.freedom.name} = {self.text(last)}")

    def _yield_between(self, last: Equilibrium, low: float, high: float, side: float) -> float:
        """Where between two displacements the stress reaches yield; `last` is the state at the first one."""
        from scipy.optimize import brentq  # slow to import

        def beyond(value: float) -> float:
            state = last if value == low else self.state(last, self.point(side * low), side * value)
            return self.stress_ratio(state) - 1

        return float(brentq(beyond, low, high, xtol=STROKE_TOLERANCE * high, rtol=4 * STROKE_TOLERANCE))


def stroke_to_yield(design: Design, freedom: Freedom) -> Any:
    """The stroke, m or rad, to either side at which something yields first, described loads on. With slopes where the
    design has some: where stress(stroke, p) is that of yield, the stroke moves by minus the slope of the stress by p
    over that by the stroke (theory eq. V9); NaN where both sides yield alike and part as a parameter moves.

    Raises SolverError where a path of equilibria ends before, and where nothing yields.
    """
    displacement = _Displacement(design.still, freedom)
    first = displacement.to_yield(1.0, np.inf)
    strokes = {1.0: first, -1.0: displacement.to_yield(-1.0, first)}
    least = min(strokes.values())
    if not np.isfinite(least):
        raise SolverError(f"nothing yields up to {freedom.name} = {LARGEST_ROTATION} rad")
    if not isinstance(design.values, Dual):
        return least
    count = len(slope_of(design.values))
    if least == 0:
        return Dual(np.zeros(()), np.zeros(count))
    path = DisplacementPath(design, [freedom.name])

    def slope(stroke: float) -> Array:
        path.to(np.zeros(1))
        moving = Dual(np.array(stroke), np.ones(count))
        held, driven = (path.at([value]).largest_yield_ratio.slope for value in (stroke, moving))
        return -held / (driven - held)[np.argmin(np.abs(held))]

    slopes = [slope(side * stroke) * side for side, stroke in strokes.items() if stroke <= least * (1 + EQUAL_STROKES)]
    size = np.max(np.abs(slopes), axis=0)
    return Dual(np.array(least), np.where(np.ptp(slopes, axis=0) <= EQUAL_STROKES * size, slopes[0], np.nan))


BAND_POINTS = 200
"""Frequencies of a band, beside those around its resonances."""

PEAK_TOLERANCE = 1e-10
"""Relative width of the interval in which a peak is known."""

SLOPED_PEAK_TOLERANCE = 4 * np.finfo(float).eps
"""The same of a peak at which slopes are wanted."""


class Response(NamedTuple):
    """The response of an output to an input of a design, at a frequency `band[0]`, or over a band, Hz."""

    design: Design
    output: str
    input: str
    band: tuple[float, ...]

    @staticmethod
    def magnitude_of(design: Design, output: Port, command: Port, *band: float) -> Any:
        """The magnitude of the response of an output to a command, as `magnitude`, or as `sloped_magnitude` where the
        design has slopes."""
        response = Response(design, output.known, command.known, tuple(map(float, band)))
        return response.sloped_magnitude() if isinstance(design.values, Dual) else response.magnitude()

    @property
    def full(self) -> SlopedResponse:
        """That of the full-order model."""
        return SlopedResponse(self.design, self.output, self.input, self.band[-1])

    def magnitude(self) -> float:
        """Magnitude at the frequency, or the largest in the band, in SI: of the full-order model, of the low-order one
        where round-off would show in a direct solution. Raises SolverError at a resonance that nothing damps."""
        from scipy.optimize import minimize_scalar  # slow to import

        if len(self.band) == 1:
            full = self.full
            if full.is_known:
                return abs(full.at(self.band[0]))
            return float(abs(self._computed(frequency_hz=list(self.band)).response[0, 0, 0]))
        peak, full = self._scanned(), self.full
        if full.is_known:
            return abs(full.at(self._peak_frequency(full, peak, PEAK_TOLERANCE)))
        modes = peak.modes
        if modes is None:
            return peak.size
        refined = minimize_scalar(
            lambda f: -abs(modes.response(np.array([f]))[0, 0, 0]),
            bounds=(peak.low, peak.high),
            method="bounded",
            options={"xatol": 1e-9 * peak.low},
        )
        return float(max(peak.size, -refined.fun))

    def sloped_magnitude(self) -> Dual | None:
        """`magnitude` with its exact slopes, of a peak at the frequency where it is (the envelope theorem); None at
        poses, and where round-off would show."""
        full = self.full
        if self.design.plan.is_posed or not full.is_known:
            return None
        if len(self.band) == 1:
            return full.magnitude(self.band[0])
        return full.magnitude(self._peak_frequency(full, self._scanned(), SLOPED_PEAK_TOLERANCE))

    def _computed(self, **options: Any) -> Any:
        plan, parameters = self.design.plan, self.design.still.parameters
        return frequency_response(plan, parameters, inputs=[self.input], outputs=[self.output], **options)

    def _scanned(self) -> _Peak:
        # at a pose no two copies of a part are alike, and modes of the full order are found sooner
        order: Literal["low", "full"] = "full" if self.design.plan.is_posed else "low"
        scan = self._computed(band=self.band, points=BAND_POINTS, order=order)
        undamped = next((f for f, z in zip(scan.resonances_hz, scan.ratios, strict=True) if not z > 0), None)
        if undamped is not None:
            raise SolverError(
                f"nothing damps the resonance at {in_hz(undamped)}: its peak is infinite; describe `damping`"
            )
        size, hz = np.abs(scan.response[:, 0, 0]), scan.frequency_hz
        top = int(np.argmax(size))
        return _Peak(float(size[top]), float(hz[max(top - 1, 0)]), float(hz[min(top + 1, len(hz) - 1)]), scan.modes)

    def _peak_frequency(self, full: SlopedResponse, peak: _Peak, tolerance: float) -> float:
        """The frequency of the largest magnitude between two frequencies, or beyond them within the band: where low
        orders place a sharp peak may be outside."""
        from scipy.optimize import brentq  # slow to import

        low, high = peak.low, peak.high
        rises, falls = full.by_frequency(low) > 0, full.by_frequency(high) < 0
        while not (rises and falls):
            if (not rises and low <= self.band[0]) or (not falls and high >= self.band[1]):
                return max((low, high), key=lambda hz: abs(full.at(hz)))
            width = high - low
            if not rises:
                low = max(low - width, self.band[0])
                rises = full.by_frequency(low) > 0
            if not falls:
                high = min(high + width, self.band[1])
                falls = full.by_frequency(high) < 0
        rtol = max(tolerance, SLOPED_PEAK_TOLERANCE)
        return float(brentq(full.by_frequency, low, high, xtol=tolerance * high, rtol=rtol))


class _Peak(NamedTuple):
    """The largest magnitude of the low-order model in a band, frequencies, Hz, on both sides of where it is, which is
    at one of them where it is at an end, and the modes."""

    size: float
    low: float
    high: float
    modes: Any


def parasitic(state: DisplacedState, of: Freedom) -> Any:
    """Size of what moves beside the driven motion, from where loads and gravity alone leave it: the displacement, or
    where this is driven what moves of the same kind across it, m or rad."""
    moved = state.displacement(of.node)
    if state.design.plan.is_loaded:
        moved = moved - state.undriven.displacement(of.node)
    if of.name not in state.move:
        return abs(moved[of.component])
    first = 3 * of.turns
    across = [k for k in range(first, first + 3) if k != of.component]
    return np.sqrt(moved[across[0]] ** 2 + moved[across[1]] ** 2)


def centre_shift(state: DisplacedState, of: Freedom) -> Any:
    """How far a point of the body goes across the axis about which a moment turns it at rest, m: the size of the
    centre shift of a flexure pivot. The point is that of the axis which is nearest to the node."""
    design = state.design
    rest = LinearState(Design.of(design.plan.at_rest(), design.parameters))
    turned = rest.flexibility(rest.rows(of.node))[:, of.component]
    v, w = turned[:3], turned[3:]
    square = w[0] ** 2 + w[1] ** 2 + w[2] ** 2
    moved = state.point_displacement(of.node, np.cross(w, v) / square)
    along = (moved @ w) / square
    across = moved - along * w
    return np.sqrt(across @ across)


def rms_of(design: Design, output: Port, under: str | None = None) -> Any:
    """The root mean square of an output under all disturbances of a design, or under one; with slopes where the design
    has some, None where these are not known. Raises SolverError where it has no bound."""
    found = SlopedRms(design, output.known, under)
    return found.with_slopes() if isinstance(design.values, Dual) else found.value


READINGS: dict[str, Callable[..., Any]] = {
    "stiffness": lambda state, of: 1 / state.held.compliance(of.name, of.name),
    "compliance": lambda state, to, by=None: state.held.compliance(to.name, (by or to).name),
    "coupling": lambda state, actuator, to: state.free.coupling(actuator.known, to.name),
    "amplification": lambda state, actuator, to: state.free.amplification(actuator.known, to.name),
    "drift": lambda state, to, by=None: state.free.drift(by or UNIFORM, to.name),
    "stress": lambda state, of=None: state.held.stress(of and of.members),
    "margin": lambda state, of=None: state.held.margin(of and of.members),
    "shift": lambda state, of: state.held.displacement(of.node)[of.component],
    "parasitic": lambda state, of: parasitic(state.held, of),
    "centre_shift": lambda state, of: centre_shift(state.held, of),
    "force": lambda state, along: state.held.forces[along.name],
    "buckling": lambda state: state.held.buckling,
    "reach": lambda state, of: stroke_to_yield(state.design, of),
    "frf": lambda state, *of: Response.magnitude_of(state.design, *of),
    "frf_peak": lambda state, *of: Response.magnitude_of(state.design, *of),
    "rms": lambda state, *of: rms_of(state.design, *of),
}
"""How a quantity of one design is read of the state that it is asked in, with slopes where the design has some."""


def reading(state: Any, quantity: Quantity) -> Any:
    """A quantity but for frequencies, SI, of the state that it is asked in, with slopes where its design has some; None
    where these are not known. Raises FlexuraError where it cannot be read."""
    design = state.design
    if quantity.kind == "mass":
        return mass_of(design, quantity)
    if quantity.kind == "parameter":
        return design.plan.parameter_values(design.parameters)[str(quantity.arguments[0])]
    return READINGS[quantity.kind](state, *quantity.arguments)


class OneDesign:
    """A design in the states that it is asked in, each worked out once; its moving `model`, too, where that is not
    known."""

    def __init__(
        self,
        plan: Plan,
        parameters: Mapping[str, float],
        quantities: tuple[Quantity, ...],
        model: MovingModel | None = None,
    ) -> None:
        self.plan = plan
        self._known_model = model
        self.parameters = parameters
        self.quantities = quantities
        self._states: dict[Any, ReferenceState | PosedState] = {}
        self._frequencies: dict[Any, Bounded] = {}

    @cached_property
    def _moving(self) -> MovingModel:
        return self._known_model or MovingModel.of(Design.of(self.plan, self.parameters))

    def state(self, quantity: Quantity) -> ReferenceState | PosedState:
        """The state that something is asked in."""
        pose = quantity.pose
        if pose not in self._states:
            posed = PosedState(self.plan, self.parameters, pose, model=lambda: self._moving) if pose else None
            self._states[pose] = posed or ReferenceState(Design.of(self.plan, self.parameters))
        return self._states[pose]

    def number(self, quantity: Quantity) -> float:
        """A quantity, SI. Raises FlexuraError where it cannot be worked out."""
        if quantity.kind == FREQUENCY:
            return float(self.frequencies(quantity).hertz[self.mode(quantity)[0]])
        return self.read(quantity)

    def read(self, quantity: Quantity) -> float:
        """A quantity but for frequencies, SI. Raises FlexuraError where it cannot be read."""
        if quantity.kind == WORST:
            return self.worst(quantity).value
        return float(reading(self.state(quantity), quantity))

    def at(self, state: PosedState, quantities: tuple[Quantity, ...]) -> OneDesign:
        """The same design asked in a state that is known."""
        there = OneDesign(self.plan, self.parameters, quantities)
        there._states[state.pose] = state
        return there

    def worst(self, quantity: Quantity) -> WorstPose:
        """The worst of a quantity over the poses of a stroke or of commands. Raises SolverError where one of them is
        not reached, or what is asked is not known there."""
        return worst_of(quantity, self._over(quantity), self._numbers)

    def _over(self, quantity: Quantity) -> StrokeStates:
        return StrokeStates.of(self.plan, self.parameters, quantity, lambda: self._moving)

    def _numbers(self, state: PosedState, quantities: tuple[Quantity, ...]) -> list[float]:
        there = self.at(state, quantities)
        return [there.number(own) for own in quantities]

    def round_off(self, quantity: Quantity) -> float:
        """What a motion by a force elsewhere, which is what this is, is round-off below; 0 of anything else."""
        match self.state(quantity), quantity.kind, quantity.arguments:
            case state, "compliance", (Freedom() as to, Freedom() as by):
                first, second = (state.held.compliance(end.name, end.name) for end in (to, by))
                return CROSS_COMPLIANCE * sqrt(abs(first * second))
            case state, "coupling" | "amplification" as kind, (Port() as actuator, Freedom() as to):
                return CROSS_COMPLIANCE * state.free.largest_possible(kind, actuator, to)
        return 0.0

    def mode(self, quantity: Quantity) -> tuple[int, str]:
        """The number of the mode whose frequency is asked for, from 0, and a warning where others move as much."""
        of = quantity.arguments[0]
        if isinstance(of, int):
            return of - 1, ""
        assert isinstance(of, Freedom)
        count = min(MODES_FOLLOWED, self.plan.topology.n_dof)
        return leading_mode(self.state(quantity).modal_motion(of, count), of.name)

    def frequencies(self, quantity: Quantity) -> Bounded:
        """The lowest frequencies, as many as are asked for in the same state, with their bounds."""
        pose = quantity.pose
        if pose not in self._frequencies:
            asked = [other.arguments[0] for other in self.quantities if other.kind == FREQUENCY and other.pose == pose]
            count = max(of if isinstance(of, int) else MODES_FOLLOWED for of in asked)
            self._frequencies[pose] = self.state(quantity).frequencies(min(count, self.plan.topology.n_dof))
        return self._frequencies[pose]


def worst_pose(plan: Plan, parameters: Mapping[str, float], quantity: Quantity) -> WorstPose:
    """Where what is asked over a stroke, or over commands, is worst for one design. Raises FlexuraError where it is not
    known."""
    return OneDesign(plan, parameters, (quantity,)).worst(quantity)


def poses_of(plan: Plan, parameters: Mapping[str, float], quantity: Quantity) -> list[Pose]:
    """Where something is asked of one design: its pose, of a stroke the worst one and those at both ends; none at rest,
    and where the worst one is not known."""
    if quantity.kind != WORST:
        return [quantity.pose] if quantity.pose else []
    try:
        worst = worst_pose(plan, parameters, quantity).pose
    except FAILURES:
        return []
    poses = StrokeStates.of(plan, parameters, quantity).line.poses
    return list(dict.fromkeys((worst, poses[0], poses[-1])))


def limits_at(plan: Plan, parameters: Mapping[str, float], pose: Pose) -> tuple[Diagnostic, ...]:
    """What is beyond its limit at a pose of one design; nothing where that is not reached, which answers say."""
    try:
        return PosedState(plan, parameters, pose).limits
    except FAILURES:
        return ()
