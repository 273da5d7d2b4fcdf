"""The command of sweeps: table, files, studies of the file, interruptions, and what it refuses."""

import csv
import json
import signal
import subprocess
import sys
import time

import pytest

import flexura as fx
from helpers.shell import GUIDE, flexura, refused

THREE = ("--vary", "thickness=0.2mm:0.6mm:3", "--ask", "f1, mass")


def table(file):
    return list(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))


def test_the_table_and_the_extremes():
    done = flexura("sweep", GUIDE, *THREE)
    assert done.returncode == 0 and not done.stderr, done.stderr
    assert "3 designs" in done.stdout and "thickness [mm]" in done.stdout and "mass [g]" in done.stdout
    first, last = (fx.sweep(fx.load(GUIDE), vary=THREE[1], ask="f1").design(k)["f1 [Hz]"] for k in (0, 2))
    assert f"{first:.5g} Hz" in done.stdout and f"{last:.5g} Hz" in done.stdout


def test_many_designs_are_shortened():
    done = flexura("sweep", GUIDE, "--vary", "thickness=0.2mm:0.6mm:12", "--ask", "mass")
    rows = [line.split()[0] for line in done.stdout.splitlines() if line.strip()]
    assert rows[2:13] == [*map(str, range(10)), "and"] and "and 2 more designs" in done.stdout


def test_three_hundred_parameters(tmp_path):
    names = [f"p{k}" for k in range(300)]
    own = "".join(f"  {name}: {{value: 1 mm, source: example}}\n" for name in names)
    text = GUIDE.read_text(encoding="utf-8").replace("\nsubstructures:", f"{own}\nsubstructures:", 1)
    (tmp_path / "many.yaml").write_text(text, encoding="utf-8")
    vary = [word for name in names for word in ("--vary", f"{name}=1mm:2mm")]
    how = ("--sampling", "sobol", "--samples", 3, "--ask", "mass, f1", "--out", tmp_path / "a.csv")
    done = flexura("sweep", tmp_path / "many.yaml", *vary, *how)
    heading, *rows = done.stdout.splitlines()[1:5]
    assert heading.split()[:3] == ["design", "p0", "[mm]"]
    assert heading.count("p") > 5 and "mass [g]" in heading and "f1 [Hz]" in heading
    assert all(row.split()[0] == str(k) and "47.22" in row for k, row in enumerate(rows))
    headings = [line for line in done.stdout.splitlines() if line.startswith("design")]
    left = 300 - sum(line.count("p") for line in headings)
    assert f"{left} more columns: --out writes all of them" in done.stdout
    assert len(table(tmp_path / "a.csv")[0]) == 300 + 7


def test_json_and_files_say_the_same(tmp_path):
    done = flexura("sweep", GUIDE, *THREE, "--out", tmp_path / "a.csv", "--json")
    found = json.loads(done.stdout)
    rows = table(tmp_path / "a.csv")
    assert [float(row["f1 [Hz]"]) for row in rows] == found["table"]["f1 [Hz]"]
    assert found["files"] == [str(tmp_path / "a.csv")]
    assert list(rows[0]) == found["columns"]
    flexura("sweep", GUIDE, *THREE, "--out", tmp_path / "a.parquet")
    polars = pytest.importorskip("polars")
    assert polars.read_parquet(tmp_path / "a.parquet")["f1 [Hz]"].to_list() == found["table"]["f1 [Hz]"]


