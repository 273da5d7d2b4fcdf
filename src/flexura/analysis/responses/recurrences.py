"""Exact time steps of a modal system as recursive filters: no step-size error for inputs held or linear over a step.

A mode with poles s and s' is eta = (z - z')/(s - s') with z' = s z + f for each; every z is stepped exactly. Where both
poles are well inside a step's resolution their second-order filter gives eta at half the cost (theory eqs. T15-T17).
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Literal

import numpy as np

from flexura.arrays import Array, Complex
from flexura.systems import ModalSystem, held_exponentials

Hold = Literal["zoh", "foh"]

CRITICAL = 1e-5
"""Distance of two poles beside their size below which they count as one."""

RESOLVED = 0.05
"""Angle of a step, omega dt, from which the filter of second order keeps all digits: it loses (omega dt)^-2."""

TERMS = 18
"""Terms of the series of the phi functions for small arguments."""


def motion(
    modes: ModalSystem, u: Array, dt: float, hold: Hold, eta: Array, rate: Array, wanted: Collection[int]
) -> list[Array | None]:
    """[eta, eta'] (r, N) each, those in `wanted` (0, 1), of a viscously damped system.

    Inputs u (m, N) at times 0, dt, 2 dt, ... are held or linear between samples; eta, rate (r,) is the state at time
    zero. Raises SolverError as `complex_modes` does where damping couples modes.
    """
    if modes.is_proportional:
        return _uncoupled(modes, u, dt, hold, eta, rate, wanted)
    found: list[Array | None] = [np.empty((modes.order, u.shape[1])) if k in wanted else None for k in (0, 1)]
    for own, solve in ((modes.coupled, _coupled), (~modes.coupled, _uncoupled)):
        if own.any():
            moved = solve(modes.part(own), u, dt, hold, eta[own], rate[own], wanted)
            for all_of, some in zip(found, moved, strict=True):
                if all_of is not None and some is not None:
                    all_of[own] = some
    return found


def _uncoupled(
    modes: ModalSystem, u: Array, dt: float, hold: Hold, eta: Array, rate: Array, wanted: Collection[int]
) -> list[Array | None]:
    """Every mode by itself."""
    found: list[Array | None] = [np.empty((modes.order, u.shape[1])) if k in wanted else None for k in (0, 1)]
    forces = modes.B @ u
    half = modes.damping.diagonal() / 2
    square = modes.omega**2 - half**2
    critical = np.abs(square) <= CRITICAL**2 * np.maximum(modes.omega**2, half**2)
    weights = np.stack(step_weights(np.sqrt((-square).astype(complex)) - half, dt, hold), axis=1)
    both = len(wanted) == 2
    for r, f in enumerate(forces):
        state = np.array([eta[r], rate[r]])
        root = np.sqrt(complex(-square[r]))
        s, other = -half[r] + root, -half[r] - root
        if critical[r]:
            A = np.array([[0.0, 1.0], [-(modes.omega[r] ** 2), -2 * half[r]]])
            P, constant, ramp = held_exponentials(A, np.array([[0.0], [1.0]]), dt)
            ahead = ramp[:, 0] if hold == "foh" else np.zeros(2)
            _second_order(found, r, f, state, P, constant[:, 0] - ahead, ahead)
        elif square[r] < 0:
            if modes.omega[r] > 0:
                s = modes.omega[r] ** 2 / other
            _two_real(found, r, f, state, s.real, other.real, dt, hold)
        elif both or abs(s) * dt < RESOLVED:
            z = first_order(np.array([s]), f[None], dt, hold, np.array([state[1] - other * state[0]]))[0]
            for k, w in enumerate((1 / root, s / root)):
                own = found[k]
                if own is not None:
                    own[r] = w.real * z.real - w.imag * z.imag
        else:
            _second_order(found, r, f, state, *_held(s, other, root, dt, weights[r]))
    return found


def _held(s: complex, other: complex, root: complex, dt: float, weights: Any) -> tuple[Array, Array, Array]:
    """P (2, 2) and the weights (2,) of the force now and ahead in (eta, eta') of one underdamped mode."""
    w = np.array([1 / root, s / root])
    p = np.exp(s * dt)
    P = np.stack([(w * p * -other).real, (w * p).real], axis=1)
    return P, (w * weights[0]).real, (w * weights[1]).real


def _second_order(
    found: list[Array | None], r: int, f: Array, state: Array, P: Array, behind: Array, ahead: Array
) -> None:
    """Filter of second order from force to eta or eta', from a state (2,)."""
    from scipy.signal import lfilter  # slow to import

    trace, det = P[0, 0] + P[1, 1], P[0, 0] * P[1, 1] - P[0, 1] * P[1, 0]
    Q = P - trace * np.eye(2)
    taps = np.stack([ahead, behind + Q @ ahead, Q @ behind], axis=1)
    following = P @ state + behind * f[0]
    for k, own in enumerate(found):
        if own is not None:
            b = taps[k]
            zi = [state[k] - b[0] * f[0], following[k] - b[1] * f[0] - trace * state[k]]
            own[r] = lfilter(b, [1.0, -trace, det], f, zi=zi)[0]


def _two_real(
    found: list[Array | None], r: int, f: Array, state: Array, slow: float, fast: float, dt: float, hold: Hold
) -> None:
    """An overdamped mode as two filters of first order."""
    s, start = np.array([slow, fast]), np.array([state[1] - fast * state[0], state[1] - slow * state[0]])
    z = first_order(s, np.stack([f, f]), dt, hold, start)
    for k, w in enumerate((np.ones(2), s)):
        own = found[k]
        if own is not None:
            own[r] = (w[0] * z[0] - w[1] * z[1]) / (slow - fast)


def _coupled(
    modes: ModalSystem, u: Array, dt: float, hold: Hold, eta: Array, rate: Array, wanted: Collection[int]
) -> list[Array | None]:
    """Complex modes: one pole of every conjugate pair, counted twice, and all real ones."""
    every = modes.complex_modes
    own = every.poles.imag >= 0
    start = np.linalg.solve(every.right, np.concatenate([eta, rate]).astype(complex))[own]
    z: Complex = first_order(every.poles[own], (every.left[own] @ modes.B) @ u, dt, hold, start)
    twice = np.where(every.poles.imag[own] > 0, 2.0, 1.0)
    found: list[Array | None] = []
    for k in (0, 1):
        W = every.right[k * modes.order : (k + 1) * modes.order, own] * twice
        found.append(W.real @ z.real - W.imag @ z.imag if k in wanted else None)
    return found


def first_order(s: Any, forces: Any, dt: float, hold: Hold, start: Any) -> Any:
    """z (k, N) of z' = s z + f for forces (k, N), held or linear over each step, from start (k,)."""
    from scipy.signal import lfilter  # slow to import

    p, (behind, ahead) = np.exp(s * dt), step_weights(s, dt, hold)
    z = np.empty(forces.shape, dtype=np.result_type(s, forces))
    for k, f in enumerate(forces):
        z[k] = lfilter([ahead[k], behind[k]], [1.0, -p[k]], f, zi=np.array([start[k] - ahead[k] * f[0]]))[0]
    return z


def step_weights(s: Any, dt: float, hold: Hold) -> tuple[Any, Any]:
    """Weights of the force at the beginning and at the end of a step."""
    phi1, phi2 = phi(s * dt)
    ahead = dt * phi2 if hold == "foh" else np.zeros_like(phi2)
    return dt * phi1 - ahead, ahead


def phi(x: Any) -> tuple[Any, Any]:
    """phi1 = (e^x - 1)/x and phi2 = (phi1 - 1)/x, with all digits for small x."""
    small = np.abs(x) < 1.0
    safe = np.where(small, 1.0, x)
    one = np.expm1(safe) / safe
    two = (one - 1) / safe
    near = np.where(small, x, 0.0)
    term1, term2 = np.ones_like(near), np.full_like(near, 0.5)
    series1, series2 = term1.copy(), term2.copy()
    for k in range(2, TERMS + 2):
        term1, term2 = term1 * near / k, term2 * near / (k + 1)
        series1, series2 = series1 + term1, series2 + term2
    return np.where(small, series1, one), np.where(small, series2, two)
