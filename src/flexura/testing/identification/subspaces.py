"""Poles of correlations of outputs by stochastic subspaces, at every order, and their standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.testing.identification.stabilisation import OrderPoles, Track
from flexura.testing.measurement import Correlations, ResponseMatrix

MOST_ROWS = 320
"""Rows of the Hankel matrix of correlations at most, as far as there are BLOCK_ROWS of blocks."""

BLOCK_ROWS = (12, 60)
"""Block rows of that matrix at least and at most."""

MOST_STATES = 60
"""States of the largest model when no order is given."""

SHARE_OF_ORDERS = 0.3
"""A mode is at so many of the orders from its first: beside it, noise takes another pole at some."""

JUDGED_ORDERS = 10
"""Orders at which standard deviations are worked out."""


@dataclass(frozen=True)
class Subspaces:
    """Singular values and vectors of the Hankel matrix (i p, i m) of scaled correlations, and of which parts.

    Theory eqs. I33, I34. `cores` (b, i p, i m) are those of the parts of the records, of which it is the mean, in its
    singular vectors.
    """

    step: float
    cores: Array
    left: Array
    values: Array
    right: Array
    outputs: int
    references: int

    @classmethod
    def of(cls, C: Correlations, matrix: ResponseMatrix) -> Subspaces:
        """Those of correlations, scaled as their half spectra are."""
        R = C.parts / matrix.row_scale[:, None] / matrix.column_scale
        p, m = R.shape[2:]
        i = int(np.clip(MOST_ROWS // p, *BLOCK_ROWS))
        i = min(i, (R.shape[1] - 1) // 2)
        lag = np.arange(i) + np.arange(i)[:, None] + 1
        hankels = R[:, lag].transpose(0, 1, 3, 2, 4).reshape(len(R), i * p, i * m)
        left, values, right = np.linalg.svd(hankels.mean(axis=0))
        return cls(C.step, left.T @ hankels @ right.T, left, values, right.T, p, m)

    def orders(self, most: int | None, most_damped: float) -> list[OrderPoles]:
        """Poles of every even order, outputs' shapes, and participation of the references (theory eq. I34).

        Covariance-driven stochastic subspace identification (Peeters and De Roeck 1999). Poles that grow, and those of
        a damping ratio above `most_damped`, are dropped. Raises OptionError for an order beyond the correlations.
        """
        limit = min(len(self.values), len(self.left) - self.outputs)
        if most is not None and most > limit:
            raise OptionError(f"correlations of these records hold models up to order {limit}, not {most}")
        largest = min(MOST_STATES, limit) if most is None else most
        return [self._order(n, most_damped) for n in range(2, largest + 1, 2)]

    def _order(self, n: int, most_damped: float) -> OrderPoles:
        A, C = self._transition(n), self.left[: self.outputs, :n]
        mu, X = (np.asarray(part, dtype=np.complex128) for part in np.linalg.eig(A))
        s = self._continuous(mu)
        G = np.asarray(
            np.linalg.solve(X, self.values[:n, None] * self.right[: self.references, :n].T), dtype=np.complex128
        )
        kept = (
            (s.imag > 0)
            & (s.imag < np.pi / self.step * (1 - 1e-9))
            & (s.real < 0)
            & (-s.real < most_damped * np.abs(s))
        )
        at = np.flatnonzero(kept)[np.argsort(np.abs(s[kept]))]
        return OrderPoles(n, s[at], (C @ X)[:, at], G[at].T)

    def _continuous(self, mu: Complex) -> Complex:
        """Poles, 1/s, of eigenvalues of the state matrix."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(mu) / self.step, dtype=np.complex128)

    def _transition(self, n: int) -> Array:
        """The state matrix of an order, in the basis of the left singular vectors."""
        p = self.outputs
        return np.asarray(np.linalg.lstsq(self.left[:-p, :n], self.left[p:, :n])[0], dtype=np.float64)

    def best(self, tracks: Sequence[Track], orders: Sequence[OrderPoles]) -> tuple[Complex, Complex, Array]:
        """Poles (k,), shapes (p, k) and standard deviations (k, 2) of tracks at the order that determines each best, or
        at which it was picked."""
        poles, shapes = np.array([t.pole for t in tracks]), np.zeros((self.outputs, len(tracks)), dtype=complex)
        sigma = np.full((len(tracks), 2), np.inf)
        judged = np.unique(np.linspace(0, len(orders) - 1, JUDGED_ORDERS).astype(int))
        own = [t.at if t.start is None else [t.at[t.start]] for t in tracks]
        for at in {*judged.tolist(), *(there[-1] for there in own)}:
            having = [(k, t.which[t.at.index(at)]) for k, t in enumerate(tracks) if at in own[k]]
            there = self.sigma(orders[at].order, orders[at].poles[[r for _, r in having]]) if having else ()
            for (k, r), spread in zip(having, there, strict=True):
                if np.linalg.norm(spread) < np.linalg.norm(sigma[k]):
                    poles[k], shapes[:, k], sigma[k] = orders[at].poles[r], orders[at].shapes[:, r], spread
        return poles, shapes, sigma

    def sigma(self, n: int, poles: Complex) -> Array:
        """Standard deviations of real and imaginary part (k, 2), 1/s, of the poles nearest to some, at one order.

        By the first-order change of the singular vectors, of the state matrix and of its eigenvalues with the scatter
        of the parts (theory eq. I35; Reynders, Pintelon and De Roeck 2008, Doehler and Mevel 2013).
        """
        p, U = self.outputs, self.left
        up, A = U[:-p, :n], self._transition(n)
        mu, X = (np.asarray(part, dtype=np.complex128) for part in np.linalg.eig(A))
        Y = np.linalg.inv(X)
        at = [int(np.argmin(np.abs(self._continuous(mu) - pole))) for pole in poles]
        inverse, gram = np.linalg.pinv(up), np.linalg.inv(up.T @ up)
        above, below, rest = inverse @ U[:-p], inverse @ U[p:], U[:-p].T @ (U[p:, :n] - up @ A)
        one = self.values[:n]
        two = np.zeros((len(U), 1))
        two[: len(self.values), 0] = self.values
        gap = np.maximum(one**2 - two**2, np.finfo(float).tiny)
        gap[:n] = np.inf  # changes within the subspace turn its basis alone
        moved = np.empty((len(self.cores), len(at)), dtype=complex)
        for k, core in enumerate(self.cores):
            turn = one * core[:, :n]
            turn[: core.shape[1]] += two[: core.shape[1]] * core[:n].T
            turn /= gap
            dA = below @ turn - above @ turn @ A + gram @ (turn.T @ rest)
            moved[k] = np.einsum("kn,nm,mk->k", Y[at], dA, X[:, at]) / (mu[at] * self.step)
        scatter = [np.std(side, axis=0, ddof=1) for side in (np.real(moved), np.imag(moved))]
        return np.array(scatter).T / np.sqrt(len(self.cores))
