"""Eigenvalue problems of other kinds: of a nonlinear T(z) x = 0, and factors at which K + factor K_g is singular.

T is holomorphic inside an ellipse around a real interval, but for poles whose number is known. Moments of its inverse
along the ellipse hold the eigenvalues inside (Beyn 2012, algorithm 1), the winding of det T along it their number; each
is then refined to working accuracy by linearisation, copies of a repeated one together. None inside is missed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse.linalg as spla

from flexura.arrays import Array, Complex
from flexura.errors import SolverError
from flexura.linalg.bounds import count_below
from flexura.linalg.factor import DENSE_LIMIT, Matrix, factorise, is_definite
from flexura.linalg.pencil import scaled, toarray, unit_scale
from flexura.thresholds import REPEATED_EIGENVALUES

MatrixFunction = Callable[[complex], Any]
"""T(z), (n, n), real for real z."""

CONTOUR_NODES = 96
"""Points of the trapezoidal rule on the whole ellipse."""

CONTOUR_FLATNESS = 0.5
"""Imaginary over real semi-axis of the ellipse."""

MOMENT_RANK = 1e-13
"""Relative size of a singular value of the moments that counts as zero."""

SLOPE_STEP = 1e-6
"""Relative step of the difference quotient that stands for dT/dz."""

IMAGINARY_STEP = 1e-10
"""Relative step along the imaginary axis, whose square is below round-off."""

LAST_DIGIT = 1e-13
"""Relative step off an eigenvalue that is met to the last digit."""

NEWTON_SETTLED = 1e-9
"""Relative change at which a refined eigenvalue is accepted; the linearisation is then exact to its square."""

STRAY = 0.05
"""Relative distance beyond which a starting value belongs to no eigenvalue."""

DENSE_BUCKLING = 1200
"""Up to this order several buckling loads come from a dense solver, which misses no copies."""

LANCZOS_BASIS = 30
"""Vectors of Lanczos' method beyond two for each factor."""

FACTOR_ERROR = 1e-8
"""Relative error of factors that Lanczos' method finds: neighbours may be close."""

FACTOR_STRIDE = 16
"""Ratio of factors that are tried one after another."""

SHAPE_RESIDUAL = 1e-5
"""Forces that a buckling shape leaves, relative to those of the stiffness, diagonals scaled to one."""

BUCKLING_ROUNDING = 1e-8
"""Relative size of an eigenvalue of K_g beside K that is round-off: a load that buckles nothing."""


