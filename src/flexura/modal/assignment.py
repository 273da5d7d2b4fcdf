"""Which of one list goes with which of another, one to one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Index


def assignment(cost: NDArray[Any]) -> tuple[Index, Index]:
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


def best_pairs(gain: NDArray[Any]) -> Index:
    """For every row (n,) the column that it is paired with, one to one, so that the sum of `gain` is largest.

    A pair whose gain is not positive is none: such rows have -1.
    """
    rows, columns = assignment(-gain)
    is_pair = gain[rows, columns] > 0
    partner = np.full(len(gain), -1, dtype=np.intp)
    partner[rows[is_pair]] = columns[is_pair]
    return partner
