"""FMUs of FMI 3.0 read back by fmpy: validation, both kinds of simulation, parameters against models made with them."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Mapping
from ctypes import c_double
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
import scipy.linalg as la
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model
from fmpy.validation import validate_fmu
from lxml import etree

import flexura as fx
from flexura.systems import StateSpace
from helpers.export_models import EXAMPLES
from helpers.fmi3 import instance

GUIDE = (EXAMPLES / "guide" / "guide.yaml").read_text()
FORCE, SHIFT, RATE = "carriage.tx.force", "carriage.tx.displacement", "carriage.tx:acceleration"
OUTPUTS = ["carriage.tx", "carriage.tx:velocity", "carriage.tx:acceleration"]


def guide(damping: float = 0.01, **options: Any) -> StateSpace:
    """Force at the carriage to its motion, six modes."""
    built = fx.system(fx.loads(GUIDE), inputs=["carriage.tx"], outputs=OUTPUTS, damping=damping, order="full")
    return fx.state_space(built, **{"n": 6, **options})


@pytest.fixture(scope="module")
def model() -> StateSpace:
    return guide(payloads=["carriage"])


@pytest.fixture(scope="module")
def unit(model: StateSpace, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fx.export(model, tmp_path_factory.mktemp("fmi3") / "guide.fmu", format="fmi3")[0]


def stepped(model: StateSpace, u: np.ndarray, h: float) -> np.ndarray:
    """Outputs (k, p) after each of the steps with inputs (k, m) held, by scipy's exponential."""
    n, m = model.B.shape
    block = np.zeros((n + m, n + m))
    block[:n] = np.hstack([model.A, model.B]) * h
    E = la.expm(block)
    x, found = np.zeros(n), []
    for held in u:
        x = E[:n, :n] @ x + E[:n, n:] @ held
        found.append(model.C @ x + model.D @ held)
    return np.array(found)


def simulated(path: Path, h: float, steps: int, values: Mapping[str, float], kind: str = "CoSimulation") -> np.ndarray:
    """Outputs (k, p) after each step."""
    options = {"solver": "CVode", "relative_tolerance": 1e-12} if kind == "ModelExchange" else {"step_size": h}
    found = fmpy.simulate_fmu(
        str(path), fmi_type=kind, stop_time=steps * h, output_interval=h, start_values=dict(values), **options
    )
    return np.array([list(row)[1:] for row in found])[1:]


def apart(found: np.ndarray, expected: np.ndarray) -> float:
    """The largest difference beside the largest value of each output."""
    return float((np.abs(found - expected).max(axis=0) / np.abs(expected).max(axis=0)).max())


def test_descriptions_are_valid_by_the_published_schemas(unit: Path) -> None:
    assert validate_fmu(str(unit)) == []
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3BuildDescription.xsd"))
    with zipfile.ZipFile(unit) as archive:
        names, build = archive.namelist(), etree.fromstring(archive.read("sources/buildDescription.xml"))
        schema.assertValid(build)
        assert {f"sources/{file.get('name')}" for file in build.iter("SourceFile")} <= set(names)
    about = fmpy.read_model_description(str(unit))
    assert about.fmiVersion == "3.0"
    assert "binaries/x86_64-linux/parallel_leaf_spring_guide.so" in names
    found = {v.name: v for v in about.modelVariables}
    assert found["mode 2 damping ratio"].variability == "tunable" and found["mode 2 damping ratio"].start == "0.01"
    assert found["carriage payload"].unit == "kg" and found[f"{FORCE}.gain"].start == "1.0"
    depends = {u.variable.name: {v.name: k for v, k in zip(u.dependencies, u.dependenciesKind, strict=True)}
               for u in (*about.outputs, *about.derivatives)}  # fmt: skip
    assert "carriage payload" not in depends[SHIFT] and depends[RATE]["carriage payload"] == "dependent"
    assert depends["der(mode 1 displacement)"] == {"mode 1 velocity": "constant"}


