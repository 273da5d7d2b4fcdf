"""Goals and limits as functions of quantities of a design, and what becomes of them where frequencies coincide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Places = NDArray[np.intp]

NEIGHBOURS = 2
"""Frequencies beside one that is asked for which may coincide with it."""


class Point(NamedTuple):
    """Quantities (q,) of one design and their derivatives (q, P) in SI, at places `differenced` by differences; of
    frequencies that coincide `repeated` are groups, `directional` the derivatives (m, m, P) of the space of each."""

    value: Array
    slope: Array
    repeated: tuple[tuple[int, ...], ...] = ()
    directional: tuple[Array, ...] = ()
    differenced: tuple[int, ...] = ()


class Designs(Protocol):
    """What is known of designs: N values (N, q) with a reason for each that failed, and one design with slopes."""

    def values(self, x: Array) -> tuple[Array, Sequence[str]]:
        """Quantities (N, q) of designs (N, P), and why each has none, empty where it has."""
        ...

    def point(self, x: Array) -> Point:
        """Quantities and slopes of one design (P,). Raises FlexuraError when it fails."""
        ...


class Function(Protocol):
    """A function of quantities and its partial derivatives."""

    def value(self, quantities: Array) -> Array:
        """Values (...) at quantities (..., q)."""
        ...

    def slope(self, quantities: Array) -> Array:
        """Partial derivatives (q,) at quantities (q,)."""
        ...


class Frequency(NamedTuple):
    """A natural frequency that a row depends on: its place in the ascending frequencies of its state, the `ladder`, as
    places among the quantities."""

    ladder: tuple[int, ...]
    rung: int

    def beside(self, steps: int) -> int:
        """The place of the frequency so many rungs above, or below, as far as the ladder goes."""
        return self.ladder[min(max(self.rung + steps, 0), len(self.ladder) - 1)]


@dataclass(frozen=True)
class Row:
    """A function over `scale`, at least 0 where it is a limit, made as large as can be where it is a goal."""

    function: Function
    scale: float = 1.0
    frequencies: tuple[Frequency, ...] = ()

    def copies(self, quantities: Array) -> list[Places]:
        """Places (q,) of the quantities in each version of the row that has to hold, the row itself first.

        A frequency f_k that should be higher is the least of f_k, f_(k+1) ..., one that should be lower the greatest of
        f_k, f_(k-1) ...: each of them smooth where their order is not (bound formulation: Olhoff 1989, "Multicriterion
        structural optimization via bound formulation and mathematical programming").
        """
        if not self.frequencies:
            return [np.arange(len(quantities), dtype=np.intp)]
        slope = self.function.slope(quantities)
        found = []
        for steps in product(range(NEIGHBOURS + 1), repeat=len(self.frequencies)):
            places = np.arange(len(quantities), dtype=np.intp)
            for own, step in zip(self.frequencies, steps, strict=True):
                places[own.beside(0)] = own.beside(step if slope[own.beside(0)] > 0 else -step)
            found.append(places)
        return found

    def values(self, quantities: Array) -> Array:
        """The row (...), over its scale, at quantities (..., q)."""
        return np.asarray(self.function.value(quantities)) / self.scale

    def gradient(self, point: Point, places: Places) -> Array:
        """Derivatives (P,) of a version by the variables."""
        return self.function.slope(point.value[places]) @ point.slope[places] / self.scale
