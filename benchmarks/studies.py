"""Studies of the RPR mechanism, six proven frequencies of each design: what the engine adds to the kernel, one run.

    python benchmarks/studies.py [DESIGNS]      100000 designs of the long study by default, a minute or two
    python benchmarks/studies.py names          designs a second by what is asked, of the RPR mechanism and the guide

Section sizes vary by 10 %, Sobol' points. Processor time is that of all processes; a design costs what a study of many
takes more than one of few, so that starts of processes do not count. The long study is extrapolated to ten million.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flexura
from flexura.study.engine.work import Work
from flexura.study.questions import questions
from flexura.study.space import Space, variables

RPR = Path(__file__).parents[1] / "examples" / "rpr" / "rpr.yaml"
SECTIONS = ("leaf_thickness", "plate", "arm_thickness", "r_web", "u_web")
ASK = "f1, f2, f3, f4, f5, f6"
MANY = 10_000_000
FEW, MORE = 4096, 36_864
TASKS = 1000
ROUNDS = 3
NAMES = {
    "rpr": "f1; f(platform.x); compliance(platform.x); stiffness(platform.y); coupling(platform.x, platform.y);"
    " amplification(platform.x, platform.y); frf(platform.x, platform.x, 20 Hz)",
    "guide": "f1; f(x); compliance(x); stiffness(y); coupling(carriage.x, carriage.y);"
    " amplification(carriage.x, carriage.y); frf(x, carriage.x, 20 Hz); reach(x); stress at x = 2 mm;"
    " stiffness(y) at x = 2 mm",
}
VARIED = {"rpr": SECTIONS, "guide": ("thickness", "length")}


def ranges(mechanism: flexura.Mechanism) -> dict[str, tuple[float, float]]:
    """What varies, SI."""
    sizes = {name: float(mechanism.parameters[name].value) for name in SECTIONS}  # type: ignore[arg-type]
    return {name: (0.9 * size, 1.1 * size) for name, size in sizes.items()}


def processor() -> float:
    """Processor time of this process and of those that have ended, s."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(own.ru_utime + own.ru_stime for own in used)


def timed(call: Callable[[], Any]) -> tuple[float, float]:
    """Wall clock and processor time, s."""
    wall, used = time.perf_counter(), processor()
    call()
    return time.perf_counter() - wall, processor() - used


