"""What the pose of one end of an element, seen from the other, does to it: strains that are quadratic in that pose.

With d the change of the logarithm of the relative pose, and amplitudes z of motions inside the element, the energy is
e'ke/2 of the strains e = q + q'Hq/2, q = (d, z), at the z that makes it least. k is the stiffness that the element has
at rest, whatever its theory. H follows from a uniform beam; it ends what makes straight elements converge slowly:
bending shortens, bending across a bent plane twists, and the twist varies within the element.

d = (u, s2, s3, phi, theta2, theta3): translations along and across the element, m, and rotations, rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.duals import plain, without_slopes, zeros
from flexura.kernels import Struct
from flexura.motion.bowing import POINTS, ROOTS, SHARES, Bowing
from flexura.motion.lanes import LANES, abreast, are_plain, whole
from flexura.motion.se3 import Logarithm
from flexura.structure import EVEN, Distortion

INNER_STEPS = 10
"""Most steps of Newton's method for the motions inside elements, which are small of second order."""

INNER_SETTLED = 1e-12
"""Largest last step of these, rad, of whose square it leaves an error."""

_NAMES = ("u", "s2", "s3", "phi", "theta2", "theta3", "a", "b", "c2", "c3")
_WAGNER = ("w0", "w1", "w2")
"""Strains of fibres by twist, beside those that motions have of first order."""
_AT = {name: i for i, name in enumerate((*_NAMES, *_WAGNER))}

CURVATURES = ((_AT["c2"], _AT["theta2"]), (_AT["c3"], _AT["theta3"]))
"""Places of curvatures of degree 2 among motions, and of what bends likewise."""

_SECOND_ORDER = (
    # of products of a bent and of a sheared part of s; theory eq. G10
    ("u", "s2", "s2", 3 / 5),
    ("u", "s3", "s3", 3 / 5),
    ("u", "h2", "s2", 1),
    ("u", "h3", "s3", 1),
    ("s2", "u", "s2", -1),
    ("s3", "u", "s3", -1),
    ("phi", "s2", "theta2", 1),
    ("phi", "s3", "theta3", 1),
    ("theta2", "s2", "phi", -1),
    ("theta3", "s3", "phi", -1),
    # of the inner twists a, b and the inner bending c2, c3; theory eq. G12
    ("s3", "h2", "a", 1 / 6),
    ("s2", "h3", "a", -1 / 6),
    ("s3", "s2", "a", 1 / 10),
    ("s2", "s3", "a", -1 / 10),
    ("theta2", "s2", "b", 1 / 5),
    ("theta3", "s3", "b", 1 / 5),
    ("phi", "s2", "c2", -1 / 5),
    ("phi", "s3", "c3", -1 / 5),
    ("s2", "phi", "c2", 1 / 30),
    ("s3", "phi", "c3", 1 / 30),
    ("theta3", "theta2", "a", 1 / 6),
    ("theta2", "theta3", "a", -1 / 6),
    ("s2", "theta2", "b", -1 / 60),
    ("s3", "theta3", "b", -1 / 60),
    ("u", "theta2", "c2", -1 / 60),
    ("u", "theta3", "c3", -1 / 60),
    ("theta3", "a", "c2", -1 / 30),
    ("theta2", "a", "c3", 1 / 30),
    ("s2", "b", "c2", -1 / 420),
    ("s3", "b", "c3", -1 / 420),
    ("u", "c2", "c2", 1 / 420),
    ("u", "c3", "c3", 1 / 420),
)
"""Strain, the two motions of a product, and its factor at unit length."""

_OF_TWIST = (
    # squares of the rate of twist, as Legendre polynomials; theory eqs. G23-G24
    ("w0", "phi", "phi", 1 / 2),
    ("w0", "a", "a", 1 / 6),
    ("w0", "b", "b", 1 / 10),
    ("w1", "phi", "a", 1),
    ("w1", "a", "b", 2 / 5),
    ("w2", "phi", "b", 1),
    ("w2", "a", "a", 1 / 3),
    ("w2", "b", "b", 1 / 7),
)
"""Likewise, of half the square of the twist; that of w0 also stretches."""

