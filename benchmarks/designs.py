"""Batches of designs of the RPR mechanism, six frequencies each: proven and unproven, sections and geometry, one run.

    python benchmarks/designs.py [DESIGNS]      4096 designs by default, about a minute

Two processes work on one BLAS thread each, in blocks as a study has them; every figure is the best of several rounds.
Designs a second are told by wall clock, of both, and by processor time, of one; beside these how many times as long the
same designs take one by one, and solved at full order by SciPy. Machines differ and are noisy: quote the ratios.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import sys
import time
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import eigsh

import flexura

RPR = Path(__file__).parents[1] / "examples" / "rpr" / "rpr.yaml"
SECTIONS = ("leaf_thickness", "plate", "arm_thickness", "r_web", "u_web")
GEOMETRY = ("leaf_length", "arm_length", "leaf_offset", "platform_thickness")
BLOCK = 1024
ROUNDS = 5
WORKERS = 2
Times = tuple[float, float]
"""Wall clock and processor time, s."""

VERBS = {"proven": flexura.natural_frequencies, "unproven": flexura.unproven_frequencies}
_PLAN: list[flexura.Plan] = []


def designs(names: tuple[str, ...], n: int, seed: int) -> dict[str, np.ndarray]:
    """Random designs within 10 % of the defaults."""
    rng = np.random.default_rng(seed)
    return {name: float(plan().mechanism.parameters[name].value) * rng.uniform(0.9, 1.1, n) for name in names}  # type: ignore[arg-type]


def plan() -> flexura.Plan:
    """The plan of this process."""
    if not _PLAN:
        _PLAN.append(flexura.Plan(flexura.load(RPR)))
    return _PLAN[0]


def worked(job: tuple[str, tuple[str, ...], int, int]) -> Times:
    """Times of a worker for its blocks of designs."""
    verb, names, n, seed = job
    own = designs(names, n, seed)
    wall, processor = time.perf_counter(), time.process_time()
    for first in range(0, n, BLOCK):
        VERBS[verb](plan(), {name: v[first : first + BLOCK] for name, v in own.items()})
    return time.perf_counter() - wall, time.process_time() - processor


def one_by_one(call: Callable[[dict[str, float]], object], names: tuple[str, ...], n: int) -> float:
    """Seconds of processor time for each of so many designs in turn."""
    own = designs(names, n, 1)
    each = [{name: float(v[k]) for name, v in own.items()} for k in range(n)]
    call(each[0])
    start = time.process_time()
    for one in each:
        call(one)
    return (time.process_time() - start) / n


def by_scipy(one: dict[str, float]) -> np.ndarray:
    """Six frequencies of the full order as a SciPy user finds them."""
    model = flexura.assemble(plan(), one)
    return np.asarray(eigsh(model.K, 6, model.M, sigma=0.0, return_eigenvectors=False))


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 4096
    print(
        f"{'six frequencies of each design':<34}{'designs/s':>11}{'a process':>11}{'one by one':>12}{'full order':>12}"
    )
    with get_context("spawn").Pool(WORKERS) as pool:
        for text, names in (("sections vary", SECTIONS), ("sections and geometry vary", SECTIONS + GEOMETRY)):
            full = one_by_one(by_scipy, names, 40)
            for verb, call in VERBS.items():
                found: list[Times] = []
                pool.map(worked, [(verb, names, 128, k) for k in range(4 * WORKERS)], chunksize=1)
                for _ in range(ROUNDS):
                    start = time.perf_counter()
                    each = pool.map(worked, [(verb, names, n // WORKERS, k) for k in range(WORKERS)], chunksize=1)
                    found.append((time.perf_counter() - start, sum(t for _, t in each)))
                wall, processor = (min(own) / n for own in zip(*found, strict=True))
                alone = one_by_one(lambda one, call=call: call(plan(), one), names, 40)  # type: ignore[misc]
                ratios = f"{alone / processor:>10.1f} x{full / processor:>10.0f} x"
                print(f"{text + ', ' + verb:<34}{1 / wall:>11.0f}{1 / processor:>11.0f}{ratios}", flush=True)


if __name__ == "__main__":
    main()
