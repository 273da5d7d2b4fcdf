"""Model and test with the sensors of each placement on: against simulated tests, and masses that follow by hand."""

import numpy as np
import pytest

import flexura as fx
from flexura.testing.measurement.channels import MeasuredChannel
from flexura.testing.measurement.measurement import IdentifiedModes
from flexura.testing.rig.test_points import ModalTestRig
from helpers.tested_stage import STAGE, TEST

HEAVY = TEST.replace("8 g", "40 g").replace("5 g", "25 g")
FREE = """
flexura: 1
parameters:
  kz: {value: 9 kN/m, minimum: 2 kN/m, maximum: 40 kN/m}
  mass: {value: 0.4 kg, minimum: 0.1 kg, maximum: 2 kg}
bodies:
  stage: {centre: [0, 0, 0], mass: mass, inertia: [200 kg*mm^2, 300 kg*mm^2, 500 kg*mm^2]}
springs:
  mount:
    nodes: [stage]
    stiffness: {tx: 40 kN/m, ty: 60 kN/m, tz: kz, rx: 900 N*m/rad, ry: 2000 N*m/rad, rz: 6000 N*m/rad}
test:
  sample_rate: 400 Hz
  duration: 5 s
  pulse: 12 ms
  hammer: {h: {node: stage, direction: z}}
  accelerometers:
    light: {node: stage, direction: z, mass: 10 g}
    heavy: {node: stage, direction: z, mass: 70 g}
  placements: {one: [light], two: [heavy]}
"""


@pytest.fixture(scope="module")
def stage():
    return fx.loads(STAGE + HEAVY)


@pytest.fixture(scope="module")
def tested(stage):
    return fx.virtual_test(stage, seed=3)


def test_frequencies_are_those_with_the_sensors_on(stage, tested):
    """Up to a tenth of the stage's mass in sensors: without them the model is several per cent off."""
    found = fx.correlate(stage, test=tested.identified, measurement=tested.measurement)
    assert len(found.pairs) == 6
    assert max(abs(p.error) for p in found.pairs) < 2e-3
    assert min(o.frac.min() for o in found.frfs) > 0.98
    assert [m.how for m in found.matched] == ["test"] * 5
    assert sum("carries the sensors of first, second" in note for note in found.notes) == 1
    bare = fx.correlate(stage.model_copy(update={"test": None}), test=tested.identified, within=0.1)
    assert max(abs(p.error) for p in bare.pairs) > 0.02


def test_mean_frequencies_over_placements_are_those_of_each_by_itself(stage, tested):
    found = fx.correlate(stage, test=tested.identified)
    rig = ModalTestRig(stage)
    each = [rig.modes(name).frequency_hz for name in ("first", "second")]
    assert found.model_hz[:6] == pytest.approx(np.mean(each, axis=0)[:6], rel=2e-5)


def test_low_order_model_carries_them_too(stage, tested):
    full, low = (fx.correlate(model, test=tested.identified) for model in (stage, fx.reduce(stage)))
    assert low.model_hz == pytest.approx(full.model_hz, rel=1e-9)


def measured(setup, sensor, hz):
    """The lift of the stage at a frequency, Hz, read by one sensor."""
    channel = MeasuredChannel(sensor, "acceleration", None, None)
    one = np.ones((1, 1))
    return IdentifiedModes(
        "t", np.array([2j * np.pi * hz]), one + 0j, one, one + 0j, (), (channel,), (), (), 0, setup=setup
    )


@pytest.mark.parametrize("order", ["full", "low"])
def test_stiffness_and_mass_from_two_loads(order):
    """f1 = sqrt(k/(m + m1)), f2 = sqrt(k/(m + m2)): two sensors of known mass tell k and m, which one test cannot."""
    k, m = 11e3, 0.5
    data = [
        measured(name, sensor, np.sqrt(k / (m + own)) / (2 * np.pi))
        for name, sensor, own in (("one", "light", 0.01), ("two", "heavy", 0.07))
    ]
    found = fx.calibrate(fx.loads(FREE), data=data, free=["kz", "mass"], method="least_squares", order=order)
    assert found.values == pytest.approx({"kz": k, "mass": m}, rel=1e-6)


def test_a_setup_without_a_name_is_known_by_its_sensors():
    k, m = 11e3, 0.4
    data = measured("", "heavy", np.sqrt(k / (m + 0.07)) / (2 * np.pi))
    found = fx.calibrate(fx.loads(FREE), data=data, free=["kz"], method="least_squares")
    assert found.values["kz"] == pytest.approx(k, rel=1e-6)
    assert fx.correlate(fx.loads(FREE), test=data).matched[0].how == "test"


def test_a_test_that_is_not_the_described_one_is_said():
    data = measured("elsewhere", "stage.tz", 23.0)
    note = "no setup of the data is a placement"
    assert any(note in own for own in fx.correlate(fx.loads(FREE), test=data).notes)
    assert not any(
        note in own for own in fx.correlate(fx.loads(FREE).model_copy(update={"test": None}), test=data).notes
    )


def test_calibration_is_not_biased_by_the_sensors(stage, tested):
    """A spring that is too soft in the file is found from the setups, each with its sensors."""
    text = STAGE.replace("tz: 9 kN/m", "tz: kz")
    text = text.replace("bodies:", "parameters: {kz: {value: 8 kN/m, minimum: 4 kN/m, maximum: 20 kN/m}}\nbodies:")
    each = list(tested.identified.setups)
    found = fx.calibrate(fx.loads(text + HEAVY), data=each, free=["kz"], method="least_squares", sigma=1e-3)
    blind = fx.calibrate(fx.loads(text), data=[tested.identified.frequency_hz[2]], free=["kz"], method="least_squares")
    assert found.values["kz"] == pytest.approx(9e3, rel=3e-3)
    assert blind.values["kz"] != pytest.approx(9e3, rel=0.03)


@pytest.mark.slow
def test_responses_are_those_of_their_own_placement(stage, tested):
    """The same spring from the frequency responses of both placements; without their mass it is off."""
    text = STAGE.replace("tz: 9 kN/m", "tz: kz")
    text = text.replace("bodies:", "parameters: {kz: {value: 8.7 kN/m, minimum: 4 kN/m, maximum: 20 kN/m}}\nbodies:")
    damping = float(np.mean(tested.identified.damping_ratio))
    how = {"method": "least_squares", "damping": damping}
    found = fx.calibrate(fx.loads(text + HEAVY), data=list(tested.measurement.frfs), free=["kz"], **how)
    assert found.values["kz"] == pytest.approx(9e3, rel=2e-3)
    light = HEAVY.replace("mass: 40 g", "mass: 0 g").replace("mass: 25 g", "mass: 0 g")
    bare = fx.calibrate(fx.loads(text + light), data=list(tested.measurement.frfs), free=["kz"], **how)
    assert bare.values["kz"] != pytest.approx(9e3, rel=0.02)
