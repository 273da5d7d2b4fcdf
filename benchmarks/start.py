"""Processor time of whole commands, from the shell to the shell, beside the libraries that they stand on.

    python benchmarks/start.py

Each is the least and the median of seven runs after one that is not counted, which leaves compiled code behind. No
command can be below the line of all imports: Python and the packages that a command needs.
"""  # fmt: skip

from __future__ import annotations

import os
import statistics
import subprocess
import sys
from pathlib import Path

HOME = Path(__file__).parents[1]
RUNS = 7
GUIDE, RPR = "examples/guide/guide.yaml", "examples/rpr/rpr.yaml"
SOLVERS = "import numpy, scipy.linalg, scipy.sparse.linalg"
BARE, MODES = "all imports: typer, rich, pydantic, ruamel.yaml too", "flexura modes, a small file"
COMMANDS = {
    SOLVERS: ["-c", SOLVERS],
    BARE: ["-c", f"{SOLVERS}, pydantic, rich.console, ruamel.yaml, typer"],
    "import flexura": ["-c", "import flexura"],
    "flexura --help": ["-m", "flexura", "--help"],
    "flexura check, a small file": ["-m", "flexura", "check", GUIDE],
    MODES: ["-m", "flexura", "modes", GUIDE],
    "flexura modes, RPR": ["-m", "flexura", "modes", RPR],
    "flexura report, RPR": ["-m", "flexura", "report", RPR, "--out", "out/report.html"],
    "make demo": ["examples/rpr/demo.py"],
}


def seconds(arguments: list[str]) -> float:
    """Processor time of one run of Python, with what it starts."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": ""}
    before = os.times()
    subprocess.run([sys.executable, *arguments], cwd=HOME, env=environment, capture_output=True, check=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main() -> None:
    """Measure and print."""
    (HOME / "out").mkdir(exist_ok=True)
    for name, arguments in COMMANDS.items():
        seconds(arguments)
        times = [seconds(arguments) for _ in range(RUNS)]
        print(f"{name:52s} {min(times):6.2f} {statistics.median(times):6.2f} s")


if __name__ == "__main__":
    main()