def real_eigenvalues(
    problem: MatrixFunction, low: float, high: float, guesses: Array, *, poles: int = 0, is_real: bool = True
) -> Array:
    """All eigenvalues of T(z) x = 0 in [low, high], ascending, repeated ones repeated.

    `guesses` are tried besides the values that the moments give, since entries of T that spread over decades can hide
    an eigenvalue from these. The number of eigenvalues is that of the winding of det T, less its `poles` inside; it is
    met, or the search goes on with more points. `is_real` says that T is real for real z, which halves the work. Raises
    SolverError when the number is not met.
    """
    search = _ContourSearch(problem, low, high, is_real)
    probes = len(guesses) + 8
    seeds = np.asarray(guesses, dtype=float)
    for nodes in (CONTOUR_NODES, 2 * CONTOUR_NODES, 4 * CONTOUR_NODES):
        values, count = search.moments(probes, nodes)
        while values is None:
            probes *= 2
            values, count = search.moments(probes, nodes)
        radius = search.radius
        inside = values[(np.abs(values.real - search.centre) < radius) & (np.abs(values.imag) < 1e-2 * radius)].real
        if count + poles == len(guesses):
            # two counts that know nothing of each other agree: no need to try starting values beyond that number
            refined = search.refined(np.sort(np.concatenate([inside, seeds])), len(guesses))
            if len(refined) == count + poles:
                return refined
        starts = [inside, *(search.nearby(float(z)) for z in [*inside, *seeds])]
        refined = search.refined(np.sort(np.concatenate(starts)))
        if len(refined) == count + poles:
            return refined
        seeds = np.concatenate([guesses, np.linspace(low, high, nodes // 4)])
    raise SolverError(f"the contour between {low:.6g} and {high:.6g} did not separate its {count} eigenvalues")


class _ContourSearch:
    """T(z), balanced, on an ellipse around [low, high]."""

    def __init__(self, problem: MatrixFunction, low: float, high: float, is_real: bool) -> None:
        self.low, self.high, self.is_real = low, high, is_real
        self.centre, self.radius = (low + high) / 2, (high - low) / 2
        # rows and columns are scaled so that the largest entry of each is about one at one point (Ruiz 2001)
        A = np.abs(problem(self.centre + 0.3j * self.radius))
        row, column = np.ones(len(A)), np.ones(len(A))
        for _ in range(12):
            scaled = A * row[:, None] * column
            row /= np.sqrt(np.maximum(scaled.max(axis=1), 1e-300))
            column /= np.sqrt(np.maximum(scaled.max(axis=0), 1e-300))
        self.T: MatrixFunction = lambda z: problem(z) * row[:, None] * column

    def moments(self, probes: int, nodes: int) -> tuple[Complex | None, int]:
        """Eigenvalues inside the ellipse from the first two moments, None when there are as many as probes; and their
        number from the winding of det T."""
        phases, A0, A1 = [], None, None
        for k in range(nodes // 2 if self.is_real else nodes):
            angle = 2 * np.pi * (k + 0.5) / nodes
            z = self.centre + self.radius * (np.cos(angle) + 1j * CONTOUR_FLATNESS * np.sin(angle))
            weight = self.radius * (CONTOUR_FLATNESS * np.cos(angle) + 1j * np.sin(angle)) / nodes
            T = self.T(z)
            phases.append(np.angle(np.linalg.slogdet(T)[0]))
            if A0 is None:
                probe = np.random.default_rng(5).normal(size=(len(T), min(probes, len(T))))
                A0, A1 = np.zeros_like(probe), np.zeros_like(probe)
            y = weight * np.linalg.solve(T, probe)
            x = (z - self.centre) / self.radius * y
            # the other half of the ellipse is the complex conjugate
            A0, A1 = (A0 + 2 * y.real, A1 + 2 * x.real) if self.is_real else (A0 + y, A1 + x)
        assert A0 is not None
        count = self._winding(phases)
        U, s, Vt = la.svd(A0, full_matrices=False)
        rank = int((s > MOMENT_RANK * s[0]).sum()) if s[0] > 0 else 0
        if rank == A0.shape[1] and rank < len(A0):
            return None, count
        small = U[:, :rank].conj().T @ A1 @ Vt[:rank].conj().T / s[:rank]
        return np.asarray(self.centre + self.radius * la.eigvals(small), dtype=complex), count

    def _winding(self, phases: list[float]) -> int:
        """Times that det T goes round zero along the ellipse, from its phases along it, or along its upper half."""
        if self.is_real:
            ends = (self.T(self.centre + side * self.radius) for side in (1, -1))
            first, last = (float(np.angle(np.linalg.slogdet(T)[0])) for T in ends)
            phases = [first, *phases, last]
        turns = np.diff(phases if self.is_real else [*phases, phases[0]])
        return round(float(np.angle(np.exp(1j * turns)).sum() / (np.pi if self.is_real else 2 * np.pi)))

    def refined(self, starts: Array, enough: int | None = None) -> Array:
        """Eigenvalues inside [low, high] refined from starting values, copies of each together; stray ones drop out.
        The search ends with `enough` of them."""
        eigenvalues = np.empty(0)
        for value in starts:
            if len(eigenvalues) == enough:
                break
            if (np.abs(eigenvalues - value) <= REPEATED_EIGENVALUES * value).any():
                continue
            copies = self._newton(float(value))
            if copies is None or not self.low <= copies[0] <= self.high:
                continue
            if not (np.abs(eigenvalues - copies[0]) <= REPEATED_EIGENVALUES * value).any():
                eigenvalues = np.sort(np.concatenate([eigenvalues, copies]))
        return eigenvalues

    def nearby(self, z: float) -> Array:
        """Eigenvalues next to z by the linearised problem T(z) x = mu T'(z) x."""
        mu = self._steps(z)
        mu = mu[np.abs(mu) <= STRAY * abs(z)]
        return z - mu[np.abs(mu.imag) <= 0.1 * np.abs(mu) + REPEATED_EIGENVALUES * abs(z)].real

    def _newton(self, z: float) -> Array | None:
        """The eigenvalue next to z, as often as it is repeated; None when none is near."""
        start = z
        for _ in range(30):
            mu = self._steps(z)
            if not len(mu) or abs(mu[0]) > STRAY * z or abs(z - start) > STRAY * start:
                return None
            close = REPEATED_EIGENVALUES * abs(z)
            copies = mu[np.abs(mu) <= max(close, 3 * abs(mu[0]))] if abs(mu[0]) <= close else mu[:1]
            if np.abs(copies).max() <= close and abs(copies.mean()) <= NEWTON_SETTLED * abs(z):
                return np.sort(z - copies.real)
            z = float(z - copies.real.mean())
        return None

    def _steps(self, z: float) -> Complex:
        """Finite eigenvalues of T(z) x = mu T'(z) x, smallest first."""
        T, slope = self._linearised(z)
        try:
            inverse = np.linalg.solve(T, slope)
        except np.linalg.LinAlgError:  # z is an eigenvalue to the last digit
            inverse = np.linalg.solve(self._linearised(z * (1 + LAST_DIGIT))[0], slope)
        with np.errstate(divide="ignore", invalid="ignore"):
            mu = 1 / la.eigvals(inverse)
        mu = mu[np.isfinite(mu)]
        return np.asarray(mu[np.argsort(np.abs(mu))], dtype=complex)

    def _linearised(self, z: float) -> tuple[Any, Any]:
        """T and dT/dz at real z: from one point a little off the real line where T is real there (Squire and Trapp
        1998), else by a difference quotient."""
        if self.is_real:
            T = self.T(complex(z, IMAGINARY_STEP * z))
            return T.real, T.imag / (IMAGINARY_STEP * z)
        return self.T(z), (self.T(z * (1 + SLOPE_STEP)) - self.T(z * (1 - SLOPE_STEP))) / (2 * SLOPE_STEP * z)


def critical_factors(K: Matrix, K_g: Matrix, n: int) -> Array:
    """The `n` lowest positive factors (k,) at which K + factor K_g is singular (theory eq. P7), fewer if there are.

    K, K_g: (n, n) symmetric, full or sparse, K definite. The first that is searched for by Lanczos is confirmed by
    inertia counts on both sides. Raises SolverError when K is not definite or the counts contradict.
    """
    return _critical(K, K_g, n, shapes=False)[0]


def critical_shapes(K: Matrix, K_g: Matrix, n: int) -> tuple[Array, Array]:
    """The same factors (k,), each with its shape x (order, k): (K + factor K_g) x = 0, x' K x = 1.

    Shapes of equal factors are some that span them all. Raises SolverError as `critical_factors`, and when a shape
    leaves more than `SHAPE_RESIDUAL` of the forces K x.
    """
    factors, x = _critical(K, K_g, n, shapes=True)
    forces = np.asarray(K @ x)
    d = unit_scale(K)[:, None]
    residual = np.linalg.norm(d * (forces + factors * np.asarray(K_g @ x)), axis=0)
    if (residual > SHAPE_RESIDUAL * np.linalg.norm(d * forces, axis=0)).any():
        raise SolverError("buckling shapes were not found: their forces do not vanish at the factors found")
    return factors, x / np.sqrt(np.einsum("ik,ik->k", x, forces))


def _critical(K: Matrix, K_g: Matrix, n: int, shapes: bool) -> tuple[Array, Array]:
    """Factors (k,), and their shapes (order, k), of any size; no shapes where these are not asked for."""
    if not is_definite(K):
        raise SolverError("something can move freely without load: there is nothing to buckle")
    d = unit_scale(K)
    Ks, Gs = scaled(K, d), scaled(K_g, d)
    order = K.shape[0]
    count = min(n, order)
    least = BUCKLING_ROUNDING * float(abs(Gs).max())
    if not least > 0:
        return np.empty(0), np.empty((order, 0))
    searched = order > (DENSE_LIMIT if count == 1 else DENSE_BUCKLING)
    near = _near(Ks, Gs, 1 / least) if searched else 0.0
    if searched:
        Ks = Ks + near * Gs
        inverse = spla.LinearOperator(Ks.shape, matvec=factorise(Ks).solve, dtype=float)
        options = {"v0": np.cos(np.arange(order)), "ncv": min(order, 2 * count + LANCZOS_BASIS), "tol": FACTOR_ERROR}
        solved = spla.eigsh(Gs, k=count, M=Ks, Minv=inverse, which="SA", return_eigenvectors=shapes, **options)
    else:
        solved = la.eigh(toarray(Gs), toarray(Ks), eigvals_only=not shapes, subset_by_index=[0, count - 1])
    mu, y = (solved[0], solved[1]) if shapes else (np.asarray(solved), np.empty((0, count)))
    ascending = np.argsort(mu)
    ascending = ascending[mu[ascending] < 0]
    factors = near - 1 / mu[ascending]
    kept = factors < 1 / least
    factors, y = factors[kept], y[:, ascending[kept]]
    if searched and len(factors):
        below, above = (count_below((K + f * factors[0] * K_g).tocsc(), K, 0.0) for f in (1 - 1e-4, 1 + 1e-4))
        if below or not above:
            raise SolverError("inertia counts do not confirm the buckling factor")
    return factors, d[:, None] * y if shapes else y


def _near(K: Matrix, K_g: Matrix, most: float) -> float:
    """A factor below the lowest one, K definite: next to it Lanczos' method finds that quickly."""
    factor = 0.0
    while is_definite(K + max(1.0, FACTOR_STRIDE * factor) * K_g):
        factor = max(1.0, FACTOR_STRIDE * factor)
        if factor > most:
            break
    return factor
