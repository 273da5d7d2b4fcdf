"""Frequency responses of a test as complete matrices, one for every setup, ready to be fitted.

Receptances that were accelerations divided by omega^2 are fitted as these, without the lines near 0 Hz that are noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.structure import UNITS, Channel
from flexura.tables import ends, in_hz
from flexura.testing.measurement.channels import FORCES, MeasuredChannel
from flexura.testing.measurement.measurement import MeasuredFRF, grouped

NEAR_ZERO = 0.02
"""A band begins near 0 Hz when it does so below this share of its end."""

GROWN_TOWARDS_ZERO = 3.0
"""Responses have grown towards 0 Hz when the first lines exceed those at ten times their frequency by so much."""

NOISY_LINE = 0.5
"""Lines at which noise is more than this share of the response say nothing."""

RUN_OF_LINES = 9
"""Lines over which noise and response are compared."""

MOST_LINES_LEFT_OUT = 0.25
"""Lines are left out up to this share of the band at most."""


def grows_towards_zero(hz: Array, H: Complex) -> bool:
    """Whether most responses (f, p, m) of a band from near 0 Hz grow towards it, as accelerations over omega^2 do.

    The receptance of something held is flat there. What floats grows, too, but in phase from line to line.
    """
    if hz[0] > NEAR_ZERO * hz[-1] or len(hz) < 4 * RUN_OF_LINES:
        return False
    first = np.sqrt((np.abs(H[:3]) ** 2).mean(axis=0))
    at = int(np.searchsorted(hz, 10 * hz[1]))
    later = np.median(np.abs(H[max(at - 3, 3) : at + RUN_OF_LINES]), axis=0)
    return bool(np.median(first > GROWN_TOWARDS_ZERO * later) > 0.5)


def noisy_until(A: Complex) -> int:
    """How many of the first lines of accelerances (f, p, m) are mostly noise, by how uneven neighbouring lines are.

    The second difference of white noise over three lines has six times its variance.
    """
    level = (np.abs(A[1:-1]) ** 2).sum(axis=(1, 2))
    uneven = (np.abs(A[:-2] - 2 * A[1:-1] + A[2:]) ** 2).sum(axis=(1, 2)) / 6
    window = np.ones(RUN_OF_LINES)
    share = np.convolve(uneven, window, mode="valid") / np.maximum(np.convolve(level, window, mode="valid"), 1e-300)
    clear = np.flatnonzero(share < NOISY_LINE**2)
    stop = int(clear[0]) if len(clear) else len(A)
    return 0 if stop == 0 else min(stop + RUN_OF_LINES // 2, int(MOST_LINES_LEFT_OUT * len(A)))


Key = tuple[str, tuple[str | None, tuple[float, ...] | None], tuple[float, float, float] | None]

POWER = {"velocity": 1, "angular_velocity": 1, "acceleration": 2, "angular_acceleration": 2}
"""Power of s by which a quantity is above a displacement; all others have none."""

COHERENT_CHANNEL = 0.3
"""Coherence that a channel reaches at one line in ten at least, with one of its partners, to be fitted."""

ACCELERATION = 2
"""Power of s of accelerances."""

NO_MOTIONS = (*FORCES, "voltage", "temperature", "expansion")
"""Quantities of inputs that excite."""

LEAST_LINES = 16
"""Spectral lines in a band below which nothing is fitted."""

BALANCING_ROUNDS = 20
"""Rounds in which sizes of rows and columns are balanced against each other."""


@dataclass(frozen=True)
class ResponseMatrix:
    """H (f, p, m) of one setup at s = i omega + decay (f,), 1/s (theory eq. I1).

    All responses are s^power times that of a displacement. `weight` (f,) is the share of a line in the band, of mean 1.
    Rows over `row_scale` (p,) and columns over `column_scale` (m,) have comparable sizes. Half spectra of outputs have
    the `step` of their samples, s, and `parts` (b, f, p, m), of parts of the records, of which H is the mean.
    """

    setup: str
    frequency_hz: Array
    s: Complex
    response: Complex
    power: int
    weight: Array
    row_scale: Array
    column_scale: Array
    inputs: tuple[MeasuredChannel, ...]
    outputs: tuple[MeasuredChannel, ...]
    notes: tuple[str, ...] = ()
    step: float = 0.0
    parts: Complex | None = None

    @property
    def scaled(self) -> Complex:
        """Responses of comparable size (f, p, m)."""
        return self.response / self.row_scale[:, None] / self.column_scale

    @property
    def transposed(self) -> ResponseMatrix:
        """Inputs and outputs in each other's place."""
        sides = {"inputs": self.outputs, "outputs": self.inputs}
        scales = {"row_scale": self.column_scale, "column_scale": self.row_scale}
        return replace(self, response=self.response.transpose(0, 2, 1), **sides, **scales)


