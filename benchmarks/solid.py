"""Time, memory and errors of `verify` on every example, with an empty cache and again.

    python benchmarks/solid.py [NAME ...]

One BLAS thread, six modes, two meshes each, a process of its own for every run, one run each: two minutes in all. Times
are those of the processor, which other programs disturb least.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from pathlib import Path

EXAMPLES = Path(__file__).parents[1] / "examples"
NAMES = ("guide", "pivot", "amplifier", "tip_tilt", "xy_stage", "rpr")
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def run(name: str, cache: Path, out: Path) -> tuple[dict, float, float]:
    """Result, processor time, s, and peak memory, MiB, of one command."""
    flexura = Path(sys.executable).with_name("flexura")
    command = [str(flexura), "verify", str(EXAMPLES / name / f"{name}.yaml"), "--json"]
    environment = os.environ | dict.fromkeys(THREADS, "1") | {"FLEXURA_CACHE": str(cache)}
    with out.open("wb") as stdout, Path(os.devnull).open("wb") as nothing:
        moves = [(os.POSIX_SPAWN_DUP2, stdout.fileno(), 1), (os.POSIX_SPAWN_DUP2, nothing.fileno(), 2)]
        _, status, usage = os.wait4(os.posix_spawn(command[0], command, environment, file_actions=moves), 0)
    if status:
        raise SystemExit(f"{' '.join(command)} failed")
    return json.loads(out.read_text()), usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def percent(value: float | None) -> str:
    return "" if value is None else f"{100 * value:+.2g} %"


def main(names: list[str]) -> None:
    """One row of a table for every example."""
    print("| mechanism | meshes, DOFs | plain | corrected | uncertain by | first time | again |")
    print("|---|---|---|---|---|---|---|")
    for name in names or NAMES:
        with tempfile.TemporaryDirectory() as folder:
            cache, out = Path(folder) / "cache", Path(folder) / "out.json"
            result, first, memory = run(name, cache, out)
            _, again, _ = run(name, cache, out)
        worst = {row["model"]: row["worst_error"] for row in result["rows"]}
        dofs = " and ".join(f"{solid['dofs']:,}".replace(",", " ") for solid in result["solids"])
        unsure = max((u for u in result["uncertainty"] if u is not None), default=None)
        cells = [name, dofs, percent(worst["plain, full order"]), percent(worst["corrected, full order"])]
        cells += [percent(unsure).lstrip("+"), f"{first:.0f} s, {memory:.0f} MiB", f"{again:.1f} s"]
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
