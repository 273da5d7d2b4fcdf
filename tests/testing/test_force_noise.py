"""Forces that fall into the noise of their channel: by how much, against the noise that was added."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import freqz, lfilter

import flexura as fx
from flexura.testing import estimate_frf
from helpers.shakers import RATE, record, response, truth

HOLE = 31.0
NOISE = 0.08


def hole(radius=0.9):
    """A filter that takes a band around HOLE out of white noise, as a shaker that follows its structure does."""
    turn = np.exp(2j * np.pi * HOLE / RATE)
    return np.poly([0.99 * turn, 0.99 / turn]).real, np.poly([radius * turn, radius / turn]).real


def dropped(inputs=1, noise=NOISE, outputs=4, output_noise=0.0, n=120_000):
    rng = np.random.default_rng(1)
    force = rng.standard_normal((inputs, n))
    force[0] = lfilter(*hole(), force[0])
    y = response(force)[:outputs]
    y = y + output_noise * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
    channels = record(force[:, :2]).channels[: inputs + outputs]
    measured = force + noise * rng.standard_normal(force.shape)
    return fx.testing.Recording(RATE, np.vstack([measured, y]), channels, tuple(range(inputs)))


def expected(hz, noise=NOISE):
    """Share of noise in the power of the force, in closed form."""
    signal = np.abs(freqz(*hole(), worN=hz, fs=RATE)[1]) ** 2
    return noise**2 / (signal + noise**2)


def notes(frf):
    return [note for note in frf.notes if "is down" in note]


def test_lines_are_named_where_h1_is_low():
    (frf,) = estimate_frf(dropped(), stretch=16.0)
    line = int(np.argmin(np.abs(frf.frequency_hz - HOLE)))
    share = expected(frf.frequency_hz[line])
    assert share > 0.2
    low = 1 - np.abs(frf.response[line, :, 0] / truth(frf.frequency_hz[[line]], 1)[0, :, 0])
    assert low.mean() == pytest.approx(share, abs=0.1)
    (note,) = notes(frf)
    assert note.startswith("shaker0 is down, and so much of it is noise, at ")
    assert "H1 is that low; take H2 there, or Hv" in note
    first, last = (float(x.split()[0]) for x in note.split("at ")[1].split(" (")[0].split(" to "))
    low = frf.frequency_hz[expected(frf.frequency_hz) > 0.05]
    assert (first, last) == pytest.approx((low[0], low[-1]), abs=0.5)
    named = float(note.split("dB down, ")[1].split(" %")[0]) / 100
    assert named == pytest.approx(expected(frf.frequency_hz).max(), abs=0.12)


def test_hv_is_half_as_low_and_h2_is_not():
    (hv,), (h2,) = (estimate_frf(dropped(), stretch=16.0, estimator=name) for name in ("Hv", "H2"))
    assert "Hv is half that low" in notes(hv)[0] and not notes(h2)


def test_without_noise_or_without_a_hole_nothing_is_named():
    for record_ in (dropped(noise=0.0), dropped(noise=0.0, output_noise=0.3)):
        assert not notes(estimate_frf(record_, stretch=16.0)[0])
    flat = record(np.random.default_rng(1).standard_normal((1, 120_000)), noise=0.3)
    assert not notes(estimate_frf(flat, stretch=16.0)[0])


@pytest.mark.parametrize(("inputs", "outputs"), [(1, 1), (2, 4)])
def test_where_noise_cannot_be_told_its_bound_is_named(inputs, outputs):
    (frf,) = estimate_frf(dropped(inputs, outputs=outputs, noise=0.1), stretch=16.0)
    assert any("shaker0 is down, and at most so much of it is noise" in note for note in notes(frf))
