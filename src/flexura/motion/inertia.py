"""What accelerates masses that turn: momentum and its change, gyroscopic terms included."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.beam import skew

YZX, ZXY = np.array([1, 2, 0]), np.array([2, 0, 1])


def accelerating(
    mass: Array, axes: Array, arm: Array, turning: Array, velocity: Array, acceleration: Array
) -> tuple[Array, float]:
    """Forces (e, 6k) on frames that accelerate masses (e, 6k, 6k), and their kinetic energy, N m.

    Masses act on the velocities of ends at arms (e, p, 3), m, global axes, from the first p of the k frames, and of the
    amplitudes in the others, in `axes` (e, 3, 3), whose rate of turning is that of the ends by weights `turning` (p,).
    `velocity` and `acceleration` (e, k, 6) are those of the frames, global axes. These are Lagrange's equations for
    velocities that are no derivatives (theory eq. G33).
    """
    e, k = velocity.shape[:2]
    p = arm.shape[1]
    placed, rate = slice(0, p), velocity[:, :p, 3:]
    back, mean = np.swapaxes(axes, -1, -2)[:, None], skew(turning @ rate)[:, None].swapaxes(-1, -2)
    reach = skew(arm)
    swing = -_by(reach, rate)
    v, a = (own.reshape(e, k, 2, 3).copy() for own in (velocity, acceleration))
    v[:, placed, 0] += swing
    a[:, placed, 0] += _by(skew(rate), swing) - _by(reach, acceleration[:, :p, 3:])
    a[:, placed] -= v[:, placed] @ mean
    own = np.stack([v, a], axis=-1)
    own[:, placed] = back[:, None] @ own[:, placed]
    found = (mass @ own.reshape(e, 6 * k, 2)).reshape(e, k, 2, 3, 2)
    kinetic = 0.5 * float(np.vdot(found[..., 0], own[..., 0]))
    found[:, placed] = axes[:, None, None] @ found[:, placed]
    momentum, force = found[:, placed, ..., 0], found[..., 1].copy()
    force[:, placed] += momentum @ mean
    turned = _products(momentum, v[:, placed])
    force[:, placed, 1] += turned[:, :, 1] - turning[:, None] * turned.sum(axis=(1, 2))[:, None]
    force[:, placed, 1] += _by(reach, force[:, placed, 0])
    return force.reshape(e, 6 * k), kinetic


def _by(matrices: Array, vectors: Array) -> Array:
    return (matrices @ vectors[..., None])[..., 0]


def _products(a: Array, b: Array) -> Array:
    """Vector products along the last axis, quicker than those of NumPy where there are few."""
    return a[..., YZX] * b[..., ZXY] - a[..., ZXY] * b[..., YZX]
