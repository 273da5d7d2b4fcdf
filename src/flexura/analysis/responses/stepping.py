"""Steps in time: of modes exactly, whatever the step, for inputs held or linear over it, as recursive filters or a
block of steps at a time; of matrices by the generalised-alpha method.

A mode with poles s and s' is eta = (z - z')/(s - s') with z' = s z + f for each; every z is stepped exactly. Where both
poles are well inside a step's resolution their second-order filter gives eta at half the cost (theory eqs. T15-T17).

With w = z - ahead f, f = B u, a block of L steps is w at its start carried by exp(s dt j), and the pulse responses of
the inputs within it; blocks are chained by exp(s dt L). What a block does to the outputs is the same for all of them
(block recursion: Burrus 1972, IEEE Trans. Audio Electroacoust. 20, 230).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.arrays import Array, Complex, Index
from flexura.deadline import checkpoint
from flexura.errors import OptionError, SolverError
from flexura.kernels import Kernel
from flexura.linalg import LDL, Factor, SingularError, factorise
from flexura.systems import ModalSystem, held_exponentials

Hold = Literal["zoh", "foh"]

CRITICAL = 1e-5
"""Distance of two poles beside their size below which they count as one."""

RESOLVED = 0.05
"""Angle of a step, omega dt, from which the filter of second order keeps all digits: it loses (omega dt)^-2."""

TERMS = 18
"""Terms of the series of the phi functions for small arguments."""

SHORTEST, LONGEST = 64, 256
"""Steps of a block."""

BLOCK_COST = 140
"""Multiplications per mode and step from which filters are cheaper than blocks."""


_steps = Kernel("alpha_steps", "nnn" + 3 * "aaa" + "aa" + "aaaaa" + "a" + "xxxxx" + "aaaa")

STEPS_AT_ONCE = 1000
"""Steps of generalised-alpha between which an interruption is seen."""


class Driven(NamedTuple):
    """What drives modes: inputs u (m, N) at times 0, dt, 2 dt, ..., s, held or linear between samples, from the state
    eta, rate (r,) at time zero."""

    u: Array
    dt: float
    hold: Hold
    eta: Array
    rate: Array


def modal_motion(modes: ModalSystem, driven: Driven, orders: Sequence[int]) -> Array:
    """Coordinates (o, r, N) of a viscously damped system, each derivative of `orders` (o,), 0 or 1, in this order.

    Raises SolverError as `complex_modes` does where damping couples modes.
    """
    if modes.is_proportional:
        return _uncoupled(modes, driven, orders)
    moved = np.empty((len(orders), modes.order, driven.u.shape[1]))
    for chosen, solve in ((modes.coupled, _coupled), (~modes.coupled, _uncoupled)):
        if chosen.any():
            part = driven._replace(eta=driven.eta[chosen], rate=driven.rate[chosen])
            moved[:, chosen] = solve(modes.part(chosen), part, orders)
    return moved


def _uncoupled(modes: ModalSystem, driven: Driven, orders: Sequence[int]) -> Array:
    """Every mode by itself."""
    u, dt, hold, *_ = driven
    moved = np.empty((len(orders), modes.order, u.shape[1]))
    half, square, critical = _discriminants(modes)
    weights = np.stack(step_weights(np.sqrt((-square).astype(complex)) - half, dt, hold), axis=1)
    for r, f in enumerate(modes.B @ u):
        state = np.array([driven.eta[r], driven.rate[r]])
        root = np.sqrt(complex(-square[r]))
        s, other = -half[r] + root, -half[r] - root
        if critical[r]:
            A = np.array([[0.0, 1.0], [-(modes.omega[r] ** 2), -2 * half[r]]])
            P, constant, ramp = held_exponentials(A, np.array([[0.0], [1.0]]), dt)
            ahead = ramp[:, 0] if hold == "foh" else np.zeros(2)
            moved[:, r] = _second_order(f, state, (P, constant[:, 0] - ahead, ahead), orders)
        elif square[r] < 0:  # overdamped: two filters of first order
            slow, fast = (modes.omega[r] ** 2 / other if modes.omega[r] > 0 else s).real, other.real
            poles, start = np.array([slow, fast]), np.array([state[1] - fast * state[0], state[1] - slow * state[0]])
            z = _first_order(poles, np.stack([f, f]), start, driven)
            reads = np.array([[1.0, 1.0], poles])[list(orders)]
            moved[:, r] = [(w[0] * z[0] - w[1] * z[1]) / (slow - fast) for w in reads]
        elif len(orders) == 2 or abs(s) * dt < RESOLVED:
            z = _first_order(np.array([s]), f[None], np.array([state[1] - other * state[0]]), driven)[0]
            reads = np.array([1 / root, s / root])[list(orders)]
            moved[:, r] = [w.real * z.real - w.imag * z.imag for w in reads]
        else:
            w, p = np.array([1 / root, s / root]), np.exp(s * dt)
            P = np.stack([(w * p * -other).real, (w * p).real], axis=1)
            behind, ahead = weights[r]
            moved[:, r] = _second_order(f, state, (P, (w * behind).real, (w * ahead).real), orders)
    return moved


def _discriminants(modes: ModalSystem) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Half of the damping, 1/s, of every mode, omega^2 less its square, and whether the two poles count as one."""
    half = modes.damping.diagonal() / 2
    square = modes.omega**2 - half**2
    return half, square, np.abs(square) <= CRITICAL**2 * np.maximum(modes.omega**2, half**2)


