"""Record what every verb says of every file of the gallery and of the examples, and compare two records.

    python tools/record.py make FOLDER [--only WORD]     some minutes on two cores
    python tools/record.py compare BEFORE AFTER

A record holds, for each file and command, the JSON, the text for readers, the data of the pictures and the status;
besides public names, the time that importing takes and its memory. Comparing tells what is equal bit for bit, by how
much numbers differ at most, and which texts, keys and warnings do; the status is 1 where anything but times differs.
Records of one machine alone can be compared bit for bit.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
TIMES = re.compile(r"\b[\d.]+ (?:ms|s|min)\b")
"""What differs from run to run, in texts of commands that tell how long they took."""

MEASURED = """
import json, resource, time
start = time.perf_counter()
import flexura
spent = time.perf_counter() - start
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps({"seconds": spent, "megabytes": memory / 1024}))
"""
ROUNDS = 7


def files() -> list[Path]:
    """Every mechanism of the gallery and of the examples."""
    return sorted([*(ROOT / "src/flexura/gallery").glob("*.yaml"), *(ROOT / "examples").glob("*/*.yaml")])


def commands(file: Path) -> dict[str, list[str]]:
    """Arguments of every verb that says something of a file without measurements, by name."""
    import flexura as fx

    mechanism = fx.load(file)
    sizes = [name for name, own in mechanism.parameters.items() if isinstance(own.value, float) and own.value]
    body = next(iter(mechanism.bodies), None) or next(iter(mechanism.nodes), "")
    found = {
        "check": ["check", "--all"],
        "modes": ["modes", "-n", "6"],
        "buckling": ["buckling"],
        "published": ["published"],
        "statics": ["statics", "--load", f"{body}=1 N,0.5 N,0.2 N"],
        "kinetostatics": ["kinetostatics"],
        "frequency-response": ["frequency-response", "--band", "1,800 Hz", "--points", "20"],
        "response-of-body": [
            *("frequency-response", "--band", "1,800 Hz", "--points", "20", "-i", f"{body}.tx", "-o", f"{body}.tx"),
        ],
        "time-response": [
            *("time-response", "--dt", "0.5 ms", "--duration", "20 ms"),
            *("--step", f"{body}.tx=1 N", "-o", f"{body}.tx"),
        ],
        "stroke": ["stroke", "--steps", "3", "-n", "3"],
        "stroke-of-body": ["stroke", "--steps", "3", "-n", "3", "--load", f"{body}=1 N,0.5 N,0.2 N"],
    }
    if sizes:
        value = mechanism.parameters[sizes[0]].value
        unit = mechanism.parameters[sizes[0]].unit
        ends = ":".join(f"{factor * value:.9g} {unit}".strip() for factor in (0.98, 1.02))
        found |= {
            "sensitivity": ["sensitivity", "--ask", "f1, f2, mass"],
            "sweep": ["sweep", "--vary", f"{sizes[0]}={ends}:3", "--ask", "f1, f2, mass", "--workers", "1"],
            "tolerance": [
                *("tolerance", "--vary", f"{sizes[0]}=normal {abs(value) / 100:.9g} {unit}".strip()),
                *("--ask", "f1", "--samples", "64", "--workers", "1"),
            ],
        }
    return found


PICTURED = ("check", "modes", "statics", "kinetostatics", "frequency-response", "time-response", "stroke", "sweep")


def drawn(figure: Any) -> list[dict[str, Any]]:
    """What the axes of a figure show, as data."""
    return [
        {
            "labels": [axes.get_title(), axes.get_xlabel(), axes.get_ylabel()],
            "lines": [[[float(x) for x in own] for own in line.get_data()] for line in axes.get_lines()],
            "texts": [own.get_text() for own in axes.texts],
            "legend": [own.get_text() for own in axes.get_legend().get_texts()] if axes.get_legend() else [],
        }
        for axes in figure.axes
    ]


def record_file(folder: Path, file: Path) -> str:
    """Record what all verbs say of a file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from typer.testing import CliRunner

    from flexura.cli.app import app

    os.environ["COLUMNS"] = "160"
    name = str(file.relative_to(ROOT)).replace("/", "_").removesuffix(".yaml")
    out = folder / name
    out.mkdir(parents=True, exist_ok=True)
    figures: list[Any] = []
    FigureCanvasAgg.print_png = lambda self, *_, **__: figures.append(drawn(self.figure))  # type: ignore[method-assign]

    def said(arguments: list[str]) -> tuple[int, str]:
        done = CliRunner().invoke(app, [arguments[0], str(file), *arguments[1:]])
        error = f"{type(done.exception).__name__}: {done.exception}" if done.exception is not None else ""
        return done.exit_code, f"{done.stdout}{error}"

    for verb, arguments in commands(file).items():
        code, text = said([*arguments, "--json"])
        data = json.loads(text) if code == 0 else text
        printed = TIMES.sub("TIME", said(arguments)[1])
        figures.clear()
        if arguments[0] in PICTURED:
            with tempfile.TemporaryDirectory() as pictures:
                said([*arguments, "--plot", pictures])
        told = {"status": code, "data": data, "text": printed.splitlines(), "figures": figures}
        (out / f"{verb}.json").write_text(json.dumps(told, indent=0), encoding="utf-8")
    return name


