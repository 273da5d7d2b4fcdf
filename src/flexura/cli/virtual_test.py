"""The command that simulates a modal test and says what it would find."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from flexura.cli.options import File, Json, Plot, Ratio, Settings, band_of, print_result, read, say
from flexura.cli.tables import console_of_width

if TYPE_CHECKING:
    from flexura.testing.updating import MeasuredFrequencies
    from flexura.testing.virtual import FoundMode, VirtualTest


def virtual_test_command(
    file: File,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write records and responses here, e.g. test.uff.")
    ] = None,
    measured: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Measured frequencies (CSV, YAML) to stand beside.")
    ] = None,
    band: Annotated[
        str | None, typer.Option(metavar="FROM,TO", help="Identify modes in this band, e.g. '5,200 Hz'.")
    ] = None,
    damping: Ratio = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the noise and the peaks of the hits.")] = 0,
    double_hits: Annotated[int, typer.Option(min=0, help="So many more hits at every point bounce.")] = 0,
    set: Settings = None,
    plot: Plot = None,
    as_json: Json = False,
) -> None:
    """Simulate the hammer test that a file describes, identify its modes, and compare them with the truth."""
    from flexura.errors import OptionError
    from flexura.io import write_measurement
    from flexura.testing.updating import read_frequencies
    from flexura.testing.virtual import virtual_test

    mechanism, parameters = read(file, set)
    beside = None if measured is None else read_frequencies(measured)
    test = mechanism.test
    if test is None:
        raise OptionError(f"{file} describes no test: add the key test")
    result = virtual_test(
        mechanism,
        parameters,
        band=None if band is None else band_of(band),
        damping=damping,
        seed=seed,
        double_hits=double_hits,
        progress=say,
    )
    written = [] if out is None else [write_measurement(result.measurement, out)]
    if plot is not None:
        from flexura.view import save_virtual_test

        written += save_virtual_test(result, plot, measured=beside)
    if as_json:
        known = {} if beside is None else beside.by_number
        more = {} if beside is None else {"measured_hz": [known.get(n) for n in range(1, max(known) + 1)]}
        print_result(result.to_dict() | more, written)
    else:
        print_virtual_test(result, written, beside)


def print_virtual_test(result: VirtualTest, written: list[Path], measured: MeasuredFrequencies | None = None) -> None:
    """Print true and identified modes, what the sensors do in every placement, and notes."""
    console = console_of_width()
    placements = list(result.test.placed())
    hits = len(result.measurement.recordings)
    title = f"{result.name}: {hits} hits, {len(placements)} placement{'s' * (len(placements) != 1)}"
    console.print(f"{title}, {result.band[0]:.4g} to {result.band[1]:.4g} Hz", style="bold", markup=False)
    nothing = result.identified is None
    for note in dict.fromkeys(result.notes) if nothing else ():
        console.print(note, markup=False)
    table = _table("mode", "no sensors Hz", "sensors on Hz", "mass effect", "identified Hz", "rad/s", "off")
    for heading in ("damping %", "off", "MAC", "confidence", *(["measured rad/s"] if measured is not None else [])):
        table.add_column(heading, justify="right")
    for k, mode in enumerate(result.modes):
        row = [
            str(mode.number),
            f"{mode.bare_hz:.5g}",
            f"{mode.mass_loaded_hz:.5g}",
            f"{100 * mode.mass_effect:+.2f} %",
        ]
        row += ["", "", "", f"({100 * mode.damping_ratio:.3g})", "", "", ""] if nothing else _identified(mode)
        if measured is not None:
            own = measured.by_number.get(k + 1)
            row.append("" if own is None else f"{2 * math.pi * own:.5g}")
        table.add_row(*row)
    console.print(table)
    if len(placements) > 1 and not nothing:
        table = _table("mode", *(f"{p} Hz" for p in placements), *(f"{p} off" for p in placements))
        for mode in result.modes:
            pairs = [mode.placement_hz[p] for p in placements]
            off = ["missed" if f is None else f"{100 * (f / t - 1):+.3f} %" for t, f in pairs]
            table.add_row(str(mode.number), *(f"{t:.5g}" for t, _ in pairs), *off)
        console.print(table)
    if result.false_hz:
        listed = ", ".join(f"{f:.5g}" for f in result.false_hz)
        console.print(f"identified where there is no mode, Hz: {listed}", markup=False)
    for note in () if nothing else dict.fromkeys(result.notes):
        console.print(note, markup=False)
    for path in written:
        console.print(f"wrote {path}", markup=False)


def _table(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in headings:
        table.add_column(heading, justify="right")
    return table


def _identified(mode: FoundMode) -> list[str]:
    if mode.identified_hz is None or mode.identified_damping is None or mode.mac is None or mode.confidence is None:
        return ["missed", "", "", f"({100 * mode.damping_ratio:.3g})", "", "", ""]
    errors = [f"{100 * (mode.error or 0.0):+.3f} %", f"{100 * mode.identified_damping:.3f}"]
    errors.append("" if mode.damping_error is None else f"{100 * mode.damping_error:+.1f} %")
    hz = mode.identified_hz
    return [f"{hz:.5g}", f"{2 * math.pi * hz:.5g}", *errors, f"{mode.mac:.3f}", f"{mode.confidence:.2f}"]
