"""A mode from the one peak that stands above everything, where no pole is stable: one so lightly damped that it has not
decayed at the end of the record, or that records do not agree on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexura.arrays import Complex
from flexura.tables import in_hz
from flexura.testing.identification.complexity import confidence_of
from flexura.testing.measurement import ModeEvidence, ResponseMatrix

ABOVE = 1e3
"""Square of a peak over the median of all lines from which it is no noise: 30 dB; the largest of 100 000 lines of noise
has 12 dB."""

LEAST = 0.05
"""Part of the width of a peak that is taken for damping where a window has added more than there is."""


class LonePeak(NamedTuple):
    """The mode of a peak: its pole, rad/s, participation (m, 1), evidence, and what is said of it."""

    pole: complex
    participation: Complex
    evidence: ModeEvidence
    note: str

    @property
    def hz(self) -> float:
        """Its frequency, Hz."""
        return abs(self.pole) / (2 * np.pi)


def lone_peak(matrix: ResponseMatrix) -> LonePeak | None:
    """The mode of the largest peak of the responses; None where it is less than 30 dB above the median.

    Its frequency is the centre of the lines within half its power, its damping ratio half of their width over that
    (half-power method, D. J. Ewins, Modal Testing, 2000): the most that it may be, since lines and leakage widen it.
    """
    H, hz = matrix.scaled, matrix.frequency_hz
    power = (np.abs(H) ** 2).sum(axis=(1, 2))
    k, middle = int(np.argmax(power)), float(np.median(power))
    if not power[k] > ABOVE * middle or k in (0, len(hz) - 1):
        return None
    low = high = k
    while low > 0 and power[low - 1] > power[k] / 2:
        low -= 1
    while high < len(hz) - 1 and power[high + 1] > power[k] / 2:
        high += 1
    step, own = float(np.median(np.diff(hz))), slice(low, high + 1)
    centre, width = float(np.average(hz[own], weights=power[own])), (high - low + 1) * step
    decay = max(np.pi * width - float(matrix.s.real[0]), LEAST * np.pi * width)
    size = 2 * np.pi * centre
    participation = np.linalg.svd(H[k])[2][:1].conj().T
    spread = width / (2 * centre)
    evidence = ModeEvidence(
        *(confidence_of(0.0, spread, 1.0, spread, 1.0), 0.0, 0.0, 1.0, 0.0),
        share=0.0,
        frequency_bias=spread,
        damping_bias=1.0,
    )
    note = (
        f"no pole is stable over the orders: the mode at {in_hz(centre)} is that of a peak alone,"
        f" {10 * np.log10(power[k] / middle):.0f} dB above the median of the lines; its damping is the most that a peak"
        f" of {in_hz(width, 3)} allows: it has not decayed at the end of the record, or records differ; record longer"
    )
    return LonePeak(complex(-decay, np.sqrt(size**2 - decay**2)), participation, evidence, note)
