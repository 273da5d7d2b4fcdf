"""Poses and twists: exponential and logarithm of SE(3), and the derivative of the logarithm.

A pose is a rotation R (..., 3, 3) with a position x (..., 3). A twist (..., 6) is a translation, m, then a rotation,
rad. Written as 4 x 4 matrices, twists have the bracket [a, b] = ad(a) b with

    ad(v, w) = [[skew w, skew v], [0, skew w]],                                                       (theory eq. G1)

Equations after Selig (2005), Geometric fundamentals of robotics, secs. 4.4 and 7.5, and Sonneville, Cardona, Bruls
(2014), Comput. Methods Appl. Mech. Engrg. 268.
"""

from __future__ import annotations

import math

import numpy as np

from flexura.arrays import Array
from flexura.beam import skew
from flexura.duals import plain, real, zeros

BERNOULLI = np.array(
    [1.0, 1 / 6, -1 / 30, 1 / 42, -1 / 30, 5 / 66, -691 / 2730, 7 / 6, -3617 / 510, 43867 / 798, -174611 / 330]
)
"""Bernoulli's numbers B0, B2, ... B20; later ones follow from the zeta function, which is 1 to double precision."""

ZERO_ANGLE = 1e-150
"""Angles below are zero."""

_AXIAL = np.column_stack([skew(np.eye(3)).reshape(3, 9).T, np.eye(3).ravel()]) / 2
"""Entries (9, 4) of a rotation that make the sine of its angle times its axis, and half its trace."""

LARGEST_ROTATION = 0.9 * math.pi
"""Largest rotation, rad, whose logarithm is taken."""


def ad(e: Array) -> Array:
    """Return ad(e) (..., 6, 6) of twists (..., 6)."""
    out = np.zeros((*e.shape, 6), like=e)
    out[..., :3, :3] = out[..., 3:, 3:] = skew(e[..., 3:])
    out[..., :3, 3:] = skew(e[..., :3])
    return out


def _sinc(angle: Array) -> Array:
    """Sines of angles over these."""
    some = angle > 0
    return np.where(some, np.sin(angle) / np.where(some, angle, 1.0), 1.0)


def rotation(w: Array) -> Array:
    """Return the rotations exp(skew w) (..., 3, 3) of rotation vectors (..., 3), rad (Rodrigues)."""
    square = np.einsum("...i,...i->...", w, w)
    half = np.sqrt(square) / 2
    sinc, W = _sinc(half), skew(w)
    return np.eye(3) + (sinc * np.cos(half))[..., None, None] * W + (sinc * sinc / 2)[..., None, None] * (W @ W)


def exponential(e: Array) -> tuple[Array, Array]:
    """Return the poses, R (..., 3, 3) and x (..., 3), whose logarithms are twists (..., 6)."""
    w = e[..., 3:]
    square = np.einsum("...i,...i->...", w, w)
    half = np.sqrt(square) / 2
    half_sinc, W = _sinc(half), skew(w)
    # (angle - sin angle)/angle^3 as a series where it would be lost in round-off
    with np.errstate(divide="ignore", invalid="ignore"):
        direct = (1 - _sinc(2 * half)) / square
    third = np.where(square < 1e-3, 1 / 6 - square / 120 + square**2 / 5040 - square**3 / 362880, direct)
    V = np.eye(3) + (half_sinc * half_sinc / 2)[..., None, None] * W + third[..., None, None] * (W @ W)
    return rotation(w), (V @ e[..., :3, None])[..., 0]


def rotation_vector(R: Array) -> Array:
    """Return the rotation vectors (..., 3), rad, of rotations (..., 3, 3) by less than half a turn."""
    both = R.reshape(*R.shape[:-2], 9) @ _AXIAL
    w = both[..., :3]
    sine = np.sqrt(np.einsum("...i,...i->...", w, w))
    angle = np.arctan2(sine, both[..., 3] - 0.5)
    return w * (np.maximum(angle, ZERO_ANGLE) / np.maximum(sine, ZERO_ANGLE))[..., None]


def _even_coefficients(n: int) -> Array:
    """Coefficients (n, 4) of the powers of -angle^2 in c2, c4 and their derivatives by that square.

    The even part of z/(1 - exp(-z)) is F = sum f_k z^2k, f_k = B_2k/(2k)!. As ad (ad^2 + angle^2)^2 = 0, F(ad) is
    1 + c2 ad^2 + c4 ad^4 with c2 = sum (2 - k) f_k y^(k - 1), k >= 1, c4 = sum (k - 1) f_k y^(k - 2), k >= 2, and
    y = -angle^2 (Hermite interpolation at y).
    """
    k = np.arange(n + 3)
    f = np.array([_even(int(j)) for j in k])
    powers = np.arange(n)
    c2 = (2 - (powers + 1)) * f[powers + 1]
    c4 = (powers + 1) * f[powers + 2]
    out = np.zeros((n, 4))
    out[:, 0], out[:, 1] = c2, c4
    out[:-1, 2], out[:-1, 3] = powers[1:] * c2[1:], powers[1:] * c4[1:]
    return out


