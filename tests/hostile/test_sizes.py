"""What a file asks for is counted before it is made, and refused with the place, the value, the rule and a hint."""

from __future__ import annotations

import gzip
import io
import os
import zipfile

import numpy as np
import pytest

import flexura as fx
from flexura.errors import ModelError, OptionError
from flexura.files import read_arrays, read_bytes
from flexura.io import read_measurement
from flexura.modelfile import load, loads
from flexura.reduction import parts as reduction_parts
from flexura.sizes import LIMITS, size_limit, size_limits

PART = "substructures: {s: {nodes: {a: [0,0,0], b: [1 mm,0,0]}, links: {l: {nodes: [a, b], material: silicon, " \
    "elements: 10000, section: {shape: circle, diameter: 1 mm}}}, interface: [a]}}\n" \
    "instances: {i: {of: s, pattern: {type: linear, count: COUNT, step: [1 mm, 0, 0]}}}\n"  # fmt: skip
ELEMENT = "nodes: {a: [0,0,0]}\nsuperelements: {p: {nodes: [a], stiffness: {file: K.mtx}, mass: {file: M.mtx}}}\n"


def the_problem(text, directory=None):
    with pytest.raises(ModelError) as caught:
        if directory is None:
            loads(text)
        else:
            (directory / "m.yaml").write_text(text)
            load(directory / "m.yaml")
    return caught.value.problems[0]


def test_limits_are_raised_by_name(monkeypatch):
    assert size_limit("nodes") == LIMITS["nodes"].value
    monkeypatch.setenv("FLEXURA_LIMITS", "nodes=7, copies=1e3")
    assert (size_limit("nodes"), size_limit("copies")) == (7, 1000)
    with size_limits(nodes=9), fx.size_limits(copies=2):
        assert (size_limit("nodes"), size_limit("copies")) == (9, 2)
    assert size_limit("nodes") == 7
    for wrong in ("nodes", "nodes=x", "nodes=0", "nodes=inf", "sense=1"):
        monkeypatch.setenv("FLEXURA_LIMITS", wrong)
        with pytest.raises(OptionError):
            size_limit("nodes")


def test_placed_nodes_and_elements_are_counted():
    found = the_problem(PART.replace("COUNT", "100000"))
    assert found.place == "instances" and "50 000 nodes" in found.rule and found.value == "1 000 100 000"
    assert "--limit nodes=1000100000" in found.hint
    with size_limits(nodes=100, elements=1e9):
        assert "100 nodes" in the_problem(PART.replace("COUNT", "2")).rule
    with size_limits(elements=100):
        assert "100 beam elements" in the_problem(PART.replace("COUNT", "2")).rule


def test_constraint_modes_of_a_flat_mechanism_are_refused_before_they_are_made():
    nodes = ", ".join(f"n{k}: [{k} mm, 0, 0]" for k in range(40))
    shape = "section: {shape: circle, diameter: 1 mm}, material: silicon"
    links = ", ".join(f"l{k}: {{nodes: [n{k}, n{k + 1}], {shape}}}" for k in range(39))
    flat = loads(f"nodes: {{{nodes}}}\nlinks: {{{links}}}\nground: {{n0: clamped}}\n")
    with size_limits(dense_entries=10_000), pytest.raises(OptionError, match="40 of its 118 nodes are kept") as caught:
        fx.modes(flat, keep=0)
    assert "ask for a tolerance" in str(caught.value)
    with size_limits(dense_entries=10_000):
        by_modes = fx.modes(flat)
    assert "modes of the full order" in by_modes.steps[0] and not by_modes.warnings
    assert np.allclose(fx.modes(flat).frequency_hz, by_modes.frequency_hz, rtol=1e-3)


def test_sparse_and_dense_condensation_of_chains_agree(monkeypatch):
    nodes = ", ".join(f"n{k}: [{10 * (k % 5)} mm, {10 * (k // 5)} mm, 0]" for k in range(20))
    pairs = [(k, k + 1) for k in range(20) if k % 5 < 4] + [(k, k + 5) for k in range(15)]
    shape = "section: {shape: circle, diameter: 1 mm}, material: silicon, reference: z"
    links = ", ".join(f"l{a}_{b}: {{nodes: [n{a}, n{b}], {shape}}}" for a, b in pairs)
    text = f"nodes: {{{nodes}}}\nlinks: {{{links}}}\nground: {{n0: clamped}}\ninterface: [n0, n19]\n"
    dense = fx.reduce(loads(text))
    monkeypatch.setattr(reduction_parts, "SPARSE_GUYAN", 0)
    sparse = fx.reduce(loads(text))
    assert np.allclose(sparse.K, dense.K, rtol=1e-7, atol=1e-9 * abs(dense.K).max())
    assert np.allclose(sparse.M, dense.M, rtol=1e-9, atol=1e-12 * abs(dense.M).max())


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        ("%%MatrixMarket matrix coordinate real general\n6000 6000 0\n", "6 x 6"),
        ("%%MatrixMarket matrix coordinate real general\n6 6 999999999999\n1 1 1\n", "cannot hold them"),
        ("%%MatrixMarket matrix array real general\n6 6\n1\n", "not a real square"),
    ],
)
def test_headers_of_matrices_are_held_against_what_there_is(tmp_path, content, rule):
    (tmp_path / "K.mtx").write_text(content)
    assert rule in the_problem(ELEMENT, tmp_path).rule


