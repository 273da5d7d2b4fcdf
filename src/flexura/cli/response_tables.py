"""Statics and responses as tables on a terminal and in CSV files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from flexura.analysis import interval_text
from flexura.cli.tables import console_of_width, print_warnings, write_table
from flexura.errors import Exceeded
from flexura.mechanism import DOF_NAMES
from flexura.tables import counted, stiffness

if TYPE_CHECKING:
    from flexura.analysis import FrequencyResponse, Kinetostatics, Statics, TimeResponse

MOST_ROWS = 12
"""Members, and pairs of channels, that are listed."""


def _table(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, heading in enumerate(headings):
        table.add_column(escape(heading), justify="left" if k == 0 else "right")
    return table


def _clean(value: float) -> float:
    """Zero for what is round-off in mm or mrad."""
    return 0.0 if abs(value) < 1e-4 else value


def print_statics(result: Statics, nodes: list[str], pictures: list[Path]) -> None:
    """Print displacements of nodes, readings, actuators, and the members with the largest stress."""
    console = console_of_width()
    console.print(f"{result.model.plan.mechanism.name}: static response, linear", style="bold", markup=False)
    if nodes:
        table = _table("node", *(f"{dof} {'m' if k < 3 else 'rad'}" for k, dof in enumerate(DOF_NAMES)))
        for node in nodes:
            table.add_row(node, *(f"{x:.5g}" for x in result.displacement(node)))
        console.print(table)
    for name, value in result.readings.items():
        console.print(f"sensor {name}: {value:.6g}", markup=False)
    for name, error in result.model_error.items():
        console.print(f"model error of {name}: {interval_text(error)}", markup=False)
    if result.actuators:
        table = _table("actuator", "command", "elongation", "force")
        for a in result.actuators:
            table.add_row(a.name, f"{a.command:g} {a.unit}", f"{a.elongation:.5g}", f"{a.force:.5g}")
        console.print(table)
    stresses = result.stresses()
    loaded = [m for m in stresses.members if m.von_mises]
    if loaded:
        table = _table("member", "von Mises MPa", "factor to yield", "at")
        for m in loaded[:MOST_ROWS]:
            factor = "" if m.factor_to_yield is None else f"{m.factor_to_yield:.4g}"
            table.add_row(m.name, f"{1e-6 * (m.von_mises or 0):.5g}", factor, f"{m.position:.2f} of its length")
        console.print(table)
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
    table = _table("freedom", "axis", "through mm", "pitch mm/rad", "owned", "reach", "axis drifts", "yields at")
    for f in result.freedoms:
        axis = " ".join(f"{x:+.4f}" for x in f.axis.direction)
        if f.kind == "T":
            through, pitch, unit = "", "", "mm"
        else:
            through = " ".join(f"{1e3 * x:.4g}" for x in np.round(f.axis.point, 9) + 0.0)
            pitch, unit = f"{1e3 * f.axis.pitch:.3g}", "mrad"
        share = "" if np.isnan(f.share) else f"{100 * f.share:.1f} %"
        reach = "" if f.stroke is None else f"+-{1e3 * f.stroke:.4g} {unit}"
        drift = ""
        if f.shift is not None and f.tilt is not None:
            drift = f"{_clean(1e3 * f.shift):.3g} mm, {_clean(1e3 * f.tilt):.3g} mrad"
        limit = "" if f.yield_stroke is None else f"{1e3 * f.yield_stroke:.4g} {unit}"
        limit += "" if f.yields_in_range else ", beyond linear theory"
        kind = "rotation" if f.kind == "R" else "translation"
        table.add_row(kind, axis, through, pitch, share, reach, drift, limit)
    if result.freedoms:
        console.print(table)
    if not result.inputs:
        values = [f"{1e6 * c:.4g}" for c in result.spectrum.compliance]
        if result.is_clear:
            values.insert(result.spectrum.count, f"(gap {result.spectrum.gap:.3g})")
        length = f"rotations counted at {1e3 * result.spectrum.length:.4g} mm"
        console.print(f"compliances um/N, {length}: {' '.join(values)}", markup=False)
    if result.inputs:
        table = _table("per unit command", *(f"{c.name} [{c.unit}]" for c in result.inputs))
        for k, dof in enumerate(DOF_NAMES):
            table.add_row(f"{dof} {'m' if k < 3 else 'rad'}", *(f"{x:.4g}" for x in result.coupling[k]))
        table.add_row("input stiffness N/m", *(f"{x:.4g}" for x in result.input_stiffness))
        console.print(table)
    table = _table("coordinate", "stiffness", "model error", "actuators free", "actuators locked", "workspace")
    for k, dof in enumerate(DOF_NAMES):
        unit = "N/m" if k < 3 else "N m/rad"
        free, locked = float(result.compliance_free[k, k]), float(result.compliance_locked[k, k])
        own = stiffness(float(result.compliance[k, k]))
        low, high = result.workspace[k]
        span = f"{low:.4g} to {high:.4g} {'m' if k < 3 else 'rad'}" if np.isfinite([low, high]).all() else "no limits"
        error = "" if own == "held" else result.model_errors.texts[k]
        row = (own if own == "held" else f"{own} {unit}", error, stiffness(free), stiffness(locked, free))
        table.add_row(dof, *row, span if result.inputs else "")
    console.print(table)
    if result.inputs:
        gain = result.amplification()
        clean = ", ".join(
            f"{dof} {g:.4g}" for dof, g in zip(DOF_NAMES, gain, strict=True) if abs(g) > 1e-9 * abs(gain).max()
        )
        console.print(f"all actuators driven alike, per elongation of each: {clean}", markup=False)
    _end(console, result.notes, result.warnings, pictures)


def print_frequency_response(result: FrequencyResponse, written: list[Path]) -> None:
    """Print what was computed, the resonances, and the gains and peaks of the pairs."""
    console = console_of_width()
    p, m = len(result.outputs), len(result.inputs)
    hz = result.frequency_hz
    title = f"{result.name}: {p} x {m} responses at {counted(len(hz), 'frequency')}, {hz[0]:.5g} to {hz[-1]:.5g} Hz"
    console.print(title, style="bold", markup=False)
    if len(result.resonances_hz):
        table = _table("resonance", "Hz", "model error", "damping ratio")
        own = zip(result.resonances_hz, result.model_error, result.ratios, strict=True)
        for k, (f, error, zeta) in enumerate(own):
            table.add_row(str(k + 1), f"{f:.5g}", interval_text(error), f"{zeta:.4g}")
        console.print(table)
    table = _table("output / input", f"at {hz[0]:.5g} Hz", "largest", "at Hz", "unit")
    size = np.abs(result.response)
    peak = size.max(axis=0)
    order = [(i, j) for i in range(p) for j in range(m)]
    shown = [(i, j) for i, j in order if peak[i, j] > 1e-9 * np.sqrt(peak[i].max() * peak[:, j].max())]
    for i, j in shown[:MOST_ROWS]:
        own = size[:, i, j]
        out, into = result.outputs[i].name, result.inputs[j].name
        at = hz[int(own.argmax())]
        table.add_row(f"{out} / {into}", f"{own[0]:.5g}", f"{own.max():.5g}", f"{at:.5g}", result.unit(out, into))
    console.print(table)
    if len(shown) > MOST_ROWS:
        console.print(f"and {counted(len(shown) - MOST_ROWS, 'more pair')}; --json or --out has all")
    _end(console, result.notes, result.warnings, written)


def print_time_response(result: TimeResponse, written: list[Path]) -> None:
    """Print extremes and final values of the outputs."""
    console = console_of_width()
    title = f"{result.name}: {counted(len(result.time), 'sample')} up to {result.time[-1]:.5g} s"
    console.print(title, style="bold", markup=False)
    table = _table("output", "least", "at s", "largest", "at s", "last")
    for channel, y in zip(result.outputs, result.response, strict=True):
        low, high = int(y.argmin()), int(y.argmax())
        row = (y[low], result.time[low], y[high], result.time[high], y[-1])
        table.add_row(escape(str(channel)), *(f"{x:.5g}" for x in row))
    console.print(table)
    lost = () if result.neglected is None else (result.neglected.text,)
    _end(console, (*result.notes, *lost, *result.model_error_notes), result.warnings, written)


def _end(console: Console, notes: tuple[str, ...], warnings: tuple[Exceeded, ...], written: list[Path]) -> None:
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
