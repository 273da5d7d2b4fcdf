"""Frequency responses from hits, against residues in closed form, against pyFRF and against an eigenvalue problem."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la

import flexura as fx
from flexura.testing.measurement.estimation import estimate_frf
from flexura.testing.measurement.spectra import Spectra, coherence, transfer, unrelated
from helpers.hits import HAMMER, OUTPUTS, POLES, POLES_HZ, RATE, RATIOS, hit, receptance


def truth(frf, drive=0):
    return receptance(2j * np.pi * frf.frequency_hz + frf.decay, drive)


def test_a_long_hit_gives_the_exact_response():
    (frf,) = estimate_frf([hit(40.0)])
    exact = truth(frf)
    # the response has fallen to exp(-0.01 2 pi 12 40) = 8e-14
    assert np.max(np.abs(frf.response[:, :, 0] - exact) / np.abs(exact)) < 1e-6
    assert frf.decay == 0 and frf.coherence is None and frf.averages == 1
    assert (frf.inputs, frf.outputs) == ((HAMMER,), OUTPUTS)
    assert frf.frequency_hz[0] == pytest.approx(1 / 40)


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_the_exponential_window_moves_the_poles_by_what_it_says(estimator):
    (frf,) = estimate_frf([hit(6.0), hit(6.0, scale=2.0)], exponential=1e-6, estimator=estimator)
    assert frf.decay == pytest.approx(np.log(1e6) / 6, rel=1e-12)
    exact = truth(frf)
    # what the window cuts off: 1e-6 exp(-0.01 2 pi 12 6) = 1e-8 of the peak
    assert np.max(np.abs(frf.response[:, :, 0] - exact)) < 1e-7 * np.abs(exact).max()
    # without taking the decay into account the peak is wrong by more than half
    undamped = receptance(2j * np.pi * frf.frequency_hz)
    assert np.abs(frf.response[:, 0, 0]).max() < 0.5 * np.abs(undamped[:, 0]).max()


def test_a_short_record_leaks_as_the_truncated_decay_does():
    (frf,) = estimate_frf([hit(6.0)], accept=("leakage",))
    k = int(np.argmax(np.abs(frf.response[:, 0, 0])))
    left = np.exp(POLES[0].real * (6.0 - 0.05))
    s = 2j * np.pi * frf.frequency_hz[k]
    expected = receptance(np.array([s]))[0, 0] * (1 - np.exp((POLES[0] - s) * (6.0 - 0.05)))
    assert frf.response[k, 0, 0] == pytest.approx(expected, rel=2e-3)
    assert left > 5e-3


def test_two_hammer_points_are_columns_and_setups_stand_apart():
    hits = [hit(30.0, 0, setup="a"), hit(30.0, 1, setup="a"), hit(30.0, 0, setup="b")]
    a, b = estimate_frf(hits)
    assert a.response.shape[1:] == (2, 2) and b.response.shape[1:] == (2, 1)
    assert (a.setup, b.setup) == ("a", "b")
    assert [c.name for c in a.inputs] == ["hammer", "hammer2"]
    np.testing.assert_allclose(a.response[:, :, 1], truth(a, 1), rtol=1e-5)
    # reciprocity
    np.testing.assert_allclose(a.response[:, 1, 0], a.response[:, 0, 1], rtol=1e-5)


def test_a_late_channel_is_put_right():
    late = 3.3e-4
    (frf,) = estimate_frf([hit(6.0, shift=late)], exponential=1e-6, delays={"p1.tz": late, "p2.tz": late})
    exact = truth(frf)
    assert np.max(np.abs(frf.response[:, :, 0] - exact)) < 1e-6 * np.abs(exact).max()
    (wrong,) = estimate_frf([hit(6.0, shift=late)], exponential=1e-6)
    assert np.max(np.abs(wrong.response[:, :, 0] - exact)) > 1e-3 * np.abs(exact).max()


def test_the_force_window_removes_noise_beside_the_pulse():
    hits = [hit(8.0, noise=(2e-2, 0.0), seed=k) for k in range(5)]
    (with_window,) = estimate_frf(hits, exponential=1e-3, force_window=5e-3, band=(5, 100))
    (without,) = estimate_frf(hits, exponential=1e-3, band=(5, 100))
    errors = [np.sqrt(np.mean(np.abs(f.response[:, 0, 0] / truth(f)[:, 0] - 1) ** 2)) for f in (with_window, without)]
    assert errors[0] < 0.3 * errors[1]


def test_offsets_before_the_hit_are_taken_off():
    plain = hit(8.0)
    off = replace(plain, samples=plain.samples + np.array([[0.01], [1e-5], [-2e-5]]))
    (a,), (b,) = (estimate_frf([r], exponential=1e-3) for r in (plain, off))
    np.testing.assert_allclose(b.response, a.response, rtol=1e-9, atol=1e-9 * np.abs(a.response).max())


def test_bias_of_h1_and_h2_under_noise():
    """Noise of relative power q in the force scales H1 by 1/(1 + q); noise in the output scales H2 by 1 + q."""
    rng = np.random.default_rng(5)
    n, q = 4000, 0.25
    F = rng.normal(size=(n, 1, 2)) @ np.array([1, 1j])
    G = 2.0 - 1.0j
    e = np.sqrt(q) * (rng.normal(size=(n, 1, 2)) @ np.array([1, 1j]))
    S_in = Spectra.of((F + e)[..., None], (G * F)[..., None])
    S_out = Spectra.of(F[..., None], (G * (F + e))[..., None])
    assert transfer(S_in, "H1")[0, 0, 0] == pytest.approx(G / (1 + q), rel=0.03)
    assert transfer(S_in, "H2")[0, 0, 0] == pytest.approx(G, rel=0.03)
    assert transfer(S_out, "H1")[0, 0, 0] == pytest.approx(G, rel=0.03)
    assert transfer(S_out, "H2")[0, 0, 0] == pytest.approx(G * (1 + q), rel=0.03)
    assert coherence(S_in)[0, 0, 0] == pytest.approx(1 / (1 + q), rel=0.03)
    both = Spectra.of((F + e)[..., None], (G * (F + e[::-1]))[..., None])
    assert transfer(both, "Hv")[0, 0, 0] == pytest.approx(G, rel=0.03)


def test_hv_is_the_geometric_mean_for_one_input_and_total_least_squares_for_two():
    rng = np.random.default_rng(3)
    F = rng.normal(size=(9, 4, 2)) + 1j * rng.normal(size=(9, 4, 2))
    X = rng.normal(size=(9, 4, 3)) + 1j * rng.normal(size=(9, 4, 3))
    one = Spectra.of(F[..., :1], X)
    H1, H2, Hv = (transfer(one, name) for name in ("H1", "H2", "Hv"))
    np.testing.assert_allclose(np.abs(Hv), np.sqrt(np.abs(H1) * np.abs(H2)), rtol=1e-12)
    np.testing.assert_allclose(np.angle(Hv / H1), 0, atol=1e-12)
    two = Spectra.of(F, X)
    Hv = transfer(two, "Hv")
    for f in range(4):
        for i in range(3):
            z = np.concatenate([F[:, f], X[:, f, i : i + 1]], axis=1)
            scale = np.linalg.norm(z, axis=0)
            a = la.svd(z / scale)[2][-1].conj() / scale  # z @ a is as small as it can be
            np.testing.assert_allclose(Hv[f, i], -a[:2] / a[2], rtol=1e-9)


def test_two_inputs_at_once_are_told_apart():
    rng = np.random.default_rng(4)
    F = rng.normal(size=(6, 5, 2)) + 1j * rng.normal(size=(6, 5, 2))
    H = rng.normal(size=(5, 3, 2)) + 1j * rng.normal(size=(5, 3, 2))
    S = Spectra.of(F, np.einsum("fpm,nfm->nfp", H, F))
    np.testing.assert_allclose(transfer(S, "H1"), H, rtol=1e-11)
    np.testing.assert_allclose(coherence(S), 1, rtol=1e-11)
    with pytest.raises(fx.OptionError, match="H2 of 2 inputs at once takes as many outputs; there are 1"):
        transfer(Spectra.of(F, F[..., :1], among=True), "H2")
    with pytest.raises(fx.OptionError, match="at least 2 records"):
        transfer(Spectra.of(F[:1], F[:1]), "H1")


def test_coherence_of_unrelated_signals_has_the_distribution_that_is_judged_by():
    rng = np.random.default_rng(8)
    F = rng.normal(size=(5, 4000, 1)) + 1j * rng.normal(size=(5, 4000, 1))
    X = rng.normal(size=(5, 4000, 1)) + 1j * rng.normal(size=(5, 4000, 1))
    gamma = coherence(Spectra.of(F, X))[:, 0, 0]
    for x in (0.2, 0.5, 0.8):
        assert np.mean(gamma > x) == pytest.approx((1 - x) ** 4, abs=0.02)
    assert unrelated(gamma, 5)
    assert not unrelated(coherence(Spectra.of(F, X + 3 * F))[:, 0, 0], 5)


def test_noise_makes_coherence_what_it_should_be():
    """White noise of rms e in the output alone: coherence is G/(G + noise power) at every line."""
    noise = 2e-6
    hits = [hit(20.0, noise=(0.0, noise), seed=k) for k in range(60)]
    (frf,) = estimate_frf(hits, band=(8, 40), accept=("leakage",))
    time = np.arange(round(20 * RATE)) / RATE
    power = np.abs(np.fft.rfft(hit(20.0).samples[1])) ** 2
    hz = np.fft.rfftfreq(len(time), 1 / RATE)
    expected = power / (power + len(time) * noise**2)
    lines = (hz >= 8) & (hz <= 40)
    assert frf.frequency_hz == pytest.approx(hz[lines])
    # standard deviation of an estimated coherence is at most 0.1 with 60 records, bias 1/60
    smooth = np.convolve(frf.coherence[:, 0, 0] - expected[lines], np.ones(64) / 64, "valid")
    assert np.abs(smooth).max() < 0.05
    assert expected[lines].min() < 0.5
    assert expected[lines].max() > 0.99


@pytest.mark.parametrize("estimator", ["H1", "H2"])
def test_against_pyfrf(estimator):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pyFRF = pytest.importorskip("pyFRF")
        hits = [hit(8.0, noise=(1e-3, 1e-7), seed=k, scale=1 + 0.2 * k) for k in range(4)]
        exc = np.array([h.samples[:1] for h in hits])
        resp = np.array([h.samples[1:] for h in hits])
        quiet = round(0.05 * RATE) - 20
        exc, resp = (x - x[..., :quiet].mean(axis=-1, keepdims=True) for x in (exc, resp))
        other = pyFRF.FRF(int(RATE), exc=exc, resp=resp, exc_type="f", resp_type="d", frf_estimator=estimator)
        theirs = other.get_FRF(frf_form="receptance")
        hz, gamma = other.get_f_axis(), other.get_coherence()
    (frf,) = estimate_frf(hits, estimator=estimator, accept=("leakage", "incoherent"), band=(1, 200))
    k = np.searchsorted(hz, frf.frequency_hz - 1e-9)
    np.testing.assert_allclose(hz[k], frf.frequency_hz)
    # offsets are taken from slightly other spans
    np.testing.assert_allclose(frf.response[:, :, 0], theirs[:, 0, k].T, rtol=1e-3, atol=1e-3 * np.abs(theirs).max())
    np.testing.assert_allclose(frf.coherence[:, :, 0], gamma[:, k].T, atol=5e-3)


def test_lines_end_where_the_force_does():
    (frf,) = estimate_frf([hit(40.0)])
    # exp(-(2 pi f w)^2) = 1e-4
    assert frf.frequency_hz[-1] == pytest.approx(np.sqrt(np.log(1e4)) / (2 * np.pi * 1e-3), abs=0.05)
    assert any("20 dB down at 341" in note for note in frf.notes)


def test_identification_takes_the_window_out_again():
    """A window that leaves 0.1 % adds 0.86 1/s to decay rates of 0.75 and 3.9 1/s; with noise 60 dB below the peaks."""
    quiet = 1e-3 * np.abs(hit().samples[1:]).max()
    hits = [hit(8.0, d, noise=(1e-3, quiet), seed=9 * d + k, name=f"{d} {k}") for d in (0, 1) for k in range(5)]
    frfs = estimate_frf(hits, exponential=1e-3, force_window=8e-3, band=(5, 60))
    assert frfs[0].decay == pytest.approx(np.log(1e3) / 8)
    found = fx.identify(fx.Measurement("two modes", frfs=frfs), select=POLES_HZ)
    np.testing.assert_allclose(found.frequency_hz, POLES_HZ, rtol=1e-3)
    np.testing.assert_allclose(found.damping_ratio, RATIOS, rtol=0.05)
