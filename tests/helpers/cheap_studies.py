"""Studies of cheap questions: their folders, and programs of their own that run them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import flexura as fx
from flexura.study.engine import run
from flexura.study.space import Space, Variable
from helpers.cheap_questions import CheapQuestions, Described

ROOT = Path(__file__).parents[2]


def asked(**how) -> CheapQuestions:
    """Questions about a mechanism."""
    return CheapQuestions(Described(fx.load(ROOT / "examples/guide/guide.yaml")), **how)


def space(size: int = 1000, seed: int = 1) -> Space:
    """Samples of two numbers."""
    return Space((Variable("a", 0.0, 1.0), Variable("b", 1.0, 2.0)), "sobol", size, seed)


def files(folder: Path) -> dict[str, bytes]:
    """Everything in the folder of a study."""
    return {str(file.relative_to(folder)): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


def started(program: str, *arguments: object) -> subprocess.Popen[bytes]:
    """A process that runs a function of this module: `folder_study`."""
    where = os.pathsep.join([str(ROOT / "src"), str(ROOT / "tests")])
    return subprocess.Popen(
        [sys.executable, "-c", f"from helpers.cheap_studies import *; {program}(*{[str(a) for a in arguments]!r})"],
        env={**os.environ, "PYTHONPATH": where, "OPENBLAS_NUM_THREADS": "1"},
        cwd=ROOT,
    )


def folder_study(folder: str, workers: str) -> None:
    """A study of 1000 designs in a folder, of a millisecond each, by processes from its second block on."""
    sys.modules["flexura.study.engine.run"].ALONE_SECONDS = 0.0  # pyright: ignore[reportAttributeAccessIssue]
    run(asked(limit=0.9, seconds=1e-3), space(), folder=folder, workers=int(workers))


def million() -> None:
    """Print the memory, in bytes, that a million designs take beyond the first ten thousand."""
    import resource
    import tempfile

    def most() -> int:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

    with tempfile.TemporaryDirectory() as own:
        run(asked(), space(10**4), folder=f"{own}/few", workers=1)
        before = most()
        table = run(asked(limit=0.9), space(10**6), folder=f"{own}/many", workers=1)
        print(table.done, table.failed, most() - before)
