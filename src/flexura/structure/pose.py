"""The pose that a mechanism is described at, and what is linear about it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.mechanism import COMMANDS, Layout, matching
from flexura.structure.value_table import ValueTable

Array = NDArray[np.float64]


class DescribedPose:
    """The key `at` of a mechanism, laid out once."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        self.any = bool(layout.mechanism.at)
        """Whether there is one away from rest."""
        actuators = layout.actuators() if self.any else {}
        self._moved, self._commands = dict[str, int](), dict[str, int]()
        for name, own in layout.mechanism.at.items():
            for key in own.given:
                entry = table.add(getattr(own, key))
                if key in COMMANDS:
                    self._commands.update(dict.fromkeys(matching(name, actuators), entry))
                else:
                    self._moved[f"{name}.{key}"] = entry

    def moved(self, values: Array) -> dict[str, float]:
        """Displacements, m, and components of rotation vectors, rad, by NODE.AXIS, at values (s,)."""
        return {name: float(values[entry]) for name, entry in self._moved.items()}

    def commands(self, values: Array) -> dict[str, float]:
        """Commands of actuators by name as placed, in the units of their inputs, at values (s,)."""
        return {name: float(values[entry]) for name, entry in self._commands.items()}


class Posed(Protocol):
    """A design where it has moved. Displacements of DOFs are small ones from there, in global axes.

    The room of large motion makes it; what is linear reads it in place of the state at rest.
    """

    @property
    def words(self) -> str:
        """Where it is, in words."""
        ...

    @property
    def K(self) -> sp.csc_matrix:
        """Tangent stiffness (n, n), N/m, N, N m, symmetric."""
        ...

    @property
    def M(self) -> sp.csc_matrix:
        """Mass (n, n), kg, kg m, kg m^2."""
        ...

    @property
    def positions(self) -> Array:
        """Positions (n_nodes, 3) of all nodes, m."""
        ...

    @property
    def rotations(self) -> Array:
        """Rotations (n_nodes, 3, 3) of all nodes from rest."""
        ...

    @property
    def base_inertia_forces(self) -> Array:
        """Forces (n, 6) as `FullOrderModel.base_inertia_forces`, where everything is."""
        ...

    def dissipation(self, default: float) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """C and H (n, n) of dashpots and structural damping, as `FullOrderAssembler.dissipation`."""
        ...
