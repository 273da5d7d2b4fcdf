"""Input shaping: commands as a few impulses that leave chosen modes at rest (Singer and Seering 1990)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.mechanism import Damping, Mechanism
from flexura.results import Tabular
from flexura.structure import FullOrderModel, Plan
from flexura.systems import system
from flexura.tables import Facts, Item, Table, in_hz, number, percent, quantity

ShaperKind = Literal["ZV", "ZVD", "EI"]

ERRORS = np.linspace(-0.2, 0.2, 17)
"""Errors of a frequency, relative, at which the vibration that is left is told."""

ON_SAMPLE = 1e-9
"""Part of a step by which an impulse may miss a sample."""

LONGEST, MOST_TAPS = 65_535, 512
"""Steps and taps of the longest shaper."""


@dataclass(frozen=True, repr=False)
class Shaper(Tabular):
    """Impulses of size `amplitude` (k,), which add up to one, at `time_s` (k,), that leave modes of `frequency_hz` (r,)
    and `damping_ratio` (r,) at rest; a command that is convolved with them arrives `duration` later.

    In samples of `dt`, s, they are `weights` (t,) of the commands `steps` (t,) before: each impulse is split between
    its two neighbours so that it does to its mode exactly what it did.
    """

    _shown = ("name", "kind", "frequency_hz")

    name: str
    kind: ShaperKind
    modes: tuple[int, ...]
    frequency_hz: Array
    damping_ratio: Array
    time_s: Array
    amplitude: Array
    dt: float
    steps: Index
    weights: Array
    notes: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Time of the last impulse, s."""
        return float(self.time_s[-1])

    def residual(self, frequency_hz: ArrayLike, damping_ratio: ArrayLike = 0.0, sampled: bool = True) -> Array:
        """Vibration (...) that is left of a mode, over that after one impulse (Singer and Seering 1990, eq. 8), by the
        weights in samples or by the impulses themselves."""
        hz, ratio = np.broadcast_arrays(np.asarray(frequency_hz, dtype=float), np.asarray(damping_ratio, dtype=float))
        t, A = (self.steps * self.dt, self.weights) if sampled else (self.time_s, self.amplitude)
        left = 2 * np.pi * hz[..., None] * (ratio[..., None] + 1j * np.sqrt(1 - ratio[..., None] ** 2))
        return np.asarray(np.abs((A * np.exp(left * (t - t[-1]))).sum(axis=-1)))

    def presentation(self) -> Iterator[Item]:
        yield Facts(
            {
                "shaper": self.kind,
                "modes": ", ".join(
                    f"{k}: {in_hz(f)}, ratio {number(z, 3)}"
                    for k, f, z in zip(self.modes, self.frequency_hz.tolist(), self.damping_ratio.tolist(), strict=True)
                ),
                "lasts": quantity(self.duration, "s", 4),
                "in samples": f"{len(self.steps)} weights over {self.steps[-1] + 1} steps of {quantity(self.dt, 's')}",
            }
        )
        shown = {"impulse at": [quantity(t, "s", 5) for t in self.time_s.tolist()], "size": self.amplitude.tolist()}
        yield Table(shown, "impulses", title="impulses")
        columns = self._columns()
        told = {"frequency is off by": [percent(e) for e in ERRORS.tolist()]}
        told |= {name: [percent(x) for x in own] for name, own in list(columns.items())[1:]}
        yield Table(told, "residuals", title="vibration that is left")

    def _data(self) -> dict[str, Any]:
        names = ("name", "kind", "modes", "frequency_hz", "damping_ratio", "time_s", "amplitude", "steps", "weights")
        left = [own for name, own in self._columns().items() if name.startswith("left")]
        more = {"dt_s": self.dt, "duration_s": self.duration, "errors_of_frequency": ERRORS, "left": left}
        return {**{name: getattr(self, name) for name in names}, **more}

    def _columns(self) -> dict[str, Any]:
        """Vibration that is left of each mode by the error of its frequency."""
        columns: dict[str, Any] = {"error of frequency": ERRORS}
        for k, f, z in zip(self.modes, self.frequency_hz, self.damping_ratio, strict=True):
            columns[f"left of mode {k}"] = self.residual(f * (1 + ERRORS), z)
        return columns


