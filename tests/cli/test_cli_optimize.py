"""`flexura optimize`: what cannot be written is said before the search, or after its result is shown."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from flexura.cli.app import app

GUIDE = Path("examples/guide/guide.yaml")
FRONT = "several goals have a front"


def test_a_front_as_a_model_is_refused_before_the_search(monkeypatch, tmp_path):
    monkeypatch.setattr("flexura.study.optimum.optimize", lambda *_, **__: pytest.fail("it was searched"))
    goals = ["--vary", "thickness=0.3mm:0.6mm", "--maximise", "f1", "--minimise", "mass"]
    found = CliRunner().invoke(app, ["optimize", str(GUIDE), *goals, "--out", str(tmp_path / "best.yaml")])
    assert found.exit_code != 0 and FRONT in str(found.exception)
    assert not list(tmp_path.iterdir())


def test_a_front_of_the_file_is_shown_before_it_is_refused(tmp_path):
    text = GUIDE.read_text(encoding="utf-8").partition("studies:")[0]
    vary, goals = "{thickness: {from: 0.3 mm, to: 0.6 mm}}", "[{maximise: f1}, {minimise: mass}]"
    file = tmp_path / "guide.yaml"
    file.write_text(f"{text}studies: {{two: {{optimize: {{vary: {vary}, goals: {goals}}}}}}}\n", encoding="utf-8")
    out = tmp_path / "best.yaml"
    found = CliRunner().invoke(app, ["optimize", str(file), "--points", "3", "--starts", "1", "--out", str(out)])
    assert found.exit_code != 0 and FRONT in str(found.exception)
    assert "f1" in found.stdout and "mass" in found.stdout
    assert not out.exists()
