"""Nonlinear frequency response: steady motions under a sine of some amplitude, with folds and stability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.analysis.limits import command_limits
from flexura.analysis.responses.oscillations import (
    FOLDED,
    HARMONICS,
    Curve,
    Reading,
    bent,
    branches,
    built_system,
    checked_harmonics,
    followed,
    harmonic_errors,
    harmonic_remarks,
    lost,
    node_numbers,
    oscillating,
    read,
    studied,
)
from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import plan_of
from flexura.linalg import Balance, Orbit, Series, count_below, located
from flexura.mechanism import Damping, Mechanism
from flexura.motion import Equations, Equilibrium, Oscillation
from flexura.records import Record
from flexura.results import Tabular
from flexura.structure import Channel, FullOrderModel, Plan
from flexura.systems import Order, System
from flexura.tables import Facts, Item, Table, counted, in_hz, quantity

STEPS = 0.1, 0.4
"""First and longest arc lengths, of one for the largest linear response and for the width of its resonance."""

FAR = 0.2
"""Longest step over the distance to the nearest natural frequency, where that is more."""

MOST_MODES = 12
"""Modes by which the low order is judged."""

WIDTHS = 4.0
"""Damping ratios times the frequency that are one width."""


@dataclass(frozen=True, repr=False)
class Fold(Record):
    """Where a curve turns back: frequency, and the largest value of each output by name."""

    frequency_hz: float
    largest: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class NonlinearResponse(Tabular):
    """Steady motions along a curve under the sine u cos(omega t) of amplitudes `amounts` at the inputs.

    `frequency_hz` (c,) goes to and fro where there are `folds`. `harmonics` (c, H + 1, p) are complex amplitudes of the
    outputs, constant part first, which add Re(Y_k exp(i k omega t)), `largest` (c, p) the largest values in a period.
    Motions are `stable` (c,) or not.
    """

    _shown = ("name", "inputs", "outputs", "amounts")
    _told = (
        *("name", "inputs", "amounts", "outputs", "frequency_hz", "harmonics", "largest", "stable", "folds"),
        "harmonic_error",
    )

    name: str
    inputs: tuple[Channel, ...]
    amounts: tuple[float, ...]
    outputs: tuple[Channel, ...]
    frequency_hz: Array
    harmonics: Complex
    largest: Array
    stable: NDArray[np.bool_]
    folds: tuple[Fold, ...]
    harmonic_error: float
    warnings: tuple[Diagnostic, ...]
    notes: tuple[str, ...]

    def of(self, output: str) -> Complex:
        """Complex amplitudes (c, H + 1) of an output by name. Raises OptionError for others."""
        names = [c.name for c in self.outputs]
        if output not in names:
            raise OptionError(f"there is no output {output!r}; known: {', '.join(names)}")
        return self.harmonics[:, :, names.index(output)]

    def _title(self) -> str:
        driven = ", ".join(f"{c.name} {quantity(u, c.unit, 4)}" for c, u in zip(self.inputs, self.amounts, strict=True))
        return f"{driven}, {counted(len(self.frequency_hz), 'motion')}"

    def presentation(self) -> Iterator[Item]:
        """The largest value of each output with its frequency, folds, and motions along the curve."""
        top = self.largest.argmax(axis=0)
        values = [quantity(float(y[k]), c.unit) for y, k, c in zip(self.largest.T, top, self.outputs, strict=True)]
        yield Table(
            {"output": [c.name for c in self.outputs], "largest": values, "at [Hz]": self.frequency_hz[top]}, "outputs"
        )
        yield Facts({"folds": ", ".join(in_hz(fold.frequency_hz, 5) for fold in self.folds) or "none"})
        yield Table(self._columns(), "motions", is_spread=True)

    def _columns(self) -> dict[str, Any]:
        columns: dict[str, Any] = {"frequency [Hz]": self.frequency_hz, "stable": self.stable}
        for p, channel in enumerate(self.outputs):
            columns[f"{channel.name} [{channel.unit}]"] = self.largest[:, p]
            for k in range(1, min(self.harmonics.shape[1], 4)):
                own = self.harmonics[:, k, p]
                columns[f"{channel.name} harmonic {k} [{channel.unit}]"] = np.abs(own)
                if k == 1:
                    columns[f"{channel.name} phase [deg]"] = np.degrees(np.angle(own))
        return columns


@verb
def nonlinear_response(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    inputs: Mapping[str, float],
    outputs: Sequence[str] | None = None,
    band: tuple[float, float],
    harmonics: int = HARMONICS,
    damping: Damping | float | Mapping[str, Any] | None = None,
    order: Order = "low",
) -> NonlinearResponse:
    """Steady response with large displacements to a sine at named inputs, over a band of frequencies, Hz.

    `inputs` has the amplitudes, in the units of inputs, all in phase; `outputs` and `damping` are as in `system`. The
    curve is followed by arc length from the lowest frequency through its folds to the highest, by harmonic balance
    about the static state under the loads described, with the stability of each motion (theory eqs. G42-G48; Cameron
    and Griffin 1989; Krack and Gross 2019). Elements are all those of the mechanism at `order="full"`, or corotational
    superelements. Motions that are not connected with this curve are not found.

    Raises ModelError, OptionError for impossible bands and amplitudes, unknown names and no damping, and SolverError
    where no motion is found.
    """
    low, high = _band(band)
    harmonics = checked_harmonics(harmonics)
    names, amounts = _amounts(inputs)
    plan = plan_of(model, parameters) if isinstance(model, Mechanism) else model
    built = built_system(plan, parameters, order, inputs=names, outputs=outputs, damping=damping)
    if not built.is_damped:
        raise OptionError("without damping the response at a resonance is infinite: give some damping")
    if not built.outputs:
        raise OptionError("nothing is read: name outputs, such as NODE.tx")
    ended, told = list[Diagnostic](), list[str]()

    def follow(equations: Equations, state: Equilibrium) -> Curve:
        oscillation, notes = oscillating(built, equations, state, amounts)
        readings = [Reading.of(equations.model, port) for port in built.output_ports]
        ended.clear()
        told[:] = notes
        curve = _curve(oscillation, readings, (low, high), harmonics)
        if curve.frequency_hz[-1] < high * (1 - 1e-6):
            top, first = float(curve.largest[-1, 0]), built.outputs[0]
            ended.append(lost(first.name, first.unit, top, float(curve.frequency_hz[-1]), in_hz(high, 5)))
        elif curve.largest[:, 0].argmax() == len(curve.orbits) - 1:
            text = f"{built.outputs[0].name} still grows at {in_hz(high, 5)}, where the band ends: let it reach further"
            ended.append(Diagnostic("resonance", built.outputs[0].name, high, np.nan, "Hz", text))
        return curve

    def like(equations: Equations, state: Equilibrium) -> Equilibrium:
        oscillation, _ = oscillating(built, equations, state, amounts)
        return bent(oscillation, _Linear.of(oscillation).largest(2 * np.pi * low, 2 * np.pi * high))

    found = studied(built, order, node_numbers(built), _modes_below(built, high), follow, like)
    curve = found.curve
    errors = harmonic_errors(curve)
    note, warned = harmonic_remarks(errors, harmonics)
    branch_notes, branching = branches(curve, built.outputs[0].name, built.outputs[0].unit)
    driven = np.array([[u, -u] for u in amounts])
    return NonlinearResponse(
        built.name,
        built.inputs,
        tuple(amounts),
        built.outputs,
        curve.frequency_hz,
        curve.amplitudes,
        curve.largest,
        curve.stable,
        tuple(
            Fold(hz, {c.name: float(y) for c, y in zip(built.outputs, values, strict=True)})
            for hz, values in _folds(curve)
        ),
        max(errors),
        (*branching, *ended, *command_limits(built.input_ports, driven), *warned, *found.warnings),
        (*found.notes, note, *branch_notes, *told),
    )


def _modes_below(built: System, hz: float) -> int:
    """How many modes at rest there are up to a frequency, one at least and a dozen at most."""
    return min(max(count_below(built.K, built.M, (2 * np.pi * hz) ** 2), 1), MOST_MODES)


def _band(band: tuple[float, float]) -> tuple[float, float]:
    """The band. Raises OptionError for impossible ones."""
    low, high = (float(f) for f in band)
    if not (np.isfinite(high) and 0 < low < high):
        raise OptionError(f"a band is two frequencies in Hz, 0 < from < to, not {low:g}, {high:g}")
    return low, high


def _amounts(inputs: Mapping[str, float]) -> tuple[list[str], list[float]]:
    """Names and amplitudes. Raises OptionError for none and for impossible ones."""
    if not isinstance(inputs, Mapping) or not inputs:
        raise OptionError("inputs have a name and an amplitude, such as {'carriage.tx': 0.5}")
    for name, amount in inputs.items():
        if isinstance(amount, bool) or not np.isfinite(float(amount)) or float(amount) == 0:
            raise OptionError(f"inputs: the amplitude of {name} is a finite number other than zero, not {amount}")
    return list(inputs), [float(amount) for amount in inputs.values()]


def _curve(oscillation: Oscillation, readings: Sequence[Reading], band: tuple[float, float], harmonics: int) -> Curve:
    """Motions from the lowest frequency to the highest."""
    low, high = (2 * np.pi * f for f in band)
    linear = _Linear.of(oscillation)
    n, omega = len(linear.omega), linear.omega
    size, width = linear.size(low, high), linear.width(low, high)
    balance = Balance.of(oscillation, Series.of(harmonics), True, size, width, high)
    X, direction = np.zeros((2 * harmonics + 1, n)), np.zeros((2 * harmonics + 1) * balance.slow + 1)
    response = linear.at(np.array([low]))[0]
    X[1], X[2], direction[-1] = response.real, -response.imag, 1.0
    known = omega[np.isfinite(omega)]

    def longest(orbit: Orbit) -> float:
        return max(STEPS[1], FAR * float(np.abs(known - orbit.omega).min()) / width)

    def motions() -> Iterator[Orbit]:
        last: Orbit | None = None
        for orbit in followed(balance, balance.near(balance.linear(X, low), direction)[0], STEPS[0], longest):
            if last is not None and last.turning * orbit.turning < 0:
                yield located(balance, last, orbit, lambda own: own.turning)
            if last is not None and orbit.omega > high:
                yield located(balance, last, orbit, lambda own: own.omega / high - 1)
                return
            yield orbit
            last = orbit
            if orbit.omega < 0.5 * low:
                return

    return read(balance, oscillation, readings, motions())


class _Linear(NamedTuple):
    """Small motions: natural frequencies (n,), rad/s, damping and loads of coordinates of unit stiffness."""

    omega: Array
    damping: Array
    load: Array

    @staticmethod
    def of(oscillation: Oscillation) -> _Linear:
        """About the state of equilibrium."""
        none, one = np.zeros((1, len(oscillation.frequencies))), np.ones(1)
        load = -oscillation.forces(none, none, none, one)[0]
        return _Linear(oscillation.frequencies, np.diagonal(oscillation.slopes(none, none, none, one, 1)[1][0]), load)

    def at(self, omega: Array) -> Complex:
        """Responses (k, n) at frequencies (k,), rad/s."""
        omega = omega[:, None]
        return self.load / (1 - (omega / self.omega) ** 2 + 1j * omega * self.damping)

    def _band(self, low: float, high: float) -> Complex:
        inside = (self.omega >= low) & (self.omega <= high) & (self.damping > 0)
        return self.at(np.append(np.geomspace(low, high, 400), self.omega[inside]))

    def size(self, low: float, high: float) -> float:
        """The largest response in a band."""
        return float(np.linalg.norm(self._band(low, high), axis=1).max())

    def largest(self, low: float, high: float) -> Array:
        """Coordinates (n,) of the largest response in a band, when the largest one of them turns back."""
        responses = self._band(low, high)
        own = responses[np.linalg.norm(responses, axis=1).argmax()]
        turn = own[np.abs(own).argmax()]
        return (own * (turn.conj() / abs(turn))).real

    def width(self, low: float, high: float) -> float:
        """The width of the sharpest resonance in a band, rad/s."""
        ratios = self.damping * self.omega / 2
        inside = (self.omega >= low) & (self.omega <= high) & (ratios > 0)
        width = float((WIDTHS * ratios * self.omega)[inside].min(initial=high - low))
        return max(width, (high - low) / 400)


def _folds(curve: Curve) -> list[tuple[float, Array]]:
    """Folds, by frequency and the largest values of outputs (p,)."""
    turning = np.array([orbit.turning for orbit in curve.orbits])
    return [(float(curve.frequency_hz[k]), curve.largest[k]) for k in np.flatnonzero(np.abs(turning) < FOLDED)]
