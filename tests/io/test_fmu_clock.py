"""Units of FMI 3.0 that a clock drives: against SciPy's loops, the same units without clocks, and by the rules of the
standard of when a clock ticks and what has values then."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from ctypes import c_double, c_int, c_uint64
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
import scipy.linalg as la
import scipy.signal
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model, FMU3Slave, fmi3ValueReference
from fmpy.validation import validate_fmu
from lxml import etree

import flexura as fx
from flexura.systems import StateSpace
from helpers.export_models import EXAMPLES
from helpers.fmi3 import instance

H = 5e-5
DRIVEN = {"eventModeUsed": True}
READING, REFERENCE, COMMAND = "servo.reading", "servo.reference", "servo.command"


@pytest.fixture(scope="module")
def servo() -> fx.Mechanism:
    return fx.load(EXAMPLES / "guide" / "servo.yaml")


@pytest.fixture(scope="module")
def controller(servo: fx.Mechanism) -> StateSpace:
    return fx.models.controller_model(servo)


@pytest.fixture(scope="module")
def unit(controller: StateSpace, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fx.export(controller, tmp_path_factory.mktemp("clock") / "servo.fmu", format="fmi3")[0]


@pytest.fixture(scope="module")
def plant(servo: fx.Mechanism) -> StateSpace:
    return fx.state_space(fx.system(servo, inputs=["coil"], outputs=["gauge"], order="full"), n=30, residual_modes=True)


@pytest.fixture(scope="module")
def stage(plant: StateSpace, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fx.export(plant, tmp_path_factory.mktemp("stage") / "stage.fmu", format="fmi3")[0]


@pytest.fixture(scope="module")
def loop(servo: fx.Mechanism) -> StateSpace:
    return fx.closed_loop(servo, n=8).model.selected([REFERENCE], ["gauge", COMMAND]).discretised(H)


class Ticking:
    """A unit of which an importer schedules the clock."""

    def __init__(self, path: Path, stack: ExitStack, kind: Any = FMU3Slave, start: float = 0.0) -> None:
        options = DRIVEN if kind is FMU3Slave else {}
        self.fmu, self.refs, self.log = stack.enter_context(instance(path, kind, start, **options))
        self.is_slave, self.time = kind is FMU3Slave, start
        self.leave()

    def leave(self) -> None:
        if self.is_slave:
            self.fmu.enterStepMode()
        else:
            self.fmu.enterContinuousTimeMode()

    def at(self, time: float) -> None:
        if not self.is_slave:
            self.fmu.setTime(time)
        elif time > self.time:
            self.fmu.doStep(self.time, time - self.time)
        self.time = time

    def tick(self, inputs: Mapping[str, float], outputs: list[str]) -> list[float]:
        """Outputs at a tick; the states are those of the next after it."""
        self.fmu.enterEventMode()
        self.fmu.setClock([self.refs["clock"]], [True])
        self.fmu.setFloat64([self.refs[name] for name in inputs], list(inputs.values()))
        found = self.fmu.getFloat64([self.refs[name] for name in outputs])
        assert self.fmu.getClock([self.refs["clock"]])[0]
        assert self.fmu.updateDiscreteStates() == (False, False, False, False, False, 0.0)
        assert not self.fmu.getClock([self.refs["clock"]])[0]
        self.leave()
        return found


def test_the_description_declares_a_periodic_clock(unit: Path, controller: StateSpace, tmp_path: Path) -> None:
    assert validate_fmu(str(unit)) == []
    folder = fmpy.extract(str(unit), str(tmp_path / "unit"))
    root = etree.parse(Path(folder) / "modelDescription.xml").getroot()
    variables = {v.get("name"): v for v in root.find("ModelVariables")}
    clock = variables["clock"]
    assert clock.tag == "Clock" and clock.get("causality") == "input"
    assert clock.get("intervalVariability") == "constant" and float(clock.get("intervalDecimal")) == H
    own = clock.get("valueReference")
    states = list(controller.state_names)
    of_clock = [name for name, variable in variables.items() if variable.get("clocks") == own]
    assert of_clock == [READING, REFERENCE, COMMAND, *(f"next({name})" for name in states)]
    before = [variables[f"next({name})"].get("previous") for name in states]
    assert before == [variables[name].get("valueReference") for name in states]
    structure = {kind: root.findall(f"ModelStructure/{kind}") for kind in ("Output", "ClockedState", "InitialUnknown")}
    assert [len(own) for own in structure.values()] == [1, len(states), 0]
    for unknown in (*structure["Output"], *structure["ClockedState"]):
        assert unknown.get("dependencies").split()[-1] == own
    assert root.find("CoSimulation").get("hasEventMode") == "true"
    two = fx.export(controller, tmp_path / "two.fmu")[0]
    names = {v.name for v in fmpy.read_model_description(str(two)).modelVariables}
    assert names == set(variables) - {"clock"} - {f"next({name})" for name in states}


def wanted(time: np.ndarray) -> np.ndarray:
    """A smooth step of 1 um within 10 ms."""
    return 1e-6 * np.where(time < 0.01, np.sin(np.pi * np.minimum(time, 0.01) / 0.02) ** 2, 1.0)


def by_scipy(plant: StateSpace, controller: StateSpace, reference: np.ndarray) -> np.ndarray:
    """Readings (k,) of the loop at its samples: SciPy's exponential of the plant with a held command."""
    n = plant.order
    E = la.expm(np.block([[plant.A, plant.B], [np.zeros((1, n + 1))]]) * H)
    x, z, readings = np.zeros(n), np.zeros(controller.order), []
    for target in reference:
        u = np.array([float((plant.C @ x)[0]), target])
        readings.append(u[0])
        x = E[:n, :n] @ x + E[:n, n] * float((controller.C @ z + controller.D @ u)[0])
        z = controller.A @ z + controller.B @ u
    return np.array(readings)


