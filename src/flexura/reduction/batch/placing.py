"""Matrices of chains and discrete elements where these are placed, and the round-off of placing them."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.reduction.batch.arrow import ROUNDING
from flexura.structure import DiscreteElement


def joined(A: Array) -> Array:
    """(..., copies, c, n, n) as (..., copies c, n, n)."""
    return A.reshape(*A.shape[:-4], A.shape[-4] * A.shape[-3], *A.shape[-2:])


def bordered(L: Array, kept: int) -> Array:
    """Maps (..., 12, 12) with an identity for so many kept motions."""
    if not kept:
        return L
    wide = np.zeros((*L.shape[:-2], 12 + kept, 12 + kept))
    wide[..., :12, :12] = L
    wide[..., np.arange(12, 12 + kept), np.arange(12, 12 + kept)] = 1.0
    return wide


def stacked(element: DiscreteElement, designs: int) -> Array:
    """K, M and R (3, designs, 1, m, m) of a discrete element."""
    m = 6 * len(element.nodes)
    A = np.zeros((3, designs, 1, m, m))
    for out, own in zip(A, (element.K, element.M), strict=False):
        if own is not None:
            out[:, 0] = own
    return A


def placing_error(A: Array, size: Array) -> Array:
    """Diagonals (3, designs, p, n) that bound the error of placing A by the map |L| (..., p, n, n) (theory eq. N10)."""
    roots = np.sqrt(abs(np.einsum("...ii->...i", A)))
    s = np.swapaxes(size, -1, -2) @ roots[..., None]
    return np.asarray(ROUNDING * A.shape[-1] * s[..., 0] ** 2)
