"""Elastic boxes and cylinders by the Rayleigh-Ritz method, as superelements over patches at which members pull.

Displacements are products of Legendre polynomials (W. M. Visscher, A. Migliori, T. M. Bell, R. A. Reinert, J. Acoust.
Soc. Am. 90 (1991) 2154), so that frequencies are upper and deflections lower bounds. A box has the axes of its edges,
a cylinder lies along its first axis; places are over the half sizes. Both are their own mirror images, so that
displacements fall into classes that know nothing of each other: those that mirrors leave as they are or turn round.
Coordinates are in blocks (c, s), one for each class, filled up with coordinates of nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple, Protocol

import numpy as np
import scipy.linalg as la
from numpy.polynomial import legendre

from flexura.arrays import Array, Index
from flexura.beam.frames import rigid_arm, skew
from flexura.duals import zeros
from flexura.errors import SolverError

ORDER = 6
"""Order of the products for a cube; along longer sides it is higher, as the root of the length."""

ORDERS = (3, 16)
"""The least and the largest order along a side."""

ENOUGH = 6
"""Coordinates for each displacement of a patch, at least."""

SLENDEREST = 1e-15
"""Squared frequency over the largest one that is round-off: of rods from some 1500 times as long as thick on."""

RIDGE = 1e-4
"""Flexibility over that of a patch that is added to it: what patches have between them that functions of these orders
cannot tell apart."""

COLLINEAR = 1e-6
"""What keeps a patch that is nearly a line from turning about it without end, over its spread squared."""

PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
"""The axes of products of two slopes, as a stiffness is made up of them."""


class Material(NamedTuple):
    """Young's modulus, Pa, Poisson's ratio and density, kg/m^3, each (...)."""

    E: Array
    nu: Array
    rho: Array


class _Tables(NamedTuple):
    """Integrals over the solid of half sizes one, in blocks.

    Of products of functions (c, s, s), of displacements along the axes times 1 and the three coordinates (4, 3, c, s),
    the stiffness by its twelve coefficients (12, c, s, s), what keeps coordinates of nothing in place (c, s, s), and
    the volume.
    """

    product: Array
    moments: Array
    stiffness: Array
    spare: Array
    volume: float


@dataclass(frozen=True)
class RitzSolid:
    """What an elastic box, or the elliptic cylinder about its first axis that fits into it, can do.

    `orders` are the highest along the axes. `held` is the axis and the side, -1 or 1, of the face that does not move;
    the functions are then multiplied by the distance from it.
    """

    orders: tuple[int, int, int]
    is_round: bool = False
    held: tuple[int, int] | None = None

    @staticmethod
    def of(size: Array, is_round: bool = False, held: tuple[int, int] | None = None, patches: int = 0) -> RitzSolid:
        """With the orders that sides (3,), m, and a number of patches ask for."""
        lengths = np.sqrt(size / np.prod(size) ** (1 / 3))
        for order in range(ORDER, 2 * ORDERS[1]):
            one, two, three = np.clip(np.round(order * lengths), *ORDERS).astype(int).tolist()
            solid = RitzSolid((one, two, three), is_round, held)
            if 3 * len(solid.exponents) >= ENOUGH * 6 * patches:
                break
        return solid

    @property
    def exponents(self) -> Index:
        """Orders (n, 3) along the axes of the products."""
        return _exponents(self.orders)

    @property
    def blocks(self) -> Index:
        """The coordinates (c, s) of all classes, numbered by displacement, then by function; 3n is one of nothing."""
        return _blocks(self)

    def split(self, rows: Array) -> Array:
        """Rows (..., k, 3n) by coordinates, in blocks (..., c, k, s)."""
        at = np.concatenate([rows, 0.0 * rows[..., :1]], axis=-1)[..., self.blocks]
        return np.moveaxis(at, -2, -3)

    def functions(self, places: Array) -> Array:
        """Values (..., p, n) at places (..., p, 3)."""
        n = self.exponents
        X, Y, Z = (_legendre(places[..., k], self.orders[k])[..., n[:, k]] for k in range(3))
        values = X * Y * Z
        if self.held is None:
            return values
        axis, side = self.held
        return values * (1 - side * places[..., axis, None])

    def gradients(self, places: Array) -> Array:
        """Slopes (3, p, n) by the coordinates at places (p, 3)."""
        n, slopes = self.exponents, [legendre.legder(np.eye(order + 1)) for order in self.orders]
        at = [legendre.legvander(places[:, k], self.orders[k]) for k in range(3)]
        by = [at[k][:, :-1] @ slopes[k] for k in range(3)]
        rows = [np.prod([(by if a == k else at)[k][:, n[:, k]] for k in range(3)], axis=0) for a in range(3)]
        gradients = np.stack(rows)
        if self.held is None:
            return gradients
        axis, side = self.held
        gradients = gradients * (1 - side * places[:, axis])[:, None]
        gradients[axis] -= side * np.prod([at[k][:, n[:, k]] for k in range(3)], axis=0)
        return gradients


class Solid(Protocol):
    """What an elastic solid says of itself in blocks of coordinates (c, s), as `ElasticSolid` documents it."""

    @property
    def held(self) -> tuple[int, int] | None: ...
    def rows(self, patches: Patches) -> Array: ...
    def solved(self, loads: Array) -> Array: ...
    def products(self, coordinates: Array, inner: Array) -> tuple[Array, Array]: ...
    def momenta(self, coordinates: Array) -> Array: ...
    def kept(self, shapes: Array) -> Array: ...
    def displaced(self, coordinates: Array, points: Array) -> Array: ...


class ElasticSolid:
    """A RitzSolid of sides (..., 3), m, and a material; all that does not vary in a stack may lack its axis."""

    functions: RitzSolid
    size: Array
    material: Material

    def __init__(self, functions: RitzSolid, size: Array, material: Material) -> None:
        self.functions, self.size, self.material = functions, size, material
        self._tables = _tables(functions)
        self._volume = np.prod(size, axis=-1) / 8

    @property
    def held(self) -> tuple[int, int] | None:
        """The axis and the side of the face that does not move."""
        return self.functions.held

    @cached_property
    def stiffness(self) -> Array:
        """K (..., c, s, s), N/m."""
        E, nu, _ = self.material
        lame, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
        by = [self._volume * 4 / (self.size[..., a] * self.size[..., b]) for a, b in PAIRS]
        K = _each(E * self._volume ** (1 / 3)) * self._tables.spare
        # summed term by term: a matrix product of many designs rounds otherwise than that of one
        for coefficient, term in zip((lame * each for each in by), self._tables.stiffness[:6], strict=True):
            K = K + _each(coefficient) * term
        for coefficient, term in zip((mu * each for each in by), self._tables.stiffness[6:], strict=True):
            K = K + _each(coefficient) * term
        return K

    @cached_property
    def mass(self) -> Array:
        """M (..., c, s, s), kg."""
        return _each(self.material.rho * self._volume) * self._tables.product

    @cached_property
    def momentum(self) -> Array:
        """Momentum and angular momentum about the centre (..., c, 6, s), kg and kg m, of unit coordinates."""
        moments, half = self._tables.moments, self.size[..., None, None, :] / 2
        L = zeros((*half.shape[:-3], *moments.shape[2:], 6), half)
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            L[..., a] = moments[0, a]
            L[..., 3 + a] = half[..., b] * moments[1 + b, c] - half[..., c] * moments[1 + c, b]
        return np.swapaxes(_each(self.material.rho * self._volume) * L, -1, -2)

    @cached_property
    def mean_rows(self) -> Array:
        """Mean motion of the volume (..., c, 6, s): momentum over mass, angular momentum over inertia."""
        mass = self.material.rho * self._volume * self._tables.volume
        square = self.size * self.size / 4 * (np.array([1 / 3, 1 / 4, 1 / 4]) if self.functions.is_round else 1 / 3)
        inertia = mass[..., None] * (square.sum(axis=-1, keepdims=True) - square)
        by = np.concatenate([np.stack([mass] * 3, axis=-1) + 0 * inertia, inertia], axis=-1)
        return self.momentum / by[..., None, :, None]

    @cached_property
    def _rigid(self) -> tuple[Array, Array]:
        """Rigid motions (..., c, s, 6) of unit mass of a solid that is not held, and the momenta that go with them."""
        n = self.functions.exponents
        R = zeros((*self.size.shape[:-1], 6, 3, len(n)), self.size)
        at = [int(np.flatnonzero((n == row).all(axis=1))[0]) for row in np.vstack([np.zeros((1, 3)), np.eye(3)])]
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            R[..., a, a, at[0]] = 1.0
            R[..., 3 + a, b, at[1 + c]] = -self.size[..., c] / 2
            R[..., 3 + a, c, at[1 + b]] = self.size[..., b] / 2
        R = np.swapaxes(self.functions.split(R.reshape(*R.shape[:-2], -1)), -1, -2)
        MR = self.mass @ R
        norm = np.sqrt((R * MR).sum(axis=(-3, -2)))[..., None, None, :]
        return R / norm, MR / norm

    @cached_property
    def _flexibility(self) -> Array:
        """The inverse of K, of a solid that is not held with a stiffness against its rigid motions."""
        K = self.stiffness
        if self.functions.held is None:
            _, MR = self._rigid
            scale = _each(self.material.E / (self.material.rho * self._volume ** (2 / 3)))
            K = K + scale * MR @ np.swapaxes(MR, -1, -2)
        inverse: Array = np.linalg.inv(K)  # pyright: ignore[reportAssignmentType]
        return inverse

    def solved(self, loads: Array) -> Array:
        """Coordinates (..., c, s, k), m/N, under loads (..., c, s, k). A solid that is not held is accelerated by what
        of them is out of balance, and has no mean motion."""
        if self.functions.held is not None:
            return self._flexibility @ loads
        R, MR = self._rigid
        balanced = loads - MR @ (np.swapaxes(R, -1, -2) @ loads)
        return self.without_mean(self._flexibility @ balanced)

    def without_mean(self, coordinates: Array) -> Array:
        """Coordinates (..., c, s, k) less their mean motion, of a solid that is not held."""
        R, MR = self._rigid
        return coordinates - R @ (np.swapaxes(MR, -1, -2) @ coordinates)

    def rows(self, patches: Patches) -> Array:
        """Motion (..., c, 6p, s) of patches by coordinates, of one that is held with its mean motion as the last."""
        rows = patch_rows(self.functions, self.size, patches)
        if self.functions.held is None:
            return rows
        return np.concatenate([rows, self.mean_rows + 0.0 * rows[..., :1, :1]], axis=-2)

    def products(self, coordinates: Array, inner: Array) -> tuple[Array, Array]:
        """Mass (..., k, k) between coordinates (..., c, s, k), and stiffness (..., m, m) between inner ones."""
        mass = np.swapaxes(coordinates, -1, -2) @ (self.mass @ coordinates)
        stiffness = np.swapaxes(inner, -1, -2) @ (self.stiffness @ inner)
        return mass.sum(axis=-3), stiffness.sum(axis=-3)

    def momenta(self, coordinates: Array) -> Array:
        """Momentum and angular momentum about the centre (..., 6, k) of coordinates (..., c, s, k)."""
        return (self.momentum @ coordinates).sum(axis=-3)

    def kept(self, shapes: Array) -> Array:
        """Coordinates (..., c, s, k) of shapes (c, s, k) by functions, without mean motion where that is free."""
        return self.without_mean(shapes) if self.functions.held is None else shapes

    def displaced(self, coordinates: Array, points: Array) -> Array:
        """Displacements (q, 3, k), m, of points (q, 3), m from the centre, by coordinates (c, s, k); one design."""
        blocks, n = self.functions.blocks, len(self.functions.exponents)
        flat = np.zeros((3 * n + 1, coordinates.shape[-1]))
        flat[blocks.ravel()] = coordinates.reshape(-1, coordinates.shape[-1])
        N = self.functions.functions(points / (self.size / 2))
        return np.einsum("qn,ank->qak", N, flat[:-1].reshape(3, n, -1))


class ModalSolid(ElasticSolid):
    """An ElasticSolid of one design in the coordinates (c, s) of its modes, which cost less.

    `squared` (c, s) are squared angular frequencies, 1/s^2, infinite for rigid motions and what stands for nothing;
    `shapes` (c, s, s) lead from coordinates to functions, modes of unit modal mass. Raises SolverError where round-off
    hides the lowest.
    """

    def __init__(self, functions: RitzSolid, size: Array, material: Material) -> None:
        super().__init__(functions, size, material)
        self.squared: Array = np.full(functions.blocks.shape, np.inf)
        self.shapes: Array = np.zeros(self.stiffness.shape)
        for block, at in enumerate(functions.blocks):
            own = np.flatnonzero(at < 3 * len(functions.exponents))
            pick = np.ix_(own, own)
            squared, vectors = la.eigh(self.stiffness[block][pick], self.mass[block][pick])
            self.squared[block, : len(own)], self.shapes[block, own, : len(own)] = squared, vectors
        largest = self.squared[np.isfinite(self.squared)].max()
        if functions.held is None:
            self.squared.flat[np.argsort(self.squared, axis=None)[:6]] = np.inf
        if not self.squared.min() > SLENDEREST * largest:
            sides = " x ".join(f"{1e3 * side:.3g}" for side in size)
            raise SolverError(f"a solid of {sides} mm is too slender for an estimate of how it gives")

    @cached_property
    def _modal_momentum(self) -> Array:
        return self.momentum @ self.shapes

    def modes(self, count: int) -> tuple[Array, Array]:
        """Squared angular frequencies (k,), 1/s^2, and shapes (c, s, k) by functions of the lowest elastic modes."""
        order = np.argsort(self.squared, axis=None)[:count]
        at = np.unravel_index(order, self.squared.shape)
        shapes = np.zeros((*self.squared.shape, len(order)))
        shapes[at[0], :, np.arange(len(order))] = self.shapes[at[0], :, at[1]]
        return self.squared[at], shapes

    def rows(self, patches: Patches) -> Array:
        """As of an ElasticSolid."""
        return super().rows(patches) @ self.shapes

    def momenta(self, coordinates: Array) -> Array:
        """As of an ElasticSolid."""
        return (self._modal_momentum @ coordinates).sum(axis=-3)

    def solved(self, loads: Array) -> Array:
        """As of an ElasticSolid."""
        return loads / self.squared[..., None]

    def products(self, coordinates: Array, inner: Array) -> tuple[Array, Array]:
        """As of an ElasticSolid."""
        finite = np.where(np.isfinite(self.squared), self.squared, 0.0)[..., None]
        flat, own = (_flat(one) for one in (coordinates, inner))
        return np.swapaxes(flat, -1, -2) @ flat, np.swapaxes(own, -1, -2) @ _flat(finite * inner)

    def kept(self, shapes: Array) -> Array:
        """As of an ElasticSolid."""
        own = np.swapaxes(self.shapes, -1, -2) @ (self.mass @ shapes)
        return np.where(np.isfinite(self.squared)[..., None], own, 0.0)

    def displaced(self, coordinates: Array, points: Array) -> Array:
        """As of an ElasticSolid."""
        return super().displaced(self.shapes @ coordinates, points)


def _flat(coordinates: Array) -> Array:
    """(..., c s, k) of coordinates (..., c, s, k)."""
    return coordinates.reshape(*coordinates.shape[:-3], -1, coordinates.shape[-1])


def _each(scalar: Array) -> Array:
    """(..., 1, 1, 1) of a scalar (...)."""
    return scalar[..., None, None, None]


@lru_cache(64)
def _exponents(orders: tuple[int, int, int]) -> Index:
    every = np.array(list(np.ndindex(*(order + 1 for order in orders))))
    return every[(every / np.array(orders)).sum(axis=1) <= 1 + 1e-9]


@lru_cache(64)
def _blocks(solid: RitzSolid) -> Index:
    n = solid.exponents
    odd = (n[None] + np.eye(3, dtype=int)[:, None]) % 2
    if solid.held is not None:
        odd[..., solid.held[0]] = 0
    classes = (odd @ np.array([1, 2, 4])).ravel()
    members = [np.flatnonzero(classes == k) for k in np.unique(classes)]
    blocks = np.full((len(members), max(map(len, members))), 3 * len(n))
    for row, own in zip(blocks, members, strict=True):
        row[: len(own)] = own
    return blocks


def _legendre(x: Array, order: int) -> Array:
    """Legendre's polynomials (..., order + 1) at x (...)."""
    values = [x * 0.0 + 1.0, x]
    for k in range(1, order):
        values.append(((2 * k + 1) * x * values[k] - k * values[k - 1]) / (k + 1))
    return np.stack(values[: order + 1], axis=-1)


