"""Eigenvalues of a nonlinear matrix problem T(z) x = 0 on a real interval, all of them, by contour integrals.

T is holomorphic inside an ellipse around the interval, but for poles whose number is known. Moments of its inverse
along the ellipse hold the eigenvalues inside (Beyn 2012, algorithm 1), the winding of det T along it their number; each
is then refined to working accuracy by linearisation, copies of a repeated one together. None inside is missed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from flexura.errors import SolverError

Array = NDArray[np.floating[Any]]
Complex = NDArray[np.complexfloating[Any, Any]]
MatrixFunction = Callable[[complex], Any]
"""T(z), (n, n), real for real z."""

NODES = 96
"""Points of the trapezoidal rule on the whole ellipse."""

FLATNESS = 0.5
"""Imaginary over real semi-axis of the ellipse."""

RANK = 1e-13
"""Relative size of a singular value of the moments that counts as zero."""

STEP = 1e-6
"""Relative step of the difference quotient that stands for dT/dz."""

TINY = 1e-10
"""Relative step along the imaginary axis, whose square is below round-off."""

CONVERGED = 1e-13
"""Relative step off an eigenvalue that is met to the last digit."""

SETTLED = 1e-9
"""Relative change at which a refined eigenvalue is accepted; the linearisation is then exact to its square."""

FAR = 0.05
"""Relative distance beyond which a starting value belongs to no eigenvalue."""

CLOSE = 1e-6
"""Relative distance below which eigenvalues are copies of one."""


def real_eigenvalues(
    problem: MatrixFunction, low: float, high: float, guesses: Array, poles: int = 0, is_real: bool = True
) -> Array:
    """All eigenvalues of T(z) x = 0 in [low, high], ascending, repeated ones repeated.

    `guesses` are tried besides the values that the moments give, since entries of T that spread over decades can hide
    an eigenvalue from these. The number of eigenvalues is that of the winding of det T, less its `poles` inside; it is
    met, or the search goes on with more points. `is_real` says that T is real for real z, which halves the work. Raises
    SolverError when the number is not met.
    """
    centre, radius = (low + high) / 2, (high - low) / 2
    problem = _balanced(problem, centre + 0.3j * radius)
    probes = len(guesses) + 8
    seeds = np.asarray(guesses, dtype=float)
    for nodes in (NODES, 2 * NODES, 4 * NODES):
        found, count = _moments(problem, centre, radius, probes, nodes, is_real)
        while found is None:
            probes *= 2
            found, count = _moments(problem, centre, radius, probes, nodes, is_real)
        inside = found[(np.abs(found.real - centre) < radius) & (np.abs(found.imag) < 1e-2 * radius)].real
        if count + poles == len(guesses):
            # two counts that know nothing of each other agree: no need to try starting values beyond that number
            refined = _refined(problem, np.sort(np.concatenate([inside, seeds])), low, high, len(guesses), is_real)
            if len(refined) == count + poles:
                return refined
        start = [inside, *(_nearby(problem, float(z), is_real) for z in [*inside, *seeds])]
        refined = _refined(problem, np.sort(np.concatenate(start)), low, high, None, is_real)
        if len(refined) == count + poles:
            return refined
        seeds = np.concatenate([guesses, np.linspace(low, high, nodes // 4)])
    raise SolverError(f"the contour between {low:.6g} and {high:.6g} did not separate its {count} eigenvalues")


def _balanced(problem: MatrixFunction, reference: complex) -> MatrixFunction:
    """The problem with rows and columns scaled so that the largest entry of each is about one at z (Ruiz 2001)."""
    A = np.abs(problem(reference))
    row, column = np.ones(len(A)), np.ones(len(A))
    for _ in range(12):
        scaled = A * row[:, None] * column
        row /= np.sqrt(np.maximum(scaled.max(axis=1), 1e-300))
        column /= np.sqrt(np.maximum(scaled.max(axis=0), 1e-300))
    return lambda z: problem(z) * row[:, None] * column


def _moments(
    problem: MatrixFunction, centre: float, radius: float, probes: int, nodes: int, is_real: bool
) -> tuple[Complex | None, int]:
    """Eigenvalues inside the ellipse from the first two moments, None when there are as many as probes; and their
    number from the winding of det T."""
    phases, A0, A1 = [], None, None
    for k in range(nodes // 2 if is_real else nodes):
        angle = 2 * np.pi * (k + 0.5) / nodes
        z = centre + radius * (np.cos(angle) + 1j * FLATNESS * np.sin(angle))
        weight = radius * (FLATNESS * np.cos(angle) + 1j * np.sin(angle)) / nodes
        T = problem(z)
        phases.append(np.angle(np.linalg.slogdet(T)[0]))
        if A0 is None:
            probe = np.random.default_rng(5).normal(size=(len(T), min(probes, len(T))))
            A0, A1 = np.zeros_like(probe), np.zeros_like(probe)
        y = weight * np.linalg.solve(T, probe)
        x = (z - centre) / radius * y
        # the other half of the ellipse is the complex conjugate
        A0, A1 = (A0 + 2 * y.real, A1 + 2 * x.real) if is_real else (A0 + y, A1 + x)
    assert A0 is not None
    count = _winding(problem, centre, radius, phases, is_real)
    U, s, Vt = la.svd(A0, full_matrices=False)
    rank = int((s > RANK * s[0]).sum()) if s[0] > 0 else 0
    if rank == A0.shape[1] and rank < len(A0):
        return None, count
    small = U[:, :rank].conj().T @ A1 @ Vt[:rank].conj().T / s[:rank]
    return centre + radius * la.eigvals(small), count


def _winding(problem: MatrixFunction, centre: float, radius: float, phases: list[float], is_real: bool) -> int:
    """Times that det T goes round zero along the ellipse, from its phases along it, or along its upper half."""
    if is_real:
        ends = [float(np.angle(np.linalg.slogdet(problem(centre + side * radius))[0])) for side in (1, -1)]
        phases = [ends[0], *phases, ends[1]]
    turns = np.diff(phases if is_real else [*phases, phases[0]])
    return round(float(np.angle(np.exp(1j * turns)).sum() / (np.pi if is_real else 2 * np.pi)))


def _refined(
    problem: MatrixFunction, start: Array, low: float, high: float, enough: int | None, is_real: bool
) -> Array:
    """Eigenvalues inside [low, high] refined from starting values, copies of each together; stray ones drop out. The
    search ends with `enough` of them."""
    found = np.empty(0)
    for value in start:
        if len(found) == enough:
            break
        if (np.abs(found - value) <= CLOSE * value).any():
            continue
        own = _newton(problem, float(value), is_real)
        if own is not None and low <= own[0] <= high and not (np.abs(found - own[0]) <= CLOSE * value).any():
            found = np.sort(np.concatenate([found, own]))
    return found


def _nearby(problem: MatrixFunction, z: float, is_real: bool) -> Array:
    """Eigenvalues next to z by the linearised problem T(z) x = mu T'(z) x."""
    mu = _steps(problem, z, is_real)
    mu = mu[np.abs(mu) <= FAR * abs(z)]
    return z - mu[np.abs(mu.imag) <= 0.1 * np.abs(mu) + CLOSE * abs(z)].real


