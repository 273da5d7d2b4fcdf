"""The shell's verbs as a user types them: exit status, what goes to stdout and stderr, and what is written."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from flexura.cli import main

ROOT = Path(__file__).parents[2]
RPR = ROOT / "examples" / "rpr" / "rpr.yaml"
GUIDE = ROOT / "examples" / "guide" / "guide.yaml"


@dataclass
class Done:
    returncode: int
    stdout: str
    stderr: str


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """Run the command in this process, as the shell would."""

    def call(*arguments: str | Path) -> Done:
        monkeypatch.setattr(sys, "argv", ["flexura", *map(str, arguments)])
        try:
            main()
            status = 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 0
        captured = capsys.readouterr()
        return Done(status, captured.out, captured.err)

    return call


def test_the_shell_command_itself() -> None:
    command = [sys.executable, "-m", "flexura", "modes", str(GUIDE), "-n", "1", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0
    assert json.loads(done.stdout)["name"] == "parallel leaf-spring guide"


def test_modes_prints_both_models_and_the_evidence(run) -> None:
    done = run("modes", RPR)
    assert done.returncode == 0, done.stderr
    assert "order 54 of 1062" in done.stdout
    assert "no mode is missing in this range" in done.stdout
    assert "platform turns about z" in done.stdout


def test_json_is_one_document_and_nothing_else(run) -> None:
    done = run("modes", RPR, "-n", "3", "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    data = json.loads(done.stdout)
    assert data["order"] == 54
    assert data["full_order"] == 1062
    assert len(data["modes"]) == 3
    for mode in data["modes"]:
        assert mode["angular_frequency"] == pytest.approx(6.283185307179586 * mode["frequency_hz"], rel=1e-12)
        error = mode["frequency_hz"] / mode["full_frequency_hz"] - 1
        assert mode["relative_error"] == pytest.approx(error, abs=1e-12)
    assert data["evidence"]["complete"] is True


def test_missing_modes_are_announced(run) -> None:
    """The amplifiers' own modes lie below the low-order model's twelfth frequency, which is blind to them."""
    done = run("modes", RPR, "-n", "12")
    assert done.returncode == 0
    assert "MISSING from the low-order model" in done.stdout
    kept = run("modes", RPR, "-n", "12", "--keep", "3")
    assert "no mode is missing in this range" in kept.stdout


def test_set_replaces_a_parameter(run, tmp_path: Path) -> None:
    rigid = tmp_path / "guide.yaml"
    text = GUIDE.read_text(encoding="utf-8")
    text = text.replace("    carries:", "    elastic: false\n    carries:")
    rigid.write_text(text.replace("reference: x\n", "reference: x\n        root: rigid\n"), encoding="utf-8")
    thin, thick = (
        json.loads(run("modes", rigid, "-n", "1", "--json", "--set", f"thickness={t}").stdout)["modes"][0][
            "frequency_hz"
        ]
        for t in ("0.5 mm", "1 mm")
    )
    # between rigid roots stiffness goes with the cube of the thickness;
    # 13/35 of each leaf's mass moves with the 37.8 g of the carriage
    carriage, leaf = 37.8, 7850 * 20e-3 * 60e-3 * 0.5e-3 * 1e3
    heavier = (carriage + 4 * leaf * 13 / 35) / (carriage + 2 * leaf * 13 / 35)
    assert thick / thin == pytest.approx((8 / heavier) ** 0.5, rel=1e-3)


def test_full_order_alone(run) -> None:
    data = json.loads(run("modes", GUIDE, "--order", "full", "-n", "2", "--json").stdout)
    assert data["order"] == data["full_order"]
    assert data["modes"][0]["relative_error"] == 0.0


def test_plot_writes_pictures(run, tmp_path: Path) -> None:
    done = run("modes", GUIDE, "-n", "2", "--plot", tmp_path / "pictures")
    assert done.returncode == 0, done.stderr
    written = sorted(p.name for p in (tmp_path / "pictures").iterdir())
    assert "mechanism.png" in written
    assert "mode_02.png" in written
    assert all((tmp_path / "pictures" / name).read_bytes().startswith(b"\x89PNG") for name in written)


def test_check_reports_what_was_understood(run) -> None:
    done = run("check", RPR)
    assert done.returncode == 0, done.stderr
    assert "full 1062, low 54" in done.stdout
    assert "half_ring" in done.stdout
    assert "rpu1.a.bottom: clamped" in done.stdout
    assert "twist of a leaf, taken as a plain beam" in " ".join(done.stdout.split())


def test_check_json(run) -> None:
    data = json.loads(run("check", RPR, "--json").stdout)
    assert data["low_order"] == 54
    assert {s["name"] for s in data["substructures"]} == {"r_pair", "half_ring", "u_pair", "mechanism"}


def test_schema_is_json(run) -> None:
    assert "properties" in json.loads(run("schema").stdout)


BROKEN = """\
flexura: 1
parameters:
  t: {value: 0.3 mm}
nodes:
  a: [0, 0, 0]
  b: [0, 0, 60]
flexures:
  blade:
    nodes: [a, c]
    material: unobtainium
    reference: x
    profile: {type: leaf, width: 10 mm, thickness: -t, colour: red}
ground:
  a: clamped
"""


@pytest.mark.parametrize("verb", ["modes", "check"])
def test_all_errors_at_once_with_file_and_line(run, verb: str, tmp_path: Path) -> None:
    file = tmp_path / "broken.yaml"
    file.write_text(BROKEN)
    plots = tmp_path / "plots"
    done = run(verb, file, *(("--plot", plots) if verb == "modes" else ()))
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    for line, fragment in [(6, "60"), (9, "c"), (10, "unobtainium"), (12, "colour")]:
        assert any(f"broken.yaml:{line}" in text and fragment in text for text in done.stderr.splitlines()), fragment
    assert not plots.exists()


@pytest.mark.parametrize(
    ("arguments", "fragment"),
    [
        (("modes", "absent.yaml"), "absent.yaml"),
        (("modes", GUIDE, "--set", "thicknes=1 mm"), "thickness"),
        (("modes", GUIDE, "--set", "thickness=1 kg"), "thickness"),
        (("modes", GUIDE, "--set", "thickness=100 mm"), "maximum"),
        (("modes", GUIDE, "--set", "nonsense"), "nonsense"),
        (("modes", GUIDE, "-n", "0"), "-n"),
        (("modes", GUIDE, "--order", "middling"), "middling"),
        (("modes", GUIDE, "--order", "full", "--keep", "2"), "--keep"),
    ],
)
def test_bad_arguments_exit_with_status_2(run, arguments: tuple[str, ...], fragment: str) -> None:
    done = run(*arguments)
    assert done.returncode == 2
    assert fragment in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_plot_into_a_file_is_refused(run, tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("kept")
    done = run("modes", GUIDE, "-n", "1", "--plot", blocked)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert blocked.read_text() == "kept"
