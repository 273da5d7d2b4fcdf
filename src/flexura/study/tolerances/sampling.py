"""The designs of a tolerance study, by number: independently scrambled nets, and their mixtures for Sobol indices."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.records import Record
from flexura.study.space import Sobol, Variable

LEAST = 12
"""Scramblings at least; below 24 unless the nets would exceed `LARGEST`."""

LARGEST = 4096
"""Points of a scrambling at most: more samples are more scramblings, and memory stays flat."""

FEWEST_SAMPLES = 2 * LEAST
PART_FOR_INDICES = 4
"""One point in so many of a scrambling is also one of the base samples of Sobol indices."""

FEWEST_FOR_INDICES = 4
"""Points of a scrambling at least that are base samples."""


@dataclass(frozen=True, repr=False, eq=False)
class ScrambledNets(Record):
    """Designs from R independently scrambled Sobol' nets of n points, then those that Sobol indices take beside them.

    The first R n designs, scrambling by scrambling, are the sample (A). With `index_points` (m) a scrambling, the first
    m points of each come again with other sizes (B) and with the sizes of one group alone from B (AB), which are the
    last half of the coordinates of the same net: R m (groups + 1) designs more. `groups` are positions of the variables
    that belong to one tolerance.
    """

    _shown = ("scramblings", "points", "index_points", "variables")

    variables: tuple[Variable, ...]
    groups: tuple[tuple[int, ...], ...]
    scramblings: int
    points: int
    index_points: int
    seed: int

    @classmethod
    def of(
        cls, variables: Sequence[Variable], groups: Sequence[Sequence[int]], samples: int, seed: int, indices: bool
    ) -> ScrambledNets:
        """Nets with at least so many samples, more by a twelfth at most. Raises OptionError for too few of them."""
        if not isinstance(samples, int | np.integer) or samples < FEWEST_SAMPLES:
            raise OptionError(f"samples is a whole number from {FEWEST_SAMPLES}, not {samples!r}")
        if not isinstance(seed, int | np.integer) or seed < 0:
            raise OptionError(f"a seed is a whole number from 0, not {seed!r}")
        points = min(2 ** ((int(samples) // LEAST).bit_length() - 1), LARGEST)
        extra = max(points // PART_FOR_INDICES, FEWEST_FOR_INDICES) if indices else 0
        own = tuple(tuple(g) for g in groups)
        return cls(tuple(variables), own, -(-int(samples) // points), points, min(extra, points), int(seed))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that vary."""
        return tuple(own.name for own in self.variables)

    @property
    def samples(self) -> int:
        """Designs that are the sample itself."""
        return self.scramblings * self.points

    @property
    def size(self) -> int:
        """How many designs there are."""
        return self.samples + self.scramblings * self.index_points * (len(self.groups) + 1)

    def designs(self, start: int, stop: int) -> dict[str, Array]:
        """Values, SI, of the designs start ... stop - 1, (stop - start,) for every variable by name."""
        if not 0 <= start <= stop <= self.size:
            raise OptionError(f"designs {start} to {stop} are asked for; there are {self.size}, counted from 0")
        parts = [self._points(*part) for part in self._parts(start, stop)]
        points = np.concatenate(parts) if parts else np.empty((0, len(self.variables)))
        return {own.name: own.at(points[:, axis]) for axis, own in enumerate(self.variables)}

    def _parts(self, start: int, stop: int) -> Iterator[tuple[int, int, int, int]]:
        """Runs of designs: scrambling, matrix (-2 is A, -1 is B, others AB with that group of B), first and last + 1
        point."""
        at = start
        while at < stop:
            if at < self.samples:
                (scrambling, first), matrix, length = divmod(at, self.points), -2, self.points
            else:
                length = self.index_points
                run, first = divmod(at - self.samples, length)
                scrambling, matrix = divmod(run, len(self.groups) + 1)
                matrix -= 1
            last = min(first + stop - at, length)
            yield scrambling, matrix, first, last
            at += last - first

    def _points(self, scrambling: int, matrix: int, first: int, last: int) -> Array:
        axes = len(self.variables)
        both = _net(self.points, (2 if self.index_points else 1) * axes, (self.seed << 32) + scrambling)(first, last)
        A, B = both[:, :axes], both[:, axes:]
        if matrix == -2:
            return A
        if matrix == -1:
            return B
        from_B = np.isin(np.arange(axes), self.groups[matrix])
        return np.where(from_B, B, A)

    def sorted_out(self, values: Array) -> tuple[Array, Array, Array]:
        """Values (size, q) of all designs as those of the sample (R, n, q), of B (R, m, q) and of AB (g, R, m, q)."""
        R, q = self.scramblings, values.shape[-1]
        A = values[: self.samples].reshape(R, self.points, q)
        rest = values[self.samples :].reshape(R, len(self.groups) + 1, self.index_points, q)
        return A, rest[:, 0], np.moveaxis(rest[:, 1:], 1, 0)

    def describe(self) -> dict[str, Any]:
        """Plain data that tell it from every other set of designs."""
        return {
            "sampling": "scrambled nets",
            "scramblings": self.scramblings,
            "points": self.points,
            "index_points": self.index_points,
            "groups": [list(own) for own in self.groups],
            "seed": self.seed,
            "first": _net(self.points, len(self.variables), self.seed << 32)(0, 1)[0].tolist(),
            "variables": [own.describe() for own in self.variables],
        }


@lru_cache(maxsize=8)
def _net(points: int, axes: int, seed: int) -> Sobol:
    """One scrambling."""
    return Sobol.of(points, axes, seed)
