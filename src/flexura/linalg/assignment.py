"""Which of one list goes with which of another."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def assignment(cost: NDArray[Any]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns, one to one, with the least sum of `cost`, rows ascending; as many as the shorter side has.

    Where the least of every row lies in a column of its own no other choice is less; else the algorithm of Jonker and
    Volgenant (1987) decides.
    """
    if cost.shape[0] > cost.shape[1]:
        columns, rows = assignment(cost.T)
        order = np.argsort(rows)
        return rows[order], columns[order]
    least = cost.argmin(axis=1) if cost.size else np.zeros(cost.shape[0], dtype=np.intp)
    if len(np.unique(least)) == len(least):
        return np.arange(len(least)), least
    from scipy.optimize import linear_sum_assignment  # slow to import

    return linear_sum_assignment(cost)
