"""Natural frequencies of blocks of designs, each with a proven interval."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.reduction import independent_frequencies
from flexura.study.questions.answers import Bounded
from flexura.study.questions.designs import Block

Array = NDArray[np.float64]


class Frequencies:
    """The `n` lowest frequencies of a block of designs and their bounds, `bounded` (designs, n), Hz, NaN where there
    are none, for which `failed` has the reasons by the number of the design."""

    def __init__(self, block: Block, n: int, tolerance: float) -> None:
        self.bounded = Bounded(*np.full((3, block.count, n), np.nan))
        self.failed = block.divided(lambda designs: self._solve(block, designs, tolerance))

    def _solve(self, block: Block, designs: NDArray[np.intp], tolerance: float) -> None:
        n = self.bounded.hertz.shape[1]
        found = independent_frequencies(block.plan, block.some(designs), n=n, tolerance=tolerance)
        for own, bound in zip(self.bounded, found, strict=True):
            own[designs] = bound

    def of(self, design: int) -> Bounded:
        """Those of one design (n,)."""
        return Bounded(*(own[design] for own in self.bounded))
