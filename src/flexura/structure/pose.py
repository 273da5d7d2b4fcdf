"""The pose that a mechanism is described at, and what is linear about it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.mechanism import COMMANDS, Layout, Motion, matching
from flexura.structure.value_table import Index, ValueTable


class DescribedPose:
    """The key `at` of a mechanism, laid out once."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        self.any: bool = bool(layout.mechanism.at)
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


class DescribedMotion:
    """The key `motion` of a mechanism, laid out once."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        motion = layout.mechanism.motion
        self.motion: Motion | None = motion
        """What is described."""
        self._moved, self._commands = dict[str, Index](), dict[str, Index]()
        self._wrenches: dict[str, dict[str, Index]] = {"loads": {}, "follower": {}}
        if motion is None:
            return
        actuators = layout.actuators()
        for name, own in motion.move.items():
            for key in own.given:
                entries = np.array(table.add_all(getattr(own, key)), dtype=np.intp)
                if key in COMMANDS:
                    self._commands.update(dict.fromkeys(matching(name, actuators), entries))
                else:
                    self._moved[f"{name}.{key}"] = entries
        for kind, found in self._wrenches.items():
            for node, load in getattr(motion, kind).items():
                found[node] = np.array(table.add_all((*load.force, *load.moment)), dtype=np.intp)

    def moved(self, values: Array) -> dict[str, Array]:
        """Displacements, m and rad, by NODE.AXIS, one or the first and the last (2,), at values (s,)."""
        return {name: values[entries].squeeze() for name, entries in self._moved.items()}

    def commands(self, values: Array) -> dict[str, Array]:
        """Commands by name as placed, in the units of their inputs, likewise."""
        return {name: values[entries].squeeze() for name, entries in self._commands.items()}

    def wrenches(self, kind: str, values: Array) -> dict[str, Array]:
        """Forces and moments (2, 6), N and N m, by node, of `loads` or `follower`, from nothing."""
        return {node: np.stack([0 * values[own], values[own]]) for node, own in self._wrenches[kind].items()}


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

    @property
    def end_forces(self) -> dict[str, tuple[Array, Array]]:
        """Internal forces of members: (i, e, 6, 1) at the first and the second end of the elements of the i copies of
        each prototype, N and N m, in axes that turn with these ends."""
        ...

    def end_force_changes(self, vectors: Array) -> dict[str, tuple[Array, Array]]:
        """What small displacements from there, DOF vectors (n, k), change of `end_forces`, (i, e, 6, k)."""
        ...

    def works(self, displacements: Array) -> Iterator[tuple[tuple[str, ...], Array | None, Array]]:
        """For each kind of elements: names (e,), of beams the strain energy (e, 6, k), J, by components of their
        deformation, else None, and all of it (e, k), for small displacements (n_nodes, 6, k) of all nodes."""
        ...

    def member_ends(self) -> tuple[list[str], Index, Array, Array]:
        """Names (m,) of all members, the nodes (m, 2) that carry their ends, and arms from there and positions
        (m, 2, 3) of these, m."""
        ...

    def dissipation(self, default: float) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """C and H (n, n) of dashpots and structural damping, as `FullOrderAssembler.dissipation`."""
        ...
