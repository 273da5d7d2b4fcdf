"""The command that simulates a modal test and says what it would find."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexura.cli.options import File, Json, Plot, Ratio, Settings, band_of, print_result, read, say
from flexura.cli.tables import columns_table, console_of_width
from flexura.tables import ends, percent, quantity

if TYPE_CHECKING:
    from flexura.testing.updating import MeasuredFrequencies
    from flexura.testing.virtual import VirtualTest


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
    console.print(f"{title}, {ends(result.band, 'Hz')}", style="bold", markup=False)
    nothing = result.identified is None
    for note in dict.fromkeys(result.notes) if nothing else ():
        console.print(note, markup=False)
    console.print(columns_table(_mode_columns(result, measured)))
    if len(placements) > 1 and not nothing:
        pairs = {p: [mode.placement_hz[p] for mode in result.modes] for p in placements}
        columns: dict[str, list[Any]] = {"mode": [mode.number for mode in result.modes]}
        columns |= {f"{p} [Hz]": [true for true, _ in own] for p, own in pairs.items()}
        for p, own in pairs.items():
            columns[f"{p} off"] = ["missed" if f is None else f"{100 * (f / t - 1):+.3f} %" for t, f in own]
        console.print(columns_table(columns))
    if result.false_hz:
        listed = ", ".join(quantity(f, "Hz") for f in result.false_hz)
        console.print(f"identified where there is no mode: {listed}", markup=False)
    for note in () if nothing else dict.fromkeys(result.notes):
        console.print(note, markup=False)
    for path in written:
        console.print(f"wrote {path}", markup=False)


def _mode_columns(result: VirtualTest, measured: MeasuredFrequencies | None) -> dict[str, list[Any]]:
    """True and identified modes; damping that nothing was identified for is the true one, in brackets."""
    modes = result.modes
    columns: dict[str, list[Any]] = {
        "mode": [mode.number for mode in modes],
        "no sensors [Hz]": [mode.bare_hz for mode in modes],
        "sensors on [Hz]": [mode.mass_loaded_hz for mode in modes],
        "mass effect": [f"{100 * mode.mass_effect:+.2f} %" for mode in modes],
        "identified [Hz]": [mode.identified_hz for mode in modes],
        "off": [
            "" if result.identified is None else "missed" if mode.error is None else f"{100 * mode.error:+.3f} %"
            for mode in modes
        ],
        "damping": [
            f"({percent(mode.damping_ratio)})"
            if mode.identified_damping is None
            else f"{100 * mode.identified_damping:.3f} %"
            for mode in modes
        ],
        "its error": ["" if mode.damping_error is None else f"{100 * mode.damping_error:+.1f} %" for mode in modes],
        "MAC": ["" if mode.mac is None else f"{mode.mac:.3f}" for mode in modes],
        "confidence": ["" if mode.confidence is None else f"{mode.confidence:.2f}" for mode in modes],
    }
    if measured is not None:
        columns["measured [Hz]"] = [measured.by_number.get(k + 1) for k in range(len(modes))]
    return columns
