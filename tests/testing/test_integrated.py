"""Measured receptances of a milling tool, accelerations over omega^2, and what identification says of doubtful modes.

A stand-in with the physics of a tap test: three modes and residual flexibility, white noise in the accelerations, drift
of the amplifier towards 0 Hz.
"""

from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from flexura.testing.measurement.channels import MeasuredChannel
from flexura.testing.measurement.measurement import MeasuredFRF, Recording

TOOL = np.array([[812.0, 0.031, 3.8e-7], [1640.0, 0.022, 2.2e-7], [3310.0, 0.018, 1.2e-7]])
"""Frequency, Hz, damping ratio and static compliance, m/N, of each mode."""


def tap_test(noise=0.003, drift=0.0, offset=0.0, step=2.5, seed=0, quantity="displacement"):
    """Frequency response of the tip to a hammer; noise, drift and offset are shares of the largest acceleration."""
    rng = np.random.default_rng(seed)
    hz = np.arange(step, 5000.0, step)
    w, (f, z, a) = 2 * np.pi * hz[:, None], TOOL.T
    w0 = 2 * np.pi * f
    A = -((w**2)[:, 0]) * (5e-9 + (a * z * w0**2 / (w0**2 - w**2 + 2j * z * w * w0)).sum(axis=1))
    size = np.abs(A).max()
    white = rng.standard_normal((2, len(hz))) / np.sqrt(2)
    A = A + size * (noise * (white[0] + 1j * white[1]) + drift * step / (1j * hz) + offset * np.exp(1j * seed))
    H = {"displacement": -A / w[:, 0] ** 2, "acceleration": A, "velocity": A / (1j * w[:, 0])}[quantity]
    hammer = MeasuredChannel("hammer", "force", "tip", (1.0, 0.0, 0.0))
    return MeasuredFRF(hz, H[:, None, None], (hammer,), (MeasuredChannel("tip", quantity, "tip", (1.0, 0.0, 0.0)),))


@pytest.mark.parametrize("quantity", ["displacement", "velocity"])
@pytest.mark.parametrize("how", [{}, {"noise": 0.01}, {"drift": 0.1}, {"noise": 1e-4}, {"step": 10.0}])
def test_an_integrated_receptance_gives_its_modes_without_options(quantity, how):
    for seed in range(3):
        found = fx.identify(tap_test(seed=seed, quantity=quantity, **how))
        assert found.frequency_hz == pytest.approx(TOOL[:, 0], rel=6e-3)
        assert found.damping_ratio == pytest.approx(TOOL[:, 1], rel=0.12)
        assert sum("grow towards 0 Hz as accelerations divided" in note for note in found.notes) == 1
        assert found.shapes == pytest.approx(
            fx.identify(tap_test(seed=seed, quantity="acceleration", **how)).shapes, 0.1
        )


def test_what_was_measured_as_motion_is_fitted_as_motion():
    """Noise of a displacement sensor is white in displacements; the receptance of a held tool is flat near 0 Hz."""
    clean = tap_test(noise=0.0)
    rng = np.random.default_rng(1)
    noise = 0.01 * np.abs(clean.response).max() * rng.standard_normal((2, *clean.response.shape))
    found = fx.identify(replace(clean, response=clean.response + noise[0] + 1j * noise[1]))
    assert found.frequency_hz[:2] == pytest.approx(TOOL[:2, 0], rel=2e-3)
    assert not any("grow towards" in note for note in found.notes)
    assert not any("grow towards" in note for note in fx.identify(clean).notes)


def test_lines_of_nothing_but_noise_are_left_out_by_name():
    (note,) = (n for n in fx.identify(tap_test(noise=0.02)).notes if "grow towards" in n)
    hz = float(note.split("from ")[1].split(" Hz")[0])
    assert 100 < hz < 812


@pytest.mark.parametrize("noise", [0.0, 1e-4, 3e-3])
def test_a_pick_without_a_pole_is_refused(noise):
    data = tap_test(noise=noise)
    for pick in ([2500.0], [812.0, 4000.0], [100.0], [812.0, 812.0]):
        with pytest.raises(fx.OptionError, match=f"there is no pole near {pick[-1]:g} Hz"):
            fx.identify(data, select=pick)
    assert fx.identify(data, select=[815.0, 3300.0]).frequency_hz == pytest.approx(TOOL[::2, 0], rel=2e-3)


