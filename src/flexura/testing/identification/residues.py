"""Shapes from poles and participation by linear least squares, and all of them together by non-linear ones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.errors import SolverError
from flexura.testing.measurement import ResponseMatrix, fraction, responses

MOST_FIT_STEPS = 30
"""Steps of the non-linear fit."""

SETTLED_FIT = 1e-10
"""The fit ends when a step lowers the misfit by less, relative."""

LEAST_STEP_DAMPING = 1e-12
"""Least damping of a step, relative to the curvature of each parameter: mixing repeated modes changes no misfit."""

UNDETERMINED_CURVATURE = 1e-11
"""Directions in which the misfit curves less, relative to the steepest, are not determined."""

UNDETERMINED_SHARE = 1e-3
"""Share of a pole in such directions with which it is not determined either."""

INDEPENDENT_REGRESSORS = 1e-10
"""Directions of the regressors that are smaller, relative to the largest, are not used."""


@dataclass(frozen=True)
class Fit:
    """Modes that fit a matrix: `poles` (n,), `participation` (m, n), `shapes` (p, n), residuals (p, m), all scaled.

    `lower` is over s^2 and `upper` is constant, in displacements. `pole_sigma` (n, 2) are standard deviations of real
    and imaginary part of the poles, 1/s, from the misfit, zero where not estimated. `error` is the relative misfit.
    """

    poles: Complex
    participation: Complex
    shapes: Complex
    lower: Array
    upper: Array
    synthesis: Complex
    pole_sigma: Array
    error: float

    def at(self, modes: Index) -> Fit:
        """Some modes of the fit."""
        sides = {"shapes": self.shapes[:, modes], "participation": self.participation[:, modes]}
        return replace(self, poles=self.poles[modes], pole_sigma=self.pole_sigma[modes], **sides)


@dataclass(frozen=True)
class _Spanned:
    """Everything over f lines as coordinates (k,) in an orthonormal basis of all functions of s that take part.

    `fractions` are 1 / (s - pole), the same of the conjugate poles, and their slopes by the pole, each (k, n);
    `constant` and `inverse` are 1 and s^-2, the latter of size one at the last line. `data` (2 k m, p) are real and
    imaginary coordinates of the responses; `outside` (m, p) are the squares of what lies across the basis. `count` is
    2 f m.
    """

    fractions: tuple[Complex, Complex, Complex, Complex]
    constant: Complex
    inverse: Complex
    data: Array
    outside: Array
    count: int


@dataclass(frozen=True)
class _Projected:
    """The part of the problem that is linear, solved: basis Q of the regressors, coefficients, remainder there."""

    span: _Spanned
    Q: Array
    coefficients: Array
    remainder: Array

    @property
    def misfit(self) -> float:
        return float(np.vdot(self.remainder, self.remainder) + self.span.outside.sum())


def fit_shapes(matrix: ResponseMatrix, poles: Complex, participation: Complex) -> Fit:
    """Shapes and residuals to given poles and participation (m, n) by linear least squares (theory eqs. I9, I10)."""
    participation = participation / np.linalg.norm(participation, axis=0)
    solved = _project(_spanned(matrix, poles), participation)
    return _result(matrix, poles, participation, solved, np.zeros((len(poles), 2)))


def fit_modes(matrix: ResponseMatrix, poles: Complex, participation: Complex) -> Fit:
    """Poles, participation, shapes and residuals by non-linear least squares (theory eqs. I10-I12).

    Variable projection (Golub and Pereyra 1973) with the simplification of Kaufman (1975), Levenberg-Marquardt steps.
    Raises SolverError when the lines are too few for the modes.
    """
    participation = participation / np.linalg.norm(participation, axis=0)
    f, p, m = matrix.response.shape
    if 2 * f * m * p - 2 * len(poles) * (p + m) - 2 * p <= 0:
        raise SolverError(f"{f} spectral lines do not determine {len(poles)} modes")
    solved = _project(_spanned(matrix, poles), participation)
    damping, still = 1e-3, float(matrix.s.real[0]) if matrix.step else 0.0
    for _ in range(MOST_FIT_STEPS):
        D, c = _derivatives(participation, solved)
        curvature = _gram(D, c)
        slope = np.einsum("kao,kao->k", c, (D.T @ solved.remainder).reshape(len(c), 2, -1))
        better = None
        while damping < 1e6:
            step = _step(curvature, slope, damping)
            trial = _moved(poles, participation, step)
            if (trial[0].real < still).all() and (trial[0].imag > 0).all():
                projected = _project(_spanned(matrix, trial[0]), trial[1])
                if projected.misfit <= solved.misfit:
                    better = projected
                    break
            damping *= 10
        if better is None:
            break
        gained = solved.misfit - better.misfit
        (poles, participation), solved = trial, better
        damping = max(damping / 10, 1e-9)
        if gained <= SETTLED_FIT * solved.misfit:
            break
    of_parts = None
    if matrix.parts is not None:
        of_parts = np.array([_spanned(replace(matrix, response=part), poles).data for part in matrix.parts])
    return _result(matrix, poles, participation, solved, _sigma(participation, solved, of_parts))


def _spanned(matrix: ResponseMatrix, poles: Complex) -> _Spanned:
    """Functions of s and weighted data in a basis of the functions, which is exact and as long as there are functions.

    By QR, so that nothing is squared; a step then costs no more for many lines than their factorisation.
    """
    f, p, m = matrix.response.shape
    n, root = len(poles), np.sqrt(matrix.weight)
    s = matrix.s[:, None]
    q = [fraction(matrix.s, poles, matrix.step), fraction(matrix.s, poles.conj(), matrix.step)]
    slopes = [one**2 - matrix.step**2 / 4 for one in q]
    functions = np.concatenate([*q, *slopes, np.ones_like(s), (np.abs(s).max() / s) ** 2], axis=1)
    Q, R = np.linalg.qr(functions * (root * matrix.s**matrix.power)[:, None])
    H = (matrix.scaled.transpose(0, 2, 1) * root[:, None, None]).reshape(f, -1)
    inside = Q.conj().T @ H
    outside = (np.abs(H - Q @ inside) ** 2).sum(axis=0).reshape(m, p)
    a, b, c, d = (R[:, k * n : (k + 1) * n] for k in range(4))
    return _Spanned((a, b, c, d), R[:, -2], R[:, -1], _real(inside.reshape(-1, p)), outside, 2 * f * m)


def _real(rows: Complex) -> Array:
    return np.concatenate([rows.real, rows.imag])


def _pairs(a: Complex, b: Complex) -> Array:
    """Real columns for real and imaginary part of a coefficient whose own factor is a, its conjugate's b (k, m, n)."""
    both = np.stack([a + b, 1j * (a - b)], axis=-1)
    return _real(both.reshape(a.shape[0] * a.shape[1], -1))


