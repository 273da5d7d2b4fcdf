"""All designs of a study, by number: design k is a function of k, so that memory is flat for any number of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from math import prod
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.records import Record
from flexura.study.space.sequences import BITS, MOST_DIMENSIONS, Sobol, latin_hypercube
from flexura.study.space.variables import Variable

Sampling = Literal["grid", "list", "latin hypercube", "sobol"]
SAMPLINGS: tuple[Sampling, ...] = get_args(Sampling)

MOST = {"grid": 2**53, "list": 2**53, "latin hypercube": 2**53, "sobol": 2**BITS}
"""Designs that can be numbered."""


@dataclass(frozen=True, repr=False, eq=False)
class Space(Record):
    """The designs of a study: variables, and how they are sampled.

    `grid` is every value of each variable with every value of the others, the last varying fastest; `list` takes the
    values of all variables side by side; `latin hypercube` (McKay, Beckman and Conover 1979) and `sobol` (scrambled
    Sobol' points) take `samples` points that `seed` names. Points of a Latin hypercube are found by keyed bijections of
    their numbers, none is stored. Raises OptionError for variables that cannot be sampled so, and for more designs
    than can be numbered.
    """

    _shown = ("sampling", "size", "variables")

    variables: tuple[Variable, ...]
    sampling: Sampling = "grid"
    samples: int | None = None
    seed: int = 0
    _sobol: Sobol | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        if self.sampling not in SAMPLINGS:
            raise OptionError(f"sampling is one of {', '.join(SAMPLINGS)}, not {self.sampling!r}")
        if not self.variables:
            raise OptionError("nothing varies: a study varies at least one parameter, e.g. thickness=0.2mm:0.6mm")
        if not isinstance(self.seed, int | np.integer) or self.seed < 0:
            raise OptionError(f"a seed is a whole number from 0, not {self.seed!r}")
        if self.sampling in ("grid", "list"):
            self._check_values()
        else:
            self._check_samples()
        if self.size > MOST[self.sampling]:
            counts = " x ".join(str(own.levels) for own in self.variables) if self.sampling == "grid" else "samples"
            hint = "" if self.sampling != "grid" else "; take fewer values each, or the sampling sobol with --samples"
            raise OptionError(
                f"{self.size:.4g} designs ({counts}) are more than the {MOST[self.sampling]:.3g} of a study{hint}"
            )
        if self.sampling == "sobol":
            object.__setattr__(self, "_sobol", Sobol.of(self.size, len(self.variables), int(self.seed)))

    def _check_values(self) -> None:
        if self.samples is not None:
            raise OptionError(f"a {self.sampling} takes every value; samples belong to sobol and latin hypercube")
        for own in self.variables:
            if own.distribution is not None:
                raise OptionError(f"{own.name} has a distribution: it takes the sampling sobol or latin hypercube")
            if self.sampling == "grid" and own.levels is None:
                raise OptionError(f"{own.name}: how many values does it take? write {own.name}=LOW:HIGH:COUNT")
        if self.sampling == "grid":
            self._refuse_repeated()
        lengths = {own.name: own.levels for own in self.variables}
        if self.sampling == "list" and (None in lengths.values() or len(set(lengths.values())) > 1):
            told = ", ".join(f"{name} has {count or 'a range'}" for name, count in lengths.items())
            raise OptionError(f"a list pairs values: every variable has as many: {told}")

    def _refuse_repeated(self) -> None:
        for own in self.variables:
            value, times = Counter(own.values.tolist()).most_common(1)[0] if len(own.values) else (0.0, 1)
            if times > 1:
                unit = f" {own.unit}" if own.unit not in ("", "1") else ""
                raise OptionError(f"{own.name}: {value:g}{unit} stands in the list {times} times; give it once")

    def _check_samples(self) -> None:
        if self.samples is None:
            raise OptionError(f"the sampling {self.sampling} takes a number of samples, e.g. samples=4096")
        if not isinstance(self.samples, int | np.integer) or self.samples < 1:
            raise OptionError(f"the number of samples is a whole number from 1, not {self.samples!r}")
        for own in self.variables:
            if own.count is not None:
                hint = f"write {own.name}=LOW:HIGH"
                raise OptionError(f"{own.name}: a count of values ({own.count}) belongs to a sweep over a grid; {hint}")
        self._refuse_repeated()
        if len(self.variables) > MOST_DIMENSIONS:
            raise OptionError(f"at most {MOST_DIMENSIONS} variables are sampled, not {len(self.variables)}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that vary."""
        return tuple(own.name for own in self.variables)

    @property
    def size(self) -> int:
        """How many designs there are."""
        if self.samples is not None:
            return int(self.samples)
        levels = [own.levels or 0 for own in self.variables]
        return levels[0] if self.sampling == "list" else prod(levels)

    def designs(self, start: int, stop: int) -> dict[str, Array]:
        """Values, SI, of the designs start ... stop - 1, (stop - start,) for every variable by name."""
        if not 0 <= start <= stop <= self.size:
            raise OptionError(f"designs {start} to {stop} are asked for; there are {self.size}, counted from 0")
        if self.sampling == "grid":
            return self._of_grid(np.arange(start, stop, dtype=np.int64))
        if self.sampling == "list":
            numbers = np.arange(start, stop, dtype=np.int64)
            return {own.name: own.level(numbers) for own in self.variables}
        points = self.points(start, stop)
        return {own.name: own.at(points[:, axis]) for axis, own in enumerate(self.variables)}

    def points(self, start: int, stop: int) -> Array:
        """Samples start ... stop - 1 in the unit cube (stop - start, variables), between 0 and 1, ends left out."""
        if self._sobol is not None:
            return self._sobol(start, stop)
        return latin_hypercube(start, stop, self.size, len(self.variables), int(self.seed))

    def _of_grid(self, numbers: NDArray[np.int64]) -> dict[str, Array]:
        found: dict[str, Array] = {}
        for own in reversed(self.variables):
            numbers, place = np.divmod(numbers, own.levels or 1)
            found[own.name] = own.level(place)
        return {name: found[name] for name in self.names}

    def describe(self) -> dict[str, Any]:
        """Plain data that tell it from every other space; its first design speaks for the sequence that is sampled."""
        found: dict[str, Any] = {"sampling": self.sampling, "size": self.size}
        if self.samples is not None:
            found |= {"seed": int(self.seed), "first": self.points(0, 1)[0].tolist()}
        return found | {"variables": [own.describe() for own in self.variables]}