def test_it_can_be_built_from_its_sources_as_it_says(unit: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path)
    build = etree.parse(tmp_path / "sources" / "buildDescription.xml")
    files = [file.get("name") for file in build.iter("SourceFile")]
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only", *files]
    subprocess.run(command, cwd=tmp_path / "sources", check=True)


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_damping_ratios_and_gains_are_those_of_a_model_made_with_them(unit: Path, kind: str) -> None:
    """Displacement, velocity and acceleration, of which the last depends on damping directly."""
    h, steps = 2e-4, 150
    ratios = {f"mode {k + 1} damping ratio": 0.07 for k in range(6)}
    values = {FORCE: 1.0, f"{FORCE}.gain": -2.5, **ratios}
    expected = stepped(guide(0.07), np.full((steps, 1), -2.5), h)
    limit = 1e-11 if kind == "CoSimulation" else 1e-7
    assert apart(simulated(unit, h, steps, values, kind), expected) < limit
    assert apart(simulated(unit, h, steps, {FORCE: -2.5}, kind), expected) > 0.1


def test_a_parameter_is_changed_between_steps(unit: Path, model: StateSpace) -> None:
    """Free motion of a mode, by its own exponential before and after."""
    w = float(np.sqrt(-model.A[1, 0]))
    with instance(unit) as (fmu, ref, _):
        fmu.reset()
        fmu.setFloat64([ref["mode 1 velocity"]], [1.0])
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()

        def energy() -> float:
            q, v = fmu.getFloat64([ref["mode 1 displacement"], ref["mode 1 velocity"]])
            return v**2 + (w * q) ** 2

        period, sizes = 2 * np.pi / w, [energy()]
        for k, ratio in enumerate((0.01, 0.2, 0.0)):
            fmu.setFloat64([ref["mode 1 damping ratio"]], [ratio])
            fmu.doStep(k * period, period)
            sizes.append(energy())
        decays = [la.expm(np.array([[0, 1], [-(w**2), -2 * z * w]]) * period) for z in (0.01, 0.2, 0.0)]
        x, expected = np.array([0.0, 1.0]), [1.0]
        for E in decays:
            x = E @ x
            expected.append(float(x[1] ** 2 + (w * x[0]) ** 2))
        assert sizes == pytest.approx(expected, rel=1e-11)
        assert fmu.getFloat64([ref["mode 1 damping ratio"]]) == [0.0]


def frequencies(path: Path, model: StateSpace, values: Mapping[str, float]) -> np.ndarray:
    """Natural frequencies, Hz, of what a unit says of its own derivatives."""
    with instance(path, FMU3Model) as (fmu, ref, _):
        fmu.setFloat64([ref[name] for name in values], list(values.values()))
        rates = [ref[f"der({name})"] for name in model.state_names]
        A = np.array([fmu.getDirectionalDerivative(rates, [ref[name]], [1.0]) for name in model.state_names]).T
    return np.sort(np.abs(la.eigvals(A).imag))[::2] / (2 * np.pi)


@pytest.mark.parametrize(("options", "limit"), [({}, 2e-5), ({"residual_modes": True}, 2e-7)])
def test_a_payload_is_a_mass_that_is_described(options: dict, limit: float, tmp_path: Path) -> None:
    """A Ritz method: never below the mechanism with the mass, and all but at it with residual modes."""
    forces = ["carriage.tx", "carriage.ty", "carriage.tz"]
    built = fx.system(fx.loads(GUIDE), inputs=forces, outputs=["carriage.tx"], damping=0, order="full")
    model = fx.state_space(built, n=4, payloads=["carriage"], **options)
    path = fx.export(model, tmp_path / "loaded.fmu", format="fmi3")[0]
    for grams in (20, 50):
        heavy = fx.loads(f"{GUIDE}\nmasses:\n  load: {{node: carriage, mass: {grams} g}}\n")
        exact = fx.modes(heavy, n=4, order="full").frequency_hz
        found = frequencies(path, model, {"carriage payload": grams / 1000})[:4] / exact - 1
        assert found.max() < limit and found.min() > -1e-9
    assert frequencies(path, model, {})[:4] == pytest.approx(fx.modes(fx.loads(GUIDE), n=4, order="full").frequency_hz)


def test_a_payload_that_brings_a_mode_down_is_told_of(model: StateSpace) -> None:
    assert any("carriage: a payload moves the modes kept alone" in note for note in model.notes)
    assert not any("payload" in note for note in guide().notes)
    with pytest.raises(fx.OptionError, match="each once"):
        guide(payloads=["carriage", "carriage"])
    with pytest.raises(fx.OptionError, match="not by what holds it"):
        guide(payloads=["ground"])


