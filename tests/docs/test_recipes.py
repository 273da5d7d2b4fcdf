"""The recipes of CONTRIBUTING.md are applied to a copy of the source, and what they end in is run there.

A block `# file: NAME` of Python is a new file; one of `diff` has lines that begin with `+`, to be put between those
that stand there already, which begin with a space; the first such place is meant. All other Python is run in order.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from helpers.doc_snippets import ROOT, Block, blocks, commands, mismatch

PAGE = ROOT / "CONTRIBUTING.md"
RECIPES = ("A new element: a notch contour", "A new verb", "A new file format")


def applied(block: Block, root: Path) -> None:
    """Put the new lines of a diff where its old ones stand."""
    file = root / block.file
    lines = block.text.splitlines(keepends=True)[1:]
    assert lines and all(line[0] in "+ " for line in lines), f"CONTRIBUTING.md:{block.line}"
    old = "".join(line[1:] for line in lines if line[0] == " ")
    text = file.read_text(encoding="utf-8")
    assert old and old in text, f"CONTRIBUTING.md:{block.line}: {block.file} has no longer\n{old}"
    file.write_text(text.replace(old, "".join(line[1:] for line in lines), 1), encoding="utf-8")


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The source with all recipes applied, in a folder that has the examples too, and what is to be run there."""
    root = tmp_path_factory.mktemp("recipes")
    shutil.copytree(ROOT / "src", root / "src", ignore=shutil.ignore_patterns("__pycache__", "node_modules"))
    shutil.copytree(ROOT / "examples" / "guide", root / "examples" / "guide")
    found = blocks(PAGE.read_text(encoding="utf-8"))
    for block in found:
        if block.language == "diff":
            applied(block, root)
        elif block.language == "python" and block.file:
            assert not (root / block.file).exists()
            (root / block.file).write_text(block.text, encoding="utf-8")
    return root, [block for block in found if block.language in ("python", "console") and not block.file]


def test_there_are_three():
    text = PAGE.read_text(encoding="utf-8")
    assert all(f"## {title}\n" in text for title in RECIPES)


def test_what_they_end_in_runs(copy):
    root, runs = copy
    script, expected = [], []
    for block in runs:
        if block.language == "python":
            script.append(block.text)
        for command in commands(block) if block.language == "console" else ():
            script.append(_as_shell(command.text))
            expected += command.expected
    env = {**os.environ, "PYTHONPATH": str(root / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(script)], cwd=root, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert not mismatch(["1 700.0", *expected], done.stdout)


def _as_shell(text: str) -> str:
    """Python that runs a command of flexura in this process."""
    return (
        "import contextlib, shlex, sys\nfrom flexura.cli import main\n"
        f"sys.argv = shlex.split({text!r})\nwith contextlib.suppress(SystemExit):\n    main()"
    )


def test_copied_source_is_formatted_and_clean(copy):
    """What the recipes write keeps the rules of the project."""
    root, _ = copy
    named = {block.file for block in blocks(PAGE.read_text(encoding="utf-8")) if block.file}
    files = [str(root / name) for name in sorted(named) if name.endswith(".py")]
    ruff = [sys.executable, "-m", "ruff"]
    for command in ("check", "format --check"):
        done = subprocess.run(
            [*ruff, *command.split(), "--config", str(ROOT / "pyproject.toml"), *files],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
