"""The command `verify`: beams against the solid."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import RenderableType
from rich.table import Table

from flexura.cli.options import Answer, File, Settings, command, say, settings_of
from flexura.cli.terminal import columns_table, console_of_width, heading
from flexura.errors import OptionError
from flexura.tables import Scale, number, quantity, scale_for

if TYPE_CHECKING:
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


@command(reads=False)
def verify_command(
    file: File,
    n: Annotated[int, typer.Option("-n", min=1, max=100, help="Number of modes.")] = 6,
    size: Annotated[
        float | None,
        typer.Option(metavar="FACTOR", help="Size of the fine mesh's cells; 1 is the mesher's own, the default 0.7."),
    ] = None,
    solver: Annotated[
        Literal["flexura", "calculix"], typer.Option(help="Finite elements of the solid: flexura's own, or CalculiX.")
    ] = "flexura",
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
) -> Answer:
    """Beam models, plain and corrected, against solid finite elements of the same mechanism, mode by mode."""
    from flexura.modelfile import load
    from flexura.solid.verification import progressively, verify

    if whole and plot is not None:
        raise OptionError("--whole has a table, and no pictures; leave --plot out")
    mechanism = load(file)
    parameters = settings_of(mechanism, set)
    written = [] if out is None else [_write_step(mechanism, parameters, out)]
    if whole:
        result = verify(mechanism, parameters, n=n, size=size, solver=solver, whole=True, progress=say)
        return Answer(result, whole_text(result), write=lambda: written)
    done, interrupted = None, False
    steps = progressively(mechanism, n=n, size=size, parameters=parameters, solver=solver, progress=say)
    try:
        for so_far in steps:
            done = so_far
    except KeyboardInterrupt:
        interrupted = True

    def write() -> list[Path]:
        if done is None or plot is None or done.shapes is None:
            return written
        from flexura.view import save_verification

        return written + save_verification(done, plot)

    text = () if done is None else verification_text(done)
    return Answer(done, text, write=write, is_interrupted=interrupted)


def _write_step(mechanism: Any, parameters: dict[str, float], path: Path) -> Path:
    from flexura.fem import as_beams
    from flexura.full_order import assemble
    from flexura.solid.interchange import write_step

    say(f"solids to {path}")
    return write_step(assemble(as_beams(mechanism, "auto"), parameters), path)


def verification_text(result: Verification, width: int | None = None) -> Iterator[RenderableType]:
    """A row for every model and a column for every mode of the solid, then the evidence.

    Modes that do not fit beside each other follow in further tables.
    """
    width = width or console_of_width().width
    against = "errors against the converged solid" if result.solids else "no solid yet: modes by their own numbers"
    hz = [f for row in (*result.rows, *result.solids) for f in row.frequency_hz if f is not None]
    scale = scale_for(hz, "Hz")
    yield heading(f"{result.name}: frequencies in {scale.unit}, {against}")
    left = [list(column) for column in zip(*_models(result), strict=True)]
    rows = [row for row in result.rows if not row.failure]
    count = max([len(result.frequency_hz), *(len(row.frequency_hz) for row in result.rows)])
    modes = [
        [f"mode {k + 1}", *(_cell(row, k, scale) for row in rows), *_solid_cells(result, k, scale)]
        for k in range(count)
    ]
    while modes:
        room = width - sum(max(map(len, column)) + GAP for column in left)
        fitting = 0
        while fitting < len(modes) and room >= (need := max(map(len, modes[fitting]))):
            room, fitting = room - need - GAP, fitting + 1
        yield _table([*left, *modes[: max(fitting, 1)]], bold=len(result.solids) > 0)
        left, modes = left[:1], modes[max(fitting, 1) :]
        if modes:
            yield ""
    yield from _remarks(result)


def whole_text(result: WholeVerification) -> Iterator[RenderableType]:
    """A row for every mode of the whole part, then what is held how and lumped, and the mesh."""
    yield heading(f"{result.name}: the part as one solid beside the described model")
    yield columns_table(result.columns())
    yield "difference: described over whole; beams: beam theory; roots, bodies, ground: what elastic roots lower, and"
    yield "what rigid bodies and a rigid ground would raise"
    seconds = quantity(result.seconds, "s", 3)
    yield f"{result.cells} curved cells of order {result.order}, {result.dofs} DOFs, {seconds}"


def _table(columns: list[list[str]], bold: bool) -> Table:
    """A table of columns with their headings; the last row in bold where it is the solid's limit."""
    table = Table(box=None, pad_edge=False, padding=(0, GAP, 0, 0), header_style="bold")
    for k, (name, *_) in enumerate(columns):
        table.add_column(name, justify="right" if k else "left", no_wrap=True)
    rows = list(zip(*(cells for _, *cells in columns), strict=True))
    for k, row in enumerate(rows):
        table.add_row(*row, style="bold" if bold and k == len(rows) - 1 else None)
    return table


def _models(result: Verification) -> Iterator[tuple[str, str, str, str]]:
    """Rows of what stands before the modes, headings first."""
    yield "model", "DOFs", "time", "worst"
    for row in result.rows:
        if not row.failure:
            worst = "" if row.worst_error is None else f"{100 * row.worst_error:+.2g} %"
            order = "" if row.order is None else str(row.order)
            yield row.model, order, quantity(row.seconds or 0.0, "s", 3), worst
    for solid in result.solids:
        worst = max((e for e in solid.error if e is not None), key=abs, default=0.0)
        seconds = quantity(solid.seconds, "s", 3)
        yield f"solid, size {solid.size:.3g}", str(solid.dofs), seconds, f"{100 * worst:+.2g} %"
    if result.solids:
        yield "solid, limit", "", "", ""


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


def _remarks(result: Verification) -> Iterator[str]:
    """What the file itself says, failures, the solid's own error, the masses."""
    yield f"members of the file itself: {DESCRIBED[result.described]}"
    yield from (f"{row.model}: {row.failure}" for row in result.rows if row.failure)
    if not result.solids:
        return
    doubtful = [
        f"{row.model} mode {k + 1} MAC {mac:.2f}"
        for row in result.rows
        for k, mac in enumerate(row.mac)
        if mac is not None and mac < POOR
    ]
    if doubtful:
        yield f"* shapes differ: {', '.join(doubtful)}"
    if len(result.solids) == 1:
        yield "one mesh: how far it is from the limit is not known"
    else:
        each = ", ".join("unknown" if u is None else f"{100 * u:.2g}" for u in result.uncertainty)
        yield f"limit estimated from {len(result.solids)} meshes, uncertain by {each} %"
    finest = result.solids[-1]
    yield (
        f"fine mesh: {finest.cells} distinct cells, {finest.meshed_dofs} DOFs of {finest.dofs} placed,"
        f" reduced to {finest.order}; solver {result.solver}"
    )
    if result.mass_error is not None:
        yield (
            f"mass of members {quantity(result.beam_mass, 'kg')} as beams,"
            f" {quantity(result.solid_mass, 'kg')} as solids"
            f" ({'equal' if abs(result.mass_error) < 1e-6 else f'{100 * result.mass_error:+.2g} %'})"
        )
