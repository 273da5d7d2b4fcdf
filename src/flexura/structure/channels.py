"""Actuators and sensors of a part: their numbers, their masses and what they act on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.mechanism import Actuator, MotionSensor, PiezoStack, Sensor, Substructure
from flexura.structure.discrete_elements import PiezoElement, rigid_mass
from flexura.structure.value_table import Index, ValueTable


class PartChannels:
    """Actuators and sensors of one prototype, laid out once.

    `actuators` and `sensors` are the descriptions, `nodes` the numbers of their nodes in the part, by kind and name.
    """

    def __init__(self, table: ValueTable, prototype: Substructure, number: Callable[[str], int]) -> None:
        self.actuators: dict[str, Actuator] = prototype.actuators
        self.sensors: dict[str, Sensor] = prototype.sensors
        self.nodes: dict[tuple[str, str], list[int]] = {}
        self._entries: dict[tuple[str, str], dict[str, Index]] = {}
        self.piezos: dict[str, PiezoElement] = {}
        self.masses: list[tuple[str, int, tuple[int, float]]] = []
        """Name, node, and entry with share of the mass of sensors that have one."""
        for kind, entries in (("actuator", self.actuators), ("sensor", self.sensors)):
            for key, part in entries.items():
                at = self.nodes[kind, key] = [number(n) for n in getattr(part, "nodes", ())]
                self._entries[kind, key] = _numbers(table, part)
                if isinstance(part, PiezoStack):
                    self.piezos[key] = PiezoElement(table, part, at)
                if isinstance(part, MotionSensor) and part.mass != 0:
                    own = table.add(part.mass)
                    self.masses += [(key, node, (own, 1 / len(at))) for node in at]

    @property
    def has_matrices(self) -> bool:
        """True when a piezo stack or the mass of a sensor adds to stiffness or mass."""
        return bool(self.piezos or self.masses)

    def number(self, kind: str, key: str, name: str, values: Array) -> Array | None:
        """A number (...) or vector (..., 3) of an actuator or sensor at values (..., s); None where it has none."""
        entries = self._entries[kind, key].get(name)
        return None if entries is None else values[..., entries]

    def mass_matrices(self, values: Array) -> list[tuple[str, int, Array]]:
        """Name, node and mass matrix (..., 6, 6) of the sensors that have a mass."""
        nothing = np.zeros((3, 3))
        found = []
        for key, node, (entry, share) in self.masses:
            mass = share * values[..., entry]
            found.append((key, node, rigid_mass(mass, np.broadcast_to(nothing, (*mass.shape, 3, 3)))))
        return found

    def described_mass(self, key: str, values: Array, positions: Array) -> Array:
        """Rigid-body mass matrix (6, 6) of a piezo stack about the part's origin, from its mass and section alone."""
        discrete = self.piezos[key]
        mass = float(discrete.mass(values))
        total = np.zeros((6, 6))
        section = discrete.section(values)
        if section is None:
            pieces = [(mass / 2, np.zeros((3, 3)), x) for x in positions]
        else:
            axis = positions[1] - positions[0]
            L = float(np.linalg.norm(axis))
            R = discrete.frame(positions)
            slender = L * L / 12
            local = np.array([(section.Iy + section.Iz) / section.A, slender + section.Iy / section.A,
                              slender + section.Iz / section.A])  # fmt: skip
            pieces = [(mass, R.T @ np.diag(mass * local) @ R, positions.mean(axis=0))]
        for m, inertia, centre in pieces:
            D = rigid_arm(centre)
            total += D.T @ rigid_mass(np.array(m), inertia) @ D
        return total


def _numbers(table: ValueTable, part: object) -> dict[str, Index]:
    """Entries of the numbers that an actuator or a sensor may have."""
    found: dict[str, Index] = {}
    for name in ("direction", "point", "limit", "stiffness", "free_stroke", "blocked_force", "gain"):
        value = getattr(part, name, None)
        if value is not None:
            found[name] = np.array(
                table.add_all(value) if isinstance(value, tuple) else table.add(value), dtype=np.intp
            )
    return found