def _second_order(f: Array, state: Array, step: tuple[Array, Array, Array], orders: Sequence[int]) -> list[Array]:
    """Filters of second order from force to eta and eta', those in `orders`, from a state (2,): it is carried over a
    step by P (2, 2), and moved by the force at its beginning and its end by `behind` and `ahead` (2,)."""
    from scipy.signal import lfilter  # slow to import

    P, behind, ahead = step
    trace, det = P[0, 0] + P[1, 1], P[0, 0] * P[1, 1] - P[0, 1] * P[1, 0]
    Q = P - trace * np.eye(2)
    taps = np.stack([ahead, behind + Q @ ahead, Q @ behind], axis=1)
    following = P @ state + behind * f[0]
    filtered = []
    for k in orders:
        zi = [state[k] - taps[k, 0] * f[0], following[k] - taps[k, 1] * f[0] - trace * state[k]]
        filtered.append(lfilter(taps[k], [1.0, -trace, det], f, zi=zi)[0])
    return filtered


def _coupled(modes: ModalSystem, driven: Driven, orders: Sequence[int]) -> Array:
    """Complex modes: one pole of every conjugate pair, counted twice, and all real ones."""
    every = modes.complex_modes
    upper = every.poles.imag >= 0
    start = np.linalg.solve(every.right, np.concatenate([driven.eta, driven.rate]).astype(complex))[upper]
    z: Complex = _first_order(every.poles[upper], (every.left[upper] @ modes.B) @ driven.u, start, driven)
    twice = np.where(every.poles.imag[upper] > 0, 2.0, 1.0)
    reads = [every.right[k * modes.order : (k + 1) * modes.order, upper] * twice for k in orders]
    return np.stack([W.real @ z.real - W.imag @ z.imag for W in reads])


def _first_order(s: Any, forces: Any, start: Any, driven: Driven) -> Any:
    """z (k, N) of z' = s z + f for forces (k, N), from start (k,), in the steps of what drives."""
    from scipy.signal import lfilter  # slow to import

    p, (behind, ahead) = np.exp(s * driven.dt), step_weights(s, driven.dt, driven.hold)
    z = np.empty(forces.shape, dtype=np.result_type(s, forces))
    for k, f in enumerate(forces):
        z[k] = lfilter([ahead[k], behind[k]], [1.0, -p[k]], f, zi=np.array([start[k] - ahead[k] * f[0]]))[0]
    return z


def step_weights(s: Any, dt: float, hold: Hold) -> tuple[Any, Any]:
    """Weights of the force at the beginning and at the end of a step."""
    phi1, phi2 = _phi(s * dt)
    ahead = dt * phi2 if hold == "foh" else np.zeros_like(phi2)
    return dt * phi1 - ahead, ahead


def _phi(x: Any) -> tuple[Any, Any]:
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


def suits_blocks(modes: ModalSystem, inputs: int) -> bool:
    """True when no mode is coupled or has a double pole, and outputs are so few that blocks are the shorter way."""
    if not modes.order or not modes.is_proportional or _discriminants(modes)[2].any():
        return False
    return len(modes.C) * (inputs * SHORTEST + modes.order) <= BLOCK_COST * modes.order


