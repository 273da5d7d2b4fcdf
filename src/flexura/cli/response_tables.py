"""Statics and responses as tables on a terminal and in CSV files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from flexura.analysis import interval_text
from flexura.cli.tables import columns_table, console_of_width, print_warnings, write_table
from flexura.errors import Diagnostic
from flexura.mechanism import DOF_NAMES, UNITS
from flexura.tables import counted, ends, number, quantity, scale_for

if TYPE_CHECKING:
    from flexura.analysis import FrequencyResponse, Kinetostatics, Statics, TimeResponse

MOST_ROWS = 12
"""Members, and pairs of channels, that are listed."""


def print_statics(result: Statics, nodes: list[str], pictures: list[Path]) -> None:
    """Print displacements of nodes, readings, actuators, and the members with the largest stress."""
    console = console_of_width()
    console.print(f"{result.model.plan.mechanism.name}: static response, linear", style="bold", markup=False)
    if nodes:
        moved = np.array([result.displacement(node) for node in nodes])
        columns = {f"{dof} [{UNITS[k > 2]}]": moved[:, k] for k, dof in enumerate(DOF_NAMES)}
        console.print(columns_table({"node": nodes, **columns}))
    for columns in (result.reading_columns(), result.actuator_columns()):
        if columns[next(iter(columns))]:
            console.print(columns_table(columns))
    stresses = result.stresses()
    loaded = [m for m in stresses.members if m.von_mises]
    if loaded:
        shown = loaded[:MOST_ROWS]
        columns = {
            "member": [m.name for m in shown],
            "von Mises [Pa]": [m.von_mises for m in shown],
            "factor to yield": ["" if m.factor_to_yield is None else number(m.factor_to_yield, 4) for m in shown],
            "at": [f"{m.position:.2f} of its length" for m in shown],
        }
        console.print(columns_table(columns))
        if len(loaded) > MOST_ROWS:
            console.print(f"and {counted(len(loaded) - MOST_ROWS, 'member')} with less")
        console.print(f"model error of stresses: {interval_text(result.stress_error)}", markup=False)
    factor = stresses.factor_to_yield
    if factor is not None and np.isfinite(factor):
        if result.model.plan.is_posed:
            console.print(f"with what the pose stresses: {factor:.4g} times to yield", markup=False)
        else:
            console.print(f"yields at {factor:.4g} times these loads and commands", markup=False)
    _end(console, result.notes, result.warnings, pictures)


def print_kinetostatics(name: str, result: Kinetostatics, pictures: list[Path]) -> None:
    """Print freedoms with their screw axes, the coupling matrix, stiffness and workspace."""
    console = console_of_width()
    found = f"has {result.kind}" if result.is_clear else "has no freedoms that are clear cut"
    console.print(f"{name}: {result.platform} {found}", style="bold", markup=False)
    for columns in (result.freedom_columns(), result.coupling_columns()):
        if columns.get("freedom", result.inputs):
            console.print(columns_table(columns))
    if not result.inputs:
        scale = scale_for(result.spectrum.compliance, "m/N")
        values = [number(c / scale.size, 4) for c in result.spectrum.compliance]
        if result.is_clear:
            values.insert(result.spectrum.count, f"(gap {number(result.spectrum.gap, 3)})")
        length = f"rotations counted at {quantity(result.spectrum.length, 'm', 4)}"
        console.print(f"compliances {scale.unit}, {length}: {' '.join(values)}", markup=False)
    console.print(columns_table(result.stiffness_columns()))
    if result.inputs:
        gain, turning = result.amplification(), all(c.quantity == "moment" for c in result.inputs)
        clean = ", ".join(
            f"{dof} {quantity(g, '' if turning == (k > 2) else f'{UNITS[k > 2]}/{UNITS[turning]}', 4)}"
            for k, (dof, g) in enumerate(zip(DOF_NAMES, gain.tolist(), strict=True))
            if abs(g) > 1e-9 * abs(gain).max()
        )
        console.print(f"all actuators driven alike, per elongation of each: {clean}", markup=False)
    _end(console, result.notes, result.warnings, pictures)


def print_frequency_response(result: FrequencyResponse, written: list[Path]) -> None:
    """Print what was computed, the resonances, and the gains and peaks of the pairs."""
    console = console_of_width()
    p, m = len(result.outputs), len(result.inputs)
    hz = result.frequency_hz
    title = f"{result.name}: {p} x {m} responses at {counted(len(hz), 'frequency')}, {ends((hz[0], hz[-1]), 'Hz')}"
    console.print(title, style="bold", markup=False)
    if len(result.resonances_hz):
        numbers = [str(k + 1) for k in range(len(result.resonances_hz))]
        ratios = [number(zeta, 4) for zeta in result.ratios]
        resonances = {
            "resonance": numbers,
            "frequency [Hz]": result.resonances_hz,
            "model error": [interval_text(error) for error in result.model_error],
            "damping ratio": ratios,
        }
        console.print(columns_table(resonances))
    columns = result.gain_columns()
    console.print(columns_table({name: own[:MOST_ROWS] for name, own in columns.items()}, left=2))
    if (more := len(columns["peak"]) - MOST_ROWS) > 0:
        console.print(f"and {counted(more, 'more pair')}; --json or --out has all")
    _end(console, result.notes, result.warnings, written)


def print_time_response(result: TimeResponse, written: list[Path]) -> None:
    """Print extremes and final values of the outputs."""
    console = console_of_width()
    title = f"{result.name}: {counted(len(result.time), 'sample')} up to {quantity(float(result.time[-1]), 's')}"
    console.print(title, style="bold", markup=False)
    console.print(columns_table(result.output_columns()))
    lost = () if result.neglected is None else (result.neglected.text,)
    _end(console, (*result.notes, *lost, *result.model_error_notes), result.warnings, written)


def _end(console: Console, notes: tuple[str, ...], warnings: tuple[Diagnostic, ...], written: list[Path]) -> None:
    for note in notes:
        console.print(note, markup=False)
    print_warnings(console, warnings)
    for path in written:
        console.print(f"wrote {path}", markup=False)


def write_frequency_table(result: FrequencyResponse, path: Path) -> Path:
    """Write frequency, magnitude and phase of every pair as columns, in one step."""
    columns: dict[str, NDArray[np.float64]] = {"frequency [Hz]": result.frequency_hz}
    for out in result.outputs:
        for into in result.inputs:
            H, pair = result.of(out.name, into.name), f"{out.name} / {into.name}"
            columns[f"{pair} [{result.unit(out.name, into.name)}]"] = np.abs(H)
            columns[f"{pair} phase [deg]"] = np.degrees(np.angle(H))
    return write_table(columns, path)


def write_time_table(result: TimeResponse, path: Path) -> Path:
    """Write time, inputs and outputs as columns, in one step."""
    heading = ["time [s]", *map(str, result.inputs), *map(str, result.outputs)]
    return write_table(dict(zip(heading, [result.time, *result.signals, *result.response], strict=True)), path)
