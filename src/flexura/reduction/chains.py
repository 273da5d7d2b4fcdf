"""Serial chains of elements: constraint modes over their ends, without factorising a chain's stiffness.

In a chain that is loaded at its ends only, every element carries the same wrench. With all motions written as twists at
one pole, the flexibilities of the elements simply add up, and eq. 18 of the RPR paper holds for the chain as a whole:
its stiffness is the inverse of the 6 x 6 sum, and its constraint modes are running sums times that inverse.
This is what makes reducing a design cheap: no interior matrix is assembled or solved. Other interior nodes, where
members branch or discrete elements sit, are left for static condensation (Guyan 1965), which commutes with this step
(theory eqs. 46-52). `SegmentChains` keep the exact static shape apart from what moves relative to it, so that the
stiffness between the ends of a chain keeps its digits however finely it is cut.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import PLANE_BASIS, block_rotation, cross, element_mass, flexibility, in_planes, rigid_arm, root_mass
from flexura.errors import OptionError, SolverError
from flexura.structure import (
    TAPERED_PIECES,
    Cut,
    Elements,
    ElementSlice,
    FullOrderModel,
    Part,
    PartGeometry,
    block_diagonal,
    common,
)

ENDS_SWAPPED = np.r_[6:12, 0:6]
"""The DOFs of the two ends of a segment the other way round."""


class ChainGroup(NamedTuple):
    """Chains of equal length: elements (c, e) in walking order, whether each is walked from j to i, and the nodes
    (c, e + 1) passed."""

    elements: Index
    reverse: NDArray[np.bool_]
    nodes: Index

    @property
    def run(self) -> slice | None:
        """The elements as a slice when they lie one behind the other, else None."""
        flat = self.elements.ravel()
        consecutive = np.array_equal(flat, np.arange(flat[0], flat[0] + len(flat)))
        return slice(int(flat[0]), int(flat[0]) + len(flat)) if consecutive else None


@dataclass(frozen=True)
class ChainKinematics:
    """Twist-to-end-displacement maps X_i, X_j on a diagonal, Xd (..., c, e, 12, 12), the inverse of X_j, the map B
    (..., c, 12, 12) from the displacements of the chain's two end nodes to (twist of the first, relative twist), and
    the elements as a slice where they lie one behind the other."""

    Xd: Array
    Xj_inverse: Array
    B: Array
    run: slice | None

    @property
    def X(self) -> Array:
        """X_i above X_j (..., c, e, 12, 6)."""
        return np.concatenate([self.Xd[..., :6, :6], self.Xd[..., 6:, 6:]], axis=-2)


def find_chains(part: Part, kept: Index | None = None) -> list[ChainGroup]:
    """Split the elements of a part into chains between nodes that are kept, by default its boundary, branch or carry
    discrete elements."""
    lumped = {n for nodes, _, _ in part.discrete_nodes() for n in nodes}
    degree = np.bincount(part.connectivity.ravel(), minlength=part.n_nodes)
    passable = degree == 2
    passable[part.boundary if kept is None else kept] = False
    passable[list(lumped)] = False
    at_node: list[list[int]] = [[] for _ in range(part.n_nodes)]
    for e, (i, j) in enumerate(part.connectivity):
        at_node[i].append(e)
        at_node[j].append(e)
    used = np.zeros(len(part.connectivity), dtype=bool)

    def walk(node: int, element: int) -> tuple[list[int], list[bool], list[int]]:
        elements, reverse, nodes = [], [], [node]
        while True:
            used[element] = True
            i, j = part.connectivity[element]
            elements.append(element)
            reverse.append(bool(j == node and i != node))
            node = int(i if reverse[-1] else j)
            nodes.append(node)
            onward = [e for e in at_node[node] if not used[e]] if passable[node] else []
            if not onward:
                return elements, reverse, nodes
            element = onward[0]

    by_length: dict[int, list[tuple[list[int], list[bool], list[int]]]] = {}
    for node in np.flatnonzero(~passable):
        for first in at_node[node]:
            if not used[first]:
                chain = walk(int(node), first)
                by_length.setdefault(len(chain[0]), []).append(chain)
    return [ChainGroup(*(np.array(column) for column in zip(*chains, strict=True))) for chains in by_length.values()]


def kinematics(part: Part, group: ChainGroup, geometry: PartGeometry) -> ChainKinematics:
    """What depends on the part's `geometry` geometry alone; the pole of each chain is its first node."""
    positions, number = geometry.positions, group.elements
    pole = positions[..., group.nodes[:, :1], :]
    member = part.table.element_member[number]
    R = geometry.R[..., member, :, :]
    lead = np.broadcast_shapes(R.shape[:-4], positions.shape[:-2])
    Xd, inverse = np.zeros((*lead, *number.shape, 12, 12)), np.zeros((*lead, *number.shape, 6, 6))
    for k in range(4):
        Xd[..., 3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = R
    inverse[..., :3, :3] = inverse[..., 3:, 3:] = R.mT
    for end, is_last in enumerate((number == part.first[member], number == part.first[member + 1] - 1)):
        arm = positions[..., part.connectivity[number, end], :] - pole
        arm = np.where(is_last[:, :, None], arm + geometry.offsets[..., member, end, :], arm)
        moved = cross(arm[..., None, :], R)
        Xd[..., 6 * end : 6 * end + 3, 6 * end + 3 : 6 * end + 6] = moved
    inverse[..., :3, 3:] = moved.mT
    reach = common((pole - positions[..., group.nodes[:, -1:], :])[..., 0, :], 2)
    B = np.zeros((*reach.shape[:-2], len(number), 12, 12))
    B[..., :6, :6] = np.eye(6)
    B[..., 6:, :6] = -np.eye(6)
    B[..., 6:, 6:] = rigid_arm(reach)
    return ChainKinematics(Xd, inverse, B, group.run)


def chain_matrices(group: ChainGroup, kin: ChainKinematics, elements: Elements | ElementSlice) -> tuple[Array, Array]:
    """Reduced K and M (..., c, 12, 12) of each chain over its two end nodes (theory eqs. 48-51)."""
    M = taken(elements.M, group.elements, kin.run)
    running, k = _flexibility(group, kin, elements)
    P = np.empty((*running.shape[:-3], running.shape[-3] + 1, 6, 6))
    P[..., 0, :, :] = 0.0
    np.matmul(running, k[..., None, :, :], out=P[..., 1:, :, :])
    at_i, at_j = P[..., :-1, :, :], P[..., 1:, :, :]
    if group.reverse.any():
        turned = group.reverse[:, :, None, None]
        at_i, at_j = np.where(turned, at_j, at_i), np.where(turned, at_i, at_j)
    # displacements of the elements' ends for unit twists of the first node (V_r) and unit relative twists (V_d)
    V = np.empty((*at_i.shape[:-2], 12, 12))
    X_i, X_j = kin.Xd[..., :6, :6], kin.Xd[..., 6:, 6:]
    V[..., :6, :6], V[..., 6:, :6] = X_i, X_j
    V[..., :6, 6:], V[..., 6:, 6:] = X_i @ at_i, X_j @ at_j
    flat = (*V.shape[:-3], V.shape[len(V.shape) - 3] * 12, 12)
    m = V.reshape(flat).mT @ (M @ V).reshape(flat)
    return _at_ends(kin, k), kin.B.mT @ m @ kin.B


def chain_stiffness(group: ChainGroup, kin: ChainKinematics, elements: Elements | ElementSlice) -> Array:
    """Reduced K (..., c, 12, 12) alone, as `chain_matrices`."""
    return _at_ends(kin, _flexibility(group, kin, elements)[1])


def _flexibility(group: ChainGroup, kin: ChainKinematics, elements: Elements | ElementSlice) -> tuple[Array, Array]:
    """Flexibility (..., c, e, 6, 6) of each chain up to the end of every element, at the pole, and the stiffness
    (..., c, 6, 6) of the whole chain."""
    C = taken(elements.C, group.elements, kin.run)
    running = np.cumsum(kin.Xj_inverse @ C @ kin.Xj_inverse.mT, axis=-3)
    k = np.linalg.inv(running[..., -1, :, :])
    return running, (k + k.mT) / 2


def _at_ends(kin: ChainKinematics, k: Array) -> Array:
    """Stiffness (..., c, 12, 12) over the ends of chains."""
    return np.asarray(kin.B[..., 6:, :].mT @ k @ kin.B[..., 6:, :])


def taken(matrices: Array, index: Index, run: slice | None) -> Array:
    """Matrices (..., c, e, i, j) of the elements `index` (c, e); a view where they are the slice `run`."""
    if run is None:
        return matrices[..., index, :, :]
    view = matrices[..., run, :, :]
    return view.reshape(*view.shape[:-3], *index.shape, *view.shape[-2:])


@dataclass(frozen=True)
class SegmentChains:
    """Chains of s segments each of one prototype, in the part's frame; the pole of each is its first node.

    Twists are in the axes of the chain's first segment, in which stretch does not mix with bending, which may be softer
    by many decades; `axes` (c, 6, 6) turns from the part's. `nodes` (c, e + 1) are the part's nodes that the chains
    pass, with `arms` (c, e + 1, 3) from the pole in the part's axes; they are the `passed`-th of the s + 1 segment
    ends. `X` (c, s, 12, 6) takes a twist to the displacements, in segment axes, of the segment's near and far end in
    walking order, and `along` (c, s) is the way from one to the other, m, along the segment's x. Flexibility C
    (c, s, 6, 6) is that of the far end with the near one clamped, mass m (c, s, 12, 12) is over both. `running`
    (c, s + 1, 6, 6) are flexibilities from the first node to every segment end.
    """

    name: str
    nodes: Index
    arms: Array
    passed: Index
    axes: Array
    X: Array
    along: Array
    C: Array
    m: Array
    running: Array

    def take(self, index: Any) -> SegmentChains:
        """The chains at an index of the leading axis."""
        values = (getattr(self, each.name)[index] for each in fields(self) if each.name != "name")
        return SegmentChains(self.name, *values)

    @property
    def turning(self) -> Array:
        """Largest rotation per moment (c,) of one end against the other, rad/(N m), about any axis."""
        return np.linalg.norm(self.running[:, -1, 3:, 3:], ord=2, axis=(-2, -1))

    @cached_property
    def strain(self) -> Array:
        """f (c, 6, 6): f' f is the stiffness against the relative twist of the ends (theory eq. L1)."""
        return inverse_factor(self.running[:, -1])

    @cached_property
    def stiffness(self) -> Array:
        """Stiffness (c, 6, 6) against the relative twist of the ends: the inverse of all flexibilities summed."""
        return self.strain.mT @ self.strain

    @cached_property
    def segment_strain(self) -> Array:
        """f (c, s, 6, 12): f' f is the stiffness of every segment over its near and far end, from its flexibility C."""
        arm = np.zeros((*self.along.shape, 3))
        arm[..., 0] = self.along
        eye = np.broadcast_to(np.eye(6), (*self.along.shape, 6, 6))
        return inverse_factor(self.C) @ np.concatenate([-rigid_arm(arm), eye], axis=-1)

    @cached_property
    def shares(self) -> Array:
        """P (c, s + 1, 6, 6): relative twist of every segment end per relative twist of the last (theory eq. 50)."""
        return self.running @ self.stiffness[:, None]

    @cached_property
    def ends(self) -> Array:
        """B (c, 12, 12): twist of the first node and relative twist of the last from their displacements."""
        B = np.zeros((len(self.nodes), 12, 12))
        B[:, :6, :6] = np.eye(6)
        B[:, 6:, :6] = -np.eye(6)
        B[:, 6:, 6:] = rigid_arm(-self.arms[:, -1])
        return block_diagonal(np.stack([self.axes, self.axes], axis=1)) @ B

    @cached_property
    def end_stiffness(self) -> Array:
        """Static stiffness (c, 12, 12) over the two end nodes (theory eq. L1)."""
        Bd = self.ends[:, 6:]
        return Bd.mT @ self.stiffness @ Bd

    @cached_property
    def rigid_masses(self) -> Array:
        """Mass (c, s, 6, 6) of every segment moving as a rigid body with the chain's first node, in the part's axes."""
        X = self.X @ self.axes[:, None]
        return X.mT @ self.m @ X

    @cached_property
    def interior_twists(self) -> Array:
        """(c, e - 1, 6, 12): static twists of the nodes between from the displacements of the two end nodes."""
        P = np.take_along_axis(self.shares, self.passed[:, 1:-1, None, None], axis=1)
        return np.concatenate([np.broadcast_to(np.eye(6), P.shape), P], axis=-1) @ self.ends[:, None]

    @property
    def far(self) -> Array:
        """X (c, s - 1, 6, 6) from the twist of a segment end within the chain to its displacement, in the axes of the
        segment before it."""
        return self.X[:, :-1, 6:]

    @property
    def ends_passed(self) -> tuple[Index, Index]:
        """Chain (c, 1) and segment end (c, e - 1) at which the nodes between are."""
        return np.arange(len(self.nodes))[:, None], self.passed[:, 1:-1] - 1

    def inner_coordinates(self, first: int, copies: int) -> Index:
        """Coordinates (copies, c, s - 1, 6), numbered from `first`, of the segment ends within chains."""
        c, s = self.X.shape[:2]
        return first + np.arange(copies * c * (s - 1) * 6).reshape(copies, c, s - 1, 6)

    def numbers(self, model: FullOrderModel) -> Index:
        """Global numbers (copies, c, e + 1) of the nodes passed."""
        return np.array(model.plan.topology.copies[self.name].offset, dtype=np.intp)[:, None, None] + self.nodes

    def transforms(self, model: FullOrderModel) -> Array:
        """G (copies, c, 12, 12): displacements of the end nodes, part's frame, from those of their roots."""
        G = model.design.node_transforms(self.name, self.nodes[:, [0, -1]].ravel())
        return block_diagonal(G.reshape(len(G), -1, 2, 6, 6))

    def outward(self, model: FullOrderModel) -> Array:
        """(copies, c, e - 1, 6, 6): displacements of the nodes between, global frame, from twists in the part's."""
        number = self.nodes[:, 1:-1]
        G = model.design.node_transforms(self.name, number.ravel())
        turn = rigid_arm(self.arms[:, 1:-1]) @ self.axes.mT[:, None]
        return G.reshape(len(G), *number.shape, 6, 6).mT @ turn


def segment_chains(
    model: FullOrderModel, name: str, groups: list[ChainGroup], pieces: int = 1, tapered_pieces: int = TAPERED_PIECES
) -> Iterator[SegmentChains]:
    """Cut chains of elements of one prototype into uniform segments, chains of equal numbers together.

    Every element is cut into `pieces`; tapered ones keep their steps, at most `tapered_pieces`, so that all meshes
    stand for one and the same structure (`Elements.cut`). Raises OptionError for numbers below one.
    """
    if pieces < 1 or tapered_pieces < 1:
        raise OptionError("an element is cut into at least one piece")
    if not groups:
        return
    elements = model.matrices[name].elements
    assert isinstance(elements, ElementSlice)
    cut = elements.cut(pieces, tapered_pieces)
    for group in groups:
        total = cut.counts[group.elements].sum(axis=1)
        for s in np.unique(total):
            at = total == s
            yield _cut_chains(model, name, ChainGroup(group.elements[at], group.reverse[at], group.nodes[at]), cut)


def element_chains(model: FullOrderModel, name: str, groups: list[ChainGroup]) -> Iterator[SegmentChains]:
    """Chains of the elements of one prototype as they are, tapered ones too: every element is a segment."""
    matrices, part = model.matrices[name], model.plan.parts[name]
    for group in groups:
        at = group.elements
        X = kinematics(part, group, model.geometry.parts[name]).X
        elements = matrices.elements
        passed = np.broadcast_to(np.arange(group.nodes.shape[1]), group.nodes.shape)
        yield _in_own_axes(model, name, group, passed, (X, elements.C[at], elements.M[at], elements.length[at]))


def _cut_chains(model: FullOrderModel, name: str, group: ChainGroup, cut: Cut) -> SegmentChains:
    """Chains with equal numbers of uniform segments."""
    part, positions = model.plan.parts[name], model.geometry.parts[name].positions
    c = len(group.nodes)
    element, place, reverse = _segments_in_order(group, cut)
    beam = cut.beam.take(cut.kind[np.cumsum(cut.counts)[element] - cut.counts[element] + place])
    pole = np.repeat(positions[group.nodes[:, 0]], len(element) // c, axis=0)
    X0 = model.matrices[name].T[element, :6, :6] @ rigid_arm(positions[part.connectivity[element, 0]] - pole)
    along = np.zeros((2, len(element), 3))
    along[:, :, 0] = place * beam.length, (place + 1) * beam.length
    Xi, Xj = rigid_arm(along) @ X0
    C, m = flexibility(1.0, 1.0, beam.section, beam.length, 1.0), element_mass(beam)
    roots = np.zeros((len(C), 2, 6, 6))
    for end, at_end in ((0, place == 0), (1, place == cut.counts[element] - 1)):
        at = np.flatnonzero(at_end & (cut.root[element, end] >= 0))
        arm = np.zeros((len(at), 3))
        arm[:, 0] = (1 - end) * beam.length[at]
        D = rigid_arm(arm)
        root = cut.roots[cut.root[element[at], end]]
        C[at] += D @ root @ D.mT
        roots[at, end] = root
    at = np.flatnonzero(roots.any(axis=(1, 2, 3)))
    springs = np.stack([in_planes(roots[at, end]) for end in (0, 1)])
    change = root_mass(in_planes(C[at]), in_planes(m[at]), beam.length[at], springs)
    m[at] += (change.reshape(72, -1).T @ PLANE_BASIS).reshape(-1, 12, 12)
    steps = np.cumsum(cut.counts[group.elements], axis=1)
    passed = np.concatenate([np.zeros((c, 1), dtype=np.intp), steps], axis=1)
    segments = (np.concatenate([Xi, Xj], axis=-2), C, m, beam.length)
    shaped = tuple(A.reshape(c, -1, *A.shape[1:]) for A in segments)
    walked = ChainGroup(group.elements, reverse.reshape(c, -1), group.nodes)
    return _in_own_axes(model, name, walked, passed, shaped)


def _in_own_axes(
    model: FullOrderModel, name: str, group: ChainGroup, passed: Index, segments: tuple[Array, ...]
) -> SegmentChains:
    """Chains from X and m over ends i and j, flexibilities C at end j with i clamped, and lengths, all (c, s, ...);
    `group.reverse` (c, s) says which segments are walked from j to i."""
    X, C, m, length = segments
    C = (C + C.mT) / 2
    axes = block_rotation(X[:, 0, :3, :3])
    # flexibilities are summed in own axes, where a round-off of soft directions does not reach stiff ones
    X = X @ axes.mT[:, None]
    inverse = np.linalg.inv(X[..., 6:, :])
    F = inverse @ C @ inverse.mT  # between twists at the pole
    running = np.concatenate([np.zeros((len(F), 1, 6, 6)), np.cumsum((F + F.mT) / 2, axis=1)], axis=1)
    if group.reverse.any():
        turned = group.reverse[..., None, None]
        X = np.where(turned, X[..., ENDS_SWAPPED, :], X)
        m = np.where(turned, m[..., ENDS_SWAPPED, :][..., ENDS_SWAPPED], m)
        arm = np.zeros((*length.shape, 3))
        arm[..., 0] = -length
        C = np.where(turned, rigid_arm(arm) @ C @ rigid_arm(arm).mT, C)
    positions = model.geometry.parts[name].positions
    arms = positions[group.nodes] - positions[group.nodes[:, :1]]
    along = np.where(group.reverse, -length, length)
    return SegmentChains(name, group.nodes, arms, passed, axes, X, along, C, m, running)


def growth(f: Array, F: Array) -> Array:
    """How much round-off of F (..., n, n) grows (...,) in the energies of its inverse f' f: the largest product of a
    stiffness and the flexibility in the same direction, one where directions are independent.

    Entries of F are right to their own scale, d_i d_j with d = sqrt(diag F), and a change dF changes the energy of the
    forces q by q' dF q, up to (sum d_i |q_i|)^2, while the energy itself is at least (d_i q_i)^2 over that product.
    """
    stiff = np.einsum("...ri,...ri->...i", f, f)
    return (stiff * np.einsum("...ii->...i", F)).max(axis=-1)


def factor(k: Array) -> Array:
    """f (..., n, n) with f' f = k, for positive semidefinite k (..., n, n) whose rows differ by decades."""
    d = np.sqrt(np.maximum(np.einsum("...ii->...i", k), 0.0))
    unit = np.where(d > 0, d, 1.0)
    scaled = k / (unit[..., :, None] * unit[..., None, :])
    try:
        f = np.linalg.cholesky(scaled).mT
    except np.linalg.LinAlgError:
        size, V = np.linalg.eigh(scaled)
        f = np.sqrt(np.maximum(size, 0.0))[..., :, None] * V.mT
    return np.asarray(f * unit[..., None, :], dtype=np.float64)


def inverse_factor(F: Array) -> Array:
    """f (..., n, n) with f' f = F^-1, for positive definite F (..., n, n) whose rows differ by decades.

    Raises SolverError where F is not.
    """
    d = np.sqrt(np.einsum("...ii->...i", F))
    try:
        L = np.linalg.cholesky(F / (d[..., :, None] * d[..., None, :]))
    except np.linalg.LinAlgError:
        raise SolverError("a chain of members has a flexibility that is not positive") from None
    return np.asarray(np.linalg.inv(L) / d[..., None, :], dtype=np.float64)


def _segments_in_order(group: ChainGroup, cut: Cut) -> tuple[Index, Index, NDArray[np.bool_]]:
    """Every segment in walking order: its element, its place in it from the element's start, and whether it is walked
    from j to i."""
    elements, reverse = group.elements.ravel(), group.reverse.ravel()
    count = cut.counts[elements]
    each = np.repeat(np.arange(len(elements)), count)
    walked = np.arange(len(each)) - np.repeat(np.cumsum(count) - count, count)
    element, backwards = elements[each], reverse[each]
    return element, np.where(backwards, count[each] - 1 - walked, walked), backwards
