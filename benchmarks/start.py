"""Wall time of commands on a small mechanism, from the shell to the shell, beside the libraries that they stand on.

    python benchmarks/start.py

Each is the median of seven runs after one that is not counted.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

HOME = Path(__file__).parents[1]
RUNS = 7
GUIDE = "examples/guide/guide.yaml"
BARE, MODES = "import numpy, scipy.sparse.linalg", "flexura modes FILE"
COMMANDS = {
    BARE: ["-c", "import numpy, scipy.sparse.linalg"],
    "import flexura": ["-c", "import flexura"],
    "flexura --help": ["-m", "flexura", "--help"],
    "flexura check FILE": ["-m", "flexura", "check", GUIDE],
    MODES: ["-m", "flexura", "modes", GUIDE],
}


def seconds(arguments: list[str]) -> float:
    """Wall time of one run of Python."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    begun = time.perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=HOME, env=environment, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begun


def main() -> None:
    """Measure and print."""
    for name, arguments in COMMANDS.items():
        seconds(arguments)
        print(f"{name:36s} {statistics.median(seconds(arguments) for _ in range(RUNS)):6.2f} s")


if __name__ == "__main__":
    main()
