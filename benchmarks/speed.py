"""Speed and memory of flexura on the RPR mechanism, with OpenSeesPy beside it, all in one run on one BLAS thread.

    python benchmarks/speed.py            everything, about three minutes
    python benchmarks/speed.py --quick    without the scaling with the number of branches

Every time is the median of repeated calls; ratios compare medians of this run. Machines differ and are noisy: quote
the ratios.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

import numpy as np

import flexura
from flexura.linalg import lowest
from flexura.reduction import split
from flexura.structure import Design, stiffness_and_mass

ROOT = Path(__file__).parents[1]
RPR = ROOT / "examples" / "rpr" / "rpr.yaml"
LARGE = os.environ | {"FLEXURA_LIMITS": "nodes=1e6,elements=1e6"}
sys.path.insert(0, str(ROOT / "tests"))


def median_ms(call: Callable[[], object], repeat: int = 40, warm_up: int = 3) -> float:
    """Median time of a call, ms."""
    for _ in range(warm_up):
        call()
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * statistics.median(times)


def report(text: str, value: float, unit: str, note: str = "") -> None:
    print(f"{text:<74}{value:>12.4g} {unit}" + (f"   {note}" if note else ""), flush=True)


def single_design() -> None:
    """From changed parameters to six frequencies, by every route."""
    plan = flexura.Plan(flexura.load(RPR))
    webs = (3e-4 * (1 + 1e-4 * k) for k in count())

    def full() -> np.ndarray:
        K, M = stiffness_and_mass(Design.of(plan, {"r_web": next(webs)}))
        return lowest(K, M, 6).values

    def low() -> np.ndarray:
        return flexura.unproven_frequencies(plan, {"r_web": next(webs)})

    low(), full()
    full_ms, low_ms = median_ms(full), median_ms(low)
    report("full-order sparse solve, six frequencies", full_ms, "ms")
    report("low order through the plan, six frequencies", low_ms, "ms", f"1/{full_ms / low_ms:.1f} of the full solve")
    opensees(plan, low_ms)
    certified(plan, webs)

    sizes = {"r_web": next(webs)}
    values = plan.values(sizes)

    def assembled() -> None:
        stiffness_and_mass(Design.at(plan, values, sizes))

    report("full-order assembly of K and M", median_ms(assembled, 200), "ms")


def certified(plan: flexura.Plan, webs: Iterator[float]) -> None:
    """The smallest model proven to 0.1 %, against a full-order solve for as many frequencies."""
    for n, up_to in ((6, 24.0), (14, 560.0)):

        def full(n: int = n) -> np.ndarray:
            model = flexura.assemble(plan, {"r_web": next(webs)})
            return lowest(model.K, model.M, n).values

        def small(up_to: float = up_to) -> flexura.LowOrderModel:
            return flexura.reduce(plan, {"r_web": next(webs)}, tolerance=1e-3, up_to=up_to)

        order = small().order
        full_ms, small_ms = median_ms(full), median_ms(small)
        text = f"order {order}, 1/{full_ms / small_ms:.2f} of the full solve for {n} ({full_ms:.3g} ms)"
        report(f"reduction to 1e-3 up to {up_to:g} Hz, with proof", small_ms, "ms", text)


def opensees(plan: flexura.Plan, low_ms: float) -> None:
    """The same mesh in OpenSeesPy with consistent masses."""
    try:
        from helpers.opensees_mesh import OpenSeesMesh
    except (ImportError, RuntimeError) as error:
        print(f"OpenSeesPy is not available ({error}); on Debian: apt-get install libblas3 liblapack3")
        return
    mechanism = plan.mechanism.model_copy(update={"theory": "euler_bernoulli"})
    mesh = OpenSeesMesh(flexura.assemble(mechanism))
    frequencies = mesh.frequencies(6)
    own = flexura.modes(mechanism, n=6, order="full").frequency_hz
    error = np.abs(frequencies / own - 1).max()
    report("OpenSeesPy and flexura on the same mesh: largest difference", error, "", "six frequencies")
    solve_ms = median_ms(lambda: mesh.frequencies(6), 5, 1)
    report("OpenSeesPy, build and consistent-mass solve, six frequencies", solve_ms, "ms")
    report("low order through the plan against OpenSeesPy", solve_ms / low_ms, "times faster")


def start_up() -> None:
    """Import and command line, whole processes."""
    code = "import time; t = time.perf_counter(); import flexura; print(time.perf_counter() - t)"
    times = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5)]
    report("import flexura", statistics.median(times), "s")
    command = [sys.executable, "-m", "flexura", "modes", str(RPR)]
    whole = median_ms(lambda: subprocess.run(command, check=True, capture_output=True), 5, 1)
    report("flexura modes examples/rpr/rpr.yaml, whole process", whole / 1e3, "s")


def branches(n: int, order: str) -> dict[str, float]:
    """Processor time and memory of n branches of the RPR mechanism under one platform, in a process of its own."""
    mechanism = flexura.load(RPR)
    instance = mechanism.instances["rpu"]
    pattern = instance.pattern[0].model_copy(update={"count": n})
    wheel = mechanism.model_copy(
        update={
            "instances": {"rpu": instance.model_copy(update={"pattern": (pattern,)})},
            "bodies": {"platform": mechanism.bodies["platform"].model_copy(update={"carries": ("rpu*.b.top",)})},
            "ground": {"rpu*.a.bottom": mechanism.ground["rpu*.a.bottom"]},
        }
    )
    start = time.process_time()
    plan = flexura.Plan(wheel)
    planned = time.process_time()
    model = flexura.assemble(plan) if order == "full" else flexura.reduce(plan)
    assembled = time.process_time()
    parts = split(model) if isinstance(model, flexura.FullOrderModel) else None
    if parts is None:
        lowest(model.K, model.M, 6)
    else:
        parts.lowest(6)
    solved = time.process_time()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        "order": model.order,
        "plan": planned - start,
        "assemble": assembled - planned,
        "solve": solved - assembled,
        "peak": peak,
    }


def growth() -> None:
    """How processor time and memory grow with the number of branches."""
    print(f"\n{'branches':>10}{'model':>8}{'order':>10}{'plan s':>10}{'build s':>10}{'solve s':>10}{'peak MiB':>10}")
    for n in (4, 40, 400, 4000):
        for order in ("low", "full"):
            command = [sys.executable, __file__, "--branches", str(n), order]
            done = subprocess.run(command, capture_output=True, text=True, check=False, env=LARGE)
            if done.returncode:
                print(f"{n:>10}{order:>8}   failed: {done.stderr.strip().splitlines()[-1]}")
                continue
            r = json.loads(done.stdout)
            numbers = "".join(f"{r[key]:>10.3f}" for key in ("plan", "assemble", "solve"))
            print(f"{n:>10}{order:>8}{r['order']:>10.0f}{numbers}{r['peak']:>10.0f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--quick", action="store_true", help="leave out the scaling with the number of branches")
    parser.add_argument("--branches", nargs=2, metavar=("N", "ORDER"), help="one case of the scaling, as JSON")
    arguments = parser.parse_args()
    if arguments.branches:
        print(json.dumps(branches(int(arguments.branches[0]), arguments.branches[1])))
        return
    single_design()
    start_up()
    if not arguments.quick:
        growth()


if __name__ == "__main__":
    main()
