"""FMUs read back by fmpy: validation, both kinds of simulation against scipy's exponential, and hostile models."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import c_double
from dataclasses import replace
from pathlib import Path

import fmpy
import mpmath
import numpy as np
import pint
import pytest
import scipy.linalg as la
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.model_description import ModelDescription
from fmpy.validation import validate_fmu

import flexura as fx
from flexura.io.fmu.code import blocks_of
from flexura.io.fmu.description import BASE_UNITS
from flexura.io.fmu.package import write_fmu
from flexura.structure import Channel
from flexura.systems import state_space, system
from flexura.systems.state_space import StateSpace
from helpers.export_models import EXAMPLES, example_modes, modal_model

FORCE, MOMENT, SHIFT, TURN = (
    "carriage.tx.force",
    "carriage.ry.moment",
    "carriage.tx.displacement",
    "carriage.ry.rotation",
)


@pytest.fixture(scope="module")
def model() -> StateSpace:
    return modal_model(example_modes("guide"), "carriage")


@pytest.fixture(scope="module")
def guide(model: StateSpace, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_fmu(model, tmp_path_factory.mktemp("fmu") / "guide.fmu")


@contextmanager
def instance(path: Path, kind: type = FMU2Slave) -> Iterator[tuple[FMU2Slave | FMU2Model, ModelDescription]]:
    """An instance after initialization, and the description."""
    about = fmpy.read_model_description(str(path))
    part = about.coSimulation if kind is FMU2Slave else about.modelExchange
    folder = path.with_suffix("")
    if not folder.exists():
        fmpy.extract(str(path), str(folder))
    fmu = kind(guid=about.guid, unzipDirectory=folder, modelIdentifier=part.modelIdentifier, instanceName="one")
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    try:
        yield fmu, about
    finally:
        fmu.terminate()
        fmu.freeInstance()


def exact(model: StateSpace, x: np.ndarray, u: np.ndarray, h: float) -> np.ndarray:
    """States one step on, by scipy's exponential of the augmented matrix."""
    n = len(x)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = model.A, model.B @ u
    return (la.expm(block * h) @ np.append(x, 1.0))[:n]


def in_many_digits(model: StateSpace, x: np.ndarray, u: np.ndarray, h: float) -> tuple[np.ndarray, float]:
    """The same by an exponential of forty digits, and what round-off may change: how far it moves when the augmented
    matrix is rounded once (Higham 2008, Functions of Matrices, section 3.2), and the last sum."""
    n = len(x)
    block, start = np.zeros((n + 1, n + 1)), np.append(x, 1.0)
    block[:n, :n], block[:n, n] = model.A, model.B @ u
    with mpmath.workdps(40):
        step = mpmath.expm(mpmath.matrix(block) * h, method="taylor")
        found = np.array([float(v) for v in (step * mpmath.matrix(start))[:n]])
        size = float(mpmath.mnorm(step, "f"))
    change = la.expm_cond(block * h) * size if h else 0.0
    return found, float(np.finfo(float).eps / 2 * (change + n) * np.linalg.norm(start))


def coupled(n: int = 9) -> StateSpace:
    """Damped oscillators, a drift and a lag, mixed by a full change of coordinates."""
    rng = np.random.default_rng(5)
    w = np.array([3.0, 40.0, 700.0])
    A = la.block_diag(*([[0, 1], [-(k**2), -0.1 * k]] for k in w), [[0, 1], [0, 0]], [[-2.0]])
    T = la.qr(rng.standard_normal((n, n)))[0]
    channels = tuple(Channel(f"in{k}", "voltage") for k in range(2)), (Channel("out", "velocity"),)
    names = tuple(f"x{k}" for k in range(n))
    A, B, C = T @ A @ T.T, rng.standard_normal((n, 2)), rng.standard_normal((1, n))
    return StateSpace(A, B, C, np.zeros((1, 2)), *channels, names, name="coupled")


