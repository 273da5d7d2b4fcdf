"""Steady-state Kalman filters of sampled models: noise over a step, gains by the discrete Riccati equation, proof.

Estimates are of the next sample, from what is read up to this one (theory eqs. X10-X13).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.errors import SolverError

NODES = 12
"""Points of Gauss's rule within a step that is no longer than the fastest motion."""

LOST = 1e-6
"""Relative difference from the covariance by Lyapunov's equation from which digits are lost."""


class Noise(NamedTuple):
    """Covariances of a step: of states (n, n), of readings (p, p), and between them (n, p)."""

    process: Array
    reading: Array
    cross: Array


class Kalman(NamedTuple):
    """Gain (n, p) of x+ = A x + B u + gain (y - C x - D u), the covariance (n, n) of what it is off by, and the
    relative difference of that from the covariance by Lyapunov's equation of the filter with this gain."""

    gain: Array
    covariance: Array
    mismatch: float


def covariance_of_step(A: Array, B: Array, W: Array, dt: float) -> Array:
    """Integral (n, n) of e^(A t) B W B' e^(A' t) over a step, s, of a continuous A (n, n) that white noise of intensity
    W (m, m) drives by B (n, m), by Gauss's rule and doubling: a sum of positive semidefinite terms."""
    n = len(A)
    even, (scale, _) = la.matrix_balance(A, permute=False, separate=True)
    doublings = max(int(np.ceil(np.log2(max(np.linalg.norm(even, 1) * dt, 1.0)))), 0)
    h, drive = dt / 2**doublings, B / scale[:, None]
    x, w = np.polynomial.legendre.leggauss(NODES)
    Q = np.zeros((n, n))
    for node, weight in zip(h * (x + 1) / 2, h * w / 2, strict=True):
        part: Any = la.expm(even * node) @ drive
        Q += weight * (part @ W @ part.T)
    E: Any = la.expm(even * h)
    for _ in range(doublings):
        Q, E = Q + E @ Q @ E.T, E @ E
    return np.outer(scale, scale) * Q


def kalman(A: Array, C: Array, noise: Noise) -> Kalman:
    """The filter of a discrete A (n, n) read by C (p, n) (Anderson and Moore 1979; Arnold and Laub 1984).

    Raises SolverError where there is none, or where its digits are lost.
    """
    root = np.linalg.cholesky(noise.reading)
    T = _sizes(noise.process)
    a, c = A * T / T[:, None], la.solve_triangular(root, C * T, lower=True)
    q = noise.process / np.outer(T, T)
    s = la.solve_triangular(root, (noise.cross / T[:, None]).T, lower=True).T
    one = np.eye(len(C))
    try:
        P: Any = la.solve_discrete_are(a.T, c.T, q, one, s=s)
        gain = np.linalg.solve(c @ P @ c.T + one, (a @ P @ c.T + s).T).T
        left = a - gain @ c
        driven = q - gain @ s.T - s @ gain.T + gain @ gain.T
        other: Any = la.solve_discrete_lyapunov(left, (driven + driven.T) / 2)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise SolverError(f"there is no filter that settles: {error}") from None
    apart = float(np.abs(other - P).max() / np.abs(P).max())
    if not (apart < LOST and np.abs(la.eigvals(left)).max() < 1):
        raise SolverError(f"round-off changes the covariance of the estimate by {apart:.1g}: keep fewer modes")
    whole = (T[:, None] * la.solve_triangular(root.T, gain.T, lower=False).T, np.outer(T, T) * (P + P.T) / 2)
    return Kalman(*whole, apart)


def _sizes(process: Array) -> Array:
    """Sizes of states by the noise that a step brings them; that of the largest for those that get none."""
    size = np.sqrt(np.maximum(process.diagonal(), 0.0))
    return np.where(size > 1e-12 * size.max(), size, size.max() or 1.0)
