"""The least-squares complex-frequency poles of the package sdypy-EMA, as a second opinion."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from flexura.testing.measurement.measurement import MeasuredFRF, Poles
from flexura.testing.measurement.response_matrices import response_matrices

POWER_NAMES = {0: "receptance", 1: "mobility", 2: "accelerance"}
"""How sdypy-EMA calls responses."""


def poles_by_ema(frf: MeasuredFRF, band: tuple[float, float], order: int = 60) -> Poles:
    """All poles of every order in a band (from, to), Hz, by sdypy-EMA, which fits responses to one input.

    No bit of stability is set. Its warnings are not shown. It does not know of exponential windows.
    """
    EMA = pytest.importorskip("sdypy.EMA")
    assert len(frf.inputs) == 1 and not frf.decay
    power = response_matrices([frf], band)[0].power
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = EMA.Model(
            frf=frf.response[:, :, 0].T,
            freq=frf.frequency_hz,
            lower=band[0],
            upper=band[1],
            pol_order_high=order,
            frf_type=POWER_NAMES[power],
        )
        model.get_poles(show_progress=False)
    count = [len(own) for own in model.pole_freq]
    hz, ratio = (np.concatenate([np.asarray(x, dtype=float) for x in own]) for own in (model.pole_freq, model.pole_xi))
    return Poles(np.repeat(np.arange(1, len(count) + 1), count), hz, ratio, np.zeros(len(hz), dtype=np.intp))
