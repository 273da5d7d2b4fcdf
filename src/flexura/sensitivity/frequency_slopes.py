"""Derivatives of natural frequencies alone, as searches and studies step along them.

Derivatives of the energies of fixed modes: what eigenvalues alone need of K' and M', by element and node.

Energies of modes are worked out once, in floats; of what has slopes, only the matrices of elements, their frames,
lengths and arms are contracted with them. Nothing of the size of the model is formed for a parameter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.duals import Dual, plain, slope_of, zeros
from flexura.errors import OptionError
from flexura.linalg import Eigenpairs, lowest_groups
from flexura.modal import REPEATED_EIGENVALUES
from flexura.sensitivity.eigenpairs import GUARD, clusters, whole_clusters
from flexura.sensitivity.variation import FullOrderFamily
from flexura.structure import Design, DiscreteElement, PartMatrices, stiffness_and_mass


class Pairs(NamedTuple):
    """Pairs of modes: positions of both (q,), and the eigenvalue (q,) that they share."""

    first: Index
    second: Index
    value: Array

    @staticmethod
    def of(clusters: list[list[int]], values: Array) -> Pairs:
        """All pairs of modes of one eigenvalue, cluster by cluster, row by row."""
        rows = [np.repeat(at, len(at)) for at in clusters]
        columns = [np.tile(at, len(at)) for at in clusters]
        shared = [np.full(len(at) ** 2, values[at].mean()) for at in clusters]
        return Pairs(np.concatenate(rows), np.concatenate(columns), np.concatenate(shared))


def energy_slopes(design: Design, X: Array, pairs: Pairs) -> Array:
    """x_a' (K' - lambda M') x_b (P, q) for pairs of modes, columns of X (n, k), of a design with P slopes.

    Theory eq. K2, contracted; the mean with that of the pair (b, a) is what is symmetric. Loads that are described add
    nothing here.
    """
    topology, plan = design.plan.topology, design.plan
    values: Any = design.values
    found = np.zeros((len(values.slope) if isinstance(values, Dual) else 0, len(pairs.value)))
    padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
    for name, own in design.matrices.items():
        part = plan.parts[name]
        number = np.array(topology.copies[name].offset)[:, None] + np.arange(part.n_nodes)
        G: Any = design.node_transforms(name, np.arange(part.n_nodes))
        x = padded[topology.dof[topology.root[number]]]
        u = plain(G) @ x
        force = np.zeros((*u.shape[:-1], len(pairs.value)))
        if len(part.connectivity):
            found += _elements(own, part.connectivity, u, force, pairs)
        for discrete in own.discrete_elements:
            placed = [k for k, node in enumerate(discrete.nodes) if node < part.n_positioned]
            positions = design.geometry.parts[name].positions
            found += _discrete(discrete, placed, positions, u, force, pairs)
        if isinstance(G, Dual):
            found += _with(G, np.einsum("cniq,cnjq->cnijq", force, x[..., pairs.second]))
    return found


def _with(x: Any, weight: Array) -> Array | float:
    """Slopes (P, q) of the sum of something (...) with slopes times weights (..., q); zero without slopes."""
    if not isinstance(x, Dual):
        return 0.0
    count = len(x.slope)
    return x.slope.reshape(count, -1) @ weight.reshape(-1, weight.shape[-1])


def _elements(own: PartMatrices, nodes: Index, u: Array, force: Array, pairs: Pairs) -> Any:
    """What comes of the elements' matrices, frames and lengths; adds twice their forces on nodes to `force`."""
    T, K, M, length = (own.T, own.elements.K[..., 6:, 6:], own.elements.M, own.elements.length)
    a, b, value = pairs
    ends = u[:, nodes].reshape(len(u), len(nodes), 12, -1)
    local = plain(T) @ ends
    reach = np.zeros((len(nodes), 3))
    reach[:, 0] = plain(length)
    D = rigid_arm(reach)
    strain = local[..., 6:, :] - D @ local[..., :6, :]
    pull = (plain(K) @ strain)[..., a]
    inner = -value * (plain(M) @ local)[..., a]
    inner[..., 6:, :] += pull
    inner[..., :6, :] -= np.swapaxes(D, -1, -2) @ pull
    found = _with(K, np.einsum("ceiq,cejq->eijq", strain[..., a], strain[..., b]))
    found = found - _with(M, np.einsum("ceiq,cejq->eijq", local[..., a], local[..., b]) * value)
    found = found + _with(T, 2 * np.einsum("ceiq,cejq->eijq", inner, ends[..., b]))
    turn = pull[..., 1, :] * local[..., 5, b] - pull[..., 2, :] * local[..., 4, b]
    found = found - _with(length, 2 * turn.sum(axis=0))
    back = 2 * (np.swapaxes(plain(T), -1, -2) @ inner)
    np.add.at(force, np.s_[:, nodes], back.reshape(*u[:, nodes].shape[:-1], -1))  # pyright: ignore
    return found


