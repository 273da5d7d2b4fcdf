"""Energies of superelements as polynomials of their deformation, up to the fourth order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array


@dataclass(frozen=True)
class Polynomial:
    """Energies d'kd/2 + cddd/6 + qdddd/24 of elements by their deformations d (e, d).

    `stiffness` k (e, d, d), `cubic` c (e, m, m, m) and `quartic` q (e, m, m, m, m) are symmetric, of the first m of the
    deformations; empty from the order on that is left out.
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

    def with_amplitudes(self, stiffness: Array) -> Polynomial:
        """With further deformations of stiffnesses (a,), not coupled to anything, zero for those that stand still."""
        n, a = self.stiffness.shape[-1], len(stiffness)
        k = np.pad(self.stiffness, ((0, 0), (0, a), (0, a)))
        k[:, range(n, n + a), range(n, n + a)] = stiffness
        return Polynomial(k, self.cubic, self.quartic)

    @staticmethod
    def joined(parts: list[Polynomial]) -> Polynomial:
        """Energies of elements of equally many deformations, one after another."""
        poses = max(own.cubic.shape[1] for own in parts)
        return Polynomial(
            np.concatenate([own.stiffness for own in parts]),
            _joined([own.cubic for own in parts], [len(own.stiffness) for own in parts], poses),
            _joined([own.quartic for own in parts], [len(own.stiffness) for own in parts], poses),
        )

    def response(self, d: Array) -> tuple[Array, Array, Array]:
        """Energies (e,), N m, their gradients (e, d) and Hessians (e, d, d) at deformations (e, d)."""
        gradient = (self.stiffness @ d[..., None])[..., 0]
        energy = np.einsum("en,en->e", d, gradient) / 2
        if not self.cubic.size:
            return energy, gradient, self.stiffness
        e, n = d.shape[0], self.cubic.shape[-1]
        own, hessian = d[:, :n], self.stiffness.copy()
        slope = (own[:, None] @ self.cubic.reshape(e, n, n * n)).reshape(e, n, n)
        hessian[:, :n, :n] += slope
        second, third = (slope @ own[..., None])[..., 0], 0.0
        if self.quartic.size:
            along = (own[:, None] @ self.quartic.reshape(e, n, n**3)).reshape(e, n, n * n)
            slope = (own[:, None] @ along).reshape(e, n, n)
            hessian[:, :n, :n] += slope / 2
            third = (slope @ own[..., None])[..., 0]
        gradient[:, :n] += second / 2 + third / 6
        return energy + np.einsum("en,en->e", own, second / 6 + third / 24), gradient, hessian


def _joined(terms: list[Array], counts: list[int], size: int) -> Array:
    """Terms of one order; zero where an element has none and another one has some."""
    order = terms[0].ndim - 1
    if not any(own.size for own in terms):
        return np.empty((0,) * (order + 1))
    zeros = [np.zeros((count, *(size,) * order)) for count in counts]
    return np.concatenate([own if own.size else zero for own, zero in zip(terms, zeros, strict=True)])