@lru_cache(64)
def _tables(solid: RitzSolid) -> _Tables:
    places, weights = _quadrature(solid)
    N, G = solid.functions(places), solid.gradients(places)
    n = N.shape[1]
    T = np.einsum("iqm,q,jqn->ijmn", G, weights, G, optimize=True)
    stiffness = np.zeros((12, 3, n, 3, n))
    for k, (i, j) in enumerate(PAIRS):
        for a, b in {(i, j), (j, i)}:
            stiffness[k, a, :, b] += T[a, b]
            stiffness[6 + k, a, :, b] += T[b, a]
        if i == j:
            for a in range(3):
                stiffness[6 + k, a, :, a] += T[i, i]
    product = np.zeros((1, 3, n, 3, n))
    product[0, range(3), :, range(3)] = (N.T * weights) @ N
    around = (np.concatenate([np.ones((1, len(places))), places.T]) * weights) @ N
    moments = np.einsum("ab,kn->kabn", np.eye(3), around).reshape(4, 3, 3 * n)
    blocks = solid.blocks

    def block(matrix: Array) -> Array:
        padded = np.pad(matrix.reshape(-1, 3 * n, 3 * n), ((0, 0), (0, 1), (0, 1)))
        return padded[:, blocks[:, :, None], blocks[:, None, :]]

    spare = (blocks == 3 * n)[..., None] * np.eye(blocks.shape[1])
    by = np.pad(moments, ((0, 0), (0, 0), (0, 1)))[..., blocks]
    return _Tables(block(product)[0], by, block(stiffness), spare, float(weights.sum()))


