"""Commands, formats and sections of the report that come from another package."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

MINE = """
from pathlib import Path

import typer

from flexura.io import Format
from flexura.pages.report import Content, Paragraph


def hello(name: str) -> None:
    \"\"\"Greets.\"\"\"
    typer.echo(f"hello {name}")


def write_order(what, path):
    Path(path).write_text(f"order {what.order}")
    return Path(path)


ORDER = Format((".order",), ("full-order model",), "the order alone", write_order)
SECTION = ("Of mine", lambda subject: Content([Paragraph(f"{subject.mechanism.name} is mine")]))
"""

ENTRIES = """
[flexura.commands]
hello = mine:hello
[flexura.formats]
order = mine:ORDER
[flexura.report_sections]
mine = mine:SECTION
"""


@pytest.fixture
def run(tmp_path):
    (tmp_path / "mine.py").write_text(MINE, encoding="utf-8")
    about = tmp_path / "mine-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n", encoding="utf-8")
    (about / "entry_points.txt").write_text(ENTRIES, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])

    def call(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, *words]
        env = {**os.environ, "PYTHONPATH": path}
        return subprocess.run(command, capture_output=True, text=True, check=False, env=env)

    return call


def test_a_command_is_listed_and_run(run):
    assert "Greets" in run("-m", "flexura", "--help").stdout
    assert run("-m", "flexura", "hello", "you").stdout == "hello you\n"
    assert "No such command 'helo'" in run("-m", "flexura", "helo").stderr


def test_a_format_and_a_section(run, tmp_path):
    guide = str(Path("examples/guide/guide.yaml").resolve())
    out = tmp_path / "guide.order"
    done = run("-m", "flexura", "export", guide, "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert out.read_text(encoding="utf-8") == "order 132"
    page = tmp_path / "guide.html"
    done = run("-m", "flexura", "report", guide, "--out", str(page), "-n", "1")
    assert done.returncode == 0, done.stderr
    assert "parallel leaf-spring guide is mine" in page.read_text(encoding="utf-8")
