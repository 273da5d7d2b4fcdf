"""The full-order model in coordinates and energies that keep their digits, and its static responses.

The displacements along a serial chain of elements are split into the static shape that its ends impose and the rest,
which is zero at the ends; the two do not share any strain energy (theory eqs. L1-L2). Eigenvalues are those of nodal
coordinates, without the round-off of short stiff elements in the stiffness that holds the mechanism together. The
stiffness comes as strains of chains, elements and springs (`linalg.Pencil`), whose rigid motions cancel exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.errors import SolverError
from flexura.linalg import EPS, Pencil, factorise, is_definite, least_pivot, scaled, static_response, unit_scale
from flexura.records import Record
from flexura.reduction.chains import SegmentChains, element_chains, factor, find_chains, growth, segment_chains
from flexura.structure import (
    TAPERED_PIECES,
    DiscreteElement,
    FullOrderModel,
    Triplets,
    block_diagonal,
    described_prestress,
)

UNIT_SHAPES_AT_ONCE = 2000
"""Coordinates whose shapes are worked out together."""

MOST_PARTS = 50
"""Unconnected parts beyond this number are not looked at one by one."""

RELATIVE_STIFFNESS = 1e-11
"""Relative difference up to which a stiffness over two nodes is that of their relative displacement."""

WELL = 1e-8
"""A pivot of the diagonally scaled stiffness above this costs no digit that matters."""

LOST_WORK = 1e-7
"""Work that round-off in the stored stiffness may do, over that of the loads, from which it is done without; what is
lost in truth is some 30 times less."""

FLOATING_SHIFT = 1e-3
"""Shift of something that floats, over the lowest diagonal ratio of stiffness to mass."""

POSED_WORK_SETTLED = 1e-4
"""Root of the work of loads about a pose, relative, that may be lost: displacements there are nodal, and keep as many
digits as these have."""

FREE = "something can move freely under the load: hold it, or attach it by a stiffness"


@dataclass(frozen=True, repr=False)
class ChainedModel(Record):
    """The full-order model, or a refinement of it, over DOFs of chain ends and discrete elements, then displacements
    of the segment ends within chains relative to their static shape, in segment axes.

    `position` (full order,) is the coordinate of every full-order DOF, -1 within chains; `first` is the first
    coordinate of every set of chains.
    """

    _shown = ("model",)

    model: FullOrderModel
    chains: list[SegmentChains]
    first: list[int]
    position: Index
    pencil: Pencil

    def recover(self, vectors: Array) -> Array:
        """Full-order DOF vectors (full order, k) for vectors (n, k) of the coordinates."""
        full = np.zeros((len(self.position), vectors.shape[1]))
        full[self.position >= 0] = vectors[self.position[self.position >= 0]]
        dof = self.model.plan.topology.dof
        for chains, numbers, inner in self._with_nodes_inside:
            c, end = chains.ends_passed
            relative = vectors[inner][:, c, end]
            moved = self._static_twists(chains, numbers, full) + np.linalg.inv(chains.far[c, end]) @ relative
            full[dof[numbers[:, :, 1:-1]]] = chains.outward(self.model) @ moved
        return full

    def coordinates(self, full: Array) -> Array:
        """Vectors (n, k) of the coordinates for full-order DOF vectors (full order, k), elements not refined."""
        vectors = np.zeros((self.pencil.order, full.shape[1]))
        vectors[self.position[self.position >= 0]] = full[self.position >= 0]
        dof = self.model.plan.topology.dof
        for chains, numbers, inner in self._with_nodes_inside:
            moved = np.linalg.inv(chains.outward(self.model)) @ full[dof[numbers[:, :, 1:-1]]]
            vectors[inner] = chains.far @ (moved - self._static_twists(chains, numbers, full))
        return vectors

    def forces(self, full: Array) -> Array:
        """Forces (n, k) on the coordinates for forces (full order, k) on full-order DOFs: the adjoint of `recover`."""
        topology, forces = self.model.plan.topology, np.zeros((self.pencil.order, full.shape[1]))
        forces[self.position[self.position >= 0]] = full[self.position >= 0]
        for chains, numbers, inner in self._with_nodes_inside:
            c, end = chains.ends_passed
            wrenches = chains.outward(self.model).mT @ full[topology.dof[numbers[:, :, 1:-1]]]
            forces[inner[:, c, end]] = np.linalg.inv(chains.far[c, end]).mT @ wrenches
            at_ends = chains.transforms(self.model).mT @ (chains.interior_twists.mT @ wrenches).sum(axis=2)
            place = _columns(self.model, self.position, numbers[:, :, [0, -1]])
            np.add.at(forces, place[place >= 0], at_ends[place >= 0])
        return forces

    @property
    def _with_nodes_inside(self) -> Iterator[tuple[SegmentChains, Index, Index]]:
        """Chains with nodes inside, their global nodes (copies, c, e + 1) and the coordinates of their segment ends."""
        for chains, first in zip(self.chains, self.first, strict=True):
            numbers = chains.numbers(self.model)
            if numbers.shape[2] > 2:
                yield chains, numbers, chains.inner_coordinates(first, len(numbers))

    def _static_twists(self, chains: SegmentChains, numbers: Index, full: Array) -> Array:
        """Static twists (copies, c, e - 1, 6, k) of nodes inside chains that the displacements of their ends impose."""
        topology = self.model.plan.topology
        padded = np.concatenate([full, np.zeros((1, full.shape[1]))])
        ends = padded[topology.dof[topology.root[numbers[:, :, [0, -1]]]]].reshape(*numbers.shape[:2], 12, -1)
        return chains.interior_twists @ (chains.transforms(self.model) @ ends)[:, :, None]

    @cached_property
    def rigid_motions(self) -> Array:
        """Translations and rotations (n, 6 c) of each of c unconnected parts about its middle; those that are grounded
        strain their supports."""
        topology, x = self.model.plan.topology, self.model.positions
        pencil = self.pencil
        parts, part_of = connected_components(abs(pencil.K) + abs(pencil.M), directed=False)
        if parts > MOST_PARTS:
            parts, part_of = 1, np.zeros(pencil.order, dtype=np.intp)
        nodes, components = np.nonzero((topology.dof >= 0) & topology.has_position[:, None])
        at = self.position[topology.dof[nodes, components]]
        kept = at >= 0
        nodes, components, at = nodes[kept], components[kept], at[kept]
        motions = [np.zeros((pencil.order, 0))]
        for part in range(parts):
            inside = part_of[at] == part
            if inside.any():
                arms = rigid_arm(x[nodes[inside]] - x[nodes[inside]].mean(axis=0))
                motion = np.zeros((pencil.order, 6))
                motion[at[inside]] = arms[np.arange(int(inside.sum())), components[inside]]
                motions.append(motion)
        return np.hstack(motions)

    @cached_property
    def free_motions(self) -> int:
        """How many independent rigid motions strain nothing: their energy is not above its own round-off."""
        motions = self.rigid_motions
        size = np.sqrt(np.einsum("ik,ik->k", motions, self.pencil.M @ motions))
        if not (size > 0).any():
            return 0
        values, vectors = self.pencil.ritz(motions[:, size > 0] / size[size > 0])
        return int((values <= self.pencil.margin(vectors)).sum())


def _columns(model: FullOrderModel, position: Index, numbers: Index) -> Index:
    """Coordinates (..., 6k) of the DOFs of nodes (..., k), -1 where held."""
    topology = model.plan.topology
    dof = topology.dof[topology.root[numbers]].reshape(*numbers.shape[:-1], -1)
    return np.where(dof >= 0, position[dof], -1)


def chained(
    model: FullOrderModel,
    pieces: int | None = None,
    tapered_pieces: int = TAPERED_PIECES,
    geometric: sp.csc_matrix | None = None,
) -> ChainedModel:
    """The full-order model in relative coordinates of its serial chains, with every element cut into `pieces`.

    Without `pieces` elements stay as they are. Cut ones are uniform: a tapered element stands as at most
    `tapered_pieces` of them, each cut into `pieces` (`Elements.cut`). `geometric` (n, n) is the geometric stiffness of
    the state of load that the model is about, by default that of the loads that are described. At a pose members are
    bent, and coordinates are the DOFs themselves. Raises OptionError for numbers below one, and for pieces at a pose.
    """
    if pieces is not None or geometric is not None:
        return _chained(model, pieces, tapered_pieces, geometric)
    return model.prepared.once("chained", lambda: _chained(model, None, tapered_pieces, None))


def _chained(
    model: FullOrderModel, pieces: int | None, tapered_pieces: int, geometric: sp.csc_matrix | None
) -> ChainedModel:
    """The model as `chained` has it, worked out anew."""
    plan = model.plan
    if model.design.posed is not None:
        if pieces is not None:
            plan.refuse_pose("elements that are cut")
        loose = 1.0 + float(np.abs(model.positions).max(initial=0.0)) / _shortest(model)
        return ChainedModel(model, [], [], np.arange(model.order), Pencil.assembled(model.K, model.M, loose))
    chains: list[SegmentChains] = []
    for name in model.matrices:
        if len(plan.parts[name].connectivity):
            groups = find_chains(plan.parts[name])
            if pieces is None:
                chains += element_chains(model, name, groups)
            else:
                chains += segment_chains(model, name, groups, pieces, tapered_pieces)
    inside = np.zeros(model.order, dtype=bool)
    for group in chains:
        inside[plan.topology.dof[group.numbers(model)[:, :, 1:-1]]] = True
    position = np.where(inside, -1, np.cumsum(~inside) - 1)
    sizes = [len(group.numbers(model)) * group.X.shape[0] * (group.X.shape[1] - 1) * 6 for group in chains]
    *first, n = np.cumsum([(~inside).sum(), *sizes]).tolist()
    sums = _Sums(model, position, n)
    for group, start in zip(chains, first, strict=True):
        sums.add_chains(group, start)
        sums.add_strips(group, start)
    for name, matrices in model.matrices.items():
        resisted = plan.parts[name].resisted(model.values, model.geometry.parts[name])
        for discrete, strain in zip(matrices.discrete_elements, resisted, strict=True):
            sums.add_discrete(name, discrete, strain)
    unstressed = ChainedModel(model, chains, first, position, sums.pencil())
    if geometric is None and plan.is_loaded:
        geometric = described_prestress(model.design).K_g
    return unstressed if geometric is None else _stressed(unstressed, sums, geometric)


def _stressed(full: ChainedModel, sums: _Sums, K_g: sp.csc_matrix) -> ChainedModel:
    """The model with a geometric stiffness, which is added in these coordinates."""
    n, columns = full.pencil.order, []
    for first in range(0, n, UNIT_SHAPES_AT_ONCE):
        columns.append(sp.csc_matrix(full.recover(np.eye(n, min(UNIT_SHAPES_AT_ONCE, n - first), -first))))
    T = sp.hstack(columns, format="csc")
    return replace(full, pencil=sums.pencil((T.T @ K_g @ T).tocsc()))


def _shortest(model: FullOrderModel) -> float:
    """Length of the shortest member, m; infinite where there is none."""
    return min((float(g.length.min()) for g in model.geometry.parts.values() if g.length.size), default=np.inf)


class _Sums:
    """Strains, mass and what else is stiff, summed over chains and discrete elements."""

    def __init__(self, model: FullOrderModel, position: Index, n: int) -> None:
        self.model, self.position = model, position
        positions = [model.geometry.positions, *(g.positions for g in model.geometry.parts.values())]
        self.reach = max((float(np.abs(x).max(initial=0.0)) for x in positions), default=0.0)
        """The largest coordinate, m: positions are right to its round-off."""
        self._strain, self._spread = Triplets(0, n), Triplets(0, n)
        self._rest, self._mass = Triplets(n, n), Triplets(n, n)

    def pencil(self, added: Any = None) -> Pencil:
        """The eigenvalue problem of the sums, and of a stiffness (n, n) `added` to them."""
        M, rest = self._mass.matrix(), self._rest.matrix()
        rest = rest if added is None else rest + added
        strain, spread = self._strain.matrix().tocsr(), self._spread.matrix().tocsr()
        loose = 1.0 + self.reach / _shortest(self.model)
        rest = ((rest + rest.T) / 2).tocsc() if rest.nnz else None
        return Pencil.from_strain(strain, spread, rest, ((M + M.T) / 2).tocsc(), loose)

    def add_strain(self, at: Index, f: Array, B: Array, G: Array | None = None, grown: Array | float = 1.0) -> None:
        """Add strains f B G (..., r, m) over coordinates `at` (..., m): f of the relative displacements B of G.

        Round-off in positions turns up in B and G beside rotations, up to the largest coordinate; without G there are
        none. That in f has `grown` (...,) times.
        """
        r = f.shape[-2]
        move = B if G is None else B @ G
        size = np.abs(B) if G is None else np.abs(B) @ np.abs(G)
        size = size * np.asarray(grown)[..., None, None]
        if G is not None:
            turning = np.arange(move.shape[-1]) % 6 >= 3
            size = size + self.reach * turning * (np.abs(move).max(axis=-1, keepdims=True) > 0)
        first = self._strain.shape[0]
        count = int(np.prod(at.shape[:-1]))
        rows = first + np.arange(count * r).reshape(*at.shape[:-1], r)
        for sums, values in ((self._strain, f @ move), (self._spread, np.abs(f) @ size)):
            sums.shape = (first + count * r, sums.shape[1])
            sums.add(rows, at, values)

    def add_discrete(self, name: str, discrete: DiscreteElement, resisted: tuple[Array, Array] | None) -> None:
        """Add all copies of a discrete element of a prototype: as strain where it resists a displacement or a
        relative one."""
        plan, geometry = self.model.plan, self.model.geometry
        numbers = np.array(plan.topology.copies[name].offset, dtype=np.intp)[:, None] + np.array(discrete.nodes)
        at = _columns(self.model, self.position, numbers)
        G = block_diagonal(self.model.design.node_transforms(name, np.array(discrete.nodes)))
        Gt = G.mT
        if discrete.M is not None:
            self._mass.add(at, at, Gt @ discrete.M @ G)
        if discrete.K is None:
            return
        if resisted is None:
            strain = _strain_of(discrete, geometry.parts[name].positions[discrete.nodes])
        else:
            strain = factor(resisted[0]), resisted[1]
        if strain is None:
            self._rest.add(at, at, Gt @ discrete.K @ G)
        else:
            f, B = (np.broadcast_to(A, (len(G), *A.shape)) for A in strain)
            self.add_strain(at, f, B, G)

    def add_chains(self, chains: SegmentChains, first: int) -> None:
        """Add all copies of equal chains."""
        numbers = chains.numbers(self.model)
        ends = _columns(self.model, self.position, numbers[:, :, [0, -1]])
        G = chains.transforms(self.model)
        Gt = G.mT
        # displacements of a segment's ends: V for those of the chain's ends, S for its own two relative displacements
        P = np.concatenate([chains.shares[:, :-1], chains.shares[:, 1:]], axis=-2)
        V = np.concatenate([chains.X, np.zeros_like(chains.X)], axis=-1)
        V[..., :6, 6:] = chains.X[..., :6, :] @ P[..., :6, :]
        V[..., 6:, 6:] = chains.X[..., 6:, :] @ P[..., 6:, :]
        V = V @ chains.ends[:, None]
        S = np.broadcast_to(np.eye(12), chains.m.shape).copy()
        S[:, 1:, :6, :6] = chains.X[:, 1:, :6] @ np.linalg.inv(chains.far)
        mV, St = chains.m @ V, S.mT
        f = np.broadcast_to(chains.strain, (*ends.shape[:-1], 6, 6))
        self.add_strain(ends, f, chains.ends[:, 6:], G, growth(chains.strain, chains.running[:, -1]))
        self._mass.add(ends, ends, Gt @ np.einsum("csij,csik->cjk", V, mV) @ G)
        if chains.X.shape[1] == 1:
            return
        inner = chains.inner_coordinates(first, len(numbers))
        pad = np.full((*inner.shape[:2], 1, 6), -1)
        both = np.concatenate([np.concatenate([pad, inner], axis=2), np.concatenate([inner, pad], axis=2)], axis=-1)
        f = np.broadcast_to(chains.segment_strain, (len(numbers), *chains.segment_strain.shape))
        grown = growth(chains.segment_strain[..., 6:], chains.C)
        self.add_strain(both, f, np.broadcast_to(S, (len(numbers), *S.shape)), grown=grown)
        self._mass.add(both, both, np.broadcast_to(St @ chains.m @ S, (len(numbers), *chains.m.shape)))
        coupling = St @ mV
        at_end = coupling[:, :-1, 6:] + coupling[:, 1:, :6]
        at_end, ends = at_end @ G[:, :, None], np.broadcast_to(ends[:, :, None], (*inner.shape[:3], 12))
        self._mass.add(inner, ends, at_end)
        self._mass.add(ends, inner, at_end.mT)

    def add_strips(self, chains: SegmentChains, first: int) -> None:
        """Add what resists torque that varies along strips, all copies.

        The static shape between the ends of chains has none, so that this is of the displacements inside alone.
        """
        copies, (c, e) = len(chains.numbers(self.model)), chains.nodes.shape
        if e < 3:
            return
        at_nodes = chains.ends_passed
        inner = chains.inner_coordinates(first, copies)[:, *at_nodes].reshape(copies, -1, 6)
        place = np.full(int(chains.nodes.max()) + 1, -1)
        place[chains.nodes[:, 1:-1]] = np.arange(c * (e - 2)).reshape(c, e - 2)
        moved = rigid_arm(chains.arms[:, 1:-1]) @ chains.axes.mT[:, None] @ np.linalg.inv(chains.far[at_nodes])
        moved = moved.reshape(-1, 6, 6)
        for strips in self.model.matrices[chains.name].strips:
            for nodes, torque, N in zip(strips.nodes, strips.torque, strips.N, strict=True):
                at = np.where(nodes < len(place), place[np.minimum(nodes, len(place) - 1)], -1)
                if (at[1:-1] < 0).any():
                    continue
                G = np.where((at < 0)[:, None, None], 0.0, moved[at])
                columns = np.where((at < 0)[:, None], -1, inner[:, at]).reshape(copies, -1)
                f, B = (np.broadcast_to(A, (copies, *A.shape)) for A in (factor(N), torque @ block_diagonal(G)))
                self.add_strain(columns, f, B)


def _strain_of(discrete: DiscreteElement, positions: Array) -> tuple[Array, Array] | None:
    """f (6, 6) and B (6, 6k) with B' f' f B the stiffness of a discrete element over one or two nodes; None where it
    is no such."""
    K = discrete.K
    assert K is not None
    if len(K) == 6:
        f, B = factor(K), np.eye(6)
    elif len(K) == 12 and len(positions) == 2:
        f = factor(K[6:, 6:])
        B = np.hstack([-rigid_arm(positions[1] - positions[0]), np.eye(6)])
    else:
        return None
    size = np.sqrt(np.abs(np.diagonal(K)))
    off = np.abs(B.T @ f.T @ f @ B - K) > RELATIVE_STIFFNESS * np.outer(size, size)
    return None if off.any() else (f, B)


@dataclass(frozen=True)
class Flexibility:
    """(K + shift M)^-1 of a model: displacements (n, k) for loads (n, k).

    `shift`, (rad/s)^2, is zero for something that is held, else a small squared frequency (theory eq. T9).
    """

    shift: float
    solve: Callable[[Array], Array]

    def __call__(self, loads: Array) -> Array:
        return self.solve(loads)

    def held(self, loads: Array) -> Array:
        """K^-1 loads. Raises SolverError when something can move freely."""
        if self.shift:
            raise SolverError(FREE)
        return self.solve(loads)


def stored_flexibility(K: Any, M: Any, shift: float | None = None) -> Flexibility:
    """That of matrices (n, n) as they are stored; with the shift that they need unless it is given."""
    if shift is None:
        shift = 0.0 if is_definite(K) else _near_zero(K, M)
    A = K + shift * M if shift else K
    if not isinstance(A, np.ndarray):
        return Flexibility(shift, factorise(A).solve)
    d = unit_scale(A)
    factor = la.cho_factor(scaled(A, d))
    return Flexibility(shift, lambda loads: d[:, None] * la.cho_solve(factor, d[:, None] * loads))


def flexibility(model: FullOrderModel) -> Flexibility:
    """That of a full-order model: where K as it is stored would lose digits, in relative coordinates and by energies.

    Digits are lost where a soft direction is held by stiff members only (a small pivot), and where many short elements
    bend as one: their K u is a small difference of large forces. That is seen once displacements are known.

    Raises SolverError where even those are lost.
    """
    if least_pivot(model.K) <= WELL:
        return _by_energies(model)
    stored = stored_flexibility(model.K, model.M, 0.0)

    def solve(loads: Array) -> Array:
        moved = stored(loads)
        return moved if lost_work(model.K, moved, loads) <= LOST_WORK else _by_energies(model)(loads)

    return Flexibility(0.0, solve)


def _by_energies(model: FullOrderModel) -> Flexibility:
    """That in relative coordinates, of something that may float."""
    full = chained(model)
    if model.design.posed is not None:  # stable, which has been looked at
        return Flexibility(0.0, lambda loads: static_response(full.pencil, loads, settled=POSED_WORK_SETTLED))
    shift = 0.0 if _is_held(full) else _near_zero(model.K, model.M)
    if shift and least_pivot(model.K + shift * model.M) > WELL:
        return stored_flexibility(model.K, model.M, shift)
    return Flexibility(shift, lambda loads: full.recover(static_response(full.pencil, full.forces(loads), shift)))


def lost_work(K: Any, moved: Array, loads: Array) -> float:
    """The most that round-off in K (n, n) as it is stored changes the work of loads (n, k) on their displacements,
    relative."""
    size = np.abs(moved)
    lost = EPS * np.einsum("ik,ik->k", size, abs(K) @ size)
    work = np.abs(np.einsum("ik,ik->k", moved, loads))
    return float(np.divide(lost, work, out=np.where(lost > 0, np.inf, 0.0), where=work > 0).max(initial=0.0))


def _is_held(full: ChainedModel) -> bool:
    """True when no rigid motion is free, and a response to loads on everything comes to stand."""
    if full.free_motions:
        return False
    try:
        static_response(full.pencil, np.sqrt(np.maximum(full.pencil.K.diagonal(), 0.0))[:, None])
    except SolverError:
        return False
    return True


def _near_zero(K: Any, M: Any) -> float:
    k, m = K.diagonal(), M.diagonal()
    ratio = k[(m > 0) & (k > 0)] / m[(m > 0) & (k > 0)]
    return FLOATING_SHIFT * float(ratio.min()) if len(ratio) else 1.0
