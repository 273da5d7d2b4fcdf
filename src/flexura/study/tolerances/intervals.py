"""Confidence intervals of means, shares and percentiles, from scrambled nets or from independent samples.

Values come as (R, n): R independent scramblings of a net of n points. Independent samples are (N, 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta, binom
from scipy.stats import t as student

from flexura.arrays import Array

Method = Literal["scramblings", "Clopper-Pearson", "order statistics"]

FEWEST = 5
"""Points of a scrambling that must lie on either side of a limit, on average, for Student's interval."""


@dataclass(frozen=True)
class Estimate:
    """A number with the interval that holds it with the confidence asked for; infinite where samples give no bound."""

    value: float
    low: float
    high: float
    method: Method


def mean_interval(values: Array, confidence: float) -> Estimate:
    """The mean of values (R, n), by Student's t of the means of the scramblings (theory eq. U3).

    Values that are NaN are left out.
    """
    own = _row_means(values)
    value = float(np.nanmean(values))
    half = _student(own, confidence)
    return Estimate(value, value - half, value + half, "scramblings")


def share_interval(passes: NDArray[np.bool_], confidence: float) -> Estimate:
    """The share of True among (R, n), with its interval.

    Student's t of the shares of the scramblings, no narrower than what these leave open when they agree (theory eqs.
    U3, U4); with fewer than five points of a scrambling on one side, that of Clopper and Pearson (1934), eq. 4 of
    whom holds for independent samples (theory eq. U5).
    """
    R, n = passes.shape
    count, N = int(np.sum(passes)), passes.size
    value = count / N
    if min(count, N - count) < FEWEST * R or n == 1:
        low, high = clopper_pearson(count, N, confidence)
        return Estimate(value, low, high, "Clopper-Pearson")
    half = share_half_width(passes, confidence)
    return Estimate(value, max(value - half, 0.0), min(value + half, 1.0), "scramblings")


def share_half_width(passes: NDArray[np.bool_], confidence: float) -> float:
    """Half the width of Student's interval of a share of (R, n) (theory eqs. U3, U4)."""
    R, n = passes.shape
    open_ = (1 - (0.5 * (1 - confidence)) ** (1 / R)) / n
    return max(_student(np.mean(passes, axis=1), confidence), open_)


def clopper_pearson(count: int, of: int, confidence: float) -> tuple[float, float]:
    """The interval of a share of independent samples that holds it at least so often (Clopper and Pearson 1934).

    All of 4096 samples leave open a share of 1 - 0.9991: what is called the rule of three.
    """
    tail = 0.5 * (1 - confidence)
    low = 0.0 if count == 0 else float(beta.ppf(tail, count, of - count + 1))
    high = 1.0 if count == of else float(beta.isf(tail, count + 1, of - count))
    return low, high


def percentile_interval(values: Array, share: float, confidence: float) -> Estimate:
    """The value below which a share of all lies, of values (R, n), with its interval.

    One quantile of all samples (Kaplan, Li, Nakayama and Tuffin 2019) between the quantiles at the ends of the interval
    of the share below it (theory eq. U6); near the ends of the sample between order statistics, which hold for
    independent samples of any distribution (theory eq. U7). Values that are NaN are left out.
    """
    ordered = np.sort(values[np.isfinite(values)])
    N = len(ordered)
    if N == 0:
        return Estimate(np.nan, np.nan, np.nan, "order statistics")
    value = float(np.quantile(ordered, share, method="hazen"))
    n = values.shape[1]
    if min(share, 1 - share) * n < FEWEST or n == 1:
        low, high = order_statistics(N, share, confidence)
        return Estimate(value, _at(ordered, low), _at(ordered, high), "order statistics")
    half = share_half_width(values <= value, confidence)
    low, high = int(np.floor(N * (share - half))), int(np.ceil(N * (share + half))) + 1
    return Estimate(value, _at(ordered, low), _at(ordered, high), "scramblings")


def order_statistics(count: int, share: float, confidence: float) -> tuple[int, int]:
    """Ranks, from 1, of the ordered samples between which a quantile lies with this confidence, whatever the
    distribution; 0 and count + 1 where the samples give no bound (theory eq. U7)."""
    tail = 0.5 * (1 - confidence)
    low = int(binom.ppf(tail, count, share))
    high = int(binom.isf(tail, count, share)) + 1
    return (low if binom.cdf(low - 1, count, share) <= tail else low - 1), high


def _at(ordered: Array, rank: int) -> float:
    if rank < 1:
        return -np.inf
    return np.inf if rank > len(ordered) else float(ordered[rank - 1])


def _row_means(values: Array) -> Array:
    there = np.isfinite(values)
    counts = there.sum(axis=1)
    sums = np.where(there, values, 0.0).sum(axis=1)
    return sums[counts > 0] / counts[counts > 0]


def _student(own: Array, confidence: float) -> float:
    """Half the width of the t interval of a mean of independent numbers."""
    if len(own) < 2:
        return np.inf
    quantile = float(student.ppf(0.5 + 0.5 * confidence, len(own) - 1))
    return quantile * float(np.std(own, ddof=1)) / np.sqrt(len(own))