def test_description_is_valid_and_says_what_the_model_is(guide: Path, model: StateSpace) -> None:
    assert validate_fmu(str(guide)) == []
    about = fmpy.read_model_description(str(guide))
    found = {v.name: v for v in about.modelVariables}
    assert [v.name for v in about.modelVariables if v.causality == "input"] == [FORCE, MOMENT]
    assert [v.name for v in about.modelVariables if v.causality == "output"] == [SHIFT, TURN, "carriage.accelerometer"]
    assert [found[k].unit for k in (FORCE, MOMENT, SHIFT, TURN, "carriage.accelerometer")] == [
        *("N", "N*m", "m", "rad", "m/s^2")
    ]
    units = {u.name: u.baseUnit for u in about.unitDefinitions}
    assert (units["N*m"].kg, units["N*m"].m, units["N*m"].s) == (1, 2, -2)
    assert about.variableNamingConvention == "structured"
    assert found["der(mode2.velocity)"].derivative is found["mode2.velocity"]
    assert (
        about.coSimulation.canHandleVariableCommunicationStepSize and about.modelExchange.providesDirectionalDerivative
    )
    # a displacement does not feel the inputs at once, an acceleration does
    depends = {u.variable.name: {v.name for v in u.dependencies} for u in about.outputs}
    assert not depends[SHIFT] & {FORCE, MOMENT}
    assert FORCE in depends["carriage.accelerometer"]
    slow = 2 * np.pi / np.abs(model.poles()).min()
    assert float(about.defaultExperiment.stopTime) == pytest.approx(10 * slow, rel=0.05)


def test_co_simulation_is_exact_for_held_inputs(guide: Path, model: StateSpace) -> None:
    h, steps = 1e-4, 300
    u = np.random.default_rng(1).standard_normal((steps, 2))
    kind = [("time", float), (FORCE, float), (MOMENT, float)]
    signal = np.array([(k * h, *u[k]) for k in range(steps)], dtype=kind)
    result = fmpy.simulate_fmu(
        str(guide), fmi_type="CoSimulation", stop_time=(steps - 1) * h, step_size=h, output_interval=h, input=signal
    )
    x, expected = np.zeros(model.order), [model.D @ u[0]]
    for k in range(steps - 1):
        x = exact(model, x, u[k], h)
        expected.append(model.C @ x + model.D @ u[k])
    found = np.array([list(row)[1:] for row in result])
    assert np.abs(found - expected).max(axis=0) == pytest.approx(0, abs=1e-11 * np.abs(expected).max())


def test_model_exchange_agrees_with_the_exponential(guide: Path, model: StateSpace) -> None:
    h, steps = 1e-4, 200
    result = fmpy.simulate_fmu(
        str(guide),
        fmi_type="ModelExchange",
        solver="CVode",
        stop_time=steps * h,
        output_interval=h,
        relative_tolerance=1e-12,
        start_values={FORCE: 1.0, "mode2.position": 1e-4},
    )
    x, u, expected = np.zeros(model.order), np.array([1.0, 0.0]), []
    x[2] = 1e-4
    for _ in range(steps + 1):
        expected.append(model.C @ x + model.D @ u)
        x = exact(model, x, u, h)
    found = np.array([list(row)[1:] for row in result])
    assert (np.abs(found - expected).max(axis=0) / np.abs(expected).max(axis=0)).max() < 1e-8


def test_steps_of_any_size_of_a_fully_coupled_model(tmp_path: Path) -> None:
    model = coupled()
    with instance(write_fmu(model, tmp_path / "coupled.fmu")) as (fmu, about):
        refs = {v.name: v.valueReference for v in about.modelVariables}
        x, t = np.zeros(model.order), 0.0
        for h in (1e-3, 1e-3, 0.4, 1e-9, 3.0, 0.0, 1e-3, 25.0):
            u = np.array([np.sin(7 * t + h), 1.0])
            fmu.setReal([refs["in0"], refs["in1"]], u.tolist())
            fmu.doStep(t, h)
            expected, by_rounding = in_many_digits(model, x, u, h)
            x, t = np.array(fmu.getReal([refs[f"x{k}"] for k in range(model.order)])), t + h
            assert x == pytest.approx(expected, rel=0, abs=by_rounding)