def make(folder: Path, only: str) -> None:
    """Make a record in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    chosen = [own for own in files() if only in str(own)]
    with ProcessPoolExecutor(2) as pool:
        for k, name in enumerate(pool.map(partial(record_file, folder), chosen), 1):
            print(f"{k} of {len(chosen)}: {name}", flush=True)
    import flexura as fx

    names = {"flexura": sorted(fx.__all__), "describe": sorted(vars(fx.describe)), "view": sorted(vars(fx.view))}
    runs = [
        subprocess.run([sys.executable, "-c", MEASURED], check=True, capture_output=True, text=True)
        for _ in range(ROUNDS)
    ]
    told = [json.loads(own.stdout) for own in runs]
    least = {key: min(own[key] for own in told) for key in told[0]}
    (folder / "house.json").write_text(json.dumps({"names": names, "import": least}, indent=0), encoding="utf-8")


def differences(before: Any, after: Any, place: str = "") -> Iterator[tuple[str, float | str]]:
    """Where two data differ, and by how much relative, or how."""
    if isinstance(before, bool) or isinstance(after, bool) or type(before) not in (int, float):
        if isinstance(before, dict) and isinstance(after, dict):
            for key in before.keys() | after.keys():
                if key not in before or key not in after:
                    yield f"{place}.{key}", "missing before" if key in after else "missing after"
                else:
                    yield from differences(before[key], after[key], f"{place}.{key}")
        elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
            for k, (one, other) in enumerate(zip(before, after, strict=True)):
                yield from differences(one, other, f"{place}[{k}]")
        elif before != after:
            yield place, f"{str(before)[:90]!r} -> {str(after)[:90]!r}"
    elif type(after) not in (int, float):
        yield place, f"{before!r} -> {str(after)[:90]!r}"
    elif before != after and not (math.isnan(before) and math.isnan(after)):
        yield place, abs(before - after) / max(abs(before), abs(after))


def compare(before: Path, after: Path) -> int:
    """Print how two records differ; 1 where they do."""
    paths = sorted({own.relative_to(folder) for folder in (before, after) for own in folder.rglob("*.json")})
    odd = same = 0
    for path in paths:
        if not ((before / path).exists() and (after / path).exists()):
            print(f"{path}: only {'before' if (before / path).exists() else 'after'}")
            odd += 1
            continue
        one, other = (json.loads((folder / path).read_text(encoding="utf-8")) for folder in (before, after))
        timed = one.pop("import", None), other.pop("import", None)
        found = list(differences(one, other))
        if timed[0]:
            print("import:", *(f"{key} {timed[0][key]:.4g} -> {timed[1][key]:.4g};" for key in timed[0]))
        same += not found
        odd += bool(found)
        numbers = [own for own in found if isinstance(own[1], float)]
        if numbers:
            worst = max(numbers, key=lambda own: own[1])
            print(f"{path}: {len(numbers)} numbers differ, most by {worst[1]:.1e} at {worst[0]}")
        for place, how in [own for own in found if isinstance(own[1], str)][:6]:
            print(f"{path}: {place}: {how}")
    print(f"{same} equal bit for bit, {odd} differ")
    return int(odd > 0)


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])  # type: ignore[union-attr]
    parser.add_argument("what", choices=("make", "compare"))
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    if given.what == "make":
        make(given.folders[0], given.only)
        return 0
    return compare(*given.folders)


if __name__ == "__main__":
    sys.exit(main())