def _discrete(
    discrete: DiscreteElement, placed: list[int], positions: Any, u: Array, force: Array, pairs: Pairs
) -> Any:
    """The same of a discrete element, with the arms between its nodes in place of lengths."""
    a, b, value = pairs
    v = u[:, discrete.nodes]
    shape, found = v.shape, 0.0
    flat = v.reshape(len(u), 6 * len(discrete.nodes), -1)
    back = np.zeros((len(u), flat.shape[1], len(value)))
    if discrete.M is not None:
        found = found - _with(discrete.M, np.einsum("ciq,cjq->ijq", flat[..., a], flat[..., b]) * value)
        back -= value * (plain(discrete.M) @ flat)[..., a]
    if discrete.K is not None:
        B: Any = np.eye(flat.shape[1])
        if len(placed) > 1:
            at = [discrete.nodes[k] for k in placed]
            arms = rigid_arm(positions[at] - positions[at[0]])
            B = zeros(B.shape, arms) + B
            for k, arm in zip(placed, arms, strict=True):
                B[6 * k : 6 * k + 6, 6 * placed[0] : 6 * placed[0] + 6] -= arm
        strain = plain(B) @ flat
        pull = (plain(discrete.K) @ strain)[..., a]
        found = found + _with(discrete.K, np.einsum("ciq,cjq->ijq", strain[..., a], strain[..., b]))
        found = found + _with(B, 2 * np.einsum("ciq,cjq->ijq", pull, flat[..., b]))
        back += plain(B).T @ pull
    np.add.at(force, np.s_[:, discrete.nodes], 2 * back.reshape(*shape[:-1], -1))  # pyright: ignore
    return found


@dataclass(frozen=True)
class FrequencySlopes:
    """The lowest natural frequencies (n,), Hz, and their derivatives `slope` (n, P), Hz per SI unit, by P parameters.

    Where the last one is repeated all its copies are there. `repeated` has the positions of frequencies that coincide;
    for each such group `directional` is the matrix (m, m, P), Hz per SI unit, whose eigenvalues along a direction in
    the space of parameters are the derivatives of the m frequencies along it; their rows of `slope` are those along one
    parameter each, ascending. `kinks` are positions of parameters by which nothing has a derivative here: NaN.
    """

    frequency_hz: Array
    slope: Array
    repeated: tuple[tuple[int, ...], ...]
    directional: tuple[Array, ...]
    kinks: tuple[int, ...]


def frequency_slopes(design: Design, n: int) -> FrequencySlopes:
    """The `n` lowest natural frequencies of the full-order model of a design, made `with_slopes`, and their exact
    derivatives.

    Theory eqs. K1-K4. Raises OptionError for a pose that is described, and SolverError.
    """
    design.plan.refuse_pose("derivatives of frequencies")
    if n < 1:
        raise OptionError(f"the number of frequencies is at least 1, not {n}")
    pairs = _pairs(design.still, n)
    groups = clusters(pairs.values)
    forms = iter(_forms(design, pairs.vectors, Pairs.of(groups, pairs.values)).T)
    omega = np.sqrt(np.maximum(pairs.values, 0.0))
    slope = np.zeros((len(omega), len(slope_of(design.values))))
    repeated, directional = [], []
    for at in groups:
        w = omega[at].mean()
        space = np.array([next(forms) for _ in range(len(at) ** 2)]).reshape(len(at), len(at), -1)
        space = (space + space.swapaxes(0, 1)) / (8 * np.pi * w) if w else np.zeros(space.shape)
        smooth = np.flatnonzero(np.isfinite(space).all(axis=(0, 1)))
        slope[at] = np.nan
        slope[np.array(at)[:, None], smooth] = np.linalg.eigvalsh(np.moveaxis(space[..., smooth], -1, 0)).T
        if len(at) > 1:
            repeated.append(tuple(at))
            directional.append(space)
    kinks = tuple(np.flatnonzero(np.isnan(slope).any(axis=0)).tolist())
    return FrequencySlopes(omega / (2 * np.pi), slope, tuple(repeated), tuple(directional), kinks)


def _pairs(design: Design, n: int) -> Eigenpairs:
    """The `n` lowest pairs of a design without slopes, and further copies of the last."""
    (K, M), family = stiffness_and_mass(design), FullOrderFamily(design.plan)
    found = lowest_groups(K, M, n, GUARD, REPEATED_EIGENVALUES, lambda X: family.products_of(design, X)[0])
    return found or whole_clusters(K, M, n)


def _forms(design: Design, X: Array, pairs: Pairs) -> Array:
    """x_a' (K' - lambda M') x_b (P, q) for pairs of modes; by the energies of elements where nothing is loaded."""
    if not design.plan.is_loaded:
        return energy_slopes(design, X, pairs)
    a, b, value = pairs
    found = []
    for change in FullOrderFamily(design.plan).changes_of(design, X):
        own = (X[:, a] * (change.K[:, b] - value * change.M[:, b])).sum(axis=0)
        found.append(own if change.is_smooth else np.full(len(value), np.nan))
    return np.array(found)
