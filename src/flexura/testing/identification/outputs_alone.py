"""What is known of modes of outputs alone: tones that are none, records too short, shapes without a scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexura.arrays import Array, Complex
from flexura.tables import in_hz
from flexura.testing.identification.evidence import evidence_of
from flexura.testing.identification.residues import Fit
from flexura.testing.measurement import POWER, Correlations, MeasuredChannel, ModeEvidence, ResponseMatrix, is_tone

MEMORIES_IN_PART = 3.0
"""A part of the records is so many times as long at least as a mode remembers, for scatter over parts to be its own."""

SHARE_OF_ALL = 0.5
"""Share of the orders that counts as all: at the others noise takes another pole beside the mode."""

UNKNOWN = (
    "of outputs alone: inputs are taken for white noise, shapes are not scaled and modal masses not known; if a channel"
    " is the excitation, a file of channels says so: NAME: {unit: N, input: true}"
)
"""A note on all such modes."""


def at_least_known(fit: Fit, duration: float) -> Array:
    """Standard deviations of poles (n, 2), 1/s, not below those that noise on records of a duration, s, allows.

    No estimate is better, whatever the noise of the sensors (Au 2014, theory eq. I37). Zeros are not known and stay.
    """
    least = np.sqrt(np.abs(fit.poles.real) / duration)[:, None]
    return np.where(fit.pole_sigma > 0, np.maximum(fit.pole_sigma, least), fit.pole_sigma)


def judged(
    evidence: Sequence[ModeEvidence], fit: Fit, matrix: ResponseMatrix, C: Correlations
) -> tuple[list[ModeEvidence], list[str]]:
    """Evidence of modes, without confidence in those that are tones, and remarks (theory eq. I32).

    Scatter over the orders takes part in the confidence where nothing else is known: poles of single orders scatter by
    the noise that each of them fits, and are not those that are returned.
    """
    known, remarks, rough = [], [], []
    part = C.duration / len(C.parts)
    for k, one in enumerate(evidence):
        pole, hz = complex(fit.poles[k]), float(np.abs(fit.poles[k])) / (2 * np.pi)
        kurtosis = C.kurtosis(hz, fit.shapes[:, k] * matrix.row_scale)
        if tone := is_tone(kurtosis, len(C.spectra)):
            remarks.append(
                f"{in_hz(hz)} is a tone and no mode: its amplitude hardly varies (kurtosis {kurtosis:.2f}; 0 of noise,"
                f" -1 of a sine), and its damping ratio is {-pole.real / abs(pole):.1g}"
            )
        if -pole.real * part < MEMORIES_IN_PART:
            rough.append(in_hz(hz))
        sigma = one.frequency_sigma, one.damping_sigma
        sure = (
            one
            if not one.frequency_sigma
            else evidence_of(min(1.0, one.share / SHARE_OF_ALL), scatter=(0, 0), sigma=sigma, bias=(0, 0))
        )
        known.append(replace(one, confidence=0.0 if tone else sure.confidence))
    if rough:
        remarks.append(
            f"modes at {', '.join(rough)} remember longer than the parts of the records that scatter is known by:"
            " standard deviations are rough; record longer"
        )
    return known, remarks


def motions(outputs: Sequence[MeasuredChannel], poles: Complex) -> Complex:
    """Factors (p, n) of what outputs read of modes whose shapes are displacements: s^2 of accelerations."""
    powers = np.array([POWER.get(channel.quantity, 0) for channel in outputs])
    return poles ** powers[:, None]
