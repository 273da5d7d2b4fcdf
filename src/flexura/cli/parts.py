"""The commands `faces` and `model`: parts from CAD or of meshes, what faces they have, and models of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexura.cli.amounts import length_of, quantity_of
from flexura.cli.handover import low_order
from flexura.cli.options import Answer, command, say
from flexura.errors import OptionError

if TYPE_CHECKING:
    from flexura.analysis import Modes
    from flexura.mechanism import Mechanism

Step = Annotated[Path, typer.Argument(metavar="FILE", help="Part (STEP or mesh), or drawing of one (DXF, SVG).")]
Thickness = Annotated[
    str | None, typer.Option(metavar="LENGTH", help="Thickness of the part of a drawing, e.g. '10 mm'.")
]
Unit = Annotated[str | None, typer.Option(metavar="UNIT", help="Unit of length of a mesh: mm, um, cm, m or in.")]


@command(
    "dpi",
    plot="Write a picture of the faces with their numbers here.",
    out="Write the faces here: a table, or a page (.html) where a click on a face copies what chooses it.",
    page=True,
    reads=False,
)
def faces_command(
    file: Step,
    thickness: Thickness = None,
    unit: Unit = None,
) -> Answer:
    """Faces of a part from CAD or a mesh: number, name, colour, kind and place of each, and what chooses it."""
    from flexura.fem import faces

    limit = None if thickness is None else length_of(thickness, "--thickness")
    return Answer(faces(file, thickness=limit, unit=unit), pictures="draw_faces")


@command("strict", reads=False)
def model_command(
    file: Step,
    material: Annotated[
        str,
        typer.Option(metavar="NAME", help="Of the catalogue, or 'E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3'."),
    ],
    hold: Annotated[
        list[str] | None,
        typer.Option(
            "--hold", metavar="FACES", help="Held faces: a name, number or 'plane x = 0 mm'. May be repeated."
        ),
    ] = None,
    interface: Annotated[
        list[str] | None,
        typer.Option(
            "--interface",
            metavar="FACES",
            help="Faces that others meet, as [NAME:] faces: 'tip: near 1, 2, 3 mm', 'radius 3 mm'. May be repeated.",
        ),
    ] = None,
    n: Annotated[int, typer.Option("-n", min=1, max=1000, help="Number of modes.")] = 6,
    tolerance: Annotated[
        float | None, typer.Option(metavar="REL", help="Relative error that the model is proven to. By default 1e-3.")
    ] = None,
    up_to: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="All modes up to this frequency, e.g. '2 kHz'.")
    ] = None,
    mesh_tolerance: Annotated[
        str | None, typer.Option(metavar="REL", help="What the mesh may make frequencies wrong by, e.g. '0.5 %'.")
    ] = None,
    thickness: Thickness = None,
    unit: Unit = None,
    offset: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="By how much the part is larger than drawn, on all sides.")
    ] = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            "--out",
            metavar="FILE",
            help="Write a mechanism file (.yaml), a report (.html), or what `export` writes. May be repeated.",
        ),
    ] = None,
) -> Answer:
    """A part from CAD or a mesh as a certified low-order model, with its modes: mechanism file, report, or export."""
    from flexura.analysis import modes
    from flexura.cli.amounts import limit_of
    from flexura.fem import with_solid_parts
    from flexura.modelfile import part_model

    limit = limit_of("--up-to", up_to)
    described = part_model(
        file,
        material=material,
        hold=hold or (),
        interface=interface or (),
        tolerance=tolerance,
        up_to=limit,
        mesh_tolerance=mesh_tolerance,
        thickness=None if thickness is None else length_of(thickness, "--thickness"),
        unit=unit,
        offset=0.0 if offset is None else quantity_of("--offset", offset, "m", "-0.05 mm"),
    )
    targets = out or []
    _refuse_unknown(targets)
    mechanism = with_solid_parts(described, progress=say)
    result = modes(mechanism, n=n, tolerance=tolerance, up_to=limit)

    def write() -> list[Path]:
        return [path for target in targets for path in _written(target, described, result, n, limit)]

    return Answer(result, write=write)


def _refuse_unknown(targets: list[Path]) -> None:
    from flexura.io import format_of

    for path in targets:
        if path.suffix.lower() not in (".yaml", ".yml", ".html"):
            format_of(path)


def _written(path: Path, described: Mechanism, result: Modes, n: int, up_to: float | None) -> list[Path]:
    """What one target gets."""
    from flexura.io import export, format_of, formats

    mechanism = result.model.plan.mechanism
    if path.suffix.lower() in (".yaml", ".yml"):
        from flexura.modelfile import save

        save(described, path)
        return [path]
    if path.suffix.lower() == ".html":
        from flexura.pages.report import report

        return [Path(report(mechanism, n=n, progress=say).write(path))]
    thing: Any
    takes = formats()[format_of(path)].takes
    if "state space" in takes:
        from flexura.mechanism import DOF_NAMES
        from flexura.systems import state_space, system

        (key,) = described.parts
        held = {node for node, support in described.ground.items() if all(support.held)}
        nodes = [f"{key}.{name}" for name in described.parts[key].interfaces if f"{key}.{name}" not in held]
        if not nodes:
            raise OptionError(f"{path}: a state space needs an --interface that is not held, for forces and motions")
        channels = [f"{node}.{axis}" for node in nodes for axis in DOF_NAMES]
        full = system(mechanism, inputs=channels, outputs=channels, order="full")
        thing = state_space(full, n=n if up_to is None else None, up_to=up_to)
    else:
        thing = low_order(mechanism, {}, None, n, up_to) if "low-order model" in takes else result
    return [Path(written) for written in export(thing, path)]
