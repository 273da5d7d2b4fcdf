"""Dead loads and gravity of a description as numbers of a design."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.mechanism import TOP, Layout, matching
from flexura.structure.value_table import ValueTable


class DeadLoads:
    """The keys `loads` and `gravity` of a mechanism, laid out once."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        mechanism, exposed = layout.mechanism, layout.exposed(TOP)
        loads = [component for load in mechanism.loads.values() for component in (*load.force, *load.moment)]
        self.any: bool = any(component != 0 for component in (*mechanism.gravity, *loads))
        """Whether anything is loaded, for some values of the parameters."""
        self._gravity = np.array(table.add_all(mechanism.gravity), dtype=np.intp)
        self._wrenches = {
            node: np.array(table.add_all((*load.force, *load.moment)), dtype=np.intp)
            for text, load in mechanism.loads.items()
            for node in matching(text, exposed)
        }

    def gravity(self, values: Array) -> Array:
        """Acceleration of free fall (..., 3), m/s^2, global axes, at values (..., s)."""
        return values[..., self._gravity]

    def act(self, values: Array) -> bool:
        """Whether anything is loaded at values (..., s), in one design at least."""
        return bool(values[..., [*self._gravity, *(k for own in self._wrenches.values() for k in own)]].any())

    def wrenches(self, values: Array) -> dict[str, Array]:
        """Forces and moments (..., 6) by node, N and N m, global axes, at values (..., s)."""
        return {node: values[..., entries] for node, entries in self._wrenches.items()}
