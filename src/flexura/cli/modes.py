"""The commands `modes` and `buckling`, and what they print."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from flexura.cli.commands import CommandReader
from flexura.cli.options import (
    Animate,
    At,
    Commands,
    Dpi,
    File,
    Gravity,
    Json,
    Loads,
    Names,
    Plot,
    Settings,
    Strict,
    gravity_of,
    limit_of,
    loads_of,
    of_pictures,
    print_result,
    read,
)
from flexura.cli.tables import console_of_width, print_warnings
from flexura.errors import OptionError
from flexura.tables import ends, number, quantity, text_columns

if TYPE_CHECKING:
    from flexura.analysis import Evidence, Modes


class ModelOrder(StrEnum):
    """Which model to solve."""

    low = "low"
    full = "full"


class Reduction(StrEnum):
    """How substructures are reduced."""

    craig_bampton = "craig_bampton"
    rubin = "rubin"


def modes_command(
    file: File,
    n: Annotated[int, typer.Option("-n", min=1, max=1000, help="Number of modes.")] = 6,
    order: Annotated[ModelOrder, typer.Option(help="Low-order beside full, or the full model alone.")] = ModelOrder.low,
    keep: Annotated[
        int | None,
        typer.Option(min=0, help="Normal modes kept in each substructure; 0: constraint modes alone, as in the paper."),
    ] = None,
    keep_below: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="Keep all normal modes below this frequency, e.g. '3 kHz'.")
    ] = None,
    reduction: Annotated[
        Reduction | None, typer.Option(help="Kept modes: fixed-interface, or free-interface with residual flexibility.")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(metavar="REL", help="Find the smallest model proven to this relative error. By default 1e-3."),
    ] = None,
    up_to: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="All modes up to this frequency, whatever -n is.")
    ] = None,
    at: At = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
    plot: Annotated[Path | None, typer.Option(metavar="DIR", help="Write pictures of the modes here.")] = None,
    animate: Animate = None,
    magnify: Annotated[
        float | None, typer.Option(metavar="FACTOR", help="Draw displacements so many times as large as is usual.")
    ] = None,
    names: Names = False,
    dpi: Dpi = None,
) -> None:
    """Natural frequencies and mode shapes, low-order and full-order side by side, with evidence."""
    from flexura.analysis import modes

    form = None if animate is None else animate.value
    pictured = of_pictures(plot, animate=form, magnify=magnify, names=names, dpi=dpi)
    mechanism, parameters = read(file, set, at)
    below, limit = limit_of("--keep-below", keep_below), limit_of("--up-to", up_to)
    how = {"keep": keep, "keep_below": below, "tolerance": tolerance, "up_to": limit}
    if order is ModelOrder.full and (reduction is not None or any(value is not None for value in how.values())):
        raise OptionError(
            "full order is not reduced: --keep, --keep-below, --reduction, --tolerance, --up-to belong to --order low"
        )
    method = None if reduction is None else reduction.value
    result = modes(mechanism, parameters, n=n, order=order.value, reduction=method, **how)
    if strict:
        result.raise_warnings()
    pictures: list[Path] = []
    if plot is not None:
        from flexura.view import save_modes

        pictures = save_modes(result, plot, **pictured)
    if as_json:
        print_result(result.to_dict(), pictures)
    else:
        print_modes(result, pictures)


def buckling_command(
    file: File,
    gravity: Gravity = None,
    load: Loads = None,
    actuator: Commands = None,
    n: Annotated[int, typer.Option("-n", min=1, max=100, help="Number of frequencies and buckling factors.")] = 6,
    plot: Plot = None,
    dpi: Dpi = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Axial forces, frequencies about the state under gravity and dead loads, and the load at which it buckles."""
    from flexura.analysis import preload

    pictured = of_pictures(plot, dpi=dpi)
    mechanism, parameters = read(file, set)
    loads = loads_of(load)
    commands = CommandReader(mechanism, parameters).values("--actuator", actuator)
    g = gravity_of(gravity)
    state = preload(mechanism, parameters, gravity=g, loads=loads, actuators=commands)
    if strict:
        state.raise_warnings()
    data = state.to_dict(n)
    pictures: list[Path] = []
    if plot is not None:
        from flexura.view import save_preload

        pictures = save_preload(state, plot, **pictured)
    if as_json:
        print_result(data, pictures)
    else:
        print_buckling(data, pictures)


