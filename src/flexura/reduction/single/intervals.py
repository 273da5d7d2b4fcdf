"""What is proven about frequencies: an interval for each, and how many there are."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.results import Tabular
from flexura.tables import Facts, Table, counted, in_hz

HERTZ = 2 * np.pi

RESOLVED = 1e-6
"""Relative differences below this are lost in the round-off of the full-order solution."""


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

    @property
    def text(self) -> str:
        """Whether anything is missing, in words."""
        if not self.is_counted:
            return f"round-off hides whether a mode below {in_hz(self.below_hz)} is missing"
        if not self.missing:
            return f"no mode is missing below {in_hz(self.below_hz)}"
        return f"{counted(self.missing, 'mode')} MISSING below {in_hz(self.below_hz)}"

    def _data(self) -> dict[str, Any]:
        return {**super()._data(), "missing": self.missing, "is_complete": self.is_complete}

    def _title(self) -> str:
        return self.text

    def _view(self) -> Iterator[Facts | Table]:
        found = (self.frequency_hz.tolist(), self.lower_hz, self.upper_hz, self.is_indexed)
        proofs = [
            proven_text(hz, (float(lower), float(upper) if np.isfinite(upper) else None), bool(indexed), upper == 0)
            for hz, lower, upper, indexed in zip(*found, strict=True)
        ]
        columns = {"mode": range(1, len(proofs) + 1), "frequency [Hz]": self.frequency_hz, "proven": proofs}
        yield Table(columns, "frequencies")

    def _columns(self) -> dict[str, Any]:
        return {
            "frequency [Hz]": self.frequency_hz,
            "lower [Hz]": self.lower_hz,
            "upper [Hz]": self.upper_hz,
            "is indexed": self.is_indexed,
        }


def proven_text(hz: float, interval: tuple[float | None, float | None], is_indexed: bool, is_rigid: bool) -> str:
    """How far from a full-order frequency of the same number a frequency can be; else the interval that has some."""
    lower, upper = interval
    if not is_indexed:
        return f"{lower or 0:.4g} to {'?' if upper is None else f'{upper:.4g}'} Hz"
    if is_rigid:
        return "rigid motion"
    if not lower or upper is None or not hz:
        return "not proven"
    error = 100 * max(upper / hz - 1, 1 - lower / hz, RESOLVED)
    digit = 10.0 ** (math.floor(math.log10(error)) - 1)
    error = math.ceil(error / digit) * digit
    return f"within {error:.2g} %" if error < 99.5 else f"within {error:.0f} %"
