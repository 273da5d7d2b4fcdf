"""Constraint modes of serial chains of elements, without factorising the chain's stiffness.

In a chain that is loaded at its ends only, every element carries the same wrench. With all motions written as twists at
one pole, the flexibilities of the elements simply add up, and eq. 18 of the RPR paper holds for the chain as a whole:
its stiffness is the inverse of the 6 x 6 sum, and its constraint modes are running sums times that inverse.
This is what makes reducing a design cheap: no interior matrix is assembled or solved. Other interior nodes, where
members branch or discrete elements sit, are left for static condensation (Guyan 1965), which commutes with this step
(theory eqs. 46-52).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import cross, rigid_arm
from flexura.structure import Elements, ElementSlice, Part, PartGeometry, common


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
    by_length: dict[int, list[tuple[list[int], list[bool], list[int]]]] = {}
    for node in np.flatnonzero(~passable):
        for first in at_node[node]:
            if not used[first]:
                chain = _walk(part, at_node, passable, used, int(node), first)
                by_length.setdefault(len(chain[0]), []).append(chain)
    return [ChainGroup(*(np.array(column) for column in zip(*chains, strict=True))) for chains in by_length.values()]


def _walk(
    part: Part, at_node: list[list[int]], passable: NDArray[np.bool_], used: NDArray[np.bool_], node: int, element: int
) -> tuple[list[int], list[bool], list[int]]:
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


def kinematics(part: Part, group: ChainGroup, own: PartGeometry) -> ChainKinematics:
    """What depends on the part's `own` geometry alone; the pole of each chain is its first node."""
    positions, number = own.positions, group.elements
    pole = positions[..., group.nodes[:, :1], :]
    member = part.table.element_member[number]
    R = own.R[..., member, :, :]
    lead = np.broadcast_shapes(R.shape[:-4], positions.shape[:-2])
    Xd, inverse = np.zeros((*lead, *number.shape, 12, 12)), np.zeros((*lead, *number.shape, 6, 6))
    for k in range(4):
        Xd[..., 3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = R
    inverse[..., :3, :3] = inverse[..., 3:, 3:] = np.swapaxes(R, -1, -2)
    for end, is_last in enumerate((number == part.first[member], number == part.first[member + 1] - 1)):
        arm = positions[..., part.connectivity[number, end], :] - pole
        arm = np.where(is_last[:, :, None], arm + own.offsets[..., member, end, :], arm)
        moved = cross(arm[..., None, :], R)
        Xd[..., 6 * end : 6 * end + 3, 6 * end + 3 : 6 * end + 6] = moved
    inverse[..., :3, 3:] = np.swapaxes(moved, -1, -2)
    reach = common((pole - positions[..., group.nodes[:, -1:], :])[..., 0, :], 2)
    B = np.zeros((*reach.shape[:-2], len(number), 12, 12))
    B[..., :6, :6] = np.eye(6)
    B[..., 6:, :6] = -np.eye(6)
    B[..., 6:, 6:] = rigid_arm(reach)
    return ChainKinematics(Xd, inverse, B, group.run)


def condense(group: ChainGroup, kin: ChainKinematics, elements: Elements | ElementSlice) -> tuple[Array, Array]:
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
    m = np.swapaxes(V.reshape(flat), -1, -2) @ (M @ V).reshape(flat)
    return _at_ends(kin, k), np.swapaxes(kin.B, -1, -2) @ m @ kin.B


def chain_stiffness(group: ChainGroup, kin: ChainKinematics, elements: Elements | ElementSlice) -> Array:
    """Reduced K (..., c, 12, 12) alone, as `condense`."""
    return _at_ends(kin, _flexibility(group, kin, elements)[1])


def _flexibility(group: ChainGroup, kin: ChainKinematics, elements: Elements | ElementSlice) -> tuple[Array, Array]:
    """Flexibility (..., c, e, 6, 6) of each chain up to the end of every element, at the pole, and the stiffness
    (..., c, 6, 6) of the whole chain."""
    C = taken(elements.C, group.elements, kin.run)
    running = np.cumsum(kin.Xj_inverse @ C @ np.swapaxes(kin.Xj_inverse, -1, -2), axis=-3)
    k = np.linalg.inv(running[..., -1, :, :])
    return running, (k + np.swapaxes(k, -1, -2)) / 2


def _at_ends(kin: ChainKinematics, k: Array) -> Array:
    """Stiffness (..., c, 12, 12) over the ends of chains."""
    return np.asarray(np.swapaxes(kin.B[..., 6:, :], -1, -2) @ k @ kin.B[..., 6:, :])


def taken(matrices: Array, index: Index, run: slice | None) -> Array:
    """Matrices (..., c, e, i, j) of the elements `index` (c, e); a view where they are the slice `run`."""
    if run is None:
        return matrices[..., index, :, :]
    own = matrices[..., run, :, :]
    return own.reshape(*own.shape[:-3], *index.shape, *own.shape[-2:])
