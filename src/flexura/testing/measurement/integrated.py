"""Receptances that were accelerations divided by omega^2: what noise and offset make of the lines near 0 Hz."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array, Complex

NEAR_ZERO = 0.02
"""A band begins near 0 Hz when it does so below this share of its end."""

GROWN = 3.0
"""Responses have grown towards 0 Hz when the first lines exceed those at ten times their frequency by so much."""

NOISY = 0.5
"""Lines at which noise is more than this share of the response say nothing."""

RUN = 9
"""Lines over which noise and response are compared."""

LOWEST = 0.25
"""Lines are left out up to this share of the band at most."""


def grows_towards_zero(hz: Array, H: Complex) -> bool:
    """Whether most responses (f, p, m) of a band from near 0 Hz grow towards it, as accelerations over omega^2 do.

    The receptance of something held is flat there. What floats grows, too, but in phase from line to line.
    """
    if hz[0] > NEAR_ZERO * hz[-1] or len(hz) < 4 * RUN:
        return False
    first = np.sqrt((np.abs(H[:3]) ** 2).mean(axis=0))
    at = int(np.searchsorted(hz, 10 * hz[1]))
    later = np.median(np.abs(H[max(at - 3, 3) : at + RUN]), axis=0)
    return bool(np.median(first > GROWN * later) > 0.5)


def noisy_until(A: Complex) -> int:
    """How many of the first lines of accelerances (f, p, m) are mostly noise, by how uneven neighbouring lines are.

    The second difference of white noise over three lines has six times its variance.
    """
    level = (np.abs(A[1:-1]) ** 2).sum(axis=(1, 2))
    uneven = (np.abs(A[:-2] - 2 * A[1:-1] + A[2:]) ** 2).sum(axis=(1, 2)) / 6
    window = np.ones(RUN)
    share = np.convolve(uneven, window, mode="valid") / np.maximum(np.convolve(level, window, mode="valid"), 1e-300)
    clear = np.flatnonzero(share < NOISY**2)
    stop = int(clear[0]) if len(clear) else len(A)
    return 0 if stop == 0 else min(stop + RUN // 2, int(LOWEST * len(A)))
