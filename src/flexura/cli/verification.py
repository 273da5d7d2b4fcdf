"""Beams against the solid on a terminal, and as files."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from flexura.cli.options import File, Json, Settings, print_result, say, settings_of
from flexura.cli.tables import columns_table, console_of_width
from flexura.errors import OptionError
from flexura.tables import Scale, number, quantity, scale_for

if TYPE_CHECKING:
    from flexura.mechanism import Mechanism
    from flexura.solid.verification import Verification, VerificationRow, WholeVerification

GAP = 2
"""Spaces between columns."""

POOR = 0.9
"""A modal assurance criterion below this is marked."""


DESCRIBED = {
    "plain": "none is corrected, as in the plain rows",
    "corrected": "as in the corrected rows",
    "as described": "solid ones, or some corrected and some not: as described",
}
"""What the file says of its members."""


class SolidSolver(StrEnum):
    """What makes the matrices of the solid."""

    flexura = "flexura"
    calculix = "calculix"


def verify_command(
    file: File,
    n: Annotated[int, typer.Option("-n", min=1, max=100, help="Number of modes.")] = 6,
    size: Annotated[
        float | None,
        typer.Option(metavar="FACTOR", help="Size of the fine mesh's cells; 1 is the mesher's own, the default 0.7."),
    ] = None,
    solver: Annotated[
        SolidSolver, typer.Option(help="Finite elements of the solid: flexura's own, or CalculiX.")
    ] = SolidSolver.flexura,
    whole: Annotated[
        bool,
        typer.Option(
            "--whole", help="The part itself as one solid, nothing rigid but what is held; what each assumption makes."
        ),
    ] = False,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the solids here, as .step.")] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write pictures of beams and solid side by side here.")
    ] = None,
    set: Settings = None,
    as_json: Json = False,
) -> None:
    """Beam models, plain and corrected, against solid finite elements of the same mechanism, mode by mode."""
    from flexura.modelfile import load
    from flexura.solid.verification import progressively, verify

    mechanism = load(file)
    parameters = settings_of(mechanism, set)
    written = [] if out is None else [_write_step(mechanism, parameters, out)]
    if whole:
        if plot is not None:
            raise OptionError("--whole has a table, and no pictures; leave --plot out")
        result = verify(mechanism, parameters, n=n, size=size, solver=solver.value, whole=True, progress=say)
        if as_json:
            print_result(result.to_dict(), written)
        else:
            print_whole(result, written)
        return
    done, interrupted = None, False
    try:
        for so_far in progressively(
            mechanism, n=n, size=size, parameters=parameters, solver=solver.value, progress=say
        ):
            done = so_far
    except KeyboardInterrupt:
        interrupted = True
    if done is not None and plot is not None and done.shapes is not None:
        from flexura.view import save_verification

        written += save_verification(done, plot)
    if done is not None and as_json:
        print_result(done.to_dict(), written)
    elif done is not None:
        print_verification(done, written)
    if interrupted:
        sys.stderr.write("flexura: interrupted; what was done is shown\n")
        raise SystemExit(130)


def _write_step(mechanism: Mechanism, parameters: dict[str, float], path: Path) -> Path:
    from flexura.solid.fem import as_beams
    from flexura.solid.interchange import write_step
    from flexura.structure import assemble

    say(f"solids to {path}")
    return write_step(assemble(as_beams(mechanism, "auto"), parameters), path)


def print_verification(result: Verification, written: list[Path]) -> None:
    """Print a row for every model and a column for every mode of the solid, then the evidence.

    Modes that do not fit beside each other follow in further tables.
    """
    console = console_of_width()
    against = "errors against the converged solid" if result.solids else "no solid yet: modes by their own numbers"
    hz = [own for row in (*result.rows, *result.solids) for own in row.frequency_hz if own is not None]
    scale = scale_for(hz, "Hz")
    console.print(f"{result.name}: frequencies in {scale.unit}, {against}", style="bold", markup=False)
    left = _columns(result)
    modes = [
        [
            f"mode {k + 1}",
            *(_cell(row, k, scale) for row in result.rows if not row.failure),
            *_solid_cells(result, k, scale),
        ]
        for k in range(max([len(result.frequency_hz), *(len(row.frequency_hz) for row in result.rows)]))
    ]
    while modes:
        room = console.width - sum(max(map(len, column)) + GAP for column in left)
        fitting = 0
        while fitting < len(modes) and room >= (need := max(map(len, modes[fitting]))):
            room, fitting = room - need - GAP, fitting + 1
        console.print(_table([*left, *modes[: max(fitting, 1)]], bold=len(result.solids) > 0))
        left, modes = left[:1], modes[max(fitting, 1) :]
        if modes:
            console.print()
    for text in _remarks(result):
        console.print(text, markup=False)
    for path in written:
        console.print(f"wrote {path}", markup=False)


def print_whole(result: WholeVerification, written: list[Path]) -> None:
    """Print a row for every mode of the whole part, then what is held how and lumped, and the mesh."""
    console = console_of_width()
    console.print(f"{result.name}: the part as one solid beside the described model", style="bold", markup=False)
    console.print(columns_table(result.columns()))
    said = [
        "difference: described over whole; beams: beam theory; roots, bodies, ground: what elastic roots lower, and",
        "what rigid bodies and a rigid ground would raise",
        *result.notes,
        f"{result.cells} curved cells of order {result.order}, {result.dofs} DOFs, {_seconds(result.seconds)}",
    ]
    for text in (*said, *(f"wrote {path}" for path in written)):
        console.print(text, markup=False)


def _table(columns: list[list[str]], bold: bool) -> Table:
    """A table of columns with their headings; the last row in bold where it is the solid's limit."""
    table = Table(box=None, pad_edge=False, padding=(0, GAP, 0, 0), header_style="bold")
    for k, (heading, *_) in enumerate(columns):
        table.add_column(heading, justify="right" if k else "left", no_wrap=True)
    rows = list(zip(*(cells for _, *cells in columns), strict=True))
    for k, row in enumerate(rows):
        table.add_row(*row, style="bold" if bold and k == len(rows) - 1 else None)
    return table


