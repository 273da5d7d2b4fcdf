"""Stiffness and mass of many designs as an arrow: branches that meet a core alone, equal ones stored once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.linalg import inverse_roots
from flexura.reduction.batch.chain_moments import EPS

FIXED = 4
"""Axes of the maps of a block whose geometry is the same in all designs."""

ROUNDING = 64 * EPS
"""Relative error of an entry of L' A L, as a part of |L|' |A| |L|: two products of some twenty terms and their sums
(theory eq. N10)."""


@dataclass(frozen=True)
class Block:
    """Kinds of branches of one shape: matrices A (3, designs, q, n, n), K, M and R, in axes of their own, `inside`
    coordinates first. The errors of K, M and R lie between the diagonals `slack` (3, designs, q, n) and minus these.

    T (..., q, r, n - inside, c) takes the core's coordinates to those of the interface of each of r branches of a kind;
    it is zero where a kind has fewer.
    """

    A: Array
    slack: Array
    inside: int
    T: Array

    @cached_property
    def inverse(self) -> Array:
        """Flexibility (designs, q, inside, inside) of the insides with the interfaces held."""
        inner = self.A[0, ..., : self.inside, : self.inside]
        d = inverse_roots(np.einsum("...ii->...i", inner))
        both = d[..., :, None] * d[..., None, :]
        return np.asarray(np.linalg.inv(inner * both) * both)

    @cached_property
    def slowest(self) -> Array:
        """At least 1/omega^2 (designs,) of the lowest frequency of any branch with its interface held: the sum over all
        of its frequencies."""
        inner = self.A[1, ..., : self.inside, : self.inside]
        return np.asarray(np.einsum("dqij,dqij->dq", self.inverse, inner).max(axis=1))

    @cached_property
    def motion(self) -> Array:
        """Static motion (designs, q, n, n - inside) of a branch for unit displacements of its interface."""
        follows = -self.inverse @ self.A[0, ..., : self.inside, self.inside :]
        ends = np.eye(follows.shape[-1])
        return np.concatenate([follows, np.broadcast_to(ends, (*follows.shape[:-2], *ends.shape))], axis=-2)

    @cached_property
    def followed(self) -> Array:
        """K, M and R (3, designs, q, n - inside, n - inside) of that motion."""
        return np.asarray(np.swapaxes(self.motion, -1, -2) @ (self.A @ self.motion))

    def take(self, designs: Index) -> Block:
        """The same for some of the designs."""
        T = self.T[designs] if self.T.ndim > FIXED else self.T
        return Block(self.A[:, designs], self.slack[:, designs], self.inside, T)

    @property
    def branches(self) -> NDArray[np.bool_]:
        """Which (q, r) there are."""
        return np.asarray((self.T != 0).any(axis=(-1, -2)).reshape(-1, *self.T.shape[-4:-2]).any(axis=0))


@dataclass(frozen=True)
class Order:
    """Designs over the ends of their chains: A (3, designs, n, n), which are K, M and R of the dynamic stiffness
    K - lambda M - lambda^2 R + ... (theory eq. N2), SI, with `slack` (3, designs, n) as that of a block.

    `slowness` (designs,) is at least 1/mu for all motions left out, `loss` (designs,) bounds the relative error in
    energy of chains.
    """

    A: Array
    slack: Array
    slowness: Array
    loss: Array

    def take(self, designs: Index) -> Order:
        """The same for some of the designs."""
        return Order(self.A[:, designs], self.slack[:, designs], self.slowness[designs], self.loss[designs])

    @property
    def K(self) -> Array:
        """Stiffness (designs, n, n)."""
        return self.A[0]

    @property
    def M(self) -> Array:
        """Mass (designs, n, n)."""
        return self.A[1]

    @property
    def R(self) -> Array:
        """What the motions left out add (designs, n, n)."""
        return self.A[2]


@dataclass(frozen=True)
class Arrow:
    """Designs as `blocks` of branches and what the core has by itself; `slow` is the slowness by kind of chain."""

    blocks: tuple[Block, ...]
    core: Order
    slow: Mapping[tuple[str, int], float]

    def take(self, designs: Index) -> Arrow:
        """The same for some of the designs."""
        if len(designs) == self.core.A.shape[1]:
            return self
        return Arrow(tuple(block.take(designs) for block in self.blocks), self.core.take(designs), self.slow)

    @cached_property
    def followed(self) -> tuple[Array, Array]:
        """K and M (designs, c, c) of the core with static motions of the branches."""
        K, M = self.core.A[0], self.core.A[1]
        for block in self.blocks:
            K = K + placed(block.followed[0], block.T)
            M = M + placed(block.followed[1], block.T)
        return (K + np.swapaxes(K, -1, -2)) / 2, (M + np.swapaxes(M, -1, -2)) / 2

    @property
    def dense(self) -> Order:
        """All coordinates in one matrix: those inside the branches, in their own axes, then those of the core."""
        core = self.core
        designs, c = core.A.shape[1:3]
        inside = [int(block.branches.sum()) * block.inside for block in self.blocks]
        n = sum(inside) + c
        if n == c:
            return core
        A, slack = np.zeros((3, designs, n, n)), np.zeros((3, designs, n))
        A[..., -c:, -c:], slack[..., -c:] = core.A, core.slack
        first = 0
        for block in self.blocks:
            m = block.inside
            for q, r in np.argwhere(block.branches):
                own, T, at = block.A[:, :, q], block.T[..., q, r, :, :], slice(first, first + m)
                A[..., at, at] = own[..., :m, :m]
                A[..., at, -c:] = side = own[..., :m, m:] @ T
                A[..., -c:, at] = np.swapaxes(side, -1, -2)
                A[..., -c:, -c:] += np.swapaxes(T, -1, -2) @ own[..., m:, m:] @ T
                slack[..., at] = block.slack[:, :, q, :m]
                size = np.sqrt(abs(np.einsum("...ii->...i", own)))
                error = ROUNDING * own.shape[-1]
                slack[..., at] = block.slack[:, :, q, :m] + error * size[..., :m] ** 2
                slack[..., -c:] += spread(block.slack[:, :, q, m:], T)
                slack[..., -c:] += error * np.einsum("...ij,...i->...j", abs(T), size[..., m:]) ** 2
                first += m
        return Order(A, slack, core.slowness, core.loss)


def spread(slack: Array, T: Array) -> Array:
    """Diagonal (..., c) that bounds T' diag(slack) T, from slack (..., n) and T (..., n, c), each of whose rows has the
    six coordinates of one root at most."""
    return np.asarray(6 * np.einsum("...ij,...i->...j", T * T, slack))


def placed(A: Array, T: Array) -> Array:
    """Sum (..., c, c) of A (..., q, i, i) over the branches placed by T (..., q, r, i, c)."""
    return np.asarray((np.swapaxes(T, -1, -2) @ A[..., None, :, :] @ T).sum(axis=(-4, -3)))
