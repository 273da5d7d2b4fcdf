"""Natural frequencies of blocks of designs, each with a proven interval."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.errors import FlexuraError
from flexura.reduction import independent_frequencies
from flexura.study.questions.designs import Block, reason_of

Array = NDArray[np.float64]

TOLERANCE = 1e-3
"""Relative error within which frequencies are to be proven."""

FAILURES = (FlexuraError, ArithmeticError, np.linalg.LinAlgError, ValueError)
"""What a design that cannot be solved may end in."""


class Frequencies:
    """The `n` lowest frequencies of a block of designs and their bounds (designs, n), Hz, NaN where there are none, for
    which `failed` has the reasons by the number of the design."""

    def __init__(self, block: Block, n: int) -> None:
        self.hertz, self.lower, self.upper = np.full((3, block.count, n), np.nan)
        self.failed = dict(block.refused)
        designs = block.possible
        if not len(designs):
            return
        try:
            self._solve(block, designs)
        except FAILURES:
            for d in designs:
                try:
                    self._solve(block, np.array([d]))
                except FAILURES as error:
                    self.failed[int(d)] = reason_of(error)

    def _solve(self, block: Block, designs: NDArray[np.intp]) -> None:
        n = self.hertz.shape[1]
        with np.errstate(all="ignore"):
            found = independent_frequencies(block.plan, block.some(designs), n=n, tolerance=TOLERANCE)
        self.hertz[designs], self.lower[designs], self.upper[designs] = found

    @property
    def is_proven(self) -> NDArray[np.bool_]:
        """Where the interval of a frequency is within the tolerance (designs, n)."""
        with np.errstate(all="ignore"):
            return (self.upper - self.lower <= TOLERANCE * self.lower) | (self.hertz == 0)
