"""Vectors of numbers from what a caller gave."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.errors import OptionError


def finite_numbers(what: str, value: ArrayLike, n: int) -> Array:
    """A vector (n,) from what a caller gave. Raises OptionError when it is none."""
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise OptionError(f"{what} is a list of {n} finite numbers, not {value!r}") from None
    if found.shape != (n,) or not np.isfinite(found).all():
        raise OptionError(f"{what} is a list of {n} finite numbers, not {value!r}")
    return found
