"""Frequency responses of a test as complete matrices, one for every setup, ready to be fitted.

Receptances that were accelerations divided by omega^2: what noise and offset make of the lines near 0 Hz.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.systems import UNITS
from flexura.tables import ends, in_hz
from flexura.testing.measurement.channels import FORCES, MeasuredChannel
from flexura.testing.measurement.measurement import MeasuredFRF

NEAR_ZERO = 0.02
"""A band begins near 0 Hz when it does so below this share of its end."""

GROWN = 3.0
"""Responses have grown towards 0 Hz when the first lines exceed those at ten times their frequency by so much."""

NOISY = 0.5
"""Lines at which noise is more than this share of the response say nothing."""

RUN = 9
"""Lines over which noise and response are compared."""

LOWEST = 0.25
"""Lines are left out up to this share of the band at most."""


def grows_towards_zero(hz: Array, H: Complex) -> bool:
    """Whether most responses (f, p, m) of a band from near 0 Hz grow towards it, as accelerations over omega^2 do.

    The receptance of something held is flat there. What floats grows, too, but in phase from line to line.
    """
    if hz[0] > NEAR_ZERO * hz[-1] or len(hz) < 4 * RUN:
        return False
    first = np.sqrt((np.abs(H[:3]) ** 2).mean(axis=0))
    at = int(np.searchsorted(hz, 10 * hz[1]))
    later = np.median(np.abs(H[max(at - 3, 3) : at + RUN]), axis=0)
    return bool(np.median(first > GROWN * later) > 0.5)


def noisy_until(A: Complex) -> int:
    """How many of the first lines of accelerances (f, p, m) are mostly noise, by how uneven neighbouring lines are.

    The second difference of white noise over three lines has six times its variance.
    """
    level = (np.abs(A[1:-1]) ** 2).sum(axis=(1, 2))
    uneven = (np.abs(A[:-2] - 2 * A[1:-1] + A[2:]) ** 2).sum(axis=(1, 2)) / 6
    window = np.ones(RUN)
    share = np.convolve(uneven, window, mode="valid") / np.maximum(np.convolve(level, window, mode="valid"), 1e-300)
    clear = np.flatnonzero(share < NOISY**2)
    stop = int(clear[0]) if len(clear) else len(A)
    return 0 if stop == 0 else min(stop + RUN // 2, int(LOWEST * len(A)))


Key = tuple[str, tuple[str | None, tuple[float, ...] | None], tuple[float, float, float] | None]

POWER = {"velocity": 1, "angular_velocity": 1, "acceleration": 2, "angular_acceleration": 2}
"""Power of s by which a quantity is above a displacement; all others have none."""

COHERENT = 0.3
"""Coherence that a channel reaches at one line in ten at least, with one of its partners, to be fitted."""

DIFFERENTIATED = 2
"""Power of s of accelerances."""

LEAST_LINES = 16
"""Spectral lines in a band below which nothing is fitted."""

BALANCED = 20
"""Rounds in which sizes of rows and columns are balanced against each other."""


@dataclass(frozen=True)
class ResponseMatrix:
    """H (f, p, m) of one setup at s = i omega + decay (f,), 1/s (theory eq. I1).

    All responses are s^power times that of a displacement. `weight` (f,) is the share of a line in the band, of mean 1.
    Rows over `row_scale` (p,) and columns over `column_scale` (m,) have comparable sizes.
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

    @property
    def scaled(self) -> Complex:
        """Responses of comparable size (f, p, m)."""
        return self.response / self.row_scale[:, None] / self.column_scale

    @property
    def transposed(self) -> ResponseMatrix:
        """Inputs and outputs in each other's place."""
        turned = self.response.transpose(0, 2, 1)
        scales = {"row_scale": self.column_scale, "column_scale": self.row_scale}
        return replace(self, response=turned, inputs=self.outputs, outputs=self.inputs, **scales)


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
    names = [""] if together else list(dict.fromkeys(frf.setup for frf in frfs))
    groups = {name: [frf for frf in frfs if together or frf.setup == name] for name in names}
    return [_matrix(name, group, band) for name, group in groups.items()]


