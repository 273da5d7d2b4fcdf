"""Step-by-step integration of M q'' + C q' + K q = f for any damping."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse.linalg as spla

from flexura.arrays import Array
from flexura.errors import OptionError, SolverError
from flexura.linalg import scaled, unit_scale


def generalised_alpha(
    M: Any, C: Any, K: Any, B: Array, u: Array, dt: float, rho_infinity: float, start: Array, impulses: Array
) -> tuple[Array, Array, Array]:
    """Displacements, velocities and accelerations (n, N) under loads B u, u (m, N) in steps of dt, s.

    Generalised-alpha (Chung and Hulbert 1993, J. Appl. Mech. 60, 371, eqs. 17, 25): second-order accurate,
    unconditionally stable, with spectral radius `rho_infinity` at high frequencies (1: no damping, 0: they are gone
    after one step). Starts from the static state under `start` (m,) with the velocities of `impulses` (m,), and with
    the acceleration that balances loads at time zero; directions without mass start without acceleration.

    Raises OptionError for a rho_infinity outside 0 to 1, and SolverError when the step matrix is singular.
    """
    if not 0 <= rho_infinity <= 1:
        raise OptionError(f"rho_infinity lies between 0 and 1, not {rho_infinity}")
    am = (2 * rho_infinity - 1) / (rho_infinity + 1)
    af = rho_infinity / (rho_infinity + 1)
    gamma, beta = 0.5 - am + af, (1 - am + af) ** 2 / 4
    n, count = K.shape[0], u.shape[1]
    solve = _factors((1 - am) * M + (1 - af) * gamma * dt * C + (1 - af) * beta * dt**2 * K)
    q, v, a = (np.zeros((count, n)) for _ in range(3))
    if start.any():
        q[0] = _factors(K)(B @ start)
    if impulses.any():
        v[0] = _factors(M)(B @ impulses)
    a[0] = _mass_solve(M, B @ u[:, 0] - C @ v[0] - K @ q[0])
    for k in range(count - 1):
        q_next = q[k] + dt * v[k] + (0.5 - beta) * dt**2 * a[k]
        v_next = v[k] + (1 - gamma) * dt * a[k]
        right = B @ ((1 - af) * u[:, k + 1] + af * u[:, k]) - M @ (am * a[k])
        right -= C @ ((1 - af) * v_next + af * v[k]) + K @ ((1 - af) * q_next + af * q[k])
        a[k + 1] = solve(right)
        q[k + 1] = q_next + beta * dt**2 * a[k + 1]
        v[k + 1] = v_next + gamma * dt * a[k + 1]
    return q.T, v.T, a.T


def _factors(A: Any) -> Any:
    if not np.abs(A.diagonal()).all():
        raise SolverError("a direction has neither mass nor stiffness")
    d = unit_scale(A)
    if isinstance(A, np.ndarray):
        factors = la.lu_factor(scaled(A, d))
        return lambda b: d * la.lu_solve(factors, d * b)
    try:
        lu = spla.splu(scaled(A.tocsc(), d))
    except RuntimeError:
        raise SolverError("the matrix of the time step is singular") from None
    return lambda b: d * lu.solve(d * b)


def _mass_solve(M: Any, right: Array) -> Array:
    """M^-1 right, zero in directions without mass."""
    m = M.diagonal()
    own = m > 0
    if own.all():
        return _factors(M)(right)
    found = np.zeros_like(right)
    at = np.flatnonzero(own)
    found[at] = _factors(M[at][:, at])(right[at])
    return found
