"""What the misfit says of each mode of a fit: whether the data carry it, how far it may be biased, and which are close.

Equations I24-I26 of the theory.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Complex
from flexura.tables import in_hz
from flexura.testing.identification.residues import Fit
from flexura.testing.measurement import ResponseMatrix, responses

CARRIED, CARRIED_EACH = 30.0, 5.0
"""What a mode adds near its frequency, squared, is so many times the variance of a line of the misfit, and so many
times more for each response: a pole that follows noise gains 2 for each of its numbers, and some by being chosen."""

ROUND_OFF = 1e-12
"""What a mode adds near its frequency, squared, is also more than this share of the responses, squared: their round-off
where they are free of noise."""

STRUCTURED = 4.0
"""A misfit is more than white noise where its square exceeds what its second difference shows by so many of the
standard deviations, roughly, of that ratio."""

NEAR = 2.0
"""Lines of a mode lie within so many half-power half-widths."""

LEAST = 9
"""So many lines nearest to a mode are its own where fewer lie that near."""

ALIKE = 0.9
"""Modal assurance criterion of residues that are alike."""


def _term(matrix: ResponseMatrix, fit: Fit, k: int) -> Complex:
    """What one mode adds to the scaled responses (f, p, m)."""
    at = slice(k, k + 1)
    one = responses(matrix.s, fit.poles[at], fit.shapes[:, at], fit.participation[:, at])
    return one * matrix.s[:, None, None] ** matrix.power


def _lines(matrix: ResponseMatrix, pole: complex) -> NDArray[np.intp]:
    """Positions of the lines of a mode."""
    apart = np.abs(matrix.s.imag - abs(pole.imag))
    inside = np.flatnonzero(apart < NEAR * abs(pole.real))
    return inside if len(inside) >= LEAST else np.sort(np.argsort(apart, kind="stable")[:LEAST])


def is_carried(matrix: ResponseMatrix, fit: Fit, k: int) -> bool:
    """Whether a mode adds more to the responses near its frequency than a pole that follows noise (theory eq. I24)."""
    at = _lines(matrix, complex(fit.poles[k]))
    own = float((np.abs(_term(matrix, fit, k)[at]) ** 2).sum())
    left = np.abs((matrix.scaled - fit.synthesis)[at]) ** 2
    whole = float((np.abs(matrix.scaled[at]) ** 2).sum())
    noise = float(left.mean()) * (CARRIED + CARRIED_EACH * left[0].size)
    return own > max(noise, ROUND_OFF * whole)


def bias(matrix: ResponseMatrix, fit: Fit, k: int) -> tuple[float, float]:
    """How far frequency and damping ratio of a mode may be off by what is not noise, relative (theory eqs. I25, I26).

    By the part of the misfit that neighbouring lines share, and by the width of a line against that of the mode.
    """
    pole = complex(fit.poles[k])
    at = _lines(matrix, pole)
    left = (matrix.scaled - fit.synthesis)[at]
    uneven = float((np.abs(left[:-2] - 2 * left[1:-1] + left[2:]) ** 2).sum()) / 6 * len(at) / (len(at) - 2)
    square = float((np.abs(left) ** 2).sum())
    slope = _term(matrix, fit, k)[at] / (matrix.s[at] - pole)[:, None, None]
    moved = 0.0
    if square > (1 + STRUCTURED / np.sqrt(left.size)) * uneven:
        moved = float(np.sqrt((square - uneven) / max(float((np.abs(slope) ** 2).sum()), 1e-300)))
    step = 2 * np.pi * float(np.median(np.diff(matrix.frequency_hz)))
    width = min((step / (2 * abs(pole.real))) ** 2 / 3, 1.0)
    ratio = abs(pole.real) / abs(pole)
    return max(moved / abs(pole), width * ratio), max(moved / abs(pole.real), width)


def close_pairs(matrix: ResponseMatrix, fit: Fit, repeated: list[list[int]]) -> list[str]:
    """Notes on modes that lines cannot tell apart, or that are alike within their width."""
    hz = np.abs(fit.poles) / (2 * np.pi)
    step = float(np.median(np.diff(matrix.frequency_hz)))
    left, right = (x / np.linalg.norm(x, axis=0) for x in (fit.shapes, fit.participation))
    notes = []
    for k in range(len(hz) - 1):
        apart, width = float(hz[k + 1] - hz[k]), float(np.abs(fit.poles[k : k + 2].real).mean() / np.pi)
        alike = float(
            np.abs(left[:, k].conj() @ left[:, k + 1]) ** 2 * np.abs(right[:, k].conj() @ right[:, k + 1]) ** 2
        )
        if any(k in group and k + 1 in group for group in repeated):
            continue
        if apart < step:
            why = f"closer than the lines, which are {in_hz(step, 3)} apart"
        elif apart < width and alike > ALIKE:
            why = "alike and closer than their half-power width"
        else:
            continue
        notes.append(f"modes at {in_hz(hz[k], 6)} and {in_hz(hz[k + 1], 6)} are {why}: they may be one")
    return notes
