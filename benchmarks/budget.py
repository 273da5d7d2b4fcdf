"""Time of an error budget: the RPR platform with its piezo stacks, three disturbances, 10 000 frequencies.

    python benchmarks/budget.py [FREQUENCIES]

Of 12 modes with residual ones, of the low order, and from the plan on; one thread, the best of repeated runs.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx

FILE = Path(__file__).parents[1] / "examples" / "rpr" / "rpr_piezo.yaml"
OUTPUTS = ["lift", "roll", "pitch"]
REPEATS = 25


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    hz = np.geomspace(1.0, 1000.0, count)
    plan = fx.Plan(fx.load(FILE))
    low = fx.reduce(plan, tolerance=1e-3, up_to=2000.0)
    built = fx.system(low, inputs=["ground.tz", "*.piezo", "platform.tz"], outputs=OUTPUTS)
    models: dict[str, Any] = {"12 modes": built.modal(n=12), "low order, proven": low, "plan": plan}
    for name, model in models.items():
        best = np.inf
        for _ in range(REPEATS if name == "12 modes" else 5):
            begun = time.perf_counter()
            found = fx.budget(model, outputs=OUTPUTS, frequency_hz=hz)
            best = min(best, time.perf_counter() - begun)
        print(f"{name:20}{1e3 * best:8.1f} ms, {count} frequencies, lift {1e9 * found.of('lift'):.2f} nm")


if __name__ == "__main__":
    main()
