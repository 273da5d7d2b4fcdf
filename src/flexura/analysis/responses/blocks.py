"""Exact time steps of outputs alone, a block of steps at a time: matrix products, not a filter per mode.

With z of every pole as in `recurrences` and w = z - ahead f, f = B u, a block of L steps is w at its start carried by
exp(s dt j), and the pulse responses of the inputs within it; blocks are chained by exp(s dt L). What a block does to
the outputs is the same for all of them (theory eqs. T15-T17; block recursion: Burrus 1972, IEEE Trans. Audio
Electroacoust. 20, 230).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from flexura.analysis.responses.recurrences import CRITICAL, Hold, step_weights
from flexura.arrays import Array
from flexura.systems import ModalSystem

SHORTEST, LONGEST = 64, 256
"""Steps of a block."""

WORTH = 140
"""Multiplications per mode and step from which filters are cheaper."""


def suits_blocks(modes: ModalSystem, inputs: int) -> bool:
    """True when no mode is coupled or has a double pole, and outputs are so few that blocks are the shorter way."""
    half = modes.damping.diagonal() / 2
    critical = np.abs(modes.omega**2 - half**2) <= CRITICAL**2 * np.maximum(modes.omega**2, half**2)
    if not modes.order or not modes.is_proportional or critical.any():
        return False
    return len(modes.C) * (inputs * SHORTEST + modes.order) <= WORTH * modes.order


def block_response(modes: ModalSystem, u: Array, dt: float, hold: Hold, eta: Array, rate: Array) -> Array:
    """C d^k eta/dt^k (p, N), k = `modes.derivative`, of a system that `suits_blocks`.

    Inputs u (m, N) at times 0, dt, 2 dt, ... are held or linear between samples; eta, rate (r,) is the state at time
    zero.
    """
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
    half = modes.damping.diagonal() / 2
    square = modes.omega**2 - half**2
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
    own = forced[:, :r] + 1j * forced[:, r:]
    states = np.empty_like(own)
    state = start
    for k, entered in enumerate(own):
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
