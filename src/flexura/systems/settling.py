"""When what is left of a motion stays within a band for good."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexura.arrays import Array, Complex
from flexura.systems.pole_form import UNDAMPED, PoleForm

PER_PERIOD = 24
"""Instants per period of the fastest pole at which a decay is looked at."""

FAINT = 1e-6
"""Share of the band below which all faint poles together are left out."""

LONGEST = 2_000_000
"""Most instants that are looked at."""

CHUNK = 4096


def decay(form: PoleForm, over: float) -> tuple[Complex, Complex]:
    """Amplitudes (p, K) of the poles, and these poles (K,), rad/s, of what is missing of the final values from the end
    of a move on that lasts `over` s at constant speed, of the one input of a response (theory eq. T40)."""
    p = 2j * np.pi * form.z
    amplitude = form.parts.sum(axis=0) * form.loads[:, 0] / form.z
    moved = np.expm1(p * over) / (p * over) if over else np.ones_like(p)
    return amplitude * moved, p


def settling_time(amplitude: Complex, p: Complex, band: float) -> float:
    """The time, s, from which on |Re sum of amplitudes (K,) exp(p t)| is at most `band`; infinite where something does
    not decay, NaN where there is no band, or more instants than can be looked at.

    Looked at are instants so close that the fastest pole that matters has 24 a period; the last crossing is refined.
    """
    from scipy.optimize import brentq  # slow to import

    if not np.isfinite(band) or not np.isfinite(amplitude).all():
        return float("nan")
    if band <= 0:
        return float("inf") if amplitude.any() else 0.0
    size = np.abs(amplitude)
    order = np.argsort(size)
    heard = np.ones(len(size), dtype=bool)
    heard[order[np.cumsum(size[order]) <= FAINT * band]] = False
    size, amplitude, p = size[heard], amplitude[heard], p[heard]
    if size.sum() <= band:
        return 0.0
    if (p.real >= -UNDAMPED * np.abs(p)).any():
        return float("inf")

    def left(t: Any) -> Array:
        return np.abs((amplitude * np.exp(np.multiply.outer(t, p))).sum(axis=-1).real)

    last = _latest(size, p.real, band)
    step = 2 * np.pi / (PER_PERIOD * max(float(np.abs(p.imag).max()), 1 / last))
    count = int(np.ceil(last / step)) + 1
    if count > LONGEST:
        return float("nan")
    for stop in range(count, 0, -CHUNK):
        start = max(0, stop - CHUNK)
        t = step * np.arange(start, stop + 1)
        outside = np.flatnonzero(left(t) > band)
        if len(outside):
            k = int(outside[-1])
            if k == len(t) - 1:
                return float(t[k])
            return float(brentq(lambda x: float(left(x)) - band, t[k], t[k + 1], xtol=1e-9 * step))
    return 0.0


def _latest(size: Array, rate: Array, band: float) -> float:
    """When the sum of all envelopes is down to the band."""
    from scipy.optimize import brentq  # slow to import

    late = np.log(size.sum() / band) / -rate.max()
    return float(brentq(lambda t: float((size * np.exp(rate * t)).sum()) - band, 0.0, late * (1 + 1e-12) + 1e-300))
