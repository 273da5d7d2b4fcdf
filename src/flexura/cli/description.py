"""The commands `check`, `schema` and `view`, and what they print."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexura.cli.options import Answer, At, Dpi, File, Names, Settings, command, print_json, read
from flexura.tables import Line, counted

if TYPE_CHECKING:
    from flexura.analysis import CheckReport
    from flexura.mechanism import Mechanism


@command(plot="Write a picture of the warnings here.")
def check_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    every: Annotated[
        bool, typer.Option("--all", help="Print what moves the six lowest frequencies by less than 1 %, too.")
    ] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit with 1 where a requirement is missed or not known.")
    ] = False,
) -> Answer:
    """Summary of a mechanism file, and warnings: what may not be meant, and what moves a frequency by 1 % or more."""
    from flexura.analysis import check
    from flexura.full_order import plan_of
    from flexura.study.requirements import requirements

    def pictures(report: CheckReport, folder: Path) -> list[Path]:
        from flexura.full_order import assemble
        from flexura.view import save_warnings

        return save_warnings(report, folder, model=assemble(mechanism, parameters))

    plan = plan_of(mechanism, parameters)
    report = check(plan, parameters)
    shown = (*report.warnings, *(report.minor if every else ()))
    hidden = "" if every or not report.minor else f"; {len(report.minor)} smaller with --all"
    count = counted(len(shown), "warning") if shown else "no warnings"
    lines = [Line(f"{count}{hidden}", "bad" if shown else "good"), *(Line(f"  {warning}") for warning in shown)]
    required = requirements(plan, parameters)

    def data() -> dict[str, Any]:
        return {**report.to_dict(), "requirements": required.to_dict()["requirements"]}

    def refuse() -> None:
        """End with 1 where something is missed, or not known."""
        required.raise_warnings()

    limits = (Line(f"  {limit}") for limit in required.limits)
    items = [*report.presentation(), *lines, *required.presentation(), *limits]
    return Answer(report, items, pictures, data=data, are_warnings_shown=True, after=refuse if strict else None)


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