def _regressors(span: _Spanned, participation: Complex) -> Array:
    """Columns of the modes, two for each, and of upper and lower residuals of each input (2 k m, 2 n + 2 m)."""
    q, q_conj = (part[:, None, :] for part in span.fractions[:2])
    modes = _pairs(participation * q, participation.conj() * q_conj)
    eye = np.eye(len(participation))
    rest = [_real((one[:, None, None] * eye).reshape(len(modes) // 2, -1)) for one in (span.constant, span.inverse)]
    return np.concatenate([modes, *rest], axis=1)


def _project(span: _Spanned, participation: Complex) -> _Projected:
    columns = _regressors(span, participation)
    size = np.linalg.norm(columns, axis=0)
    U, S, Vt = np.linalg.svd(columns / size, full_matrices=False)
    is_used = INDEPENDENT_REGRESSORS * S[0] < S
    Q, S, Vt = U[:, is_used], S[is_used], Vt[is_used]
    along = Q.T @ span.data
    return _Projected(span, Q, (Vt.T @ (along / S[:, None])) / size[:, None], span.data - Q @ along)


def _derivatives(participation: Complex, solved: _Projected) -> tuple[Array, Array]:
    """Derivatives of two regressors by each of k parameters, projected (2 k m, 2 k), and their coefficients (k, 2, p).

    Parameters are real and imaginary parts of the poles (2, n), then of participation (2, m, n).
    """
    m, n = participation.shape
    q, q_conj, square, square_conj = (part[:, None, :] for part in solved.span.fractions)
    a, b = participation * square, participation.conj() * square_conj
    parts = [_pairs(a, b), _pairs(1j * a, -1j * b)]
    for unit in (1.0, 1j):
        for j in range(m):
            one = np.eye(m)[j][:, None]
            parts.append(_pairs(unit * one * q, np.conj(unit) * one * q_conj))
    D = np.concatenate(parts, axis=1)
    modal = solved.coefficients[: 2 * n].reshape(n, 2, -1)
    return D - solved.Q @ (solved.Q.T @ D), np.tile(modal, (2 + 2 * m, 1, 1))


def _gram(D: Array, c: Array) -> Array:
    """J^T J (k, k) of J = D c, which is never formed (theory eq. I12)."""
    flat = c.reshape(-1, c.shape[2])
    k = len(c)
    return np.einsum("kalb->kl", ((D.T @ D) * (flat @ flat.T)).reshape(k, 2, k, 2))


def _step(curvature: Array, slope: Array, damping: float) -> Array:
    size = np.sqrt(np.diag(curvature))
    size = np.where(size > 1e-12 * size.max(initial=0.0), size, np.inf)
    scaled = curvature / np.outer(size, size)
    return np.linalg.solve(scaled + max(damping, LEAST_STEP_DAMPING) * np.eye(len(scaled)), slope / size) / size


def _moved(poles: Complex, participation: Complex, step: Array) -> tuple[Complex, Complex]:
    n, m = len(poles), len(participation)
    real, imaginary = step[: 2 * n].reshape(2, n)
    turn = step[2 * n :].reshape(2, m, n)
    moved = participation + turn[0] + 1j * turn[1]
    return poles + real + 1j * imaginary, moved / np.linalg.norm(moved, axis=0)


def _sigma(participation: Complex, solved: _Projected, parts: Array | None) -> Array:
    """Standard deviations of real and imaginary part of the poles (n, 2), 1/s (theory eqs. I13, I31).

    Every response has the noise that its own misfit shows; with parts of the records (b, 2 k m, p), it is how far the
    fit would move by each of them.
    """
    n = participation.shape[1]
    D, c = _derivatives(participation, solved)
    curvature = _gram(D, c)
    spread = _spread_of_misfit(D, c, solved, len(participation)) if parts is None else _spread_of_parts(D, c, parts)
    size = np.sqrt(np.diag(curvature))
    size = np.where(size > 0, size, np.inf)
    values, vectors = np.linalg.eigh(curvature / np.outer(size, size))
    sharp = values > UNDETERMINED_CURVATURE * values[-1]
    inverse = (vectors * np.where(sharp, 1 / np.maximum(values, 1e-300), 0.0)) @ vectors.T
    covariance = np.diag(inverse @ (spread / np.outer(size, size)) @ inverse)[: 2 * n] / size[: 2 * n] ** 2
    loose = (vectors[: 2 * n, ~sharp] ** 2).sum(axis=1) > UNDETERMINED_SHARE
    return np.sqrt(np.where(loose, np.inf, np.maximum(covariance, 0.0))).reshape(2, n).T


def _spread_of_misfit(D: Array, c: Array, solved: _Projected, m: int) -> Array:
    """Covariance (k, k) of the slope of the misfit where each response has the noise that its misfit shows."""
    rows = np.arange(len(D)) % m
    spread = np.zeros((len(c), len(c)))
    freedom = (solved.span.count - solved.Q.shape[1]) / m
    for j in range(m):
        of_input = rows == j
        noise = ((solved.remainder[of_input] ** 2).sum(axis=0) + solved.span.outside[j]) / freedom
        spread += _gram(D[of_input], c * np.sqrt(noise))
    return spread


def _spread_of_parts(D: Array, c: Array, parts: Array) -> Array:
    """The same by the scatter of the slopes of b parts: that of their mean."""
    slopes = np.array([np.einsum("kao,kao->k", c, (D.T @ one).reshape(len(c), 2, -1)) for one in parts])
    return np.cov(slopes.T) / len(parts)


def _result(matrix: ResponseMatrix, poles: Complex, participation: Complex, solved: _Projected, sigma: Array) -> Fit:
    n, m = participation.shape[::-1]
    c = solved.coefficients
    shapes = (c[: 2 * n : 2] + 1j * c[1 : 2 * n : 2]).T
    upper, lower = c[2 * n : 2 * n + m].T, c[2 * n + m :].T * np.abs(matrix.s).max() ** 2
    H = responses(matrix.s, poles, shapes, participation, lower, upper, matrix.step)
    synthesis, data = H * matrix.s[:, None, None] ** matrix.power, matrix.scaled
    error = np.linalg.norm(data - synthesis) / np.linalg.norm(data)
    return Fit(poles, participation, shapes, lower, upper, synthesis, sigma, float(error))
