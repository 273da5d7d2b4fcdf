"""Goals and limits as functions of quantities of a design, and what becomes of them where frequencies coincide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array

Places = NDArray[np.intp]

NEIGHBOURS = 2
"""Frequencies beside one that is asked for which may coincide with it."""

VERSIONS = 512
"""Versions of a row at most; what would make more of them stands for itself."""


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


class Worst(NamedTuple):
    """A quantity that a row depends on, and that is the largest (`sign` 1) or the least (-1) of `parts`: places among
    the quantities."""

    place: int
    parts: tuple[int, ...]
    sign: float


@dataclass(frozen=True)
class Above:
    """A function less a `level`."""

    function: Function
    level: float

    def value(self, quantities: Array) -> Array:
        """Values (...) at quantities (..., q)."""
        return np.asarray(self.function.value(quantities)) - self.level

    def slope(self, quantities: Array) -> Array:
        """Partial derivatives (q,) at quantities (q,)."""
        return self.function.slope(quantities)


class Version(NamedTuple):
    """A row that has to hold with quantities from `places` (q,) in the place of its own."""

    row: Row
    places: Places


@dataclass(frozen=True)
class Row:
    """A function over `scale`, at least 0 where it is a limit, made as large as can be where it is a goal; where it is
    the least of several, these are its `parts`."""

    function: Function
    scale: float = 1.0
    frequencies: tuple[Frequency, ...] = ()
    worsts: tuple[Worst, ...] = ()
    parts: tuple[Row, ...] = ()

    def above(self, level: float) -> Self:
        """The row less a level, over its scale."""
        function = Above(self.function, level * self.scale)
        return replace(self, function=function, parts=tuple(own.above(level) for own in self.parts))

    def versions(self, quantities: Array) -> list[Version]:
        """Each version of the row that has to hold: those of its parts, or of itself, the row as it is first."""
        return [Version(own, places) for own in self.parts or (self,) for places in own._places(quantities)]

    def _places(self, quantities: Array) -> list[Places]:
        """Places (q,) of the quantities in each version.

        A frequency f_k that should be higher is the least of f_k, f_(k+1) ..., one that should be lower the greatest of
        f_k, f_(k-1) ...: each of them smooth where their order is not (bound formulation: Olhoff 1989, "Multicriterion
        structural optimization via bound formulation and mathematical programming"). So it is with the largest of
        several stresses: all of them are to be small.
        """
        if not (self.frequencies or self.worsts):
            return [np.arange(len(quantities), dtype=np.intp)]
        slope = self.function.slope(quantities)
        rungs = [own.beside(0) for own in self.frequencies]
        steps = range(NEIGHBOURS + 1)
        choices = [
            tuple(own.beside(step if slope[rung] > 0 else -step) for step in steps)
            for own, rung in zip(self.frequencies, rungs, strict=True)
        ]
        choices += [
            own.parts if slope[own.place] * own.sign < 0 else (own.place,) * len(own.parts) for own in self.worsts
        ]
        found = []
        for chosen in product(*choices):
            places = np.arange(len(quantities), dtype=np.intp)
            places[[*rungs, *(own.place for own in self.worsts)]] = chosen
            found.append(places)
        return found

    def values(self, quantities: Array) -> Array:
        """The row (...), over its scale, at quantities (..., q)."""
        return np.asarray(self.function.value(quantities)) / self.scale

    def gradient(self, point: Point, places: Places) -> Array:
        """Derivatives (P,) of a version, with quantities from these places, by the variables."""
        return self.function.slope(point.value[places]) @ point.slope[places] / self.scale
