"""Derivatives of eigenvalues and eigenvectors of K(p) x = lambda M(p) x, repeated eigenvalues included.

What eigenvalues alone need of K' and M' are derivatives of the energies of fixed modes. Modes make weights, in floats,
of the few numbers that energies are made of: coefficients of flexibility and mass of elements, their lengths, axes and
offsets, and places of nodes; slopes of these are all that is worked out for a parameter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.arrays import Array, Index
from flexura.beam import PLANE_BASIS, rigid_arm
from flexura.derivatives.families import Change, FullOrderFamily
from flexura.duals import Dual, plain, slope_of
from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, inverse_roots, lowest, lowest_groups, scaled
from flexura.modal import close_groups
from flexura.structure import Copies, Design, DiscreteElement, Part, PartMatrices, full_order, stiffness_and_mass
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

    Theory eq. K4, by energies: what modes do is worked out without slopes, as weights of all that has some,
    flexibilities and masses of elements, lengths, axes and places. The mean with that of the pair (b, a) is what is
    symmetric. Loads that are described add nothing here.
    """
    still, plan, topology = design.still, design.plan, design.plan.topology
    weighed = _Weighed(design, len(pairs.value))
    padded = np.concatenate([X, np.zeros((1, X.shape[1]))])
    for name, G in full_order(plan).transforms(still).items():
        part, copies, matrices = plan.parts[name], topology.copies[name], still.matrices[name]
        x = padded[topology.dof[topology.root[copies.numbers()]]]
        u = G @ x
        force = np.zeros((*u.shape[:-1], len(pairs.value)))
        if len(part.connectivity):
            _elements(weighed, part, matrices, u, force, pairs)
        for one, moving in zip(matrices.discrete_elements, design.discrete_elements[name], strict=True):
            _discrete(weighed, part, (one, moving), u, force, pairs)
        _nodes(weighed, copies, x, u, force, pairs)
    return weighed.slopes()


class _Weighed:
    """Sums (P, q) of the slopes of a design times weights, those of places and elements all together at the end."""

    def __init__(self, design: Design, count: int) -> None:
        parts, values = design.plan.parts, design.values
        self.design, self.count = design, count
        self._sum = np.zeros((len(slope_of(values)) if isinstance(values, Dual) else 0, count))
        self.on_nodes: Array = np.zeros((design.plan.topology.n_nodes, 3, count))
        """Weights (n, 3, q) of where nodes are, global frame."""
        self.in_parts: dict[str, Array] = {name: np.zeros((part.n_nodes, 3, count)) for name, part in parts.items()}
        """Weights (n, 3, q) of where the nodes of parts are, each in its own frame."""
        self.on_elements: list[tuple[Array, Array]] = []
        """Weights (e, 6, 6, q) of flexibilities and (e, 12, 12, q) of masses of the elements of each part."""

    def add(self, x: Any, weight: Array) -> None:
        """Add the slopes of something (...) times weights (..., q)."""
        if isinstance(x, Dual):
            self._sum += x.slope.reshape(len(x.slope), -1) @ weight.reshape(-1, self.count)

    def slopes(self) -> Array:
        """All sums (P, q)."""
        geometry = self.design.geometry
        for name, copies in self.design.plan.topology.copies.items():
            weight, Q = self.on_nodes[copies.numbers()], geometry.Q[copies.number]
            in_part = self.in_parts[name] + (np.swapaxes(plain(Q), -1, -2)[:, None] @ weight).sum(axis=0)
            used, x = np.flatnonzero(in_part.any(axis=(1, 2))), geometry.parts[name].positions
            self.add(x[used], in_part[used])
            if weight.any():
                self.add(geometry.t[copies.number], weight.sum(axis=1))
                self.add(Q, np.einsum("cniq,nj->cijq", weight, plain(x)))
        if self.on_elements:
            elements = self.design.elements
            on_flexibility, on_mass = (np.concatenate(own) for own in zip(*self.on_elements, strict=True))
            self._add_sums(elements.flexibility_coefficients, elements.flexibility_basis, on_flexibility)
            self._add_sums(elements.mass_coefficients, elements.mass_basis, on_mass)
            if len(elements.rooted):
                self._add_sums(elements.root_mass, PLANE_BASIS, on_mass[elements.rooted])
        return self._sum

    def _add_sums(self, coefficients: Any, basis: Array, weight: Array) -> None:
        """Add the slopes of sums of coefficients (e, k) times a basis (k, i j), times weights (e, i, j, q)."""
        self.add(coefficients, basis @ weight.reshape(len(weight), -1, self.count))


def _products(a: Array, b: Array) -> Array:
    """Sums (..., i, j, q), over the copies of a part, of products of vectors (copies, ..., i, q)."""
    return np.moveaxis(np.moveaxis(a, (0, -1), (-1, -3)) @ np.moveaxis(b, (0, -1), (-2, -3)), -3, -1)


def _levers(force: Array, turn: Array) -> Array:
    """Weights (..., 3, q) of arms d of forces (..., 3, q), which are moved by turn x d: force x turn."""
    first, second = [1, 2, 0], [2, 0, 1]
    return force[..., first, :] * turn[..., second, :] - force[..., second, :] * turn[..., first, :]


