"""The folder of a study is its state: what is damaged, changed or not its own is seen and said."""

import errno
import json
import shutil

import duckdb
import numpy as np
import polars
import pyarrow.parquet
import pytest

import flexura as fx
from flexura.errors import OptionError
from flexura.study.engine import open_study, run
from helpers.cheap_questions import CheapQuestions, Described
from helpers.cheap_studies import asked, files, space, started


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "study"
    run(asked(limit=0.9), space(), folder=folder, workers=1)
    return folder


@pytest.fixture
def study(tmp_path, undisturbed):
    shutil.copytree(undisturbed, tmp_path / "study")
    return tmp_path / "study"


def shards(folder):
    return sorted(folder.glob("*.parquet"))


def test_other_programs_read_the_shards_in_order(study):
    table = open_study(study)
    expected = table.to_columns()
    duck = duckdb.sql(f"select * from read_parquet('{study}/*.parquet')").df()
    polar = polars.scan_parquet(f"{study}/*.parquet").collect()
    arrow = table.to_arrow().to_table()
    for found in (duck, polar, arrow):
        for name in table.columns:
            own = np.asarray(found[name].to_numpy())
            assert np.array_equal(own, expected[name], equal_nan=own.dtype == float), name


def test_a_table_is_read_as_asked(study):
    table = open_study(study)
    assert len(list(table.blocks(["design"]))) == len(shards(study))
    assert list(table.to_frame(["f1", "design"]).columns) == ["f1 [Hz]", "design"]
    assert table.rows(30, 70)["design"].tolist() == list(range(30, 70))
    assert table.rows(990, 5000)["design"].tolist() == list(range(990, 1000))
    assert table.design(999)["design"] == 999
    for ask in (lambda: table.to_frame(["f2"]), lambda: next(table.blocks(["f2"]))):
        with pytest.raises(OptionError, match=r"'f2' is no column; columns: design, a \[SI\]"):
            ask()
    with pytest.raises(OptionError, match="design 1000 is not there"):
        table.design(1000)


@pytest.mark.parametrize("damage", ["cut", "empty", "other", "flipped footer"])
def test_a_damaged_shard_is_worked_out_anew_and_said(study, damage):
    before, own = files(study), shards(study)
    content = own[3].read_bytes()
    flipped = content[:-20] + bytes(255 - byte for byte in content[-20:-10]) + content[-10:]
    changed = {"cut": content[:-100], "empty": b"", "other": own[4].read_bytes(), "flipped footer": flipped}
    own[3].write_bytes(changed[damage])
    table = run(asked(limit=0.9), space(), folder=study, workers=1)
    assert f"damaged shards are worked out anew: {own[3].name} (" in " ".join(table.notes)
    assert files(study) == before


def test_damage_inside_a_shard_is_seen_when_it_is_read(study):
    content = bytearray(shards(study)[3].read_bytes())
    content[40:80] = bytes(255 - byte for byte in content[40:80])
    shards(study)[3].write_bytes(bytes(content))
    with pytest.raises(OptionError, match=r"damaged .*run the study again"):
        open_study(study).to_columns()


