"""The pseudo-rigid-body model: rigid links and bodies between flexures that are springs (Howell and Midha 1994; Howell
2001), in space, with all six components of every flexure's stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.errors import OptionError
from flexura.linalg import lowest
from flexura.methods.solution import Solution
from flexura.reduction import ChainGroup, SegmentChains, segment_chains
from flexura.structure import FullOrderModel, Part, Triplets, block_diagonal, full_order, node_dofs

RANK = 1e-9
"""Motions that supports hold less than this, relative, are free."""


@dataclass(frozen=True)
class RigidBodies:
    """Nodes that move together.

    `body` (n_nodes,) numbers the rigid body of every root, -1 for nodes inside flexures and those that are no roots;
    `reference` (b,) is the node whose displacement is the body's; `Z` (6 b, r) takes the free coordinates to them.
    """

    body: Index
    reference: Index
    Z: sp.csc_matrix

    @property
    def count(self) -> int:
        """Number of bodies that can move."""
        return len(np.unique(self.Z.tocoo().row // 6))


@dataclass(frozen=True)
class PseudoRigidBodyModel:
    """K and M (r, r) of the free coordinates of the rigid bodies; `recovery` (full order, r) gives all DOFs."""

    bodies: RigidBodies
    K: sp.csc_matrix
    M: sp.csc_matrix
    recovery: sp.csc_matrix
    note: str


def pseudo_rigid_body(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies with rigid links and bodies on flexures as springs (theory eqs. L4-L6).

    A flexure is its exact 6 x 6 static stiffness, all notches and tapers included; one half of its mass moves with
    either end as a rigid piece. Links are rigid, but for those that turn more easily under a moment than the stiffest
    flexure does: they are springs as well. The order is six for every rigid body, less what supports hold. Good for low
    frequencies while links are much stiffer, and flexures much lighter, than what they connect; there are no modes
    within members. Raises OptionError when nothing is compliant or nothing can move, and SolverError.
    """
    own = pseudo_rigid_body_model(model)
    pairs = lowest(own.K, own.M, count)
    finite = np.isfinite(pairs.values)
    if not finite.any():
        raise OptionError("the mechanism has no mass")
    hz = np.sqrt(np.maximum(pairs.values[finite], 0.0)) / (2 * np.pi)
    shapes = model.node_displacements(np.asarray(own.recovery @ pairs.vectors[:, finite]))
    return Solution("pseudo-rigid-body", own.K.shape[0], hz, shapes, own.note)


