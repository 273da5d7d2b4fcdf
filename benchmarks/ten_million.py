"""A study of ten million designs of the RPR mechanism, six proven frequencies each, on a local dask cluster of two.

    python benchmarks/ten_million.py FOLDER                     ten million designs, 7 minutes on two processors
    python benchmarks/ten_million.py FOLDER --designs 200000    the same, smaller

Section sizes vary by 10 %, Sobol' points. Half of the designs done, the process that runs the study is killed
(SIGKILL), and another goes on in the same folder; the same command does so, too, whenever this one is stopped. Beside
the folder FOLDER.log is written: a line every so often with the designs that are done, designs a second since the line
before, the memory (RSS) of the process that writes and of the two workers, and bytes of the folder. At last every
design is counted, and a sample drawn at random is worked out again, one at a time, from the sizes in the files: as it
was asked, which gives the same bits, and in full order, whose frequencies lie within the proven intervals.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import argparse
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil

import flexura
from flexura.deadline import Progress
from flexura.study.questions import questions

sys.path.insert(0, str(Path(__file__).parent))
from studies import ASK, MANY, RPR, SECTIONS, ranges

WORKERS = 2
HELD = str(256 << 20)
"""Bytes that workers keep between blocks: what dask has them let go of by default makes them half as quick."""
CONFIGURED = {
    "distributed.nanny.pre-spawn-environ": {"MALLOC_MMAP_THRESHOLD_": HELD, "MALLOC_TRIM_THRESHOLD_": HELD},
    "distributed.worker.profile.enabled": False,  # of which a worker keeps the last 1000 s, 0.2 MB each
}
GONE_SECONDS = 60.0
STEADY = 1.05
"""Largest ratio of the memory of a worker at the end and after a quarter of the study."""


class Log:
    """Lines with the time since the log was begun, printed and kept."""

    def __init__(self, path: Path) -> None:
        self._path, self._begun = path, time.monotonic()

    def __call__(self, text: str) -> None:
        line = f"{time.monotonic() - self._begun:9.1f} s  {text}"
        print(line, flush=True)
        with self._path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")


def megabytes(processes: list[psutil.Process]) -> list[float]:
    """Memory of each."""
    return [process.memory_info().rss / 1e6 for process in processes]


def size(folder: Path) -> int:
    """Bytes of the files of a study."""
    return sum(file.stat().st_size for file in folder.iterdir())


def run(folder: Path, designs: int, every: float) -> None:
    """The study, or what is left of it; a line of numbers for every so many seconds."""
    import dask.config
    import distributed

    mechanism = flexura.load(RPR)
    with (
        dask.config.set(CONFIGURED),
        distributed.LocalCluster(n_workers=WORKERS, threads_per_worker=1, dashboard_address=None) as cluster,
    ):
        own, workers = psutil.Process(), [psutil.Process(nanny.pid) for nanny in cluster.workers.values()]
        print("workers", *(worker.pid for worker in workers), flush=True)
        last = 0.0

        def say(progress: Progress) -> None:
            nonlocal last
            if time.monotonic() - last > every or progress.done in (0, designs):
                last = time.monotonic()
                print("done", progress.done, *megabytes([own, *workers]), size(folder), flush=True)

        flexura.sweep(
            mechanism,
            vary=ranges(mechanism),
            ask=ASK,
            sampling="sobol",
            samples=designs,
            folder=folder,
            scheduler=cluster.scheduler_address,
            progress=say,
        )


class Runs:
    """Processes that run the study one after the other, and what they tell."""

    def __init__(self, folder: Path, designs: int, every: float, log: Log) -> None:
        self.log = log
        self.memory: list[list[float]] = []
        """MB of the process that writes and of the workers, since the last process was started."""
        self._command = [sys.executable, __file__, str(folder), "--designs", str(designs), "--every", str(every)]

    def run(self, until: float) -> bool:
        """Run until so many designs are done, then kill the process; True where it came to its end before."""
        done, at, workers = 0, time.monotonic(), list[int]()
        self.memory = []
        process = subprocess.Popen([*self._command, "--run"], stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        for line in process.stdout:
            kind, *numbers = line.split() or [""]
            if kind == "workers":
                workers = [int(number) for number in numbers]
            if kind != "done":
                continue
            now, (count, *memory, folder) = time.monotonic(), map(float, numbers)
            rate = (count - done) / max(now - at, 1e-9) if self.memory and count > done else 0.0
            self.memory.append(memory)
            sizes = " ".join(f"{own:6.1f}" for own in memory)
            self.log(f"{count:>10.0f} designs {rate:7.0f}/s  RSS MB {sizes}  folder MB {folder / 1e6:7.1f}")
            done, at = count, now
            if count >= until:
                process.kill()
                break
        status = process.wait()
        if status and status != -signal.SIGKILL:
            raise SystemExit(f"the study ended with status {status}")
        if status:
            begun = time.monotonic()
            while any(map(psutil.pid_exists, workers)) and time.monotonic() - begun < GONE_SECONDS:
                time.sleep(0.1)
            left = sum(map(psutil.pid_exists, workers))
            self.log(f"killed; of its workers {left} are left after {time.monotonic() - begun:.1f} s")
        return status == 0


def faults(folder: Path, designs: int, sample: int, log: Log) -> list[str]:
    """What is wrong with a study, in words."""
    table, wrong, following = flexura.open_study(folder), list[str](), 0
    for block in table.blocks(["design", "is proven"]):
        if not np.array_equal(block["design"], np.arange(following, following + len(block["design"]))):
            wrong.append(f"designs do not follow each other behind {following}")
        following += len(block["design"])
    if following != designs or not table.is_complete:
        wrong.append(f"{following} designs in place of {designs}")
    log(f"{following} designs, each once; {table.failed} failed, {table.unproven} not proven")
    log(f"{size(folder) / 1e6:.1f} MB, {size(folder) / designs:.1f} bytes a design")

    plan, numbers = flexura.Plan(flexura.load(RPR)), np.random.default_rng(designs).integers(0, designs, sample)
    asked, alike, widest, furthest = questions(plan, ASK), 0, 0.0, 0.0
    for number in numbers.tolist():
        row = table.design(number)
        kept, lower, upper = (
            np.array([row[f"f{k + 1}{which} [Hz]"] for k in range(6)]) for which in ("", " lower", " upper")
        )
        one = {name: row[f"{name} [m]"] for name in SECTIONS}
        [single] = asked.values({name: np.array([value]) for name, value in one.items()}).value
        full = flexura.modes(plan, one, n=6, order="full").frequency_hz
        alike += np.array_equal(kept, single)
        widest, furthest = max(widest, (upper / lower - 1).max()), max(furthest, np.abs(kept / full - 1).max())
        for what, values in (("what is asked", single), ("full order", full)):
            if not ((lower <= values) & (values <= upper)).all():
                wrong.append(f"design {number}: frequencies of {what} lie outside their proven intervals")
    log(f"{sample} at random: {alike} equal to the last bit when they are asked for one at a time; against full order")
    log(f"the largest difference is {furthest:.1e}, within proven intervals of a width of up to {widest:.1e}, relative")
    return wrong


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--designs", type=int, default=MANY)
    parser.add_argument("--sample", type=int, default=500, help="designs that are worked out again at the end")
    parser.add_argument("--every", type=float, default=10.0, help="seconds between two lines")
    parser.add_argument("--run", action="store_true", help="the study alone, in this process")
    given = parser.parse_args()
    folder: Path = given.folder
    if given.run:
        run(folder, given.designs, given.every)
        return
    log = Log(folder.with_name(folder.name + ".log"))
    begun = flexura.open_study(folder).done if (folder / "study.json").exists() else 0
    log(f"{given.designs} designs on {WORKERS} workers, of which {begun} are there")
    runs = Runs(folder, given.designs, given.every, log)
    is_ended = begun < given.designs / 2 and runs.run(given.designs / 2)
    if not is_ended:
        runs.run(np.inf)
    wrong = faults(folder, given.designs, given.sample, log)
    for k in range(WORKERS):
        own = [memory[1 + k] for memory in runs.memory]
        quarter = own[len(own) // 4]
        log(f"worker {k + 1}: {quarter:.1f} MB after a quarter of the lines, {own[-1]:.1f} at the end")
        if own[-1] > STEADY * quarter:
            wrong.append(f"the memory of worker {k + 1} grows")
    log("; ".join(wrong) or "whole and right")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
