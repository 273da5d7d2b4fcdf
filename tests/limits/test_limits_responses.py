"""Responses in time and frequency and kinetostatics say where they stop holding."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.analysis.limits import limits
from flexura.analysis.responses import time_limits
from flexura.cli.app import app

EXAMPLES = Path(__file__).parents[2] / "examples"
AMPLIFIER = EXAMPLES / "amplifier" / "amplifier.yaml"
GUIDE = EXAMPLES / "guide" / "guide.yaml"
L, B, T, E, YIELD = 0.1, 0.01, 0.001, 200e9, 300e6
STIFFNESS, MASS = 3 * E * B * T**3 / 12 / L**3, 10.0
VISCOUS = {"rayleigh": {"frequencies": (1.0, 10.0), "ratios": (1e-6, 1e-6)}}


@pytest.fixture(scope="module")
def heavy():
    """A cantilever with a tip of many times its own mass: one mode that is its static deflection."""
    link = fx.describe.Link(
        nodes=("a", "b"),
        material="steel",
        reference=(0, 0, 1),
        section=fx.describe.Rectangle(width=B, thickness=T),
        elements=4,
    )
    mechanism = fx.Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"steel": fx.describe.Material(E=E, nu=0.3, rho=7800.0, yield_stress=YIELD)},
        nodes={"a": (0, 0, 0), "b": (L, 0, 0)},
        links={"bar": link},
        masses={"tip": fx.describe.PointMass(node="b", mass=MASS)},
        ground={"a": "clamped"},
    )
    C = np.diagonal(fx.compliance(mechanism, nodes=["b"]))
    axis = ["tx", "ty", "tz"][int(np.argmax(C[:3]))]
    return mechanism, f"b.{axis}", np.sqrt(STIFFNESS / MASS) / (2 * np.pi)


def warned(result):
    return {w.kind: w for w in result.warnings}


@pytest.mark.parametrize("how", [{}, {"method": "generalised_alpha"}, {"method": "generalised_alpha", "order": "full"}])
def test_step_reaches_twice_the_static_state(heavy, how):
    mechanism, name, hz = heavy
    deflected = 0.06 * L

    def pushed(share):
        signal = {name: fx.signals.step(STIFFNESS * deflected * share)}
        return fx.time_response(
            mechanism, inputs=signal, outputs=[name], dt=1 / (400 * hz), duration=1 / hz, damping=VISCOUS, **how
        )

    assert pushed(0.5).warnings == ()
    found = warned(pushed(1.0))
    assert found["rotation"].value == pytest.approx(2 * 1.5 * 0.06, rel=2e-3)
    assert found["rotation"].place == "b" and f"at {0.5 / hz:.2g}" in found["rotation"].text
    assert found["displacement"].value == pytest.approx(2 * deflected, rel=2e-3)
    assert found["stress"].value == pytest.approx(2 * 1.5 * E * T / L * 0.06 / YIELD, rel=2e-3)


def test_all_ways_to_the_same_warnings(heavy, monkeypatch):
    mechanism, name, hz = heavy
    samples = 3 * np.random.default_rng(1).standard_normal(3000)
    kept, free = (
        fx.time_response(
            mechanism, inputs={name: samples}, outputs=[name], dt=1 / (50 * hz), damping=0.01, keep_modes=keep, keep=2
        )
        for keep in (True, False)
    )
    found = warned(free)
    assert found == warned(kept)
    # the worst of all states, one by one, without what stiffer modes follow statically
    states = limits.States(kept.run.modes.system.full_order, kept.displacements(range(3000)))
    every = [*limits.motion_limits(states), *limits.stress_limits(states)]
    assert {w.kind for w in every} == {"rotation", "displacement", "stress"} == set(found)
    for own in every:
        assert found[own.kind].value == pytest.approx(own.value, rel=1e-5)
    monkeypatch.setattr(time_limits, "BLOCK", 700)
    again = fx.time_response(mechanism, inputs={name: samples}, outputs=[name], dt=1 / (50 * hz), damping=0.01, keep=2)
    assert {k: w.value for k, w in warned(again).items()} == pytest.approx({k: w.value for k, w in found.items()})


def test_what_no_mode_carries_counts(heavy):
    mechanism, name, hz = heavy
    slow = fx.time_response(
        mechanism, inputs={name: fx.signals.step(STIFFNESS * 0.2 * L)}, outputs=[name], dt=10 / hz, duration=100 / hz
    )
    assert slow.run.modes.order == 0
    assert warned(slow)["displacement"].value == pytest.approx(0.2 * L, rel=1e-6)


@pytest.mark.parametrize(("command", "count"), [(10e-6, 0), (3e-3, 1), (-30e-6, 1)])
def test_commands_over_time(command, count):
    amplifier = fx.load(AMPLIFIER)
    result = fx.time_response(
        amplifier, inputs={"piezo": fx.signals.step(command)}, outputs=["motion"], dt=2e-6, duration=4e-3, damping=0.01
    )
    found = [w for w in result.warnings if w.kind == "command"]
    assert len(found) == count
    assert all(w.place == "piezo" and w.value == command for w in found)
    if abs(command) < 1e-3:
        assert [w for w in result.warnings if w.kind != "command"] == []


def test_noise_on_both_sides_of_rest():
    amplifier = fx.load(AMPLIFIER)
    noise = 40e-6 * np.random.default_rng(2).standard_normal(400)
    result = fx.time_response(amplifier, inputs={"piezo": noise}, outputs=["motion"], dt=2e-5, damping=0.01)
    both = [w for w in result.warnings if w.kind == "command"]
    assert sorted(w.limit for w in both) == pytest.approx([0.0, 30e-6])


def test_undamped_resonances():
    guide = fx.load(GUIDE)
    first = float(fx.modes(guide, n=1, order="full").frequency_hz[0])
    ask = {"inputs": ["carriage.tx"], "outputs": ["carriage.tx"]}
    for how in ({}, {"order": "full"}, {"order": "full", "method": "direct"}, {"order": "exact"}):
        found = warned(fx.frequency_response(guide, frequency_hz=[0.5 * first, first * (1 + 1e-5)], **ask, **how))
        assert set(found) == {"resonance"}
        assert f"{first:.4g}" in found["resonance"].text
        assert fx.frequency_response(guide, frequency_hz=[0.5 * first, 1.1 * first], **ask, **how).warnings == ()
    assert fx.frequency_response(guide, band=(10, 100), damping=0.01, **ask).warnings == ()
    # at the very end of what is asked
    assert set(warned(fx.frequency_response(guide, frequency_hz=[0.5 * first, first * (1 - 1e-5)], **ask))) == {
        "resonance"
    }


def test_beyond_what_is_proven():
    rpr = fx.load(EXAMPLES / "rpr" / "rpr.yaml")
    ask = {"inputs": ["platform.tz"], "outputs": ["platform.tz"]}
    blind = fx.reduce(rpr)
    found = warned(_of(blind, 600))
    assert set(found) == {"proof"} and "missing" in found["proof"].text
    assert _of(blind, 22).warnings == ()
    few = fx.system(rpr, **ask, tolerance=1e-3, up_to=100.0, damping=0.01).modal(n=5)
    found = warned(fx.frequency_response(few, band=(1, 100)))
    assert found["proof"].limit == pytest.approx(few.next_omega / (2 * np.pi))


def _of(model, top):
    built = fx.system(model, inputs=["platform.tz"], outputs=["platform.tz"], damping=0.01)
    return fx.frequency_response(built, band=(1, top))


def test_workspace_beyond_the_linear_range():
    amplifier = fx.load(AMPLIFIER)
    assert set(warned(fx.kinetostatics(amplifier, platform="output"))) == {"stiffness"}
    found = warned(fx.kinetostatics(amplifier, platform="output", parameters={"piezo_stroke": 600e-6}))
    same = warned(fx.statics(amplifier, parameters={"piezo_stroke": 600e-6}, actuators={"piezo": 600e-6}))
    assert {"rotation", "stress"} <= set(found)
    for kind in found:
        assert found[kind].value == pytest.approx(same[kind].value, rel=1e-6)


RUNS = {
    "statics": [str(AMPLIFIER), "--actuator", "piezo=3 mm"],
    "kinetostatics": [str(AMPLIFIER), "--platform", "output", "--set", "piezo_stroke=600 um"],
    "frequency-response": [str(GUIDE), "--band", "10,100 Hz", "-i", "carriage.tx", "-o", "carriage.tx"],
    "time-response": [
        *(str(AMPLIFIER), "--dt", "0.02ms", "--duration", "2ms", "--step", "piezo=3 mm", "--damping", "0.01")
    ],
}


@pytest.mark.parametrize("command", RUNS)
def test_shell(command, tmp_path):
    run = [command, *RUNS[command]]
    plain = CliRunner().invoke(app, run)
    assert plain.exit_code == 0 and "warning: " in plain.stdout
    data = json.loads(CliRunner().invoke(app, [*run, "--json"]).stdout)
    assert data["warnings"]
    assert set(data["warnings"][0]) == {"kind", "place", "value", "limit", "unit", "text"}
    plot = ["--plot", str(tmp_path)] if command.endswith("response") else []
    strict = CliRunner().invoke(app, [*run, *plot, "--strict"])
    assert strict.exit_code == 1 and isinstance(strict.exception, fx.LimitError) and not strict.stdout
    assert not list(tmp_path.iterdir())


def test_pictures_say_it():
    amplifier = fx.load(AMPLIFIER)
    for command, words in ((3e-3, ["warning: piezo is driven with 3 mm"]), (10e-6, [])):
        signal = {"piezo": fx.signals.step(command)}
        result = fx.time_response(amplifier, inputs=signal, outputs=["motion"], dt=2e-6, duration=4e-3, damping=0.01)
        texts = [text.get_text() for text in fx.view.draw_time(result).texts if text.get_text() != result.name]
        assert len(texts) == len(words) and all(w in t for w, t in zip(words, texts, strict=True))


def test_motion_about_a_described_load_starts_from_it(heavy):
    mechanism, name, hz = heavy
    axis = ["tx", "ty", "tz"].index(name[-2:])
    force = np.eye(3)[axis] * STIFFNESS * 0.09 * L
    loaded = mechanism.model_copy(update={"loads": {"b": fx.describe.Load(force=tuple(map(float, force)))}})
    push = {name: fx.signals.step(STIFFNESS * 0.03 * L)}
    for how in ({}, {"method": "generalised_alpha", "order": "full"}):
        ask = {"dt": 1 / (400 * hz), "duration": 1 / hz, "damping": VISCOUS, **how}
        assert fx.time_response(mechanism, inputs=push, outputs=[name], **ask).warnings == ()
        found = warned(fx.time_response(loaded, inputs=push, outputs=[name], **ask))
        assert found["displacement"].value == pytest.approx((0.09 + 2 * 0.03) * L, rel=2e-3)
