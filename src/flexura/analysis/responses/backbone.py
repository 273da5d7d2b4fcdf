"""Backbone curves: how the frequency of a mode changes with its amplitude, without damping and excitation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.analysis.responses.oscillations import (
    FOLDED,
    HARMONICS,
    Curve,
    Reading,
    Studied,
    bent,
    branches,
    built_system,
    checked_harmonics,
    followed,
    harmonic_errors,
    harmonic_remarks,
    lost,
    node_numbers,
    read,
    studied,
    undamped,
)
from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import plan_of
from flexura.linalg import Balance, Orbit, Series, located
from flexura.mechanism import Mechanism
from flexura.motion import Equations, Equilibrium, Oscillation
from flexura.results import Tabular
from flexura.structure import Channel, FullOrderModel, Plan
from flexura.systems import Order
from flexura.tables import Facts, Item, Table, counted, in_hz, quantity

SHIFTED = 0.01
"""Relative change of the frequency whose amplitude is told."""

FIRST = 0.03
"""Amplitude of the first motion over the largest one."""

STEPS = 0.1, 0.25
"""First and longest arc lengths over the largest amplitude."""

JOINED = 0.1
"""Share of another mode in the kinetic energy from which motions are no longer those of one mode."""

NEAR = 1e-4
"""How near to the largest amplitude a curve ends, relative."""

ROUGH = 0.2
"""Error of the low order over the change of the frequency from which it is reported."""

NEGLIGIBLE = 1e-5
"""Error of the frequency that never is."""

FLAT = 1e-6
"""Relative change of the frequency that counts as none."""


@dataclass(frozen=True, repr=False)
class Backbone(Tabular):
    """Free motions of one mode, `frequency_hz` (c,), over the `amplitude` (c,) of an output, the largest reading in a
    period, m or rad, and the `energy` (c,), J.

    `harmonics` (c, H + 1) are complex amplitudes of the output, constant part first, and `other_modes` (c,) is the
    share of all others in the kinetic energy, at rest. Motions are `stable` (c,) or not. `linear_hz` is the frequency
    of small motions, `shifted_at` the amplitude at which it has changed by 1 %, None where it does not.
    `harmonic_error` is what more harmonics would change, `order_error` how far the low order may be off in frequency.
    """

    _shown = ("name", "mode", "output", "linear_hz", "shifted_at")
    _told = (
        *("name", "mode", "output", "linear_hz", "shifted_at", "kind", "frequency_hz", "amplitude", "energy"),
        *("harmonics", "other_modes", "stable", "harmonic_error", "order_error"),
    )

    name: str
    mode: int
    output: Channel
    linear_hz: float
    frequency_hz: Array
    amplitude: Array
    energy: Array
    harmonics: Complex
    other_modes: Array
    stable: NDArray[np.bool_]
    harmonic_error: float
    order_error: float
    warnings: tuple[Diagnostic, ...]
    notes: tuple[str, ...]

    @property
    def shift(self) -> Array:
        """Change of the frequency (c,) over that of small motions."""
        return self.frequency_hz / self.linear_hz - 1

    @property
    def shifted_at(self) -> float | None:
        """The amplitude at which the frequency has changed by 1 %."""
        beyond = np.abs(self.shift) >= SHIFTED
        if not beyond.any():
            return None
        k = int(beyond.argmax())
        shift, square = np.append(0.0, np.abs(self.shift)), np.append(0.0, self.amplitude**2)
        share = (SHIFTED - shift[k]) / (shift[k + 1] - shift[k])
        return float(np.sqrt(square[k] + share * (square[k + 1] - square[k])))

    @property
    def kind(self) -> str:
        """Hardening where the frequency grows with the amplitude, softening where it falls, or both, by more than it
        may be off."""
        change = np.diff(np.append(0.0, self.shift))
        least = max(FLAT, self.order_error)
        grows, falls = change[change > 0].sum() > least, -change[change < 0].sum() > least
        words = [word for word, known in (("hardening", grows), ("softening", falls)) if known]
        return " and ".join(words) or "no change beyond what it may be off"

    def _title(self) -> str:
        return f"mode {self.mode}, {counted(len(self.amplitude), 'motion')}"

    def presentation(self) -> Iterator[Item]:
        """The frequency of small motions, what becomes of it, and motions along the curve."""
        unit, at = self.output.unit, self.shifted_at
        yield Facts(
            {
                "frequency of small motions": in_hz(self.linear_hz, 5),
                "with the amplitude": self.kind,
                "changed by 1 % at": "no amplitude up to here" if at is None else quantity(at, unit, 4),
            }
        )
        yield Table(self._columns(), "motions", is_spread=True)

    def _columns(self) -> dict[str, Any]:
        return {
            f"{self.output.name} [{self.output.unit}]": self.amplitude,
            "frequency [Hz]": self.frequency_hz,
            "change [%]": 100 * self.shift,
            "energy [J]": self.energy,
            "other modes [%]": 100 * self.other_modes,
            "stable": self.stable,
        }


@verb
def backbone(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    amplitude: Mapping[str, float],
    mode: int = 1,
    harmonics: int = HARMONICS,
    order: Order = "low",
) -> Backbone:
    """The backbone curve of a mode: its frequency over the amplitude, with large displacements and no damping.

    `amplitude` has the output whose amplitude is told, as in `system`, with the largest, m or rad. Motions are
    free ones about the static state under the loads described, those that come to rest twice a period (nonlinear normal
    modes; Rosenberg 1962; Kerschen, Peeters, Golinval, Vakakis 2009), by harmonic balance and arc length (theory eqs.
    G42-G48; Krack and Gross 2019). Elements are all those of the mechanism at `order="full"`, or corotational
    superelements.

    Raises ModelError, OptionError for impossible amplitudes, modes and outputs, and SolverError where no motion is
    found.
    """
    name, target = _target(amplitude)
    harmonics = checked_harmonics(harmonics)
    plan = plan_of(model, parameters) if isinstance(model, Mechanism) else model
    built = built_system(plan, parameters, order, inputs=[], outputs=[name])
    (port,), ended = built.output_ports, list[Diagnostic]()
    if port.derivative:
        raise OptionError(f"{name} reads a {port.channel.quantity}: an amplitude is that of a displacement or rotation")

    def follow(equations: Equations, state: Equilibrium) -> Curve:
        still = undamped(equations)
        reading = Reading.of(still.model, port)
        ended.clear()
        return _curve(Oscillation(still, state), reading, port.channel, mode, target, harmonics, ended)

    def like(equations: Equations, state: Equilibrium) -> Equilibrium:
        still = Oscillation(equations, state)
        q = np.zeros(len(still.frequencies))
        q[mode - 1] = target / _motion_of(still, Reading.of(equations.model, port), port.channel, mode)
        return bent(still, q)

    found = studied(built, order, node_numbers(built), max(int(mode), 1), follow, like)
    curve, own = found.curve, found.curve.oscillation
    errors = harmonic_errors(curve)
    note, warned = harmonic_remarks(errors, harmonics)
    branch_notes, branching = branches(curve, port.channel.name, port.channel.unit)
    shares = np.array([_kinetic_shares(curve, orbit) for orbit in curve.orbits])
    other = np.delete(shares, mode - 1, axis=1)
    warnings = (
        *_joined(curve, shares, mode),
        *_unstable(curve, port.channel),
        *branching,
        *ended,
        *warned,
        *_too_rough(found),
        *found.warnings,
    )
    return Backbone(
        built.name,
        mode,
        port.channel,
        float(own.frequencies[mode - 1]) / (2 * np.pi),
        curve.frequency_hz,
        curve.largest[:, 0],
        np.array([own.potential(q[0]) for q in curve.displacements]),
        curve.amplitudes[:, :, 0],
        other.sum(axis=1),
        curve.stable,
        max(errors),
        found.error,
        warnings,
        (*found.notes, note, *_turns(curve, port.channel), *branch_notes),
    )


def _target(amplitude: Mapping[str, float]) -> tuple[str, float]:
    """The output and its largest amplitude. Raises OptionError for none or several, and for impossible amplitudes."""
    if not isinstance(amplitude, Mapping) or len(amplitude) != 1:
        raise OptionError("amplitude has one output with its largest value, such as {'carriage.tx': 2e-3}")
    ((name, target),) = amplitude.items()
    if isinstance(target, bool) or not np.isfinite(float(target)) or not float(target) > 0:
        raise OptionError(f"the amplitude of {name} is a positive number, not {target}")
    return name, float(target)


def _reach(oscillation: Oscillation, reading: Reading) -> Callable[[Array], Array]:
    """What reads (s,) beside the state at rest in coordinates (s, n)."""
    model, n = oscillation.equations.model, len(oscillation.frequencies)
    still = float(reading.at(model, oscillation.frames(np.zeros((1, n))), 1)[0])
    return lambda q: reading.at(model, oscillation.frames(q), len(q)) - still


def _motion_of(oscillation: Oscillation, reading: Reading, channel: Channel, mode: int) -> float:
    """What a small motion of a mode reads over its coordinate. Raises OptionError for modes that there are not, and for
    those that do not move it."""
    n, finite = len(oscillation.frequencies), int(np.isfinite(oscillation.frequencies).sum())
    if isinstance(mode, bool) or not 1 <= mode <= finite:
        raise OptionError(f"mode is the number of a mode, 1 to {finite}, not {mode}")
    reach, unit = _reach(oscillation, reading), np.zeros((1, n))
    unit[0, mode - 1] = oscillation.equations.size / np.abs(oscillation.shapes[:, mode - 1]).max() * 1e-7
    motion = float(reach(unit)[0]) / unit[0, mode - 1]
    if abs(motion) < 1e-6 * np.abs(reach(np.eye(n) * unit.max())).max() / unit.max():
        raise OptionError(f"mode {mode} does not move {channel.name}: read what it moves")
    return motion


def _curve(
    oscillation: Oscillation,
    reading: Reading,
    channel: Channel,
    mode: int,
    target: float,
    harmonics: int,
    ended: list[Diagnostic],
) -> Curve:
    """Motions of a mode up to an amplitude."""
    n = len(oscillation.frequencies)
    motion = _motion_of(oscillation, reading, channel, mode)
    reach = _reach(oscillation, reading)
    series, omega = Series.of(harmonics, even=True), float(oscillation.frequencies[mode - 1])
    balance = Balance.of(oscillation, series, False, abs(target / motion), omega, omega)
    X, direction = np.zeros((harmonics + 1, n)), np.zeros((harmonics + 1) * balance.slow + 1)
    X[1, mode - 1] = FIRST * target / motion
    direction[balance.slow + mode - 1] = np.sign(motion)

    def beyond(orbit: Orbit) -> float:
        q = balance.instants(orbit.motion)[0]
        return float(np.abs(reach(q[[0, len(q) // 2]])).max()) / target - 1

    def motions() -> Iterator[Orbit]:
        last: Orbit | None = None
        first, _ = balance.near(balance.linear(X, omega), direction)
        for orbit in followed(balance, first, STEPS[0], lambda _: STEPS[1]):
            if last is not None and last.turning * orbit.turning < 0:
                yield located(balance, last, orbit, lambda own: own.turning)
            if last is not None and beyond(orbit) > 0:
                yield located(balance, last, orbit, beyond)
                return
            yield orbit
            last = orbit
            if beyond(orbit) < FIRST / 2 - 1 or not 0.1 < orbit.omega / omega < 10:  # back at rest, or elsewhere
                return

    curve = read(balance, oscillation, [reading], motions())
    value = float(curve.largest[-1, 0])
    if value < target * (1 - NEAR):
        aim = quantity(target, channel.unit, 4)
        ended.append(lost(channel.name, channel.unit, value, float(curve.frequency_hz[-1]), aim))
    return curve


def _kinetic_shares(curve: Curve, orbit: Orbit) -> Array:
    """Shares (n,) of the modes at rest in the mean kinetic energy."""
    v = curve.balance.instants(orbit.motion)[1]
    with np.errstate(divide="ignore"):
        energy = (v**2).sum(axis=0) / curve.oscillation.frequencies**2
    return energy / energy.sum()


def _joined(curve: Curve, shares: Array, mode: int) -> tuple[Diagnostic, ...]:
    """A warning where another mode joins the motion, as at internal resonances."""
    other = shares.copy()
    other[:, mode - 1] = 0.0
    k = int((other.max(axis=1) > JOINED).argmax())
    j = int(other[k].argmax())
    if other[k, j] <= JOINED:
        return ()
    frequency = curve.oscillation.frequencies[j] / (2 * np.pi)
    moving = np.abs(np.fft.rfft(curve.displacements[k][:, j]))
    moving *= np.arange(len(moving))
    text = (
        f"from {in_hz(curve.frequency_hz[k], 5)} on mode {j + 1}, {in_hz(float(frequency), 5)} at rest, takes part in"
        f" harmonic {int(moving.argmax())}, with {100 * other[k, j]:.2g} % of the kinetic energy (internal"
        f" resonance): the curve leaves mode {mode}"
    )
    return (Diagnostic("resonance", "", float(other[k, j]), JOINED, "1", text),)


def _turns(curve: Curve, channel: Channel) -> tuple[str, ...]:
    """Notes where the frequency turns back."""
    at = [k for k, orbit in enumerate(curve.orbits) if abs(orbit.turning) < FOLDED]
    values = [(in_hz(curve.frequency_hz[k], 5), quantity(float(curve.largest[k, 0]), channel.unit, 4)) for k in at]
    return tuple(f"the frequency turns back at {hz}, {channel.name} {value}" for hz, value in values)


def _too_rough(found: Studied) -> tuple[Diagnostic, ...]:
    """A warning where the low order may be off by much of what the frequency changes."""
    omega = np.array([orbit.omega for orbit in found.curve.orbits])
    change = float(np.ptp(omega) / omega[0])
    if found.error <= max(ROUGH * change, NEGLIGIBLE):
        return ()
    off = f"the low order may be off by {found.error:.2g} in frequency, which changes by {change:.2g}"
    text = f"{off}: take the full order"
    return (Diagnostic("reduction", "", found.error, ROUGH * change, "1", text),)


def _unstable(curve: Curve, channel: Channel) -> tuple[Diagnostic, ...]:
    """A warning where motions are unstable."""
    if curve.stable.all():
        return ()
    k = int((~curve.stable).argmax())
    value = float(curve.largest[k, 0])
    text = f"motions are unstable from {channel.name} {quantity(value, channel.unit, 4)} on, here or there"
    return (Diagnostic("equilibrium", channel.name, value, np.nan, channel.unit, text),)