@pytest.mark.parametrize("turns", [0.01, 1.0, 1e4])
def test_a_stiff_mode_over_many_periods(tmp_path: Path, turns: float) -> None:
    w, z = 2 * np.pi * 5e4, 1e-3
    channels = (Channel("f", "force"),), (Channel("y", "displacement"),)
    A = np.array([[0, 1], [-(w**2), -2 * z * w]])
    model = StateSpace(A, np.array([[0.0], [1]]), np.array([[1.0, 0]]), np.zeros((1, 1)), *channels, ("q", "v"))
    h = turns * 2 * np.pi / w
    wd, decay = w * np.sqrt(1 - z * z), np.exp(-z * w * h)
    step = (1 - decay * (np.cos(wd * h) + z * w / wd * np.sin(wd * h))) / w**2
    with instance(write_fmu(model, tmp_path / "stiff.fmu")) as (fmu, _):
        fmu.setReal([0], [1.0])
        fmu.doStep(0.0, h)
        assert fmu.getReal([1])[0] == pytest.approx(step, rel=1e-15 * max(w * h, 1e3))


def test_directional_derivatives_are_the_matrices(guide: Path, model: StateSpace) -> None:
    with instance(guide, FMU2Model) as (fmu, about):
        names = [v.name for v in about.modelVariables]
        state, rate = (np.array([names.index(t.format(s)) for s in model.state_names]) for t in ("{}", "der({})"))
        for j in (0, 5, 11):
            assert fmu.getDirectionalDerivative(rate.tolist(), [state[j]], [1.0]) == model.A[:, j].tolist()
        found = fmu.getDirectionalDerivative([2, 3, 4], [0, 1], [2.0, -1.0])
        assert found == pytest.approx(model.D @ [2.0, -1.0])
        both = fmu.getDirectionalDerivative([4], [0, int(state[0])], [1.0, 1.0])
        assert both == pytest.approx([model.D[2, 0] + model.C[2, 0]])


def test_from_a_mechanism_to_an_fmu(tmp_path: Path) -> None:
    """The whole way, with a static gain, states named by mode, and a force and a displacement of the same name."""
    mechanism = fx.load(EXAMPLES / "guide" / "guide.yaml")
    built = system(
        mechanism, inputs=["carriage.tx"], outputs=["carriage.tx", "carriage.tx:velocity"], damping=0.02, keep=4
    )
    model = state_space(built, n=3)
    path = write_fmu(model, tmp_path / "guide.fmu")
    assert validate_fmu(str(path)) == []
    texts = fx.modes(mechanism, n=3).model_errors.texts
    about = fmpy.read_model_description(str(path)).description
    assert "model error, how far the part may be" in about and all(f"Hz {text}" in about for text in texts)
    h, steps = 2e-4, 100
    result = fmpy.simulate_fmu(
        str(path), fmi_type="CoSimulation", stop_time=steps * h, step_size=h, start_values={FORCE: 2.0}
    )
    x, u = np.zeros(model.order), np.array([2.0])
    for _ in range(steps):
        x = exact(model, x, u, h)
    assert list(result[-1])[1:] == pytest.approx((model.C @ x + model.D @ u).tolist(), rel=1e-9)


def test_states_are_kept_serialised_and_reset(guide: Path) -> None:
    with instance(guide) as (fmu, _):
        fmu.setReal([0], [1.0])
        fmu.doStep(0.0, 1e-3)
        kept = fmu.getFMUstate()
        text = fmu.serializeFMUstate(kept)
        fmu.doStep(1e-3, 1e-3)
        there = fmu.getReal([2, 3, 4])
        fmu.setReal([0], [9.0])
        fmu.setFMUstate(kept)
        fmu.doStep(1e-3, 1e-3)
        assert fmu.getReal([2, 3, 4]) == there
        fmu.setFMUstate(fmu.deSerializeFMUstate(text))
        fmu.doStep(1e-3, 1e-3)
        assert fmu.getReal([2, 3, 4]) == there
        fmu.freeFMUstate(kept)
        fmu.reset()
        assert fmu.getReal(list(range(17))) == [0.0] * 17


