"""The force of a hammer pulse, and what a modal system does after it, in closed form without time steps."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array, Complex
from flexura.systems import ModalSystem

TERMS = ((0.5, 0.0), (-0.25, 1.0), (-0.25, -1.0))
"""Coefficients and exponents, in 2 pi i over the length, of the exponentials that make up a pulse (theory eq. H13)."""

TOGETHER = 32
"""Poles that are summed at a time."""

ALIKE = 1e-6
"""Difference of two exponents over the time elapsed below which they are taken as equal."""


def hammer_pulse(time: Array, start: float, length: float) -> Array:
    """Force (N,) of unit peak, (1 - cos(2 pi t / length)) / 2 after `start`, s (theory eq. H13)."""
    own = (time - start) / length
    return np.where((own > 0) & (own < 1), 0.5 - 0.5 * np.cos(2 * np.pi * own), 0.0)


def response_to_pulse(modes: ModalSystem, time: Array, start: float, length: float) -> Array:
    """Outputs (p, m, N) at `time` (N,), s, of a system at rest after a pulse of unit peak at each input.

    The convolution of the modes with the pulse in closed form (theory eq. H14); modes that are left out follow the
    force at once. Raises SolverError where there are no complex modes, as of something that floats.
    """
    found = modes.complex_modes
    r, (p, m) = modes.order, (len(modes.outputs), len(modes.inputs))
    order = np.asarray(modes.derivative)
    y = np.zeros((p, m, len(time)))
    for first in range(0, len(found.poles), TOGETHER):
        own = slice(first, first + TOGETHER)
        poles = found.poles[own]
        q = convolved(poles, time - start, length)
        left = modes.C @ found.right[:r, own] * poles ** order[:, None]
        residues = left[:, None, :] * (found.left[own] @ modes.B).T[None]
        y += (residues.reshape(p * m, -1) @ q).real.reshape(p, m, -1)
    force = [hammer_pulse(time, start, length), _first(time, start, length), _second(time, start, length)]
    direct = modes.C @ modes.B
    for k, d in enumerate(order):
        y[k] += modes.residual[k][:, None] * force[d] + modes.D[k][:, None] * force[0]
        if d == 2:
            y[k] += direct[k][:, None] * force[0]
    return y


def convolved(poles: Complex, time: Array, length: float) -> Complex:
    """The integral of e^(pole (t - tau)) over a pulse of unit peak from time zero (poles, N) (theory eq. H14)."""
    t = np.maximum(time, 0.0)
    inside = np.minimum(t, length)
    p = poles[:, None]
    within = np.zeros((len(poles), len(t)), dtype=complex)
    decayed = np.exp(p * inside)
    for coefficient, multiple in TERMS:
        s = 2j * np.pi * multiple / length
        gap = s - p
        near = np.abs(gap) * length < ALIKE
        quotient = (np.exp(s * inside) - decayed) / np.where(near, 1.0, gap)
        within += coefficient * np.where(near, inside * decayed, quotient)
    return within * np.exp(p * (t - inside))


def _first(time: Array, start: float, length: float) -> Array:
    own = (time - start) / length
    return np.where((own > 0) & (own < 1), np.pi / length * np.sin(2 * np.pi * own), 0.0)


def _second(time: Array, start: float, length: float) -> Array:
    own = (time - start) / length
    return np.where((own > 0) & (own < 1), 2 * (np.pi / length) ** 2 * np.cos(2 * np.pi * own), 0.0)
