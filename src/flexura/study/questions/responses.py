"""Magnitudes of frequency responses of one design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from flexura.analysis import SlopedResponse, frequency_response
from flexura.duals import Dual
from flexura.errors import SolverError
from flexura.structure import Plan
from flexura.study.questions.reading import Hertz, Port
from flexura.tables import in_hz

POINTS = 200
"""Frequencies of a band, beside those around its resonances."""

NARROW = 1e-10
"""Relative width of the interval in which a peak is told."""

ROOT = 4 * np.finfo(float).eps
"""The same of a peak at which slopes are wanted."""


def magnitude(plan: Plan, parameters: Mapping[str, float], out: Port, into: Port, hz: Hertz) -> float:
    """Magnitude of a response at a frequency, in SI: of the full-order model, of the low-order one where round-off
    would show in a direct solution. Raises SolverError at a resonance that nothing damps."""
    own = SlopedResponse(plan, parameters, (), out.known, into.known, float(hz))
    if own.is_known:
        return abs(own.at(float(hz)))
    found = frequency_response(plan, parameters, frequency_hz=[hz], inputs=[into.known], outputs=[out.known])
    return float(abs(found.response[0, 0, 0]))


def peak(plan: Plan, parameters: Mapping[str, float], out: Port, into: Port, low: Hertz, high: Hertz) -> float:
    """The largest magnitude of a response in a band, in SI, of models as `magnitude`. Raises SolverError where a
    resonance is not damped."""
    found = _scanned(plan, parameters, out, into, low, high)
    own = SlopedResponse(plan, parameters, (), out.known, into.known, float(high))
    if own.is_known:
        return abs(own.at(_top(own, found.low, found.high, (float(low), float(high)), NARROW)))
    modes = found.modes
    if modes is None:
        return found.size
    refined = minimize_scalar(
        lambda f: -abs(modes.response(np.array([f]))[0, 0, 0]),
        bounds=(found.low, found.high),
        method="bounded",
        options={"xatol": 1e-9 * found.low},
    )
    return float(max(found.size, -refined.fun))


class _Scanned(NamedTuple):
    """The largest magnitude of the low-order model in a band, frequencies, Hz, on both sides of where it is, which is
    at one of them where it is at an end, and the modes."""

    size: float
    low: float
    high: float
    modes: Any


def _scanned(plan: Plan, parameters: Mapping[str, float], out: Port, into: Port, low: Hertz, high: Hertz) -> _Scanned:
    band = (float(low), float(high))
    # at a pose no two copies of a part are alike, and modes of the full order are found sooner
    order: Literal["low", "full"] = "full" if plan.is_posed else "low"
    found = frequency_response(
        plan, parameters, band=band, points=POINTS, inputs=[into.known], outputs=[out.known], order=order
    )
    undamped = next((f for f, z in zip(found.resonances_hz, found.ratios, strict=True) if not z > 0), None)
    if undamped is not None:
        raise SolverError(f"nothing damps the resonance at {in_hz(undamped)}: its peak is infinite; describe `damping`")
    size, hz = np.abs(found.response[:, 0, 0]), found.frequency_hz
    best = int(np.argmax(size))
    ends = float(hz[max(best - 1, 0)]), float(hz[min(best + 1, len(hz) - 1)])
    return _Scanned(float(size[best]), *ends, found.modes)


def _top(own: SlopedResponse, low: float, high: float, band: tuple[float, float], narrow: float) -> float:
    """The frequency of the largest magnitude between two frequencies, or beyond them within a band: where low orders
    place a sharp peak may be outside."""
    rises, falls = own.by_frequency(low) > 0, own.by_frequency(high) < 0
    while not (rises and falls):
        if (not rises and low <= band[0]) or (not falls and high >= band[1]):
            return max((low, high), key=lambda hz: abs(own.at(hz)))
        wide = high - low
        if not rises:
            low = max(low - wide, band[0])
            rises = own.by_frequency(low) > 0
        if not falls:
            high = min(high + wide, band[1])
            falls = own.by_frequency(high) < 0
    return float(brentq(own.by_frequency, low, high, xtol=narrow * high, rtol=max(narrow, ROOT)))


def sloped_magnitude(
    plan: Plan, parameters: Mapping[str, float], names: Sequence[str], asked: Sequence[Any]
) -> Dual | None:
    """A response with its exact slopes, at a frequency or the largest in a band, whose slope is that at the frequency
    where it is (the envelope theorem); None at poses. Raises as `peak`."""
    if plan.is_posed:
        return None
    out, into, *band = asked
    own = SlopedResponse(plan, parameters, names, out.known, into.known, float(band[-1]))
    if not own.is_known:
        return None
    if len(band) == 1:
        return own.magnitude(float(band[0]))
    found = _scanned(plan, parameters, out, into, *band)
    return own.magnitude(_top(own, found.low, found.high, (float(band[0]), float(band[1])), ROOT))