def test_bias_that_is_no_noise_is_in_the_spread():
    """A constant share in the accelerations is nothing that modes explain; it moves the lowest of them by 1 %, which
    noise alone says to be known to 0.05 %."""
    for seed in range(4):
        found = fx.identify(tap_test(offset=0.01, noise=0.002, seed=seed))
        error = abs(found.frequency_hz[0] / TOOL[0, 0] - 1)
        first = found.evidence[0]
        assert error < 2 * first.frequency_spread
        assert abs(found.damping_ratio[0] / TOOL[0, 1] - 1) < 2 * first.damping_spread
    assert error > 4 * first.frequency_sigma
    clean = fx.identify(tap_test(noise=0.002)).evidence
    assert max(e.frequency_spread for e in clean) < 1.5e-3


def test_lines_wider_than_a_mode_leave_its_damping_unsure():
    """A line as wide as the mode between its half-power points: an error of a third (Bendat and Piersol 2010)."""
    w = 2 * np.pi * np.arange(1.0, 400.0, 2.0)
    w0, z = 2 * np.pi * 150.3, 2.0 / (2 * 150.3)
    H = 1 / (w0**2 - w**2 + 2j * z * w * w0)
    frf = replace(tap_test(), frequency_hz=w / (2 * np.pi), response=H[:, None, None])
    (e,) = fx.identify(frf).evidence
    assert e.damping_bias == pytest.approx(1 / 3, rel=0.02)
    assert e.frequency_bias == pytest.approx(z / 3, rel=0.02)


def test_modes_closer_than_the_lines_are_said():
    """Two directions of a tool 0.6 Hz apart on lines 1 Hz apart: two inputs tell them, the lines hardly do."""
    hz = np.arange(1.0, 300.0, 1.0)
    w = 2 * np.pi * hz[:, None, None]
    rng = np.random.default_rng(3)
    H = np.zeros((len(hz), 2, 2), dtype=complex)
    for f, shape in ((120.0, [1.0, 0.3]), (120.6, [-0.3, 1.0])):
        w0 = 2 * np.pi * f
        H = H + np.outer(shape, shape) / (w0**2 - w**2 + 0.04j * w * w0)
    H = H + 1e-4 * np.abs(H).max() * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
    ends = [((1.0, 0.0, 0.0), "x"), ((0.0, 1.0, 0.0), "y")]
    ins = tuple(MeasuredChannel(f"hit {n}", "force", "tip", d) for d, n in ends)
    outs = tuple(MeasuredChannel(f"tip {n}", "displacement", "tip", d) for d, n in ends)
    found = fx.identify(MeasuredFRF(hz, H, ins, outs))
    assert found.frequency_hz == pytest.approx([120.0, 120.6], abs=0.05)
    assert any("closer than the lines, which are 1 Hz apart" in note for note in found.notes)


def test_the_offset_of_the_hammer_is_taken_out():
    """A charge amplifier leaves the hammer with an offset, and the record begins with the pulse: the response to
    a mass on a spring comes back, where the offset would add to all of it near 0 Hz."""
    rate, n, m, f0, z = 2000.0, 4000, 1.0, 40.0, 0.05
    t = np.arange(n) / rate
    force = np.where(t < 4e-3, 100 * np.sin(np.pi * t / 4e-3), 0.0)
    w0, wd = 2 * np.pi * f0, 2 * np.pi * f0 * np.sqrt(1 - z**2)
    impulse = np.exp(-z * w0 * t) * np.sin(wd * t) / (m * wd)
    x = np.convolve(force, impulse)[:n] / rate
    channels = (MeasuredChannel("h", "force"), MeasuredChannel("x", "displacement"))

    def at(offset):
        return fx.testing.estimate_frf(Recording(rate, np.stack([force + offset, x]), channels, (0,)))[0]

    clean, off = at(0.0), at(3.0)
    assert off.response == pytest.approx(clean.response, rel=1e-9)
    assert abs(clean.response[0, 0, 0]) == pytest.approx(1 / (m * w0**2), rel=0.01)


def test_no_mode_is_said_without_misleading_advice():
    rng = np.random.default_rng(0)
    data = tap_test()
    noise = rng.standard_normal((2, *data.response.shape))
    with pytest.raises(fx.OptionError, match="no mode is stable over the orders: leave lines that are noise out"):
        fx.identify(replace(data, response=noise[0] + 1j * noise[1]))
