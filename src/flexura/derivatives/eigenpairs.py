"""Derivatives of eigenvalues and eigenvectors of K(p) x = lambda M(p) x, repeated eigenvalues included.

What eigenvalues alone need of K' and M' are derivatives of the energies of fixed modes, by element and node. Energies
of modes are worked out once, in floats; of what has slopes, only the matrices of elements, their frames, lengths and
arms are contracted with them. Nothing of the size of the model is formed for a parameter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.derivatives.families import Change, FullOrderFamily
from flexura.duals import Dual, plain, slope_of, zeros
from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, inverse_roots, lowest, lowest_groups, scaled
from flexura.modal import close_groups
from flexura.structure import Design, DiscreteElement, PartMatrices, stiffness_and_mass
from flexura.thresholds import REPEATED_EIGENVALUES

SPARE_EIGENVALUES = 3
"""Eigenvalues computed beyond those wanted, to see whether the last one is repeated."""

Bends = Callable[[Array], tuple[Array, Array]]
"""K'' X and M'' X (n, k) of vectors X (n, k), by one parameter."""


def whole_clusters(K: Any, M: Any, n: int) -> Eigenpairs:
    """The lowest n eigenpairs, and further copies of the last where it is repeated."""
    count = n + SPARE_EIGENVALUES
    while True:
        pairs = lowest(K, M, count)
        values = pairs.values[np.isfinite(pairs.values)]
        ends = (group[-1] + 1 for group in clusters(values))
        stop = next((end for end in ends if end >= n), len(values))
        if stop < count or count >= K.shape[0]:
            return Eigenpairs(values[:stop], pairs.vectors[:, :stop])
        count *= 2


def clusters(values: Array) -> list[list[int]]:
    """Positions of ascending values, those that are repeated together."""
    return [group.tolist() for group in close_groups(values, REPEATED_EIGENVALUES)]


@dataclass(frozen=True)
class Cluster:
    """One eigenvalue of multiplicity m and how its eigenvectors X (n, m) move, for P parameters.

    `slope` (P, m, m) is X' (K' - lambda M') X, `mass` (P, m, m) X' M' X, and `outer` (P, n, m) the part of X' that is
    M-orthogonal to X (theory eqs. K4-K7).
    """

    at: list[int]
    value: float
    X: Array
    slope: Array
    mass: Array
    outer: Array


def moved_clusters(K: Any, M: Any, pairs: Eigenpairs, changes: Sequence[Change], shapes: bool = True) -> list[Cluster]:
    """Every eigenvalue of the pairs with its derivatives; without `shapes`, `outer` is left zero.

    Raises SolverError when an eigenvector cannot be told from its neighbours.
    """
    moved = []
    for at in clusters(pairs.values):
        X, value = pairs.vectors[:, at], float(np.mean(pairs.values[at]))
        force = np.stack([c.K[:, at] - value * c.M[:, at] for c in changes]) if changes else np.empty((0, *X.shape))
        slope = X.T @ force
        slope = (slope + np.swapaxes(slope, -1, -2)) / 2
        mass = np.stack([X.T @ c.M[:, at] for c in changes]) if changes else slope
        outer = np.zeros_like(force)
        if shapes and len(changes):
            outer = _orthogonal_parts(K, M, value, X, M @ X @ slope - force)
        moved.append(Cluster(at, value, X, slope, mass, outer))
    return moved


def _orthogonal_parts(K: Any, M: Any, value: float, X: Array, force: Array) -> Array:
    """V (P, n, m) with (K - value M) V = force and X' M V = 0: a system bordered by M X (theory eq. K6)."""
    n, m = X.shape
    d = inverse_roots(np.abs(K.diagonal()) + abs(value) * M.diagonal())
    border = d[:, None] * (M @ X)
    border /= np.linalg.norm(border, axis=0)
    right = np.concatenate([d[:, None] * np.moveaxis(force, 0, 1).reshape(n, -1), np.zeros((m, len(force) * m))])
    try:
        if isinstance(K, np.ndarray):
            A = scaled(K - value * M, d)
            y = la.solve(np.block([[A, border], [border.T, np.zeros((m, m))]]), right, assume_a="sym")
        else:
            A = sp.bmat([[scaled((K - value * M).tocsc(), d), border], [border.T, None]], format="csc")
            y = spla.splu(A).solve(right)
    except (la.LinAlgError, RuntimeError):
        raise SolverError(
            "the shapes' sensitivities are undefined: K - lambda M is singular beyond its modes"
        ) from None
    return np.moveaxis((d[:, None] * y[:n]).reshape(n, len(force), m), 1, 0)


@dataclass(frozen=True)
class Branch:
    """The m branches into which one eigenvalue goes as one parameter moves: derivatives (m,) and those of vectors
    X Q (n, m), with the rotation Q (m, m) in which they are differentiable."""

    value: Array
    vectors: Array
    Q: Array


