"""What the command of large motion prints and writes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flexura.cli.tables import columns_table, console_of_width, print_warnings
from flexura.errors import foremost
from flexura.mechanism import DOF_NAMES, UNITS

if TYPE_CHECKING:
    from flexura.analysis import Stroke

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
        columns = result.short_columns(MOST_ROWS, MOST_FREQUENCIES)
        console.print(columns_table(columns, left=0))
        support = " k: support stiffness, actuators locked;" if "kx [N/m]" in columns else ""
        factors = "to yield, to buckle: factors on what is there"
        console.print(f"f: actuators free under the forces that hold the pose;{support} {factors}")
        if result.model_errors:
            console.print(f"model error over all poses: {', '.join(_model_errors(result))}", markup=False)
        for node in nodes:
            console.print(columns_table(_moved(result, node), left=0))
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


def _moved(result: Stroke, node: str) -> dict[str, Any]:
    """Displacement of a node in every pose, without what is round-off beside the largest of its kind."""
    poses = result.poses[:: max(1, -(-len(result.poses) // MOST_ROWS))]
    columns: dict[str, Any] = {
        f"{name} [{result.units[name]}]": [pose.varied[name] for pose in poses] for name in poses[0].varied
    }
    moved = np.array([pose.displacement[node] for pose in poses])
    for own in (slice(0, 3), slice(3, 6)):
        moved[:, own] *= np.abs(moved[:, own]) > ROUND_OFF * np.abs(moved[:, own]).max()
    names = (dof[1:] if k < 3 else dof for k, dof in enumerate(DOF_NAMES))
    return columns | {f"{node}.{name} [{UNITS[k > 2]}]": moved[:, k] for k, name in enumerate(names)}
