"""Designs: the numbers of a plan, for one design or for a stack of them, and the matrices that follow from them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.duals import Dual, plain, without_slopes, zeros
from flexura.records import Record
from flexura.structure.elements import Elements, ElementSlice
from flexura.structure.part import DiscreteElement, PartMatrices
from flexura.structure.plan import Plan
from flexura.structure.topology import Geometry


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

    def part_motions(self, names: Collection[str]) -> dict[str, Array]:
        """How superelements of some names are deformed there, (d, 1) each, in right-handed axes: displacements and
        rotations of their nodes as seen from the first, and amplitudes."""
        ...

    def part_motion_changes(self, vectors: Array, names: Collection[str]) -> dict[str, Array]:
        """What small displacements from there, DOF vectors (n, k), change of `part_motions`, (d, k)."""
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


@dataclass(frozen=True, repr=False)
class Design(Record):
    """One design of a plan, or a stack of them along a leading axis.

    `parameters` are those that were replaced, `values` (..., s) the values, `geometry` where everything is at rest, and
    `pose` where one design has moved to (`flexura.motion.at_pose`).
    Matrices have the leading axis of `values`; whatever does not vary along it may lack it. Parameters may be numbers
    with slopes (`Dual`), as in `with_slopes`; all that follows from them then has slopes too.
    """

    _shown = ("name", "parameters")

    plan: Plan
    parameters: Mapping[str, ArrayLike]
    values: Array = field(compare=False)
    geometry: Geometry = field(compare=False)
    pose: Posed | None = field(default=None, compare=False)

    @staticmethod
    def of(plan: Plan, parameters: Mapping[str, ArrayLike] | None = None) -> Design:
        """The design with some parameters replaced, or the stack where these are arrays over designs.

        Raises OptionError for unknown parameters and values outside their bounds.
        """
        return Design.at(plan, plan.values(parameters), parameters or {})

    @staticmethod
    def with_slopes(plan: Plan, parameters: Mapping[str, float], names: Sequence[str], order: int = 1) -> Design:
        """One design; all numbers that follow from it are `Dual`, with slopes by the parameters `names` in their order.

        With `order` 2 the slopes have slopes themselves.

        Raises OptionError as `of` does.
        """
        values = parameters if set(names) <= parameters.keys() else plan.parameter_values(parameters)
        rows = dict(zip(names, np.eye(len(names)), strict=True))
        moved = {name: Dual(np.array(values[name], dtype=float), row) for name, row in rows.items()}
        if order == 2:
            still = np.zeros((len(names), len(names)))
            moved = {name: Dual(value, Dual(rows[name], still)) for name, value in moved.items()}
        return Design.of(plan, {**parameters, **moved})

    @staticmethod
    def at(plan: Plan, values: Array, parameters: Mapping[str, ArrayLike]) -> Design:
        """The design of values (..., s) that have been worked out from these parameters."""
        return Design(plan, dict(parameters), values, plan.geometry(values))

    @cached_property
    def still(self) -> Design:
        """The same design without slopes."""
        if not isinstance(self.values, Dual):
            return self
        parameters = {name: plain(value) for name, value in self.parameters.items()}
        geometry = self.geometry.still(self.plan.parts)
        still = replace(self, parameters=parameters, values=plain(self.values), geometry=geometry)
        vars(still)["_tables"] = _StillTables(self._tables)
        return still

    def stacked(self) -> Design:
        """A stack of this one design."""
        return replace(self, values=self.values[None])

    def one(self, number: int) -> Design:
        """One design of a stack."""
        every = {name: np.broadcast_to(own, len(self.values)) for name, own in self.parameters.items()}
        parameters = {name: float(own[number]) for name, own in every.items()}
        geometry = self.geometry.one(number, self.plan.parts)
        return replace(self, parameters=parameters, values=self.values[number], geometry=geometry)

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.plan.name

    @property
    def posed(self) -> Posed | None:
        """The pose about which the design is linear, None at rest. A pose that is described has to be given."""
        assert self.pose is not None or not self.plan.is_posed, "the described pose is not given"
        return self.pose

    @property
    def positions(self) -> Array:
        """Positions (..., n, 3), m, of all nodes where they are linear about: at rest, or at the pose described."""
        posed = self.posed
        return self.geometry.positions if posed is None else posed.positions

    @cached_property
    def matrices(self) -> dict[str, PartMatrices]:
        """Matrices of every prototype's own part, in its own frame, each worked out when first asked for; prototypes
        without any are left out."""
        matrices, start, tables = {}, 0, self._tables
        for name, part in self.plan.parts.items():
            stop = start + len(part.connectivity)
            if part.has_matrices:
                rest = partial(self.geometry.T.__getitem__, name), partial(tables.discrete_of, name)
                elements = ElementSlice(tables.all_elements, start, stop)
                matrices[name] = PartMatrices(elements, part.connectivity, *rest)
            start = stop
        return matrices

    @cached_property
    def _tables(self) -> _Tables:
        return _Tables(self.plan, self.values, self.geometry)

    @property
    def discrete_elements(self) -> dict[str, list[DiscreteElement]]:
        """Matrices of bodies, point masses, springs and superelements by prototype, in its own frame."""
        return self._tables.discrete_elements

    @property
    def elements(self) -> Elements:
        """The elements of all prototypes in one table."""
        return self._tables.elements

    def node_transforms(self, name: str, nodes: Index) -> Array:
        """G (..., i, nodes, 6, 6): a node's displacement in the part's frame from that of its root, global frame
        (theory eq. 36).

        i counts the placed copies of the prototype. Nodes that are their own root are turned only; others follow
        the root on a rigid arm (eq. 32). Rotations are axial vectors: mirror images turn them the other way. Amplitudes
        are not turned.
        """
        topology, geometry = self.plan.topology, self.geometry
        copies = topology.copies[name]
        number = copies.numbers(nodes)
        turned = np.swapaxes(geometry.turning[..., copies.number, None, :, :], -1, -2)
        slaved = topology.is_rigid[number] & (topology.root[number] != number)
        at = number[slaved]
        arm = geometry.positions[..., at, :] - geometry.positions[..., topology.root[at], :]
        G = zeros((*turned.shape[:-4], *number.shape, 6, 6), turned, arm if slaved.any() else None)
        G[...] = turned
        if slaved.any():
            follows = G[..., slaved, :, :] @ rigid_arm(arm)
            if follows.ndim > G.ndim - 1:
                G = np.broadcast_to(G, (*follows.shape[:-3], *G.shape[-4:])).copy()
            G[..., slaved, :, :] = follows
        G[..., np.asarray(nodes) >= self.plan.parts[name].n_positioned, :, :] = np.eye(6)
        return G

    def node_arms(self, numbers: Index) -> tuple[Array, Index]:
        """D (..., k, 6, 6), displacements of the nodes `numbers` (k,), global frame, from those of their roots, and the
        DOFs (k, 6) of these, -1 where held."""
        topology, x = self.plan.topology, self.positions
        root = topology.root[numbers]
        arm = np.where(topology.is_rigid[numbers, None], x[..., numbers, :] - x[..., root, :], 0.0)
        return rigid_arm(arm), topology.dof[root]

    def node_rows(self, numbers: Index) -> sp.csr_matrix:
        """B (6k, n): displacements of the nodes `numbers` (k,), global frame, from the DOFs of the full-order model.

        One design.
        """
        D, dof = self.node_arms(numbers)
        free = np.broadcast_to((dof >= 0)[:, None, :], D.shape) & (D != 0)
        row = np.broadcast_to(np.arange(6 * len(numbers)).reshape(-1, 6, 1), D.shape)
        column = np.broadcast_to(dof[:, None, :], D.shape)
        return sp.csr_matrix((D[free], (row[free], column[free])), shape=(6 * len(numbers), self.plan.topology.n_dof))

    def dense_rows(self, numbers: Index) -> Array:
        """As `node_rows`, a full array (6k, n), with slopes where the design has them."""
        D, dof = self.node_arms(numbers)
        rows = zeros((len(numbers), 6, self.plan.topology.n_dof + 1), D)
        rows[np.arange(len(numbers))[:, None, None], np.arange(6)[:, None], dof[:, None, :]] = D + 0.0
        return rows[..., :-1].reshape(6 * len(numbers), -1)


class _Tables:
    """What the matrices of a design, or of a stack, are made of, each worked out when first asked for."""

    def __init__(self, plan: Plan, values: Array, geometry: Geometry) -> None:
        self._plan, self._values, self._geometry = plan, values, geometry

    @cached_property
    def elements(self) -> Elements:
        """The elements of all prototypes in one table."""
        return self._plan.elements(self._values, self._geometry)

    @cached_property
    def discrete_elements(self) -> dict[str, list[DiscreteElement]]:
        """Matrices of bodies, point masses, springs and superelements by prototype."""
        parts = self._plan.parts.items()
        bends = any(part.elastic for _, part in parts)
        ends = self._plan.members.end_sizes(self._values, self._geometry.lengths) if bends else None
        return {
            name: part.discrete_elements(self._values, self._geometry.parts[name], ends)
            for name, part in parts
            if part.has_matrices
        }

    def all_elements(self) -> Elements:
        """Those of `elements`."""
        return self.elements

    def discrete_of(self, name: str) -> list[DiscreteElement]:
        """Those of one prototype."""
        return self.discrete_elements[name]


class _StillTables(_Tables):
    """Those of a design without slopes, of which others have some."""

    def __init__(self, moving: _Tables) -> None:
        self._moving = moving

    @cached_property
    def elements(self) -> Elements:
        """As of `_Tables`."""
        return self._moving.elements.still

    @cached_property
    def discrete_elements(self) -> dict[str, list[DiscreteElement]]:
        """As of `_Tables`."""
        return {name: without_slopes(own) for name, own in self._moving.discrete_elements.items()}


class OfDesign:
    """What a model of one design says of it."""

    design: Design

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.design.name

    @property
    def plan(self) -> Plan:
        """The plan of the mechanism."""
        return self.design.plan

    @property
    def parameters(self) -> Mapping[str, ArrayLike]:
        """The parameters that the design replaces."""
        return self.design.parameters

    @property
    def values(self) -> Array:
        """Values (s,) of the design."""
        return self.design.values

    @property
    def geometry(self) -> Geometry:
        """Where everything is in the design at rest."""
        return self.design.geometry

    @property
    def positions(self) -> Array:
        """Positions (n, 3), m, of all nodes where they are."""
        return self.design.positions