def test_packed_files_are_unpacked_within_the_limit(tmp_path):
    whole = gzip.compress(b"%" * 1_000_000)
    (tmp_path / "K.mtx.gz").write_bytes(whole[:-20])
    text = ELEMENT.replace("K.mtx", "K.mtx.gz")
    assert "ends too soon" in the_problem(text, tmp_path).rule
    (tmp_path / "K.mtx.gz").write_bytes(whole)
    with size_limits(file_bytes=100_000):
        assert "at most 100 000 bytes" in the_problem(text, tmp_path).rule
    (tmp_path / "two.gz").write_bytes(gzip.compress(b"a") + gzip.compress(b"b"))
    assert read_bytes(tmp_path / "two.gz") == b"ab"


def test_no_pipe_device_or_circle_is_read(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "circle.yaml").symlink_to("circle.yaml")
    for name in ("pipe.yaml", "circle.yaml"):
        with pytest.raises(ModelError, match="cannot be read"):
            load(tmp_path / name)
        for text in (f"extends: {name}\n", ELEMENT.replace("K.mtx", name)):
            the_problem(text, tmp_path)
    with pytest.raises(ModelError, match="this is a device"):
        load("/dev/zero")


@pytest.mark.parametrize("name", ['"a\\0b"', "x" * 5000])
def test_names_that_no_file_can_have(name, tmp_path):
    assert len(str(the_problem(f"extends: {name}\n", tmp_path))) < 800
    (tmp_path / "m.yaml").unlink()


@pytest.mark.parametrize("text", ["name: 'x'", "nodes: {x: [0, 0, 0]}"])
def test_names_stay_short_and_printable(text):
    assert "at most" in the_problem(text.replace("x", "x" * 900)).rule
    assert "control character" in the_problem(text.replace("'x'", '"x\\0"').replace("{x:", '{"x\\0":')).rule


def npz(**claims):
    """An archive whose array claims a shape that its bytes do not have."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, claims)
    found = io.BytesIO()
    with zipfile.ZipFile(found, "w") as archive:
        archive.writestr("samples.npy", header.getvalue() + bytes(80))
    return found.getvalue()


def test_archives_are_held_against_what_they_claim(tmp_path):
    file = tmp_path / "x.npz"
    file.write_bytes(npz(descr="<f8", fortran_order=False, shape=(10,)))
    assert read_arrays(file)["samples"].shape == (10,)
    for descr, shape in (("<f8", (10**12,)), ("<f8", (11,)), ("|O", (10,))):
        file.write_bytes(npz(descr=descr, fortran_order=False, shape=shape))
        with pytest.raises(OptionError, match=r"samples\.npy"):
            read_measurement(file)
    np.savez_compressed(file, samples=np.zeros(1_000_000))
    with size_limits(file_bytes=1_000_000), pytest.raises(OptionError, match="unpacked: at most 1 000 000 bytes"):
        read_measurement(file)


def test_hdf5_leads_to_no_other_file(tmp_path):
    h5py = pytest.importorskip("h5py")
    (tmp_path / "other.bin").write_bytes(bytes(800))
    file = tmp_path / "x.h5"
    with h5py.File(file, "w") as root:
        root.create_dataset("samples", (100,), "f8", external=[(str(tmp_path / "other.bin"), 0, 800)])
    with pytest.raises(OptionError, match="keeps its data in another file"):
        read_measurement(file)
    with h5py.File(file, "w") as root:
        root["samples"] = h5py.ExternalLink("other.h5", "/x")
    with pytest.raises(OptionError, match="link to another file"):
        read_measurement(file)
    with h5py.File(file, "w") as root:
        root.create_dataset("samples", (10**12,), "f8", chunks=(1000,))
    with pytest.raises(OptionError, match="at most 2 000 000 000 bytes"):
        read_measurement(file)


def test_points_that_a_universal_file_cannot_hold(tmp_path):
    pytest.importorskip("pyuff")
    file = tmp_path / "x.uff"
    lines = ["    -1", "    58", *["NONE"] * 5, "    4", "         2 999999999         1", "NONE", "    -1"]
    file.write_text("\n".join(lines) + "\n")
    with pytest.raises(OptionError, match="999999999 points"):
        read_measurement(file)


@pytest.mark.parametrize("change", [{"frequency_hz": 1e299}, {"coherence": np.zeros(0)}, {"response": 1e300}])
def test_what_no_instrument_measures(tmp_path, change):
    file, hz = tmp_path / "x.npz", np.linspace(1.0, 9.0, 9)
    arrays = {"frequency_hz": hz, "response": np.ones((9, 1, 1), dtype=complex), "coherence": np.ones((9, 1, 1))}
    for key, value in change.items():
        arrays[key] = arrays[key] * value if np.ndim(value) == 0 else value
    channels = {"input_channels": np.array(["h [N]"]), "output_channels": np.array(["a [m/s^2]"])}
    np.savez(file, **arrays, **channels)
    with pytest.raises(OptionError, match="responses"):
        read_measurement(file)
    arrays.update(frequency_hz=hz, response=np.ones((9, 1, 1)), coherence=np.ones((9, 1, 1)))
    np.savez(file, **arrays, **channels)
    assert len(read_measurement(file).frfs) == 1


def test_a_field_of_any_length(tmp_path):
    file = tmp_path / "x.csv"
    file.write_text(f"time [s], a [{'m' * 200_000}]\n0, 1\n1, 2\n")
    with pytest.raises(OptionError):
        read_measurement(file)


@pytest.mark.parametrize("name", ["x" * 301, "a\x1b[31m"])
def test_names_of_channels_stay_short_and_printable(tmp_path, name):
    file = tmp_path / "x.csv"
    file.write_text(f"time [s],{name} [m/s^2]\n0,1\n1,2\n2,3\n")
    with pytest.raises(OptionError, match="at most 300 characters and no control characters"):
        read_measurement(file)