def _even(k: int) -> float:
    """B_2k/(2k)!."""
    if k < len(BERNOULLI):
        return BERNOULLI[k] / math.factorial(2 * k)
    return (-1) ** (k + 1) * 2 / (2 * math.pi) ** (2 * k) * (1 + 2.0 ** (-2 * k))


_ONE = np.eye(6)
SERIES = _even_coefficients(32)
"""Those of as many powers as the largest rotation needs."""

_RATIO = (2 * math.pi) ** 2


def _coefficients(angle_square: Array) -> Array:
    """c2, c4 and their derivatives by y = -angle^2, (..., 4); as many terms as the largest angle needs."""
    largest = float(plain(angle_square).max(initial=0.0))
    terms = 4 if largest < 1e-6 else min(len(SERIES), 3 + math.ceil(40 / math.log(_RATIO / largest)))
    powers = np.ones((*angle_square.shape, terms), like=real(angle_square))
    powers[..., 1:] = -angle_square[..., None]
    return np.cumprod(powers, axis=-1) @ SERIES[:terms]


class Logarithm:
    """The logarithm e (..., 6) of relative poses, with the derivatives that forces and tangents need.

    For a pose of end 2 seen from end 1, and twists h1, h2 of the ends in their own axes,

        de = after h2 - before h1,   after = I + ad/2 + c2 ad^2 + c4 ad^4,   before = after - ad     (theory eq. G4)

    Source: the inverse of the right and left Jacobians (Selig 2005, sec. 4.5), in closed form.
    """

    def __init__(self, R: Array, x: Array) -> None:
        w = rotation_vector(R)
        square = np.einsum("...i,...i->...", w, w)
        self._c = _coefficients(square)
        W = skew(w)
        # V^-1 = I - skew(w)/2 + c skew(w)^2 with c = c2 - c4 angle^2
        across = W @ x[..., None]
        v = x - 0.5 * across[..., 0] + (self._c[..., 0] - self._c[..., 1] * square)[..., None] * (W @ across)[..., 0]
        self.e: Array = np.concatenate([v, w], axis=-1)
        """Twists (..., 6): m and rad."""
        self._A = ad(self.e)
        self._A2 = self._A @ self._A
        c2, c4 = self._c[..., 0, None, None], self._c[..., 1, None, None]
        even = _ONE + c2 * self._A2 + c4 * (self._A2 @ self._A2)
        self.after: Array = even + self._A / 2
        """(..., 6, 6), of the twist of end 2."""
        self.before: Array = even - self._A / 2
        """(..., 6, 6), of the twist of end 1; negative in the derivative."""

    def second(self, n: Array) -> tuple[Array, Array]:
        """Derivatives (..., 6, 6) by e of before' n and after' n, n (..., 6) fixed, conjugate to e (theory eq. G6)."""
        At, At2 = np.swapaxes(self._A, -1, -2), np.swapaxes(self._A2, -1, -2)
        powers = zeros((4, *n.shape), n, At)
        powers[0], powers[1] = n, (At @ n[..., None])[..., 0]
        powers[2:] = (At2 @ powers[:2, ..., None])[..., 0]
        n4 = (At2 @ powers[2, ..., None])[..., 0]
        m0, m1, m2, m3 = co_ad(powers)
        c2, c4, d2, d4 = (self._c[..., i, None] for i in range(4))
        first = At @ m0 + m1
        even = c2[..., None] * first + c4[..., None] * (At2 @ first + At @ m2 + m3)
        slope = -2 * (d2 * powers[2] + d4 * n4)
        even[..., 3:] += slope[..., None] * self.e[..., None, 3:]
        half = m0 / 2
        return even - half, even + half


def co_ad(n: Array) -> Array:
    """Return the matrices N (..., 6, 6) for which ad(d)' n = N d for all d, of n (..., 6): (w x v)-like pairs.

    ad(v, w)' (p, q) = (-w x p, -v x p - w x q) = (p x w, p x v + q x w).
    """
    out = np.zeros((*n.shape, 6), like=n)
    P = skew(n[..., :3])
    out[..., :3, 3:] = out[..., 3:, :3] = P
    out[..., 3:, 3:] = skew(n[..., 3:])
    return out