def pseudo_rigid_body_model(model: FullOrderModel) -> PseudoRigidBodyModel:
    """K, M and recovery of the pseudo-rigid-body model.

    Raises OptionError when nothing is compliant, or when rigid links tie everything to ground.
    """
    springs, links, compliant = _members(model)
    parts = model.plan.parts.values()
    if not springs and not any(part.springs or part.superelements for part in parts):
        raise OptionError(
            "the pseudo-rigid-body model takes links as rigid, and this mechanism has nothing else;"
            " describe its compliant members as flexures"
        )
    bodies = rigid_bodies(model, springs, links)
    if bodies.Z.shape[1] == 0:
        raise OptionError(
            "with links taken as rigid nothing in this mechanism can move; describe its compliant members as flexures"
        )
    n = 6 * len(bodies.reference)
    K, M, recovery = Triplets(n, n), Triplets(n, n), Triplets(model.order, n)
    _add_rigid_rows(model, bodies, recovery)
    rigid = recovery.matrix()
    for chains in springs:
        at, T = _to_bodies(model, bodies, chains)
        between = (at[..., 0] != at[..., 6])[..., None, None]  # else the flexure cannot deform
        K.add(at, at, between * (np.swapaxes(T, -1, -2) @ chains.end_stiffness @ T))
        M.add(at, at, np.swapaxes(T, -1, -2) @ _end_masses(chains, chains.X.shape[1] // 2) @ T)
        rows = chains.outward(model) @ (chains.interior_twists @ T[:, :, None])
        columns = np.broadcast_to(at[:, :, None], (*rows.shape[:3], 12))
        recovery.add(model.plan.topology.dof[chains.numbers(model)[:, :, 1:-1]], columns, rows)
    for chains in links:
        at, T = _to_bodies(model, bodies, chains)
        M.add(at, at, np.swapaxes(T, -1, -2) @ _end_masses(chains, chains.X.shape[1]) @ T)
    stiffness, mass = full_order(model.plan).discrete_matrices(model.design)
    Z = bodies.Z
    count = bodies.count - int((~model.plan.topology.has_position).sum())
    note = f"{count} rigid {'body' if count == 1 else 'bodies'} on {_placed(model, springs)} flexures"
    note += f", {compliant} of them links more compliant than the stiffest flexure" if compliant else ""
    note += f"; {_placed(model, links)} links taken as rigid" if links else ""
    return PseudoRigidBodyModel(
        bodies,
        (Z.T @ (K.matrix() + rigid.T @ stiffness @ rigid) @ Z).tocsc(),
        (Z.T @ (M.matrix() + rigid.T @ mass @ rigid) @ Z).tocsc(),
        (recovery.matrix() @ Z).tocsc(),
        note,
    )


def _members(model: FullOrderModel) -> tuple[list[SegmentChains], list[SegmentChains], int]:
    """Springs and rigid links of all prototypes, each member a chain with its elements in two halves, and the number of
    links among the springs."""
    flexures, links = [], []
    for name in model.matrices:
        part, flexible = model.plan.parts[name], _is_flexure(model, name)
        flexures += segment_chains(model, name, _as_chains(part, np.flatnonzero(flexible)), pieces=2)
        links += segment_chains(model, name, _as_chains(part, np.flatnonzero(~flexible)), pieces=2)
    stiffest = min((float(chains.turning.min()) for chains in flexures), default=np.inf)
    easy = [chains.turning >= stiffest for chains in links]
    compliant = [chains.take(own) for chains, own in zip(links, easy, strict=True) if own.any()]
    rigid = [chains.take(~own) for chains, own in zip(links, easy, strict=True) if not own.all()]
    return [*flexures, *compliant], rigid, _placed(model, compliant)


def _placed(model: FullOrderModel, sets: list[SegmentChains]) -> int:
    """Number of placed chains."""
    return sum(len(chains.nodes) * len(chains.numbers(model)) for chains in sets)


def _is_flexure(model: FullOrderModel, name: str) -> NDArray[np.bool_]:
    """Which members of a prototype are flexures (m,)."""
    known = model.plan.layout.prototypes[name].flexures
    return np.array([member in known for member in model.plan.parts[name].members], dtype=bool)


def _as_chains(part: Part, members: Index) -> list[ChainGroup]:
    """Members as chains, those with equal numbers of elements together."""
    groups = []
    for n in np.unique(part.counts[members]):
        own = members[part.counts[members] == n]
        elements = part.first[own][:, None] + np.arange(n)
        nodes = np.concatenate([part.connectivity[elements, 0], part.connectivity[elements[:, -1:], 1]], axis=1)
        groups.append(ChainGroup(elements, np.zeros(elements.shape, dtype=bool), nodes))
    return groups


def _end_masses(chains: SegmentChains, near: int) -> Array:
    """Mass (c, 12, 12) over the end nodes: the first `near` segments move with the first, the others with the last."""
    m = chains.rigid_masses
    out = np.zeros((len(m), 12, 12))
    out[:, :6, :6] = m[:, :near].sum(axis=1)
    to_pole = rigid_arm(-chains.arms[:, -1])
    out[:, 6:, 6:] = np.swapaxes(to_pole, -1, -2) @ m[:, near:].sum(axis=1) @ to_pole
    return out


def _to_bodies(model: FullOrderModel, bodies: RigidBodies, chains: SegmentChains) -> tuple[Index, Array]:
    """Columns (copies, c, 12) of the bodies at both ends, and displacements (copies, c, 12, 12) of the end nodes from
    those of the bodies, in the part's frame."""
    x = model.geometry.positions
    root = model.plan.topology.root[chains.numbers(model)[:, :, [0, -1]]]
    own = bodies.body[root]
    arms = block_diagonal(rigid_arm(x[root] - x[bodies.reference[own]]))
    columns = node_dofs(own)
    return columns, chains.transforms(model) @ arms


def _add_rigid_rows(model: FullOrderModel, bodies: RigidBodies, recovery: Triplets) -> None:
    """Add the displacements of all roots on rigid bodies."""
    x = model.geometry.positions
    nodes = np.flatnonzero(bodies.body >= 0)
    own = bodies.body[nodes]
    arms = rigid_arm(x[nodes] - x[bodies.reference[own]])
    recovery.add(model.plan.topology.dof[nodes], 6 * own[:, None] + np.arange(6), arms)


def rigid_bodies(model: FullOrderModel, springs: list[SegmentChains], links: list[SegmentChains]) -> RigidBodies:
    """Nodes that links and described bodies hold together between the springs, and how each group may move."""
    topology = model.plan.topology
    is_root = topology.root == np.arange(topology.n_nodes)
    for chains in springs:
        is_root[chains.numbers(model)[:, :, 1:-1]] = False
    pairs = [topology.root[chains.numbers(model)] for chains in links]
    start = np.concatenate([np.empty(0, dtype=np.intp), *(p[:, :, :-1].ravel() for p in pairs)])
    end = np.concatenate([np.empty(0, dtype=np.intp), *(p[:, :, 1:].ravel() for p in pairs)])
    graph = sp.coo_matrix((np.ones(len(start)), (start, end)), shape=(topology.n_nodes, topology.n_nodes))
    _, cluster = connected_components(graph, directed=False)
    roots = np.flatnonzero(is_root)
    labels, own = np.unique(cluster[roots], return_inverse=True)
    body = np.full(topology.n_nodes, -1, dtype=np.intp)
    body[roots] = own
    reference = _references(model, roots, own, len(labels))
    return RigidBodies(body, reference, _free_motions(model, roots, own, reference))


def _references(model: FullOrderModel, roots: Index, own: Index, count: int) -> Index:
    """For every rigid body a node that supports hold, else that of a described body, else its first."""
    topology = model.plan.topology
    rank = np.where(topology.held[roots].any(axis=1), 0, np.where(topology.is_rigid[roots], 1, 2))
    order = np.lexsort((roots, rank, own))
    return roots[order][np.searchsorted(own[order], np.arange(count))]


def _free_motions(model: FullOrderModel, roots: Index, own: Index, reference: Index) -> sp.csc_matrix:
    """Z (6 b, r): displacements of the reference nodes that no support hinders."""
    topology, x = model.plan.topology, model.geometry.positions
    held = (topology.held | topology.unused)[roots]
    bodies = np.arange(len(reference))
    supported = np.unique(own[held.any(axis=1)])
    free = np.setdiff1d(bodies, supported)
    Z = Triplets(6 * len(reference), 6 * len(reference))
    columns = np.arange(6 * len(free)).reshape(-1, 6)
    Z.add(6 * free[:, None] + np.arange(6), columns, np.broadcast_to(np.eye(6), (len(free), 6, 6)))
    n = columns.size
    for b in supported:
        mine = own == b
        motions = _null_space(rigid_arm(x[roots[mine]] - x[reference[b]])[held[mine]])
        Z.add(6 * b + np.arange(6), n + np.arange(motions.shape[1]), motions)
        n += motions.shape[1]
    return Z.matrix()[:, :n]


def _null_space(rows: Array) -> Array:
    """Displacements (6, r) that leave held displacements, rows (h, 6), at zero; rotations are scaled by the arms."""
    alone = rows[np.abs(rows).sum(axis=1) == 1.0]
    if len(alone) == len(rows):
        return np.eye(6)[:, ~(rows != 0).any(axis=0)]
    scale = np.ones(6)
    scale[3:] = 1 / np.abs(rows[:, 3:]).max()
    _, size, Vt = np.linalg.svd(rows * scale)
    rank = int((size > RANK * size[0]).sum())
    return scale[:, None] * Vt[rank:].T
