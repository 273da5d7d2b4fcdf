"""The full-order model: every node of every placed part, K and M sparse (the RPR paper, eqs. 19-20)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.beam import MASS_BASIS, STIFFNESS_BASIS, rigid_arm
from flexura.errors import OptionError
from flexura.mechanism.substructure import Mechanism
from flexura.records import Kept, Latest
from flexura.results import Result
from flexura.structure.part import Lump, PartMatrices
from flexura.structure.plan import Geometry, Plan, one_design, plan_of
from flexura.structure.prestress import Prestress, dead_load, prestress, refuse_buckled
from flexura.structure.representable import refuse_unrepresentable
from flexura.structure.scatter import Scatter, block_diagonal
from flexura.structure.slots import Index

Array = NDArray[np.float64]


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
        lumps = [
            (_dofs(self._dofs[name], np.array([nodes])), has_K, has_M)
            for name in self._names
            for nodes, has_K, has_M in plan.parts[name].lump_nodes()
        ]
        n = plan.topology.n_dof
        stiff, massive = [dofs for dofs, has_K, _ in lumps if has_K], [dofs for dofs, _, has_M in lumps if has_M]
        self._stiffness = Scatter([*members, *stiff], n)
        same = all(has_K and has_M for _, has_K, has_M in lumps)
        self._mass = self._stiffness if same else Scatter([*members, *massive], n)
        self._lump_stiffness, self._lump_mass = Scatter(stiff, n), Scatter(massive, n)
        self._transformed: Latest[dict[str, Array]] = Latest()
        self._prepared: tuple[Geometry, sp.csr_matrix, sp.csr_matrix] | None = None
        self._stressed: Latest[Prestress] = Latest()

    def _node_dofs(self, name: str) -> Index:
        """DOF numbers (i, nodes, 6) of the roots of all nodes of a prototype's placed copies."""
        topology = self.plan.topology
        number = np.array(topology.placed[name].offset)[:, None] + np.arange(self.plan.parts[name].n_nodes)
        return topology.dof[topology.root[number]]

    def __call__(self, values: Array, geometry: Geometry) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K (N/m, N, N m) and M (kg, kg m, kg m^2), both (n, n), for slot values (s,), about the state of load that is
        described (theory eq. P6).

        Raises SolverError beyond buckling, and as `prestress` does.
        """
        K, M = self.elastic(values, geometry)
        return (K + self.prestress(values, geometry).K_g if self.plan.is_loaded else K).tocsc(), M

    def prestress(self, values: Array, geometry: Geometry) -> Prestress:
        """The state under the loads and gravity that are described, the last one kept.

        Raises SolverError beyond buckling, and as `prestress` does.
        """

        def found() -> Prestress:
            model = FullOrderModel(self.plan, {}, values, geometry, *self.elastic(values, geometry))
            state = prestress(model, self.plan.loads.gravity(values), self.plan.loads.wrenches(values))
            refuse_buckled(model.K, state.K_g)
            return state

        return self._stressed.get(values.tobytes(), found)

    def elastic(self, values: Array, geometry: Geometry) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K and M, both (n, n), for slot values (s,), without any load."""
        transforms = self._transforms(geometry)
        if self._prepared is not None and self._prepared[0] is geometry:
            coefficients = self.plan.element_coefficients(values, geometry)
            return self.from_coefficients(*coefficients, self.plan.lumps(values, geometry))
        matrices = self.plan.matrices(values, geometry)
        lumps_K, lumps_M = self._lumps({name: part.lumps for name, part in matrices.items()}, transforms)
        K: list[Array] = []
        M: list[Array] = []
        for name, G in transforms.items():
            elements = matrices[name].elements
            T = matrices[name].T @ block_diagonal(G[:, self.plan.parts[name].connectivity])
            Tt = np.swapaxes(T, -1, -2)
            K.append(Tt @ elements.K @ T)
            M.append(Tt @ elements.M @ T)
        return self._stiffness.sparse([*K, *lumps_K]), self._mass.sparse([*M, *lumps_M])

    def lumped(self, values: Array, geometry: Geometry) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K and M (n, n) of springs, superelements, bodies and point masses alone."""
        lumps_K, lumps_M = self._lumps(self.plan.lumps(values, geometry), self._transforms(geometry))
        return self._lump_stiffness.sparse(lumps_K), self._lump_mass.sparse(lumps_M)

    def dissipation(
        self, values: Array, geometry: Geometry, default: float = 0.0
    ) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """C (N s/m, N s, N m s) of dashpots and H (N/m, N, N m) of structural damping, K + i H, both (n, n).

        H sums the stiffness of every part times its loss factor, `default` where it has none (theory eq. T5). One
        design.
        """
        transforms = self._transforms(geometry)
        matrices = self.plan.matrices(values, geometry)
        C: list[Array] = []
        H: list[Array] = []
        lumps: list[Array] = []
        places: list[Index] = []
        for name, G in transforms.items():
            part, own = self.plan.parts[name], matrices[name]
            eta = part.table.loss_factors(values, default)
            T = own.T @ block_diagonal(G[:, part.connectivity])
            H.append(np.swapaxes(T, -1, -2) @ (eta[:, None, None] * own.elements.K) @ T)
            for lump, loss in zip(own.lumps, part.lump_losses(values, default), strict=True):
                if lump.K is not None:
                    T = block_diagonal(G[:, lump.nodes])
                    lumps.append(np.swapaxes(T, -1, -2) @ (loss * lump.K) @ T)
            for dashpot, matrix in zip(
                part.dashpots.values(), part.dashpot_matrices(values, geometry.parts[name]), strict=True
            ):
                T = block_diagonal(G[:, dashpot.nodes])
                C.append(np.swapaxes(T, -1, -2) @ matrix @ T)
                places.append(_dofs(self._dofs[name], np.array([dashpot.nodes])))
        return Scatter(places, self.plan.topology.n_dof).sparse(C), self._stiffness.sparse([*H, *lumps])

    def carried(self, values: Array, geometry: Geometry) -> Array:
        """Forces (n, 6) on the DOFs that it takes to accelerate everything, what is held included, in unit rigid
        motions of and about the global origin: kg, kg m, kg m^2. One design.

        This is M times `rigid_body_motions` and, beside it, the inertia of members between free and held nodes.
        """
        topology, found = self.plan.topology, np.zeros((self.plan.topology.n_dof + 1, 6))
        matrices = self.plan.matrices(values, geometry)
        for name, G in self._transforms(geometry).items():
            part, own = self.plan.parts[name], matrices[name]
            number = np.array(topology.placed[name].offset)[:, None] + np.arange(part.n_nodes)
            rigid = rigid_arm(geometry.positions[topology.root[number]])
            rigid[~topology.has_place[number]] = 0.0
            groups = [(part.connectivity, own.T, own.elements.M)]
            groups += [(np.array([u.nodes]), np.eye(6 * len(u.nodes)), u.M) for u in own.lumps if u.M is not None]
            for nodes, turn, M in groups:
                T = turn @ block_diagonal(G[:, nodes])
                force = np.swapaxes(T, -1, -2) @ (M @ (T @ rigid[:, nodes].reshape(*T.shape[:-1], 6)))
                np.add.at(found, self._dofs[name][:, nodes].reshape(T.shape[:-1]), force)
        return found[:-1]

    def prepare(self, geometry: Geometry) -> None:
        """Work out the linear map from element coefficients to K and M for designs with this geometry.

        Needs memory for some 25 matrices of 12 x 12 per placed element while it works.
        """
        transforms = self._transforms(geometry)
        bases_K, bases_M = [], []
        for name, G in transforms.items():
            T = geometry.T[name] @ block_diagonal(G[:, self.plan.parts[name].connectivity])
            T = T[:, :, None]
            Tt = np.swapaxes(T, -1, -2)
            bases_K.append(Tt @ STIFFNESS_BASIS.reshape(-1, 12, 12) @ T)
            bases_M.append(Tt @ MASS_BASIS.reshape(-1, 12, 12) @ T)
        self._prepared = (geometry, self._stiffness.linear(bases_K), self._mass.linear(bases_M))

    def from_coefficients(
        self, of_K: Array, of_M: Array, lumps: dict[str, list[Lump]]
    ) -> tuple[sp.csc_matrix, sp.csc_matrix]:
        """K and M for the prepared geometry from `Plan.element_coefficients` and `Plan.lumps`.

        Raises OptionError when nothing has been prepared.
        """
        if self._prepared is None:
            raise OptionError("prepare the assembler with a geometry first")
        geometry, map_K, map_M = self._prepared
        lumps_K, lumps_M = self._lumps(lumps, self._transforms(geometry))
        return self._stiffness.sparse(lumps_K, map_K @ of_K), self._mass.sparse(lumps_M, map_M @ of_M)

    def _transforms(self, geometry: Geometry) -> dict[str, Array]:
        """Transforms of the nodes by prototype, kept while the geometry stays the same."""

        def found() -> dict[str, Array]:
            count = {name: self.plan.parts[name].n_nodes for name in self._names}
            return {name: self.plan.node_transforms(name, np.arange(n), geometry) for name, n in count.items()}

        return self._transformed.get(geometry, found)

    @staticmethod
    def _lumps(lumps: dict[str, list[Lump]], transforms: dict[str, Array]) -> tuple[list[Array], list[Array]]:
        K: list[Array] = []
        M: list[Array] = []
        for name, own_lumps in lumps.items():
            for lump in own_lumps:
                T = block_diagonal(transforms[name][:, lump.nodes])
                for out, own in ((K, lump.K), (M, lump.M)):
                    if own is not None:
                        out.append(np.swapaxes(T, -1, -2) @ own @ T)
        return K, M


def _dofs(dof: Index, nodes: Index) -> Index:
    """DOFs (i * elements, 6 * ends) of elements over `nodes` (elements, ends) in all copies."""
    return dof[:, nodes].reshape(-1, 6 * nodes.shape[-1])


@dataclass(frozen=True, repr=False)
class FullOrderModel(Result):
    """K and M of the full-order model, with what is needed to make sense of a vector of its DOFs.

    K, M: (n, n) sparse, SI; rows follow `dof_names`. K is about the state under the loads and gravity that are
    described.
    """

    _shown = ("name", "order")
    _told = ("name", "order", "parameters", "dof_names", "K", "M")

    plan: Plan
    parameters: Mapping[str, ArrayLike]
    values: Array
    geometry: Geometry
    K: sp.csc_matrix
    M: sp.csc_matrix
    prepared: Kept = field(default_factory=Kept, init=False, repr=False, compare=False)
    """What later steps have worked out from this model alone, to be used again."""

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.plan.mechanism.name

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
        """Displacements (n_nodes, 6, k) of all nodes, global frame, for DOF vectors (n, k); held DOFs are zero.

        Nodes without a place, after the others of each part, hold the amplitudes of superelements.
        """
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
        motions[~topology.has_place[nodes]] = 0.0
        return motions

    @cached_property
    def carried(self) -> Array:
        """Forces (n, 6) that accelerate everything, what is held included, in unit rigid motions of and about the
        global origin: kg, kg m, kg m^2. Times gravity they are the weight of everything.
        """
        return self.plan.full_order.carried(self.values, self.geometry)

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
        for prototype, placed in topology.placed.items():
            if tuple(path) in placed.paths and key in placed.part.superelements:
                copy = placed.paths.index(tuple(path))
                nodes, K, _ = placed.part.superelements[key]
                u = self.node_displacements(vectors)[placed.offset[copy] + np.array(nodes)]
                Q = self.geometry.Q[placed.number[copy]].T
                own = len(nodes) - sum(n >= placed.part.n_placed for n in nodes)
                u[:own, :3] = Q @ u[:own, :3]
                u[:own, 3:] = np.linalg.det(Q).round() * Q @ u[:own, 3:]
                amplitudes = len(self.plan.layout.prototypes[prototype].superelements[key].stiffness.array) - 6 * own
                return u.reshape(len(K), -1)[: 6 * own + amplitudes]
        raise OptionError(f"there is no superelement {name!r}; it is written NAME or INSTANCE.NAME")


@verb
def assemble(mechanism: Mechanism | Plan, parameters: Mapping[str, ArrayLike] | None = None) -> FullOrderModel:
    """Assemble the full-order model, for the default parameters or with some of them replaced.

    Raises ModelError for a description that cannot be used, OptionError for unknown parameters and what cannot be
    loaded, and SolverError when its loads and gravity buckle it.
    """
    plan, single, values, geometry = design(mechanism, parameters)
    return FullOrderModel(plan, single, values, geometry, *plan.full_order(values, geometry))


def unloaded(
    mechanism: Mechanism | Plan | FullOrderModel, parameters: Mapping[str, ArrayLike] | None = None
) -> FullOrderModel:
    """The full-order model as `assemble` makes it, with the elastic stiffness alone whatever loads are described.

    Raises OptionError for parameters beside a model that is assembled already.
    """
    plan, single, values, geometry = design(mechanism, parameters)
    if isinstance(mechanism, FullOrderModel):
        own = mechanism
        return replace(own, K=plan.full_order.elastic(values, geometry)[0]) if plan.is_loaded else own
    return FullOrderModel(plan, single, values, geometry, *plan.full_order.elastic(values, geometry))


def design(
    mechanism: Mechanism | Plan | FullOrderModel, parameters: Mapping[str, ArrayLike] | None
) -> tuple[Plan, dict[str, float], Array, Geometry]:
    """Plan, replaced parameters, slot values and geometry of one design, which can be assembled.

    Raises ModelError and OptionError as `assemble` does, and OptionError for parameters beside an assembled model.
    """
    if isinstance(mechanism, FullOrderModel):
        if parameters:
            raise OptionError("parameters belong to a mechanism, not to an assembled model")
        return mechanism.plan, one_design(mechanism.parameters), mechanism.values, mechanism.geometry
    plan, single = plan_of(mechanism), one_design(parameters)
    plan.verify(single)
    values = plan.values(single)
    geometry = plan.geometry(values)
    with np.errstate(all="ignore"):  # what is not finite is refused by name
        refuse_unrepresentable(plan, plan.matrices(values, geometry))
    return plan, single, values, geometry