def key_of(channel: MeasuredChannel) -> Key:
    """What tells channels apart."""
    return (channel.name, channel.location, channel.direction)


def response_matrices(
    frfs: Sequence[MeasuredFRF], band: tuple[float, float] | None = None, together: bool = False
) -> list[ResponseMatrix]:
    """The complete matrix of every setup, or one of all setups taken together, in a band (from, to), Hz.

    Raises OptionError for no data, an impossible band, lines or decays that differ within a setup, pairs that are
    missing or given twice, values that are not finite, and channels without any signal.
    """
    if not frfs:
        raise OptionError("there is no frequency response to identify modes from")
    return [
        _matrix(setup, group, band) for setup, group in grouped(frfs, lambda f: "" if together else f.setup).items()
    ]


def _matrix(setup: str, frfs: Sequence[MeasuredFRF], band: tuple[float, float] | None) -> ResponseMatrix:
    where = f"setup {setup!r}: " if setup else ""
    refuse_other_lines(frfs, where)
    hz = frfs[0].frequency_hz
    lines = _lines(hz, band, where)
    inputs = {key_of(c): c for frf in frfs for c in frf.inputs}
    outputs = {key_of(c): c for frf in frfs for c in frf.outputs}
    forces = [c for c in outputs.values() if c.quantity in FORCES]
    motions = [c for c in inputs.values() if c.quantity in UNITS and c.quantity not in NO_MOTIONS]
    if forces and motions:  # the poles of a force per motion are not those of the mechanism
        raise OptionError(
            f"{where}{forces[0].name} / {motions[0].name} is a force per motion (impedance): modes take motions per"
            " force; invert it, all channels at once"
        )
    H, coherence, _ = filled(frfs, inputs, outputs, where)
    H, coherence, hz = H[lines], coherence[lines], hz[lines]
    refuse_infinite(H, list(inputs.values()), list(outputs.values()), hz, where)
    _refuse_silent(H, list(inputs.values()), list(outputs.values()), where)
    s = np.asarray(2j * np.pi * hz + frfs[0].decay, dtype=np.complex128)
    powers = np.array([POWER.get(c.quantity, 0) for c in outputs.values()])
    power = int(powers.max())
    integrated = power < ACCELERATION and grows_towards_zero(hz, H)
    power = ACCELERATION if integrated else power
    H = H * s[:, None, None] ** (power - powers)[:, None]
    first = noisy_until(H) if integrated else 0
    used = [
        np.quantile(np.nan_to_num(coherence[first:]).max(axis=axis), 0.9, axis=0) >= COHERENT_CHANNEL for axis in (2, 1)
    ]
    if not all(good.any() for good in used):
        raise OptionError(f"{where}coherence is near zero throughout the band: the outputs do not follow the inputs")
    rows, columns = (np.flatnonzero(good) for good in used)
    channels = [*zip(outputs.values(), used[0], strict=True), *zip(inputs.values(), used[1], strict=True)]
    notes = [f"{where}{c.name} is left out: coherence near zero" for c, good in channels if not good]
    if integrated:
        note = f"{where}responses grow towards 0 Hz as accelerations divided by omega^2 do: they are fitted as these"
        notes.append(note + (f", from {in_hz(hz[first], 4)} on, below which they are mostly noise" if first else ""))
    elif len(set(powers)) > 1:
        notes.append(f"{where}displacements and velocities were differentiated to be fitted beside accelerations")
    H = H[first:, rows][:, :, columns]
    weight = np.gradient(hz[first:])
    return ResponseMatrix(
        setup,
        hz[first:],
        s[first:],
        H,
        power,
        weight / weight.mean(),
        *balanced(H),
        tuple(list(inputs.values())[k] for k in columns),
        tuple(list(outputs.values())[k] for k in rows),
        tuple(notes),
    )