def _steps(problem: MatrixFunction, z: float, is_real: bool) -> Complex:
    """Finite eigenvalues of T(z) x = mu T'(z) x, smallest first."""
    T, slope = _linearised(problem, z, is_real)
    try:
        inverse = np.linalg.solve(T, slope)
    except np.linalg.LinAlgError:  # z is an eigenvalue to the last digit
        inverse = np.linalg.solve(_linearised(problem, z * (1 + CONVERGED), is_real)[0], slope)
    with np.errstate(divide="ignore", invalid="ignore"):
        mu = 1 / la.eigvals(inverse)
    mu = mu[np.isfinite(mu)]
    return mu[np.argsort(np.abs(mu))]


def _linearised(problem: MatrixFunction, z: float, is_real: bool) -> tuple[Any, Any]:
    """T and dT/dz at real z: from one point a little off the real line where T is real there (Squire and Trapp 1998),
    else by a difference quotient."""
    if is_real:
        T = problem(complex(z, TINY * z))
        return T.real, T.imag / (TINY * z)
    return problem(z), (problem(z * (1 + STEP)) - problem(z * (1 - STEP))) / (2 * STEP * z)


def _newton(problem: MatrixFunction, z: float, is_real: bool) -> Array | None:
    """The eigenvalue next to z, as often as it is repeated; None when none is near."""
    start = z
    for _ in range(30):
        mu = _steps(problem, z, is_real)
        if not len(mu) or abs(mu[0]) > FAR * z or abs(z - start) > FAR * start:
            return None
        copies = mu[np.abs(mu) <= max(CLOSE * abs(z), 3 * abs(mu[0]))] if abs(mu[0]) <= CLOSE * abs(z) else mu[:1]
        if np.abs(copies).max() <= CLOSE * abs(z) and abs(copies.mean()) <= SETTLED * abs(z):
            return np.sort(z - copies.real)
        z = float(z - copies.real.mean())
    return None
