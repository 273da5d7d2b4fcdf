"""Every ratio of speed that the pages quote, each like for like, in one table; and its history.

    python benchmarks/bench.py                     everything, some minutes; a row each goes to benchmarks/history.csv
    python benchmarks/bench.py --only frf steps    some groups, and nothing is recorded
    python benchmarks/bench.py --list              the groups

What each row means, and on what machine: benchmarks/README.md. Both sides of a row give the same outputs of a model of
the same order, on one thread, in one process, and are held against each other before they are timed. Ratios are of
processor time, that of the other over ours; a row whose other program is missing is left out and says so.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import argparse
import csv
import datetime
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import pairs

import flexura
from flexura.files import complete_file

HISTORY = Path(__file__).with_name("history.csv")
COLUMNS = ("date", "version", "commit", "machine", "row", "value")
SLOWER = 0.7
"""A ratio that has fallen below this share of what this machine had is told."""

LAST = 5
"""Runs of this machine whose median is what it had: one that was fallen, too, does not hide the next."""


@dataclass(frozen=True)
class Row:
    """A ratio, with what the last runs on this machine had."""

    pair: pairs.Pair
    before: float | None

    @property
    def has_fallen(self) -> bool:
        """Whether ours has become slower beside the other."""
        return self.before is not None and self.pair.ratio < SLOWER * self.before

    def __str__(self) -> str:
        own, other = (1e3 * seconds for seconds in (self.pair.own, self.pair.other))
        before = "" if self.before is None else f"{self.before:.3g}"
        told = f"{self.pair.row:<29}{self.pair.order or '-':>6}{own:>11.4g}{other:>11.4g}"
        apart = "-" if self.pair.apart is None else f"{self.pair.apart:.0e}"
        return f"{told}{self.pair.ratio:>9.3g}{before:>9}{apart:>9}  {self.pair.against}" + (
            "   FALLEN" if self.has_fallen else ""
        )


def machine() -> str:
    """Processor, system and Python, in one line."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        models = [line.partition(":")[2].strip() for line in info.read_text().splitlines() if "model name" in line]
        name = models[0] if models else name
    return f"{name}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"


def commit() -> str:
    """Short name of the commit, with a + where files differ from it."""
    told = ["git", "-C", str(HISTORY.parent), "describe", "--always", "--dirty=+", "--exclude=*"]
    done = subprocess.run(told, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def recorded() -> list[dict[str, str]]:
    """Rows of the history, oldest first."""
    if not HISTORY.exists():
        return []
    with HISTORY.open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def last_ratios(history: list[dict[str, str]]) -> dict[str, float]:
    """The median of the last values of every row on this machine."""
    found, here = dict[str, list[float]](), machine()
    for one in history:
        if one["machine"] == here:
            found.setdefault(one["row"], []).append(float(one["value"]))
    return {row: median(values[-LAST:]) for row, values in found.items()}


def record(history: list[dict[str, str]], rows: list[Row]) -> None:
    """Append a run to the history."""
    now = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M")
    same = (now, flexura.__version__, commit(), machine())
    new = [(*same, row.pair.row, f"{row.pair.ratio:.4g}") for row in rows]
    with complete_file(HISTORY) as path, path.open("w", newline="", encoding="utf-8") as lines:
        table = csv.writer(lines, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows([*([one[name] for name in COLUMNS] for one in history), *new])


def measured(groups: list[Callable[[], Iterator[pairs.Pair]]], before: dict[str, float]) -> Iterator[Row]:
    """Rows as they are found; what cannot be measured is told."""
    for group in groups:
        try:
            for pair in group():
                yield Row(pair, before.get(pair.row))
        except (ImportError, RuntimeError) as error:
            print(f"{group.__name__}: left out, {error}", flush=True)


def main() -> None:
    """Measure, print, record."""
    groups = {group.__name__: group for group in pairs.GROUPS}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--only", nargs="+", choices=groups, metavar="GROUP", help="some groups, not recorded")
    parser.add_argument("--list", action="store_true", help="the groups")
    asked = parser.parse_args()
    if asked.list:
        for name, group in groups.items():
            print(f"{name:<12}{(group.__doc__ or '').splitlines()[0]}")
        return
    history = recorded()
    print(f"flexura {flexura.__version__}, {commit()}; {machine()}")
    print(f"{'row':<29}{'order':>6}{'ours ms':>11}{'other ms':>11}{'ratio':>9}{'before':>9}{'apart':>9}  the other")
    rows = list[Row]()
    for row in measured([groups[name] for name in asked.only or groups], last_ratios(history)):
        print(row, flush=True)
        rows.append(row)
    if not asked.only:
        record(history, rows)
    sys.exit(any(row.has_fallen for row in rows))


if __name__ == "__main__":
    main()