def test_energy_never_grows_in_a_free_undamped_run(tmp_path: Path) -> None:
    """v'v + q' omega^2 q + m |velocity of the payload|^2 over 20 000 steps: to the round-off of as many."""
    model = guide(0.0, payloads=["carriage"])
    path = fx.export(model, tmp_path / "free.fmu", format="fmi3")[0]
    own, steps, h, mass = model.tuning, 20_000, 3.1e-4, 0.05
    assert own is not None
    last = np.array([name == "carriage payload" for name in [own.parameters[k].name for k in own.parameter]])
    shape = own.into[1::2, last].T
    w2 = -model.A[1::2, ::2].diagonal()
    rng = np.random.default_rng(3)
    v = rng.standard_normal(len(w2))
    with instance(path) as (fmu, ref, _):
        fmu.reset()
        fmu.setFloat64([ref["carriage payload"], *(ref[name] for name in model.state_names[1::2])], [mass, *v])
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        states = [ref[name] for name in model.state_names]
        energies = []
        for k in range(steps):
            if k % 1000 == 0:
                x = np.array(fmu.getFloat64(states))
                moving = x[1::2] @ x[1::2] + mass * ((shape @ x[1::2]) ** 2).sum()
                energies.append(moving + x[::2] ** 2 @ w2)
            fmu.doStep(k * h, h)
    assert max(energies) / energies[0] - 1 < steps * 2e-15
    assert min(energies) / energies[0] - 1 > -steps * 2e-15


def test_directional_derivatives_by_parameters_are_the_limits_of_differences(unit: Path) -> None:
    rng = np.random.default_rng(4)
    with instance(unit, FMU3Model) as (fmu, ref, _):
        names = [name for name in ref if name.startswith("mode") and "damping" not in name]
        known = [*names, FORCE, f"{FORCE}.gain", "mode 1 damping ratio", "mode 3 damping ratio", "carriage payload"]
        unknown = [ref[name] for name in (SHIFT, RATE, "der(mode 1 velocity)", "der(mode 3 velocity)")]
        refs = [ref[name] for name in known]
        at = np.concatenate([rng.standard_normal(len(names)) * 1e-3, [2.0, 3.0, 0.02, 0.01, 0.05]])
        seed = rng.uniform(-1, 1, len(at)) * np.abs(at)

        def outcome(step: float) -> np.ndarray:
            fmu.setFloat64(refs, (at + step * seed).tolist())
            return np.array(fmu.getFloat64(unknown))

        h = 1e-3
        rough, fine = ((outcome(k) - outcome(-k)) / (2 * k) for k in (h, h / 2))
        fmu.setFloat64(refs, at.tolist())
        found = np.array(fmu.getDirectionalDerivative(unknown, refs, seed.tolist()))
        assert found == pytest.approx((4 * fine - rough) / 3, rel=1e-9)


def test_loops_are_closed_in_one_unit(tmp_path: Path) -> None:
    """The servo of the guide by scipy's exponential, as described, and with three times the damping in its plant."""
    whole = fx.load(EXAMPLES / "guide" / "servo.yaml")
    ends = (["servo.reference"], ["gauge", "servo.command"])
    loop = fx.closed_loop(whole, n=30).model.selected(*ends)
    damped = fx.closed_loop(whole, n=30, damping=0.015).model.selected(*ends)
    path = fx.export(loop, tmp_path / "servo.fmu", format="fmi3")[0]
    assert validate_fmu(str(path)) == []
    h, steps = 5e-5, 400
    u = np.full((steps, 1), 1e-6)
    assert loop.tuning is not None
    values = {q.name: 0.015 for q in loop.tuning.parameters}
    assert apart(simulated(path, h, steps, {"servo.reference": 1e-6}), stepped(loop, u, h)) < 1e-9
    found = simulated(path, h, steps, {"servo.reference": 1e-6, **values})
    assert apart(found, stepped(damped, u, h)) < 1e-9
    assert apart(found, stepped(loop, u, h)) > 1e-3


