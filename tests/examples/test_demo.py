"""What `make demo` runs ends well, command by command."""

import re
import shlex
from pathlib import Path

import pytest

from helpers.shell import flexura

ROOT = Path(__file__).parents[2]
DEMO = ROOT / "examples/rpr/demo.py"
COMMANDS = re.findall(r"^flexura (.*)$", DEMO.read_text(encoding="utf-8"), re.MULTILINE)


def test_the_demo_is_what_make_runs():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert "\ndemo: $(STAMP)\n\t@$(BIN)/python examples/rpr/demo.py\n" in makefile
    assert COMMANDS


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_demo(command, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    words = [str(tmp_path) if word.startswith("out/") else word for word in shlex.split(command)]
    done = flexura(*words)
    assert done.returncode == 0, done.stderr
    assert done.stdout
    assert "--plot" not in words or list(tmp_path.glob("*.png"))
