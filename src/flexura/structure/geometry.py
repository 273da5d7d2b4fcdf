"""Where everything is, for one design or for a stack of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flexura.arrays import Array
from flexura.duals import Dual, plain
from flexura.records import Record
from flexura.structure.part import Part, PartGeometry
from flexura.structure.stacking import joined_along
from flexura.structure.topology import Topology
from flexura.structure.value_table import Index


@dataclass(frozen=True, repr=False)
class Geometry(Record):
    """Where everything is, for one design or a stack of them; what does not vary in a stack lacks the design axis.

    `parts` by prototype, in its own frame, with the element transforms `T`; `Q` (..., i, 3, 3) and `t` (..., i, 3)
    place instance i in the global frame.
    """

    _shown = ("positions",)

    parts: dict[str, PartGeometry]
    T: Mapping[str, Array]
    Q: Array
    t: Array
    topology: Topology = field(compare=False)

    @cached_property
    def positions(self) -> Array:
        """Positions (..., n, 3), m, of all global nodes."""
        lead = np.broadcast_shapes(self.t.shape[:-2], *(own.positions.shape[:-2] for own in self.parts.values()))
        found = np.empty((*lead, self.topology.n_nodes, 3), like=self.t)
        for name, copies in self.topology.copies.items():
            x = self.parts[name].positions[..., None, :, :] @ np.swapaxes(self.Q[..., copies.number, :, :], -1, -2)
            x = x + self.t[..., copies.number, None, :]
            numbers = np.array(copies.offset, dtype=np.intp)[:, None] + np.arange(copies.part.n_nodes)
            found[..., numbers, :] = x
        return found

    @cached_property
    def lengths(self) -> Array:
        """Lengths (..., m), m, of the members of all prototypes."""
        return joined_along([own.length for own in self.parts.values()], -1)

    @cached_property
    def turning(self) -> Array:
        """(..., i, 6, 6): displacements in global axes from those in the axes of instances.

        Rotations are axial vectors: mirror images turn them the other way.
        """
        out = np.zeros((*self.Q.shape[:-2], 6, 6), like=self.Q)
        out[..., :3, :3] = self.Q
        out[..., 3:, 3:] = np.linalg.det(plain(self.Q)).round()[..., None, None] * self.Q
        return out

    def still(self, parts: Mapping[str, Part]) -> Geometry:
        """The geometry of the parts without slopes."""
        if not isinstance(self.t, Dual):
            return self
        own = {name: PartGeometry(*map(plain, found)) for name, found in self.parts.items()}
        return Geometry(own, Transforms(parts, own), plain(self.Q), plain(self.t), self.topology)

    def at(self, numbers: Index) -> Array:
        """Positions (..., k, 3), m, of some global nodes (k,)."""
        found, order = [np.empty((0, 3))], [np.empty(0, dtype=np.intp)]
        for name, at, instance, node in self.topology.places(numbers):
            x = np.einsum("...nij,...nj->...ni", self.Q[..., instance, :, :], self.parts[name].positions[..., node, :])
            found.append(x + self.t[..., instance, :])
            order.append(at)
        return joined_along(found, -2)[..., np.argsort(np.concatenate(order)), :]


class Transforms(dict[str, Array]):
    """Element transforms by prototype, worked out when they are first asked for."""

    def __init__(self, parts: Mapping[str, Part], geometry: Mapping[str, PartGeometry]) -> None:
        super().__init__()
        self._parts, self._geometry = parts, geometry

    def __missing__(self, name: str) -> Array:
        found = self[name] = self._parts[name].element_transforms(self._geometry[name])
        return found

    def __reduce__(self) -> tuple[type[Transforms], tuple[object, ...]]:
        return Transforms, (self._parts, self._geometry)
