"""Every number of a description in one table, so that a design is an array and a sweep is a stack of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from flexura.arrays import Array, Index
from flexura.duals import with_slopes_of
from flexura.expressions import Expression
from flexura.mechanism import Scalar
from flexura.records import Record


class ValueTable(Record):
    """Hands out entries for scalars while a plan is made, then fills them from parameter values."""

    _shown = ("size",)

    def __init__(self) -> None:
        self._constants: list[float] = []
        self._known: dict[Scalar, int] = {}
        self._expressions: list[tuple[int, Expression]] = []
        self._defaults: Array | None = None

    def add(self, value: Scalar) -> int:
        """Entry of a value; equal values share one."""
        entry = self._known.get(value)
        if entry is None:
            entry = self._known[value] = len(self._constants)
            if isinstance(value, Expression):
                self._expressions.append((entry, value))
                self._constants.append(np.nan)
            else:
                self._constants.append(float(value))
        return entry

    def add_all(self, values: Sequence[Scalar]) -> list[int]:
        """Entries of several values."""
        return [self.add(value) for value in values]

    @property
    def size(self) -> int:
        """Number of entries."""
        return len(self._constants)

    def varying(self) -> Index:
        """Entries that hold expressions."""
        return np.array([entry for entry, _ in self._expressions], dtype=np.intp)

    def depending(self, changed: set[str]) -> Index:
        """Entries that depend on one of the parameters `changed`."""
        return np.array([entry for entry, value in self._expressions if not changed.isdisjoint(value.names)], np.intp)

    @cached_property
    def _compiled(self) -> list[tuple[int, frozenset[str], Callable[[Mapping[str, Any]], Any]]]:
        """Entry, parameters and function of every expression, once there are no more of them."""
        return [(entry, value.names, value.compiled()) for entry, value in self._expressions]

    def close(self, defaults: Mapping[str, Any]) -> None:
        """Take no more values; work out all entries for the default parameters."""
        filled = np.array(self._constants)
        for entry, _, evaluate in self._compiled:
            filled[entry] = evaluate(defaults)
        self._defaults = filled

    def fill(self, parameters: Mapping[str, Any], changed: set[str], designs: int | None = None) -> Array:
        """Values of all entries: (n_values,), or (designs, n_values) with a design axis.

        `changed` names the parameters that differ from the defaults that the table was closed with.
        """
        if self._defaults is None:
            raise RuntimeError("the table is still open")
        values = self._defaults.copy() if designs is None else np.tile(self._defaults, (designs, 1))
        if (like := with_slopes_of(*(parameters[name] for name in changed))) is not None:
            defaults, values = values, np.empty(values.shape, like=like)
            values[...] = defaults
        for entry, names, evaluate in self._compiled:
            if not changed.isdisjoint(names):
                values[..., entry] = evaluate(parameters)
        return values
