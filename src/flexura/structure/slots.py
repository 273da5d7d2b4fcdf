"""Every number of a description in one table, so that a design is an array and a sweep is a stack of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.mechanism.expression import Expression
from flexura.mechanism.quantity import Scalar

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class SlotTable:
    """Hands out slots for scalars while a plan is made, then fills them from parameter values."""

    def __init__(self) -> None:
        self._constants: list[float] = []
        self._known: dict[Scalar, int] = {}
        self._expressions: list[tuple[int, Callable[[Mapping[str, Any]], Any]]] = []

    def add(self, value: Scalar) -> int:
        """Slot of a value; equal values share one."""
        slot = self._known.get(value)
        if slot is None:
            slot = self._known[value] = len(self._constants)
            if isinstance(value, Expression):
                self._expressions.append((slot, value.compiled()))
                self._constants.append(np.nan)
            else:
                self._constants.append(float(value))
        return slot

    def add_all(self, values: Sequence[Scalar]) -> list[int]:
        """Slots of several values."""
        return [self.add(value) for value in values]

    def varying(self) -> Index:
        """Slots that hold expressions."""
        return np.array([slot for slot, _ in self._expressions], dtype=np.intp)

    def fill(self, parameters: Mapping[str, Any], designs: int | None = None) -> Array:
        """Values of all slots: (n_slots,), or (designs, n_slots) with a design axis."""
        constants = np.array(self._constants)
        if designs is None:
            for slot, evaluate in self._expressions:
                constants[slot] = evaluate(parameters)
            return constants
        values = np.tile(constants, (designs, 1))
        for slot, evaluate in self._expressions:
            values[:, slot] = evaluate(parameters)
        return values
