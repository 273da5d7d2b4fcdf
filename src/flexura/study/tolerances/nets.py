"""Scrambled Sobol' nets, and what they tell: intervals of means, shares and percentiles, and Sobol indices."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from flexura.arrays import Array, Bools, Index
from flexura.errors import OptionError
from flexura.records import Record
from flexura.study.space import Sobol, Variable
from flexura.thresholds import ROUND_OFF

FEWEST_SCRAMBLINGS = 12
"""Below 24 unless the nets would exceed `LARGEST_NET`."""

LARGEST_NET = 4096
"""Points of a scrambling at most: more samples are more scramblings, and memory stays flat."""

FEWEST_SAMPLES = 2 * FEWEST_SCRAMBLINGS
PART_FOR_INDICES = 4
"""One point in so many of a scrambling is also one of the base samples of Sobol indices."""

FEWEST_FOR_INDICES = 4
"""Points of a scrambling at least that are base samples."""


@dataclass(frozen=True, repr=False, eq=False)
class ScrambledNets(Record):
    """Designs from R independently scrambled Sobol' nets of n points, then those that Sobol indices take beside them.

    The first R n designs, scrambling by scrambling, are the sample (A). With `index_points` (m) a scrambling, the first
    m points of each come again with other sizes (B) and with the sizes of one group alone from B (AB), which are the
    last half of the coordinates of the same net: R m (groups + 1) designs more. `groups` are positions of the variables
    that belong to one tolerance.
    """

    _shown = ("scramblings", "points", "index_points", "variables")

    variables: tuple[Variable, ...]
    groups: tuple[tuple[int, ...], ...]
    scramblings: int
    points: int
    index_points: int
    seed: int

    @classmethod
    def of(
        cls, variables: Sequence[Variable], groups: Sequence[Sequence[int]], samples: int, *, seed: int, indices: bool
    ) -> ScrambledNets:
        """Nets with at least so many samples, more by a twelfth at most. Raises OptionError for too few of them."""
        if not isinstance(samples, int | np.integer) or samples < FEWEST_SAMPLES:
            raise OptionError(f"samples is a whole number from {FEWEST_SAMPLES}, not {samples!r}")
        if not isinstance(seed, int | np.integer) or seed < 0:
            raise OptionError(f"a seed is a whole number from 0, not {seed!r}")
        points = min(2 ** ((int(samples) // FEWEST_SCRAMBLINGS).bit_length() - 1), LARGEST_NET)
        base = max(points // PART_FOR_INDICES, FEWEST_FOR_INDICES) if indices else 0
        places = tuple(tuple(group) for group in groups)
        return cls(tuple(variables), places, -(-int(samples) // points), points, min(base, points), int(seed))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that vary."""
        return tuple(variable.name for variable in self.variables)

    @property
    def samples(self) -> int:
        """Designs that are the sample itself."""
        return self.scramblings * self.points

    @property
    def size(self) -> int:
        """How many designs there are."""
        return self.samples + self.scramblings * self.index_points * (len(self.groups) + 1)

    def designs(self, start: int, stop: int) -> dict[str, Array]:
        """Values, SI, of the designs start ... stop - 1, (stop - start,) for every variable by name."""
        if not 0 <= start <= stop <= self.size:
            raise OptionError(f"designs {start} to {stop} are asked for; there are {self.size}, counted from 0")
        points = np.concatenate(
            [np.empty((0, len(self.variables))), *(self._points(*run) for run in self._runs(start, stop))]
        )
        return {variable.name: variable.at(points[:, axis]) for axis, variable in enumerate(self.variables)}

    def _runs(self, start: int, stop: int) -> Iterator[tuple[int, int, int, int]]:
        """Runs of designs: scrambling, matrix (-2 is A, -1 is B, others AB with that group of B), first and last + 1
        point."""
        at = start
        while at < stop:
            if at < self.samples:
                (scrambling, first), matrix, length = divmod(at, self.points), -2, self.points
            else:
                length = self.index_points
                run, first = divmod(at - self.samples, length)
                scrambling, matrix = divmod(run, len(self.groups) + 1)
                matrix -= 1
            last = min(first + stop - at, length)
            yield scrambling, matrix, first, last
            at += last - first

    def _points(self, scrambling: int, matrix: int, first: int, last: int) -> Array:
        axes = len(self.variables)
        both = _net(self.points, (2 if self.index_points else 1) * axes, (self.seed << 32) + scrambling)(first, last)
        A, B = both[:, :axes], both[:, axes:]
        if matrix == -2:
            return A
        if matrix == -1:
            return B
        from_B = np.isin(np.arange(axes), self.groups[matrix])
        return np.where(from_B, B, A)

    def sorted_out(self, values: Array) -> tuple[Array, Array, Array]:
        """Values (size, q) of all designs as those of the sample (R, n, q), of B (R, m, q) and of AB (g, R, m, q)."""
        R, q = self.scramblings, values.shape[-1]
        A = values[: self.samples].reshape(R, self.points, q)
        rest = values[self.samples :].reshape(R, len(self.groups) + 1, self.index_points, q)
        return A, rest[:, 0], np.moveaxis(rest[:, 1:], 1, 0)

    def describe(self) -> dict[str, Any]:
        """Plain data that tell it from every other set of designs."""
        return {
            "sampling": "scrambled nets",
            "scramblings": self.scramblings,
            "points": self.points,
            "index_points": self.index_points,
            "groups": [list(group) for group in self.groups],
            "seed": self.seed,
            "first": _net(self.points, len(self.variables), self.seed << 32)(0, 1)[0].tolist(),
            "variables": [variable.describe() for variable in self.variables],
        }


