"""Assembling K, M and damping of the full order, with the index work done once for a plan."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.beam import MASS_BASIS, STIFFNESS_BASIS, rigid_arm
from flexura.duals import zeros
from flexura.errors import OptionError
from flexura.records import Latest
from flexura.structure.design import Design
from flexura.structure.part import DiscreteElement
from flexura.structure.plan import Plan
from flexura.structure.scatter import Scatter, block_diagonal
from flexura.structure.value_table import Index


class FullOrderAssembler:
    """Assembles K and M of a plan (theory eq. 38); the index work is done once.

    For one geometry, K and M are linear in a few numbers per element (EA/L, EI/L^3, rho A L, ...). `prepare` works out
    that linear map, after which designs that share the geometry are assembled by one sparse product each.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._names = [name for name, part in plan.parts.items() if part.has_matrices]
        self._dofs = {name: self._node_dofs(name) for name in self._names}
        members = [_dofs(self._dofs[name], plan.parts[name].connectivity) for name in self._names]
        discrete_elements = [
            (_dofs(self._dofs[name], np.array([nodes])), has_K, has_M)
            for name in self._names
            for nodes, has_K, has_M in plan.parts[name].discrete_nodes()
        ]
        n = plan.topology.n_dof
        stiff, massive = (
            [dofs for dofs, has_K, _ in discrete_elements if has_K],
            [dofs for dofs, _, has_M in discrete_elements if has_M],
        )
        self._stiffness = Scatter([*members, *stiff], n)
        same = all(has_K and has_M for _, has_K, has_M in discrete_elements)
        self._mass = self._stiffness if same else Scatter([*members, *massive], n)
        self._discrete_stiffness, self._discrete_mass = Scatter(stiff, n), Scatter(massive, n)
        self._transformed: Latest[dict[str, Array]] = Latest()
        self._prepared: tuple[Design, sp.csr_matrix, sp.csr_matrix] | None = None

    def _node_dofs(self, name: str) -> Index:
        """DOF numbers (i, nodes, 6) of the roots of all nodes of a prototype's placed copies."""
        topology = self.plan.topology
        number = np.array(topology.copies[name].offset)[:, None] + np.arange(self.plan.parts[name].n_nodes)
        return topology.dof[topology.root[number]]

    def elastic(self, design: Design) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K (N/m, N, N m) and M (kg, kg m, kg m^2), both (n, n), of one design without any load."""
        if self._prepared is not None and self._prepared[0].geometry is design.geometry:
            return self.from_coefficients(*design.element_coefficients(), design.discrete_elements())
        transforms, matrices = self._transforms(design), design.matrices
        discrete_K, discrete_M = self._discrete(
            {name: part.discrete_elements for name, part in matrices.items()}, transforms
        )
        K: list[Array] = []
        M: list[Array] = []
        for name, G in transforms.items():
            elements = matrices[name].elements
            T = matrices[name].T @ block_diagonal(G[:, self.plan.parts[name].connectivity])
            Tt = np.swapaxes(T, -1, -2)
            K.append(Tt @ elements.K @ T)
            M.append(Tt @ elements.M @ T)
        return self._stiffness.sparse([*K, *discrete_K]), self._mass.sparse([*M, *discrete_M])

    def discrete_matrices(self, design: Design) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K and M (n, n) of springs, superelements, bodies and point masses alone."""
        discrete_K, discrete_M = self._discrete(design.discrete_elements(), self._transforms(design))
        return self._discrete_stiffness.sparse(discrete_K), self._discrete_mass.sparse(discrete_M)

    def dissipation(self, design: Design, default: float = 0.0) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """C (N s/m, N s, N m s) of dashpots and H (N/m, N, N m) of structural damping, K + i H, both (n, n).

        H sums the stiffness of every part times its loss factor, `default` where it has none (theory eq. T5). One
        design.
        """
        values, matrices = design.values, design.matrices
        C: list[Array] = []
        H: list[Array] = []
        discrete_elements: list[Array] = []
        places: list[Index] = []
        for name, G in self._transforms(design).items():
            part, own = self.plan.parts[name], matrices[name]
            eta = part.table.loss_factors(values, default)
            T = own.T @ block_diagonal(G[:, part.connectivity])
            H.append(np.swapaxes(T, -1, -2) @ (eta[:, None, None] * own.elements.K) @ T)
            for discrete, loss in zip(own.discrete_elements, part.discrete_losses(values, default), strict=True):
                if discrete.K is not None:
                    T = block_diagonal(G[:, discrete.nodes])
                    discrete_elements.append(np.swapaxes(T, -1, -2) @ (loss * discrete.K) @ T)
            for dashpot, matrix in zip(
                part.dashpots.values(), part.dashpot_matrices(values, design.geometry.parts[name]), strict=True
            ):
                T = block_diagonal(G[:, dashpot.nodes])
                C.append(np.swapaxes(T, -1, -2) @ matrix @ T)
                places.append(_dofs(self._dofs[name], np.array([dashpot.nodes])))
        return Scatter(places, self.plan.topology.n_dof).sparse(C), self._stiffness.sparse([*H, *discrete_elements])

    def base_inertia_forces(self, design: Design) -> Array:
        """Forces (n, 6) on the DOFs that it takes to accelerate everything, what is held included, in unit rigid
        motions of and about the global origin: kg, kg m, kg m^2. One design.

        This is M times `rigid_body_motions` and, beside it, the inertia of members between free and held nodes.
        """
        topology, found = self.plan.topology, zeros((self.plan.topology.n_dof + 1, 6), design.values)
        for name, G in self._transforms(design).items():
            part, own = self.plan.parts[name], design.matrices[name]
            number = np.array(topology.copies[name].offset)[:, None] + np.arange(part.n_nodes)
            rigid = rigid_arm(design.geometry.positions[topology.root[number]])
            rigid[~topology.has_position[number]] = 0.0
            groups = [(part.connectivity, own.T, own.elements.M)]
            groups += [
                (np.array([u.nodes]), np.eye(6 * len(u.nodes)), u.M) for u in own.discrete_elements if u.M is not None
            ]
            for nodes, turn, M in groups:
                T = turn @ block_diagonal(G[:, nodes])
                force = np.swapaxes(T, -1, -2) @ (M @ (T @ rigid[:, nodes].reshape(*T.shape[:-1], 6)))
                np.add.at(found, self._dofs[name][:, nodes].reshape(T.shape[:-1]), force)
        return found[:-1]

    def prepare(self, design: Design) -> None:
        """Work out the linear map from element coefficients to K and M for designs with the geometry of this one.

        Needs memory for some 25 matrices of 12 x 12 per placed element while it works.
        """
        bases_K, bases_M = [], []
        for name, G in self._transforms(design).items():
            T = design.geometry.T[name] @ block_diagonal(G[:, self.plan.parts[name].connectivity])
            T = T[:, :, None]
            Tt = np.swapaxes(T, -1, -2)
            bases_K.append(Tt @ STIFFNESS_BASIS.reshape(-1, 12, 12) @ T)
            bases_M.append(Tt @ MASS_BASIS.reshape(-1, 12, 12) @ T)
        self._prepared = (design, self._stiffness.linear(bases_K), self._mass.linear(bases_M))

    def from_coefficients(
        self, of_K: Array, of_M: Array, discrete_elements: dict[str, list[DiscreteElement]]
    ) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K and M for the prepared geometry from `Design.element_coefficients` and `Design.discrete_elements`.

        Raises OptionError when nothing has been prepared.
        """
        if self._prepared is None:
            raise OptionError("prepare the assembler with a geometry first")
        design, map_K, map_M = self._prepared
        discrete_K, discrete_M = self._discrete(discrete_elements, self._transforms(design))
        return self._stiffness.sparse(discrete_K, map_K @ of_K), self._mass.sparse(discrete_M, map_M @ of_M)

    def _transforms(self, design: Design) -> dict[str, Array]:
        """Transforms of the nodes by prototype, kept while the geometry stays the same."""

        def found() -> dict[str, Array]:
            count = {name: self.plan.parts[name].n_nodes for name in self._names}
            return {name: design.node_transforms(name, np.arange(n)) for name, n in count.items()}

        return self._transformed.get(design.geometry, found)

    @staticmethod
    def _discrete(
        discrete_elements: dict[str, list[DiscreteElement]], transforms: dict[str, Array]
    ) -> tuple[list[Array], list[Array]]:
        K: list[Array] = []
        M: list[Array] = []
        for name, own_elements in discrete_elements.items():
            for discrete in own_elements:
                T = block_diagonal(transforms[name][:, discrete.nodes])
                for out, own in ((K, discrete.K), (M, discrete.M)):
                    if own is not None:
                        out.append(np.swapaxes(T, -1, -2) @ own @ T)
        return K, M


def _dofs(dof: Index, nodes: Index) -> Index:
    """DOFs (i * elements, 6 * ends) of elements over `nodes` (elements, ends) in all copies."""
    return dof[:, nodes].reshape(-1, 6 * nodes.shape[-1])


def full_order(plan: Plan) -> FullOrderAssembler:
    """The prepared full-order assembly of a plan, made on first use and kept with the plan."""
    return plan.prepared.once("full_order", lambda: FullOrderAssembler(plan))