def test_designs_that_fail_are_counted_with_their_reason(tmp_path):
    text = GUIDE.read_text(encoding="utf-8").replace("minimum: 0.1 mm, ", "")
    (tmp_path / "loose.yaml").write_text(text, encoding="utf-8")
    args = ("sweep", tmp_path / "loose.yaml", "--vary", "thickness=-1:1mm:3", "--ask", "f1")
    done = flexura(*args, "--out", tmp_path / "a.csv")
    assert done.returncode == 0, done.stderr
    assert "warning:" in done.stdout and "of 3 designs could not be worked out, design 0 first" in done.stdout
    rows = table(tmp_path / "a.csv")
    assert [bool(row["f1 [Hz]"]) for row in rows] == [False, False, True]
    assert [bool(row["reason"]) for row in rows] == [True, True, False]
    strict = flexura(*args, "--strict", "--out", tmp_path / "b.csv")
    assert strict.returncode == 1 and not (tmp_path / "b.csv").exists()


def test_what_is_infinite_is_no_failure(tmp_path):
    pose = ("--vary", "thickness=0.4mm:0.5mm:2", "--ask", "margin at carriage.x = 0 mm")
    done = flexura("sweep", GUIDE, *pose, "--out", tmp_path / "a.csv")
    assert done.returncode == 0, done.stderr
    rows = table(tmp_path / "a.csv")
    assert [(row["margin at carriage.x = 0 m"], row["reason"]) for row in rows] == [("inf", "")] * 2


def test_a_study_of_the_file_with_its_samples(tmp_path):
    study = "studies: {some: {sweep: {vary: {thickness: {}}, ask: f1, sampling: latin hypercube, samples: 7}}}\n"
    text = GUIDE.read_text(encoding="utf-8").partition("studies:")[0]
    (tmp_path / "guide.yaml").write_text(text + study, encoding="utf-8")
    found = json.loads(flexura("sweep", tmp_path / "guide.yaml", "--study", "some", "--samples", 9, "--json").stdout)
    assert (found["designs"], found["space"]["sampling"], found["asked"]) == (9, "latin hypercube", ["f1 [Hz]"])
    refused(flexura("sweep", tmp_path / "guide.yaml", "--study", "sone"), "did you mean 'some'")


def test_an_interrupted_command_goes_on(tmp_path):
    varied = "thickness=0.2mm:0.6mm:300", "--ask", "f1 at x = 1 mm"  # slow enough that it lasts
    args = ("sweep", GUIDE, "--vary", *varied, "--workers", 1)
    folder = tmp_path / "study"
    process = subprocess.Popen(
        [sys.executable, "-m", "flexura", *map(str, args), "--folder", str(folder)], stderr=subprocess.PIPE, text=True
    )
    while len(list(folder.glob("*.parquet"))) < 2:
        assert process.poll() is None
        time.sleep(0.002)
    process.send_signal(signal.SIGINT)
    assert f"are kept in {folder}" in process.communicate()[1]
    assert process.returncode == 130
    done = flexura(*args, "--folder", folder)
    assert done.returncode == 0 and f"kept in: {folder}" in done.stdout
    assert flexura(*args, "--folder", tmp_path / "other").returncode == 0
    names = sorted(file.name for file in folder.iterdir())
    assert names == sorted(file.name for file in (tmp_path / "other").iterdir())
    assert all((folder / name).read_bytes() == (tmp_path / "other" / name).read_bytes() for name in names)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("--ask", "f1"), ("what to vary",)),
        (("--vary", "thickness=0.2mm:0.6mm:3"), ("what to ask",)),
        (("--vary", "thickness=0.2mm:0.6mm", "--ask", "f1"), ("how many values",)),
        (("--vary", "thickness=0.6mm:0.2mm:3", "--ask", "f1"), ("thickness", "runs backwards")),
        (("--vary", "width=1e-9m:1m:4000000000", "--vary", "length=2cm:9cm:4000000000", "--ask", "f1"), ("1.6e+19",)),
        ((*THREE, "--out", "table.txt"), (".csv or .parquet",)),
        ((*THREE, "--scheduler", "tcp://127.0.0.1:1"), ("no scheduler answers",)),
        ((*THREE, "--set", "thickness=1mm"), ("has a value already",)),
    ],
)
def test_what_is_refused(args, words):
    refused(flexura("sweep", GUIDE, *args), *words)