def study(designs: int, workers: int) -> None:
    """Print what a study in a folder takes: times, bytes of the folder and of the memory of each process."""
    mechanism = flexura.load(RPR)
    with tempfile.TemporaryDirectory() as own:
        how = {"sampling": "sobol", "samples": designs, "folder": f"{own}/study", "workers": workers}
        wall, used = timed(lambda: flexura.sweep(mechanism, vary=ranges(mechanism), ask=ASK, **how))  # type: ignore[arg-type]
        table = flexura.open_study(f"{own}/study")
        folder = sum(file.stat().st_size for file in Path(own, "study").iterdir())
        memory = [resource.getrusage(who).ru_maxrss << 10 for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        unproven = table.designs - len(table) + table.failed + table.unproven
    print(json.dumps({"wall": wall, "processor": used, "folder": folder, "memory": memory, "unproven": unproven}))


def measured(designs: int, workers: int) -> dict[str, Any]:
    """The same of a program of its own."""
    command = [sys.executable, __file__, "study", str(designs), str(workers)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def each(workers: int) -> tuple[float, float]:
    """Seconds of wall clock and of processor time that a study takes for a design more."""
    found = []
    for _ in range(ROUNDS):
        few, more = measured(FEW, workers), measured(MORE, workers)
        found.append([(more[what] - few[what]) / (MORE - FEW) for what in ("wall", "processor")])
    wall, used = (min(own) for own in zip(*found, strict=True))
    return wall, used


def kernel() -> tuple[float, float]:
    """Seconds of processor time for each design: of the verb, and of the blocks of a study."""
    mechanism = flexura.load(RPR)
    plan = flexura.Plan(mechanism)
    space = Space(variables(mechanism, ranges(mechanism)), "sobol", 10**6)
    work = Work(questions(plan, ASK), space, {})
    designs = space.designs(0, work.size)
    calls = (lambda: flexura.natural_frequencies(plan, designs), lambda: work(0))
    for call in calls:
        call()
    bare, blocks = (min(timed(call)[1] for _ in range(ROUNDS)) / work.size for call in calls)
    return bare, blocks


def by_name() -> None:
    """Print designs a second of a processor for each of the names that may be asked."""
    for name, asks in NAMES.items():
        mechanism = flexura.load(RPR.parents[1] / name / f"{name}.yaml")
        plan = flexura.Plan(mechanism)
        at = plan.parameter_values()
        space = Space(
            variables(mechanism, {own: (0.9 * at[own], 1.1 * at[own]) for own in VARIED[name]}), "sobol", 4096
        )
        for ask in asks.split("; "):
            own = questions(plan, ask)
            designs = space.designs(0, 512 if own.is_stacked else 2)
            own.values(designs)
            used = min(timed(lambda own=own, designs=designs: own.values(designs))[1] for _ in range(ROUNDS))  # type: ignore[misc]
            print(f"{name:<8}{ask:<44}{len(next(iter(designs.values()))) / used:>10.0f} designs/s", flush=True)


def a_task_each() -> tuple[float, float]:
    """Seconds of wall clock for each design on a dask cluster of two: a task per design, and a study."""
    import distributed

    mechanism = flexura.load(RPR)
    plan = flexura.Plan(mechanism)
    designs = Space(variables(mechanism, ranges(mechanism)), "sobol", TASKS).designs(0, TASKS)
    one_each = [{name: float(own[k]) for name, own in designs.items()} for k in range(TASKS)]
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        shared = client.scatter(plan, broadcast=True)

        def tasks() -> None:
            client.gather(client.map(proven, one_each, plan=shared, pure=False))

        def run(count: int) -> None:
            how = {"sampling": "sobol", "samples": count, "scheduler": cluster.scheduler_address}
            flexura.sweep(mechanism, vary=ranges(mechanism), ask=ASK, **how)  # type: ignore[arg-type]

        tasks(), run(FEW)
        by_task = timed(tasks)[0] / TASKS
        by_study = (timed(lambda: run(MORE))[0] - timed(lambda: run(FEW))[0]) / (MORE - FEW)
    return by_task, by_study


def proven(one: dict[str, float], plan: flexura.Plan) -> list[float]:
    """Six frequencies of a design."""
    return flexura.natural_frequencies(plan, one).frequency_hz.tolist()


def main() -> None:
    long = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    bare, blocks = kernel()
    print(f"{'processor time of a design':<44}{'µs':>8}{'of the kernel':>16}")
    print(f"{'natural_frequencies, the kernel':<44}{1e6 * bare:>8.1f}{1.0:>16.3f}")
    print(f"{'blocks of a study':<44}{1e6 * blocks:>8.1f}{blocks / bare:>16.3f}", flush=True)
    for workers in (1, 2):
        wall, used = each(workers)
        text = f"study in a folder, {workers} worker{'s' if workers > 1 else ''}"
        print(f"{text:<44}{1e6 * used:>8.1f}{used / bare:>16.3f}   {1 / wall:.0f} designs/s", flush=True)
    print(f"{'designs':<12}{'min':>8}{'CPU min':>9}{'main MB':>9}{'worker MB':>11}{'folder MB':>11}{'not proven':>12}")
    for designs in (long // 10, long):
        own = measured(designs, 2)
        sizes = "".join(f"{size / 1e6:>{width}.0f}" for size, width in zip(own["memory"], (9, 11), strict=True))
        times = f"{own['wall'] / 60:>8.2f}{own['processor'] / 60:>9.2f}"
        print(f"{designs:<12}{times}{sizes}{own['folder'] / 1e6:>11.1f}{own['unproven']:>12}", flush=True)
    scale = MANY / long / 60
    print(
        f"{MANY} designs: {own['wall'] * scale:.1f} min, {own['processor'] * scale / 2:.1f} min of two processors",
        flush=True,
    )
    # last: dask sets how memory is given back, of this process and those that it starts
    by_task, by_study = a_task_each()
    print(f"dask, two workers: a task per design {1 / by_task:.0f} designs/s, a study {1 / by_study:.0f}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["study"]:
        study(int(sys.argv[2]), int(sys.argv[3]))
    elif sys.argv[1:2] == ["names"]:
        by_name()
    else:
        main()
