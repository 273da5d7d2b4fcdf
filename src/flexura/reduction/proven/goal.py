"""What a reduction to a tolerance must get right, and what it says where it cannot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.linalg import bracket, lowest_modes
from flexura.reduction.chains import ChainedModel
from flexura.reduction.proven.certificate import HERTZ, Certificate
from flexura.tables import counted, in_hz

Coordinates = Literal["modal", "physical", "substructures"]


@dataclass(frozen=True)
class Goal:
    """What a reduced model must get right within `tolerance`: the lowest `modes`, or all up to `up_to` Hz.

    Where round-off stands in the way, the closest model is good enough for `best_effort`. Raises OptionError for
    numbers that cannot be met.
    """

    tolerance: float
    up_to: float | None = None
    modes: int | None = None
    best_effort: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite(self.tolerance) and 0 < self.tolerance < 1):
            raise OptionError(f"tolerance is a relative error between 0 and 1, such as 1e-3, not {self.tolerance}")
        if self.up_to is not None and not (np.isfinite(self.up_to) and self.up_to > 0):
            raise OptionError(f"up_to is a positive frequency in Hz, not {self.up_to}")
        if self.modes is not None and self.modes < 1:
            raise OptionError(f"the number of modes is a whole number, at least 1, not {self.modes!r}")

    @property
    def limit(self) -> float:
        """The squared frequency up to which everything is asked for, (rad/s)^2."""
        return (HERTZ * (self.up_to or 0.0)) ** 2

    def count(self, values: Array) -> int:
        """How many of ascending squared frequencies (k,) are asked for."""
        if self.modes is not None:
            return min(self.modes, len(values))
        return int((values <= self.limit).sum())

    def missed(self, found: Certificate) -> NDArray[np.bool_]:
        """Which frequencies (k,) of a certificate are not proven to the tolerance."""
        return (found.error_bound > self.tolerance) & (found.lower_hz > 0)

    def refuse_empty(self, full: ChainedModel) -> None:
        """Raise OptionError where no frequency lies up to the limit."""
        if self.up_to is not None and bracket(full.pencil, self.limit).most == 0:
            first = np.sqrt(lowest_modes(full.pencil, 1, full.rigid_motions).values[0]) / HERTZ
            raise OptionError(f"no natural frequency lies below {self.up_to:g} Hz: the lowest is {in_hz(first)}")


def proven(found: Certificate) -> str:
    """How many frequencies a certificate has proven, and how closely, in words."""
    worst = float(found.error_bound[found.frequency_hz > 0].max(initial=0.0))
    return f"{counted(found.count, 'frequency')} below {in_hz(found.below_hz)}, proven within {worst:.1g}"


def smallest(n: int) -> str:
    """Why a model of order n is the smallest, in words."""
    return f"order {n}: no smaller model has the {counted(n, 'frequency')} that the inertia count proves"
