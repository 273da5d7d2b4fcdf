"""NumPy, HDF5 and MATLAB files and Matrix Market, read back by numpy, h5py and scipy."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

import flexura as fx
from flexura.io import export
from flexura.systems import system
from flexura.systems.state_space import StateSpace
from helpers.export_models import EXAMPLES, example_modes, modal_model

OUTPUTS = ["carriage.tx", "carriage.ry", "carriage.accelerometer"]


@pytest.fixture(scope="module")
def model() -> StateSpace:
    return replace(modal_model(example_modes("guide"), "carriage"), delay=2e-5, notes=("first", "größer als µ"))


@pytest.fixture(scope="module")
def response(model: StateSpace) -> SimpleNamespace:
    hz = np.geomspace(1, 2000, 40)
    return SimpleNamespace(
        name="guide",
        frequency_hz=hz,
        response=model.frequency_response(hz),
        inputs=model.inputs,
        outputs=model.outputs,
    )


@pytest.fixture(scope="module")
def low() -> fx.LowOrderModel:
    return fx.reduce(fx.load(EXAMPLES / "guide" / "guide.yaml"), keep=2)


@pytest.fixture(scope="module")
def full() -> fx.FullOrderModel:
    return fx.assemble(fx.load(EXAMPLES / "guide" / "guide.yaml"))


def test_state_space_in_a_numpy_archive(model: StateSpace, tmp_path: Path) -> None:
    (path,) = export(model, tmp_path / "guide.npz")
    with np.load(path, allow_pickle=False) as found:
        for name in "ABCD":
            assert np.array_equal(found[name], getattr(model, name))
        assert (found["dt"], found["delay"], found["name"]) == (0.0, 2e-5, model.name)
        assert found["output_names"].tolist() == OUTPUTS
        assert found["input_units"].tolist() == ["N", "N*m"]
        assert found["output_quantities"].tolist() == ["displacement", "rotation", "acceleration"]
        assert found["state_names"].tolist() == list(model.state_names)
        assert found["notes"].tolist() == ["first", "größer als µ"]


def test_discrete_state_space_in_hdf5(model: StateSpace, tmp_path: Path) -> None:
    discrete = model.discretised(1e-3)
    (path,) = export(discrete, tmp_path / "guide.h5")
    with h5py.File(path) as found:
        for name in "ABCD":
            assert np.array_equal(found[name][()], getattr(discrete, name))
        assert found.attrs["dt"] == 1e-3 and found.attrs["kind"] == "state space"
        assert found["output_names"].asstr()[()].tolist() == OUTPUTS
        assert found["notes"].asstr()[()].tolist() == ["first", "größer als µ"]
        assert len(found["state_names"]) == discrete.order > model.order


def test_sparse_matrices_in_a_numpy_archive_and_hdf5(full: fx.FullOrderModel, tmp_path: Path) -> None:
    C = 1e-5 * full.K
    (path,) = export(full, tmp_path / "full.npz", damping=C)
    with np.load(path, allow_pickle=False) as found:
        for name, expected in (("K", full.K), ("M", full.M), ("C", C)):
            parts = [found[f"{name}.{part}"] for part in ("data", "indices", "indptr")]
            read = sp.csc_matrix(tuple(parts), shape=tuple(found[f"{name}.shape"]))
            assert abs(read - expected).max() <= 1e-15 * abs(expected).max()
        assert found["coordinate_names"].tolist() == full.dof_names
    (path,) = export(full, tmp_path / "full.hdf5")
    with h5py.File(path) as found:
        group = found["M"]
        parts = tuple(group[part][()] for part in ("data", "indices", "indptr"))
        read = sp.csc_matrix(parts, shape=tuple(group.attrs["shape"]))
        assert abs(read - full.M).max() <= 1e-15 * abs(full.M).max()
        assert "C" not in found


def test_frequency_response_in_all_array_formats(response: SimpleNamespace, tmp_path: Path) -> None:
    with np.load(export(response, tmp_path / "r.npz")[0]) as found:
        assert np.array_equal(found["response"], response.response)
    with h5py.File(export(response, tmp_path / "r.h5")[0]) as found:
        assert np.array_equal(found["response"][()], response.response)
        assert np.array_equal(found["frequency_hz"][()], response.frequency_hz)
    found = scipy.io.loadmat(export(response, tmp_path / "r.mat")[0])
    assert found["ResponseData"].shape == (3, 2, 40)
    assert np.array_equal(found["ResponseData"][2, 1], response.response[:, 2, 1])
    assert found["OutputUnit"][2, 0][0] == "m/s^2"


def test_state_space_for_matlab(model: StateSpace, tmp_path: Path) -> None:
    found = scipy.io.loadmat(export(model, tmp_path / "guide.mat")[0])
    for name in "ABCD":
        assert np.array_equal(found[name], getattr(model, name))
    assert found["Ts"].item() == 0 and found["InputDelay"].tolist() == [[2e-5], [2e-5]]
    assert [cell[0] for cell in found["InputName"][:, 0]] == ["carriage.tx.force", "carriage.ry.moment"]
    assert [cell[0] for cell in found["StateName"][:, 0]] == list(model.state_names)
    assert found["Notes"][1, 0][0] == "größer als µ"
    discrete = scipy.io.loadmat(export(model.discretised(1e-3), tmp_path / "guide.mat")[0])
    assert discrete["Ts"].item() == 1e-3 and not discrete["InputDelay"].any()  # the delay is among the states


def test_low_order_model_for_matlab(low: fx.LowOrderModel, tmp_path: Path) -> None:
    found = scipy.io.loadmat(export(low, tmp_path / "low.mat")[0])
    assert np.allclose(found["K"], low.K, rtol=1e-14, atol=0)
    assert [cell[0] for cell in found["CoordinateName"][:, 0]] == low.coordinate_names


def test_matrix_market_with_a_table_of_rows(full: fx.FullOrderModel, tmp_path: Path) -> None:
    paths = export(full, tmp_path / "part.mtx")
    assert [path.name for path in paths] == ["part_K.mtx", "part_M.mtx", "part_dofs.csv"]
    for path, expected in zip(paths, (full.K, full.M), strict=False):
        assert scipy.io.mminfo(path)[-1] == "symmetric"
        read = scipy.io.mmread(path, spmatrix=False)
        assert abs(read - expected).max() <= 1e-15 * abs(expected).max()
    with paths[2].open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["coordinate"] for row in rows] == full.dof_names
    assert [int(row["row"]) for row in rows] == list(range(1, full.order + 1))
    carriage = next(row for row in rows if row["node"] == "carriage" and row["dof"] == "rx")
    # the centre of the carriage is 5 mm above leaves of 60 mm
    assert [float(carriage[key]) for key in ("x_m", "y_m", "z_m")] == pytest.approx([0, 0, 0.065])


def test_matrix_market_in_a_folder_with_damping_and_amplitudes(low: fx.LowOrderModel, tmp_path: Path) -> None:
    paths = export(low, tmp_path / "new" / "folder", format="matrix-market", damping=0.1 * low.M)
    assert [path.name for path in paths] == ["C.mtx", "K.mtx", "M.mtx", "dofs.csv"]
    assert np.allclose(scipy.io.mmread(paths[0], spmatrix=False).toarray(), 0.1 * low.M, rtol=1e-14, atol=0)
    with paths[3].open() as stream:
        rows = list(csv.DictReader(stream))
    kinds = [bool(row["node"]) for row in rows]
    assert kinds == ["mode" not in name for name in low.coordinate_names] and not all(kinds)


def test_files_say_how_far_the_part_may_be_from_modes_in_their_range(full: fx.FullOrderModel, tmp_path: Path) -> None:
    found = fx.modes(fx.load(EXAMPLES / "guide" / "guide.yaml"), n=6, order="full")
    told = [f"{hz:.5g} Hz {text}" for hz, text in zip(found.frequency_hz, found.model_errors.texts, strict=True)]
    lead = "model error, how far the part may be from these frequencies: "
    ends = {"inputs": ["carriage.tx"], "outputs": ["carriage.tx"]}
    built = system(full, order="full", damping=0.01, **ends)
    made = fx.state_space(built, n=3)
    for own, name in ((made, "continuous"), (made.discretised(1e-5), "discrete")):
        with np.load(export(own, tmp_path / f"{name}.npz")[0]) as arrays:
            assert arrays["notes"][-1] == lead + ", ".join(told[:3])
    assert scipy.io.loadmat(export(made, tmp_path / "made.mat")[0])["Notes"][-1, 0][0] == lead + ", ".join(told[:3])
    response = fx.frequency_response(built, frequency_hz=[10.0, 0.5 * (found.frequency_hz[1] + found.frequency_hz[2])])
    with h5py.File(export(response, tmp_path / "response.h5")[0]) as arrays:
        assert arrays["notes"].asstr()[()].tolist()[-1] == lead + ", ".join(told[:2])
    with np.load(export(full, tmp_path / "full.npz")[0]) as arrays:
        note = str(arrays["notes"][-1])
        assert note.startswith(lead + ", ".join(told)) and note.endswith(", of higher ones not worked out")
    lines = export(full, tmp_path / "part.mtx")[0].read_text(encoding="utf-8").splitlines()
    assert any(line.startswith("%") and lead + told[0] in line for line in lines[:4])


def test_damping_of_another_size_or_without_symmetry_is_refused(low: fx.LowOrderModel, tmp_path: Path) -> None:
    with pytest.raises(fx.OptionError, match="of this model is"):
        export(low, tmp_path / "x.npz", damping=np.eye(3))
    C = np.eye(low.order)
    C[0, 1] = 1.0
    with pytest.raises(fx.OptionError, match="symmetric"):
        export(low, tmp_path / "x.npz", damping=C)
    assert not list(tmp_path.iterdir())


def test_matrices_read_back_as_a_superelement_have_the_same_frequencies(tmp_path: Path) -> None:
    free = fx.loads(
        "flexura: 1\ncorrections: none\nnodes: {root: [0 mm, 0 mm, 0 mm], tip: [80 mm, 0 mm, 0 mm]}\n"
        "links: {bar: {nodes: [root, tip], material: steel, section: s, reference: z, elements: 8}}\n"
        "materials: {steel: spring-steel}\nsections: {s: {shape: rectangle, width: 10 mm, thickness: 2 mm}}\n"
        "interface: [root, tip]\n"
    )
    part = fx.models.nested(fx.reduce(free, keep=6))
    export(part, tmp_path / "bar.mtx")
    text = (
        "flexura: 1\nnodes: {a: [0 mm, 0 mm, 0 mm], b: [80 mm, 0 mm, 0 mm]}\nground: {a: clamped}\n"
        f"superelements: {{bar: {{nodes: [a, b], amplitudes: {part.amplitudes}, "
        "stiffness: {file: bar_K.mtx}, mass: {file: bar_M.mtx}}}\n"
    )
    (tmp_path / "held.yaml").write_text(text)
    found = fx.modes(fx.load(tmp_path / "held.yaml"), n=3, order="full").frequency_hz
    # a clamped bar: f = (1.8751 / L)^2 / 2 pi sqrt(E I / rho A)
    steel = fx.describe.CATALOGUE["spring-steel"]
    expected = (1.8751041 / 0.08) ** 2 / (2 * np.pi) * np.sqrt(steel.E / steel.rho * 0.002**2 / 12)
    assert found[0] == pytest.approx(expected, rel=1e-3)


def test_system_has_its_own_damping(tmp_path: Path) -> None:
    mechanism = fx.load(EXAMPLES / "guide" / "guide.yaml")
    first, second = 2 * np.pi * 10.0, 2 * np.pi * 100.0
    rayleigh = {"frequencies": (10.0, 100.0), "ratios": (0.02, 0.02)}
    built = system(mechanism, inputs=["carriage.tx"], outputs=["carriage.tx"], damping={"rayleigh": rayleigh})
    with np.load(export(built, tmp_path / "system.npz")[0]) as found:
        C = 0.04 * (first * second * found["M"] + found["K"]) / (first + second)
        assert np.allclose(found["C"], C, rtol=1e-10, atol=0)


def test_damping_that_is_in_no_matrix_is_not_lost(tmp_path: Path) -> None:
    mechanism = fx.load(EXAMPLES / "guide" / "guide.yaml")
    built = system(mechanism, inputs=["carriage.tx"], outputs=["carriage.tx"], damping={"loss_factor": 0.01})
    with pytest.raises(fx.OptionError, match="no matrix C of this system"):
        export(built, tmp_path / "no.npz")
    with np.load(export(built, tmp_path / "given.npz", damping=1e-6 * built.K)[0]) as found:
        assert np.allclose(found["C"], 1e-6 * found["K"])
