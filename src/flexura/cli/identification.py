"""The command that identifies modes from measured data."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexura.cli.options import Channels, Json, Plot, Repeated, band_of, print_result, selected
from flexura.cli.tables import columns_table, console_of_width, left
from flexura.tables import counted, number, percent, scale_for

if TYPE_CHECKING:
    from flexura.testing.measurement import IdentifiedModes


class Setups(StrEnum):
    """How several placements of sensors are identified."""

    each = "each"
    together = "together"


def identify_command(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Measured data (UFF, CSV, npz, HDF5).")],
    band: Annotated[str | None, typer.Option(metavar="FROM,TO", help="Only in this band, e.g. '5,200 Hz'.")] = None,
    select: Annotated[
        str | None,
        typer.Option(metavar="F1,F2", help="The modes nearest to these frequencies, and no others, e.g. '12,40 Hz'."),
    ] = None,
    order: Annotated[int | None, typer.Option(min=2, max=500, help="Order of the largest model.")] = None,
    setups: Annotated[
        Setups, typer.Option(help="Each placement of sensors by itself, then merged; or all as one.")
    ] = Setups.each,
    refine: Annotated[
        bool, typer.Option("--refine/--no-refine", help="Fit poles and shapes together to the responses.")
    ] = True,
    most_damped: Annotated[float, typer.Option(metavar="RATIO", help="Poles above this damping ratio are none.")] = 0.2,
    least_confidence: Annotated[
        float, typer.Option(metavar="NUMBER", help="Modes of less confidence are left out, unless picked.")
    ] = 0.3,
    channels: Channels = None,
    repeated: Repeated = None,
    plot: Plot = None,
    as_json: Json = False,
) -> None:
    """Modes of a test: frequencies, damping, complexity of shapes, and the confidence in each."""
    from flexura.io import read_measurement
    from flexura.testing.identification import identify

    measurement = read_measurement(data, channels=channels, repeated=None if repeated is None else repeated.value)
    result = identify(
        measurement,
        band=None if band is None else band_of(band),
        order=order,
        select=selected(select),
        setups=setups.value,
        refine=refine,
        most_damped=most_damped,
        least_confidence=least_confidence,
    )
    written: list[Path] = []
    if plot is not None:
        from flexura.view import save_identification

        written = save_identification(result, plot, data=measurement)
    if as_json:
        print_result(result.to_dict(), written)
    else:
        print_identified(result, written)


def print_identified(result: IdentifiedModes, written: list[Path]) -> None:
    """Print the modes with their evidence, those of every setup side by side, and notes."""
    console = console_of_width()
    n, p, m = len(result.poles), len(result.outputs), len(result.inputs)
    title = f"{result.name}: {counted(n, 'mode')} from {counted(p, 'output')} and {counted(m, 'input')}"
    console.print(title, style="bold", markup=False)
    several = len(result.setups) > 1
    scale = scale_for(result.frequency_hz, "Hz")
    spread = [e.frequency_spread for e in result.evidence]
    off = [own * hz / scale.size for own, hz in zip(spread, result.frequency_hz, strict=True)]
    columns: dict[str, list[Any]] = {
        "mode": list(range(1, n + 1)),
        scale.heading("frequency"): [
            left(hz / scale.size, own) for hz, own in zip(result.frequency_hz, off, strict=True)
        ],
        scale.heading("+-"): [f"{own:.1g}" for own in off],
        "damping": [
            f"{left(100 * zeta, 100 * zeta * e.damping_spread, 4)} %"
            for zeta, e in zip(result.damping_ratio, result.evidence, strict=True)
        ],
        "+- damping": [
            percent(e.damping_spread, 2) if e.damping_spread < 0.995 else "all of it" for e in result.evidence
        ],
        "confidence": [f"{e.confidence:.2f}" for e in result.evidence],
        "MPC": [f"{e.modal_phase_collinearity:.3f}" for e in result.evidence],
        "MPD": [f"{e.mean_phase_deviation_deg:.2g}°" for e in result.evidence],
    }
    if several:
        columns["setups"] = [f"{e.setups} of {len(result.setups)}" for e in result.evidence]
    console.print(columns_table(columns, left=0))
    if several:
        each = [", ".join(number(f / scale.size, 6) for f in own.frequency_hz) for own in result.setups]
        console.print(columns_table({"setup": [own.name for own in result.setups], scale.heading("modes"): each}, 2))
    console.print(f"synthesis error {percent(result.synthesis_error, 2)}", markup=False)
    for note in result.notes:
        console.print(note, markup=False)
    for path in written:
        console.print(f"wrote {path}", markup=False)
