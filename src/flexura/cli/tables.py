"""Results as tables on a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from flexura.analysis import CheckReport, Mode, Modes
from flexura.analysis.evidence import Evidence
from flexura.errors import Exceeded
from flexura.linalg import ranked

RESOLVED = 1e-6
"""Relative differences below this are lost in the round-off of the full-order solution."""


def console_of_width() -> Console:
    """A console; a pipe is given a width."""
    console = Console(highlight=False, soft_wrap=False)
    # a pipe has no width; wide tables are easier to read there than wrapped ones
    return console if console.is_terminal else Console(highlight=False, width=140)


def print_warnings(console: Console, warnings: Iterable[Exceeded | str]) -> None:
    """Print one line for each warning."""
    for warning in warnings:
        console.print("warning:", style="yellow", end=" ")
        console.print(str(warning), markup=False)


def print_modes(result: Modes, pictures: list[Path]) -> None:
    """Print frequencies of both models, what moves, and the evidence."""
    console = console_of_width()
    full_only = result.evidence.low_residual is None
    beside = any(mode.full_frequency_hz is not None for mode in result.modes) and not full_only
    title = f"{result.name}: {'full model' if full_only else 'low-order model'}, order {result.order}"
    console.print(title + ("" if full_only else f" (full model {result.full_order})"), style="bold", markup=False)
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("mode", justify="right")
    table.add_column("Hz", justify="right")
    table.add_column("rad/s", justify="right")
    if beside:
        table.add_column("full Hz", justify="right")
        table.add_column("difference", justify="right")
    table.add_column("proven", justify="right")
    meshed = any(mode.mesh_error is not None for mode in result.modes)
    if meshed:
        table.add_column("meshes", justify="right")
    table.add_column("what moves", overflow="fold")
    for mode in result.modes:
        row = [str(mode.number), mode.frequency_text, f"{mode.angular_frequency:.5g}"]
        if beside:
            row += ["none" if mode.full_frequency_hz is None else f"{mode.full_frequency_hz:.5g}"]
            row += [_difference(mode)]
        row += [_proven(mode.frequency_hz, mode.interval_hz, mode.is_indexed, mode.is_rigid)]
        if meshed:
            row += ["" if mode.mesh_error is None else f"within {100 * mode.mesh_error:.2g} %"]
        table.add_row(*row, mode.motion.summary)
    console.print(table)
    for step in result.steps:
        console.print(step, markup=False)
    _print_evidence(console, result.evidence)
    print_warnings(console, result.warnings)
    for path in pictures:
        console.print(f"wrote {path}", markup=False)


def _difference(mode: Mode) -> str:
    """Relative difference of the pair, with its MAC where the two shapes differ visibly."""
    if mode.relative_error is None or mode.mac is None:
        return ""
    if abs(mode.relative_error) < RESOLVED:
        return f"below {100 * RESOLVED:g} %"
    return f"{100 * mode.relative_error:+.2g} %" + (f" (MAC {mode.mac:.2f})" if mode.mac < 0.98 else "")


def _proven(hz: float, interval: tuple[float | None, float | None], is_indexed: bool, is_rigid: bool) -> str:
    """How far from a full-order frequency of the same number a frequency can be; else the interval that has some."""
    lower, upper = interval
    if not is_indexed:
        return f"{lower or 0:.4g} to {'?' if upper is None else f'{upper:.4g}'} Hz"
    if is_rigid:
        return "rigid motion"
    if lower is None or upper is None or not hz:
        return ""
    error = 100 * max(upper / hz - 1, 1 - lower / hz, RESOLVED)
    digit = 10.0 ** (math.floor(math.log10(error)) - 1)
    return f"within {math.ceil(error / digit) * digit:.2g} %"


def _print_evidence(console: Console, evidence: Evidence) -> None:
    e = evidence
    found_in = "found" if e.low_residual is None else "in the low-order model"
    lines = [
        f"mass {e.model_mass.mass:.6g} kg, as described to {e.mass_error:.1g}; inertia to {e.inertia_error:.1g}",
        f"rigid-body motions strain nothing: residual {e.rigid_body_residual:.1g}"
        + (f"; {e.rigid_body_modes} rigid-body modes" if e.rigid_body_modes else ""),
        "eigen-residuals: "
        + ", ".join(
            f"{name} {value:.1g}"
            for name, value in (("full", e.full_residual), ("low-order", e.low_residual))
            if value is not None
        ),
        f"Sturm count below {e.sturm_below_hz:.5g} Hz: {'' if e.is_counted else 'at most '}{e.sturm_count} of the full"
        f" order, {e.reported_below} {found_in}",
    ]
    console.print("evidence", style="bold")
    for line in lines:
        console.print("  " + line, markup=False)
    if e.complete:
        console.print("  no mode is missing in this range", style="green")
        return
    count = len(e.missed) + e.more_missed
    if not e.is_counted:
        console.print("  round-off hides whether a mode is missing in this range", style="red")
        return
    modes = "mode in this range is" if count == 1 else "modes in this range are"
    console.print(f"  {count} {modes} MISSING from the low-order model:", style="red")
    for missed in e.missed[:12]:
        console.print(f"    {missed.frequency_hz:.5g} Hz: {missed.summary}", markup=False)
    rest = len(e.missed) - 12 + e.more_missed
    if rest > 0:
        console.print(f"    and {rest} more", markup=False)
    console.print(
        "  keep fixed-interface normal modes to see them: --tolerance 1e-3 --up-to HZ, or --keep 2", markup=False
    )


def print_preload(data: dict[str, Any]) -> None:
    """Print frequencies with and without load, buckling factors, and the members that carry most."""
    console = console_of_width()
    table = Table(box=None, pad_edge=False, header_style="bold")
    states = [own for own in (data["loaded"], data["unloaded"]) if own is not None]  # none beyond buckling
    headings = ("Hz", "proven", "unloaded Hz", "proven")
    for heading in ("mode", *headings[-2 * len(states) :]):
        table.add_column(heading, justify="right")
    for k in range(min(len(own["frequency_hz"]) for own in states)):
        cells = []
        for own in states:
            hz, lower, upper = own["frequency_hz"][k], own["lower_hz"][k], own["upper_hz"][k]
            cells += [f"{hz:.5g}", _proven(hz, (lower, upper), own["is_indexed"][k], upper == 0)]
        table.add_row(str(k + 1), *cells)
    console.print(table)
    factors = ", ".join(f"{f:.5g}" for f in data["buckling_factors"]) or "none: no load of this direction buckles it"
    console.print(f"buckling factors on all loads: {factors}", markup=False)
    forces = list(data["axial_force"].items())
    for i in ranked([max(abs(f) for f in own) for _, own in forces])[:10]:
        name, (least, most) = forces[i]
        console.print(f"axial force in {name}: {least:.4g} to {most:.4g} N", markup=False)
    print_warnings(console, (w["text"] for w in data["warnings"]))


def _print_named(console: Console, what: str, about: Mapping[str, str]) -> None:
    """Print one line for each of a kind, up to twenty."""
    for name, text in list(about.items())[:20]:
        console.print(f"{what} {name}: {text}", markup=False)
    if len(about) > 20:
        console.print(f"{what}: and {len(about) - 20} more")


def print_check(report: CheckReport, pictures: Sequence[Path] = ()) -> None:
    """Print what was understood of a mechanism, and the doubts."""
    console = console_of_width()
    console.print(report.name, style="bold", markup=False)
    console.print(f"full order {report.full_order}, low order {report.low_order}", markup=False)
    x, y, z = (round(1e3 * c, 6) + 0.0 for c in report.mass.centre)
    console.print(f"mass {report.mass.mass:.6g} kg, centre of mass ({x:.5g}, {y:.5g}, {z:.5g}) mm", markup=False)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("substructure", "copies", "members", "elements", "nodes", "interior DOFs", "mass kg", "interface"):
        table.add_column(heading, justify="left" if heading in ("substructure", "interface") else "right")
    for s in report.substructures:
        numbers = (s.copies, s.members, s.elements, s.nodes, s.interior_dofs)
        table.add_row(s.name, *map(str, numbers), f"{s.mass:.5g}", _shorten(s.interface))
    console.print(table)
    for body, mass in list(report.rigid_bodies.items())[:10]:
        console.print(f"rigid body {body}: {mass:.6g} kg", markup=False)
    for node, dofs in list(report.held.items())[:20]:
        console.print(f"held: {node} {'clamped' if len(dofs) == 6 else ' '.join(dofs)}", markup=False)
    if len(report.held) > 20:
        console.print(f"held: and {len(report.held) - 20} more nodes", markup=False)
    _print_corrections(console, report)
    _print_named(console, "solid part", {name: str(mesh) for name, mesh in report.solid_parts.items()})
    _print_named(console, "actuator", report.actuators)
    _print_named(console, "sensor", report.sensors)
    if report.damping != "none" or report.actuators or report.sensors:
        console.print(f"damping: {report.damping}", markup=False)
    _print_loads(console, report)
    _print_free_motions(console, report)
    if report.doubts:
        console.print(f"{len(report.doubts)} doubt{'s' if len(report.doubts) > 1 else ''}", style="yellow")
    else:
        console.print("no doubts", style="green")
    for doubt in report.doubts:
        console.print(f"  {doubt}", markup=False)
    for path in pictures:
        console.print(f"wrote {path}", markup=False, highlight=False)


def _print_loads(console: Console, report: CheckReport) -> None:
    """Loads and gravity, and that stiffness is about the state under them."""
    for node, wrench in list(report.loads.items())[:20]:
        parts = [f"{_vector(w)} {unit}" for w, unit in ((wrench[:3], "N"), (wrench[3:], "N m")) if any(w)]
        console.print(f"load on {node}: {', '.join(parts) or 'none'}", markup=False)
    if len(report.loads) > 20:
        console.print(f"load: on {len(report.loads) - 20} more nodes")
    if any(report.gravity):
        console.print(f"gravity: {_vector(report.gravity)} m/s^2", markup=False)
    if report.is_preloaded:
        console.print(
            "preloaded: stiffness, and all that follows from it, is about the state under these", markup=False
        )


def _vector(components: Iterable[float]) -> str:
    return f"({', '.join(f'{c + 0.0:.5g}' for c in components)})"


def _print_free_motions(console: Console, report: CheckReport) -> None:
    """What is proven about the lowest frequencies."""
    words = []
    if report.rigid_body_modes:
        words.append(f"{report.rigid_body_modes} rigid-body mode{'s' if report.rigid_body_modes > 1 else ''}")
    if report.lowest_hz is not None:
        lower, upper = report.lowest_hz
        name = "lowest frequency" if not report.rigid_body_modes else "lowest other frequency"
        sharp = f"{lower:.5g}" == f"{upper:.5g}"
        value = f"{upper:.5g} Hz" if sharp else f"between {lower:.5g} and {upper:.5g} Hz"
        words.append(f"{name} {value}, proven" if lower > 0 else f"{name} below {upper:.2g} Hz, not told from zero")
    if words:
        console.print("; ".join(words), markup=False)


def _print_corrections(console: Console, report: CheckReport) -> None:
    """One line for every set of corrections: the members that have it, with their ends unless both are clamped."""
    members: dict[tuple[str, ...], list[str]] = {}
    for place, names in report.corrections.items():
        ends = report.ends[place]
        strip = {"plate", "warping"} & set(names)
        shown = place if ends == ("clamped", "clamped") or not strip else f"{place} ({', '.join(ends)})"
        members.setdefault(names, []).append(shown)
    for names, places in members.items():
        console.print(f"corrected for {', '.join(names)}: {_shorten(tuple(places))}", markup=False)


def _shorten(names: tuple[str, ...]) -> str:
    shown = ", ".join(names[:4])
    return shown + (f", ... ({len(names)})" if len(names) > 4 else "")
