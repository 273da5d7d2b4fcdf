"""Models with a finite number of coordinates: finite elements at any refinement, pseudo-rigid bodies, lumped freedoms.

The pseudo-rigid-body model has rigid links and bodies between flexures that are springs (Howell and Midha 1994; Howell
2001), in space, with all six components of every flexure's stiffness. The lumped-parameter model has the few motions
that the flexures leave easy: everything is condensed statically to the rigid bodies, with the share of the members'
mass that moves with this static shape, by Rayleigh's principle (Lobontiu 2002), and of the bodies' motions only the
freedoms are kept, those below the gap in the stiffness spectrum, as flexure systems are designed by freedoms and
constraints (Hopkins and Culpepper 2010).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, factorise, is_definite, lowest, lowest_modes
from flexura.methods.solution import Solution
from flexura.reduction import ChainGroup, LowOrderModel, SegmentChains, chained, low_order_modes, reduce, segment_chains
from flexura.structure import FullOrderModel, Part, Triplets, block_diagonal, full_order, node_dofs
from flexura.thresholds import FREE_MOTION

UNOBSERVED = 1e-9
"""Relative differences of frequencies below this may be round-off: no order of convergence is observed from them."""

GAP = 100.0
"""Constraints are so many times stiffer than freedoms, at least; an order of magnitude in frequency."""

UNSTIFF = 1e-11
"""A scaled stiffness below this part of the largest before condensation is round-off."""

GOES_ALONG = 0.2
"""Scaled share from which a coordinate is said to go along with another."""


def _finite_hz(pairs: Eigenpairs) -> tuple[Array, Array]:
    """Frequencies (k,), Hz, and vectors of the pairs with mass. Raises OptionError where there are none."""
    finite = np.isfinite(pairs.values)
    if not finite.any():
        raise OptionError("the mechanism has no mass")
    return np.sqrt(np.maximum(pairs.values[finite], 0.0)) / (2 * np.pi), pairs.vectors[:, finite]


def low_order_solution(low: LowOrderModel, model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest modes of a low-order model. Raises OptionError when nothing in it can move."""
    if low.order == 0:
        raise OptionError("every node that the low-order model keeps is held")
    pairs = low_order_modes(low, model, count)
    hz = np.sqrt(pairs.values) / (2 * np.pi)
    return Solution("low order", low.order, hz, model.node_displacements(pairs.vectors))


def finite_elements(model: FullOrderModel, count: int, pieces: int = 1) -> Solution:
    """The `count` lowest natural frequencies with every element of the full-order model cut into `pieces`.

    Consistent mass matrices (theory eqs. 15, 19); a tapered element stands as up to 16 uniform ones, each cut so.
    Frequencies converge from above to those of the exact dynamic stiffness, to order 4 in bending without shear, else
    to order 2. Raises OptionError when nothing can move or has mass, and SolverError.
    """
    if model.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    elements = chained(model, pieces)  # in coordinates that keep their digits
    hz, vectors = _finite_hz(lowest_modes(elements.pencil, count, elements.rigid_motions))
    shapes = model.node_displacements(elements.recover(vectors))
    return Solution(f"finite elements {pieces}x", elements.pencil.order, hz, shapes)


@dataclass(frozen=True)
class Convergence:
    """Observed order of convergence (k,), nan where differences are round-off or not monotone, and the frequencies
    (k,), Hz, extrapolated to elements of no length (theory eq. L3)."""

    order: Array
    frequency_hz: Array


def convergence(coarse: ArrayLike, medium: ArrayLike, fine: ArrayLike) -> Convergence:
    """Order of convergence and Richardson's estimate from the frequencies of three meshes, each twice as fine as the
    one before (Richardson 1911; Roache 1994)."""
    f1, f2, f4 = (np.asarray(f, dtype=float) for f in (coarse, medium, fine))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (f1 - f2) / (f2 - f4)
        seen = (np.abs(f2 - f4) > UNOBSERVED * f4) & (ratio > 1)
        order = np.where(seen, np.log2(np.where(seen, ratio, 1.0)), np.nan)
    return Convergence(order, np.where(seen, f4 + (f4 - f2) / np.where(seen, ratio - 1, 1.0), f4))


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
    bodies = pseudo_rigid_body_model(model)
    hz, vectors = _finite_hz(lowest(bodies.K, bodies.M, count))
    shapes = model.node_displacements(np.asarray(bodies.recovery @ vectors))
    return Solution("pseudo-rigid-body", bodies.K.shape[0], hz, shapes, bodies.note)


