"""The command that makes a mechanism of a drawing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import flexura as fx
from helpers.monoliths import GUIDES, drawn

pytest.importorskip("ezdxf")
pytest.importorskip("shapely")


def run(*arguments: str) -> object:
    from flexura.cli.app import app

    return CliRunner().invoke(app, ["understand", *arguments])


def test_a_drawing_becomes_a_file_that_other_commands_read(tmp_path: Path) -> None:
    path, out = drawn(GUIDES["B"], "svg", tmp_path), tmp_path / "guide.yaml"
    given = [str(path), "--thickness", "12 mm", "--material", "E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3"]
    done = run(*given, "--hold", "x = 0 mm", "--out", str(out), "--json", "--without-solid")
    assert done.exit_code == 0, done.output  # pyright: ignore[reportAttributeAccessIssue]
    data = json.loads(done.stdout)  # pyright: ignore[reportAttributeAccessIssue]
    assert [own["kind"] for own in data["flexures"]] == ["leaf", "leaf"]
    assert data["files"] == [str(out)]
    assert fx.modes(fx.load(out), n=1).frequency_hz[0] == pytest.approx(290.7, rel=0.015)


def test_options_that_are_wrong_are_refused(tmp_path: Path) -> None:
    path = str(drawn(GUIDES["B"], "lines", tmp_path))
    for options in (
        ("--thickness", "12", "--material", "Al-7075-T6", "--hold", "x = 0 mm"),
        ("--thickness", "-12 mm", "--material", "Al-7075-T6", "--hold", "x = 0 mm"),
        ("--thickness", "12 mm", "--material", "Al-7075-T6"),
    ):
        assert run(path, *options).exit_code != 0  # pyright: ignore[reportAttributeAccessIssue]
