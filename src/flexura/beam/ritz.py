"""Elastic boxes and cylinders by the Rayleigh-Ritz method, as superelements over patches at which members pull.

Displacements are products of Legendre polynomials (W. M. Visscher, A. Migliori, T. M. Bell, R. A. Reinert, J. Acoust.
Soc. Am. 90 (1991) 2154), so that frequencies are upper and deflections lower bounds. A box has the axes of its edges,
a cylinder lies along its first axis; places are over the half sizes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
from numpy.polynomial import legendre

from flexura.arrays import Array, Index
from flexura.beam.frames import combine, rigid_arm, skew
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

RIDGE = 1e-9
"""Flexibility over that of a patch which patches that the functions cannot tell apart have between them."""

PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


class Material(NamedTuple):
    """Young's modulus, Pa, Poisson's ratio and density, kg/m^3, each (...)."""

    E: Array
    nu: Array
    rho: Array


class _Tables(NamedTuple):
    """Integrals over the solid of half sizes one: of products of functions (n, n), of functions times 1 and the three
    coordinates (4, n), the stiffness by its twelve coefficients (12, 9 n^2), and the volume."""

    product: Array
    moments: Array
    stiffness: Array
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

    def stiffness(self, size: Array, material: Material) -> Array:
        """K (..., 3n, 3n), N/m, of sides (..., 3), m; coordinates by displacement, then by function."""
        E, nu, _ = material
        lame, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
        volume = np.prod(size, axis=-1) / 8
        by = [volume * 4 / (size[..., a] * size[..., b]) for a, b in PAIRS]
        coefficients = np.stack([modulus * each for modulus in (lame, mu) for each in by], axis=-1)
        return combine(coefficients, _tables(self).stiffness, 3 * len(self.exponents))

    def mass(self, size: Array, material: Material) -> Array:
        """Mass (..., n, n), kg, of each displacement."""
        return _each(material.rho * np.prod(size, axis=-1) / 8) * _tables(self).product

    def rigid(self, size: Array) -> Array:
        """Coordinates (..., 3n, 6) of the motions and rotations about the centre, of a solid that is not held."""
        n = self.exponents
        R = zeros((*size.shape[:-1], 3, len(n), 6), size)
        at = [int(np.flatnonzero((n == row).all(axis=1))[0]) for row in np.vstack([np.zeros((1, 3)), np.eye(3)])]
        for a in range(3):
            R[..., a, at[0], a] = 1.0
            b, c = (a + 1) % 3, (a + 2) % 3
            R[..., b, at[1 + c], 3 + a] = -size[..., c] / 2
            R[..., c, at[1 + b], 3 + a] = size[..., b] / 2
        return R.reshape(*R.shape[:-3], 3 * len(n), 6)

    def momentum(self, size: Array, material: Material) -> Array:
        """Momentum and angular momentum about the centre (..., 6, 3n), kg and kg m, of unit coordinates."""
        moments = _tables(self).moments
        mass = _each(material.rho * np.prod(size, axis=-1) / 8)
        L = zeros((*mass.shape[:-2], 6, 3, moments.shape[-1]), size, mass)
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            L[..., a, a, :] = mass[..., 0] * moments[0]
            L[..., 3 + a, c, :] = mass[..., 0] * size[..., b, None] / 2 * moments[1 + b]
            L[..., 3 + a, b, :] = -mass[..., 0] * size[..., c, None] / 2 * moments[1 + c]
        return L.reshape(*L.shape[:-2], -1)

    def mean_rows(self, size: Array) -> Array:
        """Mean motion of the volume (..., 6, 3n): momentum over mass, angular momentum over inertia."""
        one = np.ones(size.shape[:-1])
        L = self.momentum(size, Material(one, one, one))
        mass, square = np.prod(size, axis=-1) / 8 * _tables(self).volume, size * size / 4
        square = square * (np.array([1 / 3, 1 / 4, 1 / 4]) if self.is_round else 1 / 3)
        inertia = mass[..., None] * (square.sum(axis=-1, keepdims=True) - square)
        return L / np.concatenate([np.stack([mass] * 3, axis=-1), inertia], axis=-1)[..., None]

    def modes(self, size: Array, material: Material) -> tuple[Array, Array]:
        """Squared angular frequencies (k,), 1/s^2, and shapes (3n, k) of unit modal mass of the elastic modes, one
        design. Raises SolverError where round-off hides the lowest."""
        M = self.mass(size, material)
        squared, shapes = la.eigh(self.stiffness(size, material), la.block_diag(M, M, M))
        rigid = 6 if self.held is None else 0
        if not squared[rigid] > SLENDEREST * squared[-1]:
            sides = " x ".join(f"{1e3 * side:.3g}" for side in size)
            raise SolverError(f"a solid of {sides} mm is too slender for an estimate of how it gives")
        return squared[rigid:], shapes[:, rigid:]

    def solved(self, size: Array, material: Material, loads: Array) -> Array:
        """Coordinates (..., 3n, k), m/N, under loads (..., 3n, k). A solid that is not held is accelerated by what of
        them is out of balance, and has no mean motion."""
        K = self.stiffness(size, material)
        if self.held is not None:
            return np.linalg.solve(K, loads)
        R, MR = self._normed(size, material)
        scale = _each(material.E / (material.rho * np.prod(size, axis=-1) ** (2 / 3)))
        K = K + scale * MR @ np.swapaxes(MR, -1, -2)
        balanced = loads - MR @ (np.swapaxes(R, -1, -2) @ loads)
        return self.without_mean(size, material, np.linalg.solve(K, balanced))

    def without_mean(self, size: Array, material: Material, coordinates: Array) -> Array:
        """Coordinates (..., 3n, k) less their mean motion, of a solid that is not held."""
        R, MR = self._normed(size, material)
        return coordinates - R @ (np.swapaxes(MR, -1, -2) @ coordinates)

    def _normed(self, size: Array, material: Material) -> tuple[Array, Array]:
        """Rigid motions (..., 3n, 6) of unit mass, and the momenta that go with them."""
        R = self.rigid(size)
        MR = self.massed(size, material, R)
        norm = np.sqrt((R * MR).sum(axis=-2, keepdims=True))
        return R / norm, MR / norm

    def massed(self, size: Array, material: Material, coordinates: Array) -> Array:
        """Mass times coordinates (..., 3n, k)."""
        M, n = self.mass(size, material), len(self.exponents)
        by = coordinates.reshape(*coordinates.shape[:-2], 3, n, coordinates.shape[-1])
        out = M[..., None, :, :] @ by
        return out.reshape(*out.shape[:-3], 3 * n, out.shape[-1])


def _each(scalar: Array) -> Array:
    return np.asarray(scalar)[..., None, None] if not hasattr(scalar, "slope") else scalar[..., None, None]


@lru_cache(64)
def _exponents(orders: tuple[int, int, int]) -> Index:
    every = np.array(list(np.ndindex(*(order + 1 for order in orders))))
    return every[(every / np.array(orders)).sum(axis=1) <= 1 + 1e-9]


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
    basis = np.zeros((12, 3, n, 3, n))
    for k, (i, j) in enumerate(PAIRS):
        for a, b in {(i, j), (j, i)}:
            basis[k, a, :, b] += T[a, b]
            basis[6 + k, a, :, b] += T[b, a]
        if i == j:
            for a in range(3):
                basis[6 + k, a, :, a] += T[i, i]
    around = np.concatenate([np.ones((1, len(places))), places.T])
    return _Tables((N.T * weights) @ N, (around * weights) @ N, basis.reshape(12, -1), float(weights.sum()))


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
    """Motion (..., 6p, 3n) of patches by coordinates: of the plane that fits best, read at their nodes."""
    points, weights, nodes = patches
    N = solid.functions(points / (size[..., None, None, :] / 2))
    centre = (weights[..., None] * points).sum(axis=-2)
    arms = points - centre[..., None, :]
    by = np.swapaxes(weights[..., None] * N, -1, -2)
    mean = by.sum(axis=-1)
    first = np.swapaxes(by @ arms, -1, -2)
    cross = skew(arms)
    inertia = (weights[..., None, None] * (np.swapaxes(cross, -1, -2) @ cross)).sum(axis=-3)
    rows = zeros((*mean.shape[:-1], 6, 3, mean.shape[-1]), mean, first)
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        rows[..., a, a, :] = mean
        rows[..., 3 + a, c, :] = first[..., b, :]
        rows[..., 3 + a, b, :] = -first[..., c, :]
    rows = rows.reshape(*rows.shape[:-2], -1)
    turned = np.linalg.inv(inertia) @ rows[..., 3:, :]
    rows = rigid_arm(nodes - centre) @ np.concatenate([rows[..., :3, :], turned], axis=-2)
    return rows.reshape(*rows.shape[:-3], -1, rows.shape[-1])


def elastic_body(
    solid: RitzSolid, size: Array, material: Material, patches: Patches, shapes: Array, rigid_mass: Array
) -> tuple[Array, Array]:
    """K and M (..., 6 + 6p + m) of a solid over a frame at its centre, patches, and amplitudes of shapes (3n, m).

    The frame is the mean motion of a solid that is free, and the motion of the face at which one is held; the last
    patch of that is its mean motion. `rigid_mass` (..., 6, 6) is that about the centre. Patches lead what is between
    them as in statics, and shapes are taken with patches at rest (Craig and Bampton 1968).
    """
    rows = patch_rows(solid, size, patches)
    nodes = patches.nodes
    if solid.held is not None:
        rows = np.concatenate([rows, solid.mean_rows(size)], axis=-2)
        nodes = np.concatenate([nodes, 0 * nodes[..., :1, :]], axis=-2)
    X = solid.solved(size, material, np.swapaxes(rows, -1, -2) + 0.0)
    C = rows @ X
    C = (C + np.swapaxes(C, -1, -2)) / 2
    C = C + RIDGE * C * np.eye(C.shape[-1])
    k = np.linalg.inv(C)
    leads = X @ k
    if solid.held is None:
        shapes = solid.without_mean(size, material, shapes + 0 * X[..., :1])
    inner = shapes - leads @ (rows @ shapes)
    both = np.concatenate([leads, inner], axis=-1)
    arms = rigid_arm(nodes)
    p, m = k.shape[-1], shapes.shape[-1]
    T = zeros((*arms.shape[:-3], p + m, 6 + p + m), arms)
    T[..., :p, :6] = -arms.reshape(*arms.shape[:-3], p, 6)
    T[..., range(p + m), range(6, 6 + p + m)] = 1.0
    inner_K = np.swapaxes(inner, -1, -2) @ (solid.stiffness(size, material) @ inner)
    own = zeros((*k.shape[:-2], p + m, p + m), k, inner_K)
    own[..., :p, :p], own[..., p:, p:] = (k + np.swapaxes(k, -1, -2)) / 2, inner_K
    mass = np.swapaxes(both, -1, -2) @ solid.massed(size, material, both)
    Tt = np.swapaxes(T, -1, -2)
    K, M = Tt @ own @ T, Tt @ mass @ T
    frame = np.zeros((6, 6 + p + m))
    frame[:, :6] = np.eye(6)
    M = M + frame.T @ rigid_mass @ frame
    if solid.held is not None:
        coupling = frame.T @ (solid.momentum(size, material) @ both) @ T
        M = M + coupling + np.swapaxes(coupling, -1, -2)
    return (K + np.swapaxes(K, -1, -2)) / 2, (M + np.swapaxes(M, -1, -2)) / 2
