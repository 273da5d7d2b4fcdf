"""What a study works out: designs by number, whichever way they are found."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from flexura.study.space.variables import Variable


class Designs(Protocol):
    """Designs that are counted from 0, each a function of its number. Is pickled."""

    @property
    def variables(self) -> tuple[Variable, ...]:
        """What varies."""
        ...

    @property
    def size(self) -> int:
        """How many designs there are."""
        ...

    def designs(self, start: int, stop: int) -> dict[str, NDArray[np.float64]]:
        """Values, SI, of the designs start ... stop - 1, (stop - start,) for every variable by name."""
        ...

    def describe(self) -> dict[str, Any]:
        """Plain data that tell them from every other set of designs."""
        ...
