"""Sobol indices of groups of sizes, with intervals: what share of the variance each tolerance answers for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from flexura.arrays import Array

ROUND_OFF = 1e-12
"""Spread, relative to the value, that is none."""


@dataclass(frozen=True)
class SobolIndices:
    """First-order and total indices (g, q) of g tolerances for q quantities; `_half` half the widths of intervals.

    `used` (q,) is the number of base samples that have values in all their matrices. NaN where nothing scatters.
    """

    first: Array
    first_half: Array
    total: Array
    total_half: Array
    used: NDArray[np.intp]


def indices_of(A: Array, B: Array, AB: Array, confidence: float) -> SobolIndices:
    """Sobol indices from values (R, n, q) at two samples and (g, R, n, q) at those of A with group g from B.

    Numerators of Saltelli et al. (2010, table 2 b, f), which `scipy.stats.sobol_indices` has for samples of a power of
    two without gaps, over the variance that differences of A and B have: a tolerance that answers for all has 1,
    whatever the samples. Intervals by the jackknife over the R independent scramblings (theory eqs. U8-U10). A base
    sample of which a design failed is left out.
    """
    g, _, _, q = AB.shape
    found = np.full((4, g, q), np.nan)
    used = np.zeros(q, dtype=np.intp)
    for k in range(q):
        whole = np.isfinite(A[..., k]) & np.isfinite(B[..., k]) & np.isfinite(AB[..., k]).all(axis=0)
        rows = [(A[r, w, k], B[r, w, k], AB[:, r, w, k]) for r, w in enumerate(whole) if w.any()]
        used[k] = int(whole.sum())
        if len(rows) > 1:
            found[:, :, k] = _with_intervals(rows, confidence)
    first, first_half, total, total_half = found
    return SobolIndices(first, first_half, total, total_half, used)


def _with_intervals(rows: list[tuple[Array, Array, Array]], confidence: float) -> Array:
    """First-order indices, half widths, total indices, half widths (4, g) of one quantity."""
    R = len(rows)
    left_out = np.array([_estimate(rows[:r] + rows[r + 1 :]) for r in range(R)])
    spread = np.sqrt((R - 1) / R * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0))
    half = student.ppf(0.5 + 0.5 * confidence, R - 1) * spread
    value = _estimate(rows)
    return np.stack([value[0], half[0], value[1], half[1]])


def _estimate(rows: list[tuple[Array, Array, Array]]) -> Array:
    """First-order and total indices (2, g) from samples together; NaN where nothing scatters."""
    A, B, AB = (np.concatenate([row[m] for row in rows], axis=-1) for m in range(3))
    both = np.concatenate([A, B])
    scale = float(np.ptp(both))
    if scale <= ROUND_OFF * float(np.max(np.abs(both))):
        return np.full((2, len(AB)), np.nan)
    A, B, AB = ((own - both.mean()) / scale for own in (A, B, AB))
    variance = 0.5 * float(np.mean((A - B) ** 2))
    return np.stack([np.mean(B * (AB - A), axis=-1), 0.5 * np.mean((A - AB) ** 2, axis=-1)]) / variance