def _elements(weighed: _Weighed, part: Part, matrices: PartMatrices, u: Array, force: Array, pairs: Pairs) -> None:
    """Weigh the elements of a part in displacements u (copies, n, 6, k); add twice their forces on nodes to `force`
    (copies, n, 6, q)."""
    a, b, value = pairs
    nodes, moving = part.connectivity, weighed.design.geometry.parts[part.name]
    shape, first, last = (len(u), len(nodes), 12, -1), part.first[:-1], part.first[1:] - 1
    local = matrices.T @ u[:, nodes].reshape(shape)
    D = rigid_arm(matrices.elements.length[:, None] * np.eye(3)[0])
    strain = local[..., 6:, :] - D @ local[..., :6, :]
    if matrices.strips:
        strain[..., 3, :] += matrices.twist_shared(u)
    pull = matrices.elements.K[..., 6:, 6:] @ strain
    inner = -value * (matrices.elements.M @ local)[..., a]
    moved, pulled, pulling = local[..., b], pull[..., b], pull[..., a]
    inner[..., 6:, :] += pulling
    inner[..., :6, :] -= np.swapaxes(D, -1, -2) @ pulling
    weighed.on_elements.append((-_products(pulling, pulled), -value * _products(local[..., a], moved)))
    for elements, S in weighed.design.matrices[part.name].elements.couplings:
        weighed.add(S, _products(pulling[:, elements, 3], pulled[:, elements, 3]))
    turn = (pulling[..., 1, :] * moved[..., 5, :] - pulling[..., 2, :] * moved[..., 4, :]).sum(axis=0)
    weighed.add(moving.length, -2 * np.add.reduceat(turn, first) / part.counts[:, None])
    vectors, R = (own.reshape(*shape[:2], 4, 3, -1) for own in (inner, moved)), plain(moving.R)
    turned = np.add.reduceat(np.einsum("cekiq,ceklq->eilq", *vectors), first)
    weighed.add(moving.R, 2 * np.einsum("milq,mlj->mijq", turned, R))
    ends = [(inner[:, first, :3], moved[:, first, 3:6]), (inner[:, last, 6:9], moved[:, last, 9:])]
    levers = [np.swapaxes(R, -1, -2) @ _levers(*end).sum(axis=0) for end in ends]
    weighed.add(moving.offsets, 2 * np.stack(levers, axis=1))
    back = 2 * (np.swapaxes(matrices.T, -1, -2) @ inner)
    np.add.at(force, np.s_[:, nodes], back.reshape(*shape[:2], 2, 6, -1))  # pyright: ignore


def _discrete(
    weighed: _Weighed, part: Part, both: tuple[DiscreteElement, DiscreteElement], u: Array, force: Array, pairs: Pairs
) -> None:
    """The same of a discrete element, without slopes and with; what its nodes are displaced from the rigid motion of
    the first that has a place is its deformation."""
    (a, b, value), (one, moving) = pairs, both
    flat = u[:, one.nodes].reshape(len(u), 6 * len(one.nodes), -1)
    back = np.zeros((*flat.shape[:2], len(value)))
    if one.M is not None:
        weighed.add(moving.M, -value * _products(flat[..., a], flat[..., b]))
        back -= value * (one.M @ flat)[..., a]
    if one.K is not None:
        placed = [k for k, node in enumerate(one.nodes) if node < part.n_positioned]
        x, B = plain(weighed.design.geometry.parts[part.name].positions)[one.nodes], np.eye(flat.shape[1])
        for k in placed if len(placed) > 1 else ():
            B[6 * k : 6 * k + 6, 6 * placed[0] : 6 * placed[0] + 6] -= rigid_arm(x[k] - x[placed[0]])
        strain = B @ flat
        pull = (one.K @ strain)[..., a]
        weighed.add(moving.K, _products(strain[..., a], strain[..., b]))
        for k in placed[1:]:
            turn = flat[:, 6 * placed[0] + 3 : 6 * placed[0] + 6, b]
            lever = 2 * _levers(pull[:, 6 * k : 6 * k + 3], turn).sum(axis=0)
            weighed.in_parts[part.name][one.nodes[k]] -= lever
            weighed.in_parts[part.name][one.nodes[placed[0]]] += lever
        back += B.T @ pull
    np.add.at(force, np.s_[:, one.nodes], 2 * back.reshape(len(u), -1, 6, len(value)))  # pyright: ignore


def _nodes(weighed: _Weighed, copies: Copies, x: Array, u: Array, force: Array, pairs: Pairs) -> None:
    """Weigh where nodes with displacements u (copies, n, 6, k) in the part's axes are and how these have turned, by
    forces (copies, n, 6, q) there; x (copies, n, 6, k) are the displacements of their roots, global axes."""
    topology, geometry = weighed.design.plan.topology, weighed.design.geometry
    at, b, number = copies.number, pairs.second, copies.numbers()
    placed = np.arange(number.shape[1]) < copies.part.n_positioned
    turning = plain(geometry.turning)[at, None]
    slaved = topology.is_rigid[number] & (topology.root[number] != number) & placed
    lever = _levers((turning @ force)[slaved][:, :3], x[slaved][:, 3:, b])
    weighed.on_nodes[number[slaved]] += lever
    np.subtract.at(weighed.on_nodes, topology.root[number[slaved]], lever)
    if isinstance(geometry.Q, Dual):
        moved, sign = (turning @ u)[:, placed][..., b], np.linalg.det(plain(geometry.Q)[at]).round()
        both = (np.einsum("cnjq,cniq->cjiq", moved[:, :, k : k + 3], force[:, placed, k : k + 3]) for k in (0, 3))
        translated, rotated = both
        weighed.add(geometry.Q[at], translated + sign[:, None, None, None] * rotated)


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
        K, M, n, guard=SPARE_EIGENVALUES, gap=REPEATED_EIGENVALUES, forces=lambda X: family.forces_of(design, X)
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
