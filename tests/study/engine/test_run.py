"""Blocks of designs: the same numbers and bytes by any number of processes, kept whatever happens."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import flexura as fx
from flexura.deadline import OutOfTime, time_limit
from flexura.errors import OptionError, SolverError
from flexura.sizes import size_limits
from flexura.study.engine import open_study, run
from flexura.study.engine.work import block_size
from flexura.study.questions import questions as asked_of
from flexura.study.space import Space, Variable
from helpers.cheap_studies import asked, files, space, started

SHARDS = 1000 // 64 + 1


def same(a, b):
    first, second = a.to_columns(), b.to_columns()
    assert list(first) == list(second)
    return all(np.array_equal(first[name], second[name], equal_nan=first[name].dtype == float) for name in first)


@pytest.fixture
def at_once(monkeypatch):
    """Processes are started after the first block."""
    monkeypatch.setattr(sys.modules["flexura.study.engine.run"], "ALONE_SECONDS", 0.0)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "study"
    run(asked(limit=0.9, seconds=1e-3), space(), folder=folder, workers=2)
    return files(folder)


def test_in_memory_the_answers_are_those_of_the_designs():
    table, designs = run(asked(), space()), space().designs(0, 1000)
    found = table.to_columns()
    assert list(found) == [*table.columns]
    assert np.array_equal(found["design"], np.arange(1000))
    assert np.array_equal(found["a [SI]"], designs["a"])
    assert np.array_equal(found["f1 [Hz]"], designs["a"] / designs["b"])
    assert np.array_equal(found["f1 upper [Hz]"], designs["a"] / designs["b"] * 1.001)
    assert (len(table), table.is_complete, table.failed, table.folder) == (1000, True, 0, None)


@pytest.mark.usefixtures("at_once")
def test_one_worker_two_workers_and_none_give_the_same(tmp_path, undisturbed):
    table = run(asked(limit=0.9), space(), folder=tmp_path / "one", workers=1)
    run(asked(limit=0.9), space(), folder=tmp_path / "two", workers=2)
    assert files(tmp_path / "one") == files(tmp_path / "two") == undisturbed
    assert len(undisturbed) == SHARDS + 1
    assert same(table, run(asked(limit=0.9), space()))
    assert same(table, open_study(tmp_path / "one"))


@pytest.mark.usefixtures("at_once")
def test_long_studies_in_memory_are_shared_out():
    assert same(run(asked(limit=0.9), space(), workers=2), run(asked(limit=0.9), space(), workers=1))


@pytest.mark.parametrize("is_kept", [False, True])
@pytest.mark.parametrize(("blocks", "workers"), [(6, None), (16, 11)])
def test_processes_are_started_where_enough_is_left_and_no_more_than_blocks(
    tmp_path, monkeypatch, blocks, workers, is_kept
):
    module, clock, asked_for = sys.modules["flexura.study.engine.run"], iter(np.arange(0.0, 99.0, 0.5)), []

    def on_processes(work, numbers, count, say):
        asked_for.append(count)
        yield from ((number, work(number)) for number in numbers)

    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    monkeypatch.setattr(module, "on_processes", on_processes)
    table = run(asked(), space(64 * blocks), folder=tmp_path / "study" if is_kept else None, workers=50)
    assert table.is_complete
    assert asked_for == ([] if workers is None else [workers])


def test_designs_that_fail_are_rows_with_a_reason():
    table = run(asked(limit=0.9), space())
    found = table.to_columns()
    bad = found["a [SI]"] > 0.9
    assert np.array_equal(np.isnan(found["f1 [Hz]"]), bad)
    assert [text.startswith("a = ") for text in found["reason"]] == bad.tolist()
    assert table.failed == bad.sum() > 50
    (reason,) = table.reasons
    assert (reason.count, reason.design) == (table.failed, int(np.flatnonzero(bad)[0]))
    assert table.unproven == (found["a [SI]"] <= 0.01).sum() > 0
    assert [own.kind for own in table.warnings] == ["study", "proof"]
    assert f"{table.failed} of 1000 designs could not be worked out" in str(table.warnings[0])


def test_frequencies_that_are_not_proven_are_read_as_intervals():
    table = run(asked(), space())
    found, legible = table.to_columns(), table.legible(0, 1000)
    bad = ~found["is proven"]
    assert [isinstance(own, str) for own in legible["f1 [Hz]"]] == bad.tolist() and 0 < bad.sum() < 1000
    first = int(np.flatnonzero(bad)[0])
    ends = [float(own) for own in legible["f1 [Hz]"][first].split(" to ")]
    assert ends == pytest.approx([found[f"f1 {side} [Hz]"][first] for side in ("lower", "upper")], rel=1e-4)
    assert "intervals" in str(table.warnings[0])
    assert legible["mass [kg]"] == found["mass [kg]"].tolist()


def test_rows_that_are_not_there_have_the_types_of_those_that_are():
    guide = fx.load("examples/guide/guide.yaml")
    table = fx.sweep(guide, vary={"thickness": [3e-4, 4e-4]}, ask="f1, stress at carriage.x = 1 mm")
    found, none = table.rows(0, 2), table.rows(5, 9)
    assert [len(own) for own in none.values()] == [0] * len(found)
    assert [own.dtype for own in none.values()] == [own.dtype for own in found.values()]
    assert table.legible(5, 9)["f1 [Hz]"] == []


def test_extremes_are_those_of_all_designs(tmp_path):
    for table in (run(asked(limit=0.9), space()), run(asked(limit=0.9), space(), folder=tmp_path / "s", workers=1)):
        found = table.to_columns()
        own = table.summary.extremes["mass [kg]"]
        assert (own.lowest, own.highest) == (np.nanmin(found["mass [kg]"]), np.nanmax(found["mass [kg]"]))
        assert own.lowest_design == np.nanargmin(found["mass [kg]"])
        assert table.design(own.highest_design)["mass [kg]"] == own.highest


@pytest.mark.parametrize("shards", [9, *(pytest.param(own, marks=pytest.mark.slow) for own in (1, 13))])
def test_a_client_killed_at_any_moment_goes_on(tmp_path, undisturbed, shards):
    folder = tmp_path / "study"
    process = started("folder_study", folder, 2)
    while len(list(folder.glob("*.parquet"))) < shards:
        assert process.poll() is None
        time.sleep(0.005)
    process.kill()
    process.wait()
    before = open_study(folder)
    assert shards * 64 <= len(before) < 1000
    assert "still to be worked out" in str(before.warnings[0])
    table = run(asked(limit=0.9, seconds=1e-3), space(), folder=folder, workers=2)
    assert len(table) == 1000
    assert files(folder) == undisturbed


def test_an_interruption_keeps_what_is_done(tmp_path, undisturbed):
    folder = tmp_path / "study"
    process = started("folder_study", folder, 2)
    while len(list(folder.glob("*.parquet"))) < 3:
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) not in (0, None)
    assert not list(folder.glob(".flexura*"))
    run(asked(limit=0.9, seconds=1e-3), space(), folder=folder, workers=1)
    assert files(folder) == undisturbed


@pytest.mark.usefixtures("at_once")
def test_a_worker_that_dies_is_named_and_its_block_done_again(tmp_path, undisturbed):
    own = asked(limit=0.9, deadly=(0.3, 0.301), scratch=tmp_path, deaths=1)
    table = run(own, space(), folder=tmp_path / "study", workers=2)
    (note,) = table.notes
    assert "was killed by signal 9 at designs " in note
    assert files(tmp_path / "study") == undisturbed


@pytest.mark.usefixtures("at_once")
def test_a_block_that_kills_every_worker_ends_the_study_and_keeps_the_others(tmp_path):
    own = asked(limit=0.9, deadly=(0.3, 0.301), scratch=tmp_path, deaths=9)
    with pytest.raises(SolverError, match=r"killed by signal 9 .*\n *\d+ of 1000 designs are kept in .*study"):
        run(own, space(), folder=tmp_path / "study", workers=2)
    assert 0 < len(open_study(tmp_path / "study")) < 1000


def test_workers_end_with_the_process_that_asks(tmp_path):
    process = started("folder_study", tmp_path / "study", 2)
    children = list[int]()
    while len(children) < 2 or not list((tmp_path / "study").glob("*.parquet")):
        assert process.poll() is None
        time.sleep(0.005)
        children = [int(text) for text in _children(process.pid)]
    process.kill()
    process.wait()
    end = time.monotonic() + 20
    while any(_is_running(own) for own in children) and time.monotonic() < end:
        time.sleep(0.02)
    assert not any(_is_running(own) for own in children)


def _children(pid):
    return subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, check=False).stdout.split()


def _is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("how", [{}, {"workers": 1, "folder": "study"}])
def test_what_a_block_raises_is_raised(tmp_path, how):
    how = {name: tmp_path / value if name == "folder" else value for name, value in how.items()}
    with pytest.raises((OptionError, SolverError), match="this cannot be"):
        run(asked(wrong=0.5), space(), **how)


def test_a_time_limit_keeps_what_is_done(tmp_path, undisturbed):
    with pytest.raises(OutOfTime, match=r"stopped after 0.2 s\n *\d+ of 1000 designs are kept"), time_limit(0.2):
        run(asked(limit=0.9, seconds=1e-3), space(), folder=tmp_path / "study", workers=1)
    run(asked(limit=0.9, seconds=1e-3), space(), folder=tmp_path / "study", workers=1)
    assert files(tmp_path / "study") == undisturbed


def test_progress_begins_with_what_is_there(tmp_path):
    told = []
    run(asked(), space(), folder=tmp_path / "study", workers=1)
    for file in sorted((tmp_path / "study").glob("*.parquet"))[-2:]:
        file.unlink()
    run(asked(), space(), folder=tmp_path / "study", workers=1, progress=told.append)
    assert [(own.words, own.done, own.of) for own in told] == [("designs", k, 1000) for k in (896, 960, 1000)]


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="ru_maxrss is in kB on Linux")
def test_memory_is_flat(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", "from helpers.cheap_studies import million; million()"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    designs, failed, memory = map(int, done.stdout.split())
    assert designs == 10**6
    assert failed == pytest.approx(10**5, rel=1e-3)
    assert memory < 40e6  # the columns of all are 72 MB


@pytest.mark.parametrize(
    ("designs", "stacks", "each"),
    [
        (1, 64, 4),
        (500, 64, 8),
        (4096, 64, 64),
        (4224, 128, 64),
        (131_072, 2048, 64),
        (10**7, 2048, 1220),
        (10**8, 12224, 12208),
        (10**12, 65536, 65536),
    ],
)
def test_blocks_are_the_same_on_every_machine(designs, stacks, each):
    assert (block_size(designs, True), block_size(designs, False)) == (stacks, each)


def test_blocks_of_what_takes_long_are_small():
    guide = fx.load("examples/guide/guide.yaml")
    questions = (
        "f1, mass",
        "f1, stress(leaf1) at x = 1 mm",
        "f1 at x = 1 mm",
        "f(x) at x = 1 mm",
        "f(x), compliance(x)",
    )
    assert [asked_of(guide, own).is_stacked for own in questions] == [True, False, False, False, True]


def test_more_designs_than_memory_is_meant_to_hold_are_refused_at_once(tmp_path):
    with pytest.raises(OptionError, match=r"without a folder: at most 20 000 000 designs .*found 1 000 000 000 000"):
        run(asked(), Space((Variable("a", 0.0, 1.0), Variable("b", 1.0, 2.0)), "latin hypercube", 10**12))
    with size_limits(designs=999):
        with pytest.raises(OptionError, match="a folder holds any number"):
            run(asked(), space())
        assert run(asked(), space(), folder=tmp_path / "study").is_complete


@pytest.mark.parametrize(
    ("how", "said"), [({"workers": 0}, "at least 1"), ({"workers": 2, "scheduler": "tcp://a:1"}, "of its own")]
)
def test_who_works(how, said):
    with pytest.raises(OptionError, match=said):
        run(asked(), space(), **how)


def test_a_parameter_that_is_asked_too_has_a_heading_of_its_own():
    own = asked()
    masses = Space(
        (Variable("a", 0.0, 1.0), Variable("b", 1.0, 2.0), Variable("mass", 1.0, 2.0, unit="kg")), "sobol", 8
    )
    assert "parameter mass [kg]" in run(own, masses).columns


def test_a_table_is_plain_data():
    found = run(asked(limit=0.9), space()).to_dict()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert (found["designs"], found["done"], found["asked"]) == (1000, 1000, ["f1 [Hz]", "mass [kg]"])
