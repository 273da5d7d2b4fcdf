"""What is proven about frequencies: an interval for each, and how many there are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.results import Tabular

Array = NDArray[np.float64]

HERTZ = 2 * np.pi


@dataclass(frozen=True, repr=False)
class Certificate(Tabular):
    """What is proven about the frequencies of a low-order model against its full-order model.

    `lower_hz` and `upper_hz` (k,) enclose a frequency of the full-order model for each of `frequency_hz` (k,): where
    `is_indexed`, the frequency of the same number, counted from the lowest; elsewhere some frequency. `count`
    frequencies of the full-order model lie below `below_hz`, and `found` of the low-order model; where not
    `is_counted`, round-off hides how many, and `count` is the most there can be.
    """

    _shown = ("count", "below_hz", "is_complete")

    frequency_hz: Array
    lower_hz: Array
    upper_hz: Array
    is_indexed: NDArray[np.bool_]
    below_hz: float
    count: int
    found: int
    is_counted: bool = True

    @property
    def missing(self) -> int:
        """How many frequencies below `below_hz` the low-order model lacks."""
        return self.count - self.found

    @property
    def is_complete(self) -> bool:
        """True when it is proven that no frequency below `below_hz` is missing."""
        return self.is_counted and self.missing == 0

    @property
    def error_bound(self) -> Array:
        """Proven bound (k,) on the relative distance of each frequency from the full-order one in its interval."""
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.maximum(self.upper_hz - self.frequency_hz, self.frequency_hz - self.lower_hz) / self.lower_hz
        return np.where(self.upper_hz == self.lower_hz, 0.0, np.where(self.lower_hz > 0, off, np.inf))

    def _data(self) -> dict[str, Any]:
        return {**super()._data(), "missing": self.missing, "is_complete": self.is_complete}

    def _columns(self) -> dict[str, Any]:
        return {
            "frequency [Hz]": self.frequency_hz,
            "lower [Hz]": self.lower_hz,
            "upper [Hz]": self.upper_hz,
            "is indexed": self.is_indexed,
        }
