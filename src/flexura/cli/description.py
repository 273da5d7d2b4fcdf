"""The commands `check`, `schema` and `view`, and what they print."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import RenderableType
from rich.text import Text

from flexura.cli.options import Answer, At, Dpi, File, Names, Settings, command, print_json, read
from flexura.cli.terminal import columns_table, heading
from flexura.tables import counted, in_mm, quantity, vector

if TYPE_CHECKING:
    from flexura.analysis import CheckReport
    from flexura.mechanism import Mechanism

MOST = 20
"""Of each kind, that are listed."""


@command(plot="Write a picture of the warnings here.")
def check_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    every: Annotated[
        bool, typer.Option("--all", help="Print what moves the six lowest frequencies by less than 1 %, too.")
    ] = False,
) -> Answer:
    """Summary of a mechanism file, and warnings: what may not be meant, and what moves a frequency by 1 % or more."""
    from flexura.analysis import check

    def pictures(report: CheckReport, folder: Path) -> list[Path]:
        from flexura.full_order import assemble
        from flexura.view import save_warnings

        return save_warnings(report, folder, model=assemble(mechanism, parameters))

    report = check(mechanism, parameters)
    return Answer(report, check_text(report, every), pictures, are_warnings_shown=True)


def schema_command() -> None:
    """Print the JSON Schema of mechanism files, for completion in editors."""
    from flexura.modelfile import schema

    print_json(schema())


def view_command(
    file: File,
    *,
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
    from flexura.full_order import assemble

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


def check_text(report: CheckReport, every: bool = False) -> Iterator[RenderableType]:
    """The summary of a mechanism, and warnings, every one or those that matter."""
    yield heading(report.name)
    yield f"full order {report.full_order}, low order {report.low_order}"
    yield f"mass {quantity(report.mass.mass, 'kg')}, centre of mass ({in_mm(report.mass.centre)}) mm"
    yield columns_table(report.substructure_columns())
    yield from _lines("rigid body", {body: quantity(mass, "kg") for body, mass in report.rigid_bodies.items()}, 10)
    held = [f"held: {node} {'clamped' if len(dofs) == 6 else ' '.join(dofs)}" for node, dofs in report.held.items()]
    yield from held[:MOST]
    if len(held) > MOST:
        yield f"held: and {len(held) - MOST} more nodes"
    yield from _corrections(report)
    yield from _lines("solid part", {name: str(mesh) for name, mesh in report.solid_parts.items()})
    yield from _lines("actuator", report.actuators)
    yield from _lines("sensor", report.sensors)
    if report.damping != "none" or report.actuators or report.sensors:
        yield f"damping: {report.damping}"
    yield from _lines("study", report.studies)
    yield from _loads(report)
    motions = [counted(report.rigid_body_modes, "rigid-body mode")] if report.rigid_body_modes else []
    if report.lowest_hz is not None:
        motions.append(f"lowest {'other ' if motions else ''}frequency {report.lowest_text}")
    if motions:
        yield "; ".join(motions)
    shown = (*report.warnings, *(report.minor if every else ()))
    hidden = "" if every or not report.minor else f"; {len(report.minor)} smaller with --all"
    count = counted(len(shown), "warning") if shown else "no warnings"
    yield Text(f"{count}{hidden}", style="yellow" if shown else "green")
    yield from (f"  {warning}" for warning in shown)


def _lines(kind: str, texts: Mapping[str, str], most: int = MOST) -> Iterator[str]:
    """One line for each of a kind, up to so many."""
    for name, text in list(texts.items())[:most]:
        yield f"{kind} {name}: {text}"
    if len(texts) > most:
        yield f"{kind}: and {len(texts) - most} more"


def _loads(report: CheckReport) -> Iterator[str]:
    """Loads and gravity, and that stiffness is about the state under them."""
    for node, wrench in list(report.loads.items())[:MOST]:
        parts = [vector(w, unit) for w, unit in ((wrench[:3], "N"), (wrench[3:], "N*m")) if any(w)]
        yield f"load on {node}: {', '.join(parts) or 'none'}"
    if len(report.loads) > MOST:
        yield f"load: on {len(report.loads) - MOST} more nodes"
    if any(report.gravity):
        yield f"gravity: {vector(report.gravity, 'm/s^2')}"
    if report.is_preloaded:
        yield "preloaded: stiffness, and all that follows from it, is about the state under these"


def _corrections(report: CheckReport) -> Iterator[str]:
    """One line for every set of corrections: the members that have it, with their ends unless both are clamped."""
    members: dict[tuple[str, ...], list[str]] = {}
    for place, names in report.corrections.items():
        ends = report.ends[place]
        strip = {"plate", "warping"} & set(names)
        shown = place if ends == ("clamped", "clamped") or not strip else f"{place} ({', '.join(ends)})"
        members.setdefault(names, []).append(shown)
    for names, places in members.items():
        more = f", ... ({len(places)})" if len(places) > 4 else ""
        yield f"corrected for {', '.join(names)}: {', '.join(places[:4])}{more}"
