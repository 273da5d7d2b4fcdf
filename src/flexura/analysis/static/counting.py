"""Motions and self-stress of bodies between stiff and soft deformations, counted by singular values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flexura.analysis.static.deformations import SUPPORT, Skeleton
from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.sizes import within
from flexura.thresholds import ROUND_OFF

HALF = 0.5
"""A motion is constrained when at least this share of its strain energy is in stiff deformations."""

NO_STRAIN = 1e-9
"""Singular value, beside the largest where columns have unit size, of a motion that strains nothing."""


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

    `owner` (s, 2) says which stiff deformation of which member each of the s constraints is. `odds` are the energy in
    stiff deformations over that in soft ones of all motions that strain something, descending, of which the first
    `rank` are constrained. `motions` (6 b, f) are the freedoms, displacements of the `moving` bodies with rotations
    times the size; the `loose` last of them strain nothing. `stress` (s, o) is an orthonormal basis of self-stress:
    forces over the square roots of stiffness.
    """

    held: int
    chosen: Index
    moving: list[int]
    owner: Index
    odds: Array
    rank: int
    motions: Array
    loose: int
    stress: Array

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
        strained = np.zeros(A.shape[1], dtype=bool)
        strained[: len(size)] = size > NO_STRAIN * size.max(initial=0.0)
        r, s = int(strained.sum()), len(stiff)
        left, cosine, right = la.svd(U[:s, :r]) if s and r else (np.eye(s), np.zeros(0), np.eye(r))
        share = np.zeros(r)
        share[: len(cosine)] = np.minimum(cosine, 1.0) ** 2
        rank = int((share >= HALF).sum())
        bent = (Vt[:r].T / size[:r]) @ right[rank:].T
        motions = np.concatenate([bent, Vt[r:].T], axis=1) / unit[:, None]
        odds = share / np.maximum(1 - share, np.finfo(float).eps)
        return Count(held, chosen, moving, owner, odds, rank, motions, len(unit) - r, left[:, rank:])

    def turned(self, found: Skeleton, member: int) -> Count:
        """The count with a member turned by a right angle about its axis."""
        return Count.of(found, self.held, self.chosen, member)


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
