"""Linear models as text of MATLAB and Modelica: read back term by term, and refused where they cannot be."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

import flexura as fx
from flexura.structure import Channel
from flexura.systems import StateSpace
from helpers.export_models import example_modes, modal_model


@pytest.fixture(scope="module")
def model() -> StateSpace:
    return modal_model(example_modes("xy_stage", 4), "table")


def matrices_of_m(text: str) -> dict[str, np.ndarray]:
    sizes = re.findall(r"^([ABCD]) = zeros\((\d+), (\d+)\);", text, re.MULTILINE)
    found = {name: np.zeros((int(rows), int(columns))) for name, rows, columns in sizes}
    for name, i, j, value in re.findall(r"([ABCD])\((\d+), (\d+)\) = (\S+);", text):
        found[name][int(i) - 1, int(j) - 1] = float(value)
    return found


@pytest.mark.parametrize("step", [None, 1e-3])
def test_a_function_of_matlab_has_every_number_and_name(model, tmp_path, step):
    own = model if step is None else model.discretised(step)
    own = replace(own, delay=2e-3) if step is None else own
    [path] = fx.export(own, tmp_path / "stage.m")
    text = path.read_text()
    for name, found in matrices_of_m(text).items():
        assert np.array_equal(found, getattr(own, name))
    assert text.startswith("function sys = stage()\n") and text.endswith("end\n")
    assert ("sys = ss(A, B, C, D, 0.001);" in text) == (step is not None)
    assert ("sys.InputDelay = 0.002 * ones(2, 1);" in text) == (step is None)
    assert "sys.InputName = {'table.tx.force', 'table.ry.moment'};" in text
    assert "% table.accelerometer: acceleration [m/s^2]" in text or "accelerometer: acceleration [m/s^2]" in text


def values_of_modelica(text: str, x: np.ndarray, u: dict[str, float]) -> dict[str, float]:
    """Left sides of the equations of a block, its right sides evaluated."""
    known = {f"x[{k + 1}]": value for k, value in enumerate(x)} | u
    body, found = text.split("\nequation\n")[1].rpartition("\nend ")[0], dict[str, float]()
    for equation in filter(None, map(str.strip, body.split(";"))):
        left, right = equation.split(" = ", 1)
        terms = re.findall(r"(^|[-+] ?)([0-9.e+-]+?) \* (?:delay\()?(\w+(?:\[\d+\])?)", right.strip())
        assert len(terms) == right.count("*")
        found[left] = sum((-1 if "-" in sign else 1) * float(value) * known[name] for sign, value, name in terms)
    return found


@pytest.mark.parametrize("delay", [0.0, 1e-3])
def test_a_block_of_modelica_is_the_model(model, tmp_path, delay):
    [path] = fx.export(replace(model, delay=delay), tmp_path / "Stage.mo")
    text = path.read_text()
    inputs = re.findall(r"RealInput (\w+)\(unit=\"([^\"]+)\"\)", text)
    outputs = re.findall(r"RealOutput (\w+)\(unit=\"([^\"]+)\"\)", text)
    assert inputs == [("table_tx_force", "N"), ("table_ry_moment", "N.m")]
    assert [unit for _, unit in outputs] == ["m", "rad", "m/s^2"]
    rng = np.random.default_rng(1)
    x, u = rng.standard_normal(model.order), rng.standard_normal(2)
    found = values_of_modelica(text, x, dict(zip([name for name, _ in inputs], u, strict=True)))
    rates = [found[f"der(x[{k + 1}])"] for k in range(model.order)]
    assert np.allclose(rates, model.A @ x + model.B @ u, rtol=1e-13, atol=0)
    read = [found[name] for name, _ in outputs]
    assert np.allclose(read, model.C @ x + model.D @ u, rtol=1e-13, atol=0)
    assert ("delay(table_tx_force, 0.001)" in text) == bool(delay)


def test_words_of_modelica_are_no_names(model, tmp_path):
    channels = (Channel("time", "force"), Channel("1st", "force"))
    text = fx.export(replace(model, inputs=channels), tmp_path / "Stage.mo")[0].read_text()
    assert "RealInput time_(" in text and "RealInput v_1st(" in text


@pytest.mark.parametrize(
    ("name", "words"),
    [("2nd.m", "no name of a MATLAB function"), ("a-b.mo", "no name of a Modelica class"), ("model.mo", "no name")],
)
def test_files_that_name_nothing_are_refused(model, tmp_path, name, words):
    with pytest.raises(fx.OptionError, match=words):
        fx.export(model, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_what_modelica_does_not_take(model, tmp_path):
    with pytest.raises(fx.OptionError, match="continuous"):
        fx.export(model.discretised(1e-3), tmp_path / "Stage.mo")
    with pytest.raises(fx.OptionError, match="two signals are called 'a_b'"):
        alike = (Channel("a.b", "force"), Channel("a_b", "moment"))
        fx.export(replace(model, inputs=alike), tmp_path / "Stage.mo")


def test_an_object_of_scipy(model):
    found, t = fx.to_scipy(model), np.linspace(0, 0.01, 200)
    _, y, _ = signal.lsim(found, np.zeros((200, 2)), t, X0=np.ones(model.order))
    rates, shapes = np.linalg.eig(model.A)
    free = (model.C @ shapes) @ (np.exp(np.outer(rates, t)) * np.linalg.solve(shapes, np.ones(model.order))[:, None])
    assert np.allclose(y, free.real.T, rtol=1e-8, atol=1e-8 * np.abs(free).max())
    assert fx.to_scipy(model.discretised(1e-3)).dt == 1e-3
    with pytest.raises(fx.OptionError, match="SciPy has no dead time"):
        fx.to_scipy(replace(model, delay=1e-3))
