"""What the command of large motion prints and writes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite, isnan
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from flexura.cli.tables import console_of_width, print_warnings
from flexura.errors import foremost
from flexura.mechanism import DOF_NAMES

if TYPE_CHECKING:
    from flexura.analysis import Stroke, StrokePose

MOST_FREQUENCIES = 6
MOST_ROWS = 41

ROUND_OFF = 1e-7
"""Displacements below so much of the largest translation, or rotation, of a node are none."""

MOST_WARNINGS = 3
"""Warnings of a kind that are printed; `--json` has all."""


def print_stroke(result: Stroke, nodes: Sequence[str], written: Sequence[Path]) -> None:
    """Print a row for every pose: what moves, what holds it, frequencies and support stiffness, and displacements of
    some nodes."""
    console = console_of_width()
    console.print(f"{result.name}: over its stroke, large displacements", style="bold", markup=False)
    if result.poses:
        poses = result.poses[:: max(1, -(-len(result.poses) // MOST_ROWS))]
        is_supported = any(not isnan(k) for pose in poses for k in pose.support_stiffness[:3])
        console.print(_poses(result, poses, is_supported))
        support = " k: support stiffness, actuators locked;" if is_supported else ""
        factors = "to yield, to buckle: factors on what is there"
        console.print(f"f: actuators free under the forces that hold the pose;{support} {factors}")
        if result.model_errors:
            console.print(f"model error over all poses: {', '.join(_model_errors(result))}", markup=False)
        for node in nodes:
            console.print(_moved(result, poses, node))
    for note in result.notes:
        console.print(f"note: {note}", markup=False)
    print_warnings(console, foremost(result.warnings, MOST_WARNINGS))
    for path in written:
        console.print(f"wrote {path}", markup=False)


def _model_errors(result: Stroke) -> Iterator[str]:
    """How far the part may be from the model, of each frequency at any of the poses."""
    from flexura.analysis import interval_text

    for k in range(min([MOST_FREQUENCIES, *(len(own.low) for own in result.model_errors)])):
        ends = [own.intervals[k] for own in result.model_errors]
        known = [own for own in ends if own is not None]
        whole = None if len(known) < len(ends) else (min(low for low, _ in known), max(high for _, high in known))
        yield f"f{k + 1} {interval_text(whole)}"


def _poses(result: Stroke, poses: Sequence[StrokePose], is_supported: bool) -> Table:
    """A row for every pose."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    first = poses[0]
    changing = {**first.load, **first.actuators}
    for name in changing:
        table.add_column(f"{name} {result.units[name]}", justify="right")
    for name in first.move:
        unit = _scale(result, first, name)[1]
        table.add_column(f"{name} {unit}", justify="right")
        table.add_column("force N m" if unit == "rad" else "force N", justify="right")
    heads = [f"f{k + 1} Hz" for k in range(min(len(first.frequency_hz), MOST_FREQUENCIES))]
    heads += [f"k{axis} N/m" for axis in "xyz" if is_supported]
    for head in (*heads, "to yield", "to buckle"):
        table.add_column(head, justify="right")
    for pose in poses:
        cells = [f"{pose.varied[name]:.5g}" for name in changing]
        for name, value in pose.move.items():
            cells += [f"{_scale(result, pose, name)[0] * value:.5g}", f"{pose.reaction[name] + 0.0:.5g}"]
        cells += [f"{f:.5g}" for f in pose.frequency_hz[:MOST_FREQUENCIES]]
        cells += ["driven" if isnan(k) else f"{k:.4g}" for k in pose.support_stiffness[:3] if is_supported]
        table.add_row(*cells, _factor(pose.stress_margin), _factor(pose.buckling_factor))
    return table


def _moved(result: Stroke, poses: Sequence[StrokePose], node: str) -> Table:
    """Displacement of a node in every pose, without what is round-off beside the largest of its kind."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    scales = {name: _scale(result, poses[0], name) for name in poses[0].varied}
    for name, (_, unit) in scales.items():
        table.add_column(f"{name} {unit}", justify="right")
    for k, axis in enumerate(DOF_NAMES):
        table.add_column(f"{node}.{axis[-1] if k < 3 else axis} {'mm' if k < 3 else 'rad'}", justify="right")
    largest = [max(abs(pose.displacement[node][k]) for pose in poses) for k in range(6)]
    least = [ROUND_OFF * max(largest[:3])] * 3 + [ROUND_OFF * max(largest[3:])] * 3
    for pose in poses:
        cells = [f"{factor * pose.varied[name]:.5g}" for name, (factor, _) in scales.items()]
        for k, value in enumerate(pose.displacement[node]):
            cells.append(f"{(1e3 if k < 3 else 1.0) * (value if abs(value) > least[k] else 0.0):.5g}")
        table.add_row(*cells)
    return table


def _scale(result: Stroke, pose: StrokePose, name: str) -> tuple[float, str]:
    """What multiplies something that is prescribed, and its unit: displacements are shown in mm."""
    if name not in pose.move:
        return 1.0, result.units[name]
    return (1.0, "rad") if name.rpartition(".")[2].startswith("r") else (1e3, "mm")


def _factor(value: float | None) -> str:
    """A factor on what is there; empty where there is none, or nothing that it could multiply."""
    return "" if value is None or not isfinite(value) else f"{value:.3g}"
