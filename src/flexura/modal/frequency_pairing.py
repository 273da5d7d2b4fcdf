"""Which frequency of one model is which of another where there are no shapes."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array

SKIP = 0.02
"""Price of a reference mode without a partner, as a logarithm of frequency."""

STRAY = 0.2
"""Price of a frequency without a partner."""


def in_order(reference: Array, frequencies: Array) -> list[int]:
    """Pair ascending frequencies without crossing, so that the sum of |ln f/f_ref| is least.

    Modes on either side may be left out at a price, which is low for the reference's: a method is more likely to miss a
    mode than to invent one. Reference frequencies beyond the last pair cost nothing.
    """
    floor = 1e-6 * float(max(np.max(reference, initial=0.0), np.max(frequencies, initial=0.0), 1e-300))
    far = np.abs(np.log(np.asarray(frequencies) + floor)[:, None] - np.log(np.asarray(reference) + floor))
    k, n = far.shape
    cost = np.full((k + 1, n + 1), np.inf)
    step = np.zeros((k + 1, n + 1), dtype=int)  # 0 a pair, 1 a reference skipped, 2 a frequency skipped
    cost[0], step[0] = SKIP * np.arange(n + 1), 1
    cost[:, 0], step[:, 0] = STRAY * np.arange(k + 1), 2
    for i in range(1, k + 1):
        for j in range(1, n + 1):
            choices = (cost[i - 1, j - 1] + far[i - 1, j - 1], cost[i, j - 1] + SKIP, cost[i - 1, j] + STRAY)
            step[i, j] = int(np.argmin(choices))
            cost[i, j] = choices[step[i, j]]
    partner = [-1] * k
    i, j = k, int(np.argmin(cost[k]))
    while i > 0:
        taken = step[i, j]
        if taken == 0:
            partner[i - 1] = j - 1
        i, j = i - int(taken != 1), j - int(taken != 2)
    return partner
