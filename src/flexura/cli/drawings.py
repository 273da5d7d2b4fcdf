"""The command `understand`: a drawing as a mechanism."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flexura.cli.amounts import length_of
from flexura.cli.options import Answer, command, say


@command(reads=False)
def understand_command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Drawing (DXF, SVG).")],
    thickness: Annotated[str, typer.Option(metavar="LENGTH", help="Thickness of the part, e.g. '10 mm'.")],
    material: Annotated[
        str,
        typer.Option(
            metavar="MATERIAL",
            help="Name in the catalogue, e.g. Al-7075-T6, or 'E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3'.",
        ),
    ],
    hold: Annotated[
        str, typer.Option(metavar="PLANE", help="Where it is held, e.g. 'x = 0 mm', or a layer of the drawing.")
    ],
    n: Annotated[int, typer.Option("-n", min=1, max=100, help="Number of modes.")] = 6,
    units: Annotated[
        str | None, typer.Option(metavar="UNIT", help="Unit of the drawing, e.g. mm, where the file has none.")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the mechanism file here, as .yaml.")] = None,
    with_solid: Annotated[
        bool, typer.Option("--with-solid/--without-solid", help="The solid of the drawing beside the description.")
    ] = True,
) -> Answer:
    """A drawing (DXF, SVG) of a planar part as a mechanism of flexures and bodies, beside its own solid."""
    from flexura.modelfile import save
    from flexura.understanding import understand

    result = understand(
        file,
        thickness=length_of(thickness, "--thickness"),
        material=material,
        hold=hold,
        n=n,
        units=units,
        with_solid=with_solid,
        progress=say,
    )

    def write() -> list[Path]:
        if out is not None:
            save(result.mechanism, out)
        return [] if out is None else [out]

    return Answer(result, write=write)