def _quadrature(solid: RitzSolid) -> tuple[Array, Array]:
    """Places (q, 3) and weights (q,) that integrate products of two functions exactly."""
    rules = [legendre.leggauss(order + 2) for order in solid.orders]
    along, weight = rules[0]
    if solid.is_round:
        order = max(solid.orders[1:])
        angle = np.arange(2 * order + 4) * np.pi / (order + 2)
        t, w = legendre.leggauss(order + 2)
        r = (t + 1) / 2
        plane = (r[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)).reshape(-1, 2)
        area = np.repeat(w / 2 * r, len(angle)) * np.pi / (order + 2)
    else:
        plane = np.stack(np.meshgrid(rules[1][0], rules[2][0], indexing="ij"), axis=-1).reshape(-1, 2)
        area = np.outer(rules[1][1], rules[2][1]).ravel()
    places = np.concatenate([np.repeat(along, len(plane))[:, None], np.tile(plane, (len(along), 1))], axis=1)
    return places, np.outer(weight, area).ravel()


class Patches(NamedTuple):
    """Where a solid is pulled at: points (..., p, q, 3), m from its centre, with weights (..., p, q) that add up to 1,
    and where the motion is read (..., p, 3), m from its centre."""

    points: Array
    weights: Array
    nodes: Array