def block_response(modes: ModalSystem, driven: Driven) -> Array:
    """C d^k eta/dt^k (p, N), k = `modes.derivative`, of a system that `suits_blocks`."""
    u, dt, hold, eta, rate = driven
    mode, s, other, share = _poles(modes)
    behind, ahead = step_weights(s, dt, hold)
    pulse, B = behind + np.exp(s * dt) * ahead, modes.B[mode]
    read = modes.C[:, mode] * share * s ** modes.derivative[:, None]
    y = ((read * ahead).real @ B + modes.C @ modes.B * (modes.derivative == 2)[:, None]) @ u
    m, N, p, r = *u.shape, len(read), len(s)
    L = int(np.clip(2 * r * (p + m) // (p * m), SHORTEST, LONGEST))
    count = -(-N // L)
    padded = np.zeros((m, count * L))
    padded[:, :N] = u
    U = np.ascontiguousarray(padded.reshape(m, count, L).transpose(1, 0, 2)).reshape(count, m * L)
    carry = np.exp(np.multiply.outer(dt * np.arange(L + 1), s))
    entering = (B.T[:, None, :] * (pulse * carry[L - 1 :: -1])).reshape(m * L, r)
    w = _chained(U @ _parts(entering), carry[L], rate[mode] - other * eta[mode] - ahead * (B @ u[:, 0]))
    out = (read[:, None, :] * carry[:L]).reshape(p * L, r)
    markov = (read[:, None, :] * (pulse * carry[: L - 1])).reshape(p * (L - 1), r).real @ B
    Y = w @ _parts(out.conj()).T + U @ _toeplitz(markov.reshape(p, L - 1, m), L)
    y += Y.reshape(count, p, L).transpose(1, 0, 2).reshape(p, count * L)[:, :N]
    return y


def _poles(modes: ModalSystem) -> tuple[Any, Any, Any, Any]:
    """Mode, pole s, other pole s', and share of z in eta of every pole; one of each conjugate pair, counted twice."""
    half, square, _ = _discriminants(modes)
    waves, creeps = np.flatnonzero(square > 0), np.flatnonzero(square < 0)
    root = 1j * np.sqrt(square[waves])
    fast = -half[creeps] - np.sqrt(-square[creeps])
    slow = modes.omega[creeps] ** 2 / fast
    s = np.concatenate([root - half[waves], slow, fast])
    other = np.concatenate([-root - half[waves], fast, slow])
    share = np.concatenate([1 / root, 1 / (slow - fast), 1 / (fast - slow)])
    return np.concatenate([waves, creeps, creeps]), s, other, share


def _parts(A: Any) -> Array:
    """Real parts beside imaginary ones."""
    return np.concatenate([A.real, A.imag], axis=-1)


def _chained(forced: Array, factor: Any, start: Any) -> Array:
    """States (blocks, 2r) at the beginning of every block, from the last state and what entered since."""
    r = len(factor)
    entering = forced[:, :r] + 1j * forced[:, r:]
    states = np.empty_like(entering)
    state = start
    for k, entered in enumerate(entering):
        states[k] = state
        state = factor * state + entered
    return _parts(states)


def _toeplitz(markov: Array, L: int) -> Array:
    """Inputs of a block (m L) to its outputs (p L) from pulse responses (p, L - 1, m) after 1, 2, ... steps."""
    p, _, m = markov.shape
    lagged = np.zeros((p, 2 * L, m))
    lagged[:, L + 1 :] = markov
    lag = L + np.arange(L) - np.arange(L)[:, None]
    return np.ascontiguousarray(lagged[:, lag].transpose(3, 1, 0, 2)).reshape(m * L, p * L)


def generalised_alpha(
    M: Any, C: Any, K: Any, B: Array, u: Array, *, dt: float, rho_infinity: float, start: Array, impulses: Array
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
    factor = _factors((1 - am) * M + (1 - af) * gamma * dt * C + (1 - af) * beta * dt**2 * K)
    q, v, a = (np.zeros((count, n)) for _ in range(3))
    if start.any():
        q[0] = _factors(K).solve(B @ start)
    if impulses.any():
        v[0] = _factors(M).solve(B @ impulses)
    a[0] = _mass_solve(M, B @ u[:, 0] - C @ v[0] - K @ q[0])
    if isinstance(factor, LDL):
        rows = [part for A in (M, C, K) for part in _by_rows(A)]
        loads, by_time, work = (
            np.ascontiguousarray(B, dtype=float),
            np.ascontiguousarray(u.T, dtype=float),
            np.empty(6 * n),
        )
        weights = [float(x) for x in (dt, am, af, gamma, beta)]
        for at in range(0, count - 1, STEPS_AT_ONCE):
            checkpoint()
            part = slice(at, min(at + STEPS_AT_ONCE + 1, count))
            own = (x[part] for x in (q, v, a))
            some = part.stop - at
            _steps(n, len(u), some, *rows, loads, by_time[part], *factor.arrays, factor.scale, *weights, *own, work)
        return q.T, v.T, a.T
    for k in range(count - 1):
        q_next = q[k] + dt * v[k] + (0.5 - beta) * dt**2 * a[k]
        v_next = v[k] + (1 - gamma) * dt * a[k]
        right = B @ ((1 - af) * u[:, k + 1] + af * u[:, k]) - M @ (am * a[k])
        right -= C @ ((1 - af) * v_next + af * v[k]) + K @ ((1 - af) * q_next + af * q[k])
        a[k + 1] = factor.solve(right)
        q[k + 1] = q_next + beta * dt**2 * a[k + 1]
        v[k + 1] = v_next + gamma * dt * a[k + 1]
    return q.T, v.T, a.T


def _by_rows(A: Any) -> tuple[Index, Index, Array]:
    """The arrays of a sparse matrix without its zeros, as kernels take them."""
    A = sp.csr_matrix(A, copy=True)
    A.eliminate_zeros()
    return A.indptr.astype(np.intp), A.indices.astype(np.intp), np.asarray(A.data, dtype=float)


def _factors(A: Any) -> Factor:
    if not np.abs(A.diagonal()).all():
        raise SolverError("a direction has neither mass nor stiffness")
    try:
        return factorise(A)
    except SingularError:
        raise SolverError("the matrix of the time step is singular") from None


def _mass_solve(M: Any, right: Array) -> Array:
    """M^-1 right, zero in directions without mass."""
    m = M.diagonal()
    if (m > 0).all():
        return _factors(M).solve(right)
    solved = np.zeros_like(right)
    heavy = np.flatnonzero(m > 0)
    solved[heavy] = _factors(M[heavy][:, heavy]).solve(right[heavy])
    return solved
