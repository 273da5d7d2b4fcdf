"""Systems M, C, K whose poles and responses follow from dense matrices, and measurements of them with noise."""

from __future__ import annotations

import numpy as np
import scipy.linalg

import flexura as fx

QUANTITY = ("displacement", "velocity", "acceleration")


class System:
    """Dense M, C, K with poles and shapes of the state matrix, and responses by inversion at every frequency."""

    def __init__(self, M, C, K):
        self.M, self.C, self.K = (np.asarray(x, dtype=float) for x in (M, C, K))
        n = len(self.M)
        state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(self.M, np.hstack([self.K, self.C]))]])
        poles, vectors = np.linalg.eig(state)
        at = np.flatnonzero(poles.imag > 0)
        at = at[np.argsort(np.abs(poles[at]))]
        self.poles, self.shapes = poles[at], vectors[:n, at]
        self.frequency_hz = np.abs(self.poles) / (2 * np.pi)
        self.damping_ratio = -self.poles.real / np.abs(self.poles)

    def response(self, hz, inputs, outputs=None, power=2, decay=0.0):
        """s^power (s^2 M + s C + K)^-1 at s = i omega + decay."""
        s = (2j * np.pi * np.asarray(hz) + decay)[:, None, None]
        n = len(self.M)
        H = np.linalg.inv(s**2 * self.M + s * self.C + self.K) * s**power
        return H[:, list(range(n) if outputs is None else outputs)][:, :, list(inputs)]

    def normal_modes(self):
        """Shapes (n, n) of unit modal mass without damping."""
        return scipy.linalg.eigh(self.K, self.M)[1]


def modal(frequency_hz, ratios, outputs=8, seed=0):
    """A system of given natural frequencies and damping ratios with random shapes, as large as it has outputs.

    Modes beyond those given lie far above them.
    """
    rng = np.random.default_rng(seed)
    n = len(frequency_hz)
    hz = np.concatenate([frequency_hz, 20 * max(frequency_hz) * (1 + np.arange(outputs - n))])
    zeta = np.concatenate([ratios, np.full(outputs - n, 0.01)])
    inverse = np.linalg.inv(rng.standard_normal((outputs, outputs)))
    w = 2 * np.pi * hz
    return System(*(inverse.T @ np.diag(d) @ inverse for d in (np.ones(outputs), 2 * zeta * w, w**2)))


def random_modal(seed, count=6, outputs=8, low=5.0, high=90.0):
    """Random frequencies, neighbours 3 % apart at least, and damping ratios between 0.2 and 3 %."""
    rng = np.random.default_rng(seed)
    while True:
        hz = np.sort(rng.uniform(low, high, count))
        if (np.diff(hz) > 0.03 * hz[1:]).all():
            break
    return modal(hz, 10 ** rng.uniform(-2.7, -1.5, count), outputs, seed)


def channels(positions, kind, quantity):
    """Channels along z of nodes `n0`, `n1`, ..."""
    return tuple(fx.testing.MeasuredChannel(f"{kind}{k}", quantity, f"n{k}", (0.0, 0.0, 1.0)) for k in positions)


def noisy(H, decibels, seed=0):
    """Responses with white noise, each so many dB below its own root mean square; none for None."""
    if decibels is None:
        return H
    rng = np.random.default_rng(seed)
    size = np.sqrt(np.mean(np.abs(H) ** 2, axis=0)) * 10 ** (-decibels / 20) / np.sqrt(2)
    return H + size * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))


def measured(system, hz, inputs=(0, 1), outputs=None, decibels=None, seed=0, power=2, decay=0.0, setup=""):
    """Measured frequency responses of a system."""
    outputs = tuple(range(len(system.M))) if outputs is None else tuple(outputs)
    H = noisy(system.response(hz, inputs, outputs, power, decay), decibels, seed)
    into, out = channels(inputs, "hit", "force"), channels(outputs, "acc", QUANTITY[power])
    return fx.testing.MeasuredFRF(np.asarray(hz, dtype=float), H, into, out, decay=decay, setup=setup)
