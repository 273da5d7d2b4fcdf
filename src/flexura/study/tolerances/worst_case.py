"""What slopes say of a spread: standard deviations, shares of the variance, and worst cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexura.arrays import Array, Bools
from flexura.duals import Dual
from flexura.study.questions import Questions, Relation, Slopes
from flexura.thresholds import ROUND_OFF

MOST_VERTEX_STEPS = 32
"""Steps from vertex to vertex at most."""

NEGLIGIBLE_EFFECT = 1e-9
"""The same, relative to what that size does which does most."""

SLOPES_TOGETHER = 1e-6
"""Relative difference of the slopes of frequencies that coincide up to which they stay together."""

Evaluate = Callable[[Array], tuple[float, Array]]
"""Value and slopes (d,) at sizes (d,)."""


def significant(slope: Array, width: Array, value: float) -> Array:
    """Slopes (d,) of a value by sizes with ranges of this `width`, with zeros for those that are round-off."""
    effect = np.abs(slope * width)
    least = max(NEGLIGIBLE_EFFECT * effect.max(initial=0.0), ROUND_OFF * abs(value))
    return np.where(effect > least, slope, 0.0)


def linear_deviation(slope: Array, deviation: Array) -> float:
    """Standard deviation of a quantity with slopes (d,) in independent sizes with deviations (d,), to first order
    (theory eq. U11)."""
    return float(np.linalg.norm(slope * deviation))


def variance_shares(slope: Array, deviation: Array) -> Array:
    """Which share (d,) of the variance each size answers for, to first order (theory eq. U11); NaN where there is
    none."""
    total = linear_deviation(slope, deviation)
    return (slope * deviation / total) ** 2 if total > 0 else np.full(len(slope), np.nan)


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
    """The `nominal`, smallest and largest sizes (d,) within tolerances, their standard deviations (d,), and those of N
    samples (N, d)."""

    nominal: Array
    low: Array
    high: Array
    deviation: Array
    drawn: Array

    @cached_property
    def inside(self) -> Bools:
        """Which samples (N,) are within: tails of normal distributions are not."""
        return np.all((self.drawn >= self.low) & (self.drawn <= self.high), axis=1)

    def starts(self, values: Array, sign: int) -> list[Array]:
        """Where the largest (`sign` 1) or smallest (-1) of values (N,) is sought from: the nominal design and the
        sample within that goes furthest."""
        known = self.inside & np.isfinite(values)
        best = [self.drawn[np.argmax(np.where(known, sign * values, -np.inf))]] if known.any() else []
        return [self.nominal, *best]


def extreme(evaluate: Evaluate, starts: Sequence[Array], low: Array, high: Array, sign: int) -> Extreme:
    """The largest (`sign` 1) or smallest (-1) value within a box `low` to `high` (d,), from vertex to vertex.

    From each start the signs of the slopes name a vertex, at which value and slopes are found exactly, until they name
    the same one (theory eq. U12); where that goes less far, only the size with the most to gain moves. NaN where
    nothing can be evaluated.
    """
    matters, ends = np.zeros(len(low), dtype=bool), list[tuple[float, Array, bool]]()
    for start in starts:
        at = np.asarray(start, dtype=float)
        value, slope = evaluate(at)
        settled = False
        for _ in range(MOST_VERTEX_STEPS):
            if not (np.isfinite(value) and np.isfinite(slope).all()):
                break
            slope = significant(slope, high - low, value)
            matters |= slope != 0
            vertex = np.where(sign * slope > 0, high, np.where(slope != 0, low, at))
            steepest = np.arange(len(at)) == np.argmax(np.abs(slope * (vertex - at)))
            moves = [move for move in (vertex, np.where(steepest, vertex, at)) if not np.array_equal(move, at)]
            settled = not moves
            tried = ((move, *evaluate(move)) for move in moves)
            better = next((move for move in tried if sign * move[1] > sign * value), None)
            if better is None:
                break
            at, value, slope = better
        ends.append((value, at, settled))
    value, at, settled = max(ends, key=lambda end: (sign * end[0] if np.isfinite(end[0]) else -np.inf, end[2]))
    is_corner = np.all((at == low) | (at == high) | ~matters)
    return Extreme(value, at, settled and bool(is_corner))


class SlopesOf:
    """Values (q,) and slopes (q, d) of questions in the parameters `names`, with others at their values; each design is
    worked out once."""

    def __init__(self, asked: Questions, parameters: Mapping[str, float], names: Sequence[str]) -> None:
        self.asked = asked
        self._parameters, self._names = parameters, tuple(names)
        self._known: dict[bytes, tuple[Array, Array, list[str]]] = {}

    def at(self, sizes: Array) -> tuple[Array, Array, list[str]]:
        """Values, slopes at sizes (d,), and why slopes are NaN where they are."""
        key = sizes.tobytes()
        if key not in self._known:
            design = {**self._parameters, **dict(zip(self._names, map(float, sizes), strict=True))}
            self._known[key] = _usable(self.asked.slopes(design, self._names))
        return self._known[key]

    def quantity(self, k: int) -> Evaluate:
        """Quantity k by sizes."""

        def evaluate(sizes: Array) -> tuple[float, Array]:
            value, slope, _ = self.at(sizes)
            return float(value[k]), slope[k]

        return evaluate

    def margin(self, requirement: Relation) -> Evaluate:
        """Margin of a requirement by sizes."""

        def evaluate(sizes: Array) -> tuple[float, Array]:
            value, slope, _ = self.at(sizes)
            quantities = enumerate(self.asked.quantities)
            numbers = {quantity.text: Dual(np.array(value[k]), slope[k].copy()) for k, quantity in quantities}
            margin = requirement.evaluate(numbers)
            return float(margin.value), np.asarray(margin.slope, dtype=float)

        return evaluate


def _usable(slopes: Slopes) -> tuple[Array, Array, list[str]]:
    """Values, slopes without those of frequencies that coincide and part, and why there are none."""
    slope = np.array(slopes.slope, dtype=float)
    reason = [why or "no slope" for why in slopes.reason]
    for group, matrix in zip(slopes.repeated, slopes.directional, strict=True):
        mean = np.trace(matrix) / len(matrix)
        parted = np.abs(matrix - np.eye(len(matrix))[:, :, None] * mean).max(initial=0.0)
        if parted > SLOPES_TOGETHER * np.abs(matrix).max(initial=0.0):
            for k in group:
                slope[k] = np.nan
                reason[k] = "it coincides with another frequency, from which it parts: no slope"
    return slopes.value, slope, ["" if np.isfinite(row).all() else why for row, why in zip(slope, reason, strict=True)]
