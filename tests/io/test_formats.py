"""`export` as a whole: choice of the format, refusals, and files that appear complete or not at all."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura import files
from flexura.io import FORMATS, export, format_of
from flexura.io.fmu.description import BASE_UNITS
from flexura.structure import UNITS
from helpers.export_models import EXAMPLES, example_modes, modal_model


@pytest.mark.parametrize(
    ("path", "to", "name"),
    [
        ("a.FMU", None, "fmu"),
        ("a.b/c.h5", None, "hdf5"),
        ("c.hdf5", None, "hdf5"),
        ("c.unv", None, "uff"),
        ("c.mat", None, "mat"),
        ("c.mat", "simscape", "simscape"),
        ("folder", "matrix-market", "matrix-market"),
    ],
)
def test_the_suffix_or_the_name_chooses(path: str, to: str | None, name: str) -> None:
    assert format_of(path, to) == name


def test_every_format_says_what_it_takes_and_its_options() -> None:
    kinds = {kind for own in FORMATS.values() for kind in own.takes}
    for_steps = {"state space in float32", "observer", "shaper", "scheduled plant"}
    assert kinds == {"state space", "frequency response", "modes", "low-order model", "full-order model"} | for_steps
    assert FORMATS["fmu"].options == FORMATS["fmi3"].options == ("binary", "platforms")
    assert FORMATS["simscape"].options == ("frames", "keep", "damping_ratio")
    assert set(UNITS.values()) <= set(BASE_UNITS)


@pytest.mark.parametrize(
    ("path", "to", "message"),
    [
        ("x.xyz", None, r"\.xyz is no known format.*\.fmu \(fmu\)"),
        ("x", None, "no suffix is no known format"),
        ("x.fmu", "gds", "no format 'gds'; formats: fmu, fmi3, mat"),
        ("x.vtu", None, "vtu takes a modes or a full-order model, not a state space; formats that do: fmu, fmi3, mat"),
        ("x.mtx", None, "not a state space"),
    ],
)
def test_wrong_formats_are_refused(path: str, to: str | None, message: str, tmp_path: Path) -> None:
    model = modal_model(example_modes("guide"), "carriage")
    with pytest.raises(fx.OptionError, match=message):
        export(model, tmp_path / path, format=to)
    assert not list(tmp_path.iterdir())


def test_wrong_things_and_options_are_refused(tmp_path: Path) -> None:
    mechanism = fx.load(EXAMPLES / "guide" / "guide.yaml")
    with pytest.raises(fx.OptionError, match=r"npz takes a state space or a .* not a Mechanism"):
        export(mechanism, tmp_path / "x.npz")
    model = modal_model(example_modes("guide"), "carriage")
    with pytest.raises(fx.OptionError, match="mat has no option 'damping_ratio'; its options: damping"):
        export(model, tmp_path / "x.mat", damping_ratio=0.1)
    with pytest.raises(fx.OptionError, match="fmu takes one thing, not several"):
        export([model, model], tmp_path / "x.fmu")
    with pytest.raises(fx.OptionError, match="not a list"):
        export([], tmp_path / "x.uff")


def test_a_file_that_cannot_be_written(tmp_path: Path) -> None:
    model = modal_model(example_modes("guide"), "carriage")
    (tmp_path / "file").write_text("text")
    with pytest.raises(fx.OptionError, match="there is no folder"):
        export(model, tmp_path / "missing" / "x.npz")
    with pytest.raises(fx.OptionError, match="is a folder"):
        export(model, tmp_path, format="npz")
    with pytest.raises(fx.OptionError, match="there is no folder"):
        export(model, tmp_path / "file" / "x.npz")
    with pytest.raises(fx.OptionError, match="is a file"):
        export(example_modes("guide").model, tmp_path / "file", format="matrix-market")
    with pytest.raises(fx.OptionError, match="cannot be written"):
        export(model, tmp_path / ("x" * 300 + ".npz"))
    with pytest.raises(fx.OptionError, match="cannot be written"):
        export(model, str(tmp_path / "null\0.npz"))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_what_was_there_stays_when_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = modal_model(example_modes("guide"), "carriage")
    path = tmp_path / "guide.npz"
    path.write_text("before")
    with monkeypatch.context() as patch:
        patch.setattr(np, "savez_compressed", _fails)
        with pytest.raises(fx.OptionError, match="cannot be written: No space left"):
            export(model, path)
    assert path.read_text() == "before" and list(tmp_path.iterdir()) == [path]
    with monkeypatch.context() as patch:
        patch.setattr(files, "_flush", _fails)
        with pytest.raises(fx.OptionError, match="No space left"):
            export(example_modes("guide").model, tmp_path / "new", format="matrix-market")
    assert list(tmp_path.iterdir()) == [path]
    export(model, path)
    assert path.read_bytes()[:2] == b"PK" and list(tmp_path.iterdir()) == [path]


def _fails(*args: object, **kwargs: object) -> None:
    raise OSError(28, os.strerror(28))


def test_optional_packages_are_imported_when_needed() -> None:
    code = (
        "import sys, flexura\nflexura.export, flexura.to_control\n"
        "print([name for name in ('control', 'h5py', 'meshio', 'pyuff', 'fmpy') if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_formats_of_measured_data_alone_are_not_exported_to(tmp_path: Path) -> None:
    model = modal_model(example_modes("guide"), "carriage")
    with pytest.raises(fx.OptionError, match=r"\.csv is no known format"):
        export(model, tmp_path / "x.csv")
    with pytest.raises(fx.OptionError, match="no format 'csv'"):
        export(model, tmp_path / "x.csv", format="csv")
    assert {own.measured is None for own in FORMATS.values() if own.write is None} == {False}
