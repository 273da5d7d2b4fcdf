"""A plant and its controller, two FMUs that fmpy steps together: against SciPy's sampled loop, and the loops closed in
states, whose dead time and hold are rational."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
import scipy.linalg as la
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.errors import OptionError
from flexura.systems import StateSpace
from helpers.export_models import EXAMPLES

WHOLE = (EXAMPLES / "guide" / "servo.yaml").read_text().replace("guide.yaml", str(EXAMPLES / "guide" / "guide.yaml"))


def sampled(sample: str, delay: str) -> fx.Mechanism:
    text = WHOLE.replace("sample_time: 0.05 ms", f"sample_time: {sample}").replace("delay: 0.05 ms", f"delay: {delay}")
    return fx.loads(text)


def plant_of(whole: fx.Mechanism) -> StateSpace:
    built = fx.system(whole, inputs=["coil"], outputs=["gauge"], order="full")
    return fx.state_space(built, n=30, residual_modes=True)


class Stepped:
    """An FMU in co-simulation: values in and out by name, and steps."""

    def __init__(self, path: Path, stack: ExitStack) -> None:
        about = fmpy.read_model_description(str(path))
        self.refs = {v.name: v.valueReference for v in about.modelVariables}
        is2 = about.fmiVersion == "2.0"
        kind: Any = FMU2Slave if is2 else FMU3Slave
        folder = fmpy.extract(str(path), str(path.with_suffix("")))
        self.fmu = kind(
            guid=about.guid if is2 else about.instantiationToken,
            unzipDirectory=folder,
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.fmu.instantiate()
        if is2:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.get_values = self.fmu.getReal if is2 else self.fmu.getFloat64
        self.set_values = self.fmu.setReal if is2 else self.fmu.setFloat64
        stack.callback(self.fmu.freeInstance)
        stack.callback(self.fmu.terminate)

    def get(self, name: str) -> float:
        return float(self.get_values([self.refs[name]])[0])

    def set(self, name: str, value: float) -> None:
        self.set_values([self.refs[name]], [value])

    def step(self, time: float, h: float) -> None:
        self.fmu.doStep(time, h)


def together(plant: Path, controller: Path, reference: np.ndarray, h: float) -> np.ndarray:
    """Readings (k,) at the samples, of two units that exchange values at each."""
    readings = []
    with ExitStack() as stack:
        one, other = Stepped(plant, stack), Stepped(controller, stack)
        for k, wanted in enumerate(reference):
            readings.append(one.get("gauge"))
            other.set("servo.reading", readings[-1])
            other.set("servo.reference", wanted)
            one.set("coil", other.get("servo.command"))
            one.step(k * h, h)
            other.step(k * h, h)
    return np.array(readings)


def by_scipy(plant: StateSpace, controller: StateSpace, reference: np.ndarray, h: float) -> np.ndarray:
    """The same loop by SciPy's exponential of the plant, and the controller's own recursion."""
    n = plant.order
    E = la.expm(np.block([[plant.A, plant.B], [np.zeros((1, n + 1))]]) * h)
    x, xk, readings = np.zeros(n), np.zeros(controller.order), []
    for wanted in reference:
        y = float((plant.C @ x)[0])
        u = np.array([y, wanted])
        command = float((controller.C @ xk + controller.D @ u)[0])
        xk = controller.A @ xk + controller.B @ u
        readings.append(y)
        x = E[:n, :n] @ x + E[:n, n] * command
    return np.array(readings)


def ramped(time: np.ndarray) -> np.ndarray:
    """A smooth step of 1 um within 10 ms."""
    return 1e-6 * np.where(time < 0.01, np.sin(np.pi * np.minimum(time, 0.01) / 0.02) ** 2, 1.0)


@pytest.mark.parametrize("version", ["fmu", "fmi3"])
def test_two_units_together_are_the_sampled_loop(tmp_path: Path, version: str) -> None:
    whole = sampled("0.05 ms", "0.07 ms")
    plant, controller = plant_of(whole), fx.models.controller_model(whole)
    parts = [
        fx.export(model, tmp_path / f"{name}.fmu", format=version)[0]
        for name, model in (("plant", plant), ("servo", controller))
    ]
    assert validate_fmu(str(parts[1])) == []
    about = {v.name: v for v in fmpy.read_model_description(str(parts[1])).modelVariables}
    assert [about[f"servo.{name}"].unit for name in ("reading", "reference", "command")] == ["m", "m", "N"]
    h = 5e-5
    reference = ramped(h * np.arange(600))
    found, expected = together(*parts, reference, h), by_scipy(plant, controller, reference, h)
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


def test_what_the_rational_hold_leaves_out_falls_with_the_square_of_the_step(tmp_path: Path) -> None:
    """A closed loop in states has dead time and hold as one Pade form: twice as many samples, a quarter of the rest."""
    off = []
    for step in (1e-4, 5e-5):
        whole = sampled(f"{1e3 * step} ms", "0.03 ms")
        plant, controller = plant_of(whole), fx.models.controller_model(whole)
        parts = [fx.export(m, tmp_path / f"{n}{step}.fmu")[0] for n, m in (("p", plant), ("c", controller))]
        time = step * np.arange(int(0.03 / step))
        closed = fx.time_response(
            whole, inputs={"servo.reference": ramped}, outputs=["gauge"], dt=step, duration=0.03, loop="closed"
        )
        expected = closed.of("gauge")[: len(time)]
        off.append(np.abs(together(*parts, ramped(time), step) - expected).max() / np.abs(expected).max())
    assert off[1] < 2e-3
    assert off[1] < 0.35 * off[0]


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0, 2.45])
def test_dead_time_of_any_size(delay: float) -> None:
    """K e^(-s tau) where frequencies are low, to second order of the step."""
    h = 5e-5
    controller = fx.models.controller_model(sampled("0.05 ms", f"{max(delay, 1e-9) * 0.05} ms"))
    hz = np.array([20.0, 200.0])
    found = controller.frequency_response(hz)[:, 0, 1]
    s = 2j * np.pi * hz
    low, notch = 2 * np.pi * 1500, 2 * np.pi * 750
    K = 25e3 + 2e6 / s + 60 * s
    K /= 1 + np.sqrt(2) * s / low + (s / low) ** 2
    K *= (1 + 0.06 * s / notch + (s / notch) ** 2) / (1 + 0.6 * s / notch + (s / notch) ** 2)
    exact = K * np.exp(-s * delay * h)
    assert (np.abs(found / exact - 1) < 0.25 * (2 * np.pi * hz * h) ** 2 + 1e-9).all()


def test_what_cannot_be_a_controller_is_refused() -> None:
    whole = sampled("0.05 ms", "0.05 ms")
    with pytest.raises(OptionError, match="there is no controller 'serv'; known: servo"):
        fx.models.controller_model(whole, controller="serv")
    with pytest.raises(OptionError, match="servo is sampled every 50 µs: its steps are these"):
        fx.models.controller_model(whole, dt=1e-4)
    slow = fx.models.controller_model(sampled("0.5 ms", "0.05 ms"))
    assert "above half its rate of samples, 1000 Hz" in slow.warnings[0].text


def test_positive_position_feedback_has_no_reference() -> None:
    """gain w^2/(s^2 + 2 ratio w s + w^2) of the reading, and its command in the units of the actuator."""
    text = WHOLE[: WHOLE.index("controllers:")]
    text += "controllers:\n  damper: {sensor: gauge, actuator: coil, type: ppf, gain: 2 N/mm, frequency: 55 Hz}\n"
    whole = fx.loads(text)
    model = fx.models.controller_model(whole)
    assert [c.name for c in (*model.inputs, *model.outputs)] == ["damper.reading", "damper.command"]
    assert model.dt is None
    hz, w = np.array([5.0, 55.0, 300.0]), 2 * np.pi * 55
    s = 2j * np.pi * hz
    exact = 2e3 * w**2 / (s**2 + 0.6 * w * s + w**2)
    assert model.frequency_response(hz)[:, 0, 0] == pytest.approx(exact, rel=1e-12)
    steps = fx.models.controller_model(whole, dt=1e-5).frequency_response(hz)[:, 0, 0]
    assert steps == pytest.approx(exact, rel=5e-5)


def test_the_shell_writes_a_controller(tmp_path: Path) -> None:
    servo, out = str(EXAMPLES / "guide" / "servo.yaml"), tmp_path / "servo.fmu"
    runner = CliRunner()
    words = ["export", servo, "--what", "controller", "--controller", "servo", "--out", str(out)]
    done = runner.invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "in steps of 50 µs, within 1 % of it up to 1119 Hz, the hold left out" in done.output
    assert float(fmpy.read_model_description(str(out)).defaultExperiment.stepSize) == 5e-5
    assert runner.invoke(app, ["export", servo, "--controller", "servo", "--out", str(out)]).exit_code != 0
