"""What the command of large motion prints and writes."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, isnan
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from flexura.cli.tables import console_of_width, print_warnings
from flexura.errors import foremost

if TYPE_CHECKING:
    from flexura.analysis import Stroke

MOST_FREQUENCIES = 6
MOST_ROWS = 41

MOST_WARNINGS = 3
"""Warnings of a kind that are printed; `--json` has all."""


def print_stroke(result: Stroke, written: Sequence[Path]) -> None:
    """Print a row for every pose: what moves, what holds it, frequencies and support stiffness."""
    console = console_of_width()
    console.print(f"{result.name}: over its stroke, large displacements", style="bold", markup=False)
    if result.poses:
        table = Table(box=None, header_style="bold", pad_edge=False)
        first = result.poses[0]
        changing = {**first.load, **first.actuators}
        for name in changing:
            table.add_column(f"{name} {result.units[name]}", justify="right")
        for name in first.move:
            turns = name.rpartition(".")[2].startswith("r")
            table.add_column(f"{name} {'rad' if turns else 'mm'}", justify="right")
            table.add_column("force N m" if turns else "force N", justify="right")
        for k in range(min(len(first.frequency_hz), MOST_FREQUENCIES)):
            table.add_column(f"f{k + 1} Hz", justify="right")
        for axis in "xyz":
            table.add_column(f"k{axis} N/m", justify="right")
        table.add_column("to yield", justify="right")
        table.add_column("to buckle", justify="right")
        every = max(1, -(-len(result.poses) // MOST_ROWS))
        for pose in result.poses[::every]:
            cells = [f"{pose.varied[name]:.5g}" for name in changing]
            for name, value in pose.move.items():
                turns = name.rpartition(".")[2].startswith("r")
                cells += [f"{value if turns else 1e3 * value:.5g}", f"{pose.reaction[name] + 0.0:.5g}"]
            cells += [f"{f:.5g}" for f in pose.frequency_hz[:MOST_FREQUENCIES]]
            cells += ["driven" if isnan(k) else f"{k:.4g}" for k in pose.support_stiffness[:3]]
            cells += [_factor(pose.stress_margin), _factor(pose.buckling_factor)]
            table.add_row(*cells)
        console.print(table)
        console.print(
            "f: drives free under the forces that hold the pose; k: support stiffness, drives held;"
            " to yield, to buckle: factors on what is there"
        )
    for note in result.notes:
        console.print(f"note: {note}", markup=False)
    print_warnings(console, foremost(result.warnings, MOST_WARNINGS))
    for path in written:
        console.print(f"wrote {path}", markup=False)


def _factor(value: float | None) -> str:
    """A factor on what is there; empty where there is none, or nothing that it could multiply."""
    return "" if value is None or not isfinite(value) else f"{value:.3g}"
