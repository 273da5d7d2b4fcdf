"""`flexura compare` as a user types it."""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from flexura.cli import main
from flexura.deadline import checkpoint
from flexura.errors import OptionError
from flexura.methods import Solution

GUIDE = Path(__file__).parents[2] / "examples" / "guide" / "guide.yaml"
MODULE = import_module("flexura.methods.compare")


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """Run the command in this process; exit status, stdout and stderr."""

    def call(*arguments: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["flexura", *map(str, arguments)])
        try:
            main()
            status = 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 0
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return call


@pytest.fixture
def methods(monkeypatch: pytest.MonkeyPatch):
    """Replace the methods after the exact one, which gives 100, 150 and 200 Hz."""

    def install(**solve):
        exact = MODULE.Method("exact", "exact", lambda task: Solution("", None, np.array([100.0, 150, 200])[: task.n]))
        others = tuple(MODULE.Method(key, key, function) for key, function in solve.items())
        monkeypatch.setattr(MODULE, "METHODS", (exact, *others))
        monkeypatch.setattr(MODULE, "EXACT", exact)
        monkeypatch.setattr(MODULE, "FINEST", exact)

    return install


def blind(task):
    return Solution("", 7, np.array([101.0, 202.0])[: task.n], note="a remark")


def refuses(task):
    raise OptionError("not for loops")


def endless(task):
    while True:
        checkpoint()


def interrupts(task):
    raise KeyboardInterrupt


def test_one_row_a_method(run, methods) -> None:
    methods(blind=blind)
    status, out, err = run("compare", GUIDE, "-n", "3")
    assert status == 0, err
    lines = out.splitlines()
    assert lines[0] == "parallel leaf-spring guide: errors against exact"
    assert lines[1].split()[:7] == ["method", "order", "worst", "error", "time", "mode", "1"]
    assert lines[2].split()[-3:] == ["100", "150", "200"]
    assert lines[3].split()[:4] == ["blind", "7", "+1", "%"] and lines[3].split()[-2:] == ["101", "202"]
    assert "blind: a remark; has no mode 2" in lines
    assert (
        err.splitlines() == ["exact ...", "blind ...", "exact, more modes to compare with ..."][: len(err.splitlines())]
    )


def test_many_modes_come_in_blocks(run, methods) -> None:
    many = np.arange(1.0, 13.0)
    methods()
    MODULE.METHODS[0].__dict__["solve"] = lambda task: Solution("", None, many[: task.n])
    _, out, _ = run("compare", GUIDE, "-n", "12")
    assert "mode 7" in out.splitlines()[1] and "mode 9" not in out.splitlines()[1]
    following = next(line for line in out.splitlines()[2:] if line.startswith("method"))
    assert "mode 9 [Hz]" in following and "mode 12 [Hz]" in following
    assert max(map(len, out.splitlines())) <= 140


def test_a_method_that_cannot_answer(run, methods) -> None:
    methods(choosy=refuses, blind=blind)
    status, out, _ = run("compare", GUIDE, "-n", "3")
    assert status == 0
    assert "choosy: not for loops" in out
    assert "blind" in out


def test_interrupted_between_rows(run, methods) -> None:
    methods(blind=blind, slow=interrupts, never=blind)
    status, out, err = run("compare", GUIDE, "-n", "3")
    assert status == 130
    assert "blind: a remark" in out
    assert "slow: interrupted before it was done" in out and "never: interrupted before it was done" in out
    assert "interrupted" in err
    status, out, _ = run("compare", GUIDE, "-n", "3", "--json")
    assert status == 130
    found = json.loads(out)["rows"]
    assert [row["method"] for row in found] == ["exact", "blind", "slow", "never"]
    assert [bool(row["failure"]) for row in found] == [False, False, True, True]


def test_interrupted_before_the_first_row(run, methods) -> None:
    methods(blind=blind)
    MODULE.METHODS[0].__dict__["solve"] = interrupts
    status, out, err = run("compare", GUIDE, "-n", "3")
    assert status == 130 and "interrupted" in err
    assert "exact: interrupted before it was done" in out and "blind: interrupted before it was done" in out


def test_a_method_out_of_time(run, methods) -> None:
    methods(endless=endless, blind=blind)
    status, out, _ = run("compare", GUIDE, "-n", "3", "--budget", "20 ms")
    assert status == 0
    assert "endless: stopped after 0.02 s: option --budget gives a method more time" in out
    assert "blind: a remark" in out


@pytest.mark.parametrize("budget", ["0 s", "-1", "1 mm", "soon", "1e999 s"])
def test_impossible_budgets(run, methods, budget) -> None:
    methods(blind=blind)
    status, out, err = run("compare", GUIDE, f"--budget={budget}")
    assert status == 2 and out == "" and "Traceback" not in err


def test_json_is_one_document(run) -> None:
    status, out, _ = run("compare", GUIDE, "-n", "2", "--json", "--methods", "lumped-parameter,constraint_modes")
    assert status == 0
    data = json.loads(out)
    assert [row["method"] for row in data["rows"]][1:] == ["constraint modes alone", "lumped parameter"]
    assert data["name"] == "parallel leaf-spring guide" and data["n"] == 2


def test_set_replaces_a_parameter(run) -> None:
    command = ("compare", GUIDE, "-n", "1", "--json", "--methods", "lumped_parameter", "--set")
    thin, thick = (
        json.loads(run(*command, f"thickness={t}")[1])["rows"][-1]["frequency_hz"][0] for t in ("0.4 mm", "0.8 mm")
    )
    assert thick > 2.5 * thin


@pytest.mark.parametrize(
    ("arguments", "fragment"),
    [
        (("absent.yaml",), "absent.yaml"),
        ((GUIDE, "--methods", "finite_strips"), "finite_strips"),
        ((GUIDE, "-n", "0"), "-n"),
        ((GUIDE, "--set", "thicknes=1 mm"), "thickness"),
    ],
)
def test_bad_arguments_exit_with_status_2(run, arguments, fragment) -> None:
    status, out, err = run("compare", *arguments)
    assert status == 2
    assert fragment in err and "Traceback" not in err
    assert out == ""
