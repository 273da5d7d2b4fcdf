"""Surfaces of what was reduced here: how they move, and what is stressed there."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.mechanism import Superelement

STORED = ("points", "rows", "errors", "parts", "edge", "solid")
"""Arrays of `SurfaceStress` that are kept in the cache."""

EDGES = ("", "sharp corner", "edge of the rigid interface", "edge between two materials")
"""What is near a point where stresses are infinite."""


@dataclass(frozen=True)
class SurfaceStress:
    """Stresses at points (q, 3), m, of the surface of a part, those of `Surface` first.

    `parts` (c, c) leads from the coordinates of the component behind those of its first node, as seen from there, to
    shapes of unit energy, `rows` (6, q, c) from these to xx, yy, zz, yz, zx, xy, Pa. `errors` (q, c) are how far off
    stresses of each shape may be, Pa; `edge` (q,) a number of `EDGES`; `solid` (q,) to which of the solids a point
    belongs. `names` are those of these, and `yield_stress` (s,) of their materials, Pa, NaN where it is not known.
    """

    points: Array
    rows: NDArray[np.floating[Any]]
    errors: NDArray[np.floating[Any]]
    parts: Array
    edge: NDArray[np.integer[Any]]
    solid: NDArray[np.integer[Any]]
    names: tuple[str, ...] = field(default=())
    yield_stress: tuple[float, ...] = field(default=())

    def stress(self, d: Array) -> Array:
        """Stresses (6, q, k), Pa, in states of coordinates d (c, k)."""
        return np.asarray(self.rows @ (self.parts @ d).astype(self.rows.dtype))

    def stress_at(self, point: int, d: Any) -> Any:
        """Stresses (6, k) at one point, with slopes where d (c, k) has some."""
        return self.rows[:, point].astype(float) @ (self.parts @ d)

    def error_at(self, point: int, d: Array) -> float:
        """How far off stresses at a point may be, Pa, in a state d (c,)."""
        return float(np.linalg.norm(self.errors[point] * (self.parts @ d)))

    @cached_property
    def regular(self) -> list[Index]:
        """By solid, the points at which stresses are finite."""
        return [np.flatnonzero((self.solid == k) & (self.edge == 0)) for k in range(len(self.names))]

    @cached_property
    def singular(self) -> list[Index]:
        """By solid, the points near edges with infinite stresses."""
        return [np.flatnonzero((self.solid == k) & (self.edge > 0)) for k in range(len(self.names))]


def von_mises(stress: Any) -> Any:
    """Von Mises stresses (...) of stresses (6, ...)."""
    xx, yy, zz, yz, zx, xy = stress
    return np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (yz**2 + zx**2 + xy**2))


def largest_principal(stress: Array) -> float:
    """The principal stress of the largest size of a stress (6,), signed."""
    xx, yy, zz, yz, zx, xy = stress.tolist()
    found = np.linalg.eigvalsh([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
    return float(found[np.abs(found).argmax()])


@dataclass(frozen=True)
class Surface:
    """Corner points (s, 3), m, of the cells' outer sides, and facets (f, 4) of these; a triangle has one point twice.

    `rows` (3 s, c) are the displacements of the points, x y z in turn, from the coordinates of a component, and
    `stress` the stresses there, where they are known.
    """

    points: Array
    facets: Index
    rows: NDArray[np.floating[Any]]
    stress: SurfaceStress | None = None


def surface_of(part: Superelement) -> Surface | None:
    """The surface of a superelement that was reduced here from a sheet or a part, m, in the frame of its substructure,
    and how it moves with its coordinates; None where that is not known."""
    return part.stiffness.surface