def patch_rows(solid: RitzSolid, size: Array, patches: Patches) -> Array:
    """Motion (..., c, 6p, s) of patches by coordinates: of the plane that fits best, read at their nodes."""
    N = solid.functions(patches.points / (size[..., None, None, :] / 2))
    return solid.split(fitted_rows(patches, N, along_axes))


def along_axes(values: Array) -> Array:
    """Displacements (..., 3, 3n) along each axis by functions with values (..., n): those of one axis first."""
    vectors = zeros((*values.shape[:-1], 3, 3, values.shape[-1]), values)
    for a in range(3):
        vectors[..., a, a, :] = values
    return vectors.reshape(*values.shape[:-1], 3, -1)


def fitted_rows(patches: Patches, values: Array, vectors: Callable[[Array], Array]) -> Array:
    """Rows (..., 6p, s) of the plane that fits best to displacements, read at the nodes of patches, by values
    (..., p, q, n) at their points; `vectors` makes displacements (..., 3, s) of moments of these (..., n)."""
    points, weights, nodes = patches
    centre = (weights[..., None] * points).sum(axis=-2)
    arms = points - centre[..., None, :]
    weighted = weights[..., None] * np.concatenate([0 * arms[..., :1] + 1.0, arms], axis=-1)
    moments = vectors(np.swapaxes(weighted, -1, -2) @ values)
    cross = skew(arms)
    inertia = (weights[..., None, None] * (np.swapaxes(cross, -1, -2) @ cross)).sum(axis=-3)
    rows = zeros((*moments.shape[:-3], 6, moments.shape[-1]), moments)
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        rows[..., a, :] = moments[..., 0, a, :]
        rows[..., 3 + a, :] = moments[..., 1 + b, c, :] - moments[..., 1 + c, b, :]
    turned = zeros((*inertia.shape[:-2], 6, 6), inertia)
    turned[..., range(3), range(3)] = 1.0
    spread = inertia[..., 0, 0] + inertia[..., 1, 1] + inertia[..., 2, 2]
    turned[..., 3:, 3:] = np.linalg.inv(inertia + COLLINEAR * spread[..., None, None] * np.eye(3))
    rows = (rigid_arm(nodes - centre) @ turned) @ rows
    return rows.reshape(*rows.shape[:-3], -1, rows.shape[-1])