def test_nominal_sizes_are_those_of_the_motion(guide: Path, model: StateSpace) -> None:
    with instance(guide, FMU2Model) as (fmu, about):
        n = model.order
        size = (c_double * n)()
        fmu.getNominalsOfContinuousStates(size, n)
        states = [v for v in about.modelVariables if v.causality == "local"][:n]
        assert list(size) == [float(v.nominal) for v in states]
    # the static deflection of the first mode under 1 N and 1 N m, and the velocity that belongs to it
    static = np.abs(la.solve(model.A, model.B))[0].sum()
    assert size[0] == pytest.approx(static, rel=0.1)
    assert size[1] == pytest.approx(static * np.sqrt(-model.A[1, 0]), rel=0.1)


@pytest.mark.parametrize(
    "call",
    [
        lambda fmu: fmu.setReal([2], [1.0]),
        lambda fmu: fmu.setReal([0], [float("nan")]),
        lambda fmu: fmu.setReal([5], [1.0]),
        lambda fmu: fmu.getReal([99]),
        lambda fmu: fmu.getInteger([0]),
        lambda fmu: fmu.doStep(0.0, -1.0),
        lambda fmu: fmu.doStep(0.0, float("nan")),
        lambda fmu: fmu.getDirectionalDerivative([0], [1], [1.0]),
        lambda fmu: fmu.setRealInputDerivatives([0], [1], [1.0]),
        lambda fmu: fmu.deSerializeFMUstate(b"something else"),
        lambda fmu: fmu.enterInitializationMode(),
    ],
)
def test_impossible_calls_return_an_error(guide: Path, call) -> None:
    with instance(guide) as (fmu, _), pytest.raises(fmpy.fmi1.FMICallException):
        call(fmu)