@verb
def shaper(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    dt: float,
    kind: ShaperKind = "ZV",
    modes: Sequence[int] = (1,),
    vibration: float = 0.05,
    damping: Damping | float | Mapping[str, Any] | None = None,
) -> Shaper:
    """An input shaper for some `modes`, counted from one, in samples of `dt`, s (theory eqs. X14-X16).

    Of `kind` ZV, which leaves no vibration; ZVD, whose slope over frequency is zero, too (Singer and Seering 1990); or
    EI, which leaves the share `vibration` at the frequency itself and none on both sides, and so bears larger errors
    (Singhose, Seering and Singer 1994). Damped EI shapers have the times of these and amplitudes that leave exactly
    that share. For several modes their shapers follow each other.

    Raises ModelError; OptionError for modes that are not there, float or are no slower than half the rate of samples,
    and for shares and steps that are impossible.
    """
    if not (np.isfinite(dt) and dt > 0):
        raise OptionError(f"a step is a positive time in s, not {dt}")
    if kind not in get_args(ShaperKind):
        raise OptionError(f"kind is {', '.join(get_args(ShaperKind))}, not {kind!r}")
    if not 0 < vibration < 1:
        raise OptionError(f"vibration is a share between 0 and 1, not {vibration}")
    numbers = tuple(dict.fromkeys(int(k) for k in modes))
    if not numbers or min(numbers) < 1:
        raise OptionError("modes are numbers from 1 on, at least one")
    built = system(model, parameters, order="full", damping=damping)
    if max(numbers) > built.order:
        raise OptionError(f"there is no mode {max(numbers)}: the model has {built.order}")
    found = built.modal(n=max(numbers))
    at = [k - 1 for k in numbers]
    return _shaper(found.name, kind, numbers, found.frequency_hz[at], found.total_ratios[at], dt, vibration)


def _shaper(
    name: str, kind: ShaperKind, modes: tuple[int, ...], hz: Array, ratios: Array, dt: float, vibration: float
) -> Shaper:
    """The shapers of modes one after another."""
    time, amplitude = np.zeros(1), np.ones(1)
    weights = np.ones(1)
    for k, f, ratio in zip(modes, hz.tolist(), ratios.tolist(), strict=True):
        if not f > 0:
            raise OptionError(f"mode {k} floats: there is no vibration of it to leave out")
        if not ratio < 1:
            raise OptionError(f"mode {k}, {in_hz(f)}, is damped beyond vibration (ratio {ratio:.3g})")
        if f >= 0.5 / dt:
            raise OptionError(f"mode {k}, {in_hz(f)}, is no slower than half the rate of samples, {in_hz(0.5 / dt)}")
        half, own = _impulses(kind, ratio, vibration)
        half = half / (2 * f * np.sqrt(1 - ratio**2))
        time, amplitude = _following(time, amplitude, half, own)
        if half[-1] / dt + len(weights) > LONGEST:
            raise OptionError(f"a shaper of more than {LONGEST} steps: take longer ones (dt), or faster modes")
        for _ in range(1 + (kind == "ZVD")):
            part = (half[:2], _impulses("ZV", ratio, vibration)[1]) if kind == "ZVD" else (half, own)
            weights = np.convolve(weights, _sampled(*part, f, ratio, dt))
    steps = np.flatnonzero(weights)
    if len(steps) > MOST_TAPS:
        raise OptionError(f"a shaper of {len(steps)} weights, at most {MOST_TAPS}: shape fewer modes")
    found = weights[steps] / weights.sum()
    return Shaper(name, kind, modes, hz, ratios, time, amplitude, dt, steps, found, _notes(kind, vibration))


def _notes(kind: ShaperKind, vibration: float) -> tuple[str, ...]:
    left = percent(vibration) if kind == "EI" else "no"
    return (f"{left} vibration is left at the frequencies of these modes by commands; what else shakes them does so",)


def _impulses(kind: ShaperKind, ratio: float, vibration: float) -> tuple[Array, Array]:
    """Times in half periods of the damped motion, and amplitudes."""
    K = float(np.exp(-ratio * np.pi / np.sqrt(1 - ratio**2)))
    if kind == "ZV":
        return np.arange(2.0), np.array([1, K]) / (1 + K)
    if kind == "ZVD":
        return np.arange(3.0), np.array([1, 2 * K, K * K]) / (1 + K) ** 2
    mean, apart = (1 + K) ** 2 / 4, (1 - K) ** 2 / 4
    v = vibration * mean / (K * K - vibration * apart) if vibration * apart < K * K else 1.0
    if not v < 1:
        raise OptionError(f"damping leaves less than {percent(vibration)} anyway: take ZV, or a smaller `vibration`")
    sizes = np.array([(1 + v) / 4, (1 - v) / 2 * K, (1 + v) / 4 * K * K])
    return np.arange(3.0), sizes / sizes.sum()


def _following(time: Array, amplitude: Array, more: Array, sizes: Array) -> tuple[Array, Array]:
    """One sequence of impulses convolved with another, in order of time."""
    t, A = np.add.outer(time, more).ravel(), np.multiply.outer(amplitude, sizes).ravel()
    order = np.argsort(t, kind="stable")
    return t[order], A[order]


def _sampled(time: Array, amplitude: Array, hz: float, ratio: float, dt: float) -> Array:
    """Weights by steps whose sum at the pole of a mode is that of the impulses (theory eq. X16)."""
    z = np.exp(2 * np.pi * hz * dt * (ratio + 1j * np.sqrt(1 - ratio**2)))
    steps = np.floor(time / dt + ON_SAMPLE).astype(int)
    weights = np.zeros(steps[-1] + 2)
    for step, part, size in zip(steps.tolist(), time / dt - steps, amplitude, strict=True):
        late = (z**part).imag / z.imag if part > ON_SAMPLE else 0.0
        weights[step] += size * ((z**part).real - late * z.real if late else 1.0)
        weights[step + 1] += size * late
    return weights
