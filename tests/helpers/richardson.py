"""Derivatives by differences of high order, to hold exact ones against."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def derivative(
    function: Callable[[float], Array], at: float, steps: tuple[float, ...] = (0.04, 0.03), levels: int = 3
) -> tuple[Array, Array]:
    """The derivative of a function of one number, and how far it may be off: what other steps make of it.

    Central differences at steps that are halved, extrapolated (Richardson 1911); steps are relative to the number.
    """
    found = [_extrapolated(function, at, step * (abs(at) or 1.0), levels) for step in steps]
    return np.mean(found, axis=0), np.ptp(found, axis=0)


def _extrapolated(function: Callable[[float], Array], at: float, h: float, levels: int) -> Array:
    table = []
    for level in range(levels):
        own = h / 2**level
        table.append((np.asarray(function(at + own)) - np.asarray(function(at - own))) / (2 * own))
    for power in range(1, levels):
        table = [(4**power * b - a) / (4**power - 1) for a, b in pairwise(table)]
    return table[0]
