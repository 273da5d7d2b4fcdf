"""Answers for a block of designs, filled in by those who work them out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.records import Record

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Answers(Record):
    """What was asked of each of some designs, SI.

    `value` (designs, q), NaN where a quantity could not be worked out, for which `reason` (designs,) has the words,
    empty where nothing is to be said. `lower` and `upper` (designs, q) are proven bounds, NaN where none are claimed;
    `is_proven` (designs,) says that there are some, all as narrow as asked for.
    """

    value: Array
    lower: Array
    upper: Array
    is_proven: NDArray[np.bool_]
    reason: NDArray[np.object_]

    @staticmethod
    def of(designs: int, quantities: int) -> Answers:
        """Answers that are still to be worked out."""
        value, lower, upper = np.full((3, designs, quantities), np.nan)
        return Answers(value, lower, upper, np.ones(designs, dtype=bool), np.full(designs, "", dtype=object))

    def say(self, design: int, text: str) -> None:
        """Add a reason for a design, once."""
        said = self.reason[design]
        if text not in said.split("; "):
            self.reason[design] = f"{said}; {text}" if said else text
