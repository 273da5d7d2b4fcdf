"""What is wrong with a hit: numbers that are missing, overload, more than one pulse, a record that ends too early.

Equations H9-H12 of the theory.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.tables import quantity
from flexura.testing.measurement.measurement import Recording

Kind = Literal["not finite", "silent", "overload", "clipped", "double hit", "not at rest", "leakage", "incoherent"]
KINDS: tuple[str, ...] = get_args(Kind)

OVERLOADED = 0.999
"""Share of its full scale from which a channel is overloaded."""

ONSET_OF_PEAK = 0.05
"""A pulse of a hammer begins where the force first exceeds so much of its peak."""

ONSET_OF_NOISE = 8.0
"""A pulse begins where the force also exceeds so many times its rms before the hit."""

CLIPPED_SAMPLES = 3
"""Consecutive samples at the largest magnitude from which a channel is clipped."""

SAME_LEVEL = 1e-9
"""Samples that differ by less, relative to the largest, are at one level of the converter."""

MOST_PULSES = 12
"""A force of more pulses is no hit but a burst of a shaker."""

QUIET = 16
"""Samples before a hit from which offset and noise are known."""

AT_REST_RMS = 0.1
"""Largest rms before a hit, of that after it, of responses that were at rest."""

LEAKAGE = 0.05
"""Largest rms over the last twentieth of a response, of that of its loudest twentieth."""


@dataclass(frozen=True)
class Defect:
    """One thing wrong with one channel of a recording; `kind` can be accepted by that name."""

    kind: Kind
    channel: str
    text: str

    def __str__(self) -> str:
        return f"{self.channel}: {self.text}"


def accepted(kinds: Collection[str]) -> frozenset[str]:
    """The kinds of defects that are to be accepted. Raises OptionError for others."""
    wanted = frozenset([kinds] if isinstance(kinds, str) else kinds)
    unknown = sorted(wanted - set(KINDS))
    if unknown:
        raise OptionError(f"accept: there is no defect {unknown[0]!r}; defects: {', '.join(KINDS)}")
    if "not finite" in wanted:
        raise OptionError("accept: numbers that are not finite cannot be used")
    return wanted


def inspect(recording: Recording, full_scale: Mapping[str, float] | None = None) -> tuple[Defect, ...]:
    """Defects of a record as it came from the channels, before any window (theory eqs. H9-H11).

    `full_scale` is the largest magnitude that a channel can read, SI, by name. Raises OptionError where it is not
    positive.
    """
    scales = full_scale or {}
    for name, scale in scales.items():
        if not (np.isfinite(scale) and scale > 0):
            raise OptionError(f"full_scale of {name} is a positive number, not {scale:g}")
    rows = {c.name: x for c, x in zip(recording.channels, recording.samples, strict=True)}
    bad = {name: at for name, x in rows.items() if len(at := np.flatnonzero(~np.isfinite(x)))}
    if bad:
        text = "{} samples are not finite numbers, the first at {}"
        return tuple(Defect("not finite", name, text.format(len(at), at[0])) for name, at in bad.items())
    defects = [d for name, x in rows.items() if (d := _amplitude(name, x, scales.get(name, np.inf))) is not None]
    if len(recording.inputs) == 1 and not any(d.kind == "silent" for d in defects):
        defects += _hit(recording)
    return tuple(defects)


def _amplitude(name: str, row: Array, scale: float) -> Defect | None:
    """What is wrong with the size of samples (N,)."""
    if np.ptp(row) == 0:
        return Defect("silent", name, f"all samples are {row[0]:g}: is it connected?")
    peak = float(np.abs(row).max())
    if peak >= OVERLOADED * scale:
        return Defect("overload", name, f"reaches {peak:.4g}, its full scale is {scale:.4g}")
    flat = _plateau(row)
    return Defect("clipped", name, f"{flat} consecutive samples at its largest magnitude, {peak:.4g}") if flat else None


def _plateau(row: Array) -> int:
    """Length of the longest plateau at the largest magnitude that is entered or left by a jump, or 0.

    A smooth maximum is flat too, within one step of the converter; a jump is more than two.
    """
    level = np.abs(row)
    round_off = SAME_LEVEL * level.max()
    starts, stops = _runs(np.abs(level - level.max()) <= round_off)
    long = stops - starts >= CLIPPED_SAMPLES
    if not long.any():
        return 0
    steps = np.abs(np.diff(row))
    padded = np.concatenate(([0.0], steps, [0.0]))
    jump = np.maximum(padded[starts], padded[stops]) > 2 * steps[steps > round_off].min()
    return int((stops - starts)[long & jump].max(initial=0))


def _runs(holds: NDArray[np.bool_]) -> tuple[Index, Index]:
    """First sample of every run in which something holds, and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], holds.astype(int), [0]))))
    return edges[::2], edges[1::2]