def branches(cluster: Cluster, change: Change, p: int, bends: Bends) -> Branch:
    """Derivatives of a cluster's eigenvalues and M-normalised eigenvectors for parameter p (theory eqs. K4-K9).

    Distinct derivatives part a repeated eigenvalue, and fix its vectors (Ojalvo 1988; Mills-Curran 1988; Dailey 1989);
    where they agree too the vectors are left as they are, turned least.
    """
    at, X, value = cluster.at, cluster.X, cluster.value
    slopes, Q = la.eigh(cluster.slope[p])
    Z, V = X @ Q, cluster.outer[p] @ Q
    mass = Q.T @ cluster.mass[p] @ Q
    C = -mass / 2
    if len(at) > 1:
        apart = slopes - slopes[:, None]
        scale = np.abs(slopes).max(initial=0.0)
        split = np.abs(apart) > 1e-5 * scale if scale else np.zeros_like(apart, dtype=bool)
        if split.any():
            K2, M2 = bends(X)
            force = (change.K[:, at] - value * change.M[:, at]) @ Q
            top = Q.T @ X.T @ (K2 - value * M2) @ Q + 2 * force.T @ V - 2 * mass * slopes
            C = np.where(split, top / (2 * np.where(split, apart, 1.0)), C)
    return Branch(slopes, V + Z @ C, Q)


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
    slopes = np.zeros((len(values.slope) if isinstance(values, Dual) else 0, len(pairs.value)))
    padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
    for name, matrices in design.matrices.items():
        part = plan.parts[name]
        number = np.array(topology.copies[name].offset)[:, None] + np.arange(part.n_nodes)
        G: Any = design.node_transforms(name, np.arange(part.n_nodes))
        x = padded[topology.dof[topology.root[number]]]
        u = plain(G) @ x
        force = np.zeros((*u.shape[:-1], len(pairs.value)))
        if len(part.connectivity):
            slopes += _elements(matrices, part.connectivity, u, force, pairs)
        for discrete in chain(matrices.discrete_elements, *(strips.each for strips in matrices.strips)):
            placed = [k for k, node in enumerate(discrete.nodes) if node < part.n_positioned]
            B = _relative(discrete.nodes, placed, design.geometry.parts[name].positions)
            slopes += _discrete(discrete, B, u, force, pairs)
        if isinstance(G, Dual):
            slopes += _with(G, np.einsum("cniq,cnjq->cnijq", force, x[..., pairs.second]))
    return slopes


def _with(x: Any, weight: Array) -> Array | float:
    """Slopes (P, q) of the sum of something (...) with slopes times weights (..., q); zero without slopes."""
    if not isinstance(x, Dual):
        return 0.0
    count = len(x.slope)
    return x.slope.reshape(count, -1) @ weight.reshape(-1, weight.shape[-1])


def _elements(matrices: PartMatrices, nodes: Index, u: Array, force: Array, pairs: Pairs) -> Any:
    """What comes of the elements' matrices, frames and lengths; adds twice their forces on nodes to `force`."""
    T, K, M, length = (matrices.T, matrices.elements.K[..., 6:, 6:], matrices.elements.M, matrices.elements.length)
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
    slopes = _with(K, np.einsum("ceiq,cejq->eijq", strain[..., a], strain[..., b]))
    slopes = slopes - _with(M, np.einsum("ceiq,cejq->eijq", local[..., a], local[..., b]) * value)
    slopes = slopes + _with(T, 2 * np.einsum("ceiq,cejq->eijq", inner, ends[..., b]))
    turn = pull[..., 1, :] * local[..., 5, b] - pull[..., 2, :] * local[..., 4, b]
    slopes = slopes - _with(length, 2 * turn.sum(axis=0))
    back = 2 * (np.swapaxes(plain(T), -1, -2) @ inner)
    np.add.at(force, np.s_[:, nodes], back.reshape(*u[:, nodes].shape[:-1], -1))  # pyright: ignore
    return slopes


def _relative(nodes: Sequence[int], placed: list[int], positions: Any) -> Any:
    """B (6k, 6k): displacements of k nodes less what the rigid motion of the first one `placed` makes of them."""
    B: Any = np.eye(6 * len(nodes))
    if len(placed) > 1:
        at = [nodes[k] for k in placed]
        arms = rigid_arm(positions[at] - positions[at[0]])
        B = zeros(B.shape, arms) + B
        for k, arm in zip(placed, arms, strict=True):
            B[6 * k : 6 * k + 6, 6 * placed[0] : 6 * placed[0] + 6] -= arm
    return B


def _discrete(discrete: DiscreteElement, B: Any, u: Array, force: Array, pairs: Pairs) -> Any:
    """The same of a discrete element, with the relative displacements B of its nodes in place of lengths."""
    a, b, value = pairs
    v = u[:, discrete.nodes]
    shape, slopes = v.shape, 0.0
    flat = v.reshape(len(u), 6 * len(discrete.nodes), -1)
    back = np.zeros((len(u), flat.shape[1], len(value)))
    if discrete.M is not None:
        slopes = slopes - _with(discrete.M, np.einsum("ciq,cjq->ijq", flat[..., a], flat[..., b]) * value)
        back -= value * (plain(discrete.M) @ flat)[..., a]
    if discrete.K is not None:
        strain = plain(B) @ flat
        pull = (plain(discrete.K) @ strain)[..., a]
        slopes = slopes + _with(discrete.K, np.einsum("ciq,cjq->ijq", strain[..., a], strain[..., b]))
        slopes = slopes + _with(B, 2 * np.einsum("ciq,cjq->ijq", pull, flat[..., b]))
        back += plain(B).T @ pull
    np.add.at(force, np.s_[:, discrete.nodes], 2 * back.reshape(*shape[:-1], -1))  # pyright: ignore
    return slopes


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
    pairs = lowest_groups(
        K, M, n, guard=SPARE_EIGENVALUES, gap=REPEATED_EIGENVALUES, forces=lambda X: family.products_of(design, X)[0]
    )
    return pairs or whole_clusters(K, M, n)


def _forms(design: Design, X: Array, pairs: Pairs) -> Array:
    """x_a' (K' - lambda M') x_b (P, q) for pairs of modes; by the energies of elements where nothing is loaded."""
    if not design.plan.is_loaded:
        return energy_slopes(design, X, pairs)
    a, b, value = pairs
    forms = []
    for change in FullOrderFamily(design.plan).changes_of(design, X):
        form = (X[:, a] * (change.K[:, b] - value * change.M[:, b])).sum(axis=0)
        forms.append(form if change.is_smooth else np.full(len(value), np.nan))
    return np.array(forms)
