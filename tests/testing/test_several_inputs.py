"""Several inputs at once: H2 and partial coherence, of spectra that are given in closed form, and of records."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.io import read_measurement, write_measurement
from flexura.testing import estimate_frf
from flexura.testing.measurement.spectra import Spectra, coherence, partial_coherence, transfer
from helpers.shakers import RATE, off, record, response, truth


def matrices(lines=6, outputs=4, inputs=2):
    """Responses, and the spectral matrix of inputs that go together in part."""
    rng = np.random.default_rng(11)
    H, A = (rng.normal(size=(lines, *s, 2)) @ [1, 1j] for s in ((outputs, inputs), (inputs, inputs)))
    return H, A @ A.conj().transpose(0, 2, 1)


def exact(H, G, force_noise=0.0, output_noise=0.0):
    """Spectra of endless records with noise of these powers in every input and every output."""
    among = H @ G @ H.conj().transpose(0, 2, 1) + output_noise * np.eye(H.shape[1])
    xx = np.einsum("fpp->fp", among).real
    return Spectra(G + force_noise * np.eye(G.shape[1]), H @ G, xx, 1000, among)


@pytest.mark.parametrize("outputs", [2, 4])
def test_noise_of_the_forces_biases_h1_and_not_h2(outputs):
    H, G = matrices(outputs=outputs)
    S = exact(H, G, force_noise=0.3)
    np.testing.assert_allclose(transfer(S, "H2"), H, rtol=1e-9)
    expected = H @ G @ np.linalg.inv(G + 0.3 * np.eye(2))
    np.testing.assert_allclose(transfer(S, "H1"), expected, rtol=1e-9)
    assert np.abs(expected - H).max() > 0.1 * np.abs(H).max()
    units = np.array([1e-6, 1.0, 9.81, 1e3])[:outputs, None]
    np.testing.assert_allclose(transfer(exact(units * H, G, 0.3), "H2"), units * H, rtol=1e-9)


def test_partial_coherence_is_that_of_what_the_other_input_leaves():
    """Conditioned spectra: what the other input explains is taken out of both (Bendat and Piersol 2010, ch. 7)."""
    H, G = matrices()
    S = exact(H, G, output_noise=0.7)
    partial = partial_coherence(S)
    for j, k in ((0, 1), (1, 0)):
        other = G[:, k, k].real
        output = S.xx - np.abs(S.xf[:, :, k]) ** 2 / other[:, None]
        own = G[:, j, j].real - np.abs(G[:, j, k]) ** 2 / other
        cross = S.xf[:, :, j] - S.xf[:, :, k] * (G[:, k, j] / other)[:, None]
        np.testing.assert_allclose(partial[:, :, j], np.abs(cross) ** 2 / own[:, None] / output, rtol=1e-9)
    multiple = coherence(S)[:, :, 0]  # 1 - multiple is the product of what each input in turn leaves
    first = np.abs(S.xf[:, :, 0]) ** 2 / G[:, 0, 0].real[:, None] / S.xx
    np.testing.assert_allclose(1 - multiple, (1 - first) * (1 - partial[:, :, 1]), rtol=1e-9)
    assert partial_coherence(exact(H[..., :1], G[:, :1, :1])) is None


def test_records_with_noisy_forces(tmp_path):
    rng = np.random.default_rng(1)
    force = rng.standard_normal((2, 120_000))
    noisy = np.vstack([force + 0.5 * rng.standard_normal(force.shape), response(force)])
    data = fx.testing.Recording(RATE, noisy, record(force).channels, (0, 1))
    (h1,), (h2,), (hv,) = (estimate_frf(data, stretch=16.0, estimator=name) for name in ("H1", "H2", "Hv"))
    lines = (h1.frequency_hz > 5) & (h1.frequency_hz < 80)
    exact = truth(h1.frequency_hz[lines], 2)

    def scale(frf):
        H = frf.response[lines]
        return np.vdot(exact, H).real / np.vdot(exact, exact).real

    assert scale(h1) == pytest.approx(1 / 1.25, abs=0.02)
    assert scale(h2) == pytest.approx(1.0, abs=0.03)
    assert scale(h1) < scale(hv) < 1.0
    assert any("as near a single mode: H2 of shaker0, shaker1 is uncertain there" in note for note in h2.notes)
    assert h2.partial_coherence.shape == h2.response.shape
    path = write_measurement(fx.Measurement("t", (), (h2,)), tmp_path / "t.npz")
    np.testing.assert_array_equal(read_measurement(path).frfs[0].partial_coherence, h2.partial_coherence)


def test_an_input_that_does_nothing_has_no_partial_coherence():
    force = np.random.default_rng(5).standard_normal((2, 60_000))
    driven = record(force[:1])
    idle = fx.testing.MeasuredChannel("idle", "force", "n9", (0, 0, 1))
    noise = 1e-3 * driven.samples[1:].std() * np.random.default_rng(6).standard_normal((4, 60_000))
    samples = np.vstack([force, driven.samples[1:] + noise])
    data = fx.testing.Recording(RATE, samples, (driven.channels[0], idle, *driven.channels[1:]), (0, 1))
    (frf,) = estimate_frf(data, stretch=4.0)
    assert np.median(frf.coherence) > 0.95 and off(fx.testing.estimate_frf(driven, stretch=16.0)[0]) < 0.1
    n = frf.averages
    assert np.median(frf.partial_coherence[..., 0]) > 0.95
    assert frf.partial_coherence[..., 1].mean() < 4 / n  # unrelated signals have about 1 / n