def test_a_model_in_steps_makes_its_own(tmp_path: Path) -> None:
    """With a dead time of a step and a half; other communication steps, points and uses are refused and logged."""
    dt = 1e-4
    model = guide(delay=1.5 * dt).discretised(dt)
    path = fx.export(model, tmp_path / "steps.fmu", format="fmi3")[0]
    assert validate_fmu(str(path)) == []
    about = fmpy.read_model_description(str(path))
    assert float(about.coSimulation.fixedInternalStepSize) == dt
    rng = np.random.default_rng(6)
    x = np.zeros(model.order)
    with instance(path, start=0.3) as (fmu, ref, log):
        time = 0.3
        for count in (1, 1, 3, 2, 1):
            u = rng.standard_normal(1)
            fmu.setFloat64([ref[FORCE]], u.tolist())
            assert fmu.doStep(time, count * dt) == (False, False, False, pytest.approx(time + count * dt))
            for _ in range(count):
                x = model.A @ x + model.B @ u
            time += count * dt
            outputs = fmu.getFloat64([ref[channel] for channel in (SHIFT, "carriage.tx:velocity", RATE)])
            assert outputs == pytest.approx(model.C @ x + model.D @ u, rel=1e-12)
        assert log == []
        for at, h in ((time, 1.5 * dt), (time, dt / 2), (time + 0.5 * dt, dt), (time - dt, dt)):
            with pytest.raises(FMICallException):
                fmu.doStep(at, h)
        assert ["whole number" in line for line in log] == [True, True, False, False]
        assert all("begins where the last one ended" in line for line in log[2:])
        assert fmu.doStep(time, dt)[3] == pytest.approx(time + dt)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("mode 1 damping ratio", -1e-3, "not negative"),
        ("carriage payload", -1.0, "not negative"),
        (f"{FORCE}.gain", float("nan"), "not finite"),
        ("mode 1 velocity", 1.0, "before the start only"),
        (SHIFT, 1.0, "what can be set"),
        ("time", 1.0, "what can be set"),
    ],
)
def test_values_that_cannot_be_set_are_refused_and_logged(unit: Path, name: str, value: float, message: str) -> None:
    with instance(unit) as (fmu, ref, log):
        before = fmu.getFloat64(sorted(ref.values()))
        with pytest.raises(FMICallException):
            fmu.setFloat64([ref[name]], [value])
        assert len(log) == 1 and message in log[0] and "logStatusError" in log[0]
        assert fmu.getFloat64(sorted(ref.values())) == before


@pytest.mark.parametrize(
    "call",
    [
        lambda fmu: fmu.getFloat64([99]),
        lambda fmu: fmu.getInt32([0]),
        lambda fmu: fmu.getClock([0]),
        lambda fmu: fmu.doStep(0.0, -1.0),
        lambda fmu: fmu.doStep(0.0, float("nan")),
        lambda fmu: fmu.doStep(1.0, 1e-3),
        lambda fmu: fmu.getFloat64([0], 2),
        lambda fmu: fmu.getAdjointDerivative([1], [0], [1.0]),
        lambda fmu: fmu.getOutputDerivatives([1], [1]),
        lambda fmu: fmu.deserializeFMUState(b"something else"),
        lambda fmu: fmu.enterInitializationMode(),
        lambda fmu: fmu.enterEventMode(),
        lambda fmu: fmu.enterConfigurationMode(),
    ],
)
def test_impossible_calls_return_an_error_and_say_so(unit: Path, call: Any) -> None:
    with instance(unit) as (fmu, _, log):
        with pytest.raises(FMICallException):
            call(fmu)
        assert len(log) == 1


def test_states_and_parameters_are_kept_serialised_and_reset(unit: Path) -> None:
    with instance(unit) as (fmu, ref, _):
        outputs = [ref[SHIFT], ref[RATE]]
        fmu.setFloat64([ref[FORCE], ref["carriage payload"]], [1.0, 0.03])
        fmu.doStep(0.0, 1e-3)
        kept = fmu.getFMUState()
        text = fmu.serializeFMUState(kept)
        fmu.doStep(1e-3, 1e-3)
        there = fmu.getFloat64(outputs)
        fmu.setFloat64([ref[FORCE], ref["carriage payload"]], [9.0, 0.3])
        for state in (kept, fmu.deserializeFMUState(text)):
            fmu.setFMUState(state)
            fmu.doStep(1e-3, 1e-3)
            assert fmu.getFloat64(outputs) == there
        fmu.freeFMUState(kept)
        fmu.reset()
        assert fmu.getFloat64([ref["carriage payload"], *outputs]) == [0.0] * 3


def test_both_versions_are_the_same_numbers(unit: Path, model: StateSpace, tmp_path: Path) -> None:
    other = fx.export(model, tmp_path / "two.fmu")[0]
    values = {FORCE: 1.0, "carriage payload": 0.02, "mode 1 damping ratio": 0.3}
    assert (simulated(unit, 1e-4, 50, values) == simulated(other, 1e-4, 50, values)).all()
    with instance(unit, FMU3Model) as (fmu, _, _):
        assert fmu.getNumberOfContinuousStates() == model.order and fmu.getNumberOfEventIndicators() == 0
        size = (c_double * model.order)()
        fmu.getNominalsOfContinuousStates(size, model.order)
        assert min(size) > 0