def _columns(result: Verification) -> list[list[str]]:
    """Columns before the modes, headings first."""
    columns = [["model"], ["DOFs"], ["time"], ["worst"]]
    for row in result.rows:
        if not row.failure:
            worst = "" if row.worst_error is None else f"{100 * row.worst_error:+.2g} %"
            own = row.model, "" if row.order is None else str(row.order), _seconds(row.seconds or 0.0), worst
            for column, cell in zip(columns, own, strict=True):
                column.append(cell)
    for solid in result.solids:
        worst = max((e for e in solid.error if e is not None), key=abs, default=0.0)
        own = f"solid, size {solid.size:.3g}", str(solid.dofs), _seconds(solid.seconds), f"{100 * worst:+.2g} %"
        for column, cell in zip(columns, own, strict=True):
            column.append(cell)
    if result.solids:
        for column, cell in zip(columns, ("solid, limit", "", "", ""), strict=True):
            column.append(cell)
    return columns


def _seconds(seconds: float) -> str:
    return quantity(seconds, "s", 3)


def _cell(row: VerificationRow, k: int, scale: Scale) -> str:
    """A frequency with its error, marked where the two shapes differ visibly."""
    hz = row.frequency_hz[k] if k < len(row.frequency_hz) else None
    if hz is None or not row.error:
        return _with_error(hz, None, scale)
    mac = row.mac[k]
    return _with_error(hz, row.error[k], scale, "*" if mac is not None and mac < POOR else "")


def _solid_cells(result: Verification, k: int, scale: Scale) -> list[str]:
    if not result.solids:
        return []
    solids = [_with_error(solid.frequency_hz[k], solid.error[k], scale) for solid in result.solids]
    return [*solids, _with_error(result.frequency_hz[k], None, scale)]


def _with_error(hz: float | None, error: float | None, scale: Scale, mark: str = "") -> str:
    if hz is None:
        return "none"
    return f"{number(hz / scale.size)}{mark}" + ("" if error is None else f" {100 * error:+.2f}%")


def _remarks(result: Verification) -> list[str]:
    """What the file itself says, failures, the solid's own error, the masses."""
    said = [f"members of the file itself: {DESCRIBED[result.described]}"]
    said += [f"{row.model}: {row.failure}" for row in result.rows if row.failure]
    said += result.notes
    if not result.solids:
        return said
    doubtful = [
        f"{row.model} mode {k + 1} MAC {mac:.2f}"
        for row in result.rows
        for k, mac in enumerate(row.mac)
        if mac is not None and mac < POOR
    ]
    if doubtful:
        said.append(f"* shapes differ: {', '.join(doubtful)}")
    if len(result.solids) == 1:
        said.append("one mesh: how far it is from the limit is not known")
    else:
        each = ", ".join("unknown" if u is None else f"{100 * u:.2g}" for u in result.uncertainty)
        said.append(f"limit estimated from {len(result.solids)} meshes, uncertain by {each} %")
    finest = result.solids[-1]
    said.append(
        f"fine mesh: {finest.cells} distinct cells, {finest.meshed_dofs} DOFs of {finest.dofs} placed,"
        f" reduced to {finest.order}; solver {result.solver}"
    )
    if result.mass_error is not None:
        said.append(
            f"mass of members {quantity(result.beam_mass, 'kg')} as beams,"
            f" {quantity(result.solid_mass, 'kg')} as solids"
            f" ({'equal' if abs(result.mass_error) < 1e-6 else f'{100 * result.mass_error:+.2g} %'})"
        )
    return said
