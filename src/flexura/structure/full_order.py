"""The full-order model: every node of every placed part, K and M sparse (the RPR paper, eqs. 19-20)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.mechanism.substructure import Mechanism
from flexura.structure.part import PartMatrices
from flexura.structure.plan import Geometry, Plan
from flexura.structure.scatter import Scatter
from flexura.structure.slots import Index

Array = NDArray[np.float64]


class FullOrderAssembler:
    """Assembles K and M of a plan; the index work is done once."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._names = [name for name, part in plan.parts.items() if part.has_matrices]
        stiff, heavy = [], []
        for name in self._names:
            part, dof = plan.parts[name], self.node_dofs(name)
            stiff.append(_dofs(dof, part.connectivity))
            heavy.append(_dofs(dof, part.connectivity))
            for nodes, has_K, has_M in part.lump_nodes():
                lump = _dofs(dof, np.array([nodes]))
                stiff += [lump] if has_K else []
                heavy += [lump] if has_M else []
        self._stiffness = Scatter(stiff, plan.topology.n_dof)
        self._mass = Scatter(heavy, plan.topology.n_dof)
        self._remembered: tuple[Geometry, list[Array]] | None = None

    def node_dofs(self, name: str) -> Index:
        """DOF numbers (i, nodes, 6) of the roots of all nodes of a prototype's placed copies."""
        topology = self.plan.topology
        number = np.array(topology.placed[name].offset)[:, None] + np.arange(self.plan.parts[name].n_nodes)
        return topology.dof[topology.root[number]]

    def __call__(self, values: Array, geometry: Geometry) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K (N/m, N, N m) and M (kg, kg m, kg m^2), both (n, n), for slot values (s,)."""
        K: list[Array] = []
        M: list[Array] = []
        transforms = self._transforms(geometry)
        matrices = self.plan.matrices(values, geometry)
        for name, G in zip(self._names, transforms, strict=True):
            self._place(self.plan.parts[name].connectivity, matrices[name], G, K, M)
        return self._stiffness.sparse(K), self._mass.sparse(M)

    def _transforms(self, geometry: Geometry) -> list[Array]:
        """Transforms of the nodes, kept while the geometry stays the same."""
        if self._remembered is None or self._remembered[0] is not geometry:
            G = [
                self.plan.node_transforms(name, np.arange(self.plan.parts[name].n_nodes), geometry)
                for name in self._names
            ]
            self._remembered = (geometry, G)
        return self._remembered[1]

    @staticmethod
    def _place(connectivity: Index, part: PartMatrices, G: Array, K: list[Array], M: list[Array]) -> None:
        elements = part.elements
        T = part.T @ block_diagonal(G[:, connectivity])
        Tt = np.swapaxes(T, -1, -2)
        for out, own in ((K, elements.K), (M, elements.M)):
            out.append((Tt @ own @ T).reshape(-1, 12, 12))
        for lump in part.lumps:
            T = block_diagonal(G[:, lump.nodes])
            for out, own in ((K, lump.K), (M, lump.M)):
                if own is not None:
                    out.append(np.swapaxes(T, -1, -2) @ own @ T)


def block_diagonal(blocks: Array) -> Array:
    """Blocks (..., k, 6, 6) on the diagonal of (..., 6k, 6k)."""
    k = blocks.shape[-3]
    out = np.zeros((*blocks.shape[:-3], 6 * k, 6 * k))
    for i in range(k):
        out[..., 6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = blocks[..., i, :, :]
    return out


def _dofs(dof: Index, nodes: Index) -> Index:
    """DOFs (i * elements, 6 * ends) of elements over `nodes` (elements, ends) in all copies."""
    return dof[:, nodes].reshape(-1, 6 * nodes.shape[-1])


@dataclass(frozen=True)
class FullOrderModel:
    """K and M of the full-order model, with what is needed to make sense of a vector of its DOFs.

    K, M: (n, n) sparse, SI; rows follow `dof_names`.
    """

    plan: Plan
    parameters: Mapping[str, ArrayLike]
    values: Array
    geometry: Geometry
    K: sp.csc_matrix
    M: sp.csc_matrix

    @property
    def order(self) -> int:
        """Number of DOFs."""
        return self.K.shape[0]

    @cached_property
    def dof_names(self) -> list[str]:
        """Names of the DOFs in order, e.g. `platform.rz`."""
        return self.plan.topology.dof_names()

    @cached_property
    def matrices(self) -> dict[str, PartMatrices]:
        """Element and lump matrices of every prototype's own part, in its own frame."""
        return self.plan.matrices(self.values, self.geometry)

    def node_displacements(self, vectors: Array) -> Array:
        """Displacements (n_nodes, 6, k) of all nodes, global frame, for DOF vectors (n, k); held DOFs are zero."""
        topology = self.plan.topology
        padded = np.concatenate([vectors, np.zeros((1, vectors.shape[1]))])
        u = padded[topology.dof[topology.root]]
        arm = self.geometry.positions - self.geometry.positions[topology.root]
        arm[~topology.is_rigid] = 0.0
        u[:, :3] += np.cross(u[:, 3:], arm[:, :, None], axis=1)
        return u

    def rigid_body_motions(self) -> Array:
        """The DOF vectors (n, 6) of three translations and three rotations about the global origin."""
        topology = self.plan.topology
        nodes, components = np.nonzero(topology.dof >= 0)
        motions = np.zeros((len(nodes), 6))
        x = self.geometry.positions[nodes]
        for j in range(3):
            motions[components == j, j] = 1.0
            turn = np.cross(np.eye(3)[j], x)
            translational = components < 3
            motions[translational, 3 + j] = turn[translational, components[translational]]
            motions[components == 3 + j, 3 + j] = 1.0
        return motions


def assemble(
    mechanism: Mechanism | Plan, parameters: Mapping[str, ArrayLike] | None = None
) -> FullOrderModel:
    """Assemble the full-order model, for the default parameters or with some of them replaced.

    Raises ModelError for a description that cannot be used and OptionError for unknown parameters.
    """
    plan = mechanism if isinstance(mechanism, Plan) else Plan(mechanism)
    values = plan.values(parameters)
    geometry = plan.geometry(values)
    K, M = plan.full_order(values, geometry)
    return FullOrderModel(plan, dict(parameters or {}), values, geometry, K, M)