def pseudo_rigid_body_model(model: FullOrderModel) -> PseudoRigidBodyModel:
    """K, M and recovery of the pseudo-rigid-body model.

    Raises OptionError when nothing is compliant, or when rigid links tie everything to ground.
    """
    springs, links, compliant = _members(model)
    parts = model.plan.parts.values()
    if not springs and not any(part.springs or part.diaphragms or part.superelements for part in parts):
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
    x, topology = model.geometry.positions, model.plan.topology
    on_bodies = np.flatnonzero(bodies.body >= 0)
    number = bodies.body[on_bodies]
    arms = rigid_arm(x[on_bodies] - x[bodies.reference[number]])
    recovery.add(topology.dof[on_bodies], node_dofs(number[:, None]), arms)
    rigid = recovery.matrix()
    for chains in springs:
        at, T = _to_bodies(model, bodies, chains)
        between = (at[..., 0] != at[..., 6])[..., None, None]  # else the flexure cannot deform
        K.add(at, at, between * (np.swapaxes(T, -1, -2) @ chains.end_stiffness @ T))
        M.add(at, at, np.swapaxes(T, -1, -2) @ _end_masses(chains, chains.X.shape[1] // 2) @ T)
        rows = chains.outward(model) @ (chains.interior_twists @ T[:, :, None])
        columns = np.broadcast_to(at[:, :, None], (*rows.shape[:3], 12))
        recovery.add(topology.dof[chains.numbers(model)[:, :, 1:-1]], columns, rows)
    for chains in links:
        at, T = _to_bodies(model, bodies, chains)
        M.add(at, at, np.swapaxes(T, -1, -2) @ _end_masses(chains, chains.X.shape[1]) @ T)
    stiffness, mass = full_order(model.plan).discrete_matrices(model.design)
    Z = bodies.Z
    count = bodies.count - int((~topology.has_position).sum())
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
        part, described = model.plan.parts[name], model.plan.layout.prototypes[name].flexures
        flexible = np.array([member in described for member in part.members], dtype=bool)
        flexures += segment_chains(model, name, members_as_chains(part, np.flatnonzero(flexible)), pieces=2)
        links += segment_chains(model, name, members_as_chains(part, np.flatnonzero(~flexible)), pieces=2)
    stiffest = min((float(chains.turning.min()) for chains in flexures), default=np.inf)
    easy = [chains.turning >= stiffest for chains in links]
    compliant = [chains.take(turns) for chains, turns in zip(links, easy, strict=True) if turns.any()]
    rigid = [chains.take(~turns) for chains, turns in zip(links, easy, strict=True) if not turns.all()]
    return [*flexures, *compliant], rigid, _placed(model, compliant)


def _placed(model: FullOrderModel, sets: list[SegmentChains]) -> int:
    """Number of placed chains."""
    return sum(len(chains.nodes) * len(chains.numbers(model)) for chains in sets)


def members_as_chains(part: Part, members: Index) -> list[ChainGroup]:
    """Members of a part, by their places in its list, as chains, those with equal numbers of elements together."""
    groups = []
    for n in np.unique(part.counts[members]):
        elements = part.first[members[part.counts[members] == n]][:, None] + np.arange(n)
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
    """Columns (copies, c, 12) of the bodies at both ends, six to a body, and displacements (copies, c, 12, 12) of the
    end nodes from those of the bodies, in the part's frame."""
    x = model.geometry.positions
    root = model.plan.topology.root[chains.numbers(model)[:, :, [0, -1]]]
    number = bodies.body[root]
    arms = block_diagonal(rigid_arm(x[root] - x[bodies.reference[number]]))
    return node_dofs(number), chains.transforms(model) @ arms


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
    labels, number = np.unique(cluster[roots], return_inverse=True)
    body = np.full(topology.n_nodes, -1, dtype=np.intp)
    body[roots] = number
    # for every body a node that supports hold, else that of a described body, else its first
    rank = np.where(topology.held[roots].any(axis=1), 0, np.where(topology.is_rigid[roots], 1, 2))
    order = np.lexsort((roots, rank, number))
    reference = roots[order][np.searchsorted(number[order], np.arange(len(labels)))]
    return RigidBodies(body, reference, _free_motions(model, roots, number, reference))


def _free_motions(model: FullOrderModel, roots: Index, body: Index, reference: Index) -> sp.csc_matrix:
    """Z (6 b, r): displacements of the reference nodes that no support hinders; roots (k,) belong to `body` (k,)."""
    topology, x = model.plan.topology, model.geometry.positions
    held = (topology.held | topology.unused)[roots]
    supported = np.unique(body[held.any(axis=1)])
    free = np.setdiff1d(np.arange(len(reference)), supported)
    Z = Triplets(6 * len(reference), 6 * len(reference))
    columns = np.arange(6 * len(free)).reshape(-1, 6)
    Z.add(6 * free[:, None] + np.arange(6), columns, np.broadcast_to(np.eye(6), (len(free), 6, 6)))
    n = columns.size
    for b in supported:
        moves = body == b
        motions = _null_space(rigid_arm(x[roots[moves]] - x[reference[b]])[held[moves]])
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
    rank = int((size > FREE_MOTION * size[0]).sum())
    return scale[:, None] * Vt[rank:].T


@dataclass(frozen=True)
class LumpedModel:
    """K and M (r, r) of the kinematic DOFs; `recovery` (full order, r).

    `spectrum` (b,) are all scaled stiffnesses of the bodies, ascending, rad^2/s^2, of which the first r are kept;
    `names` are the coordinates of the bodies that determine the kinematic DOFs, e.g. `platform.tz`.
    """

    K: Array
    M: Array
    recovery: Array
    spectrum: Array
    names: tuple[str, ...]
    note: str


def lumped_parameter(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies of the lumped-parameter model in kinematic DOFs (theory eqs. L7-L10).

    Frequencies are never below the full-order model's of the same rank. Good for the working motions of a mechanism
    whose members are light; blind to every motion that leaves the bodies at rest. Raises OptionError when nothing can
    move or has mass, and SolverError when something moves freely beside the bodies.
    """
    lumped = lumped_model(model)
    hz, vectors = _finite_hz(lowest(lumped.K, lumped.M, count))
    shapes = model.node_displacements(lumped.recovery @ vectors)
    return Solution("lumped parameter", len(lumped.K), hz, shapes, lumped.note)


def lumped_model(model: FullOrderModel) -> LumpedModel:
    """K, M and recovery of the lumped-parameter model.

    Without rigid bodies the nodes that the low-order model keeps stand in their place. Raises OptionError when nothing
    can move or has mass, and SolverError when something moves freely beside the bodies.
    """
    low = reduce(model.plan, model.parameters)
    names = np.array(low.coordinate_names, dtype=object)
    owners = np.array([name.rsplit(".", 1)[0] for name in names], dtype=object)
    kept = np.flatnonzero(np.isin(owners, _bodies(model)))
    kept = kept if len(kept) else np.arange(len(names))
    if not len(kept):
        raise OptionError("every rigid body and every node that could stand in for one is held")
    K, M, T = _condensed(low.K, low.M, kept)
    scale = _scale(M, names[kept], owners[kept], float(np.ptp(model.geometry.positions, axis=0).max()))
    spectrum, V = la.eigh(K * scale[:, None] * scale)
    round_off = UNSTIFF * float((low.K.diagonal()[kept] * scale**2).max())
    spectrum[spectrum <= max(FREE_MOTION * spectrum[-1], round_off)] = 0.0
    r, reason = _freedoms(spectrum)
    motions = scale[:, None] * V[:, :r]
    labels = motion_labels(V[:, :r], list(names[kept]))
    note = f"kinematic DOFs: {', '.join(labels)}; {reason}" if r < len(kept) else reason
    recovery = np.asarray(low.recover(T @ motions))
    return LumpedModel(np.diag(spectrum[:r]), motions.T @ M @ motions, recovery, spectrum, labels, note)


def _bodies(model: FullOrderModel) -> list[str]:
    """Names of the nodes whose DOFs are those of the rigid bodies."""
    topology = model.plan.topology
    at = [
        offset + node
        for name, placed in topology.copies.items()
        for offset in placed.offset
        for node, _ in model.plan.parts[name].bodies.values()
    ]
    return [topology.node_names[n] for n in topology.root[np.array(at, dtype=np.intp)]]


def _condensed(K: Any, M: Any, kept: Index) -> tuple[Array, Array, Array]:
    """K, M (b, b) condensed statically to the kept coordinates, and T (n, b) to all of them (Guyan 1965)."""
    n = K.shape[0]
    rest = np.setdiff1d(np.arange(n), kept)
    T = np.zeros((n, len(kept)))
    T[kept] = np.eye(len(kept))
    K, M = sp.csr_matrix(K), sp.csr_matrix(M)
    if len(rest):
        inner = K[rest][:, rest].tocsc()
        if not is_definite(inner):
            raise SolverError("something moves freely beside the rigid bodies: no static shape follows from theirs")
        T[rest] = -factorise(inner).solve(K[rest][:, kept].toarray())
    Kb, Mb = K[kept] @ T, T.T @ (M @ T)
    return (Kb + Kb.T) / 2, (Mb + Mb.T) / 2, T


def _scale(M: Array, names: Any, owners: Any, size: float) -> Array:
    """Scale (b,) of the coordinates: 1/sqrt(m) and 1/(l sqrt(m)) with the mass and the radius of gyration of each body
    (theory eq. L8)."""
    turns = np.array([name.rsplit(".", 1)[1].startswith("r") for name in names])
    inertia = np.empty(len(names))
    for body in dict.fromkeys(owners):
        moves, rotates = (owners == body) & ~turns, (owners == body) & turns
        mass, turning = (float(np.diagonal(M)[dofs].mean()) if dofs.any() else 0.0 for dofs in (moves, rotates))
        inertia[moves] = mass
        inertia[rotates] = turning if turning > 0 else mass * size**2
    if not (inertia > 0).all():
        raise OptionError(f"{owners[np.argmin(inertia)]} has no mass: no stiffness can be called high or low there")
    return 1 / np.sqrt(inertia)


def _freedoms(spectrum: Array) -> tuple[int, str]:
    """Number of scaled stiffnesses below the first gap, and how it was found. Free motions always count."""
    free = int((spectrum == 0).sum())
    ratio = spectrum[free + 1 :] / spectrum[free:-1]
    gaps = np.flatnonzero(ratio >= GAP)
    if len(gaps):
        return free + int(gaps[0]) + 1, f"constraints are {ratio[gaps[0]]:.3g} times stiffer"
    largest = f" (largest step {ratio.max():.3g})" if len(ratio) else ""
    n = len(spectrum)
    return n, f"no gap in the stiffness spectrum{largest}: all {n} motions of the bodies are kept"


def motion_labels(V: Array, names: list[str]) -> tuple[str, ...]:
    """The r coordinates that determine orthonormal motions V (b, r) best, each with those of its body that go along."""
    _, R, pivots = la.qr(V.T, pivoting=True, mode="economic")
    r = V.shape[1]
    along = la.solve_triangular(R[:, :r], R[:, r:])
    labels = []
    for k in np.argsort(pivots[:r]):
        owner = names[pivots[k]].rsplit(".", 1)[0]
        others = [names[pivots[r + i]].rsplit(".", 1) for i in np.flatnonzero(np.abs(along[k]) > GOES_ALONG)]
        labels.append("+".join([names[pivots[k]], *(dof for body, dof in others if body == owner)]))
    return tuple(labels)
