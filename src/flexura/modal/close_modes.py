"""Modes of close or repeated frequencies: any mixture of their shapes may be found in place of them."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array, Index


def close_groups(frequency: Array, gap: float) -> tuple[Index, ...]:
    """Groups of modes with no gap wider than `gap`, relative, in order of frequency or of eigenvalue."""
    if not len(frequency):
        return ()
    order = np.argsort(frequency, kind="stable")
    ascending = frequency[order]
    return tuple(np.split(order, np.flatnonzero(np.diff(ascending) > gap * np.abs(ascending[1:])) + 1))
