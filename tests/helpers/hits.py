"""Hits on systems whose poles and residues are given, in closed form."""

from __future__ import annotations

import numpy as np
from scipy.special import erfc, wofz

import flexura as fx

POLES_HZ, RATIOS = np.array([12.0, 31.0]), np.array([0.01, 0.02])
POLES = 2 * np.pi * POLES_HZ * (-RATIOS + 1j * np.sqrt(1 - RATIOS**2))
SHAPES = np.array([[1.0, -0.6], [0.4, 1.3]])
RATE, WIDTH, AT = 2048.0, 1e-3, 0.05
HAMMER = fx.testing.MeasuredChannel("hammer", "force", "p1", (0.0, 0.0, 1.0), (0.01, 0.02, 0.03))
OUTPUTS = (
    fx.testing.MeasuredChannel("p1.tz", "displacement", "p1", (0.0, 0.0, 1.0), (0.01, 0.02, 0.03)),
    fx.testing.MeasuredChannel("p2.tz", "displacement", "p2", (0.0, 0.0, 1.0), (0.1, 0.0, 0.0)),
)


def receptance(s, drive=0):
    """H (f, 2) at s (f,) of both outputs to a force at output `drive`: sum of residues over s - pole."""
    r = SHAPES * SHAPES[drive] / (2j * POLES.imag)
    return (r / (s[:, None, None] - POLES) + r.conj() / (s[:, None, None] - POLES.conj())).sum(axis=-1)


def force(time, at=AT, width=WIDTH):
    """A Gaussian pulse, whose spectrum ends: there is no aliasing."""
    return np.exp(-((time - at) ** 2) / (2 * width**2))


def response(time, drive=0, at=AT, width=WIDTH):
    """Displacements (2, N) after the pulse: its convolution with exp(s t), which is an error function."""
    tau = time[:, None] - at
    z = -(tau + POLES * width**2) / (width * np.sqrt(2))
    with np.errstate(all="ignore"):
        before = np.exp(-(tau**2) / (2 * width**2)) * wofz(1j * z)
        after = np.exp(POLES * tau + (POLES * width) ** 2 / 2) * np.where(z.real < -6, 2.0, erfc(z))
    decay = width * np.sqrt(np.pi / 2) * np.where(tau > 0, after, before)
    r = SHAPES * SHAPES[drive] / (2j * POLES.imag)
    return 2 * np.real(decay @ r.T).T


def hit(duration=8.0, drive=0, scale=1.0, noise=(0.0, 0.0), seed=0, setup="", name="", shift=0.0):
    """A recording of the hammer and both outputs; rms of noise on the force and on the outputs, absolute."""
    time = np.arange(round(duration * RATE)) / RATE
    f, y = scale * force(time), scale * response(time - shift, drive)
    rng = np.random.default_rng(seed)
    x = np.vstack([f + noise[0] * rng.normal(size=f.shape), y + noise[1] * rng.normal(size=y.shape)])
    hammer = (
        HAMMER if drive == 0 else fx.testing.MeasuredChannel("hammer2", "force", "p2", (0.0, 0.0, 1.0), (0.1, 0.0, 0.0))
    )
    return fx.testing.Recording(RATE, x, (hammer, *OUTPUTS), (0,), setup, name)
