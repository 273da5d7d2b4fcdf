"""Variables between bounds, scaled to the unit cube."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array

DECADE = 10.0
"""A range whose ends are of one sign and so many times apart is scaled by its logarithm."""


@dataclass(frozen=True)
class Box:
    """P variables by name, between `low` and `high` (P,), SI; positions z (..., P) in it go from 0 to 1."""

    names: tuple[str, ...]
    low: Array
    high: Array

    @property
    def by_logarithm(self) -> NDArray[np.bool_]:
        """Which variables are scaled by their logarithm (P,)."""
        return (self.low > 0) & (self.high >= DECADE * self.low)

    def values(self, z: Array) -> Array:
        """SI values (..., P) at positions; those at a bound are the bound itself."""
        z = np.clip(z, 0.0, 1.0)
        low, high = np.where(self.by_logarithm, self.low, 1.0), np.where(self.by_logarithm, self.high, 1.0)
        x = np.where(self.by_logarithm, low * (high / low) ** z, self.low + z * (self.high - self.low))
        return np.where(z == 0, self.low, np.where(z == 1, self.high, np.clip(x, self.low, self.high)))

    def positions(self, x: Array) -> Array:
        """Positions (..., P) of SI values, those outside at the bound that they are beyond."""
        x = np.clip(x, self.low, self.high)
        own = self.by_logarithm
        low, high, at = np.where(own, self.low, 1.0), np.where(own, self.high, np.e), np.where(own, x, 1.0)
        return np.where(own, np.log(at / low) / np.log(high / low), (x - self.low) / (self.high - self.low))

    def rates(self, z: Array) -> Array:
        """dx/dz (P,) at a position."""
        own = self.by_logarithm
        ratio = np.where(own, self.high, 1.0) / np.where(own, self.low, 1.0)
        return np.where(own, self.values(z) * np.log(ratio), self.high - self.low)
