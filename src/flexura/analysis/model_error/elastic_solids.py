"""An elastic box or cylinder, free or held at a face, by the Rayleigh-Ritz method: its frequencies, and how it yields
to wrenches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy.linalg as la
from numpy.polynomial import legendre
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import SolverError

ORDER = 8
"""Largest order of the products of Legendre polynomials: 165 functions for each displacement."""

ROUND_OFF = 1e-15
"""Squared frequency over the largest one that is round-off: of rods from some 1500 times as long as thick on."""

PATCH_POINTS = 3
"""Gauss points along each side of the patch that a member holds."""


KEPT = 32
"""Solids whose modes are remembered."""


@dataclass(frozen=True)
class Patch:
    """Where a member ends on a solid, in its axes: the centre (3,) and the half sides of the section (2, 3), m."""

    centre: Array
    sides: Array


@dataclass(frozen=True)
class ElasticSolid:
    """An isotropic box of `size` (3,), m, or the elliptic cylinder about z that fits into it, in its own axes.

    Displacements are products of Legendre polynomials (W. M. Visscher, A. Migliori, T. M. Bell, R. A. Reinert, J.
    Acoust. Soc. Am. 90 (1991) 2154), so that frequencies are upper and deflections lower bounds. They do
    not show how a patch that is small beside the solid presses into it. `held` is the axis and the side, -1 or 1, of
    the face that does not move; the functions are then multiplied by the distance from it.
    """

    size: tuple[float, float, float]
    E: float
    nu: float
    rho: float
    is_cylinder: bool = False
    held: tuple[int, int] | None = None

    @cached_property
    def _orders(self) -> NDArray[np.intp]:
        grid = np.stack(np.meshgrid(*[np.arange(ORDER + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        return grid[grid.sum(axis=1) <= ORDER]

    def _values(self, points: Array) -> tuple[Array, Array]:
        """Functions (p, n) and their gradients (3, p, n), 1/m, at points (p, 3), m."""
        x = 2 * points / np.array(self.size)
        own = [legendre.legvander(x[:, i], ORDER)[:, self._orders[:, i]] for i in range(3)]
        slopes = legendre.legder(np.eye(ORDER + 1))
        grown = [legendre.legvander(x[:, i], ORDER - 1) @ slopes for i in range(3)]
        of = [2 / self.size[i] * grown[i][:, self._orders[:, i]] for i in range(3)]
        gradients = np.stack([of[0] * own[1] * own[2], own[0] * of[1] * own[2], own[0] * own[1] * of[2]])
        functions = own[0] * own[1] * own[2]
        if self.held is None:
            return functions, gradients
        axis, side = self.held
        distance = (1 - side * x[:, axis])[:, None]
        gradients = gradients * distance
        gradients[axis] -= 2 * side / self.size[axis] * functions
        return functions * distance, gradients

    def _quadrature(self) -> tuple[Array, Array]:
        """Points (q, 3), m, and weights (q,), m^3, that integrate products of two functions exactly."""
        t, w = legendre.leggauss(ORDER + 2)
        if self.is_cylinder:
            angle = np.arange(2 * ORDER + 4) * np.pi / (ORDER + 2)
            r, wr = (t + 1) / 2, w / 2
            plane = (r[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)).reshape(-1, 2)
            area = np.repeat(wr * r, len(angle)) * np.pi / (ORDER + 2)
        else:
            plane = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
            area = np.outer(w, w).ravel()
        points = np.concatenate([np.repeat(plane, len(t), axis=0), np.tile(t, len(plane))[:, None]], axis=1)
        half = np.array(self.size) / 2
        return points * half, np.outer(area, w).ravel() * half.prod()

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Squared angular frequencies (k,), 1/s^2, and shapes (3, n, k) of the elastic modes, of unit modal mass.

        Raises SolverError where round-off hides the lowest.
        """
        return _modes(self)

    def _solved(self) -> tuple[Array, Array]:
        points, weights = self._quadrature()
        N, G = self._values(points)
        lame, mu = self.E * self.nu / ((1 + self.nu) * (1 - 2 * min(self.nu, 0.4999))), self.E / (2 * (1 + self.nu))
        S = np.einsum("iqm,q,jqn->ijmn", G, weights, G, optimize=True)
        n = N.shape[1]
        K = np.zeros((3, n, 3, n))
        for a in range(3):
            for b in range(3):
                K[a, :, b] = lame * S[a, b] + mu * S[b, a]
            K[a, :, a] += mu * (S[0, 0] + S[1, 1] + S[2, 2])
        mass = self.rho * (N.T * weights) @ N
        squared, shapes = la.eigh(K.reshape(3 * n, 3 * n), la.block_diag(mass, mass, mass))
        rigid = 6 if self.held is None else 0
        if not squared[rigid] > ROUND_OFF * squared[-1]:
            sides = " x ".join(f"{1e3 * own:.3g}" for own in self.size)
            raise SolverError(f"a solid of {sides} mm is too slender for an estimate of how it gives")
        return squared[rigid:], shapes[:, rigid:].reshape(3, n, -1)

    def flexibility(self, patches: Sequence[Patch], wrenches: Array) -> Array:
        """Products of deflection and load (k, k), J, for k loads at once: wrenches (p, 6, k), N and N m, on patches.

        What is out of balance among them accelerates the solid and is balanced by its inertia.
        """
        squared, shapes = self.modes
        load = np.zeros((len(squared), wrenches.shape[-1]))
        for patch, wrench in zip(patches, wrenches, strict=True):
            load += self._patch_rows(patch, shapes).T @ wrench
        return (load.T / squared) @ load

    def _patch_rows(self, patch: Patch, shapes: Array) -> Array:
        """Mean displacement and rotation (6, k) of a patch in the modes: those of the plane that fits best."""
        t, _ = legendre.leggauss(PATCH_POINTS)
        grid = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
        half = np.array(self.size) / 2
        points = np.clip(patch.centre + grid @ patch.sides, -half, half)
        moved = np.einsum("pn,ank->pak", self._values(points)[0], shapes)
        r = points - points.mean(axis=0)
        cross = np.zeros((len(r), 3, 3))
        for k, j, i in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            cross[:, i, k], cross[:, k, i] = r[:, j], -r[:, j]  # what a rotation about each axis moves: theta x r
        inertia = np.einsum("pji,pjk->ik", cross, cross)
        turned = np.linalg.pinv(inertia, rcond=1e-9) @ np.einsum("pji,pjk->ik", cross, moved - moved.mean(axis=0))
        return np.concatenate([moved.mean(axis=0), turned])


@lru_cache(KEPT)
def _modes(solid: ElasticSolid) -> tuple[Array, Array]:
    return solid._solved()
