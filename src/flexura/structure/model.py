"""The full-order model of one design, and its linear static state under load with the stiffness that forces add
(theory eqs. P1-P8).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array, Index
from flexura.beam import arm_stiffness
from flexura.duals import Dual, plain, real, zeros
from flexura.errors import OptionError, SolverError
from flexura.linalg import critical_factors, factorise, is_definite
from flexura.records import Kept, Record
from flexura.results import Result
from flexura.structure.assembly import Scatter, block_diagonal, full_order
from flexura.structure.design import Design, OfDesign
from flexura.structure.part import Part, PartMatrices
from flexura.structure.topology import Copies
from flexura.tables import Facts, Item


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

    def presentation(self) -> Iterator[Item]:
        plan = self.plan
        members = sum(len(part.members) * len(plan.topology.copies[name].paths) for name, part in plan.parts.items())
        counts = {"order": self.order, "nodes": plan.topology.n_nodes, "members": members}
        yield Facts({**counts, "bodies": len(plan.body_names) or ""})

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
        follow = np.flatnonzero(topology.is_rigid & (topology.root != np.arange(len(u))))
        arm = self.positions[follow] - self.positions[topology.root[follow]]
        u[follow, :3] += np.cross(u[follow, 3:], arm[:, :, None], axis=1)
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
                nodes = copies.part.superelements[key].nodes
                u = self.node_displacements(vectors)[copies.offset[copy] + np.array(nodes)]
                Q = self.geometry.Q[copies.number[copy]].T
                positioned = len(nodes) - sum(n >= copies.part.n_positioned for n in nodes)
                u[:positioned, :3] = Q @ u[:positioned, :3]
                u[:positioned, 3:] = np.linalg.det(Q).round() * Q @ u[:positioned, 3:]
                amplitudes = (
                    len(self.plan.layout.prototypes[prototype].superelements[key].stiffness.array) - 6 * positioned
                )
                return u.reshape(6 * len(nodes), -1)[: 6 * positioned + amplitudes]
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


@dataclass(frozen=True, repr=False)
class Prestress(Record):
    """A state of load.

    `load` (n,) acts on the DOFs of the full-order model, `displacement` (n,) is the linear static response, `K_g`
    (n, n) the geometric stiffness of that state, and `axial_force` the least and the largest axial force of every
    member as placed, N, tension positive.
    """

    load: Array
    displacement: Array
    K_g: sp.csc_matrix
    axial_force: dict[str, tuple[float, float]]


class Pushes(NamedTuple):
    """Forces (k, 3), N, that rigid arms (k, 3), m, exert at their ends, global axes, and the DOFs (k, 6) of the nodes
    that the arms are at, -1 where held. A dead load at the end of an arm is minus such a force."""

    dof: Index
    force: Array
    arm: Array

    @staticmethod
    def of(dof: Index, force: Array, arm: Array) -> Pushes:
        """Flat arrays from broadcast ones (..., 6), (..., 3) and (..., 3)."""
        lead = np.broadcast_shapes(dof.shape[:-1], force.shape[:-1], arm.shape[:-1])
        vectors = (np.broadcast_to(vector, (*lead, 3)).reshape(-1, 3) for vector in (force, arm))
        return Pushes(np.broadcast_to(dof, (*lead, 6)).reshape(-1, 6), *vectors)


@dataclass(frozen=True)
class Drive:
    """What actuators add to a state: their load (n,), forces on rigid arms, and how far piezo stacks, by name as
    placed, would expand freely, m."""

    load: Array | float = 0.0
    pushes: tuple[Pushes, ...] = ()
    expansion: Mapping[str, float] = field(default_factory=dict)


def prestress(
    model: FullOrderModel, gravity: ArrayLike, wrenches: Mapping[str, Array], drive: Drive | None = None
) -> Prestress:
    """The linear static state of an elastic model under gravity (3,), m/s^2, and dead loads (6,) by node, N and N m.

    Axial forces add the geometric stiffness of members, tension that of piezo stacks as of strings, and forces on rigid
    arms, of members, springs, loads and weights, the stiffness that turning these arms takes (theory eqs. P3-P8).
    Raises OptionError for unknown nodes and superelements between nodes, SolverError when something can move freely.
    """
    drive = drive or Drive()
    load = dead_load(model, gravity, wrenches) + drive.load
    u = solve_definite(model.K, load)
    forces: dict[str, tuple[float, float]] = {}
    K = _geometric(_State(model, np.append(u, 0.0), np.asarray(gravity, dtype=float), drive), wrenches, forces)
    K_g = Scatter([dof for dof, _ in K], model.order).sparse([matrices for _, matrices in K])
    return Prestress(load, u, ((K_g + K_g.T) / 2).tocsc(), forces)


def geometric_forces(model: FullOrderModel, u: Any, X: Array) -> Any:
    """K_g X (n, k) under the loads and gravity that are described, in which the displacement is u (n,).

    The design of the model and u may have slopes; the matrices of the model itself are not used.
    """
    loads, values = model.plan.loads, model.values
    state = _State(model, np.concatenate([u, np.zeros(1)]), loads.gravity(values), Drive())
    padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
    forces = zeros(padded.shape, u, values)
    for dof, matrices in _geometric(state, loads.wrenches(values), {}):
        np.add.at(forces, dof, (matrices + np.swapaxes(matrices, -1, -2)) / 2 @ padded[dof])
    return forces[:-1]


def _geometric(
    state: _State, wrenches: Mapping[str, Array], forces: dict[str, tuple[float, float]]
) -> list[tuple[Index, Any]]:
    """DOFs (e, m), -1 where held, and geometric stiffness (e, m, m) over them of everything in a state of load; notes
    the axial forces of members."""
    K: list[tuple[Index, Array]] = []
    pushes = [*state.drive.pushes, *_loads_on_arms(state.model, wrenches)]
    for name in state.model.matrices:
        part_state = _PartState(state, name)
        part_state.refuse_superelements()
        for part in (
            part_state.members(forces),
            part_state.springs(),
            part_state.diaphragms(),
            part_state.stacks(),
            part_state.bodies(),
            part_state.weights(),
        ):
            for entry in part:
                (pushes if isinstance(entry, Pushes) else K).append(entry)  # type: ignore[arg-type]
    for dof, force, arm in pushes:
        at = _is_some(arm) & _is_some(force)
        if at.any():
            K.append((dof[at, 3:], arm_stiffness(force[at], arm[at])))
    return K


def _is_some(vectors: Any) -> NDArray[Any]:
    """Which vectors (k, 3) are not zero, or have slopes that are not."""
    if isinstance(vectors, Dual):
        return _is_some(vectors.value) | np.any([_is_some(slope) for slope in vectors.slope], axis=0)
    return np.abs(vectors).max(axis=-1, initial=0.0) > 0


def refuse_buckled(K: sp.csc_matrix, K_g: sp.csc_matrix) -> None:
    """Raise SolverError where K + K_g is not definite, with the factor on the loads at which it buckles."""
    if not is_definite((K + K_g).tocsc()):
        factors = critical_factors(K, K_g, 1)
        at = f"it buckles at {factors[0]:.5g} times these" if len(factors) else "no factor on the loads gives where"
        raise SolverError(f"the mechanism has buckled under its loads and gravity: {at}")


def solve_definite(K: sp.csc_matrix, load: Array) -> Array:
    """Static response (n,) or (n, k) to loads. Raises SolverError when something can move freely."""
    if not is_definite(K):
        raise SolverError("something can move freely under the load: hold it, or attach it by a stiffness")
    return factorise(K).solve(load)


def _loads_on_arms(model: FullOrderModel, wrenches: Mapping[str, Array]) -> Iterator[Pushes]:
    topology, x = model.plan.topology, model.geometry.positions
    for node, wrench in wrenches.items():
        number = int(topology.numbers([node])[0])
        root = int(topology.root[number])
        if topology.is_rigid[number] and root != number:
            yield Pushes.of(topology.dof[root], -wrench[:3], x[number] - x[root])


class _State(NamedTuple):
    """A model, its displacements with a zero for what is held (n + 1,), gravity and what actuators add."""

    model: FullOrderModel
    u: Array
    gravity: Array
    drive: Drive


class _PartState:
    """All copies of one prototype in a state of load."""

    def __init__(self, state: _State, name: str) -> None:
        self.state = state
        plan, geometry = state.model.plan, state.model.geometry
        topology = plan.topology
        self.part: Part = plan.parts[name]
        self.matrices: PartMatrices = state.model.matrices[name]
        self.copies: Copies = topology.copies[name]
        self.local_positions = geometry.parts[name].positions
        self.Q = geometry.Q[self.copies.number]
        self.t = geometry.t[self.copies.number]
        self.number = self.copies.numbers()
        self.root = topology.root[self.number]
        self.dof = topology.dof[self.root]
        self.G = state.model.design.node_transforms(name, np.arange(self.part.n_nodes))
        self.v = (self.G @ state.u[self.dof][..., None])[..., 0]
        """Displacements (copies, nodes, 6) in the part's frame."""
        self.pull = self.state.gravity @ self.Q
        """Gravity (copies, 3) in the part's frame."""
        arm = geometry.positions[self.number] - geometry.positions[self.root]
        self.arm = np.where(topology.is_rigid[self.number, None], arm, 0.0)
        """From the node that has the DOFs to each node (copies, nodes, 3), global axes."""

    def _global(self, vectors: Array) -> Array:
        """Vectors (copies, ..., 3) of the part's frame in global axes."""
        return np.einsum("cij,c...j->c...i", self.Q, vectors)

    def _over(self, nodes: list[int] | Index, matrices: Array) -> tuple[Index, Array]:
        """DOFs and matrices over them from symmetric ones (copies, ..., 6n, 6n) over nodes (..., n), part's frame."""
        T = block_diagonal(self.G[:, nodes])
        K = np.swapaxes(T, -1, -2) @ matrices @ T
        return self.dof[:, nodes].reshape(-1, T.shape[-1]), K.reshape(-1, *K.shape[-2:])

    def members(self, forces: dict[str, tuple[float, float]]) -> Iterator[tuple[Index, Array] | Pushes]:
        """Geometric stiffness of the members, and what their ends' arms exert; notes their axial forces."""
        nodes, elements, T = self.part.connectivity, self.matrices.elements, self.matrices.T
        if not len(nodes):
            return
        ends = T @ self.v[:, nodes].reshape(len(self.v), len(nodes), 12, 1)
        weight = zeros(ends.shape, ends, self.pull)
        R = np.stack([T[:, :3, :3], T[:, 6:9, 6:9]], axis=1)
        weight.reshape(*ends.shape[:2], 2, 6)[..., :3] = np.einsum("ebij,cj->cebi", R, self.pull)
        inner = (elements.K @ ends - elements.M @ weight)[..., 0]
        inner = inner + elements.K[..., 9] * self.matrices.twist_shared(self.v[..., None])
        axial = np.stack([-inner[..., 0], inner[..., 6]], axis=-1)
        K = np.einsum("ceb,ebij->ceij", axial, elements.geometric)
        yield self._over(nodes, np.swapaxes(T, -1, -2) @ K @ T)
        six = inner.reshape(*inner.shape[:2], 2, 6)[..., :3]
        offset = np.swapaxes(T.reshape(-1, 2, 6, 2, 6)[:, [0, 1], :, [0, 1]], 0, 1)
        own_arm = _arm_of(np.swapaxes(R, -1, -2) @ offset[..., :3, 3:])
        force, arm = self._global(np.einsum("ebji,cebj->cebi", R, six)), self._global(np.stack([own_arm] * len(self.v)))
        yield Pushes.of(self.dof[:, nodes], force, self.arm[:, nodes] + arm)
        for k, key in enumerate(self.part.members):
            span = plain(axial)[:, self.part.first[k] : self.part.first[k + 1]].reshape(len(self.v), -1)
            low, high = span.min(axis=1), span.max(axis=1)
            forces.update({n: (float(a), float(b)) for n, a, b in zip(self.copies.names(key), low, high, strict=True)})

    def springs(self) -> Iterator[Pushes]:
        """What the arms exert that lead from nodes to the point where a spring is."""
        for spring in self.part.springs.values():
            here = self.local_positions[spring.nodes]
            K = spring.matrix(self.state.model.values, here)
            force = (K @ self.v[:, spring.nodes].reshape(len(self.v), -1, 1)).reshape(len(self.v), -1, 6)[..., :3]
            reach = spring.point(self.state.model.values, here) - here
            arm = self.arm[:, spring.nodes] + self._global(np.stack([reach] * len(self.v)))
            yield Pushes.of(self.dof[:, spring.nodes], self._global(force), arm)

    def diaphragms(self) -> Iterator[tuple[Index, Array] | Pushes]:
        """Geometric stiffness of the diaphragms, and what the arms exert that lead from rims to their centres."""
        values = self.state.model.values
        for diaphragm in self.part.diaphragms.values():
            here = self.local_positions[diaphragm.nodes]
            ends = self.v[:, diaphragm.nodes].reshape(len(self.v), 12)
            yield self._over(diaphragm.nodes, diaphragm.geometric(values, here, ends))
            K, _ = diaphragm.matrices(values, here)
            force = (ends @ K).reshape(-1, 2, 6)[..., :3]
            arm = self.arm[:, diaphragm.nodes] + self._global(np.stack([here[1] - here] * len(self.v)))
            yield Pushes.of(self.dof[:, diaphragm.nodes], self._global(force), arm)

    def bodies(self) -> Iterator[Pushes]:
        """What the arms of bodies that bend exert, from their frames to the nodes that pull at them."""
        for own in self.part.bent_bodies(self.matrices.discrete_elements):
            frame, *nodes = [node for node in own.body.nodes if node < self.part.n_positioned]
            count, v = len(nodes), self.v[:, own.body.nodes]
            weight = zeros(v.shape, v, self.pull)
            weight[:, : count + 1, :3] = self.pull[:, None]
            flat = (len(v), -1, 1)
            held = own.K @ v.reshape(flat) - own.M @ weight.reshape(flat)
            force = held.reshape(v.shape)[:, 1 : count + 1, :3]
            arm = self.local_positions[nodes] - self.local_positions[frame]
            yield Pushes.of(
                self.dof[:, [frame] * count], -self._global(force), self._global(np.stack([arm] * len(self.v)))
            )

    def refuse_superelements(self) -> None:
        """Raise OptionError where forces go through a superelement."""
        for key, nodes in ((key, own.nodes) for key, own in self.part.superelements.items()):
            if sum(node < self.part.n_positioned for node in nodes) > 1:
                name = self.copies.names(key)[0]
                raise OptionError(
                    f"what loads and gravity do to the stiffness of superelement {name} is not known:"
                    " describe it by beams, or leave loads and gravity out"
                )

    def stacks(self) -> Iterator[tuple[Index, Array] | Pushes]:
        """Piezo stacks as strings between their nodes, bonded ones as beams, and what arms exert on them."""
        for key, piezo in self.part.channels.piezos.items():
            x = self.local_positions[piezo.nodes]
            free = np.array([self.state.drive.expansion.get(name, 0.0) for name in self.copies.names(key)])
            ends = self.v[:, piezo.nodes].reshape(len(self.v), 12)
            K, M = piezo.matrices(self.state.model.values, x)
            row = piezo.elongation(x)
            weight = zeros((len(self.v), 2, 6), self.pull)
            weight[..., :3] = self.pull[:, None]
            driven = piezo.stiffness(self.state.model.values) * free[:, None] * row
            inner = ends @ K - weight.reshape(-1, 12) @ M - driven
            pull = (inner * row).reshape(-1, 2, 6).sum(axis=-1)
            yield self._over(piezo.nodes, np.einsum("cb,bij->cij", pull, piezo.geometric(self.state.model.values, x)))
            force = self._global(inner.reshape(-1, 2, 6)[..., :3])
            yield Pushes.of(self.dof[:, piezo.nodes], force, self.arm[:, piezo.nodes])

    def weights(self) -> Iterator[Pushes]:
        """Weights of bodies, point masses, sensors and superelements of one node, where their centres are."""
        for discrete in self.matrices.discrete_elements:
            placed = [node for node in discrete.nodes if node < self.part.n_positioned]
            if len(placed) > 1 or discrete.M is None or not discrete.M[0, 0] > 0:
                continue
            centre = _arm_of(discrete.M[:3, 3:6] / discrete.M[0, 0])
            arm = self.arm[:, placed] + self._global(np.stack([centre[None]] * len(self.v)))
            yield Pushes.of(self.dof[:, placed], -discrete.M[0, 0] * self.state.gravity, arm)


def _arm_of(coupling: Array) -> Array:
    """Arms a (..., 3) from what takes small rotations to displacements of their ends, minus the skew matrix of a."""
    skew = -coupling
    return np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