def test_definitions_agree_with_the_published_header(guide: Path, tmp_path: Path) -> None:
    sources = tmp_path / "sources"
    with zipfile.ZipFile(guide) as archive:
        archive.extractall(tmp_path)
    header = Path(fmpy.__file__).parent / "c-code" / "fmi2Functions.h"
    ours = ["-DFLEXURA_FMI2_H", "-DFMI2(name)=name", "-DFMI2_PUBLIC=", "-include", str(header)]
    flags = ["cc", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-c", "fmi2.c", "-o", "checked.o"]
    subprocess.run([*flags, *ours], cwd=sources, check=True)
    exported = _symbols(next((tmp_path / "binaries").rglob("*.so")), "-D")
    declared = {
        word for word in header.read_text().replace("(", " ").replace(";", " ").split() if word.startswith("fmi2")
    }
    functions = {word for word in declared if not word.endswith(("TYPE", "FullName")) and f"{word}TYPE" in declared}
    assert len(functions) == 44 and functions == exported
    subprocess.run([*flags, "-DFMI2_FUNCTION_PREFIX=part_"], cwd=sources, check=True)
    assert {f"part_{name}" for name in functions} == _symbols(sources / "checked.o", "-g")


def _symbols(file: Path, option: str) -> set[str]:
    lines = subprocess.run(["nm", option, "--defined-only", file], capture_output=True, text=True, check=True).stdout
    return {line.split()[2] for line in lines.splitlines()}


def test_the_same_model_makes_the_same_file(model: StateSpace, guide: Path, tmp_path: Path) -> None:
    again = write_fmu(model, tmp_path / "guide.fmu")
    assert again.read_bytes() == guide.read_bytes()
    plain = write_fmu(model, tmp_path / "plain.fmu", binary=False)
    assert validate_fmu(str(plain)) == []
    assert fmpy.platform_info(str(plain)) == ["c-code"] if hasattr(fmpy, "platform_info") else True
    other = write_fmu(replace(model, A=model.A * 1.001), tmp_path / "other.fmu", binary=False)
    guids = [fmpy.read_model_description(str(p)).guid for p in (guide, plain, other)]
    assert guids[0] == guids[1] != guids[2]


def test_blocks_are_found_whatever_the_order_of_states() -> None:
    A = np.zeros((5, 5))
    A[0, 3], A[3, 0], A[1, 1], A[4, 2] = 1, -2, -1, 1
    blocks = blocks_of(A)
    assert blocks.first.tolist() == [0, 2, 3, 5]
    assert blocks.member.tolist() == [0, 3, 1, 2, 4]


def test_a_gain_without_states(tmp_path: Path) -> None:
    none, D = np.zeros((0, 0)), np.array([[2.0]])
    channels = (Channel("volts", "voltage"),), (Channel("shift", "displacement"),)
    gain = StateSpace(none, np.zeros((0, 1)), np.zeros((1, 0)), D, *channels, (), name="2 gain")
    path = write_fmu(gain, tmp_path / "gain.fmu")
    assert validate_fmu(str(path)) == []
    result = fmpy.simulate_fmu(str(path), start_values={"volts": 3.0}, stop_time=1.0, fmi_type="CoSimulation")
    assert result["shift"][-1] == 6.0


def test_names_that_occur_twice_say_the_quantity_and_clashes_are_refused(model: StateSpace, tmp_path: Path) -> None:
    channel = Channel("carriage.tx", "displacement")
    twice = replace(model, outputs=(channel, channel, channel))
    with pytest.raises(fx.OptionError, match=r"two signals are called 'carriage.tx.displacement'"):
        write_fmu(twice, tmp_path / "no.fmu")
    with pytest.raises(fx.OptionError, match="one line of text"):
        write_fmu(replace(model, outputs=(Channel("a\nb", "rotation"), *model.outputs[1:])), tmp_path / "no.fmu")
    assert not list(tmp_path.iterdir())


def test_odd_names_are_written_as_they_are(model: StateSpace, tmp_path: Path) -> None:
    odd = replace(model, outputs=(Channel('a "b" <c> & ö', "displacement"), *model.outputs[1:]), name="4 <bar> stage")
    path = write_fmu(odd, tmp_path / "odd.fmu")
    assert validate_fmu(str(path)) == []
    about = fmpy.read_model_description(str(path))
    assert about.modelName == "4 <bar> stage" and about.coSimulation.modelIdentifier == "m_4__bar__stage"
    assert about.modelVariables[2].name == 'a "b" <c> & ö' and about.variableNamingConvention == "flat"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"delay": 1e-3}, "dead time"),
        ({"A": np.full((12, 12), np.nan)}, "not finite"),
    ],
)
def test_models_that_no_fmu_can_stand_for(model: StateSpace, tmp_path: Path, change: dict, message: str) -> None:
    with pytest.raises(fx.OptionError, match=message):
        write_fmu(replace(model, **change), tmp_path / "no.fmu")
    with pytest.raises(fx.OptionError, match="without outputs"):
        write_fmu(model.selected(outputs=[]), tmp_path / "no.fmu")
    assert not list(tmp_path.iterdir())


def test_a_missing_or_failing_compiler_is_named(
    model: StateSpace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "old.fmu"
    target.write_text("what was there")
    monkeypatch.setenv("CC", "false")
    with pytest.raises(fx.OptionError, match="libc6-dev"):
        write_fmu(model, target)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(fx.OptionError, match="apt install gcc"):
        write_fmu(model, target)
    assert target.read_text() == "what was there"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("unit", sorted(BASE_UNITS))
def test_base_units_are_those_of_pint(unit: str) -> None:
    own = pint.UnitRegistry()(unit).to_base_units()
    short = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "radian": "rad", "kelvin": "K"}
    assert own.magnitude == 1
    assert {short[name]: power for name, power in own.unit_items()} == BASE_UNITS[unit]
