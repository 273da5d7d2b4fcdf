"""FMUs of plants that know their pose: fmpy's simulations against Python's by SciPy, an energy in closed form, and what
is told where the motion leaves the stroke."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmpy.validation import validate_fmu

import flexura as fx
from flexura.systems import Frozen, ScheduledSystem, chebyshev_points
from helpers.export_models import EXAMPLES

FORCE, SHIFT, SINK = "carriage.tx.force", "carriage.tx.displacement", "carriage.tz"
OUTPUTS = ["carriage.tx", "carriage.tz", "carriage.tx:velocity", "carriage.tz:acceleration"]
VERSIONS = pytest.mark.parametrize("version", ["fmu", "fmi3"])


@pytest.fixture(scope="module")
def plant() -> fx.ScheduledPlant:
    guide = fx.load(EXAMPLES / "guide" / "guide.yaml")
    ends: dict[str, Any] = {"inputs": ["carriage.tx"], "outputs": OUTPUTS, "damping": 0.01}
    return fx.scheduled_plant(guide, move={"carriage.x": (0, 9e-3)}, n=3, tolerance=0.1, **ends)


@pytest.fixture(scope="module")
def units(plant: fx.ScheduledPlant, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("posed")
    return {name: fx.export(plant, folder / f"{name}.fmu", format=name)[0] for name in ("fmu", "fmi3")}


def simulated(path: Path, kind: str, dt: float, duration: float, values: dict[str, float], **more: Any) -> Any:
    own = {"step_size": dt} if kind == "CoSimulation" else {"solver": "CVode", "relative_tolerance": 1e-9}
    return fmpy.simulate_fmu(
        str(path), fmi_type=kind, stop_time=duration, output_interval=dt, start_values=values, **own, **more
    )


@VERSIONS
def test_a_description_is_valid(units: dict[str, Path], plant: fx.ScheduledPlant, version: str) -> None:
    assert validate_fmu(str(units[version])) == []
    about = fmpy.read_model_description(str(units[version]))
    found = {v.name: v for v in about.modelVariables}
    assert [v.name for v in about.modelVariables if v.causality == "output"][:2] == [SHIFT, SINK]
    assert found["der(carriage.x)"].derivative is found["carriage.x"]
    assert {"carriage.x above its lowest", "carriage.x below its highest"} <= set(found)
    depends = {u.variable.name: {v.name for v in u.dependencies} for u in about.outputs}
    with zipfile.ZipFile(units[version]) as archive:
        assert archive.read("modelDescription.xml").decode().count("providesDirectionalDerivative") == 2
    assert FORCE not in depends[SHIFT]
    assert FORCE in depends["carriage.tz:acceleration"]
    assert f"{plant.speed:.3g} m/s" in about.description
    sizes = [float(found[name].nominal) for name in (*plant.state_names, SHIFT, SINK)]
    assert sizes[0] == 9e-3
    assert min(sizes) > 1e-7  # those of what moves, whatever is symmetric somewhere


@VERSIONS
@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_a_push_over_most_of_the_stroke(
    units: dict[str, Path], plant: fx.ScheduledPlant, version: str, kind: str
) -> None:
    """Against SciPy's method of order 8, whose errors are kept to the same 1e-8: accelerations to 1e-5, whose error is
    that of displacements by the square of the highest frequency."""
    dt, duration = 1e-4, 0.012
    expected = plant.time_response(inputs={"carriage.tx": lambda t: 20.0 + 0 * t}, dt=dt, duration=duration)
    found = simulated(units[version], kind, dt, duration, {FORCE: 20.0})
    assert expected.of("carriage.tx").max() > 7e-3
    for name, channel, worst in zip(found.dtype.names[1:], plant.outputs, (1e-7, 1e-6, 1e-6, 1e-5), strict=True):
        own = expected.of(channel.name)
        assert np.abs(found[name][: len(own)] - own).max() < worst * np.abs(own).max(), name


def test_steps_of_any_size_and_other_starts(units: dict[str, Path], plant: fx.ScheduledPlant) -> None:
    """Rest under a force stays; one step of 3 ms is thirty of 0.1 ms; half a gain is half the force."""
    rest = plant.family.resting(np.array([20.0]))
    states = dict(zip(plant.state_names, rest, strict=False))
    held = simulated(units["fmu"], "CoSimulation", 1e-3, 5e-3, {**states, FORCE: 20.0})
    assert np.abs(held[SHIFT] - rest[0]).max() < 1e-9 * rest[0]
    long, short = (
        simulated(units["fmu"], "CoSimulation", dt, 3e-3, {FORCE: 20.0, f"{FORCE}.gain": 0.5})[-1]
        for dt in (3e-3, 1e-4)
    )
    half = simulated(units["fmi3"], "CoSimulation", 1e-4, 3e-3, {FORCE: 10.0})[-1]
    assert long[SHIFT] == pytest.approx(short[SHIFT], rel=1e-7)
    assert half[SHIFT] == pytest.approx(short[SHIFT], rel=1e-14)


@VERSIONS
@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_the_motion_ends_at_the_end_of_the_stroke(
    units: dict[str, Path], plant: fx.ScheduledPlant, version: str, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where and when Python says that it does."""
    with pytest.raises(fx.SolverError, match=r"at carriage.x = 9 mm, ([\d.]+) ms after") as error:
        plant.time_response(inputs={"carriage.tx": lambda t: 60.0 + 0 * t}, dt=1e-4, duration=0.02)
    when = 1e-3 * float(str(error.value).split("= 9 mm, ")[1].split(" ms")[0])
    early = {"early_return_allowed": True} if version == "fmi3" and kind == "CoSimulation" else {}
    found = simulated(units[version], kind, 2e-4, 0.02, {FORCE: 60.0}, **early)
    assert found["time"][-1] == pytest.approx(when, abs=1e-7)
    assert found[SHIFT][-1] == pytest.approx(9e-3, abs=1e-9)
    assert capsys.readouterr().out.count("carriage.x leaves the stroke, 0 to 9 mm, and the motion ends there") == 1