def patch_flexibility(solid: Solid, patches: Patches) -> Array:
    """Flexibility (..., 6p, 6p) of a solid between the motions of patches, beside its mean motion where it is free."""
    rows = solid.rows(patches)[..., : 6 * patches.nodes.shape[-2], :]
    return (rows @ solid.solved(np.swapaxes(rows, -1, -2))).sum(axis=-3)


def leads(solid: Solid, patches: Patches) -> tuple[Array, Array, Array]:
    """How patches lead a solid: coordinates (..., c, s, 6p) when these move by one and the frame of `elastic_body` does
    not, the stiffness (..., 6p, 6p) against that, and the rows (..., c, 6p, s) of their motion."""
    rows = solid.rows(patches)
    X = solid.solved(np.swapaxes(rows, -1, -2))
    C = (rows @ X).sum(axis=-3)
    C = (C + np.swapaxes(C, -1, -2)) / 2
    k = np.linalg.inv(C + RIDGE * C * np.eye(C.shape[-1]))
    return X @ k[..., None, :, :], k, rows


def elastic_body(solid: Solid, patches: Patches, shapes: Array, rigid_mass: Array) -> tuple[Array, Array]:
    """K and M (..., 6 + 6p + m) of a solid over a frame at its centre, patches, and amplitudes of shapes (c, s, m).

    The frame is the mean motion of a solid that is free, and the motion of the face at which one is held; the last
    patch of that is its mean motion. `rigid_mass` (..., 6, 6) is that about the centre. Patches lead what is between
    them as in statics, and shapes are taken with patches at rest (Craig and Bampton 1968).
    """
    (led, k, rows), nodes = leads(solid, patches), patches.nodes
    is_held = solid.held is not None
    if is_held:
        nodes = np.concatenate([nodes, 0.0 * nodes[..., :1, :]], axis=-2)
    shapes = solid.kept(shapes)
    inner = shapes - led @ (rows @ shapes).sum(axis=-3)[..., None, :, :]
    both = np.concatenate([led, inner], axis=-1)
    p, m = k.shape[-1], shapes.shape[-1]
    arms = rigid_arm(nodes)
    T = zeros((*arms.shape[:-3], p + m, 6 + p + m), arms)
    T[..., :p, :6] = -arms.reshape(*arms.shape[:-3], p, 6)
    T[..., range(p + m), range(6, 6 + p + m)] = 1.0
    Tt = np.swapaxes(T, -1, -2)
    own = zeros((*k.shape[:-2], p + m, p + m), k)
    own[..., :p, :p] = k
    mass, own[..., p:, p:] = solid.products(both, inner)
    frame = np.eye(6, 6 + p + m)
    K, M = Tt @ own @ T, Tt @ mass @ T + frame.T @ rigid_mass @ frame
    if is_held:
        coupling = frame.T @ solid.momenta(both) @ T
        M = M + coupling + np.swapaxes(coupling, -1, -2)
    return (K + np.swapaxes(K, -1, -2)) / 2, (M + np.swapaxes(M, -1, -2)) / 2
