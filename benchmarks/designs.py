"""Batches of designs of the RPR mechanism, six frequencies each: proven and unproven, sections and geometry, one run.

    python benchmarks/designs.py [DESIGNS]      4096 designs by default, about a minute

The four branches are two equal pairs or, with each copy of a part its own sizes as in a tolerance study, all different:
then sixteen chains of elements are worked out instead of three, and four branches eliminated instead of two.

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
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import eigsh

import flexura
from flexura.describe import with_own_copies

RPR = Path(__file__).parents[1] / "examples" / "rpr" / "rpr.yaml"
SECTIONS = ("leaf_thickness", "plate", "arm_thickness", "r_web", "u_web")
GEOMETRY = ("leaf_length", "arm_length", "leaf_offset", "platform_thickness")
BLOCK = 1024
ROUNDS = 5
WORKERS = 2
Times = tuple[float, float]
"""Wall clock and processor time, s."""

VERBS = {"proven": flexura.natural_frequencies, "unproven": flexura.unproven_frequencies}


class Case(NamedTuple):
    """What varies: parameters by name, and whether each copy of a part has its own."""

    text: str
    names: tuple[str, ...]
    is_own: bool = False


CASES = (
    Case("sections vary", SECTIONS),
    Case("sections and geometry vary", SECTIONS + GEOMETRY),
    Case("own sections in each copy", SECTIONS, is_own=True),
    Case("own sections and geometry", SECTIONS + GEOMETRY, is_own=True),
)


@cache
def prepared(case: Case) -> tuple[flexura.Plan, dict[str, float]]:
    """The plan of this process, and the defaults of what varies."""
    mechanism = flexura.load(RPR)
    default = {name: float(mechanism.parameters[name].value) for name in case.names}  # type: ignore[arg-type]
    if case.is_own:
        mechanism, copies = with_own_copies(mechanism, case.names)
        default = {own: default[name] for name, instances in copies.items() for own in instances.values()}
    return flexura.Plan(mechanism), default


def designs(case: Case, n: int, seed: int) -> dict[str, np.ndarray]:
    """Random designs within 10 % of the defaults."""
    rng = np.random.default_rng(seed)
    return {name: value * rng.uniform(0.9, 1.1, n) for name, value in prepared(case)[1].items()}


def worked(job: tuple[str, Case, int, int]) -> Times:
    """Times of a worker for its blocks of designs."""
    verb, case, n, seed = job
    plan, own = prepared(case)[0], designs(case, n, seed)
    wall, processor = time.perf_counter(), time.process_time()
    for first in range(0, n, BLOCK):
        VERBS[verb](plan, {name: v[first : first + BLOCK] for name, v in own.items()})
    return time.perf_counter() - wall, time.process_time() - processor


def one_by_one(call: Callable[[flexura.Plan, dict[str, float]], object], case: Case, n: int) -> float:
    """Seconds of processor time for each of so many designs in turn."""
    plan, own = prepared(case)[0], designs(case, n, 1)
    each = [{name: float(v[k]) for name, v in own.items()} for k in range(n)]
    call(plan, each[0])
    start = time.process_time()
    for one in each:
        call(plan, one)
    return (time.process_time() - start) / n


def by_scipy(plan: flexura.Plan, one: dict[str, float]) -> np.ndarray:
    """Six frequencies of the full order as a SciPy user finds them."""
    model = flexura.assemble(plan, one)
    return np.asarray(eigsh(model.K, 6, model.M, sigma=0.0, return_eigenvectors=False))


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 4096
    print(
        f"{'six frequencies of each design':<37}{'designs/s':>11}{'a process':>11}{'one by one':>12}{'full order':>12}"
    )
    with get_context("spawn").Pool(WORKERS) as pool:
        for case in CASES:
            full = one_by_one(by_scipy, case, 40)
            for verb, call in VERBS.items():
                found: list[Times] = []
                pool.map(worked, [(verb, case, 128, k) for k in range(4 * WORKERS)], chunksize=1)
                for _ in range(ROUNDS):
                    start = time.perf_counter()
                    each = pool.map(worked, [(verb, case, n // WORKERS, k) for k in range(WORKERS)], chunksize=1)
                    found.append((time.perf_counter() - start, sum(t for _, t in each)))
                wall, processor = (min(own) / n for own in zip(*found, strict=True))
                alone = one_by_one(call, case, 40)
                ratios = f"{alone / processor:>10.1f} x{full / processor:>10.0f} x"
                print(f"{case.text + ', ' + verb:<37}{1 / wall:>11.0f}{1 / processor:>11.0f}{ratios}", flush=True)


if __name__ == "__main__":
    main()
