"""What slopes say of a spread: standard deviations, shares of the variance, and worst cases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array

ROUNDS = 32
"""Steps from vertex to vertex at most."""

ROUND_OFF = 1e-12
"""What a size does across its range, relative to the value, that is nothing."""

NEGLIGIBLE = 1e-9
"""The same, relative to what that size does which does most."""


def significant(slope: Array, reach: Array, value: float) -> Array:
    """Slopes (d,) of a value by sizes that go so far, with zeros for those that are round-off."""
    each = np.abs(slope * reach)
    return np.where(each > max(NEGLIGIBLE * each.max(initial=0.0), ROUND_OFF * abs(value)), slope, 0.0)


def linear_deviation(slope: Array, deviation: Array) -> float:
    """Standard deviation of a quantity with slopes (d,) in independent sizes with deviations (d,), to first order
    (theory eq. U11)."""
    return float(np.linalg.norm(slope * deviation))


def variance_shares(slope: Array, deviation: Array) -> Array:
    """Which share (d,) of the variance each size answers for, to first order (theory eq. U11); NaN where there is
    none."""
    whole = linear_deviation(slope, deviation)
    return (slope * deviation / whole) ** 2 if whole > 0 else np.full(len(slope), np.nan)


@dataclass(frozen=True)
class Extreme:
    """An end of what a quantity may come to within tolerances: its value at `sizes` (d,), SI.

    `is_vertex` says that it is a corner of the box of tolerances at which every slope points out of the box: none
    goes further if the quantity only rises or falls with each size. Elsewhere it is the furthest that was found.
    """

    value: float
    sizes: Array
    is_vertex: bool


@dataclass(frozen=True)
class Box:
    """The `nominal`, smallest and largest sizes (d,) within tolerances, and those of N samples (N, d)."""

    nominal: Array
    low: Array
    high: Array
    drawn: Array

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """Which samples (N,) are within: tails of normal distributions are not."""
        return np.all((self.drawn >= self.low) & (self.drawn <= self.high), axis=1)

    def starts(self, values: Array, sign: int) -> list[Array]:
        """Where the largest (`sign` 1) or smallest (-1) of values (N,) is sought from: the nominal design and the
        sample within that goes furthest."""
        known = self.inside & np.isfinite(values)
        best = [self.drawn[np.argmax(np.where(known, sign * values, -np.inf))]] if known.any() else []
        return [self.nominal, *best]


def extreme(
    evaluate: Callable[[Array], tuple[float, Array]], starts: Sequence[Array], low: Array, high: Array, sign: int
) -> Extreme:
    """The largest (`sign` 1) or smallest (-1) value within a box `low` to `high` (d,), from vertex to vertex.

    `evaluate` gives the value and the slopes (d,) at sizes. From each start the slopes' signs name a vertex, at which
    value and slopes are found exactly, until they name the same one (theory eq. U12); where that goes less far, only
    the size with the most to gain moves. NaN where nothing can be evaluated.
    """
    matters, ends = np.zeros(len(low), dtype=bool), list[tuple[float, Array, bool]]()
    for start in starts:
        at = np.asarray(start, dtype=float)
        value, slope = evaluate(at)
        settled = False
        for _ in range(ROUNDS):
            if not (np.isfinite(value) and np.isfinite(slope).all()):
                break
            slope = significant(slope, high - low, value)
            matters |= slope != 0
            moves = [own for own in _moves(at, slope, low, high, sign) if not np.array_equal(own, at)]
            settled = not moves
            tried = ((own, *evaluate(own)) for own in moves)
            better = next((own for own in tried if sign * own[1] > sign * value), None)
            if better is None:
                break
            at, value, slope = better
        ends.append((value, at, settled))
    value, at, settled = max(ends, key=lambda own: (sign * own[0] if np.isfinite(own[0]) else -np.inf, own[2]))
    is_corner = np.all((at == low) | (at == high) | ~matters)
    return Extreme(value, at, settled and bool(is_corner))


def _moves(at: Array, slope: Array, low: Array, high: Array, sign: int) -> tuple[Array, Array]:
    """Where slopes lead: the vertex that they name, and the end of the range of the size with the most to gain."""
    vertex = np.where(sign * slope > 0, high, np.where(slope != 0, low, at))
    best = np.argmax(np.abs(slope * (vertex - at)))
    return vertex, np.where(np.arange(len(at)) == best, vertex, at)
