"""Energies of superelements as polynomials of their deformation, up to the fourth order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Polynomial:
    """Energies d'kd/2 + cddd/6 + qdddd/24 of elements by their deformations d (e, d).

    `stiffness` k (e, d, d), `cubic` c (e, d, d, d) and `quartic` q (e, d, d, d, d) are symmetric; empty from the
    order on that is left out.
    """

    stiffness: Array
    cubic: Array
    quartic: Array

    @staticmethod
    def linear(stiffness: Array) -> Polynomial:
        """Energies d'kd/2, k (e, d, d)."""
        return Polynomial(stiffness, np.empty((0,) * 4), np.empty((0,) * 5))

    def placed(self, count: int) -> Polynomial:
        """The energy of the only element, for `count` copies."""
        return Polynomial(*(own.repeat(count, axis=0) for own in (self.stiffness, self.cubic, self.quartic)))

    @staticmethod
    def joined(parts: list[Polynomial]) -> Polynomial:
        """Energies of elements of equally many deformations, one after another."""
        return Polynomial(
            np.concatenate([own.stiffness for own in parts]),
            _joined([own.cubic for own in parts], [own.stiffness for own in parts]),
            _joined([own.quartic for own in parts], [own.stiffness for own in parts]),
        )

    def response(self, d: Array) -> tuple[Array, Array, Array]:
        """Energies (e,), N m, their gradients (e, d) and Hessians (e, d, d) at deformations (e, d)."""
        e, n = d.shape
        hessian, second, third = self.stiffness, 0.0, 0.0
        linear = (self.stiffness @ d[..., None])[..., 0]
        if self.cubic.size:
            slope = (d[:, None] @ self.cubic.reshape(e, n, n * n)).reshape(e, n, n)
            second = (slope @ d[..., None])[..., 0]
            hessian = hessian + slope
        if self.quartic.size:
            along = (d[:, None] @ self.quartic.reshape(e, n, n**3)).reshape(e, n, n * n)
            slope = (d[:, None] @ along).reshape(e, n, n)
            third = (slope @ d[..., None])[..., 0]
            hessian = hessian + slope / 2
        energy = np.einsum("en,en->e", d, linear / 2 + second / 6 + third / 24)
        return energy, linear + second / 2 + third / 6, hessian


def _joined(terms: list[Array], like: list[Array]) -> Array:
    """Terms of one order; zero where an element has none and another one has some."""
    order = terms[0].ndim - 1
    if not any(own.size for own in terms):
        return np.empty((0,) * (order + 1))
    return np.concatenate(
        [
            own if own.size else np.zeros(k.shape + k.shape[-1:] * (order - 2))
            for own, k in zip(terms, like, strict=True)
        ]
    )
