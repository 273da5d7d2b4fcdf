"""The command `verify`: beams against the solid."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from flexura.cli.options import Answer, File, Settings, command, say, settings_of
from flexura.errors import OptionError

if TYPE_CHECKING:
    pass


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
        return Answer(result, write=lambda: written)
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

    return Answer(done, write=write, is_interrupted=interrupted)


def _write_step(mechanism: Any, parameters: dict[str, float], path: Path) -> Path:
    from flexura.fem import as_beams
    from flexura.full_order import assemble
    from flexura.solid.interchange import write_step

    say(f"solids to {path}")
    return write_step(assemble(as_beams(mechanism, "auto"), parameters), path)
