"""Records under shakers, of sampled systems whose responses are exact.

Modal states are driven from sample to sample, so that H(omega) = sum of R T z^-1 / (1 - exp(s T) z^-1) is exact.
"""

import numpy as np
from scipy.signal import lfilter

import flexura as fx

RATE = 256.0
HZ, RATIO = np.array([12.0, 31.0, 55.0]), np.array([0.01, 0.01, 0.02])
POLES = 2 * np.pi * HZ * (-RATIO + 1j * np.sqrt(1 - RATIO**2))
LEFT, RIGHT = (np.random.default_rng(7).standard_normal((3, k)) for k in (4, 2))


def response(force):
    """Outputs (4, N) of forces (m, N)."""
    drive = RIGHT[:, : len(force)] @ force
    states = [lfilter([0, 1 / RATE], [1, -np.exp(s / RATE)], w + 0j) for s, w in zip(POLES, drive, strict=True)]
    return np.einsum("rp,rn->pn", LEFT, (np.array(states) * -1j).real)


def truth(hz, inputs):
    z = np.exp(2j * np.pi * hz / RATE)[:, None]
    q = -1j / RATE / (z - np.exp(POLES / RATE)), 1j / RATE / (z - np.exp(POLES.conj() / RATE))
    return np.einsum("fr,rp,rm->fpm", (q[0] + q[1]) / 2, LEFT, RIGHT[:, :inputs])


def record(force, name="", noise=0.0):
    y = response(force)
    y = y + noise * y.std(axis=1, keepdims=True) * np.random.default_rng(3).standard_normal(y.shape)
    ends = [fx.testing.MeasuredChannel(f"shaker{k}", "force", f"n{k}", (0, 0, 1)) for k in range(len(force))]
    ends += [fx.testing.MeasuredChannel(f"a{k}", "displacement", f"n{k}", (0, 0, 1)) for k in range(len(y))]
    return fx.testing.Recording(RATE, np.vstack([force, y]), tuple(ends), tuple(range(len(force))), name=name)


def off(frf, low=5.0, high=80.0):
    lines = (frf.frequency_hz > low) & (frf.frequency_hz < high)
    exact = truth(frf.frequency_hz[lines], len(frf.inputs))
    return np.linalg.norm(frf.response[lines] - exact) / np.linalg.norm(exact)