@pytest.mark.parametrize("kind", [FMU3Slave, FMU3Model])
def test_a_clock_drives_the_sampled_loop(
    plant: StateSpace, stage: Path, controller: StateSpace, unit: Path, kind: Any
) -> None:
    """A plant in continuous time and a controller that ticks, in co-simulation and in model exchange, from 0.3 s on."""
    reference, start, found = wanted(H * np.arange(600)), 0.3, []
    with ExitStack() as stack:
        moving, ref, _ = stack.enter_context(instance(stage, start=start))
        own = Ticking(unit, stack, kind, start)
        for k, target in enumerate(reference):
            own.at(start + k * H)
            found += moving.getFloat64([ref["gauge"]])
            command = own.tick({READING: found[-1], REFERENCE: target}, [COMMAND])
            moving.setFloat64([ref["coil"]], command)
            moving.doStep(start + k * H, H)
        assert own.log == []
    expected = by_scipy(plant, controller, reference)
    assert np.abs(expected).max() > 0.9e-6
    assert np.abs(np.array(found) - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("kind", [FMU3Slave, FMU3Model])
def test_a_closed_loop_in_steps_ticks_as_scipy_steps_it(loop: StateSpace, tmp_path: Path, kind: Any) -> None:
    """Against scipy.signal.dlsim; between ticks time passes in pieces of any size."""
    path = fx.export(loop, tmp_path / "loop.fmu", format="fmi3")[0]
    reference, found = wanted(H * np.arange(300))[:, None], []
    with ExitStack() as stack:
        own = Ticking(path, stack, kind)
        for k, target in enumerate(reference[:, 0]):
            own.at((k - 0.6) * H if k else 0.0)
            own.at(k * H)
            found.append(own.tick({REFERENCE: target}, ["gauge", COMMAND]))
    _, expected, _ = scipy.signal.dlsim((loop.A, loop.B, loop.C, loop.D, H), reference)
    assert (np.abs(np.array(found) - expected).max(axis=0) < 1e-10 * np.abs(expected).max(axis=0)).all()


def test_without_its_clock_a_unit_is_what_it_was(unit: Path) -> None:
    """The same commands, to the bit, where the importer has no event mode and makes steps."""
    rng, plain, ticking = np.random.default_rng(2), [], []
    with ExitStack() as stack:
        fmu, ref, _ = stack.enter_context(instance(unit))
        own = Ticking(unit, stack)
        for k, (reading, reference) in enumerate(rng.standard_normal((50, 2))):
            fmu.setFloat64([ref[READING], ref[REFERENCE]], [reading, reference])
            plain += fmu.getFloat64([ref[COMMAND]])
            fmu.doStep(k * H, H)
            own.at(k * H)
            ticking += own.tick({READING: reading, REFERENCE: reference}, [COMMAND])
    assert ticking == plain and max(np.abs(plain)) > 1
    found = fmpy.simulate_fmu(str(unit), stop_time=50 * H, start_values={REFERENCE: 1.0})
    assert np.abs(found[COMMAND]).max() > 1


def test_slopes_are_the_matrices_of_a_step(unit: Path, controller: StateSpace) -> None:
    names = list(controller.state_names)
    with ExitStack() as stack:
        own = Ticking(unit, stack)
        known = [own.refs[name] for name in (*names, READING, REFERENCE)]
        unknown = [own.refs[name] for name in (*(f"next({name})" for name in names), COMMAND)]
        found = [own.fmu.getDirectionalDerivative(unknown, [one], [1.0]) for one in known]
    whole = np.block([[controller.A, controller.B], [controller.C, controller.D]])
    assert pytest.approx(whole, rel=1e-14) == np.array(found).T


def test_an_interval_is_told_and_changes_once(unit: Path) -> None:
    with ExitStack() as stack:
        own = Ticking(unit, stack)
        vr = (fmi3ValueReference * 1)(own.refs["clock"])
        interval, kind, shift = (c_double * 1)(), (c_int * 1)(), (c_double * 1)(9.0)
        for qualifier in (2, 1, 1):
            own.fmu.getIntervalDecimal(vr, interval, kind)
            assert (interval[0], kind[0]) == (H, qualifier)
        own.fmu.getShiftDecimal(vr, shift)
        assert shift[0] == 0.0


def test_ticks_and_states_are_kept_serialised_and_reset(unit: Path) -> None:
    with ExitStack() as stack:
        own = Ticking(unit, stack)
        first = [own.tick({REFERENCE: 1e-3, READING: 0.0}, [COMMAND])]
        own.at(H)
        kept = own.fmu.getFMUState()
        text = own.fmu.serializeFMUState(kept)
        first.append(own.tick({REFERENCE: 2e-3}, [COMMAND, "next(servo state 1)"]))
        own.at(2 * H)
        first.append(own.tick({}, [COMMAND]))
        for state in (kept, own.fmu.deserializeFMUState(text)):
            own.fmu.setFMUState(state)
            own.time = H
            assert own.tick({REFERENCE: 2e-3}, [COMMAND, "next(servo state 1)"]) == first[1]
            own.at(2 * H)
            assert own.tick({}, [COMMAND]) == first[2]
        own.fmu.freeFMUState(kept)
        own.fmu.reset()
        own.fmu.enterInitializationMode(startTime=7.0)
        own.fmu.exitInitializationMode()
        own.leave()
        own.time = 7.0
        assert own.tick({REFERENCE: 1e-3, READING: 0.0}, [COMMAND]) == first[0]


def in_event(own: Ticking) -> None:
    own.fmu.enterEventMode()


def in_tick(own: Ticking) -> None:
    in_event(own)
    own.fmu.setClock([own.refs["clock"]], [True])


def after_tick(own: Ticking) -> None:
    in_tick(own)
    own.fmu.updateDiscreteStates()


def half_a_step_later(own: Ticking) -> None:
    own.tick({}, [])
    own.at(0.5 * H)
    in_event(own)


def passed(own: Ticking) -> None:
    own.tick({}, [])
    own.at(H)


def start(own: Ticking) -> None:
    """In step mode, at the first tick."""


def set_clock(value: bool) -> Callable[[Ticking], Any]:
    return lambda own: own.fmu.setClock([own.refs["clock"]], [value])


def counted(own: Ticking) -> Any:
    return own.fmu.getIntervalFraction(
        (fmi3ValueReference * 1)(own.refs["clock"]), (c_uint64 * 1)(), (c_uint64 * 1)(), (c_int * 1)()
    )


def another_interval(own: Ticking) -> Any:
    return own.fmu.setIntervalDecimal((fmi3ValueReference * 1)(own.refs["clock"]), (c_double * 1)(1e-3))


@pytest.mark.parametrize(
    ("before", "call", "told"),
    [
        (start, set_clock(True), "ticks in event mode alone"),
        (half_a_step_later, set_clock(True), "now it does not"),
        (after_tick, set_clock(True), "now it does not"),
        (in_tick, set_clock(False), "cannot be taken back"),
        (in_event, lambda own: own.fmu.setClock([own.refs[COMMAND]], [True]), "no clock of that value reference"),
        (in_event, lambda own: own.fmu.setClock([own.refs["clock"] + 1], [True]), "no clock of that value reference"),
        (in_event, lambda own: own.fmu.getClock([own.refs[READING]]), "no clock of that value reference"),
        (in_event, lambda own: own.fmu.getFloat64([own.refs["clock"]]), "no number of that value reference"),
        (start, lambda own: own.fmu.getFloat64([own.refs[COMMAND]]), "while the clock ticks alone"),
        (in_event, lambda own: own.fmu.getFloat64([own.refs["next(servo state 1)"]]), "while the clock ticks alone"),
        (after_tick, lambda own: own.fmu.setFloat64([own.refs[READING]], [1.0]), "while the clock ticks alone"),
        (in_tick, lambda own: own.fmu.enterStepMode(), "a tick ends when discrete states are updated"),
        (start, lambda own: own.fmu.updateDiscreteStates(), "updated in event mode alone"),
        (in_event, lambda own: own.fmu.doStep(0.0, 1e-6), "made in step mode"),
        (start, lambda own: own.fmu.doStep(0.0, H), "a tick of the clock is left out"),
        (passed, lambda own: own.fmu.doStep(H, H), "a tick of the clock is left out"),
        (start, another_interval, "constant"),
        (start, counted, "no fraction"),
    ],
)  # fmt: skip
def test_wrong_use_of_a_clock_is_refused_and_logged(
    unit: Path, before: Callable[[Ticking], None], call: Callable[[Ticking], Any], told: str
) -> None:
    with ExitStack() as stack:
        own = Ticking(unit, stack)
        before(own)
        assert own.log == []
        with pytest.raises(FMICallException) as error:
            call(own)
        assert error.value.status == 3
        assert len(own.log) == 1 and told in own.log[0] and "logStatusError" in own.log[0]


def test_event_mode_belongs_to_units_with_a_clock_and_importers_that_use_it(unit: Path, stage: Path) -> None:
    with instance(unit) as (fmu, ref, log):
        for call in (fmu.enterEventMode, fmu.enterStepMode, lambda: fmu.setClock([ref["clock"]], [True])):
            with pytest.raises(FMICallException):
                call()
        assert len(log) == 3
    assert fmpy.read_model_description(str(stage)).coSimulation.hasEventMode is False
    with pytest.raises(Exception, match="instantiate"), instance(stage, **DRIVEN):
        pass
