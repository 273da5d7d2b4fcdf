"""Poly-reference least squares of complex frequency responses: poles, participation and shapes at every model order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky, eig, solve_triangular, toeplitz

from flexura.arrays import Array, Complex
from flexura.errors import SolverError
from flexura.testing.measurement import ResponseMatrix


@dataclass(frozen=True)
class OrderPoles:
    """What one model order has: `poles` (r,), rad/s, ascending, `shapes` (p, r) and `participation` (m, r), scaled."""

    order: int
    poles: Complex
    shapes: Complex
    participation: Complex


@dataclass(frozen=True)
class _Normal:
    """Normal equations for the denominator, (n + 1) m square, and the numerator that belongs to it."""

    M: Array
    numerator: Array
    inputs: int


def poles_by_order(matrix: ResponseMatrix, order: int, most_damped: float) -> list[OrderPoles]:
    """Poles of a right matrix-fraction model in z = exp(i (omega - omega_0) dt), of every order up to `order`.

    theory eqs. I2-I6; Peeters, Van der Auweraer, Guillaume and Leuridan (2004), Shock and Vibration 11. The lowest
    coefficient of the denominator is fixed, so that poles which only follow noise come out unstable and are dropped, as
    are those outside the band or with a damping ratio above `most_damped`. Raises SolverError when the lines are too
    few for the order.
    """
    omega = matrix.s.imag
    start, dt = omega[0], np.pi / (omega[-1] - omega[0])
    normal = _normal_equations(matrix.scaled, matrix.weight, (omega - start) * dt, order)
    decay = matrix.s.real[0]
    found = []
    for n in range(1, order + 1):
        alpha = _denominator(normal, n)
        z, right, left = _zeros(alpha)
        with np.errstate(divide="ignore"):
            poles = np.log(z) / dt + 1j * start + decay
        own = (np.abs(z) < 1) & (z.imag > 0) & np.isfinite(poles)
        own &= (-poles.real > 0) & (-poles.real < most_damped * np.abs(poles))
        at = np.flatnonzero(own)[np.argsort(np.abs(poles[own]))]
        beta = np.tensordot(normal.numerator[:, :, : alpha.shape[0]], alpha, 1)
        powers = z[at] ** np.arange(order + 1)[:, None]
        shapes = np.einsum("ar,apm,mr->pr", powers, beta, right[:, at], optimize=True)
        found.append(OrderPoles(n, poles[at], shapes, left[:, at].conj()))
    return found


def _normal_equations(H: Complex, weight: Array, angle: Array, n: int) -> _Normal:
    """Normal equations with the numerators eliminated (theory eqs. I4, I5); all blocks are Toeplitz in the powers."""
    _, p, m = H.shape
    lags = np.exp(1j * angle * np.arange(-n, n + 1)[:, None]) * weight
    r = lags.real.sum(axis=1)
    S = -(lags @ H.reshape(len(angle), -1)).real.reshape(-1, p, m)
    T = (lags @ (H.conj().transpose(0, 2, 1) @ H).reshape(len(angle), -1)).real.reshape(-1, m, m)
    lag = np.arange(n + 1) - np.arange(n + 1)[:, None] + n
    try:
        R = cholesky(toeplitz(r[n:]), lower=True)
    except np.linalg.LinAlgError:
        raise SolverError(
            f"{len(angle)} spectral lines do not determine a model of order {n}; lower the order or widen the band"
        ) from None
    S = S[lag].transpose(0, 2, 1, 3).reshape(n + 1, -1)
    half = solve_triangular(R, S, lower=True).reshape(-1, (n + 1) * m)
    M = T[lag].transpose(0, 2, 1, 3).reshape((n + 1) * m, -1) - half.T @ half
    numerator = -cho_solve((R, True), S).reshape(n + 1, p, (n + 1) * m)
    return _Normal((M + M.T) / 2, numerator, m)


def _denominator(normal: _Normal, n: int) -> Array:
    """Coefficients (n + 1) m x m of the denominator, the lowest of them the identity (theory eq. I5)."""
    m = normal.inputs
    size = (n + 1) * m
    M, b = normal.M[m:size, m:size], -normal.M[m:size, :m]
    try:
        alpha = np.linalg.solve(M, b)
    except np.linalg.LinAlgError:
        alpha = np.linalg.lstsq(M, b)[0]
    return np.concatenate([np.eye(m), alpha]).astype(np.float64)


def _zeros(alpha: Array) -> tuple[Complex, Complex, Complex]:
    """z at which the denominator is singular (r,), with its right and left null vectors (m, r) (theory eq. I6)."""
    m = alpha.shape[1]
    size = len(alpha) - m
    companion = np.eye(size, k=-m)
    companion[:m] = -alpha[m:].reshape(-1, m, m).transpose(1, 0, 2).reshape(m, size)
    x, left, right = (np.asarray(part, dtype=np.complex128) for part in eig(companion, left=True, right=True))
    with np.errstate(divide="ignore", invalid="ignore"):
        return 1 / x, right[-m:], left[:m]