def _matrix(setup: str, frfs: Sequence[MeasuredFRF], band: tuple[float, float] | None) -> ResponseMatrix:
    where = f"setup {setup!r}: " if setup else ""
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
    lines = _lines(hz, band, where)
    inputs = _channels(c for frf in frfs for c in frf.inputs)
    outputs = _channels(c for frf in frfs for c in frf.outputs)
    _refuse_inverted(inputs.values(), outputs.values(), where)
    H, coherence = _filled(frfs, inputs, outputs, where)
    H, coherence = H[lines], coherence[lines]
    _refuse_bad(H, inputs, outputs, hz[lines], where)
    s = np.asarray(2j * np.pi * hz[lines] + frfs[0].decay, dtype=np.complex128)
    power = np.array([POWER.get(c.quantity, 0) for c in outputs.values()])
    largest = int(power.max())
    first, said = 0, ""
    if largest < DIFFERENTIATED and grows_towards_zero(hz[lines], H):
        largest = DIFFERENTIATED
        accelerance = H * s[:, None, None] ** (largest - power)[:, None]
        first = noisy_until(accelerance)
        said = f"{where}responses grow towards 0 Hz as accelerations divided by omega^2 do: they are fitted as these"
        if first:
            said += f", from {in_hz(hz[lines][first], 4)} on, below which they are mostly noise"
    H = H[first:] * s[first:, None, None] ** (largest - power)[:, None]
    hz, s, coherence = hz[lines][first:], s[first:], coherence[first:]
    kept = [_coherent(coherence, axis) for axis in (2, 1)]
    listed = [list(outputs.values()), list(inputs.values())]
    notes = [
        f"{where}{c.name} is left out: coherence near zero"
        for channels, own in zip(listed, kept, strict=True)
        for c, good in zip(channels, own, strict=True)
        if not good
    ]
    if not (kept[0].any() and kept[1].any()):
        raise OptionError(f"{where}coherence is near zero throughout the band: the outputs do not follow the inputs")
    if said:
        notes.append(said)
    elif len(set(power)) > 1:
        notes.append(f"{where}displacements and velocities were differentiated to be fitted beside accelerations")
    H = H[:, kept[0]][:, :, kept[1]]
    weight = np.gradient(hz)
    row_scale, column_scale = _scales(H)
    return ResponseMatrix(
        setup,
        hz,
        s,
        H,
        largest,
        weight / weight.mean(),
        row_scale,
        column_scale,
        tuple(c for c, good in zip(listed[1], kept[1], strict=True) if good),
        tuple(c for c, good in zip(listed[0], kept[0], strict=True) if good),
        tuple(notes),
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


def _channels(channels: Iterable[MeasuredChannel]) -> dict[Key, MeasuredChannel]:
    return {key_of(c): c for c in channels}


def _filled(
    frfs: Sequence[MeasuredFRF], inputs: dict[Key, MeasuredChannel], outputs: dict[Key, MeasuredChannel], where: str
) -> tuple[Complex, Array]:
    """All pairs in one matrix and their coherence, 1 where it is unknown. Raises OptionError for missing pairs."""
    row, column = ({key: k for k, key in enumerate(keys)} for keys in (outputs, inputs))
    shape = (len(frfs[0].frequency_hz), len(row), len(column))
    H, coherence = np.zeros(shape, dtype=complex), np.ones(shape)
    count = np.zeros(shape[1:], dtype=int)
    for frf in frfs:
        at = np.ix_([row[key_of(c)] for c in frf.outputs], [column[key_of(c)] for c in frf.inputs])
        H[:, at[0], at[1]] = frf.response
        if frf.coherence is not None:
            coherence[:, at[0], at[1]] = frf.coherence
        np.add.at(count, at, 1)
    if (count != 1).any():
        i, j = np.argwhere(count != 1)[0]
        pair = f"{list(outputs.values())[i].name} / {list(inputs.values())[j].name}"
        fault = "is missing" if count[i, j] == 0 else f"is given {count[i, j]} times"
        raise OptionError(f"{where}the response {pair} {fault}; every output needs every input once in a setup")
    return H, coherence


def _refuse_bad(H: Complex, inputs: dict, outputs: dict, hz: Array, where: str) -> None:
    bad = ~np.isfinite(H)
    dead = ~bad.any(axis=0) & (np.abs(H).max(axis=0) == 0)
    names = [[c.name for c in channels.values()] for channels in (outputs, inputs)]
    if bad.any():
        k, i, j = np.argwhere(bad)[0]
        raise OptionError(f"{where}{names[0][i]} / {names[1][j]} is not finite at {in_hz(hz[k], 6)}")
    for axis, kind in ((1, 0), (0, 1)):
        silent = dead.all(axis=axis)
        if silent.any():
            raise OptionError(
                f"{where}{names[kind][int(silent.argmax())]} has no signal at all: leave it out, or mend its cable"
            )


def _coherent(coherence: Array, axis: int) -> NDArray[np.bool_]:
    """Channels of the other axis that are coherent with one partner at one line in ten."""
    return np.quantile(np.nan_to_num(coherence).max(axis=axis), 0.9, axis=0) >= COHERENT


def _refuse_inverted(inputs: Iterable[MeasuredChannel], outputs: Iterable[MeasuredChannel], where: str) -> None:
    """Raise OptionError for forces per motion, whose poles are not those of the mechanism."""
    forces = [c for c in outputs if c.quantity in FORCES]
    motions = [c for c in inputs if c.quantity in UNITS and c.quantity not in (*FORCES, "voltage", "expansion")]
    if forces and motions:
        raise OptionError(
            f"{where}{forces[0].name} / {motions[0].name} is a force per motion (impedance): modes take motions per"
            " force; invert it, all channels at once"
        )


def _scales(H: Complex) -> tuple[Array, Array]:
    """Sizes of rows and columns with which all rows and all columns have root mean squares of one."""
    power = np.mean(np.abs(H) ** 2, axis=0)
    row, column = np.ones(len(power)), np.ones(power.shape[1])
    for _ in range(BALANCED):
        row = np.mean(power / column, axis=1)
        column = np.mean(power / row[:, None], axis=0)
    return np.sqrt(row), np.sqrt(column)