def test_a_changed_mechanism_is_another_study_and_the_first_is_put_aside(study):
    before = files(study)
    mechanism = fx.load("examples/guide/guide.yaml")
    width = mechanism.parameters["width"].replaced({"value": 0.03})
    other = mechanism.replaced({"parameters": {**mechanism.parameters, "width": width}})
    table = run(CheapQuestions(Described(other), limit=0.5), space(), folder=study, workers=1)
    assert any("held another study (the mechanism differs): that is in its folder earlier" in n for n in table.notes)
    aside = {name: content for name, content in files(study).items() if name.startswith("earlier/")}
    assert sorted(aside.values()) == sorted(before.values())
    assert duckdb.sql(f"select count(*) from read_parquet('{study}/*.parquet')").fetchall() == [(1000,)]
    assert not {file.name for file in shards(study)} & set(before)
    again = run(asked(limit=0.9, wrong=-1.0), space(), folder=study, workers=1)
    assert any("begun here before, and goes on" in note for note in again.notes)
    assert {name: own for name, own in files(study).items() if not name.startswith("earlier/")} == before


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda q: run(q, space(seed=2), {}, folder=None), "what varies differs"),
        (lambda q: run(q, space(), {"c": 1.0}, folder=None), "its parameters differs"),
    ],
)
def test_other_studies_have_other_shards(study, change, what):
    assert change(asked()) is not None
    own = {"what varies differs": (space(seed=2), {}), "its parameters differs": (space(), {"c": 1.0})}[what]
    table = run(asked(), *own, folder=study, workers=1)
    assert any(what.split()[-2] in note for note in table.notes)
    assert len(table) == 1000


def test_what_no_result_depends_on_changes_nothing(study):
    before = files(study)
    other = fx.load("examples/guide/guide.yaml").replaced({"description": "the same in other words"})
    run(CheapQuestions(Described(other), limit=0.9, wrong=-1.0), space(), folder=study, workers=1)
    assert files(study) == before


def test_files_of_others_are_not_mixed_in(study):
    (study / "table.parquet").write_bytes(b"mine")
    with pytest.raises(OptionError, match=r"holds table\.parquet, which is not of this study"):
        run(asked(limit=0.9), space(), folder=study, workers=1)


def test_a_folder_is_that_of_one_process(tmp_path):
    process = started("folder_study", tmp_path / "study", 1)
    try:
        while not shards(tmp_path / "study"):
            assert process.poll() is None
        with pytest.raises(OptionError, match="another process works on the study"):
            run(asked(limit=0.9), space(), folder=tmp_path / "study", workers=1)
    finally:
        process.kill()
        process.wait()


def test_a_full_disk_loses_nothing(tmp_path, undisturbed, monkeypatch):
    write, calls = pyarrow.parquet.write_table, []

    def until_full(data, file, **how):
        calls.append(file)
        if len(calls) > 5:
            file.write_bytes(b"PAR1")
            raise OSError(errno.ENOSPC, "No space left on device")
        write(data, file, **how)

    monkeypatch.setattr(pyarrow.parquet, "write_table", until_full)
    with pytest.raises(OptionError, match=r"No space left on device\n *320 of 1000 designs are kept in .*to go on"):
        run(asked(limit=0.9), space(), folder=tmp_path / "study", workers=2)
    assert len(files(tmp_path / "study")) == 6
    monkeypatch.undo()
    run(asked(limit=0.9), space(), folder=tmp_path / "study", workers=2)
    assert files(tmp_path / "study") == files(undisturbed)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "there is no study here"),
        ("", "not the manifest of a study"),
        ("[1]", "not the manifest"),
        ('{"format": 99}', "format 99 is not known"),
        ('{"format": 1}', "not the manifest"),
        ('{"format": 1, "key": "a", "columns": [3]}', "not the manifest"),
    ],
)
def test_a_folder_without_a_study(tmp_path, text, said):
    if text is not None:
        (tmp_path / "study.json").write_text(text)
    with pytest.raises(OptionError, match=said):
        open_study(tmp_path)


def test_a_file_in_place_of_the_folder(tmp_path):
    (tmp_path / "study").write_text("")
    with pytest.raises(OptionError, match="cannot be made"):
        run(asked(), space(), folder=tmp_path / "study", workers=1)


def test_the_manifest_tells_what_is_there(study):
    found = json.loads((study / "study.json").read_text())
    assert fx.modelfile.loads(found["mechanism"]) == fx.load("examples/guide/guide.yaml")
    assert [own["name"] for own in found["columns"]] == list(open_study(study).columns)
    assert (found["format"], found["designs"], found["questions"]) == (1, 1000, ["f1", "mass"])
    assert found["space"]["seed"] == 1
