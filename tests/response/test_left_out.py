"""A time response bounds what the modes that it leaves out would change: true, not far above, and said when large."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.analysis.responses.time_limits import _spectrum
from flexura.cli.app import app
from flexura.mechanism import with_rigid_bodies
from helpers.oscillators import beam, oscillator

EXAMPLES = Path(__file__).parents[2] / "examples"
NODES = {"tip_tilt/tip_tilt": "mirror", "rpr/rpr_piezo": "platform", "amplifier/amplifier": "output"}
INPUT = {"tip_tilt/tip_tilt": "leg1.piezo", "rpr/rpr_piezo": "rpu1.c.piezo", "amplifier/amplifier": "piezo"}


@cache
def example(name):
    """An example at full order, all its modes, and a step of a thirtieth of its fourth period.

    Of the platform, whose six lowest modes have nothing beside them, of its tenth.
    """
    node, read = NODES[name], {"rpr/rpr_piezo": ["rpu1.c.force"]}.get(name, [])
    outputs = [*read, *(f"{node}.tz{word}" for word in ("", ":velocity", ":acceleration"))]
    built = fx.system(
        with_rigid_bodies(fx.load(EXAMPLES / f"{name}.yaml")),
        inputs=[INPUT[name], f"{node}.tz"],
        outputs=outputs,
        order="full",
        damping=0.01,
    )
    every = built.modal()
    return built, every, 1 / (30 * every.frequency_hz[9 if NODES[name] == "platform" else 3])


def lost_of(result: fx.TimeResponse) -> fx.types.LeftOut:
    """What a response holds."""
    assert result.neglected is not None
    return result.neglected


def signals(name, dt, hz):
    """Steps, pulses, sines that begin gently, noise, impacts and releases, and a sine at the first mode left out."""
    time = dt * np.arange(900)
    rise = np.minimum(1, time / (300 * dt))
    rise = rise**2 * (3 - 2 * rise)
    force, stack = f"{NODES[name]}.tz", INPUT[name]
    low = 0.01 / dt
    return {
        "step": {"inputs": {stack: np.ones(900)}},
        "hammer": {"inputs": {force: fx.signals.half_sine(1.0, 15 * dt)}, "duration": 900 * dt},
        "sine": {"inputs": {stack: rise * np.sin(2 * np.pi * low * time)}},
        "noise": {"inputs": {stack: fx.signals.random(1.0, (0, 0.06 / dt))}, "duration": 900 * dt},
        "impulse": {"inputs": {}, "impulses": {force: 1.0}, "duration": 900 * dt},
        "release": {"inputs": {}, "start": {stack: 1.0}, "duration": 900 * dt},
        "held": {"inputs": {stack: np.sin(2 * np.pi * low * time)}, "hold": "zoh"},
        "driven": {"inputs": {stack: np.sin(2 * np.pi * hz * time)}},
    }


@pytest.mark.parametrize("kind", ["step", "hammer", "sine", "noise", "impulse", "release", "held", "driven"])
@pytest.mark.parametrize("name", NODES)
def test_the_error_is_below_the_bound(name, kind):
    """Against all modes of the full order, from the modes that the step resolves and from the default reduction."""
    built, every, dt = example(name)
    few = built.modal(up_to=1 / (10 * dt))
    kwargs = signals(name, dt, few.next_omega / 2 / np.pi)[kind]
    outputs = [c.name for c in built.outputs]
    exact = fx.time_response(every, dt=dt, outputs=outputs, **kwargs).response
    mechanism = with_rigid_bodies(fx.load(EXAMPLES / f"{name}.yaml"))
    ways = [fx.time_response(few, dt=dt, outputs=outputs, **kwargs)]
    if kind in ("step", "hammer"):
        ways.append(fx.time_response(mechanism, dt=dt, outputs=outputs, damping=0.01, **kwargs))
    for found in ways:
        lost = lost_of(found)
        error = np.abs(found.response - exact).max(axis=1)
        assert (error <= lost.bound + 1e-9 * lost.scale).all()
        if kind in ("step", "hammer", "noise", "release"):
            moved = error > 1e-5 * lost.scale
            # the platform weighs a thousand times what vibrates in its amplifiers, and hardly moves with it
            loose = 1000 if kind == "hammer" else 300 if NODES[name] == "platform" else 100
            assert (lost.bound[moved] < loose * error[moved]).all()


@pytest.mark.parametrize("kind", ["hammer", "sine"])
@pytest.mark.parametrize("name", NODES)
def test_velocity_under_what_is_slow(name, kind):
    """Residual modes: 1e-3 of the largest value, where without them per cents are missing."""
    built, every, dt = example(name)
    kwargs = signals(name, dt, 0.0)[kind]
    outputs = [f"{NODES[name]}.tz:velocity"]
    exact = fx.time_response(every, dt=dt, outputs=outputs, **kwargs).response
    found = fx.time_response(built.modal(up_to=1 / (10 * dt)), dt=dt, outputs=outputs, **kwargs)
    assert np.abs(found.response - exact).max() < 1.5e-3 * np.abs(exact).max()


def test_force_of_a_stack_under_a_step_is_said():
    """Modes above those that the step resolves carry tens of per cents of a force: a warning, gone in shorter steps."""
    rpr = fx.load(EXAMPLES / "rpr/rpr_piezo.yaml")
    told = {"inputs": {"rpu1.c.piezo": fx.signals.step(1.0)}, "outputs": ["rpu1.c.force"], "damping": 0.01}
    found = fx.time_response(rpr, dt=1e-3, duration=0.2, **told)
    warned = {w.kind: w for w in found.warnings}["tolerance"]
    assert warned.place == "rpu1.c.force" and warned.value > 0.1 and "shorter step" in warned.text
    gentle = fx.time_response(
        rpr, inputs={"rpu1.c.piezo": fx.signals.half_sine(1.0, 0.2)}, outputs=["lift"], dt=5e-4, duration=0.4
    )
    assert not gentle.warnings and lost_of(gentle).share < 0.01
    with pytest.raises(fx.LimitError, match=r"rpu1\.c\.force"):
        found.raise_warnings()


def test_shorter_steps_leave_out_less():
    """The bound of a step falls with the modes that are kept."""
    amplifier = fx.load(EXAMPLES / "amplifier/amplifier.yaml")
    shares = []
    for dt in (4e-5, 2e-5, 1e-5, 5e-6):
        found = fx.time_response(
            amplifier, inputs={"piezo": fx.signals.step(1e-5)}, outputs="motion", dt=dt, duration=2e-3, damping=0.01
        )
        shares.append(lost_of(found).share)
    assert (np.diff(shares) < 0).all() and shares[-1] < 0.01


@pytest.mark.parametrize("zeta", [0.0, 0.02])
def test_shock_spectrum_of_a_step_and_of_a_sine(zeta):
    """By hand: a step leaves a cosine of size 1; a sine at resonance grows with time, or to 1/(2 zeta)."""
    modes = fx.system(beam(8), inputs="b.tz", outputs="b.tz", order="full", damping=zeta or None).modal(3)
    period = 2 * np.pi / modes.next_omega
    time = period / 20 * np.arange(2000)
    worst = _spectrum(modes, np.ones(2000), time[1], "foh", 0.0)
    assert 1.0 <= worst[0, 0] < 1.001
    assert _spectrum(modes, np.ones(2000), time[1], "foh", 1.0)[0, 0] < 1e-9
    driven = _spectrum(modes, np.sin(modes.next_omega * time), time[1], "foh", 0.0)[0, 0]
    assert driven == pytest.approx(1 / (2 * zeta) if zeta else np.pi * 100, rel=0.15)


def test_inputs_that_are_driven_alike_act_as_one():
    """Four equal stacks do not turn the platform: nothing is said of roll, as it is with one of them."""
    rpr = fx.load(EXAMPLES / "rpr/rpr_piezo.yaml")
    alike = {"*.piezo": fx.signals.half_sine(1.0, 0.02)}
    found = lost_of(fx.time_response(rpr, inputs=alike, outputs=["lift", "roll", "pitch"], dt=1e-3, duration=0.1))
    assert found.shares[1:].max() < 1e-4 and "roll" not in found.text
    one = {"rpu1.c.piezo": alike["*.piezo"]}
    turned = lost_of(fx.time_response(rpr, inputs=one, outputs=["lift", "roll", "pitch"], dt=1e-3, duration=0.1))
    assert turned.bound[1:].max() > 1e3 * found.bound[1:].max()


def test_nothing_left_out_has_no_bound():
    """All modes of a finished system, and step-by-step integration, of which there are none left out."""
    built = fx.system(oscillator(), inputs=["mass.tx"], outputs=["mass.tx"])
    assert fx.time_response(built, inputs={"mass.tx": np.ones(9)}, dt=1e-3).neglected is None
    stepped = fx.time_response(built, inputs={"mass.tx": np.ones(9)}, dt=1e-3, method="generalised_alpha")
    assert stepped.neglected is None and stepped.to_dict()["neglected"] is None


def test_a_resonance_that_nothing_damps():
    """Driven at its frequency it grows with time: said from 100 times the static amplitude, not with damping."""
    hz = float(fx.system(oscillator(), inputs=["mass.tx"], outputs=["mass.tx"]).modal().frequency_hz[0])
    built = {zeta: fx.system(oscillator(damping=zeta), inputs=["mass.tx"], outputs=["mass.tx"]) for zeta in (0.0, 0.01)}
    own = float(built[0.0].modal().selected().frequency_hz[np.abs(built[0.0].modal().B[:, 0]).argmax()])
    dt = 1 / (40 * own)
    for cycles, ratio, kinds in ((20, 0.0, set()), (50, 0.0, {"resonance"}), (50, 0.01, set())):
        signal = {"mass.tx": fx.signals.sine(1e-6, own)}
        found = fx.time_response(built[ratio], inputs=signal, dt=dt, duration=cycles / own)
        assert {w.kind for w in found.warnings} == kinds
        if kinds:
            assert found.warnings[0].value == pytest.approx(np.pi * cycles, rel=0.02)
    assert hz > 0


def test_shell():
    """A line in the terminal, a key in JSON, and an error with --strict."""
    words = ["time-response", str(EXAMPLES / "rpr/rpr_piezo.yaml"), "--dt", "1ms", "--duration", "0.1s"]
    words += ["--step", "rpu1.c.piezo=1 V", "-o", "rpu1.c.force"]
    shown = CliRunner().invoke(app, words)
    assert shown.exit_code == 0 and "left out but for their static part" in shown.output
    data = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)
    assert data["neglected"]["bound_and_share"]["rpu1.c.force [N]"][1] > 0.1
    assert CliRunner().invoke(app, [*words, "--strict"]).exit_code == 1
