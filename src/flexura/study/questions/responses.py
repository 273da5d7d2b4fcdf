"""Magnitudes of frequency responses of one design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from flexura.analysis import SlopedResponse, frequency_response
from flexura.duals import Dual
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
    return _highest(plan, parameters, out, into, low, high)[0]


def _highest(
    plan: Plan, parameters: Mapping[str, float], out: Port, into: Port, low: Hertz, high: Hertz
) -> tuple[float, float, float]:
    """The largest magnitude in a band, and frequencies, Hz, on both sides of where it is; these are the same where it
    is at an end."""
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
        return float(size[best]), *ends
    refined = minimize_scalar(
        lambda f: -abs(modes.response(np.array([f]))[0, 0, 0]),
        bounds=ends,
        method="bounded",
        options={"xatol": NARROW * hz[best]},
    )
    return float(max(size[best], -refined.fun)), *ends


def sloped_magnitude(
    plan: Plan, parameters: Mapping[str, float], names: Sequence[str], asked: Sequence[Any]
) -> Dual | None:
    """A response with its exact slopes, at a frequency or the largest in a band, whose slope is that at the frequency
    where it is (the envelope theorem); None where damping or ports have no exact ones. Raises as `peak`."""
    out, into, *band = asked
    own = SlopedResponse(plan, parameters, names, out.known, into.known, float(band[-1]))
    if not own.is_known:
        return None
    if len(band) == 1:
        return Dual(np.array(magnitude(plan, parameters, out, into, band[0])), own.magnitude(float(band[0])).slope)
    value, low, high = _highest(plan, parameters, out, into, *band)
    signs = own.by_frequency(low), own.by_frequency(high)
    top = high if signs[1] >= 0 else low
    if signs[0] > 0 > signs[1]:
        top = float(brentq(own.by_frequency, low, high, xtol=1e-13 * high, rtol=1e-14))
    return Dual(np.array(value), own.magnitude(top).slope)
