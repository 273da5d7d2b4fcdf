"""Numbers of elements as kernels read them: of four elements side by side, what is symmetric once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations_with_replacement

import numpy as np

from flexura.arrays import Array, Index
from flexura.duals import Dual

LANES = 4
"""Elements whose numbers stand side by side."""


def are_plain(*arrays: Array) -> bool:
    """Whether arrays are numbers without slopes, as kernels take them."""
    return not any(isinstance(array, Dual) for array in arrays)


def abreast(values: Array) -> Array:
    """Values (e, ...) as (blocks, k, 4), the last element again where there are fewer than four."""
    rows = np.minimum(np.arange(-(-len(values) // LANES) * LANES), len(values) - 1)
    width = math.prod(values.shape[1:])
    flat = values.reshape(len(values), width)[rows]
    return np.ascontiguousarray(np.swapaxes(flat.reshape(len(rows) // LANES, LANES, width), 1, 2), dtype=float)


def upper(matrices: Array) -> Array:
    """The upper triangles (e, n (n + 1)/2) of symmetric matrices (e, n, n), row by row."""
    row, column = np.triu_indices(matrices.shape[-1])
    return matrices[:, row, column]


@lru_cache(maxsize=16)
def combinations(m: int, order: int) -> tuple[tuple[int, ...], ...]:
    """Numbers below m that do not fall, so many of them."""
    return tuple(combinations_with_replacement(range(m), order))


def different(tensors: Array, order: int) -> Array:
    """What is different (e, k) of symmetric tensors (e, m, m, ...) of an order, in the order of `combinations`."""
    if not tensors.size:
        return np.empty((len(tensors), 0))
    at = np.array(combinations(tensors.shape[1], order)).T
    return tensors[(slice(None), *at)]


@lru_cache(maxsize=16)
def joined_by(m: int, order: int) -> Index:
    """Places (k, m) among combinations of one more of each combination of an order and one further number."""
    place = {own: i for i, own in enumerate(combinations(m, order + 1))}
    return np.array([[place[tuple(sorted((*own, i)))] for i in range(m)] for own in combinations(m, order)])


def whole(numbers: Sequence[int] | Index) -> Index:
    """Whole numbers as kernels take them."""
    return np.ascontiguousarray(numbers, dtype=np.int64)