@lru_cache(maxsize=8)
def _net(points: int, axes: int, seed: int) -> Sobol:
    """One scrambling."""
    return Sobol.of(points, axes, seed)


Method = Literal["scramblings", "Clopper-Pearson", "order statistics"]

FEWEST_BEYOND = 5
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
    is_known = np.isfinite(values)
    counts, sums = is_known.sum(axis=1), np.where(is_known, values, 0.0).sum(axis=1)
    value, half = float(np.nanmean(values)), _student(sums[counts > 0] / counts[counts > 0], confidence)
    return Estimate(value, value - half, value + half, "scramblings")


def share_interval(passes: Bools, confidence: float) -> Estimate:
    """The share of True among (R, n), with its interval.

    Student's t of the shares of the scramblings, no narrower than what these leave open when they agree (theory eqs.
    U3, U4); with fewer than five points of a scrambling on one side, that of Clopper and Pearson (1934), eq. 4 of
    whom holds for independent samples (theory eq. U5).
    """
    R, n = passes.shape
    count, N = int(np.sum(passes)), passes.size
    value = count / N
    if min(count, N - count) < FEWEST_BEYOND * R or n == 1:
        low, high = clopper_pearson(count, N, confidence)
        return Estimate(value, low, high, "Clopper-Pearson")
    half = share_half_width(passes, confidence)
    return Estimate(value, max(value - half, 0.0), min(value + half, 1.0), "scramblings")


def share_half_width(passes: Bools, confidence: float) -> float:
    """Half the width of Student's interval of a share of (R, n) (theory eqs. U3, U4)."""
    R, n = passes.shape
    open_ = (1 - (0.5 * (1 - confidence)) ** (1 / R)) / n
    return max(_student(np.mean(passes, axis=1), confidence), open_)


def clopper_pearson(count: int, of: int, confidence: float) -> tuple[float, float]:
    """The interval of a share of independent samples that holds it at least so often (Clopper and Pearson 1934).

    All of 4096 samples leave open a share of 1 - 0.9991: what is called the rule of three.
    """
    from scipy.stats import beta  # slow to import

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
    if min(share, 1 - share) * n < FEWEST_BEYOND or n == 1:
        low, high = order_statistics(N, share, confidence)
        return Estimate(value, _at(ordered, low), _at(ordered, high), "order statistics")
    half = share_half_width(values <= value, confidence)
    low, high = int(np.floor(N * (share - half))), int(np.ceil(N * (share + half))) + 1
    return Estimate(value, _at(ordered, low), _at(ordered, high), "scramblings")


def order_statistics(count: int, share: float, confidence: float) -> tuple[int, int]:
    """Ranks, from 1, of the ordered samples between which a quantile lies with this confidence, whatever the
    distribution; 0 and count + 1 where the samples give no bound (theory eq. U7)."""
    from scipy.stats import binom  # slow to import

    tail = 0.5 * (1 - confidence)
    low = int(binom.ppf(tail, count, share))
    high = int(binom.isf(tail, count, share)) + 1
    return (low if binom.cdf(low - 1, count, share) <= tail else low - 1), high


def _at(ordered: Array, rank: int) -> float:
    if rank < 1:
        return -np.inf
    return np.inf if rank > len(ordered) else float(ordered[rank - 1])


def _student(means: Array, confidence: float) -> float:
    """Half the width of the t interval of a mean of independent numbers."""
    from scipy.stats import t as student  # slow to import

    if len(means) < 2:
        return np.inf
    quantile = float(student.ppf(0.5 + 0.5 * confidence, len(means) - 1))
    return quantile * float(np.std(means, ddof=1)) / np.sqrt(len(means))


@dataclass(frozen=True)
class SobolIndices:
    """First-order and total indices (g, q) of g tolerances for q quantities; `_half` half the widths of intervals.

    `used` (q,) is the number of base samples that have values in all their matrices. NaN where nothing scatters.
    """

    first: Array
    first_half: Array
    total: Array
    total_half: Array
    used: Index


def indices_of(A: Array, B: Array, AB: Array, confidence: float) -> SobolIndices:
    """Sobol indices from values (R, n, q) at two samples and (g, R, n, q) at those of A with group g from B.

    Numerators of Saltelli et al. (2010, table 2 b, f), which `scipy.stats.sobol_indices` has for samples of a power of
    two without gaps, over the variance that differences of A and B have: a tolerance that answers for all has 1,
    whatever the samples. Intervals by the jackknife over the R independent scramblings (theory eqs. U8-U10). A base
    sample of which a design failed is left out.
    """
    g, _, _, q = AB.shape
    estimates = np.full((4, g, q), np.nan)
    used = np.zeros(q, dtype=np.intp)
    for k in range(q):
        is_known = np.isfinite(A[..., k]) & np.isfinite(B[..., k]) & np.isfinite(AB[..., k]).all(axis=0)
        rows = [(A[r, w, k], B[r, w, k], AB[:, r, w, k]) for r, w in enumerate(is_known) if w.any()]
        used[k] = int(is_known.sum())
        if len(rows) > 1:
            estimates[:, :, k] = _with_intervals(rows, confidence)
    first, first_half, total, total_half = estimates
    return SobolIndices(first, first_half, total, total_half, used)


def _with_intervals(rows: list[tuple[Array, Array, Array]], confidence: float) -> Array:
    """First-order indices, half widths, total indices, half widths (4, g) of one quantity."""
    from scipy.stats import t as student  # slow to import

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
    A, B, AB = ((values - both.mean()) / scale for values in (A, B, AB))
    variance = 0.5 * float(np.mean((A - B) ** 2))
    return np.stack([np.mean(B * (AB - A), axis=-1), 0.5 * np.mean((A - AB) ** 2, axis=-1)]) / variance
