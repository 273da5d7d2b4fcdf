"""Motions and self-stress of bodies between stiff and soft deformations, counted by singular values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flexura.analysis.static.deformations import GROUND, SUPPORT, Skeleton, skeleton
from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.sizes import within
from flexura.structure import FullOrderModel
from flexura.thresholds import ROUND_OFF, STILL

HALF = 0.5
"""A motion is constrained when at least this share of its strain energy is in stiff deformations."""

NO_STRAIN = 1e-9
"""Singular value, beside the largest where columns have unit size, of a motion that strains nothing."""


def counted_between(
    model: FullOrderModel, between: Sequence[str] | None
) -> tuple[Skeleton, Count, tuple[int, int] | None]:
    """Bodies and what is elastic between them, the count, and the numbers of the two bodies that were asked for.

    Raises OptionError where nothing is elastic, for unknown bodies, and for two that are one.
    """
    found = skeleton(model)
    if not found.elastic:
        raise OptionError("nothing in this mechanism is elastic: there are no constraints to count")
    pair = None if between is None else _pair(model, found, between)
    return found, Count.of(found, *part_between(found, pair)), pair


def _pair(model: FullOrderModel, found: Skeleton, between: Sequence[str]) -> tuple[int, int]:
    """Numbers of two bodies by the names of nodes."""
    if len(between) != 2:
        raise OptionError(f"constraints are between two bodies, not {len(between)}")
    numbers = []
    for name in between:
        if name == GROUND:
            body = -1 if found.ground is None else found.ground
        else:
            body = int(found.of_node[model.plan.topology.numbers([name])[0]])
        if body < 0:
            what = "nothing is held" if name == GROUND else "it is within a member, or nothing elastic is at its body"
            raise OptionError(f"there are no constraints of {name}: {what}")
        numbers.append(body)
    if numbers[0] == numbers[1]:
        raise OptionError(f"{between[0]} and {between[1]} are one body")
    return numbers[0], numbers[1]


def part_between(found: Skeleton, pair: tuple[int, int] | None) -> tuple[int, Index]:
    """The body that is held, and which of what is elastic counts: all, or what lies between two bodies."""
    every = np.arange(len(found.elastic))
    if pair is None:
        if found.ground is not None:
            return found.ground, every
        return (found.described or (0,))[0], every
    n = len(found.names)
    links = [(a, b) for own in found.elastic for a in own.bodies for b in own.bodies if not {a, b} & set(pair)]
    at = np.array(links, dtype=np.intp).reshape(-1, 2)
    label = connected_components(coo_array((np.ones(len(at)), at.T), shape=(n, n)), directed=False)[1]
    touched: dict[int, set[int]] = {}
    for own in found.elastic:
        for body in set(own.bodies) - set(pair):
            touched.setdefault(int(label[body]), set()).update(set(own.bodies) & set(pair))
    chosen = [
        k
        for k, own in enumerate(found.elastic)
        if all(len(touched[int(label[body])]) == 2 for body in set(own.bodies) - set(pair))
    ]
    if not chosen:
        names = " and ".join(found.names[b] for b in pair)
        raise OptionError(f"nothing elastic lies between {names}")
    return pair[0], np.array(chosen, dtype=np.intp)


@dataclass(frozen=True)
class Count:
    """Freedoms and over-constraints of what is `chosen` of all that is elastic, with one body `held` (theory eq. Y7).

    `owner` (s, 2) says which stiff deformation of which member each of the s constraints is. `share` (r,) is how much
    of their energy is in stiff deformations of all motions that strain something, descending, of which the first
    `rank` are constrained. `strained` (6 b, r) are these motions, of one energy, displacements of the `moving` bodies
    with rotations times the size, and `unstrained` (6 b, l) those that strain nothing. `stress` (s, o) is an
    orthonormal basis of self-stress: forces over the square roots of stiffness.
    """

    held: int
    chosen: Index
    moving: list[int]
    owner: Index
    share: Array
    rank: int
    strained: Array
    unstrained: Array
    stress: Array

    @property
    def odds(self) -> Array:
        """Energy in stiff deformations over that in soft ones (r,), descending."""
        return _odds(self.share)

    @property
    def motions(self) -> Array:
        """Freedoms (6 b, f), the last of which strain nothing."""
        return np.concatenate([self.strained[:, self.rank :], self.unstrained], axis=1)

    @property
    def loose(self) -> int:
        """Number of freedoms that strain nothing."""
        return self.unstrained.shape[1]

    @property
    def freedoms(self) -> int:
        """Number of freedoms."""
        return self.motions.shape[1]

    @property
    def over(self) -> int:
        """Number of over-constraints."""
        return self.stress.shape[1]

    @property
    def extremes(self) -> tuple[float, float]:
        """The largest of the odds of freedoms, zero where it is round-off, and the least of those of constraints."""
        free = float(self.odds[self.rank :].max(initial=0.0))
        return free if free > ROUND_OFF else 0.0, float(self.odds[: self.rank].min(initial=np.inf))

    @staticmethod
    def of(found: Skeleton, held: int, chosen: Index, turned: int = -1) -> Count:
        """The count, with the member `turned` by a right angle about its axis."""
        bodies = {b for k in chosen for b in found.elastic[k].bodies}
        if len(chosen) == len(found.elastic):
            bodies |= {*found.described}
        moving = sorted(bodies - {held})
        n = sum(len(found.divisions[k].rows) for k in chosen)
        within("dense_entries", n * max(n, 6 * len(moving)), f"the constraint matrix of {n} deformations")
        stiff, soft, owner = _rows(found, moving, chosen, turned)
        A = np.concatenate([stiff, soft])
        unit = np.linalg.norm(A, axis=0)
        unit[unit == 0] = 1.0
        U, size, Vt = la.svd(A / unit, full_matrices=A.shape[0] < A.shape[1])
        r, s = int((size > NO_STRAIN * size.max(initial=0.0)).sum()), len(stiff)
        left, cosine, right = la.svd(U[:s, :r]) if s and r else (np.eye(s), np.zeros(0), np.eye(r))
        share = np.zeros(r)
        share[: len(cosine)] = np.minimum(cosine, 1.0) ** 2
        rank = int((share >= HALF).sum())
        strained = (Vt[:r].T / size[:r]) @ right.T / unit[:, None]
        return Count(held, chosen, moving, owner, share, rank, strained, Vt[r:].T / unit[:, None], left[:, rank:])

    def of_bodies(self, *bodies: int) -> BodyMotions:
        """What some of the moving bodies do while all others are where the energy is least (theory eq. Y12)."""
        at = [6 * self.moving.index(body) + k for body in bodies for k in range(6)]
        loose = la.orth(self.unstrained[at], rcond=STILL) if self.loose else np.zeros((len(at), 0))
        B = self.strained[at]
        _, size, Wt = la.svd(B - loose @ (loose.T @ B), full_matrices=False)
        W = Wt[size > STILL * size.max(initial=0.0)].T
        share, Y = la.eigh(W.T @ (self.share[:, None] * W))
        mixed = W @ Y[:, share < HALF]
        free = B[:, self.rank :] @ mixed[self.rank :]  # without what else gives way a little
        return BodyMotions(np.concatenate([loose, free], axis=1), loose, B @ W @ Y, np.clip(share, 0.0, 1.0))

    def turned(self, found: Skeleton, member: int) -> Count:
        """The count with a member turned by a right angle about its axis."""
        return Count.of(found, self.held, self.chosen, member)


@dataclass(frozen=True)
class BodyMotions:
    """Motions of b bodies, rotations times the size: `loose` ones (6 b, l) that strain nothing, and `strained` ones
    (6 b, k) of one energy, of which the `share` (k,) is in stiff deformations, ascending, without any between two of
    them. `freedoms` (6 b, f) are the loose ones, and those that are mostly soft where all that is constrained is held.
    """

    freedoms: Array
    loose: Array
    strained: Array
    share: Array

    @property
    def odds(self) -> Array:
        """Energy in stiff deformations over that in soft ones (l + k,), ascending."""
        return np.append(np.zeros(self.loose.shape[1]), _odds(self.share))

    def odds_of(self, twist: Array) -> float:
        """The same of any motion (6 b,)."""
        a = la.lstsq(np.concatenate([self.loose, self.strained], axis=1), twist)[0][self.loose.shape[1] :]
        energy = np.square(a)
        return float(_odds(energy @ self.share / max(energy.sum(), np.finfo(float).tiny)))


def _odds(share: Array) -> Array:
    """Shares as odds."""
    return share / np.maximum(1 - share, np.finfo(float).eps)


def _rows(found: Skeleton, moving: list[int], chosen: Index, turned: int) -> tuple[Array, Array, Index]:
    """Stiff and soft deformations, each times the square root of its stiffness, by displacements of the moving bodies
    and rotations times the size, and the member and the deformation of the stiff ones."""
    scale = np.repeat([1.0, 1.0 / (found.size)], 3)
    column = {b: slice(6 * k, 6 * k + 6) for k, b in enumerate(moving)}
    most = max(
        (float(found.divisions[k].level.max()) for k in chosen if found.elastic[k].kind != "support"), default=1.0
    )
    stiff, soft, owner = [], [], []
    for k in chosen:
        own, d = found.elastic[k], found.divisions[k]
        rows = d.rows * np.sqrt(SUPPORT * most) if own.kind == "support" else d.rows
        if k == turned:
            rows = rows @ np.kron(np.eye(2), [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
        by_bodies = rows @ own.relative
        whole = np.zeros((len(rows), 6 * len(moving)))
        for n, body in enumerate(own.bodies):
            if body in column:
                whole[:, column[body]] += by_bodies[:, 6 * n : 6 * n + 6] * scale
        stiff.append(whole[: d.count])
        soft.append(whole[d.count :])
        owner += [(int(k), j) for j in range(d.count)]
    return np.concatenate(stiff), np.concatenate(soft), np.array(owner, dtype=np.intp).reshape(-1, 2)