def test_definitions_agree_with_the_published_header(unit: Path, tmp_path: Path) -> None:
    sources = tmp_path / "sources"
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path)
    header = Path(fmpy.__file__).parent / "c-code" / "fmi3Functions.h"
    ours = ["-DFLEXURA_FMI3_H", "-DFMI3(name)=name", "-DFMI3_PUBLIC=", "-include", str(header)]
    flags = ["cc", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-c", "fmi3.c", "-o", "checked.o"]
    subprocess.run([*flags, *ours], cwd=sources, check=True)
    exported = _symbols(next((tmp_path / "binaries").rglob("*.so")), "-D")
    words = header.read_text().replace("(", " ").replace(";", " ").split()
    functions = {word for word in words if word.startswith("fmi3") and f"{word}TYPE" in words}
    assert len(functions) > 70 and functions == exported
    subprocess.run([*flags, "-DFMI3_FUNCTION_PREFIX=part_"], cwd=sources, check=True)
    assert {f"part_{name}" for name in functions} == _symbols(sources / "checked.o", "-g")


def _symbols(file: Path, option: str) -> set[str]:
    lines = subprocess.run(["nm", option, "--defined-only", file], capture_output=True, text=True, check=True).stdout
    return {line.split()[2] for line in lines.splitlines()}


ZIG = """#!/bin/sh
for word; do
    case "$before" in -o) library=$word ;; -target) target=$word ;; esac
    before=$word
done
echo "made for $target" > "$library"
"""


def test_libraries_for_other_platforms_are_made_by_zig(
    model: StateSpace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where they stand, by the names of either version; zig itself is stood in for."""
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"), prepend=":")
    with pytest.raises(fx.OptionError, match="nothing here compiles for x86_64-windows: pip install ziglang"):
        fx.export(model, tmp_path / "no.fmu", platforms=["x86_64-windows"])
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "zig").write_text(ZIG)
    (tmp_path / "bin" / "zig").chmod(0o755)
    places = {
        "fmu": {"win64/{}.dll": "x86_64-windows-gnu", "darwin64/{}.dylib": "x86_64-macos"},
        "fmi3": {"x86_64-windows/{}.dll": "x86_64-windows-gnu", "x86_64-darwin/{}.dylib": "x86_64-macos"},
    }
    for name, expected in places.items():
        wanted = ["x86_64-windows", "x86_64-darwin", "x86_64-linux"]
        path = fx.export(model, tmp_path / f"{name}.fmu", format=name, platforms=wanted)[0]
        with zipfile.ZipFile(path) as archive:
            found = {own: archive.read(own) for own in archive.namelist() if own.startswith("binaries/")}
        assert len(found) == 3 and sum(library.startswith(b"\x7fELF") for library in found.values()) == 1
        for place, target in expected.items():
            library = found[f"binaries/{place.format('parallel_leaf_spring_guide')}"]
            assert library == f"made for {target}\n".encode()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"platforms": ["aarch64-darwin"]}, "FMI 2 has no name for aarch64-darwin"),
        ({"platforms": ["win64"], "format": "fmi3"}, "no platform 'win64' to build for; platforms: x86_64-linux"),
        ({"platforms": "x86_64-linux"}, "platforms are a list"),
        ({"platforms": ["x86_64-linux"], "binary": False}, "go with binary"),
        ({"platforms": ["x86_64-linux"], "format": "mat"}, "mat has no option 'platforms'"),
    ],
)
def test_platforms_that_cannot_be_built_for(
    model: StateSpace, tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(fx.OptionError, match=message):
        fx.export(model, tmp_path / "no.fmu", **options)
    assert not list(tmp_path.iterdir())


def test_parameters_belong_to_continuous_models_in_modes(model: StateSpace, tmp_path: Path) -> None:
    with pytest.raises(fx.OptionError, match="carriage payload is a parameter of a continuous model"):
        model.discretised(1e-4)
    with pytest.raises(fx.OptionError, match="a balanced model has none"):
        guide(payloads=["carriage"], balanced=4)
    other = fx.export(replace(model, A=2 * model.A), tmp_path / "other.fmu", binary=False)[0]
    parameters = [v.name for v in fmpy.read_model_description(str(other)).modelVariables if v.causality == "parameter"]
    assert parameters == [f"{FORCE}.gain"]
    small = guide(balanced=4)
    assert small.tuning is None and guide().discretised(1e-4).tuning is None
