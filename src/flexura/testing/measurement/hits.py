"""What is wrong with a hit: numbers that are missing, overload, more than one pulse, a record that ends too early."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.tables import quantity
from flexura.testing.measurement.measurement import Recording

Kind = Literal["not finite", "silent", "overload", "clipped", "double hit", "not at rest", "leakage", "incoherent"]
KINDS: tuple[str, ...] = get_args(Kind)

PULSE = 0.05
"""A pulse of a hammer begins where the force first exceeds so much of its peak."""

NOISES = 8.0
"""A pulse begins where the force also exceeds so many times its rms before the hit."""

PLATEAU = 3
"""Consecutive samples at the largest magnitude from which a channel is clipped."""

AT_REST = 0.1
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
    found = frozenset([kinds] if isinstance(kinds, str) else kinds)
    unknown = sorted(found - set(KINDS))
    if unknown:
        raise OptionError(f"accept: there is no defect {unknown[0]!r}; defects: {', '.join(KINDS)}")
    if "not finite" in found:
        raise OptionError("accept: numbers that are not finite cannot be used")
    return found


def inspect(recording: Recording, full_scale: Mapping[str, float] | None = None) -> tuple[Defect, ...]:
    """Defects of a record as it came from the channels, before any window (theory eqs. H9-H11).

    `full_scale` is the largest magnitude that each channel can read, SI, by name. Raises OptionError for names that
    the recording does not have.
    """
    scales = dict(full_scale or {})
    names = [c.name for c in recording.channels]
    for name, scale in scales.items():
        if name not in names:
            raise OptionError(f"full_scale: there is no channel {name!r}; known: {', '.join(names)}")
        if not (np.isfinite(scale) and scale > 0):
            raise OptionError(f"full_scale of {name} is a positive number, not {scale:g}")
    x = recording.samples
    broken = [_not_finite(name, row) for name, row in zip(names, x, strict=True) if not np.isfinite(row).all()]
    if broken:
        return tuple(broken)
    found: list[Defect] = []
    for name, row in zip(names, x, strict=True):
        found += _amplitude(name, row, scales.get(name))
    if len(recording.inputs) == 1 and not any(d.kind == "silent" for d in found):
        found += _hit(recording)
    return tuple(found)


def _not_finite(name: str, row: Array) -> Defect:
    bad = np.flatnonzero(~np.isfinite(row))
    return Defect("not finite", name, f"{len(bad)} samples are not finite numbers, the first at {bad[0]}")


def _amplitude(name: str, row: Array, scale: float | None) -> list[Defect]:
    if np.ptp(row) == 0:
        return [Defect("silent", name, f"all samples are {row[0]:g}: is it connected?")]
    peak = float(np.abs(row).max())
    if scale is not None and peak >= 0.999 * scale:
        return [Defect("overload", name, f"reaches {peak:.4g}, its full scale is {scale:.4g}")]
    flat = _plateau(row)
    if flat:
        return [Defect("clipped", name, f"{flat} consecutive samples at its largest magnitude, {peak:.4g}")]
    return []


def _plateau(row: Array) -> int:
    """Length of the longest plateau at the largest magnitude that is entered or left by a jump, or 0.

    A smooth maximum is flat too, within one step of the converter; a jump is more than two.
    """
    level = np.abs(row)
    top = np.abs(level - level.max()) <= 1e-9 * level.max()
    edges = np.flatnonzero(np.diff(np.concatenate(([0], top.astype(int), [0]))))
    starts, stops = edges[::2], edges[1::2]
    long = stops - starts >= PLATEAU
    if not long.any():
        return 0
    steps = np.abs(np.diff(row))
    step = steps[steps > 1e-9 * level.max()].min()
    padded = np.concatenate(([0.0], steps, [0.0]))
    jump = np.maximum(padded[starts], padded[stops]) > 2 * step
    found = (stops - starts)[long & jump]
    return int(found.max()) if len(found) else 0


def pulses(force: Array) -> list[tuple[int, int]]:
    """First and last sample of every pulse of a force (N,), by threshold with hysteresis (theory eq. H10)."""
    size = np.abs(force - np.median(force))
    peak = float(size.max())
    before = size[: max(int(np.argmax(size >= PULSE * peak)) - 2, 0)]
    noise = float(np.sqrt(np.mean(before**2))) if len(before) >= 8 else 0.0
    high = max(PULSE * peak, NOISES * noise)
    loud = np.flatnonzero(size >= high)
    inside = size >= high / 2
    edges = np.flatnonzero(np.diff(np.concatenate(([0], inside.astype(int), [0]))))
    regions = zip(edges[::2], edges[1::2] - 1, strict=True)
    return [(int(a), int(b)) for a, b in regions if np.searchsorted(loud, a) < np.searchsorted(loud, b, side="right")]


def trigger(force: Array) -> tuple[int, int]:
    """Sample at which the first pulse of a force (N,) begins, and how many before it are quiet.

    As many samples as the pulse has are left between, for its foot.
    """
    found = pulses(force)
    start, stop = found[0] if found else (0, 0)
    return start, max(2 * start - stop - 3, 0)


def _hit(recording: Recording) -> list[Defect]:
    """Defects of one hit: further pulses, and responses that still moved before it."""
    at = recording.inputs[0]
    name, force = recording.channels[at].name, recording.samples[at]
    hits = pulses(force)
    found = []
    if len(hits) > 1:
        peaks = sorted(float(np.abs(force[a : b + 1]).max()) for a, b in hits)
        times = ", ".join(quantity(a / recording.sample_rate, "s", 4) for a, _ in hits[:4])
        text = f"{len(hits)} pulses, at {times}; the second largest has {peaks[-2] / peaks[-1]:.0%} of the peak"
        found.append(Defect("double hit", name, text))
    start, still = trigger(force)
    if still < 16:
        return found
    for k, channel in enumerate(recording.channels):
        row = recording.samples[k]
        quiet, loud = row[:still], row[start : 5 * start]
        share = float(np.std(quiet) / max(np.std(loud), np.finfo(float).tiny))
        if k != at and share > AT_REST and _correlated(quiet):
            text = f"moves before the pulse, with {share:.0%} of its rms after"
            found.append(Defect("not at rest", channel.name, text))
    return found


def _correlated(row: Array) -> bool:
    """True when neighbouring samples go together, as motions do and white noise does not."""
    x = row - row.mean()
    power = float(x @ x)
    return power > 0 and float(x[1:] @ x[:-1]) / power > 3 / np.sqrt(len(x)) + 0.3


def leakage(response: Array, quiet: Array) -> float:
    """Rms of the last twentieth of a response (N,) less that of noise, over that of its loudest (theory eq. H12).

    `quiet` is what was read before the hit, with the same window.
    """
    pieces = np.array_split(response, 20)
    level = np.array([np.mean(piece**2) for piece in pieces])
    noise = float(np.mean(quiet**2)) if len(quiet) >= 16 else 0.0
    loudest = float(level.max()) - noise
    return float(np.sqrt(max(level[-1] - noise, 0.0) / loudest)) if loudest > 0 else 0.0
