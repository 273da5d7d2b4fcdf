"""Settling after moves: closed forms of one mass, motion step by step, and loops."""

import numpy as np
import pytest
from scipy.optimize import brentq

import flexura as fx
from helpers.disturbed import one_mass
from helpers.shell import flexura

M, K, C = 2.0, 800.0, 4.0
AIR = "{air: {input: block.tx, density: 1 mN/sqrt(Hz)}}"
SERVO = "examples/guide/servo.yaml"


def left_of_one_mass(t, over: float):
    """What is missing of F/k after a force grew over a time: 1 - y k/F = exp(-d t) (cos + d/w sin), and its mean."""
    d = C / (2 * M)
    w = np.sqrt(K / M - d * d)

    def step(t):
        return np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t)) / K

    if not over:
        return step(t)
    x, weights = np.polynomial.legendre.leggauss(60)
    return sum(0.5 * own * step(t + over * (1 + at) / 2) for at, own in zip(x, weights, strict=True))


@pytest.mark.parametrize("over", [0.0, 0.05, 0.7])
@pytest.mark.parametrize("share", [0.5, 0.02, 1e-5])
def test_one_mass_after_a_force(over, share):
    found = fx.budget(one_mass(AIR), moves={"block.tx": 3.0}, over=over, within={"x": share * 3 / K}, outputs=["x"])
    [own] = found.settling
    assert own.final == pytest.approx(3 / K, rel=1e-12)
    t = np.linspace(0, 20, 400_001)
    outside = np.flatnonzero(np.abs(left_of_one_mass(t, over)) > share / K)
    expected = 0.0
    if len(outside):
        k = outside[-1]
        expected = brentq(lambda x: abs(left_of_one_mass(x, over)) - share / K, t[k], t[k + 1], xtol=1e-14)
    assert own.time_s == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_the_band_is_three_sigma_unless_it_is_given():
    found = fx.budget(one_mass(AIR), moves={"block.tx": 3.0}, outputs=["x", "v"])
    assert [own.within for own in found.settling] == found.three_sigma.tolist()
    assert found.settling[1].final == 0.0 and found.settling[1].time_s > 0
    assert fx.budget(one_mass(AIR)).settling == ()
    [data, _] = found.to_dict()["points"]
    assert data["settling"][0]["time_s"] == found.settling[0].time_s


def test_a_closed_loop_settles_as_its_motion_step_by_step_does():
    servo, dt, over = fx.load(SERVO), 1e-5, 4e-3
    [own] = fx.budget(servo, moves={"servo.reference": 1e-5}, over=over, within={"gauge": 1e-8}).settling
    ramp = {"servo.reference": lambda t: 1e-5 * np.clip(t / over, 0, 1)}
    moved = fx.time_response(servo, inputs=ramp, outputs=["gauge"], dt=dt, duration=0.4, loop="closed")
    outside = np.flatnonzero(np.abs(moved.response[0] - own.final) > 1e-8)
    assert own.time_s == pytest.approx(moved.time[outside[-1]] - over, abs=2 * dt)
    assert own.final == pytest.approx(1e-5, rel=1e-9)  # it integrates


def test_what_cannot_be_asked():
    mechanism = one_mass(AIR)
    for options, words in (
        ({"over": 1.0}, "belong to moves"),
        ({"moves": {"block.tx": 0.0}}, "not zero, not 0"),
        ({"moves": {"block.tx": 1.0}, "over": -1.0}, "lasts a time"),
        ({"moves": {"block.tx": 1.0}, "within": {"x": -1e-9}}, "a band is positive"),
        ({"moves": {"block.tx": 1.0}, "within": {"far": 1e-9}}, "no channel 'far'"),
        ({"moves": {"far.tx": 1.0}}, "far"),
    ):
        with pytest.raises(fx.OptionError, match=words):
            fx.budget(mechanism, **options)


def test_references_have_the_unit_of_their_sensor_in_commands():
    shown = flexura("budget", SERVO, "--move", "servo.reference=10 um", "--over", "5ms", "--within", "gauge=20 nm")
    assert shown.returncode == 0 and "servo.reference by 10 µm over 5 ms" in shown.stdout
    moved = flexura("time-response", SERVO, "--dt", "0.1ms", "--duration", "1ms", "--step", "servo.reference=1 um")
    assert "no input" in moved.stderr  # of an open loop
    wrong = flexura("budget", SERVO, "--move", "servo.reference=10 N")
    assert wrong.returncode == 2 and "N is no unit of gauge" in wrong.stderr
    command = ("--output", "servo.command", "--within", "servo.command=1 uN")
    assert flexura("budget", SERVO, "--move", "servo.reference=1 um", *command).returncode == 0
