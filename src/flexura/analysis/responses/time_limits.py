"""Where a time response stops holding: limits that motion, stress and force reach over its steps, and what it lacks, by
the shock spectrum of its signals, of whatever modes are left out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.limits import (
    States,
    command_limits,
    force_limits,
    merged,
    motion_limits,
    stop_limits,
    stress_limits,
)
from flexura.analysis.responses.frequency_response import response_meshes
from flexura.analysis.responses.stepping import Driven, Hold, modal_motion
from flexura.arrays import Array
from flexura.errors import Diagnostic
from flexura.linalg import leading
from flexura.reduction import stored_flexibility
from flexura.results import Result
from flexura.structure import Channel, FullOrderModel, Ports
from flexura.systems import FAINT, UNDAMPED, WORTH, ModalSystem, SecondOrder, input_loads, rounded_up
from flexura.tables import Facts, Item, Table, in_hz, percent, quantity
from flexura.thresholds import ROUND_OFF, STATIC_ROUND_OFF

BLOCK = 10_000_000
"""Modal coordinates that are held at a time."""

DRIVEN = 100.0
"""Amplitude over static amplitude from which an undamped frequency, proven to 1e-4, is off by 1 % of a response."""

REACHED = 1e-9
"""Share of the largest force on a mode from which an input drives it."""

STATES = 256
"""States of a full-order model that are looked at together."""

LOWEST = 6
"""So many of the lowest modes are looked at for what meshes leave uncertain: high ones hardly move."""


class Excitation(NamedTuple):
    """What acts on a mechanism: signals u (m, N) at inputs in steps of dt, s, held or linear between samples, impulses
    (m,) at time zero from the static state under `start` (m,)."""

    u: Array
    dt: float
    impulses: Array
    start: Array
    hold: Hold = "foh"

    @property
    def time(self) -> Array:
        """Times (N,) of the samples, s."""
        return self.dt * np.arange(self.u.shape[1], dtype=float)


@dataclass(frozen=True)
class Run:
    """What a time response follows from: `modes`, viscously damped, and what drives them; `plain` are these modes
    without residual ones."""

    modes: ModalSystem
    driven: Driven
    plain: ModalSystem
    excitation: Excitation

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Limits that are exceeded at some time.

        The motion of everything is that of the modes, and what stiffer ones follow statically.
        """
        modes, system, excitation = self.modes, self.modes.system, self.excitation
        shapes = modes.shapes if isinstance(system.model, FullOrderModel) else system.model.recover(modes.shapes)
        static_gain = modes.B / (modes.omega**2 + system.full_flexibility.shift)[:, None]
        columns = np.hstack([shapes, _static_rest(system, shapes, static_gain)])
        reached = _reached(system, columns, self._blocks(), excitation)
        lowest = float(self.plain.frequency_hz[:LOWEST].max(initial=0.0))
        return (*reached, *driven_limits(self.plain, excitation), *response_meshes(system, self.plain, lowest))

    def _blocks(self) -> Iterator[tuple[Array, slice]]:
        """Modal coordinates (r, k) block by block, and the samples that they are of."""
        driven, count = self.driven, self.driven.u.shape[1]
        step = max(BLOCK // max(self.modes.order, 1), 2)
        for first in range(0, count - 1, step):
            samples = slice(first, min(first + step, count - 1) + 1)
            block = driven._replace(u=self.driven.u[:, samples])
            moved = modal_motion(self.modes, block, (0,) if samples.stop == count else (0, 1))
            yield moved[0], samples
            if samples.stop < count:
                driven = driven._replace(eta=moved[0, :, -1], rate=moved[1, :, -1])


def driven_limits(modes: ModalSystem, excitation: Excitation) -> tuple[Diagnostic, ...]:
    """Resonances that nothing damps, and that inputs drive to more than 100 times their static amplitude.

    The amplitude of an undamped mode is that of the integral of u e^(-i omega t); it is off by the error of omega times
    as much, and in truth something damps it.
    """
    u, dt, time, worst = excitation.u, excitation.dt, excitation.time, (DRIVEN, 0.0, 0)
    for r in np.flatnonzero((modes.total_ratios < UNDAMPED) & (modes.omega > 0)):
        w, reached = float(modes.omega[r]), np.abs(modes.B[r]) > REACHED * np.abs(modes.B[r]).max()
        turn = np.exp(-1j * w * time)
        for j in np.flatnonzero(reached & u.any(axis=1)):
            gain = float(w * dt * np.abs(np.cumsum(u[j] * turn)).max() / np.abs(u[j]).max())
            worst = max(worst, (gain, w / (2 * np.pi), int(j)))
    gain, hz, j = worst
    if not hz:
        return ()
    name = modes.inputs[j].name
    text = (
        f"{name} drives the resonance at {in_hz(hz)}, which nothing damps, to {gain:.3g} times its static amplitude: it"
        " grows as long as it is driven; give some damping"
    )
    return (Diagnostic("resonance", name, gain, DRIVEN, "1", text),)


def integrated_warnings(system: SecondOrder, q: Array, excitation: Excitation) -> tuple[Diagnostic, ...]:
    """Limits that coordinates q (n, N) of a system exceed at some time."""
    count = q.shape[1]
    if isinstance(system.model, FullOrderModel):
        samples = [slice(k, min(k + STATES, count)) for k in range(0, count, STATES)]
        reached = _reached(system, None, ((q[:, own], own) for own in samples), excitation)
    else:
        shapes = system.model.recover(np.eye(system.order))
        static_gain = stored_flexibility(system.K, system.M, system.full_flexibility.shift)(system.B)
        columns = np.hstack([shapes, _static_rest(system, shapes, static_gain)])
        reached = _reached(system, columns, iter([(q, slice(0, count))]), excitation)
    return (*reached, *response_meshes(system))


def _static_rest(system: SecondOrder, shapes: Array, gain: Array) -> Array:
    """Static displacement (n, m) per input that shapes (n, r), of static gain (r, m), lack."""
    full = system.full_order
    if not system.inputs:
        return np.zeros((full.order, 0))
    return system.full_flexibility(input_loads(system)) - shapes @ gain


def _reached(
    system: SecondOrder, columns: Array | None, blocks: Iterator[tuple[Array, slice]], excitation: Excitation
) -> tuple[Diagnostic, ...]:
    """Limits exceeded by coordinates of blocks of samples: of `columns` (n, r + m), and the inputs, or of all DOFs."""
    full, u, time = system.full_order, excitation.u, excitation.time
    ports, names = Ports(full.design), [c.name for c in system.inputs]
    offset = np.zeros((full.order, 1 if columns is None else 0))
    if full.plan.is_loaded and not full.plan.is_posed:
        # what is described as loaded moves about its displaced state
        offset = system.full_flexibility(full.dead_load[:, None])

    def when(sample: int) -> str:
        return f" at {quantity(time[sample], 's', 4)}"

    warnings = list(command_limits(system.input_ports, u, when))
    for q, samples in blocks:

        def when_in_block(k: int, first: int = samples.start) -> str:
            return when(first + k)

        if columns is None:
            states = States(full, q + offset, None, when_in_block)
        else:
            amplitudes = np.vstack([q, u[:, samples], np.ones((offset.shape[1], q.shape[1]))])
            states = States(full, np.hstack([columns, offset]), amplitudes, when_in_block)
        warnings += force_limits(states, ports, dict(zip(names, u[:, samples], strict=True)))
        warnings += [*motion_limits(states), *stop_limits(states), *stress_limits(states)]
    return merged(warnings)


FREQUENCIES = 48
"""Frequencies of a shock spectrum, from the first mode left out on."""

SPAN = 30.0
"""The highest of these over the lowest; beyond, the spectrum is bounded."""

LINES = 4
"""Strongest frequencies of a signal that are looked at beside these."""

VALUES = 20_000_000
"""Values of a shock spectrum that are worked out at most; longer signals get fewer frequencies."""

OVERDAMPED = 0.7
"""Damping ratio from which decay is not counted on."""

MOST_OUTPUTS = 4
"""Outputs that a sentence names."""

UNCOUPLED = 1e-7
"""Size of three moments of a channel beside what they could be, up to which symmetry keeps input from output."""

KEPT_ERROR = 2e-4
"""Relative error of what kept modes of a low-order model carry."""


@dataclass(frozen=True, repr=False)
class LeftOut(Result):
    """Bound (p,) on what outputs lack at any time, from modes above `above_hz`, beside their size `scale` (p,)."""

    bound: Array
    scale: Array
    outputs: tuple[Channel, ...]
    above_hz: float

    @property
    def shares(self) -> Array:
        """The bound over the size of each output (p,)."""
        return np.asarray(self.bound / self.scale)

    @property
    def share(self) -> float:
        """The largest of them."""
        return float(self.shares.max(initial=0.0))

    @property
    def text(self) -> str:
        """One sentence."""
        head = f"modes above {in_hz(self.above_hz)} are left out but for their static part"
        listed = [
            f"{rounded_up(share, 2)} of {channel.name}"
            if np.isfinite(share)
            else f"{channel.name} by an unknown amount"
            for channel, share in zip(self.outputs, self.shares, strict=True)
            if share > WORTH
        ]
        if not listed:
            return f"{head}, which changes outputs by at most {rounded_up(self.share, 2)} of their largest values"
        more = ", ..." if len(listed) > MOST_OUTPUTS else ""
        return f"{head}, which may change, of its largest value, {', '.join(listed[:MOST_OUTPUTS])}{more}"

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """One, when an output may be off by more than 1 %."""
        if self.share <= WORTH:
            return ()
        name = self.outputs[int(leading(self.shares))].name
        text = f"{self.text}: take a shorter step or keep more modes, or apply the signal less abruptly"
        return (Diagnostic("tolerance", name, self.share, WORTH, "1", text),)

    def presentation(self) -> Iterator[Item]:
        yield Facts({"at most": self.text})
        shares = [percent(float(share)) for share in self.shares]
        yield Table({"output": [c.name for c in self.outputs], "left out, at most": shares}, "outputs")

    def _data(self) -> dict[str, Any]:
        outputs = {str(c): pair for c, *pair in zip(self.outputs, self.bound, self.shares, strict=True)}
        return {"above_hz": self.above_hz, "bound_and_share": outputs, "text": self.text}


def left_out(run: Run, dynamic: Array, peak: Array) -> LeftOut | None:
    """What outputs lack of modes beyond those of a viscously damped system (theory eq. T30); None where none is.

    `dynamic` (p,) is the largest of what residual modes in their place add beyond static parts, `peak` (p,) the largest
    output.
    """
    modes, (u, dt, impulses, start, hold) = run.plain, run.excitation
    if not np.isfinite(modes.next_omega) or not modes.outputs:
        return None
    signals, turn = _patterns(np.column_stack([u, start, impulses]))
    u, start, impulses = signals[:, :-2], signals[:, -2], signals[:, -1]
    rows, loads, coupled = _sizes(modes, turn)
    spectra = [_spectrum(modes, signal, dt, hold, first) for signal, first in zip(u, start, strict=True)]
    bound = dynamic.copy()
    for i, k in enumerate(modes.derivative):
        for j in np.flatnonzero(coupled[i]):
            worst = spectra[j]
            bound[i] += min(_times(worst[k, s], _summed(rows[:, i], loads[:, j], 2 - k + s)) for s in (0, 1))
            bound[i] += _times(abs(impulses[j]), _summed(rows[:, i], loads[:, j], 1 - k))
    lowest = float(modes.omega[modes.omega > 0].min(initial=modes.next_omega))
    drive = np.abs(u).max(axis=1, initial=0.0) + np.abs(start) + np.abs(impulses) * lowest
    scale = np.maximum(peak, FAINT * (np.sqrt(np.outer(rows[3], loads[3])) @ drive) * lowest**modes.derivative)
    return LeftOut(bound, np.where(scale > 0, scale, np.inf), modes.outputs, modes.next_omega / (2 * np.pi))


def _patterns(signals: Array) -> tuple[Array, Array]:
    """Table (g, N) that those of signals (m, N) are multiples of, and the factors (m, g): inputs that are driven alike
    act as one, in which symmetric ones cancel."""
    patterns: list[Array] = []
    turn = np.zeros((len(signals), len(signals)))
    for k, signal in enumerate(signals):
        if not signal.any():
            continue
        for g, pattern in enumerate(patterns):
            ratio = float(signal @ pattern) / float(pattern @ pattern)
            if np.abs(signal - ratio * pattern).max() <= ROUND_OFF * np.abs(signal).max():
                turn[k, g] = ratio
                break
        else:
            turn[k, len(patterns)] = 1.0
            patterns.append(signal)
    return np.array(patterns).reshape(len(patterns), signals.shape[1]), turn[:, : len(patterns)]


def _times(one: float, other: float) -> float:
    """A product that is zero where one factor is, whatever the other."""
    return float(one * other) if one and other else 0.0


def _summed(row: Array, load: Array, power: int) -> float:
    """Bound on the sum of |c b| / omega^power over modes left out, by the inequality of Cauchy and Schwarz."""
    if power < 0:
        return np.inf
    splits = [(power // 2, power - power // 2), (power - power // 2, power // 2)]
    return min(_times(float(np.sqrt(row[i])), float(np.sqrt(load[j]))) for i, j in splits)


def _sizes(modes: ModalSystem, turn: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Sums over modes left out of squares of what outputs (4, p) and inputs (4, m) have in them, over omega^0, omega^2
    and omega^4, and over omega^2 with the kept modes; and which outputs inputs reach (p, m). Of the full order, the
    inputs in combinations `turn` (., m)."""
    system, full = modes.system, modes.system.full_order
    rows = np.array([o.row for o in system.output_ports]).reshape(-1, full.order)
    flexible = system.full_flexibility
    shift = flexible.shift
    known = 0.0 if isinstance(system.model, FullOrderModel) else KEPT_ERROR
    sums, solved = [], []
    for W, kept in ((rows.T, modes.C.T), (input_loads(system) @ turn, modes.B @ turn)):
        X, agile = flexible(W), np.full(W.shape, np.inf)
        if (full.M.diagonal() > 0).all():
            agile = stored_flexibility(full.M, full.M, 0.0)(W)
        with np.errstate(invalid="ignore"):
            free = np.where(W.any(axis=0), np.einsum("ij,ij->j", np.where(W, W, 0.0), np.where(W, agile, 0.0)), 0.0)
        whole = np.stack([free, np.einsum("ij,ij->j", W, X), np.einsum("ij,ij->j", X, full.M @ X)])
        part = np.stack([(kept**2 / (modes.omega**2 + shift)[:, None] ** k).sum(axis=0) for k in range(3)])
        sums.append(np.vstack([np.maximum(whole - part, 0.0) + STATIC_ROUND_OFF * whole + known * part, whole]))
        solved.append((W, X, agile))
    (W, X, agile), (loads, Y, _) = solved
    moments = (agile.T @ loads if np.isfinite(agile).all() else None, X.T @ loads, X.T @ (full.M @ Y))
    coupled = np.zeros((len(rows), loads.shape[1]), dtype=bool)
    for k, moment in enumerate(moments):
        if moment is not None:
            coupled |= np.abs(moment) > UNCOUPLED * np.sqrt(np.outer(sums[0][3 + k], sums[1][3 + k]))
    return sums[0][[0, 1, 2, 4]], sums[1][[0, 1, 2, 4]], coupled


def _spectrum(modes: ModalSystem, u: Array, dt: float, hold: Hold, start: float) -> Array:
    """Shock spectrum (3, 2) of a signal u (N,): the largest omega^(2 - k + s) |d^k (eta - u / omega^2)/dt^k| of an
    oscillator eta'' + d eta' + omega^2 eta = u at rest under `start`, over time and omega from the first mode left out
    on; rows are k, columns s. Beyond the highest of them a bound on all that follow (theory eq. T30)."""
    if not u.any() and not start:
        return np.zeros((3, 2))
    count = int(np.clip(VALUES // len(u), 8, FREQUENCIES))
    w = np.geomspace(modes.next_omega, SPAN * modes.next_omega, count)
    w = np.unique(np.concatenate([w, _lines(u, dt, w)]))
    damping = _least_damping(modes, w)
    alone = replace(modes, loss=None, B=np.ones((1, 1)))
    slope, bend = references(u, dt)
    worst = np.zeros((3, 2))
    for k in range(len(w)):
        one = replace(alone, omega=w[k : k + 1], damping=damping[k : k + 1, None])
        driven = Driven(u[None], dt, hold, np.array([start / w[k] ** 2]), np.zeros(1))
        eta, rate = modal_motion(one, driven, (0, 1))
        second = u - damping[k] * rate[0] - w[k] ** 2 * eta[0]
        for d, (y, y0) in enumerate(((eta[0], u), (rate[0], slope), (second, bend))):
            size = float(np.abs(y - y0 / w[k] ** 2).max())
            worst[d] = np.maximum(worst[d], size * w[k] ** np.array([2 - d, 3 - d]))
    tail = _tail(u, dt, hold, start, w=float(w[-1]), least=float(damping[0]), damping=float(damping[-1]))
    return np.maximum(worst, tail)


def references(u: Array, dt: float) -> tuple[Array, Array]:
    """First and second derivative of a signal (N,) as what stiff modes follow, by differences around each sample."""
    bend = np.zeros_like(u)
    bend[1:-1] = (u[2:] - 2 * u[1:-1] + u[:-2]) / dt**2
    return np.gradient(u, dt), bend


def _lines(u: Array, dt: float, w: Array) -> Array:
    """Strongest frequencies of a signal in a range w, rad/s, and those that straight lines between samples make."""
    size = np.abs(np.fft.rfft(u - u.mean()))
    omega = 2 * np.pi * np.fft.rfftfreq(len(u), dt)
    beyond = np.flatnonzero(omega >= w[0])
    strongest = omega[int(leading(size))]
    lines = np.concatenate(
        [omega[beyond[np.argsort(-size[beyond])[:LINES]]], 2 * np.pi / dt + np.array([-strongest, strongest])]
    )
    return np.asarray(lines[(lines > w[0]) & (lines < w[-1])], dtype=float)


def _least_damping(modes: ModalSystem, w: Array) -> Array:
    """The least damping, 1/s, that the law gives modes of frequencies w (k,), rad/s, that are left out."""
    law = modes.system.law
    ratios = [
        *(ratio for up_to, ratio in law.bands if 2 * np.pi * up_to >= modes.next_omega),
        *law.ratios[modes.order :],
    ]
    zeta = min([law.ratio, *ratios])
    return np.asarray(2 * zeta * w + law.alpha + law.beta * w**2 + (modes.system.uniform_loss or 0.0) * w)


def _tail(u: Array, dt: float, hold: Hold, start: float, *, w: float, least: float, damping: float) -> Array:
    """Bound (3, 2) of the shock spectrum from a frequency w, rad/s, on: a sum over kinks or steps that decay."""
    from scipy.signal import lfilter  # slow to import

    zeta = damping / (2 * w)
    gain, rate = (1 / np.sqrt(1 - zeta**2), least / 2) if zeta < OVERDAMPED else (1 + 2 * zeta, 0.0)
    slopes = np.diff(u) / dt
    steep = float(np.abs(slopes).max(initial=0.0))
    jump = abs(float(u[0]) - start)
    kinks = np.abs(np.diff(slopes, prepend=0.0)) if hold == "foh" else np.abs(np.diff(u, prepend=u[0]))
    total = float(lfilter([1.0], [1.0, -np.exp(-rate * dt)], kinks).max(initial=0.0)) * gain
    bend = 4 * float(np.abs(u).max()) / dt**2
    if hold == "zoh":
        level = gain * jump + total
        first = np.array([level, level + steep / w, level + bend / w**2])
        return np.stack([first, np.full(3, np.inf)], axis=1)
    level = gain * jump + total / w
    first = np.array([level + 2 * zeta * steep / w, level + 2 * steep / w, level + bend / w**2])
    smooth = np.array([total + 2 * zeta * steep, total + 2 * steep, total + bend / w])
    return np.stack([first, np.full(3, np.inf) if jump > ROUND_OFF * np.abs(u).max(initial=0.0) else smooth], axis=1)
