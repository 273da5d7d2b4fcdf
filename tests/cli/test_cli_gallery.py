"""Files to begin with, and what is installed, from the shell."""

import json
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli import gallery
from flexura.cli.app import app
from flexura.cli.gallery import EXTRAS, SCHEMA, packages_of
from flexura.errors import OptionError
from flexura.gallery import entries, entry
from flexura.kernels import without

PROJECT = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]


def shell(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_names_are_listed_with_their_first_sentence():
    for command in ("new", "examples"):
        told = " ".join(shell(command).stdout.split())
        for own in entries():
            assert own.name in told and own.line and own.line in told
    own = entry("parallelogram")
    assert " ".join(fx.load(own.path).description.split()).startswith(own.line)


def test_a_new_file_is_that_of_the_gallery_and_runs(tmp_path):
    file = tmp_path / "mine.yaml"
    assert "flexura check" in shell("new", "parallelogram", "--out", file).stdout
    assert file.read_text(encoding="utf-8") == entry("parallelogram").text
    assert shell("check", file).exit_code == 0


def test_with_a_schema_it_says_where_editors_find_it(tmp_path):
    file = tmp_path / "mine.yaml"
    shell("new", "parallelogram", "--schema", "--out", file)
    assert file.read_text(encoding="utf-8").splitlines()[0].endswith(f"$schema={SCHEMA}")
    assert json.loads((tmp_path / SCHEMA).read_text(encoding="utf-8")) == fx.schema()
    assert fx.load(file) == fx.load(entry("parallelogram").path)


def test_nothing_is_overwritten(tmp_path):
    file = tmp_path / "parallelogram.yaml"
    file.write_text("mine", encoding="utf-8")
    for words in (("new", "parallelogram", "--out", file), ("examples", "--out", tmp_path)):
        found = shell(*words)
        assert isinstance(found.exception, OptionError) and "overwritten" in str(found.exception)
    assert file.read_text(encoding="utf-8") == "mine" and len(list(tmp_path.iterdir())) == 1


def test_all_files_are_written(tmp_path):
    shell("examples", "--out", tmp_path / "own")
    assert {path.name for path in (tmp_path / "own").iterdir()} == {own.path.name for own in entries()}


def test_names_that_are_none_are_told_what_is_near():
    with pytest.raises(OptionError, match="'parallelogram'"):
        entry("paralelogram")


def test_the_extras_are_those_of_the_installation():
    listed = PROJECT["optional-dependencies"]
    assert listed.keys() - {"all", "bench", "dev", "docs"} == EXTRAS.keys()
    assert listed["all"] == [f"flexura[{','.join(EXTRAS)}]"]
    assert packages_of("fmi") == ["fmpy"] and packages_of("cluster") == ["dask"]


def test_the_doctor_says_how_to_get_what_is_missing(monkeypatch):
    monkeypatch.setattr(gallery, "_version", lambda name: None if name == "fmpy" else "1.0")
    monkeypatch.setitem(gallery.PROGRAMS, "no-such-program", ("nothing", "nowhere"))
    told = " ".join(shell("doctor").stdout.split())
    assert "pip install 'flexura[fmi]'" in told and "nowhere" in told and "missing" in told
    assert "control 1.0" in told
    with without():
        assert "python -m flexura.kernels.build" in " ".join(shell("doctor").stdout.split())
