"""The command that turns time records of a test into frequency responses."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from flexura.cli.options import Channels, Json, band_of, print_result, quantity_of
from flexura.cli.tables import console_of_width


class EstimatorName(StrEnum):
    """Where noise is: in the outputs, in the input, in both."""

    H1 = "H1"
    H2 = "H2"
    Hv = "Hv"


def estimate_frf_command(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Time records (UFF, CSV, npz, HDF5), or a folder.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the responses here, by suffix.")] = None,
    estimator: Annotated[EstimatorName, typer.Option(help="H1, H2 or Hv.")] = EstimatorName.H1,
    exponential: Annotated[
        float | None, typer.Option(metavar="VALUE", help="Exponential window: its value at the end of the record.")
    ] = None,
    force_window: Annotated[
        str | None, typer.Option(metavar="TIME", help="The force counts for so long after the pulse began, e.g. 8ms.")
    ] = None,
    band: Annotated[
        str | None, typer.Option(metavar="FROM,TO", help="Keep the lines in this band, e.g. '5,200 Hz'.")
    ] = None,
    duration: Annotated[str | None, typer.Option(metavar="TIME", help="Cut records to this, e.g. 4s.")] = None,
    accept: Annotated[
        list[str] | None, typer.Option(metavar="DEFECT", help="Use records with this defect. May be repeated.")
    ] = None,
    channels: Channels = None,
    as_json: Json = False,
) -> None:
    """Frequency responses from hits: windows, averages, coherence; bad records are named and left out."""
    from flexura.io import read_measurement, write_measurement
    from flexura.testing.measurement import Measurement, estimate_frf

    measurement = read_measurement(data, channels)
    frfs = estimate_frf(
        measurement,
        estimator=estimator.value,
        exponential=exponential,
        force_window=None if force_window is None else quantity_of("--force-window", force_window, "s", "8ms"),
        band=None if band is None else band_of(band),
        duration=None if duration is None else quantity_of("--duration", duration, "s", "4s"),
        accept=accept or (),
    )
    written = [] if out is None else [write_measurement(Measurement(measurement.name, (), frfs), out)]
    estimated = Measurement(measurement.name, measurement.recordings, frfs, measurement.notes).to_dict()
    if as_json:
        print_result(estimated, written)
        return
    rows = estimated["responses"]
    from flexura.tables import counted

    console = console_of_width()
    console.print(f"{measurement.name}: {counted(len(measurement.recordings), 'record')}", style="bold", markup=False)
    table = Table("setup", "inputs", "outputs", "lines", "Hz", "averages", "coherence", box=None, pad_edge=False)
    for row in rows:
        median = row["median_coherence"]
        spans = f"{row['from_hz']:.5g} - {row['to_hz']:.5g}", str(row["averages"])
        names = (escape(", ".join(row[key])) for key in ("inputs", "outputs"))
        table.add_row(
            escape(row["setup"]), *names, str(row["lines"]), *spans, "" if median is None else f"{median:.3f}"
        )
    console.print(table)
    for note in dict.fromkeys((*measurement.notes, *(n for row in rows for n in row["notes"]))):
        console.print(note, markup=False)
    for path in written:
        console.print(f"wrote {path}", markup=False)
