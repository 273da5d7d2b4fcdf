"""Input shapers: closed forms, exact zeros in samples, and a stage under them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import flexura as fx
from helpers.disturbed import ONE
from helpers.over import over

M, K, C = 2.0, 800.0, 4.0
OMEGA, RATIO = np.sqrt(K / M), C / (2 * np.sqrt(K * M))
HZ = OMEGA / (2 * np.pi)
DT = 1e-3


def shaped(kind: Any, dashpot: float = C, **options) -> fx.Shaper:
    text = ONE.replace("4 N*s/m", f"{dashpot} N*s/m").format(disturbances="{}")
    return fx.shaper(fx.loads(text), kind=kind, **{"dt": DT, **options})


def test_times_and_amplitudes_of_a_damped_mass():
    """Singer and Seering 1990: half periods of the damped motion, K = exp(-zeta pi/sqrt(1 - zeta^2))."""
    k, half = np.exp(-RATIO * np.pi / np.sqrt(1 - RATIO**2)), np.pi / (OMEGA * np.sqrt(1 - RATIO**2))
    zv, zvd = shaped("ZV"), shaped("ZVD")
    assert zv.time_s == pytest.approx([0, half], rel=1e-9)
    assert zv.amplitude == pytest.approx(np.array([1, k]) / (1 + k), rel=1e-9)
    assert zvd.time_s == pytest.approx([0, half, 2 * half], rel=1e-9)
    assert zvd.amplitude == pytest.approx(np.array([1, 2 * k, k**2]) / (1 + k) ** 2, rel=1e-9)


def test_an_ei_shaper_without_damping_is_that_of_its_closed_form():
    """Singhose, Seering and Singer 1994: (1 + V)/4, (1 - V)/2, (1 + V)/4."""
    found = shaped("EI", dashpot=0.0, vibration=0.08)
    assert found.amplitude == pytest.approx([1.08 / 4, 0.92 / 2, 1.08 / 4], rel=1e-9)


@over("kind", ("ZV", "ZVD", "EI"))
def test_the_width_below_five_percent_is_that_of_its_closed_form(kind):
    """Undamped vibrations |cos(pi r/2)|, its square, and |(1 + V)/2 cos(pi r) + (1 - V)/2| at r times the frequency."""
    widths = {"ZV": 2 * np.arcsin(0.05), "ZVD": 2 * np.arcsin(np.sqrt(0.05)), "EI": np.pi - np.arccos(-0.85 / 1.05)}
    found = shaped(kind, dashpot=0.0)

    def beyond(ratio: float) -> float:
        return float(found.residual(HZ * ratio, 0.0, sampled=False)) - 0.05000001

    grid = np.linspace(0.5, 1.5, 2001)
    below = grid[[beyond(x) < 0 for x in grid]]
    low, high = brentq(beyond, below[0] - 1e-3, below[0]), brentq(beyond, below[-1], below[-1] + 1e-3)
    assert high - low == pytest.approx(2 / np.pi * widths[kind], abs=1e-6)


@over("kind", ("ZV", "ZVD", "EI"))
def test_samples_do_to_a_mode_what_impulses_did(kind):
    found = shaped(kind, dt=0.0137)
    left = 0.05 if kind == "EI" else 0.0
    assert found.residual(found.frequency_hz, found.damping_ratio, sampled=False) == pytest.approx([left], abs=1e-12)
    assert found.residual(found.frequency_hz, found.damping_ratio) == pytest.approx([left], abs=2e-3 if left else 1e-12)
    assert found.weights.sum() == pytest.approx(1.0) and (found.weights > 0).all()
    if kind == "ZVD":
        near = found.residual(found.frequency_hz * 1.001, found.damping_ratio)
        assert near[0] < 1e-5


def test_a_shaped_step_leaves_two_modes_at_rest():
    """Two of three modes that a step shakes: after the last impulse they rest, and the third goes on."""
    guide = fx.load("examples/guide/servo.yaml")
    found = fx.shaper(guide, dt=2e-4, modes=[1, 3], kind="ZV")
    model = fx.state_space(fx.system(guide, order="full"), n=5).discretised(2e-4)
    fir = np.zeros(found.steps[-1] + 1)
    fir[found.steps] = found.weights
    command = np.convolve(np.ones(400), fir)[:400]
    x, y = np.zeros(model.order), []
    for u in command:
        y.append(x.copy())
        x = model.A @ x + model.B[:, 0] * u
    states, after = np.array(y), int(found.steps[-1]) + 1
    plain = np.zeros(model.order)
    for _ in range(400):
        plain = model.A @ plain + model.B[:, 0]
    moving = np.abs(states[after:, 1::2]).max(axis=0)
    largest = np.abs(states[:, 1::2]).max(axis=0)
    assert (moving[[0, 2]] < 1e-10 * largest[[0, 2]]).all()


REFUSED = {
    "kind is ZV, ZVD, EI": {"kind": "UM"},
    "no slower than half the rate": {"dt": 0.2},
    "there is no mode 99999": {"modes": [99999]},
    "modes are numbers from 1 on": {"modes": [0]},
    "a share between 0 and 1": {"vibration": 1.5},
    "damped beyond vibration": {"dashpot": 100.0},
    "leaves less than 5 % anyway": {"kind": "EI", "dashpot": 64.0},
    "a shaper of more than 65535 steps": {"dt": 1e-6},
}


@over("rule", REFUSED)
def test_what_is_refused(rule):
    with pytest.raises(fx.OptionError, match=rule):
        shaped(**{"kind": "ZV", **REFUSED[rule]})
