"""The full-order model: K and M, sparse, of one design, and what its DOFs are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.duals import real
from flexura.errors import OptionError
from flexura.records import Kept
from flexura.results import Result
from flexura.structure.assembler import full_order
from flexura.structure.design import Design, OfDesign
from flexura.structure.part import PartMatrices
from flexura.tables import Facts, Table


@dataclass(frozen=True, repr=False)
class FullOrderModel(OfDesign, Result):
    """K and M of the full-order model of one design, with what is needed to make sense of a vector of its DOFs.

    K, M: (n, n) sparse, SI; rows follow `dof_names`. They are about the pose that is described, or else K is about the
    state under the loads and gravity that are described.
    """

    _shown = ("name", "order")
    _told = ("name", "order", "parameters", "dof_names", "K", "M")

    design: Design
    K: sp.csc_matrix
    M: sp.csc_matrix
    prepared: Kept = field(default_factory=Kept, init=False, repr=False, compare=False)
    """What later steps have worked out from this model alone, to be used again."""

    @property
    def order(self) -> int:
        """Number of DOFs."""
        return self.K.shape[0]

    @cached_property
    def dof_names(self) -> list[str]:
        """Names of the DOFs in order, e.g. `platform.rz`."""
        return self.plan.topology.dof_names()

    def _view(self) -> Iterator[Facts | Table]:
        own = self.plan
        members = sum(len(part.members) * len(own.topology.copies[name].paths) for name, part in own.parts.items())
        counts = {"order": self.order, "nodes": own.topology.n_nodes, "members": members}
        yield Facts({**counts, "rigid bodies": len(own.body_names) or ""})

    @property
    def matrices(self) -> dict[str, PartMatrices]:
        """Element and discrete element matrices of every prototype's own part, in its own frame."""
        return self.design.matrices

    def node_displacements(self, vectors: Array) -> Array:
        """Displacements (n_nodes, 6, k) of all nodes, global frame, for DOF vectors (n, k); held DOFs are zero.

        Nodes without a position, after the others of each part, hold the amplitudes of superelements.
        """
        topology = self.plan.topology
        padded = np.concatenate([vectors, np.zeros((1, vectors.shape[1]))])
        u = padded[topology.dof[topology.root]]
        arm = self.positions - self.positions[topology.root]
        arm[~topology.is_rigid] = 0.0
        u[:, :3] += np.cross(u[:, 3:], arm[:, :, None], axis=1)
        return u

    def rigid_body_motions(self) -> Array:
        """The DOF vectors (n, 6) of three translations and three rotations about the global origin."""
        topology = self.plan.topology
        nodes, components = np.nonzero(topology.dof >= 0)
        motions = np.zeros((len(nodes), 6))
        x = self.positions[nodes]
        for j in range(3):
            motions[components == j, j] = 1.0
            turn = np.cross(np.eye(3)[j], x)
            translational = components < 3
            motions[translational, 3 + j] = turn[translational, components[translational]]
            motions[components == 3 + j, 3 + j] = 1.0
        motions[~topology.has_position[nodes]] = 0.0
        return motions

    @cached_property
    def base_inertia_forces(self) -> Array:
        """Forces (n, 6) that accelerate everything, what is held included, in unit rigid motions of and about the
        global origin: kg, kg m, kg m^2. Times gravity they are the weight of everything.
        """
        posed = self.design.posed
        return full_order(self.plan).base_inertia_forces(self.design) if posed is None else posed.base_inertia_forces

    @cached_property
    def dead_load(self) -> Array:
        """Load (n,) of the loads and gravity that are described, N and N m."""
        loads = self.plan.loads
        return dead_load(self, loads.gravity(self.values), loads.wrenches(self.values))

    def superelement_coordinates(self, vectors: Array, name: str) -> Array:
        """Coordinates (6k + amplitudes, m) of a placed superelement, in its own frame, for DOF vectors (n, m).

        `name` is written NAME or INSTANCE.NAME. Raises OptionError when there is no such superelement.
        """
        topology = self.plan.topology
        *path, key = name.split(".")
        for prototype, copies in topology.copies.items():
            if tuple(path) in copies.paths and key in copies.part.superelements:
                copy = copies.paths.index(tuple(path))
                nodes, K, _ = copies.part.superelements[key]
                u = self.node_displacements(vectors)[copies.offset[copy] + np.array(nodes)]
                Q = self.geometry.Q[copies.number[copy]].T
                own = len(nodes) - sum(n >= copies.part.n_positioned for n in nodes)
                u[:own, :3] = Q @ u[:own, :3]
                u[:own, 3:] = np.linalg.det(Q).round() * Q @ u[:own, 3:]
                amplitudes = len(self.plan.layout.prototypes[prototype].superelements[key].stiffness.array) - 6 * own
                return u.reshape(len(K), -1)[: 6 * own + amplitudes]
        raise OptionError(f"there is no superelement {name!r}; it is written NAME or INSTANCE.NAME")


def dead_load(model: FullOrderModel, gravity: ArrayLike, wrenches: Mapping[str, Array]) -> Array:
    """Load vector (n,) of the weight of everything and of forces and moments (6,) by node; OptionError for unknown
    nodes."""
    load = model.base_inertia_forces[:, :3] @ real(gravity)
    for node, wrench in wrenches.items():
        D, dof = model.design.node_arms(model.plan.topology.numbers([node]))
        at = dof[0] >= 0
        load[dof[0][at]] += (D[0].T @ wrench)[at]
    return load
