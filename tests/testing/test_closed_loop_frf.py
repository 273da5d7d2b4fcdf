"""The plant within a loop, by the reference that excites the loop: sampled loops whose plant is known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import freqz
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.testing import estimate_frf

RATE = 200.0
POLE = np.exp((-0.05 + 1j) * 2 * np.pi * 12 / RATE)
DENOMINATOR = np.poly([POLE, POLE.conj()]).real
NUMERATORS = np.array([[0.0, 0.4, -0.1], [0.0, 0.1, 0.3]])
GAIN = 0.4


def loop(n=60_000, disturbance=1.0, seed=1):
    """u = r - GAIN y0, and y = G u + d, sample by sample; the second output is not fed back."""
    rng = np.random.default_rng(seed)
    r, d = rng.standard_normal(n), disturbance * rng.standard_normal((2, n))
    u, y = np.zeros(n), np.zeros((2, n))
    x = np.zeros((2, n))
    for k in range(2, n):
        x[:, k] = NUMERATORS[:, 1] * u[k - 1] + NUMERATORS[:, 2] * u[k - 2]
        x[:, k] -= DENOMINATOR[1] * x[:, k - 1] + DENOMINATOR[2] * x[:, k - 2]
        y[:, k] = x[:, k] + d[:, k]
        u[k] = r[k] - GAIN * y[0, k]
    channels = [fx.testing.MeasuredChannel("r", "voltage"), fx.testing.MeasuredChannel("u", "force")]
    channels += [fx.testing.MeasuredChannel(f"y{k}", "displacement") for k in range(2)]
    return fx.testing.Recording(RATE, np.vstack([r, u, y]), tuple(channels), (1,), name="loop")


def exact(hz):
    return np.stack([freqz(b, DENOMINATOR, worN=hz, fs=RATE)[1] for b in NUMERATORS], axis=1)[:, :, None]


def relative(frf):
    G = exact(frf.frequency_hz)
    return np.linalg.norm(frf.response - G) / np.linalg.norm(G)


def test_the_reference_takes_the_bias_of_feedback_away():
    record = loop()
    (direct,) = estimate_frf(fx.testing.Recording(RATE, record.samples[1:], record.channels[1:], (0,)), stretch=4.0)
    (joint,) = estimate_frf(record, stretch=4.0, references=["r"])
    assert [c.name for c in joint.inputs] == ["u"] and [c.name for c in joint.outputs] == ["y0", "y1"]
    assert joint.estimator == "joint" and "plant within its loop, by r" in joint.notes
    # H1 tends to (G S |r|^2 - K* S |d|^2) / ..., the joint estimate to G
    hz = direct.frequency_hz
    G = exact(hz)[:, 0, 0]
    biased = (G - GAIN) / (1 + GAIN**2)
    assert np.abs(direct.response[:, 0, 0] - biased).mean() < 0.25 * np.abs(biased - G).mean()
    assert np.abs((joint.response[:, 0, 0] - G).mean()) < 0.1 * np.abs(biased - G).mean()
    assert relative(joint) < 0.3 * relative(direct)
    longer = estimate_frf(loop(240_000), stretch=4.0, references=["r"])[0]
    assert relative(longer) < 0.7 * relative(joint)  # by half with four times the record: without bias


def test_without_noise_it_is_exact_but_for_leakage():
    (joint,) = estimate_frf(loop(disturbance=0.0), stretch=8.0, references=["r"])
    assert relative(joint) < 0.01
    assert np.median(joint.coherence) > 0.99


def test_two_inputs_by_two_references():
    rng = np.random.default_rng(3)
    r, d = rng.standard_normal((2, 60_000)), 0.5 * rng.standard_normal((2, 60_000))
    G, K = np.array([[1.0, 0.3], [-0.2, 0.8]]), np.array([[0.5, 0.1], [0.0, 0.4]])
    u = np.linalg.solve(np.eye(2) + K @ G, r - K @ d)  # a loop without memory
    names = [("r1", "voltage"), ("r2", "voltage"), ("u1", "force"), ("u2", "force"), ("y1", "rotation")]
    channels = tuple(fx.testing.MeasuredChannel(*name) for name in (*names, ("y2", "rotation")))
    record = fx.testing.Recording(RATE, np.vstack([r, u, G @ u + d]), channels, (2, 3))
    (joint,) = estimate_frf(record, stretch=1.0, references=["r1", "r2"])
    assert joint.response.mean(axis=0) == pytest.approx(G, abs=0.02)


def test_what_references_take():
    record = loop(4000)
    for options, message in (
        ({"references": ["q"]}, "loop has no channel 'q'; it has r, u, y0, y1"),
        ({"references": ["u"]}, r"the plant has 0 inputs \(none\), and there are 1 references"),
        ({"references": ["r"], "estimator": "Hv"}, "references have an estimator of their own"),
    ):
        with pytest.raises(fx.OptionError, match=message):
            estimate_frf(record, stretch=2.0, **options)
    idle = record.samples.copy()
    idle[0] = np.random.default_rng(9).standard_normal(4000)
    still = fx.testing.Recording(RATE, idle, record.channels, (1,))
    with pytest.raises(fx.OptionError, match="coheren"):
        estimate_frf(still, stretch=0.5, references=["r"])


def test_from_the_shell(tmp_path):
    data = fx.write_measurement(fx.Measurement("t", (loop(8000),)), tmp_path / "loop.npz")
    out = tmp_path / "frf.npz"
    done = CliRunner().invoke(
        app, ["estimate-frf", str(data), "--reference", "r", "--stretch", "2s", "--out", str(out)]
    )
    assert done.exit_code == 0, done.output
    (frf,) = fx.read_measurement(out).frfs
    assert frf.estimator == "joint" and frf.inputs[0].name == "u"