def refuse_other_lines(frfs: Sequence[MeasuredFRF], where: str) -> None:
    """Raise OptionError for lines or exponential windows that differ."""
    hz = frfs[0].frequency_hz
    for frf in frfs[1:]:
        if len(frf.frequency_hz) != len(hz) or not np.allclose(frf.frequency_hz, hz, rtol=1e-9, atol=0):
            raise OptionError(
                f"{where}frequency responses have different lines, {_grid(hz)} and {_grid(frf.frequency_hz)}; "
                "sample all records of a setup alike"
            )
        if abs(frf.decay - frfs[0].decay) > 1e-9 * abs(frfs[0].decay):
            raise OptionError(
                f"{where}exponential windows differ, decay {frfs[0].decay:g} and {frf.decay:g} 1/s; give setups names"
            )


def _grid(hz: Array) -> str:
    return f"{len(hz)} from {ends((hz[0], hz[-1]), 'Hz', 6)}" if len(hz) else "none"


def _lines(hz: Array, band: tuple[float, float] | None, where: str) -> NDArray[np.bool_]:
    """Lines in the band, above zero. Raises OptionError for an impossible band, and when there are too few."""
    if band is not None:
        low, high = (float(x) for x in band)
        if not (np.isfinite(high) and 0 <= low < high):
            raise OptionError(f"a band is two frequencies in Hz, 0 <= from < to, not {low:g}, {high:g}")
    if not np.isfinite(hz).all() or (np.diff(hz) <= 0).any():
        raise OptionError(f"{where}frequencies are not finite and ascending")
    low, high = band or (0.0, np.inf)
    lines = (hz > 0) & (hz >= low) & (hz <= high)
    if lines.sum() < LEAST_LINES:
        raise OptionError(
            f"{where}of {_grid(hz)}, {int(lines.sum())} spectral lines lie in the band; it takes {LEAST_LINES} at least"
        )
    return lines


def filled(
    frfs: Sequence[MeasuredFRF], inputs: dict[Key, MeasuredChannel], outputs: dict[Key, MeasuredChannel], where: str
) -> tuple[Complex, Array, Array | None]:
    """All pairs in one matrix, their coherence, 1 where it is unknown, and their standard deviations, None unless all
    are known. Raises OptionError for missing pairs."""
    row, column = list(outputs), list(inputs)
    shape = (len(frfs[0].frequency_hz), len(row), len(column))
    H, coherence, sigma = np.zeros(shape, dtype=complex), np.ones(shape), np.full(shape, np.nan)
    count = np.zeros(shape[1:], dtype=int)
    for frf in frfs:
        at = np.ix_([row.index(key_of(c)) for c in frf.outputs], [column.index(key_of(c)) for c in frf.inputs])
        H[:, at[0], at[1]] = frf.response
        if frf.coherence is not None:
            coherence[:, at[0], at[1]] = frf.coherence
        if frf.sigma is not None:
            sigma[:, at[0], at[1]] = frf.sigma
        np.add.at(count, at, 1)
    if (count != 1).any():
        i, j = np.argwhere(count != 1)[0]
        pair = f"{outputs[row[i]].name} / {inputs[column[j]].name}"
        fault = "is missing" if count[i, j] == 0 else f"is given {count[i, j]} times"
        raise OptionError(f"{where}the response {pair} {fault}; every output needs every input once in a setup")
    return H, coherence, None if np.isnan(sigma).any() else sigma


def refuse_infinite(H: Complex, inputs: Sequence[Channel], outputs: Sequence[Channel], hz: Array, where: str) -> None:
    """Raise OptionError for values that are not finite."""
    bad = ~np.isfinite(H)
    if bad.any():
        k, i, j = np.argwhere(bad)[0]
        raise OptionError(f"{where}{outputs[i].name} / {inputs[j].name} is not finite at {in_hz(hz[k], 6)}")


def _refuse_silent(H: Complex, inputs: Sequence[Channel], outputs: Sequence[Channel], where: str) -> None:
    """Raise OptionError for channels without any signal."""
    dead = np.abs(H).max(axis=0) == 0
    for channels, silent in ((outputs, dead.all(axis=1)), (inputs, dead.all(axis=0))):
        if silent.any():
            name = channels[int(silent.argmax())].name
            raise OptionError(f"{where}{name} has no signal at all: leave it out, or mend its cable")


def balanced(H: Complex) -> tuple[Array, Array]:
    """Sizes of rows and columns with which all rows and all columns have root mean squares of one."""
    power = np.mean(np.abs(H) ** 2, axis=0)
    row, column = np.ones(len(power)), np.ones(power.shape[1])
    for _ in range(BALANCING_ROUNDS):
        row = np.mean(power / column, axis=1)
        column = np.mean(power / row[:, None], axis=0)
    return np.sqrt(row), np.sqrt(column)
