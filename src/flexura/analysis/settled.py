"""Slopes of internal forces that are nothing but round-off, as symmetry leaves them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.duals import Dual, plain

Array = NDArray[np.float64]

STILL = 1e-10
"""Change of a force by a parameter as large as itself, over the largest force in the member, that is none."""


def settled(parameters: Mapping[str, Any], force: Any, length: Any) -> Any:
    """Internal forces (i, m, stations, k, 6) of members (m,) with slopes of round-off put to zero, as differences of
    equal ones must not decide which section is stressed most. Of parameters that are zero all slopes stay."""
    if not isinstance(force, Dual):
        return force
    sizes = sum(np.abs(own.value * own.slope) for own in parameters.values() if isinstance(own, Dual))
    sizes = np.reshape(sizes, (-1, 1, 1, 1, 1, 1))
    reach = plain(length)[:, None, None, None] * np.array([0.0, 0, 0, 1, 1, 1]) + np.array([1.0, 1, 1, 0, 0, 0])
    largest = np.abs(force.value / reach).max(axis=(2, 4), keepdims=True) * reach
    noise = (np.abs(force.slope) * sizes <= STILL * largest) & (sizes > 0)
    return Dual(force.value, np.where(noise, 0.0, force.slope))