_NEXT = ("e", "f2", "f3")
_OF_NEXT = (
    # of the motions of the next degree, 3, in twist and curvatures; theory eq. G27
    ("s2", "s3", "e", -1 / 35),
    ("s3", "s2", "e", 1 / 35),
    ("theta3", "c2", "e", 1 / 70),
    ("theta2", "c3", "e", -1 / 70),
    ("s2", "a", "f2", 1 / 140),
    ("s3", "a", "f3", 1 / 140),
    ("theta3", "b", "f2", -1 / 70),
    ("theta2", "b", "f3", 1 / 70),
    ("u", "s3", "f2", -1 / 70),
    ("u", "s2", "f3", 1 / 70),
    ("phi", "c2", "f3", -1 / 70),
    ("phi", "c3", "f2", 1 / 70),
)
"""Likewise, of a motion with one that elements do not have."""


class _Inside(NamedTuple):
    """Motions inside elements about a state: what they still lack (e, q - 6), negative; how the first of them follow
    motions of the ends, d and rates of warping, (e, i, 6 + w), negative; and the Hessian (e, 6 + w, 6 + w) by these."""

    step: Array
    follow: Array
    hessian: Array


@dataclass(frozen=True)
class Strain:
    """Quadratic strains q + q'Hq/2 of elements: `stiffness` k (e, s, s) and `curvature` H (e, s, q, q), q of 6 or more.

    What q has beyond 6 moves inside the element, the last w at its ends: rates of warping, which elements of a member
    share (`place` as of `Distortion`). Strains beyond those of q have no part of first order; `bowing` adds to the
    energy. Motions of the next degree, which are left out, would have `next_stiffness` (e, 3) and the factors
    `next_curvature` (e, 12).
    """

    stiffness: Array
    curvature: Array
    next_stiffness: Array
    next_curvature: Array
    place: Index
    bowing: Bowing

    @cached_property
    def members(self) -> tuple[Index, ...]:
        """Elements (m, n), by their number n, of the m members whose elements warp together."""
        together, first = np.flatnonzero(self.place), np.flatnonzero(self.place == 1)
        counts = np.diff(np.append(np.flatnonzero(self.place[together] == 1), len(together)))
        return tuple(first[counts == n, None] + np.arange(n) for n in np.unique(counts))

    def scaled(self, moduli: Array, length: Array) -> Strain:
        """Of elements (e,) whose moduli and all whose lengths are so many times as large: strains are as large by
        translations that grow along."""
        size = np.full(self.stiffness.shape[:2], 1.0, like=length) * length[:, None] ** 1.5
        size[:, :3] = size[:, :3] / length[:, None]
        grown = moduli * length**3
        return replace(
            self,
            stiffness=self.stiffness * (moduli[:, None] * size)[..., None] * size[:, None],
            next_stiffness=self.next_stiffness * grown[:, None],
            bowing=replace(self.bowing, plate=self.bowing.plate * grown),
        )

    @cached_property
    def is_plain(self) -> bool:
        """Whether nothing of them has slopes."""
        bowing = self.bowing
        return are_plain(
            self.stiffness, self.curvature, bowing.plate, bowing.nu, bowing.searle, bowing.free, bowing.rows
        )

    @cached_property
    def struct(self) -> Struct:
        """As kernels take it: of stiffness and curvatures what is not zero in all elements."""
        bowing, (e, strains, q, _) = self.bowing, self.curvature.shape
        rows = bowing.rows.reshape(e, -1, strains)
        tensors = (np.triu(self.stiffness), np.triu(self.curvature), rows)
        places = [np.argwhere(tensor.any(axis=0)) for tensor in tensors]
        values = [tensor[(slice(None), *at.T)] for tensor, at in zip(tensors, places, strict=True)]
        members = [(own[0], len(own)) for rows in self.members for own in rows]
        first, count = whole(np.reshape(members, (-1, 2)).T)
        flat = (abreast(values) for values in (bowing.plate, bowing.nu, bowing.searle, bowing.free))
        return Struct(
            *(e, strains, q, self._warping, len(places[0]), len(places[1]), int(bowing.any), len(places[2])),
            *(len(members), *(whole(at) for at in places), first, count),
            *(*(abreast(own) for own in values), *flat, SHARES, ROOTS),
        )

    @cached_property
    def memory(self) -> int:
        """Numbers of scratch that kernels need."""
        blocks, q, w = -(-len(self.stiffness) // LANES), self.curvature.shape[-1], self._warping
        if not w:
            return 4 * 80 * blocks
        most = max((rows.shape[1] for rows in self.members), default=0) + 1
        return 4 * (152 + q * q) * blocks + most * w // 2 * (most * w // 2 + 12 * most)

    @property
    def _warping(self) -> int:
        """Number w of rates of warping at the ends of an element."""
        return max(self.curvature.shape[-1] - len(_NAMES), 0)

    def response(self, d: Array) -> tuple[Array, Array, Array, tuple[Array, ...]]:
        """Energy (e,), N m, its gradient (e, 6) and Hessian (e, 6, 6) by d (e, 6), motions inside at rest; and what
        warping adds to the latter, by all d of the `members` (m, 6n, 6n)."""
        _, energy, gradient, _, inside = self._settled(d)
        return energy, gradient[:, :6], inside.hessian[:, :6, :6], self._coupling(inside.hessian)

    def force(self, d: Array) -> Array:
        """The gradient (e, 6) of the energy by d (e, 6) alone, motions inside at rest. They are brought there without
        slopes; those that d and the strains have move them along, to first order."""
        q, _, _, hessian, _ = self._still._settled(plain(d))
        moving = zeros(q.shape, d)
        moving[:, :6], moving[:, 6:] = d, q[:, 6:]
        slope = self._slope(moving)
        gradient = (np.swapaxes(slope, 1, 2) @ self._stress(moving, slope)[1][..., None])[..., 0]
        step = self._inside(gradient, hessian).step
        return gradient[:, :6] - (hessian[:, :6, 6:] @ step[..., None])[..., 0]

    @cached_property
    def _still(self) -> Strain:
        """The same without slopes."""
        return without_slopes(self)

    def _settled(self, d: Array) -> tuple[Array, Array, Array, Array, _Inside]:
        """Motions q (e, q) with those inside at rest, and energy, gradient and Hessian there."""
        q = np.zeros((len(d), self.curvature.shape[-1]), like=d)
        q[:, :6] = d
        for _ in range(INNER_STEPS):
            _, gradient, hessian = self._derivatives(q)
            step = self._inside(gradient, hessian).step
            q[:, 6:] -= step
            if np.abs(plain(step)).max(initial=0.0) < INNER_SETTLED:
                break
        energy, gradient, hessian = self._derivatives(q)
        return q, energy, gradient, hessian, self._inside(gradient, hessian)

    def _inside(self, gradient: Array, hessian: Array) -> _Inside:
        """Motions inside about a state with a gradient (e, q) and a Hessian (e, q, q)."""
        n = gradient.shape[1] - self._warping
        own, ends = slice(6, n), [*range(6), *range(n, gradient.shape[1])]
        both = np.concatenate([gradient[:, own, None], hessian[:, own, ends]], axis=-1)
        inner: Any = np.linalg.solve(hessian[:, own, own], both)
        coupled = hessian[:, ends, own]
        step, follow = inner[..., 0], inner[..., 1:]
        reduced = hessian[:, ends][:, :, ends] - coupled @ follow
        if not self.members:
            return _Inside(np.concatenate([step, 0 * gradient[:, n:]], axis=1), follow, reduced)
        missing = gradient[:, n:] - (coupled[:, 6:] @ step[..., None])[..., 0]
        warped = np.zeros_like(missing)
        for rows in self.members:
            warped[rows] = _shared(reduced[rows], missing[rows][..., None])[..., 0]
        step = step - (follow[..., 6:] @ warped[..., None])[..., 0]
        return _Inside(np.concatenate([step, warped], axis=1), follow, reduced)

    def _coupling(self, hessian: Array) -> tuple[Array, ...]:
        """What warping adds to the stiffness by all d of the `members` (m, 6n, 6n), where elements alone have a Hessian
        (e, 6 + w, 6 + w)."""
        added = []
        for rows in self.members:
            ends, own = _ends(rows.shape[1], self._warping), hessian[rows]
            resisted = np.swapaxes(ends, -1, -2) @ own[..., 6:, :6]
            resisted = np.moveaxis(resisted, 1, 2).reshape(len(rows), ends.shape[-1], -1)
            follow: Any = np.linalg.solve(_of_ends(own), resisted)
            added.append(-np.swapaxes(resisted, 1, 2) @ follow)
        return tuple(added)

    def pushed(self, k: Array, coupling: Sequence[Array], motions: Array) -> Array:
        """Forces (e, 6, k) on small changes (e, 6, k) of d, by what `response` gives of stiffness."""
        forces = k @ motions
        for rows, added in zip(self.members, coupling, strict=True):
            own = motions[rows]
            forces[rows] += (added @ own.reshape(*added.shape[:2], own.shape[-1])).reshape(own.shape)
        return forces

    def material(self, d: Array) -> tuple[Array, tuple[Array, ...]]:
        """The parts (e, 6, 6) and (m, 6n, 6n) of the Hessian that stiffness makes and not the forces, as `response`."""
        q = self._settled(d)[0]
        slope = self._slope(q)
        stiffness = self._stress(q, slope)[2]
        reduced = self._inside(np.zeros_like(q), np.swapaxes(slope, 1, 2) @ (stiffness @ slope)).hessian
        return reduced[:, :6, :6], self._coupling(reduced)

    def refinement_energy(self, d: Array, motions: Array) -> Array:
        """Twice the energies (e, k), N m, that motions inside of the next degree would take off small changes (e, 6, k)
        of d (e, 6), inner motions at rest (theory eq. G27)."""
        q, _, _, _, inside = self._settled(d)
        slope = self._slope(q)
        _, stress, stiffness = self._stress(q, slope)
        strains, force = np.zeros((*stress.shape, 3)), np.zeros((*q.shape, 3))
        for (of, motion, new, _), factor in zip(_OF_NEXT, self.next_curvature.T, strict=True):
            strains[:, _AT[of], _NEXT.index(new)] += factor * q[:, _AT[motion]]
            force[:, _AT[motion], _NEXT.index(new)] += factor * stress[:, _AT[of]]
        force += np.swapaxes(slope, 1, 2) @ (stiffness @ strains)
        whole = self._followed(inside, motions)
        return ((np.swapaxes(force, 1, 2) @ whole) ** 2 / self.next_stiffness[..., None]).sum(axis=1)

    def _followed(self, inside: _Inside, motions: Array) -> Array:
        """Small motions (e, q, k) with those inside that follow changes (e, 6, k) of d."""
        warped = np.zeros((len(motions), self._warping, motions.shape[-1]))
        for rows in self.members:
            hessian = inside.hessian[rows]
            warped[rows] = -_shared(hessian, hessian[..., 6:, :6] @ motions[rows])
        ends = np.concatenate([motions, warped], axis=1)
        return np.concatenate([motions, -inside.follow @ ends, warped], axis=1)

    def _slope(self, q: Array) -> Array:
        """Derivatives (e, s, q) of the strains."""
        e, m, n, _ = self.curvature.shape
        return (q[:, None] @ self._by_motion).reshape(e, m, n) + np.eye(m, n)

    @cached_property
    def _by_motion(self) -> Array:
        """Derivatives (e, q, s q) of the slope by each motion, side by side in memory."""
        e, m, n, _ = self.curvature.shape
        by_motion = np.moveaxis(self.curvature, -1, 1)
        return np.ascontiguousarray(by_motion, like=by_motion).reshape(e, n, m * n)

    def _stress(self, q: Array, slope: Array) -> tuple[Array, Array, Array]:
        """Energy (e,) by strains, what is conjugate to them (e, s), and its derivatives (e, s, s)."""
        strain = 0.5 * (slope @ q[..., None])[..., 0]
        strain[:, : q.shape[1]] += 0.5 * q
        stress = (self.stiffness @ strain[..., None])[..., 0]
        energy = 0.5 * np.einsum("en,en->e", strain, stress)
        if not self.bowing.any:
            return energy, stress, self.stiffness
        work, force, stiffness = self.bowing.added(strain)
        return energy + work, stress + force, self.stiffness + stiffness

    def _derivatives(self, q: Array) -> tuple[Array, Array, Array]:
        """Energy (e,), gradient (e, q) and Hessian (e, q, q) by all motions."""
        e, m, n, _ = self.curvature.shape
        slope = self._slope(q)
        energy, stress, stiffness = self._stress(q, slope)
        turned = np.swapaxes(slope, 1, 2)
        hessian = turned @ (stiffness @ slope)
        hessian += (stress[:, None] @ self.curvature.reshape(e, m, n * n)).reshape(e, n, n)
        return energy, (turned @ stress[..., None])[..., 0], hessian


@lru_cache(maxsize=16)
def _ends(n: int, w: int) -> Array:
    """Ones (n, w, (n + 1) w/2) where one of the w rates of warping at the ends of n elements is one of all."""
    ends = np.zeros((n, w // 2, 2, n + 1, w // 2))
    for i in range(n):
        for end in (0, 1):
            ends[i, :, end, i + end] = np.eye(w // 2)
    return ends.reshape(n, w, -1)


def _of_ends(hessian: Array) -> Array:
    """Hessians (m, r, r) by the r rates of warping of members, from those (m, n, 6 + w, 6 + w) of their elements."""
    own = hessian[..., 6:, 6:]
    ends = _ends(own.shape[1], own.shape[-1])
    return (np.swapaxes(ends, -1, -2) @ own @ ends).sum(axis=1)


def _shared(hessian: Array, forces: Array) -> Array:
    """Rates of warping (m, n, w, k) at the ends of the elements of members under forces there (m, n, w, k)."""
    ends = _ends(*forces.shape[1:3])
    solved: Any = np.linalg.solve(_of_ends(hessian), (np.swapaxes(ends, -1, -2) @ forces).sum(axis=1))
    return ends @ solved[:, None]


def natural_stiffness(K: Array, rest: Logarithm) -> Array:
    """Return k (e, 6, 6) by the relative pose of end 2, from K (e, 12, 12) by the displacements of both ends.

    Displacements are in the axes of the ends, as the logarithm of the pose at rest takes them. With end 1 held,
    h2 = after^-1 de, so that k is K of end 2 between these (theory eq. G8).
    """
    J = np.linalg.inv(rest.after)
    k = np.swapaxes(J, -1, -2) @ K[..., 6:, 6:] @ J
    return (k + np.swapaxes(k, -1, -2)) / 2


def beam_strain(k: Array, length: Array, torsion: Distortion) -> Strain:
    """Strains of beam elements with natural stiffness k (e, 6, 6) and lengths (e,), m.

    Products follow from Magnus' expansion of the relative pose (Blanes, Casas, Oteo, Ros 2009, Phys. Rep. 470, sec. 2)
    of a beam whose bending moments are linear and whose twist and curvatures vary besides as Legendre polynomials:
    a and b of degree 1 and 2 in the twist, c2 and c3 of degree 2 in the curvatures (theory eqs. G9-G12).
    """
    across = ("s2", 1, 5), ("s3", 2, 4)
    share = {name: k[:, i, i] * length**2 / (12 * k[:, theta, theta]) for name, i, theta in across}
    bent = {name: np.where(sheared < 1.0, sheared, 1.0) for name, sheared in share.items()}
    return Strain(
        _stiffness(k, length, torsion),
        _curvature(length, bent, torsion),
        np.diagonal(k, axis1=1, axis2=2)[:, 3:] / 7,
        _FOLLOWING.sizes(length, bent),
        torsion.place,
        _bowing(length, bent, torsion),
    )


@dataclass(frozen=True)
class _Products:
    """Factors (k,) of products of motions at unit length, each times a power of the length, numbered in `_POWERS`, and
    the `parts` (k, 2) of its motions that are bent or sheared, numbered in `_PARTS`."""

    factor: Array
    power: NDArray[np.intp]
    parts: NDArray[np.intp]

    @staticmethod
    def of(table: Sequence[tuple[str, tuple[str, ...], float]]) -> _Products:
        """From strains, the motions of a product in each, and factors; none of fibres depends on the length."""
        power, parts = np.full(len(table), _POWERS.index(0)), np.zeros((len(table), 2), dtype=np.intp)
        for row, (of, motions, _) in enumerate(table):
            if of not in _WAGNER:
                long = [_AT[_own(name)] < 3 for name in motions]
                power[row] = _POWERS.index((_AT[of] < 3) - sum(long))
                parts[row, : len(motions)] = [_PARTS.index(name) if name in _PARTS else 0 for name in motions]
        return _Products(np.array([factor for *_, factor in table]), power, parts)

    def sizes(self, length: Array, bent: dict[str, Array]) -> Array:
        """Factors (e, k) of elements, of whose translations across the shares `bent` (e,) are of bending."""
        one = np.ones(len(length))
        powers = np.stack([length, one, 1 / length, 1 / length**2], axis=1)
        parts = np.stack([one, *bent.values(), *(1 - share for share in bent.values())], axis=1)
        return self.factor * powers[:, self.power] * parts[:, self.parts[:, 0]] * parts[:, self.parts[:, 1]]


def _own(motion: str) -> str:
    """The motion of which h2 and h3 are the sheared parts."""
    return motion.replace("h", "s") if motion in ("h2", "h3") else motion


_POWERS = (1, 0, -1, -2)
_PARTS = ("", "s2", "s3", "h2", "h3")
_OF_TWO = [(of, (first, second), factor) for of, first, second, factor in (*_SECOND_ORDER, *_OF_TWIST)]
_TWO = _Products.of(_OF_TWO)
_FOLLOWING = _Products.of([(of, (motion,), factor) for of, motion, _, factor in _OF_NEXT])


def _scatter() -> tuple[NDArray[np.intp], Array]:
    """Places (m,) of a curvature (s q q,) that are not zero, and the shares (k, m) that products have in them."""
    n = len(_NAMES)
    whole = np.zeros((len(_OF_TWO), len(_AT), n, n))
    for row, (of, pair, _) in enumerate(_OF_TWO):
        first, second = (_AT[_own(motion)] for motion in pair)
        whole[row, _AT[of], first, second] += 1
        whole[row, _AT[of], second, first] += 1
    whole = whole.reshape(len(_OF_TWO), -1)
    places = np.flatnonzero(whole.any(axis=0))
    return places, whole[:, places]


_PLACES, _SHARES = _scatter()


def _curvature(length: Array, bent: dict[str, Array], torsion: Distortion) -> Array:
    """H (e, s, q, q) of beams, of whose translations across the shares `bent` (e,) are of bending."""
    n = len(_NAMES)
    flat = zeros((len(length), len(_AT) * n * n), length, *bent.values(), torsion.polar)
    flat[:, _PLACES] = _TWO.sizes(length, bent) @ _SHARES
    H = flat.reshape(len(length), len(_AT), n, n)
    H[:, 0] += (torsion.polar / length)[:, None, None] * H[:, _AT["w0"]]
    w = torsion.Z.shape[-1]
    if not w:
        return H
    whole = zeros((len(length), len(_AT) + w, n + w, n + w), H)
    whole[:, :n, :n, :n], whole[:, n + w :, :n, :n] = H[:, :n], H[:, n:]
    return whole


def _stiffness(k: Array, length: Array, torsion: Distortion) -> Array:
    """k (e, s, s) by all strains from that by those of the pose (e, 6, 6)."""
    n, w, warps = len(_NAMES), torsion.Z.shape[-1], np.flatnonzero(torsion.place)
    stiffness = np.zeros((len(k), len(_AT) + w, len(_AT) + w), like=k)
    stiffness[:, :6, :6] = k
    for name, of, degree in (("a", 3, 1), ("b", 3, 2), ("c2", 4, 2), ("c3", 5, 2)):
        stiffness[:, _AT[name], _AT[name]] = k[:, of, of] * EVEN[degree]
    if len(warps):
        twist = [*range(8), *range(n, n + w)]
        stiffness[np.ix_(warps.tolist(), twist, twist)] = _warping_stiffness(k[warps], torsion.taken(warps))
    for degree in range(len(_WAGNER)):
        at = n + w + degree
        stiffness[:, at, at] = torsion.wagner / (length**3 * (2 * degree + 1))
    return stiffness


def _warping_stiffness(k: Array, torsion: Distortion) -> Array:
    """Stiffness (e, 8 + w, 8 + w) by the pose, a and b and the rates of warping at the ends of elements, which have
    k (e, 6, 6) under a constant torque (theory eqs. G22, G36-G37).

    A torque t0 + t1 P1 + t2 P2 does work on phi, a/3, b/5, the means of the rate of twist with these polynomials. What
    k has beyond the element itself, as of roots, is in series with it.
    """
    e, w, twist, share = len(k), torsion.Z.shape[-1], [3, 6, 7], np.append(np.ones(6), EVEN[1:])
    own, A, B = torsion.stiffness[:, None, None], torsion.A, torsion.B
    C, whole = zeros((e, 8, 8), k, own, A), zeros((e, 8 + w, 8 + w), k, own, A, B)
    C[:, :6, :6] = np.linalg.inv(k)
    C[np.ix_(range(e), twist, twist)] += A / own
    C[:, 3, 3] -= torsion.mean / torsion.stiffness
    inverse: Any = np.linalg.inv(C)
    by_ends = inverse[:, :, twist] @ B
    whole[:, :8, :8] = share[:, None] * inverse * share
    whole[:, :8, 8:] = -share[:, None] * by_ends
    whole[:, 8:, :8] = np.swapaxes(whole[:, :8, 8:], 1, 2)
    whole[:, 8:, 8:] = own * torsion.Z + np.swapaxes(B, 1, 2) @ by_ends[:, twist]
    return (whole + np.swapaxes(whole, 1, 2)) / 2


def _bowing(length: Array, bent: dict[str, Array], torsion: Distortion) -> Bowing:
    """What keeps elements flat across, of whose translations across the shares `bent` (e,) are of bending."""
    size = len(_AT) + torsion.Z.shape[-1]
    rows = zeros((len(length), len(POINTS), 2, size), length, *bent.values())
    about_y, second = torsion.plane == 0, (3 * POINTS**2 - 1) / 2
    rows[:, :, 1, [_AT[name] for name in ("phi", "a", "b")]] = np.stack([POINTS**0, POINTS, second], axis=-1)
    for here, theta, across, sign, inner in ((about_y, "theta2", "s3", 6, "c2"), (~about_y, "theta3", "s2", -6, "c3")):
        rows[here, :, 0, _AT[theta]], rows[here, :, 0, _AT[inner]] = 1.0, second
        rows[here, :, 0, _AT[across]] = (sign * bent[across] / length)[here, None] * POINTS
    plate, nu, searle, free = np.moveaxis(torsion.bow, -1, 0)
    return Bowing(plate / length, nu, searle / length**2, free[:, None] * np.ones(len(POINTS)), rows)


def linear_strain(k: Array) -> Strain:
    """Strains d of elements with natural stiffness k (e, 6, 6): springs, and whatever else is known at rest alone."""
    e, none = len(k), np.zeros(len(k))
    flat = Bowing(none, none, none, np.zeros((e, len(POINTS))), np.zeros((e, len(POINTS), 2, 6)))
    place = np.zeros(e, dtype=np.intp)
    return Strain(k, np.zeros((e, 6, 6, 6)), np.ones((e, 3)), np.zeros((e, len(_OF_NEXT))), place, flat)
