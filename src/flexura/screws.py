"""Spaces of screws: twists that are free, wrenches that are borne, which of both are reciprocal, and their lines.

A twist (6,) is the translation of the origin and the rotation, a wrench (6,) the force and its moment about the origin,
both in the order of DOFs. Both are screws: a direction along an axis, and a pitch (Ball 1900). A wrench is reciprocal
to a twist when it does no work on it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

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

    def components(self, kind: Kind) -> Array:
        """The twist or wrench (6,) itself, of unit direction."""
        is_free = np.isinf(self.pitch)
        moment = self.direction if is_free else np.cross(self.point, self.direction) + self.pitch * self.direction
        both = (0.0 * self.direction if is_free else self.direction, moment)
        return np.concatenate(both[::-1] if kind == "twists" else both)

    def word(self, kind: Kind) -> str:
        """What a twist or a wrench of its pitch is called."""
        return _WORDS[kind][1 if np.isinf(self.pitch) else 2 if self.pitch else 0]


@dataclass(frozen=True)
class ScrewSpace:
    """A linear space of twists or wrenches about the origin, of dimension n.

    `basis` (6, n) is orthonormal where translations and moments are over `length`, m, the size of what is looked at.
    Screws, pitches over the length and directions are the `same` up to this.
    """

    kind: Kind
    basis: Array
    length: float
    same: float = SAME

    @staticmethod
    def of(kind: Kind, screws: ArrayLike, length: float = 1.0, same: float = SAME) -> ScrewSpace:
        """The space that screws (6, m) span."""
        columns = np.asarray(screws, dtype=np.float64).reshape(6, -1) / _units(kind, length)[:, None]
        size = np.linalg.norm(columns, axis=0)
        unit = columns[:, size > 0] / size[size > 0]
        U, s, _ = la.svd(unit, full_matrices=False) if unit.shape[1] else (np.zeros((6, 0)), np.zeros(0), None)
        return ScrewSpace(kind, U[:, s > same * s.max(initial=1.0)], length, same)

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
        return ScrewSpace("wrenches" if self.kind == "twists" else "twists", rest, self.length, self.same)

    def holds(self, other: ScrewSpace) -> bool:
        """Whether all of the other, of the same kind and length, is in it."""
        outside = other.basis - self.basis @ (self.basis.T @ other.basis)
        return bool(np.abs(outside).max(initial=0.0) <= 10 * self.same)

    def moved(self, rotation: Array, translation: ArrayLike = (0, 0, 0)) -> ScrewSpace:
        """The same, fixed to what is rotated (3, 3) about the origin and then moved (3,), m; where it is mirrored,
        directions of rotations and moments of forces change their signs, which changes no space of lines."""
        direction = rotation @ self.directions
        moment = np.linalg.det(rotation) * (rotation @ self.moments)
        moment = moment + np.cross(np.asarray(translation) / self.length, direction, axis=0)
        both = (moment, direction) if self.kind == "twists" else (direction, moment)
        basis = la.orth(np.concatenate(both)) if self.dimension else self.basis
        return ScrewSpace(self.kind, basis, self.length, self.same)

    def directions_at(self, point: ArrayLike) -> Array:
        """Directions (3, k), orthonormal, of lines through a point (3,), m, that are in the space: axes of pure
        rotations, or of pure forces. All lines of a space through one point fill a line, a plane or everything."""
        arm = np.cross(np.asarray(point, dtype=np.float64) / self.length, np.eye(3)).T  # p x d for unit d
        both = (arm, np.eye(3)) if self.kind == "twists" else (np.eye(3), arm)
        lines = np.concatenate(both)
        outside = lines - self.basis @ (self.basis.T @ lines)
        _, s, Vt = la.svd(outside)
        return np.asarray(Vt[s <= 10 * self.same].T)

    def principal(self) -> tuple[Screw, ...]:
        """Screws that span it: those of extreme pitch, at right angles to each other, by pitch, and then what has no
        axis, translations or couples (Hunt 1978, principal screws of a system; theory eq. Y13). Of one pitch they go
        along global axes where these are among them."""
        parts = self._parts()
        screws = [self._screw(d, m, h) for d, m, h in parts.turning()]
        return (*screws, *(Screw(_signed(c), np.zeros(3), np.inf) for c in _along_axes(parts.couples).T))

    def simplest(self) -> tuple[Screw, ...]:
        """Screws that span it, as the principal ones, but of opposite pitches as many lines in their place: two skew
        rotations by their own axes."""
        parts = self._parts()
        every = [*parts.turning()]
        plus, minus = [own for own in every if own[2] > 0], [own for own in every if own[2] < 0]
        chosen = [own for own in every if not own[2]]
        if plus and minus:
            pairs = [(plus[0], minus[0], 1.0), (plus[0], minus[0], -1.0)]
            pairs += [(own, minus[0], 1.0) for own in plus[1:]] + [(plus[0], own, 1.0) for own in minus[1:]]
            for a, b, sign in pairs:
                d, m = (a[k] / np.sqrt(a[2]) + sign * b[k] / np.sqrt(-b[2]) for k in (0, 1))
                chosen.append((d, m, 0.0))
        else:
            chosen += plus + minus
        couples = (Screw(_signed(c), np.zeros(3), np.inf) for c in _along_axes(parts.couples).T)
        return (*(self._screw(*own) for own in chosen), *couples)

    def lines(self) -> ScrewSpace:
        """What its lines alone span, pure rotations or forces: all of it where lines may make it. Four dimensions are
        spanned by lines unless two couples are reciprocal to them, and five always."""
        parts = self._parts()
        if self.dimension > 4 or (self.dimension == 4 and self.reciprocal()._parts().couples.shape[1] < 2):
            return self
        d, m = parts.every()
        q, V = la.eigh(d.T @ m + m.T @ d) if d.shape[1] else (np.zeros(0), np.zeros((0, 0)))
        size = np.sqrt(np.abs(q))
        zero = np.abs(q) <= 10 * self.same
        plus, minus = np.flatnonzero(~zero & (q > 0)), np.flatnonzero(~zero & (q < 0))
        null = [V[:, k] for k in np.flatnonzero(zero)]
        sums = [
            V[:, i] / size[i] + s * V[:, j] / size[j] for i in plus for j in minus for s in (1.0, -1.0)
        ]  # pitch zero
        null += [a + s * b for k, a in enumerate(null) for b in null[k + 1 :] for s in (1.0, -1.0)]
        every = [*null, *sums, *(a + b for a in sums for b in null)]
        chosen = [c / np.linalg.norm(c) for c in every if np.linalg.norm(d @ c) > 10 * self.same * np.linalg.norm(c)]
        columns = np.array([[*(d @ c), *(m @ c)] for c in chosen]).reshape(-1, 6).T
        if self.kind == "twists":
            columns = columns[[3, 4, 5, 0, 1, 2]]
        return ScrewSpace.of(self.kind, columns * _units(self.kind, self.length)[:, None], self.length, self.same)

    @property
    def variety(self) -> str:
        """What its lines are, in Grassmann's geometry (Dandurand 1984; Merlet 1989), with those at infinity apart:
        lines that meet at infinity are parallel."""
        own = self.lines()
        if own.dimension in (0, 1, 6):
            return {0: "no line", 1: "a line", 6: "all lines"}[own.dimension]
        mark = own.reciprocal()._mark() if own.dimension > 3 else own._mark()
        told = (_CONGRUENCES if own.dimension > 3 else _VARIETIES).get(mark)
        return told or f"lines of {own.dimension} dimensions"

    @property
    def name(self) -> str:
        """What is free, or borne, in the words of the field."""
        own, parts = self.lines(), self._parts()
        if self.dimension in (0, 6):
            return _ENDS[self.kind][self.dimension > 0]
        if self.kind == "twists" and self.dimension == 5:
            return _ALL_BUT[self.reciprocal().principal()[0].word("wrenches")]
        line, couple, _ = _WORDS[self.kind]
        couples = parts.couples.shape[1] - own._parts().couples.shape[1]
        if own.dimension == couples == parts.free.shape[1] == 1 and self.dimension == 2:
            along = np.abs(parts.couples.T @ parts.free).max() > 1 - self.same
            return f"{line} and {couple} along it" if along else f"{line} and oblique {couple}"
        if self.kind == "wrenches":
            said = [line if own.dimension == 1 else f"{line}s along {own.variety}"] if own.dimension else []
            counts = [0, couples, self.dimension - own.dimension - couples]
        elif own.dimension == self.dimension and own.variety in _ROTATIONS:
            return _ROTATIONS[own.variety]
        else:
            said, words = [], [screw.word(self.kind) for screw in self.simplest()]
            counts = [words.count(word) for word in _WORDS[self.kind]]
        if not said and sum(counts) == 1:
            return _WORDS[self.kind][counts.index(1)]
        said += [_several(*own) for own in zip(counts, _WORDS[self.kind], strict=True) if own[0]]
        return " and ".join(filter(None, (", ".join(said[:-1]), said[-1])))

    def _mark(self) -> str:
        """Dimension, couples, and how many screws of pitches of either sign, the more first, tell it from others."""
        parts = self._parts()
        d, m = parts.every()
        q, V = la.eigh(d.T @ m + m.T @ d)
        zero = np.abs(q) <= 10 * self.same
        signs = sorted((int((~zero & (q > 0)).sum()), int((~zero & (q < 0)).sum())), reverse=True)
        form = f"{signs[0]}{signs[1]}"
        pitches = sorted(abs(h) for *_, h in parts.turning())
        is_couple = zero.any() and np.linalg.norm(d @ V[:, zero]) <= 10 * self.same
        alike = len(pitches) == 2 and form == "20" and pitches[1] - pitches[0] <= 10 * self.same * max(1.0, pitches[1])
        return f"{self.dimension}{'c' * parts.couples.shape[1]} {form}{'i' if is_couple else ''}{'=' if alike else ''}"

    def _screw(self, d: Array, m: Array, pitch: float) -> Screw:
        size = float(np.linalg.norm(d))
        u = _signed(d / size, self.same)
        v = m / size * (1.0 if u @ d > 0 else -1.0)
        return Screw(u, _clean(np.cross(u, v), self.same) * self.length, pitch * self.length)

    def _parts(self) -> _Parts:
        """What has axes and what has none, such that couples and pitches go together as little as they may.

        Couples that are not at right angles to all directions take away the pitch of those that they are along.
        """
        d, m, tol = self.directions, self.moments, 10 * self.same
        if not self.dimension:
            nothing = np.zeros((3, 0))
            return _Parts(nothing, nothing, nothing, nothing, nothing, self.same)
        U, s, Vt = la.svd(d)
        r = int((s > tol).sum())
        couples = la.orth(m @ Vt[r:].T) if r < self.dimension else np.zeros((3, 0))
        d, m = U[:, :r], m @ Vt[:r].T / s[:r]
        m = m - couples @ (couples.T @ m)
        left, along, right = (
            la.svd(couples.T @ d) if couples.size and r else (np.eye(couples.shape[1]), s[:0], np.eye(r))
        )
        e = int((along > tol).sum())
        k, V = couples @ left[:, :e] / along[:e], right.T
        own, free = (d @ V[:, e:], m @ V[:, e:]), (d @ V[:, :e], m @ V[:, :e])
        cross = free[0].T @ own[1] + free[1].T @ own[0]
        alone = free[0].T @ free[1]
        return _Parts(own[0], own[1] - k @ cross, free[0], free[1] - k @ (alone + alone.T) / 2, couples, self.same)


class _Parts(NamedTuple):
    """Directions and moments of screws whose pitch is their own, `d` and `m` (3, r), of others, which couples have made
    lines, `free` and `arm` (3, e), no pitch between both, and the couples (3, c)."""

    d: Array
    m: Array
    free: Array
    arm: Array
    couples: Array
    same: float

    def every(self) -> tuple[Array, Array]:
        """Directions and moments (3, n) of all."""
        d = np.concatenate([self.d, self.free, np.zeros(self.couples.shape)], axis=1)
        return d, np.concatenate([self.m, self.arm, self.couples], axis=1)

    def turning(self) -> Iterator[tuple[Array, Array, float]]:
        """Direction (3,), moment (3,) and pitch of each that has an axis, lines first, then by size of pitch."""
        pitch, V = la.eigh((self.d.T @ self.m + self.m.T @ self.d) / 2) if self.d.shape[1] else (np.zeros(0), np.eye(0))
        tol = 10 * self.same
        pitch[np.abs(pitch) <= tol] = 0.0
        groups: dict[float, list[int]] = {}
        for k, h in enumerate(pitch.tolist()):
            near = next((g for g in groups if abs(h - g) <= tol * max(1.0, abs(g)) and (h == 0) == (g == 0)), h)
            groups.setdefault(near, []).append(k)
        found = {h: (self.d @ V[:, at], self.m @ V[:, at]) for h, at in groups.items()}
        if self.free.shape[1]:
            d, m = found.get(0.0, (self.free[:, :0], self.arm[:, :0]))
            found[0.0] = np.concatenate([d, self.free], axis=1), np.concatenate([m, self.arm], axis=1)
        for h in sorted(found, key=lambda h: (abs(h), -h)):
            d, m = found[h]
            for u in _along_axes(d).T:
                yield u, m @ (d.T @ u), h


_VARIETIES = {
    "2 00": "all lines of a plane through a point",
    "2 11": "two skew lines",
    "2c 00": "parallel lines in a plane",
    "3 00": "all lines through a point",
    "3c 00": "all lines of a plane",
    "3cc 00": "all lines parallel to a direction",
    "3 11": "all lines of two planes through a point of each on both",
    "3c 11": "all lines of a plane through a point on another, and all of that other parallel to where both meet",
    "3c 11i": "lines of two directions in parallel planes",
    "3 21": "one family of lines of a hyperboloid",
    "3c 21": "one family of lines of a hyperbolic paraboloid",
}
"""Varieties of lines of two and three dimensions."""

_CONGRUENCES = {
    "2 00": "all lines in a plane or through a point of it",
    "2 11": "all lines that meet two skew lines",
    "2 20": "all lines of an elliptic congruence",
    "2 20=": "all lines of an elliptic congruence that is alike all around",
    "2 10": "all lines of a parabolic congruence, which meet a line",
    "2c 00": "all lines in a plane or parallel to a line of it",
    "2c 11": "all lines that meet a line and are at right angles to a direction",
    "2c 10i": "all lines of a parabolic congruence, at right angles to a direction",
    "1 00": "all lines that meet a line",
    "1c 00i": "all lines at right angles to a direction",
    "1 10": "all lines of a linear complex",
}
"""Those of four and five dimensions, by what is reciprocal."""

_WORDS = {"twists": ("rotation", "translation", "screw"), "wrenches": ("force", "couple", "wrench")}
_ENDS = {"twists": ("no motion", "all motions"), "wrenches": ("nothing", "all forces and couples")}
_ALL_BUT = {
    "force": "all motions but along a line",
    "couple": "all motions but about a direction",
    "wrench": "all motions but along one screw",
}
_ROTATIONS = {
    "a line": "rotation",
    "all lines of a plane through a point": "two rotations that intersect",
    "parallel lines in a plane": "two parallel rotations",
    "two skew lines": "two skew rotations",
    "all lines through a point": "all rotations through a point (spherical)",
    "all lines of a plane": "all rotations in a plane, with the translation along its normal",
    "all lines parallel to a direction": "all parallel rotations (planar motion)",
}
"""Names of spaces of rotations; others are called by how many of each there are."""


def _several(count: int, what: str) -> str:
    """So many of them in words."""
    told = {1: "one", 2: "two", 3: "three"}.get(count, str(count))
    return f"{told} {what}" + ("" if count == 1 else "es" if what.endswith("ch") else "s")


def _units(kind: Kind, length: float) -> Array:
    """What one is of each component (6,)."""
    return np.repeat([length, 1.0] if kind == "twists" else [1.0, length], 3)


def _signed(direction: Array, same: float = SAME) -> Array:
    """A direction with its first large component positive."""
    clean = _clean(direction, same)
    return clean * np.sign(clean[np.flatnonzero(np.abs(clean) > 1e-6)[0]]) + 0.0


def _clean(vector: Array, same: float = SAME) -> Array:
    return np.where(np.abs(vector) < 10 * same, 0.0, vector)


def _along_axes(space: Array) -> Array:
    """An orthonormal basis (3, n) of a space, along global axes where these are in it."""
    if not space.shape[1]:
        return space
    nearest, _, _ = la.qr(space @ space.T, pivoting=True)
    return np.asarray(nearest[:, : space.shape[1]], dtype=np.float64)