def pulses(force: Array) -> list[tuple[int, int]]:
    """First and last sample of every pulse of a force (N,), by threshold with hysteresis (theory eq. H10)."""
    size = np.abs(force - np.median(force))
    peak = float(size.max())
    before = size[: max(int(np.argmax(size >= ONSET_OF_PEAK * peak)) - 2, 0)]
    noise = float(np.sqrt(np.mean(before**2))) if len(before) >= 8 else 0.0
    high = max(ONSET_OF_PEAK * peak, ONSET_OF_NOISE * noise)
    starts, stops = _runs(size >= high / 2)
    return [(a, b - 1) for a, b in zip(starts.tolist(), stops.tolist(), strict=True) if (size[a:b] >= high).any()]


def trigger(force: Array) -> tuple[int, int]:
    """Sample at which the first pulse of a force (N,) begins, and how many before it are quiet.

    As many samples as the pulse has are left between, for its foot.
    """
    start, stop = next(iter(pulses(force)), (0, 0))
    return start, max(2 * start - stop - 3, 0)


def _hit(recording: Recording) -> list[Defect]:
    """Defects of one hit: further pulses, and responses that still moved before it."""
    at = recording.inputs[0]
    name, force = recording.channels[at].name, recording.samples[at]
    hits = pulses(force)
    if len(hits) > MOST_PULSES:
        return []
    defects = []
    if len(hits) > 1:
        peaks = sorted(float(np.abs(force[a : b + 1]).max()) for a, b in hits)
        times = ", ".join(quantity(a / recording.sample_rate, "s", 4) for a, _ in hits[:4])
        text = f"{len(hits)} pulses, at {times}; the second largest has {peaks[-2] / peaks[-1]:.0%} of the peak"
        defects.append(Defect("double hit", name, text))
    start, still = trigger(force)
    if still < QUIET:
        return defects
    for k, (channel, row) in enumerate(zip(recording.channels, recording.samples, strict=True)):
        quiet, loud = row[:still], row[start : 5 * start]
        share = float(np.std(quiet) / max(np.std(loud), np.finfo(float).tiny))
        if k != at and share > AT_REST_RMS and _correlated(quiet):
            text = f"moves before the pulse, with {share:.0%} of its rms after"
            defects.append(Defect("not at rest", channel.name, text))
    return defects


def _correlated(row: Array) -> bool:
    """True when neighbouring samples go together, as motions do and white noise does not."""
    x = row - row.mean()
    power = float(x @ x)
    return power > 0 and float(x[1:] @ x[:-1]) / power > 3 / np.sqrt(len(x)) + 0.3


def leakage(response: Array, quiet: Array) -> float:
    """Rms of the last twentieth of a response (N,) less that of noise, over that of its loudest (theory eq. H12).

    `quiet` is what was read before the hit, with the same window.
    """
    level = np.array([np.mean(piece**2) for piece in np.array_split(response, 20)])
    noise = float(np.mean(quiet**2)) if len(quiet) >= QUIET else 0.0
    loudest = float(level.max()) - noise
    return float(np.sqrt(max(level[-1] - noise, 0.0) / loudest)) if loudest > 0 else 0.0
