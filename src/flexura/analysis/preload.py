"""Statics under dead loads and gravity, stiffness and frequencies about that state, and where it buckles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import ArrayLike, NDArray

from flexura.analysis.numbers import finite_numbers
from flexura.beam import element_mass, element_stiffness
from flexura.beam.geometric import arm_stiffness, geometric_stiffness
from flexura.errors import Exceeded, OptionError, SolverError, Warned
from flexura.linalg import count_below, factorise, is_definite, lowest
from flexura.mechanism.substructure import Mechanism
from flexura.structure import FullOrderModel, Plan, assemble
from flexura.structure.scatter import Scatter
from flexura.structure.segments import Segments, segments
from flexura.systems.placed import PlacedInput, Placement

Array = NDArray[np.float64]

DENSE = 1200
"""Up to this order buckling loads come from a dense solver."""


ROUNDING = 1e-8
"""Relative size of an eigenvalue of K_g beside K that is round-off: a load that buckles nothing."""


@dataclass(frozen=True)
class Preload(Warned):
    """A mechanism under dead loads.

    `load` (n,) acts on the DOFs of `model`, `displacement_vector` (n,) is the linear static response, `K_g` (n, n) the
    geometric stiffness of that state, and `axial_force` the least and the largest axial force of every member, N,
    tension positive.
    """

    model: FullOrderModel
    load: Array
    displacement_vector: Array
    K_g: sp.csc_matrix
    axial_force: dict[str, tuple[float, float]]

    @cached_property
    def warnings(self) -> tuple[Exceeded, ...]:
        """That the loads are beyond buckling, when they are."""
        if not is_definite(self.model.K) or is_definite(self.stiffness()):
            return ()
        factor = self.buckling_factor
        text = f"buckled: the loads are {1 / factor:.3g} times those at which the mechanism buckles"
        return (Exceeded("buckling", "", 1 / factor, 1.0, "1", text),)

    def stiffness(self, factor: float = 1.0) -> sp.csc_matrix:
        """K (n, n) about the state under `factor` times the loads."""
        return (self.model.K + factor * self.K_g).tocsc()

    def displacement(self, node: str, factor: float | None = None) -> Array:
        """Displacement (6,) of a node, m and rad, global frame: linear, or with the stiffness about the state under
        `factor` times the loads. Raises OptionError for unknown nodes and SolverError beyond buckling."""
        u = self.displacement_vector
        if factor is not None:
            u = factor * _solve(self._definite(factor), self.load)
        plan = self.model.plan
        return np.asarray(plan.node_rows(plan.topology.numbers([node]), self.model.geometry) @ u)

    def natural_frequencies(self, n: int = 6, factor: float = 1.0) -> Array:
        """The `n` lowest natural frequencies, Hz, about the state under `factor` times the loads.

        Raises SolverError when that state is beyond buckling.
        """
        values = lowest(self._definite(factor), self.model.M, min(n, self.model.order)).values
        return np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi)

    @cached_property
    def buckling_factor(self) -> float:
        """The lowest factor on all loads together at which the mechanism buckles; infinite when it does not."""
        factors = self.buckling_factors(1)
        return float(factors[0]) if len(factors) else np.inf

    def buckling_factors(self, n: int = 3) -> Array:
        """The `n` lowest positive factors (k,) on all loads at which K + factor K_g is singular (theory eq. P7).

        Fewer when there are fewer. The first is confirmed by inertia counts. Raises OptionError for n below one,
        SolverError when the unloaded mechanism can move freely or the counts contradict.
        """
        if n < 1:
            raise OptionError(f"the number of buckling factors is at least 1, not {n}")
        K = self.model.K
        if not is_definite(K):
            raise SolverError("something can move freely without load: there is nothing to buckle")
        d = 1 / np.sqrt(K.diagonal())
        D = sp.diags(d)
        Ks, Gs = (D @ K @ D).tocsc(), (D @ self.K_g @ D).tocsc()
        count = min(n, K.shape[0])
        if K.shape[0] <= DENSE:
            mu = la.eigh(Gs.toarray(), Ks.toarray(), eigvals_only=True, subset_by_index=[0, count - 1])
        else:
            inverse = spla.LinearOperator(Ks.shape, matvec=factorise(Ks).solve, dtype=float)
            mu = spla.eigsh(Gs, k=count, M=Ks, Minv=inverse, which="SA", return_eigenvectors=False)
        factors = np.sort(-1 / mu[mu < -ROUNDING * max(float(abs(Gs).max()), 1e-300)])
        if len(factors):
            sides = (self.stiffness(f * factors[0]) for f in (1 - 1e-4, 1 + 1e-4))
            below, above = (count_below(K, self.model.M, 0.0) for K in sides)
            if below or not above:
                raise SolverError("inertia counts do not confirm the buckling factor")
        return factors

    def _definite(self, factor: float) -> sp.csc_matrix:
        K = self.stiffness(factor)
        if is_definite(self.model.K) and not is_definite(K):
            first = self.buckling_factor
            raise SolverError(f"buckled under {factor:g} times the loads: it buckles at {first:.5g} times")
        return K


def preload(
    mechanism: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, float] | None = None,
    *,
    gravity: Sequence[float] | None = None,
    loads: Mapping[str, ArrayLike] | None = None,
    actuators: Mapping[str, float] | None = None,
) -> Preload:
    """The state of a mechanism under gravity, (3,) m/s^2, dead loads, (6,) N and N m by node, global frame, and
    actuator commands in the units of their inputs, by name.

    Axial forces of the linear static response give the geometric stiffness of members and, as of strings, of piezo
    stacks; forces on rigid arms, of members, loads and weights, add the stiffness that turning these arms takes (theory
    eqs. P4-P6).

    Raises ModelError; OptionError for unknown nodes and actuators, impossible loads, moved bases, tapered elements and
    springs on rigid arms; SolverError when something can move freely under the load.
    """
    model = mechanism if isinstance(mechanism, FullOrderModel) else assemble(mechanism, parameters)
    if isinstance(mechanism, FullOrderModel) and parameters:
        raise OptionError("parameters belong to a mechanism, not to an assembled model")
    g = finite_numbers("gravity", gravity if gravity is not None else (0.0, 0.0, 0.0), 3)
    cut = segments(model)
    if cut.n != model.order:
        raise OptionError("preload is for stepped elements: set integration: stepped on tapered flexures")
    refuse_springs_on_arms(model)
    T = cut.transforms
    Tt = np.swapaxes(T, -1, -2)
    own_loads = _segment_weights(cut, g)
    load = model.carried[:, :3] @ g
    plan = model.plan
    arms = []
    for node, value in (loads or {}).items():
        force = finite_numbers(f"load on {node}", value, 6)
        number = plan.topology.numbers([node])
        load += plan.node_rows(number, model.geometry).T @ force
        root = plan.topology.root[number[0]]
        arm = model.geometry.positions[number[0]] - model.geometry.positions[root]
        if plan.topology.is_rigid[number[0]]:
            arms.append((plan.topology.dof[root], -force[:3], arm))
    driven = _driven(model, actuators or {})
    load = load + sum((value * own.load for own, value in driven), np.zeros(model.order))
    u = _solve(model.K, load)
    arms += _pushed_arms(model, driven, u)
    ends = np.append(u, 0.0)[cut.dof.reshape(-1, 12)]
    inner = (element_stiffness(cut.beam)[cut.kind] @ (T @ ends[..., None]))[..., 0] - own_loads
    axial = (inner[:, 6] - inner[:, 0]) / 2
    own = Tt @ geometric_stiffness(axial, cut.beam.take(cut.kind)) @ T
    K_g = cut.scatter().sparse([own]) + _arm_stiffness(cut, inner, arms, g) + _stack_stiffness(model, driven, u)
    spans = {m.name: axial[m.segments.start : m.segments.stop] for m in cut.members}
    forces = {name: (float(f.min()), float(f.max())) for name, f in spans.items()}
    return Preload(model, load, u, ((K_g + K_g.T) / 2).tocsc(), forces)


def _driven(model: FullOrderModel, actuators: Mapping[str, float]) -> list[tuple[PlacedInput, float]]:
    """Described actuators and those named, with their commands."""
    place = Placement(model.plan, model.values, model.geometry)
    named = [(own, float(value)) for name, value in actuators.items() for own in place.inputs([name])]
    if any(own.base is not None or not np.isfinite(value) for own, value in named):
        raise OptionError("commands are finite numbers of forces, moments and piezo stacks; a base at rest is assumed")
    known = {own.channel.name for own, _ in named}
    return named + [(own, 0.0) for own in place.inputs(place.actuators) if own.channel.name not in known]


def _pushed_arms(
    model: FullOrderModel, driven: list[tuple[PlacedInput, float]], u: Array
) -> list[tuple[NDArray[np.intp], Array, Array]]:
    """Rigid arms that actuators push on: DOFs of the node that has them, minus the force, the arm."""
    topology, found = model.plan.topology, []
    for own, value in driven:
        force = value if own.stiffness is None else own.stiffness * (own.stroke * value - float(own.row @ u))
        for node in own.nodes:
            root = topology.root[node]
            if topology.is_rigid[node] and root != node:
                dof = topology.dof[root]
                push = force * np.append(own.row, 0.0)[dof[:3]]
                found.append((dof, -push, model.geometry.positions[node] - model.geometry.positions[root]))
    return found


def _stack_stiffness(model: FullOrderModel, driven: list[tuple[PlacedInput, float]], u: Array) -> sp.csc_matrix:
    """Geometric stiffness of piezo stacks as strings (theory eq. P8): their tension over their length, across them."""
    K = sp.csc_matrix((model.order, model.order))
    for own, value in driven:
        if own.stiffness is None:
            continue
        tension = own.stiffness * (float(own.row @ u) - own.stroke * value)
        axis = np.diff(model.geometry.positions[list(own.nodes)], axis=0)[0]
        length = float(np.linalg.norm(axis))
        rows = model.plan.node_rows(np.array(own.nodes, dtype=np.intp), model.geometry).tocsr()
        across = sp.csr_matrix(np.eye(3) - np.outer(axis, axis) / length**2) @ (rows[6:9] - rows[:3])
        K = K + tension / length * (across.T @ across)
    return sp.csc_matrix(K)


def refuse_springs_on_arms(model: FullOrderModel, stacks: bool = False) -> None:
    """Raise OptionError where a spring or superelement (or piezo stack) pulls on a rigid arm: how its force turns is
    not known."""
    topology = model.plan.topology
    for name, placed in topology.placed.items():
        part = model.plan.parts[name]
        ends = [n for spring in part.springs.values() for n in spring.nodes]
        ends += [n for nodes, *_ in part.superelements.values() for n in nodes]
        if stacks:
            ends += [n for piezo in part.channels.piezos.values() for n in piezo.nodes]
        number = np.array(placed.offset, dtype=np.intp)[:, None] + np.array(sorted(set(ends)), dtype=np.intp)
        if (topology.is_rigid[number] & (topology.root[number] != number)).any():
            where = name or "the mechanism"
            what = "spring, superelement or piezo stack" if stacks else "spring or superelement"
            raise OptionError(f"a {what} of {where} is attached off a body's centre: use a short link")


def _solve(K: sp.csc_matrix, load: Array) -> Array:
    d = 1 / np.sqrt(K.diagonal())
    if not is_definite(K):
        raise SolverError("something can move freely under the load: hold it, or attach it by a stiffness")
    D = sp.diags(d)
    return d * factorise((D @ K @ D).tocsc()).solve(d * load)


def _segment_weights(cut: Segments, g: Array) -> Array:
    """Consistent loads (s, 12) of the members' weight in segment axes."""
    local = np.zeros((len(cut.kind), 12))
    local[:, :3] = cut.X[:, 0, :3, :3] @ g
    local[:, 6:9] = cut.X[:, 1, :3, :3] @ g
    return (element_mass(cut.beam)[cut.kind] @ local[..., None])[..., 0]


