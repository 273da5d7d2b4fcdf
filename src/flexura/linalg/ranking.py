"""Orders and signs that do not hang on round-off: what is equal to a part in a million keeps the order it came in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Index

TIE = 1e-6
"""Relative difference up to which sizes are equal: symmetry makes them so but for round-off."""


def ranked(sizes: ArrayLike) -> Index:
    """Positions (n,) of sizes (n,) from the largest to the smallest; equal ones stay in their order."""
    size = np.asarray(sizes, dtype=float)
    order = np.argsort(-size, kind="stable").astype(np.intp)
    falling = size[order]
    first = 0
    for k in range(1, len(order) + 1):
        if k == len(order) or falling[k] < _least(falling[first]):
            order[first:k].sort()
            first = k
    return order


def leading(sizes: ArrayLike, axis: int = -1) -> Any:
    """Position of the largest of sizes along an axis, the first of equal ones."""
    size = np.asarray(sizes, dtype=float)
    return (size >= _least(size.max(axis=axis, keepdims=True))).argmax(axis=axis)


def turned(vectors: Any) -> Any:
    """Vectors (n,) or (n, k), real or complex, with the real part of their largest entry positive."""
    at = np.expand_dims(leading(np.abs(vectors), axis=0), 0)
    return np.where(np.real(np.take_along_axis(vectors, at, axis=0)) < 0, -vectors, vectors)


def _least(largest: Any) -> Any:
    """The least size that equals the largest."""
    return largest * (1 - np.copysign(TIE, largest))
