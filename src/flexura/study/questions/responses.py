"""Magnitudes of frequency responses of one design."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.optimize import minimize_scalar

from flexura.analysis import frequency_response
from flexura.errors import SolverError
from flexura.structure import Plan
from flexura.study.questions.reading import Hertz, Port

POINTS = 200
"""Frequencies of a band, beside those around its resonances."""

NARROW = 1e-9
"""Relative width of the interval in which a peak is told."""


def magnitude(plan: Plan, parameters: Mapping[str, float], out: Port, into: Port, hz: Hertz) -> float:
    """Magnitude of a response at a frequency, in SI."""
    found = frequency_response(plan, parameters, frequency_hz=[hz], inputs=[into.known], outputs=[out.known])
    return float(abs(found.response[0, 0, 0]))


def peak(plan: Plan, parameters: Mapping[str, float], out: Port, into: Port, low: Hertz, high: Hertz) -> float:
    """The largest magnitude of a response in a band, in SI. Raises SolverError where a resonance is not damped."""
    band = (float(low), float(high))
    found = frequency_response(plan, parameters, band=band, points=POINTS, inputs=[into.known], outputs=[out.known])
    undamped = next((f for f, z in zip(found.resonances_hz, found.ratios, strict=True) if not z > 0), None)
    if undamped is not None:
        raise SolverError(f"nothing damps the resonance at {undamped:.5g} Hz: its peak is infinite; describe `damping`")
    size, hz = np.abs(found.response[:, 0, 0]), found.frequency_hz
    best = int(np.argmax(size))
    ends = hz[max(best - 1, 0)], hz[min(best + 1, len(hz) - 1)]
    modes = found.modes
    if modes is None:
        return float(size[best])
    refined = minimize_scalar(
        lambda f: -abs(modes.response(np.array([f]))[0, 0, 0]),
        bounds=ends,
        method="bounded",
        options={"xatol": NARROW * hz[best]},
    )
    return float(max(size[best], -refined.fun))
