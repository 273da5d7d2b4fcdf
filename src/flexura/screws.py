"""Spaces of screws: twists that are free, wrenches that are borne, which of both are reciprocal, and their lines.

A twist (6,) is the translation of the origin and the rotation, a wrench (6,) the force and its moment about the origin,
both in the order of DOFs. Both are screws: a direction along an axis, and a pitch (Ball 1900). A wrench is reciprocal
to a twist when it does no work on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from flexura.arrays import Array

Kind = Literal["twists", "wrenches"]

SAME = 1e-9
"""Sine of the angle up to which screws of unit size are the same, where moments are taken over the length."""


@dataclass(frozen=True)
class Screw:
    """A screw of unit size: `direction` (3,), the `point` (3,), m, of its axis nearest to the origin, and its `pitch`,
    m: translation over rotation of a twist, moment over force of a wrench. Zero is a pure rotation or force; infinite,
    with the point at the origin, a pure translation or couple."""

    direction: Array
    point: Array
    pitch: float


@dataclass(frozen=True)
class ScrewSpace:
    """A linear space of twists or wrenches about the origin, of dimension n.

    `basis` (6, n) is orthonormal where translations and moments are over `length`, m, the size of what is looked at.
    """

    kind: Kind
    basis: Array
    length: float

    @staticmethod
    def of(kind: Kind, screws: ArrayLike, length: float = 1.0) -> ScrewSpace:
        """The space that screws (6, m) span."""
        columns = np.asarray(screws, dtype=np.float64).reshape(6, -1) / _units(kind, length)[:, None]
        size = np.linalg.norm(columns, axis=0)
        unit = columns[:, size > 0] / size[size > 0]
        U, s, _ = la.svd(unit, full_matrices=False) if unit.shape[1] else (np.zeros((6, 0)), np.zeros(0), None)
        return ScrewSpace(kind, U[:, s > SAME * s.max(initial=1.0)], length)

    @property
    def dimension(self) -> int:
        """How many screws span it."""
        return self.basis.shape[1]

    @property
    def directions(self) -> Array:
        """Direction (3, n) of each screw of the basis: of rotations or forces."""
        return self.basis[3:] if self.kind == "twists" else self.basis[:3]

    @property
    def moments(self) -> Array:
        """Moment (3, n) of each about the origin, over the length: velocity of the origin, or moment."""
        return self.basis[:3] if self.kind == "twists" else self.basis[3:]

    def reciprocal(self) -> ScrewSpace:
        """All wrenches that do no work on these twists, or twists on which these wrenches do none."""
        rest = la.null_space(self.basis.T) if self.dimension else np.eye(6)
        return ScrewSpace("wrenches" if self.kind == "twists" else "twists", rest, self.length)

    def holds(self, other: ScrewSpace) -> bool:
        """Whether all of the other, of the same kind and length, is in it."""
        outside = other.basis - self.basis @ (self.basis.T @ other.basis)
        return bool(np.abs(outside).max(initial=0.0) <= 10 * SAME)

    def moved(self, rotation: Array, translation: Array = np.zeros(3)) -> ScrewSpace:
        """The same, fixed to what is rotated (3, 3) about the origin and then moved (3,), m; where it is mirrored,
        directions of rotations and moments of forces change their signs, which changes no space of lines."""
        direction = rotation @ self.directions
        moment = np.linalg.det(rotation) * (rotation @ self.moments)
        moment = moment + np.cross(translation / self.length, direction, axis=0)
        both = (moment, direction) if self.kind == "twists" else (direction, moment)
        return ScrewSpace(self.kind, la.orth(np.concatenate(both)) if self.dimension else self.basis, self.length)

    def directions_at(self, point: ArrayLike) -> Array:
        """Directions (3, k), orthonormal, of lines through a point (3,), m, that are in the space: axes of pure
        rotations, or of pure forces. All lines of a space through one point fill a line, a plane or everything."""
        arm = np.cross(np.asarray(point, dtype=np.float64) / self.length, np.eye(3)).T  # p x d for unit d
        both = (arm, np.eye(3)) if self.kind == "twists" else (np.eye(3), arm)
        lines = np.concatenate(both)
        outside = lines - self.basis @ (self.basis.T @ lines)
        _, s, Vt = la.svd(outside)
        return np.asarray(Vt[s <= 10 * SAME].T)

    def principal(self) -> tuple[Screw, ...]:
        """Screws that span it, by pitch: those of extreme pitch, at right angles to each other, and then what has no
        axis, translations or couples (Hunt 1978, principal screws of a system)."""
        turning, couples = self._split()
        d, m = turning[:3], turning[3:]
        screws = []
        if d.shape[1]:
            pitch, C = la.eigh(d.T @ m + m.T @ d, 2 * d.T @ d)
            order = np.argsort(np.abs(pitch) * np.where(np.abs(pitch) < SAME, 0.0, 1.0), kind="stable")
            for h, c in zip(pitch[order], C[:, order].T, strict=True):
                u, v = d @ c, m @ c
                size = float(np.linalg.norm(u))
                u, v = _signed(u / size), v / size * np.sign(_signed(u / size) @ u)
                clean = 0.0 if abs(h) < SAME else float(h) * self.length
                screws.append(Screw(u, _clean(np.cross(u, v)) * self.length, clean))
        return (*screws, *(Screw(_signed(c), np.zeros(3), np.inf) for c in _along_axes(couples).T))

    def lines(self) -> ScrewSpace:
        """What its lines alone span, pure rotations or forces: all of it where lines may make it."""
        turning, couples = self._split()
        d = np.concatenate([turning[:3], np.zeros((3, couples.shape[1]))], axis=1)
        m = np.concatenate([turning[3:], couples], axis=1)
        q, V = la.eigh(d.T @ m + m.T @ d) if d.shape[1] else (np.zeros(0), np.zeros((0, 0)))
        size = np.sqrt(np.abs(q))
        zero = np.abs(q) <= 10 * SAME
        plus, minus = np.flatnonzero(~zero & (q > 0)), np.flatnonzero(~zero & (q < 0))
        null = [V[:, k] for k in np.flatnonzero(zero)]
        sums = [
            V[:, i] / size[i] + s * V[:, j] / size[j] for i in plus for j in minus for s in (1.0, -1.0)
        ]  # pitch zero
        null += [a + s * b for k, a in enumerate(null) for b in null[k + 1 :] for s in (1.0, -1.0)]
        every = [*null, *sums, *(a + b for a in sums for b in null)]
        chosen = [c / np.linalg.norm(c) for c in every if np.linalg.norm(d @ c) > 10 * SAME * np.linalg.norm(c)]
        columns = np.array([[*(d @ c), *(m @ c)] for c in chosen]).reshape(-1, 6).T
        if self.kind == "twists":
            columns = columns[[3, 4, 5, 0, 1, 2]]
        return ScrewSpace.of(self.kind, columns * _units(self.kind, self.length)[:, None], self.length)

    def _split(self) -> tuple[Array, Array]:
        """Direction above moment (6, r) of what has axes, moments at right angles to the couples; couples (3, c)."""
        d, m = self.directions, self.moments
        if not self.dimension:
            return np.zeros((6, 0)), np.zeros((3, 0))
        _, s, Vt = la.svd(d)
        r = int((s > 10 * SAME).sum())
        couples = la.orth(m @ Vt[r:].T) if r < self.dimension else np.zeros((3, 0))
        turning = np.concatenate([d @ Vt[:r].T, m @ Vt[:r].T])
        turning[3:] -= couples @ (couples.T @ turning[3:])
        return turning, couples


def sum_of(spaces: Sequence[ScrewSpace]) -> ScrewSpace:
    """What spaces of one kind and length span together: wrenches of limbs side by side, twists of joints in a row."""
    first = spaces[0]
    units = _units(first.kind, first.length)[:, None]
    return ScrewSpace.of(first.kind, np.concatenate([own.basis for own in spaces], axis=1) * units, first.length)


def _units(kind: Kind, length: float) -> Array:
    """What one is of each component (6,)."""
    return np.repeat([length, 1.0] if kind == "twists" else [1.0, length], 3)


def _signed(direction: Array) -> Array:
    """A direction with its first large component positive."""
    clean = _clean(direction)
    return clean * np.sign(clean[np.flatnonzero(np.abs(clean) > 1e-6)[0]])


def _clean(vector: Array) -> Array:
    return np.where(np.abs(vector) < 10 * SAME, 0.0, vector)


def _along_axes(space: Array) -> Array:
    """An orthonormal basis (3, n) of a space, along global axes where these are in it."""
    if not space.shape[1]:
        return space
    nearest, _, _ = la.qr(space @ space.T, pivoting=True)
    return nearest[:, : space.shape[1]]
