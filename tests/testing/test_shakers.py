"""Frequency responses under shakers: random, bursts and slow sweeps, of sampled systems whose responses are exact."""

import numpy as np
import pytest
from scipy.signal import chirp, lfilter
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.testing import estimate_frf
from helpers.shakers import HZ, RATE, off, record, response, truth


def test_two_random_inputs_are_told_apart():
    force = np.random.default_rng(1).standard_normal((2, 120_000))
    (frf,) = estimate_frf(record(force), stretch=16.0)
    assert frf.averages == 57 and off(frf) < 0.08
    assert np.median(frf.coherence) > 0.99
    (coarse,) = estimate_frf(record(force), stretch=2.0)
    assert off(coarse) > 2 * off(frf)  # lines wider than the modes
    modes = fx.identify(frf, band=(5, 80))
    assert modes.frequency_hz == pytest.approx(HZ, rel=1e-3)


def test_multiple_coherence_is_the_share_that_noise_leaves():
    (frf,) = estimate_frf(record(np.random.default_rng(1).standard_normal((2, 120_000)), noise=1.0), stretch=4.0)
    power = (np.abs(truth(frf.frequency_hz, 2)) ** 2).sum(axis=2)
    expected = power / (power + response(np.random.default_rng(1).standard_normal((2, 120_000))).var(axis=1))
    low = frf.frequency_hz < 100
    assert frf.coherence[low, :, 0].mean() == pytest.approx(expected[low].mean(), abs=0.02)


def test_bursts_that_have_died_out_need_no_window():
    rng = np.random.default_rng(2)
    records = []
    for k in range(4):
        force = np.zeros((2, 8192))
        force[:, 20:800] = rng.standard_normal((2, 780))
        records.append(record(force, f"burst {k}"))
    (frf,) = estimate_frf(records)
    assert off(frf) < 1e-6 and frf.averages == 4
    (one,) = estimate_frf([record(r.samples[:1], r.name) for r in records])
    assert off(one) < 1e-6  # many pulses, and no hit


def test_lasting_excitation_without_stretches_is_refused():
    for inputs in (1, 2):
        with pytest.raises(fx.OptionError, match="where the excitation lasts, a stretch"):
            estimate_frf(record(np.random.default_rng(1).standard_normal((inputs, 20_000))))


def test_a_slow_sweep():
    time = np.arange(60_000) / RATE
    (frf,) = estimate_frf(record(chirp(time, 4.0, time[-1], 90.0)[None]), stretch=16.0)
    assert off(frf) < 0.12
    assert np.abs(
        np.abs(frf.response[frf.frequency_hz.searchsorted(20.0)]) / np.abs(truth(np.array([20.0]), 1))[0]
    ) == (pytest.approx(1.0, abs=0.02))


def test_inputs_that_go_together_are_refused_or_named():
    one, other = np.random.default_rng(1).standard_normal((2, 60_000))
    with pytest.raises(fx.OptionError, match=r"shaker0, shaker1 go together at 100% of the lines"):
        estimate_frf(record(np.array([one, 2 * one + 0.05 * other])), stretch=4.0)
    hum = 30 * lfilter([1.0], [1, -2 * 0.999 * np.cos(2 * np.pi * 20 / RATE), 0.999**2], one)
    (frf,) = estimate_frf(record(np.array([one + hum, other + hum])), stretch=4.0)
    assert any("go together at" in note and "responses there are not known" in note for note in frf.notes)
    (apart,) = estimate_frf(record(np.array([one, other])), stretch=4.0)
    assert not any("go together" in note for note in apart.notes)


def test_what_is_no_stretch():
    random = record(np.random.default_rng(1).standard_normal((1, 4000)))
    for stretch in (0.01, 100.0):
        with pytest.raises(fx.OptionError, match="a stretch is a time up to the"):
            estimate_frf(random, stretch=stretch)
    for options in ({"stretch": -1.0}, {"stretch": 1.0, "exponential": 0.1}, {"stretch": 1.0, "force_window": 0.1}):
        with pytest.raises(fx.OptionError, match="has a window of its own"):
            estimate_frf(random, **options)


def test_from_the_shell(tmp_path):
    data, out = tmp_path / "random.npz", tmp_path / "frf.npz"
    force = np.random.default_rng(1).standard_normal((2, 20_000))
    fx.write_measurement(fx.Measurement("random", (record(force),)), data)
    done = CliRunner().invoke(app, ["estimate-frf", str(data), "--stretch", "8s", "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert fx.read_measurement(out).frfs[0].response.shape[1:] == (4, 2)
