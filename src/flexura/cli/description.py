"""The commands `check`, `schema` and `view`, and what they print."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from flexura.cli.options import At, Dpi, File, Json, Names, Settings, print_json, print_result, read
from flexura.cli.tables import columns_table, console_of_width
from flexura.tables import counted, in_mm, quantity, vector

if TYPE_CHECKING:
    from flexura.analysis import CheckReport


def check_command(
    file: File,
    set: Settings = None,
    every: Annotated[
        bool, typer.Option("--all", help="Print what moves the six lowest frequencies by less than 1 %, too.")
    ] = False,
    as_json: Json = False,
    plot: Annotated[Path | None, typer.Option(metavar="DIR", help="Write a picture of the warnings here.")] = None,
) -> None:
    """Summary of a mechanism file, and warnings: what may not be meant, and what moves a frequency by 1 % or more."""
    from flexura.analysis import check

    mechanism, parameters = read(file, set)
    report = check(mechanism, parameters)
    pictures: list[Path] = []
    if plot is not None:
        from flexura.structure import assemble
        from flexura.view import save_warnings

        pictures = save_warnings(report, plot, model=assemble(mechanism, parameters))
    if as_json:
        print_result(report.to_dict(), pictures)
    else:
        print_check(report, pictures, every)


def schema_command() -> None:
    """Print the JSON Schema of mechanism files, for completion in editors."""
    from flexura.modelfile import schema

    print_json(schema())


def view_command(
    file: File,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="DIR", help="Write a picture here; without --out where you are.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write it here in three dimensions, one HTML file.")
    ] = None,
    n: Annotated[int, typer.Option("-n", min=0, max=100, help="Number of modes that move in that file.")] = 6,
    names: Names = False,
    dpi: Dpi = None,
    at: At = None,
    set: Settings = None,
) -> None:
    """Draw the mechanism, undeformed or at a pose, or show it in three dimensions with its modes."""
    from flexura.structure import assemble

    mechanism, parameters = read(file, set, at)
    model = assemble(mechanism, parameters)
    written: list[Path] = []
    if out is not None:
        from flexura.analysis import modes
        from flexura.pages.viewer import show

        written.append(show(model, [modes(mechanism, parameters, n=n)] if n else []).save(out))
    if plot is not None or out is None:
        from flexura.view import save_pictures

        written += save_pictures(model, plot or Path(), names=names, dpi=150 if dpi is None else dpi)
    for path in written:
        typer.echo(str(path))


_COLOURS = ("yellow", "green")


def print_check(report: CheckReport, pictures: Sequence[Path] = (), every: bool = False) -> None:
    """Print the summary of a mechanism, and warnings, every one or those that matter."""
    console = console_of_width()
    console.print(report.name, style="bold", markup=False)
    console.print(f"full order {report.full_order}, low order {report.low_order}", markup=False)
    console.print(
        f"mass {quantity(report.mass.mass, 'kg')}, centre of mass ({in_mm(report.mass.centre)}) mm", markup=False
    )
    console.print(columns_table(report.substructure_columns()))
    for body, mass in list(report.rigid_bodies.items())[:10]:
        console.print(f"rigid body {body}: {quantity(mass, 'kg')}", markup=False)
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
    _print_named(console, "study", report.studies)
    _print_loads(console, report)
    _print_free_motions(console, report)
    shown = (*report.warnings, *(report.minor if every else ()))
    hidden = "" if every or not report.minor else f"; {len(report.minor)} smaller with --all"
    console.print(f"{counted(len(shown), 'warning') if shown else 'no warnings'}{hidden}", style=_COLOURS[not shown])
    for doubt in shown:
        console.print(f"  {doubt}", markup=False)
    for path in pictures:
        console.print(f"wrote {path}", markup=False, highlight=False)


def _print_named(console: Console, what: str, about: Mapping[str, str]) -> None:
    """Print one line for each of a kind, up to twenty."""
    for name, text in list(about.items())[:20]:
        console.print(f"{what} {name}: {text}", markup=False)
    if len(about) > 20:
        console.print(f"{what}: and {len(about) - 20} more")


def _print_loads(console: Console, report: CheckReport) -> None:
    """Loads and gravity, and that stiffness is about the state under them."""
    for node, wrench in list(report.loads.items())[:20]:
        parts = [vector(w, unit) for w, unit in ((wrench[:3], "N"), (wrench[3:], "N*m")) if any(w)]
        console.print(f"load on {node}: {', '.join(parts) or 'none'}", markup=False)
    if len(report.loads) > 20:
        console.print(f"load: on {len(report.loads) - 20} more nodes")
    if any(report.gravity):
        console.print(f"gravity: {vector(report.gravity, 'm/s^2')}", markup=False)
    if report.is_preloaded:
        console.print(
            "preloaded: stiffness, and all that follows from it, is about the state under these", markup=False
        )


def _print_free_motions(console: Console, report: CheckReport) -> None:
    """What is proven about the lowest frequencies."""
    words = []
    if report.rigid_body_modes:
        words.append(counted(report.rigid_body_modes, "rigid-body mode"))
    if report.lowest_hz is not None:
        words.append(f"lowest {'other ' if report.rigid_body_modes else ''}frequency {report.lowest_text}")
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