def print_modes(result: Modes, pictures: list[Path]) -> None:
    """Print frequencies of both models, what moves, and the evidence."""
    console = console_of_width()
    full_only = result.evidence.low_residual is None
    beside = any(mode.full_frequency_hz is not None for mode in result.modes) and not full_only
    title = f"{result.name}: {'full model' if full_only else 'low-order model'}, order {result.order}"
    console.print(title + ("" if full_only else f" (full model {result.full_order})"), style="bold", markup=False)
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("mode", justify="right")
    hertz = {"frequency [Hz]": [mode.frequency_cell for mode in result.modes]}
    if beside:
        full = [mode.full_frequency_hz for mode in result.modes]
        hertz["full [Hz]"] = ["none" if own is None else own for own in full]
    (own, own_cells), *other = text_columns(hertz).items()
    table.add_column(escape(own), justify="right")
    table.add_column("rad/s", justify="right")
    for heading, _ in other:
        table.add_column(escape(heading), justify="right")
        table.add_column("difference", justify="right")
    table.add_column("proven", justify="right")
    table.add_column("model error", justify="right")
    meshed = any(mode.mesh_error is not None for mode in result.modes)
    if meshed:
        table.add_column("meshes", justify="right")
    table.add_column("what moves", overflow="fold")
    for k, (mode, error) in enumerate(zip(result.modes, result.model_errors.texts, strict=True)):
        row = [str(mode.number), own_cells[k], number(mode.angular_frequency), *(cells[k] for _, cells in other)]
        if beside:
            row += [mode.difference_text]
        row += [mode.proven_text, error]
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


def _print_evidence(console: Console, evidence: Evidence) -> None:
    console.print("evidence", style="bold")
    for line in evidence.lines:
        console.print("  " + line, markup=False)
    if evidence.complete:
        console.print("  no mode is missing in this range", style="green")
        return
    count = len(evidence.missed) + evidence.more_missed
    if not evidence.is_counted:
        console.print("  round-off hides whether a mode is missing in this range", style="red")
        return
    modes = "mode in this range is" if count == 1 else "modes in this range are"
    console.print(f"  {count} {modes} MISSING from the low-order model:", style="red")
    for missed in evidence.missed[:12]:
        console.print(f"    {quantity(missed.frequency_hz, 'Hz')}: {missed.summary}", markup=False)
    rest = len(evidence.missed) - 12 + evidence.more_missed
    if rest > 0:
        console.print(f"    and {rest} more", markup=False)
    console.print(
        "  keep fixed-interface normal modes to see them: --tolerance 1e-3 --up-to 'F Hz', or --keep 2", markup=False
    )


def print_buckling(data: dict[str, Any], pictures: Sequence[Path] = ()) -> None:
    """Print frequencies with and without load, buckling factors, and the members that carry most."""
    from flexura.linalg import ranked
    from flexura.reduction import proven_text

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
            cells += [number(hz), proven_text(hz, (lower, upper), own["is_indexed"][k], upper == 0)]
        table.add_row(str(k + 1), *cells)
    console.print(table)
    factors = ", ".join(number(f) for f in data["buckling_factors"]) or "none: no load of this direction buckles it"
    console.print(f"buckling factors on all loads: {factors}", markup=False)
    forces = list(data["axial_force"].items())
    for i in ranked([max(abs(f) for f in own) for _, own in forces])[:10]:
        name, (least, most) = forces[i]
        console.print(f"axial force in {name}: {ends((least, most), 'N')}", markup=False)
    print_warnings(console, (w["text"] for w in data["warnings"]))
    for path in pictures:
        console.print(f"wrote {path}", markup=False)