def test_without_early_return_a_step_is_discarded(units: dict[str, Path]) -> None:
    with pytest.raises(FMICallException) as error:
        simulated(units["fmi3"], "CoSimulation", 2e-4, 0.02, {FORCE: 60.0})
    assert error.value.status == 2


def rolling(plant: fx.ScheduledPlant, stiff: float) -> tuple[fx.ScheduledPlant, Any]:
    """p and one deviation of a plant whose Lagrangian is (m p'^2 + 2 mu p' xi' + xi'^2 - s p^2 - k xi^2)/2 with
    m = 2 + a p^2, mu = b p, of which T44 is all; and its energy."""
    points, a, b, s = chebyshev_points(-1.0, 1.0, 5), 0.6, 0.4, 3.0
    one, none = np.ones(5), np.zeros(5)
    M = np.stack([np.stack([2 + a * points**2, b * points], -1), np.stack([b * points, one], -1)], -2)
    K = np.stack([np.stack([s * one, none], -1), np.stack([none, stiff * one], -1)], -2)
    m, p = len(plant.inputs), len(plant.outputs)
    swing = np.stack([a * points, b * one], -1)
    samples = Frozen(
        M, 0 * K, K, np.zeros((5, 2, m)), np.zeros((5, p, 2)), np.zeros((5, p, m)), s * points,
        np.zeros((5, p)), swing,
    )  # fmt: skip
    family = ScheduledSystem("p", "m", points, samples, plant.family.derivative, plant.family.D)

    def energy(p: Any, xi: Any, v: Any, w: Any) -> Any:
        kinetic = (2 + a * p**2) * v**2 + 2 * b * p * v * w + w**2
        return (kinetic + s * p**2 + stiff * xi**2) / 2

    return replace(plant, family=family), energy


def test_the_energy_of_a_free_motion_stays(plant: fx.ScheduledPlant, tmp_path: Path) -> None:
    """Without damping, over 160 periods of the slow coordinate and 1600 of the fast one: steps of order 5 take some,
    less than 1e-8 of the energy each, and add none."""
    free, energy = rolling(plant, 150.0)
    path = fx.export(free, tmp_path / "free.fmu")[0]
    names = list(free.state_names)
    found = simulated(path, "CoSimulation", 0.5, 800.0, {names[0]: 0.8, names[1]: 0.05}, output=names, validate=False)
    E = energy(*(found[name] for name in names))
    off = E / E[0] - 1
    assert np.ptp(found[names[0]]) > 1.2
    assert off.max() < 1e-8
    assert off.min() > -2e-5
    faint = simulated(path, "CoSimulation", 5.0, 800.0, {names[0]: 0.0, names[1]: 1e-13}, output=names)
    E = energy(*(faint[name] for name in names))
    assert (np.diff(E) < 0).all()  # where the error that is allowed leaves steps as long as they may be


def unit_at(path: Path, kind: Any) -> tuple[Any, dict[str, int]]:
    """A unit after initialization, and value references by name."""
    about = fmpy.read_model_description(str(path))
    is_two = about.fmiVersion == "2.0"
    part: Any = about.coSimulation if kind in (FMU2Slave, FMU3Slave) else about.modelExchange
    token = about.guid if is_two else about.instantiationToken
    folder = path.with_suffix("")
    if not folder.exists():
        fmpy.extract(str(path), str(folder))
    fmu = kind(guid=token, unzipDirectory=folder, modelIdentifier=part.modelIdentifier, instanceName="one")
    fmu.instantiate()
    if is_two:
        fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    return fmu, {v.name: v.valueReference for v in about.modelVariables}


