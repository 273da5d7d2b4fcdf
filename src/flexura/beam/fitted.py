"""Polynomials through tables of what solids say, and ranges outside of which what is known at their ends holds."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.beam.frames import Real
from flexura.duals import plain

MARGIN = 1.1
"""How far beyond a range, as a factor, it goes on, so that what is at its edge has one slope."""

ROWS = 16
"""Places whose values are one product of matrices."""


class Fit(NamedTuple):
    """Coefficients (n_1, ..., n_k, m) of m polynomials in k scales, of n_1 to n_k powers of these."""

    coefficients: NDArray[np.float64]

    def at(self, *places: Real) -> list[Array]:
        """The m values (...) at places on the scales, each (...).

        Products are of `ROWS` places at a time: libraries sum those of other sizes in another order, and what a place
        gives would depend on how many others there are.
        """
        counts, kinds = self.coefficients.shape[:-1], self.coefficients.shape[-1]
        shape = np.broadcast_shapes(*map(np.shape, places))
        count = math.prod(shape)
        terms: Array = np.ones((count, 1))
        for place, number in zip(places[1:], counts[1:], strict=True):
            of_place = np.stack(powers(np.broadcast_to(place, shape).reshape(-1), number), axis=-1)
            terms = (terms[:, :, None] * of_place[:, None, :]).reshape(count, -1)
        filled = np.concatenate([terms, np.zeros((-count % ROWS, terms.shape[1]))]).reshape(-1, ROWS, terms.shape[1])
        by_first = self.coefficients.reshape(counts[0], -1, kinds).swapaxes(0, 1).reshape(-1, counts[0] * kinds)
        by_power = np.moveaxis((filled @ by_first).reshape(-1, by_first.shape[1])[:count], -1, 0)
        weights = np.stack(powers(np.broadcast_to(places[0], shape).reshape(-1), counts[0]))[:, None]
        values = (by_power.reshape(counts[0], kinds, count) * weights).sum(axis=0)
        return [value.reshape(shape) for value in values]


def fitted(known: dict[tuple[float, ...], Array], kinds: int, scales: Sequence[Callable[[float], Real] | None]) -> Fit:
    """The polynomials through all rows, values (kinds,) by their places; zero where the grid of these has none.

    `scales` take the places along every axis to what the polynomials are in; None leaves them.
    """
    axes = [sorted({key[k] for key in known}) for k in range(len(scales))]
    table = np.zeros([*map(len, axes), kinds])
    for at in np.ndindex(table.shape[:-1]):
        table[at] = known.get(tuple(axis[k] for axis, k in zip(axes, at, strict=True)), 0.0)
    for k, (axis, scale) in enumerate(zip(axes, scales, strict=True)):
        points = [float(scale(x)) for x in axis] if scale else axis
        inverse = np.linalg.inv(np.vander(points, increasing=True))
        table = np.moveaxis(np.tensordot(inverse, table, axes=(1, k)), 0, k)
    return Fit(table)


def powers(x: Real, count: int) -> list[Real]:
    """x^0 to x^(count - 1)."""
    terms: list[Real] = [0.0 * x + 1.0]
    for _ in range(count - 1):
        terms.append(terms[-1] * x)
    return terms


def between(x: Real, least: float, most: float) -> Array:
    """What lies outside of a range at its edge; there with the slopes of x."""
    x = np.where(plain(x) < least, least, x)
    return np.where(plain(x) > most, most, x)


def over(x: Real, width: Real) -> Real:
    """What of x is above zero, rounded where x is between minus and plus a width: three derivatives do not jump."""
    u = between((x + width) / (2 * width), 0.0, 1.0)
    near = 2 * width * u**4 * (2.5 - 3 * u + u * u)
    return np.where(plain(x) > plain(width), x, near)


def within(x: Real, least: float, most: float, near: float | None = None) -> Real:
    """x in a range; outside it goes on, ever more slowly, to an end that is `MARGIN` times as far, rounded where that
    is the most by `near`."""
    low, high = least / MARGIN, most * MARGIN
    return x + over(low - x, least - low) - over(x - high, near or high - most)
