"""Answers for a block of designs, filled in by those who work them out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.records import Record

TOLERANCE = 1e-3
"""Relative error within which frequencies are to be proven."""


class Bounded(NamedTuple):
    """Frequencies (..., n), Hz, with their lower and upper bounds, NaN where nothing is proven."""

    hertz: Array
    lower: Array
    upper: Array


@dataclass(frozen=True, repr=False)
class Answers(Record):
    """What was asked of each of some designs, SI.

    `value` (designs, q), NaN where a quantity could not be worked out, for which `reason` (designs,) has the words. It
    also says where the mode that moves something is in doubt, beside a value, and is empty otherwise. `lower` and
    `upper` (designs, q) are proven bounds, NaN where none are claimed; `is_proven` (designs,) says that frequencies
    were asked for and that all of them are proven within 0.1 %. `mode` (designs, q) is the number of the mode of a
    frequency, from 0, and -1 of anything else.
    """

    value: Array
    lower: Array
    upper: Array
    is_proven: NDArray[np.bool_]
    reason: NDArray[np.object_]
    mode: NDArray[np.intp]

    @staticmethod
    def of(designs: int, quantities: int) -> Answers:
        """Answers that are still to be worked out."""
        value, lower, upper = np.full((3, designs, quantities), np.nan)
        proven, reason = np.zeros(designs, dtype=bool), np.full(designs, "", dtype=object)
        return Answers(value, lower, upper, proven, reason, np.full((designs, quantities), -1))

    def tell(self, designs: int | slice, place: int, found: Bounded, number: int) -> None:
        """Take frequency `number`, from 0, of those that were found as the answer at a place."""
        for own, bound in zip((self.value, self.lower, self.upper), found, strict=True):
            own[designs, place] = bound[..., number]
        self.mode[designs, place] = number

    def say(self, design: int, text: str) -> None:
        """Add a reason for a design, once."""
        said = self.reason[design]
        if text not in said.split("; "):
            self.reason[design] = f"{said}; {text}" if said else text


def are_proven(value: Array, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Where bounds are within 0.1 %, or a value is proven to be zero."""
    with np.errstate(all="ignore"):
        return (upper - lower <= TOLERANCE * lower) | ((value == 0) & (lower == 0))
