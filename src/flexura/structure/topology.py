"""How the copies of parts hang together, and where everything is, for one design or for a stack of them.

Nodes that are joined or carried by one body move as one rigid cluster; the cluster's root has the DOFs and all others
follow on rigid arms (the RPR paper, eq. 32; theory eq. 35).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Bools, Index
from flexura.duals import Dual, plain
from flexura.errors import ModelError, OptionError, Problem
from flexura.mechanism import DOF_NAMES, TOP, Layout, matching
from flexura.records import Kept, Record
from flexura.structure.part import Part, PartGeometry
from flexura.structure.values import joined_along

PLACES = 64
"""Sets of nodes whose places are remembered."""


@dataclass
class Copies:
    """All copies of one prototype.

    `paths` name them; `number` is their position among all instances; `offset` is the global number of each copy's
    node 0; nodes of a copy are numbered on from there.
    """

    part: Part
    paths: list[tuple[str, ...]] = field(default_factory=list)
    number: list[int] = field(default_factory=list)
    offset: list[int] = field(default_factory=list)

    def numbers(self, nodes: ArrayLike | None = None) -> Index:
        """Global numbers (copies, ...) of nodes (...) of the part, of all of them unless given."""
        nodes = np.arange(self.part.n_nodes) if nodes is None else np.asarray(nodes, dtype=np.intp)
        return np.add.outer(np.array(self.offset, dtype=np.intp), nodes)

    def names(self, key: str) -> list[str]:
        """Names of something in all copies, such as `branch1.hinge`."""
        return [".".join((*path, key)) for path in self.paths]


class Topology:
    """Instances, rigid clusters and DOF numbering of a mechanism.

    Global nodes are the nodes of all copies of parts. `root` (n,) is the node that each follows, itself when it is
    free; `dof` (n, 6) numbers the DOFs of roots, -1 where held and for nodes that are not roots.
    """

    def __init__(self, layout: Layout, parts: dict[str, Part]) -> None:
        self.layout = layout
        self.copies: dict[str, Copies] = {name: Copies(part) for name, part in parts.items()}
        self.parent: list[int] = []
        self._where: dict[tuple[str, ...], tuple[str, int]] = {}
        self.n_nodes: int = 0
        self._places = Kept(PLACES)
        self._enumerate(layout, parts)
        self.unused: Bools = np.zeros((self.n_nodes, 6), dtype=bool)
        """Freedoms of nodes for amplitudes of superelements that stand for nothing."""
        self.has_position: Bools = np.ones(self.n_nodes, dtype=bool)
        """False for nodes that hold amplitudes of superelements."""
        for copies in self.copies.values():
            self.unused[copies.numbers()] = copies.part.unused
            self.has_position[copies.numbers(range(copies.part.n_positioned, copies.part.n_nodes))] = False
        self._join(parts)
        self._number_dofs()

    def _enumerate(self, layout: Layout, parts: dict[str, Part]) -> None:
        index: dict[tuple[str, ...], int] = {}
        for number, (path, name) in enumerate(layout.instances()):
            copies = self.copies[name]
            copies.paths.append(path)
            copies.number.append(number)
            copies.offset.append(self.n_nodes)
            self._where[path] = (name, self.n_nodes)
            self.n_nodes += parts[name].n_nodes
            index[path] = number
            self.parent.append(index[path[:-1]] if path else -1)

    def node(self, path: tuple[str, ...], reference: str) -> int:
        """Global number of a node written as `INSTANCE.NODE` or `NODE` inside the instance at `path`."""
        *steps, node = reference.split(".")
        name, offset = self._where[(*path, *steps)]
        return offset + self.copies[name].part.node_number[node]

    def numbers(self, names: Sequence[str]) -> Index:
        """Global numbers of nodes written `NODE` or `INSTANCE.NODE`. Raises OptionError for names that are no nodes."""
        try:
            return np.array([self.node((), name) for name in names], dtype=np.intp)
        except KeyError:
            wrong = next(n for n in names if n not in set(self.node_names))
            raise OptionError(f"there is no node {wrong!r}; nodes are written NODE or INSTANCE.NODE") from None

    def places(self, numbers: Index) -> list[tuple[str, Index, Index, Index]]:
        """Global nodes (k,) by prototype: which of them are its copies', the instance (m,) and the node there (m,) of
        each."""

        def found() -> list[tuple[str, Index, Index, Index]]:
            places = []
            for name, copies in self.copies.items():
                offset = np.array(copies.offset, dtype=np.intp)
                copy = np.searchsorted(offset, numbers, side="right") - 1
                node = numbers - (offset[copy] if len(offset) else 0)
                at = np.flatnonzero((copy >= 0) & (node < copies.part.n_nodes))
                if len(at):
                    places.append((name, at, np.array(copies.number, dtype=np.intp)[copy[at]], node[at]))
            return places

        return self._places.once(numbers.tobytes(), found)

    def _join(self, parts: dict[str, Part]) -> None:
        together: list[tuple[int, int]] = []
        bent: list[tuple[int, int]] = []
        depths: dict[int, int] = {}
        for name, copies in self.copies.items():
            part = parts[name]
            for path, offset in zip(copies.paths, copies.offset, strict=True):
                for k, foreign in enumerate(part.foreign):
                    together.append((offset + part.n_own + k, self.node(path, foreign)))
                for a, b in part.joints:
                    together.append((offset + a, offset + b))
                bending = {body.own for body in part.elastic.values()}
                for own in part.elastic.values():
                    bent += [(offset + own.own, offset + node) for node in own.nodes if node < part.n_positioned]
                for body, carried in part.carried.items():
                    if body in bending:
                        continue
                    depths[offset + body] = len(path)
                    together += [(offset + body, offset + node) for node in carried]
        cluster = _clusters(self.n_nodes, together)
        self.piece: Index = _clusters(self.n_nodes, together + bent)
        """The least node (n,) of what is one piece: a rigid cluster, or a body that bends and what it carries."""
        self.is_clamped: Bools = np.zeros(self.n_nodes, dtype=bool)
        """Nodes that are described as clamped, each by itself."""
        held = self._held(cluster)
        representative = np.arange(self.n_nodes)
        bodies = sorted(depths, key=depths.__getitem__)  # those of the mechanism itself before those of its instances
        for body in reversed(bodies):
            representative[cluster[body]] = body
        for node, mask in held.items():
            if not all(mask):
                representative[cluster[node]] = node
        self.root: Index = representative[cluster]
        self.is_rigid: Bools = np.zeros(self.n_nodes, dtype=bool)
        """Nodes that belong to a cluster with a rigid body, so that their arms to the root matter."""
        if bodies:
            self.is_rigid = np.isin(self.root, self.root[bodies])
        self.held: Bools = np.zeros((self.n_nodes, 6), dtype=bool)
        for node, mask in held.items():
            self.held[self.root[node]] = mask
        self.grounded: Bools = np.isin(self.piece, self.piece[self.held.all(axis=1)])
        """Nodes (n,) of pieces that the ground holds."""

    def _held(self, cluster: Index) -> dict[int, tuple[bool, ...]]:
        """Held DOFs by node, at most one node in a cluster; a clamped one outdoes others."""
        ground = self.layout.mechanism.ground
        exposed = self.layout.exposed(TOP)
        held: dict[int, tuple[int, tuple[bool, ...]]] = {}
        for copies in self.copies.values():
            for node in copies.numbers(copies.part.clamped).ravel().tolist():
                self.is_clamped[node] = True
                held[int(cluster[node])] = (node, (True,) * 6)
        for text, support in ground.items():
            for name in matching(text, exposed):
                node = self.node((), name)
                self.is_clamped[node] |= all(support.held)
                before = held.get(cluster[node])
                if before is None or all(support.held):
                    held[cluster[node]] = (node, support.held)
                elif not all(before[1]):
                    raise ModelError([_two_supports(text)])
        return dict(held.values())

    def _number_dofs(self) -> None:
        free = ~(self.held | self.unused)
        free[self.root != np.arange(self.n_nodes)] = False
        self.dof: Index = np.full((self.n_nodes, 6), -1, dtype=np.intp)
        self.n_dof: int = int(free.sum())
        self.dof[free] = np.arange(self.n_dof)

    @property
    def node_names(self) -> list[str]:
        """Names of all global nodes, e.g. `branch1.ring.c3` or `branch1.hinge[2]`."""
        names = [""] * self.n_nodes
        for copies in self.copies.values():
            for k, name in enumerate(copies.part.node_names):
                for offset, placed in zip(copies.offset, copies.names(name), strict=True):
                    names[offset + k] = placed
        return names

    def dof_names(self) -> list[str]:
        """Names of the free DOFs in order, e.g. `platform.rz`, or `branch1.ring amplitude 2` of a superelement."""
        names = self.node_names
        nodes, components = np.nonzero(self.dof >= 0)
        dof_names = [f"{names[n]}.{DOF_NAMES[c]}" for n, c in zip(nodes, components, strict=True)]
        for copies in self.copies.values():
            for node, amplitudes in copies.part.amplitude_names.items():
                for c, name in enumerate(amplitudes):
                    for offset, placed in zip(copies.offset, copies.names(name), strict=True):
                        dof_names[self.dof[offset + node, c]] = placed
        return dof_names


def _two_supports(text: str) -> Problem:
    return Problem(
        path=("ground", text),
        value="",
        rule="two partly held nodes move as one rigid body, which cannot be held in two places",
        hint="hold one of them and tie the other to ground with a stiff spring, or clamp one",
    )


def _clusters(n: int, together: list[tuple[int, int]]) -> Index:
    """The least node of the cluster of each of n nodes, by pairs of nodes that belong together."""
    ends = np.array(together, dtype=np.intp).reshape(-1, 2)
    graph = sp.coo_array((np.ones(len(ends)), ends.T), shape=(n, n))
    label = connected_components(graph, directed=False)[1]
    return np.unique(label, return_index=True)[1][label]


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
        lead = np.broadcast_shapes(self.t.shape[:-2], *(part.positions.shape[:-2] for part in self.parts.values()))
        positions = np.empty((*lead, self.topology.n_nodes, 3), like=self.t)
        for name, copies in self.topology.copies.items():
            x = self.parts[name].positions[..., None, :, :] @ np.swapaxes(self.Q[..., copies.number, :, :], -1, -2)
            x = x + self.t[..., copies.number, None, :]
            positions[..., copies.numbers(), :] = x
        return positions

    @cached_property
    def lengths(self) -> Array:
        """Lengths (..., m), m, of the members of all prototypes."""
        return joined_along([part.length for part in self.parts.values()], -1)

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
        still = {name: PartGeometry(*map(plain, part)) for name, part in self.parts.items()}
        return Geometry(still, Transforms(parts, still), plain(self.Q), plain(self.t), self.topology)

    def one(self, number: int, parts: Mapping[str, Part]) -> Geometry:
        """That of one design of a stack, of the parts."""
        own = {name: part.one(number) for name, part in self.parts.items()}
        Q, t = (field[number] if field.ndim > axes else field for field, axes in ((self.Q, 3), (self.t, 2)))
        return Geometry(own, Transforms(parts, own), Q, t, self.topology)

    def at(self, numbers: Index) -> Array:
        """Positions (..., k, 3), m, of some global nodes (k,)."""
        points, order = [np.empty((0, 3))], [np.empty(0, dtype=np.intp)]
        for name, at, instance, node in self.topology.places(numbers):
            x = np.einsum("...nij,...nj->...ni", self.Q[..., instance, :, :], self.parts[name].positions[..., node, :])
            points.append(x + self.t[..., instance, :])
            order.append(at)
        return joined_along(points, -2)[..., np.argsort(np.concatenate(order)), :]


class Transforms(dict[str, Array]):
    """Element transforms by prototype, worked out when they are first asked for."""

    def __init__(self, parts: Mapping[str, Part], geometry: Mapping[str, PartGeometry]) -> None:
        super().__init__()
        self._parts, self._geometry = parts, geometry

    def __missing__(self, name: str) -> Array:
        T = self[name] = self._parts[name].element_transforms(self._geometry[name])
        return T

    def __reduce__(self) -> tuple[type[Transforms], tuple[object, ...]]:
        return Transforms, (self._parts, self._geometry)