@pytest.mark.parametrize("kind", [FMU2Model, FMU3Model, FMU2Slave, FMU3Slave])
@pytest.mark.parametrize("at", [0.1, 0.5, 0.97])
def test_slopes_are_the_limits_of_differences(
    units: dict[str, Path], plant: fx.ScheduledPlant, kind: Any, at: float
) -> None:
    """Of outputs and derivatives of a plant in motion, by its force, its gain and all states, one by one and together;
    and at rest those of Python's state space about the pose, but for the pose itself, of which the force is another."""
    is_two = kind in (FMU2Model, FMU2Slave)
    fmu, ref = unit_at(units["fmu" if is_two else "fmi3"], kind)
    get, put = (fmu.getReal, fmu.setReal) if is_two else (fmu.getFloat64, fmu.setFloat64)
    names = list(plant.state_names)
    known = [ref[name] for name in (*names, FORCE, f"{FORCE}.gain")]
    about = fmpy.read_model_description(str(units["fmu"]))
    outputs = [u.variable.valueReference for u in about.outputs]
    unknown = [*outputs, *(ref[f"der({name})"] for name in names)]
    size = {v.name: float(v.nominal or 1.0) for v in about.modelVariables}
    sizes = np.array([*(size[name] for name in names), 20.0, 1.0])
    rng = np.random.default_rng(5)
    where = 0.2 * sizes * rng.uniform(-1, 1, len(sizes))
    where[[0, -2, -1]] = at * 9e-3, 12.0, 1.3

    def outcome(values: np.ndarray) -> np.ndarray:
        put(known, values.tolist())
        return np.array(get(unknown))

    slopes = []
    for direction in (*np.diag(sizes), sizes * rng.uniform(-1, 1, len(sizes))):
        h = 1e-3
        rough, fine = ((outcome(where + k * direction) - outcome(where - k * direction)) / (2 * k) for k in (h, h / 2))
        outcome(where)
        found = np.array(fmu.getDirectionalDerivative(unknown, known, direction.tolist()))
        slopes.append([(4 * fine - rough) / 3, found])
    expected, found = np.swapaxes(np.array(slopes), 0, 1)
    assert np.abs(expected[0, [0, 1, 3]]).min() > 0  # these outputs feel where the plant is
    assert (np.abs(found - expected) <= 1e-8 * np.abs(expected) + 1e-10 * np.abs(expected).max(axis=0)).all()
    outcome(np.array([at * 9e-3, *np.zeros(len(names)), 1.0]))
    still = [fmu.getDirectionalDerivative(unknown, [one], [1.0]) for one in known[1:-1]]
    model = plant.state_space(at * 9e-3)
    whole = np.block([[model.C, model.D], [model.A, model.B]])[:, 1:]
    assert (np.abs(np.array(still).T - whole) <= 1e-9 * np.abs(whole).max(axis=1, keepdims=True)).all()
    fmu.freeInstance()


def test_a_start_outside_and_a_state_that_is_kept(units: dict[str, Path]) -> None:
    about = fmpy.read_model_description(str(units["fmu"]))
    refs = {v.name: v.valueReference for v in about.modelVariables}
    folder = fmpy.extract(str(units["fmu"]), str(units["fmu"].with_suffix("")))
    fmu = FMU2Slave(
        guid=about.guid, unzipDirectory=folder, modelIdentifier=about.coSimulation.modelIdentifier, instanceName="one"
    )
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.setReal([refs["carriage.x"], refs[FORCE]], [8.99e-3, 100.0])
    fmu.exitInitializationMode()
    before = fmu.getFMUstate()
    with pytest.raises(FMICallException):
        fmu.doStep(0.0, 1e-2)
    reached = fmu.getRealStatus(2)
    assert 0 < reached < 1e-2
    assert fmu.getReal([refs["carriage.x"]])[0] == pytest.approx(9e-3, abs=1e-10)
    fmu.setFMUstate(before)
    fmu.doStep(0.0, 0.5 * reached)
    assert fmu.getReal([refs["carriage.x"]])[0] < 9e-3
    fmu.freeFMUState(before)
    fmu.reset()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.setReal([refs["carriage.x"]], [1e-2])
    fmu.exitInitializationMode()
    with pytest.raises(FMICallException):
        fmu.doStep(0.0, 1e-4)
    assert fmu.getRealStatus(2) == 0.0
    fmu.terminate()
    fmu.freeInstance()


@VERSIONS
@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_what_is_too_fast_is_told_once(
    plant: fx.ScheduledPlant, tmp_path: Path, version: str, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    slow = replace(plant, speed=0.5)
    path = fx.export(slow, tmp_path / "slow.fmu", format=version)[0]
    simulated(path, kind, 5e-4, 0.008, {FORCE: 20.0})
    told = capsys.readouterr().out
    assert told.count("carriage.x moves faster than 500 mm/s: inertia forces of modes that change") == 1
