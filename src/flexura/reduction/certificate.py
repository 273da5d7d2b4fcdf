"""Certificates: for every reduced frequency an interval that is proven to contain one of the full-order model."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, Enclosures, count_below, enclose, lowest, residual_intervals
from flexura.reduction.model import LowOrderModel
from flexura.structure import FullOrderModel

Array = NDArray[np.float64]

CLUSTER = 1e-3
"""Relative distance of two eigenvalues below which no shift is set between them: so close to both it loses digits."""

REACH = 1.5
"""Largest ratio of the shift to the last eigenvalue that is certified: a distant shift widens the intervals."""

HERTZ = 2 * np.pi


@dataclass(frozen=True)
class Certificate:
    """What is proven about the frequencies of a low-order model against its full-order model.

    `lower_hz` and `upper_hz` (k,) enclose a frequency of the full-order model for each of `frequency_hz` (k,): where
    `is_indexed`, the frequency of the same number, counted from the lowest; elsewhere some frequency. `count`
    frequencies of the full-order model lie below `below_hz`, and `found` of the low-order model.
    """

    frequency_hz: Array
    lower_hz: Array
    upper_hz: Array
    is_indexed: NDArray[np.bool_]
    below_hz: float
    count: int
    found: int

    @property
    def missing(self) -> int:
        """How many frequencies below `below_hz` the low-order model lacks."""
        return self.count - self.found

    @property
    def is_complete(self) -> bool:
        """True when it is proven that no frequency below `below_hz` is missing."""
        return self.missing == 0

    @property
    def error_bound(self) -> Array:
        """Proven bound (k,) on the relative distance of each frequency from the full-order one in its interval."""
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.maximum(self.upper_hz - self.frequency_hz, self.frequency_hz - self.lower_hz) / self.lower_hz
        return np.where(self.upper_hz == self.lower_hz, 0.0, np.where(self.lower_hz > 0, off, np.inf))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; an unproven end of an interval is None."""
        data = {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in asdict(self).items()}
        for key in ("lower_hz", "upper_hz"):
            data[key] = [value if np.isfinite(value) else None for value in data[key]]
        return data | {"missing": self.missing, "is_complete": self.is_complete}


def certify(
    low: LowOrderModel, full: FullOrderModel | None = None, *, n: int = 6, up_to: float | None = None
) -> Certificate:
    """Prove intervals for the `n` lowest frequencies of a low-order model, or for all up to `up_to` Hz.

    Upper bounds are Ritz values, lower bounds those of Lehmann and Maehly; where the low-order model misses a mode
    the intervals of Krylov and Weinstein remain (theory eqs. C1-C5). `full` is assembled when it is not given.
    Raises OptionError for impossible options and SolverError when a factorisation fails.
    """
    if n < 1 or (up_to is not None and not (np.isfinite(up_to) and up_to > 0)):
        raise OptionError("a certificate is for at least one mode, and up to a positive frequency")
    if up_to is not None:
        n = max(count_below(low.K, low.M, (HERTZ * up_to) ** 2), 1)
    K, M = (full.K, full.M) if full is not None else low.plan.full_order(low.values, low.geometry)
    pairs = lowest(low.K, low.M, min(n + 4, low.order))
    found = Eigenpairs(pairs.values, low.recover(pairs.vectors))
    return certificate(K, M, found, n, up_to)


def certificate(K: Any, M: Any, pairs: Eigenpairs, n: int, up_to: float | None = None) -> Certificate:
    """Certificate of the `n` lowest of some Ritz pairs of K x = lambda M x, the next ones known to see the gaps.

    A cluster that n cuts is certified as a whole. The shift is beyond `up_to` Hz if that is given.
    """
    values = pairs.values[np.isfinite(pairs.values)]
    n = cluster_end(values, min(n, len(values)))
    vectors = pairs.vectors[:, :n]
    whole = enclose(K, M, vectors, shift_beyond(values, n, up_to))
    if whole.is_complete:
        return from_enclosures(values[:n], whole)
    lower, upper = residual_intervals(K, M, Eigenpairs(values[:n], vectors))
    indexed = np.zeros(n, dtype=bool)
    p = _complete_prefix(K, M, values, n)
    if p:
        part = enclose(K, M, vectors[:, :p], shift_beyond(values, p))
        if part.is_complete:
            lower[:p], upper[:p], indexed[:p] = part.lower, part.upper, True
    return _certificate(values[:n], (lower, upper, indexed), whole)


def from_enclosures(values: Array, whole: Enclosures) -> Certificate:
    """Certificate of Ritz values (n,) that are enclosed number by number.

    Raises SolverError when the inertia count is smaller than their number, which exact arithmetic excludes.
    """
    return _certificate(values, (whole.lower, whole.upper, np.ones(len(values), dtype=bool)), whole)


def _certificate(values: Array, bounds: tuple[Array, Array, NDArray[np.bool_]], whole: Enclosures) -> Certificate:
    if whole.count < len(values):
        raise SolverError("the inertia count contradicts the Ritz values: the stiffness has lost all its digits")
    lower, upper = (np.where(np.isfinite(b), np.sqrt(np.maximum(b, 0)), b) / HERTZ for b in bounds[:2])
    hz = np.sqrt(np.maximum(values, 0)) / HERTZ
    below = float(np.sqrt(whole.rho)) / HERTZ
    return Certificate(hz, np.maximum(lower, 0.0), upper, bounds[2], below, whole.count, len(values))


def shift_beyond(values: Array, n: int, up_to: float | None = None) -> float:
    """A shift between eigenvalue n and the next of ascending `values`, not far beyond the former or `up_to` Hz."""
    base = float(values[n - 1])
    if up_to is not None:
        base = max(base, (HERTZ * up_to) ** 2)
    following = float(values[n]) if n < len(values) else np.inf
    if base <= 0:
        return following / 2 if np.isfinite(following) else 1.0
    return (base + min(max(following, base), REACH * base)) / 2


def cluster_end(values: Array, n: int) -> int:
    """The least number from n on after which there is a gap."""
    while n < len(values) and values[n] - values[n - 1] <= CLUSTER * values[n]:
        n += 1
    return n


def _complete_prefix(K: Any, M: Any, values: Array, n: int) -> int:
    """How many of the lowest Ritz values are proven to have every eigenvalue below them, by bisection over the gaps."""
    gaps = [k for k in range(1, n) if values[k] - values[k - 1] > CLUSTER * values[k]]
    low, high = 0, len(gaps)
    while low < high:
        middle = (low + high) // 2
        p = gaps[middle]
        low, high = (middle + 1, high) if count_below(K, M, shift_beyond(values, p)) == p else (low, middle)
    return gaps[low - 1] if low else 0
