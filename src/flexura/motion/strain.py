"""What the pose of one end of an element, seen from the other, does to it: strains that are quadratic in that pose.

With d the change of the logarithm of the relative pose, and amplitudes z of motions inside the element, the energy is
e'ke/2 of the strains e = q + q'Hq/2, q = (d, z), at the z that makes it least. k is the stiffness that the element has
at rest, whatever its theory. H follows from a uniform beam; it ends what makes straight elements converge slowly:
bending shortens, bending across a bent plane twists, and the twist varies within the element.

d = (u, s2, s3, phi, theta2, theta3): translations along and across the element, m, and rotations, rad.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexura.motion.se3 import Logarithm
from flexura.structure import Torsion

Array = NDArray[np.float64]

ITERATIONS = 6
"""Most steps of Newton's method for the motions inside elements, which are small of second order."""

SETTLED = 1e-9
"""Largest last step of these, rad, whose effect on forces is of its square."""

_NAMES = ("u", "s2", "s3", "phi", "theta2", "theta3", "a", "b", "c2", "c3")
_WAGNER = ("w0", "w1", "w2")
"""Strains of fibres by twist, beside those that motions have of first order."""

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


@dataclass(frozen=True)
class Strain:
    """Quadratic strains q + q'Hq/2 of elements: `stiffness` k (e, s, s) and `curvature` H (e, s, q, q), q of 6 or more.

    What q has beyond 6 moves inside the element; strains beyond those of q have no part of first order.
    """

    stiffness: Array
    curvature: Array

    def response(self, d: Array) -> tuple[Array, Array, Array]:
        """Energy (e,), N m, its gradient (e, 6) and Hessian (e, 6, 6) by d (e, 6), inner motions at rest."""
        _, energy, gradient, hessian, inner = self._settled(d)
        coupled = hessian[:, :6, 6:]
        gradient = gradient[:, :6] - (coupled @ inner[..., :1])[..., 0]
        return energy, gradient, hessian[:, :6, :6] - coupled @ inner[..., 1:]

    def _settled(self, d: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Motions q (e, q) with those inside at rest, energy, gradient and Hessian there, and what the motions inside
        still lack and how they follow those of the ends, (e, q - 6, 7), negative."""
        q = np.zeros((len(d), self.curvature.shape[-1]))
        q[:, :6] = d
        for _ in range(ITERATIONS):
            energy, gradient, hessian = self._derivatives(q)
            both = np.concatenate([gradient[:, 6:, None], hessian[:, 6:, :6]], axis=-1)
            inner = np.asarray(np.linalg.solve(hessian[:, 6:, 6:], both), dtype=float)
            if np.abs(inner[..., 0]).max(initial=0.0) < SETTLED:
                break
            q[:, 6:] -= inner[..., 0]
        return q, energy, gradient, hessian, inner

    def material(self, d: Array) -> Array:
        """The part (e, 6, 6) of the Hessian that stiffness makes and not the forces, inner motions at rest."""
        slope = self._slope(self._settled(d)[0])
        own = np.swapaxes(slope, 1, 2) @ (self.stiffness @ slope)
        coupled = own[:, :6, 6:]
        return own[:, :6, :6] - coupled @ np.linalg.solve(own[:, 6:, 6:], np.swapaxes(coupled, 1, 2))

    def _slope(self, q: Array) -> Array:
        """Derivatives (e, s, q) of the strains."""
        e, m, n, _ = self.curvature.shape
        return (q[:, None] @ self._by_motion).reshape(e, m, n) + np.eye(m, n)

    @cached_property
    def _by_motion(self) -> Array:
        """Derivatives (e, q, s q) of the slope by each motion, side by side in memory."""
        e, m, n, _ = self.curvature.shape
        return np.ascontiguousarray(np.moveaxis(self.curvature, -1, 1)).reshape(e, n, m * n)

    def _derivatives(self, q: Array) -> tuple[Array, Array, Array]:
        """Energy (e,), gradient (e, q) and Hessian (e, q, q) by all motions."""
        e, m, n, _ = self.curvature.shape
        slope = self._slope(q)
        strain = 0.5 * (slope @ q[..., None])[..., 0]
        strain[:, :n] += 0.5 * q
        stress = (self.stiffness @ strain[..., None])[..., 0]
        turned = np.swapaxes(slope, 1, 2)
        hessian = turned @ (self.stiffness @ slope)
        hessian += (stress[:, None] @ self.curvature.reshape(e, m, n * n)).reshape(e, n, n)
        return 0.5 * np.einsum("en,en->e", strain, stress), (turned @ stress[..., None])[..., 0], hessian


def natural_stiffness(K: Array, rest: Logarithm) -> Array:
    """Return k (e, 6, 6) by the relative pose of end 2, from K (e, 12, 12) by the displacements of both ends.

    Displacements are in the axes of the ends, as the logarithm of the pose at rest takes them. With end 1 held,
    h2 = after^-1 de, so that k is K of end 2 between these (theory eq. G8).
    """
    J = np.linalg.inv(rest.after)
    k = np.swapaxes(J, -1, -2) @ K[..., 6:, 6:] @ J
    return (k + np.swapaxes(k, -1, -2)) / 2


def beam_strain(k: Array, length: Array, torsion: Torsion) -> Strain:
    """Strains of beam elements with natural stiffness k (e, 6, 6) and lengths (e,), m.

    Products follow from Magnus' expansion of the relative pose (Blanes, Casas, Oteo, Ros 2009, Phys. Rep. 470, sec. 2)
    of a beam whose bending moments are linear and whose twist and curvatures vary besides as Legendre polynomials:
    a and b of degree 1 and 2 in the twist, c2 and c3 of degree 2 in the curvatures (theory eqs. G9-G12).
    """
    count, n, m = len(k), len(_NAMES), len(_NAMES) + len(_WAGNER)
    at = {name: i for i, name in enumerate((*_NAMES, *_WAGNER))}
    bent = {
        f"s{i + 1}": np.minimum(k[:, i, i] * length**2 / (12 * k[:, theta, theta]), 1.0)
        for i, theta in ((1, 5), (2, 4))
    }
    H = np.zeros((count, m, n, n))
    for of, *pair, factor in _SECOND_ORDER:
        size = factor * (length if at[of] < 3 else np.ones(count))
        motions = []
        for name in pair:
            motion = name.replace("h", "s") if name in ("h2", "h3") else name
            if motion in bent:
                size = size * (bent[motion] if name == motion else 1 - bent[motion])
            motions.append(at[motion])
            size = size / length if at[motion] < 3 else size
        first, second = motions
        H[:, at[of], first, second] += size
        H[:, at[of], second, first] += size
    for of, first, second, factor in _OF_TWIST:
        H[:, at[of], at[first], at[second]] += factor
        H[:, at[of], at[second], at[first]] += factor
    H[:, 0] += (torsion.polar / length)[:, None, None] * H[:, at["w0"]]
    stiffness = np.zeros((count, m, m))
    stiffness[:, :6, :6] = k
    for name, of in (("c2", 4), ("c3", 5)):
        stiffness[:, at[name], at[name]] = k[:, of, of] / 5
    twist = [at[name] for name in ("phi", "a", "b")]
    stiffness[np.ix_(range(count), twist, twist)] = _twist_stiffness(k[:, 3, 3], torsion.moments)
    for degree, name in enumerate(_WAGNER):
        stiffness[:, at[name], at[name]] = torsion.wagner / (length**3 * (2 * degree + 1))
    return Strain(stiffness, H)


def _twist_stiffness(k: Array, moments: Array) -> Array:
    """Stiffness (e, 3, 3) by phi, a and b of elements with stiffness k (e,) under constant torque (theory eq. G22).

    A torque t0 + t1 P1 + t2 P2 does work on phi, a/3, b/5, the means of the rate of twist with these polynomials, so
    that their compliance is that of the products, by `moments` (e, 4) of single polynomials.
    """
    one, two, three, four = moments.T
    c = np.empty((len(k), 3, 3))
    c[:, 0, 0], c[:, 1, 1], c[:, 2, 2] = 1.0, (1 + 2 * two) / 3, 1 / 5 + 2 / 7 * two + 18 / 35 * four
    c[:, 0, 1] = c[:, 1, 0] = one
    c[:, 0, 2] = c[:, 2, 0] = two
    c[:, 1, 2] = c[:, 2, 1] = (2 * one + 3 * three) / 5
    share = np.array([1.0, 1 / 3, 1 / 5])
    return k[:, None, None] * share[:, None] * np.linalg.inv(c) * share


def linear_strain(k: Array) -> Strain:
    """Strains d of elements with natural stiffness k (e, 6, 6): springs, and whatever else is known at rest alone."""
    return Strain(k, np.zeros((len(k), 6, 6, 6)))
