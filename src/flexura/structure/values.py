"""Every number of a description in one table, so that a design is an array and many designs are a stack of them.

Only what varies in a stack has an axis of designs. Loads, gravity, the pose and the motion that are described are read
from the table by the names of nodes and actuators.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from flexura.arrays import Array, Index
from flexura.duals import moves, plain, with_slopes_of
from flexura.expressions import Expression
from flexura.mechanism import COMMANDS, FORCES, TOP, Layout, Motion, Scalar, matching
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

    def entries(self, value: Scalar | Sequence[Scalar]) -> Index:
        """Entry () of a value, or those (n,) of several."""
        return np.array(self.add_all(value) if isinstance(value, tuple) else self.add(value), dtype=np.intp)  # type: ignore[arg-type]

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


def picked(values: Array, entries: Index) -> Array:
    """Values (..., *entries.shape) of some entries of (..., s); without the design axis where none of them varies, and
    without slopes where none of them has any."""
    return common(values[..., entries], entries.ndim)


def common(array: Array, axes: int) -> Array:
    """An array of so many axes and that of designs before them; without the latter where all designs are the same, and
    without slopes that are zero."""
    array = array if moves(array) else plain(array)
    return array[0] if array.ndim > axes and (array == array[:1]).all() else array


def joined_along(arrays: Sequence[Array], axis: int) -> Array:
    """Arrays one behind the other along an axis, counted from the last; some may lack the design axis before it."""
    leads = {array.shape[:axis] for array in arrays}
    if len(leads) > 1:
        lead = np.broadcast_shapes(*leads)
        some = [array for array in arrays if array.shape[axis]] or arrays[:1]
        arrays = [
            array if array.shape[:axis] == lead else np.broadcast_to(array, (*lead, *array.shape[axis:]))
            for array in some
        ]
    return np.concatenate(arrays, axis=axis)


class DeadLoads:
    """The keys `loads` and `gravity` of a mechanism, laid out once."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        mechanism, exposed = layout.mechanism, layout.exposed(TOP)
        loads = [component for load in mechanism.loads.values() for component in (*load.force, *load.moment)]
        self.any: bool = any(component != 0 for component in (*mechanism.gravity, *loads))
        """Whether anything is loaded, for some values of the parameters."""
        self._gravity = table.entries(mechanism.gravity)
        self._wrenches = {
            node: table.entries((*load.force, *load.moment))
            for text, load in mechanism.loads.items()
            for node in matching(text, exposed)
        }

    def gravity(self, values: Array) -> Array:
        """Acceleration of free fall (..., 3), m/s^2, global axes, at values (..., s)."""
        return values[..., self._gravity]

    def act(self, values: Array) -> bool:
        """Whether anything is loaded at values (..., s), in one design at least."""
        return bool(values[..., [*self._gravity, *(k for entries in self._wrenches.values() for k in entries)]].any())

    def wrenches(self, values: Array) -> dict[str, Array]:
        """Forces and moments (..., 6) by node, N and N m, global axes, at values (..., s)."""
        return {node: values[..., entries] for node, entries in self._wrenches.items()}


class DescribedPose:
    """The key `at` of a mechanism, laid out once."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        self.any: bool = bool(layout.mechanism.at)
        """Whether there is one away from rest."""
        self._displacements, self._forces, self._commands = _prescribed(layout.mechanism.at, layout, table)

    def moved(self, values: Array) -> dict[str, float]:
        """Displacements, m, and components of rotation vectors, rad, by NODE.AXIS, at values (s,)."""
        return {name: float(values[entry]) for name, entry in self._displacements.items()}

    def commands(self, values: Array) -> dict[str, float]:
        """Commands of actuators by name as placed, in the units of their inputs, at values (s,)."""
        return {name: float(values[entry]) for name, entry in self._commands.items()}

    def forces(self, values: Array) -> dict[str, float]:
        """Dead forces, N, and moments, N m, by NODE.AXIS, at values (s,)."""
        return {name: float(values[entry]) for name, entry in self._forces.items()}


class DescribedMotion:
    """The key `motion` of a mechanism, laid out once."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        self.motion: Motion | None = layout.mechanism.motion
        """What is described."""
        move = self.motion.move if self.motion is not None else {}
        self._displacements, _, self._commands = _prescribed(move, layout, table)
        self._wrenches: dict[str, dict[str, Index]] = {
            kind: {
                node: table.entries((*load.force, *load.moment))
                for node, load in getattr(self.motion, kind, {}).items()
            }
            for kind in ("loads", "follower")
        }

    def moved(self, values: Array) -> dict[str, Array]:
        """Displacements, m and rad, by NODE.AXIS, one or the first and the last (2,), at values (s,)."""
        return {name: values[entries].squeeze() for name, entries in self._displacements.items()}

    def commands(self, values: Array) -> dict[str, Array]:
        """Commands by name as placed, in the units of their inputs, likewise."""
        return {name: values[entries].squeeze() for name, entries in self._commands.items()}

    def wrenches(self, kind: str, values: Array) -> dict[str, Array]:
        """Forces and moments (2, 6), N and N m, by node, of `loads` or `follower`, from nothing."""
        wrenches = {node: values[entries] for node, entries in self._wrenches[kind].items()}
        return {node: np.stack([0 * wrench, wrench]) for node, wrench in wrenches.items()}


def _prescribed(
    targets: Mapping[str, Any], layout: Layout, table: ValueTable
) -> tuple[dict[str, Index], dict[str, Index], dict[str, Index]]:
    """Entries of prescribed displacements and of forces by NODE.AXIS, of commands of actuators by name as placed."""
    displacements, forces, commands = dict[str, Index](), dict[str, Index](), dict[str, Index]()
    for name, target in targets.items():
        for key in target.given:
            entries = table.entries(getattr(target, key))
            if key in COMMANDS:
                commands.update(dict.fromkeys(layout.commanded(name), entries))
            else:
                (forces if key in FORCES else displacements)[f"{name}.{key}"] = entries
    return displacements, forces, commands