def _arm_stiffness(
    cut: Segments, inner: Array, arms: list[tuple[NDArray[np.intp], Array, Array]], g: Array
) -> sp.csc_matrix:
    """Stiffness of rigid arms that carry forces on the members, on the rotation of their node (theory eq. P5); dead
    loads count with the opposite sign."""
    R = cut.X[..., :3, :3]
    Rt = np.swapaxes(R, -1, -2)
    skew = -Rt @ cut.X[..., :3, 3:]
    a = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1).reshape(-1, 3)
    f = (Rt @ inner.reshape(-1, 2, 6)[..., :3, None])[..., 0].reshape(-1, 3)
    dof = cut.dof.reshape(-1, 6)
    for dofs, force, arm in (*arms, *_weights_of_lumps(cut, g)):
        a, f, dof = np.vstack([a, arm]), np.vstack([f, force]), np.vstack([dof, dofs])
    return Scatter([dof[:, 3:]], cut.n).sparse([arm_stiffness(f, a)])


def _weights_of_lumps(cut: Segments, g: Array) -> list[tuple[NDArray[np.intp], Array, Array]]:
    """Weights of bodies and masses whose centre is off the node with the DOFs: its DOFs, minus the weight, the arm."""
    topology = cut.model.plan.topology
    found = []
    M = cut.M.tocsr()
    for node in np.flatnonzero((topology.dof >= 0).all(axis=1)):
        dofs = topology.dof[node]
        own = M[dofs][:, dofs].toarray()
        mass = own[0, 0]
        if mass > 0:
            moment = own[3:, :3] / mass
            arm = np.array([moment[2, 1], moment[0, 2], moment[1, 0]])
            if np.abs(arm).max() > 0:
                found.append((dofs, -mass * g, arm))
    return found
