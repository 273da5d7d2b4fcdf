"""Natural frequencies as the points where a frequency-dependent matrix is singular."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.linalg import real_eigenvalues
from flexura.reduction import full_order_modes
from flexura.structure import FullOrderModel

MARGIN = 4
"""Modes of the finite element model beyond those wanted, to see the gaps between which contours run."""

PER_CONTOUR = 6
"""About how many frequencies a contour encloses."""

SPREAD = 4.0
"""Largest ratio of the ends of a contour, which decides how many points it needs."""


def natural_frequencies(
    problem: Callable[[complex], NDArray[Any]],
    model: FullOrderModel,
    count: int,
    poles: Callable[[float], int] = lambda _: 0,
    is_real: bool = True,
) -> Array:
    """The `count` lowest frequencies, Hz, at which problem(omega) is singular; zero ones are those of rigid motions.

    The finite element model tells where gaps are for the contours to run through, and starting values; how many
    frequencies lie inside a contour is decided by the contour. `poles(omega)` is the number of poles of det problem
    below a frequency, and `is_real` says that the matrix is real for real omega. Raises SolverError when they are not
    found.
    """
    guess = np.sqrt(full_order_modes(model, min(count + MARGIN, model.order)).values)
    rigid = int((guess == 0).sum())

    def watched(omega: complex) -> NDArray[Any]:
        checkpoint(len(found) / count)
        return problem(omega)

    found: list[float] = [0.0] * min(rigid, count)
    low = 0.3 * guess[rigid] if rigid < len(guess) else 0.0
    k = rigid
    while len(found) < count and k < len(guess):
        end = k + 1
        while end < len(guess) and end - k < PER_CONTOUR and guess[end] < SPREAD * max(low, guess[k] / 2):
            end += 1
        end = k + 1 + int(np.argmax(np.diff(guess[k : end + 1]))) if end < len(guess) and end > k + 1 else end
        high = (guess[end - 1] + guess[end]) / 2 if end < len(guess) else 1.1 * guess[end - 1]
        inside = poles(high) - poles(low)
        found += real_eigenvalues(
            watched, float(low), float(high), guess[k:end], poles=inside, is_real=is_real
        ).tolist()
        low, k = high, end
    return np.array(found[:count]) / (2 * np.pi)
